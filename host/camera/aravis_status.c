/* What is wrong with a frame, and whether a silent camera is there at all. */
#include "host/camera/aravis_private.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#define GVCP_PORT  3956
#define PING_TRIES 3

bool aravis_answers(const char *address)
{
    static const uint8_t read_privilege[12] = {0x42, 0x01, 0x00, 0x80, 0x00, 0x04, 0x77, 0x65, 0, 0, 0x0a, 0};
    const struct sockaddr_in to = {
        .sin_family = AF_INET, .sin_port = htons(GVCP_PORT), .sin_addr.s_addr = inet_addr(address)};
    const struct timeval wait = {.tv_usec = (suseconds_t)(1e6 * ARAVIS_PING_S / PING_TRIES)};
    uint8_t reply[64];
    bool answered = false;
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0 || connect(fd, (const struct sockaddr *)&to, sizeof to) != 0 ||
        setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait) != 0)
        answered = true; /* nothing is known: let the deadline decide */
    for (int i = 0; i < PING_TRIES && !answered; i++)
        answered = send(fd, read_privilege, sizeof read_privilege, 0) > 0 &&
                   recv(fd, reply, sizeof reply, 0) >= 8 && reply[2] == 0 && reply[3] == 0x81;
    if (fd >= 0)
        close(fd);
    return answered;
}

const char *aravis_status_words(ArvBufferStatus status)
{
    static const struct {
        ArvBufferStatus status;
        const char *words;
    } rows[] = {
        {ARV_BUFFER_STATUS_SUCCESS, ""},
        {ARV_BUFFER_STATUS_CLEARED, "it was not filled; if this repeats, switch the camera off and on"},
        {ARV_BUFFER_STATUS_TIMEOUT,
         "the rest of it did not come in time; raise net.core.rmem_max, use jumbo frames and a good cable"},
        {ARV_BUFFER_STATUS_MISSING_PACKETS,
         "packets were lost; raise net.core.rmem_max, use jumbo frames, keep other traffic away"},
        {ARV_BUFFER_STATUS_WRONG_PACKET_ID,
         "packets came with wrong numbers; look for a second program that reads this camera"},
        {ARV_BUFFER_STATUS_SIZE_MISMATCH,
         "it is larger than agreed; another program has changed the camera's settings"},
        {ARV_BUFFER_STATUS_FILLING, "it was still being filled; the computer is too slow for this rate"},
        {ARV_BUFFER_STATUS_ABORTED, "the stream was stopped; check the camera's cable and power"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        if (rows[i].status == status)
            return rows[i].words;
    return "its status is not known; the camera or Aravis is newer than this program";
}

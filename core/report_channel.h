/**
 * What a command tells the program that started it, beside its output: progress and pictures, for machines.
 *
 * The channel is a socket (SOCK_SEQPACKET) whose number stands in WEFT_REPORT_FD.  One message is one JSON
 * object of at most WEFT_REPORT_MAX bytes; a picture travels beside its message as a sealed memfd, never
 * inside the JSON.  A listener that does not keep up loses messages; the one who reports is never held up.
 *
 *     {"progress":{"what":"capturing","unit":"frames","done":3,"total":11}}
 *     {"picture":{"name":"light-03.dng","width":616,"height":408,...}}       + memfd: a JPEG
 */
#ifndef WEFT_CORE_REPORT_CHANNEL_H
#define WEFT_CORE_REPORT_CHANNEL_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

#define WEFT_REPORT_ENV "WEFT_REPORT_FD"
#define WEFT_REPORT_MAX 32768

/** Looks whether somebody listens (WEFT_REPORT_FD), and takes the variable out of the environment, so that
 *  children do not report too.  Once, before threads start. */
void weft_report_open(void);

/** Whether somebody listens: then nobody needs to see progress on stderr. */
bool weft_report_active(void);

/** Sends a message and releases it; NULL is fine.  From one thread. */
void weft_report_send(json_t *message);

/** Sends a message with a picture of `n` bytes, and releases the message. */
void weft_report_send_picture(json_t *message, const void *bytes, size_t n);

#endif

#include "host/daemon/daemon.h"

#define ROW(name, ...)                                                                                       \
    {                                                                                                        \
        .key = name, __VA_ARGS__                                                                             \
    }
#define AT(member) .offset = offsetof(weft_daemon_options, member)

/* clang-format off */
const weft_field weft_daemon_fields[] = {
    ROW("library", .short_opt = 'l', .type = WEFT_FIELD_TEXT, AT(library), .unit = "DIR", .required = true,
        .help = "folder of sets, calibrations and maps; the queue is kept in DIR/.weft"),
    ROW("socket", .short_opt = 's', .type = WEFT_FIELD_TEXT, AT(socket), .unit = "PATH",
        .help = "Unix socket (default $XDG_RUNTIME_DIR/weft/weftd.sock, for root /run/weft/weftd.sock)"),
    ROW("group", .type = WEFT_FIELD_TEXT, AT(group), .unit = "NAME",
        .help = "group that may use the socket"),
    ROW("listen", .type = WEFT_FIELD_TEXT, AT(listen), .unit = "ADDR:PORT",
        .help = "also serve TCP here, with the token: 127.0.0.1:8080, [::1]:8080; :8080 is loopback"),
    ROW("token", .type = WEFT_FIELD_TEXT, AT(token), .unit = "FILE",
        .help = "file with the token for TCP, of mode 600 (default DIR/.weft/token, made when absent)"),
    ROW("host", .type = WEFT_FIELD_TEXTS, AT(hosts), .unit = "NAME",
        .help = "a name by which clients may call this computer over TCP; may be given several times"),
    ROW("tls-cert", .type = WEFT_FIELD_TEXT, AT(certificate), .unit = "FILE",
        .help = "certificate for TCP (PEM); then TCP is HTTPS"),
    ROW("tls-key", .type = WEFT_FIELD_TEXT, AT(key), .unit = "FILE",
        .help = "its key (PEM)"),
    ROW("cpu-jobs", .short_opt = 'j', .type = WEFT_FIELD_INT, AT(cpu_jobs), .unit = "N", .min = 1, .max = 16, .def = "1",
        .help = "jobs without the scanner that run at a time"),
    ROW("rig", .type = WEFT_FIELD_TEXT, AT(rig), .unit = "DIR",
        .help = "use the virtual scanner that runs in DIR (weft rig --dir DIR)"),
    ROW("port", .type = WEFT_FIELD_TEXT, AT(port), .unit = "TTY",
        .help = "serial line of the light controller (else the only one there is)"),
    ROW("camera", .type = WEFT_FIELD_TEXT, AT(camera), .unit = "ID",
        .help = "camera as weft devices prints it (else the only one there is)"),
    ROW("quiet", .short_opt = 'q', .type = WEFT_FIELD_FLAG, AT(quiet), .help = "say nothing but errors"),
    ROW("verbose", .short_opt = 'v', .type = WEFT_FIELD_FLAG, AT(verbose), .help = "explain what is done"),
    ROW("version", .type = WEFT_FIELD_FLAG, AT(version), .help = "print the version"),
    ROW("help", .short_opt = 'h', .type = WEFT_FIELD_FLAG, AT(help), .help = "print this help"),
    {0},
};
/* clang-format on */

const char weft_daemon_summary[] = "serves the scanner, a queue of jobs and a library over HTTP";
const char weft_daemon_details[] =
    "Jobs are weft commands in processes of their own.  The API is described at /v1/openapi.json and in\n"
    "docs/daemon.md.  SIGTERM switches the lights off, ends what runs and keeps it queued.";
const char weft_daemon_example[] = "weftd --library ~/scans --socket /tmp/weftd.sock &\n"
                                   "curl --unix-socket /tmp/weftd.sock http://localhost/v1/jobs";

/**
 * Whose a serial port is.  Private to host/light, but for weft_port_find_user().
 *
 * A lock on the port itself (flock, TIOCEXCL) must be given up while another program, avrdude, works on the
 * port for us.  A reservation need not: it is a name of an abstract Unix socket, which every program of Weft
 * takes before it opens a port, and which the kernel frees when its last holder ends.
 */
#ifndef WEFT_HOST_LIGHT_PORT_OWNER_H
#define WEFT_HOST_LIGHT_PORT_OWNER_H

#include "core/error.h"

#include <stdbool.h>

typedef struct weft_port_user {
    int pid;       /* 0: somebody whom this user may not see */
    char name[32]; /* of the program, as ps shows it; "" when unknown */
} weft_port_user;

/** Reserves a port for this process, and for children that inherit the descriptor.
 *  @param fd  close it to release; -1 when there is no such device, which is left to open() to say
 *  @return WEFT_ERR_DEVICE naming the program of Weft that has it */
weft_err weft_port_reserve(const char *port, int *fd, weft_error *err);

/** Another process that has the port open, with a lock or without: Arduino's serial monitor has none.
 *  Those of other users are seen by root only.  @return false when there is none */
bool weft_port_find_user(const char *port, weft_port_user *user);

/** "another program is using this port: minicom (process 77); close it first" */
weft_err weft_port_fail_used(const char *port, const weft_port_user *user, weft_error *err);

#endif

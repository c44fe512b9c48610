/** What darkens the lights when this program crashes.  Private to host/light. */
#ifndef WEFT_HOST_LIGHT_CONTROLLER_CRASH_H
#define WEFT_HOST_LIGHT_CONTROLLER_CRASH_H

#include <stdbool.h>

/** From now on a deadly signal writes the panic bytes to `fd`, and then does what it did before.  One that is
 *  ignored (SIGHUP under nohup) stays ignored. */
void weft_controller_watch_crash(int fd);
/** No longer, if `fd` is the one.  @return whether it was */
bool weft_controller_forget_crash(int fd);

#endif

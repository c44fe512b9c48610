/**
 * Whether a frame was begun by our trigger or before it, by the camera's own clock.
 *
 * A camera stamps each frame with its clock when the exposure begins; how that clock stands to ours is not
 * known.  But no exposure begins before its trigger was sent: of all frames that we called, the least
 * difference between stamp and trigger is close to how the clocks stand (too much by the quickest camera's
 * delay).  A frame whose difference is less was begun before we called it, so something else did.
 *
 * A frame that is less than WEFT_FRAME_CLOCK_SLACK_S early passes; lights are on for longer than that before
 * a trigger.  On a busy computer a trigger may be quicker than all that were compared before by more than
 * this: so an early frame is a doubt, which the caller settles (aravis_stream.c), not a proof.
 */
#ifndef WEFT_HOST_CAMERA_FRAME_CLOCK_H
#define WEFT_HOST_CAMERA_FRAME_CLOCK_H

#include <stdbool.h>

#define WEFT_FRAME_CLOCK_SLACK_S 0.004
/** How much two clocks may run apart, s per s. */
#define WEFT_FRAME_CLOCK_DRIFT 2e-4
enum { WEFT_FRAME_CLOCK_KEPT = 8 };

/** Zeroed: nothing is known.  The last frames that we called. */
typedef struct weft_frame_clock {
    int n;                                      /* frames so far */
    double difference_s[WEFT_FRAME_CLOCK_KEPT]; /* stamp minus trigger */
    double triggered_s;                         /* of the last */
} weft_frame_clock;

/** Takes a frame that was called at triggered_s (our clock) and stamped stamp_s (the camera's). */
void weft_frame_clock_learn(weft_frame_clock *clock, double stamp_s, double triggered_s);

/** How much earlier than its trigger a frame was begun, s; 0 when it was not, by less than the slack, or
 *  nothing is known. */
double weft_frame_clock_early(const weft_frame_clock *clock, double stamp_s, double triggered_s);

#endif

#include "host/camera/frame_clock.h"

#include <math.h>

void weft_frame_clock_learn(weft_frame_clock *c, double stamp_s, double triggered_s)
{
    c->difference_s[c->n++ % WEFT_FRAME_CLOCK_KEPT] = stamp_s - triggered_s;
    c->triggered_s = triggered_s;
    if (c->n >= 2 * WEFT_FRAME_CLOCK_KEPT)
        c->n -= WEFT_FRAME_CLOCK_KEPT; /* the ring stays full */
}

double weft_frame_clock_early(const weft_frame_clock *c, double stamp_s, double triggered_s)
{
    double least_s = INFINITY;
    for (int i = 0; i < c->n && i < WEFT_FRAME_CLOCK_KEPT; i++)
        least_s = fmin(least_s, c->difference_s[i]);
    if (c->n == 0)
        return 0;
    const double slack_s =
        WEFT_FRAME_CLOCK_SLACK_S + WEFT_FRAME_CLOCK_DRIFT * fabs(triggered_s - c->triggered_s);
    const double early_s = least_s - (stamp_s - triggered_s);
    return early_s > slack_s ? early_s : 0;
}

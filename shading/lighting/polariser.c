#include "shading/lighting/polariser.h"

#include <math.h>

void weft_polariser_at(int n, const weft_polariser_key *keys, double hour, double factor[3])
{
    const double at = hour - 24 * floor(hour / 24);
    int after = 0;
    while (after < n && keys[after].hour <= at)
        after++;
    const weft_polariser_key *const a = &keys[(after + n - 1) % n], *const b = &keys[after % n];
    const double from = after > 0 ? a->hour : a->hour - 24, to = after < n ? b->hour : b->hour + 24;
    const double t = to > from ? (at - from) / (to - from) : 0;
    for (int c = 0; c < 3; c++)
        factor[c] = a->factor[c] + t * (b->factor[c] - a->factor[c]);
}

/* firmware/host/exchange/otg_steps.c - the time of a motion whose acceleration
 * may step, see otg_rows.h.
 *
 * Without a limit of the jerk the fastest motion is one ramp to a highest (or
 * lowest) velocity, a cruise at the limit where that is reached, and one ramp
 * to the goal's.  A ramp from v to w at acceleration a takes (w - v) / a and
 * goes (w^2 - v^2) / 2a.  Source: Biagiotti & Melchiorri, Trajectory Planning
 * (2008), 3.2. */
#include <math.h>

#include "firmware/host/exchange/otg_rows.h"

/* One axis, mirrored where the motion first goes down. */
struct steps {
    double distance, from, to; /* distance, velocities */
    double most, least;        /* velocity, > 0 and < 0 */
    double faster, slower;     /* acceleration, > 0 and < 0 */
};

static double steps_ramp_s(const struct steps *s, double from, double to)
{
    return (to - from) / (to > from ? s->faster : s->slower);
}

static double steps_ramp_distance(const struct steps *s, double from, double to)
{
    return (to * to - from * from) / (2 * (to > from ? s->faster : s->slower));
}

static struct steps steps_mirrored(const struct steps *s)
{
    return (struct steps){ -s->distance, -s->from,   -s->to,    -s->least,
                           -s->most,     -s->slower, -s->faster };
}

/* Up to the highest velocity and down to the goal's. */
static double steps_up_s(const struct steps *s)
{
    const double per_speed2 = 0.5 / s->faster - 0.5 / s->slower;
    const double rest = s->distance + s->from * s->from / (2 * s->faster) -
                        s->to * s->to / (2 * s->slower);
    const double peak = sqrt(fmax(0, rest / per_speed2));
    const double top = fmin(peak, s->most);
    const double ramps =
        steps_ramp_s(s, s->from, top) + steps_ramp_s(s, top, s->to);
    const double cruise = s->distance - steps_ramp_distance(s, s->from, top) -
                          steps_ramp_distance(s, top, s->to);

    return peak > s->most ? ramps + cruise / top : ramps;
}

static double steps_axis_s(struct steps s, bool velocity)
{
    const double inside = fmin(fmax(s.from, s.least), s.most);
    double first;

    if (velocity)
        return steps_ramp_s(&s, s.from, s.to);
    /* what is too fast first comes inside its limit */
    first = steps_ramp_s(&s, s.from, inside);
    s.distance -= steps_ramp_distance(&s, s.from, inside);
    s.from = inside;
    if (s.distance >= steps_ramp_distance(&s, s.from, s.to))
        return first + steps_up_s(&s);
    s = steps_mirrored(&s);
    return first + steps_up_s(&s);
}

double otg_steps_seconds(const struct otg_header *header,
                         const struct otg_row *row)
{
    double longest = 0;

    for (int i = 0; i < header->axes; i++) {
        const double *v = row->value[i];
        const struct steps s = {
            v[OTG_PF] - v[OTG_P0], v[OTG_V0],   v[OTG_VF],   v[OTG_VMAX],
            v[OTG_VMIN],           v[OTG_AMAX], v[OTG_AMIN],
        };

        if (v[OTG_JMAX] != 0 || !(v[OTG_AMAX] > 0) || !(v[OTG_AMIN] < 0))
            return (double)NAN;
        longest = fmax(longest, steps_axis_s(s, header->velocity));
    }
    return longest;
}

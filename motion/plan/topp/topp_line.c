/* motion/plan/topp/topp_line.c - see topp_line.h. */
#include "motion/plan/topp/topp_line.h"

#include <math.h>

#include "motion/core/err.h"

#define LINE_BISECTIONS 200

/* Of speeds and lengths that count as equal. */
#define LINE_ROUNDING 1e-12

/* --- one change of speed ----------------------------------------------------- */

/* Duration of a change of speed by `change`, >= 0. */
static double line_change(double change, double acc, double jerk)
{
    return change * jerk >= acc * acc ? change / acc + acc / jerk
                                      : 2 * sqrt(change / jerk);
}

/* Three phases: jerk, none, the opposite. */
static void line_phases(double change, double acc, double jerk, double dur[3])
{
    if (change * jerk >= acc * acc) {
        dur[0] = dur[2] = acc / jerk;
        dur[1] = change / acc - acc / jerk;
    } else {
        dur[0] = dur[2] = sqrt(change / jerk);
        dur[1] = 0;
    }
}

/* --- the whole --------------------------------------------------------------- */

/* Distance of both changes of speed without a phase at constant speed. */
static double line_distance(const struct topp_line_limit *limit, double start,
                            double peak, double end)
{
    return (start + peak) / 2 *
               line_change(peak - start, limit->acc, limit->jerk) +
           (peak + end) / 2 * line_change(peak - end, limit->dec, limit->jerk);
}

/* The peak speed whose two changes fill the length. */
static double line_peak(const struct topp_line_limit *limit, double length,
                        double start, double end)
{
    double low = fmax(start, end), high = limit->vel;

    for (int i = 0; i < LINE_BISECTIONS; i++) {
        const double middle = low + (high - low) / 2;
        if (middle <= low || middle >= high)
            break;
        if (line_distance(limit, start, middle, end) <= length)
            low = middle;
        else
            high = middle;
    }
    return low;
}

int topp_line_plan(const struct topp_line_limit *limit, double length,
                   double start_vel, double end_vel, struct topp_line *line)
{
    const double most = limit->vel * (1 + LINE_ROUNDING);
    const double start = fmin(start_vel, limit->vel);
    const double end = fmin(end_vel, limit->vel);
    double peak = limit->vel, j = limit->jerk, rest;

    if (!(start_vel <= most) || !(end_vel <= most) ||
        !(line_distance(limit, start, fmax(start, end), end) <=
          length * (1 + LINE_ROUNDING)))
        return MOTION_E_LIMIT;
    if (line_distance(limit, start, peak, end) > length)
        peak = line_peak(limit, length, start, end);
    *line =
        (struct topp_line){ .vel = start, .jerk = { j, 0, -j, 0, -j, 0, j } };
    line_phases(peak - start, limit->acc, j, line->dur);
    line_phases(peak - end, limit->dec, j, line->dur + 4);
    rest = length - line_distance(limit, start, peak, end);
    if (rest > 0 && peak > 0)
        line->dur[3] = rest / peak;
    return MOTION_OK;
}

double topp_line_duration(const struct topp_line *line)
{
    double sum = 0;

    for (int i = 0; i < TOPP_LINE_PHASES; i++)
        sum += line->dur[i];
    return sum;
}

static void line_step(struct topp_line_state *state, double jerk, double t)
{
    state->pos += t * (state->vel + t * (state->acc / 2 + t * jerk / 6));
    state->vel += t * (state->acc + t * jerk / 2);
    state->acc += t * jerk;
    state->jerk = jerk;
}

void topp_line_at(const struct topp_line *line, double t_s,
                  struct topp_line_state *state)
{
    *state = (struct topp_line_state){ .vel = line->vel };
    for (int i = 0; i < TOPP_LINE_PHASES && t_s >= 0; i++) {
        if (line->dur[i] > 0)
            line_step(state, line->jerk[i], fmin(t_s, line->dur[i]));
        if (t_s < line->dur[i])
            return;
        t_s -= line->dur[i];
    }
}

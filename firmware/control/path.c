/* firmware/control/path.c - from the clock that reads a move to its path.
 *
 * The clock only goes forward: s from 0 to the end of the move.  Played in
 * reverse the path's time is end - s, so every set point is on the same tracks,
 * to the bit.  Of g(s) = f(end - s)
 *
 *   g' = -f'    g'' = f''    g''' = -f''' */
#include "firmware/control/parts.h"

int64_t controller_path_ns_q12(const struct controller *controller,
                               int64_t s_ns_q12)
{
    return controller->is_reversed ? controller->move_end_ns_q12 - s_ns_q12
                                   : s_ns_q12;
}

void controller_path(const struct controller *controller,
                     struct motion_clock_rate *rate)
{
    rate->s_ns_q12 = controller_path_ns_q12(controller, rate->s_ns_q12);
    if (!controller->is_reversed)
        return;
    rate->rate_q30 = -rate->rate_q30;
    rate->accel_q30 = -rate->accel_q30;
    rate->jerk_q30 = -rate->jerk_q30;
}

void controller_path_state(const struct controller *controller,
                           const struct motion_track *track, int64_t s_ns_q12,
                           struct motion_state *state)
{
    motion_track_state(track, controller_path_ns_q12(controller, s_ns_q12),
                       state);
    if (!controller->is_reversed)
        return;
    state->vel_q32 = -state->vel_q32;
    state->jerk_q32 =
        state->jerk_q32 == INT64_MIN ? INT64_MAX : -state->jerk_q32;
}

/* firmware/control/path.c - from the clock that reads a move to its path.
 *
 * The clock only goes forward: s from 0 to the end of the move.  Played in
 * reverse the path's time is end - s, so every set point is on the same tracks,
 * to the bit.  Limits have no sign, so what a ramp of the clock may do along
 * g(s) = f(end - s) follows from f:
 *
 *   g' = -f'    g'' = f''    g''' = -f'''
 *
 * and a ramp keeps the limits on g where the same ramp, run backwards in time,
 * keeps them on f: of h(t) = g(s(T - t)) = f(end - s(T - t)) the derivatives are
 * those of the motion, but for signs. */
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

/* With x = 1 - y, k0 x + k1 x^2 + k2 x^3 is (k0 + k1 + k2) - [(k0 + 2 k1 + 3 k2)
 * y - (k1 + 3 k2) y^2 + k2 y^3]: exact. */
static void path_turn_piece(struct motion_clock_piece *piece, int64_t s0_ns_q12)
{
    const int64_t *k = piece->k_q56;
    const int64_t turned[3] = { k[0] + 2 * k[1] + 3 * k[2], -(k[1] + 3 * k[2]),
                                k[2] };
    for (unsigned i = 0; i < 3; i++)
        piece->k_q56[i] = turned[i];
    piece->s0_ns_q12 = s0_ns_q12;
}

void controller_path_turn(const struct controller *controller,
                          const struct motion_clock_warp *warp,
                          struct motion_clock_warp *turned)
{
    struct motion_clock_rate first;
    motion_clock_warp_at(warp, warp->t0_ns, &first);
    *turned = *warp;
    turned->s0_ns_q12 = controller_path_ns_q12(controller, warp->s1_ns_q12);
    turned->s1_ns_q12 = controller_path_ns_q12(controller, warp->s0_ns_q12);
    turned->rate1_q30 = first.rate_q30;
    for (unsigned i = 0; i < warp->count; i++) {
        const unsigned from = warp->count - 1 - i;
        const int64_t end_ns_q12 = from + 1 < warp->count
                                       ? warp->piece[from + 1].s0_ns_q12
                                       : warp->s1_ns_q12;
        turned->piece[i] = warp->piece[from];
        path_turn_piece(&turned->piece[i],
                        controller_path_ns_q12(controller, end_ns_q12));
    }
}

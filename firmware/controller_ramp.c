/* firmware/controller_ramp.c - the shortest change of rate that fits.
 *
 * A cubic change of rate by dr over D needs, on an axis that runs at path
 * speed V,
 *     acceleration  V * 1.5 |dr| / D        jerk  V * 6 |dr| / D^2
 * beside what the track itself asks for.  The D where these alone use the
 * whole limit is the yardstick; lengths from a third of it upwards are tried
 * until motion_clock_warp_fits says yes for every axis.
 *
 * Looking ahead takes time, so a candidate starts some ticks from now and is
 * judged until then, at every tick that it will have, a bounded number of looks
 * per tick; the present warp goes on meanwhile.  A stop for a fault cannot
 * wait: it starts now, judged by fewer looks against the wider stop limits. */
#include "firmware/controller_parts.h"
#include "motion/err.h"
#include "motion/fixed.h"

/* Tries in units of 1/16 of the yardstick. */
static const uint16_t ramp_sixteenths[] = { 5,   7,   10,  13,  16,  20,  25,
                                            32,  40,  50,  64,  80,  102, 128,
                                            160, 208, 256, 320, 416, 512 };
#define RAMP_LENGTHS   (sizeof ramp_sixteenths / sizeof ramp_sixteenths[0])
#define RAMP_TICKS_MIN 4
#define RAMP_TICKS_MAX 32768

#define RAMP_COARSE             32 /* looks per axis, for a first impression */
#define RAMP_PROPOSALS_PER_TICK 4
#define RAMP_LOOKS_PER_TICK     512 /* all axes together */

/* a * b / c, saturated. */
static int64_t ramp_muldiv(int64_t a, int64_t b, int64_t c)
{
    int64_t result;
    return motion_fixed_muldiv(a, b, c, &result) < 0 ? INT64_MAX : result;
}

/* Yardstick of one axis in ns. */
static int64_t ramp_yardstick(int64_t vel_q32, int64_t change_q30,
                              const struct motion_clock_limit *limit)
{
    const int64_t dv_q32 =
        ramp_muldiv(vel_q32, change_q30, MOTION_CLOCK_WARP_ONE_Q30);
    const int64_t dv_q16 = dv_q32 >> 16;
    int64_t ns = ramp_muldiv(dv_q16, INT64_C(1500000000), limit->acc_q16);
    if (limit->jerk_q16 > 0) {
        /* D^2 [ns^2] = 6 dv / j [s^2] * 1e18; in us^2, then root * 1000. */
        const int64_t us2 =
            ramp_muldiv(dv_q16, INT64_C(6000000000000), limit->jerk_q16);
        const int64_t jerk_ns =
            (int64_t)motion_fixed_isqrt_u64((uint64_t)us2) * 1000;
        if (jerk_ns > ns)
            ns = jerk_ns;
    }
    return ns;
}

static const struct motion_clock_limit *
ramp_limit(const struct controller *controller, unsigned axis, bool stop)
{
    const struct controller_axis_config *config =
        &controller->config.axis[axis];
    return stop ? &config->stop : &config->limit;
}

/* Slowing down starts from the speed there is; speeding up leads to speeds that
 * are not known yet, so the track's peak stands for them. */
static int64_t ramp_speed(const struct controller *controller,
                          const struct controller_axis *axis, bool slower)
{
    if (!slower)
        return axis->vel_peak_q32;
    struct motion_state state;
    motion_track_state(axis->track, controller->rate.s_ns_q12, &state);
    return (int64_t)(motion_fixed_abs(state.vel_q32) & INT64_MAX);
}

static int64_t ramp_yardstick_group(const struct controller *controller,
                                    bool stop)
{
    const int64_t change = controller->wanted_q30 - controller->rate.rate_q30;
    int64_t longest = 0;
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const struct controller_axis *axis = &controller->axis[i];
        if (!axis->track)
            continue;
        const int64_t ns = ramp_yardstick(
            ramp_speed(controller, axis, change < 0),
            (int64_t)motion_fixed_abs(change), ramp_limit(controller, i, stop));
        if (ns > longest)
            longest = ns;
    }
    return longest;
}

/* -- candidates ---------------------------------------------------------- */

static int64_t ramp_clip(int64_t ns, int64_t low, int64_t high)
{
    return ns < low ? low : ns > high ? high : ns;
}

/* Length number `which`, in whole ticks: every tick is a look, and one sees the
 * end of the ramp. */
static int64_t ramp_ticks(const struct controller *controller,
                          int64_t yardstick_ns, unsigned which)
{
    const int64_t period_ns = controller->config.period_ns;
    const int64_t ns = ramp_clip(
        ramp_muldiv(yardstick_ns, ramp_sixteenths[which % RAMP_LENGTHS], 16),
        RAMP_TICKS_MIN * period_ns, RAMP_TICKS_MAX * period_ns);
    return (ns + period_ns - 1) / period_ns;
}

static bool ramp_make(const struct controller *controller, int64_t t0_ns,
                      int64_t ticks, struct motion_clock_warp *warp)
{
    return motion_clock_warp_ramp(
               &controller->warp, t0_ns, controller->wanted_q30,
               ticks * controller->config.period_ns, warp) == MOTION_OK;
}

/* The whole ramp, RAMP_COARSE looks per axis: rules out most candidates. */
static bool ramp_fits_coarsely(const struct controller *controller,
                               const struct motion_clock_warp *warp, bool stop)
{
    const int64_t step_ns = warp->dur_ns / RAMP_COARSE;
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const struct motion_track *track = controller->axis[i].track;
        if (track && !motion_clock_warp_fits(
                         warp, track, ramp_limit(controller, i, stop), 0,
                         warp->dur_ns, step_ns > 0 ? step_ns : 1))
            return false;
    }
    return true;
}

bool controller_ramp_stop(struct controller *controller)
{
    const int64_t yardstick_ns = ramp_yardstick_group(controller, true);
    for (unsigned which = 0; which < RAMP_LENGTHS; which++) {
        const int64_t ticks = ramp_ticks(controller, yardstick_ns, which);
        struct motion_clock_warp warp;
        if (ramp_make(controller, controller->clock_ns, ticks, &warp) &&
            ramp_fits_coarsely(controller, &warp, true)) {
            controller->warp = warp;
            return true;
        }
    }
    return false;
}

/* A ramp of four yardsticks from rate r to 0 goes r D / 2 of path time, on an
 * axis that does r times the track's speed. */
int64_t controller_ramp_reserve(const struct controller *controller,
                                unsigned index, int64_t vel_q32,
                                int64_t rate_q30)
{
    const int64_t yardstick_ns =
        ramp_yardstick(vel_q32, rate_q30, ramp_limit(controller, index, true));
    const int64_t least_ns = RAMP_TICKS_MIN * controller->config.period_ns;
    const int64_t ns =
        ramp_clip(yardstick_ns, least_ns, MOTION_CLOCK_WARP_RAMP_MAX_NS);
    return ramp_muldiv(2 * ns * MOTION_FIXED_NS_Q12, rate_q30,
                       MOTION_CLOCK_WARP_ONE_Q30);
}

int64_t controller_ramp_bound_ns(const struct controller *controller, bool stop)
{
    return controller->config.stop_timeout_ns +
           32 * ramp_yardstick_group(controller, stop);
}

/* -- the search, some looks per tick -------------------------------------- */

void controller_ramp_reset(struct controller *controller)
{
    controller->seek = (struct controller_seek){ 0 };
}

/* Next candidate: it starts when judging it tick by tick will be over. */
static void ramp_propose(struct controller *controller)
{
    struct controller_seek *seek = &controller->seek;
    const int64_t ticks = ramp_ticks(
        controller, ramp_yardstick_group(controller, false), seek->which++);
    const int64_t looks = (ticks + 1) * controller->config.axis_count;
    const int64_t wait = looks / RAMP_LOOKS_PER_TICK + 1;
    const int64_t t0_ns =
        controller->clock_ns + wait * controller->config.period_ns;
    seek->axis = 0;
    seek->judged_ns = 0;
    seek->active = ramp_make(controller, t0_ns, ticks, &seek->warp) &&
                   ramp_fits_coarsely(controller, &seek->warp, false);
}

/* One stretch of one axis; returns the looks it took. */
static int64_t ramp_judge(struct controller *controller, int64_t looks)
{
    struct controller_seek *seek = &controller->seek;
    const struct motion_track *track = controller->axis[seek->axis].track;
    const int64_t period_ns = controller->config.period_ns;
    int64_t to_ns = seek->judged_ns + looks * period_ns;
    if (to_ns > seek->warp.dur_ns)
        to_ns = seek->warp.dur_ns;
    if (track &&
        !motion_clock_warp_fits(&seek->warp, track,
                                ramp_limit(controller, seek->axis, false),
                                seek->judged_ns, to_ns, period_ns)) {
        seek->active = false;
        return looks;
    }
    looks = (to_ns - seek->judged_ns) / period_ns;
    seek->judged_ns = to_ns;
    if (to_ns == seek->warp.dur_ns) {
        seek->judged_ns = 0;
        seek->axis++;
    }
    return looks;
}

void controller_ramp_seek(struct controller *controller)
{
    struct controller_seek *seek = &controller->seek;
    int64_t looks = RAMP_LOOKS_PER_TICK;
    for (unsigned n = 0; !seek->active && n < RAMP_PROPOSALS_PER_TICK; n++)
        ramp_propose(controller);
    while (seek->active && looks > 0 &&
           seek->axis < controller->config.axis_count)
        looks -= ramp_judge(controller, looks);
    if (seek->active && seek->axis == controller->config.axis_count &&
        controller->clock_ns >= seek->warp.t0_ns) {
        controller->warp = seek->warp;
        controller_ramp_reset(controller);
    }
}

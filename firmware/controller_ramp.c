/* firmware/controller_ramp.c - the shortest change of rate that fits.
 *
 * A cubic change of rate by dr over D needs, on an axis that runs at path
 * speed V,
 *     acceleration  V * 1.5 |dr| / D        jerk  V * 6 |dr| / D^2
 * beside what the track itself asks for.  The D where these alone use the
 * whole limit is the yardstick; lengths from a third of it upwards are tried
 * until motion_clock_warp_fits says yes for every axis. */
#include "firmware/controller_parts.h"
#include "motion/err.h"
#include "motion/fixed.h"

/* Tries in units of 1/16 of the yardstick. */
static const uint16_t ramp_sixteenths[] = { 5,   7,   10,  13,  16,  20,  25,
                                            32,  40,  50,  64,  80,  102, 128,
                                            160, 208, 256, 320, 416, 512 };
#define RAMP_LENGTHS   (sizeof ramp_sixteenths / sizeof ramp_sixteenths[0])
#define RAMP_LOOKS     512 /* evaluations per axis and try */
#define RAMP_TICKS_MIN 4

unsigned controller_ramp_lengths(void)
{
    return RAMP_LENGTHS;
}

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

static bool ramp_fits(const struct controller *controller,
                      const struct motion_clock_warp *warp, bool stop)
{
    int64_t step_ns = controller->config.period_ns;
    if (warp->dur_ns / step_ns > RAMP_LOOKS)
        step_ns = warp->dur_ns / RAMP_LOOKS;
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const struct motion_track *track = controller->axis[i].track;
        if (track && !motion_clock_warp_fits(
                         warp, track, ramp_limit(controller, i, stop), step_ns))
            return false;
    }
    return true;
}

static int64_t ramp_clip(int64_t ns, int64_t low, int64_t high)
{
    return ns < low ? low : ns > high ? high : ns;
}

bool controller_ramp_seek(struct controller *controller, unsigned tries,
                          bool stop)
{
    const int64_t period_ns = controller->config.period_ns;
    const int64_t yardstick_ns = ramp_yardstick_group(controller, stop);
    for (; tries > 0; tries--) {
        const unsigned which = controller->ramp_try++ % RAMP_LENGTHS;
        const int64_t dur_ns = ramp_clip(
            ramp_muldiv(yardstick_ns, ramp_sixteenths[which], 16),
            RAMP_TICKS_MIN * period_ns, MOTION_CLOCK_WARP_RAMP_MAX_NS);
        /* whole ticks, so that a tick sees the end of the ramp */
        const int64_t ticks = (dur_ns + period_ns - 1) / period_ns;
        struct motion_clock_warp warp;
        if (motion_clock_warp_ramp(&controller->warp, controller->now_ns,
                                   controller->wanted_q30, ticks * period_ns,
                                   &warp) == MOTION_OK &&
            ramp_fits(controller, &warp, stop)) {
            controller->warp = warp;
            return true;
        }
    }
    return false;
}

/* tests/firmware/control/stateful_rig.c - what an episode is made of, drawn
 * from its seed. */
#include <math.h>

#include "tests/firmware/control/stateful.h"

#define MS        INT64_C(1000000)
#define JERK_MOST 1e9 /* the format ends at 2^31 */

int64_t stateful_in(struct stateful *bench, int64_t low, int64_t high)
{
    return check_random_in(&bench->seed, low, high);
}

bool stateful_one_in(struct stateful *bench, int64_t n)
{
    return stateful_in(bench, 1, n) == 1;
}

double stateful_between(struct stateful *bench, double low, double high)
{
    const double share = (double)(check_random(&bench->seed) >> 11) * 0x1p-53;
    return low + (high - low) * share;
}

/* As far as the format goes. */
int64_t stateful_q32(double value)
{
    return (int64_t)fmax(fmin(value * (double)MOTION_FIXED_ONE_Q32, 0x1p62),
                         -0x1p62);
}

double stateful_unit(int64_t value_q32)
{
    return (double)value_q32 / (double)MOTION_FIXED_ONE_Q32;
}

/* Half a second to full speed at most; a third without a limit of jerk. */
static void rig_limits(struct stateful *bench, double scale,
                       struct controller_axis_config *config)
{
    const double vel = scale * 5 * pow(100, stateful_between(bench, 0, 1));
    const double acc = vel / stateful_between(bench, 0.05, 0.5);
    const double jerk =
        fmin(acc / stateful_between(bench, 0.01, 0.2), JERK_MOST);
    const double more =
        stateful_one_in(bench, 3) ? 1 : stateful_between(bench, 1, 10);
    const bool has_jerk = !stateful_one_in(bench, 3);
    config->limit =
        (struct motion_clock_limit){ stateful_q32(vel), stateful_q32(acc),
                                     has_jerk ? stateful_q32(jerk) : 0 };
    config->stop = (struct motion_clock_limit){
        stateful_q32(vel), stateful_q32(fmin(acc * more, JERK_MOST)),
        has_jerk && !stateful_one_in(bench, 4)
            ? stateful_q32(fmin(jerk * more, JERK_MOST))
            : 0
    };
}

static double rig_length(const struct controller_axis_config *config)
{
    return stateful_unit(config->pos_max_q32 - config->pos_min_q32);
}

static void rig_range(struct stateful *bench,
                      struct controller_axis_config *config)
{
    const double vel = stateful_unit(config->limit.vel_q32);
    const double length = vel * stateful_between(bench, 0.5, 2);
    const double low = stateful_between(bench, -2, 1) * length;
    config->pos_min_q32 = stateful_q32(low);
    config->pos_max_q32 = stateful_q32(low + length);
}

/* Mostly inside its range, else a little or rather far outside. */
static int64_t rig_start_q32(struct stateful *bench, double scale,
                             const struct controller_axis_config *config)
{
    const double out =
        scale *
        (stateful_one_in(bench, 2) ? 0.01 : stateful_between(bench, 0.001, 2));
    if (stateful_one_in(bench, 8))
        return config->pos_min_q32 - stateful_q32(out);
    if (stateful_one_in(bench, 8))
        return config->pos_max_q32 + stateful_q32(out);
    return stateful_in(bench, config->pos_min_q32, config->pos_max_q32);
}

/* Outside the range, or where moves run into them; places of the drive. */
static void rig_zones(struct stateful *bench, unsigned i, int64_t offset_q32)
{
    const struct controller_axis_config *config = &bench->axis_config[i];
    struct stateful_zone *zone = bench->axis[i].zone;
    const double length = rig_length(config);
    const int64_t low_q32 = config->pos_min_q32 - offset_q32;
    const int64_t high_q32 = config->pos_max_q32 - offset_q32;
    for (int which = 0; which < STATEFUL_SWITCHES; which++) {
        const double in = stateful_one_in(bench, 8)
                              ? stateful_between(bench, 0.05, 0.4)
                              : -stateful_between(bench, 0.02, 0.2);
        zone[which] = (struct stateful_zone){
            .there = !stateful_one_in(bench, 3),
            .by_drive = stateful_one_in(bench, 4),
            .low_q32 = INT64_MIN / 2,
            .high_q32 = INT64_MAX / 2,
        };
        if (which == STATEFUL_NEGATIVE)
            zone[which].high_q32 = low_q32 + stateful_q32(in * length);
        else if (which == STATEFUL_POSITIVE)
            zone[which].low_q32 = high_q32 - stateful_q32(in * length);
    }
    zone[STATEFUL_HOME].there = true;
    const int64_t edge_q32 = stateful_in(bench, low_q32, high_q32);
    /* a short one may be overrun */
    const double wide = stateful_one_in(bench, 2)
                            ? stateful_between(bench, 0.001, 0.01)
                            : stateful_between(bench, 0.02, 0.3);
    const int64_t wide_q32 = stateful_q32(length * wide);
    if (!stateful_one_in(bench, 3))
        zone[STATEFUL_HOME].low_q32 = edge_q32;
    if (!stateful_one_in(bench, 3))
        zone[STATEFUL_HOME].high_q32 = edge_q32 + wide_q32;
}

/* It homes to a hard stop, beyond wherever it may be sent and its limit switches;
 * returns the place of it.  One in eight does not report its torque. */
static int64_t rig_stop(struct stateful *bench, unsigned i, int64_t offset_q32)
{
    const struct controller_axis_config *config = &bench->axis_config[i];
    struct stateful_axis *axis = &bench->axis[i];
    struct homing_config *home = &bench->home[i];
    const double length = rig_length(config);
    const int64_t low_q32 = config->pos_min_q32 - offset_q32;
    const int64_t high_q32 = config->pos_max_q32 - offset_q32;
    const int64_t spare_q32 =
        stateful_q32(length * stateful_between(bench, 0.001, 0.05));
    axis->stop_q32[0] =
        (axis->pos_q32 < low_q32 ? axis->pos_q32 : low_q32) - spare_q32;
    axis->stop_q32[1] =
        (axis->pos_q32 > high_q32 ? axis->pos_q32 : high_q32) + spare_q32;
    axis->has_stops = !stateful_one_in(bench, 8);
    axis->zone[home->direction < 0 ? STATEFUL_NEGATIVE : STATEFUL_POSITIVE]
        .there = false;
    /* it presses for some 40 ms, two of which pass until that is seen */
    bench->axis_config[i].following_floor_q32 += home->fast_q32 / 16;
    home->by = HOMING_HARD_STOP;
    home->input = HOMING_INPUT_HOME;
    home->push_permille = (int32_t)stateful_in(bench, 100, 1000);
    home->clear_q32 =
        stateful_q32(length * stateful_between(bench, 0.001, 0.05));
    return axis->stop_q32[home->direction < 0 ? 0 : 1];
}

static void rig_homing(struct stateful *bench, unsigned i, int64_t offset_q32)
{
    const struct controller_axis_config *axis = &bench->axis_config[i];
    const struct stateful_zone *zone = bench->axis[i].zone;
    struct homing_config *home = &bench->home[i];
    const double vel = stateful_unit(axis->limit.vel_q32);
    const double fast = vel * stateful_between(bench, 0.1, 1);
    *home = (struct homing_config){
        .by = stateful_one_in(bench, 6)   ? HOMING_HERE
              : bench->axis[i].homes      ? HOMING_DRIVE
              : stateful_one_in(bench, 8) ? HOMING_NONE
                                          : HOMING_SWITCH,
        .order = (unsigned)stateful_in(bench, 0, 3),
        .direction = stateful_one_in(bench, 2) ? 1 : -1,
        .fast_q32 = stateful_q32(fast),
        .slow_q32 = stateful_q32(fast / stateful_between(bench, 1, 12)),
        .distance_q32 =
            stateful_q32(rig_length(axis) * stateful_between(bench, 0.1, 1.5)),
        .goes = stateful_one_in(bench, 2),
        .go_q32 = stateful_in(bench, axis->pos_min_q32, axis->pos_max_q32),
        .timeout_ns = stateful_in(bench, 300, 12000) * MS,
    };
    int64_t edge_q32 = zone[STATEFUL_HOME].low_q32;
    if (home->direction < 0)
        edge_q32 = zone[STATEFUL_HOME].high_q32;
    if (zone[STATEFUL_NEGATIVE].there && home->direction < 0 &&
        stateful_one_in(bench, 3)) {
        home->input = HOMING_INPUT_LIMIT_NEGATIVE;
        edge_q32 = zone[STATEFUL_NEGATIVE].high_q32;
    } else if (zone[STATEFUL_POSITIVE].there && home->direction > 0 &&
               stateful_one_in(bench, 3)) {
        home->input = HOMING_INPUT_LIMIT_POSITIVE;
        edge_q32 = zone[STATEFUL_POSITIVE].low_q32;
    }
    if (edge_q32 <= INT64_MIN / 2 || edge_q32 >= INT64_MAX / 2)
        edge_q32 = 0;
    if (home->by == HOMING_SWITCH && !axis->by_goals &&
        stateful_one_in(bench, 3))
        edge_q32 = rig_stop(bench, i, offset_q32);
    home->pos_q32 = edge_q32 + offset_q32;
}

static void rig_drive(struct stateful *bench, unsigned i)
{
    const struct controller_axis_config *config = &bench->axis_config[i];
    struct stateful_axis *axis = &bench->axis[i];
    axis->enable_ticks =
        (int)stateful_in(bench, 0, stateful_one_in(bench, 4) ? 300 : 10);
    axis->off_ticks = (int)stateful_in(bench, 0, 5);
    axis->reset_ticks = (int)stateful_in(bench, 0, 20);
    if (stateful_one_in(bench, 2))
        axis->droop_q32 =
            stateful_q32(axis->scale * stateful_between(bench, 0.01, 0.1));
    if (stateful_one_in(bench, 2))
        axis->droop_q32 = -axis->droop_q32;
    axis->homes = stateful_one_in(bench, 6);
    axis->home_fails = stateful_one_in(bench, 4);
    axis->home_vel = stateful_unit(config->limit.vel_q32) *
                     stateful_between(bench, -0.1, 0.1);
    axis->brake =
        (double)config->stop.acc_q32 / 0x1p32 * stateful_between(bench, 1, 3);
}

/* No less than a good one takes to begin, and to say that it is there. */
static int64_t rig_late_ns(struct stateful *bench,
                           const struct stateful_profile *profile)
{
    const int64_t late_ns = stateful_in(bench, 120, 500) * MS;
    const int64_t least_ns =
        (profile->delay_ticks + profile->arrive_ticks + STATEFUL_SAID_TICKS) *
        bench->config.period_ns;
    return late_ns > least_ns ? late_ns : least_ns;
}

/* Where its drive goes to goals; one in six is not as good as it should be. */
static void rig_profile(struct stateful *bench, unsigned i)
{
    struct controller_axis_config *config = &bench->axis_config[i];
    struct stateful_profile *profile = &bench->axis[i].profile;
    *profile = (struct stateful_profile){
        .there = stateful_one_in(bench, 4),
        .halts = !stateful_one_in(bench, 4),
        .delay_ticks = (int)stateful_in(bench, 0, 3),
        .arrive_ticks = (int)stateful_in(bench, 0, 10),
        .busy_ticks = (int)stateful_in(bench, 0, 3),
        .share = 1,
        .is_bad = stateful_one_in(bench, 6),
    };
    config->by_goals = profile->there;
    config->late_ns = rig_late_ns(bench, profile);
    if (!profile->there || !profile->is_bad)
        return;
    if (stateful_one_in(bench, 3))
        profile->delay_ticks = 2000;
    else if (stateful_one_in(bench, 2))
        profile->short_q32 = stateful_q32(stateful_between(bench, 0.6, 3));
    else
        profile->share = stateful_between(bench, 0.05, 0.6);
}

/* Steps of an encoder, mm or degrees, metres or turns. */
static double rig_scale(struct stateful *bench)
{
    static const double scale[] = { 1, 1, 0.01, 0.1, 100, 10000 };
    return bench->kind.has_units
               ? scale[stateful_in(bench, 0, ARRAY_LEN(scale) - 1)]
               : 1;
}

static void rig_axis(struct stateful *bench, unsigned i)
{
    struct controller_axis_config *config = &bench->axis_config[i];
    const double scale = rig_scale(bench);
    int64_t offset_q32 = 0;
    bench->axis[i].scale = scale;
    rig_limits(bench, scale, config);
    rig_range(bench, config);
    config->following_floor_q32 = stateful_q32(scale / 2);
    config->following_k_ns = 5 * MS;
    config->needs_homing = stateful_one_in(bench, bench->kind.has_cams ? 8 : 3);
    if (config->needs_homing)
        offset_q32 = stateful_q32(scale * stateful_between(bench, -500, 500));
    rig_drive(bench, i);
    rig_profile(bench, i);
    if (scale != 1 || (bench->kind.has_cams && !stateful_one_in(bench, 4)))
        config->by_goals = bench->axis[i].profile.there = false;
    bench->axis[i].pos_q32 = rig_start_q32(bench, scale, config) - offset_q32;
    rig_zones(bench, i, offset_q32);
    rig_homing(bench, i, offset_q32);
}

bool stateful_is_wide(const struct stateful *bench)
{
    return bench->first_seed % 7 > 1;
}

void stateful_draw_rig(struct stateful *bench)
{
    static const int64_t period_us[] = { 500, 1000, 1000, 1000, 2000, 4000 };
    static const int64_t other_us[] = { 125, 250, 10000, 20000 };
    bench->axes = (unsigned)stateful_in(bench, 1, 3);
    if (stateful_one_in(bench, 6))
        bench->axes = (unsigned)stateful_in(bench, 4, STATEFUL_AXES);
    if (bench->kind.has_cams && bench->axes == 1)
        bench->axes = 2;
    bench->config = (struct controller_config){
        .period_ns =
            1000 * period_us[stateful_in(bench, 0, ARRAY_LEN(period_us) - 1)],
        .enable_timeout_ns = (stateful_one_in(bench, 6) ? 100 : 2000) * MS,
        .stop_timeout_ns = 2000 * MS,
        .axis_count = bench->axes,
    };
    if (bench->kind.has_units && stateful_one_in(bench, 2))
        bench->config.period_ns =
            1000 * other_us[stateful_in(bench, 0, ARRAY_LEN(other_us) - 1)];
    if (bench->kind.has_cams || bench->kind.has_boards)
        bench->config.enable_timeout_ns =
            2000 * MS + 400 * bench->config.period_ns;
    for (unsigned i = 0; i < bench->axes; i++)
        rig_axis(bench, i);
    if (bench->kind.has_boards)
        stateful_draw_boards(bench);
    bench->estop.channels = 1;
    if (!stateful_is_wide(bench) || stateful_one_in(bench, 3))
        return;
    bench->estop.channels = 2;
    bench->estop.discrepancy_ns = stateful_in(bench, 1, 50) * MS;
}

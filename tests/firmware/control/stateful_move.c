/* tests/firmware/control/stateful_move.c - tracks from gentle to exactly at the
 * limits: eases, fastest moves through a state of motion, quintics stretched
 * until they fit. */
#include <math.h>

#include "motion/core/err.h"
#include "motion/curve/ease.h"
#include "motion/otg/otg.h"
#include "tests/firmware/control/stateful.h"

#define MS   INT64_C(1000000)
#define KEYS 6

static double draw_share(struct stateful *bench)
{
    static const double share[] = { 1, 1, 1, 0.9, 0.5, 0.15 };
    return share[stateful_in(bench, 0, ARRAY_LEN(share) - 1)];
}

static int64_t draw_place(struct stateful *bench, unsigned i)
{
    const struct controller_axis_config *config = &bench->axis_config[i];
    if (stateful_one_in(bench, 8))
        return stateful_one_in(bench, 2) ? config->pos_min_q32
                                         : config->pos_max_q32;
    return stateful_in(bench, config->pos_min_q32, config->pos_max_q32);
}

static int64_t share_of(int64_t value, double share)
{
    return (int64_t)((double)value * share);
}

static bool move_eases(struct stateful *bench, unsigned i)
{
    const struct motion_clock_limit *most = &bench->axis_config[i].limit;
    const double share = draw_share(bench);
    const struct motion_ease_limit limit = { share_of(most->vel_q32, share),
                                             share_of(most->acc_q32, share),
                                             share_of(most->jerk_q32, share) };
    for (int64_t n = stateful_in(bench, 1, 3); n > 0; n--) {
        if (motion_ease_append_limited(&bench->track[bench->spare][i],
                                       draw_place(bench, i), &limit) < 0)
            return false;
        if (stateful_one_in(bench, 3) &&
            motion_track_append_dwell(&bench->track[bench->spare][i],
                                      stateful_in(bench, 1, 300) * MS *
                                          MOTION_FIXED_NS_Q12) < 0)
            return false;
    }
    return true;
}

static bool move_flies(struct stateful *bench, unsigned i)
{
    const struct motion_clock_limit *most = &bench->axis_config[i].limit;
    struct motion_otg_move move = {
        .start = bench->track[bench->spare][i].end,
        .limit = { most->vel_q32, -most->vel_q32, most->acc_q32, -most->acc_q32,
                   most->jerk_q32, 0 },
    };
    for (int64_t n = stateful_in(bench, 0, 3); n >= 0; n--) {
        struct motion_otg_plan plan;
        move.goal = (struct motion_state){ .pos_q32 = draw_place(bench, i) };
        if (n > 0)
            move.goal.vel_q32 =
                share_of(most->vel_q32, stateful_between(bench, -0.9, 0.9));
        if (motion_otg_make(&move, &plan, NULL) < 0 ||
            motion_otg_append(&plan, &bench->track[bench->spare][i]) < 0)
            return false;
        move.start = move.goal;
    }
    return true;
}

/* Keys with times and speeds; times, stretched, make it slower. */
struct keys {
    int count;
    int64_t pos_q32[KEYS];
    double s[KEYS], vel[KEYS];
};

static bool keys_append(struct motion_track *track, const struct keys *keys,
                        double slower)
{
    struct motion_state from = track->end;
    for (int k = 0; k < keys->count; k++) {
        const struct motion_state to = {
            .pos_q32 = keys->pos_q32[k],
            .vel_q32 = stateful_q32(keys->vel[k] / slower),
        };
        if (motion_track_append_quintic(track,
                                        (int64_t)(keys->s[k] * slower * 1e9) *
                                            MOTION_FIXED_NS_Q12,
                                        &from, &to) < 0)
            return false;
        from = to;
    }
    return true;
}

static double peak(const struct motion_track *track, enum motion_quantity which,
                   int64_t limit)
{
    struct motion_extreme extreme;
    motion_track_extreme(track, which, &extreme);
    return limit == 0 ? 0
                      : fmax(-(double)extreme.min, (double)extreme.max) /
                            (double)limit;
}

/* By how much it has to be slower to be inside the limits. */
static double track_over(const struct motion_track *track,
                         const struct motion_clock_limit *limit)
{
    return fmax(peak(track, MOTION_VEL, limit->vel_q32),
                fmax(sqrt(peak(track, MOTION_ACC, limit->acc_q32)),
                     cbrt(peak(track, MOTION_JERK, limit->jerk_q32))));
}

static bool move_swings(struct stateful *bench, unsigned i)
{
    struct motion_track *track = &bench->track[bench->spare][i];
    const struct motion_clock_limit *limit = &bench->axis_config[i].limit;
    const double vel = stateful_unit(limit->vel_q32);
    const int64_t start_q32 = track->end.pos_q32;
    const double gentle = 1 / draw_share(bench);
    struct keys keys = { .count = (int)stateful_in(bench, 1, KEYS) };
    double slower = 1;
    for (int k = 0; k < keys.count; k++) {
        keys.pos_q32[k] = draw_place(bench, i);
        keys.s[k] = stateful_between(bench, 0.1, 1);
        if (k + 1 < keys.count)
            keys.vel[k] = vel * stateful_between(bench, -0.5, 0.5);
    }
    for (int n = 0; n < 4; n++) {
        motion_track_init(track, bench->storage[bench->spare][i],
                          STATEFUL_SEGMENTS, start_q32);
        if (!keys_append(track, &keys, slower))
            return false;
        const double over = track_over(track, limit);
        if (n > 0 && over <= 1)
            return true;
        slower *= over * (n == 0 ? gentle * 1.000001 : 1.0001);
    }
    return false;
}

bool stateful_draw_track(struct stateful *bench, unsigned i)
{
    static bool (*const kind[])(
        struct stateful *, unsigned) = { move_eases, move_flies, move_swings };
    motion_track_init(&bench->track[bench->spare][i],
                      bench->storage[bench->spare][i], STATEFUL_SEGMENTS,
                      bench->controller.axis[i].target.pos_q32);
    const bool is_made = kind[stateful_in(bench, 0, 2)](bench, i);
    if (is_made && bench->kind.has_cams)
        stateful_come_back(bench, i);
    if (i % 2 == 0)
        motion_track_summarise(&bench->track[bench->spare][i],
                               &bench->summary[bench->spare][i]);
    return is_made;
}

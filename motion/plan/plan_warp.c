/* motion/plan/plan_warp.c - see plan_warp.h. */
#include "motion/plan/plan_warp.h"

#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/time_warp.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_track.h"

#define WARP_RATE ((int64_t)1000 << 32) /* ms/s: one second a second */
/* What sampling rounds; a warp that rests may show so much. */
#define WARP_NOISE 64
/* A segment of the warp is rarely more of those of the outcome. */
#define WARP_PIECES 4

/* ms, Q32.32, to 2^-12 ns. */
static int64_t warp_ticks(int64_t ms_q32)
{
    int64_t t = 0;

    (void)motion_fixed_muldiv(ms_q32, 15625, 1 << 14, &t);
    return t;
}

static int warp_copy(const struct plan_axis *axis, struct plan_axis *ms)
{
    const struct motion_real thousand = motion_real_int(1000);

    *ms = *axis;
    ms->key = malloc(axis->key_count * sizeof *ms->key);
    if (ms->key == NULL ||
        plan_bezier_copy(&ms->bezier, axis->key_count,
                         motion_real_div(motion_real_int(1 << 20),
                                         motion_real_int(1000000))) < 0) {
        free(ms->key);
        return MOTION_E_FULL;
    }
    for (uint32_t i = 0; i < axis->key_count; i++) {
        struct motion_key *key = &ms->key[i].key;
        ms->key[i] = axis->key[i];
        key->pos_q32 = motion_time_warp_ms(key->pos_q32);
        key->vel = motion_real_mul(key->vel, thousand);
        key->acc = motion_real_mul(key->acc, thousand);
    }
    return MOTION_OK;
}

static int warp_check(const struct plan_axis *axis,
                      const struct motion_track *warp, struct plan_error *error)
{
    struct motion_extreme rate;
    uint32_t key = 0;

    motion_track_extreme(warp, MOTION_VEL, &rate);
    if (warp->count > 0 && rate.min >= -WARP_NOISE)
        return MOTION_OK;
    while (key + 1 < axis->key_count &&
           axis->key[key + 1].key.t_ns_q12 <= rate.min_ns_q12)
        key++;
    if (warp->count == 0)
        return plan_error_set(error, MOTION_E_EMPTY, axis->place,
                              "the warp has one key, expected at least two");
    return plan_error_set(error, MOTION_E_ORDER, axis->key[key].place,
                          "the warp goes backwards at %.3f s, expected a time "
                          "that does not decrease",
                          (double)rate.min_ns_q12 / (double)MOTION_FIXED_S_Q12);
}

int plan_warp_track(const struct plan_axis *axis, struct motion_track *warp,
                    struct plan_error *error)
{
    struct plan_axis ms;
    int err;

    plan_track_init(warp, 0);
    if (warp_copy(axis, &ms) < 0)
        return plan_error_set(error, MOTION_E_FULL, axis->place,
                              "no memory for the warp");
    err = plan_axis_track(&ms, warp, error);
    error->axis = PLAN_AXES_MAX;
    plan_axis_free(&ms);
    if (err == MOTION_OK)
        err = warp_check(axis, warp, error);
    if (err < 0)
        plan_track_free(warp);
    return err;
}

/* p = t at both ends of a segment, rate one and no bend. */
static bool warp_is_plain(const struct motion_segment *segment)
{
    for (int end = 0; end < 2; end++) {
        struct motion_state at;
        motion_segment_state(segment, end ? segment->dur_ns_q12 : 0, &at);
        if (at.pos_q32 !=
                motion_time_warp_ms(segment->start_ns_q12 +
                                    (end ? segment->dur_ns_q12 : 0)) ||
            at.vel_q32 != WARP_RATE || at.acc_q32 != 0 || at.jerk_q32 != 0)
            return false;
    }
    return true;
}

static bool warp_is_identity(const struct motion_track *warp,
                             const struct motion_track *track)
{
    for (uint32_t i = 0; i < warp->count; i++)
        if (!warp_is_plain(&warp->segment[i]))
            return false;
    return warp->end_ns_q12 >= track->end_ns_q12;
}

int plan_warp_apply(const struct motion_track *warp,
                    const struct plan_axis *axis, struct motion_track *track,
                    struct motion_real *bound, struct plan_error *error)
{
    struct motion_real own = motion_real_zero();
    struct motion_extreme reach;
    struct motion_state start;
    struct motion_track out;
    int err;

    if (warp_is_identity(warp, track))
        return MOTION_OK;
    motion_track_extreme(warp, MOTION_POS, &reach);
    err = plan_track_wait(track, warp_ticks(reach.max) + MOTION_FIXED_NS_Q12);
    motion_time_warp_state(track, warp, 0, &start);
    plan_track_init(&out, start.pos_q32);
    /* what does not fit is begun anew */
    plan_track_reserve(&out, track->count + WARP_PIECES * (size_t)warp->count);
    while (err == MOTION_OK && (err = motion_time_warp_append(
                                    &out, track, warp, &own)) == MOTION_E_FULL)
        err = plan_track_grow(&out);
    if (err < 0) {
        plan_track_free(&out);
        return plan_error_set(error, err, axis->place,
                              "the warp cannot be planned (%s)",
                              motion_err_text(err));
    }
    plan_track_free(track);
    plan_track_trim(&out);
    *track = out;
    *bound = motion_real_max(*bound, own);
    return MOTION_OK;
}

int64_t plan_warp_time(const struct motion_track *warp, int64_t t_ns_q12)
{
    struct motion_state at;

    motion_track_state(warp, t_ns_q12, &at);
    return warp_ticks(at.pos_q32);
}

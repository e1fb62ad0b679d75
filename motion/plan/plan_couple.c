/* motion/plan/plan_couple.c - see plan_couple.h.
 *
 * C(m(t)) is a move with a warped time (motion/curve/time_warp.h), of which the
 * master's place is the time. */
#include "motion/plan/plan_couple.h"

#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/time_warp.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_track.h"

#define COUPLE_MS_NS_Q12 (INT64_C(1000000) * MOTION_FIXED_NS_Q12)
/* A gear reaches further than its master goes by this much. */
#define COUPLE_BEYOND_Q32 (MOTION_FIXED_ONE_Q32 / 1024)

int plan_couple_time(int64_t apart_q32, int64_t *t_ns_q12)
{
    return motion_fixed_muldiv(apart_q32, COUPLE_MS_NS_Q12,
                               MOTION_FIXED_ONE_Q32, t_ns_q12);
}

/* --- a gear is a cam of two keys ------------------------------------------- */

static int couple_gear_key(const struct plan_coupling *gear, int64_t m_q32,
                           struct motion_key *key)
{
    int64_t apart_q32;
    if (motion_fixed_muldiv(m_q32, gear->numerator, gear->denominator,
                            &key->pos_q32) < 0 ||
        motion_fixed_add(key->pos_q32, gear->offset_q32, &key->pos_q32) < 0 ||
        motion_fixed_sub(m_q32, gear->low_q32, &apart_q32) < 0)
        return MOTION_E_RANGE;
    return plan_couple_time(apart_q32, &key->t_ns_q12);
}

/* Over where the master goes. */
static int couple_gear_track(struct plan_coupling *gear,
                             const struct motion_extreme *reach,
                             struct motion_track *curve,
                             struct plan_error *error)
{
    struct plan_key key[2] = { { .key = { .t_ns_q12 = 0 } } };
    const struct plan_axis line = { .curve = PLAN_CURVE_LINEAR,
                                    .key = key,
                                    .key_count = 2 };
    gear->low_q32 = reach->min - COUPLE_BEYOND_Q32;
    if (couple_gear_key(gear, gear->low_q32, &key[0].key) < 0 ||
        couple_gear_key(gear, reach->max + COUPLE_BEYOND_Q32, &key[1].key) < 0)
        return MOTION_E_RANGE;
    return plan_axis_track(&line, curve, error);
}

/* --- a cam ------------------------------------------------------------------ */

static int couple_leaves(const struct plan_move *move,
                         const struct plan_coupling *own, int64_t m_q32,
                         int64_t t_ns_q12, struct plan_error *error)
{
    const struct plan_axis *cam = &own->cam;
    const double low = (double)own->low_q32 / (double)MOTION_FIXED_ONE_Q32;
    return plan_error_set(
        error, MOTION_E_LIMIT, own->place,
        "the cam of %s has no place for %s at %.6g, where that is at %.3f s, "
        "expected one that goes from %.6g to %.6g at most",
        move->axis[own->axis].name, move->axis[own->master].name,
        (double)m_q32 / (double)MOTION_FIXED_ONE_Q32,
        (double)t_ns_q12 / (double)MOTION_FIXED_S_Q12, low,
        low + (double)cam->key[cam->key_count - 1].key.t_ns_q12 /
                  (double)COUPLE_MS_NS_Q12);
}

/* Its ends may be where the master turns, which rounding sets beside them. */
static int couple_cam_track(const struct plan_move *move,
                            const struct plan_coupling *own,
                            const struct motion_extreme *reach,
                            struct motion_track *curve,
                            struct plan_error *error)
{
    const int64_t end_ns_q12 =
        own->cam.key[own->cam.key_count - 1].key.t_ns_q12;
    int64_t last_ns_q12;
    int err;
    if (plan_couple_time(reach->max - own->low_q32, &last_ns_q12) < 0 ||
        last_ns_q12 > end_ns_q12 + MOTION_FIXED_NS_Q12)
        return couple_leaves(move, own, reach->max, reach->max_ns_q12, error);
    if (reach->min < own->low_q32 - 1)
        return couple_leaves(move, own, reach->min, reach->min_ns_q12, error);
    err = plan_axis_track(&own->cam, curve, error);
    return err < 0 ? err
                   : plan_track_wait(curve, end_ns_q12 + MOTION_FIXED_NS_Q12);
}

/* --- over the master's track ------------------------------------------------ */

/* The same, so far lower: its place is time of the curve, ms. */
static int couple_time_of(const struct motion_track *master, int64_t low_q32,
                          struct motion_track *time)
{
    plan_track_init(time, 0);
    plan_track_reserve(time, master->count);
    if (time->capacity < master->count)
        return MOTION_E_FULL;
    struct motion_segment *const segment = time->segment;
    const uint32_t capacity = time->capacity;
    *time = *master;
    time->segment = segment;
    time->capacity = capacity;
    time->end.pos_q32 -= low_q32;
    for (uint32_t i = 0; i < master->count; i++) {
        segment[i] = master->segment[i];
        segment[i].pos_q32 -= low_q32;
    }
    return MOTION_OK;
}

static int couple_append(const struct motion_track *curve,
                         const struct motion_track *time,
                         struct motion_track *out)
{
    struct motion_state start;
    int err;
    motion_time_warp_state(curve, time, 0, &start);
    plan_track_init(out, start.pos_q32);
    while ((err = motion_time_warp_append(out, curve, time, NULL)) ==
           MOTION_E_FULL)
        if (plan_track_grow(out) < 0)
            break;
    plan_track_trim(out);
    return err;
}

static int couple_track(const struct plan_move *move, struct plan_coupling own,
                        struct motion_track track[], struct plan_error *error)
{
    const struct motion_track *master = &track[own.master];
    struct motion_track curve, time, *out = &track[own.axis];
    struct motion_extreme reach;
    int err;
    plan_track_init(&curve, 0);
    plan_track_init(&time, 0);
    motion_track_extreme(master, MOTION_POS, &reach);
    *error = (struct plan_error){ .axis = PLAN_AXES_MAX };
    err = own.cam.key_count == 0
              ? couple_gear_track(&own, &reach, &curve, error)
              : couple_cam_track(move, &own, &reach, &curve, error);
    if (err == MOTION_OK)
        err = couple_time_of(master, own.low_q32, &time);
    plan_track_free(out);
    if (err == MOTION_OK)
        err = couple_append(&curve, &time, out);
    plan_track_free(&curve);
    plan_track_free(&time);
    if (err < 0 && error->text[0] == 0)
        return plan_error_set(error, err, own.place, "%s cannot follow %s (%s)",
                              move->axis[own.axis].name,
                              move->axis[own.master].name,
                              motion_err_text(err));
    return err;
}

int plan_couple_tracks(const struct plan_move *move,
                       struct motion_track track[], struct plan_error *error)
{
    int err = MOTION_OK;
    for (uint32_t i = 0; i < move->couplings && err == MOTION_OK; i++) {
        err = couple_track(move, move->coupling[i], track, error);
        error->axis = move->coupling[i].axis;
    }
    return err;
}

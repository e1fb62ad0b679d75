/* motion/plan/shoot/plan_shoot.c - see plan_shoot.h. */
#include "motion/plan/shoot/plan_shoot.h"

#include <math.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/plan_error.h"

/* Over any move that is planned: sums of some of these are no overflow. */
#define SHOOT_LONGEST_NS_Q12 0x1p61

/* Per frame: open, close, and the two ends of a wait between. */
#define SHOOT_KEYS_PER_FRAME 4

/* What the pictures make of the move, per frame. */
struct shoot {
    const struct plan_shoot *shoot;
    struct plan_axis *warp;
    double length, blur;
    int64_t ramp_ns_q12; /* R */
};

static bool shoot_stops(const struct plan_shoot *shoot)
{
    return shoot->mode == PLAN_SHOOT_STOP;
}

static double shoot_blur(const struct plan_shoot *shoot)
{
    if (shoot->mode == PLAN_SHOOT_GO_MOTION)
        return (double)shoot->blur_q32 / (double)MOTION_FIXED_ONE_Q32;
    return (double)shoot->exposure_ns_q12 /
           ((double)shoot->exposure_ns_q12 + (double)shoot->move_ns_q12);
}

static int64_t shoot_ramp(const struct plan_shoot *shoot)
{
    const double blur = shoot_blur(shoot);

    if (shoot->mode == PLAN_SHOOT_CONTINUOUS)
        return shoot->move_ns_q12;
    return shoot_stops(shoot) ? 0
                              : llround(fmin((double)shoot->exposure_ns_q12 *
                                                 (1 - blur) / blur,
                                             SHOOT_LONGEST_NS_Q12));
}

void plan_shoot_times(const struct plan_shoot *shoot,
                      struct plan_shoot_times *times)
{
    const int64_t ramp = shoot_ramp(shoot);
    const int64_t still = shoot_stops(shoot) ? shoot->settle_ns_q12 : 0;

    times->period_ns_q12 = still + shoot->wait_ns_q12 + shoot->exposure_ns_q12 +
                           shoot->move_ns_q12;
    times->wait_ns_q12 = shoot->settle_ns_q12;
    times->first_ns_q12 = shoot->settle_ns_q12 + shoot->wait_ns_q12 + ramp;
    times->last_ns_q12 = times->end_ns_q12 = INT64_MAX;
    if ((double)(shoot->frames - 1) * (double)times->period_ns_q12 >=
        SHOOT_LONGEST_NS_Q12)
        return;
    times->last_ns_q12 = times->first_ns_q12 +
                         (int64_t)(shoot->frames - 1) * times->period_ns_q12;
    times->end_ns_q12 = times->last_ns_q12 + shoot->exposure_ns_q12 + ramp;
}

/* A key; one at the time of the last only says how it goes on. */
static void shoot_key(const struct shoot *self, int64_t t_ns_q12,
                      int64_t at_ns_q12, struct motion_real rate,
                      enum plan_curve curve)
{
    struct plan_axis *warp = self->warp;
    const bool same = warp->key_count > 0 &&
                      warp->key[warp->key_count - 1].key.t_ns_q12 == t_ns_q12;
    struct plan_key *key =
        &warp->key[same ? --warp->key_count : warp->key_count];

    *key = (struct plan_key){
        .key = { .t_ns_q12 = t_ns_q12, .pos_q32 = at_ns_q12 },
        .place = self->shoot->place,
        .has_curve = true,
        .curve = curve,
    };
    const bool after_quintic =
        warp->key_count > 0 && key[-1].curve == PLAN_CURVE_QUINTIC;
    if (curve == PLAN_CURVE_QUINTIC || after_quintic) {
        key->key.has_vel = key->key.has_acc = true;
        key->key.vel = rate;
        key->key.acc = motion_real_zero();
    }
    warp->key_count++;
}

/* --- stop ------------------------------------------------------------------ */

static void shoot_stop_keys(const struct shoot *self,
                            const struct plan_shoot_times *times)
{
    const struct plan_shoot *shoot = self->shoot;
    const struct motion_real still = motion_real_zero();

    for (uint32_t k = 0; k < shoot->frames; k++) {
        const int64_t begin = k * times->period_ns_q12;
        const bool last = k + 1 == shoot->frames;
        const int64_t at = llround(self->length * k / (shoot->frames - 1));
        shoot_key(self, begin, at, still, PLAN_CURVE_LINEAR);
        shoot_key(self, begin + times->first_ns_q12 + shoot->exposure_ns_q12,
                  at, still, last ? PLAN_CURVE_LINEAR : PLAN_CURVE_QUINTIC);
    }
}

/* --- go-motion, continuous ---------------------------------------------------- */

/* From the end of an exposure to the next one. */
static void shoot_wait_keys(const struct shoot *self, int64_t close_ns_q12,
                            int64_t between_ns_q12)
{
    const int64_t move = self->shoot->move_ns_q12 + self->shoot->wait_ns_q12;
    const struct motion_real still = motion_real_zero();

    if (move / 2 <= self->ramp_ns_q12)
        return;
    shoot_key(self, close_ns_q12 + self->ramp_ns_q12, between_ns_q12, still,
              PLAN_CURVE_LINEAR);
    shoot_key(self, close_ns_q12 + move - self->ramp_ns_q12, between_ns_q12,
              still, PLAN_CURVE_QUINTIC);
}

static void shoot_go_keys(const struct shoot *self,
                          const struct plan_shoot_times *times)
{
    const struct plan_shoot *shoot = self->shoot;
    const double share = self->length / shoot->frames;
    const int64_t step = llround(self->blur * share);
    const int64_t exposure = shoot->exposure_ns_q12;
    const struct motion_real rate =
        motion_real_div(motion_real_int(step), motion_real_int(exposure));
    const struct motion_real still = motion_real_zero();

    shoot_key(self, 0, 0, still, PLAN_CURVE_LINEAR);
    shoot_key(self, shoot->settle_ns_q12 + shoot->wait_ns_q12, 0, still,
              PLAN_CURVE_QUINTIC);
    for (uint32_t k = 0; k < shoot->frames; k++) {
        const int64_t open = times->first_ns_q12 + k * times->period_ns_q12;
        const int64_t at = llround(share * (k + 0.5 - self->blur / 2));
        shoot_key(self, open, at, rate, PLAN_CURVE_LINEAR);
        shoot_key(self, open + exposure, at + step, rate, PLAN_CURVE_QUINTIC);
        if (k + 1 < shoot->frames)
            shoot_wait_keys(self, open + exposure, llround(share * (k + 1)));
    }
    shoot_key(self, times->end_ns_q12, llround(self->length), still,
              PLAN_CURVE_LINEAR);
}

static int shoot_check(const struct plan_shoot *shoot, int64_t length_ns_q12,
                       struct plan_error *error)
{
    const double period =
        (double)shoot->settle_ns_q12 + (double)shoot->exposure_ns_q12 +
        (double)shoot->move_ns_q12 + (double)shoot->wait_ns_q12;

    if (shoot->steps &&
        (shoot->mode == PLAN_SHOOT_CONTINUOUS ||
         (double)shoot->move_ns_q12 < 2 * (double)shoot_ramp(shoot)))
        return plan_error_set(
            error, MOTION_E_ARG, shoot->place,
            "shoot is to step, and does not rest between its pictures, "
            "expected mode stop, or go-motion with a move of at least %.6g s",
            2 * (double)shoot_ramp(shoot) / (double)MOTION_FIXED_S_Q12);
    if (length_ns_q12 <= 0)
        return plan_error_set(error, MOTION_E_EMPTY, shoot->place,
                              "shoot is for a move that takes time, expected "
                              "keys or a path");
    if (period * shoot->frames + 2 * (double)shoot_ramp(shoot) >=
        (double)MOTION_TRACK_MAX_NS_Q12)
        return plan_error_set(error, MOTION_E_RANGE, shoot->place,
                              "the shoot takes longer than 19 days");
    return MOTION_OK;
}

int plan_shoot_warp(const struct plan_shoot *shoot, int64_t length_ns_q12,
                    struct plan_axis *warp, struct plan_error *error)
{
    struct plan_shoot_times times;
    struct shoot self = {
        .shoot = shoot,
        .warp = warp,
        .length = (double)length_ns_q12,
        .blur = shoot_blur(shoot),
        .ramp_ns_q12 = shoot_ramp(shoot),
    };
    int err = shoot_check(shoot, length_ns_q12, error);

    if (err < 0)
        return err;
    *warp = (struct plan_axis){
        .name = "shoot",
        .curve = PLAN_CURVE_QUINTIC,
        .place = shoot->place,
        .key = calloc((size_t)shoot->frames * SHOOT_KEYS_PER_FRAME + 3,
                      sizeof *warp->key),
    };
    if (warp->key == NULL)
        return plan_error_set(error, MOTION_E_FULL, shoot->place,
                              "no memory for the shoot");
    plan_shoot_times(shoot, &times);
    if (shoot_stops(shoot))
        shoot_stop_keys(&self, &times);
    else
        shoot_go_keys(&self, &times);
    return MOTION_OK;
}

/* motion/plan/keys/profile.c - from key to key as the drive goes by itself; see
 * move.h.
 *
 * A distance d in a time T by ramps of the time t at speed v takes
 *     T = d / v + t,   a = v / t
 * The calmest ramps at a low speed are those of a third of the time: v = 3 d /
 * 2 T.  Where that is too fast, v is the limit; where then, or at once, the
 * ramps are too steep, there is no speed between them: v = 2 d / T, and no
 * profile is less steep. */
#include <math.h>

#include "motion/core/err.h"
#include "motion/plan/keys/move_internal.h"

#define PROFILE_KIND -1 /* of a span that is kept; curves are from 0 */

/* The speed limit less what rounding times to 2^-12 ns may add. */
#define PROFILE_BELOW (1 - 1e-6)

bool move_has_profile(const struct plan_axis *axis)
{
    return axis->profile.vel_q32 > 0;
}

int move_profile_check(const struct move *move)
{
    const struct plan_axis *axis = move->axis;

    for (uint32_t i = 0; i < axis->key_count; i++) {
        const struct motion_key *key = &axis->key[i].key;

        if ((key->has_vel && !motion_real_is_zero(key->vel)) ||
            (key->has_acc && !motion_real_is_zero(key->acc)))
            return move_fail_key(move, MOTION_E_ARG, i,
                                 "is given a motion, but the axis goes from "
                                 "key to key by its drive's own profile and "
                                 "stands at each");
    }
    return MOTION_OK;
}

/* Of a ramp, s. */
static double profile_ramp_s(const struct plan_profile *profile,
                             double distance, double dur_s)
{
    const double most = move_units(profile->vel_q32) * PROFILE_BELOW;
    const double acc = move_units(profile->acc_q32);
    const double triangle = 2 * distance / dur_s;
    double vel = 1.5 * distance / dur_s;

    if (vel > most && most * dur_s > distance)
        vel = most;
    if (vel / (dur_s - distance / vel) > acc)
        vel = most > vel && most < triangle ? most : triangle;
    return vel >= triangle ? dur_s / 2 : dur_s - distance / vel;
}

static int profile_append_distance(const struct move *move, uint32_t i,
                                   int64_t dur_ns_q12)
{
    const struct motion_key *key = &move->key[i];
    const double distance =
        fabs(move_units(key[1].pos_q32) - move_units(key[0].pos_q32));
    const double ramp_s = profile_ramp_s(&move->axis->profile, distance,
                                         move_seconds(dur_ns_q12));
    const double share = ramp_s / move_seconds(dur_ns_q12);
    const int64_t ramp_ns_q12 =
        share >= 0.5 ? dur_ns_q12 / 2 : llround((double)dur_ns_q12 * share);

    return motion_ease_append_phases(move->track, MOTION_EASE_PARABOLIC,
                                     key[1].pos_q32, ramp_ns_q12,
                                     dur_ns_q12 - 2 * ramp_ns_q12, ramp_ns_q12);
}

static int profile_append_span(const struct move *move, uint32_t i)
{
    const struct motion_key *key = &move->key[i];
    const int64_t apart = key[1].t_ns_q12 - key[0].t_ns_q12;
    const int64_t settle = move->axis->profile.settle_ns_q12;
    int rc = move_grow(move, MOTION_EASE_SEGMENTS + 1);

    if (rc != MOTION_OK)
        return rc;
    if (key[1].pos_q32 == key[0].pos_q32)
        return motion_track_append_dwell(move->track, apart);
    if (apart <= settle)
        return move_fail_key(move, MOTION_E_ORDER, i + 1,
                             "comes %.3f s after the one before it, of which "
                             "its drive needs %.3f s to settle",
                             move_seconds(apart), move_seconds(settle));
    rc = profile_append_distance(move, i, apart - settle);
    if (rc == MOTION_OK && settle > 0)
        rc = motion_track_append_dwell(move->track, settle);
    return rc == MOTION_OK
               ? rc
               : move_fail_key(move, rc, i + 1, "%s", motion_err_text(rc));
}

/* The span from key i, or one that was planned before. */
static int profile_append_kept(const struct move *move, uint32_t i)
{
    const struct plan_profile *profile = &move->axis->profile;
    const struct motion_key *key = &move->key[i];
    struct plan_memo_span span;
    int rc;

    if (move->memo == NULL)
        return profile_append_span(move, i);
    move_memo_begin(move, PROFILE_KIND, 1, &span);
    move_memo_add(move, key[0].pos_q32);
    move_memo_add(move, key[1].pos_q32);
    move_memo_add(move, key[1].t_ns_q12 - key[0].t_ns_q12);
    move_memo_add(move, profile->vel_q32);
    move_memo_add(move, profile->acc_q32);
    move_memo_add(move, profile->settle_ns_q12);
    rc = move_memo_recall(move, &span) ? MOTION_OK
                                       : profile_append_span(move, i);
    return rc == MOTION_OK ? move_memo_keep(move, &span) : rc;
}

int move_profile_append(const struct move *move)
{
    int rc = MOTION_OK;

    for (uint32_t i = 0; rc == MOTION_OK && i + 1 < move->axis->key_count; i++)
        rc = profile_append_kept(move, i);
    return rc;
}

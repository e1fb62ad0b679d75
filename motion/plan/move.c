/* motion/plan/move.c - see move.h.
 *
 * An axis goes through three steps: its keys are judged one by one (so that an
 * error names the first key that is wrong), copied with missing velocities and
 * accelerations filled in, and appended to a track that grows as needed and is
 * cut to size at the end. */
#include "motion/plan/move.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "motion/err.h"
#include "motion/fixed.h"

/* What a key may give. */
enum move_given { MOVE_NO, MOVE_ZERO, MOVE_MAY, MOVE_MUST };

static const struct {
    const char *name;
    enum move_given vel, acc;
} move_curve[] = {
#define MOVE_NAME(kind, spelling, text) [kind].name = spelling,
    PLAN_CURVE_LIST(MOVE_NAME)
#undef MOVE_NAME
#define MOVE_GIVEN(kind, v, a) [kind].vel = v, [kind].acc = a,
        MOVE_GIVEN(PLAN_CURVE_LINEAR, MOVE_NO,
                   MOVE_NO) MOVE_GIVEN(PLAN_CURVE_PARABOLIC, MOVE_ZERO, MOVE_NO)
            MOVE_GIVEN(PLAN_CURVE_SINE, MOVE_ZERO, MOVE_NO)
                MOVE_GIVEN(PLAN_CURVE_SCURVE, MOVE_ZERO, MOVE_ZERO) MOVE_GIVEN(
                    PLAN_CURVE_HERMITE, MOVE_MUST, MOVE_NO)
                    MOVE_GIVEN(PLAN_CURVE_CATMULL_ROM, MOVE_MAY, MOVE_NO)
                        MOVE_GIVEN(PLAN_CURVE_CARDINAL, MOVE_MAY, MOVE_NO)
                            MOVE_GIVEN(PLAN_CURVE_QUINTIC, MOVE_MAY, MOVE_MAY)
#undef MOVE_GIVEN
};

#define MOVE_CURVES (sizeof move_curve / sizeof move_curve[0])

/* One axis on its way to a track. */
struct move {
    const struct plan_axis *axis;
    struct motion_key *key; /* copies, filled in */
    struct motion_track *track;
    struct plan_error *error;
};

static double move_seconds(int64_t t_ns_q12)
{
    return (double)t_ns_q12 / (double)MOTION_FIXED_S_Q12;
}

static double move_units(int64_t a_q32)
{
    return (double)a_q32 / (double)MOTION_FIXED_ONE_Q32;
}

__attribute__((format(printf, 4, 5))) static int
move_fail_key(const struct move *move, int code, uint32_t key,
              const char *format, ...)
{
    struct plan_error *error = move->error;
    const struct plan_axis *axis = move->axis;
    va_list args;
    int used;

    *error = (struct plan_error){ .code = code,
                                  .key = key,
                                  .place = axis->key[key].place };
    used = snprintf(error->text, sizeof error->text,
                    "key %u of axis %.*s: ", (unsigned)key + 1, PLAN_NAME_MAX,
                    axis->name);
    va_start(args, format);
    vsnprintf(error->text + used, sizeof error->text - (size_t)used, format,
              args);
    va_end(args);
    return code;
}

__attribute__((format(printf, 3, 4))) static int
move_fail_axis(const struct move *move, int code, const char *format, ...)
{
    struct plan_error *error = move->error;
    va_list args;
    int used;

    *error = (struct plan_error){ .code = code, .place = move->axis->place };
    used = snprintf(error->text, sizeof error->text,
                    "axis %.*s: ", PLAN_NAME_MAX, move->axis->name);
    va_start(args, format);
    vsnprintf(error->text + used, sizeof error->text - (size_t)used, format,
              args);
    va_end(args);
    return code;
}

static bool move_is_rest(enum plan_curve curve)
{
    return curve == PLAN_CURVE_PARABOLIC || curve == PLAN_CURVE_SINE ||
           curve == PLAN_CURVE_SCURVE;
}

/* --- judging -------------------------------------------------------------- */

static int move_check_axis(const struct move *move)
{
    const struct plan_axis *axis = move->axis;

    if ((size_t)axis->curve >= MOVE_CURVES)
        return move_fail_axis(move, MOTION_E_ARG,
                              "there is no curve with number %u",
                              (unsigned)axis->curve);
    if (axis->key_count == 0)
        return move_fail_axis(move, MOTION_E_EMPTY, "there are no keys");
    if (axis->key_count > PLAN_KEYS_MAX)
        return move_fail_axis(move, MOTION_E_FULL,
                              "%u keys are more than the %u allowed",
                              (unsigned)axis->key_count, PLAN_KEYS_MAX);
    if (axis->curve == PLAN_CURVE_CARDINAL &&
        (axis->mu_q32 < 0 || axis->mu_q32 > 2 * MOTION_FIXED_ONE_Q32))
        return move_fail_axis(move, MOTION_E_ARG, "mu is %.9g, not 0 to 2",
                              move_units(axis->mu_q32));
    if (move_is_rest(axis->curve) &&
        (axis->k1_q32 < 0 || axis->k1_q32 > axis->k2_q32 ||
         axis->k2_q32 > MOTION_FIXED_ONE_Q32))
        return move_fail_axis(move, MOTION_E_ARG,
                              "k1 is %.9g and k2 is %.9g, expected 0 <= k1 "
                              "<= k2 <= 1",
                              move_units(axis->k1_q32),
                              move_units(axis->k2_q32));
    if ((unsigned)axis->first > MOTION_SPLINE_NATURAL ||
        (unsigned)axis->last > MOTION_SPLINE_NATURAL)
        return move_fail_axis(
            move, MOTION_E_ARG, "there is no end rule with number %u",
            (unsigned)(axis->first > axis->last ? axis->first : axis->last));
    return MOTION_OK;
}

static int move_check_time(const struct move *move, uint32_t i)
{
    const struct plan_key *key = &move->axis->key[i];
    const int64_t t = key->key.t_ns_q12;
    const int64_t before = i == 0 ? 0 : key[-1].key.t_ns_q12;

    if (t < 0)
        return move_fail_key(move, MOTION_E_ORDER, i,
                             "time %.9g s is before the start of the move",
                             move_seconds(t));
    if (i > 0 && t <= before)
        return move_fail_key(
            move, MOTION_E_ORDER, i,
            "time %.9g s is not after the key before it (%.9g s)",
            move_seconds(t), move_seconds(before));
    if (t - before > MOTION_TRACK_SEGMENT_MAX_NS_Q12 ||
        t > MOTION_TRACK_MAX_NS_Q12)
        return move_fail_key(
            move, MOTION_E_RANGE, i,
            "time %.9g s is too late: at most %.9g s after the key before it "
            "and %.9g s in all",
            move_seconds(t), move_seconds(MOTION_TRACK_SEGMENT_MAX_NS_Q12),
            move_seconds(MOTION_TRACK_MAX_NS_Q12));
    return MOTION_OK;
}

static int move_check_given(const struct move *move, uint32_t i,
                            const char *what, enum move_given rule, bool has,
                            bool zero)
{
    const char *curve = move_curve[move->axis->curve].name;

    if (rule == MOVE_MUST && !has)
        return move_fail_key(move, MOTION_E_ARG, i,
                             "no %s, which %s needs at every key", what, curve);
    if (rule == MOVE_NO && has)
        return move_fail_key(move, MOTION_E_ARG, i,
                             "%s is given, but %s cannot keep it", what, curve);
    if (rule == MOVE_ZERO && has && !zero)
        return move_fail_key(move, MOTION_E_ARG, i,
                             "%s is not zero, but %s rests at every key", what,
                             curve);
    return MOTION_OK;
}

static int move_check_key(const struct move *move, uint32_t i)
{
    const struct motion_key *key = &move->axis->key[i].key;
    const enum plan_curve curve = move->axis->curve;
    int rc = move_check_time(move, i);

    if (rc == MOTION_OK)
        rc = move_check_given(move, i, "velocity", move_curve[curve].vel,
                              key->has_vel, key->vel_q32 == 0);
    if (rc == MOTION_OK)
        rc = move_check_given(move, i, "acceleration", move_curve[curve].acc,
                              key->has_acc, key->acc_q16 == 0);
    return rc;
}

static int move_check(const struct move *move)
{
    int rc = move_check_axis(move);

    for (uint32_t i = 0; rc == MOTION_OK && i < move->axis->key_count; i++)
        rc = move_check_key(move, i);
    return rc;
}

/* --- filling in ----------------------------------------------------------- */

static int move_copy(struct move *move)
{
    const uint32_t count = move->axis->key_count;

    move->key = malloc(count * sizeof *move->key);
    if (move->key == NULL)
        return move_fail_axis(move, MOTION_E_FULL, "no memory for %u keys",
                              (unsigned)count);
    for (uint32_t i = 0; i < count; i++)
        move->key[i] = move->axis->key[i].key;
    return MOTION_OK;
}

static int move_fill(const struct move *move)
{
    const struct plan_axis *axis = move->axis;
    const uint32_t count = axis->key_count;
    int rc = MOTION_OK;

    if (axis->curve == PLAN_CURVE_CARDINAL)
        rc = motion_spline_tangents_cardinal(move->key, count, axis->mu_q32,
                                             axis->first, axis->last);
    if (axis->curve == PLAN_CURVE_CATMULL_ROM ||
        axis->curve == PLAN_CURVE_QUINTIC)
        rc = motion_spline_tangents_parabola(move->key, count, axis->first,
                                             axis->last);
    if (rc == MOTION_OK && axis->curve == PLAN_CURVE_QUINTIC)
        rc = motion_spline_accelerations(move->key, count, axis->first,
                                         axis->last);
    if (rc != MOTION_OK)
        return move_fail_axis(move, rc,
                              "a velocity or acceleration between the keys is "
                              "beyond its format");
    return MOTION_OK;
}

/* --- appending ------------------------------------------------------------ */

/* Room for `more` segments, doubling. */
static int move_grow(const struct move *move, uint32_t more)
{
    struct motion_track *track = move->track;
    struct motion_segment *segment;
    const size_t need = (size_t)track->count + more;
    size_t capacity = track->capacity;

    if (need <= capacity)
        return MOTION_OK;
    capacity = capacity * 2 > need ? capacity * 2 : need;
    segment = realloc(track->segment, capacity * sizeof *segment);
    if (segment == NULL)
        return move_fail_axis(move, MOTION_E_FULL, "no memory for %zu segments",
                              capacity);
    track->segment = segment;
    track->capacity = (uint32_t)capacity;
    return MOTION_OK;
}

static void move_trim(struct motion_track *track)
{
    const size_t size = track->count * sizeof *track->segment;
    struct motion_segment *segment = realloc(track->segment, size ? size : 1);

    if (segment != NULL) {
        track->segment = segment;
        track->capacity = track->count;
    }
}

static int move_fail_span(const struct move *move, int code, uint32_t span)
{
    return move_fail_key(move, code, span + 1,
                         "the way from key %u at %.9g s is beyond the range of "
                         "position, velocity or acceleration",
                         (unsigned)span + 1,
                         move_seconds(move->key[span].t_ns_q12));
}

static int move_append_rest(const struct move *move)
{
    const struct plan_axis *axis = move->axis;
    const enum motion_ease_law law =
        axis->curve == PLAN_CURVE_SINE     ? MOTION_EASE_SINE
        : axis->curve == PLAN_CURVE_SCURVE ? MOTION_EASE_SCURVE
                                           : MOTION_EASE_PARABOLIC;
    int rc = MOTION_OK;

    for (uint32_t i = 0; rc == MOTION_OK && i + 1 < axis->key_count; i++) {
        const struct motion_key *key = &move->key[i];
        rc = move_grow(move, MOTION_EASE_SEGMENTS);
        if (rc != MOTION_OK)
            return rc;
        rc = motion_ease_append(move->track, law, key[1].pos_q32,
                                key[1].t_ns_q12 - key[0].t_ns_q12, axis->k1_q32,
                                axis->k2_q32);
        if (rc != MOTION_OK)
            return move_fail_span(move, rc, i);
    }
    return rc;
}

static int move_append_spline(const struct move *move)
{
    const uint32_t count = move->axis->key_count;
    uint32_t span = 0;
    int rc = move_grow(move, count - 1);

    if (rc != MOTION_OK)
        return rc;
    if (move->axis->curve == PLAN_CURVE_LINEAR)
        rc = motion_spline_append_linear(move->track, move->key, count, &span);
    else if (move->axis->curve == PLAN_CURVE_QUINTIC)
        rc = motion_spline_append_quintic(move->track, move->key, count, &span);
    else
        rc = motion_spline_append_cubic(move->track, move->key, count, &span);
    return rc == MOTION_OK ? MOTION_OK : move_fail_span(move, rc, span);
}

static int move_append(const struct move *move)
{
    const int64_t wait = move->key[0].t_ns_q12;
    int rc = MOTION_OK;

    if (wait > 0)
        rc = move_grow(move, 1);
    if (rc == MOTION_OK && wait > 0)
        rc = motion_track_append_dwell(move->track, wait);
    if (rc != MOTION_OK)
        return rc;
    return move_is_rest(move->axis->curve) ? move_append_rest(move)
                                           : move_append_spline(move);
}

int plan_axis_track(const struct plan_axis *axis, struct motion_track *track,
                    struct plan_error *error)
{
    struct move move = { .axis = axis, .track = track, .error = error };
    int rc;

    motion_track_init(track, NULL, 0, 0);
    rc = move_check(&move);
    if (rc == MOTION_OK)
        rc = move_copy(&move);
    if (rc == MOTION_OK)
        rc = move_fill(&move);
    if (rc == MOTION_OK) {
        motion_track_init(track, NULL, 0, move.key[0].pos_q32);
        rc = move_append(&move);
    }
    free(move.key);
    if (rc == MOTION_OK)
        move_trim(track);
    else
        plan_track_free(track);
    return rc;
}

void plan_track_free(struct motion_track *track)
{
    free(track->segment);
    motion_track_init(track, NULL, 0, 0);
}

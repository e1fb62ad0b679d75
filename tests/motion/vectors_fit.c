/* tests/motion/vectors_fit.c - peaks of quintic moves, their ratios to the
 * limits and the smallest stretch that fits; a row per group. */
#include "motion/core/err.h"
#include "motion/core/track.h"
#include "motion/plan/fit/fit.h"
#include "tests/motion/vectors_json.h"

#define FIT_KEYS_MAX  1000
#define FIT_TOLERANCE 1e-9

struct fit_case {
    double t[FIT_KEYS_MAX], p[FIT_KEYS_MAX], v[FIT_KEYS_MAX], a[FIT_KEYS_MAX];
    int keys;
    double limit[PLAN_FIT_ORDERS];
};

static bool read_case(const cJSON *item, struct fit_case *at)
{
    static const char *const limit[] = { "vmax", "amax", "jmax" };

    at->keys = cJSON_GetArraySize(vectors_get(item, "t"));
    for (int i = 0; i < PLAN_FIT_ORDERS; i++)
        if (!vectors_number(item, limit[i], &at->limit[i]))
            return false;
    return at->keys >= 2 && at->keys <= FIT_KEYS_MAX &&
           vectors_numbers(vectors_get(item, "t"), at->keys, at->t) &&
           vectors_numbers(vectors_get(item, "p"), at->keys, at->p) &&
           vectors_numbers(vectors_get(item, "v"), at->keys, at->v) &&
           vectors_numbers(vectors_get(item, "a"), at->keys, at->a);
}

/* --- a quintic in the formats of the core -------------------------------------- *
 *
 * The units: time so that it takes 64 to 128 s, whose step of 2^-12 ns is 4e-15 of
 * it; position so that displacement, v T and a T^2 are at most 2^28.  Then v is at
 * most 2^22 a unit/s or so, a 2^16 and jerk 2^16, in steps of 2^-32. */

#define FIT_TIME_BITS 7
#define FIT_SIZE_BITS 28

struct quintic {
    struct motion_segment segment;
    int time, size; /* times are multiplied by 2^time, positions by 2^size */
};

static int64_t to_q32(double value, int bits)
{
    return (int64_t)llround(ldexp(value, bits + 32));
}

static bool quintic_of(const struct fit_case *at, int k, struct quintic *to)
{
    const double dur_s = at->t[k + 1] - at->t[k],
                 displacement = at->p[k + 1] - at->p[k];
    double size = fabs(displacement);
    struct motion_track track;

    for (int i = k; i <= k + 1; i++)
        size = fmax(
            size, fmax(fabs(at->v[i]) * dur_s, fabs(at->a[i]) * dur_s * dur_s));
    (void)frexp(dur_s, &to->time);
    (void)frexp(size, &to->size);
    to->time = FIT_TIME_BITS - to->time;
    to->size = FIT_SIZE_BITS - to->size;
    const struct motion_state start = {
        .vel_q32 = to_q32(at->v[k], to->size - to->time),
        .acc_q32 = to_q32(at->a[k], to->size - 2 * to->time),
    };
    const struct motion_state end = {
        .pos_q32 = to_q32(displacement, to->size),
        .vel_q32 = to_q32(at->v[k + 1], to->size - to->time),
        .acc_q32 = to_q32(at->a[k + 1], to->size - 2 * to->time),
    };
    motion_track_init(&track, &to->segment, 1, 0);
    return motion_track_append_quintic(
               &track,
               llround(ldexp(dur_s, to->time) * (double)MOTION_FIXED_S_Q12),
               &start, &end) == MOTION_OK;
}

static bool peaks_of(const struct fit_case *at, double peak[])
{
    for (int i = 0; i < PLAN_FIT_ORDERS; i++)
        peak[i] = 0;
    for (int k = 0; k + 1 < at->keys; k++) {
        struct motion_extreme extreme[MOTION_JERK + 1];
        struct quintic quintic;
        if (!quintic_of(at, k, &quintic))
            return false;
        motion_segment_extremes(&quintic.segment, extreme);
        for (int i = 0; i < PLAN_FIT_ORDERS; i++) {
            const struct motion_extreme *const of = &extreme[MOTION_VEL + i];
            const double most =
                fmax(fabs((double)of->min), fabs((double)of->max));
            peak[i] = fmax(peak[i], ldexp(most, -32 - quintic.size +
                                                    (i + 1) * quintic.time));
        }
    }
    return true;
}

/* What slew fit says of the spans; at least 1. */
static bool need_of(const struct fit_case *at, struct plan_fit_need *worst)
{
    *worst = (struct plan_fit_need){ 1, 0 };
    for (int k = 0; k + 1 < at->keys; k++) {
        struct quintic quintic;
        if (!quintic_of(at, k, &quintic))
            return false;
        const int size = quintic.size, time = quintic.time;
        const struct plan_limit limit = {
            .vel_q32 = to_q32(at->limit[0], size - time),
            .acc_q32 = to_q32(at->limit[1], size - 2 * time),
            .jerk_q32 = to_q32(at->limit[2], size - 3 * time),
        };
        const struct motion_track track = { .segment = &quintic.segment,
                                            .count = 1 };
        const struct plan_fit_need need = plan_fit_track_need(&track, &limit);
        if (need.stretch > worst->stretch)
            *worst = need;
    }
    return true;
}

static double relative(double got, double want)
{
    return got == want ? 0 : fabs(got - want) / fabs(want);
}

/* With the stretch the move is at its limit, and not above. */
static bool stretched_fits(struct fit_case *at, double stretch)
{
    double peak[PLAN_FIT_ORDERS], worst = 0;

    for (int k = 0; k < at->keys; k++) {
        at->t[k] = at->t[0] + stretch * (at->t[k] - at->t[0]);
        at->v[k] /= stretch;
        at->a[k] /= stretch * stretch;
    }
    if (!peaks_of(at, peak))
        return false;
    for (int i = 0; i < PLAN_FIT_ORDERS; i++)
        worst = fmax(worst, peak[i] / at->limit[i]);
    return worst <= 1 + 1e-9 && (stretch == 1 || worst >= 1 - 1e-9);
}

static bool run_case(const cJSON *item, struct vectors_row *row)
{
    static const char *const order[] = { "none", "v", "a", "j" };
    struct fit_case at;
    double peak[PLAN_FIT_ORDERS], want[PLAN_FIT_ORDERS], ratio[PLAN_FIT_ORDERS],
        want_ratio[PLAN_FIT_ORDERS];
    struct plan_fit_need need;

    if (!read_case(item, &at) || !peaks_of(&at, peak) || !need_of(&at, &need) ||
        !vectors_numbers(vectors_get(item, "peak"), PLAN_FIT_ORDERS, want) ||
        !vectors_numbers(vectors_get(item, "ratio"), PLAN_FIT_ORDERS,
                         want_ratio))
        return false;
    for (int i = 0; i < PLAN_FIT_ORDERS; i++) {
        ratio[i] = peak[i] / at.limit[i];
        vectors_worst(&row->worst_p, relative(peak[i], want[i]));
        vectors_worst(&row->worst_v, relative(ratio[i], want_ratio[i]));
    }
    vectors_worst(&row->worst_a,
                  relative(need.stretch, vectors_value_of(item, "stretch")));
    if (strcmp(order[need.decided_by], vectors_text(item, "decided_by")) != 0 ||
        !stretched_fits(&at, need.stretch)) {
        fprintf(stderr, "%s: decided by %s; a stretch of %.17g\n",
                vectors_text(item, "name"), order[need.decided_by],
                need.stretch);
        row->pass = false;
    }
    row->cases++;
    return true;
}

/* The name without its number. */
static void group_of(const cJSON *item, char group[32])
{
    snprintf(group, 32, "%s", vectors_text(item, "name"));
    group[strcspn(group, "0123456789")] = '\0';
    size_t end = strlen(group);
    while (end > 0 && group[end - 1] == '_')
        group[--end] = '\0';
}

int vectors_fit(const cJSON *file, struct vectors_row *rows, int capacity)
{
    const cJSON *item;
    int count = 0;

    cJSON_ArrayForEach(item, vectors_get(file, "cases"))
    {
        char group[32];
        group_of(item, group);
        struct vectors_row *row =
            vectors_row_of(rows, capacity, &count, group, FIT_TOLERANCE);
        if (row == NULL || !run_case(item, row)) {
            fprintf(stderr, "%s: malformed\n", vectors_text(item, "name"));
            return -1;
        }
    }
    for (int i = 0; i < count; i++)
        rows[i].pass = rows[i].pass && rows[i].worst_p <= FIT_TOLERANCE &&
                       rows[i].worst_v <= FIT_TOLERANCE &&
                       rows[i].worst_a <= FIT_TOLERANCE;
    return count;
}

/* tests/motion/vectors_fit.c - peaks of quintic moves, their ratios to the
 * limits and the smallest stretch that fits; a row per group. */
#include "motion/plan/fit/fit_peak.h"
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

static bool peaks_of(const struct fit_case *at, double peak[])
{
    for (int i = 0; i < PLAN_FIT_ORDERS; i++)
        peak[i] = 0;
    for (int k = 0; k + 1 < at->keys; k++) {
        const struct plan_fit_quintic quintic = {
            .dur_s = at->t[k + 1] - at->t[k],
            .displacement = at->p[k + 1] - at->p[k],
            .vel = { at->v[k], at->v[k + 1] },
            .acc = { at->a[k], at->a[k + 1] },
        };
        double of[PLAN_FIT_ORDERS];
        if (plan_fit_quintic_peaks(&quintic, of) < 0)
            return false;
        for (int i = 0; i < PLAN_FIT_ORDERS; i++)
            peak[i] = fmax(peak[i], of[i]);
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
    unsigned decided;

    if (!read_case(item, &at) || !peaks_of(&at, peak) ||
        !vectors_numbers(vectors_get(item, "peak"), PLAN_FIT_ORDERS, want) ||
        !vectors_numbers(vectors_get(item, "ratio"), PLAN_FIT_ORDERS,
                         want_ratio))
        return false;
    for (int i = 0; i < PLAN_FIT_ORDERS; i++) {
        ratio[i] = peak[i] / at.limit[i];
        vectors_worst(&row->worst_p, relative(peak[i], want[i]));
        vectors_worst(&row->worst_v, relative(ratio[i], want_ratio[i]));
    }
    const double stretch = plan_fit_stretch(ratio, &decided);
    vectors_worst(&row->worst_a,
                  relative(stretch, vectors_value_of(item, "stretch")));
    if (strcmp(order[decided], vectors_text(item, "decided_by")) != 0 ||
        !stretched_fits(&at, stretch)) {
        fprintf(stderr, "%s: decided by %s; a stretch of %.17g\n",
                vectors_text(item, "name"), order[decided], stretch);
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

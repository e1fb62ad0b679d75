/* tests/motion/vectors_shapers.c - input shapers: design, residual vibration of
 * a real mode, delays; a row per type. */
#include "motion/plan/shaper/shaper.h"
#include "tests/motion/vectors_json.h"

#define PI       3.14159265358979323846
#define LIST_MAX 100 /* numbers in one list */

/* What is compared, and its tolerance in the scale of the case. */
enum {
    OF_AMPLITUDE,
    OF_TIME,
    OF_ZERO,
    OF_RATIO,
    OF_RESIDUAL,
    OF_DELAY,
    OF_ALL
};
static const struct {
    const char *name;
    double tolerance;
} of[OF_ALL] = {
    [OF_AMPLITUDE] = { "A", 1e-9 }, [OF_TIME] = { "t", 1e-9 },
    [OF_ZERO] = { "zeros", 1e-7 },  [OF_RATIO] = { "ratio", 1e-9 },
    [OF_RESIDUAL] = { "E", 1e-9 },  [OF_DELAY] = { "delay", 1e-9 },
};

struct shaper_type {
    unsigned cases;
    double worst[OF_ALL];
};

struct shaper_case {
    const cJSON *item;
    struct plan_shaper shaper;
    double frequency, damping, distance, duration;
    double error[OF_ALL];
};

/* The list of that name is `count` numbers within tolerance of `got`, whose
 * unit is `scale`. */
static bool compare(struct shaper_case *at, const cJSON *list, unsigned what,
                    unsigned count, const double got[], double scale)
{
    double want[LIST_MAX];

    if (count > LIST_MAX || !vectors_numbers(list, (int)count, want))
        return false;
    for (unsigned i = 0; i < count; i++)
        vectors_worst(&at->error[what], fabs(got[i] - want[i]) / scale);
    return true;
}

/* The amplitude of e = x - D at the end of the plain move, by its real and
 * imaginary part: x answers u' with the remainder of the step response,
 *     E = |int u'(s) exp((-z w + j Wd) (T - s)) ds| / sqrt(1 - z^2),
 * here by Gauss-Legendre's three points on intervals short against a period. */
static void move_phasor(const struct shaper_case *at, double rate,
                        double phasor[2])
{
    static const double x[] = { -0.774596669241483377, 0,
                                0.774596669241483377 };
    static const double weight[] = { 5.0 / 18, 8.0 / 18, 5.0 / 18 };
    const double root = sqrt(1 - at->damping * at->damping);
    const int parts = 400 + (int)(40 * rate * at->duration);

    phasor[0] = phasor[1] = 0;
    for (int i = 0; i < parts; i++) {
        for (int k = 0; k < 3; k++) {
            const double r = (i + 0.5 + 0.5 * x[k]) / parts;
            const double slope = 30 * r * r * (1 - r) * (1 - r) * at->distance;
            const double left = rate * at->duration * (1 - r);
            const double size =
                weight[k] / parts * slope * exp(-at->damping * left) / root;
            phasor[0] += size * cos(root * left);
            phasor[1] += size * sin(root * left);
        }
    }
}

/* The same after the shaped move: the sum of the shifted ones. */
static double shaped(const struct shaper_case *at, double rate,
                     const double phasor[2])
{
    const struct plan_shaper *const shaper = &at->shaper;
    const double root = sqrt(1 - at->damping * at->damping);
    double re = 0, im = 0;

    for (uint32_t i = 0; i < shaper->count; i++) {
        const double left =
            rate * (shaper->time_s[shaper->count - 1] - shaper->time_s[i]);
        const double size = shaper->amplitude[i] * exp(-at->damping * left);
        const double c = size * cos(root * left), s = size * sin(root * left);
        re += phasor[0] * c - phasor[1] * s;
        im += phasor[0] * s + phasor[1] * c;
    }
    return hypot(re, im);
}

static bool compare_residuals(struct shaper_case *at)
{
    const cJSON *const percent = vectors_get(at->item, "error_percent");
    const unsigned count = (unsigned)cJSON_GetArraySize(percent);
    double plain[LIST_MAX], rest[LIST_MAX], own[LIST_MAX], same[LIST_MAX];

    if (count == 0 || count > LIST_MAX)
        return false;
    for (unsigned i = 0; i < count; i++) {
        const double real =
            at->frequency * (1 + vectors_number_at(percent, i) / 100);
        const double rate = 2 * PI * real;
        const double end = at->shaper.time_s[at->shaper.count - 1];
        double phasor[2];

        move_phasor(at, rate, phasor);
        plain[i] = hypot(phasor[0], phasor[1]);
        rest[i] = shaped(at, rate, phasor);
        own[i] = plan_shaper_residual(&at->shaper, real);
        same[i] = own[i] * exp(at->damping * rate * end);
    }
    return compare(at, vectors_get(at->item, "unshaped"), OF_RESIDUAL, count,
                   plain, at->distance) &&
           compare(at, vectors_get(at->item, "shaped"), OF_RESIDUAL, count,
                   rest, at->distance) &&
           compare(at, vectors_get(at->item, "ratio_own_end"), OF_RATIO, count,
                   own, 1) &&
           compare(at, vectors_get(at->item, "ratio_same_time"), OF_RATIO,
                   count, same, 1);
}

static bool compare_delays(struct shaper_case *at)
{
    const cJSON *const group = vectors_get(at->item, "group_delay");
    const cJSON *const fraction =
        vectors_get(group, "at_fraction_of_frequency");
    const unsigned count = (unsigned)cJSON_GetArraySize(fraction);
    const double want = vectors_value_of(at->item, "delay_s");
    double got[LIST_MAX];

    if (count > LIST_MAX)
        return false;
    for (unsigned i = 0; i < count; i++)
        got[i] = plan_shaper_group_delay(
            &at->shaper, at->frequency * vectors_number_at(fraction, i));
    vectors_worst(&at->error[OF_DELAY],
                  fabs(plan_shaper_delay(&at->shaper) - want) * at->frequency);
    return compare(at, vectors_get(group, "s"), OF_DELAY, count, got,
                   1 / at->frequency);
}

/* Where the file has zeros and humps. */
static bool compare_zeros(struct shaper_case *at)
{
    const cJSON *const zero = vectors_get(at->item, "zero_hz");
    const cJSON *const hump = vectors_get(at->item, "hump_hz");

    return (zero == NULL || compare(at, zero, OF_ZERO, at->shaper.zeros,
                                    at->shaper.zero_hz, at->frequency)) &&
           (hump == NULL || compare(at, hump, OF_ZERO, at->shaper.humps,
                                    at->shaper.hump_hz, at->frequency));
}

static bool find_kind(const char *word, enum plan_shaper_kind *kind)
{
    for (unsigned i = 0; i < PLAN_SHAPER_KINDS; i++) {
        *kind = (enum plan_shaper_kind)i;
        if (strcmp(plan_shaper_word(*kind), word) == 0)
            return true;
    }
    return false;
}

static bool run_case(struct shaper_case *at, double residual)
{
    const cJSON *const item = at->item, *const move = vectors_get(item, "move");
    struct plan_shaper_request request = { .residual = residual };
    struct plan_error error;

    if (!find_kind(vectors_text(item, "type"), &request.kind) ||
        !vectors_number(item, "frequency_hz", &request.frequency_hz) ||
        !vectors_number(item, "damping", &request.damping) ||
        !vectors_number(move, "distance", &at->distance) ||
        !vectors_number(move, "duration", &at->duration))
        return false;
    at->frequency = request.frequency_hz;
    at->damping = request.damping;
    if (plan_shaper_design(&request, &at->shaper, &error) < 0) {
        fprintf(stderr, "%s: %s\n", vectors_text(item, "name"), error.text);
        at->error[OF_AMPLITUDE] = INFINITY;
        return true;
    }
    return compare(at, vectors_get(item, "A"), OF_AMPLITUDE, at->shaper.count,
                   at->shaper.amplitude, 1) &&
           compare(at, vectors_get(item, "t"), OF_TIME, at->shaper.count,
                   at->shaper.time_s, 1 / at->frequency) &&
           compare_zeros(at) && compare_residuals(at) && compare_delays(at);
}

/* Into the row of its type; a case that fails is named. */
static void take(const struct shaper_case *at, struct shaper_type *type,
                 struct vectors_row *row)
{
    for (unsigned i = 0; i < OF_ALL; i++) {
        vectors_worst(&type->worst[i], at->error[i]);
        if (at->error[i] <= of[i].tolerance)
            continue;
        row->pass = false;
        fprintf(stderr, "%s: %s is off by %.3g, allowed %.3g\n",
                vectors_text(at->item, "name"), of[i].name, at->error[i],
                of[i].tolerance);
    }
    type->cases++;
    row->cases++;
}

static void describe(const struct shaper_type *type, struct vectors_row *row)
{
    int n = snprintf(row->text, sizeof row->text, "%u", type->cases);

    for (unsigned i = 0; i < OF_ALL; i++)
        n += snprintf(row->text + n, sizeof row->text - (size_t)n, " %s %.2g",
                      of[i].name, type->worst[i]);
}

int vectors_shapers(const cJSON *file, struct vectors_row *rows, int capacity)
{
    const double given = vectors_value_of(file, "vibration_limit_ei");
    const double residual = isfinite(given) ? given : PLAN_SHAPER_RESIDUAL;
    struct shaper_type type[PLAN_SHAPER_KINDS] = { 0 };
    const cJSON *item;
    int count = 0;

    if (capacity < PLAN_SHAPER_KINDS)
        return -1;
    cJSON_ArrayForEach(item, vectors_get(file, "cases"))
    {
        struct shaper_case at = { .item = item };
        const char *const name = vectors_text(item, "type");

        if (!run_case(&at, residual)) {
            fprintf(stderr, "%s: malformed\n", vectors_text(item, "name"));
            return -1;
        }
        struct vectors_row *row =
            vectors_row_of(rows, capacity, &count, name, 1e-9);
        take(&at, &type[row - rows], row);
    }
    for (int i = 0; i < count; i++)
        describe(&type[i], &rows[i]);
    return count;
}

/* tests/sim/vectors_physics.c - see vectors_physics.h. */
#include "tests/sim/vectors_physics.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/motion/vectors_json.h"

#define ENTRIES_MAX 24
#define LISTED_MAX  4096

static const struct {
    const char *family;
    physics_make *make;
} families[] = {
    { "drive_two_mass", physics_make_drive },
    { "drive_three_mass", physics_make_drive },
    { "backlash", physics_make_drive },
    { "friction", physics_make_friction },
    { "end_stop", physics_make_end_stop },
    { "motor", physics_make_motor },
    { "gravity_arm", physics_make_arm },
    { "motor_thermal", physics_make_thermal },
    { "free_fall", physics_make_particle },
    { "spring_mass_damper", physics_make_oscillator },
    { "particle_pair", physics_make_pair },
    { "hanging_cable", physics_make_cable },
    { "cable_dynamic", physics_make_cable },
    { "cloth_rest", physics_make_cloth },
    { "cloth_dynamic", physics_make_cloth },
    { "cloth_spheres", physics_make_cloth },
    { "chain_modes", physics_make_chain },
    { "pendulum", physics_make_pendulum },
    { "dolly_pendulum", physics_make_pendulum },
    { "double_pendulum", physics_make_double_pendulum },
    { "hanging_chain_modes", physics_make_links },
    { "sphere_collision", physics_make_spheres },
    { "bouncing_ball", physics_make_spheres },
    { "fast_sphere", physics_make_spheres },
    { "rolling", physics_make_spheres },
    { "sphere_stack", physics_make_spheres },
    { "sphere_box", physics_make_spheres },
    { "tilting_plate", physics_make_plate },
};

/* What is judged: an entry of `expect` or of `invariant`. */
struct judged {
    const cJSON *json;
    const char *q, *rule; /* rule: of an invariant */
    double tol_abs, tol_rel;
    const cJSON *next_time, *next_want;
    /* invariants */
    double start[16], lowest, first_sum, last_sum;
    int start_count;
    long first_count, last_count, duration_ticks;
    /* the largest deviation as a part of its tolerance, and these two */
    double part, deviation, tolerance;
    int compared;
    const char *failed; /* why nothing could be compared */
};

struct run {
    struct physics_plant plant;
    struct judged judged[ENTRIES_MAX];
    int count;
    long ticks;
};

int physics_flatten(const cJSON *list, double *to, int capacity)
{
    const cJSON *item, *inner, *number;
    int n = 0;

    if (cJSON_IsNumber(list)) {
        to[0] = list->valuedouble;
        return 1;
    }
    cJSON_ArrayForEach(item, list)
    {
        if (cJSON_IsNumber(item) && n < capacity)
            to[n++] = item->valuedouble;
        cJSON_ArrayForEach(inner, item)
        {
            if (cJSON_IsNumber(inner) && n < capacity)
                to[n++] = inner->valuedouble;
            cJSON_ArrayForEach(number, inner)
            {
                if (!cJSON_IsNumber(number) || n == capacity)
                    return -1;
                to[n++] = number->valuedouble;
            }
        }
    }
    return n;
}

bool physics_list(const cJSON *item, const char *name, double *to, int count)
{
    return vectors_numbers(vectors_get(item, name), count, to);
}

/* The piece in force at t_s. */
static int physics_piece(const cJSON *times, double t_s)
{
    const cJSON *time;
    int piece = -1;

    cJSON_ArrayForEach(time, times)
    {
        if (time->valuedouble > t_s + 1e-9)
            break;
        piece++;
    }
    return piece;
}

struct sim_signal physics_input(const cJSON *item, const char *name, double t_s)
{
    const cJSON *const input = vectors_get(vectors_get(item, "input"), name);
    const cJSON *const times = vectors_get(input, "t");
    const int piece = physics_piece(times, t_s);
    struct sim_signal signal = { { 0 } };

    if (piece < 0)
        return signal;
    const double since_s = t_s - vectors_number_at(times, piece);
    const int count =
        physics_flatten(cJSON_GetArrayItem(vectors_get(input, "c"), piece),
                        signal.c, SIM_SIGNAL_COEFFICIENTS);
    /* The same polynomial of the time since t_s: Horner's shift. */
    for (int i = 0; i < count; i++) {
        for (int j = count - 2; j >= i; j--)
            signal.c[j] += since_s * signal.c[j + 1];
    }
    return signal;
}

/* The first begin of a piece of any input inside (t_s, end_s), else end_s. */
static double physics_until(const cJSON *item, double t_s, double end_s)
{
    const cJSON *input, *time;

    cJSON_ArrayForEach(input, vectors_get(item, "input"))
    {
        cJSON_ArrayForEach(time, vectors_get(input, "t"))
        {
            if (time->valuedouble > t_s + 1e-9 &&
                time->valuedouble < end_s - 1e-9)
                end_s = time->valuedouble;
        }
    }
    return end_s;
}

void physics_crossings_add(struct physics_crossings *of, double t_s,
                           double step_s, double value, double slope)
{
    const int room = (int)(sizeof of->times / sizeof of->times[0]);

    if (of->begun && of->last < 0 && value >= 0 && of->count < room) {
        double low = 0, high = 1;
        for (int i = 0; i < 60; i++) {
            const double s = 0.5 * (low + high), r = 1 - s;
            const double at = of->last * r * r * (1 + 2 * s) +
                              value * s * s * (3 - 2 * s) +
                              step_s * s * r * (of->last_slope * r - slope * s);
            *(at < 0 ? &low : &high) = s;
        }
        of->times[of->count++] = t_s - step_s + high * step_s;
    }
    of->last = value;
    of->last_slope = slope;
    of->begun = true;
}

double physics_crossings_period(const struct physics_crossings *of, int most)
{
    const int periods = of->count - 1 < most ? of->count - 1 : most;

    if (periods < 1)
        return NAN;
    return (of->times[of->count - 1] - of->times[of->count - 1 - periods]) /
           periods;
}

static void judged_fail(struct judged *judged, const char *why)
{
    judged->failed = why;
    judged->part = INFINITY;
}

static void judged_add(struct judged *judged, double deviation,
                       double tolerance)
{
    const double part = tolerance > 0    ? deviation / tolerance
                        : deviation <= 0 ? 0
                                         : INFINITY;

    judged->compared++;
    if (!(part <= judged->part) || judged->compared == 1) {
        judged->part = isnan(part) ? INFINITY : part;
        judged->deviation = deviation;
        judged->tolerance = tolerance;
    }
}

/* The largest |got - want| as a part of its tolerance; sign -1 mirrors y. */
static double judged_worst(struct judged *judged, const double *got,
                           const double *want, int count, bool mirrored)
{
    struct judged side = *judged;

    side.compared = 0;
    side.part = 0;
    for (int i = 0; i < count; i++) {
        const double value = mirrored && i % 3 == 1 ? -got[i] : got[i];
        judged_add(&side, fabs(value - want[i]),
                   judged->tol_abs + judged->tol_rel * fabs(want[i]));
    }
    return side.part;
}

static void judged_compare(struct judged *judged, const cJSON *list,
                           const double *got, int count)
{
    static double want[LISTED_MAX];
    const int wanted = physics_flatten(list, want, LISTED_MAX);
    bool mirrored = false;

    if (wanted < 0 || count != wanted) {
        judged_fail(judged, count < 0 ? "is not computed"
                                      : "has another number of values");
        return;
    }
    if (strcmp(vectors_text(judged->json, "mirror"), "y") == 0)
        mirrored = judged_worst(judged, got, want, count, true) <
                   judged_worst(judged, got, want, count, false);
    for (int i = 0; i < count; i++) {
        const double value = mirrored && i % 3 == 1 ? -got[i] : got[i];
        judged_add(judged, fabs(value - want[i]),
                   judged->tol_abs + judged->tol_rel * fabs(want[i]));
    }
}

static void judged_invariant(struct run *run, struct judged *judged, long tick)
{
    double got[16];
    const int count = run->plant.read(run->plant.self, judged->q, got, 16);

    if (count < 1 || count != judged->start_count) {
        judged_fail(judged, "is not computed");
        return;
    }
    if (strcmp(judged->rule, "constant") == 0 || tick == 0) {
        for (int i = 0; i < count; i++)
            judged_add(judged, fabs(got[i] - judged->start[i]),
                       judged->tol_abs);
    } else if (strcmp(judged->rule, "no_gain") == 0) {
        judged_add(judged, got[0] - judged->start[0], judged->tol_abs);
    } else if (strcmp(judged->rule, "not_rising") == 0) {
        judged_add(judged, got[0] - judged->lowest, judged->tol_abs);
    } else if (strcmp(judged->rule, "bounded") == 0) {
        judged_add(judged, got[0], judged->tol_abs);
    } else if (strcmp(judged->rule, "no_drift") != 0) {
        judged_fail(judged, "has a rule that is not known");
    }
    if (tick == 0 || got[0] < judged->lowest)
        judged->lowest = got[0];
    if (10 * tick <= judged->duration_ticks) {
        judged->first_sum += got[0] - judged->start[0];
        judged->first_count++;
    }
    if (10 * tick >= 9 * judged->duration_ticks) {
        judged->last_sum += got[0] - judged->start[0];
        judged->last_count++;
    }
    if (strcmp(judged->rule, "no_drift") == 0 && tick == judged->duration_ticks)
        judged_add(judged,
                   fabs(judged->last_sum / (double)judged->last_count -
                        judged->first_sum / (double)judged->first_count),
                   judged->tol_abs);
}

/* What is to be compared at t_s. */
static void run_compare(struct run *run, double t_s)
{
    static double got[PHYSICS_NUMBERS];

    for (int i = 0; i < run->count; i++) {
        struct judged *const judged = &run->judged[i];

        while (judged->failed == NULL && judged->next_time != NULL &&
               fabs(judged->next_time->valuedouble - t_s) < 1e-9) {
            judged_compare(judged, judged->next_want, got,
                           run->plant.read(run->plant.self, judged->q, got,
                                           PHYSICS_NUMBERS));
            judged->next_time = judged->next_time->next;
            judged->next_want =
                judged->next_want ? judged->next_want->next : NULL;
        }
    }
}

static void run_invariants(struct run *run, long tick)
{
    for (int i = 0; i < run->count; i++) {
        struct judged *const judged = &run->judged[i];

        if (judged->failed == NULL && judged->rule != NULL &&
            tick <= judged->duration_ticks)
            judged_invariant(run, judged, tick);
    }
}

static void run_results(struct run *run)
{
    static double got[LISTED_MAX], want[LISTED_MAX];

    for (int i = 0; i < run->count; i++) {
        struct judged *const judged = &run->judged[i];
        const cJSON *const list = vectors_get(judged->json, "want");

        if (judged->failed != NULL || judged->rule != NULL)
            continue;
        if (judged->next_time != NULL) {
            judged_fail(judged, "was not reached");
            continue;
        }
        if (cJSON_HasObjectItem(judged->json, "t"))
            continue;
        const int wanted = physics_flatten(list, want, LISTED_MAX);
        judged_compare(
            judged, list, got,
            run->plant.result(run->plant.self, judged->json, got, wanted));
    }
}

static bool run_gather(struct run *run, const cJSON *item)
{
    const cJSON *entry, *time;

    run->ticks = lround(ceil(run->plant.duration_s / PHYSICS_TICK_S));
    cJSON_ArrayForEach(entry, vectors_get(item, "expect"))
    {
        if (run->count == ENTRIES_MAX)
            return false;
        struct judged *const judged = &run->judged[run->count++];
        const double relative = vectors_value_of(entry, "tol_rel");
        *judged = (struct judged){
            .json = entry,
            .q = vectors_text(entry, "q"),
            .tol_abs = vectors_value_of(entry, "tol_abs"),
            .tol_rel = isnan(relative) ? 0 : relative,
            .next_time = cJSON_GetArrayItem(vectors_get(entry, "t"), 0),
            .next_want = cJSON_GetArrayItem(vectors_get(entry, "want"), 0),
        };
        cJSON_ArrayForEach(time, vectors_get(entry, "t"))
        {
            const long tick =
                lround(ceil(time->valuedouble / PHYSICS_TICK_S - 1e-6));
            run->ticks = tick > run->ticks ? tick : run->ticks;
        }
    }
    cJSON_ArrayForEach(entry, vectors_get(item, "invariant"))
    {
        if (run->count == ENTRIES_MAX)
            return false;
        struct judged *const judged = &run->judged[run->count++];
        *judged = (struct judged){
            .json = entry,
            .q = vectors_text(entry, "q"),
            .rule = vectors_text(entry, "rule"),
            .tol_abs = vectors_value_of(entry, "tol"),
            .duration_ticks =
                lround(vectors_value_of(entry, "duration") / PHYSICS_TICK_S),
        };
        judged->start_count =
            physics_flatten(vectors_get(entry, "start"), judged->start, 16);
        if (judged->duration_ticks > run->ticks)
            run->ticks = judged->duration_ticks;
    }
    return run->count > 0;
}

/* The first time to compare at inside (t_s, end_s), else end_s. */
static double run_until(const struct run *run, double t_s, double end_s)
{
    for (int i = 0; i < run->count; i++) {
        const cJSON *const time = run->judged[i].next_time;
        if (time != NULL && time->valuedouble > t_s + 1e-9 &&
            time->valuedouble < end_s - 1e-9)
            end_s = time->valuedouble;
    }
    return end_s;
}

static bool run_tick(struct run *run, const cJSON *item, long tick)
{
    const double end_s = (double)(tick + 1) * PHYSICS_TICK_S;

    for (double t_s = (double)tick * PHYSICS_TICK_S; t_s < end_s;) {
        const double until_s =
            run_until(run, t_s, physics_until(item, t_s, end_s));
        if (run->plant.step(run->plant.self, t_s, until_s - t_s) < 0)
            return false;
        t_s = until_s;
        run_compare(run, t_s);
    }
    return true;
}

static void run_all(struct run *run, const cJSON *item)
{
    run_compare(run, 0);
    run_invariants(run, 0);
    for (long tick = 0; tick < run->ticks; tick++) {
        if (!run_tick(run, item, tick)) {
            for (int i = 0; i < run->count; i++)
                judged_fail(&run->judged[i], "stopped: a step was refused");
            return;
        }
        run_invariants(run, tick + 1);
    }
    run_results(run);
}

static void run_report(const struct run *run, struct vectors_row *row)
{
    const struct judged *worst = &run->judged[0];

    row->pass = true;
    for (int i = 0; i < run->count; i++) {
        const struct judged *const judged = &run->judged[i];

        if (judged->part > worst->part)
            worst = judged;
        if (judged->compared == 0 || !(judged->part <= 1))
            row->pass = false;
    }
    if (worst->failed != NULL)
        snprintf(row->text, sizeof row->text, "%s %s", worst->q, worst->failed);
    else
        snprintf(row->text, sizeof row->text, "%s%s%s %.3g %.3g", worst->q,
                 worst->rule ? " " : "", worst->rule ? worst->rule : "",
                 worst->deviation, worst->tolerance);
}

static bool physics_make_any(const cJSON *item, struct physics_plant *plant)
{
    const char *const family = vectors_text(item, "family");

    for (size_t i = 0; i < sizeof families / sizeof families[0]; i++) {
        if (strcmp(families[i].family, family) == 0)
            return families[i].make(item, plant);
    }
    return false;
}

static bool physics_case(const cJSON *item, struct vectors_row *row)
{
    struct run *const run = calloc(1, sizeof *run);

    snprintf(row->method, sizeof row->method, "%s/%s",
             vectors_text(item, "family"), vectors_text(item, "name"));
    snprintf(row->text, sizeof row->text, "no plant of this kind");
    if (run != NULL && physics_make_any(item, &run->plant) &&
        run_gather(run, item)) {
        run_all(run, item);
        run_report(run, row);
    }
    if (run != NULL)
        free(run->plant.self);
    free(run);
    return true;
}

int vectors_physics(const cJSON *file, struct vectors_row *rows, int capacity)
{
    const cJSON *item;
    int count = 0;

    cJSON_ArrayForEach(item, vectors_get(file, "cases"))
    {
        if (count == capacity || !physics_case(item, &rows[count]))
            return -1;
        count++;
    }
    return count;
}

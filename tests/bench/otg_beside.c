/* tests/bench/otg_beside.c - our planner and Ruckig on the same problems, one
 * after the other in the same run.
 *
 *   otg_beside [DIRECTORY]
 *
 * The problems are those of otg_random.h; with a directory also the rows of
 * otg_position.csv and otg_sync3.csv in it.  Each problem is planned a few
 * times by either, and the shortest time counts: what the machine does besides
 * only ever adds.  Status 1 when we leave a problem without an answer. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "firmware/host/exchange/otg_rows.h"
#include "motion/core/err.h"
#include "motion/otg/sync.h"
#include "tests/bench/otg_random.h"
#include "tests/bench/ruckig_side.h"

#define AXES    RUCKIG_AXES_MOST
#define REPEATS 5
#define SAMPLES 200  /* of a plan that is sampled */
#define EVERY   10   /* plans per one that is sampled */
#define CLOSE   1e-6 /* durations that count as equal */

/* --- a problem for both --------------------------------------------------- */

struct problem {
    int axes;
    struct motion_otg_move move[AXES];
    struct ruckig_axis axis[AXES];
    double second; /* of Ruckig's time, in ours */
    bool violates;
};

static double q32(int64_t value)
{
    return ldexp((double)value, -32 - OTG_RANDOM_LENGTH_BITS);
}

static struct ruckig_axis axis_of(const struct motion_otg_move *move)
{
    const struct motion_otg_limit *limit = &move->limit;
    return (struct ruckig_axis){
        .p0 = q32(move->start.pos_q32),
        .v0 = q32(move->start.vel_q32),
        .a0 = q32(move->start.acc_q32),
        .pf = q32(move->goal.pos_q32),
        .vf = q32(move->goal.vel_q32),
        .af = q32(move->goal.acc_q32),
        .vmax = q32(limit->vel_max_q32),
        .vmin = q32(limit->vel_min_q32),
        .amax = q32(limit->acc_max_q32),
        .amin = q32(limit->acc_min_q32),
        .jmax = q32(limit->jerk_q32),
    };
}

static struct ruckig_axis axis_of_row(const double value[OTG_VALUES])
{
    return (struct ruckig_axis){
        .p0 = value[OTG_P0],
        .v0 = value[OTG_V0],
        .a0 = value[OTG_A0],
        .pf = value[OTG_PF],
        .vf = value[OTG_VF],
        .af = value[OTG_AF],
        .vmax = value[OTG_VMAX],
        .vmin = value[OTG_VMIN],
        .amax = value[OTG_AMAX],
        .amin = value[OTG_AMIN],
        .jmax = value[OTG_JMAX],
    };
}

/* --- lists of problems ---------------------------------------------------- */

struct list {
    struct problem *problem;
    size_t count;
};

static struct problem *list_add(struct list *list, int axes)
{
    size_t size = (list->count + 1) * sizeof *list->problem;
    list->problem = realloc(list->problem, size);
    if (list->problem == NULL) {
        fputs("out of memory\n", stderr);
        exit(2);
    }
    struct problem *problem = &list->problem[list->count++];
    *problem = (struct problem){ .axes = axes, .second = 1 };
    return problem;
}

static void list_generate(struct list *list, int axes, uint32_t count)
{
    uint64_t seed = 20 + (uint64_t)axes;
    for (uint32_t row = 0; row < count; row++) {
        struct problem *problem = list_add(list, axes);
        enum otg_random_kind kind = otg_random_kind(row);
        if (axes == 1)
            otg_random_move(&seed, kind, problem->move);
        else
            otg_random_moves(&seed, row, axes, problem->move);
        problem->violates = axes == 1 && kind == OTG_RANDOM_START_VIOLATES;
        for (int i = 0; i < axes; i++)
            problem->axis[i] = axis_of(&problem->move[i]);
    }
}

static void list_add_row(struct list *list, const struct otg_header *header,
                         const struct otg_row *row)
{
    struct problem *problem = list_add(list, header->axes);
    struct otg_scaled scaled;
    otg_rows_scale(header, row, 1, &scaled);
    problem->second = ldexp(1, scaled.time);
    problem->violates = strcmp(row->category, "start_violates") == 0;
    for (int i = 0; i < header->axes; i++) {
        problem->move[i] = scaled.move[i];
        problem->axis[i] = axis_of_row(row->value[i]);
    }
}

static void list_read(struct list *list, const char *directory,
                      const char *name)
{
    static char line[1 << 14];
    struct otg_header header;
    struct otg_row row;
    char path[4096];
    int column;
    snprintf(path, sizeof path, "%s/%s", directory, name);
    FILE *file = fopen(path, "r");
    if (file == NULL || fgets(line, sizeof line, file) == NULL ||
        otg_header_parse(line, &header) != NULL || header.axes > AXES) {
        fprintf(stderr, "%s: not a list of problems\n", path);
        exit(2);
    }
    while (fgets(line, sizeof line, file) != NULL)
        if (otg_row_parse(&header, line, &row, &column) == NULL)
            list_add_row(list, &header, &row);
    fclose(file);
}

/* --- one problem ---------------------------------------------------------- */

static double now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e9 + (double)now.tv_nsec;
}

static struct motion_otg_plan plan[AXES];

static int ours_plan(const struct problem *problem)
{
    if (problem->axes == 1)
        return motion_otg_make(problem->move, plan, NULL);
    return motion_sync_make(problem->move, problem->axes, MOTION_SYNC_TIME,
                            plan, NULL);
}

struct tracks {
    struct motion_segment capacity[AXES][MOTION_OTG_PHASES];
    struct motion_track track[AXES];
    struct motion_cursor cursor[AXES];
};

static int tracks_make(const struct problem *problem, struct tracks *tracks)
{
    int err = MOTION_OK;
    memset(tracks->cursor, 0, sizeof tracks->cursor);
    for (int i = 0; i < problem->axes && err == MOTION_OK; i++) {
        motion_track_init(&tracks->track[i], tracks->capacity[i],
                          MOTION_OTG_PHASES, plan[i].start_pos_q32);
        err = motion_otg_append(&plan[i], &tracks->track[i]);
    }
    return err;
}

static volatile int64_t ours_sink;
static volatile double ruckig_sink;

static double ours_sample_ns(const struct problem *problem,
                             struct tracks *tracks)
{
    struct motion_sample sample;
    int64_t step = plan[0].dur_ns_q12 / SAMPLES, sum = 0;
    double start = now_ns();
    for (int k = 0; k < SAMPLES; k++)
        for (int i = 0; i < problem->axes; i++) {
            motion_track_sample(&tracks->track[i], &tracks->cursor[i], step * k,
                                &sample);
            sum ^= sample.pos_q32;
        }
    double took = now_ns() - start;
    ours_sink = sum;
    return took / SAMPLES;
}

static double ruckig_sample_ns(const struct problem *problem)
{
    double step = ruckig_duration(problem->axes) / SAMPLES, sum = 0;
    double start = now_ns();
    for (int k = 0; k < SAMPLES; k++)
        sum += ruckig_sample(problem->axes, step * k);
    double took = now_ns() - start;
    ruckig_sink = sum;
    return took / SAMPLES;
}

static void keep_least(double *least, double value)
{
    if (value < *least)
        *least = value;
}

struct times {
    double ours_ns, ruckig_ns;
};

/* Shortest of some runs; false when we have no answer. */
static bool plan_times(const struct problem *problem, struct times *times)
{
    int err = MOTION_OK;
    *times = (struct times){ INFINITY, INFINITY };
    ruckig_set(problem->axes, problem->axis);
    for (int k = 0; k < REPEATS; k++) {
        double start = now_ns();
        err = ours_plan(problem);
        double middle = now_ns();
        ruckig_plan(problem->axes);
        keep_least(&times->ours_ns, middle - start);
        keep_least(&times->ruckig_ns, now_ns() - middle);
    }
    return err == MOTION_OK;
}

static bool sample_times(const struct problem *problem, struct times *times)
{
    static struct tracks tracks;
    *times = (struct times){ INFINITY, INFINITY };
    if (isnan(ruckig_duration(problem->axes)) ||
        tracks_make(problem, &tracks) != MOTION_OK)
        return false;
    for (int k = 0; k < REPEATS; k++) {
        keep_least(&times->ours_ns, ours_sample_ns(problem, &tracks));
        keep_least(&times->ruckig_ns, ruckig_sample_ns(problem));
    }
    return true;
}

/* --- a list --------------------------------------------------------------- */

struct column {
    double *value;
    size_t count;
    double sum;
};

static void column_add(struct column *column, double value)
{
    column->value[column->count++] = value;
    column->sum += value;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double column_at(const struct column *column, double share)
{
    return column->value[(size_t)(share * (double)(column->count - 1))];
}

struct pair {
    struct column ours, ruckig;
};

static void pair_init(struct pair *pair, size_t capacity)
{
    *pair = (struct pair){ .ours.value = calloc(capacity, sizeof(double)),
                           .ruckig.value = calloc(capacity, sizeof(double)) };
    if (pair->ours.value == NULL || pair->ruckig.value == NULL)
        exit(2);
}

static void pair_add(struct pair *pair, const struct times *times)
{
    column_add(&pair->ours, times->ours_ns);
    column_add(&pair->ruckig, times->ruckig_ns);
}

static void pair_print(struct pair *pair, const char *what)
{
    static const struct {
        const char *name;
        double share; /* below 0: the mean */
    } rows[] = { { "mean", -1 }, { "p99", 0.99 }, { "worst", 1 } };
    if (pair->ours.count == 0)
        return;
    qsort(pair->ours.value, pair->ours.count, sizeof(double), compare);
    qsort(pair->ruckig.value, pair->ruckig.count, sizeof(double), compare);
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        double n = (double)pair->ours.count;
        double ours = rows[i].share < 0 ? pair->ours.sum / n
                                        : column_at(&pair->ours, rows[i].share);
        double ruckig = rows[i].share < 0
                            ? pair->ruckig.sum / n
                            : column_at(&pair->ruckig, rows[i].share);
        printf("    %-7s %-6s %12.0f %12.0f %9.2f\n", i == 0 ? what : "",
               rows[i].name, ours, ruckig, ruckig / ours);
    }
    free(pair->ours.value);
    free(pair->ruckig.value);
}

/* How the durations compare; above 0: ours is longer. */
struct agreement {
    size_t compared, without, longer, shorter, ruckig_without;
    double longest, shortest;
};

static void agreement_add(struct agreement *agreement,
                          const struct problem *problem)
{
    double theirs = ruckig_duration(problem->axes);
    double ours = ldexp((double)plan[0].dur_ns_q12, -12) * 1e-9;
    if (isnan(theirs)) {
        agreement->ruckig_without++;
        return;
    }
    if (problem->violates || theirs <= 0)
        return;
    double by = (ours * problem->second - theirs) / theirs;
    agreement->compared++;
    agreement->longer += by > CLOSE;
    agreement->shorter += by < -CLOSE;
    agreement->longest = fmax(agreement->longest, by);
    agreement->shortest = fmin(agreement->shortest, by);
}

static void agreement_print(const struct agreement *agreement)
{
    printf("    durations compared: %zu; longer by over 1e-6: %zu (most %.1e),"
           " shorter: %zu (most %.1e)\n",
           agreement->compared, agreement->longer, agreement->longest,
           agreement->shorter, -agreement->shortest);
    printf("    without an answer: ours %zu, Ruckig %zu\n", agreement->without,
           agreement->ruckig_without);
}

static size_t list_run(struct list *list, const char *name)
{
    struct agreement agreement = { 0 };
    struct pair plans, samples;
    struct times times;
    pair_init(&plans, list->count);
    pair_init(&samples, list->count);
    for (size_t i = 0; i < list->count; i++) {
        const struct problem *problem = &list->problem[i];
        if (!plan_times(problem, &times)) {
            printf("  %s, problem %zu: no answer\n", name, i);
            agreement.without++;
            continue;
        }
        pair_add(&plans, &times);
        agreement_add(&agreement, problem);
        if (i % EVERY == 0 && sample_times(problem, &times))
            pair_add(&samples, &times);
    }
    printf("  %s, %zu problems%*s ours ns    Ruckig ns     ratio\n", name,
           list->count, (int)(22 - strlen(name)), "");
    pair_print(&plans, "plan");
    pair_print(&samples, "sample");
    agreement_print(&agreement);
    free(list->problem);
    *list = (struct list){ 0 };
    return agreement.without;
}

int main(int argc, char **argv)
{
    static const struct {
        const char *name;
        int axes;
        uint32_t count;
    } sets[] = { { "1 axis", 1, 12000 },
                 { "3 axes", 3, 3000 },
                 { "7 axes", 7, 1500 } };
    struct list list = { 0 };
    size_t without = 0;
    for (size_t i = 0; i < sizeof sets / sizeof sets[0]; i++) {
        list_generate(&list, sets[i].axes, sets[i].count);
        without += list_run(&list, sets[i].name);
    }
    if (argc > 1) {
        list_read(&list, argv[1], "otg_position.csv");
        without += list_run(&list, "otg_position.csv");
        list_read(&list, argv[1], "otg_sync3.csv");
        without += list_run(&list, "otg_sync3.csv");
    }
    return without > 0;
}

/* tests/bench/topp_beside.c - what time-optimal timing of paths costs, for
 * topp_beside.py, which times toppra on the same.
 *
 *     topp-beside WAYPOINTS AXES SEED
 *
 * Prints JSON: waypoints, limits, and for each number of intervals the least
 * processor time of several runs, spline set-up included, and the duration found. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "motion/core/fixed.h"
#include "motion/plan/move.h"
#include "motion/plan/topp/topp.h"

#define AXES_MAX 12
#define KEYS_MAX 100

static struct plan_key key[AXES_MAX][KEYS_MAX];
static struct plan_topp_limit limit[AXES_MAX];

static double draw(uint64_t *seed, double low, double high)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(*seed >> 40) / (1 << 24);
}

static double now_s(void)
{
    struct timespec at;

    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &at);
    return (double)at.tv_sec + (double)at.tv_nsec * 1e-9;
}

static void fill(unsigned axes, unsigned keys, uint64_t seed)
{
    for (unsigned a = 0; a < axes; a++) {
        const double vel = draw(&seed, 1, 3), acc = draw(&seed, 2, 8);
        limit[a] = (struct plan_topp_limit){ -vel, vel, -acc, acc };
        for (unsigned k = 0; k < keys; k++)
            key[a][k].key = (struct motion_key){
                .t_ns_q12 = k * MOTION_FIXED_S_Q12,
                .pos_q32 = (int64_t)(draw(&seed, -2, 2) * 0x1p32),
            };
    }
}

static void fail(const char *what)
{
    fprintf(stderr, "topp-beside: %s\n", what);
    exit(1);
}

/* From the waypoints to the law. */
static double solve(unsigned axes, unsigned keys, uint32_t intervals)
{
    struct motion_track track[AXES_MAX];
    const struct motion_track *list[AXES_MAX];
    struct plan_topp_request request = { .limit = limit,
                                         .intervals = intervals };
    struct plan_error error;
    struct plan_pool pool = { NULL };
    struct plan_topp topp;
    double failed, duration;

    for (unsigned a = 0; a < axes; a++) {
        const struct plan_axis axis = { .curve = PLAN_CURVE_C2,
                                        .first = MOTION_SPLINE_NATURAL,
                                        .last = MOTION_SPLINE_NATURAL,
                                        .key = key[a],
                                        .key_count = keys };
        if (plan_axis_track(&axis, &track[a], &error) < 0)
            fail(error.text);
        list[a] = &track[a];
    }
    if (plan_topp_path_of(list, axes, &pool, &request.path) < 0 ||
        plan_topp_solve(&request, &pool, &topp, &failed) < 0)
        fail("no answer");
    duration = plan_topp_duration(&topp);
    plan_pool_free(&pool);
    for (unsigned a = 0; a < axes; a++)
        plan_track_free(&track[a]);
    return duration;
}

static void print_run(unsigned axes, unsigned keys, uint32_t intervals)
{
    /* As long as ten runs of toppra: the least of many is the quiet one. */
    const int runs = intervals > 10000 ? 3 : 60;
    double least = 1e9, duration = 0;

    for (int i = 0; i < runs; i++) {
        const double from = now_s();
        duration = solve(axes, keys, intervals);
        const double took = now_s() - from;
        least = took < least ? took : least;
    }
    printf("{\"intervals\": %u, \"seconds\": %.9g, \"duration\": %.12g}",
           intervals, least, duration);
}

static void print_problem(unsigned axes, unsigned keys)
{
    printf("\"vel\": [");
    for (unsigned a = 0; a < axes; a++)
        printf("%s%.17g", a > 0 ? ", " : "", limit[a].vel_max);
    printf("], \"acc\": [");
    for (unsigned a = 0; a < axes; a++)
        printf("%s%.17g", a > 0 ? ", " : "", limit[a].acc_max);
    printf("], \"waypoints\": [");
    for (unsigned k = 0; k < keys; k++) {
        printf("%s[", k > 0 ? ", " : "");
        for (unsigned a = 0; a < axes; a++)
            printf("%s%.17g", a > 0 ? ", " : "",
                   (double)key[a][k].key.pos_q32 / 0x1p32);
        printf("]");
    }
    printf("]");
}

int main(int argc, char *argv[])
{
    static const uint32_t intervals[] = { 1000, 10000, 100000 };
    const unsigned keys = argc == 4 ? (unsigned)atoi(argv[1]) : 0;
    const unsigned axes = argc == 4 ? (unsigned)atoi(argv[2]) : 0;

    if (keys < 2 || keys > KEYS_MAX || axes < 1 || axes > AXES_MAX)
        fail("expected WAYPOINTS, 2 .. 100, AXES, 1 .. 12, SEED");
    fill(axes, keys, strtoull(argv[3], NULL, 0));
    printf("{");
    print_problem(axes, keys);
    printf(", \"runs\": [");
    for (unsigned i = 0; i < sizeof intervals / sizeof *intervals; i++) {
        if (i > 0)
            printf(", ");
        print_run(axes, keys, intervals[i]);
    }
    printf("]}\n");
    return 0;
}

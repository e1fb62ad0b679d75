/* tests/bench/plan_image.c - instructions per plan, on the processor itself.
 *
 * What the count itself costs is measured with an empty function and left out.
 * Prints lines of a name and a number, which plan.py judges. */
#include <stddef.h>

#include "motion/otg/sync.h"
#include "tests/bench/counter.h"
#include "tests/bench/otg_random.h"
#include "tests/qemu/start.h"

#ifndef PROBLEMS
#define PROBLEMS (20 * OTG_RANDOM_CYCLE)
#endif
#define AXES    7
#define SAMPLES 100 /* of one plan in ten */

static struct motion_otg_move move[AXES];
static struct motion_otg_plan plan[AXES];
static struct motion_segment storage[MOTION_OTG_PHASES];
static struct motion_track track;
static struct motion_cursor cursor;
static struct motion_sample sample;
static int64_t sample_ns_q12;
static int axes, status;

/* --- what is counted ------------------------------------------------------ */

__attribute__((noinline)) static void bench_one(void)
{
    status = motion_otg_make(&move[0], &plan[0], NULL);
}

__attribute__((noinline)) static void bench_check(void)
{
    status = motion_otg_check(&move[0], &plan[0], NULL);
}

__attribute__((noinline)) static void bench_sync(void)
{
    status = motion_sync_make(move, axes, MOTION_SYNC_TIME, plan, NULL);
}

__attribute__((noinline)) static void bench_append(void)
{
    status = motion_otg_append(&plan[0], &track);
}

__attribute__((noinline)) static void bench_sample(void)
{
    motion_track_sample(&track, &cursor, sample_ns_q12, &sample);
}

/* --- report --------------------------------------------------------------- */

struct tally {
    uint64_t sum;
    uint32_t count, worst, worst_row;
};

static void tally_add(struct tally *tally, uint32_t row, uint32_t count)
{
    tally->sum += count;
    tally->count++;
    if (count <= tally->worst)
        return;
    tally->worst = count;
    tally->worst_row = row;
}

static void report(const char *what, const char *which, uint32_t value)
{
    start_print(what);
    start_print(which);
    start_print(" ");
    start_print_u32(value);
    start_print("\n");
}

static void tally_report(const struct tally *tally, const char *what)
{
    uint32_t count = tally->count ? tally->count : 1;
    report(what, "_mean", (uint32_t)(tally->sum / count));
    report(what, "_worst", tally->worst);
    report(what, "_worst_row", tally->worst_row);
}

/* Kinds as they come, and per kind. */
static uint32_t bench_one_axis(uint32_t empty)
{
    struct tally all = { 0 }, kinds[OTG_RANDOM_KINDS] = { 0 }, check = { 0 };
    uint64_t seed = 1;
    uint32_t failed = 0;
    for (uint32_t row = 0; row < PROBLEMS; row++) {
        enum otg_random_kind kind = otg_random_kind(row);
        otg_random_move(&seed, kind, &move[0]);
        uint32_t count = bench_count(bench_one) - empty;
        failed += status < 0;
        tally_add(&all, row, count);
        tally_add(&kinds[kind], row, count);
        tally_add(&check, row, bench_count(bench_check) - empty);
    }
    tally_report(&all, "one");
    for (int i = 0; i < OTG_RANDOM_KINDS; i++)
        tally_report(&kinds[i], otg_random_name((enum otg_random_kind)i));
    tally_report(&check, "check");
    return failed;
}

/* The same moves with the goal's velocity and acceleration alone. */
static uint32_t bench_velocity(uint32_t empty)
{
    struct tally all = { 0 };
    uint64_t seed = 2;
    uint32_t failed = 0;
    for (uint32_t row = 0; row < PROBLEMS / 4; row++) {
        otg_random_move(&seed, otg_random_kind(row), &move[0]);
        move[0].mode = MOTION_OTG_VELOCITY;
        tally_add(&all, row, bench_count(bench_one) - empty);
        failed += status < 0;
    }
    tally_report(&all, "velocity");
    return failed;
}

static uint32_t bench_axes(uint32_t empty, int count, uint32_t problems,
                           const char *name)
{
    struct tally all = { 0 };
    uint64_t seed = (uint64_t)count;
    uint32_t failed = 0;
    axes = count;
    for (uint32_t row = 0; row < problems; row++) {
        otg_random_moves(&seed, row, axes, move);
        uint32_t instructions = bench_count(bench_sync) - empty;
        failed += status < 0;
        tally_add(&all, row, instructions);
    }
    tally_report(&all, name);
    return failed;
}

/* The track of a plan, by phases, and every hundredth of it. */
static uint32_t bench_samples(uint32_t empty)
{
    struct tally samples = { 0 }, appends = { 0 };
    uint64_t seed = 1;
    uint32_t failed = 0;
    for (uint32_t row = 0; row < PROBLEMS / 10; row++) {
        otg_random_move(&seed, otg_random_kind(row), &move[0]);
        bench_one();
        motion_track_init(&track, storage, MOTION_OTG_PHASES,
                          move[0].start.pos_q32);
        cursor.index = 0;
        uint32_t count = bench_count(bench_append) - empty;
        tally_add(&appends, row, count / (uint32_t)plan[0].count);
        failed += status < 0;
        for (int k = 0; k < SAMPLES && status == 0; k++) {
            sample_ns_q12 = plan[0].dur_ns_q12 / SAMPLES * k;
            tally_add(&samples, row, bench_count(bench_sample) - empty);
        }
    }
    tally_report(&samples, "sample");
    tally_report(&appends, "append_phase");
    return failed;
}

int main(void)
{
    bench_start();
    uint32_t empty = bench_count(bench_empty);
    uint32_t failed = bench_one_axis(empty);
    failed += bench_velocity(empty);
    failed += bench_axes(empty, 3, PROBLEMS / 10, "three");
    failed += bench_axes(empty, 7, PROBLEMS / 50, "seven");
    failed += bench_samples(empty);
    report("plan", "_bytes", sizeof plan[0]);
    report("move", "_bytes", sizeof move[0]);
    report("without", "_answer", failed);
    return failed > 0;
}

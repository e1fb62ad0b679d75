/* tests/bench/plan_image.c - instructions per plan, on the processor itself.
 *
 * What the count itself costs is measured with an empty function and left out.
 * Prints lines of a name and a number, which plan.py judges. */
#include <stddef.h>

#include "motion/sync.h"
#include "tests/bench/counter.h"
#include "tests/bench/otg_random.h"
#include "tests/qemu/start.h"

#ifndef PROBLEMS
#define PROBLEMS 2200
#endif
#define AXES 3

static struct motion_otg_move move[AXES];
static struct motion_otg_plan plan[AXES];
static int status;

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
    status = motion_sync_make(move, AXES, MOTION_SYNC_TIME, plan, NULL);
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

static uint32_t bench_three_axes(uint32_t empty)
{
    struct tally all = { 0 };
    uint64_t seed = 3;
    uint32_t failed = 0;
    for (uint32_t row = 0; row < PROBLEMS / 10; row++) {
        otg_random_moves(&seed, row, AXES, move);
        uint32_t count = bench_count(bench_sync) - empty;
        failed += status < 0;
        tally_add(&all, row, count);
    }
    tally_report(&all, "three");
    return failed;
}

int main(void)
{
    bench_start();
    uint32_t empty = bench_count(bench_empty);
    uint32_t failed = bench_one_axis(empty);
    failed += bench_three_axes(empty);
    report("plan", "_bytes", sizeof plan[0]);
    report("move", "_bytes", sizeof move[0]);
    report("without", "_answer", failed);
    return failed > 0;
}

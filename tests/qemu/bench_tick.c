/* tests/qemu/bench_tick.c - instructions per call of motion_track_sample.
 *
 * QEMU with -icount advances its clock by a fixed time per instruction, so the
 * SysTick counts instructions, to the last one: there is no cache, no pipeline
 * and nothing to average.  The unit is measured with a row of nops; what a call
 * costs around the function is measured with an empty function of the same
 * shape and left out; entering and leaving the function is in.  Status 1 when a
 * call within a segment takes more than LIMIT, or what a stretch of one is told in more
 * than LIMIT_ENCLOSE. */
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/core/track.h"
#include "motion/core/track_enclose.h"
#include "tests/qemu/start.h"

#ifndef LIMIT
#define LIMIT         UINT32_MAX
#define LIMIT_ENCLOSE UINT32_MAX
#endif

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define SYST_CSR          REGISTER(0xE000E010)
#define SYST_RVR          REGISTER(0xE000E014)
#define SYST_CVR          REGISTER(0xE000E018)
#define CAPACITY          5
#define SYST_TOP          0xFFFFFFu

/* Written out: the compiler counts lines to know how far a branch goes. */
#define NOPS   64
#define NOP_8  "nop\n nop\n nop\n nop\n nop\n nop\n nop\n nop\n "
#define NOP_64 NOP_8 NOP_8 NOP_8 NOP_8 NOP_8 NOP_8 NOP_8 NOP_8

typedef void bench_function(const struct motion_track *track,
                            struct motion_cursor *cursor, int64_t t_ns_q12,
                            struct motion_sample *sample);

static struct motion_segment storage[CAPACITY];
static struct motion_sample sample;

__attribute__((noinline)) static void
bench_empty(const struct motion_track *track, struct motion_cursor *cursor,
            int64_t t_ns_q12, struct motion_sample *to)
{
    __asm__ volatile("" : : "r"(track), "r"(cursor), "r"(to) : "memory");
    (void)t_ns_q12;
}

static uint32_t bench_now(void)
{
    return SYST_TOP - SYST_CVR;
}

static uint32_t bench_ticks(bench_function *volatile function,
                            const struct motion_track *track, uint32_t index,
                            int64_t t_ns_q12)
{
    bench_function *const call = function;
    struct motion_cursor cursor = { index };
    uint32_t start = bench_now();

    call(track, &cursor, t_ns_q12, &sample);
    return bench_now() - start;
}

/* Inline wherever it is called: a call would count as nops. */
__attribute__((always_inline)) static inline uint32_t bench_nop_ticks(void)
{
    uint32_t start = bench_now();

    __asm__ volatile(NOP_64);
    return bench_now() - start;
}

/* Instructions, entry to return included: the empty function's own return is
 * added again. */
static uint32_t bench_count(const struct motion_track *track, uint32_t index,
                            int64_t t_ns_q12)
{
    uint32_t unit = bench_nop_ticks();
    uint32_t with = bench_ticks(motion_track_sample, track, index, t_ns_q12);
    uint32_t without = bench_ticks(bench_empty, track, index, t_ns_q12);

    return ((with - without) * NOPS + unit / 2) / unit + 1;
}

/* Worst of some times within segment `index`, the cursor being at `from`. */
static uint32_t bench_worst(const struct motion_track *track, uint32_t index,
                            uint32_t from)
{
    const struct motion_segment *segment = &track->segment[index];
    uint32_t worst = 0;

    for (int i = 0; i < 16; i++) {
        int64_t dt = segment->dur_ns_q12 / 16 * i;
        uint32_t count = bench_count(track, from, segment->start_ns_q12 + dt);
        worst = count > worst ? count : worst;
    }
    return worst;
}

static uint32_t bench_report(const char *what, uint32_t count)
{
    start_print(what);
    start_print(" ");
    start_print_u32(count);
    start_print("\n");
    return count;
}

/* One of each kind; the third is shorter than 1 ms, which takes time another
 * way.  The last is under 100 ns: no tick meets it twice. */
static int bench_plan(struct motion_track *track)
{
    const struct motion_state rest = { 0 };
    struct motion_state to = { .pos_q32 = 123 * MOTION_FIXED_ONE_Q32 };
    int err;

    motion_track_init(track, storage, CAPACITY, -5 * MOTION_FIXED_ONE_Q32);
    err = motion_track_append_cubic(track, 3 * MOTION_FIXED_S_Q12, 0, &to);
    to.pos_q32 = -200 * MOTION_FIXED_ONE_Q32;
    if (err == MOTION_OK)
        err = motion_track_append_quintic(track, 5 * MOTION_FIXED_S_Q12, &rest,
                                          &to);
    to.pos_q32 += MOTION_FIXED_ONE_Q32 / 1000;
    if (err == MOTION_OK)
        err = motion_track_append_quintic(track, MOTION_FIXED_S_Q12 / 2000,
                                          &rest, &to);
    to.pos_q32 = 100000000 * MOTION_FIXED_ONE_Q32;
    if (err == MOTION_OK)
        err = motion_track_append_quintic(track, 60 * MOTION_FIXED_S_Q12, &rest,
                                          &to);
    to.pos_q32 += 1;
    if (err == MOTION_OK)
        err = motion_track_append_quintic(track, 65536, &rest, &to);
    return err;
}

/* Of one stretch, the most of what a search for a change of rate takes
 * (firmware/control/ramp_span.c). */
__attribute__((noinline)) static uint32_t
bench_enclose(const struct motion_track *track, int64_t from_ns_q12)
{
    const int64_t one_q32[3] = { MOTION_TRACK_VEL_MAX_Q32,
                                 MOTION_TRACK_ACC_MAX_Q32,
                                 MOTION_TRACK_ACC_MAX_Q32 };
    struct motion_range range[3] = { { 0, 0 }, { 0, 0 }, { 0, 0 } };
    struct motion_cursor cursor = { 0 };
    struct motion_track_unit unit;
    int64_t from = from_ns_q12;
    motion_track_unit_init(&unit, one_q32);
    (void)motion_track_enclose(track, &cursor, &unit, &from, from + 4096,
                               range);
    from = from_ns_q12;
    const uint32_t nop = bench_nop_ticks();
    const uint32_t start = bench_now();
    (void)motion_track_enclose(track, &cursor, &unit, &from, from + 4096000000,
                               range);
    const uint32_t ticks = (bench_now() - start) & SYST_TOP;
    return (uint32_t)((uint64_t)ticks * NOPS / nop);
}

static bool bench_is_over(uint32_t count, uint32_t limit)
{
    if (count <= limit)
        return false;
    start_print("more than ");
    start_print_u32(limit);
    start_print(" instructions\n");
    return true;
}

int main(void)
{
    static const char *const name[4] = {
        "  cubic             ",
        "  quintic           ",
        "  quintic, 0.5 ms   ",
        "  quintic, 1e8 units",
    };
    struct motion_track track;
    uint32_t worst = 0;

    SYST_RVR = SYST_TOP;
    SYST_CVR = 0;
    SYST_CSR = 5; /* on, core clock, no interrupt */
    if (bench_plan(&track) < 0)
        return 2;

    for (uint32_t i = 0; i < 4; i++) {
        uint32_t count = bench_report(name[i], bench_worst(&track, i, i));
        worst = count > worst ? count : worst;
    }
    bench_report("  quintic, 16 ns    ", bench_worst(&track, 4, 4));
    bench_report("  into the next     ", bench_worst(&track, 1, 0));
    bench_report("  search            ", bench_worst(&track, 3, 0));
    const uint32_t cubic = bench_report(
        "  stretch, cubic    ", bench_enclose(&track, MOTION_FIXED_S_Q12));
    const uint32_t quintic = bench_report(
        "  stretch, quintic  ", bench_enclose(&track, 4 * MOTION_FIXED_S_Q12));
    if (bench_is_over(worst, LIMIT) || bench_is_over(cubic, LIMIT_ENCLOSE) ||
        bench_is_over(quintic, LIMIT_ENCLOSE))
        return 1;
    return 0;
}

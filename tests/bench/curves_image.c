/* tests/bench/curves_image.c - what curves cost, on the processor itself: to
 * plan, by the number of keys, and to play, by the number of segments.
 *
 * Prints lines that curves.py reads: "plan KIND KEYS INSTRUCTIONS" and
 * "play HOW SEGMENTS MEAN WORST". */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/ease.h"
#include "motion/curve/spline.h"
#include "tests/bench/counter.h"
#include "tests/qemu/start.h"

/* Of c2, and of the track that is played. */
#ifndef KEYS_MOST
#define KEYS_MOST 1000
#endif
#define KEYS_MANY 1000 /* of the other kinds */
#ifndef KEYS_SINE      /* what the counter holds */
#define KEYS_SINE 100
#endif
#define CAPACITY_MANY (MOTION_EASE_SEGMENTS * KEYS_MANY)
#define CAPACITY      (CAPACITY_MANY > KEYS_MOST ? CAPACITY_MANY : KEYS_MOST)
#define TICKS         2000
#define LAGRANGE      10

#define SECOND MOTION_FIXED_S_Q12
#define UNIT   MOTION_FIXED_ONE_Q32

static struct motion_key key[KEYS_MOST];
static struct motion_spline_work work[KEYS_MOST];
static struct motion_segment storage[CAPACITY];
static struct motion_track track;
static uint32_t count;
static int status;

/* --- keys ----------------------------------------------------------------- */

static uint64_t seed;

static uint64_t draw(void)
{
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return seed;
}

/* A walk, 30 to 90 ms between keys. */
static void draw_keys(uint32_t keys)
{
    int64_t t = 0, pos = 0;

    seed = 88172645463325252;
    count = keys;
    for (uint32_t i = 0; i < keys; i++) {
        key[i] = (struct motion_key){ .t_ns_q12 = t, .pos_q32 = pos };
        t += 30 * SECOND / 1000 + (int64_t)(draw() >> 26);
        pos += (int64_t)(draw() >> 31) - UNIT;
    }
    motion_track_init(&track, storage, CAPACITY, 0);
}

/* --- kinds ---------------------------------------------------------------- */

#define NATURAL   MOTION_SPLINE_NATURAL
#define ONE_SIDED MOTION_SPLINE_ONE_SIDED

static int cubic(int err)
{
    return err < 0 ? err : motion_spline_append_cubic(&track, key, count, NULL);
}

static int quintic(int err)
{
    return err < 0 ? err
                   : motion_spline_append_quintic(&track, key, count, NULL);
}

static void plan_c2(void)
{
    status = cubic(motion_spline_c2(key, count, NATURAL, NATURAL, work));
}

static void plan_c4(void)
{
    status = quintic(motion_spline_c4(key, count, MOTION_SPLINE_REST,
                                      MOTION_SPLINE_REST, work));
}

static void plan_linear(void)
{
    status = motion_spline_append_linear(&track, key, count, NULL);
}

static void plan_blended(bool smooth)
{
    status = motion_spline_append_blended(&track, key, count, SECOND / 50,
                                          smooth, ONE_SIDED, ONE_SIDED, NULL);
}

static void plan_rounded(void)
{
    plan_blended(false);
}

static void plan_smoothed(void)
{
    plan_blended(true);
}

static void plan_eases(enum motion_ease_law law)
{
    status = MOTION_OK;
    for (uint32_t i = 1; i < count && status >= 0; i++)
        status = motion_ease_append(&track, law, key[i].pos_q32,
                                    key[i].t_ns_q12 - key[i - 1].t_ns_q12,
                                    UNIT / 4, UNIT / 4 * 3);
}

static void plan_parabolic(void)
{
    plan_eases(MOTION_EASE_PARABOLIC);
}

static void plan_sine(void)
{
    plan_eases(MOTION_EASE_SINE);
}

static void plan_scurve(void)
{
    plan_eases(MOTION_EASE_SCURVE);
}

/* Every key's velocity is given: zero. */
static void plan_hermite(void)
{
    status = cubic(MOTION_OK);
}

static void plan_catmull_rom(void)
{
    status = cubic(
        motion_spline_tangents_parabola(key, count, ONE_SIDED, ONE_SIDED));
}

static void plan_cardinal(void)
{
    status = cubic(motion_spline_tangents_cardinal(key, count, UNIT, ONE_SIDED,
                                                   ONE_SIDED));
}

static void plan_kochanek(void)
{
    const struct motion_spline_kochanek shape = { UNIT / 4, UNIT / 8,
                                                  -UNIT / 4 };
    status = motion_spline_append_kochanek(&track, key, count, &shape,
                                           ONE_SIDED, ONE_SIDED, NULL);
}

static void plan_monotone(void)
{
    status = cubic(motion_spline_monotone(key, count, ONE_SIDED, ONE_SIDED));
}

static void plan_akima(void)
{
    status = cubic(motion_spline_akima(key, count, ONE_SIDED, ONE_SIDED));
}

static void plan_akima_monotone(void)
{
    status = motion_spline_akima(key, count, ONE_SIDED, ONE_SIDED);
    if (status >= 0)
        status = cubic(motion_spline_limit_overshoot(key, count));
}

static void plan_quintic(void)
{
    int err = motion_spline_tangents_parabola(key, count, ONE_SIDED, ONE_SIDED);
    if (err >= 0)
        err = motion_spline_accelerations(key, count, ONE_SIDED, ONE_SIDED);
    status = quintic(err);
}

static void plan_constraints(void)
{
    status = motion_spline_append_constraints(&track, key, count, NULL);
}

static void plan_bspline(void)
{
    status = motion_spline_append_bspline(&track, key, count, NATURAL, NATURAL,
                                          NULL);
}

static void plan_lagrange(void)
{
    status = motion_spline_append_lagrange(&track, key, count, NULL, NULL);
}

/* In the order of PLAN_CURVE_LIST; natural c2 is the one that must be linear
 * up to the most keys. */
static const struct {
    const char *name;
    bench_function *plan;
    uint32_t most;
} kinds[] = {
    { "linear", plan_linear, KEYS_MANY },
    { "rounded", plan_rounded, KEYS_MANY },
    { "smoothed", plan_smoothed, KEYS_MANY },
    { "parabolic", plan_parabolic, KEYS_MANY },
    { "sine", plan_sine, KEYS_SINE },
    { "s-curve", plan_scurve, KEYS_MANY },
    { "hermite", plan_hermite, KEYS_MANY },
    { "catmull-rom", plan_catmull_rom, KEYS_MANY },
    { "cardinal", plan_cardinal, KEYS_MANY },
    { "kochanek-bartels", plan_kochanek, KEYS_MANY },
    { "monotone", plan_monotone, KEYS_MANY },
    { "akima", plan_akima, KEYS_MANY },
    { "akima-monotone", plan_akima_monotone, KEYS_MANY },
    { "c2", plan_c2, KEYS_MOST },
    { "quintic", plan_quintic, KEYS_MANY },
    { "c4", plan_c4, KEYS_MANY },
    { "constraints", plan_constraints, KEYS_MANY },
    { "b-spline", plan_bspline, KEYS_MANY },
    { "lagrange", plan_lagrange, LAGRANGE },
};
#define KINDS (sizeof kinds / sizeof kinds[0])

static void report(const char *what, const char *which, uint32_t size,
                   uint32_t a)
{
    start_print(what);
    start_print(which);
    start_print(" ");
    start_print_u32(size);
    start_print(" ");
    start_print_u32(a);
}

static void plan_all(void)
{
    const uint32_t none = bench_count(bench_empty);

    for (size_t i = 0; i < KINDS; i++)
        for (uint32_t n = 10; n <= kinds[i].most; n *= n < 1000 ? 10 : 100) {
            draw_keys(n);
            report("plan ", kinds[i].name, n,
                   bench_count(kinds[i].plan) - none);
            start_print("\n");
            if (status < 0)
                start_exit(1);
        }
}

/* --- playing -------------------------------------------------------------- */

static struct motion_cursor cursor;
static struct motion_sample sample;
static int64_t at_ns_q12;

__attribute__((noinline)) static void play_tick(void)
{
    motion_track_sample(&track, &cursor, at_ns_q12, &sample);
}

enum play_displacement { PLAY_FORWARD, PLAY_BACKWARD, PLAY_SEEK };

/* 1 ms at a time, from or to the middle; or anywhere. */
static int64_t play_time(enum play_displacement displacement, int64_t tick)
{
    const int64_t middle = key[count / 2].t_ns_q12;

    switch (displacement) {
    case PLAY_FORWARD:
        return (middle + tick * (SECOND / 1000)) % track.end_ns_q12;
    case PLAY_BACKWARD:
        return (middle + (TICKS - tick) * (SECOND / 1000)) % track.end_ns_q12;
    case PLAY_SEEK:
        break;
    }
    return (int64_t)motion_fixed_mulhi_u64(draw(), (uint64_t)track.end_ns_q12);
}

static void play(const char *name, enum play_displacement displacement,
                 uint32_t none)
{
    uint64_t sum = 0, mean = 0;
    uint32_t worst = 0;

    at_ns_q12 = play_time(displacement, 0);
    play_tick();
    for (int64_t tick = 1; tick <= TICKS; tick++) {
        at_ns_q12 = play_time(displacement, tick);
        const uint32_t used = bench_count(play_tick) - none;
        sum += used;
        worst = used > worst ? used : worst;
    }
    motion_fixed_div_u128((struct motion_u128){ 0, sum }, TICKS, &mean, NULL);
    report("play ", name, track.count, (uint32_t)mean);
    start_print(" ");
    start_print_u32(worst);
    start_print("\n");
}

static void play_all(void)
{
    const uint32_t none = bench_count(bench_empty);

    for (uint32_t n = 10; n <= KEYS_MOST; n *= 100) {
        draw_keys(n + 1 < KEYS_MOST ? n + 1 : KEYS_MOST);
        plan_linear();
        play("forward", PLAY_FORWARD, none);
        play("backward", PLAY_BACKWARD, none);
        play("seek", PLAY_SEEK, none);
    }
}

int main(void)
{
    bench_start();
    plan_all();
    play_all();
    return 0;
}

/* tests/qemu/golden_fcurve.c - Blender's curves: the same bits on every
 * machine.  See golden.c. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/curve/fcurve.h"
#include "tests/qemu/golden_tools.h"

#define UNIT     MOTION_FIXED_ONE_Q32
#define SECOND   MOTION_FIXED_S_Q12
#define KEYS     6
#define CAPACITY 40
#define LOOKS    10 /* per span */

static struct motion_fcurve_key key[KEYS];
static struct motion_fcurve_work work[KEYS];
static struct motion_segment storage[CAPACITY];

static const enum motion_fcurve_handle handle_kind[] = {
    MOTION_FCURVE_FREE, MOTION_FCURVE_ALIGNED, MOTION_FCURVE_VECTOR,
    MOTION_FCURVE_AUTO, MOTION_FCURVE_CLAMPED,
};
#define HANDLE_KINDS (int64_t)(sizeof handle_kind / sizeof handle_kind[0])

/* `count` keys a second or so apart, all spans alike. */
static struct motion_fcurve golden_curve(uint32_t count, int interpolation,
                                         int easing)
{
    int64_t t = 0;

    for (uint32_t i = 0; i < count; i++) {
        const int64_t pos = golden_signed(37);
        const int64_t reach = SECOND / 8 + golden_below(SECOND / 2);
        const int64_t rise = golden_signed(35);
        const unsigned kind = handle_kind[golden_below(HANDLE_KINDS)];
        key[i] = (struct motion_fcurve_key){
            .at = { t, pos },
            .left = { t - reach, pos - rise },
            .right = { t + reach, pos + rise },
            .left_kind = (uint8_t)kind,
            .right_kind = (uint8_t)kind,
            .interpolation = (uint8_t)interpolation,
            .easing = (uint8_t)easing,
            .back_q32 = UNIT + UNIT / 2,
        };
        t += SECOND / 2 + golden_below(SECOND);
    }
    return (struct motion_fcurve){ .key = key, .count = count };
}

static void golden_handles_of(struct motion_fcurve *curve)
{
    golden_add(motion_fcurve_handles(curve, work, NULL));
    for (uint32_t i = 0; i < curve->count; i++) {
        golden_add(key[i].left.t_ns_q12);
        golden_add(key[i].left.pos_q32);
        golden_add(key[i].right.t_ns_q12);
        golden_add(key[i].right.pos_q32);
    }
}

static void golden_look(const struct motion_fcurve *curve, int64_t t_ns_q12,
                        enum motion_fcurve_side side)
{
    struct motion_fcurve_value value;

    golden_add(motion_fcurve_at(curve, t_ns_q12, side, &value));
    golden_add_real(value.pos);
    golden_add_real(value.vel);
    golden_add_real(value.acc);
}

/* Also before the first and after the last key. */
static void golden_values(const struct motion_fcurve *curve, int looks)
{
    const int64_t end = key[curve->count - 1].at.t_ns_q12;

    for (int i = 0; i < looks; i++)
        golden_look(curve, golden_below(2 * end) - end / 2, MOTION_FCURVE_AT);
    for (uint32_t i = 0; i < curve->count; i++)
        for (int side = MOTION_FCURVE_LEFT; side <= MOTION_FCURVE_RIGHT; side++)
            golden_look(curve, key[i].at.t_ns_q12,
                        (enum motion_fcurve_side)side);
}

static uint32_t golden_append(const struct motion_fcurve *curve)
{
    const struct motion_fcurve_range range = {
        .from_ns_q12 = 0,
        .to_ns_q12 = key[curve->count - 1].at.t_ns_q12,
        .within = { motion_real_make(1, -6), motion_real_zero(),
                    motion_real_zero() },
        .step = motion_real_int(1),
    };
    struct motion_fcurve_report report = { .segments = 0 };
    struct motion_track track;

    motion_track_init(&track, storage, CAPACITY, key[0].at.pos_q32);
    const int err = motion_fcurve_append(&track, curve, &range, &report);
    golden_add(err);
    if (err < 0)
        return 0;
    golden_add_bound(&report.bound);
    golden_add_segments(&track);
    golden_add_random_samples(&track, 200);
    return track.count;
}

static uint32_t golden_handles(void)
{
    for (int round = 0; round < 20; round++) {
        struct motion_fcurve curve =
            golden_curve(KEYS, MOTION_FCURVE_BEZIER, MOTION_FCURVE_BY_KIND);
        curve.smoothing = (uint8_t)(round & 1);
        golden_handles_of(&curve);
    }
    return 0;
}

static uint32_t golden_easings(void)
{
    uint32_t segments = 0;

    for (int displacement = 0; displacement <= MOTION_FCURVE_ELASTIC;
         displacement++)
        for (int ease = 0; ease <= MOTION_FCURVE_IN_OUT; ease++) {
            struct motion_fcurve curve = golden_curve(2, displacement, ease);
            golden_handles_of(&curve);
            golden_values(&curve, LOOKS);
            segments += golden_append(&curve);
        }
    return segments;
}

static uint32_t golden_beziers(void)
{
    uint32_t segments = 0;

    for (int round = 0; round < 4; round++) {
        struct motion_fcurve curve =
            golden_curve(4, MOTION_FCURVE_BEZIER, MOTION_FCURVE_BY_KIND);
        curve.extrapolation = (uint8_t)(round & 1);
        curve.before = (struct motion_fcurve_cycles){ (uint8_t)round, 2 };
        curve.after = (struct motion_fcurve_cycles){ (uint8_t)(3 - round), 0 };
        golden_handles_of(&curve);
        golden_values(&curve, 3 * LOOKS);
        segments += golden_append(&curve);
    }
    return segments;
}

static const struct {
    const char *name;
    uint32_t (*run)(void); /* gives a count of segments */
} producers[] = {
    { "fcurve handles", golden_handles },
    { "fcurve easings", golden_easings },
    { "fcurve beziers", golden_beziers },
};

int main(void)
{
    for (size_t i = 0; i < sizeof producers / sizeof producers[0]; i++) {
        golden_start(i + 1);
        const uint32_t segments = producers[i].run();
        golden_report(producers[i].name, segments);
    }
    return 0;
}

/* tests/motion/vectors_ease.c - ease.json; see vectors.h.
 *
 * Normalised distance 1 is 2^28 units, normalised time 1 is 2^9 s, or more
 * where a ramp takes a small share of it, so that the times inside the ramp are
 * as exact as the file has them and its acceleration stays in its format.
 * Position, velocity and acceleration are fractions of the largest of the case,
 * 1 at least. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/ease.h"
#include "motion/path/speed_law.h"
#include "tests/motion/vectors_json.h"

#define TOLERANCE   1e-8
#define LENGTH_BITS 28
#define TIME_BITS   9
#define TIME_MOST   18
#define CAPACITY    64

static struct motion_segment storage[CAPACITY];

/* log2 of the seconds that a case takes: half of what its shorter ramp
 * lacks. */
static int time_bits(const cJSON *json)
{
    const cJSON *k1 = vectors_get(json, "k1"), *k2 = vectors_get(json, "k2");
    double ramp = 1;
    int bits = TIME_BITS;

    if (cJSON_IsNumber(k1) && k1->valuedouble > 0)
        ramp = fmin(ramp, k1->valuedouble);
    if (cJSON_IsNumber(k2) && k2->valuedouble < 1)
        ramp = fmin(ramp, 1 - k2->valuedouble);
    for (; ramp < 0.25 && bits < TIME_MOST; bits++)
        ramp *= 4;
    return bits;
}

static int64_t ticks(const cJSON *json, double share)
{
    return (int64_t)llroundl(
        ldexpl((long double)share * MOTION_FIXED_S_Q12, time_bits(json)));
}

static const struct {
    const char *kind;
    bool is_phased;
    enum motion_ease_law law;
    enum motion_speed_kind whole;
} kinds[] = {
    { "sine_constant_sine", true, MOTION_EASE_SINE, 0 },
    { "parabolic", true, MOTION_EASE_PARABOLIC, 0 },
    { "cubic", false, 0, MOTION_SPEED_CUBIC },
    { "quintic", false, 0, MOTION_SPEED_QUINTIC },
    { "sine", false, 0, MOTION_SPEED_SINE },
};

static int plan(const cJSON *json, size_t kind, struct motion_track *track)
{
    const int64_t length = (int64_t)1 << (LENGTH_BITS + 32);
    const int64_t half = (int64_t)1 << 31, whole = ticks(json, 1);

    motion_track_init(track, storage, CAPACITY, 0);
    if (!kinds[kind].is_phased) {
        const struct motion_speed_part part = {
            .kind = kinds[kind].whole,
            .dur_ns_q12 = whole,
            .length_q32 = length,
            .k1_q32 = half,
            .k2_q32 = half,
        };
        return motion_speed_append(track, &part, 1, NULL);
    }
    if (!cJSON_IsNumber(vectors_get(json, "k1")) ||
        !cJSON_IsNumber(vectors_get(json, "k2")))
        return MOTION_E_ARG;
    const int64_t k1 = ticks(json, vectors_get(json, "k1")->valuedouble);
    const int64_t k2 = ticks(json, vectors_get(json, "k2")->valuedouble);
    return motion_ease_append_phases(track, kinds[kind].law, length, k1,
                                     k2 - k1, whole - k2);
}

/* At the end what the last span comes to; a constant span of no duration, k1 =
 * k2 = 1, is one too, and does not accelerate. */
static struct motion_state state_at(const cJSON *json,
                                    const struct motion_track *track, int64_t t)
{
    const struct motion_segment *last = &track->segment[track->count - 1];
    const cJSON *k1 = vectors_get(json, "k1");
    struct motion_state state;

    if (t < track->end_ns_q12) {
        motion_track_state(track, t, &state);
        return state;
    }
    motion_segment_state(last, last->dur_ns_q12, &state);
    if (k1 && k1->valuedouble >= 1)
        state.acc_q32 = 0;
    return state;
}

static bool compare(const cJSON *json, const struct motion_track *track,
                    struct vectors_row *out)
{
    static const char *const names[3] = { "s", "v", "a" };
    const cJSON *t = vectors_get(json, "t"), *want[3];
    double worst[3] = { 0 }, largest[3] = { 1, 1, 1 };
    const int n = cJSON_GetArraySize(t), bits = time_bits(json);

    for (int k = 0; k < 3; k++) {
        want[k] = vectors_get(json, names[k]);
        if (n == 0 || cJSON_GetArraySize(want[k]) != n)
            return false;
    }
    for (int i = 0; i < n; i++) {
        const struct motion_state s =
            state_at(json, track, ticks(json, vectors_number_at(t, i)));
        const double got[3] = {
            ldexp((double)s.pos_q32, -32 - LENGTH_BITS),
            ldexp((double)s.vel_q32, bits - 32 - LENGTH_BITS),
            ldexp((double)s.acc_q32, 2 * bits - 32 - LENGTH_BITS),
        };
        for (int k = 0; k < 3; k++) {
            const double value = vectors_number_at(want[k], i);
            vectors_worst(&worst[k], fabs(got[k] - value));
            vectors_worst(&largest[k], fabs(value));
        }
    }
    vectors_worst(&out->worst_p, worst[0] / largest[0]);
    vectors_worst(&out->worst_v, worst[1] / largest[1]);
    vectors_worst(&out->worst_a, worst[2] / largest[2]);
    return true;
}

static bool run_case(const cJSON *json, struct vectors_row *rows, int capacity,
                     int *count)
{
    const char *name = cJSON_GetStringValue(vectors_get(json, "kind"));
    struct motion_track track;
    size_t kind = 0;

    while (name && kind < sizeof kinds / sizeof kinds[0] &&
           strcmp(kinds[kind].kind, name) != 0)
        kind++;
    if (name == NULL || kind == sizeof kinds / sizeof kinds[0] ||
        plan(json, kind, &track) < 0)
        return false;

    struct vectors_row *out =
        vectors_row_of(rows, capacity, count, name, TOLERANCE);
    if (out == NULL)
        return false;
    out->cases++;
    return compare(json, &track, out);
}

int vectors_ease(const cJSON *file, struct vectors_row *rows, int capacity)
{
    const cJSON *json;
    int count = 0;

    cJSON_ArrayForEach(json, vectors_get(file, "cases"))
    {
        if (!run_case(json, rows, capacity, &count)) {
            const char *name = cJSON_GetStringValue(vectors_get(json, "name"));
            fprintf(stderr, "ease: %s: not a law that is known\n",
                    name ? name : "?");
            return -1;
        }
    }
    vectors_judge(rows, count);
    return count;
}

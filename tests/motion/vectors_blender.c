/* tests/motion/vectors_blender.c - blender_fcurves.json; see vectors.h.
 *
 * A curve says nothing about its units, so values are taken in one that makes
 * the largest about 2^12, and a frame is as many 2^-12 ns as fit: powers of
 * two, which change no digit.  Handles that Blender computes are not read.  One
 * row per way to interpolate, extrapolate or repeat. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/fcurve.h"
#include "tests/motion/vectors_json.h"

#define UNIT_BITS 12
#define TIME_BITS 58

struct blender_curve {
    const cJSON *json;
    const char *name;
    int unit, frame; /* log2 of Q32.32 per value, 2^-12 ns per frame */
    struct motion_fcurve curve;
    struct motion_fcurve_work *work;
    double worst, worst_t;
};

/* --- reading -------------------------------------------------------------- */

/* Nearest, 0 where a file has nonsense: the comparison will tell. */
static int64_t whole(double value, int bits)
{
    const double scaled = ldexp(value, bits);
    return fabs(scaled) < 0x1p62 ? (int64_t)llround(scaled) : 0;
}

static const char *const handle_names[] = { "FREE", "ALIGNED",      "VECTOR",
                                            "AUTO", "AUTO_CLAMPED", NULL };
static const char *const interpolation_names[] = {
    "CONSTANT", "LINEAR", "BEZIER", "SINE", "QUAD",   "CUBIC",   "QUART",
    "QUINT",    "EXPO",   "CIRC",   "BACK", "BOUNCE", "ELASTIC", NULL
};
static const char *const easing_names[] = { "AUTO", "EASE_IN", "EASE_OUT",
                                            "EASE_IN_OUT", NULL };
static const char *const smoothing_names[] = { "NONE", "CONT_ACCEL", NULL };
static const char *const extrapolation_names[] = { "CONSTANT", "LINEAR", NULL };
static const char *const cycle_names[] = { "NONE", "REPEAT", "REPEAT_OFFSET",
                                           "MIRROR", NULL };

/* Its place in the list, which is that of motion/curve/fcurve.h; *known becomes
 * false where it has none. */
static uint8_t word(const cJSON *json, const char *name,
                    const char *const list[], bool *known)
{
    const char *text = cJSON_GetStringValue(vectors_get(json, name));

    for (uint8_t i = 0; text && list[i]; i++)
        if (strcmp(text, list[i]) == 0)
            return i;
    fprintf(stderr, "%s: \"%s\" is not known\n", name, text ? text : "");
    *known = false;
    return 0;
}

static struct motion_fcurve_point point(const struct blender_curve *c,
                                        const cJSON *json, const char *t,
                                        const char *v)
{
    return (struct motion_fcurve_point){
        whole(vectors_value_of(json, t), c->frame),
        whole(vectors_value_of(json, v), c->unit)
    };
}

static bool is_given(uint8_t kind)
{
    return kind == MOTION_FCURVE_FREE || kind == MOTION_FCURVE_ALIGNED;
}

static void read_key(const struct blender_curve *c, const cJSON *json,
                     struct motion_fcurve_key *key, bool *known)
{
    *key = (struct motion_fcurve_key){
        .at = point(c, json, "t", "v"),
        .left_kind = word(json, "hl", handle_names, known),
        .right_kind = word(json, "hr", handle_names, known),
        .interpolation = word(json, "interp", interpolation_names, known),
        .easing = word(json, "easing", easing_names, known),
        .amplitude_q32 = whole(vectors_value_of(json, "amplitude"), c->unit),
        .period_ns_q12 = whole(vectors_value_of(json, "period"), c->frame),
        .back_q32 = whole(vectors_value_of(json, "back"), 32),
    };
    /* a single key has the handles that it was left with */
    if (is_given(key->left_kind) || c->curve.count == 1)
        key->left = point(c, json, "lt", "lv");
    if (is_given(key->right_kind) || c->curve.count == 1)
        key->right = point(c, json, "rt", "rv");
}

static void read_cycles(struct blender_curve *c, bool *known)
{
    const cJSON *json = vectors_get(c->json, "cycles");

    if (!cJSON_IsObject(json))
        return;
    c->curve.before.mode = word(json, "mode_before", cycle_names, known);
    c->curve.after.mode = word(json, "mode_after", cycle_names, known);
    c->curve.before.count = (uint32_t)vectors_value_of(json, "count_before");
    c->curve.after.count = (uint32_t)vectors_value_of(json, "count_after");
}

static double largest(double a, const cJSON *json, const char *name)
{
    const double b = fabs(vectors_value_of(json, name));
    return b > a ? b : a;
}

/* Units in which the largest value and time fill their bits. */
static void choose_units(struct blender_curve *c)
{
    const cJSON *keys = vectors_get(c->json, "keys"), *key;
    const double end =
        vectors_value_of(c->json, "t0") +
        vectors_value_of(c->json, "dt") * vectors_value_of(c->json, "n");
    double v = 0, t = fmax(largest(fabs(end), c->json, "t0"), 1e-6);
    int e;

    cJSON_ArrayForEach(key, keys)
    {
        v = largest(largest(v, key, "v"), key, "amplitude");
        t = largest(t, key, "t");
    }
    cJSON_ArrayForEach(key, vectors_get(c->json, "v"))
    {
        v = fmax(v, fabs(vectors_value(key)));
    }
    (void)frexp(v, &e);
    c->unit = 32 + UNIT_BITS - (v > 0 ? e : 0);
    (void)frexp(t, &e);
    c->frame = TIME_BITS - e;
}

static bool read_curve(struct blender_curve *c)
{
    const cJSON *keys = vectors_get(c->json, "keys"), *json;
    bool known = true;
    uint32_t i = 0;

    choose_units(c);
    c->curve.count = (uint32_t)cJSON_GetArraySize(keys);
    c->curve.key = calloc(c->curve.count + 1, sizeof *c->curve.key);
    c->work = calloc(c->curve.count + 1, sizeof *c->work);
    if (c->curve.key == NULL || c->work == NULL)
        return false;
    c->curve.frame_ns_q12 = whole(1, c->frame);
    c->curve.value_q32 = whole(1, c->unit);
    c->curve.smoothing =
        word(c->json, "auto_smoothing", smoothing_names, &known);
    c->curve.extrapolation =
        word(c->json, "extrapolation", extrapolation_names, &known);
    read_cycles(c, &known);
    cJSON_ArrayForEach(json, keys)
    {
        read_key(c, json, &c->curve.key[i++], &known);
    }
    return known;
}

/* --- comparing ------------------------------------------------------------ */

static double value_of(struct motion_real a)
{
    return ldexp((double)a.m, a.e);
}

static int compare(struct blender_curve *c, double t, const cJSON *want)
{
    struct motion_fcurve_value got;
    int rc =
        motion_fcurve_at(&c->curve, whole(t, c->frame), MOTION_FCURVE_AT, &got);
    double error;

    if (rc != MOTION_OK)
        return rc;
    error = fabs(ldexp(value_of(got.pos), 32 - c->unit) - vectors_value(want));
    if (!(error <= c->worst)) {
        c->worst = error;
        c->worst_t = t;
    }
    return MOTION_OK;
}

static int compare_all(struct blender_curve *c)
{
    const double t0 = vectors_value_of(c->json, "t0"),
                 dt = vectors_value_of(c->json, "dt");
    const cJSON *want, *key;
    int rc = MOTION_OK, i = 0;

    cJSON_ArrayForEach(want, vectors_get(c->json, "v"))
    {
        if (rc == MOTION_OK)
            rc = compare(c, t0 + i++ * dt, want);
    }
    i = 0;
    cJSON_ArrayForEach(key, vectors_get(c->json, "keys"))
    {
        want = cJSON_GetArrayItem(vectors_get(c->json, "at_keys"), i++);
        if (rc == MOTION_OK)
            rc = compare(c, vectors_value_of(key, "t"), want);
    }
    return rc;
}

static int64_t stored(int64_t value, int bits)
{
    return whole((double)(float)ldexp((double)value, -bits), bits);
}

/* Blender keeps handles in single precision: far from frame 0 that moves them,
 * up to 1/256 of a frame at 1e5, which is part of the curve it then draws. */
static void store(struct blender_curve *c)
{
    for (uint32_t i = 0; i < c->curve.count; i++) {
        struct motion_fcurve_point *const handle[2] = {
            &c->curve.key[i].left, &c->curve.key[i].right
        };

        for (int k = 0; k < 2; k++) {
            handle[k]->t_ns_q12 = stored(handle[k]->t_ns_q12, c->frame);
            handle[k]->pos_q32 = stored(handle[k]->pos_q32, c->unit);
        }
    }
}

/* Handles from their kinds, then every sample; inside the tolerance? */
static bool judge(struct blender_curve *c, double tolerance)
{
    uint32_t failed = 0;
    int rc = motion_fcurve_handles(&c->curve, c->work, &failed);

    if (rc == MOTION_OK) {
        store(c);
        rc = compare_all(c);
    }
    if (rc != MOTION_OK)
        fprintf(stderr, "%s: key %u: %s\n", c->name, failed,
                motion_err_text(rc));
    else if (!(c->worst <= tolerance))
        fprintf(stderr, "%s: %g off at frame %g, allowed are %g\n", c->name,
                c->worst, c->worst_t, tolerance);
    else if (getenv("VECTORS_VERBOSE") != NULL)
        fprintf(stderr, "%s: %.3f of the tolerance %g\n", c->name,
                c->worst / tolerance, tolerance);
    return rc == MOTION_OK && c->worst <= tolerance;
}

/* --- rows ----------------------------------------------------------------- */

static const char *method_of(const struct motion_fcurve *curve)
{
    const uint8_t kind = curve->key[0].interpolation;

    if (curve->before.mode != MOTION_FCURVE_ONCE ||
        curve->after.mode != MOTION_FCURVE_ONCE)
        return "cycles";
    if (curve->extrapolation != MOTION_FCURVE_HOLD)
        return "extrapolation";
    if (curve->smoothing != MOTION_FCURVE_SMOOTH_NONE)
        return "smooth";
    for (uint32_t i = 1; i + 1 < curve->count; i++)
        if (curve->key[i].interpolation != kind)
            return "mixed";
    return interpolation_names[kind];
}

/* The row of a method, a new one when there is none; NULL when full. */
static int add_curve(struct blender_curve *c, struct vectors_row *rows,
                     int *count, int capacity)
{
    const double tolerance = vectors_value_of(c->json, "tol_abs");
    struct vectors_row *row;
    bool pass;

    if (!read_curve(c)) {
        fprintf(stderr, "%s: cannot be read\n", c->name);
        return -1;
    }
    row = vectors_row_of(rows, capacity, count, method_of(&c->curve), 1);
    if (row == NULL)
        return -1;
    pass = judge(c, tolerance);
    row->cases++;
    row->pass = row->pass && pass;
    row->worst_p = fmax(row->worst_p, c->worst / tolerance);
    return 0;
}

int vectors_blender(const cJSON *file, struct vectors_row *rows, int capacity)
{
    const cJSON *json;
    int count = 0, rc = 0;

    cJSON_ArrayForEach(json, vectors_get(file, "curves"))
    {
        const char *name = cJSON_GetStringValue(vectors_get(json, "name"));
        struct blender_curve c = { .json = json, .name = name ? name : "?" };

        if (rc == 0)
            rc = add_curve(&c, rows, &count, capacity);
        free(c.curve.key);
        free(c.work);
    }
    return rc == 0 ? count : -1;
}

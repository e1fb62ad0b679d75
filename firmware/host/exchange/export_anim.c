/* firmware/host/exchange/export_anim.c - Maya .anim: keys with fixed tangents.
 *
 * Axes whose curve is bezier keep their keys, with weighted tangents, where
 * Maya can say all of it; of others the track is written (export_keys.h). */
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/exchange/export_keys.h"
#include "firmware/host/exchange/import.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/double/double_math.h"

struct export_anim {
    const struct job *job;
    const struct units_fps *fps;
    FILE *file;
};

/* As few digits as are read as this rate. */
static bool export_anim_rate(const struct units_fps *fps, char text[NUMBER_MAX])
{
    char sentence[UNITS_SENTENCE_MAX];
    struct units_fps back;

    for (int digits = 1; digits <= 17; digits++) {
        snprintf(text, NUMBER_MAX, "%.*g", digits,
                 (double)fps->num / (double)fps->den);
        if (strchr(text, 'e') == NULL &&
            units_parse_fps(text, &back, sentence) == 0 &&
            back.num == fps->num && back.den == fps->den)
            return true;
    }
    return false;
}

/* A name that Maya has for a rate is that rate, whatever its digits say. */
static int export_anim_time_unit(const struct export_anim *self,
                                 char message[YAML_MESSAGE_MAX])
{
    static const struct {
        struct units_fps fps;
        const char *name;
    } names[] = {
        { { 15, 1 }, "game" },
        { { 24, 1 }, "film" },
        { { 25, 1 }, "pal" },
        { { 30, 1 }, "ntsc" },
        { { 48, 1 }, "show" },
        { { 50, 1 }, "palf" },
        { { 60, 1 }, "ntscf" },
        { { 24000, 1001 }, "23.976fps" },
        { { 30000, 1001 }, "29.97fps" },
        { { 48000, 1001 }, "47.952fps" },
        { { 60000, 1001 }, "59.94fps" },
    };
    char rate[NUMBER_MAX], unit[NUMBER_MAX + 3];

    for (size_t i = 0; i < ARRAY_LEN(names); i++)
        if (self->fps->num == names[i].fps.num &&
            self->fps->den == names[i].fps.den) {
            fprintf(self->file, "timeUnit %s;\n", names[i].name);
            return 0;
        }
    if (!export_anim_rate(self->fps, rate)) {
        snprintf(message, YAML_MESSAGE_MAX,
                 "%" PRIu64 "/%" PRIu64 " frames a second have no decimal "
                 "name, expected --fps such as 24, 24000/1001 or 60",
                 self->fps->num, self->fps->den);
        return -1;
    }
    snprintf(unit, sizeof unit, "%sfps", rate);
    for (size_t i = 0; i < ARRAY_LEN(names); i++)
        if (strcmp(unit, names[i].name) == 0) {
            snprintf(message, YAML_MESSAGE_MAX,
                     "Maya's %s is %" PRIu64 "/%" PRIu64 " frames a second, "
                     "expected --fps %" PRIu64 "/%" PRIu64,
                     unit, names[i].fps.num, names[i].fps.den, names[i].fps.num,
                     names[i].fps.den);
            return -1;
        }
    fprintf(self->file, "timeUnit %s;\n", unit);
    return 0;
}

/* 18 digits are read back to the tick, to 19 hours. */
static long double export_anim_frames(const struct export_anim *self,
                                      int64_t t_ns_q12)
{
    return (long double)t_ns_q12 * (long double)self->fps->num /
           ((long double)self->fps->den * (long double)MOTION_FIXED_S_Q12);
}

static double export_anim_angle(const struct export_anim *self, int64_t vel_q32)
{
    double slope = number_double(vel_q32, 32) * (double)self->fps->den /
                   (double)self->fps->num;
    return double_atan(slope) * 180 / DOUBLE_PI;
}

static void export_anim_key(const struct export_anim *self,
                            const struct export_key *key)
{
    char text[NUMBER_MAX];
    const long double frame = export_anim_frames(self, key->t_ns_q12);
    number_fixed(text, key->pos_q32, 32, 10);
    fprintf(self->file, "    %.18Lg %s fixed fixed %d 1 0 %.17g 1 %.17g 1;\n",
            frame, text, key->in_q32 == key->out_q32,
            export_anim_angle(self, key->in_q32),
            export_anim_angle(self, key->out_q32));
}

static void export_anim_keys(const struct export_anim *self,
                             const struct motion_track *track)
{
    const struct export_keys keys = export_keys_of(track, self->fps);
    for (uint32_t i = 0; i < keys.count; i++)
        export_anim_key(self, &keys.key[i]);
    memory_free(keys.key);
}

/* --- bezier ---------------------------------------------------------------- */

/* Curve from key to key, so that it ends where its handles say. */
static bool export_anim_has_spans(const struct plan_axis *axis)
{
    for (uint32_t i = 0; i + 1 < axis->key_count; i++)
        if ((axis->key[i].has_curve ? axis->key[i].curve : axis->curve) !=
            PLAN_CURVE_BEZIER)
            return false;
    return axis->key_count > 1;
}

/* Maya has one range for all curves, begins at its first key, and repeats for
 * ever. */
static bool export_anim_has_range(const struct export_anim *self,
                                  const struct plan_axis *axis)
{
    const struct plan_bezier *bezier = &axis->bezier;
    const int64_t last_ns_q12 = axis->key[axis->key_count - 1].key.t_ns_q12;

    if (axis->key[0].key.t_ns_q12 < 0 ||
        (bezier->before.mode != MOTION_FCURVE_ONCE && bezier->before.count) ||
        (bezier->after.mode != MOTION_FCURVE_ONCE && bezier->after.count))
        return false;
    return !bezier->has_end || bezier->end_ns_q12 == self->job->end_ns_q12 ||
           (bezier->after.mode == MOTION_FCURVE_ONCE &&
            bezier->extrapolation == MOTION_FCURVE_HOLD &&
            bezier->end_ns_q12 >= last_ns_q12);
}

static bool export_anim_has_handles(const struct motion_fcurve *curve)
{
    for (uint32_t i = 0; i < curve->count; i++)
        if (curve->key[i].interpolation != MOTION_FCURVE_BEZIER &&
            curve->key[i].interpolation != MOTION_FCURVE_LINEAR)
            return false;
    return true;
}

/* The curve with its handles, when nothing is put over it and Maya has such a
 * one: its keys are on the heap. */
static bool export_anim_bezier(const struct export_anim *self,
                               const struct plan_axis *axis,
                               struct motion_fcurve *curve)
{
    const struct plan_move *move = &self->job->move;

    if (axis->driver != PLAN_BY_KEYS || move->layers > 0 ||
        move->fade != NULL || move->warp != NULL || move->shoot != NULL ||
        !export_anim_has_spans(axis) || !export_anim_has_range(self, axis) ||
        plan_bezier_curve(axis, curve) != MOTION_OK)
        return false;
    if (export_anim_has_handles(curve))
        return true;
    free(curve->key);
    return false;
}

/* Angle and weight of a side, 0 (in) or 1 (out), of key i.  slew's handles are
 * not longer than their span, and a linear one is a third of it. */
static void export_anim_tangent(const struct export_anim *self,
                                const struct motion_fcurve *curve, uint32_t i,
                                int which, double tangent[2])
{
    const struct motion_fcurve_key *key = &curve->key[i];
    const uint32_t last = curve->count - 1;
    const uint32_t from = which == 0 ? (i > 0 ? i - 1 : 0) : i;
    const struct motion_fcurve_key *near =
        &curve->key[from < last ? from : i - 1];
    const struct motion_fcurve_point *handle =
        which == 0 ? &key->left : &key->right;
    const double span = (double)export_anim_frames(self, near[1].at.t_ns_q12 -
                                                             near->at.t_ns_q12);
    const double chord =
        number_double(near[1].at.pos_q32 - near->at.pos_q32, 32);
    double time = (double)fabsl(
        export_anim_frames(self, handle->t_ns_q12 - key->at.t_ns_q12));
    double rise = number_double(handle->pos_q32 - key->at.pos_q32, 32) *
                  (which == 0 ? -1 : 1);

    if (curve->key[from].interpolation == MOTION_FCURVE_LINEAR) {
        time = span / 3;
        rise = chord / 3;
    } else if (time > span) {
        rise *= span / time;
        time = span;
    }
    tangent[0] = rise != 0 ? double_atan(rise / time) * 180 / DOUBLE_PI : 0;
    tangent[1] = 3 * double_hypot(time, rise);
}

static void export_anim_handles(const struct export_anim *self,
                                const struct motion_fcurve *curve)
{
    for (uint32_t i = 0; i < curve->count; i++) {
        char text[NUMBER_MAX];
        double in[2], out[2];

        export_anim_tangent(self, curve, i, 0, in);
        export_anim_tangent(self, curve, i, 1, out);
        number_fixed(text, curve->key[i].at.pos_q32, 32, 10);
        fprintf(self->file,
                "    %.18Lg %s fixed fixed %d %d 0 %.17g %.17g %.17g %.17g;\n",
                export_anim_frames(self, curve->key[i].at.t_ns_q12), text,
                in[0] == out[0], in[1] == out[1], in[0], in[1], out[0], out[1]);
    }
}

/* --- curves ---------------------------------------------------------------- */

static const char *export_anim_infinity(const struct motion_fcurve *curve,
                                        uint8_t mode)
{
    static const char *const word[] = {
        [MOTION_FCURVE_ONCE] = "constant",
        [MOTION_FCURVE_REPEAT] = "cycle",
        [MOTION_FCURVE_REPEAT_OFFSET] = "cycleRelative",
        [MOTION_FCURVE_MIRROR] = "oscillate",
    };
    if (mode == MOTION_FCURVE_ONCE &&
        curve->extrapolation == MOTION_FCURVE_LINE)
        return "linear";
    return word[mode];
}

static void export_anim_curve(const struct export_anim *self, unsigned i)
{
    static const struct {
        const char *attribute, *output;
    } of_unit[] = {
        [UNITS_AXIS_MM] = { "translate.translateX translateX", "linear" },
        [UNITS_AXIS_DEG] = { "rotate.rotateY rotateY", "angular" },
        [UNITS_AXIS_REV] = { "revolutions revolutions", "unitless" },
        [UNITS_AXIS_RAD] = { "radians radians", "unitless" },
        [UNITS_AXIS_COUNT] = { "counts counts", "unitless" },
        [UNITS_AXIS_KCOUNT] = { "kcounts kcounts", "unitless" },
        [UNITS_AXIS_MCOUNT] = { "Mcounts Mcounts", "unitless" },
    };
    enum units_axis unit = job_rig_axis(self->job, i)->unit;
    const struct plan_axis *axis = &self->job->move.axis[i];
    struct motion_fcurve curve = { .key = NULL };
    const bool bezier = export_anim_bezier(self, axis, &curve);
    const struct motion_fcurve once = { .key = NULL };
    const struct motion_fcurve *infinity = bezier ? &curve : &once;
    fprintf(self->file,
            "anim %s %s 0 0 %u;\nanimData {\n  input time;\n  output %s;\n"
            "  weighted %d;\n  preInfinity %s;\n  postInfinity %s;\n"
            "  keys {\n",
            of_unit[unit].attribute, axis->name, i, of_unit[unit].output,
            bezier, export_anim_infinity(infinity, infinity->before.mode),
            export_anim_infinity(infinity, infinity->after.mode));
    if (bezier)
        export_anim_handles(self, &curve);
    else
        export_anim_keys(self, &self->job->track[i]);
    if (bezier)
        free(curve.key);
    fputs("  }\n}\n", self->file);
}

int export_anim(const struct job *job, const struct units_fps *fps, FILE *file,
                char message[YAML_MESSAGE_MAX])
{
    const struct export_anim self = { job, fps, file };
    if (fps->den == 0) {
        snprintf(message, YAML_MESSAGE_MAX, "no frame rate, expected --fps");
        return -1;
    }
    fputs("animVersion 1.1;\nmayaVersion 2015;\n", file);
    if (export_anim_time_unit(&self, message) < 0)
        return -1;
    fprintf(file,
            "linearUnit mm;\nangularUnit deg;\nstartTime 0;\nendTime %.18Lg;\n",
            export_anim_frames(&self, job->end_ns_q12));
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        plan_progress_tell(job->progress, "writing", job->move.axis[i].name, i,
                           job->move.axis_count);
        export_anim_curve(&self, i);
    }
    return 0;
}

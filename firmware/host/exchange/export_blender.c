/* firmware/host/exchange/export_blender.c - a Blender action as JSON, with
 * handles.
 *
 * Axes whose curve is bezier keep their keys and handles; of others the track
 * is written (export_keys.h).  Numbers have 18 digits, so that what is read
 * back is what was written: to 19 hours and 10^7 units.  examples/blender/
 * slew_import.py makes an action of it. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/exchange/export_keys.h"
#include "firmware/host/exchange/import.h"
#include "motion/core/fixed.h"

struct export_blender {
    const struct job *job;
    const struct units_fps *fps;
    FILE *file;
    const struct plan_axis *axis; /* being written */
    const char *unit;
    long double per_value; /* Q32.32 of the axis's unit */
};

static long double export_blender_frames(const struct export_blender *self,
                                         int64_t t_ns_q12)
{
    return (long double)t_ns_q12 * (long double)self->fps->num /
           ((long double)self->fps->den * (long double)MOTION_FIXED_S_Q12);
}

static void export_blender_time(const struct export_blender *self,
                                const char *name, int64_t t_ns_q12)
{
    fprintf(self->file, "\"%s\": %.18Lg, ", name,
            export_blender_frames(self, t_ns_q12));
}

static void export_blender_value(const struct export_blender *self,
                                 const char *name, int64_t pos_q32)
{
    fprintf(self->file, "\"%s\": %.18Lg, ", name,
            (long double)pos_q32 / self->per_value);
}

static const char *const export_blender_handle[] = {
    [MOTION_FCURVE_FREE] = "FREE",
    [MOTION_FCURVE_ALIGNED] = "ALIGNED",
    [MOTION_FCURVE_VECTOR] = "VECTOR",
    [MOTION_FCURVE_AUTO] = "AUTO",
    [MOTION_FCURVE_CLAMPED] = "AUTO_CLAMPED",
};
static const char *const export_blender_interpolation[] = {
    [MOTION_FCURVE_CONSTANT] = "CONSTANT", [MOTION_FCURVE_LINEAR] = "LINEAR",
    [MOTION_FCURVE_BEZIER] = "BEZIER",     [MOTION_FCURVE_SINE] = "SINE",
    [MOTION_FCURVE_QUAD] = "QUAD",         [MOTION_FCURVE_CUBIC] = "CUBIC",
    [MOTION_FCURVE_QUART] = "QUART",       [MOTION_FCURVE_QUINT] = "QUINT",
    [MOTION_FCURVE_EXPO] = "EXPO",         [MOTION_FCURVE_CIRC] = "CIRC",
    [MOTION_FCURVE_BACK] = "BACK",         [MOTION_FCURVE_BOUNCE] = "BOUNCE",
    [MOTION_FCURVE_ELASTIC] = "ELASTIC",
};
static const char *const export_blender_easing[] = {
    [MOTION_FCURVE_BY_KIND] = "AUTO",
    [MOTION_FCURVE_IN] = "EASE_IN",
    [MOTION_FCURVE_OUT] = "EASE_OUT",
    [MOTION_FCURVE_IN_OUT] = "EASE_IN_OUT",
};
static const char *const export_blender_cycle[] = {
    [MOTION_FCURVE_ONCE] = "NONE",
    [MOTION_FCURVE_REPEAT] = "REPEAT",
    [MOTION_FCURVE_REPEAT_OFFSET] = "REPEAT_OFFSET",
    [MOTION_FCURVE_MIRROR] = "MIRROR",
};

/* --- keys ----------------------------------------------------------------- */

static void export_blender_key(const struct export_blender *self,
                               const struct motion_key *at,
                               const struct plan_bezier_key *key, bool last)
{
    fputs("   {", self->file);
    export_blender_time(self, "t", at->t_ns_q12);
    export_blender_value(self, "v", at->pos_q32);
    export_blender_time(self, "lt", at->t_ns_q12 + key->left.dt_ns_q12);
    export_blender_value(self, "lv", at->pos_q32 + key->left.dp_q32);
    export_blender_time(self, "rt", at->t_ns_q12 + key->right.dt_ns_q12);
    export_blender_value(self, "rv", at->pos_q32 + key->right.dp_q32);
    export_blender_value(self, "amplitude", key->amplitude_q32);
    export_blender_time(self, "period", key->period_ns_q12);
    fprintf(self->file,
            "\"back\": %.18Lg, \"hl\": \"%s\", \"hr\": \"%s\", \"interp\": "
            "\"%s\", \"easing\": \"%s\"}%s\n",
            (long double)key->back_q32 / (long double)MOTION_FIXED_ONE_Q32,
            export_blender_handle[key->left.kind],
            export_blender_handle[key->right.kind],
            export_blender_interpolation[key->interpolation],
            export_blender_easing[key->easing], last ? "" : ",");
}

/* ALIGNED handles have their length in frames and values: whoever reads them
 * with other frames finds them in line already when they are written
 * computed. */
static void export_blender_align(const struct motion_fcurve_key *computed,
                                 struct plan_bezier_key *key)
{
    if (key->left.kind == MOTION_FCURVE_ALIGNED) {
        key->left.dt_ns_q12 = computed->left.t_ns_q12 - computed->at.t_ns_q12;
        key->left.dp_q32 = computed->left.pos_q32 - computed->at.pos_q32;
    }
    if (key->right.kind == MOTION_FCURVE_ALIGNED) {
        key->right.dt_ns_q12 = computed->right.t_ns_q12 - computed->at.t_ns_q12;
        key->right.dp_q32 = computed->right.pos_q32 - computed->at.pos_q32;
    }
}

static bool export_blender_has_frames(const struct export_blender *self)
{
    const struct units_fps film = { 24, 1 };
    const int64_t frame_ns_q12 = self->axis->bezier.frame_ns_q12;

    return import_frame_ns_q12(self->fps, 1) ==
           (frame_ns_q12 > 0 ? frame_ns_q12 : import_frame_ns_q12(&film, 1));
}

static void export_blender_handles(const struct export_blender *self)
{
    static const struct plan_bezier_key automatic = {
        .left.kind = MOTION_FCURVE_CLAMPED,
        .right.kind = MOTION_FCURVE_CLAMPED,
        .interpolation = MOTION_FCURVE_BEZIER,
    };
    const struct plan_axis *axis = self->axis;
    struct motion_fcurve curve = { .key = NULL };

    if (!export_blender_has_frames(self))
        (void)plan_bezier_curve(axis, &curve);
    for (uint32_t i = 0; i < axis->key_count; i++) {
        struct plan_bezier_key key =
            axis->bezier.key ? axis->bezier.key[i] : automatic;

        if (curve.key != NULL)
            export_blender_align(&curve.key[i], &key);
        export_blender_key(self, &axis->key[i].key, &key,
                           i + 1 == axis->key_count);
    }
    free(curve.key);
}

/* A third of the way at this velocity. */
static struct plan_handle export_blender_third(int64_t dur_ns_q12,
                                               int64_t vel_q32)
{
    const long double s =
        (long double)dur_ns_q12 / (long double)MOTION_FIXED_S_Q12;

    return (struct plan_handle){
        .kind = MOTION_FCURVE_FREE,
        .dt_ns_q12 = dur_ns_q12 / 3,
        .dp_q32 = (int64_t)((long double)vel_q32 * s / 3),
    };
}

static void export_blender_track(const struct export_blender *self,
                                 const struct motion_track *track)
{
    const struct export_keys keys = export_keys_of(track, self->fps);

    for (uint32_t i = 0; i < keys.count; i++) {
        const struct export_key *key = &keys.key[i];
        const int64_t t = key->t_ns_q12;
        const int64_t before = i > 0 ? t - key[-1].t_ns_q12 : 0;
        const int64_t after = i + 1 < keys.count ? key[1].t_ns_q12 - t : 0;
        const struct plan_bezier_key handles = {
            .left = export_blender_third(-before, key->in_q32),
            .right = export_blender_third(after, key->out_q32),
            .interpolation = MOTION_FCURVE_BEZIER,
        };

        export_blender_key(
            self,
            &(struct motion_key){ .t_ns_q12 = t, .pos_q32 = key->pos_q32 },
            &handles, i + 1 == keys.count);
    }
    memory_free(keys.key);
}

/* --- curves --------------------------------------------------------------- */

/* Metres and radians where that is what handles are measured in: Blender's. */
static void export_blender_unit(struct export_blender *self,
                                enum units_axis unit)
{
    const int64_t value_q32 = self->axis->bezier.value_q32;
    const long double degrees = 180 / 3.14159265358979323846264L;

    self->unit = unit >= UNITS_AXIS_COUNT ? "own" : units_axis_text(unit);
    self->per_value = (long double)MOTION_FIXED_ONE_Q32;
    if (unit == UNITS_AXIS_MM && value_q32 == 1000 * MOTION_FIXED_ONE_Q32) {
        self->unit = "m";
        self->per_value *= 1000;
    } else if (unit == UNITS_AXIS_DEG &&
               value_q32 ==
                   (int64_t)(degrees * (long double)MOTION_FIXED_ONE_Q32 +
                             0.5L)) {
        self->unit = "rad";
        self->per_value *= degrees;
    }
}

/* Bezier throughout, and nothing is put over it. */
static bool export_blender_is_whole(const struct job *job,
                                    const struct plan_axis *axis)
{
    const struct plan_move *move = &job->move;

    if (axis->driver != PLAN_BY_KEYS || axis->key_count == 0 ||
        move->layers > 0 || move->fade != NULL || move->warp != NULL ||
        move->shoot != NULL)
        return false;
    for (uint32_t i = 0; i < axis->key_count; i++)
        if ((axis->key[i].has_curve ? axis->key[i].curve : axis->curve) !=
            PLAN_CURVE_BEZIER)
            return false;
    return true;
}

static void export_blender_cycles(const struct export_blender *self, bool whole)
{
    const struct plan_bezier *bezier = &self->axis->bezier;

    if (!whole || (bezier->before.mode == MOTION_FCURVE_ONCE &&
                   bezier->after.mode == MOTION_FCURVE_ONCE)) {
        fputs("\"cycles\": null, ", self->file);
        return;
    }
    fprintf(self->file,
            "\"cycles\": {\"mode_before\": \"%s\", \"mode_after\": \"%s\", "
            "\"count_before\": %u, \"count_after\": %u}, ",
            export_blender_cycle[bezier->before.mode],
            export_blender_cycle[bezier->after.mode],
            (unsigned)bezier->before.count, (unsigned)bezier->after.count);
}

static void export_blender_curve(struct export_blender *self, unsigned i)
{
    const struct plan_axis *axis = &self->job->move.axis[i];
    const bool whole = export_blender_is_whole(self->job, axis);

    self->axis = axis;
    export_blender_unit(self, job_rig_axis(self->job, i)->unit);
    fprintf(self->file,
            "  {\"name\": \"%s\", \"unit\": \"%s\", \"extrapolation\": \"%s\", "
            "\"auto_smoothing\": \"%s\",\n   ",
            axis->name, self->unit,
            whole && axis->bezier.extrapolation ? "LINEAR" : "CONSTANT",
            whole && axis->bezier.smoothing ? "CONT_ACCEL" : "NONE");
    export_blender_cycles(self, whole);
    fputs("\"keys\": [\n", self->file);
    if (whole)
        export_blender_handles(self);
    else
        export_blender_track(self, &self->job->track[i]);
    fprintf(self->file, "   ]}%s\n",
            i + 1 < self->job->move.axis_count ? "," : "");
}

/* The scene has one last frame for all. */
static int export_blender_check(const struct job *job,
                                char message[YAML_MESSAGE_MAX])
{
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        const struct plan_axis *axis = &job->move.axis[i];

        if (export_blender_is_whole(job, axis) && axis->bezier.has_end &&
            axis->bezier.end_ns_q12 < job->end_ns_q12) {
            snprintf(message, YAML_MESSAGE_MAX,
                     "axis %s ends before the others (until), which Blender's "
                     "scene cannot say",
                     axis->name);
            return -1;
        }
    }
    return 0;
}

/* fps is whole and fps_base a decimal: 24 and 1.001 for 24000/1001, as
 * Blender's own presets are, where that ends within six decimals; else the two
 * numbers of the rate.  Blender has at most 32767. */
#define EXPORT_BLENDER_FPS_MAX 32767

static int export_blender_rate(const struct units_fps *fps, char text[80],
                               char message[YAML_MESSAGE_MAX])
{
    const uint64_t whole = (fps->num + fps->den - 1) / fps->den;
    const uint64_t over = whole * fps->den; /* below 2e9 */

    if (whole <= EXPORT_BLENDER_FPS_MAX && over * 1000000 % fps->num == 0) {
        const uint64_t millionths = over * 1000000 / fps->num;
        snprintf(text, 80,
                 "\"fps\": %" PRIu64 ", \"fps_base\": %" PRIu64 ".%06" PRIu64,
                 whole, millionths / 1000000, millionths % 1000000);
        return 0;
    }
    snprintf(text, 80, "\"fps\": %" PRIu64 ", \"fps_base\": %" PRIu64, fps->num,
             fps->den);
    if (fps->num <= EXPORT_BLENDER_FPS_MAX && fps->den <= 1000000)
        return 0;
    snprintf(message, YAML_MESSAGE_MAX,
             "%" PRIu64 "/%" PRIu64 " frames a second cannot be said in "
             "Blender, whose rate is a whole number of at most %d divided by "
             "a decimal, expected --fps such as 24, 24000/1001 or 29.97",
             fps->num, fps->den, EXPORT_BLENDER_FPS_MAX);
    return -1;
}

int export_blender(const struct job *job, const struct units_fps *fps,
                   FILE *file, char message[YAML_MESSAGE_MAX])
{
    struct export_blender self = { .job = job, .fps = fps, .file = file };
    char rate[80];

    if (fps->den == 0) {
        snprintf(message, YAML_MESSAGE_MAX, "no frame rate, expected --fps");
        return -1;
    }
    if (export_blender_check(job, message) < 0 ||
        export_blender_rate(fps, rate, message) < 0)
        return -1;
    fprintf(file,
            "{\"format\": \"slew-blender-1\",\n %s,\n"
            " \"frame_start\": 0, \"frame_end\": %.18Lg,\n "
            "\"curves\": [\n",
            rate, export_blender_frames(&self, job->end_ns_q12));
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        plan_progress_tell(job->progress, "writing", job->move.axis[i].name, i,
                           job->move.axis_count);
        export_blender_curve(&self, i);
    }
    fputs(" ]}\n", file);
    return 0;
}

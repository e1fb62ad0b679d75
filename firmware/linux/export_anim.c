/* firmware/linux/export_anim.c - Maya .anim: keys with fixed tangents;
 * export_keys.h says which. */
#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "firmware/linux/export_keys.h"
#include "firmware/linux/import.h"
#include "firmware/linux/memory.h"
#include "firmware/linux/number.h"
#include "motion/fixed.h"

struct export_anim {
    const struct job *job;
    const struct units_fps *fps;
    FILE *file;
};

static void export_anim_time_unit(const struct export_anim *self)
{
    static const struct {
        unsigned fps;
        const char *name;
    } names[] = { { 15, "game" }, { 24, "film" }, { 25, "pal" },
                  { 30, "ntsc" }, { 48, "show" }, { 50, "palf" },
                  { 60, "ntscf" } };
    double rate = (double)self->fps->num / (double)self->fps->den;
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (self->fps->den == 1 && self->fps->num == names[i].fps) {
            fprintf(self->file, "timeUnit %s;\n", names[i].name);
            return;
        }
    fprintf(self->file, "timeUnit %.17gfps;\n", rate);
}

static double export_anim_frames(const struct export_anim *self,
                                 int64_t t_ns_q12)
{
    return number_double(t_ns_q12, 12) / 1e9 * (double)self->fps->num /
           (double)self->fps->den;
}

static double export_anim_angle(const struct export_anim *self, int64_t vel_q32)
{
    double slope = number_double(vel_q32, 32) * (double)self->fps->den /
                   (double)self->fps->num;
    return atan(slope) * 180 / acos(-1);
}

static void export_anim_key(const struct export_anim *self,
                            const struct export_key *key)
{
    char text[NUMBER_MAX];
    double frame = export_anim_frames(self, key->t_ns_q12);
    number_fixed(text, key->pos_q32, 32, 10);
    fprintf(self->file, "    %.17g %s fixed fixed %d 1 0 %.17g 1 %.17g 1;\n",
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

static void export_anim_curve(const struct export_anim *self, unsigned i)
{
    static const struct {
        const char *attribute, *output;
    } of_unit[] = {
        [RIG_UNIT_MM] = { "translate.translateX translateX", "linear" },
        [RIG_UNIT_DEG] = { "rotate.rotateY rotateY", "angular" },
        [RIG_UNIT_REV] = { "revolutions revolutions", "unitless" },
        [RIG_UNIT_COUNT] = { "counts counts", "unitless" },
    };
    enum rig_unit unit = job_rig_axis(self->job, i)->unit;
    fprintf(self->file,
            "anim %s %s 0 0 %u;\nanimData {\n  input time;\n  output %s;\n"
            "  weighted 0;\n  preInfinity constant;\n  postInfinity constant;\n"
            "  keys {\n",
            of_unit[unit].attribute, self->job->move.axis[i].name, i,
            of_unit[unit].output);
    export_anim_keys(self, &self->job->track[i]);
    fputs("  }\n}\n", self->file);
}

int export_anim(const struct job *job, const struct units_fps *fps, FILE *file,
                char message[RIG_MESSAGE_MAX])
{
    const struct export_anim self = { job, fps, file };
    if (fps->den == 0) {
        snprintf(message, RIG_MESSAGE_MAX,
                 "how many frames a second? expected --fps");
        return -1;
    }
    fputs("animVersion 1.1;\nmayaVersion 2015;\n", file);
    export_anim_time_unit(&self);
    fprintf(file,
            "linearUnit mm;\nangularUnit deg;\nstartTime 0;\nendTime %.17g;\n",
            ceil(export_anim_frames(&self, job->end_ns_q12)));
    for (unsigned i = 0; i < job->move.axis_count; i++)
        export_anim_curve(&self, i);
    return 0;
}

/* firmware/linux/commands/files/plot_payload.c - see plot_payload.h.
 *
 * Axes are where the plan has them: what the payload does to its axis is seen in
 * a run, and is too little to be seen in a picture. */
#include "firmware/linux/commands/files/plot_payload.h"

#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/job/job_payload.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/commands/picture.h"
#include "firmware/linux/commands/planning.h"
#include "firmware/linux/machine/machine_sim.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define FILM_STEP_NS     INT64_C(1000000)
#define FILM_STEP_S      1e-3
#define FILM_REST_NS     INT64_C(2000000000) /* behind the end of the move */
#define FILM_EVERY_NS    INT64_C(80000000)   /* 12.5 pictures a second */
#define FILM_MOMENTS_MAX 500                 /* a longer move: fewer a second */
#define FILM_FILE_MAX    4096

struct film {
    const struct job *job;
    const struct plan_rig *rig; /* points are in its camera's space; NULL: each
                                   thing by itself */
    struct plot_film film;
    struct plot_film_thing *thing;
    struct sim_payload *payload;
    int64_t every_ns;
    char subtitle[320];
};

static const struct rig_payload *film_of(const struct film *self, unsigned i)
{
    return &self->job->rig.payload[i];
}

/* Of the move; -1: it does not move. */
static int film_axis(const struct job *job, uint32_t rig_axis)
{
    for (unsigned a = 0; a < job->move.axis_count; a++)
        if (job->rig_axis[a] == rig_axis)
            return (int)a;
    return -1;
}

/* Where and how fast its axis is, in m or rad and per s. */
static double film_at(const struct film *self, unsigned i, int64_t t_ns,
                      double *speed)
{
    const struct rig *const rig = &self->job->rig;
    const struct rig_payload *const payload = film_of(self, i);
    const int axis = film_axis(self->job, payload->axis);
    struct motion_cursor cursor = { 0 };
    struct motion_sample sample;

    *speed = 0;
    if (axis < 0)
        return rig_payload_at(rig, payload,
                              rig->axis[payload->axis].sim.start_q32);
    motion_track_sample(&self->job->track[axis], &cursor,
                        t_ns * MOTION_FIXED_NS_Q12, &sample);
    *speed = rig_payload_at(rig, payload, sample.vel_q32);
    return rig_payload_at(rig, payload, sample.pos_q32);
}

static void film_place(const struct film *self, unsigned i, unsigned moment,
                       unsigned count, struct sim_payload_point point[])
{
    struct job_payload_place place;

    job_payload_place(self->job, self->rig, film_of(self, i),
                      moment * self->every_ns * MOTION_FIXED_NS_Q12,
                      self->payload[i].at, &place);
    for (unsigned k = 0; k < count; k++) {
        const double from[3] = { point[k].x, point[k].y, point[k].z };
        double to[3];
        job_payload_in_space(&place, from, to);
        point[k] = (struct sim_payload_point){ to[0], to[1], to[2] };
    }
}

static void film_take(struct film *self, unsigned moment)
{
    struct sim_payload_point point[SIM_PAYLOAD_NODES];

    for (unsigned i = 0; i < self->film.things; i++) {
        const unsigned count = sim_payload_points(&self->payload[i], point);
        if (self->rig != NULL)
            film_place(self, i, moment, count, point);
        struct plot_film_point *const to =
            (struct plot_film_point *)self->thing[i].point +
            (size_t)moment * count;
        for (unsigned k = 0; k < count; k++)
            to[k] =
                (struct plot_film_point){ point[k].x, point[k].y, point[k].z };
    }
}

static int film_begin_one(struct film *self, unsigned i)
{
    struct sim_payload *const payload = &self->payload[i];
    struct sim_payload_point point[SIM_PAYLOAD_NODES];
    struct sim_payload_config config;
    double speed;

    machine_sim_payload_config(film_of(self, i), &config);
    const int err =
        sim_payload_init(payload, &config, film_at(self, i, 0, &speed));
    if (err < 0)
        return err;
    const unsigned points = sim_payload_points(payload, point);
    const bool curtain = config.kind == SIM_PAYLOAD_CURTAIN;
    self->thing[i] = (struct plot_film_thing){
        .name = film_of(self, i)->name,
        .points = points,
        .columns = curtain ? SIM_PAYLOAD_COLUMNS : 0,
        .rows = curtain ? SIM_PAYLOAD_ROWS : 0,
        .radius_m = config.kind == SIM_PAYLOAD_BALL ? config.radius_m : 0,
        .point = memory_new((size_t)points * self->film.moments,
                            sizeof *self->thing[i].point),
    };
    return MOTION_OK;
}

static int film_step(struct film *self, int64_t t_ns)
{
    int err = MOTION_OK;

    for (unsigned i = 0; err == MOTION_OK && i < self->film.things; i++) {
        double speed;
        const double at = film_at(self, i, t_ns, &speed);
        err = sim_payload_step(&self->payload[i], FILM_STEP_S, at, speed);
    }
    return err;
}

static int film_shoot(struct film *self)
{
    int err = MOTION_OK;

    for (unsigned i = 0; err == MOTION_OK && i < self->film.things; i++)
        err = film_begin_one(self, i);
    for (unsigned m = 0; err == MOTION_OK && m < self->film.moments; m++) {
        film_take(self, m);
        plan_progress_tell(&planning_progress, "moving", "payloads", m,
                           self->film.moments);
        const bool last = m + 1 == self->film.moments;
        for (int64_t t_ns = 0;
             !last && err == MOTION_OK && t_ns < self->every_ns;
             t_ns += FILM_STEP_NS)
            err = film_step(self, m * self->every_ns + t_ns + FILM_STEP_NS);
    }
    plan_progress_end(&planning_progress);
    return err;
}

static void film_begin(struct film *self, unsigned moments, int64_t every_ns)
{
    self->every_ns = every_ns;
    self->film.things = self->job->rig.payload_count;
    self->film.moments = moments;
    self->film.every_s = 1e-9 * (double)every_ns;
    self->thing = memory_new(self->film.things, sizeof *self->thing);
    self->payload = memory_new(self->film.things, sizeof *self->payload);
    self->film.thing = self->thing;
}

static void film_plan(struct film *self)
{
    const struct job *const job = self->job;
    const int64_t whole_ns =
        job->end_ns_q12 / MOTION_FIXED_NS_Q12 + FILM_REST_NS;
    int64_t every_ns = FILM_EVERY_NS;

    while (whole_ns / every_ns >= FILM_MOMENTS_MAX)
        every_ns += FILM_EVERY_NS;
    film_begin(self, (unsigned)(whole_ns / every_ns) + 1, every_ns);
    snprintf(self->subtitle, sizeof self->subtitle,
             "%s%s%.3f s, and 2 s after it", job->rig.title,
             job->rig.title[0] != 0 ? "  \u00b7  " : "",
             number_double(job->end_ns_q12, 12) / 1e9);
    self->film.title = job->move.title[0] != 0 ? job->move.title : "Move";
    self->film.subtitle = self->subtitle;
}

static void film_free(struct film *self)
{
    for (unsigned i = 0; i < self->film.things; i++)
        memory_free((void *)self->thing[i].point);
    memory_free(self->thing);
    memory_free(self->payload);
}

/* ---- files ---- */

enum film_form { FILM_STRIP, FILM_MOMENT, FILM_PLAYS };

static int film_write(const struct film *self, const char *path,
                      enum film_form form, unsigned moment)
{
    const enum plot_format format = (enum plot_format)plot_format_of(path);
    struct messages messages = { .text = NULL };
    struct output *const output = memory_new(1, sizeof *output);
    int err = output_open(output, path), drawn = 0;

    if (err == 0) {
        if (form == FILM_PLAYS)
            plot_film_animate(&self->film, output->file);
        else
            drawn = form == FILM_STRIP
                        ? plot_film_strip(&self->film, format, output->file,
                                          &messages)
                        : plot_film_moment(&self->film, moment, format,
                                           output->file, &messages);
        error_tell(&messages);
        err = drawn == 0 || output->error != 0 ? output_commit(output) : -1;
        output_abandon(output);
    }
    memory_free(output);
    return err;
}

/* film.png: film-0001.png and so on. */
static int film_sequence(const struct film *self, const char *out)
{
    const int stem = (int)(strlen(out) - strlen(".png"));
    char path[FILM_FILE_MAX];
    int err = 0;

    for (unsigned m = 0; err == 0 && m < self->film.moments; m++) {
        snprintf(path, sizeof path, "%.*s-%04u.png", stem, out, m + 1);
        err = film_write(self, path, FILM_MOMENT, m);
    }
    return err;
}

static void film_say(const struct film *self, const struct options *options,
                     bool sequence)
{
    if (options->json) {
        cJSON *const report = cJSON_CreateObject();
        cJSON_AddStringToObject(report, "picture", options->out);
        cJSON_AddNumberToObject(report, "moments", self->film.moments);
        cJSON_AddNumberToObject(report, "every_s", self->film.every_s);
        cJSON_AddBoolToObject(report, "sequence", sequence);
        json_report(report, true);
    } else if (sequence) {
        printf("pictures: %.*s-0001.png to -%04u.png, one every %.3g s\n",
               (int)(strlen(options->out) - strlen(".png")), options->out,
               self->film.moments, self->film.every_s);
    } else {
        printf("picture: %s\n", options->out);
    }
}

static void film_refuse(const struct film *self, int err)
{
    error_say("slew plot: a payload of %s: %s", self->job->rig_path,
              motion_err_text(err));
}

enum status plot_payload_space(const struct job *job,
                               const struct plan_rig *rig, const char *path)
{
    struct film self = { .job = job, .rig = rig };
    const int64_t whole_ns = job->end_ns_q12 / MOTION_FIXED_NS_Q12;
    const int64_t steps = whole_ns / (PLOT_SPACE_MOMENTS - 1) / FILM_STEP_NS;

    film_begin(&self, PLOT_SPACE_MOMENTS, steps * FILM_STEP_NS);
    int err = film_shoot(&self);
    if (err < 0)
        film_refuse(&self, err);
    else
        err = picture_of_space(job, &self.film, path);
    film_free(&self);
    return err == 0 ? STATUS_OK : STATUS_SYSTEM;
}

enum status plot_payload(const struct job *job, const struct options *options)
{
    struct film self = { .job = job };
    const bool sequence =
        options->film && plot_format_of(options->out) == PLOT_PNG;
    int err;

    film_plan(&self);
    err = film_shoot(&self);
    if (err < 0)
        film_refuse(&self, err);
    else if (sequence)
        err = film_sequence(&self, options->out);
    else
        err = film_write(&self, options->out,
                         options->film ? FILM_PLAYS : FILM_STRIP, 0);
    if (err == 0)
        film_say(&self, options, sequence);
    film_free(&self);
    return err == 0 ? STATUS_OK : STATUS_SYSTEM;
}

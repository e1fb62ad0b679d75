/* tests/support/fake_job.h - a planned job without files, for the parts that
 * draw and report. */
#ifndef TESTS_SUPPORT_FAKE_JOB_H
#define TESTS_SUPPORT_FAKE_JOB_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/job/job.h"
#include "motion/core/fixed.h"

struct fake_key {
    double t_s, pos;
};

static inline int64_t fake_q32(double value)
{
    return llround(ldexp(value, 32));
}

static inline int64_t fake_ns_q12(double t_s)
{
    return llround(t_s * 1e9) * 4096;
}

/* Of the parabola through three keys, in the middle; 0 at the ends. */
struct fake_parabola {
    double slope, bend;
};

static inline struct fake_parabola fake_parabola(const struct fake_key *key,
                                                 unsigned count, unsigned i)
{
    if (i == 0 || i + 1 == count)
        return (struct fake_parabola){ 0, 0 };
    const double h0 = key[i].t_s - key[i - 1].t_s;
    const double h1 = key[i + 1].t_s - key[i].t_s;
    const double d0 = (key[i].pos - key[i - 1].pos) / h0;
    const double d1 = (key[i + 1].pos - key[i].pos) / h1;

    return (struct fake_parabola){ .slope = (h1 * d0 + h0 * d1) / (h0 + h1),
                                   .bend = 2 * (d1 - d0) / (h0 + h1) };
}

static inline struct motion_state fake_state(const struct fake_key *key,
                                             unsigned count, unsigned i)
{
    const struct fake_parabola at = fake_parabola(key, count, i);

    return (struct motion_state){
        .pos_q32 = fake_q32(key[i].pos),
        .vel_q32 = fake_q32(at.slope),
        .acc_q32 = fake_q32(at.bend),
    };
}

#define FAKE_AXES 8

/* Add an axis: `quintic` or cubic through the keys, limits in units. */
static inline void fake_axis(struct job *job, const char *name,
                             const struct fake_key *key, unsigned count,
                             bool quintic, const double limit[5])
{
    if (job->move.axis == NULL) {
        job->move.axis = calloc(FAKE_AXES, sizeof *job->move.axis);
        job->rig.axis =
            memory_pool_new(&job->rig.memory, FAKE_AXES, sizeof *job->rig.axis);
        job_capacity(job, FAKE_AXES);
    }
    unsigned a = job->move.axis_count++;
    struct plan_axis *plan = &job->move.axis[a];
    struct rig_axis *rig = &job->rig.axis[job->rig.axis_count];
    job->rig_axis[a] = job->rig.axis_count++;
    snprintf(plan->name, sizeof plan->name, "%s", name);
    snprintf(rig->name, sizeof rig->name, "%s", name);
    rig->limit = (struct plan_limit){ fake_q32(limit[0]), fake_q32(limit[1]),
                                      fake_q32(limit[2]), fake_q32(limit[3]),
                                      fake_q32(limit[4]), 0 };
    rig->following_floor_q32 = fake_q32(0.5);
    plan->key = calloc(count, sizeof *plan->key);
    plan->key_count = count;
    plan->curve = quintic ? PLAN_CURVE_QUINTIC : PLAN_CURVE_CATMULL_ROM;
    struct motion_track *track = &job->track[a];
    motion_track_init(track, calloc(count, sizeof *track->segment), count,
                      fake_q32(key[0].pos));
    for (unsigned i = 0; i < count; i++) {
        struct motion_state from = fake_state(key, count, i > 0 ? i - 1 : 0);
        struct motion_state to = fake_state(key, count, i);
        plan->key[i].key.t_ns_q12 = fake_ns_q12(key[i].t_s);
        plan->key[i].key.pos_q32 = to.pos_q32;
        plan->key[i].place.line = 10 + i;
        if (i == 0)
            continue;
        int64_t dur = fake_ns_q12(key[i].t_s) - fake_ns_q12(key[i - 1].t_s);
        if (quintic)
            motion_track_append_quintic(track, dur, &from, &to);
        else
            motion_track_append_cubic(track, dur, from.vel_q32, &to);
    }
    if (track->end_ns_q12 > job->end_ns_q12)
        job->end_ns_q12 = track->end_ns_q12;
}

static inline void fake_free(struct job *job)
{
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        free(job->move.axis[i].key);
        free(job->track[i].segment);
    }
    free(job->move.axis);
    rig_free(&job->rig);
    memory_pool_free(&job->memory);
    memset(job, 0, sizeof *job);
}

/* Dolly, pan, tilt, focus over 24 s. */
static inline void fake_dolly(struct job *job)
{
    static const struct fake_key dolly[] = { { 0, 0 },     { 4, 180 },
                                             { 7.5, 900 }, { 12, 1650 },
                                             { 15, 1800 }, { 20, 2300 },
                                             { 24, 2400 } };
    static const struct fake_key pan[] = {
        { 0, -20 }, { 6, 5 }, { 13, 38 }, { 18, 12 }, { 24, -4 }
    };
    static const struct fake_key tilt[] = { { 0, 3 }, { 9, -6 }, { 24, 2 } };
    static const struct fake_key focus[] = {
        { 0, 0.1 }, { 5, 0.1 }, { 11, 0.7 }, { 16, 0.35 }, { 22, 0.8 }
    };
    memset(job, 0, sizeof *job);
    snprintf(job->move.title, sizeof job->move.title, "Kitchen reveal");
    snprintf(job->rig.title, sizeof job->rig.title, "Dolly with remote head");
    fake_axis(job, "dolly", dolly, 7, true,
              (const double[]){ -10, 2500, 300, 200, 400 });
    fake_axis(job, "pan", pan, 5, true,
              (const double[]){ -170, 170, 60, 90, 180 });
    fake_axis(job, "tilt", tilt, 3, false,
              (const double[]){ -45, 45, 2, 3, 6 });
    fake_axis(job, "focus", focus, 5, true,
              (const double[]){ 0, 1, 4, 20, 100 });
    for (unsigned a = 1; a < 3; a++)
        job->rig.axis[a].unit = UNITS_AXIS_DEG;
    job->rig.axis[3].unit = UNITS_AXIS_REV;
}

#endif

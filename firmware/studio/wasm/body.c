/* firmware/studio/wasm/body.c - what a rig looks like, in lines; see plan.h. */
#include <math.h>

#include "firmware/host/base/number.h"
#include "firmware/host/job/job_camera.h"
#include "firmware/studio/wasm/plan.h"

#define BODY_STEPS  48  /* of a rail, whatever its shape */
#define BODY_RADIUS 300 /* of the table, mm: rigs do not say how large it is */
#define BODY_METRE  1000
#define BODY_TURN   6.28318530717958647692

/* Points that are written, as long as there is room. */
struct body {
    const struct studio_plan *plan;
    struct plan_rig rig;
    struct plan_jet axis[MOTION_CARRIER_AXES_MAX];
    double *out;
    uint32_t most, count;
};

static void body_write(struct body *body, double x, double y, double z)
{
    if (body->count == body->most)
        return;
    double *point = body->out + (size_t)STUDIO_SUBJECT * body->count++;
    point[0] = x;
    point[1] = y;
    point[2] = z;
}

static void body_begin(struct body *body, enum studio_line line)
{
    body_write(body, NAN, line, 0);
}

static void body_point(struct body *body, const struct plan_jet_vec *v)
{
    body_write(body, v->x[0].p / BODY_METRE, v->x[1].p / BODY_METRE,
               v->x[2].p / BODY_METRE);
}

static void body_pivot(struct body *body)
{
    struct plan_jet_vec pivot;
    struct plan_rig_frame mount;

    plan_rig_mount(&body->rig.rig.carrier, body->axis, &pivot, &mount);
    body_point(body, &pivot);
}

/* Where an axis can take the head, the others where they are.  Both motors of a
 * bridge go together. */
static void body_rail(struct body *body, unsigned i)
{
    const struct job *job = &body->plan->job;
    const bool is_gantry = body->rig.rig.carrier.kind == &motion_carrier_gantry;
    const struct plan_jet stands[2] = { body->axis[i], body->axis[1] };

    if (!body->rig.carrier[i].is_given || (is_gantry && i == 1))
        return;
    const struct rig_axis *axis =
        &job->rig.axis[job->rig_axis[body->rig.carrier[i].axis]];
    const double low = number_double(axis->limit.pos_min_q32, 32);
    const double high = number_double(axis->limit.pos_max_q32, 32);
    body_begin(body, STUDIO_LINE_RAIL);
    for (unsigned step = 0; step <= BODY_STEPS; step++) {
        body->axis[i] = plan_jet_of(low + (high - low) * step / BODY_STEPS);
        if (is_gantry && i == 0)
            body->axis[1] = body->axis[0];
        body_pivot(body);
    }
    body->axis[1] = stands[1];
    body->axis[i] = stands[0];
}

/* A column from the ground, and the boom. */
static void body_jib(struct body *body)
{
    const struct motion_jib *jib = &body->rig.rig.carrier.as.jib;
    struct plan_jet_vec foot;

    for (unsigned k = 0; k < 3; k++)
        foot.x[k] = plan_jet_of(plan_rig_real(jib->foot.x[k]));
    body_begin(body, STUDIO_LINE_BODY);
    body_write(body, foot.x[0].p / BODY_METRE, foot.x[1].p / BODY_METRE, 0);
    body_point(body, &foot);
    body_pivot(body);
}

/* Its rim, and a spoke that turns with it. */
static void body_table(struct body *body, int64_t t_ns_q12)
{
    const struct plan_jet at =
        plan_rig_track(&body->plan->job.track[body->rig.table.axis], t_ns_q12,
                       MOTION_BAKE_LEFT);
    struct plan_jet_vec point = { { plan_jet_of(0), plan_jet_of(0),
                                    plan_jet_of(0) } };

    body_begin(body, STUDIO_LINE_BODY);
    for (unsigned step = 0; step <= BODY_STEPS + 1; step++) {
        const double turn = BODY_TURN * step / BODY_STEPS;
        const double radius = step <= BODY_STEPS ? BODY_RADIUS : 0;
        point.x[0] = plan_jet_of(radius * cos(turn));
        point.x[1] = plan_jet_of(radius * sin(turn));
        const struct plan_jet_vec in_space =
            plan_rig_on_table(&body->rig, at, point);
        body_point(body, &in_space);
    }
}

static void body_head(struct body *body, int64_t t_ns_q12)
{
    struct plan_rig_camera camera;

    plan_rig_camera_at(&body->rig, body->plan->job.track, t_ns_q12, &camera);
    body_begin(body, STUDIO_LINE_BODY);
    body_pivot(body);
    body_point(body, &camera.pupil);
}

STUDIO_EXPORT uint32_t studio_plan_body(const struct studio_plan *plan,
                                        double t_s, uint32_t most, double *out)
{
    struct body body = { .plan = plan, .out = out, .most = most };
    const int64_t t_ns_q12 = studio_time(t_s);

    if (plan->status != STATUS_OK || plan->job.rig.kinematics == NULL ||
        !job_camera_rig(&plan->job, &body.rig))
        return 0;
    for (unsigned i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        body.axis[i] =
            body.rig.carrier[i].is_given
                ? plan_rig_track(&plan->job.track[body.rig.carrier[i].axis],
                                 t_ns_q12, MOTION_BAKE_LEFT)
                : plan_jet_of(0);
    for (unsigned i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        body_rail(&body, i);
    if (body.rig.rig.carrier.kind == &motion_carrier_jib)
        body_jib(&body);
    if (body.rig.table.is_given)
        body_table(&body, t_ns_q12);
    if (body.rig.head[MOTION_HEAD_PAN].is_given)
        body_head(&body, t_ns_q12);
    return body.count;
}

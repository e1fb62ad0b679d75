/* sim/physics/bodies_contact.c - see bodies_contact.h. */
#include "sim/physics/bodies_contact.h"

#include <math.h>
#include <string.h>

#include "motion/double/double_math.h"

#define REST_ITERATIONS 500
#define REST_EXACT_M_S  1e-14 /* by which an iteration changes a speed */
#define SPHERE_INERTIA  0.4   /* of m r^2 */

struct sim_turning sim_contact_turning(const struct sim_bodies *bodies,
                                       const struct sim_contact *contact)
{
    struct sim_turning turning = { NULL, NULL, NULL };
    int index = contact->plane;

    if (contact->plane >= 0) {
        turning.point = bodies->plane[index].point_m;
        turning.axis = bodies->plane[index].axis;
    } else if (contact->box >= 0) {
        turning.point = bodies->config.box[contact->box].pivot_m;
        turning.axis = bodies->config.box[contact->box].turns;
        index = bodies->config.planes + contact->box;
    }
    if (bodies->turn_rad != NULL && turning.axis != NULL &&
        sim_dot3(turning.axis, turning.axis) > 0)
        turning.angle = &bodies->turn_rad[index];
    return turning;
}

static double sim_turning_speed(const struct sim_turning *turning, double t_s)
{
    const struct sim_signal slope = sim_signal_slope(turning->angle);

    return sim_signal_at(&slope, t_s);
}

/* Rodrigues' formula. */
static void sim_turn(const double *axis, double angle, const double *from,
                     double *to)
{
    const double cosine = double_cos(angle), sine = double_sin(angle);
    const double along = sim_dot3(axis, from) * (1 - cosine);
    double across[3];

    sim_cross3(axis, from, across);
    for (int k = 0; k < 3; k++)
        to[k] = cosine * from[k] + sine * across[k] + along * axis[k];
}

void sim_turning_vel(const struct sim_turning *turning, double t_s,
                     const double *pos, double *vel)
{
    double spin[3], arm[3];

    memset(vel, 0, 3 * sizeof *vel);
    if (turning->angle == NULL)
        return;
    const double speed = sim_turning_speed(turning, t_s);
    for (int k = 0; k < 3; k++) {
        spin[k] = speed * turning->axis[k];
        arm[k] = pos[k] - turning->point[k];
    }
    sim_cross3(spin, arm, vel);
}

/* Out of a box to a place; how far that is outside. */
static double sim_box_gap(const struct sim_box *box, const double *pos,
                          double *normal)
{
    double from[3], local[3], out[3], depth = INFINITY;
    int face = 0;

    for (int k = 0; k < 3; k++)
        from[k] = pos[k] - box->center_m[k];
    for (int k = 0; k < 3; k++) {
        local[k] = sim_dot3(from, box->axis[k]);
        out[k] = fmax(fabs(local[k]) - box->half_m[k], 0);
        if (box->half_m[k] - fabs(local[k]) < depth) {
            depth = box->half_m[k] - fabs(local[k]);
            face = k;
        }
    }
    double distance = sqrt(sim_dot3(out, out));
    if (distance <= 0) { /* inside: by its nearest face */
        out[face] = 1;
        distance = -depth;
    }
    const double size = distance > 0 ? distance : 1;
    for (int k = 0; k < 3; k++) {
        normal[k] = 0;
        for (int j = 0; j < 3; j++)
            normal[k] += copysign(out[j] / size, local[j]) * box->axis[j][k];
    }
    return distance;
}

/* The same of a box that may have turned: the place is turned back. */
static double sim_box_gap_at(const struct sim_bodies *bodies,
                             const struct sim_contact *contact, double t_s,
                             const double *pos, double *normal)
{
    const struct sim_box *const box = &bodies->config.box[contact->box];
    const struct sim_turning turning = sim_contact_turning(bodies, contact);
    double from[3], back[3], out[3];

    if (turning.angle == NULL)
        return sim_box_gap(box, pos, normal);
    const double angle = sim_signal_at(turning.angle, t_s);
    for (int k = 0; k < 3; k++)
        from[k] = pos[k] - turning.point[k];
    sim_turn(turning.axis, -angle, from, back);
    for (int k = 0; k < 3; k++)
        back[k] += turning.point[k];
    const double gap = sim_box_gap(box, back, out);
    sim_turn(turning.axis, angle, out, normal);
    return gap;
}

static void sim_plane_normal(const struct sim_bodies *bodies,
                             const struct sim_contact *contact, double t_s,
                             double *normal)
{
    const struct sim_turning turning = sim_contact_turning(bodies, contact);
    const double *const from = bodies->plane[contact->plane].normal;

    if (turning.angle == NULL)
        memcpy(normal, from, 3 * sizeof *normal);
    else
        sim_turn(turning.axis, sim_signal_at(turning.angle, t_s), from, normal);
}

void sim_contact_gap_at(const struct sim_bodies *bodies,
                        const struct sim_contact *contact, double t_s,
                        const double *a, const double *b,
                        struct sim_touch *touch)
{
    const double radius = bodies->sphere[contact->a].radius_m;
    double from[3];

    if (contact->box >= 0) {
        touch->gap_m =
            sim_box_gap_at(bodies, contact, t_s, a, touch->normal) - radius;
        return;
    }
    const double *const to =
        b != NULL ? b : bodies->plane[contact->plane].point_m;
    for (int k = 0; k < 3; k++)
        from[k] = a[k] - to[k];
    if (b == NULL) {
        sim_plane_normal(bodies, contact, t_s, touch->normal);
        touch->gap_m = sim_dot3(from, touch->normal) - radius;
        return;
    }
    const double distance = sqrt(sim_dot3(from, from));
    for (int k = 0; k < 3; k++)
        touch->normal[k] = distance > 0 ? from[k] / distance : (k == 2 ? 1 : 0);
    touch->gap_m = distance - radius - bodies->sphere[contact->b].radius_m;
}

void sim_contact_gap(const struct sim_bodies *bodies,
                     const struct sim_contact *contact, double t_s,
                     struct sim_touch *touch)
{
    sim_contact_gap_at(
        bodies, contact, t_s, bodies->sphere[contact->a].pos_m,
        contact->b >= 0 ? bodies->sphere[contact->b].pos_m : NULL, touch);
}

/* Of the surface of a plane or box where sphere a, at pos, touches it. */
static void sim_surface_speed(const struct sim_bodies *bodies,
                              const struct sim_contact *contact, double t_s,
                              const double *pos, const double *normal,
                              double *vel)
{
    const struct sim_turning turning = sim_contact_turning(bodies, contact);
    const double radius = bodies->sphere[contact->a].radius_m;
    double at[3];

    for (int k = 0; k < 3; k++)
        at[k] = pos[k] - radius * normal[k];
    sim_turning_vel(&turning, t_s, at, vel);
}

/* Speeds of the touching points with a normal that is known. */
static void sim_contact_speeds(const struct sim_bodies *bodies,
                               const struct sim_contact *contact,
                               const double *surface, struct sim_touch *touch)
{
    const struct sim_sphere *const a = &bodies->sphere[contact->a];
    double vel[3], turn[3];

    sim_cross3(a->spin_rad_s, touch->normal, turn);
    for (int k = 0; k < 3; k++)
        vel[k] = a->vel_m_s[k] - a->radius_m * turn[k] - surface[k];
    if (contact->b >= 0) {
        const struct sim_sphere *const b = &bodies->sphere[contact->b];
        sim_cross3(b->spin_rad_s, touch->normal, turn);
        for (int k = 0; k < 3; k++)
            vel[k] -= b->vel_m_s[k] + b->radius_m * turn[k];
    }
    touch->speed_m_s = sim_dot3(vel, touch->normal);
    for (int k = 0; k < 3; k++)
        touch->slip_m_s[k] = vel[k] - touch->speed_m_s * touch->normal[k];
}

void sim_contact_touch(const struct sim_bodies *bodies,
                       const struct sim_contact *contact, double t_s,
                       struct sim_touch *touch)
{
    double surface[3];

    sim_contact_gap(bodies, contact, t_s, touch);
    sim_surface_speed(bodies, contact, t_s, bodies->sphere[contact->a].pos_m,
                      touch->normal, surface);
    sim_contact_speeds(bodies, contact, surface, touch);
}

static void sim_sphere_push(struct sim_sphere *sphere, const double *normal,
                            const double *impulse, double sign)
{
    double turn[3];

    sim_cross3(normal, impulse, turn);
    for (int k = 0; k < 3; k++) {
        sphere->vel_m_s[k] += sign * impulse[k] / sphere->mass_kg;
        sphere->spin_rad_s[k] -=
            turn[k] / (SPHERE_INERTIA * sphere->mass_kg * sphere->radius_m);
    }
}

void sim_contact_push(struct sim_bodies *bodies,
                      const struct sim_contact *contact, const double *normal,
                      const double *impulse_n_s)
{
    sim_sphere_push(&bodies->sphere[contact->a], normal, impulse_n_s, 1);
    if (contact->b >= 0)
        sim_sphere_push(&bodies->sphere[contact->b], normal, impulse_n_s, -1);
}

double sim_contact_mass(const struct sim_bodies *bodies,
                        const struct sim_contact *contact)
{
    double inverse = 1 / bodies->sphere[contact->a].mass_kg;

    if (contact->b >= 0)
        inverse += 1 / bodies->sphere[contact->b].mass_kg;
    return 1 / inverse;
}

double sim_contact_slip_mass(const struct sim_bodies *bodies,
                             const struct sim_contact *contact)
{
    return sim_contact_mass(bodies, contact) / (1 + 1 / SPHERE_INERTIA);
}

/* Change the impulses of a contact so that it neither approaches nor, within
 * friction, slips; the larger change of speed. */
static double sim_contact_relax(struct sim_bodies *bodies,
                                struct sim_contact *contact,
                                const double *surface, struct sim_touch *touch)
{
    const double mass = sim_contact_mass(bodies, contact);
    const double slip_mass = sim_contact_slip_mass(bodies, contact);
    double impulse[3], wanted[3], size = 0, change;

    sim_contact_speeds(bodies, contact, surface, touch);
    const double normal_n_s =
        fmax(0, contact->normal_n_s - mass * touch->speed_m_s);
    const double most = bodies->config.friction * normal_n_s;
    for (int k = 0; k < 3; k++)
        wanted[k] = contact->tangent_n_s[k] - slip_mass * touch->slip_m_s[k];
    size = sqrt(sim_dot3(wanted, wanted));
    contact->slips = size > most;
    for (int k = 0; k < 3; k++) {
        if (size > most)
            wanted[k] *= most / size;
        impulse[k] = wanted[k] - contact->tangent_n_s[k] +
                     (normal_n_s - contact->normal_n_s) * touch->push[k];
        contact->tangent_n_s[k] = wanted[k];
    }
    contact->normal_n_s = normal_n_s;
    change = sqrt(sim_dot3(impulse, impulse)) / mass;
    if (change > 0)
        sim_contact_push(bodies, contact, touch->push, impulse);
    return change;
}

/* When in the substep the slip ended: friction was full until then. */
static void sim_contact_note(const struct sim_bodies *bodies,
                             struct sim_contact *contact, double begin_s,
                             double step_s)
{
    const double most = bodies->config.friction * contact->normal_n_s;
    const double size =
        sqrt(sim_dot3(contact->tangent_n_s, contact->tangent_n_s));

    contact->force_n = contact->normal_n_s / step_s;
    if (contact->slipped && !contact->slips)
        contact->stuck_s = begin_s + (most > 0 ? step_s * size / most : 0);
}

static void sim_contact_start(struct sim_bodies *bodies,
                              struct sim_contact *contact,
                              const struct sim_touch *touch)
{
    double impulse[3];
    /* Tangential impulses stay so when the normal has turned. */
    const double normal = sim_dot3(contact->tangent_n_s, touch->push);

    for (int k = 0; k < 3; k++) {
        contact->tangent_n_s[k] -= normal * touch->push[k];
        impulse[k] =
            contact->tangent_n_s[k] + contact->normal_n_s * touch->push[k];
    }
    sim_contact_push(bodies, contact, touch->push, impulse);
}

/* Where a sphere comes with the speed of the substep's begin. */
static void sim_sphere_ahead(const struct sim_sphere *sphere, double s,
                             double *pos)
{
    for (int k = 0; k < 3; k++) /* acc: that speed, sim_bodies_accelerate */
        pos[k] = sphere->pos_m[k] + s * sphere->acc_m_s2[k];
}

/* Where sphere a comes, to a, and the pair's geometry there. */
static void sim_contact_ahead(const struct sim_bodies *bodies,
                              const struct sim_contact *contact, double t_s,
                              double s, double *a, struct sim_touch *touch)
{
    double b[3];

    sim_sphere_ahead(&bodies->sphere[contact->a], s, a);
    if (contact->b >= 0)
        sim_sphere_ahead(&bodies->sphere[contact->b], s, b);
    sim_contact_gap_at(bodies, contact, t_s + s, a, contact->b >= 0 ? b : NULL,
                       touch);
}

/* The geometry of a contact at the end of the substep.  What is round turns its
 * normal meanwhile: speeds end across that of the end, and impulses along that of
 * the middle do no work on what moves around it. */
static void sim_contact_end(struct sim_bodies *bodies,
                            const struct sim_contact *contact, double begin_s,
                            double step_s, double *surface,
                            struct sim_touch *touch)
{
    struct sim_touch middle;
    double at[3];

    if (contact->plane >= 0) {
        const double end_s = begin_s + step_s;
        sim_contact_gap(bodies, contact, end_s, touch);
        memcpy(touch->push, touch->normal, sizeof touch->push);
        sim_surface_speed(bodies, contact, end_s,
                          bodies->sphere[contact->a].pos_m, touch->normal,
                          surface);
        return;
    }
    sim_contact_ahead(bodies, contact, begin_s, 0.5 * step_s, at, &middle);
    sim_contact_ahead(bodies, contact, begin_s, step_s, at, touch);
    memcpy(touch->push, middle.normal, sizeof touch->push);
    sim_surface_speed(bodies, contact, begin_s + step_s, at, touch->normal,
                      surface);
}

void sim_contact_rest(struct sim_bodies *bodies, double begin_s, double step_s)
{
    double change = 1, surface[3];
    struct sim_touch touch;

    for (int c = 0; c < bodies->contacts; c++) {
        struct sim_contact *const contact = &bodies->contact[c];
        if (!contact->rests)
            continue;
        sim_contact_end(bodies, contact, begin_s, step_s, surface, &touch);
        sim_contact_start(bodies, contact, &touch);
        contact->slipped = contact->slips;
    }
    for (int i = 0; i < REST_ITERATIONS && change > REST_EXACT_M_S; i++) {
        change = 0;
        for (int c = 0; c < bodies->contacts; c++) {
            struct sim_contact *const contact = &bodies->contact[c];
            if (!contact->rests)
                continue;
            sim_contact_end(bodies, contact, begin_s, step_s, surface, &touch);
            change = fmax(change,
                          sim_contact_relax(bodies, contact, surface, &touch));
        }
    }
    for (int c = 0; c < bodies->contacts; c++) {
        if (bodies->contact[c].rests)
            sim_contact_note(bodies, &bodies->contact[c],
                             bodies->begin_s + begin_s, step_s);
    }
}

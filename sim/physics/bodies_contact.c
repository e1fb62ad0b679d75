/* sim/physics/bodies_contact.c - see bodies_contact.h. */
#include "sim/physics/bodies_contact.h"

#include <math.h>
#include <string.h>

#include "motion/double/double_math.h"

#define REST_ITERATIONS 500
#define REST_EXACT_M_S  1e-14 /* by which an iteration changes a speed */
#define ADVANCE_MAX     1000
#define SPHERE_INERTIA  0.4 /* of m r^2 */

static double sim_plane_angle(const struct sim_bodies *bodies, int plane,
                              double t_s, double *speed)
{
    *speed = 0;
    if (bodies->turn_rad == NULL)
        return 0;
    const struct sim_signal slope = sim_signal_slope(&bodies->turn_rad[plane]);
    *speed = sim_signal_at(&slope, t_s);
    return sim_signal_at(&bodies->turn_rad[plane], t_s);
}

/* The normal at t_s: turned about the axis, Rodrigues' formula. */
static void sim_plane_normal(const struct sim_bodies *bodies, int plane,
                             double t_s, double *normal, double *spin)
{
    const struct sim_plane *const of = &bodies->plane[plane];
    double speed, across[3];

    memcpy(normal, of->normal, 3 * sizeof *normal);
    memset(spin, 0, 3 * sizeof *spin);
    if (sim_dot3(of->axis, of->axis) <= 0)
        return;
    const double angle = sim_plane_angle(bodies, plane, t_s, &speed);
    const double cosine = double_cos(angle), sine = double_sin(angle);
    const double along = sim_dot3(of->axis, of->normal) * (1 - cosine);
    sim_cross3(of->axis, of->normal, across);
    for (int k = 0; k < 3; k++) {
        normal[k] =
            cosine * of->normal[k] + sine * across[k] + along * of->axis[k];
        spin[k] = speed * of->axis[k];
    }
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

/* With the spheres at these places; b: NULL when it is no sphere. */
static void sim_contact_gap_at(const struct sim_bodies *bodies,
                               const struct sim_contact *contact, double t_s,
                               const double *a, const double *b,
                               struct sim_touch *touch)
{
    const double radius = bodies->sphere[contact->a].radius_m;
    double from[3], spin[3];

    if (contact->box >= 0) {
        touch->gap_m =
            sim_box_gap(&bodies->config.box[contact->box], a, touch->normal) -
            radius;
        return;
    }
    const double *const to =
        b != NULL ? b : bodies->plane[contact->plane].point_m;
    for (int k = 0; k < 3; k++)
        from[k] = a[k] - to[k];
    if (b == NULL) {
        sim_plane_normal(bodies, contact->plane, t_s, touch->normal, spin);
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

/* Of a plane's surface where sphere a touches it. */
static void sim_plane_speed(const struct sim_bodies *bodies,
                            const struct sim_contact *contact, double t_s,
                            double *vel)
{
    const struct sim_sphere *const a = &bodies->sphere[contact->a];
    const struct sim_plane *const plane = &bodies->plane[contact->plane];
    double normal[3], spin[3], arm[3];

    sim_plane_normal(bodies, contact->plane, t_s, normal, spin);
    for (int k = 0; k < 3; k++)
        arm[k] = a->pos_m[k] - a->radius_m * normal[k] - plane->point_m[k];
    sim_cross3(spin, arm, vel);
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
    double surface[3] = { 0 };

    sim_contact_gap(bodies, contact, t_s, touch);
    if (contact->plane >= 0)
        sim_plane_speed(bodies, contact, t_s, surface);
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

static void sim_contact_ahead(const struct sim_bodies *bodies,
                              const struct sim_contact *contact, double t_s,
                              double s, struct sim_touch *touch)
{
    double a[3], b[3];

    sim_sphere_ahead(&bodies->sphere[contact->a], s, a);
    if (contact->b >= 0)
        sim_sphere_ahead(&bodies->sphere[contact->b], s, b);
    sim_contact_gap_at(bodies, contact, t_s, a, contact->b >= 0 ? b : NULL,
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

    memset(surface, 0, 3 * sizeof *surface);
    if (contact->plane >= 0) {
        sim_contact_gap(bodies, contact, begin_s + step_s, touch);
        memcpy(touch->push, touch->normal, sizeof touch->push);
        if (bodies->turn_rad != NULL)
            sim_plane_speed(bodies, contact, begin_s + step_s, surface);
        return;
    }
    sim_contact_ahead(bodies, contact, begin_s, 0.5 * step_s, &middle);
    sim_contact_ahead(bodies, contact, begin_s, step_s, touch);
    memcpy(touch->push, middle.normal, sizeof touch->push);
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

/* The root of gap + speed s + acc/2 s^2 at which it falls; INFINITY when there
 * is none.  gap >= 0. */
static double sim_contact_fall(double gap, double speed, double acc)
{
    const double square = speed * speed - 2 * acc * gap;

    if (square < 0 || (speed >= 0 && acc >= 0))
        return INFINITY;
    if (speed < 0)
        return 2 * gap / (sqrt(square) - speed);
    return (speed + sqrt(square)) / -acc;
}

static void sim_sphere_later(const struct sim_sphere *sphere, double s,
                             double *pos)
{
    for (int k = 0; k < 3; k++)
        pos[k] = sphere->pos_m[k] +
                 s * (sphere->vel_m_s[k] + 0.5 * s * sphere->acc_m_s2[k]);
}

/* Gap of a pair s later, on the parabolas. */
static double sim_contact_later(const struct sim_bodies *bodies,
                                const struct sim_contact *contact, double t_s,
                                double s, struct sim_touch *touch)
{
    double a[3], b[3];

    sim_sphere_later(&bodies->sphere[contact->a], s, a);
    if (contact->b >= 0)
        sim_sphere_later(&bodies->sphere[contact->b], s, b);
    sim_contact_gap_at(bodies, contact, t_s + s, a, contact->b >= 0 ? b : NULL,
                       touch);
    return touch->gap_m;
}

/* A plane that turns: where the gap at the end is negative, by halving. */
static double sim_contact_meet_turning(const struct sim_bodies *bodies,
                                       const struct sim_contact *contact,
                                       double t_s, double step_s)
{
    struct sim_touch touch;
    double low = 0, high = step_s;

    if (sim_contact_later(bodies, contact, t_s, step_s, &touch) >= 0)
        return INFINITY;
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (low + high);
        if (sim_contact_later(bodies, contact, t_s, middle, &touch) < 0)
            high = middle;
        else
            low = middle;
    }
    return high;
}

/* By advancing no further than the pair can approach: vel, acc are a's against
 * what it meets. */
static double sim_contact_advance(const struct sim_bodies *bodies,
                                  const struct sim_contact *contact, double t_s,
                                  double step_s, const double *vel,
                                  const double *acc)
{
    const double most =
        sqrt(sim_dot3(vel, vel)) + step_s * sqrt(sim_dot3(acc, acc));
    struct sim_touch touch;
    double s = 0;

    for (int i = 0; i < ADVANCE_MAX && s < step_s; i++) {
        const double gap = sim_contact_later(bodies, contact, t_s, s, &touch);
        if (gap > most * (step_s - s))
            return INFINITY;
        if (gap >= 0.1 * SIM_BODIES_TOUCH_M)
            s += gap / most;
        else if (sim_dot3(touch.normal, vel) + s * sim_dot3(touch.normal, acc) <
                 0)
            return s;
        else /* apart from a touch: not at once together again */
            s += step_s / ADVANCE_MAX;
    }
    return s < step_s ? s : INFINITY;
}

/* Two spheres: a quadratic when both accelerate alike. */
static double sim_contact_meet_spheres(const struct sim_bodies *bodies,
                                       const struct sim_contact *contact,
                                       double t_s, double step_s)
{
    const struct sim_sphere *const a = &bodies->sphere[contact->a];
    const struct sim_sphere *const b = &bodies->sphere[contact->b];
    const double reach = a->radius_m + b->radius_m;
    double from[3], vel[3], acc[3];

    for (int k = 0; k < 3; k++) {
        from[k] = a->pos_m[k] - b->pos_m[k];
        vel[k] = a->vel_m_s[k] - b->vel_m_s[k];
        acc[k] = a->acc_m_s2[k] - b->acc_m_s2[k];
    }
    if (sim_dot3(acc, acc) > 1e-18 * (1 + sim_dot3(b->acc_m_s2, b->acc_m_s2)))
        return sim_contact_advance(bodies, contact, t_s, step_s, vel, acc);
    const double beyond = fmax(0, sim_dot3(from, from) - reach * reach);
    return sim_contact_fall(beyond, 2 * sim_dot3(from, vel),
                            2 * sim_dot3(vel, vel));
}

static double sim_contact_meet(const struct sim_bodies *bodies,
                               const struct sim_contact *contact, double t_s,
                               double step_s)
{
    const struct sim_sphere *const a = &bodies->sphere[contact->a];
    struct sim_touch touch;

    if (contact->b >= 0)
        return sim_contact_meet_spheres(bodies, contact, t_s, step_s);
    if (contact->box >= 0)
        return sim_contact_advance(bodies, contact, t_s, step_s, a->vel_m_s,
                                   a->acc_m_s2);
    const double *const axis = bodies->plane[contact->plane].axis;
    if (bodies->turn_rad != NULL && sim_dot3(axis, axis) > 0)
        return sim_contact_meet_turning(bodies, contact, t_s, step_s);
    sim_contact_gap(bodies, contact, t_s, &touch);
    return sim_contact_fall(fmax(0, touch.gap_m),
                            sim_dot3(a->vel_m_s, touch.normal),
                            sim_dot3(a->acc_m_s2, touch.normal));
}

double sim_contact_next(const struct sim_bodies *bodies, double t_s,
                        double step_s)
{
    double next_s = step_s;

    for (int c = 0; c < bodies->contacts; c++) {
        if (!bodies->contact[c].rests)
            next_s = fmin(next_s, sim_contact_meet(bodies, &bodies->contact[c],
                                                   t_s, next_s));
    }
    return next_s;
}

/* sim/physics/bodies.c - see bodies.h. */
#include "sim/physics/bodies.h"

#include <math.h>
#include <string.h>

#include "motion/core/err.h"
#include "sim/physics/bodies_contact.h"

#define TOUCH_SWEEPS 200
#define CORRECT_M    1e-10

static bool sim_is_unit(const double *axis)
{
    return fabs(sim_dot3(axis, axis) - 1) < 1e-6;
}

static bool sim_box_is_legal(const struct sim_box *box)
{
    bool legal =
        isfinite(sim_dot3(box->center_m, box->center_m)) &&
        isfinite(sim_dot3(box->half_m, box->half_m)) &&
        isfinite(sim_dot3(box->pivot_m, box->pivot_m)) &&
        (sim_dot3(box->turns, box->turns) == 0 || sim_is_unit(box->turns));

    for (int k = 0; k < 3; k++)
        legal = legal && box->half_m[k] > 0 && sim_is_unit(box->axis[k]) &&
                fabs(sim_dot3(box->axis[k], box->axis[(k + 1) % 3])) < 1e-6;
    return legal;
}

static bool sim_bodies_is_legal(const struct sim_bodies_config *config,
                                const struct sim_sphere *sphere,
                                const struct sim_plane *plane)
{
    if (config->spheres < 1 || config->spheres > SIM_BODIES_SPHERES ||
        config->planes < 0 || config->planes > SIM_BODIES_PLANES ||
        config->boxes < 0 || config->boxes > SIM_BODIES_BOXES ||
        !(config->restitution >= 0 && config->restitution <= 1) ||
        !(isfinite(config->friction) && config->friction >= 0) ||
        !isfinite(sim_dot3(config->gravity_m_s2, config->gravity_m_s2)))
        return false;
    for (int i = 0; i < config->spheres; i++) {
        if (!(isfinite(sphere[i].mass_kg) && sphere[i].mass_kg > 0 &&
              isfinite(sphere[i].radius_m) && sphere[i].radius_m > 0))
            return false;
    }
    for (int i = 0; i < config->planes; i++) {
        if (!isfinite(sim_dot3(plane[i].point_m, plane[i].point_m)) ||
            !sim_is_unit(plane[i].normal) ||
            (sim_dot3(plane[i].axis, plane[i].axis) != 0 &&
             !sim_is_unit(plane[i].axis)))
            return false;
    }
    for (int i = 0; i < config->boxes; i++) {
        if (!sim_box_is_legal(&config->box[i]))
            return false;
    }
    return true;
}

int sim_bodies_init(struct sim_bodies *bodies,
                    const struct sim_bodies_config *config,
                    struct sim_sphere *sphere, const struct sim_plane *plane,
                    struct sim_contact *contact)
{
    if (!sim_bodies_is_legal(config, sphere, plane))
        return MOTION_E_ARG;
    *bodies = (struct sim_bodies){
        .config = *config, .sphere = sphere, .plane = plane, .contact = contact
    };
    for (int a = 0; a < config->spheres; a++) {
        for (int p = 0; p < config->planes; p++)
            contact[bodies->contacts++] =
                (struct sim_contact){ .a = a, .b = -1, .plane = p, .box = -1 };
        for (int x = 0; x < config->boxes; x++)
            contact[bodies->contacts++] =
                (struct sim_contact){ .a = a, .b = -1, .plane = -1, .box = x };
        for (int b = 0; b < a; b++)
            contact[bodies->contacts++] =
                (struct sim_contact){ .a = a, .b = b, .plane = -1, .box = -1 };
    }
    return MOTION_OK;
}

static void sim_bodies_impact(struct sim_bodies *bodies, int at, double t_s,
                              const struct sim_touch *touch)
{
    const struct sim_contact *const contact = &bodies->contact[at];
    const double approach = -touch->speed_m_s;
    const bool bounces = approach > SIM_BODIES_REST_M_S;
    const double restitution = bounces ? bodies->config.restitution : 0;
    const double normal_n_s =
        (1 + restitution) * approach * sim_contact_mass(bodies, contact);
    const double slip = sqrt(sim_dot3(touch->slip_m_s, touch->slip_m_s));
    const double tangent_n_s =
        fmin(bodies->config.friction * normal_n_s,
             slip * sim_contact_slip_mass(bodies, contact));
    double impulse[3];

    for (int k = 0; k < 3; k++)
        impulse[k] = normal_n_s * touch->normal[k] -
                     (slip > 0 ? tangent_n_s * (touch->slip_m_s[k] / slip) : 0);
    sim_contact_push(bodies, contact, touch->normal, impulse);
    if (!bounces)
        return;
    if (bodies->impacts_count < bodies->impacts_max)
        bodies->impacts[bodies->impacts_count] =
            (struct sim_impact){ bodies->begin_s + t_s, at, approach };
    bodies->impacts_count++;
}

static bool sim_bodies_sweep(struct sim_bodies *bodies, double t_s)
{
    struct sim_touch touch;
    bool any = false;

    for (int c = 0; c < bodies->contacts; c++) {
        sim_contact_touch(bodies, &bodies->contact[c], t_s, &touch);
        if (touch.gap_m > SIM_BODIES_TOUCH_M ||
            touch.speed_m_s >= -SIM_BODIES_APPROACH_M_S)
            continue;
        sim_bodies_impact(bodies, c, t_s, &touch);
        any = true;
    }
    return any;
}

/* Impacts until none is due, then which contacts rest. */
static void sim_bodies_meet(struct sim_bodies *bodies, double t_s)
{
    struct sim_touch touch;

    for (int i = 0; i < TOUCH_SWEEPS && sim_bodies_sweep(bodies, t_s); i++)
        continue;
    for (int c = 0; c < bodies->contacts; c++) {
        struct sim_contact *const contact = &bodies->contact[c];

        sim_contact_touch(bodies, contact, t_s, &touch);
        contact->rests = touch.gap_m <= SIM_BODIES_NEAR_M &&
                         touch.speed_m_s <= SIM_BODIES_APART_M_S &&
                         (touch.gap_m <= SIM_BODIES_TOUCH_M ||
                          touch.speed_m_s >= -SIM_BODIES_REST_M_S);
        if (!contact->rests) {
            contact->normal_n_s = contact->force_n = 0;
            contact->slips = false;
            memset(contact->tangent_n_s, 0, sizeof contact->tangent_n_s);
        }
    }
}

/* Accelerations over the substep, from what the contacts that rest leave of
 * gravity; speeds stay those of its begin. */
static void sim_bodies_accelerate(struct sim_bodies *bodies, double t_s,
                                  double step_s)
{
    for (int i = 0; i < bodies->config.spheres; i++) {
        struct sim_sphere *const sphere = &bodies->sphere[i];

        memcpy(sphere->acc_m_s2, sphere->vel_m_s, sizeof sphere->vel_m_s);
        memcpy(sphere->spin_acc_rad_s2, sphere->spin_rad_s,
               sizeof sphere->spin_rad_s);
        for (int k = 0; k < 3; k++)
            sphere->vel_m_s[k] += step_s * bodies->config.gravity_m_s2[k];
    }
    sim_contact_rest(bodies, t_s, step_s);
    for (int i = 0; i < bodies->config.spheres; i++) {
        struct sim_sphere *const sphere = &bodies->sphere[i];

        for (int k = 0; k < 3; k++) {
            const double vel = sphere->acc_m_s2[k];
            const double spin = sphere->spin_acc_rad_s2[k];
            sphere->acc_m_s2[k] = (sphere->vel_m_s[k] - vel) / step_s;
            sphere->spin_acc_rad_s2[k] =
                (sphere->spin_rad_s[k] - spin) / step_s;
            sphere->vel_m_s[k] = vel;
            sphere->spin_rad_s[k] = spin;
        }
    }
}

static void sim_bodies_fly(struct sim_bodies *bodies, double s)
{
    for (int i = 0; i < bodies->config.spheres; i++) {
        struct sim_sphere *const sphere = &bodies->sphere[i];

        for (int k = 0; k < 3; k++) {
            sphere->pos_m[k] +=
                s * (sphere->vel_m_s[k] + 0.5 * s * sphere->acc_m_s2[k]);
            sphere->vel_m_s[k] += s * sphere->acc_m_s2[k];
            sphere->spin_rad_s[k] += s * sphere->spin_acc_rad_s2[k];
        }
    }
}

/* What rests stays in touch: a plane that turns leaves a gap of the second
 * order, a slow landing a small depth. */
static void sim_bodies_correct(struct sim_bodies *bodies, double t_s)
{
    struct sim_touch touch;

    for (int c = 0; c < bodies->contacts; c++) {
        const struct sim_contact *const contact = &bodies->contact[c];

        if (!contact->rests || contact->normal_n_s <= 0)
            continue;
        sim_contact_gap(bodies, contact, t_s, &touch);
        if (fabs(touch.gap_m) < CORRECT_M || touch.gap_m > SIM_BODIES_NEAR_M)
            continue;
        const double mass = sim_contact_mass(bodies, contact);
        struct sim_sphere *const a = &bodies->sphere[contact->a];
        struct sim_sphere *const b =
            contact->b >= 0 ? &bodies->sphere[contact->b] : NULL;
        for (int k = 0; k < 3; k++) {
            const double by = touch.gap_m * mass * touch.normal[k];
            a->pos_m[k] -= by / a->mass_kg;
            if (b != NULL)
                b->pos_m[k] += by / b->mass_kg;
        }
    }
}

int sim_bodies_step(struct sim_bodies *bodies, double begin_s, double step_s,
                    const struct sim_signal *turn_rad)
{
    const double count = ceil(step_s / SIM_BODIES_SUBSTEP_S - 1e-9);
    const double substep_s = step_s / (count > 1 ? count : 1);
    double t_s = 0;

    if (!(step_s > 0) || !isfinite(step_s))
        return MOTION_E_ARG;
    bodies->begin_s = begin_s;
    bodies->turn_rad = turn_rad;
    for (int rounds = 0; t_s < step_s; rounds++) {
        const double left_s = step_s - t_s;
        const bool is_last = left_s < substep_s * (1 + 1e-9);
        const double whole_s = is_last ? left_s : substep_s;

        if (rounds > SIM_BODIES_EVENTS + count)
            return MOTION_E_RANGE;
        sim_bodies_meet(bodies, t_s);
        sim_bodies_accelerate(bodies, t_s, whole_s);
        const double this_s = sim_contact_next(bodies, t_s, whole_s);
        sim_bodies_fly(bodies, this_s);
        t_s = this_s == left_s ? step_s : t_s + this_s;
        sim_bodies_correct(bodies, t_s);
    }
    sim_bodies_meet(bodies, step_s);
    return MOTION_OK;
}

void sim_bodies_angular_momentum(const struct sim_bodies *bodies,
                                 double *angular_kg_m2_s)
{
    double moment[3];

    for (int k = 0; k < 3; k++)
        angular_kg_m2_s[k] = 0;
    for (int i = 0; i < bodies->config.spheres; i++) {
        const struct sim_sphere *const of = &bodies->sphere[i];
        sim_cross3(of->pos_m, of->vel_m_s, moment);
        for (int k = 0; k < 3; k++)
            angular_kg_m2_s[k] +=
                of->mass_kg * (moment[k] + 0.4 * of->radius_m * of->radius_m *
                                               of->spin_rad_s[k]);
    }
}

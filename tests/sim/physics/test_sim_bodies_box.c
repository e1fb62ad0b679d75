/* tests/sim/physics/test_sim_bodies_box.c - spheres against the faces, edges and
 * corners of boxes, by closed forms. */
#include "motion/core/err.h"
#include "sim/physics/bodies.h"
#include "tests/sim/oracle.h"
#include "tests/sim/physics/bodies_room.h"

#define BALLS 8
#define BOXES 4
#define G     9.80665

static struct sim_sphere sphere[BALLS];
static struct sim_plane plane[6];
static struct sim_box box[BOXES];
static struct sim_contact contact[SIM_BODIES_CONTACTS(BALLS, 6 + BOXES)];
static struct sim_impact impacts[100];

static void begin(struct sim_bodies *bodies,
                  const struct sim_bodies_config *config)
{
    assert_int_equal(sim_bodies_init(bodies, config, sphere, plane, contact),
                     MOTION_OK);
    bodies->impacts = impacts;
    bodies->impacts_max = 100;
}

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void unit(double *v)
{
    const double size = sqrt(dot(v, v));
    for (int k = 0; k < 3; k++)
        v[k] /= size;
}

/* Of random size, turned at random: Gram and Schmidt. */
static void random_box(struct sim_box *to)
{
    for (int k = 0; k < 3; k++) {
        to->center_m[k] = physics_random(-0.2, 0.2);
        to->half_m[k] = physics_random(0.02, 0.2);
        for (int j = 0; j < 3; j++)
            to->axis[k][j] = physics_random(-1, 1) + (j == k ? 2 : 0);
        for (int before = 0; before < k; before++) {
            const double part = dot(to->axis[k], to->axis[before]);
            for (int j = 0; j < 3; j++)
                to->axis[k][j] -= part * to->axis[before][j];
        }
        unit(to->axis[k]);
    }
}

static void straight_box(struct sim_box *to, double x, double z_top,
                         double half)
{
    memset(to, 0, sizeof *to);
    for (int k = 0; k < 3; k++) {
        to->axis[k][k] = 1;
        to->half_m[k] = half;
    }
    to->center_m[0] = x;
    to->center_m[2] = z_top - half;
}

/* A place on a face (0 signs), an edge (1), a corner (2), and a normal that is
 * the sphere's there: in no direction that leads back over the box. */
static void random_touch(const struct sim_box *of, int feature, double *at,
                         double *normal)
{
    double place[3], out[3];
    const int first = (int)physics_random(0, 3);

    for (int i = 0; i < 3; i++) {
        const int k = (first + i) % 3;
        const double sign = physics_random(-1, 1) < 0 ? -1 : 1;
        const bool beyond = i <= feature;
        place[k] = of->half_m[k] * (beyond ? sign : physics_random(-0.9, 0.9));
        out[k] = beyond ? sign * physics_random(0.1, 1) : 0;
    }
    unit(out);
    for (int k = 0; k < 3; k++) {
        at[k] = of->center_m[k];
        normal[k] = 0;
        for (int j = 0; j < 3; j++) {
            at[k] += place[j] * of->axis[j][k];
            normal[k] += out[j] * of->axis[j][k];
        }
    }
}

/* The sphere and a box make a convex body for the centre: it is entered where its
 * path first meets the normal from outside.  Up to 300 m/s: 75 mm a substep. */
static void a_bounce_is_about_the_normal_of_face_edge_or_corner(void **state)
{
    (void)state;
    for (int i = 0; i < 600; i++) {
        const double e = physics_random(0, 1), t = physics_random(0.001, 0.02);
        const double speed =
            i % 2 == 0 ? physics_random(1, 5) : physics_random(50, 300);
        const struct sim_bodies_config config = {
            .spheres = 1, .boxes = 1, .box = box, .restitution = e
        };
        struct sim_bodies bodies;
        double at[3], normal[3], vel[3], into;

        random_box(&box[0]);
        random_touch(&box[0], i % 3, at, normal);
        for (int k = 0; k < 3; k++)
            vel[k] = physics_random(-1, 1) - 2 * normal[k];
        unit(vel);
        into = speed * dot(vel, normal);
        sphere[0] =
            (struct sim_sphere){ .mass_kg = physics_random(0.1, 2),
                                 .radius_m = physics_random(0.002, 0.1) };
        for (int k = 0; k < 3; k++) {
            vel[k] *= speed;
            sphere[0].vel_m_s[k] = vel[k];
            sphere[0].pos_m[k] =
                at[k] + sphere[0].radius_m * normal[k] - t * vel[k];
        }
        begin(&bodies, &config);
        for (int tick = 0; tick < 25; tick++)
            assert_int_equal(sim_bodies_step(&bodies, tick * 1e-3, 1e-3, NULL),
                             MOTION_OK);
        assert_int_equal(bodies.impacts_count, 1);
        physics_near("time", impacts[0].t_s, t, 1e-8);
        for (int k = 0; k < 3; k++) {
            const double after = vel[k] - (1 + e) * into * normal[k];
            physics_near("speed", sphere[0].vel_m_s[k], after, 1e-6 * speed);
            physics_near("place", sphere[0].pos_m[k],
                         at[k] + sphere[0].radius_m * normal[k] +
                             (0.025 - t) * after,
                         1e-7 * speed);
        }
    }
}

/* About the edge it turns on a circle until nothing presses it: v^2 = g r cos, and
 * v^2 = v0^2 + 2 g r (1 - cos) / (1 + part), part 2/5 where it rolls and 0 where
 * it slides.  Then its speed along stays. */
static void a_sphere_leaves_an_edge_where_nothing_presses_it(void **state)
{
    (void)state;
    for (int i = 0; i < 40; i++) {
        const bool rolls = i % 2 == 0;
        const double r = physics_random(0.02, 0.08);
        const double v0 = sqrt(G * r) * physics_random(0.1, 0.6);
        const double part = rolls ? 1.4 : 1;
        const double cosine = (2 / part + v0 * v0 / (G * r)) / (1 + 2 / part);
        const struct sim_bodies_config config = {
            .spheres = 1,
            .boxes = 1,
            .box = box,
            .friction = rolls ? 1000 : 0,
            .gravity_m_s2 = { 0, 0, -G },
        };
        struct sim_bodies bodies;
        double energy;

        straight_box(&box[0], -1, 0, 1);
        sphere[0] = (struct sim_sphere){
            .mass_kg = 0.3,
            .radius_m = r,
            .pos_m = { -0.02, 0.1, r },
            .vel_m_s = { v0, 0, 0 },
            .spin_rad_s = { 0, rolls ? v0 / r : 0, 0 },
        };
        begin(&bodies, &config);
        energy = oracle_bodies_energy_j(&bodies);
        for (int tick = 0; tick < 5000 && sphere[0].pos_m[2] > -0.1; tick++) {
            assert_int_equal(sim_bodies_step(&bodies, tick * 1e-3, 1e-3, NULL),
                             MOTION_OK);
            if (!(oracle_bodies_energy_j(&bodies) <=
                  energy + 1e-6 * 0.3 * G * r))
                fail_msg("energy rises by %g",
                         oracle_bodies_energy_j(&bodies) - energy);
        }
        physics_near("speed along", sphere[0].vel_m_s[0],
                     sqrt(G * r * cosine) * cosine, 2e-3 * sqrt(G * r));
        physics_near("energy", oracle_bodies_energy_j(&bodies), energy,
                     2e-3 * 0.3 * G * r);
        physics_near("aside", sphere[0].pos_m[1], 0.1, 1e-12);
    }
}

/* On a face and in the groove of two boxes, without friction. */
static void what_rests_on_boxes_stays(void **state)
{
    const struct sim_bodies_config config = {
        .spheres = 2, .boxes = 3, .box = box, .gravity_m_s2 = { 0, 0, -G }
    };
    const double r = 0.05, gap = 0.03;
    struct sim_bodies bodies;
    double from[2][3];

    (void)state;
    straight_box(&box[0], 0.5, 0, 0.1);
    straight_box(&box[1], -0.1 - gap, 0, 0.1);
    straight_box(&box[2], 0.1 + gap, 0, 0.1);
    for (int i = 0; i < 2; i++)
        sphere[i] = (struct sim_sphere){ .mass_kg = 0.4, .radius_m = r };
    sphere[0].pos_m[0] = 0.55;
    sphere[0].pos_m[2] = r;
    sphere[1].pos_m[2] = sqrt(r * r - gap * gap);
    for (int i = 0; i < 2; i++)
        memcpy(from[i], sphere[i].pos_m, sizeof from[i]);
    begin(&bodies, &config);
    for (int tick = 0; tick < 60000; tick++) {
        assert_int_equal(sim_bodies_step(&bodies, tick * 1e-3, 1e-3, NULL),
                         MOTION_OK);
        for (int i = 0; i < 2 && tick > 1000; i++)
            physics_near("speed",
                         sqrt(dot(sphere[i].vel_m_s, sphere[i].vel_m_s)), 0,
                         1e-9);
    }
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 3; k++)
            physics_near("place", sphere[i].pos_m[k], from[i][k], 1e-9);
    /* two edges carry it, each with its part of the weight */
    for (int c = 0; c < bodies.contacts; c++)
        if (contact[c].a == 1 && contact[c].box > 0)
            physics_near("edge", contact[c].force_n,
                         0.5 * 0.4 * G * r / sqrt(r * r - gap * gap), 1e-6);
}

/* Balls thrown among turned boxes in a closed room. */
static void nothing_tunnels_into_a_box(void **state)
{
    (void)state;
    for (int round = 0; round < 6; round++) {
        const struct sim_bodies_config config = {
            .spheres = BALLS,
            .planes = 6,
            .boxes = BOXES,
            .box = box,
            .restitution = physics_random(0, 0.95),
            .friction = physics_random(0, 0.6),
            .gravity_m_s2 = { 0, 0, -G },
        };
        struct sim_bodies bodies;

        bodies_in_a_room(plane, 1);
        for (int x = 0; x < BOXES; x++) {
            random_box(&box[x]);
            box[x].center_m[0] += x % 2 == 0 ? -0.3 : 0.3;
            box[x].center_m[1] += x / 2 == 0 ? -0.3 : 0.3;
        }
        for (int i = 0; i < BALLS; i++) {
            sphere[i] = (struct sim_sphere){
                .mass_kg = physics_random(0.1, 2),
                .radius_m = physics_random(0.02, 0.06),
            };
            bodies_throw(&sphere[i], i, 0.85);
        }
        begin(&bodies, &config);
        bodies_stay_apart(&bodies, round, 2000);
    }
}

static void what_is_no_box_is_refused(void **state)
{
    struct sim_bodies_config config = { .spheres = 1, .boxes = 1, .box = box };
    struct sim_bodies bodies;
    (void)state;

    sphere[0] = (struct sim_sphere){ .mass_kg = 1, .radius_m = 1 };
    straight_box(&box[0], 0, 0, 1);
    begin(&bodies, &config);
    for (int change = 0; change < 4; change++) {
        straight_box(&box[0], 0, 0, 1);
        config.boxes = 1;
        if (change == 0)
            box[0].half_m[1] = 0;
        else if (change == 1)
            box[0].axis[0][0] = 2;
        else if (change == 2)
            box[0].axis[0][0] = 0, box[0].axis[0][1] = 1; /* as the second */
        else
            config.boxes = -1;
        assert_int_equal(
            sim_bodies_init(&bodies, &config, sphere, plane, contact),
            MOTION_E_ARG);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_bounce_is_about_the_normal_of_face_edge_or_corner),
        cmocka_unit_test(a_sphere_leaves_an_edge_where_nothing_presses_it),
        cmocka_unit_test(what_rests_on_boxes_stays),
        cmocka_unit_test(nothing_tunnels_into_a_box),
        cmocka_unit_test(what_is_no_box_is_refused),
    };

    physics_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}

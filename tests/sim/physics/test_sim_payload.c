/* tests/sim/physics/test_sim_payload.c - what hangs on an axis, or rolls on it,
 * moves as it must and pulls as it must.  Takes long. */
#include <math.h>
#include <stdio.h>

#include "sim/physics/payload.h"
#include "tests/sim/bus/sim_bus.h"
#include "tests/sim/oracle.h"

#define STEP_S  1e-3
#define GRAVITY 9.80665

static const double pi = 3.14159265358979323846;

static struct sim_payload payload;

static void build(const struct sim_payload_config *config)
{
    assert_int_equal(sim_payload_init(&payload, config, 0), MOTION_OK);
}

/* The axis goes `distance` in `move_s` and stands until `end_s`; `watch` sees
 * every step. */
static void play(double distance, double move_s, double end_s,
                 void (*watch)(double t_s))
{
    for (int i = 1; i * STEP_S <= end_s; i++) {
        const double t = i * STEP_S, part = fmin(t / move_s, 1);
        const double at = distance * (part - sin(2 * pi * part) / (2 * pi));
        const double speed =
            t >= move_s ? 0 : distance / move_s * (1 - cos(2 * pi * part));
        assert_int_equal(sim_payload_step(&payload, STEP_S, at, speed),
                         MOTION_OK);
        if (watch != NULL)
            watch(t);
    }
}

static double impulse, off_max, first_zero, last_zero, before;
static unsigned zeros;

static void watch_swing(double t_s)
{
    struct sim_payload_point point[SIM_PAYLOAD_NODES];
    const unsigned count = sim_payload_points(&payload, point);
    const double off = point[count - 1].x - point[0].x;

    impulse += payload.force * STEP_S;
    off_max = fmax(off_max, sim_payload_off_m(&payload));
    if (before < 0 && off >= 0) {
        last_zero = t_s - STEP_S * off / (off - before);
        if (zeros++ == 0)
            first_zero = last_zero;
    }
    before = off;
}

static void a_pendulum_swings_in_its_time(void **state)
{
    const struct sim_payload_config config = { .kind = SIM_PAYLOAD_PENDULUM,
                                               .mass_kg = 3,
                                               .length_m = 1.2 };
    (void)state;

    build(&config);
    zeros = 0;
    before = off_max = 0;
    play(0.1, 0.6, 20, watch_swing);
    const double period = (last_zero - first_zero) / (zeros - 1);
    const double amplitude = off_max / config.length_m;
    /* with the first term of a large amplitude */
    const double wanted = 2 * pi * sqrt(config.length_m / GRAVITY) *
                          (1 + amplitude * amplitude / 16);
    if (fabs(period / wanted - 1) > 1e-3)
        fail_msg("period %.6f s, wanted %.6f s", period, wanted);
}

/* What an axis gives to a load that ends at rest, or at its speed, is its
 * momentum; on the way it was pulled forth and back. */
static void what_it_pulls_with_is_its_change_of_momentum(void **state)
{
    const struct sim_payload_config config = { .kind = SIM_PAYLOAD_CABLE,
                                               .mass_kg = 2,
                                               .cable_kg = 0.5,
                                               .length_m = 1,
                                               .damping = 0.9 };
    (void)state;

    build(&config);
    impulse = 0;
    before = 0;
    play(0.5, 1, 4, watch_swing);
    if (fabs(impulse) > 5e-3) /* it moved 1.25 N s */
        fail_msg("impulse %.6f N s, off %.6f m", impulse,
                 sim_payload_off_m(&payload));
    assert_true(sim_payload_off_m(&payload) < 1e-3);
    /* steadily faster: mass times acceleration, and tan(angle) = a / g */
    build(&config);
    double at = 0, speed = 0;
    for (int i = 0; i < 4000; i++) {
        at += (speed + 0.5 * STEP_S) * STEP_S;
        speed += STEP_S;
        assert_int_equal(sim_payload_step(&payload, STEP_S, at, speed),
                         MOTION_OK);
    }
    assert_true(fabs(payload.force - 2.5) < 0.01); /* the last of the swing */
    assert_true(fabs(sim_payload_off_m(&payload) - sin(atan(1 / GRAVITY))) <
                5e-3);
}

static void a_ball_rolls_down_a_plate_and_off_it(void **state)
{
    const struct sim_payload_config config = { .kind = SIM_PAYLOAD_BALL,
                                               .mass_kg = 0.2,
                                               .length_m = 1,
                                               .radius_m = 0.02,
                                               .friction = 0.5 };
    const double tilt = 0.02, rolls = 5.0 / 7 * GRAVITY * sin(tilt);
    (void)state;

    build(&config);
    assert_true(fabs(sim_payload_off_m(&payload)) < 1e-9);
    play(tilt, 0.01, 2, NULL);
    /* half of the time of the tilt is lost */
    const double wanted = 0.5 * rolls * (2 - 0.005) * (2 - 0.005);
    if (fabs(sim_payload_off_m(&payload) / wanted - 1) > 0.01)
        fail_msg("rolled %.5f m, wanted %.5f m", sim_payload_off_m(&payload),
                 wanted);
    assert_true(fabs(payload.force + 0.2 * GRAVITY * cos(tilt) * wanted) <
                0.01);
    assert_false(payload.gone);
    for (int i = 0; i < 2000; i++)
        assert_int_equal(sim_payload_step(&payload, STEP_S, tilt, 0),
                         MOTION_OK);
    assert_true(payload.gone);
    assert_true(payload.force == 0);
}

/* It rolls to the lower wall, comes to rest there, and presses on the plate as a
 * weight at the place where it lies, whatever wall and plate carry each. */
static void a_ball_stays_between_the_walls_of_its_plate(void **state)
{
    const struct sim_payload_config config = { .kind = SIM_PAYLOAD_BALL,
                                               .mass_kg = 0.2,
                                               .length_m = 1,
                                               .radius_m = 0.02,
                                               .friction = 0.5,
                                               .wall_m = 0.03 };
    struct sim_payload_point point[SIM_PAYLOAD_NODES];
    (void)state;

    for (int side = -1; side <= 1; side += 2) {
        const double tilt = side * 0.1;
        build(&config);
        play(tilt, 0.2, 6, NULL);
        assert_false(payload.gone);
        assert_int_equal(sim_payload_points(&payload, point), 5);
        const double x = point[4].x;
        const double along = x * cos(tilt) - point[4].z * sin(tilt);
        if (fabs(side * along - (0.5 - config.radius_m)) > 1e-6)
            fail_msg("lies at %.9f m", along);
        if (fabs(payload.force + 0.2 * GRAVITY * x) > 1e-6)
            fail_msg("torque %.9f N m, wanted %.9f", payload.force,
                     -0.2 * GRAVITY * x);
        /* the top of the wall there */
        const struct sim_payload_point *const top = &point[side < 0 ? 0 : 3];
        assert_true(fabs(hypot(top->x, top->z) - hypot(0.5, 0.03)) < 1e-12);
    }
}

static void a_curtain_hangs_from_its_corners_and_comes_to_rest(void **state)
{
    const struct sim_payload_config config = { .kind = SIM_PAYLOAD_CURTAIN,
                                               .mass_kg = 1.5,
                                               .length_m = 1.5,
                                               .width_m = 2 };
    struct sim_payload_point point[SIM_PAYLOAD_NODES];
    (void)state;

    build(&config);
    const double energy = oracle_particles_energy_j(&payload.particles);
    play(-0.5, 1, 4, NULL);
    assert_int_equal(sim_payload_points(&payload, point), SIM_PAYLOAD_NODES);
    const struct sim_payload_point *const pulled =
        &point[(SIM_PAYLOAD_COLUMNS - 1) * SIM_PAYLOAD_ROWS];
    assert_true(fabs(pulled->x + 0.5) < 1e-9 && fabs(pulled->z) < 1e-9);
    assert_true(fabs(point[0].z) < 1e-9);
    for (unsigned i = 0; i < SIM_PAYLOAD_NODES; i++)
        assert_true(point[i].z < 0.05 && point[i].z > -2.5);
    /* corners nearer to each other: it hangs deeper */
    assert_true(oracle_particles_energy_j(&payload.particles) < energy);
    assert_true(payload.force > 0); /* it hangs to the side of the other one */
    assert_true(sim_payload_off_m(&payload) < 0.05);
}

static double nearest_pair(void)
{
    struct sim_payload_point point[SIM_PAYLOAD_NODES];
    double nearest = 1;

    (void)sim_payload_points(&payload, point);
    for (unsigned i = 0; i < SIM_PAYLOAD_NODES; i++)
        for (unsigned j = 0; j < i; j++)
            nearest = fmin(nearest, hypot(hypot(point[i].x - point[j].x,
                                                point[i].y - point[j].y),
                                          point[i].z - point[j].z));
    return nearest;
}

static double nearest_seen;

static void watch_nearest(double t_s)
{
    (void)t_s;
    nearest_seen = fmin(nearest_seen, nearest_pair());
}

/* Its traveller closes it, corner to corner: what would lie in one place
 * keeps apart. */
static void a_curtain_does_not_pass_through_itself(void **state)
{
    struct sim_payload_config config = { .kind = SIM_PAYLOAD_CURTAIN,
                                         .mass_kg = 1.5,
                                         .length_m = 1.5,
                                         .width_m = 2,
                                         .collides = true };
    const double sphere = sim_payload_sphere_m(&config);
    double through;
    (void)state;

    build(&config);
    nearest_seen = 1;
    play(-1.55, 1.2, 1.5, watch_nearest);
    const double apart = nearest_seen;
    config.collides = false;
    build(&config);
    nearest_seen = 1;
    play(-1.55, 1.2, 1.5, watch_nearest);
    through = nearest_seen;
    printf("spheres of %.3f m: nearest %.3f m, without them %.3f m\n", sphere,
           apart, through);
    assert_true(apart > 0.7 * sphere);
    assert_true(through < 0.5 * sphere);
}

static void what_is_out_of_range_is_refused(void **state)
{
    const struct sim_payload_config good = {
        .kind = SIM_PAYLOAD_CABLE, .mass_kg = 1, .cable_kg = 1, .length_m = 1
    };
    struct sim_payload_config bad = good;
    (void)state;

    build(&good);
    bad.mass_kg = 0;
    assert_int_equal(sim_payload_init(&payload, &bad, 0), MOTION_E_ARG);
    bad = good;
    bad.cable_kg = 0;
    assert_int_equal(sim_payload_init(&payload, &bad, 0), MOTION_E_ARG);
    bad = good;
    bad.damping = 1.5;
    assert_int_equal(sim_payload_init(&payload, &bad, 0), MOTION_E_ARG);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_pendulum_swings_in_its_time),
        cmocka_unit_test(what_it_pulls_with_is_its_change_of_momentum),
        cmocka_unit_test(a_ball_rolls_down_a_plate_and_off_it),
        cmocka_unit_test(a_ball_stays_between_the_walls_of_its_plate),
        cmocka_unit_test(a_curtain_hangs_from_its_corners_and_comes_to_rest),
        cmocka_unit_test(a_curtain_does_not_pass_through_itself),
        cmocka_unit_test(what_is_out_of_range_is_refused),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

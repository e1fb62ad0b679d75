/* sim/physics/plant.c - see plant.h. */
#include "sim/physics/plant.h"

#include <assert.h>
#include <math.h>

#include "motion/core/err.h"
#include "sim/physics/mechanics.h"
#include "sim/util.h"

#define SIM_PLANT_VEL_MAX (INT64_C(1) << 31)
#define SIM_PLANT_ACC_MAX (INT64_C(1) << 40)
/* The end of the world, 2^38 counts. */
#define SIM_PLANT_POS_MAX_Q24 (INT64_C(1) << 62)

static int64_t sim_plant_shift_round(sim_i128 value, unsigned bits)
{
    return (int64_t)((value + ((sim_i128)1 << (bits - 1))) >> bits);
}

/* |value| limited to max; says whether it was. */
static bool sim_plant_limit(int64_t *value, int64_t max)
{
    int64_t requested = *value;

    if (requested > max)
        *value = max;
    if (requested < -max)
        *value = -max;
    return *value != requested;
}

static bool sim_plant_is_legal(const struct sim_plant_config *config,
                               int64_t pos_counts)
{
    return config->omega_mrad_s >= 1000 && config->omega_mrad_s <= 4000000 &&
           config->zeta_permille >= 100 && config->zeta_permille <= 2000 &&
           config->vel_max_counts_s >= 1 &&
           config->vel_max_counts_s <= SIM_PLANT_VEL_MAX &&
           config->acc_max_counts_s2 >= 1 &&
           config->acc_max_counts_s2 <= SIM_PLANT_ACC_MAX &&
           config->coast_counts_s2 >= 0 &&
           config->coast_counts_s2 <= SIM_PLANT_ACC_MAX &&
           pos_counts >= -(INT64_C(1) << 38) && pos_counts <= INT64_C(1) << 38;
}

int sim_plant_init(struct sim_plant *plant,
                   const struct sim_plant_config *config, int64_t pos_counts)
{
    int64_t omega = config->omega_mrad_s;

    if (!sim_plant_is_legal(config, pos_counts))
        return MOTION_E_ARG;
    *plant = (struct sim_plant){
        .config = *config,
        .pos_q24 = pos_counts * (INT64_C(1) << 24),
        /* omega^2 < 2^44, times 2^16 */
        .spring_q16 = (omega * omega << 16) / 1000000,
        /* 2 zeta omega < 2^34, times 2^16 */
        .damping_q16 = (omega * 2 * config->zeta_permille << 16) / 1000000,
        /* omega h <= 1/8 */
        .inner_max_ns = INT64_C(125000000000) / omega,
    };
    if (config->coast_counts_s2 == 0)
        plant->config.coast_counts_s2 = config->acc_max_counts_s2 / 4 + 1;
    return MOTION_OK;
}

int sim_plant_set_winding(struct sim_plant *plant,
                          const struct sim_winding_config *config)
{
    const int err = sim_winding_init(&plant->winding, config);
    const double rate = config->stall_counts_s2 / config->no_load_counts_s;

    /* it slows down by the torque of the step before: rate h <= 1/8 */
    if (err == MOTION_OK && config->stall_counts_s2 > 0 &&
        (double)plant->inner_max_ns * rate > 1.25e8)
        plant->inner_max_ns = (int64_t)(1.25e8 / rate);
    return err;
}

int sim_plant_set_loops(struct sim_plant *plant,
                        const struct sim_loops_config *config)
{
    return sim_loops_init(&plant->loops, config);
}

/* dt in seconds; divides only when dt is not that of the last step. */
static int64_t sim_plant_step_s_q60(struct sim_plant *plant, int64_t dt_ns)
{
    assert(dt_ns >= 1 && dt_ns <= SIM_PLANT_STEP_MAX_NS);
    if (dt_ns != plant->step_ns) {
        plant->step_ns = dt_ns;
        plant->step_s_q60 =
            (int64_t)(((sim_i128)dt_ns << 60) / INT64_C(1000000000));
    }
    return plant->step_s_q60;
}

int64_t sim_plant_travel_q24(struct sim_plant *plant, int64_t vel_q24,
                             int64_t dt_ns)
{
    /* < 2^60 x 2^51 */
    return sim_plant_shift_round(
        (sim_i128)vel_q24 * sim_plant_step_s_q60(plant, dt_ns), 60);
}

/* Nothing springs back from a stop. */
static void sim_plant_stop(struct sim_plant *plant)
{
    if (plant->pos_q24 >= plant->low_q24 && plant->pos_q24 <= plant->high_q24)
        return;
    plant->pos_q24 =
        plant->pos_q24 < plant->low_q24 ? plant->low_q24 : plant->high_q24;
    if (plant->met_q24 < plant->vel_q24 || plant->met_q24 < -plant->vel_q24)
        plant->met_q24 = plant->vel_q24 < 0 ? -plant->vel_q24 : plant->vel_q24;
    plant->vel_q24 = 0;
}

static void sim_plant_move(struct sim_plant *plant, int64_t step_s_q60)
{
    /* |vel| <= 2^55: below 2^45 per step, so the sum stays below 2^63 */
    plant->pos_q24 +=
        sim_plant_shift_round((sim_i128)plant->vel_q24 * step_s_q60, 60);
    if (sim_plant_limit(&plant->pos_q24, SIM_PLANT_POS_MAX_Q24)) {
        plant->vel_q24 = 0;
        plant->saturated = true;
    }
    if (plant->has_stops)
        sim_plant_stop(plant);
}

/* Coulomb friction: against the motion, and as much as holds a rotor that
 * stands.  Never turns it round within the step: what is left of the speed is
 * what the torque alone makes of it. */
static int64_t sim_plant_rub_q8(const struct sim_plant *plant, int64_t acc_q8,
                                int64_t step_s_q60)
{
    const int64_t rub_q8 = plant->friction_q8;
    const int64_t torque_vel_q24 =
        plant->vel_q24 +
        sim_plant_shift_round((sim_i128)acc_q8 * step_s_q60, 44);
    const int64_t rub_vel_q24 =
        sim_plant_shift_round((sim_i128)rub_q8 * step_s_q60, 44);

    if (torque_vel_q24 > rub_vel_q24)
        return acc_q8 - rub_q8;
    if (torque_vel_q24 < -rub_vel_q24)
        return acc_q8 + rub_q8;
    /* stands at the end of the step: |result| <= |acc| + rub < 2^50 */
    return -(int64_t)((sim_i128)plant->vel_q24 * (INT64_C(1) << 44) /
                      step_s_q60);
}

/* ---- the encoder ---- */

int64_t sim_plant_measured_q24(const struct sim_plant *plant)
{
    return plant->pos_q24 + plant->encoder_error_q24;
}

/* The sum of eight even numbers is normal but for its ends: none is beyond 4.9
 * deviations. */
static int64_t sim_plant_noise_q24(struct sim_plant *plant)
{
    int64_t sum = 0;

    for (int i = 0; i < 2; i++) {
        const uint64_t bits = sim_random(&plant->encoder_seed);
        for (unsigned part = 0; part < 64; part += 16)
            sum += (int64_t)(bits >> part & 0xFFFF) - 32768;
    }
    /* the deviation of the sum is 65536 sqrt(8 / 12), 53510 */
    return (int64_t)((sim_i128)plant->encoder_noise_q24 * sum / 53510);
}

static void sim_plant_measure(struct sim_plant *plant)
{
    const int64_t step_q24 = plant->encoder_step_q24;
    int64_t seen_q24 = plant->pos_q24;

    if (step_q24 == 0 && plant->encoder_noise_q24 == 0)
        return;
    if (plant->encoder_noise_q24 > 0)
        seen_q24 += sim_plant_noise_q24(plant);
    if (step_q24 > 0) {
        const int64_t half_q24 = seen_q24 < 0 ? -step_q24 / 2 : step_q24 / 2;
        seen_q24 = (seen_q24 + half_q24) / step_q24 * step_q24;
    }
    plant->encoder_error_q24 = seen_q24 - plant->pos_q24;
}

static double sim_plant_seconds(int64_t step_s_q60)
{
    return (double)step_s_q60 / (double)(INT64_C(1) << 60);
}

/* 1/s3: what the integral of the loop is taken times. */
static double sim_plant_integral_gain(const struct sim_plant *plant)
{
    const double omega = plant->config.omega_mrad_s * 1e-3;
    return omega * omega * omega / 8;
}

/* What the integral of the loop asks for, in Q40 of counts/s2 as the pull is. */
static sim_i128 sim_plant_integral(const struct sim_plant *plant)
{
    if (plant->mechanics == NULL)
        return 0;
    /* |acc| <= 2^40, by sim_plant_integrate */
    const double acc =
        sim_plant_integral_gain(plant) * plant->mechanics->integral;
    return (sim_i128)(int64_t)(acc * 256) * (INT64_C(1) << 32);
}

/* Adds a step to the integral, unless that is towards a limit that the torque is at;
 * it never asks for more than the current limit (K. J. Astrom, T. Hagglund, Advanced
 * PID Control, ISA 2006, 3.5: conditional integration). */
static void sim_plant_integrate(struct sim_plant *plant, sim_i128 off_q24,
                                sim_i128 pull, double step_s)
{
    struct sim_mechanics *const mechanics = plant->mechanics;
    const bool is_up = plant->reversed ? pull < 0 : pull > 0;
    if (mechanics == NULL || (plant->saturated && is_up == (off_q24 > 0)))
        return;
    const double most = (double)plant->config.acc_max_counts_s2 /
                        sim_plant_integral_gain(plant);
    mechanics->integral += (double)off_q24 * 0x1p-24 * step_s;
    mechanics->integral = fmax(-most, fmin(most, mechanics->integral));
}

/* The torque as it is, the motor no faster than its voltage allows. */
static void sim_plant_turn_load(struct sim_plant *plant, int64_t step_s_q60)
{
    const int64_t most_q24 = plant->config.vel_max_counts_s << 24;
    double acc = (double)plant->acc_q8 / 256;

    if ((plant->vel_q24 >= most_q24 && acc > 0) ||
        (plant->vel_q24 <= -most_q24 && acc < 0)) {
        acc = 0;
        plant->saturated = true;
    }
    sim_mechanics_step(plant->mechanics, acc, sim_plant_seconds(step_s_q60),
                       &plant->pos_q24, &plant->vel_q24);
    if (sim_plant_limit(&plant->pos_q24, SIM_PLANT_POS_MAX_Q24))
        plant->vel_q24 = 0;
}

/* What its voltage leaves of the torque, and the heat of that. */
static int64_t sim_plant_wind_q8(struct sim_plant *plant, int64_t acc_q8,
                                 int64_t step_s_q60)
{
    const double wanted = (double)acc_q8 / 256;
    const double torque = sim_winding_torque(&plant->winding, wanted,
                                             (double)plant->vel_q24 * 0x1p-24);

    sim_winding_heat(&plant->winding, torque, sim_plant_seconds(step_s_q60));
    plant->loops.held = torque != wanted;
    if (torque == wanted)
        return acc_q8;
    plant->saturated = true;
    return llround(torque * 256);
}

/* A step with that torque, of the rotor and what is on it. */
static void sim_plant_turn(struct sim_plant *plant, int64_t torque_q8,
                           int64_t step_s_q60)
{
    if (plant->winding.given)
        torque_q8 = sim_plant_wind_q8(plant, torque_q8, step_s_q60);
    plant->acc_q8 = torque_q8 + plant->pull_q8;
    if (plant->friction_q8 > 0)
        plant->acc_q8 = sim_plant_rub_q8(plant, plant->acc_q8, step_s_q60);
    if (plant->pressed) {
        plant->vel_q24 = 0;
        return;
    }
    if (plant->mechanics != NULL) {
        sim_plant_turn_load(plant, step_s_q60);
        return;
    }
    /* < 2^48 x 2^51; Q8 x Q60 to Q24 */
    plant->vel_q24 +=
        sim_plant_shift_round((sim_i128)plant->acc_q8 * step_s_q60, 44);
    if (sim_plant_limit(&plant->vel_q24, plant->config.vel_max_counts_s << 24))
        plant->saturated = true;
    sim_plant_move(plant, step_s_q60);
}

/* One inner step; the set point at its begin and its slope. */
static void sim_plant_inner(struct sim_plant *plant, int64_t target_q24,
                            int64_t target_vel_q24, int64_t step_s_q60)
{
    /* Both below 2^63 (positions 2^62, velocities 2^60); the sum of products
     * is below 2^104 + 2^95 + 2^86.  Q24 x Q16 to Q8: 32 bits less. */
    const sim_i128 off_q24 =
        (sim_i128)target_q24 - sim_plant_measured_q24(plant);
    const sim_i128 acc_max = (sim_i128)plant->config.acc_max_counts_s2 << 40;
    const bool was_saturated = plant->saturated;
    sim_i128 pull = plant->spring_q16 * off_q24 +
                    (sim_i128)plant->damping_q16 *
                        ((sim_i128)target_vel_q24 - plant->vel_q24) +
                    (sim_i128)plant->push_q8 * (INT64_C(1) << 32) +
                    sim_plant_integral(plant);

    if (plant->reversed)
        pull = -pull;
    plant->saturated = pull > acc_max || pull < -acc_max;
    if (plant->saturated)
        pull = pull > 0 ? acc_max : -acc_max;
    sim_plant_turn(plant, sim_plant_shift_round(pull, 32), step_s_q60);
    sim_plant_integrate(plant, off_q24, pull, sim_plant_seconds(step_s_q60));
    plant->saturated |= was_saturated;
}

/* ---- a cascade of loops ---- */

/* A sample of the current loop `ago_ns` before the end of the step. */
static void sim_plant_sample(struct sim_plant *plant, int64_t target_q24,
                             int64_t target_vel_q24, int64_t ago_ns)
{
    const double vel = (double)target_vel_q24 * 0x1p-24;
    const double at = (double)sim_plant_measured_q24(plant) * 0x1p-24;
    bool limited;
    const struct sim_loops_input input = {
        .target = (double)target_q24 * 0x1p-24 - vel * 1e-9 * (double)ago_ns,
        .target_vel = vel,
        .position = at,
        .speed = (double)plant->vel_q24 * 0x1p-24,
        .push = (double)plant->push_q8 / 256,
        .most = (double)plant->config.acc_max_counts_s2,
    };

    sim_loops_sample(&plant->loops, &input, &limited);
    plant->saturated |= limited;
    plant->loops.wait_ns = plant->loops.config.current_ns;
}

/* From sample to sample of the current loop, wherever the step ends. */
static void sim_plant_cascade(struct sim_plant *plant, int64_t target_q24,
                              int64_t target_vel_q24, int64_t dt_ns)
{
    struct sim_loops *const loops = &plant->loops;

    while (dt_ns > 0) {
        if (loops->wait_ns == 0)
            sim_plant_sample(plant, target_q24, target_vel_q24, dt_ns);
        int64_t step_ns = loops->wait_ns < dt_ns ? loops->wait_ns : dt_ns;
        if (step_ns > plant->inner_max_ns)
            step_ns = plant->inner_max_ns;
        const int64_t torque_q8 = llround(loops->torque * 256);
        sim_plant_turn(plant, plant->reversed ? -torque_q8 : torque_q8,
                       sim_plant_step_s_q60(plant, step_ns));
        loops->wait_ns -= step_ns;
        dt_ns -= step_ns;
    }
}

void sim_plant_step(struct sim_plant *plant, int64_t target_q24,
                    int64_t target_vel_q24, int64_t dt_ns)
{
    int64_t count = (dt_ns + plant->inner_max_ns - 1) / plant->inner_max_ns;
    int64_t step_s_q60 = sim_plant_step_s_q60(plant, dt_ns);
    int64_t travel_q24, from_q24;

    if (plant->loops.given) {
        plant->saturated = false;
        sim_plant_cascade(plant, target_q24, target_vel_q24, dt_ns);
        sim_plant_measure(plant);
        return;
    }
    if (count > 1)
        step_s_q60 /= count;
    travel_q24 =
        sim_plant_shift_round((sim_i128)target_vel_q24 * step_s_q60, 60);
    from_q24 = target_q24 - travel_q24 * count;
    plant->saturated = false;
    for (int64_t i = 0; i < count; i++)
        sim_plant_inner(plant, from_q24 + travel_q24 * i, target_vel_q24,
                        step_s_q60);
    sim_plant_measure(plant);
}

static void sim_plant_slow(struct sim_plant *plant, int64_t step_s_q60)
{
    int64_t loss_q24 = sim_plant_shift_round(
        (sim_i128)plant->config.coast_counts_s2 * step_s_q60, 36);

    if (plant->vel_q24 == 0)
        return;
    if (plant->vel_q24 > loss_q24)
        plant->vel_q24 -= loss_q24;
    else if (plant->vel_q24 < -loss_q24)
        plant->vel_q24 += loss_q24;
    else
        plant->vel_q24 = 0;
    sim_plant_move(plant, step_s_q60);
}

void sim_plant_coast(struct sim_plant *plant, int64_t dt_ns)
{
    int64_t step_s_q60 = sim_plant_step_s_q60(plant, dt_ns);

    const int64_t from_q24 = plant->pos_q24;

    plant->acc_q8 = 0;
    plant->saturated = false;
    if (plant->loops.given)
        sim_loops_reset(&plant->loops);
    if (plant->winding.given)
        sim_winding_heat(&plant->winding, 0, sim_plant_seconds(step_s_q60));
    sim_plant_slow(plant, step_s_q60);
    if (plant->mechanics != NULL)
        sim_mechanics_drag(plant->mechanics, sim_plant_seconds(step_s_q60),
                           from_q24, plant->pos_q24, plant->vel_q24);
    sim_plant_measure(plant);
}

void sim_plant_pull(struct sim_plant *plant, double counts_s2)
{
    if (plant->mechanics != NULL)
        sim_mechanics_pull(plant->mechanics, counts_s2);
    else
        plant->pull_q8 = llround(counts_s2 * 256);
}

void sim_plant_block(struct sim_plant *plant)
{
    plant->vel_q24 = 0;
    plant->acc_q8 = 0;
    sim_plant_measure(plant);
}

void sim_plant_press(struct sim_plant *plant, int64_t target_q24,
                     int64_t target_vel_q24, int64_t dt_ns)
{
    plant->pressed = true;
    sim_plant_step(plant, target_q24, target_vel_q24, dt_ns);
    plant->pressed = false;
}

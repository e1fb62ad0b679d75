/* sim/identify/servo_model.c - see servo_model.h. */
#include "sim/identify/servo_model.h"

#include <math.h>
#include <stddef.h>

#include "motion/core/err.h"

#define MODEL_Q24 16777216.0
/* For so long a drive has held its axis before. */
#define MODEL_WARM_NS INT64_C(300000000)

static int model_loops(const struct sim_model_run *run, const double value[],
                       struct sim_plant *plant)
{
    struct sim_loops_config config = run->loops;

    config.position_hz = value[SIM_MODEL_BANDWIDTH];
    config.velocity_hz = value[SIM_MODEL_LOOP_DAMPING];
    return sim_plant_set_loops(plant, &config);
}

static int model_plant(const struct sim_model_run *run, const double value[],
                       struct sim_plant *plant)
{
    const double omega = 2e3 * 3.14159265358979323846;
    struct sim_plant_config config = run->plant;

    config.omega_mrad_s = (uint32_t)llround(omega * value[SIM_MODEL_BANDWIDTH]);
    config.zeta_permille =
        run->has_loops
            ? 1000
            : (uint16_t)llround(1000 * value[SIM_MODEL_LOOP_DAMPING]);
    int err = sim_plant_init(plant, &config, llround(run->target[0]));
    if (err == MOTION_OK && run->has_loops)
        err = model_loops(run, value, plant);
    return err == MOTION_OK && run->has_winding
               ? sim_plant_set_winding(plant, &run->winding)
               : err;
}

static int model_load(const struct sim_model_run *run, const double value[],
                      struct sim_plant *plant, struct sim_mechanics *mechanics)
{
    struct sim_mechanics_config config = run->load;
    const double above = config.static_counts_s2 - config.coulomb_counts_s2;

    config.inertia_ratio = value[SIM_MODEL_INERTIA];
    config.frequency_hz = value[SIM_MODEL_FREQUENCY];
    config.damping = value[SIM_MODEL_LOAD_DAMPING];
    config.coulomb_counts_s2 = value[SIM_MODEL_FRICTION];
    config.static_counts_s2 = value[SIM_MODEL_FRICTION] + fmax(0, above);
    config.viscous_1_s = value[SIM_MODEL_VISCOUS];
    config.backlash_counts = value[SIM_MODEL_BACKLASH];
    config.has_stops = false;
    const int err = sim_mechanics_init(mechanics, &config, plant->pos_q24);
    if (err == MOTION_OK)
        plant->mechanics = mechanics;
    return err;
}

static void model_line(const struct sim_model_run *run, struct sim_plant *plant,
                       double from, double to)
{
    const int64_t period_ns = run->period_ns;
    const int64_t steps = (period_ns + run->loop_ns - 1) / run->loop_ns;
    const double vel = (to - from) * 1e9 / (double)period_ns;

    for (int64_t i = 1; i <= steps; i++) {
        const int64_t dt_ns =
            period_ns * i / steps - period_ns * (i - 1) / steps;
        const double at = from + (to - from) * (double)i / (double)steps;
        sim_plant_step(plant, llround(at * MODEL_Q24), llround(vel * MODEL_Q24),
                       dt_ns);
    }
}

/* Places and changes within a period, at the ends of the periods. */
static void model_move(const struct sim_model_run *run, struct sim_plant *plant,
                       double *position, double *change)
{
    const double period_s = 1e-9 * (double)run->period_ns;
    const int64_t warm = MODEL_WARM_NS / run->period_ns;

    for (int64_t i = 0; plant->mechanics != NULL && i < warm; i++)
        model_line(run, plant, run->target[0], run->target[0]);
    for (uint32_t i = 0; i < run->rows; i++) {
        model_line(run, plant, run->target[i == 0 ? 0 : i - 1], run->target[i]);
        position[i] = (double)plant->pos_q24 / MODEL_Q24;
        change[i] = (double)plant->vel_q24 / MODEL_Q24 * period_s;
    }
}

/* Later by `delay` periods: Hermite's cubic between two rows. */
static void model_delay(uint32_t rows, double delay, double *position,
                        const double *change)
{
    const double whole = ceil(delay);
    const double u = whole - delay; /* behind the earlier of both rows */

    for (uint32_t k = rows; k-- > 0;) {
        const double row = (double)k - whole;
        const uint32_t i = row < 0 ? 0 : (uint32_t)row;
        if (row < 0 || u == 0) {
            position[k] = position[i];
            continue;
        }
        const double step = position[i + 1] - position[i];
        const double bend = change[i] - step;
        const double rest = step - change[i + 1];
        position[k] =
            position[i] + u * step + u * (1 - u) * (bend * (1 - u) + rest * u);
    }
}

int sim_model_play(const struct sim_model_run *run, const double value[],
                   bool loaded, double *position, double *work)
{
    struct sim_plant plant;
    struct sim_mechanics mechanics;
    int err = model_plant(run, value, &plant);

    mechanics.failed = 0; /* of a rigid load there is nothing that could */
    if (err == MOTION_OK && loaded)
        err = model_load(run, value, &plant, &mechanics);
    if (err < 0)
        return err;
    model_move(run, &plant, position, work);
    model_delay(run->rows, value[SIM_MODEL_DELAY], position, work);
    return loaded && mechanics.failed > 0 ? MOTION_E_RANGE : MOTION_OK;
}

/* sim/physics/loops.c - see loops.h. */
#include "sim/physics/loops.h"

#include <math.h>

#include "motion/core/err.h"
#include "motion/double/double_math.h"

#define LOOPS_TWO_PI (2 * DOUBLE_PI)

/* Sampled at least ten times in a period of its frequency. */
static bool loops_is_sampled(double hz, int64_t period_ns)
{
    return hz * (double)period_ns <= 1e8;
}

static bool loops_is_legal(const struct sim_loops_config *config)
{
    return config->position_hz >= 0.1 && config->position_hz <= 200 &&
           config->velocity_hz >= 1 && config->velocity_hz <= 1000 &&
           config->velocity_hz >= config->position_hz &&
           config->current_hz >= 10 && config->current_hz <= 5000 &&
           config->current_hz >= config->velocity_hz &&
           (config->reset_s == 0 ||
            (config->reset_s >= 1e-3 && config->reset_s <= 10)) &&
           config->position_ns >= 50000 && config->position_ns <= 20000000 &&
           config->current_ns >= 20000 && config->velocity_ns > 0 &&
           config->position_ns % config->velocity_ns == 0 &&
           config->velocity_ns % config->current_ns == 0 &&
           loops_is_sampled(config->position_hz, config->position_ns) &&
           loops_is_sampled(config->velocity_hz, config->velocity_ns);
}

int sim_loops_init(struct sim_loops *loops,
                   const struct sim_loops_config *config)
{
    if (!loops_is_legal(config))
        return MOTION_E_ARG;
    *loops = (struct sim_loops){
        .given = true,
        .config = *config,
        .current_gain = 1 - double_exp(-LOOPS_TWO_PI * config->current_hz *
                                       1e-9 * (double)config->current_ns),
        .velocity_every = (uint32_t)(config->velocity_ns / config->current_ns),
        .position_every = (uint32_t)(config->position_ns / config->current_ns),
    };
    return MOTION_OK;
}

void sim_loops_reset(struct sim_loops *loops)
{
    loops->v_ref = loops->integral = loops->a_ref = loops->torque = 0;
    loops->count = 0;
    loops->wait_ns = 0;
    loops->held = false;
}

static void loops_velocity(struct sim_loops *loops,
                           const struct sim_loops_input *input)
{
    const struct sim_loops_config *const config = &loops->config;
    const double gain = LOOPS_TWO_PI * config->velocity_hz;
    const double off = loops->v_ref - input->speed;
    const double wanted = gain * off + loops->integral + input->push;

    loops->a_ref = fmax(-input->most, fmin(input->most, wanted));
    if (config->reset_s > 0 && loops->a_ref == wanted && !loops->held)
        loops->integral +=
            gain * off / config->reset_s * 1e-9 * (double)config->velocity_ns;
}

double sim_loops_sample(struct sim_loops *loops,
                        const struct sim_loops_input *input, bool *limited)
{
    if (loops->count % loops->position_every == 0)
        loops->v_ref =
            input->target_vel + LOOPS_TWO_PI * loops->config.position_hz *
                                    (input->target - input->position);
    if (loops->count % loops->velocity_every == 0)
        loops_velocity(loops, input);
    loops->count = (loops->count + 1) % loops->position_every;
    loops->torque += loops->current_gain * (loops->a_ref - loops->torque);
    *limited = fabs(loops->a_ref) >= input->most;
    return loops->torque;
}

/* hal/drive/odrive/drive.c - arming and disarming; see drive.h. */
#include "hal/drive/odrive/parts.h"

#include <string.h>

#include "hal/support/container_of.h"
#include "hal/support/float32.h"
#include "motion/core/fixed.h"

#define MS           INT64_C(1000000)
#define HEARTBEAT_NS (100 * MS)
#define SILENCE_NS   (50 * MS)

/* Cycles of disarming in vain after which Estop is sent as well. */
#define ESTOP_AFTER_NS (400 * MS)

static struct drive_odrive *odrive_of(struct drive_turn *turn)
{
    return CONTAINER_OF(turn, struct drive_odrive, turn);
}

/* ---- on and off ---- */

/* The input before the state: an old one would be chased. */
static void odrive_close_loop(struct drive_turn *turn)
{
    struct drive_odrive *self = odrive_of(turn);

    (void)odrive_send_u32(self, ODRIVE_SET_MODE, ODRIVE_CONTROL_POSITION,
                          ODRIVE_PASSTHROUGH, 2);
    odrive_send_target(self);
    (void)odrive_send_u32(self, ODRIVE_SET_AXIS_STATE, ODRIVE_CLOSED_LOOP, 0,
                          1);
    self->passes = true;
}

void odrive_arm(struct drive_turn *turn, bool again)
{
    if (!again)
        return;
    drive_turn_stand(turn);
    odrive_close_loop(turn);
}

static void odrive_disarm(struct drive_turn *turn, bool again)
{
    struct drive_odrive *self = odrive_of(turn);
    /* one that is not there would need two resets for it later */
    const bool heard =
        drive_turn_is_watched(turn) || self->heartbeat_ns > turn->since_ns;

    if (!again)
        return;
    (void)odrive_send_u32(self, ODRIVE_SET_AXIS_STATE, ODRIVE_IDLE, 0, 1);
    if (heard && turn->now_ns - turn->since_ns > ESTOP_AFTER_NS)
        (void)odrive_send(self, ODRIVE_ESTOP, NULL, 0);
}

static void odrive_clear(struct drive_turn *turn, bool again)
{
    struct drive_odrive *self = odrive_of(turn);
    const uint8_t no_light = 0; /* 0.6: do not blink */
    const bool is_06 = self->family == DRIVE_ODRIVE_06;

    if (again)
        (void)odrive_send(self, ODRIVE_CLEAR_ERRORS, &no_light, is_06 ? 1 : 0);
}

static const struct drive_turn_ops odrive_turn_ops = {
    .modes = 1u << HAL_DRIVE_STREAM_POSITION |
             1u << HAL_DRIVE_PROFILE_POSITION | 1u << HAL_DRIVE_HOMING,
    .start = odrive_start,
    .start_step = odrive_start_step,
    .arm = odrive_arm,
    .disarm = odrive_disarm,
    .clear = odrive_clear,
    .seek = odrive_seek,
    .break_off = odrive_close_loop,
};

/* ---- init ---- */

/* ns to s: 1e-9 = 4611686018 / 2^62. */
static uint32_t odrive_seconds(int64_t t_ns)
{
    int64_t t_q32 = 0;

    (void)motion_fixed_mulshift(t_ns, INT64_C(4611686018), 30, &t_q32);
    return hal_float32_from_fixed(t_q32, 32);
}

static bool odrive_is_legal(const struct drive_odrive_config *config)
{
    return config->node <= DRIVE_ODRIVE_NODE_MAX && config->heartbeat_ns >= 0 &&
           config->silence_ns >= 0 && config->torque_constant_q32 >= 0 &&
           (config->watchdog_timeout == 0 ||
            (config->enable_watchdog != 0 && config->watchdog_ns > 0 &&
             config->watchdog_ns <= 10000 * MS));
}

int drive_odrive_init(struct drive_odrive *self, struct can_bus *bus,
                      const struct drive_odrive_config *config)
{
    int err;

    memset(self, 0, sizeof *self);
    if (!odrive_is_legal(config))
        return MOTION_E_ARG;
    self->config = *config;
    if (config->heartbeat_ns == 0)
        self->config.heartbeat_ns = HEARTBEAT_NS;
    if (config->silence_ns == 0)
        self->config.silence_ns = SILENCE_NS;
    self->watchdog_s = odrive_seconds(config->watchdog_ns);
    self->node.ops = &drive_odrive_node_ops;
    err = drive_turn_init(&self->turn, &odrive_turn_ops, &config->turn);
    if (err == MOTION_OK)
        can_bus_add(bus, &self->node);
    return err;
}

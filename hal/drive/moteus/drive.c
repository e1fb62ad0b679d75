/* hal/drive/moteus/drive.c - start, arming and disarming; see drive.h. */
#include "hal/drive/moteus/parts.h"

#include <string.h>

#include "hal/support/container_of.h"

#define MS          INT64_C(1000000)
#define WATCHDOG_NS (100 * MS)
#define SILENCE_NS  (50 * MS)

static struct drive_moteus *moteus_of(struct drive_turn *turn)
{
    return CONTAINER_OF(turn, struct drive_moteus, turn);
}

/* ---- start, on, off ---- */

static void moteus_start(struct drive_turn *turn)
{
    struct drive_moteus *self = moteus_of(turn);

    self->heard = self->is_nan = false;
    self->stopping = false;
    self->heard_ns = 0;
}

static int moteus_start_step(struct drive_turn *turn)
{
    const struct drive_moteus *self = moteus_of(turn);

    if (self->heard && turn->positioned)
        return MOTION_OK;
    drive_turn_say(turn, self->is_nan ? DRIVE_TURN_NAN : "no answer yet");
    return MOTION_E_AGAIN;
}

/* The first set point arms; it only has to be stopped before. */
static void moteus_arm(struct drive_turn *turn, bool again)
{
    struct drive_moteus *self = moteus_of(turn);

    (void)again;
    self->stopping = self->mode != MOTEUS_MODE_STOPPED && !turn->armed &&
                     self->mode > MOTEUS_MODE_POSITION;
    if (self->mode == MOTEUS_MODE_STOPPED)
        drive_turn_stand(turn);
}

static void moteus_stop(struct drive_turn *turn, bool again)
{
    (void)again; /* every cycle: it costs three bytes */
    moteus_of(turn)->stopping = true;
}

static const struct drive_turn_ops moteus_turns_ops = {
    .modes = 1u << HAL_DRIVE_STREAM_POSITION |
             1u << HAL_DRIVE_PROFILE_POSITION |
             1u << HAL_DRIVE_PROFILE_VELOCITY,
    .start = moteus_start,
    .start_step = moteus_start_step,
    .arm = moteus_arm,
    .disarm = moteus_stop,
    .clear = moteus_stop,
};

/* ---- init ---- */

static bool moteus_is_legal(const struct drive_moteus_config *config)
{
    return config->id >= 1 && config->id <= 127 && config->silence_ns >= 0 &&
           config->watchdog_ns >= MS && config->watchdog_ns <= 1000 * MS &&
           config->watchdog_ns % MS == 0;
}

int drive_moteus_init(struct drive_moteus *self, struct can_bus *bus,
                      const struct drive_moteus_config *config)
{
    int err;

    memset(self, 0, sizeof *self);
    self->config = *config;
    if (config->watchdog_ns == 0)
        self->config.watchdog_ns = WATCHDOG_NS;
    if (config->silence_ns == 0)
        self->config.silence_ns = SILENCE_NS;
    if (!moteus_is_legal(&self->config))
        return MOTION_E_ARG;
    self->watchdog_ms = (uint16_t)(self->config.watchdog_ns / MS);
    self->node.ops = &drive_moteus_node_ops;
    err = drive_turn_init(&self->turn, &moteus_turns_ops, &config->turn);
    self->turn.extrapolates = true;
    if (err == MOTION_OK)
        can_bus_add(bus, &self->node);
    return err;
}

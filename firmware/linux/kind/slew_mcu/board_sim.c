/* firmware/linux/kind/slew_mcu/board_sim.c - see board_sim.h. */
#include "firmware/linux/kind/slew_mcu/board_sim.h"

#include <string.h>

#include "hal/support/container_of.h"

/* Its oscillator has a phase of its own. */
#define BOARD_PHASE_NS INT64_C(370000)

static int64_t board_sim_due_ns(const struct sim_member *member)
{
    const struct board_sim *self =
        CONTAINER_OF(member, const struct board_sim, member);

    return self->begin_ns + self->due_ps / 1000;
}

/* As the image does: the tick, then what waited for it. */
static void board_sim_run(struct sim_member *member, int64_t now_ns)
{
    struct board_sim *self = CONTAINER_OF(member, struct board_sim, member);

    (void)now_ns;
    self->ticks++;
    if (!self->is_hung) {
        mcu_unit_tick(&self->unit, self->ticks * BOARD_SIM_TICK);
        mcu_registers_poll(&self->registers);
    }
    /* 1e-9 of a tick of 1 ms is a ps */
    self->due_ps +=
        BOARD_SIM_TICK * 1000 - self->off_ppb - self->unit.clock_ppb;
}

static const struct sim_member_ops board_sim_ops = {
    .due_ns = board_sim_due_ns,
    .run = board_sim_run,
};

/* --- the master of its own line, which is there while it has servos --- */

static struct board_sim *board_sim_of_station(struct modbus_station *of)
{
    return CONTAINER_OF(of, struct board_sim, station);
}

static void board_sim_recv(struct modbus_station *station, const uint8_t *bytes,
                           unsigned length, int64_t now_ns)
{
    struct board_sim *self = board_sim_of_station(station);
    struct modbus_station *master = &self->servos.master.station;

    if (self->servos.is_on)
        master->ops->recv(master, bytes, length, now_ns - self->begin_ns);
}

static int64_t board_sim_station_due_ns(const struct modbus_station *station)
{
    const struct board_sim *self =
        CONTAINER_OF(station, const struct board_sim, station);
    const struct modbus_station *master = &self->servos.master.station;
    const int64_t due_ns =
        self->servos.is_on ? master->ops->due_ns(master) : MODBUS_STATION_NEVER;

    return due_ns == MODBUS_STATION_NEVER ? due_ns : due_ns + self->begin_ns;
}

static unsigned board_sim_poll(struct modbus_station *station, int64_t now_ns,
                               uint8_t frame[MODBUS_FRAME_MAX])
{
    struct board_sim *self = board_sim_of_station(station);
    struct modbus_station *master = &self->servos.master.station;

    return self->servos.is_on
               ? master->ops->poll(master, now_ns - self->begin_ns, frame)
               : 0;
}

static void board_sim_sent(struct modbus_station *station, int64_t now_ns)
{
    struct board_sim *self = board_sim_of_station(station);
    struct modbus_station *master = &self->servos.master.station;

    if (self->servos.is_on)
        master->ops->sent(master, now_ns - self->begin_ns);
}

static const struct modbus_station_ops board_sim_station_ops = {
    .recv = board_sim_recv,
    .due_ns = board_sim_station_due_ns,
    .poll = board_sim_poll,
    .sent = board_sim_sent,
};

int board_sim_add(struct board_sim *self, unsigned axis,
                  const struct sim_modbus_servo_config *config)
{
    int err = MOTION_OK;

    if (!self->has_line) {
        self->has_line = true;
        self->config.servos = &self->servos;
        self->station.ops = &board_sim_station_ops;
        err = sim_modbus_line_init(&self->line, self->world, &config->line);
        if (err == MOTION_OK)
            err = sim_modbus_seat_init(&self->master_seat, &self->line,
                                       &self->station);
    }
    return err < 0 ? err
                   : sim_modbus_servo_init(&self->servo[axis], self->world,
                                           &self->line, config);
}

int board_sim_init(struct board_sim *self, struct sim_world *world,
                   struct sim_modbus_line *line, uint8_t unit,
                   const struct modbus_rtu_line *config)
{
    int err;

    memset(self, 0, sizeof *self);
    self->world = world;
    self->member.ops = &board_sim_ops;
    self->begin_ns = world->now_ns + BOARD_PHASE_NS;
    self->due_ps = BOARD_SIM_TICK * 1000;
    self->config = (struct mcu_unit_config){ .period_ns = BOARD_SIM_TICK,
                                             .ring = self->ring,
                                             .window = BOARD_SIM_WINDOW,
                                             .log = self->log,
                                             .log_words = BOARD_SIM_LOG };
    mcu_unit_init(&self->unit, &self->config);
    mcu_upload_init(&self->upload, &self->unit);
    mcu_registers_init(&self->registers, &self->unit, &self->upload);
    err = sim_world_add(world, &self->member);
    if (err < 0 || line == NULL)
        return err;
    err = modbus_rtu_slave_init(&self->slave, &self->registers.slave, unit,
                                config, 0);
    return err < 0
               ? err
               : sim_modbus_seat_init(&self->seat, line, &self->slave.station);
}

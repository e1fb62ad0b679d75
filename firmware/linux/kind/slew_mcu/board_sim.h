/* firmware/linux/kind/slew_mcu/board_sim.h - a simulated board: the program of
 * the real one (firmware/mcu), whose tick and whose line are those of a
 * simulated world. */
#ifndef FIRMWARE_LINUX_KIND_SLEW_MCU_BOARD_SIM_H
#define FIRMWARE_LINUX_KIND_SLEW_MCU_BOARD_SIM_H

#include "firmware/mcu/registers.h"
#include "hal/modbus/rtu_slave.h"
#include "sim/bus/modbus.h"
#include "sim/device/modbus/servo.h"

#define BOARD_SIM_WINDOW 64 /* segments of an axis that have room */
#define BOARD_SIM_LOG    4096
#define BOARD_SIM_TICK   INT64_C(1000000)

struct board_sim {
    struct sim_member member;
    struct mcu_unit_config config;
    struct mcu_unit unit;
    struct mcu_upload upload;
    struct mcu_registers registers;
    struct modbus_rtu_slave slave;
    struct sim_modbus_seat seat;
    struct motion_segment ring[MCU_AXES_MAX * 2 * BOARD_SIM_WINDOW];
    int64_t log[BOARD_SIM_LOG];
    int64_t begin_ns; /* power came */
    int64_t ticks;
    int64_t due_ps;  /* the next tick, since then */
    int32_t off_ppb; /* its oscillator is fast by so much, 1e-9 */
    bool is_hung;    /* no tick */
    /* its own line, and the servos there */
    struct sim_world *world;
    bool has_line;
    struct mcu_servos servos;
    struct sim_modbus_line line;
    struct sim_modbus_seat master_seat;
    struct modbus_station station; /* of the master, in the board's time */
    struct sim_modbus_servo servo[MCU_AXES_MAX];
};

/* Power comes now; a tick of its own, that is not in step with any other.
 * `line`: NULL, none, its registers are served in another way. */
int board_sim_init(struct board_sim *self, struct sim_world *world,
                   struct sim_modbus_line *line, uint8_t unit,
                   const struct modbus_rtu_line *config);
/* A servo for an axis, on the board's own line: config->line, the same for all
 * of them. */
int board_sim_add(struct board_sim *self, unsigned axis,
                  const struct sim_modbus_servo_config *config);

#endif

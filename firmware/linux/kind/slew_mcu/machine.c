/* firmware/linux/kind/slew_mcu/machine.c - driver and simulated board of an axis
 * that a board samples: see firmware/linux/machine/kind.h. */
#include "firmware/control/controller.h"
#include "firmware/host/base/array.h"
#include "firmware/host/rig/modbus_budget.h"
#include "firmware/linux/kind/slew_mcu/board_sim.h"
#include "firmware/linux/machine/kind.h"
#include "firmware/linux/machine/modbus_device.h"
#include "hal/drive/slew_mcu/drive.h"
#include "hal/support/container_of.h"
#include "motion/core/fixed.h"

#define BOARD_PATIENCE_NS INT64_C(15000000000) /* its servos are looked for */
#define BOARD_LEAD_NS     INT64_C(100000000)
#define BOARD_LEAD_CYCLES 6 /* override, start, and that it was heard */

/* The axis of the rig that is the first one of the same board. */
static unsigned board_first(const struct rig *rig, unsigned i)
{
    unsigned first = 0;

    while (rig->axis[first].kind != RIG_SLEW_MCU ||
           rig->axis[first].bus != rig->axis[i].bus ||
           rig->axis[first].node_id != rig->axis[i].node_id)
        first++;
    return first;
}

static const char *const board_fault_text[] = {
#define BOARD_FAULT(name, reaction, text) [name] = text,
    CONTROLLER_FAULT_LIST(BOARD_FAULT)
#undef BOARD_FAULT
};

static struct mcu_setup board_setup(const struct rig_axis *axis)
{
    return (struct mcu_setup){
        .pos_min_q32 = axis->limit.pos_min_q32,
        .pos_max_q32 = axis->limit.pos_max_q32,
        .vel_q32 = axis->limit.vel_q32,
        .acc_q32 = axis->limit.acc_q32,
        .jerk_q32 = axis->limit.jerk_q32,
        .stop_vel_q32 = axis->limit.vel_q32,
        .stop_acc_q32 = axis->stop_acc_q32,
        .stop_jerk_q32 = axis->stop_jerk_q32,
        .following_floor_q32 = axis->following_floor_q32,
        .following_k_ns = axis->following_k_ns,
        .pos_q32 = axis->sim.start_q32,
    };
}

static int64_t board_lead_ns(const struct rig *rig, const struct rig_axis *axis)
{
    const int64_t need_ns =
        BOARD_LEAD_NS +
        BOARD_LEAD_CYCLES * modbus_budget_cycle_ns(rig, axis->bus);

    return (need_ns + rig->period_ns - 1) / rig->period_ns * rig->period_ns;
}

/* --- servos on the board's own line --- */

static bool board_has(const struct rig *rig, unsigned of, unsigned i)
{
    return rig->axis[i].kind == RIG_SLEW_MCU && rig->axis[i].servo != 0 &&
           rig->axis[i].bus == rig->axis[of].bus &&
           rig->axis[i].node_id == rig->axis[of].node_id;
}

/* Its line is that of the map. */
static struct modbus_rtu_line board_line(const struct modbus_map *map)
{
    struct modbus_rtu_line line = map->line;
    struct modbus_rtu_time time = { 0 };

    if (line.gap_ns == 0 && modbus_rtu_time_init(&time, &line) == MOTION_OK)
        line.gap_ns = time.gap_ns;
    return line;
}

/* As a Modbus axis of the PC's, with the cycle of the board's line. */
static void board_servo(const struct rig *rig, unsigned i,
                        const struct modbus_map *map, struct mcu_servo *servo)
{
    const struct rig_axis *axis = &rig->axis[i];
    struct modbus_rtu_time time = { 0 };
    unsigned transactions = 0, own;
    int64_t cycle_ns = 0;

    (void)modbus_rtu_time_init(&time, &map->line);
    for (unsigned k = 0; k < rig->axis_count; k++)
        if (board_has(rig, i, k)) {
            cycle_ns += modbus_map_cycle_ns(map, &time, true, &own);
            transactions += own;
        }
    *servo = (struct mcu_servo){
        .config = { .unit = axis->servo,
                    .counts_num = axis->counts_num,
                    .counts_den = axis->counts_den,
                    .vel_max_q32 = axis->limit.vel_q32,
                    .acc_q32 = axis->stop_acc_q32,
                    .cycle_ns = cycle_ns,
                    .latency_ns =
                        transactions == 0
                            ? 0
                            : 3 * cycle_ns / (2 * (int64_t)transactions) },
        .depth = 2,
        .feedback_max_age_ns = 3 * cycle_ns + 6 * map->timeout_ns,
        .map_crc = mcu_map_crc(map),
    };
}

static const struct mcu_servo *board_take_servo(struct machine *machine,
                                                unsigned i,
                                                const struct modbus_map **map)
{
    struct modbus_map *own = memory_pool_new(&machine->memory, 1, sizeof *own);
    struct mcu_servo *servo =
        memory_pool_new(&machine->memory, 1, sizeof *servo);

    *own = machine->rig->map[machine->rig->axis[i].map];
    own->line = board_line(own);
    board_servo(machine->rig, i, own, servo);
    *map = own;
    return servo;
}

static int slew_mcu_init(struct machine *machine, unsigned i)
{
    const struct rig *rig = machine->rig;
    const struct rig_axis *axis = &rig->axis[i];
    const unsigned first = board_first(rig, i);
    struct drive_slew_mcu_config config = {
        .unit = axis->node_id,
        .axis = axis->node_axis,
        .setup = board_setup(axis),
        .watch_ms = (uint32_t)(axis->watch_ns / 1000000),
        .lead_ns = board_lead_ns(rig, axis),
        .fault_text = board_fault_text,
        .fault_count = ARRAY_LEN(board_fault_text),
    };

    if (axis->servo != 0)
        config.servo = board_take_servo(machine, i, &config.map);
    struct drive_slew_mcu *drive = machine->drive[i];
    machine->axis[i] = &drive->drive;
    return drive_slew_mcu_init(drive, &machine->modbus[axis->bus],
                               first == i ? NULL : machine->drive[first],
                               &config);
}

static int64_t slew_mcu_age_ns(const struct rig *rig,
                               const struct rig_axis *axis)
{
    return modbus_budget_age_ns(rig, axis->bus);
}

static int64_t slew_mcu_patience_ns(const struct rig *rig,
                                    const struct rig_axis *axis)
{
    (void)rig;
    (void)axis;
    return BOARD_PATIENCE_NS;
}

/* --- simulated --- */

/* Its servo, if it has one, on the board's own line. */
static int board_sim_axis(struct board_sim *board, const struct rig *rig,
                          unsigned i)
{
    const struct rig_axis *axis = &rig->axis[i];
    struct sim_modbus_servo_config config;
    int err;

    if (axis->servo == 0)
        return MOTION_OK;
    err = machine_sim_servo_config(rig, i, &config);
    if (err < 0)
        return err;
    config.unit = axis->servo;
    config.line = board_line(&rig->map[axis->map]);
    return board_sim_add(board, axis->node_axis, &config);
}

static int slew_mcu_sim_init(struct machine_sim *sim, const struct rig *rig,
                             unsigned i)
{
    const struct rig_axis *axis = &rig->axis[i];
    const struct modbus_rtu_line line = modbus_budget_line(rig, axis->bus);
    const unsigned first = board_first(rig, i);
    struct board_sim *board = sim->servo[first];
    int err = MOTION_OK;

    if (board == NULL) {
        board = memory_pool_new(&sim->memory, 1, sizeof *board);
        err = board_sim_init(board, &sim->world, &sim->modbus_line[axis->bus],
                             axis->node_id, &line);
    }
    sim->servo[i] = board;
    return err < 0 ? err : board_sim_axis(board, rig, i);
}

static int64_t slew_mcu_sim_counts_q24(const struct machine_sim *sim,
                                       unsigned i)
{
    const struct rig_axis *axis = &sim->rig->axis[i];
    const struct board_sim *board = sim->servo[i];
    int64_t counts_q24 = 0;

    if (board->unit.axis_count > axis->node_axis)
        (void)motion_fixed_muldiv(
            board->unit.axis[axis->node_axis].feedback.pos_q32,
            axis->counts_num, axis->counts_den << 8, &counts_q24);
    return counts_q24;
}

/* To other masters: one board for all of its axes. */
static int slew_mcu_serve(struct modbus_device *device, const struct rig *rig,
                          unsigned i)
{
    const struct rig_axis *axis = &rig->axis[i];
    const struct modbus_rtu_line line = modbus_budget_line(rig, axis->bus);
    const bool is_rtu = rig->bus[axis->bus].kind == RIG_MODBUS_RTU;
    struct modbus_slave **slave = &device->host.slave[axis->node_id];
    struct board_sim *board;
    int err = MOTION_OK;

    if (*slave == NULL) {
        board = memory_pool_new(&device->memory, 1, sizeof *board);
        err =
            board_sim_init(board, &device->world, is_rtu ? &device->line : NULL,
                           axis->node_id, &line);
        *slave = &board->registers.slave;
    }
    board = CONTAINER_OF(*slave, struct board_sim, registers.slave);
    return err < 0 ? err : board_sim_axis(board, rig, i);
}

const struct machine_kind machine_kind_slew_mcu = {
    .drive_size = sizeof(struct drive_slew_mcu),
    .init = slew_mcu_init,
    .age_ns = slew_mcu_age_ns,
    .patience_ns = slew_mcu_patience_ns,
    .sim_init = slew_mcu_sim_init,
    .sim_counts_q24 = slew_mcu_sim_counts_q24,
    .serve = slew_mcu_serve,
};

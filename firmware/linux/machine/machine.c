/* firmware/linux/machine/machine.c - see machine.h. */
#include "firmware/linux/machine/machine.h"

#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/rig/modbus_budget.h"
#include "firmware/host/rig/modbus_stream.h"
#include "firmware/linux/machine/machine_trigger.h"
#include "firmware/linux/machine/machine_turns.h"
#include "hal/support/ratio.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define MACHINE_RETRY_NS INT64_C(1000000000)
#define MACHINE_BOOT_NS  INT64_C(5000000000)

static int machine_fail(char message[YAML_MESSAGE_MAX], const char *kind,
                        const char *name, int err)
{
    snprintf(message, YAML_MESSAGE_MAX, "%s %s: %s", kind, name,
             motion_err_text(err));
    return err;
}

/* Heartbeats of ours: three before the drives' watchdog runs out. */
static int machine_init_bus(struct machine *machine, unsigned i)
{
    const struct rig *rig = machine->rig;
    const struct canopen_config config = {
        .node_id = rig->bus[i].node_id,
        .sync_period_ns = rig->period_ns,
        .heartbeat_period_ns = rig->watchdog_ns / 3,
        .sync_overflow = rig->bus[i].sync_counter,
    };
    machine->fieldbus[i] = &machine->bus[i].fieldbus;
    return canopen_init(&machine->bus[i], machine->ports.can[i], &config);
}

/* Two under way keep the line busy while one transaction outlasts a tick; more
 * when several fit in one. */
static int machine_init_line(struct machine *machine, unsigned i)
{
    const struct rig *rig = machine->rig;
    const int64_t latency_ns = modbus_budget_latency_ns(rig, i);
    unsigned depth = 2;

    if (latency_ns > 0)
        depth += (unsigned)(rig->period_ns * 3 / 2 / latency_ns);
    if (depth > HAL_MODBUS_MAILBOX)
        depth = HAL_MODBUS_MAILBOX;
    machine->fieldbus[i] = &machine->modbus[i].fieldbus;
    return modbus_bus_init(&machine->modbus[i], machine->ports.modbus[i],
                           depth);
}

/* Whole counts, magnitude; 0 (leave the drive's own) beyond u32. */
static uint32_t machine_counts(const struct rig_axis *axis, int64_t value_q32)
{
    struct hal_ratio to_counts;
    if (hal_ratio_init(&to_counts, axis->counts_num, axis->counts_den, -32) < 0)
        return 0;
    uint64_t magnitude =
        motion_fixed_abs(hal_ratio_scale(&to_counts, value_q32));
    return magnitude > UINT32_MAX ? 0 : (uint32_t)magnitude;
}

static int machine_init_servo(struct machine *machine, unsigned i)
{
    const struct rig *rig = machine->rig;
    const unsigned bus = rig->axis[i].bus;
    struct drive_modbus_config config;

    modbus_stream_config(rig, i, &config);
    machine->axis[i] = &machine->servo[i].drive;
    return drive_modbus_init(&machine->servo[i], &machine->modbus[bus],
                             &config);
}

/* The drive watches beside us and knows no other axis: it gets twice the room
 * that we leave at full speed, so that our own watch, which brings all axes to
 * rest together, comes first.  0, leave, when it does not fit. */
static uint32_t machine_following_counts(const struct rig_axis *axis)
{
    int64_t room_q32;
    if (motion_fixed_muldiv(axis->limit.vel_q32, axis->following_k_ns,
                            INT64_C(1000000000), &room_q32) < 0)
        return 0;
    if (room_q32 < axis->following_floor_q32)
        room_q32 = axis->following_floor_q32;
    if (room_q32 > INT64_MAX / 2)
        return 0;
    return machine_counts(axis, 2 * room_q32);
}

/* Two ticks, in whole ms. */
static uint16_t machine_following_ms(const struct rig *rig)
{
    return (uint16_t)((2 * rig->period_ns + 999999) / 1000000);
}

/* In the drive's own count, which is the axis's unless slew homes it. */
static void machine_put_limits(struct drive_cia402_config *config,
                               const struct rig_axis *axis)
{
    config->limits_when_homed = axis->homing.by == HOMING_DRIVE;
    if (axis->homing.by != HOMING_NONE && axis->homing.by != HOMING_DRIVE)
        return;
    config->pos_min_q32 = axis->limit.pos_min_q32;
    config->pos_max_q32 = axis->limit.pos_max_q32;
}

static void machine_put_cia402(struct drive_cia402_config *config,
                               const struct rig_cia402 *cia402)
{
    config->stream = cia402->stream;
    config->stream_given = cia402->stream_given;
    config->gain_q16 = cia402->gain_q16;
    config->axis = cia402->axis;
    config->pdo = cia402->pdo;
    config->torque = cia402->torque;
    config->vel_num = cia402->velocity.num;
    config->vel_den = cia402->velocity.den;
    config->acc_num = cia402->acceleration.num;
    config->acc_den = cia402->acceleration.den;
    config->travel_q32 = cia402->travel_q32;
    config->guard_period_ns = cia402->guard_period_ns;
    config->sdo_timeout_ns = cia402->time.sdo_ns;
    config->state_timeout_ns = cia402->time.state_ns;
    config->brake_timeout_ns = cia402->time.brake_ns;
    config->precharge_timeout_ns = cia402->time.precharge_ns;
    for (unsigned i = 0; i < DRIVE_CIA402_OPTIONS; i++)
        config->option[i] = cia402->option[i];
}

static void machine_put_quirks(struct drive_cia402_config *config,
                               const struct rig *rig,
                               const struct rig_cia402 *cia402)
{
    config->quirk_is_given = cia402->quirk_given;
    config->quirk = rig_quirks(rig, cia402, &config->quirk_count);
}

static int machine_init_drive(struct machine *machine, unsigned i)
{
    const struct rig *rig = machine->rig;
    const struct rig_axis *axis = &rig->axis[i];
    struct drive_cia402_config config = {
        .node_id = axis->node_id,
        .counts_num = axis->counts_num,
        .counts_den = axis->counts_den,
        .sync_period_ns = rig->period_ns,
        .heartbeat_period_ns = rig->heartbeat_ns,
        .watchdog_ns = rig->watchdog_ns,
        .quick_stop_counts_s2 = machine_counts(axis, axis->stop_acc_q32),
        .parameter = axis->object,
        .parameter_count = axis->parameter_count,
        .following_error_counts = machine_following_counts(axis),
        .following_error_ms = machine_following_ms(rig),
        .inputs = rig_homes_by_drive_input(rig, i),
        .unsupervised = axis->unsupervised,
    };
    machine_put_limits(&config, axis);
    machine_put_cia402(&config, &axis->cia402);
    machine_put_quirks(&config, rig, &axis->cia402);
    machine->axis[i] = &machine->drive[i].drive;
    return drive_cia402_init(&machine->drive[i], &machine->bus[axis->bus],
                             &config);
}

static int machine_init_fieldbus(struct machine *machine, unsigned i)
{
    switch (machine->rig->bus[i].kind) {
    case RIG_CANOPEN:
        return machine_init_bus(machine, i);
    case RIG_CAN:
        can_bus_init(&machine->can[i], machine->ports.can[i]);
        machine->fieldbus[i] = &machine->can[i].fieldbus;
        return MOTION_OK;
    case RIG_MODBUS_RTU:
    case RIG_MODBUS_TCP:
        break;
    }
    return machine_init_line(machine, i);
}

static int machine_init_axis(struct machine *machine, unsigned i)
{
    switch (machine->rig->axis[i].kind) {
    case RIG_CIA402:
        return machine_init_drive(machine, i);
    case RIG_MODBUS:
        return machine_init_servo(machine, i);
    case RIG_ODRIVE:
        return machine_init_odrive(machine, i);
    case RIG_MOTEUS:
        return machine_init_moteus(machine, i);
    }
    return MOTION_E_ARG;
}

static struct controller_axis_config machine_axis(const struct rig *rig,
                                                  const struct rig_axis *axis)
{
    return (struct controller_axis_config){
        .pos_min_q32 = axis->limit.pos_min_q32,
        .pos_max_q32 = axis->limit.pos_max_q32,
        .limit = { axis->limit.vel_q32, axis->limit.acc_q32,
                   axis->limit.jerk_q32 },
        .stop = { axis->limit.vel_q32, axis->stop_acc_q32,
                  axis->stop_jerk_q32 },
        .following_floor_q32 = axis->following_floor_q32,
        .following_k_ns = axis->following_k_ns,
        .torque_q32 = axis->torque_q32,
        .feedback_max_age_ns =
            axis->kind == RIG_MODBUS ? modbus_budget_age_ns(rig, axis->bus) : 0,
        .by_goals = axis->point_to_point,
        .late_ns = axis->late_ns,
        .needs_homing = axis->homing.by != HOMING_NONE,
    };
}

/* Where the controller looks for an input of this kind; NULL for outputs. */
static struct hal_gpio **machine_input(struct machine *machine,
                                       struct controller_inputs *inputs,
                                       const struct rig_line *line)
{
    switch (line->kind) {
    case RIG_LINE_ESTOP:
        return &inputs->estop;
    case RIG_LINE_LIMIT_NEGATIVE:
        return &machine->switches[line->axis].limit_negative;
    case RIG_LINE_LIMIT_POSITIVE:
        return &machine->switches[line->axis].limit_positive;
    case RIG_LINE_HOME:
        return &machine->switches[line->axis].home;
    case RIG_LINE_LAMP:
    case RIG_LINE_TRIGGER:
        break;
    }
    return NULL;
}

static int machine_init_inputs(struct machine *machine,
                               struct controller_inputs *inputs)
{
    const struct rig *rig = machine->rig;
    for (unsigned i = 0; i < rig->line_count; i++) {
        struct hal_gpio **slot = machine_input(machine, inputs, &rig->line[i]);
        if (slot == NULL)
            continue;
        int err = gpio_debounce_init(&machine->input[i], machine->ports.line[i],
                                     rig->line[i].release_ns);
        if (err < 0)
            return err;
        *slot = &machine->input[i].gpio;
    }
    return MOTION_OK;
}

/* Three tries of an SDO, five states for a mode. */
static int64_t machine_wait_ns(const struct rig_times *time)
{
    const int64_t wait_ns[] = { time->boot_ns, time->brake_ns,
                                time->precharge_ns, 3 * time->sdo_ns,
                                5 * time->state_ns };
    int64_t most_ns = MACHINE_BOOT_NS;
    for (size_t i = 0; i < ARRAY_LEN(wait_ns); i++)
        if (wait_ns[i] > most_ns)
            most_ns = wait_ns[i];
    return most_ns;
}

/* The longest wait of a drive for one thing, so that the drive itself is the
 * one to say what did not come; whose quirks it has is not known yet. */
static int64_t machine_patience_ns(const struct rig *rig,
                                   const struct rig_axis *axis)
{
    unsigned count;
    const struct drive_cia402_quirk *quirk =
        rig_quirks(rig, &axis->cia402, &count);
    int64_t most_ns = machine_wait_ns(&axis->cia402.time);
    for (unsigned i = 0; i < count; i++) {
        const struct rig_times time = {
            .sdo_ns = quirk[i].sdo_timeout_ns,
            .state_ns = quirk[i].state_timeout_ns,
            .brake_ns = quirk[i].brake_timeout_ns,
            .precharge_ns = quirk[i].precharge_timeout_ns,
        };
        const int64_t wait_ns = machine_wait_ns(&time);
        if (wait_ns > most_ns)
            most_ns = wait_ns;
    }
    return most_ns > MACHINE_BOOT_NS ? most_ns + MACHINE_RETRY_NS : most_ns;
}

int64_t machine_enable_ns(const struct rig *rig)
{
    int64_t most_ns = MACHINE_BOOT_NS;
    for (unsigned i = 0; i < rig->axis_count; i++) {
        const int64_t wait_ns = machine_patience_ns(rig, &rig->axis[i]);
        if (wait_ns > most_ns)
            most_ns = wait_ns;
    }
    return most_ns;
}

static int machine_init_controller(struct machine *machine)
{
    struct controller_inputs inputs = { .axis = machine->switches };
    const struct rig *rig = machine->rig;
    const struct controller_config config = {
        .period_ns = rig->period_ns,
        .axis_count = rig->axis_count,
        .axis = machine->axis_config,
        .enable_timeout_ns = machine_enable_ns(rig),
    };
    for (unsigned i = 0; i < rig->axis_count; i++) {
        machine->axis_config[i] = machine_axis(rig, &rig->axis[i]);
        machine->homing_config[i] = rig->axis[i].homing;
    }
    int err = machine_init_inputs(machine, &inputs);
    if (err == MOTION_OK)
        err = controller_init(&machine->controller, &config,
                              machine->axis_state, machine->axis, &inputs);
    return err < 0 ? err
                   : homing_init(&machine->homing, &machine->controller,
                                 &machine->jog, machine->homing_config);
}

void machine_ports_init(struct machine_ports *ports, const struct rig *rig,
                        struct memory_pool *memory)
{
    *ports = (struct machine_ports){
        .can = memory_pool_new(memory, rig->bus_count, sizeof *ports->can),
        .modbus =
            memory_pool_new(memory, rig->bus_count, sizeof *ports->modbus),
        .line = memory_pool_new(memory, rig->line_count, sizeof *ports->line),
    };
}

static void machine_room(struct machine *machine, const struct rig *rig)
{
    struct memory_pool *memory = &machine->memory;
    const uint32_t buses = rig->bus_count, axes = rig->axis_count;
#define ROOM(array, count)                                                     \
    machine->array = memory_pool_new(memory, count, sizeof *machine->array)
    ROOM(bus, buses);
    ROOM(modbus, buses);
    ROOM(can, buses);
    ROOM(fieldbus, buses);
    ROOM(drive, axes);
    ROOM(servo, axes);
    ROOM(odrive, axes);
    ROOM(moteus, axes);
    ROOM(axis, axes);
    ROOM(axis_config, axes);
    ROOM(axis_state, axes);
    ROOM(switches, axes);
    ROOM(homing_config, axes);
    ROOM(input, rig->line_count);
#undef ROOM
}

void machine_free(struct machine *machine)
{
    memory_pool_free(&machine->memory);
    memset(machine, 0, sizeof *machine);
}

int machine_init(struct machine *machine, const struct rig *rig,
                 const struct machine_ports *ports,
                 char message[YAML_MESSAGE_MAX])
{
    machine_free(machine);
    machine->rig = rig;
    machine->ports = *ports;
    machine_room(machine, rig);
    for (unsigned i = 0; i < rig->bus_count; i++) {
        int err = machine_init_fieldbus(machine, i);
        if (err < 0)
            return machine_fail(message, "bus", rig->bus[i].name, err);
    }
    for (unsigned i = 0; i < rig->axis_count; i++) {
        int err = machine_init_axis(machine, i);
        if (err < 0)
            return machine_fail(message, "axis", rig->axis[i].name, err);
    }
    int err = machine_init_controller(machine);
    if (err == MOTION_OK)
        err = machine_trigger_init(machine);
    return err < 0 ? machine_fail(message, "controller of", rig->title, err)
                   : MOTION_OK;
}

static struct hal_fieldbus_worst machine_begin(struct machine *machine,
                                               int64_t now_ns)
{
    struct hal_fieldbus_worst worst = { HAL_FIELDBUS_GOOD, 0 };
    for (unsigned i = 0; i < machine->rig->bus_count; i++) {
        const enum hal_fieldbus_health health =
            hal_fieldbus_begin(machine->fieldbus[i], now_ns);
        if (health > worst.health)
            worst = (struct hal_fieldbus_worst){ health, i };
    }
    return worst;
}

static void machine_end(struct machine *machine, int64_t now_ns)
{
    guardian_tick(machine->ports.guardian, ++machine->ticks);
    for (unsigned i = 0; i < machine->rig->bus_count; i++)
        hal_fieldbus_end(machine->fieldbus[i], now_ns);
}

static void machine_read_inputs(struct machine *machine, int64_t now_ns)
{
    for (unsigned i = 0; i < machine->rig->line_count; i++)
        if (!rig_line_is_output(&machine->rig->line[i]))
            gpio_debounce_step(&machine->input[i], now_ns);
}

/* A drive that is lost, or in fault and says nothing of it, keeps what it
 * had. */
static void machine_note_torque(struct machine *machine)
{
    for (unsigned i = 0; i < machine->rig->axis_count; i++) {
        const struct hal_drive_feedback *feedback =
            &machine->controller.axis[i].feedback;
        const uint64_t bit = (uint64_t)1 << i;
        if (feedback->state == HAL_DRIVE_ENABLING ||
            feedback->state == HAL_DRIVE_ENABLED ||
            feedback->state == HAL_DRIVE_QUICK_STOP)
            machine->powered |= bit;
        else if (feedback->torque_off)
            machine->powered &= ~bit;
    }
}

/* Lit while an axis may have torque; a lamp that cannot be set is no fault. */
static void machine_light(struct machine *machine)
{
    machine_note_torque(machine);
    const bool lit = machine->powered != 0;
    if (lit == machine->lit)
        return;
    machine->lit = lit;
    for (unsigned i = 0; i < machine->rig->line_count; i++)
        if (machine->rig->line[i].kind == RIG_LINE_LAMP)
            (void)hal_gpio_set(machine->ports.line[i], lit);
}

void machine_tick(struct machine *machine, int64_t now_ns)
{
    const struct hal_fieldbus_worst worst = machine_begin(machine, now_ns);
    machine_read_inputs(machine, now_ns);
    controller_step(&machine->controller, now_ns, worst);
    controller_jog_step(&machine->controller, &machine->jog);
    homing_step(&machine->homing);
    machine_light(machine);
    machine_trigger_step(machine, now_ns);
    machine_end(machine, now_ns);
}

/* What the drives say, on the axes' positions. */
static void machine_look(struct machine *machine)
{
    for (unsigned i = 0; i < machine->rig->axis_count; i++) {
        struct controller_axis *axis = &machine->controller.axis[i];
        int64_t pos_q32;
        hal_drive_feedback(machine->axis[i], &axis->feedback);
        if (motion_fixed_add(axis->feedback.pos_q32, axis->offset_q32,
                             &pos_q32) == MOTION_OK)
            axis->feedback.pos_q32 = pos_q32;
    }
}

void machine_tick_quick_stop(struct machine *machine, int64_t now_ns)
{
    (void)machine_begin(machine, now_ns);
    for (unsigned i = 0; i < machine->rig->axis_count; i++)
        hal_drive_request(machine->axis[i], HAL_DRIVE_REQUEST_QUICK_STOP);
    machine_look(machine);
    machine_light(machine);
    machine_end(machine, now_ns);
}

/* A drive that is lost hears nothing until it is looked for anew, which begins
 * with its stop and ends with it off. */
static void machine_request_off(struct machine *machine, int64_t now_ns)
{
    const bool anew = now_ns >= machine->retry_ns;
    if (anew)
        machine->retry_ns = now_ns + MACHINE_RETRY_NS;
    for (unsigned i = 0; i < machine->rig->axis_count; i++) {
        struct hal_drive *drive = machine->axis[i];
        hal_drive_request(drive, HAL_DRIVE_REQUEST_OFF);
        if (anew && (machine->powered >> i & 1) != 0 &&
            machine->controller.axis[i].feedback.state == HAL_DRIVE_OFFLINE)
            hal_drive_request(drive, HAL_DRIVE_REQUEST_RESET);
    }
}

/* The controller looks and follows where it has nothing to move any more. */
void machine_tick_off(struct machine *machine, int64_t now_ns)
{
    struct controller *controller = &machine->controller;
    const struct hal_fieldbus_worst worst = machine_begin(machine, now_ns);
    (void)controller_off(controller);
    if (controller->state == CONTROLLER_OFF ||
        controller->state == CONTROLLER_FAULT)
        controller_step(controller, now_ns, worst);
    else
        machine_look(machine);
    machine_request_off(machine, now_ns);
    machine_light(machine);
    machine_trigger_step(machine, now_ns); /* pulses end */
    machine_end(machine, now_ns);
}

bool machine_is_off(const struct machine *machine)
{
    return machine->powered == 0;
}

bool machine_is_torque_lost(const struct machine *machine)
{
    for (unsigned i = 0; i < machine->rig->axis_count; i++)
        if ((machine->powered >> i & 1) != 0 &&
            machine->controller.axis[i].feedback.state == HAL_DRIVE_OFFLINE)
            return true;
    return false;
}

void machine_torque_text(const struct machine *machine, unsigned axis,
                         char text[MACHINE_TORQUE_MAX])
{
    const struct hal_drive_feedback *feedback =
        &machine->controller.axis[axis].feedback;
    text[0] = '\0';
    if ((machine->powered >> axis & 1) == 0)
        return;
    snprintf(text, MACHINE_TORQUE_MAX, "torque is not confirmed off: %s%s%s",
             feedback->state == HAL_DRIVE_OFFLINE
                 ? "the drive does not answer"
                 : hal_drive_state_text(feedback->state),
             feedback->fault_text[0] != 0 ? ", " : "", feedback->fault_text);
}

void machine_trouble_text(const struct machine *machine,
                          char text[MACHINE_TROUBLE_MAX])
{
    const struct controller *controller = &machine->controller;
    const struct hal_fieldbus_worst *worst =
        controller->fault.fault == CONTROLLER_FAULT_NONE
            ? &controller->bus
            : &controller->fault.bus;
    text[0] = '\0';
    if (worst->health != HAL_FIELDBUS_GOOD)
        snprintf(text, MACHINE_TROUBLE_MAX, "bus %.12s: %s",
                 machine->rig->bus[worst->bus].name,
                 hal_fieldbus_health_text(worst->health));
}

bool machine_is_at_rest(const struct machine *machine)
{
    for (unsigned i = 0; i < machine->rig->axis_count; i++) {
        const struct hal_drive_feedback *feedback =
            &machine->controller.axis[i].feedback;
        if (feedback->state == HAL_DRIVE_ENABLED ||
            (feedback->state == HAL_DRIVE_QUICK_STOP && feedback->vel_q32 != 0))
            return false;
    }
    return true;
}

int64_t machine_busy_ns(struct machine *machine, unsigned bus)
{
    struct hal_can_stats stats;
    struct hal_modbus_stats line;
    if (!rig_bus_is_can(&machine->rig->bus[bus])) {
        hal_modbus_stats(machine->ports.modbus[bus], &line);
        return (int64_t)(line.ideal_ns > 0 ? line.ideal_ns : line.busy_ns);
    }
    hal_can_stats(machine->ports.can[bus], &stats);
    return (int64_t)stats.busy_ns;
}

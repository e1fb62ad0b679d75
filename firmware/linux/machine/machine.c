/* firmware/linux/machine/machine.c - see machine.h. */
#include "firmware/linux/machine/machine.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/rig/modbus_budget.h"
#include "firmware/linux/machine/kind.h"
#include "firmware/linux/machine/machine_trigger.h"
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

/* Heartbeats of ours: three before the drives' watchdog runs out.  Its padding is
 * copied too, and is 0: machines of one rig are to be the same
 * (linux/fmu/fmu_state.c). */
static int machine_init_bus(struct machine *machine, unsigned i)
{
    const struct rig *rig = machine->rig;
    struct canopen_config config;
    memset(&config, 0, sizeof config);
    config.node_id = rig->bus[i].node_id;
    config.sync_period_ns = rig->period_ns;
    config.heartbeat_period_ns = rig->watchdog_ns / 3;
    config.sync_overflow = rig->bus[i].sync_counter;
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

#define MACHINE_ROW(NAME, name, word) [RIG_##NAME] = &machine_kind_##name,
const struct machine_kind *const machine_kinds[] = { RIG_KIND_LIST(
    MACHINE_ROW) };

static struct controller_axis_config machine_axis(const struct rig *rig,
                                                  const struct rig_axis *axis)
{
    const struct machine_kind *kind = machine_kinds[axis->kind];

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
            kind->age_ns != NULL ? kind->age_ns(rig, axis) : 0,
        .by_goals = axis->point_to_point,
        .late_ns = axis->late_ns,
        .needs_homing = axis->homing.by != HOMING_NONE,
    };
}

/* Where the controller looks for an input of this kind; NULL: nowhere. */
static struct hal_gpio **machine_input(struct machine *machine,
                                       struct controller_inputs *inputs,
                                       const struct rig_line *line)
{
    switch (line->kind) {
    case RIG_LINE_ESTOP:
        return &inputs->estop[inputs->estop[0] != NULL];
    case RIG_LINE_LIMIT_NEGATIVE:
        return &machine->switches[line->axis].limit_negative;
    case RIG_LINE_LIMIT_POSITIVE:
        return &machine->switches[line->axis].limit_positive;
    case RIG_LINE_HOME:
        return &machine->switches[line->axis].home;
    case RIG_LINE_LAMP:
    case RIG_LINE_TRIGGER:
    case RIG_LINE_START: /* the player's */
    case RIG_LINE_FRAME:
        break;
    }
    return NULL;
}

static int machine_init_inputs(struct machine *machine,
                               struct controller_inputs *inputs)
{
    const struct rig *rig = machine->rig;
    for (unsigned i = 0; i < rig->line_count; i++) {
        if (rig_line_is_output(&rig->line[i]))
            continue;
        struct hal_gpio **slot = machine_input(machine, inputs, &rig->line[i]);
        int err = gpio_debounce_init(&machine->input[i], machine->ports.line[i],
                                     rig->line[i].release_ns);
        if (err < 0)
            return err;
        if (slot != NULL)
            *slot = &machine->input[i].gpio;
        if (rig->line[i].discrepancy_ns > 0)
            inputs->discrepancy_ns = rig->line[i].discrepancy_ns;
    }
    return MOTION_OK;
}

bool machine_statusword(const struct machine *machine, unsigned axis,
                        uint16_t *word)
{
    const struct machine_kind *kind =
        machine_kinds[machine->rig->axis[axis].kind];

    *word = kind->statusword != NULL ? kind->statusword(machine, axis) : 0;
    return kind->statusword != NULL;
}

/* So long a drive may make no step on its way to being found and enabled. */
static int64_t machine_enable_ns(const struct rig *rig)
{
    int64_t most_ns = MACHINE_BOOT_NS;
    for (unsigned i = 0; i < rig->axis_count; i++) {
        const struct rig_axis *axis = &rig->axis[i];
        const struct machine_kind *kind = machine_kinds[axis->kind];
        const int64_t wait_ns =
            kind->patience_ns != NULL ? kind->patience_ns(rig, axis) : 0;
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
    for (unsigned i = 0; i < rig->gantry_count; i++)
        machine->gantry[i] = (struct controller_gantry){
            .axis = { rig->gantry[i].axis[0], rig->gantry[i].axis[1] },
            .racking_q32 = rig->gantry[i].racking_q32,
        };
    if (err == MOTION_OK)
        err = controller_set_gantries(&machine->controller, machine->gantry,
                                      rig->gantry_count);
    playback_init(&machine->playback, &machine->controller, &machine->jog,
                  machine->playback_axis);
    return err < 0 ? err
                   : homing_init(&machine->homing, &machine->controller,
                                 &machine->jog, machine->homing_config);
}

void machine_ports_init(struct machine_ports *ports, const struct rig *rig,
                        struct memory_pool *memory)
{
    *ports = (struct machine_ports){
        .can =
            memory_pool_new(memory, rig->bus_count, sizeof(struct hal_can *)),
        .modbus = memory_pool_new(memory, rig->bus_count,
                                  sizeof(struct hal_modbus *)),
        .line =
            memory_pool_new(memory, rig->line_count, sizeof(struct hal_gpio *)),
    };
}

static void machine_storage(struct machine *machine, const struct rig *rig)
{
    struct memory_pool *memory = &machine->memory;
    const uint32_t buses = rig->bus_count, axes = rig->axis_count;
#define CAPACITY(array, count)                                                 \
    machine->array = memory_pool_new(memory, count, sizeof *machine->array)
    CAPACITY(bus, buses);
    CAPACITY(modbus, buses);
    CAPACITY(can, buses);
    CAPACITY(axis_config, axes);
    CAPACITY(axis_state, axes);
    CAPACITY(playback_axis, axes);
    CAPACITY(switches, axes);
    CAPACITY(warnings, axes);
    CAPACITY(found, axes);
    CAPACITY(homing_config, axes);
    CAPACITY(gantry, rig->gantry_count);
    CAPACITY(input, rig->line_count);
#undef CAPACITY
    machine->fieldbus =
        memory_pool_new(memory, buses + 1, sizeof(struct hal_fieldbus *));
    machine->axis = memory_pool_new(memory, axes, sizeof(struct hal_drive *));
    machine->drive = memory_pool_new(memory, axes, sizeof(void *));
    machine->monitor =
        memory_pool_new(memory, axes, sizeof(struct drive_monitor *));
    for (uint32_t i = 0; i < axes; i++)
        machine->drive[i] = memory_pool_new(
            memory, 1, machine_kinds[rig->axis[i].kind]->drive_size);
    for (uint32_t i = 0; i < axes; i++)
        if (rig->axis[i].monitor.wanted != 0)
            machine->monitor[i] =
                memory_pool_new(memory, 1, sizeof *machine->monitor[i]);
}

/* Its driver, and what is monitored of it around that. */
static int machine_init_axis(struct machine *machine, unsigned i)
{
    const struct rig_axis *axis = &machine->rig->axis[i];
    const struct machine_kind *kind = machine_kinds[axis->kind];
    const int err = kind->init(machine, i);
    if (err < 0 || machine->monitor[i] == NULL)
        return err;
    struct hal_drive *inner = machine->axis[i];
    machine->axis[i] = &machine->monitor[i]->drive;
    return drive_monitor_init(machine->monitor[i], inner,
                              kind->readings(machine, i), axis->monitor.limit);
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
    machine_storage(machine, rig);
    for (unsigned i = 0; i < rig->bus_count; i++) {
        int err = machine_init_fieldbus(machine, i);
        if (err < 0)
            return machine_fail(message, "bus", rig->bus[i].name, err);
    }
    drive_virtual_bus_init(&machine->virtual_bus);
    machine->fieldbus[rig->bus_count] = &machine->virtual_bus.fieldbus;
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

/* By the rig's choice to be without a guardian is a fault, as long as that lasts. */
static void machine_look_at_guardian(struct machine *machine, int64_t now_ns)
{
    const bool is_lost =
        guardian_sight_step(&machine->sight, machine->ports.guardian, now_ns);
    if (machine->rig->guardian == RIG_GUARDIAN_STOP &&
        machine->controller.ticks > 0 && (is_lost || machine->sight.is_gone))
        controller_trip(&machine->controller, CONTROLLER_FAULT_GUARDIAN);
}

static struct hal_fieldbus_worst machine_begin(struct machine *machine,
                                               int64_t now_ns)
{
    struct hal_fieldbus_worst worst = { HAL_FIELDBUS_GOOD, 0 };
    machine_look_at_guardian(machine, now_ns);
    for (unsigned i = 0; i <= machine->rig->bus_count; i++) {
        const enum hal_fieldbus_health health =
            hal_fieldbus_begin(machine->fieldbus[i], now_ns);
        if (health > worst.health)
            worst = (struct hal_fieldbus_worst){ health, i };
    }
    for (unsigned i = 0; i < machine->rig->axis_count; i++)
        if (machine->monitor[i] != NULL)
            drive_monitor_step(machine->monitor[i], now_ns);
    return worst;
}

static void machine_end(struct machine *machine, int64_t now_ns)
{
    guardian_tick(machine->ports.guardian, ++machine->ticks);
    for (unsigned i = 0; i <= machine->rig->bus_count; i++)
        hal_fieldbus_end(machine->fieldbus[i], now_ns);
}

static void machine_read_inputs(struct machine *machine, int64_t now_ns)
{
    for (unsigned i = 0; i < machine->rig->line_count; i++)
        if (!rig_line_is_output(&machine->rig->line[i]))
            gpio_debounce_step(&machine->input[i], now_ns);
}

const struct hal_drive_found *machine_found(const struct machine *machine,
                                            unsigned axis)
{
    struct hal_drive *drive = machine->axis[axis];
    return drive->ops->found != NULL ? drive->ops->found(drive) : NULL;
}

/* A drive that is lost, or in fault and says nothing of it, keeps what it
 * had. */
static void machine_note_torque(struct machine *machine)
{
    for (unsigned i = 0; i < machine->rig->axis_count; i++) {
        const struct hal_drive_feedback *feedback =
            &machine->controller.axis[i].feedback;
        const struct hal_drive_found *found = machine_found(machine, i);
        const bool is_found =
            found != NULL && found->count != machine->found[i];
        const uint64_t bit = (uint64_t)1 << i;
        if (is_found)
            machine->found[i] = found->count;
        if (is_found || feedback->state == HAL_DRIVE_ENABLING ||
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

static void machine_warn(struct machine *machine)
{
    for (unsigned i = 0; i < machine->rig->axis_count; i++)
        machine_warnings_step(&machine->warnings[i], &machine->rig->axis[i],
                              &machine->controller.axis[i], machine->monitor[i],
                              machine_found(machine, i));
}

void machine_tick(struct machine *machine, int64_t now_ns)
{
    const struct hal_fieldbus_worst worst = machine_begin(machine, now_ns);
    machine_read_inputs(machine, now_ns);
    controller_step(&machine->controller, now_ns, worst);
    machine_warn(machine);
    controller_jog_step(&machine->controller, &machine->jog);
    homing_step(&machine->homing);
    playback_step(&machine->playback);
    frame_step_tick(&machine->step, &machine->playback);
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

static bool machine_has_powered(const struct machine *machine,
                                enum hal_drive_state state)
{
    for (unsigned i = 0; i < machine->rig->axis_count; i++)
        if ((machine->powered >> i & 1) != 0 &&
            machine->controller.axis[i].feedback.state == state)
            return true;
    return false;
}

bool machine_is_torque_lost(const struct machine *machine)
{
    return machine_has_powered(machine, HAL_DRIVE_OFFLINE);
}

bool machine_brakes(const struct machine *machine)
{
    return machine_has_powered(machine, HAL_DRIVE_QUICK_STOP);
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

/* Name the identifier by which another master was noticed on a CAN bus. */
static void machine_foreign_text(const struct machine *machine, unsigned bus,
                                 char text[MACHINE_TROUBLE_MAX])
{
    const bool is_canopen = machine->rig->bus[bus].kind == RIG_CANOPEN;
    const uint32_t id = is_canopen ? machine->bus[bus].cycle.foreign_id
                                   : machine->can[bus].cycle.foreign_id;
    const char *const word = !is_canopen  ? ""
                             : id == 0    ? " (NMT)"
                             : id == 0x80 ? " (SYNC)"
                                          : "";
    snprintf(text, MACHINE_TROUBLE_MAX, ", %s 0x%03" PRIX32 "%s",
             is_canopen ? "COB-ID" : "identifier", id, word);
}

/* The first line that cannot be read. */
static void machine_input_text(const struct machine *machine,
                               char text[MACHINE_TROUBLE_MAX])
{
    const struct rig *rig = machine->rig;
    for (unsigned i = 0; i < rig->line_count && text[0] == '\0'; i++)
        if (!rig_line_is_output(&rig->line[i]) && machine->input[i].level < 0)
            snprintf(text, MACHINE_TROUBLE_MAX, "line %.40s, is its chip gone?",
                     rig->line[i].name);
}

void machine_trouble_text(const struct machine *machine,
                          char text[MACHINE_TROUBLE_MAX])
{
    const struct controller *controller = &machine->controller;
    const struct hal_fieldbus_worst *worst =
        controller->fault.fault == CONTROLLER_FAULT_NONE
            ? &controller->bus
            : &controller->fault.bus;
    char foreign[MACHINE_TROUBLE_MAX] = "";
    text[0] = '\0';
    if (controller->fault.fault == CONTROLLER_FAULT_INPUT) {
        machine_input_text(machine, text);
        return;
    }
    if (worst->health == HAL_FIELDBUS_FOREIGN)
        machine_foreign_text(machine, worst->bus, foreign);
    if (worst->health != HAL_FIELDBUS_GOOD)
        snprintf(text, MACHINE_TROUBLE_MAX, "bus %.12s: %s%.40s",
                 machine->rig->bus[worst->bus].name,
                 hal_fieldbus_health_text(worst->health), foreign);
}

void machine_refusal_text(const struct machine *machine, int err,
                          char text[JOB_APPROACH_TEXT_MAX])
{
    const struct playback *playback = &machine->playback;
    const int axis = playback->err_axis;
    struct motion_cursor cursor = { 0 };
    struct motion_sample place;
    if (axis < 0 || playback->axis[axis].track == NULL) {
        snprintf(text, JOB_APPROACH_TEXT_MAX, "%s", motion_err_text(err));
        return;
    }
    motion_track_sample(playback->axis[axis].track, &cursor,
                        playback->at_ns_q12, &place);
    job_approach_text(&machine->rig->axis[axis], err,
                      machine->controller.axis[axis].target.pos_q32,
                      place.pos_q32, text);
}

void machine_fault_text(const struct machine *machine,
                        char text[MACHINE_FAULT_MAX])
{
    const struct controller *controller = &machine->controller;
    const struct controller_fault_record *fault = &controller->fault;
    char trouble[MACHINE_TROUBLE_MAX];
    const char *words = trouble;
    text[0] = '\0';
    if (fault->fault == CONTROLLER_FAULT_NONE)
        return;
    machine_trouble_text(machine, trouble);
    if (fault->axis >= 0 && fault->fault != CONTROLLER_FAULT_INPUT)
        words = fault->reason;
    snprintf(
        text, MACHINE_FAULT_MAX, "%s: %s%s%s",
        fault->axis < 0 ? "all axes" : machine->rig->axis[fault->axis].name,
        controller_fault_text(fault->fault), words[0] != 0 ? ", " : "", words);
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

uint32_t machine_bus_warnings(const struct machine *machine, unsigned bus)
{
    struct hal_can_stats stats = { 0 };
    if (rig_bus_is_can(&machine->rig->bus[bus]))
        hal_can_stats(machine->ports.can[bus], &stats);
    return (uint32_t)stats.warnings;
}

int64_t machine_busy_ns(const struct machine *machine, unsigned bus)
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

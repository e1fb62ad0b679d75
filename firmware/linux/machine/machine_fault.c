/* firmware/linux/machine/machine_fault.c - see machine_fault.h. */
#include "firmware/linux/machine/machine_fault.h"

#include <cjson/cJSON.h>
#include <inttypes.h>

#include "firmware/host/base/number.h"
#include "firmware/linux/machine/kind.h"
#include "motion/core/err.h"
#include "sim/bus/can_trouble.h"
#include "sim/device/servo.h"

/* Errors until a port of ours is off: 8 each, to 256. */
#define FAULT_BUS_OFF_ERRORS 32

/* ---- what is put into the simulation beforehand ---- */

/* Of each entry another, and never 0. */
static uint64_t machine_fault_seed(const struct fault_script *script,
                                   uint64_t i)
{
    uint64_t seed = script->seed + (i + 1) * UINT64_C(0x9E3779B97F4A7C15);
    seed = (seed ^ seed >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
    seed = (seed ^ seed >> 27) * UINT64_C(0x94D049BB133111EB);
    return seed ^ seed >> 31 ? seed ^ seed >> 31 : 1;
}

static struct sim_servo *machine_fault_servo(struct machine_sim *sim,
                                             unsigned i)
{
    const struct machine_kind *kind = machine_kinds[sim->rig->axis[i].kind];
    return kind->sim_servo != NULL ? kind->sim_servo(sim, i) : NULL;
}

static bool machine_fault_is_node(const struct rig *rig, unsigned axis,
                                  unsigned other)
{
    return rig->axis[other].bus == rig->axis[axis].bus &&
           rig->axis[other].node_id == rig->axis[axis].node_id;
}

/* The first axis of its node: what the node says goes through its port. */
static unsigned machine_fault_speaker(const struct rig *rig, unsigned axis)
{
    unsigned i = 0;
    while (!machine_fault_is_node(rig, axis, i))
        i++;
    return i;
}

/* Every axis of a node hears through a port of its own. */
static int machine_fault_place_frames(struct machine_fault *self,
                                      const struct fault_entry *entry,
                                      uint64_t seed)
{
    const struct rig *rig = self->sim->rig;
    const unsigned speaker = machine_fault_speaker(rig, entry->index);
    struct sim_servo *servo = machine_fault_servo(self->sim, speaker);
    int err = MOTION_OK;
    if (servo == NULL) {
        struct sim_modbus_faulty *faulty =
            &machine_sim_modbus_servo(self->sim, entry->index)->faulty;
        faulty->seed = seed;
        faulty->from.resends = faulty->to.resends =
            rig->bus[rig->axis[entry->index].bus].kind == RIG_MODBUS_TCP;
        return MOTION_OK;
    }
    if (!entry->incoming)
        return servo->port.trouble != NULL
                   ? MOTION_OK
                   : sim_can_trouble_init(&self->trouble[speaker], &servo->port,
                                          false, seed);
    for (unsigned i = speaker; i < rig->axis_count && err == MOTION_OK; i++) {
        if (!machine_fault_is_node(rig, entry->index, i))
            continue;
        servo = machine_fault_servo(self->sim, i);
        if (servo->port.trouble_in == NULL)
            err = sim_can_trouble_init(&self->trouble_in[i], &servo->port, true,
                                       seed);
    }
    return err;
}

static int machine_fault_place(struct machine_fault *self,
                               const struct fault_entry *entry, uint64_t seed)
{
    struct machine_sim *sim = self->sim;
    const uint32_t i = entry->index;
    switch (entry->kind) {
    case FAULT_HEARTBEAT_LOST:
    case FAULT_SLOW_DRIVE:
    case FAULT_WRONG_ANSWER:
    case FAULT_LOSS:
    case FAULT_DUPLICATION:
    case FAULT_JITTER:
        return machine_fault_place_frames(self, entry, seed);
    case FAULT_OTHER_MASTER:
    case FAULT_BABBLE:
    case FAULT_COLLISION:
        if (!rig_bus_is_can(&sim->rig->bus[i]))
            return machine_fault_place_talker(self, i, seed);
        if (self->intruder[i].bus == NULL)
            sim_can_port_init(&self->intruder[i], &sim->wire[i]);
        break;
    case FAULT_NOISE:
        sim->wire[i].noise_seed = seed;
        break;
    default:
        break;
    }
    return MOTION_OK;
}

int machine_fault_init(struct machine_fault *self,
                       const struct fault_script *script,
                       struct machine_sim *sim)
{
    int err = MOTION_OK;
    machine_fault_free(self);
    *self = (struct machine_fault){ .script = script, .sim = sim };
    self->trouble = memory_pool_new(&self->memory, sim->rig->axis_count,
                                    sizeof *self->trouble);
    self->trouble_in = memory_pool_new(&self->memory, sim->rig->axis_count,
                                       sizeof *self->trouble_in);
    self->intruder = memory_pool_new(&self->memory, sim->rig->bus_count,
                                     sizeof *self->intruder);
    self->talker = memory_pool_new(&self->memory, sim->rig->bus_count,
                                   sizeof *self->talker);
    self->connection = memory_pool_new(&self->memory, sim->rig->bus_count,
                                       sizeof *self->connection);
    for (unsigned i = 0; i < FAULT_EVENTS; i++)
        self->event_ns[i] = -1;
    for (unsigned i = 0; i < script->count && err == MOTION_OK; i++)
        err = machine_fault_add(self, i);
    return err;
}

int machine_fault_add(struct machine_fault *self, unsigned i)
{
    self->begun_ns[i] = -1;
    self->looked = false;
    return machine_fault_place(self, &self->script->entry[i],
                               machine_fault_seed(self->script, i));
}

void machine_fault_free(struct machine_fault *self)
{
    memory_pool_free(&self->memory);
}

/* ---- what begins and ends ---- */

int64_t machine_fault_counts(const struct machine_fault *self,
                             const struct fault_entry *entry)
{
    const int64_t most = INT64_C(1) << 31;
    int64_t counts;
    if (machine_sim_counts(&self->sim->rig->axis[entry->index], entry->value,
                           &counts) < 0)
        counts = most;
    if (entry->kind == FAULT_FRICTION_STEP && counts < 0)
        counts = -counts; /* of a reversed axis */
    return counts > most ? most : counts < -most ? -most : counts;
}

static void machine_fault_last(struct sim_servo *servo,
                               enum sim_servo_fault fault, bool begins)
{
    if (begins)
        sim_servo_inject(servo, fault);
    else
        sim_servo_end(servo, fault);
}

/* Of every axis of the node, each of which has a port of its own. */
static void machine_fault_node(struct machine_fault *self, unsigned axis,
                               enum sim_servo_fault fault, bool begins)
{
    const struct rig *rig = self->sim->rig;
    for (unsigned i = 0; i < rig->axis_count; i++)
        if (machine_fault_is_node(rig, axis, i))
            machine_fault_last(machine_fault_servo(self->sim, i), fault,
                               begins);
}

bool machine_fault_impair(struct sim_impairment *impairment,
                          const struct fault_entry *entry, bool begins)
{
    const int64_t value = begins ? entry->value : 0;
    switch (entry->kind) {
    case FAULT_SLOW_DRIVE:
        impairment->delay_ns = value;
        return true;
    case FAULT_JITTER:
        impairment->jitter_ns = value;
        return true;
    case FAULT_LOSS:
        impairment->loss_q32 = (uint64_t)value;
        return true;
    case FAULT_DUPLICATION:
        impairment->duplication_q32 = (uint64_t)value;
        return true;
    default:
        return false;
    }
}

/* What is between a drive and the bus. */
static void machine_fault_between(const struct fault_entry *entry,
                                  struct sim_servo *servo,
                                  struct sim_can_trouble *trouble, bool begins)
{
    if (machine_fault_impair(&trouble->impairment, entry, begins))
        return;
    if (entry->kind == FAULT_HEARTBEAT_LOST) {
        trouble->drops = begins;
        trouble->drop_id = servo->ops->heartbeat_id(servo);
    } else {
        trouble->spoil = (unsigned)entry->value;
    }
}

static void machine_fault_frames(struct machine_fault *self,
                                 const struct fault_entry *entry, bool begins)
{
    const struct rig *rig = self->sim->rig;
    const unsigned speaker = machine_fault_speaker(rig, entry->index);
    for (unsigned i = speaker; i < rig->axis_count; i++) {
        struct sim_servo *servo = machine_fault_servo(self->sim, i);
        if (!entry->incoming && i == speaker)
            machine_fault_between(entry, servo, servo->port.trouble, begins);
        else if (entry->incoming && machine_fault_is_node(rig, entry->index, i))
            machine_fault_between(entry, servo, servo->port.trouble_in, begins);
    }
}

static void machine_fault_can(struct machine_fault *self,
                              const struct fault_entry *entry,
                              struct sim_servo *servo, bool begins)
{
    static const enum sim_servo_fault lasting[FAULT_KINDS] = {
        [FAULT_STUCK_ENCODER] = SIM_SERVO_FROZEN,
        [FAULT_OBSTACLE] = SIM_SERVO_BLOCKED,
        [FAULT_RUNAWAY] = SIM_SERVO_REVERSED,
    };
    const int sign = begins ? 1 : -1;
    switch (entry->kind) {
    case FAULT_DRIVE:
        sim_servo_trip(servo, (uint32_t)entry->value);
        break;
    case FAULT_REBOOT:
        sim_servo_inject(servo, SIM_SERVO_REBOOT);
        break;
    case FAULT_ENCODER_JUMP:
        sim_servo_jump(servo, sign * machine_fault_counts(self, entry));
        break;
    case FAULT_FRICTION_STEP:
        sim_servo_rub(servo, begins ? machine_fault_counts(self, entry) : 0);
        break;
    case FAULT_CUT_CABLE:
        machine_fault_node(self, entry->index, SIM_SERVO_SILENT, begins);
        break;
    case FAULT_BROWN_OUT:
        machine_fault_node(self, entry->index, SIM_SERVO_POWER, begins);
        break;
    case FAULT_STUCK_ENCODER:
    case FAULT_OBSTACLE:
    case FAULT_RUNAWAY:
        machine_fault_last(servo, lasting[entry->kind], begins);
        break;
    default:
        machine_fault_frames(self, entry, begins);
        break;
    }
}

static bool machine_fault_readings(struct sim_readings *readings,
                                   const struct fault_entry *entry, bool begins)
{
    const double value = begins ? number_double(entry->value, 32) : 0;
    if (entry->kind == FAULT_OVERHEAT)
        readings->more_degc = value;
    else if (entry->kind == FAULT_SUPPLY)
        readings->more_v = value;
    else if (entry->kind == FAULT_READING_LOST)
        readings->missing = begins;
    else
        return false;
    return true;
}

static void machine_fault_axis(struct machine_fault *self,
                               const struct fault_entry *entry, bool begins)
{
    struct sim_servo *servo = machine_fault_servo(self->sim, entry->index);
    struct sim_readings *readings =
        servo != NULL
            ? &servo->readings
            : &machine_sim_modbus_servo(self->sim, entry->index)->readings;
    if (machine_fault_readings(readings, entry, begins))
        return;
    if (servo != NULL)
        machine_fault_can(self, entry, servo, begins);
    else
        machine_fault_modbus(self, entry, entry->index, begins);
}

/* Every drive on the bus is cut off. */
static void machine_fault_cut(struct machine_fault *self,
                              const struct fault_entry *entry, bool begins)
{
    const struct rig *rig = self->sim->rig;
    for (unsigned i = 0; i < rig->axis_count; i++)
        if (rig->axis[i].bus == entry->index)
            machine_fault_last(machine_fault_servo(self->sim, i),
                               SIM_SERVO_SILENT, begins);
}

static void machine_fault_intrude(struct sim_can_port *intruder)
{
    static const struct hal_can_frame start_all = { .len = 2, .data = { 1 } };
    (void)hal_can_send(&intruder->can, &start_all);
}

/* As much as it can send until the next step, and more. */
static void machine_fault_babble(struct machine_fault *self)
{
    static const struct hal_can_frame frame = { .id = 0x001, .len = 8 };
    for (unsigned i = 0; i < self->script->count; i++) {
        const struct fault_entry *entry = &self->script->entry[i];
        if (entry->kind != FAULT_BABBLE || (self->active >> i & 1) == 0 ||
            !rig_bus_is_can(&self->sim->rig->bus[entry->index]))
            continue;
        while (hal_can_send(&self->intruder[entry->index].can, &frame) ==
               MOTION_OK)
            ;
    }
}

static void machine_fault_bus(struct machine_fault *self,
                              const struct fault_entry *entry, bool begins)
{
    struct sim_can_port *port = &self->sim->port[entry->index];
    if (!rig_bus_is_can(&self->sim->rig->bus[entry->index])) {
        machine_fault_modbus_line(self, entry, begins);
        return;
    }
    switch (entry->kind) {
    case FAULT_BUS_OFF:
        if (!begins)
            sim_can_port_restart(port);
        port->destroy = begins ? FAULT_BUS_OFF_ERRORS : 0;
        break;
    case FAULT_BUS_ERRORS:
        port->destroy = (unsigned)entry->value;
        break;
    case FAULT_INTERFACE_DOWN:
        sim_can_port_set_off(port, begins);
        break;
    case FAULT_OTHER_MASTER:
        machine_fault_intrude(&self->intruder[entry->index]);
        break;
    case FAULT_BABBLE: /* machine_fault_step */
        break;
    case FAULT_NOISE:
        port->bus->noise_q32 = begins ? (uint64_t)entry->value : 0;
        break;
    default:
        machine_fault_cut(self, entry, begins);
        break;
    }
}

static void machine_fault_line(struct machine_fault *self,
                               const struct fault_entry *entry, bool begins)
{
    const bool active_low = self->sim->rig->line[entry->index].active_low;
    const bool active = entry->value == FAULT_LEVEL_ACTIVE;
    if (!begins)
        machine_sim_let_go(self->sim, entry->index);
    else if (entry->value == FAULT_LEVEL_OPEN)
        machine_sim_stick(self->sim, entry->index, SIM_GPIO_OPEN);
    else
        machine_sim_stick(self->sim, entry->index,
                          active != active_low ? SIM_GPIO_HIGH : SIM_GPIO_LOW);
}

static void machine_fault_happen(struct machine_fault *self, unsigned i,
                                 bool begins)
{
    static void (*const happen[])(struct machine_fault * self,
                                  const struct fault_entry *entry,
                                  bool begins) = {
        [FAULT_OF_AXIS] = machine_fault_axis,
        [FAULT_OF_BUS] = machine_fault_bus,
        [FAULT_OF_LINE] = machine_fault_line,
    };
    const struct fault_entry *entry = &self->script->entry[i];
    happen[entry->target](self, entry, begins);
}

/* ---- when ---- */

static void machine_fault_note(struct machine_fault *self,
                               enum fault_event event, int64_t now_ns)
{
    if (self->event_ns[event] < 0)
        self->event_ns[event] = now_ns;
}

static void machine_fault_events(struct machine_fault *self, int64_t now_ns,
                                 enum telemetry_phase phase,
                                 enum controller_state state)
{
    static const enum fault_event event[TELEMETRY_PHASES] = {
        [TELEMETRY_ENABLE] = FAULT_ON_ENABLE,
        [TELEMETRY_HOME] = FAULT_ON_HOME,
        [TELEMETRY_APPROACH] = FAULT_ON_APPROACH,
        [TELEMETRY_MOVE] = FAULT_ON_MOVE,
        [TELEMETRY_SETTLE] = FAULT_ON_SETTLE,
        [TELEMETRY_STOP] = FAULT_ON_OFF,
    };
    machine_fault_note(self, event[phase], now_ns);
    if (state == CONTROLLER_HOLDING)
        machine_fault_note(self, FAULT_ON_HOLD, now_ns);
    if (state == CONTROLLER_STOPPING)
        machine_fault_note(self, FAULT_ON_STOP, now_ns);
    if (state == CONTROLLER_FAULT)
        machine_fault_note(self, FAULT_ON_FAULT, now_ns);
}

static bool machine_fault_passes(struct machine_fault *self, unsigned i)
{
    const struct fault_entry *entry = &self->script->entry[i];
    const int64_t before_q32 = self->pos_q32[i];
    const int64_t now_q32 = machine_sim_pos_q32(self->sim, entry->of_axis) +
                            self->sim->zero_q32[entry->of_axis];
    self->pos_q32[i] = now_q32;
    return self->looked &&
           (before_q32 < entry->pos_q32) != (now_q32 < entry->pos_q32);
}

static bool machine_fault_is_due(struct machine_fault *self, unsigned i,
                                 int64_t now_ns)
{
    const struct fault_entry *entry = &self->script->entry[i];
    const int64_t event_ns = self->event_ns[entry->event];
    if (entry->by_position)
        return machine_fault_passes(self, i);
    return event_ns >= 0 && now_ns - event_ns >= entry->after_ns;
}

static void machine_fault_entry(struct machine_fault *self, unsigned i,
                                int64_t now_ns)
{
    const struct fault_entry *entry = &self->script->entry[i];
    const uint64_t bit = (uint64_t)1 << i;
    const bool lasts = entry->for_ns > 0;
    if (self->begun_ns[i] < 0) {
        if (!machine_fault_is_due(self, i, now_ns))
            return;
        self->begun_ns[i] = now_ns;
        self->active |= bit;
        machine_fault_happen(self, i, true);
    } else if ((self->active & bit) != 0 && lasts &&
               now_ns - self->begun_ns[i] >= entry->for_ns) {
        self->active &= ~bit;
        machine_fault_happen(self, i, false);
    } else if (fault_kind_is_over_at_once(entry->kind)) {
        self->active &= ~bit;
    }
}

void machine_fault_step(struct machine_fault *self, int64_t now_ns,
                        enum telemetry_phase phase, enum controller_state state)
{
    machine_fault_events(self, now_ns, phase, state);
    for (unsigned i = 0; i < self->script->count; i++)
        machine_fault_entry(self, i, now_ns);
    machine_fault_babble(self);
    machine_fault_connect(self);
    self->looked = true;
}

void machine_fault_end(struct machine_fault *self, unsigned i)
{
    const uint64_t bit = (uint64_t)1 << i;
    if ((self->active & bit) != 0)
        machine_fault_happen(self, i, false);
    self->active &= ~bit;
}

/* ---- what it did ---- */

void machine_fault_print(const struct machine_fault *self, FILE *file)
{
    char text[FAULT_TEXT_MAX], seconds[NUMBER_MAX];
    for (unsigned i = 0; i < self->script->count; i++) {
        fault_entry_text(&self->script->entry[i], self->sim->rig, text);
        number_seconds(seconds, (self->begun_ns[i] - self->start_ns) * 4096);
        if (self->begun_ns[i] < 0)
            fprintf(file, "script: not reached: %s\n", text);
        else
            fprintf(file, "script: %s s: %s\n", seconds, text);
    }
}

void machine_fault_json(const struct machine_fault *self, struct cJSON *object)
{
    char text[FAULT_TEXT_MAX];
    cJSON *list = cJSON_AddArrayToObject(object, "faults");
    for (unsigned i = 0; i < self->script->count; i++) {
        const struct fault_entry *entry = &self->script->entry[i];
        cJSON *item = cJSON_CreateObject();
        cJSON_AddStringToObject(item, "fault", fault_kind_words[entry->kind]);
        cJSON_AddStringToObject(item, "text",
                                fault_entry_text(entry, self->sim->rig, text));
        if (self->begun_ns[i] >= 0)
            cJSON_AddNumberToObject(
                item, "t_s",
                (double)(self->begun_ns[i] - self->start_ns) / 1e9);
        else
            cJSON_AddNullToObject(item, "t_s");
        cJSON_AddItemToArray(list, item);
    }
}

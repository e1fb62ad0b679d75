/* firmware/linux/machine/machine_fault_modbus.c - what a fault script does to a
 * simulated Modbus servo; see machine_fault.h. */
#include "firmware/linux/machine/machine_fault.h"

static void machine_fault_last(struct sim_modbus_servo *servo,
                               enum sim_modbus_servo_fault fault, bool begins)
{
    if (begins)
        sim_modbus_servo_inject(servo, fault);
    else
        sim_modbus_servo_end(servo, fault);
}

static void machine_fault_modbus_servo(struct machine_fault *self,
                                       const struct fault_entry *entry,
                                       struct sim_modbus_servo *servo,
                                       bool begins)
{
    switch (entry->kind) {
    case FAULT_DRIVE:
        servo->alarm = (uint32_t)entry->value;
        sim_modbus_servo_inject(servo, SIM_MODBUS_SERVO_ALARM);
        break;
    case FAULT_STUCK_ENCODER:
        machine_fault_last(servo, SIM_MODBUS_SERVO_FROZEN, begins);
        break;
    case FAULT_ENCODER_JUMP:
        servo->jump_counts += begins ? machine_fault_counts(self, entry)
                                     : -machine_fault_counts(self, entry);
        break;
    case FAULT_REBOOT:
    case FAULT_BROWN_OUT:
        machine_fault_last(servo, SIM_MODBUS_SERVO_OFF, begins);
        break;
    case FAULT_FRICTION_STEP:
        servo->plant.friction_q8 =
            begins ? machine_fault_counts(self, entry) * 256 : 0;
        break;
    case FAULT_OBSTACLE:
        machine_fault_last(servo, SIM_MODBUS_SERVO_BLOCKED, begins);
        break;
    case FAULT_RUNAWAY:
        servo->plant.reversed = begins;
        break;
    default:
        break;
    }
}

static void machine_fault_spoil(struct sim_modbus_direction *direction,
                                enum sim_modbus_fault fault, bool begins)
{
    direction->fault = begins ? fault : SIM_MODBUS_GOOD;
    direction->times = 0;
    direction->share_q32 = 0;
}

void machine_fault_modbus(struct machine_fault *self,
                          const struct fault_entry *entry, unsigned i,
                          bool begins)
{
    struct sim_modbus_servo *servo = machine_sim_modbus_servo(self->sim, i);
    struct sim_modbus_direction *direction =
        entry->incoming ? &servo->faulty.to : &servo->faulty.from;

    if (machine_fault_impair(&direction->impairment, entry, begins))
        return;
    switch (entry->kind) {
    case FAULT_CUT_CABLE:
        machine_fault_spoil(&servo->faulty.from, SIM_MODBUS_MUTE, begins);
        machine_fault_spoil(&servo->faulty.to, SIM_MODBUS_MUTE, begins);
        break;
    case FAULT_WRONG_ANSWER:
        machine_fault_spoil(direction, SIM_MODBUS_OTHER_UNIT, begins);
        direction->times = (unsigned)entry->value;
        break;
    case FAULT_NOISE:
        machine_fault_spoil(direction, SIM_MODBUS_FLIP, begins);
        direction->share_q32 = (uint64_t)entry->value;
        break;
    default:
        machine_fault_modbus_servo(self, entry, servo, begins);
        break;
    }
}

/* ---- a line ---- */

/* Silences of a line that another master leaves, so that we get a turn too. */
#define FAULT_PAUSE_NS INT64_C(20000000)
#define TRIES          3 /* of a connection */

int machine_fault_place_talker(struct machine_fault *self, unsigned bus,
                               uint64_t seed)
{
    struct sim_modbus_intruder *talker = &self->talker[bus];

    if (talker->seed != 0)
        return MOTION_OK;
    return sim_modbus_intruder_init(
        talker, machine_sim_modbus_wire(self->sim, bus), seed);
}

/* The first drive's unit: other masters ask the same ones. */
static uint8_t machine_fault_unit(const struct rig *rig, unsigned bus)
{
    unsigned i = 0;

    while (i + 1 < rig->axis_count && rig->axis[i].bus != bus)
        i++;
    return rig->axis[i].node_id;
}

static void machine_fault_talk(struct machine_fault *self, unsigned bus,
                               bool another_master, bool begins)
{
    struct sim_modbus_intruder *talker = &self->talker[bus];

    talker->unit = another_master ? machine_fault_unit(self->sim->rig, bus) : 0;
    talker->pause_ns = another_master ? FAULT_PAUSE_NS : 0;
    talker->next_ns = talker->seat.line->world->now_ns;
    talker->on = begins;
}

static void machine_fault_drives(struct machine_fault *self,
                                 const struct fault_entry *entry, bool begins)
{
    for (unsigned i = 0; i < self->sim->rig->axis_count; i++)
        if (self->sim->rig->axis[i].bus == entry->index &&
            !rig_kinds[self->sim->rig->axis[i].kind]->samples)
            machine_fault_modbus(self, entry, i, begins);
}

void machine_fault_modbus_line(struct machine_fault *self,
                               const struct fault_entry *entry, bool begins)
{
    const unsigned bus = entry->index;
    struct sim_modbus_line *line = machine_sim_modbus_wire(self->sim, bus);

    switch (entry->kind) {
    case FAULT_CUT_CABLE: /* boards are on it, too */
        line->cut = begins;
        machine_fault_drives(self, entry, begins);
        break;
    case FAULT_ECHO:
        line->echo = begins || self->sim->rig->bus[bus].modbus.echo;
        break;
    case FAULT_TURN_AROUND:
        line->turn_ns = begins ? entry->value : 0;
        break;
    case FAULT_BABBLE:
    case FAULT_COLLISION:
        machine_fault_talk(self, bus, entry->kind == FAULT_COLLISION, begins);
        break;
    case FAULT_HALF_OPEN:
        line->deaf = begins;
        break;
    case FAULT_HANG_UP:
        line->closed = begins;
        self->sim->master[bus].down = false;
        self->connection[bus].closed_ns = self->sim->world.now_ns;
        break;
    default:
        machine_fault_drives(self, entry, begins);
        break;
    }
}

static void machine_fault_forget(struct machine_sim *sim, unsigned bus)
{
    for (unsigned i = 0; i < sim->rig->axis_count; i++) {
        if (sim->rig->axis[i].bus != bus ||
            rig_kinds[sim->rig->axis[i].kind]->samples)
            continue;
        struct sim_modbus_servo *servo = sim->servo[i];
        sim_modbus_direction_forget(&servo->faulty.from);
        sim_modbus_direction_forget(&servo->faulty.to);
    }
}

/* Keep a connection as hal/linux/libmodbus.h does: a late answer is dropped by its
 * number, a connection that has said nothing to three requests is made anew, one that
 * was closed is gone after three time-outs. */
static void machine_fault_look(struct machine_fault *self, unsigned bus)
{
    struct machine_sim *sim = self->sim;
    struct machine_fault_connection *connection = &self->connection[bus];
    struct sim_modbus_line *line = &sim->modbus_line[bus];
    struct modbus_master *master = &sim->master[bus];

    master->down = line->closed && sim->world.now_ns - connection->closed_ns >=
                                       TRIES * master->config.timeout_ns;
    if (master->stats.timeouts == connection->timeouts)
        return;
    connection->timeouts = master->stats.timeouts;
    connection->silent = line->deaf ? connection->silent + 1 : 0;
    line->deaf = line->deaf && connection->silent < TRIES;
    machine_fault_forget(sim, bus);
}

void machine_fault_connect(struct machine_fault *self)
{
    for (unsigned i = 0; i < self->sim->rig->bus_count; i++)
        if (self->sim->rig->bus[i].kind == RIG_MODBUS_TCP)
            machine_fault_look(self, i);
}

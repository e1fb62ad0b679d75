/* firmware/linux/machine/machine_fault_modbus.c - what a fault script does to a
 * simulated Modbus servo; see machine_fault.h. */
#include "firmware/linux/machine/machine_fault.h"

static void machine_fault_answers(struct sim_modbus_faulty *faulty,
                                  enum sim_modbus_fault fault, bool begins)
{
    faulty->fault = begins ? fault : SIM_MODBUS_GOOD;
    faulty->times = 0;
    faulty->share_q32 = 0;
}

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

void machine_fault_modbus(struct machine_fault *self,
                          const struct fault_entry *entry, unsigned i,
                          bool begins)
{
    struct sim_modbus_servo *servo = machine_sim_modbus_servo(self->sim, i);
    struct sim_modbus_faulty *faulty = &servo->faulty;

    switch (entry->kind) {
    case FAULT_CUT_CABLE:
        machine_fault_answers(faulty, SIM_MODBUS_MUTE, begins);
        break;
    case FAULT_SLOW_DRIVE:
        machine_fault_answers(faulty, SIM_MODBUS_LATE, begins);
        faulty->late_ns = entry->value;
        break;
    case FAULT_WRONG_ANSWER:
        machine_fault_answers(faulty, SIM_MODBUS_OTHER_UNIT, begins);
        faulty->times = (unsigned)entry->value;
        break;
    case FAULT_NOISE:
        machine_fault_answers(faulty, SIM_MODBUS_FLIP, begins);
        faulty->share_q32 = (uint64_t)entry->value;
        break;
    default:
        machine_fault_modbus_servo(self, entry, servo, begins);
        break;
    }
}

/* hal/drive/odrive/drive.h - an ODrive axis over CANSimple.
 *
 * Start-up: a heartbeat; which family the firmware is of (asked for its
 * version,
 * 0.5 does not answer); where config says so, the watchdog is set and read back
 * (0.6); the first position -> HAL_DRIVE_OFF.
 * Enable: Set_Controller_Mode position/passthrough, Set_Input_Pos where it is,
 * Set_Axis_State closed loop; done when a heartbeat says so.
 * Every cycle while enabled: Set_Input_Pos with velocity and torque
 * feed-forward.
 * Positions: what the drive sends by itself; in a cycle without one it is asked
 * (remote frame), which feeds its watchdog too.
 * Torque: where config says so it is asked for every 10 ms, by Get_Torques, and
 * of firmware 0.5 as the current of Get_Iq; not known 30 ms after an answer.
 * Readings (hal/readings.h): Get_Temperature (the power stage or the motor,
 * whichever is hotter; firmware 0.5 has none, which is refused at start-up),
 * Get_Bus_Voltage_Current, Get_Iq; behind the set point of a cycle.
 * Off: Set_Axis_State idle, and Estop when that does not help; both let the
 * motor coast: a vertical axis needs a brake.
 *
 * A heartbeat is all that an ODrive says of its state, so a drive that disarms
 * itself is known after one heartbeat period (its config, 100 ms); the
 * controller sees it earlier, by the following error.
 *
 * Modes: streamed position, profile position (the trapezoidal trajectory),
 * homing (state 11, by the drive's own end stops and speeds; method and speeds
 * of hal_drive_home do not matter).  The quick stop and the halt of a go are
 * ramps of ours in passthrough, those of a homing too, after closed loop.  It
 * ends on the drive's position 0, which is the home point; the drive goes on
 * counting from there.
 * fault_code is the number of the lowest error bit, plus 1.
 *
 * Source: ODrive firmware 0.5.6 (can_simple.cpp) and its CAN protocol page;
 * ODrive documentation 0.6, "CANSimple protocol". */
#ifndef HAL_DRIVE_ODRIVE_DRIVE_H
#define HAL_DRIVE_ODRIVE_DRIVE_H

#include "hal/can/bus.h"
#include "hal/drive/turn/drive.h"

MOTION_C_BEGIN

#define DRIVE_ODRIVE_NODE_MAX 0x3E

enum drive_odrive_family {
    DRIVE_ODRIVE_REQUEST, /* by its version */
    DRIVE_ODRIVE_05,
    DRIVE_ODRIVE_06,
};

struct drive_odrive_config {
    uint8_t node; /* 0 .. DRIVE_ODRIVE_NODE_MAX */
    enum drive_odrive_family family;
    struct drive_turn_config turn;
    int64_t heartbeat_ns; /* the drive's; lost after three; 0: 100 ms */
    int64_t silence_ns;   /* lost without a position for so long; 0: 50 ms */
    /* 0.6: where its parameters axis0.config.enable_watchdog and
     * .watchdog_timeout are, by its flat_endpoints.json, and the time that is
     * written there; 0, 0: its watchdog is not looked at */
    uint16_t enable_watchdog, watchdog_timeout;
    int64_t watchdog_ns;
    bool reads_torque;
    /* 0.5: Nm per A, its motor.config.torque_constant, >= 0; 0: its torque is
     * not known */
    int64_t torque_constant_q32;
};

enum drive_odrive_start {
    DRIVE_ODRIVE_HEARTBEAT,
    DRIVE_ODRIVE_VERSION,
    DRIVE_ODRIVE_PARAMETERS, /* written and read back */
    DRIVE_ODRIVE_POSITION,
    DRIVE_ODRIVE_FOUND,
};

/* Visible so that it can be static; use the functions. */
struct drive_odrive {
    struct drive_turn turn; /* the drive is turn.drive */
    struct can_bus_node node;
    struct drive_odrive_config config;
    uint32_t watchdog_s; /* a float */

    enum drive_odrive_start start;
    enum drive_odrive_family family;
    unsigned parameter, tries; /* being written */
    int64_t requested_ns;      /* 0: not yet */

    int64_t heartbeat_ns; /* last heard; 0: never */
    uint32_t error, reason;
    uint8_t axis_state;
    uint8_t result;    /* 0.6: of the last procedure */
    uint8_t parts;     /* 0.5: which have an error; 1 motor, 2 encoder,
                       4 controller */
    int64_t torque_ns; /* heard */
    int64_t torque_due_ns;
    bool was_told; /* a position since the last cycle */
    bool is_nan;   /* what it said as its position last is no number */
    bool passes;   /* in passthrough, as far as we have told it */
    bool reason_heard;
    int64_t reason_due_ns;
    uint8_t version[8]; /* 0.6: as Get_Version has it */
};

/* Adds the drive to the bus.  MOTION_E_ARG, MOTION_E_RANGE for a config outside
 * its ranges. */
int drive_odrive_init(struct drive_odrive *self, struct can_bus *bus,
                      const struct drive_odrive_config *config);

/* Set_Input_Pos. */
void drive_odrive_put_point(struct hal_can_frame *frame, uint8_t node,
                            const struct drive_turn_point *point);

/* Words for the lowest bit of an error, "unknown error"; "no error" for 0.
 * Never NULL. */
const char *drive_odrive_error_text(enum drive_odrive_family family,
                                    uint32_t error);
/* Words for an axis state, "unknown state"; never NULL. */
const char *drive_odrive_state_text(unsigned state);
/* Words for the result of a procedure (0.6), "unknown result"; never NULL. */
const char *drive_odrive_result_text(unsigned result);

MOTION_C_END

#endif

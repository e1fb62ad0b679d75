/* hal/drive/odrive/parts.h - private to the ODrive driver. */
#ifndef HAL_DRIVE_ODRIVE_PARTS_H
#define HAL_DRIVE_ODRIVE_PARTS_H

#include "hal/drive/odrive/drive.h"

/* The lower five bits of an identifier; the node number is above them. */
enum odrive_command {
    ODRIVE_GET_VERSION = 0x00, /* 0.6 */
    ODRIVE_HEARTBEAT = 0x01,
    ODRIVE_ESTOP = 0x02,
    ODRIVE_GET_ERROR = 0x03, /* 0.6; motor error in 0.5 */
    ODRIVE_RX_SDO = 0x04,    /* 0.6: to the drive; encoder error in 0.5 */
    ODRIVE_TX_SDO = 0x05,    /* 0.6; sensorless error in 0.5 */
    ODRIVE_SET_AXIS_STATE = 0x07,
    ODRIVE_GET_ESTIMATES = 0x09,
    ODRIVE_SET_MODE = 0x0B,
    ODRIVE_SET_INPUT_POS = 0x0C,
    ODRIVE_SET_INPUT_VEL = 0x0D,
    ODRIVE_SET_INPUT_TORQUE = 0x0E,
    ODRIVE_SET_TRAJ_VEL = 0x11,
    ODRIVE_SET_TRAJ_ACC = 0x12,
    ODRIVE_GET_IQ = 0x14,
    ODRIVE_GET_TEMPERATURE = 0x15, /* 0.6; sensorless estimates in 0.5 */
    ODRIVE_GET_SUPPLY = 0x17,      /* Get_Bus_Voltage_Current */
    ODRIVE_CLEAR_ERRORS = 0x18,
    ODRIVE_GET_TORQUES = 0x1C, /* 0.6; ADC voltage in 0.5 */
};

enum odrive_state {
    ODRIVE_IDLE = 1,
    ODRIVE_CLOSED_LOOP = 8,
    ODRIVE_HOMING = 11,
};

enum odrive_control { ODRIVE_CONTROL_VELOCITY = 2, ODRIVE_CONTROL_POSITION };
enum odrive_input { ODRIVE_PASSTHROUGH = 1, ODRIVE_TRAPEZOIDAL = 5 };

/* ---- odrive_wire.c: frames ---- */

extern const struct can_bus_node_ops drive_odrive_node_ops;
void odrive_request(struct drive_odrive *self, enum odrive_command command);
int odrive_send(struct drive_odrive *self, enum odrive_command command,
                const uint8_t *data, unsigned length);
int odrive_send_u32(struct drive_odrive *self, enum odrive_command command,
                    uint32_t first, uint32_t second, unsigned count);

/* The set point of now. */
void odrive_send_target(struct drive_odrive *self);

/* Is there an error by the last heartbeat, and which? */
void odrive_say(struct drive_odrive *self);

/* ---- odrive_home.c: homing ---- */

int odrive_seek(struct drive_turn *turn);

/* ---- odrive.c ---- */

void odrive_arm(struct drive_turn *turn, bool again);

/* ---- odrive_start.c: from silence to off ---- */

void odrive_start(struct drive_turn *turn);
int odrive_start_step(struct drive_turn *turn);
/* TxSdo, and Get_Version. */
void odrive_take_parameter(struct drive_odrive *self, const uint8_t data[8]);
void odrive_take_version(struct drive_odrive *self, const uint8_t data[8]);

#endif

/* hal/drive/moteus/drive.h - a moteus servo by its CAN FD registers.
 *
 * Start-up: it answers, in whatever mode; then -> HAL_DRIVE_OFF.  Every cycle
 * one frame asks for mode, position, velocity, torque and fault; while enabled
 * the same frame carries the set point: mode position, position, velocity and
 * torque feed-forward, its watchdog time, and that its own limits do not shape
 * what is streamed.  Between two set points the drive goes on at the velocity
 * of the last.  Enable: stop (mode 0) until it says so, then the first set
 * point; done when it answers with mode 10.  Off: stop; torque is gone at once.
 * The watchdog runs out into mode 11, which stays until mode 0 is written: a
 * fault like those of mode 1.  Nothing writes mode 0 to a drive with a fault
 * but a reset.
 * Readings (hal/readings.h): every answer has the voltage, in steps of 0.5 V to
 * 63.5 V, and the temperature of the board, in whole degC; the q current is asked
 * for beside them when it is due.
 *
 * Modes: streamed position; profile position and velocity by its own limits of
 * velocity and acceleration (one of them: that of the go's acceleration; a
 * deceleration is not known to it).
 *
 * Source: mjbots moteus, docs/protocol/can.md, docs/protocol/registers.md. */
#ifndef HAL_DRIVE_MOTEUS_DRIVE_H
#define HAL_DRIVE_MOTEUS_DRIVE_H

#include "hal/can/bus.h"
#include "hal/drive/moteus/frame.h"
#include "hal/drive/turn/drive.h"

MOTION_C_BEGIN

struct drive_moteus_config {
    uint8_t id;          /* 1..127 */
    bool switched;       /* data at the faster bit rate */
    int64_t watchdog_ns; /* whole ms, 1 ms .. 1 s; 0: 100 ms */
    int64_t silence_ns;  /* lost without an answer for so long; 0: 50 ms */
    struct drive_turn_config turn;
};

/* Visible so that it can be static; use the functions. */
struct drive_moteus {
    struct drive_turn turn; /* the drive is turn.drive */
    struct can_bus_node node;
    struct drive_moteus_config config;
    uint16_t watchdog_ms;
    int64_t request_ns;
    bool heard, stopping; /* stopping: mode 0 is to be written */
    bool is_nan;          /* its last answer had no number as position */
    uint8_t mode;         /* enum moteus_mode and others, as answered */
    int64_t heard_ns;
};

/* Adds the drive to the bus.  MOTION_E_ARG, MOTION_E_RANGE for a config outside
 * its ranges. */
int drive_moteus_init(struct drive_moteus *self, struct can_bus *bus,
                      const struct drive_moteus_config *config);

/* The sub-frames of a set point, and the questions that stand behind it. */
void drive_moteus_put_point(struct hal_can_frame *frame, uint16_t watchdog_ms,
                            const struct drive_turn_point *point);
void drive_moteus_put_questions(struct hal_can_frame *frame);

/* Words for a fault code, "unknown fault"; never NULL. */
const char *drive_moteus_fault_text(unsigned fault);
/* Words for a mode, "unknown mode"; never NULL. */
const char *drive_moteus_mode_text(unsigned mode);

MOTION_C_END

#endif

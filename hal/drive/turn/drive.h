/* hal/drive/turn/drive.h - what the drives have in common that take set points
 * in turns of the motor whenever a frame comes, each of them in a folder
 * of its own.
 *
 *              found, position known        arm until armed
 *   START ---------------------------> RUN: off <------------> enabled
 *     ^                                 |  ^     disarm
 *     | request RESET                   |  | clear until well, disarm
 *   LOST <------------------------- LATCHED <-------------> RESET
 *        nothing heard, no position     alarm, disarmed by itself, a wait that
 *                                       took too long
 *
 * A drive that was LOST may hear all the same.  One that followed set points is
 * ramped down by them, from the last one on; one that moved by its own profile
 * from where it is, while that is still heard, else by its velocity alone, from
 * the one that was heard last.  Then it is disarmed every 150 ms until it says
 * that it has no torque.  A reset looks for it anew when the ramp is over, and goes
 * on disarming it.  One that is heard again is not disarmed blindly: it is ramped
 * down from where it is, when it is found at the latest.
 *
 * The wire part says what it hears (armed, alarmed, where it is) and has five
 * calls that send; this part is everything else.  A quick stop is a ramp of our
 * own: these drives have none that is both braked and requested in one frame.
 * It starts at the last set point, or where the axis is while the drive moves
 * by its own profile or homes, which it leaves for set points then; when the bus
 * is dead, the drive's watchdog has to do.
 *
 * Request OFF ramps down whatever moves and disarms the drive when the axis
 * stands by what is heard, HAL_DRIVE_ROLL_NS after the ramp at the latest.  So is
 * a drive that is found armed, or homing.  A homing whose drive does not take set
 * points within state_timeout_ns, or that is lost and not heard any more, is
 * disarmed as it is, and so is every drive by TORQUE_OFF.
 *
 * Which set point was in force when the position was measured: the newest that
 * had been given latency_ns before.  A drive that `extrapolates` goes on from
 * it at its velocity until the next one comes. */
#ifndef HAL_DRIVE_TURN_DRIVE_H
#define HAL_DRIVE_TURN_DRIVE_H

#include "hal/drive.h"
#include "hal/readings.h"
#include "hal/support/ratio.h"
#include "hal/support/standstill.h"
#include "hal/support/text.h"

#define DRIVE_TURN_HISTORY 32 /* set points kept to judge following */
/* Farthest set point: beyond it single precision is coarser than 0.004 turns,
 * and a drive may count no further. */
#define DRIVE_TURN_MAX 32768

struct drive_turn_config {
    /* one unit = turns_num / turns_den turns; num != 0 (negative: reversed),
     * den > 0 */
    int64_t turns_num, turns_den;
    int64_t period_ns;        /* tick, 62500 ns .. 20 ms */
    int64_t latency_ns;       /* from a tick until the drive has its set point;
                                 0: half a period */
    int64_t answer_ns;        /* a position's time on the wire */
    int64_t state_timeout_ns; /* to arm, to disarm, to clear; 0: 1 s */
    int64_t stop_acc_q32;     /* unit/s2 of the quick stop, > 0 */
    int64_t
        vel_max_q32;   /* unit/s of the axis: a thousandth of it is standing; 0:
                            by its positions alone */
    unsigned readings; /* 1 << enum hal_reading: those that are read */
    int64_t first_step_max_q32; /* as hal/drive/cia402/drive.h; 0: 1 unit */
    int32_t rated_torque_mnm;   /* torque_permille is of it; 0: no torque */
};

enum drive_turn_phase {
    DRIVE_TURN_START,
    DRIVE_TURN_RUN,
    DRIVE_TURN_LATCHED,
    DRIVE_TURN_RESET,
    DRIVE_TURN_LOST,
};

enum drive_turn_motion {
    DRIVE_TURN_FOLLOW, /* the set points; without a new one it stands */
    DRIVE_TURN_RAMP,   /* to standstill, then FOLLOW */
    DRIVE_TURN_SLOW, /* the same by velocity alone: where it is is not known */
    DRIVE_TURN_GO,   /* by the drive's profile, to or at go */
    DRIVE_TURN_HOME, /* by the drive itself */
};

struct drive_turn;

/* What the wire part does.  The first six are needed. */
struct drive_turn_ops {
    unsigned modes; /* 1 << enum hal_drive_mode: those it has */
    void (*start)(struct drive_turn *self); /* look for it anew */
    /* Every cycle until MOTION_OK; MOTION_E_AGAIN; else fault_text is said.  One
     * that homes is left with `motion` saying so. */
    int (*start_step)(struct drive_turn *self);
    /* Every cycle while it is to be armed and is not, and so on: send it when
     * `again`, which is at first and then every so often. */
    void (*arm)(struct drive_turn *self, bool again);
    void (*disarm)(struct drive_turn *self, bool again);
    void (*clear)(struct drive_turn *self, bool again);
    /* Every cycle of a homing, from self->home.step 0 on, until it is armed
     * again at its end: MOTION_OK; MOTION_E_AGAIN; MOTION_E_REFUSED: it failed,
     * but is armed; else fault_text is said.  NULL: it has no homing. */
    int (*seek)(struct drive_turn *self);
    /* Out of a homing: follow set points, from the one of now on.  Where there is
     * a seek. */
    void (*break_off)(struct drive_turn *self);
};

/* A set point as it is written on the wire: in turns, as the drive counts. */
struct drive_turn_point {
    int64_t pos_q32, vel_q32;
    int32_t torque_mnm;
};

struct drive_turn_past {
    int64_t given_ns, pos_q32, vel_q32; /* turns */
};

/* Visible so that it can be static.  Positions in turns. */
struct drive_turn {
    struct hal_drive drive;
    const struct drive_turn_ops *ops;
    struct drive_turn_config config;

    /* made from config once */
    struct hal_ratio to_turns, to_unit; /* Q32 to Q32, also of velocities */
    struct hal_ratio to_acc;            /* Q32 to Q32, without the sign */
    struct hal_ratio to_mnm;            /* permille to 0.001 Nm */
    struct hal_ratio to_permille;       /* and back */
    int64_t tick_s_q60;
    int64_t stop_step_q32; /* turns/s per tick of the ramp */
    int64_t first_step_q32;
    int64_t near_q32; /* it stands: at most so far from one place */

    enum drive_turn_phase phase;
    enum hal_drive_request request;
    enum hal_drive_state state;
    enum hal_drive_mode mode;
    int64_t now_ns, since_ns, retry_ns;

    /* as the wire part heard it */
    bool armed;      /* follows set points, or moves by its profile */
    bool torque;     /* armed, or doing something else by itself */
    bool alarmed;    /* has a fault, whose text has been said */
    bool left;       /* with torque, when it was lost: `torque` is what is
                        known of it since */
    bool positioned; /* actual_q32 is known */
    bool extrapolates, go_done;
    enum hal_drive_homing homing;
    uint16_t fault_code;
    int64_t actual_q32, actual_vel_q32, actual_ns;
    int32_t torque_mnm;
    bool torque_known;
    struct hal_standstill standstill;
    struct hal_drive_found found;
    bool stops_found;  /* what was found: until it has no torque */
    int64_t silent_ns; /* the last time that no position came */
    bool returned;     /* it was LOST, and stopped when it was heard again */
    bool reset;        /* asked for while it was LOST: next */
    struct hal_readings readings;

    /* what it is told */
    enum drive_turn_motion motion;
    int64_t ramped_ns; /* its last ramp came to rest then */
    int64_t target_q32, target_vel_q32;
    int32_t target_torque_mnm;
    bool given; /* by set_target, since the last send */
    bool first_target;
    struct {
        int64_t pos_q32, vel_q32, acc_q32, dec_q32; /* acc 0: the drive's */
        int64_t sent_ns; /* by the wire part; 0: not yet */
    } go;
    struct {
        unsigned step;         /* the wire part's own */
        int64_t pos_q32;       /* of the home point */
        int64_t since_ns;      /* of the step */
        int64_t deadline_ns;   /* of all of it; of breaking it off */
        bool halted;           /* between its end and being armed again */
        bool broken_off, told; /* it is ramped down; the drive was told so */
    } home;
    int64_t origin_q32; /* of our positions, where the drive has 0 */
    struct drive_turn_past past[DRIVE_TURN_HISTORY];
    unsigned past_at, past_count;
    char fault_text[64];
    bool code_awaited; /* asked for the cause of a fault, it has not answered */
};

/* MOTION_E_ARG or MOTION_E_RANGE for a config outside its ranges.  Fills in
 * `drive`; clears the rest. */
int drive_turn_init(struct drive_turn *self, const struct drive_turn_ops *ops,
                    const struct drive_turn_config *config);

/* ---- for the wire part ---- */

#define DRIVE_TURN_NAN "its position is no number (NaN): is its encoder ready?"

/* Of begin(), after what it has heard. */
void drive_turn_step(struct drive_turn *self, int64_t now_ns);
/* Of end(), before it sends: the set point of this cycle.  False: send none. */
bool drive_turn_next(struct drive_turn *self);
/* A position as the drive counts. */
int64_t drive_turn_raw_q32(const struct drive_turn *self, int64_t pos_q32);
/* The set point of this cycle. */
struct drive_turn_point drive_turn_point(const struct drive_turn *self);
/* A position was heard, as the drive counts: measured answer_ns before t_ns.
 * False: no motor is there, or so fast; it is not believed. */
bool drive_turn_note(struct drive_turn *self, int64_t pos_q32, int64_t vel_q32,
                     int64_t t_ns);
/* Its torque was heard: a float of `nm_q32` Nm.  One that is none, or that no
 * motor has, is not known. */
void drive_turn_note_torque(struct drive_turn *self, uint32_t heard,
                            int64_t nm_q32);
/* It is not known any more. */
void drive_turn_forget_torque(struct drive_turn *self);
/* The drive has found its zero and stands on it: that is home.pos_q32. */
void drive_turn_homed(struct drive_turn *self);
/* It stands where it is: the set point is the actual position. */
void drive_turn_stand(struct drive_turn *self);
/* fault_text begins anew; more may be put to what is returned. */
struct hal_text drive_turn_say(struct drive_turn *self, const char *words);
/* fault_text has been said.  The drive is there: a fault. */
void drive_turn_latch(struct drive_turn *self);
/* It is not: offline until a reset. */
void drive_turn_lose(struct drive_turn *self);
/* It has been found and configured: silence is a fault. */
bool drive_turn_is_watched(const struct drive_turn *self);

#endif

/* hal/drive_modbus.h - a servo on a Modbus line, driven by a register map.
 *
 *   START   look for it (once a second), identify, init, disable, first polls
 *   RUN     walks to what is requested by the map's sequences, polls, streams
 *   LATCHED a fault; its torque is taken off, then waits for a reset
 *   RESET   the map's reset sequence
 *   LOST    three failures in a row, a broken connection, a position that jumps:
 *           its torque is taken off too, whether it answers or not; a reset
 *           starts anew.  The wrong drive is LOST at once: nothing is sent to
 *           it
 *
 * How torque is taken off (drive_modbus_off.c), until the drive says that it is:
 *
 *          stands, or out of time      written
 *   STOP -------------------------> DISABLE --> CONFIRM --> DONE
 *    ^  ^                              |           |   torque reads 0
 *    |  '------ heard again -----------+-----------|
 *    '------------- not confirmed: another round --'
 *
 * It goes by `torque`, or `enabled`, of the map; of a drive that has neither, the
 * writes that it confirmed must do.  A drive that says it has none is not
 * stopped, only disabled.  Nothing is believed of a drive that does
 * not answer, but it may hear: every write of the round is sent to it once,
 * 200 ms after the last one that failed, so that it costs others on the line
 * little; the wait for standstill then is that of a stop from full speed.  A
 * drive that is heard again without having confirmed its stop is polled, and
 * stopped again if it has torque, before it is disabled.  Where `stop` writes
 * what `disable` writes, it is not sent again to one that is not heard.
 *
 * Request OFF takes torque off at once (stop category 0), but for an axis that
 * moves by the drive's own profile, or brakes by its quick stop: that comes to
 * rest first, within the map's time.
 *
 * A Modbus servo has ramps of its own and no common clock, so a set point
 * cannot say "be here now".  Streamed, it says "go to where the axis will be a
 * little later, at the speed that takes you there": with the set point p, v, a
 * of the controller, the time l until the drive has it, and the time T from
 * one set point to the next,
 *
 *   target   = p(t + l + 2 T)      p(t + x) = p + v x + a x^2 / 2
 *   velocity = |v + a (l + T) + e / 4 T|      e: the following error, as polled
 *
 * so that the drive is still under way when the next one comes, and what it is
 * off is taken back over four of them.  It slows down towards a target within
 * T of it only when its ramps are steep: they are the steeper of the axis's own
 * stop and full speed in T.
 *
 * Point to point (drive_modbus_go.c), one group says where to and how fast, and
 * the drive's own profile does the rest.  Homing is the map's sequence `home`;
 * the drive then counts from 0, and from what is asked for we.
 *
 * Motion writes that fail are never repeated as they were: the next one has a
 * new target.  No answer is believed that a motor cannot have run to: one such
 * position is left out, the second in a row is a fault. */
#ifndef HAL_DRIVE_MODBUS_H
#define HAL_DRIVE_MODBUS_H

#include "hal/drive.h"
#include "hal/modbus_bus.h"
#include "hal/modbus_map.h"
#include "hal/ratio.h"
#include "hal/text.h"

#define DRIVE_MODBUS_HISTORY 64 /* set points kept to judge following */

/* A register that is written when the drive starts, and read back. */
struct drive_modbus_parameter {
    uint8_t item; /* of the map */
    int64_t value;
};

struct drive_modbus_config {
    const struct modbus_map *map; /* outlives the drive */
    uint8_t unit;                 /* 1..247; 255 on TCP */
    /* one unit = counts_num / counts_den counts; num != 0 (negative: reversed),
     * den > 0 */
    int64_t counts_num, counts_den;
    int64_t vel_max_q32, acc_q16; /* > 0: of the axis; acc that of its stop */
    int64_t cycle_ns;   /* from one set point to the next, 100 us .. 2 s */
    int64_t latency_ns; /* from the tick until the drive has it; 0: cycle / 2 */
    int64_t first_step_max_q32; /* as drive_cia402.h; 0: 1 unit */
    /* which it begins in; STREAM_POSITION: the other where the map has no
     * stream */
    enum hal_drive_mode mode;
    const struct drive_modbus_parameter *parameter; /* outlive the drive */
    unsigned parameter_count;
};

enum drive_modbus_phase {
    DRIVE_MODBUS_START,
    DRIVE_MODBUS_RUN,
    DRIVE_MODBUS_LATCHED,
    DRIVE_MODBUS_RESET,
    DRIVE_MODBUS_LOST,
};

/* A list of steps being run. */
struct drive_modbus_run {
    const struct modbus_map_sequence *sequence; /* NULL: none */
    unsigned at, tries;
    bool asked;     /* the write is under way */
    uint8_t serial; /* of what was asked last: an older reply is none of ours */
    int64_t since_ns;
};

/* Taking torque off, in LATCHED and LOST. */
enum drive_modbus_off {
    DRIVE_MODBUS_OFF_DONE, /* or never begun */
    DRIVE_MODBUS_OFF_STOP,
    DRIVE_MODBUS_OFF_DISABLE,
    DRIVE_MODBUS_OFF_CONFIRM,
};

enum drive_modbus_move {
    DRIVE_MODBUS_NO_MOVE,
    DRIVE_MODBUS_MOVE_WANTED,
    DRIVE_MODBUS_MOVE_SENT,    /* the group; then its sequence */
    DRIVE_MODBUS_MOVE_RUNNING, /* on its way */
    DRIVE_MODBUS_MOVE_HALTING, /* by the map's sequence */
};

struct drive_modbus_past {
    int64_t t_ns, pos_q32;
};

/* A field for ramps, and how counts/s2 get into it; field NULL: none. */
struct drive_modbus_ramp {
    const struct modbus_map_field *field;
    struct hal_ratio to_field; /* where `over` is 0 */
    int64_t over;              /* the field is this over counts/s2 */
};

/* Visible so that it can be static; use the functions. */
struct drive_modbus {
    struct hal_drive drive;
    struct modbus_node node;
    struct drive_modbus_config config;

    /* made from config once */
    struct hal_ratio to_counts, to_pos; /* pos_q32 and counts */
    struct hal_ratio to_speed;          /* vel_q32 to counts/s, 16 more bits */
    struct hal_ratio to_field;          /* that to the field `velocity` */
    struct hal_ratio to_register;       /* counts to the field `position` */
    int64_t pos_min, pos_max;           /* of the fields `position` */
    int64_t ramp[2];                    /* registers: acceleration, dec. */
    int64_t lead_q32, latency_q32, feed_q32; /* s: l + 2T, l, l + T */
    int64_t half_lead2_q32;                  /* s^2: lead^2 / 2 */
    int64_t gain_q16;                        /* 1/s: 1 / 4T */
    int64_t first_step_counts, jump_q16;     /* jump: counts per ns, 2^-48 */
    int64_t past_step_ns;
    struct modbus_map_block fast[MODBUS_MAP_BLOCKS_MAX];
    struct modbus_map_block slow[MODBUS_MAP_BLOCKS_MAX];
    uint8_t fast_count, slow_count;

    enum drive_modbus_phase phase;
    enum hal_drive_request request;
    enum hal_drive_state state;
    int64_t now_ns, retry_ns;
    struct drive_modbus_run run;
    uint8_t start_at; /* init, stop if it was lost with torque, disable */
    enum drive_modbus_off off;
    bool off_heard;  /* every write of this sequence was confirmed */
    bool stop_heard; /* none of the writes of `stop` went unanswered */
    bool off_failed; /* one round was not enough */
    bool off_waits;  /* for fresh polls of a drive that was heard again */
    bool reset_asked;
    int64_t off_since_ns; /* of the round, of CONFIRM */
    int64_t stop_ns;      /* from full speed to rest, and a margin */
    bool is_reached;      /* what is requested */
    bool identified, identify_asked;
    unsigned parameter_at; /* twice: written, then read back */
    unsigned parameter_tries;
    bool parameter_asked;
    bool alarm_asked;

    /* what is polled */
    int64_t value[MODBUS_MAP_ITEMS_MAX];
    uint8_t fresh; /* fast blocks since start, one bit each */
    uint8_t turn, slow_turn, slow_wait;
    uint8_t cycles;    /* all fast blocks polled so often since the last step */
    uint8_t go_at;     /* steps of stream_go already asked */
    unsigned failures; /* in a row */
    uint64_t polls, streams; /* good ones */

    int64_t actual_counts, actual_ns; /* 0: never */
    int64_t actual_vel_q32;
    bool jumped; /* the last position was left out */

    struct hal_drive_target target;
    int64_t target_ns; /* 0: none since enabled */
    bool first_target, begun, begin_asked;
    struct drive_modbus_past past[DRIVE_MODBUS_HISTORY];
    unsigned past_at, past_count;

    enum hal_drive_mode mode;
    enum drive_modbus_move move;
    struct drive_modbus_ramp move_scale[2];
    bool went, again; /* a go since enabled; another one meanwhile */
    int64_t move_pos_q32, move_vel_q32, move_ramp[2];
    int64_t moved_ns; /* was seen to move last */

    enum hal_drive_homing homing;
    int64_t home_end_ns, home_q32;
    int64_t zero_q32; /* where the axis is when the drive counts 0 */

    uint16_t fault_code;
    char fault_text[64];
};

/* Adds the node to the line.  Errors as modbus_bus_add; MOTION_E_ARG for a value
 * outside what the config says; MOTION_E_RANGE for a scale that does not
 * fit; MOTION_E_EMPTY when the map can neither move nor stream, or
 * lacks the mode.  The drive is
 * &self->drive. */
int drive_modbus_init(struct drive_modbus *self, struct modbus_bus *bus,
                      const struct drive_modbus_config *config);

#endif

/* hal/drive/modbus/drive.h - a servo on a Modbus line, driven by a register
 * map.
 *
 *   START   look for it (once a second), identify, poll it; stop, init, stop,
 *           disable; its parameters
 *   RUN     walks to what is requested by the map's sequences, polls, streams
 *   LATCHED a fault; its torque is taken off, then waits for a reset
 *   RESET   the map's reset sequence
 *   LOST    three failures in a row, a broken connection, a position that jumps:
 *           its torque is taken off too, whether it answers or not; a reset
 *           starts anew.  The wrong drive is LOST at once: nothing is sent to
 *           it
 *
 * How torque is taken off (off.c), until the drive says that it is:
 *
 *          stands, or out of time      written
 *   STOP -------------------------> DISABLE --> CONFIRM --> DONE
 *    ^  ^                              |           |   torque reads 0
 *    |  '------ heard again -----------+-----------|
 *    '------------- not confirmed: another round --'
 *
 * It goes by `torque`, or `enabled`, of the map; of a drive that has neither,
 * the writes that it confirmed must do.  A drive that says it has none is not
 * stopped, only disabled.  What could not be sent, as the connection is gone, is sent
 * when there is one.  Nothing is believed of a drive that does not answer,
 * but it may hear: every write of the round is sent to it once, 200 ms after
 * the last one that failed, so that it costs others on the line little; the
 * wait for standstill then is that of a stop from full speed.  A drive that is
 * heard again without having confirmed its stop is polled, and stopped again if
 * it has torque, before it is disabled.  Where `stop` writes what `disable`
 * writes, it is not sent again to one that is not heard.
 *
 * Request OFF writes `stop` to a drive that moves, streamed or by its own profile,
 * and `disable` once it stands: by `moving`, within the map's time, and by its
 * positions, HAL_DRIVE_ROLL_NS later at the latest.  The search does the same with
 * a drive that has torque, or moves and cannot say: before `init`, and after it
 * where it was refused without.  TORQUE_OFF writes `disable` at once.
 *
 * A Modbus servo has ramps of its own and no common clock, so a set point
 * cannot say "be here now".  Streamed, it says "be on your way to rest there,
 * at this speed at most".  With the set point p, v, a of the controller, the
 * latency l until the drive has it, the cycle T from one set point to the next,
 * and the drive's deceleration D,
 *
 *   target   = p(t + x) + v(t + x)^2 / 2 D      p(t + x) = p + v x + a x^2 / 2
 *   velocity = |v + a (l + T) + c|, rounded up to the register's step q
 *   c        = e / 4 tau, |c| <= 2 a_s tau      e: following error, as polled
 *   tau      = max(T, q / a_s, sqrt(r / 4 a_s))
 *
 * with r one count and a_s the axis's stop acceleration, which its motor must
 * be able to do.  The target is where the drive would come to rest if it began
 * to brake at x; so it need not begin before, and where no set point follows,
 * it stops by the ramp D.  D is 1.5 a_s, as its register rounds it: less than
 * the axis's limit would not follow, much more no motor would.  What is left of
 * D while the axis accelerates at its limit takes back what it was late by.  A
 * stop of a legal move lies inside the range, for D is at least its limit.
 *
 * Why tau.  The speed can change by at most a_s, so the loop of e and c is a
 * double integrator with saturation.  It follows the line c = e / 4 tau without
 * overshoot while that asks for no more than a_s, |dc/dt| = |c| / 4 tau <= a_s,
 * |c| <= 4 a_s tau: half of that is allowed, the rest is the move's.  A step of the
 * quantiser, q, takes the motor q / a_s and q^2 / 2 a_s of distance, which
 * times 1 / 4 tau must stay below q, or one step calls for the next (a limit
 * cycle that grows): tau >= q / 8 a_s, eight times that is taken.  A count read
 * more or less is such a step of r / 4 tau: tau >= sqrt(r / 32 a_s), almost
 * three times that is taken.
 *
 * Why two places x.  What the quantiser leaves is a limit cycle of e up to 4 q
 * tau.  Where a step is small, q <= D T, x = l + 2 T, and the drive never
 * brakes between two set points: the speed does the work.  Where it is large,
 * or the map has no speed, x = l + T / 2: the drive, never slower than asked
 * because q is rounded up, comes to its braking curve in each cycle and goes
 * along it, so that e is v T / 2 at most whatever q is, and no error of the
 * speed adds up: the position does the work.
 *
 * Hard ramps.  A map without fields for ramps leaves them to the drive, which
 * are taken for steep, full speed in T; and a register may say only steep ones
 * (1000 rpm in 32.8 s is 183 deg/s2 on a motor without a gear).  Above 3 a_s a
 * motor cannot be relied on to follow them, and its own loop takes in the steps
 * of q: x is l + 2 T then, to have as few of them as can be.  With a speed loop
 * of lambda = omega / 2 zeta and the acceleration a_m, a step leaves q^2 / 2
 * a_m, of which each swing takes off 2 q / lambda: it settles in one where q /
 * a_m <= 4 / lambda.
 *
 * What cannot work is refused when the rig is loaded (firmware/host/rig/
 * modbus_stream.h).
 *
 * Point to point (go.c), one group says where to and how fast, and
 * the drive's own profile does the rest.  Homing is the map's sequence `home`;
 * the drive then counts from 0, and from what is asked for we.
 *
 * `homed` may stay set from the last homing, so it counts only once it was read
 * low after the start was confirmed.  Drives that are at home already are faster
 * than the polls, and others never clear it: where it was not read low the drive
 * must have stood at 0 for one second and four cycles: within a 64th of the
 * first step where its position did not change, else within the first step, as
 * it may stop beyond its switch.  One that has stood so long elsewhere did not
 * home, which is a fault.  A drive that begins later than that, from 0, is not
 * told from one that is there.
 *
 * Motion writes that fail are never repeated as they were: the next one has a
 * new target.  No answer is believed that a motor cannot have run to: one such
 * position is left out, the second in a row is a fault. */
#ifndef HAL_DRIVE_MODBUS_DRIVE_H
#define HAL_DRIVE_MODBUS_DRIVE_H

#include "hal/drive.h"
#include "hal/modbus/bus.h"
#include "hal/modbus/map.h"
#include "hal/readings.h"
#include "hal/support/ratio.h"
#include "hal/support/standstill.h"
#include "hal/support/text.h"

MOTION_C_BEGIN

#define DRIVE_MODBUS_HISTORY 64 /* set points kept to judge following */

/* What the fields of the group stream can say, in the axis's unit. */
struct drive_modbus_fields {
    int64_t count_q32;        /* one count */
    int64_t step_q32;         /* one step of the velocity; 0: it has none */
    int64_t vel_max_q32;      /* the fastest it can say; INT64_MAX */
    int64_t acc_q32, dec_q32; /* the ramps that are written, as rounded */
    bool own_ramps; /* not both: what the drive has is taken for so steep */
};

/* How a stream is made; see above. */
struct drive_modbus_law {
    bool is_near;            /* x is l + T / 2 */
    bool is_hard;            /* D > 3 a_s */
    int64_t gain_q16;        /* 1/s: 1 / 4 tau */
    int64_t correct_max_q32; /* 2 a_s tau */
    int64_t round_up_q32;    /* added to a speed: just below q / 2 */
    struct hal_ratio brake;  /* vel_q32 to s: 1 / 2 D */
};

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
    int64_t vel_max_q32, acc_q32; /* > 0: of the axis; acc that of its stop */
    int64_t cycle_ns;   /* from one set point to the next, 100 us .. 2 s */
    int64_t latency_ns; /* from the tick until the drive has it; 0: cycle / 2 */
    int64_t first_step_max_q32; /* as hal/drive/cia402/drive.h; 0: 1 unit */
    /* which it begins in; STREAM_POSITION: the other where the map has no
     * stream */
    enum hal_drive_mode mode;
    const struct drive_modbus_parameter *parameter; /* outlive the drive */
    unsigned parameter_count;
    /* 1 << enum hal_reading: those of the map that are monitored.  With any, all
     * that the map has are read in every cycle, behind the fast blocks */
    unsigned readings;
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
    bool requested; /* the write is under way */
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

/* Of a group, to its fields `velocity` (from counts/s, 16 more bits) and
 * `position` (from counts). */
struct drive_modbus_scale {
    struct hal_ratio to_velocity, to_position;
};

/* Visible so that it can be static; use the functions. */
struct drive_modbus {
    struct hal_drive drive;
    struct modbus_node node;
    struct drive_modbus_config config;

    /* made from config once */
    struct hal_ratio to_counts, to_pos; /* pos_q32 and counts */
    struct hal_ratio to_speed;          /* vel_q32 to counts/s, 16 more bits */
    struct drive_modbus_scale to_stream, to_move;
    int64_t pos_min, pos_max;   /* of the fields `position` */
    int64_t ramp[2];            /* registers: acceleration, dec. */
    int64_t lead_q32, feed_q32; /* s: x, l + T */
    int64_t half_lead2_q32;     /* s^2: lead^2 / 2 */
    struct drive_modbus_law law;
    int64_t first_step_counts, jump_q16; /* jump: counts per ns, 2^-48 */
    int64_t past_step_ns;
    struct modbus_map_block fast[MODBUS_MAP_BLOCKS_MAX];
    struct modbus_map_block slow[MODBUS_MAP_BLOCKS_MAX];
    uint8_t fast_count, slow_count;
    uint8_t monitor_count; /* behind the fast ones: nothing waits for these */

    enum drive_modbus_phase phase;
    enum hal_drive_request request;
    enum hal_drive_state state;
    int64_t now_ns, retry_ns;
    struct drive_modbus_run run;
    uint8_t start_at; /* of what START goes through */
    bool stops_found; /* it is found with torque */
    struct hal_drive_found found;
    enum drive_modbus_off off;
    bool off_heard;  /* every write of this sequence was confirmed */
    bool stop_heard; /* none of the writes of `stop` went unanswered */
    bool off_failed; /* one round was not enough */
    bool off_waits;  /* for fresh polls of a drive that was heard again */
    bool reset_requested;
    int64_t off_since_ns; /* of the round, of CONFIRM */
    int64_t stop_ns;      /* from full speed to rest, and a margin */
    bool is_reached;      /* what is requested */
    bool identified, identify_requested;
    uint8_t identify_tries;
    unsigned parameter_at; /* twice: written, then read back */
    unsigned parameter_tries;
    bool parameter_requested;
    bool alarm_requested, alarm_heard;

    /* what is polled */
    int64_t value[MODBUS_MAP_ITEMS_MAX];
    struct hal_readings readings;
    uint8_t fresh; /* fast blocks since start, one bit each */
    uint8_t turn, slow_turn, slow_wait;
    uint8_t cycles;    /* all fast blocks polled so often since the last step */
    uint8_t go_at;     /* steps of stream_go already asked */
    unsigned failures; /* in a row */
    uint64_t polls, streams; /* good ones */

    int64_t actual_counts, actual_ns; /* 0: never */
    int64_t first_ns;    /* of the first of these since the search began */
    int64_t near_counts; /* it stands: at most so far from one place */
    struct hal_standstill standstill;
    int64_t actual_vel_q32;
    bool jumped; /* the last position was left out */

    struct hal_drive_target target;
    int64_t target_ns; /* 0: none since enabled */
    bool first_target, begun, begin_requested;
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
    bool home_waits; /* its start was confirmed */
    bool home_begun; /* `homed` was read low since */
    bool home_moved; /* the position was seen to change since */
    int64_t home_rest_ns, home_rest_counts; /* it has stood there since */
    int64_t zero_q32; /* where the axis is when the drive counts 0 */

    uint16_t fault_code;
    char fault_text[64];
};

/* Of a sound config; values saturate at INT64_MAX.  Divides. */
void drive_modbus_fields(const struct drive_modbus_config *config,
                         struct drive_modbus_fields *fields);

/* MOTION_E_RANGE for a scale that does not fit. */
int drive_modbus_law(const struct drive_modbus_config *config,
                     struct drive_modbus_law *law);

/* Adds the node to the line.  Errors as modbus_bus_add; MOTION_E_ARG for a
 * value outside what the config says; MOTION_E_RANGE for a scale that does not
 * fit; MOTION_E_EMPTY when the map can neither move nor stream, or lacks the
 * mode.  The drive is &self->drive. */
int drive_modbus_init(struct drive_modbus *self, struct modbus_bus *bus,
                      const struct drive_modbus_config *config);

MOTION_C_END

#endif

/* firmware/host/rig/rig.h - a rig: buses, axes, drives, as read from rig.yaml.
 *
 * Plain structs; rig_load.c fills them from the file (docs/FILES.md describes
 * it, docs/schema/rig.schema.json checks it in an editor).  Positions are in
 * the axis's own unit. */
#ifndef FIRMWARE_HOST_RIG_RIG_H
#define FIRMWARE_HOST_RIG_RIG_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/homing.h"
#include "firmware/host/base/files.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/quote.h"
#include "firmware/host/base/units.h"
#include "firmware/host/rig/kind.h"
#include "firmware/host/rig/sim/quirk_load.h"
#include "firmware/host/yaml/yaml_report.h"
#include "hal/drive/cia402/drive.h"
#include "hal/drive/modbus/drive.h"
#include "hal/gpio.h"
#include "hal/modbus/line.h"
#include "hal/modbus/map.h"
#include "hal/support/monitor.h"
#include "motion/plan/move.h"
#include "motion/plan/path/plan_space.h"
#include "motion/plan/rig/plan_rig.h"
#include "motion/plan/shaper/shaper.h"

#define RIG_BUSES_MAX      32
#define RIG_AXES_MAX       CONTROLLER_AXES_MAX
#define RIG_LINES_MAX      256
#define RIG_PARAMETERS_MAX 32
#define RIG_PATH_MAX       256

/* CiA 301, table 1; bit/s, rising. */
#define RIG_BIT_RATES 8
extern const uint32_t rig_bit_rates[RIG_BIT_RATES];

enum rig_bus_kind { RIG_CANOPEN, RIG_MODBUS_RTU, RIG_MODBUS_TCP, RIG_CAN };
#define RIG_TURN_COUNTS   65536
#define RIG_INTERFACE_MAX 16 /* of Linux, with its 0 */

/* A CAN interface, whatever is spoken on it. */
struct rig_bus;
bool rig_bus_is_can(const struct rig_bus *bus);
#define RIG_NO_BUS UINT32_MAX /* of a virtual axis */
/* "can0", "/dev/ttyUSB0", "localhost, port 502": what two buses may not both
 * be, whichever way the file spells it; "" of one without an interface. */
#define RIG_THING_MAX (MODBUS_LINE_TEXT_MAX + 64)
void rig_bus_thing(const struct rig_bus *bus, char text[RIG_THING_MAX]);

struct rig_bus {
    enum rig_bus_kind kind;
    char name[PLAN_NAME_MAX];
    char interface[RIG_INTERFACE_MAX]; /* "can0"; "": it has none */
    uint32_t bit_rate;                 /* bit/s, one of CiA 301's */
    uint32_t data_bit_rate;            /* of CAN FD: 1, 2, 4, 5 or 8 times
                                          bit_rate; 0: no FD */
    uint8_t node_id;      /* our own, 1..127; no drive has it; CANopen */
    uint8_t sync_counter; /* SYNC counts 1 .. this, 2..240; 0: it does not */
    struct modbus_line_config modbus; /* Modbus: the line */
    struct plan_place place;
};

/* What a simulated Modbus servo is made from: "map", or a maker's drive. */
#define RIG_SIM_DEVICES 6
extern const char *const rig_sim_device_words[RIG_SIM_DEVICES];

/* sim/physics/mechanics.h, in the axis's units; 0: none. */
struct rig_sim_load {
    bool given, has_stops;
    double inertia_ratio, frequency_hz, damping; /* damping: 0.02 */
    int64_t backlash_q32;
    int64_t friction_q32, static_q32, weight_q32; /* accelerations */
    double viscous_1_s;
    int64_t stribeck_q32;
    int64_t stop_q32[2];
    /* of the transmission to it; efficiency 0: 1, pitch error 0: none */
    double efficiency;
    int64_t pitch_q32, pitch_error_q32;
    struct rig_sim_second {
        double inertia_ratio, frequency_hz,
            damping; /* 0: there is none; 0.02 */
        int64_t backlash_q32;
    } second;
};

/* sim/physics/winding.h, in the axis's units; 0: no limit by it. */
struct rig_sim_motor {
    bool given;
    int64_t stall_q32, no_load_q32, rated_q32;
    int64_t thermal_ns;
    double warm_load; /* 0.9 */
};

/* sim/physics/loops.h; not given: a loop of second order. */
struct rig_sim_loops {
    bool given;
    double position_hz, velocity_hz, current_hz;  /* current: 1000 */
    int64_t reset_ns;                             /* 20 ms; 0: none */
    int64_t position_ns, velocity_ns, current_ns; /* 1 ms, 250, 62.5 us */
};

/* Where a simulated CiA 402 drive is not as slew's own: sim/device/cia402. */
#define RIG_SIM_QUIRKS_MAX 16
enum rig_sim_quirk_kind {
    RIG_SIM_MISSING,
    RIG_SIM_READ_ONLY,
    RIG_SIM_SHIPPED,
};
struct rig_sim_quirk {
    uint16_t index;
    uint8_t sub; /* 0xFF: all */
    uint8_t kind;
    uint32_t value;
};
struct rig_sim_quirks {
    struct rig_sim_quirk object[RIG_SIM_QUIRKS_MAX];
    unsigned count;
    bool fixed_mapping;
    uint16_t emergency; /* behind the boot-up message; 0: none */
    int64_t boot_ns;    /* until that; 0: 150 ms */
};

/* How the axis's servo behaves on the simulated bus.  What the file leaves out
 * is filled in, so nothing here is "0: default". */
struct rig_sim {
    uint32_t omega_mrad_s;  /* bandwidth of the position loop; 25 Hz */
    uint16_t zeta_permille; /* damping; 900 */
    int64_t start_q32;      /* 0, or the nearest position the axis can have */
    int64_t vel_max_q32;    /* of the motor; 1.5 x the axis's limit, 1.25 x its
                               no-load speed */
    int64_t acc_max_q32;    /* of the motor; 2 x the stop acceleration */
    /* of a CiA 402 drive, in its 0x60FD; as positions are at power-on */
    bool has_limits, has_home;
    int64_t limit_q32[2]; /* switches there and beyond */
    int64_t home_q32[2];  /* switch from .. to */
    int64_t index_q32;    /* an index pulse at 0 and every so far; 0: none */
    /* of any drive on a CAN bus: the axis goes no further than */
    bool has_stops;
    int64_t stop_q32[2];
    /* of its encoder; 0: one count, none */
    int64_t encoder_step_q32, encoder_noise_q32;
    /* 1 + index of rig_sim_device_words; 0: by the name of the map */
    uint8_t device;
    struct rig_sim_quirks quirks; /* of a CiA 402 drive; none */
    struct rig_sim_load load;     /* a motor alone */
    struct rig_sim_motor motor;   /* not limited but by vel_max, acc_max */
    struct rig_sim_loops loops;
};

/* The drive's units of velocity or acceleration per counts/s or counts/s2; num
 * 0: the same. */
struct rig_scale {
    int64_t num, den;
};

/* How long a CiA 402 drive may take; 0: as hal/drive/cia402/drive.h has it. */
struct rig_times {
    int64_t sdo_ns, state_ns, brake_ns, precharge_ns;
    int64_t boot_ns; /* until it answers at all; 0: 5 s */
};

/* What only a CiA 402 drive has; 0: as hal/drive/cia402/drive.h has it. */
struct rig_cia402 {
    struct drive_cia402_pdos pdo;
    enum drive_cia402_stream stream;
    bool stream_given;
    bool quirk_given; /* else: by its identity */
    uint32_t quirk;   /* index */
    int64_t gain_q16; /* CSV: 1/s */
    bool torque;
    struct rig_scale velocity, acceleration;
    int64_t travel_q32; /* in one revolution of its shaft */
    struct drive_cia402_option_code option[DRIVE_CIA402_OPTIONS];
    int64_t guard_period_ns;
    enum canopen_nmt_command nmt_reset; /* 0: none */
    struct rig_times time;
};

/* What is monitored of its drive: hal/support/monitor.h. */
struct rig_monitor {
    unsigned wanted; /* 1 << enum hal_reading */
    struct drive_monitor_limit limit[HAL_READINGS];
    /* CiA 402: where its temperature is, and thousandths of a degC of one
     * count; index 0: nowhere */
    uint16_t temperature_index;
    uint8_t temperature_sub;
    int32_t temperature_milli;
};

/* What a rig is warned of.  X(name, word): its word stands behind the warning and in
 * `acknowledged` of the axis, which is then not warned of it. */
#define RIG_WARNING_LIST(X)                                                    \
    X(RIG_WARNING_UNSUPERVISED, "unsupervised")                                \
    X(RIG_WARNING_MAP, "map")                                                  \
    X(RIG_WARNING_EDS, "eds")                                                  \
    X(RIG_WARNING_FOLLOWING, "following_error")                                \
    X(RIG_WARNING_LIMITS, "limits")                                            \
    X(RIG_WARNING_STOP, "stop")                                                \
    X(RIG_WARNING_DRIVE, "drive")                                              \
    X(RIG_WARNING_HOMING, "homing")                                            \
    X(RIG_WARNING_TIMES, "times")                                              \
    X(RIG_WARNING_RACKING, "racking")

enum rig_warning {
#define RIG_WARNING_ENUM(name, word) name,
    RIG_WARNING_LIST(RIG_WARNING_ENUM)
#undef RIG_WARNING_ENUM
        RIG_WARNINGS
};
extern const char *const rig_warning_word[RIG_WARNINGS];

struct rig_axis {
    char name[PLAN_NAME_MAX];
    uint32_t acknowledged; /* a bit for each enum rig_warning */
    enum units_axis unit;
    struct plan_limit limit;
    /* for stopping after a fault: at least the limits; jerk 0: not limited */
    int64_t stop_acc_q32, stop_jerk_q32;
    int64_t following_floor_q32; /* fault above max(floor, k |v|) */
    int64_t following_k_ns;
    uint32_t bus; /* index, or RIG_NO_BUS */
    uint8_t node_id;
    uint8_t node_axis; /* of its node, from 0 */
    /* counts per unit, num != 0 (negative: reversed), den > 0; both position
     * limits are within +-(2^31 - 1) counts.  Of a drive that counts
     * turns, one is RIG_TURN_COUNTS */
    int64_t counts_num, counts_den;
    enum rig_drive_kind kind;
    struct rig_cia402 cia402;
    int64_t torque_q32; /* feed-forward: permille of the rated torque per
                           unit/s2; 0: none */
    uint32_t map;       /* Modbus: index */
    /* ODrive 0.6: where its parameters are that make its watchdog; 0: it is not
     * looked at */
    uint16_t enable_watchdog, watchdog_timeout;
    char endpoints[RIG_PATH_MAX]; /* the list; "": none */
    /* Of a drive that says its torque in Nm: what is rated; 0: it is not asked
     * for.  Of an ODrive with firmware 0.5: Nm per A; 0: not known */
    int32_t rated_torque_mnm;
    int64_t torque_constant_q32;
    /* Modbus: the drive goes from key to key by its own profile, which is over
     * settle_ns (0: modbus_budget.h has it) before the next one is due, and may
     * be so much late */
    bool point_to_point;
    int64_t settle_ns, late_ns;
    bool unsupervised; /* nothing stops it when the line is dead, and the user
                          says that he knows */
    struct rig_monitor monitor; /* none */
    struct homing_config homing;
    /* on a board: its servo's unit on the board's own line, 0: a virtual axis;
     * how long the board may hear nothing */
    uint8_t servo;
    bool has_servo_map;
    int64_t watch_ns;
    char eds[RIG_PATH_MAX]; /* CiA 402: the data sheet; "": none */
    /* how much of it is odd and was left, and the first line of that */
    unsigned eds_odd, eds_odd_line;
    /* what the drive is set to at start-up, one of both by its kind */
    struct drive_cia402_parameter object[RIG_PARAMETERS_MAX];
    struct drive_modbus_parameter item[RIG_PARAMETERS_MAX];
    unsigned parameter_count;
    bool has_shaper; /* of the vibration that the axis is left with */
    struct plan_shaper_request shaper;
    struct rig_sim sim;
    struct plan_place place;
};

/* Without a motor: on no bus, and always where it was told to be. */
bool rig_axis_is_virtual(const struct rig_axis *axis);
/* The largest following error that is no fault, at a speed in units/s, Q32.32,
 * >= 0; INT64_MAX: none is. */
int64_t rig_axis_following_q32(const struct rig_axis *axis, int64_t speed_q32);

/* Where a CiA 402 axis has what the first axis of its node has there. */
uint16_t rig_axis_object(const struct rig_axis *axis, uint16_t index);

/* One unit of a drive that counts turns is *num / *den turns. */
void rig_axis_turn(const struct rig_axis *axis, int64_t *num, int64_t *den);

enum rig_line_kind {
    RIG_LINE_ESTOP,
    RIG_LINE_LIMIT_NEGATIVE,
    RIG_LINE_LIMIT_POSITIVE,
    RIG_LINE_LAMP, /* lit while an axis may have torque */
    RIG_LINE_HOME,
    RIG_LINE_TRIGGER, /* pulses at the events of a move */
    RIG_LINE_START,   /* starts a move that waits for it */
    RIG_LINE_FRAME,   /* a pulse for each frame of what a move follows */
};
#define RIG_TRIGGERS_MAX 8

#define RIG_LINE_NAME_MAX 64

/* A digital line. */
struct rig_line {
    char name[PLAN_NAME_MAX];
    enum rig_line_kind kind;
    int axis;                     /* index, of a limit or home switch; -1 */
    char chip[RIG_LINE_NAME_MAX]; /* empty: whichever has such a line */
    char line[RIG_LINE_NAME_MAX]; /* name, or number on the chip */
    bool active_low;
    enum hal_gpio_bias bias;
    int64_t release_ns; /* an input lets go after being quiet for so long */
    int64_t width_ns;   /* of a trigger's pulse */
    int64_t rest_ns;    /* between two pulses, at least */
    int64_t lead_ns;    /* a pulse is so much before its event */
    /* simulated: a switch is pressed where its axis is from low to high */
    bool has_sim;
    int64_t sim_low_q32, sim_high_q32;
    int64_t discrepancy_ns; /* of the second e-stop line: the two are channels
                               of one, and differ for so long at most; else 0 */
    int64_t sim_every_ns;   /* simulated start: from pulse to pulse; 0: none */
    struct plan_place place;
};

/* What a simulated axis carries or pulls: sim/physics/payload.h. */
enum rig_payload_kind {
    RIG_PAYLOAD_PENDULUM,
    RIG_PAYLOAD_CABLE,
    RIG_PAYLOAD_CURTAIN,
    RIG_PAYLOAD_BALL,
    RIG_PAYLOAD_KINDS
};
#define RIG_PAYLOADS_MAX 16

struct rig_payload {
    char name[PLAN_NAME_MAX];
    uint32_t axis;
    uint8_t kind; /* enum rig_payload_kind */
    double mass_kg, cable_kg, length_m, width_m, damping, radius_m;
    double friction, start_m;
    double wall_m; /* at both ends of a ball's plate; 0: none */
    bool collides; /* a curtain with itself */
    double arm_m;  /* of an axis that turns: from it to the payload; 0: none */
    /* in the camera's space, with its axis at 0, and which way that goes, level */
    bool is_placed;
    double origin_m[3], along[2];
    double inertia; /* of what the axis moves itself, kg or kg m2; 0: it is so
                       large that the payload does nothing to it */
    struct plan_place place;
};

/* Two rails of a bridge, which move as one: firmware/control/gantry.h. */
#define RIG_GANTRIES_MAX 8

struct rig_gantry {
    char name[PLAN_NAME_MAX];
    uint32_t axis[2];
    int64_t racking_q32;
    struct plan_place place;
};

struct rig;
/* The other rail of a gantry, of any of the rig; -1: the axis is none of its rails. */
int rig_gantry_other(const struct rig_gantry *gantry, uint32_t axis);
int rig_rail_beside(const struct rig *rig, uint32_t axis);
/* Limits of an axis; of a rail what both can do. */
struct plan_limit rig_rails_limit(const struct rig *rig, uint32_t axis);
/* Has its kinematics a bridge on two rails with an axis each? */
bool rig_has_bridge(const struct rig *rig);
/* m, or for a ball rad, of the payload's axis there, and per unit of it. */
double rig_payload_at(const struct rig *rig, const struct rig_payload *payload,
                      int64_t pos_q32);
double rig_payload_scale(const struct rig *rig,
                         const struct rig_payload *payload);
bool rig_line_is_output(const struct rig_line *line);
unsigned rig_trigger_count(const struct rig *rig);
const char *rig_line_kind_text(enum rig_line_kind kind); /* "e-stop" ... */

/* What the loss of the guardian (firmware/linux/machine/guardian.h) is. */
enum rig_guardian { RIG_GUARDIAN_WARN, RIG_GUARDIAN_STOP };

struct rig {
    struct memory_pool memory; /* of the arrays */
    char title[128];
    int64_t period_ns;    /* tick: whole us, 125 us .. 20 ms; 1 ms */
    int64_t heartbeat_ns; /* of the drives: whole ms, 10 ms .. 10 s; 100 ms */
    enum rig_guardian guardian; /* when it is lost, with real drives */
    int64_t watchdog_ns; /* a drive stops when it has not heard us for this:
                             whole ms, 2 ticks .. 100 ms; 100 ms */
    struct rig_bus *bus;
    uint32_t bus_count;
    struct rig_axis *axis;
    uint32_t axis_count;
    struct modbus_map *map; /* register maps */
    char (*map_path)[RIG_PATH_MAX];
    uint32_t map_count;
    struct drive_cia402_quirk *quirk; /* of the files named in the rig */
    char (*quirk_path)[RIG_PATH_MAX];
    uint32_t quirk_count;
    const struct quirk_set *quirks; /* slew's own; NULL: no CiA 402 drive */
    struct rig_line *line;
    uint32_t line_count;
    struct rig_payload *payload;
    uint32_t payload_count;
    struct rig_gantry *gantry;
    uint32_t gantry_count;
    struct plan_rig *kinematics; /* axes of the rig; NULL: not given */
    struct plan_space *rail;     /* of its carrier; NULL: another one */
};

/* No axis before it has its node: what is the node's is counted with it. */
bool rig_is_first_of_node(const struct rig *rig, const struct rig_axis *axis);

/* Read a file into a rig that is all zero, or that was read before and is given
 * back.  On an error returns -1 and writes one sentence, without a line end,
 * into message; *rig is then not to be used.  rig_free in either case. */
int rig_load(const struct files *files, const char *path, struct rig *rig,
             char message[YAML_MESSAGE_MAX]);
/* All zero afterwards. */
void rig_free(struct rig *rig);

/* Say what of the rig may be, and is hardly wanted: a sentence each, with its
 * numbers and what is usual, and where in the file it is about. */
void rig_plausible(const struct rig *rig,
                   void (*say)(void *context, struct plan_place place,
                               const char *text),
                   void *context);
/* Refuse an axis that nothing would watch while its real drive moves: -1 with
 * "path:line:column: ...". */
int rig_may_move_drives(const struct rig *rig, const char *path,
                        char message[YAML_MESSAGE_MAX]);

/* One bus and its axes, in their order, as a rig of its own without lines; its
 * maps and quirks are those of the whole one, which must outlive it.  `part` as
 * for rig_load. */
void rig_part(struct rig *part, const struct rig *rig, uint32_t bus);

/* Read a move for a rig: axes are looked up in it and values converted to
 * their units.  axis[i] of the move is any axis of the rig, in the file's
 * order; keys are on the heap: move_free. */
int move_load(const struct files *files, const char *path,
              const struct rig *rig, struct plan_move *move,
              char message[YAML_MESSAGE_MAX]);
/* The same for a file that is read again and again: `text` is to be given back by
 * yaml_again_free, `former` that of the time before (NULL: there was none). */
struct yaml_again;
int move_load_again(const struct files *files, const char *path,
                    const struct rig *rig, struct plan_move *move,
                    struct yaml_again *text, const struct yaml_again *former,
                    char message[YAML_MESSAGE_MAX]);
void move_free(struct plan_move *move);

/* The quirks that a CiA 402 axis's drive may have, by its identity, or the one
 * that the rig names for it. */
const struct drive_cia402_quirk *rig_quirks(const struct rig *rig,
                                            const struct rig_cia402 *cia402,
                                            unsigned *count);

/* Of a drive with this 0x1018:1 and :2; NULL: none. */
const struct drive_cia402_quirk *rig_quirk(const struct rig *rig,
                                           const struct rig_cia402 *cia402,
                                           uint32_t vendor, uint32_t product);
/* How set points go to it; `quirk` may be NULL. */
enum drive_cia402_stream rig_stream(const struct rig_cia402 *cia402,
                                    const struct drive_cia402_quirk *quirk);

/* How often it is asked for its state, as far as the rig tells; 0: not. */
int64_t rig_guard_ns(const struct rig *rig, const struct rig_cia402 *cia402);

/* What a CiA 402 axis uses of its drive: enum eds_use. */
unsigned rig_eds_uses(const struct rig *rig, const struct rig_axis *axis,
                      const struct drive_cia402_quirk *quirk);

/* Other interfaces than the file's, from a command line: "can1" for a rig with
 * one bus, or "BUS=INTERFACE,...".  On an error returns -1 and writes one
 * sentence. */
int rig_set_interfaces(struct rig *rig, const char *text,
                       char message[YAML_MESSAGE_MAX]);

/* Is it homed by slew and a switch that is wired to its drive, not to a gpio
 * line?  Then the drive must be able to say so (0x60FD). */
bool rig_homes_by_drive_input(const struct rig *rig, uint32_t axis);

/* Index of an axis by name, or -1. */
int rig_axis_index(const struct rig *rig, const char *name);
/* "pan, tilt or slide", for a sentence.  Returns `list`. */
const char *rig_axis_list(const struct rig *rig, char list[QUOTE_LIST_MAX]);

#endif

/* sim/device/cia402/servo.h - a CiA 402 servo drive as it looks from its CAN
 * port.
 *
 * Object dictionary with access rules and abort codes, NMT states, heartbeat
 * producer and consumer, PDO communication and mapping parameters (refused in
 * the order real drives refuse them), SYNC, the power state machine with its
 * sixteen transitions, quick stop option codes, fault reaction, following error
 * window; CSP with interpolation over one SYNC period, IP, CSV, PP, PV and
 * homing; touch probe; position actual from the plant.  Written from CiA 301
 * and CiA 402-2, independently of hal/.
 *
 *   od.c      the dictionary: rows, access, abort codes
 *   com.c     NMT, heartbeat, EMCY
 *   eds.c     the dictionary as a data sheet
 *   guard.c   node and life guarding, TIME
 *   lss.c     node number by LSS
 *   sdo.c     the SDO server, short objects
 *   long.c    long ones: segments, blocks
 *   pdo.c     PDO parameters, mapping, exchange
 *   power.c   state machine, faults
 *   motion.c  the inner loop: demand, ramps, plant
 *   mode.c    modes of operation: a table
 *   stream.c  the cyclic ones: CSP, IP, CSV
 *   profile.c by its own ramps: PP, PV
 *   home.c    homing, methods 1-14, 17-30, 33-35, 37
 *   inputs.c  switches, index pulse, touch probe
 *   servo.c     timers, frames in, injections
 *   axes.c    several axes behind one node
 *   quirk.c   where it is not as it is built
 *
 * What this maker chose where the profile leaves a choice:
 *   - no enabling while 0x6060 is 0; while the axis moves under torque another
 *     mode waits, 0x6061 tells;
 *   - user units are increments, the factors 0x608F to 0x6096 are stored only;
 *   - homing leaves the axis where it stopped; position is 0x607C at the home
 *     point; a method it does not have cannot be written;
 *   - one set point in the buffer beside the one under way; a target outside
 *     0x607D goes to the limit, bit 11; position options 0x60F2 are not there;
 *   - touch probe 1 is input 16, or the index pulse;
 *   - Ready to switch on ignores 0x0F (no jump over Switched on);
 *   - 0x60C2:1 = 0 (default): interpolates over the measured SYNC period;
 *   - feed-forward is the slope of the set points and 0x60B2; in positions
 *     0x60B1 is stored only;
 *   - 0x2001: so many SYNC periods without a fresh 0x607A in an RPDO, while
 *     enabled and after the first, are a time-out (EMCY 0x8250, reaction by
 *     0x6007); 0x1400:5 in ms takes its place when not 0;
 *   - 0x2002: up to 1024 bytes of anything, for whoever needs a long object;
 *   - 0x2000 (write only): an injection, 1 + enum sim_cia402_fault;
 *   - until its boot-up message it acknowledges frames and ignores them. */
#ifndef SIM_DEVICE_CIA402_SERVO_H
#define SIM_DEVICE_CIA402_SERVO_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "sim/device/servo.h"

/* What stands along the axis, in counts as they are at power-on. */
struct sim_cia402_rail {
    bool has_limits, has_home; /* the switches, bits 0, 1 and 2 of 0x60FD */
    int32_t limit_negative, limit_positive; /* active there and beyond */
    int32_t home_from, home_to;             /* active between */
    int32_t index_every; /* an index pulse at 0 and every so many; 0: none */
};

/* Where a drive is not as this one is built. */
enum sim_cia402_quirk_kind {
    SIM_CIA402_MISSING,   /* the object is not there */
    SIM_CIA402_READ_ONLY, /* it cannot be written */
    SIM_CIA402_SHIPPED,   /* it is `value` as shipped */
};
#define SIM_CIA402_QUIRKS  16
#define SIM_CIA402_ANY_SUB 0xFF

struct sim_cia402_quirk {
    uint16_t index; /* as the first axis of a node has it */
    uint8_t sub;    /* or SIM_CIA402_ANY_SUB */
    uint8_t kind;
    uint32_t value;
};

struct sim_cia402;

struct sim_cia402_config {
    uint8_t node_id; /* 1..127; 255: none yet, waits for LSS */
    /* A device of several axes (CiA 301 7.5.2.1) is one of these for each, of
     * which `with` has been there before and has the node: its port, NMT state,
     * SDO channel, heartbeat and what is below 0x6000 but for PDOs.  Axis n,
     * from 0, has objects 0x800 * n further and PDOs from number 64 n + 1 on,
     * which from the second on have no identifier as shipped. */
    uint8_t axis;             /* 0..7 */
    struct sim_cia402 *with;  /* NULL: it is the first of its node */
    uint32_t vendor, product; /* 0x1018:1, :2; 0: slew's own */
    uint32_t serial;          /* 0x1018:4; 0: the node number */
    struct sim_plant_config plant;
    int32_t start_counts;     /* where it stands at power-on */
    int64_t loop_ns;          /* inner loop, as sim/device/servo.h */
    int64_t brake_release_ns; /* Switched on -> Operation enabled takes this */
    int64_t boot_ns;          /* power-on to boot-up message */
    struct sim_cia402_rail rail;
    struct sim_cia402_quirk quirk[SIM_CIA402_QUIRKS];
    unsigned quirks;
    bool fixed_mapping;  /* no PDO's mapping can be written */
    uint16_t boot_error; /* EMCY behind the boot-up message; 0: none */
};

/* What a test or a script may do to it.  One more: a row in the table of
 * servo.c. */
enum sim_cia402_fault {
    SIM_CIA402_OVERCURRENT, /* EMCY 0x2310, fault reaction, Fault */
    SIM_CIA402_REBOOT,      /* power cycle: boot-up, all volatile gone */
    SIM_CIA402_SILENT,      /* off the bus: hears and says nothing */
    SIM_CIA402_BLOCKED,     /* the rotor does not move */
    SIM_CIA402_CLEAR,       /* every lasting one ends */
    SIM_CIA402_FROZEN,      /* reports one actual position for ever */
    SIM_CIA402_NO_POWER,    /* torque off by its STO input, cannot be enabled */
    SIM_CIA402_DEAF,        /* loses every RPDO */
    SIM_CIA402_FAULTS,      /* how many */
};

#define SIM_CIA402_OBJECTS_MAX 256
#define SIM_CIA402_PDOS        4 /* each way */
#define SIM_CIA402_ENTRIES     8 /* per mapping */

/* An active PDO: the rows of the dictionary it carries. */
struct sim_cia402_pdo {
    bool active;
    uint32_t cob_id;
    uint8_t count, bytes;
    uint8_t row[SIM_CIA402_ENTRIES], size[SIM_CIA402_ENTRIES]; /* bytes */
    uint8_t type;
    uint8_t data[8];     /* received and not yet in force, or last sent */
    bool pending;        /* data waits for SYNC */
    bool wrong_length;   /* the last one was too short or too long */
    unsigned sync_count; /* SYNCs since the last TPDO */
    int64_t sent_ns;     /* last TPDO */
    bool carries_target; /* 0x607A, 0x60C1:1 or 0x60FF is mapped */
};

#define SIM_CIA402_NOTES 1024 /* bytes of 0x2002 */

/* A long SDO transfer under way; see long.c. */
struct sim_cia402_transfer {
    uint8_t phase; /* enum of long.c; 0: none */
    int row;
    const uint8_t *from; /* read by the client */
    uint32_t length, at; /* length 0 of a write: not told */
    uint8_t toggle;
    uint8_t block_size, sequence;
    bool last, checked;
    uint8_t into[SIM_CIA402_NOTES]; /* written by the client, not yet whole */
};

/* CiA 305, the device's side. */
struct sim_cia402_lss {
    bool configuring;
    unsigned matched;    /* parts of a selective switch that were ours */
    unsigned scan_part;  /* that the scan is at */
    uint8_t node_next;   /* in force after reset communication; 0: as it is */
    uint8_t node_stored; /* in force after power-on; 0: as built */
};

/* A motion by ramps of its own: what the last command said. */
struct sim_cia402_profile {
    int64_t target_q24, vel_q24, acc_q8, dec_q8;
    bool waiting;                    /* a set point is in the buffer */
    bool acknowledged;               /* bit 12 */
    int64_t reached_ns, standing_ns; /* for so long */
};

/* See home.c. */
struct sim_cia402_homing {
    uint8_t phase;
    int8_t direction;  /* -1, 1 */
    bool turned, seen; /* at a limit switch; the switch, since this phase */
    bool attained, failed;
    int64_t last_q24; /* at the step before */
};

enum sim_cia402_timer {
    SIM_CIA402_LOOP,
    SIM_CIA402_BOOT,
    SIM_CIA402_HEARTBEAT, /* our next */
    SIM_CIA402_CONSUMER,  /* the master's is late */
    SIM_CIA402_BRAKE,     /* released */
    SIM_CIA402_TARGET,    /* fresh targets are late */
    SIM_CIA402_GUARD,     /* the master has not asked for too long */
    SIM_CIA402_TIMERS,
};

struct sim_cia402 {
    struct sim_servo base;
    struct sim_cia402_config config;

    /* Private from here on. */
    uint32_t value[SIM_CIA402_OBJECTS_MAX];  /* by row of the dictionary */
    uint32_t stored[SIM_CIA402_OBJECTS_MAX]; /* by 0x1010, over power-off */
    bool has_stored;
    struct sim_cia402 *first; /* axis of the node */
    struct sim_cia402 *next;  /* NULL: it is the last */
    int64_t timer_ns[SIM_CIA402_TIMERS];
    int64_t due_ns; /* the first of them */
    uint8_t nmt_state;
    struct sim_cia402_pdo rpdo[SIM_CIA402_PDOS], tpdo[SIM_CIA402_PDOS];
    uint32_t rpdo_ids; /* a bit for each, by its low five bits */
    bool event_pdos;   /* any TPDO of type 254, 255 active */
    struct sim_cia402_transfer transfer;
    uint8_t notes[SIM_CIA402_NOTES]; /* 0x2002 */
    uint32_t notes_length;
    struct sim_cia402_lss lss;
    uint8_t guard_toggle;
    uint32_t time_ms; /* of the last TIME: since midnight */
    uint16_t time_days;

    /* lasting injections, and inputs */
    bool no_power, loses_rpdos;
    uint32_t inputs;

    /* power */
    uint8_t power; /* enum cia402_power */
    uint16_t controlword, controlword_before;
    uint8_t after_ramp; /* state to go to at rest */
    bool halted;

    /* motion */
    int8_t mode;         /* in force, as 0x6061 says */
    uint8_t motion;      /* enum cia402_motion */
    int64_t zero_counts; /* where 0x6064 is 0; 0 at power-on */
    struct sim_cia402_profile profile;
    struct sim_cia402_homing homing;
    uint32_t inputs_seen; /* at the last inner step */
    int64_t index_seen;   /* index pulses below the axis, then */
    bool wrong_sync;      /* the last SYNC had the wrong length */
    int64_t demand_q24, demand_vel_q24;
    int64_t target_q24, target_end_ns; /* of the interpolation */
    int64_t ramp_acc_q8;
    int64_t sync_ns, sync_period_ns; /* sync_ns < 0: none yet */
    bool target_fresh;               /* an RPDO brought one since SYNC */
    int64_t target_timeout_ns;       /* by that RPDO's event timer; 0: none */
    bool targets_late, limited, following_error;
    bool master_lost; /* its heartbeat is overdue */
    int64_t following_error_ns;
};

/* Adds the drive to the bus and the world, powered from the world's now.
 * MOTION_E_ARG for a config outside its ranges; nothing has been
 * added to the world then. */
int sim_cia402_init(struct sim_cia402 *self, struct sim_can_bus *bus,
                    const struct sim_cia402_config *config);
void sim_cia402_inject(struct sim_cia402 *self, enum sim_cia402_fault fault);
/* The dictionary as an EDS file, the same for every such drive. */
void sim_cia402_write_eds(FILE *file);

#endif

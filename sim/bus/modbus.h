/* sim/bus/modbus.h - a simulated RS-485 line with bit time, and what can go
 * wrong on it.
 *
 * Everyone on the line sits on a seat: a station (hal/modbus/station.h), master
 * or slave.  What one sends reaches all others when its last stop bit ends,
 * rounded up to the nanosecond.  Two that send at the same time garble each
 * other.  Silences and turn-around times are the stations' own.
 *
 * A faulty station stands in front of another and spoils what it sends. */
#ifndef SIM_BUS_MODBUS_H
#define SIM_BUS_MODBUS_H

#include "hal/modbus/station.h"
#include "sim/world.h"

struct sim_modbus_line;

struct sim_modbus_seat {
    struct sim_member member;
    struct sim_modbus_line *line;
    struct sim_modbus_seat *next; /* on the line, in the order of adding */
    struct modbus_station *station;
    uint8_t frame[MODBUS_RTU_FRAME_MAX];
    unsigned length; /* being sent; 0: nothing */
    int64_t begin_ns, end_ns;
    bool garbled;
};

struct sim_modbus_line {
    struct sim_world *world;
    struct modbus_rtu_time time;
    struct sim_modbus_seat *first, *last;
    bool cut;         /* nothing arrives anywhere */
    uint64_t busy_ns; /* somebody was sending, summed up */
    uint64_t frames, collisions;
};

/* MOTION_E_ARG for a line outside the ranges of hal/modbus/rtu.h. */
int sim_modbus_line_init(struct sim_modbus_line *line, struct sim_world *world,
                         const struct modbus_rtu_line *config);
int sim_modbus_seat_init(struct sim_modbus_seat *seat,
                         struct sim_modbus_line *line,
                         struct modbus_station *station);

enum sim_modbus_fault {
    SIM_MODBUS_GOOD,
    SIM_MODBUS_LATE,      /* late_ns more */
    SIM_MODBUS_MUTE,      /* no answer */
    SIM_MODBUS_EXCEPTION, /* answers "device busy" whatever was asked */
    SIM_MODBUS_WRONG_CRC,
    SIM_MODBUS_OTHER_UNIT, /* a sound frame of somebody else */
    SIM_MODBUS_HALF,       /* stops in the middle */
    SIM_MODBUS_TWICE,      /* the frame twice without silence between */
    SIM_MODBUS_NOISE,      /* random bytes instead */
    SIM_MODBUS_FLIP, /* a burst of wrong bits, 16 at most: a CRC-16 sees all of
                        them, of longer ones all but 1 in 65536 */
    SIM_MODBUS_FAULTS, /* how many */
};

/* A station in front of another. */
struct sim_modbus_faulty {
    struct modbus_station station;
    struct modbus_station *behind;
    enum sim_modbus_fault fault; /* from the next answer on */
    unsigned times;              /* so many answers; 0: all */
    int64_t late_ns;
    uint64_t share_q32; /* of the answers so many in 2^32; 0: all */
    uint64_t seed;      /* != 0 */
    uint64_t spoilt;
    uint8_t held[MODBUS_RTU_FRAME_MAX]; /* a late answer */
    unsigned held_length;
    int64_t held_ns;
};

void sim_modbus_faulty_init(struct sim_modbus_faulty *self,
                            struct modbus_station *behind, uint64_t seed);
/* Spoil a frame as `fault` says, not LATE or MUTE.  Bytes that are left. */
unsigned sim_modbus_spoil(enum sim_modbus_fault fault, uint64_t *seed,
                          uint8_t frame[MODBUS_RTU_FRAME_MAX], unsigned length);

#endif

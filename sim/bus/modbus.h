/* sim/bus/modbus.h - a simulated RS-485 line with bit time, and what can go
 * wrong on it.
 *
 * Everyone on the line sits on a seat: a station (hal/modbus/station.h), master
 * or slave.  What one sends reaches all others when its last stop bit ends,
 * rounded up to the nanosecond.  Two that send at the same time garble each
 * other.  Silences and turn-around times are the stations' own.
 *
 * A faulty station stands in front of another and spoils what it sends, and what
 * it is sent.  An intruder sends whatever others do. */
#ifndef SIM_BUS_MODBUS_H
#define SIM_BUS_MODBUS_H

#include "hal/modbus/station.h"
#include "sim/bus/modbus_direction.h"
#include "sim/world.h"

struct sim_modbus_line;

struct sim_modbus_seat {
    struct sim_member member;
    struct sim_modbus_line *line;
    struct sim_modbus_seat *next; /* on the line, in the order of adding */
    struct modbus_station *station;
    uint8_t frame[MODBUS_FRAME_MAX];
    unsigned length; /* being sent; 0: nothing */
    int64_t begin_ns, end_ns;
    bool garbled;
};

struct sim_modbus_line {
    struct sim_world *world;
    struct modbus_rtu_time time;
    struct sim_modbus_seat *first, *last;
    bool cut; /* nothing arrives anywhere */
    /* The master's two-wire adapter.  echo: it hears what it sends.
     * turn_ns: it lets go of the line so long after its last stop bit; what
     * others send before does not come through. */
    struct sim_modbus_seat *adapter;
    bool echo;
    int64_t turn_ns;
    /* Of a connection (TCP).  deaf: its other end is gone without a word, until
     * there is a new one.  closed: the other end ends every one. */
    bool deaf, closed;
    uint64_t busy_ns; /* somebody was sending, summed up */
    uint64_t frames, collisions;
};

/* MOTION_E_ARG for a line outside the ranges of hal/modbus/rtu.h. */
int sim_modbus_line_init(struct sim_modbus_line *line, struct sim_world *world,
                         const struct modbus_rtu_line *config);
int sim_modbus_seat_init(struct sim_modbus_seat *seat,
                         struct sim_modbus_line *line,
                         struct modbus_station *station);

/* A station in front of another, and what is wrong on the way from it and to
 * it. */
struct sim_modbus_faulty {
    struct modbus_station station;
    struct modbus_station *behind;
    const struct modbus_rtu_time *time; /* of frames that come twice, with the
                                           silence between; NULL: without */
    uint64_t seed;                      /* != 0 */
    struct sim_modbus_direction from, to;
};

void sim_modbus_faulty_init(struct sim_modbus_faulty *self,
                            struct modbus_station *behind, uint64_t seed);
/* Spoil a frame as `fault` says, not LATE or MUTE.  Bytes that are left. */
unsigned sim_modbus_spoil(enum sim_modbus_fault fault, uint64_t *seed,
                          uint8_t frame[MODBUS_FRAME_MAX], unsigned length);

/* Somebody else on the line, who does not listen: frames from begin to end. */
struct sim_modbus_intruder {
    struct modbus_station station;
    struct sim_modbus_seat seat;
    bool on;
    int64_t pause_ns; /* up to so long between two frames, at random */
    uint8_t unit;     /* another master, who asks it; 0: noise */
    int64_t next_ns;
    uint64_t seed; /* != 0 */
};

/* Takes its seat; silent. */
int sim_modbus_intruder_init(struct sim_modbus_intruder *self,
                             struct sim_modbus_line *line, uint64_t seed);

#endif

/* firmware/linux/machine/machine_fault.h - lets happen on a simulated machine
 * what a fault script says (firmware/host/fault/script.h).
 *
 * Stepped between two ticks, so that what begins there is seen by the next one
 * at the earliest.  In virtual time two runs of one script are the same to the
 * bit: noise and wrong answers are drawn from its seed, of each entry by
 * itself. */
#ifndef FIRMWARE_LINUX_MACHINE_MACHINE_FAULT_H
#define FIRMWARE_LINUX_MACHINE_MACHINE_FAULT_H

#include <stdio.h>

#include "firmware/control/controller.h"
#include "firmware/host/fault/script.h"
#include "firmware/host/recording/telemetry.h"
#include "firmware/linux/machine/machine_sim.h"

struct cJSON;

/* The state of a connection on TCP. */
struct machine_fault_connection {
    uint64_t timeouts; /* so far */
    unsigned silent;   /* of these, since its other end is gone */
    int64_t closed_ns; /* since then */
};

struct machine_fault {
    const struct fault_script *script;
    struct machine_sim *sim;
    struct memory_pool memory;
    /* of each axis on a CAN bus: of what it sends, what it is sent */
    struct sim_can_trouble *trouble, *trouble_in;
    struct sim_can_port *intruder;      /* another master, of each CAN bus */
    struct sim_modbus_intruder *talker; /* of each Modbus RTU line */
    struct machine_fault_connection *connection; /* of each bus */
    int64_t start_ns;                            /* t = 0 of what is written */
    int64_t event_ns[FAULT_EVENTS];              /* on the clock; -1: not yet */
    int64_t pos_q32[FAULT_ENTRIES_MAX];  /* of its axis, at the step before */
    int64_t begun_ns[FAULT_ENTRIES_MAX]; /* on the clock; -1: not yet */
    uint64_t active; /* a bit per entry: begun, and not over.  What is over at
                        once is so for one step */
    bool looked;     /* pos_q32 is there */
};

/* Takes what it needs of the simulation, before time passes in it; all zero
 * before, machine_fault_free in the end.  MOTION_OK. */
int machine_fault_init(struct machine_fault *self,
                       const struct fault_script *script,
                       struct machine_sim *sim);
void machine_fault_free(struct machine_fault *self);

/* Entry i of the script is new: it waits for its time or place, and is another
 * one than i was before.  MOTION_OK. */
int machine_fault_add(struct machine_fault *self, unsigned i);
/* What entry i does, if it does, is over. */
void machine_fault_end(struct machine_fault *self, unsigned i);

/* After the tick at now_ns, which ended in that phase and state. */
void machine_fault_step(struct machine_fault *self, int64_t now_ns,
                        enum telemetry_phase phase,
                        enum controller_state state);

/* "script: 2.500 s: drive_fault of pan, code 0x2310", a line for each entry. */
void machine_fault_print(const struct machine_fault *self, FILE *file);
/* The member "faults" of a JSON object. */
void machine_fault_json(const struct machine_fault *self, struct cJSON *object);

/* machine_fault_modbus.c: an entry begins or ends at Modbus axis i. */
void machine_fault_modbus(struct machine_fault *self,
                          const struct fault_entry *entry, unsigned i,
                          bool begins);
/* The same at a Modbus bus. */
void machine_fault_modbus_line(struct machine_fault *self,
                               const struct fault_entry *entry, bool begins);
int machine_fault_place_talker(struct machine_fault *self, unsigned bus,
                               uint64_t seed);
/* After a time-out there is a new connection of Modbus TCP, and what was on its
 * way on the old one is gone. */
void machine_fault_connect(struct machine_fault *self);
/* Delay, jitter, loss or duplication of frames begins or ends, on any kind of bus.
 * False: the entry is of another kind. */
bool machine_fault_impair(struct sim_impairment *impairment,
                          const struct fault_entry *entry, bool begins);
/* Of an entry whose value is a distance or an acceleration: in counts, as
 * many as there can be where it is more. */
int64_t machine_fault_counts(const struct machine_fault *self,
                             const struct fault_entry *entry);

#endif

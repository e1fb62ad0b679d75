/* firmware/linux/player/loads.h - what the loads of a simulated rig did in a
 * run: how far each was off its motor while the axes moved, and how far it still
 * swings when they are at their end. */
#ifndef FIRMWARE_LINUX_PLAYER_LOADS_H
#define FIRMWARE_LINUX_PLAYER_LOADS_H

#include <stdio.h>

#include "firmware/host/recording/telemetry.h"
#include "firmware/linux/machine/machine_sim.h"

struct cJSON;
struct job;

/* Of a payload. */
struct payload_seen {
    double off_m, at_end_m; /* at most while the axes move; when they settled */
    double force;           /* the most against its axis, N or N m */
    bool ended;
};

struct load_seen {
    int64_t off_q32;   /* the most */
    int64_t swing_q32; /* when the axes have settled at their end */
    bool ended;        /* there was one */
};

/* All zero: none. */
struct loads {
    struct memory_pool memory;
    struct machine_sim *sim;
    int64_t move_ns; /* of its world, when the move began; 0: it has not */
    struct load_seen *axis;       /* of the rig */
    struct payload_seen *payload; /* of the rig */
};

/* Of a simulation that outlives it. */
void loads_init(struct loads *loads, struct machine_sim *sim);
void loads_free(struct loads *loads);
/* In every tick. */
void loads_step(struct loads *loads, enum telemetry_phase phase);
/* A line for each axis that has one, and for each camera that took pictures or was to. */
void loads_print(const struct loads *loads, const struct job *job, FILE *file);
void loads_json(const struct loads *loads, struct cJSON *object);

#endif

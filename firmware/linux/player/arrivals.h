/* firmware/linux/player/arrivals.h - when the axes whose drives go from key to
 * key by themselves were really there. */
#ifndef FIRMWARE_LINUX_PLAYER_ARRIVALS_H
#define FIRMWARE_LINUX_PLAYER_ARRIVALS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "firmware/host/job/job.h"
#include "firmware/host/recording/telemetry.h"

struct cJSON;

/* One key. */
struct arrivals_seen {
    int64_t t_ns;      /* from the start of the move */
    int64_t after_ns;  /* the end of its planned profile; below 0: before */
    int64_t before_ns; /* the key's own time; below 0: after it */
    int64_t off_q32;   /* actual minus key, when the drive said so */
};

struct arrivals_axis {
    unsigned count;             /* reached */
    struct arrivals_seen *seen; /* as many as there are goals; NULL: set
                                   points */
};

struct arrivals {
    const struct job *job;
    struct memory_pool memory;
    struct arrivals_axis *axis; /* of each axis of the move */
    int64_t start_ns;
};

void arrivals_init(struct arrivals *arrivals, const struct job *job);
void arrivals_free(struct arrivals *arrivals);
void arrivals_take(struct arrivals *arrivals, const struct telemetry_row *row);
/* A table of the keys, of the first ones where there are many, and a sentence
 * per axis; nothing where no drive goes by itself. */
void arrivals_print(const struct arrivals *arrivals, FILE *file);
/* The member "keys" of the object of an axis of the move. */
void arrivals_json(const struct arrivals *arrivals, unsigned index,
                   struct cJSON *object);

#endif

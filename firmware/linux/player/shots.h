/* firmware/linux/player/shots.h - the events of a move: what is planned, and when
 * each shot was really fired. */
#ifndef FIRMWARE_LINUX_PLAYER_SHOTS_H
#define FIRMWARE_LINUX_PLAYER_SHOTS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "firmware/host/job/job.h"
#include "firmware/host/recording/telemetry.h"

struct cJSON;

/* "camera: 24 shots, 500 ms apart or more"; nothing for a move without. */
void shots_plan_print(const struct job *job, FILE *file);
/* The member "triggers" of a JSON object: the planned times. */
void shots_plan_json(const struct job *job, struct cJSON *object);

/* A shot that was fired. */
struct shots_seen {
    int64_t t_ns;    /* from the start of the run */
    int64_t late_ns; /* after the line's lead before the path came to it */
};

struct shots_line {
    unsigned line; /* of the rig */
    uint32_t fired;
    uint32_t failures;       /* times that the line could not be set */
    int64_t late_ns;         /* the latest */
    struct shots_seen *seen; /* as many as are planned */
};

struct shots {
    const struct job *job;
    struct shots_line line[RIG_TRIGGERS_MAX]; /* as in telemetry */
    unsigned count;
    int64_t start_ns; /* of the move */
};

void shots_init(struct shots *shots, const struct job *job);
void shots_free(struct shots *shots);
void shots_take(struct shots *shots, const struct telemetry_row *row);
/* "camera: 24 of 24 shots, at most 0.4 ms late" */
void shots_print(const struct shots *shots, FILE *file);
void shots_json(const struct shots *shots, struct cJSON *object);

#endif

/* firmware/linux/service/move.h - a move that was planned and judged: what the
 * tick plays of it, and what clients are told.
 *
 * Made of a job by the process that plans (planner.h), and passed to the service
 * as bytes in memory that both have: no pointer of a job is in it, and nothing of
 * its size is copied. */
#ifndef FIRMWARE_LINUX_SERVICE_MOVE_H
#define FIRMWARE_LINUX_SERVICE_MOVE_H

#include "firmware/host/job/job_approach.h"
#include "firmware/linux/service/loop.h"

#define SERVICE_MOVE_NAME     "move.yaml" /* of what a client has sent */
#define SERVICE_MOVE_TEXT_MAX 2048
#define SERVICE_MOVE_SAID_MAX 24576

/* Passed as they are. */
struct service_move_facts {
    enum status status;               /* OK: it may be played */
    char text[SERVICE_MOVE_TEXT_MAX]; /* why not, a line each */
    char said[SERVICE_MOVE_SAID_MAX]; /* violations and what would help, as the
                                         text of a JSON object; "": none */
    char title[128];
    int64_t end_ns_q12;
    int64_t times; /* of the file; 0: until a stop */
    struct units_fps fps;
    bool is_ping_pong, is_warped, is_sampled, has_events;
    struct frame_step_config steps;
    int step_line; /* -1: none */
};

/* An axis of the rig. */
struct service_move_axis {
    bool is_driven;  /* by the move; else it stands where it is */
    bool by_profile; /* of its drive: it goes from goal to goal */
    struct motion_track track;
    struct motion_track_summary summary; /* of the track */
    struct controller_goal *goal;
    uint32_t goal_count, key_count;
    int64_t *key_ns_q12; /* its keys, as they were written */
    struct {
        struct motion_segment storage[JOB_APPROACH_SEGMENTS];
        struct motion_track track;
        struct controller_goal goal;
    } approach; /* from where it stands to its first key */
};

struct service_move {
    struct service_move_facts facts;
    struct service_move_axis *axis; /* of the rig */
    struct plan_shots *shots;       /* by line of the rig; times alone */
    struct service_motion motion, approach;
    const char *file_text;
    struct memory_pool memory;
    void *bytes; /* a mapping, which tracks, goals, keys and shots are in */
    size_t size;
    bool *lent; /* to be cleared as it is free again; NULL: nobody's */
};

/* Plan and judge what `files` has as SERVICE_MOVE_NAME, and write the move to
 * `out`, where ferror shows what fails. */
void service_move_plan(const struct files *files, const struct rig *rig,
                       const char *rig_path,
                       const struct plan_progress *progress, FILE *out);
/* The move that was written, for service_move_free, which unmaps `bytes`, a mapping
 * that nobody writes any more: what the tick plays is in it.  NULL: it is not whole.
 * `text`: of its file, which is copied. */
struct service_move *service_move_read(void *bytes, size_t size,
                                       const struct rig *rig, const char *text);
void service_move_free(struct service_move *move);

/* Fills in `approach`: from where the axes of the rig were sent last to their
 * first keys at a quarter of their limits.  0: they are there; 1: there is
 * something to play; or an error of motion_ease_append_limited, and why.  Not while
 * it is played. */
int service_move_approach(struct service_move *move, const struct rig *rig,
                          const struct machine_view_axis axis[],
                          char why[JOB_APPROACH_TEXT_MAX]);

#endif

/* firmware/host/job/job.h - a rig and a move, read, planned and judged.
 *
 * What every command starts from.  Nothing here touches a bus. */
#ifndef FIRMWARE_HOST_JOB_JOB_H
#define FIRMWARE_HOST_JOB_JOB_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "firmware/control/frame_step.h"
#include "firmware/control/goal.h"
#include "firmware/host/base/messages.h"
#include "firmware/host/base/status.h"
#include "firmware/host/job/job_facts.h"
#include "firmware/host/rig/rig.h"
#include "motion/plan/check.h"
#include "motion/plan/compose.h"
#include "motion/plan/shaper/plan_shape.h"
#include "motion/plan/shoot/plan_event.h"

/* X(name, order of the unit, sentence).  The first ones are those of
 * enum plan_violation_kind, in its order; the last two are velocity steps at
 * the first and the last key. */
#define JOB_VIOLATION_LIST(X)                                                  \
    X(JOB_POS_LOW, 0, "position below the lowest")                             \
    X(JOB_POS_HIGH, 0, "position above the highest")                           \
    X(JOB_VEL, 1, "velocity")                                                  \
    X(JOB_ACC, 2, "acceleration")                                              \
    X(JOB_JERK, 3, "jerk")                                                     \
    X(JOB_VEL_STEP, 1, "velocity steps (infinite acceleration)")               \
    X(JOB_ACC_STEP, 2, "acceleration steps (infinite jerk)")                   \
    X(JOB_START_MOVING, 1, "not at rest at the first key")                     \
    X(JOB_END_MOVING, 1, "not at rest at the last key")

enum job_violation_kind {
#define JOB_VIOLATION_ENUM(name, order, text) name,
    JOB_VIOLATION_LIST(JOB_VIOLATION_ENUM)
#undef JOB_VIOLATION_ENUM
};
const char *job_violation_text(enum job_violation_kind kind);
/* 0 position .. 3 jerk */
unsigned job_violation_order(enum job_violation_kind kind);

struct job_violation {
    unsigned axis; /* of the move */
    enum job_violation_kind kind;
    int64_t t_ns_q12;
    int64_t value, limit; /* Q32 */
    uint32_t key;         /* the key at or before it; 0 without keys */
};

struct compiled;
struct yaml_again;

struct job {
    struct memory_pool memory; /* of the arrays */
    char rig_path[4096], move_path[4096];
    struct rig rig;
    bool is_rig_lent; /* its arrays are those of another, which stays */
    struct plan_move move;
    /* of each axis of the move */
    unsigned *rig_axis;
    struct motion_track *track;
    unsigned planned;               /* tracks that are there */
    struct plan_outcome outcome;    /* points into itself */
    struct plan_shape_cost shaping; /* of the rig's shapers, job_shape.h */
    struct motion_track *plain; /* of each axis, before them; NULL: no shaper */
    struct compiled *compiled;  /* NULL, or the move comes from a compiled file:
                                  tracks are windows, axes have no keys */
    /* of each axis of the move whose drive goes from key to key by itself */
    struct controller_goal **goal;
    unsigned *goal_count;
    const struct plan_progress *progress; /* is told of long work; NULL: none */
    bool compared; /* the axes are one axis under several curves (compare.h) */
    int64_t end_ns_q12;             /* of the longest track */
    struct plan_shots *shots;       /* by line of the rig */
    struct frame_step_config steps; /* of a shoot that waits for each frame, */
    const struct rig_line *step_line; /* for an edge of this; NULL: none */
    struct job_violation *violation;
    uint32_t violation_count;
    int64_t rate_q30; /* at which job_check judged it */
    /* with job_open_again */
    bool keeps;               /* what the next plan can take over: */
    const struct job *former; /* while it is planned and judged; NULL */
    struct plan_memo *memo;   /* of spans; on the heap */
    struct job_facts *facts;  /* of each axis; job_check */
    struct yaml_again *text;  /* of the move; on the heap */
    struct messages messages; /* for the user */
};

/* Read both files and plan every axis; `progress` is told how far that is, and
 * what is done with the job later (NULL: nobody).  STATUS_OK, or STATUS_INPUT
 * with one error among the messages; the names must fit rig_path and move_path.
 * job_free in either case.  With `any` a compiled move may be in the place of
 * the move, and all of it is read once. */
enum status job_open(struct job *job, const struct files *files,
                     const char *rig_path, const char *move_path, bool any,
                     const struct plan_progress *progress);
/* The same of a move file, for a rig that has been read and must outlive the job;
 * rig_path is its name in messages. */
enum status job_open_on(struct job *job, const struct files *files,
                        const struct rig *rig, const char *rig_path,
                        const char *move_path,
                        const struct plan_progress *progress);
/* The same for a move that is planned again and again: it keeps what the next
 * plan can take over, and takes over what `former` (of the same, NULL: none) has
 * kept.  Tracks and violations are those of job_open, to the bit.  `former` must
 * be there until job_check, and may be freed then.  `rig`: what the file of the
 * rig says, which must outlive the job; NULL: it is read. */
enum status job_open_again(struct job *job, const struct files *files,
                           const char *rig_path, const char *move_path,
                           const struct job *former, const struct rig *rig);
/* Summarise the tracks before they are played, so that a start on the tick takes no
 * longer for a long one (motion_track_summarise).  They must stay as they are from
 * then on.  Those of a compiled move have their outlines. */
void job_summarise(struct job *job);
/* The copy has no summary and is freed with plan_track_free. */
void job_copy_track(const struct motion_track *track,
                    struct motion_track *copy);
/* The compiled move (track_file.h): tracks, events, where it waits.  Errors show
 * in ferror. */
void job_compile(const struct job *job, FILE *out);
void job_free(struct job *job);
/* Arrays for so many axes of the move, in the place of those there are: for
 * whoever builds the move himself. */
void job_capacity(struct job *job, uint32_t axes);

/* A rig alone; statuses and messages as above. */
enum status job_read_rig(const struct files *files, const char *path,
                         struct rig *rig, struct messages *messages);

/* Judge the tracks as played at `rate_q30` of their speed: at rate r velocity
 * may reach limit / r, acceleration limit / r^2, jerk limit / r^3.  Below
 * 100 % as at 100 %: the controller starts no move that could not be played at
 * its own speed.  Fills violation, in the order of axes and time. */
void job_check(struct job *job, int64_t rate_q30);

/* The violations as a table with a heading, all or the worst 20 of each kind on each
 * axis, and what would help; or all, as the members "violations" and "fit" of a JSON
 * object. */
struct cJSON;
void job_print_violations(const struct job *job, bool all, FILE *file);
void job_json_violations(const struct job *job, struct cJSON *object);
/* What was said of the rig when it was read, as the member "warnings": a list
 * of sentences. */
void job_json_warnings(const struct job *job, struct cJSON *object);
/* Of all tracks, as the member "hash", the one that the studio's page shows; not
 * of a compiled move. */
void job_json_hash(const struct job *job, struct cJSON *object);

/* Limits as they must hold for the tracks themselves at that rate. */
void job_limit_at(const struct plan_limit *limit, int64_t rate_q30,
                  struct plan_limit *scaled);

const struct rig_axis *job_rig_axis(const struct job *job, unsigned axis);
/* Does its drive go from key to key by its own profile? */
bool job_runs_by_drive_profile(const struct job *job, unsigned axis);
/* An axis of the move whose drive is a board, which samples by itself; NULL:
 * there is none. */
const char *job_sampled(const struct job *job);
/* Of the move, by name; -1. */
int job_axis_index(const struct job *job, const char *name);
/* The largest |value| of a quantity on a track, and when (may be NULL). */
int64_t job_peak(const struct motion_track *track,
                 enum motion_quantity quantity, int64_t *t_ns_q12);
/* Its limit (order 1..3). */
int64_t job_limit_of(const struct plan_limit *limit, unsigned order);

#endif

/* firmware/studio/wasm/plan.h - a rig and a move, planned, for a page: what
 * planner.mjs calls.  docs/STUDIO.md, "the planner in the browser", says what
 * comes out.
 *
 * Texts that are returned are the plan's, until the next call of the same
 * function.  Nothing here fails because of what a file says: the report says
 * it. */
#ifndef FIRMWARE_STUDIO_WASM_PLAN_H
#define FIRMWARE_STUDIO_WASM_PLAN_H

#include "firmware/host/job/job.h"
#include "firmware/host/yaml/yaml_text.h"
#include "firmware/studio/wasm/store.h"
#include "motion/plan/rig/plan_rig.h"

/* Also reachable from outside of the module. */
#ifdef __wasm__
#define STUDIO_EXPORT __attribute__((used, visibility("default")))
#else
#define STUDIO_EXPORT
#endif

#define STUDIO_KEY       24 /* numbers of a key */
#define STUDIO_POSE      16 /* of a pose */
#define STUDIO_COLUMN    8  /* of a column of samples */
#define STUDIO_SUBJECT   3
#define STUDIO_VIOLATION 8

/* A rig that was read, of all plans with the same files of it. */
struct studio_rig {
    struct rig rig;
    uint32_t users;
};

struct studio_plan {
    struct store files;
    struct job job;
    enum status status;
    struct studio_rig *rig;
    struct yaml_text text; /* of the move, once it was edited */
    bool is_text_read;
    char *report, *answer;
};

/* `former`, a plan of the same, may be NULL, and is not used later. */
struct studio_plan *studio_plan_new(const struct store *store, const char *rig,
                                    const char *move,
                                    const struct studio_plan *former);
void studio_plan_delete(struct studio_plan *plan);

const char *studio_plan_report(struct studio_plan *plan);

/* --- numbers.c: false, and nothing is written, where there is no such axis or
 * no track --- */

/* STUDIO_KEY per key. */
bool studio_plan_keys(const struct studio_plan *plan, uint32_t axis,
                      double *out);
/* STUDIO_COLUMN per column, of `count` columns from `first` on among the `columns`
 * of from .. to. */
bool studio_plan_samples(const struct studio_plan *plan, uint32_t axis,
                         double from_s, double to_s, uint32_t columns,
                         uint32_t first, uint32_t count, double *out);
/* From when to when, in s, an axis is not as it is in another plan of the same
 * axes; from above to: nowhere. */
bool studio_plan_changed(const struct studio_plan *plan,
                         const struct studio_plan *other, uint32_t axis,
                         double out[2]);
/* STUDIO_VIOLATION per violation of job.violation. */
void studio_plan_violations(const struct studio_plan *plan, double *out);
/* p, v, a, j. */
bool studio_plan_at(const struct studio_plan *plan, uint32_t axis, double t_s,
                    double out[4]);
/* p, v, a, j in Q32 at ticks first .. of `rate` Hz. */
bool studio_plan_rows(const struct studio_plan *plan, uint32_t axis,
                      uint32_t first, uint32_t count, uint32_t rate,
                      int64_t *out);
/* STUDIO_POSE per time; where the rig has no kinematics, false. */
bool studio_plan_poses(const struct studio_plan *plan, double from_s,
                       double to_s, uint32_t count, double *out);
/* STUDIO_SUBJECT per time; false where there is none. */
bool studio_plan_subject(const struct studio_plan *plan, double from_s,
                         double to_s, uint32_t count, double *out);

/* Of a rig on tracks of its axes; without a subject. */
void studio_pose(const struct plan_rig *rig, const struct motion_track *track,
                 int64_t t_ns_q12, double out[STUDIO_POSE]);

/* --- others.c: curves that are no axis's, as the member "others" --- */

struct studio_other {
    const struct plan_axis *curve;
    const char *kind, *name, *unit;
    const char *path[3]; /* in the move's file, of the map with the keys */
    unsigned paths;
    double scale; /* to the unit */
};
/* The one at an index; false after the last. */
bool studio_other(const struct studio_plan *plan, uint32_t index,
                  struct studio_other *other);
/* By what operations call it: "pose NAME", "the fade", "the roll", "the warp". */
bool studio_other_named(const struct studio_plan *plan, const char *name,
                        struct studio_other *other);

void studio_plan_others(const struct studio_plan *plan, struct cJSON *report);
/* STUDIO_COLUMN per column, of one of them. */
bool studio_plan_other_samples(const struct studio_plan *plan, uint32_t index,
                               double from_s, double to_s, uint32_t columns,
                               double *out);

/* --- points.c: points of the path and keys of subjects, as the member "points" --- */

void studio_plan_points(const struct studio_plan *plan, struct cJSON *report);

/* --- approach.c --- */

/* From where every axis of the move stands, in its unit, to where it is at a time:
 * seconds of each axis, then `count` poses on the way, the first number NaN where
 * the rig has no kinematics. */
bool studio_plan_approach(const struct studio_plan *plan, const double *from,
                          double to_s, uint32_t count, double *out);

/* --- edit.c --- */

/* A list of operations, as JSON; the answer as JSON, in bytes of UTF-8. */
const char *studio_plan_edit(struct studio_plan *plan, const char *operations);
/* By a method of repair.h; tolerance: "" where there is none. */
const char *studio_plan_fit(struct studio_plan *plan, const char *method,
                            const char *tolerance);

/* --- body.c: the rig itself, in lines --- */

enum studio_line {
    STUDIO_LINE_RAIL, /* where an axis can take the head */
    STUDIO_LINE_BODY, /* what stands there */
};
/* Points of three numbers, in m; a line begins with NaN, its kind, 0.  How many
 * there are, at most `most`; 0 where the rig has no kinematics. */
uint32_t studio_plan_body(const struct studio_plan *plan, double t_s,
                          uint32_t most, double *out);

/* 2^-12 ns; saturates, NaN is 0. */
int64_t studio_time(double t_s);

#endif

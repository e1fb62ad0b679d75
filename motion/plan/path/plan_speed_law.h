/* motion/plan/path/plan_speed_law.h - the speed law of a path, as a user writes it.
 *
 * A list of parts (motion/path/speed_law.h), one after the other.  One of them
 * may take what the others leave of the path's length; speeds are matched where
 * two join. */
#ifndef MOTION_PLAN_PATH_PLAN_SPEED_LAW_H
#define MOTION_PLAN_PATH_PLAN_SPEED_LAW_H

#include "motion/number/real.h"
#include "motion/path/speed_law.h"
#include "motion/plan/move.h"

#define PLAN_SPEED_LAW_PARTS_MAX  64
#define PLAN_SPEED_LAW_POINTS_MAX 10000

/* X(name, spelling in files, sentence for docs) */
#define PLAN_SPEED_LAW_LIST(X)                                                 \
    X(PLAN_SPEED_LAW_CUBIC, "cubic",                                           \
      "rest to rest, 3u^2 - 2u^3; acceleration steps at both ends")            \
    X(PLAN_SPEED_LAW_QUINTIC, "quintic",                                       \
      "rest to rest with minimum jerk; nothing steps")                         \
    X(PLAN_SPEED_LAW_SINE, "sine",                                             \
      "sine-shaped speed up to k1 and from k2 on")                             \
    X(PLAN_SPEED_LAW_PARABOLIC, "parabolic",                                   \
      "constant acceleration up to k1 and from k2 on")                         \
    X(PLAN_SPEED_LAW_SCURVE, "s-curve",                                        \
      "constant jerk up to k1 and from k2 on")                                 \
    X(PLAN_SPEED_LAW_RAMP, "ramp", "from one speed to another")                \
    X(PLAN_SPEED_LAW_CONSTANT, "constant", "on at the speed there is")         \
    X(PLAN_SPEED_LAW_PAUSE, "pause", "stand still")                            \
    X(PLAN_SPEED_LAW_ACCELERATION, "acceleration",                             \
      "acceleration in straight lines between points")                         \
    X(PLAN_SPEED_LAW_VELOCITY, "velocity",                                     \
      "speed in straight lines between points")                                \
    X(PLAN_SPEED_LAW_DRAWN, "drawn", "a keyed curve: distance over time")

enum plan_speed_law {
#define PLAN_SPEED_LAW_ENUM(name, spelling, text) name,
    PLAN_SPEED_LAW_LIST(PLAN_SPEED_LAW_ENUM)
#undef PLAN_SPEED_LAW_ENUM
};

/* Shape of a ramp; X(name, spelling, kind in motion/path/speed_law.h). */
#define PLAN_RAMP_LIST(X)                                                      \
    X(PLAN_RAMP_LINEAR, "linear", MOTION_SPEED_RAMP_LINE)                      \
    X(PLAN_RAMP_SINE, "sine", MOTION_SPEED_RAMP_SINE)                          \
    X(PLAN_RAMP_CUBIC, "cubic", MOTION_SPEED_RAMP_CUBIC)                       \
    X(PLAN_RAMP_SCURVE, "s-curve", MOTION_SPEED_RAMP_JERK)

enum plan_ramp {
#define PLAN_RAMP_ENUM(name, spelling, kind) name,
    PLAN_RAMP_LIST(PLAN_RAMP_ENUM)
#undef PLAN_RAMP_ENUM
};

/* A length along a path: in its unit, or as a part (1 = 2^32) of its length. */
struct plan_distance {
    bool is_ratio;
    int64_t q32;
};

/* How far a part goes. */
enum plan_extent {
    PLAN_EXTENT_TIMED, /* as its time and speeds say */
    PLAN_EXTENT_GIVEN, /* `length` */
    PLAN_EXTENT_REST,  /* what the other parts leave; one part at most */
};

struct plan_part {
    enum plan_speed_law law;
    enum plan_ramp shape;
    enum plan_extent extent;
    struct plan_distance length;
    int64_t dur_ns_q12;       /* CONSTANT: 0 when a length says it */
    bool has_from;            /* else the speed at which the part before ends */
    int64_t from_q32, to_q32; /* unit/s */
    int64_t k1_q32, k2_q32;
    struct motion_speed_point *point; /* on the heap */
    uint32_t points;
    struct plan_axis *drawn; /* positions are parts of the part's length; on the
                                heap, with its keys */
    struct plan_place place;
};

/* The parts as one track from 0 to `length`, on the heap: plan_track_free.
 * *error_bound: how far it is at most from what the parts say.  On an error the
 * code (of motion_speed_append; MOTION_E_ARG when the parts do not cover the
 * length or cover more), *error, and an empty track. */
int plan_speed_law_track(const struct plan_part *part, uint32_t parts,
                         struct motion_real length, struct motion_track *law,
                         struct motion_real *error_bound,
                         struct plan_error *error);

/* A distance on a path of that length. */
struct motion_real plan_speed_law_distance(const struct plan_distance *distance,
                                           struct motion_real length);

void plan_speed_law_free(struct plan_part *part, uint32_t parts);

#endif

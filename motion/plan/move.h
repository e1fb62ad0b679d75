/* motion/plan/move.h - a move as a user thinks of it, and its tracks.
 *
 * The plain structs that a file reader (or a test, or another program) fills:
 * per axis a list of keys and the kind of curve between them.  Planning turns
 * each into a motion_track.  Off-line only: uses the heap. */
#ifndef MOTION_PLAN_MOVE_H
#define MOTION_PLAN_MOVE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "motion/ease.h"
#include "motion/spline.h"
#include "motion/track.h"

#define PLAN_NAME_MAX 32      /* bytes with the 0 */
#define PLAN_KEYS_MAX 1000000 /* per axis */
#define PLAN_AXES_MAX 32

/* Kind of curve; X(name, spelling in files, sentence for --help and docs). */
#define PLAN_CURVE_LIST(X)                                                     \
    X(PLAN_CURVE_LINEAR, "linear", "straight lines; speed steps at keys")      \
    X(PLAN_CURVE_PARABOLIC, "parabolic",                                       \
      "rest at every key, constant acceleration between")                      \
    X(PLAN_CURVE_SINE, "sine", "rest at every key, sine-shaped speed")         \
    X(PLAN_CURVE_SCURVE, "s-curve", "rest at every key, constant jerk")        \
    X(PLAN_CURVE_HERMITE, "hermite", "cubic; every key gives a velocity")      \
    X(PLAN_CURVE_CATMULL_ROM, "catmull-rom",                                   \
      "cubic through uneven keys; acceleration steps at keys")                 \
    X(PLAN_CURVE_CARDINAL, "cardinal", "cubic with tension mu, 0 to 2")        \
    X(PLAN_CURVE_QUINTIC, "quintic",                                           \
      "fifth degree; acceleration is continuous at keys")

enum plan_curve {
#define PLAN_CURVE_ENUM(name, spelling, text) name,
    PLAN_CURVE_LIST(PLAN_CURVE_ENUM)
#undef PLAN_CURVE_ENUM
};

/* Where in a file something was written; line 0: not from a file. */
struct plan_place {
    uint32_t line, column;
};

struct plan_key {
    struct motion_key key; /* times from the start of the move */
    struct plan_place place;
};

struct plan_limit {
    int64_t pos_min_q32, pos_max_q32;
    int64_t vel_q32;
    int64_t acc_q16;
    int64_t jerk_q16; /* 0: not limited */
};

/* One axis of a move. */
struct plan_axis {
    char name[PLAN_NAME_MAX];
    enum plan_curve curve;
    enum motion_spline_end first, last;
    int64_t mu_q32;         /* cardinal */
    int64_t k1_q32, k2_q32; /* parabolic, sine, s-curve */
    struct plan_key *key;
    uint32_t key_count;
    struct plan_place place;
};

struct plan_move {
    char title[128];
    struct plan_axis axis[PLAN_AXES_MAX];
    uint32_t axis_count;
};

/* What stopped planning: the key (index from 0; 0 when it is about the axis),
 * its place, and one sentence that names axis and key as a person counts them,
 * from 1.  The caller adds file, line and column. */
struct plan_error {
    int code; /* enum motion_err */
    uint32_t key;
    struct plan_place place;
    char text[160];
};

/* Plan one axis.  Every span between two keys is one segment or, for parabolic,
 * sine and s-curve, several; keys are hit to the bit.  An axis whose first key
 * is not at t = 0 stands at its first key until then.
 *
 * What a key may give:           velocity          acceleration
 *   linear                       no                no
 *   parabolic, sine              zero              no
 *   s-curve                      zero              zero
 *   hermite                      must              no
 *   catmull-rom, cardinal        may               no
 *   quintic                      may               may
 * What may be given and is not is filled in (motion/spline.h).
 *
 * On success the track's segments are on the heap and belong to the caller:
 * plan_track_free.  On an error returns the code and fills *error; nothing is
 * left allocated and *track is empty.  MOTION_E_EMPTY: no keys; MOTION_E_ORDER:
 * times; MOTION_E_ARG: a key or parameter that the curve cannot take;
 * MOTION_E_RANGE: the curve leaves the formats; MOTION_E_FULL: too many keys,
 * or no memory. */
int plan_axis_track(const struct plan_axis *axis, struct motion_track *track,
                    struct plan_error *error);
void plan_track_free(struct motion_track *track);

#endif

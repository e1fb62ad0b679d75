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

#include "motion/core/track.h"
#include "motion/curve/ease.h"
#include "motion/curve/fcurve.h"
#include "motion/curve/spline.h"

MOTION_C_BEGIN

#define PLAN_NAME_MAX 32      /* bytes with the 0 */
#define PLAN_KEYS_MAX 1000000 /* per axis */
#define PLAN_AXES_MAX 64

/* Kind of curve; X(name, spelling in files, sentence for --help and docs). */
#define PLAN_CURVE_LIST(X)                                                     \
    X(PLAN_CURVE_LINEAR, "linear", "straight lines; speed steps at keys")      \
    X(PLAN_CURVE_ROUNDED, "rounded",                                           \
      "straight lines, corners rounded at constant acceleration within blend") \
    X(PLAN_CURVE_SMOOTHED, "smoothed",                                         \
      "straight lines, corners rounded without a step of acceleration")        \
    X(PLAN_CURVE_PARABOLIC, "parabolic",                                       \
      "rest at every key, constant acceleration between")                      \
    X(PLAN_CURVE_SINE, "sine", "rest at every key, sine-shaped speed")         \
    X(PLAN_CURVE_SCURVE, "s-curve", "rest at every key, constant jerk")        \
    X(PLAN_CURVE_HERMITE, "hermite", "cubic; every key gives a velocity")      \
    X(PLAN_CURVE_CATMULL_ROM, "catmull-rom",                                   \
      "cubic through uneven keys; acceleration steps at keys")                 \
    X(PLAN_CURVE_CARDINAL, "cardinal", "cubic with tension mu, 0 to 2")        \
    X(PLAN_CURVE_KOCHANEK, "kochanek-bartels",                                 \
      "cubic with tension, continuity and bias, -1 to 1")                      \
    X(PLAN_CURVE_MONOTONE, "monotone",                                         \
      "cubic that never goes beyond its keys (PCHIP)")                         \
    X(PLAN_CURVE_AKIMA, "akima",                                               \
      "cubic that hardly swings; straight parts stay straight")                \
    X(PLAN_CURVE_AKIMA_MONOTONE, "akima-monotone",                             \
      "akima, held back where it would go beyond its keys")                    \
    X(PLAN_CURVE_C2, "c2",                                                     \
      "cubic with continuous acceleration, solved for all keys at once")       \
    X(PLAN_CURVE_QUINTIC, "quintic",                                           \
      "fifth degree; acceleration is continuous at keys")                      \
    X(PLAN_CURVE_C4, "c4",                                                     \
      "fifth degree, continuous to the fourth derivative")                     \
    X(PLAN_CURVE_CONSTRAINTS, "constraints",                                   \
      "lowest degree that meets what every key gives of v and a")              \
    X(PLAN_CURVE_BSPLINE, "b-spline",                                          \
      "keys attract the curve, which passes by them smoothly")                 \
    X(PLAN_CURVE_LAGRANGE, "lagrange",                                         \
      "one polynomial through at most 16 keys; swings, to see why not")        \
    X(PLAN_CURVE_BEZIER, "bezier",                                             \
      "keys with handles and easings, as Blender's curves have them")

enum plan_curve {
#define PLAN_CURVE_ENUM(name, spelling, text) name,
    PLAN_CURVE_LIST(PLAN_CURVE_ENUM)
#undef PLAN_CURVE_ENUM
};

/* What a key may give, and which parameters of an axis a curve takes. */
enum plan_given { PLAN_NO, PLAN_ZERO, PLAN_MAY, PLAN_MUST };

struct plan_curve_rules {
    const char *name;
    enum plan_given vel, acc;
    unsigned ends; /* bit 1 << enum motion_spline_end for each that it has */
    bool mu, ease, blend, shape, handles;
    bool own; /* has a velocity of its own at its ends, which neighbours take */
};
/* NULL where there is no such curve. */
const struct plan_curve_rules *plan_curve_rules(enum plan_curve curve);

/* Where in a file something was written; line 0: not from a file. */
struct plan_place {
    uint32_t line, column;
};

/* Parameters of the span from a key, by its curve. */
union plan_shape {
    int64_t mu_q32;                    /* cardinal */
    int64_t blend_ns_q12;              /* rounded, smoothed */
    struct motion_spline_kochanek tcb; /* kochanek-bartels */
    struct {
        int64_t k1_q32, k2_q32;
    } ease; /* parabolic, sine, s-curve */
};

/* What repair (fit.h) must leave of a key; bits. */
enum plan_fixed { PLAN_FIXED_TIME = 1, PLAN_FIXED_VALUE = 2 };

struct plan_key {
    struct motion_key key; /* times from the start of the move */
    struct plan_place place;
    bool has_curve; /* the span from this key has a curve of its own */
    uint8_t fixed;  /* enum plan_fixed */
    enum plan_curve curve;
    bool has_shape; /* ... and parameters, else the axis's */
    union plan_shape shape;
};

/* A handle, from its key; read for FREE and ALIGNED. */
struct plan_handle {
    uint8_t kind; /* enum motion_fcurve_handle */
    int64_t dt_ns_q12, dp_q32;
};

/* What a key of a bezier curve has besides its point; as motion_fcurve_key. */
struct plan_bezier_key {
    struct plan_handle left, right;
    uint8_t interpolation, easing; /* of the span that starts here */
    int64_t back_q32, amplitude_q32, period_ns_q12;
};

/* The bezier part of an axis; as motion_fcurve.  Extrapolation only where all
 * spans are bezier; cycles and an end of its own where all are, or none. */
struct plan_bezier {
    struct plan_bezier_key *key; /* one per key of the axis; NULL: all
                                    CLAMPED and BEZIER */
    uint8_t smoothing, extrapolation;
    struct motion_fcurve_cycles before, after;
    int64_t frame_ns_q12, value_q32;
    bool has_end; /* else the last key, or the end of so many cycles */
    int64_t end_ns_q12;
};

struct plan_limit {
    int64_t pos_min_q32, pos_max_q32;
    int64_t vel_q32;
    int64_t acc_q32;
    int64_t jerk_q32;  /* 0: not limited */
    int64_t period_ns; /* between set points; 0: steps are judged exactly */
};

/* The axis goes from key to key by its drive's own profile, which is constant
 * acceleration, constant speed, constant deceleration, and stands at every key:
 * a third of the time each, or as the limits require.  It is to stand
 * `settle_ns_q12` before the next key. */
struct plan_profile {
    int64_t vel_q32, acc_q32; /* at most, > 0; vel 0: there is none */
    int64_t settle_ns_q12;    /* >= 0 */
};

/* What drives an axis; all but keys and timing leave its curve and keys
 * empty.
 * X(name, word). */
#define PLAN_DRIVER_LIST(X)                                                    \
    X(PLAN_BY_KEYS, "keys")                                                    \
    X(PLAN_BY_PATH, "path")         /* plan_path.h */                          \
    X(PLAN_BY_CAMERA, "camera")     /* plan_camera.h */                        \
    X(PLAN_BY_BLEND, "blend")       /* plan_blend.h */                         \
    X(PLAN_BY_TIMING, "timing")     /* plan_joints.h: keys without times */    \
    X(PLAN_BY_COUPLING, "coupling") /* plan_couple.h */

enum plan_driver {
#define PLAN_DRIVER_ENUM(name, word) name,
    PLAN_DRIVER_LIST(PLAN_DRIVER_ENUM)
#undef PLAN_DRIVER_ENUM
};
const char *plan_driver_name(enum plan_driver driver);

/* One axis of a move. */
struct plan_axis {
    char name[PLAN_NAME_MAX];
    enum plan_curve curve;
    enum motion_spline_end first, last;
    int64_t mu_q32;         /* cardinal */
    int64_t k1_q32, k2_q32; /* parabolic, sine, s-curve */
    int64_t blend_ns_q12;   /* rounded, smoothed: length of a corner */
    struct motion_spline_kochanek shape;
    struct plan_bezier bezier;
    struct plan_key *key;
    uint32_t key_count;
    struct plan_place place;
    enum plan_driver driver;
    struct plan_profile profile; /* what the curve says then does not count */
};

/* Pointers: NULL where the move has none; on the heap, and freed with
 * plan_move_free (compose.h). */
struct plan_move {
    char title[128];
    uint64_t fps_num, fps_den; /* frames per second; 0 / 0 when not given */
    int64_t duration_ns_q12; /* how long all of it is to take; 0: as written */
    struct plan_place duration_place;
    /* In front of the start and behind the end of a move that is in motion there
     * (plan_roll.h); 0: nothing. */
    int64_t pre_roll_ns_q12, post_roll_ns_q12;
    /* How often it is played, -1 until it is stopped, and whether every second
     * time in reverse; planning is of one time. */
    int32_t times; /* 0: once */
    bool is_ping_pong;
    struct plan_axis *axis;
    uint32_t axis_count;
    struct plan_joints *joints;
    struct plan_path *path;
    struct plan_camera *camera; /* on the path */
    struct plan_blend *blend;
    struct plan_other *layer; /* added to the above, plan_blend.h */
    uint32_t layers;
    struct plan_other *fade;  /* to another move */
    struct plan_axis *warp;   /* of time, plan_warp.h */
    struct plan_shoot *shoot; /* frame by frame, plan_shoot.h; then no warp */
    struct plan_event *event; /* plan_event.h */
    uint32_t events;
    struct plan_coupling *coupling; /* plan_couple.h */
    uint32_t couplings;
};

/* What stopped planning: the key (index from 0; 0 when it is about the axis),
 * its place, and one sentence that names axis and key as a person counts them,
 * from 1.  The caller adds file, line and column. */
struct plan_error {
    int code;      /* enum motion_err */
    uint32_t axis; /* of the move, when it is about one; else PLAN_AXES_MAX */
    uint32_t key;
    struct plan_place place;
    char text[240];
};

/* Plan one axis.  Every span between two keys is one segment or several; keys
 * are hit to the bit, but for the inner ones of rounded, smoothed and b-spline,
 * which pass by.  An axis whose first key is not at t = 0 stands at its first
 * key until then.
 *
 * What a key may give:           velocity          acceleration
 *   linear, rounded, smoothed    no                no
 *   parabolic, sine              zero              no
 *   s-curve                      zero              zero
 *   hermite                      must              no
 *   catmull-rom, cardinal, kochanek-bartels, monotone, akima, akima-monotone
 *                                may               no
 *   c2, quintic, c4, constraints may               may (c2: at its ends)
 *   b-spline, lagrange           no                no
 *   bezier                       no                no
 *
 * Where neighbouring spans have different curves, or parameters, each run of
 * equal ones is planned by itself; at the key between them the curve has the
 * velocity that the key gives, or else that of a straight or resting neighbour,
 * or else that of the parabola through three keys (and, for quintic and c4, its
 * acceleration; zero beside straight and resting ones).  lagrange has a
 * velocity of its own there, which its neighbour takes; beside one that rests
 * or rounds corners it is MOTION_E_ARG.  Only linear steps beside another
 * curve.  A bezier handle of the kinds AUTO and CLAMPED turns to that velocity;
 * any other says it, and its acceleration, and what rests, or rounds corners,
 * beside another velocity is MOTION_E_ARG.  A bezier span whose curve steps
 * is MOTION_E_DISCONTINUITY, one without a finite velocity MOTION_E_SINGULAR.  Keys may be before the start of
 * the move where all spans are bezier.  Cycles of other curves than bezier are
 * keys that are repeated, and the curve goes through all of them, with its end
 * rules at the very first and last one; their end, and the start of the move
 * within those before the first key, must be a key (MOTION_E_ARG).  lagrange
 * has none.  What may be given and is not is filled in (motion/curve/spline.h).
 * With a profile, keys give no velocity but zero; where its limits do not allow
 * what the keys ask for it breaks them, which check.h tells, and keys no
 * further apart than it takes to settle are MOTION_E_ORDER.
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

/* Replace the handles, which belong to another, by a copy of its own whose
 * values are multiplied, as those of the keys are: MOTION_E_FULL without
 * memory, MOTION_E_RANGE; nothing is allocated then. */
int plan_bezier_copy(struct plan_bezier *bezier, uint32_t count,
                     struct motion_real by);

/* The curve that an axis is whose spans are all bezier, with the handles that
 * follow from their kinds; its keys are on the heap, for free().  Errors of
 * plan_axis_track; nothing is allocated then. */
int plan_bezier_curve(const struct plan_axis *axis,
                      struct motion_fcurve *curve);

/* Free what an axis has on the heap: its keys and their handles. */
void plan_axis_free(struct plan_axis *axis);

/* A remark on a track that is right but hardly what was wanted: one polynomial
 * through many keys (lagrange) that goes far beyond them.  False when there is
 * none. */
bool plan_axis_remark(const struct plan_axis *axis,
                      const struct motion_track *track, char text[160]);

MOTION_C_END

#endif

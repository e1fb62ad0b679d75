/* motion/plan/keys/move_internal.h - what the files of move.h share. */
#ifndef MOTION_PLAN_KEYS_MOVE_INTERNAL_H
#define MOTION_PLAN_KEYS_MOVE_INTERNAL_H

#include "motion/plan/plan_memo.h"

/* One axis on its way to a track. */
struct move {
    const struct plan_axis *axis;
    bool is_bezier;         /* on every span: only then are there keys before
                               the start, extrapolation, cycles, an end */
    struct motion_key *key; /* copies, filled in */
    struct motion_spline_work *work;
    struct motion_fcurve handles; /* of all keys; none without a bezier span */
    struct motion_track *track;
    struct plan_error *error;
    const struct plan_memo_axis *former; /* NULL: nothing is taken over */
    struct plan_memo_axis *memo;         /* NULL: nothing is kept */
    uint32_t *planned, *reused;          /* spans, with memo */
    const uint32_t *number; /* which key of the user's each is, from 0; NULL:
                               the same */
};

/* Fill in the error about a key, or about the axis; they return the code. */
__attribute__((format(printf, 4, 5))) int move_fail_key(const struct move *move,
                                                        int code, uint32_t key,
                                                        const char *format,
                                                        ...);
__attribute__((format(printf, 3, 4))) int
move_fail_axis(const struct move *move, int code, const char *format, ...);

/* The curve of the span that starts at key i. */
enum plan_curve move_curve_at(const struct plan_axis *axis, uint32_t i);
/* The parameters of the span that starts at key i, whose curve exists. */
union plan_shape move_shape_at(const struct plan_axis *axis, uint32_t i);
bool move_is_rest(enum plan_curve curve);
bool move_is_straight(enum plan_curve curve);

/* Room for `more` segments, doubling. */
int move_grow(const struct move *move, uint32_t more);

double move_seconds(int64_t t_ns_q12);
double move_units(int64_t a_q32);

/* The curve before key i (`left`), or after it, has this velocity there by
 * itself.  A neighbour that has one of its own, or is given one, must agree; a
 * linear one steps by its nature. */
int move_tell(struct move *move, uint32_t i, bool left, struct motion_real vel);

/* --- check.c ----------------------------------------------------------------- */

/* Every key and both ends, or the first that is wrong. */
int move_check(const struct move *move);
/* Whether the spans before and after key i are planned together. */
bool move_goes_on(const struct plan_axis *axis, uint32_t i);

/* --- fill.c ------------------------------------------------------------------ */

/* Spans of one curve in a row. */
struct move_run {
    uint32_t from, count; /* of keys */
    enum plan_curve curve;
    enum motion_spline_end first, last;
    union plan_shape shape;
};

/* The run that starts at key `from`. */
struct move_run move_run(const struct plan_axis *axis, uint32_t from);

/* Copy the keys; then, where two runs meet at key i, settle the velocity there;
 * then what is missing inside a run. */
int move_copy(struct move *move);
int move_pin(struct move *move, uint32_t i);
int move_fill(const struct move *move, const struct move_run *run);

/* --- profile.c: by the drive's own profile ----------------------------------- */

bool move_has_profile(const struct plan_axis *axis);
int move_profile_check(const struct move *move);
int move_profile_append(const struct move *move);

/* --- cycles.c: of axes that are not bezier throughout ------------------------ */

/* Cycles, or an end of its own. */
bool move_has_cycles(const struct plan_axis *axis);
int move_cycles_check(const struct move *move);
/* The axis with its keys written out, and which key of the axis each is; both
 * on the heap, for free(), also after an error. */
int move_cycles_write(const struct move *move, struct plan_axis *out,
                      uint32_t **number);

/* --- memo.c --------------------------------------------------------------- */

/* All with move->memo.  Begin what is next on the track: `spans` spans of a kind,
 * a curve or another number.  Then all else that decides what its segments are. */
void move_memo_begin(const struct move *move, int64_t kind, uint32_t spans,
                     struct plan_memo_span *span);
void move_memo_add(const struct move *move, int64_t word);
void move_memo_add_real(const struct move *move, struct motion_real value);
/* Append what a former plan made of the same; false: it made nothing of it. */
bool move_memo_recall(const struct move *move, struct plan_memo_span *span);
/* The span as it was appended; and the track, once it is whole. */
int move_memo_keep(const struct move *move, struct plan_memo_span *span);
int move_memo_close(const struct move *move);

/* --- bezier.c ------------------------------------------------------------- */

bool move_is_bezier(const struct plan_axis *axis);
int move_bezier_check(const struct move *move);

/* Compute the handles of all keys, into move->handles, whose keys are on the
 * heap then. */
int move_bezier_handles(struct move *move);

/* At key i a bezier span meets another curve.  An automatic handle turns to the
 * velocity that key[i] has there; any other one says that velocity, and the
 * acceleration; a neighbour that cannot have it is refused. */
int move_bezier_pin(struct move *move, uint32_t i, bool fifth);

/* From key to key; or, of an axis that is bezier as a whole, all of it. */
int move_bezier_append(const struct move *move, uint32_t from, uint32_t to);
int move_bezier_append_all(const struct move *move);

#endif

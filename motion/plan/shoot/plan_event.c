/* motion/plan/shoot/plan_event.c - see plan_event.h.
 *
 * Where a track passes a position: each segment is parted where it turns, so
 * that it runs one way in each part; there the position rises or falls and one
 * halving finds the first 2^-12 ns at which it is reached.  Positions are those
 * of motion_segment_state; only the turning points come from doubles, and one
 * that is a little off parts a segment a little beside its turn, where the
 * travel that is overlooked is below the rounding of a position. */
#include "motion/plan/shoot/plan_event.h"

#include <math.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/plan_error.h"

#define EVENT_TURNS_MAX MOTION_TRACK_DEGREE

/* A line's shots while they grow. */
struct event_list {
    struct plan_shots shots;
    uint32_t capacity;
    uint32_t event; /* whose shots are being added */
};

static int event_add(struct event_list *list, int64_t t_ns_q12)
{
    struct plan_shots *shots = &list->shots;

    if (shots->count == PLAN_SHOTS_MAX)
        return MOTION_E_FULL;
    if (shots->count == list->capacity) {
        const uint32_t capacity = list->capacity == 0 ? 64 : 2 * list->capacity;
        int64_t *t = realloc(shots->t_ns_q12, capacity * sizeof *t);
        if (t != NULL)
            shots->t_ns_q12 = t;
        uint32_t *event = realloc(shots->event, capacity * sizeof *event);
        if (event != NULL)
            shots->event = event;
        if (t == NULL || event == NULL)
            return MOTION_E_FULL;
        list->capacity = capacity;
    }
    shots->t_ns_q12[shots->count] = t_ns_q12;
    shots->event[shots->count++] = list->event;
    return MOTION_OK;
}

/* ---- by time ---- */

static int event_times(struct event_list *list, const struct plan_event *event,
                       int64_t end_ns_q12, int64_t lag_ns_q12)
{
    const int64_t to =
        event->has_to && event->to < end_ns_q12 ? event->to : end_ns_q12;
    int64_t t = event->at;

    while (t <= to) {
        int err = event_add(list, t + lag_ns_q12);
        if (err < 0)
            return err;
        if (event->every == 0 || t > INT64_MAX - event->every)
            break;
        t += event->every;
    }
    return MOTION_OK;
}

/* ---- where a segment turns ---- */

static double event_poly(const double *coef, int degree, double u)
{
    double sum = coef[degree];
    for (int i = degree - 1; i >= 0; i--)
        sum = sum * u + coef[i];
    return sum;
}

static double event_halve(const double *coef, int degree, double a, double b)
{
    const bool rising = event_poly(coef, degree, a) < 0;

    for (int i = 0; i < 60; i++) {
        const double middle = (a + b) / 2;
        if ((event_poly(coef, degree, middle) < 0) == rising)
            a = middle;
        else
            b = middle;
    }
    return (a + b) / 2;
}

/* The roots in (0, 1) of one polynomial, rising, given those of its
 * derivative: between two of these there is at most one. */
static int event_roots_between(const double *coef, int degree,
                               const double *turn, int turns, double *root)
{
    int count = 0;

    for (int i = 0; i <= turns; i++) {
        const double from = i == 0 ? 0 : turn[i - 1];
        const double to = i == turns ? 1 : turn[i];
        const double a = event_poly(coef, degree, from);
        const double b = event_poly(coef, degree, to);
        if ((a < 0 && b > 0) || (a > 0 && b < 0))
            root[count++] = event_halve(coef, degree, from, to);
        else if (b == 0 && i < turns)
            root[count++] = to;
    }
    return count;
}

/* From the last derivative, a constant, up to the polynomial itself. */
static int event_roots(const double *coef, int degree, double *root)
{
    double slope[MOTION_TRACK_DEGREE][MOTION_TRACK_DEGREE] = { { 0 } };
    double turn[EVENT_TURNS_MAX];
    int turns = 0;

    for (int k = 0; k <= degree; k++)
        slope[0][k] = coef[k];
    for (int n = 1; n < degree; n++)
        for (int k = 0; k <= degree - n; k++)
            slope[n][k] = (k + 1) * slope[n - 1][k + 1];
    for (int n = degree - 1; n >= 0; n--) {
        turns = event_roots_between(slope[n], degree - n, turn, turns, root);
        for (int i = 0; i < turns; i++)
            turn[i] = root[i];
    }
    return turns;
}

/* Velocity over u, up to a factor. */
static int event_turns(const struct motion_segment *segment, double *u)
{
    double vel[MOTION_TRACK_DEGREE];

    for (int k = 1; k <= MOTION_TRACK_DEGREE; k++)
        vel[k - 1] = k * ldexp((double)segment->coef[k], -k);
    return event_roots(vel, MOTION_TRACK_DEGREE - 1, u);
}

/* ---- by position ---- */

struct event_walk {
    struct event_list *list;
    const struct plan_event *event;
    const struct motion_segment *segment;
    int64_t origin_q32;
    int64_t first_step, last_step; /* of `every` */
};

static int64_t event_pos(const struct motion_segment *segment, int64_t t_ns_q12)
{
    struct motion_state state;
    motion_segment_state(segment, t_ns_q12, &state);
    return state.pos_q32;
}

/* The first time in (a, b] at which `pos` is reached; it is at b. */
static int64_t event_first(const struct motion_segment *segment, int64_t a,
                           int64_t b, int64_t pos_q32, bool rising)
{
    while (b - a > 1) {
        const int64_t middle = a + (b - a) / 2;
        const int64_t at = event_pos(segment, middle);
        if (rising ? at >= pos_q32 : at <= pos_q32)
            b = middle;
        else
            a = middle;
    }
    return b;
}

/* Positions are within +-2^63, a grid's lines far apart enough for 10^6 shots:
 * counted from the origin in whole steps, rounded down. */
static int64_t event_step(const struct event_walk *walk, int64_t pos_q32,
                          bool up)
{
    const int64_t every = walk->event->every;
    int64_t apart, step;

    if (motion_fixed_sub(pos_q32, walk->origin_q32, &apart) < 0)
        apart = pos_q32 > walk->origin_q32 ? INT64_MAX : INT64_MIN + 1;
    step = apart / every;
    if (apart % every < 0)
        step--;
    return up && apart % every != 0 ? step + 1 : step;
}

static int event_pass(const struct event_walk *walk, int64_t a, int64_t b,
                      int64_t pos_q32, bool rising)
{
    return event_add(walk->list,
                     walk->segment->start_ns_q12 +
                         event_first(walk->segment, a, b, pos_q32, rising));
}

/* A part that runs one way; what is at its beginning belongs to the one before
 * it. */
static int event_part(const struct event_walk *walk, int64_t a, int64_t b)
{
    const int64_t from = event_pos(walk->segment, a);
    const int64_t to = event_pos(walk->segment, b);
    const bool rising = to > from;
    int err = MOTION_OK;

    if (from == to || b <= a)
        return MOTION_OK;
    if (walk->event->every == 0) {
        const int64_t at = walk->event->at;
        const bool passes =
            rising ? from < at && at <= to : to <= at && at < from;
        return passes ? event_pass(walk, a, b, at, rising) : MOTION_OK;
    }
    /* the steps in (from, to] going up, in [to, from) going down */
    const int64_t low =
        rising ? event_step(walk, from, false) + 1 : event_step(walk, to, true);
    const int64_t high =
        rising ? event_step(walk, to, false) : event_step(walk, from, true) - 1;
    for (int64_t k = motion_fixed_most(low, walk->first_step);
         err == MOTION_OK && k <= high && k <= walk->last_step; k++)
        err = event_pass(walk, a, b, walk->origin_q32 + k * walk->event->every,
                         rising);
    return err;
}

static int event_segment(struct event_walk *walk,
                         const struct motion_segment *segment)
{
    double u[EVENT_TURNS_MAX];
    const int turns = event_turns(segment, u);
    int64_t from = 0;
    int err = MOTION_OK;

    walk->segment = segment;
    for (int i = 0; i < turns && err == MOTION_OK; i++) {
        const int64_t t =
            llround(ldexp(u[i], 52) * ldexp((double)segment->dur_ns_q12, -52));
        if (t <= from || t >= segment->dur_ns_q12)
            continue;
        err = event_part(walk, from, t);
        from = t;
    }
    return err < 0 ? err : event_part(walk, from, segment->dur_ns_q12);
}

static bool event_starts_there(const struct event_walk *walk, int64_t pos_q32)
{
    const int64_t step =
        walk->event->every == 0 ? 0 : event_step(walk, pos_q32, false);

    if (walk->event->every == 0)
        return pos_q32 == walk->event->at;
    return step == event_step(walk, pos_q32, true) &&
           step >= walk->first_step && step <= walk->last_step;
}

static int event_along(struct event_walk *walk,
                       const struct motion_track *track)
{
    struct motion_state start;
    int err = MOTION_OK;

    motion_track_state(track, 0, &start);
    if (event_starts_there(walk, start.pos_q32))
        err = event_add(walk->list, 0);
    for (uint32_t i = 0; err == MOTION_OK && i < track->count; i++)
        err = event_segment(walk, &track->segment[i]);
    return err;
}

static int event_positions(struct event_list *list,
                           const struct plan_event *event,
                           const struct motion_track *track)
{
    struct event_walk walk = { .list = list,
                               .event = event,
                               .origin_q32 = event->at,
                               .first_step = INT64_MIN,
                               .last_step = INT64_MAX };
    struct motion_state start;

    motion_track_state(track, 0, &start);
    if (!event->has_at)
        walk.origin_q32 = start.pos_q32;
    return event_along(&walk, track);
}

/* From `at` on, as far as `to`. */
static int event_distances(struct event_list *list,
                           const struct plan_event *event,
                           const struct motion_track *distance)
{
    struct event_walk walk = { .list = list,
                               .event = event,
                               .origin_q32 = event->at,
                               .last_step = INT64_MAX };

    if (event->has_to && event->every > 0)
        walk.last_step = (event->to - event->at) / event->every;
    return event_along(&walk, distance);
}

/* ---- all rules of a line ---- */

static int event_one(struct event_list *list, const struct plan_move *move,
                     const struct motion_track track[],
                     const struct plan_outcome *outcome,
                     const struct plan_event *event)
{
    int64_t end_ns_q12 = 0;

    switch (event->of) {
    case PLAN_EVENT_OF_AXIS:
        return event_positions(list, event, &track[event->axis]);
    case PLAN_EVENT_OF_PATH:
        return event_distances(list, event, &outcome->distance);
    case PLAN_EVENT_OF_TIME:
        break;
    }
    for (uint32_t i = 0; i < move->axis_count; i++)
        if (track[i].end_ns_q12 > end_ns_q12)
            end_ns_q12 = track[i].end_ns_q12;
    return event_times(list, event,
                       end_ns_q12 - outcome->lag_ns_q12 - outcome->tail_ns_q12,
                       outcome->lag_ns_q12);
}

static const char *event_never_text(enum plan_event_of of)
{
    if (of == PLAN_EVENT_OF_TIME)
        return "is after the end of the move, expected a time within it";
    return of == PLAN_EVENT_OF_PATH
               ? "is beyond the end of the path, expected a distance on it"
               : "is where the axis never comes, expected a position that it "
                 "passes";
}

struct event_sort {
    int64_t t_ns_q12;
    uint32_t event;
};

static int event_compare(const void *a, const void *b)
{
    const struct event_sort *one = a, *other = b;
    if (one->t_ns_q12 != other->t_ns_q12)
        return one->t_ns_q12 < other->t_ns_q12 ? -1 : 1;
    return one->event < other->event ? -1 : one->event > other->event;
}

static int event_in_order(struct plan_shots *shots)
{
    struct event_sort *sort;

    if (shots->count == 0)
        return MOTION_OK;
    sort = malloc(shots->count * sizeof *sort);
    if (sort == NULL)
        return MOTION_E_FULL;
    for (uint32_t i = 0; i < shots->count; i++)
        sort[i] = (struct event_sort){ shots->t_ns_q12[i], shots->event[i] };
    qsort(sort, shots->count, sizeof *sort, event_compare);
    for (uint32_t i = 0; i < shots->count; i++) {
        shots->t_ns_q12[i] = sort[i].t_ns_q12;
        shots->event[i] = sort[i].event;
    }
    free(sort);
    return MOTION_OK;
}

int plan_shots_make(const struct plan_move *move,
                    const struct motion_track track[],
                    const struct plan_outcome *outcome, uint32_t line,
                    struct plan_shots *shots, struct plan_error *error)
{
    struct event_list list = { .capacity = 0 };
    struct plan_place place = { 0 };
    int err = MOTION_OK;

    for (uint32_t i = 0; err == MOTION_OK && i < move->events; i++) {
        const uint32_t before = list.shots.count;
        if (move->event[i].line != line)
            continue;
        place = move->event[i].place;
        list.event = i;
        err = event_one(&list, move, track, outcome, &move->event[i]);
        if (err == MOTION_OK && list.shots.count == before)
            err = plan_error_set(error, MOTION_E_RANGE, place, "the event %s",
                                 event_never_text(move->event[i].of));
    }
    if (err == MOTION_OK)
        err = event_in_order(&list.shots);
    if (err == MOTION_E_FULL)
        plan_error_set(error, err, place,
                       "the events are more than 1,000,000 shots, or than the "
                       "memory holds");
    *shots = list.shots;
    if (err < 0)
        plan_shots_free(shots);
    return err;
}

void plan_shots_free(struct plan_shots *shots)
{
    free(shots->t_ns_q12);
    free(shots->event);
    *shots = (struct plan_shots){ .count = 0 };
}

/* firmware/host/exchange/otg_motion.c - see otg_motion.h. */
#include "firmware/host/exchange/otg_motion.h"

#include <math.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "motion/core/err.h"

/* --- pieces --------------------------------------------------------------- */

static double piece_seconds(const struct otg_piece *piece, int64_t t_ns_q12)
{
    return (double)ldexpl((long double)t_ns_q12 / OTG_TICKS_PER_SECOND,
                          piece->time);
}

/* What runs farther than a track reaches is counted in a coarser unit. */
static int piece_track(struct otg_piece *piece,
                       const struct motion_otg_trajectory *trajectory)
{
    struct motion_otg_trajectory coarse = *trajectory;
    int err = motion_otg_track(&coarse, piece->segment, MOTION_OTG_PHASES,
                               &piece->track);
    while (err == MOTION_E_RANGE && coarse.origin_q32 == 0 &&
           coarse.fine_bits < 32) {
        coarse.fine_bits++;
        err = motion_otg_track(&coarse, piece->segment, MOTION_OTG_PHASES,
                               &piece->track);
    }
    piece->length += coarse.fine_bits - trajectory->fine_bits;
    return err;
}

/* `piece` holds its row's units, what it counts from and when it begins. */
static int piece_make(struct otg_piece *piece,
                      const struct motion_otg_trajectory *trajectory)
{
    const struct motion_otg_plan *plan = &trajectory->plan;
    const int bits = piece->length - 32 - trajectory->fine_bits;
    piece->residual_p = ldexp((double)plan->residual_pos_q32, bits);
    piece->residual_v =
        ldexp((double)plan->residual_vel_q32, bits - piece->time);
    piece->end_s = piece->begin_s + piece_seconds(piece, plan->dur_ns_q12);
    piece->until_s = (double)INFINITY;
    return piece_track(piece, trajectory);
}

static double known(double own, double evaluated)
{
    return isnan(own) ? evaluated : own;
}

/* The plan keeps its limits; what the coefficients of its track were rounded by
 * is beyond them where it runs at one. */
static double rounded_back(double x, double low, double high, double rounding)
{
    if (x > high && x <= high + rounding)
        return high;
    if (x < low && x >= low - rounding)
        return low;
    return x;
}

static void piece_rounded_back(const struct otg_piece *piece,
                               const struct motion_segment *in,
                               struct otg_point *at)
{
    const double *limit = piece->limit;
    const int bits = piece->length - 32, time = piece->time;
    double rounding[MOTION_JERK + 1];
    for (int i = MOTION_VEL; i <= MOTION_JERK; i++)
        rounding[i] =
            ldexp((double)motion_segment_rounding(in, (enum motion_quantity)i),
                  bits - i * time);
    at->v = rounded_back(at->v, limit[OTG_VMIN], limit[OTG_VMAX],
                         rounding[MOTION_VEL]);
    at->a = rounded_back(at->a, limit[OTG_AMIN], limit[OTG_AMAX],
                         rounding[MOTION_ACC]);
    at->j = rounded_back(at->j, -limit[OTG_JMAX], limit[OTG_JMAX],
                         rounding[MOTION_JERK]);
}

struct otg_point otg_piece_at(const struct otg_piece *piece, uint32_t segment,
                              int64_t t_ns_q12)
{
    const struct motion_track *track = &piece->track;
    const struct motion_segment *in = &track->segment[segment];
    const int bits = piece->length - 32, time = piece->time;
    const struct otg_point *own = NULL;
    struct motion_state state = track->end;
    double t = 0;
    if (track->count > 0) {
        motion_segment_state(in, t_ns_q12, &state);
        t = piece_seconds(piece, in->start_ns_q12 + t_ns_q12);
    }
    if (segment == 0 && t_ns_q12 == 0)
        own = &piece->start;
    if (track->count == 0 ||
        (segment + 1 == track->count && t_ns_q12 == in->dur_ns_q12))
        own = &piece->goal;
    struct otg_point at = {
        piece->begin_s + t,
        piece->place + piece->speed * t + ldexp((double)state.pos_q32, bits),
        piece->speed + ldexp((double)state.vel_q32, bits - time),
        ldexp((double)state.acc_q32, bits - 2 * time),
        ldexp((double)state.jerk_q32, bits - 3 * time),
    };
    if (track->count > 0)
        piece_rounded_back(piece, in, &at);
    if (own != NULL) {
        at.p = known(own->p, at.p);
        at.v = known(own->v, at.v);
        at.a = known(own->a, at.a);
    }
    return at;
}

struct otg_point otg_piece_end(const struct otg_piece *piece)
{
    const uint32_t count = piece->track.count;
    struct otg_point end;
    if (count == 0)
        end = otg_piece_at(piece, 0, 0);
    else
        end = otg_piece_at(piece, count - 1,
                           piece->track.segment[count - 1].dur_ns_q12);
    end.j = 0;
    return end;
}

/* --- legs ----------------------------------------------------------------- */

/* Units, start and goal of an axis in a leg that begins at begin_s. */
static struct otg_piece *leg_piece(const struct otg_motion *motion, int leg,
                                   int axis, const struct otg_scaled *scaled,
                                   double begin_s)
{
    const double *first = motion->leg[0].row.value[axis];
    const double *value = motion->leg[leg].row.value[axis];
    const bool velocity = motion->header->velocity;
    const double none = (double)NAN;
    struct otg_piece *piece = &motion->leg[leg].piece[axis];
    memset(piece, 0, sizeof *piece);
    piece->length = scaled->length[axis];
    piece->time = scaled->time;
    piece->place = first[OTG_P0];
    piece->speed = velocity ? value[OTG_V0] : 0;
    piece->begin_s = begin_s;
    piece->limit = value;
    piece->start = (struct otg_point){ none, velocity ? none : value[OTG_P0],
                                       value[OTG_V0], value[OTG_A0], none };
    piece->goal = (struct otg_point){ none, velocity ? none : value[OTG_PF],
                                      value[OTG_VF], value[OTG_AF], none };
    return piece;
}

/* What the nearest whole tick leaves of the goal is no part of the motion. */
static void piece_meets(struct otg_piece *piece)
{
    piece->goal.p -= piece->residual_p;
    piece->goal.v -= piece->residual_v;
}

static int leg_planned(const struct otg_motion *motion, int leg, int axis,
                       const struct otg_scaled *scaled, double begin_s,
                       const struct motion_otg_trajectory *trajectory)
{
    struct otg_piece *piece = leg_piece(motion, leg, axis, scaled, begin_s);
    int err = piece_make(piece, trajectory);
    piece_meets(piece);
    return err;
}

static int leg_plans(const struct otg_motion *motion, int leg,
                     const struct otg_scaled *scaled, double begin_s,
                     const struct motion_otg_plan plan[])
{
    int err = MOTION_OK;
    struct otg_leg *at = &motion->leg[leg];
    at->begin_s = at->end_s = begin_s;
    for (int axis = 0; axis < motion->header->axes && err == MOTION_OK;
         axis++) {
        const struct motion_otg_trajectory trajectory = { .plan = plan[axis] };
        err = leg_planned(motion, leg, axis, scaled, begin_s, &trajectory);
        at->end_s = fmax(at->end_s, at->piece[axis].end_s);
    }
    return err;
}

static bool is_bent(const struct otg_motion *motion,
                    const struct otg_scaled *scaled)
{
    static struct motion_otg_plan plan[MOTION_SYNC_AXES]; /* large */
    return motion->kind == MOTION_SYNC_PHASE &&
           motion_sync_make(scaled->move, motion->header->axes,
                            MOTION_SYNC_STRAIGHT, plan, NULL) < 0;
}

static int make_one(struct otg_motion *motion, const struct otg_scaled *scaled)
{
    static struct motion_otg_plan plan[MOTION_SYNC_AXES]; /* large */
    int err = motion_sync_make(scaled->move, motion->header->axes, motion->kind,
                               plan, &motion->fault);
    if (err < 0)
        return err;
    motion->bent = is_bent(motion, scaled);
    return leg_plans(motion, 0, scaled, 0, plan);
}

/* --- through points ------------------------------------------------------- */

struct points {
    struct motion_state start[MOTION_SYNC_AXES];
    struct motion_otg_limit limit[MOTION_SYNC_AXES];
    struct motion_otg_point *point;
    struct motion_otg_plan *plan;
};

static void points_of(const struct otg_motion *motion,
                      const struct otg_scaled scaled[], struct points *points)
{
    const size_t axes = (size_t)motion->header->axes;
    for (size_t axis = 0; axis < axes; axis++) {
        points->start[axis] = scaled[0].move[axis].start;
        points->limit[axis] = scaled[0].move[axis].limit;
    }
    for (size_t i = 0; i < (size_t)motion->legs; i++)
        for (size_t axis = 0; axis < axes; axis++) {
            const struct motion_state *goal = &scaled[i].move[axis].goal;
            points->point[i * axes + axis] = (struct motion_otg_point){
                goal->pos_q32, goal->vel_q32,
                !isnan(motion->leg[i].row.value[axis][OTG_VF])
            };
        }
}

/* The velocities that were chosen, and where each leg begins. */
static void points_into_rows(const struct otg_motion *motion,
                             const struct otg_scaled *scaled,
                             const struct points *points)
{
    const int axes = motion->header->axes;
    for (int i = 0; i < motion->legs; i++)
        for (int axis = 0; axis < axes; axis++) {
            double *value = motion->leg[i].row.value[axis];
            const double *before =
                i > 0 ? motion->leg[i - 1].row.value[axis] : value;
            if (i > 0) {
                value[OTG_P0] = before[OTG_PF];
                value[OTG_V0] = before[OTG_VF];
                value[OTG_A0] = 0;
            }
            if (isnan(value[OTG_VF]))
                value[OTG_VF] =
                    ldexp((double)points->point[i * axes + axis].vel_q32,
                          scaled->length[axis] - 32 - scaled->time);
        }
}

static int through_points(struct otg_motion *motion,
                          const struct otg_scaled scaled[],
                          struct points *points)
{
    const int axes = motion->header->axes;
    points_of(motion, scaled, points);
    int err = motion_otg_through(points->start, points->limit, axes,
                                 points->point, motion->legs, points->plan,
                                 &motion->failed, &motion->fault);
    if (err < 0)
        return err;
    points_into_rows(motion, &scaled[0], points);
    double begin_s = 0;
    for (int i = 0; i < motion->legs && err == MOTION_OK; i++) {
        motion->failed = i;
        err = leg_plans(motion, i, &scaled[i], begin_s,
                        points->plan + (ptrdiff_t)i * axes);
        begin_s = motion->leg[i].end_s;
        for (int axis = 0; axis < axes && i + 1 < motion->legs; axis++)
            motion->leg[i].piece[axis].until_s = begin_s;
    }
    return err;
}

static int make_through(struct otg_motion *motion,
                        const struct otg_scaled scaled[])
{
    const size_t count = (size_t)motion->legs * (size_t)motion->header->axes;
    struct points points = {
        .point = memory_new(count, sizeof *points.point),
        .plan = memory_new(count, sizeof *points.plan),
    };
    int err = through_points(motion, scaled, &points);
    memory_free(points.point);
    memory_free(points.plan);
    return err;
}

/* --- replanning ----------------------------------------------------------- */

/* From where the plan in force is when row `leg` comes. */
struct chase {
    struct motion_otg_trajectory old, next;
    struct otg_piece *piece; /* that of old */
};

/* Where a plan has ended its axis stands, or no row says what it does. */
static bool has_run_out(const struct chase *chase, double t)
{
    return t > chase->piece->end_s && chase->old.plan.goal_vel_q32 != 0;
}

static int chase_goal(const struct otg_motion *motion, int leg, int axis,
                      const struct otg_scaled *scaled, struct chase *chase,
                      struct motion_sync_fault *fault)
{
    const double t = motion->leg[leg].row.t - chase->piece->begin_s;
    const long double ticks =
        ldexpl((long double)t, -scaled->time) * OTG_TICKS_PER_SECOND;
    const int64_t at = ticks < 0x1p60L ? llroundl(ticks) : INT64_C(1) << 60;
    if (has_run_out(chase, motion->leg[leg].row.t)) {
        fault->field = MOTION_OTG_FIELD_NONE;
        return MOTION_E_STATE;
    }
    int outcome = motion_otg_replan(&chase->old, at, &scaled->move[axis],
                                    &chase->next, &fault->field);
    if (outcome < 0)
        return outcome;
    const double begin_s =
        chase->piece->begin_s + piece_seconds(chase->piece, at);
    struct otg_piece *piece = leg_piece(motion, leg, axis, scaled, begin_s);
    piece->outcome = (enum motion_otg_outcome)outcome;
    piece->field = fault->field;
    if (outcome == MOTION_OTG_KEPT)
        return MOTION_OK;
    if (outcome == MOTION_OTG_STOP)
        piece->goal.p = piece->goal.v = piece->goal.a = (double)NAN;
    chase->piece->until_s = begin_s;
    chase->piece = piece;
    chase->old = chase->next;
    int err = piece_make(piece, &chase->old);
    piece_meets(piece);
    return err;
}

static int chase_axis(struct otg_motion *motion, int axis,
                      const struct otg_scaled scaled[])
{
    static struct chase chase; /* large */
    int err = motion_otg_begin(&scaled[0].move[axis], &chase.old,
                               &motion->fault.field);
    motion->failed = 0;
    motion->fault.axis = axis;
    if (err == MOTION_OK)
        err = leg_planned(motion, 0, axis, &scaled[0], 0, &chase.old);
    chase.piece = &motion->leg[0].piece[axis];
    motion->leg[0].end_s = fmax(motion->leg[0].end_s, chase.piece->end_s);
    for (int i = 1; i < motion->legs && err == MOTION_OK; i++) {
        motion->failed = i;
        err = chase_goal(motion, i, axis, &scaled[i], &chase, &motion->fault);
        motion->leg[i].begin_s = motion->leg[i].row.t;
        motion->leg[i].end_s = fmax(motion->leg[i].end_s, chase.piece->end_s);
    }
    return err;
}

static int make_replan(struct otg_motion *motion,
                       const struct otg_scaled scaled[])
{
    int err = MOTION_OK;
    for (int axis = 0; axis < motion->header->axes && err == MOTION_OK; axis++)
        err = chase_axis(motion, axis, scaled);
    return err;
}

/* --- all ------------------------------------------------------------------ */

void otg_motion_walk(const struct otg_motion *motion, int axis,
                     otg_motion_take *take, void *context)
{
    for (int leg = 0; leg < motion->legs; leg++) {
        const struct otg_piece *piece = &motion->leg[leg].piece[axis];
        if (piece->outcome == MOTION_OTG_KEPT)
            continue;
        for (uint32_t i = 0; i < piece->track.count; i++) {
            const struct otg_point at = otg_piece_at(piece, i, 0);
            if (i == 0 || at.t < piece->until_s)
                take(context, leg, &at);
        }
        const struct otg_point end = otg_piece_end(piece);
        if (piece->end_s < piece->until_s)
            take(context, leg, &end);
    }
}

const struct otg_piece *otg_motion_last(const struct otg_motion *motion,
                                        int axis)
{
    int leg = motion->legs - 1;
    while (motion->leg[leg].piece[axis].outcome == MOTION_OTG_KEPT)
        leg--; /* the first is new */
    return &motion->leg[leg].piece[axis];
}

void otg_motion_init(struct otg_motion *motion, const struct otg_header *header,
                     enum motion_sync_kind kind, int legs)
{
    *motion =
        (struct otg_motion){ .header = header, .kind = kind, .legs = legs };
    motion->leg = memory_new((size_t)legs, sizeof *motion->leg);
    for (int i = 0; i < legs; i++)
        motion->leg[i].piece =
            memory_new((size_t)header->axes, sizeof *motion->leg[i].piece);
}

void otg_motion_free(struct otg_motion *motion)
{
    for (int i = 0; i < motion->legs; i++)
        memory_free(motion->leg[i].piece);
    memory_free(motion->leg);
    motion->leg = NULL;
    motion->legs = 0;
}

double otg_motion_seconds(const struct otg_motion *motion)
{
    return motion->leg[motion->legs - 1].end_s;
}

/* What would be planned is not what the row says. */
static bool is_lost(struct otg_motion *motion, const struct otg_scaled scaled[])
{
    for (int i = 0; i < motion->legs; i++)
        if (scaled[i].lost < OTG_VALUES) {
            motion->failed = i;
            motion->lost = (enum otg_value)scaled[i].lost;
            motion->fault.axis = scaled[i].lost_axis;
            return true;
        }
    return false;
}

void otg_motion_make(struct otg_motion *motion)
{
    struct otg_scaled *scaled =
        memory_new((size_t)motion->legs, sizeof *scaled);
    struct otg_row *row = memory_new((size_t)motion->legs, sizeof *row);
    for (int i = 0; i < motion->legs; i++)
        row[i] = motion->leg[i].row;
    otg_rows_scale(motion->header, row, motion->legs, scaled);
    memory_free(row);
    motion->lost = OTG_VALUES;
    if (motion->header->table == OTG_TABLE_THROUGH)
        motion->err = make_through(motion, scaled);
    else if (motion->header->table == OTG_TABLE_REPLAN)
        motion->err = make_replan(motion, scaled);
    else
        motion->err = make_one(motion, scaled);
    if (is_lost(motion, scaled))
        motion->err = MOTION_E_RANGE;
    memory_free(scaled);
}

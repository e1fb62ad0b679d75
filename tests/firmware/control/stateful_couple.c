/* tests/firmware/control/stateful_couple.c - gears and cams between the axes of an
 * episode: engaged at rest and onto a master that moves, by ratios from a thousandth to
 * a thousand, let go; jogs that take followers along, and moves with tracks of their
 * own, which are on the curve, or are not.
 *
 * While an axis is coupled it is where its curve over its master's set point is, in
 * every tick, to rounding, and but for how far beside it stood when that began to move. */
#include <math.h>

#include "motion/core/err.h"
#include "motion/curve/time_warp.h"
#include "tests/firmware/control/stateful.h"

/* From its curve at rest: the window that couple.h states. */
#define AWAY       0x1p-20
#define AWAY_SHARE 0x1p-30
/* What a curve is read to. */
#define READ 0x1p-31

#define KNOTS_MIN 3
#define KNOTS_MAX 8

/* A curve through places of the follower at places of the master. */
struct curve {
    int knots;
    double at[KNOTS_MAX];    /* of the master, from low on */
    double place[KNOTS_MAX]; /* of the follower */
    double slope[KNOTS_MAX];
    bool is_line;
};

static double between(double value, double low, double high)
{
    return fmin(fmax(value, low), high);
}

static double unit_ns_q12(const struct stateful_coupling *coupling)
{
    return ldexp((double)MOTION_FIXED_S_Q12, -coupling->cam.shift);
}

/* One unit of the master is so long. */
static int curve_make(const struct curve *curve, double unit,
                      struct motion_track *track, struct motion_segment *to)
{
    int err = MOTION_OK;
    motion_track_init(track, to, STATEFUL_CURVE_SEGMENTS,
                      stateful_q32(curve->place[0]));
    for (int k = 1; k < curve->knots && err == MOTION_OK; k++) {
        const int64_t dur = llround((curve->at[k] - curve->at[k - 1]) * unit);
        const double per_s = (double)MOTION_FIXED_S_Q12 / unit;
        const struct motion_state from = {
            .vel_q32 = stateful_q32(curve->slope[k - 1] * per_s),
        };
        const struct motion_state end = {
            .pos_q32 = stateful_q32(curve->place[k]),
            .vel_q32 = stateful_q32(curve->slope[k] * per_s),
        };
        err = curve->is_line
                  ? motion_track_append_line(track, dur, end.pos_q32)
                  : motion_track_append_quintic(track, dur, &from, &end);
    }
    return err;
}

/* --- drawing them ------------------------------------------------------------- */

static double place_of(const struct stateful *bench, unsigned i)
{
    return stateful_unit(bench->controller.axis[i].target.pos_q32);
}

struct reach {
    double low, high;
};

static struct reach reach_of(const struct stateful *bench, unsigned i)
{
    const struct controller_axis_config *config = &bench->axis_config[i];
    return (struct reach){ stateful_unit(config->pos_min_q32),
                           stateful_unit(config->pos_max_q32) };
}

static double draw_ratio(struct stateful *bench, unsigned axis, unsigned master)
{
    const struct controller_axis_config *config = bench->axis_config;
    /* half of them such that a move of both fits their limits */
    const double ratio = stateful_one_in(bench, 2)
                             ? stateful_between(bench, 0.05, 1) *
                                   (double)config[axis].limit.vel_q32 /
                                   (double)config[master].limit.vel_q32
                             : pow(10, stateful_between(bench, -3, 3)) *
                                   bench->axis[axis].scale /
                                   bench->axis[master].scale;
    return stateful_one_in(bench, 2) ? ratio : -ratio;
}

/* As far both ways as both ranges leave, or a part of that. */
static bool draw_line(struct stateful *bench, unsigned axis, unsigned master,
                      struct curve *curve, double *low)
{
    const struct reach own = reach_of(bench, axis);
    const struct reach his = reach_of(bench, master);
    const double ratio = draw_ratio(bench, axis, master);
    const double f = place_of(bench, axis), m = place_of(bench, master);
    const double up = ratio > 0 ? own.high - f : f - own.low;
    const double down = ratio > 0 ? f - own.low : own.high - f;
    const double ahead =
        fmin(his.high - m, up / fabs(ratio)) * stateful_between(bench, 0.3, 1);
    const double behind =
        fmin(m - his.low, down / fabs(ratio)) * stateful_between(bench, 0.3, 1);
    *curve = (struct curve){
        .knots = 2,
        .at = { 0, behind + ahead },
        .place = { f - ratio * behind, f + ratio * ahead },
        .is_line = true,
    };
    *low = m - behind;
    return ahead >= 0 && behind >= 0 &&
           behind + ahead > 1e-3 * bench->axis[master].scale;
}

/* Through where both are now. */
static bool draw_curve(struct stateful *bench, unsigned axis, unsigned master,
                       struct curve *curve, double *low)
{
    const struct reach own = reach_of(bench, axis);
    const struct reach his = reach_of(bench, master);
    const double f = place_of(bench, axis), m = place_of(bench, master);
    const double every =
        (his.high - his.low) * stateful_between(bench, 0.02, 0.2);
    const double wide =
        (own.high - own.low) * stateful_between(bench, 0.01, 0.3);
    const int here = (int)stateful_in(bench, 0, KNOTS_MIN - 1);
    *curve = (struct curve){
        .knots = (int)stateful_in(bench, KNOTS_MIN, KNOTS_MAX),
    };
    for (int k = 0; k < curve->knots; k++) {
        curve->at[k] = k * every;
        curve->place[k] = f;
        if (k == here)
            continue;
        curve->place[k] = between(f + stateful_between(bench, -wide, wide),
                                  own.low, own.high);
        curve->slope[k] = stateful_between(bench, -0.5, 0.5) * wide / every;
    }
    curve->slope[here] = stateful_between(bench, -0.5, 0.5) * wide / every;
    *low = m - here * every;
    return f >= own.low && f <= own.high;
}

/* Onto a master that moves: a little further on, as it goes. */
static bool draw_gear(struct stateful *bench, unsigned axis, unsigned master,
                      struct controller_gear *gear)
{
    const struct reach his = reach_of(bench, master);
    const double m = place_of(bench, master);
    const double vel = stateful_vel(bench, master);
    const double way = (his.high - his.low) * stateful_between(bench, 0, 0.2);
    const double begin = m + (vel < 0 ? -way : way);
    const double over =
        (his.high - his.low) * stateful_between(bench, 0.01, 0.3);
    *gear = (struct controller_gear){
        .ratio_q32 = stateful_q32(draw_ratio(bench, axis, master)),
        .place_q32 = bench->controller.axis[axis].target.pos_q32,
        .begin_q32 = stateful_q32(begin),
        .over_q32 = stateful_q32(over),
        .low_q32 = stateful_q32(his.low),
        .high_q32 = stateful_q32(his.high),
        .is_backwards = vel < 0,
    };
    return vel != 0 && stateful_one_in(bench, 4);
}

/* Not quite where the follower stands, now and then. */
static void draw_off(struct stateful *bench, unsigned axis, struct curve *curve)
{
    const double t = (double)bench->period_ns / 1e9;
    const double most =
        (double)bench->axis_config[axis].stop.acc_q32 / 0x1p32 * t * t / 4;
    const double off = most * stateful_between(bench, -1.2, 1.2);
    if (!stateful_one_in(bench, 4))
        return;
    for (int k = 0; k < curve->knots; k++)
        curve->place[k] += off;
}

static bool coupling_draw(struct stateful *bench, unsigned axis,
                          unsigned master)
{
    struct stateful_coupling *own = &bench->coupling[axis];
    struct controller_gear gear;
    struct curve curve;
    double low;
    *own = (struct stateful_coupling){ .cam.track = &own->track };
    own->track.segment = own->segment;
    own->track.capacity = STATEFUL_CURVE_SEGMENTS;
    if (bench->controller.state == CONTROLLER_MOVING) {
        if (!draw_gear(bench, axis, master, &gear) ||
            controller_gear_cam(&gear, &own->track, &own->cam) < 0)
            return false;
        own->cam.master = master;
        own->has_time = false;
        return true;
    }
    if (!(stateful_one_in(bench, 2)
              ? draw_line(bench, axis, master, &curve, &low)
              : draw_curve(bench, axis, master, &curve, &low)))
        return false;
    draw_off(bench, axis, &curve);
    own->cam.master = master;
    own->cam.low_q32 = stateful_q32(low);
    own->cam.high_q32 =
        own->cam.low_q32 + stateful_q32(curve.at[curve.knots - 1]);
    own->cam.shift = controller_cam_shift(own->cam.low_q32, own->cam.high_q32);
    own->has_time = curve_make(&curve, (double)MOTION_FIXED_S_Q12 / 1000,
                               &own->by_ms, own->by_ms_segment) == MOTION_OK;
    return curve_make(&curve, unit_ns_q12(own), &own->track, own->segment) ==
               MOTION_OK &&
           controller_cam_init(&own->cam) == MOTION_OK;
}

static bool is_master(const struct stateful *bench, unsigned i)
{
    for (unsigned k = 0; k < bench->axes; k++)
        if (bench->coupling[k].is_on && bench->coupling[k].cam.master == i)
            return true;
    return false;
}

/* One that can be, as a rule: it goes by set points, and is not the other already. */
static unsigned draw_either(struct stateful *bench, bool follows)
{
    unsigned axis = 0;
    for (int n = 0; n < 8; n++) {
        axis = (unsigned)stateful_in(bench, 0, bench->axes - 1);
        if (bench->axis[axis].board == NULL &&
            !bench->axis_config[axis].by_goals &&
            bench->controller.axis[axis].homed &&
            !(follows ? is_master(bench, axis) : bench->coupling[axis].is_on))
            return axis;
    }
    return axis;
}

void stateful_draw_couple(struct stateful *bench)
{
    const unsigned axis = draw_either(bench, true);
    const bool jogs = bench->controller.state == CONTROLLER_MOVING &&
                      bench->judge.motion == STATEFUL_JOG;
    const unsigned master =
        jogs ? bench->judge.jog_axis : draw_either(bench, false);
    if (bench->coupling[axis].is_on) {
        if (stateful_one_in(bench, 6))
            (void)stateful_uncouple(bench, axis);
        return;
    }
    if (axis != master && coupling_draw(bench, axis, master))
        (void)stateful_couple(bench, axis);
}

/* --- moves with coupled axes ---------------------------------------------------- */

bool stateful_any_coupled(const struct stateful *bench)
{
    for (unsigned i = 0; i < bench->axes; i++)
        if (bench->coupling[i].is_on)
            return true;
    return false;
}

/* The master's track with its places as times of the curve, and the curve over it. */
static bool track_on_curve(struct stateful *bench, unsigned i)
{
    const struct stateful_coupling *own = &bench->coupling[i];
    const unsigned spare = bench->spare;
    const struct motion_track *master = &bench->track[spare][own->cam.master];
    static struct motion_segment segment[STATEFUL_SEGMENTS];
    struct motion_track time = *master;
    struct motion_track *track = &bench->track[spare][i];
    struct motion_state start;
    /* a step of acceleration is none of the follower's */
    if (!own->has_time ||
        (bench->axis_config[i].limit.jerk_q32 != 0 &&
         bench->axis_config[own->cam.master].limit.jerk_q32 == 0))
        return false;
    time.segment = segment;
    time.end.pos_q32 -= own->cam.low_q32;
    for (uint32_t k = 0; k < master->count; k++) {
        segment[k] = master->segment[k];
        segment[k].pos_q32 -= own->cam.low_q32;
    }
    motion_time_warp_state(&own->by_ms, &time, 0, &start);
    motion_track_init(track, bench->storage[spare][i], STATEFUL_SEGMENTS,
                      start.pos_q32);
    return motion_time_warp_append(track, &own->by_ms, &time, NULL) ==
           MOTION_OK;
}

/* Stands in one piece, as long as the master's: it is on the curve at both ends of that
 * where the master comes back. */
static bool track_that_stands(struct stateful *bench, unsigned i)
{
    const struct stateful_coupling *own = &bench->coupling[i];
    const struct motion_track *master =
        &bench->track[bench->spare][own->cam.master];
    struct motion_track *track = &bench->track[bench->spare][i];
    motion_track_init(track, bench->storage[bench->spare][i], STATEFUL_SEGMENTS,
                      bench->controller.axis[i].target.pos_q32);
    return master->end_ns_q12 > 0 &&
           motion_track_append_dwell(track, master->end_ns_q12) == MOTION_OK;
}

/* A follower alone is refused: mostly its master is meant. */
uint32_t stateful_coupled_axes(struct stateful *bench, uint32_t axes)
{
    for (unsigned i = 0; i < bench->axes; i++) {
        const uint32_t own = (uint32_t)1 << i;
        if (bench->coupling[i].is_on && (axes & own) != 0 &&
            !stateful_one_in(bench, 8))
            axes |= (uint32_t)1 << bench->coupling[i].cam.master;
    }
    return axes;
}

/* On its master's, beside it, alone: what does not agree is refused.  Without one of its
 * own it is taken along. */
uint32_t stateful_coupled_tracks(struct stateful *bench, uint32_t axes)
{
    for (unsigned i = 0; i < bench->axes; i++) {
        const uint32_t own = (uint32_t)1 << i;
        const uint32_t both = own | (uint32_t)1
                                        << bench->coupling[i].cam.master;
        if (!bench->coupling[i].is_on || (axes & both) == 0)
            continue;
        if (stateful_one_in(bench, 8))
            axes &= ~both;
        if ((axes & both) == 0 || (axes & both) == own)
            continue;
        axes &= ~own;
        if (!stateful_one_in(bench, 3) &&
            (stateful_one_in(bench, 4) ? track_that_stands(bench, i)
                                       : track_on_curve(bench, i)))
            axes |= own;
    }
    return axes;
}

/* Out and back, so that a follower that stands is where it was at both ends. */
void stateful_come_back(struct stateful *bench, unsigned i)
{
    struct motion_track *track = &bench->track[bench->spare][i];
    const struct motion_state rest = { .pos_q32 = 0 };
    const struct motion_state start = {
        .pos_q32 = bench->controller.axis[i].target.pos_q32
    };
    if (is_master(bench, i) && track->end_ns_q12 > 0 &&
        stateful_one_in(bench, 4))
        (void)motion_track_append_quintic(track, 2 * track->end_ns_q12, &rest,
                                          &start);
}

/* --- the judge -------------------------------------------------------------------- */

static int64_t told_q32(const struct stateful *bench, unsigned i)
{
    return bench->judge.past[i].pos_q32[0] +
           bench->controller.axis[i].offset_q32;
}

/* From its curve, over what its master was told. */
static double off_curve(const struct stateful *bench, unsigned i)
{
    const struct stateful_coupling *own = &bench->coupling[i];
    const double along =
        stateful_unit(told_q32(bench, own->cam.master) - own->cam.low_q32);
    struct motion_cursor cursor = { 0 };
    struct motion_sample curve;
    motion_track_sample(&own->track, &cursor,
                        llround(fmax(along, 0) * unit_ns_q12(own)), &curve);
    return stateful_unit(told_q32(bench, i) - curve.pos_q32);
}

static double extent(const struct motion_track *track)
{
    struct motion_extreme pos;
    motion_track_extreme(track, MOTION_POS, &pos);
    return stateful_unit(pos.max - pos.min);
}

void stateful_engaged(struct stateful *bench, unsigned i)
{
    bench->coupling[i].is_on = true;
    bench->coupling[i].stood = off_curve(bench, i);
}

/* Until it moves it stands where it was engaged, or was led beside it. */
static void judge_follower(struct stateful *bench, unsigned i)
{
    struct stateful_coupling *own = &bench->coupling[i];
    const bool moves = stateful_in_motion(bench->judge.before);
    const double off = off_curve(bench, i);
    const double most = moves ? 2 * stateful_rounding(bench, i) + READ
                              : AWAY + AWAY_SHARE * extent(&own->track);
    if (!moves)
        own->stood = off;
    if (fabs(moves ? off - own->stood : off) > most)
        stateful_violate(bench, STATEFUL_CURVE, (int)i,
                         "%.9f off, %.9f at rest, its master at %.9f", off,
                         own->stood,
                         stateful_unit(told_q32(bench, own->cam.master)));
}

void stateful_judge_coupled(struct stateful *bench)
{
    const enum controller_state state = bench->controller.state;
    for (unsigned i = 0; i < bench->axes; i++) {
        struct stateful_coupling *own = &bench->coupling[i];
        if (state == CONTROLLER_OFF || state == CONTROLLER_FAULT)
            own->is_on = false;
        if (!own->is_on)
            continue;
        bench->tally.coupled++;
        if (bench->judge.past[i].count > 0 &&
            bench->judge.past[own->cam.master].count > 0)
            judge_follower(bench, i);
    }
}

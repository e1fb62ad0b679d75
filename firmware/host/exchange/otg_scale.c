/* firmware/host/exchange/otg_scale.c - a row in the planner's formats, see
 * otg_rows.h. */
#include <limits.h>
#include <math.h>
#include <string.h>

#include "motion/double/double_math.h"

#include "firmware/host/exchange/otg_rows.h"

/* Powers of length and time in each value's unit. */
static const struct {
    int length, time;
} otg_unit[OTG_VALUES] = {
    { 1, 0 },  { 1, -1 }, { 1, -2 }, { 1, 0 },  { 1, -1 }, { 1, -2 },
    { 1, -1 }, { 1, -1 }, { 1, -2 }, { 1, -2 }, { 1, -3 }, { 1, -3 },
};

static int power_of(double x)
{
    int e;
    frexp(x, &e);
    return x == 0 ? -4000 : e; /* |x| < 2^e */
}

static double larger(double a, double b)
{
    return a > b ? a : b;
}

static double smaller(double a, double b)
{
    return a < b ? a : b;
}

/* The lower of both. */
static double jerk_of(const double *v)
{
    return v[OTG_JDOWN] > 0 ? smaller(v[OTG_JMAX], v[OTG_JDOWN]) : v[OTG_JMAX];
}

/* The speed gained while the acceleration a is let go; 0 without a limit of
 * jerk. */
static double speed_of(double a, double jerk)
{
    return jerk > 0 ? a * fabs(a) / (2 * jerk) : 0;
}

/* About the time a change of speed takes; 0 where a limit is missing. */
static double change_time(const double *v, double change)
{
    double acc = change > 0 ? v[OTG_AMAX] : -v[OTG_AMIN];
    double t = acc > 0 ? fabs(change) / acc : 0;
    return jerk_of(v) > 0 ? larger(t, sqrt(fabs(change) / jerk_of(v))) : t;
}

/* About the time a displacement takes from rest to rest. */
static double distance_time(const double *v, double distance)
{
    double vel = distance > 0 ? v[OTG_VMAX] : -v[OTG_VMIN];
    double acc = larger(v[OTG_AMAX], -v[OTG_AMIN]);
    double t = vel > 0 ? fabs(distance) / vel : 0;
    if (acc > 0)
        t = larger(t, sqrt(fabs(distance) / acc));
    return jerk_of(v) > 0 ? larger(t, double_cbrt(fabs(distance) / jerk_of(v)))
                          : t;
}

/* About the time the move takes, within a few powers of two: ends with an
 * acceleration let go of it, stop and start again, and what they run too far
 * on the way is made good. */
static double row_time(const double *v, bool velocity)
{
    double from = v[OTG_V0] + speed_of(v[OTG_A0], jerk_of(v));
    double to = v[OTG_VF] - speed_of(v[OTG_AF], jerk_of(v));
    double a = larger(fabs(v[OTG_A0]), fabs(v[OTG_AF]));
    double ramp = jerk_of(v) > 0 ? a / jerk_of(v) : 0;
    if (velocity)
        return larger(ramp, change_time(v, to - from));
    double stop = larger(ramp, change_time(v, -from));
    double start = larger(ramp, change_time(v, to));
    double distance = v[OTG_PF] - v[OTG_P0] - from * stop - to * start;
    return larger(larger(stop, start), distance_time(v, distance));
}

/* The speed that start, goal and mean speed need; 0: the axis stands. */
static double row_need(const double *v, bool velocity, double t)
{
    double speed = fabs(speed_of(v[OTG_A0], jerk_of(v))) +
                   fabs(speed_of(v[OTG_AF], jerk_of(v)));
    if (velocity)
        return speed + fabs(v[OTG_VF] - v[OTG_V0]);
    if (t > 0)
        speed += fabs(v[OTG_PF] - v[OTG_P0]) / t;
    return speed + fabs(v[OTG_V0]) + fabs(v[OTG_VF]);
}

/* An axis that stands keeps any limits. */
static void row_stands(double *v)
{
    for (int i = OTG_VMAX; i < OTG_VALUES; i++)
        if (v[i] != 0)
            v[i] = copysign(1, v[i]);
}

/* A limit so high that the move cannot come near it would leave the formats no
 * room for the move.  Speed is capped at 2^10 of what is needed; acceleration
 * and jerk where that is reached in 2^-25 of the time or less. */
static void row_cap(double *v, bool velocity)
{
    double t = row_time(v, velocity);
    double speed = row_need(v, velocity, t);
    if (speed <= 0 || t <= 0) {
        row_stands(v);
        return;
    }
    double ends = 2 * larger(fabs(v[OTG_A0]), fabs(v[OTG_AF]));
    double vel = ldexp(speed, 10), acc = ldexp(speed / t, 30);
    double jerk = ldexp(speed / t / t, 50);
    v[OTG_VMAX] = smaller(v[OTG_VMAX], vel);
    v[OTG_VMIN] = larger(v[OTG_VMIN], -vel);
    v[OTG_AMAX] = smaller(v[OTG_AMAX], larger(acc, ends));
    v[OTG_AMIN] = larger(v[OTG_AMIN], -larger(acc, ends));
    v[OTG_JMAX] = smaller(v[OTG_JMAX], jerk);
    v[OTG_JDOWN] = smaller(v[OTG_JDOWN], jerk);
}

/* The fastest the row speaks of, or comes to where its accelerations are let
 * go. */
static double row_speed(const double *v, bool velocity)
{
    double speed = larger(fabs(v[OTG_V0]), fabs(v[OTG_VF])) +
                   fabs(speed_of(v[OTG_A0], jerk_of(v))) +
                   fabs(speed_of(v[OTG_AF], jerk_of(v)));
    if (!velocity)
        speed = larger(speed, larger(v[OTG_VMAX], -v[OTG_VMIN]));
    return speed;
}

/* The time exponent with which velocity and jerk fill their formats alike, and
 * so acceleration its own: the ramps, sqrt(v / j), last 1 then.  The whole must
 * last from 1/2 to 2^14. */
static int row_ramp_time(const double *v, bool velocity, int whole)
{
    int time = whole;
    double speed = row_speed(v, velocity);
    if (v[OTG_JMAX] > 0 && speed > 0) {
        int ramp = power_of(speed) - power_of(v[OTG_JMAX]);
        ramp = ramp >= 0 ? ramp / 2 : -((1 - ramp) / 2);
        time = ramp < time ? ramp : time;
    }
    return time > whole - 14 ? time : whole - 14;
}

/* Smallest length exponent with which every value is below 2^29.  Positions are
 * counted from p0; a velocity goal ends where it does, within speed times
 * time. */
static int row_length(const double *v, bool velocity, int whole, int time)
{
    int length = power_of(row_speed(v, velocity)) + whole + 1 - 29;
    if (!velocity)
        length = -3000;
    for (int i = 0; i < OTG_VALUES; i++) {
        int need = power_of(v[i]) - otg_unit[i].time * time - 29;
        if (need > length)
            length = need;
    }
    return length;
}

/* A displacement to nearest; everything else towards zero, so that no limit grows and
 * what is on a limit stays on it. */
static int64_t fixed(double x, int value, int length, int time)
{
    int shift = 32 - length - otg_unit[value].time * time;
    double scaled = ldexp(x, shift);
    return otg_unit[value].time == 0 ? (int64_t)llround(scaled)
                                     : (int64_t)trunc(scaled);
}

/* A displacement, or a limit, that there is has to be there in the formats too. */
static int value_lost(const double v[OTG_VALUES], const int64_t x[OTG_VALUES],
                      bool velocity)
{
    for (int i = 0; i < OTG_VALUES; i++) {
        bool limit = i >= OTG_VMAX && (!velocity || i >= OTG_AMAX);
        bool distance = i == OTG_PF && !velocity;
        if ((limit || distance) && v[i] != 0 && x[i] == 0)
            return i;
    }
    return OTG_VALUES;
}

/* Rows that share their formats. */
struct rows {
    const struct otg_row *row;
    int count, axes;
    bool velocity;
    int whole, time;
};

/* An axis of row i in its own place and with limits that matter; a change of
 * velocity as what it is seen by who moves along.  Rows of one motion are
 * counted from its start and keep their limits: how fast they begin is not
 * known here. */
static void rows_axis(const struct rows *rows, int i, int axis,
                      double v[OTG_VALUES])
{
    const double from = rows->row[0].value[axis][OTG_P0];
    memcpy(v, rows->row[i].value[axis], OTG_VALUES * sizeof *v);
    for (int k = 0; k < OTG_VALUES; k++)
        v[k] = isnan(v[k]) ? 0 : v[k];
    v[OTG_PF] -= from;
    v[OTG_P0] = i > 0 ? rows->row[i - 1].value[axis][OTG_PF] - from : 0;
    if (rows->velocity) {
        v[OTG_VF] -= v[OTG_V0];
        v[OTG_V0] = 0;
    }
    if (rows->count == 1)
        row_cap(v, rows->velocity);
}

/* The exponent of time, for all of them. */
static void rows_time(struct rows *rows)
{
    double v[OTG_VALUES], t = 0;
    for (int i = 0; i < rows->count; i++)
        for (int k = 0; k < rows->axes; k++) {
            rows_axis(rows, i, k, v);
            t = larger(
                t, larger(rows->row[i].wanted_s, row_time(v, rows->velocity)));
        }
    rows->time = rows->whole = t > 0 ? power_of(t) : 0;
    for (int i = 0; i < rows->count; i++)
        for (int k = 0; k < rows->axes; k++) {
            rows_axis(rows, i, k, v);
            int own = row_ramp_time(v, rows->velocity, rows->whole);
            rows->time = own < rows->time ? own : rows->time;
        }
}

/* Of an axis; one that may begin at any speed ends, like a velocity goal,
 * within speed times time. */
static int rows_length(const struct rows *rows, int axis)
{
    double v[OTG_VALUES];
    int length = INT_MIN;
    for (int i = 0; i < rows->count; i++) {
        rows_axis(rows, i, axis, v);
        int own = row_length(v, rows->velocity, rows->whole, rows->time);
        int far = power_of(row_speed(v, rows->velocity)) + rows->whole + 1 - 29;
        own = rows->count > 1 && far > own ? far : own;
        length = own > length ? own : length;
    }
    return length;
}

static struct motion_otg_move move_of(const int64_t x[OTG_VALUES],
                                      bool velocity)
{
    return (struct motion_otg_move){
        .start = { x[OTG_P0], x[OTG_V0], x[OTG_A0], 0 },
        .goal = { x[OTG_PF], x[OTG_VF], x[OTG_AF], 0 },
        .limit = { .vel_max_q32 = x[OTG_VMAX],
                   .vel_min_q32 = x[OTG_VMIN],
                   .acc_max_q32 = x[OTG_AMAX],
                   .acc_min_q32 = x[OTG_AMIN],
                   .jerk_q32 = x[OTG_JMAX],
                   .jerk_down_q32 = x[OTG_JDOWN] },
        .mode = velocity ? MOTION_OTG_VELOCITY : MOTION_OTG_POSITION,
    };
}

static void rows_scaled(const struct rows *rows, int i, int axis, int length,
                        struct otg_scaled *scaled)
{
    double v[OTG_VALUES];
    int64_t x[OTG_VALUES];
    rows_axis(rows, i, axis, v);
    for (int k = 0; k < OTG_VALUES; k++)
        x[k] = fixed(v[k], k, length, rows->time);
    scaled->length[axis] = length;
    scaled->move[axis] = move_of(x, rows->velocity);
    scaled->move[axis].dur_ns_q12 = llroundl(
        ldexpl(rows->row[i].wanted_s, -rows->time) * OTG_TICKS_PER_SECOND);
    if (scaled->lost == OTG_VALUES) {
        scaled->lost = value_lost(v, x, rows->velocity);
        scaled->lost_axis = axis;
    }
}

void otg_rows_scale(const struct otg_header *header, const struct otg_row *row,
                    int count, struct otg_scaled *scaled)
{
    struct rows rows = {
        .row = row,
        .count = count,
        .axes = header->axes,
        .velocity = header->velocity,
    };
    rows_time(&rows);
    for (int i = 0; i < count; i++) {
        memset(&scaled[i], 0, sizeof scaled[i]);
        scaled[i].time = rows.time;
        scaled[i].lost = OTG_VALUES;
    }
    for (int axis = 0; axis < header->axes; axis++) {
        const int length = rows_length(&rows, axis);
        for (int i = 0; i < count; i++)
            rows_scaled(&rows, i, axis, length, &scaled[i]);
    }
}

/* firmware/linux/exchange/otg_rows.c - see otg_rows.h. */
#include "firmware/linux/exchange/otg_rows.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const otg_names[OTG_VALUES] = {
    "p0", "v0", "a0", "pf", "vf", "af", "vmax", "vmin", "amax", "amin", "jmax",
};

/* Powers of length and time in each value's unit. */
static const struct {
    int length, time;
} otg_unit[OTG_VALUES] = {
    { 1, 0 },  { 1, -1 }, { 1, -2 }, { 1, 0 },  { 1, -1 }, { 1, -2 },
    { 1, -1 }, { 1, -1 }, { 1, -2 }, { 1, -2 }, { 1, -3 },
};

/* --- header --------------------------------------------------------------- */

static size_t field_length(const char *field)
{
    return strcspn(field, ",\r\n");
}

static bool is_name(const char *field, size_t length, const char *name)
{
    return strlen(name) == length && memcmp(field, name, length) == 0;
}

#define AXIS_NOT_OURS (-1)
#define AXIS_TOO_MANY (-2)

/* "_3" is axis 2. */
static short header_axis(const char *field, size_t length)
{
    char *end;
    if (length == 0)
        return 0;
    long number = strtol(field + 1, &end, 10);
    if (end != field + length || field[1] < '1' || field[1] > '9')
        return AXIS_NOT_OURS;
    return number > MOTION_SYNC_AXES ? AXIS_TOO_MANY : (short)(number - 1);
}

/* "v0" or "v0_3". */
static void header_column(const char *field, size_t length, short *axis,
                          short *value)
{
    size_t stem = 0;
    while (length > 0 && *field == ' ') {
        field++;
        length--;
    }
    while (length > 0 && field[length - 1] == ' ')
        length--;
    while (stem < length && field[stem] != '_')
        stem++;
    *axis = AXIS_NOT_OURS;
    if (is_name(field, length, "duration"))
        *value = OTG_VALUE_DURATION;
    else if (is_name(field, length, "category"))
        *value = OTG_VALUE_CATEGORY;
    else
        for (int i = 0; i < OTG_VALUES; i++)
            if (is_name(field, stem, otg_names[i])) {
                *axis = header_axis(field + stem, length - stem);
                *value = (short)i;
            }
}

static const char *header_wrong(struct otg_header *header, const char *what,
                                int axis, int value)
{
    char number[16] = "";
    if (axis > 0 || header->axes > 1)
        snprintf(number, sizeof number, "_%d", axis + 1);
    snprintf(header->wrong, sizeof header->wrong, "column %s%s %s",
             otg_names[value], number, what);
    return header->wrong;
}

/* A velocity goal has no positions. */
static const char *header_missing(struct otg_header *header,
                                  const unsigned has[MOTION_SYNC_AXES])
{
    const unsigned position = 1u << OTG_P0 | 1u << OTG_PF;
    const unsigned limits = 1u << OTG_VMAX | 1u << OTG_VMIN;
    if (header->axes == 0)
        return "expected a header line with the columns p0,v0,a0,pf,vf,af,"
               "vmax,vmin,amax,amin,jmax";
    header->velocity = header->axes == 1 && !(has[0] & position);
    for (int i = 0; i < header->axes; i++)
        for (int k = 0; k < OTG_VALUES; k++) {
            bool needed = !header->velocity || !((position | limits) & 1u << k);
            if (needed && !(has[i] & 1u << k))
                return header_wrong(header, "is missing", i, k);
        }
    return NULL;
}

static const char *header_add(struct otg_header *header, const char *field,
                              size_t length, unsigned has[MOTION_SYNC_AXES])
{
    short axis, value = -1;
    if (header->columns == OTG_COLUMNS_MAX)
        return "too many columns: expected 512 at most";
    header_column(field, length, &axis, &value);
    header->column[header->columns].axis = axis;
    header->column[header->columns].value = value;
    header->columns++;
    if (axis == AXIS_TOO_MANY)
        return "too many axes: expected 16 at most";
    if (axis < 0)
        return NULL;
    if (has[axis] & 1u << value)
        return header_wrong(header, "is there twice", axis, value);
    has[axis] |= 1u << value;
    if (axis + 1 > header->axes)
        header->axes = axis + 1;
    return NULL;
}

const char *otg_header_parse(const char *line, struct otg_header *header)
{
    unsigned has[MOTION_SYNC_AXES] = { 0 };
    const char *wrong = NULL;
    memset(header, 0, sizeof *header);
    if (strncmp(line, "\xef\xbb\xbf", 3) == 0)
        line += 3; /* what some spreadsheets put first */
    while (wrong == NULL) {
        size_t length = field_length(line);
        wrong = header_add(header, line, length, has);
        line += length;
        if (*line++ != ',')
            break;
    }
    return wrong != NULL ? wrong : header_missing(header, has);
}

/* --- rows ----------------------------------------------------------------- */

const char *otg_name(int value)
{
    return otg_names[value];
}

bool otg_number(const char *text, size_t length, double *number)
{
    char *end;
    while (length > 0 && text[length - 1] == ' ')
        length--;
    *number = strtod(text, &end);
    return length > 0 && end == text + length && isfinite(*number) &&
           (*number == 0 || (fabs(*number) > 1e-60 && fabs(*number) < 1e60));
}

static bool row_field(const struct otg_header *header, int i, const char *field,
                      size_t length, struct otg_row *row)
{
    int axis = header->column[i].axis, value = header->column[i].value;
    if (axis >= 0)
        return otg_number(field, length, &row->value[axis][value]);
    if (value == OTG_VALUE_DURATION)
        return length == 0 || otg_number(field, length, &row->duration);
    if (value == OTG_VALUE_CATEGORY && length < sizeof row->category)
        memcpy(row->category, field, length);
    return true;
}

static const char *row_wrong(struct otg_header *header, int i)
{
    static const char what[] =
        "expected a finite number, 0 or from 1e-60 to 1e60";
    int axis = header->column[i].axis, value = header->column[i].value;
    if (axis < 0)
        snprintf(header->wrong, sizeof header->wrong, "duration: %s", what);
    else if (header->axes > 1)
        snprintf(header->wrong, sizeof header->wrong, "%s_%d: %s",
                 otg_names[value], axis + 1, what);
    else
        snprintf(header->wrong, sizeof header->wrong, "%s: %s",
                 otg_names[value], what);
    return header->wrong;
}

const char *otg_row_parse(struct otg_header *header, const char *line,
                          struct otg_row *row, int *column)
{
    const char *field = line;
    memset(row, 0, sizeof *row);
    row->duration = (double)NAN;
    for (int i = 0; i < header->columns; i++) {
        size_t length = field_length(field);
        *column = (int)(field - line) + 1;
        if (!row_field(header, i, field, length, row))
            return row_wrong(header, i);
        field += length;
        *column = (int)(field - line) + 1;
        if (i + 1 < header->columns && *field != ',')
            return "the row ends here: expected as many fields as the header "
                   "has";
        field += *field == ',' && i + 1 < header->columns;
    }
    return *field == ',' ? "another field: expected as many as the header has"
                         : NULL;
}

/* --- scale ---------------------------------------------------------------- */

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
    return v[OTG_JMAX] > 0 ? larger(t, sqrt(fabs(change) / v[OTG_JMAX])) : t;
}

/* About the time a way takes from rest to rest. */
static double way_time(const double *v, double way)
{
    double vel = way > 0 ? v[OTG_VMAX] : -v[OTG_VMIN];
    double acc = larger(v[OTG_AMAX], -v[OTG_AMIN]);
    double t = vel > 0 ? fabs(way) / vel : 0;
    if (acc > 0)
        t = larger(t, sqrt(fabs(way) / acc));
    return v[OTG_JMAX] > 0 ? larger(t, cbrt(fabs(way) / v[OTG_JMAX])) : t;
}

/* About the time the move takes, within a few powers of two: ends with an
 * acceleration let go of it, stop and start again, and what they run too far
 * on the way is made good. */
static double row_time(const double *v, bool velocity)
{
    double from = v[OTG_V0] + speed_of(v[OTG_A0], v[OTG_JMAX]);
    double to = v[OTG_VF] - speed_of(v[OTG_AF], v[OTG_JMAX]);
    double a = larger(fabs(v[OTG_A0]), fabs(v[OTG_AF]));
    double ramp = v[OTG_JMAX] > 0 ? a / v[OTG_JMAX] : 0;
    if (velocity)
        return larger(ramp, change_time(v, to - from));
    double stop = larger(ramp, change_time(v, -from));
    double start = larger(ramp, change_time(v, to));
    double way = v[OTG_PF] - v[OTG_P0] - from * stop - to * start;
    return larger(larger(stop, start), way_time(v, way));
}

/* The fastest the row speaks of, or comes to where its accelerations are let
 * go. */
static double row_speed(const double *v, bool velocity)
{
    double speed = larger(fabs(v[OTG_V0]), fabs(v[OTG_VF])) +
                   fabs(speed_of(v[OTG_A0], v[OTG_JMAX])) +
                   fabs(speed_of(v[OTG_AF], v[OTG_JMAX]));
    if (!velocity)
        speed = larger(speed, larger(v[OTG_VMAX], -v[OTG_VMIN]));
    return speed;
}

/* The time exponent with which velocity and jerk fill their formats alike, and
 * so acceleration its own: the ramps, sqrt(v / j), last 2^-8 then.  The whole
 * must last from 1/2 to 2^14. */
static int row_ramp_time(const double *v, bool velocity, int whole)
{
    int time = whole;
    double speed = row_speed(v, velocity);
    if (v[OTG_JMAX] > 0 && speed > 0) {
        int ramp = power_of(speed) - power_of(v[OTG_JMAX]) + 16;
        ramp = ramp >= 0 ? ramp / 2 : -((1 - ramp) / 2);
        time = ramp < time ? ramp : time;
    }
    return time > whole - 14 ? time : whole - 14;
}

/* Smallest length exponent with which every value fits: 2^29 where 32 bits
 * are fraction, 2^45 where 16 are.  Positions are counted from p0; a velocity
 * goal ends where it does, within speed times time. */
static int row_length(const double *v, bool velocity, int whole, int time)
{
    int length = power_of(row_speed(v, velocity)) + whole + 1 - 29;
    if (!velocity)
        length = -3000;
    for (int i = 0; i < OTG_VALUES; i++) {
        int room = otg_unit[i].time >= -1 ? 29 : 45;
        int need = power_of(v[i]) - otg_unit[i].time * time - room;
        if (need > length)
            length = need;
    }
    return length;
}

/* A way to nearest; everything else towards zero, so that no limit grows and
 * what is on a limit stays on it. */
static int64_t fixed(double x, int value, int length, int time)
{
    int bits = otg_unit[value].time >= -1 ? 32 : 16;
    int shift = bits - length - otg_unit[value].time * time;
    double scaled = ldexp(x, shift);
    return otg_unit[value].time == 0 ? (int64_t)llround(scaled)
                                     : (int64_t)trunc(scaled);
}

void otg_row_scale(const struct otg_header *header, const struct otg_row *row,
                   struct otg_scaled *scaled)
{
    double t = 0;
    memset(scaled, 0, sizeof *scaled);
    for (int i = 0; i < header->axes; i++)
        t = larger(t, row_time(row->value[i], header->velocity));
    int whole = t > 0 ? power_of(t) : 0;
    int time = whole;
    for (int i = 0; i < header->axes; i++) {
        int own = row_ramp_time(row->value[i], header->velocity, whole);
        time = own < time ? own : time;
    }
    scaled->time = time;
    for (int i = 0; i < header->axes; i++) {
        double v[OTG_VALUES];
        memcpy(v, row->value[i], sizeof v);
        v[OTG_PF] -= v[OTG_P0];
        v[OTG_P0] = 0;
        int length = row_length(v, header->velocity, whole, time);
        int64_t x[OTG_VALUES];
        for (int k = 0; k < OTG_VALUES; k++)
            x[k] = fixed(v[k], k, length, time);
        scaled->length[i] = length;
        scaled->move[i] = (struct motion_otg_move){
            .start = { x[OTG_P0], x[OTG_V0], x[OTG_A0], 0 },
            .goal = { x[OTG_PF], x[OTG_VF], x[OTG_AF], 0 },
            .limit = { .vel_max_q32 = x[OTG_VMAX],
                       .vel_min_q32 = x[OTG_VMIN],
                       .acc_max_q16 = x[OTG_AMAX],
                       .acc_min_q16 = x[OTG_AMIN],
                       .jerk_q16 = x[OTG_JMAX] },
            .mode =
                header->velocity ? MOTION_OTG_VELOCITY : MOTION_OTG_POSITION,
        };
    }
}

/* --- answers -------------------------------------------------------------- */

#define OTG_TICKS_PER_SECOND 4096e9L

double otg_plan_seconds(const struct motion_otg_plan *plan, int time)
{
    return (double)ldexpl((long double)plan->dur_ns_q12 / OTG_TICKS_PER_SECOND,
                          time);
}

/* In the plan's units (otg.h); whole numbers, rounded at 2^-64. */
struct curve {
    long double t, p, v, a;
};

static struct curve plan_curve(const struct motion_otg_plan *plan, int i)
{
    struct curve c = {
        .v = ldexpl((long double)plan->start_vel_q32 * 1953125,
                    plan->acc_bits - 10),
        .a = (long double)plan->start_acc,
    };
    for (int k = 0; k < i; k++) {
        long double dt = (long double)plan->phase[k].dur_ns_q12;
        long double to = (long double)plan->phase[k].acc;
        c.p += (3 * c.v + (2 * c.a + to) * dt) * dt;
        c.v += (c.a + to) * dt;
        c.a = to;
        c.t += dt;
    }
    return c;
}

struct otg_point otg_plan_point(const struct motion_otg_plan *plan, int i,
                                int length, int time)
{
    const long double fives = 1953125;
    struct curve c = plan_curve(plan, i);
    int bits = plan->acc_bits - length;
    long double j = 0;
    if (i < plan->count)
        j = ((long double)plan->phase[i].acc - c.a) * OTG_TICKS_PER_SECOND /
            (long double)plan->phase[i].dur_ns_q12;
    return (struct otg_point){
        (double)ldexpl(c.t / OTG_TICKS_PER_SECOND, time),
        (double)ldexpl(c.p / (3 * fives * fives), -43 - bits),
        (double)ldexpl(c.v / fives, -22 - bits - time),
        (double)ldexpl(c.a, -bits - 2 * time),
        (double)ldexpl(j, -bits - 3 * time),
    };
}

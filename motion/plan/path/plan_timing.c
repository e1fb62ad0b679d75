/* motion/plan/path/plan_timing.c - see plan_timing.h. */
#include "motion/plan/path/plan_timing.h"

#include <float.h>
#include <math.h>

#include "motion/core/err.h"
#include "motion/curve/bake.h"
#include "motion/double/double_interval.h"
#include "motion/double/double_math.h"
#include "motion/plan/plan_track.h"
#include "motion/plan/topp/topp_chain.h"

/* Knots are no nearer than rounding lets them: a quintic h long at p rounds
 * 12 * 2^-59 p / h^2 of acceleration and 60 * 2^-59 p / h^3 of jerk, which is to be at
 * most a hundredth of the limits.  Nor nearer than this. */
#define TIMING_LEAST       2e-6
#define TIMING_ROUNDED_ACC (100 * 12 * 0x1p-59)
#define TIMING_ROUNDED     (100 * 60 * 0x1p-59)

/* An axis whose jerk is not limited beside one whose is: its acceleration
 * within a microsecond, which no set point sees. */
#define TIMING_AT_ONCE 1e-6

/* A path that stands or turns back within this, s, does so at once. */
#define TIMING_STANDS 1e-9

#define TIMING_BISECTIONS 60

#define TIMING_POINTS 4 /* on either side of the middle */

/* So often the tracks are baked: with twice the segments where time would be
 * stretched by more than that, at first, and then stretched by what they are
 * over their limits and so much more, for what rounding adds. */
#define TIMING_ROUNDS      10
#define TIMING_REFINED     1.0003
#define TIMING_REFINEMENTS 2
#define TIMING_STRETCHED   1e-9

static double timing_q32(int64_t value)
{
    return ldexp((double)value, -32);
}

static struct motion_real timing_real(double value)
{
    int e = 0;
    const double m = frexp(value, &e);

    return motion_real_make((int64_t)ldexp(m, 62), e - 62);
}

double plan_timing_duration(const struct plan_timing *timing)
{
    return timing->knot[timing->knots - 1];
}

/* --- solving ----------------------------------------------------------------- */

/* Limits of the axes, and whether any limits jerk. */
static bool timing_limits(unsigned axes, const struct plan_limit limit[],
                          struct plan_topp_limit out[], double jerk[])
{
    bool has_jerk = false;

    for (unsigned k = 0; k < axes; k++) {
        const double v = timing_q32(limit[k].vel_q32);
        const double a = timing_q32(limit[k].acc_q32);
        out[k] = (struct plan_topp_limit){ -v, v, -a, a };
        jerk[k] = limit[k].jerk_q32 != 0 ? timing_q32(limit[k].jerk_q32)
                                         : a / TIMING_AT_ONCE;
        has_jerk = has_jerk || limit[k].jerk_q32 != 0;
    }
    return has_jerk;
}

static double timing_least(const struct plan_topp_path *path,
                           const struct plan_topp_limit limit[],
                           const double jerk[])
{
    const size_t size = path->degree + 1;
    double least = TIMING_LEAST;

    for (uint32_t i = 0; i < path->pieces; i++)
        for (unsigned k = 0; k < path->axes; k++) {
            const double p = fabs(path->coef[(i * path->axes + k) * size]);
            least =
                fmax(least, sqrt(TIMING_ROUNDED_ACC * p / limit[k].acc_max));
            least = fmax(least, double_cbrt(TIMING_ROUNDED * p / jerk[k]));
        }
    return least;
}

/* One more knot, up to `end`, which is one in any case. */
static void timing_knot(struct plan_timing *timing, double t, double end)
{
    const double least = timing->least;

    if (t < end &&
        (t - timing->knot[timing->knots - 1] < least || end - t < least))
        return;
    if (t > timing->knot[timing->knots - 1])
        timing->knot[timing->knots++] = t;
}

/* Up to the next rest or the end. */
static double timing_rest(const struct plan_topp *topp, uint32_t i)
{
    while (i + 1 < topp->intervals && topp->x[i][2] > 0)
        i++;
    return topp->t[i + 1];
}

static int timing_topp_knots(struct plan_timing *timing)
{
    const struct plan_topp *topp = &timing->topp;
    double end = 0;

    timing->knot = plan_pool_take(&timing->pool, (size_t)topp->intervals + 2,
                                  sizeof *timing->knot);
    if (timing->knot == NULL)
        return MOTION_E_FULL;
    timing->knots = 1;
    for (uint32_t i = 0; i < topp->intervals; i++) {
        if (topp->t[i] >= end)
            end = timing_rest(topp, i);
        timing_knot(timing, topp->t[i + 1], end);
    }
    return MOTION_OK;
}

static int timing_law_knots(struct plan_timing *timing)
{
    size_t most = 0;
    double *all;

    for (uint32_t r = 0; r < timing->law.runs; r++)
        most += plan_topp_law_knots(&timing->law, r, NULL);
    all = plan_pool_take(&timing->pool, most + 1, sizeof *all);
    timing->knot =
        plan_pool_take(&timing->pool, most + 2, sizeof *timing->knot);
    if (all == NULL || timing->knot == NULL)
        return MOTION_E_FULL;
    timing->knots = 1;
    for (uint32_t r = 0; r < timing->law.runs; r++) {
        const uint32_t count = plan_topp_law_knots(&timing->law, r, all);
        for (uint32_t i = 0; i < count; i++)
            timing_knot(timing, all[i], all[count - 1]);
    }
    return MOTION_OK;
}

int plan_timing_solve(const struct motion_track *const track[], unsigned axes,
                      const struct plan_limit limit[],
                      const struct plan_topp_cap cap[], uint32_t caps,
                      const double ends[2], struct plan_timing *timing,
                      double *failed)
{
    struct plan_topp_limit bound[PLAN_TOPP_AXES_MAX] = { { 0 } };
    double jerk[PLAN_TOPP_AXES_MAX] = { 0 };
    int err;

    *timing = (struct plan_timing){ 0 };
    *failed = NAN;
    err = plan_topp_path_of(track, axes, &timing->pool, &timing->path);
    if (err < 0) {
        plan_timing_free(timing);
        return err;
    }
    timing->has_jerk = timing_limits(axes, limit, bound, jerk);
    timing->least = timing_least(&timing->path, bound, jerk);
    const struct plan_topp_request request = {
        .path = timing->path,
        .limit = bound,
        .cap = cap,
        .cap_count = caps,
        .start_speed = ends != NULL ? ends[0] : 0,
        .end_speed = ends != NULL ? ends[1] : 0,
    };
    if (timing->has_jerk)
        err = plan_topp_jerk_solve(&request, jerk, &timing->pool, &timing->law,
                                   failed);
    else
        err = plan_topp_solve(&request, &timing->pool, &timing->topp, failed);
    if (err == MOTION_OK)
        err = timing->has_jerk ? timing_law_knots(timing)
                               : timing_topp_knots(timing);
    if (err == MOTION_OK && timing->knots < 2)
        err = MOTION_E_EMPTY;
    if (err < 0)
        plan_timing_free(timing);
    return err;
}

/* One more knot in the middle of each two, an eighth of what the quintics' jerk misses,
 * unless they are near already. */
static int timing_refine(struct plan_timing *timing)
{
    double *knot =
        plan_pool_take(&timing->pool, 2 * (size_t)timing->knots, sizeof *knot);
    uint32_t knots = 1;

    if (knot == NULL)
        return MOTION_E_FULL;
    for (uint32_t i = 0; i + 1 < timing->knots; i++) {
        const double from = timing->knot[i], to = timing->knot[i + 1];
        if (to - from >= 2 * timing->least)
            knot[knots++] = (from + to) / 2;
        knot[knots++] = to;
    }
    timing->knot = knot;
    timing->knots = knots;
    return MOTION_OK;
}

void plan_timing_free(struct plan_timing *timing)
{
    plan_pool_free(&timing->pool);
    *timing = (struct plan_timing){ 0 };
}

/* --- reading ----------------------------------------------------------------- */

/* The piece is that of the interval's middle, as s at its ends is rounded. */
static void timing_topp_at(const struct plan_timing *timing, double t_s,
                           struct plan_topp_axis_state axis[])
{
    const struct plan_topp *topp = &timing->topp;
    const struct plan_topp_path *path = &timing->path;
    const uint32_t i =
        double_interval_find(topp->t, sizeof *topp->t, topp->intervals, t_s);
    const uint32_t piece =
        double_interval_find(path->border, sizeof *path->border, path->pieces,
                             (topp->s[i] + topp->s[i + 1]) / 2);
    struct plan_topp_state at;

    plan_topp_at(topp, t_s, &at);
    for (unsigned k = 0; k < path->axes; k++) {
        double q[4];
        topp_chain_powers(path, piece, k, at.s - path->border[piece], q);
        axis[k] = (struct plan_topp_axis_state){
            .pos = q[0],
            .vel = q[1] * at.vel,
            .acc = q[1] * at.acc + q[2] * at.vel * at.vel,
        };
    }
}

/* --- baking ------------------------------------------------------------------ */

/* Channels are axes, or the one distance along the path. */
struct timing_source {
    const struct plan_timing *timing;
    double stretch;
    bool is_distance;
    unsigned first, channels;
    struct plan_pool pool; /* of the two that follow */
    int64_t *border_ns_q12;
    struct motion_real *base; /* of each knot and channel */
    double drift[MOTION_BAKE_AXES];
};

struct timing_rate {
    double vel, acc;
};

/* Speed and its change along the path.  Where it stands, or turns back, that is all of
 * the acceleration, backwards before it and forwards after it. */
static struct timing_rate timing_along(const struct plan_topp_axis_state axis[],
                                       unsigned axes, bool is_left)
{
    double vel = 0, acc = 0, both = 0;

    for (unsigned k = 0; k < axes; k++) {
        vel += axis[k].vel * axis[k].vel;
        acc += axis[k].acc * axis[k].acc;
        both += axis[k].vel * axis[k].acc;
    }
    vel = sqrt(vel);
    acc = sqrt(acc);
    if (vel > TIMING_STANDS * acc)
        return (struct timing_rate){ vel, both / vel };
    return (struct timing_rate){ vel, is_left ? -acc : acc };
}

/* Of all channels, t_s in the law's own time, inside the span from a knot on. */
static void timing_rates(const struct timing_source *self, uint32_t span,
                         double t_s, bool is_left, struct timing_rate rate[])
{
    const struct plan_timing *timing = self->timing;
    struct plan_topp_axis_state axis[PLAN_TOPP_AXES_MAX];
    const double last = timing->knot[span + 1] * (1 - DBL_EPSILON);

    t_s = fmin(fmax(t_s, timing->knot[span]), last);
    if (timing->has_jerk)
        plan_topp_law_at(&timing->law, t_s, axis);
    else
        timing_topp_at(timing, t_s, axis);
    if (self->is_distance) {
        rate[0] = timing_along(axis, timing->path.axes, is_left);
        return;
    }
    for (unsigned c = 0; c < self->channels; c++)
        rate[c] = (struct timing_rate){ axis[self->first + c].vel,
                                        axis[self->first + c].acc };
}

/* The integral of velocity from a knot to t. */
static void timing_displacement(const struct timing_source *self, uint32_t span,
                                double t_s, double sum[])
{
    static const double place[TIMING_POINTS] = { 0.18343464249564980494,
                                                 0.52553240991632898582,
                                                 0.79666647741362673959,
                                                 0.96028985649753623168 };
    static const double weight[TIMING_POINTS] = { 0.36268378337836198297,
                                                  0.31370664587788728734,
                                                  0.22238103445337447054,
                                                  0.10122853629037625915 };
    const double from = self->timing->knot[span];
    const double half = (t_s - from) / 2;
    struct timing_rate rate[MOTION_BAKE_AXES];

    for (unsigned c = 0; c < self->channels; c++)
        sum[c] = 0;
    for (int i = 0; i < 2 * TIMING_POINTS; i++) {
        const double x = i % 2 ? place[i / 2] : -place[i / 2];
        timing_rates(self, span, from + half * (1 + x), false, rate);
        for (unsigned c = 0; c < self->channels; c++)
            sum[c] += weight[i / 2] * rate[c].vel * half;
    }
}

/* A border is a knot rounded to 2^-12 ns: what that is at the velocity there
 * matters to the jerk of a short segment. */
static int timing_at(void *context, int64_t t_ns_q12,
                     enum motion_bake_side side,
                     struct motion_bake_point point[])
{
    const struct timing_source *self = context;
    const uint32_t spans = self->timing->knots - 1;
    const uint32_t span =
        motion_bake_span(self->border_ns_q12, spans, t_ns_q12, side);
    const uint32_t knot =
        span + (t_ns_q12 == self->border_ns_q12[span + 1] ? 1 : 0);
    const double e = self->stretch;
    const double t_s = (double)t_ns_q12 / (double)MOTION_FIXED_S_Q12 / e;
    struct timing_rate rate[MOTION_BAKE_AXES];
    double moved[MOTION_BAKE_AXES] = { 0 };

    timing_rates(self, span, t_s, side == MOTION_BAKE_LEFT, rate);
    if (t_ns_q12 == self->border_ns_q12[knot]) {
        for (unsigned c = 0; c < self->channels; c++)
            moved[c] = rate[c].vel * (t_s - self->timing->knot[knot]);
    } else {
        timing_displacement(self, span, t_s, moved);
        for (unsigned c = 0; c < self->channels; c++)
            moved[c] += self->drift[c] * (t_s - self->timing->knot[span]);
    }
    for (unsigned c = 0; c < self->channels; c++)
        point[c] = (struct motion_bake_point){
            motion_real_add(self->base[(size_t)knot * self->channels + c],
                            timing_real(moved[c])),
            timing_real(rate[c].vel / e), timing_real(rate[c].acc / (e * e))
        };
    return MOTION_OK;
}

/* Positions at all knots; what the sum of displacements misses at the end is
 * spread over the time.  The largest such miss on the way is in *miss. */
static void timing_bases(struct timing_source *self,
                         const struct motion_real start[],
                         const struct motion_real end[], double *miss)
{
    const uint32_t knots = self->timing->knots;
    const double duration = plan_timing_duration(self->timing);
    const unsigned n = self->channels;

    *miss = 0;
    for (unsigned c = 0; c < n; c++)
        self->base[c] = start[c];
    for (uint32_t i = 0; i + 1 < knots; i++) {
        double moved[MOTION_BAKE_AXES];
        timing_displacement(self, i, self->timing->knot[i + 1], moved);
        for (unsigned c = 0; c < n; c++)
            self->base[(size_t)(i + 1) * n + c] = motion_real_add(
                self->base[(size_t)i * n + c], timing_real(moved[c]));
    }
    for (unsigned c = 0; c < n; c++) {
        struct motion_real *last = &self->base[(size_t)(knots - 1) * n + c];
        const struct motion_real off = motion_real_sub(end[c], *last);
        const double drift = ldexp((double)off.m, off.e);
        self->drift[c] = drift / duration;
        *miss = fmax(*miss, fabs(drift));
        for (uint32_t i = 1; i + 1 < knots; i++) {
            struct motion_real *base = &self->base[(size_t)i * n + c];
            *base = motion_real_add(
                *base, timing_real(self->drift[c] * self->timing->knot[i]));
        }
        *last = end[c];
    }
}

static int timing_borders(struct timing_source *self)
{
    const uint32_t knots = self->timing->knots;
    const double scale = self->stretch * (double)MOTION_FIXED_S_Q12;

    self->border_ns_q12 =
        plan_pool_take(&self->pool, knots, sizeof *self->border_ns_q12);
    self->base = plan_pool_take(&self->pool, (size_t)knots * self->channels,
                                sizeof *self->base);
    if (self->border_ns_q12 == NULL || self->base == NULL)
        return MOTION_E_FULL;
    if (!(self->timing->knot[knots - 1] * scale < 0x1p62))
        return MOTION_E_RANGE;
    for (uint32_t i = 0; i < knots; i++)
        self->border_ns_q12[i] = llround(self->timing->knot[i] * scale);
    return MOTION_OK;
}

static int timing_append(struct timing_source *self,
                         struct motion_real tolerance,
                         struct motion_track *track[],
                         struct motion_bake_report *report)
{
    const struct motion_bake job = {
        .source = { timing_at, self },
        .axes = self->channels,
        .border_ns_q12 = self->border_ns_q12,
        .borders = self->timing->knots,
        .pos = tolerance,
        .vel = motion_real_zero(),
        .acc = motion_real_zero(),
    };
    int err;

    for (unsigned c = 0; c < self->channels; c++)
        plan_track_reserve(track[c], self->timing->knots);
    do {
        err = motion_bake(&job, track, report);
        for (unsigned c = 0; c < self->channels && err == MOTION_E_FULL; c++)
            if (plan_track_grow(track[c]) < 0)
                return MOTION_E_FULL;
    } while (err == MOTION_E_FULL);
    return err;
}

static int timing_bake(struct timing_source *self,
                       const struct motion_real start[],
                       const struct motion_real end[],
                       struct motion_real tolerance,
                       struct motion_track *track[], struct motion_real bound[])
{
    struct motion_bake_report report = { .segments = 0 };
    double miss = 0;
    int err = timing_borders(self);

    if (err == MOTION_OK) {
        timing_bases(self, start, end, &miss);
        err = timing_append(self, tolerance, track, &report);
    }
    for (unsigned c = 0; c < self->channels; c++) {
        if (err < 0) {
            plan_track_free(track[c]);
            continue;
        }
        plan_track_trim(track[c]);
        bound[c] = motion_real_add(report.bound[c].pos, timing_real(miss));
    }
    plan_pool_free(&self->pool);
    return err;
}

static int timing_group(struct timing_source *self, const int64_t start_q32[],
                        const int64_t end_q32[], struct motion_real tolerance,
                        struct motion_track track[], struct motion_real bound[])
{
    struct motion_real start[MOTION_BAKE_AXES] = { { 0, 0 } };
    struct motion_real end[MOTION_BAKE_AXES] = { { 0, 0 } };
    struct motion_track *list[MOTION_BAKE_AXES] = { NULL };

    for (unsigned c = 0; c < self->channels; c++) {
        list[c] = &track[c];
        start[c] = motion_real_from_q(start_q32[c], 32);
        end[c] = motion_real_from_q(end_q32[c], 32);
        plan_track_init(list[c], start_q32[c]);
    }
    return timing_bake(self, start, end, tolerance, list, bound);
}

/* All axes, in groups as large as can be baked together. */
static int timing_tracks(const struct plan_timing *timing, double stretch,
                         const int64_t start_q32[], const int64_t end_q32[],
                         struct motion_real tolerance,
                         struct motion_track track[],
                         struct motion_real bound[])
{
    const unsigned axes = timing->path.axes;
    int err = MOTION_OK;

    for (unsigned k = 0; err == MOTION_OK && k < axes; k += MOTION_BAKE_AXES) {
        const unsigned rest = axes - k;
        struct timing_source self = {
            .timing = timing,
            .stretch = stretch,
            .first = k,
            .channels = rest < MOTION_BAKE_AXES ? rest : MOTION_BAKE_AXES,
        };
        err = timing_group(&self, start_q32 + k, end_q32 + k, tolerance,
                           track + k, bound + k);
    }
    return err;
}

static double timing_ratio(const struct motion_track *track,
                           enum motion_quantity quantity, int64_t limit)
{
    struct motion_extreme extreme;

    motion_track_extreme(track, quantity, &extreme);
    return fmax((double)extreme.max, -(double)extreme.min) / (double)limit;
}

/* The stretch that the tracks need; 1 or less: they are inside, with all that rounding
 * has added. */
static double timing_need(unsigned axes, const struct plan_limit limit[],
                          const struct motion_track track[])
{
    double need = 0;

    for (unsigned k = 0; k < axes; k++) {
        need =
            fmax(need, timing_ratio(&track[k], MOTION_VEL, limit[k].vel_q32));
        need = fmax(
            need, sqrt(timing_ratio(&track[k], MOTION_ACC, limit[k].acc_q32)));
        if (limit[k].jerk_q32 != 0)
            need = fmax(need, double_cbrt(timing_ratio(&track[k], MOTION_JERK,
                                                       limit[k].jerk_q32)));
    }
    return need;
}

int plan_timing_inside(struct plan_timing *timing, double *stretch,
                       const struct plan_limit limit[],
                       const int64_t start_q32[], const int64_t end_q32[],
                       struct motion_real tolerance,
                       struct motion_track track[], struct motion_real bound[])
{
    const unsigned axes = timing->path.axes;
    int err = MOTION_OK;

    for (unsigned k = 0; k < axes; k++)
        plan_track_init(&track[k], start_q32[k]);
    for (unsigned round = 0; round < TIMING_ROUNDS && err == MOTION_OK;
         round++) {
        err = timing_tracks(timing, *stretch, start_q32, end_q32, tolerance,
                            track, bound);
        const double need =
            err < 0 ? INFINITY : timing_need(axes, limit, track);
        if (need <= 1)
            return MOTION_OK;
        for (unsigned k = 0; k < axes; k++)
            plan_track_free(&track[k]);
        if (need < TIMING_REFINED || round >= TIMING_REFINEMENTS ||
            timing_refine(timing) < 0)
            *stretch *= need * (1 + TIMING_STRETCHED);
    }
    return err < 0 ? err : MOTION_E_LIMIT;
}

/* Return where the speed along the path is least inside a span, which is a point when
 * the path runs back over itself; NaN where it is least at one of the ends. */
static double timing_slowest(const struct timing_source *self, uint32_t span)
{
    const double *knot = self->timing->knot;
    double low = knot[span], high = knot[span + 1];
    struct timing_rate rate;

    timing_rates(self, span, low, false, &rate);
    if (rate.acc >= 0)
        return NAN;
    timing_rates(self, span, high, true, &rate);
    if (rate.acc <= 0)
        return NAN;
    for (int i = 0; i < TIMING_BISECTIONS; i++) {
        const double middle = low + (high - low) / 2;
        timing_rates(self, span, middle, false, &rate);
        if (rate.acc < 0)
            low = middle;
        else
            high = middle;
    }
    return high;
}

/* One more knot, or one of the span's ends where that is as near as two may be,
 * wherever the path is slowest: speed may have a corner there, which no polynomial
 * has. */
static int timing_turns(const struct timing_source *self,
                        struct plan_timing *timing)
{
    double *knot =
        plan_pool_take(&timing->pool, 2 * (size_t)timing->knots, sizeof *knot);
    const double least = timing->least;
    uint32_t knots = 1;

    if (knot == NULL)
        return MOTION_E_FULL;
    for (uint32_t i = 0; i + 1 < timing->knots; i++) {
        double next = timing->knot[i + 1];
        const double t = timing_slowest(self, i);
        double *before = &knot[knots - 1];
        if (t - *before >= least && next - t >= least)
            knot[knots++] = t;
        else if (i > 0 && t - *before < least)
            *before = t;
        else if (i + 2 < timing->knots && next - t < least)
            next = t;
        knot[knots++] = next;
    }
    timing->knot = knot;
    timing->knots = knots;
    return MOTION_OK;
}

int plan_timing_distance(struct plan_timing *timing, double stretch,
                         struct motion_real length,
                         struct motion_real tolerance, struct motion_track *law,
                         struct motion_real *bound)
{
    struct timing_source self = {
        .timing = timing, .stretch = stretch, .is_distance = true, .channels = 1
    };
    const struct motion_real start = motion_real_zero();
    int err = timing_turns(&self, timing);

    plan_track_init(law, 0);
    return err < 0
               ? err
               : timing_bake(&self, &start, &length, tolerance, &law, bound);
}

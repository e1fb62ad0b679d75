/* motion/curve/pose.c - see pose.h.
 *
 * All terms are walked together from border to border.  Between two borders
 * each is one polynomial, which is brought to u = 0..1 of that piece; what is
 * added up there is appended.
 *
 * Polynomials are power coefficients in 72-bit fixed point ("q72") as in
 * track_append.c, where a segment's own coefficients are whole numbers of them:
 * c[k] / 2^(k + 32 + frac) = c[k] 2^(40 - frac - k) q72, 40 - frac - k >= 4.
 * |c| < 2^62 and frac >= -14, so they are below 2^116, positions below 2^104;
 * sums of 32 terms stay below 2^122. */
#include "motion/curve/pose.h"

#include <stddef.h>

#include "motion/core/err.h"
#include "motion/curve/bake.h"

#define POSE_DEGREE MOTION_TRACK_DEGREE
#define POSE_BITS   122 /* of a sum */

struct pose_poly {
    struct motion_u128 a[POSE_DEGREE + 1]; /* q72, signed */
};

/* A track that is walked. */
struct pose_walk {
    const struct motion_track *track;
    uint32_t index; /* of the segment that begins at or before the piece */
};

/* --- 128 bits ------------------------------------------------------------ */

static struct motion_u128 pose_add(struct motion_u128 a, struct motion_u128 b)
{
    return motion_fixed_add_u128(a, b);
}

static unsigned pose_bits(struct motion_u128 a)
{
    struct motion_u128 m = motion_fixed_abs_i128(a);
    return m.hi != 0 ? 128 - motion_fixed_clz_u64(m.hi)
                     : 64 - motion_fixed_clz_u64(m.lo);
}

static struct motion_u128 pose_signed(struct motion_u128 m, bool negative)
{
    return negative ? motion_fixed_neg_i128(m) : m;
}

/* The 192 bits of m * k. */
struct pose_wide {
    uint64_t high, mid, low;
};

static struct pose_wide pose_mul(struct motion_u128 m, uint64_t k)
{
    struct motion_u128 low = motion_fixed_mul_u64(m.lo, k);
    struct motion_u128 high = motion_fixed_mul_u64(m.hi, k);
    high = pose_add(high, (struct motion_u128){ 0, low.hi });
    return (struct pose_wide){ high.hi, high.lo, low.lo };
}

/* a * num / den, rounded towards zero; 0 <= num <= den, den > 0. */
static struct motion_u128 pose_part(struct motion_u128 a, int64_t num,
                                    int64_t den)
{
    struct pose_wide n = pose_mul(motion_fixed_abs_i128(a), (uint64_t)num);
    struct motion_u128 q;
    uint64_t rest;

    if (num == den || (a.hi == 0 && a.lo == 0))
        return a;
    /* a's magnitude is below 2^127, so n.high < num < den */
    motion_fixed_div_u128((struct motion_u128){ n.high, n.mid }, (uint64_t)den,
                          &q.hi, &rest);
    motion_fixed_div_u128((struct motion_u128){ rest, n.low }, (uint64_t)den,
                          &q.lo, &rest);
    return pose_signed(q, motion_fixed_is_neg_i128(a));
}

/* a * factor / 2^32, rounded down in magnitude. */
static int pose_scale(struct motion_u128 a, int64_t factor_q32,
                      struct motion_u128 *result)
{
    struct pose_wide n =
        pose_mul(motion_fixed_abs_i128(a), motion_fixed_abs(factor_q32));

    if (n.high >> 26 != 0) /* 2^(26 + 128 - 32) = 2^POSE_BITS */
        return MOTION_E_RANGE;
    *result = pose_signed((struct motion_u128){ n.high << 32 | n.mid >> 32,
                                                n.mid << 32 | n.low >> 32 },
                          motion_fixed_is_neg_i128(a) != (factor_q32 < 0));
    return MOTION_OK;
}

/* --- polynomials --------------------------------------------------------- */

static struct motion_u128 pose_of_q32(int64_t value_q32)
{
    return motion_fixed_shl_u128(motion_fixed_from_i64(value_q32), 40);
}

static void pose_of_segment(const struct motion_segment *segment,
                            struct pose_poly *poly)
{
    for (int k = 0; k <= POSE_DEGREE; k++)
        poly->a[k] =
            motion_fixed_shl_u128(motion_fixed_from_i64(segment->coef[k]),
                                  (unsigned)(40 - segment->frac - k));
    poly->a[0] = pose_add(poly->a[0], pose_of_q32(segment->pos_q32));
    poly->a[1] = pose_add(poly->a[1], pose_of_q32(segment->remainder));
}

/* p(u) becomes p(from + u part): Taylor's shift by repeated synthetic division,
 * then powers of the part. */
static void pose_cut(struct pose_poly *poly, int64_t from, int64_t part,
                     int64_t dur)
{
    for (int k = 0; k < POSE_DEGREE && from > 0; k++)
        for (int i = POSE_DEGREE - 1; i >= k; i--)
            poly->a[i] =
                pose_add(poly->a[i], pose_part(poly->a[i + 1], from, dur));
    for (int k = 1; k <= POSE_DEGREE; k++)
        for (int i = k; i <= POSE_DEGREE; i++)
            poly->a[i] = pose_part(poly->a[i], part, dur);
}

static bool pose_is_over(const struct pose_walk *walk)
{
    return walk->index >= walk->track->count;
}

static int64_t pose_border(const struct pose_walk *walk)
{
    const struct motion_segment *segment;
    if (pose_is_over(walk))
        return INT64_MAX;
    segment = &walk->track->segment[walk->index];
    return segment->start_ns_q12 + segment->dur_ns_q12;
}

/* The track on start .. end, which is within one of its segments. */
static void pose_piece(const struct pose_walk *walk, int64_t start, int64_t end,
                       struct pose_poly *poly)
{
    const struct motion_track *track = walk->track;
    const struct motion_segment *segment;

    *poly = (struct pose_poly){ { { 0, 0 } } };
    if (pose_is_over(walk)) {
        poly->a[0] = pose_add(pose_of_q32(track->end.pos_q32),
                              (struct motion_u128){ 0, track->end_frac >> 24 });
        return;
    }
    segment = &track->segment[walk->index];
    pose_of_segment(segment, poly);
    if (end - start != segment->dur_ns_q12)
        pose_cut(poly, start - segment->start_ns_q12, end - start,
                 segment->dur_ns_q12);
}

/* Where the track is at t, a border of the walk or inside its segment. */
static struct motion_u128 pose_value(struct pose_walk *walk, int64_t t)
{
    struct pose_poly poly;

    while (pose_border(walk) <= t)
        walk->index++;
    /* cut to nothing, at whose start only a[0] is left */
    pose_piece(walk, t, t, &poly);
    return poly.a[0];
}

/* --- appending ----------------------------------------------------------- */

static uint64_t pose_fraction(struct motion_u128 value)
{
    return value.lo << 24;
}

/* floor(value / 2^40), whatever its sign. */
static int pose_position(struct motion_u128 value, int64_t *pos_q32)
{
    if (pose_bits(value) > 103)
        return MOTION_E_RANGE;
    *pos_q32 = (int64_t)(value.hi << 24 | value.lo >> 40);
    return MOTION_OK;
}

static void pose_drop(struct motion_track *track)
{
    motion_track_init(track, track->segment, track->capacity, 0);
}

static int pose_begin(struct motion_track *track, struct motion_u128 value)
{
    int64_t pos_q32;
    int err = pose_position(value, &pos_q32);

    pose_drop(track);
    if (err < 0)
        return err;
    motion_track_init(track, track->segment, track->capacity, pos_q32);
    track->end_frac = pose_fraction(value);
    return MOTION_OK;
}

static int pose_append(struct motion_track *track, int64_t dur_ns_q12,
                       const struct pose_poly *poly, struct motion_u128 end)
{
    int64_t coef[POSE_DEGREE] = { 0 }, end_pos_q32;
    int degree = POSE_DEGREE;
    unsigned bits = 0;

    while (degree > 1 && poly->a[degree].hi == 0 && poly->a[degree].lo == 0)
        degree--;
    for (int k = 1; k <= degree; k++)
        bits = pose_bits(poly->a[k]) > bits ? pose_bits(poly->a[k]) : bits;
    if (bits > 102 || pose_position(end, &end_pos_q32) < 0)
        return MOTION_E_RANGE;
    unsigned frac = 102 - bits < 31 ? 102 - bits : 31;
    for (int k = 1; k <= degree; k++) /* below 2^62 */
        coef[k - 1] =
            (int64_t)motion_fixed_round_i128(poly->a[k], 40 - frac).lo;
    return motion_track_append_poly(track, dur_ns_q12, degree, coef, frac,
                                    end_pos_q32, pose_fraction(end));
}

/* --- sums ---------------------------------------------------------------- */

struct pose_sum {
    const struct motion_pose_term *term;
    uint32_t terms;
    int64_t offset_q32;
    struct pose_walk walk[MOTION_POSE_TERMS];
};

static int pose_take(struct motion_u128 *sum, struct motion_u128 value,
                     int64_t factor_q32)
{
    if (factor_q32 != MOTION_FIXED_ONE_Q32 &&
        pose_scale(value, factor_q32, &value) < 0)
        return MOTION_E_RANGE;
    *sum = pose_add(*sum, value);
    return pose_bits(*sum) > POSE_BITS ? MOTION_E_RANGE : MOTION_OK;
}

static int pose_sum_value(struct pose_sum *self, int64_t t,
                          struct motion_u128 *value)
{
    int err = MOTION_OK;

    *value = pose_of_q32(self->offset_q32);
    for (uint32_t i = 0; i < self->terms && err == MOTION_OK; i++)
        err = pose_take(value, pose_value(&self->walk[i], t),
                        self->term[i].factor_q32);
    return err;
}

static int pose_sum_poly(const struct pose_sum *self, int64_t start,
                         int64_t end, struct pose_poly *sum)
{
    int err = MOTION_OK;

    *sum = (struct pose_poly){ { pose_of_q32(self->offset_q32) } };
    for (uint32_t i = 0; i < self->terms && err == MOTION_OK; i++) {
        struct pose_poly poly;
        pose_piece(&self->walk[i], start, end, &poly);
        for (int k = 0; k <= POSE_DEGREE && err == MOTION_OK; k++)
            err = pose_take(&sum->a[k], poly.a[k], self->term[i].factor_q32);
    }
    return err;
}

static int64_t pose_next(const struct pose_walk *walk, uint32_t count)
{
    int64_t next = INT64_MAX;

    for (uint32_t i = 0; i < count; i++)
        if (pose_border(&walk[i]) < next)
            next = pose_border(&walk[i]);
    return next;
}

static int pose_sum_run(struct motion_track *sum, struct pose_sum *self)
{
    struct motion_u128 value;
    struct pose_poly poly;
    int64_t start = 0, end;
    int err = pose_sum_value(self, 0, &value);

    if (err == MOTION_OK)
        err = pose_begin(sum, value);
    while (err == MOTION_OK &&
           (end = pose_next(self->walk, self->terms)) != INT64_MAX) {
        err = pose_sum_poly(self, start, end, &poly);
        if (err == MOTION_OK)
            err = pose_sum_value(self, end, &value);
        if (err == MOTION_OK)
            err = pose_append(sum, end - start, &poly, value);
        start = end;
    }
    return err;
}

int motion_pose_sum(struct motion_track *sum, int64_t offset_q32,
                    const struct motion_pose_term term[], uint32_t terms)
{
    struct pose_sum self = { .term = term,
                             .terms = terms,
                             .offset_q32 = offset_q32 };
    int err;

    pose_drop(sum);
    if (terms > MOTION_POSE_TERMS)
        return MOTION_E_ARG;
    for (uint32_t i = 0; i < terms; i++)
        self.walk[i].track = term[i].track;
    err = pose_sum_run(sum, &self);
    if (err < 0)
        pose_drop(sum);
    return err;
}

int motion_pose_add(struct motion_track *sum, const struct motion_track *a,
                    const struct motion_track *b)
{
    const struct motion_pose_term term[] = { { a, MOTION_FIXED_ONE_Q32 },
                                             { b, MOTION_FIXED_ONE_Q32 } };
    return motion_pose_sum(sum, 0, term, 2);
}

/* --- cross-fades --------------------------------------------------------- */

enum pose_role { POSE_FROM, POSE_TO, POSE_WEIGHT, POSE_ROLES };

/* Three polynomials on one piece. */
struct pose_fade {
    struct pose_walk walk[POSE_ROLES];
    struct motion_real coef[POSE_ROLES][POSE_DEGREE + 1]; /* TO: less FROM */
    int degree[POSE_ROLES];
    int64_t start_ns_q12, dur_ns_q12;
    int64_t tolerance_q32;
    struct motion_real bound;
};

static struct motion_real pose_real(struct motion_u128 a)
{
    struct motion_real m = motion_real_from_u128(motion_fixed_abs_i128(a), -72);
    return motion_fixed_is_neg_i128(a) ? motion_real_neg(m) : m;
}

/* To q72; what is beyond 2^POSE_BITS is refused. */
static int pose_unreal(struct motion_real a, struct motion_u128 *result)
{
    int shift = a.e + 72;

    *result = motion_fixed_from_i64(a.m);
    if (motion_real_is_zero(a))
        return MOTION_OK;
    if (shift > POSE_BITS - 62)
        return MOTION_E_RANGE;
    *result = shift >= 0 ? motion_fixed_shl_u128(*result, (unsigned)shift)
                         : motion_fixed_round_i128(*result, (unsigned)-shift);
    return MOTION_OK;
}

static void pose_fade_piece(struct pose_fade *self, int64_t end)
{
    struct pose_poly poly[POSE_ROLES];

    self->dur_ns_q12 = end - self->start_ns_q12;
    for (int role = 0; role < POSE_ROLES; role++)
        pose_piece(&self->walk[role], self->start_ns_q12, end, &poly[role]);
    for (int k = 0; k <= POSE_DEGREE; k++)
        poly[POSE_TO].a[k] =
            motion_fixed_sub_u128(poly[POSE_TO].a[k], poly[POSE_FROM].a[k]);
    for (int role = 0; role < POSE_ROLES; role++) {
        self->degree[role] = 0;
        for (int k = 0; k <= POSE_DEGREE; k++) {
            self->coef[role][k] = pose_real(poly[role].a[k]);
            if (!motion_real_is_zero(self->coef[role][k]))
                self->degree[role] = k;
        }
    }
}

static int pose_fade_exact(const struct pose_fade *self, struct pose_poly *poly)
{
    int err = MOTION_OK;

    for (int k = 0; k <= POSE_DEGREE && err == MOTION_OK; k++) {
        struct motion_real sum = self->coef[POSE_FROM][k];
        for (int i = 0; i <= k; i++)
            sum = motion_real_add(sum,
                                  motion_real_mul(self->coef[POSE_WEIGHT][i],
                                                  self->coef[POSE_TO][k - i]));
        err = pose_unreal(sum, &poly->a[k]);
    }
    return err;
}

/* from + w d and two derivatives, d = to - from. */
static int pose_fade_at(void *context, int64_t t_ns_q12,
                        enum motion_bake_side side,
                        struct motion_bake_point point[])
{
    const struct pose_fade *self = context;
    struct motion_real u =
        motion_real_div(motion_real_int(t_ns_q12 - self->start_ns_q12),
                        motion_real_int(self->dur_ns_q12));
    struct motion_bake_point p[POSE_ROLES];

    (void)side; /* one polynomial from border to border */
    for (int role = 0; role < POSE_ROLES; role++)
        p[role] = motion_bake_horner(self->coef[role], POSE_DEGREE, u,
                                     motion_bake_seconds(self->dur_ns_q12));
    const struct motion_bake_point *d = &p[POSE_TO], *w = &p[POSE_WEIGHT];
    struct motion_real cross =
        motion_real_twice(motion_real_mul(w->vel, d->vel));
    point->pos =
        motion_real_add(p[POSE_FROM].pos, motion_real_mul(w->pos, d->pos));
    point->vel = motion_real_add(
        p[POSE_FROM].vel, motion_real_add(motion_real_mul(w->vel, d->pos),
                                          motion_real_mul(w->pos, d->vel)));
    point->acc =
        motion_real_add(motion_real_add(p[POSE_FROM].acc, cross),
                        motion_real_add(motion_real_mul(w->acc, d->pos),
                                        motion_real_mul(w->pos, d->acc)));
    return MOTION_OK;
}

static int pose_fade_bake(struct pose_fade *self, struct motion_track *fade)
{
    const int64_t border[] = { self->start_ns_q12,
                               self->start_ns_q12 + self->dur_ns_q12 };
    struct motion_bake job = {
        .source = { pose_fade_at, self },
        .axes = 1,
        .border_ns_q12 = border,
        .borders = 2,
        .pos = motion_real_from_q(self->tolerance_q32, 32),
        .vel = motion_real_zero(),
        .acc = motion_real_zero(),
    };
    struct motion_bake_report report;
    int err = motion_bake(&job, &fade, &report);

    if (err >= 0)
        self->bound = motion_real_max(self->bound, report.bound[0].pos);
    return err;
}

/* The value at u = 1 in q72, as the sum of the coefficients. */
static struct motion_u128 pose_poly_end(const struct pose_poly *poly)
{
    struct motion_u128 end = poly->a[0];
    for (int k = 1; k <= POSE_DEGREE; k++)
        end = pose_add(end, poly->a[k]);
    return end;
}

static int pose_fade_append(struct pose_fade *self, struct motion_track *fade)
{
    struct pose_poly poly;
    int err;

    if (self->degree[POSE_WEIGHT] + self->degree[POSE_TO] > POSE_DEGREE)
        return pose_fade_bake(self, fade);
    err = pose_fade_exact(self, &poly);
    if (err == MOTION_OK)
        err = pose_append(fade, self->dur_ns_q12, &poly, pose_poly_end(&poly));
    return err;
}

static int pose_fade_begin(struct pose_fade *self, struct motion_track *fade)
{
    struct pose_poly poly;
    int64_t end = pose_next(self->walk, POSE_ROLES);
    int err;

    pose_fade_piece(self, end == INT64_MAX ? 0 : end);
    err = pose_fade_exact(self, &poly); /* a[0] is right at any degree */
    return err < 0 ? err : pose_begin(fade, poly.a[0]);
}

static int pose_fade_run(struct pose_fade *self, struct motion_track *fade)
{
    int64_t end;
    int err = pose_fade_begin(self, fade);

    while (err >= 0 && (end = pose_next(self->walk, POSE_ROLES)) != INT64_MAX) {
        pose_fade_piece(self, end);
        err = pose_fade_append(self, fade);
        self->start_ns_q12 = end;
        for (int role = 0; role < POSE_ROLES; role++)
            while (pose_border(&self->walk[role]) <= end)
                self->walk[role].index++;
    }
    return err < 0 ? err : MOTION_OK;
}

int motion_pose_fade(struct motion_track *fade, const struct motion_track *from,
                     const struct motion_track *to,
                     const struct motion_track *weight, int64_t tolerance_q32,
                     struct motion_real *bound)
{
    struct pose_fade self = {
        .walk = { { from, 0 }, { to, 0 }, { weight, 0 } },
        .tolerance_q32 = tolerance_q32,
        .bound = motion_real_make(1, -30), /* formats */
    };
    int err;

    pose_drop(fade);
    if (tolerance_q32 <= 0)
        return MOTION_E_ARG;
    err = pose_fade_run(&self, fade);
    if (err < 0)
        pose_drop(fade);
    else if (bound != NULL)
        *bound = self.bound;
    return err;
}

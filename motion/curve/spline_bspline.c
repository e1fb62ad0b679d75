/* motion/curve/spline_bspline.c - cubic B-splines; see spline.h.
 *
 * Control point i belongs to the knots t[i-1], t[i], t[i+1].  On the span from
 * t[i] to t[i+1] the curve is the cubic whose Bezier points are the blossom of
 * points i-1 .. i+2 at its ends (de Boor's algorithm with three arguments:
 * Ramshaw 1989).  Beyond the ends knots go on as in a mirror, and so do
 * points: turned about the end (natural: acceleration is zero there), or as in
 * the mirror, with the end itself moved until the curve meets it (rest).  Where
 * the end has a velocity, the point in the mirror is moved for it:
 *     v = 3 (next - mirrored) / (2 (h + h + h')) */
#include "motion/core/err.h"
#include "motion/curve/spline_internal.h"

struct bspline {
    const struct motion_key *key;
    int64_t count;
    enum motion_spline_end first, last;
    bool open;
};

static const struct motion_key *bspline_key(const struct bspline *b, int64_t i)
{
    return &b->key[i < 0 ? 0 : i > b->count - 1 ? b->count - 1 : i];
}

/* Time of key i after key `from`. */
static struct motion_real bspline_time(const struct bspline *b, int64_t from,
                                       int64_t i)
{
    const struct motion_key pair[2] = { b->key[i < from ? i : from],
                                        b->key[i < from ? from : i] };

    if (i == from)
        return motion_real_zero();
    return i < from ? motion_real_neg(spline_span(pair)) : spline_span(pair);
}

/* Time of knot i after key `from`; mirrored beyond the ends, where a short list
 * ends again. */
static struct motion_real bspline_after(const struct bspline *b, int64_t from,
                                        int64_t i)
{
    const int64_t last = b->count - 1, end = i < 0 ? 0 : last;
    int64_t mirror = i < 0 ? -i : 2 * last - i;

    if (i >= 0 && i <= last)
        return bspline_time(b, from, i);
    mirror = mirror < 0 ? 0 : mirror > last ? last : mirror;
    return motion_real_sub(motion_real_twice(bspline_time(b, from, end)),
                           bspline_time(b, from, mirror));
}

/* At an end knot with mirrored knots: h + h + h', h and h' the first spans. */
static struct motion_real bspline_end_reach(const struct bspline *b, bool last)
{
    const int64_t end = last ? b->count - 1 : 0, in = last ? -1 : 1;

    return motion_real_add(
        motion_real_abs(bspline_after(b, end, end + in)),
        motion_real_abs(bspline_after(b, end, end + 2 * in)));
}

/* Weight of the neighbours together: 2 B1(t0) = h / (h + h + h'). */
static struct motion_real bspline_rest_weight(const struct bspline *b,
                                              bool last)
{
    const int64_t end = last ? b->count - 1 : 0, in = last ? -1 : 1;

    return motion_real_div(motion_real_abs(bspline_after(b, end, end + in)),
                           bspline_end_reach(b, last));
}

/* How far the point beyond an end is from the mirror image of the neighbour. */
static struct motion_real bspline_beyond(const struct bspline *b, bool last)
{
    const struct motion_key *end = bspline_key(b, last ? b->count - 1 : 0);
    struct motion_real off;

    if (!end->has_vel)
        return motion_real_zero();
    off = motion_real_mul(spline_read(end->vel), bspline_end_reach(b, last));
    off = motion_real_div(motion_real_twice(off), motion_real_int(3));
    return last ? off : motion_real_neg(off);
}

/* A control point, relative to that of key `at`. */
static struct motion_real bspline_point(const struct bspline *b, int64_t at,
                                        int64_t i)
{
    const int64_t end = b->count - 1, low = i < 0 ? -i : i;
    const bool first = i <= 0, last = i >= end;
    const int64_t mirror = i < 0 ? low : i > end ? 2 * end - i : i;
    const int64_t base = b->key[at].pos_q32;
    const enum motion_spline_end rule = first ? b->first : b->last;
    struct motion_real p =
        spline_displacement(base, bspline_key(b, mirror)->pos_q32);
    const struct motion_real edge =
        spline_displacement(base, bspline_key(b, first ? 0 : end)->pos_q32);
    struct motion_real weight, next;

    if ((!first && !last) || b->open)
        return p;
    if (rule == MOTION_SPLINE_NATURAL &&
        !bspline_key(b, first ? 0 : end)->has_vel)
        return i == mirror ? p : motion_real_sub(motion_real_twice(edge), p);
    if (i != mirror)
        return motion_real_add(p, bspline_beyond(b, !first));
    /* (1 - w) x + w (next + mirrored) / 2 = edge */
    weight = bspline_rest_weight(b, !first);
    next =
        spline_displacement(base, bspline_key(b, first ? 1 : end - 1)->pos_q32);
    next = motion_real_add(next, motion_real_half(bspline_beyond(b, !first)));
    return motion_real_div(motion_real_sub(edge, motion_real_mul(weight, next)),
                           motion_real_sub(motion_real_int(1), weight));
}

/* Points and knots around the span from key i. */
struct bspline_span {
    struct motion_real point[4], knot[6];
};

static struct bspline_span bspline_span(const struct bspline *b, int64_t i)
{
    struct bspline_span span;

    for (int n = 0; n < 4; n++)
        span.point[n] = bspline_point(b, i, i - 1 + n);
    for (int n = 0; n < 6; n++)
        span.knot[n] = bspline_after(b, i, i - 2 + n);
    return span;
}

static struct motion_real bspline_blossom(const struct bspline_span *span,
                                          const struct motion_real at[3])
{
    struct motion_real d[4];

    for (int j = 0; j < 4; j++)
        d[j] = span->point[j];
    for (int r = 1; r <= 3; r++)
        for (int j = 3; j >= r; j--) {
            const struct motion_real low = span->knot[j - 1];
            const struct motion_real share =
                motion_real_div(motion_real_sub(at[r - 1], low),
                                motion_real_sub(span->knot[j + 3 - r], low));
            d[j] = motion_real_add(
                d[j - 1],
                motion_real_mul(share, motion_real_sub(d[j], d[j - 1])));
        }
    return d[3];
}

/* Bezier points, relative to key i. */
static void bspline_bezier(const struct bspline *b, int64_t i,
                           struct motion_real point[4])
{
    const struct bspline_span span = bspline_span(b, i);
    const struct motion_real x = span.knot[2], y = span.knot[3];
    const struct motion_real at[4][3] = {
        { x, x, x }, { x, x, y }, { x, y, y }, { y, y, y }
    };

    for (int n = 0; n < 4; n++)
        point[n] = bspline_blossom(&span, at[n]);
}

static int bspline_append_span(struct motion_track *track,
                               const struct motion_key *key, const void *with)
{
    const struct bspline *b = with;
    const int64_t i = key - b->key;
    const bool ends = !b->open && i == b->count - 2;
    struct motion_real p[4], slope[3];
    struct spline_poly poly = { .degree = 3 };
    struct motion_u128 end;

    bspline_bezier(b, i, p);
    for (int n = 0; n < 3; n++)
        slope[n] = motion_real_sub(p[n + 1], p[n]);
    end = ends ? (struct motion_u128){ (uint64_t)key[1].pos_q32, 0 }
               : spline_fixed(key[0].pos_q32, p[3]);
    poly.c[1] = curve_times(slope[0], 3);
    poly.c[2] = curve_times(motion_real_sub(slope[1], slope[0]), 3);
    poly.c[3] = motion_real_add(
        motion_real_sub(slope[2], motion_real_twice(slope[1])), slope[0]);
    return spline_emit(track, key[1].t_ns_q12 - key[0].t_ns_q12, &poly,
                       (int64_t)end.hi, end.lo);
}

static bool bspline_is_rule(enum motion_spline_end rule)
{
    return rule == MOTION_SPLINE_REST || rule == MOTION_SPLINE_NATURAL;
}

/* Each end is the other's neighbour: the cubic that the rules leave. */
static int bspline_pair(struct motion_track *track,
                        const struct motion_key *key,
                        enum motion_spline_end first,
                        enum motion_spline_end last, uint32_t *failed)
{
    struct motion_key pair[2] = { key[0], key[1] };
    const int rc = motion_spline_tangents_parabola(pair, 2, first, last);

    return rc ? rc : motion_spline_append_cubic(track, pair, 2, failed);
}

int motion_spline_append_bspline(struct motion_track *track,
                                 const struct motion_key *key, uint32_t count,
                                 enum motion_spline_end first,
                                 enum motion_spline_end last, uint32_t *failed)
{
    const struct bspline b = { key, count, first, last, false };
    int rc = spline_order(key, count);

    if (failed)
        *failed = 0;
    if (rc != MOTION_OK)
        return rc;
    if (!bspline_is_rule(first) || !bspline_is_rule(last))
        return MOTION_E_ARG;
    if (count == 2)
        return bspline_pair(track, key, first, last, failed);
    return spline_each(track, key, count, bspline_append_span, &b, failed);
}

static int bspline_check_open(const struct motion_key *key, uint32_t count)
{
    const int rc = spline_order(key, count);

    return rc ? rc : count < 4 ? MOTION_E_ARG : MOTION_OK;
}

int motion_spline_bspline_start(const struct motion_key *key, uint32_t count,
                                int64_t *start_pos_q32)
{
    const struct bspline b = { .key = key, .count = count, .open = true };
    struct motion_real p[4];
    struct motion_u128 start;
    int rc = bspline_check_open(key, count);

    if (rc != MOTION_OK)
        return rc;
    bspline_bezier(&b, 1, p);
    start = motion_fixed_round_i128(spline_fixed(key[1].pos_q32, p[0]), 64);
    return motion_fixed_to_i64(start, start_pos_q32);
}

int motion_spline_append_bspline_open(struct motion_track *track,
                                      const struct motion_key *key,
                                      uint32_t count, uint32_t *failed)
{
    const struct bspline b = { .key = key, .count = count, .open = true };
    const struct motion_track before = *track;
    int64_t start;
    int rc = bspline_check_open(key, count);

    if (failed)
        *failed = 0;
    if (rc == MOTION_OK)
        rc = motion_spline_bspline_start(key, count, &start);
    if (rc != MOTION_OK)
        return rc;
    if (track->end.pos_q32 != start || track->end_frac != 0)
        return MOTION_E_ARG;
    for (uint32_t i = 1; i + 2 < count; i++) {
        rc = bspline_append_span(track, &key[i], &b);
        if (rc == MOTION_OK)
            continue;
        *track = before;
        if (failed)
            *failed = i;
        return rc;
    }
    return MOTION_OK;
}

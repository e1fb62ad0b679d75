/* motion/path/path.c - see path.h. */
#include "motion/path/path.h"

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/path/speed_law.h"

/* --- the law -------------------------------------------------------------- */

static int path_check(const struct motion_path *path)
{
    const struct motion_track *law = path->distance;
    const struct motion_real length = path->table->length;
    const struct motion_real off =
        motion_real_abs(motion_real_sub(motion_bake_end(law), length));

    if (law->count == 0)
        return MOTION_E_EMPTY;
    if (law->segment[0].pos_q32 != 0 || law->segment[0].coef[0] != 0 ||
        motion_real_lt(motion_real_add(motion_real_from_q(1, 30),
                                       motion_real_scale(length, -48)),
                       off))
        return MOTION_E_ARG;
    return motion_speed_check(law);
}

/* By halving. */
static int64_t path_time(const struct motion_track *law, struct motion_real s)
{
    int64_t low = 0, high = law->end_ns_q12;

    while (high - low > 1) {
        const int64_t middle = low + (high - low) / 2;
        if (motion_real_lt(
                motion_bake_track(law, middle, MOTION_BAKE_RIGHT).pos, s))
            low = middle;
        else
            high = middle;
    }
    return high;
}

/* The law is there, to 2^-32 unit: where it comes to rest it is so long
 * before. */
static bool path_is_at(const struct motion_track *law, int64_t t,
                       struct motion_real s)
{
    const struct motion_real off =
        motion_real_sub(motion_bake_track(law, t, MOTION_BAKE_RIGHT).pos, s);

    return motion_real_lt(motion_real_abs(off), motion_real_from_q(1, 32));
}

int64_t motion_path_when(const struct motion_track *law, struct motion_real s)
{
    const int64_t t = path_time(law, s);
    const struct motion_segment *segment =
        motion_bake_find(law, t, MOTION_BAKE_RIGHT);
    const int64_t end = segment->start_ns_q12 + segment->dur_ns_q12;

    if (t - segment->start_ns_q12 <= 4 ||
        path_is_at(law, segment->start_ns_q12, s))
        return segment->start_ns_q12;
    return end - t <= 4 || path_is_at(law, end, s) ? end : t;
}

static void path_merge(struct motion_path *path)
{
    const struct motion_track *law = path->distance;
    const uint32_t pieces = path->table->curve->pieces;
    uint32_t i = 0, k = 0;

    path->borders = 0;
    while (i < law->count || k <= pieces) {
        const int64_t a =
            i < law->count ? law->segment[i].start_ns_q12 : INT64_MAX;
        const int64_t b = k <= pieces ? path->knot_ns_q12[k] : INT64_MAX;
        const int64_t t = a < b ? a : b;

        i += a <= b;
        k += b <= a;
        if (path->borders == 0 || path->border_ns_q12[path->borders - 1] < t)
            path->border_ns_q12[path->borders++] = t;
    }
}

int motion_path_init(struct motion_path *path,
                     const struct motion_arclen_table *table,
                     const struct motion_track *distance,
                     int64_t knot_storage_ns_q12[],
                     int64_t border_storage_ns_q12[])
{
    const uint32_t pieces = table->curve->pieces;
    int err;

    *path = (struct motion_path){ table,
                                  distance,
                                  knot_storage_ns_q12,
                                  border_storage_ns_q12,
                                  0,
                                  motion_real_zero(),
                                  0,
                                  0 };
    err = path_check(path);
    if (err < 0)
        return err;
    path->knot_ns_q12[0] = 0;
    for (uint32_t k = 1; k < pieces; k++)
        path->knot_ns_q12[k] =
            motion_path_when(distance, motion_arclen_border(table, k));
    path->knot_ns_q12[pieces] = distance->end_ns_q12;
    path_merge(path);
    return MOTION_OK;
}

/* --- the drive ------------------------------------------------------------ */

/* A source for motion_bake; the context is a motion_path. */
static int motion_path_at(void *context, int64_t t_ns_q12,
                          enum motion_bake_side side,
                          struct motion_bake_point point[])
{
    struct motion_path *path = context;
    const struct motion_arclen_curve *curve = path->table->curve;
    const struct motion_bake_point s =
        motion_bake_track(path->distance, t_ns_q12, side);
    const struct motion_real square = motion_real_sqr(s.vel);
    struct motion_arclen_place place;
    struct motion_arclen_point by;

    path->last_ns_q12 = t_ns_q12;
    motion_arclen_find_in(
        path->table,
        motion_bake_span(path->knot_ns_q12, curve->pieces, t_ns_q12, side),
        s.pos, &place);
    motion_arclen_by_length(curve, place.piece, place.x, &by);
    for (uint32_t i = 0; i < curve->axes; i++) {
        point[i].pos = by.pos[i];
        point[i].vel = motion_real_mul(by.d1[i], s.vel);
        point[i].acc = motion_real_add(motion_real_mul(by.d2[i], square),
                                       motion_real_mul(by.d1[i], s.acc));
    }
    return MOTION_OK;
}

int motion_path_bake(struct motion_path *path,
                     const struct motion_path_tolerance *tolerance,
                     struct motion_track *track[],
                     struct motion_bake_report *report)
{
    const struct motion_bake job = {
        .source = { motion_path_at, path },
        .axes = path->table->curve->axes,
        .border_ns_q12 = path->border_ns_q12,
        .borders = path->borders,
        .pos = tolerance->pos,
        .vel = tolerance->vel,
        .acc = tolerance->acc,
        .evaluations = path->evaluations,
    };
    const struct motion_real more =
        motion_real_add(path->table->error, path->law_error);
    int err = motion_bake(&job, track, report);

    for (uint32_t i = 0; i < job.axes && report && err == MOTION_OK; i++)
        report->bound[i].pos = motion_real_add(report->bound[i].pos, more);
    return err;
}

/* --- curves made of tracks ------------------------------------------------ */

/* Powers of x, in seconds: c / dur^k. */
static void path_tracks_piece(const struct motion_segment *segment,
                              struct motion_real coef[MOTION_TRACK_DEGREE + 1])
{
    const struct motion_real dur_s = motion_bake_seconds(segment->dur_ns_q12);
    struct motion_real scale = motion_real_int(1);

    motion_bake_coefficients(segment, coef);
    for (int k = 1; k <= MOTION_TRACK_DEGREE; k++) {
        scale = motion_real_mul(scale, dur_s);
        coef[k] = motion_real_div(coef[k], scale);
    }
}

static void path_tracks_poly(struct motion_path_tracks *tracks)
{
    struct motion_real *coef = tracks->coef;

    for (uint32_t k = 0; k < tracks->track[0]->count; k++)
        for (uint32_t i = 0; i < tracks->axes; i++) {
            path_tracks_piece(&tracks->track[i]->segment[k], coef);
            coef += MOTION_TRACK_DEGREE + 1;
        }
    tracks->poly =
        (struct motion_arclen_poly){ tracks->coef, MOTION_TRACK_DEGREE,
                                     tracks->axes };
}

int motion_path_from_tracks(struct motion_arclen_curve *curve,
                            struct motion_path_tracks *tracks,
                            struct motion_real border[])
{
    const struct motion_track *first;

    if (tracks->axes < 1 || tracks->axes > MOTION_ARCLEN_AXES)
        return MOTION_E_ARG;
    first = tracks->track[0];
    if (first->count == 0)
        return MOTION_E_EMPTY;
    for (uint32_t i = 1; i < tracks->axes; i++) {
        const struct motion_track *other = tracks->track[i];
        if (other->count != first->count ||
            other->end_ns_q12 != first->end_ns_q12)
            return MOTION_E_ARG;
        for (uint32_t k = 0; k < first->count; k++) {
            if (other->segment[k].start_ns_q12 !=
                first->segment[k].start_ns_q12)
                return MOTION_E_ARG;
        }
    }
    for (uint32_t k = 0; k < first->count; k++)
        border[k] = motion_bake_seconds(first->segment[k].start_ns_q12);
    border[first->count] = motion_bake_seconds(first->end_ns_q12);
    path_tracks_poly(tracks);
    *curve =
        (struct motion_arclen_curve){ tracks->axes, first->count, border,
                                      motion_arclen_poly_at, &tracks->poly };
    return MOTION_OK;
}

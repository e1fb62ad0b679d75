/* firmware/control/couple_judge.c - is a follower's track on its curve, from the
 * start of a move to its end?  See couple.h.
 *
 * Where neither track comes to the end of a segment, and the master not to that of
 * one of the curve, g(t) = f(t) - C(m(t)) is a polynomial of degree n, which is the
 * larger of that of f and those of C and m multiplied: 25 at most.  It is read at N > n
 * places, the zeros of Chebyshev's polynomial of degree N, and is nowhere larger than
 *
 *     |g| <= max |g(t_k)| / cos(n pi / 2N)
 *
 * for g(cos x) is a trigonometric polynomial of degree n, which next to its largest
 * value falls no faster than cos(n x) (M. Riesz), and the next place is pi / 2N away at
 * most.  With N = 8 for n <= 5, as of a gear, that is 1.80; with N = 32, 2.97.
 *
 * The master is at the end of a segment of the curve nowhere in a stretch where it is
 * further from there in its middle than half of the stretch takes at its highest speed.
 * A stretch that may have such a place is halved, down to 1 ns, of which only the
 * middle counts: in that an axis goes nowhere. */
#include <stddef.h>

#include "firmware/control/couple.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define JUDGE_FEW   8  /* places for a degree up to 5, */
#define JUDGE_MANY  32 /* and up to 25 */
#define JUDGE_SHORT MOTION_FIXED_NS_Q12

/* (1 - cos((2k + 1) pi / 2N)) / 2 of the first half, Q32. */
static const uint32_t judge_few[JUDGE_FEW / 2] = { 41263296, 361916252,
                                                   954405657, 1728530372 };
static const uint32_t judge_many[JUDGE_MANY / 2] = {
    2586738,    23243268,   64357394,   125533164,  206181423,  305525484,
    422608608,  556303222,  705321774,  868229132,  1043456411, 1229316076,
    1424018197, 1625687685, 1832382353, 2042111620,
};

struct judge {
    const struct controller_cam *cam;
    const struct motion_track *own, *master;
    struct motion_cursor at[3]; /* of own, master and curve */
    int64_t vel_q32;            /* the master's highest in this segment */
    int degree[2];              /* of own and master there */
    uint64_t worst;             /* |g| */
    struct controller_couple_off *off;
};

/* |g| at one time. */
static uint64_t judge_at(struct judge *judge, int64_t t_ns_q12)
{
    struct motion_sample own, master, curve;
    int64_t off_q32 = INT64_MAX;
    motion_track_sample(judge->own, &judge->at[0], t_ns_q12, &own);
    motion_track_sample(judge->master, &judge->at[1], t_ns_q12, &master);
    controller_cam_at(judge->cam, &judge->at[2], master.pos_q32, &curve);
    (void)motion_fixed_sub(own.pos_q32, curve.pos_q32, &off_q32);
    const uint64_t size = motion_fixed_abs(off_q32);
    if (size > judge->worst) {
        judge->worst = size;
        *judge->off =
            (struct controller_couple_off){ t_ns_q12, off_q32, master.pos_q32 };
    }
    return size;
}

/* The segment of the curve that the master is in all of a stretch, from how far it
 * gets from where it is in the middle; NULL: it may leave it. */
static const struct motion_segment *judge_segment(const struct judge *judge,
                                                  int64_t mid_ns_q12,
                                                  int64_t half_ns_q12)
{
    const struct controller_cam *cam = judge->cam;
    const struct motion_segment *segment =
        &cam->track->segment[judge->at[2].index];
    struct motion_cursor cursor = judge->at[1];
    struct motion_sample master;
    const int64_t reach_q32 =
        motion_fixed_muldiv_sat(judge->vel_q32, half_ns_q12,
                                MOTION_FIXED_S_Q12) +
        MOTION_TRACK_POS_ROUNDING;
    if (cam->track->count == 1)
        return segment;
    motion_track_sample(judge->master, &cursor, mid_ns_q12, &master);
    return reach_q32 < INT64_MAX / 2 &&
                   controller_cam_ns_q12(cam, master.pos_q32 - reach_q32) >=
                       segment->start_ns_q12 &&
                   controller_cam_ns_q12(cam, master.pos_q32 + reach_q32) <=
                       segment->start_ns_q12 + segment->dur_ns_q12
               ? segment
               : NULL;
}

/* The bound of |g| over a stretch of both segments into *most; false: it is to be
 * halved. */
static bool judge_stretch(struct judge *judge, int64_t t_ns_q12,
                          int64_t dur_ns_q12, uint64_t *most)
{
    const int64_t half_ns_q12 = dur_ns_q12 / 2;
    *most = judge_at(judge, t_ns_q12 + half_ns_q12);
    if (dur_ns_q12 <= JUDGE_SHORT)
        return true;
    const struct motion_segment *segment =
        judge_segment(judge, t_ns_q12 + half_ns_q12, half_ns_q12);
    if (segment == NULL)
        return false;
    const bool few =
        judge->degree[0] <= 5 && segment->degree * judge->degree[1] <= 5;
    const unsigned half = (few ? JUDGE_FEW : JUDGE_MANY) / 2;
    for (unsigned k = 0; k < half; k++) {
        int64_t by_ns_q12;
        (void)motion_fixed_mulshift(
            dur_ns_q12, few ? judge_few[k] : judge_many[k], 32, &by_ns_q12);
        const uint64_t a = judge_at(judge, t_ns_q12 + by_ns_q12);
        const uint64_t b = judge_at(judge, t_ns_q12 + dur_ns_q12 - by_ns_q12);
        *most = a > *most ? a : *most;
        *most = b > *most ? b : *most;
    }
    *most *= few ? 2 : 3; /* more than 1.80 and 2.97 */
    return true;
}

/* Where a track comes to the end of its segment `index`; after the last it stands. */
static int64_t judge_end(const struct motion_track *track, uint32_t index)
{
    const struct motion_segment *segment = &track->segment[index];
    return index < track->count ? segment->start_ns_q12 + segment->dur_ns_q12
                                : INT64_MAX;
}

static int judge_degree(const struct motion_track *track, uint32_t index)
{
    return index < track->count ? track->segment[index].degree : 0;
}

static int64_t judge_speed(const struct motion_track *track, uint32_t index)
{
    struct motion_extreme vel = { 0 };
    if (index < track->count)
        motion_segment_extreme(&track->segment[index], MOTION_VEL, &vel);
    return vel.max > -vel.min ? vel.max : -vel.min;
}

/* From t to where one of both is at the end of its segment.  False: it is off. */
static bool judge_segments(struct judge *judge, int64_t t_ns_q12,
                           int64_t end_ns_q12, uint64_t window)
{
    bool is_kept = true;
    for (int64_t dur_ns_q12 = end_ns_q12 - t_ns_q12; t_ns_q12 < end_ns_q12;) {
        uint64_t most;
        if (!judge_stretch(judge, t_ns_q12, dur_ns_q12, &most)) {
            dur_ns_q12 /= 2;
            continue;
        }
        is_kept = is_kept && most <= window;
        t_ns_q12 += dur_ns_q12;
        dur_ns_q12 *= 2;
        if (dur_ns_q12 > end_ns_q12 - t_ns_q12)
            dur_ns_q12 = end_ns_q12 - t_ns_q12;
    }
    return is_kept;
}

/* False: the master leaves the curve, there. */
static bool judge_range(const struct controller_cam *cam,
                        const struct motion_track *master,
                        struct controller_couple_off *off)
{
    struct motion_extreme pos;
    motion_track_extreme(master, MOTION_POS, &pos);
    *off = (struct controller_couple_off){ pos.max_ns_q12, 0, pos.max };
    if (pos.max > cam->high_q32 + MOTION_TRACK_POS_ROUNDING)
        return false;
    *off = (struct controller_couple_off){ pos.min_ns_q12, 0, pos.min };
    return pos.min >= cam->low_q32 - MOTION_TRACK_POS_ROUNDING;
}

bool controller_couple_judge(const struct controller_cam *cam,
                             const struct motion_track *own,
                             const struct motion_track *master,
                             struct controller_couple_off *off)
{
    struct judge judge = {
        .cam = cam, .own = own, .master = master, .off = off
    };
    const int64_t end_ns_q12 = own->end_ns_q12 > master->end_ns_q12
                                   ? own->end_ns_q12
                                   : master->end_ns_q12;
    int64_t t_ns_q12 = 0;
    if (!judge_range(cam, master, off))
        return false;
    const uint64_t window = (uint64_t)cam->window_q32;
    bool is_kept = judge_at(&judge, 0) <= window;
    for (uint32_t i = 0, k = 0; t_ns_q12 < end_ns_q12;) {
        const int64_t own_ns_q12 = judge_end(own, i);
        const int64_t master_ns_q12 = judge_end(master, k);
        const int64_t to_ns_q12 =
            own_ns_q12 < master_ns_q12 ? own_ns_q12 : master_ns_q12;
        judge.degree[0] = judge_degree(own, i);
        judge.degree[1] = judge_degree(master, k);
        judge.vel_q32 = judge_speed(master, k);
        if (!judge_segments(&judge, t_ns_q12, to_ns_q12, window))
            is_kept = false;
        t_ns_q12 = to_ns_q12;
        i += own_ns_q12 == to_ns_q12;
        k += master_ns_q12 == to_ns_q12;
    }
    return is_kept;
}

/* motion/core/clock_walk.c - see clock_walk.h. */
#include "motion/core/clock_walk.h"

#include "motion/core/clock_anchor.h"
#include "motion/core/clock_warp_internal.h"

/* To find a border of segments between two looks: 16 ms to the nanosecond. */
#define CLOCK_HALVINGS 24
/* What a border counts as: two states of the track and the halvings. */
#define CLOCK_LOOKS_BORDER 5
/* Bounds are tried for so many steps first, for no longer than this, and where they have failed so often
 * in a row, at every so many looks alone. */
#define CLOCK_STRIDE    16
#define CLOCK_STRIDE_NS INT64_C(1000000000)
#define CLOCK_PAUSE     4

static bool clock_walk_within(int64_t value, int64_t rounding, int64_t limit)
{
    const uint64_t most =
        (uint64_t)limit + (uint64_t)(limit >> 28) + (uint64_t)rounding;
    return motion_fixed_abs(value) <= most;
}

/* What rounding leaves of p'' and p''': r, r' and r'' are within 2 units of
 * 2^-30, f', f'' and f''' within one of theirs. */
static int64_t clock_walk_rounding(const struct motion_state *track)
{
    return 4 + (int64_t)((motion_fixed_abs(track->vel_q32) +
                          motion_fixed_abs(track->acc_q32)) >>
                         28);
}

static bool clock_walk_keeps(const struct motion_clock_limit *limit,
                             const struct motion_clock_rate *now,
                             const struct motion_state *track,
                             struct motion_state *axis)
{
    motion_clock_warp_chain(now, track, axis);
    const int64_t rounding = clock_walk_rounding(track);
    return clock_walk_within(axis->vel_q32, 4, limit->vel_q32) &&
           clock_walk_within(axis->acc_q32, rounding, limit->acc_q32) &&
           (limit->jerk_q32 == 0 ||
            clock_walk_within(axis->jerk_q32, rounding, limit->jerk_q32));
}

static int64_t clock_walk_end(const struct motion_segment *segment)
{
    return segment->start_ns_q12 + segment->dur_ns_q12;
}

/* Index of the segment that holds path time s; count at and after the end. */
static uint32_t clock_walk_segment(const struct motion_track *track, int64_t s)
{
    uint32_t low = 0, high = track->count;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        const struct motion_segment *segment = &track->segment[middle];
        if (s < segment->start_ns_q12 + segment->dur_ns_q12)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

/* The same, where it is no earlier one than `from`, and mostly that. */
static uint32_t clock_walk_segment_from(const struct motion_track *track,
                                        uint32_t from, int64_t s)
{
    if (from >= track->count || s < clock_walk_end(&track->segment[from]))
        return from;
    return clock_walk_segment(track, s);
}

/* One time of the clock. */
struct clock_time {
    int64_t dt; /* since the ramp began */
    struct motion_clock_rate rate;
};

/* When the clock comes to path time s between two times with one piece of the
 * ramp between them, to the nanosecond: a segment may be that short. */
static struct clock_time clock_walk_when(const struct motion_clock_warp *warp,
                                         const struct clock_time *from,
                                         const struct clock_time *to, int64_t s)
{
    struct clock_time when = *to;
    int64_t low = from->dt;
    for (int i = 0; i < CLOCK_HALVINGS && when.dt - low > 1; i++) {
        const int64_t dt = low + (when.dt - low) / 2;
        struct motion_clock_rate rate;
        motion_clock_warp_at(warp, warp->t0_ns + dt, &rate);
        if (rate.s_ns_q12 < s)
            low = dt;
        else
            when = (struct clock_time){ dt, rate };
    }
    return when;
}

/* At both sides of the borders of segments between two looks. */
static bool clock_walk_borders(const struct motion_clock_walk *walk,
                               uint32_t to, const struct clock_time *before,
                               const struct clock_time *after)
{
    struct clock_time here = *before;
    for (uint32_t i = walk->index; i < to; i++) {
        const struct motion_segment *segment = &walk->track->segment[i];
        struct motion_state left, right, axis;
        here =
            clock_walk_when(walk->warp, &here, after, clock_walk_end(segment));
        motion_segment_state(segment, segment->dur_ns_q12, &left);
        motion_track_state(walk->track, clock_walk_end(segment), &right);
        if (!clock_walk_keeps(walk->limit, &here.rate, &left, &axis) ||
            !clock_walk_keeps(walk->limit, &here.rate, &right, &axis))
            return false;
    }
    return true;
}

/* So far from dt, or to the end of the piece of the ramp. */
static int64_t clock_walk_ahead(const struct motion_clock_warp *warp,
                                int64_t dt, int64_t ns)
{
    int64_t end = 0;
    for (unsigned i = 0; i < warp->count; i++) {
        end += warp->piece[i].dur_ns;
        if (dt < end)
            return end - dt > ns ? dt + ns : end;
    }
    return dt + ns;
}

/* Do bounds reach so many steps on?  That is where the next look is then. */
static bool clock_walk_reaches(struct motion_clock_walk *walk,
                               const struct clock_place *place,
                               const struct motion_state *axis, int64_t steps)
{
    walk->next_ns =
        clock_walk_ahead(walk->warp, walk->at_ns, steps * walk->step_ns);
    walk->next_is_bounded = clock_anchor_stays(
        place, &walk->rate, axis, walk->limit, walk->next_ns - walk->at_ns);
    return walk->next_is_bounded;
}

/* The next look: as many steps on as bounds reached the last time, or a quarter
 * of that, and so on; twice as many where they reached at once; where they reach
 * over none, a step on. */
static void clock_walk_stride(struct motion_clock_walk *walk,
                              const struct clock_place *place,
                              const struct motion_state *axis)
{
    int64_t steps = walk->stride;
    walk->next_ns = clock_walk_ahead(walk->warp, walk->at_ns, walk->step_ns);
    walk->next_is_bounded = false;
    if (walk->pause > 0) {
        walk->pause--;
        return;
    }
    while (!clock_walk_reaches(walk, place, axis, steps)) {
        if (steps == 1) {
            walk->failed += walk->failed < CLOCK_PAUSE ? 1 : 0;
            walk->pause = walk->failed;
            walk->stride = 1;
            return;
        }
        steps = steps < 4 ? 1 : steps / 4;
    }
    if (steps == walk->stride && walk->step_ns * steps < CLOCK_STRIDE_NS)
        steps *= 2;
    walk->stride = steps;
    walk->failed = 0;
}

void motion_clock_walk_begin(struct motion_clock_walk *walk,
                             const struct motion_clock_warp *warp,
                             const struct motion_track *track,
                             const struct motion_clock_limit *limit,
                             int64_t step_ns)
{
    *walk = (struct motion_clock_walk){
        .warp = warp,
        .track = track,
        .limit = limit,
        .step_ns = step_ns,
        .at_ns = -1,
        .stride = CLOCK_STRIDE,
    };
    motion_clock_warp_at(warp, warp->t0_ns, &walk->rate);
    walk->index = clock_walk_segment(track, walk->rate.s_ns_q12);
}

/* At one time, and just before it where r'' jumps there. */
static bool clock_walk_looks(struct motion_clock_walk *walk,
                             const struct motion_clock_rate *left)
{
    const bool is_end = walk->at_ns >= walk->warp->dur_ns;
    const struct motion_clock_rate *now =
        walk->is_open && is_end ? left : &walk->rate;
    struct clock_place place;
    struct motion_state axis;
    if (motion_track_ahead(walk->track, now->s_ns_q12) <= 0)
        return false;
    clock_anchor_place(&walk->anchor, walk->track, walk->index, now->s_ns_q12,
                       &place);
    if ((left->jerk_q30 != now->jerk_q30 &&
         !clock_walk_keeps(walk->limit, left, &place.state, &axis)) ||
        !clock_walk_keeps(walk->limit, now, &place.state, &axis))
        return false;
    if (!is_end)
        clock_walk_stride(walk, &place, &axis);
    return true;
}

int motion_clock_walk_next(struct motion_clock_walk *walk, int64_t *looks)
{
    const struct clock_time last = { walk->at_ns, walk->rate };
    struct clock_time now = { walk->next_ns, { 0 } };
    if (walk->at_ns >= walk->warp->dur_ns)
        return 0;
    motion_clock_warp_at(walk->warp, walk->warp->t0_ns + now.dt, &now.rate);
    walk->before_ns = walk->at_ns;
    walk->at_ns = now.dt;
    walk->is_bounded = walk->next_is_bounded;
    struct clock_time left = now;
    if (walk->is_open && now.dt > 0)
        motion_clock_warp_at(walk->warp, walk->warp->t0_ns + now.dt - 1,
                             &left.rate);
    left.rate.jerk_q30 = last.rate.jerk_q30; /* of the piece in between */
    const uint32_t here =
        clock_walk_segment_from(walk->track, walk->index, now.rate.s_ns_q12);
    *looks -= 1 + CLOCK_LOOKS_BORDER * (int64_t)(here - walk->index);
    if (*looks < 0 ||
        (here > walk->index && !clock_walk_borders(walk, here, &last, &left)))
        return MOTION_E_LIMIT;
    walk->index = here;
    walk->rate = now.rate;
    return clock_walk_looks(walk, &left.rate) ? 1 : MOTION_E_LIMIT;
}

bool motion_clock_warp_fits(const struct motion_clock_warp *warp,
                            const struct motion_track *track,
                            const struct motion_clock_limit *limit,
                            int64_t step_ns, int64_t *looks)
{
    struct motion_clock_walk walk;
    int more;
    motion_clock_walk_begin(&walk, warp, track, limit, step_ns);
    do
        more = motion_clock_walk_next(&walk, looks);
    while (more > 0);
    return more == 0;
}

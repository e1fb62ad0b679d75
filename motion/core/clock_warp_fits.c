/* motion/core/clock_warp_fits.c - does a ramp keep an axis inside its limits?
 * See clock_warp.h. */
#include "motion/core/clock_warp_internal.h"
#include "motion/core/track_internal.h"

/* To find a border of segments between two looks: 16 ms to the nanosecond. */
#define CLOCK_HALVINGS 24
/* What a border counts as: two states of the track and the halvings. */
#define CLOCK_LOOKS_BORDER 5

static bool clock_warp_within(int64_t value, int64_t more, int64_t rounding,
                              int64_t limit)
{
    const uint64_t most =
        (uint64_t)limit + (uint64_t)(limit >> 28) + (uint64_t)rounding;
    const uint64_t size = motion_fixed_abs(value);
    return size <= most && (uint64_t)more <= most - size;
}

static int64_t clock_warp_size(int64_t value)
{
    return value < -INT64_MAX ? INT64_MAX : value < 0 ? -value : value;
}

/* Where the track was evaluated in full, and then its two derivatives more. */
struct clock_anchor {
    bool is_set, is_whole;
    uint32_t index; /* of the segment */
    int64_t s_ns_q12;
    struct motion_state state;
    int64_t fourth_q32, fifth_q32;
};

/* What is looked for along a ramp. */
struct clock_look {
    struct clock_anchor anchor;
    const struct motion_clock_limit *limit;
    bool between; /* looks count too */
    /* half the time from the look before to this one, and to the next one */
    int64_t from_s_q30, to_s_q30;
    bool is_smooth; /* p''' went on from this without a jump: */
    int64_t last_q32;
};

/* What rounding leaves of p'' and p''': r, r' and r'' are within 2 units of
 * 2^-30, f', f'' and f''' within one of theirs. */
static int64_t clock_warp_rounding(const struct motion_state *track)
{
    return 4 + (int64_t)((motion_fixed_abs(track->vel_q32) +
                          motion_fixed_abs(track->acc_q32)) >>
                         28);
}

/* What |p'| may gain, Q32, before it falls again within the step: where p'' has
 * changed its sign by the next look, at most |p''| step / 2.  Where p'' is too
 * large for that, the next look sees the most. */
static int64_t clock_warp_vel_more(const struct clock_look *look,
                                   const struct motion_state *axis,
                                   int64_t rounding, int64_t acc_more)
{
    const int64_t acc = clock_warp_size(axis->acc_q32);
    if ((axis->vel_q32 < 0) != (axis->acc_q32 < 0) || acc <= rounding ||
        acc / 4 > acc_more)
        return 0;
    return clock_warp_mul(acc, look->to_s_q30, 30);
}

/* Where p''' turns round between two looks, it goes beyond the larger of them
 * by an eighth of its second difference at most (a parabola), and the look
 * beside, from where it came, is at least half of that away: so by a quarter of
 * what it changed by up to there. */
static bool clock_warp_keeps_jerk(struct clock_look *look, int64_t rounding,
                                  int64_t jerk_q32)
{
    const int64_t size = clock_warp_size(jerk_q32);
    int64_t most = size, more = 0;
    if (look->between && look->is_smooth) {
        const int64_t last = clock_warp_size(look->last_q32);
        most = size > last ? size : last;
        more = clock_warp_size(clock_warp_sub(jerk_q32, look->last_q32)) / 4;
    }
    look->is_smooth = true;
    look->last_q32 = jerk_q32;
    return look->limit->jerk_q32 == 0 ||
           clock_warp_within(most, more, rounding, look->limit->jerk_q32);
}

static bool clock_warp_keeps(struct clock_look *look,
                             const struct motion_clock_rate *now,
                             const struct motion_state *track)
{
    const struct motion_clock_limit *limit = look->limit;
    struct motion_state axis;
    motion_clock_warp_chain(now, track, &axis);
    const int64_t jerk = clock_warp_size(axis.jerk_q32);
    const int64_t to = clock_warp_mul(jerk, look->to_s_q30, 30);
    const int64_t from = clock_warp_mul(jerk, look->from_s_q30, 30);
    /* |p''| grows onwards, or backwards */
    const int64_t acc_more =
        (axis.acc_q32 < 0) == (axis.jerk_q32 < 0) ? to : from;
    const int64_t rounding = clock_warp_rounding(track);
    const int64_t vel_more = clock_warp_vel_more(look, &axis, rounding, to);
    return clock_warp_within(axis.vel_q32, vel_more, 4, limit->vel_q32) &&
           clock_warp_within(axis.acc_q32, acc_more, rounding,
                             limit->acc_q32) &&
           clock_warp_keeps_jerk(look, rounding, axis.jerk_q32);
}

/* Index of the segment that holds path time s; count at and after the end. */
static uint32_t clock_warp_segment(const struct motion_track *track, int64_t s)
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

/* The highest derivatives, once a segment is looked at for a second time; true
 * where none is beyond its format. */
static bool clock_anchor_complete(struct clock_anchor *anchor,
                                  const struct motion_segment *segment)
{
    const int64_t dt = anchor->s_ns_q12 - segment->start_ns_q12;
    if (!anchor->is_whole && segment->degree > 3) {
        anchor->fourth_q32 = track_segment_derivative(segment, 4, dt);
        anchor->fifth_q32 = track_segment_derivative(segment, 5, dt);
    }
    anchor->is_whole = true;
    return clock_warp_size(anchor->state.jerk_q32) < INT64_MAX &&
           clock_warp_size(anchor->fourth_q32) < INT64_MAX &&
           clock_warp_size(anchor->fifth_q32) < INT64_MAX;
}

/* Taylor's series after t seconds, Q50. */
static void clock_anchor_ahead(const struct clock_anchor *anchor, int64_t t,
                               struct motion_state *state)
{
    const int64_t third = INT64_C(1537228672809129301); /* 2^62 / 3 */
    const int64_t fourth = anchor->fourth_q32;
    const int64_t p = clock_warp_mul(anchor->fifth_q32, t, 50) / 2;
    const int64_t p3 = clock_warp_mul(p, third, 62);
    const int64_t fourth3 = clock_warp_mul(fourth, third, 62);
    *state = anchor->state;
    const int64_t jerk = state->jerk_q32;
    const int64_t to_jerk = clock_warp_mul(clock_warp_add(fourth, p), t, 50);
    const int64_t to_acc =
        clock_warp_mul(clock_warp_add(fourth / 2, p3), t, 50);
    const int64_t to_vel =
        clock_warp_mul(clock_warp_add(fourth3 / 2, p3 / 4), t, 50);
    const int64_t acc = clock_warp_mul(clock_warp_add(jerk, to_acc), t, 50);
    const int64_t mean =
        clock_warp_mul(clock_warp_add(jerk / 2, to_vel), t, 50);
    state->vel_q32 = clock_warp_add(
        state->vel_q32,
        clock_warp_mul(clock_warp_add(state->acc_q32, mean), t, 50));
    state->acc_q32 = clock_warp_add(state->acc_q32, acc);
    state->jerk_q32 = clock_warp_add(jerk, to_jerk);
}

/* From an anchor on the same segment, up to a second before, the state follows
 * by Taylor's series in a tenth of the work: half a unit in each derivative of
 * the anchor makes at most e/2 units in f', rounding of the sums as much
 * again. */
static void clock_warp_state(struct clock_look *look,
                             const struct motion_track *track, uint32_t index,
                             int64_t s, struct motion_state *state)
{
    struct clock_anchor *anchor = &look->anchor;
    const int64_t dt = s - anchor->s_ns_q12;
    if (anchor->is_set && anchor->index == index && dt >= 0 &&
        dt <= MOTION_FIXED_S_Q12 &&
        clock_anchor_complete(anchor, &track->segment[index])) {
        /* 2^50 / S_Q12, times 2^54 */
        const int64_t t = clock_warp_mul(dt, INT64_C(4951760157141521100), 54);
        clock_anchor_ahead(anchor, t, state);
        return;
    }
    motion_track_state(track, s, state);
    *anchor = (struct clock_anchor){
        .is_set = index < track->count && s >= 0, /* else it is at rest */
        .index = index,
        .s_ns_q12 = s,
        .state = *state,
    };
}

/* Half of the time in seconds, Q30, where it counts; 2^30 / 1e9 in Q30, rounded
 * up. */
static int64_t clock_warp_half(const struct clock_look *look, int64_t ns)
{
    return look->between ? clock_warp_mul(ns / 2 + 1, INT64_C(1152921505), 30)
                         : 0;
}

/* One time of the clock. */
struct clock_time {
    int64_t dt; /* since the ramp began */
    struct motion_clock_rate rate;
};

/* When the clock comes to path time s between two times with one piece of the
 * ramp between them, to the nanosecond: a segment may be that short. */
static struct clock_time clock_warp_when(const struct motion_clock_warp *warp,
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

static int64_t clock_warp_end(const struct motion_segment *segment)
{
    return segment->start_ns_q12 + segment->dur_ns_q12;
}

/* Both sides of a border are looks of their own, each with the time to the one
 * beside it: a short and steep segment lasts no longer than it does. */
static bool clock_warp_borders(struct clock_look *look,
                               const struct motion_clock_warp *warp,
                               const struct motion_track *track, uint32_t from,
                               uint32_t to, const struct clock_time *before,
                               const struct clock_time *after)
{
    struct clock_time last = *before, here = *before, next;
    for (uint32_t i = from; i < to; i++) {
        const struct motion_segment *segment = &track->segment[i];
        struct motion_state left, right;
        if (i == from)
            here =
                clock_warp_when(warp, before, after, clock_warp_end(segment));
        next = *after;
        if (i + 1 < to)
            next = clock_warp_when(warp, &here, after,
                                   clock_warp_end(segment + 1));
        motion_segment_state(segment, segment->dur_ns_q12, &left);
        motion_track_state(track, clock_warp_end(segment), &right);
        look->from_s_q30 = clock_warp_half(look, here.dt - last.dt);
        look->to_s_q30 = 0;
        if (!clock_warp_keeps(look, &here.rate, &left))
            return false;
        look->is_smooth = false;
        look->from_s_q30 = 0;
        look->to_s_q30 = clock_warp_half(look, next.dt - here.dt);
        if (!clock_warp_keeps(look, &here.rate, &right))
            return false;
        last = here;
        here = next;
    }
    look->from_s_q30 = clock_warp_half(look, after->dt - last.dt);
    return true;
}

/* The next look after dt: a step on, or where a piece ends. */
static int64_t clock_warp_next(const struct motion_clock_warp *warp, int64_t dt,
                               int64_t step_ns)
{
    int64_t end = 0;
    for (unsigned i = 0; i < warp->count; i++) {
        end += warp->piece[i].dur_ns;
        if (dt < end)
            return end - dt > step_ns ? dt + step_ns : end;
    }
    return dt + step_ns;
}

/* At one time, and just before it where r'' jumps there. */
static bool clock_warp_looks(struct clock_look *look,
                             const struct motion_track *track, uint32_t index,
                             const struct motion_clock_rate *last,
                             const struct motion_clock_rate *now)
{
    struct motion_state state;
    if (motion_track_ahead(track, now->s_ns_q12) <= 0)
        return false;
    clock_warp_state(look, track, index, now->s_ns_q12, &state);
    struct motion_clock_rate left = *now;
    left.jerk_q30 = last->jerk_q30;
    if (left.jerk_q30 != now->jerk_q30) {
        const int64_t to_s_q30 = look->to_s_q30;
        look->to_s_q30 = 0;
        if (!clock_warp_keeps(look, &left, &state))
            return false;
        look->is_smooth = false;
        look->from_s_q30 = 0;
        look->to_s_q30 = to_s_q30;
    }
    return clock_warp_keeps(look, now, &state);
}

bool motion_clock_warp_fits(const struct motion_clock_warp *warp,
                            const struct motion_track *track,
                            const struct motion_clock_limit *limit,
                            int64_t step_ns, bool between, int64_t *looks)
{
    struct clock_look look = { .limit = limit, .between = between };
    struct clock_time now, last = { 0 };
    int64_t next;
    motion_clock_warp_at(warp, warp->t0_ns, &last.rate);
    uint32_t index = clock_warp_segment(track, last.rate.s_ns_q12);
    for (now.dt = 0; now.dt <= warp->dur_ns; now.dt = next) {
        motion_clock_warp_at(warp, warp->t0_ns + now.dt, &now.rate);
        const uint32_t here = clock_warp_segment(track, now.rate.s_ns_q12);
        struct clock_time left = now;
        left.rate.jerk_q30 = last.rate.jerk_q30; /* of the piece in between */
        next = clock_warp_next(warp, now.dt, step_ns);
        look.from_s_q30 = look.to_s_q30;
        *looks -= 1 + CLOCK_LOOKS_BORDER * (int64_t)(here - index);
        if (*looks < 0 ||
            (here > index && !clock_warp_borders(&look, warp, track, index,
                                                 here, &last, &left)))
            return false;
        look.to_s_q30 =
            next <= warp->dur_ns ? clock_warp_half(&look, next - now.dt) : 0;
        if (!clock_warp_looks(&look, track, here, &last.rate, &now.rate))
            return false;
        index = here;
        last = now;
    }
    return true;
}

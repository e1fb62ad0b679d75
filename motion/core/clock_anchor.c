/* motion/core/clock_anchor.c - see clock_anchor.h. */
#include "motion/core/clock_anchor.h"

#include "motion/core/clock_warp_internal.h"
#include "motion/core/track_internal.h"

/* The highest derivatives; true where none is beyond its format. */
static bool clock_anchor_complete(struct motion_clock_anchor *anchor,
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
static void clock_anchor_ahead(const struct motion_clock_anchor *anchor,
                               int64_t t, struct clock_place *place)
{
    const int64_t third = INT64_C(1537228672809129301); /* 2^62 / 3 */
    const int64_t fourth = anchor->fourth_q32;
    const int64_t fifth = clock_warp_mul(anchor->fifth_q32, t, 50);
    const int64_t p = fifth / 2;
    const int64_t p3 = clock_warp_mul(p, third, 62);
    const int64_t fourth3 = clock_warp_mul(fourth, third, 62);
    struct motion_state *state = &place->state;
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
    place->fourth_q32 = clock_warp_add(fourth, fifth);
    place->fifth_q32 = anchor->fifth_q32;
}

/* ns in 2^-12 to seconds, Q50: 2^50 / S_Q12, times 2^54. */
static int64_t clock_anchor_seconds(int64_t ns_q12)
{
    return clock_warp_mul(ns_q12, INT64_C(4951760157141521100), 54);
}

/* From an anchor on the same segment, up to a second before, the state follows
 * by Taylor's series in a tenth of the work: half a unit in each derivative of
 * the anchor makes at most e/2 units in f', rounding of the sums as much
 * again. */
void clock_anchor_place(struct motion_clock_anchor *anchor,
                        const struct motion_track *track, uint32_t index,
                        int64_t s_ns_q12, struct clock_place *place)
{
    const int64_t dt = s_ns_q12 - anchor->s_ns_q12;
    const bool is_near = anchor->is_set && anchor->index == index && dt >= 0 &&
                         dt <= MOTION_FIXED_S_Q12;
    if (!is_near) {
        *anchor = (struct motion_clock_anchor){
            .is_set = index < track->count && s_ns_q12 >= 0, /* else at rest */
            .index = index,
            .s_ns_q12 = s_ns_q12,
        };
        motion_track_state(track, s_ns_q12, &anchor->state);
    }
    *place =
        (struct clock_place){ .state = anchor->state, .left_s_q30 = INT64_MAX };
    if (!anchor->is_set) {
        place->is_whole = index >= track->count; /* at rest for good */
        return;
    }
    const struct motion_segment *segment = &track->segment[index];
    place->is_whole = clock_anchor_complete(anchor, segment);
    if (!place->is_whole) {
        if (is_near)
            motion_track_state(track, s_ns_q12, &place->state);
        return;
    }
    clock_anchor_ahead(anchor, is_near ? clock_anchor_seconds(dt) : 0, place);
    const int64_t left_ns_q12 =
        segment->start_ns_q12 + segment->dur_ns_q12 - s_ns_q12;
    place->left_s_q30 = clock_anchor_seconds(left_ns_q12) >> 20;
}

/* a * b / 2^30, of two that are not negative, rounded up. */
static int64_t clock_bound_mul(int64_t a, int64_t b)
{
    return clock_warp_add(clock_warp_mul(a, b, 30), 1);
}

static int64_t clock_bound_times(int64_t a, int64_t n)
{
    const int64_t most = INT64_MAX / 16; /* n <= 16 */
    return a > most ? INT64_MAX : a < -most ? -INT64_MAX : a * n;
}

/* Of r and |r'| on the way. */
struct clock_pace {
    int64_t rate_q30, accel_q30;
};

static struct clock_pace clock_bound_pace(const struct motion_clock_rate *now,
                                          int64_t h_q30)
{
    const int64_t change =
        clock_bound_mul(clock_warp_size(now->jerk_q30), h_q30);
    const int64_t accel =
        clock_warp_add(clock_warp_size(now->accel_q30), change);
    const bool falls =
        now->accel_q30 <= 0 &&
        (now->jerk_q30 <= 0 || clock_warp_add(now->accel_q30, change) <= 0);
    const int64_t rate = clock_warp_size(now->rate_q30);
    return (struct clock_pace){
        falls ? rate : clock_warp_add(rate, clock_bound_mul(accel, h_q30)),
        accel,
    };
}

/* p'''', Q32. */
static int64_t clock_bound_fourth(const struct clock_place *place,
                                  const struct motion_clock_rate *now)
{
    const int64_t r = now->rate_q30, r1 = now->accel_q30;
    const int64_t r2 = clock_warp_mul(r, r, 30);
    const int64_t of_fourth = clock_warp_mul(r2, r2, 30);
    const int64_t of_third = clock_bound_times(clock_warp_mul(r2, r1, 30), 6);
    const int64_t of_second = clock_warp_add(
        clock_bound_times(clock_warp_mul(r1, r1, 30), 3),
        clock_bound_times(clock_warp_mul(r, now->jerk_q30, 30), 4));
    return clock_warp_add(
        clock_warp_mul(place->fourth_q32, of_fourth, 30),
        clock_warp_add(clock_warp_mul(place->state.jerk_q32, of_third, 30),
                       clock_warp_mul(place->state.acc_q32, of_second, 30)));
}

/* Of |p'''''|, Q32. */
static int64_t clock_bound_fifth(const struct clock_place *place,
                                 const struct motion_clock_rate *now,
                                 const struct clock_pace *pace,
                                 int64_t sigma_q30)
{
    const int64_t r = pace->rate_q30, d = pace->accel_q30;
    const int64_t j = clock_warp_size(now->jerk_q30);
    const int64_t fifth = clock_warp_size(place->fifth_q32);
    const int64_t fourth = clock_warp_add(clock_warp_size(place->fourth_q32),
                                          clock_bound_mul(fifth, sigma_q30));
    const int64_t third = clock_warp_add(clock_warp_size(place->state.jerk_q32),
                                         clock_bound_mul(fourth, sigma_q30));
    const int64_t second = clock_warp_add(clock_warp_size(place->state.acc_q32),
                                          clock_bound_mul(third, sigma_q30));
    const int64_t rd = clock_bound_mul(r, d), r2 = clock_bound_mul(r, r);
    const int64_t of_fifth = clock_bound_mul(clock_bound_mul(r2, r2), r);
    const int64_t of_fourth = clock_bound_times(clock_bound_mul(r2, rd), 10);
    const int64_t of_third =
        clock_warp_add(clock_bound_times(clock_bound_mul(rd, d), 15),
                       clock_bound_times(clock_bound_mul(r2, j), 10));
    const int64_t of_second = clock_bound_times(clock_bound_mul(d, j), 10);
    return clock_warp_add(clock_warp_add(clock_bound_mul(fifth, of_fifth),
                                         clock_bound_mul(fourth, of_fourth)),
                          clock_warp_add(clock_bound_mul(third, of_third),
                                         clock_bound_mul(second, of_second)));
}

/* How fast |x| grows, with x' = slope. */
static int64_t clock_bound_outward(int64_t x, int64_t slope)
{
    const int64_t size = clock_warp_size(slope);
    return x == 0 || (x < 0) == (slope < 0) ? size : -size;
}

static int64_t clock_bound_positive(int64_t a)
{
    return a > 0 ? a : 0;
}

bool clock_anchor_stays(const struct clock_place *place,
                        const struct motion_clock_rate *now,
                        const struct motion_state *axis,
                        const struct motion_clock_limit *limit, int64_t ns)
{
    /* 2^30 / 1e9 in Q30, rounded up */
    const int64_t h = clock_bound_mul(ns, INT64_C(1152921505));
    const struct clock_pace pace = clock_bound_pace(now, h);
    const int64_t sigma = clock_bound_mul(pace.rate_q30, h);
    if (!place->is_whole || sigma > place->left_s_q30)
        return false;
    /* what p'''' changes by at most, and so p''' */
    const int64_t twist =
        clock_bound_mul(clock_bound_fifth(place, now, &pace, sigma), h);
    const int64_t fourth = clock_bound_fourth(place, now);
    const int64_t bend =
        clock_bound_mul(clock_warp_add(clock_warp_size(fourth), twist), h);
    const int64_t fourth_up = clock_bound_positive(
        clock_warp_add(clock_bound_outward(axis->jerk_q32, fourth), twist));
    const int64_t jerk = clock_warp_add(clock_warp_size(axis->jerk_q32),
                                        clock_bound_mul(fourth_up, h));
    if (limit->jerk_q32 > 0 &&
        (jerk > limit->jerk_q32 || bend > limit->jerk_q32))
        return false;
    /* the same of p''; p''' is at most the larger of both */
    const int64_t swing = clock_bound_mul(jerk > bend ? jerk : bend, h);
    const int64_t acc_up = clock_bound_positive(clock_warp_add(
        clock_bound_outward(axis->acc_q32, axis->jerk_q32), bend));
    if (swing > limit->acc_q32 ||
        clock_warp_add(clock_warp_size(axis->acc_q32),
                       clock_bound_mul(acc_up, h)) > limit->acc_q32)
        return false;
    const int64_t jerk_up = clock_bound_positive(clock_warp_add(
        clock_bound_outward(axis->vel_q32, axis->jerk_q32), bend));
    const int64_t vel_up = clock_bound_positive(
        clock_warp_add(clock_bound_outward(axis->vel_q32, axis->acc_q32),
                       clock_bound_mul(jerk_up, h)));
    const int64_t acc = clock_warp_add(clock_warp_size(axis->acc_q32), swing);
    return clock_bound_mul(acc, h) <= limit->vel_q32 &&
           clock_warp_add(clock_warp_size(axis->vel_q32),
                          clock_bound_mul(vel_up, h)) <= limit->vel_q32;
}

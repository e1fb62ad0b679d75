/* chase.c - a target that moves on while the axis is on its way: planned anew
 * in every millisecond from the state that the axis is in, then once through
 * points without stopping.
 *
 *   cc chase.c $(pkg-config --cflags --libs slew) -o chase */
#include <motion/otg/replan.h>
#include <motion/otg/sync.h>
#include <stdio.h>

#define MS     (INT64_C(1000000) << 12)
#define Q32(x) ((int64_t)((x)*4294967296.0))
#define TICKS  1200

static const struct motion_otg_limit limit = {
    .vel_max_q32 = Q32(200),
    .vel_min_q32 = Q32(-200),
    .acc_max_q32 = Q32(1000),
    .acc_min_q32 = Q32(-1000),
    .jerk_q32 = Q32(10000),
};

/* Where the target is: it turns round after 600 ms. */
static double target_at(int tick)
{
    return tick < 600 ? 0.1 * tick : 120 - 0.1 * tick;
}

static int chase(void)
{
    static struct motion_otg_trajectory old, next;
    struct motion_otg_move wish = { .limit = limit };
    int64_t since = 0;
    if (motion_otg_begin(&wish, &old, NULL) < 0)
        return -1;
    for (int tick = 0; tick <= TICKS; tick++, since += MS) {
        struct motion_state state;
        motion_otg_trajectory_state(&old, since, &state);
        if (tick % 200 == 0)
            printf("%4d ms  target %6.2f  axis %8.4f  %8.3f /s\n", tick,
                   target_at(tick), (double)state.pos_q32 / Q32(1),
                   (double)state.vel_q32 / Q32(1));
        wish.goal.pos_q32 = Q32(target_at(tick));
        const int outcome = motion_otg_replan(&old, since, &wish, &next, NULL);
        if (outcome < 0)
            return -1;
        if (outcome != MOTION_OTG_KEPT) {
            old = next;
            since = 0;
        }
    }
    return 0;
}

static int through(void)
{
    const struct motion_state start = { 0 };
    struct motion_otg_point point[] = { { .pos_q32 = Q32(40) },
                                        { .pos_q32 = Q32(90) },
                                        { .pos_q32 = Q32(100) } };
    struct motion_otg_plan plan[3];
    int64_t total = 0;
    if (motion_otg_through(&start, &limit, 1, point, 3, plan, NULL, NULL) < 0)
        return -1;
    for (int i = 0; i < 3; i++) {
        total += plan[i].dur_ns_q12;
        printf("%8.3f ms  at %3.0f with %8.3f /s\n", (double)total / MS,
               (double)point[i].pos_q32 / Q32(1),
               (double)point[i].vel_q32 / Q32(1));
    }
    return 0;
}

int main(void)
{
    return chase() < 0 || through() < 0;
}

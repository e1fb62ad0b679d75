/* keyed.c - plan a move of three keys and sample it on every tick.
 *
 *   cc keyed.c $(pkg-config --cflags --libs slew) -o keyed */
#include <motion/plan/move.h>
#include <stdio.h>

#define SECOND (INT64_C(1000000000) << 12) /* times are 2^-12 ns */
#define ONE    (INT64_C(1) << 32)          /* positions 2^-32 of the unit */

int main(void)
{
    struct plan_key key[] = {
        { .key = { .t_ns_q12 = 0, .pos_q32 = 0 } },
        { .key = { .t_ns_q12 = 1 * SECOND, .pos_q32 = 250 * ONE } },
        { .key = { .t_ns_q12 = 3 * SECOND, .pos_q32 = 100 * ONE } },
    };
    struct plan_axis axis = { .curve = PLAN_CURVE_QUINTIC,
                              .key = key,
                              .key_count = 3 };
    struct motion_track track;
    struct plan_error error;
    if (plan_axis_track(&axis, &track, &error) < 0) {
        fprintf(stderr, "keyed: %s\n", error.text);
        return 1;
    }
    struct motion_cursor cursor = { 0 };
    for (int64_t t = 0; t <= track.end_ns_q12; t += SECOND / 4) {
        struct motion_sample at; /* integers: the same bits everywhere */
        motion_track_sample(&track, &cursor, t, &at);
        printf("%5.2f s %9.3f mm %9.3f mm/s\n", (double)t / SECOND,
               (double)at.pos_q32 / ONE, (double)at.vel_q32 / ONE);
    }
    plan_track_free(&track);
    return 0;
}

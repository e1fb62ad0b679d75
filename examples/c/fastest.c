/* fastest.c - two axes from where they are, moving, to a goal: in the least
 * time, inside limits of velocity, acceleration and jerk, arriving together.
 *
 *   cc fastest.c $(pkg-config --cflags --libs slew) -o fastest */
#include <motion/core/err.h>
#include <motion/otg/sync.h>
#include <stdio.h>

#define SECOND ((double)(INT64_C(1000000000) << 12))
#define Q32(x) ((int64_t)((x)*4294967296.0))

int main(void)
{
    const struct motion_otg_limit limit = {
        .vel_max_q32 = Q32(500),
        .vel_min_q32 = Q32(-500),
        .acc_max_q32 = Q32(2000),
        .acc_min_q32 = Q32(-2000),
        .jerk_q32 = Q32(20000),
    };
    const struct motion_otg_move move[] = {
        { .start = { .pos_q32 = 0, .vel_q32 = Q32(100) },
          .goal = { .pos_q32 = Q32(300) },
          .limit = limit },
        { .start = { .pos_q32 = Q32(50) },
          .goal = { .pos_q32 = Q32(-20) },
          .limit = limit },
    };
    struct motion_otg_plan plan[2];
    struct motion_sync_fault fault;
    const int err = motion_sync_make(move, 2, MOTION_SYNC_TIME, plan, &fault);
    if (err < 0) {
        fprintf(stderr, "fastest: axis %d, %s: %s\n", fault.axis,
                motion_otg_field_text(fault.field), motion_err_text(err));
        return 1;
    }
    for (int i = 0; i < 2; i++) {
        struct motion_segment segment[MOTION_OTG_PHASES];
        struct motion_track track; /* the one form that is played */
        motion_track_init(&track, segment, MOTION_OTG_PHASES,
                          plan[i].start_pos_q32);
        if (motion_otg_append(&plan[i], &track) < 0)
            return 1;
        printf("axis %d: %.6f s, %d phases, ends at %g\n", i,
               (double)track.end_ns_q12 / SECOND, (int)plan[i].count,
               (double)track.end.pos_q32 / Q32(1));
    }
    return 0;
}

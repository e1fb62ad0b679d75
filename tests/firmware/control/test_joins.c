/* tests/firmware/control/test_joins.c - a move that is repeated: from one time to
 * the next position, velocity, acceleration and jerk of the set points are those
 * of the axes' limits. */
#include <math.h>

#include "tests/firmware/control/playback_bench.h"
#include "tests/support/check.h"

/* Set points a tick apart give differences of what lies between them, so no
 * limit is passed by more than their rounding, 2^-32 each: 8 of them in a third
 * difference. */
#define ROUNDING(order) (8 * 0x1p-32 / pow(1e-3, order))

static const struct motion_ease_limit full = { 50 * UNIT, 400 * UNIT,
                                               6000 * UNIT };

static double units(int64_t q32)
{
    return ldexp((double)q32, -32);
}

/* The last four set points of an axis, newest first. */
struct seen {
    int64_t pos_q32[4];
    unsigned count;
    double most[3]; /* of |v|, |a|, |j| */
};

static void look(struct seen *seen, int64_t pos_q32)
{
    const int64_t *p = seen->pos_q32;
    memmove(seen->pos_q32 + 1, seen->pos_q32, 3 * sizeof *p);
    seen->pos_q32[0] = pos_q32;
    seen->count += seen->count < 4;
    if (seen->count < 4)
        return;
    seen->most[0] = fmax(seen->most[0], fabs(units(p[0] - p[1])) / 1e-3);
    seen->most[1] =
        fmax(seen->most[1], fabs(units(p[0] - 2 * p[1] + p[2])) / 1e-6);
    seen->most[2] = fmax(seen->most[2],
                         fabs(units(p[0] - 3 * p[1] + 3 * p[2] - p[3])) / 1e-9);
}

/* Moves of up to three eases at the limits of the axes, whose ends lie between
 * ticks; `closed`: back to where they start. */
static void make_random_move(bool closed)
{
    for (int i = 0; i < AXES; i++) {
        motion_track_init(&bench_track[i], bench_storage[i], 64, 0);
        bench_tracks[i] = &bench_track[i];
        for (int k = 0; k < 3; k++) {
            const int64_t to = k == 2 && closed
                                   ? 0
                                   : (int64_t)((double)UNIT * 80 *
                                               (double)(draw_unit() * 2 - 1));
            assert_int_equal(
                motion_ease_append_limited(&bench_track[i], to, &full),
                MOTION_OK);
        }
    }
    assert_int_equal(playback_load(&playback, bench_tracks), MOTION_OK);
}

static void play(enum mailbox_command how, int64_t times, bool closed)
{
    const double limit[3] = { units(full.vel_q32), units(full.acc_q32),
                              units(full.jerk_q32) };
    struct seen seen[AXES] = { { .count = 0 } };
    make_random_move(closed);
    assert_int_equal(tell(how, times), MOTION_OK);
    assert_int_equal(tell(MAILBOX_START, 0), MOTION_OK);
    for (int n = 0; controller.state != CONTROLLER_READY; n++) {
        assert_in_range(n, 0, 200000);
        assert_int_not_equal(controller.state, CONTROLLER_FAULT);
        for (int i = 0; i < AXES; i++)
            look(&seen[i], drive[i].given.pos_q32);
        tick();
    }
    assert_int_equal(playback.played, times);
    for (int i = 0; i < AXES; i++)
        for (int k = 0; k < 3; k++)
            if (seen[i].most[k] > limit[k] * (1 + 1e-9) + ROUNDING(k + 1))
                fail_msg("axis %d, derivative %d: %.9g of %.9g", i, k + 1,
                         seen[i].most[k], limit[k]);
}

static void those_of_a_loop_are_inside_the_limits(void **state)
{
    seed_from("loops");
    for (int n = 0; n < 12; n++) {
        assert_int_equal(begin_ready(state), 0);
        play(MAILBOX_LOOP, 3, true);
    }
}

/* It goes back to its start in between. */
static void those_of_an_open_loop_too(void **state)
{
    seed_from("open loops");
    for (int n = 0; n < 6; n++) {
        assert_int_equal(begin_ready(state), 0);
        play(MAILBOX_LOOP, 3, false);
    }
}

static void those_of_a_ping_pong_too(void **state)
{
    seed_from("ping-pongs");
    for (int n = 0; n < 12; n++) {
        assert_int_equal(begin_ready(state), 0);
        play(MAILBOX_PING_PONG, 4, n % 2);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(those_of_a_loop_are_inside_the_limits),
        cmocka_unit_test(those_of_an_open_loop_too),
        cmocka_unit_test(those_of_a_ping_pong_too),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

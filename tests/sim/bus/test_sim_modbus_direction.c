/* tests/sim/bus/test_sim_modbus_direction.c - frames in one direction: late, lost,
 * twice, in order. */
#include "sim/bus/modbus_direction.h"

#include <string.h>

#include "tests/support/check.h"

#define MS INT64_C(1000000)

static uint64_t seed;

static bool pass(struct sim_modbus_direction *direction, uint8_t mark,
                 uint32_t tag, int64_t now_ns)
{
    const struct sim_modbus_held frame = { .frame = { mark },
                                           .length = 1,
                                           .tag = tag };

    return sim_modbus_direction_pass(
        direction, sim_modbus_direction_draw(direction, &seed), &seed, &frame,
        now_ns, 3 * MS);
}

/* The mark of the frame that is due; -1: none is. */
static int take(struct sim_modbus_direction *direction, int64_t now_ns)
{
    struct sim_modbus_held frame;

    return sim_modbus_direction_take(direction, now_ns, &frame) ? frame.frame[0]
                                                                : -1;
}

static void what_is_late_comes_late_and_in_order(void **state)
{
    struct sim_modbus_direction direction = { .impairment.delay_ns = 10 * MS };

    (void)state;
    seed = 7;
    assert_false(pass(&direction, 1, 0, 0));
    direction.impairment.delay_ns = 0;
    assert_false(pass(&direction, 2, 0, 4 * MS)); /* behind the one before it */
    assert_true(pass(&direction, 3, 1, 4 * MS));  /* on another connection */
    assert_int_equal(sim_modbus_direction_due_ns(&direction), 10 * MS);
    assert_int_equal(take(&direction, 10 * MS - 1), -1);
    assert_int_equal(take(&direction, 10 * MS), 1);
    assert_int_equal(take(&direction, 10 * MS), 2);
    assert_int_equal(take(&direction, 1000 * MS), -1);
    assert_true(sim_modbus_direction_due_ns(&direction) == INT64_MAX);
}

static void jitter_stays_in_its_range_and_in_order(void **state)
{
    struct sim_modbus_direction direction = { .impairment.delay_ns = 2 * MS,
                                              .impairment.jitter_ns = 5 * MS };
    int64_t least_ns = INT64_MAX, most_ns = 0, last_ns = 0;

    (void)state;
    seed = 7;
    for (int64_t now_ns = 0; now_ns < 1000 * MS; now_ns += 10 * MS) {
        assert_false(pass(&direction, 1, 0, now_ns));
        const int64_t due_ns = sim_modbus_direction_due_ns(&direction);
        assert_true(due_ns >= last_ns);
        last_ns = due_ns;
        least_ns = due_ns - now_ns < least_ns ? due_ns - now_ns : least_ns;
        most_ns = due_ns - now_ns > most_ns ? due_ns - now_ns : most_ns;
        assert_int_equal(take(&direction, due_ns), 1);
    }
    assert_in_range(least_ns, 2 * MS, 3 * MS);
    assert_in_range(most_ns, 6 * MS, 7 * MS);
}

/* On a serial line for good; of TCP a segment is sent again after 200 ms. */
static void what_is_lost_is_sent_again_on_tcp_alone(void **state)
{
    struct sim_modbus_direction direction = { .impairment.loss_q32 = UINT64_C(1)
                                                                     << 31 };
    unsigned now = 0, later = 0;

    (void)state;
    seed = 7;
    for (unsigned i = 0; i < 1000; i++)
        now += pass(&direction, 1, i, 0);
    assert_in_range(now, 450, 550);
    assert_int_equal(direction.lost, 1000 - now);
    assert_int_equal(take(&direction, INT64_MAX - 1), -1);
    direction =
        (struct sim_modbus_direction){ .impairment.loss_q32 = UINT64_C(1) << 31,
                                       .resends = true };
    for (unsigned i = 0; i < 1000; i++) {
        if (pass(&direction, 1, 0, 0))
            continue;
        const int64_t late_ns = sim_modbus_direction_due_ns(&direction);
        if (late_ns == INT64_MAX)
            continue; /* eight times: it is given up */
        /* 200 ms, 600 ms, 1400 ms, .. */
        assert_int_equal((late_ns / (200 * MS) + 1) & (late_ns / (200 * MS)),
                         0);
        later += take(&direction, late_ns) == 1;
    }
    assert_in_range(later, 450, 550);
    direction.impairment.loss_q32 = UINT64_C(1) << 32;
    assert_false(pass(&direction, 1, 0, 0));
    assert_true(sim_modbus_direction_due_ns(&direction) == INT64_MAX);
}

static void what_comes_twice_comes_after_the_silence(void **state)
{
    struct sim_modbus_direction direction = { .impairment.duplication_q32 =
                                                  UINT64_C(1) << 32 };

    (void)state;
    seed = 7;
    assert_true(pass(&direction, 1, 0, MS));
    assert_int_equal(sim_modbus_direction_due_ns(&direction), 4 * MS);
    assert_int_equal(take(&direction, 4 * MS), 1);
    assert_int_equal(direction.doubled, 1);
}

static void as_many_are_spoilt_as_is_said(void **state)
{
    struct sim_modbus_direction direction = { .fault = SIM_MODBUS_FLIP,
                                              .times = 3 };
    unsigned spoilt = 0;

    (void)state;
    seed = 7;
    for (unsigned i = 0; i < 10; i++)
        spoilt +=
            sim_modbus_direction_draw(&direction, &seed) == SIM_MODBUS_FLIP;
    assert_int_equal(spoilt, 3);
    direction = (struct sim_modbus_direction){ .fault = SIM_MODBUS_FLIP,
                                               .share_q32 = UINT64_C(1) << 30 };
    for (unsigned i = 0; i < 1000; i++)
        (void)sim_modbus_direction_draw(&direction, &seed);
    assert_in_range(direction.spoilt, 200, 300);
}

/* One more than there is room for is lost; a connection that ends loses all. */
static void there_is_room_for_eight(void **state)
{
    struct sim_modbus_direction direction = { .impairment.delay_ns = MS };

    (void)state;
    for (uint8_t i = 0; i < SIM_MODBUS_DIRECTION_HELD + 1; i++)
        assert_false(pass(&direction, i, 0, 0));
    assert_int_equal(direction.lost, 1);
    for (int i = 0; i < 3; i++)
        assert_int_equal(take(&direction, MS), i);
    sim_modbus_direction_forget(&direction);
    assert_int_equal(take(&direction, MS), -1);
    assert_int_equal(direction.lost, 1 + SIM_MODBUS_DIRECTION_HELD - 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_late_comes_late_and_in_order),
        cmocka_unit_test(jitter_stays_in_its_range_and_in_order),
        cmocka_unit_test(what_is_lost_is_sent_again_on_tcp_alone),
        cmocka_unit_test(what_comes_twice_comes_after_the_silence),
        cmocka_unit_test(as_many_are_spoilt_as_is_said),
        cmocka_unit_test(there_is_room_for_eight),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

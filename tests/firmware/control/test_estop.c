/* tests/firmware/control/test_estop.c - one channel or two, tick by tick. */
#include <string.h>

#include "firmware/control/estop.h"
#include "tests/support/check.h"

#define MS INT64_C(1000000)

struct channel {
    struct hal_gpio gpio;
    int level;
};

static int channel_get(struct hal_gpio *gpio)
{
    return ((struct channel *)gpio)->level;
}

static const struct hal_gpio_ops channel_ops = { .get = channel_get };

static struct channel channel[2];
static struct controller_estop estop;
static int64_t now_ns;

static int with_two(void **state)
{
    (void)state;
    now_ns = 0;
    estop = (struct controller_estop){ .discrepancy_ns = 50 * MS };
    for (int i = 0; i < 2; i++) {
        channel[i] = (struct channel){ .gpio.ops = &channel_ops };
        estop.channel[i] = &channel[i].gpio;
    }
    return 0;
}

static int with_one(void **state)
{
    (void)with_two(state);
    estop.channel[1] = NULL;
    estop.discrepancy_ns = 0;
    return 0;
}

/* For so many ms, a look in each. */
static void stand(int first, int second, int ms)
{
    channel[0].level = first;
    channel[1].level = second;
    for (; ms > 0; ms--) {
        now_ns += MS;
        controller_estop_look(&estop, now_ns);
    }
}

static void expect(bool is_active, bool disagrees)
{
    assert_int_equal(estop.is_active, is_active);
    assert_int_equal(estop.disagrees, disagrees);
}

static void one_channel_never_disagrees(void **state)
{
    (void)state;
    stand(1, 0, 500);
    expect(true, false);
    stand(0, 0, 1);
    expect(false, false);
    stand(MOTION_E_IO, 0, 1);
    expect(true, false);
}

static void both_in_time_agree(void **state)
{
    (void)state;
    stand(1, 0, 50);
    stand(1, 1, 1000);
    expect(true, false);
    stand(0, 1, 50);
    expect(true, false);
    stand(0, 0, 1);
    expect(false, false);
}

static void one_that_is_late_is_seen_after_the_time(void **state)
{
    (void)state;
    stand(0, 1, 51);
    expect(true, false);
    stand(0, 1, 1);
    expect(true, true);
    stand(1, 1, 10);
    stand(0, 0, 1);
    expect(false, true); /* late once: this time shows nothing */
}

static void one_that_closes_late_is_seen_too(void **state)
{
    (void)state;
    stand(1, 1, 100);
    stand(1, 0, 52);
    expect(true, true);
    stand(0, 0, 1);
    expect(false, true);
}

static void one_that_opens_alone_is_seen_when_it_closes(void **state)
{
    (void)state;
    stand(MOTION_E_IO, 0, 5);
    expect(true, false);
    stand(0, 0, 1);
    expect(false, true);
}

static void only_both_in_time_show_that_they_work(void **state)
{
    (void)state;
    stand(1, 0, 5);
    stand(0, 0, 5);
    stand(0, 1, 5);
    stand(0, 0, 5);
    expect(false, true);
    stand(1, 0, 5);
    stand(1, 1, 5);
    expect(true, true); /* until it is let go */
    stand(0, 0, 1);
    expect(false, false);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(one_channel_never_disagrees, with_one),
        cmocka_unit_test_setup(both_in_time_agree, with_two),
        cmocka_unit_test_setup(one_that_is_late_is_seen_after_the_time,
                               with_two),
        cmocka_unit_test_setup(one_that_closes_late_is_seen_too, with_two),
        cmocka_unit_test_setup(one_that_opens_alone_is_seen_when_it_closes,
                               with_two),
        cmocka_unit_test_setup(only_both_in_time_show_that_they_work, with_two),
    };
    return cmocka_run_group_tests_name("estop", tests, NULL, NULL);
}

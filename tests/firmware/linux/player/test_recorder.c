/* tests/firmware/linux/player/test_recorder.c - the ring of rows. */
#include "firmware/linux/player/recorder.h"

#include "tests/support/check.h"

static struct rig_axis rig_axes[2];
static struct rig_line rig_lines[] = {
    { .name = "camera", .kind = RIG_LINE_TRIGGER },
    { .name = "flash", .kind = RIG_LINE_TRIGGER },
};
static struct rig_bus rig_buses[2];
static const struct rig rig = {
    .axis = rig_axes,
    .axis_count = ARRAY_LEN(rig_axes),
    .line = rig_lines,
    .line_count = ARRAY_LEN(rig_lines),
    .bus = rig_buses,
    .bus_count = ARRAY_LEN(rig_buses),
};

static void count_in_order(void *context, struct telemetry_row *row)
{
    int64_t *next = context;
    assert_int_equal(row->t_ns, *next);
    assert_int_equal(row->bus_warnings[1], (uint32_t)*next / 100);
    (*next)++;
}

static bool put(struct recorder *recorder, struct telemetry_row *row)
{
    row->bus_warnings[1] = (uint32_t)row->t_ns / 100;
    return recorder_put(recorder, row);
}

static void the_ring_keeps_order_and_drops_the_newest_when_full(void **state)
{
    (void)state;
    static struct recorder recorder;
    struct telemetry_axis axis[2] = { { .following_q32 = 0 } };
    struct telemetry_shot shot[2] = { { .number = 0 } };
    uint32_t bus_warnings[2] = { 0 };
    struct telemetry_row row = { .axis = axis,
                                 .bus_warnings = bus_warnings,
                                 .shot = shot,
                                 .shot_count = 2 };
    int64_t next = 0;
    recorder_init(&recorder, &rig);
    for (int i = 0; i < RECORDER_ROWS; i++, row.t_ns++)
        assert_true(put(&recorder, &row));
    assert_false(recorder_put(&recorder, &row));
    assert_int_equal(recorder.dropped, 1);
    recorder_drain(&recorder, count_in_order, &next);
    assert_int_equal(next, RECORDER_ROWS);
    assert_int_equal(recorder_waiting(&recorder), 0);
    for (int round = 0; round < 5; round++) {
        for (int i = 0; i < 1000; i++, row.t_ns++)
            assert_true(put(&recorder, &row));
        recorder_drain(&recorder, count_in_order, &next);
        assert_int_equal(next, row.t_ns);
    }
    recorder_free(&recorder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_ring_keeps_order_and_drops_the_newest_when_full),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

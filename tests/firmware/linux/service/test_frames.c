/* tests/firmware/linux/service/test_frames.c - frames of many ticks. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "firmware/linux/service/frames.h"
#include "firmware/studio/server/bytes.h"

static struct rig rig;
static struct memory_pool memory;
static struct service_frames frames;
static struct service_frame frame;
static struct service_state state_of;

static int begin(void **state)
{
    (void)state;
    rig.axis_count = 2;
    rig.bus_count = 1;
    rig.line_count = 3;
    memset(&frames, 0, sizeof frames);
    service_frames_init(&frames, &rig, &memory);
    service_frame_init(&frame, &rig, &memory);
    memset(&state_of, 0, sizeof state_of);
    machine_view_init(&state_of.view, &rig, &memory);
    return 0;
}

static int end(void **state)
{
    (void)state;
    memory_pool_free(&memory);
    return 0;
}

static void tick(int64_t n)
{
    state_of.now_ns = n * 1000000;
    state_of.ticks = (uint64_t)n;
    state_of.late_ns = n == 3 ? 700 : 5;
    state_of.view.axis[0].pos_q32 = n == 7 ? -1000 : n;
    state_of.view.axis[0].demand_q32 = n == 40 ? 9999 : n;
    service_frames_put(&frames, &state_of);
}

static void no_peak_is_lost_while_nobody_looks(void **state)
{
    uint32_t ticks = 0;

    (void)state;
    assert_false(service_frames_take(&frames, &frame));
    for (int64_t n = 1; n <= 60; n++)
        tick(n);
    /* the first frame waits since its time; the rest is one frame */
    assert_true(service_frames_take(&frames, &frame));
    ticks = frame.ticks;
    assert_int_equal(frame.axis[0].actual_q32.low, -1000);
    assert_int_equal(frame.late_ns, 700);
    assert_int_equal(frame.state.ticks, ticks);
    tick(61);
    assert_true(service_frames_take(&frames, &frame));
    assert_int_equal(frame.ticks, 61);
    assert_int_equal(frame.axis[0].actual_q32.low, -1000);
    assert_int_equal(frame.axis[0].demand_q32.high, 9999);
    assert_int_equal(frame.axis[0].demand_q32.last, 61);
    assert_false(service_frames_take(&frames, &frame));
}

static void frames_come_at_60_hz(void **state)
{
    unsigned count = 0;

    (void)state;
    for (int64_t n = 1; n <= 1000; n++) {
        tick(n);
        count += service_frames_take(&frames, &frame);
        frame.ticks = 0;
    }
    assert_in_range(count, 54, 60);
}

static int64_t read_i64(const uint8_t *at)
{
    uint64_t value = 0;
    for (unsigned i = 8; i-- > 0;)
        value = value << 8 | at[i];
    return (int64_t)value;
}

static void a_frame_in_bytes_is_as_its_document_says(void **state)
{
    static uint8_t bytes[BYTES_MAX];
    const struct bytes_count count = { 5, 6, true };

    (void)state;
    frame.ticks = 17;
    frame.late_ns = 1234;
    frame.state.ticks = 1000;
    frame.state.state = CONTROLLER_FAULT;
    frame.state.homing = frame.state.off = true;
    frame.axis[1].actual_q32 = (struct service_range){ -2, -3, 4 };
    frame.state.view.axis[1].vel_q32 = -77;
    frame.state.view.axis[1].torque_permille = -5;
    frame.state.view.axis[1].statusword = 0x0637;
    frame.state.view.axis[1].homed = true;
    frame.state.view.bus[0].can_state = -1;
    frame.state.view.line[1] = 1;
    frame.state.view.line[2] = -5;
    assert_int_equal(bytes_of_frame(&rig, &frame, &count, bytes),
                     88 + 2 * 104 + 24 + 3);
    assert_memory_equal(bytes, "SLW1", 4);
    assert_int_equal(bytes[4], 2);
    assert_int_equal(bytes[6], 1);
    assert_int_equal(bytes[7], 3);
    assert_int_equal(bytes[8], 5);
    assert_int_equal(bytes[12], 17);
    assert_int_equal(read_i64(bytes + 16), 1000);
    assert_int_equal(read_i64(bytes + 72), 1234);
    assert_int_equal(bytes[80], 5);
    assert_int_equal(bytes[81], 2 | 16 | 32);
    assert_int_equal(bytes[84], 6);
    const uint8_t *axis = bytes + 88 + 104;
    assert_int_equal(read_i64(axis + 24), -2);
    assert_int_equal(read_i64(axis + 32), -3);
    assert_int_equal(read_i64(axis + 40), 4);
    assert_int_equal(read_i64(axis + 72), -77);
    assert_int_equal(axis[80], 0xFB);
    assert_int_equal(axis[84], 0x37);
    assert_int_equal(axis[89], 2);
    const uint8_t *bus = bytes + 88 + 208;
    assert_int_equal(bus[16], 0xFF);
    assert_int_equal(bus[24], 0);
    assert_int_equal(bus[25], 1);
    assert_int_equal(bus[26], 0xFF);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(no_peak_is_lost_while_nobody_looks,
                                        begin, end),
        cmocka_unit_test_setup_teardown(frames_come_at_60_hz, begin, end),
        cmocka_unit_test_setup_teardown(
            a_frame_in_bytes_is_as_its_document_says, begin, end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* tests/firmware/linux/player/test_can_log.c - lines as candump -L writes
 * them; a port that is looked at behaves as before. */
#include "tests/support/check.h"

#include <stdio.h>
#include <string.h>

#include "firmware/linux/player/can_log.h"
#include "sim/bus/can.h"
#include "sim/world.h"

#define MS INT64_C(1000000)

/* From candump's own manual page and lib.c. */
static void lines_are_those_of_candump(void **state)
{
    static const struct {
        struct hal_can_frame frame;
        int64_t t_ns;
        const char *line;
    } row[] = {
        { { .id = 0x123, .len = 4, .data = { 0xDE, 0xAD, 0xBE, 0xEF } },
          1436509052249713999,
          "(1436509052.249713) can0 123#DEADBEEF\n" },
        { { .id = 0x5 }, 1000000, "(0000000000.001000) can0 005#\n" },
        { { .id = 0x12345678, .extended = true, .len = 1, .data = { 7 } },
          0,
          "(0000000000.000000) can0 12345678#07\n" },
        { { .id = 0x705, .remote = true },
          0,
          "(0000000000.000000) can0 705#R\n" },
        { { .id = 0x705, .remote = true, .len = 1 },
          0,
          "(0000000000.000000) can0 705#R1\n" },
        { { .id = 1, .fd = true, .switched = true, .len = 2 },
          0,
          "(0000000000.000000) can0 001##10000\n" },
        { { .id = 1, .fd = true }, 0, "(0000000000.000000) can0 001##0\n" },
    };
    const struct hal_can_frame longest = {
        .id = 1, .extended = true, .fd = true, .len = 64
    };
    char line[CAN_LOG_LINE_MAX];

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        can_log_line(line, row[i].t_ns, "can0", &row[i].frame);
        assert_string_equal(line, row[i].line);
    }
    can_log_line(line, INT64_MAX, "a-name-of-thirty-one-characters", &longest);
    assert_int_equal(line[strlen(line) - 1], '\n');
}

static struct rig_bus named = { .name = "bus" };
static const struct rig rig = { .bus_count = 1, .bus = &named };
static struct can_log logged;
static struct sim_can_port a, b; /* a is logged */
static struct sim_world world;
static struct sim_can_bus bus;
static struct hal_can *can;
static struct machine_ports ports = { .can = &can };

static FILE *log_to_file(int64_t start_ns)
{
    FILE *file = tmpfile();

    assert_non_null(file);
    sim_world_init(&world, start_ns);
    assert_int_equal(sim_can_bus_init(&bus, &world, 1000000), 0);
    sim_can_port_init(&a, &bus);
    sim_can_port_init(&b, &bus);
    ports.clock = &world.clock;
    ports.can[0] = &a.can;
    can_log_init(&logged, file, &rig, false, &ports);
    return file;
}

static void what_goes_by_is_written_and_goes_by_unchanged(void **state)
{
    struct hal_can_frame frame = { .id = 0x201, .len = 1, .data = { 9 } };
    char text[256] = "";
    FILE *file = log_to_file(1000 * MS);

    (void)state;
    assert_ptr_not_equal(ports.can[0], &a.can);
    assert_int_equal(hal_can_send(ports.can[0], &frame), MOTION_OK);
    frame.id = 0x800; /* refused: not on the wire, not in the file */
    assert_int_equal(hal_can_send(ports.can[0], &frame), MOTION_E_ARG);
    frame.id = 0x181;
    sim_world_run(&world, 1005 * MS);
    assert_int_equal(hal_can_send(&b.can, &frame), MOTION_OK);
    sim_world_run(&world, 1010 * MS);
    assert_int_equal(hal_can_recv(ports.can[0], &frame), 1);
    assert_int_equal(frame.id, 0x181);
    assert_int_equal(hal_can_recv(ports.can[0], &frame), 0);
    assert_int_equal(hal_can_recv(&b.can, &frame), 1);
    assert_int_equal(frame.id, 0x201);
    assert_int_equal(can_log_waiting(&logged), 2);
    can_log_drain(&logged);
    rewind(file);
    assert_true(fread(text, 1, sizeof text - 1, file) > 0);
    fclose(file);
    assert_non_null(strstr(text, "(0000000001.000000) bus 201#09\n"
                                 "(0000000001.0050"));
    assert_non_null(strstr(text, ") bus 181#09\n"));
}

static void a_full_ring_counts_what_it_loses(void **state)
{
    const struct hal_can_frame frame = { .id = 1 };
    FILE *file = log_to_file(0);

    (void)state;
    for (unsigned i = 0; i < CAN_LOG_FRAMES + 7; i++) {
        assert_int_equal(hal_can_send(ports.can[0], &frame), MOTION_OK);
        sim_world_run(&world, world.now_ns + MS);
    }
    assert_int_equal(logged.dropped, 7);
    can_log_drain(&logged);
    assert_int_equal(can_log_waiting(&logged), 0);
    assert_int_equal(hal_can_send(ports.can[0], &frame), MOTION_OK);
    assert_int_equal(logged.dropped, 7);
    fclose(file);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lines_are_those_of_candump),
        cmocka_unit_test(what_goes_by_is_written_and_goes_by_unchanged),
        cmocka_unit_test(a_full_ring_counts_what_it_loses),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

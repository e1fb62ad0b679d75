/* tests/firmware/mcu/test_servos.c - a board with servo drives on its own line: the
 * register map, the drives and the axes come in pieces, whatever happens to these
 * on the way; the set points are those of virtual axes, to the bit; what goes
 * silent is a fault. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/device/modbus_map_load.h"
#include "firmware/linux/base/disk.h"
#include "hal/mcu/map.h"
#include "sim/bus/modbus.h"
#include "sim/device/modbus/servo.h"
#include "tests/firmware/mcu/board.h"
#include "tests/firmware/mcu/damage.h"
#include "tests/support/piece_text.h"

#define COUNTS 10000 /* per unit */
#define NODE   3     /* of axis 0, and so on */
#define MS     INT64_C(1000000)

static const char *const maps[] = { "leadshine-el7", "leadshine-cs2rs",
                                    "lexium-32", "oriental-az", "delta-asda" };

static struct mcu_servos servos;
static struct mcu_unit_config config;
static struct board board;
static struct board_move move;
static struct board_pieces pieces;
static struct modbus_map map;
static struct sim_world world;
static struct sim_modbus_line line;
static struct sim_modbus_seat seat;
static struct sim_modbus_servo servo[BOARD_AXES];
static struct modbus_rtu_line opened;

static void load(const char *name)
{
    char path[64], message[YAML_MESSAGE_MAX];

    snprintf(path, sizeof path, "hal/maps/%s.yaml", name);
    if (modbus_map_load(&disk_files, path, &map, message) < 0)
        fail_msg("%s", message);
    map.line = (struct modbus_rtu_line){ .baud = 115200,
                                         .parity = MODBUS_PARITY_NONE,
                                         .stop_bits = 1 };
}

static int open_line(const struct modbus_rtu_line *wanted)
{
    opened = *wanted;
    return MOTION_OK;
}

static void power_on(void)
{
    config = board_config;
    config.servos = &servos;
    config.open_line = open_line;
    board_init(&board);
    board.unit.config = &config;
    mcu_servos_clear(&servos);
}

/* --- its pieces ----------------------------------------------------------- */

static struct mcu_servo described(unsigned axis)
{
    return (struct mcu_servo){
        .config = { .unit = (uint8_t)(NODE + axis),
                    .counts_num = COUNTS,
                    .counts_den = 1,
                    .vel_max_q32 = 20 * BOARD_ONE,
                    .acc_q32 = 200 * BOARD_ONE,
                    .cycle_ns = 40 * MS,
                    .latency_ns = 10 * MS },
        .depth = 2,
        .feedback_max_age_ns = 200 * MS,
        .map_crc = mcu_map_crc(&map),
    };
}

/* Map, drives and axes; gentle limits, and room to be behind. */
static void make_setup(void)
{
    uint32_t crc[BOARD_AXES];

    pieces.count = 0;
    for (unsigned from = 0, count; from < MCU_MAP_VALUES;
         from += MCU_PIECE_VALUES) {
        pieces.length[pieces.count] = mcu_piece_put_map(
            pieces.word[pieces.count], move.id, from, &map, &count);
        pieces.count += count > 0;
    }
    for (unsigned i = 0; i < BOARD_AXES; i++, pieces.count++) {
        const struct mcu_servo one = described(i);
        uint16_t *word = pieces.word[pieces.count];
        const unsigned length = mcu_piece_put_drive(word, move.id, i, &one);
        pieces.length[pieces.count] = length;
        crc[i] = mcu_piece_own_crc(word, length);
    }
    for (unsigned i = 0; i < BOARD_AXES; i++, pieces.count++) {
        const struct mcu_setup one = {
            .pos_min_q32 = -1000 * BOARD_ONE,
            .pos_max_q32 = 1000 * BOARD_ONE,
            .vel_q32 = 20 * BOARD_ONE,
            .acc_q32 = 200 * BOARD_ONE,
            .stop_vel_q32 = 20 * BOARD_ONE,
            .stop_acc_q32 = 200 * BOARD_ONE,
            .following_floor_q32 = 3 * BOARD_ONE,
        };
        pieces.length[pieces.count] = mcu_piece_put_setup(
            pieces.word[pieces.count], move.id, i, BOARD_AXES, &one, crc[i]);
    }
    assert_true(pieces.count <= BOARD_PIECES);
}

static enum mcu_piece_result put(unsigned which)
{
    return mcu_upload_put(&board.upload, pieces.word[which],
                          pieces.length[which]);
}

static void put_all(void)
{
    for (unsigned i = 0; i < pieces.count; i++)
        if (put(i) != MCU_PIECE_TAKEN)
            fail_msg("piece %u: %s", i, piece_text(board.upload.last));
}

static bool is_set_up(void)
{
    return board.unit.axis_count == BOARD_AXES;
}

/* Of all axes, or there are none. */
static void nothing_else_than_sent(void)
{
    if (board.unit.axis_count == 0)
        return;
    assert_int_equal(board.unit.axis_count, BOARD_AXES);
    assert_int_equal(board.unit.driven, (1u << BOARD_AXES) - 1);
    for (unsigned i = 0; i < MCU_MAP_VALUES; i++)
        assert_int_equal(mcu_map_get(&servos.map, i), mcu_map_get(&map, i));
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        assert_int_equal(servos.drive[i].config.unit, NODE + i);
        assert_ptr_equal(board.unit.axis[i].drive, &servos.drive[i].drive);
    }
}

/* --- the map -------------------------------------------------------------- */

static void a_map_is_the_same_after_its_pieces(void **state)
{
    (void)state;
    board_make_move(&move, 2, check_stream());
    for (unsigned i = 0; i < sizeof maps / sizeof maps[0]; i++) {
        load(maps[i]);
        assert_true(mcu_map_is_sound(&map));
        power_on();
        make_setup();
        if (map.stream.count == 0) {
            for (unsigned k = 0; pieces.word[k][0] == MCU_PIECE_MAP; k++)
                assert_int_equal(put(k), MCU_PIECE_TAKEN);
            for (unsigned k = 0; k < MCU_MAP_VALUES; k++)
                assert_int_equal(mcu_map_get(&servos.map, k),
                                 mcu_map_get(&map, k));
            continue;
        }
        put_all();
        assert_true(is_set_up());
        nothing_else_than_sent();
        assert_int_equal(opened.baud, 115200);
    }
}

/* Every value has a place of its own: one that is changed is read back there
 * and nowhere else. */
static void every_value_has_its_place(void **state)
{
    (void)state;
    load(maps[0]);
    for (unsigned i = 0; i < MCU_MAP_VALUES; i++) {
        const int64_t was = mcu_map_get(&map, i);
        const uint32_t crc = mcu_map_crc(&map);
        assert_true(mcu_map_set(&map, i, was == 0));
        assert_int_equal(mcu_map_get(&map, i), was == 0);
        assert_int_not_equal(mcu_map_crc(&map), crc);
        assert_true(mcu_map_set(&map, i, was));
        assert_int_equal(mcu_map_crc(&map), crc);
    }
}

/* --- pieces in every order ------------------------------------------------ */

static void in_any_order_it_is_what_was_sent_or_nothing(void **state)
{
    (void)state;
    load(maps[0]);
    for (unsigned run = 0; run < 8; run++) {
        unsigned tries = 0;
        board_make_move(&move, 2, check_stream());
        make_setup();
        power_on();
        while (!is_set_up()) {
            const unsigned which = board_below(check_stream(), pieces.count);
            uint8_t frame[DAMAGE_MAX], answer[256];
            unsigned length = board_put_write(
                frame, MCU_AT_PIECE, pieces.word[which], pieces.length[which]);
            if (board_below(check_stream(), 2) == 0)
                length = damage_frame(frame, length,
                                      board_below(check_stream(), DAMAGE_KINDS),
                                      board_below(check_stream(), length));
            board_hears(&board, frame, length, answer);
            nothing_else_than_sent();
            if (++tries > 100000)
                fail_msg("run %u: never there", run);
        }
        for (unsigned i = 0; i < pieces.count; i++)
            assert_int_equal(put(i), MCU_PIECE_REPEATED);
    }
}

static void an_axis_waits_for_its_drive_and_that_for_its_map(void **state)
{
    unsigned drive = 0;
    (void)state;

    load(maps[0]);
    board_make_move(&move, 2, check_stream());
    make_setup();
    power_on();
    while (pieces.word[drive][0] == MCU_PIECE_MAP)
        drive++;
    assert_int_equal(put(drive + BOARD_AXES), MCU_PIECE_E_ORDER);
    for (unsigned i = 1; i < drive; i++)
        assert_int_equal(put(i), MCU_PIECE_TAKEN);
    assert_int_equal(put(drive), MCU_PIECE_E_ORDER);
    assert_int_equal(put(0), MCU_PIECE_TAKEN);
    assert_int_equal(put(drive), MCU_PIECE_TAKEN);
    assert_int_equal(put(drive + BOARD_AXES + 1), MCU_PIECE_E_ORDER);
    assert_int_equal(put(drive + BOARD_AXES), MCU_PIECE_TAKEN);
    assert_false(is_set_up());
}

/* With drives that have torque nothing of the line is touched. */
static void not_under_torque(void **state)
{
    (void)state;
    load(maps[0]);
    board_make_move(&move, 2, check_stream());
    make_setup();
    power_on();
    put_all();
    board.unit.axis[0].feedback.state = HAL_DRIVE_ENABLED;
    move.id ^= 2;
    make_setup();
    assert_int_equal(put(0), MCU_PIECE_E_STATE);
    assert_true(is_set_up());
    board.unit.axis[0].feedback.state = HAL_DRIVE_OFF;
    assert_int_equal(put(0), MCU_PIECE_TAKEN);
    assert_int_equal(board.unit.axis_count, 0);
}

static void a_board_without_a_port_says_so(void **state)
{
    (void)state;
    load(maps[0]);
    board_make_move(&move, 2, check_stream());
    make_setup();
    power_on();
    config.servos = NULL;
    assert_int_equal(put(0), MCU_PIECE_E_KIND);
}

/* --- on a line ------------------------------------------------------------ */

static void build_line(void)
{
    sim_world_init(&world, 0);
    assert_int_equal(sim_modbus_line_init(&line, &world, &map.line), MOTION_OK);
    assert_int_equal(sim_modbus_seat_init(&seat, &line, &servos.master.station),
                     MOTION_OK);
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        const struct sim_modbus_servo_config with = {
            .map = &map,
            .unit = (uint8_t)(NODE + i),
            .line = map.line,
            .turnaround_ns = map.turnaround_ns,
            .plant = { .omega_mrad_s = 400000,
                       .zeta_permille = 700,
                       .vel_max_counts_s = 100 * COUNTS,
                       .acc_max_counts_s2 = 5000 * COUNTS },
        };
        assert_int_equal(sim_modbus_servo_init(&servo[i], &world, &line, &with),
                         MOTION_OK);
    }
}

static void run_ms(unsigned ms)
{
    while (ms-- > 0) {
        board.tick_ns += MS;
        sim_world_run(&world, board.tick_ns);
        mcu_unit_tick(&board.unit, board.tick_ns);
    }
}

static void run_until(enum controller_state wanted, unsigned ms)
{
    while (board.unit.controller.state != wanted && ms-- > 0)
        run_ms(1);
    if (board.unit.controller.state != wanted)
        fail_msg("the board is %s: %s, %s",
                 controller_state_text(board.unit.controller.state),
                 controller_fault_text(board.unit.controller.fault.fault),
                 board.unit.axis[0].feedback.fault_text);
}

/* 2 s there and back on each axis, then at rest. */
static void make_slow_move(void)
{
    move.id = 77;
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        struct motion_state at[4] = { 0 };
        at[1].pos_q32 = (int64_t)(i + 1) * BOARD_ONE;
        at[2].pos_q32 = at[3].pos_q32 = BOARD_ONE / 4;
        motion_track_init(&move.track[i], move.segment[i], BOARD_SEGMENTS, 0);
        for (unsigned k = 0; k < 3; k++)
            assert_int_equal(motion_track_append_quintic(&move.track[i],
                                                         1000 * MS << 12,
                                                         &at[k], &at[k + 1]),
                             MOTION_OK);
        mcu_head_of(&move.track[i], &move.head[i]);
    }
}

static void send_move(void)
{
    board_make_pieces(&pieces, &move, check_stream());
    put_all();
}

static void start_on_line(void)
{
    load(maps[0]);
    make_slow_move();
    make_setup();
    power_on();
    put_all();
    build_line();
    send_move();
    assert_true(board_command(&board, MCU_COMMAND_ENABLE, 0));
    run_until(CONTROLLER_READY, 10000);
    assert_true(board_command(&board, MCU_COMMAND_START, move.id));
}

static void servos_get_the_set_points_of_virtual_axes(void **state)
{
    uint32_t crc, entries;
    (void)state;

    start_on_line();
    run_until(CONTROLLER_MOVING, 10);
    run_until(CONTROLLER_READY, 5000);
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        assert_int_equal(board.unit.axis[i].target.pos_q32, BOARD_ONE / 4);
        assert_in_range(sim_modbus_servo_counts(&servo[i]), COUNTS / 4 - 2,
                        COUNTS / 4 + 2);
    }
    crc = board.unit.log.crc;
    entries = board.unit.log.next;
    assert_true(board_command(&board, MCU_COMMAND_OFF, 0));
    run_ms(2000);
    for (unsigned i = 0; i < BOARD_AXES; i++)
        assert_int_equal(board.unit.axis[i].feedback.state, HAL_DRIVE_OFF);

    board_init(&board);
    for (unsigned i = 0; i < BOARD_AXES; i++) {
        uint16_t piece[MCU_PIECE_MAX];
        assert_true(board_send(&board, MCU_AT_PIECE, piece,
                               board_put_setup(piece, &move, i)));
    }
    send_move();
    assert_true(board_command(&board, MCU_COMMAND_ENABLE, 0));
    board_ticks(&board, 5);
    assert_true(board_command(&board, MCU_COMMAND_START, move.id));
    board_ticks(&board, entries + 10);
    assert_int_equal(board.unit.log.next, entries);
    assert_int_equal(board.unit.log.crc, crc);
}

static void a_cut_line_stops_all_and_says_why(void **state)
{
    uint16_t why[MCU_WHY_WORDS];
    (void)state;

    start_on_line();
    run_ms(700);
    line.cut = true;
    run_until(CONTROLLER_FAULT, 3000);
    run_ms(3000);
    assert_int_equal(board.registers.slave.ops->get(&board.registers.slave,
                                                    MODBUS_HOLDING, MCU_AT_WHY,
                                                    MCU_WHY_WORDS, why),
                     0);
    assert_int_not_equal(why[0], 0);
    assert_false(board_command(&board, MCU_COMMAND_START, move.id));
    line.cut = false;
    run_ms(5000);
    assert_int_equal(board.unit.controller.state, CONTROLLER_FAULT);
    for (unsigned i = 0; i < BOARD_AXES; i++)
        assert_false(servo[i].enabled);
    assert_true(board_command(&board, MCU_COMMAND_RESET, 0));
    run_until(CONTROLLER_OFF, 5000);
    run_ms(5000);
    assert_true(board_command(&board, MCU_COMMAND_ENABLE, 0));
    run_until(CONTROLLER_READY, 10000);
}

static void an_alarm_of_a_drive_is_a_fault_of_its_axis(void **state)
{
    (void)state;
    start_on_line();
    run_ms(700);
    sim_modbus_servo_inject(&servo[1], SIM_MODBUS_SERVO_ALARM);
    run_until(CONTROLLER_FAULT, 3000);
    assert_int_equal(board.unit.controller.fault.axis, 1);
    run_ms(3000);
    for (unsigned i = 0; i < BOARD_AXES; i++)
        assert_false(servo[i].enabled);
}

/* --- maps of nobody ------------------------------------------------------- */

/* A value that has no place in a map, in the piece where it would stand, with
 * the right checksum. */
static void is_refused(unsigned index, int64_t value)
{
    unsigned which = 0;
    uint16_t *word;

    make_setup();
    power_on();
    while (index < mcu_words_get(pieces.word[which] + 4, 2) ||
           index >= mcu_words_get(pieces.word[which] + 4, 2) +
                        (pieces.length[which] - MCU_PIECE_AROUND) / 4)
        if (pieces.word[++which][0] != MCU_PIECE_MAP)
            return; /* it is 0, and so are all to the end of its piece */
    word = pieces.word[which];
    mcu_words_put(word + MCU_PIECE_HEAD +
                      4 * (index - mcu_words_get(word + 4, 2)),
                  (uint64_t)value, 4);
    mcu_words_put(word + pieces.length[which] - 2,
                  mcu_piece_crc(word, pieces.length[which] - 2), 2);
    assert_int_equal(put(which), MCU_PIECE_E_VALUE);
}

/* One value changed at random, its checksums right: refused, or driven without
 * harm.  (Run under the sanitizers.) */
static void a_map_with_any_value_is_refused_or_harmless(void **state)
{
    static const int64_t often[] = { 0,         -1,        1,
                                     255,       65535,     INT32_MAX,
                                     INT64_MAX, INT64_MIN, 1000000001 };
    unsigned refused = 0, driven = 0;
    (void)state;

    load(maps[0]);
    make_slow_move();
    for (unsigned i = 0; i < MCU_MAP_VALUES; i++) {
        const int64_t was = mcu_map_get(&map, i);
        const int64_t value =
            often[board_below(check_stream(), sizeof often / sizeof often[0])];
        unsigned k = 0;
        if (!mcu_map_set(&map, i, value)) {
            is_refused(i, value);
            continue;
        }
        make_setup();
        power_on();
        while (k < pieces.count && mcu_piece_exception(put(k)) == 0)
            k++;
        if (is_set_up()) {
            driven++;
            for (unsigned t = 0; t < 8; t++) {
                uint8_t frame[MODBUS_FRAME_MAX];
                struct modbus_station *station = &servos.master.station;
                board_ticks(&board, 100);
                if (station->ops->poll(station, board.tick_ns, frame) > 0)
                    station->ops->sent(station, board.tick_ns);
            }
        } else {
            refused++;
            assert_int_equal(board.unit.driven, 0);
        }
        assert_true(mcu_map_set(&map, i, was));
    }
    assert_true(refused > 20);
    assert_true(driven > 300);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_map_is_the_same_after_its_pieces),
        cmocka_unit_test(every_value_has_its_place),
        cmocka_unit_test(in_any_order_it_is_what_was_sent_or_nothing),
        cmocka_unit_test(an_axis_waits_for_its_drive_and_that_for_its_map),
        cmocka_unit_test(not_under_torque),
        cmocka_unit_test(a_board_without_a_port_says_so),
        cmocka_unit_test(servos_get_the_set_points_of_virtual_axes),
        cmocka_unit_test(a_cut_line_stops_all_and_says_why),
        cmocka_unit_test(an_alarm_of_a_drive_is_a_fault_of_its_axis),
        cmocka_unit_test(a_map_with_any_value_is_refused_or_harmless),
    };

    seed_from("servos of a board");
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* tests/hal/linux/test_can_socketcan.c - frames, error frames and time stamps
 * of the kernel; interfaces that are not what was asked for.
 *
 *   test_can_socketcan      what needs no CAN in the kernel
 *   test_can_socketcan vm   also on vcan0 and on a serial line that the test
 *                           plays (slcan), as root (make test-vm) */
#define _GNU_SOURCE /* struct ifreq, posix_openpt */
#include "tests/support/check.h"

#include <fcntl.h>
#include <net/if.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "hal/linux/socketcan.h"

#define MS INT64_C(1000000)
#define S  INT64_C(1000000000)

#define LINE_DISCIPLINE_SLCAN 17

/* ---- without CAN ---- */

static void frames_go_to_the_kernel_and_back(void **state)
{
    static const struct hal_can_frame frame[] = {
        { .id = 0x7FF, .len = 8, .data = { 1, 2, 3, 4, 5, 6, 7, 8 } },
        { .id = 0, .len = 0 },
        { .id = 0x1FFFFFFF, .extended = true, .len = 3, .data = { 9, 8, 7 } },
        { .id = 0x70F, .remote = true, .len = 1 },
        { .id = 5, .fd = true, .len = 64, .data = { 1, [63] = 2 } },
        { .id = 5, .fd = true, .switched = true, .len = 12, .data = { 3 } },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(frame); i++) {
        struct canfd_frame raw;
        struct hal_can_frame back;
        const size_t bytes = can_frame_encode(&frame[i], &raw);

        assert_int_equal(bytes, frame[i].fd ? CANFD_MTU : CAN_MTU);
        assert_true(can_frame_decode(&raw, bytes, &back));
        assert_memory_equal(&back, &frame[i], sizeof back);
    }
}

static void what_no_wire_carries_is_not_decoded(void **state)
{
    static const struct {
        struct canfd_frame raw;
        size_t bytes;
    } bad[] = {
        { { .can_id = 1, .len = 9 }, CAN_MTU },
        { { .can_id = 1, .len = 255 }, CAN_MTU },
        { { .can_id = 1, .len = 65 }, CANFD_MTU },
        { { .can_id = 1, .len = 13 }, CANFD_MTU },
        { { .can_id = 1, .len = 1 }, 15 },
        { { .can_id = 1, .len = 1 }, 0 },
        { { .can_id = CAN_ERR_FLAG | 0x40, .len = 8 }, CAN_MTU },
        { { .can_id = CAN_RTR_FLAG | 1, .len = 1 }, CANFD_MTU },
    };
    struct hal_can_frame frame;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(bad); i++)
        assert_false(can_frame_decode(&bad[i].raw, bad[i].bytes, &frame));
}

/* linux/can/error.h: class in the identifier, details in data[1..4], counters
 * in data[6..7] when 0x200 says so. */
static void error_frames_change_the_state(void **state)
{
    static const struct {
        uint32_t id;
        uint8_t controller, tx, rx;
        enum hal_can_state from, to;
        unsigned errors, warnings, passives, bus_offs;
    } row[] = {
        { 0x204, 0x08, 100, 50, HAL_CAN_ACTIVE, HAL_CAN_WARNING, 0, 1, 0, 0 },
        { 0x204, 0x04, 0, 96, HAL_CAN_ACTIVE, HAL_CAN_WARNING, 0, 1, 0, 0 },
        { 0x204, 0x20, 128, 0, HAL_CAN_WARNING, HAL_CAN_PASSIVE, 0, 0, 1, 0 },
        { 0x204, 0x10, 0, 128, HAL_CAN_ACTIVE, HAL_CAN_PASSIVE, 0, 0, 1, 0 },
        { 0x204, 0x20, 130, 0, HAL_CAN_PASSIVE, HAL_CAN_PASSIVE, 0, 0, 0, 0 },
        { 0x204, 0x14, 99, 128, HAL_CAN_WARNING, HAL_CAN_PASSIVE, 0, 0, 1, 0 },
        { 0x204, 0x40, 0, 0, HAL_CAN_PASSIVE, HAL_CAN_ACTIVE, 0, 0, 0, 0 },
        { 0x040, 0x00, 0, 0, HAL_CAN_PASSIVE, HAL_CAN_BUS_OFF, 0, 0, 0, 1 },
        { 0x100, 0x00, 0, 0, HAL_CAN_BUS_OFF, HAL_CAN_ACTIVE, 0, 0, 0, 0 },
        { 0x0A8, 0x00, 0, 0, HAL_CAN_ACTIVE, HAL_CAN_ACTIVE, 1, 0, 0, 0 },
        { 0x204, 0x08, 100, 0, HAL_CAN_PASSIVE, HAL_CAN_WARNING, 0, 0, 0, 0 },
        { 0x002, 0x00, 0, 0, HAL_CAN_WARNING, HAL_CAN_WARNING, 0, 0, 0, 0 },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        const struct canfd_frame raw = {
            .can_id = CAN_ERR_FLAG | row[i].id,
            .len = 8,
            .data = { [1] = row[i].controller,
                      [6] = row[i].tx,
                      [7] = row[i].rx },
        };
        struct hal_can_stats stats = { .tx_errors = 7 };

        assert_true(can_frame_is_error(&raw));
        if (can_frame_error(&raw, row[i].from, &stats) != row[i].to ||
            stats.errors != row[i].errors ||
            stats.warnings != row[i].warnings ||
            stats.passives != row[i].passives ||
            stats.bus_offs != row[i].bus_offs)
            fail_msg("row %zu", i);
        assert_int_equal(stats.tx_errors, row[i].id & 0x200 ? row[i].tx : 7);
    }
}

static void time_stamps_become_monotonic(void **state)
{
    struct can_stamp stamp = { 0 };
    const int64_t real = 1700000000 * S, now = 500 * S;

    (void)state;
    /* the kernel's, 3 ms ago */
    assert_int_equal(can_stamp_monotonic(&stamp, real - 3 * MS, 0, real, now),
                     now - 3 * MS);
    /* none, from the future, and from before somebody set the clock */
    assert_int_equal(can_stamp_monotonic(&stamp, 0, 0, real, now), now);
    assert_int_equal(can_stamp_monotonic(&stamp, real + MS, 0, real, now), now);
    assert_int_equal(can_stamp_monotonic(&stamp, real - 3600 * S, 0, real, now),
                     now);
    assert_int_equal(can_stamp_monotonic(&stamp, real + 3600 * S, 0, real, now),
                     now);
}

/* A card whose clock began at 7 s and runs 50 ppm fast; frames are read 20 us
 * to 2 ms after they were there.  After some frames the time is better than
 * that. */
static void a_cards_own_clock_takes_the_reading_out(void **state)
{
    struct can_stamp stamp = { 0 };
    uint64_t seed = 11;
    int64_t worst_ns = 0;

    (void)state;
    for (int i = 0; i < 5000; i++) {
        const int64_t there = 100 * S + i * MS;
        const int64_t card = 7 * S + i * MS + i * 50;
        const int64_t late = check_random_in(&seed, 0, 9) == 0
                                 ? 20000
                                 : check_random_in(&seed, 20000, 2000000);
        const int64_t read = there + late;
        const int64_t got = can_stamp_monotonic(
            &stamp, 1 * S + read, card, 1 * S + read + 1000, read + 1000);
        const int64_t error = got - there;

        assert_true(got <= read);
        if (i > 100)
            worst_ns = error > worst_ns ? error : worst_ns;
        assert_true(error > -200000);
    }
    assert_true(worst_ns < 100000);
}

static void interfaces_that_will_not_do_are_named(void **state)
{
    static const struct {
        struct can_socketcan_config config;
        int err;
        const char *text;
    } row[] = {
        { { .interface = "nocan7" }, MOTION_E_EMPTY, "no interface nocan7" },
        { { .interface = "" }, MOTION_E_ARG, "no interface" },
        { { .interface = "a-name-that-is-too-long" },
          MOTION_E_ARG,
          "no interface a-name" },
        { { .interface = "lo" }, MOTION_E_ARG, "lo is not a CAN interface" },
        { { .interface = "lo", .filter_count = 33 },
          MOTION_E_ARG,
          "33 filters" },
        { { .interface = "lo", .queue_frames = 8 },
          MOTION_E_ARG,
          "a queue of 8 frames" },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        struct can_socketcan port;
        char message[CAN_SOCKETCAN_MESSAGE_MAX] = "";

        assert_int_equal(can_socketcan_open(&port, &row[i].config, message),
                         row[i].err);
        if (strstr(message, row[i].text) == NULL)
            fail_msg("%s", message);
        assert_int_equal(can_socketcan_fd(&port), -1);
    }
}

static void states_have_words(void **state)
{
    (void)state;
    assert_string_equal(hal_can_state_text(HAL_CAN_BUS_OFF), "bus-off");
    assert_string_equal(hal_can_state_text(HAL_CAN_DOWN), "interface down");
    assert_string_equal(hal_can_state_text((enum hal_can_state)77),
                        "unknown state");
}

/* ---- with CAN ---- */

static void pass(int64_t ns)
{
    const struct timespec pause = { .tv_sec = ns / S, .tv_nsec = ns % S };

    nanosleep(&pause, NULL);
}

/* The next frame; for ever, for what is on its way. */
static void await(struct can_socketcan *port, struct hal_can_frame *frame)
{
    for (int i = 0; hal_can_recv(&port->can, frame) != 1; i++) {
        pass(MS);
        assert_true(i < 20000);
    }
}

static void must_open(struct can_socketcan *port,
                      const struct can_socketcan_config *config)
{
    char message[CAN_SOCKETCAN_MESSAGE_MAX];

    if (can_socketcan_open(port, config, message) < 0)
        fail_msg("%s", message);
}

static int set_link(const char *name, bool up, int queue)
{
    struct ifreq request = { 0 };
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    int err;

    snprintf(request.ifr_name, sizeof request.ifr_name, "%s", name);
    request.ifr_qlen = queue;
    err = ioctl(fd, SIOCSIFTXQLEN, &request);
    if (err == 0)
        err = ioctl(fd, SIOCGIFFLAGS, &request);
    if (up)
        request.ifr_flags |= IFF_UP;
    else
        request.ifr_flags &= (short)~IFF_UP;
    if (err == 0)
        err = ioctl(fd, SIOCSIFFLAGS, &request);
    close(fd);
    return err;
}

static void filters_let_only_theirs_through(void **state)
{
    static const struct can_socketcan_filter filter[] = {
        { .id = 0x180, .mask = 0x780 },
        { .id = 0x12345678, .mask = 0x1FFFFFFF, .extended = true },
    };
    static const struct hal_can_frame sent[] = {
        { .id = 0x181 },
        { .id = 0x280 },
        { .id = 0x1FF },
        { .id = 0x12345678, .extended = true },
        { .id = 0x180, .extended = true },
    };
    static const uint32_t want[] = { 0x181, 0x1FF, 0x12345678 };
    static struct can_socketcan from, to;
    struct hal_can_frame frame;

    (void)state;
    must_open(&from, &(struct can_socketcan_config){ .interface = "vcan0" });
    must_open(&to, &(struct can_socketcan_config){ .interface = "vcan0",
                                                   .filter = filter,
                                                   .filter_count = 2 });
    for (size_t i = 0; i < ARRAY_LEN(sent); i++)
        assert_int_equal(hal_can_send(&from.can, &sent[i]), MOTION_OK);
    assert_int_equal(hal_can_flush(&from.can), MOTION_OK);
    for (size_t i = 0; i < ARRAY_LEN(want); i++) {
        await(&to, &frame);
        assert_int_equal(frame.id, want[i]);
    }
    assert_int_equal(hal_can_recv(&to.can, &frame), 0);
    can_socketcan_close(&from);
    can_socketcan_close(&to);
}

/* The receive buffer is the kernel's: far more than one bus cycle waits there,
 * and what is lost beyond it is counted. */
static void thousands_wait_and_the_lost_are_counted(void **state)
{
    static struct can_socketcan from, to;
    struct hal_can_frame frame = { .id = 1, .len = 8 };
    struct hal_can_stats stats;
    unsigned sent = 0, got = 0;

    (void)state;
    must_open(&from, &(struct can_socketcan_config){ .interface = "vcan0" });
    must_open(&to, &(struct can_socketcan_config){ .interface = "vcan0" });
    for (; sent < 20000; sent++) {
        assert_int_equal(hal_can_send(&from.can, &frame), MOTION_OK);
        assert_int_equal(hal_can_flush(&from.can), MOTION_OK);
    }
    while (hal_can_recv(&to.can, &frame) == 1)
        got++;
    assert_int_equal(hal_can_send(&from.can, &frame), MOTION_OK);
    assert_int_equal(hal_can_flush(&from.can), MOTION_OK);
    pass(20 * MS); /* the count comes with the next frame */
    while (hal_can_recv(&to.can, &frame) == 1)
        got++;
    hal_can_stats(&to.can, &stats);
    assert_true(got > 1000);
    assert_int_equal(got + stats.dropped, sent + 1);
    assert_int_equal(stats.received, got);
    can_socketcan_close(&from);
    can_socketcan_close(&to);
}

static void a_wrong_setting_is_refused_with_its_remedy(void **state)
{
    static struct can_socketcan port;
    char message[CAN_SOCKETCAN_MESSAGE_MAX] = "";
    struct can_socketcan_config config = { .interface = "can0",
                                           .bit_rate = 500000 };

    (void)state;
    assert_true(can_socketcan_open(&port, &config, message) < 0);
    assert_non_null(strstr(message, "runs at 1000000 bit/s, expected 500000"));
    config = (struct can_socketcan_config){ .interface = "can0", .fd = true };
    assert_true(can_socketcan_open(&port, &config, message) < 0);
    assert_non_null(strstr(message, "takes no FD frames"));
    assert_int_equal(set_link("vcan1", false, 1000), 0);
    config = (struct can_socketcan_config){ .interface = "vcan1" };
    assert_true(can_socketcan_open(&port, &config, message) < 0);
    assert_non_null(strstr(message, "is down; bring it up"));
    assert_int_equal(set_link("vcan1", true, 10), 0);
    assert_true(can_socketcan_open(&port, &config, message) < 0);
    assert_non_null(strstr(message, "queues only 10 frames"));
    assert_int_equal(set_link("vcan1", true, 1000), 0);
}

/* ---- a card that the test plays: slcan on a pseudo-terminal ---- */

struct card {
    int line, tty; /* the card's end, and the kernel's */
    char name[CAN_LINK_NAME_MAX];
    struct can_socketcan port;
};

static void card_plug(struct card *card)
{
    const int discipline = LINE_DISCIPLINE_SLCAN;
    struct termios raw;
    struct ifreq request = { 0 };

    card->line = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    assert_true(card->line >= 0 && grantpt(card->line) == 0 &&
                unlockpt(card->line) == 0);
    card->tty = open(ptsname(card->line), O_RDWR | O_NOCTTY);
    assert_true(card->tty >= 0 && tcgetattr(card->tty, &raw) == 0);
    cfmakeraw(&raw);
    assert_int_equal(tcsetattr(card->tty, TCSANOW, &raw), 0);
    assert_int_equal(ioctl(card->tty, TIOCSETD, &discipline), 0);
    assert_int_equal(ioctl(card->tty, SIOCGIFNAME, &request), 0);
    snprintf(card->name, sizeof card->name, "%.15s", request.ifr_name);
}

/* The kernel opens the card with commands that it must have taken. */
static void card_up(struct card *card)
{
    char taken[64], command[96];
    pid_t child;
    int status;

    snprintf(command, sizeof command,
             "ip link set %s up txqueuelen 64 type can bitrate 1000000",
             card->name);
    child = fork();
    assert_true(child >= 0);
    if (child == 0)
        _exit(execl("/bin/sh", "sh", "-c", command, (char *)NULL));
    while (waitpid(child, &status, WNOHANG) == 0) {
        (void)!read(card->line, taken, sizeof taken);
        pass(MS);
    }
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    while (read(card->line, taken, sizeof taken) > 0)
        ;
}

static void card_new(struct card *card)
{
    *card = (struct card){ .line = -1 };
    card_plug(card);
    card_up(card);
    must_open(&card->port, &(struct can_socketcan_config){
                               .interface = card->name, .bit_rate = 1000000 });
}

static void card_end(struct card *card)
{
    can_socketcan_close(&card->port);
    close(card->tty);
    close(card->line);
}

static void await_state(struct can_socketcan *port, enum hal_can_state want)
{
    struct hal_can_frame frame;

    for (int i = 0; hal_can_state(&port->can) != (int)want; i++) {
        pass(10 * MS);
        (void)hal_can_recv(&port->can, &frame);
        if (i > 2000)
            fail_msg("%s, expected %s",
                     hal_can_state_text(
                         (enum hal_can_state)hal_can_state(&port->can)),
                     hal_can_state_text(want));
    }
}

/* The card reports something, and the port takes note. */
static void card_say(struct card *card, const char *text,
                     enum hal_can_state want)
{
    assert_int_equal(write(card->line, text, strlen(text)), strlen(text));
    await_state(&card->port, want);
}

static void a_card_goes_passive_and_off_and_says_so(void **state)
{
    static struct card card;
    struct hal_can_frame frame = { .id = 1 };
    struct hal_can_stats stats;

    (void)state;
    card_new(&card);
    assert_int_equal(hal_can_state(&card.port.can), HAL_CAN_ACTIVE);
    card_say(&card, "sw100050\r", HAL_CAN_WARNING);
    card_say(&card, "sp128050\r", HAL_CAN_PASSIVE);
    hal_can_stats(&card.port.can, &stats);
    assert_int_equal(stats.rx_errors + stats.tx_errors, 178);
    card_say(&card, "sa000000\r", HAL_CAN_ACTIVE);
    card_say(&card, "sb000256\r", HAL_CAN_BUS_OFF);
    /* the kernel would take it, and throw it away */
    assert_int_equal(hal_can_send(&card.port.can, &frame), MOTION_E_IO);
    hal_can_stats(&card.port.can, &stats);
    assert_int_equal(stats.warnings, 1);
    assert_int_equal(stats.passives, 1);
    assert_int_equal(stats.bus_offs, 1);
    card_end(&card);
}

/* Nobody takes the frames off the line: the queue fills, and what does not fit
 * is refused at once, never kept. */
static void a_stuck_card_refuses_and_does_not_block(void **state)
{
    static struct card card;
    struct hal_can_frame frame = { .id = 0x123, .len = 8 };
    struct hal_can_stats stats;
    struct timespec t0, t1;
    unsigned full = 0, taken = 0;

    (void)state;
    card_new(&card);
    clock_gettime(CLOCK_MONOTONIC, &t0);
    for (unsigned i = 0; i < 1000; i++) {
        assert_int_equal(hal_can_send(&card.port.can, &frame), MOTION_OK);
        switch (hal_can_flush(&card.port.can)) {
        case MOTION_OK:
            taken++;
            break;
        case MOTION_E_FULL:
            full++;
            break;
        default:
            fail();
        }
    }
    clock_gettime(CLOCK_MONOTONIC, &t1);
    hal_can_stats(&card.port.can, &stats);
    assert_int_equal(stats.sent, taken);
    assert_int_equal(stats.refused, full);
    assert_true(full > 500);
    assert_true(t1.tv_sec - t0.tv_sec < 5);
    card_end(&card);
}

static void an_unplugged_card_comes_back(void **state)
{
    static struct card card;
    struct hal_can_frame frame = { .id = 1 };
    char name[CAN_LINK_NAME_MAX];

    (void)state;
    card_new(&card);
    close(card.tty); /* the interface goes with it */
    close(card.line);
    await_state(&card.port, HAL_CAN_DOWN);
    assert_int_equal(hal_can_send(&card.port.can, &frame), MOTION_E_IO);
    assert_int_equal(hal_can_recv(&card.port.can, &frame), MOTION_E_IO);

    snprintf(name, sizeof name, "%s", card.name);
    card_plug(&card);
    assert_string_equal(card.name, name);
    card_up(&card);
    await_state(&card.port, HAL_CAN_ACTIVE);
    assert_int_equal(write(card.line, "t20021234\r", 10), 10);
    await(&card.port, &frame);
    assert_int_equal(frame.id, 0x200);
    assert_int_equal(frame.data[1], 0x34);
    card_end(&card);
}

int main(int argc, char *argv[])
{
    const struct CMUnitTest anywhere[] = {
        cmocka_unit_test(frames_go_to_the_kernel_and_back),
        cmocka_unit_test(what_no_wire_carries_is_not_decoded),
        cmocka_unit_test(error_frames_change_the_state),
        cmocka_unit_test(time_stamps_become_monotonic),
        cmocka_unit_test(a_cards_own_clock_takes_the_reading_out),
        cmocka_unit_test(interfaces_that_will_not_do_are_named),
        cmocka_unit_test(states_have_words),
    };
    const struct CMUnitTest machine[] = {
        cmocka_unit_test(filters_let_only_theirs_through),
        cmocka_unit_test(thousands_wait_and_the_lost_are_counted),
        cmocka_unit_test(a_wrong_setting_is_refused_with_its_remedy),
        cmocka_unit_test(a_card_goes_passive_and_off_and_says_so),
        cmocka_unit_test(a_stuck_card_refuses_and_does_not_block),
        cmocka_unit_test(an_unplugged_card_comes_back),
    };
    int failed = cmocka_run_group_tests(anywhere, NULL, NULL);

    if (argc > 1 && strcmp(argv[1], "vm") == 0)
        failed += cmocka_run_group_tests(machine, NULL, NULL);
    return failed;
}

/* tests/hal/linux/test_rs485.c - what a serial port is told around every frame
 * so that an RS-485 line has one speaker: a pseudo-terminal with modem lines
 * that this file gives it (ioctl and write are replaced for the whole program),
 * and one without, as it is.  Reads the real clock. */
#define _GNU_SOURCE /* TIOCGRS485; mkdtemp, nftw */
#include "tests/support/run_slew.h"

#include <linux/serial.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <time.h>

#include "tests/hal/linux/libmodbus_bench.h"

/* ---- the port's modem lines ---- */

enum happened { RTS_LOW, RTS_HIGH, SENT, KERNEL };

struct event {
    enum happened what;
    int fd;
    int64_t t_ns;
    size_t bytes;
};

#define EVENTS_MAX 256
static struct event event[EVENTS_MAX];
static _Atomic unsigned events;
static _Atomic bool has_lines;
static _Atomic int lines;
static struct serial_rs485 kernel;
static struct clock_linux clock_now;

static void note(enum happened what, int fd, size_t bytes)
{
    const unsigned i = atomic_fetch_add(&events, 1);

    if (i < EVENTS_MAX)
        event[i] = (struct event){ what, fd, hal_clock_now_ns(&clock_now.clock),
                                   bytes };
}

static int modem(int fd, unsigned long request, void *argument)
{
    int *bits = argument;

    switch (request) {
    case TIOCMGET:
        *bits = atomic_load(&lines);
        return 0;
    case TIOCMSET:
        atomic_store(&lines, *bits);
        note((*bits & TIOCM_RTS) != 0 ? RTS_HIGH : RTS_LOW, fd, 0);
        return 0;
    case TIOCGRS485:
        memcpy(argument, &kernel, sizeof kernel);
        return 0;
    default: /* TIOCSRS485 */
        memcpy(&kernel, argument, sizeof kernel);
        note(KERNEL, fd, 0);
        return 0;
    }
}

int ioctl(int fd, unsigned long request, ...)
{
    va_list rest;

    va_start(rest, request);
    void *argument = va_arg(rest, void *);
    va_end(rest);
    if (atomic_load(&has_lines) &&
        (request == TIOCMGET || request == TIOCMSET || request == TIOCGRS485 ||
         request == TIOCSRS485))
        return modem(fd, request, argument);
    return (int)syscall(SYS_ioctl, fd, request, argument);
}

/* The program's write. */
ssize_t port_write(int fd, const void *data, size_t bytes) __asm__("write");

ssize_t port_write(int fd, const void *data, size_t bytes)
{
    if (atomic_load(&has_lines))
        note(SENT, fd, bytes);
    return syscall(SYS_write, fd, data, bytes);
}

/* ---- a device that answers as it should ---- */

static const struct modbus_rtu_line line = { .baud = 19200,
                                             .parity = MODBUS_PARITY_NONE,
                                             .stop_bits = 2 };

static struct libmodbus_bench bench;

static void begin(bool with_lines, enum modbus_line_rs485 rs485,
                  int64_t delay_ns)
{
    const struct modbus_line_config config = { .line = line,
                                               .timeout_ns = 2000 * MS,
                                               .rs485 = rs485,
                                               .rts_delay_ns = delay_ns };

    (void)clock_linux_init(&clock_now);
    atomic_store(&events, 0);
    atomic_store(&lines, TIOCM_DTR | TIOCM_RTS);
    atomic_store(&has_lines, with_lines);
    kernel = (struct serial_rs485){ .flags = SER_RS485_RTS_ON_SEND };
    libmodbus_bench_pty(&bench, config, 20 * MS);
}

static void end(void)
{
    libmodbus_bench_end(&bench);
    atomic_store(&has_lines, false);
}

/* Also where a claim has failed. */
static int down(void **state)
{
    (void)state;
    end();
    return 0;
}

static struct hal_modbus_reply read_at(uint16_t address)
{
    return libmodbus_bench_read(&bench, address);
}

/* ---- claims ---- */

#define READS    5
#define DELAY_NS (3 * MS)
#define FRAME    8 /* bytes of a read */
/* 8 characters of 11 bits at 19200 */
#define FRAME_NS INT64_C(4583333)

/* What the port was told, of the descriptor that has modem lines. */
static unsigned own_events(struct event own[])
{
    unsigned count = 0, fd = 0;

    for (unsigned i = 0; i < atomic_load(&events) && i < EVENTS_MAX; i++)
        if (event[i].what != SENT) {
            fd = (unsigned)event[i].fd;
            break;
        }
    for (unsigned i = 0; i < atomic_load(&events) && i < EVENTS_MAX; i++)
        if ((unsigned)event[i].fd == fd)
            own[count++] = event[i];
    return count;
}

/* Before the first frame it listens; around each: to sending, the delay, the
 * frame, its time on the wire and the delay, to listening. */
static void rts_goes_around_every_frame(void **state)
{
    static const struct {
        enum modbus_line_rs485 rs485;
        enum happened sends, listens;
    } rows[] = { { RS485_RTS_UP, RTS_HIGH, RTS_LOW },
                 { RS485_RTS_DOWN, RTS_LOW, RTS_HIGH } };
    struct event own[EVENTS_MAX];

    (void)state;
    for (unsigned row = 0; row < ARRAY_LEN(rows); row++) {
        begin(true, rows[row].rs485, DELAY_NS);
        for (uint16_t i = 0; i < READS; i++) {
            const struct hal_modbus_reply reply = read_at(i);

            assert_int_equal(reply.err, MOTION_OK);
            assert_int_equal(reply.value[0], bench.bank.reg[i]);
        }
        end();
        assert_int_equal(own_events(own), 1 + 3 * READS);
        assert_int_equal(own[0].what, rows[row].listens);
        for (unsigned i = 0; i < READS; i++) {
            const struct event *at = &own[1 + 3 * i];

            assert_int_equal(at[0].what, rows[row].sends);
            assert_int_equal(at[1].what, SENT);
            assert_int_equal(at[1].bytes, FRAME);
            assert_int_equal(at[2].what, rows[row].listens);
            assert_true(at[1].t_ns - at[0].t_ns >= DELAY_NS);
            assert_true(at[2].t_ns - at[1].t_ns >=
                        DELAY_NS + FRAME_NS * 9 / 10);
        }
        assert_int_equal(atomic_load(&lines) & TIOCM_DTR, TIOCM_DTR);
    }
}

static void the_kernel_is_told_once(void **state)
{
    struct event own[EVENTS_MAX];

    (void)state;
    begin(true, RS485_KERNEL, 2 * MS);
    assert_int_equal(read_at(7).err, MOTION_OK);
    end();
    assert_int_equal(own_events(own), 2);
    assert_int_equal(own[0].what, KERNEL);
    assert_int_equal(own[1].what, SENT);
    assert_int_equal(kernel.flags, SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND);
    assert_int_equal(kernel.delay_rts_before_send, 2);
    assert_int_equal(kernel.delay_rts_after_send, 2);
}

static void automatic_touches_no_line(void **state)
{
    (void)state;
    begin(true, RS485_AUTOMATIC, 0);
    assert_int_equal(read_at(7).err, MOTION_OK);
    end();
    for (unsigned i = 0; i < atomic_load(&events); i++)
        assert_int_equal(event[i].what, SENT);
}

/* A pseudo-terminal has no such lines: nothing is ever sent. */
static void a_port_without_lines_is_not_used(void **state)
{
    (void)state;
    for (enum modbus_line_rs485 rs485 = RS485_KERNEL; rs485 <= RS485_RTS_DOWN;
         rs485++) {
        begin(false, rs485, 0);
        assert_int_equal(read_at(7).err, MOTION_E_IO);
        assert_int_equal(hal_modbus_is_up(&bench.libmodbus.modbus), 0);
        end();
        assert_int_equal(bench.bank.reads, 0);
    }
}

static void the_program_says_so_in_a_sentence(void **state)
{
    static const struct {
        const char *rs485, *want;
    } rows[] = {
        { "rts-up",
          "has no RTS to switch the direction of RS-485 with "
          "(Inappropriate ioctl for device), expected another rs485" },
        { "rts-down, rts_delay: 500 us",
          "has no RTS to switch the direction of RS-485 with" },
        { "kernel, rts_delay: 2 ms",
          "its driver does not switch the direction of RS-485 (" },
    };
    char rig[1024];

    (void)state;
    begin(false, RS485_AUTOMATIC, 0);
    run_put("move.yaml",
            "axes: {a: {curve: parabolic, keys: [[0 s, 0], [2 s, 10]]}}\n");
    for (unsigned i = 0; i < ARRAY_LEN(rows); i++) {
        snprintf(
            rig, sizeof rig,
            "buses:\n"
            "  l: {kind: modbus-rtu, device: %s, baud: 115200, rs485: %s}\n"
            "axes:\n"
            "  a:\n"
            "    unit: deg\n"
            "    limits: {position: [-90, 90], velocity: 30, "
            "acceleration: 30}\n"
            "    following_error: {floor: 5}\n"
            "    drive: {kind: modbus, bus: l, node: 9, map: "
            "leadshine-el7, counts: 1000, unsupervised: yes}\n",
            bench.host.path, rows[i].rs485);
        run_put("rig.yaml", rig);
        run("run", "--real", "--yes", run_slew()->directory);
        run_expect(STATUS_INPUT);
        run_complains("bus l: ");
        run_complains(rows[i].want);
    }
    end();
}

int main(void)
{
#define RUN(test) cmocka_unit_test_teardown(test, down)
    const struct CMUnitTest tests[] = {
        RUN(rts_goes_around_every_frame),
        RUN(the_kernel_is_told_once),
        RUN(automatic_touches_no_line),
        RUN(a_port_without_lines_is_not_used),
        RUN(the_program_says_so_in_a_sentence),
    };
    return cmocka_run_group_tests(tests, run_open, run_close);
}

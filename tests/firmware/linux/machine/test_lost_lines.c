/* tests/firmware/linux/machine/test_lost_lines.c - as test_lost_modbus.c, by
 * libmodbus on real TCP connections and pseudo-terminals: four drives at a
 * time, on the real clock.  Reads the real clock.
 * Takes long. */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "firmware/linux/machine/modbus_host.h"
#include "hal/linux/libmodbus.h"
#include "hal/modbus/tcp.h"
#include "tests/hal/drive/modbus/strict_bench.h"

#define LINES      4
#define TICK_NS    (2 * MS)
#define TIMEOUT_NS (200 * MS) /* this machine has other things to do */
#define CYCLE_NS   (30 * MS)

enum corrupt {
    CORRUPT_NONE,
    CORRUPT_LATE,
    CORRUPT_MUTE,
    CORRUPT_UNIT,
    CORRUPT_TRANSACTION,
    CORRUPT_CLOSE, /* once; it listens on */
    CORRUPT_AWAY,  /* every one, until it is told otherwise */
    CORRUPT_ANY,   /* by the line's shares */
};

struct line {
    struct strict_bench bench;
    struct modbus_libmodbus libmodbus;
    struct modbus_host host; /* a terminal; TCP is served here */
    pthread_t device;
    int listener, fd;
    _Atomic int corrupt;
    _Atomic bool stop;
    bool is_tcp, streamed, broke;
    /* Shares in 1000 of answers that are late, behind stray bytes, of another
     * transaction, and of connections that close and are taken again up to two
     * time-outs later */
    unsigned late, strays, others, closes;
    uint64_t seed;
    int64_t busy_ns; /* it takes none until then */
};

static struct line line[LINES];

static int64_t clock_ns(void)
{
    struct timespec now;

    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

static void rest_ns(int64_t dur_ns)
{
    const struct timespec time = { dur_ns / 1000000000, dur_ns % 1000000000 };

    (void)nanosleep(&time, NULL);
}

/* ---- the device on TCP ---- */

static void device_close(struct line *self)
{
    if (self->fd >= 0)
        (void)close(self->fd);
    self->fd = -1;
}

static bool device_draws(struct line *self, unsigned share)
{
    return (unsigned)check_random_in(&self->seed, 0, 999) < share;
}

/* Few connections: it takes the next one only when it has seen that the last is
 * gone. */
static void device_drop(struct line *self)
{
    device_close(self);
    self->busy_ns =
        clock_ns() + check_random_in(&self->seed, 0, 2 * TIMEOUT_NS);
}

static void device_trouble(struct line *self, uint8_t *frame)
{
    uint8_t strays[3];

    if (device_draws(self, self->late))
        rest_ns(check_random_in(&self->seed, 0, 3 * TIMEOUT_NS / 2));
    for (unsigned i = 0; i < sizeof strays; i++)
        strays[i] = (uint8_t)check_random(&self->seed);
    if (device_draws(self, self->strays))
        (void)send(self->fd, strays, 1 + strays[0] % sizeof strays,
                   MSG_NOSIGNAL);
    if (device_draws(self, self->others))
        modbus_pdu_set(frame, (uint16_t)(modbus_pdu_get(frame) + 1));
    if (device_draws(self, self->closes))
        device_drop(self);
}

static void device_send(struct line *self, uint8_t *frame, unsigned length)
{
    switch ((enum corrupt)atomic_load(&self->corrupt)) {
    case CORRUPT_MUTE:
        return;
    case CORRUPT_LATE:
        rest_ns(2 * TIMEOUT_NS);
        break;
    case CORRUPT_UNIT:
        frame[6]++;
        break;
    case CORRUPT_TRANSACTION:
        modbus_pdu_set(frame, (uint16_t)(modbus_pdu_get(frame) + 1));
        break;
    case CORRUPT_ANY:
        device_trouble(self, frame);
        break;
    case CORRUPT_NONE:
    case CORRUPT_CLOSE:
    case CORRUPT_AWAY:
        break;
    }
    (void)send(self->fd, frame, length, MSG_NOSIGNAL);
}

static void device_serve(struct line *self)
{
    uint8_t request[MODBUS_TCP_FRAME_MAX], frame[MODBUS_TCP_FRAME_MAX];
    ssize_t got = recv(self->fd, request, MODBUS_TCP_HEAD, MSG_WAITALL);
    unsigned length;

    if (got == MODBUS_TCP_HEAD)
        got +=
            recv(self->fd, request + MODBUS_TCP_HEAD,
                 modbus_tcp_whole(request, MODBUS_TCP_HEAD) - MODBUS_TCP_HEAD,
                 MSG_WAITALL);
    if (got < MODBUS_TCP_HEAD + 1) {
        device_close(self);
        return;
    }
    length = modbus_slave_serve(
        &self->bench.servo.slave, request + MODBUS_TCP_HEAD,
        (unsigned)got - MODBUS_TCP_HEAD, frame + MODBUS_TCP_HEAD);
    device_send(
        self, frame,
        modbus_tcp_seal(frame, modbus_pdu_get(request), request[6], length));
}

static void device_accept(struct line *self)
{
    const int fd = accept(self->listener, NULL, NULL);

    if (clock_ns() < self->busy_ns) {
        (void)close(fd);
        return;
    }
    device_close(self);
    self->fd = fd;
}

static void *device_run(void *context)
{
    struct line *self = context;

    while (!atomic_load(&self->stop)) {
        struct pollfd wait[2] = { { .fd = self->listener, .events = POLLIN },
                                  { .fd = self->fd, .events = POLLIN } };
        int close_once = CORRUPT_CLOSE;

        if (atomic_compare_exchange_strong(&self->corrupt, &close_once,
                                           CORRUPT_NONE) ||
            close_once == CORRUPT_AWAY)
            device_close(self);
        (void)poll(wait, 2, 1);
        sim_world_run(&self->bench.world, clock_ns());
        if ((wait[1].revents & (POLLIN | POLLHUP)) != 0 && self->fd >= 0)
            device_serve(self);
        if ((wait[0].revents & POLLIN) != 0)
            device_accept(self);
    }
    device_close(self);
    return NULL;
}

static void open_tcp(struct line *self)
{
    struct modbus_line_config config = { .timeout_ns = TIMEOUT_NS };
    struct sockaddr_in at = { .sin_family = AF_INET };
    socklen_t size = sizeof at;

    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    self->fd = -1;
    self->listener = socket(AF_INET, SOCK_STREAM, 0);
    assert_true(self->listener >= 0 &&
                bind(self->listener, (struct sockaddr *)&at, sizeof at) == 0 &&
                listen(self->listener, 4) == 0 &&
                getsockname(self->listener, (struct sockaddr *)&at, &size) ==
                    0);
    assert_int_equal(pthread_create(&self->device, NULL, device_run, self), 0);
    (void)snprintf(config.host, sizeof config.host, "127.0.0.1");
    config.port = ntohs(at.sin_port);
    assert_int_equal(modbus_libmodbus_open(&self->libmodbus, &config), 0);
}

/* ---- the device on a terminal ---- */

static void open_terminal(struct line *self)
{
    struct strict_bench *bench = &self->bench;
    const struct modbus_rtu_line rtu = { .baud = 115200,
                                         .parity = MODBUS_PARITY_NONE,
                                         .stop_bits = 1 };
    struct modbus_line_config config = { .timeout_ns = TIMEOUT_NS,
                                         .line = rtu };

    assert_int_equal(sim_modbus_line_init(&bench->wire, &bench->world, &rtu),
                     0);
    assert_int_equal(modbus_rtu_slave_init(&bench->rtu, &bench->servo.slave,
                                           STRICT_UNIT, &rtu, MS),
                     0);
    sim_modbus_faulty_init(&bench->faulty, &bench->rtu.station, 4711);
    assert_int_equal(sim_modbus_seat_init(&bench->device_seat, &bench->wire,
                                          &bench->faulty.station),
                     0);
    modbus_host_init(&self->host, &bench->world);
    assert_int_equal(modbus_host_pty(&self->host, &bench->wire), 0);
    memcpy(config.device, self->host.path, sizeof self->host.path);
    assert_int_equal(modbus_host_start(&self->host), 0);
    assert_int_equal(modbus_libmodbus_open(&self->libmodbus, &config), 0);
}

static void corrupt(struct line *self, enum corrupt corrupt)
{
    static const enum sim_modbus_fault fault[] = {
        [CORRUPT_LATE] = SIM_MODBUS_LATE,
        [CORRUPT_MUTE] = SIM_MODBUS_MUTE,
        [CORRUPT_UNIT] = SIM_MODBUS_OTHER_UNIT,
        [CORRUPT_TRANSACTION] = SIM_MODBUS_WRONG_CRC,
        [CORRUPT_CLOSE] = SIM_MODBUS_GOOD,
    };

    if (self->is_tcp) {
        atomic_store(&self->corrupt, corrupt);
        return;
    }
    self->bench.faulty.from.late_ns = 2 * TIMEOUT_NS;
    self->bench.faulty.from.fault = fault[corrupt];
}

/* ---- the driver ---- */

static void open_line(struct line *self, enum strict_modbus_kind kind,
                      bool is_tcp, bool streamed)
{
    const struct modbus_rtu_line rtu = { .baud = 115200,
                                         .parity = MODBUS_PARITY_NONE,
                                         .stop_bits = 1 };
    struct strict_bench *bench = &self->bench;
    struct drive_modbus_config config;
    struct modbus_rtu_time time;

    memset(self, 0, sizeof *self);
    self->is_tcp = is_tcp;
    self->streamed = streamed;
    strict_bench_load(bench, kind);
    sim_world_init(&bench->world, clock_ns());
    strict_modbus_init(&bench->servo, &bench->world, kind, 12345);
    if (!streamed) {
        bench->servo.speed = 2 * STRICT_COUNTS;
        bench->servo.ramp = 20 * STRICT_COUNTS;
    }
    if (is_tcp)
        open_tcp(self);
    else
        open_terminal(self);
    assert_int_equal(modbus_bus_init(&bench->bus, &self->libmodbus.modbus, 2),
                     0);
    assert_int_equal(modbus_rtu_time_init(&time, &rtu), 0);
    config = strict_bench_config(bench, &time);
    config.cycle_ns = CYCLE_NS;
    assert_int_equal(drive_modbus_init(&bench->drive, &bench->bus, &config), 0);
}

static void close_line(struct line *self)
{
    modbus_libmodbus_close(&self->libmodbus);
    if (!self->is_tcp) {
        modbus_host_stop(&self->host);
        return;
    }
    atomic_store(&self->stop, true);
    (void)pthread_join(self->device, NULL);
    (void)close(self->listener);
}

static void tick(struct line *self, int64_t now_ns)
{
    struct strict_bench *bench = &self->bench;

    if (hal_fieldbus_begin(&bench->bus.fieldbus, now_ns) == HAL_FIELDBUS_DOWN)
        self->broke = true;
    hal_drive_feedback(&bench->drive.drive, &bench->feedback);
    if (bench->asks_off && strict_bench_is_down(bench))
        hal_drive_request(&bench->drive.drive, HAL_DRIVE_REQUEST_OFF);
    if (bench->streams && bench->from_ns != 0) { /* 3 units/s */
        bench->target.pos_q32 =
            (int64_t)((bench->from + 3e-9 * (double)(now_ns - bench->from_ns)) *
                      (double)UNIT_Q32);
        bench->target.vel_q32 = 3 * UNIT_Q32;
    }
    if (bench->streams)
        (void)hal_drive_set_target(&bench->drive.drive, &bench->target);
    hal_fieldbus_end(&bench->bus.fieldbus, now_ns);
}

static void pass(int64_t dur_ns)
{
    const int64_t end_ns = clock_ns() + dur_ns;

    for (int64_t now_ns = clock_ns(); now_ns < end_ns; now_ns = clock_ns()) {
        for (unsigned i = 0; i < LINES; i++)
            tick(&line[i], now_ns);
        rest_ns(TICK_NS);
    }
}

static void until(enum hal_drive_state state)
{
    for (unsigned tries = 0; tries < 200; tries++) {
        bool all = true;

        pass(50 * MS);
        for (unsigned i = 0; i < LINES; i++)
            all = all && line[i].bench.feedback.state == state;
        if (all)
            return;
    }
    for (unsigned i = 0; i < LINES; i++)
        print_message("%s: %s: %s\n", line[i].bench.map.title,
                      hal_drive_state_text(line[i].bench.feedback.state),
                      line[i].bench.feedback.fault_text);
    fail_msg("not all are %s", hal_drive_state_text(state));
}

static void begin_move(struct line *self)
{
    const struct hal_drive_go there = { .pos_q32 = 21 * UNIT_Q32,
                                        .vel_q32 = 2 * UNIT_Q32,
                                        .acc_q32 = INT64_C(20) << 32,
                                        .dec_q32 = INT64_C(20) << 32 };
    struct strict_bench *bench = &self->bench;
    struct hal_drive *drive = &bench->drive.drive;

    bench->asks_off = true;
    bench->from = (double)bench->feedback.pos_q32 / (double)UNIT_Q32;
    bench->target =
        (struct hal_drive_target){ .pos_q32 = bench->feedback.pos_q32 };
    bench->streams = self->streamed;
    bench->from_ns = self->streamed ? clock_ns() : 0;
    if (self->streamed)
        return;
    assert_int_equal(hal_drive_set_mode(drive, HAL_DRIVE_PROFILE_POSITION),
                     MOTION_OK);
    assert_int_equal(hal_drive_go(drive, &there), MOTION_OK);
}

/* ---- what must hold ---- */

static void expect_dark(struct line *self, enum corrupt corrupt, bool heals)
{
    const struct strict_bench *bench = &self->bench;
    const char *want =
        heals ? "lost, then switched off: " : "lost; trying to switch it off: ";
    const char *text = bench->feedback.fault_text;

    if (bench->servo.torque || bench->servo.cuts > 0 ||
        !strict_bench_is_down(bench) || strstr(text, want) != text)
        fail_msg("%s, %s, %s, corruption %d: torque %d, %u cuts, %s: %s",
                 bench->map.title, self->is_tcp ? "TCP" : "terminal",
                 self->streamed ? "streamed" : "point to point", (int)corrupt,
                 bench->servo.torque, bench->servo.cuts,
                 hal_drive_state_text(bench->feedback.state), text);
}

static void move_all(bool is_tcp)
{
    for (unsigned i = 0; i < LINES; i++)
        open_line(&line[i], i < 2 ? STRICT_LEXIUM : STRICT_EL7, is_tcp,
                  i % 2 == 0);
    until(HAL_DRIVE_OFF);
    for (unsigned i = 0; i < LINES; i++)
        hal_drive_request(&line[i].bench.drive.drive, HAL_DRIVE_REQUEST_ENABLE);
    until(HAL_DRIVE_ENABLED);
    for (unsigned i = 0; i < LINES; i++)
        begin_move(&line[i]);
    pass(500 * MS);
    for (unsigned i = 0; i < LINES; i++) {
        assert_int_equal(line[i].bench.feedback.state, HAL_DRIVE_ENABLED);
        line[i].broke = false; /* as it was before it was up */
    }
}

static void lose(bool is_tcp, enum corrupt kind, bool heals)
{
    move_all(is_tcp);
    for (unsigned i = 0; i < LINES; i++)
        corrupt(&line[i], kind);
    pass(heals ? 1500 * MS : 5000 * MS);
    for (unsigned i = 0; i < LINES && heals; i++)
        corrupt(&line[i], CORRUPT_NONE);
    if (heals)
        pass(3000 * MS);
    for (unsigned i = 0; i < LINES; i++)
        close_line(&line[i]);
    for (unsigned i = 0; i < LINES; i++)
        expect_dark(&line[i], kind, heals);
}

static void none_on_tcp_keeps_its_torque(void **state)
{
    (void)state;
    lose(true, CORRUPT_LATE, true);
    lose(true, CORRUPT_MUTE, true);
    lose(true, CORRUPT_MUTE, false);
    lose(true, CORRUPT_UNIT, false);
    lose(true, CORRUPT_TRANSACTION, false);
}

/* It closes, and is there again within three time-outs: what the drives say then
 * is what counts. */
static void a_connection_that_is_had_again_goes_on(void **state)
{
    struct hal_modbus_stats stats;

    (void)state;
    move_all(true);
    for (unsigned i = 0; i < LINES; i++)
        corrupt(&line[i], CORRUPT_CLOSE);
    pass(1000 * MS);
    for (unsigned i = 0; i < LINES; i++) {
        assert_int_equal(line[i].bench.feedback.state, HAL_DRIVE_ENABLED);
        assert_false(line[i].broke);
        hal_modbus_stats(&line[i].libmodbus.modbus, &stats);
        assert_int_equal(stats.reconnects, 1);
    }
    for (unsigned i = 0; i < LINES; i++)
        close_line(&line[i]);
}

/* It closes each, for longer. */
static void a_connection_that_broke_is_the_bus_gone(void **state)
{
    (void)state;
    lose(true, CORRUPT_AWAY, true);
    for (unsigned i = 0; i < LINES; i++) {
        assert_true(line[i].broke);
        assert_string_equal(line[i].bench.feedback.fault_text,
                            "lost, then switched off: there is no connection");
    }
}

/* ---- all of it, at random ---- */

#define RUNS 2 /* of four lines; N= */

static const char *random_text(const struct line *self)
{
    const char *text = self->bench.feedback.fault_text;
    const char *const begins[] = { "lost, then switched off: ",
                                   "not written: " };

    for (unsigned i = 0; i < ARRAY_LEN(begins); i++)
        if (strncmp(text, begins[i], strlen(begins[i])) == 0)
            text += strlen(begins[i]);
    return text;
}

static void expect_random(struct line *self, unsigned run)
{
    const struct strict_bench *bench = &self->bench;
    const char *text = random_text(self);
    const bool is_said = strcmp(text, "no answer in time") == 0 ||
                         strcmp(text, "there is no connection") == 0 ||
                         strcmp(text, "its answers are broken") == 0;

    if (bench->servo.torque || bench->servo.cuts > 0 ||
        (bench->feedback.state != HAL_DRIVE_OFF && !is_said))
        fail_msg("run %u, %s, late %u, strays %u, others %u, closes %u: torque "
                 "%d, %u cuts, %s: %s",
                 run, bench->map.title, self->late, self->strays, self->others,
                 self->closes, bench->servo.torque, bench->servo.cuts,
                 hal_drive_state_text(bench->feedback.state),
                 bench->feedback.fault_text);
}

static bool all_are_off(void)
{
    for (unsigned i = 0; i < LINES; i++)
        if (line[i].bench.feedback.state != HAL_DRIVE_OFF &&
            (!strict_bench_is_down(&line[i].bench) ||
             line[i].bench.drive.off != DRIVE_MODBUS_OFF_DONE))
            return false;
    return true;
}

/* How many were done. */
static unsigned random_run(unsigned run)
{
    unsigned done = 0;

    move_all(true);
    for (unsigned i = 0; i < LINES; i++) {
        line[i].seed = 1 + draw();
        line[i].late = draw_below(100);
        line[i].strays = draw_below(100);
        line[i].others = draw_below(100);
        line[i].closes = draw_below(100);
        corrupt(&line[i], CORRUPT_ANY);
    }
    pass(2500 * MS);
    for (unsigned i = 0; i < LINES; i++) {
        done += line[i].bench.feedback.state == HAL_DRIVE_ENABLED;
        line[i].bench.streams = false;
        hal_drive_request(&line[i].bench.drive.drive, HAL_DRIVE_REQUEST_OFF);
    }
    for (unsigned tries = 0; tries < 600 && !all_are_off(); tries++)
        pass(100 * MS);
    for (unsigned i = 0; i < LINES; i++)
        close_line(&line[i]);
    for (unsigned i = 0; i < LINES; i++)
        expect_random(&line[i], run);
    return done;
}

static void a_bad_connection_is_done_or_says_why(void **state)
{
    const char *given = getenv("N");
    const unsigned runs =
        given != NULL ? (unsigned)strtoul(given, NULL, 0) : RUNS;
    unsigned done = 0;

    (void)state;
    seed_from("a_bad_connection_is_done_or_says_why");
    for (unsigned i = 0; i < runs; i++)
        done += random_run(i);
    print_message("%u of %u were done\n", done, LINES * runs);
}

static void none_on_a_terminal_keeps_its_torque(void **state)
{
    (void)state;
    lose(false, CORRUPT_MUTE, true);
    lose(false, CORRUPT_UNIT, false);
    lose(false, CORRUPT_TRANSACTION, true); /* CRC */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(none_on_tcp_keeps_its_torque),
        cmocka_unit_test(a_connection_that_is_had_again_goes_on),
        cmocka_unit_test(a_connection_that_broke_is_the_bus_gone),
        cmocka_unit_test(a_bad_connection_is_done_or_says_why),
        cmocka_unit_test(none_on_a_terminal_keeps_its_torque),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

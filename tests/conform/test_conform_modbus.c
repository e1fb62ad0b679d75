/* tests/conform/test_conform_modbus.c - every implementation of hal/modbus.h:
 * the byte master on the simulated line, libmodbus over a pseudo-terminal, each in
 * RTU and ASCII, libmodbus over TCP.  Reads the real clock. */
#include "firmware/linux/machine/modbus_host.h"
#include "hal/linux/clock.h"
#include "hal/linux/libmodbus.h"
#include "hal/modbus/master.h"
#include "hal/modbus/rtu_slave.h"
#include "sim/bus/modbus.h"
#include "tests/conform/conform_modbus.h"
#include "tests/support/check.h"

#define MS INT64_C(1000000)

/* No pause of the machine makes an answer late that is there. */
#define TIMEOUT_NS (2000 * MS)
#define DRAIN_NS   (200 * MS)

static const struct modbus_rtu_line rtu = { .baud = 115200,
                                            .parity = MODBUS_PARITY_EVEN,
                                            .stop_bits = 1 };

static const struct modbus_rtu_line ascii = { .baud = 115200,
                                              .parity = MODBUS_PARITY_EVEN,
                                              .stop_bits = 1,
                                              .is_ascii = true };

static struct modbus_rtu_line line; /* one of them */

/* Everything any of them needs; one at a time. */
static struct rig {
    struct conform_modbus conform;
    struct sim_world world;
    struct sim_modbus_line wire;
    struct sim_modbus_seat seat[2];
    struct modbus_master master;
    struct modbus_bank bank;
    struct modbus_rtu_slave slave;
    struct modbus_host host;
    struct modbus_libmodbus libmodbus;
    struct clock_linux clock;
} rig;

static void rig_begin(int64_t now_ns)
{
    memset(&rig, 0, sizeof rig);
    modbus_bank_init(&rig.bank);
    rig.conform.bank = &rig.bank;
    sim_world_init(&rig.world, now_ns);
    assert_int_equal(sim_modbus_line_init(&rig.wire, &rig.world, &line), 0);
    assert_int_equal(modbus_rtu_slave_init(&rig.slave, &rig.bank.slave,
                                           CONFORM_UNIT, &line, 300000),
                     0);
    assert_int_equal(
        sim_modbus_seat_init(&rig.seat[0], &rig.wire, &rig.slave.station), 0);
}

/* ---- the simulated line ---- */

static void pass_virtual(struct conform_modbus *conform)
{
    (void)conform;
    sim_world_run(&rig.world, rig.world.now_ns + MS);
}

static int sim_on(const struct modbus_rtu_line *framing)
{
    const struct modbus_master_config config = { .line = *framing };

    line = *framing;
    rig_begin(1000 * MS);
    assert_int_equal(modbus_master_init(&rig.master, &config), 0);
    assert_int_equal(
        sim_modbus_seat_init(&rig.seat[1], &rig.wire, &rig.master.station), 0);
    rig.conform.line = &rig.master.modbus;
    rig.conform.broadcasts = true;
    rig.conform.pass = pass_virtual;
    return 0;
}

static int sim_begin(void **state)
{
    (void)state;
    return sim_on(&rtu);
}

static int sim_ascii_begin(void **state)
{
    (void)state;
    return sim_on(&ascii);
}

/* ---- libmodbus ---- */

static void pass_real(struct conform_modbus *conform)
{
    (void)conform;
    (void)hal_clock_wait_until(&rig.clock.clock,
                               hal_clock_now_ns(&rig.clock.clock) + MS);
}

static void libmodbus_begin(const struct modbus_line_config *config)
{
    assert_int_equal(modbus_host_start(&rig.host), 0);
    assert_int_equal(modbus_libmodbus_open(&rig.libmodbus, config), 0);
    rig.conform.line = &rig.libmodbus.modbus;
    rig.conform.pass = pass_real;
    for (int i = 0; i < 20000 && !hal_modbus_is_up(rig.conform.line); i++)
        pass_real(&rig.conform);
    assert_int_equal(hal_modbus_is_up(rig.conform.line), 1);
}

static void host_begin(void)
{
    struct clock_linux clock;

    rig_begin(hal_clock_now_ns(clock_linux_init(&clock)));
    (void)clock_linux_init(&rig.clock);
    modbus_host_init(&rig.host, &rig.world);
}

static int pty_on(const struct modbus_rtu_line *framing)
{
    struct modbus_line_config config = { .line = *framing,
                                         .timeout_ns = TIMEOUT_NS,
                                         .drain_ns = DRAIN_NS };

    line = *framing;
    host_begin();
    assert_int_equal(modbus_host_pty(&rig.host, &rig.wire), 0);
    memcpy(config.device, rig.host.path, sizeof rig.host.path);
    rig.conform.broadcasts = true;
    libmodbus_begin(&config);
    return 0;
}

static int pty_begin(void **state)
{
    (void)state;
    return pty_on(&rtu);
}

static int pty_ascii_begin(void **state)
{
    (void)state;
    return pty_on(&ascii);
}

static int tcp_begin(void **state)
{
    const struct in_addr loopback = { htonl(INADDR_LOOPBACK) };
    struct modbus_line_config config = { .host = "127.0.0.1",
                                         .timeout_ns = TIMEOUT_NS,
                                         .drain_ns = DRAIN_NS };

    (void)state;
    line = rtu;
    host_begin();
    assert_int_equal(modbus_host_tcp(&rig.host, loopback, 0), 0);
    rig.host.slave[CONFORM_UNIT] = &rig.bank.slave;
    config.port = rig.host.port;
    libmodbus_begin(&config);
    return 0;
}

static int libmodbus_end(void **state)
{
    (void)state;
    modbus_libmodbus_close(&rig.libmodbus);
    modbus_host_stop(&rig.host);
    return 0;
}

/* ---- the claims, once for each ---- */

#define CLAIM(name)                                                            \
    static void test_##name(void **state)                                      \
    {                                                                          \
        (void)state;                                                           \
        name(&rig.conform);                                                    \
    }
CONFORM_MODBUS_LIST(CLAIM)

#define ON_SIM(name) { "sim: " #name, test_##name, sim_begin, NULL, NULL },
#define ON_PTY(name)                                                           \
    { "libmodbus, pty: " #name, test_##name, pty_begin, libmodbus_end, NULL },
#define ON_SIM_ASCII(name)                                                     \
    { "sim, ASCII: " #name, test_##name, sim_ascii_begin, NULL, NULL },
#define ON_PTY_ASCII(name)                                                     \
    { "libmodbus, pty, ASCII: " #name, test_##name, pty_ascii_begin,           \
      libmodbus_end, NULL },
#define ON_TCP(name)                                                           \
    { "libmodbus, TCP: " #name, test_##name, tcp_begin, libmodbus_end, NULL },

int main(void)
{
    const struct CMUnitTest tests[] = { CONFORM_MODBUS_LIST(ON_SIM) /* */
                                        CONFORM_MODBUS_LIST(ON_PTY) /* */
                                        CONFORM_MODBUS_LIST(ON_SIM_ASCII)
                                            CONFORM_MODBUS_LIST(ON_PTY_ASCII)
                                                CONFORM_MODBUS_LIST(ON_TCP) };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

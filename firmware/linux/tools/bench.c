/* firmware/linux/tools/bench.c - see bench.h. */
#include "firmware/linux/tools/bench.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "firmware/linux/base/disk.h"
#include "hal/linux/socketcan_link.h"
#include "motion/core/err.h"

#define BENCH_BAUD       115200
#define BENCH_TIMEOUT_NS INT64_C(50000000)
#define BENCH_TCP_BAUD   4000000 /* as rig_modbus.c: TCP has none */
#define BENCH_TCP_GAP_NS INT64_C(100000)

/* ---- what the user names ---- */

static int bench_fail(char message[YAML_MESSAGE_MAX], const char *text,
                      const char *what)
{
    snprintf(message, YAML_MESSAGE_MAX, "%.200s: %s", text, what);
    return -1;
}

static int bench_rig(const char *text, bool directory, struct rig *rig,
                     char message[YAML_MESSAGE_MAX])
{
    static char path[4096];

    if (snprintf(path, sizeof path, "%s%s", text,
                 directory ? "/rig.yaml" : "") >= (int)sizeof path)
        return bench_fail(message, text, "the name is too long");
    return rig_load(&disk_files, path, rig, message);
}

/* A rig of one bus that is called as the user called it. */
static struct rig_bus *bench_bus(struct rig *rig, const char *text)
{
    rig_free(rig);
    *rig = (struct rig){ .period_ns = INT64_C(1000000),
                         .heartbeat_ns = INT64_C(100000000),
                         .watchdog_ns = INT64_C(100000000),
                         .bus_count = 1 };
    rig->bus = memory_pool_new(&rig->memory, 1, sizeof *rig->bus);
    snprintf(rig->bus->name, sizeof rig->bus->name, "%s", text);
    return rig->bus;
}

static void bench_modbus(struct rig_bus *bus, const struct bench_line *line)
{
    bus->modbus.timeout_ns =
        line->timeout_ns != 0 ? line->timeout_ns : BENCH_TIMEOUT_NS;
    bus->bit_rate = bus->modbus.line.baud;
}

static int bench_serial(const char *text, const struct bench_line *line,
                        struct rig *rig, char message[YAML_MESSAGE_MAX])
{
    struct rig_bus *bus = bench_bus(rig, text);

    if (strlen(text) >= sizeof bus->modbus.device)
        return bench_fail(message, text, "the name is too long");
    bus->kind = RIG_MODBUS_RTU;
    snprintf(bus->modbus.device, sizeof bus->modbus.device, "%s", text);
    bus->modbus.line = (struct modbus_rtu_line){
        .baud = line->baud != 0 ? line->baud : BENCH_BAUD,
        .parity = line->parity,
        .stop_bits = line->stop_bits,
    };
    if (line->stop_bits == 0)
        bus->modbus.line.stop_bits = line->parity == MODBUS_PARITY_NONE ? 2 : 1;
    bench_modbus(bus, line);
    return 0;
}

static int bench_tcp(const char *text, const char *colon,
                     const struct bench_line *line, struct rig *rig,
                     char message[YAML_MESSAGE_MAX])
{
    struct rig_bus *bus = bench_bus(rig, text);
    const size_t length = (size_t)(colon - text);
    char *end;
    const unsigned long port = strtoul(colon + 1, &end, 10);

    if (length == 0 || length >= sizeof bus->modbus.host || *end != '\0' ||
        end == colon + 1 || port < 1 || port > UINT16_MAX)
        return bench_fail(message, text,
                          "expected a host and a port, such as 10.0.0.7:502");
    bus->kind = RIG_MODBUS_TCP;
    memcpy(bus->modbus.host, text, length);
    bus->modbus.port = (uint16_t)port;
    bus->modbus.line = (struct modbus_rtu_line){ .baud = BENCH_TCP_BAUD,
                                                 .parity = MODBUS_PARITY_NONE,
                                                 .stop_bits = 1,
                                                 .gap_ns = BENCH_TCP_GAP_NS };
    bench_modbus(bus, line);
    return 0;
}

static int bench_interface(const char *text, struct rig *rig,
                           char message[YAML_MESSAGE_MAX])
{
    struct can_link link;
    const int err = can_link_read(text, &link);
    struct rig_bus *bus;

    if (err < 0 || !link.is_can)
        return bench_fail(message, text,
                          "is neither a rig nor a CAN interface, a serial port "
                          "or HOST:PORT");
    bus = bench_bus(rig, text);
    bus->kind = RIG_CANOPEN;
    bus->node_id = 127;
    bus->bit_rate = link.bit_rate; /* vcan: 0, whatever it has */
    if (link.fd)
        bus->data_bit_rate = link.data_bit_rate > 0 ? link.data_bit_rate : 1;
    snprintf(bus->interface, sizeof bus->interface, "%.15s", text);
    return 0;
}

int bench_name(const char *text, const struct bench_line *line, struct rig *rig,
               bool *is_rig, char message[YAML_MESSAGE_MAX])
{
    const char *colon = strrchr(text, ':');
    struct stat about;
    const bool is_there = stat(text, &about) == 0;

    *is_rig = is_there && (S_ISREG(about.st_mode) || S_ISDIR(about.st_mode));
    if (*is_rig)
        return bench_rig(text, S_ISDIR(about.st_mode), rig, message);
    if (is_there && S_ISCHR(about.st_mode))
        return bench_serial(text, line, rig, message);
    if (colon != NULL && strchr(text, '/') == NULL)
        return bench_tcp(text, colon, line, rig, message);
    if (strchr(text, '/') != NULL || strchr(text, '.') != NULL)
        return bench_fail(message, text, strerror(ENOENT));
    return bench_interface(text, rig, message);
}

/* ---- one bus ---- */

int bench_open(struct bench *bench, const struct rig *rig, unsigned bus,
               bool is_real, bool any_node, char message[YAML_MESSAGE_MAX])
{
    const struct machine_real_config config = { .lock.all_units = any_node,
                                                .reaches = true };

    memset(&bench->ports, 0, sizeof bench->ports);
    rig_part(&bench->rig, rig, bus);
    bench->is_real = is_real;
    bench->has_fd = bench->rig.bus[0].data_bit_rate > 0;
    const int err = is_real ? machine_real_init(&bench->real, &bench->rig,
                                                &config, &bench->ports, message)
                            : machine_sim_init(&bench->sim, &bench->rig, false,
                                               &bench->ports, message);
    if (err < 0)
        bench_close(bench);
    return err;
}

void bench_close(struct bench *bench)
{
    if (bench->is_real)
        machine_real_close(&bench->real);
    bench->is_real = false;
    machine_sim_free(&bench->sim);
    rig_free(&bench->rig);
    bench->ports = (struct machine_ports){ .clock = NULL };
}

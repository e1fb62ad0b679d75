/* firmware/linux/machine/machine_modbus.c - see machine_modbus.h. */
#include "firmware/linux/machine/machine_modbus.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <netdb.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "firmware/host/rig/modbus_budget.h"
#include "hal/linux/libmodbus_rs485.h"

#define MACHINE_MODBUS_CONNECT_MS 2000

/* Does the port have what switches the direction? */
static int machine_modbus_rs485(const struct rig_bus *bus,
                                char message[YAML_MESSAGE_MAX])
{
    const struct modbus_line_config *config = &bus->modbus;
    const int fd = open(config->device, O_RDWR | O_NOCTTY | O_NONBLOCK);
    const int err = fd < 0 ? -1 : modbus_rs485_look(fd, config->rs485);
    const char *why = strerror(errno);

    if (fd >= 0)
        close(fd);
    if (err == 0)
        return MOTION_OK;
    snprintf(message, YAML_MESSAGE_MAX, "bus %s: %s: %s (%s)%s", bus->name,
             config->device,
             fd < 0                          ? "cannot be opened"
             : config->rs485 == RS485_KERNEL ? "its driver does not switch the "
                                               "direction of RS-485"
                                             : "has no RTS to switch the "
                                               "direction of RS-485 with",
             why, fd < 0 ? "" : ", expected another rs485 for it");
    return MOTION_E_IO;
}

static bool machine_modbus_is_port(const char *device)
{
    const int fd = open(device, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    const bool is_port = fd < 0 || isatty(fd) == 1;

    if (fd >= 0)
        close(fd);
    return is_port;
}

static int machine_modbus_connect(const struct addrinfo *at)
{
    struct pollfd wait = { .events = POLLOUT };
    socklen_t length = sizeof errno;
    int err = 0;

    wait.fd = socket(at->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (wait.fd < 0)
        return errno;
    (void)fcntl(wait.fd, F_SETFL, O_NONBLOCK);
    if (connect(wait.fd, at->ai_addr, at->ai_addrlen) < 0) {
        err = errno;
        if (err == EINPROGRESS &&
            poll(&wait, 1, MACHINE_MODBUS_CONNECT_MS) == 0)
            err = ETIMEDOUT;
        else if (err == EINPROGRESS &&
                 getsockopt(wait.fd, SOL_SOCKET, SO_ERROR, &err, &length) < 0)
            err = errno;
    }
    close(wait.fd);
    return err;
}

static int machine_modbus_reach_bus(const struct rig_bus *bus,
                                    char message[YAML_MESSAGE_MAX])
{
    const struct addrinfo want = { .ai_socktype = SOCK_STREAM };
    struct addrinfo *at;
    char port[8];

    snprintf(port, sizeof port, "%u", bus->modbus.port);
    if (getaddrinfo(bus->modbus.host, port, &want, &at) != 0) {
        snprintf(message, YAML_MESSAGE_MAX,
                 "bus %s: the host %s is unknown, expected a name or an "
                 "address that this machine can find",
                 bus->name, bus->modbus.host);
        return MOTION_E_IO;
    }
    const int err = machine_modbus_connect(at);
    freeaddrinfo(at);
    if (err == 0)
        return MOTION_OK;
    snprintf(
        message, YAML_MESSAGE_MAX,
        "bus %s: %s port %s: %s, expected a Modbus TCP server that listens "
        "there",
        bus->name, bus->modbus.host, port, strerror(err));
    return MOTION_E_IO;
}

int machine_modbus_reach(const struct rig *rig, char message[YAML_MESSAGE_MAX])
{
    for (uint32_t i = 0; i < rig->bus_count; i++)
        if (rig->bus[i].kind == RIG_MODBUS_TCP &&
            machine_modbus_reach_bus(&rig->bus[i], message) < 0)
            return MOTION_E_TIMEOUT;
    return MOTION_OK;
}

/* A thread tries to open the port for ever; what will never do is said now. */
static int machine_modbus_look(const struct rig_bus *bus,
                               char message[YAML_MESSAGE_MAX])
{
    const char *device = bus->modbus.device;

    if (device[0] == '\0')
        return MOTION_OK;
    if (access(device, R_OK | W_OK) == 0 && !machine_modbus_is_port(device)) {
        snprintf(message, YAML_MESSAGE_MAX,
                 "bus %s: %s is no serial port, expected one such as "
                 "/dev/ttyUSB0",
                 bus->name, device);
        return MOTION_E_IO;
    }
    if (access(device, R_OK | W_OK) == 0)
        return bus->modbus.rs485 == RS485_AUTOMATIC
                   ? MOTION_OK
                   : machine_modbus_rs485(bus, message);
    snprintf(message, YAML_MESSAGE_MAX, "bus %s: serial port %s: %s%s",
             bus->name, device, strerror(errno),
             errno == EACCES
                 ? ", expected a user with access to it, such as one in the "
                   "group dialout"
                 : "");
    return MOTION_E_IO;
}

static int machine_modbus_device(struct machine_modbus *modbus,
                                 const struct rig *rig, unsigned i,
                                 struct modbus_line_config *config,
                                 char message[YAML_MESSAGE_MAX])
{
    struct modbus_host *host = &modbus->device[i].host;
    const struct modbus_device_at at = { .address.s_addr =
                                             htonl(INADDR_LOOPBACK),
                                         .any_port = true };
    int err = modbus_device_start(&modbus->device[i], rig, i, &at, message);

    if (err < 0)
        return err;
    modbus->has_device[i] = true;
    config->rs485 = RS485_AUTOMATIC;
    config->rts_delay_ns = 0;
    memcpy(config->device, host->path, sizeof host->path);
    snprintf(config->host, sizeof config->host, "127.0.0.1");
    config->port = host->port;
    return MOTION_OK;
}

static int machine_modbus_bus(struct machine_modbus *modbus,
                              const struct rig *rig, unsigned i, bool simulated,
                              char message[YAML_MESSAGE_MAX])
{
    struct modbus_line_config config = rig->bus[i].modbus;
    int err;

    config.line = modbus_budget_line(rig, i);
    config.timeout_ns = modbus_budget_timeout_ns(rig, i);
    err = simulated ? machine_modbus_device(modbus, rig, i, &config, message)
                    : machine_modbus_look(&rig->bus[i], message);
    if (err < 0)
        return err;
    err = modbus_libmodbus_open(&modbus->line[i], &config);
    if (err < 0)
        snprintf(message, YAML_MESSAGE_MAX, "bus %s: %s", rig->bus[i].name,
                 motion_err_text(err));
    modbus->is_open[i] = err == MOTION_OK;
    return err;
}

int machine_modbus_open(struct machine_modbus *modbus, const struct rig *rig,
                        bool simulated, struct machine_ports *ports,
                        char message[YAML_MESSAGE_MAX])
{
    memset(modbus, 0, sizeof *modbus);
    modbus->bus_count = rig->bus_count;
    modbus->is_open = memory_pool_new(&modbus->memory, rig->bus_count,
                                      sizeof *modbus->is_open);
    modbus->has_device = memory_pool_new(&modbus->memory, rig->bus_count,
                                         sizeof *modbus->has_device);
    modbus->line =
        memory_pool_new(&modbus->memory, rig->bus_count, sizeof *modbus->line);
    if (simulated)
        modbus->device = memory_pool_new(&modbus->memory, rig->bus_count,
                                         sizeof *modbus->device);
    for (unsigned i = 0; i < rig->bus_count; i++) {
        if (rig_bus_is_can(&rig->bus[i]))
            continue;
        int err = machine_modbus_bus(modbus, rig, i, simulated, message);
        if (err < 0) {
            machine_modbus_close(modbus);
            return err;
        }
        ports->modbus[i] = &modbus->line[i].modbus;
    }
    return MOTION_OK;
}

void machine_modbus_close(struct machine_modbus *modbus)
{
    for (unsigned i = 0; i < modbus->bus_count; i++) {
        if (modbus->is_open[i])
            modbus_libmodbus_close(&modbus->line[i]);
        if (modbus->has_device[i])
            modbus_device_stop(&modbus->device[i]);
    }
    modbus->bus_count = 0;
    memory_pool_free(&modbus->memory);
}

static void machine_modbus_print_bus(struct hal_modbus *line, const char *name,
                                     FILE *file)
{
    struct hal_modbus_stats stats;

    hal_modbus_stats(line, &stats);
    fprintf(file,
            "%s: %" PRIu64 " transactions, %" PRIu64 " time-outs, %" PRIu64
            " broken, %" PRIu64 " exceptions, %" PRIu64 " reconnects",
            name, stats.transactions, stats.timeouts, stats.broken,
            stats.exceptions, stats.reconnects);
    if (stats.ideal_ns > 0)
        fprintf(file,
                "; frames and silences need %.1f s of the wire, answers took "
                "%.1f s",
                (double)stats.ideal_ns / 1e9, (double)stats.busy_ns / 1e9);
    fputc('\n', file);
}

void machine_modbus_print(struct machine_modbus *modbus, const struct rig *rig,
                          FILE *file)
{
    for (unsigned i = 0; i < modbus->bus_count; i++)
        if (modbus->is_open[i])
            machine_modbus_print_bus(&modbus->line[i].modbus, rig->bus[i].name,
                                     file);
}

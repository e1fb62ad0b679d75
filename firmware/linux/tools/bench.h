/* firmware/linux/tools/bench.h - one bus to ask questions on, for tools that
 * move nothing.
 *
 * What the user names becomes a rig: the one of a file, or one made up around a
 * CAN interface, a serial port or HOST:PORT, with one bus and no axes.  A bench
 * is one bus of a rig, its drives simulated in virtual time or real; it opens
 * neither the other buses nor digital lines. */
#ifndef FIRMWARE_LINUX_TOOLS_BENCH_H
#define FIRMWARE_LINUX_TOOLS_BENCH_H

#include <stdbool.h>

#include "firmware/host/rig/rig.h"
#include "firmware/linux/machine/machine_real.h"
#include "firmware/linux/machine/machine_sim.h"

/* How a serial port is used when no rig says so. */
struct bench_line {
    uint32_t baud; /* 0: 115200 */
    enum modbus_parity parity;
    uint8_t stop_bits;  /* 0: 1, or 2 without parity */
    int64_t timeout_ns; /* 0: 50 ms */
};

/* "rig.yaml", a directory with one, "can0", "/dev/ttyUSB0", "10.0.0.7:502".
 * *is_rig: it came from a file.  0, or -1 with a sentence. */
int bench_name(const char *text, const struct bench_line *line, struct rig *rig,
               bool *is_rig, char message[YAML_MESSAGE_MAX]);

struct bench {
    struct rig rig; /* bus 0 only, and the axes on it */
    bool is_real;
    struct machine_ports ports; /* of bus 0 */
    bool has_fd;                /* its CAN port takes FD frames */
    struct machine_sim sim;
    struct machine_real real;
};

/* Bus `bus` of the rig, of which any node is asked, or the axes' alone.  0, or a
 * code with a sentence; nothing is open then. */
int bench_open(struct bench *bench, const struct rig *rig, unsigned bus,
               bool is_real, bool any_node, char message[YAML_MESSAGE_MAX]);
void bench_close(struct bench *bench);
/* Simulated drives have just been switched on: let them boot. */
#define BENCH_BOOT_NS INT64_C(300000000)

static inline bool bench_is_can(const struct bench *bench)
{
    return bench->ports.can[0] != NULL;
}

#endif

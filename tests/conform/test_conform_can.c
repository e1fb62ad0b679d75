/* tests/conform/test_conform_can.c - the claims of conform_can.h on every CAN
 * port.
 *
 *   test_conform_can              the simulated bus, with and without FD
 *   test_conform_can can0 can1    ports on two interfaces of this machine that
 *   test_conform_can vcan0 vcan0  are one bus; as root (make test-vm)
 *
 * A third argument, remote-empty: QEMU 7.2's SJA1000 loses its place among the
 * received frames after a remote frame whose length is not 0. */
#define _GNU_SOURCE /* struct ifreq */
#include "tests/conform/conform_can.h"

#include <net/if.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

#include "hal/linux/socketcan.h"
#include "sim/bus/can.h"
#include "sim/world.h"

/* ---- simulated ---- */

struct simulated {
    struct sim_world world;
    struct sim_can_bus bus;
    struct sim_can_port a, b, other;
};

static void simulated_pass(struct conform_can *bus, int64_t ns)
{
    struct simulated *self = bus->context;

    sim_world_run(&self->world, self->world.now_ns + ns);
}

static int64_t simulated_now_ns(struct conform_can *bus)
{
    return ((struct simulated *)bus->context)->world.now_ns;
}

static void simulated_set_down(struct conform_can *bus, bool down)
{
    sim_can_port_set_off(&((struct simulated *)bus->context)->a, down);
}

static int on_simulated(bool fd)
{
    static struct simulated self;
    struct conform_can bus = {
        .name = fd ? "simulated, FD" : "simulated",
        .a = &self.a.can,
        .b = &self.b.can,
        .fd = fd,
        .pass = simulated_pass,
        .now_ns = simulated_now_ns,
        .set_down = simulated_set_down,
        .context = &self,
    };

    sim_world_init(&self.world, INT64_C(1000000000));
    if (sim_can_bus_init(&self.bus, &self.world, 1000000) < 0 ||
        (fd && sim_can_bus_set_fd(&self.bus, 5) < 0))
        return 1;
    sim_can_port_init(&self.a, &self.bus);
    sim_can_port_init(&self.b, &self.bus);
    sim_can_port_init(&self.other, &self.bus);
    return conform_can(&bus);
}

/* ---- SocketCAN ---- */

struct real {
    struct can_socketcan a, b;
};

static void real_pass(struct conform_can *bus, int64_t ns)
{
    const struct timespec pause = { .tv_sec = ns / 1000000000,
                                    .tv_nsec = ns % 1000000000 };

    (void)bus;
    nanosleep(&pause, NULL);
}

static int64_t real_now_ns(struct conform_can *bus)
{
    struct timespec now;

    (void)bus;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

static void real_set_down(struct conform_can *bus, bool down)
{
    const struct real *self = bus->context;
    struct ifreq request = { 0 };
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);

    memcpy(request.ifr_name, self->a.interface, sizeof self->a.interface);
    assert_true(ioctl(fd, SIOCGIFFLAGS, &request) == 0);
    if (down)
        request.ifr_flags &= (short)~IFF_UP;
    else
        request.ifr_flags |= IFF_UP;
    assert_true(ioctl(fd, SIOCSIFFLAGS, &request) == 0);
    close(fd);
}

static int on_interfaces(const char *a, const char *b, bool remote_empty)
{
    static struct real self;
    struct can_link link;
    char message[CAN_SOCKETCAN_MESSAGE_MAX];
    char name[64];
    struct conform_can bus = {
        .name = name,
        .a = &self.a.can,
        .b = &self.b.can,
        .fd = can_link_read(a, &link) == MOTION_OK && link.fd,
        .remote_empty = remote_empty,
        .pass = real_pass,
        .now_ns = real_now_ns,
        .set_down = real_set_down,
        .context = &self,
    };
    int failed;

    snprintf(name, sizeof name, "%s and %s%s", a, b, bus.fd ? ", FD" : "");
    if (can_socketcan_open(
            &self.a,
            &(struct can_socketcan_config){ .interface = a, .fd = bus.fd },
            message) < 0 ||
        can_socketcan_open(
            &self.b,
            &(struct can_socketcan_config){ .interface = b, .fd = bus.fd },
            message) < 0) {
        fprintf(stderr, "test_conform_can: %s\n", message);
        return 1;
    }
    failed = conform_can(&bus);
    can_socketcan_close(&self.a);
    can_socketcan_close(&self.b);
    return failed;
}

int main(int argc, char *argv[])
{
    if (argc >= 3)
        return on_interfaces(argv[1], argv[2],
                             argc > 3 && strcmp(argv[3], "remote-empty") == 0);
    return on_simulated(false) + on_simulated(true);
}

/* firmware/linux/machine/machine_lock.c - see machine_lock.h. */
#define _GNU_SOURCE /* realpath, getifaddrs */
#include "firmware/linux/machine/machine_lock.h"

#include <arpa/inet.h>
#include <errno.h>
#include <ifaddrs.h>
#include <inttypes.h>
#include <net/if.h>
#include <netdb.h>
#include <netinet/in.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <time.h>
#include <unistd.h>

#include "firmware/linux/machine/guardian.h"
#include "motion/core/err.h"

#define LOCK_NO_BUS       UINT32_MAX /* of the rig file */
#define LOCK_UNITS        247        /* of Modbus */
#define LOCK_KILLED_TRIES 100        /* of 10 ms: it is gone by then */

struct lock_taker {
    struct machine_lock *lock;
    const struct rig *rig;
    const struct machine_lock_config *config;
    uint32_t bus;
    unsigned unit; /* of Modbus TCP; 0: none, or all */
    char *message;
};

/* ---- one name ---- */

/* "bus net (10.0.0.5, port 502)", or "the rig". */
#define LOCK_WHAT_MAX (PLAN_NAME_MAX + 96)
static const char *lock_what(const struct lock_taker *self, uint32_t bus,
                             char what[LOCK_WHAT_MAX])
{
    char thing[RIG_THING_MAX];

    if (bus == LOCK_NO_BUS)
        return "the rig";
    rig_bus_thing(&self->rig->bus[bus], thing);
    snprintf(what, LOCK_WHAT_MAX, "bus %s (%.80s)", self->rig->bus[bus].name,
             thing);
    return what;
}

static int lock_refuse(const struct lock_taker *self,
                       const struct lock_holder *holder)
{
    char what[LOCK_WHAT_MAX], unit[24] = "", hint[40] = "";

    if (self->unit > 0)
        snprintf(unit, sizeof unit, "unit %u of ", self->unit);
    if (holder->pid > 0)
        snprintf(hint, sizeof hint, ": kill -INT %ld", (long)holder->pid);
    snprintf(self->message, YAML_MESSAGE_MAX,
             "%.20s%.100s is in use by %.280s, expected it to have ended%s",
             unit, lock_what(self, self->bus, what), holder->text, hint);
    return MOTION_E_STATE;
}

static int lock_refuse_own(const struct lock_taker *self, uint32_t other)
{
    char first[LOCK_WHAT_MAX], second[LOCK_WHAT_MAX];

    snprintf(self->message, YAML_MESSAGE_MAX,
             "%.127s is the same as %.127s in line %u of the rig file, "
             "expected one bus with all of its axes",
             lock_what(self, self->bus, second), lock_what(self, other, first),
             self->rig->bus[other].place.line);
    return MOTION_E_ARG;
}

static void lock_keep(struct lock_taker *self, const char *name, int file)
{
    struct machine_lock *lock = self->lock;

    lock->name = memory_pool_more(&lock->memory, lock->name, lock->count,
                                  sizeof *lock->name);
    struct machine_lock_name *kept = &lock->name[lock->count++];
    *kept = (struct machine_lock_name){ .file = file, .bus = self->bus };
    snprintf(kept->name, sizeof kept->name, "%s", name);
}

/* The bus of ours that has the name; LOCK_NO_BUS: none. */
static uint32_t lock_own_bus(const struct lock_taker *self, const char *name)
{
    for (size_t i = 0; i < self->lock->count; i++)
        if (strcmp(self->lock->name[i].name, name) == 0)
            return self->lock->name[i].bus;
    return LOCK_NO_BUS;
}

/* Take what another has: it is told to give way, then killed, and where that does
 * not help its lock is left to it. */
static int lock_take_over(const char *name)
{
    const struct timespec pause = { .tv_nsec = 10000000 };
    struct lock_holder holder;
    int file = -EADDRINUSE;
    pid_t told = 0;

    for (int i = 0; i < LOCK_KILLED_TRIES && file == -EADDRINUSE; i++) {
        if (lock_ask(name, &holder) &&
            (holder.pid == 0 || holder.pid == getpid() ||
             kill(holder.pid,
                  holder.pid == told ? SIGKILL : GUARDIAN_GIVE_WAY) < 0))
            break;
        told = holder.pid;
        (void)nanosleep(&pause, NULL);
        file = lock_take(name);
    }
    return file;
}

static int lock_name(struct lock_taker *self, const char *name)
{
    const uint32_t own = lock_own_bus(self, name);
    struct lock_holder holder;

    if (own != LOCK_NO_BUS)
        return own == self->bus ? MOTION_OK : lock_refuse_own(self, own);
    int file = lock_take(name);
    if (file == -EADDRINUSE && self->config->takes_over)
        file = lock_take_over(name);
    if (file == -EADDRINUSE && !self->config->takes_over &&
        !lock_ask(name, &holder))
        file = lock_take(name); /* it has just ended */
    if (file == -EADDRINUSE && !self->config->takes_over)
        return lock_refuse(self, &holder);
    if (file < 0 && !self->config->takes_over) {
        snprintf(self->message, YAML_MESSAGE_MAX,
                 "no lock %s: %s, expected one on every port", name,
                 strerror(-file));
        return MOTION_E_IO;
    }
    lock_keep(self, name, file);
    return MOTION_OK;
}

/* ---- what a thing is called ---- */

static int lock_rig(struct lock_taker *self)
{
    char name[LOCK_NAME_MAX];

    self->bus = LOCK_NO_BUS;
    if (self->config->rig_path == NULL)
        return MOTION_OK;
    char *path = realpath(self->config->rig_path, NULL);
    if (path == NULL)
        return MOTION_OK; /* it has just been moved away: ports are left */
    uint64_t hash = UINT64_C(14695981039346656037); /* FNV-1a */
    for (const char *at = path; *at != '\0'; at++)
        hash = (hash ^ (uint8_t)*at) * UINT64_C(1099511628211);
    free(path);
    snprintf(name, sizeof name, "rig/%016" PRIx64, hash);
    return lock_name(self, name);
}

static int lock_can(struct lock_taker *self, const struct rig_bus *bus)
{
    char name[LOCK_NAME_MAX];
    const unsigned index = if_nametoindex(bus->interface);

    if (index == 0)
        return MOTION_OK; /* opening says why */
    snprintf(name, sizeof name, "can/%u", index);
    return lock_name(self, name);
}

static int lock_serial(struct lock_taker *self, const struct rig_bus *bus)
{
    char name[LOCK_NAME_MAX];
    struct stat status;

    if (stat(bus->modbus.device, &status) < 0 || !S_ISCHR(status.st_mode))
        return MOTION_OK; /* opening says why */
    snprintf(name, sizeof name, "tty/%u:%u", major(status.st_rdev),
             minor(status.st_rdev));
    return lock_name(self, name);
}

/* ---- servers ---- */

#define LOCK_ADDRESSES 8 /* of one name */
struct lock_addresses {
    unsigned count;
    char text[LOCK_ADDRESSES][INET6_ADDRSTRLEN];
};

/* An IPv4 address within IPv6 is that address. */
static void lock_address_text(const struct sockaddr *at,
                              char text[INET6_ADDRSTRLEN])
{
    static const char mapped[] = "::ffff:";
    char whole[INET6_ADDRSTRLEN] = "";

    if (at->sa_family == AF_INET)
        (void)inet_ntop(AF_INET, &((const struct sockaddr_in *)at)->sin_addr,
                        whole, sizeof whole);
    else if (at->sa_family == AF_INET6)
        (void)inet_ntop(AF_INET6, &((const struct sockaddr_in6 *)at)->sin6_addr,
                        whole, sizeof whole);
    const bool is_mapped = strncmp(whole, mapped, sizeof mapped - 1) == 0 &&
                           strchr(whole, '.') != NULL;
    snprintf(text, INET6_ADDRSTRLEN, "%s",
             whole + (is_mapped ? sizeof mapped - 1 : 0));
}

/* A server of this computer listens, as a rule, on all of its addresses. */
static bool lock_is_own(const char *text)
{
    char own[INET6_ADDRSTRLEN];
    struct ifaddrs *list = NULL;
    bool is_own = strncmp(text, "127.", 4) == 0 || strcmp(text, "::1") == 0 ||
                  strcmp(text, "0.0.0.0") == 0 || strcmp(text, "::") == 0;

    if (is_own || getifaddrs(&list) < 0)
        return is_own;
    for (const struct ifaddrs *at = list; at != NULL && !is_own;
         at = at->ifa_next) {
        if (at->ifa_addr == NULL)
            continue;
        lock_address_text(at->ifa_addr, own);
        is_own = own[0] != '\0' && strcmp(own, text) == 0;
    }
    freeifaddrs(list);
    return is_own;
}

static void lock_resolve(const struct lock_taker *self, const char *host,
                         struct lock_addresses *to)
{
    const struct addrinfo want = {
        .ai_socktype = SOCK_STREAM,
        .ai_flags = self->config->numeric ? AI_NUMERICHOST : 0,
    };
    struct addrinfo *list = NULL;

    to->count = 0;
    if (getaddrinfo(host, NULL, &want, &list) != 0)
        return;
    for (const struct addrinfo *at = list;
         at != NULL && to->count < LOCK_ADDRESSES; at = at->ai_next) {
        char *text = to->text[to->count];

        lock_address_text(at->ai_addr, text);
        if (text[0] == '\0')
            continue;
        if (lock_is_own(text))
            snprintf(text, INET6_ADDRSTRLEN, "localhost");
        to->count++;
    }
    freeaddrinfo(list);
}

/* Whoever has all units looks for each, and whoever has one looks for all, once
 * it has its own: of two at the same time one sees the other. */
static int lock_look(const struct lock_taker *self, const char *name)
{
    struct lock_holder holder;

    return !self->config->takes_over && lock_ask(name, &holder)
               ? lock_refuse(self, &holder)
               : MOTION_OK;
}

static int lock_all_units(struct lock_taker *self, const char *at)
{
    char name[LOCK_NAME_MAX];

    snprintf(name, sizeof name, "%s/all", at);
    int err = lock_name(self, name);
    for (self->unit = 1; self->unit <= LOCK_UNITS && err == MOTION_OK;
         self->unit++) {
        snprintf(name, sizeof name, "%s/%u", at, self->unit);
        err = lock_look(self, name);
    }
    self->unit = 0;
    return err;
}

static int lock_units(struct lock_taker *self, const char *at)
{
    char name[LOCK_NAME_MAX];
    int err = MOTION_OK;

    for (uint32_t i = 0; i < self->rig->axis_count && err == MOTION_OK; i++) {
        if (self->rig->axis[i].bus != self->bus)
            continue;
        self->unit = self->rig->axis[i].node_id;
        snprintf(name, sizeof name, "%s/%u", at, self->unit);
        err = lock_name(self, name);
    }
    self->unit = 0;
    snprintf(name, sizeof name, "%s/all", at);
    return err == MOTION_OK ? lock_look(self, name) : err;
}

/* One bus of ours has all of a server, so that the load of its line is judged
 * as a whole. */
static int lock_server(struct lock_taker *self, const char *host, uint16_t port)
{
    char at[LOCK_NAME_MAX - 8];

    snprintf(at, sizeof at, "tcp/%.56s:%u", host, port);
    const uint32_t own = lock_own_bus(self, at);
    if (own != LOCK_NO_BUS)
        return own == self->bus ? MOTION_OK : lock_refuse_own(self, own);
    lock_keep(self, at, -1);
    return self->config->all_units ? lock_all_units(self, at)
                                   : lock_units(self, at);
}

/* By its name too: where that is not looked up there is no address. */
static int lock_tcp(struct lock_taker *self, const struct rig_bus *bus)
{
    struct lock_addresses to;
    char host[RIG_THING_MAX];

    rig_bus_thing(bus, host);
    host[strcspn(host, ",")] = '\0';
    int err = lock_server(self, host, bus->modbus.port);
    lock_resolve(self, host, &to);
    for (unsigned i = 0; i < to.count && err == MOTION_OK; i++)
        err = lock_server(self, to.text[i], bus->modbus.port);
    return err;
}

/* ---- all of a rig ---- */

static int lock_bus(struct lock_taker *self)
{
    const struct rig_bus *bus = &self->rig->bus[self->bus];

    switch (bus->kind) {
    case RIG_MODBUS_RTU:
        return lock_serial(self, bus);
    case RIG_MODBUS_TCP:
        return lock_tcp(self, bus);
    case RIG_CANOPEN:
    case RIG_CAN:
        break;
    }
    return lock_can(self, bus);
}

int machine_lock_take(struct machine_lock *lock, const struct rig *rig,
                      const struct machine_lock_config *config,
                      char message[YAML_MESSAGE_MAX])
{
    struct lock_taker self = { lock, rig, config, 0, 0, message };

    *lock = (struct machine_lock){ .count = 0 };
    int err = lock_rig(&self);
    for (self.bus = 0; self.bus < rig->bus_count && err == MOTION_OK;
         self.bus++)
        err = lock_bus(&self);
    if (err != MOTION_OK)
        machine_lock_release(lock);
    return err;
}

void machine_lock_release(struct machine_lock *lock)
{
    for (size_t i = 0; i < lock->count; i++)
        if (lock->name[i].file >= 0)
            lock_release(lock->name[i].file);
    memory_pool_free(&lock->memory);
    *lock = (struct machine_lock){ .count = 0 };
}

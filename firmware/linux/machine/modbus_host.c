/* firmware/linux/machine/modbus_host.c - see modbus_host.h. */
#define _GNU_SOURCE /* ppoll, posix_openpt, cfmakeraw */
#include "firmware/linux/machine/modbus_host.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "hal/linux/clock.h"
#include "hal/modbus/tcp.h"
#include "hal/support/container_of.h"

#define NS_PER_S      INT64_C(1000000000)
#define HOST_SLEEP_NS INT64_C(2000000) /* longest, so that stop is seen */

static int64_t modbus_host_now_ns(void)
{
    struct clock_linux clock;

    return hal_clock_now_ns(clock_linux_init(&clock));
}

/* ---- the bridge ---- */

static struct modbus_host_bridge *
modbus_host_bridge_of(const struct modbus_station *station)
{
    return CONTAINER_OF(station, struct modbus_host_bridge, station);
}

/* A reader that does not keep up loses bytes, as on a wire. */
static void modbus_host_bridge_recv(struct modbus_station *station,
                                    const uint8_t *bytes, unsigned length,
                                    int64_t now_ns)
{
    (void)now_ns;
    (void)!write(modbus_host_bridge_of(station)->fd, bytes, length);
}

static int64_t modbus_host_bridge_due_ns(const struct modbus_station *station)
{
    return modbus_host_bridge_of(station)->length > 0 ? 0
                                                      : MODBUS_STATION_NEVER;
}

static unsigned modbus_host_bridge_poll(struct modbus_station *station,
                                        int64_t now_ns,
                                        uint8_t frame[MODBUS_RTU_FRAME_MAX])
{
    struct modbus_host_bridge *bridge = modbus_host_bridge_of(station);
    const unsigned length = bridge->length < MODBUS_RTU_FRAME_MAX
                                ? bridge->length
                                : MODBUS_RTU_FRAME_MAX;

    (void)now_ns;
    memcpy(frame, bridge->pending, length);
    bridge->length -= length;
    memmove(bridge->pending, bridge->pending + length, bridge->length);
    return length;
}

static void modbus_host_bridge_sent(struct modbus_station *station,
                                    int64_t now_ns)
{
    (void)station;
    (void)now_ns;
}

static const struct modbus_station_ops modbus_host_bridge_ops = {
    .recv = modbus_host_bridge_recv,
    .due_ns = modbus_host_bridge_due_ns,
    .poll = modbus_host_bridge_poll,
    .sent = modbus_host_bridge_sent,
};

static void modbus_host_bridge_read(struct modbus_host_bridge *bridge)
{
    const ssize_t got = read(bridge->fd, bridge->pending + bridge->length,
                             sizeof bridge->pending - bridge->length);

    if (got > 0)
        bridge->length += (unsigned)got;
}

/* ---- TCP ---- */

static void modbus_host_hang_up(struct modbus_host_client *client)
{
    close(client->fd);
    client->fd = -1;
    client->length = 0;
}

/* A client too many takes the place of the first. */
static void modbus_host_accept(struct modbus_host *host)
{
    const int fd =
        accept4(host->listener, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);
    const int one = 1;
    struct modbus_host_client *client = host->client;

    if (fd < 0)
        return;
    (void)setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
    for (unsigned i = 0; i < MODBUS_HOST_CLIENTS; i++)
        if (host->client[i].fd < 0)
            client = &host->client[i];
    if (client->fd >= 0)
        modbus_host_hang_up(client);
    client->fd = fd;
}

/* Bytes of the answer. */
static unsigned modbus_host_answer(struct modbus_host *host,
                                   const uint8_t *frame, unsigned length,
                                   uint8_t answer[MODBUS_TCP_FRAME_MAX])
{
    const uint8_t unit = frame[MODBUS_TCP_HEAD - 1];
    const uint8_t *pdu = frame + MODBUS_TCP_HEAD;
    struct modbus_slave *slave =
        unit < MODBUS_HOST_UNITS ? host->slave[unit] : NULL;
    unsigned answered;

    if (slave == NULL) /* as a gateway says it */
        answered =
            modbus_pdu_put_exception(pdu[0], 0x0B, answer + MODBUS_TCP_HEAD);
    else
        answered = modbus_slave_serve(slave, pdu, length - MODBUS_TCP_HEAD,
                                      answer + MODBUS_TCP_HEAD);
    return modbus_tcp_seal(answer, modbus_pdu_get(frame), unit, answered);
}

static void modbus_host_serve(struct modbus_host *host,
                              struct modbus_host_client *client)
{
    uint8_t answer[MODBUS_TCP_FRAME_MAX];
    unsigned length, answered;

    while ((length = modbus_tcp_whole(client->frame, client->length)) != 0 &&
           length <= client->length) {
        answered = modbus_host_answer(host, client->frame, length, answer);
        if (send(client->fd, answer, answered, MSG_NOSIGNAL) !=
            (ssize_t)answered) {
            modbus_host_hang_up(client);
            return;
        }
        client->length -= length;
        memmove(client->frame, client->frame + length, client->length);
    }
    if (length > MODBUS_TCP_FRAME_MAX)
        modbus_host_hang_up(client);
}

static void modbus_host_read(struct modbus_host *host,
                             struct modbus_host_client *client)
{
    const ssize_t got = read(client->fd, client->frame + client->length,
                             sizeof client->frame - client->length);

    if (got <= 0) {
        modbus_host_hang_up(client);
        return;
    }
    client->length += (unsigned)got;
    modbus_host_serve(host, client);
}

/* ---- the thread ---- */

/* Descriptors that poll ignores are negative. */
static void modbus_host_wait(struct modbus_host *host,
                             struct pollfd set[2 + MODBUS_HOST_CLIENTS])
{
    int64_t sleep_ns = sim_world_due_ns(host->world) - modbus_host_now_ns();
    struct timespec timeout = { 0 };

    if (sleep_ns > HOST_SLEEP_NS)
        sleep_ns = HOST_SLEEP_NS;
    if (sleep_ns > 0)
        timeout.tv_nsec = (long)sleep_ns;
    set[0] = (struct pollfd){ .fd = host->bridge.fd, .events = POLLIN };
    set[1] = (struct pollfd){ .fd = host->listener, .events = POLLIN };
    for (unsigned i = 0; i < MODBUS_HOST_CLIENTS; i++)
        set[2 + i] =
            (struct pollfd){ .fd = host->client[i].fd, .events = POLLIN };
    (void)ppoll(set, 2 + MODBUS_HOST_CLIENTS, &timeout, NULL);
}

static void *modbus_host_run(void *context)
{
    struct modbus_host *host = context;
    struct pollfd set[2 + MODBUS_HOST_CLIENTS];

    while (!atomic_load(&host->stop)) {
        modbus_host_wait(host, set);
        pthread_mutex_lock(&host->lock);
        sim_world_run(host->world, modbus_host_now_ns());
        if (set[0].revents != 0)
            modbus_host_bridge_read(&host->bridge);
        for (unsigned i = 0; i < MODBUS_HOST_CLIENTS; i++)
            if (set[2 + i].revents != 0)
                modbus_host_read(host, &host->client[i]);
        if (set[1].revents != 0)
            modbus_host_accept(host);
        pthread_mutex_unlock(&host->lock);
    }
    return NULL;
}

/* ---- set-up ---- */

void modbus_host_init(struct modbus_host *host, struct sim_world *world)
{
    *host = (struct modbus_host){
        .world = world, .bridge.fd = -1, .other_end = -1, .listener = -1
    };
    pthread_mutex_init(&host->lock, NULL);
    for (unsigned i = 0; i < MODBUS_HOST_CLIENTS; i++)
        host->client[i].fd = -1;
}

/* The other end stays open, so that a program that comes and goes is no
 * hang-up; raw, so that nothing is echoed before somebody has set it. */
static int modbus_host_other_end(struct modbus_host *host)
{
    struct termios mode;

    if (grantpt(host->bridge.fd) < 0 || unlockpt(host->bridge.fd) < 0 ||
        ptsname_r(host->bridge.fd, host->path, sizeof host->path) != 0)
        return -1;
    host->other_end = open(host->path, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (host->other_end < 0 || tcgetattr(host->other_end, &mode) < 0)
        return -1;
    cfmakeraw(&mode);
    return tcsetattr(host->other_end, TCSANOW, &mode);
}

int modbus_host_pty(struct modbus_host *host, struct sim_modbus_line *line)
{
    host->bridge.station.ops = &modbus_host_bridge_ops;
    host->bridge.fd = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
    if (host->bridge.fd < 0 || modbus_host_other_end(host) < 0)
        return -1;
    return sim_modbus_seat_init(&host->seat, line, &host->bridge.station) ==
                   MOTION_OK
               ? 0
               : -1;
}

int modbus_host_tcp(struct modbus_host *host, struct in_addr address,
                    uint16_t port)
{
    struct sockaddr_in at = { .sin_family = AF_INET,
                              .sin_port = htons(port),
                              .sin_addr = address };
    socklen_t length = sizeof at;
    const int one = 1;

    host->listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (host->listener < 0 ||
        setsockopt(host->listener, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one) <
            0 ||
        bind(host->listener, (struct sockaddr *)&at, sizeof at) < 0 ||
        listen(host->listener, MODBUS_HOST_CLIENTS) < 0 ||
        getsockname(host->listener, (struct sockaddr *)&at, &length) < 0)
        return -1;
    host->port = ntohs(at.sin_port);
    return 0;
}

int modbus_host_start(struct modbus_host *host)
{
    sigset_t all, before;
    int err;

    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    err = pthread_create(&host->thread, NULL, modbus_host_run, host);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return err == 0 ? 0 : -1;
}

static void modbus_host_close(int *fd)
{
    if (*fd >= 0)
        close(*fd);
    *fd = -1;
}

void modbus_host_stop(struct modbus_host *host)
{
    if (host->thread != 0) {
        atomic_store(&host->stop, true);
        pthread_join(host->thread, NULL);
        host->thread = 0;
    }
    modbus_host_close(&host->bridge.fd);
    modbus_host_close(&host->other_end);
    modbus_host_close(&host->listener);
    for (unsigned i = 0; i < MODBUS_HOST_CLIENTS; i++)
        modbus_host_close(&host->client[i].fd);
}

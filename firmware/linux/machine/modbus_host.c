/* firmware/linux/machine/modbus_host.c - see modbus_host.h. */
#define _GNU_SOURCE /* ppoll, posix_openpt, cfmakeraw */
#include "firmware/linux/machine/modbus_host.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "hal/linux/clock.h"
#include "hal/linux/thread.h"
#include "hal/modbus/tcp.h"
#include "hal/support/container_of.h"

#define NS_PER_S      INT64_C(1000000000)
#define HOST_SLEEP_NS INT64_C(2000000) /* longest, so that stop is seen */

#define GATEWAY_NO_ANSWER 0x0B

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
                                        uint8_t frame[MODBUS_FRAME_MAX])
{
    struct modbus_host_bridge *bridge = modbus_host_bridge_of(station);
    const unsigned length =
        bridge->length < MODBUS_FRAME_MAX ? bridge->length : MODBUS_FRAME_MAX;

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
    *client = (struct modbus_host_client){ .fd = -1 };
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
    client->number = ++host->clients;
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
        answered = modbus_pdu_put_exception(pdu[0], GATEWAY_NO_ANSWER,
                                            answer + MODBUS_TCP_HEAD);
    else
        answered = modbus_slave_serve(slave, pdu, length - MODBUS_TCP_HEAD,
                                      answer + MODBUS_TCP_HEAD);
    return modbus_tcp_seal(answer, modbus_pdu_get(frame), unit, answered);
}

/* TCP has a checksum of its own: what a gateway spoils is its head. */
static void modbus_host_spoil(enum sim_modbus_fault fault, uint64_t *seed,
                              struct sim_modbus_held *held)
{
    uint8_t *frame = held->frame;
    const uint8_t unit = frame[MODBUS_TCP_HEAD - 1];

    if (fault == SIM_MODBUS_OTHER_UNIT)
        frame[MODBUS_TCP_HEAD - 1] = (uint8_t)(unit % 247 + 1);
    else if (fault == SIM_MODBUS_GATEWAY)
        held->length = modbus_tcp_seal(
            frame, modbus_pdu_get(frame), unit,
            modbus_pdu_put_exception(frame[MODBUS_TCP_HEAD], GATEWAY_NO_ANSWER,
                                     frame + MODBUS_TCP_HEAD));
    else if (fault == SIM_MODBUS_STRAYS)
        held->length = sim_modbus_spoil(fault, seed, frame, held->length);
    else if (fault != SIM_MODBUS_GOOD && fault != SIM_MODBUS_LATE &&
             fault != SIM_MODBUS_MUTE)
        frame[0] ^= 0xA5;
}

/* True: the frame goes on now. */
static bool modbus_host_pass(struct sim_modbus_faulty *faulty,
                             struct sim_modbus_direction *direction,
                             struct sim_modbus_held *frame)
{
    const enum sim_modbus_fault fault =
        sim_modbus_direction_draw(direction, &faulty->seed);

    modbus_host_spoil(fault, &faulty->seed, frame);
    return sim_modbus_direction_pass(direction, fault, &faulty->seed, frame,
                                     modbus_host_now_ns(), 0);
}

/* To the client that has asked, if it is still there. */
static void modbus_host_send(struct modbus_host *host,
                             const struct sim_modbus_held *answer)
{
    for (unsigned i = 0; i < MODBUS_HOST_CLIENTS; i++) {
        struct modbus_host_client *client = &host->client[i];

        if (client->fd >= 0 && client->number == answer->tag && !client->deaf &&
            send(client->fd, answer->frame, answer->length, MSG_NOSIGNAL) !=
                (ssize_t)answer->length)
            modbus_host_hang_up(client);
    }
}

static void modbus_host_do(struct modbus_host *host,
                           struct sim_modbus_faulty *faulty,
                           const struct sim_modbus_held *request)
{
    struct sim_modbus_held answer = { .tag = request->tag };

    answer.length =
        modbus_host_answer(host, request->frame, request->length, answer.frame);
    if (faulty == NULL || modbus_host_pass(faulty, &faulty->from, &answer))
        modbus_host_send(host, &answer);
}

/* What was late on its way. */
static void modbus_host_late(struct modbus_host *host)
{
    const int64_t now_ns = modbus_host_now_ns();
    struct sim_modbus_held frame;

    for (unsigned i = 0; i < MODBUS_HOST_UNITS; i++) {
        struct sim_modbus_faulty *faulty = host->faulty[i];

        if (faulty == NULL || host->listener < 0)
            continue;
        while (sim_modbus_direction_take(&faulty->to, now_ns, &frame))
            modbus_host_do(host, faulty, &frame);
        while (sim_modbus_direction_take(&faulty->from, now_ns, &frame))
            modbus_host_send(host, &frame);
    }
}

static void modbus_host_serve(struct modbus_host *host,
                              struct modbus_host_client *client)
{
    struct sim_modbus_held request = { .tag = client->number };
    unsigned length;

    while ((length = modbus_tcp_whole(client->frame, client->length)) != 0 &&
           length <= client->length) {
        const uint8_t unit = client->frame[MODBUS_TCP_HEAD - 1];
        struct sim_modbus_faulty *faulty =
            unit < MODBUS_HOST_UNITS ? host->faulty[unit] : NULL;

        memcpy(request.frame, client->frame, length);
        request.length = length;
        client->length -= length;
        memmove(client->frame, client->frame + length, client->length);
        if (faulty == NULL || modbus_host_pass(faulty, &faulty->to, &request))
            modbus_host_do(host, faulty, &request);
        if (client->fd < 0)
            return;
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
    if (client->deaf)
        return;
    client->length += (unsigned)got;
    modbus_host_serve(host, client);
}

/* The other end of every connection is gone, with or without a word. */
static void modbus_host_break(struct modbus_host *host)
{
    struct sim_modbus_line *wire = host->wire;

    if (wire == NULL || host->listener < 0 || (!wire->deaf && !wire->closed))
        return;
    for (unsigned i = 0; i < MODBUS_HOST_CLIENTS; i++) {
        if (wire->closed && host->client[i].fd >= 0)
            modbus_host_hang_up(&host->client[i]);
        host->client[i].deaf = wire->deaf && host->client[i].fd >= 0;
    }
    wire->deaf = false;
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
        modbus_host_late(host);
        if (set[0].revents != 0)
            modbus_host_bridge_read(&host->bridge);
        for (unsigned i = 0; i < MODBUS_HOST_CLIENTS; i++)
            if (set[2 + i].revents != 0 && host->client[i].fd >= 0)
                modbus_host_read(host, &host->client[i]);
        if (set[1].revents != 0)
            modbus_host_accept(host);
        modbus_host_break(host);
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
    line->adapter = &host->seat;
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
    return thread_linux_start(&host->thread, modbus_host_run, host) == 0 ? 0
                                                                         : -1;
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

/* tests/peers/tools.c - what slew scan and slew drive do on CAN, over frames
 * that a peer carries: FD is a datagram socket, a frame each as Linux lays
 * it out (struct can_frame).  For machines whose kernel has no CAN.
 *
 *   tools NODE FD     prints what was found, read and written, a line each */
#include <errno.h>
#include <inttypes.h>
#include <linux/can.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#include "firmware/host/device/object.h"
#include "firmware/linux/tools/canopen_client.h"
#include "firmware/linux/tools/scan.h"
#include "hal/linux/clock.h"
#include "hal/linux/socketcan_frame.h"
#include "motion/core/err.h"

static int tools_socket;

static int tools_send(struct hal_can *can, const struct hal_can_frame *frame)
{
    struct canfd_frame raw;
    const size_t bytes = can_frame_encode(frame, &raw);

    (void)can;
    return send(tools_socket, &raw, bytes, 0) == (ssize_t)bytes ? MOTION_OK
                                                                : MOTION_E_FULL;
}

static int tools_flush(struct hal_can *can)
{
    (void)can;
    return MOTION_OK;
}

static int tools_recv(struct hal_can *can, struct hal_can_frame *frame)
{
    struct can_frame raw;

    (void)can;
    if (recv(tools_socket, &raw, sizeof raw, MSG_DONTWAIT) != sizeof raw)
        return 0;
    *frame = (struct hal_can_frame){ .id = raw.can_id & CAN_SFF_MASK,
                                     .len = raw.can_dlc };
    memcpy(frame->data, raw.data, sizeof raw.data);
    return 1;
}

static int tools_state(struct hal_can *can)
{
    (void)can;
    return HAL_CAN_ACTIVE;
}

static const struct hal_can_ops tools_ops = { .send = tools_send,
                                              .flush = tools_flush,
                                              .recv = tools_recv,
                                              .state = tools_state };

static void tools_read(struct canopen_client *client, const char *name)
{
    char message[OBJECT_MESSAGE_MAX], why[CANOPEN_CLIENT_TEXT_MAX];
    struct object object;
    uint32_t raw = 0;
    uint8_t size = 0;

    if (object_find(name, NULL, &object, message) < 0) {
        puts(message);
        return;
    }
    const int err = canopen_client_read_number(client, object.index, object.sub,
                                               &raw, &size);
    canopen_client_text(client, err, why);
    if (err < 0)
        printf("%s: %s\n", name, why);
    else
        printf("%s: %" PRId64 "\n", name, object_value(object.type, size, raw));
}

int main(int argc, char *argv[])
{
    static struct bench bench;
    static struct scan scan;
    static struct canopen_client client;
    struct hal_can can = { .ops = &tools_ops };
    struct clock_linux clock;
    const struct scan_config config = { .listen_ns = INT64_C(500000000) };

    if (argc != 3)
        return 2;
    tools_socket = atoi(argv[2]);
    struct hal_can *port = &can;
    struct rig_bus bus = { .kind = RIG_CANOPEN, .name = "peer" };

    bench.ports.can = &port;
    bench.ports.clock = clock_linux_init(&clock);
    bench.rig.bus = &bus;
    if (scan_can(&scan, &bench, &config) < 0)
        return 1;
    for (unsigned i = 0; i < scan.count; i++)
        printf("found %u: %s, %" PRIu32 ", %s\n", scan.found[i].id,
               scan.found[i].state, scan.found[i].identity.product,
               scan.found[i].fits);
    canopen_client_init(&client, &can, bench.ports.clock, 0);
    (void)canopen_client_node(&client, (uint8_t)atoi(argv[1]));
    tools_read(&client, "statusword");
    tools_read(&client, "6065");
    printf("set: %d\n",
           canopen_client_write_number(&client, 0x6065, 0, 4, 4321));
    tools_read(&client, "Following error window");
    tools_read(&client, "2F00");
    (void)canopen_client_node(&client, 99);
    tools_read(&client, "1000");
    return 0;
}

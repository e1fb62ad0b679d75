/* drive.c - a CiA 402 servo on a CAN port of one's own.
 *
 * A port is five functions.  This one writes what is sent as candump would, and
 * has nobody at its other end: the drive says so.  Put the functions of your
 * CAN controller in their place and call cycle() on every tick of your clock.
 *
 *   cc drive.c $(pkg-config --cflags --libs slew) -o drive */
#include <hal/canopen/canopen.h>
#include <hal/drive/cia402/drive.h>
#include <stdio.h>

#define MS INT64_C(1000000)

static int port_send(struct hal_can *can, const struct hal_can_frame *frame)
{
    (void)can;
    printf("can0 %03X#", (unsigned)frame->id);
    for (int i = 0; i < frame->len; i++)
        printf("%02X", frame->data[i]);
    printf(frame->remote ? "R\n" : "\n");
    return MOTION_OK;
}

static int port_flush(struct hal_can *can)
{
    (void)can;
    return MOTION_OK;
}

static int port_recv(struct hal_can *can, struct hal_can_frame *frame)
{
    (void)can;
    (void)frame;
    return 0; /* nothing has come */
}

static int port_state(struct hal_can *can)
{
    (void)can;
    return HAL_CAN_ACTIVE;
}

static void port_stats(struct hal_can *can, struct hal_can_stats *stats)
{
    (void)can;
    *stats = (struct hal_can_stats){ 0 };
}

static const struct hal_can_ops ops = { port_send, port_flush, port_recv,
                                        port_state, port_stats };

static struct canopen master;
static struct drive_cia402 servo;

/* One tick: what came, SYNC; a set point; what goes out. */
static void cycle(int64_t now_ns, int64_t pos_q32)
{
    const struct hal_drive_target target = { .pos_q32 = pos_q32 };
    (void)hal_fieldbus_begin(&master.fieldbus, now_ns);
    (void)hal_drive_set_target(&servo.drive, &target);
    hal_fieldbus_end(&master.fieldbus, now_ns);
}

int main(void)
{
    struct hal_can port = { &ops };
    const struct canopen_config bus = { .node_id = 127,
                                        .sync_period_ns = 10 * MS,
                                        .heartbeat_period_ns = 20 * MS };
    const struct drive_cia402_config config = {
        .node_id = 3,
        .counts_num = 10000,
        .counts_den = 1, /* per unit */
        .sync_period_ns = 10 * MS,
    };
    if (canopen_init(&master, &port, &bus) < 0 ||
        drive_cia402_init(&servo, &master, &config) < 0)
        return 1;
    hal_drive_request(&servo.drive, HAL_DRIVE_REQUEST_ENABLE);
    struct hal_drive_feedback feedback;
    for (int64_t now_ns = MS; now_ns < 2000 * MS; now_ns += 10 * MS)
        cycle(now_ns, 0);
    hal_drive_feedback(&servo.drive, &feedback);
    printf("node 3: %s, %s\n", hal_drive_state_text(feedback.state),
           feedback.fault_text);
    return 0;
}

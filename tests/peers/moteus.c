/* tests/peers/moteus.c - our moteus driver and our simulated moteus, for
 * somebody else's program to talk to.
 *
 *   moteus drive   a line "POS VEL TORQUE" (turns, turns/s, 0.001 Nm, decimal) is
 *                  a set point; answers the frame that goes to the drive
 *   moteus servo   a line of hex is a frame to the servo, one millisecond after
 *                  the one before; answers its reply, "-" when there is none
 *
 * Frames are hex, without an identifier (the servo's id is 1). */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "hal/drive/moteus/drive.h"
#include "hal/support/container_of.h"
#include "motion/core/fixed.h"
#include "sim/device/moteus/servo.h"
#include "sim/world.h"

#define MS INT64_C(1000000)

static void print_frame(const struct hal_can_frame *frame)
{
    for (unsigned i = 0; i < frame->len; i++)
        printf("%02x", frame->data[i]);
    putchar('\n');
    fflush(stdout);
}

static bool read_frame(const char *line, struct hal_can_frame *frame)
{
    *frame = (struct hal_can_frame){
        .id = 0x8001, .extended = true, .fd = true, .switched = true
    };
    for (; line[0] > ' ' && line[1] > ' '; line += 2) {
        const char pair[3] = { line[0], line[1], '\0' };

        if (frame->len == HAL_CAN_FD_DATA_MAX)
            return false;
        frame->data[frame->len++] = (uint8_t)strtoul(pair, NULL, 16);
    }
    while (!hal_can_is_legal(frame, true) && frame->len < HAL_CAN_FD_DATA_MAX)
        frame->data[frame->len++] = 0x50;
    return true;
}

/* ---- the driver: armed, on a port that keeps what was sent last ---- */

static struct hal_can_frame sent, heard;
static bool is_heard;

static int keep(struct hal_can *can, const struct hal_can_frame *frame)
{
    (void)can;
    sent = *frame;
    return MOTION_OK;
}

static int nothing(struct hal_can *can)
{
    (void)can;
    return 0;
}

static int hear(struct hal_can *can, struct hal_can_frame *frame)
{
    (void)can;
    if (!is_heard)
        return 0;
    *frame = heard;
    is_heard = false;
    return 1;
}

static void no_stats(struct hal_can *can, struct hal_can_stats *stats)
{
    (void)can;
    memset(stats, 0, sizeof *stats);
}

static struct can_bus bus;
static struct drive_moteus drive;
static int64_t now_ns = 1000 * MS;

/* One cycle; the drive says that it is in `mode`, at rest at 0. */
static void cycle(const char *mode, const struct hal_drive_target *target)
{
    char text[64];

    snprintf(text, sizeof text, "2100%s2f01%024d230d301f00", mode, 0);
    (void)read_frame(text, &heard);
    heard.id = 0x100;
    heard.extended = false;
    is_heard = true;
    (void)hal_fieldbus_begin(&bus.fieldbus, now_ns);
    if (target != NULL)
        (void)hal_drive_set_target(&drive.turn.drive, target);
    hal_fieldbus_end(&bus.fieldbus, now_ns);
    now_ns += MS;
}

static int play_drive(void)
{
    static const struct hal_can_ops ops = { .send = keep,
                                            .flush = nothing,
                                            .recv = hear,
                                            .state = nothing,
                                            .stats = no_stats };
    static struct hal_can can = { .ops = &ops };
    static const struct drive_moteus_config config = {
        .id = 1,
        .turn = { .turns_num = 1,
                  .turns_den = 1,
                  .period_ns = MS,
                  .stop_acc_q32 = INT64_C(1) << 32,
                  .rated_torque_mnm = 1000,
                  .first_step_max_q32 = INT64_MAX },
    };
    char line[256];
    double pos, vel, torque;

    can_bus_init(&bus, &can);
    if (drive_moteus_init(&drive, &bus, &config) < 0)
        return 1;
    cycle("00", NULL);
    cycle("00", NULL);
    hal_drive_request(&drive.turn.drive, HAL_DRIVE_REQUEST_ENABLE);
    cycle("00", NULL);
    while (fgets(line, sizeof line, stdin) != NULL &&
           sscanf(line, "%lf %lf %lf", &pos, &vel, &torque) == 3) {
        const struct hal_drive_target target = {
            .pos_q32 = (int64_t)(pos * 4294967296.0),
            .vel_q32 = (int64_t)(vel * 4294967296.0),
            .torque_permille = (int32_t)torque,
        };

        cycle("0a", &target);
        print_frame(&sent);
    }
    return 0;
}

/* ---- the servo ---- */

static struct sim_moteus servo;
static struct sim_can_port port;

static void answer(struct sim_world *world, const struct hal_can_frame *frame)
{
    struct hal_can_frame reply;

    (void)hal_can_send(&port.can, frame);
    sim_world_run(world, world->now_ns + MS);
    if (hal_can_recv(&port.can, &reply) == 1)
        print_frame(&reply);
    else
        puts("-");
    fflush(stdout);
}

static int play_servo(void)
{
    static struct sim_world world;
    static struct sim_can_bus wire;
    static const struct sim_moteus_config config = {
        .id = 1,
        .plant = { .omega_mrad_s = 400000,
                   .zeta_permille = 1000,
                   .vel_max_counts_s = 100 * SIM_MOTEUS_COUNTS,
                   .acc_max_counts_s2 = 100000 * (int64_t)SIM_MOTEUS_COUNTS },
    };
    struct hal_can_frame frame;
    char line[256];

    sim_world_init(&world, MS);
    if (sim_can_bus_init(&wire, &world, 1000000) < 0 ||
        sim_can_bus_set_fd(&wire, 5) < 0 ||
        sim_moteus_init(&servo, &wire, &config) < 0)
        return 1;
    sim_can_port_init(&port, &wire);
    while (fgets(line, sizeof line, stdin) != NULL && read_frame(line, &frame))
        answer(&world, &frame);
    return 0;
}

int main(int argc, char *argv[])
{
    if (argc == 2 && strcmp(argv[1], "drive") == 0)
        return play_drive();
    if (argc == 2 && strcmp(argv[1], "servo") == 0)
        return play_servo();
    return 2;
}

/* tests/hal/drive/turn/turn_world.h - the simulated drives that count turns, each
 * with its driver, one cycle per ms, over a port that loses what it is told to. */
#ifndef TESTS_HAL_DRIVE_TURN_TURN_WORLD_H
#define TESTS_HAL_DRIVE_TURN_TURN_WORLD_H

#include <string.h>

#include "motion/core/fixed.h"
#include "tests/support/can_behind.h"
#include "tests/support/check.h"
#include "tests/support/kind/kind.h"

#define MS  INT64_C(1000000)
#define ONE MOTION_FIXED_ONE_Q32

/* A port that loses what it is told to. */
struct leaky_can {
    struct can_behind port;
    bool mute, deaf;  /* the drive */
    uint32_t lost_id; /* of its frames that are lost; 0: none */
    unsigned sent;
};

static inline struct leaky_can *leaky_of(struct hal_can *can)
{
    return CONTAINER_OF(can, struct leaky_can, port.can);
}

static inline int leaky_send(struct hal_can *can,
                             const struct hal_can_frame *frame)
{
    struct leaky_can *self = leaky_of(can);

    self->sent++;
    return self->deaf ? MOTION_OK : can_behind_send(can, frame);
}

static inline int leaky_recv(struct hal_can *can, struct hal_can_frame *frame)
{
    struct leaky_can *self = leaky_of(can);
    int got;

    do
        got = hal_can_recv(self->port.inner, frame);
    while (got == 1 &&
           (self->mute || (self->lost_id != 0 && frame->id == self->lost_id)));
    return got;
}

static const struct hal_can_ops leaky_ops = {
    .send = leaky_send,
    .flush = can_behind_flush,
    .recv = leaky_recv,
    .state = can_behind_state,
    .stats = can_behind_stats,
};

static struct {
    struct sim_world world;
    struct sim_can_bus wire;
    struct sim_can_port port, witness;
    struct leaky_can leaky;
    struct can_bus bus;
    struct hal_drive *drive;
    struct hal_drive_feedback seen;
    int64_t now_ns, vel_q32, at_q32;
    const struct kind_turn *turn;
    bool streams, had_torque;
    int64_t last_vel_q24;
    int64_t cut_vel_q24;    /* how fast it was when torque went */
    int64_t worst_dvel_q24; /* within a tick */
} b;

static inline void setup(const struct kind_turn *turn)
{
    memset(&b, 0, sizeof b);
    b.turn = turn;
    b.now_ns = 1000 * MS;
    sim_world_init(&b.world, b.now_ns);
    assert_int_equal(sim_can_bus_init(&b.wire, &b.world, 1000000), 0);
    sim_can_port_init(&b.port, &b.wire);
    sim_can_port_init(&b.witness, &b.wire);
    b.leaky.port = (struct can_behind){ { &leaky_ops }, &b.port.can };
    can_bus_init(&b.bus, &b.leaky.port.can);
    b.drive = turn->init(&b.wire, &b.bus, KIND_PLAIN);
}

static inline void watch_torque(void)
{
    const int64_t vel_q24 = b.turn->servo->plant.vel_q24;
    const int64_t dvel_q24 = llabs(vel_q24 - b.last_vel_q24);
    const bool torque = b.turn->has_torque();

    if (b.had_torque && !torque)
        b.cut_vel_q24 = vel_q24;
    if (dvel_q24 > b.worst_dvel_q24)
        b.worst_dvel_q24 = dvel_q24;
    b.last_vel_q24 = vel_q24;
    b.had_torque = torque;
}

static inline void tick(void)
{
    const struct hal_drive_target target = { .pos_q32 = b.at_q32,
                                             .vel_q32 = b.vel_q32 };

    sim_world_run(&b.world, b.now_ns);
    watch_torque();
    (void)hal_fieldbus_begin(&b.bus.fieldbus, b.now_ns);
    hal_drive_feedback(b.drive, &b.seen);
    if (b.streams && b.seen.state == HAL_DRIVE_ENABLED) {
        assert_int_equal(hal_drive_set_target(b.drive, &target), 0);
        b.at_q32 += b.vel_q32 / 1000;
    }
    if (b.seen.state == HAL_DRIVE_FAULT || b.seen.state == HAL_DRIVE_OFFLINE)
        hal_drive_request(b.drive, HAL_DRIVE_REQUEST_OFF);
    hal_fieldbus_end(&b.bus.fieldbus, b.now_ns);
    b.now_ns += MS;
}

static inline void pass(int64_t dur_ns)
{
    for (int64_t i = 0; i < dur_ns / MS; i++)
        tick();
}

static inline void until(enum hal_drive_state state)
{
    for (int i = 0; i < 5000 && b.seen.state != state; i++)
        tick();
    if (b.seen.state != state)
        fail_msg("still %s: %s", hal_drive_state_text(b.seen.state),
                 b.seen.fault_text);
}

enum motion { STANDING, STREAMED, GOING, HOMING };

static inline void go(void)
{
    const struct hal_drive_go go = { .pos_q32 = 200 * ONE,
                                     .vel_q32 = 10 * ONE,
                                     .acc_q32 = INT64_C(100) << 32,
                                     .dec_q32 = INT64_C(100) << 32 };

    assert_int_equal(hal_drive_set_mode(b.drive, HAL_DRIVE_PROFILE_POSITION),
                     0);
    pass(5 * MS);
    assert_int_equal(hal_drive_go(b.drive, &go), 0);
}

/* Its end stop is two turns away, at most ten in a second. */
static inline void home(int64_t timeout_ns)
{
    const struct hal_drive_home home = { .timeout_ns = timeout_ns };

    assert_int_equal(hal_drive_set_mode(b.drive, HAL_DRIVE_HOMING), 0);
    pass(5 * MS);
    assert_int_equal(hal_drive_home(b.drive, &home), 0);
}

static inline void get_moving(const struct kind_turn *turn, enum motion motion)
{
    setup(turn);
    until(HAL_DRIVE_OFF);
    hal_drive_request(b.drive, HAL_DRIVE_REQUEST_ENABLE);
    until(HAL_DRIVE_ENABLED);
    b.at_q32 = b.seen.pos_q32;
    b.streams = motion <= STREAMED;
    b.vel_q32 = motion == STREAMED ? 10 * ONE : 0;
    if (motion == GOING)
        go();
    else if (motion == HOMING)
        home(60000 * MS);
    pass(1000 * MS);
    assert_int_equal(b.seen.state, HAL_DRIVE_ENABLED);
    assert_true(b.turn->has_torque());
}

static inline void each(void (*claim)(const struct kind_turn *turn))
{
    unsigned count = 0;

    for (unsigned i = 0; i < RIG_DRIVE_KINDS; i++)
        if (kind_tests[i]->turn != NULL) {
            claim(kind_tests[i]->turn);
            count++;
        }
    assert_true(count > 1);
}

#endif

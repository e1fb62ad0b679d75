/* tests/hal/drive/turn/test_lost_turn.c - drives that count turns and
 * are not heard any more, or hear nothing either, have no torque in the end. */
#include <inttypes.h>
#include <string.h>

#include "hal/support/container_of.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"
#include "tests/support/kind/kind.h"

#define MS  INT64_C(1000000)
#define ONE MOTION_FIXED_ONE_Q32

/* A port that loses what it is told to. */
struct leaky_can {
    struct hal_can can;
    struct hal_can *behind;
    bool mute, deaf; /* the drive */
    unsigned sent;
};

static struct leaky_can *leaky_of(struct hal_can *can)
{
    return CONTAINER_OF(can, struct leaky_can, can);
}

static int leaky_send(struct hal_can *can, const struct hal_can_frame *frame)
{
    struct leaky_can *self = leaky_of(can);

    self->sent++;
    return self->deaf ? MOTION_OK : hal_can_send(self->behind, frame);
}

static int leaky_flush(struct hal_can *can)
{
    return hal_can_flush(leaky_of(can)->behind);
}

static int leaky_recv(struct hal_can *can, struct hal_can_frame *frame)
{
    struct leaky_can *self = leaky_of(can);
    int got;

    do
        got = hal_can_recv(self->behind, frame);
    while (got == 1 && self->mute);
    return got;
}

static int leaky_state(struct hal_can *can)
{
    return hal_can_state(leaky_of(can)->behind);
}

static void leaky_stats(struct hal_can *can, struct hal_can_stats *stats)
{
    hal_can_stats(leaky_of(can)->behind, stats);
}

static const struct hal_can_ops leaky_ops = {
    .send = leaky_send,
    .flush = leaky_flush,
    .recv = leaky_recv,
    .state = leaky_state,
    .stats = leaky_stats,
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
    int64_t cut_vel_q24; /* how fast it was when torque went */
} b;

static void setup(const struct kind_turn *turn)
{
    memset(&b, 0, sizeof b);
    b.turn = turn;
    b.now_ns = 1000 * MS;
    sim_world_init(&b.world, b.now_ns);
    assert_int_equal(sim_can_bus_init(&b.wire, &b.world, 1000000), 0);
    sim_can_port_init(&b.port, &b.wire);
    sim_can_port_init(&b.witness, &b.wire);
    b.leaky.can.ops = &leaky_ops;
    b.leaky.behind = &b.port.can;
    can_bus_init(&b.bus, &b.leaky.can);
    b.drive = turn->init(&b.wire, &b.bus, KIND_PLAIN);
}

static void watch_torque(void)
{
    const bool torque = b.turn->has_torque();

    if (b.had_torque && !torque)
        b.cut_vel_q24 = b.turn->servo->plant.vel_q24;
    b.had_torque = torque;
}

static void tick(void)
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

static void pass(int64_t dur_ns)
{
    for (int64_t i = 0; i < dur_ns / MS; i++)
        tick();
}

static void until(enum hal_drive_state state)
{
    for (int i = 0; i < 5000 && b.seen.state != state; i++)
        tick();
    if (b.seen.state != state)
        fail_msg("still %s: %s", hal_drive_state_text(b.seen.state),
                 b.seen.fault_text);
}

enum motion { STANDING, STREAMED, GOING };

static void get_moving(const struct kind_turn *turn, enum motion motion)
{
    const struct hal_drive_go go = { .pos_q32 = 200 * ONE,
                                     .vel_q32 = 10 * ONE,
                                     .acc_q32 = INT64_C(100) << 32,
                                     .dec_q32 = INT64_C(100) << 32 };

    setup(turn);
    until(HAL_DRIVE_OFF);
    hal_drive_request(b.drive, HAL_DRIVE_REQUEST_ENABLE);
    until(HAL_DRIVE_ENABLED);
    b.at_q32 = b.seen.pos_q32;
    b.streams = motion != GOING;
    b.vel_q32 = motion == STREAMED ? 10 * ONE : 0;
    if (motion == GOING) {
        assert_int_equal(
            hal_drive_set_mode(b.drive, HAL_DRIVE_PROFILE_POSITION), 0);
        pass(5 * MS);
        assert_int_equal(hal_drive_go(b.drive, &go), 0);
    }
    pass(1000 * MS);
    assert_int_equal(b.seen.state, HAL_DRIVE_ENABLED);
    assert_true(b.turn->has_torque());
}

static void expect_text(const char *want)
{
    if (strstr(b.seen.fault_text, want) != b.seen.fault_text)
        fail_msg("\"%s\", not \"%s\"", b.seen.fault_text, want);
}

/* And then it does nothing, for nothing asks for it. */
static void expect_dark(void)
{
    assert_int_equal(b.seen.state, HAL_DRIVE_OFFLINE);
    assert_false(b.turn->has_torque());
    b.leaky.sent = 0;
    pass(1000 * MS);
    assert_int_equal(b.seen.state, HAL_DRIVE_OFFLINE);
    assert_false(b.turn->has_torque());
}

static void lose(const struct kind_turn *turn, enum motion motion, bool deaf,
                 bool comes_back)
{
    get_moving(turn, motion);
    b.leaky.mute = true;
    b.leaky.deaf = deaf;
    until(HAL_DRIVE_OFFLINE);
    expect_text("lost; trying to switch it off: ");
    pass(2000 * MS);
    if (!comes_back) {
        expect_text("lost; trying to switch it off: ");
        expect_dark();
        assert_in_range(b.leaky.sent, 5, 30); /* a second */
        return;
    }
    b.leaky.mute = b.leaky.deaf = false;
    pass(500 * MS);
    expect_text("lost, then switched off: ");
    expect_dark();
    assert_int_equal(b.leaky.sent, 0);
}

static void keeps_no_torque(const struct kind_turn *turn)
{
    for (int motion = STANDING; motion <= GOING; motion++) {
        lose(turn, (enum motion)motion, false, true);
        lose(turn, (enum motion)motion, true, true);
        lose(turn, (enum motion)motion, false, false);
    }
}

/* 10 units/s are a turn a second, 65536 counts/s. */
static void is_ramped_down(const struct kind_turn *turn)
{
    lose(turn, STREAMED, false, true);
    print_message("%s: %" PRId64 " counts/s when torque went\n", turn->text,
                  b.cut_vel_q24 >> 24);
    assert_true(b.cut_vel_q24 >> 24 < 3000);
    assert_true(b.cut_vel_q24 >> 24 > -3000);
}

/* A reset before it was heard: it is still being switched off. */
static void is_reset(const struct kind_turn *turn)
{
    get_moving(turn, STANDING);
    b.leaky.mute = b.leaky.deaf = true;
    until(HAL_DRIVE_OFFLINE);
    pass(500 * MS);
    hal_drive_request(b.drive, HAL_DRIVE_REQUEST_RESET);
    b.streams = false;
    pass(500 * MS);
    b.leaky.deaf = false; /* it hears again, and is not heard */
    pass(500 * MS);
    assert_false(b.turn->has_torque());
    b.leaky.mute = false;
    until(HAL_DRIVE_OFF);
    pass(500 * MS);
    assert_int_equal(b.seen.state, HAL_DRIVE_OFF);
    assert_false(b.turn->has_torque());
}

static void each(void (*claim)(const struct kind_turn *turn))
{
    unsigned count = 0;

    for (unsigned i = 0; i < RIG_DRIVE_KINDS; i++)
        if (kind_tests[i]->turn != NULL) {
            claim(kind_tests[i]->turn);
            count++;
        }
    assert_true(count > 1);
}

static void none_keeps_its_torque(void **state)
{
    (void)state;
    each(keeps_no_torque);
}

static void one_that_hears_is_ramped_down_first(void **state)
{
    (void)state;
    each(is_ramped_down);
}

static void a_reset_does_not_forget_the_torque(void **state)
{
    (void)state;
    each(is_reset);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(none_keeps_its_torque),
        cmocka_unit_test(one_that_hears_is_ramped_down_first),
        cmocka_unit_test(a_reset_does_not_forget_the_torque),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

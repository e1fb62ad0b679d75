/* tests/hal/drive/cia402/test_drive_cia402.c - the CiA 402 driver against a
 * drive in miniature.
 *
 * The miniature has just enough: a flat object table, the power states, and
 * a motor that is exactly where the interpolator is.  The drive that behaves
 * like a real one is sim/device/cia402/servo.h. */
#include "tests/hal/canopen/canopen_bench.h"
#include "tests/support/fake_can.h"

#include <inttypes.h>
#include <math.h>

#include "hal/drive/cia402/drive.h"
#include "motion/core/fixed.h"

#define NODE 5
#define ONE  MOTION_FIXED_ONE_Q32

/* ---- the drive in miniature ---- */

struct mini_object {
    uint16_t index;
    uint8_t sub, size;
    uint32_t value;
    uint32_t write_abort, read_abort;
    bool stuck; /* takes a write and keeps its value */
};

#define MINI_OBJECTS 64
#define MINI_LOG     256

struct mini {
    struct mini_object object[MINI_OBJECTS];
    unsigned object_count;
    uint32_t written[MINI_LOG]; /* index << 8 | sub, in order */
    unsigned written_count;
    uint8_t nmt;
    bool silent, mute_tpdo, mute_sdo, mute_heartbeat;
    bool no_power, not_remote, ignores, fault_sticks, ignores_nmt;
    bool quick_stop_stays;             /* 0x605A = 6 */
    unsigned brake;                    /* words with bit 3 until it opens */
    uint16_t status_set, status_clear; /* bits of the statusword */
    uint16_t controlword, previous_controlword;
    enum cia402_state state;
    int32_t pending, latched, actual; /* targets: received, latched at SYNC */
    int32_t drift; /* counts per SYNC while there is no torque */
    int64_t heartbeat_due_ns;
    uint16_t walked[64]; /* controlwords as they changed */
    unsigned walked_count;
    int32_t first_enabled_target, sdo_target;
};

static struct mini_object *mini_find(struct mini *mini, uint16_t index,
                                     uint8_t sub)
{
    for (unsigned i = 0; i < mini->object_count; i++)
        if (mini->object[i].index == index && mini->object[i].sub == sub)
            return &mini->object[i];
    return NULL;
}

static struct mini_object *mini_at(struct mini *mini, uint16_t index,
                                   uint8_t sub)
{
    struct mini_object *object = mini_find(mini, index, sub);

    assert_non_null(object);
    return object;
}

static void mini_remove(struct mini *mini, uint16_t index, uint8_t sub)
{
    struct mini_object *object = mini_at(mini, index, sub);

    *object = mini->object[--mini->object_count];
}

static void mini_init(struct mini *mini)
{
    static const struct mini_object objects[] = {
        { .index = 0x1000, .size = 4, .value = 0x00020192 },
        { .index = 0x1006, .size = 4 },
        { .index = 0x1016, .sub = 1, .size = 4 },
        { .index = 0x1017, .size = 2 },
        { .index = 0x1400, .sub = 1, .size = 4, .value = 0x205 },
        { .index = 0x1400, .sub = 2, .size = 1, .value = 255 },
        { .index = 0x1600, .sub = 0, .size = 1, .value = 1 },
        { .index = 0x1600, .sub = 1, .size = 4, .value = 0x60400010 },
        { .index = 0x1600, .sub = 2, .size = 4 },
        { .index = 0x1800, .sub = 1, .size = 4, .value = 0x40000185 },
        { .index = 0x1800, .sub = 2, .size = 1, .value = 255 },
        { .index = 0x1800, .sub = 3, .size = 2, .value = 100 },
        { .index = 0x1800, .sub = 5, .size = 2, .value = 100 },
        { .index = 0x1A00, .sub = 0, .size = 1, .value = 1 },
        { .index = 0x1A00, .sub = 1, .size = 4, .value = 0x60410010 },
        { .index = 0x1A00, .sub = 2, .size = 4 },
        { .index = 0x1801, .sub = 1, .size = 4, .value = 0x40000285 },
        { .index = 0x1801, .sub = 2, .size = 1, .value = 255 },
        { .index = 0x1801, .sub = 3, .size = 2 },
        { .index = 0x1A01, .sub = 0, .size = 1 },
        { .index = 0x1A01, .sub = 1, .size = 4 },
        { .index = 0x1802, .sub = 1, .size = 4, .value = 0x40000385 },
        { .index = 0x1803, .sub = 1, .size = 4, .value = 0x40000485 },
        { .index = 0x6007, .size = 2, .value = 1 },
        { .index = 0x603F, .size = 2 },
        { .index = 0x6040, .size = 2 },
        { .index = 0x605A, .size = 2, .value = 2 },
        { .index = 0x6060, .size = 1 },
        { .index = 0x6061, .size = 1 },
        { .index = 0x6064, .size = 4 },
        { .index = 0x6065, .size = 4, .value = 1000 },
        { .index = 0x607A, .size = 4 },
        { .index = 0x6085, .size = 4, .value = 1000 },
        { .index = 0x60C2, .sub = 1, .size = 1, .value = 4 },
        { .index = 0x60C2, .sub = 2, .size = 1, .value = 0xFD },
        { .index = 0x60FD, .size = 4 },
        { .index = 0x6502, .size = 4, .value = 0x000003ED },
    };

    memset(mini, 0, sizeof *mini);
    memcpy(mini->object, objects, sizeof objects);
    mini->object_count = ARRAY_LEN(objects);
    mini->nmt = 0x7F;
    mini->state = CIA402_SWITCH_ON_DISABLED;
}

static uint16_t mini_statusword(const struct mini *mini)
{
    static const uint16_t of[] = {
        [CIA402_NOT_READY] = 0x00,
        [CIA402_SWITCH_ON_DISABLED] = 0x40,
        [CIA402_READY] = 0x21,
        [CIA402_SWITCHED_ON] = 0x23,
        [CIA402_OPERATION_ENABLED] = 0x1027,
        [CIA402_QUICK_STOP_ACTIVE] = 0x07,
        [CIA402_FAULT_REACTION] = 0x0F,
        [CIA402_FAULT] = 0x08,
    };

    return (uint16_t)((of[mini->state] | (mini->no_power ? 0 : 0x10) |
                       (mini->not_remote ? 0 : 0x200) | mini->status_set) &
                      ~mini->status_clear);
}

static enum cia402_state mini_next(const struct mini *mini)
{
    const uint16_t word = mini->controlword;
    const bool rises = (word & ~mini->previous_controlword & 0x80) != 0;
    const bool shutdown = (word & 0x87) == 0x06;
    const bool switch_on = (word & 0x87) == 0x07;

    if (mini->state == CIA402_FAULT)
        return rises && !mini->fault_sticks ? CIA402_SWITCH_ON_DISABLED
                                            : CIA402_FAULT;
    if (mini->state == CIA402_QUICK_STOP_ACTIVE && mini->quick_stop_stays &&
        (word & 0x02) != 0)
        return mini->state;
    if (mini->state == CIA402_QUICK_STOP_ACTIVE || (word & 0x02) == 0)
        return CIA402_SWITCH_ON_DISABLED;
    if ((word & 0x04) == 0)
        return mini->state == CIA402_OPERATION_ENABLED
                   ? CIA402_QUICK_STOP_ACTIVE
                   : CIA402_SWITCH_ON_DISABLED;
    if (mini->state == CIA402_SWITCH_ON_DISABLED)
        return shutdown ? CIA402_READY : mini->state;
    if (shutdown)
        return CIA402_READY;
    if (mini->state == CIA402_READY)
        return switch_on && !mini->no_power ? CIA402_SWITCHED_ON : mini->state;
    if (!switch_on || (word & 0x08) == 0)
        return CIA402_SWITCHED_ON;
    return mini->brake > 0 ? mini->state : CIA402_OPERATION_ENABLED;
}

static void mini_obey(struct mini *mini, uint16_t controlword)
{
    mini->previous_controlword = mini->controlword;
    mini->controlword = controlword;
    if (controlword != mini->previous_controlword)
        mini->walked[mini->walked_count++ % 64] = controlword;
    if (!mini->not_remote && !mini->ignores) {
        const enum cia402_state before = mini->state;

        mini->state = mini_next(mini);
        mini->brake -= mini->brake > 0 && (controlword & 0x08) != 0;
        if (mini->state == CIA402_OPERATION_ENABLED && before != mini->state)
            mini->first_enabled_target = mini->pending;
    }
}

static void mini_sdo(struct mini *mini, const struct hal_can_frame *request,
                     struct fake_can *fake, int64_t t_ns)
{
    struct hal_can_frame answer = *request;
    const uint16_t index = (uint16_t)(request->data[1] | request->data[2] << 8);
    struct mini_object *object = mini_find(mini, index, request->data[3]);
    const bool write = (request->data[0] & 0xE0) == 0x20;
    const unsigned size = 4 - (request->data[0] >> 2 & 3u);
    uint32_t abort = 0, value;

    if (request->data[0] == 0x80 || mini->mute_sdo)
        return;
    answer.id = 0x580 + NODE;
    answer.t_ns = t_ns;
    memcpy(&value, &request->data[4], 4);
    if (object == NULL)
        abort = 0x06020000;
    else if (write ? object->write_abort : object->read_abort)
        abort = write ? object->write_abort : object->read_abort;
    else if (write && size != object->size)
        abort = 0x06070010;
    memset(&answer.data[4], 0, 4);
    if (abort != 0) {
        answer.data[0] = 0x80;
        memcpy(&answer.data[4], &abort, 4);
    } else if (write) {
        answer.data[0] = 0x60;
        mini->written[mini->written_count++ % MINI_LOG] =
            (uint32_t)index << 8 | request->data[3];
        if (!object->stuck)
            object->value = value;
        if (index == 0x6060)
            mini_at(mini, 0x6061, 0)->value =
                mini_at(mini, 0x6061, 0)->stuck ? 0 : value;
        if (index == 0x607A)
            mini->pending = mini->sdo_target = (int32_t)value;
        if (index == 0x6040)
            mini_obey(mini, (uint16_t)value);
    } else {
        if (index == 0x6064)
            object->value = (uint32_t)mini->actual;
        if (index == 0x607A && !object->stuck)
            object->value = (uint32_t)mini->pending;
        answer.data[0] = (uint8_t)(0x43 | (4 - object->size) << 2);
        memcpy(&answer.data[4], &object->value, object->size);
    }
    fake_can_put_frame(fake, &answer);
}

/* The interpolator reaches at this SYNC what was latched at the last one. */
static void mini_sync(struct mini *mini, struct fake_can *fake, int64_t t_ns)
{
    struct hal_can_frame tpdo = { .id = 0x180 + NODE, .len = 6, .t_ns = t_ns };
    uint16_t statusword;

    if (mini->nmt != 0x05)
        return;
    if (mini->state == CIA402_OPERATION_ENABLED)
        mini->actual = mini->latched;
    else
        mini->actual =
            (int32_t)((uint32_t)mini->actual + (uint32_t)mini->drift);
    mini_obey(mini, mini->controlword);
    mini->latched = mini->pending;
    statusword = mini_statusword(mini);
    memcpy(&tpdo.data[0], &statusword, 2);
    memcpy(&tpdo.data[2], &mini->actual, 4);
    if (!mini->mute_tpdo)
        fake_can_put_frame(fake, &tpdo);
}

static void mini_rpdo(struct mini *mini, const struct hal_can_frame *frame)
{
    uint16_t word;

    if (mini->nmt != 0x05)
        return;
    assert_int_equal(frame->len, 6);
    assert_int_equal(mini_at(mini, 0x1600, 2)->value, 0x607A0020);
    memcpy(&word, &frame->data[0], 2);
    memcpy(&mini->pending, &frame->data[2], 4);
    mini_obey(mini, word);
}

static void mini_frame(struct mini *mini, const struct hal_can_frame *frame,
                       struct fake_can *fake, int64_t now_ns)
{
    const int64_t t_ns = now_ns + 200000;

    if (mini->silent)
        return;
    if (frame->id == 0x000 && mini->ignores_nmt)
        return;
    if (frame->id == 0x000)
        mini->nmt = frame->data[0] == 0x01 ? 0x05 : 0x7F;
    else if (frame->id == 0x080)
        mini_sync(mini, fake, t_ns);
    else if (frame->id == 0x200 + NODE)
        mini_rpdo(mini, frame);
    else if (frame->id == 0x600 + NODE)
        mini_sdo(mini, frame, fake, t_ns);
}

static void mini_heartbeat(struct mini *mini, struct fake_can *fake,
                           int64_t now_ns)
{
    const uint32_t period_ms = mini_at(mini, 0x1017, 0)->value;
    const struct hal_can_frame beat = {
        .id = 0x700 + NODE, .len = 1, .data = { mini->nmt }, .t_ns = now_ns
    };

    if (mini->silent || mini->mute_heartbeat || period_ms == 0 ||
        now_ns < mini->heartbeat_due_ns)
        return;
    mini->heartbeat_due_ns = now_ns + period_ms * MS;
    fake_can_put_frame(fake, &beat);
}

/* ---- the bench ---- */

struct bench {
    struct fake_can fake;
    struct canopen master;
    struct drive_cia402 drive;
    struct mini mini;
    struct hal_drive_feedback seen;
    int64_t now_ns;
};

static const struct canopen_config master_config = CANOPEN_BENCH_MASTER;

static const struct drive_cia402_config drive_config = {
    .node_id = NODE,
    CANOPEN_BENCH_COUNTS,
    .heartbeat_period_ns = 20 * MS,
    .watchdog_ns = 50 * MS,
    .following_error_counts = 500,
    .quick_stop_counts_s2 = 90000,
};

static void bench_of(struct bench *b, const struct drive_cia402_config *config)
{
    memset(b, 0, sizeof *b);
    fake_can_init(&b->fake);
    mini_init(&b->mini);
    b->mini.actual = -123456;
    b->now_ns = 1000 * MS;
    assert_int_equal(canopen_init(&b->master, &b->fake.can, &master_config), 0);
    assert_int_equal(drive_cia402_init(&b->drive, &b->master, config), 0);
}

static int bench_setup(void **state)
{
    static struct bench bench;

    bench_of(&bench, &drive_config);
    *state = &bench;
    return 0;
}

static void bench_begin(struct bench *b)
{
    (void)hal_fieldbus_begin(&b->master.fieldbus, b->now_ns);
    hal_drive_feedback(&b->drive.drive, &b->seen);
}

static void bench_end(struct bench *b)
{
    hal_fieldbus_end(&b->master.fieldbus, b->now_ns);
    if (b->fake.in_at == b->fake.in_count)
        b->fake.in_at = b->fake.in_count = 0;
    while (b->fake.out_at < b->fake.out_count)
        mini_frame(&b->mini, &b->fake.out[b->fake.out_at++], &b->fake,
                   b->now_ns);
    b->fake.out_at = b->fake.out_count = 0;
    mini_heartbeat(&b->mini, &b->fake, b->now_ns);
    b->now_ns += 1 * MS;
}

static void tick(struct bench *b)
{
    bench_begin(b);
    bench_end(b);
}

static void ticks(struct bench *b, unsigned count)
{
    while (count-- > 0)
        tick(b);
}

/* Ticks until the state was reported; fails after `most`. */
static unsigned until(struct bench *b, enum hal_drive_state state,
                      unsigned most)
{
    for (unsigned i = 1; i <= most; i++) {
        tick(b);
        if (b->seen.state == state)
            return i;
    }
    fail_msg("still %s after %u ticks: %s", hal_drive_state_text(b->seen.state),
             most, b->seen.fault_text);
    return 0;
}

static void request(struct bench *b, enum hal_drive_request what)
{
    hal_drive_request(&b->drive.drive, what);
}

static void enable(struct bench *b)
{
    if (b->seen.state != HAL_DRIVE_OFF)
        until(b, HAL_DRIVE_OFF, 200);
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_ENABLED, 100);
}

static int set_pos(struct bench *b, int64_t pos_q32)
{
    const struct hal_drive_target target = { .pos_q32 = pos_q32 };

    return hal_drive_set_target(&b->drive.drive, &target);
}

/* Counts of a position with 1000 counts per unit, and back; to nearest. */
static int64_t counts_of(int64_t pos_q32)
{
    int64_t counts = 0;

    motion_fixed_muldiv(pos_q32, 1000, ONE, &counts);
    return counts;
}

static int64_t pos_of(int64_t counts)
{
    int64_t pos_q32 = 0;

    motion_fixed_muldiv(counts, ONE, 1000, &pos_q32);
    return pos_q32;
}

#define assert_text(b, want)                                                   \
    do {                                                                       \
        if (strstr((b)->seen.fault_text, want) == NULL)                        \
            fail_msg("\"%s\" is not in \"%s\"", want, (b)->seen.fault_text);   \
    } while (0)

/* ---- statusword ---- */

static const struct {
    uint16_t statusword;
    enum cia402_state want;
} statuswords[] = {
    { 0x0000, CIA402_NOT_READY },
    { 0x0240, CIA402_SWITCH_ON_DISABLED },
    { 0x0250, CIA402_SWITCH_ON_DISABLED },
    { 0x0260, CIA402_SWITCH_ON_DISABLED },
    { 0x0231, CIA402_READY },
    { 0x0233, CIA402_SWITCHED_ON },
    { 0x0237, CIA402_OPERATION_ENABLED },
    { 0x1237, CIA402_OPERATION_ENABLED },
    { 0x1637, CIA402_OPERATION_ENABLED },
    { 0x0217, CIA402_QUICK_STOP_ACTIVE },
    { 0x021F, CIA402_FAULT_REACTION },
    { 0x023F, CIA402_FAULT_REACTION },
    { 0x0218, CIA402_FAULT },
    { 0x0238, CIA402_FAULT },
    { 0x0211, CIA402_UNKNOWN }, /* ready, but quick stop active */
    { 0x0271, CIA402_UNKNOWN },
    { 0xFFFF, CIA402_UNKNOWN },
};

static void statuswords_are_decoded(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(statuswords); i++)
        if (cia402_state_of(statuswords[i].statusword) != statuswords[i].want)
            fail_msg("0x%04X", statuswords[i].statusword);
    assert_string_equal(cia402_state_text(CIA402_READY), "ready to switch on");
    assert_string_equal(cia402_state_text(CIA402_UNKNOWN), "unknown");
    assert_string_equal(cia402_state_text((enum cia402_state)99), "unknown");
}

static void bits_of_no_state_do_not_change_it(void **state)
{
    (void)state;
    for (unsigned word = 0; word <= 0xFFFF; word++)
        assert_int_equal(cia402_state_of((uint16_t)word),
                         cia402_state_of((uint16_t)(word & 0x6F)));
}

/* ---- start-up ---- */

static void start_up_ends_off_with_everything_written(void **state)
{
    static const struct {
        uint16_t index;
        uint8_t sub;
        uint32_t want;
    } rows[] = {
        { 0x1006, 0, 1000 },       { 0x1016, 1, 127 << 16 | 50 },
        { 0x1017, 0, 20 },         { 0x6007, 0, 3 },
        { 0x60C2, 1, 1 },          { 0x60C2, 2, 0xFD },
        { 0x6065, 0, 500 },        { 0x6085, 0, 90000 },
        { 0x1400, 1, 0x205 },      { 0x1400, 2, 1 },
        { 0x1600, 0, 2 },          { 0x1600, 1, 0x60400010 },
        { 0x1600, 2, 0x607A0020 }, { 0x1800, 1, 0x40000185 },
        { 0x1800, 2, 1 },          { 0x1800, 3, 0 },
        { 0x1800, 5, 0 },          { 0x1A00, 0, 2 },
        { 0x1A00, 1, 0x60410010 }, { 0x1A00, 2, 0x60640020 },
        { 0x1801, 1, 0x40000285 }, { 0x1A01, 1, 0x60FD0020 },
        { 0x1802, 1, 0xC0000385 }, { 0x1803, 1, 0xC0000485 },
        { 0x6060, 0, 8 },          { 0x607A, 0, (uint32_t)-123456 },
    };
    struct bench *b = *state;
    unsigned took = 0;

    for (; b->seen.state != HAL_DRIVE_OFF && took < 200; took++) {
        bench_begin(b);
        assert_int_equal(b->master.stats.rpdo_sent, 0);
        bench_end(b);
    }
    print_message("off after %u ticks\n", took);
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        if (mini_at(&b->mini, rows[i].index, rows[i].sub)->value !=
            rows[i].want)
            fail_msg(
                "0x%04X:%u is 0x%X", rows[i].index, rows[i].sub,
                (unsigned)mini_at(&b->mini, rows[i].index, rows[i].sub)->value);
    assert_int_equal(b->mini.nmt, 0x05);
    assert_string_equal(b->seen.fault_text, "");
    assert_int_equal(counts_of(b->seen.pos_q32), -123456);
    assert_int_equal(b->master.stats.unexpected, 0);
    assert_int_equal(b->master.stats.malformed, 0);
}

/* Position of the n-th write (from 1) of an object in the log; 0: none. */
static unsigned written_at(const struct mini *mini, uint32_t object, unsigned n)
{
    for (unsigned i = 0; i < mini->written_count; i++)
        if (mini->written[i] == object && --n == 0)
            return i + 1;
    return 0;
}

static void a_pdo_is_mapped_in_the_order_every_drive_accepts(void **state)
{
    static const uint32_t order[2][7] = {
        { 0x140001, 0x160000, 0x160001, 0x160002, 0x160000, 0x140002,
          0x140001 },
        { 0x180001, 0x1A0000, 0x1A0001, 0x1A0002, 0x1A0000, 0x180002,
          0x180001 },
    };
    static const unsigned nth[7] = { 1, 1, 1, 1, 2, 1, 2 };
    struct bench *b = *state;

    until(b, HAL_DRIVE_OFF, 200);
    for (unsigned pdo = 0; pdo < 2; pdo++) {
        unsigned before = 0;

        for (unsigned i = 0; i < 7; i++) {
            const unsigned at = written_at(&b->mini, order[pdo][i], nth[i]);

            assert_true(at > before);
            before = at;
        }
    }
    assert_true(written_at(&b->mini, 0x600700, 1) <
                written_at(&b->mini, 0x140001, 1));
}

static void a_drive_without_optional_objects_will_do(void **state)
{
    static const uint32_t optional[] = { 0x100600, 0x60C201, 0x60C202, 0x180003,
                                         0x180005, 0x180101, 0x180201, 0x180301,
                                         0x603F00, 0x60FD00, 0x650200 };

    for (unsigned i = 0; i <= ARRAY_LEN(optional); i++) {
        struct bench *b;

        bench_setup(state);
        b = *state;
        for (unsigned k = 0; k < ARRAY_LEN(optional); k++)
            if (i == k || i == ARRAY_LEN(optional))
                mini_remove(&b->mini, (uint16_t)(optional[k] >> 8),
                            (uint8_t)optional[k]);
        enable(b);
    }
}

static void switches_that_cannot_be_mapped_are_left_off(void **state)
{
    struct bench *b = *state;

    mini_at(&b->mini, 0x1A01, 1)->write_abort = 0x06040041;
    enable(b);
    assert_int_equal(mini_at(&b->mini, 0x1801, 1)->value, 0xC0000285);
}

static void a_cob_id_may_read_back_with_the_no_rtr_bit(void **state)
{
    struct bench *b = *state;
    struct mini_object *cob = mini_at(&b->mini, 0x1800, 1);

    cob->stuck = true;
    cob->value = 0x40000185;
    until(b, HAL_DRIVE_OFF, 200);
}

/* Read-only is as good when the value is right. */
static void a_fixed_interpolation_period_must_be_ours(void **state)
{
    static const uint8_t counts[] = { 1, 2 };

    for (unsigned i = 0; i < ARRAY_LEN(counts); i++) {
        struct bench *b;

        bench_setup(state);
        b = *state;
        mini_at(&b->mini, 0x60C2, 1)->write_abort = CANOPEN_ABORT_READ_ONLY;
        mini_at(&b->mini, 0x60C2, 2)->write_abort = CANOPEN_ABORT_READ_ONLY;
        mini_at(&b->mini, 0x60C2, 1)->value = counts[i];
        until(b, counts[i] == 1 ? HAL_DRIVE_OFF : HAL_DRIVE_FAULT, 200);
    }
}

static const struct {
    uint32_t object;
    char what; /* w: write aborted, s: keeps its value, v: has this value */
    uint32_t value;
    const char *text;
} refusals[] = {
    { 0x100000, 'v', 0x00020191, "not a CiA 402 drive" },
    { 0x650200, 'v', 0x00000025, "no cyclic position mode" },
    { 0x600700, 's', 1, "0x6007:00 reads back 0x00000001" },
    { 0x101601, 's', 0, "0x1016:01 reads back" },
    { 0x101601, 'w', 0x06040043,
      "0x1016:01 refused (06040043): needs unsupervised: yes" },
    { 0x160002, 'w', 0x06040041, "object cannot be mapped (06040041)" },
    { 0x160002, 's', 0x60FF0020, "0x1600:02 reads back 0x60FF0020" },
    { 0x1A0002, 's', 0x606C0020, "0x1A00:02 reads back" },
    { 0x140001, 's', 0x206, "0x1400:01 reads back 0x00000206" },
    { 0x60C201, 'w', 0x06090030, "0x60C2:01 reads back 0x00000004" },
    { 0x60C201, 's', 4, "0x60C2:01 reads back 0x00000004" },
    { 0x606500, 'w', 0x06020000, "0x6065:00 refused: no such object" },
    { 0x607A00, 's', 0, "0x607A is not at the actual position" },
};

static void a_drive_that_refuses_its_configuration_gets_no_torque(void **state)
{
    for (size_t i = 0; i < ARRAY_LEN(refusals); i++) {
        const uint32_t at = refusals[i].object;
        struct mini_object *object;
        struct bench *b;

        bench_setup(state);
        b = *state;
        object = mini_at(&b->mini, (uint16_t)(at >> 8), (uint8_t)at);
        if (refusals[i].what == 'w')
            object->write_abort = refusals[i].value;
        else
            object->value = refusals[i].value;
        object->stuck = refusals[i].what == 's';
        request(b, HAL_DRIVE_REQUEST_ENABLE);
        until(b, HAL_DRIVE_FAULT, 300);
        assert_text(b, refusals[i].text);
        ticks(b, 50);
        request(b, HAL_DRIVE_REQUEST_ENABLE);
        ticks(b, 50);
        assert_int_equal(b->seen.state, HAL_DRIVE_FAULT);
        assert_int_equal(b->mini.state, CIA402_SWITCH_ON_DISABLED);
    }
}

static void a_target_that_does_not_stay_is_told_before_enabling(void **state)
{
    struct bench *b = *state;

    mini_at(&b->mini, 0x607A, 0)->stuck = true;
    until(b, HAL_DRIVE_FAULT, 200);
    assert_text(b, "0x607A is not at the actual position");
}

static void a_drive_that_ignores_nmt_is_told(void **state)
{
    struct bench *b = *state;

    b->mini.nmt = 0x05;
    b->mini.ignores_nmt = true;
    until(b, HAL_DRIVE_OFFLINE, 1);
    ticks(b, 1200);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFFLINE);
    assert_text(b, "no heartbeat shows the requested NMT state");
    assert_int_equal(written_at(&b->mini, 0x101601, 1), 0);
}

/* Each row is asked three times, 200 ms apart. */
static void two_lost_answers_in_a_row_are_made_good_again(void **state)
{
    struct bench *b = *state;

    for (int i = 0; i < 2; i++) {
        ticks(b, 20);
        b->mini.mute_sdo = true;
        ticks(b, 250);
        b->mini.mute_sdo = false;
        ticks(b, 200);
    }
    until(b, HAL_DRIVE_OFF, 200);
    bench_setup(state);
    ticks(b, 20);
    b->mini.mute_sdo = true;
    ticks(b, 630);
    b->mini.mute_sdo = false;
    ticks(b, 200);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFFLINE);
    assert_text(b, "does not answer");
}

static void a_mode_that_is_not_taken_is_waited_for_and_told(void **state)
{
    struct bench *b = *state;

    mini_at(&b->mini, 0x6061, 0)->stuck = true;
    until(b, HAL_DRIVE_FAULT, 5200);
    assert_text(b, "0x6061:00 stays at 0x00000000");
}

static void a_silent_drive_is_asked_until_it_answers(void **state)
{
    struct bench *b = *state;

    b->mini.silent = true;
    ticks(b, 1000);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFFLINE);
    assert_text(b, "node 5 does not answer");
    b->mini.silent = false;
    until(b, HAL_DRIVE_OFF, 400);
    assert_string_equal(b->seen.fault_text, "");
}

static void a_drive_that_falls_silent_in_start_up_is_offline(void **state)
{
    struct bench *b = *state;

    ticks(b, 10);
    b->mini.silent = true;
    ticks(b, 700);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFFLINE);
    assert_text(b, "does not answer");
    b->mini.silent = false;
    ticks(b, 300); /* latched */
    assert_int_equal(b->seen.state, HAL_DRIVE_OFFLINE);
    request(b, HAL_DRIVE_REQUEST_RESET);
    until(b, HAL_DRIVE_OFF, 300);
}

static void a_boot_up_in_start_up_begins_it_anew(void **state)
{
    struct bench *b = *state;

    ticks(b, 20);
    mini_init(&b->mini);
    fake_can_put(&b->fake, "705#00");
    until(b, HAL_DRIVE_OFF, 200);
    assert_int_equal(mini_at(&b->mini, 0x6007, 0)->value, 3);
    assert_int_equal(mini_at(&b->mini, 0x1017, 0)->value, 20);
}

static void no_tpdo_and_no_heartbeat_have_their_own_words(void **state)
{
    struct bench *b = *state;

    b->mini.mute_tpdo = true;
    ticks(b, 1200);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFFLINE);
    assert_text(b, "no TPDO1 answers SYNC");
    bench_setup(state);
    b->mini.mute_heartbeat = true;
    ticks(b, 1200);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFFLINE);
    assert_text(b, "no heartbeat");
}

static void a_drive_found_enabled_is_stopped_first(void **state)
{
    struct bench *b = *state;

    b->mini.nmt = 0x05;
    b->mini.state = CIA402_OPERATION_ENABLED;
    b->mini.latched = b->mini.pending = b->mini.actual;
    until(b, HAL_DRIVE_OFF, 200);
    assert_int_not_equal(b->mini.state, CIA402_OPERATION_ENABLED);
    assert_int_equal(b->mini.actual, -123456);
    assert_int_equal(b->mini.walked[0], 0x02);
}

/* ---- enabling ---- */

static void enabling_goes_one_state_at_a_time(void **state)
{
    static const uint16_t want[] = { 0x06, 0x07, 0x0F };
    struct bench *b = *state;
    unsigned before;

    until(b, HAL_DRIVE_OFF, 200);
    ticks(b, 10);
    before = b->mini.walked_count;
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    tick(b);
    assert_int_equal(b->seen.state, HAL_DRIVE_ENABLING);
    until(b, HAL_DRIVE_ENABLED, 100);
    assert_int_equal(b->mini.walked_count - before, ARRAY_LEN(want));
    for (unsigned i = 0; i < ARRAY_LEN(want); i++)
        assert_int_equal(b->mini.walked[before + i], want[i]);
    assert_true(b->seen.following);
}

static void an_enabled_axis_does_not_jump(void **state)
{
    struct bench *b = *state;

    enable(b);
    assert_int_equal(b->mini.first_enabled_target, -123456);
    for (int i = 0; i < 100; i++) {
        tick(b);
        assert_int_equal(b->mini.actual, -123456);
    }
}

static void set_points_before_enabling_do_not_reach_the_drive(void **state)
{
    struct bench *b = *state;

    until(b, HAL_DRIVE_OFF, 200);
    for (int i = 0; i < 20; i++) {
        bench_begin(b);
        assert_int_equal(set_pos(b, 0), MOTION_OK);
        bench_end(b);
        assert_int_equal(b->mini.pending, -123456);
    }
}

static void an_axis_that_is_pushed_is_enabled_where_it_stands(void **state)
{
    struct bench *b = *state;

    until(b, HAL_DRIVE_OFF, 200);
    b->mini.drift = 3; /* counts per ms, by hand */
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_ENABLED, 100);
    assert_int_equal(b->mini.first_enabled_target, b->mini.sdo_target);
    assert_in_range(b->mini.actual - b->mini.first_enabled_target + 50, 0, 100);
}

static void a_brake_may_take_its_time(void **state)
{
    struct bench *b = *state;

    b->mini.brake = 2500;
    until(b, HAL_DRIVE_OFF, 200);
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    assert_true(until(b, HAL_DRIVE_ENABLED, 2000) > 1000);
    bench_setup(state);
    b->mini.brake = 100000;
    until(b, HAL_DRIVE_OFF, 200);
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    assert_true(until(b, HAL_DRIVE_FAULT, 3100) > 3000);
    assert_text(b, "stays in switched on for 3000 ms (brake)");
}

/* Back to Ready while the brake opens, pushed, and up again. */
static void the_target_is_preloaded_again_after_a_fall(void **state)
{
    struct bench *b = *state;

    b->mini.brake = 100;
    until(b, HAL_DRIVE_OFF, 200);
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    ticks(b, 40);
    assert_int_equal(b->mini.state, CIA402_SWITCHED_ON);
    b->mini.state = CIA402_READY;
    b->mini.ignores = true;
    b->mini.drift = 500;
    ticks(b, 40);
    b->mini.drift = 0;
    b->mini.ignores = false;
    until(b, HAL_DRIVE_ENABLED, 200);
    assert_int_equal(b->mini.first_enabled_target, -123456 + 40 * 500);
    /* start-up, before the fall, after it */
    assert_int_not_equal(written_at(&b->mini, 0x607A00, 3), 0);
}

/* Off and on again before the drive has come further down than Switched on. */
static void the_target_is_preloaded_again_after_a_change_of_mind(void **state)
{
    struct bench *b = *state;
    unsigned before;

    enable(b);
    before = written_at(&b->mini, 0x607A00, 2);
    assert_int_not_equal(before, 0);
    request(b, HAL_DRIVE_REQUEST_OFF);
    for (int i = 0; i < 10 && b->mini.state == CIA402_OPERATION_ENABLED; i++)
        tick(b);
    assert_int_equal(b->mini.state, CIA402_SWITCHED_ON);
    b->mini.drift = 10;
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_ENABLED, 50);
    assert_true(written_at(&b->mini, 0x607A00, 3) > before);
}

static void a_fault_while_preloading_still_gets_its_code(void **state)
{
    struct bench *b = *state;

    until(b, HAL_DRIVE_OFF, 200);
    b->mini.brake = 1000;
    mini_at(&b->mini, 0x603F, 0)->value = 0x7305;
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    while (b->mini.state != CIA402_SWITCHED_ON)
        tick(b);
    b->mini.mute_sdo = true; /* a request stays under way */
    ticks(b, 10);
    b->mini.state = CIA402_FAULT;
    until(b, HAL_DRIVE_FAULT, 5);
    b->mini.mute_sdo = false;
    ticks(b, 10);
    assert_int_equal(b->seen.fault_code, 0x7305);
    assert_text(b, "sensor or encoder");
}

static void an_axis_that_moves_too_fast_is_not_enabled(void **state)
{
    struct bench *b = *state;

    until(b, HAL_DRIVE_OFF, 200);
    b->mini.drift = 2000; /* two units per ms */
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_FAULT, 100);
    assert_int_not_equal(b->mini.state, CIA402_OPERATION_ENABLED);
}

static void the_first_set_point_must_be_where_the_axis_is(void **state)
{
    static const struct {
        int64_t counts;
        int want;
    } rows[] = {
        { -123456, MOTION_OK },
        { -123456 + 1000, MOTION_OK },
        { -123456 - 1000, MOTION_OK },
        { -123456 + 1001, MOTION_E_AWAY },
        { -123456 - 1001, MOTION_E_AWAY },
        { 0, MOTION_E_AWAY },
    };

    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct bench *b;

        bench_setup(state);
        b = *state;
        enable(b);
        assert_int_equal(set_pos(b, pos_of(rows[i].counts)), rows[i].want);
        ticks(b, 5);
        assert_int_equal(b->seen.state, rows[i].want == MOTION_OK
                                            ? HAL_DRIVE_ENABLED
                                            : HAL_DRIVE_FAULT);
        if (rows[i].want != MOTION_OK)
            assert_int_equal(b->mini.actual, -123456);
    }
}

static void the_first_step_is_at_least_one_count(void **state)
{
    struct drive_cia402_config config = drive_config;
    struct bench *b = *state;

    config.first_step_max_q32 = 1;
    for (int counts = 1; counts <= 2; counts++) {
        bench_of(b, &config);
        enable(b);
        assert_int_equal(set_pos(b, pos_of(-123456 + counts)),
                         counts == 1 ? MOTION_OK : MOTION_E_AWAY);
    }
}

static const struct {
    bool no_power, not_remote, ignores;
    unsigned most, least; /* ticks */
    const char *text;
} stuck[] = {
    { true, false, false, 3100, 3000, /* it may charge */
      "no power (STO or mains) for 3000 ms, 0x6041=0221" },
    { false, true, false, 300, 250,
      "not in remote mode for 250 ms, 0x6041=0050" },
    { false, false, true, 1100, 1000,
      "stays in switch on disabled for 1000 ms, 0x6041=0250" },
};

static void a_drive_that_does_not_get_on_says_why(void **state)
{
    for (size_t i = 0; i < ARRAY_LEN(stuck); i++) {
        struct bench *b;
        unsigned took;

        bench_setup(state);
        b = *state;
        b->mini.no_power = stuck[i].no_power;
        b->mini.not_remote = stuck[i].not_remote;
        until(b, HAL_DRIVE_OFF, 200);
        b->mini.ignores = stuck[i].ignores;
        request(b, HAL_DRIVE_REQUEST_ENABLE);
        took = until(b, HAL_DRIVE_FAULT, stuck[i].most);
        assert_true(took >= stuck[i].least);
        assert_text(b, stuck[i].text);
        b->mini.no_power = b->mini.not_remote = b->mini.ignores = false;
        ticks(b, 100);
        assert_int_equal(b->seen.state, HAL_DRIVE_FAULT);
        request(b, HAL_DRIVE_REQUEST_RESET);
        until(b, HAL_DRIVE_OFF, 10);
        ticks(b, 100); /* and not on by itself */
        assert_int_equal(b->seen.state, HAL_DRIVE_OFF);
    }
}

/* ---- following ---- */

/* What was handed over when. */
struct given {
    int64_t t_ns;
    int32_t counts;
};

static int32_t given_at(const struct given *given, unsigned count, int64_t t_ns)
{
    for (unsigned i = count; i-- > 0;)
        if (given[i].t_ns == t_ns)
            return given[i].counts;
    fail_msg("nothing was given at %" PRId64, t_ns);
    return 0;
}

/* Take the answer to the SYNC of this cycle off the wire: it will end just when
 * the next SYNC is asked for. */
static struct hal_can_frame bench_hold_tpdo(struct bench *b)
{
    for (unsigned i = b->fake.in_at; i < b->fake.in_count; i++) {
        struct hal_can_frame frame = b->fake.in[i];

        if (frame.id != 0x180 + NODE)
            continue;
        memmove(&b->fake.in[i], &b->fake.in[i + 1],
                (--b->fake.in_count - i) * sizeof frame);
        frame.t_ns = b->now_ns;
        return frame;
    }
    fail_msg("no TPDO1");
    return b->fake.in[0];
}

static void bench_insert(struct bench *b, const struct hal_can_frame *frame)
{
    struct hal_can_frame *at = &b->fake.in[b->fake.in_at];

    memmove(at + 1, at, (b->fake.in_count++ - b->fake.in_at) * sizeof *at);
    *at = *frame;
}

/* The miniature is exactly where its interpolator is, so with the age that the
 * drive reports the following error is exactly zero on every tick, whatever
 * the clock does. */
static void run_ramp(struct bench *b, int64_t jitter_ns, unsigned lose_every,
                     unsigned late_every)
{
    static struct given given[600];
    struct hal_can_frame held = { 0 };
    uint64_t seed = 7;
    unsigned judged = 0;

    enable(b);
    for (unsigned i = 0; i < 500; i++) {
        const int32_t counts = -123456 + (int32_t)(i * i / 4);

        bench_begin(b);
        if (b->seen.demand_age_ns != 0) {
            const int64_t t_ns = b->seen.t_ns - b->seen.demand_age_ns;

            assert_int_equal(given_at(given, i, t_ns),
                             counts_of(b->seen.pos_q32));
            judged++;
            if (jitter_ns == 0 && lose_every == 0)
                assert_int_equal(b->seen.demand_age_ns, 2 * MS);
        }
        given[i] = (struct given){ b->now_ns, counts };
        assert_int_equal(set_pos(b, pos_of(counts)), MOTION_OK);
        bench_end(b);
        if (held.len != 0) /* before the answer to the SYNC after */
            bench_insert(b, &held);
        held.len = 0;
        if (late_every != 0 && i % late_every == 0)
            held = bench_hold_tpdo(b);
        if (lose_every != 0 && i % lose_every == 0)
            b->now_ns += 1 * MS;
        if (jitter_ns != 0)
            b->now_ns += check_random_in(&seed, -jitter_ns, jitter_ns);
    }
    assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
    assert_true(judged > 480);
}

static void the_set_point_in_force_is_the_one_the_age_points_at(void **state)
{
    struct bench *b = *state;

    run_ramp(b, 0, 0, 0);
    bench_setup(state);
    run_ramp(b, 200000, 0, 0);
    bench_setup(state);
    run_ramp(b, 200000, 17, 0);
    bench_setup(state);
    run_ramp(b, 0, 0, 3);
}

static void a_late_answer_belongs_to_the_sync_before(void **state)
{
    struct bench *b = *state;
    struct hal_can_frame late;
    int64_t sync_ns = 0;

    enable(b);
    for (int i = 0; i < 10; i++) {
        sync_ns = b->now_ns;
        bench_begin(b);
        assert_int_equal(set_pos(b, pos_of(-123456 + i)), MOTION_OK);
        bench_end(b);
    }
    late = bench_hold_tpdo(b);
    b->mini.mute_tpdo = true;
    tick(b);
    bench_insert(b, &late);
    tick(b);
    assert_int_equal(b->seen.t_ns, sync_ns);
    assert_int_equal(b->seen.demand_age_ns, 2 * MS);
    assert_int_equal(counts_of(b->seen.pos_q32), -123456 + 9 - 2);
    assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
    /* the SYNC after it was the first of three without an answer */
    assert_int_equal(until(b, HAL_DRIVE_OFFLINE, 10), 2);
}

static void speed_is_the_way_of_one_period(void **state)
{
    struct bench *b = *state;

    enable(b);
    for (int i = 0; i < 20; i++) {
        set_pos(b, pos_of(-123456 + 25 * i));
        tick(b);
    }
    /* 25 counts/ms = 25 unit/s */
    assert_in_range(b->seen.vel_q32 - 25 * ONE + 2, 0, 4);
}

static void a_lost_tick_is_not_twice_the_speed(void **state)
{
    struct bench *b = *state;

    until(b, HAL_DRIVE_OFF, 200);
    b->mini.drift = 25;
    ticks(b, 5);
    for (int i = 0; i < 20; i++) {
        b->mini.drift = i == 10 ? 50 : 25;
        b->now_ns += i == 10 ? 1 * MS : 0;
        tick(b);
        assert_in_range(b->seen.vel_q32 - 25 * ONE + 2, 0, 4);
    }
}

static void the_actual_position_is_followed_across_the_wrap(void **state)
{
    struct drive_cia402_config config = drive_config;
    struct bench *b = *state;
    int64_t previous;

    config.counts_num = 1000000;
    bench_of(b, &config);
    b->mini.actual = INT32_MAX - 10000;
    until(b, HAL_DRIVE_OFF, 200);
    b->mini.drift = 1000;
    previous = b->seen.pos_q32;
    for (int i = 0; i < 40; i++) {
        tick(b);
        assert_true(b->seen.pos_q32 >= previous &&
                    b->seen.pos_q32 - previous <= ONE / 1000 + 1);
        previous = b->seen.pos_q32;
    }
    assert_true(b->drive.actual_counts > INT32_MAX);
    assert_in_range(b->seen.vel_q32 - ONE + 2, 0, 4);
}

static void a_drive_that_sends_sync_is_refused(void **state)
{
    static const uint32_t values[] = { 0x40000080, 0x00000080, 0xC0000080,
                                       0x80000080 };

    for (size_t i = 0; i < ARRAY_LEN(values); i++) {
        struct bench *b;

        bench_setup(state);
        b = *state;
        b->mini.object[b->mini.object_count++] = (struct mini_object){
            .index = 0x1005, .size = 4, .value = values[i]
        };
        until(b, i % 2 == 0 ? HAL_DRIVE_FAULT : HAL_DRIVE_OFF, 3000);
        if (i % 2 == 0)
            assert_text(b, "0080: the drive sends SYNC itself");
    }
}

static const struct counter_row {
    int32_t min, max;
    bool there, refused;
} counter_rows[] = {
    { -200000, 200000, true, false }, { -200000, 199999, true, true },
    { -199999, 200000, true, true },  { 0, 0, true, false },
    { 5, -5, true, false },           { INT32_MIN, INT32_MAX, true, false },
    { 0, 0, false, false },
};

static void counter_put(struct mini *mini, const struct counter_row *row)
{
    for (uint8_t sub = 1; row->there && sub <= 2; sub++)
        mini->object[mini->object_count++] = (struct mini_object){
            .index = 0x607B,
            .sub = sub,
            .size = 4,
            .value = (uint32_t)(sub == 1 ? row->min : row->max)
        };
}

static void counter_is_refused(struct bench *b)
{
    until(b, HAL_DRIVE_FAULT, 3000);
    assert_text(b, "0x607B:0");
    assert_text(b, "199999, within the axis's range");
}

static void counter_ends(struct bench *b, const struct counter_row *row)
{
    const int32_t min = row->min, max = row->max;
    const bool narrow = max > min && max != INT32_MAX;
    struct hal_drive_reach reach;

    until(b, HAL_DRIVE_OFF, 3000);
    assert_int_equal(
        hal_drive_reach(&b->drive.drive, (int64_t)max * ONE, &reach),
        MOTION_OK);
    assert_int_equal(reach.counts, max);
    assert_int_equal(reach.max_counts, narrow ? max : INT32_MAX);
    assert_int_equal(reach.min_counts, narrow ? min : INT32_MIN);
    if (narrow)
        assert_int_equal(
            hal_drive_reach(&b->drive.drive, (int64_t)(min - 1) * ONE, &reach),
            MOTION_E_RANGE);
    assert_int_equal(set_pos(b, (max + (int64_t)narrow) * ONE),
                     narrow ? MOTION_E_RANGE : MOTION_OK);
}

/* Its own position range, 0x607B, ends the counter; two that are none do not. */
static void the_counter_ends_where_607b_says(void **state)
{
    struct drive_cia402_config config = drive_config;
    struct bench *b = *state;

    config.counts_num = config.counts_den = 1;
    for (size_t i = 0; i < 2 * ARRAY_LEN(counter_rows); i++) {
        const struct counter_row *row = &counter_rows[i / 2];
        const bool ranged = i % 2 == 0;

        config.pos_min_q32 = ranged ? -200000 * ONE : 0;
        config.pos_max_q32 = ranged ? 200000 * ONE : 0;
        bench_of(b, &config);
        counter_put(&b->mini, row);
        if (row->refused && ranged)
            counter_is_refused(b);
        else
            counter_ends(b, row);
    }
}

static void a_target_beyond_i32_is_refused_and_not_sent(void **state)
{
    static const struct {
        int64_t pos_q32;
        int want;
    } rows[] = {
        { (int64_t)INT32_MAX << 32, MOTION_OK },
        { INT64_MIN, MOTION_OK },
        { ((int64_t)INT32_MAX << 32) + ONE / 2, MOTION_E_RANGE },
        { INT64_MAX, MOTION_E_RANGE },
    };
    struct drive_cia402_config config = drive_config;
    struct bench *b = *state;

    config.counts_num = 1; /* one count is one unit */
    bench_of(b, &config);
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        assert_int_equal(set_pos(b, rows[i].pos_q32), rows[i].want);
    config.counts_num = 3;
    bench_of(b, &config);
    enable(b);
    assert_int_equal(set_pos(b, (int64_t)-123456 * ONE / 3), MOTION_OK);
    assert_int_equal(set_pos(b, INT64_MAX / 3), MOTION_E_RANGE);
    ticks(b, 5);
    assert_int_equal(b->mini.actual, -123456);
    assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
    assert_int_equal(set_pos(b, INT64_MAX / 3 - ONE), MOTION_OK);
    tick(b);
    assert_int_equal(b->mini.pending, INT32_MAX - 2);
}

/* ---- stopping ---- */

static void quick_stop_is_out_in_the_same_cycle(void **state)
{
    struct bench *b = *state;

    enable(b);
    bench_begin(b);
    request(b, HAL_DRIVE_REQUEST_QUICK_STOP);
    bench_end(b);
    assert_int_equal(b->mini.controlword, 0x02);
    hal_drive_feedback(&b->drive.drive, &b->seen);
    assert_int_equal(b->seen.state, HAL_DRIVE_QUICK_STOP);
    until(b, HAL_DRIVE_OFF, 10);
    ticks(b, 100);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFF);
    request(b, HAL_DRIVE_REQUEST_ENABLE); /* by a new request, yes */
    until(b, HAL_DRIVE_ENABLED, 100);
}

/* 0x605A = 6: the drive holds until its power is taken away. */
static void a_quick_stop_that_holds_ends_by_off(void **state)
{
    struct bench *b = *state;

    b->mini.quick_stop_stays = true;
    enable(b);
    request(b, HAL_DRIVE_REQUEST_QUICK_STOP);
    ticks(b, 5000);
    assert_int_equal(b->seen.state, HAL_DRIVE_QUICK_STOP);
    request(b, HAL_DRIVE_REQUEST_OFF);
    until(b, HAL_DRIVE_OFF, 5);
    assert_int_equal(b->mini.controlword, 0x00);
}

/* Reset takes the power away only when the axis stands. */
/* 0x605A = 5 to 8. */
static void a_latched_drive_that_holds_is_switched_off(void **state)
{
    struct bench *b = *state;

    b->mini.quick_stop_stays = true;
    enable(b);
    assert_int_equal(set_pos(b, 0), MOTION_E_AWAY); /* latches */
    ticks(b, 10);
    assert_int_equal(b->seen.state, HAL_DRIVE_FAULT);
    assert_int_equal(b->mini.state, CIA402_SWITCH_ON_DISABLED);
}

static void a_reset_waits_for_a_quick_stop_to_end(void **state)
{
    static const int32_t drifts[] = { 50, -50 };

    for (unsigned i = 0; i < ARRAY_LEN(drifts); i++) {
        struct bench *b;

        bench_setup(state);
        b = *state;
        b->mini.quick_stop_stays = true;
        enable(b);
        assert_int_equal(set_pos(b, 0), MOTION_E_AWAY); /* latches */
        b->mini.drift = drifts[i];                      /* still ramping down */
        ticks(b, 10);
        assert_int_equal(b->mini.state, CIA402_QUICK_STOP_ACTIVE);
        request(b, HAL_DRIVE_REQUEST_RESET);
        ticks(b, 100);
        assert_int_equal(b->seen.state, HAL_DRIVE_FAULT);
        assert_int_equal(b->mini.state, CIA402_QUICK_STOP_ACTIVE);
        b->mini.drift = 0;
        until(b, HAL_DRIVE_OFF, 10 + HAL_STANDSTILL_NS / MS);
    }
}

static void after_enabling_again_no_old_set_point_is_in_force(void **state)
{
    struct bench *b = *state;

    enable(b);
    for (int i = 0; i < 10; i++) {
        bench_begin(b);
        set_pos(b, pos_of(-123456));
        bench_end(b);
    }
    assert_int_equal(b->seen.demand_age_ns, 2 * MS);
    request(b, HAL_DRIVE_REQUEST_QUICK_STOP);
    until(b, HAL_DRIVE_OFF, 10);
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_ENABLED, 100);
    ticks(b, 5);
    assert_int_equal(b->seen.demand_age_ns, 0);
}

static void off_goes_down_by_disable_and_shutdown(void **state)
{
    struct bench *b = *state;
    unsigned at;

    enable(b);
    at = b->mini.walked_count;
    request(b, HAL_DRIVE_REQUEST_OFF);
    until(b, HAL_DRIVE_OFF, 10);
    ticks(b, 20);
    assert_int_equal(b->mini.walked[at], 0x07);
    assert_int_equal(b->mini.walked[at + 1], 0x06);
    assert_int_equal(b->mini.state, CIA402_READY);
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_ENABLED, 100);
}

static void a_drive_that_will_not_stop_is_a_fault(void **state)
{
    struct bench *b = *state;

    enable(b);
    b->mini.ignores = true;
    request(b, HAL_DRIVE_REQUEST_QUICK_STOP);
    until(b, HAL_DRIVE_FAULT, 3100);
    assert_text(b, "stays in operation enabled for 3000 ms");
}

/* ---- faults ---- */

static void break_it(struct bench *b, const char *emcy)
{
    b->mini.state = CIA402_FAULT;
    if (emcy != NULL)
        fake_can_put(&b->fake, emcy);
}

static void a_drive_fault_latches_with_its_code(void **state)
{
    struct bench *b = *state;

    enable(b);
    break_it(b, "085#1023020000000000");
    assert_in_range(until(b, HAL_DRIVE_FAULT, 3), 1, 2);
    assert_int_equal(b->seen.fault_code, 0x2310);
    assert_text(b, "drive fault 0x2310: current, output side");
    b->mini.state = CIA402_SWITCH_ON_DISABLED; /* goes away by itself */
    fake_can_put(&b->fake, "085#0000000000000000");
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    ticks(b, 500);
    assert_int_equal(b->seen.state, HAL_DRIVE_FAULT);
    assert_int_equal(b->seen.fault_code, 0x2310);
    assert_int_equal(b->mini.state, CIA402_SWITCH_ON_DISABLED);
}

static void without_an_emergency_the_code_is_asked_for(void **state)
{
    struct bench *b = *state;

    enable(b);
    mini_at(&b->mini, 0x603F, 0)->value = 0x8611;
    break_it(b, NULL);
    until(b, HAL_DRIVE_FAULT, 3);
    ticks(b, 5);
    assert_int_equal(b->seen.fault_code, 0x8611);
    assert_text(b, "following error");
    assert_false(b->seen.fault_code_awaited);
    bench_setup(state); /* a drive that knows none */
    enable(b);
    break_it(b, NULL);
    until(b, HAL_DRIVE_FAULT, 3);
    ticks(b, 20);
    assert_true(b->seen.fault_code_awaited);
    assert_string_equal(b->seen.fault_text, "drive fault");
    ticks(b, 150);
    assert_int_equal(b->seen.fault_code, 0);
    assert_text(b, "it gives no code");
    assert_false(b->seen.fault_code_awaited);
}

static void a_code_that_comes_after_the_fault_is_taken(void **state)
{
    struct bench *b = *state;

    enable(b);
    break_it(b, NULL);
    until(b, HAL_DRIVE_FAULT, 3);
    ticks(b, 30);
    assert_int_equal(b->seen.fault_code, 0);
    mini_at(&b->mini, 0x603F, 0)->value = 0x7305;
    ticks(b, 60);
    assert_int_equal(b->seen.fault_code, 0x7305);
    bench_setup(state); /* by an emergency */
    enable(b);
    break_it(b, NULL);
    until(b, HAL_DRIVE_FAULT, 3);
    ticks(b, 10);
    fake_can_put(&b->fake, "085#0573010000000000");
    ticks(b, 2);
    assert_int_equal(b->seen.fault_code, 0x7305);
    assert_false(b->seen.fault_code_awaited);
}

static void an_emergency_of_long_ago_is_not_the_reason(void **state)
{
    struct bench *b = *state;

    enable(b);
    fake_can_put(&b->fake, "085#3081110000000000");
    ticks(b, 200);
    mini_at(&b->mini, 0x603F, 0)->value = 0x8611;
    break_it(b, NULL);
    until(b, HAL_DRIVE_FAULT, 3);
    ticks(b, 5);
    assert_int_equal(b->seen.fault_code, 0x8611);
}

static void reset_is_an_edge_and_leaves_the_axis_off(void **state)
{
    struct bench *b = *state;

    enable(b);
    for (int again = 0; again < 3; again++) { /* bit 7 left high would not */
        unsigned at;

        break_it(b, "085#1023020000000000");
        until(b, HAL_DRIVE_FAULT, 3);
        ticks(b, 10);
        at = b->mini.walked_count;
        request(b, HAL_DRIVE_REQUEST_RESET);
        until(b, HAL_DRIVE_OFF, 10);
        ticks(b, 50);
        assert_int_equal(b->mini.walked_count - at, 2);
        assert_int_equal(b->mini.walked[at], 0x80);
        assert_int_equal(b->mini.walked[at + 1], 0x00);
        assert_int_equal(b->seen.state, HAL_DRIVE_OFF);
        assert_int_equal(b->seen.fault_code, 0);
        assert_string_equal(b->seen.fault_text, "");
        request(b, HAL_DRIVE_REQUEST_ENABLE);
        until(b, HAL_DRIVE_ENABLED, 100);
    }
}

static void a_fault_that_stays_is_told(void **state)
{
    struct bench *b = *state;

    enable(b);
    b->mini.fault_sticks = true;
    break_it(b, "085#1031020000000000");
    until(b, HAL_DRIVE_FAULT, 3);
    request(b, HAL_DRIVE_REQUEST_RESET);
    ticks(b, 1100);
    assert_int_equal(b->seen.state, HAL_DRIVE_FAULT);
    assert_text(b, "not reset, still fault, code 0x3110");
    assert_int_equal(b->mini.controlword & 0x80, 0);
    b->mini.fault_sticks = false;
    request(b, HAL_DRIVE_REQUEST_RESET);
    until(b, HAL_DRIVE_OFF, 10);
}

/* In the cycle in which a reset gave up, bit 7 was still high on the wire. */
static void a_reset_at_once_after_a_failed_one_has_its_edge(void **state)
{
    struct bench *b = *state;

    enable(b);
    b->mini.fault_sticks = true;
    break_it(b, "085#1031020000000000");
    until(b, HAL_DRIVE_FAULT, 3);
    request(b, HAL_DRIVE_REQUEST_RESET);
    bench_begin(b);
    while (strstr(b->seen.fault_text, "not reset") == NULL) {
        bench_end(b);
        bench_begin(b);
    }
    assert_int_equal(b->mini.controlword, 0x80);
    b->mini.fault_sticks = false;
    request(b, HAL_DRIVE_REQUEST_RESET);
    bench_end(b);
    until(b, HAL_DRIVE_OFF, 10);
}

static void the_drive_tells_whether_it_follows(void **state)
{
    struct bench *b = *state;

    enable(b);
    assert_true(b->seen.following);
    b->mini.status_set = 0x0800; /* internal limit active */
    ticks(b, 2);
    assert_false(b->seen.following);
    b->mini.status_set = 0;
    b->mini.status_clear = 0x1000;
    ticks(b, 2);
    assert_false(b->seen.following);
    b->mini.status_clear = 0;
    ticks(b, 2);
    assert_true(b->seen.following);
}

static void a_drive_that_is_in_fault_at_start_up_tells_it(void **state)
{
    struct bench *b = *state;

    mini_at(&b->mini, 0x603F, 0)->value = 0x4310;
    b->mini.state = CIA402_FAULT;
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_FAULT, 200);
    assert_text(b, "drive fault 0x4310: temperature");
    request(b, HAL_DRIVE_REQUEST_RESET);
    until(b, HAL_DRIVE_OFF, 10);
    ticks(b, 50);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFF);
}

static void leaving_operation_unasked_latches(void **state)
{
    struct bench *b = *state;

    enable(b);
    b->mini.no_power = true; /* safe torque off */
    b->mini.state = CIA402_SWITCH_ON_DISABLED;
    b->mini.controlword = 0; /* which the drive now needs to see anew */
    until(b, HAL_DRIVE_FAULT, 3);
    assert_text(b, "left operation by itself: switch on disabled, no power");
    b->mini.no_power = false;
    ticks(b, 200);
    assert_int_equal(b->seen.state, HAL_DRIVE_FAULT);
    assert_int_equal(b->mini.state, CIA402_SWITCH_ON_DISABLED);
    request(b, HAL_DRIVE_REQUEST_RESET);
    until(b, HAL_DRIVE_OFF, 5);
}

/* ---- lost ---- */

static void an_unexpected_boot_up_is_lost_at_once(void **state)
{
    struct bench *b = *state;
    uint64_t rpdos;

    enable(b);
    mini_init(&b->mini);
    fake_can_put(&b->fake, "705#00");
    tick(b);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFFLINE);
    assert_text(b, "restarted by itself");
    rpdos = b->master.stats.rpdo_sent;
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    ticks(b, 300);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFFLINE);
    assert_int_equal(b->master.stats.rpdo_sent, rpdos); /* the map is gone */
    request(b, HAL_DRIVE_REQUEST_RESET);
    until(b, HAL_DRIVE_OFF, 200);
    assert_int_equal(mini_at(&b->mini, 0x6007, 0)->value, 3);
    ticks(b, 100);
    assert_int_equal(b->mini.state, CIA402_SWITCH_ON_DISABLED);
}

static void a_heartbeat_is_missed_for_exactly_three_periods(void **state)
{
    struct bench *b = *state;
    int64_t last_ns;

    enable(b);
    b->mini.mute_heartbeat = true;
    ticks(b, 2);
    last_ns = b->drive.node.heartbeat_ns;
    until(b, HAL_DRIVE_OFFLINE, 70);
    assert_int_equal(b->now_ns - 1 * MS - last_ns, 60 * MS);
    assert_text(b, "no heartbeat for three periods");
    tick(b);
    assert_int_equal(b->mini.controlword, 0x02); /* it may still hear us */
    b->mini.mute_heartbeat = false;
    ticks(b, 100);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFFLINE);
}

static void three_unanswered_syncs_are_a_fault(void **state)
{
    struct bench *b = *state;

    enable(b);
    b->mini.mute_tpdo = true;
    /* one answer is under way; then none to three SYNCs */
    assert_int_equal(until(b, HAL_DRIVE_OFFLINE, 10), 4);
    assert_text(b, "no position (TPDO1)");
    bench_setup(state);
    enable(b);
    for (int i = 0; i < 20; i++) { /* two in a row are not */
        b->mini.mute_tpdo = i % 3 != 0;
        tick(b);
        assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
    }
}

static void a_short_tpdo_is_no_answer(void **state)
{
    struct bench *b = *state;
    int64_t pos_q32;

    enable(b);
    pos_q32 = b->seen.pos_q32;
    b->mini.mute_tpdo = true;
    for (int i = 0; i < 5; i++) {
        fake_can_put(&b->fake, "185#3712102700");
        tick(b);
    }
    assert_int_equal(b->seen.state, HAL_DRIVE_OFFLINE);
    assert_int_equal(b->seen.pos_q32, pos_q32);
    assert_int_equal(b->master.stats.malformed, 5);
}

static void leaving_nmt_operational_is_lost(void **state)
{
    struct bench *b = *state;

    enable(b);
    fake_can_put(&b->fake, "705#7F");
    tick(b);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFFLINE);
    assert_text(b, "left NMT operational, state 0x7F");
}

/* ---- switches ---- */

static void switches_are_read_and_heard_and_turned_with_the_axis(void **state)
{
    struct drive_cia402_config config = drive_config;
    struct bench *b = *state;

    mini_at(&b->mini, 0x60FD, 0)->value = 1;
    until(b, HAL_DRIVE_OFF, 200);
    assert_true(b->seen.limit_negative && !b->seen.limit_positive);
    fake_can_put(&b->fake, "285#02000000");
    tick(b);
    assert_true(!b->seen.limit_negative && b->seen.limit_positive);
    fake_can_put(&b->fake, "285#010000"); /* short */
    tick(b);
    assert_true(!b->seen.limit_negative && b->seen.limit_positive);
    config.counts_num = -1000;
    bench_of(b, &config);
    mini_at(&b->mini, 0x60FD, 0)->value = 1;
    until(b, HAL_DRIVE_OFF, 200);
    assert_true(!b->seen.limit_negative && b->seen.limit_positive);
    assert_true(b->seen.pos_q32 > 0); /* -123456 counts */
    b->mini.drift = 25;
    ticks(b, 5);
    assert_in_range(b->seen.vel_q32 + 25 * ONE + 2, 0, 4);
    b->mini.drift = 0;
    enable(b);
    assert_int_equal(set_pos(b, b->seen.pos_q32 + ONE / 2), MOTION_OK);
}

/* ---- configuration ---- */

__extension__ typedef __int128 int128;

/* 2 |got - num / den| - 1, in units of the last place: above 0 is not nearest.
 */
static long double not_nearest(int64_t got, int128 num, int128 den)
{
    int128 off = (int128)got * den - num;

    off = off < 0 ? -off : off;
    den = den < 0 ? -den : den;
    return (long double)(2 * off - den) / (long double)den;
}

static bool is_beyond(int128 num, int128 den)
{
    return num / den > INT64_MAX - 2 || num / den < INT64_MIN + 2;
}

/* counts to position and back; a mantissa of 62 bits and more is good for all
 * 64 bits of a position but the last two at the ends of the range. */
static void judge_scale(const struct drive_cia402 *drive, uint64_t *seed)
{
    const int64_t counts = check_random_in(seed, INT32_MIN, INT32_MAX);
    const int128 num = (int128)counts * drive->config.counts_den * ONE;
    const int128 den = drive->config.counts_num;
    int64_t pos_q32, back;

    if (is_beyond(num, den))
        return;
    assert_int_equal(motion_fixed_mulshift(counts, drive->to_pos.mantissa,
                                           drive->to_pos.shift, &pos_q32),
                     MOTION_OK);
    assert_true(not_nearest(pos_q32, num, den) <=
                ldexpl(fabsl((long double)pos_q32), -60));
    assert_int_equal(motion_fixed_mulshift(pos_q32, drive->to_counts.mantissa,
                                           drive->to_counts.shift, &back),
                     MOTION_OK);
    assert_true(not_nearest(back, (int128)pos_q32 * den,
                            (int128)drive->config.counts_den * ONE) < 1e-9L);
}

static void scales_round_to_the_nearest_count(void **state)
{
    uint64_t seed = UINT64_C(0xC0FFEE);
    struct bench *b = *state;
    unsigned judged = 0;

    print_message("seed 0x%" PRIX64 "\n", seed);
    for (int i = 0; i < 5000; i++) {
        struct drive_cia402_config config = drive_config;
        const int bits = (int)check_random_in(&seed, 1, 26);

        config.counts_num = check_random_in(&seed, 1, INT64_C(1) << bits);
        config.counts_den = check_random_in(&seed, 1, INT64_C(1) << bits);
        if (i % 2 != 0)
            config.counts_num = -config.counts_num;
        canopen_init(&b->master, &b->fake.can, &master_config);
        if (drive_cia402_init(&b->drive, &b->master, &config) != MOTION_OK)
            continue;
        judge_scale(&b->drive, &seed);
        judged++;
    }
    assert_true(judged > 4000);
}

static const struct {
    int64_t num, den, period_ns;
    int want;
} scales[] = {
    { 1, 1, 1 * MS, MOTION_OK },
    { -1, 1, 1 * MS, MOTION_OK },
    { INT64_C(1) << 32, 1, 1 * MS, MOTION_OK },
    { (INT64_C(1) << 32) + 1, 1, 1 * MS, MOTION_E_RANGE },
    { INT64_MAX, 1, 1 * MS, MOTION_E_RANGE },
    { INT64_MAX, INT64_MAX, 1 * MS, MOTION_OK },
    { INT64_MAX, INT64_MAX - 1, 1 * MS, MOTION_OK },
    { 1, INT64_MAX, 1 * MS, MOTION_E_RANGE },
    { 1, INT64_C(1) << 30, 1000 * MS, MOTION_E_ARG }, /* not the master's */
    { 1, INT64_C(1) << 16, 1 * MS, MOTION_OK },       /* 2^26 unit/s */
    { 1, INT64_C(1) << 22, 1 * MS, MOTION_E_RANGE },  /* 2^32 unit/s */
    { 0, 1, 1 * MS, MOTION_E_ARG },
    { 1, 0, 1 * MS, MOTION_E_ARG },
    { 1, -1, 1 * MS, MOTION_E_ARG },
    { INT64_MIN, 1, 1 * MS, MOTION_E_ARG },
};

static void scales_that_do_not_fit_are_refused(void **state)
{
    struct bench *b = *state;

    for (size_t i = 0; i < ARRAY_LEN(scales); i++) {
        struct drive_cia402_config config = drive_config;
        int got;

        config.counts_num = scales[i].num;
        config.counts_den = scales[i].den;
        config.sync_period_ns = scales[i].period_ns;
        canopen_init(&b->master, &b->fake.can, &master_config);
        got = drive_cia402_init(&b->drive, &b->master, &config);
        if (got != scales[i].want)
            fail_msg("row %zu: %d", i, got);
        assert_int_equal(b->master.first != NULL, got == MOTION_OK);
    }
}

static const struct {
    int64_t period_ns;
    int want;
    uint8_t count;
    int8_t exponent;
} periods[] = {
    { 1 * MS, MOTION_OK, 1, -3 },       { 2 * MS, MOTION_OK, 2, -3 },
    { 500000, MOTION_OK, 5, -4 },       { 250000, MOTION_OK, 25, -5 },
    { 125000, MOTION_OK, 125, -6 },     { 10 * MS, MOTION_OK, 10, -3 },
    { 100 * MS, MOTION_OK, 100, -3 },   { 4 * MS, MOTION_OK, 4, -3 },
    { 1 * MS + 1, MOTION_E_ARG, 0, 0 }, { 333000, MOTION_E_ARG, 0, 0 },
    { 0, MOTION_E_ARG, 0, 0 },
};

static void sync_periods_are_what_0x60c2_can_say(void **state)
{
    struct bench *b = *state;

    for (size_t i = 0; i < ARRAY_LEN(periods); i++) {
        struct drive_cia402_config config = drive_config;
        struct canopen_config bus = master_config;

        bus.sync_period_ns = config.sync_period_ns = periods[i].period_ns;
        canopen_init(&b->master, &b->fake.can, &bus);
        assert_int_equal(drive_cia402_init(&b->drive, &b->master, &config),
                         periods[i].want);
        if (periods[i].want != MOTION_OK)
            continue;
        assert_int_equal(b->drive.interpolation_count, periods[i].count);
        assert_int_equal(b->drive.interpolation_exponent, periods[i].exponent);
    }
}

static void times_that_protect_nothing_are_refused(void **state)
{
    static const struct {
        int64_t master_beat_ns, beat_ns, watchdog_ns, timeout_ns;
        int want;
    } rows[] = {
        { 20 * MS, 20 * MS, 50 * MS, 0, MOTION_OK },
        { 20 * MS, 0, 0, 0, MOTION_OK },
        { 0, 20 * MS, 50 * MS, 0, MOTION_E_ARG }, /* no heartbeat of ours */
        { 20 * MS, 20 * MS, 39 * MS, 0, MOTION_E_ARG }, /* too close */
        { 20 * MS, 20 * MS, 101 * MS, 0, MOTION_E_ARG },
        { 20 * MS, 20 * MS, -50 * MS, 0, MOTION_E_ARG },
        { 20 * MS, 20 * MS, 50 * MS + 1, 0, MOTION_E_ARG },
        { 20 * MS, 500000, 50 * MS, 0, MOTION_E_ARG },
        { 20 * MS, 20001 * MS, 50 * MS, 0, MOTION_E_ARG },
        { 20 * MS, 20 * MS, 50 * MS, -1, MOTION_E_ARG },
    };
    struct bench *b = *state;

    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct drive_cia402_config config = drive_config;
        struct canopen_config bus = master_config;

        bus.heartbeat_period_ns = rows[i].master_beat_ns;
        config.heartbeat_period_ns = rows[i].beat_ns;
        config.watchdog_ns = rows[i].watchdog_ns;
        config.state_timeout_ns = rows[i].timeout_ns;
        canopen_init(&b->master, &b->fake.can, &bus);
        if (drive_cia402_init(&b->drive, &b->master, &config) != rows[i].want)
            fail_msg("row %zu", i);
    }
    assert_string_equal(hal_drive_state_text(HAL_DRIVE_QUICK_STOP),
                        "quick stop");
    assert_string_equal(hal_drive_state_text((enum hal_drive_state)99),
                        "unknown");
}

#define BENCH(test) cmocka_unit_test_setup(test, bench_setup)

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(statuswords_are_decoded),
        cmocka_unit_test(bits_of_no_state_do_not_change_it),
        BENCH(start_up_ends_off_with_everything_written),
        BENCH(a_pdo_is_mapped_in_the_order_every_drive_accepts),
        BENCH(a_drive_without_optional_objects_will_do),
        BENCH(a_fixed_interpolation_period_must_be_ours),
        BENCH(switches_that_cannot_be_mapped_are_left_off),
        BENCH(a_cob_id_may_read_back_with_the_no_rtr_bit),
        BENCH(a_drive_that_refuses_its_configuration_gets_no_torque),
        BENCH(a_target_that_does_not_stay_is_told_before_enabling),
        BENCH(a_drive_that_ignores_nmt_is_told),
        BENCH(two_lost_answers_in_a_row_are_made_good_again),
        BENCH(a_mode_that_is_not_taken_is_waited_for_and_told),
        BENCH(a_silent_drive_is_asked_until_it_answers),
        BENCH(a_drive_that_falls_silent_in_start_up_is_offline),
        BENCH(a_boot_up_in_start_up_begins_it_anew),
        BENCH(no_tpdo_and_no_heartbeat_have_their_own_words),
        BENCH(a_drive_found_enabled_is_stopped_first),
        BENCH(enabling_goes_one_state_at_a_time),
        BENCH(an_enabled_axis_does_not_jump),
        BENCH(set_points_before_enabling_do_not_reach_the_drive),
        BENCH(an_axis_that_is_pushed_is_enabled_where_it_stands),
        BENCH(a_brake_may_take_its_time),
        BENCH(the_target_is_preloaded_again_after_a_fall),
        BENCH(the_target_is_preloaded_again_after_a_change_of_mind),
        BENCH(a_fault_while_preloading_still_gets_its_code),
        BENCH(an_axis_that_moves_too_fast_is_not_enabled),
        BENCH(the_first_set_point_must_be_where_the_axis_is),
        BENCH(the_first_step_is_at_least_one_count),
        BENCH(a_drive_that_does_not_get_on_says_why),
        BENCH(the_set_point_in_force_is_the_one_the_age_points_at),
        BENCH(a_late_answer_belongs_to_the_sync_before),
        BENCH(speed_is_the_way_of_one_period),
        BENCH(a_lost_tick_is_not_twice_the_speed),
        BENCH(the_actual_position_is_followed_across_the_wrap),
        BENCH(a_drive_that_sends_sync_is_refused),
        BENCH(the_counter_ends_where_607b_says),
        BENCH(a_target_beyond_i32_is_refused_and_not_sent),
        BENCH(quick_stop_is_out_in_the_same_cycle),
        BENCH(a_quick_stop_that_holds_ends_by_off),
        BENCH(a_latched_drive_that_holds_is_switched_off),
        BENCH(a_reset_waits_for_a_quick_stop_to_end),
        BENCH(after_enabling_again_no_old_set_point_is_in_force),
        BENCH(off_goes_down_by_disable_and_shutdown),
        BENCH(a_drive_that_will_not_stop_is_a_fault),
        BENCH(a_drive_fault_latches_with_its_code),
        BENCH(without_an_emergency_the_code_is_asked_for),
        BENCH(a_code_that_comes_after_the_fault_is_taken),
        BENCH(an_emergency_of_long_ago_is_not_the_reason),
        BENCH(reset_is_an_edge_and_leaves_the_axis_off),
        BENCH(a_fault_that_stays_is_told),
        BENCH(a_reset_at_once_after_a_failed_one_has_its_edge),
        BENCH(the_drive_tells_whether_it_follows),
        BENCH(a_drive_that_is_in_fault_at_start_up_tells_it),
        BENCH(leaving_operation_unasked_latches),
        BENCH(an_unexpected_boot_up_is_lost_at_once),
        BENCH(a_heartbeat_is_missed_for_exactly_three_periods),
        BENCH(three_unanswered_syncs_are_a_fault),
        BENCH(a_short_tpdo_is_no_answer),
        BENCH(leaving_nmt_operational_is_lost),
        BENCH(switches_are_read_and_heard_and_turned_with_the_axis),
        BENCH(scales_round_to_the_nearest_count),
        BENCH(scales_that_do_not_fit_are_refused),
        BENCH(sync_periods_are_what_0x60c2_can_say),
        BENCH(times_that_protect_nothing_are_refused),
    };

    return cmocka_run_group_tests_name("drive_cia402", tests, NULL, NULL);
}

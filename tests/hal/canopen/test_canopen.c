/* tests/hal/canopen/test_canopen.c - the CANopen master against a scripted
 * port. */
#include "tests/support/fake_can.h"

#include <inttypes.h>

#include "hal/canopen/canopen.h"
#include "hal/support/text.h"

#define MS INT64_C(1000000)

struct watcher { /* a node that writes down what it is told */
    struct canopen_node node;
    unsigned steps, tpdos, emcys, boot_ups, lost;
    unsigned tpdo_number;
    struct hal_can_frame tpdo;
    uint16_t emcy_code;
    uint8_t emcy_register, emcy_maker[5];
    unsigned rpdo_number; /* which to send, 0: none */
    uint8_t rpdo[8];
    unsigned rpdo_len;
};

static struct watcher *watcher_of(struct canopen_node *node)
{
    return CONTAINER_OF(node, struct watcher, node);
}

static void watcher_step(struct canopen_node *node, int64_t now_ns)
{
    (void)now_ns;
    watcher_of(node)->steps++;
}

static bool watcher_tpdo(struct canopen_node *node, unsigned number,
                         const struct hal_can_frame *frame)
{
    struct watcher *self = watcher_of(node);

    if (frame->len < 6)
        return false;
    self->tpdos++;
    self->tpdo_number = number;
    self->tpdo = *frame;
    return true;
}

static void watcher_emcy(struct canopen_node *node, uint16_t code, uint8_t reg,
                         const uint8_t maker[5])
{
    struct watcher *self = watcher_of(node);

    self->emcys++;
    self->emcy_code = code;
    self->emcy_register = reg;
    memcpy(self->emcy_maker, maker, 5);
}

static void watcher_boot_up(struct canopen_node *node, int64_t now_ns)
{
    (void)now_ns;
    watcher_of(node)->boot_ups++;
}

static void watcher_lost(struct canopen_node *node, int64_t now_ns)
{
    (void)now_ns;
    watcher_of(node)->lost++;
}

static unsigned watcher_rpdo(struct canopen_node *node, unsigned number,
                             uint8_t data[8])
{
    struct watcher *self = watcher_of(node);

    if (number != self->rpdo_number)
        return 0;
    memcpy(data, self->rpdo, 8);
    return self->rpdo_len;
}

static const struct canopen_node_ops watcher_ops = {
    .step = watcher_step,
    .tpdo = watcher_tpdo,
    .emcy = watcher_emcy,
    .boot_up = watcher_boot_up,
    .heartbeat_lost = watcher_lost,
    .rpdo = watcher_rpdo,
};

struct bench {
    struct fake_can fake;
    struct canopen master;
    struct watcher node;
};

static int bench_setup(void **state)
{
    static struct bench bench;
    const struct canopen_config config = { .node_id = 127 };

    memset(&bench, 0, sizeof bench);
    fake_can_init(&bench.fake);
    assert_int_equal(canopen_init(&bench.master, &bench.fake.can, &config), 0);
    bench.node.node.ops = &watcher_ops;
    bench.node.node.id = 1;
    assert_int_equal(canopen_add(&bench.master, &bench.node.node), 0);
    *state = &bench;
    return 0;
}

static enum hal_fieldbus_health begin(struct bench *b, int64_t now_ns)
{
    return hal_fieldbus_begin(&b->master.fieldbus, now_ns);
}

static void end(struct bench *b, int64_t now_ns)
{
    hal_fieldbus_end(&b->master.fieldbus, now_ns);
}

/* ---- SDO ---- */

static const struct {
    const char *request, *answer;
    bool write;
    uint16_t index;
    uint8_t sub, size;
    uint32_t value;
    int outcome;
} transfers[] = {
    /* shared byte vectors, checked against other people's clients */
    { "601#2F60600008000000", "581#6060600000000000", true, 0x6060, 0, 1, 8,
      MOTION_OK },
    { "601#2B40600006000000", "581#6040600000000000", true, 0x6040, 0, 2, 6,
      MOTION_OK },
    { "601#4041600000000000", "581#4B41600037120000", false, 0x6041, 0, 2,
      0x1237, MOTION_OK },
    { "601#237A600010270000", "581#607A600000000000", true, 0x607A, 0, 4, 10000,
      MOTION_OK },
    { "601#4041600500000000", "581#8041600511000906", false, 0x6041, 5, 0,
      0x06090011, MOTION_E_REFUSED },
    { "601#2300180181010080", "581#6000180100000000", true, 0x1800, 1, 4,
      0x80000181, MOTION_OK },
    { "601#4022220000000000", "581#8022220000000206", false, 0x2222, 0, 0,
      0x06020000, MOTION_E_REFUSED },
    /* every size of answer; bytes beyond it do not count */
    { "601#4061600000000000", "581#4F616000F8A5A5A5", false, 0x6061, 0, 1, 0xF8,
      MOTION_OK },
    { "601#4000200000000000", "581#47002000010203A5", false, 0x2000, 0, 3,
      0x030201, MOTION_OK },
    { "601#4064600000000000", "581#43646000FFFFFFFF", false, 0x6064, 0, 4,
      0xFFFFFFFF, MOTION_OK },
    { "601#4064600000000000", "581#4264600001000080", false, 0x6064, 0, 4,
      0x80000001, MOTION_OK },
    { "601#2700200001020300", "581#6000200000000000", true, 0x2000, 0, 3,
      0x030201, MOTION_OK },
    { "601#2B40600006000000", "581#8040600022000008", true, 0x6040, 0, 2, 6,
      MOTION_E_REFUSED },
};

static void sdo_transfers_are_the_known_bytes(void **state)
{
    struct bench *b = *state;

    for (size_t i = 0; i < ARRAY_LEN(transfers); i++) {
        struct canopen_node *node = &b->node.node;
        uint32_t value = 0;
        uint8_t size = 0;
        int err = transfers[i].write
                      ? canopen_sdo_write(node, 0, transfers[i].index,
                                          transfers[i].sub, transfers[i].size,
                                          transfers[i].value)
                      : canopen_sdo_read(node, 0, transfers[i].index,
                                         transfers[i].sub);

        assert_int_equal(err, MOTION_OK);
        fake_can_expect(&b->fake, transfers[i].request);
        assert_int_equal(canopen_sdo_take(node, NULL, NULL), MOTION_E_AGAIN);
        assert_int_equal(canopen_sdo_read(node, 0, 0x1000, 0), MOTION_E_STATE);
        fake_can_put(&b->fake, transfers[i].answer);
        assert_int_equal(begin(b, 1 * MS), HAL_FIELDBUS_GOOD);
        err = canopen_sdo_take(node, &value, &size);
        assert_int_equal(err, transfers[i].outcome);
        if (err == MOTION_E_REFUSED && !transfers[i].write)
            assert_int_equal(node->sdo.abort_code, transfers[i].value);
        if (err == MOTION_OK && !transfers[i].write) {
            assert_int_equal(value, transfers[i].value);
            assert_int_equal(size, transfers[i].size);
        }
        assert_int_equal(canopen_sdo_take(node, NULL, NULL), MOTION_E_STATE);
        fake_can_expect(&b->fake, NULL);
    }
}

static void a_late_sdo_answer_for_something_else_is_dropped(void **state)
{
    struct bench *b = *state;
    uint32_t value = 0;

    assert_int_equal(canopen_sdo_read(&b->node.node, 0, 0x6041, 0), 0);
    fake_can_put(&b->fake, "581#4B40600037120000"); /* another index */
    fake_can_put(&b->fake, "581#4B41600137120000"); /* another sub-index */
    fake_can_put(&b->fake, "581#8040600000000206"); /* an abort of another */
    fake_can_put(&b->fake, "581#4B416000371200");   /* 7 bytes */
    begin(b, 1 * MS);
    assert_int_equal(canopen_sdo_take(&b->node.node, &value, NULL),
                     MOTION_E_AGAIN);
    assert_int_equal(b->master.stats.unexpected, 3);
    assert_int_equal(b->master.stats.malformed, 1);
    fake_can_put(&b->fake, "581#4B41600034120000");
    begin(b, 2 * MS);
    assert_int_equal(canopen_sdo_take(&b->node.node, &value, NULL), MOTION_OK);
    assert_int_equal(value, 0x1234);
    fake_can_put(&b->fake, "581#4B41600037120000"); /* nobody waits */
    begin(b, 3 * MS);
    assert_int_equal(canopen_sdo_take(&b->node.node, &value, NULL),
                     MOTION_E_STATE);
    assert_int_equal(b->master.stats.unexpected, 4);
}

static void an_sdo_that_times_out_is_aborted_on_the_wire(void **state)
{
    struct bench *b = *state;

    assert_int_equal(canopen_sdo_read(&b->node.node, 5 * MS, 0x6041, 0), 0);
    fake_can_expect(&b->fake, "601#4041600000000000");
    begin(b, 205 * MS - 1);
    assert_int_equal(canopen_sdo_take(&b->node.node, NULL, NULL),
                     MOTION_E_AGAIN);
    fake_can_expect(&b->fake, NULL);
    begin(b, 205 * MS);
    fake_can_expect(&b->fake, "601#8041600000000405");
    assert_int_equal(canopen_sdo_take(&b->node.node, NULL, NULL),
                     MOTION_E_TIMEOUT);
    assert_int_equal(b->master.stats.sdo_timeouts, 1);
    fake_can_put(&b->fake, "581#4B41600037120000"); /* too late */
    begin(b, 206 * MS);
    assert_int_equal(b->master.stats.unexpected, 1);
}

static void an_sdo_answer_of_the_wrong_kind_is_given_up(void **state)
{
    static const struct {
        bool write;
        const char *answer;
    } rows[] = {
        { false, "581#6008100000000000" }, /* as if it had been a write */
        { true, "581#4308100000000000" },  /* as if it had been a read */
        { true, "581#A008100000000000" },  /* block transfer */
    };
    struct bench *b = *state;

    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        if (rows[i].write)
            canopen_sdo_write(&b->node.node, 0, 0x1008, 0, 4, 1);
        else
            canopen_sdo_read(&b->node.node, 0, 0x1008, 0);
        b->fake.out_at = b->fake.out_count;
        fake_can_put(&b->fake, rows[i].answer);
        begin(b, 1 * MS);
        fake_can_expect(&b->fake, "601#8008100001000405");
        assert_int_equal(canopen_sdo_take(&b->node.node, NULL, NULL),
                         MOTION_E_REFUSED);
        assert_int_equal(b->node.node.sdo.abort_code, CANOPEN_ABORT_COMMAND);
    }
}

/* The first is given up, its answer comes while the second waits, and then that of
 * the second. */
static void an_answer_to_an_earlier_transfer_is_dropped(void **state)
{
    static const struct {
        bool was_write, write;
        const char *late, *answer;
    } rows[] = {
        { false, true, "581#4B41600037120000", "581#6041600000000000" },
        { true, false, "581#6041600000000000", "581#4B41600034120000" },
        { false, true, "581#8041600011000906", "581#6041600000000000" },
        { false, false, "581#8041600011000906", "581#4B41600034120000" },
        { true, true, "581#8041600002000106", "581#6041600000000000" },
        { false, true, "581#4141600002000000", "581#6041600000000000" },
    };
    struct bench *b = *state;
    struct canopen_node *node = &b->node.node;

    for (size_t i = 0; i < 2 * ARRAY_LEN(rows); i++) {
        const size_t row = i / 2;
        int64_t now_ns = (int64_t)i * 1000 * MS;
        uint32_t value = 0;

        if (rows[row].was_write)
            canopen_sdo_write(node, now_ns, 0x6041, 0, 2, 1);
        else
            canopen_sdo_read(node, now_ns, 0x6041, 0);
        if (i % 2 == 0) {
            begin(b, now_ns += 200 * MS);
            assert_int_equal(canopen_sdo_take(node, NULL, NULL),
                             MOTION_E_TIMEOUT);
        } else {
            canopen_sdo_drop(node);
        }
        now_ns += 10 * MS;
        if (rows[row].write)
            assert_int_equal(canopen_sdo_write(node, now_ns, 0x6041, 0, 2, 1),
                             0);
        else
            assert_int_equal(canopen_sdo_read(node, now_ns, 0x6041, 0), 0);
        fake_can_put(&b->fake, rows[row].late);
        begin(b, now_ns + 1 * MS);
        assert_int_equal(canopen_sdo_take(node, NULL, NULL), MOTION_E_AGAIN);
        fake_can_put(&b->fake, rows[row].answer);
        begin(b, now_ns + 2 * MS);
        assert_int_equal(canopen_sdo_take(node, &value, NULL), MOTION_OK);
        assert_int_equal(value, rows[row].write ? 0 : 0x1234);
        fake_can_wipe(&b->fake);
    }
}

/* Expect that nothing is late any more. */
static void an_abort_counts_at_once(struct bench *b, int64_t now_ns)
{
    struct canopen_node *node = &b->node.node;

    assert_int_equal(canopen_sdo_read(node, now_ns, 0x6041, 0), 0);
    fake_can_put(&b->fake, "581#8041600011000906");
    begin(b, now_ns + MS);
    assert_int_equal(canopen_sdo_take(node, NULL, NULL), MOTION_E_REFUSED);
}

/* It may have been the answer to the second after all. */
static void an_abort_that_nothing_follows_is_the_outcome(void **state)
{
    struct bench *b = *state;
    struct canopen_node *node = &b->node.node;

    assert_int_equal(canopen_sdo_read(node, 0, 0x6041, 0), 0);
    begin(b, 200 * MS);
    assert_int_equal(canopen_sdo_take(node, NULL, NULL), MOTION_E_TIMEOUT);
    assert_int_equal(canopen_sdo_read(node, 210 * MS, 0x6041, 0), 0);
    fake_can_put(&b->fake, "581#8041600011000906");
    begin(b, 211 * MS);
    assert_int_equal(canopen_sdo_take(node, NULL, NULL), MOTION_E_AGAIN);
    begin(b, 410 * MS);
    assert_int_equal(canopen_sdo_take(node, NULL, NULL), MOTION_E_REFUSED);
    assert_int_equal(node->sdo.abort_code, CANOPEN_ABORT_NO_SUB);
    an_abort_counts_at_once(b, 420 * MS);
}

static void
an_answer_for_another_object_ends_the_wait_for_late_ones(void **state)
{
    struct bench *b = *state;
    struct canopen_node *node = &b->node.node;

    assert_int_equal(canopen_sdo_read(node, 0, 0x6041, 0), 0);
    canopen_sdo_drop(node);
    assert_int_equal(canopen_sdo_read(node, 10 * MS, 0x6064, 0), 0);
    fake_can_put(&b->fake, "581#4364600000000000");
    begin(b, 11 * MS);
    assert_int_equal(canopen_sdo_take(node, NULL, NULL), MOTION_OK);
    an_abort_counts_at_once(b, 20 * MS);
}

/* Each size, told or not; five bytes are no number. */
static void a_number_may_come_by_segments(void **state)
{
    static const struct {
        const char *answer, *segment;
        uint8_t size;
        uint32_t value, abort_code;
    } rows[] = {
        { "581#4101100001000000", "581#0DA5EEEEEEEEEEEE", 1, 0xA5, 0 },
        { "581#4101100002000000", "581#0B3412EEEEEEEEEE", 2, 0x1234, 0 },
        { "581#4101100003000000", "581#09030201EEEEEEEE", 3, 0x10203, 0 },
        { "581#4101100004000000", "581#0704030201EEEEEE", 4, 0x1020304, 0 },
        { "581#4001100000000000", "581#0DFFEEEEEEEEEEEE", 1, 0xFF, 0 },
        { "581#4001100000000000", "581#0704030201EEEEEE", 4, 0x1020304, 0 },
        { "581#4101100005000000", NULL, 0, 0, CANOPEN_ABORT_LENGTH },
        { "581#4101100002000000", "581#0D34EEEEEEEEEEEE", 0, 0,
          CANOPEN_ABORT_LENGTH },
        { "581#4001100000000000", "581#0501020304050000", 0, 0,
          CANOPEN_ABORT_LENGTH },
        { "581#4001100000000000", "581#0001020304050607", 0, 0,
          CANOPEN_ABORT_LENGTH },
    };
    struct bench *b = *state;
    struct canopen_node *node = &b->node.node;

    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const int64_t now_ns = (int64_t)i * 100 * MS;
        uint32_t value = 0;
        uint8_t size = 0;

        assert_int_equal(canopen_sdo_read(node, now_ns, 0x1001, 0), 0);
        fake_can_put(&b->fake, rows[i].answer);
        begin(b, now_ns + 1 * MS);
        if (rows[i].segment != NULL) {
            fake_can_expect(&b->fake, "601#4001100000000000");
            fake_can_expect(&b->fake, "601#6000000000000000");
            fake_can_put(&b->fake, rows[i].segment);
            begin(b, now_ns + 2 * MS);
        }
        if (rows[i].abort_code != 0) {
            assert_int_equal(canopen_sdo_take(node, NULL, NULL),
                             MOTION_E_REFUSED);
            assert_int_equal(node->sdo.abort_code, rows[i].abort_code);
        } else {
            assert_int_equal(canopen_sdo_take(node, &value, &size), MOTION_OK);
            assert_int_equal(value, rows[i].value);
            assert_int_equal(size, rows[i].size);
        }
        fake_can_wipe(&b->fake);
    }
}

static void an_sdo_that_cannot_be_sent_is_not_started(void **state)
{
    struct bench *b = *state;

    b->fake.refuse = 1;
    assert_int_equal(canopen_sdo_read(&b->node.node, 0, 0x1000, 0),
                     MOTION_E_FULL);
    assert_int_equal(canopen_sdo_take(&b->node.node, NULL, NULL),
                     MOTION_E_STATE);
    assert_int_equal(canopen_sdo_read(&b->node.node, 0, 0x1000, 0), MOTION_OK);
    canopen_sdo_drop(&b->node.node);
    assert_int_equal(canopen_sdo_write(&b->node.node, 0, 0x1000, 0, 0, 0),
                     MOTION_E_ARG);
    assert_int_equal(canopen_sdo_write(&b->node.node, 0, 0x1000, 0, 5, 0),
                     MOTION_E_ARG);
}

static void sdo_requests_leave_room_between_them(void **state)
{
    static const struct {
        int64_t sync_ns, gap_ns, want_ns;
    } rows[] = {
        { 0, 0, 0 },
        { MS / 2, 0, MS },
        { 1 * MS, 0, 2 * MS },
        { 10 * MS, 0, 2 * MS },
        { 1 * MS, 5 * MS, 5 * MS },
    };

    for (unsigned i = 0; i < ARRAY_LEN(rows); i++) {
        const struct canopen_config config = {
            .node_id = 127,
            .sync_period_ns = rows[i].sync_ns,
            .sdo_gap_ns = rows[i].gap_ns,
        };
        struct watcher other = { .node = { .ops = &watcher_ops, .id = 2 } };
        struct bench *b;

        bench_setup(state);
        b = *state;
        canopen_init(&b->master, &b->fake.can, &config);
        canopen_add(&b->master, &b->node.node);
        canopen_add(&b->master, &other.node);
        assert_int_equal(canopen_sdo_read(&b->node.node, 7 * MS, 0x1000, 0),
                         MOTION_OK);
        if (rows[i].want_ns > 0)
            assert_int_equal(canopen_sdo_read(&other.node,
                                              7 * MS + rows[i].want_ns - 1,
                                              0x1000, 0),
                             MOTION_E_AGAIN);
        assert_int_equal(
            canopen_sdo_read(&other.node, 7 * MS + rows[i].want_ns, 0x1000, 0),
            MOTION_OK);
    }
}

/* ---- NMT, heartbeat, EMCY, PDO, SYNC ---- */

static void nmt_commands_are_the_known_bytes(void **state)
{
    struct bench *b = *state;

    assert_int_equal(canopen_nmt(&b->master, CANOPEN_NMT_START, 1), 0);
    fake_can_expect(&b->fake, "000#0101");
    assert_int_equal(canopen_nmt(&b->master, CANOPEN_NMT_PRE_OPERATIONAL, 0),
                     0);
    fake_can_expect(&b->fake, "000#8000");
    assert_int_equal(canopen_nmt(&b->master, CANOPEN_NMT_RESET_NODE, 127), 0);
    fake_can_expect(&b->fake, "000#817F");
    assert_int_equal(canopen_nmt(&b->master, CANOPEN_NMT_START, 128),
                     MOTION_E_ARG);
    fake_can_expect(&b->fake, NULL);
}

static void a_heartbeat_tells_the_state(void **state)
{
    static const struct {
        const char *frame;
        enum canopen_nmt_state want;
        unsigned boot_ups, malformed;
    } rows[] = {
        { "701#05", CANOPEN_NMT_OPERATIONAL, 0, 0 },
        { "701#04", CANOPEN_NMT_STOPPED, 0, 0 },
        { "701#7F", CANOPEN_NMT_PRE_OPERATIONAL_STATE, 0, 0 },
        { "701#85", CANOPEN_NMT_OPERATIONAL, 0, 0 }, /* guarding's toggle */
        { "701#0500", CANOPEN_NMT_UNKNOWN, 0, 1 },   /* two bytes */
        { "701#", CANOPEN_NMT_UNKNOWN, 0, 1 },
        { "701#00", CANOPEN_NMT_PRE_OPERATIONAL_STATE, 1, 0 },
    };

    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct bench *b;

        bench_setup(state);
        b = *state;
        fake_can_put(&b->fake, rows[i].frame);
        begin(b, 1 * MS);
        assert_int_equal(b->node.node.nmt_state, rows[i].want);
        assert_int_equal(b->node.boot_ups, rows[i].boot_ups);
        assert_int_equal(b->master.stats.malformed, rows[i].malformed);
    }
}

static void a_heartbeat_is_lost_after_exactly_its_time_and_once(void **state)
{
    struct bench *b = *state;

    b->node.node.heartbeat_timeout_ns = 60 * MS;
    begin(b, 500 * MS); /* never heard: not lost either */
    assert_int_equal(b->node.lost, 0);
    fake_can_put(&b->fake, "701#05");
    begin(b, 1000 * MS);
    begin(b, 1060 * MS - 1);
    assert_int_equal(b->node.lost, 0);
    assert_int_equal(b->node.node.nmt_state, CANOPEN_NMT_OPERATIONAL);
    begin(b, 1060 * MS);
    assert_int_equal(b->node.lost, 1);
    assert_int_equal(b->node.node.nmt_state, CANOPEN_NMT_UNKNOWN);
    begin(b, 1200 * MS);
    assert_int_equal(b->node.lost, 1);
    fake_can_put(&b->fake, "701#0505"); /* of the wrong length: no sign */
    begin(b, 1210 * MS);
    fake_can_put(&b->fake, "701#05");
    begin(b, 1220 * MS);
    begin(b, 1280 * MS);
    assert_int_equal(b->node.lost, 2);
}

static void an_emergency_reaches_its_node(void **state)
{
    struct bench *b = *state;
    const uint8_t maker[5] = { 1, 2, 3, 4, 5 };

    fake_can_put(&b->fake, "081#1084810000000000");
    begin(b, 1 * MS);
    assert_int_equal(b->node.emcys, 1);
    assert_int_equal(b->node.emcy_code, 0x8410);
    assert_int_equal(b->node.emcy_register, 0x81);
    fake_can_put(&b->fake, "081#1023020102030405");
    fake_can_put(&b->fake, "081#10230201020304");   /* 7 bytes */
    fake_can_put(&b->fake, "082#1023020102030405"); /* not ours */
    begin(b, 2 * MS);
    assert_int_equal(b->node.emcys, 2);
    assert_memory_equal(b->node.emcy_maker, maker, 5);
    assert_int_equal(b->master.stats.malformed, 1);
    assert_int_equal(b->master.stats.unexpected, 1);
}

static void pdos_are_the_known_bytes(void **state)
{
    struct bench *b = *state;
    const uint8_t target[8] = { 0x0F, 0x00, 0x10, 0x27, 0, 0 };

    b->node.rpdo_number = 1;
    b->node.rpdo_len = 6;
    memcpy(b->node.rpdo, target, 8);
    end(b, 0);
    fake_can_expect(&b->fake, "201#0F0010270000");
    fake_can_put(&b->fake, "181#371210270000");
    begin(b, 1 * MS);
    assert_int_equal(b->node.tpdos, 1);
    assert_int_equal(b->node.tpdo_number, 1);
    assert_int_equal(b->node.tpdo.len, 6);
    assert_int_equal(b->master.stats.tpdo_received, 1);
    assert_int_equal(b->master.stats.rpdo_sent, 1);
}

static void pdos_one_to_four_have_their_identifiers(void **state)
{
    static const char *const in[] = { "181#000000000000", "281#000000000000",
                                      "381#000000000000", "481#000000000000" };
    static const char *const out[] = { "201#AA", "301#AA", "401#AA", "501#AA" };
    struct bench *b = *state;

    b->node.rpdo[0] = 0xAA;
    b->node.rpdo_len = 1;
    for (unsigned i = 0; i < 4; i++) {
        fake_can_put(&b->fake, in[i]);
        begin(b, (i + 1) * MS);
        assert_int_equal(b->node.tpdo_number, i + 1);
        b->node.rpdo_number = i + 1;
        end(b, (i + 1) * MS);
        fake_can_expect(&b->fake, out[i]);
        fake_can_expect(&b->fake, NULL);
    }
}

static void a_short_tpdo_is_dropped_and_counted(void **state)
{
    struct bench *b = *state;

    fake_can_put(&b->fake, "181#3712102700");
    begin(b, 1 * MS);
    assert_int_equal(b->node.tpdos, 0);
    assert_int_equal(b->master.stats.tpdo_received, 0);
    assert_int_equal(b->master.stats.malformed, 1);
}

static void another_master_is_noticed(void **state)
{
    static const char *const frames[] = {
        "080#",                 /* SYNC */
        "000#0101",             /* NMT */
        "77F#05",               /* our own heartbeat */
        "201#0F0010270000",     /* a PDO to our node */
        "501#00",               /* its fourth */
        "601#4000100000000000", /* an SDO request to our node */
    };
    struct bench *b = *state;

    for (unsigned i = 0; i < ARRAY_LEN(frames); i++) {
        fake_can_put(&b->fake, frames[i]);
        assert_int_equal(begin(b, i * MS), HAL_FIELDBUS_FOREIGN);
        assert_int_equal(b->master.stats.foreign_master, i + 1);
        assert_int_equal(b->master.cycle.foreign_id,
                         fake_can_parse(frames[i]).id);
        assert_int_equal(begin(b, i * MS), HAL_FIELDBUS_GOOD);
    }
    assert_int_equal(b->node.steps, 2 * ARRAY_LEN(frames));
}

static void frames_for_nobody_are_counted_and_no_more(void **state)
{
    static const char *const frames[] = {
        "182#371210270000", "702#05", "582#6040600000000000",
        "100#000000000000", "101#00", "681#00",
        "7E5#00",           "202#00",
    };
    struct bench *b = *state;
    struct hal_can_frame frame = fake_can_parse("701#05");

    for (unsigned i = 0; i < ARRAY_LEN(frames); i++)
        fake_can_put(&b->fake, frames[i]);
    frame.extended = true;
    fake_can_put_frame(&b->fake, &frame);
    frame.extended = false;
    frame.remote = true;
    fake_can_put_frame(&b->fake, &frame);
    frame.remote = false;
    frame.id = 0x901; /* not an 11 bit identifier at all */
    fake_can_put_frame(&b->fake, &frame);
    assert_int_equal(begin(b, 1 * MS), HAL_FIELDBUS_GOOD);
    assert_int_equal(b->master.stats.unexpected, ARRAY_LEN(frames) + 3);
    assert_int_equal(b->node.node.nmt_state, CANOPEN_NMT_UNKNOWN);
}

static void every_begin_sends_one_sync_and_remembers_two(void **state)
{
    struct bench *b = *state;

    b->master.config.sync_period_ns = 1 * MS;
    begin(b, 5 * MS);
    begin(b, 6 * MS + 12345);
    fake_can_expect(&b->fake, "080#");
    fake_can_expect(&b->fake, "080#");
    fake_can_expect(&b->fake, NULL);
    assert_int_equal(b->master.sync_ns, 6 * MS + 12345);
    assert_int_equal(b->master.sync_previous_ns, 5 * MS);
    b->fake.refuse = 1; /* a SYNC that was not sent is not remembered */
    begin(b, 7 * MS);
    assert_int_equal(b->master.sync_ns, 6 * MS + 12345);
    assert_int_equal(b->master.stats.sync_sent, 2);
}

static void our_heartbeat_keeps_time_and_never_bursts(void **state)
{
    struct bench *b = *state;
    unsigned sent;

    b->master.config.heartbeat_period_ns = 10 * MS;
    for (int64_t t = 0; t < 100; t++)
        begin(b, t * MS);
    for (sent = 0; b->fake.out_at < b->fake.out_count; sent++)
        fake_can_expect(&b->fake, "77F#05");
    assert_int_equal(sent, 10);
    begin(b, 500 * MS); /* a long gap */
    begin(b, 501 * MS);
    begin(b, 509 * MS);
    fake_can_expect(&b->fake, "77F#05");
    fake_can_expect(&b->fake, NULL);
    begin(b, 510 * MS);
    fake_can_expect(&b->fake, "77F#05");
}

static void three_refused_cycles_in_a_row_are_a_fault(void **state)
{
    struct bench *b = *state;

    b->master.config.sync_period_ns = 1 * MS;
    b->fake.refuse = 2;
    for (int i = 1; i <= 6; i++)
        assert_int_equal(begin(b, i * MS), HAL_FIELDBUS_GOOD);
    b->fake.refuse = 4;
    for (int i = 1; i <= 3; i++)
        assert_int_equal(begin(b, i * MS), HAL_FIELDBUS_GOOD);
    b->fake.state = HAL_CAN_PASSIVE; /* which would be less */
    assert_int_equal(begin(b, 4 * MS), HAL_FIELDBUS_FULL);
    b->fake.state = HAL_CAN_ACTIVE;
    assert_int_equal(b->master.cycle.send_refused, 6);
    begin(b, 5 * MS);
    assert_int_equal(begin(b, 6 * MS), HAL_FIELDBUS_GOOD);
}

static void a_bus_that_is_down_says_so(void **state)
{
    struct bench *b = *state;

    b->fake.state = HAL_CAN_WARNING;
    assert_int_equal(begin(b, 1 * MS), HAL_FIELDBUS_GOOD);
    b->fake.state = HAL_CAN_PASSIVE;
    assert_int_equal(begin(b, 2 * MS), HAL_FIELDBUS_PASSIVE);
    b->fake.state = HAL_CAN_BUS_OFF;
    assert_int_equal(begin(b, 2 * MS), HAL_FIELDBUS_BUS_OFF);
    end(b, 2 * MS);
    b->fake.state = HAL_CAN_DOWN;
    assert_int_equal(begin(b, 3 * MS), HAL_FIELDBUS_DOWN);
    b->fake.state = HAL_CAN_ACTIVE;
    assert_int_equal(begin(b, 4 * MS), HAL_FIELDBUS_GOOD);
    end(b, 4 * MS);
    b->fake.recv_err = MOTION_E_IO;
    assert_int_equal(begin(b, 5 * MS), HAL_FIELDBUS_DOWN);
    assert_int_equal(b->node.steps, 6); /* the node goes on being served */
}

static void a_babbling_node_cannot_hold_a_cycle(void **state)
{
    struct bench *b = *state;

    for (unsigned i = 0; i < CAN_CYCLE_DRAIN_MAX + 10; i++)
        fake_can_put(&b->fake, "181#371210270000");
    begin(b, 1 * MS);
    assert_int_equal(b->node.tpdos, CAN_CYCLE_DRAIN_MAX);
    begin(b, 2 * MS);
    assert_int_equal(b->node.tpdos, CAN_CYCLE_DRAIN_MAX + 10);
}

static void bad_configurations_are_refused(void **state)
{
    static const struct canopen_config bad[] = {
        { .node_id = 0 },
        { .node_id = 128 },
        { .node_id = 1, .sync_period_ns = -1 },
        { .node_id = 1, .heartbeat_period_ns = -1 },
        { .node_id = 1, .sdo_timeout_ns = -1 },
        { .node_id = 1, .sdo_gap_ns = -1 },
    };
    struct bench *b = *state;
    static struct watcher more[64];

    for (unsigned i = 0; i < ARRAY_LEN(bad); i++)
        assert_int_equal(canopen_init(&b->master, &b->fake.can, &bad[i]),
                         MOTION_E_ARG);
    bench_setup(state);
    for (unsigned i = 0; i < ARRAY_LEN(more); i++) {
        more[i].node.ops = &watcher_ops;
        more[i].node.id = (uint8_t)(i + 2);
    }
    more[0].node.id = 1; /* taken */
    assert_int_equal(canopen_add(&b->master, &more[0].node), MOTION_E_ARG);
    more[0].node.id = 127; /* ours */
    assert_int_equal(canopen_add(&b->master, &more[0].node), MOTION_E_ARG);
    more[0].node.id = 0;
    assert_int_equal(canopen_add(&b->master, &more[0].node), MOTION_E_ARG);
    more[0].node.id = 128;
    assert_int_equal(canopen_add(&b->master, &more[0].node), MOTION_E_ARG);
    more[0].node.id = 2;
    for (unsigned i = 0; i < ARRAY_LEN(more); i++)
        assert_int_equal(canopen_add(&b->master, &more[i].node), MOTION_OK);
}

/* ---- any frame at all ---- */

/* Whatever comes, every frame is counted in exactly one place. */
static void any_frame_is_counted_once(void **state)
{
    struct bench *b = *state;
    uint64_t seed = UINT64_C(0x5EED1234);
    unsigned heartbeats = 0;
    const struct canopen_stats *stats = &b->master.stats;

    print_message("seed 0x%" PRIX64 "\n", seed);
    for (unsigned i = 0; i < 20000; i++) {
        struct hal_can_frame frame = { 0 };
        uint64_t before, after;

        frame.id = (uint32_t)check_random(&seed) & (i & 1 ? 0x7FF : 0x781);
        frame.len = (uint8_t)(check_random(&seed) % 9);
        for (unsigned k = 0; k < 8; k++)
            frame.data[k] = (uint8_t)check_random(&seed);
        if (frame.id == 0x701 && frame.len == 1)
            heartbeats++;
        before = stats->tpdo_received + stats->emcy_received +
                 stats->unexpected + stats->malformed + stats->foreign_master;
        fake_can_wipe(&b->fake);
        fake_can_put_frame(&b->fake, &frame);
        begin(b, (int64_t)i * MS);
        after = stats->tpdo_received + stats->emcy_received +
                stats->unexpected + stats->malformed + stats->foreign_master;
        if (frame.id == 0x701 && frame.len == 1)
            assert_int_equal(after, before);
        else
            assert_int_equal(after, before + 1);
        fake_can_expect(&b->fake, NULL);
    }
    assert_true(heartbeats > 0);
}

/* ---- words ---- */

static void codes_have_words(void **state)
{
    (void)state;
    assert_string_equal(canopen_abort_text(0x06090011), "no such sub-index");
    assert_string_equal(canopen_abort_text(0x05040000), "time-out");
    assert_string_equal(canopen_abort_text(0x12345678), "unknown abort code");
    assert_string_equal(canopen_emcy_text(0x0000), "no error");
    assert_string_equal(canopen_emcy_text(0x2310), "current, output side");
    assert_string_equal(canopen_emcy_text(0x2910), "current");
    assert_string_equal(canopen_emcy_text(0x8611), "following error");
    assert_string_equal(canopen_emcy_text(0x8612), "monitoring");
    assert_string_equal(canopen_emcy_text(0xFF10), "maker's own");
    assert_string_equal(canopen_emcy_text(0xA000), "unknown code");
}

static void text_is_cut_to_its_capacity(void **state)
{
    char buffer[8];
    struct hal_text text;

    (void)state;
    hal_text_init(&text, buffer, sizeof buffer);
    assert_string_equal(buffer, "");
    hal_text_put(&text, "0x");
    hal_text_hex(&text, 0x00BEEF, 4);
    assert_string_equal(buffer, "0xBEEF");
    hal_text_put(&text, "too much");
    assert_string_equal(buffer, "0xBEEFt");
    hal_text_hex(&text, 1, 8);
    hal_text_dec(&text, 1);
    assert_string_equal(buffer, "0xBEEFt");
}

static void decimal_numbers_read_as_printf_writes_them(void **state)
{
    static const uint32_t rows[] = { 0,         1,          9,
                                     10,        127,        1000,
                                     999999999, 1000000000, UINT32_MAX };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(rows); i++) {
        char got[16], want[16];
        struct hal_text text;

        hal_text_init(&text, got, sizeof got);
        hal_text_dec(&text, rows[i]);
        snprintf(want, sizeof want, "%lu", (unsigned long)rows[i]);
        assert_string_equal(got, want);
    }
}

#define BENCH(test) cmocka_unit_test_setup(test, bench_setup)

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH(sdo_transfers_are_the_known_bytes),
        BENCH(a_late_sdo_answer_for_something_else_is_dropped),
        BENCH(an_answer_to_an_earlier_transfer_is_dropped),
        BENCH(an_abort_that_nothing_follows_is_the_outcome),
        BENCH(an_answer_for_another_object_ends_the_wait_for_late_ones),
        BENCH(a_number_may_come_by_segments),
        BENCH(an_sdo_that_times_out_is_aborted_on_the_wire),
        BENCH(an_sdo_answer_of_the_wrong_kind_is_given_up),
        BENCH(an_sdo_that_cannot_be_sent_is_not_started),
        BENCH(sdo_requests_leave_room_between_them),
        BENCH(nmt_commands_are_the_known_bytes),
        BENCH(a_heartbeat_tells_the_state),
        BENCH(a_heartbeat_is_lost_after_exactly_its_time_and_once),
        BENCH(an_emergency_reaches_its_node),
        BENCH(pdos_are_the_known_bytes),
        BENCH(pdos_one_to_four_have_their_identifiers),
        BENCH(a_short_tpdo_is_dropped_and_counted),
        BENCH(another_master_is_noticed),
        BENCH(frames_for_nobody_are_counted_and_no_more),
        BENCH(every_begin_sends_one_sync_and_remembers_two),
        BENCH(our_heartbeat_keeps_time_and_never_bursts),
        BENCH(three_refused_cycles_in_a_row_are_a_fault),
        BENCH(a_bus_that_is_down_says_so),
        BENCH(a_babbling_node_cannot_hold_a_cycle),
        BENCH(bad_configurations_are_refused),
        BENCH(any_frame_is_counted_once),
        cmocka_unit_test(codes_have_words),
        cmocka_unit_test(text_is_cut_to_its_capacity),
        cmocka_unit_test(decimal_numbers_read_as_printf_writes_them),
    };

    return cmocka_run_group_tests_name("canopen", tests, NULL, NULL);
}

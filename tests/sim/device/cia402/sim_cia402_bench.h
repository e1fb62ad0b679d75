/* tests/sim/device/cia402/sim_cia402_bench.h - one simulated drive and a master
 * that is a hand on the wire: frames, objects, cycles. */
#ifndef TESTS_SIM_DEVICE_CIA402_SIM_CIA402_BENCH_H
#define TESTS_SIM_DEVICE_CIA402_SIM_CIA402_BENCH_H

#include "tests/sim/bus/sim_bus.h"

#define PERIOD_NS MS

struct bench {
    struct sim_world world;
    struct sim_can_bus bus;
    struct sim_can_port master;
    struct sim_cia402 drive;
    struct hal_can_frame heard[4096]; /* since the last forget() */
    size_t heard_count;
};

static const struct sim_cia402_config drive_config = {
    .node_id = 1,
    .plant = { .omega_mrad_s = 500000,
               .zeta_permille = 1000,
               .vel_max_counts_s = 2000000,
               .acc_max_counts_s2 = 100000000 },
    .start_counts = 10000,
    .loop_ns = 250000,
    .boot_ns = 5 * MS,
};

static inline struct bench *bench_of(const struct sim_cia402_config *config)
{
    struct bench *b = calloc(1, sizeof(*b));

    assert_non_null(b);
    sim_world_init(&b->world, 0);
    assert_int_equal(sim_can_bus_init(&b->bus, &b->world, 1000000), 0);
    sim_can_port_init(&b->master, &b->bus);
    assert_int_equal(sim_cia402_init(&b->drive, &b->bus, config), 0);
    return b;
}

static inline void listen(struct bench *b)
{
    while (b->heard_count < ARRAY_LEN(b->heard) &&
           hal_can_recv(&b->master.can, &b->heard[b->heard_count]) == 1)
        b->heard_count++;
}

static inline void forget(struct bench *b)
{
    listen(b);
    b->heard_count = 0;
}

static inline void pass(struct bench *b, int64_t ns)
{
    int64_t end_ns = b->world.now_ns + ns;

    while (b->world.now_ns < end_ns) {
        int64_t next_ns = b->world.now_ns + PERIOD_NS;

        sim_world_run(&b->world, next_ns < end_ns ? next_ns : end_ns);
        listen(b);
    }
}

static inline void say(struct bench *b, const char *text)
{
    struct hal_can_frame frame = frame_of(text);

    assert_int_equal(hal_can_send(&b->master.can, &frame), MOTION_OK);
}

/* The last frame heard with this id, or NULL. */
static const struct hal_can_frame *last(struct bench *b, uint32_t id)
{
    listen(b);
    for (size_t i = b->heard_count; i-- > 0;)
        if (b->heard[i].id == id)
            return &b->heard[i];
    return NULL;
}

static inline unsigned count(struct bench *b, uint32_t id)
{
    unsigned n = 0;

    listen(b);
    for (size_t i = 0; i < b->heard_count; i++)
        n += b->heard[i].id == id;
    return n;
}

static inline void expect_last(struct bench *b, const char *text)
{
    struct hal_can_frame want = frame_of(text);
    const struct hal_can_frame *got = last(b, want.id);

    if (!got)
        fail_msg("nothing heard, not %s", text);
    else
        assert_string_equal(text_of(got), text);
}

/* Request and what must come back; "" for nothing. */
static inline void query(struct bench *b, const char *request,
                         const char *reply)
{
    forget(b);
    say(b, request);
    pass(b, MS);
    if (*reply)
        expect_last(b, reply);
    else
        assert_int_equal(b->heard_count, 0);
}

/* ---- shorter words ----------------------------------------------------- */

static inline uint32_t sdo(struct bench *b, unsigned command, unsigned index,
                           unsigned sub, uint32_t value)
{
    char text[32];
    const struct hal_can_frame *reply;

    snprintf(text, sizeof(text), "601#%02X%02X%02X%02X%02X%02X%02X%02X",
             command, index & 0xFF, index >> 8, sub, value & 0xFF,
             value >> 8 & 0xFF, value >> 16 & 0xFF, value >> 24);
    forget(b);
    say(b, text);
    pass(b, MS);
    reply = last(b, 0x581);
    assert_non_null(reply);
    assert_int_equal(reply->data[1] | reply->data[2] << 8, index);
    assert_int_equal(reply->data[3], sub);
    value = reply->data[4] | (uint32_t)reply->data[5] << 8 |
            (uint32_t)reply->data[6] << 16 | (uint32_t)reply->data[7] << 24;
    if ((command & 0xE0) == 0x20 && reply->data[0] == 0x60)
        return 0;
    if (command == 0x40 && (reply->data[0] & 0xE0) == 0x40)
        return value;
    assert_int_equal(reply->data[0], 0x80);
    return value; /* the abort code */
}

static inline uint32_t w8(struct bench *b, unsigned index, unsigned sub,
                          uint32_t v)
{
    return sdo(b, 0x2F, index, sub, v);
}

static inline uint32_t w16(struct bench *b, unsigned index, unsigned sub,
                           uint32_t v)
{
    return sdo(b, 0x2B, index, sub, v);
}

static inline uint32_t w32(struct bench *b, unsigned index, unsigned sub,
                           uint32_t v)
{
    return sdo(b, 0x23, index, sub, v);
}

static inline uint32_t rd(struct bench *b, unsigned index, unsigned sub)
{
    return sdo(b, 0x40, index, sub, 0);
}

static inline uint32_t status(struct bench *b)
{
    return rd(b, 0x6041, 0);
}

/* Power state as the statusword says it. */
static const char *state_of(uint32_t word)
{
    static const struct {
        uint32_t mask, value;
        const char *name;
    } rows[] = {
        { 0x4F, 0x00, "not ready" }, { 0x4F, 0x40, "disabled" },
        { 0x6F, 0x21, "ready" },     { 0x6F, 0x23, "on" },
        { 0x6F, 0x27, "enabled" },   { 0x6F, 0x07, "quick stop" },
        { 0x4F, 0x0F, "reaction" },  { 0x4F, 0x08, "fault" },
    };

    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        if ((word & rows[i].mask) == rows[i].value)
            return rows[i].name;
    return "unknown";
}

static inline void expect_state(struct bench *b, const char *want)
{
    assert_string_equal(state_of(status(b)), want);
}

static inline struct bench *booted_of(const struct sim_cia402_config *config)
{
    struct bench *b = bench_of(config);

    pass(b, config->boot_ns + MS);
    return b;
}

static inline struct bench *booted(void)
{
    return booted_of(&drive_config);
}

/* RPDO1 = 6040, 607A; TPDO1 = 6041, 6064; both at every SYNC; Operational. */
static inline void configure(struct bench *b)
{
    assert_int_equal(w32(b, 0x1400, 1, 0x80000201), 0);
    assert_int_equal(w8(b, 0x1600, 0, 0), 0);
    assert_int_equal(w32(b, 0x1600, 1, 0x60400010), 0);
    assert_int_equal(w32(b, 0x1600, 2, 0x607A0020), 0);
    assert_int_equal(w8(b, 0x1600, 0, 2), 0);
    assert_int_equal(w8(b, 0x1400, 2, 1), 0);
    assert_int_equal(w32(b, 0x1400, 1, 0x201), 0);
    assert_int_equal(w32(b, 0x1800, 1, 0x80000181), 0);
    assert_int_equal(w8(b, 0x1A00, 0, 0), 0);
    assert_int_equal(w32(b, 0x1A00, 1, 0x60410010), 0);
    assert_int_equal(w32(b, 0x1A00, 2, 0x60640020), 0);
    assert_int_equal(w8(b, 0x1A00, 0, 2), 0);
    assert_int_equal(w8(b, 0x1800, 2, 1), 0);
    assert_int_equal(w32(b, 0x1800, 1, 0x181), 0);
    assert_int_equal(w8(b, 0x6060, 0, 8), 0);
    say(b, "000#0101");
    pass(b, MS);
}

/* One cycle of the bus: SYNC, then the RPDO. */
static inline void cycle(struct bench *b, unsigned controlword, int32_t target)
{
    char text[32];
    uint32_t t = (uint32_t)target;
    int64_t end_ns = b->world.now_ns + PERIOD_NS;

    snprintf(text, sizeof(text), "201#%02X%02X%02X%02X%02X%02X",
             controlword & 0xFF, controlword >> 8, t & 0xFF, t >> 8 & 0xFF,
             t >> 16 & 0xFF, t >> 24);
    say(b, "080#");
    sim_world_run(&b->world, b->world.now_ns + 400000);
    say(b, text);
    sim_world_run(&b->world, end_ns);
    listen(b);
}

static inline void cycles(struct bench *b, int n, unsigned controlword,
                          int32_t target)
{
    while (n-- > 0)
        cycle(b, controlword, target);
}

/* What the last TPDO1 said. */
static inline unsigned tpdo_status(struct bench *b)
{
    const struct hal_can_frame *frame = last(b, 0x181);

    assert_non_null(frame);
    return frame->data[0] | (unsigned)frame->data[1] << 8;
}

static inline int32_t tpdo_position(struct bench *b)
{
    const struct hal_can_frame *frame = last(b, 0x181);

    assert_non_null(frame);
    return (int32_t)(frame->data[2] | (uint32_t)frame->data[3] << 8 |
                     (uint32_t)frame->data[4] << 16 |
                     (uint32_t)frame->data[5] << 24);
}

static inline int32_t here(const struct bench *b)
{
    return (int32_t)(sim_servo_pos_q24(&b->drive.base) >> 24);
}

static inline void enable(struct bench *b)
{
    int32_t at = here(b);

    cycles(b, 3, 0x06, at);
    cycles(b, 3, 0x07, at);
    cycles(b, 3, 0x0F, at);
    assert_string_equal(state_of(tpdo_status(b)), "enabled");
}

static inline struct bench *enabled_of(const struct sim_cia402_config *config)
{
    struct bench *b = booted_of(config);

    configure(b);
    enable(b);
    forget(b);
    return b;
}

static inline struct bench *enabled(void)
{
    return enabled_of(&drive_config);
}

/* Cruise: 100 counts per cycle, 100000 counts/s; returns the last target. */
static inline int32_t cruise(struct bench *b, int n)
{
    int32_t target = here(b);

    for (int i = 0; i < n; i++)
        cycle(b, 0x0F, target += 100);
    return target;
}

#endif

/* tests/hal/can/test_bits.c - how long frames are: by hand, and against a slow
 * oracle. */
#include "hal/can/bits.h"

#include "tests/sim/bus/sim_bus.h"
#include "tests/support/check.h"

/* ---- a slow oracle on strings of '0' and '1' --------------------- */

static void oracle_put(char *wire, uint32_t value, unsigned count)
{
    size_t at = strlen(wire);

    while (count-- > 0)
        wire[at++] = (value >> count & 1) ? '1' : '0';
    wire[at] = 0;
}

/* Remainder of wire(x) x^15 by long division on paper. */
static unsigned oracle_crc(const char *wire)
{
    static const char poly[] = "1100010110011001";
    char work[256];
    size_t len = strlen(wire);
    unsigned rest = 0;

    snprintf(work, sizeof(work), "%s000000000000000", wire);
    for (size_t i = 0; i < len; i++)
        for (unsigned j = 0; work[i] == '1' && j < 16; j++)
            if (j > 0)
                work[i + j] = work[i + j] == poly[j] ? '0' : '1';
    for (size_t i = len; i < len + 15; i++)
        rest = rest << 1 | (work[i] == '1');
    return rest;
}

static unsigned oracle_stuffed_len(const char *wire)
{
    char out[1024] = "";
    size_t len = 0;

    for (; *wire; wire++) {
        out[len++] = *wire;
        if (len >= 5 && strspn(out + len - 5, "0") == 5)
            out[len++] = '1';
        else if (len >= 5 && strspn(out + len - 5, "1") == 5)
            out[len++] = '0';
        out[len] = 0;
    }
    return (unsigned)len;
}

static unsigned oracle_bits(const struct hal_can_frame *frame)
{
    char wire[256] = "0";

    if (frame->extended) {
        oracle_put(wire, frame->id >> 18, 11);
        oracle_put(wire, 3, 2);
        oracle_put(wire, frame->id & 0x3FFFF, 18);
        oracle_put(wire, frame->remote, 1);
    } else {
        oracle_put(wire, frame->id, 11);
        oracle_put(wire, frame->remote, 1);
    }
    oracle_put(wire, 0, 2);
    oracle_put(wire, frame->len, 4);
    for (unsigned i = 0; !frame->remote && i < frame->len; i++)
        oracle_put(wire, frame->data[i], 8);
    oracle_put(wire, oracle_crc(wire), 15);
    return oracle_stuffed_len(wire) + 1 + 2 + 7 + 3;
}

/* CRC-15/CAN of "123456789" is 0x059E in the usual catalogues of CRCs. */
static void the_oracle_knows_the_published_crc(void **state)
{
    char wire[256] = "";

    (void)state;
    for (unsigned i = 0; i < 9; i++)
        oracle_put(wire, '1' + i, 8);
    assert_int_equal(oracle_crc(wire), 0x059E);
}

static const struct {
    const char *frame;
    unsigned bits;
} lengths[] = {
    /* id 0, no data: 34 zeros and so CRC 0; a stuff bit after each 5 of them */
    { "000#", 47 + 6 },
    { "080#", 47 + 4 }, /* SYNC; by a script that divides polynomials */
    { "7FF#", 47 + 3 },
    { "2AA#", 47 + 2 },
    { "701#05", 55 + 3 },
    { "000#0000000000000000", 111 + 16 },
    { "7FF#FFFFFFFFFFFFFFFF", 111 + 15 },
    { "201#0F0010270000", 95 + 9 },
    { "181#371210270000", 95 + 6 },
    { "555#5555555555555555", 111 + 1 },
    { "078#3C3C3C3C3C3C3C3C", 111 + 20 }, /* 4 and 4 bits: as bad as can be
                                              but for control bits, CRC */
    { "18DAF110#010203", 67 + 24 + 4 },
    { "00000000#0000000000000000", 131 + 19 },
    { "1FFFFFFF#FFFFFFFFFFFFFFFF", 131 + 18 },
};

static void frame_bits_match_hand_values(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(lengths); i++) {
        struct hal_can_frame frame = frame_of(lengths[i].frame);
        unsigned got = can_bits_of(&frame).slow;

        if (got != lengths[i].bits || oracle_bits(&frame) != got)
            fail_msg("%s: got %u, oracle %u", lengths[i].frame, got,
                     oracle_bits(&frame));
    }
}

static uint32_t random_u32(uint64_t *seed)
{
    return (uint32_t)(check_random(seed) >> 32);
}

static struct hal_can_frame random_frame(uint64_t *seed)
{
    struct hal_can_frame frame = { .extended = random_u32(seed) % 4 == 0 };
    uint32_t kind = random_u32(seed) % 3;

    frame.id = random_u32(seed) & (frame.extended ? 0x1FFFFFFF : 0x7FF);
    frame.remote = random_u32(seed) % 8 == 0;
    frame.len = (uint8_t)(random_u32(seed) % 9);
    for (unsigned i = 0; i < 8; i++) { /* also long runs of equal bits */
        const uint32_t bytes[] = { random_u32(seed),
                                   0x3C0Fu >> random_u32(seed) % 8,
                                   0 - random_u32(seed) % 2 };

        frame.data[i] = (uint8_t)bytes[kind];
    }
    return frame;
}

/* 44 + 8 n + stuffing (at most one in four after the first bit), + 3. */
static void frame_bits_match_the_oracle_and_stay_below_the_bound(void **state)
{
    const uint64_t first = 20240611;
    uint64_t seed = first;

    (void)state;
    for (unsigned i = 0; i < 3000; i++) {
        struct hal_can_frame frame = random_frame(&seed);
        unsigned got = can_bits_of(&frame).slow;
        unsigned stuffed =
            (frame.extended ? 54u : 34u) + (frame.remote ? 0u : 8u * frame.len);

        if (got != oracle_bits(&frame) ||
            got > stuffed + (stuffed - 1) / 4 + 13 ||
            (!frame.extended && got > 135))
            fail_msg("seed %" PRIu64 ", frame %u: %s: %u bits", first, i,
                     text_of(&frame), got);
    }
}

/* An FD frame on paper: the slow part ends with BRS; the fast one is ESI, DLC
 * and data, stuffed on from there, then 4 + 17 or 4 + 21 bits with one stuffed
 * before each four. */
static struct can_bits oracle_fd_bits(const struct hal_can_frame *frame)
{
    static const unsigned lengths_of_dlc[] = { 0, 1,  2,  3,  4,  5,  6,  7,
                                               8, 12, 16, 20, 24, 32, 48, 64 };
    char wire[1024] = "0";
    unsigned head, dlc = 0, crc = frame->len > 16 ? 25 : 21;

    oracle_put(wire, frame->extended ? frame->id >> 18 : frame->id, 11);
    if (frame->extended) {
        oracle_put(wire, 3, 2);
        oracle_put(wire, frame->id & 0x3FFFF, 18);
        oracle_put(wire, 0, 1);
    } else {
        oracle_put(wire, 0, 2);
    }
    oracle_put(wire, 2, 2);
    oracle_put(wire, frame->switched, 1);
    head = oracle_stuffed_len(wire);
    while (lengths_of_dlc[dlc] != frame->len)
        dlc++;
    oracle_put(wire, dlc, 5);
    for (unsigned i = 0; i < frame->len; i++)
        oracle_put(wire, frame->data[i], 8);
    return (struct can_bits){ head + 13, oracle_stuffed_len(wire) - head + crc +
                                             (crc + 3) / 4 };
}

static void fd_frame_bits_match_the_oracle(void **state)
{
    static const uint8_t lengths_fd[] = {
        0, 1, 7, 8, 12, 16, 20, 24, 32, 48, 64
    };
    uint64_t seed = 20240612;

    (void)state;
    for (unsigned i = 0; i < 2000; i++) {
        struct hal_can_frame frame = random_frame(&seed);
        struct can_bits got, want;

        frame.remote = false;
        frame.fd = true;
        frame.switched = i % 2;
        frame.len = lengths_fd[i % ARRAY_LEN(lengths_fd)];
        for (unsigned j = 8; j < frame.len; j++)
            frame.data[j] = (uint8_t)random_u32(&seed);
        got = can_bits_of(&frame);
        want = oracle_fd_bits(&frame);
        if (!frame.switched)
            want = (struct can_bits){ want.slow + want.fast, 0 };
        if (got.slow != want.slow || got.fast != want.fast)
            fail_msg("frame %u: %u + %u, expected %u + %u", i, got.slow,
                     got.fast, want.slow, want.fast);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_oracle_knows_the_published_crc),
        cmocka_unit_test(frame_bits_match_hand_values),
        cmocka_unit_test(frame_bits_match_the_oracle_and_stay_below_the_bound),
        cmocka_unit_test(fd_frame_bits_match_the_oracle),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

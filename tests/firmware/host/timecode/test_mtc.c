/* tests/firmware/host/timecode/test_mtc.c - MIDI timecode, byte by byte. */
#include "firmware/host/timecode/mtc.h"
#include "tests/support/check.h"

static struct mtc mtc;

/* The quarter frames of a number, from piece `from` on, so many. */
static int send(unsigned h, unsigned m, unsigned s, unsigned f, unsigned type,
                unsigned from, unsigned count, struct mtc_mark *mark)
{
    const unsigned data[8] = { f & 15, f >> 4, s & 15, s >> 4,
                               m & 15, m >> 4, h & 15, h >> 4 | type << 1 };
    int marks = 0;
    for (unsigned i = from; i < from + count; i++) {
        assert_false(mtc_take(&mtc, 0xF1, mark));
        marks += mtc_take(&mtc, (uint8_t)(i << 4 | data[i]), mark);
    }
    return marks;
}

static int fresh(void **state)
{
    (void)state;
    mtc = (struct mtc){ .count = 0 };
    return 0;
}

/* A number is that of the frame in which its first piece was sent. */
static void a_number_is_known_with_its_last_piece(void **state)
{
    struct mtc_mark mark;
    (void)state;
    assert_int_equal(send(1, 2, 3, 4, 1, 0, 8, &mark), 1);
    assert_int_equal(mark.fps, 25);
    assert_false(mark.drop);
    assert_int_equal(mark.quarters, 4 * ((3600 + 2 * 60 + 3) * 25 + 4) + 7);
}

static void every_piece_is_a_mark_from_then_on(void **state)
{
    struct mtc_mark mark;
    (void)state;
    (void)send(0, 0, 10, 22, 1, 0, 8, &mark);
    for (unsigned i = 0; i < 8; i++) {
        assert_int_equal(send(0, 0, 10, 24, 1, i, 1, &mark), 1);
        assert_int_equal(mark.quarters, 4 * (10 * 25 + 24) + i);
    }
}

/* 30 drop: ten minutes have 17982 frames; type 2. */
static void left_out_numbers_are_not_counted(void **state)
{
    struct mtc_mark mark;
    (void)state;
    (void)send(0, 10, 0, 0, 2, 0, 8, &mark);
    assert_true(mark.drop);
    assert_int_equal(mark.quarters, 4 * 17982 + 7);
    assert_int_equal(send(0, 1, 0, 1, 2, 0, 8, &mark), 7); /* no such number */
}

static void a_lost_piece_begins_anew(void **state)
{
    struct mtc_mark mark;
    (void)state;
    (void)send(0, 0, 10, 0, 1, 0, 8, &mark);
    assert_int_equal(send(0, 0, 10, 2, 1, 0, 3, &mark), 3);
    assert_int_equal(send(0, 0, 10, 2, 1, 4, 4, &mark), 0);
    assert_int_equal(send(0, 0, 10, 4, 1, 0, 7, &mark), 0);
    assert_int_equal(send(0, 0, 10, 4, 1, 7, 1, &mark), 1);
}

static void other_messages_are_passed_over(void **state)
{
    struct mtc_mark mark;
    static const uint8_t other[] = { 0x90, 60, 100, 61, 100, 0xF0, 1, 2, 0xF7 };
    (void)state;
    (void)send(0, 0, 10, 0, 1, 0, 8, &mark);
    for (size_t i = 0; i < sizeof other; i++)
        assert_false(mtc_take(&mtc, other[i], &mark));
    assert_false(mtc_take(&mtc, 0xF1, &mark));
    assert_false(mtc_take(&mtc, 0xF8, &mark)); /* a clock within it */
    assert_true(mtc_take(&mtc, 0x02, &mark));
}

/* Any bytes: no crash, and no time beyond a day. */
static void any_bytes_are_no_harm(void **state)
{
    struct mtc_mark mark;
    (void)state;
    seed_from("bytes");
    for (int i = 0; i < 1000000; i++)
        if (mtc_take(&mtc, (uint8_t)(draw() % 4 ? draw() % 128 : 0xF1), &mark))
            assert_in_range(mark.quarters, 0, 4 * 24 * 3600 * 30 + 8);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(a_number_is_known_with_its_last_piece, fresh),
        cmocka_unit_test_setup(every_piece_is_a_mark_from_then_on, fresh),
        cmocka_unit_test_setup(left_out_numbers_are_not_counted, fresh),
        cmocka_unit_test_setup(a_lost_piece_begins_anew, fresh),
        cmocka_unit_test_setup(other_messages_are_passed_over, fresh),
        cmocka_unit_test_setup(any_bytes_are_no_harm, fresh),
    };
    return cmocka_run_group_tests_name("mtc", tests, NULL, NULL);
}

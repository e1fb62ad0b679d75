/* tests/firmware/host/base/test_timecode.c - frames of hours and days, counted one
 * by one. */
#include "firmware/host/base/timecode.h"

#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>

#include "tests/support/check.h"

/* Counts up as a clock does, frame by frame; a dropped number is passed over. */
static void count(struct units_fps fps, unsigned per_s, unsigned dropped,
                  unsigned seconds)
{
    uint64_t expected = 0;
    for (unsigned s = 0; s < seconds; s++)
        for (unsigned f = 0; f < per_s; f++) {
            char text[32];
            uint64_t frames;
            const bool left_out =
                s % 60 == 0 && f < dropped && s / 60 % 10 != 0;
            snprintf(text, sizeof text, "%02u:%02u:%02u%c%02u", s / 3600,
                     s / 60 % 60, s % 60, dropped > 0 ? ';' : ':', f);
            const char *wrong = timecode_frames(text, fps, &frames);
            if (left_out != (wrong != NULL) ||
                (!left_out && frames != expected))
                fail_msg("%s: %s, %" PRIu64 ", expected %" PRIu64, text,
                         wrong != NULL ? wrong : "right", frames, expected);
            expected += !left_out;
        }
}

static void every_frame_has_its_number(void **state)
{
    (void)state;
    count((struct units_fps){ 24, 1 }, 24, 0, 7200);
    count((struct units_fps){ 24000, 1001 }, 24, 0, 7200);
    count((struct units_fps){ 25, 1 }, 25, 0, 7200);
    count((struct units_fps){ 30000, 1001 }, 30, 0, 7200);
    count((struct units_fps){ 30000, 1001 }, 30, 2, 86400);
    count((struct units_fps){ 60000, 1001 }, 60, 4, 86400);
}

/* SMPTE ST 12-1: a day of drop-frame timecode is 86.4 ms short of a day. */
static void a_day_of_drop_frame_is_a_day(void **state)
{
    uint64_t frames;
    (void)state;
    assert_null(timecode_frames("24:00:00;00",
                                (struct units_fps){ 30000, 1001 }, &frames));
    assert_int_equal(frames * 1001 * 1000 / 30000, 86399913);
}

static void what_is_no_timecode_is_refused(void **state)
{
    static const char *const text[] = {
        "",           ":",           "1",          "1:2:3",        "1:2:3:",
        "1:2:3:4:5",  "1;2:3:4",     "1:2;3:4",    "1:2:3:4 ",     " 1:2:3:4",
        "1:2:3:-4",   "1:2:3:00004", "1:2:3:4;",   "100:00:00:00", "0:60:00:00",
        "0:00:60:00", "0:00:00:24",  "0:00:00;00",
    };
    uint64_t frames;
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(text); i++)
        if (timecode_frames(text[i], (struct units_fps){ 24, 1 }, &frames) ==
            NULL)
            fail_msg("'%s' was taken", text[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_frame_has_its_number),
        cmocka_unit_test(a_day_of_drop_frame_is_a_day),
        cmocka_unit_test(what_is_no_timecode_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* tests/firmware/host/base/test_wall_time.c - wall-clock times against the C
 * library's calendar. */
#define _DEFAULT_SOURCE /* timegm */
#include "firmware/host/base/wall_time.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

#include "tests/support/check.h"

#define SEED UINT64_C(0x2545F4914F6CDD1D)

static void check(const char *text, int64_t want_ns)
{
    int64_t t_ns = -1;
    const char *wrong = wall_time_parse(text, &t_ns);
    if (wrong != NULL || t_ns != want_ns)
        fail_msg("%s: %s, %" PRId64 ", expected %" PRId64, text,
                 wrong != NULL ? wrong : "right", t_ns, want_ns);
}

static void known_times(void **state)
{
    (void)state;
    check("1970-01-01T00:00:00Z", 0);
    check("1970-01-01 00:00:00.000000001Z", 1);
    check("1970-01-01T01:30:00.5+01:30", 500000000);
}

/* Every zone and every number of decimals, at random times of all years. */
static void times_are_those_of_the_calendar(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < 200000; i++) {
        const time_t t = check_random_in(&seed, 0, INT64_C(9214560000));
        const int zone_min = (int)check_random_in(&seed, -1439, 1439);
        const int apart = zone_min < 0 ? -zone_min : zone_min;
        int64_t ns = check_random_in(&seed, 0, 999999999);
        char date[32], text[80], decimals[12];
        struct tm tm;
        const int digits = (int)check_random_in(&seed, 1, 9);
        snprintf(decimals, sizeof decimals, "%09d", (int)ns);
        for (int d = digits; d < 9; d++)
            decimals[d] = '0';
        ns = strtol(decimals, NULL, 10);
        decimals[digits] = 0;
        assert_non_null(gmtime_r(&t, &tm));
        strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%S", &tm);
        snprintf(text, sizeof text, "%s.%s%c%02d:%02d", date, decimals,
                 zone_min < 0 ? '-' : '+', apart / 60, apart % 60);
        check(text, (t - 60 * (int64_t)zone_min) * 1000000000 + ns);
    }
}

static void what_is_no_time_is_refused(void **state)
{
    static const char *const text[] = {
        "",
        "now",
        "21:00:00",
        "2026-11-23",
        "2026-11-23T21:00:00",
        "2026-11-23T21:00Z",
        "2026-11-23T21:00:00.Z",
        "2026-11-23T24:00:00Z",
        "2026-11-23T21:60:00Z",
        "2026-11-23T21:00:60Z",
        "2026-02-29T00:00:00Z",
        "2026-13-01T00:00:00Z",
        "2026-00-01T00:00:00Z",
        "2026-01-00T00:00:00Z",
        "2026-11-31T00:00:00Z",
        "2100-02-29T00:00:00Z",
        "1969-12-31T23:59:59Z",
        "2262-01-01T00:00:00Z",
        "2026-11-23T21:00:00z",
        "2026-11-23T21:00:00+1",
        "2026-11-23T21:00:00+24:00",
        "2026-11-23T21:00:00Z ",
        "2026-11-23T21:00:00.1234567890Z",
        "2026-11-23T21:00:00,5Z",
        "26-11-23T21:00:00Z",
        "2026-1-23T21:00:00Z",
        "-2026-11-23T21:00:00Z",
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(text); i++) {
        int64_t t_ns;
        if (wall_time_parse(text[i], &t_ns) == NULL)
            fail_msg("%s was taken", text[i]);
    }
    check("2028-02-29T00:00:00Z", INT64_C(1835395200000000000));
    check("2000-02-29T12:00:00Z", INT64_C(951825600000000000));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(known_times),
        cmocka_unit_test(times_are_those_of_the_calendar),
        cmocka_unit_test(what_is_no_time_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* tests/firmware/linux/commands/files/test_cmd_check.c - which violations slew check
 * shows. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "tests/support/check.h"
#include "tests/support/run_slew.h"

#include <limits.h>

#define KEYS  200
#define SHOWN 20 /* of one kind on one axis, as slew check --help says */

static const char rig[] =
    "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n"
    "  dolly:\n"
    "    unit: mm\n"
    "    limits: {position: [-9 mm, 9 mm], velocity: 999 mm/s,"
    " acceleration: 9999 mm/s2}\n"
    "    following_error: {floor: 2 mm, time: 20 ms}\n"
    "    drive: {kind: cia402, bus: can0, node: 1, counts: 4096 per mm}\n"
    "  lift:\n"
    "    unit: mm\n"
    "    limits: {position: [-9 mm, 9 mm], velocity: 999 mm/s,"
    " acceleration: 9999 mm/s2}\n"
    "    following_error: {floor: 2 mm, time: 20 ms}\n"
    "    drive: {kind: cia402, bus: can0, node: 2, counts: 4096 per mm}\n";

/* A peak at each second key, in both directions, its height different at each of them;
 * key k is that many thousandths too high, or too low. */
static unsigned height(unsigned k)
{
    return 1 + k * 37 % KEYS;
}

static void write_move(void)
{
    static char text[KEYS * 32];
    size_t used = 0;
    used += (size_t)snprintf(text, sizeof text,
                             "axes:\n  lift: {curve: quintic, keys: [[0 s, 0],"
                             " [1 s, 9.001], [2 s, 0]]}\n"
                             "  dolly:\n    curve: quintic\n    keys:\n");
    for (unsigned k = 0; k < KEYS; k++)
        used += (size_t)snprintf(
            text + used, sizeof text - used, "    - [%u s, %s%.3f]\n", k,
            k % 4 < 2 ? "" : "-",
            k % 2 == 0 || k == KEYS - 1 ? 0.0 : 9 + height(k) / 1000.0);
    run_write(run_path("move.yaml"), text);
}

/* Rows of an axis and kind, and the smallest height among them. */
static unsigned rows(const char *axis, const char *what, unsigned *least)
{
    unsigned count = 0;
    *least = UINT_MAX;
    for (const char *line = run_slew()->out; *line != '\0';
         line = strchr(line, '\n') + 1) {
        const size_t length = strcspn(line, "\n");
        const char *is = strstr(line, what);
        char name[32] = "";
        double t, value;
        if (is == NULL || is > line + length ||
            sscanf(line, "%31s %lf s %lf", name, &t, &value) != 3 ||
            strcmp(name, axis) != 0)
            continue;
        const unsigned k = (unsigned)(t + 0.5);
        *least = height(k) < *least ? height(k) : *least;
        count++;
    }
    return count;
}

/* Those beyond the highest are keys 1, 5, 9 ..., beyond the lowest 3, 7, 11 .... */
static unsigned heights_above(unsigned first, unsigned least)
{
    unsigned count = 0;
    for (unsigned k = first; k < KEYS - 1; k += 4)
        count += height(k) >= least ? 1 : 0;
    return count;
}

static void the_worst_of_each_kind_on_each_axis_are_shown(void **state)
{
    static const char *const what[] = { "above the highest",
                                        "below the lowest" };
    (void)state;
    assert_int_equal(run("check", run_path("rig.yaml"), run_path("move.yaml")),
                     1);
    for (unsigned i = 0; i < 2; i++) {
        char rest[128];
        unsigned least;
        assert_int_equal(rows("dolly", what[i], &least), SHOWN);
        assert_int_equal(heights_above(2 * i + 1, least), SHOWN);
        snprintf(rest, sizeof rest, "dolly: position %s, the worst %d of %u;",
                 what[i], SHOWN, heights_above(2 * i + 1, 0));
        assert_non_null(strstr(run_slew()->out, rest));
    }
    unsigned least;
    assert_int_equal(rows("lift", what[0], &least), 1);
    assert_null(strstr(run_slew()->out, "lift: "));
}

static void all_shows_each(void **state)
{
    unsigned least;
    (void)state;
    assert_int_equal(
        run("check", "--all", run_path("rig.yaml"), run_path("move.yaml")), 1);
    assert_int_equal(rows("dolly", "above the highest", &least),
                     heights_above(1, 0));
    assert_int_equal(rows("dolly", "below the lowest", &least),
                     heights_above(3, 0));
    assert_null(strstr(run_slew()->out, "the worst"));
}

static int open_all(void **state)
{
    if (run_open(state) < 0)
        return -1;
    run_write(run_path("rig.yaml"), rig);
    write_move();
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_worst_of_each_kind_on_each_axis_are_shown),
        cmocka_unit_test(all_shows_each),
    };
    return cmocka_run_group_tests(tests, open_all, run_close);
}

/* tests/firmware/host/fault/test_script_command.c - faults as they are typed. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/fault/script_command.h"
#include "firmware/linux/base/disk.h"
#include "tests/support/check.h"

static struct rig rig;
static struct fault_entry entry;
static char message[YAML_MESSAGE_MAX];

static int setup(void **state)
{
    (void)state;
    return rig_load(&disk_files, "examples/modbus/rig.yaml", &rig, message);
}

static int teardown(void **state)
{
    (void)state;
    rig_free(&rig);
    return 0;
}

static void what_is_typed_is_an_entry_of_a_script(void **state)
{
    static const struct {
        const char *line, *text;
        int64_t for_ns;
        bool by_position;
    } rows[] = {
        { "reboot pan", "reboot of pan", 0, false },
        { "  drive_fault   pan code 0x150 ", "drive_fault of pan, code 0x150",
          0, false },
        { "noise can1 rate 2 % for 5 s", "noise of can1, 2 % of the frames",
          5000000000, false },
        { "cut_cable line1 at 2 s", "cut_cable of line1", 0, false },
        { "obstacle dolly position 800 mm for 200 ms", "obstacle of dolly",
          200000000, true },
        { "encoder_jump dolly by -2 mm", "encoder_jump of dolly, by -2 mm", 0,
          false },
        { "loss focus rate 2 % direction to for 1 s",
          "loss of focus, 2 % of the frames, to it", 1000000000, false },
        { "loss pan rate 2 % direction from", "loss of pan, 2 % of the frames",
          0, false },
        { "jitter dolly delay 3 ms", "jitter of dolly, up to 3 ms", 0, false },
    };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(rows); i++) {
        char text[FAULT_TEXT_MAX];
        if (fault_script_command(rows[i].line, &rig, &entry, message) < 0)
            fail_msg("%s: %s", rows[i].line, message);
        assert_string_equal(fault_entry_text(&entry, &rig, text), rows[i].text);
        assert_int_equal(entry.for_ns, rows[i].for_ns);
        assert_int_equal(entry.by_position, rows[i].by_position);
        if (!entry.by_position) /* from now on, and not from an event */
            assert_int_equal(entry.after_ns,
                             strstr(rows[i].line, "at 2 s") ? 2000000000 : 0);
    }
}

static void what_cannot_be_is_said_in_a_sentence(void **state)
{
    static const struct {
        const char *line, *said;
    } rows[] = {
        { "", "does not say what it happens to" },
        { "reboot", "does not say what it happens to" },
        { "reboot nobody", "'nobody' is no axis, bus or gpio line" },
        { "explode pan", "explode" },
        { "encoder_jump dolly", "the fault has no by" },
        { "noise pan rate 2 %", "noise" },
        { "reboot pan, dolly", "brackets, quotes or commas" },
        { "reboot {pan}", "brackets, quotes or commas" },
        { "noise can1 rate 2 kg", "2 kg" },
        { "drive_fault pan code 0x150 code 0x151", "code" },
        { "echo dolly", "axis is not for echo" },
        { "noise can1 rate 2 % direction to", "which every node receives" },
        { "slow_drive dolly delay 2 ms direction up", "'up'" },
        { "reboot dolly direction to", "direction is not for reboot" },
    };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(rows); i++) {
        if (fault_script_command(rows[i].line, &rig, &entry, message) == 0)
            fail_msg("'%s' is taken", rows[i].line);
        if (strstr(message, rows[i].said) == NULL ||
            strncmp(message, "command:", 8) == 0 || strchr(message, '\n'))
            fail_msg("'%s': %s", rows[i].line, message);
    }
}

/* Of any length and any bytes. */
static void no_line_does_more_than_be_refused(void **state)
{
    static const char *const piece[] = { "reboot", "pan",      "at", " ",
                                         "2 s",    "%",        "\t", "for",
                                         "rate",   "position", "0x", "\xC3",
                                         "-" };
    char line[3 * FAULT_COMMAND_MAX];

    (void)state;
    seed_from("pieces of commands");
    for (unsigned n = 0; n < 3000; n++) {
        size_t length = 0;
        for (unsigned i = 0; i < n % 97; i++) {
            length += (size_t)snprintf(
                line + length, sizeof line - length, "%s%s",
                piece[draw_below(ARRAY_LEN(piece))], i % 3 == 0 ? " " : "");
        }
        line[length] = '\0';
        (void)fault_script_command(line, &rig, &entry, message);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_typed_is_an_entry_of_a_script),
        cmocka_unit_test(what_cannot_be_is_said_in_a_sentence),
        cmocka_unit_test(no_line_does_more_than_be_refused),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

/* tests/firmware/host/job/test_job_rig.c - what is said of a rig that is read,
 * and not refused. */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/job/job.h"
#include "firmware/linux/base/disk.h"
#include "tests/support/check.h"

#define EXAMPLE "examples/modbus/rig.yaml"
#define MAP     "map: leadshine-el7"
/* Beside the rig. */
#define ENDPOINTS "slew-endpoints.json"

/* The example, with another map. */
static void write_rig(const char *path, const char *map)
{
    static char text[65536];
    FILE *from = fopen(EXAMPLE, "r"), *to = fopen(path, "w");
    assert_non_null(from);
    assert_non_null(to);
    text[fread(text, 1, sizeof text - 1, from)] = 0;
    const char *at = strstr(text, MAP);
    assert_non_null(at);
    fprintf(to, "%.*smap: %s%s", (int)(at - text), text, map, at + strlen(MAP));
    fclose(from);
    assert_int_equal(fclose(to), 0);
}

static void an_unverified_map_is_said_when_the_rig_is_read(void **state)
{
    static const struct {
        const char *map, *said;
    } row[] = { { "oriental-az", "pan: the register map of \"Oriental Motor "
                                 "AZ\" is unverified" },
                { "delta-asda", "pan: the register map of \"Delta ASDA-A2 / "
                                "B2\" is unverified" },
                { "leadshine-el7", NULL } };
    char path[] = "/tmp/slew-rig-XXXXXX";
    const int file = mkstemp(path);
    (void)state;
    assert_true(file >= 0);
    close(file);
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        static struct rig rig;
        struct messages messages = { .text = NULL };
        enum message_kind kind = MESSAGE_ERROR;
        size_t at = 0;
        write_rig(path, row[i].map);
        assert_int_equal(job_read_rig(&disk_files, path, &rig, &messages),
                         STATUS_OK);
        const char *said;
        do
            said = messages_next(&messages, &at, &kind);
        while (said != NULL && strstr(said, "unverified") == NULL);
        if (row[i].said == NULL) {
            assert_null(said);
        } else {
            assert_non_null(said);
            assert_int_equal(kind, MESSAGE_WARNING);
            assert_non_null(strstr(said, row[i].said));
        }
        messages_free(&messages);
        rig_free(&rig);
    }
    unlink(path);
}

/* Two axes of a kind: `left`, with this drive, says what nothing watches;
 * `watched`, with the other one, nothing. */
static const struct {
    const char *bus, *left, *watched, *said;
} unsupervised[] = {
    { "{kind: canopen, bit_rate: 1 Mbit/s}",
      "kind: cia402, node: 1, counts: 1000 per mm, unsupervised: yes",
      "kind: cia402, node: 2, counts: 1000 per mm",
      "where its drive lacks 0x1016, 0x6007 or 0x6066" },
    { "{kind: modbus-rtu, device: /dev/ttyUSB0, baud: 115200}",
      "kind: modbus, node: 1, map: leadshine-el7, counts: 1000 per mm, "
      "unsupervised: yes",
      "kind: modbus, node: 2, map: lexium-32, counts: 1000 per mm",
      "its register map has no watchdog" },
    { "{kind: can, bit_rate: 1 Mbit/s}",
      "kind: odrive, node: 1, turns: 1 per mm, unsupervised: yes",
      "kind: odrive, node: 2, turns: 1 per mm, endpoints: " ENDPOINTS,
      "slew does not set its watchdog" },
    { "{kind: modbus-rtu, device: /dev/ttyUSB0, baud: 115200}",
      "kind: slew-mcu, node: 1, axis: 0, servo: 3, map: leadshine-el7, "
      "counts: 1000 per mm, unsupervised: yes",
      "kind: slew-mcu, node: 1, axis: 1", "the register map of its servo" },
};

static void copy_endpoints(void)
{
    static char text[65536];
    FILE *from = fopen("examples/odrive/endpoints.json", "r");
    FILE *to = fopen("/tmp/" ENDPOINTS, "w");
    assert_non_null(from);
    assert_non_null(to);
    assert_int_equal(fwrite(text, 1, fread(text, 1, sizeof text, from), to) > 0,
                     1);
    fclose(from);
    assert_int_equal(fclose(to), 0);
}

static void write_axis(FILE *to, const char *name, const char *drive)
{
    fprintf(to,
            "  %s:\n    unit: mm\n    limits: {position: [0 mm, 10 mm], "
            "velocity: 1 mm/s, acceleration: 10 mm/s2}\n"
            "    following_error: {floor: 5 mm, time: 300 ms}\n"
            "    drive: {bus: line, %s}\n",
            name, drive);
}

static void what_is_unsupervised_is_said_in_words_of_its_kind(void **state)
{
    char path[] = "/tmp/slew-rig-XXXXXX";
    const int file = mkstemp(path);
    (void)state;
    assert_true(file >= 0);
    close(file);
    copy_endpoints();
    for (size_t i = 0; i < ARRAY_LEN(unsupervised); i++) {
        static struct rig rig;
        struct messages messages = { .text = NULL };
        enum message_kind kind = MESSAGE_ERROR;
        size_t at = 0;
        FILE *to = fopen(path, "w");
        assert_non_null(to);
        fprintf(to, "title: Two\nbuses:\n  line: %s\naxes:\n",
                unsupervised[i].bus);
        write_axis(to, "left", unsupervised[i].left);
        write_axis(to, "watched", unsupervised[i].watched);
        assert_int_equal(fclose(to), 0);
        const enum status status =
            job_read_rig(&disk_files, path, &rig, &messages);
        const char *said = messages_next(&messages, &at, &kind);
        if (said == NULL)
            fail_msg("row %zu: nothing is said", i);
        if (status != STATUS_OK || kind != MESSAGE_WARNING ||
            strstr(said, ": left is unsupervised: ") == NULL ||
            strstr(said, unsupervised[i].said) == NULL)
            fail_msg("row %zu: %s", i, said);
        while ((said = messages_next(&messages, &at, &kind)) != NULL)
            assert_null(strstr(said, "watched is"));
        messages_free(&messages);
        rig_free(&rig);
    }
    unlink("/tmp/" ENDPOINTS);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_unverified_map_is_said_when_the_rig_is_read),
        cmocka_unit_test(what_is_unsupervised_is_said_in_words_of_its_kind),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

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
        const char *said = messages_next(&messages, &at, &kind);
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_unverified_map_is_said_when_the_rig_is_read),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

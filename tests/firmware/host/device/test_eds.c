/* tests/firmware/host/device/test_eds.c - data sheets: what is read, what is
 * refused, and whether the simulated drive's own says that it will do. */
#define _XOPEN_SOURCE 700 /* mkstemp */
#include "firmware/linux/base/disk.h"
#include "tests/support/check.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/device/eds.h"
#include "sim/device/cia402/servo.h"

static struct eds eds;
static char path[64], message[EDS_MESSAGE_MAX];

static FILE *scratch(void)
{
    snprintf(path, sizeof path, "/tmp/slew-eds-XXXXXX");
    const int fd = mkstemp(path);

    assert_true(fd >= 0);
    return fdopen(fd, "wb");
}

static int load_text(const char *text)
{
    FILE *file = scratch();
    int err;

    fputs(text, file);
    fclose(file);
    err = eds_load(&disk_files, path, &eds, message);
    unlink(path);
    return err;
}

static void objects_are_read_as_written(void **state)
{
    const struct eds_object *object;

    (void)state;
    assert_int_equal(
        load_text("; a comment\r\n[DeviceInfo]\nVendorName = A maker \n"
                  "ProductName=Servo\n[DummyUsage]\nDummy0005=1\n"
                  "[1400]\nParameterName=RPDO\nObjectType=9\nSubNumber=2\n"
                  "[1400sub0]\nDataType=0x5\nAccessType=ro\nDefaultValue=1\n"
                  "[1400Sub1]\nDataType=0x0007\nAccessType=rw\n"
                  "DefaultValue=$NODEID+0x200\n[607a]\nParameterName=Target\n"
                  "DataType=4\nAccessType=rww\nPDOMapping=1\n"
                  "DefaultValue=-5\nParameterValue=-7\n[6502]\nDataType=7\n"
                  "AccessType=const\nDefaultValue=0x80"),
        0);
    assert_string_equal(eds.vendor, "A maker");
    assert_string_equal(eds.product, "Servo");
    object = eds_find(&eds, 0x1400, 1);
    assert_non_null(object);
    assert_true(object->adds_node && object->has_value && object->writable);
    assert_int_equal(object->value, 0x200);
    object = eds_find(&eds, 0x1400, 0);
    assert_non_null(object);
    assert_true(object->is_sub && object->readable && !object->writable);
    object = eds_find(&eds, 0x607A, 0);
    assert_non_null(object);
    assert_true(object->mappable && object->writable);
    assert_int_equal((int32_t)object->value, -7); /* a DCF's own */
    assert_string_equal(object->name, "Target");
    assert_int_equal(eds_find(&eds, 0x6502, 0)->value, 0x80);
    assert_null(eds_find(&eds, 0x607A, 1));
    assert_null(eds_find(&eds, 0x6040, 0));
}

static void what_is_wrong_is_named_with_its_line(void **state)
{
    static const struct {
        const char *text, *want;
    } row[] = {
        { "", ":0: no objects" },
        { "[DeviceInfo]\n", ":1: no objects" },
        { "[1000\n", ":1: a section without its end" },
        { "[1000]\nDataType\n", ":2: neither a section nor a key" },
        { "[1000]\nDataType=0x7\nDefaultValue=0x1FFFFFFFF\n",
          ":3: not a number" },
        { "[1000]\nDataType=seven\n", ":2: not a number" },
        { "[1000]\nDataType=7\nDefaultValue=12 V\n", ":3: not a number" },
        { "[1000]\n[1018]\n[1000]\n", ":3: the object is there already" },
    };
    char *line = malloc(2000);

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        assert_int_equal(load_text(row[i].text), -1);
        if (strstr(message, row[i].want) == NULL)
            fail_msg("%zu: %s", i, message);
    }
    assert_non_null(line);
    memset(line, 'x', 1999);
    line[1999] = '\0';
    assert_int_equal(load_text(line), -1);
    assert_non_null(strstr(message, ":1: the line is too long"));
    free(line);
    assert_int_equal(eds_load(&disk_files, "/nowhere/servo.eds", &eds, message),
                     -1);
}

static void more_objects_than_there_is_room_for_are_refused(void **state)
{
    FILE *file = scratch();

    (void)state;
    for (unsigned i = 0; i <= EDS_OBJECTS_MAX; i++)
        fprintf(file, "[%04X]\n", i);
    fclose(file);
    assert_int_equal(eds_load(&disk_files, path, &eds, message), -1);
    unlink(path);
    assert_non_null(strstr(message, "too many objects"));
}

static void the_simulated_drives_own_is_read(void **state)
{
    FILE *file = scratch();

    (void)state;
    sim_cia402_write_eds(file);
    fclose(file);
    assert_int_equal(eds_load(&disk_files, path, &eds, message), 0);
    unlink(path);
    assert_true(eds.count > 200);
    assert_int_equal(eds_find(&eds, 0x1000, 0)->value, 0x20192);
    assert_true(eds_find(&eds, 0x607A, 0)->mappable);
    assert_true(eds_find(&eds, 0x1400, 1)->adds_node);
    assert_int_equal(eds_find(&eds, 0x1018, 2)->value, 402);
    assert_null(eds_find(&eds, 0x0005, 0));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(objects_are_read_as_written),
        cmocka_unit_test(what_is_wrong_is_named_with_its_line),
        cmocka_unit_test(more_objects_than_there_is_room_for_are_refused),
        cmocka_unit_test(the_simulated_drives_own_is_read),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

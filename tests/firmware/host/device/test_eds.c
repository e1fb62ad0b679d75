/* tests/firmware/host/device/test_eds.c - data sheets: what is read, what is
 * refused, and whether the simulated drive's own says that it will do. */
#define _XOPEN_SOURCE 700 /* mkstemp */
#include "firmware/linux/base/disk.h"
#include "tests/support/check.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/device/eds_need.h"
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
    assert_int_equal(eds.warnings, 0);
    eds_free(&eds);
}

static void what_is_no_data_sheet_is_refused(void **state)
{
    static const struct {
        const char *text, *want;
    } row[] = {
        { "", ": no objects, expected sections such as [1000]" },
        { "[DeviceInfo]\nVendorName=A\n", ": no objects" },
        { "DataType=7\n", ": no objects" },
        { "\x1A[1000]\n", ": no objects" },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        assert_int_equal(load_text(row[i].text), -1);
        eds_free(&eds);
        if (strstr(message, row[i].want) == NULL)
            fail_msg("%zu: %s", i, message);
    }
    assert_int_equal(eds_load(&disk_files, "/nowhere/servo.eds", &eds, message),
                     -1);
    assert_non_null(strstr(message, "No such file"));
    eds_free(&eds);
    FILE *file = scratch();
    fwrite("[1000]\n\0", 1, 8, file);
    fclose(file);
    assert_int_equal(eds_load(&disk_files, path, &eds, message), -1);
    assert_non_null(strstr(message, "a NUL byte"));
    eds_free(&eds);
    unlink(path);
}

#define U32  "[2000]\nDataType=7\nAccessType=rw\n"
#define I16  "[2000]\nDataType=3\nAccessType=rw\n"
#define U8   "[2000]\nDataType=5\nAccessType=rw\n"
#define U64  "[2000]\nDataType=0x1B\nAccessType=rw\n"
#define NONE INT64_MIN

/* What of [2000] a file gives, and what is said of it. */
static const struct {
    const char *text, *warning; /* NULL: none */
    unsigned line;
    int64_t value;
    bool adds_node;
} odd[] = {
    { U32 "DefaultValue=0x1F", NULL, 0, 0x1F, false },
    { U32 "DefaultValue= 12 ; metres", NULL, 0, 12, false },
    { U32 "DefaultValue=12;", NULL, 0, 12, false },
    { "[2000]\nDefaultValue=37\nAccessType=rw\nDataType=0x0007 ; u32\n", NULL,
      0, 37, false },
    { "\xEF\xBB\xBF" U32 "DefaultValue=7", NULL, 0, 7, false },
    { "; B\xF6hm\n" U32 "DefaultValue=7", NULL, 0, 7, false },
    { "[2000]\rDataType=7\rAccessType=rw\rDefaultValue=7", NULL, 0, 7, false },
    { U32 "DefaultValue=0x200+$NODEID", NULL, 0, 0x200, true },
    { U32 "DefaultValue=$nodeid + 0x200", NULL, 0, 0x200, true },
    { U32 "DefaultValue=$NODEID", NULL, 0, 0, true },
    { U32 "DefaultValue=007", NULL, 0, 7, false },
    { U32 "DefaultValue=00", NULL, 0, 0, false },
    { U32 "DefaultValue=", NULL, 0, NONE, false },
    { U32 "DefaultValue=4294967295", NULL, 0, 4294967295, false },
    { I16 "DefaultValue=0xFFFF", NULL, 0, -1, false },
    { I16 "DefaultValue=-32768", NULL, 0, -32768, false },
    { U64 "DefaultValue=0xFFFFFFFFFFFFFFFF", NULL, 0, -1, false },
    { "[2000]\nDataType=0xA0\nAccessType=ro\nDefaultValue=3\n[A0]\n"
      "[A0sub1]\nDefaultValue=6\n",
      NULL, 0, 3, false },
    { "[2000]\nDataType=9\nAccessType=ro\nDefaultValue=any text", NULL, 0, NONE,
      false },
    { "[2000]\nObjectType=2\nAccessType=rw", NULL, 0, NONE, false },
    { U32 "DefaultValue=0.0", "2000: DefaultValue '0.0' is no number", 4, NONE,
      false },
    { U32 "DefaultValue=010", "'010' is no number", 4, NONE, false },
    { U32 "DefaultValue=12 V", "'12 V' is no number", 4, NONE, false },
    { U32 "DefaultValue=-1", "'-1' is no number", 4, NONE, false },
    { U32 "DefaultValue=0x1FFFFFFFF", "is no number", 4, NONE, false },
    { U32 "DefaultValue=0x1FFFFFFFFFFFFFFFF", "is no number", 4, NONE, false },
    { U32 "DefaultValue=$NODEID-1", "is no number", 4, NONE, false },
    { U32 "DefaultValue=0x200$NODEID", "is no number", 4, NONE, false },
    { U32 "DefaultValue=1\nParameterValue=x", "ParameterValue 'x'", 5, NONE,
      false },
    { U8 "DefaultValue=256", "'256' is no number", 4, NONE, false },
    { U8 "LowLimit=-1", "LowLimit '-1' is no number", 4, NONE, false },
    { U8 "HighLimit=$NODEID+1", "HighLimit '$NODEID+1'", 4, NONE, false },
    { "[2000]\nDataType=seven\nAccessType=rw\nDefaultValue=1",
      "DataType 'seven' cannot be read", 2, NONE, false },
    { "[2000]\nDataType=0xA0\nAccessType=rw\n",
      "DataType '0xA0' is not described", 2, NONE, false },
    { "[2000]\nDataType=7\nAccessType=r/w\nDefaultValue=5",
      "AccessType 'r/w' is none of ro,", 3, 5, false },
    { "[2000]\nDataType=7\nDefaultValue=5", "2000 has no AccessType", 1, 5,
      false },
    { "[2000]\nAccessType=rw\n", "2000 has no DataType", 1, NONE, false },
    { U32 "PDOMapping=yes\nDefaultValue=5", "PDOMapping 'yes'", 4, 5, false },
    { U32 "DefaultValue=5\n[2000]\nDefaultValue=6",
      "'2000' is a section that is there already", 5, 6, false },
    { U32 "DefaultValue=5\nDefaultValue=6",
      "'DefaultValue' is a key that is there already", 5, 6, false },
    { U32 "DefaultValue=5\nall of this", "'all of this' is neither", 5, 5,
      false },
    { U32 "DefaultValue=5\n[2001\n", "'2001' is a section without its ]", 5, 5,
      false },
    { U32 "DefaultValue=5\n[3000sub1]\nAccessType=ro\nDataType=5\n"
          "[3000sub01]\nAccessType=ro\nDataType=5\n",
      "3000:1 is an object that is there already", 8, 5, false },
    { U32 "DefaultValue=5\n[3000]\nObjectType=8\nCompactSubObj=0\n",
      "3000 has no entries", 5, 5, false },
    { U32 "DefaultValue=5\n[3000]\nObjectType=8\nCompactSubObj=many\n"
          "DataType=7\nAccessType=rw",
      "CompactSubObj 'many' cannot be read", 7, 5, false },
};

static void what_is_odd_is_no_value_and_a_warning(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(odd); i++) {
        if (load_text(odd[i].text) < 0)
            fail_msg("%zu: %s", i, message);
        const struct eds_object *object = eds_find(&eds, 0x2000, 0);
        assert_non_null(object);
        if (object->has_value != (odd[i].value != NONE) ||
            (object->has_value && object->value != odd[i].value) ||
            (object->has_value && object->adds_node != odd[i].adds_node))
            fail_msg("%zu: value %" PRId64, i, object->value);
        if ((eds.warnings > 0) != (odd[i].warning != NULL) ||
            (eds.warnings > 0 &&
             (strstr(eds.warning[0].text, odd[i].warning) == NULL ||
              eds.warning[0].line != odd[i].line)))
            fail_msg("%zu: %u: %s", i,
                     eds.warnings > 0 ? eds.warning[0].line : 0,
                     eds.warnings > 0 ? eds.warning[0].text : "no warning");
        eds_free(&eds);
    }
}

static void limits_are_those_of_the_type(void **state)
{
    static const struct {
        unsigned type;
        const char *low, *high;
        int64_t want_low, want_high;
    } row[] = {
        { 3, "0x8000", "0x7FFF", -32768, 32767 },
        { 4, "-5", "0xFFFFFFFF", -5, -1 },
        { 7, "0", "0xFFFFFFFF", 0, 4294967295 },
        { 0x15, "0x8000000000000000", "9223372036854775807", INT64_MIN,
          INT64_MAX },
        { 0x16, "1", "0xFFFFFF", 1, 0xFFFFFF },
    };
    char text[200];

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        snprintf(text, sizeof text,
                 "[2000]\nLowLimit=%s\nHighLimit=%s\nAccessType=rw\n"
                 "DataType=%u\n",
                 row[i].low, row[i].high, row[i].type);
        assert_int_equal(load_text(text), 0);
        const struct eds_object *object = eds_find(&eds, 0x2000, 0);
        assert_true(object->has_low && object->has_high);
        assert_int_equal(object->low, row[i].want_low);
        assert_int_equal(object->high, row[i].want_high);
        assert_int_equal(eds.warnings, 0);
        eds_free(&eds);
    }
}

static void what_is_compact_is_written_out(void **state)
{
    const struct eds_object *object;

    (void)state;
    assert_int_equal(
        load_text("[DeviceInfo]\nNrOfRXPDO=2\nNrOfTXPDO=1\nCompactPDO=0x13\n"
                  "[1016]\nParameterName=Consumer\nObjectType=8\nDataType=7\n"
                  "AccessType=rw\nCompactSubObj=3\nDefaultValue=0\n"
                  "[1016sub2]\nDataType=7\nAccessType=ro\n"
                  "[1016Name]\nNrOfEntries=1\n1=First\n"
                  "[1016Value]\nNrOfEntries=1\n3=0x50000\n"
                  "[1400]\nObjectType=9\nSubNumber=2\n"
                  "[1400sub1]\nDataType=7\nAccessType=const\n"),
        0);
    assert_int_equal(eds.warnings, 0);
    assert_int_equal(eds_find(&eds, 0x1016, 0)->value, 3);
    assert_false(eds_find(&eds, 0x1016, 0)->writable);
    object = eds_find(&eds, 0x1016, 1);
    assert_true(object->readable && object->writable && object->type == 7);
    assert_string_equal(object->name, "First");
    assert_false(eds_find(&eds, 0x1016, 2)->writable); /* its own section's */
    assert_int_equal(eds_find(&eds, 0x1016, 3)->value, 0x50000);
    assert_string_equal(eds_find(&eds, 0x1016, 3)->name, "Consumer");
    assert_null(eds_find(&eds, 0x1016, 4));
    /* 1400 is there already and counts: of two PDOs one is left */
    assert_false(eds_find(&eds, 0x1400, 1)->writable);
    object = eds_find(&eds, 0x1401, 1);
    assert_true(object->writable && object->adds_node);
    assert_int_equal(object->value, 0x300);
    assert_non_null(eds_find(&eds, 0x1401, 5));
    assert_null(eds_find(&eds, 0x1401, 3)); /* not in the mask */
    assert_true(eds_find(&eds, 0x1600, 0)->writable);
    assert_true(eds_find(&eds, 0x1601, 8)->writable);
    assert_null(eds_find(&eds, 0x1402, 1));
    assert_int_equal(eds_find(&eds, 0x1800, 1)->value, 0x180);
    assert_null(eds_find(&eds, 0x1801, 1));
    eds_free(&eds);
}

static void only_what_is_needed_refuses_a_drive(void **state)
{
    static const struct {
        const char *text, *lacks;
    } row[] = {
        { "[6040]\nDataType=6\nAccessType=rww\nPDOMapping=0x1\n", NULL },
        { "[6040]\nDataType=6\nAccessType=rww\nPDOMapping=2\n", NULL },
        { "[6040]\nDataType=6\nAccessType=rww\nPDOMapping=yes\n",
          "has no PDOMapping that can be read" },
        { "[6040]\nDataType=6\nAccessType=rww\n", "cannot be mapped" },
        { "[6040]\nDataType=?\nAccessType=?\nPDOMapping=1\nDefaultValue=?\n",
          NULL }, /* it is only mapped */
        { "[6041]\nDataType=6\nAccessType=?\nPDOMapping=1\n",
          "has no AccessType that can be read" },
        { "[6041]\nDataType=6\nAccessType=wo\nPDOMapping=1\n",
          "cannot be read" },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        assert_int_equal(load_text(row[i].text), 0);
        const char *lacks = NULL;
        for (unsigned k = 0; k < eds_need_count; k++)
            if (eds_needs[k].index == eds.object[0].index)
                lacks = eds_lacks(&eds, &eds_needs[k], eds_needs[k].index);
        if ((lacks == NULL) != (row[i].lacks == NULL) ||
            (lacks != NULL && strcmp(lacks, row[i].lacks) != 0))
            fail_msg("%zu: %s", i, lacks != NULL ? lacks : "will do");
        eds_free(&eds);
    }
}

static void more_objects_than_there_is_room_for_are_refused(void **state)
{
    FILE *file = scratch();

    (void)state;
    for (unsigned i = 0; i < 1 + EDS_OBJECTS_MAX / 255; i++)
        fprintf(file, "[%04X]\nDataType=7\nAccessType=rw\nCompactSubObj=254\n",
                i);
    fclose(file);
    assert_int_equal(eds_load(&disk_files, path, &eds, message), -1);
    eds_free(&eds);
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
    assert_int_equal(eds.warnings, 0);
    eds_free(&eds);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(objects_are_read_as_written),
        cmocka_unit_test(what_is_no_data_sheet_is_refused),
        cmocka_unit_test(what_is_odd_is_no_value_and_a_warning),
        cmocka_unit_test(limits_are_those_of_the_type),
        cmocka_unit_test(what_is_compact_is_written_out),
        cmocka_unit_test(only_what_is_needed_refuses_a_drive),
        cmocka_unit_test(more_objects_than_there_is_room_for_are_refused),
        cmocka_unit_test(the_simulated_drives_own_is_read),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

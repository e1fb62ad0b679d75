/* tests/firmware/host/rig/sim/test_quirks.c - files of quirks: those that come with
 * slew, those of a rig, wrong ones, and what slew drive info says of them. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "firmware/linux/base/disk.h"
#include "tests/firmware/linux/machine/two_drives.h"

#include "firmware/host/rig/rig.h"
#include "firmware/linux/commands/drive/verbs.h"

static struct quirk_file file;
static struct rig rig;
static char message[YAML_MESSAGE_MAX];

static int load_text(const char *text)
{
    run_put("servo.yaml", text);
    return quirk_load(&disk_files, run_path("servo.yaml"), &file, message);
}

/* ---- files --------------------------------------------------------------- */

static void every_key_is_read(void **state)
{
    const struct drive_cia402_quirk *quirk = &file.quirk;

    (void)state;
    if (load_text("title: Acme\n"
                  "vendor: 0x5A\n"
                  "vendor_ignore: 0xFF000000\n"
                  "products: [1, 0x10]\n"
                  "mode: ip\n"
                  "guarding: yes\n"
                  "homing_without_bit_10: yes\n"
                  "times: {sdo: 1 s, state: 2 s, brake: 3 s, precharge: 4 s}\n"
                  "options: {quick_stop: 6, disable: 0}\n"
                  "parameters: {3006:3D: 0x1 u16, 6065: 7}\n"
                  "fixed: {6066: 0}\n"
                  "notes: [one, two]\n") < 0)
        fail_msg("%s", message);
    assert_string_equal(file.title, "Acme");
    assert_int_equal(quirk->vendor, 0x5A);
    assert_int_equal(quirk->vendor_ignore, 0xFF000000);
    assert_int_equal(quirk->product_count, 2);
    assert_int_equal(quirk->product[1], 16);
    assert_true(quirk->interpolates);
    assert_true(quirk->guarding);
    assert_true(quirk->homing_without_bit_10);
    assert_int_equal(quirk->sdo_timeout_ns, 1000000000);
    assert_int_equal(quirk->state_timeout_ns, 2000000000);
    assert_int_equal(quirk->brake_timeout_ns, 3000000000);
    assert_int_equal(quirk->precharge_timeout_ns, 4000000000);
    assert_true(quirk->option[DRIVE_CIA402_QUICK_STOP].given);
    assert_int_equal(quirk->option[DRIVE_CIA402_QUICK_STOP].value, 6);
    assert_false(quirk->option[DRIVE_CIA402_FAULT].given);
    assert_int_equal(quirk->parameter_count, 2);
    assert_int_equal(quirk->parameter[0].index, 0x3006);
    assert_int_equal(quirk->parameter[0].sub, 0x3D);
    assert_int_equal(quirk->parameter[0].size, 2);
    assert_int_equal(quirk->fixed_count, 1);
    assert_int_equal(quirk->fixed[0].index, 0x6066);
    assert_int_equal(file.note_count, 2);
    assert_string_equal(file.note[1], "two");
}

static const struct {
    const char *text, *want;
} wrong[] = {
    { "vendor: 1", "servo.yaml:1:1: the quirks has no 'title'" },
    { "title: a\nvendors: 1", "did you mean 'vendor'" },
    { "title: a\nvendor: 0", "vendor '0' is not in 1 .. 4294967295" },
    { "title: a\nvendor: maxon", "'maxon' is not a whole number" },
    { "title: a\nproducts: [1]", "products is given without vendor" },
    { "title: a\nvendor: 1\nproducts: 1",
      "expected a list of 1 .. 8 numbers in 0x1018:2" },
    { "title: a\nvendor: 1\nproducts: [1,2,3,4,5,6,7,8,9]", "1 .. 8" },
    { "title: a\nvendor: 3\nvendor_ignore: 1", "has bits of vendor" },
    { "title: a\nmode: csv", "unknown mode 'csv'" },
    { "title: a\nguarding: 20 ms", "guarding '20 ms'" },
    { "title: a\ntimes: {boot: 8 s}", "unknown key 'boot'" },
    { "title: a\ntimes: {sdo: 1 min}", "out of range" },
    { "title: a\noptions: {quick_stop: 0}", "the axis would coast" },
    { "title: a\noptions: {halt: 0}", "the axis would coast" },
    { "title: a\nparameters: {6007: 0}", "is set by slew itself" },
    { "title: a\nparameters: {1016:1: 0}", "is set by slew itself" },
    { "title: a\nparameters: {1400:1: 0}", "is set by slew itself" },
    { "title: a\nparameters: {3006: 5}", "has no known type" },
    { "title: a\nparameters: {6065: 5, 6065:0: 6}", "is there already" },
    { "title: a\nfixed: {605A: 7}", "fixed has 0x605A, which slew sets" },
    { "title: a\nfixed: {607D:1: 0}", "fixed has 0x607D, which slew sets" },
    { "title: a\nfixed: {6007: 0}", "is set by slew itself" },
    { "title: a\nunsupervised: yes", "unknown key 'unsupervised'" },
    { "title: a\nnotes: one", "expected a list of 1 .. 8 texts" },
    { "[]", "expected a map with title, vendor" },
};

static void what_is_wrong_in_a_file_is_told(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(wrong); i++) {
        if (load_text(wrong[i].text) == 0)
            fail_msg("%s: was taken", wrong[i].text);
        if (strstr(message, wrong[i].want) == NULL ||
            strstr(message, "servo.yaml:") == NULL)
            fail_msg("%s: %s", wrong[i].text, message);
    }
}

/* ---- by identity --------------------------------------------------------- */

static const struct quirk_set *own(void)
{
    const struct quirk_set *set = quirk_own(&disk_files, message);

    if (set == NULL)
        fail_msg("%s", message);
    return set;
}

static const char *name_of(uint32_t vendor, uint32_t product)
{
    const struct quirk_set *set = own();
    const struct drive_cia402_quirk *quirk =
        drive_cia402_quirk_find(set->quirk, set->count, vendor, product);

    return quirk == NULL ? "" : set->name[quirk - set->quirk];
}

static void those_of_slew_are_found_by_vendor_and_product(void **state)
{
    (void)state;
    assert_string_equal(name_of(0xFB, 0x65520000), "maxon-epos4");
    assert_string_equal(name_of(0xFB, 0x61500000), "maxon-epos4");
    assert_string_equal(name_of(0xFB, 0x64200000), "maxon-epos2");
    assert_string_equal(name_of(0xFB, 1), "");
    assert_string_equal(name_of(0x1DD, 0x10305070), "delta-asda-a2");
    assert_string_equal(name_of(0x1DD, 0x6080), "delta-asda-a3");
    assert_string_equal(name_of(0x4321, 77), "leadshine");
    assert_string_equal(name_of(0, 0), "");
    assert_string_equal(name_of(0, 402), "");
}

/* Whatever the order of the files. */
static void two_files_of_slew_are_never_of_one_drive(void **state)
{
    const struct quirk_set *set = own();

    (void)state;
    assert_true(set->count >= 14);
    for (unsigned i = 0; i < set->count; i++)
        for (unsigned k = 0; k < set->count; k++)
            for (unsigned n = 0; i != k && n < set->quirk[k].product_count; n++)
                assert_false(set->quirk[i].product_count > 0 &&
                             drive_cia402_quirk_is_of(
                                 &set->quirk[i], set->quirk[k].vendor,
                                 set->quirk[k].product[n]));
}

static void a_product_goes_before_its_vendor_in_any_order(void **state)
{
    const struct drive_cia402_quirk one = { .vendor = 5,
                                            .product = { 7 },
                                            .product_count = 1 };
    const struct drive_cia402_quirk all = { .vendor = 5,
                                            .vendor_ignore = 0xFF000000 };
    const struct drive_cia402_quirk up[] = { one, all }, down[] = { all, one };

    (void)state;
    assert_ptr_equal(drive_cia402_quirk_find(up, 2, 5, 7), &up[0]);
    assert_ptr_equal(drive_cia402_quirk_find(down, 2, 5, 7), &down[1]);
    assert_ptr_equal(drive_cia402_quirk_find(up, 2, 5, 8), &up[1]);
    assert_ptr_equal(drive_cia402_quirk_find(up, 2, 0x02000005, 7), &up[1]);
    assert_null(drive_cia402_quirk_find(up, 2, 6, 7));
    assert_null(drive_cia402_quirk_find(up, 0, 5, 7));
}

/* ---- in a rig ------------------------------------------------------------ */

static int load_rig(const char *of_slide)
{
    two_drives_put(of_slide, 10, "");
    return rig_load(&disk_files, run_path("rig.yaml"), &rig, message);
}

static void a_rig_names_a_file_or_one_of_slew(void **state)
{
    unsigned count;

    (void)state;
    assert_int_equal(load_text("title: a\nvendor: 9\nmode: ip"), 0);
    if (load_rig("") < 0)
        fail_msg("%s", message);
    assert_ptr_equal(rig_quirks(&rig, &rig.axis[0].cia402, &count),
                     own()->quirk);
    assert_int_equal(count, own()->count);
    if (load_rig(", quirks: servo.yaml") < 0)
        fail_msg("%s", message);
    assert_int_equal(rig_quirks(&rig, &rig.axis[0].cia402, &count)->vendor, 9);
    assert_int_equal(count, 1);
    if (load_rig(", quirks: jvl-mis") < 0)
        fail_msg("%s", message);
    assert_true(rig.quirk[0].homing_without_bit_10);
    assert_int_equal(rig_guard_ns(&rig, &rig.axis[0].cia402), 0);
    if (load_rig(", quirks: delta-asda-a2") < 0)
        fail_msg("%s", message);
    assert_int_equal(rig_guard_ns(&rig, &rig.axis[0].cia402), 50000000);
    assert_int_equal(load_rig(", quirks: nobody"), -1);
    if (strstr(message, "rig.yaml:9:") == NULL ||
        strstr(message, ": quirks 'nobody' is no file of quirks") == NULL)
        fail_msg("%s", message);
    assert_int_equal(load_rig(", quirks: nobody.yaml"), -1);
    assert_int_equal(load_text("title: a\nmode: pp"), -1);
    assert_int_equal(load_rig(", quirks: servo.yaml"), -1);
    assert_non_null(strstr(message, "servo.yaml:2:7: unknown mode 'pp'"));
}

/* ---- slew drive info ----------------------------------------------------- */

static void info_says_them(void **state)
{
    (void)state;
    assert_int_equal(load_text("title: Acme 5\n"
                               "vendor: 9\nproducts: [8]\n"
                               "guarding: yes\n"
                               "times: {brake: 8 s}\n"
                               "options: {disable: 0}\n"
                               "parameters: {6065: 7}\n"
                               "fixed: {6066: 0}\n"
                               "notes: [mind the gap]\n"),
                     0);
    two_drives_put(", quirks: servo.yaml", 10, "");
    run("drive", "info", run_path("rig.yaml"), "slide");
    run_expect(STATUS_OK);
    run_says("quirks of Acme 5 (");
    run_says("servo.yaml):\n  node guarding takes the place of heartbeats\n");
    run_says("  slew waits 8000 ms for its brake\n");
    run_says("  0x605C:00 is set to 0\n");
    run_says("  0x6065:00 is set to 0x7\n");
    run_says("  0x6066:00 is not written, and must be 0x0\n");
    run_says("  note: mind the gap\n");
    run("drive", "info", "--json", run_path("rig.yaml"), "slide");
    run_expect(STATUS_OK);
    run_says("\"title\":\t\"Acme 5\"");
    run_says("\"notes\":\t[\"mind the gap\"]");
}

static void info_says_when_the_drive_is_another(void **state)
{
    static struct drive_quirks quirks;

    (void)state;
    assert_int_equal(load_text("title: a\nvendor: 9\nproducts: [8]"), 0);
    assert_int_equal(load_rig(", quirks: servo.yaml"), 0);
    assert_int_equal(
        drive_quirks_find(&rig, &rig.axis[0], 9, 8, &quirks, message), 0);
    assert_false(quirks.is_of_another);
    assert_int_equal(
        drive_quirks_find(&rig, &rig.axis[0], 9, 7, &quirks, message), 0);
    assert_true(quirks.is_of_another);
    assert_int_equal(
        drive_quirks_find(NULL, NULL, 0xFB, 0x61500000, &quirks, message), 0);
    assert_string_equal(quirks.file.title, "maxon EPOS4");
    assert_int_equal(quirks.line_count, 1);
    assert_int_equal(drive_quirks_find(NULL, NULL, 0, 402, &quirks, message),
                     0);
    assert_null(quirks.quirk);
}

/* A simulated drive is the one that the rig names. */
static void a_rig_with_quirks_is_simulated(void **state)
{
    static const char *const named[] = { "maxon-epos4", "maxon-epos2",
                                         "delta-asda-a2", "jvl-mis" };
    char text[512];

    (void)state;
    run_put("move.yaml", "axes: {slide: {keys: [[0 s, 10 mm], [2 s, 60]]}}\n");
    for (size_t i = 0; i < ARRAY_LEN(named); i++) {
        snprintf(text, sizeof text,
                 "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
                 "axes:\n"
                 "  slide:\n"
                 "    unit: mm\n"
                 "    limits: {position: [-5, 600], velocity: 400, "
                 "acceleration: 800}\n"
                 "    following_error: {floor: 2, time: 20 ms}\n"
                 "    drive: {kind: cia402, bus: can0, node: 3, counts: 4096 "
                 "per mm, quirks: %s}\n",
                 named[i]);
        run_put("rig.yaml", text);
        run("run", run_path("rig.yaml"), run_path("move.yaml"));
        run_expect(STATUS_OK);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_key_is_read),
        cmocka_unit_test(what_is_wrong_in_a_file_is_told),
        cmocka_unit_test(those_of_slew_are_found_by_vendor_and_product),
        cmocka_unit_test(two_files_of_slew_are_never_of_one_drive),
        cmocka_unit_test(a_product_goes_before_its_vendor_in_any_order),
        cmocka_unit_test(a_rig_names_a_file_or_one_of_slew),
        cmocka_unit_test(info_says_them),
        cmocka_unit_test(info_says_when_the_drive_is_another),
        cmocka_unit_test(a_rig_with_quirks_is_simulated),
    };
    return cmocka_run_group_tests_name("quirks", tests, run_open, run_close);
}

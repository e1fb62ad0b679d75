/* tests/firmware/linux/fmu/test_fmu_export.c - what is exported can be unpacked
 * and simulated where the rig's own files are not. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "firmware/linux/fmu/fmu_export.h"

#include <ftw.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include <zip.h>

#include "firmware/host/base/memory.h"
#include "firmware/linux/fmu/fmu_model.h"
#include "tests/support/check.h"

#define FILE_MAX (1 << 22)

static char directory[] = "/tmp/slew-fmu-XXXXXX";
static char unit[sizeof directory + 16];

static int setup(void **state)
{
    (void)state;
    if (mkdtemp(directory) == NULL)
        return -1;
    snprintf(unit, sizeof unit, "%s/unit.fmu", directory);
    return 0;
}

static int remove_one(const char *path, const struct stat *status, int type,
                      struct FTW *at)
{
    (void)status, (void)type, (void)at;
    return remove(path);
}

static int teardown(void **state)
{
    (void)state;
    return nftw(directory, remove_one, 8, FTW_DEPTH | FTW_PHYS);
}

static void exported(const char *rig, int version)
{
    char message[FMU_EXPORT_MESSAGE] = "";
    struct fmu_files files = { 0 };
    struct fmu_model *const model = memory_new(1, sizeof *model);
    FILE *const file = fopen(unit, "wb");

    assert_non_null(file);
    fmu_files_record(&files, rig);
    assert_int_equal(fmu_model_init(model, &files.files, rig), 0);
    if (fmu_export(&model->rig, &files, version, file, message) < 0)
        fail_msg("%s", message);
    assert_int_equal(fclose(file), 0);
    fmu_model_free(model);
    memory_free(model);
    fmu_files_free(&files);
}

/* A file of the archive, with a 0 behind it; NULL: there is none. */
static char *unpacked(const char *name, size_t *size)
{
    zip_t *const zip = zip_open(unit, ZIP_RDONLY, NULL);
    assert_non_null(zip);
    zip_file_t *const file = zip_fopen(zip, name, 0);
    char *bytes = NULL;
    if (file != NULL) {
        bytes = memory_new(FILE_MAX + 1, 1);
        const zip_int64_t got = zip_fread(file, bytes, FILE_MAX);
        assert_true(got > 0);
        *size = (size_t)got;
        zip_fclose(file);
    }
    zip_discard(zip);
    return bytes;
}

/* The resources, beside each other in the directory. */
static void unpack_resources(void)
{
    zip_t *const zip = zip_open(unit, ZIP_RDONLY, NULL);
    const zip_int64_t count = zip_get_num_entries(zip, 0);
    for (zip_int64_t i = 0; i < count; i++) {
        const char *const name = zip_get_name(zip, (zip_uint64_t)i, 0);
        char path[sizeof directory + 64];
        size_t size = 0;
        if (strncmp(name, "resources/", 10) != 0)
            continue;
        char *const bytes = unpacked(name, &size);
        snprintf(path, sizeof path, "%s/%s", directory, name + 10);
        FILE *const file = fopen(path, "wb");
        assert_non_null(file);
        fwrite(bytes, 1, size, file);
        fclose(file);
        memory_free(bytes);
    }
    zip_discard(zip);
}

/* An ODrive's list of endpoints, a bus with FD, quirk files: all of it is found again,
 * from a directory where none of it is. */
static void a_rig_is_read_back_from_the_unit_alone(void **state)
{
    char before[4096];
    struct fmu_files files = { 0 };
    struct fmu_model *const model = memory_new(1, sizeof *model);
    (void)state;
    exported("examples/odrive/rig.yaml", 3);
    unpack_resources();
    assert_non_null(getcwd(before, sizeof before));
    assert_int_equal(chdir(directory), 0);
    assert_int_equal(fmu_files_open(&files, directory), 0);
    const int read = fmu_model_init(model, &files.files, fmu_files_rig(&files));
    const int begun = read == 0 ? fmu_model_start(model) : -1;
    assert_int_equal(chdir(before), 0);
    if (begun < 0)
        fail_msg("%s", model->message);
    assert_int_equal(model->rig.axis_count, 2);
    fmu_model_free(model);
    memory_free(model);
    fmu_files_free(&files);
}

static void the_token_is_in_description_and_resources(void **state)
{
    size_t size;
    (void)state;
    for (int version = 2; version <= 3; version++) {
        char want[FMU_TOKEN_MAX + 32];
        exported("tests/data/fmu/rig.yaml", version);
        char *const list = unpacked("resources/" FMU_LIST, &size);
        char *const about = unpacked("modelDescription.xml", &size);
        char *const binary =
            unpacked(version == 2 ? "binaries/linux64/slew_rig.so"
                                  : "binaries/x86_64-linux/slew_rig.so",
                     &size);
        assert_int_equal(strncmp(list, "token\t", 6), 0);
        snprintf(want, sizeof want, "%s=\"%.*s\"",
                 version == 2 ? "guid" : "instantiationToken",
                 (int)strcspn(list + 6, "\t\n"), list + 6);
        assert_non_null(strstr(about, want));
#ifdef __x86_64__
        assert_non_null(binary);
        assert_int_equal(memcmp(binary,
                                "\x7f"
                                "ELF",
                                4),
                         0);
#endif
        memory_free(list);
        memory_free(about);
        memory_free(binary);
    }
}

static void the_same_rig_gives_the_same_bytes(void **state)
{
    char *bytes[2];
    long size[2];
    (void)state;
    for (unsigned i = 0; i < 2; i++) {
        exported("tests/data/fmu/rig.yaml", 3);
        FILE *const file = fopen(unit, "rb");
        bytes[i] = memory_new(FILE_MAX, 1);
        size[i] = (long)fread(bytes[i], 1, FILE_MAX, file);
        fclose(file);
    }
    assert_true(size[0] == size[1] && size[0] > 100000);
    assert_int_equal(memcmp(bytes[0], bytes[1], (size_t)size[0]), 0);
    memory_free(bytes[0]);
    memory_free(bytes[1]);
}

static void a_directory_that_is_none_of_a_unit_is_refused(void **state)
{
    struct fmu_files files = { 0 };
    (void)state;
    assert_int_equal(fmu_files_open(&files, "/"), -1);
    fmu_files_free(&files);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_rig_is_read_back_from_the_unit_alone),
        cmocka_unit_test(the_token_is_in_description_and_resources),
        cmocka_unit_test(the_same_rig_gives_the_same_bytes),
        cmocka_unit_test(a_directory_that_is_none_of_a_unit_is_refused),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

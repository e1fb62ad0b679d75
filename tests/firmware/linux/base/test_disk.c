/* tests/firmware/linux/base/test_disk.c - files of this machine: by path, from a
 * pipe, and those that come with slew. */
#define _XOPEN_SOURCE 700 /* mkstemp */
#include "firmware/linux/base/disk.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "tests/support/check.h"

static const struct files *const disk = &disk_files;

static void bytes_are_read_from_any_place(void **state)
{
    char path[] = "/tmp/test_disk_XXXXXX", byte[8];
    const int made = mkstemp(path);

    (void)state;
    assert_int_equal(write(made, "0123456789", 10), 10);
    close(made);
    const int file = disk->open(disk, path);
    assert_true(file >= 0);
    assert_int_equal(disk->size(disk, file), 10);
    assert_int_equal(disk->read(disk, file, byte, 3, 6), 3);
    assert_memory_equal(byte, "678", 3);
    assert_int_equal(disk->read(disk, file, byte, 8, 1), 8);
    assert_memory_equal(byte, "12345678", 8);
    assert_int_equal(disk->read(disk, file, byte, 8, 9), 1);
    assert_int_equal(disk->read(disk, file, byte, 8, 10), 0);
    disk->close(disk, file);
    unlink(path);
    assert_int_equal(disk->open(disk, path), -ENOENT);
}

/* As with slew check <(...) MOVE. */
static void a_pipe_is_read_to_its_end(void **state)
{
    static char text[40000];
    char path[32], *data;
    int ends[2];

    (void)state;
    memset(text, 'p', sizeof text);
    assert_int_equal(pipe(ends), 0);
    assert_int_equal(write(ends[1], text, sizeof text), sizeof text);
    close(ends[1]);
    snprintf(path, sizeof path, "/dev/fd/%d", ends[0]);
    assert_int_equal(files_load(disk, path, sizeof text, &data), sizeof text);
    assert_memory_equal(data, text, sizeof text);
    free(data);
    close(ends[0]);
}

static void a_directory_is_no_file(void **state)
{
    char *data;

    (void)state;
    assert_int_equal(files_load(disk, "examples", 100, &data), -EISDIR);
    assert_null(data);
}

static void those_of_slew_are_found_by_name(void **state)
{
    static char name[FILES_NAMES_MAX][FILES_NAME_MAX];
    char path[FILES_PATH_MAX], *data;
    const unsigned count = disk->names(disk, FILES_MAPS, name);

    (void)state;
    assert_true(count > 0 && count < FILES_NAMES_MAX);
    for (unsigned i = 0; i < count; i++) {
        assert_true(i == 0 || strcmp(name[i - 1], name[i]) < 0);
        assert_true(disk->find(disk, FILES_MAPS, name[i], "", path));
        assert_true(files_load(disk, path, 100000, &data) > 100);
        free(data);
    }
    assert_false(disk->find(disk, FILES_MAPS, "none-such", "", path));
    assert_int_equal(disk->names(disk, "hal/none", name), 0);
}

static void a_path_counts_from_the_file_that_names_it(void **state)
{
    char path[FILES_PATH_MAX];

    (void)state;
    assert_true(disk->find(disk, FILES_MAPS, "rig.yaml",
                           "examples/dolly/move.yaml", path));
    assert_string_equal(path, "examples/dolly/rig.yaml");
    assert_false(disk->find(disk, FILES_MAPS, "rig.yaml", "rig.yaml", path));
    assert_false(disk->find(disk, FILES_MAPS, "/rig.yaml",
                            "examples/dolly/move.yaml", path));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bytes_are_read_from_any_place),
        cmocka_unit_test(a_pipe_is_read_to_its_end),
        cmocka_unit_test(a_directory_is_no_file),
        cmocka_unit_test(those_of_slew_are_found_by_name),
        cmocka_unit_test(a_path_counts_from_the_file_that_names_it),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

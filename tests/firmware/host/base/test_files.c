/* tests/firmware/host/base/test_files.c - files that are in memory alone, read
 * whole and line by line, and a rig and a move made of them. */
#include "firmware/host/base/files.h"

#include <errno.h>
#include <string.h>

#include "firmware/host/job/job.h"
#include "tests/support/check.h"

/* --- files without a disk --- */

struct memory {
    struct files files; /* first: files is the memory */
    struct memory_file {
        const char *name, *text;
        size_t length;
    } file[4];
    size_t piece;    /* at most so many bytes per read; 0: all */
    int64_t fail_at; /* EIO from there on; 0: never */
    int open;        /* at present */
};

static struct memory *memory_of(const struct files *files)
{
    return (struct memory *)files;
}

static int memory_open(const struct files *files, const char *path)
{
    struct memory *self = memory_of(files);
    for (size_t i = 0; i < ARRAY_LEN(self->file); i++)
        if (self->file[i].name != NULL && strcmp(self->file[i].name, path) == 0)
            return self->open++, (int)i;
    return -ENOENT;
}

static void memory_close(const struct files *files, int file)
{
    (void)file;
    memory_of(files)->open--;
}

static int64_t memory_read(const struct files *files, int file, void *to,
                           size_t size, uint64_t offset)
{
    const struct memory *self = memory_of(files);
    const struct memory_file *of = &self->file[file];
    if (self->fail_at > 0 && offset >= (uint64_t)self->fail_at)
        return -EIO;
    assert_true(size > 0);
    size_t left = offset < of->length ? of->length - (size_t)offset : 0;
    left = left < size ? left : size;
    left = self->piece > 0 && self->piece < left ? self->piece : left;
    memcpy(to, of->text + offset, left);
    return (int64_t)left;
}

static int64_t memory_size(const struct files *files, int file)
{
    return (int64_t)memory_of(files)->file[file].length;
}

/* A register map is where its name says; no quirks. */
static bool memory_find(const struct files *files, const char *kind,
                        const char *name, const char *beside,
                        char path[FILES_PATH_MAX])
{
    (void)files;
    (void)beside;
    return snprintf(path, FILES_PATH_MAX, "%s/%s", kind, name) > 0;
}

static unsigned memory_names(const struct files *files, const char *kind,
                             char name[FILES_NAMES_MAX][FILES_NAME_MAX])
{
    (void)files;
    (void)kind;
    (void)name;
    return 0;
}

static struct memory memory_with(const char *name, const char *text,
                                 size_t length)
{
    return (struct memory){
        .files = { .open = memory_open,
                   .close = memory_close,
                   .read = memory_read,
                   .size = memory_size,
                   .find = memory_find,
                   .names = memory_names },
        .file = { { name, text, length } },
    };
}

/* --- whole --- */

static char many[100000];

static int64_t loaded(const struct memory *memory, size_t max)
{
    char *data;
    const int64_t length = files_load(&memory->files, "a", max, &data);
    if (length < 0)
        assert_null(data);
    else if (memcmp(data, memory->file[0].text, (size_t)length) != 0 ||
             data[length] != 0)
        fail_msg("%d bytes are others", (int)length);
    free(data);
    assert_int_equal(memory->open, 0);
    return length;
}

static void a_file_is_read_up_to_a_bound(void **state)
{
    static const size_t lengths[] = {
        0, 1, FILES_PIECE - 1, FILES_PIECE, FILES_PIECE + 1, 99999
    };
    (void)state;
    for (size_t i = 0; i < sizeof many; i++)
        many[i] = (char)('a' + i % 23);
    for (size_t i = 0; i < ARRAY_LEN(lengths); i++)
        for (size_t piece = 0; piece < 8000; piece += 777) {
            struct memory memory = memory_with("a", many, lengths[i]);
            memory.piece = piece;
            assert_int_equal(loaded(&memory, lengths[i]), lengths[i]);
            assert_int_equal(loaded(&memory, sizeof many), lengths[i]);
            if (lengths[i] > 0)
                assert_int_equal(loaded(&memory, lengths[i] - 1), -EFBIG);
        }
}

static void what_cannot_be_read_has_a_reason(void **state)
{
    struct memory memory = memory_with("b", many, 10);
    (void)state;
    assert_int_equal(loaded(&memory, 100), -ENOENT);
    memory = memory_with("a", many, 60000);
    memory.fail_at = 30000;
    memory.piece = 1000;
    assert_int_equal(loaded(&memory, 100000), -EIO);
}

/* --- line by line --- */

static void lines_are_those_of_the_file(void **state)
{
    static const char text[] = "one\n\nthree\r\nlast";
    static const char *const want[] = { "one", "", "three\r", "last" };
    (void)state;
    for (size_t piece = 0; piece < 7; piece++) {
        struct memory memory = memory_with("a", text, sizeof text - 1);
        struct files_lines lines;
        memory.piece = piece;
        assert_int_equal(files_lines_open(&lines, &memory.files, "a"), 0);
        for (size_t i = 0; i < ARRAY_LEN(want); i++) {
            assert_int_equal(files_lines_next(&lines), strlen(want[i]));
            assert_string_equal(lines.line, want[i]);
        }
        assert_int_equal(files_lines_next(&lines), -1);
        assert_int_equal(lines.error, 0);
        files_lines_close(&lines);
        assert_int_equal(memory.open, 0);
    }
}

static void the_last_line_may_have_its_end(void **state)
{
    struct memory memory = memory_with("a", "x\n", 2);
    struct files_lines lines;
    (void)state;
    assert_int_equal(files_lines_open(&lines, &memory.files, "a"), 0);
    assert_int_equal(files_lines_next(&lines), 1);
    assert_int_equal(files_lines_next(&lines), -1);
    files_lines_close(&lines);
    assert_int_equal(files_lines_open(&lines, &memory.files, "b"), -ENOENT);
}

static void a_line_has_a_bound_and_a_failure_a_reason(void **state)
{
    static char line[FILES_LINE_MAX + 3];
    struct files_lines lines;
    struct memory memory;
    (void)state;
    memset(line, 'x', sizeof line);
    line[FILES_LINE_MAX] = '\n';
    memory = memory_with("a", line, FILES_LINE_MAX + 1);
    assert_int_equal(files_lines_open(&lines, &memory.files, "a"), 0);
    assert_int_equal(files_lines_next(&lines), FILES_LINE_MAX);
    files_lines_close(&lines);
    line[FILES_LINE_MAX] = 'x';
    memory = memory_with("a", line, FILES_LINE_MAX + 1);
    assert_int_equal(files_lines_open(&lines, &memory.files, "a"), 0);
    assert_int_equal(files_lines_next(&lines), -1);
    assert_int_equal(lines.error, -EFBIG);
    files_lines_close(&lines);
    memory.fail_at = 50000;
    memory.piece = 1000;
    assert_int_equal(files_lines_open(&lines, &memory.files, "a"), 0);
    assert_int_equal(files_lines_next(&lines), -1);
    assert_int_equal(lines.error, -EIO);
    files_lines_close(&lines);
}

/* --- what is made of them --- */

static const char rig_text[] =
    "title: one\nbuses: {can: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n"
    "  pan:\n"
    "    unit: deg\n"
    "    limits: {position: [-170 deg, 170 deg], velocity: 60 deg/s,\n"
    "             acceleration: 120 deg/s2, jerk: 600 deg/s3}\n"
    "    stop: {acceleration: 240 deg/s2, jerk: 2400 deg/s3}\n"
    "    following_error: {floor: 0.5 deg, time: 20 ms}\n"
    "    drive: {kind: cia402, bus: can, node: 1, counts: 10000 per rev}\n";
static const char move_text[] = "axes:\n  pan:\n    curve: quintic\n    keys:\n"
                                "      - [0 s, 0 deg]\n"
                                "      - [4 s, 30 deg]\n";

static void a_rig_and_a_move_need_no_disk(void **state)
{
    static struct job job;
    struct memory memory = memory_with("rig", rig_text, sizeof rig_text - 1);
    size_t at = 0;
    enum message_kind kind;
    (void)state;
    memory.file[1] =
        (struct memory_file){ "move", move_text, sizeof move_text - 1 };
    if (job_open(&job, &memory.files, "rig", "move", false, NULL) != STATUS_OK)
        fail_msg("%s", messages_next(&job.messages, &at, &kind));
    assert_int_equal(job.end_ns_q12, INT64_C(4000000000) * 4096);
    assert_int_equal(memory.open, 0);
    job_free(&job);
    assert_int_equal(job_open(&job, &memory.files, "rig", "other", false, NULL),
                     STATUS_INPUT);
    assert_string_equal(
        messages_next(&job.messages, &at, &kind),
        "other:1:1: the file cannot be read (No such file or directory), "
        "expected a YAML file");
    assert_int_equal(kind, MESSAGE_ERROR);
    assert_null(messages_next(&job.messages, &at, &kind));
    job_free(&job);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_file_is_read_up_to_a_bound),
        cmocka_unit_test(what_cannot_be_read_has_a_reason),
        cmocka_unit_test(lines_are_those_of_the_file),
        cmocka_unit_test(the_last_line_may_have_its_end),
        cmocka_unit_test(a_line_has_a_bound_and_a_failure_a_reason),
        cmocka_unit_test(a_rig_and_a_move_need_no_disk),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

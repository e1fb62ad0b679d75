/* tests/firmware/studio/server/test_document.c - files that are edited elsewhere. */
#define _XOPEN_SOURCE 700 /* mkdtemp */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <errno.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/host/base/array.h"
#include "firmware/studio/server/document.h"

static char path[] = "/tmp/documentXXXXXX";

static void put(const char *text)
{
    FILE *file = fopen(path, "w");
    fputs(text, file);
    fclose(file);
}

static void holds(const char *text)
{
    char tag[DOCUMENT_TAG], *data;
    assert_int_equal(document_read(path, &data, tag), strlen(text));
    assert_string_equal(data, text);
    free(data);
}

static void a_text_is_written_over_what_it_was_made_of(void **state)
{
    char tag[DOCUMENT_TAG], next[DOCUMENT_TAG], *data;
    struct stat status;

    (void)state;
    put("one");
    assert_int_equal(chmod(path, 0640), 0);
    assert_int_equal(document_read(path, &data, tag), 3);
    free(data);
    assert_int_equal(document_write(path, "two!", 4, tag, next), 0);
    holds("two!");
    assert_int_equal(stat(path, &status), 0);
    assert_int_equal(status.st_mode & 0777, 0640);
    /* the same bytes again are another text than the first */
    assert_int_equal(document_write(path, "three", 5, tag, next), -EEXIST);
    holds("two!");
    assert_int_equal(document_write(path, "three", 5, next, next), 0);
    holds("three");
}

static void what_cannot_be_written_stays(void **state)
{
    char tag[DOCUMENT_TAG] = "";

    (void)state;
    assert_int_equal(
        document_write("/nonexistent/move.yaml", "x", 1, "\"\"", tag), -ENOENT);
    assert_int_not_equal(access("/nonexistent/move.yaml.partial", F_OK), 0);
}

/* In the folder that is made for it; every file but `want` holds a secret. */
static const struct {
    const char *name, *rig, *move;
    bool want;
} names[] = {
    { "d/other.yaml", "d/rig.yaml", "d/move.yaml", true },
    { "d/eds/x.eds", "d/rig.yaml", NULL, true },
    { "m/other.yaml", "d/rig.yaml", "m/move.yaml", true },
    { "other.yaml", "rig.yaml", NULL, true },
    { "d/inside.yaml", "d/rig.yaml", NULL, true }, /* a link to d/other.yaml */
    { "d/outside.yaml", "d/rig.yaml", NULL, false },   /* one to e/other.yaml */
    { "d/out/other.yaml", "d/rig.yaml", NULL, false }, /* d/out leads to e */
    { "d/fifo.yaml", "d/rig.yaml", NULL, false },
    { "d/eds", "d/rig.yaml", NULL, false },
    { "d/none.yaml", "d/rig.yaml", NULL, false },
    { "/etc/passwd.yaml", "rig.yaml", NULL, false },
    { "e/other.yaml", "d/rig.yaml", "d/move.yaml", false },
    { "d/../e/other.yaml", "d/rig.yaml", NULL, false },
    { "../e.yaml", "rig.yaml", NULL, false },
    { "d/.hidden.yaml", "d/rig.yaml", NULL, false },
    { "d/.git/x.yaml", "d/rig.yaml", NULL, false },
    { "d/token", "d/rig.yaml", NULL, false },
    { "d/key.pem", "d/rig.yaml", NULL, false },
};

static void a_page_sees_what_stands_beside_its_files(void **state)
{
    static const char make[] =
        "mkdir -p d/eds d/.git m e && for f in rig.yaml move.yaml other.yaml "
        "d/rig.yaml d/move.yaml d/other.yaml d/eds/x.eds d/.hidden.yaml "
        "d/.git/x.yaml d/token d/key.pem m/move.yaml m/other.yaml "
        "e/other.yaml; do echo $f >$f; done && ln -s other.yaml d/inside.yaml "
        "&& ln -s ../e/other.yaml d/outside.yaml && ln -s ../e d/out && "
        "mkfifo d/fifo.yaml";
    char folder[] = "/tmp/documentsXXXXXX", line[64];

    (void)state;
    assert_non_null(mkdtemp(folder));
    assert_int_equal(chdir(folder), 0);
    assert_int_equal(system(make), 0);
    for (size_t i = 0; i < ARRAY_LEN(names); i++) {
        char tag[DOCUMENT_TAG], *data = NULL;
        const bool seen = document_read_beside(names[i].name, names[i].rig,
                                               names[i].move, &data, tag) > 0;
        if (seen != names[i].want)
            fail_msg("%s", names[i].name);
        free(data);
    }
    assert_int_equal(chdir("/"), 0);
    snprintf(line, sizeof line, "rm -r %s", folder);
    assert_int_equal(system(line), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_text_is_written_over_what_it_was_made_of),
        cmocka_unit_test(what_cannot_be_written_stays),
        cmocka_unit_test(a_page_sees_what_stands_beside_its_files),
    };
    close(mkstemp(path));
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    return failed;
}

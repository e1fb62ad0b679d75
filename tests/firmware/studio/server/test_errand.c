/* tests/firmware/studio/server/test_errand.c - what a request wants of the disk is
 * done beside whoever waits, who may be gone at any time. */
#define _XOPEN_SOURCE 700 /* mkdtemp */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "firmware/host/base/memory.h"
#include "firmware/studio/server/errand.h"
#include "tests/support/check.h"

static char folder[] = "/tmp/errandXXXXXX", path[64];

static int make_folder(void **state)
{
    (void)state;
    if (mkdtemp(folder) == NULL)
        return -1;
    snprintf(path, sizeof path, "%s/move.yaml", folder);
    FILE *file = fopen(path, "w");
    return file == NULL || fputs("one", file) < 0 || fclose(file) != 0;
}

static int clear_folder(void **state)
{
    char line[64];
    (void)state;
    snprintf(line, sizeof line, "rm -r %s", folder);
    return system(line);
}

static struct errand *with_body(struct errand *errand, const char *body)
{
    errand->length = strlen(body);
    errand->body = memory_new(errand->length + 1, 1);
    memcpy(errand->body, body, errand->length);
    return errand;
}

static int64_t outcome_of(struct errand *errand)
{
    errand_start(errand);
    while (!errand_is_done(errand))
        nanosleep(&(struct timespec){ .tv_nsec = 100000 }, NULL);
    return errand->outcome;
}

static void an_errand_has_what_the_disk_says(void **state)
{
    struct errand *read = errand_new(ERRAND_READ, path);
    struct errand *write = errand_new(ERRAND_WRITE, path);
    struct errand *again = errand_new(ERRAND_WRITE, path);
    struct errand *keep = errand_new(ERRAND_KEEP, path);
    struct errand *takes = errand_new(ERRAND_TAKES, path);
    struct errand *beside = errand_new(ERRAND_BESIDE, path);
    (void)state;
    assert_int_equal(outcome_of(read), 3);
    assert_string_equal(read->data, "one");
    memcpy(write->tag, read->tag, sizeof write->tag);
    memcpy(again->tag, read->tag, sizeof again->tag);
    assert_int_equal(outcome_of(with_body(write, "two!")), 0);
    assert_int_equal(outcome_of(with_body(again, "three")), -EEXIST);
    assert_string_equal(again->tag, write->tag);
    snprintf(keep->name, sizeof keep->name, "a.csv");
    assert_int_equal(outcome_of(with_body(keep, "t\n")), 0);
    assert_int_equal(outcome_of(takes), 0);
    assert_int_equal(
        cJSON_GetArraySize(cJSON_GetObjectItem(takes->list, "takes")), 1);
    snprintf(beside->name, sizeof beside->name, "%s/none.yaml", folder);
    assert_int_equal(outcome_of(beside), -ENOENT);
    struct errand *const all[] = { read, write, again, keep, takes, beside };
    for (size_t i = 0; i < ARRAY_LEN(all); i++)
        errand_leave(all[i]);
}

/* Before it is done, after it, and just then. */
static void whoever_waits_may_leave(void **state)
{
    (void)state;
    for (int i = 0; i < 400; i++) {
        struct errand *errand = errand_new(ERRAND_READ, path);
        errand_start(errand);
        nanosleep(&(struct timespec){ .tv_nsec = i * 1000 }, NULL);
        errand_leave(errand);
    }
    nanosleep(&(struct timespec){ .tv_nsec = 200000000 }, NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_errand_has_what_the_disk_says),
        cmocka_unit_test(whoever_waits_may_leave),
    };
    return cmocka_run_group_tests(tests, make_folder, clear_folder);
}

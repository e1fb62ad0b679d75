/* tests/firmware/linux/batch/test_batch_table.c - results as lines of CSV. */
#include "firmware/linux/batch/batch_table.h"

#include <string.h>

#include "firmware/linux/base/disk.h"
#include "tests/support/check.h"

#define HEAD "batch,run,of,pan.mass,end,fault\n"

static struct batch_table table;
static char message[BATCH_TABLE_MESSAGE];

static int teardown(void **state)
{
    (void)state;
    batch_table_free(&table);
    return 0;
}

/* A file in memory. */
static const char *text_of_file;

static int text_open(const struct files *files, const char *name)
{
    (void)files, (void)name;
    return 3;
}

static void text_close(const struct files *files, int file)
{
    (void)files, (void)file;
}

static int64_t text_read(const struct files *files, int file, void *to,
                         size_t size, uint64_t offset)
{
    const size_t left = strlen(text_of_file) - offset;
    const size_t part = left < size ? left : size;
    (void)files, (void)file;
    memcpy(to, text_of_file + offset, part);
    return (int64_t)part;
}

static int add(const char *text, uint64_t *whole)
{
    const struct files files = { .open = text_open,
                                 .close = text_close,
                                 .read = text_read };
    text_of_file = text;
    return batch_table_read(&table, &files, "t.csv", whole, message);
}

static void runs_are_sorted_and_written_as_they_were(void **state)
{
    char *text = NULL;
    size_t size = 0;
    uint64_t whole;
    (void)state;
    assert_int_equal(add(HEAD "b1,10,11,1.5,done,\n"
                              "b1,9,11,0.5,\"a \"\"b\"\", c\",x\n",
                         &whole),
                     0);
    assert_int_equal(batch_table_sort(&table), -1);
    assert_int_equal(table.row[0].run, 9);
    assert_string_equal(table.row[0].cell[4], "a \"b\", c");
    assert_string_equal(table.row[1].cell[5], "");
    FILE *const file = open_memstream(&text, &size);
    batch_table_write(&table, file);
    fclose(file);
    assert_string_equal(text, HEAD "b1,9,11,0.5,\"a \"\"b\"\", c\",x\n"
                                   "b1,10,11,1.5,done,\n");
    free(text);
}

static void a_line_that_a_kill_cut_is_left_out(void **state)
{
    static const char *const cut[] = { "b", "b1,2,3,1,done", "b1,2,3,1,\"do" };
    uint64_t whole;
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(cut); i++) {
        char text[200];
        snprintf(text, sizeof text, HEAD "b1,1,3,1,done,\n%s", cut[i]);
        assert_int_equal(add(text, &whole), 0);
        assert_int_equal(table.rows, 1);
        assert_int_equal(whole, strlen(text) - strlen(cut[i]));
        batch_table_free(&table);
    }
}

static void another_batch_is_not_mixed_in(void **state)
{
    static const struct {
        const char *text, *why;
    } rows[] = {
        { "a,b,c,d\n", "t.csv:1: other columns" },
        { HEAD "b2,2,3,1,done,\n", "t.csv:2: is a run of another batch" },
        { HEAD "b1,3,4,1,done,\n", "t.csv:2: is a run of another batch" },
        { HEAD "b1,x,3,1,done,\n", "t.csv:2: is no run" },
        { HEAD "b1,2,3,1,done\n", "t.csv:2: is no run" },
        { HEAD "b1,2,3,1,done,,\n", "t.csv:2: is no run" },
        { HEAD "b1,3,3,1,done,\n", "t.csv:2: is no run" },
    };
    uint64_t whole;
    (void)state;
    assert_int_equal(add(HEAD "b1,1,3,1,done,\n", &whole), 0);
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        assert_int_equal(add(rows[i].text, &whole), -1);
        if (strncmp(message, rows[i].why, strlen(rows[i].why)) != 0)
            fail_msg("row %zu: %s", i, message);
        if (table.rows > 1) { /* the line that was judged */
            batch_table_free(&table);
            assert_int_equal(add(HEAD "b1,1,3,1,done,\n", &whole), 0);
        }
    }
    batch_table_free(&table);
    assert_int_equal(add("t,x\n1,2\n", &whole), -1);
    assert_non_null(strstr(message, "expected the results of a batch"));
}

static void a_run_that_is_there_twice_is_named(void **state)
{
    uint64_t whole;
    (void)state;
    assert_int_equal(add(HEAD "b1,2,3,1,done,\nb1,0,3,1,done,\n", &whole), 0);
    assert_int_equal(add(HEAD "b1,2,3,1,done,\n", &whole), 0);
    assert_int_equal(batch_table_sort(&table), 2);
}

static void a_cell_is_quoted_where_it_has_to_be(void **state)
{
    char cell[BATCH_CELL_MAX];
    (void)state;
    assert_string_equal(batch_cell(cell, "plain"), "plain");
    assert_string_equal(batch_cell(cell, "a, \"b\"\nc"), "\"a, \"\"b\"\" c\"");
    char text[2 * BATCH_CELL_MAX];
    memset(text, '"', sizeof text - 1);
    text[sizeof text - 1] = '\0';
    assert_true(strlen(batch_cell(cell, text)) < BATCH_CELL_MAX);
}

int main(void)
{
#define CLAIM(name) cmocka_unit_test_teardown(name, teardown)
    const struct CMUnitTest tests[] = {
        CLAIM(runs_are_sorted_and_written_as_they_were),
        CLAIM(a_line_that_a_kill_cut_is_left_out),
        CLAIM(another_batch_is_not_mixed_in),
        CLAIM(a_run_that_is_there_twice_is_named),
        CLAIM(a_cell_is_quoted_where_it_has_to_be),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* tests/firmware/host/recording/test_response.c - recordings as they come, and
 * those that are none. */
#include "firmware/host/recording/response.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "firmware/linux/base/disk.h"
#include "tests/support/check.h"

static char path[32];
static struct response response;
static char message[RESPONSE_MESSAGE_MAX];

static int read_text(const char *text, const char *column)
{
    strcpy(path, "/tmp/response_XXXXXX");
    const int file = mkstemp(path);

    if (file < 0 || write(file, text, strlen(text)) < 0 || close(file) < 0)
        fail_msg("no file %s", path);
    const int err =
        response_read(&disk_files, path, column, &response, message);
    remove(path);
    return err;
}

static void expect(const char *text, const char *column, double t, double x)
{
    if (read_text(text, column) < 0)
        fail_msg("%s", message);
    assert_int_equal(response.rows, 2);
    if (response.t_s[1] != t || response.x[1] != x)
        fail_msg("%g %g, expected %g %g", response.t_s[1], response.x[1], t, x);
    response_free(&response);
}

static void every_form_is_read(void **state)
{
    (void)state;
    expect("0,1\n0.5,-2e-3\n", NULL, 0.5, -2e-3);
    expect("# by hand\r\n\r\nt; x\r\n0; 1\r\n0.5; 2\r\n", NULL, 0.5, 2);
    expect("time_ms\tset\ttip\n0\t1\t2\n500\t3\t4", NULL, 0.5, 3);
    expect("time_ms,set,tip\n0,1,2\n500,3,4", "tip", 0.5, 4);
    expect("t_us tip\n0 1\n500000 7\n", "tip", 0.5, 7);
    expect("t_s,word,tip\n0,on,2\n0.5,off,4\n", "tip", 0.5, 4);
    expect("t,a,tip\n0,,2\n0.5,,4\n", "tip", 0.5, 4);
    expect("\xEF\xBB\xBF\"t_ms\";\"the tip\"\r\n\"0\";\"2\"\r\n"
           "\"500\";\"4\"\r\n",
           "the tip", 0.5, 4);
}

static void refuse(const char *text, const char *column, const char *want)
{
    if (read_text(text, column) == 0)
        fail_msg("accepted: %s", text);
    if (strstr(message, want) == NULL || strchr(message, '\n') != NULL)
        fail_msg("got %s\nwant %s", message, want);
    response_free(&response);
}

static void bad_rows_are_told_by_their_line(void **state)
{
    (void)state;
    refuse("0,1\n0.5,x\n", NULL, ":2: expected a time and a number");
    refuse("0,1\n0.5\n", NULL, ":2: expected a time and a number");
    refuse("0,1\n0.5,nan\n", NULL, ":2: expected a time and a number");
    refuse("0,1\n0.5,1e999\n", NULL, ":2: expected a time and a number");
    refuse("0,1\n0,2\n", NULL, ":2: the time is not later");
    refuse("t,x\n0,1\n0.5,1\n", "tip",
           ":1: --axis: no column 'tip' behind the time in 't,x'");
    refuse("0,1\n0.5,1\n", "tip", ":1: there is no header");
    refuse("t\n0\n", NULL, ":2: expected a time and a number");
    assert_int_equal(
        response_read(&disk_files, "/nowhere.csv", NULL, &response, message),
        -1);
    assert_non_null(strstr(message, "/nowhere.csv: "));
    response_free(&response);
}

static void random_bytes_get_an_answer(void **state)
{
    static const char part[] = "0123456789.,;-+eE \t\nntx#\"\x01\xff";
    char text[400];

    (void)state;
    seed_from("bytes");
    for (int n = 0; n < 3000; n++) {
        const int length = (int)(draw_unit() * 399);
        for (int i = 0; i < length; i++)
            text[i] = part[(int)(draw_unit() * (sizeof part - 1))];
        text[length] = 0;
        if (read_text(text, n % 2 ? "x" : NULL) == 0)
            for (uint32_t i = 1; i < response.rows; i++)
                assert_true(response.t_s[i] > response.t_s[i - 1]);
        response_free(&response);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_form_is_read),
        cmocka_unit_test(bad_rows_are_told_by_their_line),
        cmocka_unit_test(random_bytes_get_an_answer),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

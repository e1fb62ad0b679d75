/* tests/firmware/linux/commands/otg/test_cmd_otg.c - slew otg as a user meets it:
 * good input, bad input of every kind, pictures. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "tests/support/run_slew.h"

#include <cjson/cJSON.h>
#include <math.h>

#define HEADER "p0,v0,a0,pf,vf,af,vmax,vmin,amax,amin,jmax\n"
#define GOOD   "0,0,0,100,0,0,10,-10,20,-20,200\n"

static char table[256], picture[256];
static char *out, *err;

/* --- the bench ------------------------------------------------------------ */

static int make_directory(void **state)
{
    if (run_open(state) < 0)
        return -1;
    snprintf(table, sizeof table, "%s", run_path("moves.csv"));
    snprintf(picture, sizeof picture, "%s", run_path("move.png"));
    out = run_slew()->out;
    err = run_slew()->err;
    return 0;
}

static int remove_directory(void **state)
{
    const struct run_slew *run = run_slew();

    (void)state;
    unlink(table);
    unlink(picture);
    unlink(run->out_path);
    unlink(run->err_path);
    return rmdir(run->directory); /* nothing else may be left */
}

static void write_table(const char *text, size_t length)
{
    FILE *file = fopen(table, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, length, file), length);
    assert_int_equal(fclose(file), 0);
}

/* `words` apart by blanks, TABLE and PICTURE standing for the paths; the
 * status, with what was written in out and err. */
static int slew(const char *words)
{
    const struct run_name names[] = { { "TABLE", table },
                                      { "PICTURE", picture } };

    return run_line("otg", words, names, ARRAY_LEN(names));
}

static void expect(const char *text, const char *want)
{
    if (strstr(text, want) == NULL)
        fail_msg("expected \"%s\" in \"%s\"", want, text);
}

/* One line on stderr, and this in it. */
static void expect_complaint(const char *want)
{
    expect(err, want);
    assert_ptr_equal(strchr(err, '\n'), err + strlen(err) - 1);
}

/* --- good input ----------------------------------------------------------- */

static void a_table_gives_a_line_per_row(void **state)
{
    static const char text[] = HEADER GOOD "\n" /* an empty line is none */
                                           "1,0,0,1,0,0,1,-1,1,-1,1\n";
    (void)state;
    write_table(text, sizeof text - 1);
    assert_int_equal(slew("TABLE"), 0);
    assert_string_equal(err, "");
    expect(out, "row,status,duration\n0,ok,10.6000");
    expect(out, "\n1,ok,0\n");
    assert_int_equal(slew("--row 1 TABLE"), 0);
    assert_string_equal(out, "row,status,duration\n1,ok,0\n");
}

static void columns_come_in_any_order_and_with_others(void **state)
{
    static const char text[] =
        "\xef\xbb\xbfname, jmax ,amin,amax,vmin,vmax,af,vf,pf,a0,v0,p0,x_2\r\n"
        "a move,200,-20,20,-10,10,0,0,100,0,0, 0 ,\r\n";
    (void)state;
    write_table(text, sizeof text - 1);
    assert_int_equal(slew("TABLE"), 0);
    expect(out, "0,ok,10.6000");
}

static void one_motion_needs_no_file(void **state)
{
    (void)state;
    assert_int_equal(slew("--to 100 --vmax 10 --amax 20 --jmax 200"), 0);
    expect(out, "duration 10.6000");
    assert_int_equal(slew("--v0 2 --vf -1 --amax 1 --jmax 1 --json"), 0);
    cJSON *report = cJSON_Parse(out);
    cJSON *row = cJSON_GetArrayItem(cJSON_GetObjectItem(report, "rows"), 0);
    double duration =
        cJSON_GetNumberValue(cJSON_GetObjectItem(row, "duration"));
    assert_true(fabs(duration - 4) < 4e-6); /* 3 / 1 + 1 / 1 */
    cJSON_Delete(report);
}

static void comments_and_every_end_of_line_are_read(void **state)
{
    static const char old[] = "p0,v0,a0,pf,vf,af,vmax,vmin,amax,amin,jmax\r"
                              "0,0,0,100,0,0,10,-10,20,-20,200\r";
    static const char *const texts[] = {
        "# moves\n" HEADER " # one\n" GOOD,
        "\r\n# moves\r\n" HEADER "\r\n" GOOD "\r\n",
        old,
        "\xEF\xBB\xBF\"p0\";v0;a0;\"pf\";vf;af;vmax;vmin;amax;amin;jmax;"
        "note\r\n"
        "\"0\";0;0;\"100\";0;0;10;-10;20;-20;200;\"a, b; c\"\r\n",
        "p0\tv0\ta0\tpf\tvf\taf\tvmax\tvmin\tamax\tamin\tjmax\n"
        "0\t0\t0\t100\t0\t0\t10\t-10\t20\t-20\t200\n",
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(texts); i++) {
        write_table(texts[i], strlen(texts[i]));
        assert_int_equal(slew("TABLE"), 0);
        expect(out, "row,status,duration\n0,ok,10.6000");
    }
    static const char bad[] = HEADER "\r\n# one\r\n0,0\r\n";
    write_table(bad, sizeof bad - 1);
    assert_int_equal(slew("TABLE"), 2);
    expect_complaint("moves.csv:4:4: too few fields");
}

static void limits_on_one_side_may_be_left_out(void **state)
{
    (void)state;
    assert_int_equal(slew("--to -100 --vmax 10 --vmin -10 --amax 20 "
                          "--amin -20 --jmax 200"),
                     0);
    char first[256];
    snprintf(first, sizeof first, "%.255s", out);
    assert_int_equal(slew("--to -100 --vmax 10 --amax 20 --jmax 200"), 0);
    assert_memory_equal(out, first, strlen(first));
}

/* --- bad input ------------------------------------------------------------ */

static void a_bad_table_is_refused_with_its_place(void **state)
{
    static const struct {
        const char *text, *want;
    } rows[] = {
        { "", "moves.csv:1:1: no header line" },
        { "\n\n", "moves.csv:1:1: no header line" },
        { GOOD, "moves.csv:1:1: expected a header line with the columns p0," },
        { "p0,v0,a0,pf,vf,af,vmax,vmin,amax,amin\n",
          "moves.csv:1:1: no column jmax" },
        { "v0,a0,pf,vf,af,vmax,vmin,amax,amin,jmax\n",
          "moves.csv:1:1: no column p0" },
        { "v0,a0,vf,af,amax,amin\n", "moves.csv:1:1: no column jmax" },
        { "p0,p0,a0,pf,vf,af,vmax,vmin,amax,amin,jmax\n",
          "moves.csv:1:1: column p0 is there twice" },
        { "p0_17,v0\n", "moves.csv:1:1: too many axes: expected 16" },
        { "p0_2,v0_2,a0_2,pf_2,vf_2,af_2,vmax_2,vmin_2,amax_2,amin_2,jmax_2\n",
          "moves.csv:1:1: no columns p0_1,v0_1" },
        { HEADER "0,0,0,NaN,0,0,10,-10,20,-20,200\n",
          "moves.csv:2:7: pf: expected a finite number" },
        { HEADER "0,0,0,1,0,0,1e400,-10,20,-20,200\n",
          "moves.csv:2:13: vmax: expected a finite number" },
        { HEADER "0,0,0,1,0,0,inf,-10,20,-20,200\n", "2:13: vmax: expected" },
        { HEADER "0,0,0,1,0,0,1e70,-10,20,-20,200\n", "2:13: vmax: expected" },
        { HEADER "0,0,0,1e-400,0,0,1,-1,1,-1,1\n", "2:7: pf: expected" },
        { HEADER "0,0,,1,0,0,10,-10,20,-20,200\n", "2:5: a0: expected" },
        { HEADER "0,0,0x,1,0,0,10,-10,20,-20,200\n", "2:5: a0: expected" },
        { HEADER GOOD "0,0,0\n", "moves.csv:3:6: too few fields" },
        { HEADER GOOD "0,0,0,100,0,0,10,-10,20,-20,200,7\n",
          "moves.csv:3:32: too many fields" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        write_table(rows[i].text, strlen(rows[i].text));
        if (slew("TABLE") != 2)
            fail_msg("row %zu: %s%s", i, out, err);
        expect_complaint(rows[i].want);
    }
}

static void binary_and_endless_lines_are_refused(void **state)
{
    static char text[70000];
    (void)state;
    memcpy(text, HEADER, strlen(HEADER));
    memset(text + strlen(HEADER), 0, 100);
    write_table(text, strlen(HEADER) + 100);
    assert_int_equal(slew("TABLE"), 2);
    expect_complaint("moves.csv:2:1: a zero byte");
    memset(text, 'p', sizeof text);
    write_table(text, sizeof text);
    assert_int_equal(slew("TABLE"), 2);
    expect_complaint("moves.csv:1:1: the line is too long");
    memset(text, ',', 600);
    write_table(text, 600);
    assert_int_equal(slew("TABLE"), 2);
    expect_complaint("moves.csv:1:1: too many columns");
    seed_from("binary");
    for (int i = 0; i < 60; i++) {
        size_t length = (size_t)(draw() % 4000);
        for (size_t k = 0; k < length; k++)
            text[k] = (char)draw();
        write_table(text, length);
        assert_int_equal(slew("TABLE"), 2);
        assert_ptr_equal(strchr(err, '\n'), err + strlen(err) - 1);
    }
    assert_int_equal(slew("no-such-file.csv"), 2);
    expect_complaint("no-such-file.csv: No such file");
    assert_int_equal(slew("/"), 2);
    expect_complaint("/: Is a directory");
}

/* What cannot be planned is an answer of its row: the others go on. */
static void a_row_without_a_motion_says_which_number(void **state)
{
    static const struct {
        const char *row, *want;
    } rows[] = {
        { "0,0,0,1,0,0,0,-1,1,-1,1", "vmax: has to be above 0" },
        { "0,0,0,1,0,0,-1,-1,1,-1,1", "vmax: has to be above 0" },
        { "0,0,0,1,0,0,1,1,1,-1,1", "vmin: has to be below 0" },
        { "0,0,0,1,0,0,1,0,1,-1,1", "vmin: has to be below 0" },
        { "0,0,0,1,0,0,1,-1,0,-1,1", "amax: has to be above 0" },
        { "0,0,0,1,0,0,1,-1,1,1,1", "amin: has to be below 0" },
        { "0,0,0,1,0,0,1,-1,1,-1,-1", "jmax: has to be 0 (no limit) or above" },
        { "0,0,0,1,2,0,1,-1,1,-1,1", "vf: no motion within the limits" },
        { "0,0,0,1,0,2,1,-1,1,-1,1", "af: no motion within the limits" },
        { "0,0,0,1,1,-1,1,-1,1,-1,1", "af: no motion within the limits" },
        { "0,1,0,1e-20,1,0,2,-2,1,-1,1", "pf: the numbers of the row lie" },
        { "0,0,0,1e59,0,0,1e-59,-1,1,-1,1", "vmax: the numbers of the row" },
    };
    char text[512], want[128];
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        int length =
            snprintf(text, sizeof text, HEADER "%s\n" GOOD, rows[i].row);
        write_table(text, (size_t)length);
        if (slew("TABLE") != 1)
            fail_msg("row %zu: %s%s", i, out, err);
        snprintf(want, sizeof want, "\n0,%s", rows[i].want);
        expect(out, want);
        expect(out, "\n1,ok,10.6000");
        slew("--segments TABLE");
        snprintf(want, sizeof want, "row 0: %s", rows[i].want);
        expect_complaint(want);
    }
    static const char two[] =
        "p0_1,v0_1,a0_1,pf_1,vf_1,af_1,vmax_1,vmin_1,amax_1,amin_1,jmax_1,"
        "p0_2,v0_2,a0_2,pf_2,vf_2,af_2,vmax_2,vmin_2,amax_2,amin_2,jmax_2\n"
        "0,0,0,1,0,0,1,-1,1,-1,1,0,0,0,1,0,0,1,-1,1,0,1\n";
    write_table(two, sizeof two - 1);
    assert_int_equal(slew("TABLE"), 1);
    expect(out, "0,amin_2: has to be below 0,\n");
}

static void bad_options_are_refused(void **state)
{
    static const struct {
        const char *words, *want;
    } rows[] = {
        { "", "slew otg: where to? expected FILE, or --to POSITION" },
        { "--vmax 3", "slew otg: where to?" },
        { "--to 3",
          "slew otg: no --vmax, --amax or --jmax, expected every limit" },
        { "--to 3 --vmax 1", "slew otg: no --amax or --jmax, expected" },
        { "--vf 3 --amax 1", "slew otg: no --jmax, expected" },
        { "--to 3x", "slew otg: --to 3x: expected a number" },
        { "--to nan", "slew otg: --to nan: expected a number" },
        { "--row -1 TABLE", "slew otg: --row -1: expected a whole number" },
        { "--together us TABLE", "slew otg: --together: expected time, phase" },
        { "--duration -1 --to 3", "slew otg: --duration: expected seconds" },
        { "--duration 1 --together none TABLE", "slew otg: --duration: not" },
        { "--row 1 --to 3",
          "slew otg: --row is for a table, expected FILE with it" },
        { "--row 5 TABLE", "no row 5, expected one of 2, counted from 0" },
        { "--to 3 TABLE",
          "slew otg: expected a FILE or the numbers of one motion" },
        { "TABLE TABLE", "slew otg: expected one FILE" },
        { "--plot move.pdf TABLE", "slew otg: --plot: expected FILE.svg" },
        { "--plot PICTURE TABLE",
          "moves.csv:3:1: --plot draws one row, and here is another" },
    };
    (void)state;
    write_table(HEADER GOOD GOOD, strlen(HEADER GOOD GOOD));
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        if (slew(rows[i].words) != 2)
            fail_msg("row %zu: %s%s", i, out, err);
        expect_complaint(rows[i].want);
        assert_int_not_equal(access(picture, F_OK), 0);
    }
}

/* --- pictures ------------------------------------------------------------- */

static void expect_png(void)
{
    static const unsigned char magic[] = { 0x89, 'P', 'N', 'G' };
    unsigned char head[4];
    struct stat about;
    FILE *file = fopen(picture, "rb");
    assert_non_null(file);
    assert_int_equal(fread(head, 1, 4, file), 4);
    fclose(file);
    assert_memory_equal(head, magic, 4);
    assert_int_equal(stat(picture, &about), 0);
    assert_true(about.st_size > 10000);
    unlink(picture);
}

static void every_kind_of_motion_is_drawn(void **state)
{
    static const char *const words[] = {
        "--row 1 --plot PICTURE TABLE",
        "--to 5 --vmax 1 --amax 2 --jmax 0 --plot PICTURE",
        "--to 0 --vmax 1 --amax 2 --jmax 3 --plot PICTURE",
        "--v0 5 --vf -2 --amax 2 --jmax 3 --plot PICTURE --json",
        "--to 1e-40 --vmax 1e20 --amax 1e30 --jmax 1e40 --plot PICTURE",
        "--v0 50 --a0 7 --to 3 --vmax 1 --amax 2 --jmax 3 --plot PICTURE",
    };
    (void)state;
    write_table(HEADER GOOD GOOD, strlen(HEADER GOOD GOOD));
    for (size_t i = 0; i < ARRAY_LEN(words); i++) {
        if (slew(words[i]) != 0)
            fail_msg("%s: %s%s", words[i], out, err);
        expect_png();
    }
    write_table(HEADER GOOD ",,,50,,,,,,,\n",
                strlen(HEADER GOOD ",,,50,,,,,,,\n"));
    assert_int_equal(slew("--through --plot PICTURE TABLE"), 0);
    expect_png();
    write_table("t," HEADER "0," GOOD "3,,,,50,,,,,,,\n",
                strlen("t," HEADER "0," GOOD "3,,,,50,,,,,,,\n"));
    assert_int_equal(slew("--replan --plot PICTURE TABLE"), 0);
    expect_png();
    assert_int_equal(slew("--to 5 --vmax 0 --amax 2 --jmax 1 --plot PICTURE"),
                     1);
    assert_int_not_equal(access(picture, F_OK), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_table_gives_a_line_per_row),
        cmocka_unit_test(columns_come_in_any_order_and_with_others),
        cmocka_unit_test(one_motion_needs_no_file),
        cmocka_unit_test(limits_on_one_side_may_be_left_out),
        cmocka_unit_test(comments_and_every_end_of_line_are_read),
        cmocka_unit_test(a_bad_table_is_refused_with_its_place),
        cmocka_unit_test(binary_and_endless_lines_are_refused),
        cmocka_unit_test(a_row_without_a_motion_says_which_number),
        cmocka_unit_test(bad_options_are_refused),
        cmocka_unit_test(every_kind_of_motion_is_drawn),
    };
    return cmocka_run_group_tests(tests, make_directory, remove_directory);
}

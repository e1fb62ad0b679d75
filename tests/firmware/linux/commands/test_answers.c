/* tests/firmware/linux/commands/test_answers.c - what commands answer, to people and
 * with --json: ok in each, pictures of a shoot, times of a move. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include <cjson/cJSON.h>
#include <math.h>

#include "firmware/host/base/array.h"
#include "tests/support/run_slew.h"

#define FRAMES 37

static struct run_name file[] = {
    { "RIG", NULL },   { "MOVE", NULL }, { "SHOOT", NULL },   { "FAST", NULL },
    { "TABLE", NULL }, { "OUT", NULL },  { "SLT", NULL },     { "SVG", NULL },
    { "CSV", NULL },   { "MCAP", NULL }, { "NOWHERE", NULL }, { "MD", NULL },
};

static int open_all(void **state)
{
    static const char *const name[] = {
        "rig.yaml", "move.yaml", "shoot.yaml", "fast.yaml",
        "in.csv",   "out.yaml",  "out.slt",    "out.svg",
        "out.csv",  "run.mcap",  "no/where",   "out.md",
    };
    static char path[ARRAY_LEN(name)][256];

    if (run_open(state) < 0)
        return -1;
    for (size_t i = 0; i < ARRAY_LEN(name); i++) {
        snprintf(path[i], sizeof path[i], "%s", run_path(name[i]));
        file[i].path = path[i];
    }
    run_write(
        file[0].path,
        "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
        "axes:\n"
        "  slide: {unit: mm, limits: {position: [0, 2000], velocity: 400, "
        "acceleration: 350, jerk: 15000}, following_error: {floor: 5, time: 50 "
        "ms}, drive: {kind: cia402, bus: can0, node: 1, counts: 1000 per mm}}\n"
        "  pan: {unit: deg, limits: {position: [-90, 90], velocity: 40, "
        "acceleration: 35}, following_error: {floor: 5, time: 50 ms}, drive: "
        "{kind: cia402, bus: can0, node: 2, counts: 1000 per deg}}\n"
        "gpio: {shutter: {kind: trigger, line: GPIO23}}\n");
    run_write(file[1].path,
              "fps: 24\naxes:\n  slide: {keys: [[0 s, 100], [3 s, 250]]}\n"
              "  pan: {keys: [[0 s, 0], [3 s, 10]]}\n");
    run_write(file[2].path,
              "fps: 24\naxes:\n  slide: {keys: [[0 s, 100], [3 s, 250]]}\n"
              "  pan: {keys: [[0 s, 0], [3 s, 10]]}\n"
              "shoot: {mode: stop, line: shutter, frames: 37, exposure: 50 ms, "
              "settle: 40 ms, move: 800 ms}\n");
    run_write(file[3].path,
              "axes:\n  slide: {keys: [[0 s, 100], [300 ms, 300]]}\n");
    run_write(file[4].path, "frame,slide,pan\n0,1,2\n1,1.001,2.0001\n");
    return 0;
}

static cJSON *answer(void)
{
    cJSON *json = cJSON_Parse(run_slew()->out);

    if (json == NULL)
        fail_msg("no JSON: '%s' %s", run_slew()->out, run_slew()->err);
    return json;
}

static const struct {
    const char *command, *words;
    int status;
} commands[] = {
    { "plan", "--json RIG MOVE", 0 },
    { "plan", "--json RIG NOWHERE", 2 },
    { "plan", "--json --pictures CSV RIG MOVE", 2 },
    { "check", "--json RIG MOVE", 0 },
    { "check", "--json RIG FAST", 1 },
    { "compile", "--json --out SLT RIG MOVE", 0 },
    { "compile", "--json --out NOWHERE RIG MOVE", 3 },
    { "export", "csv --json --fps 24 --out CSV RIG MOVE", 0 },
    { "import", "csv TABLE --json --rig RIG --fps 24 --out OUT", 0 },
    { "fit", "--json --output OUT RIG FAST", 0 },
    { "plot", "--json --out SVG RIG MOVE", 0 },
    { "gallery", "--json --out MD RIG FAST", 0 },
    { "sample", "--json --rate 2 RIG MOVE", 0 },
    { "sample", "--json --rate 2 --from 9 RIG MOVE", 2 },
    { "run", "--json --record MCAP RIG MOVE", 0 },
    { "run", "--json --dry-run RIG MOVE", 0 },
    { "run", "--json RIG FAST", 1 },
    { "report", "--json MCAP", 0 },
    { "home", "--json RIG", 2 },
    { "jog", "--json RIG slide to 10mm", 0 },
};

/* It stands first, and is true where the status is 0. */
static void every_answer_says_whether_it_is_ok(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(commands); i++) {
        (void)run_line(commands[i].command, commands[i].words, file,
                       ARRAY_LEN(file));
        if (run_slew()->status != commands[i].status)
            fail_msg("%s %s: status %d, %s", commands[i].command,
                     commands[i].words, run_slew()->status, run_slew()->err);
        cJSON *json = answer();
        const cJSON *ok = cJSON_GetObjectItem(json, "ok");
        if (!cJSON_IsBool(ok) ||
            cJSON_IsTrue(ok) != (commands[i].status == 0) ||
            (json->child != ok && strcmp(commands[i].command, "sample") != 0))
            fail_msg("%s %s: %s", commands[i].command, commands[i].words,
                     run_slew()->out);
        cJSON_Delete(json);
    }
}

/* A line of a table, cells apart by commas. */
static const char *line_of(const char *text, unsigned line)
{
    while (line-- > 0 && text != NULL)
        text = strchr(text, '\n') != NULL ? strchr(text, '\n') + 1 : NULL;
    if (text == NULL)
        fail_msg("too few lines");
    return text;
}

/* When the line is triggered, as slew check has it. */
static cJSON *triggers_of_shoot(void)
{
    (void)run_line("check", "--json RIG SHOOT", file, ARRAY_LEN(file));
    run_expect(0);
    cJSON *json = answer();
    cJSON *line = cJSON_GetArrayItem(cJSON_GetObjectItem(json, "triggers"), 0);
    cJSON *times = cJSON_DetachItemFromObject(line, "path_s");
    cJSON_Delete(json);
    assert_int_equal(cJSON_GetArraySize(times), FRAMES);
    return times;
}

/* As text, JSON and CSV; where the axes are is what slew sample says. */
static void every_picture_is_listed(void **state)
{
    static char table[1 << 14];
    char last[64];

    (void)state;
    cJSON *times = triggers_of_shoot();
    (void)run_line("plan", "RIG SHOOT", file, ARRAY_LEN(file));
    run_expect(0);
    for (unsigned i = 1; i <= FRAMES; i++) {
        snprintf(last, sizeof last, "\n     %2u  ", i);
        run_says(last);
    }
    (void)run_line("plan", "--json --pictures CSV RIG SHOOT", file,
                   ARRAY_LEN(file));
    run_expect(0);
    cJSON *json = answer();
    const cJSON *pictures = cJSON_GetObjectItem(json, "pictures");
    assert_int_equal(cJSON_GetArraySize(pictures), FRAMES);
    run_read(file[8].path, table, sizeof table);
    assert_memory_equal(table, "picture,opens_s,closes_s,slide_mm,pan_deg\n",
                        42);
    for (int i = 0; i < FRAMES; i++) {
        const cJSON *picture = cJSON_GetArrayItem(pictures, i);
        const cJSON *axes = cJSON_GetObjectItem(picture, "axes");
        const double opens =
            cJSON_GetObjectItem(picture, "opens_s")->valuedouble;
        double row[5], sample[7];
        char from[32];
        assert_int_equal(sscanf(line_of(table, (unsigned)i + 1),
                                "%lf,%lf,%lf,%lf,%lf", &row[0], &row[1],
                                &row[2], &row[3], &row[4]),
                         5);
        assert_true(fabs(opens - cJSON_GetArrayItem(times, i)->valuedouble) <
                    1e-9);
        assert_true(row[0] == i + 1 && fabs(row[1] - opens) < 1e-9 &&
                    fabs(row[2] - opens - 0.05) < 1e-9);
        snprintf(from, sizeof from, "%.9f", opens);
        (void)run("sample", "--rate", "1000", "--from", from, "--to", from,
                  file[0].path, file[2].path);
        run_expect(0);
        assert_int_equal(sscanf(line_of(run_slew()->out, 1),
                                "%lf,%lf,%lf,%lf,%lf,%lf,%lf", &sample[0],
                                &sample[1], &sample[2], &sample[3], &sample[4],
                                &sample[5], &sample[6]),
                         7);
        const double slide = cJSON_GetObjectItem(axes, "slide")->valuedouble,
                     pan = cJSON_GetObjectItem(axes, "pan")->valuedouble;
        assert_true(fabs(slide - sample[1]) < 1e-9 && slide - row[3] < 1e-8);
        assert_true(fabs(pan - sample[4]) < 1e-9 && pan - row[4] < 1e-8);
    }
    cJSON_Delete(json);
    cJSON_Delete(times);
}

/* A span that is as fast as its limits allow needs more by rounding alone. */
static void what_needs_no_more_time_is_not_said_to_need_some(void **state)
{
    char path[256];

    (void)state;
    snprintf(path, sizeof path, "%s", run_path("z.yaml"));
    run_write(path, "axes:\n  z: {unit: mm, limits: {position: [0, 500], "
                    "velocity: 300, acceleration: 1500, jerk: 15000}, "
                    "following_error: {floor: 1}, drive: {kind: virtual}}\n");
    run_write(file[5].path,
              "axes: {z: {curve: s-curve, keys: [[2 s, 0], [2.6 s, 60], "
              "[3 s, 0]]}}\n");
    (void)run("check", path, file[5].path);
    run_expect(1);
    run_says("needs 0.");
    if (strstr(run_slew()->out, "needs 0 s") != NULL)
        fail_msg("%s", run_slew()->out);
}

/* A line that nothing triggers takes no pictures, and is not spoken of. */
static void cameras_are_spoken_of_where_they_have_something_to_do(void **state)
{
    (void)state;
    (void)run_line("run", "RIG MOVE", file, ARRAY_LEN(file));
    run_expect(0);
    if (strstr(run_slew()->out, "picture") != NULL)
        fail_msg("%s", run_slew()->out);
    (void)run_line("run", "RIG SHOOT", file, ARRAY_LEN(file));
    run_says("took 37 pictures");
}

/* Of the move, 3 s at 24 frames a second. */
static void a_time_of_the_move_is_said_in_every_way_everywhere(void **state)
{
    static const struct {
        const char *from;
        double t_s;
    } times[] = {
        { "1.5", 1.5 },      { "1500ms", 1.5 },      { "f36", 1.5 },
        { "frame 36", 1.5 }, { "00:00:01:12", 1.5 }, { "f0", 0 },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(times); i++) {
        (void)run("sample", "--rate", "1000", "--from", times[i].from,
                  file[0].path, file[1].path);
        run_expect(0);
        assert_true(fabs(strtod(line_of(run_slew()->out, 1), NULL) -
                         times[i].t_s * 1e9) < 1);
        (void)run("sample", "--rate", "1000", "--from", times[i].from, "--to",
                  times[i].from, file[0].path, file[1].path);
        run_expect(0);
        assert_null(strchr(line_of(run_slew()->out, 1), '\n')[1] == '\0'
                        ? NULL
                        : run_slew()->out);
        (void)run("run", "--from", times[i].from, "--dry-run", file[0].path,
                  file[1].path);
        run_expect(0);
        (void)run("run", "--hold-at", times[i].from, "--dry-run", file[0].path,
                  file[1].path);
        run_expect(0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_answer_says_whether_it_is_ok),
        cmocka_unit_test(every_picture_is_listed),
        cmocka_unit_test(what_needs_no_more_time_is_not_said_to_need_some),
        cmocka_unit_test(cameras_are_spoken_of_where_they_have_something_to_do),
        cmocka_unit_test(a_time_of_the_move_is_said_in_every_way_everywhere),
    };

    return cmocka_run_group_tests(tests, open_all, run_close);
}

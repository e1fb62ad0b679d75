/* tests/firmware/linux/service/test_planner.c - moves of clients are planned in
 * another process: what comes of it is what planning here gives, to the bit; what
 * it may take is bounded, and it can be given up at any time; of files it reads
 * regular ones below the rig's folder alone, and quotes none. */
#define _GNU_SOURCE /* mkfifo, symlink, usleep */
#include "firmware/linux/service/planner.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "firmware/host/base/array.h"
#include "firmware/host/job/job_shots.h"
#include "firmware/host/track/track_file.h"
#include "firmware/linux/base/disk.h"
#include "motion/core/clock_warp.h"
#include "tests/support/check.h"

#define TEXT_MAX  200000
#define PROMPT_MS 1000 /* a planner that is killed, on a machine with load */

static const char rig_text[] =
    "tick: 5 ms\n"
    "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s},\n"
    "  line1: {kind: modbus-rtu, device: /dev/ttyUSB0, baud: 115200}}\n"
    "gpio: {camera: {kind: trigger, line: GPIO23, width: 50 ms}}\n"
    "axes:\n"
    "  x:\n"
    "    unit: mm\n"
    "    limits: {position: [-900, 900], velocity: 400, acceleration: 1900}\n"
    "    following_error: {floor: 1 mm, time: 20 ms}\n"
    "    drive: {kind: cia402, bus: can0, node: 1, counts: 100 per mm}\n"
    "  y:\n"
    "    unit: mm\n"
    "    limits: {position: [-900, 900], velocity: 400, acceleration: 1900}\n"
    "    following_error: {floor: 1 mm, time: 20 ms}\n"
    "    drive: {kind: modbus, bus: line1, node: 2, map: leadshine-el7,\n"
    "            counts: 100 per mm, mode: point-to-point, unsupervised: "
    "yes}\n";

/* Minutes of work from few bytes, and much memory. */
static const char large[] =
    "axes: {x: {curve: quintic, keys: [[0, 0], [0.5, 5], [1, 0]],\n"
    "           cycles: {after: repeat, after_count: 400000}}}\n";
static const char endless[] =
    "axes: {x: {curve: bezier, keys: [[0, 0], [1, 1]]}}\n"
    "shoot: {mode: go-motion, frames: 100000, exposure: 100 ms, blur: 50 %,\n"
    "        move: 1 s, line: camera}\n";

static struct {
    char folder[64], rig[160];
    struct rig loaded;
    struct service_planner planner;
} bench;

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000) + now.tv_nsec / 1000000;
}

/* --- the bench: a folder, a rig in it, a planner --- */

static void path_of(char path[160], const char *name)
{
    snprintf(path, 160, "%s/%s", bench.folder, name);
}

static void put(const char *name, const char *text)
{
    char path[160];
    path_of(path, name);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

static void up(const struct service_plan_limit *limit)
{
    assert_int_equal(
        service_planner_start(&bench.planner, &bench.loaded, bench.rig, limit),
        0);
}

static int make_folder(void **state)
{
    struct messages messages = { .text = NULL };
    (void)state;
    snprintf(bench.folder, sizeof bench.folder, "/tmp/slew-plan-XXXXXX");
    if (mkdtemp(bench.folder) == NULL)
        return -1;
    path_of(bench.rig, "rig.yaml");
    put("rig.yaml", rig_text);
    const enum status status =
        job_read_rig(&disk_files, bench.rig, &bench.loaded, &messages);
    messages_free(&messages);
    return status == STATUS_OK ? 0 : -1;
}

static int clear_folder(void **state)
{
    char line[128];
    (void)state;
    rig_free(&bench.loaded);
    snprintf(line, sizeof line, "rm -r %s", bench.folder);
    return system(line);
}

static int down(void **state)
{
    (void)state;
    service_planner_end(&bench.planner);
    return 0;
}

/* What becomes of a text. */
static enum service_plan_state plan(const char *text,
                                    struct service_move **move)
{
    enum service_plan_state end = SERVICE_PLAN_NONE;
    if (!service_planner_ask(&bench.planner, text))
        fail_msg("not asked for: %.60s", text);
    while (end == SERVICE_PLAN_NONE) {
        usleep(200);
        end = service_planner_take(&bench.planner, move);
    }
    return end;
}

static void planned(const char *text, enum status status, const char *part)
{
    struct service_move *move;
    assert_int_equal(plan(text, &move), SERVICE_PLAN_DONE);
    if (move->facts.status != status || strstr(move->facts.text, part) == NULL)
        fail_msg("%.60s: %d, \"%s\", expected \"%s\"", text,
                 (int)move->facts.status, move->facts.text, part);
    service_move_free(move);
}

/* --- claims --- */

static void same_track(const struct motion_track *own,
                       const struct motion_track *other)
{
    assert_int_equal(own->count, other->count);
    assert_int_equal(own->end_ns_q12, other->end_ns_q12);
    assert_memory_equal(&own->end, &other->end, sizeof own->end);
    for (uint32_t i = 0; i < own->count; i++)
        assert_memory_equal(&own->segment[i], &other->segment[i],
                            sizeof own->segment[i]);
}

/* The tick need not look at the segments of what it starts. */
static void is_summarised(const struct motion_track *track)
{
    struct motion_track_summary own;
    struct motion_track scanned = *track;
    assert_non_null(track->summary);
    motion_track_summarise(&scanned, &own);
    assert_memory_equal(track->summary, &own,
                        offsetof(struct motion_track_summary, segment));
    assert_ptr_equal(track->summary->segment, track->segment);
    assert_int_equal(track->summary->count, track->count);
}

static void same_axis(const struct service_move *move, const struct job *job,
                      unsigned i)
{
    const struct service_move_axis *axis = &move->axis[job->rig_axis[i]];
    const struct plan_axis *own = &job->move.axis[i];
    assert_true(axis->is_driven);
    same_track(&axis->track, &job->track[i]);
    is_summarised(&axis->track);
    assert_true(axis->by_profile == (job->goal[i] != NULL));
    assert_int_equal(axis->goal_count, job->goal_count[i]);
    for (uint32_t k = 0; k < axis->goal_count; k++)
        assert_memory_equal(&axis->goal[k], &job->goal[i][k],
                            sizeof axis->goal[k]);
    assert_int_equal(axis->key_count, own->key_count);
    for (uint32_t k = 0; k < axis->key_count; k++)
        assert_true(axis->key_ns_q12[k] == own->key[k].key.t_ns_q12);
}

static void a_move_is_that_of_planning_here(void **state)
{
    static const char *const text[] = {
        "title: A\naxes: {x: {curve: quintic, keys: [[0, 3], [1, 20], [4, "
        "3]]}}",
        "axes:\n  x: {curve: bezier, keys: [[0, 0], [2, 90]]}\n"
        "  y: {curve: s-curve, keys: [[0, 5], [3, 50], [9, 5]]}\n",
        "fps: 24\nloop: 3\nping_pong: yes\n"
        "axes: {x: {curve: c2, keys: [[0, 0], [1, 5], [3, 0]]}}\n"
        "warp: {curve: quintic, keys: [[0, 0], [6, 3]]}\n",
        "axes: {x: {curve: s-curve, keys: [[0, 0], [0.05, 300]]}}", /* LIMIT */
        "axes: {x: {curve: s-curve, keys: [[0, 7]]}}", /* no segment */
        "axes: {x: {curve: s-curve, keys: [[0, 0], [5, 90]]}}\n"
        "events: [{line: camera, at: 1 s}, {line: camera, at: 1.01 s}]\n",
        "axes: {x: {curve: s-curve, keys: [[0, 0], [5, 90]]}}\n"
        "shoot: {mode: stop, frames: 5, exposure: 1 s, move: 2 s,\n"
        "        settle: 1 s, line: camera, step: operator}\n",
    };
    struct job job;
    (void)state;
    up(&(struct service_plan_limit){ 0 });
    for (size_t n = 0; n < ARRAY_LEN(text); n++) {
        struct service_move *move;
        assert_int_equal(plan(text[n], &move), SERVICE_PLAN_DONE);
        put("move.yaml", text[n]);
        char path[160];
        path_of(path, "move.yaml");
        assert_int_equal(
            job_open(&job, &disk_files, bench.rig, path, false, NULL),
            STATUS_OK);
        job_check(&job, MOTION_CLOCK_WARP_ONE_Q30);
        const bool plays =
            job.violation_count == 0 &&
            job_shots_check(&job, MOTION_CLOCK_WARP_ONE_Q30, &job.messages);
        assert_int_equal(move->facts.status,
                         plays ? STATUS_OK : STATUS_REFUSED);
        assert_true(move->facts.end_ns_q12 == job.end_ns_q12);
        assert_string_equal(move->facts.title, job.move.title);
        assert_string_equal(move->file_text, text[n]);
        assert_true(move->facts.is_warped == (job.move.warp != NULL));
        assert_memory_equal(&move->facts.steps, &job.steps, sizeof job.steps);
        for (unsigned i = 0; plays && i < job.move.axis_count; i++)
            same_axis(move, &job, i);
        assert_int_equal(plays ? move->shots[0].count : 0,
                         plays ? job.shots[0].count : 0);
        for (uint32_t k = 0; plays && k < job.shots[0].count; k++)
            assert_true(move->shots[0].t_ns_q12[k] == job.shots[0].t_ns_q12[k]);
        job_free(&job);
        service_move_free(move);
    }
}

static void a_plan_ends_in_its_time(void **state)
{
    struct service_move *move;
    (void)state;
    up(&(struct service_plan_limit){ .time_ns = 300000000, .mib = 65536 });
    const int64_t begin_ms = now_ms();
    assert_int_equal(plan(endless, &move), SERVICE_PLAN_TIME);
    assert_in_range(now_ms() - begin_ms, 290, 300 + PROMPT_MS);
    planned("axes: {x: {curve: s-curve, keys: [[0, 0], [1, 1]]}}", STATUS_OK,
            "");
}

static void a_plan_ends_at_its_memory(void **state)
{
    struct service_move *move;
    (void)state;
    up(&(struct service_plan_limit){ .mib = 120 });
    assert_int_equal(plan(large, &move), SERVICE_PLAN_MEMORY);
    planned("axes: {x: {curve: s-curve, keys: [[0, 0], [1, 1]]}}", STATUS_OK,
            "");
}

/* Its memory is locked with that of the tick. */
static void a_move_that_is_kept_takes_a_quarter(void **state)
{
    static const int64_t mib[] = { 128, 192, 256, 320, 384, 512 };
    unsigned done = 0;
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(mib); i++) {
        struct service_move *move;
        up(&(struct service_plan_limit){ .mib = mib[i] });
        const enum service_plan_state end = plan(large, &move);
        if (end == SERVICE_PLAN_DONE)
            assert_in_range(move->size, 1, mib[i] << 18);
        else
            assert_int_equal(end, SERVICE_PLAN_MEMORY);
        done += end == SERVICE_PLAN_DONE;
        service_move_free(move);
        service_planner_end(&bench.planner);
    }
    assert_in_range(done, 1, ARRAY_LEN(mib) - 1);
}

/* The one that is loaded, the one before it, and a new one: none is touched as
 * another is made, and there is no place for a fourth. */
static void moves_stay_as_they_are(void **state)
{
    struct service_move *move[SERVICE_PLAN_MOVES] = { NULL };
    char text[120];
    (void)state;
    up(&(struct service_plan_limit){ 0 });
    for (unsigned n = 0; n < 20; n++) {
        struct service_move **to = &move[n % SERVICE_PLAN_MOVES];
        if (*to != NULL)
            assert_false(service_planner_ask(&bench.planner, "axes: 1"));
        service_move_free(*to);
        snprintf(text, sizeof text,
                 "axes: {x: {curve: quintic, keys: [[0, 0], [9, %u], [18, 0]], "
                 "cycles: "
                 "{after: repeat, after_count: %u}}}",
                 100 + n, 1 + n * 13 % 7);
        assert_int_equal(plan(text, to), SERVICE_PLAN_DONE);
        for (unsigned i = 0; i < SERVICE_PLAN_MOVES && i <= n; i++) {
            struct motion_state at = { 0 };
            const unsigned own = n - (n - i) % SERVICE_PLAN_MOVES;
            motion_track_state(&move[i]->axis[0].track,
                               INT64_C(9000000000) * MOTION_FIXED_NS_Q12, &at);
            assert_int_equal(at.pos_q32 >> 32, 100 + own);
        }
    }
    for (unsigned i = 0; i < SERVICE_PLAN_MOVES; i++)
        service_move_free(move[i]);
}

/* Also when it had been over just then: the answer is that to the last text. */
static void a_plan_is_given_up_at_any_time(void **state)
{
    struct service_move *move;
    char text[200];
    (void)state;
    up(&(struct service_plan_limit){ 0 });
    for (unsigned i = 0; i < 60; i++) {
        const bool is_long = i % 3 == 0;
        snprintf(text, sizeof text,
                 "title: n%u\naxes: {x: {curve: s-curve, keys: [[0, 0], "
                 "[1, 1]]}}",
                 i);
        assert_true(
            service_planner_ask(&bench.planner, is_long ? endless : text));
        usleep(i * 150);
        service_planner_give_up(&bench.planner);
        const int64_t begin_ms = now_ms();
        snprintf(text, sizeof text,
                 "title: m%u\naxes: {x: {curve: s-curve, keys: [[0, 0], "
                 "[1, 1]]}}",
                 i);
        assert_int_equal(plan(text, &move), SERVICE_PLAN_DONE);
        assert_string_equal(move->file_text, text);
        assert_memory_equal(move->facts.title, text + 7, 2);
        assert_in_range(now_ms() - begin_ms, 0, PROMPT_MS);
        service_move_free(move);
    }
}

/* Nor for a process that was forked later, such as the guardian of real drives,
 * and has all that was open then. */
static void the_end_does_not_wait_for_a_plan(void **state)
{
    (void)state;
    up(&(struct service_plan_limit){ 0 });
    const pid_t other = fork();
    if (other == 0)
        for (;;)
            pause();
    assert_true(service_planner_ask(&bench.planner, endless));
    usleep(100000);
    const int64_t begin_ms = now_ms();
    service_planner_end(&bench.planner);
    assert_in_range(now_ms() - begin_ms, 0, PROMPT_MS);
    kill(other, SIGKILL);
    assert_int_equal(waitpid(other, NULL, 0), other);
}

static void progress_says_what_is_done(void **state)
{
    struct service_plan_progress progress = { .of = 0 };
    (void)state;
    up(&(struct service_plan_limit){ 0 });
    assert_true(service_planner_ask(&bench.planner, endless));
    for (int i = 0; i < 5000 && progress.doing[0] == '\0'; i++) {
        usleep(1000);
        service_planner_progress(&bench.planner, &progress);
    }
    assert_string_equal(progress.doing, "planning");
    service_planner_give_up(&bench.planner);
}

/* A planner that fails, and one that is gone. */
static void a_planner_that_dies_is_no_end_of_the_service(void **state)
{
    struct service_move *move;
    (void)state;
    up(&(struct service_plan_limit){ 0 });
    assert_true(service_planner_ask(&bench.planner, endless));
    kill(bench.planner.process, SIGKILL);
    enum service_plan_state end = SERVICE_PLAN_NONE;
    for (int i = 0; i < 5000 && end == SERVICE_PLAN_NONE; i++) {
        usleep(1000);
        end = service_planner_take(&bench.planner, &move);
    }
    assert_int_equal(end, SERVICE_PLAN_FAILED);
    assert_false(service_planner_ask(&bench.planner, "axes: 1"));
    assert_int_equal(service_planner_take(&bench.planner, &move),
                     SERVICE_PLAN_NONE);
}

/* --- files that a text names --- */

#define LAYER(name)                                                            \
    "axes: {x: {curve: s-curve, keys: [[0, 0], [4, 20]]}}\n"                   \
    "layers: [{move: " name "}]\n"

static void files_below_the_rig_alone_are_read(void **state)
{
    static const char good[] =
        "axes: {x: {curve: s-curve, keys: [[0, 0], [4, 5]]}}\n";
    static const struct {
        const char *text, *says; /* "": it is planned */
    } row[] = {
        { LAYER("good.yaml"), "" },
        { LAYER("sub/good.yaml"), "" },
        { LAYER("link.yaml"), "" },
        { LAYER("sub/../good.yaml"), "" },
        { LAYER("none.yaml"), "No such file" },
        { LAYER("secret.txt"), "secret.txt:1:1: the file is no move" },
        { LAYER("secret.yaml"), "secret.yaml:2:1: the file is no move" },
        { LAYER("out.yaml"), "not below the folder" },
        { LAYER("../none.yaml"), "not below the folder" },
        { LAYER("/etc/passwd"), "not below the folder" },
        { LAYER("/etc/none"), "not below the folder" },
        { LAYER("/proc/self/environ"), "not below the folder" },
        { LAYER("/proc/self/fd/0"), "not below the folder" },
        { LAYER("fifo"), "not a regular file" },
        { LAYER("fifo.yaml"), "not a regular file" },
        { LAYER("/dev/zero"), "not below the folder" },
        { LAYER("/dev/ptmx"), "not below the folder" },
        { LAYER("sub"), "not a regular file" },
        { LAYER("huge.yaml"), "larger than 16 MiB" },
        { LAYER("."), "not below the folder" },
        { "axes: {x: {curve: s-curve, keys: [[0, 0], [4, 20]]}}\n"
          "fade: {move: fifo, weight: {curve: s-curve, keys: [[0, 0 %], [4, "
          "100 %]]}}\n",
          "not a regular file" },
    };
    char path[160];
    (void)state;
    path_of(path, "sub");
    assert_int_equal(mkdir(path, 0700), 0);
    put("good.yaml", good);
    put("sub/good.yaml", good);
    put("secret.txt", "root:secret:12345\n");
    put("secret.yaml", "title: t\npassword: hunter2\n");
    path_of(path, "link.yaml");
    assert_int_equal(symlink("sub/good.yaml", path), 0);
    path_of(path, "out.yaml");
    assert_int_equal(symlink("/etc/passwd", path), 0);
    put("huge.yaml", "");
    path_of(path, "huge.yaml");
    assert_int_equal(truncate(path, INT64_C(1) << 40), 0);
    path_of(path, "fifo");
    assert_int_equal(mkfifo(path, 0600), 0);
    path_of(path, "fifo.yaml");
    assert_int_equal(symlink("fifo", path), 0);
    up(&(struct service_plan_limit){ .time_ns = INT64_C(5000000000) });
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        struct service_move *move;
        assert_int_equal(plan(row[i].text, &move), SERVICE_PLAN_DONE);
        const char *text = move->facts.text;
        if ((move->facts.status == STATUS_OK) != (row[i].says[0] == '\0') ||
            strstr(text, row[i].says) == NULL)
            fail_msg("%s: \"%s\", expected \"%s\"", row[i].text, text,
                     row[i].says);
        assert_null(strstr(text, "secret:12345"));
        assert_null(strstr(text, "hunter2"));
        assert_null(strstr(text, "password"));
        assert_null(strstr(text, "root:"));
        service_move_free(move);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(a_move_is_that_of_planning_here, down),
        cmocka_unit_test_teardown(a_plan_ends_in_its_time, down),
        cmocka_unit_test_teardown(a_plan_ends_at_its_memory, down),
        cmocka_unit_test_teardown(a_move_that_is_kept_takes_a_quarter, down),
        cmocka_unit_test_teardown(moves_stay_as_they_are, down),
        cmocka_unit_test_teardown(a_plan_is_given_up_at_any_time, down),
        cmocka_unit_test_teardown(the_end_does_not_wait_for_a_plan, down),
        cmocka_unit_test_teardown(progress_says_what_is_done, down),
        cmocka_unit_test_teardown(a_planner_that_dies_is_no_end_of_the_service,
                                  down),
        cmocka_unit_test_teardown(files_below_the_rig_alone_are_read, down),
    };
    return cmocka_run_group_tests(tests, make_folder, clear_folder);
}

/* tests/firmware/linux/service/test_loop.c - whatever happens beside the tick of a
 * service, the tick itself calls nothing of the system, takes no lock and no
 * memory, loses nothing and gives the same set points.
 *
 * In virtual time; the ticks are those of a thread that the kernel lets do little
 * more than end (seccomp): any other call is refused and counted.  TICK_UNFILTERED
 * leaves the filter out, for a program that runs this one and makes calls of its
 * own (tests/bench/latency.py: valgrind). */
#define _GNU_SOURCE /* usleep */
#include <dlfcn.h>
#include <errno.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stddef.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <ucontext.h>

#include "tests/support/check.h"
#include "tests/support/service_bench.h"

#define TICKS   3000 /* more than the ring of a recording has rows */
#define TURN    10   /* ticks, and the clients' turn */
#define DEAF    16
#define CLIENTS 200 /* of whom SERVICE_CLIENTS are taken */

static const char rig_text[] =
    "tick: 1 ms\nbuses: {can: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n"
    "  pan:\n    unit: deg\n    limits: {position: [-90 deg, 90 deg],"
    " velocity: 40 deg/s, acceleration: 100 deg/s2}\n"
    "    following_error: {floor: 5 deg, time: 100 ms}\n"
    "    drive: {kind: cia402, bus: can, node: 1, counts: 131072 per rev}\n"
    "  tilt:\n    unit: deg\n    limits: {position: [-90 deg, 90 deg],"
    " velocity: 40 deg/s, acceleration: 100 deg/s2}\n"
    "    following_error: {floor: 5 deg, time: 100 ms}\n"
    "    drive: {kind: cia402, bus: can, node: 2, counts: 131072 per rev}\n";
static const char *const lines[] = {
    "{\"command\":\"take\",\"lease\":60}",
    "{\"command\":\"enable\"}",
    ("{\"command\":\"load\",\"text\":\"axes: {pan: {curve: s-curve, keys: "
     "[[0, 0], [4, 20]]}, tilt: {curve: s-curve, keys: [[0, 0], [5, -9]]}}\"}"),
    "{\"command\":\"approach\"}",
    "{\"command\":\"start\"}",
};

static struct service_bench bench;
static struct service_recording recording;

/* --- what the tick must not do --- */

static _Thread_local bool is_tick;
static _Atomic unsigned calls, locks, pieces;
static _Atomic int last_call;

static void on_call(int number, siginfo_t *info, void *context)
{
    (void)number;
#ifdef __x86_64__ /* elsewhere the call gives whatever it does */
    ((ucontext_t *)context)->uc_mcontext.gregs[REG_RAX] = -ENOSYS;
#else
    (void)context;
#endif
    if (!is_tick)
        return;
    last_call = info->si_syscall;
    calls++;
}

/* For this thread alone: to yield, and what its end needs. */
static bool filter_calls(void)
{
    struct sock_filter filter[] = {
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_sched_yield, 5, 0),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_rt_sigreturn, 4, 0),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_rt_sigprocmask, 3, 0),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_madvise, 2, 0),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit, 1, 0),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
    };
    const struct sock_fprog program = { ARRAY_LEN(filter), filter };
    const struct sigaction action = { .sa_sigaction = on_call,
                                      .sa_flags = SA_SIGINFO };
    /* cmocka has one of its own in each test */
    return sigaction(SIGSYS, &action, NULL) == 0 &&
           prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
           prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

#ifndef CHECK_SANITIZED /* which has these for itself */
void *real_malloc(size_t size) __asm__("__libc_malloc");
void *real_calloc(size_t count, size_t size) __asm__("__libc_calloc");
void *real_realloc(void *piece, size_t size) __asm__("__libc_realloc");
void real_free(void *piece) __asm__("__libc_free");

/* In the places of those of the C library. */
void *counted_malloc(size_t size) __asm__("malloc");
void *counted_calloc(size_t count, size_t size) __asm__("calloc");
void *counted_realloc(void *piece, size_t size) __asm__("realloc");
void counted_free(void *piece) __asm__("free");

void *counted_malloc(size_t size)
{
    pieces += is_tick;
    return real_malloc(size);
}

void *counted_calloc(size_t count, size_t size)
{
    pieces += is_tick;
    return real_calloc(count, size);
}

void *counted_realloc(void *piece, size_t size)
{
    pieces += is_tick;
    return real_realloc(piece, size);
}

void counted_free(void *piece)
{
    pieces += is_tick && piece != NULL;
    real_free(piece);
}

int pthread_mutex_lock(pthread_mutex_t *mutex)
{
    static int (*real)(pthread_mutex_t *);
    if (real == NULL)
        *(void **)&real = dlsym(RTLD_NEXT, "pthread_mutex_lock");
    locks += is_tick;
    return real(mutex);
}
#endif

/* --- the tick's thread --- */

static struct {
    _Atomic bool ticks; /* it is its turn */
    _Atomic bool ended;
    bool filters, filtered;
    uint32_t crc; /* of every set point */
} tick;

static void note_targets(void)
{
    const struct controller *controller = &bench.machine.controller;
    for (unsigned i = 0; i < bench.rig.axis_count; i++)
        tick.crc = crc32_of(tick.crc, &controller->axis[i].target.pos_q32,
                            sizeof controller->axis[i].target.pos_q32);
}

static void *tick_main(void *context)
{
    (void)context;
    tick.filtered = tick.filters && filter_calls();
    for (unsigned i = 0; i < TICKS; i++) {
        while (i % TURN == 0 && !tick.ticks)
            (void)sched_yield();
        is_tick = true;
        service_loop_tick(&bench.loop);
        is_tick = false;
        note_targets();
        if (i % TURN == TURN - 1)
            tick.ticks = false;
    }
    tick.ended = true;
    return NULL;
}

/* --- beside it --- */

static int file[CLIENTS];

static void do_nothing(void)
{
}

static void say(int to, const char *line)
{
    assert_true(send(to, line, strlen(line), MSG_NOSIGNAL) > 0 &&
                send(to, "\n", 1, MSG_NOSIGNAL) == 1);
}

static uint64_t dropped(void)
{
    uint64_t all = 0;
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++)
        all += bench.control.clients.client[i].dropped;
    return all;
}

static void deaf_begin(const char *before, unsigned times)
{
    int small = 4096;
    for (unsigned i = 0; i < DEAF; i++) {
        file[i] = service_bench_connect(&bench);
        (void)setsockopt(file[i], SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
        for (unsigned line = 0; line < times; line++) {
            say(file[i], before); /* each has its turn */
            service_bench_serve(&bench);
        }
        say(file[i], "{\"command\":\"stream\",\"rate\":100}");
    }
}

static void close_all(unsigned count)
{
    for (unsigned i = 0; i < count; i++)
        close(file[i]);
}

/* Answers of 64 KiB and what the kernel keeps are soon full. */
static void readers_begin(void)
{
    deaf_begin("{\"command\":\"status\"}", 200);
}

static void readers_end(void)
{
    unsigned full = 0;
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++)
        full += bench.control.clients.client[i].out_length > SERVICE_OUT / 2;
    assert_int_equal(full, DEAF);
    close_all(DEAF);
}

/* Of the stream alone: what they are not told is counted. */
static void streams_begin(void)
{
    deaf_begin("", 0);
}

static void streams_end(void)
{
    assert_true(dropped() > 0);
    close_all(DEAF);
}

static void connections_begin(void)
{
    for (unsigned i = 0; i < CLIENTS; i++)
        assert_true((file[i] = service_bench_connect(&bench)) >= 0);
}

static void connections_end(void)
{
    assert_int_equal(bench.control.clients.refused,
                     CLIENTS - (SERVICE_CLIENTS - 1));
    close_all(CLIENTS);
}

/* As in a write that does not come back: the thread that writes has the lock
 * then. */
static void disk_begin(void)
{
    char text[SERVICE_RECORDING_TEXT_MAX];
    const struct service_recording_about about = {
        .rig_path = bench.rig_path,
        .rig_text = rig_text,
        .rig_length = strlen(rig_text),
    };
    service_recording_init(&recording, bench.directory, &bench.rig,
                           bench.machine.ports.clock);
    assert_int_equal(
        service_recording_start(&recording, "take.csv", &about, text), 0);
    bench.loop.recording = &recording;
    (void)pthread_mutex_lock(&recording.lock);
}

static void disk_end(void)
{
    char path[64];
    (void)pthread_mutex_unlock(&recording.lock);
    assert_int_equal(service_recording_stop(&recording), 0);
    while (!service_recording_ended(&recording))
        usleep(1000);
    assert_int_equal(recording.rows, RECORDER_ROWS);
    assert_int_equal(recording.rows_lost, TICKS - RECORDER_ROWS);
    bench.loop.recording = NULL;
    service_recording_free(&recording);
    snprintf(path, sizeof path, "%s/take.csv", bench.directory);
    unlink(path);
}

/* --- the claims --- */

static int up(void **state)
{
    (void)state;
    memset(&recording, 0, sizeof recording);
    memset(&tick, 0, sizeof tick);
    calls = locks = pieces = 0;
    return service_bench_ready(&bench, rig_text);
}

static int down(void **state)
{
    (void)state;
    service_bench_close(&bench);
    return 0;
}

/* Until the move is played. */
static int play(void)
{
    const int holder = service_bench_connect(&bench);
    for (size_t i = 0; i < ARRAY_LEN(lines); i++) {
        say(holder, lines[i]);
        service_bench_serve(&bench);
        while (service_bench_plans(&bench)) {
            usleep(100);
            service_bench_serve(&bench);
        }
        for (int n = 0; n < 1000; n++)
            if (i + 1 < ARRAY_LEN(lines) ||
                bench.machine.controller.state != CONTROLLER_MOVING)
                service_bench_tick(&bench);
    }
    assert_int_equal(bench.machine.controller.state, CONTROLLER_MOVING);
    return holder;
}

/* Its ticks, beside the turns of the service's main thread. */
static void run_ticks(void)
{
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, tick_main, NULL), 0);
    while (!tick.ended) {
        if (!tick.ticks) {
            service_bench_serve(&bench);
            tick.ticks = true;
        }
        usleep(10);
    }
    (void)pthread_join(thread, NULL);
    service_bench_serve(&bench);
}

static void judge(void (*begin)(void), void (*end)(void))
{
    static uint32_t undisturbed_crc;
    const struct controller *controller = &bench.machine.controller;
    const int holder = play();
    const uint64_t before = controller->ticks;
#ifndef CHECK_SANITIZED
    tick.filters = getenv("TICK_UNFILTERED") == NULL;
#endif
    begin();
    run_ticks();
    end();
    assert_true(tick.filtered == tick.filters);
    if (calls > 0)
        fail_msg("%u calls of the system, the last one number %d", calls,
                 last_call);
    assert_int_equal(locks, 0);
    assert_int_equal(pieces, 0);
    assert_int_equal(controller->ticks - before, TICKS);
    assert_int_equal(controller->ticks_lost, 0);
    assert_int_equal(controller->state, CONTROLLER_MOVING);
    if (undisturbed_crc == 0)
        undisturbed_crc = tick.crc;
    assert_int_equal(tick.crc, undisturbed_crc);
    close(holder);
}

static void undisturbed(void **state)
{
    (void)state;
    judge(do_nothing, do_nothing);
}

static void beside_readers_that_never_read(void **state)
{
    (void)state;
    judge(readers_begin, readers_end);
}

static void beside_streams_that_nobody_reads(void **state)
{
    (void)state;
    judge(streams_begin, streams_end);
}

static void beside_more_connections_than_it_takes(void **state)
{
    (void)state;
    judge(connections_begin, connections_end);
}

static void beside_a_recording_whose_writes_do_not_come_back(void **state)
{
    (void)state;
    judge(disk_begin, disk_end);
}

#define LOOP_TEST(claim) cmocka_unit_test_setup_teardown(claim, up, down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        LOOP_TEST(undisturbed),
        LOOP_TEST(beside_readers_that_never_read),
        LOOP_TEST(beside_streams_that_nobody_reads),
        LOOP_TEST(beside_more_connections_than_it_takes),
        LOOP_TEST(beside_a_recording_whose_writes_do_not_come_back),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

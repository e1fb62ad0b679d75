/* firmware/linux/machine/guardian.c - see guardian.h. */
#define _DEFAULT_SOURCE /* MAP_ANONYMOUS */
#include "firmware/linux/machine/guardian.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/machine/off.h"

#define GUARDIAN_MOST_NS  (2 * GUARDIAN_LOOK_NS) /* that a look counts for */
#define GUARDIAN_GONE_MS  2000 /* a process that was killed is gone by then */
#define GUARDIAN_PRIORITY 41   /* above the loop's: it may be what hangs */
#define GUARDIAN_OPEN_NS  INT64_C(3000000000)

static int64_t guardian_now_ns(void)
{
    struct timespec now = { 0 };
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

/* Nothing that a terminal or a supervisor sends to all is for it, and only what
 * it has to say holds a stream open. */
static void guardian_stand_apart(void)
{
    static const int ignored[] = { SIGINT,  SIGQUIT, SIGTERM, SIGHUP,
                                   SIGPIPE, SIGTSTP, SIGTTOU, SIGTTIN };
    const struct sched_param first = { .sched_priority = GUARDIAN_PRIORITY };
    const int null = open("/dev/null", O_RDWR);
    (void)setsid();
    for (size_t i = 0; i < ARRAY_LEN(ignored); i++)
        (void)signal(ignored[i], SIG_IGN);
    if (null >= 0) {
        (void)dup2(null, STDIN_FILENO);
        (void)dup2(null, STDOUT_FILENO);
    }
    (void)sched_setscheduler(0, SCHED_FIFO, &first); /* if we may */
}

/* True: the process at the other end is gone. */
static bool guardian_is_gone(int alive, int wait_ms)
{
    struct pollfd look = { .fd = alive, .events = POLLIN };
    return poll(&look, 1, wait_ms) > 0;
}

void guardian_watch_init(struct guardian_watch *watch, int64_t period_ns,
                         int64_t now_ns)
{
    const int64_t ticks_ns = GUARDIAN_HUNG_TICKS * period_ns;
    *watch = (struct guardian_watch){
        .hung_ns = ticks_ns > GUARDIAN_HUNG_NS ? ticks_ns : GUARDIAN_HUNG_NS,
        .look_ns = now_ns,
    };
}

bool guardian_watch_hangs(struct guardian_watch *watch,
                          const struct guardian_page *page, int64_t now_ns)
{
    const uint64_t ticks = atomic_load(&page->ticks);
    int64_t passed_ns = now_ns - watch->look_ns;
    if (passed_ns > GUARDIAN_MOST_NS) /* we were not run either */
        passed_ns = GUARDIAN_MOST_NS;
    watch->still_ns = ticks == watch->ticks ? watch->still_ns + passed_ns : 0;
    watch->ticks = ticks;
    watch->look_ns = now_ns;
    if (ticks == 0 || atomic_load(&page->done))
        watch->still_ns = 0;
    return watch->still_ns > watch->hung_ns;
}

/* Until there is nothing to guard any more: "".  Else what has happened. */
static const char *guardian_look(const struct guardian_page *page, int alive,
                                 pid_t pid, int64_t period_ns)
{
    struct guardian_watch watch;
    guardian_watch_init(&watch, period_ns, guardian_now_ns());
    while (!guardian_is_gone(alive, GUARDIAN_LOOK_NS / 1000000)) {
        if (!guardian_watch_hangs(&watch, page, guardian_now_ns()))
            continue;
        (void)kill(pid, SIGKILL);
        (void)guardian_is_gone(alive, GUARDIAN_GONE_MS);
        return "its loop hung, so it was killed";
    }
    return atomic_load(&page->ticks) == 0 || atomic_load(&page->done)
               ? ""
               : "it ended without switching its drives off";
}

const struct off_config guardian_off = { .real = true,
                                         .open_ns = GUARDIAN_OPEN_NS,
                                         .timeout_ns = GUARDIAN_OFF_NS,
                                         .takes_over = true };

static void guardian_take_off(const struct rig *rig, const char *why, pid_t pid)
{
    struct off_axis *axis = memory_new(rig->axis_count, sizeof *axis);
    fprintf(stderr, "\nslew, process %ld: %s; taking torque off\n", (long)pid,
            why);
    (void)off_all(rig, &guardian_off, axis, NULL);
    for (unsigned i = 0; i < rig->axis_count; i++)
        fprintf(stderr, "%s: %s\n", rig->axis[i].name, axis[i].text);
    memory_free(axis);
}

static void guardian_main(const struct guardian_page *page,
                          const struct rig *rig, int alive, pid_t pid)
{
    guardian_stand_apart();
    const char *why = guardian_look(page, alive, pid, rig->period_ns);
    if (why[0] != '\0')
        guardian_take_off(rig, why, pid);
    _exit(0);
}

static int guardian_fail(struct guardian *guardian, const char *what)
{
    error_say("slew: no guardian, so nothing moves: %s: %s", what,
              strerror(errno));
    if (guardian->page != NULL)
        (void)munmap(guardian->page, sizeof *guardian->page);
    guardian->page = NULL;
    return -1;
}

int guardian_start(struct guardian *guardian, const struct rig *rig)
{
    int ends[2];
    const pid_t self = getpid();
    void *page = mmap(NULL, sizeof *guardian->page, PROT_READ | PROT_WRITE,
                      MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    *guardian = (struct guardian){ .page = NULL };
    if (page == MAP_FAILED)
        return guardian_fail(guardian, "mmap");
    guardian->page = page;
    if (pipe(ends) < 0)
        return guardian_fail(guardian, "pipe");
    (void)fcntl(ends[1], F_SETFD, FD_CLOEXEC);
    fflush(NULL);
    guardian->pid = fork();
    if (guardian->pid == 0) {
        close(ends[1]);
        guardian_main(guardian->page, rig, ends[0], self);
    }
    close(ends[0]);
    guardian->alive = ends[1];
    if (guardian->pid > 0)
        return 0;
    close(ends[1]);
    return guardian_fail(guardian, "fork");
}

void guardian_done(struct guardian_page *page)
{
    if (page != NULL)
        atomic_store(&page->done, true);
}

void guardian_end(struct guardian *guardian)
{
    if (guardian->page == NULL)
        return;
    close(guardian->alive);
    while (waitpid(guardian->pid, NULL, 0) < 0 && errno == EINTR)
        ; /* it sees that our end is closed */
    (void)munmap(guardian->page, sizeof *guardian->page);
    guardian->page = NULL;
}

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

#define GUARDIAN_MS       INT64_C(1000000)
#define GUARDIAN_GONE_MS  2000 /* a process that was killed is gone by then */
#define GUARDIAN_PRIORITY 41   /* above the loop's: it may be what hangs */
#define GUARDIAN_TEXT_MAX 160

/* What both processes have. */
struct guardian_self {
    struct guardian_page *page;
    const struct rig *rig;
    int alive; /* readable once the process is gone */
    pid_t pid; /* of the process */
};

static int64_t guardian_now_ns(void)
{
    struct timespec now = { 0 };
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

/* --- the guardian --- */

/* True: the process is gone. */
static bool guardian_is_alone(const struct guardian_self *self, int wait_ms)
{
    struct pollfd look = { .fd = self->alive, .events = POLLIN };
    return poll(&look, 1, wait_ms) > 0;
}

static const char *guardian_why(const struct guardian_page *page)
{
    if (atomic_load(&page->ticks) == 0)
        return "";
    switch (atomic_load(&page->end)) {
    case GUARDIAN_DONE:
        return "";
    case GUARDIAN_LEFT:
        return "it ended, and not every drive had confirmed that it is off";
    default:
        return "it ended without switching its drives off";
    }
}

/* Until there is nothing to guard any more: "".  Else what has happened.  NULL: the
 * keeper is gone. */
static const char *guardian_look(const struct guardian_self *self, pid_t keeper)
{
    struct guardian_watch watch;
    guardian_watch_init(&watch, guardian_now_ns());
    while (!guardian_is_alone(self, (int)(GUARDIAN_LOOK_NS / GUARDIAN_MS))) {
        atomic_fetch_add(&self->page->looks, 1);
        if (getppid() != keeper)
            return NULL;
        if (!guardian_sees_hang(&watch, self->page, self->rig->period_ns,
                                guardian_now_ns()))
            continue;
        (void)kill(self->pid, SIGKILL);
        (void)guardian_is_alone(self, GUARDIAN_GONE_MS);
        return "its loop hung, so it was killed";
    }
    return guardian_why(self->page);
}

const struct off_config guardian_off = { .real = true,
                                         .open_ns = GUARDIAN_OFF_NS,
                                         .timeout_ns = GUARDIAN_OFF_NS,
                                         .takes_over = true };

static void guardian_take_off(const struct guardian_self *self, const char *why)
{
    const struct rig *rig = self->rig;
    struct off_axis *axis = memory_new(rig->axis_count, sizeof *axis);
    char text[GUARDIAN_TEXT_MAX];
    snprintf(text, sizeof text, "\nslew, process %ld: %s; taking torque off\n",
             (long)self->pid, why);
    error_hasten(true); /* a terminal that is stopped, a pager */
    error_put(text);
    (void)off_all(rig, &guardian_off, axis, NULL);
    error_hasten(false);
    for (unsigned i = 0; i < rig->axis_count; i++)
        fprintf(stderr, "%s: %s\n", rig->axis[i].name, axis[i].text);
    memory_free(axis);
}

/* --- the keeper --- */

/* True: the guardian has done what there was to do, or another program does it. */
static bool guardian_keep(pid_t guardian)
{
    int status = 0;
    while (waitpid(guardian, &status, WUNTRACED) < 0)
        if (errno != EINTR)
            return false;
    if (WIFSTOPPED(status)) { /* one that is stopped guards nothing */
        (void)kill(guardian, SIGKILL);
        (void)waitpid(guardian, &status, 0);
    }
    return WIFEXITED(status) || WTERMSIG(status) == GUARDIAN_GIVE_WAY;
}

/* Nothing that a terminal or a supervisor sends to all is for them, and only what
 * they have to say holds a stream open. */
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

/* Each round is a keeper's; who is its guardian comes out of it where the keeper is
 * gone, and is the next one.  Without a process to be had it guards itself. */
static void guardian_main(const struct guardian_self *self)
{
    guardian_stand_apart();
    for (;;) {
        const pid_t keeper = getpid();
        const pid_t pid = fork();
        if (pid > 0 && guardian_keep(pid))
            _exit(0);
        if (pid <= 0) {
            const char *why =
                guardian_look(self, pid == 0 ? keeper : getppid());
            if (why != NULL && why[0] != '\0')
                guardian_take_off(self, why);
            if (pid == 0 && getppid() == keeper)
                (void)kill(keeper, SIGCONT); /* it may have been stopped */
            if (why != NULL)
                _exit(0);
        }
        atomic_fetch_add(&self->page->lost, 1);
    }
}

/* --- the process's side --- */

static int guardian_fail(struct guardian *guardian, const char *what)
{
    error_say("slew: no guardian, so nothing moves: %s: %s", what,
              strerror(errno));
    if (guardian->page != NULL)
        (void)munmap(guardian->page, sizeof *guardian->page);
    guardian->page = NULL;
    return -1;
}

/* Two pipes, of each a side is ours. */
static int guardian_fork(struct guardian *guardian, const struct rig *rig,
                         const int alive[2], const int gone[2])
{
    const struct guardian_self self = {
        .page = guardian->page, .rig = rig, .alive = alive[0], .pid = getpid()
    };
    fflush(NULL);
    guardian->pid = fork();
    if (guardian->pid == 0) {
        close(alive[1]);
        close(gone[0]);
        guardian_main(&self);
    }
    close(alive[0]);
    close(gone[1]);
    guardian->alive = alive[1];
    guardian->gone = gone[0];
    if (guardian->pid > 0)
        return 0;
    close(guardian->alive);
    close(guardian->gone);
    return guardian_fail(guardian, "fork");
}

int guardian_start(struct guardian *guardian, const struct rig *rig)
{
    int alive[2], gone[2];
    void *page = mmap(NULL, sizeof *guardian->page, PROT_READ | PROT_WRITE,
                      MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    *guardian = (struct guardian){ .page = NULL };
    if (page == MAP_FAILED)
        return guardian_fail(guardian, "mmap");
    guardian->page = page;
    if (pipe(alive) < 0)
        return guardian_fail(guardian, "pipe");
    if (pipe(gone) < 0) {
        close(alive[0]);
        close(alive[1]);
        return guardian_fail(guardian, "pipe");
    }
    (void)fcntl(alive[1], F_SETFD, FD_CLOEXEC);
    (void)fcntl(gone[0], F_SETFD, FD_CLOEXEC);
    return guardian_fork(guardian, rig, alive, gone);
}

void guardian_done(struct guardian_page *page)
{
    if (page != NULL)
        atomic_store(&page->end, GUARDIAN_DONE);
}

void guardian_leave(struct guardian_page *page)
{
    if (page != NULL)
        atomic_store(&page->end, GUARDIAN_LEFT);
}

void guardian_end(struct guardian *guardian)
{
    if (guardian->page == NULL)
        return;
    struct pollfd ended = { .fd = guardian->gone, .events = POLLIN };
    const bool is_over = guardian_why(guardian->page)[0] == '\0';
    close(guardian->alive);
    const bool is_awaited = is_over && poll(&ended, 1, GUARDIAN_GONE_MS) > 0;
    (void)waitpid(guardian->pid, NULL, is_awaited ? 0 : WNOHANG);
    close(guardian->gone);
    (void)munmap(guardian->page, sizeof *guardian->page);
    guardian->page = NULL;
}

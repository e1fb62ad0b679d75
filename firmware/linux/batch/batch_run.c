/* firmware/linux/batch/batch_run.c - see batch_run.h. */
#define _GNU_SOURCE /* MAP_ANONYMOUS */
#include "firmware/linux/batch/batch_run.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "firmware/host/base/memory.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/batch/batch_table.h"
#include "firmware/linux/player/player.h"

#define RUN_LOOK_NS 50000000 /* from one look at the processes to the next */

/* --- one run --- */

struct run {
    struct fault_script script;
    struct machine_fault faults;
    struct machine_sim sim;
    struct machine machine;
    struct player player;
    struct report report;
};

static int run_play(struct run *run, const struct batch_run *self,
                    uint64_t number, char message[YAML_MESSAGE_MAX])
{
    static const volatile sig_atomic_t none;
    struct job *const job = self->job;
    struct machine_ports ports;

    batch_vary_apply(self->vary, number, &job->rig, &run->script);
    if (machine_sim_init(&run->sim, &job->rig, false, &ports, message) < 0 ||
        machine_fault_init(&run->faults, &run->script, &run->sim) < 0 ||
        machine_init(&run->machine, &job->rig, &ports, message) < 0)
        return -1;
    const struct player_config config = {
        .override_q30 = job->rate_q30,
        .hold_at_ns = -1,
        .faults = &run->faults,
    };
    const struct player_observer observer = { .report = &run->report };
    report_init(&run->report, job);
    player_init(&run->player, &run->machine, job, &config, &observer);
    return player_run(&run->player, &none);
}

static void run_free(struct run *run)
{
    player_free(&run->player);
    report_free(&run->report);
    machine_fault_free(&run->faults);
    machine_free(&run->machine);
    machine_sim_free(&run->sim);
    memory_free(run);
}

static double run_real(int64_t value_q32)
{
    return ldexp((double)value_q32, -32);
}

/* --- lines --- */

static FILE *run_open(char **text, size_t *size)
{
    FILE *const file = open_memstream(text, size);
    if (file == NULL)
        memory_fail();
    return file;
}

char *batch_run_head(const struct batch_run *self)
{
    char name[BATCH_NAME_MAX], cell[BATCH_CELL_MAX], *text = NULL;
    size_t size = 0;
    FILE *const file = run_open(&text, &size);
    const struct job *const job = self->job;

    fputs("batch,run,of", file);
    for (unsigned i = 0; i < self->vary->count; i++) {
        batch_item_name(self->vary, i, name);
        fprintf(file, ",%s", batch_cell(cell, name));
    }
    fputs(",end,fault,played_s", file);
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        const struct rig_axis *const axis = job_rig_axis(job, i);
        const char *const unit = units_axis_text(axis->unit);
        snprintf(name, sizeof name, "%s.following_%s", axis->name, unit);
        fprintf(file, ",%s", batch_cell(cell, name));
        snprintf(name, sizeof name, "%s.end_error_%s", axis->name, unit);
        fprintf(file, ",%s", batch_cell(cell, name));
    }
    fclose(file);
    return text;
}

static void run_result(const struct batch_run *self,
                       const struct report *report, FILE *file)
{
    char fault[REPORT_FAULT_MAX], cell[BATCH_CELL_MAX];
    report_fault_text(report, fault);
    fprintf(file, ",%s", batch_cell(cell, report_end_text(report->end)));
    fprintf(file, ",%s", batch_cell(cell, fault));
    fprintf(file, ",%.9g", 1e-9 * (double)report->played_ns);
    for (unsigned i = 0; i < self->job->move.axis_count; i++)
        fprintf(file, ",%.9g,%.9g", run_real(report->axis[i].following_q32),
                run_real(report_end_error(report, i)));
}

/* One run's line, likewise. */
static char *batch_run_line(const struct batch_run *self, uint64_t number)
{
    char message[YAML_MESSAGE_MAX] = "", cell[BATCH_CELL_MAX], *text = NULL;
    size_t size = 0;
    struct run *const run = memory_new(1, sizeof *run);
    FILE *const file = run_open(&text, &size);

    fprintf(file, "%s,%" PRIu64 ",%" PRIu64, self->id, number, self->runs);
    for (unsigned i = 0; i < self->vary->count; i++)
        fprintf(file, ",%.9g", batch_item_value(self->vary, i, number));
    if (run_play(run, self, number, message) == 0) {
        run_result(self, &run->report, file);
    } else { /* a variation of which no servo can be made */
        fprintf(file, ",not simulated,%s,0", batch_cell(cell, message));
        for (unsigned i = 0; i < self->job->move.axis_count; i++)
            fputs(",0,0", file);
    }
    fputc('\n', file);
    fclose(file);
    run_free(run);
    return text;
}

/* --- many --- */

struct run_shared {
    _Atomic uint64_t next, done;
    _Atomic bool stop;
};

static int run_append(int journal, const char *line)
{
    const size_t size = strlen(line);
    ssize_t put;
    do
        put = write(journal, line, size);
    while (put < 0 && errno == EINTR);
    return put == (ssize_t)size ? 0 : -1;
}

/* A process: with 0 when no run is left. */
static void run_work(const struct batch_run *self, struct run_shared *shared)
{
    signal(SIGINT, SIG_IGN); /* the parent tells when to stop */
    signal(SIGTERM, SIG_IGN);
    signal(SIGHUP, SIG_IGN);
    if (prctl(PR_SET_PDEATHSIG, SIGKILL) < 0)
        _exit(1);
    while (!atomic_load(&shared->stop)) {
        const uint64_t number =
            self->shard + self->shards * atomic_fetch_add(&shared->next, 1);
        if (number >= self->runs)
            break;
        if (self->is_done[number])
            continue;
        char *const line = batch_run_line(self, number);
        const int err = run_append(self->journal, line);
        free(line);
        if (err < 0)
            _exit(1);
        atomic_fetch_add(&shared->done, 1);
    }
    _exit(0);
}

static uint64_t run_count(const struct batch_run *self)
{
    uint64_t left = 0;
    for (uint64_t i = self->shard; i < self->runs; i += self->shards)
        left += !self->is_done[i];
    return left;
}

static unsigned run_start(const struct batch_run *self,
                          struct run_shared *shared, pid_t pid[])
{
    unsigned count = 0;
    fflush(NULL); /* a copy of what waits would be written twice */
    while (count < self->processes) {
        pid[count] = fork();
        if (pid[count] < 0)
            break;
        if (pid[count] == 0)
            run_work(self, shared);
        count++;
    }
    return count;
}

/* How a process has ended: 0, or -1 with a line. */
static int run_judge(int status)
{
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0)
        return 0;
    if (WIFSIGNALED(status))
        error_say("slew batch: a process was ended by signal %d: the same "
                  "command goes on where it was",
                  WTERMSIG(status));
    else
        error_say("slew batch: the journal cannot be written: %s",
                  "is the disk full?");
    return -1;
}

static int run_wait(const struct batch_run *self, struct run_shared *shared,
                    const pid_t pid[], unsigned count, uint64_t all,
                    const volatile sig_atomic_t *interrupts)
{
    const struct timespec pause = { .tv_nsec = RUN_LOOK_NS };
    unsigned ended = 0;
    int err = 0, status;

    while (ended < count) {
        if (*interrupts > 0)
            atomic_store(&shared->stop, true);
        plan_progress_tell(self->progress, "running", "batch",
                           (int64_t)atomic_load(&shared->done), (int64_t)all);
        for (unsigned i = 0; i < count; i++)
            if (waitpid(pid[i], &status, WNOHANG) == pid[i]) {
                ended++;
                if (run_judge(status) < 0) {
                    err = -1;
                    atomic_store(&shared->stop, true);
                }
            }
        if (ended < count)
            nanosleep(&pause, NULL);
    }
    plan_progress_end(self->progress);
    if (err == 0 && atomic_load(&shared->done) < all)
        return 1;
    return err;
}

int batch_run_all(const struct batch_run *self,
                  const volatile sig_atomic_t *interrupts)
{
    const uint64_t all = run_count(self);
    if (all == 0)
        return 0;
    struct run_shared *const shared =
        mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE,
             MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    pid_t *const pid = memory_new(self->processes, sizeof *pid);
    int err = -1;
    if (shared == MAP_FAILED) {
        error_say("slew batch: %s", strerror(errno));
        memory_free(pid);
        return -1;
    }
    const unsigned count = run_start(self, shared, pid);
    if (count == 0)
        error_say("slew batch: no process could be started: %s",
                  strerror(errno));
    else
        err = run_wait(self, shared, pid, count, all, interrupts);
    munmap(shared, sizeof *shared);
    memory_free(pid);
    return err;
}

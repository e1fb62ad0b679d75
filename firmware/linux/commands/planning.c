/* firmware/linux/commands/planning.c - see planning.h.
 *
 * The line is drawn by a thread, so that it comes after a second whatever
 * planning is at, and planning does no more than leave three numbers. */
#include "firmware/linux/commands/planning.h"

#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "hal/linux/thread.h"

#define PLANNING_FIRST_NS 1000000000
#define PLANNING_NEXT_NS  200000000

static struct {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    pthread_t thread;
    bool requested, running; /* the planner's alone: of this planning */
    bool over;
    const char *doing, *what;
    int64_t done, of;
} planning = { .lock = PTHREAD_MUTEX_INITIALIZER };

/* With the lock.  False once planning is over. */
static bool planning_wait(struct timespec *at, long ns)
{
    at->tv_nsec += ns;
    at->tv_sec += at->tv_nsec / 1000000000;
    at->tv_nsec %= 1000000000;
    while (!planning.over &&
           pthread_cond_timedwait(&planning.changed, &planning.lock, at) !=
               ETIMEDOUT)
        continue;
    return !planning.over;
}

static void planning_draw(void)
{
    fprintf(stderr, "\r%s: %s", planning.doing, planning.what);
    if (planning.of > 0)
        fprintf(stderr, " %3.0f %%",
                100.0 * (double)planning.done / (double)planning.of);
    fputs("\033[K", stderr);
    fflush(stderr);
}

static void *planning_run(void *unused)
{
    struct timespec at;
    bool drawn = false;

    (void)unused;
    clock_gettime(CLOCK_MONOTONIC, &at);
    pthread_mutex_lock(&planning.lock);
    for (bool on = planning_wait(&at, PLANNING_FIRST_NS); on;
         on = planning_wait(&at, PLANNING_NEXT_NS)) {
        planning_draw();
        drawn = true;
    }
    pthread_mutex_unlock(&planning.lock);
    if (drawn) {
        fputs("\r\033[K", stderr);
        fflush(stderr);
    }
    return NULL;
}

/* Signals stay with the thread that plans; without a thread there is no
 * line. */
static void planning_begin(void)
{
    pthread_condattr_t clock;

    pthread_condattr_init(&clock);
    pthread_condattr_setclock(&clock, CLOCK_MONOTONIC);
    pthread_cond_init(&planning.changed, &clock);
    pthread_condattr_destroy(&clock);
    planning.over = false;
    planning.running =
        thread_linux_start(&planning.thread, planning_run, NULL) == 0;
}

static void planning_end(void)
{
    pthread_mutex_lock(&planning.lock);
    planning.over = true;
    pthread_cond_signal(&planning.changed);
    pthread_mutex_unlock(&planning.lock);
    pthread_join(planning.thread, NULL);
    planning.running = false;
}

static void planning_tell(void *unused, const char *doing, const char *what,
                          int64_t done, int64_t of)
{
    (void)unused;
    if (what == NULL) {
        if (planning.running)
            planning_end();
        planning.requested = false;
        return;
    }
    if (planning.requested && !planning.running)
        return;
    pthread_mutex_lock(&planning.lock);
    planning.doing = doing;
    planning.what = what;
    planning.done = done;
    planning.of = of;
    pthread_mutex_unlock(&planning.lock);
    if (!planning.requested && isatty(STDERR_FILENO) == 1)
        planning_begin();
    planning.requested = true;
}

const struct plan_progress planning_progress = { planning_tell, NULL };

/* --- RIG MOVE, or one directory with rig.yaml and move.yaml --- */

static bool planning_is_directory(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

static bool planning_join(char name[PLANNING_PATH_MAX], const char *path,
                          const char *file)
{
    return snprintf(name, PLANNING_PATH_MAX, "%s%s", path, file) <
           PLANNING_PATH_MAX;
}

static enum status planning_names(char rig[PLANNING_PATH_MAX],
                                  char move[PLANNING_PATH_MAX],
                                  const char *const path[], int count)
{
    const char *first = path[0];
    const bool directory = planning_is_directory(first);
    if (count == 2 && directory)
        return error_file(first, "is a directory, expected a rig file");
    if (access(first, F_OK) < 0)
        return error_file(first, strerror(errno));
    if (count == 1 && !directory)
        return error_file(first, "expected a rig and a move file, or one "
                                 "directory with rig.yaml and move.yaml");
    if (!planning_join(rig, first, directory ? "/rig.yaml" : "") ||
        !planning_join(move, directory ? first : path[1],
                       directory ? "/move.yaml" : ""))
        return error_file(first, "the name is too long");
    return STATUS_OK;
}

enum status planning_open(struct job *job, const char *const path[], int count,
                          bool any)
{
    char rig[PLANNING_PATH_MAX], move[PLANNING_PATH_MAX];
    memset(job, 0, sizeof *job);
    enum status status = planning_names(rig, move, path, count);
    if (status == STATUS_OK)
        status = job_open(job, &disk_files, rig, move, any, &planning_progress);
    error_tell(&job->messages);
    return status;
}

enum status planning_open_files(struct job *job, const struct files *files,
                                const char *rig, const char *move)
{
    memset(job, 0, sizeof *job);
    const enum status status =
        job_open(job, files, rig, move, true, &planning_progress);
    error_tell(&job->messages);
    return status;
}

enum status planning_rig_path(const char *path, char name[PLANNING_PATH_MAX])
{
    if (access(path, F_OK) < 0)
        return error_file(path, strerror(errno));
    if (!planning_join(name, path,
                       planning_is_directory(path) ? "/rig.yaml" : ""))
        return error_file(path, "the name is too long");
    return STATUS_OK;
}

enum status planning_rig(const char *path, struct rig *rig)
{
    struct messages messages = { .text = NULL };
    char name[PLANNING_PATH_MAX];
    enum status status = planning_rig_path(path, name);
    if (status == STATUS_OK)
        status = job_read_rig(&disk_files, name, rig, &messages);
    error_tell(&messages);
    return status;
}

enum status planning_time(const struct job *job, const char *command,
                          const char *option, const char *text,
                          int64_t *t_ns_q12)
{
    const struct units_context units = {
        .fps = { job->move.fps_num, job->move.fps_den },
    };
    char sentence[UNITS_SENTENCE_MAX];

    if (units_parse(text, UNITS_TIME, &units, t_ns_q12, sentence) >= 0)
        return STATUS_OK;
    error_say("slew %s: %s: %s", command, option, sentence);
    return STATUS_INPUT;
}

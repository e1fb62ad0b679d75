/* firmware/linux/service/planner.c - see planner.h. */
#include "firmware/linux/service/planner.h"

#include <errno.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/job/budget.h"
#include "firmware/host/job/job_shots.h"
#include "firmware/linux/base/disk.h"
#include "motion/core/clock_warp.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/ease.h"

#define PLANNER_MOVE "move.yaml" /* the name of what a client has sent */

/* --- a move and a rig that are texts, beside the files of this machine --- */

enum { PLANNER_FILE_MOVE = 1 << 28, PLANNER_FILE_RIG };

struct planner_files {
    struct files files;
    const struct service_planner *planner;
};

static const struct service_planner *planner_of(const struct files *files)
{
    return ((const struct planner_files *)(const void *)files)->planner;
}

static int planner_open(const struct files *files, const char *path)
{
    if (strcmp(path, PLANNER_MOVE) == 0)
        return PLANNER_FILE_MOVE;
    if (strcmp(path, planner_of(files)->rig_path) == 0)
        return PLANNER_FILE_RIG;
    return disk_files.open(&disk_files, path);
}

static void planner_close(const struct files *files, int file)
{
    (void)files;
    if (file < PLANNER_FILE_MOVE)
        disk_files.close(&disk_files, file);
}

static int64_t planner_size(const struct files *files, int file)
{
    const struct service_planner *planner = planner_of(files);
    if (file == PLANNER_FILE_MOVE)
        return (int64_t)strlen(planner->text);
    if (file == PLANNER_FILE_RIG)
        return (int64_t)planner->rig_length;
    return disk_files.size(&disk_files, file);
}

static int64_t planner_read(const struct files *files, int file, void *to,
                            size_t size, uint64_t offset)
{
    const struct service_planner *planner = planner_of(files);
    if (file < PLANNER_FILE_MOVE)
        return disk_files.read(&disk_files, file, to, size, offset);
    const char *text =
        file == PLANNER_FILE_MOVE ? planner->text : planner->rig_text;
    const uint64_t length = (uint64_t)planner_size(files, file);
    const uint64_t left = offset < length ? length - offset : 0;
    const size_t got = left < size ? (size_t)left : size;
    memcpy(to, text + (offset < length ? offset : 0), got);
    return (int64_t)got;
}

static bool planner_find(const struct files *files, const char *kind,
                         const char *name, const char *beside,
                         char path[FILES_PATH_MAX])
{
    (void)files;
    return disk_files.find(&disk_files, kind, name, beside, path);
}

static unsigned planner_names(const struct files *files, const char *kind,
                              char name[FILES_NAMES_MAX][FILES_NAME_MAX])
{
    (void)files;
    return disk_files.names(&disk_files, kind, name);
}

/* --- a move --- */

static void planner_say(struct service_move *move, const char *text)
{
    const size_t used = strlen(move->text);
    if (used + 1 < sizeof move->text)
        snprintf(move->text + used, sizeof move->text - used, "%s%s",
                 used > 0 ? "\n" : "", text);
}

/* The errors of the job, and that it is not to be played. */
static void planner_refuse(struct service_move *move, enum status status)
{
    enum message_kind kind;
    const char *text;
    move->status = status;
    for (size_t at = 0;
         (text = messages_next(&move->job.messages, &at, &kind)) != NULL;)
        if (kind == MESSAGE_ERROR)
            planner_say(move, text);
}

static void planner_judge(struct service_move *move)
{
    struct job *job = &move->job;
    job_check(job, MOTION_CLOCK_WARP_ONE_Q30);
    if (job->violation_count > 0) {
        planner_refuse(move, STATUS_REFUSED);
        planner_say(move, "the move breaks limits of the rig");
    } else if (!job_shots_check(job, MOTION_CLOCK_WARP_ONE_Q30,
                                &job->messages) ||
               !budget_check(job)) {
        planner_refuse(move, STATUS_REFUSED);
    }
}

static void planner_reserve(struct service_motion *motion, unsigned axes,
                            struct memory_pool *memory)
{
    motion->track =
        memory_pool_new(memory, axes, sizeof(struct motion_track *));
    motion->goal =
        memory_pool_new(memory, axes, sizeof(struct controller_goal *));
    motion->goal_count =
        memory_pool_new(memory, axes, sizeof *motion->goal_count);
}

static void planner_motion(struct service_move *move)
{
    const struct job *job = &move->job;
    const unsigned axes = job->rig.axis_count;
    planner_reserve(&move->motion, axes, &move->memory);
    planner_reserve(&move->approach, axes, &move->memory);
    move->axis = memory_pool_new(&move->memory, axes, sizeof *move->axis);
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        const unsigned axis = job->rig_axis[i];
        move->motion.track[axis] = &job->track[i];
        move->motion.goal[axis] = job->goal[i];
        move->motion.goal_count[axis] = job->goal_count[i];
    }
    move->motion.steps = job->steps;
    move->motion.step_line =
        job->step_line == NULL ? -1 : (int)(job->step_line - job->rig.line);
    move->motion.shots = job_has_shots(job) ? job->shots : NULL;
}

static void planner_forget(struct service_planner *planner)
{
    if (planner->former != NULL)
        job_free(planner->former);
    memory_free(planner->former);
    planner->former = NULL;
}

/* For the next move. */
static void planner_remember(struct service_planner *planner,
                             struct service_move *move)
{
    move->planned = move->job.memo->planned;
    move->reused = move->job.memo->reused;
    planner_forget(planner);
    planner->former = memory_new(1, sizeof *planner->former);
    job_part_with(&move->job, planner->former);
}

static struct service_move *planner_plan(struct service_planner *planner)
{
    const struct planner_files files = {
        .files = { planner_open, planner_close, planner_read, planner_size,
                   planner_find, planner_names },
        .planner = planner,
    };
    struct service_move *move = memory_new(1, sizeof *move);
    move->status = job_open_again(&move->job, &files.files, planner->rig_path,
                                  PLANNER_MOVE, planner->former, NULL);
    if (move->status != STATUS_OK) {
        planner_refuse(move, move->status);
    } else {
        planner_judge(move);
        planner_remember(planner, move);
    }
    if (move->status == STATUS_OK)
        planner_motion(move);
    const size_t size = strlen(planner->text) + 1;
    move->move_text = memory_new(size, 1);
    memcpy(move->move_text, planner->text, size);
    return move;
}

void service_move_free(struct service_move *move)
{
    if (move == NULL)
        return;
    job_free(&move->job);
    memory_pool_free(&move->memory);
    memory_free(move->move_text);
    memory_free(move);
}

/* --- the way to its start --- */

static int approach_axis(struct service_move *move, unsigned i, int64_t pos_q32)
{
    const unsigned axis = move->job.rig_axis[i];
    struct service_approach *own = &move->axis[axis];
    struct motion_track *track = &own->track;
    motion_track_init(track, own->storage, JOB_APPROACH_SEGMENTS, pos_q32);
    const int any = job_approach(&move->job, i, 0, track);
    if (any <= 0)
        return any;
    move->approach.track[axis] = track;
    if (move->job.goal[i] != NULL &&
        controller_goals_of(track, &own->goal, 1) > 0) {
        move->approach.goal[axis] = &own->goal;
        move->approach.goal_count[axis] = 1;
    }
    return 1;
}

int service_move_approach(struct service_move *move,
                          const struct machine_view_axis axis[])
{
    struct service_motion *approach = &move->approach;
    int any = 0;
    for (unsigned i = 0; i < move->job.rig.axis_count; i++) {
        approach->track[i] = NULL;
        approach->goal[i] = NULL;
        approach->goal_count[i] = 0;
    }
    for (unsigned i = 0; i < move->job.move.axis_count; i++) {
        const int err =
            approach_axis(move, i, axis[move->job.rig_axis[i]].demand_q32);
        if (err < 0)
            return err;
        any |= err;
    }
    return any;
}

/* --- the thread --- */

static void *planner_main(void *context)
{
    struct service_planner *planner = context;
    pthread_mutex_lock(&planner->lock);
    while (planner->turn != SERVICE_PLAN_END) {
        if (planner->turn != SERVICE_PLAN_WORKING) {
            pthread_cond_wait(&planner->changed, &planner->lock);
            continue;
        }
        pthread_mutex_unlock(&planner->lock);
        struct service_move *move = planner_plan(planner);
        pthread_mutex_lock(&planner->lock);
        memory_free(planner->text);
        planner->text = NULL;
        planner->move = move;
        if (planner->turn == SERVICE_PLAN_WORKING)
            planner->turn = SERVICE_PLAN_DONE;
    }
    pthread_mutex_unlock(&planner->lock);
    return NULL;
}

int service_planner_start(struct service_planner *planner, const char *rig_path,
                          const char *rig_text, size_t rig_length)
{
    *planner = (struct service_planner){ .rig_path = rig_path,
                                         .rig_text = rig_text,
                                         .rig_length = rig_length };
    (void)pthread_mutex_init(&planner->lock, NULL);
    (void)pthread_cond_init(&planner->changed, NULL);
    return pthread_create(&planner->thread, NULL, planner_main, planner);
}

void service_planner_end(struct service_planner *planner)
{
    pthread_mutex_lock(&planner->lock);
    planner->turn = SERVICE_PLAN_END;
    pthread_cond_signal(&planner->changed);
    pthread_mutex_unlock(&planner->lock);
    (void)pthread_join(planner->thread, NULL);
    planner_forget(planner);
    service_move_free(planner->move);
    memory_free(planner->text);
    (void)pthread_cond_destroy(&planner->changed);
    (void)pthread_mutex_destroy(&planner->lock);
}

bool service_planner_ask(struct service_planner *planner, const char *text)
{
    const size_t size = strlen(text) + 1;
    pthread_mutex_lock(&planner->lock);
    const bool is_free = planner->turn == SERVICE_PLAN_IDLE;
    if (is_free) {
        planner->text = memory_new(1, size);
        memcpy(planner->text, text, size);
        planner->turn = SERVICE_PLAN_WORKING;
        pthread_cond_signal(&planner->changed);
    }
    pthread_mutex_unlock(&planner->lock);
    return is_free;
}

struct service_move *service_planner_take(struct service_planner *planner)
{
    struct service_move *move = NULL;
    pthread_mutex_lock(&planner->lock);
    if (planner->turn == SERVICE_PLAN_DONE) {
        move = planner->move;
        planner->move = NULL;
        planner->turn = SERVICE_PLAN_IDLE;
    }
    pthread_mutex_unlock(&planner->lock);
    return move;
}

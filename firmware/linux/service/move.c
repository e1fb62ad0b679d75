/* firmware/linux/service/move.c - see move.h. */
#include "firmware/linux/service/move.h"

#include <string.h>
#include <sys/mman.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/job/budget.h"
#include "firmware/host/job/job_shots.h"
#include "motion/core/clock_warp.h"

#define MOVE_VIOLATIONS 50 /* that a client is told one by one */

/* --- as bytes, from one process to the other: the same order both ways --- */

#define PASS_ALIGN 16 /* of arrays, which are read where they stand */

struct move_pass {
    FILE *file;  /* to be written; NULL: */
    char *bytes; /* these are read */
    size_t size, at;
    bool failed;
};

static void pass_bytes(struct move_pass *pass, void *object, size_t size)
{
    if (size == 0 || pass->failed)
        return;
    if (pass->file != NULL)
        pass->failed = fwrite(object, size, 1, pass->file) != 1;
    else if (size > pass->size - pass->at)
        pass->failed = true;
    else
        memcpy(object, pass->bytes + pass->at, size);
    pass->at += pass->failed ? 0 : size;
}

/* The array: that of the one side, or where it stands on the other. */
static void *pass_array(struct move_pass *pass, void *array, uint32_t *count,
                        size_t size)
{
    char fill[PASS_ALIGN] = { 0 };
    pass_bytes(pass, count, sizeof *count);
    pass_bytes(pass, fill, -pass->at % PASS_ALIGN);
    if (pass->file != NULL) {
        pass_bytes(pass, array, *count * size);
        return array;
    }
    pass->failed |= *count > (pass->size - pass->at) / size;
    if (pass->failed)
        *count = 0;
    array = pass->bytes + pass->at;
    pass->at += *count * size;
    return array;
}

static void move_pass(struct move_pass *pass, struct service_move *move,
                      const struct rig *rig)
{
    pass_bytes(pass, &move->facts, sizeof move->facts);
    for (unsigned i = 0; i < rig->axis_count; i++) {
        struct service_move_axis *axis = &move->axis[i];
        struct motion_segment *segment = axis->track.segment;
        uint32_t count = axis->track.count;
        pass_bytes(pass, &axis->is_driven, sizeof axis->is_driven);
        pass_bytes(pass, &axis->by_profile, sizeof axis->by_profile);
        pass_bytes(pass, &axis->track, sizeof axis->track);
        pass_bytes(pass, &axis->summary, sizeof axis->summary);
        axis->track.segment =
            pass_array(pass, segment, &count, sizeof *segment);
        axis->track.count = axis->track.capacity = count;
        axis->track.summary = &axis->summary;
        axis->summary.segment = axis->track.segment;
        axis->goal =
            pass_array(pass, axis->goal, &axis->goal_count, sizeof *axis->goal);
        axis->key_ns_q12 = pass_array(pass, axis->key_ns_q12, &axis->key_count,
                                      sizeof *axis->key_ns_q12);
    }
    for (unsigned i = 0; i < rig->line_count; i++)
        move->shots[i].t_ns_q12 =
            pass_array(pass, move->shots[i].t_ns_q12, &move->shots[i].count,
                       sizeof *move->shots[i].t_ns_q12);
}

static void move_reserve(struct service_move *move, const struct rig *rig)
{
    move->axis =
        memory_pool_new(&move->memory, rig->axis_count, sizeof *move->axis);
    move->shots =
        memory_pool_new(&move->memory, rig->line_count, sizeof *move->shots);
}

/* --- the process that plans --- */

static void move_say(struct service_move_facts *facts, const char *text)
{
    const size_t used = strlen(facts->text);
    if (used + 1 < sizeof facts->text)
        snprintf(facts->text + used, sizeof facts->text - used, "%s%s",
                 used > 0 ? "\n" : "", text);
}

/* Text of another file is not for clients, who may not be allowed to read it: of
 * what is wrong in it they are told the place, and of the file as a whole all. */
static void move_say_error(struct service_move_facts *facts, const char *text)
{
    static const char own[] = SERVICE_MOVE_NAME ":", whole[] = " the file ";
    char place[FILES_PATH_MAX + 128];
    const char *at = text;
    for (int colons = 0; *at != '\0' && colons < 3; at++)
        colons += *at == ':';
    if (strncmp(text, own, sizeof own - 1) == 0 ||
        strncmp(at, whole, sizeof whole - 1) == 0) {
        move_say(facts, text);
        return;
    }
    snprintf(place, sizeof place,
             "%.*s the file is no move for this rig that can be added, which "
             "slew check explains",
             (int)(at - text), text);
    move_say(facts, place);
}

/* The errors of the job, and that it is not to be played. */
static void move_refuse(struct service_move_facts *facts, const struct job *job,
                        enum status status)
{
    enum message_kind kind;
    const char *text;
    facts->status = status;
    for (size_t at = 0;
         (text = messages_next(&job->messages, &at, &kind)) != NULL;)
        if (kind == MESSAGE_ERROR)
            move_say_error(facts, text);
}

static void move_say_violations(struct service_move_facts *facts,
                                struct job *job)
{
    const uint32_t count = job->violation_count;
    cJSON *object = cJSON_CreateObject();
    if (count > MOVE_VIOLATIONS)
        job->violation_count = MOVE_VIOLATIONS;
    job_json_violations(job, object);
    job->violation_count = count;
    cJSON_AddNumberToObject(object, "violation_count", count);
    if (!cJSON_PrintPreallocated(object, facts->said, sizeof facts->said - 8,
                                 false)) {
        cJSON_DeleteItemFromObject(object, "fit");
        if (!cJSON_PrintPreallocated(object, facts->said,
                                     sizeof facts->said - 8, false))
            facts->said[0] = '\0';
    }
    cJSON_Delete(object);
}

static void move_judge(struct service_move_facts *facts, struct job *job)
{
    job_check(job, MOTION_CLOCK_WARP_ONE_Q30);
    if (job->violation_count > 0) {
        move_refuse(facts, job, STATUS_REFUSED);
        move_say(facts, "the move breaks limits of the rig");
    } else if (!job_shots_check(job, MOTION_CLOCK_WARP_ONE_Q30,
                                &job->messages) ||
               !budget_check(&job->rig, job->rig_path, &job->messages)) {
        move_refuse(facts, job, STATUS_REFUSED);
    }
    move_say_violations(facts, job);
}

static void move_of_axis(struct service_move *move, struct job *job, unsigned i)
{
    struct service_move_axis *axis = &move->axis[job->rig_axis[i]];
    const struct plan_axis *plan = &job->move.axis[i];
    axis->is_driven = true;
    axis->by_profile = job->goal[i] != NULL;
    axis->track = job->track[i];
    motion_track_summarise(&axis->track, &axis->summary);
    axis->goal = job->goal[i];
    axis->goal_count = job->goal_count[i];
    axis->key_count = plan->key_count;
    axis->key_ns_q12 = memory_pool_new(&move->memory, plan->key_count,
                                       sizeof *axis->key_ns_q12);
    for (uint32_t k = 0; k < plan->key_count; k++)
        axis->key_ns_q12[k] = plan->key[k].key.t_ns_q12;
}

static void move_of_job(struct service_move *move, struct job *job)
{
    struct service_move_facts *facts = &move->facts;
    const struct plan_move *plan = &job->move;
    memcpy(facts->title, plan->title, sizeof facts->title);
    facts->end_ns_q12 = job->end_ns_q12;
    facts->times = plan->times < 0 ? 0 : plan->times > 0 ? plan->times : 1;
    facts->fps = (struct units_fps){ plan->fps_num, plan->fps_den };
    facts->is_ping_pong = plan->is_ping_pong;
    facts->is_warped = plan->warp != NULL;
    facts->is_sampled = job_sampled(job) != NULL;
    facts->has_events = job_has_shots(job);
    facts->steps = job->steps;
    facts->step_line =
        job->step_line == NULL ? -1 : (int)(job->step_line - job->rig.line);
    if (facts->status != STATUS_OK)
        return;
    for (unsigned i = 0; i < plan->axis_count; i++)
        move_of_axis(move, job, i);
    for (unsigned i = 0; i < job->rig.line_count; i++)
        move->shots[i] = job->shots[i];
}

void service_move_plan(const struct files *files, const struct rig *rig,
                       const char *rig_path,
                       const struct plan_progress *progress, FILE *out)
{
    struct service_move *move = memory_new(1, sizeof *move);
    struct job *job = memory_new(1, sizeof *job);
    struct move_pass pass = { .file = out };
    move_reserve(move, rig);
    move->facts.status =
        job_open_on(job, files, rig, rig_path, SERVICE_MOVE_NAME, progress);
    if (move->facts.status != STATUS_OK) {
        move_refuse(&move->facts, job, move->facts.status);
    } else {
        move_judge(&move->facts, job);
        move_of_job(move, job);
    }
    move_pass(&pass, move, rig);
    (void)fflush(out);
    job_free(job);
    memory_free(job);
    service_move_free(move);
}

/* --- the service --- */

static void motion_reserve(struct service_motion *motion, unsigned axes,
                           struct memory_pool *memory)
{
    motion->track =
        memory_pool_new(memory, axes, sizeof(struct motion_track *));
    motion->goal =
        memory_pool_new(memory, axes, sizeof(struct controller_goal *));
    motion->goal_count =
        memory_pool_new(memory, axes, sizeof *motion->goal_count);
}

static void move_motion(struct service_move *move, const struct rig *rig)
{
    motion_reserve(&move->motion, rig->axis_count, &move->memory);
    motion_reserve(&move->approach, rig->axis_count, &move->memory);
    for (unsigned i = 0; i < rig->axis_count; i++) {
        const struct service_move_axis *axis = &move->axis[i];
        if (!axis->is_driven)
            continue;
        move->motion.track[i] = &axis->track;
        move->motion.goal[i] = axis->by_profile ? axis->goal : NULL;
        move->motion.goal_count[i] = axis->goal_count;
    }
    move->motion.steps = move->facts.steps;
    move->motion.step_line = move->facts.step_line;
    move->motion.shots = move->facts.has_events ? move->shots : NULL;
}

struct service_move *service_move_read(void *bytes, size_t size,
                                       const struct rig *rig, const char *text)
{
    struct service_move *move = memory_new(1, sizeof *move);
    struct move_pass pass = { .bytes = bytes, .size = size };
    const size_t length = strlen(text) + 1;
    move_reserve(move, rig);
    move_pass(&pass, move, rig);
    if (pass.failed) {
        service_move_free(move);
        return NULL;
    }
    move->bytes = bytes;
    move->size = size;
    move_motion(move, rig);
    char *copy = memory_pool_new(&move->memory, length, 1);
    memcpy(copy, text, length);
    move->file_text = copy;
    return move;
}

void service_move_free(struct service_move *move)
{
    if (move == NULL)
        return;
    if (move->bytes != NULL)
        (void)munmap(move->bytes, move->size);
    if (move->lent != NULL)
        *move->lent = false;
    memory_pool_free(&move->memory);
    memory_free(move);
}

static int approach_axis(struct service_move *move, const struct rig *rig,
                         unsigned i, int64_t pos_q32)
{
    struct service_move_axis *axis = &move->axis[i];
    struct motion_track *track = &axis->approach.track;
    motion_track_init(track, axis->approach.storage, JOB_APPROACH_SEGMENTS,
                      pos_q32);
    const struct plan_limit limit = rig_rails_limit(rig, i);
    const int any = job_approach(&limit, &axis->track, 0, track);
    if (any <= 0)
        return any;
    move->approach.track[i] = track;
    if (axis->by_profile &&
        controller_goals_of(track, &axis->approach.goal, 1) > 0) {
        move->approach.goal[i] = &axis->approach.goal;
        move->approach.goal_count[i] = 1;
    }
    return 1;
}

static void approach_refusal(const struct service_move *move,
                             const struct rig *rig, unsigned i, int err,
                             int64_t pos_q32, char why[JOB_APPROACH_TEXT_MAX])
{
    struct motion_cursor cursor = { 0 };
    struct motion_sample to;
    motion_track_sample(&move->axis[i].track, &cursor, 0, &to);
    job_approach_text(&rig->axis[i], err, pos_q32, to.pos_q32, why);
}

int service_move_approach(struct service_move *move, const struct rig *rig,
                          const struct machine_view_axis axis[],
                          char why[JOB_APPROACH_TEXT_MAX])
{
    struct service_motion *approach = &move->approach;
    int any = 0;
    for (unsigned i = 0; i < rig->axis_count; i++) {
        approach->track[i] = NULL;
        approach->goal[i] = NULL;
        approach->goal_count[i] = 0;
        if (!move->axis[i].is_driven)
            continue;
        const int err = approach_axis(move, rig, i, axis[i].demand_q32);
        if (err < 0) {
            approach_refusal(move, rig, i, err, axis[i].demand_q32, why);
            return err;
        }
        any |= err;
    }
    return any;
}

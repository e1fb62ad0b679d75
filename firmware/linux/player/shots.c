/* firmware/linux/player/shots.c - see shots.h. */
#include "firmware/linux/player/shots.h"

#include <inttypes.h>
#include <string.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/job/job_shots.h"
#include "motion/core/clock_warp.h"
#include "motion/core/fixed.h"

/* --- what is planned --- */

void shots_plan_print(const struct job *job, FILE *file)
{
    for (unsigned i = 0; i < job->rig.line_count; i++) {
        const struct plan_shots *shots = &job->shots[i];
        int64_t apart_ns;
        if (shots->count == 0)
            continue;
        fprintf(file, "%s: %" PRIu32 " shot%s", job->rig.line[i].name,
                shots->count, shots->count == 1 ? "" : "s");
        job_shots_closest(shots, MOTION_CLOCK_WARP_ONE_Q30, &apart_ns);
        if (shots->count > 1)
            fprintf(file, ", %.3f ms apart or more", (double)apart_ns / 1e6);
        fprintf(file, ", %.0f ms wide",
                (double)job->rig.line[i].width_ns / 1e6);
        if (job->rig.line[i].lead_ns > 0)
            fprintf(file, ", %.0f ms ahead",
                    (double)job->rig.line[i].lead_ns / 1e6);
        fputc('\n', file);
    }
}

void shots_plan_json(const struct job *job, cJSON *object)
{
    cJSON *list = cJSON_AddArrayToObject(object, "triggers");
    for (unsigned i = 0; i < job->rig.line_count; i++) {
        const struct plan_shots *shots = &job->shots[i];
        if (shots->count == 0)
            continue;
        cJSON *item = cJSON_CreateObject();
        cJSON_AddItemToArray(list, item);
        cJSON_AddStringToObject(item, "line", job->rig.line[i].name);
        cJSON *times = cJSON_AddArrayToObject(item, "path_s");
        for (uint32_t k = 0; k < shots->count; k++)
            cJSON_AddItemToArray(
                times, cJSON_CreateNumber(
                           number_double(shots->t_ns_q12[k], 12) / 1e9));
    }
}

/* --- what was fired --- */

void shots_init(struct shots *shots, const struct job *job)
{
    *shots = (struct shots){ .job = job };
    for (unsigned i = 0; i < job->rig.line_count; i++) {
        if (job->rig.line[i].kind != RIG_LINE_TRIGGER)
            continue;
        shots->line[shots->count++] = (struct shots_line){
            .line = i,
            .seen =
                memory_new(job->shots[i].count + 1, sizeof(struct shots_seen)),
        };
    }
}

void shots_free(struct shots *shots)
{
    for (unsigned i = 0; i < shots->count; i++)
        memory_free(shots->line[i].seen);
    *shots = (struct shots){ .job = NULL };
}

/* At a rate: time on the clock. */
static int64_t shots_at_rate_ns(int64_t path_ns_q12, int64_t rate_q30)
{
    int64_t ns_q12 = path_ns_q12;
    if (rate_q30 > 0 &&
        motion_fixed_muldiv(path_ns_q12, MOTION_CLOCK_WARP_ONE_Q30, rate_q30,
                            &ns_q12) < 0)
        ns_q12 = path_ns_q12;
    return ns_q12 / MOTION_FIXED_NS_Q12;
}

/* How long before the tick's nominal time, and the line's lead, the path's time
 * was that of the shot: by the rate half-way to there. */
static int64_t shots_since_ns(const struct motion_clock_rate *aim,
                              int64_t t_ns_q12)
{
    const int64_t beyond_ns_q12 = aim->s_ns_q12 - t_ns_q12;
    int64_t change_q30 = 0;
    (void)motion_fixed_muldiv(aim->accel_q30,
                              shots_at_rate_ns(beyond_ns_q12, aim->rate_q30),
                              2 * INT64_C(1000000000), &change_q30);
    return shots_at_rate_ns(beyond_ns_q12, aim->rate_q30 - change_q30);
}

static void shots_take_line(struct shots *shots, unsigned i,
                            const struct telemetry_row *row)
{
    struct shots_line *line = &shots->line[i];
    const struct plan_shots *planned = &shots->job->shots[line->line];
    const struct telemetry_shot *shot = &row->shot[i];
    if (shot->number == 0 || shot->number > planned->count)
        return;
    const int64_t late_ns =
        shot->t_ns - row->t_ns +
        shots_since_ns(&shot->aim, planned->t_ns_q12[shot->number - 1]);
    line->seen[shot->number - 1] = (struct shots_seen){ shot->t_ns, late_ns };
    line->fired++;
    if (late_ns > line->late_ns)
        line->late_ns = late_ns;
}

void shots_take(struct shots *shots, const struct telemetry_row *row)
{
    if (row->phase < TELEMETRY_MOVE)
        shots->start_ns = row->t_ns;
    for (unsigned i = 0; i < shots->count; i++)
        shots_take_line(shots, i, row);
}

void shots_print(const struct shots *shots, FILE *file)
{
    for (unsigned i = 0; i < shots->count; i++) {
        const struct shots_line *line = &shots->line[i];
        const uint32_t planned = shots->job->shots[line->line].count;
        if (planned == 0)
            continue;
        fprintf(file, "%s: %" PRIu32 " of %" PRIu32 " %s",
                shots->job->rig.line[line->line].name, line->fired, planned,
                number_word(planned, "shot", "shots"));
        if (line->fired > 0)
            fprintf(file, ", at most %.3f ms late",
                    (double)line->late_ns / 1e6);
        if (line->failures > 0)
            fprintf(file, ", the line could not be set %" PRIu32 " %s",
                    line->failures,
                    number_word(line->failures, "time", "times"));
        fputc('\n', file);
    }
}

static cJSON *shots_json_seen(const struct shots *shots,
                              const struct shots_line *line, uint32_t i)
{
    const struct plan_shots *planned = &shots->job->shots[line->line];
    cJSON *item = cJSON_CreateObject();
    cJSON_AddNumberToObject(item, "path_s",
                            number_double(planned->t_ns_q12[i], 12) / 1e9);
    cJSON_AddNumberToObject(
        item, "t_s", (double)(line->seen[i].t_ns - shots->start_ns) / 1e9);
    cJSON_AddNumberToObject(item, "late_ms",
                            (double)line->seen[i].late_ns / 1e6);
    return item;
}

void shots_json(const struct shots *shots, cJSON *object)
{
    cJSON *list = cJSON_AddArrayToObject(object, "triggers");
    for (unsigned i = 0; i < shots->count; i++) {
        const struct shots_line *line = &shots->line[i];
        cJSON *item = cJSON_CreateObject();
        cJSON_AddItemToArray(list, item);
        cJSON_AddStringToObject(item, "line",
                                shots->job->rig.line[line->line].name);
        cJSON_AddNumberToObject(item, "planned",
                                shots->job->shots[line->line].count);
        cJSON_AddNumberToObject(item, "fired", line->fired);
        cJSON_AddNumberToObject(item, "failures", line->failures);
        cJSON *seen = cJSON_AddArrayToObject(item, "shots");
        for (uint32_t k = 0; k < line->fired; k++)
            cJSON_AddItemToArray(seen, shots_json_seen(shots, line, k));
    }
}

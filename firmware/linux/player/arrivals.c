/* firmware/linux/player/arrivals.c - see arrivals.h. */
#include "firmware/linux/player/arrivals.h"

#include <string.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/host/job/job_goals.h"
#include "motion/core/clock_warp.h"
#include "motion/core/fixed.h"

#define ARRIVALS_ROWS 40 /* of the table */

void arrivals_init(struct arrivals *arrivals, const struct job *job)
{
    memset(arrivals, 0, sizeof *arrivals);
    arrivals->job = job;
    arrivals->axis = memory_pool_new(&arrivals->memory, job->move.axis_count,
                                     sizeof *arrivals->axis);
    for (unsigned i = 0; i < job->move.axis_count; i++)
        if (job->goal[i] != NULL)
            arrivals->axis[i].seen = memory_pool_new(
                &arrivals->memory, (size_t)job->goal_count[i] + 1,
                sizeof *arrivals->axis[i].seen);
}

void arrivals_free(struct arrivals *arrivals)
{
    memory_pool_free(&arrivals->memory);
    memset(arrivals, 0, sizeof *arrivals);
}

/* From path time t to the tick, on the clock. */
static int64_t arrivals_since_ns(const struct telemetry_row *row,
                                 int64_t t_ns_q12)
{
    const int64_t beyond_ns_q12 = row->rate.s_ns_q12 - t_ns_q12;
    int64_t ns_q12;
    if (row->rate.rate_q30 <= 0 ||
        motion_fixed_muldiv(beyond_ns_q12, MOTION_CLOCK_WARP_ONE_Q30,
                            row->rate.rate_q30, &ns_q12) < 0)
        ns_q12 = beyond_ns_q12;
    return ns_q12 / MOTION_FIXED_NS_Q12;
}

static int64_t arrivals_key_ns_q12(const struct arrivals *arrivals, unsigned i,
                                   unsigned goal)
{
    const struct job *job = arrivals->job;
    return job->move.axis[i].key[job_goals_key(job, i, goal)].key.t_ns_q12;
}

static void arrivals_take_axis(struct arrivals *arrivals, unsigned i,
                               const struct telemetry_row *row)
{
    struct arrivals_axis *axis = &arrivals->axis[i];
    const struct telemetry_axis *at = &row->axis[arrivals->job->rig_axis[i]];
    if (axis->seen == NULL || at->goals <= axis->count ||
        axis->count >= arrivals->job->goal_count[i])
        return;
    const struct controller_goal *goal = &arrivals->job->goal[i][axis->count];
    axis->seen[axis->count] = (struct arrivals_seen){
        .t_ns = row->t_ns - arrivals->start_ns,
        .after_ns = arrivals_since_ns(row, goal->end_ns_q12),
        .before_ns = -arrivals_since_ns(
            row, arrivals_key_ns_q12(arrivals, i, axis->count)),
        .off_q32 = at->actual_q32 - goal->pos_q32,
    };
    axis->count++;
}

void arrivals_take(struct arrivals *arrivals, const struct telemetry_row *row)
{
    if (row->phase < TELEMETRY_MOVE)
        arrivals->start_ns = row->t_ns;
    if (row->phase != TELEMETRY_MOVE)
        return;
    for (unsigned i = 0; i < arrivals->job->move.axis_count; i++)
        arrivals_take_axis(arrivals, i, row);
}

/* --- telling it --- */

static void arrivals_row(struct table *table, const struct arrivals *arrivals,
                         unsigned i, unsigned goal)
{
    const struct arrivals_seen *seen = &arrivals->axis[i].seen[goal];
    char text[NUMBER_MAX];
    table_cell(table, "%s", arrivals->job->move.axis[i].name);
    table_cell(table, "%u", job_goals_key(arrivals->job, i, goal) + 1);
    number_seconds(text, arrivals_key_ns_q12(arrivals, i, goal));
    table_cell(table, "%s s", text);
    if (goal >= arrivals->axis[i].count) {
        table_cell(table, "not reached");
        table_cell(table, "-");
        table_cell(table, "-");
        table_cell(table, "-");
        return;
    }
    table_cell(table, "%.3f s", (double)seen->t_ns / 1e9);
    table_cell(table, "%.0f ms", (double)seen->before_ns / 1e6);
    number_short(text, seen->off_q32, 32);
    table_cell(table, "%s", text);
    table_cell(table, "%s",
               units_axis_text(job_rig_axis(arrivals->job, i)->unit));
}

static void arrivals_table(const struct arrivals *arrivals, unsigned i,
                           FILE *file)
{
    static const char *const head[] = {
        "<axis",      ">key", ">its time", ">there at",
        ">before it", ">off", "<unit",
    };
    const unsigned count = arrivals->job->goal_count[i];
    struct table table;
    table_init(&table, 7, head);
    for (unsigned k = 0; k < count && k < ARRIVALS_ROWS; k++)
        arrivals_row(&table, arrivals, i, k);
    table_print(&table, file);
    table_free(&table);
}

static void arrivals_sum(const struct arrivals *arrivals, unsigned i,
                         FILE *file)
{
    const struct arrivals_axis *axis = &arrivals->axis[i];
    int64_t late_ns = INT64_MIN;
    fprintf(file, "%s: at %u of %u keys", arrivals->job->move.axis[i].name,
            axis->count, arrivals->job->goal_count[i]);
    for (unsigned k = 0; k < axis->count; k++)
        if (axis->seen[k].after_ns > late_ns)
            late_ns = axis->seen[k].after_ns;
    if (axis->count > 0)
        fprintf(file, ", at most %.0f ms after the end of its profile",
                (double)late_ns / 1e6);
    fputc('\n', file);
}

void arrivals_print(const struct arrivals *arrivals, FILE *file)
{
    for (unsigned i = 0; i < arrivals->job->move.axis_count; i++) {
        if (arrivals->axis[i].seen == NULL)
            continue;
        fputc('\n', file);
        arrivals_table(arrivals, i, file);
        arrivals_sum(arrivals, i, file);
    }
}

void arrivals_json(const struct arrivals *arrivals, unsigned index,
                   cJSON *object)
{
    const struct arrivals_axis *axis = &arrivals->axis[index];
    if (axis->seen == NULL)
        return;
    cJSON *list = cJSON_AddArrayToObject(object, "keys");
    for (unsigned k = 0; k < arrivals->job->goal_count[index]; k++) {
        cJSON *item = cJSON_CreateObject();
        cJSON_AddItemToArray(list, item);
        cJSON_AddNumberToObject(item, "key",
                                job_goals_key(arrivals->job, index, k) + 1);
        cJSON_AddNumberToObject(
            item, "time_s",
            number_double(arrivals_key_ns_q12(arrivals, index, k), 12) / 1e9);
        cJSON_AddBoolToObject(item, "reached", k < axis->count);
        if (k >= axis->count)
            continue;
        cJSON_AddNumberToObject(item, "there_s",
                                (double)axis->seen[k].t_ns / 1e9);
        cJSON_AddNumberToObject(item, "before_ms",
                                (double)axis->seen[k].before_ns / 1e6);
        json_add_fixed(item, "off", axis->seen[k].off_q32, 32);
    }
}

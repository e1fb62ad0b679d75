/* firmware/host/job/pictures.c - see pictures.h. */
#include "firmware/host/job/pictures.h"

#include <cjson/cJSON.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "motion/plan/shoot/plan_shoot.h"

#define PICTURES_COLUMNS 2 /* before those of the axes */

static uint32_t pictures_count(const struct job *job)
{
    return job->move.shoot != NULL ? job->move.shoot->frames : 0;
}

static int64_t pictures_open_ns_q12(const struct job *job, uint32_t picture)
{
    struct plan_shoot_times times;

    plan_shoot_times(job->move.shoot, &times);
    return times.first_ns_q12 + picture * times.period_ns_q12;
}

static int64_t pictures_pos_q32(const struct job *job, unsigned axis,
                                int64_t t_ns_q12)
{
    struct motion_cursor cursor = { 0 };
    struct motion_sample at;

    motion_track_sample(&job->track[axis], &cursor, t_ns_q12, &at);
    return at.pos_q32;
}

void pictures_text(const struct job *job, FILE *file)
{
    const unsigned most = TABLE_COLUMNS_MAX - PICTURES_COLUMNS,
                   all = job->move.axis_count, axes = all < most ? all : most;
    char name[TABLE_COLUMNS_MAX][TABLE_CELL_MAX], text[NUMBER_MAX];
    const char *column[TABLE_COLUMNS_MAX] = { ">picture", ">opens at" };
    struct table table;

    if (pictures_count(job) == 0)
        return;
    for (unsigned i = 0; i < axes; i++) {
        snprintf(name[i], sizeof name[i], ">%s, %s", job->move.axis[i].name,
                 units_axis_text(job_rig_axis(job, i)->unit));
        column[PICTURES_COLUMNS + i] = name[i];
    }
    table_init(&table, PICTURES_COLUMNS + axes, column);
    for (uint32_t k = 0; k < pictures_count(job); k++) {
        const int64_t open_ns_q12 = pictures_open_ns_q12(job, k);
        number_seconds(text, open_ns_q12);
        table_cell(&table, "%u", k + 1);
        table_cell(&table, "%s s", text);
        for (unsigned i = 0; i < axes; i++) {
            number_fixed(text, pictures_pos_q32(job, i, open_ns_q12), 32, 3);
            table_cell(&table, "%s", text);
        }
    }
    fputc('\n', file);
    table_print(&table, file);
    table_free(&table);
    if (axes < all)
        fprintf(file, "%u more %s: --pictures FILE\n", all - axes,
                number_word(all - axes, "axis", "axes"));
}

void pictures_json(const struct job *job, cJSON *object)
{
    if (pictures_count(job) == 0)
        return;
    cJSON *list = cJSON_AddArrayToObject(object, "pictures");
    for (uint32_t k = 0; k < pictures_count(job); k++) {
        const int64_t open_ns_q12 = pictures_open_ns_q12(job, k),
                      close_ns_q12 =
                          open_ns_q12 + job->move.shoot->exposure_ns_q12;
        cJSON *item = cJSON_CreateObject();
        cJSON_AddItemToArray(list, item);
        cJSON_AddNumberToObject(item, "opens_s",
                                number_double(open_ns_q12, 12) / 1e9);
        cJSON_AddNumberToObject(item, "closes_s",
                                number_double(close_ns_q12, 12) / 1e9);
        cJSON *axes = cJSON_AddObjectToObject(item, "axes");
        for (unsigned i = 0; i < job->move.axis_count; i++)
            json_add_fixed(axes, job->move.axis[i].name,
                           pictures_pos_q32(job, i, open_ns_q12), 32);
    }
}

void pictures_csv(const struct job *job, FILE *file)
{
    char text[NUMBER_MAX];

    fputs("picture,opens_s,closes_s", file);
    for (unsigned i = 0; i < job->move.axis_count; i++)
        fprintf(file, ",%s_%s", job->move.axis[i].name,
                units_axis_text(job_rig_axis(job, i)->unit));
    fputc('\n', file);
    for (uint32_t k = 0; k < pictures_count(job); k++) {
        const int64_t open_ns_q12 = pictures_open_ns_q12(job, k),
                      close_ns_q12 =
                          open_ns_q12 + job->move.shoot->exposure_ns_q12;
        fprintf(file, "%u,%.9f,%.9f", k + 1,
                number_double(open_ns_q12, 12) / 1e9,
                number_double(close_ns_q12, 12) / 1e9);
        for (unsigned i = 0; i < job->move.axis_count; i++) {
            number_fixed(text, pictures_pos_q32(job, i, open_ns_q12), 32, 9);
            fprintf(file, ",%s", text);
        }
        fputc('\n', file);
    }
}

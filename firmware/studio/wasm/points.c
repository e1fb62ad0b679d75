/* firmware/studio/wasm/points.c - points in space that a move is made of: those of its
 * path, and keys of a subject; see plan.h. */
#include <cjson/cJSON.h>
#include <stdio.h>

#include "firmware/host/base/number.h"
#include "firmware/studio/wasm/plan.h"
#include "motion/plan/camera/plan_camera.h"
#include "motion/plan/path/plan_path.h"

#define POINTS_MOST 10000 /* of one list, as many as a person can tell apart */

/* A list of points: what it is, and the names in the move's file on the way to it. */
struct points {
    const char *kind, *unit;
    const char *const *path; /* ends with NULL */
    uint32_t axes;
};

static void points_add(cJSON *list, const struct points *of, uint32_t index,
                       const int64_t q32[PLAN_SPACE_AXES],
                       struct plan_place place, const int64_t *t_ns_q12)
{
    cJSON *point = cJSON_CreateObject(), *at, *path;
    char number[12];

    cJSON_AddStringToObject(point, "kind", of->kind);
    cJSON_AddNumberToObject(point, "index", index);
    if (t_ns_q12 != NULL)
        cJSON_AddNumberToObject(point, "t", number_double(*t_ns_q12, 12) / 1e9);
    at = cJSON_AddArrayToObject(point, "at");
    for (uint32_t i = 0; i < of->axes; i++)
        cJSON_AddItemToArray(at, cJSON_CreateNumber(number_double(q32[i], 32)));
    cJSON_AddStringToObject(point, "unit", of->unit);
    cJSON_AddNumberToObject(point, "line", place.line);
    cJSON_AddNumberToObject(point, "column", place.column);
    path = cJSON_AddArrayToObject(point, "path");
    for (const char *const *name = of->path; *name != NULL; name++)
        cJSON_AddItemToArray(path, cJSON_CreateString(*name));
    snprintf(number, sizeof number, "%u", (unsigned)index);
    cJSON_AddItemToArray(path, cJSON_CreateString(number));
    cJSON_AddItemToArray(list, point);
}

static void points_path(const struct studio_plan *plan, cJSON *list)
{
    static const char *const names[] = { "path", "points", NULL };
    const struct plan_path *path = plan->job.move.path;

    if (path == NULL)
        return;
    const struct points of = {
        .kind = "path",
        .unit = path->carrier != NULL
                    ? "mm"
                    : units_axis_text(
                          job_rig_axis(&plan->job, path->axis[0])->unit),
        .path = names,
        .axes = path->points.axes,
    };
    for (uint32_t i = 0; i < path->points.count && i < POINTS_MOST; i++)
        points_add(list, &of, i, path->points.point[i].q32,
                   path->points.point[i].place, NULL);
}

static void points_subject(cJSON *list, const struct plan_camera *camera,
                           const char *const names[])
{
    const struct points of = {
        .kind = "subject", .unit = "mm", .path = names, .axes = PLAN_SPACE_AXES
    };
    const struct plan_axis *subject =
        camera != NULL ? camera->following.subject : NULL;

    if (subject == NULL)
        return;
    for (uint32_t i = 0; i < subject[0].key_count && i < POINTS_MOST; i++) {
        const struct plan_key *key = &subject[0].key[i];
        int64_t q32[PLAN_SPACE_AXES];
        for (unsigned k = 0; k < PLAN_SPACE_AXES; k++)
            q32[k] = subject[k].key[i].key.pos_q32;
        points_add(list, &of, i, q32, key->place, &key->key.t_ns_q12);
    }
}

void studio_plan_points(const struct studio_plan *plan, cJSON *report)
{
    static const char *const camera[] = { "camera", "look", "subject", "keys",
                                          NULL };
    static const char *const tool[] = { "path",    "tool", "look",
                                        "subject", "keys", NULL };
    const struct plan_move *move = &plan->job.move;
    cJSON *list = cJSON_AddArrayToObject(report, "points");

    if (plan->status != STATUS_OK)
        return;
    points_path(plan, list);
    points_subject(list, move->camera, camera);
    if (move->path != NULL)
        points_subject(list, move->path->tool.look, tool);
}

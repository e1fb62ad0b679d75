/* firmware/studio/wasm/others.c - keys of a move that are no axis's: how much there is
 * of a pose, the warp of time, what a camera does beside its path; see plan.h. */
#include <cjson/cJSON.h>

#include "firmware/host/base/number.h"
#include "firmware/studio/wasm/plan.h"
#include "motion/plan/camera/plan_camera.h"
#include "motion/plan/plan_blend.h"

#define OTHERS_KEYS 10000 /* of one, as many as a person can tell apart */

static double others_seconds(int64_t t_ns_q12)
{
    return number_double(t_ns_q12, 12) / 1e9;
}

/* Name, and per key time in s, value, line, column.  The values of a warp are
 * times. */
static void others_add(cJSON *list, const char *kind, const char *name,
                       const struct plan_axis *curve, bool is_time)
{
    cJSON *other = cJSON_CreateObject();
    cJSON *keys;

    cJSON_AddStringToObject(other, "kind", kind);
    cJSON_AddStringToObject(other, "name", name);
    keys = cJSON_AddArrayToObject(other, "keys");
    for (uint32_t i = 0; i < curve->key_count && i < OTHERS_KEYS; i++) {
        const struct plan_key *key = &curve->key[i];
        const double numbers[4] = {
            others_seconds(key->key.t_ns_q12),
            is_time ? others_seconds(key->key.pos_q32)
                    : number_double(key->key.pos_q32, 32),
            key->place.line,
            key->place.column,
        };
        cJSON_AddItemToArray(keys, cJSON_CreateDoubleArray(numbers, 4));
    }
    cJSON_AddItemToArray(list, other);
}

void studio_plan_others(const struct studio_plan *plan, cJSON *report)
{
    const struct plan_move *move = &plan->job.move;
    cJSON *list = cJSON_AddArrayToObject(report, "others");

    if (plan->status != STATUS_OK)
        return;
    for (uint32_t i = 0; move->blend != NULL && i < move->blend->weights; i++) {
        const struct plan_axis *curve = &move->blend->weight[i].curve;
        others_add(list, "pose", curve->name, curve, false);
    }
    if (move->fade != NULL)
        others_add(list, "fade", "fade", &move->fade->weight, false);
    if (move->camera != NULL && move->camera->roll != NULL)
        others_add(list, "roll", "roll", move->camera->roll, false);
    if (move->warp != NULL)
        others_add(list, "warp", "warp", move->warp, true);
}

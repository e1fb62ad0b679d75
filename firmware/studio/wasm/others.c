/* firmware/studio/wasm/others.c - curves of a move that are no axis's: how much there is
 * of a pose, the warp of time, what a camera does beside its path; see plan.h. */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/number.h"
#include "firmware/studio/wasm/plan.h"
#include "motion/core/fixed.h"
#include "motion/plan/camera/plan_camera.h"
#include "motion/plan/plan_blend.h"
#include "motion/plan/plan_track.h"

#define OTHERS_KEYS 10000 /* of one, as many as a person can tell apart */

static struct studio_other others_pose(const struct plan_axis *curve)
{
    return (struct studio_other){ .curve = curve,
                                  .kind = "pose",
                                  .name = curve->name,
                                  .unit = "%",
                                  .path = { "blend", "weights", curve->name },
                                  .paths = 3,
                                  .scale = 100 };
}

bool studio_other(const struct studio_plan *plan, uint32_t index,
                  struct studio_other *other)
{
    const struct plan_move *move = &plan->job.move;
    const uint32_t poses = move->blend != NULL ? move->blend->weights : 0;
    struct studio_other single[3];
    uint32_t count = 0;

    if (plan->status != STATUS_OK)
        return false;
    if (index < poses) {
        *other = others_pose(&move->blend->weight[index].curve);
        return true;
    }
    if (move->fade != NULL)
        single[count++] =
            (struct studio_other){ &move->fade->weight,  "fade", "fade", "%",
                                   { "fade", "weight" }, 2,      100 };
    if (move->camera != NULL && move->camera->roll != NULL)
        single[count++] =
            (struct studio_other){ move->camera->roll,   "roll", "roll", "deg",
                                   { "camera", "roll" }, 2,      1 };
    if (move->warp != NULL)
        single[count++] =
            (struct studio_other){ move->warp, "warp", "warp", "s",
                                   { "warp" }, 1,      1 };
    if (index - poses >= count)
        return false;
    *other = single[index - poses];
    return true;
}

bool studio_other_named(const struct studio_plan *plan, const char *name,
                        struct studio_other *other)
{
    for (uint32_t i = 0; studio_other(plan, i, other); i++) {
        const bool is_pose = strcmp(other->kind, "pose") == 0;
        const char *own = other->name;
        if (is_pose
                ? strncmp(name, "pose ", 5) == 0 && strcmp(name + 5, own) == 0
                : strncmp(name, "the ", 4) == 0 && strcmp(name + 4, own) == 0)
            return true;
    }
    return false;
}

static double others_seconds(int64_t t_ns_q12)
{
    return number_double(t_ns_q12, 12) / 1e9;
}

/* The values of a warp are times. */
static double others_value(const struct studio_other *other, int64_t pos_q32)
{
    return strcmp(other->unit, "s") == 0
               ? others_seconds(pos_q32)
               : number_double(pos_q32, 32) * other->scale;
}

/* Per key time in s, value, line, column. */
static void others_add(cJSON *list, const struct studio_other *of)
{
    cJSON *other = cJSON_CreateObject();
    cJSON *keys;

    cJSON_AddStringToObject(other, "kind", of->kind);
    cJSON_AddStringToObject(other, "name", of->name);
    cJSON_AddStringToObject(other, "unit", of->unit);
    cJSON_AddStringToObject(other, "curve",
                            plan_curve_rules(of->curve->curve)->name);
    keys = cJSON_AddArrayToObject(other, "keys");
    for (uint32_t i = 0; i < of->curve->key_count && i < OTHERS_KEYS; i++) {
        const struct plan_key *key = &of->curve->key[i];
        const double numbers[4] = {
            others_seconds(key->key.t_ns_q12),
            others_value(of, key->key.pos_q32),
            key->place.line,
            key->place.column,
        };
        cJSON_AddItemToArray(keys, cJSON_CreateDoubleArray(numbers, 4));
    }
    cJSON_AddItemToArray(list, other);
}

void studio_plan_others(const struct studio_plan *plan, struct cJSON *report)
{
    cJSON *list = cJSON_AddArrayToObject(report, "others");
    struct studio_other other;

    for (uint32_t i = 0; studio_other(plan, i, &other); i++)
        others_add(list, &other);
}

/* Lowest and highest are those at both ends: no limit is judged here. */
STUDIO_EXPORT bool studio_plan_other_samples(const struct studio_plan *plan,
                                             uint32_t index, double from_s,
                                             double to_s, uint32_t columns,
                                             double *out)
{
    struct plan_error error = { .code = 0 };
    struct studio_other other;
    struct motion_track track;

    if (!(to_s >= from_s) || !studio_other(plan, index, &other) ||
        plan_axis_track(other.curve, &track, &error) < 0)
        return false;
    /* Of a warp position is time: ns in 2^-12 as it is in Q32. */
    const double unit = strcmp(other.unit, "s") == 0
                            ? 4294967296.0 / (double)MOTION_FIXED_S_Q12
                            : other.scale;
    for (uint32_t i = 0; i < columns; i++) {
        const double part = (to_s - from_s) / columns;
        double *column = out + (size_t)STUDIO_COLUMN * i;
        for (unsigned end = 0; end < 2; end++) {
            struct motion_state state;
            motion_track_state(&track, studio_time(from_s + part * (i + end)),
                               &state);
            const int64_t value[4] = { state.pos_q32, state.vel_q32,
                                       state.acc_q32, state.jerk_q32 };
            for (unsigned k = 0; k < 4; k++) {
                const double is = number_double(value[k], 32) * unit;
                double *pair = &column[(size_t)2 * k];
                pair[0] = end == 0 || is < pair[0] ? is : pair[0];
                pair[1] = end == 0 || is > pair[1] ? is : pair[1];
            }
        }
    }
    plan_track_free(&track);
    return true;
}

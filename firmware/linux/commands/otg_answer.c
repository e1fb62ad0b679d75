/* firmware/linux/commands/otg_answer.c - see otg_answer.h. */
#include "firmware/linux/commands/otg_answer.h"

#include <math.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/number.h"
#include "firmware/host/plot/plot_otg.h"
#include "motion/core/err.h"

/* What would be planned is not what the row says. */
static void otg_answer_lost(struct otg_answer *answer)
{
    static const enum motion_otg_field field[OTG_VALUES] = {
        [OTG_PF] = MOTION_OTG_FIELD_GOAL_POS,
        [OTG_VMAX] = MOTION_OTG_FIELD_VEL_MAX,
        [OTG_VMIN] = MOTION_OTG_FIELD_VEL_MIN,
        [OTG_AMAX] = MOTION_OTG_FIELD_ACC_MAX,
        [OTG_AMIN] = MOTION_OTG_FIELD_ACC_MIN,
        [OTG_JMAX] = MOTION_OTG_FIELD_JERK,
        [OTG_JDOWN] = MOTION_OTG_FIELD_JERK_DOWN,
    };
    answer->err = MOTION_E_RANGE;
    answer->fault.axis = answer->scaled.lost_axis;
    answer->fault.field = field[answer->scaled.lost];
}

static bool otg_answer_is_bent(const struct otg_answer *answer)
{
    static struct motion_otg_plan plan[MOTION_SYNC_AXES]; /* large */
    return answer->kind == MOTION_SYNC_PHASE && answer->err >= 0 &&
           motion_sync_make(answer->scaled.move, answer->header->axes,
                            MOTION_SYNC_STRAIGHT, plan, NULL) < 0;
}

void otg_answer_make(struct otg_answer *answer, long number,
                     const struct otg_header *header, const struct otg_row *row,
                     enum motion_sync_kind kind)
{
    answer->number = number;
    answer->header = header;
    answer->row = row;
    otg_row_scale(header, row, &answer->scaled);
    answer->kind = header->axes > 1 ? kind : MOTION_SYNC_NONE;
    if (header->axes == 1 && row->wanted_s > 0)
        answer->kind = MOTION_SYNC_TIME; /* none is as fast as it can be */
    answer->err = motion_sync_make(answer->scaled.move, header->axes,
                                   answer->kind, answer->plan, &answer->fault);
    if (answer->scaled.lost < OTG_VALUES)
        otg_answer_lost(answer);
    answer->bent = otg_answer_is_bent(answer);
}

/* --- what is wrong -------------------------------------------------------- */

static const struct {
    const char *column, *argument;
} otg_field[] = {
    [MOTION_OTG_FIELD_VEL_MAX] = { "vmax", "has to be above 0" },
    [MOTION_OTG_FIELD_VEL_MIN] = { "vmin", "has to be below 0" },
    [MOTION_OTG_FIELD_ACC_MAX] = { "amax", "has to be above 0" },
    [MOTION_OTG_FIELD_ACC_MIN] = { "amin", "has to be below 0" },
    [MOTION_OTG_FIELD_JERK] = { "jmax", "has to be 0 (no limit) or above" },
    [MOTION_OTG_FIELD_JERK_DOWN] = { "jdown",
                                     "has to be 0 (as jmax) or above and needs "
                                     "jmax" },
    [MOTION_OTG_FIELD_DURATION] = { "duration",
                                    "a velocity goal takes the least" },
    [MOTION_OTG_FIELD_START_VEL] = { "v0", NULL },
    [MOTION_OTG_FIELD_START_ACC] = { "a0", NULL },
    [MOTION_OTG_FIELD_GOAL_POS] = { "pf", NULL },
    [MOTION_OTG_FIELD_GOAL_VEL] = { "vf", NULL },
    [MOTION_OTG_FIELD_GOAL_ACC] = { "af", NULL },
};

static const char *otg_sentence(const struct otg_answer *answer)
{
    int err = answer->err;
    enum motion_otg_field field = answer->fault.field;
    if (err == MOTION_E_ARG && (size_t)field < ARRAY_LEN(otg_field) &&
        otg_field[field].argument != NULL)
        return otg_field[field].argument;
    if (err == MOTION_E_LIMIT && (field == MOTION_OTG_FIELD_GOAL_VEL ||
                                  field == MOTION_OTG_FIELD_GOAL_ACC))
        return "no motion inside the limits ends with it";
    if (err == MOTION_E_LIMIT && answer->kind == MOTION_SYNC_STRAIGHT)
        return "no straight line leads there inside the limits";
    if (err == MOTION_E_LIMIT)
        return "no motion inside the limits was found";
    if (err == MOTION_E_RANGE)
        return "the numbers of the row lie too far apart";
    return motion_err_text(err);
}

const char *otg_answer_status(const struct otg_answer *answer,
                              char text[OTG_ANSWER_TEXT])
{
    enum motion_otg_field field = answer->fault.field;
    const char *column = NULL;
    char axis[16] = "";
    if (answer->err >= 0)
        return "ok";
    if ((size_t)field < ARRAY_LEN(otg_field))
        column = otg_field[field].column;
    if (answer->header->axes > 1)
        snprintf(axis, sizeof axis, "_%d", answer->fault.axis + 1);
    snprintf(text, OTG_ANSWER_TEXT, "%s%s: %s",
             column ? column : motion_otg_field_text(field), axis,
             otg_sentence(answer));
    return text;
}

/* --- points --------------------------------------------------------------- */

/* What the nearest whole tick leaves of the goal (motion/otg/otg.h), in the
 * row's units. */
struct otg_residual {
    double position, velocity;
};

static struct otg_residual otg_answer_residual(const struct otg_answer *answer,
                                               int axis)
{
    const struct motion_otg_plan *plan = &answer->plan[axis];
    const int bits = answer->scaled.length[axis] - 32;
    return (struct otg_residual){
        ldexp((double)plan->residual_pos_q32, bits),
        ldexp((double)plan->residual_vel_q32, bits - answer->scaled.time),
    };
}

/* Start and goal are the row's own numbers, not sums that should come to
 * them. */
static struct otg_point otg_answer_point(const struct otg_answer *answer,
                                         int axis, int i)
{
    const struct motion_otg_plan *plan = &answer->plan[axis];
    const double *value = answer->row->value[axis];
    struct otg_point at = otg_plan_point(plan, i, answer->scaled.length[axis],
                                         answer->scaled.time);
    at.p += value[OTG_P0];
    if (answer->header->velocity) {
        at.p += value[OTG_V0] * at.t;
        at.v += value[OTG_V0];
    }
    if (i == plan->count) {
        struct otg_residual left = otg_answer_residual(answer, axis);
        at.v = value[OTG_VF] - left.velocity;
        at.a = value[OTG_AF];
        if (!answer->header->velocity)
            at.p = value[OTG_PF] - left.position;
    } else if (i == 0) {
        at.v = value[OTG_V0];
        at.a = value[OTG_A0];
    }
    return at;
}

/* Until the last axis is there. */
static double otg_answer_seconds(const struct otg_answer *answer)
{
    double last = 0;
    for (int axis = 0; axis < answer->header->axes; axis++)
        last = fmax(last,
                    otg_plan_seconds(&answer->plan[axis], answer->scaled.time));
    return last;
}

/* What the ramps that stand for steps of acceleration may add: each takes about
 * 2^-22 of the motion, or a few ticks. */
#define OTG_RAMPS_SHARE 1e-5
#define OTG_RAMPS_S     1e-8

/* How long the motion takes; with jmax 0 when its acceleration steps, which the
 * plan's ramps only come close to. */
static double otg_answer_duration(const struct otg_answer *answer)
{
    const double planned = otg_answer_seconds(answer);
    const double steps = answer->row->wanted_s > 0 ||
                                 answer->kind == MOTION_SYNC_PHASE ||
                                 answer->kind == MOTION_SYNC_STRAIGHT
                             ? (double)NAN
                             : otg_steps_seconds(answer->header, answer->row);

    return planned - steps <= OTG_RAMPS_SHARE * planned + OTG_RAMPS_S ? steps
                                                                      : planned;
}

/* --- tables --------------------------------------------------------------- */

void otg_answer_line(const struct otg_answer *answer, FILE *file)
{
    char text[OTG_ANSWER_TEXT];
    fprintf(file, "%ld,%s,", answer->number, otg_answer_status(answer, text));
    if (answer->err >= 0)
        fprintf(file, "%.17g", otg_answer_duration(answer));
    fputc('\n', file);
}

void otg_answer_segments(const struct otg_answer *answer, FILE *file)
{
    for (int axis = 0; axis < answer->header->axes && answer->err >= 0; axis++)
        for (int i = 0; i <= answer->plan[axis].count; i++) {
            struct otg_point at = otg_answer_point(answer, axis, i);
            fprintf(file, "%ld,%d,%.17g,%.17g,%.17g,%.17g,%.17g\n",
                    answer->number, axis, at.t, at.p, at.v, at.a, at.j);
        }
}

/* What is rounding alone is shown as what it stands for. */
static double otg_shown(double value, double most)
{
    return fabs(value) <= 1e-9 * most ? 0 : value;
}

void otg_answer_text(const struct otg_answer *answer, FILE *file)
{
    char text[OTG_ANSWER_TEXT];
    if (answer->err < 0) {
        fprintf(file, "%s\n", otg_answer_status(answer, text));
        return;
    }
    const double duration = otg_answer_duration(answer);
    const double ramps = otg_answer_seconds(answer) - duration;
    fprintf(file, "duration %.9g s\n", duration);
    if (ramps > 0)
        fprintf(file,
                "jmax 0: the acceleration steps; in the table steep ramps "
                "stand for its steps, by\nwhich it ends %.2g s later\n",
                ramps);
    fprintf(file, "\n%12s %14s %14s %14s %14s\n", "time", "position",
            "velocity", "acceleration", "jerk");
    for (int axis = 0; axis < answer->header->axes; axis++)
        for (int i = 0; i <= answer->plan[axis].count; i++) {
            const double *most = answer->row->value[axis];
            struct otg_point at = otg_answer_point(answer, axis, i);
            fprintf(file, "%12.6g %14.6g %14.6g %14.6g %14.6g\n", at.t, at.p,
                    at.v, otg_shown(at.a, most[OTG_AMAX]),
                    otg_shown(at.j, most[OTG_JMAX]));
        }
}

void otg_answer_residuals(const struct otg_answer *answer, FILE *file)
{
    for (int axis = 0; axis < answer->header->axes && answer->err >= 0;
         axis++) {
        struct otg_residual left = otg_answer_residual(answer, axis);
        if (left.position == 0 && left.velocity == 0)
            continue;
        if (answer->number >= 0)
            fprintf(file, "row %ld: ", answer->number);
        fprintf(file,
                "axis %d ends in the nearest whole tick: residual position "
                "%.6g, velocity %.6g\n",
                axis + 1, left.position, left.velocity);
    }
}

static cJSON *otg_point_json(const struct otg_point *at)
{
    cJSON *point = cJSON_CreateObject();
    cJSON_AddNumberToObject(point, "t", at->t);
    cJSON_AddNumberToObject(point, "p", at->p);
    cJSON_AddNumberToObject(point, "v", at->v);
    cJSON_AddNumberToObject(point, "a", at->a);
    cJSON_AddNumberToObject(point, "j", at->j);
    return point;
}

static cJSON *otg_axes_json(const struct otg_answer *answer)
{
    cJSON *axes = cJSON_CreateArray();
    for (int axis = 0; axis < answer->header->axes; axis++) {
        cJSON *points = cJSON_CreateArray();
        for (int i = 0; i <= answer->plan[axis].count; i++) {
            struct otg_point at = otg_answer_point(answer, axis, i);
            cJSON_AddItemToArray(points, otg_point_json(&at));
        }
        cJSON_AddItemToArray(axes, points);
    }
    return axes;
}

static cJSON *otg_residual_json(const struct otg_answer *answer)
{
    cJSON *axes = cJSON_CreateArray();
    for (int axis = 0; axis < answer->header->axes; axis++) {
        struct otg_residual left = otg_answer_residual(answer, axis);
        cJSON *one = cJSON_CreateObject();
        cJSON_AddNumberToObject(one, "p", left.position);
        cJSON_AddNumberToObject(one, "v", left.velocity);
        cJSON_AddItemToArray(axes, one);
    }
    return axes;
}

cJSON *otg_answer_json(const struct otg_answer *answer, bool segments)
{
    char text[OTG_ANSWER_TEXT];
    cJSON *row = cJSON_CreateObject();
    if (answer->number >= 0)
        cJSON_AddNumberToObject(row, "row", (double)answer->number);
    cJSON_AddStringToObject(row, "status", otg_answer_status(answer, text));
    if (answer->err < 0)
        return row;
    cJSON_AddNumberToObject(row, "duration", otg_answer_duration(answer));
    if (answer->kind == MOTION_SYNC_PHASE)
        cJSON_AddBoolToObject(row, "straight", !answer->bent);
    cJSON_AddItemToObject(row, "residual", otg_residual_json(answer));
    if (segments)
        cJSON_AddItemToObject(row, "axes", otg_axes_json(answer));
    return row;
}

/* --- picture -------------------------------------------------------------- */

static void otg_plot_axis(const struct otg_answer *answer, int axis,
                          struct plot_otg_axis *to)
{
    snprintf(to->name, sizeof to->name, "axis %d", axis + 1);
    to->velocity = answer->header->velocity;
    to->count = answer->plan[axis].count;
    to->value = answer->row->value[axis];
    for (int i = 0; i <= to->count; i++)
        to->point[i] = otg_answer_point(answer, axis, i);
}

int otg_answer_plot(const struct otg_answer *answer, const char *path)
{
    static struct plot_otg move; /* large */
    static char subtitle[160];
    const char *category = answer->row->category;
    char number[32] = "";
    if (answer->number >= 0)
        snprintf(number, sizeof number, "row %ld  \u00b7  ", answer->number);
    snprintf(subtitle, sizeof subtitle, "%s%s%s%d %s  \u00b7  %.9g s", number,
             category, category[0] ? "  \u00b7  " : "", answer->header->axes,
             number_word((uint64_t)answer->header->axes, "axis", "axes"),
             otg_answer_seconds(answer));
    move.title = answer->header->velocity ? "Fastest change of velocity"
                                          : "Fastest motion";
    move.subtitle = subtitle;
    move.axes = answer->header->axes;
    for (int axis = 0; axis < move.axes; axis++)
        otg_plot_axis(answer, axis, &move.axis[axis]);
    return plot_otg_save(&move, path);
}

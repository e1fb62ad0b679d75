/* firmware/linux/commands/otg/otg_answer.c - see otg_answer.h. */
#include "firmware/linux/commands/otg/otg_answer.h"

#include <math.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/number.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/commands/picture.h"
#include "motion/core/err.h"

#define OTG_ANSWER_TEXT 128 /* of a status, with its end */

void otg_answer_make(struct otg_answer *answer)
{
    struct otg_motion *motion = &answer->motion;
    const bool wanted = motion->leg[0].row.wanted_s > 0;
    if (motion->header->axes == 1) /* none is as fast as it can be */
        motion->kind = wanted ? MOTION_SYNC_TIME : MOTION_SYNC_NONE;
    otg_motion_make(motion);
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

/* The column of a value that was lost. */
static const enum motion_otg_field otg_lost[OTG_VALUES] = {
    [OTG_PF] = MOTION_OTG_FIELD_GOAL_POS,
    [OTG_VMAX] = MOTION_OTG_FIELD_VEL_MAX,
    [OTG_VMIN] = MOTION_OTG_FIELD_VEL_MIN,
    [OTG_AMAX] = MOTION_OTG_FIELD_ACC_MAX,
    [OTG_AMIN] = MOTION_OTG_FIELD_ACC_MIN,
    [OTG_JMAX] = MOTION_OTG_FIELD_JERK,
    [OTG_JDOWN] = MOTION_OTG_FIELD_JERK_DOWN,
};

static const char *otg_sentence(const struct otg_motion *motion,
                                enum motion_otg_field field)
{
    int err = motion->err;
    if (err == MOTION_E_ARG && (size_t)field < ARRAY_LEN(otg_field) &&
        otg_field[field].argument != NULL)
        return otg_field[field].argument;
    if (err == MOTION_E_LIMIT && (field == MOTION_OTG_FIELD_GOAL_VEL ||
                                  field == MOTION_OTG_FIELD_GOAL_ACC))
        return "no motion within the limits can end with it";
    if (err == MOTION_E_LIMIT && motion->kind == MOTION_SYNC_STRAIGHT)
        return "no straight line leads there inside the limits";
    if (err == MOTION_E_LIMIT)
        return "no motion inside the limits was found";
    if (err == MOTION_E_RANGE)
        return "the numbers of the row lie too far apart";
    return motion_err_text(err);
}

/* "vmax_2: what" */
static const char *otg_status(const struct otg_motion *motion, int axis,
                              enum motion_otg_field field, const char *what,
                              char text[OTG_ANSWER_TEXT])
{
    const char *column = NULL;
    char number[16] = "";
    if ((size_t)field < ARRAY_LEN(otg_field))
        column = otg_field[field].column;
    if (motion->header->axes > 1)
        snprintf(number, sizeof number, "_%d", axis + 1);
    snprintf(text, OTG_ANSWER_TEXT, "%s%s: %s",
             column ? column : motion_otg_field_text(field), number, what);
    return text;
}

static const char *otg_refusal(const struct otg_motion *motion,
                               char text[OTG_ANSWER_TEXT])
{
    enum motion_otg_field field = motion->fault.field;
    if (motion->err == MOTION_E_STATE)
        return "t: the motion before it has ended and not at rest";
    if (motion->lost < OTG_VALUES)
        field = otg_lost[motion->lost];
    return otg_status(motion, motion->fault.axis, field,
                      otg_sentence(motion, field), text);
}

/* Of a goal that replaces another: the first axis that does not go there. */
static int otg_not_new(const struct otg_motion *motion, int leg)
{
    for (int axis = 0; axis < motion->header->axes; axis++)
        if (motion->leg[leg].piece[axis].field != MOTION_OTG_FIELD_NONE)
            return axis;
    return -1;
}

static bool otg_is_kept(const struct otg_motion *motion, int leg)
{
    bool kept = true;
    for (int axis = 0; axis < motion->header->axes; axis++)
        kept &= motion->leg[leg].piece[axis].outcome == MOTION_OTG_KEPT;
    return kept;
}

/* Of a leg: "ok", "kept", or "vmax_2: has to be above 0": the column and one
 * sentence, without a comma. */
static const char *otg_answer_status(const struct otg_answer *answer, int leg,
                                     char text[OTG_ANSWER_TEXT])
{
    const struct otg_motion *motion = &answer->motion;
    if (motion->err < 0)
        return leg == motion->failed ? otg_refusal(motion, text) : "";
    const int axis = otg_not_new(motion, leg);
    if (axis < 0)
        return otg_is_kept(motion, leg) ? "kept" : "ok";
    const struct otg_piece *piece = &motion->leg[leg].piece[axis];
    return otg_status(motion, axis, piece->field,
                      piece->outcome == MOTION_OTG_KEPT
                          ? "no motion leads there: the row before goes on"
                          : "no motion leads there: it stops",
                      text);
}

bool otg_answer_is_refused(const struct otg_answer *answer)
{
    bool refused = answer->motion.err < 0;
    for (int leg = 0; leg < answer->motion.legs && !refused; leg++)
        refused = otg_not_new(&answer->motion, leg) >= 0;
    return refused;
}

/* --- durations ------------------------------------------------------------ */

/* What the ramps that stand for steps of acceleration may add: each takes about
 * 2^-22 of the motion, or a few ticks. */
#define OTG_RAMPS_SHARE 1e-5
#define OTG_RAMPS_S     1e-8

/* How long the motion takes; with jmax 0 when its acceleration steps, which the
 * plan's ramps only come close to. */
static double otg_answer_duration(const struct otg_answer *answer)
{
    const struct otg_motion *motion = &answer->motion;
    const double planned = otg_motion_seconds(motion);
    const double steps =
        motion->header->table != OTG_TABLE_SEPARATE ||
                motion->leg[0].row.wanted_s > 0 ||
                motion->kind == MOTION_SYNC_PHASE ||
                motion->kind == MOTION_SYNC_STRAIGHT
            ? (double)NAN
            : otg_steps_seconds(motion->header, &motion->leg[0].row);

    return planned - steps <= OTG_RAMPS_SHARE * planned + OTG_RAMPS_S ? steps
                                                                      : planned;
}

/* A motion of several rows has no number of its own. */
static long otg_row_number(const struct otg_answer *answer, int leg)
{
    return answer->motion.header->table == OTG_TABLE_SEPARATE ? answer->number
                                                              : leg;
}

/* --- tables --------------------------------------------------------------- */

void otg_answer_line(const struct otg_answer *answer, FILE *file)
{
    const struct otg_motion *motion = &answer->motion;
    char text[OTG_ANSWER_TEXT];
    for (int leg = 0; leg < motion->legs; leg++) {
        const char *status = otg_answer_status(answer, leg, text);
        if (status[0] == 0)
            continue;
        fprintf(file, "%ld,%s,", otg_row_number(answer, leg), status);
        if (motion->err >= 0)
            fprintf(file, "%.17g",
                    motion->header->table == OTG_TABLE_SEPARATE
                        ? otg_answer_duration(answer)
                        : motion->leg[leg].end_s);
        fputc('\n', file);
    }
}

/* The walk of an axis into a table. */
struct otg_table_row {
    const struct otg_answer *answer;
    FILE *file;
    int axis;
};

static void otg_segment_line(void *context, int leg, const struct otg_point *at)
{
    const struct otg_table_row *to = context;
    fprintf(to->file, "%ld,%d,%.17g,%.17g,%.17g,%.17g,%.17g\n",
            otg_row_number(to->answer, leg), to->axis, at->t, at->p, at->v,
            at->a, at->j);
}

/* What is rounding alone is shown as what it stands for. */
static double otg_shown(double value, double most)
{
    return fabs(value) <= 1e-9 * most ? 0 : value;
}

static void otg_text_line(void *context, int leg, const struct otg_point *at)
{
    const struct otg_table_row *to = context;
    const double *most = to->answer->motion.leg[leg].row.value[to->axis];
    fprintf(to->file, "%12.6g %14.6g %14.6g %14.6g %14.6g\n", at->t, at->p,
            at->v, otg_shown(at->a, most[OTG_AMAX]),
            otg_shown(at->j, most[OTG_JMAX]));
}

static void otg_table(const struct otg_answer *answer, FILE *file,
                      otg_motion_take *take)
{
    struct otg_table_row to = { answer, file, 0 };
    const int axes = answer->motion.header->axes;
    for (; to.axis < axes && answer->motion.err >= 0; to.axis++)
        otg_motion_walk(&answer->motion, to.axis, take, &to);
}

void otg_answer_segments(const struct otg_answer *answer, FILE *file)
{
    otg_table(answer, file, otg_segment_line);
}

void otg_answer_text(const struct otg_answer *answer, FILE *file)
{
    char text[OTG_ANSWER_TEXT];
    if (answer->motion.err < 0) {
        fprintf(file, "%s\n", otg_answer_status(answer, 0, text));
        return;
    }
    const double duration = otg_answer_duration(answer);
    const double ramps = otg_motion_seconds(&answer->motion) - duration;
    fprintf(file, "duration %.9g s\n", duration);
    if (ramps > 0)
        fprintf(file,
                "jmax 0: the acceleration steps; in the table steep ramps "
                "stand for its steps, by\nwhich it ends %.2g s later\n",
                ramps);
    fprintf(file, "\n%12s %14s %14s %14s %14s\n", "time", "position",
            "velocity", "acceleration", "jerk");
    otg_table(answer, file, otg_text_line);
}

static void otg_note_residual(const struct otg_answer *answer, int leg,
                              int axis)
{
    const struct otg_piece *piece = &answer->motion.leg[leg].piece[axis];
    const long number = otg_row_number(answer, leg);
    if (piece->residual_p == 0 && piece->residual_v == 0)
        return;
    if (number >= 0)
        fprintf(stderr, "row %ld: ", number);
    fprintf(stderr,
            "axis %d ends in the nearest whole tick: residual position %.6g, "
            "velocity %.6g\n",
            axis + 1, piece->residual_p, piece->residual_v);
}

void otg_answer_notes(const struct otg_answer *answer, bool refusals)
{
    const struct otg_motion *motion = &answer->motion;
    char text[OTG_ANSWER_TEXT];
    for (int leg = 0; leg < motion->legs; leg++) {
        const char *status = otg_answer_status(answer, leg, text);
        if (refusals && (motion->err < 0 || otg_not_new(motion, leg) >= 0) &&
            status[0] != 0)
            error_say("row %ld: %s", otg_row_number(answer, leg), status);
        for (int axis = 0; axis < motion->header->axes && motion->err >= 0;
             axis++)
            otg_note_residual(answer, leg, axis);
    }
}

/* --- JSON ----------------------------------------------------------------- */

static void otg_point_json(void *context, int leg, const struct otg_point *at)
{
    cJSON *points = context, *point = cJSON_CreateObject();
    (void)leg;
    cJSON_AddNumberToObject(point, "t", at->t);
    cJSON_AddNumberToObject(point, "p", at->p);
    cJSON_AddNumberToObject(point, "v", at->v);
    cJSON_AddNumberToObject(point, "a", at->a);
    cJSON_AddNumberToObject(point, "j", at->j);
    cJSON_AddItemToArray(points, point);
}

static cJSON *otg_axes_json(const struct otg_motion *motion)
{
    cJSON *axes = cJSON_CreateArray();
    for (int axis = 0; axis < motion->header->axes; axis++) {
        cJSON *points = cJSON_CreateArray();
        otg_motion_walk(motion, axis, otg_point_json, points);
        cJSON_AddItemToArray(axes, points);
    }
    return axes;
}

static cJSON *otg_residual_json(const struct otg_motion *motion)
{
    cJSON *axes = cJSON_CreateArray();
    for (int axis = 0; axis < motion->header->axes; axis++) {
        const struct otg_piece *piece = otg_motion_last(motion, axis);
        cJSON *one = cJSON_CreateObject();
        cJSON_AddNumberToObject(one, "p", piece->residual_p);
        cJSON_AddNumberToObject(one, "v", piece->residual_v);
        cJSON_AddItemToArray(axes, one);
    }
    return axes;
}

/* When each row's goal is reached, and how fast. */
static cJSON *otg_legs_json(const struct otg_answer *answer)
{
    const struct otg_motion *motion = &answer->motion;
    cJSON *legs = cJSON_CreateArray();
    for (int leg = 0; leg < motion->legs; leg++) {
        char text[OTG_ANSWER_TEXT];
        cJSON *one = cJSON_CreateObject(), *speeds = cJSON_CreateArray();
        cJSON_AddNumberToObject(one, "row", leg);
        cJSON_AddStringToObject(one, "status",
                                otg_answer_status(answer, leg, text));
        cJSON_AddNumberToObject(one, "t", motion->leg[leg].end_s);
        for (int axis = 0; axis < motion->header->axes; axis++)
            cJSON_AddItemToArray(
                speeds,
                cJSON_CreateNumber(motion->leg[leg].row.value[axis][OTG_VF]));
        cJSON_AddItemToObject(one, "v", speeds);
        cJSON_AddItemToArray(legs, one);
    }
    return legs;
}

cJSON *otg_answer_json(const struct otg_answer *answer, bool segments)
{
    const struct otg_motion *motion = &answer->motion;
    const bool several = motion->header->table != OTG_TABLE_SEPARATE;
    char text[OTG_ANSWER_TEXT];
    cJSON *row = cJSON_CreateObject();
    if (answer->number >= 0 || (several && motion->err < 0))
        cJSON_AddNumberToObject(row, "row",
                                (double)otg_row_number(answer, motion->failed));
    cJSON_AddStringToObject(
        row, "status",
        motion->err < 0 ? otg_answer_status(answer, motion->failed, text)
                        : "ok");
    if (motion->err < 0)
        return row;
    cJSON_AddNumberToObject(row, "duration", otg_answer_duration(answer));
    if (motion->kind == MOTION_SYNC_PHASE)
        cJSON_AddBoolToObject(row, "straight", !motion->bent);
    cJSON_AddItemToObject(row, "residual", otg_residual_json(motion));
    if (several)
        cJSON_AddItemToObject(row, "legs", otg_legs_json(answer));
    if (segments)
        cJSON_AddItemToObject(row, "axes", otg_axes_json(motion));
    return row;
}

/* --- picture -------------------------------------------------------------- */

int otg_answer_plot(const struct otg_answer *answer, const char *path)
{
    static const char *const title[] = {
        [OTG_TABLE_SEPARATE] = "Fastest motion",
        [OTG_TABLE_THROUGH] = "Motion through points",
        [OTG_TABLE_REPLAN] = "Motion to goals that replace each other",
    };
    const struct otg_motion *motion = &answer->motion;
    const struct otg_header *header = motion->header;
    const bool several = header->table != OTG_TABLE_SEPARATE;
    const char *category = several ? "" : motion->leg[0].row.category;
    char subtitle[160], number[32] = "";
    if (several)
        snprintf(number, sizeof number, "%d %s  \u00b7  ", motion->legs,
                 number_word((uint64_t)motion->legs, "row", "rows"));
    else if (answer->number >= 0)
        snprintf(number, sizeof number, "row %ld  \u00b7  ", answer->number);
    snprintf(subtitle, sizeof subtitle, "%s%s%s%d %s  \u00b7  %.9g s", number,
             category, category[0] ? "  \u00b7  " : "", header->axes,
             number_word((uint64_t)header->axes, "axis", "axes"),
             otg_motion_seconds(motion));
    return picture_of_otg(motion,
                          header->velocity ? "Fastest change of velocity"
                                           : title[header->table],
                          subtitle, path);
}

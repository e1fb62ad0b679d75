/* firmware/linux/commands/ports/sim_fit.h - slew sim fit: what the servos of a rig
 * are like, from a recording of them, into the rig file. */
#ifndef FIRMWARE_LINUX_COMMANDS_PORTS_SIM_FIT_H
#define FIRMWARE_LINUX_COMMANDS_PORTS_SIM_FIT_H

#include "firmware/host/base/status.h"
#include "firmware/host/move/move_text.h"
#include "firmware/linux/commands/options.h"
#include "firmware/linux/commands/planning.h"
#include "sim/identify/servo_fit.h"

#define SIM_FIT_WHY_MAX 256

/* An axis of the rig on its way from the recording to the rig file.  In its own
 * unit: values times `unit` of sim_fit_parameter. */
struct sim_fit_axis {
    const struct rig_axis *axis;
    double factor;     /* counts per unit, negative of a reversed axis */
    const char *other; /* why there is no model of it; NULL: there is */
    char why[SIM_FIT_WHY_MAX]; /* `other`, with figures */
    /* rows of the recording, in counts */
    double *target, *actual;
    uint32_t rows;
    uint32_t stood; /* so many of the last ones it has not moved */
    bool moved, ended;
    int64_t period_ns, last_ns;
    /* the models' places: as the rig has it, as it was fitted */
    double *before, *after;
    double was[SIM_MODEL_PARAMETERS];
    bool loaded; /* the rig gives it a load */
    struct sim_fit fit;
};

struct sim_fit_all {
    const struct options *options;
    char rig_path[PLANNING_PATH_MAX];
    const char *recording;
    struct rig rig;
    struct sim_fit_axis *axis; /* of the rig, in its order */
    uint32_t fitted;
    struct move_text text; /* of the rig */
    uint32_t edits;
};

struct sim_fit_parameter {
    const char *word;
    const char *json;
    bool in_load;
    unsigned per; /* of the axis's unit: 0 itself, 2 per s2; else: */
    const char *unit;
};
#define SIM_FIT_PLAIN 9 /* no unit of the axis */
const struct sim_fit_parameter *
sim_fit_parameter(const struct sim_fit_axis *axis, enum sim_model_parameter of);
/* Such a value as the rig file has it, "14 Hz" or "20 mm/s2". */
#define SIM_FIT_VALUE_MAX 48
void sim_fit_value(char text[SIM_FIT_VALUE_MAX],
                   const struct sim_fit_axis *axis, enum sim_model_parameter of,
                   double value);
/* What a value in counts is in the axis's unit, of that parameter. */
double sim_fit_in_unit(const struct sim_fit_axis *axis,
                       enum sim_model_parameter of, double value);

/* sim_fit_rows.c: the rows of every axis from the recording. */
enum status sim_fit_rows(struct sim_fit_all *all);
/* sim_fit_edit.c: the rig file's new text, all->text and all->edits. */
enum status sim_fit_edit(struct sim_fit_all *all);
/* sim_fit_say.c: what came of it.  Why an axis was left out; NULL: it was not, or
 * was not wanted. */
const char *sim_fit_left_out(const struct sim_fit_all *all, uint32_t axis);
void sim_fit_print(const struct sim_fit_all *all);
void sim_fit_json(const struct sim_fit_all *all);
enum status sim_fit_draw(const struct sim_fit_all *all);

enum status sim_fit_run(const struct options *options);

#endif

/* firmware/linux/commands/ports/sim_fit_say.c - what slew sim fit has found, as a
 * table, JSON and a picture; see sim_fit.h. */
#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/host/plot/plot_fit.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/commands/ports/sim_fit.h"

static const struct sim_fit_parameter fit_parameter[SIM_MODEL_PARAMETERS] = {
    [SIM_MODEL_BANDWIDTH] = { "bandwidth", "bandwidth_hz", false, SIM_FIT_PLAIN,
                              "Hz" },
    [SIM_MODEL_LOOP_DAMPING] = { "damping", "damping", false, SIM_FIT_PLAIN,
                                 "" },
    [SIM_MODEL_DELAY] = { NULL, "delay_periods", false, SIM_FIT_PLAIN, "" },
    [SIM_MODEL_INERTIA] = { "inertia", "load_inertia", true, SIM_FIT_PLAIN,
                            "" },
    [SIM_MODEL_FREQUENCY] = { "frequency", "load_frequency_hz", true,
                              SIM_FIT_PLAIN, "Hz" },
    [SIM_MODEL_LOAD_DAMPING] = { "damping", "load_damping", true, SIM_FIT_PLAIN,
                                 "" },
    [SIM_MODEL_FRICTION] = { "friction", "load_friction", true, 2, NULL },
    [SIM_MODEL_VISCOUS] = { "viscous", "load_viscous_1_s", true, SIM_FIT_PLAIN,
                            "" },
    [SIM_MODEL_BACKLASH] = { "backlash", "load_backlash", true, 0, NULL },
};
/* Of an axis with `loops`, in their map. */
static const struct sim_fit_parameter fit_loops[SIM_MODEL_DELAY] = {
    [SIM_MODEL_BANDWIDTH] = { "position", "position_loop_hz", false,
                              SIM_FIT_PLAIN, "Hz" },
    [SIM_MODEL_LOOP_DAMPING] = { "velocity", "velocity_loop_hz", false,
                                 SIM_FIT_PLAIN, "Hz" },
};

const struct sim_fit_parameter *
sim_fit_parameter(const struct sim_fit_axis *axis, enum sim_model_parameter of)
{
    if (axis->axis->sim.loops.given && of < ARRAY_LEN(fit_loops))
        return &fit_loops[of];
    return &fit_parameter[of];
}

/* What the model takes from the rig, as positions do not tell it. */
static const char *fit_kept(const struct rig_sim *sim)
{
    if (sim->loops.given && sim->motor.given)
        return "current and reset_time of its loops and its motor are the "
               "rig's: set points and positions do not hold them";
    if (sim->loops.given)
        return "current and reset_time of its loops are the rig's: set points "
               "and positions do not hold them";
    return sim->motor.given
               ? "its motor is the rig's: set points and positions "
                 "hold neither its heat nor a voltage that does "
                 "not limit it"
               : NULL;
}

static const char *const fit_model_word[] = { "rigid", "stiff", "compliant" };
static const char *const fit_model_text[] = {
    "a motor with a rigid load",
    "a load with friction, too stiff for its resonance to show",
    "a load that swings",
};

double sim_fit_in_unit(const struct sim_fit_axis *axis,
                       enum sim_model_parameter of, double value)
{
    return sim_fit_parameter(axis, of)->per == SIM_FIT_PLAIN
               ? value
               : value / fabs(axis->factor * 0x1p32);
}

/* Four digits, without an exponent, which a rig file has not. */
static void fit_digits(char text[SIM_FIT_VALUE_MAX], double value)
{
    const int before = value > 0 ? (int)floor(log10(value)) : 0;

    snprintf(text, SIM_FIT_VALUE_MAX, "%.*f",
             before >= 3   ? 0
             : before > -6 ? 3 - before
                           : 9,
             value);
    if (strchr(text, '.') == NULL)
        return;
    size_t length = strlen(text);
    while (text[length - 1] == '0')
        length--;
    text[text[length - 1] == '.' ? length - 1 : length] = 0;
}

void sim_fit_value(char text[SIM_FIT_VALUE_MAX],
                   const struct sim_fit_axis *axis, enum sim_model_parameter of,
                   double value)
{
    const struct sim_fit_parameter *const as = sim_fit_parameter(axis, of);
    char unit[NUMBER_UNIT_MAX];

    fit_digits(text, sim_fit_in_unit(axis, of, value));
    const char *const word = as->per == SIM_FIT_PLAIN
                                 ? as->unit
                                 : number_unit(unit, axis->axis->unit, as->per);
    if (word[0] != 0)
        snprintf(text + strlen(text), SIM_FIT_VALUE_MAX - strlen(text), " %s",
                 word);
}

static bool fit_is_in(const struct sim_fit_axis *self, unsigned p)
{
    return p < SIM_MODEL_RIGID || self->fit.model != SIM_FIT_RIGID;
}

static void fit_row(const struct sim_fit_axis *self, unsigned p,
                    struct table *table)
{
    const struct sim_fit_value *const value = &self->fit.parameter[p];
    const bool was = self->loaded || p < SIM_MODEL_DELAY;
    char text[SIM_FIT_VALUE_MAX];

    table_cell(table, "%s", p == SIM_MODEL_BANDWIDTH ? self->axis->name : "");
    const struct sim_fit_parameter *const as = sim_fit_parameter(self, p);
    table_cell(table, "%s%s",
               as->in_load                                          ? "load "
               : self->axis->sim.loops.given && p < SIM_MODEL_DELAY ? "loop "
                                                                    : "",
               p == SIM_MODEL_DELAY ? "delay, periods" : as->word);
    sim_fit_value(text, self, p, self->was[p]);
    table_cell(table, "%s", was ? text : "-");
    sim_fit_value(text, self, p, value->value);
    if (value->known && value->value == 0)
        snprintf(text, sizeof text, "none");
    table_cell(table, "%s", text);
    if (value->known && value->value > 0)
        table_cell(table, "%.2g", sim_fit_in_unit(self, p, value->deviation));
    else
        table_cell(table, "%s", value->known ? "" : "not shown by the run");
}

static void fit_axis_line(const struct sim_fit_axis *self)
{
    const double unit = fabs(self->factor * 0x1p32);

    printf("%s: %s; %.4g s; the model is off by %.3g %s rms, was %.3g\n",
           self->axis->name, fit_model_text[self->fit.model],
           1e-9 * (double)self->period_ns * self->rows, self->fit.rms / unit,
           units_axis_text(self->axis->unit), self->fit.rms_before / unit);
}

static void fit_print_kept(const struct sim_fit_all *all)
{
    for (uint32_t i = 0; i < all->rig.axis_count; i++) {
        const struct sim_fit_axis *const self = &all->axis[i];
        const char *const kept = fit_kept(&self->axis->sim);
        if (self->fit.plays > 0 && kept != NULL)
            printf("%s: %s\n", self->axis->name, kept);
    }
}

const char *sim_fit_left_out(const struct sim_fit_all *all, uint32_t axis)
{
    const struct sim_fit_axis *const self = &all->axis[axis];

    if (self->fit.plays > 0 || all->options->axis != NULL)
        return NULL;
    return self->other != NULL ? self->other
                               : "it does not move in the recording after a "
                                 "tenth of a second at rest";
}

static void fit_print_left_out(const struct sim_fit_all *all)
{
    for (uint32_t i = 0; i < all->rig.axis_count; i++) {
        const char *const why = sim_fit_left_out(all, i);
        if (why != NULL)
            printf("%s: left out, %s\n", all->axis[i].axis->name, why);
    }
}

static const char *fit_to(const struct sim_fit_all *all)
{
    return all->options->out != NULL ? all->options->out : all->rig_path;
}

void sim_fit_print(const struct sim_fit_all *all)
{
    static const char *const head[] = { "<axis", "<parameter", ">before",
                                        ">fitted", ">+-" };
    struct table table;

    for (uint32_t i = 0; i < all->rig.axis_count; i++)
        if (all->axis[i].fit.plays > 0)
            fit_axis_line(&all->axis[i]);
    fit_print_kept(all);
    fit_print_left_out(all);
    putchar('\n');
    table_init(&table, ARRAY_LEN(head), head);
    for (uint32_t i = 0; i < all->rig.axis_count; i++)
        for (unsigned p = 0;
             all->axis[i].fit.plays > 0 && p < SIM_MODEL_PARAMETERS; p++)
            if (fit_is_in(&all->axis[i], p))
                fit_row(&all->axis[i], p, &table);
    table_print(&table, stdout);
    table_free(&table);
    if (all->options->plot != NULL)
        printf("picture: %s\n", all->options->plot);
    if (all->options->dry_run)
        puts("nothing is written (--dry-run)");
    else
        printf("written to %s\n", fit_to(all));
}

/* ---- JSON ---- */

static cJSON *fit_json_axis(const struct sim_fit_axis *self)
{
    const double unit = fabs(self->factor * 0x1p32);
    cJSON *const item = cJSON_CreateObject();
    cJSON *const list = cJSON_CreateObject();

    cJSON_AddStringToObject(item, "axis", self->axis->name);
    cJSON_AddStringToObject(item, "unit", units_axis_text(self->axis->unit));
    cJSON_AddStringToObject(item, "model", fit_model_word[self->fit.model]);
    cJSON_AddNumberToObject(item, "rows", self->rows);
    cJSON_AddNumberToObject(item, "rms_before", self->fit.rms_before / unit);
    cJSON_AddNumberToObject(item, "rms", self->fit.rms / unit);
    if (fit_kept(&self->axis->sim) != NULL)
        cJSON_AddStringToObject(item, "kept", fit_kept(&self->axis->sim));
    cJSON_AddItemToObject(item, "parameters", list);
    for (unsigned p = 0; p < SIM_MODEL_PARAMETERS; p++) {
        const struct sim_fit_value *const value = &self->fit.parameter[p];
        if (!fit_is_in(self, p))
            continue;
        cJSON *const row = cJSON_CreateObject();
        if (self->loaded || p < SIM_MODEL_DELAY)
            cJSON_AddNumberToObject(row, "before",
                                    sim_fit_in_unit(self, p, self->was[p]));
        else
            cJSON_AddNullToObject(row, "before");
        cJSON_AddNumberToObject(row, "value",
                                sim_fit_in_unit(self, p, value->value));
        cJSON_AddNumberToObject(row, "deviation",
                                sim_fit_in_unit(self, p, value->deviation));
        cJSON_AddBoolToObject(row, "known", value->known);
        cJSON_AddItemToObject(list, sim_fit_parameter(self, p)->json, row);
    }
    return item;
}

static void fit_json_left_out(const struct sim_fit_all *all, cJSON *list)
{
    for (uint32_t i = 0; i < all->rig.axis_count; i++) {
        const char *const why = sim_fit_left_out(all, i);
        if (why == NULL)
            continue;
        cJSON *const item = cJSON_CreateObject();
        cJSON_AddStringToObject(item, "axis", all->axis[i].axis->name);
        cJSON_AddStringToObject(item, "why", why);
        cJSON_AddItemToArray(list, item);
    }
}

void sim_fit_json(const struct sim_fit_all *all)
{
    cJSON *const report = cJSON_CreateObject();

    cJSON_AddStringToObject(report, "recording", all->recording);
    cJSON *const list = cJSON_AddArrayToObject(report, "axes");
    for (uint32_t i = 0; i < all->rig.axis_count; i++)
        if (all->axis[i].fit.plays > 0)
            cJSON_AddItemToArray(list, fit_json_axis(&all->axis[i]));
    fit_json_left_out(all, cJSON_AddArrayToObject(report, "left_out"));
    if (all->options->plot != NULL)
        cJSON_AddStringToObject(report, "picture", all->options->plot);
    if (!all->options->dry_run)
        cJSON_AddStringToObject(report, "written", fit_to(all));
    json_report(report, true);
}

/* ---- the picture ---- */

/* What is behind the set point, in the axis's unit. */
static double *fit_following(const struct sim_fit_axis *self, const double *at)
{
    double *const value = memory_new(self->rows, sizeof *value);

    for (uint32_t i = 0; i < self->rows; i++)
        value[i] = (self->target[i] - at[i]) / (self->factor * 0x1p32);
    return value;
}

#define FIT_DRAWN 6 /* axes; more would be a picture as wide as a wall */

static int fit_write(const struct plot_fit *fit, const char *path)
{
    struct messages messages = { .text = NULL };
    struct output *const output = memory_new(1, sizeof *output);
    int err = output_open(output, path);

    if (err == 0) {
        const int drawn =
            plot_fit_write(fit, (enum plot_format)plot_format_of(path),
                           output->file, &messages);
        error_tell(&messages);
        err = drawn == 0 ? output_commit(output) : -1;
        if (drawn != 0)
            output_abandon(output);
    }
    memory_free(output);
    return err;
}

enum status sim_fit_draw(const struct sim_fit_all *all)
{
    struct plot_fit_axis axis[FIT_DRAWN] = { 0 };
    double *line[FIT_DRAWN][3];
    struct plot_fit fit = { .title = all->rig.title,
                            .subtitle = all->recording,
                            .axis = axis };

    if (all->options->plot == NULL)
        return STATUS_OK;
    for (uint32_t i = 0; i < all->rig.axis_count && fit.axes < FIT_DRAWN; i++) {
        const struct sim_fit_axis *const self = &all->axis[i];
        if (self->fit.plays == 0)
            continue;
        double **const to = line[fit.axes];
        to[0] = fit_following(self, self->actual);
        to[1] = fit_following(self, self->before);
        to[2] = fit_following(self, self->after);
        axis[fit.axes++] = (struct plot_fit_axis){
            .name = self->axis->name,
            .unit = units_axis_text(self->axis->unit),
            .rows = self->rows,
            .period_s = 1e-9 * (double)self->period_ns,
            .recorded = to[0],
            .before = to[1],
            .after = to[2],
        };
    }
    const int err = fit_write(&fit, all->options->plot);
    for (unsigned i = 0; i < fit.axes; i++)
        for (unsigned k = 0; k < 3; k++)
            memory_free(line[i][k]);
    return err < 0 ? STATUS_SYSTEM : STATUS_OK;
}

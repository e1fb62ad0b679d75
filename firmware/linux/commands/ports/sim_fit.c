/* firmware/linux/commands/ports/sim_fit.c - see sim_fit.h. */
#include "firmware/linux/commands/ports/sim_fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/plot/plot_page.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/commands/rig_text.h"
#include "firmware/linux/machine/kind.h"
#include "motion/core/err.h"

#define SIM_FIT_DELAY 3 /* periods: of a drive that takes set points at SYNC */

static const double fit_mrad_per_hz = 2e3 * 3.14159265358979323846;

/* ---- one axis ---- */

/* What the rig says of it; false: it cannot be simulated. */
static bool fit_begin(struct sim_fit_axis *self, struct sim_model_run *run)
{
    const struct rig_sim *const sim = &self->axis->sim;
    const double size = fabs(self->factor);
    int32_t start;

    *run = (struct sim_model_run){
        .period_ns = self->period_ns,
        .loop_ns = machine_kinds[self->axis->kind]->sim_loop_ns,
        .rows = self->rows,
        .target = self->target,
        .actual = self->actual,
        .has_loops = sim->loops.given,
        .has_winding = sim->motor.given,
    };
    machine_sim_load_config(self->axis, &run->load);
    machine_sim_loops_config(self->axis, &run->loops);
    machine_sim_winding_config(self->axis, &run->winding);
    self->loaded = sim->load.given;
    const double was[SIM_MODEL_PARAMETERS] = {
        [SIM_MODEL_BANDWIDTH] = sim->loops.given
                                    ? sim->loops.position_hz
                                    : sim->omega_mrad_s / fit_mrad_per_hz,
        [SIM_MODEL_LOOP_DAMPING] = sim->loops.given
                                       ? sim->loops.velocity_hz
                                       : fmin(2, 1e-3 * sim->zeta_permille),
        [SIM_MODEL_DELAY] = SIM_FIT_DELAY,
        [SIM_MODEL_INERTIA] = sim->load.inertia_ratio,
        [SIM_MODEL_FREQUENCY] = sim->load.frequency_hz,
        [SIM_MODEL_LOAD_DAMPING] = sim->load.damping,
        [SIM_MODEL_FRICTION] = (double)sim->load.friction_q32 * size,
        [SIM_MODEL_VISCOUS] = sim->load.viscous_1_s,
        [SIM_MODEL_BACKLASH] = (double)sim->load.backlash_q32 * size,
    };
    memcpy(self->was, was, sizeof was);
    return machine_sim_plant(self->axis, &run->plant, &start) == MOTION_OK;
}

static bool fit_tell(void *context, double part)
{
    const struct sim_fit_axis *const self = context;

    plan_progress_tell(&planning_progress, "fitting", self->axis->name,
                       (int64_t)(1000 * part), 1000);
    return true;
}

static double *fit_copy(const double *from, uint32_t rows)
{
    double *const to = memory_new(rows, sizeof *to);

    memcpy(to, from, rows * sizeof *to);
    return to;
}

static enum status fit_fail(const struct sim_fit_all *all,
                            const struct sim_fit_axis *self, const char *why)
{
    error_say("slew sim fit: %s: %s: %s", all->recording, self->axis->name,
              why);
    return STATUS_INPUT;
}

static enum status fit_axis(struct sim_fit_all *all, struct sim_fit_axis *self)
{
    double *const work = memory_new(SIM_FIT_WORK(self->rows), sizeof *work);
    struct sim_model_run run;
    int err = fit_begin(self, &run) ? MOTION_OK : MOTION_E_ARG;

    if (err == MOTION_OK)
        err = sim_model_play(&run, self->was, self->loaded, work,
                             work + self->rows);
    if (err == MOTION_OK) {
        self->before = fit_copy(work, self->rows);
        err = sim_fit(&run, self->was, self->loaded, fit_tell, self, work,
                      &self->fit);
        plan_progress_end(&planning_progress);
    }
    if (err == MOTION_OK)
        self->after = fit_copy(work, self->rows);
    memory_free(work);
    all->fitted += err == MOTION_OK;
    return err == MOTION_OK
               ? STATUS_OK
               : fit_fail(all, self, "no model of it can be computed");
}

/* ---- all of it ---- */

static bool fit_has(const struct sim_fit_axis *self)
{
    return self->other == NULL && self->rows >= SIM_FIT_ROWS_MIN;
}

static enum status fit_named(struct sim_fit_all *all)
{
    const int index = rig_axis_index(&all->rig, all->options->axis);
    char list[QUOTE_LIST_MAX];

    if (index < 0) {
        error_say("slew sim fit: --axis: '%s' is not an axis of the rig, "
                  "expected %s",
                  all->options->axis, rig_axis_list(&all->rig, list));
        return STATUS_INPUT;
    }
    struct sim_fit_axis *const self = &all->axis[index];
    if (self->other != NULL)
        return fit_fail(all, self, self->other);
    if (!fit_has(self))
        return fit_fail(all, self,
                        "does not move after a tenth of a second at rest, "
                        "expected a fifth of a second of motion at least");
    return fit_axis(all, self);
}

/* Of the first axes, one of which may be enough to mend it. */
static enum status fit_none(const struct sim_fit_all *all)
{
    static const uint32_t most = 4;
    char text[4 * (SIM_FIT_WHY_MAX + PLAN_NAME_MAX + 4)] = "";
    for (uint32_t i = 0; i < all->rig.axis_count && i < most; i++) {
        const size_t length = strlen(text);
        snprintf(text + length, sizeof text - length, "%s%s: %s",
                 i > 0 ? "; " : "", all->axis[i].axis->name,
                 sim_fit_left_out(all, i));
    }
    error_say("slew sim fit: %s: no axis can be fitted: %s%s", all->recording,
              text, all->rig.axis_count > most ? "; ..." : "");
    return STATUS_INPUT;
}

static enum status fit_every(struct sim_fit_all *all)
{
    enum status status = STATUS_OK;

    for (uint32_t i = 0; status == STATUS_OK && i < all->rig.axis_count; i++)
        if (fit_has(&all->axis[i]))
            status = fit_axis(all, &all->axis[i]);
    if (status != STATUS_OK || all->fitted > 0)
        return status;
    return fit_none(all);
}

static enum status fit_check(const struct options *options)
{
    if (options->path_count != 3)
        error_say("slew sim fit: expected a rig and a recording of it, MCAP or "
                  "telemetry");
    else if (options->plot != NULL && plot_format_of(options->plot) < 0)
        error_say("slew sim fit: --plot: expected FILE.svg or FILE.png");
    else
        return STATUS_OK;
    return STATUS_INPUT;
}

static enum status fit_all(struct sim_fit_all *all)
{
    const struct options *const options = all->options;
    enum status status = planning_rig_path(options->path[1], all->rig_path);

    if (status == STATUS_OK)
        status = planning_rig(all->rig_path, &all->rig);
    if (status != STATUS_OK)
        return status;
    all->axis = memory_new(all->rig.axis_count, sizeof *all->axis);
    status = sim_fit_rows(all);
    if (status == STATUS_OK)
        status = options->axis != NULL ? fit_named(all) : fit_every(all);
    if (status == STATUS_OK)
        status = sim_fit_edit(all);
    if (status == STATUS_OK)
        status = sim_fit_draw(all);
    if (status == STATUS_OK && !options->dry_run)
        status =
            rig_text_write(all->rig_path, &all->text,
                           options->out != NULL ? options->out : all->rig_path);
    if (status == STATUS_OK && options->json)
        sim_fit_json(all);
    else if (status == STATUS_OK)
        sim_fit_print(all);
    return status;
}

enum status sim_fit_run(const struct options *options)
{
    enum status status = fit_check(options);

    if (status != STATUS_OK)
        return status;
    struct sim_fit_all *const all = memory_new(1, sizeof *all);
    all->options = options;
    all->recording = options->path[2];
    status = fit_all(all);
    for (uint32_t i = 0; all->axis != NULL && i < all->rig.axis_count; i++) {
        memory_free(all->axis[i].target);
        memory_free(all->axis[i].actual);
        memory_free(all->axis[i].before);
        memory_free(all->axis[i].after);
    }
    memory_free(all->axis);
    free(all->text.data);
    rig_free(&all->rig);
    memory_free(all);
    return status;
}

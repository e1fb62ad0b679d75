/* firmware/linux/commands/run/run_intent.c - see run_intent.h. */
#include "firmware/linux/commands/run/run_intent.h"

#include <inttypes.h>
#include <stdio.h>

#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/host/job/budget.h"
#include "firmware/host/rig/modbus_budget.h"
#include "firmware/host/track/compiled.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/player/shots.h"
#include "motion/core/clock_warp.h"
#include "motion/core/fixed.h"

static void run_intent_margin(struct table *table, const struct run_when *self,
                              unsigned axis, enum motion_quantity quantity)
{
    struct plan_limit limit;
    job_limit_at(&job_rig_axis(self->job, axis)->limit, self->play_q30, &limit);
    int64_t most = job_limit_of(&limit, quantity);
    int64_t peak = job_peak(&self->job->track[axis], quantity, NULL);
    if (most == 0)
        table_cell(table, "no limit");
    else
        table_cell(table, "%d %%", (int)number_percent(peak, most));
}

static void run_intent_row(struct table *table, const struct run_when *self,
                           unsigned i)
{
    const struct motion_track *track = &self->job->track[i];
    const struct rig_axis *rig = job_rig_axis(self->job, i);
    struct motion_sample first;
    struct motion_cursor cursor = { 0 };
    char text[NUMBER_MAX];
    motion_track_sample(track, &cursor, 0, &first);
    table_cell(table, "%s", rig->name);
    number_short(text, first.pos_q32, 32);
    table_cell(table, "%s", text);
    number_short(text, track->end.pos_q32, 32);
    table_cell(table, "%s", text);
    table_cell(table, "%s", units_axis_text(rig->unit));
    const struct plan_axis *axis = &self->job->move.axis[i];
    if (self->job->compiled != NULL)
        table_cell(table, "%u", self->job->compiled->file.axis[i].keys);
    else if (axis->driver == PLAN_BY_KEYS)
        table_cell(table, "%u", axis->key_count);
    else
        table_cell(table, "-");
    run_intent_margin(table, self, i, MOTION_VEL);
    run_intent_margin(table, self, i, MOTION_ACC);
    run_intent_margin(table, self, i, MOTION_JERK);
    if (rig_axis_is_virtual(rig)) {
        table_cell(table, "virtual");
        table_cell(table, "-");
        return;
    }
    table_cell(table, "%s", self->job->rig.bus[rig->bus].name);
    table_cell(table, "%u", rig->node_id);
}

static void run_intent_table(const struct run_when *self)
{
    static const char *const head[] = {
        "<axis",     ">from",         ">to",   "<unit", ">keys",
        ">velocity", ">acceleration", ">jerk", "<bus",  ">node",
    };
    struct table table;
    table_init(&table, 10, head);
    for (unsigned i = 0; i < self->job->move.axis_count; i++)
        run_intent_row(&table, self, i);
    table_print(&table, stdout);
    table_free(&table);
}

/* At the override; saturates. */
static int64_t run_intent_duration(const struct run_when *self)
{
    int64_t dur_ns_q12;
    if (motion_fixed_muldiv(self->job->end_ns_q12, MOTION_CLOCK_WARP_ONE_Q30,
                            self->play_q30, &dur_ns_q12) < 0)
        return INT64_MAX;
    return dur_ns_q12;
}

static const char *run_intent_drives(const struct run_when *self)
{
    if (self->options->real)
        return "REAL drives";
    if (self->options->pty)
        return "simulated drives in real time, Modbus by libmodbus";
    return self->options->realtime ? "simulated drives in real time"
                                   : "simulated drives in virtual time";
}

static void run_intent_port(const struct rig_bus *bus)
{
    if (bus->kind == RIG_MODBUS_TCP)
        printf(", %s port %u", bus->modbus.host, bus->modbus.port);
    else if (bus->kind == RIG_MODBUS_RTU)
        printf(", %s", bus->modbus.device);
    else
        printf(", interface %s",
               bus->interface[0] != 0 ? bus->interface : "not given");
}

static void run_intent_bus(const struct run_when *self, unsigned i)
{
    const struct rig_bus *bus = &self->job->rig.bus[i];
    struct budget budget;
    budget_of(&self->job->rig, i, NULL, &budget);
    printf("%s: %u kbit/s, at most %.1f %% in use", bus->name,
           bus->bit_rate / 1000, 100 * budget.most);
    budget_free(&budget);
    if (self->options->real)
        run_intent_port(bus);
    putchar('\n');
    if (!rig_bus_is_can(bus))
        modbus_budget_print(&self->job->rig, i, stdout);
}

/* Where it begins, and how often it is played. */
static void run_intent_plays(const struct run_when *self)
{
    char from[NUMBER_MAX];
    number_seconds(from, self->from_ns_q12);
    if (self->from_ns_q12 > 0)
        printf("first every axis goes to where it is at %s s of the move, at a "
               "quarter of its limits\n",
               from);
    else
        fputs("first every axis goes to its first key at a quarter of its "
              "limits\n",
              stdout);
    if (self->times < 0)
        fputs("the move is played until it is stopped", stdout);
    else if (self->times > 1)
        printf("the move is played %" PRId64 " times", self->times);
    if (self->times != 1)
        puts(self->is_ping_pong ? ", every second time in reverse" : "");
}

void run_intent_print(const struct run_when *self)
{
    const struct job *job = self->job;
    char duration[NUMBER_MAX], period[NUMBER_MAX], percent[NUMBER_MAX];
    number_seconds(duration, run_intent_duration(self));
    number_short(percent, 100 * self->play_q30, 30);
    number_short(period, job->rig.period_ns * 4096 / 1000000, 12);
    printf("%s%s%s\n", job->move.title, job->move.title[0] ? " - " : "",
           job->rig.title);
    printf("%u %s, %s s at %s %% speed, a set point every %s ms, %s\n\n",
           job->move.axis_count,
           number_word(job->move.axis_count, "axis", "axes"), duration, percent,
           period, run_intent_drives(self));
    run_intent_table(self);
    fputs("\nlimits: how much of each the move uses at its peak\n", stdout);
    for (unsigned i = 0; i < job->rig.bus_count; i++)
        run_intent_bus(self, i);
    shots_plan_print(job, stdout);
    run_intent_plays(self);
    if (self->at_ns != 0)
        printf("there it waits until %s\n", self->options->at);
    if (self->follow.kind != RUN_FOLLOW_NONE)
        printf("there it waits for %s, and keeps to it\n",
               self->options->follow);
    if (self->start_line >= 0)
        printf("there it waits for %s\n", self->options->on_edge);
    if (job->steps.count > 0)
        printf("before each of its %" PRIu32 " frames it waits for %s\n",
               job->steps.count,
               job->step_line != NULL ? job->step_line->name : "the operator");
    fflush(stdout);
}

void run_intent_json(const struct run_when *self, enum status status)
{
    const struct job *job = self->job;
    cJSON *report = cJSON_CreateObject();
    cJSON_AddStringToObject(report, "title", job->move.title);
    cJSON_AddNumberToObject(report, "duration_s",
                            number_double(run_intent_duration(self), 12) / 1e9);
    job_json_warnings(job, report);
    job_json_violations(job, report);
    budget_json(&job->rig, NULL, report);
    json_report(report, status == STATUS_OK);
}

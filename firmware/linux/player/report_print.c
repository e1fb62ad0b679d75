/* firmware/linux/player/report_print.c - a report as text and as JSON: see
 * report.h. */
#include <inttypes.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/host/recording/drive_events.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/machine/machine_fault.h"
#include "firmware/linux/machine/modbus_words.h"
#include "firmware/linux/machine/view.h"
#include "firmware/linux/player/arrivals.h"
#include "firmware/linux/player/loads.h"
#include "firmware/linux/player/report.h"
#include "firmware/linux/player/shots.h"
#include "motion/core/fixed.h"

/* "351.6 / 400  88 %" */
static void report_peak(struct table *table, const struct report *report,
                        unsigned i, unsigned order)
{
    const struct rig_axis *rig = job_rig_axis(report->job, i);
    int64_t limit = job_limit_of(&rig->limit, order);
    char peak_text[NUMBER_MAX], limit_text[NUMBER_MAX];
    number_short(peak_text, report->axis[i].peak[order], 32);
    number_short(limit_text, limit, 32);
    if (limit == 0)
        table_cell(table, "%s", peak_text);
    else
        table_cell(table, "%s / %s %4" PRId64 " %%", peak_text, limit_text,
                   number_percent(report->axis[i].peak[order], limit));
}

static void report_row(struct table *table, const struct report *report,
                       unsigned i)
{
    const struct rig_axis *rig = job_rig_axis(report->job, i);
    const struct report_axis *axis = &report->axis[i];
    char text[NUMBER_MAX];
    table_cell(table, "%s", rig->name);
    number_seconds(text, axis->dur_ns * MOTION_FIXED_NS_Q12);
    table_cell(table, "%s s", text);
    table_cell(table, "%s", units_axis_text(rig->unit));
    for (unsigned order = 1; order <= 3; order++)
        report_peak(table, report, i, order);
    if (job_runs_by_drive_profile(report->job, i)) {
        table_cell(table, "-");
    } else {
        number_short(text, axis->following_q32, 32);
        table_cell(table, "%s", text);
    }
    number_short(text, report_end_error(report, i), 32);
    table_cell(table, "%s", text);
}

static void report_table(const struct report *report, FILE *file)
{
    static const char *const head[] = {
        "<axis",
        ">duration",
        "<unit",
        ">velocity /s",
        ">acceleration /s2",
        ">jerk /s3",
        ">following error",
        ">end error",
    };
    struct table table;
    table_init(&table, 8, head);
    for (unsigned i = 0; i < report->job->move.axis_count; i++)
        report_row(&table, report, i);
    table_print(&table, file);
    table_free(&table);
}

const char *report_end_text(enum report_end end)
{
    static const char *const text[] = {
        "done",
        "stopped by a fault",
        "stopped along the path by the operator",
        "quick stop by the operator",
    };
    return text[end];
}

/* The value that tripped it, its limit and their unit; false: it has none. */
static bool report_fault_figures(const struct report *report, int64_t *value,
                                 int64_t *limit, unsigned *bits,
                                 const char **unit)
{
    const struct controller_fault_record *fault = &report->fault;
    *value = fault->value;
    *limit = fault->limit;
    *bits = 32;
    switch (fault->fault) {
    case CONTROLLER_FAULT_STALE:
    case CONTROLLER_FAULT_ENABLE:
        *value /= 1000000;
        *limit /= 1000000;
        *bits = 0;
        *unit = "ms";
        return true;
    case CONTROLLER_FAULT_FOLLOWING:
    case CONTROLLER_FAULT_GATE:
    case CONTROLLER_FAULT_ARRIVAL:
        *unit = fault->axis < 0
                    ? ""
                    : units_axis_text(report->job->rig.axis[fault->axis].unit);
        return true;
    default:
        return false;
    }
}

static void report_fault_value(const struct report *report, char *text,
                               size_t size)
{
    char value_text[NUMBER_MAX], limit_text[NUMBER_MAX];
    int64_t value, limit;
    unsigned bits;
    const char *unit;
    text[0] = 0;
    if (!report_fault_figures(report, &value, &limit, &bits, &unit))
        return;
    number_short(value_text, value, bits);
    number_short(limit_text, limit, bits);
    snprintf(text, size, " (%s %s, limit %s %s)", value_text, unit, limit_text,
             unit);
}

static const char *report_fault_axis(const struct report *report)
{
    int axis = report->fault.axis;
    return axis < 0 ? "all axes" : report->job->rig.axis[axis].name;
}

void report_fault_text(const struct report *report, char text[REPORT_FAULT_MAX])
{
    char value[160];
    text[0] = 0;
    if (report->fault.fault == CONTROLLER_FAULT_NONE)
        return;
    report_fault_value(report, value, sizeof value);
    snprintf(text, REPORT_FAULT_MAX, "%s: %s%s%s%s", report_fault_axis(report),
             controller_fault_text(report->fault.fault), value,
             report->fault_text[0] != 0 ? ": " : "", report->fault_text);
}

/* "seen after 1.865 s of the run, all stopped after 2.079 s" */
static void report_fault_times(const struct report *report, FILE *file)
{
    const int64_t stopped_ns = report_stopped_ns(report);
    if (report->fault_ns == 0)
        return;
    fprintf(file, "seen after %.3f s of the run",
            (double)report->fault_ns / 1e9);
    if (stopped_ns > 0)
        fprintf(file, ", all stopped after %.3f s", (double)stopped_ns / 1e9);
    fputc('\n', file);
}

static void report_fault(const struct report *report, FILE *file)
{
    char value[160];
    if (report->end != REPORT_FAULT)
        return;
    report_fault_value(report, value, sizeof value);
    if (report->fault.fault != CONTROLLER_FAULT_NONE) {
        fprintf(file, "fault: %s: %s%s\n", report_fault_axis(report),
                controller_fault_text(report->fault.fault), value);
        report_fault_times(report, file);
    }
    if (report->fault_text[0] != 0)
        fprintf(file, "reason: %s\n", report->fault_text);
    if (report->fault.drive_code != 0 && !report->monitored)
        fputs("slew drive reset clears it, once its cause is gone\n", file);
}

/* "events: pan: warning 2, emergency message 1 (0x8130)": what the drives said
 * without being in fault. */
static void report_events(const struct report *report, unsigned i, FILE *file)
{
    const struct report_axis *axis = &report->axis[i];
    char text[DRIVE_EVENTS_TEXT_MAX];
    if (!drive_events_any(&axis->events))
        return;
    drive_events_text(&axis->events, text);
    fprintf(file, "events: %s: %s\n", job_rig_axis(report->job, i)->name, text);
}

static void report_bus_events(const struct report *report, FILE *file)
{
    for (uint32_t i = 0; i < report->job->rig.bus_count; i++) {
        const struct report_bus *bus = &report->bus[i];
        char when[NUMBER_MAX];
        if (bus->warnings == 0)
            continue;
        number_seconds(when, bus->warned_ns * MOTION_FIXED_NS_Q12);
        fprintf(file,
                "events: bus %s: error-warning %" PRIu32
                " (first after %s s of the run)\n",
                report->job->rig.bus[i].name, bus->warnings, when);
    }
}

static void report_buses(const struct report *report, FILE *file)
{
    bool known = false;
    for (uint32_t i = 0; i < report->job->rig.bus_count; i++)
        known |= report->bus[i].load > 0;
    if (!known) /* a real interface does not tell */
        return;
    fputs("bus load:", file);
    for (uint32_t i = 0; i < report->job->rig.bus_count; i++)
        fprintf(file, "%s %s %.1f %%", i > 0 ? "," : "",
                report->job->rig.bus[i].name, 100 * report->bus[i].load);
    fputs(" (mean during the move)\n", file);
}

/* "line1: 3 stray bytes: ...". */
static void report_lines(const struct report *report, FILE *file)
{
    const struct rig *rig = &report->job->rig;
    char text[MODBUS_WORDS][MODBUS_WORDS_MAX];

    for (uint32_t i = 0; i < rig->bus_count; i++) {
        const unsigned count =
            modbus_words(&rig->bus[i], &report->bus[i].line, text);

        for (unsigned k = 0; k < count; k++)
            fprintf(file, "%s: %s\n", rig->bus[i].name, text[k]);
    }
}

static void report_clock(const struct report *report, FILE *file)
{
    if (!report->realtime)
        return;
    fprintf(file,
            "clock: %" PRIu64 " ticks, %" PRIu64
            " lost; latest wake-up %.2f ms after its time\n",
            report->ticks, report->ticks_lost, (double)report->late_ns / 1e6);
    if (report->fault.fault == CONTROLLER_FAULT_OVERRUN)
        fputs("this computer did something else meanwhile: slew doctor says "
              "what helps, and a rig with a longer tick tolerates more\n",
              file);
}

/* "pan: torque is not confirmed off: ..." of each; nothing when all are off. */
static void report_torque(const struct report *report, FILE *file)
{
    for (uint32_t i = 0; i < report->job->rig.axis_count; i++)
        if (report->torque[i][0] != 0)
            fprintf(file, "%s: %s\n", report->job->rig.axis[i].name,
                    report->torque[i]);
}

/* The move itself, once it has begun. */
static void report_move(const struct report *report, FILE *file)
{
    char played[NUMBER_MAX];
    number_seconds(played, report->played_ns * MOTION_FIXED_NS_Q12);
    report_table(report, file);
    fprintf(file, "\n%s after %s s\n", report_end_text(report->end), played);
    fprintf(file,
            "set points: CRC-32 %08" PRIx32
            ", the same for takes that are equal to the bit\n",
            report->set_points_crc32);
    if (report->is_repeated)
        fprintf(file, "played %" PRId64 " time%s to the end\n", report->times,
                report->times == 1 ? "" : "s");
    if (report->followed[0] != 0)
        fprintf(file, "%s\n", report->followed);
    report_buses(report, file);
    if (report->shots != NULL)
        shots_print(report->shots, file);
    if (report->step != NULL)
        fprintf(file,
                "step by step: %" PRIu32 " of %" PRIu32
                " frames; edges that came too early: %" PRIu32 "\n",
                report->step->frame, report->step->config.count,
                report->step->early);
    if (report->arrivals != NULL)
        arrivals_print(report->arrivals, file);
}

/* What could not be written, and what was. */
static void report_files(const struct report *report, FILE *file)
{
    if (report->rows_dropped > 0)
        fprintf(file,
                "rows:      %" PRIu64 " were lost, as writing was too slow\n",
                report->rows_dropped);
    if (report->telemetry_lost > 0)
        fprintf(file, "telemetry: %" PRIu64 " rows could not be written\n",
                report->telemetry_lost);
    if (report->record_lost > 0)
        fprintf(file, "recording: %" PRIu64 " rows could not be written\n",
                report->record_lost);
    if (report->frames_dropped > 0)
        fprintf(file, "frames:    %" PRIu64 " were not written\n",
                report->frames_dropped);
    if (report->telemetry_path != NULL)
        fprintf(file, "telemetry: %s\n", report->telemetry_path);
    if (report->record_path != NULL)
        fprintf(file, "recording: %s\n", report->record_path);
    if (report->can_log_path != NULL)
        fprintf(file, "frames:    %s\n", report->can_log_path);
    if (report->plot_path != NULL)
        fprintf(file, "picture:   %s\n", report->plot_path);
}

void report_print(const struct report *report, FILE *file)
{
    if (report->started)
        report_move(report, file);
    else
        fprintf(file, "%s before the move began\n",
                report_end_text(report->end));
    report_fault(report, file);
    if (report->loads != NULL)
        loads_print(report->loads, report->job, file);
    if (report->faults != NULL)
        machine_fault_print(report->faults, file);
    report_torque(report, file);
    for (unsigned i = 0; i < report->job->move.axis_count; i++) {
        report_events(report, i, file);
        report_warning_print(&report->axis[i].warnings,
                             job_rig_axis(report->job, i), file);
    }
    report_bus_events(report, file);
    report_lines(report, file);
    report_clock(report, file);
    report_files(report, file);
}

static void report_json_peak(cJSON *item, const char *name,
                             const struct report *report, unsigned i,
                             unsigned order)
{
    const struct rig_axis *rig = job_rig_axis(report->job, i);
    int64_t limit = job_limit_of(&rig->limit, order);
    cJSON *object = cJSON_AddObjectToObject(item, name);
    json_add_fixed(object, "peak", report->axis[i].peak[order], 32);
    if (limit != 0)
        json_add_fixed(object, "limit", limit, 32);
}

static cJSON *report_json_axis(const struct report *report, unsigned i)
{
    const struct report_axis *axis = &report->axis[i];
    cJSON *item = cJSON_CreateObject();
    cJSON_AddStringToObject(item, "name", report->job->move.axis[i].name);
    cJSON_AddStringToObject(
        item, "unit", units_axis_text(job_rig_axis(report->job, i)->unit));
    cJSON_AddNumberToObject(item, "duration_s", (double)axis->dur_ns / 1e9);
    report_json_peak(item, "velocity", report, i, 1);
    report_json_peak(item, "acceleration", report, i, 2);
    report_json_peak(item, "jerk", report, i, 3);
    if (!job_runs_by_drive_profile(report->job, i))
        json_add_fixed(item, "following_error", axis->following_q32, 32);
    if (report->arrivals != NULL)
        arrivals_json(report->arrivals, i, item);
    json_add_fixed(item, "end_error", report_end_error(report, i), 32);
    if (drive_events_any(&axis->events))
        drive_events_json(&axis->events, item);
    report_warning_json(&axis->warnings, item);
    return item;
}

static void report_json_fault(const struct report *report, cJSON *object)
{
    cJSON *fault = cJSON_AddObjectToObject(object, "fault");
    int64_t value, limit;
    unsigned bits;
    const char *unit;
    cJSON_AddStringToObject(fault, "axis", report_fault_axis(report));
    cJSON_AddStringToObject(fault, "what",
                            controller_fault_text(report->fault.fault));
    cJSON_AddStringToObject(fault, "reason", report->fault_text);
    cJSON_AddNumberToObject(fault, "drive_code", report->fault.drive_code);
    if (report_fault_figures(report, &value, &limit, &bits, &unit)) {
        json_add_fixed(fault, "value", value, bits);
        json_add_fixed(fault, "limit", limit, bits);
        cJSON_AddStringToObject(fault, "unit", unit);
    }
    if (report->fault_ns > 0)
        cJSON_AddNumberToObject(fault, "t_s", (double)report->fault_ns / 1e9);
    if (report_stopped_ns(report) > 0)
        cJSON_AddNumberToObject(fault, "stopped_t_s",
                                (double)report_stopped_ns(report) / 1e9);
}

static void report_json_torque(const struct report *report, cJSON *object)
{
    cJSON *list = cJSON_AddArrayToObject(object, "torque_not_confirmed_off");
    for (uint32_t i = 0; i < report->job->rig.axis_count; i++) {
        if (report->torque[i][0] == 0)
            continue;
        cJSON *item = cJSON_CreateObject();
        cJSON_AddItemToArray(list, item);
        cJSON_AddStringToObject(item, "axis", report->job->rig.axis[i].name);
        cJSON_AddStringToObject(item, "what", report->torque[i]);
    }
}

static void report_json_buses(const struct report *report, cJSON *object)
{
    const struct rig *rig = &report->job->rig;
    cJSON *buses = cJSON_AddArrayToObject(object, "buses");
    for (uint32_t i = 0; i < rig->bus_count; i++) {
        cJSON *bus = cJSON_CreateObject();
        cJSON_AddStringToObject(bus, "name", rig->bus[i].name);
        cJSON_AddNumberToObject(bus, "load", report->bus[i].load);
        machine_view_to_line(&rig->bus[i], &report->bus[i].line, bus);
        if (report->bus[i].warnings > 0) {
            cJSON *item = cJSON_AddObjectToObject(bus, "error_warning");
            cJSON_AddNumberToObject(item, "count", report->bus[i].warnings);
            cJSON_AddNumberToObject(item, "after_s",
                                    (double)report->bus[i].warned_ns / 1e9);
        }
        cJSON_AddItemToArray(buses, bus);
    }
}

static void report_json_step(const struct frame_step *step, cJSON *object)
{
    cJSON *item = cJSON_AddObjectToObject(object, "step");
    cJSON_AddNumberToObject(item, "frames", step->config.count);
    cJSON_AddNumberToObject(item, "frame", step->frame);
    cJSON_AddNumberToObject(item, "early", step->early);
}

static void report_json_move(const struct report *report, cJSON *object)
{
    char crc[9];
    cJSON_AddStringToObject(object, "end", report_end_text(report->end));
    cJSON_AddStringToObject(object, "title", report->job->move.title);
    job_json_warnings(report->job, object);
    cJSON_AddNumberToObject(object, "played_s",
                            (double)report->played_ns / 1e9);
    snprintf(crc, sizeof crc, "%08" PRIx32, report->set_points_crc32);
    cJSON_AddStringToObject(object, "set_points_crc32", crc);
    if (report->is_repeated)
        cJSON_AddNumberToObject(object, "loops_played", (double)report->times);
    if (report->followed[0] != 0)
        cJSON_AddStringToObject(object, "followed", report->followed);
    cJSON *axes = cJSON_AddArrayToObject(object, "axes");
    for (unsigned i = 0; i < report->job->move.axis_count; i++)
        cJSON_AddItemToArray(axes, report_json_axis(report, i));
}

static void report_json_files(const struct report *report, cJSON *object)
{
    if (report->telemetry_path != NULL)
        cJSON_AddStringToObject(object, "telemetry", report->telemetry_path);
    if (report->telemetry_lost > 0)
        cJSON_AddNumberToObject(object, "telemetry_rows_not_written",
                                (double)report->telemetry_lost);
    if (report->record_lost > 0)
        cJSON_AddNumberToObject(object, "recording_rows_not_written",
                                (double)report->record_lost);
    if (report->record_path != NULL)
        cJSON_AddStringToObject(object, "recording", report->record_path);
    if (report->can_log_path != NULL)
        cJSON_AddStringToObject(object, "can_log", report->can_log_path);
    if (report->plot_path != NULL)
        cJSON_AddStringToObject(object, "picture", report->plot_path);
}

void report_json(const struct report *report, FILE *file)
{
    cJSON *object = cJSON_CreateObject();
    report_json_move(report, object);
    report_json_buses(report, object);
    if (report->shots != NULL)
        shots_json(report->shots, object);
    if (report->step != NULL)
        report_json_step(report->step, object);
    if (report->loads != NULL)
        loads_json(report->loads, object);
    if (report->faults != NULL)
        machine_fault_json(report->faults, object);
    if (report->end == REPORT_FAULT)
        report_json_fault(report, object);
    report_json_torque(report, object);
    cJSON_AddNumberToObject(object, "ticks", (double)report->ticks);
    cJSON_AddNumberToObject(object, "ticks_lost", (double)report->ticks_lost);
    cJSON_AddNumberToObject(object, "rows_lost", (double)report->rows_dropped);
    report_json_files(report, object);
    json_report_to(object, report->end == REPORT_DONE && !report->torque_left,
                   file);
}

/* firmware/linux/service/report.c - states as JSON; see control.h. */
#include <string.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/number.h"
#include "firmware/library/version.h"
#include "firmware/linux/service/control.h"
#include "motion/core/fixed.h"

static cJSON *report_axis(const struct rig_axis *rig,
                          const struct machine_view_axis *axis)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "name", rig->name);
    json_add_fixed(object, "position", axis->pos_q32, 32);
    json_add_fixed(object, "velocity", axis->vel_q32, 32);
    json_add_fixed(object, "demand", axis->demand_q32, 32);
    cJSON_AddBoolToObject(object, "homed", axis->homed);
    cJSON_AddStringToObject(object, "drive", hal_drive_state_text(axis->drive));
    return object;
}

static void report_path(const struct service_control *control, cJSON *object)
{
    const struct service_state *state = control->state;
    cJSON_AddNumberToObject(object, "path_s",
                            number_double(state->rate.s_ns_q12, 12) / 1e9);
    cJSON_AddNumberToObject(object, "end_s",
                            number_double(state->move_end_ns_q12, 12) / 1e9);
    cJSON_AddNumberToObject(object, "rate",
                            number_double(state->rate.rate_q30, 30));
    cJSON_AddNumberToObject(object, "override",
                            100 * number_double(state->override_q30, 30));
    cJSON_AddBoolToObject(object, "reversed", state->reversed);
}

const char *service_fault_code(enum controller_fault fault)
{
    static const char *const name[] = {
#define REPORT_FAULT(name, reaction, text) &#name[sizeof "CONTROLLER_FAULT"],
        CONTROLLER_FAULT_LIST(REPORT_FAULT)
#undef REPORT_FAULT
    };
    return name[fault];
}

void service_report_state(const struct service_control *control, cJSON *object)
{
    const struct service_state *state = control->state;
    cJSON_AddNumberToObject(object, "t_s", (double)state->now_ns / 1e9);
    cJSON_AddStringToObject(object, "state",
                            controller_state_text(state->state));
    cJSON_AddBoolToObject(object, "enabling", state->enabling);
    cJSON_AddBoolToObject(object, "homing", state->homing);
    cJSON_AddBoolToObject(object, "jogging", state->jogging);
    cJSON_AddBoolToObject(object, "starting", state->starting);
    cJSON_AddNumberToObject(object, "frame_waits", state->waits_for);
    cJSON_AddBoolToObject(object, "torque_off", state->off);
    if (state->fault_text[0] != '\0') {
        cJSON_AddStringToObject(object, "fault", state->fault_text);
        cJSON_AddStringToObject(object, "fault_code",
                                service_fault_code(state->fault.fault));
    }
    report_path(control, object);
    cJSON *axes = cJSON_AddArrayToObject(object, "axes");
    for (unsigned i = 0; i < control->rig->axis_count; i++)
        cJSON_AddItemToArray(
            axes, report_axis(&control->rig->axis[i], &state->view.axis[i]));
}

static void report_homing(const struct service_control *control, cJSON *object)
{
    const struct service_state *state = control->state;
    cJSON *homing = cJSON_AddObjectToObject(object, "homing_turn");
    cJSON_AddStringToObject(homing, "axis",
                            control->rig->axis[state->homing_axis].name);
    cJSON_AddStringToObject(homing, "step",
                            homing_state_text(state->homing_state));
    cJSON_AddStringToObject(homing, "text", state->homing_text);
}

void service_report_machine(const struct service_control *control,
                            cJSON *object)
{
    const struct machine_view *view = &control->state->view;
    cJSON *axes = cJSON_CreateArray();
    for (unsigned i = 0; i < control->rig->axis_count; i++) {
        cJSON *axis =
            machine_view_to_axis(&control->rig->axis[i], &view->axis[i]);
        json_add_fixed(axis, "demand", view->axis[i].demand_q32, 32);
        json_add_fixed(axis, "offset", view->axis[i].offset_q32, 32);
        cJSON_AddItemToArray(axes, axis);
    }
    cJSON_ReplaceItemInObjectCaseSensitive(object, "axes", axes);
    machine_view_to_ports(control->rig, view, object);
    report_homing(control, object);
}

/* All but so many per mille of the wake-ups were earlier than this, whole us. */
static unsigned report_late_us(const struct service_board *board, uint64_t all,
                               unsigned per_mille)
{
    uint64_t later = 0;
    for (unsigned i = SERVICE_LATE_BINS - 1; i > 0; i--) {
        later += board->late[i];
        if (later * 1000 > all * per_mille)
            return service_late_us(i + 1);
    }
    return 1;
}

void service_report_tick(const struct service_control *control, cJSON *object)
{
    const struct service_state *state = control->state;
    const struct service_board *board = &control->loop->board;
    uint64_t all = 0;
    for (unsigned i = 0; i < SERVICE_LATE_BINS; i++)
        all += board->late[i];
    json_add_integer(object, "period_ns", control->rig->period_ns);
    json_add_integer(object, "ticks", (int64_t)state->ticks);
    json_add_integer(object, "ticks_lost", (int64_t)state->ticks_lost);
    json_add_integer(object, "page_faults", state->page_faults);
    cJSON_AddNumberToObject(object, "late_us_median",
                            report_late_us(board, all, 500));
    cJSON_AddNumberToObject(object, "late_us_p999",
                            report_late_us(board, all, 1));
    cJSON_AddNumberToObject(object, "late_us_most",
                            (double)state->late_most_ns / 1e3);
    cJSON_AddBoolToObject(object, "real_time", control->loop->refused == 0);
    cJSON_AddBoolToObject(object, "memory_locked", control->is_locked);
}

void service_report_latency(const struct service_control *control,
                            cJSON *object)
{
    const struct service_board *board = &control->loop->board;
    cJSON *list = cJSON_AddArrayToObject(object, "late_us");
    service_report_tick(control, object);
    for (unsigned i = 0; i < SERVICE_LATE_BINS; i++) {
        const uint32_t count = board->late[i];
        if (count == 0)
            continue;
        cJSON *bin = cJSON_CreateArray();
        cJSON_AddItemToArray(bin, cJSON_CreateNumber(service_late_us(i)));
        cJSON_AddItemToArray(bin, cJSON_CreateNumber(count));
        cJSON_AddItemToArray(list, bin);
    }
}

static cJSON *report_rig_axis(const struct rig_axis *axis)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "name", axis->name);
    cJSON_AddStringToObject(object, "unit", units_axis_text(axis->unit));
    json_add_fixed(object, "low", axis->limit.pos_min_q32, 32);
    json_add_fixed(object, "high", axis->limit.pos_max_q32, 32);
    json_add_fixed(object, "velocity", axis->limit.vel_q32, 32);
    return object;
}

void service_report_hello(const struct service_control *control, cJSON *object)
{
    cJSON_AddNumberToObject(object, "version", SERVICE_VERSION);
    cJSON_AddStringToObject(object, "slew", SLEW_VERSION);
    cJSON_AddStringToObject(object, "rig", control->rig_path);
    json_add_integer(object, "rig_crc32", control->rig_crc);
    cJSON_AddStringToObject(object, "title", control->rig->title);
    cJSON_AddBoolToObject(object, "real", control->is_real);
    cJSON *axes = cJSON_AddArrayToObject(object, "axes");
    for (unsigned i = 0; i < control->rig->axis_count; i++)
        cJSON_AddItemToArray(axes, report_rig_axis(&control->rig->axis[i]));
}

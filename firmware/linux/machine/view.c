/* firmware/linux/machine/view.c - see view.h. */
#include "firmware/linux/machine/view.h"

#include "firmware/linux/machine/modbus_words.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"

/* --- its memory --- */

void machine_view_init(struct machine_view *view, const struct rig *rig,
                       struct memory_pool *pool)
{
    *view = (struct machine_view){
        .axes = rig->axis_count,
        .buses = rig->bus_count,
        .lines = rig->line_count,
        .axis = memory_pool_new(pool, rig->axis_count, sizeof *view->axis),
        .bus = memory_pool_new(pool, rig->bus_count, sizeof *view->bus),
        .line = memory_pool_new(pool, rig->line_count, sizeof *view->line),
    };
}

void machine_view_copy_ports(struct machine_view *to,
                             const struct machine_view *from)
{
    memcpy(to->bus, from->bus, from->buses * sizeof *to->bus);
    memcpy(to->line, from->line, from->lines * sizeof *to->line);
}

void machine_view_copy(struct machine_view *to, const struct machine_view *from)
{
    memcpy(to->axis, from->axis, from->axes * sizeof *to->axis);
    machine_view_copy_ports(to, from);
}

/* --- out of a machine --- */

void machine_view_axes(const struct machine *machine, struct machine_view *view)
{
    for (unsigned i = 0; i < machine->rig->axis_count; i++) {
        const struct controller_axis *from = &machine->controller.axis[i];
        const struct hal_drive_feedback *feedback = &from->feedback;
        struct machine_view_axis *to = &view->axis[i];
        *to = (struct machine_view_axis){
            .drive = feedback->state,
            .known = feedback->t_ns != 0,
            .homed = from->homed,
            .pos_q32 = feedback->pos_q32,
            .vel_q32 = feedback->vel_q32,
            .following_q32 = from->following_q32,
            .demand_q32 = from->target.pos_q32,
            .offset_q32 = from->offset_q32,
            .cam = from->cam,
            .torque_known = feedback->torque_known,
            .torque_permille = feedback->torque_permille,
            .home_switch = feedback->home_switch,
            .limit_negative = feedback->limit_negative,
            .limit_positive = feedback->limit_positive,
            .probe_latched = feedback->probe_latched,
            .fault_code = feedback->fault_code,
        };
        to->has_statusword = machine_statusword(machine, i, &to->statusword);
        memcpy(to->fault_text, feedback->fault_text, sizeof to->fault_text);
    }
}

static void view_bus(struct machine *machine, unsigned i,
                     struct machine_view_bus *bus)
{
    const struct machine_ports *ports = &machine->ports;
    struct hal_can_stats can = { 0 };
    struct hal_modbus_stats line = { 0 };
    if (ports->can[i] != NULL)
        hal_can_stats(ports->can[i], &can);
    else
        hal_modbus_stats(ports->modbus[i], &line);
    bus->line = line;
    bus->can_state = ports->can[i] != NULL ? hal_can_state(ports->can[i]) : -1;
    bus->busy_ns = machine_busy_ns(machine, i);
    bus->errors = can.errors + can.dropped + can.refused + line.timeouts +
                  line.broken + line.failures;
}

/* An input after its debouncing, as the machine sees it. */
void machine_view_ports(struct machine *machine, struct machine_view *view)
{
    for (unsigned i = 0; i < machine->rig->bus_count; i++)
        view_bus(machine, i, &view->bus[i]);
    for (unsigned i = 0; i < machine->rig->line_count; i++)
        view->line[i] = rig_line_is_output(&machine->rig->line[i])
                            ? hal_gpio_get(machine->ports.line[i])
                            : hal_gpio_get(&machine->input[i].gpio);
}

/* --- words --- */

/* CiA 402-2, statusword: the state of its bits 0 - 3, 5 and 6. */
static const struct {
    uint16_t mask, value;
    const char *text;
} view_power[] = {
    { 0x4F, 0x00, "not ready to switch on" },
    { 0x4F, 0x40, "switch on disabled" },
    { 0x6F, 0x21, "ready to switch on" },
    { 0x6F, 0x23, "switched on" },
    { 0x6F, 0x27, "operation enabled" },
    { 0x6F, 0x07, "quick stop active" },
    { 0x4F, 0x0F, "fault reaction active" },
    { 0x4F, 0x08, "fault" },
};

static const char *view_power_text(uint16_t statusword)
{
    for (size_t i = 0; i < ARRAY_LEN(view_power); i++)
        if ((statusword & view_power[i].mask) == view_power[i].value)
            return view_power[i].text;
    return "no state of CiA 402";
}

void machine_view_word(const struct machine_view_axis *axis,
                       char text[MACHINE_VIEW_WORD_MAX])
{
    const uint16_t word = axis->statusword;
    text[0] = '\0';
    if (axis->has_statusword)
        snprintf(text, MACHINE_VIEW_WORD_MAX, "0x%04X %s%s%s%s", word,
                 view_power_text(word), (word & 0x10) == 0 ? ", no power" : "",
                 (word & 0x80) != 0 ? ", warning" : "",
                 (word & 0x800) != 0 ? ", internal limit" : "");
}

/* --- to JSON --- */

cJSON *machine_view_to_axis(const struct rig_axis *rig,
                            const struct machine_view_axis *axis)
{
    char text[MACHINE_VIEW_WORD_MAX];
    cJSON *item = cJSON_CreateObject();
    cJSON_AddStringToObject(item, "name", rig->name);
    cJSON_AddStringToObject(item, "unit", units_axis_text(rig->unit));
    cJSON_AddStringToObject(item, "drive", hal_drive_state_text(axis->drive));
    cJSON_AddBoolToObject(item, "homed", axis->homed);
    if (axis->known) {
        json_add_fixed(item, "position", axis->pos_q32, 32);
        json_add_fixed(item, "velocity", axis->vel_q32, 32);
        json_add_fixed(item, "following", axis->following_q32, 32);
    }
    if (axis->torque_known)
        cJSON_AddNumberToObject(item, "torque_permille", axis->torque_permille);
    cJSON_AddBoolToObject(item, "home_switch", axis->home_switch);
    cJSON_AddBoolToObject(item, "limit_negative", axis->limit_negative);
    cJSON_AddBoolToObject(item, "limit_positive", axis->limit_positive);
    machine_view_word(axis, text);
    if (text[0] != '\0') {
        cJSON_AddNumberToObject(item, "statusword", axis->statusword);
        cJSON_AddStringToObject(item, "statusword_text", text);
    }
    cJSON_AddNumberToObject(item, "fault_code", axis->fault_code);
    cJSON_AddStringToObject(item, "error", axis->fault_text);
    return item;
}

void machine_view_to_line(const struct rig_bus *bus,
                          const struct hal_modbus_stats *line, cJSON *item)
{
    char text[MODBUS_WORDS][MODBUS_WORDS_MAX];
    unsigned count;

    if (rig_bus_is_can(bus))
        return;
    json_add_integer(item, "strays", (int64_t)line->stray);
    json_add_integer(item, "echoes", (int64_t)line->echoes);
    json_add_integer(item, "broken", (int64_t)line->broken);
    json_add_integer(item, "late", (int64_t)line->late);
    count = modbus_words(bus, line, text);
    cJSON *says = cJSON_AddArrayToObject(item, "says");
    for (unsigned i = 0; i < count; i++)
        cJSON_AddItemToArray(says, cJSON_CreateString(text[i]));
}

void machine_view_to_ports(const struct rig *rig,
                           const struct machine_view *view, cJSON *object)
{
    cJSON *buses = cJSON_AddArrayToObject(object, "buses");
    for (unsigned i = 0; i < rig->bus_count; i++) {
        const struct machine_view_bus *bus = &view->bus[i];
        cJSON *item = cJSON_CreateObject();
        cJSON_AddItemToArray(buses, item);
        cJSON_AddStringToObject(item, "name", rig->bus[i].name);
        if (bus->can_state >= 0)
            cJSON_AddStringToObject(
                item, "state",
                hal_can_state_text((enum hal_can_state)bus->can_state));
        json_add_integer(item, "busy_ns", bus->busy_ns);
        json_add_integer(item, "errors", (int64_t)bus->errors);
        machine_view_to_line(&rig->bus[i], &bus->line, item);
    }
    cJSON *lines = cJSON_AddArrayToObject(object, "lines");
    for (unsigned i = 0; i < rig->line_count; i++) {
        const int level = view->line[i];
        cJSON *line = cJSON_CreateObject();
        cJSON_AddItemToArray(lines, line);
        cJSON_AddStringToObject(line, "name", rig->line[i].name);
        cJSON_AddStringToObject(line, "kind",
                                rig_line_kind_text(rig->line[i].kind));
        if (level >= 0)
            cJSON_AddBoolToObject(line, "active", level != 0);
        else
            cJSON_AddNullToObject(line, "active");
    }
}

/* --- and back --- */

static const cJSON *view_member(const cJSON *object, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(object, name);
}

static double view_number(const cJSON *object, const char *name)
{
    const double value = cJSON_GetNumberValue(view_member(object, name));
    return isfinite(value) ? value : 0;
}

/* From 0 to `most`, else 0. */
static int64_t view_count(const cJSON *object, const char *name, double most)
{
    const double value = view_number(object, name);
    return value >= 0 && value <= most ? (int64_t)value : 0;
}

static int64_t view_q32(const cJSON *object, const char *name)
{
    const double value = view_number(object, name);
    return fabs(value) < 2147483648.0 ? llrint(value * 4294967296.0) : 0;
}

static bool view_is(const cJSON *object, const char *name)
{
    return cJSON_IsTrue(view_member(object, name));
}

static const char *view_text(const cJSON *object, const char *name)
{
    const char *text = cJSON_GetStringValue(view_member(object, name));
    return text != NULL ? text : "";
}

static int32_t view_torque(const cJSON *object)
{
    const double value = view_number(object, "torque_permille");
    return fabs(value) <= 1e6 ? (int32_t)lrint(value) : 0;
}

/* Of a drive that says another word nothing is known. */
static enum hal_drive_state view_drive(const char *text)
{
    for (int i = 0; i <= HAL_DRIVE_FAULT; i++)
        if (strcmp(text, hal_drive_state_text((enum hal_drive_state)i)) == 0)
            return (enum hal_drive_state)i;
    return HAL_DRIVE_OFFLINE;
}

static void view_from_axis(const cJSON *from, struct machine_view_axis *to)
{
    *to = (struct machine_view_axis){
        .drive = view_drive(view_text(from, "drive")),
        .known = view_member(from, "position") != NULL,
        .homed = view_is(from, "homed"),
        .pos_q32 = view_q32(from, "position"),
        .vel_q32 = view_q32(from, "velocity"),
        .following_q32 = view_q32(from, "following"),
        .demand_q32 = view_q32(from, "demand"),
        .offset_q32 = view_q32(from, "offset"),
        .torque_known = view_member(from, "torque_permille") != NULL,
        .torque_permille = view_torque(from),
        .home_switch = view_is(from, "home_switch"),
        .limit_negative = view_is(from, "limit_negative"),
        .limit_positive = view_is(from, "limit_positive"),
        .has_statusword = view_member(from, "statusword") != NULL,
        .statusword = (uint16_t)view_count(from, "statusword", UINT16_MAX),
        .fault_code = (uint16_t)view_count(from, "fault_code", UINT16_MAX),
    };
    snprintf(to->fault_text, sizeof to->fault_text, "%s",
             view_text(from, "error"));
}

static void view_from_bus(const cJSON *from, struct machine_view_bus *to)
{
    const char *state = view_text(from, "state");
    to->can_state = state[0] != '\0' ? HAL_CAN_DOWN : -1;
    for (int i = HAL_CAN_ACTIVE; i < HAL_CAN_DOWN; i++)
        if (strcmp(state, hal_can_state_text((enum hal_can_state)i)) == 0)
            to->can_state = i;
    to->busy_ns = view_count(from, "busy_ns", 1e18);
    to->errors = (uint64_t)view_count(from, "errors", 1e18);
    to->line.stray = (uint64_t)view_count(from, "strays", 1e18);
    to->line.echoes = (uint64_t)view_count(from, "echoes", 1e18);
    to->line.broken = (uint64_t)view_count(from, "broken", 1e18);
    to->line.late = (uint64_t)view_count(from, "late", 1e18);
}

void machine_view_from(const struct rig *rig, const cJSON *object,
                       struct machine_view *view)
{
    const cJSON *axes = view_member(object, "axes");
    const cJSON *buses = view_member(object, "buses");
    const cJSON *lines = view_member(object, "lines");
    for (unsigned i = 0; i < rig->axis_count; i++)
        view_from_axis(cJSON_GetArrayItem(axes, (int)i), &view->axis[i]);
    for (unsigned i = 0; i < rig->bus_count; i++)
        view_from_bus(cJSON_GetArrayItem(buses, (int)i), &view->bus[i]);
    for (unsigned i = 0; i < rig->line_count; i++) {
        const cJSON *active =
            view_member(cJSON_GetArrayItem(lines, (int)i), "active");
        view->line[i] = cJSON_IsBool(active) ? cJSON_IsTrue(active) : -1;
    }
}

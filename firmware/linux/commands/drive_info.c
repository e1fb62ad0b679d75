/* firmware/linux/commands/drive_info.c - slew drive info: who a drive is, what
 * it is set to, what went wrong with it. */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "firmware/linux/base/array.h"
#include "firmware/linux/base/json.h"
#include "firmware/linux/commands/drive_verbs.h"
#include "firmware/linux/rig/eds_need.h"
#include "motion/err.h"

#define INFO_ERRORS_MAX 16 /* of 0x1003 */
#define INFO_VALUES_MAX 64

static const struct {
    uint16_t index;
    uint8_t sub;
} info_object[] = {
    { 0x1000, 0 }, { 0x1008, 0 }, { 0x1009, 0 }, { 0x100A, 0 }, { 0x1018, 1 },
    { 0x1018, 2 }, { 0x1018, 3 }, { 0x1018, 4 }, { 0x6502, 0 }, { 0x6061, 0 },
    { 0x6041, 0 }, { 0x1001, 0 }, { 0x603F, 0 }, { 0x6064, 0 }, { 0x606C, 0 },
    { 0x6077, 0 }, { 0x60F4, 0 }, { 0x60FD, 0 }, { 0x6065, 0 }, { 0x6066, 0 },
    { 0x607D, 1 }, { 0x607D, 2 }, { 0x607F, 0 }, { 0x6085, 0 }, { 0x605A, 0 },
    { 0x6007, 0 }, { 0x1016, 1 }, { 0x1017, 0 }, { 0x6079, 0 },
};

struct info {
    struct drive_value value[INFO_VALUES_MAX];
    unsigned count, errors; /* the last `errors` are the history */
    const struct eds_need *missing[INFO_VALUES_MAX];
    unsigned missing_count;
    char fault[ASK_TURNS_REASON_MAX]; /* ODrive, moteus; "": none */
};

/* Aborted because it is not there, which says nothing worth a line. */
static bool info_is_absent(const struct talk *talk)
{
    return talk->can.abort_code == CANOPEN_ABORT_NO_OBJECT ||
           talk->can.abort_code == CANOPEN_ABORT_NO_SUB;
}

static void info_objects(struct talk *talk, struct info *info)
{
    for (size_t i = 0; i < ARRAY_LEN(info_object); i++) {
        struct drive_value *value = &info->value[info->count];
        struct object object;

        object_of(info_object[i].index, info_object[i].sub, talk->eds, &object);
        drive_read_object(talk, &object, value);
        if (value->error[0] == '\0' || !info_is_absent(talk))
            info->count++;
    }
}

/* 0x1003, the latest first. */
static void info_errors(struct talk *talk, struct info *info)
{
    uint32_t count = 0;

    if (ask_can_read_number(&talk->can, 0x1003, 0, &count, NULL) < 0)
        return;
    for (uint8_t i = 1; i <= count && i <= INFO_ERRORS_MAX; i++) {
        struct object object;

        object_of(0x1003, i, talk->eds, &object);
        object.type = OBJECT_U32;
        snprintf(object.name, sizeof object.name, "Error %u", i);
        drive_read_object(talk, &object, &info->value[info->count]);
        if (info->value[info->count].error[0] != '\0')
            return;
        info->count++;
        info->errors++;
    }
}

/* Is it there at all?  Access and mapping only a data sheet knows. */
static void info_needs(struct talk *talk, struct info *info)
{
    const unsigned uses = talk->axis == NULL
                              ? EDS_PLAIN
                              : rig_eds_uses(&talk->bench.rig, talk->axis);

    for (unsigned i = 0; i < eds_need_count; i++) {
        const struct eds_need *need = &eds_needs[i];
        uint8_t bytes[8];
        uint32_t length;

        if (eds_is_needed(need, uses) &&
            ask_can_read(&talk->can, need->index, need->sub, bytes,
                         sizeof bytes, &length) == MOTION_E_REFUSED &&
            info_is_absent(talk))
            info->missing[info->missing_count++] = need;
    }
}

static bool info_wants_csp(const struct talk *talk)
{
    return talk->axis == NULL || talk->axis->cia402.stream == DRIVE_CIA402_CSP;
}

static bool info_has_csp(const struct info *info)
{
    for (unsigned i = 0; i < info->count; i++)
        if (strcmp(info->value[i].number, "6502:0") == 0)
            return ((uint32_t)info->value[i].value & EDS_MODE_CSP) != 0;
    return true;
}

static void info_items(struct talk *talk, struct info *info)
{
    for (unsigned i = 0; i < talk->map->item_count; i++)
        drive_read_item(talk, &talk->map->item[i], &info->value[info->count++]);
}

static int info_turns(struct talk *talk, struct info *info)
{
    struct ask_turns_state state = { .is_fault = false };
    int err = drive_read_all(talk, info->value, INFO_VALUES_MAX, &info->count);

    if (err == MOTION_OK)
        err = ask_turns_state(&talk->turns, &state);
    if (err == MOTION_OK && state.is_fault)
        ask_turns_reason(&talk->turns, &state, info->fault);
    return err;
}

static void info_json(const struct talk *talk, const struct info *info, bool ok)
{
    cJSON *report = cJSON_CreateObject();

    cJSON_AddBoolToObject(report, "ok", ok);
    cJSON_AddStringToObject(report, "drive", talk->label);
    cJSON_AddItemToObject(
        report, "values",
        drive_values_json(info->value, info->count - info->errors));
    cJSON_AddItemToObject(
        report, "errors",
        drive_values_json(&info->value[info->count - info->errors],
                          info->errors));
    cJSON *missing = cJSON_AddArrayToObject(report, "missing");
    for (unsigned i = 0; i < info->missing_count; i++) {
        char number[OBJECT_NUMBER_MAX];

        snprintf(number, sizeof number, "%04X:%X", info->missing[i]->index,
                 info->missing[i]->sub);
        cJSON_AddItemToArray(missing, cJSON_CreateString(number));
    }
    if (info->fault[0] != '\0')
        cJSON_AddStringToObject(report, "fault", info->fault);
    json_print(report, stdout);
}

static void info_print(const struct talk *talk, const struct info *info,
                       bool ok)
{
    printf("%s\n\n", talk->label);
    drive_values_print(info->value, info->count - info->errors);
    if (info->errors > 0) {
        puts("\nwhat went wrong, the latest first:");
        drive_values_print(&info->value[info->count - info->errors],
                           info->errors);
    }
    for (unsigned i = 0; i < info->missing_count; i++)
        printf("\nit lacks %04X:%X: %s", info->missing[i]->index,
               info->missing[i]->sub, info->missing[i]->why);
    if (info->fault[0] != '\0')
        printf("\nit is in fault: %s\n", info->fault);
    if (talk->kind == TALK_CANOPEN)
        puts(ok ? "\nit has what slew needs"
                : "\nit does not have what slew needs");
}

static enum status info_run(struct talk *talk, const struct options *options)
{
    static struct info info;
    uint32_t device = 0;
    bool ok = true;
    int err;

    info = (struct info){ .count = 0 };
    if (talk_is_turns(talk)) {
        err = info_turns(talk, &info);
        if (err < 0)
            return drive_failed(talk, "", err);
    } else if (talk->kind == TALK_MODBUS) {
        if (talk->map == NULL)
            return drive_complain("expected --map: without one a Modbus drive "
                                  "says nothing about itself");
        info_items(talk, &info);
        ok = info.value[talk->map->position].error[0] == '\0';
    } else {
        err = ask_can_read_number(&talk->can, 0x1000, 0, &device, NULL);
        if (err < 0 && err != MOTION_E_REFUSED)
            return drive_failed(talk, "", err);
        info_objects(talk, &info);
        info_errors(talk, &info);
        info_needs(talk, &info);
        ok = info.missing_count == 0 &&
             (!info_wants_csp(talk) || info_has_csp(&info));
    }
    if (options->json)
        info_json(talk, &info, ok);
    else
        info_print(talk, &info, ok);
    return ok ? STATUS_OK : STATUS_REFUSED;
}

enum status drive_info(const struct options *options)
{
    struct talk *talk;
    enum status status = drive_open(options, &talk);

    if (status != STATUS_OK)
        return status;
    status = info_run(talk, options);
    talk_close(talk);
    return status;
}

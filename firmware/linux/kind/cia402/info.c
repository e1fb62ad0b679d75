/* firmware/linux/kind/cia402/info.c - slew drive info for a CiA 402 drive: who
 * it is, what it is set to, what went wrong with it. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/device/eds_need.h"
#include "firmware/linux/kind/cia402/verbs.h"
#include "motion/core/err.h"

#define INFO_ERRORS_MAX 16 /* of 0x1003 */

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

/* Of each other axis of the node. */
static const uint16_t info_axis_object[] = { 0x6041, 0x6061, 0x603F, 0x6064,
                                             0x606C };

/* Aborted because it is not there, which says nothing worth a line. */
static bool info_is_absent(const struct session *session)
{
    return session->can.abort_code == CANOPEN_ABORT_NO_OBJECT ||
           session->can.abort_code == CANOPEN_ABORT_NO_SUB;
}

/* Where the axis has it, or an axis whose PDOs do not matter. */
static uint16_t info_place(const struct session *session, uint16_t index)
{
    return session->axis != NULL
               ? rig_axis_object(session->axis, index)
               : drive_cia402_object_of(session->node_axis, 0, index);
}

/* Object by object as the first axis of a node has them.  False: it is not
 * there. */
static bool info_read(struct session *session, struct drive_info *info,
                      const struct rig_axis *axis, uint16_t index, uint8_t sub,
                      uint16_t there)
{
    struct drive_value *value = &info->value[info->count];
    struct object object;

    object_of(index, sub, session->eds, &object);
    cia402_read_object_of(session, axis, &object, there, value);
    if (value->error[0] != '\0' && info_is_absent(session))
        return false;
    info->count++;
    return true;
}

static void info_objects(struct session *session, struct drive_info *info)
{
    for (size_t i = 0; i < ARRAY_LEN(info_object); i++)
        (void)info_read(session, info, session->axis, info_object[i].index,
                        info_object[i].sub,
                        info_place(session, info_object[i].index));
}

/* "axis 2: Statusword" */
static void info_name_axis(struct drive_value *value, unsigned axis)
{
    char name[sizeof value->name];

    memcpy(name, value->name, sizeof name);
    snprintf(value->name, sizeof value->name, "axis %u: %.80s", axis + 1, name);
}

/* If the node has such an axis. */
static void info_axis(struct session *session, struct drive_info *info,
                      uint8_t number)
{
    const struct rig_axis *axis = session_axis_of(session, number);

    for (size_t i = 0; i < ARRAY_LEN(info_axis_object); i++) {
        const uint16_t index = info_axis_object[i];

        if (info_read(session, info, axis, index, 0,
                      drive_cia402_object_of(number, 0, index)))
            info_name_axis(&info->value[info->count - 1], number);
        else if (i == 0)
            return;
    }
}

/* The other axes of the node, if there are any. */
static void info_axes(struct session *session, struct drive_info *info)
{
    for (uint8_t i = 0; i < DRIVE_CIA402_AXES; i++)
        if (i != session->node_axis)
            info_axis(session, info, i);
}

/* 0x1003, the latest first. */
static void info_errors(struct session *session, struct drive_info *info)
{
    uint32_t count = 0;

    if (canopen_client_read_number(&session->can, 0x1003, 0, &count, NULL) < 0)
        return;
    for (uint8_t i = 1; i <= count && i <= INFO_ERRORS_MAX; i++) {
        struct object object;

        object_of(0x1003, i, session->eds, &object);
        object.type = OBJECT_U32;
        snprintf(object.name, sizeof object.name, "Error %u", i);
        cia402_read_object(session, &object, &info->value[info->count]);
        if (info->value[info->count].error[0] != '\0')
            return;
        info->count++;
        info->errors++;
    }
}

static void info_lacks(struct drive_info *info, uint16_t index,
                       const struct eds_need *need)
{
    snprintf(info->missing[info->missing_count].number,
             sizeof info->missing[0].number, "%04X:%X", index, need->sub);
    info->missing[info->missing_count++].why = need->why;
}

/* Is it there at all?  Access and mapping only a data sheet has. */
static void info_needs(struct session *session, struct drive_info *info)
{
    const unsigned uses = session->axis == NULL
                              ? EDS_PLAIN
                              : rig_eds_uses(&session->bench.rig, session->axis,
                                             info->quirks.quirk);

    for (unsigned i = 0; i < eds_need_count; i++) {
        const struct eds_need *need = &eds_needs[i];
        uint8_t bytes[8];
        uint32_t length;

        if (eds_is_needed(need, uses) &&
            canopen_client_read(&session->can, info_place(session, need->index),
                                need->sub, bytes, sizeof bytes,
                                &length) == MOTION_E_REFUSED &&
            info_is_absent(session))
            info_lacks(info, info_place(session, need->index), need);
    }
}

static bool info_wants_csp(const struct session *session,
                           const struct drive_info *info)
{
    static const struct rig_cia402 plain;

    return rig_stream(session->axis == NULL ? &plain : &session->axis->cia402,
                      info->quirks.quirk) == DRIVE_CIA402_CSP;
}

/* `otherwise` when it was not read. */
static uint32_t info_number(const struct drive_info *info, const char *number,
                            uint32_t otherwise)
{
    for (unsigned i = 0; i < info->count; i++)
        if (strcmp(info->value[i].number, number) == 0 &&
            info->value[i].error[0] == '\0')
            return (uint32_t)info->value[i].value;
    return otherwise;
}

static bool info_has_csp(const struct session *session,
                         const struct drive_info *info)
{
    char number[OBJECT_NUMBER_MAX];

    snprintf(number, sizeof number, "%04X:0", info_place(session, 0x6502));
    return (info_number(info, number, EDS_MODE_CSP) & EDS_MODE_CSP) != 0;
}

enum status cia402_info(struct session *session, struct drive_info *info)
{
    char message[YAML_MESSAGE_MAX];
    uint32_t device = 0;
    const int err =
        canopen_client_read_number(&session->can, 0x1000, 0, &device, NULL);

    if (err < 0 && err != MOTION_E_REFUSED)
        return drive_failed(session, "", err);
    info_objects(session, info);
    if (drive_quirks_find(
            &session->bench.rig, session->axis, info_number(info, "1018:1", 0),
            info_number(info, "1018:2", 0), &info->quirks, message) < 0)
        return drive_complain(message);
    info_axes(session, info);
    info_errors(session, info);
    info_needs(session, info);
    info->is_unsupervised =
        session->axis != NULL && session->axis->unsupervised;
    info->is_judged = true;
    info->ok = info->missing_count == 0 && !info->quirks.is_of_another &&
               (!info_wants_csp(session, info) || info_has_csp(session, info));
    return STATUS_OK;
}

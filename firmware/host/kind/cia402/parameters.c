/* firmware/host/kind/cia402/parameters.c - an axis's drive: its data sheet, and
 * what it is set to at start-up. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/quote.h"
#include "firmware/host/device/eds_need.h"
#include "firmware/host/device/object.h"
#include "firmware/host/kind/cia402/parts.h"

/* ---- the data sheet ---- */

/* Relative paths count from the rig's directory. */
static int rig_beside(const struct yaml_value *value, const char *name,
                      char path[RIG_PATH_MAX])
{
    const char *rig = value->tree->report.path;
    const char *slash = name[0] == '/' ? NULL : strrchr(rig, '/');
    const int length =
        snprintf(path, RIG_PATH_MAX, "%.*s%s",
                 slash == NULL ? 0 : (int)(slash - rig) + 1, rig, name);

    return length >= RIG_PATH_MAX
               ? yaml_value_refuse(value, "has too long a path")
               : 0;
}

unsigned rig_eds_uses(const struct rig *rig, const struct rig_axis *axis,
                      const struct drive_cia402_quirk *quirk)
{
    static const unsigned stream[] = { [DRIVE_CIA402_CSP] = EDS_CSP,
                                       [DRIVE_CIA402_IP] = EDS_IP,
                                       [DRIVE_CIA402_CSV] = EDS_CSV };
    static const unsigned option[DRIVE_CIA402_OPTIONS] = {
        [DRIVE_CIA402_QUICK_STOP] = EDS_QUICK_STOP,
        [DRIVE_CIA402_SHUTDOWN] = EDS_SHUTDOWN,
        [DRIVE_CIA402_DISABLE] = EDS_DISABLE,
        [DRIVE_CIA402_HALT] = EDS_HALT,
        [DRIVE_CIA402_FAULT] = EDS_FAULT,
    };
    const bool guarding =
        axis->cia402.guard_period_ns > 0 || (quirk != NULL && quirk->guarding);
    unsigned uses = EDS_ALWAYS | stream[rig_stream(&axis->cia402, quirk)];

    uses |= guarding ? EDS_GUARDING : EDS_HEARTBEAT;
    if (!axis->unsupervised)
        uses |= EDS_SUPERVISED | (guarding ? 0 : EDS_CONSUMER);
    uses |= axis->homing.by == HOMING_DRIVE ? EDS_HOMING : 0;
    uses |= rig->bus[axis->bus].sync_counter > 0 ? EDS_COUNTER : 0;
    for (unsigned i = 0; i < DRIVE_CIA402_OPTIONS; i++)
        uses |= axis->cia402.option[i].given ? option[i] : 0;
    return uses;
}

static uint32_t rig_eds_number(const struct eds *eds, uint8_t sub)
{
    const struct eds_object *object =
        eds == NULL ? NULL : eds_find(eds, 0x1018, sub);

    return object != NULL && object->has_value ? (uint32_t)object->value : 0;
}

uint16_t rig_axis_object(const struct rig_axis *axis, uint16_t index)
{
    return drive_cia402_object_of(axis->node_axis, axis->cia402.pdo.number,
                                  index);
}

int rig_judge_eds(const struct rig_reader *reader)
{
    const struct drive_cia402_quirk *quirk = rig_quirk(
        reader->rig, &reader->axis->cia402, rig_eds_number(reader->eds, 1),
        rig_eds_number(reader->eds, 2));

    for (unsigned i = 0; reader->eds != NULL && i < eds_need_count; i++) {
        const struct eds_need *need = &eds_needs[i];
        const uint16_t index = rig_axis_object(reader->axis, need->index);
        const char *lacks = eds_lacks(reader->eds, need, index);

        if (lacks != NULL &&
            eds_is_needed(need, rig_eds_uses(reader->rig, reader->axis, quirk)))
            return yaml_value_refuse(
                &reader->eds_value,
                "is of a drive that will not do: %04X:%X %s (%s)", index,
                need->sub, lacks, need->why);
    }
    return 0;
}

int rig_read_eds(void *reader, const struct yaml_value *value, void *out)
{
    struct rig_reader *self = reader;
    const char *name = yaml_value_text(value);
    char message[EDS_MESSAGE_MAX];

    if (name == NULL || rig_beside(value, name, out) < 0)
        return -1;
    rig_forget_eds(self);
    self->eds = memory_new(1, sizeof *self->eds);
    if (eds_load(files_regular(self->files), out, self->eds, message) < 0)
        return yaml_value_refuse(value, "cannot be read (%s)", message);
    self->axis->eds_odd = self->eds->warnings;
    self->axis->eds_odd_line =
        self->eds->warnings > 0 ? self->eds->warning[0].line : 0;
    self->eds_value = *value;
    return 0;
}

/* ---- parameters ---- */

/* What slew sets at start-up itself; the rig says it elsewhere or not at
 * all. */
static bool rig_is_own(const struct object *object)
{
    static const uint16_t own[] = { 0x1006, 0x1010, 0x1011, 0x1016, 0x1017,
                                    0x6007, 0x6040, 0x6060, 0x607A, 0x6085,
                                    0x60C2, 0x60FF, 0x6071 };

    const bool of_axis = object->index >= 0x6000 && object->index < 0xA000;
    const unsigned index = /* as the first axis of a node has it */
        of_axis ? 0x6000u | (object->index & 0x7FFu) : object->index;

    for (size_t i = 0; i < ARRAY_LEN(own); i++)
        if (index == own[i])
            return true;
    return object->index >= 0x1400 && object->index < 0x1C00;
}

/* "5" or "5 u16": the type where it stands nowhere else. */
static int rig_take_type(const struct yaml_value *value, struct object *object,
                         char number[QUOTE_MAX])
{
    const char *text = yaml_value_text(value);
    const char *blank;
    size_t length;

    if (text == NULL)
        return -1;
    blank = strchr(text, ' ');
    length = blank == NULL ? strlen(text) : (size_t)(blank - text);
    if (length >= QUOTE_MAX)
        return yaml_value_refuse(value, "is too long");
    memcpy(number, text, length);
    number[length] = '\0';
    if (blank == NULL && object->type != OBJECT_UNKNOWN)
        return 0;
    if (blank == NULL)
        return yaml_value_refuse(value, "has no known type");
    uint8_t type = OBJECT_UNKNOWN;
    if (!object_type_of(blank + 1, &type))
        return yaml_value_refuse(value, "has no such type");
    if (object->type != OBJECT_UNKNOWN && object->type != type)
        return yaml_value_refuse(value, "is %s, not %s",
                                 object_type_text(object->type), blank + 1);
    object->type = type;
    return 0;
}

/* "what is wrong, expected what": both halves of the sentence. */
static int rig_refuse_message(const struct yaml_value *value, char *message)
{
    static const char between[] = ", expected ";
    struct yaml_value refused = *value;
    char *expected = strstr(message, between);

    refused.expected = "one that can be written";
    if (expected != NULL) {
        *expected = '\0';
        refused.expected = expected + sizeof between - 1;
    }
    return yaml_value_refuse(&refused, "%s", message);
}

static int rig_object(void *of, const struct yaml_value *key,
                      const struct yaml_value *value)
{
    struct rig_objects *list = of;
    char message[OBJECT_MESSAGE_MAX], number[QUOTE_MAX];
    struct object object;
    int64_t wanted = 0;

    if (object_find(yaml_tree_text(key->tree, key->node), list->eds, &object,
                    message) < 0 ||
        (list->eds != NULL && !object.in_eds))
        return yaml_value_refuse(key, "is not an object of this drive%s",
                                 list->eds == NULL ? ""
                                                   : ", says its data sheet");
    if (rig_is_own(&object))
        return yaml_value_refuse(key, "is set by slew itself");
    if (object.in_eds && !object.readable)
        return yaml_value_refuse(key, "cannot be read back");
    if (rig_take_type(value, &object, number) < 0)
        return -1;
    if (object_parse(&object, number, &wanted, message) < 0)
        return rig_refuse_message(value, message);
    for (unsigned i = 0; i < *list->count; i++)
        if (list->object[i].index == object.index &&
            list->object[i].sub == object.sub)
            return yaml_value_refuse(key, "is there already");
    list->object[(*list->count)++] = (struct drive_cia402_parameter){
        .index = object.index,
        .sub = object.sub,
        .size = (uint8_t)object_type_size(object.type),
        .value = (uint32_t)wanted,
    };
    return 0;
}

int rig_read_objects(const struct yaml_value *value, struct rig_objects *list)
{
    return rig_read_pairs(value, list->count, list->most, list, rig_object);
}

int rig_read_parameters(void *reader, const struct yaml_value *value, void *out)
{
    struct rig_reader *self = reader;
    struct rig_axis *axis = self->axis;
    struct rig_objects list = { self->eds, axis->object, &axis->parameter_count,
                                RIG_PARAMETERS_MAX };

    (void)out;
    return rig_read_objects(value, &list);
}

/* firmware/linux/commands/files/import_urdf.c - see import_urdf.h.
 *
 * Values are replaced where they stand, comments stay, and numbers are those of
 * the description, in rad and m: slew converts units exactly, and nothing is
 * rounded on the way.  The new text is read as a rig before it is written. */
#include "firmware/linux/commands/files/import_urdf.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/host/move/move_text.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/planning.h"
#include "firmware/linux/commands/rig_text.h"
#include "firmware/linux/xml/urdf.h"

#define URDF_WRONG_MAX 256

struct import_urdf {
    const struct options *options;
    struct urdf urdf;
    struct rig rig;
    struct yaml_text yaml;
    struct move_text text;
    unsigned found; /* joints that are axes */
};

static enum status urdf_refuse(const char *message)
{
    error_say("%s", message);
    return STATUS_INPUT;
}

/* ---- one joint ----------------------------------------------------------- */

static struct yaml_value urdf_under(const struct yaml_value *map,
                                    const char *name)
{
    return (struct yaml_value){ map->tree, yaml_fields_find(map, name), name,
                                "a value" };
}

static int urdf_replace(struct import_urdf *self, const struct yaml_value *at,
                        const char *number, const char *unit)
{
    char text[URDF_NUMBER_MAX + 8];

    snprintf(text, sizeof text, "%s %s", number, unit);
    return yaml_text_replace(&self->yaml, at, text);
}

static int urdf_limits(struct import_urdf *self, const struct urdf_joint *joint,
                       const struct yaml_value *limits)
{
    struct yaml_value position = urdf_under(limits, "position");
    const struct yaml_value velocity = urdf_under(limits, "velocity");
    const char *const unit = joint->slides ? "m" : "rad";
    int err = 0;

    position.node = yaml_value_node(&position)->first;
    if (!joint->is_free && joint->lower[0] != 0 && joint->upper[0] != 0) {
        err = urdf_replace(self, &position, joint->lower, unit);
        position.node = yaml_value_node(&position)->next;
        if (err == 0)
            err = urdf_replace(self, &position, joint->upper, unit);
    }
    if (err == 0 && joint->velocity[0] != 0)
        err = urdf_replace(self, &velocity, joint->velocity,
                           joint->slides ? "m/s" : "rad/s");
    return err;
}

/* What is wrong with a joint as limits of an axis in `unit`; NULL: nothing. */
static const char *urdf_wrong(const struct urdf_joint *joint,
                              enum units_axis unit, char text[URDF_WRONG_MAX])
{
    const bool turns = unit == UNITS_AXIS_DEG || unit == UNITS_AXIS_RAD ||
                       unit == UNITS_AXIS_REV;

    if (joint->slides ? unit != UNITS_AXIS_MM : !turns)
        snprintf(text, URDF_WRONG_MAX, "%s, and the axis of the rig is in %s",
                 joint->slides ? "slides" : "turns", units_axis_text(unit));
    else if (!joint->is_free && joint->lower[0] != 0 && joint->upper[0] != 0 &&
             strtod(joint->lower, NULL) >= strtod(joint->upper, NULL))
        snprintf(text, URDF_WRONG_MAX,
                 "goes from lower %s to upper %s, expected lower below upper",
                 joint->lower, joint->upper);
    else if (joint->velocity[0] != 0 && strtod(joint->velocity, NULL) <= 0)
        snprintf(text, URDF_WRONG_MAX,
                 "has the velocity %s, expected one above zero",
                 joint->velocity);
    else
        return NULL;
    return text;
}

static enum status urdf_joint(struct import_urdf *self,
                              const struct urdf_joint *joint,
                              const struct yaml_value *axes)
{
    const int found = rig_axis_index(&self->rig, joint->name);
    char message[YAML_MESSAGE_MAX + URDF_WRONG_MAX], text[URDF_WRONG_MAX];

    if (found < 0)
        return STATUS_OK;
    if (urdf_wrong(joint, self->rig.axis[found].unit, text) != NULL) {
        snprintf(message, sizeof message, "%.400s:%u:%u: joint '%s' %s",
                 self->options->path[1], joint->place.line, joint->place.column,
                 joint->name, text);
        return urdf_refuse(message);
    }
    const struct yaml_value axis = urdf_under(axes, joint->name),
                            limits = urdf_under(&axis, "limits");
    self->found++;
    return urdf_limits(self, joint, &limits) < 0 ? STATUS_INPUT : STATUS_OK;
}

/* ---- the new rig --------------------------------------------------------- */

static enum status urdf_edit(struct import_urdf *self, char *message)
{
    const struct yaml_report report = { self->options->rig, message,
                                        YAML_MESSAGE_MAX };
    enum status status = STATUS_OK;

    message[0] = 0;
    if (yaml_text_open(&self->yaml, &disk_files, &report) < 0)
        return urdf_refuse(message);
    const struct yaml_value root = { &self->yaml.tree, 0, "the rig", "a map" },
                            axes = urdf_under(&root, "axes");
    for (uint32_t i = 0; i < self->urdf.joints && status == STATUS_OK; i++)
        status = urdf_joint(self, &self->urdf.joint[i], &axes);
    if (status != STATUS_OK)
        return message[0] != 0 ? urdf_refuse(message) : status;
    if (self->found == 0) {
        snprintf(message, YAML_MESSAGE_MAX,
                 "%.400s: none of its joints is an axis of the rig; the first "
                 "is '%s'",
                 self->options->path[1], self->urdf.joint[0].name);
        return urdf_refuse(message);
    }
    self->text.data = yaml_text_make(&self->yaml, &self->text.length);
    return STATUS_OK;
}

static void urdf_print(const struct import_urdf *self)
{
    static const char *const head[] = { ">line", "<what", ">before", ">after" };
    struct table table;

    table_init(&table, 4, head);
    for (uint32_t i = 0; i < self->yaml.edits; i++) {
        table_cell(&table, "%u", self->yaml.edit[i].line);
        table_cell(&table, "%s", self->yaml.edit[i].what);
        table_cell(&table, "%s", self->yaml.edit[i].was);
        table_cell(&table, "%s", self->yaml.edit[i].is);
    }
    table_print(&table, stdout);
    table_free(&table);
    for (uint32_t i = 0; i < self->urdf.joints; i++)
        if (rig_axis_index(&self->rig, self->urdf.joint[i].name) < 0)
            printf("joint %s is no axis of the rig\n",
                   self->urdf.joint[i].name);
    printf("rig: %s, limits of %u %s; acceleration and jerk are not in the "
           "description\n",
           self->options->out, self->found,
           number_word(self->found, "axis", "axes"));
}

static void urdf_json(const struct import_urdf *self)
{
    cJSON *report = cJSON_CreateObject();

    cJSON_AddStringToObject(report, "rig", self->options->out);
    cJSON_AddNumberToObject(report, "axes", self->found);
    cJSON *list = cJSON_AddArrayToObject(report, "changes");
    for (uint32_t i = 0; i < self->yaml.edits; i++) {
        cJSON *row = cJSON_CreateObject();
        cJSON_AddNumberToObject(row, "line", self->yaml.edit[i].line);
        cJSON_AddStringToObject(row, "what", self->yaml.edit[i].what);
        cJSON_AddStringToObject(row, "before", self->yaml.edit[i].was);
        cJSON_AddStringToObject(row, "after", self->yaml.edit[i].is);
        cJSON_AddItemToArray(list, row);
    }
    json_print(report, stdout);
}

enum status import_urdf(const struct options *options)
{
    struct import_urdf *self = memory_new(1, sizeof *self);
    char message[YAML_MESSAGE_MAX];
    enum status status;

    self->options = options;
    status = urdf_read(&disk_files, options->path[1], &self->urdf, message) < 0
                 ? urdf_refuse(message)
                 : planning_rig(options->rig, &self->rig);
    if (status == STATUS_OK) {
        status = urdf_edit(self, message);
        if (status == STATUS_OK)
            status = rig_text_write(options->rig, &self->text, options->out);
        if (status == STATUS_OK && options->json)
            urdf_json(self);
        else if (status == STATUS_OK)
            urdf_print(self);
        yaml_text_close(&self->yaml);
    }
    free(self->text.data);
    rig_free(&self->rig);
    memory_free(self);
    return status;
}

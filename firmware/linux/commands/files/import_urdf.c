/* firmware/linux/commands/files/import_urdf.c - see import_urdf.h.
 *
 * Values are replaced where they stand, comments stay, and numbers are those of
 * the files, in rad and m: slew converts units exactly, and nothing is rounded on
 * the way.  The new text is read as a rig before it is written. */
#include "firmware/linux/commands/files/import_urdf.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/host/exchange/joint_limits.h"
#include "firmware/host/move/move_text.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/files/import_arm.h"
#include "firmware/linux/commands/planning.h"
#include "firmware/linux/commands/rig_text.h"
#include "firmware/linux/xml/urdf.h"

#define URDF_WRONG_MAX 256
#define URDF_FILES_MAX 2

struct import_urdf {
    const struct options *options; /* path[0]: urdf, then the files */
    struct urdf urdf;
    bool has_urdf;
    struct joint_limits_file limits[URDF_FILES_MAX]; /* of each file */
    struct rig rig;
    struct yaml_text yaml;
    struct move_text text;
    struct import_arm arm;
    bool is_found[RIG_AXES_MAX]; /* axes that are joints */
    unsigned found;
};

static enum status urdf_refuse(const char *message)
{
    error_say("%s", message);
    return STATUS_INPUT;
}

/* ---- the files ----------------------------------------------------------- */

/* Leave the range of a continuous joint, and all of a fixed one. */
static void urdf_limits_of(const struct urdf *urdf,
                           struct joint_limits_file *out)
{
    out->joints = out->lefts = 0;
    for (uint32_t i = 0; i < urdf->joints; i++) {
        const struct urdf_joint *joint = &urdf->joint[i];
        if (!joint->moves)
            continue;
        struct joint_limits *limits = &out->joint[out->joints++];
        *limits = (struct joint_limits){ .place = joint->place };
        memcpy(limits->name, joint->name, sizeof limits->name);
        if (!joint->is_free) {
            memcpy(limits->text[JOINT_LOWER], joint->lower, XML_NUMBER_MAX);
            memcpy(limits->text[JOINT_UPPER], joint->upper, XML_NUMBER_MAX);
        }
        memcpy(limits->text[JOINT_VELOCITY], joint->velocity, XML_NUMBER_MAX);
    }
}

static bool urdf_is_yaml(const char *path)
{
    const char *end = strrchr(path, '.');

    return end != NULL &&
           (strcmp(end, ".yaml") == 0 || strcmp(end, ".yml") == 0);
}

static enum status urdf_load(struct import_urdf *self, int i)
{
    const char *path = self->options->path[1 + i];
    char message[YAML_MESSAGE_MAX];

    if (urdf_is_yaml(path))
        return joint_limits_read(&disk_files, path, &self->limits[i], message) <
                       0
                   ? urdf_refuse(message)
                   : STATUS_OK;
    if (self->has_urdf)
        return urdf_refuse("slew import: two robot descriptions, expected one "
                           "and joint_limits.yaml");
    if (urdf_read(&disk_files, path, &self->urdf, message) < 0)
        return urdf_refuse(message);
    self->has_urdf = true;
    urdf_limits_of(&self->urdf, &self->limits[i]);
    return STATUS_OK;
}

/* ---- one joint ----------------------------------------------------------- */

/* What is wrong with a joint as limits of an axis; NULL: nothing. */
static const char *urdf_wrong(const struct import_urdf *self,
                              const struct joint_limits *joint,
                              enum units_axis unit, char text[URDF_WRONG_MAX])
{
    static const char *const above[] = {
        [JOINT_VELOCITY] = "velocity",
        [JOINT_ACCELERATION] = "acceleration",
        [JOINT_JERK] = "jerk",
    };
    const char *lower = joint->text[JOINT_LOWER],
               *upper = joint->text[JOINT_UPPER];
    const bool turns = unit == UNITS_AXIS_DEG || unit == UNITS_AXIS_RAD ||
                       unit == UNITS_AXIS_REV;

    for (uint32_t i = 0; self->has_urdf && i < self->urdf.joints; i++) {
        const struct urdf_joint *of = &self->urdf.joint[i];
        if (strcmp(of->name, joint->name) != 0 ||
            (of->slides ? unit == UNITS_AXIS_MM : turns))
            continue;
        snprintf(text, URDF_WRONG_MAX, "%s, and the axis of the rig is in %s",
                 of->slides ? "slides" : "turns", units_axis_text(unit));
        return text;
    }
    if (unit != UNITS_AXIS_MM && !turns) {
        snprintf(text, URDF_WRONG_MAX,
                 "has limits in rad or m, and the axis of the rig is in %s",
                 units_axis_text(unit));
        return text;
    }
    if (lower[0] != 0 && upper[0] != 0 &&
        strtod(lower, NULL) >= strtod(upper, NULL)) {
        snprintf(text, URDF_WRONG_MAX,
                 "goes from lower %s to upper %s, expected lower below upper",
                 lower, upper);
        return text;
    }
    for (int i = JOINT_VELOCITY; i < JOINT_LIMIT_COUNT; i++)
        if (joint->text[i][0] != 0 && strtod(joint->text[i], NULL) <= 0) {
            snprintf(text, URDF_WRONG_MAX,
                     "has the %s %s, expected one above zero", above[i],
                     joint->text[i]);
            return text;
        }
    return NULL;
}

static struct yaml_value urdf_under(const struct yaml_value *map,
                                    const char *name)
{
    return (struct yaml_value){ map->tree, yaml_fields_find(map, name), name,
                                "a value" };
}

/* Replace a limit, or insert it (jerk) in front of the acceleration. */
static int urdf_set(struct import_urdf *self, const struct yaml_value *limits,
                    const char *name, const char *number, const char *unit)
{
    static const char *const before = "acceleration";
    const struct yaml_value at = urdf_under(limits, name);
    char text[JOINT_LIMITS_TEXT_MAX + 8];

    if (number[0] == 0)
        return 0;
    snprintf(text, sizeof text, "%s %s", number, unit);
    return at.node != 0 ? yaml_text_replace(&self->yaml, &at, text)
                        : yaml_text_insert(&self->yaml, limits, name, text,
                                           yaml_fields_key(limits, before));
}

static int urdf_set_range(struct import_urdf *self,
                          const struct yaml_value *limits,
                          const struct joint_limits *joint, const char *unit)
{
    struct yaml_value end = urdf_under(limits, "position");
    char text[JOINT_LIMITS_TEXT_MAX + 8];

    if (joint->text[JOINT_LOWER][0] == 0 || joint->text[JOINT_UPPER][0] == 0)
        return 0;
    end.node = yaml_value_node(&end)->first;
    for (int i = JOINT_LOWER; i <= JOINT_UPPER; i++) {
        snprintf(text, sizeof text, "%s %s", joint->text[i], unit);
        if (yaml_text_replace(&self->yaml, &end, text) < 0)
            return -1;
        end.node = yaml_value_node(&end)->next;
    }
    return 0;
}

static int urdf_set_all(struct import_urdf *self,
                        const struct joint_limits *joint,
                        const struct yaml_value *limits, bool slides)
{
    if (urdf_set_range(self, limits, joint, slides ? "m" : "rad") < 0 ||
        urdf_set(self, limits, "velocity", joint->text[JOINT_VELOCITY],
                 slides ? "m/s" : "rad/s") < 0 ||
        urdf_set(self, limits, "acceleration", joint->text[JOINT_ACCELERATION],
                 slides ? "m/s2" : "rad/s2") < 0)
        return -1;
    return urdf_set(self, limits, "jerk", joint->text[JOINT_JERK],
                    slides ? "m/s3" : "rad/s3");
}

/* Take what the later file gives. */
static void urdf_merge(const struct joint_limits *from, struct joint_limits *to)
{
    const bool has_range =
        from->text[JOINT_LOWER][0] != 0 && from->text[JOINT_UPPER][0] != 0;

    for (int i = 0; i < JOINT_LIMIT_COUNT; i++)
        if (i <= JOINT_UPPER ? has_range : from->text[i][0] != 0)
            memcpy(to->text[i], from->text[i], sizeof to->text[i]);
}

/* Set what all files say of an axis. */
static enum status urdf_axis(struct import_urdf *self, unsigned index,
                             const struct yaml_value *axes)
{
    const struct rig_axis *axis = &self->rig.axis[index];
    struct joint_limits all = { .name = "" };
    char message[YAML_MESSAGE_MAX + URDF_WRONG_MAX], text[URDF_WRONG_MAX];

    for (int f = 0; f + 1 < self->options->path_count; f++)
        for (uint32_t i = 0; i < self->limits[f].joints; i++) {
            const struct joint_limits *joint = &self->limits[f].joint[i];
            if (strcmp(joint->name, axis->name) != 0)
                continue;
            if (urdf_wrong(self, joint, axis->unit, text) != NULL) {
                snprintf(message, sizeof message, "%.400s:%u:%u: joint '%s' %s",
                         self->options->path[1 + f], joint->place.line,
                         joint->place.column, joint->name, text);
                return urdf_refuse(message);
            }
            urdf_merge(joint, &all);
            self->is_found[index] = true;
        }
    if (!self->is_found[index])
        return STATUS_OK;
    const struct yaml_value at = urdf_under(axes, axis->name),
                            limits = urdf_under(&at, "limits");
    self->found++;
    return urdf_set_all(self, &all, &limits, axis->unit == UNITS_AXIS_MM) < 0
               ? STATUS_INPUT
               : STATUS_OK;
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
    for (unsigned i = 0; i < self->rig.axis_count && status == STATUS_OK; i++)
        status = urdf_axis(self, i, &axes);
    if (status != STATUS_OK)
        return message[0] != 0 ? urdf_refuse(message) : status;
    if (self->found == 0) {
        snprintf(message, YAML_MESSAGE_MAX,
                 "%.380s: none of its joints is an axis of the rig; the first "
                 "is '%s'",
                 self->options->path[1],
                 self->limits[0].joints > 0 ? self->limits[0].joint[0].name
                                            : "");
        return urdf_refuse(message);
    }
    self->text.data = yaml_text_make(&self->yaml, &self->text.length);
    if (self->has_urdf)
        import_arm(&self->urdf, &self->rig, self->options, &self->text,
                   &self->arm);
    return STATUS_OK;
}

/* ---- what became of it --------------------------------------------------- */

/* Name each word that is not read, of both kinds of file. */
static void urdf_each_left(const struct import_urdf *self, void *to,
                           void (*take)(void *to, const char *word,
                                        uint32_t count, uint32_t line))
{
    for (uint32_t i = 0; i < self->urdf.unreads; i++)
        take(to, self->urdf.unread[i].word, self->urdf.unread[i].count,
             self->urdf.unread[i].line);
    for (int f = 0; f + 1 < self->options->path_count; f++)
        for (uint32_t i = 0; i < self->limits[f].lefts; i++)
            take(to, self->limits[f].left[i].word,
                 self->limits[f].left[i].count, self->limits[f].left[i].line);
}

static void urdf_print_left(void *to, const char *word, uint32_t count,
                            uint32_t line)
{
    unsigned *printed = to;

    printf("%s%s (%u, line %u)", (*printed)++ == 0 ? "not read: " : ", ", word,
           count, line);
}

static void urdf_json_left(void *to, const char *word, uint32_t count,
                           uint32_t line)
{
    cJSON *row = cJSON_CreateObject();

    cJSON_AddStringToObject(row, "what", word);
    cJSON_AddNumberToObject(row, "count", count);
    cJSON_AddNumberToObject(row, "line", line);
    cJSON_AddItemToArray(to, row);
}

/* Write the value of an edit; a new entry has its name before it. */
static const char *urdf_after(const struct yaml_text_edit *edit,
                              char text[YAML_TEXT_VALUE_MAX])
{
    const size_t from = edit->length == 0 ? strlen(edit->what) + 2 : 0;

    snprintf(text, YAML_TEXT_VALUE_MAX, "%s", edit->is + from);
    if (edit->length == 0)
        text[strcspn(text, ",\r\n")] = 0;
    return text;
}

static void urdf_print(const struct import_urdf *self)
{
    char after[YAML_TEXT_VALUE_MAX];
    static const char *const head[] = { ">line", "<what", ">before", ">after" };
    struct table table;
    unsigned printed = 0;

    table_init(&table, 4, head);
    for (uint32_t i = 0; i < self->yaml.edits; i++) {
        table_cell(&table, "%u", self->yaml.edit[i].line);
        table_cell(&table, "%s", self->yaml.edit[i].what);
        table_cell(&table, "%s", self->yaml.edit[i].was);
        table_cell(&table, "%s", urdf_after(&self->yaml.edit[i], after));
    }
    table_print(&table, stdout);
    table_free(&table);
    for (int f = 0; f + 1 < self->options->path_count; f++)
        for (uint32_t i = 0; i < self->limits[f].joints; i++)
            if (rig_axis_index(&self->rig, self->limits[f].joint[i].name) < 0)
                printf("joint %s is no axis of the rig\n",
                       self->limits[f].joint[i].name);
    urdf_each_left(self, &printed, urdf_print_left);
    if (printed > 0)
        printf("\n");
    if (self->has_urdf)
        import_arm_print(&self->arm);
    printf("rig: %s, limits of %u %s\n", self->options->out, self->found,
           number_word(self->found, "axis", "axes"));
}

static void urdf_json(const struct import_urdf *self)
{
    char after[YAML_TEXT_VALUE_MAX];
    cJSON *report = cJSON_CreateObject();

    cJSON_AddStringToObject(report, "rig", self->options->out);
    cJSON_AddNumberToObject(report, "axes", self->found);
    cJSON *list = cJSON_AddArrayToObject(report, "changes");
    for (uint32_t i = 0; i < self->yaml.edits; i++) {
        cJSON *row = cJSON_CreateObject();
        cJSON_AddNumberToObject(row, "line", self->yaml.edit[i].line);
        cJSON_AddStringToObject(row, "what", self->yaml.edit[i].what);
        cJSON_AddStringToObject(row, "before", self->yaml.edit[i].was);
        cJSON_AddStringToObject(row, "after",
                                urdf_after(&self->yaml.edit[i], after));
        cJSON_AddItemToArray(list, row);
    }
    urdf_each_left(self, cJSON_AddArrayToObject(report, "not_read"),
                   urdf_json_left);
    if (self->has_urdf)
        import_arm_json(&self->arm, report);
    json_report(report, true);
}

enum status import_urdf(const struct options *options)
{
    struct import_urdf *self = memory_new(1, sizeof *self);
    char message[YAML_MESSAGE_MAX];
    enum status status = STATUS_OK;

    self->options = options;
    for (int i = 0; i + 1 < options->path_count && status == STATUS_OK; i++)
        status = urdf_load(self, i);
    if (status == STATUS_OK)
        status = planning_rig(options->rig, &self->rig);
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

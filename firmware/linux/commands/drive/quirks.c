/* firmware/linux/commands/drive/quirks.c - what a drive's maker does otherwise,
 * and what slew makes of it, for slew drive info. */
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/json.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/commands/drive/verbs.h"

/* ---- what is done ---- */

__attribute__((format(printf, 2, 3))) static void
quirks_say(struct drive_quirks *quirks, const char *format, ...)
{
    va_list values;

    if (quirks->line_count == DRIVE_QUIRKS_LINES_MAX)
        return;
    va_start(values, format);
    vsnprintf(quirks->line[quirks->line_count++], DRIVE_QUIRKS_LINE_MAX, format,
              values);
    va_end(values);
}

static void quirks_say_times(struct drive_quirks *quirks)
{
    const struct drive_cia402_quirk *quirk = quirks->quirk;
    const struct {
        const char *what;
        int64_t t_ns;
    } time[] = {
        { "for an answer to an SDO", quirk->sdo_timeout_ns },
        { "for a step of its states", quirk->state_timeout_ns },
        { "for its brake", quirk->brake_timeout_ns },
        { "for power", quirk->precharge_timeout_ns },
    };

    for (size_t i = 0; i < ARRAY_LEN(time); i++)
        if (time[i].t_ns != 0)
            quirks_say(quirks, "slew waits %" PRId64 " ms %s",
                       time[i].t_ns / 1000000, time[i].what);
}

static void quirks_say_objects(struct drive_quirks *quirks)
{
    const struct drive_cia402_quirk *quirk = quirks->quirk;

    for (unsigned i = 0; i < DRIVE_CIA402_OPTIONS; i++)
        if (quirk->option[i].given)
            quirks_say(quirks, "0x%04X:00 is set to %d", 0x605A + i,
                       quirk->option[i].value);
    for (unsigned i = 0; i < quirk->parameter_count; i++)
        quirks_say(quirks, "0x%04X:%02X is set to 0x%" PRIX32,
                   quirk->parameter[i].index, quirk->parameter[i].sub,
                   quirk->parameter[i].value);
    for (unsigned i = 0; i < quirk->fixed_count; i++)
        quirks_say(quirks, "0x%04X:%02X is not written, and must be 0x%" PRIX32,
                   quirk->fixed[i].index, quirk->fixed[i].sub,
                   quirk->fixed[i].value);
}

/* What the rig says goes before all of this. */
static void quirks_explain(struct drive_quirks *quirks)
{
    if (quirks->quirk->interpolates)
        quirks_say(quirks, "set points go by interpolated position (mode: ip)");
    if (quirks->quirk->guarding)
        quirks_say(quirks, "node guarding takes the place of heartbeats");
    if (quirks->quirk->homing_without_bit_10)
        quirks_say(quirks, "at the end of its homing standstill is read from "
                           "0x6064, not in bit 10");
    quirks_say_times(quirks);
    quirks_say_objects(quirks);
}

/* ---- which ---- */

/* The file of a quirk of the rig, or of slew's own. */
static int quirks_path(const struct rig *rig, const struct rig_axis *axis,
                       const struct quirk_set *own, struct drive_quirks *quirks)
{
    const char *name;

    if (axis != NULL && axis->cia402.quirk_given) {
        snprintf(quirks->path, sizeof quirks->path, "%s",
                 rig->quirk_path[axis->cia402.quirk]);
        return 0;
    }
    name = own->name[quirks->quirk - own->quirk];
    return disk_files.find(&disk_files, FILES_QUIRKS, name, "", quirks->path)
               ? 0
               : -1;
}

int drive_quirks_find(const struct rig *rig, const struct rig_axis *axis,
                      uint32_t vendor, uint32_t product,
                      struct drive_quirks *quirks,
                      char message[YAML_MESSAGE_MAX])
{
    const struct quirk_set *own = quirk_own(&disk_files, message);

    quirks->quirk = NULL;
    quirks->is_of_another = false;
    quirks->line_count = 0;
    if (own == NULL)
        return -1;
    quirks->quirk =
        axis != NULL
            ? rig_quirk(rig, &axis->cia402, vendor, product)
            : drive_cia402_quirk_find(own->quirk, own->count, vendor, product);
    if (quirks->quirk == NULL)
        return 0;
    quirks->is_of_another =
        quirks->quirk->vendor != 0 &&
        !drive_cia402_quirk_is_of(quirks->quirk, vendor, product);
    quirks_explain(quirks);
    if (quirks_path(rig, axis, own, quirks) < 0) {
        snprintf(message, YAML_MESSAGE_MAX, "its quirks cannot be read again");
        return -1;
    }
    return quirk_load(&disk_files, quirks->path, &quirks->file, message);
}

/* ---- said ---- */

void drive_quirks_print(const struct drive_quirks *quirks)
{
    if (quirks->quirk == NULL)
        return;
    printf("\nquirks of %s (%s)%s\n", quirks->file.title, quirks->path,
           quirks->line_count + quirks->file.note_count > 0 ? ":" : "");
    for (unsigned i = 0; i < quirks->line_count; i++)
        printf("  %s\n", quirks->line[i]);
    for (unsigned i = 0; i < quirks->file.note_count; i++)
        printf("  note: %s\n", quirks->file.note[i]);
    if (quirks->is_of_another)
        puts("the rig names these quirks, but by its 0x1018 the drive is "
             "another, so slew refuses it");
}

void drive_quirks_json(const struct drive_quirks *quirks, cJSON *report)
{
    if (quirks->quirk == NULL)
        return;
    cJSON *object = cJSON_AddObjectToObject(report, "quirks");

    cJSON_AddStringToObject(object, "title", quirks->file.title);
    cJSON_AddStringToObject(object, "file", quirks->path);
    cJSON_AddBoolToObject(object, "fit", !quirks->is_of_another);
    cJSON *lines = cJSON_AddArrayToObject(object, "does");
    for (unsigned i = 0; i < quirks->line_count; i++)
        cJSON_AddItemToArray(lines, cJSON_CreateString(quirks->line[i]));
    cJSON *notes = cJSON_AddArrayToObject(object, "notes");
    for (unsigned i = 0; i < quirks->file.note_count; i++)
        cJSON_AddItemToArray(notes, cJSON_CreateString(quirks->file.note[i]));
}

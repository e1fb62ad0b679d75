/* firmware/linux/commands/drive/sheet.c - slew drive info FILE.eds: will this
 * drive do? */
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/host/device/eds_need.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/drive/verbs.h"

/* Those that are kept. */
static unsigned sheet_odd(const struct eds *eds)
{
    return eds->warnings < EDS_WARNINGS_MAX ? eds->warnings : EDS_WARNINGS_MAX;
}

static void sheet_warn(const struct eds *eds, const char *path)
{
    struct messages messages = { .text = NULL };

    for (unsigned i = 0; i < sheet_odd(eds); i++)
        messages_add(&messages, MESSAGE_WARNING, "%s:%u: warning: %s", path,
                     eds->warning[i].line, eds->warning[i].text);
    if (eds->warnings > sheet_odd(eds))
        messages_add(&messages, MESSAGE_WARNING, "%s: and %u more", path,
                     eds->warnings - sheet_odd(eds));
    error_tell(&messages);
}

static void sheet_table(const struct eds *eds)
{
    static const char *const head[] = { "<object", "<what for", "<need",
                                        "<drive" };
    struct table table;

    table_init(&table, 4, head);
    for (unsigned i = 0; i < eds_need_count; i++) {
        const struct eds_need *need = &eds_needs[i];
        const char *lacks = eds_lacks(eds, need, need->index);

        table_cell(&table, "%04X:%u", need->index, need->sub);
        table_cell(&table, "%s", need->why);
        table_cell(&table, "%s", eds_need_text(need));
        table_cell(&table, "%s", lacks == NULL ? "yes" : lacks);
    }
    table_print(&table, stdout);
    table_free(&table);
}

static void sheet_json(const struct eds *eds, unsigned missing)
{
    cJSON *report = cJSON_CreateObject();

    cJSON_AddStringToObject(report, "vendor", eds->vendor);
    cJSON_AddStringToObject(report, "product", eds->product);
    cJSON *objects = cJSON_AddArrayToObject(report, "objects");
    for (unsigned i = 0; i < eds_need_count; i++) {
        const struct eds_need *need = &eds_needs[i];
        const char *lacks = eds_lacks(eds, need, need->index);
        char name[16];
        cJSON *object = cJSON_CreateObject();

        snprintf(name, sizeof name, "%04X:%u", need->index, need->sub);
        cJSON_AddStringToObject(object, "object", name);
        cJSON_AddBoolToObject(object, "required",
                              eds_is_needed(need, EDS_PLAIN));
        cJSON_AddStringToObject(object, "need", eds_need_text(need));
        cJSON_AddStringToObject(object, "drive", lacks == NULL ? "yes" : lacks);
        cJSON_AddItemToArray(objects, object);
    }
    cJSON *warnings = cJSON_AddArrayToObject(report, "warnings");
    for (unsigned i = 0; i < sheet_odd(eds); i++) {
        cJSON *warning = cJSON_CreateObject();
        cJSON_AddNumberToObject(warning, "line", eds->warning[i].line);
        cJSON_AddStringToObject(warning, "what", eds->warning[i].text);
        cJSON_AddItemToArray(warnings, warning);
    }
    json_report(report, missing == 0);
}

static void sheet_print(const struct eds *eds, unsigned missing)
{
    printf("%s, %s: %u %s\n\n",
           eds->vendor[0] != '\0' ? eds->vendor : "no vendor",
           eds->product[0] != '\0' ? eds->product : "no product", eds->count,
           number_word(eds->count, "object", "objects"));
    sheet_table(eds);
    if (missing == 0)
        puts("\nthis drive will do");
    else
        printf("\nthis drive lacks %u of the objects it must have\n", missing);
}

enum status drive_sheet(const struct options *options)
{
    struct eds *eds = memory_new(1, sizeof *eds);
    char message[EDS_MESSAGE_MAX];

    const char *dot = strrchr(options->path[1], '.');
    if (dot != NULL && strcmp(dot, ".yaml") == 0) {
        error_say(
            "slew drive info: %s is a rig, expected RIG AXIS, or an EDS or "
            "DCF file",
            options->path[1]);
        memory_free(eds);
        return STATUS_INPUT;
    }
    if (eds_load(&disk_files, options->path[1], eds, message) < 0) {
        error_say("%s", message);
        eds_free(eds);
        memory_free(eds);
        return STATUS_INPUT;
    }
    sheet_warn(eds, options->path[1]);
    const unsigned missing = eds_missing(eds, EDS_PLAIN);
    if (options->json)
        sheet_json(eds, missing);
    else
        sheet_print(eds, missing);
    eds_free(eds);
    memory_free(eds);
    return missing == 0 ? STATUS_OK : STATUS_REFUSED;
}

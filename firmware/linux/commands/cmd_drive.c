/* firmware/linux/commands/cmd_drive.c - slew drive info: will this drive do? */
#include <stdio.h>
#include <string.h>

#include "firmware/linux/base/json.h"
#include "firmware/linux/base/table.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/rig/eds.h"

#define CMD_DRIVE_CSP (UINT32_C(1) << 7) /* of 0x6502 */

enum cmd_drive_need { NEED_READ = 1, NEED_WRITE = 2, NEED_MAP = 4 };

/* What hal/drive_cia402_start.c asks of a drive; the first part it insists
 * on. */
static const struct {
    uint16_t index;
    uint8_t sub, need;
    bool required;
    const char *why;
} cmd_drive_row[] = {
    { 0x1000, 0, NEED_READ, true, "is it a drive" },
    { 0x1016, 1, NEED_READ | NEED_WRITE, true, "it stops when we are silent" },
    { 0x1017, 0, NEED_READ | NEED_WRITE, true, "its heartbeat" },
    { 0x1400, 1, NEED_READ | NEED_WRITE, true, "set points in a PDO" },
    { 0x1600, 0, NEED_READ | NEED_WRITE, true, "likewise, what it carries" },
    { 0x1800, 1, NEED_READ | NEED_WRITE, true, "feedback in a PDO" },
    { 0x1A00, 0, NEED_READ | NEED_WRITE, true, "likewise, what it carries" },
    { 0x6007, 0, NEED_READ | NEED_WRITE, true, "how it stops when we are" },
    { 0x6040, 0, NEED_MAP, true, "controlword" },
    { 0x6041, 0, NEED_READ | NEED_MAP, true, "statusword" },
    { 0x6060, 0, NEED_WRITE, true, "mode" },
    { 0x6061, 0, NEED_READ, true, "mode in force" },
    { 0x6064, 0, NEED_READ | NEED_MAP, true, "actual position" },
    { 0x607A, 0, NEED_READ | NEED_WRITE | NEED_MAP, true, "target position" },
    { 0x6502, 0, NEED_READ, true, "CSP among its modes" },
    { 0x1006, 0, NEED_READ | NEED_WRITE, false, "SYNC period" },
    { 0x603F, 0, NEED_READ, false, "error code" },
    { 0x6065, 0, NEED_READ | NEED_WRITE, false, "following error window" },
    { 0x6085, 0, NEED_READ | NEED_WRITE, false, "quick-stop ramp" },
    { 0x60C2, 1, NEED_READ | NEED_WRITE, false, "interpolation period" },
    { 0x60FD, 0, NEED_READ | NEED_MAP, false, "limit switches" },
};

/* NULL: all is well; else what is missing. */
static const char *cmd_drive_lacks(const struct eds_object *object,
                                   unsigned need)
{
    if (object == NULL)
        return "not there";
    if ((need & NEED_READ) != 0 && !object->readable)
        return "cannot be read";
    if ((need & NEED_WRITE) != 0 && !object->writable)
        return "cannot be written";
    if ((need & NEED_MAP) != 0 && !object->mappable)
        return "cannot be mapped";
    if (object->index == 0x6502 && object->has_value &&
        (object->value & CMD_DRIVE_CSP) == 0)
        return "has no CSP";
    return NULL;
}

#define CMD_DRIVE_ROWS (sizeof cmd_drive_row / sizeof cmd_drive_row[0])

static const char *cmd_drive_lacks_row(const struct eds *eds, size_t i)
{
    return cmd_drive_lacks(
        eds_find(eds, cmd_drive_row[i].index, cmd_drive_row[i].sub),
        cmd_drive_row[i].need);
}

/* How many objects are missing that must be there. */
static unsigned cmd_drive_missing(const struct eds *eds)
{
    unsigned missing = 0;
    for (size_t i = 0; i < CMD_DRIVE_ROWS; i++)
        missing +=
            cmd_drive_row[i].required && cmd_drive_lacks_row(eds, i) != NULL;
    return missing;
}

static void cmd_drive_table(const struct eds *eds)
{
    static const char *const head[] = { "<object", "<what for", "<need",
                                        "<drive" };
    struct table table;

    table_init(&table, 4, head);
    for (size_t i = 0; i < CMD_DRIVE_ROWS; i++) {
        const char *lacks = cmd_drive_lacks_row(eds, i);
        table_cell(&table, "%04X:%u", cmd_drive_row[i].index,
                   cmd_drive_row[i].sub);
        table_cell(&table, "%s", cmd_drive_row[i].why);
        table_cell(&table, "%s", cmd_drive_row[i].required ? "must" : "may");
        table_cell(&table, "%s", lacks == NULL ? "yes" : lacks);
    }
    table_print(&table, stdout);
    table_free(&table);
}

static void cmd_drive_json(const struct eds *eds, unsigned missing)
{
    cJSON *report = cJSON_CreateObject();
    cJSON_AddBoolToObject(report, "ok", missing == 0);
    cJSON_AddStringToObject(report, "vendor", eds->vendor);
    cJSON_AddStringToObject(report, "product", eds->product);
    cJSON *objects = cJSON_AddArrayToObject(report, "objects");
    for (size_t i = 0; i < CMD_DRIVE_ROWS; i++) {
        const char *lacks = cmd_drive_lacks_row(eds, i);
        char name[16];
        cJSON *object = cJSON_CreateObject();
        snprintf(name, sizeof name, "%04X:%u", cmd_drive_row[i].index,
                 cmd_drive_row[i].sub);
        cJSON_AddStringToObject(object, "object", name);
        cJSON_AddBoolToObject(object, "required", cmd_drive_row[i].required);
        cJSON_AddStringToObject(object, "drive", lacks == NULL ? "yes" : lacks);
        cJSON_AddItemToArray(objects, object);
    }
    json_print(report, stdout);
}

static void cmd_drive_print(const struct eds *eds, unsigned missing)
{
    printf("%s, %s: %u objects\n\n", eds->vendor, eds->product, eds->count);
    cmd_drive_table(eds);
    if (missing == 0)
        puts("\nthis drive will do");
    else
        printf("\nthis drive lacks %u of the objects it must have\n", missing);
}

static enum status cmd_drive_run(const struct options *options)
{
    static struct eds eds;
    char message[EDS_MESSAGE_MAX];
    if (options->path_count != 2 || strcmp(options->path[0], "info") != 0) {
        fprintf(stderr, "slew drive: expected info and an EDS or DCF file\n");
        return STATUS_INPUT;
    }
    if (eds_load(options->path[1], &eds, message) < 0) {
        fprintf(stderr, "%s\n", message);
        return STATUS_INPUT;
    }
    const unsigned missing = cmd_drive_missing(&eds);
    if (options->json)
        cmd_drive_json(&eds, missing);
    else
        cmd_drive_print(&eds, missing);
    return missing == 0 ? STATUS_OK : STATUS_REFUSED;
}

static const struct option_row cmd_drive_option[] = { OPTIONS_COMMON };

const struct command cmd_drive = {
    .name = "drive",
    .arguments = "info FILE.eds",
    .summary = "say whether a CANopen drive will do, from its data sheet",
    .text = "Reads the EDS or DCF file of the maker and checks that the drive "
            "has the\nobjects that slew needs, and may use them as it does.\n",
    .examples = "  slew drive info servo.eds\n",
    COMMAND_OPTIONS(cmd_drive_option),
    .run = cmd_drive_run,
};

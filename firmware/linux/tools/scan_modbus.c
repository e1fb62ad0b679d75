/* firmware/linux/tools/scan_modbus.c - who is on a Modbus line; see scan.h. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/device/modbus_map_load.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/machine/modbus_words.h"
#include "firmware/linux/tools/modbus_client.h"
#include "firmware/linux/tools/scan.h"
#include "motion/core/err.h"

/* ---- who are you ---- */

/* The n-th byte after the function code. */
static uint8_t reply_byte(const struct hal_modbus_reply *reply, unsigned n)
{
    if (n >= reply->bytes)
        return 0;
    return (uint8_t)(reply->value[n / 2] >> (n % 2 == 0 ? 8 : 0));
}

static void put_text(char *text, size_t capacity,
                     const struct hal_modbus_reply *reply, unsigned from,
                     unsigned length)
{
    size_t used = strlen(text);

    if (used > 0 && used + 2 < capacity)
        text[used++] = ' ';
    for (unsigned i = 0; i < length && used + 1 < capacity; i++) {
        const uint8_t byte = reply_byte(reply, from + i);

        if (byte >= ' ' && byte < 0x7F)
            text[used++] = (char)byte;
    }
    text[used] = '\0';
}

/* 2B: 0E 01 conformity more next count, then number, length, text. */
static void name_by_identification(const struct hal_modbus_reply *reply,
                                   char *text, size_t capacity)
{
    const unsigned count = reply_byte(reply, 5);
    unsigned at = 6;

    for (unsigned i = 0; i < count && at + 2 <= reply->bytes; i++) {
        const unsigned length = reply_byte(reply, at + 1);

        if (at + 2 + length > reply->bytes)
            return;
        put_text(text, capacity, reply, at + 2, length);
        at += 2 + length;
    }
}

static void look_name(struct modbus_client *client, struct scan_found *found)
{
    struct hal_modbus_request request = { .unit = client->unit,
                                          .function = HAL_MODBUS_IDENTIFY };

    if (modbus_client(client, &request) == MOTION_OK) {
        name_by_identification(&client->reply, found->name, sizeof found->name);
        return;
    }
    request.function = HAL_MODBUS_REPORT;
    if (modbus_client(client, &request) == MOTION_OK)
        put_text(found->name, sizeof found->name, &client->reply, 1,
                 client->reply.bytes > 1 ? client->reply.bytes - 1u : 0);
}

/* ---- which map fits ---- */

static bool map_fits(struct modbus_client *client, const char *name)
{
    static struct modbus_map map;
    char path[FILES_PATH_MAX], message[YAML_MESSAGE_MAX];
    int64_t value = 0;

    if (!disk_files.find(&disk_files, FILES_MAPS, name, "./", path) ||
        modbus_map_load(&disk_files, path, &map, message) < 0 ||
        map.identify.item == MODBUS_MAP_NO_ITEM)
        return false;
    return modbus_client_read_item(client, &map.item[map.identify.item],
                                   &value) == MOTION_OK &&
           modbus_map_meets(&map.identify, value);
}

static void look_map(struct modbus_client *client, struct scan_found *found)
{
    static char name[FILES_NAMES_MAX][FILES_NAME_MAX];
    const unsigned count = disk_files.names(&disk_files, FILES_MAPS, name);

    snprintf(found->fits, sizeof found->fits, "kind: modbus, if a map fits");
    for (unsigned i = 0; i < count; i++)
        if (map_fits(client, name[i])) {
            snprintf(found->fits, sizeof found->fits,
                     "kind: modbus, map: %.20s (perhaps)", name[i]);
            return;
        }
}

/* ---- the line ---- */

static void line_text(const struct bench *bench, char text[SCAN_LINE_MAX])
{
    static const char parity[] = { [MODBUS_PARITY_EVEN] = 'E',
                                   [MODBUS_PARITY_ODD] = 'O',
                                   [MODBUS_PARITY_NONE] = 'N' };
    const struct modbus_rtu_line *line = &bench->rig.bus[0].modbus.line;

    text[0] = '\0';
    if (bench->rig.bus[0].kind == RIG_MODBUS_RTU)
        snprintf(text, SCAN_LINE_MAX, "%u %u%c%u%s", line->baud,
                 modbus_rtu_data_bits(line), parity[line->parity],
                 line->stop_bits, line->is_ascii ? " ASCII" : "");
}

/* Any answer will do, and so will a refusal. */
static int unit_is_there(struct modbus_client *client)
{
    struct hal_modbus_request request = { .unit = client->unit,
                                          .function = HAL_MODBUS_READ,
                                          .count = 1 };
    int err = modbus_client(client, &request);

    if (err == MOTION_E_REFUSED && client->reply.exception == 1) {
        request.function = HAL_MODBUS_READ_INPUT;
        err = modbus_client(client, &request);
    }
    return err;
}

static void unit_look(struct scan *scan, struct modbus_client *client,
                      const struct bench *bench)
{
    struct scan_found *found =
        scan_add(scan, "Modbus", client->unit, bench->rig.bus[0].name);

    if (found == NULL)
        return;
    line_text(bench, found->line);
    snprintf(found->state, sizeof found->state, "answers");
    look_name(client, found);
    look_map(client, found);
}

/* An answer that is broken is somebody too, at another setting or two at one
 * number. */
static void unit_garbled(struct scan *scan, const struct bench *bench,
                         unsigned unit)
{
    char line[SCAN_LINE_MAX];

    line_text(bench, line);
    scan_note(scan,
              "%s%s%s: unit %u was answered with a broken frame: two devices "
              "of that number, or another line setting",
              bench->rig.bus[0].name, line[0] == '\0' ? "" : ", ", line, unit);
}

/* Say what the requests of the scan met on the line. */
static void line_heard(struct scan *scan, struct bench *bench)
{
    const struct rig_bus *bus = &bench->rig.bus[0];
    char text[MODBUS_WORDS][MODBUS_WORDS_MAX], line[SCAN_LINE_MAX];
    struct hal_modbus_stats stats;

    hal_modbus_stats(bench->ports.modbus[0], &stats);
    stats.broken = 0; /* said of each unit */
    line_text(bench, line);
    const unsigned count = modbus_words(bus, &stats, text);
    for (unsigned i = 0; i < count; i++)
        scan_note(scan, "%s%s%s: %s", bus->name, line[0] == '\0' ? "" : ", ",
                  line, text[i]);
}

int scan_modbus(struct scan *scan, struct bench *bench,
                const struct scan_config *config)
{
    struct modbus_client client;

    for (unsigned unit = config->first; unit <= config->last; unit++) {
        int err;

        modbus_client_init(&client, bench->ports.modbus[0], bench->ports.clock,
                           (uint8_t)unit);
        if (scan->progress != NULL)
            scan->progress("unit", unit, config->last);
        err = unit_is_there(&client);
        if (err == MOTION_E_IO)
            return err;
        if (hal_modbus_is_missing(&client.reply))
            continue;
        if (err == MOTION_OK || err == MOTION_E_REFUSED)
            unit_look(scan, &client, bench);
        else if (err == MOTION_E_PROTOCOL)
            unit_garbled(scan, bench, unit);
    }
    line_heard(scan, bench);
    return MOTION_OK;
}

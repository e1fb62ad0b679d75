/* firmware/linux/tools/scan_modbus.c - who is on a Modbus line; see scan.h. */
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/linux/rig/modbus_map_load.h"
#include "firmware/linux/tools/ask_modbus.h"
#include "firmware/linux/tools/scan.h"
#include "motion/err.h"

#define SCAN_MAPS 64

/* ---- who are you ---- */

/* The n-th byte after the function code. */
static uint8_t reply_byte(const struct hal_modbus_reply *reply, unsigned n)
{
    if (n >= reply->bytes)
        return 0;
    return (uint8_t)(reply->value[n / 2] >> (n % 2 == 0 ? 8 : 0));
}

static void put_text(char *text, size_t room,
                     const struct hal_modbus_reply *reply, unsigned from,
                     unsigned length)
{
    size_t used = strlen(text);

    if (used > 0 && used + 2 < room)
        text[used++] = ' ';
    for (unsigned i = 0; i < length && used + 1 < room; i++) {
        const uint8_t byte = reply_byte(reply, from + i);

        if (byte >= ' ' && byte < 0x7F)
            text[used++] = (char)byte;
    }
    text[used] = '\0';
}

/* 2B: 0E 01 conformity more next count, then number, length, text. */
static void name_by_identification(const struct hal_modbus_reply *reply,
                                   char *text, size_t room)
{
    const unsigned count = reply_byte(reply, 5);
    unsigned at = 6;

    for (unsigned i = 0; i < count && at + 2 <= reply->bytes; i++) {
        const unsigned length = reply_byte(reply, at + 1);

        if (at + 2 + length > reply->bytes)
            return;
        put_text(text, room, reply, at + 2, length);
        at += 2 + length;
    }
}

static void look_name(struct ask_modbus *ask, struct scan_found *found)
{
    struct hal_modbus_request request = { .unit = ask->unit,
                                          .function = HAL_MODBUS_IDENTIFY };

    if (ask_modbus(ask, &request) == MOTION_OK) {
        name_by_identification(&ask->reply, found->name, sizeof found->name);
        return;
    }
    request.function = HAL_MODBUS_REPORT;
    if (ask_modbus(ask, &request) == MOTION_OK)
        put_text(found->name, sizeof found->name, &ask->reply, 1,
                 ask->reply.bytes > 1 ? ask->reply.bytes - 1u : 0);
}

/* ---- which map fits ---- */

static int compare_names(const void *a, const void *b)
{
    return strcmp(a, b);
}

/* slew's own maps, beside one that is known to be there. */
static unsigned map_names(char name[SCAN_MAPS][MODBUS_MAP_NAME_MAX])
{
    char path[MODBUS_MAP_PATH_MAX], *slash;
    unsigned count = 0;
    DIR *handle;

    if (modbus_map_find("leadshine-el7", "./", path) < 0)
        return 0;
    slash = strrchr(path, '/');
    if (slash != NULL)
        *slash = '\0';
    handle = opendir(slash == NULL ? "." : path);
    if (handle == NULL)
        return 0;
    for (struct dirent *entry;
         (entry = readdir(handle)) != NULL && count < SCAN_MAPS;) {
        const char *dot = strrchr(entry->d_name, '.');
        const size_t length = dot == NULL ? 0 : (size_t)(dot - entry->d_name);

        if (length == 0 || length >= MODBUS_MAP_NAME_MAX ||
            strcmp(dot, ".yaml") != 0)
            continue;
        memcpy(name[count], entry->d_name, length);
        name[count++][length] = '\0';
    }
    closedir(handle);
    qsort(name, count, MODBUS_MAP_NAME_MAX, compare_names);
    return count;
}

static bool map_fits(struct ask_modbus *ask, const char *name)
{
    static struct modbus_map map;
    char path[MODBUS_MAP_PATH_MAX], message[RIG_MESSAGE_MAX];
    int64_t value = 0;

    if (modbus_map_find(name, "./", path) < 0 ||
        modbus_map_load(path, &map, message) < 0 ||
        map.identify.item == MODBUS_MAP_NO_ITEM)
        return false;
    return ask_modbus_read_item(ask, &map.item[map.identify.item], &value) ==
               MOTION_OK &&
           modbus_map_meets(&map.identify, value);
}

static void look_map(struct ask_modbus *ask, struct scan_found *found)
{
    static char name[SCAN_MAPS][MODBUS_MAP_NAME_MAX];
    const unsigned count = map_names(name);

    snprintf(found->fits, sizeof found->fits, "kind: modbus, if a map fits");
    for (unsigned i = 0; i < count; i++)
        if (map_fits(ask, name[i])) {
            snprintf(found->fits, sizeof found->fits,
                     "kind: modbus, map: %.20s (perhaps)", name[i]);
            return;
        }
}

/* ---- the line ---- */

static void line_text(const struct bench *bench, char text[16])
{
    static const char parity[] = { [MODBUS_PARITY_EVEN] = 'E',
                                   [MODBUS_PARITY_ODD] = 'O',
                                   [MODBUS_PARITY_NONE] = 'N' };
    const struct modbus_rtu_line *line = &bench->rig.bus[0].modbus.line;

    text[0] = '\0';
    if (bench->rig.bus[0].kind == RIG_MODBUS_RTU)
        snprintf(text, 16, "%u 8%c%u", line->baud, parity[line->parity],
                 line->stop_bits);
}

/* Any answer will do, and so will a refusal. */
static int unit_is_there(struct ask_modbus *ask)
{
    struct hal_modbus_request request = { .unit = ask->unit,
                                          .function = HAL_MODBUS_READ,
                                          .count = 1 };
    int err = ask_modbus(ask, &request);

    if (err == MOTION_E_REFUSED && ask->reply.exception == 1) {
        request.function = HAL_MODBUS_READ_INPUT;
        err = ask_modbus(ask, &request);
    }
    return err;
}

static void unit_look(struct scan *scan, struct ask_modbus *ask,
                      const struct bench *bench)
{
    struct scan_found *found =
        scan_add(scan, SCAN_MODBUS, ask->unit, bench->rig.bus[0].name);

    if (found == NULL)
        return;
    line_text(bench, found->line);
    snprintf(found->state, sizeof found->state, "answers");
    look_name(ask, found);
    look_map(ask, found);
}

/* An answer that is broken is somebody too, at another setting or two at one
 * number. */
static void unit_garbled(struct scan *scan, const struct bench *bench,
                         unsigned unit)
{
    char line[16];

    line_text(bench, line);
    scan_note(scan,
              "%s%s%s: unit %u was answered with a broken frame: two devices "
              "of that number, or another line setting",
              bench->rig.bus[0].name, line[0] == '\0' ? "" : ", ", line, unit);
}

int scan_modbus(struct scan *scan, struct bench *bench,
                const struct scan_config *config)
{
    struct ask_modbus ask;

    for (unsigned unit = config->first; unit <= config->last; unit++) {
        int err;

        ask_modbus_init(&ask, bench->ports.modbus[0], bench->ports.clock,
                        (uint8_t)unit);
        if (scan->progress != NULL)
            scan->progress("unit", unit, config->last);
        err = unit_is_there(&ask);
        if (err == MOTION_E_IO)
            return err;
        if (err == MOTION_OK || err == MOTION_E_REFUSED)
            unit_look(scan, &ask, bench);
        else if (err == MOTION_E_PROTOCOL)
            unit_garbled(scan, bench, unit);
    }
    return MOTION_OK;
}

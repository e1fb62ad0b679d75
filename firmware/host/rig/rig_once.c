/* firmware/host/rig/rig_once.c - what a rig may have once: a bus's interface,
 * serial port or server, a drive, a servo behind a board, a digital line.
 *
 * Two axes on one servo fight over it, and each takes the other's motion for a
 * fault of its own.  Whoever reads such a thing claims it by a text that is the
 * same for every spelling that the file alone can tell; what only the computer
 * knows (links, names of hosts) is claimed there, before it is opened:
 * firmware/linux/machine/machine_lock.h. */
#include "firmware/host/rig/rig_parts.h"

#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- the rule ---- */

static int once_refuse(const struct yaml_value *value,
                       const struct rig_claim *first)
{
    return yaml_value_refuse(value, "%s is %s's already, as in line %u",
                             first->thing, first->owner, first->line);
}

int rig_claim(struct rig_reader *reader, const struct yaml_value *value,
              const char *owner, const char *format, ...)
{
    struct rig_claim claim = { .name = value->name,
                               .line = yaml_value_node(value)->line };
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(claim.thing, sizeof claim.thing, format, arguments);
    va_end(arguments);
    snprintf(claim.owner, sizeof claim.owner, "%s", owner);
    for (size_t i = 0; i < reader->claim_count; i++)
        if (strcmp(reader->claim[i].name, claim.name) == 0 &&
            strcmp(reader->claim[i].thing, claim.thing) == 0)
            return once_refuse(value, &reader->claim[i]);
    reader->claim = memory_pool_more(&reader->memory, reader->claim,
                                     reader->claim_count, sizeof claim);
    reader->claim[reader->claim_count++] = claim;
    return 0;
}

/* ---- buses ---- */

/* "/dev//ttyUSB0" and "/dev/./ttyUSB0" are one file, whatever it is. */
static void once_path(char *to, const char *path)
{
    char *at = to;

    for (; *path != '\0'; path++) {
        if (*path == '/' && path[1] == '/')
            continue;
        if (*path == '/' && path[1] == '.' && path[2] == '/') {
            path++;
            continue;
        }
        *at++ = *path;
    }
    *at = '\0';
}

/* Names of hosts differ in no case and may end with a dot; this computer has
 * several. */
static void once_host(char *to, const char *host)
{
    static const char *const own[] = { "127.0.0.1", "::1", "ip6-localhost",
                                       "localhost.localdomain" };
    size_t length = strlen(host);

    for (size_t i = 0; i <= length; i++)
        to[i] = (char)tolower((unsigned char)host[i]);
    if (length > 1 && to[length - 1] == '.')
        to[length - 1] = '\0';
    for (size_t i = 0; i < ARRAY_LEN(own); i++)
        if (strcmp(to, own[i]) == 0)
            memcpy(to, "localhost", sizeof "localhost");
}

void rig_bus_thing(const struct rig_bus *bus, char text[RIG_THING_MAX])
{
    const size_t room = MODBUS_LINE_TEXT_MAX;

    switch (bus->kind) {
    case RIG_MODBUS_TCP:
        once_host(text, bus->modbus.host);
        snprintf(text + strlen(text), RIG_THING_MAX - room, ", port %u",
                 bus->modbus.port);
        break;
    case RIG_MODBUS_RTU:
        once_path(text, bus->modbus.device);
        break;
    case RIG_CANOPEN:
    case RIG_CAN:
        snprintf(text, RIG_THING_MAX, "%s", bus->interface);
        break;
    }
}

int rig_claim_bus(struct rig_reader *reader, const struct yaml_value *value,
                  const struct rig_bus *bus)
{
    char owner[RIG_OWNER_MAX], thing[RIG_THING_MAX];
    struct yaml_value at = *value;

    rig_bus_thing(bus, thing);
    if (thing[0] == '\0')
        return 0; /* it may have no interface */
    at.name = bus->kind == RIG_MODBUS_TCP   ? "host"
              : bus->kind == RIG_MODBUS_RTU ? "device"
                                            : "interface";
    at.node = yaml_fields_find(value, at.name);
    at.expected = "one bus with all of its axes";
    snprintf(owner, sizeof owner, "bus %s", bus->name);
    return rig_claim(reader, &at, owner, "%s", thing);
}

/* ---- drives ---- */

int rig_claim_drive(struct rig_reader *reader, const struct yaml_value *value)
{
    const struct rig_axis *axis = reader->axis;
    const char *bus = reader->rig->bus[axis->bus].name;
    char owner[RIG_OWNER_MAX];
    struct yaml_value at = *value;

    at.name = "node";
    snprintf(owner, sizeof owner, "axis %s", axis->name);
    if (axis->node_axis == 0)
        return rig_claim(reader, &at, owner, "%u on bus %s", axis->node_id,
                         bus);
    return rig_claim(reader, &at, owner, "%u, axis %u, on bus %s",
                     axis->node_id, /* as the file counts them */
                     axis->node_axis + (axis->kind == RIG_CIA402), bus);
}

/* ---- digital lines ---- */

static bool once_is_number(const char *text)
{
    return text[0] != '\0' && text[strspn(text, "0123456789")] == '\0';
}

/* A name without a chip is that of one line only, on whatever chip: else it is
 * refused when it is opened. */
int rig_claim_line(struct rig_reader *reader, const struct yaml_value *value,
                   const struct rig_line *line)
{
    const char *const device = "/dev/";
    const bool is_path = strncmp(line->chip, device, strlen(device)) == 0;
    const char *chip = line->chip + (is_path ? strlen(device) : 0);
    char owner[RIG_OWNER_MAX];
    struct yaml_value at = *value;

    at.name = "line";
    at.node = yaml_fields_find(value, at.name);
    at.expected = "a line of its own";
    snprintf(owner, sizeof owner, "line %s", line->name);
    if (chip[0] != '\0' && once_is_number(line->line))
        return rig_claim(reader, &at, owner, "%lu of %s",
                         strtoul(line->line, NULL, 10), chip);
    for (const struct rig_line *other = reader->rig->line; other < line;
         other++)
        if (strcmp(other->line, line->line) == 0 &&
            (line->chip[0] == '\0') != (other->chip[0] == '\0')) {
            struct rig_claim first = { .line = other->place.line };

            snprintf(first.thing, sizeof first.thing, "%s", line->line);
            snprintf(first.owner, sizeof first.owner, "line %s", other->name);
            return once_refuse(&at, &first);
        }
    return chip[0] == '\0'
               ? rig_claim(reader, &at, owner, "%s", line->line)
               : rig_claim(reader, &at, owner, "%s of %s", line->line, chip);
}

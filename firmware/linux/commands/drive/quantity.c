/* firmware/linux/commands/drive/quantity.c - what an ODrive or a moteus is
 * asked for; see verbs.h. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/device/endpoints.h"
#include "firmware/linux/commands/drive/verbs.h"
#include "motion/core/err.h"

/* ---- what is meant ---- */

static const struct quantity *turns_list(const struct talk *talk,
                                         unsigned *count)
{
    return talk->kind == TALK_MOTEUS
               ? quantity_of_moteus(count)
               : quantity_of_odrive(talk->turns.is_05, count);
}

static bool turns_number(const char *text, unsigned long most, uint16_t *number)
{
    char *end;
    const unsigned long value = strtoul(text, &end, 0);

    *number = (uint16_t)value;
    return end != text && *end == '\0' && value <= most;
}

/* A number that has a name has its type, too. */
static void turns_register(struct quantity *quantity)
{
    unsigned count;
    const struct quantity *list = quantity_of_moteus(&count);

    for (unsigned i = 0; i < count; i++)
        if (list[i].at == quantity->at)
            *quantity = list[i];
}

static int turns_type(const struct options *options, struct quantity *quantity,
                      char message[QUANTITY_MESSAGE_MAX])
{
    if (options->type == NULL ||
        quantity_type_of(options->type, &quantity->type))
        return 0;
    snprintf(message, QUANTITY_MESSAGE_MAX,
             "--type: expected bool, u8, i8, u16, i16, u32, i32 or f32");
    return -1;
}

/* The number of an endpoint says nothing of its type, that of a register is
 * the user's choice. */
static int turns_by_number(const struct talk *talk,
                           const struct options *options, uint16_t number,
                           struct quantity *quantity,
                           char message[QUANTITY_MESSAGE_MAX])
{
    const bool is_moteus = talk->kind == TALK_MOTEUS;

    *quantity = (struct quantity){
        .kind = is_moteus ? QUANTITY_REGISTER : QUANTITY_ENDPOINT,
        .type = QUANTITY_F32,
        .at = number,
        .readable = true,
        .writable = true,
        .unit = "",
    };
    if (is_moteus)
        turns_register(quantity);
    else if (talk->turns.is_05) {
        snprintf(message, QUANTITY_MESSAGE_MAX,
                 "an ODrive with firmware 0.5 has no endpoints on CAN");
        return -1;
    } else if (options->type == NULL) {
        snprintf(message, QUANTITY_MESSAGE_MAX,
                 "endpoint %u: expected --type, or its name and --endpoints",
                 number);
        return -1;
    }
    return turns_type(options, quantity, message);
}

/* Endpoints have other numbers in another firmware. */
static int turns_endpoint(const struct talk *talk, const char *text,
                          struct quantity *quantity,
                          char message[QUANTITY_MESSAGE_MAX])
{
    const uint8_t *has = &talk->turns.version[4];
    uint8_t of[3];

    if (talk->endpoints == NULL) {
        snprintf(message, QUANTITY_MESSAGE_MAX,
                 "'%.60s' may be an endpoint: expected --endpoints, the "
                 "drive's flat_endpoints.json",
                 text);
        return -1;
    }
    if (endpoints_version(talk->endpoints, of) && memcmp(of, has, 3) != 0) {
        snprintf(message, QUANTITY_MESSAGE_MAX,
                 "the endpoints are those of firmware %u.%u.%u, the drive has "
                 "%u.%u.%u",
                 of[0], of[1], of[2], has[0], has[1], has[2]);
        return -1;
    }
    return endpoints_find(talk->endpoints, text, quantity, message);
}

static int turns_by_name(const struct talk *talk, const char *text,
                         struct quantity *quantity,
                         char message[QUANTITY_MESSAGE_MAX])
{
    unsigned count;
    const struct quantity *list = turns_list(talk, &count);
    const struct quantity *found = quantity_find(text, list, count);

    if (found != NULL) {
        *quantity = *found;
        return 0;
    }
    if (talk->kind == TALK_ODRIVE && !talk->turns.is_05 &&
        strchr(text, '.') != NULL)
        return turns_endpoint(talk, text, quantity, message);
    quantity_unknown(text,
                     talk->kind == TALK_MOTEUS ? "register of a moteus"
                                               : "message of this ODrive",
                     list, count, message);
    return -1;
}

enum status drive_find_quantity(struct talk *talk, const char *text,
                                const struct options *options,
                                struct quantity *quantity)
{
    char message[QUANTITY_MESSAGE_MAX];
    uint16_t number;
    int err = ask_turns_hello(&talk->turns);

    if (err < 0)
        return drive_failed(talk, text, err);
    err = turns_number(text, talk->kind == TALK_MOTEUS ? 0x3FFF : UINT16_MAX,
                       &number)
              ? turns_by_number(talk, options, number, quantity, message)
              : turns_by_name(talk, text, quantity, message);
    return err == 0 ? STATUS_OK : drive_complain(message);
}

/* ---- all of it ---- */

static void turns_version(const struct talk *talk, struct drive_value *value)
{
    const uint8_t *version = talk->turns.version;

    *value = (struct drive_value){ .name = "firmware" };
    if (talk->turns.is_05)
        snprintf(value->text, sizeof value->text,
                 "0.5, as it does not answer for its version");
    else
        snprintf(value->text, sizeof value->text,
                 "%u.%u.%u%s, hardware %u.%u variant %u, protocol %u",
                 version[4], version[5], version[6],
                 version[7] != 0 ? " unreleased" : "", version[1], version[2],
                 version[3], version[0]);
}

/* Byte by byte, as 0x010304 for 1.3.4. */
static void turns_moteus_version(struct drive_value *value)
{
    if (strcmp(value->name, "firmware") == 0 && value->error[0] == '\0')
        snprintf(value->text, sizeof value->text, "%u.%u.%u",
                 (unsigned)(value->value >> 16 & 0xFF),
                 (unsigned)(value->value >> 8 & 0xFF),
                 (unsigned)(value->value & 0xFF));
}

int drive_read_all(struct talk *talk, struct drive_value *value, unsigned room,
                   unsigned *count)
{
    const struct quantity *list;
    unsigned known;
    const int err = ask_turns_hello(&talk->turns);

    if (err < 0)
        return err;
    *count = 0;
    if (talk->kind == TALK_ODRIVE)
        turns_version(talk, &value[(*count)++]);
    list = turns_list(talk, &known);
    for (unsigned i = 0; i < known && *count < room; i++) {
        if (list[i].writable) /* of no meaning at rest */
            continue;
        drive_read_quantity(talk, &list[i], &value[*count]);
        if (talk->kind == TALK_MOTEUS)
            turns_moteus_version(&value[*count]);
        *count += value[*count].error[0] == '\0';
    }
    return MOTION_OK;
}

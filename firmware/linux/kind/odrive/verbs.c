/* firmware/linux/kind/odrive/verbs.c - slew drive for an ODrive: see
 * firmware/linux/commands/drive/kind.h. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/device/endpoints.h"
#include "firmware/host/kind/odrive/quantity.h"
#include "firmware/linux/kind/turn/verbs.h"

/* The number of an endpoint says nothing of its type. */
static int odrive_by_number(const struct session *session,
                            const struct options *options, uint16_t number,
                            struct quantity *quantity,
                            char message[QUANTITY_MESSAGE_MAX])
{
    *quantity = turn_by_number(QUANTITY_ENDPOINT, number);
    if (session->turn.is_05) {
        snprintf(message, QUANTITY_MESSAGE_MAX,
                 "an ODrive with firmware 0.5 has no endpoints on CAN");
        return -1;
    }
    if (options->type == NULL) {
        snprintf(message, QUANTITY_MESSAGE_MAX,
                 "endpoint %u: expected --type, or its name and --endpoints",
                 number);
        return -1;
    }
    return turn_type(options, quantity, message);
}

/* Endpoints have other numbers in another firmware. */
static int odrive_endpoint(const struct session *session, const char *text,
                           struct quantity *quantity,
                           char message[QUANTITY_MESSAGE_MAX])
{
    const uint8_t *has = &session->turn.version[4];
    uint8_t of[3];

    if (session->endpoints == NULL) {
        snprintf(message, QUANTITY_MESSAGE_MAX,
                 "'%.60s' may be an endpoint: expected --endpoints, the "
                 "drive's flat_endpoints.json",
                 text);
        return -1;
    }
    if (endpoints_version(session->endpoints, of) && memcmp(of, has, 3) != 0) {
        snprintf(message, QUANTITY_MESSAGE_MAX,
                 "the endpoints are those of firmware %u.%u.%u, the drive has "
                 "%u.%u.%u",
                 of[0], of[1], of[2], has[0], has[1], has[2]);
        return -1;
    }
    return endpoints_find(session->endpoints, text, quantity, message);
}

static int odrive_find_one(const struct session *session, const char *text,
                           const struct options *options,
                           struct quantity *quantity,
                           char message[QUANTITY_MESSAGE_MAX])
{
    const struct quantity *list;
    uint16_t number;
    unsigned count;

    if (turn_number(text, UINT16_MAX, &number))
        return odrive_by_number(session, options, number, quantity, message);
    list = quantity_of_odrive(session->turn.is_05, &count);
    if (turn_by_name(text, "message of this ODrive", list, count, quantity,
                     message) == 0)
        return 0;
    return !session->turn.is_05 && strchr(text, '.') != NULL
               ? odrive_endpoint(session, text, quantity, message)
               : -1;
}

static enum status odrive_find(struct session *session, const char *text,
                               const struct options *options,
                               struct drive_what *what)
{
    return turn_find_quantity(session, text, options, &what->quantity,
                              odrive_find_one);
}

static void odrive_version(const struct session *session,
                           struct drive_value *value)
{
    const uint8_t *version = session->turn.version;

    *value = (struct drive_value){ .name = "firmware" };
    if (session->turn.is_05)
        snprintf(value->text, sizeof value->text,
                 "0.5, as it does not answer for its version");
    else
        snprintf(value->text, sizeof value->text,
                 "%u.%u.%u%s, hardware %u.%u variant %u, protocol %u",
                 version[4], version[5], version[6],
                 version[7] != 0 ? " unreleased" : "", version[1], version[2],
                 version[3], version[0]);
}

static enum status odrive_info(struct session *session, struct drive_info *info)
{
    const int err = turn_client_hello(&session->turn);
    const struct quantity *list;
    unsigned count;

    if (err < 0)
        return drive_failed(session, "", err);
    odrive_version(session, &info->value[info->count++]);
    list = quantity_of_odrive(session->turn.is_05, &count);
    turn_read_list(session, list, count, info);
    return turn_info_fault(session, info);
}

const struct verb_kind verb_kind_odrive = {
    .what = "messages of an ODrive, as info shows them; with --endpoints (its\n"
            "                  flat_endpoints.json) also those, such as\n"
            "                  axis0.config.watchdog_timeout",
    .find = odrive_find,
    .read = turn_read,
    .parse = turn_parse,
    .write = turn_write,
    .is_writable = turn_is_writable,
    .is_readable = turn_is_readable,
    .stored_by = "odrivetool save_configuration",
    .info = odrive_info,
};

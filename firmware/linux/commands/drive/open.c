/* firmware/linux/commands/drive/open.c - what the verbs of slew drive share;
 * see verbs.h. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/commands/drive/verbs.h"
#include "hal/linux/libmodbus.h"
#include "motion/core/err.h"

enum status drive_complain(const char *what)
{
    error_say("slew drive: %s", what);
    return STATUS_INPUT;
}

enum status drive_failed(const struct session *session, const char *what,
                         int err)
{
    char text[SESSION_TEXT_MAX];

    session_text(session, err, text);
    error_say("slew drive: %s: %s%s%s", session->label, what,
              what[0] == '\0' ? "" : ": ", text);
    return err == MOTION_E_IO ? STATUS_SYSTEM : STATUS_REFUSED;
}

static bool drive_parity(const char *word, enum modbus_parity *parity)
{
    static const char *const words[] = { [MODBUS_PARITY_EVEN] = "even",
                                         [MODBUS_PARITY_ODD] = "odd",
                                         [MODBUS_PARITY_NONE] = "none" };
    for (unsigned i = 0; i < ARRAY_LEN(words); i++)
        if (strcmp(word, words[i]) == 0) {
            *parity = (enum modbus_parity)i;
            return true;
        }
    return false;
}

/* --baud, --parity, --timeout. */
static enum status drive_line(const struct options *options,
                              struct bench_line *line)
{
    *line = (struct bench_line){ .timeout_ns = options->timeout_ns };
    if (options->baud > 0 && (options->baud > UINT32_MAX ||
                              !modbus_line_is_baud((uint32_t)options->baud)))
        return drive_complain("--baud: not a baud rate, expected one "
                              "such as 9600 or 115200");
    line->baud = (uint32_t)options->baud;
    if (options->parity != NULL &&
        !drive_parity(options->parity, &line->parity))
        return drive_complain("--parity: expected even, odd or none");
    return STATUS_OK;
}

enum status drive_open(const struct options *options, struct session **session)
{
    char message[YAML_MESSAGE_MAX];
    struct session_config config = {
        .target = options->path[1],
        .who = options->path[2],
        .bus = options->bus,
        .interface = options->interface,
        .eds = options->sheet,
        .map = options->map,
        .endpoints = options->endpoints,
        .kind = options->kind,
        .is_real = options->real,
    };
    const enum status status = drive_line(options, &config.line);

    if (status != STATUS_OK)
        return status;
    *session = memory_new(1, sizeof **session);
    if (session_open(*session, &config, message) < 0) {
        error_say("%s", message);
        memory_free(*session);
        return STATUS_INPUT;
    }
    return STATUS_OK;
}

void drive_close(struct session *session)
{
    session_close(session);
    memory_free(session);
}

enum status drive_must_be_off(struct session *session,
                              const struct options *options)
{
    const int enabled = session_is_enabled(session);

    if (enabled == 0 || (enabled == MOTION_E_EMPTY && options->yes))
        return STATUS_OK;
    if (enabled == MOTION_E_EMPTY)
        return drive_complain("the drive does not report whether it has "
                              "torque: make sure, then add --yes");
    if (enabled < 0)
        return drive_failed(session, "", enabled);
    error_say("slew drive: %s may have torque: nothing is written while it may "
              "move",
              session->label);
    return STATUS_REFUSED;
}

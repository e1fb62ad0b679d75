/* firmware/linux/kind/slew_mcu/verbs.c - slew drive for a board: see
 * firmware/linux/commands/drive/kind.h. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "firmware/control/controller.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/commands/drive/kind.h"
#include "hal/drive.h"
#include "hal/mcu/piece.h"
#include "motion/core/err.h"

/* ---- registers by their address ---- */

static enum status slew_mcu_find(struct session *session, const char *text,
                                 const struct options *options,
                                 struct drive_what *what)
{
    char *end;
    const unsigned long at = strtoul(text, &end, 0);

    (void)session;
    (void)options;
    if (end == text || *end != '\0' || at > UINT16_MAX) {
        error_say("slew drive: '%.40s' is no register of a board, expected an "
                  "address of docs/MCU.md such as 0x0010",
                  text);
        return STATUS_INPUT;
    }
    what->raw = (struct modbus_map_item){ .at = (uint16_t)at,
                                          .read = HAL_MODBUS_READ,
                                          .write = HAL_MODBUS_WRITE,
                                          .type = MODBUS_U16 };
    what->item = &what->raw;
    return STATUS_OK;
}

static void slew_mcu_read(struct session *session,
                          const struct drive_what *what,
                          struct drive_value *value)
{
    *value = (struct drive_value){ .is_number = true };
    snprintf(value->number, sizeof value->number, "0x%04X", what->item->at);
    snprintf(value->type, sizeof value->type, "u16");
    const int err =
        modbus_client_read_item(&session->line, what->item, &value->value);
    if (err < 0)
        session_text(session, err, value->error);
}

/* What a board takes are commands and pieces, each with its number and its
 * checksum: not register by register. */
static bool slew_mcu_is_writable(const struct drive_what *what)
{
    (void)what;
    return false;
}

static enum status slew_mcu_parse(struct session *session, const char *text,
                                  struct drive_what *what, int64_t *value)
{
    (void)session;
    (void)text;
    (void)what;
    *value = 0;
    return drive_complain("a board is not written register by register: slew "
                          "run moves it");
}

static int slew_mcu_write(struct session *session,
                          const struct drive_what *what, int64_t value)
{
    (void)session;
    (void)what;
    (void)value;
    return MOTION_E_REFUSED;
}

static enum status slew_mcu_store(struct session *session)
{
    (void)session;
    return drive_complain("a board stores nothing: slew run sends it what it "
                          "needs");
}

/* ---- info ---- */

static int info_read(struct session *session, unsigned address, unsigned count)
{
    const struct hal_modbus_request request = { .unit = session->node,
                                                .function = HAL_MODBUS_READ,
                                                .address = (uint16_t)address,
                                                .count = (uint16_t)count };

    return modbus_client(&session->line, &request);
}

static struct drive_value *info_add(struct drive_info *info, unsigned address,
                                    const char *name, int64_t number)
{
    struct drive_value *value = &info->value[info->count++];

    *value = (struct drive_value){ .is_number = true, .value = number };
    snprintf(value->number, sizeof value->number, "0x%04X", address);
    snprintf(value->name, sizeof value->name, "%s", name);
    return value;
}

static void info_identity(struct drive_info *info, const uint16_t *word)
{
    info_add(info, 0x0001, "version", word[1]);
    info_add(info, 0x0002, "board", word[2]);
    info_add(info, 0x0003, "axes", word[3]);
    snprintf(info_add(info, 0x0004, "tick", (int64_t)mcu_words_get(word + 4, 2))
                 ->unit,
             sizeof info->value->unit, "ns");
    info_add(info, 0x0006, "segments", (int64_t)mcu_words_get(word + 6, 2));
}

static void info_state(struct drive_info *info, const uint16_t *word)
{
    struct drive_value *value =
        info_add(info, MCU_AT_STATE, "state", word[MCU_STATE_STATE]);
    snprintf(
        value->text, sizeof value->text, "%s",
        controller_state_text((enum controller_state)word[MCU_STATE_STATE]));
    value = info_add(info, MCU_AT_STATE + MCU_STATE_FAULT, "fault",
                     word[MCU_STATE_FAULT]);
    snprintf(
        value->text, sizeof value->text, "%s",
        controller_fault_text((enum controller_fault)word[MCU_STATE_FAULT]));
    info_add(info, MCU_AT_STATE + MCU_STATE_LOST, "ticks_lost",
             (int64_t)mcu_words_get(word + MCU_STATE_LOST, 2));
    info_add(info, MCU_AT_STATE + MCU_STATE_WATCH, "watch_ms",
             word[MCU_STATE_WATCH]);
    info_add(info, MCU_AT_STATE + MCU_STATE_SILENT, "silent",
             word[MCU_STATE_SILENT]);
    info_add(info, MCU_AT_STATE + MCU_STATE_STACK, "stack_words_free",
             word[MCU_STATE_STACK]);
    if (word[MCU_STATE_STATE] == CONTROLLER_FAULT)
        snprintf(info->fault, sizeof info->fault, "%s", value->text);
}

/* In the axis's unit, 2^-32 of it. */
static void info_place(const struct session *session, struct drive_info *info,
                       unsigned address, const char *name, const uint16_t *word)
{
    struct drive_value *value =
        info_add(info, address, name, (int64_t)mcu_words_get(word, 4));

    snprintf(value->type, sizeof value->type, "q32");
    snprintf(value->text, sizeof value->text, "%.6f %s",
             (double)value->value / 4294967296.0,
             session->axis != NULL ? units_axis_text(session->axis->unit)
                                   : "units");
}

static void info_axis(const struct session *session, struct drive_info *info,
                      const uint16_t *word)
{
    const unsigned at =
        MCU_AT_AXIS + MCU_AXIS_STEP * (unsigned)session->node_axis;
    struct drive_value *value;

    info_place(session, info, at + MCU_AXIS_ACTUAL, "position",
               word + MCU_AXIS_ACTUAL);
    info_place(session, info, at + MCU_AXIS_TARGET, "set_point",
               word + MCU_AXIS_TARGET);
    value = info_add(info, at + MCU_AXIS_DRIVE, "drive", word[MCU_AXIS_DRIVE]);
    snprintf(value->text, sizeof value->text, "%s",
             hal_drive_state_text((enum hal_drive_state)word[MCU_AXIS_DRIVE]));
    value =
        info_add(info, at + MCU_AXIS_DRIVEN, "servo", word[MCU_AXIS_DRIVEN]);
    snprintf(value->text, sizeof value->text, "%s",
             word[MCU_AXIS_DRIVEN] != 0 ? "on the board's line" : "virtual");
}

static enum status slew_mcu_info(struct session *session,
                                 struct drive_info *info)
{
    const uint16_t *word = session->line.reply.value;

    if (info_read(session, 0, MCU_IDENTITY_WORDS) == MOTION_OK &&
        word[0] != MCU_MAP_MAGIC)
        return drive_complain("that unit is no board that runs slew");
    if (session->line.reply.err == MOTION_OK)
        info_identity(info, word);
    if (info_read(session, MCU_AT_STATE, MCU_STATE_WORDS) == MOTION_OK)
        info_state(info, word);
    if (info_read(session,
                  MCU_AT_AXIS + MCU_AXIS_STEP * (unsigned)session->node_axis,
                  MCU_AXIS_WORDS) == MOTION_OK)
        info_axis(session, info, word);
    if (session->line.reply.err < 0)
        return drive_failed(session, "", session->line.reply.err);
    info->ok = true;
    return STATUS_OK;
}

const struct verb_kind verb_kind_slew_mcu = {
    .find = slew_mcu_find,
    .read = slew_mcu_read,
    .parse = slew_mcu_parse,
    .write = slew_mcu_write,
    .is_writable = slew_mcu_is_writable,
    .store = slew_mcu_store,
    .info = slew_mcu_info,
};

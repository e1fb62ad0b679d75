/* firmware/linux/tools/reset.c - see reset.h. */
#include "firmware/linux/tools/reset.h"

#include <inttypes.h>
#include <stdio.h>

#include "hal/drive/cia402/drive.h"
#include "motion/core/err.h"

#define RESET_WAIT_NS INT64_C(1000000000)
#define RESET_STEP_NS INT64_C(10000000)
#define RESET_BIT     0x80 /* of 0x6040: its rising edge */

/* ---- CANopen ---- */

static int reset_state(struct talk *talk, enum cia402_state *state)
{
    uint32_t value = 0;
    const int err = ask_can_read_number(&talk->can, 0x6041, 0, &value, NULL);

    *state = cia402_state_of((uint16_t)value);
    return err;
}

static bool reset_is_fault(enum cia402_state state)
{
    return state == CIA402_FAULT || state == CIA402_FAULT_REACTION;
}

/* 0x603F, or where a drive has none the latest of 0x1003. */
static void reset_reason(struct talk *talk, struct reset *reset)
{
    uint32_t code = 0;

    if (ask_can_read_number(&talk->can, 0x603F, 0, &code, NULL) < 0 &&
        ask_can_read_number(&talk->can, 0x1003, 1, &code, NULL) < 0) {
        snprintf(reset->reason, sizeof reset->reason,
                 "it does not say why (neither 603F nor 1003)");
        return;
    }
    snprintf(reset->reason, sizeof reset->reason, "error 0x%04X: %s",
             (unsigned)(code & 0xFFFF), canopen_emcy_text((uint16_t)code));
}

/* The bit rises, and falls again, so that nothing is asked for afterwards. */
static int reset_pulse(struct talk *talk)
{
    static const uint16_t word[] = { 0, RESET_BIT };
    int err = MOTION_OK;

    for (unsigned i = 0; i < 2 && err == MOTION_OK; i++)
        err = ask_can_write_number(&talk->can, 0x6040, 0, 2, word[i]);
    return err;
}

static int reset_wait(struct talk *talk, enum cia402_state *state)
{
    int err = MOTION_OK;

    for (int64_t waited_ns = 0; waited_ns < RESET_WAIT_NS;
         waited_ns += RESET_STEP_NS) {
        err = reset_state(talk, state);
        if (err < 0 || !reset_is_fault(*state))
            break;
        ask_can_wait(&talk->can, RESET_STEP_NS);
    }
    return err;
}

static int reset_cia402(struct talk *talk, struct reset *reset)
{
    enum cia402_state state;
    int err = reset_state(talk, &state);

    if (err < 0)
        return err;
    reset->was_fault = reset_is_fault(state);
    if (reset->was_fault) {
        reset_reason(talk, reset);
        err = reset_pulse(talk);
        if (err == MOTION_OK)
            err = reset_wait(talk, &state);
        if (err == MOTION_OK)
            err = ask_can_write_number(&talk->can, 0x6040, 0, 2, 0);
    }
    reset->is_fault = reset_is_fault(state);
    snprintf(reset->state, sizeof reset->state, "%s", cia402_state_text(state));
    return err;
}

/* ---- Modbus ---- */

static void reset_alarm(struct talk *talk, struct reset *reset)
{
    const struct modbus_map *map = talk->map;
    const char *text;
    int64_t code = 0;

    if (map->alarm == MODBUS_MAP_NO_ITEM ||
        ask_modbus_read_item(&talk->line, &map->item[map->alarm], &code) < 0) {
        snprintf(reset->reason, sizeof reset->reason, "it does not say why");
        return;
    }
    text = modbus_map_alarm_text(map, (uint32_t)code);
    snprintf(reset->reason, sizeof reset->reason, "alarm 0x%" PRIX64 ": %s",
             code, text == NULL ? "the map does not know it" : text);
}

static int reset_modbus(struct talk *talk, struct reset *reset)
{
    int err = ask_modbus_status(&talk->line, talk->map, MODBUS_STATUS_fault,
                                &reset->was_fault);

    if (err < 0)
        return err;
    reset->is_fault = reset->was_fault;
    if (reset->was_fault) {
        reset_alarm(talk, reset);
        err =
            ask_modbus_sequence(&talk->line, talk->map, MODBUS_SEQUENCE_reset);
        if (err == MOTION_OK)
            err = ask_modbus_status(&talk->line, talk->map, MODBUS_STATUS_fault,
                                    &reset->is_fault);
    }
    snprintf(reset->state, sizeof reset->state, "%s",
             reset->is_fault ? "fault" : "no fault");
    return err;
}

/* ---- ODrive, moteus ---- */

/* Until the drive says that it has none, or the time is over. */
static int reset_wait_turns(struct talk *talk, struct ask_turns_state *state)
{
    int err = MOTION_OK;

    for (int64_t waited_ns = 0; waited_ns < RESET_WAIT_NS;
         waited_ns += RESET_STEP_NS) {
        err = ask_turns_state(&talk->turns, state);
        if (err < 0 || !state->is_fault)
            break;
        ask_turns_wait(&talk->turns, RESET_STEP_NS);
    }
    return err;
}

static int reset_turns(struct talk *talk, struct reset *reset)
{
    struct ask_turns_state state = { .is_fault = false };
    int err = ask_turns_hello(&talk->turns);

    if (err == MOTION_OK)
        err = ask_turns_state(&talk->turns, &state);
    if (err < 0)
        return err;
    reset->was_fault = state.is_fault;
    if (state.is_fault) {
        ask_turns_reason(&talk->turns, &state, reset->reason);
        err = ask_turns_clear(&talk->turns);
        if (err == MOTION_OK)
            err = reset_wait_turns(talk, &state);
    }
    reset->is_fault = state.is_fault;
    snprintf(reset->state, sizeof reset->state, "%s",
             ask_turns_state_text(&talk->turns, state.state));
    return err;
}

int reset_drive(struct talk *talk, struct reset *reset)
{
    *reset = (struct reset){ .was_fault = false };
    if (talk_is_turns(talk))
        return reset_turns(talk, reset);
    if (talk->kind == TALK_CANOPEN)
        return reset_cia402(talk, reset);
    return talk->map == NULL ? MOTION_E_EMPTY : reset_modbus(talk, reset);
}

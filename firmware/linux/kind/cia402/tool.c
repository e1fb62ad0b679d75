/* firmware/linux/kind/cia402/tool.c - a CiA 402 drive asked by the tools: see
 * firmware/linux/tools/kind.h. */
#include <stdio.h>

#include "firmware/linux/base/disk.h"
#include "firmware/linux/tools/kind.h"
#include "hal/drive/cia402/drive.h"
#include "motion/core/err.h"

#define RESET_WAIT_NS INT64_C(1000000000)
#define RESET_STEP_NS INT64_C(10000000)
#define RESET_BIT     0x80 /* of 0x6040: its rising edge */

/* ---- open ---- */

static int cia402_take(struct rig_bus *bus, char message[YAML_MESSAGE_MAX])
{
    (void)message;
    bus->kind = RIG_CANOPEN;
    return 0;
}

static int cia402_sheet(struct session *session,
                        const struct session_config *config,
                        char message[YAML_MESSAGE_MAX])
{
    const char *path = config->eds;

    if (path == NULL && session->axis != NULL && session->axis->eds[0] != '\0')
        path = session->axis->eds;
    if (path == NULL)
        return 0;
    eds_free(&session->sheet);
    if (eds_load(&disk_files, path, &session->sheet, message) < 0)
        return -1;
    session->eds = &session->sheet;
    return 0;
}

static int cia402_open(struct session *session,
                       const struct session_config *config,
                       char message[YAML_MESSAGE_MAX])
{
    canopen_client_init(&session->can, session->bench.ports.can[0],
                        session->bench.ports.clock, config->line.timeout_ns);
    (void)canopen_client_node(&session->can, session->node);
    if (!session->bench.is_real)
        canopen_client_wait(&session->can, BENCH_BOOT_NS);
    return cia402_sheet(session, config, message);
}

static int cia402_is_enabled(struct session *session)
{
    uint32_t value = 0;
    const int err =
        canopen_client_read_number(&session->can, 0x6041, 0, &value, NULL);

    if (err < 0)
        return err == MOTION_E_REFUSED ? MOTION_E_EMPTY : err;
    const enum cia402_state state = cia402_state_of((uint16_t)value);
    return state == CIA402_OPERATION_ENABLED ||
           state == CIA402_QUICK_STOP_ACTIVE || state == CIA402_FAULT_REACTION;
}

static void cia402_text(const struct session *session, int err,
                        char text[SESSION_TEXT_MAX])
{
    canopen_client_text(&session->can, err, text);
}

/* ---- reset ---- */

static int reset_state(struct session *session, enum cia402_state *state)
{
    uint32_t value = 0;
    const int err =
        canopen_client_read_number(&session->can, 0x6041, 0, &value, NULL);

    *state = cia402_state_of((uint16_t)value);
    return err;
}

static bool reset_is_fault(enum cia402_state state)
{
    return state == CIA402_FAULT || state == CIA402_FAULT_REACTION;
}

/* 0x603F, or where a drive has none the latest of 0x1003. */
static void reset_reason(struct session *session, struct reset *reset)
{
    uint32_t code = 0;

    if (canopen_client_read_number(&session->can, 0x603F, 0, &code, NULL) < 0 &&
        canopen_client_read_number(&session->can, 0x1003, 1, &code, NULL) < 0) {
        snprintf(reset->reason, sizeof reset->reason,
                 "it does not say why (neither 603F nor 1003)");
        return;
    }
    snprintf(reset->reason, sizeof reset->reason, "error 0x%04X: %s",
             (unsigned)(code & 0xFFFF), canopen_emcy_text((uint16_t)code));
}

/* The bit rises, and falls again, so that nothing is asked for afterwards. */
static int reset_pulse(struct session *session)
{
    static const uint16_t word[] = { 0, RESET_BIT };
    int err = MOTION_OK;

    for (unsigned i = 0; i < 2 && err == MOTION_OK; i++)
        err = canopen_client_write_number(&session->can, 0x6040, 0, 2, word[i]);
    return err;
}

static int reset_wait(struct session *session, enum cia402_state *state)
{
    int err = MOTION_OK;

    for (int64_t waited_ns = 0; waited_ns < RESET_WAIT_NS;
         waited_ns += RESET_STEP_NS) {
        err = reset_state(session, state);
        if (err < 0 || !reset_is_fault(*state))
            break;
        canopen_client_wait(&session->can, RESET_STEP_NS);
    }
    return err;
}

static int cia402_reset(struct session *session, struct reset *reset)
{
    enum cia402_state state;
    int err = reset_state(session, &state);

    if (err < 0)
        return err;
    reset->was_fault = reset_is_fault(state);
    if (reset->was_fault) {
        reset_reason(session, reset);
        err = reset_pulse(session);
        if (err == MOTION_OK)
            err = reset_wait(session, &state);
        if (err == MOTION_OK)
            err = canopen_client_write_number(&session->can, 0x6040, 0, 2, 0);
    }
    reset->is_fault = reset_is_fault(state);
    snprintf(reset->state, sizeof reset->state, "%s", cia402_state_text(state));
    return err;
}

const struct tool_kind tool_kind_cia402 = {
    .word = "canopen",
    .number = "node",
    .first = 1,
    .last = 127,
    .expected = "is no node, expected 1 .. 127",
    .take = cia402_take,
    .open = cia402_open,
    .is_enabled = cia402_is_enabled,
    .text = cia402_text,
    .reset = cia402_reset,
};

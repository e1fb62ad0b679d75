/* firmware/linux/kind/turn/tool.c - see tool.h. */
#include "firmware/linux/kind/turn/tool.h"

#include <stdio.h>

#include "firmware/host/device/endpoints.h"
#include "firmware/linux/base/disk.h"
#include "motion/core/err.h"

#define RESET_WAIT_NS INT64_C(1000000000)
#define RESET_STEP_NS INT64_C(10000000)

static int turn_endpoints(struct session *session,
                          const struct session_config *config,
                          char message[YAML_MESSAGE_MAX])
{
    const char *path = config->endpoints;

    if (path == NULL && session->axis != NULL &&
        session->axis->endpoints[0] != '\0')
        path = session->axis->endpoints;
    if (path == NULL)
        return 0;
    session->endpoints = endpoints_open(&disk_files, path);
    return session->endpoints != NULL
               ? 0
               : session_refuse(message, path,
                                "is no JSON file that can be read");
}

int turn_open(struct session *session, const struct session_config *config,
              const struct turn_client_family *family,
              char message[YAML_MESSAGE_MAX])
{
    const struct rig_bus *bus = &session->bench.rig.bus[0];

    turn_client_init(&session->turn, session->bench.ports.can[0],
                     session->bench.ports.clock, config->line.timeout_ns);
    session->turn.family = family;
    session->turn.node = session->node;
    session->turn.switched = bus->data_bit_rate > bus->bit_rate;
    if (!session->bench.is_real)
        turn_client_wait(&session->turn, BENCH_BOOT_NS);
    return turn_endpoints(session, config, message);
}

int turn_is_enabled(struct session *session)
{
    struct turn_client_state state;
    const int err = turn_client_state(&session->turn, &state);

    return err < 0 ? err : state.has_torque;
}

void turn_text(const struct session *session, int err,
               char text[SESSION_TEXT_MAX])
{
    turn_client_text(&session->turn, err, text);
}

/* ---- reset ---- */

/* Until the drive says that it has none, or the time is over. */
static int reset_wait_turns(struct session *session,
                            struct turn_client_state *state)
{
    int err = MOTION_OK;

    for (int64_t waited_ns = 0; waited_ns < RESET_WAIT_NS;
         waited_ns += RESET_STEP_NS) {
        err = turn_client_state(&session->turn, state);
        if (err < 0 || !state->is_fault)
            break;
        turn_client_wait(&session->turn, RESET_STEP_NS);
    }
    return err;
}

int turn_reset(struct session *session, struct reset *reset)
{
    struct turn_client_state state = { .is_fault = false };
    int err = turn_client_hello(&session->turn);

    if (err == MOTION_OK)
        err = turn_client_state(&session->turn, &state);
    if (err < 0)
        return err;
    reset->was_fault = state.is_fault;
    if (state.is_fault) {
        turn_client_reason(&session->turn, &state, reset->reason);
        err = turn_client_clear(&session->turn);
        if (err == MOTION_OK)
            err = reset_wait_turns(session, &state);
    }
    reset->is_fault = state.is_fault;
    snprintf(reset->state, sizeof reset->state, "%s",
             turn_client_state_text(&session->turn, state.state));
    return err;
}

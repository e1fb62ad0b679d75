/* firmware/linux/kind/turn/tool.c - see tool.h. */
#include "firmware/linux/kind/turn/tool.h"

#include <stdio.h>

#include "firmware/host/device/endpoints.h"
#include "firmware/linux/base/disk.h"
#include "motion/core/err.h"

#define RESET_WAIT_NS INT64_C(1000000000)
#define RESET_STEP_NS INT64_C(10000000)

static int turn_endpoints(struct talk *talk, const struct talk_config *config,
                          char message[YAML_MESSAGE_MAX])
{
    const char *path = config->endpoints;

    if (path == NULL && talk->axis != NULL && talk->axis->endpoints[0] != '\0')
        path = talk->axis->endpoints;
    if (path == NULL)
        return 0;
    talk->endpoints = endpoints_open(&disk_files, path);
    return talk->endpoints != NULL
               ? 0
               : talk_refuse(message, path, "is no JSON file that can be read");
}

int turn_open(struct talk *talk, const struct talk_config *config,
              const struct ask_turns_family *family,
              char message[YAML_MESSAGE_MAX])
{
    const struct rig_bus *bus = &talk->bench.rig.bus[0];

    ask_turns_init(&talk->turns, talk->bench.ports.can[0],
                   talk->bench.ports.clock, config->line.timeout_ns);
    talk->turns.family = family;
    talk->turns.node = talk->node;
    talk->turns.switched = bus->data_bit_rate > bus->bit_rate;
    if (!talk->bench.is_real)
        ask_turns_wait(&talk->turns, BENCH_BOOT_NS);
    return turn_endpoints(talk, config, message);
}

int turn_is_enabled(struct talk *talk)
{
    struct ask_turns_state state;
    const int err = ask_turns_state(&talk->turns, &state);

    return err < 0 ? err : state.has_torque;
}

void turn_text(const struct talk *talk, int err, char text[TALK_TEXT_MAX])
{
    ask_turns_text(&talk->turns, err, text);
}

/* ---- reset ---- */

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

int turn_reset(struct talk *talk, struct reset *reset)
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

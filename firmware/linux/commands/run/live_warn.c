/* firmware/linux/commands/run/live_warn.c - see live_warn.h. */
#include "firmware/linux/commands/run/live_warn.h"

#include "firmware/linux/base/error.h"
#include "firmware/linux/player/recorder.h"

#define LIVE_WARN_NS INT64_C(1000000000) /* of one drive or bus, once in */

void live_warn_init(struct live_warn *warn, const struct rig *rig,
                    const char *command)
{
    warn->command = command;
    warn->row = (struct telemetry_row){
        .phase = TELEMETRY_SETTLE,
        .axis = memory_pool_new(&warn->memory, rig->axis_count,
                                sizeof *warn->row.axis),
        .bus_warnings = memory_pool_new(&warn->memory, rig->bus_count,
                                        sizeof *warn->row.bus_warnings),
    };
    row_notes_init(&warn->notes, rig, LIVE_WARN_NS);
}

static void live_warn_say(void *context, const struct telemetry_row *row,
                          const char *text)
{
    const struct live_warn *warn = context;
    (void)row;
    if (!warn->draws)
        error_say("slew %s: warning: %s", warn->command, text);
}

void live_warn_step(struct live_warn *warn, const struct machine *machine,
                    int64_t now_ns)
{
    if (warn->command == NULL)
        return;
    recorder_look(&warn->row, machine);
    warn->row.t_ns = now_ns;
    row_notes_take(&warn->notes, &warn->row, live_warn_say, warn);
}

void live_warn_free(struct live_warn *warn)
{
    row_notes_free(&warn->notes);
    memory_pool_free(&warn->memory);
    warn->command = NULL;
}

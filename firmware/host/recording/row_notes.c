/* firmware/host/recording/row_notes.c - see row_notes.h. */
#include "firmware/host/recording/row_notes.h"

#include <stdio.h>

#include "firmware/host/recording/drive_events.h"

void row_notes_init(struct row_notes *notes, const struct rig *rig,
                    int64_t every_ns)
{
    notes->rig = rig;
    notes->every_ns = every_ns;
    notes->axis =
        memory_pool_new(&notes->memory, rig->axis_count, sizeof *notes->axis);
    notes->bus =
        memory_pool_new(&notes->memory, rig->bus_count, sizeof *notes->bus);
}

void row_notes_free(struct row_notes *notes)
{
    memory_pool_free(&notes->memory);
    *notes = (struct row_notes){ .begun = false };
}

static void row_notes_begin(struct row_notes *notes,
                            const struct telemetry_row *row)
{
    for (uint32_t i = 0; i < notes->rig->axis_count; i++)
        notes->axis[i] = (struct row_notes_axis){
            .warning = row->axis[i].warning.number,
            .drive = row->axis[i].events,
            .drive_ns = row->t_ns - notes->every_ns,
        };
    for (uint32_t i = 0; i < notes->rig->bus_count; i++)
        notes->bus[i] = (struct row_notes_bus){
            .warnings = row->bus_warnings[i],
            .ns = row->t_ns - notes->every_ns,
        };
    notes->guardian_lost = row->guardian_lost;
    notes->begun = true;
}

bool row_notes_warning(struct row_notes_axis *said,
                       const struct warning *newest)
{
    const bool is_new = newest->number != said->warning;
    said->warning = newest->number;
    return is_new;
}

bool row_notes_drive(struct row_notes_axis *said,
                     const struct hal_drive_events *now, int64_t now_ns,
                     int64_t every_ns, struct hal_drive_events *more)
{
    *more = drive_events_since(now, &said->drive);
    if (!drive_events_any(more) || now_ns - said->drive_ns < every_ns)
        return false;
    said->drive = *now;
    said->drive_ns = now_ns;
    return true;
}

bool row_notes_bus(struct row_notes_bus *said, uint32_t warnings,
                   int64_t now_ns, int64_t every_ns)
{
    if (warnings == said->warnings || now_ns - said->ns < every_ns)
        return false;
    said->warnings = warnings;
    said->ns = now_ns;
    return true;
}

bool row_notes_guardian(uint32_t *said, uint32_t lost)
{
    const bool is_new = lost != *said;
    *said = lost;
    return is_new;
}

const char *row_notes_guardian_text(bool is_gone)
{
    return is_gone ? "the guardian is gone: where slew is killed now, nothing "
                     "but the drives' own watchdogs stops them"
                   : "the guardian was killed or stopped: another has taken "
                     "its place";
}

void row_notes_take(struct row_notes *notes, const struct telemetry_row *row,
                    void (*say)(void *context, const struct telemetry_row *row,
                                const char *text),
                    void *context)
{
    char warning[WARNING_TEXT_MAX], drive[DRIVE_EVENTS_TEXT_MAX];
    char text[ROW_NOTES_TEXT_MAX];
    struct hal_drive_events more;
    if (!notes->begun)
        row_notes_begin(notes, row);
    for (uint32_t i = 0; i < notes->rig->axis_count; i++) {
        const struct telemetry_axis *axis = &row->axis[i];
        if (row_notes_warning(&notes->axis[i], &axis->warning)) {
            warning_text(&axis->warning, &notes->rig->axis[i], warning);
            say(context, row, warning);
        }
        if (row_notes_drive(&notes->axis[i], &axis->events, row->t_ns,
                            notes->every_ns, &more)) {
            drive_events_text(&more, drive);
            snprintf(text, sizeof text, "%s: %s", notes->rig->axis[i].name,
                     drive);
            say(context, row, text);
        }
    }
    for (uint32_t i = 0; i < notes->rig->bus_count; i++)
        if (row_notes_bus(&notes->bus[i], row->bus_warnings[i], row->t_ns,
                          notes->every_ns)) {
            snprintf(text, sizeof text, "bus %s: error-warning",
                     notes->rig->bus[i].name);
            say(context, row, text);
        }
    if (row_notes_guardian(&notes->guardian_lost, row->guardian_lost))
        say(context, row, row_notes_guardian_text(row->guardian_gone));
}

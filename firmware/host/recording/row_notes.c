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
    notes->begun = true;
}

/* True, with a text: it begins. */
static bool row_notes_warning(struct row_notes *notes,
                              const struct telemetry_row *row, uint32_t i,
                              char text[ROW_NOTES_TEXT_MAX])
{
    const struct warning *newest = &row->axis[i].warning;
    char words[WARNING_TEXT_MAX];
    if (newest->number == notes->axis[i].warning)
        return false;
    notes->axis[i].warning = newest->number;
    warning_text(newest, &notes->rig->axis[i], words);
    snprintf(text, ROW_NOTES_TEXT_MAX, "%s", words);
    return true;
}

static bool row_notes_drive(struct row_notes *notes,
                            const struct telemetry_row *row, uint32_t i,
                            char text[ROW_NOTES_TEXT_MAX])
{
    struct row_notes_axis *said = &notes->axis[i];
    const struct hal_drive_events more =
        drive_events_since(&row->axis[i].events, &said->drive);
    char words[DRIVE_EVENTS_TEXT_MAX];
    if (!drive_events_any(&more) ||
        row->t_ns - said->drive_ns < notes->every_ns)
        return false;
    said->drive = row->axis[i].events;
    said->drive_ns = row->t_ns;
    drive_events_text(&more, words);
    snprintf(text, ROW_NOTES_TEXT_MAX, "%s: %s", notes->rig->axis[i].name,
             words);
    return true;
}

static bool row_notes_bus(struct row_notes *notes,
                          const struct telemetry_row *row, uint32_t i,
                          char text[ROW_NOTES_TEXT_MAX])
{
    struct row_notes_bus *said = &notes->bus[i];
    if (row->bus_warnings[i] == said->warnings ||
        row->t_ns - said->ns < notes->every_ns)
        return false;
    said->warnings = row->bus_warnings[i];
    said->ns = row->t_ns;
    snprintf(text, ROW_NOTES_TEXT_MAX, "bus %s: error-warning",
             notes->rig->bus[i].name);
    return true;
}

void row_notes_take(struct row_notes *notes, const struct telemetry_row *row,
                    void (*say)(void *context, const struct telemetry_row *row,
                                const char *text),
                    void *context)
{
    char text[ROW_NOTES_TEXT_MAX];
    if (!notes->begun)
        row_notes_begin(notes, row);
    for (uint32_t i = 0; i < notes->rig->axis_count; i++) {
        if (row_notes_warning(notes, row, i, text))
            say(context, row, text);
        if (row_notes_drive(notes, row, i, text))
            say(context, row, text);
    }
    for (uint32_t i = 0; i < notes->rig->bus_count; i++)
        if (row_notes_bus(notes, row, i, text))
            say(context, row, text);
}

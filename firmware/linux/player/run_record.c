/* firmware/linux/player/run_record.c - see run_record.h. */
#include "firmware/linux/player/run_record.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/library/version.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/machine/machine_fault.h"
#include "firmware/linux/player/run_start.h"

int run_record_open(struct run_record *self, const char *path)
{
    return output_open_new(&self->output, path);
}

void run_record_free(struct run_record *self)
{
    if (self->begun)
        record_free(&self->record);
    self->begun = false;
    output_abandon(&self->output);
}

/* What was read a moment ago; one that cannot be read any more is left out. */
static bool run_record_attach(struct run_record *self, const char *path)
{
    char *data;
    const int64_t length =
        files_load(&disk_files, path, RUN_RECORD_ATTACH_MAX, &data);
    if (length < 0)
        return false;
    record_attach(&self->record, path, data, (size_t)length);
    free(data);
    return true;
}

static int64_t run_record_epoch_ns(struct hal_clock *clock, int64_t start_ns)
{
    return clock == NULL ? 0 : run_start_offset_ns(clock) + start_ns;
}

void run_record_begin(struct run_record *self, const struct job *job,
                      const struct report *report, struct hal_clock *clock,
                      int64_t start_ns)
{
    const int64_t epoch_ns = run_record_epoch_ns(clock, start_ns);
    char epoch[24], period[24];
    record_init(&self->record, self->output.file, &job->rig, epoch_ns,
                "slew " SLEW_VERSION);
    self->begun = true;
    self->report = report;
    const bool has_rig = run_record_attach(self, job->rig_path);
    const bool has_move = run_record_attach(self, job->move_path);
    snprintf(epoch, sizeof epoch, "%" PRId64, epoch_ns);
    snprintf(period, sizeof period, "%" PRId64, job->rig.period_ns);
    const char *const pair[][2] = {
        { "title", job->move.title },
        { "rig_title", job->rig.title },
        { "rig", has_rig ? job->rig_path : "" },
        { "move", has_move ? job->move_path : "" },
        { "epoch_ns", epoch },
        { "period_ns", period },
    };
    record_plan(&self->record, pair, sizeof pair / sizeof pair[0]);
}

static void run_record_faults(struct run_record *self,
                              const struct telemetry_row *row)
{
    const struct machine_fault *faults = self->report->faults;
    const uint64_t changed = row->faults ^ self->faults;
    char entry[FAULT_TEXT_MAX], text[FAULT_TEXT_MAX + 32];
    self->faults = row->faults;
    if (changed == 0)
        return;
    for (unsigned i = 0; i < faults->script->count; i++) {
        if ((changed >> i & 1) == 0)
            continue;
        fault_entry_text(&faults->script->entry[i], &self->report->job->rig,
                         entry);
        snprintf(text, sizeof text, "fault script, %s: %s",
                 (row->faults >> i & 1) != 0 ? "begins" : "is over", entry);
        record_note(&self->record, row->t_ns, RECORD_WARNING, text);
    }
}

/* The time is that at which it was seen, however late its drive has said why. */
static void run_record_fault(struct run_record *self)
{
    char text[REPORT_FAULT_MAX];
    report_fault_text(self->report, text);
    if (!self->fault_noted && text[0] != 0)
        record_note(&self->record, self->report->fault_ns, RECORD_ERROR, text);
    self->fault_noted = true;
}

void run_record_take(struct run_record *self, const struct telemetry_row *row)
{
    record_write(&self->record, row);
    run_record_faults(self, row);
    if (row->is_told && !self->fault_noted)
        run_record_fault(self);
}

int run_record_end(struct run_record *self)
{
    const struct report *report = self->report;
    char fault[REPORT_FAULT_MAX], number[5][24];
    const int64_t value[5] = { (int64_t)report->ticks,
                               (int64_t)report->ticks_lost,
                               (int64_t)report->rows_dropped, report->late_ns,
                               report->realtime };
    for (int i = 0; i < 5; i++)
        snprintf(number[i], sizeof number[i], "%" PRId64, value[i]);
    run_record_fault(self);
    report_fault_text(report, fault);
    const char *const pair[][2] = {
        { "end", report_end_text(report->end) },
        { "ticks", number[0] },
        { "ticks_lost", number[1] },
        { "rows_lost", number[2] },
        { "late_ns", number[3] },
        { "realtime", number[4] },
        { "fault", report->end == REPORT_FAULT ? fault : "" },
        { "reason", report->fault_text },
    };
    (void)record_end(&self->record, pair, sizeof pair / sizeof pair[0]);
    return output_commit(&self->output);
}

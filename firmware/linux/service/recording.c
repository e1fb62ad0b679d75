/* firmware/linux/service/recording.c - see recording.h. */
#include "firmware/linux/service/recording.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "firmware/host/base/array.h"
#include "firmware/library/version.h"
#include "firmware/linux/base/interrupt.h"
#include "firmware/linux/player/run_start.h"
#include "motion/core/err.h"

#define RECORDING_LOOK_NS 20000000 /* between two looks of the thread */
#define RECORDING_MOVE    "move.yaml"
#define RECORDING_STACK   524288

void service_recording_init(struct service_recording *self,
                            const char *directory, const struct rig *rig,
                            struct hal_clock *clock)
{
    self->directory = directory;
    self->rig = rig;
    self->clock = clock;
    (void)pthread_mutex_init(&self->lock, NULL);
    if (directory == NULL)
        return;
    recorder_init(&self->recorder, rig);
    self->row = (struct telemetry_row){
        .axis = memory_pool_new(&self->memory, rig->axis_count,
                                sizeof *self->row.axis),
        .bus_warnings = memory_pool_new(&self->memory, rig->bus_count,
                                        sizeof *self->row.bus_warnings),
        .shot = memory_pool_new(&self->memory, rig_trigger_count(rig),
                                sizeof *self->row.shot),
        .shot_count = (unsigned)rig_trigger_count(rig),
    };
}

void service_recording_free(struct service_recording *self)
{
    if (self->rig == NULL)
        return;
    (void)service_recording_stop(self);
    if (self->turn == SERVICE_RECORDING_ENDING ||
        self->turn == SERVICE_RECORDING_ENDED)
        (void)pthread_join(self->thread, NULL);
    self->turn = SERVICE_RECORDING_OFF;
    recorder_free(&self->recorder);
    memory_pool_free(&self->memory);
    (void)pthread_mutex_destroy(&self->lock);
}

/* --- the tick's --- */

static enum telemetry_phase recording_phase(const struct machine *machine)
{
    const struct controller *controller = &machine->controller;
    if (controller->enabling)
        return TELEMETRY_ENABLE;
    if (homing_is_running(&machine->homing))
        return TELEMETRY_HOME;
    if (controller->state == CONTROLLER_STOPPING)
        return TELEMETRY_STOP;
    if (machine->playback.state == PLAYBACK_GOING)
        return TELEMETRY_APPROACH;
    return controller->state == CONTROLLER_MOVING ||
                   controller->state == CONTROLLER_HOLDING
               ? TELEMETRY_MOVE
               : TELEMETRY_SETTLE;
}

void service_recording_tick(struct service_recording *self,
                            const struct machine *machine, int64_t now_ns,
                            int64_t late_ns)
{
    struct telemetry_row *row = &self->row;
    if (self->turn != SERVICE_RECORDING_ON || now_ns < self->start_ns)
        return;
    row->t_ns = now_ns - self->start_ns;
    row->late_ns = late_ns;
    row->phase = recording_phase(machine);
    recorder_look(row, machine);
    recorder_look_shots(row, machine, self->start_ns);
    (void)recorder_put(&self->recorder, row);
}

/* --- the thread's --- */

static void recording_take(void *context, struct telemetry_row *row)
{
    struct service_recording *self = context;
    row->number -= self->first;
    if (self->is_mcap)
        record_write(&self->record, row);
    else
        telemetry_write(&self->telemetry, row);
    self->rows++;
}

static void recording_drain(struct service_recording *self)
{
    (void)pthread_mutex_lock(&self->lock);
    recorder_drain(&self->recorder, recording_take, self);
    (void)pthread_mutex_unlock(&self->lock);
}

static void recording_end_record(struct service_recording *self)
{
    char rows[24], lost[24];
    snprintf(rows, sizeof rows, "%" PRIu64, (uint64_t)self->rows);
    snprintf(lost, sizeof lost, "%" PRIu64, self->recorder.dropped);
    const char *const pair[][2] = {
        { "end", "done" },
        { "ticks", rows },
        { "rows_lost", lost },
    };
    self->failed = !record_end(&self->record, pair, ARRAY_LEN(pair));
    self->rows_lost += self->record.rows_lost;
    record_free(&self->record);
}

static void recording_end(struct service_recording *self)
{
    self->rows_lost = self->recorder.dropped;
    if (self->is_mcap) {
        recording_end_record(self);
    } else {
        rows_end(&self->telemetry.rows);
        self->rows_lost += self->telemetry.rows.rows_lost;
    }
    self->failed |= output_commit(&self->output) < 0;
}

static void *recording_main(void *context)
{
    struct service_recording *self = context;
    interrupt_mask(NULL);
    while (self->turn == SERVICE_RECORDING_ON) {
        nanosleep(&(struct timespec){ .tv_nsec = RECORDING_LOOK_NS }, NULL);
        recording_drain(self);
    }
    /* a tick that was putting a row has done so by then */
    nanosleep(&(struct timespec){ .tv_nsec = RECORDING_LOOK_NS }, NULL);
    recording_drain(self);
    (void)pthread_mutex_lock(&self->lock);
    recording_end(self);
    self->turn = SERVICE_RECORDING_ENDED;
    (void)pthread_mutex_unlock(&self->lock);
    return NULL;
}

/* --- whoever asks --- */

static bool recording_ends_with(const char *name, const char *end)
{
    const size_t length = strlen(name), tail = strlen(end);
    return length > tail && strcmp(name + length - tail, end) == 0;
}

static bool recording_is_name(const char *name)
{
    return strlen(name) < SERVICE_RECORDING_NAME_MAX && name[0] != '.' &&
           strchr(name, '/') == NULL &&
           (recording_ends_with(name, ".mcap") ||
            recording_ends_with(name, ".csv"));
}

void service_recording_name(char name[SERVICE_RECORDING_NAME_MAX])
{
    const time_t now = time(NULL);
    struct tm utc;
    (void)gmtime_r(&now, &utc);
    (void)strftime(name, SERVICE_RECORDING_NAME_MAX, "rig-%Y%m%dT%H%M%SZ.mcap",
                   &utc);
}

static void recording_begin_record(struct service_recording *self,
                                   const struct service_recording_about *about)
{
    const int64_t epoch_ns = run_start_offset_ns(self->clock) + self->start_ns;
    char epoch[24], period[24];
    record_init(&self->record, self->output.file, self->rig, epoch_ns,
                "slew " SLEW_VERSION);
    record_attach(&self->record, about->rig_path, about->rig_text,
                  about->rig_length);
    if (about->move_text != NULL)
        record_attach(&self->record, RECORDING_MOVE, about->move_text,
                      strlen(about->move_text));
    snprintf(epoch, sizeof epoch, "%" PRId64, epoch_ns);
    snprintf(period, sizeof period, "%" PRId64, self->rig->period_ns);
    const char *const pair[][2] = {
        { "title", about->move_text != NULL ? about->move_title : "" },
        { "rig_title", self->rig->title },
        { "rig", about->rig_path },
        { "move", about->move_text != NULL ? RECORDING_MOVE : "" },
        { "epoch_ns", epoch },
        { "period_ns", period },
    };
    record_plan(&self->record, pair, ARRAY_LEN(pair));
}

static int recording_fail(struct service_recording *self, int err,
                          const char *why,
                          char text[SERVICE_RECORDING_TEXT_MAX])
{
    snprintf(text, SERVICE_RECORDING_TEXT_MAX, "%s: %s", self->name, why);
    return err;
}

static int recording_open(struct service_recording *self,
                          char text[SERVICE_RECORDING_TEXT_MAX])
{
    char path[OUTPUT_PATH_MAX];
    if (snprintf(path, sizeof path, "%s/%s", self->directory, self->name) >=
        (int)sizeof path)
        return recording_fail(self, MOTION_E_ARG, "too long a path", text);
    if (access(path, F_OK) == 0)
        return recording_fail(self, MOTION_E_ARG,
                              "is there already, and a recording is never "
                              "replaced, expected another name",
                              text);
    if (output_open_new(&self->output, path) < 0)
        return recording_fail(self, MOTION_E_IO,
                              "cannot be created in the directory of the "
                              "service's recordings",
                              text);
    return MOTION_OK;
}

int service_recording_start(struct service_recording *self, const char *name,
                            const struct service_recording_about *about,
                            char text[SERVICE_RECORDING_TEXT_MAX])
{
    int err;
    text[0] = '\0';
    if (self->directory == NULL) {
        snprintf(text, SERVICE_RECORDING_TEXT_MAX,
                 "the service has no directory for recordings, expected one "
                 "that was started with --recordings");
        return MOTION_E_STATE;
    }
    if (self->turn != SERVICE_RECORDING_OFF)
        return recording_fail(self, MOTION_E_STATE, "is being recorded", text);
    if (!recording_is_name(name)) {
        snprintf(text, SERVICE_RECORDING_TEXT_MAX,
                 "\"file\": expected a name without a directory that ends in "
                 ".mcap or .csv");
        return MOTION_E_ARG;
    }
    memcpy(self->name, name, strlen(name) + 1);
    err = recording_open(self, text);
    if (err < 0)
        return err;
    self->is_mcap = recording_ends_with(name, ".mcap");
    self->recorder.dropped = 0;
    self->first = (uint32_t)atomic_load(&self->recorder.put);
    self->rows = self->rows_lost = 0;
    self->failed = false;
    self->start_ns = hal_clock_now_ns(self->clock);
    if (self->is_mcap)
        recording_begin_record(self, about);
    else
        telemetry_init(&self->telemetry, self->output.file, self->rig, false);
    self->turn = SERVICE_RECORDING_ON;
    pthread_attr_t attributes; /* its memory is locked: no more than it needs */
    err = pthread_attr_init(&attributes);
    if (err == 0) {
        (void)pthread_attr_setstacksize(&attributes, RECORDING_STACK);
        err = pthread_create(&self->thread, &attributes, recording_main, self);
        (void)pthread_attr_destroy(&attributes);
    }
    if (err == 0)
        return MOTION_OK;
    self->turn = SERVICE_RECORDING_OFF;
    if (self->is_mcap)
        record_free(&self->record);
    output_abandon(&self->output);
    return recording_fail(self, MOTION_E_IO, strerror(err), text);
}

int service_recording_stop(struct service_recording *self)
{
    if (self->turn != SERVICE_RECORDING_ON)
        return MOTION_E_STATE;
    self->turn = SERVICE_RECORDING_ENDING;
    return MOTION_OK;
}

bool service_recording_ended(struct service_recording *self)
{
    if (self->turn != SERVICE_RECORDING_ENDED)
        return false;
    (void)pthread_join(self->thread, NULL);
    self->turn = SERVICE_RECORDING_OFF;
    return true;
}

void service_recording_note(struct service_recording *self, int64_t now_ns,
                            enum record_level level, const char *words)
{
    if (self->turn != SERVICE_RECORDING_ON)
        return;
    (void)pthread_mutex_lock(&self->lock);
    if (self->is_mcap && self->turn != SERVICE_RECORDING_ENDED)
        record_note(&self->record, now_ns - self->start_ns, level, words);
    (void)pthread_mutex_unlock(&self->lock);
}

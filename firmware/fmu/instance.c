/* firmware/fmu/instance.c - see instance.h. */
#include "firmware/fmu/instance.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"

/* The environment's process cannot go on without memory. */
void memory_fail(void)
{
    fputs("slew: memory has run out\n", stderr);
    abort();
}

enum fmu_status fmu_fail(struct fmu *self, const char *text)
{
    self->log(self, FMU_ERROR, text);
    return FMU_ERROR;
}

static int fmu_load(struct fmu *self)
{
    if (fmu_model_init(&self->model, &self->files.files,
                       fmu_files_rig(&self->files)) == 0)
        return 0;
    (void)fmu_fail(self, self->model.message);
    return -1;
}

static int fmu_open(struct fmu *self, const char *resources, const char *token)
{
    if (resources == NULL || fmu_files_open(&self->files, resources) < 0) {
        (void)fmu_fail(self, "the unit's resources cannot be read");
        return -1;
    }
    if (token == NULL || strcmp(fmu_files_token(&self->files), token) != 0) {
        (void)fmu_fail(self, "the token is not that of the unit's description");
        return -1;
    }
    return fmu_load(self);
}

struct fmu *fmu_new(const struct fmu *like, const char *name,
                    const char *resources, const char *token)
{
    struct fmu *const self = memory_new(1, sizeof *self);
    const size_t size = name != NULL ? strlen(name) + 1 : 1;

    *self = *like;
    self->name = memory_new(size, 1);
    if (name != NULL)
        memcpy(self->name, name, size);
    if (fmu_open(self, resources, token) == 0)
        return self;
    fmu_free(self);
    return NULL;
}

void fmu_free(struct fmu *self)
{
    if (self == NULL)
        return;
    fmu_model_free(&self->model);
    fmu_state_map_free(&self->map);
    fmu_files_free(&self->files);
    memory_free(self->name);
    memory_free(self);
}

/* --- its states --- */

enum fmu_status fmu_enter(struct fmu *self, double start_s)
{
    if (self->state != FMU_INSTANTIATED)
        return fmu_fail(self, "is initialized only once: reset it first");
    if (!(fabs(start_s) <= 1e9))
        return fmu_fail(self, "the start time is out of range");
    self->start_s = start_s;
    self->state = FMU_INITIALIZING;
    return FMU_OK;
}

enum fmu_status fmu_exit(struct fmu *self)
{
    if (self->state != FMU_INITIALIZING)
        return fmu_fail(self, "is not being initialized");
    if (fmu_model_start(&self->model) < 0)
        return fmu_fail(self, self->model.message);
    self->state = FMU_STEPPING;
    return FMU_OK;
}

enum fmu_status fmu_terminate(struct fmu *self)
{
    if (self->state != FMU_STEPPING)
        return fmu_fail(self, "there is nothing to terminate");
    self->state = FMU_ENDED;
    return FMU_OK;
}

enum fmu_status fmu_reset(struct fmu *self)
{
    fmu_model_free(&self->model);
    self->state = FMU_INSTANTIATED;
    self->warned = false;
    return fmu_load(self) < 0 ? FMU_ERROR : FMU_OK;
}

/* --- time --- */

/* The environment's time is a double; the model's is in whole ns. */
static int64_t fmu_ns(const struct fmu *self, double time_s)
{
    const double ns = 1e9 * (time_s - self->start_s);
    return fabs(ns) < 0x1p62 ? (int64_t)llrint(ns) : -1;
}

double fmu_time_s(const struct fmu *self)
{
    return self->start_s + 1e-9 * (double)self->model.now_ns;
}

/* A set point that a drive cannot take is left out, said once. */
static enum fmu_status fmu_judge(struct fmu *self)
{
    char text[160];
    for (unsigned i = 0; i < self->model.rig.axis_count; i++) {
        if (!self->model.axis[i].out_of_range)
            continue;
        snprintf(text, sizeof text,
                 "axis %s: demand.position is out of the drive's range",
                 self->model.rig.axis[i].name);
        if (!self->warned)
            self->log(self, FMU_WARNING, text);
        self->warned = true;
        return FMU_WARNING;
    }
    return FMU_OK;
}

enum fmu_status fmu_step(struct fmu *self, double time_s, double step_s)
{
    const int64_t from_ns = fmu_ns(self, time_s);
    const int64_t until_ns = fmu_ns(self, time_s + step_s);

    if (self->state != FMU_STEPPING)
        return fmu_fail(self, "a step is done between initialization and end");
    if (!(step_s > 0) || until_ns < from_ns)
        return fmu_fail(self, "a step has a length above 0");
    if (llabs(from_ns - self->model.now_ns) > 1)
        return fmu_fail(self, "a step begins where the one before has ended");
    fmu_model_step(&self->model, until_ns);
    return fmu_judge(self);
}

/* --- values --- */

enum fmu_status fmu_get(struct fmu *self, uint32_t reference, bool is_boolean,
                        double *value)
{
    if (reference == FMU_TIME && !is_boolean) {
        *value = fmu_time_s(self);
        return FMU_OK;
    }
    return fmu_model_get(&self->model, reference, is_boolean, value) == 0
               ? FMU_OK
               : fmu_fail(self, self->model.message);
}

enum fmu_status fmu_set(struct fmu *self, uint32_t reference, bool is_boolean,
                        double value)
{
    return fmu_model_set(&self->model, reference, is_boolean, value) == 0
               ? FMU_OK
               : fmu_fail(self, self->model.message);
}

/* firmware/fmu/fmi2.c - the functions of FMI 2.0 for co-simulation.
 *
 * Names and types are the standard's.  Source: FMI 2.0.4, 2.1 and 4.2. */
#include <stddef.h>
#include <string.h>

#include "firmware/fmu/instance.h"
#include "firmware/host/base/memory.h"

typedef void *fmi2Component;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const fmi2Char *fmi2String;
typedef char fmi2Byte;
typedef enum fmu_status fmi2Status;

struct fmi2_callbacks {
    void (*logger)(void *environment, fmi2String instance, fmi2Status status,
                   fmi2String category, fmi2String message, ...);
    void *(*allocate)(size_t count, size_t size);
    void (*free)(void *block);
    void (*step_finished)(void *environment, fmi2Status status);
    void *environment;
};

#define FMI2_CO_SIMULATION 1 /* of fmi2Type */
#define EXPORT             __attribute__((visibility("default")))

static void fmi2_log(struct fmu *self, enum fmu_status status, const char *text)
{
    const struct fmi2_callbacks *const callbacks = self->logger;
    if (callbacks->logger != NULL)
        callbacks->logger(callbacks->environment, self->name, status,
                          "logStatusError", "%s", text);
}

EXPORT const char *fmi2GetTypesPlatform(void)
{
    return "default";
}

EXPORT const char *fmi2GetVersion(void)
{
    return "2.0";
}

EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on,
                                      size_t count,
                                      const fmi2String categories[])
{
    (void)c, (void)on, (void)count, (void)categories;
    return FMU_OK;
}

/* Two hexadecimal digits; -1: they are none. */
static int fmi2_byte(const char *text)
{
    static const char digits[] = "0123456789abcdef0123456789ABCDEF";
    int byte = 0;
    for (unsigned i = 0; i < 2; i++) {
        const char *const at = text[i] != '\0' ? strchr(digits, text[i]) : NULL;
        if (at == NULL)
            return -1;
        byte = 16 * byte + (int)((at - digits) % 16);
    }
    return byte;
}

/* "file:///a%20b" as a path; -1: it is no such address. */
static int fmi2_path(const char *uri, char path[FILES_PATH_MAX])
{
    size_t length = 0;

    if (uri == NULL || strncmp(uri, "file:", 5) != 0)
        return -1;
    uri += 5;
    if (strncmp(uri, "//", 2) == 0)
        uri += strcspn(uri + 2, "/") + 2; /* this machine, whatever its name */
    while (*uri != '\0' && length + 1 < FILES_PATH_MAX) {
        const int byte = *uri == '%' ? fmi2_byte(uri + 1) : -1;
        path[length++] = byte > 0 ? (char)byte : *uri;
        uri += byte > 0 ? 3 : 1;
    }
    path[length] = '\0';
    return *uri == '\0' ? 0 : -1;
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, int type, fmi2String guid,
                                     fmi2String resources,
                                     const struct fmi2_callbacks *callbacks,
                                     fmi2Boolean visible, fmi2Boolean logging)
{
    struct fmu like = { .log = fmi2_log };
    char path[FILES_PATH_MAX];

    (void)visible, (void)logging;
    if (type != FMI2_CO_SIMULATION || callbacks == NULL)
        return NULL;
    /* It belongs to the environment and stays: FMI 2.0.4, 2.1.5. */
    like.logger = (void *)callbacks;
    return fmu_new(&like, name, fmi2_path(resources, path) == 0 ? path : NULL,
                   guid);
}

EXPORT void fmi2FreeInstance(fmi2Component c)
{
    fmu_free(c);
}

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c,
                                      fmi2Boolean tolerance_defined,
                                      fmi2Real tolerance, fmi2Real start,
                                      fmi2Boolean stop_defined, fmi2Real stop)
{
    struct fmu *const self = c;
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    if (self->state != FMU_INSTANTIATED)
        return fmu_fail(self, "is set up before it is initialized");
    self->start_s = start;
    return FMU_OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    struct fmu *const self = c;
    return fmu_enter(self, self->start_s);
}

EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    return fmu_exit(c);
}

EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    return fmu_terminate(c);
}

EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    return fmu_reset(c);
}

/* --- values --- */

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference of[],
                              size_t count, fmi2Real value[])
{
    fmi2Status status = FMU_OK;
    for (size_t i = 0; i < count && status == FMU_OK; i++)
        status = fmu_get(c, of[i], false, &value[i]);
    return status;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference of[],
                              size_t count, const fmi2Real value[])
{
    fmi2Status status = FMU_OK;
    for (size_t i = 0; i < count && status == FMU_OK; i++)
        status = fmu_set(c, of[i], false, value[i]);
    return status;
}

EXPORT fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference of[],
                                 size_t count, fmi2Boolean value[])
{
    fmi2Status status = FMU_OK;
    double got = 0;
    for (size_t i = 0; i < count && status == FMU_OK; i++) {
        status = fmu_get(c, of[i], true, &got);
        value[i] = got != 0;
    }
    return status;
}

EXPORT fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference of[],
                                 size_t count, const fmi2Boolean value[])
{
    fmi2Status status = FMU_OK;
    for (size_t i = 0; i < count && status == FMU_OK; i++)
        status = fmu_set(c, of[i], true, value[i] != 0);
    return status;
}

/* --- steps --- */

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step,
                             fmi2Boolean no_state_before)
{
    (void)no_state_before;
    return fmu_step(c, time, step);
}

EXPORT fmi2Status fmi2CancelStep(fmi2Component c)
{
    return fmu_fail(c, "a step is over when fmi2DoStep returns");
}

EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, int kind, fmi2Real *value)
{
    if (kind != 2) /* fmi2LastSuccessfulTime */
        return FMU_DISCARD;
    *value = fmu_time_s(c);
    return FMU_OK;
}

EXPORT fmi2Status fmi2GetStatus(fmi2Component c, int kind, fmi2Status *value)
{
    (void)c, (void)kind, (void)value;
    return FMU_DISCARD;
}

EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, int kind,
                                       fmi2Integer *value)
{
    (void)c, (void)kind, (void)value;
    return FMU_DISCARD;
}

EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, int kind,
                                       fmi2Boolean *value)
{
    if (kind != 3) /* fmi2Terminated */
        return FMU_DISCARD;
    (void)c;
    *value = 0;
    return FMU_OK;
}

EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, int kind,
                                      fmi2String *value)
{
    (void)c, (void)kind, (void)value;
    return FMU_DISCARD;
}

/* --- states --- */

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, void **state)
{
    struct fmu_kept *kept = *state;
    const fmi2Status status = fmu_keep(c, &kept);
    *state = kept;
    return status;
}

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, void *state)
{
    return fmu_restore(c, state);
}

EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, void **state)
{
    (void)c;
    memory_free(*state);
    *state = NULL;
    return FMU_OK;
}

EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, void *state,
                                             size_t *size)
{
    return fmu_kept_size(c, state, size);
}

EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, void *state,
                                        fmi2Byte bytes[], size_t size)
{
    return fmu_kept_write(c, state, bytes, size);
}

EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c,
                                          const fmi2Byte bytes[], size_t size,
                                          void **state)
{
    struct fmu_kept *kept = NULL;
    const fmi2Status status = fmu_kept_read(c, bytes, size, &kept);
    *state = kept;
    return status;
}

/* --- what the description says that it has not --- */

static fmi2Status fmi2_none(fmi2Component c, size_t count)
{
    return count == 0 ? FMU_OK : fmu_fail(c, "the unit has no such variables");
}

EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference of[],
                                 size_t count, fmi2Integer value[])
{
    (void)of, (void)value;
    return fmi2_none(c, count);
}

EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference of[],
                                 size_t count, const fmi2Integer value[])
{
    (void)of, (void)value;
    return fmi2_none(c, count);
}

EXPORT fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference of[],
                                size_t count, fmi2String value[])
{
    (void)of, (void)value;
    return fmi2_none(c, count);
}

EXPORT fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference of[],
                                size_t count, const fmi2String value[])
{
    (void)of, (void)value;
    return fmi2_none(c, count);
}

EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c,
                                              const fmi2ValueReference of[],
                                              size_t count,
                                              const fmi2Integer order[],
                                              const fmi2Real value[])
{
    (void)of, (void)order, (void)value;
    return fmi2_none(c, count);
}

EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c,
                                               const fmi2ValueReference of[],
                                               size_t count,
                                               const fmi2Integer order[],
                                               fmi2Real value[])
{
    (void)of, (void)order, (void)value;
    return fmi2_none(c, count);
}

EXPORT fmi2Status fmi2GetDirectionalDerivative(
    fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns,
    const fmi2ValueReference known[], size_t knowns, const fmi2Real along[],
    fmi2Real change[])
{
    (void)unknown, (void)known, (void)knowns, (void)along, (void)change;
    return fmi2_none(c, unknowns);
}

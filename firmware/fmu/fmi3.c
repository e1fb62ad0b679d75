/* firmware/fmu/fmi3.c - the functions of FMI 3.0 for co-simulation.
 *
 * Names and types are the standard's.  Source: FMI 3.0.1, 2.2 and 4.2. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/fmu/instance.h"
#include "firmware/host/base/memory.h"

typedef void *fmi3Instance;
typedef uint32_t fmi3ValueReference;
typedef double fmi3Float64;
typedef bool fmi3Boolean;
typedef const char *fmi3String;
typedef enum fmu_status fmi3Status;
typedef void fmi3LogMessage(void *environment, fmi3Status status,
                            fmi3String category, fmi3String message);

#define EXPORT __attribute__((visibility("default")))

/* A pointer to a function does not go through one to an object. */
union fmi3_logger {
    fmi3LogMessage *call;
    void *kept;
};

static void fmi3_log(struct fmu *self, enum fmu_status status, const char *text)
{
    const union fmi3_logger logger = { .kept = self->logger };
    if (logger.call != NULL)
        logger.call(self->environment, status, "logStatusError", text);
}

EXPORT const char *fmi3GetVersion(void)
{
    return "3.0";
}

EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on,
                                      size_t count,
                                      const fmi3String categories[])
{
    (void)instance, (void)on, (void)count, (void)categories;
    return FMU_OK;
}

/* NOLINTNEXTLINE(readability-function-size): the standard's arguments */
EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean event_mode,
    fmi3Boolean early_return, const fmi3ValueReference intermediate[],
    size_t intermediates, void *environment, fmi3LogMessage *log_message,
    void *intermediate_update)
{
    const union fmi3_logger logger = { .call = log_message };
    const struct fmu like = { .log = fmi3_log,
                              .logger = logger.kept,
                              .environment = environment };

    (void)visible, (void)logging, (void)event_mode, (void)early_return;
    (void)intermediate, (void)intermediates, (void)intermediate_update;
    return fmu_new(&like, name, resources, token);
}

EXPORT fmi3Instance fmi3InstantiateModelExchange(
    fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, void *environment,
    fmi3LogMessage *log_message)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging;
    (void)environment, (void)log_message;
    return NULL; /* co-simulation alone */
}

/* NOLINTNEXTLINE(readability-function-size): the standard's arguments */
EXPORT fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, void *environment,
    fmi3LogMessage *log_message, void *clock_update, void *lock, void *unlock)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging;
    (void)environment, (void)log_message, (void)clock_update, (void)lock;
    (void)unlock;
    return NULL; /* co-simulation alone */
}

EXPORT void fmi3FreeInstance(fmi3Instance instance)
{
    fmu_free(instance);
}

EXPORT fmi3Status fmi3EnterInitializationMode(
    fmi3Instance instance, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
    fmi3Float64 start, fmi3Boolean stop_defined, fmi3Float64 stop)
{
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    return fmu_enter(instance, start);
}

EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    return fmu_exit(instance);
}

EXPORT fmi3Status fmi3Terminate(fmi3Instance instance)
{
    return fmu_terminate(instance);
}

EXPORT fmi3Status fmi3Reset(fmi3Instance instance)
{
    return fmu_reset(instance);
}

/* --- values --- */

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance instance,
                                 const fmi3ValueReference of[], size_t count,
                                 fmi3Float64 value[], size_t values)
{
    fmi3Status status =
        values == count ? FMU_OK : fmu_fail(instance, "has no arrays");
    for (size_t i = 0; i < count && status == FMU_OK; i++)
        status = fmu_get(instance, of[i], false, &value[i]);
    return status;
}

EXPORT fmi3Status fmi3SetFloat64(fmi3Instance instance,
                                 const fmi3ValueReference of[], size_t count,
                                 const fmi3Float64 value[], size_t values)
{
    fmi3Status status =
        values == count ? FMU_OK : fmu_fail(instance, "has no arrays");
    for (size_t i = 0; i < count && status == FMU_OK; i++)
        status = fmu_set(instance, of[i], false, value[i]);
    return status;
}

EXPORT fmi3Status fmi3GetBoolean(fmi3Instance instance,
                                 const fmi3ValueReference of[], size_t count,
                                 fmi3Boolean value[], size_t values)
{
    fmi3Status status =
        values == count ? FMU_OK : fmu_fail(instance, "has no arrays");
    double got = 0;
    for (size_t i = 0; i < count && status == FMU_OK; i++) {
        status = fmu_get(instance, of[i], true, &got);
        value[i] = got != 0;
    }
    return status;
}

EXPORT fmi3Status fmi3SetBoolean(fmi3Instance instance,
                                 const fmi3ValueReference of[], size_t count,
                                 const fmi3Boolean value[], size_t values)
{
    fmi3Status status =
        values == count ? FMU_OK : fmu_fail(instance, "has no arrays");
    for (size_t i = 0; i < count && status == FMU_OK; i++)
        status = fmu_set(instance, of[i], true, value[i]);
    return status;
}

/* --- steps --- */

EXPORT fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time,
                             fmi3Float64 step, fmi3Boolean no_state_before,
                             fmi3Boolean *event, fmi3Boolean *terminate,
                             fmi3Boolean *early, fmi3Float64 *last)
{
    (void)no_state_before;
    const fmi3Status status = fmu_step(instance, time, step);
    *event = *terminate = *early = false;
    *last = fmu_time_s(instance);
    return status;
}

/* --- states --- */

EXPORT fmi3Status fmi3GetFMUState(fmi3Instance instance, void **state)
{
    struct fmu_kept *kept = *state;
    const fmi3Status status = fmu_keep(instance, &kept);
    *state = kept;
    return status;
}

EXPORT fmi3Status fmi3SetFMUState(fmi3Instance instance, void *state)
{
    return fmu_restore(instance, state);
}

EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance instance, void **state)
{
    (void)instance;
    memory_free(*state);
    *state = NULL;
    return FMU_OK;
}

EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, void *state,
                                             size_t *size)
{
    return fmu_kept_size(instance, state, size);
}

EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance instance, void *state,
                                        uint8_t bytes[], size_t size)
{
    return fmu_kept_write(instance, state, bytes, size);
}

EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance instance,
                                          const uint8_t bytes[], size_t size,
                                          void **state)
{
    struct fmu_kept *kept = NULL;
    const fmi3Status status = fmu_kept_read(instance, bytes, size, &kept);
    *state = kept;
    return status;
}

/* --- what the description says that it has not --- */

/* Of types that none of the variables has, with or without a size of each. */
#define FMI3_NONE(type, c_type)                                                \
    EXPORT fmi3Status fmi3Get##type(                                           \
        fmi3Instance instance, const fmi3ValueReference of[], size_t count,    \
        c_type value[], size_t values)                                         \
    {                                                                          \
        (void)of, (void)value, (void)values;                                   \
        return fmi3_none(instance, count);                                     \
    }                                                                          \
    EXPORT fmi3Status fmi3Set##type(                                           \
        fmi3Instance instance, const fmi3ValueReference of[], size_t count,    \
        const c_type value[], size_t values)                                   \
    {                                                                          \
        (void)of, (void)value, (void)values;                                   \
        return fmi3_none(instance, count);                                     \
    }

static fmi3Status fmi3_none(fmi3Instance instance, size_t count)
{
    return count == 0 ? FMU_OK
                      : fmu_fail(instance, "the unit has no such variables");
}

FMI3_NONE(Float32, float)
FMI3_NONE(Int8, int8_t)
FMI3_NONE(UInt8, uint8_t)
FMI3_NONE(Int16, int16_t)
FMI3_NONE(UInt16, uint16_t)
FMI3_NONE(Int32, int32_t)
FMI3_NONE(UInt32, uint32_t)
FMI3_NONE(Int64, int64_t)
FMI3_NONE(UInt64, uint64_t)
FMI3_NONE(String, fmi3String)

/* Functions of other kinds of unit and of what it is not capable of, for an
 * environment that looks all of them up: each is an error, whatever its other
 * arguments, which are the caller's to remove. */
#define FMI3_ABSENT(X)                                                         \
    X(GetBinary)                                                               \
    X(SetBinary)                                                               \
    X(GetClock)                                                                \
    X(SetClock)                                                                \
    X(GetDirectionalDerivative)                                                \
    X(GetAdjointDerivative)                                                    \
    X(GetNumberOfVariableDependencies)                                         \
    X(GetVariableDependencies)                                                 \
    X(EnterConfigurationMode)                                                  \
    X(ExitConfigurationMode)                                                   \
    X(EnterEventMode)                                                          \
    X(EnterStepMode)                                                           \
    X(EvaluateDiscreteStates)                                                  \
    X(UpdateDiscreteStates)                                                    \
    X(GetIntervalDecimal)                                                      \
    X(GetIntervalFraction)                                                     \
    X(GetShiftDecimal)                                                         \
    X(GetShiftFraction)                                                        \
    X(SetIntervalDecimal)                                                      \
    X(SetIntervalFraction)                                                     \
    X(SetShiftDecimal)                                                         \
    X(SetShiftFraction)                                                        \
    X(EnterContinuousTimeMode)                                                 \
    X(CompletedIntegratorStep)                                                 \
    X(SetTime)                                                                 \
    X(SetContinuousStates)                                                     \
    X(GetContinuousStateDerivatives)                                           \
    X(GetEventIndicators)                                                      \
    X(GetContinuousStates)                                                     \
    X(GetNominalsOfContinuousStates)                                           \
    X(GetNumberOfEventIndicators)                                              \
    X(GetNumberOfContinuousStates)                                             \
    X(GetOutputDerivatives)                                                    \
    X(ActivateModelPartition)
#define FMI3_ABSENT_ONE(name)                                                  \
    EXPORT fmi3Status fmi3##name(fmi3Instance instance)                        \
    {                                                                          \
        return fmu_fail(instance, "fmi3" #name " is not for this unit");       \
    }
FMI3_ABSENT(FMI3_ABSENT_ONE)

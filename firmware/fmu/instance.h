/* firmware/fmu/instance.h - an instance of the unit, whichever version of FMI it
 * is driven by.
 *
 *   INSTANTIATED --enter--> INITIALIZING --exit--> STEPPING --terminate--> ENDED
 *        ^                                                                   |
 *        '------------------------------- reset -----------------------------'
 *
 * A call that the state does not allow is an error and changes nothing. */
#ifndef FIRMWARE_FMU_INSTANCE_H
#define FIRMWARE_FMU_INSTANCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/linux/fmu/fmu_files.h"
#include "firmware/linux/fmu/fmu_model.h"
#include "firmware/linux/fmu/fmu_state.h"

/* The values of fmi2Status and fmi3Status that are used; theirs are the same. */
enum fmu_status { FMU_OK, FMU_WARNING, FMU_DISCARD, FMU_ERROR, FMU_FATAL };

enum fmu_state { FMU_INSTANTIATED, FMU_INITIALIZING, FMU_STEPPING, FMU_ENDED };

struct fmu {
    enum fmu_state state;
    struct fmu_files files;
    struct fmu_model model;
    double start_s; /* time of the environment at which the model's is 0 */
    char *name;
    void *environment;
    void (*log)(struct fmu *self, enum fmu_status status, const char *text);
    void *logger; /* of the environment, for `log` */
    bool warned;
    struct fmu_state_map map; /* once a state is kept */
};

/* A state that is kept: bytes that are the same wherever the unit runs. */
struct fmu_kept {
    size_t size;
    unsigned char bytes[];
};

/* From the directory of the resources.  `token` is that of the description.
 * NULL after an error, which has been logged.  `log` may be called at once. */
struct fmu *fmu_new(const struct fmu *like, const char *name,
                    const char *resources, const char *token);
void fmu_free(struct fmu *self);

enum fmu_status fmu_fail(struct fmu *self, const char *text);
enum fmu_status fmu_enter(struct fmu *self, double start_s);
enum fmu_status fmu_exit(struct fmu *self);
enum fmu_status fmu_terminate(struct fmu *self);
enum fmu_status fmu_reset(struct fmu *self);
enum fmu_status fmu_step(struct fmu *self, double time_s, double step_s);
/* Where the model is, on the environment's time. */
double fmu_time_s(const struct fmu *self);

enum fmu_status fmu_get(struct fmu *self, uint32_t reference, bool is_boolean,
                        double *value);
enum fmu_status fmu_set(struct fmu *self, uint32_t reference, bool is_boolean,
                        double value);

/* Into a new one, or in the place of *kept. */
enum fmu_status fmu_keep(struct fmu *self, struct fmu_kept **kept);
/* Of this instance or of another one of the unit. */
enum fmu_status fmu_restore(struct fmu *self, const struct fmu_kept *kept);
/* Of the bytes that fmu_kept_write makes of it. */
enum fmu_status fmu_kept_size(struct fmu *self, const struct fmu_kept *kept,
                              size_t *size);
/* From bytes of a kept state, which may come from another process. */
enum fmu_status fmu_kept_read(struct fmu *self, const void *bytes, size_t size,
                              struct fmu_kept **kept);
enum fmu_status fmu_kept_write(struct fmu *self, const struct fmu_kept *kept,
                               void *bytes, size_t size);

#endif

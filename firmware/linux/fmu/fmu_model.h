/* firmware/linux/fmu/fmu_model.h - the servos of a rig as something that is
 * stepped: drivers, buses, drives and plants, with set points as its input.
 *
 * Time 0 is when every drive has been found and enabled.  From then on the ticks
 * of the rig are at the multiples of its period; a tick sends the set points
 * that hold at its time, and what a drive reports is as of the last tick.  A set
 * point given for a communication point goes on from there with its velocity and
 * acceleration.  So long as they say the same, results do not depend on the
 * length of the steps.
 *
 * Axes are not homed: an encoder counts from the axis's own zero. */
#ifndef FIRMWARE_LINUX_FMU_FMU_MODEL_H
#define FIRMWARE_LINUX_FMU_FMU_MODEL_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/linux/fmu/fmu_variable.h"
#include "firmware/linux/machine/machine_sim.h"

struct fmu_axis {
    double value[FMU_AXIS_VARIABLES]; /* booleans: 0 or 1 */
    bool is_awaited;                  /* it is to be enabled when it is off */
    bool out_of_range; /* the last set point did not fit the drive's units */
};

struct fmu_model {
    struct rig rig;
    struct machine_sim sim;
    struct machine machine;
    struct memory_pool memory;
    struct fmu_axis *axis; /* of the rig */
    bool enable, was_enabled;
    bool is_running;
    int64_t origin_ns;        /* of the simulated clock */
    int64_t now_ns, point_ns; /* since then; of the present step's start */
    int64_t tick_ns;          /* the next tick */
    char message[YAML_MESSAGE_MAX];
};

/* Reads the rig; all zero before.  0, or -1 with model->message.  fmu_model_free
 * in either case. */
int fmu_model_init(struct fmu_model *model, const struct files *files,
                   const char *path);
void fmu_model_free(struct fmu_model *model);

/* With the parameters as they are now, to time 0.  0, or -1 with a message. */
int fmu_model_start(struct fmu_model *model);
/* On to until_ns, with the inputs as of now.  Not back. */
void fmu_model_step(struct fmu_model *model, int64_t until_ns);

/* Of a reference but FMU_TIME.  -1: there is none, it is of the other type, or
 * it is not to be set now; message. */
int fmu_model_get(struct fmu_model *model, uint32_t reference, bool is_boolean,
                  double *value);
int fmu_model_set(struct fmu_model *model, uint32_t reference, bool is_boolean,
                  double value);

#endif

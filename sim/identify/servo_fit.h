/* sim/identify/servo_fit.h - the parameters with which a simulated servo does what
 * a real one did, from a run of it.
 *
 * Output error: the model (servo_model.h) is given the set points of the run, and
 * its parameters are changed until the sum of squares of what its encoder says
 * less what was recorded is smallest (Levenberg and Marquardt).  Three models are
 * tried, and the simplest is taken unless the next one leaves a twentieth less:
 *   RIGID      a motor alone: bandwidth and damping of its loop
 *   STIFF      a load without a resonance that could be seen: friction
 *   COMPLIANT  ratio of inertias, frequency and damping of the load, backlash
 * From set points alone, without a torque, inertia is known as a ratio, and
 * friction as the acceleration that it takes.
 * Deviations are those of the linearized model with the variance of what is left
 * and the time over which it is correlated with itself.
 * Sources: Ljung, System Identification, 2nd ed. (1999), 7.2, 9.3 and 10.2;
 * Nocedal, Wright, Numerical Optimization, 2nd ed. (2006), 10.3. */
#ifndef SIM_IDENTIFY_SERVO_FIT_H
#define SIM_IDENTIFY_SERVO_FIT_H

#include "sim/identify/servo_model.h"

#define SIM_FIT_ROWS_MIN 200
/* In doubles. */
#define SIM_FIT_WORK(rows) ((size_t)(SIM_MODEL_PARAMETERS + 4) * (rows))

enum sim_fit_model { SIM_FIT_RIGID, SIM_FIT_STIFF, SIM_FIT_COMPLIANT };

struct sim_fit_value {
    double value;
    double deviation; /* standard; 0 where it was not fitted */
    /* The run determines it: its deviation is below a quarter of it, or in
     * a model that has it, it is 0 and could be no more than 3 deviations. */
    bool known;
};

struct sim_fit {
    enum sim_fit_model model;
    struct sim_fit_value parameter[SIM_MODEL_PARAMETERS];
    double rms_before, rms; /* of model less recording, counts: as it was given,
                               as it was fitted */
    unsigned plays;         /* of the model */
};

/* How far it is, 0 .. 1; false: enough. */
typedef bool sim_fit_progress(void *context, double part);

/* `before`: the values that the fit begins with, of a motor alone or `loaded`,
 * which then is not RIGID, and keeps of them what the run does not show.
 * `work`: SIM_FIT_WORK(rows); the first rows of it are the fitted model's places
 * afterwards.  `progress` may be NULL.  MOTION_E_ARG: fewer rows than
 * SIM_FIT_ROWS_MIN, or values the model refuses; MOTION_E_STATE: ended by
 * progress; MOTION_E_RANGE: nothing moves, or the model cannot be computed. */
int sim_fit(const struct sim_model_run *run, const double before[], bool loaded,
            sim_fit_progress *progress, void *context, double *work,
            struct sim_fit *fit);

#endif

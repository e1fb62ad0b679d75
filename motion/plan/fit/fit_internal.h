/* motion/plan/fit/fit_internal.h - what the files of fit.h share. */
#ifndef MOTION_PLAN_FIT_FIT_INTERNAL_H
#define MOTION_PLAN_FIT_FIT_INTERNAL_H

#include <stdbool.h>

#include "motion/plan/fit/fit.h"

struct fit {
    const struct plan_fit_request *request;
    struct plan_fit *fit;
    struct plan_error *error;
    uint32_t open_from; /* the span from which on time is free */
    bool *is_fixed;     /* of each knot */
    /* of each span */
    double *need;      /* by which it would have to be longer than it is */
    uint32_t *axis_of; /* that needs it */
    double *dur;       /* wanted, 2^-12 ns */
    double *most;      /* what stretch gives it */
    struct plan_fit_need *own; /* of the spans of one axis */
};

/* --- fit_times.c: durations to tracks to what is needed -------------------- */

/* Index of a time that is one of a key. */
uint32_t fit_knot(const struct fit *self, int64_t t_ns_q12);
/* Plan every axis at the new times: what each span needs, and whether the
 * checker finds nothing. */
int fit_measure(struct fit *self, bool *fits);
/* New times from durations, and the same. */
int fit_try(struct fit *self, const double dur_ns_q12[], bool *fits);
/* Plan one axis as it is now: self->own, and *fits false where the checker finds
 * something. */
int fit_measure_axis(struct fit *self, uint32_t a, bool *fits);
int fit_no_memory(struct fit *self);

/* --- fit_smooth.c ---------------------------------------------------------- */

int fit_smooth(struct fit *self);

/* Durations of a span. */
static inline double fit_from(const struct fit *self, uint32_t span)
{
    return (double)(self->fit->from_ns_q12[span + 1] -
                    self->fit->from_ns_q12[span]);
}

static inline double fit_to(const struct fit *self, uint32_t span)
{
    return (double)(self->fit->to_ns_q12[span + 1] -
                    self->fit->to_ns_q12[span]);
}

#endif

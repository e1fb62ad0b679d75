/* motion/plan/topp/topp_rows.h - the limits of all axes on one interval of the path
 * parameter, as rows of a linear program; see topp.h.
 *
 * The variables are x at the start of the interval and u at both ends, so that
 * rows keep their size where intervals are short; x has the Bernstein
 * coefficients x, x + h u0, x + h (u0 + u1). */
#ifndef MOTION_PLAN_TOPP_TOPP_ROWS_H
#define MOTION_PLAN_TOPP_TOPP_ROWS_H

#include "motion/plan/topp/topp.h"
#include "motion/plan/topp/topp_lp.h"

enum { TOPP_X, TOPP_U0, TOPP_U1, TOPP_VARIABLES };

struct topp_interval {
    const struct plan_topp_path *path;
    const struct plan_topp_limit *limit; /* of each axis */
    uint32_t piece;                      /* of the path, which holds it */
    double s, h;                         /* from s to s + h */
    double low[3], high[3]; /* what the Bernstein coefficients of x may be */
    double share;           /* of the limits that may be used */
};

void topp_rows(const struct topp_interval *interval, struct topp_lp *lp);

/* MOTION_E_ARG for a count, a border, a limit or a speed out of range. */
int topp_check(const struct plan_topp_request *request);

/* q' of one axis at s from its border. */
double topp_slope(unsigned degree, const double coef[], double s);

#endif

/* motion/plan/topp/topp_time.h - time along a parabola of the squared speed; the
 * readers of topp.h stand beside it in the .c. */
#ifndef MOTION_PLAN_TOPP_TOPP_TIME_H
#define MOTION_PLAN_TOPP_TOPP_TIME_H

/* Time over width h of the parabola with these Bernstein coefficients: the
 * integral of x^-1/2.  Infinite or NaN when x is not above 0 inside. */
double topp_time(const double x[3], double h);

#endif

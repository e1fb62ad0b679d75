/* motion/plan/topp/topp_line.h - along a straight line in the least time with
 * limits of velocity, acceleration and jerk: at most seven phases.
 *
 * The motion goes forward from one speed to another and has no acceleration at
 * either end.  A change of speed by d with jerk J and acceleration A takes
 * d / A + A / J, or 2 sqrt(d / J) when A is not reached; as its acceleration is
 * symmetric in time, its distance is the mean of both speeds times that.  The
 * distance of both changes together rises with the peak speed between them, so
 * that bisection finds the peak.
 *
 * Source: Biagiotti & Melchiorri, Trajectory Planning (2008), 3.4, the double S
 * profile, with different limits up and down.  Units are any unit and s. */
#ifndef MOTION_PLAN_TOPP_TOPP_LINE_H
#define MOTION_PLAN_TOPP_TOPP_LINE_H

#define TOPP_LINE_PHASES 7

struct topp_line_limit {
    double vel, acc, dec, jerk; /* all above 0 */
};

/* Begins with acceleration 0 at position 0. */
struct topp_line {
    double vel;                                           /* at the start */
    double dur[TOPP_LINE_PHASES], jerk[TOPP_LINE_PHASES]; /* of each phase */
};

/* Position and its three derivatives by time. */
struct topp_line_state {
    double pos, vel, acc, jerk;
};

/* MOTION_E_LIMIT when a speed is above the limit or the length too short to go
 * from one to the other. */
int topp_line_plan(const struct topp_line_limit *limit, double length,
                   double start_vel, double end_vel, struct topp_line *line);

double topp_line_duration(const struct topp_line *line);

/* Between two phases the jerk of the one that begins. */
void topp_line_at(const struct topp_line *line, double t_s,
                  struct topp_line_state *state);

#endif

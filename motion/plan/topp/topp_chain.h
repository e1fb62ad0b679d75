/* motion/plan/topp/topp_chain.h - a stretch of a path over a parameter w from 0 to 1
 * that is easier to time than the path's own.
 *
 * From rest with constant jerk s grows with t^3, so that s' as a function of s
 * has no finite derivatives at a start.  With s = s(w), s(w) ~ w^3 there, w'
 * is smooth and above zero all along.  In the middle s is linear in w; s(w)
 * has three continuous derivatives.  Where the path itself starts slowly,
 * less is changed, and nothing where it starts at a speed.
 *
 * By the chain rule, with r(w) = q(s(w)):
 *     r' = q' s'    r'' = q'' s'^2 + q' s''
 *     r''' = q''' s'^3 + 3 q'' s' s'' + q' s''' */
#ifndef MOTION_PLAN_TOPP_TOPP_CHAIN_H
#define MOTION_PLAN_TOPP_TOPP_CHAIN_H

#include <stdbool.h>

#include "motion/plan/topp/topp.h"

#define TOPP_CHAIN_DEGREE 5 /* of s(w) between joins */

/* How s begins: as w, w^2, w^3. */
struct topp_chain_end {
    unsigned order;
    double width; /* of w; after it s is linear */
    double speed; /* s' there; 0: rest */
};

struct topp_chain {
    struct plan_topp_path path; /* whose arrays stay */
    uint32_t first, last;       /* pieces */
    double s, scale;            /* at w = 0; ds/dw in the middle */
    struct topp_chain_end start, end;
};

/* Pieces first .. last: from rest to rest, but at the request's speeds where the
 * path itself begins and ends and not all axes stand. */
void topp_chain_init(struct topp_chain *chain,
                     const struct plan_topp_request *request, uint32_t first,
                     uint32_t last);

/* s and three derivatives by w. */
void topp_chain_s(const struct topp_chain *chain, double w, double s[4]);

/* Where s(w) is no one polynomial: at most two places, in order. */
unsigned topp_chain_joins(const struct topp_chain *chain, double w[2]);

/* s from the border of a piece as powers of x, with w = from + h x for x from 0
 * to 1, between two joins. */
void topp_chain_part(const struct topp_chain *chain, uint32_t piece,
                     double from, double h,
                     double power[TOPP_CHAIN_DEGREE + 1]);

/* w where s is. */
double topp_chain_w(const struct topp_chain *chain, double s);

/* One axis of a piece and three derivatives by s, at s from its border. */
void topp_chain_powers(const struct plan_topp_path *path, uint32_t piece,
                       unsigned axis, double s, double q[4]);

/* One axis and three derivatives by w, where topp_chain_s said `s`. */
void topp_chain_axis(const struct topp_chain *chain, uint32_t piece,
                     unsigned axis, const double s[4], double r[4]);

#endif

/* motion/path/arclen_internal.h - what the files of arclen.h share. */
#ifndef MOTION_PATH_ARCLEN_INTERNAL_H
#define MOTION_PATH_ARCLEN_INTERNAL_H

#include "motion/path/arclen.h"

#define ARCLEN_GAUSS_POINTS 8

static inline struct motion_real
arclen_width(const struct motion_arclen_curve *curve, uint32_t piece)
{
    return motion_real_sub(curve->border[piece + 1], curve->border[piece]);
}

/* sqrt of the sum of squares */
struct motion_real arclen_norm(const struct motion_real v[], uint32_t axes);

/* Integral of the speed from x over h, by 8 Gauss points. */
struct motion_real arclen_gauss(const struct motion_arclen_curve *curve,
                                uint32_t piece, struct motion_real x,
                                struct motion_real h);

/* Walk the adaptive panels and fill in the table; rows are only counted where
 * table->row is NULL. */
int arclen_walk(struct motion_arclen_table *table,
                struct motion_real tolerance);

#endif

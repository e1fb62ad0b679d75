/* tests/motion/vectors.h - reference files against the integer core.
 *
 * Each function computes every case of one file (layouts: README of the
 * vectors) through the public functions of motion/, double only where numbers
 * are read and compared, and returns one row per method: how many cases, the
 * largest error of value, first and second derivative, each divided by the
 * largest value of its case (at least 1), and whether all are inside.  Where a
 * method has no derivatives, v and a are other things of the same kind:
 * tangents; curvature and torsion.
 * The answer is the number of rows, or -1 when a case has a method that is not
 * known, is malformed, or the rows do not fit; what was wrong is on stderr. */
#ifndef TESTS_MOTION_VECTORS_H
#define TESTS_MOTION_VECTORS_H

#include <stdbool.h>
#include <stddef.h>

#include <cjson/cJSON.h>

struct vectors_row {
    char method[64];
    unsigned cases;
    double worst_p, worst_v, worst_a, tolerance; /* tolerance: of worst_p; 10
                                                    times as much for v, 100
                                                    times for a */
    bool pass;
    char text[128]; /* printed in the place of the figures, if any */
};

int vectors_splines(const cJSON *file, struct vectors_row *rows, int capacity);
int vectors_arclength(const cJSON *file, struct vectors_row *rows,
                      int capacity);
int vectors_ease(const cJSON *file, struct vectors_row *rows, int capacity);
/* worst_p is of the curve's own tol_abs. */
int vectors_blender(const cJSON *file, struct vectors_row *rows, int capacity);
int vectors_quaternions(const cJSON *file, struct vectors_row *rows,
                        int capacity);
int vectors_frames(const cJSON *file, struct vectors_row *rows, int capacity);
/* A row of text per case. */
int vectors_kinematics(const cJSON *file, struct vectors_row *rows,
                       int capacity);
int vectors_shapers(const cJSON *file, struct vectors_row *rows, int capacity);
/* worst_p, _v, _a: of peak, ratio and stretch, relative. */
int vectors_fit(const cJSON *file, struct vectors_row *rows, int capacity);
/* A row for each path. */
int vectors_jerk_paths(const cJSON *file, struct vectors_row *rows,
                       int capacity);
/* One case, whose waypoints are in a file of the same folder. */
int vectors_topp(const cJSON *file, const char *path, struct vectors_row *row);

#endif

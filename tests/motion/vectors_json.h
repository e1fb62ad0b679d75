/* tests/motion/vectors_json.h - numbers out of a vectors file, and rows of
 * results. */
#ifndef TESTS_MOTION_VECTORS_JSON_H
#define TESTS_MOTION_VECTORS_JSON_H

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "motion/number/vec.h"
#include "tests/motion/vectors.h"

/* `count` numbers; false when there are others or something else. */
static inline bool vectors_numbers(const cJSON *list, int count, double *to)
{
    const cJSON *item;
    int n = 0;

    if (!cJSON_IsArray(list))
        return false;
    cJSON_ArrayForEach(item, list)
    {
        if (n == count || !cJSON_IsNumber(item))
            return false;
        to[n++] = item->valuedouble;
    }
    return n == count;
}

static inline const cJSON *vectors_get(const cJSON *item, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(item, name);
}

/* NAN when it is something else. */
static inline double vectors_value(const cJSON *item)
{
    return cJSON_IsNumber(item) ? item->valuedouble : NAN;
}

static inline double vectors_value_of(const cJSON *item, const char *name)
{
    return vectors_value(vectors_get(item, name));
}

static inline double vectors_number_at(const cJSON *list, int64_t i)
{
    return vectors_value(cJSON_GetArrayItem(list, (int)i));
}

/* "" when it is something else. */
static inline const char *vectors_string(const cJSON *item)
{
    const char *text = cJSON_GetStringValue(item);
    return text != NULL ? text : "";
}

static inline const char *vectors_text(const cJSON *item, const char *name)
{
    return vectors_string(vectors_get(item, name));
}

static inline bool vectors_number(const cJSON *item, const char *name,
                                  double *to)
{
    const cJSON *const number = cJSON_GetObjectItemCaseSensitive(item, name);

    if (!cJSON_IsNumber(number))
        return false;
    *to = number->valuedouble;
    return true;
}

/* A double as a motion_real, exact. */
static inline struct motion_real vectors_real(double a)
{
    int exponent;
    const double mantissa = frexp(a, &exponent);

    return motion_real_make((int64_t)ldexp(mantissa, 60), exponent - 60);
}

static inline double vectors_double(struct motion_real a)
{
    return ldexp((double)a.m, a.e);
}

static inline struct motion_vec vectors_vec(const double a[3])
{
    return (struct motion_vec){ { vectors_real(a[0]), vectors_real(a[1]),
                                  vectors_real(a[2]) } };
}

/* The row of a method, a new one when there is none; NULL when the room is
 * full. */
static inline struct vectors_row *vectors_row_of(struct vectors_row *rows,
                                                 int capacity, int *count,
                                                 const char *method,
                                                 double tolerance)
{
    for (int i = 0; i < *count; i++) {
        if (strcmp(rows[i].method, method) == 0)
            return &rows[i];
    }
    if (*count == capacity)
        return NULL;
    rows[*count] = (struct vectors_row){ .tolerance = tolerance, .pass = true };
    snprintf(rows[*count].method, sizeof rows->method, "%s", method);
    return &rows[(*count)++];
}

static inline void vectors_worst(double *worst, double error)
{
    if (!(error <= *worst)) /* a NaN stays */
        *worst = error;
}

/* Judge all rows. */
static inline void vectors_judge(struct vectors_row *rows, int count)
{
    for (int i = 0; i < count; i++)
        rows[i].pass = rows[i].pass && rows[i].worst_p <= rows[i].tolerance &&
                       rows[i].worst_v <= 10 * rows[i].tolerance &&
                       rows[i].worst_a <= 100 * rows[i].tolerance;
}

#endif

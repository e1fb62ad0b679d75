/* motion/plan/plan_error.h - for the planners: fill in a struct plan_error. */
#ifndef MOTION_PLAN_PLAN_ERROR_H
#define MOTION_PLAN_PLAN_ERROR_H

#include "motion/plan/move.h"

/* Write code, place and sentence; returns the code. */
int plan_error_set(struct plan_error *error, int code, struct plan_place place,
                   const char *format, ...)
    __attribute__((format(printf, 4, 5)));

#endif

/* motion/plan/plan_error.c - see plan_error.h. */
#include "motion/plan/plan_error.h"

#include <stdarg.h>
#include <stdio.h>

int plan_error_set(struct plan_error *error, int code, struct plan_place place,
                   const char *format, ...)
{
    va_list args;

    *error = (struct plan_error){ .code = code,
                                  .axis = PLAN_AXES_MAX,
                                  .place = place };
    va_start(args, format);
    vsnprintf(error->text, sizeof error->text, format, args);
    va_end(args);
    return code;
}

/* firmware/host/yaml/yaml_report.h - one sentence about what is wrong in a
 * file.
 *
 *   path:line:column: what is wrong, expected ...
 *
 * One line, bounded, printable whatever stands in the file.  Lines and columns
 * count from 1, columns in characters, as editors do. */
#ifndef FIRMWARE_HOST_YAML_YAML_REPORT_H
#define FIRMWARE_HOST_YAML_YAML_REPORT_H

#include <stddef.h>

#include "motion/plan/move.h"

/* Longest "file:line:column: what is wrong, what was expected" with its 0. */
#define YAML_MESSAGE_MAX 512

struct yaml_report {
    const char *path;
    char *message; /* of the caller; written once, at the first error */
    size_t capacity;
};

/* Write the sentence and return -1, so that a reader can return it up. */
int yaml_report_at(const struct yaml_report *report, struct plan_place place,
                   const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#endif

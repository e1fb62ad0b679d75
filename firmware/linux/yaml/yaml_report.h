/* firmware/linux/yaml/yaml_report.h - one sentence about what is wrong in a
 * file.
 *
 *   path:line:column: what is wrong, expected ...
 *
 * One line, bounded, printable whatever stands in the file.  Lines and columns
 * count from 1, columns in characters, as editors do. */
#ifndef FIRMWARE_LINUX_YAML_YAML_REPORT_H
#define FIRMWARE_LINUX_YAML_YAML_REPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "motion/plan/move.h"

/* Longest quotation with its quotes and 0. */
#define YAML_QUOTE_MAX 64

struct yaml_report {
    const char *path;
    char *message; /* of the caller; written once, at the first error */
    size_t room;
};

/* Write the sentence and return -1, so that a reader can return it up. */
int yaml_report_at(const struct yaml_report *report, struct plan_place place,
                   const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* `text` in single quotes, cut after some 40 characters, what is not printable
 * as \x07.  Returns `quote`. */
const char *yaml_quote(char quote[YAML_QUOTE_MAX], const char *text,
                       size_t length);

/* "a, b or c"; what does not fit is "...".  Returns `list`. */
#define YAML_LIST_MAX 256
const char *yaml_list(char list[YAML_LIST_MAX], const char *const spelling[],
                      unsigned count);

/* Decode one character.  Returns its length, 1..4, or 0 when the bytes are not
 * UTF-8 (overlong forms, surrogates and beyond 0x10FFFF included). */
unsigned yaml_utf8_decode(const unsigned char *text, size_t length,
                          uint32_t *character);

/* Neither a control, nor a line separator, nor one of the invisible characters
 * that reorder or hide text. */
bool yaml_is_printable(uint32_t character);

#endif

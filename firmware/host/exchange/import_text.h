/* firmware/host/exchange/import_text.h - a text file of numbers, line by line.
 *
 * Words hold their place in the file, so that every reader's errors are
 * file:line:column, as those of YAML files (yaml_report.h).  Line ends are LF,
 * CR LF or CR; a Ctrl-Z (old DOS programs) ends the text.  A byte order mark is
 * skipped, and UTF-16 that has one is read. */
#ifndef FIRMWARE_HOST_EXCHANGE_IMPORT_TEXT_H
#define FIRMWARE_HOST_EXCHANGE_IMPORT_TEXT_H

#include <stdbool.h>
#include <stddef.h>

#include "firmware/host/base/files.h"
#include "firmware/host/base/units.h"
#include "firmware/host/yaml/yaml_report.h"
#include "motion/plan/plan_progress.h"

#define IMPORT_BYTES_MAX (64u << 20)
#define IMPORT_WORD_MAX  256 /* of a number or a name, with its 0 */

struct import_text {
    struct yaml_report report;
    char *data; /* on the heap, with a 0 at the end */
    size_t length;
    size_t line_start, line_end, next;    /* of the present line */
    size_t at;                            /* in it */
    uint32_t line;                        /* 0: before the first */
    bool has_comma;                       /* 0,5 is a half */
    const struct plan_progress *progress; /* is told of lines; NULL: none */
};

struct import_word {
    char text[IMPORT_WORD_MAX];
    struct plan_place place;
};

/* 0, or -1 with the sentence written: no file, too large, a NUL or another
 * control character, not ASCII or UTF-8. */
int import_text_load(struct import_text *text, const struct files *files,
                     const char *path, char *message, size_t capacity);
void import_text_free(struct import_text *text);

/* The next line that is not empty and does not begin with `comment`. */
bool import_text_filled(struct import_text *text, char comment);

/* The next word of the line, up to a blank or one of `separators`, which are
 * skipped like blanks.  1; 0 at the end of the line; -1 when it is too long. */
int import_text_word(struct import_text *text, const char *separators,
                     struct import_word *word);
/* The next token, whatever lines there are in between: a word, or one of `marks`
 * alone; what follows // or # is a comment.  1; 0 at the end of the text; -1. */
int import_text_token(struct import_text *text, const char *marks,
                      struct import_word *word);
/* Up to the next `mark` and past it; false: there is none. */
bool import_text_skip(struct import_text *text, char mark);
/* The next cell: up to a separator, without blanks around it, perhaps empty; in
 * double quotes, where it may hold the separator, and "" is a quote. */
int import_text_cell(struct import_text *text, char separator,
                     struct import_word *word);

/* A number: decimal, perhaps with an exponent, in the format of `quantity`;
 * `before` and `after` are added to it ("f", "cm").  -1 with the sentence. */
int import_text_number(const struct import_text *text,
                       const struct import_word *word, const char *before,
                       const char *after, enum units_quantity quantity,
                       const struct units_context *context, int64_t *value);

struct plan_place import_text_place(const struct import_text *text);

/* Letters of either case are the same. */
bool import_text_same(const char *a, const char *b);

#endif

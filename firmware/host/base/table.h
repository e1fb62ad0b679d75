/* firmware/host/base/table.h - plain text in aligned columns. */
#ifndef FIRMWARE_HOST_BASE_TABLE_H
#define FIRMWARE_HOST_BASE_TABLE_H

#include <stddef.h>
#include <stdio.h>

#define TABLE_COLUMNS_MAX 12
#define TABLE_CELL_MAX    160

struct table {
    unsigned columns;
    const char *const *head;
    char (*cell)[TABLE_CELL_MAX]; /* row by row */
    size_t count, capacity;
};

/* `head` has one entry per column and must outlive the table; its first
 * character is the alignment, '<' or '>', the rest the heading. */
void table_init(struct table *table, unsigned columns,
                const char *const head[]);
/* The next cell, left to right, row by row. */
void table_cell(struct table *table, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
void table_print(const struct table *table, FILE *file);
void table_free(struct table *table);

#endif

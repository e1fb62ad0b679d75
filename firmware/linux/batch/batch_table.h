/* firmware/linux/batch/batch_table.h - the results of a batch: a line of CSV for
 * every run (RFC 4180), under one heading.
 *
 * The first three columns are batch, of which batch it is; run, its number; and
 * of, how many runs the batch has. */
#ifndef FIRMWARE_LINUX_BATCH_BATCH_TABLE_H
#define FIRMWARE_LINUX_BATCH_BATCH_TABLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "firmware/host/base/files.h"

#define BATCH_TABLE_MESSAGE 400
#define BATCH_COLUMNS_MAX   1024

struct batch_row {
    uint64_t run;
    char *line;  /* as it stands in the file, without its end */
    char **cell; /* unquoted; in the same block */
};

struct batch_table {
    char *head;
    char **name; /* of each column */
    uint32_t columns;
    struct batch_row *row;
    size_t rows, capacity;
};

/* With that heading; all zero before, batch_table_free in the end. */
void batch_table_init(struct batch_table *table, const char *head);
void batch_table_free(struct batch_table *table);

/* Add those of a file, whose heading becomes the table's when it has none.  A
 * last line without its end is left out: a kill has cut it.  *whole: the bytes
 * before it.  0, or -1 and a sentence: no such file, another heading, a line that
 * is none, or of another batch than those that are there. */
int batch_table_read(struct batch_table *table, const struct files *files,
                     const char *path, uint64_t *whole,
                     char message[BATCH_TABLE_MESSAGE]);
/* By run.  The number of a run that is there twice; -1: none is. */
int64_t batch_table_sort(struct batch_table *table);
/* By name; -1. */
int batch_table_column(const struct batch_table *table, const char *name);

void batch_table_write(const struct batch_table *table, FILE *file);
/* Columns of whole numbers, of numbers, of text, by what their cells are.  As
 * parquet_write. */
int batch_table_parquet(const struct batch_table *table, FILE *file);

/* A cell, quoted where it has to be; line ends become blanks. */
#define BATCH_CELL_MAX 1100
const char *batch_cell(char cell[BATCH_CELL_MAX], const char *text);

#endif

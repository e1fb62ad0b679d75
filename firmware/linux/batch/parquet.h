/* firmware/linux/batch/parquet.h - a table as an Apache Parquet file.
 *
 * One row group, every column in one page, values PLAIN and uncompressed, the
 * footer in Thrift's compact protocol: what every reader takes.  Columns are
 * required (no nulls).  Source: apache/parquet-format 2.10, README.md and
 * parquet.thrift; Thrift compact protocol specification. */
#ifndef FIRMWARE_LINUX_BATCH_PARQUET_H
#define FIRMWARE_LINUX_BATCH_PARQUET_H

#include <stdint.h>
#include <stdio.h>

enum parquet_type { PARQUET_INT64, PARQUET_DOUBLE, PARQUET_TEXT };

struct parquet_column {
    const char *name;
    enum parquet_type type;
};

/* What a cell is, by its column's type; the others are not looked at. */
struct parquet_cell {
    int64_t whole;
    double real;
    const char *text; /* UTF-8 */
};

struct parquet_table {
    const struct parquet_column *column;
    uint32_t columns;
    uint32_t rows;
    struct parquet_cell (*cell)(const void *context, uint32_t column,
                                uint32_t row);
    const void *context;
    const char *created_by;
};

/* -1: there is no memory, or a column is beyond 2^31 bytes.  Errors of writing
 * stay in the file's error flag. */
int parquet_write(const struct parquet_table *table, FILE *file);

#endif

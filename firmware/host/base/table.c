/* firmware/host/base/table.c - see table.h. */
#include "firmware/host/base/table.h"

#include <stdarg.h>
#include <string.h>

#include "firmware/host/base/memory.h"

void table_init(struct table *table, unsigned columns, const char *const head[])
{
    *table = (struct table){ .columns = columns, .head = head };
}

void table_cell(struct table *table, const char *format, ...)
{
    if (table->count == table->capacity) {
        table->capacity = table->capacity == 0 ? 64 : 2 * table->capacity;
        table->cell =
            memory_resize(table->cell, table->capacity, sizeof *table->cell);
    }
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(table->cell[table->count], TABLE_CELL_MAX, format, arguments);
    va_end(arguments);
    table->count++;
}

static int table_width(const struct table *table, unsigned column)
{
    size_t width = strlen(table->head[column] + 1);
    for (size_t i = column; i < table->count; i += table->columns) {
        size_t length = strlen(table->cell[i]);
        if (length > width)
            width = length;
    }
    return (int)width;
}

static void table_put(const struct table *table, FILE *file, unsigned column,
                      const char *text, int width)
{
    const char *gap = column == 0 ? "" : "  ";
    if (table->head[column][0] == '>')
        fprintf(file, "%s%*s", gap, width, text);
    else if (column + 1 == table->columns)
        fprintf(file, "%s%s", gap, text);
    else
        fprintf(file, "%s%-*s", gap, width, text);
}

void table_print(const struct table *table, FILE *file)
{
    int width[TABLE_COLUMNS_MAX] = { 0 };
    for (unsigned c = 0; c < table->columns; c++)
        width[c] = table_width(table, c);
    for (unsigned c = 0; c < table->columns; c++)
        table_put(table, file, c, table->head[c] + 1, width[c]);
    fputc('\n', file);
    unsigned column = 0;
    for (size_t i = 0; i < table->count; i++) {
        table_put(table, file, column, table->cell[i], width[column]);
        if (++column < table->columns)
            continue;
        fputc('\n', file);
        column = 0;
    }
}

void table_free(struct table *table)
{
    memory_free(table->cell);
    *table = (struct table){ .columns = 0 };
}

/* firmware/linux/batch/batch_table.c - see batch_table.h. */
#include "firmware/linux/batch/batch_table.h"

#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/library/version.h"
#include "firmware/linux/batch/parquet.h"

enum { TABLE_BATCH, TABLE_RUN, TABLE_OF, TABLE_FIRST };

static char *table_copy(const char *text)
{
    const size_t size = strlen(text) + 1;
    return memcpy(memory_new(size, 1), text, size);
}

/* Cells of a line, in place: a quote ends where no other one follows.  How many;
 * -1: more than `most`. */
static int64_t table_split(char *line, char *cell[], uint32_t most)
{
    uint32_t count = 0;
    for (char *from = line;; from++) {
        if (count == most)
            return -1;
        char *to = from;
        const bool is_quoted = *from == '"';
        cell[count++] = to;
        from += is_quoted;
        while (*from != '\0' &&
               !(is_quoted ? *from == '"' && from[1] != '"' : *from == ',')) {
            from += is_quoted && *from == '"';
            *to++ = *from++;
        }
        from += is_quoted && *from == '"';
        const bool is_last = *from != ',';
        *to = '\0';
        if (is_last)
            return count;
    }
}

void batch_table_init(struct batch_table *table, const char *head)
{
    char *cell[BATCH_COLUMNS_MAX];
    char *const names = table_copy(head);
    const int64_t columns = table_split(names, cell, BATCH_COLUMNS_MAX);

    *table = (struct batch_table){ .head = table_copy(head) };
    table->columns = columns > 0 ? (uint32_t)columns : 0;
    table->name = memory_new(table->columns, sizeof *table->name);
    for (uint32_t i = 0; i < table->columns; i++)
        table->name[i] = table_copy(cell[i]);
    memory_free(names);
}

void batch_table_free(struct batch_table *table)
{
    for (size_t i = 0; i < table->rows; i++) {
        memory_free(table->row[i].cell);
        memory_free(table->row[i].line);
    }
    for (uint32_t i = 0; i < table->columns; i++)
        memory_free(table->name[i]);
    memory_free(table->name);
    memory_free(table->row);
    memory_free(table->head);
    *table = (struct batch_table){ 0 };
}

static int table_count(const char *text, uint64_t *count)
{
    char *end;
    if (text[0] < '0' || text[0] > '9')
        return -1;
    errno = 0;
    *count = strtoull(text, &end, 10);
    return errno == 0 && *end == '\0' ? 0 : -1;
}

/* Add a line.  -1: it has another number of cells, or is no run 0 .. of - 1. */
static int batch_table_add(struct batch_table *table, const char *line)
{
    const size_t size = strlen(line) + 1;
    const size_t pointers = table->columns * sizeof(char *);
    char **const cell = memory_new(pointers + size, 1);
    struct batch_row row = { .cell = cell };
    char *const text = memcpy((char *)cell + pointers, line, size);
    uint64_t of;

    if (table->columns < TABLE_FIRST ||
        table_split(text, cell, table->columns) != table->columns ||
        table_count(cell[TABLE_RUN], &row.run) < 0 ||
        table_count(cell[TABLE_OF], &of) < 0 || row.run >= of) {
        memory_free(cell);
        return -1;
    }
    row.line = table_copy(line);
    if (table->rows == table->capacity) {
        table->capacity = 2 * table->capacity + 64;
        table->row =
            memory_resize(table->row, table->capacity, sizeof *table->row);
    }
    table->row[table->rows++] = row;
    return 0;
}

/* --- from a file --- */

static int table_fail(char message[BATCH_TABLE_MESSAGE], const char *path,
                      uint64_t line, const char *what)
{
    snprintf(message, BATCH_TABLE_MESSAGE, "%s:%" PRIu64 ": %s", path, line,
             what);
    return -1;
}

static int table_take(struct batch_table *table, const char *path,
                      uint64_t number, const char *line,
                      char message[BATCH_TABLE_MESSAGE])
{
    if (number == 1 && table->head == NULL) {
        batch_table_init(table, line);
        return table->columns > TABLE_FIRST &&
                       strcmp(table->name[TABLE_BATCH], "batch") == 0 &&
                       strcmp(table->name[TABLE_RUN], "run") == 0 &&
                       strcmp(table->name[TABLE_OF], "of") == 0
                   ? 0
                   : table_fail(message, path, 1,
                                "expected the results of a batch, with the "
                                "columns batch, run, of");
    }
    if (number == 1)
        return strcmp(line, table->head) == 0
                   ? 0
                   : table_fail(message, path, 1,
                                "other columns, expected those of the same "
                                "batch");
    if (batch_table_add(table, line) < 0)
        return table_fail(message, path, number, "is no run of this batch");
    char **const first = table->row[0].cell;
    char **const last = table->row[table->rows - 1].cell;
    return strcmp(first[TABLE_BATCH], last[TABLE_BATCH]) == 0 &&
                   strcmp(first[TABLE_OF], last[TABLE_OF]) == 0
               ? 0
               : table_fail(message, path, number,
                            "is a run of another batch: another seed, move, "
                            "rig, number of runs or variation");
}

int batch_table_read(struct batch_table *table, const struct files *files,
                     const char *path, uint64_t *whole,
                     char message[BATCH_TABLE_MESSAGE])
{
    struct files_lines *const lines = memory_new(1, sizeof *lines);
    uint64_t number = 0;
    int64_t length = 0;
    int err = files_lines_open(lines, files, path);

    *whole = 0;
    if (err < 0)
        snprintf(message, BATCH_TABLE_MESSAGE, "%s: %s", path, strerror(-err));
    while (err >= 0 && (length = files_lines_next(lines)) >= 0) {
        /* what is left of the file is none: the line had no end */
        const uint64_t end = lines->offset - (lines->got - lines->at);
        if (end != *whole + (uint64_t)length + 1)
            break;
        *whole = end;
        err = table_take(table, path, ++number, lines->line, message);
    }
    if (err >= 0 && lines->error < 0)
        err = table_fail(message, path, number, strerror(-lines->error));
    files_lines_close(lines);
    memory_free(lines);
    return err < 0 ? -1 : 0;
}

/* --- by run --- */

static int table_compare(const void *a, const void *b)
{
    const uint64_t one = ((const struct batch_row *)a)->run;
    const uint64_t other = ((const struct batch_row *)b)->run;
    return one < other ? -1 : one > other;
}

int64_t batch_table_sort(struct batch_table *table)
{
    if (table->rows > 1)
        qsort(table->row, table->rows, sizeof *table->row, table_compare);
    for (size_t i = 1; i < table->rows; i++)
        if (table->row[i].run == table->row[i - 1].run)
            return (int64_t)table->row[i].run;
    return -1;
}

int batch_table_column(const struct batch_table *table, const char *name)
{
    for (uint32_t i = 0; i < table->columns; i++)
        if (strcmp(table->name[i], name) == 0)
            return (int)i;
    return -1;
}

/* --- out --- */

void batch_table_write(const struct batch_table *table, FILE *file)
{
    fprintf(file, "%s\n", table->head);
    for (size_t i = 0; i < table->rows; i++)
        fprintf(file, "%s\n", table->row[i].line);
}

static enum parquet_type table_type(const struct batch_table *table,
                                    uint32_t column)
{
    enum parquet_type type = PARQUET_INT64;
    for (size_t i = 0; i < table->rows && type != PARQUET_TEXT; i++) {
        const char *const text = table->row[i].cell[column];
        char *end = NULL;
        errno = 0;
        (void)strtoll(text, &end, 10);
        if (text[0] != '\0' && *end == '\0' && errno == 0)
            continue;
        (void)strtod(text, &end);
        type = text[0] != '\0' && *end == '\0' ? PARQUET_DOUBLE : PARQUET_TEXT;
    }
    return type;
}

static struct parquet_cell table_cell(const void *context, uint32_t column,
                                      uint32_t row)
{
    const struct batch_table *const table = context;
    const char *const text = table->row[row].cell[column];
    return (struct parquet_cell){
        .whole = strtoll(text, NULL, 10),
        .real = strtod(text, NULL),
        .text = text,
    };
}

/* Results are numbers even where all of them happen to be whole. */
int batch_table_parquet(const struct batch_table *table, FILE *file)
{
    struct parquet_column *const column =
        memory_new(table->columns, sizeof *column);
    const struct parquet_table out = {
        .column = column,
        .columns = table->columns,
        .rows = (uint32_t)table->rows,
        .cell = table_cell,
        .context = table,
        .created_by = "slew version " SLEW_VERSION,
    };

    for (uint32_t i = 0; i < table->columns; i++) {
        column[i].name = table->name[i];
        column[i].type = table_type(table, i);
        if (i >= TABLE_FIRST && column[i].type == PARQUET_INT64 &&
            strcmp(table->name[i], "faults") != 0)
            column[i].type = PARQUET_DOUBLE;
    }
    column[TABLE_BATCH].type = PARQUET_TEXT;
    const int fault = batch_table_column(table, "fault");
    if (fault >= 0)
        column[fault].type = PARQUET_TEXT;
    const int err = parquet_write(&out, file);
    memory_free(column);
    return err;
}

const char *batch_cell(char cell[BATCH_CELL_MAX], const char *text)
{
    const bool is_quoted = strpbrk(text, ",\"\r\n") != NULL;
    size_t count = 0;
    if (is_quoted)
        cell[count++] = '"';
    for (; *text != '\0' && count + 4 < BATCH_CELL_MAX; text++) {
        if (*text == '"')
            cell[count++] = '"';
        cell[count++] = *text == '\r' || *text == '\n' ? ' ' : *text;
    }
    if (is_quoted)
        cell[count++] = '"';
    cell[count] = '\0';
    return cell;
}

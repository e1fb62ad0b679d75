/* firmware/host/recording/rows.c - see rows.h. */
#include "firmware/host/recording/rows.h"

#define ROWS_NS INT64_C(1000000000)

void rows_init(struct rows *rows, FILE *file)
{
    *rows = (struct rows){ .file = file };
}

void rows_end(struct rows *rows)
{
    rows->failed |= fflush(rows->file) != 0;
    if (rows->failed)
        rows->rows_lost += rows->rows_waiting;
    rows->rows_waiting = 0;
    rows->waiting = 0;
}

void rows_put(struct rows *rows, const char *text, size_t length, int64_t t_ns)
{
    if (rows->waiting + length > ROWS_BUFFER)
        rows_end(rows);
    rows->waiting += length;
    rows->rows_waiting++;
    if (!rows->failed)
        rows->failed = fwrite(text, 1, length, rows->file) != length;
    if (t_ns - rows->handed_ns < ROWS_NS)
        return;
    rows_end(rows);
    rows->handed_ns = t_ns;
}

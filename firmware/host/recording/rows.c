/* firmware/host/recording/rows.c - see rows.h. */
#include "firmware/host/recording/rows.h"

#define ROWS_NS INT64_C(1000000000)

void rows_init(struct rows *rows, FILE *file)
{
    *rows = (struct rows){ .file = file };
}

void rows_put(struct rows *rows, const char *text, size_t length, int64_t t_ns)
{
    if (rows->waiting + length > ROWS_BUFFER) {
        fflush(rows->file);
        rows->waiting = 0;
    }
    fwrite(text, 1, length, rows->file);
    rows->waiting += length;
    if (t_ns - rows->handed_ns < ROWS_NS)
        return;
    fflush(rows->file);
    rows->waiting = 0;
    rows->handed_ns = t_ns;
}

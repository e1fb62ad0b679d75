/* tests/fuzz/fuzz_otg.c - planning problems from CSV: a header line, and rows
 * that are solved when they are taken. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/exchange/otg_rows.h"
#include "tests/fuzz/fuzz.h"

static void fuzz_otg_row(struct otg_header *header, const char *line)
{
    struct otg_row row;
    struct otg_scaled scaled;
    struct motion_otg_plan plan;
    enum motion_otg_field field;
    int column = 0;

    if (otg_row_parse(header, line, &row, &column) != NULL) {
        fuzz_claim(column >= 0 && column <= (int)strlen(line) + 1,
                   "a column is in the row");
        return;
    }
    otg_row_scale(header, &row, &scaled);
    if (motion_otg_make(&scaled.move[0], &plan, &field) < 0)
        return;
    /* whether it keeps every limit to the last unit is what otg-many counts */
    (void)motion_otg_check(&scaled.move[0], &plan, &field);
    fuzz_claim(isfinite(otg_plan_seconds(&plan, scaled.time)),
               "a plan has a duration");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct otg_header header;
    char *text = malloc(size + 1), *rest = NULL;

    fuzz_claim(text != NULL, "there is room for the text");
    memcpy(text, data, size);
    text[size] = 0;
    const char *line = strtok_r(text, "\n", &rest);
    if (line != NULL && otg_header_parse(line, &header) == NULL)
        while ((line = strtok_r(NULL, "\n", &rest)) != NULL)
            fuzz_otg_row(&header, line);
    free(text);
    return 0;
}

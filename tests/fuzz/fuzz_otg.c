/* tests/fuzz/fuzz_otg.c - planning problems from CSV: a header line, and rows
 * that are solved when they are taken, each on its own; and the first ones as
 * one motion, through their goals and from one to the next. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/exchange/otg_motion.h"
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
    otg_rows_scale(header, &row, 1, &scaled);
    if (motion_otg_make(&scaled.move[0], &plan, &field) < 0)
        return;
    /* whether it keeps every limit to the last unit is what otg-many counts */
    (void)motion_otg_check(&scaled.move[0], &plan, &field);
    fuzz_claim(
        isfinite((double)ldexpl(
            (long double)plan.dur_ns_q12 / OTG_TICKS_PER_SECOND, scaled.time)),
        "a plan has a duration");
}

#define LEGS 4

static void fuzz_otg_motion(struct otg_header *header,
                            const struct otg_row row[], int count)
{
    struct otg_motion motion;

    otg_motion_init(&motion, header, MOTION_SYNC_TIME, count);
    for (int i = 0; i < count; i++)
        motion.leg[i].row = row[i];
    otg_motion_make(&motion);
    for (int axis = 0; axis < header->axes && motion.err == 0; axis++) {
        const struct otg_point end =
            otg_piece_end(otg_motion_last(&motion, axis));
        fuzz_claim(isfinite(end.t) && isfinite(end.p),
                   "a motion ends somewhere");
    }
    otg_motion_free(&motion);
}

/* As the command reads them: one that is wrong is the last. */
static void fuzz_otg_rows(const char *header_line, const char *lines,
                          enum otg_table table)
{
    static struct otg_header header;
    static struct otg_row row[LEGS];
    char *text = strdup(lines), *rest = NULL;
    int count = 0, column;

    fuzz_claim(text != NULL, "there is room for the text");
    const char *line = strtok_r(text, "\n", &rest);
    const bool good = otg_header_parse(header_line, &header) == NULL;
    header.table = table;
    for (; good && !header.velocity && line != NULL && count < LEGS;
         line = strtok_r(NULL, "\n", &rest)) {
        if (otg_row_parse(&header, line, &row[count], &column) != NULL ||
            otg_row_follow(&header, line, count > 0 ? &row[count - 1] : NULL,
                           &row[count], &column) != NULL)
            break;
        count++;
    }
    if (count > 0)
        fuzz_otg_motion(&header, row, count);
    free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct otg_header header;
    char *text = malloc(size + 1), *rest = NULL;

    fuzz_claim(text != NULL, "there is room for the text");
    memcpy(text, data, size);
    text[size] = 0;
    const char *line = strtok_r(text, "\n", &rest);
    if (line != NULL && rest != NULL) {
        fuzz_otg_rows(line, rest, OTG_TABLE_THROUGH);
        fuzz_otg_rows(line, rest, OTG_TABLE_REPLAN);
    }
    if (line != NULL && otg_header_parse(line, &header) == NULL)
        while ((line = strtok_r(NULL, "\n", &rest)) != NULL)
            fuzz_otg_row(&header, line);
    free(text);
    return 0;
}

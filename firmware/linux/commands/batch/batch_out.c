/* firmware/linux/commands/batch/batch_out.c - see batch_out.h. */
#include "firmware/linux/commands/batch/batch_out.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/host/plot/plot_spread.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"

#define OUT_RESULTS_MAX 12 /* rows of the picture: axes */
#define OUT_CAUSES_MAX  6  /* columns: what was varied */
#define OUT_DONE        "done"

struct out {
    const struct options *options;
    struct batch_table *table;
    double *value; /* by column and run, of columns that are drawn or told */
};

static double out_value(const struct batch_table *table, int column, size_t row)
{
    const double value = strtod(table->row[row].cell[column], NULL);
    return isfinite(value) ? value : 0;
}

static int out_compare(const void *a, const void *b)
{
    const double one = *(const double *)a, other = *(const double *)b;
    return one < other ? -1 : one > other;
}

/* --- files --- */

static int out_file(const char *path, const struct batch_table *table,
                    int (*write)(const struct batch_table *, FILE *))
{
    struct output *const output = memory_new(1, sizeof *output);
    int err = output_open(output, path);
    if (err == 0 && write(table, output->file) < 0) {
        error_say("slew batch: %s: is too large", path);
        output_abandon(output);
        err = -1;
    } else if (err == 0) {
        err = output_commit(output);
    }
    memory_free(output);
    return err;
}

static int out_csv(const struct batch_table *table, FILE *file)
{
    batch_table_write(table, file);
    return 0;
}

/* --- the picture --- */

static double *out_column(const struct batch_table *table, int column)
{
    double *const value = memory_new(table->rows, sizeof *value);
    for (size_t i = 0; i < table->rows; i++)
        value[i] = out_value(table, column, i);
    return value;
}

/* A result: "pan.following_deg". */
static bool out_is_following(const char *name)
{
    const char *const dot = strrchr(name, '.');
    return dot != NULL && strncmp(dot, ".following_", 11) == 0;
}

static unsigned out_columns(const struct batch_table *table, int from, int to,
                            bool results, unsigned most,
                            struct plot_spread_column list[])
{
    unsigned count = 0;
    for (int i = from; i < to && count < most; i++)
        if (!results || out_is_following(table->name[i]))
            list[count++] =
                (struct plot_spread_column){ .name = table->name[i],
                                             .value = out_column(table, i) };
    return count;
}

static void out_columns_free(const struct plot_spread_column list[],
                             unsigned count)
{
    for (unsigned i = 0; i < count; i++)
        memory_free((double *)list[i].value);
}

static int out_picture(const char *path, const struct batch_table *table,
                       const char *title, const char *subtitle)
{
    struct plot_spread_column result[OUT_RESULTS_MAX], cause[OUT_CAUSES_MAX];
    const int end = batch_table_column(table, "end");
    bool *const is_bad = memory_new(table->rows, sizeof *is_bad);
    struct plot_spread spread = { .title = title,
                                  .subtitle = subtitle,
                                  .result = result,
                                  .cause = cause,
                                  .runs = (unsigned)table->rows,
                                  .is_bad = is_bad };
    struct messages messages = { .text = NULL };
    struct output *const output = memory_new(1, sizeof *output);
    int err = output_open(output, path);

    for (size_t i = 0; i < table->rows; i++)
        is_bad[i] = strcmp(table->row[i].cell[end], OUT_DONE) != 0;
    spread.causes = out_columns(table, 3, end, false, OUT_CAUSES_MAX, cause);
    spread.results = out_columns(table, end + 3, (int)table->columns, true,
                                 OUT_RESULTS_MAX, result);
    if (err == 0) {
        const int drawn =
            plot_spread_write(&spread, (enum plot_format)plot_format_of(path),
                              output->file, &messages);
        error_tell(&messages);
        if (drawn == 0) {
            err = output_commit(output);
        } else {
            output_abandon(output);
            err = -1;
        }
    }
    out_columns_free(result, spread.results);
    out_columns_free(cause, spread.causes);
    memory_free(output);
    memory_free(is_bad);
    return err;
}

/* --- in words --- */

/* Of sorted values: the smallest that a share of them does not exceed. */
static double out_quantile(const double sorted[], size_t count, double share)
{
    const size_t at = (size_t)(share * (double)(count - 1) + 0.5);
    return sorted[at];
}

static size_t out_bad(const struct batch_table *table)
{
    const int end = batch_table_column(table, "end");
    size_t bad = 0;
    for (size_t i = 0; i < table->rows; i++)
        bad += strcmp(table->row[i].cell[end], OUT_DONE) != 0;
    return bad;
}

static void out_say(const struct options *options,
                    const struct batch_table *table, uint64_t missing)
{
    static const char *const head[] = { "<result", ">median",  ">90 %",
                                        ">99 %",   ">largest", ">in run" };
    struct table text;

    printf("%zu runs, %zu of them not done\n", table->rows, out_bad(table));
    table_init(&text, 6, head);
    for (uint32_t i = 3; i < table->columns; i++) {
        if (!out_is_following(table->name[i]))
            continue;
        double *const value = out_column(table, (int)i);
        size_t worst = 0;
        for (size_t k = 1; k < table->rows; k++)
            if (value[k] > value[worst])
                worst = k;
        const uint64_t run = table->row[worst].run;
        qsort(value, table->rows, sizeof *value, out_compare);
        table_cell(&text, "%s", table->name[i]);
        table_cell(&text, "%.4g", out_quantile(value, table->rows, 0.5));
        table_cell(&text, "%.4g", out_quantile(value, table->rows, 0.9));
        table_cell(&text, "%.4g", out_quantile(value, table->rows, 0.99));
        table_cell(&text, "%.4g", value[table->rows - 1]);
        table_cell(&text, "%" PRIu64, run);
        memory_free(value);
    }
    table_print(&text, stdout);
    table_free(&text);
    if (missing > 0 && options->merge)
        printf("%" PRIu64 " %s of the batch %s missing\n", missing,
               number_word(missing, "run", "runs"),
               number_word(missing, "is", "are"));
    printf("%s\n", options->out);
}

static void out_json(const struct options *options,
                     const struct batch_table *table, uint64_t missing)
{
    cJSON *const report = cJSON_CreateObject();
    cJSON_AddNumberToObject(report, "runs", (double)table->rows);
    cJSON_AddNumberToObject(report, "not_done", (double)out_bad(table));
    cJSON_AddNumberToObject(report, "missing", (double)missing);
    cJSON_AddStringToObject(report, "file", options->out);
    cJSON *const results = cJSON_AddObjectToObject(report, "results");
    for (uint32_t i = 3; i < table->columns; i++) {
        if (!out_is_following(table->name[i]))
            continue;
        double *const value = out_column(table, (int)i);
        cJSON *const of = cJSON_AddObjectToObject(results, table->name[i]);
        qsort(value, table->rows, sizeof *value, out_compare);
        cJSON_AddNumberToObject(of, "median",
                                out_quantile(value, table->rows, 0.5));
        cJSON_AddNumberToObject(of, "p90",
                                out_quantile(value, table->rows, 0.9));
        cJSON_AddNumberToObject(of, "p99",
                                out_quantile(value, table->rows, 0.99));
        cJSON_AddNumberToObject(of, "max", value[table->rows - 1]);
        memory_free(value);
    }
    json_report(report, missing == 0 || !options->merge);
}

enum status batch_out_try(const struct options *options)
{
    const char *const path[] = { options->out, options->parquet,
                                 options->plot };
    struct output *const output = memory_new(1, sizeof *output);
    enum status status = STATUS_OK;

    for (unsigned i = 0; i < 3 && status == STATUS_OK; i++) {
        if (path[i] == NULL)
            continue;
        if (output_open(output, path[i]) < 0)
            status = STATUS_SYSTEM;
        output_abandon(output);
    }
    memory_free(output);
    return status;
}

enum status batch_out(const struct options *options, struct batch_table *table,
                      const char *title)
{
    const int64_t twice = batch_table_sort(table);
    char subtitle[96];

    if (twice >= 0) {
        error_say("slew batch: run %" PRId64 " is there twice, expected every "
                  "run once",
                  twice);
        return STATUS_INPUT;
    }
    if (table->rows == 0 || batch_table_column(table, "end") < 3 ||
        batch_table_column(table, "end") + 3 > (int)table->columns) {
        error_say("slew batch: there are no runs, expected one at least");
        return STATUS_INPUT;
    }
    const uint64_t all = strtoull(table->row[0].cell[2], NULL, 10);
    const uint64_t missing = all > table->rows ? all - table->rows : 0;
    snprintf(subtitle, sizeof subtitle,
             "%zu runs of %" PRIu64 ", %zu of them not done (red)", table->rows,
             all, out_bad(table));
    if (out_file(options->out, table, out_csv) < 0 ||
        (options->parquet != NULL &&
         out_file(options->parquet, table, batch_table_parquet) < 0) ||
        (options->plot != NULL &&
         out_picture(options->plot, table, title[0] != '\0' ? title : "Batch",
                     subtitle) < 0))
        return STATUS_SYSTEM;
    if (options->json)
        out_json(options, table, missing);
    else
        out_say(options, table, missing);
    return missing > 0 && options->merge ? STATUS_REFUSED : STATUS_OK;
}

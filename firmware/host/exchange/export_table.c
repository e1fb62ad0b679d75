/* firmware/host/exchange/export_table.c - a row of positions per frame; see
 * import.h.
 *
 * Ten decimals in the axes' own units, so that a position is read back to the
 * bit.  The last row is the first frame at or after the end of the move. */
#include <inttypes.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/exchange/import.h"
#include "motion/core/fixed.h"

/* What stands between and around the numbers. */
struct export_style {
    const char *end; /* of lines */
    const char *between;
    int width;
    bool frame; /* a first column */
};

static int export_fail(char message[YAML_MESSAGE_MAX], const char *what)
{
    snprintf(message, YAML_MESSAGE_MAX, "%s", what);
    return -1;
}

/* Rows, or -1 with the sentence. */
static int64_t export_rows(const struct job *job, const struct units_fps *fps,
                           char message[YAML_MESSAGE_MAX])
{
    int64_t frame, t_ns_q12;
    if (fps->den == 0)
        return export_fail(message, "no frame rate, expected --fps");
    frame = import_frame_near(fps, job->end_ns_q12);
    t_ns_q12 = frame < 0 ? -1 : import_frame_ns_q12(fps, frame);
    if (t_ns_q12 < 0 || frame >= PLAN_KEYS_MAX)
        return export_fail(message, "the move has more than 1000000 frames");
    return frame + 1 + (t_ns_q12 < job->end_ns_q12);
}

#define EXPORT_TELL_EVERY 1024 /* rows: some 10 ms */

static void export_tell(const struct job *job, int64_t row, int64_t rows)
{
    if (row % EXPORT_TELL_EVERY == 0)
        plan_progress_tell(job->progress, "writing", "rows", row, rows);
}

static void export_rows_write(const struct job *job,
                              const struct units_fps *fps, int64_t rows,
                              const struct export_style *style, FILE *file)
{
    struct motion_cursor *cursor =
        memory_new(job->move.axis_count, sizeof *cursor);
    for (int64_t k = 0; k < rows; k++) {
        export_tell(job, k, rows);
        int64_t t_ns_q12 = import_frame_ns_q12(fps, k);
        const char *between = "";
        if (style->frame) {
            fprintf(file, "%5" PRId64, k);
            between = style->between;
        }
        for (unsigned i = 0; i < job->move.axis_count; i++) {
            struct motion_sample sample;
            char text[NUMBER_MAX];
            motion_track_sample(&job->track[i], &cursor[i], t_ns_q12, &sample);
            number_fixed(text, sample.pos_q32, 32, 10);
            fprintf(file, "%s%*s", between, style->width, text);
            between = style->between;
        }
        fputs(style->end, file);
    }
    memory_free(cursor);
}

static void export_names(const struct job *job, FILE *file, const char *between)
{
    for (unsigned i = 0; i < job->move.axis_count; i++)
        fprintf(file, "%s%s", i > 0 ? between : "", job->move.axis[i].name);
}

/* In a row of names a time has a name as an axis has. */
static int export_check_names(const struct job *job, const char *format,
                              char message[YAML_MESSAGE_MAX])
{
    for (unsigned i = 0; i < job->move.axis_count; i++)
        if (import_is_time(job->move.axis[i].name)) {
            snprintf(message, YAML_MESSAGE_MAX,
                     "axis %s has the name that a column of times has in %s, "
                     "expected another format such as csv, or another name",
                     job->move.axis[i].name, format);
            return -1;
        }
    return 0;
}

int export_kuper(const struct job *job, const struct units_fps *fps, FILE *file,
                 char message[YAML_MESSAGE_MAX])
{
    const struct export_style style = { "\r\n", " ", 0, false };
    int64_t rows = export_rows(job, fps, message);
    if (rows < 0 || export_check_names(job, "Kuper", message) < 0)
        return -1;
    fputs("Axes = ", file);
    export_names(job, file, ", ");
    fputs("\r\n", file);
    export_rows_write(job, fps, rows, &style, file);
    return 0;
}

int export_flair(const struct job *job, const struct units_fps *fps, FILE *file,
                 char message[YAML_MESSAGE_MAX])
{
    const struct export_style style = { "\n", " ", 18, true };
    int64_t rows = export_rows(job, fps, message);
    if (rows < 0 || export_check_names(job, "Flair", message) < 0)
        return -1;
    fputs("# Written by slew export\nDATA_TYPE  AXES_RAW\n", file);
    fprintf(file, "POINTS %" PRId64 "  SPEED %" PRIu64, rows, fps->num);
    if (fps->den != 1)
        fprintf(file, "/%" PRIu64, fps->den);
    fputs("\nFRAME  ", file);
    export_names(job, file, "  ");
    fputc('\n', file);
    export_rows_write(job, fps, rows, &style, file);
    return 0;
}

int export_raw(const struct job *job, const struct units_fps *fps, FILE *file,
               char message[YAML_MESSAGE_MAX])
{
    const struct export_style style = { "\n", "    ", 0, false };
    int64_t rows = export_rows(job, fps, message);
    if (rows < 0)
        return -1;
    export_rows_write(job, fps, rows, &style, file);
    return 0;
}

/* --- CSV: everything that is known, exactly --- */

static void export_csv_head(const struct job *job, FILE *file)
{
    fputs("frame", file);
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        const char *name = job->move.axis[i].name;
        const char *unit = units_axis_text(job_rig_axis(job, i)->unit);
        fprintf(file, ",%s_%s,%s_%s_s,%s_%s_s2", name, unit, name, unit, name,
                unit);
    }
    fputc('\n', file);
}

static void export_csv_value(FILE *file, int64_t value_q32)
{
    char text[NUMBER_MAX];
    number_exact(text, value_q32, 32);
    fprintf(file, ",%s", text);
}

int export_csv(const struct job *job, const struct units_fps *fps, FILE *file,
               char message[YAML_MESSAGE_MAX])
{
    int64_t rows = export_rows(job, fps, message);
    if (rows < 0)
        return -1;
    struct motion_cursor *cursor =
        memory_new(job->move.axis_count, sizeof *cursor);
    export_csv_head(job, file);
    for (int64_t k = 0; k < rows; k++) {
        export_tell(job, k, rows);
        fprintf(file, "%" PRId64, k);
        for (unsigned i = 0; i < job->move.axis_count; i++) {
            struct motion_sample sample;
            motion_track_sample(&job->track[i], &cursor[i],
                                import_frame_ns_q12(fps, k), &sample);
            export_csv_value(file, sample.pos_q32);
            export_csv_value(file, sample.vel_q32);
            export_csv_value(file, sample.acc_q32);
        }
        fputc('\n', file);
    }
    memory_free(cursor);
    return 0;
}

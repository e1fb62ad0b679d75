/* firmware/linux/player/progress.c - see progress.h. */
#include "firmware/linux/player/progress.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "motion/core/clock_warp.h"
#include "motion/core/fixed.h"

#define PROGRESS_LINE_MAX  160
#define PROGRESS_PERIOD_NS INT64_C(100000000)
#define PROGRESS_NOTE_NS   INT64_C(1000000000)
#define PROGRESS_WIDTH     40
#define PROGRESS_SKIP      16 /* rows between looks at the clock */

void progress_init(struct progress *progress, FILE *file, const struct rig *rig,
                   int64_t total_ns_q12)
{
    *progress = (struct progress){
        .file = file,
        .terminal = isatty(fileno(file)) == 1,
        .total_ns = total_ns_q12 / MOTION_FIXED_NS_Q12,
        .phase = -1,
    };
    row_notes_init(&progress->notes, rig, PROGRESS_NOTE_NS);
}

static int64_t progress_now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

static int progress_share(int64_t path_ns, int64_t total_ns, int parts)
{
    if (total_ns <= 0 || path_ns >= total_ns)
        return parts;
    return path_ns <= 0 ? 0 : (int)((double)path_ns / (double)total_ns * parts);
}

int progress_percent(int64_t rate_q30)
{
    return (int)((rate_q30 * 100 + MOTION_CLOCK_WARP_ONE_Q30 / 2) /
                 MOTION_CLOCK_WARP_ONE_Q30);
}

/* "12.6 s left", or what stands instead when nothing moves. */
static void progress_left(char text[32], int64_t left_ns, int64_t rate_q30)
{
    if (left_ns <= 0) {
        snprintf(text, 32, rate_q30 < 0 ? "at the start" : "at the end");
        return;
    }
    if (rate_q30 == 0) {
        snprintf(text, 32, "holding");
        return;
    }
    double left_s = (double)left_ns / 1e9 * (double)MOTION_CLOCK_WARP_ONE_Q30 /
                    fabs((double)rate_q30);
    int length;
    if (left_s < 60)
        length = snprintf(text, 32, "%.1f s left", left_s);
    else if (left_s < 360000)
        length = snprintf(text, 32, "%d:%02d:%02d left", (int)left_s / 3600,
                          (int)left_s / 60 % 60, (int)left_s % 60);
    else
        length = snprintf(text, 32, "days left");
    const int percent = progress_percent(rate_q30 < 0 ? -rate_q30 : rate_q30);
    if (percent != 100)
        length +=
            snprintf(text + length, 32 - (size_t)length, " at %d %%", percent);
    if (rate_q30 < 0)
        snprintf(text + length, 32 - (size_t)length, ", back");
}

/* "moving    [#######-------]  47 %   12.6 s left" for a time on the path and
 * a rate, negative in reverse; without a line end. */
static void progress_line(char line[PROGRESS_LINE_MAX], const char *what,
                          int64_t path_ns, int64_t total_ns, int64_t rate_q30)
{
    char bar[PROGRESS_WIDTH + 1], left[32];
    int full = progress_share(path_ns, total_ns, PROGRESS_WIDTH);
    memset(bar, '#', (size_t)full);
    memset(bar + full, '-', (size_t)(PROGRESS_WIDTH - full));
    bar[PROGRESS_WIDTH] = 0;
    progress_left(left, rate_q30 < 0 ? path_ns : total_ns - path_ns, rate_q30);
    snprintf(line, PROGRESS_LINE_MAX, "%-18s [%s] %3d %%  %s", what, bar,
             progress_share(path_ns, total_ns, 100), left);
}

static int64_t progress_path_ns(const struct telemetry_row *row)
{
    return row->rate.s_ns_q12 / MOTION_FIXED_NS_Q12;
}

/* What it does: "moving", "moving, 2 of 5", "moving, time 3" without an end. */
static void progress_what(const struct telemetry_row *row, char text[48])
{
    const char *phase = telemetry_phase_text(row->phase);
    if (row->waits_for > 0)
        snprintf(text, 48, "frame %u waits", row->waits_for);
    else if (row->phase != TELEMETRY_MOVE || row->times == 1)
        snprintf(text, 48, "%s", phase);
    else if (row->times == 0)
        snprintf(text, 48, "%s, time %" PRId64, phase, row->played + 1);
    else /* at its end the last of them has been played, and it is no further */
        snprintf(text, 48, "%s, %" PRId64 " of %" PRId64, phase,
                 row->played < row->times ? row->played + 1 : row->times,
                 row->times);
}

/* Time left is known while the move runs. */
static void progress_text(const struct progress *progress,
                          const struct telemetry_row *row,
                          char line[PROGRESS_LINE_MAX])
{
    char what[48];
    progress_what(row, what);
    if (row->phase == TELEMETRY_MOVE)
        progress_line(line, what, progress_path_ns(row), progress->total_ns,
                      row->rate.rate_q30);
    else
        snprintf(line, PROGRESS_LINE_MAX, "%s", what);
}

static void progress_redraw(struct progress *progress,
                            const struct telemetry_row *row)
{
    char line[PROGRESS_LINE_MAX];
    progress_text(progress, row, line);
    fprintf(progress->file, "\r%s", line);
    if (progress->typed != NULL)
        fprintf(progress->file, "  %s", progress->typed);
    fputs("\033[K", progress->file);
    fflush(progress->file);
    progress->drawn = true;
}

static void progress_terminal(struct progress *progress,
                              const struct telemetry_row *row)
{
    bool other = progress->phase != (int)row->phase;
    progress->phase = (int)row->phase;
    if (!other && ++progress->skipped < PROGRESS_SKIP)
        return;
    progress->skipped = 0;
    int64_t now_ns = progress_now_ns();
    if (!other && now_ns < progress->due_ns)
        return;
    progress->due_ns = now_ns + PROGRESS_PERIOD_NS;
    progress_redraw(progress, row);
}

static void progress_plain(struct progress *progress,
                           const struct telemetry_row *row)
{
    int quarter =
        row->phase == TELEMETRY_MOVE
            ? progress_share(progress_path_ns(row), progress->total_ns, 4)
            : 0;
    if (progress->phase == (int)row->phase && quarter <= progress->quarter)
        return;
    progress->phase = (int)row->phase;
    progress->quarter = quarter;
    char line[PROGRESS_LINE_MAX];
    progress_text(progress, row, line);
    fprintf(progress->file, "%s\n", line);
    fflush(progress->file);
}

/* Where the line was, which is drawn anew below. */
static void progress_warn(void *context, const struct telemetry_row *row,
                          const char *text)
{
    struct progress *progress = context;
    (void)row;
    fprintf(progress->file, "%swarning: %s\n",
            progress->drawn ? "\r\033[K" : "", text);
    fflush(progress->file);
    progress->drawn = false;
    progress->due_ns = 0;
}

void progress_take(struct progress *progress, const struct telemetry_row *row)
{
    row_notes_take(&progress->notes, row, progress_warn, progress);
    if (progress->terminal)
        progress_terminal(progress, row);
    else
        progress_plain(progress, row);
}

void progress_end(struct progress *progress)
{
    if (progress->drawn)
        fputs("\r\033[K", progress->file);
    progress->drawn = false;
    row_notes_free(&progress->notes);
}

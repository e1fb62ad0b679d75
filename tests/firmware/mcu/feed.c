/* tests/firmware/mcu/feed.c - see feed.h. */
#include "tests/firmware/mcu/feed.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/rig/modbus_budget.h"
#include "firmware/host/rig/modbus_stream.h"
#include "firmware/host/track/compiled.h"
#include "firmware/linux/base/disk.h"
#include "hal/mcu/map.h"
#include "hal/support/crc32.h"

#define FEED_LINE 16384

static const struct track_file_axis *feed_axis(const struct feed *feed,
                                               unsigned axis)
{
    return &feed->job.compiled->file.axis[axis];
}

const char *feed_axis_name(const struct feed *feed, unsigned axis)
{
    return feed_axis(feed, axis)->name;
}

/* --- what is expected ----------------------------------------------------- */

static int64_t feed_q32(const char *text)
{
    return (int64_t)llroundl(strtold(text, NULL) * 4294967296.0L);
}

/* Which columns are path_ns and the axes' demands. */
static int feed_columns(const struct feed *feed, char *line,
                        int column[1 + MCU_AXES_MAX])
{
    int at = 0, found = 0;

    for (char *name = strtok(line, ",\n"); name != NULL;
         name = strtok(NULL, ",\n"), at++) {
        if (strcmp(name, "path_ns") == 0)
            column[0] = at, found++;
        for (unsigned i = 0; i < feed->axes; i++) {
            char want[128];
            snprintf(want, sizeof want, "%s.demand_%s",
                     feed_axis(feed, i)->name, feed_axis(feed, i)->unit);
            if (strcmp(name, want) == 0)
                column[1 + i] = at, found++;
        }
    }
    return found == 1 + (int)feed->axes ? 0 : -1;
}

static void feed_add_row(struct feed *feed, char *line,
                         const int column[1 + MCU_AXES_MAX])
{
    struct feed_rows *rows = &feed->want;
    int at = 0;

    if (rows->count == rows->capacity) {
        rows->capacity = rows->capacity * 2 + 1024;
        rows->row = realloc(rows->row, rows->capacity * sizeof *rows->row);
        if (rows->row == NULL)
            abort();
    }
    for (char *value = strtok(line, ",\n"); value != NULL;
         value = strtok(NULL, ",\n"), at++) {
        if (at == column[0])
            rows->row[rows->count][0] = strtoll(value, NULL, 10);
        for (unsigned i = 0; i < feed->axes; i++)
            if (at == column[1 + i])
                rows->row[rows->count][1 + i] = feed_q32(value);
    }
    rows->count++;
}

static int feed_read_rows(struct feed *feed, const char *path)
{
    static char line[FEED_LINE];
    int column[1 + MCU_AXES_MAX] = { 0 };
    FILE *file = fopen(path, "r");

    if (file == NULL || fgets(line, sizeof line, file) == NULL ||
        feed_columns(feed, line, column) < 0) {
        fprintf(stderr, "%s: not the telemetry of this move\n", path);
        if (file != NULL)
            fclose(file);
        return -1;
    }
    while (fgets(line, sizeof line, file) != NULL)
        if (strstr(line, ",move,") != NULL)
            feed_add_row(feed, line, column);
    fclose(file);
    return 0;
}

uint32_t feed_crc(const struct feed *feed)
{
    const size_t size = (1 + feed->axes) * sizeof feed->want.row[0][0];
    uint32_t crc = 0;

    for (uint32_t i = 0; i < feed->want.count; i++)
        crc = crc32_of(crc, feed->want.row[i], size);
    return crc;
}

/* --- pieces --------------------------------------------------------------- */

unsigned feed_put_setup(const struct feed *feed, unsigned axis,
                        uint16_t piece[MCU_PIECE_MAX])
{
    const struct rig_axis *own = job_rig_axis(&feed->job, axis);
    const struct motion_track *track =
        compiled_look(feed->job.compiled, axis, 0);
    const struct mcu_setup setup = {
        .pos_min_q32 = own->limit.pos_min_q32,
        .pos_max_q32 = own->limit.pos_max_q32,
        .vel_q32 = own->limit.vel_q32,
        .acc_q32 = own->limit.acc_q32,
        .jerk_q32 = own->limit.jerk_q32,
        .stop_vel_q32 = own->limit.vel_q32,
        .stop_acc_q32 = own->stop_acc_q32,
        .stop_jerk_q32 = own->stop_jerk_q32,
        .following_floor_q32 = own->following_floor_q32,
        .following_k_ns = own->following_k_ns,
        .pos_q32 =
            track->count > 0 ? track->segment[0].pos_q32 : track->end.pos_q32,
    };

    return mcu_piece_put_setup(piece, feed->move_id, axis, feed->axes, &setup,
                               feed->drive_crc[axis]);
}

/* --- servo drives --------------------------------------------------------- */

static unsigned feed_rig_index(const struct feed *feed, unsigned axis)
{
    return (unsigned)(job_rig_axis(&feed->job, axis) - feed->job.rig.axis);
}

static unsigned feed_depth(const struct rig *rig, unsigned bus)
{
    const int64_t latency_ns = modbus_budget_latency_ns(rig, bus);
    const int64_t more =
        latency_ns > 0 ? rig->period_ns * 3 / 2 / latency_ns : 0;

    return more + 2 < HAL_MODBUS_MAILBOX ? (unsigned)more + 2
                                         : HAL_MODBUS_MAILBOX;
}

int feed_use_drives(struct feed *feed)
{
    const struct rig *rig = &feed->job.rig;
    const struct rig_axis *first = job_rig_axis(&feed->job, 0);

    feed->map = rig->map[first->map];
    feed->map.line = modbus_budget_line(rig, first->bus);
    feed->map.timeout_ns = modbus_budget_timeout_ns(rig, first->bus);
    for (unsigned i = 0; i < feed->axes; i++) {
        const struct rig_axis *axis = job_rig_axis(&feed->job, i);
        struct mcu_servo *servo = &feed->servo[i];

        if (axis->kind != RIG_MODBUS || axis->bus != first->bus ||
            axis->map != first->map || axis->point_to_point ||
            axis->parameter_count > MCU_SERVO_PARAMETERS) {
            fprintf(stderr, "%s: not streamed by the line and map of %s\n",
                    axis->name, first->name);
            return -1;
        }
        modbus_stream_config(rig, feed_rig_index(feed, i), &servo->config);
        for (unsigned k = 0; k < axis->parameter_count; k++)
            servo->parameter[k] = axis->item[k];
        servo->depth = feed_depth(rig, axis->bus);
        servo->feedback_max_age_ns = modbus_budget_age_ns(rig, axis->bus);
        servo->map_crc = mcu_map_crc(&feed->map);
    }
    return 0;
}

int feed_put_map(const struct feed *feed, unsigned *from,
                 uint16_t piece[MCU_PIECE_MAX])
{
    for (unsigned count; *from < MCU_MAP_VALUES; *from += MCU_PIECE_VALUES) {
        const unsigned length =
            mcu_piece_put_map(piece, feed->move_id, *from, &feed->map, &count);
        if (count == 0)
            continue;
        *from += MCU_PIECE_VALUES;
        return (int)length;
    }
    return 0;
}

unsigned feed_put_drive(struct feed *feed, unsigned axis,
                        uint16_t piece[MCU_PIECE_MAX])
{
    const unsigned length =
        mcu_piece_put_drive(piece, feed->move_id, axis, &feed->servo[axis]);

    feed->drive_crc[axis] = mcu_piece_own_crc(piece, length);
    return length;
}

/* --- moves ---------------------------------------------------------------- */

unsigned feed_put_head(const struct feed *feed, unsigned axis,
                       uint16_t piece[MCU_PIECE_MAX])
{
    const struct track_file_axis *own = feed_axis(feed, axis);
    const struct mcu_head head = { .end_ns_q12 = own->end_ns_q12,
                                   .end = own->end,
                                   .end_frac = own->end_frac,
                                   .outline =
                                       feed->job.compiled->outline[axis] };

    return mcu_piece_put_head(piece, feed->move_id, axis, &head);
}

int feed_put_next(const struct feed *feed, unsigned axis, unsigned most,
                  uint16_t piece[MCU_PIECE_MAX], uint32_t *count)
{
    struct motion_segment segment[TRACK_FILE_BLOCK];
    char message[TRACK_FILE_MESSAGE_MAX];
    const uint32_t at = feed->sent[axis];
    const uint32_t in_block = at % TRACK_FILE_BLOCK;

    if (at == feed_axis(feed, axis)->segments)
        return 0;
    if (track_file_block(&feed->job.compiled->file, axis, at / TRACK_FILE_BLOCK,
                         segment, count, message) < 0) {
        fprintf(stderr, "%s\n", message);
        return -1;
    }
    *count -= in_block;
    *count = *count < most ? *count : most;
    return (int)mcu_piece_put_track(piece, feed->move_id, axis, at,
                                    segment + in_block, *count);
}

/* --- */

void feed_close(struct feed *feed)
{
    job_free(&feed->job);
    free(feed->want.row);
}

int feed_open(struct feed *feed, const char *rig, const char *move,
              const char *telemetry)
{
    static const unsigned char seed = 0;
    uint32_t crc = crc32_of(0, &seed, 1);

    if (job_open(&feed->job, &disk_files, rig, move, true, NULL) != STATUS_OK ||
        feed->job.compiled == NULL) {
        fprintf(stderr, "%s: not a compiled move of %s\n", move, rig);
        return -1;
    }
    feed->axes = feed->job.compiled->file.axis_count;
    if (feed->axes > MCU_AXES_MAX) {
        fprintf(stderr, "%s: more than %d axes\n", move, MCU_AXES_MAX);
        return -1;
    }
    for (unsigned i = 0; i < feed->axes; i++)
        crc = crc32_of(crc, &feed_axis(feed, i)->end,
                       sizeof feed_axis(feed, i)->end);
    feed->move_id = crc | 1;
    return feed_read_rows(feed, telemetry);
}

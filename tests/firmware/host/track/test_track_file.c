/* tests/firmware/host/track/test_track_file.c - compiled moves: what is read is
 * what was planned, to the bit, through a small window; what is not whole is
 * refused. */
#define _XOPEN_SOURCE 700 /* mkstemp */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "firmware/host/track/compiled.h"
#include "firmware/host/track/track_file_bytes.h"
#include "firmware/linux/base/disk.h"
#include "hal/support/crc32.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define SEC  MOTION_FIXED_S_Q12
#define ONE  MOTION_FIXED_ONE_Q32
#define LONG 100000 /* segments */

static struct motion_segment storage[LONG];
static struct motion_track track[2];
static struct track_file file;
static char path[64];
static char message[TRACK_FILE_MESSAGE_MAX];

/* --- files ---------------------------------------------------------------- */

static int begin(void **state)
{
    (void)state;
    strcpy(path, "/tmp/slew-track-XXXXXX");
    const int made = mkstemp(path);
    return made < 0 ? -1 : close(made);
}

static int end(void **state)
{
    (void)state;
    return unlink(path);
}

static void write_tracks(unsigned axes)
{
    static const char *const name[] = { "dolly", "pan" };
    static struct track_file_axis axis[2];
    FILE *out = fopen(path, "wb");

    memset(&file, 0, sizeof file);
    memset(axis, 0, sizeof axis);
    file.axis = axis;
    strcpy(file.title, "A move");
    file.axis_count = axes;
    for (unsigned i = 0; i < axes; i++) {
        strcpy(file.axis[i].name, name[i]);
        strcpy(file.axis[i].unit, i == 0 ? "mm" : "deg");
        file.axis[i].keys = track[i].count + 1;
    }
    assert_non_null(out);
    track_file_write(out, &file, track);
    assert_int_equal(ferror(out), 0);
    assert_int_equal(fclose(out), 0);
}

/* Any duration and distance that fits: also what rounds in odd ways. */
static void append_anything(struct motion_track *to, uint64_t *seed)
{
    const struct motion_state start = {
        .vel_q32 = check_random_in(seed, -ONE, ONE) * 1000,
        .acc_q32 = check_random_in(seed, -(INT64_C(1) << 46), INT64_C(1) << 46),
    };
    const unsigned far = (unsigned)check_random_in(seed, 1, 62);
    const struct motion_state stop = {
        .pos_q32 =
            check_random_in(seed, -((int64_t)1 << far), (int64_t)1 << far),
        .vel_q32 = check_random_in(seed, -ONE, ONE) * 1000,
        .acc_q32 = check_random_in(seed, -(INT64_C(1) << 46), INT64_C(1) << 46),
    };
    const int64_t dur =
        (int64_t)(check_random(seed) >> check_random_in(seed, 18, 60));
    int64_t coef[5];

    if (check_random(seed) & 1) {
        (void)motion_track_append_constraints(
            to, dur, (int)check_random_in(seed, 1, 3), &start,
            (int)check_random_in(seed, 1, 3), &stop);
        return;
    }
    for (int k = 0; k < 5; k++)
        coef[k] =
            check_random_in(seed, -((int64_t)1 << far), (int64_t)1 << far);
    (void)motion_track_append_poly(to, dur, (int)check_random_in(seed, 1, 5),
                                   coef, (unsigned)check_random_in(seed, 0, 31),
                                   stop.pos_q32, check_random(seed));
}

static void plan_anything(unsigned i, struct motion_segment *at, uint32_t most,
                          uint64_t seed)
{
    motion_track_init(&track[i], at, most, (int64_t)i * ONE);
    for (uint32_t tries = 0; tries < 8 * most && track[i].count < most; tries++)
        append_anything(&track[i], &seed);
}

static void assert_same_segment(const struct motion_segment *a,
                                const struct motion_segment *b)
{
    assert_int_equal(a->start_ns_q12, b->start_ns_q12);
    assert_int_equal(a->dur_ns_q12, b->dur_ns_q12);
    assert_int_equal(a->pos_q32, b->pos_q32);
    assert_memory_equal(a->coef, b->coef, sizeof a->coef);
    assert_int_equal(a->inverse, b->inverse);
    assert_int_equal(a->vel_scale_high, b->vel_scale_high);
    assert_int_equal(a->vel_scale_low, b->vel_scale_low);
    assert_int_equal(a->acc_scale_high, b->acc_scale_high);
    assert_int_equal(a->acc_scale_low, b->acc_scale_low);
    assert_int_equal(a->pos_scale, b->pos_scale);
    assert_int_equal(a->remainder, b->remainder);
    assert_int_equal(a->frac, b->frac);
    assert_int_equal(a->normalise, b->normalise);
    assert_int_equal(a->degree, b->degree);
    assert_int_equal(a->kind, b->kind);
    assert_int_equal(a->vel_shift, b->vel_shift);
    assert_int_equal(a->acc_shift, b->acc_shift);
    assert_int_equal(a->vel_factor, b->vel_factor);
}

/* --- segments ------------------------------------------------------------- */

/* 20,000 of every kind, the derived fields included. */
static void a_restored_segment_is_the_one_that_was_appended(void **state)
{
    uint32_t kinds[4] = { 0 };

    (void)state;
    plan_anything(0, storage, 20000, 5);
    assert_int_equal(track[0].count, 20000);
    for (uint32_t i = 0; i < track[0].count; i++) {
        const struct motion_segment *was = &storage[i];
        struct motion_segment is = {
            .start_ns_q12 = was->start_ns_q12,
            .dur_ns_q12 = was->dur_ns_q12,
            .pos_q32 = was->pos_q32,
            .remainder = was->remainder,
            .frac = was->frac,
        };
        memcpy(is.coef, was->coef, sizeof is.coef);
        assert_int_equal(motion_segment_restore(&is), MOTION_OK);
        assert_same_segment(&is, was);
        kinds[was->kind]++;
    }
    for (int i = 0; i < 4; i++)
        assert_true(kinds[i] > 100);
}

/* One field of a good segment changed. */
static const struct {
    const char *what;
    size_t offset, size;
    int64_t value;
} wrong[] = {
#define FIELD(name)                                                            \
    offsetof(struct motion_segment, name),                                     \
        sizeof(((struct motion_segment *)0)->name)
    { "no duration", FIELD(dur_ns_q12), 0 },
    { "a negative one", FIELD(dur_ns_q12), -1 },
    { "a long one", FIELD(dur_ns_q12), MOTION_TRACK_SEGMENT_MAX_NS_Q12 + 1 },
    { "before the start", FIELD(start_ns_q12), -1 },
    { "after all", FIELD(start_ns_q12), MOTION_TRACK_MAX_NS_Q12 },
    { "too far", FIELD(pos_q32), INT64_MAX },
    { "frac 32", FIELD(frac), 32 },
    { "frac 1", FIELD(frac), 1 },
    { "frac -15", FIELD(frac), -15 },
    { "c0 below 0", FIELD(coef[0]), -1 },
    { "c0 a whole step", FIELD(coef[0]), INT64_C(1) << 31 },
    { "c1 2^62", FIELD(coef[1]), INT64_C(1) << 62 },
    { "c1 the least", FIELD(coef[1]), INT64_MIN },
    { "sums over 2^62", FIELD(coef[5]), (INT64_C(1) << 62) - 1 },
    { "a remainder", FIELD(remainder), 1 },
};

static void what_was_never_appended_is_refused(void **state)
{
    const struct motion_state to = { .pos_q32 = 3 * ONE };

    (void)state;
    motion_track_init(&track[0], storage, LONG, ONE);
    assert_int_equal(motion_track_append_cubic(&track[0], SEC, ONE, &to), 0);
    for (size_t i = 0; i < ARRAY_LEN(wrong); i++) {
        struct motion_segment segment = storage[0];
        assert_int_equal(motion_segment_restore(&segment), MOTION_OK);
        memcpy((char *)&segment + wrong[i].offset, &wrong[i].value,
               wrong[i].size);
        if (motion_segment_restore(&segment) == MOTION_OK)
            fail_msg("%s is taken", wrong[i].what);
    }
}

/* --- windows -------------------------------------------------------------- */

static void assert_same_samples(struct compiled *compiled, int64_t t,
                                struct motion_cursor cursor[2])
{
    const struct motion_track *seen = compiled_look(compiled, 0, t);
    struct motion_sample want, got;
    struct motion_state want_state, got_state;

    assert_non_null(seen);
    motion_track_sample(&track[0], &cursor[0], t, &want);
    motion_track_sample(seen, &cursor[1], t, &got);
    if (memcmp(&want, &got, sizeof want) != 0)
        fail_msg("at %" PRId64 ": %" PRId64 " instead of %" PRId64, t,
                 got.pos_q32, want.pos_q32);
    motion_track_state(&track[0], t, &want_state);
    motion_track_state(seen, t, &got_state);
    assert_memory_equal(&want_state, &got_state, sizeof want_state);
}

static void plan_long(uint32_t segments)
{
    uint64_t seed = 9;

    motion_track_init(&track[0], storage, LONG, 0);
    for (uint32_t i = 0; i < segments; i++) {
        const struct motion_state to = {
            .pos_q32 = check_random_in(&seed, -100 * ONE, 100 * ONE),
            .vel_q32 = check_random_in(&seed, -9 * ONE, 9 * ONE),
        };
        assert_int_equal(motion_track_append_quintic(
                             &track[0],
                             SEC / 50 + check_random_in(&seed, 0, SEC / 20),
                             &track[0].end, &to),
                         MOTION_OK);
    }
}

/* Kilobytes that this process has held at most. */
static long peak_kb(void)
{
    char line[128];
    long kb = -1;
    FILE *status = fopen("/proc/self/status", "r");

    while (status != NULL && fgets(line, sizeof line, status) != NULL)
        (void)sscanf(line, "VmHWM: %ld kB", &kb);
    if (status != NULL)
        fclose(status);
    return kb;
}

/* 100,000 segments are 13 MB; a window that is played and one to look through
 * are 1.1 MB. */
static void a_long_track_plays_through_a_small_window(void **state)
{
    struct motion_cursor cursor[2] = { { 0 }, { 0 } };
    uint64_t seed = 3;

    (void)state;
    plan_long(LONG);
    write_tracks(1);
    const long before_kb = peak_kb();
    struct compiled *compiled = compiled_open(&disk_files, path, message);
    assert_non_null(compiled);
    assert_int_equal(compiled->outline[0].count, LONG);
    for (int64_t t = -SEC; t <= track[0].end_ns_q12 + SEC; t += SEC / 97)
        assert_same_samples(compiled, t, cursor);
    for (int64_t t = track[0].end_ns_q12; t > 4000 * SEC; t -= SEC / 3)
        assert_same_samples(compiled, t, cursor);
    for (int i = 0; i < 3000; i++)
        assert_same_samples(
            compiled, check_random_in(&seed, 0, track[0].end_ns_q12), cursor);
    assert_null(compiled_error(compiled));
    compiled_close(compiled);
    print_message("%d segments, %zu kB, played with %ld kB more\n", LONG,
                  sizeof storage / 1024, peak_kb() - before_kb);
#ifndef CHECK_SANITIZED /* which keeps what was freed */
    assert_in_range(peak_kb() - before_kb, 0, 2500);
#endif
}

static void the_outline_is_that_of_the_whole(void **state)
{

    (void)state;
    plan_anything(0, storage, 5000, 7);
    write_tracks(1);
    struct compiled *compiled = compiled_open(&disk_files, path, message);
    assert_non_null(compiled);
    for (int i = MOTION_POS; i <= MOTION_JERK; i++) {
        struct motion_extreme want, got;
        motion_track_extreme(&track[0], (enum motion_quantity)i, &want);
        motion_track_extreme(&compiled->track[0], (enum motion_quantity)i,
                             &got);
        assert_memory_equal(&want, &got, sizeof want);
    }
    compiled_close(compiled);
}

/* Played: filled and advanced in turn; never more than the compiled->track, never dry
 * where the file can be read, dry (and said so) where not. */
static void a_played_window_is_ahead_of_time(void **state)
{
    struct motion_cursor cursor[2] = { { 0 }, { 0 } };

    (void)state;
    plan_long(LONG / 8);
    write_tracks(1);
    struct compiled *compiled = compiled_open(&disk_files, path, message);
    assert_non_null(compiled);
    for (int64_t t = 0; t < track[0].end_ns_q12; t += 5 * SEC) {
        struct motion_sample want, got;
        compiled_advance(compiled, t);
        compiled_fill(compiled);
        assert_true(compiled->track[0].count <= TRACK_STREAM_PLAY);
        assert_true(motion_track_ahead(&compiled->track[0], t) > 60 * SEC);
        motion_track_sample(&track[0], &cursor[0], t, &want);
        motion_track_sample(&compiled->track[0], &cursor[1], t, &got);
        assert_memory_equal(&want, &got, sizeof want);
    }
    compiled_close(compiled);

    compiled = compiled_open(&disk_files, path, message);
    assert_non_null(compiled);
    assert_int_equal(truncate(path, 1000000), 0);
    int64_t t = 0;
    for (; motion_track_ahead(&compiled->track[0], t) > 0; t += SEC) {
        compiled_advance(compiled, t);
        compiled_fill(compiled);
    }
    assert_true(t < track[0].end_ns_q12);
    assert_non_null(strstr(compiled_error(compiled), "ends at byte"));
    struct motion_sample dry;
    motion_track_sample(&compiled->track[0], &cursor[1], t, &dry);
    assert_int_equal(dry.vel_q32, 0);
    assert_null(compiled_look(compiled, 0, t));
    compiled_close(compiled);
}

/* --- files that are not whole --------------------------------------------- */

static unsigned char bytes[1 << 20];
static size_t size;

static void take_bytes(void)
{
    FILE *in = fopen(path, "rb");
    size = fread(bytes, 1, sizeof bytes, in);
    fclose(in);
}

static void put_bytes(size_t count)
{
    FILE *out = fopen(path, "wb");
    assert_int_equal(fwrite(bytes, 1, count, out), count);
    fclose(out);
}

static void assert_refused(const char *what, size_t at)
{

    message[0] = 0;
    struct compiled *compiled = compiled_open(&disk_files, path, message);
    if (compiled != NULL || message[0] == 0 || strchr(message, '\n') != NULL)
        fail_msg("%s at %zu: \"%s\"", what, at, message);
}

static void write_small(void)
{
    plan_anything(0, storage, 35, 1);
    plan_anything(1, storage + 35, 7, 2);
    write_tracks(2);
    take_bytes();
}

static void a_cut_file_is_refused(void **state)
{
    (void)state;
    write_small();
    for (size_t count = 0; count < size; count += 1 + size / 400) {
        put_bytes(count);
        assert_refused("cut", count);
    }
    put_bytes(size);
    assert_int_equal(truncate(path, (off_t)size + 1), 0);
    assert_refused("too long", size + 1);
}

static void a_changed_byte_is_refused(void **state)
{
    (void)state;
    write_small();
    for (size_t at = 0; at < size; at += at < 400 ? 1 : 5) {
        bytes[at] ^= 0x10;
        put_bytes(size);
        assert_refused("changed", at);
        bytes[at] ^= 0x10;
    }
}

/* A checksum that is right protects from nobody who means it. */
static void seal(size_t from, size_t to)
{
    const uint32_t crc = crc32_of(0, bytes + from, to - 4 - from);
    for (int i = 0; i < 4; i++)
        bytes[to - 4 + (size_t)i] = (unsigned char)(crc >> 8 * i);
}

static const struct {
    const char *what;
    size_t offset;
    unsigned size;
    uint64_t value;
    const char *says;
} forged[] = {
#define HEADER(offset) offset
#define AXIS(offset)   TRACK_FILE_START_BYTES + (offset)
#define BLOCK(offset)  100000 + (offset)
    { "version", HEADER(8), 4, 1, "version" },
    { "no axes", HEADER(12), 4, 0, "axes" },
    { "many axes", HEADER(12), 4, 65, "axes" },
    { "odd title", HEADER(16), 1, 7, "name" },
    { "no name", AXIS(0), 1, 0, "name" },
    { "odd name", AXIS(0), 1, 7, "name" },
    { "segments", AXIS(44), 4, UINT32_MAX, "segments" },
    { "fewer segments", AXIS(44), 4, 32, "begins at byte" },
    { "offset", AXIS(48), 8, 0, "begins at byte" },
    { "no end", AXIS(56), 8, 0, "ends at" },
    { "negative end", AXIS(56), 8, UINT64_MAX, "ends at" },
    { "another end", AXIS(56), 8, 4096, "does not end" },
    { "end position", AXIS(64), 8, 77, "does not end" },
    { "axis of block", BLOCK(0), 4, 1, "belongs elsewhere" },
    { "number of block", BLOCK(4), 4, 1, "belongs elsewhere" },
    { "count of block", BLOCK(8), 4, 40, "belongs elsewhere" },
    { "start", BLOCK(12), 8, 1, "does not begin when" },
    { "duration", BLOCK(20), 8, 0, "no plan" },
    { "position", BLOCK(108), 8, 5, "does not begin where" },
    { "frac", BLOCK(88), 4, 200, "no plan" },
};

static void a_forged_number_is_refused(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(forged); i++) {
        const size_t header = track_file_header_bytes(2);
        const bool block = forged[i].offset >= 100000;
        const size_t from = block ? header : 0;
        struct track_file_bytes at = { .used = 0 };

        write_small();
        track_file_put(&at, forged[i].value, forged[i].size);
        memcpy(bytes + (block ? header + forged[i].offset - 100000
                              : forged[i].offset),
               at.byte, at.used);
        seal(from, block ? header + TRACK_FILE_BLOCK_BYTES : header);
        put_bytes(size);
        assert_refused(forged[i].what, i);
        if (strstr(message, forged[i].says) == NULL)
            fail_msg("%s: \"%s\"", forged[i].what, message);
    }
}

/* --- events ----------------------------------------------------------------- */

#define SHOTS (2 * TRACK_FILE_TIMES + 1)
static int64_t shot[2][SHOTS];

static void write_events(void)
{
    FILE *out = fopen(path, "wb");

    plan_anything(0, storage, 35, 1);
    write_tracks(1);
    file.line_count = 2;
    for (int k = 0; k < SHOTS; k++) {
        shot[0][k] = k * (int64_t)SEC / 7 + (k > 300) * 13;
        shot[1][k] = k / 2 * (int64_t)SEC;
    }
    file.line[0] = (struct track_file_line){ .name = "shutter",
                                             .count = SHOTS,
                                             .t_ns_q12 = shot[0] };
    file.line[1] = (struct track_file_line){ .name = "flash",
                                             .count = 3,
                                             .t_ns_q12 = shot[1] };
    file.step = (struct track_file_step){ "next", 24, 5, SEC };
    assert_non_null(out);
    track_file_write(out, &file, track);
    assert_int_equal(fclose(out), 0);
    take_bytes();
}

/* All of it, as a job reads it; 0, or -1 with the sentence. */
static int read_events(struct track_file *from, int64_t got[2][SHOTS])
{
    struct compiled *compiled = compiled_open(&disk_files, path, message);
    int err = 0;

    if (compiled == NULL)
        return -1;
    *from = compiled->file;
    for (unsigned i = 0; i < from->line_count && i < 2 && err == 0; i++)
        err = from->line[i].count > SHOTS
                  ? -1
                  : track_file_shots(&compiled->file, i, got[i], message);
    compiled_close(compiled);
    return err;
}

static void events_are_read_back_to_the_bit(void **state)
{
    static struct track_file from;
    static int64_t got[2][SHOTS];

    (void)state;
    write_events();
    if (read_events(&from, got) < 0)
        fail_msg("%s", message);
    assert_int_equal(from.line_count, 2);
    assert_string_equal(from.line[0].name, "shutter");
    assert_string_equal(from.line[1].name, "flash");
    assert_int_equal(from.line[0].count, SHOTS);
    assert_int_equal(from.line[1].count, 3);
    assert_memory_equal(got[0], shot[0], sizeof shot[0]);
    assert_memory_equal(got[1], shot[1], 3 * sizeof shot[1][0]);
    assert_string_equal(from.step.line, "next");
    assert_true(from.step.count == 24 && from.step.first_ns_q12 == 5 &&
                from.step.period_ns_q12 == SEC);
}

static void damaged_events_are_refused(void **state)
{
    static struct track_file from;
    static int64_t got[2][SHOTS];
    size_t begin_at;

    (void)state;
    write_events();
    begin_at = size - track_file_events_bytes(2) -
               track_file_times_bytes(SHOTS) - track_file_times_bytes(3);
    for (size_t at = begin_at; at < size; at += at < begin_at + 160 ? 1 : 7) {
        bytes[at] ^= 0x10;
        put_bytes(size);
        message[0] = 0;
        if (read_events(&from, got) == 0 || message[0] == 0)
            fail_msg("changed at %zu: \"%s\"", at, message);
        bytes[at] ^= 0x10;
    }
    for (size_t count = begin_at; count < size; count += 97) {
        put_bytes(count);
        assert_refused("cut", count);
    }
}

static void an_axis_that_stands_has_no_blocks(void **state)
{
    struct motion_sample sample;
    struct motion_cursor cursor = { 0 };

    (void)state;
    motion_track_init(&track[0], storage, LONG, 7 * ONE);
    write_tracks(1);
    struct compiled *compiled = compiled_open(&disk_files, path, message);
    assert_non_null(compiled);
    const struct motion_track *seen = compiled_look(compiled, 0, 5 * SEC);
    assert_non_null(seen);
    motion_track_sample(seen, &cursor, 5 * SEC, &sample);
    assert_int_equal(sample.pos_q32, 7 * ONE);
    assert_int_equal(compiled->outline[0].extreme[MOTION_POS].max, 7 * ONE);
    compiled_close(compiled);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_restored_segment_is_the_one_that_was_appended),
        cmocka_unit_test(what_was_never_appended_is_refused),
        cmocka_unit_test(a_long_track_plays_through_a_small_window),
        cmocka_unit_test(the_outline_is_that_of_the_whole),
        cmocka_unit_test(a_played_window_is_ahead_of_time),
        cmocka_unit_test(a_cut_file_is_refused),
        cmocka_unit_test(a_changed_byte_is_refused),
        cmocka_unit_test(a_forged_number_is_refused),
        cmocka_unit_test(an_axis_that_stands_has_no_blocks),
        cmocka_unit_test(events_are_read_back_to_the_bit),
        cmocka_unit_test(damaged_events_are_refused),
    };
    return cmocka_run_group_tests(tests, begin, end);
}

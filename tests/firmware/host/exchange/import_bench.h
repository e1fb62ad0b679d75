/* tests/firmware/host/exchange/import_bench.h - a directory of its own, a rig,
 * and moves of other programs read for it. */
#ifndef TESTS_FIRMWARE_HOST_EXCHANGE_IMPORT_BENCH_H
#define TESTS_FIRMWARE_HOST_EXCHANGE_IMPORT_BENCH_H

#include "firmware/host/exchange/import.h"
#include "tests/support/check.h"

#define SEED UINT64_C(0x2545F4914F6CDD1D)
#define DATA "tests/data/import/"

extern char import_bench_message[YAML_MESSAGE_MAX];

/* For a group of tests; every test removes what it wrote. */
int import_bench_open(void **state);
int import_bench_close(void **state);

/* A name in the directory; four of them at a time. */
const char *import_bench_path(const char *name);
/* Into the file `in` of the directory; its name. */
const char *import_bench_write(const char *data, size_t length);
size_t import_bench_read(const char *path, char *data, size_t capacity);

/* fps 0: as the file says. */
struct import_settings import_bench_settings(uint64_t fps);
/* For raw, which has no names: columns in the rig's order. */
struct import_settings import_bench_named(const char *format, uint64_t fps);
struct imported import_bench_read_as(const char *format, const char *path,
                                     const struct import_settings *settings);
/* Through move.yaml: the same keys, to the bit. */
void import_bench_check_move(const struct imported *imported);

static inline int64_t q32(double value)
{
    return (int64_t)(value * 4294967296.0 + (value < 0 ? -0.5 : 0.5));
}

static inline int64_t vel_q32(const struct motion_key *key)
{
    int64_t value = 0;
    assert_int_equal(motion_real_round(key->vel, 32, &value), 0);
    return value;
}

static inline int64_t acc_q32(const struct motion_key *key)
{
    int64_t value = 0;
    assert_int_equal(motion_real_round(key->acc, 32, &value), 0);
    return value;
}

#endif

/* tests/firmware/host/exchange/import_bench.c - see import_bench.h. */
#define _XOPEN_SOURCE 700 /* mkdtemp */
#include "tests/firmware/host/exchange/import_bench.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/linux/base/disk.h"
#include "motion/core/err.h"

static char directory[64];
static struct rig rig;
char import_bench_message[YAML_MESSAGE_MAX];

int import_bench_open(void **state)
{
    (void)state;
    snprintf(directory, sizeof directory, "/tmp/slew-test-XXXXXX");
    if (mkdtemp(directory) == NULL)
        return -1;
    return rig_load(&disk_files, DATA "rig.yaml", &rig, import_bench_message);
}

int import_bench_close(void **state)
{
    (void)state;
    return rmdir(directory); /* every test has removed what it wrote */
}

const char *import_bench_path(const char *name)
{
    static char path[4][128];
    static unsigned next;
    next = (next + 1) % 4;
    snprintf(path[next], sizeof path[next], "%s/%s", directory, name);
    return path[next];
}

const char *import_bench_write(const char *data, size_t length)
{
    const char *path = import_bench_path("in");
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, length, file), length);
    fclose(file);
    return path;
}

size_t import_bench_read(const char *path, char *data, size_t capacity)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    size_t length = fread(data, 1, capacity, file);
    fclose(file);
    return length;
}

struct import_settings import_bench_settings(uint64_t fps)
{
    return (struct import_settings){ .rig = &rig,
                                     .fps = { fps, fps > 0 },
                                     .curve = PLAN_CURVE_QUINTIC };
}

struct import_settings import_bench_named(const char *format, uint64_t fps)
{
    struct import_settings settings = import_bench_settings(fps);
    for (unsigned i = 0;
         i < rig.axis_count && !import_format_find(format)->named; i++)
        memcpy(settings.column[settings.column_count++], rig.axis[i].name,
               PLAN_NAME_MAX);
    return settings;
}

struct imported import_bench_read_as(const char *format, const char *path,
                                     const struct import_settings *settings)
{
    struct imported imported;
    if (import_format_find(format)->read(&disk_files, path, settings, &imported,
                                         import_bench_message) < 0)
        fail_msg("%s", import_bench_message);
    return imported;
}

void import_bench_check_move(const struct imported *imported)
{
    const char *path = import_bench_path("move.yaml");
    struct plan_move back;
    FILE *file = fopen(path, "wb");
    assert_int_equal(export_move(imported, "test", file, import_bench_message),
                     0);
    fclose(file);
    if (move_load(&disk_files, path, &rig, &back, import_bench_message) < 0)
        fail_msg("%s", import_bench_message);
    unlink(path);
    assert_int_equal(back.axis_count, imported->move.axis_count);
    for (uint32_t i = 0; i < back.axis_count; i++) {
        const struct plan_axis *a = &back.axis[i], *b = &imported->move.axis[i];
        assert_string_equal(a->name, b->name);
        assert_int_equal(a->curve, b->curve);
        assert_int_equal(a->key_count, b->key_count);
        for (uint32_t k = 0; k < a->key_count; k++) {
            assert_int_equal(a->key[k].key.t_ns_q12, b->key[k].key.t_ns_q12);
            assert_int_equal(a->key[k].key.pos_q32, b->key[k].key.pos_q32);
            assert_int_equal(a->key[k].key.has_vel, b->key[k].key.has_vel);
            assert_int_equal(vel_q32(&a->key[k].key), vel_q32(&b->key[k].key));
            assert_int_equal(acc_q32(&a->key[k].key), acc_q32(&b->key[k].key));
        }
    }
    move_free(&back);
}

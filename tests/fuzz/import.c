/* tests/fuzz/import.c - see fuzz_import.h. */
#include <stdio.h>

#include "firmware/host/exchange/import.h"
#include "firmware/host/exchange/import_odd.h"
#include "firmware/linux/base/disk.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/fuzz_import.h"

static void fuzz_import_taken(const struct imported *imported)
{
    static FILE *nowhere;
    char message[YAML_MESSAGE_MAX] = "";

    if (nowhere == NULL)
        nowhere = fopen("/dev/null", "wb");
    fuzz_claim(nowhere != NULL, "there is /dev/null");
    fuzz_claim(imported->move.axis_count >= 1, "a move has axes");
    for (uint32_t i = 0; i < imported->move.axis_count; i++)
        fuzz_claim(imported->move.axis[i].key_count >= 1, "an axis has keys");
    if (export_move(imported, "fuzz", nowhere, message) < 0)
        fuzz_claim(message[0] != 0, "an error has a sentence");
}

int fuzz_import(const char *format, const uint8_t *data, size_t size)
{
    return fuzz_import_with(import_format_find(format), data, size);
}

int fuzz_import_with(const struct import_format *format, const uint8_t *data,
                     size_t size)
{
    static struct rig rig;
    static struct imported imported;
    struct import_settings settings = { .rig = &rig,
                                        .fps = { 24, 1 },
                                        .curve = PLAN_CURVE_QUINTIC,
                                        .has_comma = size % 2 == 1,
                                        .unwrap = size % 3 == 1 };
    char message[YAML_MESSAGE_MAX] = "";

    if (rig.axis_count == 0)
        fuzz_claim(
            rig_load(&disk_files, "tests/fuzz/rig.yaml", &rig, message) == 0,
            "the rig is there");
    const char *path = fuzz_file(data, size);
    if (format->read(&disk_files, path, &settings, &imported, message) < 0) {
        fuzz_claim_sentence(path, message);
        return 0;
    }
    if (import_adjust(&settings, &imported, message) == 0)
        fuzz_import_taken(&imported);
    else
        fuzz_claim(message[0] != 0, "an error has a sentence");
    for (uint32_t i = 0; i < imported.move.axis_count; i++) {
        const struct plan_axis *axis = &imported.move.axis[i];
        struct import_odd odd;
        import_odd(&rig.axis[rig_axis_index(&rig, axis->name)], axis, &odd);
        fuzz_claim(odd.row < axis->key_count, "an odd row is one of them");
    }
    move_free(&imported.move);
    return 0;
}

/* tests/fuzz/fuzz_telemetry.c - rows of a run, as they are read back. */
#include "firmware/host/recording/telemetry.h"
#include "firmware/linux/base/disk.h"
#include "tests/fuzz/fuzz.h"

static void fuzz_telemetry_take(void *context, const struct telemetry_row *row)
{
    unsigned *rows = context;

    fuzz_claim(row->phase < TELEMETRY_PHASES, "a row has a phase");
    (*rows)++;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct rig rig;
    char message[YAML_MESSAGE_MAX] = "";
    unsigned rows = 0;

    if (rig.axis_count == 0)
        fuzz_claim(
            rig_load(&disk_files, "tests/fuzz/rig.yaml", &rig, message) == 0,
            "the rig is there");
    const char *path = fuzz_file(data, size);
    if (telemetry_read(&disk_files, path, &rig, fuzz_telemetry_take, &rows,
                       message) < 0)
        fuzz_claim_sentence(path, message);
    fuzz_claim(rows <= size, "a row takes bytes");
    return 0;
}

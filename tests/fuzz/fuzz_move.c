/* tests/fuzz/fuzz_move.c - move.yaml for a rig with every unit. */
#include "firmware/host/rig/rig.h"
#include "firmware/linux/base/disk.h"
#include "motion/plan/compose.h"
#include "tests/fuzz/fuzz.h"

static const struct rig *fuzz_move_rig(void)
{
    static struct rig rig;
    char message[YAML_MESSAGE_MAX];

    if (rig.axis_count == 0)
        fuzz_claim(
            rig_load(&disk_files, "tests/fuzz/rig.yaml", &rig, message) == 0,
            "the rig is there");
    return &rig;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct plan_move move;
    char message[YAML_MESSAGE_MAX] = "";
    const char *path = fuzz_file(data, size);

    if (move_load(&disk_files, path, fuzz_move_rig(), &move, message) < 0) {
        fuzz_claim_sentence(path, message);
        return 0;
    }
    fuzz_claim(move.axis_count >= 1, "a move has axes");
    move_free(&move);
    return 0;
}

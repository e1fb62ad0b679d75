/* tests/fuzz/fuzz_rig.c - rig.yaml, and what is computed from it alone. */
#include "firmware/host/job/budget.h"
#include "firmware/host/rig/rig.h"
#include "firmware/linux/base/disk.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct rig rig;
    char message[YAML_MESSAGE_MAX] = "";
    const char *path = fuzz_file(data, size);

    if (rig_load(&disk_files, path, &rig, message) < 0) {
        fuzz_claim_sentence(path, message);
        return 0;
    }
    fuzz_claim(rig.axis_count >= 1 && rig.axis_count <= RIG_AXES_MAX,
               "a rig has axes");
    for (unsigned i = 0; i < rig.bus_count; i++) {
        struct budget budget;
        budget_of(&rig, i, NULL, &budget);
        fuzz_claim(budget.most >= 0, "a bus has a load");
        budget_free(&budget);
    }
    return 0;
}

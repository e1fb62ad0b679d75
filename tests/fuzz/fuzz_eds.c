/* tests/fuzz/fuzz_eds.c - EDS and DCF files. */
#include "firmware/host/device/eds.h"
#include "firmware/linux/base/disk.h"
#include "tests/fuzz/fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct eds eds;
    char message[EDS_MESSAGE_MAX] = "";
    const char *path = fuzz_file(data, size);

    if (eds_load(&disk_files, path, &eds, message) < 0) {
        fuzz_claim_sentence(path, message);
        eds_free(&eds);
        return 0;
    }
    fuzz_claim(eds.count <= EDS_OBJECTS_MAX, "objects have their room");
    for (unsigned i = 0; i < eds.count; i++)
        fuzz_claim(eds_find(&eds, eds.object[i].index, eds.object[i].sub) !=
                       NULL,
                   "every object is found");
    eds_free(&eds);
    return 0;
}

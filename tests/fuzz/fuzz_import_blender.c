/* tests/fuzz/fuzz_import_blender.c - see fuzz_import.h. */
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/fuzz_import.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_import("blender", data, size);
}

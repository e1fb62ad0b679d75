/* tests/fuzz/fuzz_import_arcm.c - see fuzz_import.h. */
#include "firmware/linux/xml/arcm.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/fuzz_import.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_import_with(&arcm_format, data, size);
}

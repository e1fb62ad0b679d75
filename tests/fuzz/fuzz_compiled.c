/* tests/fuzz/fuzz_compiled.c - compiled moves.  Every block ends in a CRC,
 * which no mutation meets; so the CRCs are put right first when the input
 * asks. */
#include <stdlib.h>
#include <string.h>

#include "firmware/host/track/compiled.h"
#include "firmware/host/track/track_file_bytes.h"
#include "firmware/linux/base/disk.h"
#include "hal/support/crc32.h"
#include "tests/fuzz/fuzz.h"

#define FUZZ_SHOTS 4096

static void fuzz_compiled_seal(uint8_t *at, size_t size)
{
    const uint32_t crc = crc32_of(0, at, size - TRACK_FILE_CRC_BYTES);

    for (unsigned i = 0; i < TRACK_FILE_CRC_BYTES; i++)
        at[size - TRACK_FILE_CRC_BYTES + i] = (uint8_t)(crc >> 8 * i);
}

/* The header says by its number of axes how long it is. */
static void fuzz_compiled_mend(uint8_t *bytes, size_t size)
{
    for (uint32_t axes = 1; axes <= PLAN_AXES_MAX; axes++) {
        const size_t head = track_file_header_bytes(axes);
        if (head > size || (size - head) % TRACK_FILE_BLOCK_BYTES != 0)
            continue;
        fuzz_compiled_seal(bytes, head);
        for (size_t at = head; at < size; at += TRACK_FILE_BLOCK_BYTES)
            fuzz_compiled_seal(bytes + at, TRACK_FILE_BLOCK_BYTES);
        return;
    }
}

static void fuzz_compiled_play(struct compiled *compiled,
                               const struct motion_track track[])
{
    for (unsigned i = 0; i < compiled->file.axis_count; i++) {
        const int64_t end_ns_q12 = track[i].end_ns_q12;
        for (int k = 0; k <= 16; k++) {
            const int64_t t = end_ns_q12 / 16 * k;
            const struct motion_track *seen = compiled_look(compiled, i, t);
            struct motion_sample sample;
            struct motion_cursor cursor = { 0 };
            if (seen != NULL)
                motion_track_sample(seen, &cursor, t, &sample);
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char message[TRACK_FILE_MESSAGE_MAX] = "";
    uint8_t *bytes = malloc(size + 1);

    fuzz_claim(bytes != NULL, "there is room for the bytes");
    memcpy(bytes, data, size);
    fuzz_compiled_mend(bytes, size);
    const char *path = fuzz_file(bytes, size);
    free(bytes);
    (void)track_file_is(&disk_files, path);
    static int64_t shots[FUZZ_SHOTS];
    struct compiled *compiled = compiled_open(&disk_files, path, message);
    if (compiled == NULL) {
        fuzz_claim(message[0] != 0 && strchr(message, '\n') == NULL,
                   "an error is one sentence");
        return 0;
    }
    fuzz_compiled_play(compiled, compiled->track);
    for (unsigned i = 0; i < compiled->file.line_count; i++)
        if (compiled->file.line[i].count <= FUZZ_SHOTS)
            fuzz_claim(track_file_shots(&compiled->file, i, shots, message) ==
                               0 ||
                           strchr(message, '\n') == NULL,
                       "an error is one sentence");
    compiled_close(compiled);
    return 0;
}

/* tests/fuzz/replay.c - a fuzz target without a fuzzer: every file of its
 * corpus as it is, then spoilt ROUNDS times (FUZZ_ROUNDS of the environment)
 * with numbers that are the same everywhere. */
#define _XOPEN_SOURCE 700 /* scandir */
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/fuzz/fuzz.h"
#include "tests/support/check.h"

#define ROUNDS    200
#define BYTES_MAX ((size_t)1 << 16)
#define FILES     256

struct replay {
    char folder[256];
    uint8_t *file[FILES];
    size_t size[FILES];
    unsigned count;
    uint64_t seed;
};

static struct replay replay = { .seed = 20 };

static void replay_load(const char *name)
{
    char path[600];
    FILE *file;

    assert_true(replay.count < FILES);
    snprintf(path, sizeof path, "%s/%s", replay.folder, name);
    file = fopen(path, "rb");
    assert_non_null(file);
    uint8_t *bytes = malloc(BYTES_MAX);
    assert_non_null(bytes);
    replay.file[replay.count] = bytes;
    replay.size[replay.count++] = fread(bytes, 1, BYTES_MAX / 2, file);
    fclose(file);
}

static int replay_is_file(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

static int replay_open(void **state)
{
    struct dirent **entry;
    const int count = scandir(replay.folder, &entry, replay_is_file, alphasort);

    (void)state;
    for (int i = 0; i < count; i++) {
        replay_load(entry[i]->d_name);
        free(entry[i]);
    }
    if (count >= 0)
        free(entry);
    return replay.count > 0 ? 0 : -1;
}

static int replay_close(void **state)
{
    (void)state;
    while (replay.count > 0)
        free(replay.file[--replay.count]);
    return 0;
}

static size_t replay_below(size_t limit)
{
    return limit == 0 ? 0 : (size_t)(check_random(&replay.seed) % limit);
}

/* Room for `more` bytes at `at`. */
static size_t replay_open_gap(uint8_t *bytes, size_t size, size_t at,
                              size_t more)
{
    memmove(bytes + at + more, bytes + at, size - at);
    return size + more;
}

static size_t replay_insert(uint8_t *bytes, size_t size)
{
    static const char *const word[] = {
        "-1",    "9223372036854775808",
        "1e999", "nan",
        "\n",    "\t",
        "[",     "{",
        ": ",    "\xFF",
        "0x10",  ",",
        "\"",    "#",
        " mm",   "%s",
        "- ",    "}",
        "1/3",   "\xEF\xBB\xBF",
    };
    const char *put = word[replay_below(ARRAY_LEN(word))];
    const size_t at = replay_below(size + 1), length = strlen(put);

    size = replay_open_gap(bytes, size, at, length);
    memcpy(bytes + at, put, length);
    return size;
}

/* Bytes of another file of the corpus. */
static size_t replay_splice(uint8_t *bytes, size_t size)
{
    const unsigned other = (unsigned)replay_below(replay.count);
    const size_t from = replay_below(replay.size[other]);
    const size_t length = replay_below(
        replay.size[other] - from < 200 ? replay.size[other] - from : 200);
    const size_t at = replay_below(size + 1);

    size = replay_open_gap(bytes, size, at, length);
    memcpy(bytes + at, replay.file[other] + from, length);
    return size;
}

static size_t replay_remove(uint8_t *bytes, size_t size)
{
    const size_t at = replay_below(size);
    const size_t length = replay_below(size - at < 40 ? size - at : 40);

    memmove(bytes + at, bytes + at + length, size - at - length);
    return size - length;
}

static size_t replay_spoil(uint8_t *bytes, size_t size)
{
    switch (replay_below(6)) {
    case 0:
        return replay_insert(bytes, size);
    case 1:
        return replay_splice(bytes, size);
    case 2:
        return replay_remove(bytes, size);
    case 3:
        return replay_below(8) == 0 ? replay_below(size) : size;
    case 4:
        if (size > 0)
            bytes[replay_below(size)] ^= (uint8_t)(1u << replay_below(8));
        return size;
    default:
        if (size > 0)
            bytes[replay_below(size)] = (uint8_t)check_random(&replay.seed);
        return size;
    }
}

static void no_input_does_corrupt(void **state)
{
    const char *given = getenv("FUZZ_ROUNDS");
    const unsigned rounds = given ? (unsigned)strtoul(given, NULL, 10) : ROUNDS;
    uint8_t *bytes = malloc(BYTES_MAX);
    unsigned inputs = 0;

    (void)state;
    assert_non_null(bytes);
    for (unsigned i = 0; i < replay.count; i++)
        for (unsigned round = 0; round <= rounds; round++) {
            size_t size = replay.size[i];

            memcpy(bytes, replay.file[i], size);
            for (size_t n = round == 0 ? 0 : 1 + replay_below(4); n > 0; n--)
                size = replay_spoil(bytes, size);
            assert_int_equal(LLVMFuzzerTestOneInput(bytes, size), 0);
            inputs++;
        }
    free(bytes);
    print_message("%u files, %u inputs\n", replay.count, inputs);
}

/* build/tests/fuzz/fuzz_NAME: tests/fuzz/corpus/NAME */
int main(int argc, char *argv[])
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_input_does_corrupt),
    };
    const char *name = argc > 0 ? strstr(argv[0], "/fuzz_") : NULL;

    if (name == NULL)
        return 1;
    snprintf(replay.folder, sizeof replay.folder, "tests/fuzz/corpus/%s",
             name + strlen("/fuzz_"));
    return cmocka_run_group_tests(tests, replay_open, replay_close);
}

/* firmware/host/device/object_words.c - values in words; see object.h. */
#include "firmware/host/device/object.h"

#include <string.h>

#include "firmware/host/base/array.h"
#include "hal/canopen/canopen.h"
#include "hal/drive/cia402/drive.h"

static void words_put(char text[OBJECT_TEXT_MAX], const char *word)
{
    const size_t used = strlen(text);

    snprintf(text + used, OBJECT_TEXT_MAX - used, "%s%s", used > 0 ? ", " : "",
             word);
}

/* Bits that are set, by their names. */
static void words_bits(char text[OBJECT_TEXT_MAX], int64_t value,
                       const char *const name[], unsigned count)
{
    for (unsigned i = 0; i < count; i++)
        if (((uint64_t)value >> i & 1) != 0 && name[i] != NULL)
            words_put(text, name[i]);
}

static void words_status(int64_t value, char text[OBJECT_TEXT_MAX])
{
    static const char *const bit[] = {
        [4] = "voltage enabled", [7] = "warning",         [9] = "remote",
        [10] = "target reached", [11] = "internal limit",
    };
    words_put(text, cia402_state_text(cia402_state_of((uint16_t)value)));
    words_bits(text, value, bit, ARRAY_LEN(bit));
}

static void words_mode(int64_t value, char text[OBJECT_TEXT_MAX])
{
    static const char *const mode[] = {
        [0] = "none",
        [1] = "profile position",
        [2] = "velocity",
        [3] = "profile velocity",
        [4] = "profile torque",
        [6] = "homing",
        [7] = "interpolated position",
        [8] = "cyclic synchronous position",
        [9] = "cyclic synchronous velocity",
        [10] = "cyclic synchronous torque",
    };
    if (value >= 0 && value < (int64_t)ARRAY_LEN(mode) && mode[value] != NULL)
        words_put(text, mode[value]);
    else
        words_put(text, value < 0 ? "the maker's own" : "");
}

static void words_modes(int64_t value, char text[OBJECT_TEXT_MAX])
{
    static const char *const bit[] = {
        [0] = "PP", [1] = "VL",  [2] = "PV",  [3] = "TQ",  [5] = "HM",
        [6] = "IP", [7] = "CSP", [8] = "CSV", [9] = "CST",
    };
    words_bits(text, value, bit, ARRAY_LEN(bit));
}

static void words_inputs(int64_t value, char text[OBJECT_TEXT_MAX])
{
    static const char *const bit[] = { "negative limit switch",
                                       "positive limit switch", "home switch" };
    words_bits(text, value, bit, ARRAY_LEN(bit));
}

static void words_register(int64_t value, char text[OBJECT_TEXT_MAX])
{
    static const char *const bit[] = {
        "generic",       "current", "voltage", "temperature",
        "communication", "profile", NULL,      "maker's own"
    };
    words_bits(text, value, bit, ARRAY_LEN(bit));
}

static void words_error(int64_t value, char text[OBJECT_TEXT_MAX])
{
    words_put(text, canopen_emcy_text((uint16_t)value));
}

static void words_device(int64_t value, char text[OBJECT_TEXT_MAX])
{
    static const char *const kind[] = { "frequency converter", "servo drive",
                                        "stepper" };

    if ((value & 0xFFFF) != 402) {
        snprintf(text, OBJECT_TEXT_MAX, "profile %u",
                 (unsigned)(value & 0xFFFF));
        return;
    }
    words_put(text, "CiA 402");
    if (value >> 16 == 0xFFFF)
        words_put(text, "one of several in it");
    else
        words_bits(text, value >> 16 & 7, kind, 3);
}

static void words_watchdog(int64_t value, char text[OBJECT_TEXT_MAX])
{
    snprintf(text, OBJECT_TEXT_MAX, "node %u, %u ms",
             (unsigned)(value >> 16 & 0x7F), (unsigned)(value & 0xFFFF));
}

static const struct {
    uint16_t index;
    void (*say)(int64_t value, char text[OBJECT_TEXT_MAX]);
} words_row[] = {
    { 0x1000, words_device },   { 0x1001, words_register },
    { 0x1016, words_watchdog }, { 0x603F, words_error },
    { 0x6041, words_status },   { 0x6060, words_mode },
    { 0x6061, words_mode },     { 0x60FD, words_inputs },
    { 0x6502, words_modes },
};

void object_words(const struct object *object, int64_t value,
                  char text[OBJECT_TEXT_MAX])
{
    text[0] = '\0';
    if (object->index == 0x1003 && object->sub > 0) {
        words_error(value, text);
        return;
    }
    for (size_t i = 0; i < ARRAY_LEN(words_row); i++)
        if (words_row[i].index == object->index &&
            (object->sub == 0 || object->index == 0x1016))
            words_row[i].say(value, text);
}

/* firmware/host/recording/warning.c - see warning.h. */
#include "firmware/host/recording/warning.h"

#include <stdio.h>

#include "firmware/host/base/number.h"

static const struct {
    const char *words, *word;
} warning_table[] = {
#define WARNING_ROW(name, words, word) { words, word },
    WARNING_LIST(WARNING_ROW)
#undef WARNING_ROW
};

const char *warning_words(enum warning_kind kind)
{
    return warning_table[kind].words;
}

const char *warning_word(enum warning_kind kind)
{
    return warning_table[kind].word;
}

const char *warning_unit(enum warning_kind kind, const struct rig_axis *axis)
{
    return kind < WARNING_TEMPERATURE ? units_axis_text(axis->unit)
                                      : hal_reading_unit((enum hal_reading)(
                                            kind - WARNING_TEMPERATURE));
}

void warning_text(const struct warning *warning, const struct rig_axis *axis,
                  char text[WARNING_TEXT_MAX])
{
    char value[NUMBER_MAX], limit[NUMBER_MAX];
    number_short(value, warning->value_q32, 32);
    number_short(limit, warning->limit_q32, 32);
    snprintf(text, WARNING_TEXT_MAX, "%s: %s, %.24s of %.24s %s", axis->name,
             warning_words(warning->kind), value, limit,
             warning_unit(warning->kind, axis));
}

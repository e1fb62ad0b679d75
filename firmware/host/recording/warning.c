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

bool warning_is_of_speed(enum warning_kind kind)
{
    return kind == WARNING_FOUND || kind == WARNING_FOUND_GOING;
}

void warning_amount(const struct warning *warning, const struct rig_axis *axis,
                    char text[WARNING_TEXT_MAX])
{
    const char *unit = warning_unit(warning->kind, axis);
    char value[NUMBER_MAX], limit[NUMBER_MAX];
    text[0] = '\0';
    number_short(limit, warning->limit_q32, 32);
    if (!warning_is_of_speed(warning->kind)) {
        number_short(value, warning->value_q32, 32);
        snprintf(text, WARNING_TEXT_MAX, "%.24s of %.24s %s", value, limit,
                 unit);
    } else if (warning->value_q32 != 0) {
        number_fixed(value, warning->value_q32, 32, 3);
        snprintf(text, WARNING_TEXT_MAX, "moving at %.24s %s/s", value, unit);
    }
}

void warning_text(const struct warning *warning, const struct rig_axis *axis,
                  char text[WARNING_TEXT_MAX])
{
    char amount[WARNING_TEXT_MAX];
    warning_amount(warning, axis, amount);
    snprintf(text, WARNING_TEXT_MAX, "%s: %s%s%.70s", axis->name,
             warning_words(warning->kind), amount[0] != '\0' ? ", " : "",
             amount);
}

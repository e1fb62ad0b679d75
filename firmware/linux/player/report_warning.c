/* firmware/linux/player/report_warning.c - see report_warning.h. */
#include "firmware/linux/player/report_warning.h"

#include <inttypes.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/number.h"
#include "firmware/linux/base/json_print.h"
#include "motion/core/fixed.h"

void report_warning_take(struct report_warnings *warnings,
                         const struct warning *newest, int64_t t_ns)
{
    if (newest->number <= warnings->number)
        return;
    warnings->number = newest->number;
    if (warnings->kind[newest->kind].count++ > 0)
        return;
    warnings->kind[newest->kind].t_ns = t_ns;
    warnings->kind[newest->kind].value_q32 = newest->value_q32;
    warnings->kind[newest->kind].limit_q32 = newest->limit_q32;
}

void report_warning_print(const struct report_warnings *warnings,
                          const struct rig_axis *axis, FILE *file)
{
    for (unsigned i = 0; i < WARNING_KINDS; i++) {
        const enum warning_kind kind = (enum warning_kind)i;
        const struct warning first = {
            .kind = kind,
            .value_q32 = warnings->kind[i].value_q32,
            .limit_q32 = warnings->kind[i].limit_q32,
        };
        char amount[WARNING_TEXT_MAX], when[NUMBER_MAX];
        if (warnings->kind[i].count == 0)
            continue;
        warning_amount(&first, axis, amount);
        number_seconds(when, warnings->kind[i].t_ns * MOTION_FIXED_NS_Q12);
        fprintf(file,
                "events: %s: %s %" PRIu32
                " (first %s%safter %s s of the run)\n",
                axis->name, warning_words(kind), warnings->kind[i].count,
                amount, amount[0] != '\0' ? " " : "", when);
    }
}

void report_warning_json(const struct report_warnings *warnings,
                         struct cJSON *item)
{
    for (unsigned i = 0; i < WARNING_KINDS; i++) {
        const char *word = warning_word((enum warning_kind)i);
        char name[64];
        if (warnings->kind[i].count == 0)
            continue;
        snprintf(name, sizeof name, "%s_warning", word);
        cJSON *object = cJSON_AddObjectToObject(item, name);
        cJSON_AddNumberToObject(object, "count", warnings->kind[i].count);
        if (warning_is_of_speed((enum warning_kind)i)) {
            json_add_fixed(object, "velocity", warnings->kind[i].value_q32, 32);
        } else {
            json_add_fixed(object, word, warnings->kind[i].value_q32, 32);
            json_add_fixed(object, "limit", warnings->kind[i].limit_q32, 32);
        }
        cJSON_AddNumberToObject(object, "after_s",
                                (double)warnings->kind[i].t_ns / 1e9);
    }
}

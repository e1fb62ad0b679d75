/* firmware/host/yaml/yaml_units.c - see yaml_units.h. */
#include "firmware/host/yaml/yaml_units.h"

static int yaml_units_refuse(const struct yaml_value *value,
                             const char *sentence)
{
    return yaml_report_at(&value->tree->report,
                          yaml_tree_place(value->tree, value->node), "%s %s",
                          value->name, sentence);
}

int yaml_units_read(const struct yaml_value *value,
                    enum units_quantity quantity,
                    const struct units_context *context, int64_t *out)
{
    char sentence[UNITS_SENTENCE_MAX];
    const char *text = yaml_value_text(value);

    if (text == NULL)
        return -1;
    if (units_parse(text, quantity, context, out, sentence) < 0)
        return yaml_units_refuse(value, sentence);
    return 0;
}

int yaml_units_read_list(const struct yaml_value *value,
                         enum units_quantity quantity,
                         const struct units_context *context,
                         const char *expected, uint32_t count, int64_t out[])
{
    struct yaml_value item = *value;
    uint32_t given;

    if (yaml_value_list(value, count, count, &given) < 0)
        return -1;
    item.node = yaml_value_node(value)->first;
    if (expected != NULL)
        item.expected = expected;
    for (uint32_t i = 0; i < count; i++) {
        if (yaml_units_read(&item, quantity, context, &out[i]) < 0)
            return -1;
        item.node = yaml_value_node(&item)->next;
    }
    return 0;
}

int yaml_units_read_fps(const struct yaml_value *value, struct units_fps *fps)
{
    char sentence[UNITS_SENTENCE_MAX];
    const char *text = yaml_value_text(value);

    if (text == NULL)
        return -1;
    if (units_parse_fps(text, fps, sentence) < 0)
        return yaml_units_refuse(value, sentence);
    return 0;
}

int yaml_units_read_counts(const struct yaml_value *value, enum units_axis unit,
                           int64_t *num, int64_t *den)
{
    char sentence[UNITS_SENTENCE_MAX];
    const char *text = yaml_value_text(value);

    if (text == NULL)
        return -1;
    if (units_parse_counts(text, unit, num, den, sentence) < 0)
        return yaml_units_refuse(value, sentence);
    return 0;
}

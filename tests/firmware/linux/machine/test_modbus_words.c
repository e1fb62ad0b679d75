/* tests/firmware/linux/machine/test_modbus_words.c - what the counts of a line say:
 * each its own sentence with its number, in words and as JSON. */
#include "firmware/linux/machine/modbus_words.h"

#include <string.h>

#include "firmware/linux/machine/view.h"
#include "tests/support/check.h"

static const struct row {
    enum rig_bus_kind kind;
    bool echo;
    struct hal_modbus_stats stats;
    const char *says[3]; /* how it begins; NULL: no more */
} rows[] = {
    { RIG_MODBUS_RTU, false, { .transactions = 9, .timeouts = 3 }, { NULL } },
    { RIG_MODBUS_RTU,
      false,
      { .stray = 1 },
      { "1 stray byte: not of any frame; look at the termination" } },
    { RIG_MODBUS_RTU,
      false,
      { .stray = 37, .broken = 4 },
      { "37 stray bytes: not of any frame; look at",
        "4 broken frames: noise, another master" } },
    { RIG_MODBUS_RTU,
      false,
      { .echoes = 2 },
      { "2 echoes: the adapter receives what it sends, expected echo: yes" } },
    { RIG_MODBUS_RTU, true, { .transactions = 5, .echoes = 5 }, { NULL } },
    { RIG_MODBUS_RTU,
      true,
      { .transactions = 5, .timeouts = 1 },
      { "4 answers without an echo: expected echo: no" } },
    { RIG_MODBUS_TCP,
      false,
      { .late = 1, .stray = 2, .broken = 1 },
      { "2 stray bytes: not of any frame, expected a server",
        "1 broken frame: not the answer", "1 late answer: after the" } },
};

static unsigned count_of(const struct row *row)
{
    unsigned count = 0;

    while (count < ARRAY_LEN(row->says) && row->says[count] != NULL)
        count++;
    return count;
}

static void each_trouble_has_its_sentence(void **state)
{
    char text[MODBUS_WORDS][MODBUS_WORDS_MAX];

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(rows); i++) {
        const struct rig_bus bus = { .kind = rows[i].kind,
                                     .modbus.echo = rows[i].echo };
        const unsigned count = modbus_words(&bus, &rows[i].stats, text);

        if (count != count_of(&rows[i]))
            fail_msg("row %u: %u sentences", i, count);
        for (unsigned k = 0; k < count; k++)
            if (strstr(text[k], rows[i].says[k]) != text[k])
                fail_msg("row %u: %s", i, text[k]);
    }
}

static void a_bus_in_json_has_them(void **state)
{
    const struct rig_bus bus = { .kind = RIG_MODBUS_RTU };
    cJSON *item = cJSON_CreateObject();

    (void)state;
    machine_view_to_line(&bus, &rows[2].stats, item);
    assert_string_equal(cJSON_GetObjectItem(item, "strays")->valuestring, "37");
    assert_string_equal(cJSON_GetObjectItem(item, "broken")->valuestring, "4");
    assert_string_equal(cJSON_GetObjectItem(item, "echoes")->valuestring, "0");
    assert_string_equal(cJSON_GetObjectItem(item, "late")->valuestring, "0");
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(item, "says")), 2);
    cJSON_Delete(item);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_trouble_has_its_sentence),
        cmocka_unit_test(a_bus_in_json_has_them),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

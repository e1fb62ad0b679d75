/* firmware/host/base/json.c - see json.h. */
#include "firmware/host/base/json.h"

#include <inttypes.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"

cJSON *json_integer(int64_t value)
{
    char text[NUMBER_MAX];
    number_integer(text, value);
    return cJSON_CreateRaw(text);
}

void json_add_integer(cJSON *object, const char *name, int64_t value)
{
    cJSON_AddItemToObject(object, name, json_integer(value));
}

void json_add_fixed(cJSON *object, const char *name, int64_t value,
                    unsigned bits)
{
    cJSON_AddNumberToObject(object, name, number_double(value, bits));
}

static bool json_printed;

bool json_is_printed(void)
{
    return json_printed;
}

static void json_put(cJSON *item, FILE *file, bool indented)
{
    char *text = indented ? cJSON_Print(item) : cJSON_PrintUnformatted(item);
    cJSON_Delete(item);
    if (text == NULL)
        memory_fail();
    fputs(text, file);
    json_printed |= file == stdout;
    cJSON_free(text);
}

void json_print(cJSON *item, FILE *file)
{
    json_put(item, file, true);
    fputc('\n', file);
}

void json_print_line(cJSON *item, FILE *file)
{
    json_put(item, file, false);
}

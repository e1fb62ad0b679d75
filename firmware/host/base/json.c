/* firmware/host/base/json.c - see json.h. */
#include "firmware/host/base/json.h"

#include <inttypes.h>
#include <stdio.h>

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

void json_add_hash(cJSON *object, const char *name, uint64_t hash)
{
    char text[20];

    snprintf(text, sizeof text, "%016llx", (unsigned long long)hash);
    cJSON_AddStringToObject(object, name, text);
}

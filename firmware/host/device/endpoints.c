/* firmware/host/device/endpoints.c - see endpoints.h. */
#include "firmware/host/device/endpoints.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/yaml/yaml_fields.h"

/* That of firmware 0.6.10 has 100 kB. */
#define ENDPOINTS_MAX   (4u << 20)
#define ENDPOINTS_NAMES 4096

struct cJSON *endpoints_open(const struct files *files, const char *path)
{
    char *text;
    const int64_t length = files_load(files, path, ENDPOINTS_MAX, &text);
    cJSON *list =
        length < 0 ? NULL : cJSON_ParseWithLength(text, (size_t)length);

    free(text);
    if (cJSON_IsObject(list))
        return list;
    cJSON_Delete(list);
    return NULL;
}

void endpoints_close(struct cJSON *list)
{
    cJSON_Delete(list);
}

static const cJSON *endpoints_all(const cJSON *list)
{
    return cJSON_GetObjectItemCaseSensitive(list, "endpoints");
}

uint16_t endpoints_number(const struct cJSON *list, const char *name)
{
    const cJSON *id = cJSON_GetObjectItemCaseSensitive(
        cJSON_GetObjectItemCaseSensitive(endpoints_all(list), name), "id");

    if (!cJSON_IsNumber(id) || id->valueint < 1 || id->valueint > UINT16_MAX)
        return 0;
    return (uint16_t)id->valueint;
}

/* ---- one of them ---- */

static int endpoints_unknown(const cJSON *list, const char *name,
                             char message[QUANTITY_MESSAGE_MAX])
{
    static const char *known[ENDPOINTS_NAMES];
    const char *near;
    const cJSON *entry;
    unsigned count = 0;

    cJSON_ArrayForEach(entry, endpoints_all(list))
    {
        if (count < ENDPOINTS_NAMES)
            known[count++] = entry->string;
    }
    near = yaml_nearest(name, known, count);
    snprintf(message, QUANTITY_MESSAGE_MAX,
             "'%.80s' is no endpoint of the list, expected one such as %.60s",
             name,
             near != NULL ? near
             : count > 0  ? known[0]
                          : "none");
    return -1;
}

static bool endpoints_type(const cJSON *entry, enum quantity_type *type)
{
    static const struct {
        const char *word;
        enum quantity_type type;
    } types[] = {
        { "bool", QUANTITY_BOOL }, { "uint8", QUANTITY_U8 },
        { "int8", QUANTITY_I8 },   { "uint16", QUANTITY_U16 },
        { "int16", QUANTITY_I16 }, { "uint32", QUANTITY_U32 },
        { "int32", QUANTITY_I32 }, { "float", QUANTITY_F32 },
    };
    const char *word =
        cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(entry, "type"));

    for (size_t i = 0; word != NULL && i < ARRAY_LEN(types); i++)
        if (strcmp(word, types[i].word) == 0) {
            *type = types[i].type;
            return true;
        }
    return false;
}

int endpoints_find(const struct cJSON *list, const char *name,
                   struct quantity *quantity,
                   char message[QUANTITY_MESSAGE_MAX])
{
    const cJSON *entry =
        cJSON_GetObjectItemCaseSensitive(endpoints_all(list), name);
    const char *access =
        cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(entry, "access"));

    *quantity = (struct quantity){ .kind = QUANTITY_ENDPOINT,
                                   .at = endpoints_number(list, name),
                                   .unit = "" };
    if (quantity->at == 0)
        return endpoints_unknown(list, name, message);
    if (!endpoints_type(entry, &quantity->type)) {
        snprintf(message, QUANTITY_MESSAGE_MAX,
                 "%.80s is not a number of 32 bits or fewer", name);
        return -1;
    }
    snprintf(quantity->name, sizeof quantity->name, "%s", name);
    quantity->readable = access == NULL || strchr(access, 'r') != NULL;
    quantity->writable = access == NULL || strchr(access, 'w') != NULL;
    return 0;
}

bool endpoints_version(const struct cJSON *list, uint8_t version[3])
{
    const char *text = cJSON_GetStringValue(
        cJSON_GetObjectItemCaseSensitive(list, "fw_version"));

    for (unsigned i = 0; i < 3; i++) {
        char *end = NULL;
        const unsigned long part = text == NULL ? 0 : strtoul(text, &end, 10);

        if (text == end || part > UINT8_MAX || (i < 2 && *end != '.'))
            return false;
        version[i] = (uint8_t)part;
        text = end + 1;
    }
    return true;
}

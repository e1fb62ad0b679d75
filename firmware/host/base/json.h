/* firmware/host/base/json.h - the few things cJSON leaves to its user. */
#ifndef FIRMWARE_HOST_BASE_JSON_H
#define FIRMWARE_HOST_BASE_JSON_H

#include <cjson/cJSON.h>
#include <stdint.h>

/* A number with all its digits: JSON has no limit, a double has. */
void json_add_integer(cJSON *object, const char *name, int64_t value);
/* The same as an item of its own, for arrays. */
cJSON *json_integer(int64_t value);
/* Fixed point, as a double. */
void json_add_fixed(cJSON *object, const char *name, int64_t value,
                    unsigned bits);
/* 16 hex digits, as a text. */
void json_add_hash(cJSON *object, const char *name, uint64_t hash);

#endif

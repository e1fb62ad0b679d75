/* firmware/host/device/endpoints.h - ODrive's list of its parameters, its
 * flat_endpoints.json: {"fw_version": "0.6.9", "endpoints":
 * {"axis0.config.x": {"id": 123, "type": "float", "access": "rw"}, ...}}.
 *
 * The numbers are those of one version of the firmware only. */
#ifndef FIRMWARE_HOST_DEVICE_ENDPOINTS_H
#define FIRMWARE_HOST_DEVICE_ENDPOINTS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/base/files.h"
#include "firmware/host/device/quantity.h"

struct cJSON;

/* NULL: no such file, or none that can be read.  endpoints_close. */
struct cJSON *endpoints_open(const struct files *files, const char *path);
void endpoints_close(struct cJSON *list);

/* Number of an endpoint, 0: it does not have it. */
uint16_t endpoints_number(const struct cJSON *list, const char *name);
/* 0, or -1 with a sentence: not there, or of a type that is no number of at
 * most 32 bits. */
int endpoints_find(const struct cJSON *list, const char *name,
                   struct quantity *quantity,
                   char message[QUANTITY_MESSAGE_MAX]);
/* Major, minor, revision; false: it does not say. */
bool endpoints_version(const struct cJSON *list, uint8_t version[3]);

#endif

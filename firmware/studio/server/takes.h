/* firmware/studio/server/takes.h - recordings of runs that a page has kept: CSV in
 * the directory takes/ beside the move, or the rig. */
#ifndef FIRMWARE_STUDIO_SERVER_TAKES_H
#define FIRMWARE_STUDIO_SERVER_TAKES_H

#include <cjson/cJSON.h>
#include <stdbool.h>
#include <stddef.h>

#define TAKES_NAME 64
#define TAKES_MOST 1000 /* that are looked at */

/* Letters, digits, - and _, then .csv. */
bool takes_is_name(const char *name);
/* The file of a take beside `beside`; false: too long, or no such name. */
bool takes_path(const char *beside, const char *name, char *path, size_t size);
/* {"takes": [{"name", "bytes"}]}, by name. */
cJSON *takes_list(const char *beside);
/* A new one.  0, -EEXIST, or another negative errno. */
int takes_write(const char *beside, const char *name, const char *data,
                size_t length);

#endif

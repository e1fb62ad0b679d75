/* firmware/host/base/wall_time.h - "2026-11-23T21:00:00.5Z" as nanoseconds
 * since 1970, without leap seconds.
 *
 * Date, T or a blank, hours, minutes, seconds with at most nine decimals, and
 * Z or the distance from UTC, +01:00.  Years 1970 to 2261.
 * Source: RFC 3339, 5.6. */
#ifndef FIRMWARE_HOST_BASE_WALL_TIME_H
#define FIRMWARE_HOST_BASE_WALL_TIME_H

#include <stdint.h>

/* NULL, or what is wrong with it: "has no time zone". */
const char *wall_time_parse(const char *text, int64_t *t_ns);

#endif

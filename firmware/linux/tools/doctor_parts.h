/* firmware/linux/tools/doctor_parts.h - private to doctor*.c: what the parts
 * share. */
#ifndef FIRMWARE_LINUX_TOOLS_DOCTOR_PARTS_H
#define FIRMWARE_LINUX_TOOLS_DOCTOR_PARTS_H

#include <stddef.h>

#include "firmware/linux/tools/doctor.h"

#define DOCTOR_PATH_MAX 512
#define DOCTOR_TEXT_MAX 256

/* ---- doctor.c ---- */

/* A line of the report, its advice still empty. */
void doctor_say(struct doctor *doctor, enum doctor_verdict verdict,
                const char *topic, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
/* Advice for the line that was said last. */
void doctor_advise(struct doctor *doctor, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* root + the formatted path */
void doctor_path(const struct doctor *doctor, char path[DOCTOR_PATH_MAX],
                 const char *format, ...) __attribute__((format(printf, 3, 4)));
/* The beginning of a file, at most size - 1 bytes, without the white space at
 * its end; false: not there or not readable. */
bool doctor_read(const struct doctor *doctor, char *text, size_t size,
                 const char *format, ...) __attribute__((format(printf, 4, 5)));
bool doctor_read_number(const struct doctor *doctor, int64_t *number,
                        const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* Names in a directory that begin with `prefix`, sorted; how many, at most
 * `max`. */
#define DOCTOR_NAME_MAX 64
#define DOCTOR_NAMES    64
unsigned doctor_list(const struct doctor *doctor, const char *directory,
                     const char *prefix,
                     char name[DOCTOR_NAMES][DOCTOR_NAME_MAX]);

/* ---- the parts ---- */

void doctor_rights(struct doctor *doctor);
void doctor_can(struct doctor *doctor);
void doctor_lines(struct doctor *doctor);
void doctor_cpu(struct doctor *doctor);
void doctor_kernel(struct doctor *doctor);
void doctor_libraries(struct doctor *doctor);
void doctor_jitter(struct doctor *doctor);

/* doctor_rights.c: may we read and write this device file?  Says so, with what
 * to do; `needed`: the rig uses it. */
void doctor_device(struct doctor *doctor, const char *path, bool needed);

#define DOCTOR_CAP_DAC_OVERRIDE 1
#define DOCTOR_CAP_NET_ADMIN    12
#define DOCTOR_CAP_IPC_LOCK     14
#define DOCTOR_CAP_SYS_NICE     23

#endif

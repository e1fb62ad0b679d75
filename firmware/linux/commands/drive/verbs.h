/* firmware/linux/commands/drive/verbs.h - private to cmd_drive.c and
 * drive_*.c: the verbs of slew drive. */
#ifndef FIRMWARE_LINUX_COMMANDS_DRIVE_VERBS_H
#define FIRMWARE_LINUX_COMMANDS_DRIVE_VERBS_H

#include "firmware/host/base/files.h"
#include "firmware/host/device/object.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/tools/session.h"

/* path[0] is the verb, the rest what it needs. */
enum status drive_sheet(const struct options *options);
enum status drive_info(const struct options *options);
enum status drive_get(const struct options *options);
enum status drive_set(const struct options *options);
enum status drive_store(const struct options *options);
enum status drive_reset(const struct options *options);
enum status drive_lss(const struct options *options);

/* Open the drive of path[1] and path[2]; with one line on stderr when that
 * fails.  drive_close afterwards. */
enum status drive_open(const struct options *options, struct session **session);
void drive_close(struct session *session);
/* "slew drive: what", and STATUS_INPUT. */
enum status drive_complain(const char *what);
/* The same with the drive's name before it, and the status that fits. */
enum status drive_failed(const struct session *session, const char *what,
                         int err);
/* Refuses when it may have torque: nothing is written then.  A drive that does
 * not say is one the user knows about (--yes). */
enum status drive_must_be_off(struct session *session,
                              const struct options *options);

/* ---- quirks.c: what a CiA 402 drive's maker does otherwise ---- */

#define DRIVE_QUIRKS_LINES_MAX 32
#define DRIVE_QUIRKS_LINE_MAX  96

struct drive_quirks {
    const struct drive_cia402_quirk *quirk; /* NULL: none are known */
    char path[FILES_PATH_MAX];
    struct quirk_file file;
    bool is_of_another; /* the rig names them, and the drive is not of them */
    char line[DRIVE_QUIRKS_LINES_MAX]
             [DRIVE_QUIRKS_LINE_MAX]; /* what slew does */
    unsigned line_count;
};
/* Of a drive with this 0x1018; by the rig's axis where there is one.  0, or -1
 * with a sentence. */
int drive_quirks_find(const struct rig *rig, const struct rig_axis *axis,
                      uint32_t vendor, uint32_t product,
                      struct drive_quirks *quirks,
                      char message[YAML_MESSAGE_MAX]);
void drive_quirks_print(const struct drive_quirks *quirks);
void drive_quirks_json(const struct drive_quirks *quirks, struct cJSON *report);

/* ---- value.c ---- */

/* An object or register, read. */
struct drive_value {
    char name[QUANTITY_NAME_MAX]; /* "Position actual value" ... */
    char number[OBJECT_NUMBER_MAX];
    char type[8], unit[20];
    bool is_number;
    bool is_real; /* the value is `real`, and `value` its bits */
    int64_t value;
    double real;
    char text[OBJECT_TEXT_MAX];   /* in words, or the text itself */
    char error[SESSION_TEXT_MAX]; /* "": it was read */
};
/* Says in the axis's units what the drive counts; axis: of the rig, or NULL. */
void drive_value_in_units(const struct rig_axis *axis,
                          struct drive_value *value);
void drive_values_print(const struct drive_value *value, unsigned count);
struct cJSON *drive_values_json(const struct drive_value *value,
                                unsigned count);

#endif

/* firmware/linux/commands/drive/kind.h - what a kind of drive does for the verbs
 * of slew drive; see firmware/host/rig/kind.h. */
#ifndef FIRMWARE_LINUX_COMMANDS_DRIVE_KIND_H
#define FIRMWARE_LINUX_COMMANDS_DRIVE_KIND_H

#include "firmware/linux/commands/drive/verbs.h"
#include "firmware/linux/tools/kind.h"

/* What is read or written, by the kind of drive. */
struct drive_what {
    struct object object;
    struct quantity quantity;
    const struct modbus_map_item *item;
    struct modbus_map_item raw;
};

#define DRIVE_INFO_VALUES_MAX 96

/* What slew drive info shows. */
struct drive_info {
    struct drive_value value[DRIVE_INFO_VALUES_MAX];
    unsigned count, errors; /* the last `errors` are the history */
    struct {
        char number[OBJECT_NUMBER_MAX];
        const char *why;
    } missing[DRIVE_INFO_VALUES_MAX];
    unsigned missing_count;
    char fault[RESET_TEXT_MAX]; /* "": none, or it is not said here */
    struct drive_quirks quirks;
    bool is_unsupervised;
    bool is_judged; /* whether it has what slew needs is known: */
    bool ok;
};

struct verb_kind {
    /* Of --kind, after its word: what WHAT is, for the help; NULL: it says it. */
    const char *what;
    const char *stored_by; /* its maker's program, where `store` is NULL */
    /* STATUS_OK, or another with a sentence. */
    enum status (*find)(struct session *session, const char *text,
                        const struct options *options, struct drive_what *what);
    void (*read)(struct session *session, const struct drive_what *what,
                 struct drive_value *value);
    enum status (*parse)(struct session *session, const char *text,
                         struct drive_what *what, int64_t *value);
    /* Errors of the bus. */
    int (*write)(struct session *session, const struct drive_what *what,
                 int64_t value);
    /* Writing it may move the drive; NULL: nothing is known to. */
    bool (*moves)(const struct drive_what *what);
    /* NULL: everything can be written; everything can be read back. */
    bool (*is_writable)(const struct drive_what *what);
    bool (*is_readable)(const struct drive_what *what);
    enum status (*store)(struct session *session);
    /* Fills in what is not 0. */
    enum status (*info)(struct session *session, struct drive_info *info);
};

#define VERB_KIND_ROW(NAME, name, word)                                        \
    extern const struct verb_kind verb_kind_##name;
RIG_KIND_LIST(VERB_KIND_ROW)

/* By enum rig_drive_kind. */
extern const struct verb_kind *const verb_kinds[RIG_DRIVE_KINDS];
/* Of this drive. */
const struct verb_kind *verb_kind_of(const struct session *session);

#endif

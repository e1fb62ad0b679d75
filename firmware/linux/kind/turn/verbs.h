/* firmware/linux/kind/turn/verbs.h - what slew drive does alike with all drives
 * that count turns; see firmware/linux/commands/drive/kind.h. */
#ifndef FIRMWARE_LINUX_KIND_TURN_VERBS_H
#define FIRMWARE_LINUX_KIND_TURN_VERBS_H

#include "firmware/linux/commands/drive/kind.h"

/* What a number or a name is; 0, or -1 with a sentence. */
typedef int turn_find(const struct session *session, const char *text,
                      const struct options *options, struct quantity *quantity,
                      char message[QUANTITY_MESSAGE_MAX]);

/* Asks the drive what it is, then `find`. */
enum status turn_find_quantity(struct session *session, const char *text,
                               const struct options *options,
                               struct quantity *quantity, turn_find *find);
bool turn_number(const char *text, unsigned long most, uint16_t *number);
/* By its number alone, writable: a float, until turn_type. */
struct quantity turn_by_number(enum quantity_kind kind, uint16_t number);
/* The one of that name; 0, or -1 with a sentence: it is no `what`. */
int turn_by_name(const char *text, const char *what,
                 const struct quantity *list, unsigned count,
                 struct quantity *quantity, char message[QUANTITY_MESSAGE_MAX]);
int turn_type(const struct options *options, struct quantity *quantity,
              char message[QUANTITY_MESSAGE_MAX]);

/* All of a list that can be asked for, what it does not say left out. */
void turn_read_list(struct session *session, const struct quantity *list,
                    unsigned count, struct drive_info *info);
/* Why it is in fault. */
enum status turn_info_fault(struct session *session, struct drive_info *info);

/* ---- as members of struct verb_kind ---- */

void turn_read(struct session *session, const struct drive_what *what,
               struct drive_value *value);
enum status turn_parse(struct session *session, const char *text,
                       struct drive_what *what, int64_t *value);
int turn_write(struct session *session, const struct drive_what *what,
               int64_t value);
bool turn_is_writable(const struct drive_what *what);
bool turn_is_readable(const struct drive_what *what);

#endif

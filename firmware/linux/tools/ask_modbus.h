/* firmware/linux/tools/ask_modbus.h - Modbus transactions, each waited for.
 *
 * For tools, never for the tick. */
#ifndef FIRMWARE_LINUX_TOOLS_ASK_MODBUS_H
#define FIRMWARE_LINUX_TOOLS_ASK_MODBUS_H

#include "hal/clock.h"
#include "hal/modbus.h"
#include "hal/modbus/map.h"

struct ask_modbus {
    struct hal_modbus *line;
    struct hal_clock *clock;
    uint8_t unit;
    uint32_t tag;
    struct hal_modbus_reply reply; /* the last one */
};

void ask_modbus_init(struct ask_modbus *ask, struct hal_modbus *line,
                     struct hal_clock *clock, uint8_t unit);
/* One transaction; ask->reply is its reply.  reply.err, or MOTION_E_IO when
 * there is no connection after a second. */
int ask_modbus(struct ask_modbus *ask,
               const struct hal_modbus_request *request);

int ask_modbus_read_item(struct ask_modbus *ask,
                         const struct modbus_map_item *item, int64_t *value);
int ask_modbus_write_item(struct ask_modbus *ask,
                          const struct modbus_map_item *item, int64_t value);
/* Is a condition of the map met?  *met says it; a status that the drive does
 * not have is MOTION_E_EMPTY. */
int ask_modbus_status(struct ask_modbus *ask, const struct modbus_map *map,
                      enum modbus_map_status status, bool *met);
/* Every step of one, in order.  MOTION_E_TIMEOUT when a status does not become
 * what it should in time. */
int ask_modbus_sequence(struct ask_modbus *ask, const struct modbus_map *map,
                        enum modbus_map_sequence_name name);

/* Why it did not work: "illegal data address (exception 2)". */
#define ASK_MODBUS_TEXT_MAX 80
void ask_modbus_text(const struct ask_modbus *ask, int err,
                     char text[ASK_MODBUS_TEXT_MAX]);

#endif

/* firmware/linux/tools/modbus_client.h - Modbus transactions, each waited for.
 *
 * For tools, never for the tick. */
#ifndef FIRMWARE_LINUX_TOOLS_MODBUS_CLIENT_H
#define FIRMWARE_LINUX_TOOLS_MODBUS_CLIENT_H

#include "hal/clock.h"
#include "hal/modbus.h"
#include "hal/modbus/map.h"

struct modbus_client {
    struct hal_modbus *line;
    struct hal_clock *clock;
    uint8_t unit;
    uint32_t tag;
    struct hal_modbus_reply reply; /* the last one */
};

void modbus_client_init(struct modbus_client *client, struct hal_modbus *line,
                        struct hal_clock *clock, uint8_t unit);
/* One transaction; ask->reply is its reply.  reply.err, or MOTION_E_IO when
 * there is no connection after a second. */
int modbus_client(struct modbus_client *client,
                  const struct hal_modbus_request *request);

int modbus_client_read_item(struct modbus_client *client,
                            const struct modbus_map_item *item, int64_t *value);
int modbus_client_write_item(struct modbus_client *client,
                             const struct modbus_map_item *item, int64_t value);
/* Is a condition of the map met?  *met says it; a status that the drive does
 * not have is MOTION_E_EMPTY. */
int modbus_client_status(struct modbus_client *client,
                         const struct modbus_map *map,
                         enum modbus_map_status status, bool *met);
/* Every step of one, in order.  MOTION_E_TIMEOUT when a status does not become
 * what it should in time. */
int modbus_client_sequence(struct modbus_client *client,
                           const struct modbus_map *map,
                           enum modbus_map_sequence_name name);

/* Why it did not work: "illegal data address (exception 2)". */
#define MODBUS_CLIENT_TEXT_MAX 80
void modbus_client_text(const struct modbus_client *client, int err,
                        char text[MODBUS_CLIENT_TEXT_MAX]);

#endif

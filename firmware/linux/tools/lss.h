/* firmware/linux/tools/lss.h - node numbers and bit rates for one device, step
 * by step, each waited for; see hal/canopen/lss.h. */
#ifndef FIRMWARE_LINUX_TOOLS_LSS_H
#define FIRMWARE_LINUX_TOOLS_LSS_H

#include "firmware/linux/tools/canopen_client.h"

/* "VENDOR,PRODUCT,REVISION,SERIAL", decimal or 0x...; false: it is not. */
bool lss_identity(const char *text, struct canopen_identity *identity);

/* Bring one device into its configuration state: that of `wanted`, or (NULL)
 * one without node number.  *found is who it is.  MOTION_E_TIMEOUT: nobody. */
int lss_select(struct canopen_client *client,
               const struct canopen_identity *wanted,
               struct canopen_identity *found);
/* All devices go on with their work. */
void lss_release(struct canopen_client *client);

/* Its node number, 255 for none. */
int lss_request_node(struct canopen_client *client, uint8_t *id);
/* To the selected one.  MOTION_E_REFUSED: it will not; MOTION_E_ARG: no such
 * bit rate. */
int lss_node(struct canopen_client *client, uint8_t id);
int lss_bit_rate(struct canopen_client *client, uint32_t bit_rate);
int lss_store(struct canopen_client *client);

#endif

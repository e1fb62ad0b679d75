/* hal/canopen_sdo.h - private to canopen*.c: the SDO client's ends. */
#ifndef HAL_CANOPEN_SDO_H
#define HAL_CANOPEN_SDO_H

#include "hal/canopen.h"

/* Identifiers of the predefined connection set, without the node id. */
enum canopen_cob {
    CANOPEN_COB_NMT = 0x000,
    CANOPEN_COB_SYNC = 0x080,
    CANOPEN_COB_EMCY = 0x080,
    CANOPEN_COB_RPDO1 = 0x200,
    CANOPEN_COB_SDO_REQUEST = 0x600,
    CANOPEN_COB_HEARTBEAT = 0x700,
};

/* Send and count; every frame of the master goes through here. */
int canopen_send(struct canopen *master, const struct hal_can_frame *frame);
int canopen_flush(struct canopen *master);
/* A frame with id 0x580 + node. */
void canopen_sdo_receive(struct canopen_node *node,
                         const struct hal_can_frame *frame);
/* Give up a transfer that is past its deadline. */
void canopen_sdo_expire(struct canopen_node *node, int64_t now_ns);

#endif

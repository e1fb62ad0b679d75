/* hal/canopen/sdo.h - private to canopen*.c: the SDO client's ends. */
#ifndef HAL_CANOPEN_SDO_H
#define HAL_CANOPEN_SDO_H

#include "hal/canopen/canopen.h"

/* Identifiers of the predefined connection set, without the node id. */
enum canopen_cob {
    CANOPEN_COB_NMT = 0x000,
    CANOPEN_COB_SYNC = 0x080,
    CANOPEN_COB_EMCY = 0x080,
    CANOPEN_COB_TIME = 0x100,
    CANOPEN_COB_RPDO1 = 0x200,
    CANOPEN_COB_TPDO3 = 0x380,
    CANOPEN_COB_SDO_REQUEST = 0x600,
    CANOPEN_COB_HEARTBEAT = 0x700,
    CANOPEN_COB_LSS_ANSWER = 0x7E4,
    CANOPEN_COB_LSS_REQUEST = 0x7E5,
};

/* A frame with id 0x580 + node. */
void canopen_sdo_receive(struct canopen_node *node,
                         const struct hal_can_frame *frame, int64_t now_ns);
/* Some more segments of a block that is being written; once a cycle. */
void canopen_sdo_pump(struct canopen_node *node, int64_t now_ns);
/* Give up a transfer that is past its deadline. */
void canopen_sdo_expire(struct canopen_node *node, int64_t now_ns);

/* guard.c: ask the nodes whose time it is; is this answer's toggle the
 * expected one? */
void canopen_guard_request(struct canopen_node *node, int64_t now_ns);
bool canopen_guard_toggles(struct canopen_node *node, uint8_t answer);
/* lss.c: a frame with id 0x7E4; time-outs. */
void canopen_lss_receive(struct canopen_lss *lss,
                         const struct hal_can_frame *frame, int64_t now_ns);
void canopen_lss_expire(struct canopen_lss *lss, int64_t now_ns);

/* ---- between sdo.c, segment.c and block.c ---- */

/* First byte of a frame, bits 7-5: what it is. */
#define SDO_WRITE         0x20u /* + size << 2, + 3: expedited, size given */
#define SDO_WRITE_DONE    0x60u
#define SDO_READ          0x40u
#define SDO_READ_DONE     0x40u
#define SDO_ABORT         0x80u
#define SDO_EXPEDITED     0x02u
#define SDO_SIZE_GIVEN    0x01u
#define SDO_COMMAND(byte) ((byte)&0xE0u)

#define SDO_SEGMENT_BYTES 7u

uint32_t canopen_sdo_get_u32(const uint8_t *at);
int canopen_sdo_send(struct canopen_node *node, const uint8_t data[8]);
void canopen_sdo_done(struct canopen_node *node);
/* Tell the server, and end. */
void canopen_sdo_give_up(struct canopen_node *node, uint32_t abort_code);

/* The server's answer to the initiation of a long transfer, and what follows;
 * `data` has 8 bytes. */
void canopen_segment_read_begin(struct canopen_node *node, const uint8_t *data);
void canopen_segment_write_begin(struct canopen_node *node);
void canopen_segment_receive(struct canopen_node *node, const uint8_t *data);
void canopen_block_begin(struct canopen_node *node, const uint8_t *data);
void canopen_block_receive(struct canopen_node *node, const uint8_t *data);

#endif

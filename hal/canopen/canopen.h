/* hal/canopen/canopen.h - a CANopen NMT master for servo drives (CiA 301).
 *
 * One object per CAN port.  It owns the port, sends SYNC and its own heartbeat
 * (or guards), and hands every received frame to the node it belongs to.  Nodes
 * are visible structs in the caller's memory, linked into the master; a drive
 * (hal/drive/cia402/drive.h) embeds one.  Nothing blocks: SDO transfers are
 * started and then polled; every wait has a time-out.
 *
 * Cycle: begin() drains the port (TPDOs that answered the last SYNC), sends
 * SYNC and moves SDO, heartbeat and drive state machines on; end() sends the
 * RPDOs, which the drives put in force at the next SYNC.  begin() is called
 * once per SYNC period: every call sends one.
 *
 * A frame the port refuses is not kept: the next cycle has a newer one.
 * Freestanding, no heap, no division.  Source: CiA 301 4.2, 7.2 and 7.3. */
#ifndef HAL_CANOPEN_CANOPEN_H
#define HAL_CANOPEN_CANOPEN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal/can/cycle.h"
#include "hal/fieldbus.h"

MOTION_C_BEGIN

enum canopen_nmt_command {
    CANOPEN_NMT_START = 0x01,
    CANOPEN_NMT_STOP = 0x02,
    CANOPEN_NMT_PRE_OPERATIONAL = 0x80,
    CANOPEN_NMT_RESET_NODE = 0x81,
    CANOPEN_NMT_RESET_COMMUNICATION = 0x82,
};

enum canopen_nmt_state {
    CANOPEN_NMT_BOOT_UP = 0x00,
    CANOPEN_NMT_STOPPED = 0x04,
    CANOPEN_NMT_OPERATIONAL = 0x05,
    CANOPEN_NMT_PRE_OPERATIONAL_STATE = 0x7F,
    CANOPEN_NMT_UNKNOWN = 0xFF, /* no heartbeat seen yet, or lost */
};

/* The abort codes that are looked at; canopen_abort_text has them all. */
#define CANOPEN_ABORT_TOGGLE        UINT32_C(0x05030000)
#define CANOPEN_ABORT_BLOCK_SIZE    UINT32_C(0x05040002)
#define CANOPEN_ABORT_SEQUENCE      UINT32_C(0x05040003)
#define CANOPEN_ABORT_CRC           UINT32_C(0x05040004)
#define CANOPEN_ABORT_MEMORY        UINT32_C(0x05040005)
#define CANOPEN_ABORT_LENGTH        UINT32_C(0x06070010)
#define CANOPEN_ABORT_TIMEOUT       UINT32_C(0x05040000)
#define CANOPEN_ABORT_COMMAND       UINT32_C(0x05040001)
#define CANOPEN_ABORT_READ_ONLY     UINT32_C(0x06010002)
#define CANOPEN_ABORT_NO_OBJECT     UINT32_C(0x06020000)
#define CANOPEN_ABORT_NO_SUB        UINT32_C(0x06090011)
#define CANOPEN_ABORT_WRITE_ONLY    UINT32_C(0x06010001)
#define CANOPEN_ABORT_HARDWARE      UINT32_C(0x06060000)
#define CANOPEN_ABORT_LOCAL         UINT32_C(0x08000021)
#define CANOPEN_ABORT_PRESENT_STATE UINT32_C(0x08000022)

/* Sentence for an SDO abort code (CiA 301 table 22); never NULL. */
const char *canopen_abort_text(uint32_t abort_code);
/* Words for the class of an emergency error code (CiA 301 table 26 and CiA
 * 402-2 table 5): "current, inside the device"; never NULL. */
const char *canopen_emcy_text(uint16_t code);

/* Where a transfer is; private. */
enum canopen_sdo_step {
    CANOPEN_SDO_INITIATE,
    CANOPEN_SDO_SEGMENT,
    CANOPEN_SDO_BLOCK,     /* segments of a block, and its acknowledgement */
    CANOPEN_SDO_BLOCK_END, /* the last word: length and CRC */
};

/* One SDO transfer, at most one at a time per node. */
struct canopen_sdo {
    enum {
        CANOPEN_SDO_IDLE,
        CANOPEN_SDO_WAIT,
        CANOPEN_SDO_DONE,
        CANOPEN_SDO_ABORTED,
        CANOPEN_SDO_TIMEOUT
    } state;
    bool write;
    uint16_t index;
    uint8_t sub;
    uint8_t size; /* bytes written, or received, of a short object */
    uint32_t value;
    uint32_t abort_code;
    uint32_t
        doubtful_code; /* of an abort that may be of an earlier transfer: it
                               counts when no other answer comes; 0: none */
    int64_t deadline_ns;

    /* a long object, or a short one by segments */
    uint8_t small[4];          /* reading, where into is NULL */
    uint8_t *into;             /* reading: room bytes */
    const uint8_t *from;       /* writing: length bytes */
    uint32_t capacity, length; /* length 0 while reading: not told yet */
    uint32_t at;               /* bytes there, or acknowledged */
    enum canopen_sdo_step step;
    uint8_t toggle;
    bool block, checked;          /* block transfer; with CRC */
    uint8_t block_size, sequence; /* segments per block; last one in it */
    bool block_last;              /* the end of the object is in this block */
    uint16_t crc;                 /* of the first crc_at bytes */
    uint32_t crc_at;
};

/* Answers to transfers on one object that were given up, which may still come.  A
 * server answers in order: the answer to a transfer on another object means that
 * none does. */
struct canopen_sdo_late {
    uint16_t index;
    uint8_t sub;
    uint8_t count;
};

struct canopen_node;

/* What a node's owner is told; a NULL slot is not called.  All are
 * called from begin(), but rpdo from end(). */
struct canopen_node_ops {
    void (*step)(struct canopen_node *node, int64_t now_ns); /* after SYNC */
    /* `number` 1..4.  False: shorter than mapped; then it counts as malformed.
     */
    bool (*tpdo)(struct canopen_node *node, unsigned number,
                 const struct hal_can_frame *frame);
    void (*emcy)(struct canopen_node *node, uint16_t code, uint8_t reg,
                 const uint8_t maker[5]);
    void (*boot_up)(struct canopen_node *node, int64_t now_ns);
    /* Once, when nothing was heard for heartbeat_timeout_ns. */
    void (*heartbeat_lost)(struct canopen_node *node, int64_t now_ns);
    /* Fill the RPDO to send in end(); return its number of bytes, 0: none. */
    unsigned (*rpdo)(struct canopen_node *node, unsigned number,
                     uint8_t data[8]);
};

#define CANOPEN_OWN_PDOS 2

/* A device of several axes has a node for each (CiA 301 7.5.2.1: a multiple
 * device module), all with one id and each with its own `axis`.  Heartbeat,
 * boot-up, emergencies and NMT states are for all of them; the first added is
 * guarded.  They share one SDO channel: one transfer at a time, and of two that
 * wait the one that was served longer ago.
 *
 * Watched by its heartbeat, or (older devices) by node guarding: then we ask
 * with a remote frame every guard_period_ns, and it answers with its state and
 * a bit that must alternate.  A node does one or the other. */
struct canopen_node {
    const struct canopen_node_ops *ops;
    uint8_t id;   /* 1..127 */
    uint8_t axis; /* of the device, from 0; see below */
    /* Identifiers of its first two PDOs each way; 0: of the predefined set, or
     * of another axis than the first none */
    uint16_t rpdo_id[CANOPEN_OWN_PDOS], tpdo_id[CANOPEN_OWN_PDOS];
    enum canopen_nmt_state nmt_state; /* as last heard */
    int64_t heartbeat_ns;             /* when last heard */
    bool heartbeat_heard;             /* since start or since it was lost */
    int64_t heartbeat_timeout_ns;     /* 0: not watched */
    int64_t guard_period_ns;          /* 0: not asked */
    int64_t guard_due_ns;
    uint8_t guard_toggle;   /* that the next answer must have: 0 or 0x80 */
    int64_t sdo_timeout_ns; /* 0: the master's */
    struct canopen_sdo sdo;
    struct canopen_sdo_late sdo_late; /* of the device: in its first axis */
    int64_t sdo_requested_ns, sdo_served_ns; /* refused, or begun, last */
    struct canopen_node *sibling; /* the next axis of the device, in a ring */
    struct canopen_node *next;    /* on the bus, in the order of adding */
    struct canopen *master;
};

struct canopen_config {
    uint8_t node_id;             /* our own, for the heartbeat; 1..127 */
    int64_t sync_period_ns;      /* 0: no SYNC */
    uint8_t sync_overflow;       /* SYNC counts 1 .. this, 2..240; 0: it does
                                    not (0x1019 of the drives) */
    int64_t heartbeat_period_ns; /* 0: we produce none */
    int64_t sdo_timeout_ns;      /* per transfer; 0: 200 ms */
    /* From one SDO request to the next, over all nodes: what they may take from
     * the set points of drives that already run.  0: two SYNC periods, at most
     * 2 ms. */
    int64_t sdo_gap_ns;
};

struct canopen_stats {
    uint64_t sync_sent, rpdo_sent, tpdo_received, emcy_received;
    uint64_t sdo_done, sdo_aborted, sdo_timeouts;
    uint64_t unexpected; /* frames for nobody, late SDO answers */
    uint64_t malformed;  /* PDO, SDO, EMCY, heartbeat of the wrong length */
    /* SYNC, NMT, our own heartbeat id, or a PDO or SDO request for one of our
     * nodes, from outside */
    uint64_t foreign_master;
};

struct canopen {
    struct hal_fieldbus fieldbus;
    struct can_cycle cycle; /* of the port */
    struct canopen_config config;
    struct canopen_node *first, *last;
    struct canopen_node *node_at[128]; /* by node id: its first axis */
    int64_t sync_ns;                   /* when the last SYNC was sent */
    int64_t sync_previous_ns;          /* and the one before */
    uint8_t sync_counter;
    struct canopen_lss *lss; /* NULL: nobody listens; see lss.h */
    int64_t heartbeat_due_ns;
    int64_t sdo_started_ns; /* last request of a transfer, any node */
    struct canopen_stats stats;
};

/* MOTION_E_ARG: own id outside 1..127 or a negative time. */
int canopen_init(struct canopen *master, struct hal_can *can,
                 const struct canopen_config *config);
/* The node is the caller's.  MOTION_E_ARG for an id outside 1..127, an axis of it that
 * is taken, or an identifier of a PDO that is not free. */
int canopen_add(struct canopen *master, struct canopen_node *node);
/* 0x181 to 0x57F, 0x680 to 0x6DF: the rest is kept for NMT, SYNC, EMCY, TIME,
 * SDO and heartbeats (CiA 301 table 40). */
bool canopen_id_is_for_pdos(uint32_t id);
/* May a PDO of this node have it?  Not what CiA 301 7.3.5 keeps for something
 * else, nor what is of another PDO of the nodes that were added. */
bool canopen_pdo_id_is_free(const struct canopen *master,
                            const struct canopen_node *node, uint32_t id);
/* Has the device one axis only, as far as the master goes? */
bool canopen_is_single(const struct canopen_node *node);
/* Is it the one of the siblings that was added first? */
bool canopen_is_first(const struct canopen_node *node);

/* node_id 0: all.  Not acknowledged: the proof is the next heartbeat.  Errors
 * of hal_can_send, and MOTION_E_ARG. */
int canopen_nmt(struct canopen *master, enum canopen_nmt_command command,
                uint8_t node_id);

/* TIME: milliseconds since midnight, 0 .. 86399999, and days since 1 January
 * 1984 (CiA 301 7.2.6).  Errors of hal_can_send, and MOTION_E_ARG. */
int canopen_time(struct canopen *master, uint32_t ms, uint16_t days);

/* How long an answer of this node may take. */
int64_t canopen_sdo_timeout_ns(const struct canopen_node *node);

/* Start a transfer; size 1..4 bytes (else MOTION_E_ARG).  MOTION_E_STATE when
 * one is running or its outcome has not been taken, MOTION_E_AGAIN when another
 * node's request has just gone out (sdo_gap_ns), MOTION_E_FULL/IO when it could
 * not be sent.  Then canopen_sdo_take reads the outcome and is idle
 * again:
 *   MOTION_E_AGAIN running; MOTION_OK done (value, not sign extended, and size
 *   when reading; either pointer may be NULL); MOTION_E_REFUSED aborted
 *   (sdo.abort_code); MOTION_E_TIMEOUT; MOTION_E_STATE nothing was started.
 * The first two are for objects of up to 4 bytes, which a server may send by
 * segments too (a longer one ends with abort 0x06070010); the others take one of
 * any length, by segments or by blocks.  Their
 * memory belongs to the transfer until its outcome is taken, or it is dropped;
 * sdo.length is how much there was.  Reading more than `capacity` bytes ends with
 * abort 0x05040005.  `block`: a server without blocks aborts with
 * 0x05040001; ask again without.  The time-out is for each answer. */
int canopen_sdo_write(struct canopen_node *node, int64_t now_ns, uint16_t index,
                      uint8_t sub, uint8_t size, uint32_t value);
int canopen_sdo_read(struct canopen_node *node, int64_t now_ns, uint16_t index,
                     uint8_t sub);
int canopen_sdo_read_bytes(struct canopen_node *node, int64_t now_ns,
                           uint16_t index, uint8_t sub, uint8_t *into,
                           uint32_t capacity, bool block);
/* length >= 1 */
int canopen_sdo_write_bytes(struct canopen_node *node, int64_t now_ns,
                            uint16_t index, uint8_t sub, const uint8_t *from,
                            uint32_t length, bool block);
int canopen_sdo_take(struct canopen_node *node, uint32_t *value, uint8_t *size);
/* Forget the transfer that is running, if any; a late answer is dropped. */
void canopen_sdo_drop(struct canopen_node *node);

MOTION_C_END

#endif

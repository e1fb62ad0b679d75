/* hal/canopen/lss.h - node numbers and bit rates for devices that have none, or
 * the wrong one (layer setting services).
 *
 * One object beside a master: master->lss = &lss.  One request at a time: start
 * it, then take its outcome.  Devices that are to be set are brought into their
 * configuration state: all of them (only one may be on the bus then), or the
 * one with a given identity; scan finds the identity of one without node
 * number.  Not while drives move: some devices stop their other services.
 *
 * Source: CiA 305 3.7 to 3.9.  Freestanding, no heap, no division. */
#ifndef HAL_CANOPEN_LSS_H
#define HAL_CANOPEN_LSS_H

#include "hal/canopen/canopen.h"

MOTION_C_BEGIN

/* 0x1018 sub 1 to 4. */
struct canopen_identity {
    uint32_t vendor, product, revision, serial;
};

enum canopen_lss_bit_rate { /* CiA 305's table */
                            CANOPEN_LSS_1000K = 0,
                            CANOPEN_LSS_800K = 1,
                            CANOPEN_LSS_500K = 2,
                            CANOPEN_LSS_250K = 3,
                            CANOPEN_LSS_125K = 4,
                            CANOPEN_LSS_50K = 6,
                            CANOPEN_LSS_20K = 7,
                            CANOPEN_LSS_10K = 8,
};

struct canopen_lss {
    struct canopen *master;
    enum {
        CANOPEN_LSS_IDLE,
        CANOPEN_LSS_WAIT,
        CANOPEN_LSS_SCAN,
        CANOPEN_LSS_DONE,
        CANOPEN_LSS_REFUSED,
        CANOPEN_LSS_TIMEOUT,
    } state;
    uint8_t command; /* whose answer is waited for */
    uint8_t error;   /* of a refusal, the device's: 1 value, 255 its own */
    uint32_t value;  /* of the answer to an inquiry */
    int64_t deadline_ns;
    struct canopen_identity found; /* by a scan, so far */
    uint8_t scan_part, scan_bit;
    bool scan_heard, scan_checks; /* what was found is asked who it is */
};

/* lss stays linked to the master. */
void canopen_lss_init(struct canopen_lss *lss, struct canopen *master);

/* Every device on the bus into its configuration state, or back.  Nobody
 * answers.  Errors of hal_can_send; MOTION_E_STATE while a request runs. */
int canopen_lss_switch_all(struct canopen_lss *lss, bool configure);

/* Each starts a request: MOTION_OK, MOTION_E_STATE, MOTION_E_ARG for a number
 * that cannot be, errors of hal_can_send. */
int canopen_lss_switch(struct canopen_lss *lss, int64_t now_ns,
                       const struct canopen_identity *identity);
/* 1..127, or 255: none. */
int canopen_lss_set_node(struct canopen_lss *lss, int64_t now_ns, uint8_t id);
int canopen_lss_set_bit_rate(struct canopen_lss *lss, int64_t now_ns,
                             enum canopen_lss_bit_rate bit_rate);
/* Keep both over power-off. */
int canopen_lss_store(struct canopen_lss *lss, int64_t now_ns);
int canopen_lss_request_node(struct canopen_lss *lss, int64_t now_ns);
/* part 0..3: vendor, product, revision, serial */
int canopen_lss_request_identity(struct canopen_lss *lss, int64_t now_ns,
                                 unsigned part);
/* Find one device without node number; it is in its configuration state then,
 * and lss->found its identity.  Takes some 133 questions of 10 ms.  An answer
 * that comes late answers the wrong question, so the device is asked for its
 * identity at the end. */
int canopen_lss_scan(struct canopen_lss *lss, int64_t now_ns);

/* MOTION_E_AGAIN running; MOTION_OK (lss->value); MOTION_E_REFUSED
 * (lss->error); MOTION_E_TIMEOUT nobody answered; MOTION_E_STATE nothing was
 * started. */
int canopen_lss_take(struct canopen_lss *lss);

MOTION_C_END

#endif

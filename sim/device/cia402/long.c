/* sim/device/cia402/long.c - the SDO server: transfers by segments and by
 * blocks.
 *
 * What is written is kept aside until it is whole.  While a block is being
 * received every frame is a segment of it; between blocks, and by segments,
 * requests are told apart by their first byte.  Written from CiA 301 7.2.4.3,
 * independently of hal/. */
#include <string.h>

#include "sim/device/cia402/parts.h"

#define CIA402_SEGMENT 7 /* data bytes of a segment */

/* Segments that we take in one block, and that we hand to the port at once. */
#define CIA402_BLOCK_SEGMENTS 20
#define CIA402_BLOCK_AT_ONCE  16

enum cia402_long_phase {
    CIA402_LONG_NONE,
    CIA402_LONG_UPLOAD,         /* segments, asked for one by one */
    CIA402_LONG_DOWNLOAD,       /* segments, answered one by one */
    CIA402_LONG_BLOCK_READY,    /* waits for the start */
    CIA402_LONG_BLOCK_UPLOAD,   /* segments are going out */
    CIA402_LONG_BLOCK_WAIT,     /* for the block's acknowledgement */
    CIA402_LONG_BLOCK_SENT,     /* our end has gone out */
    CIA402_LONG_BLOCK_DOWNLOAD, /* segments are coming in */
    CIA402_LONG_BLOCK_END,      /* waits for the client's end */
};

void cia402_long_end(struct sim_cia402 *self)
{
    self->transfer.phase = CIA402_LONG_NONE;
}

/* Aborting names the object, not the bytes of some segment. */
static void cia402_long_abort(struct sim_cia402 *self, uint32_t abort_code)
{
    const uint16_t index = cia402_od_index(self->transfer.row);
    const uint8_t about[8] = { 0, (uint8_t)index, (uint8_t)(index >> 8),
                               cia402_od_sub(self->transfer.row) };

    cia402_long_end(self);
    cia402_sdo_reply(self, 0x80, about, abort_code);
}

static void cia402_long_start(struct sim_cia402 *self, int row,
                              enum cia402_long_phase phase)
{
    struct sim_cia402_transfer *transfer = &self->transfer;

    transfer->phase = (uint8_t)phase;
    transfer->row = row;
    transfer->length = 0;
    transfer->at = 0;
    transfer->toggle = 0;
    transfer->sequence = 0;
    transfer->last = false;
    transfer->checked = false;
}

/* CRC-16, x^16 + x^12 + x^5 + 1, begun with 0. */
static uint16_t cia402_long_crc(const uint8_t *bytes, uint32_t length)
{
    unsigned crc = 0;

    while (length-- > 0) {
        crc ^= (unsigned)*bytes++ << 8;
        for (int bit = 0; bit < 8; bit++)
            crc = (crc & 0x8000) ? crc << 1 ^ 0x1021 : crc << 1;
    }
    return (uint16_t)crc;
}

/* ---- by segments ------------------------------------------------------- */

void cia402_long_upload(struct sim_cia402 *self, const uint8_t request[8],
                        int row)
{
    struct sim_cia402_transfer *transfer = &self->transfer;
    uint32_t letters = 0;

    cia402_long_start(self, row, CIA402_LONG_UPLOAD);
    transfer->from = cia402_od_bytes(self, row, &transfer->length);
    if (transfer->length > 4 || transfer->length == 0) {
        cia402_sdo_reply(self, 0x41, request, transfer->length);
        return;
    }
    cia402_long_end(self);
    for (unsigned i = 0; i < transfer->length; i++)
        letters |= (uint32_t)transfer->from[i] << 8 * i;
    cia402_sdo_reply(self, (uint8_t)(0x43 | (4 - transfer->length) << 2),
                     request, letters);
}

static void cia402_long_upload_segment(struct sim_cia402 *self)
{
    struct sim_cia402_transfer *transfer = &self->transfer;
    uint32_t left = transfer->length - transfer->at;
    bool last = left <= CIA402_SEGMENT;
    uint32_t len = last ? left : CIA402_SEGMENT;
    uint8_t data[8] = { (uint8_t)(transfer->toggle |
                                  (CIA402_SEGMENT - len) << 1 | last) };

    memcpy(&data[1], transfer->from + transfer->at, len);
    transfer->at += len;
    transfer->toggle ^= 0x10;
    if (last)
        cia402_long_end(self);
    cia402_sdo_send(self, data);
}

void cia402_long_download(struct sim_cia402 *self, const uint8_t request[8],
                          int row)
{
    uint32_t length =
        request[0] & 1 ? cia402_sdo_get_u32(&request[4]) : 0; /* 0: not told */
    uint32_t abort_code = cia402_od_check_long(row, length);

    cia402_long_start(self, row, CIA402_LONG_DOWNLOAD);
    self->transfer.length = length;
    if (abort_code != CIA402_DONE)
        cia402_long_abort(self, abort_code);
    else
        cia402_sdo_reply(self, 0x60, request, 0);
}

/* More bytes than were announced, or than there is room for. */
static bool cia402_long_store(struct sim_cia402 *self, const uint8_t *bytes,
                              uint32_t len)
{
    struct sim_cia402_transfer *transfer = &self->transfer;
    uint32_t most = transfer->length > 0 ? transfer->length : SIM_CIA402_NOTES;

    if (len > most - transfer->at) {
        cia402_long_abort(self, CIA402_ABORT_TOO_LONG);
        return false;
    }
    memcpy(transfer->into + transfer->at, bytes, len);
    transfer->at += len;
    return true;
}

/* All is there: now it counts. */
static bool cia402_long_commit(struct sim_cia402 *self)
{
    struct sim_cia402_transfer *transfer = &self->transfer;

    if (transfer->length > 0 && transfer->at != transfer->length) {
        cia402_long_abort(self, CIA402_ABORT_LENGTH);
        return false;
    }
    cia402_od_write_long(self, transfer->into, transfer->at);
    cia402_long_end(self);
    return true;
}

static void cia402_long_download_segment(struct sim_cia402 *self,
                                         const uint8_t request[8])
{
    struct sim_cia402_transfer *transfer = &self->transfer;
    const uint8_t data[8] = { (uint8_t)(0x20 | transfer->toggle) };

    if (!cia402_long_store(self, &request[1],
                           CIA402_SEGMENT - (request[0] >> 1 & 7u)))
        return;
    transfer->toggle ^= 0x10;
    if ((request[0] & 1) == 0 || cia402_long_commit(self))
        cia402_sdo_send(self, data);
}

/* ---- by blocks: the client reads --------------------------------------- */

static void cia402_long_block_upload(struct sim_cia402 *self,
                                     const uint8_t request[8], int row)
{
    struct sim_cia402_transfer *transfer = &self->transfer;
    uint32_t value, abort_code = cia402_od_read(self, row, &value);

    cia402_long_start(self, row, CIA402_LONG_BLOCK_READY);
    if (abort_code == CIA402_DONE && !cia402_od_is_long(row))
        abort_code = CIA402_ABORT_COMMAND; /* this maker's: short ones not */
    if (abort_code == CIA402_DONE && (request[4] < 1 || request[4] > 127))
        abort_code = CIA402_ABORT_BLOCK_SIZE;
    if (abort_code != CIA402_DONE) {
        cia402_long_abort(self, abort_code);
        return;
    }
    transfer->from = cia402_od_bytes(self, row, &transfer->length);
    transfer->checked = (request[0] & 4) != 0;
    transfer->block_size = request[4];
    cia402_sdo_reply(self, 0xC6, request, transfer->length);
}

static void cia402_long_send_segment(struct sim_cia402 *self)
{
    struct sim_cia402_transfer *transfer = &self->transfer;
    uint32_t from = transfer->at + transfer->sequence * CIA402_SEGMENT;
    uint32_t left = transfer->length - from;
    uint8_t data[8] = { ++transfer->sequence };

    transfer->last = left <= CIA402_SEGMENT;
    if (transfer->last)
        data[0] |= 0x80;
    memcpy(&data[1], transfer->from + from,
           transfer->last ? left : CIA402_SEGMENT);
    cia402_sdo_send(self, data);
}

void cia402_long_poll(struct sim_cia402 *self)
{
    struct sim_cia402_transfer *transfer = &self->transfer;

    while (transfer->phase == CIA402_LONG_BLOCK_UPLOAD &&
           self->base.port.tx.count < CIA402_BLOCK_AT_ONCE) {
        cia402_long_send_segment(self);
        if (transfer->last || transfer->sequence == transfer->block_size)
            transfer->phase = CIA402_LONG_BLOCK_WAIT;
    }
}

static void cia402_long_block_end(struct sim_cia402 *self)
{
    struct sim_cia402_transfer *transfer = &self->transfer;
    uint32_t unused = transfer->at - transfer->length;
    uint16_t crc = transfer->checked
                       ? cia402_long_crc(transfer->from, transfer->length)
                       : 0;
    const uint8_t data[8] = { (uint8_t)(0xC1 | unused << 2), (uint8_t)crc,
                              (uint8_t)(crc >> 8) };

    transfer->phase = CIA402_LONG_BLOCK_SENT;
    cia402_sdo_send(self, data);
}

static void cia402_long_block_acknowledged(struct sim_cia402 *self,
                                           const uint8_t request[8])
{
    struct sim_cia402_transfer *transfer = &self->transfer;
    bool all = request[1] == transfer->sequence && transfer->last;

    if (request[1] > transfer->sequence) {
        cia402_long_abort(self, CIA402_ABORT_SEQUENCE);
        return;
    }
    if (!all && (request[2] < 1 || request[2] > 127)) {
        cia402_long_abort(self, CIA402_ABORT_BLOCK_SIZE);
        return;
    }
    transfer->at += request[1] * CIA402_SEGMENT;
    transfer->sequence = 0;
    transfer->block_size = request[2];
    if (all) {
        cia402_long_block_end(self);
    } else {
        transfer->phase = CIA402_LONG_BLOCK_UPLOAD;
        cia402_long_poll(self);
    }
}

/* ---- by blocks: the client writes -------------------------------------- */

static void cia402_long_block_download(struct sim_cia402 *self,
                                       const uint8_t request[8], int row)
{
    struct sim_cia402_transfer *transfer = &self->transfer;
    uint32_t length = request[0] & 2 ? cia402_sdo_get_u32(&request[4]) : 0;
    uint32_t abort_code = cia402_od_check_long(row, length);

    cia402_long_start(self, row, CIA402_LONG_BLOCK_DOWNLOAD);
    transfer->length = length;
    transfer->checked = (request[0] & 4) != 0;
    transfer->block_size = CIA402_BLOCK_SEGMENTS;
    if (abort_code != CIA402_DONE)
        cia402_long_abort(self, abort_code);
    else
        cia402_sdo_reply(self, 0xA4, request, CIA402_BLOCK_SEGMENTS);
}

/* How many bytes of the last segment count is said at the end, so all seven are
 * kept when there is room. */
static void cia402_long_take_segment(struct sim_cia402 *self,
                                     const uint8_t request[8])
{
    struct sim_cia402_transfer *transfer = &self->transfer;
    uint8_t number = request[0] & 0x7F;
    bool last = request[0] & 0x80;
    uint32_t capacity;

    if (number == 0 || number > transfer->block_size) {
        cia402_long_abort(self, CIA402_ABORT_SEQUENCE);
        return;
    }
    if (number == transfer->sequence + 1 && !transfer->last) {
        if (transfer->at >= SIM_CIA402_NOTES) {
            cia402_long_abort(self, CIA402_ABORT_TOO_LONG);
            return;
        }
        capacity = SIM_CIA402_NOTES - transfer->at;
        memcpy(transfer->into + transfer->at, &request[1],
               capacity < CIA402_SEGMENT ? capacity : CIA402_SEGMENT);
        transfer->at += CIA402_SEGMENT;
        transfer->sequence++;
        transfer->last = last;
    }
    if (last || number == transfer->block_size) {
        const uint8_t data[8] = { 0xA2, transfer->sequence,
                                  CIA402_BLOCK_SEGMENTS };

        transfer->sequence = 0;
        if (transfer->last)
            transfer->phase = CIA402_LONG_BLOCK_END;
        cia402_sdo_send(self, data);
    }
}

static void cia402_long_block_finish(struct sim_cia402 *self,
                                     const uint8_t request[8])
{
    struct sim_cia402_transfer *transfer = &self->transfer;
    const uint8_t data[8] = { 0xA1 };
    uint32_t unused = request[0] >> 2 & 7;

    transfer->at -= unused; /* a last segment was taken: at least seven */
    if (transfer->at > SIM_CIA402_NOTES)
        cia402_long_abort(self, CIA402_ABORT_TOO_LONG);
    else if (transfer->checked &&
             cia402_long_crc(transfer->into, transfer->at) !=
                 (request[1] | request[2] << 8))
        cia402_long_abort(self, CIA402_ABORT_CRC);
    else if (cia402_long_commit(self))
        cia402_sdo_send(self, data);
}

void cia402_long_block(struct sim_cia402 *self, const uint8_t request[8],
                       int row)
{
    if (request[0] >> 5 == 5)
        cia402_long_block_upload(self, request, row);
    else
        cia402_long_block_download(self, request, row);
}

/* ---- requests of a transfer under way ---------------------------------- */

/* The toggle of a segment must be the expected one. */
static bool cia402_long_toggles(struct sim_cia402 *self,
                                const uint8_t request[8])
{
    if ((request[0] & 0x10) == self->transfer.toggle)
        return true;
    cia402_long_abort(self, CIA402_ABORT_TOGGLE);
    return false;
}

static bool cia402_long_block_request(struct sim_cia402 *self,
                                      const uint8_t request[8])
{
    uint8_t phase = self->transfer.phase, what = request[0] & 0xE3;

    if (phase == CIA402_LONG_BLOCK_READY && what == 0xA3) {
        self->transfer.phase = CIA402_LONG_BLOCK_UPLOAD;
        cia402_long_poll(self);
    } else if (phase == CIA402_LONG_BLOCK_WAIT && what == 0xA2) {
        cia402_long_block_acknowledged(self, request);
    } else if (phase == CIA402_LONG_BLOCK_SENT && what == 0xA1) {
        cia402_long_end(self);
    } else if (phase == CIA402_LONG_BLOCK_END && what == 0xC1) {
        cia402_long_block_finish(self, request);
    } else {
        return false;
    }
    return true;
}

bool cia402_long_request(struct sim_cia402 *self, const uint8_t request[8])
{
    uint8_t phase = self->transfer.phase, command = request[0] >> 5;

    if (phase == CIA402_LONG_BLOCK_DOWNLOAD && request[0] != 0x80) {
        cia402_long_take_segment(self, request);
    } else if (phase == CIA402_LONG_UPLOAD && command == 3) {
        if (cia402_long_toggles(self, request))
            cia402_long_upload_segment(self);
    } else if (phase == CIA402_LONG_DOWNLOAD && command == 0) {
        if (cia402_long_toggles(self, request))
            cia402_long_download_segment(self, request);
    } else {
        return cia402_long_block_request(self, request);
    }
    return true;
}

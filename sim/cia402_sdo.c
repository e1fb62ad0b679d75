/* sim/cia402_sdo.c - the SDO server: expedited transfers, and segmented reads
 * for texts.  Source: CiA 301 7.2.4.3. */
#include <string.h>

#include "sim/cia402.h"

#define CIA402_SDO_SEGMENT 7 /* data bytes of a segment */

/* First byte: what the client asks for, bits 7-5. */
enum cia402_sdo_command {
    CIA402_SDO_DOWNLOAD = 1,
    CIA402_SDO_UPLOAD = 2,
    CIA402_SDO_UPLOAD_SEGMENT = 3,
    CIA402_SDO_ABORT = 4,
};

static void cia402_sdo_put_u32(uint8_t *data, uint32_t value)
{
    for (unsigned i = 0; i < 4; i++)
        data[i] = (uint8_t)(value >> 8 * i);
}

static uint32_t cia402_sdo_get_u32(const uint8_t *data)
{
    return data[0] | (uint32_t)data[1] << 8 | (uint32_t)data[2] << 16 |
           (uint32_t)data[3] << 24;
}

static void cia402_sdo_send(struct sim_cia402 *self, const uint8_t data[8])
{
    cia402_com_send(self, 0x580u + self->config.node_id, data, 8);
}

/* Command, the request's index and sub-index, 4 bytes. */
static void cia402_sdo_reply(struct sim_cia402 *self, uint8_t command,
                             const uint8_t request[8], uint32_t value)
{
    uint8_t data[8] = { command, request[1], request[2], request[3] };

    cia402_sdo_put_u32(&data[4], value);
    cia402_sdo_send(self, data);
}

static void cia402_sdo_abort(struct sim_cia402 *self, const uint8_t request[8],
                             uint32_t abort_code)
{
    cia402_sdo_reply(self, 0x80, request, abort_code);
}

static int cia402_sdo_row(const uint8_t request[8], uint32_t *abort_code)
{
    return cia402_od_find((uint16_t)(request[1] | request[2] << 8), request[3],
                          abort_code);
}

static void cia402_sdo_download(struct sim_cia402 *self,
                                const uint8_t request[8])
{
    bool expedited = request[0] & 2, size_given = request[0] & 1;
    unsigned size = size_given ? 4u - (request[0] >> 2 & 3) : 0;
    uint32_t abort_code;
    int row = cia402_sdo_row(request, &abort_code);

    if (row >= 0)
        abort_code = expedited
                         ? cia402_od_write(self, row, size,
                                           cia402_sdo_get_u32(&request[4]))
                         : CIA402_ABORT_COMMAND;
    if (abort_code != CIA402_DONE)
        cia402_sdo_abort(self, request, abort_code);
    else
        cia402_sdo_reply(self, 0x60, request, 0);
}

static void cia402_sdo_upload_text(struct sim_cia402 *self,
                                   const uint8_t request[8], int row)
{
    const char *text = cia402_od_text(row);
    size_t len = strlen(text);
    uint32_t letters = 0;

    if (len > 4) {
        self->segments.text = text;
        self->segments.row = row;
        self->segments.toggle = 0;
        cia402_sdo_reply(self, 0x41, request, (uint32_t)len);
        return;
    }
    for (size_t i = 0; i < len; i++)
        letters |= (uint32_t)(uint8_t)text[i] << 8 * i;
    cia402_sdo_reply(self, (uint8_t)(0x43 | (4 - len) << 2), request, letters);
}

static void cia402_sdo_upload(struct sim_cia402 *self, const uint8_t request[8])
{
    uint32_t abort_code, value = 0;
    int row = cia402_sdo_row(request, &abort_code);

    if (row >= 0)
        abort_code = cia402_od_read(self, row, &value);
    if (abort_code != CIA402_DONE)
        cia402_sdo_abort(self, request, abort_code);
    else if (cia402_od_text(row))
        cia402_sdo_upload_text(self, request, row);
    else
        cia402_sdo_reply(self, (uint8_t)(0x43 | (4 - cia402_od_size(row)) << 2),
                         request, value);
}

/* Aborting names the object that is being read, not the segment's bytes. */
static void cia402_sdo_abort_segments(struct sim_cia402 *self,
                                      uint32_t abort_code)
{
    uint16_t index = cia402_od_index(self->segments.row);
    const uint8_t about[8] = { 0, (uint8_t)index, (uint8_t)(index >> 8),
                               cia402_od_sub(self->segments.row) };

    self->segments.text = NULL;
    cia402_sdo_abort(self, about, abort_code);
}

static void cia402_sdo_upload_segment(struct sim_cia402 *self,
                                      const uint8_t request[8])
{
    uint8_t toggle = request[0] & 0x10, data[8] = { 0 };
    size_t left, len;
    bool last;

    if (!self->segments.text) {
        cia402_sdo_abort(self, (const uint8_t[8]){ 0 }, CIA402_ABORT_COMMAND);
        return;
    }
    if (toggle != self->segments.toggle) {
        cia402_sdo_abort_segments(self, CIA402_ABORT_TOGGLE);
        return;
    }
    left = strlen(self->segments.text);
    last = left <= CIA402_SDO_SEGMENT;
    len = last ? left : CIA402_SDO_SEGMENT;
    data[0] = (uint8_t)(toggle | (CIA402_SDO_SEGMENT - len) << 1 | last);
    memcpy(&data[1], self->segments.text, len);
    self->segments.text = last ? NULL : self->segments.text + len;
    self->segments.toggle ^= 0x10;
    cia402_sdo_send(self, data);
}

void cia402_sdo_request(struct sim_cia402 *self,
                        const struct hal_can_frame *frame)
{
    enum cia402_sdo_command command = frame->data[0] >> 5;

    if (frame->len != 8 || self->nmt_state == CIA402_NMT_STOPPED)
        return;
    if (command == CIA402_SDO_UPLOAD_SEGMENT) {
        cia402_sdo_upload_segment(self, frame->data);
        return;
    }
    self->segments.text = NULL; /* a new request ends the old transfer */
    if (command == CIA402_SDO_DOWNLOAD)
        cia402_sdo_download(self, frame->data);
    else if (command == CIA402_SDO_UPLOAD)
        cia402_sdo_upload(self, frame->data);
    else if (command != CIA402_SDO_ABORT)
        cia402_sdo_abort(self, frame->data, CIA402_ABORT_COMMAND);
}

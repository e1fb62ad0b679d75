/* sim/device/cia402/sdo.c - the SDO server: short objects, and who answers
 * what.  Source: CiA 301 7.2.4.3. */
#include <string.h>

#include "sim/device/cia402/parts.h"

/* First byte: what the client asks for, bits 7-5. */
enum cia402_sdo_command {
    CIA402_SDO_DOWNLOAD = 1,
    CIA402_SDO_UPLOAD = 2,
    CIA402_SDO_ABORT = 4,
    CIA402_SDO_BLOCK_UPLOAD = 5,
    CIA402_SDO_BLOCK_DOWNLOAD = 6,
};

static void cia402_sdo_put_u32(uint8_t *data, uint32_t value)
{
    for (unsigned i = 0; i < 4; i++)
        data[i] = (uint8_t)(value >> 8 * i);
}

uint32_t cia402_sdo_get_u32(const uint8_t *data)
{
    return data[0] | (uint32_t)data[1] << 8 | (uint32_t)data[2] << 16 |
           (uint32_t)data[3] << 24;
}

void cia402_sdo_send(struct sim_cia402 *self, const uint8_t data[8])
{
    cia402_com_send(self, 0x580u + self->config.node_id, data, 8);
}

void cia402_sdo_reply(struct sim_cia402 *self, uint8_t command,
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

static void cia402_sdo_download(struct sim_cia402 *self,
                                const uint8_t request[8], int row)
{
    bool expedited = request[0] & 2, size_given = request[0] & 1;
    unsigned size = size_given ? 4u - (request[0] >> 2 & 3) : 0;
    uint32_t abort_code;

    if (!expedited) {
        cia402_long_download(self, request, row);
        return;
    }
    if (cia402_od_is_long(row)) {
        abort_code = cia402_od_check_long(row, size);
        if (abort_code == CIA402_DONE)
            cia402_od_write_long(self, &request[4], size ? size : 4);
    } else {
        abort_code =
            cia402_od_write(self, row, size, cia402_sdo_get_u32(&request[4]));
    }
    if (abort_code != CIA402_DONE)
        cia402_sdo_abort(self, request, abort_code);
    else
        cia402_sdo_reply(self, 0x60, request, 0);
}

static void cia402_sdo_upload(struct sim_cia402 *self, const uint8_t request[8],
                              int row)
{
    uint32_t value = 0, abort_code = cia402_od_read(self, row, &value);

    if (abort_code != CIA402_DONE)
        cia402_sdo_abort(self, request, abort_code);
    else if (cia402_od_is_long(row))
        cia402_long_upload(self, request, row);
    else
        cia402_sdo_reply(self, (uint8_t)(0x43 | (4 - cia402_od_size(row)) << 2),
                         request, value);
}

/* A request that begins something, for an object that is there. */
static void cia402_sdo_begin(struct sim_cia402 *self, const uint8_t request[8],
                             int row)
{
    switch (request[0] >> 5) {
    case CIA402_SDO_DOWNLOAD:
        cia402_sdo_download(self, request, row);
        break;
    case CIA402_SDO_UPLOAD:
        cia402_sdo_upload(self, request, row);
        break;
    default:
        cia402_long_block(self, request, row);
        break;
    }
}

static bool cia402_sdo_is_begin(const uint8_t request[8])
{
    switch (request[0] >> 5) {
    case CIA402_SDO_DOWNLOAD:
    case CIA402_SDO_UPLOAD:
        return true;
    case CIA402_SDO_BLOCK_UPLOAD:
        return (request[0] & 3) == 0;
    case CIA402_SDO_BLOCK_DOWNLOAD:
        return (request[0] & 1) == 0;
    default:
        return false;
    }
}

/* Long transfers are of the node's objects, and what follows their beginning
 * names none. */
static bool cia402_sdo_is_for_another(const struct sim_cia402 *self,
                                      const uint8_t request[8], uint16_t *index)
{
    if (cia402_axes_first(self)->transfer.phase != 0 ||
        !cia402_sdo_is_begin(request))
        return !cia402_axes_is_first(self);
    return !cia402_axes_take(self, index);
}

void cia402_sdo_request(struct sim_cia402 *self,
                        const struct hal_can_frame *frame)
{
    const uint8_t *request = frame->data;
    uint16_t index = (uint16_t)(request[1] | request[2] << 8);
    uint32_t abort_code;
    int row;

    if (cia402_sdo_is_for_another(self, request, &index))
        return;
    if (frame->len != 8 || self->nmt_state == CIA402_NMT_STOPPED ||
        cia402_long_request(self, request))
        return;
    cia402_long_end(self); /* a new request ends the old transfer */
    if (request[0] >> 5 == CIA402_SDO_ABORT)
        return;
    if (!cia402_sdo_is_begin(request)) {
        cia402_sdo_abort(self, request, CIA402_ABORT_COMMAND);
        return;
    }
    row = cia402_od_find(index, request[3], &abort_code);
    if (row < 0)
        cia402_sdo_abort(self, request, abort_code);
    else
        cia402_sdo_begin(self, request, row);
}

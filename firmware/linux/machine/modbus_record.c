/* firmware/linux/machine/modbus_record.c - see modbus_record.h. */
#include "firmware/linux/machine/modbus_record.h"

#include <string.h>

#include "hal/modbus/rtu.h"
#include "hal/modbus/tcp.h"
#include "hal/support/container_of.h"

/* Source: the pcap file format, draft-ietf-opsawg-pcap. */
#define PCAP_MAGIC_NS UINT32_C(0xA1B23C4D)
#define PCAP_HEAD     24
#define PCAP_ROW      16
#define PCAP_USER0    147
#define PCAP_RAW_IP   101
#define PCAP_LONGEST  65535

#define IP_HEAD     20
#define TCP_HEAD    20
#define SERVER_PORT 502
#define CLIENT_PORT 50200

static void record_u32(uint8_t *at, uint32_t value)
{
    memcpy(at, &value, sizeof value); /* the magic says which way round */
}

static void record_net32(uint8_t *at, uint32_t value)
{
    modbus_pdu_set(at, (uint16_t)(value >> 16));
    modbus_pdu_set(at + 2, (uint16_t)value);
}

/* ---- frames ---- */

static void record_frame(struct modbus_record *record, int64_t t_ns,
                         const uint8_t *frame, size_t length)
{
    uint8_t *at = record->bytes + record->length;

    if (record->length + PCAP_ROW + length > MODBUS_RECORD_BYTES) {
        record->dropped++;
        return;
    }
    record_u32(at, (uint32_t)(t_ns / 1000000000));
    record_u32(at + 4, (uint32_t)(t_ns % 1000000000));
    record_u32(at + 8, (uint32_t)length);
    record_u32(at + 12, (uint32_t)length);
    memcpy(at + PCAP_ROW, frame, length);
    record->length += PCAP_ROW + length;
    record->frames++;
}

/* IPv4 and TCP around a frame; checksums are left to no one. */
static void record_tcp(struct modbus_record *record, int64_t t_ns,
                       bool from_server, const uint8_t *frame, size_t length)
{
    uint8_t packet[IP_HEAD + TCP_HEAD + MODBUS_TCP_FRAME_MAX] = { 0x45 };
    uint8_t *tcp = packet + IP_HEAD;
    const size_t total = IP_HEAD + TCP_HEAD + length;

    modbus_pdu_set(packet + 2, (uint16_t)total);
    packet[8] = 64; /* hops */
    packet[9] = 6;  /* TCP */
    record_net32(packet + 12, 0x7F000001);
    record_net32(packet + 16, 0x7F000001);
    modbus_pdu_set(tcp, from_server ? SERVER_PORT : CLIENT_PORT);
    modbus_pdu_set(tcp + 2, from_server ? CLIENT_PORT : SERVER_PORT);
    record_net32(tcp + 4, 1 + record->sequence[from_server]);
    record_net32(tcp + 8, 1 + record->sequence[!from_server]);
    tcp[12] = TCP_HEAD / 4 << 4;
    tcp[13] = 0x18; /* PSH, ACK */
    modbus_pdu_set(tcp + 14, 0xFFFF);
    memcpy(tcp + TCP_HEAD, frame, length);
    record_frame(record, t_ns, packet, total);
    record->sequence[from_server] += (uint32_t)length;
}

static void record_put(struct modbus_record *record, int64_t t_ns,
                       bool from_server, uint8_t unit, const uint8_t *pdu,
                       unsigned length)
{
    uint8_t frame[MODBUS_TCP_FRAME_MAX];

    if (record->tcp) {
        memcpy(frame + MODBUS_TCP_HEAD, pdu, length);
        length = modbus_tcp_seal(frame, record->transaction, unit, length);
        record_tcp(record, t_ns, from_server, frame, length);
    } else {
        memcpy(frame + 1, pdu, length);
        length = modbus_rtu_seal(frame, unit, length);
        record_frame(record, t_ns, frame, length);
    }
}

static void record_transaction(struct modbus_record *record,
                               const struct hal_modbus_request *request,
                               const struct hal_modbus_reply *reply)
{
    uint8_t pdu[MODBUS_PDU_MAX];
    const int length = modbus_pdu_put_request(request, pdu);

    record->transaction++;
    record_put(record, reply->sent_ns, false, request->unit, pdu,
               (unsigned)length);
    if (request->unit == HAL_MODBUS_BROADCAST)
        return;
    if (reply->err == MOTION_OK)
        record_put(record, reply->answer_ns, true, request->unit, pdu,
                   modbus_pdu_put_answer(request, reply->value, pdu));
    else if (reply->err == MOTION_E_REFUSED)
        record_put(
            record, reply->answer_ns, true, request->unit, pdu,
            modbus_pdu_put_exception(request->function, reply->exception, pdu));
}

/* ---- the line ---- */

static struct modbus_record *record_of(struct hal_modbus *line)
{
    return CONTAINER_OF(line, struct modbus_record, modbus);
}

static int record_submit(struct hal_modbus *line,
                         const struct hal_modbus_request *request, uint32_t tag)
{
    struct modbus_record *record = record_of(line);
    const int err = hal_modbus_submit(record->line, request, tag);

    if (err == MOTION_OK)
        record->request[record->submitted++ % HAL_MODBUS_MAILBOX] = *request;
    return err;
}

static int record_collect(struct hal_modbus *line,
                          struct hal_modbus_reply *reply)
{
    struct modbus_record *record = record_of(line);
    const int got = hal_modbus_collect(record->line, reply);

    if (got == 1)
        record_transaction(
            record, &record->request[record->collected++ % HAL_MODBUS_MAILBOX],
            reply);
    return got;
}

static int record_is_up(struct hal_modbus *line)
{
    return hal_modbus_is_up(record_of(line)->line);
}

static void record_stats(struct hal_modbus *line,
                         struct hal_modbus_stats *stats)
{
    hal_modbus_stats(record_of(line)->line, stats);
}

static const struct hal_modbus_ops modbus_record_ops = {
    .submit = record_submit,
    .collect = record_collect,
    .is_up = record_is_up,
    .stats = record_stats,
};

void modbus_record_init(struct modbus_record *record, struct hal_modbus *line,
                        bool tcp)
{
    memset(record, 0, sizeof *record);
    record->modbus.ops = &modbus_record_ops;
    record->line = line;
    record->tcp = tcp;
}

void modbus_record_write(const struct modbus_record *record, FILE *file)
{
    uint8_t head[PCAP_HEAD] = { 0 };
    const uint16_t version[2] = { 2, 4 };

    record_u32(head, PCAP_MAGIC_NS);
    memcpy(head + 4, version, sizeof version);
    record_u32(head + 16, PCAP_LONGEST);
    record_u32(head + 20, record->tcp ? PCAP_RAW_IP : PCAP_USER0);
    fwrite(head, 1, sizeof head, file);
    fwrite(record->bytes, 1, record->length, file);
}

/* firmware/host/recording/mcap.h - records of an MCAP file.
 *
 * A file is the magic, records and the magic again; a record is an opcode (1
 * byte), the length of its content (8) and the content.  Integers are
 * little-endian, strings are their length (4) and UTF-8.
 * Source: MCAP specification, mcap.dev/spec. */
#ifndef FIRMWARE_HOST_RECORDING_MCAP_H
#define FIRMWARE_HOST_RECORDING_MCAP_H

#include <stddef.h>
#include <stdint.h>

#define MCAP_MAGIC       "\x89MCAP0\r\n"
#define MCAP_MAGIC_BYTES 8
#define MCAP_HEAD_BYTES  9 /* opcode and length of a record */

enum mcap_opcode {
    MCAP_HEADER = 0x01,
    MCAP_FOOTER = 0x02,
    MCAP_SCHEMA = 0x03,
    MCAP_CHANNEL = 0x04,
    MCAP_MESSAGE = 0x05,
    MCAP_CHUNK = 0x06,
    MCAP_MESSAGE_INDEX = 0x07,
    MCAP_CHUNK_INDEX = 0x08,
    MCAP_ATTACHMENT = 0x09,
    MCAP_ATTACHMENT_INDEX = 0x0A,
    MCAP_STATISTICS = 0x0B,
    MCAP_METADATA = 0x0C,
    MCAP_METADATA_INDEX = 0x0D,
    MCAP_SUMMARY_OFFSET = 0x0E,
    MCAP_DATA_END = 0x0F,
};

#endif

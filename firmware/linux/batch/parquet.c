/* firmware/linux/batch/parquet.c - see parquet.h. */
#include "firmware/linux/batch/parquet.h"

#include <stdbool.h>
#include <string.h>

#include "firmware/host/base/memory.h"

/* parquet.thrift */
enum { TYPE_INT64 = 2, TYPE_DOUBLE = 5, TYPE_BYTE_ARRAY = 6 };
enum { ENCODING_PLAIN = 0, ENCODING_RLE = 3 };
enum { CODEC_NONE = 0, PAGE_DATA = 0, REQUIRED = 0, CONVERTED_UTF8 = 0 };

/* Thrift compact protocol: types of fields. */
enum {
    THRIFT_I32 = 5,
    THRIFT_I64 = 6,
    THRIFT_BINARY = 8,
    THRIFT_LIST = 9,
    THRIFT_STRUCT = 12
};

#define MAGIC "PAR1"

struct bytes {
    unsigned char *at;
    size_t count, capacity;
};

static void bytes_put(struct bytes *bytes, const void *from, size_t size)
{
    if (bytes->count + size > bytes->capacity) {
        bytes->capacity = 2 * (bytes->count + size) + 64;
        bytes->at = memory_resize(bytes->at, bytes->capacity, 1);
    }
    memcpy(bytes->at + bytes->count, from, size);
    bytes->count += size;
}

static void bytes_put_byte(struct bytes *bytes, unsigned value)
{
    const unsigned char byte = (unsigned char)value;
    bytes_put(bytes, &byte, 1);
}

/* Little endian, as PLAIN has it. */
static void bytes_put_little(struct bytes *bytes, uint64_t value, unsigned size)
{
    for (unsigned i = 0; i < size; i++)
        bytes_put_byte(bytes, (unsigned)(value >> 8 * i & 0xFF));
}

/* --- Thrift --- */

static void thrift_varint(struct bytes *bytes, uint64_t value)
{
    for (; value >= 0x80; value >>= 7)
        bytes_put_byte(bytes, (unsigned)(value & 0x7F) | 0x80);
    bytes_put_byte(bytes, (unsigned)value);
}

static void thrift_number(struct bytes *bytes, int64_t value)
{
    thrift_varint(bytes, (uint64_t)value << 1 ^ (uint64_t)(value >> 63));
}

/* The header of field `id`, after field *last of the same struct. */
static void thrift_field(struct bytes *bytes, unsigned *last, unsigned id,
                         unsigned type)
{
    bytes_put_byte(bytes, (id - *last) << 4 | type);
    *last = id;
}

static void thrift_i32(struct bytes *bytes, unsigned *last, unsigned id,
                       int64_t value)
{
    thrift_field(bytes, last, id, THRIFT_I32);
    thrift_number(bytes, value);
}

static void thrift_i64(struct bytes *bytes, unsigned *last, unsigned id,
                       int64_t value)
{
    thrift_field(bytes, last, id, THRIFT_I64);
    thrift_number(bytes, value);
}

static void thrift_binary(struct bytes *bytes, const char *text)
{
    thrift_varint(bytes, strlen(text));
    bytes_put(bytes, text, strlen(text));
}

static void thrift_text(struct bytes *bytes, unsigned *last, unsigned id,
                        const char *text)
{
    thrift_field(bytes, last, id, THRIFT_BINARY);
    thrift_binary(bytes, text);
}

static void thrift_list(struct bytes *bytes, unsigned *last, unsigned id,
                        unsigned type, uint32_t count)
{
    thrift_field(bytes, last, id, THRIFT_LIST);
    if (count < 15) {
        bytes_put_byte(bytes, count << 4 | type);
    } else {
        bytes_put_byte(bytes, 0xF0 | type);
        thrift_varint(bytes, count);
    }
}

static void thrift_end(struct bytes *bytes)
{
    bytes_put_byte(bytes, 0);
}

/* --- pages --- */

struct chunk {
    int64_t offset;      /* of its page's header, in the file */
    int64_t page, total; /* bytes of the values; with the header */
};

static void parquet_values(const struct parquet_table *table, uint32_t column,
                           struct bytes *values)
{
    for (uint32_t row = 0; row < table->rows; row++) {
        const struct parquet_cell cell =
            table->cell(table->context, column, row);
        uint64_t bits;
        switch (table->column[column].type) {
        case PARQUET_INT64:
            bytes_put_little(values, (uint64_t)cell.whole, 8);
            break;
        case PARQUET_DOUBLE:
            memcpy(&bits, &cell.real, sizeof bits);
            bytes_put_little(values, bits, 8);
            break;
        case PARQUET_TEXT:
            bytes_put_little(values, strlen(cell.text), 4);
            bytes_put(values, cell.text, strlen(cell.text));
            break;
        }
    }
}

static void parquet_page_header(struct bytes *to, int64_t size, uint32_t rows)
{
    unsigned page = 0, data = 0;
    thrift_i32(to, &page, 1, PAGE_DATA);
    thrift_i32(to, &page, 2, size);
    thrift_i32(to, &page, 3, size);
    thrift_field(to, &page, 5, THRIFT_STRUCT); /* data_page_header */
    thrift_i32(to, &data, 1, rows);
    thrift_i32(to, &data, 2, ENCODING_PLAIN);
    thrift_i32(to, &data, 3, ENCODING_RLE); /* of levels, which there are not */
    thrift_i32(to, &data, 4, ENCODING_RLE);
    thrift_end(to);
    thrift_end(to);
}

static int parquet_column(const struct parquet_table *table, uint32_t column,
                          int64_t *at, struct chunk *chunk, FILE *file)
{
    struct bytes header = { 0 }, values = { 0 };
    parquet_values(table, column, &values);
    const bool fits = values.count <= INT32_MAX;
    if (fits) {
        parquet_page_header(&header, (int64_t)values.count, table->rows);
        *chunk = (struct chunk){
            .offset = *at,
            .page = (int64_t)values.count,
            .total = (int64_t)(header.count + values.count),
        };
        *at += chunk->total;
        fwrite(header.at, 1, header.count, file);
        if (values.count > 0)
            fwrite(values.at, 1, values.count, file);
    }
    memory_free(header.at);
    memory_free(values.at);
    return fits ? 0 : -1;
}

/* --- the footer --- */

static unsigned parquet_type(enum parquet_type type)
{
    return type == PARQUET_INT64    ? TYPE_INT64
           : type == PARQUET_DOUBLE ? TYPE_DOUBLE
                                    : TYPE_BYTE_ARRAY;
}

static void parquet_schema(const struct parquet_table *table, struct bytes *to,
                           unsigned *meta)
{
    unsigned root = 0;
    thrift_list(to, meta, 2, THRIFT_STRUCT, table->columns + 1);
    thrift_text(to, &root, 4, "schema");
    thrift_i32(to, &root, 5, table->columns);
    thrift_end(to);
    for (uint32_t i = 0; i < table->columns; i++) {
        unsigned element = 0;
        thrift_i32(to, &element, 1, parquet_type(table->column[i].type));
        thrift_i32(to, &element, 3, REQUIRED);
        thrift_text(to, &element, 4, table->column[i].name);
        if (table->column[i].type == PARQUET_TEXT)
            thrift_i32(to, &element, 6, CONVERTED_UTF8);
        thrift_end(to);
    }
}

static void parquet_chunk(const struct parquet_table *table, uint32_t column,
                          const struct chunk *chunk, struct bytes *to)
{
    unsigned outer = 0, data = 0;
    thrift_i64(to, &outer, 2, chunk->offset);
    thrift_field(to, &outer, 3, THRIFT_STRUCT);
    thrift_i32(to, &data, 1, parquet_type(table->column[column].type));
    thrift_list(to, &data, 2, THRIFT_I32, 2);
    thrift_number(to, ENCODING_PLAIN);
    thrift_number(to, ENCODING_RLE);
    thrift_list(to, &data, 3, THRIFT_BINARY, 1);
    thrift_binary(to, table->column[column].name);
    thrift_i32(to, &data, 4, CODEC_NONE);
    thrift_i64(to, &data, 5, table->rows);
    thrift_i64(to, &data, 6, chunk->total);
    thrift_i64(to, &data, 7, chunk->total);
    thrift_i64(to, &data, 9, chunk->offset);
    thrift_end(to);
    thrift_end(to);
}

static void parquet_footer(const struct parquet_table *table,
                           const struct chunk chunk[], int64_t bytes,
                           struct bytes *to)
{
    unsigned meta = 0, group = 0;
    thrift_i32(to, &meta, 1, 1); /* version */
    parquet_schema(table, to, &meta);
    thrift_i64(to, &meta, 3, table->rows);
    thrift_list(to, &meta, 4, THRIFT_STRUCT, 1);
    thrift_list(to, &group, 1, THRIFT_STRUCT, table->columns);
    for (uint32_t i = 0; i < table->columns; i++)
        parquet_chunk(table, i, &chunk[i], to);
    thrift_i64(to, &group, 2, bytes);
    thrift_i64(to, &group, 3, table->rows);
    thrift_end(to);
    thrift_text(to, &meta, 6, table->created_by);
    thrift_end(to);
}

int parquet_write(const struct parquet_table *table, FILE *file)
{
    struct chunk *const chunk = memory_new(table->columns, sizeof *chunk);
    struct bytes footer = { 0 };
    int64_t at = sizeof MAGIC - 1;
    int err = 0;

    fputs(MAGIC, file);
    for (uint32_t i = 0; i < table->columns && err == 0; i++)
        err = parquet_column(table, i, &at, &chunk[i], file);
    if (err == 0) {
        parquet_footer(table, chunk, at - (int64_t)(sizeof MAGIC - 1), &footer);
        const size_t length = footer.count;
        bytes_put_little(&footer, length, 4);
        bytes_put(&footer, MAGIC, sizeof MAGIC - 1);
        fwrite(footer.at, 1, footer.count, file);
    }
    memory_free(footer.at);
    memory_free(chunk);
    return err;
}

/* tests/firmware/linux/batch/test_parquet.c - a small table, byte for byte; tests/
 * peers/peer_batch.py has large ones read by pyarrow. */
#include "firmware/linux/batch/parquet.h"

#include <stdio.h>
#include <string.h>

#include "tests/support/check.h"

static const struct parquet_column columns[] = { { "n", PARQUET_INT64 },
                                                 { "x", PARQUET_DOUBLE },
                                                 { "s", PARQUET_TEXT } };

/* n 1, -2; x -1, 0.5; s "ab", "". */
static struct parquet_cell cell(const void *context, uint32_t column,
                                uint32_t row)
{
    (void)context, (void)column;
    return (struct parquet_cell){
        .whole = row == 0 ? 1 : -2,
        .real = row == 0 ? -1 : 0.5,
        .text = row == 0 ? "ab" : "",
    };
}

static size_t written(uint32_t rows, unsigned char bytes[], size_t capacity)
{
    const struct parquet_table table = { .column = columns,
                                         .columns = ARRAY_LEN(columns),
                                         .rows = rows,
                                         .cell = cell,
                                         .created_by = "c" };
    FILE *const file = tmpfile();
    assert_non_null(file);
    assert_int_equal(parquet_write(&table, file), 0);
    rewind(file);
    const size_t size = fread(bytes, 1, capacity, file);
    fclose(file);
    return size;
}

/* By hand from parquet.thrift and the compact protocol: a byte of a field is
 * (id - last id) << 4 | type, whole numbers are zigzag varints. */
static void a_table_of_each_type_is_as_the_format_has_it(void **state)
{
    static const unsigned char want[] =
        "PAR1"
        /* page header: DATA_PAGE, 16 and 16 bytes, {2 values, PLAIN, RLE, RLE} */
        "\x15\x00\x15\x20\x15\x20\x2c\x15\x04\x15\x00\x15\x06\x15\x06\x00\x00"
        "\x01\x00\x00\x00\x00\x00\x00\x00\xfe\xff\xff\xff\xff\xff\xff\xff"
        "\x15\x00\x15\x20\x15\x20\x2c\x15\x04\x15\x00\x15\x06\x15\x06\x00\x00"
        "\x00\x00\x00\x00\x00\x00\xf0\xbf\x00\x00\x00\x00\x00\x00\xe0\x3f"
        /* 10 bytes: lengths and text */
        "\x15\x00\x15\x14\x15\x14\x2c\x15\x04\x15\x00\x15\x06\x15\x06\x00\x00"
        "\x02\x00\x00\x00"
        "ab\x00\x00\x00\x00"
        /* version 1; a schema of 4: the root with 3 children ... */
        "\x15\x02\x19\x4c\x48\x06schema\x15\x06\x00"
        /* ... type, REQUIRED, name; of text UTF8 */
        "\x15\x04\x25\x00\x18\x01n\x00\x15\x0a\x25\x00\x18\x01x\x00"
        "\x15\x0c\x25\x00\x18\x01s\x25\x00\x00"
        /* 2 rows; one row group with three chunks */
        "\x16\x04\x19\x1c\x19\x3c"
        /* at 4: INT64, {PLAIN, RLE}, ["n"], uncompressed, 2 values, 33 bytes */
        "\x26\x08\x1c\x15\x04\x19\x25\x00\x06\x19\x18\x01n\x15\x00\x16\x04\x16"
        "\x42\x16\x42\x26\x08\x00\x00"
        "\x26\x4a\x1c\x15\x0a\x19\x25\x00\x06\x19\x18\x01x\x15\x00\x16\x04\x16"
        "\x42\x16\x42\x26\x4a\x00\x00"
        "\x26\x8c\x01\x1c\x15\x0c\x19\x25\x00\x06\x19\x18\x01s\x15\x00\x16\x04"
        "\x16\x36\x16\x36\x26\x8c\x01\x00\x00"
        /* 93 bytes, 2 rows; created by; the length of the footer */
        "\x16\xba\x01\x16\x04\x00\x28\x01"
        "c\x00\x86\x00\x00\x00PAR1";
    unsigned char bytes[512];
    (void)state;
    const size_t size = written(2, bytes, sizeof bytes);
    assert_int_equal(size, sizeof want - 1);
    for (size_t i = 0; i < size; i++)
        if (bytes[i] != want[i])
            fail_msg("byte %zu: %02x, not %02x", i, bytes[i], want[i]);
}

static void a_table_without_rows_is_one_too(void **state)
{
    unsigned char bytes[512];
    (void)state;
    const size_t size = written(0, bytes, sizeof bytes);
    assert_true(size > 12 && memcmp(bytes, "PAR1", 4) == 0 &&
                memcmp(bytes + size - 4, "PAR1", 4) == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_table_of_each_type_is_as_the_format_has_it),
        cmocka_unit_test(a_table_without_rows_is_one_too),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* sim/device/cia402/eds.c - the object dictionary as an electronic data sheet,
 * for other people's masters.  Source: CiA 306. */
#include "sim/device/cia402/parts.h"

#include <inttypes.h>
#include <string.h>

#define EDS_VAR    7
#define EDS_RECORD 9

/* Rows of one index; they stand together. */
static int eds_rows(int row)
{
    int count = 1;

    while (row + count < CIA402_ROW_COUNT &&
           cia402_od_index(row + count) == cia402_od_index(row))
        count++;
    return count;
}

static void eds_value(FILE *file, int row)
{
    if (cia402_od_is_long(row))
        return;
    fprintf(file, "DefaultValue=%s0x%" PRIX32 "\n",
            cia402_od_adds_node(row) ? "$NODEID+" : "", cia402_od_default(row));
}

static void eds_limits(FILE *file, int row)
{
    int64_t min, max;

    cia402_od_range(row, &min, &max);
    if (min != 0 || max != 0)
        fprintf(file, "LowLimit=%" PRId64 "\nHighLimit=%" PRId64 "\n", min,
                max);
}

static void eds_row(FILE *file, int row)
{
    fprintf(file,
            "ParameterName=%s\nObjectType=0x%X\nDataType=0x%04X\n"
            "AccessType=%s\nPDOMapping=%d\n",
            cia402_od_name(row), EDS_VAR, cia402_od_type(row),
            cia402_od_access(row),
            cia402_od_is_mappable(row, true) ||
                cia402_od_is_mappable(row, false));
    eds_value(file, row);
    eds_limits(file, row);
    fputc('\n', file);
}

static void eds_object(FILE *file, int row)
{
    const unsigned index = cia402_od_index(row);
    const int rows = eds_rows(row);

    fprintf(file, "[%04X]\n", index);
    if (rows == 1) {
        eds_row(file, row);
        return;
    }
    fprintf(file, "ParameterName=%s\nObjectType=0x%X\nSubNumber=%d\n\n",
            cia402_od_name(row), EDS_RECORD, rows);
    for (int i = 0; i < rows; i++) {
        fprintf(file, "[%04Xsub%X]\n", index, cia402_od_sub(row + i));
        eds_row(file, row + i);
    }
}

static bool eds_is_mandatory(unsigned index)
{
    return index == 0x1000 || index == 0x1001 || index == 0x1018;
}

/* 0 mandatory, 1 optional, 2 the maker's; dummies are none of them. */
static int eds_list_of(unsigned index)
{
    if (index < 0x1000)
        return -1;
    if (eds_is_mandatory(index))
        return 0;
    return index >= 0x2000 && index < 0x6000 ? 2 : 1;
}

static int eds_list_count(int list)
{
    int count = 0;

    for (int row = 0; row < CIA402_ROW_COUNT; row += eds_rows(row))
        count += eds_list_of(cia402_od_index(row)) == list;
    return count;
}

static void eds_list(FILE *file, const char *name, int list)
{
    int number = 0;

    fprintf(file, "[%s]\nSupportedObjects=%d\n", name, eds_list_count(list));
    for (int row = 0; row < CIA402_ROW_COUNT; row += eds_rows(row))
        if (eds_list_of(cia402_od_index(row)) == list)
            fprintf(file, "%d=0x%04X\n", ++number, cia402_od_index(row));
    fputc('\n', file);
}

void sim_cia402_write_eds(FILE *file)
{
    fputs("[FileInfo]\nFileName=slew-servo.eds\nFileVersion=1\n"
          "FileRevision=0\nEDSVersion=4.0\n"
          "Description=simulated CiA 402 servo of slew\n\n"
          "[DeviceInfo]\nVendorName=slew\nVendorNumber=0x0\n"
          "ProductName=slew servo\nProductNumber=0x192\n"
          "RevisionNumber=0x10000\nBaudRate_10=1\nBaudRate_20=1\n"
          "BaudRate_50=1\nBaudRate_125=1\nBaudRate_250=1\nBaudRate_500=1\n"
          "BaudRate_800=1\nBaudRate_1000=1\nSimpleBootUpMaster=0\n"
          "SimpleBootUpSlave=1\nGranularity=8\n"
          "DynamicChannelsSupported=0\nGroupMessaging=0\nNrOfRXPDO=4\n"
          "NrOfTXPDO=4\nLSS_Supported=1\n\n"
          "[DummyUsage]\nDummy0001=0\nDummy0002=1\nDummy0003=1\n"
          "Dummy0004=1\nDummy0005=1\nDummy0006=1\nDummy0007=1\n\n",
          file);
    eds_list(file, "MandatoryObjects", 0);
    eds_list(file, "OptionalObjects", 1);
    eds_list(file, "ManufacturerObjects", 2);
    for (int row = 0; row < CIA402_ROW_COUNT; row += eds_rows(row))
        if (cia402_od_index(row) >= 0x1000)
            eds_object(file, row);
}

/* tests/fuzz/fuzz_map.c - register maps; one that is taken can be driven. */
#include "firmware/host/device/modbus_map_load.h"
#include "firmware/linux/base/disk.h"
#include "hal/drive/modbus/drive.h"
#include "hal/modbus/master.h"
#include "tests/fuzz/fuzz.h"

static void fuzz_map_drive(const struct modbus_map *map)
{
    static struct modbus_master line;
    static struct modbus_bus bus;
    static struct drive_modbus drive;
    const struct modbus_master_config config = { .line = map->line };
    const struct drive_modbus_config servo = { .map = map,
                                               .unit = 1,
                                               .counts_num = 1000,
                                               .counts_den = 1,
                                               .vel_max_q32 = INT64_C(1) << 32,
                                               .acc_q32 = INT64_C(1) << 32,
                                               .cycle_ns = 20000000 };

    fuzz_claim(modbus_master_init(&line, &config) == 0, "a map's line exists");
    fuzz_claim(modbus_bus_init(&bus, &line.modbus, 2) == 0, "a bus");
    if (drive_modbus_init(&drive, &bus, &servo) < 0)
        return;
    for (int64_t t = 1; t < 40; t++) {
        (void)hal_fieldbus_begin(&bus.fieldbus, t * 1000000);
        hal_fieldbus_end(&bus.fieldbus, t * 1000000);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct modbus_map map;
    char message[YAML_MESSAGE_MAX] = "";
    const char *path = fuzz_file(data, size);

    if (modbus_map_load(&disk_files, path, &map, message) < 0) {
        fuzz_claim_sentence(path, message);
        return 0;
    }
    fuzz_claim(map.item_count >= 1 && map.item_count <= MODBUS_MAP_ITEMS_MAX,
               "a map has items");
    fuzz_map_drive(&map);
    return 0;
}

/* firmware/linux/tools/doctor_line.c - serial ports and GPIO chips; see
 * doctor.h. */
#define _XOPEN_SOURCE 700 /* realpath */
#include "firmware/host/base/number.h"
#include "firmware/linux/tools/doctor_parts.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- serial ports ---- */

/* The rig's device may be a link, such as those of /dev/serial/by-id: seen from
 * its end.  Only for this machine. */
static void line_resolve(const struct doctor *doctor, const char *device,
                         char path[DOCTOR_PATH_MAX])
{
    char *real = doctor->config.root[0] == '\0' ? realpath(device, NULL) : NULL;

    snprintf(path, DOCTOR_PATH_MAX, "%s", real == NULL ? device : real);
    free(real);
}

static bool line_is_needed(const struct doctor *doctor, const char *path)
{
    const struct rig *rig = doctor->config.rig;
    char own[DOCTOR_PATH_MAX];

    for (unsigned i = 0; rig != NULL && i < rig->bus_count; i++) {
        if (rig->bus[i].kind != RIG_MODBUS_RTU)
            continue;
        line_resolve(doctor, rig->bus[i].modbus.device, own);
        if (strcmp(own, path) == 0)
            return true;
    }
    return false;
}

/* FTDI adapters gather what they receive for so long before they hand it on. */
static void line_latency(struct doctor *doctor, const char *name)
{
    int64_t latency_ms = 0;

    if (!doctor_read_number(doctor, &latency_ms,
                            "/sys/bus/usb-serial/devices/%s/latency_timer",
                            name))
        return;
    if (latency_ms <= 1) {
        doctor_say(doctor, DOCTOR_OK, "serial",
                   "%s hands on what it receives after %" PRId64 " ms", name,
                   latency_ms);
        return;
    }
    doctor_say(doctor, DOCTOR_ADVICE, "serial",
               "%s keeps what it receives for up to %" PRId64
               " ms, in every transaction",
               name, latency_ms);
    doctor_advise(doctor,
                  "echo 1 | sudo tee "
                  "/sys/bus/usb-serial/devices/%s/latency_timer",
                  name);
}

static void line_serial(struct doctor *doctor, const char *prefix)
{
    static char name[DOCTOR_NAMES][DOCTOR_NAME_MAX];
    const unsigned count = doctor_list(doctor, "/sys/class/tty", prefix, name);

    for (unsigned i = 0; i < count; i++) {
        char path[DOCTOR_NAME_MAX + 8];

        snprintf(path, sizeof path, "/dev/%.63s", name[i]);
        if (!line_is_needed(doctor, path))
            doctor_device(doctor, path, false);
        line_latency(doctor, name[i]);
    }
}

static void line_of_rig(struct doctor *doctor)
{
    const struct rig *rig = doctor->config.rig;

    for (unsigned i = 0; rig != NULL && i < rig->bus_count; i++) {
        char path[DOCTOR_PATH_MAX];

        if (rig->bus[i].kind != RIG_MODBUS_RTU)
            continue;
        line_resolve(doctor, rig->bus[i].modbus.device, path);
        doctor_device(doctor, path, true);
    }
}

/* Say what the service that has the rig has met on its lines. */
static void line_served(struct doctor *doctor)
{
    const cJSON *bus, *text;

    cJSON_ArrayForEach(bus,
                       cJSON_GetObjectItem(doctor->config.service, "buses"))
    {
        const char *name =
            cJSON_GetStringValue(cJSON_GetObjectItem(bus, "name"));

        cJSON_ArrayForEach(text, cJSON_GetObjectItem(bus, "says"))
        {
            if (name != NULL && cJSON_IsString(text))
                doctor_say(doctor, DOCTOR_ADVICE, "line", "%s: %s", name,
                           text->valuestring);
        }
    }
}

/* ---- GPIO ---- */

static void line_gpio(struct doctor *doctor)
{
    static char name[DOCTOR_NAMES][DOCTOR_NAME_MAX];
    const struct rig *rig = doctor->config.rig;
    const bool needed = rig != NULL && rig->line_count > 0;
    const unsigned count = doctor_list(doctor, "/dev", "gpiochip", name);

    for (unsigned i = 0; i < count; i++) {
        char path[DOCTOR_NAME_MAX + 8];

        snprintf(path, sizeof path, "/dev/%.63s", name[i]);
        doctor_device(doctor, path, needed);
    }
    if (count > 0 || !needed)
        return;
    doctor_say(doctor, DOCTOR_BAD, "gpio",
               "no GPIO chip, and the rig has %" PRIu32 " %s", rig->line_count,
               number_word(rig->line_count, "line", "lines"));
    doctor_advise(doctor, "`gpiodetect` lists chips; a Raspberry Pi has them "
                          "with its own kernel");
}

void doctor_lines(struct doctor *doctor)
{
    line_of_rig(doctor);
    line_serial(doctor, "ttyUSB");
    line_serial(doctor, "ttyACM");
    line_served(doctor);
    line_gpio(doctor);
}

/* firmware/linux/tools/doctor_kernel.c - what the kernel was built with, and
 * the libraries; see doctor.h. */
#include "firmware/host/base/memory.h"
#include "firmware/linux/tools/doctor_parts.h"

#include <cairo.h>
#include <cjson/cJSON.h>
#include <modbus.h>
#include <stdio.h>
#include <string.h>
#include <yaml.h>
#include <zlib.h>

#include "firmware/host/base/array.h"
#include "hal/linux/libgpiod.h"

#define KERNEL_CONFIG_MAX (1 << 19)

static bool kernel_rig_has_can(const struct rig *rig)
{
    for (unsigned i = 0; rig != NULL && i < rig->bus_count; i++)
        if (rig_bus_is_can(&rig->bus[i]))
            return true;
    return false;
}

static bool kernel_rig_has_lines(const struct rig *rig)
{
    return rig != NULL && rig->line_count > 0;
}

static bool kernel_any(const struct rig *rig)
{
    (void)rig;
    return false;
}

/* Options, what for, and which rigs cannot do without. */
static const struct {
    const char *name, *what;
    bool (*needs)(const struct rig *rig);
} kernel_row[] = {
    { "CONFIG_CAN", "CAN", kernel_rig_has_can },
    { "CONFIG_CAN_RAW", "raw CAN sockets", kernel_rig_has_can },
    { "CONFIG_CAN_DEV", "CAN adapters", kernel_any },
    { "CONFIG_GPIO_CDEV", "GPIO lines", kernel_rig_has_lines },
    { "CONFIG_USB_SERIAL", "USB serial adapters", kernel_any },
    { "CONFIG_HIGH_RES_TIMERS", "timers finer than a tick", kernel_any },
};

/* 'y', 'm' or 'n'. */
static char kernel_option(const char *config, const char *name)
{
    const size_t length = strlen(name);

    for (const char *line = config; line != NULL;
         line = strchr(line, '\n'), line = line == NULL ? NULL : line + 1)
        if (strncmp(line, name, length) == 0 && line[length] == '=')
            return line[length + 1];
    return 'n';
}

static void kernel_lacks(struct doctor *doctor, size_t i)
{
    const struct rig *rig = doctor->config.rig;

    doctor_say(doctor, kernel_row[i].needs(rig) ? DOCTOR_BAD : DOCTOR_NOTE,
               "kernel", "built without %s (%s)", kernel_row[i].what,
               kernel_row[i].name);
    doctor_advise(doctor, "a kernel that has it: Debian's own "
                          "(linux-image-$(dpkg --print-architecture)) does");
}

static void kernel_config(struct doctor *doctor, const char *config)
{
    unsigned there = 0;
    const unsigned rows = ARRAY_LEN(kernel_row);

    for (size_t i = 0; i < rows; i++) {
        const char how = kernel_option(config, kernel_row[i].name);

        if (how == 'y' || how == 'm')
            there++;
        else
            kernel_lacks(doctor, i);
    }
    if (there == rows)
        doctor_say(doctor, DOCTOR_OK, "kernel",
                   "has CAN, GPIO lines, USB serial and fine timers");
}

/* A file that may be packed; false: not there. */
static bool kernel_read(const struct doctor *doctor, const char *name,
                        char *config)
{
    char path[DOCTOR_PATH_MAX];
    int length;
    gzFile file;

    doctor_path(doctor, path, "%s", name);
    file = gzopen(path, "rb");
    if (file == NULL)
        return false;
    length = gzread(file, config, KERNEL_CONFIG_MAX - 1);
    gzclose(file);
    config[length > 0 ? length : 0] = '\0';
    return length > 0;
}

static bool kernel_look(struct doctor *doctor, const char *in_boot)
{
    char *config = memory_new(1, KERNEL_CONFIG_MAX);
    const bool found = kernel_read(doctor, in_boot, config) ||
                       kernel_read(doctor, "/proc/config.gz", config);
    if (found)
        kernel_config(doctor, config);
    memory_free(config);
    return found;
}

void doctor_kernel(struct doctor *doctor)
{
    char release[DOCTOR_NAME_MAX], in_boot[DOCTOR_NAME_MAX + 16];

    if (!doctor_read(doctor, release, sizeof release,
                     "/proc/sys/kernel/osrelease"))
        return;
    doctor_say(doctor, DOCTOR_NOTE, "kernel", "Linux %s", release);
    snprintf(in_boot, sizeof in_boot, "/boot/config-%s", release);
    if (kernel_look(doctor, in_boot))
        return;
    doctor_say(doctor, DOCTOR_NOTE, "kernel",
               "how it was built is neither in /boot/config-%s nor in "
               "/proc/config.gz",
               release);
}

void doctor_libraries(struct doctor *doctor)
{
    doctor_say(doctor, DOCTOR_NOTE, "libraries",
               "libyaml %s, cJSON %s, cairo %s, libmodbus %u.%u.%u, "
               "libgpiod %s",
               yaml_get_version_string(), cJSON_Version(),
               cairo_version_string(), libmodbus_version_major,
               libmodbus_version_minor, libmodbus_version_micro,
               gpio_libgpiod_version());
}

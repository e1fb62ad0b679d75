/* firmware/linux/tools/doctor_cpu.c - processor and scheduler; see doctor.h. */
#include "firmware/host/base/array.h"
#include "firmware/linux/tools/doctor_parts.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define CPU_SLEEP_US 100 /* a wake-up may take so long: a tenth of a tick */

static void cpu_governor(struct doctor *doctor)
{
    static char name[DOCTOR_NAMES][DOCTOR_NAME_MAX];
    const unsigned count =
        doctor_list(doctor, "/sys/devices/system/cpu", "cpu", name);
    char governor[DOCTOR_NAME_MAX] = "";
    unsigned governed = 0, fast = 0;

    for (unsigned i = 0; i < count; i++) {
        char text[DOCTOR_NAME_MAX];

        if (!doctor_read(doctor, text, sizeof text,
                         "/sys/devices/system/cpu/%s/cpufreq/scaling_governor",
                         name[i]))
            continue;
        governed++;
        if (strcmp(text, "performance") == 0)
            fast++;
        else
            memcpy(governor, text, sizeof text);
    }
    if (governed == 0)
        return;
    if (fast == governed) {
        doctor_say(doctor, DOCTOR_OK, "processor",
                   "the clock stays up (governor performance)");
        return;
    }
    doctor_say(doctor, DOCTOR_ADVICE, "processor",
               "the clock goes down when there is little to do (governor %s)",
               governor);
    doctor_advise(doctor, "echo performance | sudo tee "
                          "/sys/devices/system/cpu/cpu*/cpufreq/"
                          "scaling_governor");
}

/* The idle state that takes longest to leave, of those that are on. */
static void cpu_idle(struct doctor *doctor)
{
    static char name[DOCTOR_NAMES][DOCTOR_NAME_MAX];
    static const char *const base = "/sys/devices/system/cpu/cpu0/cpuidle";
    const unsigned count = doctor_list(doctor, base, "state", name);
    char deepest[DOCTOR_NAME_MAX] = "";
    int64_t worst_us = -1;

    for (unsigned i = 0; i < count; i++) {
        int64_t latency_us = 0, disabled = 0;

        if (!doctor_read_number(doctor, &latency_us, "%s/%s/latency", base,
                                name[i]) ||
            (doctor_read_number(doctor, &disabled, "%s/%s/disable", base,
                                name[i]) &&
             disabled != 0) ||
            latency_us <= worst_us)
            continue;
        worst_us = latency_us;
        if (!doctor_read(doctor, deepest, sizeof deepest, "%s/%s/name", base,
                         name[i]))
            memcpy(deepest, name[i], sizeof deepest);
    }
    if (worst_us < 0)
        return;
    if (worst_us <= CPU_SLEEP_US) {
        doctor_say(doctor, DOCTOR_OK, "processor",
                   "wakes up from its deepest sleep (%s) in %" PRId64 " us",
                   deepest, worst_us);
        return;
    }
    doctor_say(doctor, DOCTOR_ADVICE, "processor",
               "wakes up from its deepest sleep (%s) in %" PRId64 " us",
               deepest, worst_us);
    doctor_advise(doctor, "sudo cpupower idle-set -D %d", CPU_SLEEP_US);
}

static void cpu_scheduler(struct doctor *doctor)
{
    char text[DOCTOR_TEXT_MAX];
    int64_t number = 0;

    if ((doctor_read_number(doctor, &number, "/sys/kernel/realtime") &&
         number == 1) ||
        (doctor_read(doctor, text, sizeof text, "/proc/version") &&
         strstr(text, "PREEMPT_RT") != NULL)) {
        doctor_say(doctor, DOCTOR_OK, "scheduler", "a PREEMPT_RT kernel");
    } else {
        doctor_say(doctor, DOCTOR_NOTE, "scheduler", "no PREEMPT_RT kernel");
        doctor_advise(doctor, "sudo apt install linux-image-rt-$(dpkg "
                              "--print-architecture) if wake-ups are late");
    }
    if (doctor_read(doctor, text, sizeof text,
                    "/sys/devices/system/cpu/isolated"))
        doctor_say(doctor, DOCTOR_NOTE, "scheduler", "isolated processors: %s",
                   text[0] == '\0' ? "none" : text);
}

static void cpu_clock(struct doctor *doctor)
{
    static const char *const base =
        "/sys/devices/system/clocksource/clocksource0";
    static const char *const slow[] = { "hpet", "acpi_pm", "jiffies",
                                        "refined-jiffies", "pit" };
    char text[DOCTOR_TEXT_MAX], others[DOCTOR_TEXT_MAX];

    if (!doctor_read(doctor, text, sizeof text, "%s/current_clocksource", base))
        return;
    for (size_t i = 0; i < ARRAY_LEN(slow); i++) {
        if (strcmp(text, slow[i]) != 0)
            continue;
        if (!doctor_read(doctor, others, sizeof others,
                         "%s/available_clocksource", base))
            others[0] = '\0';
        doctor_say(doctor, DOCTOR_ADVICE, "clock",
                   "time comes from %s, which is slow to read", text);
        doctor_advise(
            doctor, "`dmesg | grep -i clocksource` says why; available: %.80s",
            others);
        return;
    }
    doctor_say(doctor, DOCTOR_OK, "clock", "time comes from %.40s", text);
}

void doctor_cpu(struct doctor *doctor)
{
    cpu_governor(doctor);
    cpu_idle(doctor);
    cpu_scheduler(doctor);
    cpu_clock(doctor);
}

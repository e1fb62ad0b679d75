/* firmware/linux/tools/doctor_rights.c - groups, capabilities, limits, device
 * files; see doctor.h. */
#include "firmware/linux/tools/doctor_parts.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define RIGHTS_PRIORITY 40 /* that slew's loop takes, see player.c */

/* ---- who we are ---- */

static void rights_groups(struct doctor_self *self, const char *text)
{
    char *end;

    while (self->group_count < DOCTOR_GROUPS_MAX) {
        const unsigned long group = strtoul(text, &end, 10);

        if (end == text)
            return;
        self->group[self->group_count++] = (unsigned)group;
        text = end;
    }
}

/* "Name:" at the start of a line of /proc/self/status; what follows it. */
static const char *rights_field(const char *text, const char *name)
{
    const size_t length = strlen(name);

    while (text != NULL && strncmp(text, name, length) != 0) {
        text = strchr(text, '\n');
        text = text == NULL ? NULL : text + 1;
    }
    return text == NULL ? NULL : text + length;
}

static void rights_self(struct doctor *doctor)
{
    struct doctor_self *self = &doctor->self;
    char text[4096];
    const char *uid, *gid, *groups, *capabilities;

    if (!doctor_read(doctor, text, sizeof text, "/proc/self/status"))
        return;
    uid = rights_field(text, "Uid:");
    gid = rights_field(text, "Gid:");
    groups = rights_field(text, "Groups:");
    capabilities = rights_field(text, "CapEff:");
    if (uid == NULL || gid == NULL || groups == NULL || capabilities == NULL)
        return;
    self->known = true;
    self->uid = (unsigned)strtoul(uid, NULL, 10);
    self->capabilities = strtoull(capabilities, NULL, 16);
    self->group[self->group_count++] = (unsigned)strtoul(gid, NULL, 10);
    /* they end with the line: the next one begins with a letter */
    rights_groups(self, groups);
}

static bool doctor_may(const struct doctor *doctor, unsigned capability)
{
    return (doctor->self.capabilities >> capability & 1) != 0;
}

static bool rights_in_group(const struct doctor *doctor, unsigned group)
{
    for (unsigned i = 0; i < doctor->self.group_count; i++)
        if (doctor->self.group[i] == group)
            return true;
    return false;
}

/* ---- device files ---- */

/* "dialout" for 20; false: /etc/group has none of that number. */
static bool rights_group_name(const struct doctor *doctor, unsigned group,
                              char name[DOCTOR_NAME_MAX])
{
    static char text[1 << 16];
    char *rest = NULL;

    if (!doctor_read(doctor, text, sizeof text, "/etc/group"))
        return false;
    for (char *line = strtok_r(text, "\n", &rest); line != NULL;
         line = strtok_r(NULL, "\n", &rest)) {
        char *colon = strchr(line, ':');
        char *number = colon == NULL ? NULL : strchr(colon + 1, ':');

        if (number == NULL || strtoul(number + 1, NULL, 10) != group)
            continue;
        *colon = '\0';
        snprintf(name, DOCTOR_NAME_MAX, "%s", line);
        return true;
    }
    return false;
}

static bool rights_open(const struct doctor *doctor, const struct stat *about)
{
    const mode_t both = about->st_mode;

    if (doctor_may(doctor, DOCTOR_CAP_DAC_OVERRIDE))
        return true;
    if (about->st_uid == doctor->self.uid)
        return (both & 0600) == 0600;
    if (rights_in_group(doctor, about->st_gid))
        return (both & 0060) == 0060;
    return (both & 0006) == 0006;
}

void doctor_device(struct doctor *doctor, const char *path, bool needed)
{
    const enum doctor_verdict bad = needed ? DOCTOR_BAD : DOCTOR_ADVICE;
    char whole[DOCTOR_PATH_MAX], group[DOCTOR_NAME_MAX];
    struct stat about;

    doctor_path(doctor, whole, "%s", path);
    if (stat(whole, &about) != 0) {
        doctor_say(doctor, bad, "device", "%s: %s", path, strerror(errno));
        doctor_advise(doctor, "is it plugged in? `dmesg | tail` and `ls "
                              "/dev/serial/by-id` say what the kernel found");
        return;
    }
    if (!doctor->self.known || rights_open(doctor, &about)) {
        doctor_say(doctor, DOCTOR_OK, "device", "%s may be opened", path);
        return;
    }
    doctor_say(doctor, bad, "device", "%s may not be opened by you", path);
    if (about.st_gid != 0 && (about.st_mode & 0060) == 0060 &&
        rights_group_name(doctor, about.st_gid, group))
        doctor_advise(doctor, "sudo usermod -aG %s $USER, then log in again",
                      group);
    else
        doctor_advise(doctor,
                      "a udev rule: GROUP=\"plugdev\", MODE=\"0660\" "
                      "for %s",
                      path);
}

/* ---- limits ---- */

/* The soft limit of a row of /proc/self/limits; INT64_MAX: unlimited. */
static bool rights_limit(const struct doctor *doctor, const char *name,
                         int64_t *limit)
{
    char text[4096];
    const char *field;

    if (!doctor_read(doctor, text, sizeof text, "/proc/self/limits"))
        return false;
    field = rights_field(text, name);
    if (field == NULL)
        return false;
    field += strspn(field, " ");
    *limit = strncmp(field, "unlimited", 9) == 0 ? INT64_MAX
                                                 : strtoll(field, NULL, 10);
    return true;
}

static void rights_priority(struct doctor *doctor)
{
    int64_t limit = 0;

    if (!rights_limit(doctor, "Max realtime priority", &limit) &&
        !doctor->self.known)
        return;
    if (limit >= RIGHTS_PRIORITY || doctor_may(doctor, DOCTOR_CAP_SYS_NICE)) {
        doctor_say(doctor, DOCTOR_OK, "priority",
                   "slew may run ahead of other programs (SCHED_FIFO)");
        return;
    }
    doctor_say(doctor, DOCTOR_ADVICE, "priority",
               "real-time priorities up to %" PRId64 ", slew takes %d", limit,
               RIGHTS_PRIORITY);
    doctor_advise(doctor,
                  "echo \"$USER - rtprio %d\" | sudo tee "
                  "/etc/security/limits.d/slew.conf, then log in again",
                  RIGHTS_PRIORITY);
}

static bool rights_swaps(const struct doctor *doctor)
{
    char text[1024];
    const char *line;

    if (!doctor_read(doctor, text, sizeof text, "/proc/swaps"))
        return false;
    line = strchr(text, '\n'); /* after the heading */
    return line != NULL && line[1] == '/';
}

/* slew does not lock its memory; what is not swapped needs no lock. */
static void rights_memory(struct doctor *doctor)
{
    int64_t limit = 0;

    if (!rights_limit(doctor, "Max locked memory", &limit))
        return;
    if (!rights_swaps(doctor)) {
        doctor_say(doctor, DOCTOR_OK, "memory",
                   "there is no swap: nothing needs to be locked");
        return;
    }
    doctor_say(doctor, DOCTOR_ADVICE, "memory",
               "swap is on (up to %" PRId64 " kB may be locked): a page that "
               "was swapped out costs milliseconds",
               limit == INT64_MAX ? limit : limit / 1024);
    doctor_advise(doctor, "sudo swapoff -a while the machine moves");
}

void doctor_rights(struct doctor *doctor)
{
    rights_self(doctor);
    if (!doctor->self.known)
        doctor_say(doctor, DOCTOR_NOTE, "rights",
                   "/proc/self/status does not say who we are");
    else if (doctor_may(doctor, DOCTOR_CAP_NET_ADMIN))
        doctor_say(doctor, DOCTOR_OK, "rights",
                   "CAN interfaces may be set up (CAP_NET_ADMIN)");
    else {
        doctor_say(doctor, DOCTOR_NOTE, "rights",
                   "CAN interfaces may not be set up (no CAP_NET_ADMIN)");
        doctor_advise(doctor, "only for ip link set: run that with sudo");
    }
    rights_priority(doctor);
    rights_memory(doctor);
}

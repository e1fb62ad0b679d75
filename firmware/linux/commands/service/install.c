/* firmware/linux/commands/service/install.c - see install.h. */
#define _GNU_SOURCE /* realpath */
#include "firmware/linux/commands/service/install.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "firmware/linux/base/error.h"
#include "firmware/linux/commands/planning.h"

#define INSTALL_UNIT_MAX 64
#define INSTALL_TEXT_MAX 32768
#define INSTALL_PATH_MAX 4096
#define INSTALL_MORE_MAX 200

struct install {
    const struct options *options;
    char rig[INSTALL_PATH_MAX];     /* full */
    char program[INSTALL_PATH_MAX]; /* the same */
    char recordings[INSTALL_PATH_MAX];
    char clock[INSTALL_PATH_MAX + 16]; /* the option, or "" */
    char unit[INSTALL_UNIT_MAX];       /* slew-NAME.service */
    char text[INSTALL_TEXT_MAX];
};

/* No capability: what real time needs are limits.  The guardian ignores SIGTERM
 * and needs its time, so every process gets one, and a kill comes late.  Nothing
 * moves without a client, so nothing is started again by itself. */
static const char install_unit[] =
    "[Unit]\n"
    "Description=slew, %s\n"
    "Documentation=man:slew(1)\n"
    "\n"
    "[Service]\n"
    "Type=notify\n"
    "ExecStart=\"%s\" service run %s --group --recordings \"%s\"%s%s%s "
    "\"%s\"\n"
    "%s"
    "Restart=no\n"
    "WatchdogSec=2\n"
    "TimeoutStopSec=45\n"
    "User=slew\n"
    "Group=slew\n"
    "SupplementaryGroups=dialout audio\n"
    "RuntimeDirectory=slew\n"
    "RuntimeDirectoryPreserve=yes\n"
    "RuntimeDirectoryMode=0750\n"
    "LimitRTPRIO=50\n"
    "LimitMEMLOCK=infinity\n"
    "CapabilityBoundingSet=\n"
    "AmbientCapabilities=\n"
    "NoNewPrivileges=yes\n"
    "ProtectSystem=strict\n"
    "ProtectHome=read-only\n"
    "PrivateTmp=yes\n"
    "DevicePolicy=closed\n"
    "DeviceAllow=char-ttyS rw\n"
    "DeviceAllow=char-ttyUSB rw\n"
    "DeviceAllow=char-ttyACM rw\n"
    "DeviceAllow=char-gpiochip rw\n"
    "DeviceAllow=char-alsa r\n"
    "ProtectClock=yes\n"
    "ProtectControlGroups=yes\n"
    "ProtectHostname=yes\n"
    "ProtectKernelLogs=yes\n"
    "ProtectKernelModules=yes\n"
    "ProtectKernelTunables=yes\n"
    "ProtectProc=invisible\n"
    "RestrictAddressFamilies=AF_UNIX AF_CAN AF_INET AF_INET6 AF_NETLINK\n"
    "RestrictNamespaces=yes\n"
    "RestrictSUIDSGID=yes\n"
    "LockPersonality=yes\n"
    "MemoryDenyWriteExecute=yes\n"
    "SystemCallArchitectures=native\n"
    "SystemCallFilter=@system-service\n"
    "UMask=0027\n"
    "\n"
    "[Install]\n"
    "WantedBy=multi-user.target\n";

/* Where it records: /var/lib/slew-NAME, made by systemd for its user alone to
 * write; or where the operator says, and nothing else of the disk. */
static const char install_state[] = "%S/%N";
static const char install_state_rows[] = "StateDirectory=%N\n"
                                         "StateDirectoryMode=0750\n";

static const char install_user[] = "u slew - \"slew, motion of servos\" /\n"
                                   "m slew dialout\n";

/* --- names --- */

/* "dolly" of dolly.yaml and of dolly/rig.yaml, as a unit may be called. */
static void install_name(const char *rig, char unit[INSTALL_UNIT_MAX])
{
    const char *slash = strrchr(rig, '/');
    const char *name = slash == NULL ? rig : slash + 1;
    size_t length = strcspn(name, ".");
    if (slash != NULL && slash > rig && strcmp(name, "rig.yaml") == 0) {
        for (name = slash; name > rig && name[-1] != '/';)
            name--;
        length = (size_t)(slash - name);
    }
    int used = snprintf(unit, INSTALL_UNIT_MAX, "slew-%.*s.service",
                        length > 40 ? 40 : (int)length, name);
    for (int i = 0; i < used; i++)
        if (!isalnum((unsigned char)unit[i]) && unit[i] != '.')
            unit[i] = '-';
}

/* In the text of a unit, within quotes. */
static bool install_can_stand(const char *path)
{
    return path[strcspn(path, "\"\\%$\n\r")] == '\0';
}

static enum status install_cannot_stand(const char *path)
{
    return error_file(path, "the name cannot stand in a unit, expected one "
                            "without quotes, %, $ and backslashes");
}

static enum status install_names(struct install *self, const char *rig)
{
    char *full = realpath(rig, NULL);
    if (full == NULL)
        return error_file(rig, strerror(errno));
    const ssize_t length =
        readlink("/proc/self/exe", self->program, sizeof self->program - 1);
    const int n = snprintf(self->rig, sizeof self->rig, "%s", full);
    free(full);
    if (length <= 0 || n >= (int)sizeof self->rig ||
        !install_can_stand(self->rig) || !install_can_stand(self->program))
        return install_cannot_stand(rig);
    install_name(self->rig, self->unit);
    return STATUS_OK;
}

static enum status install_clock(struct install *self)
{
    const char *path = self->options->clock;
    char *full = path != NULL ? realpath(path, NULL) : NULL;
    if (path == NULL)
        return STATUS_OK;
    if (full == NULL)
        return error_file(path, strerror(errno));
    snprintf(self->clock, sizeof self->clock, " --clock \"%s\"", full);
    const bool can_stand = install_can_stand(full);
    free(full);
    return can_stand ? STATUS_OK : install_cannot_stand(path);
}

static enum status install_recordings(struct install *self)
{
    const char *path = self->options->recordings;
    struct stat about;
    char *full = path != NULL ? realpath(path, NULL) : NULL;
    if (path == NULL) {
        snprintf(self->recordings, sizeof self->recordings, "%s",
                 install_state);
        return STATUS_OK;
    }
    if (full == NULL)
        return error_file(path, strerror(errno));
    const bool is_directory = stat(full, &about) == 0 && S_ISDIR(about.st_mode);
    const bool fits = snprintf(self->recordings, sizeof self->recordings, "%s",
                               full) < (int)sizeof self->recordings;
    free(full);
    if (!is_directory)
        return error_file(path, strerror(ENOTDIR));
    return fits && install_can_stand(self->recordings)
               ? STATUS_OK
               : install_cannot_stand(path);
}

/* A number of an option that was given. */
static void install_more(char more[INSTALL_MORE_MAX], bool is_given,
                         const char *name, int64_t value)
{
    const size_t used = strlen(more);
    if (is_given)
        snprintf(more + used, INSTALL_MORE_MAX - used, " --%s %" PRId64, name,
                 value);
}

static enum status install_text(struct install *self)
{
    const struct options *options = self->options;
    char more[INSTALL_MORE_MAX] = "", rows[INSTALL_PATH_MAX + 32];
    struct rig rig = { .title = "" };
    const enum status status = planning_rig(self->rig, &rig);
    install_more(more, options->cpu >= 0, "cpu", options->cpu);
    install_more(more, options->port >= 0, "port", options->port);
    install_more(more, options->plan_ns > 0, "plan-time",
                 (options->plan_ns + 999999999) / 1000000000);
    install_more(more, options->plan_mib > 0, "plan-memory", options->plan_mib);
    for (char *at = rig.title; *at != '\0'; at++)
        if (iscntrl((unsigned char)*at) || *at == '%')
            *at = ' ';
    snprintf(rows, sizeof rows,
             options->recordings == NULL ? "%s" : "ReadWritePaths=\"%s\"\n",
             options->recordings == NULL ? install_state_rows
                                         : self->recordings);
    snprintf(self->text, sizeof self->text, install_unit, rig.title,
             self->program, options->real ? "--real --yes" : "--sim",
             self->recordings, options->records ? " --record-always" : "",
             self->clock, more, self->rig, rows);
    rig_free(&rig);
    return status;
}

/* --- steps --- */

static void install_under(const struct install *self, const char *name,
                          char path[INSTALL_PATH_MAX])
{
    const char *root = self->options->root;
    snprintf(path, INSTALL_PATH_MAX, "%s%s", root != NULL ? root : "", name);
}

static void install_folders(char path[INSTALL_PATH_MAX])
{
    for (char *at = strchr(path + 1, '/'); at != NULL;
         at = strchr(at + 1, '/')) {
        *at = '\0';
        (void)mkdir(path, 0755);
        *at = '/';
    }
}

static enum status install_write(const struct install *self, const char *name,
                                 const char *text)
{
    char path[INSTALL_PATH_MAX];
    install_under(self, name, path);
    printf("write %s\n", path);
    if (self->options->dry_run) {
        fputs(text, stdout);
        return STATUS_OK;
    }
    if (self->options->root != NULL)
        install_folders(path);
    FILE *file = fopen(path, "w");
    bool ok = file != NULL;
    if (ok) {
        ok = fputs(text, file) >= 0;
        ok = fclose(file) == 0 && ok;
    }
    if (ok)
        return STATUS_OK;
    error_say("%s: %s", path, strerror(errno));
    return STATUS_SYSTEM;
}

/* A command of the system, its words with blanks between them. */
static enum status install_run(const struct install *self, const char *words)
{
    char line[256], *argv[8] = { NULL };
    int count = 0, status = 0;
    char *rest = line;
    const bool runs = !self->options->dry_run && self->options->root == NULL;
    printf("run   %s\n", words);
    if (!runs)
        return STATUS_OK;
    fflush(stdout);
    snprintf(line, sizeof line, "%s", words);
    for (char *word; count < 7 && (word = strtok_r(rest, " ", &rest)) != NULL;)
        argv[count++] = word;
    const pid_t pid = fork();
    if (pid == 0) {
        if (count > 0)
            execvp(line, argv);
        _exit(127);
    }
    if (pid > 0 && waitpid(pid, &status, 0) == pid && WIFEXITED(status) &&
        WEXITSTATUS(status) == 0)
        return STATUS_OK;
    error_say("slew service: \"%s\" failed", words);
    return STATUS_SYSTEM;
}

static enum status install_unit_run(const struct install *self,
                                    const char *verb)
{
    char words[200];
    snprintf(words, sizeof words, "systemctl %s %s", verb, self->unit);
    return install_run(self, words);
}

static void install_unit_path(const struct install *self,
                              char path[INSTALL_PATH_MAX])
{
    snprintf(path, INSTALL_PATH_MAX, "/etc/systemd/system/%s", self->unit);
}

enum status service_install(const struct options *options, const char *rig)
{
    static struct install self;
    char path[INSTALL_PATH_MAX];
    self = (struct install){ .options = options };
    enum status status = install_names(&self, rig);
    if (status == STATUS_OK)
        status = install_recordings(&self);
    if (status == STATUS_OK)
        status = install_clock(&self);
    if (status == STATUS_OK)
        status = install_text(&self);
    install_unit_path(&self, path);
    if (status == STATUS_OK)
        status =
            install_write(&self, "/etc/sysusers.d/slew.conf", install_user);
    if (status == STATUS_OK)
        status = install_write(&self, path, self.text);
    if (status == STATUS_OK)
        status = install_run(&self, "systemd-sysusers");
    if (status == STATUS_OK)
        status = install_run(&self, "systemctl daemon-reload");
    return status == STATUS_OK ? install_unit_run(&self, "enable --now")
                               : status;
}

/* The user stays: files may be its own. */
enum status service_remove(const struct options *options, const char *rig)
{
    static struct install self;
    char name[INSTALL_PATH_MAX], path[INSTALL_PATH_MAX];
    self = (struct install){ .options = options };
    enum status status = install_names(&self, rig);
    if (status != STATUS_OK)
        return status;
    install_unit_path(&self, name);
    install_under(&self, name, path);
    if (access(path, F_OK) != 0) {
        error_say("%s: is not there, so there is nothing to remove", path);
        return STATUS_REFUSED;
    }
    status = install_unit_run(&self, "disable --now");
    printf("remove %s\n", path);
    if (status == STATUS_OK && !options->dry_run && unlink(path) < 0) {
        error_say("%s: %s", path, strerror(errno));
        status = STATUS_SYSTEM;
    }
    return status == STATUS_OK ? install_run(&self, "systemctl daemon-reload")
                               : status;
}

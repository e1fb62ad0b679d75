/* firmware/linux/commands/ports/sim_link.c - see sim_link.h. */
#include "firmware/linux/commands/ports/sim_link.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/linux/base/error.h"

/* One of a list: of which bus, and its path. */
struct sim_link {
    uint32_t bus;
    char path[PATH_MAX];
};

static const char *sim_link_target(const struct sim_server *server,
                                   const struct sim_link *link)
{
    return server->device[link->bus].host.path;
}

/* Find the bus of a terminal; without a name, the only one. */
static bool sim_link_bus(const struct rig *rig, const char *name, size_t length,
                         uint32_t *bus)
{
    unsigned found = 0;

    for (uint32_t b = 0; b < rig->bus_count; b++) {
        const char *own = rig->bus[b].name;
        if (rig->bus[b].kind != RIG_MODBUS_RTU ||
            (name != NULL &&
             (strlen(own) != length || memcmp(own, name, length) != 0)))
            continue;
        *bus = b;
        found++;
    }
    return found == 1;
}

/* Read one of the list and step over it; return what is wrong with it, or NULL. */
static const char *sim_link_next(const char **text,
                                 const struct sim_server *server,
                                 struct sim_link *link)
{
    const size_t length = strcspn(*text, ",");
    const char *equals = memchr(*text, '=', length),
               *path = equals == NULL ? *text : equals + 1;
    const size_t path_length = length - (size_t)(path - *text);

    snprintf(link->path, sizeof link->path, "%.*s", (int)path_length, path);
    if (path_length == 0 || path_length >= sizeof link->path)
        return "has no path, expected PATH or BUS=PATH";
    if (!sim_link_bus(server->rig, equals == NULL ? NULL : *text,
                      equals == NULL ? 0 : (size_t)(equals - *text),
                      &link->bus))
        return "does not say of which terminal, expected BUS=PATH with a bus "
               "on Modbus RTU";
    *text += length + ((*text)[length] == ',');
    return NULL;
}

static const char *sim_link_one(const struct sim_server *server,
                                const struct sim_link *link)
{
    struct stat seen;

    if (lstat(link->path, &seen) == 0) {
        if (!S_ISLNK(seen.st_mode))
            return "leads to a file that is no symbolic link, expected a new "
                   "name";
        (void)unlink(link->path);
    }
    return symlink(sim_link_target(server, link), link->path) == 0
               ? NULL
               : strerror(errno);
}

enum status sim_link_make(const char *text, const struct sim_server *server)
{
    struct sim_link link;

    while (text != NULL && *text != '\0') {
        const char *one = text, *wrong = sim_link_next(&text, server, &link);
        if (wrong == NULL)
            wrong = sim_link_one(server, &link);
        if (wrong == NULL)
            continue;
        error_say("slew sim: --link: '%.*s': %s", (int)strcspn(one, ","), one,
                  wrong);
        return STATUS_INPUT;
    }
    return STATUS_OK;
}

void sim_link_remove(const char *text, const struct sim_server *server)
{
    struct sim_link link;
    char target[PATH_MAX];

    while (text != NULL && *text != '\0' &&
           sim_link_next(&text, server, &link) == NULL) {
        const ssize_t length = readlink(link.path, target, sizeof target - 1);
        if (length < 0)
            continue;
        target[length] = '\0';
        if (strcmp(target, sim_link_target(server, &link)) == 0)
            (void)unlink(link.path);
    }
}

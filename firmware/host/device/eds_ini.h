/* firmware/host/device/eds_ini.h - sections and keys of a data sheet, as they stand
 * there.
 *
 * Lines end with LF, CR LF or CR.  A line that begins with ; or # is a comment, and
 * so is what follows a ; behind a blank.  A section or a key that stands there twice
 * is one: its later lines count.  Case makes no difference.  What is not UTF-8 is
 * taken for Latin-1. */
#ifndef FIRMWARE_HOST_DEVICE_EDS_INI_H
#define FIRMWARE_HOST_DEVICE_EDS_INI_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/base/files.h"

struct eds_key {
    const char *name, *text;
    unsigned line;
};

struct eds_section {
    const char *name;
    unsigned line;
    uint32_t first, count; /* of its keys */
};

/* Texts stand in `data`; all three are on the heap. */
struct eds_ini {
    char *data;
    struct eds_section *section; /* by name, of one name by line */
    struct eds_key *key;
    uint32_t sections, keys;
};

/* What is odd about a line, in words that go on from it. */
typedef void eds_ini_odd(void *of, unsigned line, const char *what,
                         const char *name);

/* 0; a negative errno, or 1 where the file holds a NUL. */
int eds_ini_read(struct eds_ini *ini, const struct files *files,
                 const char *path, eds_ini_odd *odd, void *of);
void eds_ini_free(struct eds_ini *ini);

/* The first of the sections of that name; NULL: there is none. */
const struct eds_section *eds_ini_find(const struct eds_ini *ini,
                                       const char *name);
/* The next one that has the name of this one; NULL: there is none. */
const struct eds_section *eds_ini_again(const struct eds_ini *ini,
                                        const struct eds_section *section);
/* The key of all of them; NULL: there is none, or nothing behind it. */
const struct eds_key *eds_ini_get(const struct eds_ini *ini,
                                  const struct eds_section *section,
                                  const char *name);

#endif

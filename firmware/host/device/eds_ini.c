/* firmware/host/device/eds_ini.c - see eds_ini.h. */
#include "firmware/host/device/eds_ini.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/quote.h"

#define INI_BYTES_MAX (16u << 20)
#define INI_CTRL_Z    0x1A
#define INI_NEAR      64 /* keys among which one is looked for again */

struct ini_read {
    struct eds_ini *ini;
    eds_ini_odd *odd;
    void *of;
    unsigned line;
    uint32_t sections_max, keys_max; /* room */
};

static void ini_odd(const struct ini_read *self, const char *what,
                    const char *name)
{
    self->odd(self->of, self->line, what, name);
}

/* --- the text --- */

static bool ini_is_utf8(const char *text, size_t length)
{
    uint32_t character;

    for (size_t i = 0; i < length;) {
        const unsigned n = quote_utf8_decode((const unsigned char *)text + i,
                                             length - i, &character);
        if (n == 0)
            return false;
        i += n;
    }
    return true;
}

static char *ini_from_latin1(char *text, size_t length)
{
    char *wide = memory_new(2 * length + 1, 1), *to = wide;

    for (size_t i = 0; i < length; i++) {
        const unsigned char c = (unsigned char)text[i];
        if (c >= 0x80)
            *to++ = (char)(0xC0 | c >> 6);
        *to++ = (char)(c < 0x80 ? c : 0x80 | (c & 0x3F));
    }
    free(text);
    return wide;
}

/* Without the white space around it. */
static char *ini_trim(char *text)
{
    char *end;

    while (isspace((unsigned char)*text))
        text++;
    end = text + strlen(text);
    while (end > text && isspace((unsigned char)end[-1]))
        end--;
    *end = '\0';
    return text;
}

static void ini_cut_comment(char *text)
{
    for (char *at = text; *at != '\0'; at++)
        if (*at == ';' && (at == text || isspace((unsigned char)at[-1]))) {
            *at = '\0';
            return;
        }
}

/* --- lines --- */

static void ini_section(struct ini_read *self, char *name)
{
    struct eds_ini *ini = self->ini;
    char *end = strchr(name, ']');

    if (end == NULL)
        ini_odd(self, "is a section without its ]", name);
    else
        *end = '\0';
    if (ini->sections == self->sections_max) {
        self->sections_max = 2 * self->sections_max + 64;
        ini->section = memory_resize(ini->section, self->sections_max,
                                     sizeof *ini->section);
    }
    ini->section[ini->sections++] = (struct eds_section){
        .name = ini_trim(name), .line = self->line, .first = ini->keys
    };
}

static void ini_key(struct ini_read *self, char *line)
{
    struct eds_ini *ini = self->ini;
    char *equals = strchr(line, '=');

    if (equals == NULL) {
        ini_odd(self, "is neither a section nor a key", line);
        return;
    }
    if (ini->sections == 0)
        return;
    *equals = '\0';
    ini_cut_comment(equals + 1);
    if (ini->keys == self->keys_max) {
        self->keys_max = 2 * self->keys_max + 256;
        ini->key = memory_resize(ini->key, self->keys_max, sizeof *ini->key);
    }
    ini->key[ini->keys++] =
        (struct eds_key){ ini_trim(line), ini_trim(equals + 1), self->line };
    ini->section[ini->sections - 1].count++;
}

static void ini_lines(struct ini_read *self, char *text)
{
    for (bool last = false; !last;) {
        char *end = text + strcspn(text, "\r\n\x1A");
        const bool is_pair = end[0] == '\r' && end[1] == '\n';
        last = *end == '\0' || *end == INI_CTRL_Z;
        *end = '\0';
        self->line++;
        text = ini_trim(text);
        if (*text == '[')
            ini_section(self, text + 1);
        else if (*text != '\0' && *text != ';' && *text != '#')
            ini_key(self, text);
        text = end + 1 + is_pair;
    }
}

/* --- what stands there twice --- */

static int ini_compare(const void *a, const void *b)
{
    const struct eds_section *one = a, *other = b;
    const int order = strcasecmp(one->name, other->name);

    return order != 0 ? order : one->line < other->line ? -1 : 1;
}

static void ini_say_twice(struct ini_read *self)
{
    const struct eds_ini *ini = self->ini;

    for (uint32_t i = 0; i < ini->sections; i++) {
        const struct eds_section *section = &ini->section[i];
        self->line = section->line;
        if (i > 0 && strcasecmp(section->name, section[-1].name) == 0)
            ini_odd(self, "is a section that is there already", section->name);
        for (uint32_t k = 1; k < section->count; k++) {
            const struct eds_key *key = &ini->key[section->first + k];
            const uint32_t most = k < INI_NEAR ? k : INI_NEAR;
            uint32_t back = 1;
            while (back <= most &&
                   strcasecmp(key[-(int)back].name, key->name) != 0)
                back++;
            self->line = key->line;
            if (back <= most)
                ini_odd(self, "is a key that is there already", key->name);
        }
    }
}

int eds_ini_read(struct eds_ini *ini, const struct files *files,
                 const char *path, eds_ini_odd *odd, void *of)
{
    struct ini_read self = { .ini = ini, .odd = odd, .of = of };

    *ini = (struct eds_ini){ .data = NULL };
    const int64_t length =
        files_load_text(files, path, INI_BYTES_MAX, &ini->data);
    if (length < 0)
        return (int)length;
    if (strlen(ini->data) != (size_t)length)
        return 1;
    if (!ini_is_utf8(ini->data, (size_t)length))
        ini->data = ini_from_latin1(ini->data, (size_t)length);
    ini_lines(&self, ini->data);
    if (ini->sections > 0)
        qsort(ini->section, ini->sections, sizeof *ini->section, ini_compare);
    ini_say_twice(&self);
    return 0;
}

void eds_ini_free(struct eds_ini *ini)
{
    free(ini->data);
    memory_free(ini->section);
    memory_free(ini->key);
    *ini = (struct eds_ini){ .data = NULL };
}

/* --- finding --- */

const struct eds_section *eds_ini_find(const struct eds_ini *ini,
                                       const char *name)
{
    uint32_t low = 0, high = ini->sections;

    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (strcasecmp(ini->section[middle].name, name) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return low < ini->sections && strcasecmp(ini->section[low].name, name) == 0
               ? &ini->section[low]
               : NULL;
}

const struct eds_section *eds_ini_again(const struct eds_ini *ini,
                                        const struct eds_section *section)
{
    return section + 1 < ini->section + ini->sections &&
                   strcasecmp(section->name, section[1].name) == 0
               ? section + 1
               : NULL;
}

const struct eds_key *eds_ini_get(const struct eds_ini *ini,
                                  const struct eds_section *section,
                                  const char *name)
{
    const struct eds_key *found = NULL;

    for (; section != NULL; section = eds_ini_again(ini, section))
        for (uint32_t i = 0; i < section->count; i++)
            if (strcasecmp(ini->key[section->first + i].name, name) == 0)
                found = &ini->key[section->first + i];
    return found != NULL && found->text[0] != '\0' ? found : NULL;
}

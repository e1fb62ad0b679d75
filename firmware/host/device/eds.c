/* firmware/host/device/eds.c - see eds.h. */
#include "firmware/host/device/eds.h"

#include <ctype.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/quote.h"

/* ---- warnings ---- */

static void eds_warn(struct eds *eds, unsigned line, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static void eds_warn(struct eds *eds, unsigned line, const char *format, ...)
{
    va_list arguments;

    if (eds->warnings++ >= EDS_WARNINGS_MAX)
        return;
    eds->warning =
        memory_resize(eds->warning, eds->warnings, sizeof *eds->warning);
    struct eds_warning *warning = &eds->warning[eds->warnings - 1];
    warning->line = line;
    va_start(arguments, format);
    vsnprintf(warning->text, sizeof warning->text, format, arguments);
    va_end(arguments);
}

static void eds_odd_line(void *of, unsigned line, const char *what,
                         const char *name)
{
    char quote[QUOTE_MAX];

    eds_warn(of, line, "%s %s", quote_text(quote, name, strlen(name)), what);
}

/* ---- numbers ---- */

/* A number and its sign: 64 bits hold every type's. */
struct eds_number {
    uint64_t magnitude;
    bool negative;
};

/* Digits of a base, blanks between them or not; behind the last one. */
static const char *eds_digits(const char *at, unsigned base, uint64_t *number,
                              unsigned *count)
{
    *number = *count = 0;
    for (; *at == ' ' || isxdigit((unsigned char)*at); at++) {
        const unsigned digit =
            isdigit((unsigned char)*at)
                ? (unsigned)(*at - '0')
                : (unsigned)(tolower((unsigned char)*at) - 'a') + 10;
        if (*at == ' ')
            continue;
        if (digit >= base || *number > (UINT64_MAX - digit) / base)
            return NULL;
        *number = *number * base + digit;
        ++*count;
    }
    return at;
}

/* "12", "-5", "0x1F".  "010" is 10 to some and 8 to others, and to us neither. */
static bool eds_read_number(const char *text, struct eds_number *number)
{
    unsigned count;

    while (*text == ' ')
        text++;
    number->negative = *text == '-';
    text += *text == '-' || *text == '+';
    const bool is_hex = text[0] == '0' && (text[1] == 'x' || text[1] == 'X');
    const bool is_octal = !is_hex && text[0] == '0';
    text = eds_digits(is_hex ? text + 2 : text, is_hex ? 16 : 10,
                      &number->magnitude, &count);
    return text != NULL && count > 0 && (*text == '\0' || *text == ';') &&
           !(is_octal && number->magnitude > 7);
}

static bool eds_type_is_signed(uint8_t type)
{
    return (type >= 2 && type <= 4) || type == 0x10 ||
           (type >= 0x12 && type <= 0x15);
}

/* Of a type of whole numbers; else 0. */
static unsigned eds_type_bits(uint8_t type)
{
    static const uint8_t bits[] = {
        [1] = 1,     [2] = 8,     [3] = 16,    [4] = 32,    [5] = 8,
        [6] = 16,    [7] = 32,    [0x10] = 24, [0x12] = 40, [0x13] = 48,
        [0x14] = 56, [0x15] = 64, [0x16] = 24, [0x18] = 40, [0x19] = 48,
        [0x1A] = 56, [0x1B] = 64
    };

    return type < sizeof bits ? bits[type] : 0;
}

/* A negative number may be written as its bits: 0xFFFF for -1. */
static bool eds_fit(const struct eds_number *number, uint8_t type,
                    int64_t *value)
{
    const unsigned bits = eds_type_bits(type);
    const uint64_t most = UINT64_MAX >> (64 - bits);
    const uint64_t half = most / 2 + 1;
    uint64_t as = number->magnitude;

    if (as > most ||
        (number->negative && as > (eds_type_is_signed(type) ? half : 0)))
        return false;
    if (number->negative)
        as = 0 - as;
    else if (eds_type_is_signed(type) && as >= half)
        as -= most + 1; /* of 64 bits the sum is 0, and so are they */
    *value = (int64_t)as;
    return true;
}

/* ---- an object ---- */

struct eds_reader {
    struct eds *eds;
    const struct eds_section *section;
    struct eds_object *object;
};

static const struct eds_key *eds_get(const struct eds_reader *self,
                                     const char *name)
{
    return eds_ini_get(&self->eds->ini, self->section, name);
}

/* "6040", "1018:1" */
#define EDS_NUMBER_MAX 12
static const char *eds_object_text(const struct eds_object *object,
                                   char text[EDS_NUMBER_MAX])
{
    snprintf(text, EDS_NUMBER_MAX, object->is_sub ? "%04X:%X" : "%04X",
             object->index, object->sub);
    return text;
}

static void eds_say(const struct eds_reader *self, const struct eds_key *key,
                    const char *what)
{
    char object[EDS_NUMBER_MAX], quote[QUOTE_MAX];

    eds_warn(self->eds, key->line, "%s: %.40s %s %s",
             eds_object_text(self->object, object), key->name,
             quote_text(quote, key->text, strlen(key->text)), what);
}

/* Of a key that has one of at most `most`; what is not there is `otherwise`. */
static unsigned eds_small(const struct eds_reader *self, const char *name,
                          unsigned most, unsigned otherwise)
{
    const struct eds_key *key = eds_get(self, name);
    struct eds_number number;

    if (key == NULL)
        return otherwise;
    if (eds_read_number(key->text, &number) && !number.negative &&
        number.magnitude <= most)
        return (unsigned)number.magnitude;
    eds_say(self, key, "cannot be read");
    return otherwise;
}

/* A type of the device's own stands in [A0sub1], as CANfestival writes it. */
static uint8_t eds_type(const struct eds_reader *self)
{
    unsigned type = eds_small(self, "DataType", UINT16_MAX, 0);
    char name[16];

    if (type > 0x1B) {
        snprintf(name, sizeof name, "%Xsub1", type);
        const struct eds_reader of = { self->eds,
                                       eds_ini_find(&self->eds->ini, name),
                                       self->object };
        type = eds_small(&of, "DefaultValue", UINT16_MAX, type);
        if (type > 0x1B)
            eds_say(self, eds_get(self, "DataType"), "is not described");
    }
    return type > 0x1B ? 0 : (uint8_t)type;
}

static void eds_access(const struct eds_reader *self)
{
    static const struct {
        const char *word;
        bool readable, writable;
    } rows[] = { { "ro", true, false }, { "wo", false, true },
                 { "rw", true, true },  { "rwr", true, true },
                 { "rww", true, true }, { "const", true, false } };
    const struct eds_key *key = eds_get(self, "AccessType");

    self->object->unread |= EDS_UNREAD_ACCESS;
    for (size_t i = 0; key != NULL && i < ARRAY_LEN(rows); i++)
        if (strcasecmp(key->text, rows[i].word) == 0) {
            self->object->readable = rows[i].readable;
            self->object->writable = rows[i].writable;
            self->object->unread &= (uint8_t)~EDS_UNREAD_ACCESS;
            return;
        }
    if (key != NULL)
        eds_say(self, key, "is none of ro, wo, rw, rwr, rww and const");
}

static void eds_mapping(const struct eds_reader *self)
{
    const struct eds_key *key = eds_get(self, "PDOMapping");
    struct eds_number number = { 0 };

    if (key == NULL)
        return;
    if (!eds_read_number(key->text, &number)) {
        self->object->unread |= EDS_UNREAD_MAPPING;
        eds_say(self, key, "is neither 0 nor 1");
    }
    self->object->mappable = number.magnitude != 0;
}

static void eds_limit(const struct eds_reader *self, const char *name,
                      bool *has, int64_t *limit)
{
    const struct eds_key *key = eds_get(self, name);
    struct eds_number number;

    if (key == NULL || eds_type_bits(self->object->type) == 0)
        return;
    *has = eds_read_number(key->text, &number) &&
           eds_fit(&number, self->object->type, limit);
    if (!*has)
        eds_say(self, key, "is no number of its type, and not used");
}

/* "$NODEID+0x200" and "0x200 + $nodeid": the rest; NULL: the node is something
 * else than one of two that are added. */
static const char *eds_without_node(const char *text, char rest[64],
                                    bool *adds_node)
{
    static const char word[] = "$NODEID";
    const char *at = strchr(text, '$');

    *adds_node = false;
    if (at == NULL)
        return text;
    if (strncasecmp(at, word, sizeof word - 1) != 0 || strlen(text) >= 64)
        return NULL;
    *adds_node = true;
    const char *after = at + sizeof word - 1;
    size_t before = (size_t)(at - text);
    while (before > 0 && text[before - 1] == ' ')
        before--;
    after += strspn(after, " ");
    if (before > 0 && *after != '\0')
        return NULL;
    if (before == 0)
        return *after == '\0' ? "0" : *after == '+' ? after + 1 : NULL;
    snprintf(rest, 64, "%.*s", (int)before - 1, text);
    return text[before - 1] == '+' ? rest : NULL;
}

/* Of a type of whole numbers; of the others it is not asked for. */
static void eds_value(const struct eds_reader *self, const struct eds_key *key)
{
    struct eds_object *object = self->object;
    struct eds_number number;
    char rest[64];

    object->has_value = object->adds_node = false;
    if (key == NULL || eds_type_bits(object->type) == 0)
        return;
    const char *text = eds_without_node(key->text, rest, &object->adds_node);
    object->has_value = text != NULL && eds_read_number(text, &number) &&
                        eds_fit(&number, object->type, &object->value);
    if (!object->has_value)
        eds_say(self, key, "is no number of its type, and not used");
}

/* One that only heads others has neither type nor access, and a domain no
 * type. */
static void eds_need_keys(const struct eds_reader *self)
{
    enum { DOMAIN = 2, VAR = 7 };
    const unsigned type = eds_small(self, "ObjectType", UINT8_MAX, VAR);
    const struct eds_key *compact = eds_get(self, "CompactSubObj");
    struct eds_number count;
    const bool is_compact =
        compact != NULL &&
        !(eds_read_number(compact->text, &count) && count.magnitude == 0);
    const bool is_head = !self->object->is_sub && !is_compact &&
                         (eds_small(self, "SubNumber", UINT8_MAX, 0) > 0 ||
                          (type != VAR && type != DOMAIN));
    char text[EDS_NUMBER_MAX];

    if (is_head)
        return;
    if (eds_get(self, "AccessType") == NULL)
        eds_warn(self->eds, self->section->line, "%s has no AccessType",
                 eds_object_text(self->object, text));
    if (type != DOMAIN && eds_get(self, "DataType") == NULL)
        eds_warn(self->eds, self->section->line, "%s has no DataType",
                 eds_object_text(self->object, text));
}

static void eds_read_object(const struct eds_reader *self)
{
    struct eds_object *object = self->object;
    const struct eds_key *name = eds_get(self, "ParameterName");
    const struct eds_key *value = eds_get(self, "ParameterValue");

    object->name = name != NULL ? name->text : "";
    object->type = eds_type(self);
    eds_access(self);
    eds_mapping(self);
    eds_limit(self, "LowLimit", &object->has_low, &object->low);
    eds_limit(self, "HighLimit", &object->has_high, &object->high);
    eds_value(self, value != NULL ? value : eds_get(self, "DefaultValue"));
    eds_need_keys(self);
}

/* ---- the list ---- */

/* "6040" or "1018sub1", hexadecimal; false: another kind of section. */
static bool eds_is_object(const char *name, struct eds_object *object)
{
    char *end;
    const unsigned long index = strtoul(name, &end, 16);
    const bool is_sub =
        strncasecmp(end, "sub", 3) == 0 && isxdigit((unsigned char)end[3]);
    unsigned long sub = 0;

    if (end - name != 4 || !isxdigit((unsigned char)name[0]) ||
        !isxdigit((unsigned char)name[1]))
        return false;
    if (is_sub)
        sub = strtoul(end + 3, &end, 16);
    if (*end != '\0' || sub > 255)
        return false;
    *object = (struct eds_object){ .index = (uint16_t)index,
                                   .sub = (uint8_t)sub,
                                   .is_sub = is_sub,
                                   .name = "" };
    return true;
}

/* Head and subs of an index one behind the other. */
static uint32_t eds_order(const struct eds_object *object)
{
    return (uint32_t)object->index << 9 |
           (object->is_sub ? object->sub + 1u : 0);
}

static int eds_compare(const void *a, const void *b)
{
    const uint32_t one = eds_order(a), other = eds_order(b);

    return (one > other) - (one < other);
}

/* Of the same one by line. */
static int eds_compare_lines(const void *a, const void *b)
{
    const struct eds_object *one = a, *other = b;
    const int order = eds_compare(a, b);

    return order != 0 ? order : one->line < other->line ? -1 : 1;
}

/* The first that does not stand before it, among the first `count`. */
static unsigned eds_place(const struct eds *eds, unsigned count, uint32_t order)
{
    unsigned low = 0;

    while (low < count) {
        const unsigned middle = low + (count - low) / 2;
        if (eds_order(&eds->object[middle]) < order)
            low = middle + 1;
        else
            count = middle;
    }
    return low;
}

static const struct eds_object *eds_find_section(const struct eds *eds,
                                                 uint16_t index, uint8_t sub,
                                                 bool is_sub)
{
    const struct eds_object wanted = { .index = index,
                                       .sub = sub,
                                       .is_sub = is_sub };
    const unsigned at = eds_place(eds, eds->count, eds_order(&wanted));

    return at < eds->count && eds_order(&eds->object[at]) == eds_order(&wanted)
               ? &eds->object[at]
               : NULL;
}

static struct eds_object *eds_add(struct eds *eds,
                                  const struct eds_object *object)
{
    if ((eds->count & (eds->count - 1)) == 0)
        eds->object = memory_resize(
            eds->object, eds->count == 0 ? 1 : 2 * (size_t)eds->count,
            sizeof *eds->object);
    eds->object[eds->count] = *object;
    return &eds->object[eds->count++];
}

static void eds_sort(struct eds *eds)
{
    if (eds->count > 1)
        qsort(eds->object, eds->count, sizeof *eds->object, eds_compare_lines);
}

/* ---- what is not written out ---- */

/* Those that the file itself has stand first, `known` of them, sorted. */
struct eds_compact {
    struct eds *eds;
    unsigned known;
};

static void eds_imply(const struct eds_compact *self,
                      const struct eds_object *object)
{
    const unsigned at = eds_place(self->eds, self->known, eds_order(object));

    if (self->eds->count <= EDS_OBJECTS_MAX &&
        (at == self->known ||
         eds_order(&self->eds->object[at]) != eds_order(object)))
        (void)eds_add(self->eds, object);
}

/* The key `sub` of [1016Name] or [1016Value]. */
static const struct eds_key *eds_listed(const struct eds *eds,
                                        const struct eds_object *object,
                                        const char *list)
{
    char name[16], key[8];

    snprintf(name, sizeof name, "%04X%s", object->index, list);
    snprintf(key, sizeof key, "%u", object->sub);
    return eds_ini_get(&eds->ini, eds_ini_find(&eds->ini, name), key);
}

/* CompactSubObj: so many that are as their head says. */
static void eds_compact_array(const struct eds_compact *self, unsigned at)
{
    struct eds_object head = self->eds->object[at], object;
    char name[8];

    snprintf(name, sizeof name, "%04X", head.index);
    const struct eds_reader reader = { self->eds,
                                       eds_ini_find(&self->eds->ini, name),
                                       &object };
    object = head;
    const unsigned count = eds_small(&reader, "CompactSubObj", 254, 0);
    const bool has_subs =
        at + 1 < self->known && self->eds->object[at + 1].index == head.index;
    char text[EDS_NUMBER_MAX];
    if (count == 0 && !has_subs &&
        (eds_get(&reader, "CompactSubObj") != NULL ||
         eds_small(&reader, "ObjectType", UINT8_MAX, 0) >= 8))
        eds_warn(self->eds, head.line, "%s has no entries",
                 eds_object_text(&head, text));
    if (count == 0)
        return;
    object = (struct eds_object){ .index = head.index,
                                  .is_sub = true,
                                  .type = 5,
                                  .readable = true,
                                  .has_value = true,
                                  .value = (int64_t)count,
                                  .line = head.line,
                                  .name = "Number of entries" };
    eds_imply(self, &object);
    for (unsigned sub = 1; sub <= count; sub++) {
        object = head;
        object.is_sub = true;
        object.sub = (uint8_t)sub;
        const struct eds_key *own = eds_listed(self->eds, &object, "Name"),
                             *value = eds_listed(self->eds, &object, "Value");
        if (own != NULL)
            object.name = own->text;
        if (value != NULL)
            eds_value(&reader, value);
        eds_imply(self, &object);
    }
}

/* Of the communication parameters `mask` says which; all of the mapping's. */
static void eds_compact_pdo(const struct eds_compact *self, uint16_t base,
                            unsigned i, unsigned mask, unsigned line)
{
    static const uint8_t type[] = { 5, 7, 5, 6, 5, 6, 5 };
    const unsigned cob_id = (base == 0x1400 ? 0x200 : 0x180) + 0x100 * i;
    struct eds_object object = { .index = (uint16_t)(base + i),
                                 .is_sub = true,
                                 .readable = true,
                                 .line = line,
                                 .name = "" };
    unsigned highest = 0;

    for (unsigned sub = 1; sub <= 6; sub++)
        highest = mask >> (sub - 1) & 1 ? sub : highest;
    for (unsigned sub = 0; sub <= highest; sub++) {
        if (sub > 0 && (mask >> (sub - 1) & 1) == 0)
            continue;
        object.sub = (uint8_t)sub;
        object.type = type[sub];
        object.writable = sub > 0;
        object.has_value = sub < 2;
        object.adds_node = sub == 1 && i < 4;
        object.value = sub == 0 ? highest : i < 4 ? cob_id : 0x80000000;
        eds_imply(self, &object);
    }
    object = (struct eds_object){ .index = (uint16_t)(base + 0x200 + i),
                                  .is_sub = true,
                                  .readable = true,
                                  .writable = true,
                                  .type = 5,
                                  .line = line,
                                  .name = "" };
    for (unsigned sub = 0; sub <= 64; sub++) {
        object.sub = (uint8_t)sub;
        object.type = sub == 0 ? 5 : 7;
        eds_imply(self, &object);
    }
}

static bool eds_has(const struct eds_compact *self, unsigned index)
{
    const unsigned at = eds_place(self->eds, self->known, index << 9);

    return at < self->known && self->eds->object[at].index == index;
}

/* CompactPDO: those of NrOfRXPDO or NrOfTXPDO that are not written out, from the
 * lowest number on. */
static void eds_compact_pdos(const struct eds_compact *self, uint16_t base,
                             const char *number)
{
    struct eds_object device = { .index = base };
    const struct eds_reader reader = {
        self->eds, eds_ini_find(&self->eds->ini, "DeviceInfo"), &device
    };
    const unsigned mask = eds_small(&reader, "CompactPDO", UINT8_MAX, 0);
    unsigned left = mask == 0 ? 0 : eds_small(&reader, number, 512, 0);
    bool known[512] = { false };

    for (unsigned i = 0; i < ARRAY_LEN(known) && mask > 0; i++) {
        known[i] = eds_has(self, base + i) || eds_has(self, base + 0x200 + i);
        left -= known[i] && left > 0;
    }
    for (unsigned i = 0; i < ARRAY_LEN(known) && mask > 0; i++) {
        if (!known[i] && left == 0)
            continue;
        left -= !known[i];
        eds_compact_pdo(self, base, i, mask, reader.section->line);
    }
}

static void eds_write_out(struct eds *eds)
{
    const struct eds_compact self = { eds, eds->count };

    for (unsigned i = 0; i < self.known; i++)
        if (!eds->object[i].is_sub)
            eds_compact_array(&self, i);
    eds_compact_pdos(&self, 0x1400, "NrOfRXPDO");
    eds_compact_pdos(&self, 0x1800, "NrOfTXPDO");
    eds_sort(eds);
}

/* ---- the file ---- */

static void eds_sections(struct eds *eds)
{
    const struct eds_ini *ini = &eds->ini;

    for (uint32_t i = 0; i < ini->sections; i++) {
        struct eds_object object;
        struct eds_reader reader = { eds, &ini->section[i], NULL };
        if ((i > 0 &&
             strcasecmp(ini->section[i].name, ini->section[i - 1].name) == 0) ||
            !eds_is_object(ini->section[i].name, &object))
            continue;
        object.line = ini->section[i].line;
        reader.object = eds_add(eds, &object);
        eds_read_object(&reader);
    }
    eds_sort(eds);
}

/* [1018sub1] and [1018sub01]: the later one counts. */
static void eds_drop_twice(struct eds *eds)
{
    unsigned kept = 0;

    for (unsigned i = 0; i < eds->count; i++) {
        const struct eds_object *object = &eds->object[i];
        char text[EDS_NUMBER_MAX];
        if (kept == 0 || eds_compare(object, &eds->object[kept - 1]) != 0) {
            eds->object[kept++] = *object;
            continue;
        }
        eds_warn(eds, object->line, "%s is an object that is there already",
                 eds_object_text(object, text));
        eds->object[kept - 1] = *object;
    }
    eds->count = kept;
}

static const char *eds_device(const struct eds *eds, const char *name)
{
    const struct eds_key *key =
        eds_ini_get(&eds->ini, eds_ini_find(&eds->ini, "DeviceInfo"), name);

    return key != NULL ? key->text : "";
}

static int eds_fail(const char *path, const char *what,
                    char message[EDS_MESSAGE_MAX])
{
    snprintf(message, EDS_MESSAGE_MAX, "%.300s: %s", path, what);
    return -1;
}

int eds_load(const struct files *files, const char *path, struct eds *eds,
             char message[EDS_MESSAGE_MAX])
{
    *eds = (struct eds){ .vendor = "", .product = "" };
    const int err = eds_ini_read(&eds->ini, files, path, eds_odd_line, eds);

    if (err != 0)
        return eds_fail(
            path, err > 0 ? "a NUL byte, expected text" : files_error(err),
            message);
    eds_sections(eds);
    eds_drop_twice(eds);
    if (eds->count > 0)
        eds_write_out(eds);
    eds->vendor = eds_device(eds, "VendorName");
    eds->product = eds_device(eds, "ProductName");
    if (eds->count == 0)
        return eds_fail(path, "no objects, expected sections such as [1000]",
                        message);
    return eds->count <= EDS_OBJECTS_MAX
               ? 0
               : eds_fail(path, "too many objects, expected 131072 at most",
                          message);
}

void eds_free(struct eds *eds)
{
    eds_ini_free(&eds->ini);
    memory_free(eds->object);
    memory_free(eds->warning);
    *eds = (struct eds){ .vendor = "", .product = "" };
}

const struct eds_object *eds_find(const struct eds *eds, uint16_t index,
                                  uint8_t sub)
{
    const struct eds_object *object = eds_find_section(eds, index, sub, true);

    if (object == NULL && sub == 0)
        object = eds_find_section(eds, index, 0, false);
    return object;
}

/* tests/peers/sheet.c - data sheets as slew reads them, a line of JSON each, for a
 * peer that reads them too.
 *
 *   sheet FILE.eds ... */
#include <inttypes.h>
#include <stdio.h>

#include "firmware/host/base/quote.h"
#include "firmware/host/device/eds.h"
#include "firmware/linux/base/disk.h"

static const char *sheet_bool(bool value)
{
    return value ? "true" : "false";
}

static void sheet_object(const struct eds_object *object)
{
    printf("{\"index\":%u,\"sub\":%d,\"type\":%u,\"read\":%s,\"write\":%s,"
           "\"map\":%s,\"unread\":%u",
           object->index, object->is_sub ? object->sub : -1, object->type,
           sheet_bool(object->readable), sheet_bool(object->writable),
           sheet_bool(object->mappable), object->unread);
    if (object->has_value)
        printf(",\"value\":%" PRId64 ",\"node\":%s", object->value,
               sheet_bool(object->adds_node));
    if (object->has_low)
        printf(",\"low\":%" PRId64, object->low);
    if (object->has_high)
        printf(",\"high\":%" PRId64, object->high);
    putchar('}');
}

/* What is in quotes may be anything: a line and the first word are enough. */
static void sheet_warning(const struct eds_warning *warning)
{
    int word = 0;

    while (warning->text[word] > ' ' && warning->text[word] != '\'' &&
           warning->text[word] != '\\' && warning->text[word] != '"')
        word++;
    printf("[%u,\"%.*s\"]", warning->line, word, warning->text);
}

static void sheet(const char *path)
{
    char message[EDS_MESSAGE_MAX];
    struct eds eds;

    if (eds_load(&disk_files, path, &eds, message) < 0) {
        puts("{\"refused\":true}");
    } else {
        printf("{\"objects\":[");
        for (unsigned i = 0; i < eds.count; i++) {
            fputs(i > 0 ? "," : "", stdout);
            sheet_object(&eds.object[i]);
        }
        printf("],\"warnings\":[");
        for (unsigned i = 0; i < eds.warnings; i++) {
            fputs(i > 0 ? "," : "", stdout);
            sheet_warning(&eds.warning[i]);
        }
        puts("]}");
    }
    eds_free(&eds);
}

int main(int argc, char *argv[])
{
    for (int i = 1; i < argc; i++)
        sheet(argv[i]);
    return 0;
}

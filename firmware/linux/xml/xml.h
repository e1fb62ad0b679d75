/* firmware/linux/xml/xml.h - elements of an XML file, each with its place, by
 * expat, which has bounds of its own against entities that grow. */
#ifndef FIRMWARE_LINUX_XML_XML_H
#define FIRMWARE_LINUX_XML_XML_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/base/files.h"
#include "firmware/host/yaml/yaml_report.h"

#define XML_BYTES_MAX  (16u << 20)
#define XML_NUMBER_MAX 64
#define XML_WORD_MAX   48

/* What a reader has no use for: how often, and the first. */
struct xml_unread {
    unsigned count;
    char word[XML_WORD_MAX];
    uint32_t line;
};

struct xml_reader {
    /* An element begins, or ends; `depth` is its own, 0 that of the root.  Names
     * of elements are without the prefix of their namespace. */
    void (*start)(struct xml_reader *self, const char *name,
                  const char **attribute);
    void (*end)(struct xml_reader *self, const char *name);
    unsigned depth;
    const struct yaml_report *report;
    struct XML_ParserStruct *parser;
    bool is_refused;
};

/* 0, or -1 with the sentence written: FILE:LINE:COLUMN: what. */
int xml_read(const struct files *files, const char *path,
             struct xml_reader *self);

/* Of the element that begins or ends. */
struct plan_place xml_place(const struct xml_reader *self);
/* Nothing is read any more; the first sentence stays. */
void xml_refuse(struct xml_reader *self, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* NULL: the element has none of this name. */
const char *xml_attribute(const char **attribute, const char *name);
/* `count` decimal numbers with blanks around them, such as "0 -1.5 2e-3"; text
 * and value may each be NULL.  false: they are none, which is refused. */
bool xml_numbers(struct xml_reader *self, const char *text, unsigned count,
                 char number[][XML_NUMBER_MAX], double value[]);
void xml_leave(const struct xml_reader *self, struct xml_unread *unread,
               const char *word);

#endif

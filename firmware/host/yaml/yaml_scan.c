/* firmware/host/yaml/yaml_scan.c - see yaml_scan.h. */
#include "firmware/host/yaml/yaml_scan.h"

#include "firmware/host/base/quote.h"

struct scan {
    const struct yaml_report *report;
    struct plan_place at;
    bool indenting; /* only blanks so far on this line */
};

static int scan_line_too_long(const struct scan *scan)
{
    return yaml_report_at(scan->report, scan->at,
                          "the line is longer than %d characters, expected "
                          "shorter lines (one key per line)",
                          YAML_SCAN_LINE_MAX);
}

static int scan_not_utf8(const struct scan *scan, unsigned char byte)
{
    return yaml_report_at(scan->report, scan->at,
                          "byte \\x%02x is not UTF-8 text, expected a YAML "
                          "file in UTF-8",
                          byte);
}

/* One character that is not a line end. */
static int scan_character(struct scan *scan, uint32_t character)
{
    if (scan->at.column > YAML_SCAN_LINE_MAX)
        return scan_line_too_long(scan);
    /* libyaml compares every %TAG with all before it */
    if (character == '%' && scan->at.column == 1)
        return yaml_report_at(scan->report, scan->at,
                              "directives (%%) are not read, expected 'key: "
                              "value' lines");
    if (character == '\t' && scan->indenting)
        return yaml_report_at(scan->report, scan->at,
                              "tab in the indentation, expected spaces");
    if (character != '\t' && !quote_is_printable(character))
        return yaml_report_at(scan->report, scan->at,
                              "character U+%04lX is not printable, expected a "
                              "YAML file, which is text",
                              (unsigned long)character);
    scan->indenting = scan->indenting && character == ' ';
    scan->at.column++;
    return 0;
}

static void scan_new_line(struct scan *scan)
{
    scan->at.line++;
    scan->at.column = 1;
    scan->indenting = true;
}

int yaml_scan(const struct yaml_report *report, const char *text, size_t length)
{
    struct scan scan = { report, { 1, 1 }, true };
    const unsigned char *bytes = (const unsigned char *)text;
    size_t i = 0;

    while (i < length) {
        uint32_t character;
        const unsigned count =
            quote_utf8_decode(bytes + i, length - i, &character);
        if (count == 0)
            return scan_not_utf8(&scan, bytes[i]);
        i += count;
        /* CR LF, LF, and CR alone end a line, as YAML has it */
        if (character == '\n' || (character == '\r' && text[i] != '\n'))
            scan_new_line(&scan);
        else if (character != '\r' && scan_character(&scan, character) < 0)
            return -1;
    }
    return 0;
}

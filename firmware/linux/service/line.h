/* firmware/linux/service/line.h - what a line of a client is about, told byte by
 * byte as it comes: whether it is a stop, what its id is, how much is in it.
 *
 * Nothing is allocated and nothing is looked at twice, so that a stop is found
 * without reading what it stands behind.  What is not plainly a stop, with an
 * escape in the word, say, is read like any other line. */
#ifndef FIRMWARE_LINUX_SERVICE_LINE_H
#define FIRMWARE_LINUX_SERVICE_LINE_H

#include <stdbool.h>
#include <stddef.h>

#define SERVICE_ID_MAX 64 /* bytes of an id as JSON, with the 0 */

/* All zero before a line. */
struct service_line_scan {
    unsigned depth, values; /* of brackets; things in them */
    bool any;               /* but white space */
    bool in_string, is_escaped;
    bool is_over;   /* the object is closed */
    bool is_broken; /* no object, or something behind it */
    enum { LINE_OTHER, LINE_COMMAND, LINE_ID } member;
    bool has_command, is_stop;
    char token[SERVICE_ID_MAX]; /* of a name or a plain value of the object */
    size_t length;              /* of it, also where it does not fit */
    char id[SERVICE_ID_MAX];    /* as it was sent; "": none that is plain */
};

/* The next byte, which is no LF. */
void service_line_take(struct service_line_scan *scan, char byte);
/* Can it stand in an answer as it is: a number or a text as JSON has them? */
bool service_line_id_is_whole(const char *id);
/* Of a line that is complete. */
bool service_line_is_stop(const struct service_line_scan *scan);

#endif

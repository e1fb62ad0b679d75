/* firmware/linux/xml/arcm.h - arc moves of Dragonframe (.arcm): points and the
 * control points between them, as curve bezier.
 *
 * docs/FORMATS.md has the facts of the format and where they come from. */
#ifndef FIRMWARE_LINUX_XML_ARCM_H
#define FIRMWARE_LINUX_XML_ARCM_H

#include "firmware/host/exchange/import.h"

/* Beside those of import_format[]: one that needs expat, and is only read. */
extern const struct import_format arcm_format;

#endif

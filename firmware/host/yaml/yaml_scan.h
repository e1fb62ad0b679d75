/* firmware/host/yaml/yaml_scan.h - is this text at all?
 *
 * Looked at before YAML is: bytes that no YAML file may hold, tabs in
 * indentation, lines nobody wrote by hand.  The YAML library would find most of
 * these as well, later and in its own words. */
#ifndef FIRMWARE_HOST_YAML_YAML_SCAN_H
#define FIRMWARE_HOST_YAML_YAML_SCAN_H

#include "firmware/host/yaml/yaml_report.h"

#define YAML_SCAN_LINE_MAX (1024 * 1024) /* characters */

/* 0, or -1 with the sentence written. */
int yaml_scan(const struct yaml_report *report, const char *text,
              size_t length);

#endif

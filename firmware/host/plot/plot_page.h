/* firmware/host/plot/plot_page.h - one page, drawn with cairo, as SVG or PNG.
 */
#ifndef FIRMWARE_HOST_PLOT_PLOT_PAGE_H
#define FIRMWARE_HOST_PLOT_PLOT_PAGE_H

#include <cairo.h>
#include <stdio.h>

#include "firmware/host/base/messages.h"

enum plot_format { PLOT_SVG, PLOT_PNG };

/* By the end of the name, .svg or .png; -1 for another. */
int plot_format_of(const char *path);

/* Size in pixels, and who draws it on white. */
struct plot_page {
    double width, height;
    void (*draw)(cairo_t *cairo, void *context);
    void *context;
};

/* 0, or -1: with a message, or with the file's error flag set. */
int plot_page_write(const struct plot_page *page, enum plot_format format,
                    FILE *file, struct messages *messages);

#endif

/* firmware/host/plot/plot_png.h - a picture as PNG, row by row, by libpng.
 *
 * Source: PNG (ISO/IEC 15948): 8 bits of red, green and blue, filter "up". */
#ifndef FIRMWARE_HOST_PLOT_PLOT_PNG_H
#define FIRMWARE_HOST_PLOT_PLOT_PNG_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

struct plot_png {
    struct png_struct_def *write;
    struct png_info_def *info;
};

/* False: it cannot be written.  plot_png_end in either case. */
bool plot_png_begin(struct plot_png *png, FILE *file, uint32_t width,
                    uint32_t height);
/* The next row, from the top: a word of 0x00RRGGBB per pixel. */
bool plot_png_row(struct plot_png *png, const unsigned char *pixels);
bool plot_png_end(struct plot_png *png);

#endif

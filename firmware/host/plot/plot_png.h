/* firmware/host/plot/plot_png.h - a picture as PNG, row by row.
 *
 * Source: PNG (ISO/IEC 15948): 8 bits of red, green and blue, filter "up". */
#ifndef FIRMWARE_HOST_PLOT_PLOT_PNG_H
#define FIRMWARE_HOST_PLOT_PLOT_PNG_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <zlib.h>

#define PLOT_PNG_CHUNK 16384

struct plot_png {
    FILE *file;
    uint32_t width;
    z_stream deflate;
    unsigned char *above,
        *row; /* of red, green, blue; the filter, then those */
    unsigned char chunk[PLOT_PNG_CHUNK];
};

/* False: it cannot be written.  plot_png_end in either case. */
bool plot_png_begin(struct plot_png *png, FILE *file, uint32_t width,
                    uint32_t height);
/* The next row, from the top: a word of 0x00RRGGBB per pixel. */
bool plot_png_row(struct plot_png *png, const unsigned char *pixels);
bool plot_png_end(struct plot_png *png);

#endif

/* firmware/host/plot/plot_png.c - see plot_png.h. */
#include "firmware/host/plot/plot_png.h"

#include <string.h>

#include "firmware/host/base/memory.h"

static void plot_png_u32(unsigned char to[4], uint32_t value)
{
    for (int i = 0; i < 4; i++)
        to[i] = (unsigned char)(value >> (24 - 8 * i));
}

static bool plot_png_chunk(FILE *file, const char type[5],
                           const unsigned char *data, uint32_t length)
{
    unsigned char head[8], tail[4];
    plot_png_u32(head, length);
    memcpy(head + 4, type, 4);
    const uLong crc = crc32(crc32(0, head + 4, 4), data, length);
    plot_png_u32(tail, (uint32_t)crc);
    return fwrite(head, sizeof head, 1, file) == 1 &&
           fwrite(data, 1, length, file) == length &&
           fwrite(tail, sizeof tail, 1, file) == 1;
}

bool plot_png_begin(struct plot_png *png, FILE *file, uint32_t width,
                    uint32_t height)
{
    static const unsigned char signature[8] = { 0x89, 'P',  'N',  'G',
                                                '\r', '\n', 0x1A, '\n' };
    unsigned char header[13] = { [8] = 8, [9] = 2 }; /* bits; true colour */
    memset(png, 0, sizeof *png);
    png->file = file;
    png->width = width;
    png->above = memory_new(width, 3);
    png->row = memory_new(3 * (size_t)width + 1, 1);
    if (deflateInit(&png->deflate, Z_DEFAULT_COMPRESSION) != Z_OK)
        memory_fail();
    png->deflate.next_out = png->chunk;
    png->deflate.avail_out = sizeof png->chunk;
    plot_png_u32(header, width);
    plot_png_u32(header + 4, height);
    return fwrite(signature, sizeof signature, 1, file) == 1 &&
           plot_png_chunk(file, "IHDR", header, sizeof header);
}

/* What is packed so far goes out where the chunk is full, or at the end. */
static bool plot_png_pack(struct plot_png *png, int flush)
{
    z_stream *deflate_to = &png->deflate;
    int status;
    do {
        status = deflate(deflate_to, flush);
        if (deflate_to->avail_out > 0 && status != Z_STREAM_END)
            continue;
        if (!plot_png_chunk(png->file, "IDAT", png->chunk,
                            (uint32_t)sizeof png->chunk -
                                deflate_to->avail_out))
            return false;
        deflate_to->next_out = png->chunk;
        deflate_to->avail_out = sizeof png->chunk;
    } while (status == Z_OK && (flush == Z_FINISH || deflate_to->avail_in > 0));
    return true;
}

bool plot_png_row(struct plot_png *png, const unsigned char *pixels)
{
    unsigned char *to = png->row, *above = png->above;
    *to++ = 2; /* up */
    for (uint32_t x = 0; x < png->width; x++) {
        uint32_t pixel;
        memcpy(&pixel, pixels + 4 * (size_t)x, sizeof pixel);
        for (int shift = 16; shift >= 0; shift -= 8) {
            const unsigned char value = (unsigned char)(pixel >> shift);
            *to++ = (unsigned char)(value - *above);
            *above++ = value;
        }
    }
    png->deflate.next_in = png->row;
    png->deflate.avail_in = 3 * png->width + 1;
    return plot_png_pack(png, Z_NO_FLUSH);
}

bool plot_png_end(struct plot_png *png)
{
    const bool written = plot_png_pack(png, Z_FINISH) &&
                         plot_png_chunk(png->file, "IEND", png->chunk, 0);
    (void)deflateEnd(&png->deflate);
    memory_free(png->above);
    memory_free(png->row);
    return written;
}

/* firmware/host/plot/plot_png.c - see plot_png.h. */
#include "firmware/host/plot/plot_png.h"

#include <png.h>
#include <setjmp.h>

#include "firmware/host/base/memory.h"

/* The caller says what could not be written: libpng's own line is no use. */
static void plot_png_fail(png_structp write, png_const_charp message)
{
    (void)message;
    png_longjmp(write, 1);
}

static void plot_png_warn(png_structp write, png_const_charp message)
{
    (void)write;
    (void)message;
}

bool plot_png_begin(struct plot_png *png, FILE *file, uint32_t width,
                    uint32_t height)
{
    png->write = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL,
                                         plot_png_fail, plot_png_warn);
    png->info = png->write == NULL ? NULL : png_create_info_struct(png->write);
    if (png->info == NULL)
        memory_fail();
    if (setjmp(png_jmpbuf(png->write)) != 0)
        return false;
    png_init_io(png->write, file);
    png_set_IHDR(png->write, png->info, width, height, 8, PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_set_filter(png->write, PNG_FILTER_TYPE_BASE, PNG_FILTER_UP);
    png_write_info(png->write, png->info);
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    png_set_bgr(png->write);
    png_set_filler(png->write, 0, PNG_FILLER_AFTER);
#else
    png_set_filler(png->write, 0, PNG_FILLER_BEFORE);
#endif
    return true;
}

bool plot_png_row(struct plot_png *png, const unsigned char *pixels)
{
    if (setjmp(png_jmpbuf(png->write)) != 0)
        return false;
    png_write_row(png->write, pixels);
    return true;
}

bool plot_png_end(struct plot_png *png)
{
    volatile bool written = false; /* set between setjmp and longjmp */
    if (setjmp(png_jmpbuf(png->write)) == 0) {
        png_write_end(png->write, NULL);
        written = true;
    }
    png_destroy_write_struct(&png->write, &png->info);
    return written;
}

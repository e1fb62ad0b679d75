/* firmware/host/plot/plot_page.c - see plot_page.h. */
#include "firmware/host/plot/plot_page.h"

#include <cairo-svg.h>
#include <fontconfig/fontconfig.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>
#include <strings.h>

#include "firmware/host/base/error.h"
#include "firmware/host/base/output.h"

#define PLOT_PNG_SCALE 1.5

int plot_format_of(const char *path)
{
    const char *dot = strrchr(path, '.');
    if (dot != NULL && strcasecmp(dot, ".svg") == 0)
        return PLOT_SVG;
    if (dot != NULL && strcasecmp(dot, ".png") == 0)
        return PLOT_PNG;
    return -1;
}

/* An SVG on its way to a file: decimals of a pixel beyond the hundredth, which
 * nobody sees, are half of it. */
struct plot_svg {
    FILE *file;
    unsigned decimals; /* passed since a point; 0: not in a fraction */
};

#define PLOT_DECIMALS 2

static cairo_status_t plot_put_svg(void *closure, const unsigned char *data,
                                   unsigned int length)
{
    struct plot_svg *svg = closure;
    for (unsigned int i = 0; i < length; i++) {
        bool digit = data[i] >= '0' && data[i] <= '9';
        if (data[i] == '.')
            svg->decimals = 1;
        else if (!digit)
            svg->decimals = 0;
        else if (svg->decimals > 0 && svg->decimals++ > PLOT_DECIMALS)
            continue;
        if (putc(data[i], svg->file) == EOF)
            return CAIRO_STATUS_WRITE_ERROR;
    }
    return CAIRO_STATUS_SUCCESS;
}

static cairo_status_t plot_put(void *file, const unsigned char *data,
                               unsigned int length)
{
    return fwrite(data, 1, length, file) == length ? CAIRO_STATUS_SUCCESS
                                                   : CAIRO_STATUS_WRITE_ERROR;
}

static cairo_surface_t *plot_surface(const struct plot_page *page,
                                     enum plot_format format,
                                     struct plot_svg *svg)
{
    if (format == PLOT_PNG)
        return cairo_image_surface_create(
            CAIRO_FORMAT_RGB24, (int)ceil(PLOT_PNG_SCALE * page->width),
            (int)ceil(PLOT_PNG_SCALE * page->height));
    cairo_surface_t *surface = cairo_svg_surface_create_for_stream(
        plot_put_svg, svg, page->width, page->height);
    cairo_svg_surface_set_document_unit(surface, CAIRO_SVG_UNIT_PX);
    return surface;
}

static void plot_draw_page(const struct plot_page *page, cairo_t *cairo)
{
    cairo_set_source_rgb(cairo, 1, 1, 1);
    cairo_paint(cairo);
    page->draw(cairo, page->context);
}

static cairo_status_t plot_render(const struct plot_page *page,
                                  enum plot_format format, FILE *file)
{
    struct plot_svg svg = { .file = file };
    cairo_surface_t *surface = plot_surface(page, format, &svg);
    cairo_t *cairo = cairo_create(surface);
    if (format == PLOT_PNG)
        cairo_scale(cairo, PLOT_PNG_SCALE, PLOT_PNG_SCALE);
    plot_draw_page(page, cairo);
    cairo_status_t status = cairo_status(cairo);
    cairo_destroy(cairo);
    if (status == CAIRO_STATUS_SUCCESS && format == PLOT_PNG)
        status = cairo_surface_write_to_png_stream(surface, plot_put, file);
    cairo_surface_finish(surface);
    if (status == CAIRO_STATUS_SUCCESS)
        status = cairo_surface_status(surface);
    cairo_surface_destroy(surface);
    cairo_debug_reset_static_data(); /* fonts: nothing else draws */
    FcFini();
    return status;
}

int plot_page_write(const struct plot_page *page, enum plot_format format,
                    FILE *file)
{
    cairo_status_t status = plot_render(page, format, file);
    if (status != CAIRO_STATUS_SUCCESS && status != CAIRO_STATUS_WRITE_ERROR)
        error_say("slew: picture: %s", cairo_status_to_string(status));
    return status == CAIRO_STATUS_SUCCESS ? 0 : -1;
}

int plot_page_save(const struct plot_page *page, const char *path)
{
    struct output output;
    int format = plot_format_of(path);
    if (format < 0 || output_open(&output, path) < 0)
        return -1;
    const int drawn =
        plot_page_write(page, (enum plot_format)format, output.file);
    if (drawn == 0 || output.error != 0) /* which it says */
        return output_commit(&output);
    output_abandon(&output);
    return -1;
}

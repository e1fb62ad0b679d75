/* firmware/host/plot/plot_page.c - see plot_page.h. */
#include "firmware/host/plot/plot_page.h"

#include <cairo-svg.h>
#include <fontconfig/fontconfig.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>
#include <strings.h>

#include "firmware/host/plot/plot_png.h"

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

static void plot_draw_page(const struct plot_page *page, cairo_t *cairo)
{
    cairo_set_source_rgb(cairo, 1, 1, 1);
    cairo_paint(cairo);
    page->draw(cairo, page->context);
}

static cairo_status_t plot_render_svg(const struct plot_page *page, FILE *file)
{
    struct plot_svg svg = { .file = file };
    cairo_surface_t *surface = cairo_svg_surface_create_for_stream(
        plot_put_svg, &svg, page->width, page->height);
    cairo_svg_surface_set_document_unit(surface, CAIRO_SVG_UNIT_PX);
    cairo_t *cairo = cairo_create(surface);
    plot_draw_page(page, cairo);
    cairo_status_t status = cairo_status(cairo);
    cairo_destroy(cairo);
    cairo_surface_finish(surface);
    if (status == CAIRO_STATUS_SUCCESS)
        status = cairo_surface_status(surface);
    cairo_surface_destroy(surface);
    return status;
}

/* A whole page of pixels is by far the largest thing in memory when a run is
 * over, so what was drawn is recorded, and painted for every stripe of it. */
#define PLOT_STRIPE 96 /* rows */

static cairo_surface_t *plot_record(const struct plot_page *page)
{
    const cairo_rectangle_t all = { 0, 0, page->width, page->height };
    cairo_surface_t *record =
        cairo_recording_surface_create(CAIRO_CONTENT_COLOR, &all);
    cairo_t *cairo = cairo_create(record);
    plot_draw_page(page, cairo);
    cairo_destroy(cairo);
    return record;
}

static cairo_status_t plot_stripe(cairo_surface_t *record,
                                  cairo_surface_t *surface, int top)
{
    cairo_t *cairo = cairo_create(surface);
    cairo_translate(cairo, 0, -top);
    cairo_scale(cairo, PLOT_PNG_SCALE, PLOT_PNG_SCALE);
    cairo_set_source_surface(cairo, record, 0, 0);
    cairo_paint(cairo);
    const cairo_status_t status = cairo_status(cairo);
    cairo_destroy(cairo);
    cairo_surface_flush(surface);
    return status;
}

static bool plot_put_stripe(struct plot_png *png, cairo_surface_t *surface,
                            int rows)
{
    const unsigned char *data = cairo_image_surface_get_data(surface);
    const int stride = cairo_image_surface_get_stride(surface);
    for (int y = 0; y < rows; y++)
        if (!plot_png_row(png, data + (ptrdiff_t)y * stride))
            return false;
    return true;
}

static cairo_status_t plot_render_png(const struct plot_page *page, FILE *file)
{
    const int width = (int)ceil(PLOT_PNG_SCALE * page->width);
    const int height = (int)ceil(PLOT_PNG_SCALE * page->height);
    cairo_surface_t *surface =
        cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, PLOT_STRIPE);
    cairo_surface_t *record = plot_record(page);
    cairo_status_t status = cairo_surface_status(surface);
    struct plot_png png;
    if (status == CAIRO_STATUS_SUCCESS)
        status = cairo_surface_status(record);
    bool written =
        status == CAIRO_STATUS_SUCCESS &&
        plot_png_begin(&png, file, (uint32_t)width, (uint32_t)height);
    for (int top = 0; status == CAIRO_STATUS_SUCCESS && written && top < height;
         top += PLOT_STRIPE) {
        const int rest = height - top;
        status = plot_stripe(record, surface, top);
        written = status == CAIRO_STATUS_SUCCESS &&
                  plot_put_stripe(&png, surface,
                                  rest < PLOT_STRIPE ? rest : PLOT_STRIPE);
    }
    if (cairo_surface_status(surface) == CAIRO_STATUS_SUCCESS)
        written = plot_png_end(&png) && written;
    cairo_surface_destroy(record);
    cairo_surface_destroy(surface);
    if (status == CAIRO_STATUS_SUCCESS && !written)
        return CAIRO_STATUS_WRITE_ERROR;
    return status;
}

static cairo_status_t plot_render(const struct plot_page *page,
                                  enum plot_format format, FILE *file)
{
    const cairo_status_t status = format == PLOT_PNG
                                      ? plot_render_png(page, file)
                                      : plot_render_svg(page, file);
    cairo_debug_reset_static_data(); /* fonts: nothing else draws */
    FcFini();
    return status;
}

int plot_page_write(const struct plot_page *page, enum plot_format format,
                    FILE *file, struct messages *messages)
{
    cairo_status_t status = plot_render(page, format, file);
    if (status != CAIRO_STATUS_SUCCESS && status != CAIRO_STATUS_WRITE_ERROR)
        messages_add(messages, MESSAGE_ERROR, "slew: picture: %s",
                     cairo_status_to_string(status));
    return status == CAIRO_STATUS_SUCCESS ? 0 : -1;
}

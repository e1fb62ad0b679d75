/* firmware/host/plot/plot_film.c - see plot_film.h. */
#include "firmware/host/plot/plot_film.h"

#include <math.h>
#include <stdio.h>

#include "firmware/host/base/number.h"
#include "firmware/host/plot/chart.h"
#include "firmware/host/plot/plot_style.h"

#define FILM_WIDTH       720.0
#define FILM_HEIGHT      300.0 /* of a thing */
#define FILM_HEAD        96.0
#define FILM_COLUMNS     4 /* of a strip */
#define FILM_CELL        300.0
#define FILM_CELL_HEIGHT 190.0
#define FILM_GAP         16.0
#define FILM_DEEP_X      0.35
#define FILM_DEEP_Z      0.20

struct film_view {
    struct chart_box box;
    double x, z, scale; /* m at the box's middle; pixels per m */
};

struct film_spot {
    double x, y; /* pixels */
};

struct film_page {
    const struct plot_film *film;
    unsigned moment; /* of a single one */
};

static double film_across(const struct plot_film_point *point)
{
    return point->x + FILM_DEEP_X * point->y;
}

static double film_up(const struct plot_film_point *point)
{
    return point->z + FILM_DEEP_Z * point->y;
}

/* All moments of a thing in one box, as long upwards as across. */
static struct film_view film_look(const struct plot_film *film,
                                  const struct plot_film_thing *thing,
                                  struct chart_box box)
{
    struct film_view view = { .box = box };
    double low[2] = { INFINITY, INFINITY }, high[2] = { -INFINITY, -INFINITY };

    for (unsigned i = 0; i < film->moments * thing->points; i++) {
        const double at[2] = { film_across(&thing->point[i]),
                               film_up(&thing->point[i]) };
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], at[k] - thing->radius_m);
            high[k] = fmax(high[k], at[k] + thing->radius_m);
        }
    }
    view.x = (low[0] + high[0]) / 2;
    view.z = (low[1] + high[1]) / 2;
    view.scale = 0.86 * fmin(box.width / fmax(high[0] - low[0], 1e-6),
                             box.height / fmax(high[1] - low[1], 1e-6));
    return view;
}

static struct film_spot film_spot(const struct film_view *view,
                                  const struct plot_film_point *point)
{
    return (struct film_spot){
        view->box.x + view->box.width / 2 +
            view->scale * (film_across(point) - view->x),
        view->box.y + view->box.height / 2 -
            view->scale * (film_up(point) - view->z),
    };
}

/* ---- what a thing is drawn of, on cairo or as SVG ---- */

struct film_pen {
    cairo_t *cairo; /* NULL: the file */
    FILE *file;
};

static void film_color(const struct film_pen *pen,
                       const struct chart_color *color, double width)
{
    chart_set_color(pen->cairo, color);
    cairo_set_line_width(pen->cairo, width);
}

static const char *film_hex(char hex[8], const struct chart_color *color)
{
    snprintf(hex, 8, "#%02x%02x%02x", (unsigned)lround(255 * color->red) & 255u,
             (unsigned)lround(255 * color->green) & 255u,
             (unsigned)lround(255 * color->blue) & 255u);
    return hex;
}

/* `count` points, `stride` apart. */
static void film_line(const struct film_pen *pen, const struct film_view *view,
                      const struct plot_film_point *point, unsigned count,
                      unsigned stride, const struct chart_color *color,
                      double width)
{
    char hex[8];

    if (pen->cairo == NULL)
        fputs("<polyline points=\"", pen->file);
    for (unsigned i = 0; i < count; i++) {
        const struct film_spot at = film_spot(view, &point[(size_t)i * stride]);
        if (pen->cairo == NULL)
            fprintf(pen->file, "%.1f,%.1f ", at.x, at.y);
        else if (i == 0)
            cairo_move_to(pen->cairo, at.x, at.y);
        else
            cairo_line_to(pen->cairo, at.x, at.y);
    }
    if (pen->cairo == NULL) {
        fprintf(pen->file, "\" stroke=\"%s\" stroke-width=\"%.1f\"/>",
                film_hex(hex, color), width);
        return;
    }
    film_color(pen, color, width);
    cairo_stroke(pen->cairo);
}

static void film_disc(const struct film_pen *pen, const struct film_view *view,
                      const struct plot_film_point *point, double radius,
                      const struct chart_color *color)
{
    const struct film_spot at = film_spot(view, point);
    char hex[8];

    if (pen->cairo == NULL) {
        fprintf(pen->file,
                "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\" "
                "fill=\"%s\"/>",
                at.x, at.y, radius, film_hex(hex, color));
        return;
    }
    film_color(pen, color, 1);
    cairo_arc(pen->cairo, at.x, at.y, radius, 0, 6.283185307179586);
    cairo_fill(pen->cairo);
}

static void film_mesh(const struct film_pen *pen, const struct film_view *view,
                      const struct plot_film_thing *thing,
                      const struct plot_film_point *point)
{
    for (unsigned c = 0; c < thing->columns; c++)
        film_line(pen, view, point + (size_t)c * thing->rows, thing->rows, 1,
                  &plot_plan, 1);
    for (unsigned r = 0; r < thing->rows; r++)
        film_line(pen, view, point + r, thing->columns, thing->rows, &plot_plan,
                  r == 0 ? 2.2 : 1);
    film_disc(pen, view, point, 3.5, &plot_frame);
    film_disc(pen, view, point + (size_t)(thing->columns - 1) * thing->rows, 5,
              &plot_servo);
}

static void film_thing(const struct film_pen *pen, const struct film_view *view,
                       const struct plot_film_thing *thing, unsigned moment)
{
    const struct plot_film_point *const point =
        thing->point + (size_t)moment * thing->points;
    const bool ball = thing->radius_m > 0;
    const unsigned line = ball ? thing->points - 1 : thing->points;

    if (thing->columns > 0) {
        film_mesh(pen, view, thing, point);
        return;
    }
    film_line(pen, view, point, line, 1, &plot_plan, 2.2);
    film_disc(pen, view, &point[thing->points - 1],
              ball ? fmax(2, view->scale * thing->radius_m) : 7, &plot_error);
    if (!ball)
        film_disc(pen, view, point, 5, &plot_servo);
}

/* ---- pages ---- */

static void film_heading(cairo_t *cairo, const struct plot_film *film)
{
    chart_text(cairo, &plot_title, PLOT_MARGIN, PLOT_MARGIN + 8, CHART_LEFT,
               film->title);
    chart_text(cairo, &plot_subtitle, PLOT_MARGIN, PLOT_MARGIN + 32, CHART_LEFT,
               film->subtitle);
}

static struct chart_box film_box(unsigned thing)
{
    return (struct chart_box){ PLOT_MARGIN,
                               FILM_HEAD + thing * (FILM_HEIGHT + FILM_GAP),
                               FILM_WIDTH - 2 * PLOT_MARGIN,
                               FILM_HEIGHT - 2 * FILM_GAP };
}

static double film_height(const struct plot_film *film)
{
    return FILM_HEAD + film->things * (FILM_HEIGHT + FILM_GAP);
}

static void film_time(char text[32], const struct plot_film *film,
                      unsigned moment)
{
    snprintf(text, 32, "%.2f s", film->every_s * moment);
}

static void film_draw_moment(cairo_t *cairo, void *context)
{
    const struct film_page *const page = context;
    const struct film_pen pen = { .cairo = cairo };
    char time[32];

    film_heading(cairo, page->film);
    film_time(time, page->film, page->moment);
    chart_text(cairo, &plot_name, FILM_WIDTH - PLOT_MARGIN, PLOT_MARGIN + 8,
               CHART_RIGHT, time);
    for (unsigned i = 0; i < page->film->things; i++) {
        const struct plot_film_thing *const thing = &page->film->thing[i];
        const struct film_view view = film_look(page->film, thing, film_box(i));
        chart_text(cairo, &plot_heading, view.box.x, view.box.y + 6, CHART_LEFT,
                   thing->name);
        film_thing(&pen, &view, thing, page->moment);
    }
}

int plot_film_moment(const struct plot_film *film, unsigned moment,
                     enum plot_format format, FILE *file,
                     struct messages *messages)
{
    struct film_page page = { film, moment };
    const struct plot_page paper = { FILM_WIDTH, film_height(film),
                                     film_draw_moment, &page };

    return plot_page_write(&paper, format, file, messages);
}

/* ---- the strip ---- */

static unsigned film_strip_cells(const struct plot_film *film)
{
    return film->moments < PLOT_FILM_STRIP ? film->moments : PLOT_FILM_STRIP;
}

static unsigned film_strip_rows(const struct plot_film *film)
{
    return (film_strip_cells(film) + FILM_COLUMNS - 1) / FILM_COLUMNS;
}

static void film_draw_cell(cairo_t *cairo, const struct plot_film *film,
                           unsigned thing, unsigned cell)
{
    const unsigned moment =
        cell * (film->moments - 1) / (film_strip_cells(film) - 1);
    const unsigned row = thing * film_strip_rows(film) + cell / FILM_COLUMNS;
    const struct chart_box box = {
        PLOT_MARGIN + (cell % FILM_COLUMNS) * (FILM_CELL + FILM_GAP),
        FILM_HEAD + row * (FILM_CELL_HEIGHT + FILM_GAP),
        FILM_CELL,
        FILM_CELL_HEIGHT,
    };
    const struct chart chart = { .cairo = cairo, .box = box };
    const struct film_view view = film_look(film, &film->thing[thing], box);
    const struct film_pen pen = { .cairo = cairo };
    char time[32];

    film_thing(&pen, &view, &film->thing[thing], moment);
    chart_frame(&chart, &plot_frame);
    film_time(time, film, moment);
    chart_text(cairo, &plot_note, box.x + box.width - 8, box.y + 18,
               CHART_RIGHT, time);
    if (cell == 0)
        chart_text(cairo, &plot_heading, box.x + 8, box.y + 18, CHART_LEFT,
                   film->thing[thing].name);
}

static void film_draw_strip(cairo_t *cairo, void *context)
{
    const struct film_page *const page = context;

    film_heading(cairo, page->film);
    for (unsigned t = 0; t < page->film->things; t++)
        for (unsigned i = 0; i < film_strip_cells(page->film); i++)
            film_draw_cell(cairo, page->film, t, i);
}

int plot_film_strip(const struct plot_film *film, enum plot_format format,
                    FILE *file, struct messages *messages)
{
    struct film_page page = { film, 0 };
    const struct plot_page paper = {
        2 * PLOT_MARGIN + FILM_COLUMNS * (FILM_CELL + FILM_GAP) - FILM_GAP,
        FILM_HEAD + PLOT_MARGIN +
            film->things * film_strip_rows(film) *
                (FILM_CELL_HEIGHT + FILM_GAP),
        film_draw_strip, &page
    };

    return plot_page_write(&paper, format, file, messages);
}

/* ---- an SVG that plays ---- */

static void film_text(FILE *file, double x, double y, double size,
                      const char *weight, const char *text)
{
    fprintf(file,
            "<text x=\"%.0f\" y=\"%.0f\" font-size=\"%.0f\" "
            "font-weight=\"%s\" fill=\"#21262e\" stroke=\"none\">",
            x, y, size, weight);
    for (; *text != 0; text++)
        switch (*text) {
        case '<':
            fputs("&lt;", file);
            break;
        case '&':
            fputs("&amp;", file);
            break;
        default:
            fputc(*text, file);
        }
    fputs("</text>\n", file);
}

/* Shown from its moment to the next. */
static void film_play(const struct plot_film *film, unsigned moment, FILE *file)
{
    const double all = film->moments;

    fprintf(file, "<g visibility=\"%s\"><animate attributeName=\"visibility\" ",
            moment == 0 ? "visible" : "hidden");
    if (moment == 0)
        fprintf(file, "values=\"visible;hidden\" keyTimes=\"0;%.6f\"", 1 / all);
    else if (moment + 1 == film->moments)
        fprintf(file, "values=\"hidden;visible\" keyTimes=\"0;%.6f\"",
                moment / all);
    else
        fprintf(file,
                "values=\"hidden;visible;hidden\" keyTimes=\"0;%.6f;%.6f\"",
                moment / all, (moment + 1) / all);
    fprintf(file,
            " dur=\"%.3fs\" calcMode=\"discrete\" "
            "repeatCount=\"indefinite\"/>\n",
            film->every_s * all);
}

void plot_film_animate(const struct plot_film *film, FILE *file)
{
    const struct film_pen pen = { .file = file };
    char time[32];

    fprintf(file,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" "
            "height=\"%.0f\" viewBox=\"0 0 %.0f %.0f\" "
            "font-family=\"sans-serif\" fill=\"none\" "
            "stroke-linejoin=\"round\">\n<rect width=\"100%%\" "
            "height=\"100%%\" fill=\"#ffffff\"/>\n",
            FILM_WIDTH, film_height(film), FILM_WIDTH, film_height(film));
    film_text(file, PLOT_MARGIN, PLOT_MARGIN + 8, 23, "bold", film->title);
    film_text(file, PLOT_MARGIN, PLOT_MARGIN + 32, 14, "normal",
              film->subtitle);
    for (unsigned i = 0; i < film->things; i++)
        film_text(file, film_box(i).x, film_box(i).y + 6, 13, "bold",
                  film->thing[i].name);
    for (unsigned m = 0; m < film->moments; m++) {
        film_play(film, m, file);
        film_time(time, film, m);
        film_text(file, FILM_WIDTH - PLOT_MARGIN - 70, PLOT_MARGIN + 8, 18,
                  "bold", time);
        for (unsigned i = 0; i < film->things; i++) {
            const struct film_view view =
                film_look(film, &film->thing[i], film_box(i));
            film_thing(&pen, &view, &film->thing[i], m);
        }
        fputs("</g>\n", file);
    }
    fputs("</svg>\n", file);
}

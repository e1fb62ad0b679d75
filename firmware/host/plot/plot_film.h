/* firmware/host/plot/plot_film.h - what hangs on axes, or rolls on them, moment by
 * moment: as a strip of moments on one page, as one picture per moment, or as an
 * SVG that plays them.
 *
 * A thing per row, in a plane along its axis; what is behind is drawn a little
 * higher and to the right. */
#ifndef FIRMWARE_HOST_PLOT_PLOT_FILM_H
#define FIRMWARE_HOST_PLOT_PLOT_FILM_H

#include "firmware/host/plot/plot_page.h"

struct plot_film_point {
    double x, y, z; /* m: along the axis, to the back, up */
};

struct plot_film_thing {
    const char *name;
    unsigned points, columns, rows; /* columns 0: a line, else a mesh */
    double radius_m; /* > 0: the last point is a ball of it on that line */
    const struct plot_film_point *point; /* moments x points */
};

struct plot_film {
    const char *title, *subtitle;
    const struct plot_film_thing *thing;
    unsigned things;  /* >= 1 */
    unsigned moments; /* >= 2 */
    double every_s;
};

/* Up to PLOT_FILM_STRIP moments on one page.  As plot_page_write. */
#define PLOT_FILM_STRIP 12
int plot_film_strip(const struct plot_film *film, enum plot_format format,
                    FILE *file, struct messages *messages);
/* One moment. */
int plot_film_moment(const struct plot_film *film, unsigned moment,
                     enum plot_format format, FILE *file,
                     struct messages *messages);
/* All of them, again and again, in their time.  The file has the error. */
void plot_film_animate(const struct plot_film *film, FILE *file);

#endif

/* firmware/host/plot/plot_space.c - see plot_space.h. */
#include "firmware/host/plot/plot_space.h"

#include <math.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/plot/plot_space_panel.h"
#include "firmware/host/plot/plot_style.h"
#include "motion/core/fixed.h"
#include "motion/plan/camera/plan_camera.h"

#define SPACE_WIDTH         1240
#define SPACE_HEIGHT        760
#define SPACE_POINTS        240                /* of the path */
#define SPACE_FRAMES        PLOT_SPACE_MOMENTS /* frusta */
#define SPACE_FOCAL         35.0
#define SPACE_SENSOR_WIDTH  36.0
#define SPACE_SENSOR_HEIGHT 24.0
/* Of the longer side of the scene: how far a frustum is drawn. */
#define SPACE_FRUSTUM 0.09
#define SPACE_CORNERS 4

struct space_frame {
    struct space_point pupil, corner[SPACE_CORNERS];
    struct plan_rig_frame frame;
    double focal;
};

struct space {
    const struct job *job;
    const struct plot_film *carried; /* NULL: nothing */
    struct plan_rig rig;             /* of the move's axes */
    bool has_subject, is_subject_moving;
    struct space_point path[SPACE_POINTS + 1], subject[SPACE_POINTS + 1];
    struct space_frame frame[SPACE_FRAMES];
};

static const struct space_view space_views[] = {
    { "at a slant",
      NULL,
      NULL,
      { 0.8660, -0.5, 0 },
      { 0.2113, 0.3660, 0.9063 },
      { PLOT_MARGIN, 120, 620, SPACE_HEIGHT - 120 - PLOT_MARGIN } },
    { "from above",
      "x, m",
      "y, m",
      { 1, 0, 0 },
      { 0, 1, 0 },
      { 760, 120, 436, 250 } },
    { "from the side",
      "x, m",
      "z, m",
      { 1, 0, 0 },
      { 0, 0, 1 },
      { 760, 440, 436, 250 } },
};

/* ---- points -------------------------------------------------------------- */

static struct space_point space_point_of(struct plan_jet_vec v)
{
    return (struct space_point){ { v.x[0].p / 1000, v.x[1].p / 1000,
                                   v.x[2].p / 1000 } };
}

static int64_t space_time(const struct space *self, int i, int of)
{
    int64_t t = 0;

    (void)motion_fixed_muldiv(self->job->end_ns_q12, i, of, &t);
    return t;
}

static void space_subject(struct space *self, int i, int64_t t)
{
    struct plan_jet_vec at;

    if (!job_camera_subject(self->job, t, &at))
        return;
    self->has_subject = true;
    self->is_subject_moving = job_camera_look(self->job)->look != PLAN_LOOK_AT;
    self->subject[i] = space_point_of(at);
}

static void space_points(struct space *self)
{
    struct plan_rig_camera camera;

    for (int i = 0; i <= SPACE_POINTS; i++) {
        const int64_t t = space_time(self, i, SPACE_POINTS);
        plan_rig_camera_at(&self->rig, self->job->track, t, &camera);
        self->path[i] = space_point_of(camera.pupil);
        space_subject(self, i, t);
    }
}

static double space_far(const struct space *self)
{
    double low[3], high[3], far = 0;

    for (int k = 0; k < 3; k++)
        low[k] = high[k] = self->path[0].x[k];
    for (int i = 0; i <= SPACE_POINTS; i++)
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], self->path[i].x[k]);
            high[k] = fmax(high[k], self->path[i].x[k]);
            if (!self->has_subject)
                continue;
            low[k] = fmin(low[k], self->subject[i].x[k]);
            high[k] = fmax(high[k], self->subject[i].x[k]);
        }
    for (int k = 0; k < 3; k++)
        far = fmax(far, high[k] - low[k]);
    return fmax(far, 0.5);
}

/* A corner is at (1, -+w / 2f, -+h / 2f) of the frame. */
static void space_frustum(struct space_frame *frame, double length)
{
    static const double sign[SPACE_CORNERS][2] = {
        { 1, 1 }, { -1, 1 }, { -1, -1 }, { 1, -1 }
    };
    const double w = SPACE_SENSOR_WIDTH / (2 * frame->focal),
                 h = SPACE_SENSOR_HEIGHT / (2 * frame->focal);

    for (int i = 0; i < SPACE_CORNERS; i++)
        for (int k = 0; k < 3; k++)
            frame->corner[i].x[k] =
                frame->pupil.x[k] +
                length * (frame->frame.forward.x[k].p +
                          sign[i][0] * w * frame->frame.left.x[k].p +
                          sign[i][1] * h * frame->frame.up.x[k].p);
}

static void space_frames(struct space *self)
{
    const struct plan_rig_axis *zoom = &self->rig.lens[PLAN_LENS_ZOOM];
    const double length = SPACE_FRUSTUM * space_far(self);

    for (int i = 0; i < SPACE_FRAMES; i++) {
        const int64_t t = space_time(self, i, SPACE_FRAMES - 1);
        struct space_frame *frame = &self->frame[i];
        struct plan_rig_camera camera;
        plan_rig_camera_at(&self->rig, self->job->track, t, &camera);
        frame->pupil = space_point_of(camera.pupil);
        frame->frame = camera.frame;
        frame->focal =
            zoom->is_given
                ? plan_rig_track(&self->job->track[zoom->axis], t, -1).p
                : SPACE_FOCAL;
        if (!(frame->focal > 1))
            frame->focal = SPACE_FOCAL;
        space_frustum(frame, length);
    }
}

/* ---- drawing ------------------------------------------------------------- */

/* Everything with a margin, as long upwards as to the right. */
static void space_fit(const struct space *self, struct space_panel *panel)
{
    struct chart *chart = &panel->chart;

    for (int i = 0; i <= SPACE_POINTS; i++) {
        space_include(panel, &self->path[i]);
        if (self->has_subject)
            space_include(panel, &self->subject[i]);
    }
    for (int i = 0; i < SPACE_FRAMES; i++)
        for (int k = 0; k < SPACE_CORNERS; k++)
            space_include(panel, &self->frame[i].corner[k]);
    if (self->carried != NULL)
        space_include_carried(panel, self->carried);
    const double per_pixel =
        1.12 * fmax((chart->t1 - chart->t0) / chart->box.width,
                    (chart->high - chart->low) / chart->box.height);
    const double x = (chart->t0 + chart->t1) / 2,
                 y = (chart->low + chart->high) / 2;
    chart->t0 = x - per_pixel * chart->box.width / 2;
    chart->t1 = x + per_pixel * chart->box.width / 2;
    chart->low = y - per_pixel * chart->box.height / 2;
    chart->high = y + per_pixel * chart->box.height / 2;
}

static void space_draw_frame(const struct space *self,
                             const struct space_panel *panel, int i)
{
    const struct space_frame *frame = &self->frame[i];

    if (self->has_subject) {
        space_to(panel, &frame->pupil, true);
        space_to(panel, &self->subject[i * SPACE_POINTS / (SPACE_FRAMES - 1)],
                 false);
        space_stroke(panel, &plot_servo, 0.45, 0.8);
    }
    for (int k = 0; k < SPACE_CORNERS; k++) {
        space_to(panel, &frame->pupil, true);
        space_to(panel, &frame->corner[k], false);
        space_to(panel, &frame->corner[(k + 1) % SPACE_CORNERS], false);
    }
    space_stroke(panel, &plot_frame, 0.75, 0.9);
    /* the upper edge of the picture */
    space_to(panel, &frame->corner[0], true);
    space_to(panel, &frame->corner[1], false);
    space_stroke(panel, &plot_frame, 1, 2);
}

static void space_draw_line(const struct space_panel *panel,
                            const struct space_point line[],
                            const struct chart_color *color)
{
    for (int i = 0; i <= SPACE_POINTS; i++)
        space_to(panel, &line[i], i == 0);
    space_stroke(panel, color, 1, 2.2);
}

static void space_draw_scales(const struct space_panel *panel)
{
    const struct space_view *view = panel->view;
    const struct chart *chart = &panel->chart;
    cairo_t *cairo = chart->cairo;

    chart_text(cairo, &plot_heading, view->box.x, view->box.y - 12, CHART_LEFT,
               view->name);
    if (view->right == NULL)
        return;
    chart_grid_values(chart, &plot_tick, 1);
    chart_grid_times(chart, &plot_tick, true);
    chart_frame(chart, &plot_frame);
    chart_text(cairo, &plot_note, view->box.x + view->box.width,
               view->box.y - 12, CHART_RIGHT, view->right);
    chart_text(cairo, &plot_note, view->box.x + view->box.width - 50,
               view->box.y - 12, CHART_RIGHT, view->up);
}

static void space_draw_view(const struct space *self,
                            const struct space_view *view, cairo_t *cairo)
{
    struct space_panel panel = { .view = view, .is_empty = true };

    panel.chart = (struct chart){ .cairo = cairo, .box = view->box };
    space_fit(self, &panel);
    space_draw_scales(&panel);
    cairo_set_line_join(cairo, CAIRO_LINE_JOIN_ROUND);
    if (self->carried != NULL)
        space_draw_carried(&panel, self->carried);
    for (int i = 0; i < SPACE_FRAMES; i++)
        space_draw_frame(self, &panel, i);
    space_draw_line(&panel, self->path, &plot_plan);
    if (self->has_subject && self->is_subject_moving)
        space_draw_line(&panel, self->subject, &plot_error);
    if (self->has_subject)
        space_mark(&panel, &self->subject[SPACE_POINTS], &plot_error);
    space_mark(&panel, &self->path[0], &plot_plan);
}

static double space_legend(cairo_t *cairo, double x,
                           const struct chart_color *color, const char *text)
{
    const double y = 82;

    chart_set_color(cairo, color);
    cairo_set_line_width(cairo, 2.2);
    cairo_move_to(cairo, x, y - 4);
    cairo_line_to(cairo, x + 26, y - 4);
    cairo_stroke(cairo);
    x += 34;
    return x + chart_text(cairo, &plot_note, x, y, CHART_LEFT, text) + 26;
}

static void space_draw(cairo_t *cairo, void *context)
{
    const struct space *self = context;
    const struct job *job = self->job;
    char subtitle[320];
    double x = PLOT_MARGIN;

    chart_text(cairo, &plot_title, x, 40, CHART_LEFT,
               job->move.title[0] != 0 ? job->move.title : "Move");
    snprintf(subtitle, sizeof subtitle,
             "%s%sthe camera in %d moments of %.3f s", job->rig.title,
             job->rig.title[0] != 0 ? "  \u00b7  " : "", SPACE_FRAMES,
             number_double(job->end_ns_q12, 12) / 1e9);
    chart_text(cairo, &plot_subtitle, x, 62, CHART_LEFT, subtitle);
    x = space_legend(cairo, x, &plot_plan, "camera, from the disc on");
    x = space_legend(cairo, x, &plot_frame, "what it sees, thick: up");
    if (self->has_subject)
        x = space_legend(cairo, x, &plot_error, "subject, to the disc");
    if (self->carried != NULL)
        space_legend(cairo, x, &plot_shot, "what axes carry");
    for (unsigned i = 0; i < ARRAY_LEN(space_views); i++)
        space_draw_view(self, &space_views[i], cairo);
}

int plot_space_write(const struct job *job, const struct plot_film *carried,
                     enum plot_format format, FILE *file,
                     struct messages *messages)
{
    struct space *self = memory_new(1, sizeof *self);
    const struct plot_page page = { SPACE_WIDTH, SPACE_HEIGHT, space_draw,
                                    self };

    self->job = job;
    self->carried = carried;
    (void)job_camera_rig(job, &self->rig);
    space_points(self);
    space_frames(self);
    const int err = plot_page_write(&page, format, file, messages);
    memory_free(self);
    return err;
}

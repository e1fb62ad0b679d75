/* firmware/host/job/path_report.c - see path_report.h. */
#include "firmware/host/job/path_report.h"

#include <cjson/cJSON.h>
#include <math.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "motion/plan/shoot/plan_shoot.h"

/* Panels per piece of the curve for the rules that take equal ones. */
#define PATH_PANELS 64

static double path_double(struct motion_real a)
{
    return ldexp((double)a.m, a.e);
}

static const struct plan_path *path_of(const struct job *job)
{
    return job->outcome.has_path ? job->move.path : NULL;
}

enum units_axis path_report_unit(const struct job *job)
{
    return job->move.path->carrier != NULL
               ? UNITS_AXIS_MM
               : job_rig_axis(job, job->move.path->axis[0])->unit;
}

/* The worst of the path's axes. */
static double path_bound(const struct job *job)
{
    double worst = 0;
    for (uint32_t i = 0; i < job->move.path->points.axes; i++)
        worst = fmax(worst, path_double(job->outcome.drive.bound[i]));
    return worst;
}

static void path_camera_text(const struct job *job, FILE *file)
{
    double worst = 0;
    if (!job->outcome.has_camera)
        return;
    for (int i = 0; i < 3; i++)
        worst =
            fmax(worst, number_double(job->outcome.camera_bound_q32[i], 32));
    fprintf(file, "camera: baked within %.1g deg of each angle", worst);
    if (job->outcome.lens_bound_q32 > 0)
        fprintf(file, ", the lens within %.1g mm",
                number_double(job->outcome.lens_bound_q32, 32));
    fputc('\n', file);
}

/* "24 pictures, one every 2.5 s, in 62.5 s" */
static void path_shoot_text(const struct job *job, FILE *file)
{
    const struct plan_shoot *shoot = job->move.shoot;
    struct plan_shoot_times times;
    char period[NUMBER_MAX], end[NUMBER_MAX];
    if (shoot == NULL)
        return;
    plan_shoot_times(shoot, &times);
    number_seconds(period, times.period_ns_q12);
    number_seconds(end, times.end_ns_q12);
    if (!shoot->steps)
        fprintf(file, "shoot: %u pictures, one every %s s, in %s s\n",
                shoot->frames, period, end);
    else
        fprintf(file,
                "shoot: %u pictures, each when %s says so, %s s apart or more, "
                "in %s s or more\n",
                shoot->frames,
                job->step_line != NULL ? job->step_line->name : "the operator",
                period, end);
}

/* At what pace the move is played to take the time that it is to take. */
static void path_duration_text(const struct job *job, FILE *file)
{
    const struct plan_outcome *outcome = &job->outcome;
    char written[NUMBER_MAX], played[NUMBER_MAX];
    if (outcome->played_ns_q12 == 0)
        return;
    number_seconds(written, outcome->written_ns_q12);
    number_seconds(played, outcome->played_ns_q12);
    fprintf(file,
            "duration: the %s s that are written in %s s, %.4g times as "
            "fast\n",
            written, played,
            (double)outcome->written_ns_q12 / (double)outcome->played_ns_q12);
}

/* How far every axis runs up, or out, from where it stands. */
static void path_roll_text(const struct job *job, FILE *file, const char *name,
                           int64_t from_ns_q12, int64_t to_ns_q12)
{
    char dur[NUMBER_MAX], from[NUMBER_MAX], to[NUMBER_MAX];
    if (from_ns_q12 == to_ns_q12)
        return;
    number_seconds(dur, to_ns_q12 - from_ns_q12);
    fprintf(file, "%s: %s s", name, dur);
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        struct motion_state first, last;
        motion_track_state(&job->track[i], from_ns_q12, &first);
        motion_track_state(&job->track[i], to_ns_q12, &last);
        if (first.pos_q32 == last.pos_q32)
            continue;
        number_short(from, first.pos_q32, 32);
        number_short(to, last.pos_q32, 32);
        fprintf(file, ", %s from %s to %s %s", job->move.axis[i].name, from, to,
                units_axis_text(job_rig_axis(job, i)->unit));
    }
    fputc('\n', file);
}

static void path_rolls_text(const struct job *job, FILE *file)
{
    const struct plan_move *move = &job->move;
    if (move->pre_roll_ns_q12 == 0 && move->post_roll_ns_q12 == 0)
        return;
    path_roll_text(job, file, "pre-roll", 0, job->outcome.lag_ns_q12);
    path_roll_text(job, file, "post-roll",
                   job->end_ns_q12 - job->outcome.tail_ns_q12, job->end_ns_q12);
}

/* How fast the move's time goes at most, and what the warp costs. */
static void path_warp_text(const struct job *job, FILE *file)
{
    const struct motion_track *warp = &job->outcome.warp;
    int64_t t_ns_q12, peak;
    char t[NUMBER_MAX];
    path_duration_text(job, file);
    path_rolls_text(job, file);
    path_shoot_text(job, file);
    if (warp->count == 0)
        return;
    peak = job_peak(warp, MOTION_VEL, &t_ns_q12);
    number_seconds(t, t_ns_q12);
    fprintf(file,
            "warp: at most %.4g times as fast, at %s s; axes within %.1g of "
            "the move at that time\n",
            number_double(peak, 32) / 1000, t,
            path_double(job->outcome.warp_bound));
}

/* How far the axes are from where the path in space requires them. */
static void path_carrier_text(const struct job *job, FILE *file)
{
    const struct plan_rig *carrier = job->move.path->carrier;
    if (carrier == NULL)
        return;
    const double bound = number_double(job->outcome.carrier_bound_q32, 32);
    if (carrier->arm.arm.count > 0)
        fprintf(file, "arm:  joints within %.1g of what the path requires\n",
                bound);
    else
        fprintf(file,
                "rig:  what carries the head within %.1g of its axes on "
                "the path\n",
                bound);
}

void path_report_text(const struct job *job, FILE *file)
{
    const struct plan_path *path = path_of(job);
    const struct plan_drive *drive = &job->outcome.drive;
    char speed[NUMBER_MAX], t[NUMBER_MAX], length[NUMBER_MAX];
    if (path == NULL) {
        path_camera_text(job, file);
        path_warp_text(job, file);
        return;
    }
    const char *unit = units_axis_text(path_report_unit(job));
    int64_t t_ns_q12;
    int64_t peak = job_peak(&job->outcome.distance, MOTION_VEL, &t_ns_q12);
    number_fixed(length, drive->space.length_q32, 32, 6);
    number_fixed(speed, peak, 32, 6);
    number_seconds(t, t_ns_q12);
    fprintf(file,
            "\npath: %s %s long (adaptive Gauss rule, within %.1g %s, %u "
            "evaluations)\n",
            length, unit, path_double(drive->space.table.error), unit,
            drive->space.table.evaluations);
    fprintf(file,
            "      at most %s %s/s along it, at %s s; baked in %u %s, "
            "axes within %.1g %s\n",
            speed, unit, t, drive->segments,
            number_word(drive->segments, "segment", "segments"),
            path_bound(job), unit);
    path_carrier_text(job, file);
    path_camera_text(job, file);
    path_warp_text(job, file);
}

void path_report_json(const struct job *job, struct cJSON *object)
{
    const struct plan_drive *drive = &job->outcome.drive;
    int64_t t_ns_q12;
    if (job->outcome.played_ns_q12 != 0)
        cJSON_AddNumberToObject(object, "written_s",
                                number_double(job->outcome.written_ns_q12, 12) /
                                    1e9);
    if (path_of(job) == NULL)
        return;
    int64_t peak = job_peak(&job->outcome.distance, MOTION_VEL, &t_ns_q12);
    cJSON *item = cJSON_AddObjectToObject(object, "path");
    cJSON_AddStringToObject(item, "unit",
                            units_axis_text(path_report_unit(job)));
    cJSON_AddNumberToObject(item, "length",
                            path_double(drive->space.table.length));
    cJSON_AddNumberToObject(item, "length_error",
                            path_double(drive->space.table.error));
    cJSON_AddStringToObject(item, "rule", "adaptive");
    cJSON_AddNumberToObject(item, "evaluations",
                            drive->space.table.evaluations);
    json_add_fixed(item, "speed_peak", peak, 32);
    cJSON_AddNumberToObject(item, "speed_peak_time_s",
                            number_double(t_ns_q12, 12) / 1e9);
    cJSON_AddNumberToObject(item, "bound", path_bound(job));
    cJSON_AddNumberToObject(item, "segments", drive->segments);
}

void path_report_rules(const struct job *job, FILE *file)
{
    static const char *const head[] = {
        "<rule", ">evaluations", ">length", ">error it reports", ">true error",
    };
    static const char *const name[] = {
        [MOTION_ARCLEN_RECTANGLE] = "rectangle",
        [MOTION_ARCLEN_TRAPEZOID] = "trapezoid",
        [MOTION_ARCLEN_SIMPSON] = "simpson",
        [MOTION_ARCLEN_GAUSS] = "gauss",
        [MOTION_ARCLEN_CHORDS] = "chords",
        [MOTION_ARCLEN_ADAPTIVE] = "adaptive",
    };
    const struct plan_space *space = &job->outcome.drive.space;
    const double best = path_double(space->table.length);
    struct table table;
    if (path_of(job) == NULL)
        return;
    table_init(&table, 5, head);
    for (int rule = 0; rule <= MOTION_ARCLEN_ADAPTIVE; rule++) {
        struct motion_arclen_measure measure;
        if (motion_arclen_measure(&space->curve, (enum motion_arclen_rule)rule,
                                  PATH_PANELS, &measure) < 0)
            continue;
        table_cell(&table, "%s", name[rule]);
        table_cell(&table, "%u", measure.evaluations);
        table_cell(&table, "%.9f", path_double(measure.length));
        table_cell(&table, "%.1e", path_double(measure.error));
        table_cell(&table, "%.1e", fabs(path_double(measure.length) - best));
    }
    fprintf(file, "\nlength of the path, %s; %d panels per piece\n",
            units_axis_text(path_report_unit(job)), PATH_PANELS);
    table_print(&table, file);
    table_free(&table);
}

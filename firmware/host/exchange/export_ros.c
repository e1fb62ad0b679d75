/* firmware/host/exchange/export_ros.c - a JointTrajectory of ROS as YAML or
 * JSON; see import.h and import_ros.c.
 *
 * A point stands wherever a segment of any axis begins, to the nanosecond, and
 * has positions and velocities where all segments are cubics or less, else
 * accelerations, too: a controller that interpolates by cubics or quintics
 * (joint_trajectory_controller) then runs the same move.  Where an acceleration
 * steps beside a quintic the point has the one after the step.
 *
 * Points are ROS_APART_NS apart: on a span h positions that are rounded by e
 * make a jerk of 60 e / h^3, which at 2^-33 unit and 1 ms is 7 unit/s3.  A
 * border that is left out for that leaves its step of jerk j inside a span:
 * velocities are off by j h^2 / 2 at most. */
#include <inttypes.h>
#include <stdlib.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/exchange/import.h"
#include "motion/core/fixed.h"

#define ROS_APART_NS 1000000
#define ROS_PI       3.14159265358979323846264338327950288L

struct ros_style {
    const char *begin, *names, *between_points, *point, *lists[3], *s, *ns,
        *end_point, *end;
};

static const struct ros_style ros_yaml = {
    "joint_names: [",
    "]\npoints:\n",
    "",
    "  - ",
    { "positions: [", "]\n    velocities: [", "]\n    accelerations: [" },
    "]\n    time_from_start: {sec: ",
    ", nanosec: ",
    "}\n",
    "",
};
static const struct ros_style ros_json = {
    "{\n  \"joint_names\": [",
    "],\n  \"points\": [\n",
    ",\n",
    "    {",
    { "\"positions\": [", "],\n     \"velocities\": [",
      "],\n     \"accelerations\": [" },
    "],\n     \"time_from_start\": {\"sec\": ",
    ", \"nanosec\": ",
    "}}",
    "\n  ]\n}\n",
};

/* m or rad in one of the axis's unit. */
static long double ros_scale(enum units_axis unit)
{
    return unit == UNITS_AXIS_MM    ? 1e-3L
           : unit == UNITS_AXIS_DEG ? ROS_PI / 180
           : unit == UNITS_AXIS_RAD ? 1
                                    : 2 * ROS_PI;
}

static int ros_compare(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return x < y ? -1 : x > y;
}

static int64_t ros_round_ns(int64_t t_ns_q12)
{
    return t_ns_q12 / MOTION_FIXED_NS_Q12 +
           (t_ns_q12 % MOTION_FIXED_NS_Q12 >= MOTION_FIXED_NS_Q12 / 2);
}

/* Of `all` rising times those far enough from the one before; the first and the
 * last stay. */
static size_t ros_thin(int64_t ns[], size_t all)
{
    const int64_t end_ns = ns[all - 1];
    size_t kept = 1;
    for (size_t i = 1; i + 1 < all; i++)
        if (ns[i] - ns[kept - 1] >= ROS_APART_NS &&
            end_ns - ns[i] >= ROS_APART_NS)
            ns[kept++] = ns[i];
    if (end_ns > ns[kept - 1])
        ns[kept++] = end_ns;
    return kept;
}

/* The times of all points, rising; *count of them, on the heap. */
static int64_t *ros_times(const struct job *job, size_t *count)
{
    size_t all = 0, at = 0;
    int64_t *ns;
    for (unsigned i = 0; i < job->move.axis_count; i++)
        all += job->track[i].count + 1;
    ns = memory_new(all, sizeof *ns);
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        for (uint32_t k = 0; k < job->track[i].count; k++)
            ns[at++] = ros_round_ns(job->track[i].segment[k].start_ns_q12);
        ns[at++] = ros_round_ns(job->track[i].end_ns_q12);
    }
    qsort(ns, all, sizeof *ns, ros_compare);
    *count = ros_thin(ns, all);
    return ns;
}

static int64_t ros_quantity(const struct motion_state *state, int order)
{
    return order == 0   ? state->pos_q32
           : order == 1 ? state->vel_q32
                        : state->acc_q32;
}

/* Positions and velocities are enough. */
static bool ros_is_cubic(const struct job *job)
{
    for (unsigned i = 0; i < job->move.axis_count; i++)
        for (uint32_t k = 0; k < job->track[i].count; k++)
            if (job->track[i].segment[k].degree > 3)
                return false;
    return true;
}

static void ros_point(const struct job *job, const struct ros_style *style,
                      int orders, int64_t ns, FILE *file)
{
    fputs(style->point, file);
    for (int order = 0; order < orders; order++) {
        fputs(style->lists[order], file);
        for (unsigned i = 0; i < job->move.axis_count; i++) {
            struct motion_state state;
            motion_track_state(&job->track[i], ns * MOTION_FIXED_NS_Q12,
                               &state);
            const long double value = (long double)ros_quantity(&state, order) /
                                      4294967296.0L *
                                      ros_scale(job_rig_axis(job, i)->unit);
            fprintf(file, "%s%.18Lg", i > 0 ? ", " : "", value);
        }
    }
    fprintf(file, "%s%" PRId64 "%s%" PRId64 "%s", style->s, ns / 1000000000,
            style->ns, ns % 1000000000, style->end_point);
}

static int ros_write(const struct job *job, const struct ros_style *style,
                     bool quotes, FILE *file, char message[YAML_MESSAGE_MAX])
{
    const char *quote = quotes ? "\"" : "";
    const int orders = ros_is_cubic(job) ? 2 : 3;
    size_t count;
    for (unsigned i = 0; i < job->move.axis_count; i++)
        if (job_rig_axis(job, i)->unit >= UNITS_AXIS_COUNT) {
            snprintf(
                message, YAML_MESSAGE_MAX,
                "axis %s is in counts, expected one in mm, deg, rad or rev: "
                "ROS has metres and radians",
                job->move.axis[i].name);
            return -1;
        }
    int64_t *ns = ros_times(job, &count);
    fputs(style->begin, file);
    for (unsigned i = 0; i < job->move.axis_count; i++)
        fprintf(file, "%s%s%s%s", i > 0 ? ", " : "", quote,
                job->move.axis[i].name, quote);
    fputs(style->names, file);
    for (size_t k = 0; k < count; k++) {
        plan_progress_tell(job->progress, "writing", "points", (int64_t)k,
                           (int64_t)count);
        fputs(k > 0 ? style->between_points : "", file);
        ros_point(job, style, orders, ns[k], file);
    }
    fputs(style->end, file);
    memory_free(ns);
    return 0;
}

int export_ros_yaml(const struct job *job, const struct units_fps *fps,
                    FILE *file, char message[YAML_MESSAGE_MAX])
{
    (void)fps;
    return ros_write(job, &ros_yaml, false, file, message);
}

int export_ros_json(const struct job *job, const struct units_fps *fps,
                    FILE *file, char message[YAML_MESSAGE_MAX])
{
    (void)fps;
    return ros_write(job, &ros_json, true, file, message);
}

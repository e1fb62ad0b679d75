/* firmware/host/job/job_gantry.c - does a move keep the rails of a gantry together? */
#include "firmware/host/job/job_open.h"

#include "firmware/control/couple.h"
#include "firmware/host/base/number.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

/* Both tracks over their whole length, as a follower that goes where its master does, and
 * is off by the racking at most. */
static bool gantry_keeps(const struct motion_track *one,
                         const struct motion_track *two, int64_t racking_q32,
                         struct controller_couple_off *off)
{
    struct motion_segment segment;
    struct motion_track line;
    struct motion_extreme pos;
    struct controller_cam cam = { .track = &line };
    int64_t length_q32, dur_ns_q12;

    motion_track_extreme(one, MOTION_POS, &pos);
    *off = (struct controller_couple_off){ .t_ns_q12 = 0 };
    if (motion_fixed_sub(pos.min, MOTION_FIXED_ONE_Q32, &cam.low_q32) < 0 ||
        motion_fixed_add(pos.max, MOTION_FIXED_ONE_Q32, &cam.high_q32) < 0 ||
        motion_fixed_sub(cam.high_q32, cam.low_q32, &length_q32) < 0)
        return false;
    cam.shift = controller_cam_shift(cam.low_q32, cam.high_q32);
    motion_track_init(&line, &segment, 1, cam.low_q32);
    if (motion_fixed_mulshift(length_q32, MOTION_FIXED_S_Q12, 32u + cam.shift,
                              &dur_ns_q12) < 0 ||
        motion_track_append_line(&line, dur_ns_q12, cam.high_q32) < 0 ||
        controller_cam_init(&cam) < 0)
        return false;
    cam.window_q32 = racking_q32;
    return controller_couple_judge(&cam, two, one, off);
}

static int gantry_find(const struct job *job, uint32_t axis)
{
    for (unsigned i = 0; i < job->move.axis_count; i++)
        if (job->rig_axis[i] == axis)
            return (int)i;
    return -1;
}

static enum status gantry_refuse(struct job *job,
                                 const struct rig_gantry *gantry, int own)
{
    const struct plan_axis *const axis = &job->move.axis[own];
    const int other = rig_gantry_other(gantry, job->rig_axis[own]);

    messages_add(&job->messages, MESSAGE_ERROR,
                 "%s:%u:%u: %s moves and %s does not, the other rail of gantry "
                 "%s, expected the same for both",
                 job->move_path, axis->place.line, axis->place.column,
                 axis->name, job->rig.axis[other].name, gantry->name);
    return STATUS_INPUT;
}

static enum status
gantry_judge(struct job *job, const struct rig_gantry *gantry, int one, int two)
{
    const struct plan_axis *const axis = &job->move.axis[two];
    const char *const unit =
        units_axis_text(job->rig.axis[gantry->axis[0]].unit);
    struct controller_couple_off off;
    char apart[NUMBER_MAX], most[NUMBER_MAX], at[NUMBER_MAX];

    if (gantry_keeps(&job->track[one], &job->track[two], gantry->racking_q32,
                     &off))
        return STATUS_OK;
    number_short(apart, (int64_t)motion_fixed_abs(off.off_q32), 32);
    number_short(most, gantry->racking_q32, 32);
    number_seconds(at, off.t_ns_q12);
    messages_add(&job->messages, MESSAGE_ERROR,
                 "%s:%u:%u: %s is %s %s beside %s at %s s, expected at most "
                 "the racking of gantry %s, %s %s: the same keys for both "
                 "rails",
                 job->move_path, axis->place.line, axis->place.column,
                 axis->name, apart, unit, job->move.axis[one].name, at,
                 gantry->name, most, unit);
    return STATUS_INPUT;
}

enum status job_gantries(struct job *job)
{
    enum status status = STATUS_OK;

    for (uint32_t i = 0; i < job->rig.gantry_count && status == STATUS_OK;
         i++) {
        const struct rig_gantry *const gantry = &job->rig.gantry[i];
        const int one = gantry_find(job, gantry->axis[0]);
        const int two = gantry_find(job, gantry->axis[1]);
        if (one >= 0 && two >= 0)
            status = gantry_judge(job, gantry, one, two);
        else if (one >= 0 || two >= 0)
            status = gantry_refuse(job, gantry, one >= 0 ? one : two);
    }
    return status;
}

/* firmware/linux/service/commands_couple.c - the commands that let an axis follow
 * another, and what of a move that allows; see command_line.h and
 * firmware/control/couple.h, gear.h. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "firmware/control/gear.h"
#include "firmware/host/base/number.h"
#include "firmware/linux/service/command_line.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define COUPLE_KEYS_MAX   1000
#define COUPLE_VALUE_MAX  1e9
#define COUPLE_RATIO_MAX  1000.0
#define COUPLE_OVER_MAX   1e6
#define COUPLE_AHEAD      10 /* 1 / s: what the tick may take to take it */
#define COUPLE_INSIDE_Q32 ((int64_t)1 << 12)

void service_cam_free(struct service_control *control)
{
    for (unsigned i = 0; control->cam != NULL && i < control->rig->axis_count;
         i++)
        for (unsigned k = 0; k < 2; k++)
            plan_track_free(&control->cam[i].track[k]);
    control->cam = NULL; /* the pool's */
}

/* "axis", and "to", which it is to follow.  False: it has been refused. */
static bool couple_axes(const struct command_line *line, unsigned *axis,
                        unsigned *master)
{
    const int which = command_line_axis(
        line, cJSON_GetStringValue(command_line_member(line, "axis")));
    if (which < 0)
        return false;
    const int to = command_line_axis(
        line, cJSON_GetStringValue(command_line_member(line, "to")));
    if (to < 0)
        return false;
    *axis = (unsigned)which;
    *master = (unsigned)to;
    return true;
}

/* The spare one becomes what is sent: the tick may have the other.  NULL: it has
 * been refused. */
static struct controller_cam *couple_spare(const struct command_line *line,
                                           unsigned axis, unsigned master,
                                           struct motion_track **track)
{
    struct service_cam *own = &line->control->cam[axis];
    const unsigned spare = 1 - own->which;
    *track = &own->track[spare];
    plan_track_free(*track);
    own->cam[spare] = (struct controller_cam){ .master = master };
    return &own->cam[spare];
}

/* `err`: what became of making it. */
static void couple_send_cam(const struct command_line *line, unsigned axis,
                            struct controller_cam *cam, int err)
{
    const struct mailbox_entry entry = { .command = MAILBOX_COUPLE,
                                         .axis = axis,
                                         .cam = cam };
    if (err < 0)
        command_line_refuse(line, command_line_error(err),
                            motion_err_text(err));
    else
        command_line_send(line, &entry);
}

/* The keys have how far the master is from the first in the place of a time. */
static void couple_send(const struct command_line *line, unsigned axis,
                        unsigned master, const struct plan_axis *curve)
{
    const int64_t low_q32 = line->control->cam[axis].low_q32;
    const struct plan_key *last = &curve->key[curve->key_count - 1];
    struct motion_track *track;
    struct controller_cam *cam = couple_spare(line, axis, master, &track);
    struct plan_error error;
    if (cam == NULL)
        return;
    cam->track = track;
    cam->low_q32 = low_q32;
    cam->high_q32 = low_q32 + last->key.t_ns_q12;
    cam->shift = controller_cam_shift(cam->low_q32, cam->high_q32);
    for (uint32_t i = 0; i < curve->key_count; i++)
        (void)motion_fixed_mulshift(curve->key[i].key.t_ns_q12,
                                    MOTION_FIXED_S_Q12, 32u + cam->shift,
                                    &curve->key[i].key.t_ns_q12);
    const int err = plan_axis_track(curve, track, &error);
    if (err < 0)
        command_line_refuse(line, command_line_error(err), error.text);
    else
        couple_send_cam(line, axis, cam, controller_cam_init(cam));
}

void service_cam_taken(struct service_control *control, unsigned axis)
{
    control->cam[axis].which = 1 - control->cam[axis].which;
}

/* --- a gear --- */

/* A bound of the master: where it is when the follower has gone this far, to an end
 * of its range, but for what rounding may make of that. */
static void couple_end(int64_t m_q32, int64_t far_q32, int64_t ratio_q32,
                       bool is_high, int64_t *bound_q32)
{
    int64_t at_q32;
    far_q32 = far_q32 > COUPLE_INSIDE_Q32    ? far_q32 - COUPLE_INSIDE_Q32
              : far_q32 < -COUPLE_INSIDE_Q32 ? far_q32 + COUPLE_INSIDE_Q32
                                             : 0;
    if (motion_fixed_muldiv(far_q32, MOTION_FIXED_ONE_Q32, ratio_q32, &at_q32) <
            0 ||
        motion_fixed_add(m_q32, at_q32, &at_q32) < 0)
        return;
    if (is_high ? at_q32 < *bound_q32 : at_q32 > *bound_q32)
        *bound_q32 = at_q32;
}

static void couple_ends(int64_t m_q32, int64_t f_q32,
                        const struct plan_limit *of, int64_t ratio_q32,
                        int64_t *low_q32, int64_t *high_q32)
{
    const bool up = ratio_q32 > 0;
    couple_end(m_q32, of->pos_min_q32 - f_q32, ratio_q32, !up,
               up ? low_q32 : high_q32);
    couple_end(m_q32, of->pos_max_q32 - f_q32, ratio_q32, up,
               up ? high_q32 : low_q32);
}

/* Onto a master that may move: it begins a little further on than it comes until
 * the tick has taken it. */
static void gear_engage(const struct command_line *line, unsigned axis,
                        unsigned master, int64_t ratio_q32, int64_t over_q32)
{
    const struct service_control *control = line->control;
    const struct plan_limit *of = &control->rig->axis[axis].limit;
    const struct plan_limit *by = &control->rig->axis[master].limit;
    const struct machine_view_axis *at = &control->state->view.axis[master];
    const int64_t sign = over_q32 < 0 ? -1 : 1;
    const int64_t ahead_q32 =
        (int64_t)(motion_fixed_abs(at->vel_q32) / COUPLE_AHEAD) + 1;
    struct controller_gear gear = {
        .ratio_q32 = ratio_q32,
        .place_q32 = control->state->view.axis[axis].demand_q32,
        .begin_q32 = at->demand_q32 + sign * ahead_q32,
        .over_q32 = sign * over_q32,
        .low_q32 = by->pos_min_q32,
        .high_q32 = by->pos_max_q32,
        .is_backwards = over_q32 < 0,
    };
    struct motion_track *track;
    struct controller_cam *cam = couple_spare(line, axis, master, &track);
    if (cam == NULL)
        return;
    /* the straight line is that through its place in the middle of `over` */
    couple_ends(gear.begin_q32 + over_q32 / 2, gear.place_q32, of, ratio_q32,
                &gear.low_q32, &gear.high_q32);
    if (gear.is_backwards)
        gear.high_q32 = by->pos_max_q32;
    else
        gear.low_q32 = by->pos_min_q32;
    track->segment = calloc(CONTROLLER_GEAR_SEGMENTS, sizeof *track->segment);
    track->capacity = track->segment != NULL ? CONTROLLER_GEAR_SEGMENTS : 0;
    const int err = controller_gear_cam(&gear, track, cam);
    couple_send_cam(line, axis, cam,
                    err == MOTION_E_ARG ? MOTION_E_LIMIT : err);
}

/* A straight line through where both stand, as far as both ranges go. */
void command_gear(const struct command_line *line)
{
    const struct service_control *control = line->control;
    struct plan_key key[2] = { { .key = { .t_ns_q12 = 0 } } };
    struct plan_axis curve = { .curve = PLAN_CURVE_LINEAR,
                               .key = key,
                               .key_count = 2 };
    unsigned axis, master;
    double ratio, over;
    if (!couple_axes(line, &axis, &master) ||
        !command_line_number(line, "ratio", -COUPLE_RATIO_MAX, COUPLE_RATIO_MAX,
                             (double)NAN, &ratio) ||
        !command_line_number(line, "over", -COUPLE_OVER_MAX, COUPLE_OVER_MAX, 0,
                             &over))
        return;
    const int64_t ratio_q32 = llrint(ratio * (double)MOTION_FIXED_ONE_Q32);
    const struct plan_limit *of = &control->rig->axis[axis].limit;
    const struct plan_limit *by = &control->rig->axis[master].limit;
    const int64_t f_q32 = control->state->view.axis[axis].demand_q32;
    const int64_t m_q32 = control->state->view.axis[master].demand_q32;
    int64_t low_q32 = by->pos_min_q32, high_q32 = by->pos_max_q32;
    if (ratio_q32 == 0) {
        command_line_refuse(line, "ARG",
                            "\"ratio\": expected one that is not "
                            "0; \"uncouple\" ends a gear");
        return;
    }
    if (over != 0) {
        gear_engage(line, axis, master, ratio_q32,
                    llrint(over * (double)MOTION_FIXED_ONE_Q32));
        return;
    }
    couple_ends(m_q32, f_q32, of, ratio_q32, &low_q32, &high_q32);
    /* to the last digit also where 2^-32 of the ratio is some */
    const double far[2] = { ratio * (double)(low_q32 - m_q32),
                            ratio * (double)(high_q32 - m_q32) };
    if (low_q32 >= high_q32 || !(fabs(far[0]) < 0x1p62) ||
        !(fabs(far[1]) < 0x1p62) ||
        motion_fixed_sub(high_q32, low_q32, &key[1].key.t_ns_q12) < 0 ||
        motion_fixed_add(f_q32, llrint(far[0]), &key[0].key.pos_q32) < 0 ||
        motion_fixed_add(f_q32, llrint(far[1]), &key[1].key.pos_q32) < 0) {
        command_line_refuse(line, "LIMIT", motion_err_text(MOTION_E_LIMIT));
        return;
    }
    line->control->cam[axis].low_q32 = low_q32;
    couple_send(line, axis, master, &curve);
}

/* --- a cam --- */

/* [[master, follower], ...] in their own units, as couple_send has them.  NULL: it has been refused;
 * else to be freed. */
static struct plan_key *couple_keys(const struct command_line *line,
                                    uint32_t *count, int64_t *low_q32)
{
    const cJSON *list = command_line_member(line, "keys"), *item;
    const int all = cJSON_GetArraySize(list);
    struct plan_key *key = NULL;
    if (cJSON_IsArray(list) && all >= 2 && all <= COUPLE_KEYS_MAX)
        key = calloc((size_t)all, sizeof *key);
    *count = 0;
    cJSON_ArrayForEach(item, list)
    {
        const double m = cJSON_GetNumberValue(cJSON_GetArrayItem(item, 0));
        const double f = cJSON_GetNumberValue(cJSON_GetArrayItem(item, 1));
        if (key == NULL || cJSON_GetArraySize(item) != 2 ||
            !(fabs(m) < COUPLE_VALUE_MAX) || !(fabs(f) < COUPLE_VALUE_MAX))
            break;
        const int64_t m_q32 = llrint(m * (double)MOTION_FIXED_ONE_Q32);
        struct motion_key *own = &key[*count].key;
        if (*count == 0)
            *low_q32 = m_q32;
        own->t_ns_q12 = m_q32 - *low_q32;
        own->pos_q32 = llrint(f * (double)MOTION_FIXED_ONE_Q32);
        (*count)++;
    }
    if (key != NULL && *count == (uint32_t)all)
        return key;
    free(key);
    command_line_refuse(line, "ARG",
                        "\"keys\": expected 2 to 1000 pairs of numbers, "
                        "[[where \"to\" is, where the axis is], ...]");
    return NULL;
}

void command_cam(const struct command_line *line)
{
    struct plan_axis curve = { .curve = PLAN_CURVE_C2 };
    unsigned axis, master;
    int64_t low_q32 = 0;
    if (!couple_axes(line, &axis, &master))
        return;
    curve.key = couple_keys(line, &curve.key_count, &low_q32);
    if (curve.key == NULL)
        return;
    line->control->cam[axis].low_q32 = low_q32;
    couple_send(line, axis, master, &curve);
    free(curve.key);
}

void command_uncouple(const struct command_line *line)
{
    struct mailbox_entry entry = { .command = MAILBOX_UNCOUPLE };
    const int axis = command_line_axis(
        line, cJSON_GetStringValue(command_line_member(line, "axis")));
    if (axis < 0)
        return;
    entry.axis = (unsigned)axis;
    command_line_send(line, &entry);
}

/* --- what is coupled, and a move ----------------------------------------------- */

/* A quantity of an axis of the rig, in its own unit. */
struct couple_text {
    char text[48];
};
static struct couple_text couple_quantity(const struct service_control *control,
                                          unsigned axis, int64_t value_q32,
                                          int digits, const char *per)
{
    struct couple_text quantity;
    snprintf(quantity.text, sizeof quantity.text, "%.*g %s%s", digits,
             number_double(value_q32, 32),
             units_axis_text(control->rig->axis[axis].unit), per);
    return quantity;
}

static const char *couple_name(const struct service_control *control,
                               unsigned axis)
{
    return control->rig->axis[axis].name;
}

#define COUPLE_TEXT(control, axis, value)                                      \
    couple_quantity(control, axis, value, 6, "").text

/* It stands off its curve, or the curve is none for it. */
const char *service_couple_refusal(const struct service_control *control,
                                   const struct mailbox_entry *entry,
                                   char text[], size_t size)
{
    const struct controller_cam *cam = entry->cam;
    const struct machine_view_axis *axis = control->state->view.axis;
    struct motion_cursor cursor = { 0 };
    struct motion_sample curve;
    if (entry->command != MAILBOX_COUPLE)
        return motion_err_text(entry->err);
    if (entry->err == MOTION_E_DISCONTINUITY)
        return "the slope of the curve steps, expected a curve without "
               "corners, such as c2";
    if (entry->err != MOTION_E_AWAY)
        return motion_err_text(entry->err);
    controller_cam_at(cam, &cursor, axis[cam->master].demand_q32, &curve);
    snprintf(text, size,
             "%s stands at %s and the curve is at %s where %s is, expected %s "
             "there, at rest",
             couple_name(control, entry->axis),
             COUPLE_TEXT(control, entry->axis, axis[entry->axis].demand_q32),
             couple_quantity(control, entry->axis, curve.pos_q32, 12, "").text,
             couple_name(control, cam->master),
             couple_name(control, entry->axis));
    return text;
}

/* Both are in the move: it has to have the same coupling. */
static bool couple_keeps_track(const struct service_control *control,
                               unsigned axis, const struct motion_track *own,
                               const struct motion_track *master, char text[],
                               size_t size)
{
    const struct controller_cam *cam = control->state->view.axis[axis].cam;
    struct controller_couple_off off;
    if (controller_couple_judge(cam, own, master, &off))
        return true;
    const char *name = couple_name(control, axis);
    const char *to = couple_name(control, cam->master);
    const double t_s = number_double(off.t_ns_q12, 12) / 1e9;
    if (off.off_q32 == 0)
        snprintf(text, size,
                 "%s follows %s, which goes to %s at %.3f s of this move and "
                 "may go from %s to %s as long as it does",
                 name, to, COUPLE_TEXT(control, cam->master, off.m_q32), t_s,
                 COUPLE_TEXT(control, cam->master, cam->low_q32),
                 COUPLE_TEXT(control, cam->master, cam->high_q32));
    else
        snprintf(text, size,
                 "%s follows %s, and this move takes it off that by %s at %.3f "
                 "s, where %s is at %s: leave %s out of the move and it is "
                 "taken along, or uncouple it",
                 name, to, COUPLE_TEXT(control, axis, llabs(off.off_q32)), t_s,
                 to, COUPLE_TEXT(control, cam->master, off.m_q32), name);
    return false;
}

/* It is taken along: as fast as it may, the master may be. */
static bool couple_keeps_limits(const struct service_control *control,
                                unsigned axis,
                                const struct motion_track *master, char text[],
                                size_t size)
{
    static const char *const per[] = { "", "/s", "/s2", "/s3" };
    const struct controller_cam *cam = control->state->view.axis[axis].cam;
    const struct controller_axis_config *config =
        control->loop->machine->controller.config.axis;
    int64_t peak_q32, most_q32;
    struct motion_extreme pos;
    motion_track_extreme(master, MOTION_POS, &pos);
    if (pos.min < cam->low_q32 - MOTION_TRACK_POS_ROUNDING ||
        pos.max > cam->high_q32 + MOTION_TRACK_POS_ROUNDING) {
        snprintf(text, size,
                 "%s follows %s, which goes from %s to %s in this move and may "
                 "go from %s to %s as long as it does",
                 couple_name(control, axis), couple_name(control, cam->master),
                 COUPLE_TEXT(control, cam->master, pos.min),
                 COUPLE_TEXT(control, cam->master, pos.max),
                 COUPLE_TEXT(control, cam->master, cam->low_q32),
                 COUPLE_TEXT(control, cam->master, cam->high_q32));
        return false;
    }
    const enum motion_quantity over = controller_cam_over(
        cam, &config[axis], &config[cam->master], master, &peak_q32, &most_q32);
    if (over == MOTION_POS)
        return true;
    snprintf(text, size,
             "%s cannot be taken along: %s goes at up to %s in this move, and "
             "may at %s at most as long as %s follows it",
             couple_name(control, axis), couple_name(control, cam->master),
             couple_quantity(control, cam->master, peak_q32, 6, per[over]).text,
             couple_quantity(control, cam->master, most_q32, 6, per[over]).text,
             couple_name(control, axis));
    return false;
}

bool service_is_coupled(const struct service_control *control)
{
    for (unsigned i = 0; i < control->rig->axis_count; i++)
        if (control->state->view.axis[i].cam != NULL)
            return true;
    return false;
}

bool service_couplings_keep(const struct service_control *control,
                            const struct service_motion *motion, char text[],
                            size_t size)
{
    for (unsigned i = 0; i < control->rig->axis_count; i++) {
        const struct controller_cam *cam = control->state->view.axis[i].cam;
        const struct motion_track *own = motion->track[i];
        const struct motion_track *master =
            cam != NULL ? motion->track[cam->master] : NULL;
        if (cam == NULL || (own == NULL && master == NULL))
            continue;
        if (master == NULL) {
            snprintf(text, size,
                     "%s follows %s, which this move leaves where it is: leave "
                     "%s out of the move, or uncouple it",
                     couple_name(control, i), couple_name(control, cam->master),
                     couple_name(control, i));
            return false;
        }
        if (own == NULL
                ? !couple_keeps_limits(control, i, master, text, size)
                : !couple_keeps_track(control, i, own, master, text, size))
            return false;
    }
    return true;
}

bool command_keeps_couplings(const struct command_line *line)
{
    char text[SERVICE_COUPLE_TEXT_MAX];
    if (service_couplings_keep(line->control, &line->control->move->motion,
                               text, sizeof text))
        return true;
    command_line_refuse(line, "STATE", text);
    return false;
}

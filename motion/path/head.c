/* motion/path/head.c - see head.h. */
#include "motion/path/head.h"

#include "motion/core/err.h"
#include "motion/number/trig.h"

#define HEAD_TURNS_MAX ((int64_t)1 << 22)
#define HEAD_POLE_Q62  ((int64_t)1 << 22) /* 2^-40 */
#define HEAD_ONE_Q62   ((int64_t)1 << 62)

/* Roll about view v from the level right vector of `pan`. */
static int64_t head_roll(int64_t pan_turn, struct motion_dir view,
                         struct motion_dir right)
{
    struct motion_dir level = { { 0, 0, 0 } };
    int64_t s, c;

    motion_trig_sincos(pan_turn, &s, &c);
    level.q62[0] = c;
    level.q62[2] = -s;
    return motion_trig_atan2(
        motion_dir_dot_q62(right, motion_dir_cross(view, level)),
        motion_dir_dot_q62(right, level));
}

static void head_angles(const struct motion_head *head, struct motion_quat q,
                        int64_t turn[MOTION_HEAD_AXES])
{
    const struct motion_dir view =
        motion_quat_turn(q, (struct motion_dir){ { 0, 0, -HEAD_ONE_Q62 } });
    const struct motion_dir right =
        motion_quat_turn(q, (struct motion_dir){ { HEAD_ONE_Q62, 0, 0 } });
    const int64_t level = (int64_t)motion_trig_hypot(view.q62[0], view.q62[2]);

    turn[MOTION_HEAD_PAN] = motion_trig_atan2(-view.q62[0], -view.q62[2]);
    if (level < HEAD_POLE_Q62)
        turn[MOTION_HEAD_PAN] = head->turn[MOTION_HEAD_PAN];
    turn[MOTION_HEAD_TILT] = motion_trig_atan2(view.q62[1], level);
    turn[MOTION_HEAD_ROLL] = head_roll(turn[MOTION_HEAD_PAN], view, right);
}

/* Sum of the displacements from the angles before, at most 3/2 turn, halved. */
static uint64_t head_displacement(const struct motion_head *head,
                                  const int64_t turn[MOTION_HEAD_AXES])
{
    uint64_t sum = 0;

    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        sum += motion_fixed_abs(motion_trig_diff(turn[i], head->turn[i])) / 2;
    return sum;
}

/* At the pole pan could be any angle; its other solution is the same tilt. */
static void head_choose(const struct motion_head *head,
                        int64_t turn[MOTION_HEAD_AXES])
{
    const int64_t other[MOTION_HEAD_AXES] = {
        motion_trig_sum(turn[0], MOTION_TRIG_HALF_TURN),
        motion_trig_diff(MOTION_TRIG_HALF_TURN, turn[1]),
        motion_trig_sum(turn[2], MOTION_TRIG_HALF_TURN),
    };

    if (!head->valid ||
        head_displacement(head, turn) <= head_displacement(head, other))
        return;
    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        turn[i] = other[i];
}

int motion_head_follow(struct motion_head *head, struct motion_quat q)
{
    struct motion_head next = { .valid = true };

    head_angles(head, q, next.turn);
    head_choose(head, next.turn);
    for (int i = 0; i < MOTION_HEAD_AXES; i++) {
        const int64_t before = head->turn[i], now = next.turn[i];
        const bool up = motion_trig_diff(now, before) >= 0;

        next.whole[i] = head->whole[i];
        if (head->valid && up != (now >= before))
            next.whole[i] += up ? 1 : -1;
        if (next.whole[i] > HEAD_TURNS_MAX || next.whole[i] < -HEAD_TURNS_MAX)
            return MOTION_E_RANGE;
    }
    *head = next;
    return MOTION_OK;
}

int64_t motion_head_deg_q32(const struct motion_head *head,
                            enum motion_head_axis axis)
{
    return head->whole[axis] * 360 * MOTION_FIXED_ONE_Q32 +
           motion_trig_deg_q32(head->turn[axis]);
}

void motion_head_set_deg_q32(struct motion_head *head,
                             enum motion_head_axis axis, int64_t deg_q32)
{
    const int64_t full = 360 * MOTION_FIXED_ONE_Q32;
    const int64_t turn = motion_trig_from_deg_q32(deg_q32);
    const int64_t whole = deg_q32 - motion_trig_deg_q32(turn);

    head->turn[axis] = turn;
    head->whole[axis] = (whole + (whole < 0 ? -full : full) / 2) / full;
    head->valid = true;
}

struct motion_quat motion_head_quat(const int64_t turn[MOTION_HEAD_AXES])
{
    const struct motion_dir right = { { HEAD_ONE_Q62, 0, 0 } };
    const struct motion_dir up = { { 0, HEAD_ONE_Q62, 0 } };
    const struct motion_dir view = { { 0, 0, -HEAD_ONE_Q62 } };

    return motion_quat_mul(
        motion_quat_mul(motion_quat_about(up, turn[MOTION_HEAD_PAN]),
                        motion_quat_about(right, turn[MOTION_HEAD_TILT])),
        motion_quat_about(view, turn[MOTION_HEAD_ROLL]));
}

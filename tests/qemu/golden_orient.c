/* tests/qemu/golden_orient.c - orientation: the same bits on every machine.
 *
 * Like golden.c: one hash per module of everything that came out, the same on a
 * PC and on every processor in QEMU. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/number/trig.h"
#include "motion/path/frame.h"
#include "motion/path/head.h"
#include "motion/path/lookat.h"
#include "motion/path/orient.h"
#include "motion/path/rotspline.h"
#include "tests/motion/path/lookat_point.h"
#include "tests/qemu/golden_tools.h"

#define ONE    ((int64_t)1 << 62)
#define UNIT   MOTION_FIXED_ONE_Q32
#define SECOND MOTION_FIXED_S_Q12
#define KEYS   5

static void golden_add_vec(struct motion_vec a)
{
    for (int i = 0; i < 3; i++)
        golden_add_real(a.x[i]);
}

static void golden_add_dir(struct motion_dir a)
{
    for (int i = 0; i < 3; i++)
        golden_add(a.q62[i]);
}

static void golden_add_quat(struct motion_quat q)
{
    golden_add(q.w);
    golden_add(q.x);
    golden_add(q.y);
    golden_add(q.z);
}

static struct motion_quat golden_quat(void)
{
    struct motion_quat q = MOTION_QUAT_ONE;
    int64_t part[4];

    for (int i = 0; i < 4; i++)
        part[i] = golden_any();
    (void)motion_quat_unit(part, &q);
    return q;
}

static struct motion_vec golden_vec(unsigned down)
{
    int64_t part[3];

    for (int i = 0; i < 3; i++)
        part[i] = golden_any() >> down;
    return motion_vec_from_q32(part);
}

static void golden_trig(void)
{
    for (int i = 0; i < 200; i++) {
        const int64_t y = golden_any(), x = golden_any() >> (i & 63);
        int64_t s, c;

        motion_trig_sincos(y, &s, &c);
        golden_add(s);
        golden_add(c);
        golden_add(motion_trig_atan2(y, x));
        golden_add((int64_t)motion_trig_hypot(x, y));
        golden_add(motion_trig_from_deg_q32(y));
        golden_add(motion_trig_deg_q32(x));
        golden_add(motion_trig_from_rad(motion_real_from_q(x, 60)));
    }
}

static void golden_quats(void)
{
    struct motion_quat key[KEYS], inner[KEYS], q = MOTION_QUAT_ONE;

    for (int round = 0; round < 10; round++) {
        for (int i = 0; i < KEYS; i++) {
            key[i] = golden_quat();
            if (i > 0 && motion_quat_dot_q62(key[i - 1], key[i]) < 0)
                key[i] = motion_quat_neg(key[i]);
        }
        golden_add(motion_quat_squad_inner(key, KEYS, inner));
        for (int i = 0; i + 1 < KEYS; i++) {
            const int64_t x = golden_any() & (ONE - 1);
            golden_add(motion_quat_slerp(key[i], key[i + 1], x, &q));
            golden_add_quat(q);
            golden_add(motion_quat_squad(&key[i], &inner[i], x, &q));
            golden_add_quat(q);
        }
    }
}

static struct motion_rotkey golden_key[KEYS];

static void golden_plan(struct motion_rotspline *spline)
{
    for (int i = 0; i < KEYS; i++)
        golden_key[i] = (struct motion_rotkey){
            .t_ns_q12 = (i + (i & 1)) * SECOND + i * SECOND / 3,
            .q = golden_quat(),
        };
    golden_add(motion_rotspline_plan(spline, golden_key, KEYS,
                                     MOTION_ROTSPLINE_REST,
                                     MOTION_ROTSPLINE_CHORD, 10));
}

static void golden_rotspline(void)
{
    struct motion_rotspline spline;

    golden_plan(&spline);
    for (int i = 0; i + 1 < KEYS; i++) {
        golden_add_vec(golden_key[i].rate);
        golden_add_vec(golden_key[i].end_rate);
        for (int k = 0; k <= 4; k++)
            golden_add_quat(
                motion_rotspline_within(&spline.key[i], ONE / 4 * k));
    }
}

/* Keys that are nowhere half a turn apart, so that the spline converges. */
static void golden_turns(void)
{
    static struct motion_orient_key key[KEYS];
    struct motion_orient orient = { .key = key,
                                    .count = KEYS,
                                    .rotkey = golden_key };
    struct motion_quat q = MOTION_QUAT_ONE;

    for (int i = 0; i < KEYS; i++) {
        q = motion_quat_mul(q, motion_quat_exp(golden_vec(31)));
        key[i] =
            (struct motion_orient_key){ .t = i * SECOND + (i & 1), .q = q };
    }
    for (int curve = 0; curve <= MOTION_ORIENT_C2; curve++) {
        orient.curve = (enum motion_orient_curve)curve;
        golden_add(motion_orient_plan(&orient));
        for (int i = 0; i < 18; i++) {
            golden_add(motion_orient_at(&orient, SECOND / 4 * i, &q));
            golden_add_quat(q);
        }
    }
}

/* P and its derivatives of a cubic: Horner's scheme, divided by k!. */
static void golden_cubic(const struct motion_vec coef[4], int64_t u_q62,
                         struct motion_curve_point *point)
{
    const struct motion_real u = motion_real_from_q(u_q62, 62);
    struct motion_vec d[4];

    for (int i = 0; i < 4; i++)
        d[i] = motion_vec_zero();
    for (int k = 4; k-- > 0;) {
        for (int i = 3; i > 0; i--)
            d[i] = motion_vec_add(motion_vec_scale(d[i], u), d[i - 1]);
        d[0] = motion_vec_add(motion_vec_scale(d[0], u), coef[k]);
    }
    *point = (struct motion_curve_point){ d[0], d[1], motion_vec_shift(d[2], 1),
                                          motion_vec_scale(
                                              d[3], motion_real_int(6)) };
}

static void golden_frames(void)
{
    struct motion_frame frame = { .r = { { ONE, 0, 0 } } };
    struct motion_curve_point before, point;
    struct motion_frenet frenet;
    struct motion_vec coef[4];
    struct motion_dir t = { { 0, 0, 0 } };

    for (int i = 0; i < 4; i++)
        coef[i] = golden_vec(28);
    for (int i = 0; i <= 16; i++) {
        golden_cubic(coef, ONE / 16 * i, &point);
        golden_add(motion_frame_frenet(&point, &frenet));
        golden_add_dir(frenet.n);
        golden_add_real(frenet.curvature);
        golden_add_real(frenet.torsion);
        golden_add(motion_vec_unit(point.d1, &t));
        if (i == 0)
            golden_add(motion_frame_start(t, frame.r, &frame));
        else
            golden_add(motion_frame_step(
                &frame, motion_vec_sub(point.pos, before.pos), t, &frame));
        golden_add_dir(frame.r);
        golden_add_dir(frame.s);
        before = point;
    }
}

static void golden_lookat(void)
{
    static const struct motion_lookat lookat = { .up = { { 0, ONE, 0 } },
                                                 .ahead = { { 0, 0, -ONE } } };
    struct motion_lookat_state state = { .valid = false };
    struct motion_head head = { .valid = false };
    struct motion_view view = { .right = { { 0, 0, 0 } } };

    for (int i = 0; i < 50; i++) {
        /* one call per statement: C leaves their order open */
        const struct motion_vec pos = golden_vec(20);
        const struct motion_vec coi = golden_vec(20);
        const int64_t tilt = golden_any();
        golden_add(lookat_point(&lookat, &state, pos, coi, tilt, &view));
        golden_add_dir(view.right);
        golden_add_dir(view.up);
        golden_add_dir(view.view);
        golden_add(motion_head_follow(&head, motion_view_quat(&view)));
        for (int k = 0; k < MOTION_HEAD_AXES; k++)
            golden_add(motion_head_deg_q32(&head, (enum motion_head_axis)k));
    }
}

/* Two keys half a radian apart: few segments. */
static int golden_turning(void *context, int64_t t, struct motion_quat *q)
{
    const struct motion_quat *const key = context;
    const int64_t x = t < 0 ? 0 : t > SECOND ? SECOND : t;
    int64_t x_q62 = 0;

    (void)motion_fixed_muldiv(x, ONE, SECOND, &x_q62);
    return motion_quat_slerp(key[0], key[1], x_q62, q);
}

static void golden_bake(void)
{
    static struct motion_segment segment[MOTION_HEAD_AXES][16];
    static const int64_t border[2] = { 0, SECOND };
    const struct motion_head_bake bake = { border, 2, UNIT / 1000, 0,
                                           0,      0, false };
    struct motion_quat key[2] = { MOTION_QUAT_ONE, { ONE, 0, 0, 0 } };
    const struct motion_turning turning = { golden_turning, key };
    struct motion_head head = { .valid = false };
    struct motion_track track[MOTION_HEAD_AXES];
    struct motion_track *list[MOTION_HEAD_AXES];
    int64_t bound[MOTION_HEAD_AXES] = { 0, 0, 0 };

    key[1] = motion_quat_exp(motion_vec_shift(golden_vec(32), -2));
    for (int i = 0; i < MOTION_HEAD_AXES; i++) {
        list[i] = &track[i];
        motion_track_init(list[i], segment[i], 16, 0);
    }
    golden_add(motion_head_bake(&bake, &turning, &head, list, bound));
    for (int i = 0; i < MOTION_HEAD_AXES; i++) {
        golden_add(track[i].count);
        golden_add(bound[i]);
        golden_add_segments(&track[i]);
    }
}

static const struct {
    const char *name;
    void (*run)(void);
} producers[] = {
    { "trig", golden_trig },           { "quat", golden_quats },
    { "rotspline", golden_rotspline }, { "frame", golden_frames },
    { "lookat, head", golden_lookat }, { "head bake", golden_bake },
    { "orient", golden_turns },
};

int main(void)
{
    for (size_t i = 0; i < sizeof producers / sizeof producers[0]; i++) {
        golden_start(i + 1);
        producers[i].run();
        golden_report(producers[i].name, 0);
    }
    return 0;
}

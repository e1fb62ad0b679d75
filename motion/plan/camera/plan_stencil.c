/* motion/plan/camera/plan_stencil.c - see plan_stencil.h. */
#include "motion/plan/camera/plan_stencil.h"

const int64_t plan_stencil_first[2][PLAN_STENCIL_NODES] = {
    { -147, 360, -450, 400, -225, 72, -10 },
    { -1, 9, -45, 0, 45, -9, 1 },
};
const int64_t plan_stencil_second[2][PLAN_STENCIL_NODES] = {
    { 812, -3132, 5265, -5080, 2970, -972, 137 },
    { 2, -27, 270, -490, 270, -27, 2 },
};

struct plan_stencil plan_stencil_at(int64_t low, int64_t high, int64_t step,
                                    int64_t at)
{
    if (at - low < 3 * step)
        return (struct plan_stencil){ 0, at, step };
    if (high - at < 3 * step)
        return (struct plan_stencil){ 0, at, -step };
    return (struct plan_stencil){ 1, at - 3 * step, step };
}

/* An axis of the camera, or the opposite, in space. */
static struct motion_dir stencil_axis(struct motion_quat q, int axis, int sign)
{
    struct motion_dir dir = { { 0, 0, 0 } };

    dir.q62[axis] = sign * ((int64_t)1 << 62);
    return motion_quat_turn(q, dir);
}

/* Differences are taken in integers, where they lose nothing. */
static struct plan_jet_vec
stencil_vec(const struct plan_stencil *stencil,
            const struct motion_dir dir[PLAN_STENCIL_NODES], double h)
{
    const int row = stencil->central, here = row ? 3 : 0;
    struct plan_jet_vec v;

    for (int k = 0; k < 3; k++) {
        double first = 0, second = 0;
        for (int i = 0; i < PLAN_STENCIL_NODES; i++) {
            const double off =
                ldexp((double)(dir[i].q62[k] - dir[here].q62[k]), -62);
            first += (double)plan_stencil_first[row][i] * off;
            second += (double)plan_stencil_second[row][i] * off;
        }
        v.x[k] = (struct plan_jet){ ldexp((double)dir[here].q62[k], -62),
                                    first / (60 * h), second / (180 * h * h) };
    }
    return v;
}

void plan_stencil_frame(const struct plan_stencil *stencil,
                        const struct motion_quat turn[PLAN_STENCIL_NODES],
                        double h, struct plan_rig_frame *frame)
{
    static const struct {
        int axis, sign;
    } of[3] = { { 2, -1 }, { 0, -1 }, { 1, 1 } };
    struct plan_jet_vec *const to[3] = { &frame->forward, &frame->left,
                                         &frame->up };

    for (int n = 0; n < 3; n++) {
        struct motion_dir dir[PLAN_STENCIL_NODES];
        for (int i = 0; i < PLAN_STENCIL_NODES; i++)
            dir[i] = stencil_axis(turn[i], of[n].axis, of[n].sign);
        *to[n] = stencil_vec(stencil, dir, h);
    }
}

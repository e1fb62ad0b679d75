/* firmware/linux/xml/urdf_arm.c - see urdf_arm.h. */
#include "firmware/linux/xml/urdf_arm.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "motion/double/double_math.h"

#define URDF_TOOL  "tool0"         /* the flange of an arm by REP 199 */
#define URDF_LENS  "optical_frame" /* of a camera by REP 103: y is down */
#define URDF_SPLIT 1e-7            /* mm, between lines that meet */
#define URDF_FAR   1e6             /* mm, to the feet of a common normal */

/* ---- the chain ----------------------------------------------------------- */

static bool urdf_is_axis(const struct rig *rig, const struct urdf_joint *joint)
{
    return joint->moves && rig_axis_index(rig, joint->name) >= 0;
}

static const struct urdf_joint *urdf_above(const struct urdf *urdf,
                                           const char *link)
{
    for (uint32_t i = 0; i < urdf->joints; i++)
        if (urdf->joint[i].child[0] != 0 &&
            strcmp(urdf->joint[i].child, link) == 0)
            return &urdf->joint[i];
    return NULL;
}

/* Go from `last` upwards; links that go round end where there are no more joints. */
static void urdf_climb(const struct urdf *urdf, const struct urdf_joint *last,
                       struct urdf_chain *chain)
{
    chain->joints = 0;
    for (const struct urdf_joint *at = last;
         at != NULL && chain->joints < urdf->joints;
         at = urdf_above(urdf, at->parent))
        chain->joint[chain->joints++] = at;
    for (uint32_t i = 0; 2 * i + 1 < chain->joints; i++) {
        const struct urdf_joint *swap = chain->joint[i];
        chain->joint[i] = chain->joint[chain->joints - 1 - i];
        chain->joint[chain->joints - 1 - i] = swap;
    }
    chain->from = chain->joint[0]->parent;
    chain->to = last->child;
}

static uint32_t urdf_axes_of(const struct rig *rig,
                             const struct urdf_chain *chain)
{
    uint32_t axes = 0;

    for (uint32_t i = 0; i < chain->joints; i++)
        axes += urdf_is_axis(rig, chain->joint[i]);
    return axes;
}

/* Find what is fixed to a link: the flange of the usual name, else the only one. */
static const struct urdf_joint *urdf_below(const struct urdf *urdf,
                                           const char *link)
{
    const struct urdf_joint *only = NULL;
    uint32_t count = 0;

    for (uint32_t i = 0; i < urdf->joints; i++) {
        const struct urdf_joint *joint = &urdf->joint[i];
        if (joint->moves || joint->is_loose || strcmp(joint->parent, link) != 0)
            continue;
        if (strcmp(joint->child, URDF_TOOL) == 0)
            return joint;
        only = joint;
        count++;
    }
    return count == 1 ? only : NULL;
}

static void urdf_descend(const struct urdf *urdf, struct urdf_chain *chain)
{
    const struct urdf_joint *next;

    while (chain->joints < urdf->joints && strcmp(chain->to, URDF_TOOL) != 0 &&
           (next = urdf_below(urdf, chain->to)) != NULL) {
        chain->joint[chain->joints++] = next;
        chain->to = next->child;
    }
}

static int urdf_chain_check(const struct rig *rig,
                            const struct urdf_chain *chain,
                            char why[URDF_WHY_MAX])
{
    for (uint32_t i = 0; i < chain->joints; i++) {
        const struct urdf_joint *joint = chain->joint[i];
        const char *what = NULL;
        if (joint->is_loose)
            what = "is of several axes";
        else if (joint->follows)
            what = "follows another joint";
        else if (joint->moves && !urdf_is_axis(rig, joint))
            what = "moves and is no axis of the rig";
        else if (urdf_is_axis(rig, joint) &&
                 rig->axis[rig_axis_index(rig, joint->name)].unit ==
                     UNITS_AXIS_REV)
            what = "is an axis in rev, and those of an arm are in deg, rad or "
                   "mm";
        if (what == NULL)
            continue;
        snprintf(why, URDF_WHY_MAX, "joint '%.63s' %s", joint->name, what);
        return -1;
    }
    return 0;
}

int urdf_chain(const struct urdf *urdf, const struct rig *rig,
               struct urdf_chain *chain, char why[URDF_WHY_MAX])
{
    const struct urdf_joint *last = NULL, *first = NULL;
    uint32_t most = 0, all = 0;

    for (uint32_t i = 0; i < urdf->joints; i++) {
        if (!urdf_is_axis(rig, &urdf->joint[i]))
            continue;
        urdf_climb(urdf, &urdf->joint[i], chain);
        const uint32_t axes = urdf_axes_of(rig, chain);
        all++;
        first = first == NULL ? &urdf->joint[i] : first;
        if (axes > most) {
            most = axes;
            last = &urdf->joint[i];
        }
    }
    if (last == NULL || all > MOTION_ARM_JOINTS_MAX) {
        snprintf(why, URDF_WHY_MAX,
                 "%u joints are axes of the rig, and an arm has 1 .. %d", all,
                 MOTION_ARM_JOINTS_MAX);
        return -1;
    }
    if (last->parent[0] == 0 || last->child[0] == 0) {
        snprintf(why, URDF_WHY_MAX,
                 "joint '%.63s' does not say its parent and its child",
                 last->name);
        return -1;
    }
    urdf_climb(urdf, last, chain);
    if (most < all) {
        snprintf(why, URDF_WHY_MAX,
                 "the joints are on several branches: joint '%.63s' carries %u "
                 "of %u",
                 first->name, most, all);
        return -1;
    }
    urdf_descend(urdf, chain);
    return urdf_chain_check(rig, chain, why);
}

/* ---- vectors ------------------------------------------------------------- */

static double urdf_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void urdf_cross(const double a[3], const double b[3], double out[3])
{
    const double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2],
                 z = a[0] * b[1] - a[1] * b[0];

    out[0] = x;
    out[1] = y;
    out[2] = z;
}

/* out = a + k b */
static void urdf_add(const double a[3], double k, const double b[3],
                     double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[i] + k * b[i];
}

static double urdf_length(const double a[3])
{
    return sqrt(urdf_dot(a, a));
}

static void urdf_scale(double a[3], double k)
{
    for (int i = 0; i < 3; i++)
        a[i] *= k;
}

/* Make a of length 1 and across z. */
static void urdf_across(const double z[3], double a[3])
{
    urdf_add(a, -urdf_dot(a, z), z, a);
    urdf_scale(a, 1 / urdf_length(a));
}

/* ---- where the description has the joints -------------------------------- */

/* In the root's. */
struct urdf_frame {
    double axis[3][3], at[3];
};

/* Turn v of the frame into the root's. */
static void urdf_out(const struct urdf_frame *frame, const double v[3],
                     double out[3])
{
    double sum[3] = { 0, 0, 0 };

    for (int i = 0; i < 3; i++)
        urdf_add(sum, v[i], frame->axis[i], sum);
    memcpy(out, sum, sizeof sum);
}

static void urdf_turn(struct urdf_frame *frame, const double about[3],
                      double angle)
{
    const double s = double_sin(angle), c = double_cos(angle);

    for (int i = 0; i < 3; i++) {
        double across[3];
        const double along = (1 - c) * urdf_dot(about, frame->axis[i]);
        urdf_cross(about, frame->axis[i], across);
        for (int k = 0; k < 3; k++)
            frame->axis[i][k] =
                c * frame->axis[i][k] + s * across[k] + along * about[k];
    }
}

static double urdf_snap(double angle, double snap)
{
    const double right = DOUBLE_PI / 2, near = right * rint(angle / right);

    return fabs(angle - near) <= snap ? near : angle;
}

static void urdf_snap_direction(double a[3], double snap)
{
    for (int i = 0; i < 3; i++)
        if (fabs(a[i] - rint(a[i])) <= snap)
            a[i] = rint(a[i]);
}

/* Go to the frame of the joint at 0: turns about fixed x, y, z are those about own
 * z, y, x. */
static void urdf_enter(struct urdf_frame *frame, const struct urdf_joint *joint,
                       double snap)
{
    double off[3];

    urdf_out(frame, joint->origin, off);
    urdf_add(frame->at, 1000, off, frame->at);
    for (int i = 3; i-- > 0;) {
        double about[3];
        memcpy(about, frame->axis[i], sizeof about);
        urdf_turn(frame, about, urdf_snap(joint->rpy[i], snap));
    }
}

static void urdf_direction(const struct urdf_frame *frame,
                           const struct urdf_joint *joint, double out[3])
{
    urdf_out(frame, joint->axis, out);
    urdf_scale(out, 1 / urdf_length(out));
}

static const struct urdf_frame urdf_root = {
    .axis = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }
};

static void urdf_tip_of(const struct urdf_chain *chain,
                        const struct urdf_frame *frame, struct urdf_tip *tip)
{
    const size_t length = strlen(chain->to), lens = strlen(URDF_LENS);

    memcpy(tip->at, frame->at, sizeof tip->at);
    memcpy(tip->view, frame->axis[2], sizeof tip->view);
    memcpy(tip->up, frame->axis[1], sizeof tip->up);
    if (length >= lens && strcmp(chain->to + length - lens, URDF_LENS) == 0)
        urdf_scale(tip->up, -1);
}

void urdf_tip(const struct urdf_chain *chain, const double joint[],
              struct urdf_tip *tip)
{
    struct urdf_frame frame = urdf_root;
    uint32_t moving = 0;

    for (uint32_t i = 0; i < chain->joints; i++) {
        double axis[3];
        urdf_enter(&frame, chain->joint[i], 0);
        if (!chain->joint[i]->moves)
            continue;
        const double by = joint[moving++];
        urdf_direction(&frame, chain->joint[i], axis);
        if (chain->joint[i]->slides)
            urdf_add(frame.at, by, axis, frame.at);
        else
            urdf_turn(&frame, axis, by);
    }
    urdf_tip_of(chain, &frame, tip);
}

/* ---- the table ----------------------------------------------------------- */

/* The line of a joint's axis, all joints at 0. */
struct urdf_line {
    double at[3], z[3];
};

/* Go from the frame whose z is the joint's axis to that on the next one's, by the
 * common normal of the two. */
static void urdf_row(struct urdf_frame *frame, const struct urdf_line *next,
                     double snap, struct urdf_row *row)
{
    const double *z = frame->axis[2];
    double normal[3], off[3], left[3], up = 0;

    urdf_add(next->at, -1, frame->at, off);
    urdf_cross(z, next->z, normal);
    const double sine = urdf_length(normal);
    if (sine > fmax(snap, 1e-9)) {
        /* along both axes to the feet of the normal */
        double across[3];
        urdf_scale(normal, 1 / sine);
        urdf_cross(next->z, normal, across);
        up = urdf_dot(off, across) / urdf_dot(z, across);
    } else {
        urdf_add(off, -urdf_dot(off, z), z, normal);
        if (urdf_length(normal) < URDF_SPLIT)
            memcpy(normal, frame->axis[0], sizeof normal);
        urdf_across(z, normal);
    }
    double theta = atan2(urdf_dot(normal, frame->axis[1]),
                         urdf_dot(normal, frame->axis[0]));
    if (fabs(theta) > DOUBLE_PI / 2 + 1e-6) {
        urdf_scale(normal, -1);
        theta -= copysign(DOUBLE_PI, theta);
    }
    urdf_cross(z, normal, left);
    row->theta = urdf_snap(theta, snap);
    row->d = up;
    row->a = urdf_dot(off, normal);
    row->alpha =
        urdf_snap(atan2(-urdf_dot(next->z, left), urdf_dot(next->z, z)), snap);
    /* the foot on the next axis */
    urdf_add(frame->at, up, z, frame->at);
    urdf_add(frame->at, row->a, normal, frame->at);
    memcpy(frame->axis[2], next->z, sizeof next->z);
    urdf_across(next->z, normal);
    memcpy(frame->axis[0], normal, sizeof normal);
    urdf_cross(next->z, normal, frame->axis[1]);
}

/* Take the root's own frame where its z is the first axis; else one on it. */
static void urdf_base(const struct urdf_line *first, double snap,
                      struct urdf_frame *frame, struct urdf_arm *arm)
{
    double off[3];

    *frame = urdf_root;
    urdf_add(first->at, -first->at[2], urdf_root.axis[2], off);
    arm->has_base = first->z[2] < 1 - fmax(snap * snap, 1e-14) ||
                    urdf_length(off) > URDF_SPLIT;
    if (!arm->has_base)
        return;
    memcpy(frame->at, first->at, sizeof frame->at);
    memcpy(frame->axis[2], first->z, sizeof first->z);
    if (fabs(first->z[0]) > 0.9)
        memcpy(frame->axis[0], urdf_root.axis[1], sizeof frame->axis[0]);
    urdf_snap_direction(frame->axis[2], snap);
    urdf_across(frame->axis[2], frame->axis[0]);
    urdf_snap_direction(frame->axis[0], snap);
    urdf_cross(frame->axis[2], frame->axis[0], frame->axis[1]);
    memcpy(arm->base, frame->at, sizeof arm->base);
    memcpy(arm->z, frame->axis[2], sizeof arm->z);
    memcpy(arm->x, frame->axis[0], sizeof arm->x);
}

static void urdf_tool(const struct urdf_tip *tip,
                      const struct urdf_frame *flange, double snap,
                      struct urdf_arm *arm)
{
    double off[3];

    urdf_add(tip->at, -1, flange->at, off);
    for (int i = 0; i < 3; i++) {
        arm->tool[i] = urdf_dot(off, flange->axis[i]);
        arm->view[i] = urdf_dot(tip->view, flange->axis[i]);
        arm->up[i] = urdf_dot(tip->up, flange->axis[i]);
    }
    urdf_snap_direction(arm->view, snap);
    urdf_snap_direction(arm->up, snap);
}

static int urdf_near(const struct urdf_row *row, char why[URDF_WHY_MAX])
{
    if (fabs(row[0].d) <= URDF_FAR)
        return 0;
    snprintf(
        why, URDF_WHY_MAX,
        "the axes of joints '%.63s' and '%.63s' are nearly parallel, which "
        "a table of theta, d, a and alpha cannot say",
        row[0].joint->name, row[1].joint->name);
    return -1;
}

/* The last joint turns the flange as it stands; what is behind it is the tool's. */
int urdf_arm(const struct urdf_chain *chain, double snap, struct urdf_arm *arm,
             char why[URDF_WHY_MAX])
{
    struct urdf_line line[MOTION_ARM_JOINTS_MAX] = { { .at = { 0 } } };
    struct urdf_frame frame = urdf_root;
    struct urdf_tip tip;

    *arm = (struct urdf_arm){ .rows = 0 };
    for (uint32_t i = 0; i < chain->joints; i++) {
        const struct urdf_joint *joint = chain->joint[i];
        urdf_enter(&frame, joint, snap);
        if (!joint->moves)
            continue;
        memcpy(line[arm->rows].at, frame.at, sizeof frame.at);
        urdf_direction(&frame, joint, line[arm->rows].z);
        arm->row[arm->rows++] = (struct urdf_row){ .joint = joint };
    }
    urdf_tip_of(chain, &frame, &tip);
    urdf_base(&line[0], snap, &frame, arm);
    for (uint32_t i = 0; i + 1 < arm->rows; i++) {
        urdf_row(&frame, &line[i + 1], snap, &arm->row[i]);
        if (urdf_near(&arm->row[i], why) < 0)
            return -1;
    }
    urdf_tool(&tip, &frame, snap, arm);
    return 0;
}

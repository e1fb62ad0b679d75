/* firmware/control/gear.c - see gear.h. */
#include "firmware/control/gear.h"

#include <stdbool.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"

/* Of the master, as time of the track. */
static int gear_ns_q12(const struct controller_gear *gear, int64_t distance_q32,
                       int64_t *ns_q12)
{
    const uint8_t shift = controller_cam_shift(gear->low_q32, gear->high_q32);
    return motion_fixed_mulshift(distance_q32, MOTION_FIXED_S_Q12, 32u + shift,
                                 ns_q12);
}

/* The ratio, by time of the track. */
static int gear_slope(const struct controller_gear *gear, int64_t *slope_q32)
{
    const uint8_t shift = controller_cam_shift(gear->low_q32, gear->high_q32);
    return motion_fixed_muldiv(gear->ratio_q32, (int64_t)1 << shift, 1,
                               slope_q32);
}

/* How far it goes with the master, without the blend. */
static int gear_place(int64_t from_q32, int64_t ratio_q32, int64_t distance_q32,
                      int64_t *place_q32)
{
    int64_t way_q32;
    const int err =
        motion_fixed_mulshift(ratio_q32, distance_q32, 32, &way_q32);
    return err < 0 ? err : motion_fixed_add(from_q32, way_q32, place_q32);
}

/* A stretch of the curve: standing, engaging or at the ratio. */
struct gear_stretch {
    int64_t ns_q12, to_q32;
    int64_t slope_q32[2];
};

static int gear_append(struct motion_track *track,
                       const struct gear_stretch *stretch)
{
    const struct motion_state start = { .vel_q32 = stretch->slope_q32[0] };
    const struct motion_state end = { .pos_q32 = stretch->to_q32,
                                      .vel_q32 = stretch->slope_q32[1] };
    if (stretch->slope_q32[0] == stretch->slope_q32[1])
        return motion_track_append_line(track, stretch->ns_q12,
                                        stretch->to_q32);
    return motion_track_append_quintic(track, stretch->ns_q12, &start, &end);
}

/* From low to high, where the master runs towards high. */
static int gear_forwards(const struct controller_gear *gear,
                         struct gear_stretch stretch[], int64_t *first_q32)
{
    const int64_t end_q32 = gear->begin_q32 + gear->over_q32;
    *first_q32 = gear->place_q32;
    stretch[0].to_q32 = gear->place_q32;
    int err = gear_slope(gear, &stretch[1].slope_q32[1]);
    stretch[2].slope_q32[0] = stretch[2].slope_q32[1] = stretch[1].slope_q32[1];
    if (err == MOTION_OK)
        err = gear_ns_q12(gear, gear->begin_q32 - gear->low_q32,
                          &stretch[0].ns_q12);
    if (err == MOTION_OK)
        err = gear_ns_q12(gear, gear->over_q32, &stretch[1].ns_q12);
    if (err == MOTION_OK)
        err = gear_ns_q12(gear, gear->high_q32 - end_q32, &stretch[2].ns_q12);
    if (err == MOTION_OK)
        err = gear_place(gear->place_q32, gear->ratio_q32, gear->over_q32 / 2,
                         &stretch[1].to_q32);
    return err < 0 ? err
                   : gear_place(stretch[1].to_q32, gear->ratio_q32,
                                gear->high_q32 - end_q32, &stretch[2].to_q32);
}

static int gear_backwards(const struct controller_gear *gear,
                          struct gear_stretch stretch[], int64_t *first_q32)
{
    const int64_t end_q32 = gear->begin_q32 - gear->over_q32;
    stretch[1].to_q32 = stretch[2].to_q32 = gear->place_q32;
    int err = gear_slope(gear, &stretch[1].slope_q32[0]);
    stretch[0].slope_q32[0] = stretch[0].slope_q32[1] = stretch[1].slope_q32[0];
    if (err == MOTION_OK)
        err = gear_ns_q12(gear, end_q32 - gear->low_q32, &stretch[0].ns_q12);
    if (err == MOTION_OK)
        err = gear_ns_q12(gear, gear->over_q32, &stretch[1].ns_q12);
    if (err == MOTION_OK)
        err = gear_ns_q12(gear, gear->high_q32 - gear->begin_q32,
                          &stretch[2].ns_q12);
    if (err == MOTION_OK)
        err = gear_place(gear->place_q32, -gear->ratio_q32, gear->over_q32 / 2,
                         &stretch[0].to_q32);
    return err < 0 ? err
                   : gear_place(stretch[0].to_q32, -gear->ratio_q32,
                                end_q32 - gear->low_q32, first_q32);
}

static bool gear_is_one(const struct controller_gear *gear)
{
    const int64_t end_q32 = gear->is_backwards
                                ? gear->begin_q32 - gear->over_q32
                                : gear->begin_q32 + gear->over_q32;
    return gear->ratio_q32 != 0 && gear->over_q32 > 0 &&
           gear->low_q32 < gear->begin_q32 &&
           gear->begin_q32 < gear->high_q32 && gear->low_q32 < end_q32 &&
           end_q32 < gear->high_q32;
}

int controller_gear_cam(const struct controller_gear *gear,
                        struct motion_track *track, struct controller_cam *cam)
{
    struct gear_stretch stretch[CONTROLLER_GEAR_SEGMENTS] = { { 0 } };
    int64_t first_q32 = 0;
    if (!gear_is_one(gear))
        return MOTION_E_ARG;
    int err = gear->is_backwards ? gear_backwards(gear, stretch, &first_q32)
                                 : gear_forwards(gear, stretch, &first_q32);
    if (err < 0)
        return err;
    motion_track_init(track, track->segment, track->capacity, first_q32);
    for (unsigned i = 0; i < CONTROLLER_GEAR_SEGMENTS && err == MOTION_OK; i++)
        err = gear_append(track, &stretch[i]);
    if (err < 0)
        return err;
    cam->track = track;
    cam->low_q32 = gear->low_q32;
    cam->high_q32 = gear->high_q32;
    cam->shift = controller_cam_shift(gear->low_q32, gear->high_q32);
    return controller_cam_init(cam);
}

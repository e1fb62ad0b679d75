/* firmware/host/exchange/export_keys.c - see export_keys.h. */
#include "firmware/host/exchange/export_keys.h"

#include <stdbool.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/exchange/import.h"

static bool export_is_cubic(const struct motion_track *track)
{
    for (uint32_t i = 0; i < track->count; i++)
        if (track->segment[i].degree > 3)
            return false;
    return true;
}

static struct export_keys export_borders(const struct motion_track *track)
{
    struct export_keys keys = { NULL, track->count + 1 };
    struct motion_state in = { 0 }, out = { 0 };

    keys.key = memory_new(keys.count, sizeof *keys.key);
    for (uint32_t i = 0; i <= track->count; i++) {
        struct export_key *key = &keys.key[i];

        key->t_ns_q12 = track->end_ns_q12;
        key->pos_q32 = track->end.pos_q32;
        if (i < track->count) {
            key->t_ns_q12 = track->segment[i].start_ns_q12;
            key->pos_q32 = track->segment[i].pos_q32;
            motion_segment_state(&track->segment[i], 0, &out);
        }
        if (i > 0)
            motion_segment_state(&track->segment[i - 1],
                                 track->segment[i - 1].dur_ns_q12, &in);
        key->in_q32 = i > 0 ? in.vel_q32 : out.vel_q32;
        key->out_q32 = i < track->count ? out.vel_q32 : in.vel_q32;
    }
    return keys;
}

static void export_sample(const struct motion_track *track, int64_t t_ns_q12,
                          struct export_key *key)
{
    struct motion_state state;

    motion_track_state(track, t_ns_q12, &state);
    *key = (struct export_key){ t_ns_q12, state.pos_q32, state.vel_q32,
                                state.vel_q32 };
}

static struct export_keys export_samples(const struct motion_track *track,
                                         const struct units_fps *fps)
{
    uint32_t capacity = 256;
    struct export_keys keys = { memory_new(capacity, sizeof *keys.key), 0 };

    for (int64_t t = 0; t < track->end_ns_q12 && t >= 0;
         t = import_frame_ns_q12(fps, keys.count)) {
        if (keys.count + 2 > capacity) {
            capacity *= 2;
            keys.key = memory_resize(keys.key, capacity, sizeof *keys.key);
        }
        export_sample(track, t, &keys.key[keys.count++]);
    }
    export_sample(track, track->end_ns_q12, &keys.key[keys.count++]);
    return keys;
}

struct export_keys export_keys_of(const struct motion_track *track,
                                  const struct units_fps *fps)
{
    return export_is_cubic(track) ? export_borders(track)
                                  : export_samples(track, fps);
}

/* tests/qemu/golden_tools.c - see golden_tools.h. */
#include "tests/qemu/golden_tools.h"

#include "tests/qemu/start.h"

static uint64_t golden_seed, golden_hash;

void golden_start(uint64_t seed)
{
    golden_seed = seed * UINT64_C(0x9E3779B97F4A7C15);
    golden_hash = UINT64_C(0xCBF29CE484222325);
}

void golden_report(const char *name, uint32_t segments)
{
    start_print_hex((uint32_t)(golden_hash >> 32));
    start_print_hex((uint32_t)golden_hash);
    start_print("  ");
    start_print(name);
    if (segments > 0) {
        start_print(", segments: ");
        start_print_u32(segments);
    }
    start_print("\n");
}

uint64_t golden_random(void)
{
    golden_seed ^= golden_seed << 13;
    golden_seed ^= golden_seed >> 7;
    golden_seed ^= golden_seed << 17;
    return golden_seed;
}

int64_t golden_any(void)
{
    return (int64_t)golden_random();
}

int64_t golden_signed(unsigned bits)
{
    int64_t magnitude = (int64_t)(golden_random() >> (64 - bits));
    return golden_random() & 1 ? -magnitude : magnitude;
}

int64_t golden_below(int64_t below)
{
    return (int64_t)motion_fixed_mulhi_u64(golden_random(), (uint64_t)below);
}

struct motion_real golden_real(unsigned bits)
{
    return motion_real_from_q(golden_signed(bits), 32);
}

void golden_add(int64_t value)
{
    golden_hash ^= (uint64_t)value;
    golden_hash *= UINT64_C(0x100000001B3);
    golden_hash ^= golden_hash >> 29;
}

void golden_add_real(struct motion_real a)
{
    golden_add(a.m);
    golden_add(a.e);
}

void golden_add_bound(const struct motion_bake_bound *bound)
{
    golden_add_real(bound->pos);
    golden_add_real(bound->vel);
    golden_add_real(bound->acc);
}

void golden_add_state(const struct motion_state *state)
{
    golden_add(state->pos_q32);
    golden_add(state->vel_q32);
    golden_add(state->acc_q32);
    golden_add(state->jerk_q32);
}

void golden_add_segments(const struct motion_track *track)
{
    for (uint32_t i = 0; i < track->count; i++) {
        const struct motion_segment *segment = &track->segment[i];
        for (int k = 0; k <= MOTION_TRACK_DEGREE; k++)
            golden_add(segment->coef[k]);
        golden_add(segment->start_ns_q12);
        golden_add(segment->pos_q32);
        golden_add((int64_t)segment->inverse);
        golden_add(segment->frac);
    }
    golden_add_state(&track->end);
}

void golden_add_random_samples(const struct motion_track *track, uint32_t count)
{
    struct motion_cursor cursor = { 0 };
    struct motion_sample sample;

    for (uint32_t i = 0; i < count; i++) {
        motion_track_sample(track, &cursor, golden_below(track->end_ns_q12 + 1),
                            &sample);
        golden_add(sample.pos_q32);
        golden_add(sample.vel_q32);
        golden_add(sample.acc_q32);
    }
}

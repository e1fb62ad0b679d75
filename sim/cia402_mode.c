/* sim/cia402_mode.c - modes of operation: which is in force, and what it makes
 * of the controlword, SYNC, an inner step, and bits 10, 12, 13 of the
 * statusword.  Source: CiA 402-2 8. */
#include "sim/cia402.h"

struct cia402_mode {
    int8_t code;          /* 0x6060 */
    bool cyclic, watched; /* by SYNC; for its following error */
    void (*begin)(struct sim_cia402 *self);
    void (*control)(struct sim_cia402 *self);
    void (*latch)(struct sim_cia402 *self);
    void (*step)(struct sim_cia402 *self, int64_t dt_ns);
    void (*watch)(struct sim_cia402 *self, int64_t dt_ns); /* after it */
    unsigned (*status)(const struct sim_cia402 *self);
};

static void cia402_mode_nothing(struct sim_cia402 *self)
{
    (void)self;
}

static void cia402_mode_no_step(struct sim_cia402 *self, int64_t dt_ns)
{
    (void)self;
    (void)dt_ns;
}

static unsigned cia402_mode_no_bits(const struct sim_cia402 *self)
{
    (void)self;
    return 0;
}

static void cia402_mode_stand(struct sim_cia402 *self)
{
    cia402_motion_stand(self);
}

/* clang-format off */
static const struct cia402_mode cia402_modes[] = {
    { 0, false, true, cia402_mode_stand, cia402_mode_nothing,
      cia402_mode_nothing, cia402_mode_no_step, cia402_mode_no_step,
      cia402_mode_no_bits },
    { 1, false, true, cia402_profile_begin, cia402_profile_control_pp,
      cia402_mode_nothing, cia402_profile_step_pp, cia402_profile_watch_pp,
      cia402_profile_status_pp },
    { 3, false, false, cia402_profile_begin, cia402_mode_nothing,
      cia402_mode_nothing, cia402_profile_step_pv, cia402_profile_watch_pv,
      cia402_profile_status_pv },
    { 6, false, true, cia402_home_begin, cia402_home_control,
      cia402_mode_nothing, cia402_home_step, cia402_mode_no_step,
      cia402_home_status },
    { 7, true, true, cia402_mode_nothing, cia402_mode_nothing,
      cia402_stream_latch_ip, cia402_stream_step, cia402_mode_no_step,
      cia402_stream_status_ip },
    { 8, true, true, cia402_mode_nothing, cia402_mode_nothing,
      cia402_stream_latch_csp, cia402_stream_step, cia402_mode_no_step,
      cia402_stream_status },
    { 9, true, false, cia402_mode_nothing, cia402_mode_nothing,
      cia402_stream_latch_csv, cia402_stream_step_velocity,
      cia402_mode_no_step, cia402_stream_status },
};
/* clang-format on */

static const struct cia402_mode *cia402_mode_find(int8_t code)
{
    for (unsigned i = 0; i < ARRAY_LEN(cia402_modes); i++)
        if (cia402_modes[i].code == code)
            return &cia402_modes[i];
    return NULL;
}

/* Of the one in force. */
static const struct cia402_mode *cia402_mode_of(const struct sim_cia402 *self)
{
    return cia402_mode_find(self->mode);
}

bool cia402_mode_exists(int8_t code)
{
    return cia402_mode_find(code) != NULL;
}

static bool cia402_mode_may_change(const struct sim_cia402 *self)
{
    return self->motion == CIA402_MOTION_OFF ||
           (self->power == CIA402_POWER_ENABLED &&
            cia402_motion_is_resting(self));
}

void cia402_mode_update(struct sim_cia402 *self)
{
    const int8_t wanted = (int8_t)cia402_od_signed(self, CIA402_MODE);

    if (wanted != self->mode && cia402_mode_may_change(self)) {
        self->mode = wanted;
        if (self->power == CIA402_POWER_ENABLED && !self->halted) {
            cia402_motion_stop_watching(self);
            cia402_motion_follow(self);
        }
        if (self->power == CIA402_POWER_ENABLED)
            cia402_mode_begin(self);
    }
    self->value[CIA402_MODE_DISPLAY] = (uint8_t)self->mode;
}

void cia402_mode_begin(struct sim_cia402 *self)
{
    cia402_mode_of(self)->begin(self);
}

void cia402_mode_control(struct sim_cia402 *self)
{
    cia402_mode_of(self)->control(self);
}

void cia402_mode_latch(struct sim_cia402 *self)
{
    if (self->motion == CIA402_MOTION_FOLLOW)
        cia402_mode_of(self)->latch(self);
}

void cia402_mode_step(struct sim_cia402 *self, int64_t dt_ns)
{
    cia402_mode_of(self)->step(self, dt_ns);
}

void cia402_mode_watch(struct sim_cia402 *self, int64_t dt_ns)
{
    cia402_mode_of(self)->watch(self, dt_ns);
}

unsigned cia402_mode_status(const struct sim_cia402 *self)
{
    return cia402_mode_of(self)->status(self);
}

bool cia402_mode_watches(const struct sim_cia402 *self)
{
    return self->motion != CIA402_MOTION_FOLLOW ||
           cia402_mode_of(self)->watched;
}

bool cia402_mode_is_cyclic(const struct sim_cia402 *self)
{
    return cia402_mode_of(self)->cyclic;
}

/* sim/device/cia402/mode.c - modes of operation: which is in force, and what it
 * makes of the controlword, SYNC, an inner step, and bits 10, 12, 13 of the
 * statusword.  Source: CiA 402-2 8. */
#include "sim/device/cia402/parts.h"

/* NULL: there is nothing to do. */
struct cia402_mode {
    bool exists;
    bool cyclic, watched; /* by SYNC; for its following error */
    void (*begin)(struct sim_cia402 *self);
    void (*control)(struct sim_cia402 *self);
    void (*latch)(struct sim_cia402 *self);
    void (*step)(struct sim_cia402 *self, int64_t dt_ns);
    void (*watch)(struct sim_cia402 *self, int64_t dt_ns); /* after it */
    unsigned (*status)(const struct sim_cia402 *self);
};

/* By 0x6060. */
static const struct cia402_mode cia402_modes[] = {
    [0] = { .exists = true, .watched = true, .begin = cia402_motion_stand },
    [1] = { .exists = true,
            .watched = true,
            .begin = cia402_profile_begin,
            .control = cia402_profile_control_pp,
            .step = cia402_profile_step_pp,
            .watch = cia402_profile_watch_pp,
            .status = cia402_profile_status_pp },
    [3] = { .exists = true,
            .begin = cia402_profile_begin,
            .step = cia402_profile_step_pv,
            .watch = cia402_profile_watch_pv,
            .status = cia402_profile_status_pv },
    [6] = { .exists = true,
            .watched = true,
            .begin = cia402_home_begin,
            .control = cia402_home_control,
            .step = cia402_home_step,
            .status = cia402_home_status },
    [7] = { .exists = true,
            .cyclic = true,
            .watched = true,
            .latch = cia402_stream_latch_ip,
            .step = cia402_stream_step,
            .status = cia402_stream_status_ip },
    [8] = { .exists = true,
            .cyclic = true,
            .watched = true,
            .latch = cia402_stream_latch_csp,
            .step = cia402_stream_step,
            .status = cia402_stream_status },
    [9] = { .exists = true,
            .cyclic = true,
            .latch = cia402_stream_latch_csv,
            .step = cia402_stream_step_velocity,
            .status = cia402_stream_status },
};

static const struct cia402_mode *cia402_mode_find(int8_t code)
{
    const bool exists = code >= 0 && (unsigned)code < ARRAY_LEN(cia402_modes) &&
                        cia402_modes[code].exists;

    return exists ? &cia402_modes[code] : NULL;
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

static void cia402_mode_act(struct sim_cia402 *self,
                            void (*act)(struct sim_cia402 *self))
{
    if (act != NULL)
        act(self);
}

void cia402_mode_begin(struct sim_cia402 *self)
{
    cia402_mode_act(self, cia402_mode_of(self)->begin);
}

void cia402_mode_control(struct sim_cia402 *self)
{
    cia402_mode_act(self, cia402_mode_of(self)->control);
}

void cia402_mode_latch(struct sim_cia402 *self)
{
    if (self->motion == CIA402_MOTION_FOLLOW)
        cia402_mode_act(self, cia402_mode_of(self)->latch);
}

static void cia402_mode_go_on(struct sim_cia402 *self, int64_t dt_ns,
                              void (*go_on)(struct sim_cia402 *self,
                                            int64_t dt_ns))
{
    if (go_on != NULL)
        go_on(self, dt_ns);
}

void cia402_mode_step(struct sim_cia402 *self, int64_t dt_ns)
{
    cia402_mode_go_on(self, dt_ns, cia402_mode_of(self)->step);
}

void cia402_mode_watch(struct sim_cia402 *self, int64_t dt_ns)
{
    cia402_mode_go_on(self, dt_ns, cia402_mode_of(self)->watch);
}

unsigned cia402_mode_status(const struct sim_cia402 *self)
{
    const struct cia402_mode *mode = cia402_mode_of(self);

    return mode->status != NULL ? mode->status(self) : 0;
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

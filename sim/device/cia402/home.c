/* sim/device/cia402/home.c - homing (CiA 402-2 9).
 *
 *   SEEK   fast, until the switch is active; at a limit switch it may turn
 *   LEAVE  slowly, against the last way, until the switch lets go
 *   FINAL  slowly over the edge of the switch that counts
 *   INDEX  slowly on to the next index pulse
 *   STOP   standing still; then done
 *
 * A method is which of these it needs and which way it goes.  Methods 17 to 30
 * are 1 to 14 without INDEX.  Bit 4 starts with its edge and has to stay. */
#include "sim/device/cia402/parts.h"

#define CIA402_CW_START  0x0010
#define CIA402_SW_STANDS 0x0400
#define CIA402_SW_HOMED  0x1000
#define CIA402_SW_FAILED 0x2000
#define CIA402_NO_INDEX  16 /* from a method with to that without */

enum cia402_home_phase {
    CIA402_HOME_IDLE,
    CIA402_HOME_SEEK,
    CIA402_HOME_LEAVE,
    CIA402_HOME_FINAL,
    CIA402_HOME_INDEX,
    CIA402_HOME_STOP,
};

/* Where FINAL has to begin. */
enum cia402_home_from {
    CIA402_HOME_INSIDE,  /* of the switch */
    CIA402_HOME_BESIDE,  /* it, on the side away from FINAL's way */
    CIA402_HOME_OUTSIDE, /* outside is enough: there is one side */
    CIA402_HOME_ANYWHERE /* no switch: INDEX at once */
};

struct cia402_home_method {
    int8_t code;
    uint32_t input;
    int8_t seek, final; /* which way */
    enum cia402_home_from from;
    bool turns; /* at a limit switch */
};

/* clang-format off */
static const struct cia402_home_method cia402_home_methods[] = {
    { 1, CIA402_INPUT_NEGATIVE, -1, 1, CIA402_HOME_INSIDE, false },
    { 2, CIA402_INPUT_POSITIVE, 1, -1, CIA402_HOME_INSIDE, false },
    { 3, CIA402_INPUT_HOME, 1, -1, CIA402_HOME_INSIDE, false },
    { 4, CIA402_INPUT_HOME, 1, 1, CIA402_HOME_OUTSIDE, false },
    { 5, CIA402_INPUT_HOME, -1, 1, CIA402_HOME_INSIDE, false },
    { 6, CIA402_INPUT_HOME, -1, -1, CIA402_HOME_OUTSIDE, false },
    { 7, CIA402_INPUT_HOME, 1, -1, CIA402_HOME_INSIDE, true },
    { 8, CIA402_INPUT_HOME, 1, 1, CIA402_HOME_BESIDE, true },
    { 9, CIA402_INPUT_HOME, 1, -1, CIA402_HOME_BESIDE, true },
    { 10, CIA402_INPUT_HOME, 1, 1, CIA402_HOME_INSIDE, true },
    { 11, CIA402_INPUT_HOME, -1, 1, CIA402_HOME_INSIDE, true },
    { 12, CIA402_INPUT_HOME, -1, -1, CIA402_HOME_BESIDE, true },
    { 13, CIA402_INPUT_HOME, -1, 1, CIA402_HOME_BESIDE, true },
    { 14, CIA402_INPUT_HOME, -1, -1, CIA402_HOME_INSIDE, true },
    { 33, 0, -1, -1, CIA402_HOME_ANYWHERE, false },
    { 34, 0, 1, 1, CIA402_HOME_ANYWHERE, false },
};
/* clang-format on */

static bool cia402_home_is_here(int8_t code)
{
    return code == 35 || code == 37;
}

static const struct cia402_home_method *cia402_home_find(int8_t code)
{
    if (code > CIA402_NO_INDEX && code <= CIA402_NO_INDEX + 14)
        code = (int8_t)(code - CIA402_NO_INDEX);
    for (unsigned i = 0; i < ARRAY_LEN(cia402_home_methods); i++)
        if (cia402_home_methods[i].code == code)
            return &cia402_home_methods[i];
    return NULL;
}

static int8_t cia402_home_code(const struct sim_cia402 *self)
{
    return (int8_t)cia402_od_signed(self, CIA402_HOMING_METHOD);
}

static bool cia402_home_uses_index(const struct sim_cia402 *self)
{
    const int8_t code = cia402_home_code(self);

    return code < CIA402_NO_INDEX || code > CIA402_NO_INDEX + 14;
}

uint32_t cia402_home_check(const struct sim_cia402 *self, int8_t method)
{
    if (self->mode == 6 && self->homing.phase != CIA402_HOME_IDLE)
        return CIA402_ABORT_DEVICE_STATE;
    return method == 0 || cia402_home_is_here(method) ||
                   cia402_home_find(method) != NULL
               ? CIA402_DONE
               : CIA402_ABORT_RANGE;
}

void cia402_home_begin(struct sim_cia402 *self)
{
    self->homing.phase = CIA402_HOME_IDLE;
    self->homing.failed = false;
}

/* ---- phases ------------------------------------------------------------ */

static void cia402_home_enter(struct sim_cia402 *self,
                              enum cia402_home_phase phase, int8_t direction)
{
    self->homing.phase = (uint8_t)phase;
    self->homing.direction = direction;
    self->homing.seen = false;
}

static void cia402_home_fail(struct sim_cia402 *self)
{
    self->homing.failed = true;
    cia402_home_enter(self, CIA402_HOME_STOP, 0);
}

/* The home point is where the plant says. */
static void cia402_home_attain(struct sim_cia402 *self, int64_t home_q24)
{
    self->zero_counts = cia402_motion_counts(home_q24) -
                        cia402_od_signed(self, CIA402_HOME_OFFSET);
    self->homing.attained = true;
    cia402_home_enter(self, CIA402_HOME_STOP, 0);
}

static void cia402_home_index(struct sim_cia402 *self, int8_t direction)
{
    if (self->config.rail.index_every == 0)
        cia402_home_fail(self);
    else
        cia402_home_enter(self, CIA402_HOME_INDEX, direction);
}

/* From where it stands: SEEK, LEAVE or FINAL first. */
static void cia402_home_set_out(struct sim_cia402 *self,
                                const struct cia402_home_method *method)
{
    const bool active = (cia402_inputs(self) & method->input) != 0;

    if (method->from == CIA402_HOME_ANYWHERE)
        cia402_home_index(self, method->final);
    else if (!active && method->from != CIA402_HOME_OUTSIDE)
        cia402_home_enter(self, CIA402_HOME_SEEK, method->seek);
    else if (active && method->from != CIA402_HOME_INSIDE)
        cia402_home_enter(self, CIA402_HOME_LEAVE, (int8_t)-method->final);
    else
        cia402_home_enter(self, CIA402_HOME_FINAL, method->final);
}

static void cia402_home_start(struct sim_cia402 *self)
{
    const int8_t code = cia402_home_code(self);
    const struct cia402_home_method *method = cia402_home_find(code);

    self->homing = (struct sim_cia402_homing){
        .last_q24 = self->base.plant.pos_q24,
    };
    if (cia402_home_is_here(code))
        cia402_home_attain(self, self->base.plant.pos_q24);
    else if (method == NULL)
        cia402_home_fail(self);
    else
        cia402_home_set_out(self, method);
}

void cia402_home_control(struct sim_cia402 *self)
{
    const bool start = (self->controlword & CIA402_CW_START) != 0;
    const bool before = (self->controlword_before & CIA402_CW_START) != 0;

    if (start && !before)
        cia402_home_start(self);
    else if (!start)
        self->homing.phase = CIA402_HOME_IDLE; /* interrupted, or taken note */
}

/* The switch goes away from `level` while the axis moves the right way. */
static bool cia402_home_crosses(struct sim_cia402 *self, bool active,
                                bool level)
{
    struct sim_cia402_homing *homing = &self->homing;

    if ((self->base.plant.vel_q24 > 0) != (homing->direction > 0))
        return false;
    if (active == level)
        homing->seen = true;
    return homing->seen && active != level;
}

static bool cia402_home_is_at_limit(const struct sim_cia402 *self)
{
    return (cia402_inputs(self) &
            (self->homing.direction > 0 ? CIA402_INPUT_POSITIVE
                                        : CIA402_INPUT_NEGATIVE)) != 0;
}

static void cia402_home_seek(struct sim_cia402 *self,
                             const struct cia402_home_method *method,
                             bool active)
{
    struct sim_cia402_homing *homing = &self->homing;

    if (active && method->from == CIA402_HOME_INSIDE) {
        cia402_home_enter(self, CIA402_HOME_FINAL, method->final);
    } else if (active) {
        cia402_home_enter(self, CIA402_HOME_LEAVE, (int8_t)-method->final);
    } else if (cia402_home_is_at_limit(self)) {
        if (!method->turns || homing->turned)
            cia402_home_fail(self);
        homing->turned = true;
        homing->direction = (int8_t)-homing->direction;
    }
}

static void cia402_home_edge(struct sim_cia402 *self,
                             const struct cia402_home_method *method,
                             bool active)
{
    const bool leaving = self->homing.phase == CIA402_HOME_LEAVE;
    const bool level = leaving || method->from == CIA402_HOME_INSIDE;

    if (!cia402_home_crosses(self, active, level)) {
        if (!active && cia402_home_is_at_limit(self))
            cia402_home_fail(self);
    } else if (leaving) {
        cia402_home_enter(self, CIA402_HOME_FINAL, method->final);
    } else if (cia402_home_uses_index(self)) {
        cia402_home_index(self, method->final);
    } else {
        cia402_home_attain(self, self->base.plant.pos_q24);
    }
}

/* The pulse between the last step and this one. */
static void cia402_home_pulse(struct sim_cia402 *self)
{
    const int64_t every_q24 = (int64_t)self->config.rail.index_every << 24;
    const int64_t before = cia402_inputs_index(self, self->homing.last_q24);
    const int64_t now = cia402_inputs_index(self, self->base.plant.pos_q24);

    if (now != before && (now > before) == (self->homing.direction > 0))
        cia402_home_attain(self, (now > before ? now : before) * every_q24);
    else if (cia402_home_is_at_limit(self))
        cia402_home_fail(self);
}

static void cia402_home_look(struct sim_cia402 *self)
{
    const struct cia402_home_method *method =
        cia402_home_find(cia402_home_code(self));
    bool active;

    if (method == NULL) /* here: nothing to look for */
        return;
    active = (cia402_inputs(self) & method->input) != 0;
    if (self->homing.phase == CIA402_HOME_SEEK)
        cia402_home_seek(self, method, active);
    else if (self->homing.phase == CIA402_HOME_LEAVE ||
             self->homing.phase == CIA402_HOME_FINAL)
        cia402_home_edge(self, method, active);
    else if (self->homing.phase == CIA402_HOME_INDEX)
        cia402_home_pulse(self);
    self->homing.last_q24 = self->base.plant.pos_q24;
}

void cia402_home_step(struct sim_cia402 *self, int64_t dt_ns)
{
    const bool seeking = self->homing.phase == CIA402_HOME_SEEK;
    const int64_t speed_q24 =
        (int64_t)self->value[seeking ? CIA402_HOMING_FAST : CIA402_HOMING_SLOW]
        << 24;
    const bool moving = self->homing.phase != CIA402_HOME_IDLE &&
                        self->homing.phase != CIA402_HOME_STOP;

    if (moving)
        cia402_home_look(self);
    self->profile.acc_q8 = (int64_t)self->value[CIA402_HOMING_ACCELERATION]
                           << 8;
    self->profile.dec_q8 = self->profile.acc_q8;
    cia402_profile_run(self, moving ? self->homing.direction * speed_q24 : 0,
                       dt_ns);
}

unsigned cia402_home_status(const struct sim_cia402 *self)
{
    const struct sim_cia402_homing *homing = &self->homing;
    const bool running =
        homing->phase != CIA402_HOME_IDLE && homing->phase != CIA402_HOME_STOP;
    const bool stands = !running && cia402_motion_is_resting(self);

    return (stands ? CIA402_SW_STANDS : 0) |
           (homing->attained ? CIA402_SW_HOMED : 0) |
           (homing->failed ? CIA402_SW_FAILED : 0);
}

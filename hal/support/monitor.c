/* hal/support/monitor.c - see monitor.h. */
#include "hal/support/monitor.h"

#include <string.h>

#include "hal/support/container_of.h"
#include "hal/support/text.h"

#define MISSING_NS (3 * HAL_READING_NS)

#define CODE_TEMPERATURE   0x4310
#define CODE_OVER_VOLTAGE  0x3210
#define CODE_UNDER_VOLTAGE 0x3220
#define CODE_CURRENT       0x2310
#define CODE_MISSING       0x7300

static struct drive_monitor *monitor_of(struct hal_drive *drive)
{
    return CONTAINER_OF(drive, struct drive_monitor, drive);
}

/* ---- values ---- */

/* What is compared with the limits. */
static int32_t monitor_milli(const struct drive_monitor *self,
                             enum hal_reading reading)
{
    const int32_t milli = self->readings->value[reading].milli;

    return reading == HAL_READING_CURRENT && milli < 0 ? -milli : milli;
}

/* Low is none while the DC link may not be charged. */
static bool monitor_is_beyond(const struct drive_monitor *self,
                              enum hal_reading reading,
                              const struct drive_monitor_limit *limit)
{
    const int32_t milli = monitor_milli(self, reading);
    const bool has_low =
        self->has_power && self->readings->value[reading].t_ns > self->power_ns;

    return milli >= limit->high_milli || (has_low && milli <= limit->low_milli);
}

bool drive_monitor_level(const struct drive_monitor *self,
                         enum hal_reading reading,
                         struct drive_monitor_level *level)
{
    const struct drive_monitor_limit *limit = &self->of[reading].limit;
    const int32_t milli = monitor_milli(self, reading);

    if (!hal_readings_want(self->readings, reading) ||
        self->readings->value[reading].t_ns == 0)
        return false;
    *level = (struct drive_monitor_level){
        .milli = milli,
        .limit_milli = limit->high_milli,
        .is_over = monitor_is_beyond(self, reading, &self->of[reading].warn),
        .is_below = !monitor_is_beyond(self, reading, &self->of[reading].rest),
    };
    if (limit->low_milli != INT32_MIN &&
        (int64_t)milli - limit->low_milli < (int64_t)limit->high_milli - milli)
        level->limit_milli = limit->low_milli;
    return true;
}

/* ---- a fault ---- */

/* "81.2"; rounded down. */
static void monitor_put_milli(struct hal_text *text, int32_t milli)
{
    const uint32_t size = milli < 0 ? 0u - (uint32_t)milli : (uint32_t)milli;
    uint32_t whole = 0;

    for (unsigned bit = 22; bit-- > 0;) /* 1000 x 2^21 is above 2^31 / 2 */
        if (((uint64_t)(whole + (UINT32_C(1) << bit))) * 1000 <= size)
            whole += UINT32_C(1) << bit;
    uint32_t tenth = 0;
    while ((tenth + 1) * 100 <= size - whole * 1000)
        tenth++;
    if (milli < 0)
        hal_text_put(text, "-");
    hal_text_dec(text, whole);
    hal_text_put(text, ".");
    hal_text_dec(text, tenth);
}

static void monitor_put_value(struct hal_text *text, const char *words,
                              enum hal_reading reading, int32_t milli)
{
    hal_text_put(text, words);
    monitor_put_milli(text, milli);
    hal_text_put(text, " ");
    hal_text_put(text, hal_reading_unit(reading));
}

static uint16_t monitor_code(enum hal_reading reading, bool is_low)
{
    switch (reading) {
    case HAL_READING_TEMPERATURE:
        return CODE_TEMPERATURE;
    case HAL_READING_VOLTAGE:
        return is_low ? CODE_UNDER_VOLTAGE : CODE_OVER_VOLTAGE;
    case HAL_READING_CURRENT:
    case HAL_READINGS:
        break;
    }
    return CODE_CURRENT;
}

/* What it does by itself ends by itself. */
static void monitor_latch(struct drive_monitor *self, uint16_t code)
{
    struct hal_drive_feedback feedback;

    self->fault_code = code;
    hal_drive_feedback(self->inner, &feedback);
    if (feedback.state == HAL_DRIVE_ENABLED &&
        feedback.mode != HAL_DRIVE_STREAM_POSITION &&
        feedback.mode != HAL_DRIVE_STREAM_VELOCITY)
        hal_drive_request(self->inner, HAL_DRIVE_REQUEST_QUICK_STOP);
}

/* "temperature 81.2 degC, limit 80.0 degC". */
static void monitor_latch_limit(struct drive_monitor *self,
                                enum hal_reading reading)
{
    const struct drive_monitor_limit *limit = &self->of[reading].limit;
    const int32_t milli = monitor_milli(self, reading);
    const bool is_low = milli <= limit->low_milli;
    struct hal_text text;

    hal_text_init(&text, self->fault_text, sizeof self->fault_text);
    hal_text_put(&text, hal_reading_text(reading));
    monitor_put_value(&text, " ", reading, milli);
    monitor_put_value(&text, ", limit ", reading,
                      is_low ? limit->low_milli : limit->high_milli);
    monitor_latch(self, monitor_code(reading, is_low));
}

static void monitor_latch_missing(struct drive_monitor *self,
                                  enum hal_reading reading)
{
    struct hal_text text;

    hal_text_init(&text, self->fault_text, sizeof self->fault_text);
    hal_text_put(&text, hal_reading_text(reading));
    hal_text_put(&text, ": no value for three periods");
    monitor_latch(self, CODE_MISSING);
}

/* ---- judging ---- */

static bool monitor_is_missing(const struct drive_monitor *self,
                               enum hal_reading reading)
{
    const int64_t heard_ns = self->readings->value[reading].t_ns;
    int64_t since_ns = heard_ns > self->online_ns ? heard_ns : self->online_ns;

    if (self->readings->from_ns > since_ns)
        since_ns = self->readings->from_ns;
    return self->now_ns - since_ns > (self->readings->missing_ns > 0
                                          ? self->readings->missing_ns
                                          : MISSING_NS);
}

/* Once per answer: is this the second one in a row that is at the limit? */
static bool monitor_is_at_limit(struct drive_monitor *self,
                                enum hal_reading reading)
{
    const int64_t heard_ns = self->readings->value[reading].t_ns;
    int64_t *over_ns = &self->of[reading].over_ns;

    if (heard_ns <= self->online_ns)
        return false; /* of before */
    if (!monitor_is_beyond(self, reading, &self->of[reading].limit)) {
        *over_ns = 0;
        return false;
    }
    if (*over_ns == 0)
        *over_ns = heard_ns;
    return heard_ns > *over_ns;
}

static void monitor_note_power(struct drive_monitor *self,
                               enum hal_drive_state state)
{
    const bool has_power =
        state == HAL_DRIVE_ENABLED || state == HAL_DRIVE_QUICK_STOP;

    if (has_power && !self->has_power)
        self->power_ns = self->now_ns;
    self->has_power = has_power;
}

void drive_monitor_step(struct drive_monitor *self, int64_t now_ns)
{
    struct hal_drive_feedback feedback;

    self->now_ns = now_ns;
    hal_drive_feedback(self->inner, &feedback);
    monitor_note_power(self, feedback.state);
    if (feedback.state == HAL_DRIVE_OFFLINE || !self->online) {
        self->online = feedback.state != HAL_DRIVE_OFFLINE;
        self->online_ns = now_ns;
        for (unsigned i = 0; i < HAL_READINGS; i++)
            self->of[i].over_ns = 0;
        return;
    }
    for (unsigned i = 0; i < HAL_READINGS; i++) {
        const enum hal_reading reading = (enum hal_reading)i;

        if (!hal_readings_want(self->readings, reading))
            continue;
        const bool is_at_limit = monitor_is_at_limit(self, reading);
        if (self->fault_code != 0)
            continue;
        if (is_at_limit)
            monitor_latch_limit(self, reading);
        else if (monitor_is_missing(self, reading))
            monitor_latch_missing(self, reading);
    }
}

bool drive_monitor_is_latched(const struct drive_monitor *self)
{
    return self->fault_code != 0;
}

/* ---- as a drive ---- */

static bool monitor_is_well(const struct drive_monitor *self)
{
    for (unsigned i = 0; i < HAL_READINGS; i++) {
        const enum hal_reading reading = (enum hal_reading)i;

        if (hal_readings_want(self->readings, reading) &&
            (monitor_is_missing(self, reading) ||
             monitor_is_beyond(self, reading, &self->of[i].limit)))
            return false;
    }
    return true;
}

/* In fault it takes no request but to lose its torque, or to be reset. */
static void monitor_request(struct hal_drive *drive,
                            enum hal_drive_request request)
{
    struct drive_monitor *self = monitor_of(drive);

    if (request == HAL_DRIVE_REQUEST_ENABLE && self->fault_code != 0)
        return;
    if (request == HAL_DRIVE_REQUEST_RESET && self->fault_code != 0) {
        hal_drive_request(self->inner, HAL_DRIVE_REQUEST_OFF);
        if (monitor_is_well(self))
            self->fault_code = 0;
    }
    hal_drive_request(self->inner, request);
}

static int monitor_set_target(struct hal_drive *drive,
                              const struct hal_drive_target *target)
{
    return hal_drive_set_target(monitor_of(drive)->inner, target);
}

static void monitor_feedback(struct hal_drive *drive,
                             struct hal_drive_feedback *feedback)
{
    const struct drive_monitor *self = monitor_of(drive);

    hal_drive_feedback(self->inner, feedback);
    if (self->fault_code == 0 || feedback->state == HAL_DRIVE_FAULT ||
        feedback->state == HAL_DRIVE_OFFLINE)
        return;
    feedback->state = HAL_DRIVE_FAULT;
    feedback->following = false;
    feedback->fault_code = self->fault_code;
    memcpy(feedback->fault_text, self->fault_text, sizeof self->fault_text);
}

static unsigned monitor_modes(struct hal_drive *drive)
{
    return hal_drive_modes(monitor_of(drive)->inner);
}

static int monitor_set_mode(struct hal_drive *drive, enum hal_drive_mode mode)
{
    struct drive_monitor *self = monitor_of(drive);

    return self->fault_code != 0 ? MOTION_E_STATE
                                 : hal_drive_set_mode(self->inner, mode);
}

static int monitor_go(struct hal_drive *drive, const struct hal_drive_go *go)
{
    struct drive_monitor *self = monitor_of(drive);

    return self->fault_code != 0 ? MOTION_E_STATE
                                 : hal_drive_go(self->inner, go);
}

static int monitor_home(struct hal_drive *drive,
                        const struct hal_drive_home *home)
{
    struct drive_monitor *self = monitor_of(drive);

    return self->fault_code != 0 ? MOTION_E_STATE
                                 : hal_drive_home(self->inner, home);
}

static int monitor_halt(struct hal_drive *drive)
{
    return hal_drive_halt(monitor_of(drive)->inner);
}

static int monitor_probe(struct hal_drive *drive, enum hal_drive_probe probe)
{
    return hal_drive_probe(monitor_of(drive)->inner, probe);
}

static const struct hal_drive_found *monitor_found(struct hal_drive *drive)
{
    struct hal_drive *inner = monitor_of(drive)->inner;

    return inner->ops->found(inner);
}

static struct hal_drive_ops monitor_ops(const struct hal_drive_ops *inner)
{
    return (struct hal_drive_ops){
        .request = monitor_request,
        .set_target = monitor_set_target,
        .feedback = monitor_feedback,
        .modes = inner->modes != NULL ? monitor_modes : NULL,
        .set_mode = inner->set_mode != NULL ? monitor_set_mode : NULL,
        .go = inner->go != NULL ? monitor_go : NULL,
        .home = inner->home != NULL ? monitor_home : NULL,
        .halt = inner->halt != NULL ? monitor_halt : NULL,
        .probe = inner->probe != NULL ? monitor_probe : NULL,
        .found = inner->found != NULL ? monitor_found : NULL,
    };
}

/* ---- init: this part divides ---- */

/* So many hundredths of the way to the limit. */
static struct drive_monitor_limit
monitor_part(const struct drive_monitor_limit *limit, int32_t percent)
{
    const int64_t low = limit->low_milli, high = limit->high_milli;

    if (limit->low_milli == INT32_MIN || limit->high_milli == INT32_MAX)
        return (struct drive_monitor_limit){
            limit->low_milli == INT32_MIN
                ? INT32_MIN
                : (int32_t)(low + low * (100 - percent) / 100),
            limit->high_milli == INT32_MAX ? INT32_MAX
                                           : (int32_t)(high * percent / 100),
        };
    return (struct drive_monitor_limit){
        (int32_t)((low + high - (high - low) * percent / 100) / 2),
        (int32_t)((low + high + (high - low) * percent / 100) / 2),
    };
}

static bool monitor_is_legal(enum hal_reading reading,
                             const struct drive_monitor_limit *limit)
{
    if (reading == HAL_READING_VOLTAGE)
        return limit->low_milli < limit->high_milli;
    return limit->low_milli == INT32_MIN && limit->high_milli > 0;
}

int drive_monitor_init(struct drive_monitor *self, struct hal_drive *inner,
                       struct hal_readings *readings,
                       const struct drive_monitor_limit limit[HAL_READINGS])
{
    *self = (struct drive_monitor){ .inner = inner, .readings = readings };
    for (unsigned i = 0; i < HAL_READINGS; i++) {
        if (!hal_readings_want(readings, (enum hal_reading)i))
            continue;
        if (!monitor_is_legal((enum hal_reading)i, &limit[i]))
            return MOTION_E_ARG;
        self->of[i].limit = limit[i];
        self->of[i].warn = monitor_part(&limit[i], 90);
        self->of[i].rest = monitor_part(&limit[i], 85);
    }
    self->ops = monitor_ops(inner->ops);
    self->drive.ops = &self->ops;
    return MOTION_OK;
}

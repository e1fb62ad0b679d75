/* hal/drive/odrive/start.c - from silence to off; see drive.h.
 *
 *   heartbeat -> version (asked twice, 100 ms each: 0.5 is silent) ->
 *   parameters, each written and read back -> a position
 */
#include "hal/drive/odrive/parts.h"

#include "hal/support/container_of.h"
#include "hal/support/float32.h"

#define MS        INT64_C(1000000)
#define ANSWER_NS (100 * MS)
#define TRIES     2u
#define WRITES    3u /* of a parameter, each with reading back */

#define SDO_READ  0u
#define SDO_WRITE 1u

static struct drive_odrive *odrive_of(struct drive_turn *turn)
{
    return CONTAINER_OF(turn, struct drive_odrive, turn);
}

void odrive_start(struct drive_turn *turn)
{
    struct drive_odrive *self = odrive_of(turn);

    self->start = DRIVE_ODRIVE_HEARTBEAT;
    self->heartbeat_ns = 0;
    self->requested_ns = 0;
    self->tries = 0;
    self->parameter = 0;
    self->is_nan = false;
    self->error = 0;
    self->reason = 0;
    self->family = self->config.family;
}

static void odrive_start_next(struct drive_odrive *self,
                              enum drive_odrive_start start)
{
    self->start = start;
    self->requested_ns = 0;
    self->tries = 0;
}

/* Has the last question waited long enough, or was there none yet? */
static bool odrive_is_time(struct drive_odrive *self)
{
    if (self->requested_ns != 0 &&
        self->turn.now_ns - self->requested_ns < ANSWER_NS)
        return false;
    self->requested_ns = self->turn.now_ns;
    return true;
}

static bool odrive_has_watchdog(const struct drive_odrive *self)
{
    return self->config.watchdog_timeout != 0;
}

/* ---- version ---- */

static int odrive_step_version(struct drive_odrive *self)
{
    if (self->family != DRIVE_ODRIVE_REQUEST) {
        odrive_start_next(self, DRIVE_ODRIVE_PARAMETERS);
    } else if (odrive_is_time(self)) {
        if (self->tries++ < TRIES)
            odrive_request(self, ODRIVE_GET_VERSION);
        else
            self->family = DRIVE_ODRIVE_05;
    }
    return MOTION_E_AGAIN;
}

void odrive_take_version(struct drive_odrive *self, const uint8_t data[8])
{
    for (unsigned i = 0; i < 8; i++)
        self->version[i] = data[i];
    if (self->start == DRIVE_ODRIVE_VERSION &&
        self->family == DRIVE_ODRIVE_REQUEST)
        self->family = DRIVE_ODRIVE_06;
}

/* ---- parameters ---- */

/* The time first: enabling with none would trip at once. */
static void odrive_parameter(const struct drive_odrive *self,
                             uint16_t *endpoint, uint32_t *value)
{
    const bool enable = self->parameter == 1;

    *endpoint =
        enable ? self->config.enable_watchdog : self->config.watchdog_timeout;
    *value = enable ? 1 : self->watchdog_s;
}

/* Byte 0 is the whole of a truth value; the rest of the four is undefined. */
static uint32_t odrive_parameter_mask(const struct drive_odrive *self)
{
    return self->parameter == 1 ? UINT32_C(0xFF) : UINT32_MAX;
}

static void odrive_sdo(struct drive_odrive *self, unsigned opcode)
{
    uint16_t endpoint;
    uint32_t value;
    uint8_t data[8] = { (uint8_t)opcode };

    odrive_parameter(self, &endpoint, &value);
    data[1] = (uint8_t)endpoint;
    data[2] = (uint8_t)(endpoint >> 8);
    hal_float32_put(&data[4], opcode == SDO_WRITE ? value : 0);
    (void)odrive_send(self, ODRIVE_RX_SDO, data, sizeof data);
}

static int odrive_step_parameters(struct drive_odrive *self)
{
    if (self->family == DRIVE_ODRIVE_05 &&
        hal_readings_want(&self->turn.readings, HAL_READING_TEMPERATURE)) {
        drive_turn_say(&self->turn, "firmware 0.5 reports no temperature");
        return MOTION_E_REFUSED;
    }
    if (!odrive_has_watchdog(self) || self->parameter == 2) {
        odrive_start_next(self, DRIVE_ODRIVE_POSITION);
        return MOTION_E_AGAIN;
    }
    if (self->family != DRIVE_ODRIVE_06) {
        drive_turn_say(&self->turn, "firmware 0.5 cannot set its watchdog");
        return MOTION_E_REFUSED;
    }
    if (!odrive_is_time(self))
        return MOTION_E_AGAIN;
    if (self->tries++ >= WRITES) {
        drive_turn_say(&self->turn, "its watchdog could not be set");
        return MOTION_E_REFUSED;
    }
    odrive_sdo(self, SDO_WRITE);
    odrive_sdo(self, SDO_READ);
    return MOTION_E_AGAIN;
}

/* A confirmation of the write (from 0.6.11) says the same as the answer to the
 * read, which comes after it and is harmless. */
void odrive_take_parameter(struct drive_odrive *self, const uint8_t data[8])
{
    const uint16_t about = (uint16_t)(data[1] | data[2] << 8);
    uint16_t endpoint;
    uint32_t value;

    if (self->start != DRIVE_ODRIVE_PARAMETERS || self->requested_ns == 0)
        return;
    odrive_parameter(self, &endpoint, &value);
    if (about != endpoint || ((hal_float32_get(&data[4]) ^ value) &
                              odrive_parameter_mask(self)) != 0)
        return;
    self->parameter++;
    self->tries = 0;
    self->requested_ns = 0;
}

/* ---- all of it ---- */

/* Say what is waited for. */
static void odrive_say_start(struct drive_odrive *self)
{
    static const char *const words[] = {
        [DRIVE_ODRIVE_HEARTBEAT] = "no heartbeat yet",
        [DRIVE_ODRIVE_VERSION] = "its version is not known yet",
        [DRIVE_ODRIVE_PARAMETERS] = "its watchdog is not confirmed yet",
        [DRIVE_ODRIVE_POSITION] = "no position yet",
        [DRIVE_ODRIVE_FOUND] = "",
    };

    drive_turn_say(&self->turn,
                   self->start == DRIVE_ODRIVE_POSITION && self->is_nan
                       ? DRIVE_TURN_NAN
                       : words[self->start]);
}

int odrive_start_step(struct drive_turn *turn)
{
    struct drive_odrive *self = odrive_of(turn);

    odrive_say_start(self);
    switch (self->start) {
    case DRIVE_ODRIVE_HEARTBEAT:
        if (self->heartbeat_ns != 0)
            odrive_start_next(self, DRIVE_ODRIVE_VERSION);
        return MOTION_E_AGAIN;
    case DRIVE_ODRIVE_VERSION:
        return odrive_step_version(self);
    case DRIVE_ODRIVE_PARAMETERS:
        return odrive_step_parameters(self);
    case DRIVE_ODRIVE_POSITION:
        if (!turn->positioned)
            return MOTION_E_AGAIN;
        odrive_start_next(self, DRIVE_ODRIVE_FOUND);
        odrive_say(self);
        if (self->axis_state == ODRIVE_HOMING)
            turn->motion = DRIVE_TURN_HOME;
        return MOTION_OK;
    case DRIVE_ODRIVE_FOUND:
        break;
    }
    return MOTION_OK;
}

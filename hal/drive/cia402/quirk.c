/* hal/drive/cia402/quirk.c - what the maker of this drive does otherwise, and
 * with it what is in force of the config: what the config says, else what the
 * quirks say, else the default. */
#include "hal/drive/cia402/parts.h"

#define NS_PER_MS  INT64_C(1000000)
#define NS_PER_S   INT64_C(1000000000)
#define BEATS_LOST 3

static const struct drive_cia402_quirk quirk_none;

static const struct drive_cia402_quirk *
quirk_of(const struct drive_cia402 *self)
{
    return self->quirk != NULL ? self->quirk : &quirk_none;
}

static int64_t quirk_time(int64_t given_ns, int64_t quirk_ns,
                          int64_t default_ns)
{
    if (given_ns != 0)
        return given_ns;
    return quirk_ns != 0 ? quirk_ns : default_ns;
}

static void quirk_settle_times(struct drive_cia402 *self)
{
    const struct drive_cia402_config *given = &self->given;
    const struct drive_cia402_quirk *quirk = quirk_of(self);

    self->node.sdo_timeout_ns =
        quirk_time(given->sdo_timeout_ns, quirk->sdo_timeout_ns, 0);
    self->config.state_timeout_ns =
        quirk_time(given->state_timeout_ns, quirk->state_timeout_ns, NS_PER_S);
    self->config.brake_timeout_ns = quirk_time(
        given->brake_timeout_ns, quirk->brake_timeout_ns, 3 * NS_PER_S);
    self->config.precharge_timeout_ns = quirk_time(
        given->precharge_timeout_ns, quirk->precharge_timeout_ns, 3 * NS_PER_S);
}

/* Heartbeats, or a question every half of the watchdog.  Guarding that begins
 * takes the first answer as it is. */
static void quirk_settle_watch(struct drive_cia402 *self)
{
    const int64_t given_ns = self->given.guard_period_ns;
    const uint16_t before_ms = self->guard_ms;

    self->guard_ms = self->guard_given_ms;
    if (given_ns == 0 && quirk_of(self)->guarding)
        self->guard_ms = self->watchdog_ms >> 1;
    self->node.guard_period_ns = self->guard_ms * NS_PER_MS;
    self->node.heartbeat_timeout_ns =
        BEATS_LOST * (self->guard_ms > 0 ? self->node.guard_period_ns
                                         : self->config.heartbeat_period_ns);
    if (before_ms == 0 && self->guard_ms > 0)
        self->node.heartbeat_heard = false;
}

void drive_cia402_settle(struct drive_cia402 *self)
{
    const struct drive_cia402_quirk *quirk = quirk_of(self);

    quirk_settle_times(self);
    quirk_settle_watch(self);
    for (unsigned i = 0; i < DRIVE_CIA402_OPTIONS; i++)
        self->config.option[i] = self->given.option[i].given
                                     ? self->given.option[i]
                                     : quirk->option[i];
    self->config.stream = self->given.stream;
    if (!self->given.stream_given && quirk->interpolates)
        self->config.stream = DRIVE_CIA402_IP;
}

/* ---- by identity --------------------------------------------------------- */

static bool quirk_has_product(const struct drive_cia402_quirk *quirk,
                              uint32_t product)
{
    for (unsigned i = 0; i < quirk->product_count; i++)
        if (quirk->product[i] == product)
            return true;
    return quirk->product_count == 0;
}

bool drive_cia402_quirk_is_of(const struct drive_cia402_quirk *quirk,
                              uint32_t vendor, uint32_t product)
{
    return quirk->vendor != 0 &&
           (vendor & ~quirk->vendor_ignore) == quirk->vendor &&
           quirk_has_product(quirk, product);
}

const struct drive_cia402_quirk *
drive_cia402_quirk_find(const struct drive_cia402_quirk *quirk, unsigned count,
                        uint32_t vendor, uint32_t product)
{
    const struct drive_cia402_quirk *found = NULL;

    for (unsigned i = 0; i < count; i++)
        if (drive_cia402_quirk_is_of(&quirk[i], vendor, product) &&
            (found == NULL || found->product_count == 0))
            found = &quirk[i];
    return found;
}

static int quirk_refuse(struct drive_cia402 *self, uint32_t product)
{
    struct hal_text text = drive_cia402_say(self, "0x1018 is 0x");

    hal_text_hex(&text, self->vendor, 8);
    hal_text_put(&text, ", 0x");
    hal_text_hex(&text, product, 8);
    hal_text_put(&text, ": its quirks are another's");
    return MOTION_E_REFUSED;
}

int drive_cia402_identify(struct drive_cia402 *self, uint32_t product)
{
    const struct drive_cia402_config *given = &self->given;

    self->quirk = given->quirk;
    if (!given->quirk_is_given)
        self->quirk = drive_cia402_quirk_find(given->quirk, given->quirk_count,
                                              self->vendor, product);
    else if (given->quirk->vendor != 0 &&
             !drive_cia402_quirk_is_of(given->quirk, self->vendor, product))
        return quirk_refuse(self, product);
    drive_cia402_settle(self);
    return MOTION_OK;
}

/* ---- objects ------------------------------------------------------------- */

/* A maker's are for every axis. */
bool drive_cia402_parameter(const struct drive_cia402 *self, unsigned at,
                            struct drive_cia402_parameter *parameter)
{
    const struct drive_cia402_quirk *quirk = quirk_of(self);

    if (at < quirk->parameter_count) {
        *parameter = quirk->parameter[at];
        parameter->index = drive_cia402_object(self, parameter->index);
        return true;
    }
    at -= quirk->parameter_count;
    if (at >= self->config.parameter_count)
        return false;
    *parameter = self->config.parameter[at];
    return true;
}

const struct drive_cia402_parameter *
drive_cia402_fixed(const struct drive_cia402 *self, uint16_t index, uint8_t sub)
{
    const struct drive_cia402_quirk *quirk = quirk_of(self);

    for (unsigned i = 0; i < quirk->fixed_count; i++)
        if (quirk->fixed[i].index == index && quirk->fixed[i].sub == sub)
            return &quirk->fixed[i];
    return NULL;
}

bool drive_cia402_homes_without_bit_10(const struct drive_cia402 *self)
{
    return quirk_of(self)->homing_without_bit_10;
}

/* hal/drive/cia402/limits.c - the drive's software limits, 0x607D.
 *
 * A drive clamps every target to them (CiA 402-2, 0x607D), also in its cyclic
 * modes, so an axis outside would leap to the nearer one when it is enabled.
 * There they are wide: that end lies beyond the axis by what it may move until
 * it has its first set point, so the other end, and how far out it may go, are
 * guarded all the same.  From there it is moved inward, which the controller's
 * own range sees to; once the axis and its set point are inside, the limits are
 * what the config says, written and read back beside the set points.  What is
 * in the drive is judged anew each time it is enabled.
 *
 * At the ends of its position range, 0x607B, the drive's counter goes on at the other
 * end (CiA 402-2, 0x607B), by default at those of 32 bits.  What a drive does with a
 * target beyond them in a cyclic mode, the short way or the whole way back, is not the
 * same with all makers, so it is given none. */
#include "hal/drive/cia402/rows.h"

#include "motion/core/fixed.h"

/* Some makers count them from 0x607C: with an offset of the drive's own there
 * are none. */
static bool limits_wait(const struct drive_cia402 *self)
{
    return self->homing != HAL_DRIVE_HOMING_DONE &&
           self->job != DRIVE_CIA402_JOB_HOMED &&
           (self->config.limits_when_homed || self->has_offset);
}

/* The end of the range in the drive's count. */
static int64_t limits_end(const struct drive_cia402 *self, unsigned end)
{
    return (int64_t)self->limit_counts[end] - self->zero_counts;
}

/* Never what stands for "not known". */
static int32_t limits_saturate(int64_t counts)
{
    if (counts >= INT32_MAX)
        return INT32_MAX - 1;
    return counts <= INT32_MIN ? INT32_MIN + 1 : (int32_t)counts;
}

int32_t drive_cia402_limit(const struct drive_cia402 *self, unsigned end)
{
    const int64_t at = self->preload_counts, own = limits_end(self, end);

    if (limits_wait(self))
        return 0; /* both: off */
    if (end == 0 && at < own)
        return limits_saturate(at - self->first_step_counts);
    if (end == 1 && at > own)
        return limits_saturate(at + self->first_step_counts);
    return limits_saturate(own);
}

void drive_cia402_forget_reach(struct drive_cia402 *self)
{
    self->reach_counts[0] = INT32_MIN;
    self->reach_counts[1] = INT32_MAX;
}

static int limits_beyond_reach(struct drive_cia402 *self, unsigned end)
{
    const int32_t counts = self->reach_counts[end];
    struct hal_text text = drive_cia402_say(self, "0x");

    hal_text_hex(&text, drive_cia402_object(self, 0x607B), 4);
    hal_text_put(&text, end == 0 ? ":01 is " : ":02 is ");
    hal_text_put(&text, counts < 0 ? "-" : "");
    hal_text_dec(&text, (uint32_t)motion_fixed_abs(counts));
    hal_text_put(&text, ", within the axis's range");
    return MOTION_E_REFUSED;
}

/* Two that are no range are none.  One end of `limit_counts` is a count further
 * than the axis goes. */
int drive_cia402_note_reach(struct drive_cia402 *self, uint32_t value)
{
    const unsigned end = self->list[self->list_at].sub - 1u;

    self->reach_counts[end] = (int32_t)value;
    if (end == 0)
        return MOTION_OK;
    if (self->reach_counts[0] >= self->reach_counts[1])
        drive_cia402_forget_reach(self);
    if (self->config.pos_min_q32 == self->config.pos_max_q32 ||
        self->config.limits_when_homed)
        return MOTION_OK;
    if ((int64_t)self->limit_counts[0] + 1 < self->reach_counts[0])
        return limits_beyond_reach(self, 0);
    if ((int64_t)self->limit_counts[1] - 1 > self->reach_counts[1])
        return limits_beyond_reach(self, 1);
    return MOTION_OK;
}

bool drive_cia402_note_limit(struct drive_cia402 *self, unsigned end,
                             int32_t counts)
{
    self->limit_there[end] = true;
    self->limit_held[end] = counts;
    return counts == drive_cia402_limit(self, end);
}

void drive_cia402_forget_limit(struct drive_cia402 *self, unsigned end)
{
    self->limit_held[end] = end == 0 ? INT32_MIN : INT32_MAX;
}

bool drive_cia402_is_clamped(const struct drive_cia402 *self)
{
    return self->limit_held[0] < self->limit_held[1] &&
           (self->preload_counts < self->limit_held[0] ||
            self->preload_counts > self->limit_held[1]);
}

/* ---- inside again ------------------------------------------------------ */

/* clang-format off */
static const struct drive_cia402_step limits_again[] = {
    READ(STEP_NEEDED, 0x6064, 0, CHECK_ACTUAL),
    LIMITS_AGAIN,
    END,
};
/* clang-format on */

static bool limits_are_wide(const struct drive_cia402 *self)
{
    const int32_t low = limits_saturate(limits_end(self, 0));
    const int32_t high = limits_saturate(limits_end(self, 1));

    return !limits_wait(self) &&
           ((self->limit_there[0] && self->limit_held[0] < low) ||
            (self->limit_there[1] && self->limit_held[1] > high));
}

static bool limits_hold(const struct drive_cia402 *self, int64_t counts)
{
    return counts >= limits_end(self, 0) && counts <= limits_end(self, 1);
}

/* Only where set points tell that the axis stays inside. */
void drive_cia402_limits_step(struct drive_cia402 *self, int64_t now_ns)
{
    if (limits_are_wide(self) && drive_cia402_mode(self)->streams &&
        self->target_ns != 0 && limits_hold(self, self->target_counts) &&
        limits_hold(self, self->actual_counts))
        drive_cia402_job_begin(self, DRIVE_CIA402_JOB_LIMITS, limits_again,
                               now_ns);
}

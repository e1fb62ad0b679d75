/* firmware/control/follow.c - see follow.h. */
#include "firmware/control/follow.h"

#include "motion/core/fixed.h"

void follow_init(struct follow *self, int64_t lost_ns, int64_t far_ns,
                 int64_t span_q30)
{
    *self = (struct follow){ .lost_ns = lost_ns,
                             .far_ns = far_ns,
                             .span_q30 = span_q30,
                             .rate_q30 = FOLLOW_ONE_Q30 };
}

static int64_t follow_within(int64_t value, int64_t low, int64_t high)
{
    return value < low ? low : value > high ? high : value;
}

/* value num / den; the last value of the format where that is beyond. */
static int64_t follow_part(int64_t value, int64_t num, int64_t den)
{
    int64_t part;
    if (motion_fixed_muldiv(value, num, den, &part) < 0)
        return (value < 0) != (num < 0) ? INT64_MIN / 2 : INT64_MAX / 2;
    return part;
}

int64_t follow_s_ns(const struct follow *self, int64_t t_ns)
{
    return self->s_ns +
           follow_part(t_ns - self->t_ns, self->rate_q30, FOLLOW_ONE_Q30);
}

int64_t follow_t_ns(const struct follow *self, int64_t s_ns)
{
    return self->t_ns +
           follow_part(s_ns - self->s_ns, FOLLOW_ONE_Q30, self->rate_q30);
}

static void follow_begin(struct follow *self, int64_t s_ns, int64_t t_ns)
{
    self->marks = 1;
    self->far = 0;
    self->first_ns = self->t_ns = t_ns;
    self->s_ns = s_ns;
    self->rate_q30 = FOLLOW_ONE_Q30;
}

/* alpha = 2 (2n - 1) / (n (n + 1)), beta = 6 / (n (n + 1)) of n marks. */
static void follow_filter(struct follow *self, int64_t error_ns, int64_t t_ns)
{
    const int64_t since_ns = t_ns - self->t_ns;
    const int64_t n = self->marks < FOLLOW_MEMORY ? self->marks : FOLLOW_MEMORY;
    const int64_t all = n * (n + 1);
    self->s_ns =
        follow_s_ns(self, t_ns) + follow_part(error_ns, 2 * (2 * n - 1), all);
    self->rate_q30 +=
        follow_part(follow_part(error_ns, FOLLOW_ONE_Q30, since_ns), 6, all);
    self->rate_q30 =
        follow_within(self->rate_q30, FOLLOW_ONE_Q30 - FOLLOW_ONE_Q30 / 8,
                      FOLLOW_ONE_Q30 + FOLLOW_ONE_Q30 / 8);
    self->t_ns = t_ns;
}

void follow_mark(struct follow *self, int64_t s_ns, int64_t t_ns)
{
    if (self->state == FOLLOW_JUMPED || self->marks == 0) {
        follow_begin(self, s_ns, t_ns);
        self->state = FOLLOW_WAITING;
        return;
    }
    if (t_ns <= self->t_ns)
        return; /* two at once tell nothing of the rate */
    const int64_t error_ns = s_ns - follow_s_ns(self, t_ns);
    if (motion_fixed_abs(error_ns) > (uint64_t)self->far_ns) {
        if (++self->far < FOLLOW_JUMPS)
            return;
        const bool is_new = self->state == FOLLOW_WAITING;
        follow_begin(self, s_ns, t_ns);
        self->state = is_new ? FOLLOW_WAITING : FOLLOW_JUMPED;
        return;
    }
    self->far = 0;
    self->marks++;
    follow_filter(self, error_ns, t_ns);
    if (self->state == FOLLOW_LOST ||
        (self->marks >= 8 && t_ns - self->first_ns >= FOLLOW_LOCK_NS))
        self->state = FOLLOW_LOCKED;
}

void follow_look(struct follow *self, int64_t now_ns)
{
    if (now_ns - self->t_ns <= self->lost_ns)
        return;
    if (self->state == FOLLOW_LOCKED)
        self->state = FOLLOW_LOST;
    else if (self->state == FOLLOW_WAITING)
        self->marks = 0;
}

int64_t follow_rate_q30(const struct follow *self, int64_t s_ns, int64_t t_ns)
{
    const int64_t behind_ns = follow_s_ns(self, t_ns) - s_ns;
    const int64_t most_q30 = self->span_q30;
    const int64_t more_q30 =
        follow_within(follow_part(behind_ns, FOLLOW_ONE_Q30, FOLLOW_CATCH_NS),
                      -most_q30, most_q30);
    return follow_within(self->rate_q30 + more_q30, FOLLOW_ONE_Q30 - most_q30,
                         FOLLOW_ONE_Q30 + most_q30);
}

/* firmware/control/arm.h - what the files of the playback share: playback.c, and
 * arm.c, which gives drives that sample tracks by themselves what they are to
 * sample, and has all begin at one time. */
#ifndef FIRMWARE_CONTROL_ARM_H
#define FIRMWARE_CONTROL_ARM_H

#include "firmware/control/playback.h"

/* Does the drive of this axis sample by itself? */
bool playback_samples(const struct playback *playback, unsigned index);
/* Does one of an axis that what is played moves? */
bool playback_any_samples(const struct playback *playback);

/* controller_start, or, where drives sample by themselves, its like: cued, and
 * begun once all of them have what they need. */
int playback_arm_start(struct playback *playback,
                       const struct motion_track *const track[]);
/* arm_ramp.c.  Can all that take part change their rate together?  Ask: what is wanted
 * has changed.  Begin: all clocks are in step from here on, at the rate that was told.
 * Step: after every tick; an error: not all would, or no way to a hold was found. */
bool playback_ramps(const struct playback *playback);
void playback_ramp_ask(struct playback *playback);
void playback_ramp_begin(struct playback *playback);
int playback_ramp_step(struct playback *playback);
/* The override, as far as the move allows. */
int64_t playback_rate_q30(const struct playback *playback);
/* How far ahead the slowest of them has to be told. */
int64_t playback_arm_lead_ns(const struct playback *playback);

/* After every tick: true while they are not ready, or not at the end yet. */
bool playback_arm_step(struct playback *playback);

#endif

/* firmware/host/exchange/import_fit.h - does what was imported keep inside the
 * limits of the rig, and which curve through the same keys would?
 *
 * A table has positions (and may have velocities and accelerations) at frames;
 * where the jerk changes within one, the curve that was meant for the samples
 * makes more of it than the move had.  Such an axis takes the first curve of a
 * list that passes.  Keys with tangents are what somebody drew: they stay, and
 * the curve that would pass is named, for --curve.  Where no curve passes, a row that
 * cannot be meant is looked for: neither time nor another curve cures that.
 *
 * An axis whose drive goes from key to key by its own profile has no motion that a
 * file could say: it keeps the keys at which it leaves a place where it rested,
 * and its last one. */
#ifndef FIRMWARE_HOST_EXCHANGE_IMPORT_FIT_H
#define FIRMWARE_HOST_EXCHANGE_IMPORT_FIT_H

#include "firmware/host/exchange/import.h"
#include "firmware/host/exchange/import_odd.h"
#include "motion/plan/check.h"

struct import_fit {
    bool passes;  /* as it was read */
    bool changed; /* `other` was taken */
    bool has_other;
    bool needs_time; /* what was taken is too fast, and nothing else */
    enum plan_curve curve, other; /* as it was read, and one that passes */
    struct plan_violation worst;  /* the first of the curve as it was read */
    struct import_odd
        odd;           /* of samples that no curve meets inside the limits */
    uint32_t kept, of; /* keys, of an axis that goes by its drive's profile */
};

/* Judge an axis, take from one that goes by its drive's profile all keys but
 * those, and give one that breaks a limit another curve through its
 * times and positions, without its velocities: where it is samples and no
 * --curve was said, the first that passes; where it is keys with tangents and
 * one was, that one if it passes.  MOTION_OK, or what planning the axis as it
 * was read has against it, or that it turns back without resting where its drive
 * cannot, with the sentence in `error`. */
int import_fit(const struct import_settings *settings, bool sampled,
               struct plan_axis *axis, struct import_fit *fit,
               struct plan_error *error);

/* "dolly: c4 through the positions, because quintic breaks a limit: jerk,
 * -709.3 mm/s3 at 3.625 s"; empty when it passes. */
#define IMPORT_FIT_MAX (320 + IMPORT_ODD_MAX)
void import_fit_text(const struct import_fit *fit, const struct rig *rig,
                     const struct plan_axis *axis, char text[IMPORT_FIT_MAX]);

#endif

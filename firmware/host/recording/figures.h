/* firmware/host/recording/figures.h - how a run went, in numbers, from its rows
 * alone: following error, peaks, lateness, lost ticks.
 *
 * Following error and peaks are of the move and of settling after it; lateness
 * is of every tick. */
#ifndef FIRMWARE_HOST_RECORDING_FIGURES_H
#define FIRMWARE_HOST_RECORDING_FIGURES_H

#include "firmware/host/recording/telemetry.h"

#define FIGURES_LATE_US 20000 /* later ones count as this late */

struct figures_axis {
    int64_t peak[4];           /* |v|, |a|, |j| of the demand at 1..3, Q32 */
    int64_t following_q32;     /* the largest, with its sign */
    int64_t following_at_ns;   /* of the move */
    int64_t end_following_q32; /* at the end of settling */
    double squares;            /* of the following error, summed */
};

struct figures {
    struct memory_pool memory;
    const struct rig *rig;
    struct figures_axis *axis; /* of the rig; NULL: no row was judged yet */
    uint32_t *shots;           /* of each trigger line */
    uint32_t *late_us;         /* how often, by microsecond, rounded down */
    int64_t period_ns;
    uint64_t rows, judged;
    uint64_t ticks_lost; /* between rows that follow each other */
    int64_t late_ns;     /* the latest */
    bool moved;
    int64_t move_ns; /* t_ns of the last row before the move */
    int64_t phase_ns[TELEMETRY_PHASES];
    int64_t last_ns;
    uint32_t last_number;
};

/* All zero before, figures_free in the end.  `rig` may get its axes later, up
 * to the first row.  period_ns 0: not known, lost ticks are not counted. */
void figures_init(struct figures *figures, const struct rig *rig,
                  int64_t period_ns);
void figures_free(struct figures *figures);
void figures_take(struct figures *figures, const struct telemetry_row *row);

/* Of an axis of the rig; all zero while no row was judged. */
const struct figures_axis *figures_of(const struct figures *figures,
                                      unsigned axis);
double figures_rms(const struct figures *figures, unsigned axis);
/* So late or less were `permille` of the ticks, to the microsecond above. */
int64_t figures_late_ns(const struct figures *figures, unsigned permille);

#endif

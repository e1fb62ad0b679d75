/* firmware/linux/player/player_phase.h - a run from phase to phase (player.h), and
 * what cuts it short: a fault, and the operator. */
#ifndef FIRMWARE_LINUX_PLAYER_PLAYER_PHASE_H
#define FIRMWARE_LINUX_PLAYER_PLAYER_PHASE_H

#include "firmware/linux/player/player.h"

/* The machine's tick at now_ns.  `stops`: signals of the operator so far. */
void player_phase_tick(struct player *player, int stops);

/* After it, once its row is recorded: what the phase does next, or the next
 * phase. */
void player_phase_step(struct player *player);

#endif

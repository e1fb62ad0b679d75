/* hal/drive/cia402/search.c - ways to an answer of a node that gives none.
 *
 * In NMT Stopped a node has neither SDO nor PDO, only NMT and error control (CiA
 * 301 7.3.2.2): somebody has stopped it, or it has itself, by 0x1029, when its
 * bus or its master failed.  Until it is told to enter pre-operational it would
 * be taken for one that is not there, with whatever torque it has.
 *
 *   it says that it is Stopped     enter pre-operational, every AGAIN_NS
 *   it does not answer an SDO      the same, after each time-out; of a search
 *                                  that goes on so, once what the config has:
 *                                  reset communication, or reset node
 *   it stays in another NMT state  the command again, every REPEAT_NS
 *   it aborts for the time being   the transfer again, three times in all */
#include "hal/drive/cia402/parts.h"

#define AGAIN_NS  INT64_C(100000000)
#define REPEAT_NS INT64_C(200000000)
#define PASSES_NS INT64_C(50000000) /* what is refused now may be taken then */

/* A command is for the whole node: the first of its axes sends it. */
static void search_wake(struct drive_cia402 *self, bool may_reset)
{
    const bool resets = may_reset && self->wakes > 0 && !self->was_reset &&
                        self->config.nmt_reset != 0;

    if ((self->now_ns < self->wake_due_ns && !resets) ||
        !canopen_is_first(&self->node))
        return;
    if (canopen_nmt(self->node.master,
                    resets ? self->config.nmt_reset
                           : CANOPEN_NMT_PRE_OPERATIONAL,
                    self->config.node_id) != MOTION_OK)
        return;
    self->node.nmt_state = CANOPEN_NMT_UNKNOWN; /* until it is heard again */
    self->was_reset |= resets;
    self->wakes++;
    self->wake_due_ns = self->now_ns + AGAIN_NS;
}

void drive_cia402_search_begin(struct drive_cia402 *self)
{
    self->wakes = 0;
    self->was_reset = false;
}

/* What was asked before the first command is lost; later ones are waited for,
 * as a node that stays Stopped is to be said to be silent. */
void drive_cia402_search_step(struct drive_cia402 *self)
{
    const bool is_first = self->wakes == 0;

    if (self->node.nmt_state != CANOPEN_NMT_STOPPED)
        return;
    search_wake(self, false);
    if (is_first && self->wakes > 0)
        canopen_sdo_drop(&self->node);
}

void drive_cia402_search_silent(struct drive_cia402 *self)
{
    search_wake(self, true);
}

/* It, or another axis of the node, may be in operation and hear our PDOs: then
 * the node is left there. */
void drive_cia402_search_lost(struct drive_cia402 *self)
{
    if (self->node.nmt_state != CANOPEN_NMT_OPERATIONAL)
        search_wake(self, false);
}

/* ---- once more ----------------------------------------------------------- */

static bool search_passes(uint32_t abort_code)
{
    return abort_code == CANOPEN_ABORT_TIMEOUT ||
           abort_code == CANOPEN_ABORT_HARDWARE ||
           abort_code == CANOPEN_ABORT_LOCAL ||
           abort_code == CANOPEN_ABORT_PRESENT_STATE;
}

bool drive_cia402_search_again(struct drive_cia402 *self)
{
    if (!search_passes(self->node.sdo.abort_code) ||
        ++self->list_tries >= DRIVE_CIA402_TRIES)
        return false;
    self->list_due_ns = self->now_ns + PASSES_NS;
    return true;
}

/* The command of the row before, until the node shows that it has obeyed. */
void drive_cia402_search_repeat(struct drive_cia402 *self)
{
    const struct drive_cia402_step *step = &self->list[self->list_at];

    if ((step->check != CHECK_PRE_OPERATIONAL && step->check != CHECK_LIVE) ||
        (step->check == CHECK_LIVE &&
         self->node.nmt_state == CANOPEN_NMT_OPERATIONAL) ||
        self->now_ns < self->list_since_ns + REPEAT_NS ||
        self->now_ns < self->wake_due_ns)
        return;
    while (step->kind != STEP_NMT)
        step--;
    if (canopen_nmt(self->node.master, (enum canopen_nmt_command)step->value,
                    self->config.node_id) == MOTION_OK)
        self->wake_due_ns = self->now_ns + REPEAT_NS;
}

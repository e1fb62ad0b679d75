/* hal/canopen/canopen.c - NMT, SYNC, PDO, EMCY, heartbeat; see canopen.h.
 *
 * One cycle, begin() to end():
 *   drain the port -> SDO and heartbeat time-outs -> SYNC -> own heartbeat
 *   -> step of every node -> (controller) -> RPDOs
 *
 * Identifiers (CiA 301 table 39): bits 10-7 say what, bits 6-0 which node. */
#include "hal/canopen/canopen.h"

#include <string.h>

#include "hal/canopen/sdo.h"
#include "hal/support/container_of.h"

#define CANOPEN_SDO_TIMEOUT_NS INT64_C(200000000)
#define CANOPEN_SDO_GAP_NS     INT64_C(2000000)
#define CANOPEN_ID_MASK        0x7Fu
#define CANOPEN_PDO_NUMBERS    4u
#define CANOPEN_PDO_BYTES      8u

int canopen_nmt(struct canopen *master, enum canopen_nmt_command command,
                uint8_t node_id)
{
    const struct hal_can_frame frame = {
        .id = CANOPEN_COB_NMT, .len = 2, .data = { (uint8_t)command, node_id }
    };

    if (node_id > 127)
        return MOTION_E_ARG;
    return can_cycle_send(&master->cycle, &frame);
}

int canopen_time(struct canopen *master, uint32_t ms, uint16_t days)
{
    const struct hal_can_frame frame = {
        .id = CANOPEN_COB_TIME,
        .len = 6,
        .data = { (uint8_t)ms, (uint8_t)(ms >> 8), (uint8_t)(ms >> 16),
                  (uint8_t)(ms >> 24), (uint8_t)days, (uint8_t)(days >> 8) },
    };

    if (ms >= 86400000)
        return MOTION_E_ARG;
    return can_cycle_send(&master->cycle, &frame);
}

static struct canopen_node *canopen_find(struct canopen *master, uint32_t id)
{
    return master->node_at[id & CANOPEN_ID_MASK];
}

static void canopen_foreign(struct canopen *master,
                            const struct hal_can_frame *frame)
{
    can_cycle_foreign(&master->cycle, frame);
    master->stats.foreign_master++;
}

static void canopen_beat_heard(struct canopen_node *node, uint8_t state,
                               int64_t now_ns)
{
    node->heartbeat_ns = now_ns;
    node->heartbeat_heard = true;
    if (state != CANOPEN_NMT_BOOT_UP) {
        node->nmt_state = (enum canopen_nmt_state)state;
        return;
    }
    node->nmt_state = CANOPEN_NMT_PRE_OPERATIONAL_STATE;
    if (node->ops->boot_up != NULL)
        node->ops->boot_up(node, now_ns);
}

static void canopen_heartbeat(struct canopen *master, struct canopen_node *node,
                              const struct hal_can_frame *frame, int64_t now_ns)
{
    const uint8_t state = frame->data[0] & 0x7Fu; /* bit 7: guarding's toggle */

    if (frame->len != 1 || !canopen_guard_toggles(node, frame->data[0])) {
        master->stats.malformed++;
        return;
    }
    do {
        canopen_beat_heard(node, state, now_ns);
        node = node->sibling;
    } while (!canopen_is_first(node));
}

static void canopen_emcy(struct canopen *master, struct canopen_node *node,
                         const struct hal_can_frame *frame)
{
    const uint8_t *data = frame->data;

    if (frame->len != 8) {
        master->stats.malformed++;
        return;
    }
    master->stats.emcy_received++;
    do {
        if (node->ops->emcy != NULL)
            node->ops->emcy(node, (uint16_t)(data[0] | data[1] << 8), data[2],
                            &data[3]);
        node = node->sibling;
    } while (!canopen_is_first(node));
}

static void canopen_tpdo(struct canopen *master, struct canopen_node *node,
                         unsigned number, const struct hal_can_frame *frame)
{
    if (node->ops->tpdo == NULL)
        master->stats.unexpected++;
    else if (node->ops->tpdo(node, number, frame))
        master->stats.tpdo_received++;
    else
        master->stats.malformed++;
}

/* What bits 10-7 of an identifier say. */
enum canopen_function {
    FUNCTION_EMCY = 0x1,
    FUNCTION_TPDO1 = 0x3, /* 3, 5, 7, 9: TPDO 1..4 */
    FUNCTION_RPDO1 = 0x4, /* 4, 6, 8, 10: RPDO 1..4 */
    FUNCTION_TPDO4 = 0x9,
    FUNCTION_RPDO4 = 0xA,
    FUNCTION_SDO_ANSWER = 0xB,
    FUNCTION_SDO_REQUEST = 0xC,
    FUNCTION_HEARTBEAT = 0xE,
};

static bool canopen_is_tpdo(unsigned function)
{
    return function >= FUNCTION_TPDO1 && function <= FUNCTION_TPDO4 &&
           (function & 1) != 0;
}

/* What only a master sends to a node. */
static bool canopen_is_order(unsigned function)
{
    return function == FUNCTION_SDO_REQUEST ||
           (function >= FUNCTION_RPDO1 && function <= FUNCTION_RPDO4 &&
            (function & 1) == 0);
}

/* Is PDO `at`, from 0, of the predefined set? */
static bool canopen_is_predefined(const struct canopen_node *node, unsigned at,
                                  bool transmit)
{
    return node->axis == 0 &&
           (at >= CANOPEN_OWN_PDOS ||
            (transmit ? node->tpdo_id[at] : node->rpdo_id[at]) == 0);
}

/* A PDO with an identifier of its own. */
static bool canopen_of_own_pdo(struct canopen *master,
                               const struct hal_can_frame *frame)
{
    for (struct canopen_node *node = master->first; node; node = node->next)
        for (unsigned at = 0; at < CANOPEN_OWN_PDOS; at++) {
            if (node->tpdo_id[at] == frame->id) {
                canopen_tpdo(master, node, at + 1, frame);
                return true;
            }
            if (node->rpdo_id[at] == frame->id) {
                canopen_foreign(master, frame);
                return true;
            }
        }
    return false;
}

static void canopen_of_node(struct canopen *master, struct canopen_node *node,
                            const struct hal_can_frame *frame, int64_t now_ns)
{
    const unsigned function = frame->id >> 7;

    if (function == FUNCTION_EMCY)
        canopen_emcy(master, node, frame);
    else if (function == FUNCTION_HEARTBEAT)
        canopen_heartbeat(master, node, frame, now_ns);
    else if (function == FUNCTION_SDO_ANSWER)
        canopen_sdo_receive(node, frame, now_ns);
    else if (canopen_is_tpdo(function) &&
             canopen_is_predefined(node, (function - 3) >> 1, true))
        canopen_tpdo(master, node, (function - 1) >> 1, frame);
    else if (canopen_is_order(function))
        canopen_foreign(master, frame);
    else
        master->stats.unexpected++;
}

static bool canopen_is_foreign(const struct canopen *master, uint32_t id)
{
    return id == CANOPEN_COB_NMT || id == CANOPEN_COB_SYNC ||
           id == CANOPEN_COB_HEARTBEAT + (uint32_t)master->config.node_id;
}

static void canopen_receive(struct canopen *master,
                            const struct hal_can_frame *frame, int64_t now_ns)
{
    struct canopen_node *node;

    if (frame->extended || frame->remote || frame->fd || frame->id > 0x7FF) {
        master->stats.unexpected++;
        return;
    }
    if (frame->id == CANOPEN_COB_LSS_ANSWER && master->lss != NULL) {
        canopen_lss_receive(master->lss, frame, now_ns);
        return;
    }
    if (canopen_is_foreign(master, frame->id)) {
        canopen_foreign(master, frame);
        return;
    }
    if (frame->id != 0 && canopen_of_own_pdo(master, frame))
        return;
    node = canopen_find(master, frame->id);
    if (node == NULL)
        master->stats.unexpected++;
    else
        canopen_of_node(master, node, frame, now_ns);
}

static void canopen_drain(struct canopen *master, int64_t now_ns)
{
    struct hal_can_frame frame;

    while (can_cycle_recv(&master->cycle, &frame))
        canopen_receive(master, &frame, now_ns);
}

static void canopen_watch(struct canopen_node *node, int64_t now_ns)
{
    if (node->heartbeat_timeout_ns == 0 || !node->heartbeat_heard ||
        now_ns - node->heartbeat_ns < node->heartbeat_timeout_ns)
        return;
    node->heartbeat_heard = false;
    node->nmt_state = CANOPEN_NMT_UNKNOWN;
    if (node->ops->heartbeat_lost != NULL)
        node->ops->heartbeat_lost(node, now_ns);
}

static void canopen_sync(struct canopen *master, int64_t now_ns)
{
    struct hal_can_frame frame = { .id = CANOPEN_COB_SYNC };
    const uint8_t overflow = master->config.sync_overflow;

    if (master->config.sync_period_ns == 0)
        return;
    if (overflow > 0) {
        frame.len = 1;
        frame.data[0] = master->sync_counter < overflow
                            ? (uint8_t)(master->sync_counter + 1)
                            : 1;
    }
    if (can_cycle_send(&master->cycle, &frame) != MOTION_OK ||
        can_cycle_flush(&master->cycle) != MOTION_OK)
        return;
    master->sync_counter = frame.data[0];
    master->sync_previous_ns = master->sync_ns;
    master->sync_ns = now_ns;
    master->stats.sync_sent++;
}

/* After a gap the next one is a period away: no burst of old ones. */
static void canopen_beat(struct canopen *master, int64_t now_ns)
{
    const int64_t period_ns = master->config.heartbeat_period_ns;
    const struct hal_can_frame frame = {
        .id = CANOPEN_COB_HEARTBEAT + (uint32_t)master->config.node_id,
        .len = 1,
        .data = { CANOPEN_NMT_OPERATIONAL },
    };

    if (period_ns == 0 || now_ns < master->heartbeat_due_ns ||
        can_cycle_send(&master->cycle, &frame) != MOTION_OK)
        return;
    master->heartbeat_due_ns += period_ns;
    if (master->heartbeat_due_ns <= now_ns)
        master->heartbeat_due_ns = now_ns + period_ns;
}

static enum hal_fieldbus_health canopen_begin(struct hal_fieldbus *bus,
                                              int64_t now_ns)
{
    struct canopen *master = CONTAINER_OF(bus, struct canopen, fieldbus);

    can_cycle_begin(&master->cycle);
    canopen_drain(master, now_ns);
    if (master->lss != NULL)
        canopen_lss_expire(master->lss, now_ns);
    for (struct canopen_node *node = master->first; node; node = node->next) {
        canopen_sdo_expire(node, now_ns);
        canopen_sdo_pump(node, now_ns);
        canopen_watch(node, now_ns);
    }
    canopen_sync(master, now_ns);
    canopen_beat(master, now_ns);
    for (struct canopen_node *node = master->first; node; node = node->next)
        if (canopen_is_first(node))
            canopen_guard_request(node, now_ns);
    for (struct canopen_node *node = master->first; node; node = node->next)
        if (node->ops->step != NULL)
            node->ops->step(node, now_ns);
    (void)can_cycle_flush(&master->cycle);
    return can_cycle_health(&master->cycle);
}

/* 0: it has none. */
static uint32_t canopen_rpdo_id(const struct canopen_node *node, unsigned at)
{
    if (canopen_is_predefined(node, at, false))
        return CANOPEN_COB_RPDO1 + 0x100 * at + node->id;
    return at < CANOPEN_OWN_PDOS ? node->rpdo_id[at] : 0;
}

static void canopen_rpdo(struct canopen *master, struct canopen_node *node,
                         unsigned number)
{
    struct hal_can_frame frame = { .id = canopen_rpdo_id(node, number - 1) };
    const unsigned len = node->ops->rpdo(node, number, frame.data);

    if (frame.id == 0 || len == 0 || len > CANOPEN_PDO_BYTES)
        return;
    frame.len = (uint8_t)len;
    if (can_cycle_send(&master->cycle, &frame) == MOTION_OK)
        master->stats.rpdo_sent++;
}

static void canopen_end(struct hal_fieldbus *bus, int64_t now_ns)
{
    struct canopen *master = CONTAINER_OF(bus, struct canopen, fieldbus);

    (void)now_ns;
    for (struct canopen_node *node = master->first; node; node = node->next)
        for (unsigned number = 1; number <= CANOPEN_PDO_NUMBERS; number++)
            if (node->ops->rpdo != NULL)
                canopen_rpdo(master, node, number);
    (void)can_cycle_flush(&master->cycle);
}

static const struct hal_fieldbus_ops canopen_ops = {
    .begin = canopen_begin,
    .end = canopen_end,
};

static void canopen_defaults(struct canopen_config *config)
{
    if (config->sdo_timeout_ns == 0)
        config->sdo_timeout_ns = CANOPEN_SDO_TIMEOUT_NS;
    if (config->sdo_gap_ns == 0)
        config->sdo_gap_ns = config->sync_period_ns < CANOPEN_SDO_GAP_NS / 2
                                 ? 2 * config->sync_period_ns
                                 : CANOPEN_SDO_GAP_NS;
}

int canopen_init(struct canopen *master, struct hal_can *can,
                 const struct canopen_config *config)
{
    if (config->node_id < 1 || config->node_id > 127 ||
        config->sync_period_ns < 0 || config->heartbeat_period_ns < 0 ||
        config->sdo_timeout_ns < 0 || config->sdo_gap_ns < 0 ||
        config->sync_overflow == 1 || config->sync_overflow > 240)
        return MOTION_E_ARG;
    memset(master, 0, sizeof *master);
    master->fieldbus.ops = &canopen_ops;
    can_cycle_init(&master->cycle, can);
    master->config = *config;
    master->heartbeat_due_ns = INT64_MIN / 2;
    master->sdo_started_ns = INT64_MIN / 2;
    canopen_defaults(&master->config);
    return MOTION_OK;
}

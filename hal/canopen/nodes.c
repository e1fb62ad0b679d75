/* hal/canopen/nodes.c - which nodes there are, the axes of a device in a ring,
 * and whose the identifiers of PDOs are; see canopen.h. */
#include "hal/canopen/sdo.h"

#define NODE_ID_MASK 0x7Fu

bool canopen_is_single(const struct canopen_node *node)
{
    return node->sibling == node;
}

bool canopen_is_first(const struct canopen_node *node)
{
    return node->master->node_at[node->id] == node;
}

bool canopen_id_is_for_pdos(uint32_t id)
{
    return (id >= 0x181 && id <= 0x57F) || (id >= 0x680 && id <= 0x6DF);
}

/* The predefined PDOs of a node that is there; of its own, 3 and 4 are not in
 * use. */
static bool canopen_id_is_predefined(const struct canopen *master,
                                     const struct canopen_node *node,
                                     uint32_t id)
{
    const uint32_t of = id & NODE_ID_MASK;

    return id <= 0x57F && (master->node_at[of] != NULL || of == node->id) &&
           (of != node->id || id < CANOPEN_COB_TPDO3);
}

bool canopen_pdo_id_is_free(const struct canopen *master,
                            const struct canopen_node *node, uint32_t id)
{
    if (!canopen_id_is_for_pdos(id) ||
        canopen_id_is_predefined(master, node, id))
        return false;
    for (const struct canopen_node *of = master->first; of; of = of->next)
        for (unsigned at = 0; at < CANOPEN_OWN_PDOS; at++)
            if (of->rpdo_id[at] == id || of->tpdo_id[at] == id)
                return false;
    return true;
}

/* One of `own` that is of another node's predefined set. */
static bool canopen_id_is_of(const struct canopen_node *own,
                             const struct canopen_node *node, uint32_t id)
{
    return id != 0 && id <= 0x57F && own->id != node->id &&
           (id & NODE_ID_MASK) == node->id;
}

/* Each once, and nobody else's. */
static bool canopen_pdos_are_free(const struct canopen *master,
                                  const struct canopen_node *node)
{
    const uint16_t id[] = { node->rpdo_id[0], node->rpdo_id[1],
                            node->tpdo_id[0], node->tpdo_id[1] };

    for (unsigned i = 0; i < 4; i++) {
        if (id[i] != 0 && !canopen_pdo_id_is_free(master, node, id[i]))
            return false;
        for (unsigned k = 0; k < i; k++)
            if (id[i] != 0 && id[k] == id[i])
                return false;
    }
    for (const struct canopen_node *of = master->first; of; of = of->next)
        for (unsigned at = 0; at < CANOPEN_OWN_PDOS; at++)
            if (canopen_id_is_of(of, node, of->rpdo_id[at]) ||
                canopen_id_is_of(of, node, of->tpdo_id[at]))
                return false;
    return true;
}

/* Into the ring of those with its id; false: its place in it is taken. */
static bool canopen_join(struct canopen *master, struct canopen_node *node)
{
    struct canopen_node *first = master->node_at[node->id], *other = first;

    node->sibling = node;
    if (first == NULL)
        return true;
    do {
        if (other->axis == node->axis)
            return false;
        other = other->sibling;
    } while (other != first);
    node->sibling = first->sibling;
    first->sibling = node;
    return true;
}

int canopen_add(struct canopen *master, struct canopen_node *node)
{
    if (node->id < 1 || node->id > 127 || node->id == master->config.node_id ||
        !canopen_pdos_are_free(master, node))
        return MOTION_E_ARG;
    if (!canopen_join(master, node))
        return MOTION_E_ARG;
    node->master = master;
    node->sdo_requested_ns = node->sdo_served_ns = INT64_MIN / 2;
    node->nmt_state = CANOPEN_NMT_UNKNOWN;
    node->heartbeat_heard = false;
    node->sdo.state = CANOPEN_SDO_IDLE;
    node->sdo_late = (struct canopen_sdo_late){ .count = 0 };
    node->next = NULL;
    if (master->last == NULL)
        master->first = node;
    else
        master->last->next = node;
    master->last = node;
    if (master->node_at[node->id] == NULL)
        master->node_at[node->id] = node;
    return MOTION_OK;
}

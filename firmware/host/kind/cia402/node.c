/* firmware/host/kind/cia402/node.c - several axes behind one CANopen node: which of
 * its axes, by which PDOs; and what belongs to the node is said once. */
#include "firmware/host/kind/cia402/parts.h"

#include <stdlib.h>
#include <string.h>

#define NODE_PDOS_APART 4 /* of one axis, whether they are used or not */

int rig_read_cia402_axis(void *reader, const struct yaml_value *value,
                         void *out)
{
    int64_t number;
    (void)reader;
    if (yaml_value_integer(value, 1, DRIVE_CIA402_AXES, &number) < 0)
        return -1;
    *(uint8_t *)out = (uint8_t)(number - 1);
    return 0;
}

/* ---- which PDOs ---------------------------------------------------------- */

static int rig_read_pdo_id(void *reader, const struct yaml_value *value,
                           void *out)
{
    char quote[YAML_QUOTE_MAX];
    int64_t id;
    (void)reader;
    if (yaml_value_number(value, 0, 0x7FF, &id) < 0)
        return -1;
    if (!canopen_id_is_for_pdos((uint32_t)id))
        return yaml_value_refuse(value, "%s is not for a PDO",
                                 yaml_value_quote(quote, value));
    *(uint16_t *)out = (uint16_t)id;
    return 0;
}

static int rig_read_pdo_number(void *reader, const struct yaml_value *value,
                               void *out)
{
    int64_t number;
    (void)reader;
    if (yaml_value_integer(value, 1, 509, &number) < 0)
        return -1;
    *(uint16_t *)out = (uint16_t)number;
    return 0;
}

#define ID_TEXT "an identifier, 0x181 .. 0x57F or 0x680 .. 0x6DF"
static const struct yaml_field rig_pdo_fields[] = {
    { "rx", YAML_OPTIONAL, ID_TEXT, rig_read_pdo_id,
      offsetof(struct drive_cia402_pdos, rpdo_id) },
    { "tx", YAML_OPTIONAL, ID_TEXT, rig_read_pdo_id,
      offsetof(struct drive_cia402_pdos, tpdo_id) },
    { "rx2", YAML_OPTIONAL, ID_TEXT, rig_read_pdo_id,
      offsetof(struct drive_cia402_pdos, rpdo_id[1]) },
    { "tx2", YAML_OPTIONAL, ID_TEXT, rig_read_pdo_id,
      offsetof(struct drive_cia402_pdos, tpdo_id[1]) },
    { "number", YAML_OPTIONAL, "the number of its first PDO, 1 .. 509",
      rig_read_pdo_number, offsetof(struct drive_cia402_pdos, number) },
};
const struct yaml_shape rig_pdo_shape = { "pdo", rig_pdo_fields,
                                          ARRAY_LEN(rig_pdo_fields) };

int rig_read_cia402_pdo(void *reader, const struct yaml_value *value, void *out)
{
    return yaml_fields_read(value, &rig_pdo_shape, reader, out);
}

/* ---- with the axes before ------------------------------------------------ */

static unsigned node_pdo_number(const struct rig_axis *axis)
{
    const struct rig_cia402 *cia402 = &axis->cia402;

    return cia402->pdo.number != 0 ? cia402->pdo.number
                                   : 1 + 64u * axis->node_axis;
}

#define NODE_IDS 4
static void node_ids(const struct rig_axis *axis, uint16_t id[NODE_IDS])
{
    memcpy(id, axis->cia402.pdo.rpdo_id, sizeof axis->cia402.pdo.rpdo_id);
    memcpy(id + 2, axis->cia402.pdo.tpdo_id, sizeof axis->cia402.pdo.tpdo_id);
}

/* Is it of the predefined set of this axis's node?  3 and 4 are not in use, for
 * the node itself. */
static bool node_has_id(const struct rig_axis *axis, const struct rig_axis *of,
                        uint16_t id)
{
    const bool own = axis->node_id == of->node_id;

    return id != 0 && id <= 0x57F && (id & 0x7F) == axis->node_id &&
           (!own || id < 0x380);
}

static int node_refuse_id(const struct yaml_value *value, uint16_t id,
                          const struct rig_axis *other)
{
    return yaml_value_refuse(value,
                             "has 0x%03X among its pdo, which axis %s on line "
                             "%u has on the same bus, too",
                             id, other->name, other->place.line);
}

static int node_check_ids(const struct yaml_value *value,
                          const struct rig_axis *axis,
                          const struct rig_axis *other)
{
    uint16_t own[NODE_IDS], its[NODE_IDS];

    node_ids(axis, own);
    node_ids(other, its);
    for (unsigned i = 0; i < NODE_IDS; i++) {
        if (node_has_id(other, axis, own[i]))
            return node_refuse_id(value, own[i], other);
        if (node_has_id(axis, other, its[i]))
            return yaml_value_refuse(value,
                                     "has 0x%03X by its node, which axis %s on "
                                     "line %u has among its pdo",
                                     its[i], other->name, other->place.line);
        for (unsigned k = 0; k < NODE_IDS; k++)
            if (own[i] != 0 && own[i] == its[k])
                return node_refuse_id(value, own[i], other);
    }
    return 0;
}

/* What belongs to the node, by the first that differs; NULL: none. */
static const char *node_differs(const struct rig_axis *axis,
                                const struct rig_axis *other)
{
    const struct rig_cia402 *a = &axis->cia402, *b = &other->cia402;

    if (a->guard_period_ns != b->guard_period_ns)
        return "guarding";
    if (a->nmt_reset != b->nmt_reset)
        return "nmt_reset";
    if (a->time.sdo_ns != b->time.sdo_ns)
        return "times: sdo";
    if (a->time.boot_ns != b->time.boot_ns)
        return "times: boot";
    if (a->quirk_given != b->quirk_given || a->quirk != b->quirk)
        return "quirks";
    return axis->unsupervised != other->unsupervised ? "unsupervised" : NULL;
}

static int node_check_sibling(const struct yaml_value *value,
                              const struct rig_axis *axis,
                              const struct rig_axis *other)
{
    const char *differs = node_differs(axis, other);
    const int apart =
        abs((int)node_pdo_number(axis) - (int)node_pdo_number(other));

    if (differs != NULL)
        return yaml_value_refuse(value,
                                 "differs in %s from axis %s on line %u, which "
                                 "is of the same node: expected the same",
                                 differs, other->name, other->place.line);
    if (apart < NODE_PDOS_APART)
        return yaml_value_refuse(value,
                                 "has PDOs from number %u on, and axis %s on "
                                 "line %u, of the same node, from %u on: "
                                 "expected at least 4 between them",
                                 node_pdo_number(axis), other->name,
                                 other->place.line, node_pdo_number(other));
    return 0;
}

/* Each of its own once. */
static int node_check_own(const struct yaml_value *value,
                          const struct rig_axis *axis)
{
    uint16_t id[NODE_IDS];

    node_ids(axis, id);
    for (unsigned i = 0; i < NODE_IDS; i++) {
        if (node_has_id(axis, axis, id[i]))
            return yaml_value_refuse(value,
                                     "has 0x%03X among its pdo, which its node "
                                     "has for its first axis",
                                     id[i]);
        for (unsigned k = 0; k < i; k++)
            if (id[i] != 0 && id[k] == id[i])
                return yaml_value_refuse(
                    value, "has 0x%03X twice among its pdo", id[i]);
    }
    return 0;
}

int rig_check_node(const struct rig_reader *reader,
                   const struct yaml_value *value)
{
    const struct rig_axis *axis = reader->axis;

    if (node_check_own(value, axis) < 0)
        return -1;
    for (const struct rig_axis *other = reader->rig->axis; other < axis;
         other++) {
        if (other->bus != axis->bus || other->kind != RIG_CIA402)
            continue;
        if (other->node_id == axis->node_id &&
            node_check_sibling(value, axis, other) < 0)
            return -1;
        if (node_check_ids(value, axis, other) < 0)
            return -1;
    }
    return 0;
}

bool rig_is_first_of_node(const struct rig *rig, const struct rig_axis *axis)
{
    for (const struct rig_axis *other = rig->axis; other < axis; other++)
        if (other->bus == axis->bus && other->node_id == axis->node_id)
            return false;
    return true;
}

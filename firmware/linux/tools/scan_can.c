/* firmware/linux/tools/scan_can.c - who is on a CAN bus; see scan.h. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/device/eds_need.h"
#include "firmware/linux/tools/kind.h"
#include "firmware/linux/tools/lss.h"
#include "firmware/linux/tools/scan.h"
#include "hal/drive/cia402/drive.h"
#include "motion/core/err.h"

#define SCAN_STEP_NS   INT64_C(1000000)
#define SCAN_PER_STEP  4 /* questions: a quarter of 250 kbit/s */
#define SCAN_ANSWER_NS INT64_C(150000000)
#define SCAN_DETAIL_NS INT64_C(100000000) /* per answer */
#define SCAN_PROFILE   402u
#define SCAN_NODES     128

/* What was heard of the drives that are not CANopen's, by kind and number. */
struct scan_others {
    unsigned frames[SCAN_NODES];
    uint8_t state[SCAN_NODES];
    uint8_t canopen[SCAN_NODES]; /* the node that might have said the same */
};

/* What was heard. */
struct scan_ear {
    bool heard[SCAN_NODES];    /* a heartbeat, a boot-up or an answer */
    uint8_t state[SCAN_NODES]; /* NMT */
    bool has_state[SCAN_NODES];
    struct scan_others others[RIG_DRIVE_KINDS];
    bool master; /* SYNC or NMT, not ours */
};

/* ---- hearing ---- */

static void ear_canopen(struct scan_ear *ear, const struct hal_can_frame *frame)
{
    const unsigned function = frame->id >> 7, node = frame->id & 0x7F;

    if (node == 0) {
        ear->master = ear->master || function == 0 || function == 1;
        return;
    }
    if (function == 0xE && frame->len == 1) {
        ear->heard[node] = true;
        ear->has_state[node] = true;
        ear->state[node] = frame->data[0] & 0x7F;
    } else if (function == 0xB && frame->len == 8 && frame->data[1] == 0x00 &&
               frame->data[2] == 0x10) {
        ear->heard[node] = true; /* about 0x1000, whatever it says */
    }
}

static bool ear_is_other(struct scan_ear *ear,
                         const struct hal_can_frame *frame)
{
    uint8_t id, state;

    for (unsigned i = 0; i < RIG_DRIVE_KINDS; i++) {
        const struct tool_ear *kind = &tool_kinds[i]->ear;

        if (kind->text == NULL || !kind->is_of(frame, &id, &state))
            continue;
        ear->others[i].frames[id]++;
        ear->others[i].state[id] = state;
        ear->others[i].canopen[id] = frame->id & 0x7F;
        return true;
    }
    return false;
}

/* All use all 11 bits; what tells them apart is the rest of the frame. */
static void ear_take(struct scan_ear *ear, const struct hal_can_frame *frame)
{
    if (!ear_is_other(ear, frame) && !frame->extended && !frame->remote &&
        !frame->fd)
        ear_canopen(ear, frame);
}

/* Its identifier may be that of a PDO of a node that has been heard. */
static bool ear_has(const struct scan_ear *ear, unsigned kind, unsigned id)
{
    const struct scan_others *others = &ear->others[kind];

    return others->frames[id] > 0 &&
           others->frames[id] >= tool_kinds[kind]->ear.frames &&
           !ear->heard[others->canopen[id]];
}

/* The kind of those that take questions for orders; NULL: there are none. */
static const struct tool_ear *ear_in_danger(const struct scan_ear *ear)
{
    for (unsigned kind = 0; kind < RIG_DRIVE_KINDS; kind++)
        for (unsigned id = 0; id < SCAN_NODES; id++)
            if (tool_kinds[kind]->ear.client == NULL && ear_has(ear, kind, id))
                return &tool_kinds[kind]->ear;
    return NULL;
}

static int ear_listen(struct scan_ear *ear, struct bench *bench, int64_t dur_ns)
{
    struct hal_clock *clock = bench->ports.clock;
    const int64_t end_ns = hal_clock_now_ns(clock) + dur_ns;
    struct hal_can_frame frame;
    int got;

    do {
        while ((got = hal_can_recv(bench->ports.can[0], &frame)) == 1)
            ear_take(ear, &frame);
        if (got < 0)
            return MOTION_E_IO;
        (void)hal_clock_wait_until(clock,
                                   hal_clock_now_ns(clock) + SCAN_STEP_NS);
    } while (hal_clock_now_ns(clock) < end_ns);
    return MOTION_OK;
}

/* ---- asking everybody ---- */

static void request_canopen(struct hal_can_frame *frame, uint8_t id)
{
    /* initiate SDO upload of 0x1000:0 */
    *frame = (struct hal_can_frame){ .id = 0x600u + id,
                                     .len = 8,
                                     .data = { 0x40, 0x00, 0x10 } };
}

static int
request_everybody(struct scan *scan, struct scan_ear *ear, struct bench *bench,
                  void (*client)(struct hal_can_frame *frame, uint8_t id))
{
    int err = MOTION_OK;

    for (unsigned id = 1; id < 128 && err == MOTION_OK; id++) {
        struct hal_can_frame frame;

        client(&frame, (uint8_t)id);
        (void)hal_can_send(bench->ports.can[0], &frame);
        if (id % SCAN_PER_STEP != 0 && id != 127)
            continue;
        if (scan->progress != NULL)
            scan->progress("node", id, 127);
        (void)hal_can_flush(bench->ports.can[0]);
        err = ear_listen(ear, bench, SCAN_STEP_NS);
    }
    return err == MOTION_OK ? ear_listen(ear, bench, SCAN_ANSWER_NS) : err;
}

/* ---- one node ---- */

static const char *nmt_text(uint8_t state)
{
    switch (state) {
    case CANOPEN_NMT_STOPPED:
        return "stopped";
    case CANOPEN_NMT_OPERATIONAL:
        return "operational";
    case CANOPEN_NMT_BOOT_UP: /* which it has left by now */
    case CANOPEN_NMT_PRE_OPERATIONAL_STATE:
        return "pre-operational";
    default:
        return "";
    }
}

static void node_name(struct canopen_client *client, struct scan_found *found)
{
    uint8_t text[SCAN_TEXT_MAX] = { 0 };
    uint32_t length = 0;

    if (canopen_client_read(client, 0x1008, 0, text, sizeof text - 1, &length) <
        0)
        return;
    for (uint32_t i = 0; i < length && text[i] != 0; i++)
        found->name[i] = text[i] >= ' ' && text[i] < 0x7F ? (char)text[i] : '?';
}

static void node_identity(struct canopen_client *client,
                          struct scan_found *found)
{
    uint32_t *part[] = { &found->identity.vendor, &found->identity.product,
                         &found->identity.revision, &found->identity.serial };

    for (uint8_t i = 0; i < 4; i++)
        if (canopen_client_read_number(client, 0x1018, (uint8_t)(i + 1),
                                       part[i], NULL) < 0)
            *part[i] = 0;
}

/* Of an axis, from 0, of the node: `index` is that of the first. */
static int axis_read(struct canopen_client *client, unsigned axis,
                     uint16_t index, uint32_t *value)
{
    return canopen_client_read_number(
        client, drive_cia402_object_of((uint8_t)axis, 0, index), 0, value,
        NULL);
}

static void node_drive(struct canopen_client *client, struct scan_found *found,
                       unsigned axis)
{
    uint32_t modes = EDS_MODE_CSP, word = 0;
    char number[24] = "";
    const size_t used = strlen(found->state);

    if (found->axis > 0)
        snprintf(number, sizeof number, ", axis: %u", found->axis);
    (void)axis_read(client, axis, 0x6502, &modes);
    snprintf(found->fits, sizeof found->fits, "kind: cia402%s%s", number,
             (modes & EDS_MODE_CSP) != 0 ? "" : ", but it has no CSP");
    if (axis_read(client, axis, 0x6041, &word) == MOTION_OK)
        snprintf(found->state + used, sizeof found->state - used, "%s%s",
                 used > 0 ? ", " : "",
                 cia402_state_text(cia402_state_of((uint16_t)word)));
}

static struct scan_found *add_node(struct scan *scan, const char *kind,
                                   unsigned id, const char *bus)
{
    struct scan_found *found = scan_add(scan, kind, id, bus);

    if (found != NULL)
        found->has_identity = true;
    return found;
}

/* A device module is what its 0x67FF says, and a drive where that is missing
 * and a statusword is there (CiA 301 7.5.2.1).  Below zero: no answer. */
static int node_has_axis(struct canopen_client *client, unsigned axis)
{
    uint32_t value = 0;
    int err = axis_read(client, axis, 0x67FF, &value);

    if (err == MOTION_OK)
        return (value & 0xFFFF) == SCAN_PROFILE;
    if (err != MOTION_E_TIMEOUT)
        err = axis_read(client, axis, 0x6041, &value);
    return err == MOTION_E_TIMEOUT ? err : err == MOTION_OK;
}

/* A row for each axis of a drive; `first` has what is said of the node. */
static void node_axes(struct scan *scan, struct canopen_client *client,
                      struct scan_found *first)
{
    const struct scan_found node = *first;

    for (unsigned axis = 1; axis < DRIVE_CIA402_AXES; axis++) {
        const int has = node_has_axis(client, axis);
        struct scan_found *found =
            has > 0 ? scan_add(scan, node.kind, node.id, node.bus) : NULL;

        if (has < 0)
            break;
        if (found == NULL)
            continue;
        *found = node;
        first->axis = 1;
        found->axis = axis + 1;
        node_drive(client, found, axis);
    }
    node_drive(client, first, 0);
}

static void node_look(struct scan *scan, struct canopen_client *client,
                      const struct scan_ear *ear, uint8_t id, const char *bus)
{
    struct scan_found *found = add_node(scan, "CANopen", id, bus);
    uint32_t device = 0;
    int err;

    if (found == NULL)
        return;
    if (ear->has_state[id])
        snprintf(found->state, sizeof found->state, "%s",
                 nmt_text(ear->state[id]));
    (void)canopen_client_node(client, id);
    err = canopen_client_read_number(client, 0x1000, 0, &device, NULL);
    if (err == MOTION_E_TIMEOUT) {
        snprintf(found->fits, sizeof found->fits,
                 "nothing: no answer, only a heartbeat");
        return;
    }
    node_name(client, found);
    node_identity(client, found);
    if (err == MOTION_OK && (device & 0xFFFF) == SCAN_PROFILE)
        node_axes(scan, client, found);
    else
        snprintf(found->fits, sizeof found->fits,
                 "nothing: no drive (profile %u)", (unsigned)(device & 0xFFFF));
}

/* Only one can be seen at a time. */
static void look_for_numberless(struct scan *scan,
                                struct canopen_client *client, const char *bus)
{
    struct canopen_identity identity = { 0 };
    struct scan_found *found;

    if (lss_select(client, NULL, &identity) == MOTION_OK) {
        found = add_node(scan, "CANopen, no number", 0, bus);
        if (found != NULL) {
            found->has_number = false;
            found->identity = identity;
            snprintf(found->state, sizeof found->state, "waits for a number");
            snprintf(found->fits, sizeof found->fits,
                     "slew drive lss %.20s node N", bus);
        }
    }
    lss_release(client);
}

/* ---- all ---- */

static void add_others(struct scan *scan, const struct scan_ear *ear,
                       const char *bus)
{
    for (unsigned i = 0; i < RIG_DRIVE_KINDS * SCAN_NODES; i++) {
        const unsigned kind = i / SCAN_NODES, id = i % SCAN_NODES;
        const struct tool_ear *of = &tool_kinds[kind]->ear;
        struct scan_found *found =
            ear_has(ear, kind, id) ? scan_add(scan, of->text, id, bus) : NULL;

        if (found == NULL)
            continue;
        snprintf(found->state, sizeof found->state, "%s",
                 of->state_text(ear->others[kind].state[id]));
        snprintf(found->fits, sizeof found->fits, "kind: %s",
                 tool_kinds[kind]->word);
    }
}

static int scan_canopen(struct scan *scan, struct scan_ear *ear,
                        struct bench *bench, const char *bus)
{
    struct canopen_client client;
    const int err = request_everybody(scan, ear, bench, request_canopen);

    if (err < 0)
        return err;
    canopen_client_init(&client, bench->ports.can[0], bench->ports.clock,
                        SCAN_DETAIL_NS);
    for (unsigned id = 1; id < 128; id++)
        if (ear->heard[id])
            node_look(scan, &client, ear, (uint8_t)id, bus);
    look_for_numberless(scan, &client, bus);
    return MOTION_OK;
}

/* Somebody else's questions and ours would get mixed up: what was heard is
 * all. */
static void only_heard(struct scan *scan, const struct scan_ear *ear,
                       const char *bus)
{
    if (ear->master)
        scan_note(scan,
                  "%s: another master is on the bus: only listened, nothing "
                  "was sent",
                  bus);
    else
        scan_note(scan,
                  "%s: %ss are on the bus: only listened, CANopen questions "
                  "could be orders to them",
                  bus, ear_in_danger(ear)->text);
    for (unsigned id = 1; id < 128; id++) {
        struct scan_found *found =
            ear->heard[id] ? add_node(scan, "CANopen", id, bus) : NULL;

        if (found != NULL && ear->has_state[id])
            snprintf(found->state, sizeof found->state, "%s",
                     nmt_text(ear->state[id]));
    }
}

/* Classic nodes take an FD frame for an error: asked only where none is. */
static int scan_fd(struct scan *scan, struct scan_ear *ear, struct bench *bench,
                   unsigned before)
{
    int err = MOTION_OK;

    if (!bench->has_fd || ear->master || ear_in_danger(ear) != NULL ||
        scan->count != before)
        return MOTION_OK;
    for (unsigned i = 0; i < RIG_DRIVE_KINDS && err == MOTION_OK; i++)
        if (tool_kinds[i]->ear.client != NULL)
            err =
                request_everybody(scan, ear, bench, tool_kinds[i]->ear.client);
    return err;
}

int scan_can(struct scan *scan, struct bench *bench,
             const struct scan_config *config)
{
    static struct scan_ear ear;
    const char *bus = bench->rig.bus[0].name;
    const unsigned before = scan->count;
    int err;

    ear = (struct scan_ear){ .master = false };
    err = ear_listen(&ear, bench, config->listen_ns);
    const bool canopen = bench->rig.bus[0].kind == RIG_CANOPEN;
    if (err == MOTION_OK &&
        (ear.master || (canopen && ear_in_danger(&ear) != NULL)))
        only_heard(scan, &ear, bus);
    else if (err == MOTION_OK && canopen)
        err = scan_canopen(scan, &ear, bench, bus);
    if (err == MOTION_OK)
        err = scan_fd(scan, &ear, bench, before);
    add_others(scan, &ear, bus);
    return err;
}

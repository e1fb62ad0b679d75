/* tests/hal/drive/cia402/test_quirk_servos.c - kinds of CiA 402 servo as makers
 * build them, each through the whole chain: start-up, enable, moves, stop,
 * fault, reset, homing, off, a host that dies.
 *
 * Each ends in a move or in a sentence that names the object; none keeps torque
 * after a fault, and none is let roll out at speed.  Sources of the kinds: the
 * makers' manuals and the threads named beside them. */
#include <math.h>
#include <string.h>

#include "firmware/control/controller.h"
#include "firmware/control/homing.h"
#include "firmware/host/rig/rig.h"
#include "firmware/linux/base/disk.h"
#include "hal/drive/cia402/drive.h"
#include "motion/core/fixed.h"
#include "tests/hal/canopen/canopen_bench.h"
#include "tests/hal/drive/cia402/quirk_servo.h"

#define ONE     MOTION_FIXED_ONE_Q32
#define KEY     QUIRK_KEY
#define HOME_AT (5 * ONE)

struct row {
    const char *name;
    struct quirk_kind kind;
    const char *says;  /* how it ends; NULL: it moves, and homes */
    int method;        /* of homing; 0: it has none */
    uint32_t events;   /* that must have been counted: bit per kind of event */
    int8_t quick_stop; /* of the rig; 0: not given */
    bool profile;      /* goes by its own ramps too */
    bool limits;
    bool outside; /* of the range, when it is found */
    bool guarded;
    bool inputs; /* homed by slew and its home input */
    bool unsupervised;
    int64_t sdo_ms, state_ms, brake_ms, precharge_ms; /* of the rig */
    int64_t boot_ms;
    const struct drive_cia402_parameter *parameter; /* of the rig */
    bool found;         /* slew's own quirks, by its 0x1018 */
    const char *quirks; /* those that the rig names */
    bool csp;           /* the rig says mode: csp */
};

static const struct drive_cia402_parameter no_abort = { 0x6007, 0, 2, 0 };
static const struct drive_cia402_parameter no_consumer = { 0x1016, 1, 4, 0 };
static const struct drive_cia402_parameter coasts = { 0x605A, 0, 2, 0 };

#define MISSING(...)   .missing = { __VA_ARGS__ }
#define READ_ONLY(...) .read_only = { __VA_ARGS__ }
#define INITIAL(...)   .initial = { __VA_ARGS__ }
#define ONLY(...)      .only = { __VA_ARGS__ }
#define TO_SWITCH      17
#define MAPS_RIGHT                                                             \
    { KEY(0x1600, 0), 2 }, { KEY(0x1600, 2), 0x607A0020 },                     \
        { KEY(0x1A00, 0), 2 },                                                 \
    {                                                                          \
        KEY(0x1A00, 2), 0x60640020                                             \
    }
#define IS(vendor, product)                                                    \
    { KEY(0x1018, 1), vendor },                                                \
    {                                                                          \
        KEY(0x1018, 2), product                                                \
    }
#define EPOS4              INITIAL(IS(0xFB, 0x65520000), { KEY(0x605A, 0), 6 })
#define EPOS2              INITIAL(IS(0xFB, 0x64200000), { KEY(0x6502, 0), 0x65 })
#define AS_NEEDED_BUT_TYPE .initial = { MAPS_RIGHT }
#define AS_NEEDED                                                              \
    .initial = { MAPS_RIGHT,                                                   \
                 { KEY(0x1400, 2), 1 },                                        \
                 { KEY(0x1800, 2), 1 },                                        \
                 { KEY(0x1800, 3), 0 } }
/* But for the first of each. */
#define ALL_OFF                                                                \
    MISSING(KEY(0x1401, 1), KEY(0x1402, 1), KEY(0x1403, 1), KEY(0x1801, 1),    \
            KEY(0x1802, 1), KEY(0x1803, 1))

static const struct row rows[] = {
    { .name = "by the book", .method = TO_SWITCH },
    /* ---- 0x605A to 0x605E ---- */
    { .name = "quick stop coasts as shipped (605A = 0), 6007 = 3",
      .kind = { INITIAL({ KEY(0x605A, 0), 0 }, { KEY(0x6007, 0), 3 }) },
      .method = TO_SWITCH },
    { .name = "605A = 0 and read-only",
      .kind = { INITIAL({ KEY(0x605A, 0), 0 }), READ_ONLY(KEY(0x605A, 0)) },
      .says = "0x605A" },
    { .name = "605A = 0 and nothing else taken",
      .kind = { INITIAL({ KEY(0x605A, 0), 0 }),
                ONLY({ KEY(0x605A, 0), 0, 0x06090030 }) },
      .says = "0x605A" },
    { .name = "605A = 1, ramp 6084",
      .kind = { INITIAL({ KEY(0x605A, 0), 1 }) },
      .method = TO_SWITCH },
    { .name = "605A = 3, Schunk: current limit",
      .kind = { INITIAL({ KEY(0x605A, 0), 3 }), READ_ONLY(KEY(0x605A, 0)) } },
    { .name = "605A = 6 as shipped, EPOS4: holds with torque",
      .kind = { INITIAL({ KEY(0x605A, 0), 6 }) },
      .method = TO_SWITCH },
    { .name = "605A = 5 as shipped, Ingenia",
      .kind = { INITIAL({ KEY(0x605A, 0), 5 }) },
      .method = TO_SWITCH },
    { .name = "605A = 6 by the rig: holds until it is switched off",
      .method = TO_SWITCH,
      .quick_stop = 6 },
    { .name = "605A = 7 and read-only: would hold after the host died",
      .kind = { INITIAL({ KEY(0x605A, 0), 7 }), READ_ONLY(KEY(0x605A, 0)) },
      .says = "0x605A" },
    { .name = "605A absent",
      .kind = { MISSING(KEY(0x605A, 0)) },
      .says = "0x605A" },
    { .name = "605C = 0, Inovance SV660: disable coasts",
      .kind = { INITIAL({ KEY(0x605C, 0), 0 }), READ_ONLY(KEY(0x605C, 0)) },
      .method = TO_SWITCH,
      .profile = true },
    { .name = "605D = 0: halt coasts",
      .kind = { INITIAL({ KEY(0x605D, 0), 0 }) },
      .method = TO_SWITCH,
      .profile = true },
    { .name = "605D = 0 and read-only",
      .kind = { INITIAL({ KEY(0x605D, 0), 0 }), READ_ONLY(KEY(0x605D, 0)) },
      .says = "0x605D" },
    { .name = "605E read-only, Schunk: fault reaction off",
      .kind = { INITIAL({ KEY(0x605E, 0), 0 }), READ_ONLY(KEY(0x605E, 0)) },
      .method = TO_SWITCH },
    /* ---- who watches whom ---- */
    { .name = "6007 = 0 as shipped, Technosoft: host may die",
      .kind = { INITIAL({ KEY(0x6007, 0), 0 }) } },
    { .name = "6007 = 1 and read-only: fault",
      .kind = { INITIAL({ KEY(0x6007, 0), 1 }), READ_ONLY(KEY(0x6007, 0)) },
      .says = "0x6007" },
    { .name = "6007 = 0 by the rig's parameters",
      .says = "0x6007",
      .parameter = &no_abort },
    { .name = "1016 = 0 by the rig's parameters",
      .says = "0x1016",
      .parameter = &no_consumer },
    { .name = "605A = 0 by the rig's parameters",
      .says = "0x605A",
      .parameter = &coasts },
    { .name = "6007 absent, Inovance, Schunk",
      .kind = { MISSING(KEY(0x6007, 0)) },
      .says = "0x6007:00 refused (06020000): needs unsupervised: yes" },
    { .name = "1016 absent",
      .kind = { MISSING(KEY(0x1016, 1)) },
      .says = "0x1016:01 refused (06020000): needs unsupervised: yes" },
    { .name = "6066 absent",
      .kind = { MISSING(KEY(0x6066, 0)) },
      .says = "0x6066:00 refused (06020000): needs unsupervised: yes" },
    { .name = "6066 fixed at 0, EPOS4",
      .kind = { READ_ONLY(KEY(0x6066, 0)) },
      .says = "0x6066:00 refused (06010002): needs unsupervised: yes" },
    { .name = "6007 absent, unsupervised",
      .kind = { MISSING(KEY(0x6007, 0)) },
      .method = TO_SWITCH,
      .unsupervised = true },
    { .name = "6007 = 1 and read-only, unsupervised",
      .kind = { INITIAL({ KEY(0x6007, 0), 1 }), READ_ONLY(KEY(0x6007, 0)) },
      .unsupervised = true },
    { .name = "6007, 1016 and 6066 absent, unsupervised",
      .kind = { MISSING(KEY(0x6007, 0), KEY(0x1016, 1), KEY(0x6066, 0)) },
      .method = TO_SWITCH,
      .unsupervised = true },
    { .name = "has all, unsupervised: it is watched all the same",
      .unsupervised = true },
    { .name = "605A absent, unsupervised: a quick stop is needed",
      .kind = { MISSING(KEY(0x605A, 0)) },
      .says = "0x605A",
      .unsupervised = true },
    { .name = "6007 takes 3 and keeps 0",
      .kind = { ONLY({ KEY(0x6007, 0), 1, 0x06090030 }) },
      .says = "0x6007" },
    { .name = "no 1016, RTR guarding alone, Ingenia, guarding not told",
      .kind = { .guarding = true },
      .says = "0x1017" },
    { .name = "no 1016, RTR guarding",
      .kind = { .guarding = true },
      .method = TO_SWITCH,
      .guarded = true },
    { .name = "guard time 100C read-only",
      .kind = { .guarding = true, READ_ONLY(KEY(0x100C, 0)) },
      .says = "0x100C",
      .guarded = true },
    { .name = "consumer starts with the first heartbeat, Trinamic",
      .kind = { .watches_late = true },
      .method = TO_SWITCH },
    /* ---- PDO ---- */
    { .name = "bit 30 of every COB-ID must stay, Lika RD4 p. 50",
      .kind = { .cob_bit_30 = 1,
                INITIAL({ KEY(0x1400, 1), 0x40000201 },
                        { KEY(0x1401, 1), 0x40000301 },
                        { KEY(0x1402, 1), 0x40000401 },
                        { KEY(0x1403, 1), 0x40000501 }) },
      .method = TO_SWITCH },
    { .name = "bit 30 must stay clear, Roboteq",
      .kind = { .cob_bit_30 = 1, INITIAL({ KEY(0x1800, 1), 0x181 }) },
      .method = TO_SWITCH },
    { .name = "bit 30 must be set in a TPDO, and does not show",
      .kind = { .tpdo_bit_30 = true,
                INITIAL({ KEY(0x1800, 1), 0x181 }, { KEY(0x1801, 1), 0x281 }) },
      .method = TO_SWITCH,
      .inputs = true },
    { .name = "bit 30 must be clear in an RPDO, and is set",
      .kind = { .rpdo_no_bit_30 = true,
                INITIAL({ KEY(0x1400, 1), 0x40000201 },
                        { KEY(0x1401, 1), 0x40000301 }) },
      .method = TO_SWITCH },
    /* ---- maps that are fixed, and right ---- */
    { .name = "RPDO1 and TPDO1 fixed, and right",
      .kind = { AS_NEEDED, READ_ONLY(KEY(0x1600, 0), KEY(0x1600, 1),
                                     KEY(0x1A00, 0), KEY(0x1A00, 1)) },
      .method = TO_SWITCH },
    { .name = "maps fixed and right, 1400:1 too, Nanotec PD4N",
      .kind = { AS_NEEDED,
                READ_ONLY(KEY(0x1600, 0), KEY(0x1A00, 0), KEY(0x1400, 1)),
                ONLY({ KEY(0x1400, 2), 1, 0x06010002 }) },
      .method = TO_SWITCH },
    { .name = "a COB-ID written is never answered, all is right, eRob",
      .kind = { AS_NEEDED, .cob_mute = true, ALL_OFF } },
    { .name = "a COB-ID written is never answered, and is wrong",
      .kind = { .cob_mute = true, ALL_OFF },
      .says = "0x1400" },
    { .name = "map fixed and right, type to be set",
      .kind = { AS_NEEDED_BUT_TYPE, READ_ONLY(KEY(0x1600, 0), KEY(0x1600, 1),
                                              KEY(0x1A00, 0), KEY(0x1A00, 1)) },
      .method = TO_SWITCH },
    { .name = "map fixed, one entry too many",
      .kind = { .initial = { { KEY(0x1600, 0), 3 },
                             { KEY(0x1600, 2), 0x607A0020 },
                             { KEY(0x1600, 3), 0x60600008 } },
                READ_ONLY(KEY(0x1600, 0)) },
      .says = "0x1600" },
    { .name = "map right, TPDO1's inhibit time is not",
      .kind = { .initial = { { KEY(0x1A00, 0), 2 },
                             { KEY(0x1A00, 2), 0x60640020 },
                             { KEY(0x1800, 1), 0x40000181 },
                             { KEY(0x1800, 2), 1 },
                             { KEY(0x1800, 3), 300 } } },
      .method = TO_SWITCH },
    { .name = "two PDOs alone, Pilz",
      .kind = { MISSING(KEY(0x1402, 1), KEY(0x1402, 2), KEY(0x1403, 1),
                        KEY(0x1403, 2), KEY(0x1802, 1), KEY(0x1803, 1)) },
      .method = TO_SWITCH },
    { .name = "maps fixed, Elmo Gold",
      .kind = { READ_ONLY(KEY(0x1600, 0), KEY(0x1600, 1)) },
      .says = "0x1600" },
    { .name = "1400:1 fixed, Nanotec PD4N",
      .kind = { READ_ONLY(KEY(0x1400, 1)) },
      .says = "0x1400" },
    { .name = "its home input is relied on, TPDO2 reports it", .inputs = true },
    { .name = "its home input is relied on, no 60FD",
      .kind = { MISSING(KEY(0x60FD, 0)) },
      .says = "0x1A01",
      .inputs = true },
    { .name = "its home input is relied on, no TPDO2",
      .kind = { MISSING(KEY(0x1801, 1)) },
      .says = "0x1801",
      .inputs = true },
    { .name = "its home input is relied on, TPDO2 fixed",
      .kind = { READ_ONLY(KEY(0x1A01, 0)) },
      .says = "0x1A01",
      .inputs = true },
    { .name = "no TPDO2, and none needed",
      .kind = { MISSING(KEY(0x1801, 1)) } },
    { .name = "inhibit time of 30 ms fixed, Technosoft",
      .kind = { INITIAL({ KEY(0x1800, 3), 300 }), READ_ONLY(KEY(0x1800, 3)) },
      .says = "0x1800" },
    { .name = "inhibit time 5 ms, BLV-R",
      .kind = { INITIAL({ KEY(0x1800, 3), 50 }) } },
    { .name = "type 1 refused, BLV-R",
      .kind = { ONLY({ KEY(0x1800, 2), 255, 0x06090030 }) },
      .says = "0x1800" },
    { .name = "no event timer sub 5, inhibit sub 3 absent",
      .kind = { MISSING(KEY(0x1800, 3)) } },
    { .name = "type 1 taken, 0 kept: silently not sent, Lika p. 51",
      .kind = { READ_ONLY(KEY(0x1800, 2)), INITIAL({ KEY(0x1800, 2), 0 }) },
      .says = "0x1800" },
    /* ---- interpolation, SYNC ---- */
    { .name = "no 1006, EPOS4",
      .kind = { MISSING(KEY(0x1006, 0)) },
      .method = TO_SWITCH },
    { .name = "60C2 fixed at 1 ms, EPOS2",
      .kind = { READ_ONLY(KEY(0x60C2, 1), KEY(0x60C2, 2)) },
      .method = TO_SWITCH },
    { .name = "60C2 fixed at 2 ms",
      .kind = { READ_ONLY(KEY(0x60C2, 1)), INITIAL({ KEY(0x60C2, 1), 2 }) },
      .says = "0x60C2" },
    { .name = "60C2:2 takes -3 alone, Delta",
      .kind = { ONLY({ KEY(0x60C2, 2), 0xFD, 0x06090030 }) },
      .method = TO_SWITCH },
    /* ---- SDO ---- */
    { .name = "answers after 50 ms",
      .kind = { .sdo_ns = 50 * MS },
      .method = TO_SWITCH },
    { .name = "answers after 150 ms",
      .kind = { .sdo_ns = 150 * MS },
      .method = TO_SWITCH },
    { .name = "answers after 300 ms",
      .kind = { .sdo_ns = 300 * MS },
      .method = TO_SWITCH },
    { .name = "answers after 1.5 s, the rig says 2 s",
      .kind = { .sdo_ns = 1500 * MS },
      .boot_ms = 300000,
      .sdo_ms = 2000 },
    { .name = "answers after 1.5 s",
      .kind = { .sdo_ns = 1500 * MS },
      .boot_ms = 300000,
      .says = "does not answer for 200 ms, object 0x" },
    { .name = "every third answer after 230 ms",
      .kind = { .sdo_ns = 20 * MS, .late_one_in = 3, .late_ns = 230 * MS },
      .method = TO_SWITCH },
    { .name = "every fifth answer after 390 ms",
      .kind = { .sdo_ns = 20 * MS, .late_one_in = 5, .late_ns = 390 * MS },
      .method = TO_SWITCH },
    { .name = "every seventh answer after 201 ms",
      .kind = { .sdo_ns = 20 * MS, .late_one_in = 7, .late_ns = 201 * MS },
      .method = TO_SWITCH },
    { .name = "reads are answered by segments",
      .kind = { .reads = QUIRK_SEGMENTS },
      .method = TO_SWITCH },
    { .name = "reads are answered by segments, without a size, some late",
      .kind = { .reads = QUIRK_SEGMENTS_NO_SIZE,
                .late_one_in = 8,
                .late_ns = 250 * MS },
      .method = TO_SWITCH },
    { .name = "6098 is longer than by the book",
      .kind = { ONLY({ KEY(0x6098, 0), 255, 0x06070010 }) },
      .says = "0x6098",
      .method = TO_SWITCH },
    { .name = "CSP not there, Pilz 6502 = 0x43",
      .kind = { INITIAL({ KEY(0x6502, 0), 0x43 }) },
      .says = "0x6502" },
    /* ---- boot ---- */
    { .name = "boots after 8 s",
      .kind = { .boot_ns = 8000 * MS },
      .boot_ms = 10000 },
    { .name = "vendor with a division, Schneider 0x0200005A",
      .kind = { INITIAL({ KEY(0x1018, 1), 0x0200005A }) } },
    { .name = "heartbeat before boot-up", .kind = { .beats_first = true } },
    { .name = "EMCY at boot",
      .kind = { .emcy_at_boot = true },
      .method = TO_SWITCH },
    { .name = "reboots in operation",
      .kind = { .event = QUIRK_REBOOTS, .event_ns = 300 * MS },
      .says = "TPDO1" },
    { .name = "falls to pre-operational, stage on",
      .kind = { .event = QUIRK_NMT_DROP, .event_ns = 300 * MS },
      .says = "TPDO1" },
    { .name = "no TPDO any more, stage on",
      .kind = { .event = QUIRK_MUTE, .event_ns = 300 * MS },
      .says = "TPDO1" },
    { .name = "no TPDO, no SDO, holds after a quick stop",
      .kind = { .event = QUIRK_DEAF, .event_ns = 300 * MS },
      .says = "TPDO1",
      .quick_stop = 6 },
    /* ---- state machine ---- */
    { .name = "leaves operation, no fault, Elmo Gold (fastcat PR 161)",
      .kind = { .event = QUIRK_LEAVES, .event_ns = 300 * MS },
      .says = "0x6041" },
    { .name = "re-enters operation after a quick stop, Elmo (jsd PR 93)",
      .kind = { .re_enters = true },
      .method = TO_SWITCH },
    { .name = "precharge takes 8 s, the rig says 10 s",
      .kind = { .precharge_ns = 8000 * MS },
      .precharge_ms = 10000 },
    { .name = "precharge takes 8 s",
      .kind = { .precharge_ns = 8000 * MS },
      .says = "no power (STO or mains) for 3000 ms" },
    { .name = "brake takes 7 s, the rig says 8 s",
      .kind = { .brake_ns = 7000 * MS },
      .brake_ms = 8000 },
    { .name = "brake takes 7 s",
      .kind = { .brake_ns = 7000 * MS },
      .says = "for 3000 ms (brake), 0x6041=" },
    { .name = "mode takes 8 s, the rig says 2 s for a state",
      .kind = { .mode_ns = 8000 * MS },
      .state_ms = 2000 },
    { .name = "mode takes 8 s",
      .kind = { .mode_ns = 8000 * MS },
      .says = "0x6061:00 stays at 0x00000000 for 5000 ms" },
    { .name = "precharge 2 s after Shutdown",
      .kind = { .precharge_ns = 2000 * MS },
      .method = TO_SWITCH },
    { .name = "no voltage ever",
      .kind = { .precharge_ns = 3600 * 1000 * MS },
      .says = "0x6041" },
    { .name = "brake opens in 1.5 s",
      .kind = { .brake_ns = 1500 * MS },
      .method = TO_SWITCH },
    { .name = "two controlwords in 0.9 ms: one lost, Technosoft",
      .kind = { .word_gap_ns = 900000 },
      .method = TO_SWITCH },
    { .name = "a fault needs the second edge of bit 7",
      .kind = { .resets = 1 } },
    { .name = "no reset after 0x8130 but by NMT, EPOS4",
      .kind = { .reset_by_nmt = true } },
    { .name = "mode display late",
      .kind = { .mode_ns = 700 * MS },
      .method = TO_SWITCH },
    { .name = "mode change refused while halted, ENGEL HBI",
      .kind = { .mode_not_halted = true },
      .says = "0x6060",
      .profile = true },
    { .name = "bits 14 and 15 up",
      .kind = { .status = 0xC000 },
      .method = TO_SWITCH },
    /* ---- bits ---- */
    { .name = "bits 10, 12, 13 three SYNCs old",
      .kind = { .linger = 3 },
      .method = TO_SWITCH,
      .profile = true },
    { .name = "bits 10, 12, 13 seven SYNCs old",
      .kind = { .linger = 7 },
      .method = TO_SWITCH,
      .profile = true },
    { .name = "bit 10 of the last profile for 6 ms",
      .kind = { .old_reached_ns = 6 * MS },
      .profile = true },
    { .name = "bits of the last homing for 40 ms",
      .kind = { .old_bits_ns = 40 * MS },
      .method = TO_SWITCH },
    { .name = "bits of the last homing to the end of the next",
      .kind = { .old_bits = true },
      .says = "0x6041",
      .method = TO_SWITCH },
    { .name = "bits of the last homing to the end of the next, 605C = 0",
      .kind = { .old_bits = true,
                INITIAL({ KEY(0x605C, 0), 0 }),
                READ_ONLY(KEY(0x605C, 0)) },
      .says = "0x6041",
      .method = TO_SWITCH },
    { .name = "homing is not begun",
      .kind = { .ignores_start = true },
      .says = "0x6041",
      .method = TO_SWITCH },
    { .name = "no bit 10 in homing, JVL",
      .kind = { .no_bit_10 = true },
      .says = "0x6041",
      .method = TO_SWITCH },
    /* ---- home offset ---- */
    { .name = "6064 = -607C, Elmo p. 55",
      .kind = { .offset = QUIRK_OFFSET_MINUS },
      .method = TO_SWITCH },
    { .name = "6064 = 607C",
      .kind = { .offset = QUIRK_OFFSET_PLUS },
      .method = TO_SWITCH },
    { .name = "moves by 607C, EPOS2",
      .kind = { .offset = QUIRK_OFFSET_MOVES },
      .method = TO_SWITCH },
    { .name = "no 607C, EPOS4",
      .kind = { MISSING(KEY(0x607C, 0)) },
      .method = TO_SWITCH },
    { .name = "607C read-only, 3000, Inovance",
      .kind = { READ_ONLY(KEY(0x607C, 0)), INITIAL({ KEY(0x607C, 0), 3000 }) },
      .says = "0x607C",
      .method = TO_SWITCH },
    { .name = "607D minus 607C, Nanotec N5",
      .kind = { .limits_minus_offset = true,
                INITIAL({ KEY(0x607C, 0), 400000 }) },
      .method = TO_SWITCH,
      .limits = true },
    { .name = "607D minus 607C, not homed",
      .kind = { .limits_minus_offset = true,
                INITIAL({ KEY(0x607C, 0), 400000 }) },
      .limits = true },
    { .name = "607D:2 alone",
      .kind = { .refuses = { { KEY(0x607D, 1), 0x06010000 } } },
      .says = "0x607D:01",
      .limits = true },
    { .name = "607D:1 alone",
      .kind = { .refuses = { { KEY(0x607D, 2), 0x06010000 } } },
      .says = "0x607D:02",
      .limits = true },
    { .name = "607D refused in other words",
      .kind = { .refuses = { { KEY(0x607D, 1), 0x08000000 },
                             { KEY(0x607D, 2), 0x08000000 } } },
      .limits = true },
    { .name = "outside its range, clamps to 607D",
      .limits = true,
      .outside = true },
    { .name = "outside its range, no 607D",
      .kind = { MISSING(KEY(0x607D, 1), KEY(0x607D, 2)) },
      .limits = true,
      .outside = true },
    { .name = "outside its range, SDOs take 150 ms",
      .kind = { .sdo_ns = 150 * MS },
      .limits = true,
      .outside = true },
    { .name = "6064 is anything after homing",
      .kind = { .home_wrong = 40000 },
      .says = "0x6064",
      .method = TO_SWITCH },
    { .name = "homing where it stands, 37",
      .kind = { .old_bits = true },
      .method = 37 },
    /* ---- as its maker builds it, with slew's own quirks and no line in the
     * rig; then the same without them ---- */
    { .name = "maxon EPOS4",
      .kind = { EPOS4, READ_ONLY(KEY(0x6066, 0)), .reset_by_nmt = true,
                MISSING(KEY(0x1006, 0), KEY(0x607C, 0)) },
      .method = TO_SWITCH,
      .found = true },
    { .name = "maxon EPOS4 without its quirks",
      .kind = { EPOS4, READ_ONLY(KEY(0x6066, 0)) },
      .says = "0x6066" },
    { .name = "maxon EPOS4 whose 6066 is not what its quirks say",
      .kind = { .initial = { IS(0xFB, 0x65520000), { KEY(0x6066, 0), 500 } },
                READ_ONLY(KEY(0x6066, 0)) },
      .says = "0x6066:00 reads back 0x000001F4",
      .found = true },
    { .name = "maxon EPOS4 by the rig",
      .kind = { EPOS4, READ_ONLY(KEY(0x6066, 0)) },
      .quirks = "maxon-epos4" },
    { .name = "quirks by the rig, of another drive",
      .kind = { INITIAL(IS(0xFB, 0x64200000)) },
      .says = "0x1018 is 0x000000FB, 0x64200000: its quirks are another's",
      .quirks = "maxon-epos4" },
    { .name = "quirks by the rig, of no number at all: no 1018",
      .kind = { MISSING(KEY(0x1018, 1), KEY(0x1018, 2)) },
      .quirks = "jvl-mis" },
    { .name = "no 1018", /* which is mandatory */
      .kind = { MISSING(KEY(0x1018, 1), KEY(0x1018, 2)) },
      .found = true },
    { .name = "maxon EPOS2",
      .kind = { EPOS2, READ_ONLY(KEY(0x60C2, 1), KEY(0x60C2, 2)),
                .offset = QUIRK_OFFSET_MOVES },
      .method = TO_SWITCH,
      .found = true },
    { .name = "maxon EPOS2 without its quirks",
      .kind = { EPOS2 },
      .says = "0x6502" },
    { .name = "maxon EPOS2, the rig says csp",
      .kind = { EPOS2 },
      .says = "no cyclic position mode: 0x6502 is 0x",
      .found = true,
      .csp = true },
    { .name = "Elmo Gold",
      .kind = { INITIAL(IS(0x9A, 0x30924)), .re_enters = true,
                .offset = QUIRK_OFFSET_MINUS },
      .method = TO_SWITCH,
      .found = true },
    { .name = "Inovance SV660",
      .kind = { INITIAL(IS(0x100000, 0xC010D), { KEY(0x605C, 0), 0 }),
                MISSING(KEY(0x6007, 0), KEY(0x1A01, 0), KEY(0x1801, 1)) },
      .says = "0x6007:00 refused (06020000): needs unsupervised: yes",
      .found = true },
    { .name = "Inovance SV660, unsupervised",
      .kind = { INITIAL(IS(0x100000, 0xC010D), { KEY(0x605C, 0), 0 }),
                MISSING(KEY(0x6007, 0), KEY(0x1A01, 0), KEY(0x1801, 1)) },
      .method = TO_SWITCH,
      .found = true,
      .unsupervised = true },
    { .name = "Delta ASDA-A2",
      .kind = { INITIAL(IS(0x1DD, 0x10305070)), .guarding = true,
                ONLY({ KEY(0x60C2, 2), 0xFD, 0x06090030 }) },
      .method = TO_SWITCH,
      .found = true },
    { .name = "Delta ASDA-A2 without its quirks",
      .kind = { INITIAL(IS(0x1DD, 0x10305070)), .guarding = true },
      .says = "0x1017" },
    { .name = "Delta ASDA-A3",
      .kind = { INITIAL(IS(0x1DD, 0x6010)),
                ONLY({ KEY(0x60C2, 2), 0xFD, 0x06090030 }) },
      .method = TO_SWITCH,
      .found = true },
    { .name = "Leadshine",
      .kind = { INITIAL(IS(0x4321, 0x2100)) },
      .method = TO_SWITCH,
      .found = true },
    { .name = "Technosoft iPOS",
      .kind = { INITIAL(IS(0x1A3, 1), { KEY(0x6007, 0), 0 },
                        { KEY(0x1800, 3), 300 }),
                .word_gap_ns = 900000 },
      .method = TO_SWITCH,
      .found = true },
    { .name = "Nanotec N5",
      .kind = { INITIAL(IS(0x26C, 1), { KEY(0x607C, 0), 400000 }),
                .limits_minus_offset = true },
      .method = TO_SWITCH,
      .limits = true,
      .found = true },
    { .name = "Oriental Motor BLV-R",
      .kind = { INITIAL(IS(0x2BE, 5143), { KEY(0x1800, 3), 50 }) },
      .method = TO_SWITCH,
      .found = true },
    { .name = "Pilz PRBT",
      .kind = { INITIAL({ KEY(0x6502, 0), 0x43 }),
                MISSING(KEY(0x1402, 1), KEY(0x1402, 2), KEY(0x1403, 1),
                        KEY(0x1403, 2), KEY(0x1802, 1), KEY(0x1803, 1)) },
      .quirks = "pilz-prbt" },
    { .name = "Ingenia, unsupervised",
      .kind = { .guarding = true,
                INITIAL({ KEY(0x605A, 0), 5 }),
                MISSING(KEY(0x6007, 0)) },
      .method = TO_SWITCH,
      .quirks = "ingenia",
      .unsupervised = true },
    { .name = "Lexium 32",
      .kind = { INITIAL({ KEY(0x6502, 0), 0x65 }), .ip_needs_3006 = true },
      .method = TO_SWITCH,
      .quirks = "lexium-32" },
    { .name = "JVL MIS",
      .kind = { .no_bit_10 = true },
      .method = TO_SWITCH,
      .quirks = "jvl-mis" },
    { .name = "JVL MIS, homing where it stands",
      .kind = { .no_bit_10 = true, .old_bits = true },
      .method = 37,
      .quirks = "jvl-mis" },
    /* ---- what it only says ---- */
    { .name = "EMCY without a fault",
      .kind = { .event = QUIRK_EMCY, .event_ns = 300 * MS },
      .events = 1u << HAL_DRIVE_EVENT_EMERGENCY },
    { .name = "warning, bit 7",
      .kind = { .event = QUIRK_WARNS, .event_ns = 300 * MS },
      .events = 1u << HAL_DRIVE_EVENT_WARNING },
    { .name = "internal limit, bit 11",
      .kind = { .event = QUIRK_LIMITS, .event_ns = 300 * MS },
      .events = 1u << HAL_DRIVE_EVENT_LIMIT },
    { .name = "does not follow, bit 12",
      .kind = { .event = QUIRK_LAGS, .event_ns = 300 * MS },
      .events = 1u << HAL_DRIVE_EVENT_NOT_FOLLOWING },
};

/* ---- the chain ----------------------------------------------------------- */

static struct bench {
    const struct row *row;
    struct sim_world world;
    struct sim_can_bus bus;
    struct sim_can_port port;
    struct quirk_servo servo;
    struct canopen master;
    struct drive_cia402 drive;
    struct controller controller;
    struct controller_axis_config axis_config;
    struct controller_axis axis;
    struct controller_jog jog;
    struct homing homing;
    struct homing_config homing_config;
    char text[64]; /* the first sentence */
    bool had_torque;
    int64_t homing_ns; /* the last one began */
} bench;

static void tick(struct bench *b)
{
    struct hal_fieldbus_worst worst = { HAL_FIELDBUS_GOOD, 0 };
    struct hal_drive_feedback seen;

    sim_world_run(&b->world, b->world.now_ns + MS);
    worst.health = hal_fieldbus_begin(&b->master.fieldbus, b->world.now_ns);
    controller_step(&b->controller, b->world.now_ns, worst);
    hal_fieldbus_end(&b->master.fieldbus, b->world.now_ns);
    controller_jog_step(&b->controller, &b->jog);
    homing_step(&b->homing);
    b->had_torque |= b->servo.energised;
    hal_drive_feedback(&b->drive.drive, &seen);
    if (b->text[0] == 0 && seen.state != HAL_DRIVE_OFFLINE)
        memcpy(b->text, seen.fault_text, sizeof b->text);
    if (b->text[0] == 0 && b->drive.phase == DRIVE_CIA402_LOST)
        memcpy(b->text, seen.fault_text, sizeof b->text);
}

static void ticks(struct bench *b, unsigned count)
{
    while (count-- > 0)
        tick(b);
}

/* It stands at 123.456. */
static int64_t range_max(const struct row *row)
{
    if (row->outside)
        return 100 * ONE;
    return row->limits ? 300 * ONE : 0;
}

/* As a rig has them. */
static void bench_quirks(struct bench *b, struct drive_cia402_config *config)
{
    const struct row *row = b->row;
    char message[YAML_MESSAGE_MAX], path[FILES_PATH_MAX];
    static struct quirk_file file;

    config->stream_given = row->csp;
    config->quirk_is_given = row->quirks != NULL;
    if (row->quirks != NULL) {
        assert_true(
            disk_files.find(&disk_files, FILES_QUIRKS, row->quirks, "", path));
        if (quirk_load(&disk_files, path, &file, message) < 0)
            fail_msg("%s", message);
        config->quirk = &file.quirk;
        config->quirk_count = 1;
    } else if (row->found) {
        const struct quirk_set *own = quirk_own(&disk_files, message);

        if (own == NULL)
            fail_msg("%s", message);
        config->quirk = own->quirk;
        config->quirk_count = own->count;
    }
}

static void bench_drive(struct bench *b)
{
    const struct row *row = b->row;
    struct drive_cia402_config config = {
        CANOPEN_BENCH_COUNTS,
        .node_id = 1,
        .following_error_counts = 5000,
        .following_error_ms = 2,
        .quick_stop_counts_s2 = 2000000,
        .inputs = row->inputs,
        .unsupervised = row->unsupervised,
        .sdo_timeout_ns = row->sdo_ms * MS,
        .state_timeout_ns = row->state_ms * MS,
        .brake_timeout_ns = row->brake_ms * MS,
        .precharge_timeout_ns = row->precharge_ms * MS,
        .guard_period_ns = row->guarded ? 20 * MS : 0,
        .pos_min_q32 = row->limits ? -300 * ONE : 0,
        .pos_max_q32 = range_max(row),
        .limits_when_homed = row->limits && row->method != 0,
        .parameter = row->parameter,
        .parameter_count = row->parameter != NULL,
        .option[DRIVE_CIA402_QUICK_STOP] = { row->quick_stop != 0,
                                             row->quick_stop },
    };

    bench_quirks(b, &config);
    assert_int_equal(drive_cia402_init(&b->drive, &b->master, &config), 0);
}

static void bench_controller(struct bench *b)
{
    struct hal_drive *drive[] = { &b->drive.drive };
    b->homing_config = (struct homing_config){
        .by = b->row->method != 0 ? HOMING_DRIVE : HOMING_NONE,
        .method = b->row->method,
        .fast_q32 = 50 * ONE,
        .slow_q32 = 5 * ONE,
        .pos_q32 = HOME_AT,
        .timeout_ns = 8000 * MS,
    };
    struct controller_config config = {
        .period_ns = MS,
        .axis_count = 1,
        .axis = &b->axis_config,
        .enable_timeout_ns = 12000 * MS, /* longer than any wait of the drive */
    };

    b->axis_config = (struct controller_axis_config){
        .pos_min_q32 = -1000 * ONE,
        .pos_max_q32 = b->row->outside ? range_max(b->row) : 1000 * ONE,
        .limit = { 100 * ONE, 1000 * ONE, 0 },
        .stop = { 100 * ONE, 2000 * ONE, 0 },
        .following_floor_q32 = 2 * ONE,
    };
    assert_int_equal(
        controller_init(&b->controller, &config, &b->axis, drive, NULL), 0);
    assert_int_equal(
        homing_init(&b->homing, &b->controller, &b->jog, &b->homing_config), 0);
}

static void bench_of(struct bench *b, const struct row *row)
{
    static const struct canopen_config master = CANOPEN_BENCH_MASTER;

    memset(b, 0, sizeof *b);
    b->row = row;
    canopen_bench_wire(&b->world, &b->bus, &b->port);
    assert_int_equal(canopen_init(&b->master, &b->port.can, &master), 0);
    assert_int_equal(quirk_servo_init(&b->servo, &b->bus, 1, &row->kind), 0);
    bench_drive(b);
    bench_controller(b);
}

/* ---- its life ------------------------------------------------------------ */

/* True: it is in `state`.  False: it has come to its end. */
static bool until(struct bench *b, enum controller_state state, unsigned most)
{
    while (most-- > 0 && b->controller.state != state &&
           (b->controller.state != CONTROLLER_FAULT ||
            state == CONTROLLER_FAULT || b->controller.resetting))
        tick(b);
    return b->controller.state == state;
}

static bool found(struct bench *b)
{
    int64_t most = b->row->boot_ms != 0 ? b->row->boot_ms : 60000;

    while (most-- > 0 && b->drive.state != HAL_DRIVE_OFF) {
        tick(b);
        if (b->drive.state == HAL_DRIVE_FAULT)
            return false;
    }
    return b->drive.state == HAL_DRIVE_OFF;
}

static bool enabled(struct bench *b)
{
    if (b->controller.state == CONTROLLER_READY)
        return true;
    b->text[0] = 0;
    return controller_enable(&b->controller) == MOTION_OK &&
           until(b, CONTROLLER_READY, 20000);
}

static void jog_to(struct bench *b, int64_t pos_q32)
{
    const struct controller_jog_goal goal = { .pos_q32 = pos_q32,
                                              .vel_q32 = 100 * ONE };

    assert_int_equal(controller_jog(&b->controller, &b->jog, &goal), MOTION_OK);
}

static int64_t where(const struct bench *b)
{
    return b->controller.axis[0].feedback.pos_q32;
}

/* 60 units one way in 0.7 s, stopped on its way back. */
static bool moves(struct bench *b)
{
    const int64_t from_q32 = b->controller.axis[0].target.pos_q32;

    jog_to(b, from_q32 + 60 * ONE);
    if (!until(b, CONTROLLER_READY, 3000))
        return false;
    ticks(b, 10);
    assert_in_range(llabs(where(b) - from_q32 - 60 * ONE), 0, ONE / 100);
    jog_to(b, from_q32);
    ticks(b, 200);
    controller_jog_stop(&b->controller, &b->jog, true);
    return until(b, CONTROLLER_READY, 1000);
}

static bool no_torque(struct bench *b, unsigned most)
{
    while (most-- > 0 && b->servo.energised)
        tick(b);
    return !b->servo.energised;
}

/* A fault of the drive's own, at speed; afterwards off, and only by request on
 * again. */
static bool faults(struct bench *b)
{
    jog_to(b, where(b) - 60 * ONE);
    ticks(b, 200);
    quirk_servo_fault(&b->servo, 0x8130);
    b->text[0] = 0;
    assert_true(until(b, CONTROLLER_FAULT, 1000));
    assert_true(no_torque(b, 1000));
    ticks(b, 100);
    assert_non_null(strstr(b->text, "8130"));
    for (unsigned i = 0; i < 3 && b->controller.state == CONTROLLER_FAULT;
         i++) {
        (void)controller_reset(&b->controller);
        until(b, CONTROLLER_OFF, 20000);
    }
    assert_int_equal(b->controller.state, CONTROLLER_OFF);
    if (fabs(b->servo.vel) > 1000)
        fail_msg("%s: reset while it rolls, %g counts/s", b->row->name,
                 b->servo.vel);
    ticks(b, 100);
    assert_false(b->servo.energised);
    return enabled(b);
}

/* It is told to stop by itself, at speed. */
static bool quick_stops(struct bench *b)
{
    jog_to(b, where(b) - 60 * ONE);
    ticks(b, 200);
    hal_drive_request(&b->drive.drive, HAL_DRIVE_REQUEST_QUICK_STOP);
    assert_true(until(b, CONTROLLER_FAULT, 1000));
    assert_true(no_torque(b, 1000));
    ticks(b, 100);
    assert_int_equal(controller_reset(&b->controller), MOTION_OK);
    assert_true(until(b, CONTROLLER_OFF, 20000));
    return enabled(b);
}

/* The axis is where it says, by the home place. */
static void expect_home(struct bench *b)
{
    const double place =
        b->row->method == 37 ? b->servo.pos : b->servo.home_place;
    const int64_t true_q32 =
        HOME_AT + (int64_t)((b->servo.pos - place) / 1000 * 4294967296.0);

    ticks(b, 20);
    if (llabs(where(b) - true_q32) > ONE / 100)
        fail_msg("%s: at %g, says %g", b->row->name,
                 (double)true_q32 / 4294967296.0,
                 (double)where(b) / 4294967296.0);
}

static bool homes(struct bench *b)
{
    for (unsigned i = 0; b->row->method != 0 && i < 2; i++) {
        const double from = b->servo.pos;

        b->text[0] = 0;
        b->homing_ns = b->world.now_ns;
        assert_int_equal(homing_start(&b->homing, 1), MOTION_OK);
        while (homing_is_running(&b->homing))
            tick(b);
        if (b->homing.state != HOMING_DONE)
            return false;
        if (b->row->method != 37 && from == b->servo.pos && i == 0)
            fail_msg("%s: homed where it stood", b->row->name);
        expect_home(b);
        if (!moves(b))
            return false;
    }
    return true;
}

static bool mode_is(struct bench *b, enum hal_drive_mode mode)
{
    int err = hal_drive_set_mode(&b->drive.drive, mode);

    for (unsigned i = 0;
         i < 6000 && (err != MOTION_OK || b->drive.mode != mode ||
                      b->drive.job != DRIVE_CIA402_NO_JOB);
         i++) {
        tick(b);
        if (err != MOTION_OK)
            err = hal_drive_set_mode(&b->drive.drive, mode);
    }
    return b->drive.mode == mode;
}

/* To a position by its own ramps, there and not before; then halted, and back
 * to set points. */
static bool goes(struct bench *b)
{
    struct controller_axis *axis = &b->controller.axis[0];
    struct hal_drive_go go = { .vel_q32 = 80 * ONE, .timeout_ns = 9000 * MS };
    int64_t to_q32;

    if (!b->row->profile)
        return true;
    axis->by_profile = true;
    assert_true(mode_is(b, HAL_DRIVE_PROFILE_POSITION));
    for (unsigned i = 0; i < 3; i++) {
        to_q32 = go.pos_q32 = where(b) - axis->offset_q32 + 30 * ONE;
        assert_int_equal(hal_drive_go(&b->drive.drive, &go), MOTION_OK);
        for (unsigned n = 0; n < 9000 && !axis->feedback.arrived; n++)
            tick(b);
        assert_true(axis->feedback.arrived);
        if (fabs(b->servo.pos - b->servo.zero - b->servo.target) > 10)
            fail_msg("%s: arrived %g counts before", b->row->name,
                     b->servo.target - (b->servo.pos - b->servo.zero));
    }
    go.pos_q32 = to_q32 - 60 * ONE;
    assert_int_equal(hal_drive_go(&b->drive.drive, &go), MOTION_OK);
    ticks(b, 400 + (unsigned)(b->row->kind.sdo_ns / MS) * 5);
    assert_int_equal(hal_drive_halt(&b->drive.drive), MOTION_OK);
    ticks(b, 500);
    if (!mode_is(b, HAL_DRIVE_STREAM_POSITION))
        return false;
    axis->by_profile = false;
    ticks(b, 10);
    return b->controller.state == CONTROLLER_READY;
}

/* Off in the middle of such a motion. */
static bool goes_off(struct bench *b)
{
    struct controller_axis *axis = &b->controller.axis[0];
    const struct hal_drive_go go = { .pos_q32 =
                                         where(b) - axis->offset_q32 + 60 * ONE,
                                     .vel_q32 = 80 * ONE };

    if (!b->row->profile)
        return true;
    axis->by_profile = true;
    assert_true(mode_is(b, HAL_DRIVE_PROFILE_POSITION));
    assert_int_equal(hal_drive_go(&b->drive.drive, &go), MOTION_OK);
    ticks(b, 400 + (unsigned)(b->row->kind.sdo_ns / MS) * 5);
    assert_true(fabs(b->servo.vel) > 10000);
    hal_drive_request(&b->drive.drive, HAL_DRIVE_REQUEST_OFF);
    assert_true(until(b, CONTROLLER_FAULT, 1000));
    assert_true(no_torque(b, 1000));
    axis->by_profile = false;
    assert_int_equal(controller_reset(&b->controller), MOTION_OK);
    assert_true(until(b, CONTROLLER_OFF, 20000));
    return enabled(b);
}

/* Nobody speaks any more. */
static void dies(struct bench *b)
{
    jog_to(b, where(b) - 40 * ONE);
    ticks(b, 200);
    assert_true(b->servo.energised);
    sim_world_run(&b->world, b->world.now_ns + 1500 * MS);
    if (b->servo.energised)
        fail_msg("%s: torque after the host died", b->row->name);
}

/* It has what makes it stop by itself. */
static bool watches(struct bench *b)
{
    return !b->row->unsupervised ||
           (quirk_get(&b->servo, KEY(0x6007, 0)) == 3 &&
            quirk_get(&b->servo, KEY(0x1016, 1)) != 0);
}

/* Enabled outside its range it stays where it is, and is moved inward; there
 * its software limits are the range. */
static bool comes_inside(struct bench *b)
{
    const double from = b->servo.pos;

    if (!b->row->outside)
        return true;
    if (!enabled(b))
        return false;
    ticks(b, 200);
    if (fabs(b->servo.pos - from) > 10)
        fail_msg("%s: leapt %g counts", b->row->name, b->servo.pos - from);
    jog_to(b, 20 * ONE);
    if (!until(b, CONTROLLER_READY, 3000))
        return false;
    ticks(b, 10);
    assert_in_range(llabs(where(b) - 20 * ONE), 0, ONE / 100);
    if (quirk_servo_object(&b->servo, KEY(0x607D, 2)) != NULL)
        assert_int_equal(quirk_servo_object(&b->servo, KEY(0x607D, 2))->value,
                         100001);
    return true;
}

static bool lives(struct bench *b)
{
    if (!found(b))
        return false;
    for (unsigned k = 1; k < 4; k++) { /* nobody else moves it */
        const struct quirk_object *cob =
            quirk_servo_object(&b->servo, KEY(0x1400 + k, 1));

        if (cob != NULL && cob->value >> 31 == 0)
            fail_msg("%s: RPDO%u is left valid", b->row->name, k + 1);
    }
    if (!comes_inside(b) || !enabled(b) || !moves(b) || !goes(b) ||
        !goes_off(b) || !homes(b) || !quick_stops(b) || !faults(b))
        return false;
    assert_int_equal(controller_off(&b->controller), MOTION_OK);
    assert_true(no_torque(b, 200));
    if (!enabled(b) || !moves(b))
        return false;
    if (b->row->quick_stop < 5 && watches(b)) /* else: so the rig says */
        dies(b);
    return true;
}

/* ---- claims -------------------------------------------------------------- */

/* What it lacks is found before there is any torque, unless it shows in motion
 * alone. */
static void judge_refusal(const struct bench *b)
{
    const struct row *row = b->row;

    if (b->had_torque && row->kind.event == QUIRK_NOTHING && row->method == 0 &&
        !row->profile)
        fail_msg("%s: torque before \"%s\"", row->name, b->text);
    if (row->method != 0 && b->axis.homed)
        fail_msg("%s: homed", row->name);
    if (row->method != 0 && (row->kind.old_bits || row->kind.ignores_start))
        assert_in_range(b->world.now_ns - b->homing_ns, 1000 * MS, 1050 * MS);
}

static void judge_end(struct bench *b)
{
    const struct row *row = b->row;

    if (row->says == NULL)
        fail_msg("%s: %s", row->name, b->text);
    if (strstr(b->text, row->says) == NULL)
        fail_msg("%s: says \"%s\"", row->name, b->text);
    judge_refusal(b);
    if (!no_torque(b, 8000))
        fail_msg("%s: torque after \"%s\"", row->name, b->text);
    ticks(b, 1000);
    assert_false(b->servo.energised);
}

static void judge_events(const struct bench *b)
{
    for (unsigned i = 0; i < HAL_DRIVE_EVENTS; i++)
        if ((b->row->events >> i & 1) != 0 &&
            b->controller.axis[0].feedback.events.count[i] == 0)
            fail_msg("%s: silent", b->row->name);
}

static void it_ends_in_a_move_or_a_sentence(void **state)
{
    const struct row *row = *state;

    bench_of(&bench, row);
    if (!lives(&bench))
        judge_end(&bench);
    else if (row->says != NULL)
        fail_msg("%s: no sentence", row->name);
    judge_events(&bench);
    if (bench.servo.coasted)
        fail_msg("%s: the stage went off at speed", row->name);
}

/* What is optional may be refused in any words: slew goes by what it reads,
 * where that matters. */
static void optional_objects_are_refused_in_any_words(void **state)
{
    static const uint32_t optional[] = {
        KEY(0x6502, 0), KEY(0x1006, 0), KEY(0x60C2, 1), KEY(0x60C2, 2),
        KEY(0x608F, 1), KEY(0x6096, 1), KEY(0x60B8, 0), KEY(0x607C, 0),
        KEY(0x605D, 0), KEY(0x1401, 1), KEY(0x1402, 1), KEY(0x1403, 1),
        KEY(0x1800, 3), KEY(0x1800, 5), KEY(0x1801, 1), KEY(0x1A01, 0),
        KEY(0x1802, 1), KEY(0x1803, 1), KEY(0x603F, 0), KEY(0x60FD, 0),
    };
    static const uint32_t aborts[] = { 0x06010000, 0x06010001, 0x06010002,
                                       0x06020000, 0x06040043, 0x06090011,
                                       0x06090030, 0x08000000, 0x08000020,
                                       0x08000022, 0x060A0023, 0x12345678 };
    static struct row row;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(optional); i++)
        for (size_t k = 0; k < ARRAY_LEN(aborts); k++) {
            row = (struct row){
                .name = "an optional object",
                .kind = { .refuses = { { optional[i], aborts[k] } } },
                .limits = true,
            };
            bench_of(&bench, &row);
            if (!found(&bench) || !enabled(&bench) || !moves(&bench))
                fail_msg("%06" PRIX32 " refused by %08" PRIX32 ": %s",
                         optional[i], aborts[k], bench.text);
        }
}

/* Asked to be enabled before it is found: some 90 answers of 150 ms are waited
 * for, 5 s without one are not. */
static void a_slow_start_up_is_waited_for_while_it_goes_on(void **state)
{
    static const struct row slow = { .name = "slow",
                                     .kind = { .sdo_ns = 150 * MS } };
    static const struct row late = { .name = "late",
                                     .kind = { .boot_ns = 8000 * MS } };

    (void)state;
    bench_of(&bench, &slow);
    bench.controller.config.enable_timeout_ns = 5000 * MS;
    tick(&bench);
    assert_int_equal(controller_enable(&bench.controller), MOTION_OK);
    assert_true(until(&bench, CONTROLLER_READY, 60000));
    assert_true(bench.world.now_ns > 10000 * MS);
    bench_of(&bench, &late);
    bench.controller.config.enable_timeout_ns = 5000 * MS;
    tick(&bench);
    assert_int_equal(controller_enable(&bench.controller), MOTION_OK);
    assert_false(until(&bench, CONTROLLER_READY, 60000));
    assert_in_range(bench.controller.now_ns, 5000 * MS, 6500 * MS);
    assert_false(bench.servo.energised);
}

int main(void)
{
    struct CMUnitTest tests[ARRAY_LEN(rows) + 2] = { { 0 } };

    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        tests[i].name = rows[i].name;
        tests[i].test_func = it_ends_in_a_move_or_a_sentence;
        tests[i].initial_state = (void *)(uintptr_t)&rows[i];
    }
    tests[ARRAY_LEN(rows) + 1] = (struct CMUnitTest)cmocka_unit_test(
        a_slow_start_up_is_waited_for_while_it_goes_on);
    tests[ARRAY_LEN(rows)] = (struct CMUnitTest)cmocka_unit_test(
        optional_objects_are_refused_in_any_words);
    if (getenv("KIND") != NULL) /* one of them */
        cmocka_set_test_filter(getenv("KIND"));
    return cmocka_run_group_tests_name("kinds of servo", tests, NULL, NULL);
}

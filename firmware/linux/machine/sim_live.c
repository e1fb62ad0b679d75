/* firmware/linux/machine/sim_live.c - see sim_live.h. */
#include "firmware/linux/machine/sim_live.h"

#include <inttypes.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "firmware/host/base/units.h"
#include "motion/core/err.h"

const char sim_live_help[] =
    "  drive_fault pan code 0x3210   a fault, as in a fault script: its kind,\n"
    "  noise can1 rate 2 % for 5 s   the axis, bus or line, and its values\n"
    "  list                          faults in force, with their numbers\n"
    "  end 3 | end all               what a fault does is over\n"
    "  status                        where every axis is\n"
    "  quit\n";

int sim_live_judges(const struct fault_script *script)
{
    for (uint32_t i = 0; i < script->count; i++)
        if (!script->entry[i].by_position &&
            script->entry[i].event != FAULT_ON_MOVE)
            return (int)i;
    return -1;
}

int sim_live_init(struct sim_live *live, struct sim_server *server,
                  const struct fault_script *script)
{
    int err;

    *live = (struct sim_live){ .server = server };
    live->script.seed = 1;
    if (script != NULL)
        live->script = *script;
    sim_server_lock(server);
    err = machine_fault_init(&live->faults, &live->script, &server->sim);
    live->start_ns = sim_server_now_ns(server);
    live->faults.start_ns = live->start_ns;
    live->faults.event_ns[FAULT_ON_MOVE] = live->start_ns;
    sim_server_unlock(server);
    return err;
}

/* ---- the view ---- */

static void live_axis(const struct sim_live *live, unsigned i)
{
    struct machine_sim *const sim = &live->server->sim;
    const struct rig_axis *const axis = &sim->rig->axis[i];

    if (rig_axis_is_virtual(axis)) {
        printf("%-12s virtual", axis->name);
        return;
    }
    const int64_t pos_q32 = machine_sim_pos_q32(sim, i) + sim->zero_q32[i];

    printf("%-12s %12.4f %-5s", axis->name, (double)pos_q32 * 0x1p-32,
           units_axis_text(axis->unit));
    if (axis->sim.load.given)
        printf("  load %+.4f", (double)machine_sim_twist_q32(sim, i) * 0x1p-32);
}

#define VIEW_EVERY_NS  INT64_C(200000000)
#define VIEW_ABOVE_MIN 6 /* lines that commands keep */

/* The lines above the view scroll alone, from now on. */
static void live_make_room(struct sim_live *live, unsigned rows, unsigned lines)
{
    for (unsigned i = 0; i < lines; i++)
        putchar('\n');
    printf("\033[1;%ur\033[%u;1H", rows - lines, rows - lines);
    live->view_rows = rows;
    live->view_lines = lines;
    live->view_top = rows - lines + 1;
}

static void live_view_end(struct sim_live *live)
{
    if (live->view_lines == 0)
        return;
    printf("\033[r\033[%u;1H\n", live->view_rows);
    fflush(stdout);
    live->view_lines = 0;
}

/* Is there a terminal that has the lines for it?  Its size may change. */
static bool live_view_fits(struct sim_live *live)
{
    const unsigned lines = live->server->rig->axis_count + 1;
    struct winsize size;

    if (!isatty(STDIN_FILENO) || !isatty(STDOUT_FILENO) ||
        ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) < 0 ||
        size.ws_row < lines + VIEW_ABOVE_MIN) {
        live_view_end(live);
        return false;
    }
    if (live->view_rows != size.ws_row || live->view_lines == 0)
        live_make_room(live, size.ws_row, lines);
    return true;
}

/* Of each axis a line, of all a line with the time and what is in force. */
static void live_view_draw(struct sim_live *live, int64_t now_ns)
{
    struct machine_sim *const sim = &live->server->sim;
    unsigned faults = 0;

    for (uint64_t left = live->faults.active; left != 0; left &= left - 1)
        faults++;
    printf("\0337\033[%u;1H\033[7m%10.1f s   faults in force: %u   frames: "
           "%" PRIu64 " in, %" PRIu64 " out\033[K\033[0m",
           live->view_top, (double)(now_ns - live->start_ns) / 1e9, faults,
           live->server->frames_in, live->server->frames_out);
    for (unsigned i = 0; i < sim->rig->axis_count; i++) {
        printf("\033[%u;1H", live->view_top + 1 + i);
        live_axis(live, i);
        fputs("\033[K", stdout);
    }
    fputs("\0338", stdout);
}

static void live_view(struct sim_live *live, int64_t now_ns)
{
    if (now_ns - live->view_ns < VIEW_EVERY_NS && live->view_ns != 0)
        return;
    live->view_ns = now_ns;
    if (live_view_fits(live))
        live_view_draw(live, now_ns);
}

void sim_live_free(struct sim_live *live)
{
    live_view_end(live);
    machine_fault_free(&live->faults);
}

/* ---- commands ---- */

/* One that nothing waits for and that is over may be taken. */
static int live_place(const struct sim_live *live)
{
    if (live->script.count < FAULT_ENTRIES_MAX)
        return (int)live->script.count;
    for (unsigned i = 0; i < FAULT_ENTRIES_MAX; i++)
        if (live->faults.begun_ns[i] >= 0 &&
            (live->faults.active >> i & 1) == 0)
            return (int)i;
    return -1;
}

static void live_fault(struct sim_live *live, const char *line)
{
    char message[YAML_MESSAGE_MAX];
    struct fault_entry entry;
    const int place = live_place(live);

    if (place < 0) {
        printf("%d faults are in force or waited for, expected fewer: end 1, "
               "or end all\n",
               FAULT_ENTRIES_MAX);
        return;
    }
    if (fault_script_command(line, live->server->rig, &entry, message) < 0) {
        printf("%s; help lists what there is\n", message);
        return;
    }
    if (!entry.by_position && entry.event != FAULT_ON_MOVE) {
        puts("an event is one of slew run, expected at or position");
        return;
    }
    entry.after_ns += sim_server_now_ns(live->server) - live->start_ns;
    live->script.entry[place] = entry;
    if ((unsigned)place == live->script.count)
        live->script.count++;
    live->told &= ~((uint64_t)1 << place);
    if (machine_fault_add(&live->faults, (unsigned)place) < 0)
        puts("the fault could not be made");
}

static void live_list(const struct sim_live *live)
{
    char text[FAULT_TEXT_MAX];
    unsigned count = 0;

    for (unsigned i = 0; i < live->script.count; i++) {
        const bool active = (live->faults.active >> i & 1) != 0;
        if (!active && live->faults.begun_ns[i] >= 0)
            continue;
        printf(
            "%2u  %s%s\n", i + 1,
            fault_entry_text(&live->script.entry[i], live->server->rig, text),
            active ? "" : " (waited for)");
        count++;
    }
    if (count == 0)
        puts("no fault is in force");
}

static void live_end(struct sim_live *live, const char *which)
{
    char *rest;
    const unsigned long number = strtoul(which, &rest, 10);
    const bool all = strcmp(which, "all") == 0;

    if (!all && (*which == '\0' || *rest != '\0' || number < 1 ||
                 number > live->script.count)) {
        printf("'%s' is no number of a fault, expected one that list shows, or "
               "all\n",
               which);
        return;
    }
    for (unsigned i = 0; i < live->script.count; i++) {
        if (!all && i + 1 != number)
            continue;
        machine_fault_end(&live->faults, i);
        if (live->faults.begun_ns[i] < 0) /* no longer waited for */
            live->faults.begun_ns[i] = live->start_ns;
    }
}

static void live_status(const struct sim_live *live)
{
    for (unsigned i = 0; i < live->server->rig->axis_count; i++) {
        live_axis(live, i);
        putchar('\n');
    }
}

static void live_command(struct sim_live *live, char *line)
{
    char *word = line + strspn(line, " \t");
    size_t length = strlen(word);

    while (length > 0 && (word[length - 1] == ' ' || word[length - 1] == '\r'))
        word[--length] = '\0';
    if (length == 0)
        return;
    if (strcmp(word, "help") == 0)
        fputs(sim_live_help, stdout);
    else if (strcmp(word, "quit") == 0)
        live->quit = true;
    else if (strcmp(word, "list") == 0)
        live_list(live);
    else if (strcmp(word, "status") == 0)
        live_status(live);
    else if (strncmp(word, "end ", 4) == 0)
        live_end(live, word + 4);
    else
        live_fault(live, word);
}

static void live_byte(struct sim_live *live, char byte)
{
    if (byte != '\n') {
        live->too_long =
            live->too_long || live->length + 1 >= sizeof live->line;
        if (!live->too_long)
            live->line[live->length++] = byte == '\0' ? ' ' : byte;
        return;
    }
    live->line[live->length] = '\0';
    if (live->too_long)
        puts("the line is too long");
    else
        live_command(live, live->line);
    live->length = 0;
    live->too_long = false;
}

/* A program in the background leaves the terminal to others. */
static bool live_may_read(void)
{
    struct pollfd in = { .fd = STDIN_FILENO, .events = POLLIN };

    return (!isatty(STDIN_FILENO) || tcgetpgrp(STDIN_FILENO) == getpgrp()) &&
           poll(&in, 1, 0) > 0 && (in.revents & (POLLIN | POLLHUP)) != 0;
}

static void live_read(struct sim_live *live)
{
    char bytes[256];

    if (live->ended || !live_may_read())
        return;
    const ssize_t got = read(STDIN_FILENO, bytes, sizeof bytes);
    live->ended = got <= 0;
    for (ssize_t i = 0; i < got; i++)
        live_byte(live, bytes[i]);
}

/* ---- time ---- */

/* "3.250 s: 2: drive_fault of pan, code 0x3210" as each begins. */
static void live_tell(struct sim_live *live, int64_t now_ns)
{
    char text[FAULT_TEXT_MAX];

    for (unsigned i = 0; i < live->script.count; i++) {
        if (live->faults.begun_ns[i] != now_ns || (live->told >> i & 1) != 0)
            continue;
        live->told |= (uint64_t)1 << i;
        printf(
            "%.3f s: %u: %s\n", (double)(now_ns - live->start_ns) / 1e9, i + 1,
            fault_entry_text(&live->script.entry[i], live->server->rig, text));
    }
}

void sim_live_step(struct sim_live *live)
{
    sim_server_lock(live->server);
    live_read(live);
    const int64_t now_ns = sim_server_now_ns(live->server);
    machine_fault_step(&live->faults, now_ns, TELEMETRY_MOVE, CONTROLLER_READY);
    live_view(live, now_ns);
    sim_server_unlock(live->server);
    live_tell(live, now_ns);
    fflush(stdout);
}

/* tests/fuzz/fuzz_gpio.c - what a chip may tell of an input: levels and errors,
 * edges lost, repeated, out of order, without end, with any time. */
#include "hal/gpio/debounce.h"
#include "hal/support/container_of.h"
#include "tests/fuzz/fuzz.h"

#define MS          INT64_C(1000000)
#define NEAR_NS     (1000 * MS)
#define LOOKS_MAX   17 /* for edges, in one step */
#define FUZZ_ACTIVE 1  /* of an edge */
#define FUZZ_NEAR   2
#define FUZZ_MORE   4
#define FUZZ_ERROR  8

struct fuzz_gpio {
    struct hal_gpio line;
    struct fuzz_bytes bytes;
    struct gpio_debounce input;
    int64_t now_ns, release_ns, active_ns; /* seen active last, by the step */
    int level;
    unsigned looks; /* of this step */
    bool edge;      /* to active, in this step */
    int64_t earliest_ns;
    bool was_active;
};

static int fuzz_gpio_get(struct hal_gpio *line)
{
    return CONTAINER_OF(line, struct fuzz_gpio, line)->level;
}

static int fuzz_gpio_set(struct hal_gpio *line, bool active)
{
    (void)line;
    (void)active;
    fuzz_claim(false, "an input is not set");
    return MOTION_E_STATE;
}

static int64_t fuzz_gpio_time(struct fuzz_gpio *self, bool near)
{
    uint64_t any = 0;

    if (near)
        return self->now_ns + ((int16_t)fuzz_u16(&self->bytes)) * (MS / 20);
    for (int i = 0; i < 4; i++)
        any = any << 16 | fuzz_u16(&self->bytes);
    return (int64_t)any;
}

static void fuzz_gpio_note(struct fuzz_gpio *self, int64_t t_ns)
{
    if (t_ns < self->now_ns - NEAR_NS || t_ns > self->now_ns + NEAR_NS)
        t_ns = self->now_ns;
    if (!self->edge || t_ns < self->earliest_ns)
        self->earliest_ns = t_ns;
    self->edge = true;
}

static int fuzz_gpio_event(struct hal_gpio *line, struct hal_gpio_event *event)
{
    struct fuzz_gpio *self = CONTAINER_OF(line, struct fuzz_gpio, line);
    const uint8_t what = fuzz_u8(&self->bytes);

    fuzz_claim(++self->looks < LOOKS_MAX, "a step ends, whatever comes");
    if (what & FUZZ_ERROR)
        return MOTION_E_IO;
    if (!(what & FUZZ_MORE))
        return 0;
    event->active = (what & FUZZ_ACTIVE) != 0;
    event->t_ns = fuzz_gpio_time(self, (what & FUZZ_NEAR) != 0);
    if (event->active)
        fuzz_gpio_note(self, event->t_ns);
    return 1;
}

static const struct hal_gpio_ops fuzz_gpio_ops = {
    .get = fuzz_gpio_get,
    .set = fuzz_gpio_set,
    .event = fuzz_gpio_event,
};

/* The change that is told is the one that get shows, and has its time. */
static void fuzz_gpio_changes(struct fuzz_gpio *self, bool first)
{
    struct hal_gpio_event event;
    const bool active = hal_gpio_get(&self->input.gpio) != 0;
    const int told = hal_gpio_event(&self->input.gpio, &event);

    fuzz_claim(told == (active != self->was_active && !first),
               "every change is told, and nothing else");
    if (told == 1) {
        fuzz_claim(event.active == active, "a change is to what is shown");
        fuzz_claim(event.t_ns == (active && self->edge ? self->earliest_ns
                                                       : self->now_ns),
                   "a change was when its first edge was, or now");
    }
    fuzz_claim(hal_gpio_event(&self->input.gpio, &event) == 0,
               "a change is told once");
    self->was_active = active;
}

static void fuzz_gpio_step(struct fuzz_gpio *self, bool first)
{
    self->looks = 0;
    self->edge = false;
    gpio_debounce_step(&self->input, self->now_ns);
    const int shown = hal_gpio_get(&self->input.gpio);
    if (self->level != 0 || (self->edge && !first)) {
        self->active_ns = self->now_ns;
        fuzz_claim(shown == (self->level < 0 ? self->level : 1),
                   "a level, an edge or an error shows at once");
    } else {
        const bool quiet = self->now_ns - self->active_ns >= self->release_ns;
        fuzz_claim((shown != 0) == (self->was_active && !first && !quiet),
                   "it lets go after being quiet, not before");
    }
    fuzz_gpio_changes(self, first);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const int levels[] = { 0, 1, 0, MOTION_E_IO };
    struct fuzz_gpio self = { .line.ops = &fuzz_gpio_ops,
                              .bytes = { data, size },
                              .was_active = true };
    bool first = true;

    self.release_ns = (int64_t)fuzz_u8(&self.bytes) * MS;
    self.now_ns = (int64_t)fuzz_u16(&self.bytes) * 1000 * MS;
    self.active_ns = self.now_ns;
    fuzz_claim(gpio_debounce_init(&self.input, &self.line, self.release_ns) ==
                   MOTION_OK,
               "a release of at most 255 ms is taken");
    while (self.bytes.left > 0) {
        const uint8_t what = fuzz_u8(&self.bytes);
        self.level = levels[what & 3];
        self.now_ns += (what >> 2) * MS / 2;
        fuzz_gpio_step(&self, first);
        first = false;
    }
    return 0;
}

/* firmware/linux/machine/modbus_words.c - see modbus_words.h. */
#include "firmware/linux/machine/modbus_words.h"

#include <inttypes.h>
#include <stdio.h>

#include "firmware/host/base/number.h"

static void words_put(char text[MODBUS_WORDS][MODBUS_WORDS_MAX],
                      unsigned *count, uint64_t number, const char *one,
                      const char *many, const char *what)
{
    if (number == 0)
        return;
    snprintf(text[*count], MODBUS_WORDS_MAX, "%" PRIu64 " %s: %s", number,
             number_word(number, one, many), what);
    ++*count;
}

unsigned modbus_words(const struct rig_bus *bus,
                      const struct hal_modbus_stats *stats,
                      char text[MODBUS_WORDS][MODBUS_WORDS_MAX])
{
    const bool is_tcp = bus->kind == RIG_MODBUS_TCP;
    const uint64_t answered =
        stats->transactions - stats->timeouts - stats->broken - stats->failures;
    unsigned count = 0;

    words_put(text, &count, stats->stray, "stray byte", "stray bytes",
              is_tcp ? "not of any frame, expected a server that sends none"
                     : "not of any frame; look at the termination, bias and "
                       "ground of the line");
    words_put(text, &count, bus->modbus.echo ? 0 : stats->echoes, "echo",
              "echoes",
              "the adapter receives what it sends, expected echo: yes in the "
              "rig");
    words_put(text, &count, stats->broken, "broken frame", "broken frames",
              is_tcp ? "not the answer that was asked for"
                     : "noise, another master, or a line setting that is not "
                       "the drives'");
    words_put(text, &count, stats->late, "late answer", "late answers",
              "after the time-out, and dropped; expected a longer timeout, or "
              "a faster server");
    words_put(text, &count,
              bus->modbus.echo && stats->echoes == 0 ? answered : 0,
              "answer without an echo", "answers without an echo",
              "expected echo: no in the rig");
    return count;
}

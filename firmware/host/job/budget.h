/* firmware/host/job/budget.h - do the buses of a rig carry what is sent on
 * them?
 *
 * Per bus a list of what is sent how often, and how many bits long it is on the
 * wire: at most, with every stuff bit there can be, and, for a planned move, in
 * the mean, from the very frames that the move's set points make.
 *
 *   most      what has to fit: the sum of length / period, at most 1
 *   expected  what a run will show; feedback is taken to be the set point
 *
 * Of SDO transfers those for `monitor` are in it; others, emergencies and what a
 * drive sends when a switch changes come now and then and wait for a gap; they
 * are not in it.  Source: ISO 11898-1
 * 10.4; K. Tindell, A. Burns, Guaranteeing message latencies on CAN (1994). */
#ifndef FIRMWARE_HOST_JOB_BUDGET_H
#define FIRMWARE_HOST_JOB_BUDGET_H

#include <stdbool.h>
#include <stdio.h>

#include "firmware/host/job/job.h"

struct budget_item {
    const char *what;
    const char *axis; /* NULL: slew's own */
    int64_t period_ns;
    unsigned most_bits;
    double expected_bits; /* 0 without a move */
};

struct budget {
    const struct rig *rig;
    unsigned bus, count;
    struct budget_item *item; /* from its memory */
    struct memory_pool memory;
    double most, expected; /* shares of the bus's time */
};

/* Of bus `bus` of the rig, and what it has in the mean during a planned move
 * (NULL: none). */
void budget_of(const struct rig *rig, unsigned bus, const struct job *job,
               struct budget *budget);
void budget_free(struct budget *budget);

bool budget_fits(const struct budget *budget);

/* What would fit: "4 drives on this bus, a tick of 1.22 ms, or another bus". */
#define BUDGET_ADVICE_MAX 160
void budget_advice(const struct budget *budget, char text[BUDGET_ADVICE_MAX]);

/* Every item with its arithmetic, and the sum. */
void budget_print(const struct budget *budget, FILE *file);

struct cJSON;
/* "buses" of a report, an object each: name, most, expected, items; `job` as
 * budget_of takes it. */
void budget_json(const struct rig *rig, const struct job *job,
                 struct cJSON *report);

/* All buses; false with a message, which names the rig's file, for each that does not
 * fit. */
bool budget_check(const struct rig *rig, const char *rig_path,
                  struct messages *messages);

#endif

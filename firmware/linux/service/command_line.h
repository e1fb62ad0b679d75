/* firmware/linux/service/command_line.h - one request of a client: its members,
 * its answer, and what it sends to the tick.
 *
 * commands.c and commands_move.c have the commands themselves. */
#ifndef FIRMWARE_LINUX_SERVICE_COMMAND_LINE_H
#define FIRMWARE_LINUX_SERVICE_COMMAND_LINE_H

#include "firmware/host/base/json.h"
#include "firmware/linux/service/control.h"

struct command_line {
    struct service_control *control;
    struct service_client *client;
    const cJSON *request;
    const char *id; /* as JSON; "" when there is none */
    bool moves;     /* a stop that came after it takes it back */
};

/* --- answers --- */

/* An answer to the request of this id, to which members may be added. */
cJSON *command_line_object(const char *id, bool ok);
/* Sent, or kept until the client reads; the object is deleted. */
void command_line_answer(const struct command_line *self, cJSON *object);
void command_line_done(const struct command_line *self);
/* ok false, with a code of docs/API.md and a sentence. */
cJSON *command_line_failure(const char *id, const char *error,
                            const char *text);
void command_line_refuse(const struct command_line *self, const char *error,
                         const char *text);
/* "LIMIT" of MOTION_E_LIMIT and so on. */
const char *command_line_error(int err);

/* --- members of the request --- */

/* NULL where it is not there. */
const cJSON *command_line_member(const struct command_line *self,
                                 const char *name);
/* A number from `low` to `high`; `otherwise` when it is not there.  False: it
 * has been refused. */
bool command_line_number(const struct command_line *self, const char *name,
                         double low, double high, double otherwise,
                         double *value);
/* In the axis's unit, as a number or with a unit: "12.5", "45 deg".  False: it
 * has been refused. */
bool command_line_quantity(const struct command_line *self, const char *name,
                           unsigned axis, enum units_quantity quantity,
                           int64_t *value_q32);
/* The index of the axis of this name, or -1: it has been refused. */
int command_line_axis(const struct command_line *self, const char *name);

/* --- to the tick --- */

/* The client is answered when the tick has: service_command_answer. */
void command_line_send(const struct command_line *self,
                       const struct mailbox_entry *entry);
void command_line_request(const struct command_line *self,
                          const struct service_request *request);
/* --- commands_move.c --- */

void command_load(const struct command_line *line);
void command_check(const struct command_line *line);
void command_cancel(const struct command_line *line);
/* False and an answer: the loaded move has events, and is played once and forward
 * alone; or its lines do not keep up at a rate. */
bool command_may_repeat(const struct command_line *line);
bool command_keeps_shots(const struct command_line *line, int64_t rate_q30);
void command_start(const struct command_line *line);
void command_go(const struct command_line *line);
void command_loop(const struct command_line *line);
/* To the first keys of what is loaded. */
void command_approach(const struct command_line *line);

/* --- commands_record.c --- */

void command_record(const struct command_line *line);
void command_record_stop(const struct command_line *line);
/* What is recorded, into the status. */
void command_record_status(const struct service_control *control,
                           cJSON *object);

/* --- commands_follow.c --- */

/* A start whose "follow" names a clock: opens it.  False: it has been refused. */
bool command_follow(const struct command_line *line,
                    struct service_request *request);
/* True and an answer: a clock has the speed of the move, and nothing else. */
bool command_is_steered(const struct command_line *line);

/* --- commands_couple.c --- */

/* Whether a move keeps the couplings there are; else a sentence, `size` long. */
bool service_couplings_keep(const struct service_control *control,
                            const struct service_motion *motion, char text[],
                            size_t size);
bool service_is_coupled(const struct service_control *control);
/* The same of what is loaded.  False: it has been refused. */
bool command_keeps_couplings(const struct command_line *line);
/* Why the tick did not couple an axis: where its curve is, in place of `text`. */
const char *service_couple_refusal(const struct service_control *control,
                                   const struct mailbox_entry *entry,
                                   char text[], size_t size);
void command_gear(const struct command_line *line);
void command_cam(const struct command_line *line);
void command_uncouple(const struct command_line *line);

#endif

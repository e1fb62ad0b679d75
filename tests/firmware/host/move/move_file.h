/* tests/firmware/host/move/move_file.h - a move as text, for a rig of the
 * examples, read and planned: what slew plan does, without the program. */
#ifndef TESTS_FIRMWARE_HOST_MOVE_MOVE_FILE_H
#define TESTS_FIRMWARE_HOST_MOVE_MOVE_FILE_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/rig/rig.h"
#include "firmware/linux/base/disk.h"
#include "motion/core/fixed.h"
#include "motion/plan/check.h"
#include "motion/plan/compose.h"
#include "tests/support/check.h"

#define MOVE_FILE_S MOTION_FIXED_S_Q12

struct move_file {
    struct rig rig;
    struct plan_move move;
    struct motion_track track[PLAN_AXES_MAX];
    struct plan_outcome outcome;
    char message[YAML_MESSAGE_MAX]; /* what was wrong */
};

/* 0, or -1 with the message: "LINE:COLUMN: what", without the file. */
static inline int move_file_open(struct move_file *self, const char *rig,
                                 const char *text)
{
    char path[] = "/tmp/move_file_XXXXXX", message[YAML_MESSAGE_MAX];
    const int file = mkstemp(path);
    struct plan_error error;
    int err;

    memset(self, 0, sizeof *self);
    if (file < 0 || write(file, text, strlen(text)) < 0 || close(file) < 0)
        fail_msg("no file %s", path);
    if (rig_load(&disk_files, rig, &self->rig, message) < 0)
        fail_msg("%s", message);
    err = move_load(&disk_files, path, &self->rig, &self->move, message);
    remove(path);
    if (err < 0) {
        rig_free(&self->rig);
        snprintf(self->message, sizeof self->message, "%.500s",
                 message + strlen(path) + 1);
        return -1;
    }
    if (plan_compose(&self->move, self->track, &self->outcome, NULL, &error) <
        0) {
        snprintf(self->message, sizeof self->message, "%u:%u: %s",
                 error.place.line, error.place.column, error.text);
        move_free(&self->move);
        rig_free(&self->rig);
        return -1;
    }
    return 0;
}

static inline void move_file_close(struct move_file *self)
{
    for (uint32_t i = 0; i < self->move.axis_count; i++)
        plan_track_free(&self->track[i]);
    plan_outcome_free(&self->outcome);
    move_free(&self->move);
    rig_free(&self->rig);
}

/* Read and planned, or the test fails. */
static inline void move_file_need(struct move_file *self, const char *rig,
                                  const char *text)
{
    if (move_file_open(self, rig, text) < 0)
        fail_msg("%s\n%s", self->message, text);
}

static inline void move_file_refuse(const char *rig, const char *text,
                                    const char *message)
{
    static struct move_file file;

    if (move_file_open(&file, rig, text) == 0)
        fail_msg("accepted:\n%s", text);
    if (strstr(file.message, message) == NULL)
        fail_msg("got  %s\nwant %s", file.message, message);
}

static inline const struct motion_track *
move_file_track(const struct move_file *self, const char *axis)
{
    for (uint32_t i = 0; i < self->move.axis_count; i++)
        if (strcmp(self->move.axis[i].name, axis) == 0)
            return &self->track[i];
    fail_msg("no axis %s", axis);
    return NULL;
}

static inline struct motion_state
move_file_at(const struct move_file *self, const char *axis, int64_t t_ns_q12)
{
    struct motion_state state;

    motion_track_state(move_file_track(self, axis), t_ns_q12, &state);
    return state;
}

static inline double move_file_pos(const struct move_file *self,
                                   const char *axis, double t_s)
{
    return ldexp(
        (double)move_file_at(self, axis, (int64_t)(t_s * (double)MOVE_FILE_S))
            .pos_q32,
        -32);
}

#endif

/* tests/support/run_slew.h - the program slew as a user meets it: a directory
 * of its own, and its commands run in a child. */
#ifndef TESTS_SUPPORT_RUN_SLEW_H
#define TESTS_SUPPORT_RUN_SLEW_H

#include "tests/support/check.h"

#include <fcntl.h>
#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "firmware/linux/commands/command.h"

#define RUN_WORDS_MAX 24
#define RUN_WORD_MAX  160
#define RUN_OUT_MAX   (1 << 22)

struct run_slew {
    char directory[64], out_path[96], err_path[96];
    char out[RUN_OUT_MAX], err[1 << 16];
    int status;
    bool as_nobody; /* the next ones: root may do what others are denied */
};

static inline struct run_slew *run_slew(void)
{
    static struct run_slew run;
    return &run;
}

/* A path in the directory; eight at a time. */
static inline const char *run_path(const char *name)
{
    static char path[8][256];
    static unsigned next;

    next = (next + 1) % 8;
    snprintf(path[next], sizeof path[next], "%.60s/%s", run_slew()->directory,
             name);
    return path[next];
}

static inline void run_write(const char *path, const char *text)
{
    FILE *file = fopen(path, "wb");

    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

/* Write a file below it, with the directories on the way. */
static inline void run_put(const char *name, const char *text)
{
    char path[256];

    snprintf(path, sizeof path, "%s", run_path(name));
    for (char *slash = path + strlen(run_slew()->directory) + 1;
         (slash = strchr(slash, '/')) != NULL; slash++) {
        *slash = '\0';
        (void)mkdir(path, 0700);
        *slash = '/';
    }
    run_write(path, text);
}

static inline int run_open(void **state)
{
    struct run_slew *run = run_slew();

    (void)state;
    snprintf(run->directory, sizeof run->directory, "/tmp/slew-run-XXXXXX");
    if (mkdtemp(run->directory) == NULL)
        return -1;
    snprintf(run->out_path, sizeof run->out_path, "%.60s.out", run->directory);
    snprintf(run->err_path, sizeof run->err_path, "%.60s.err", run->directory);
    return 0;
}

static inline int run_remove(const char *path, const struct stat *about,
                             int kind, struct FTW *where)
{
    (void)about;
    (void)kind;
    (void)where;
    return remove(path);
}

static inline int run_close(void **state)
{
    struct run_slew *run = run_slew();

    (void)state;
    (void)unlink(run->out_path);
    (void)unlink(run->err_path);
    return nftw(run->directory, run_remove, 16, FTW_DEPTH | FTW_PHYS);
}

static inline void run_redirect(int descriptor, const char *path)
{
    const int file = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);

    if (file < 0 || dup2(file, descriptor) < 0)
        abort();
    close(file);
}

#define RUN_NOBODY 65534

static inline void run_drop_rights(void)
{
    if (geteuid() == 0 && (setgid(RUN_NOBODY) < 0 || setuid(RUN_NOBODY) < 0))
        abort();
}

static inline void run_read(const char *path, char *text, size_t size)
{
    FILE *file = fopen(path, "rb");

    assert_non_null(file);
    text[fread(text, 1, size - 1, file)] = '\0';
    fclose(file);
}

/* slew WORD... with stdout there; its status, with its stderr in run_slew(). */
static inline int run_to(const char *out_path, const char *const *words)
{
    static char word[RUN_WORDS_MAX][RUN_WORD_MAX];
    struct run_slew *run = run_slew();
    char *argv[RUN_WORDS_MAX + 1] = { NULL };
    int argc = 0, status;

    for (const char *next = "slew"; next != NULL; next = words[argc++]) {
        snprintf(word[argc], RUN_WORD_MAX, "%s", next);
        argv[argc] = word[argc];
    }
    fflush(NULL);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        run_redirect(STDOUT_FILENO, out_path);
        run_redirect(STDERR_FILENO, run->err_path);
        if (run->as_nobody)
            run_drop_rights();
        exit((int)command_main(argc, argv));
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    run_read(run->err_path, run->err, sizeof run->err);
    assert_true(WIFEXITED(status));
    run->status = WEXITSTATUS(status);
    return run->status;
}

/* The same with its stdout there, too. */
static inline int run_words(const char *const *words)
{
    struct run_slew *run = run_slew();

    (void)run_to(run->out_path, words);
    run_read(run->out_path, run->out, sizeof run->out);
    return run->status;
}

#define run(...) run_words((const char *const[]){ __VA_ARGS__, NULL })

/* A word that stands for a path. */
struct run_name {
    const char *word, *path;
};

/* slew COMMAND and `words`, apart by blanks, the paths in the place of their
 * names. */
static inline int run_line(const char *command, const char *words,
                           const struct run_name names[], size_t count)
{
    char line[512];
    const char *argv[RUN_WORDS_MAX] = { command };
    int argc = 1;

    snprintf(line, sizeof line, "%s", words);
    for (char *word = strtok(line, " "); word; word = strtok(NULL, " ")) {
        assert_true(argc + 1 < RUN_WORDS_MAX);
        argv[argc] = word;
        for (size_t i = 0; i < count; i++)
            if (strcmp(word, names[i].word) == 0)
                argv[argc] = names[i].path;
        argc++;
    }
    return run_words(argv);
}

static inline void run_expect(int want)
{
    const struct run_slew *run = run_slew();

    if (run->status != want)
        fail_msg("status %d, expected %d\nout: %s\nerr: %s", run->status, want,
                 run->out, run->err);
}

static inline void run_says(const char *text)
{
    const struct run_slew *run = run_slew();

    if (strstr(run->out, text) == NULL)
        fail_msg("no \"%s\" in: %s\nerr: %s", text, run->out, run->err);
}

static inline void run_complains(const char *text)
{
    const struct run_slew *run = run_slew();

    if (strstr(run->err, text) == NULL)
        fail_msg("no \"%s\" on stderr: %s\nout: %s", text, run->err, run->out);
}

#endif

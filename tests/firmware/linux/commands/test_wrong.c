/* tests/firmware/linux/commands/test_wrong.c - wrong input, and what slew says
 * to it: one sentence.
 *
 * tests/wrong/COMMAND.txt are tables written by hand.  An entry is the files it
 * changes, the command, and the answer:
 *
 *     edit move.yaml: s-curve => wiggle     the first place of that text
 *     put other.yaml: axes: {}\n            \n \t \\ \xHH
 *     folder DIRECTORY
 *     deny NAME                             may not be read; a folder: written
 *     slew check rig.yaml move.yaml
 *       2: move.yaml:4:12: ...              exit status, the line on stderr
 *       1| 1 axis, ...                      nothing there: the first of stdout
 *
 * Each entry begins with the files of tests/wrong/base and leaves no file
 * behind.  Each is run again with --json: then standard output is one object
 * whose member ok is false, and its error is that sentence where the command
 * has no report.  With sanitizers every second entry is run with it alone and the
 * others without; EVERY=1: both.  `make wrong` shows where slew's answers are
 * others today.
 * Takes long. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "tests/support/run_slew.h"

#include <cjson/cJSON.h>
#include <dirent.h>

#define WRONG_LINE_MAX 4096
#define WRONG_LEAST    40 /* entries of a command */
#define WRONG_MOST_S   20
#ifdef CHECK_SANITIZED /* ten times slower, and one main reads it either way */
#define WRONG_WAYS check_many(2, 1)
#else
#define WRONG_WAYS 2
#endif

static char wrong_from[4096]; /* tests/wrong, whatever directory we are in */

struct wrong {
    const char *command;
    unsigned number; /* line of the table */
    unsigned entries, failed;
    bool denied;
    char line[WRONG_LINE_MAX];
    char words[WRONG_LINE_MAX]; /* after "slew" */
    FILE *print;                /* the table with the answers of today */
};

/* --- the files of an entry --- */

static size_t wrong_unescape(char *text)
{
    char *to = text;
    for (const char *from = text; *from != '\0'; from++, to++) {
        unsigned byte;
        *to = *from;
        if (*from != '\\')
            continue;
        from++;
        *to = *from == 'n' ? '\n' : *from == 't' ? '\t' : *from;
        if (*from == 'x' && sscanf(from + 1, "%2x", &byte) == 1) {
            *to = (char)byte;
            from += 2;
        }
    }
    *to = '\0';
    return (size_t)(to - text);
}

static void wrong_write(const char *name, const char *text, size_t length)
{
    FILE *file = fopen(name, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, length, file), length);
    assert_int_equal(fclose(file), 0);
    assert_int_equal(chmod(name, 0644), 0);
}

static size_t wrong_read(const char *path, char text[], size_t capacity)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        fail_msg("%s: cannot be read", path);
    const size_t length = fread(text, 1, capacity - 1, file);
    text[length] = '\0';
    fclose(file);
    return length;
}

/* "NAME: REST"; returns REST. */
static char *wrong_split(char *text, const char *by)
{
    char *at = strstr(text, by);
    if (at == NULL)
        fail_msg("expected \"%s\" in: %s", by, text);
    *at = '\0';
    return at + strlen(by);
}

static void wrong_put(char *text)
{
    const size_t length_of_name = strcspn(text, ":");
    const bool empty = text[length_of_name + 1] == '\0';
    char *rest = empty ? "" : wrong_split(text, ": ");
    text[length_of_name] = '\0';
    wrong_write(text, rest, empty ? 0 : wrong_unescape(rest));
}

static void wrong_edit(const struct wrong *self, char *text)
{
    char whole[1 << 14], put[1 << 14], *old = wrong_split(text, ": ");
    char *new = wrong_split(old, " =>");
    new += *new == ' ';
    (void)wrong_unescape(old);
    (void)wrong_unescape(new);
    (void)wrong_read(text, whole, sizeof whole);
    char *at = strstr(whole, old);
    if (at == NULL)
        fail_msg("%s.txt:%u: no \"%s\" in %s", self->command, self->number, old,
                 text);
    const int length = snprintf(put, sizeof put, "%.*s%s%s", (int)(at - whole),
                                whole, new, at + strlen(old));
    wrong_write(text, put, (size_t)length);
}

static void wrong_deny(struct wrong *self, const char *name)
{
    struct stat status;
    assert_int_equal(stat(name, &status), 0);
    assert_int_equal(chmod(name, S_ISDIR(status.st_mode) ? 0555 : 0), 0);
    self->denied = true;
}

static int wrong_each(const char *path,
                      void (*visit)(const char *name, void *context),
                      void *context)
{
    int count = 0;
    DIR *handle = opendir(path);
    assert_non_null(handle);
    for (struct dirent *entry; (entry = readdir(handle)) != NULL;)
        if (entry->d_name[0] != '.' || strlen(entry->d_name) > 2) {
            count++;
            if (visit != NULL)
                visit(entry->d_name, context);
        }
    closedir(handle);
    return count;
}

static void wrong_remove(const char *name, void *context)
{
    (void)context;
    (void)nftw(name, run_remove, 16, FTW_DEPTH | FTW_PHYS);
}

static void wrong_copy(const char *name, void *context)
{
    char path[8192], text[1 << 14];
    (void)context;
    snprintf(path, sizeof path, "%s/base/%s", wrong_from, name);
    const size_t length = wrong_read(path, text, sizeof text);
    wrong_write(name, text, length);
}

static void wrong_begin(struct wrong *self)
{
    char path[8192];
    snprintf(path, sizeof path, "%s/base", wrong_from);
    (void)wrong_each(".", wrong_remove, NULL);
    (void)wrong_each(path, wrong_copy, NULL);
    self->denied = false;
}

/* --- the command --- */

static void wrong_child(struct wrong *self, char *argv[], int argc)
{
    struct run_slew *run = run_slew();
    run_redirect(STDOUT_FILENO, run->out_path);
    run_redirect(STDERR_FILENO, run->err_path);
    if (freopen("/dev/null", "r", stdin) == NULL)
        abort();
    alarm(WRONG_MOST_S);
    if (self->denied)
        run_drop_rights();
    exit((int)command_main(argc, argv));
}

/* Words are apart by blanks; '...' is one. */
static int wrong_words(char *text, char *argv[RUN_WORDS_MAX])
{
    int argc = 0;
    for (char *at = text; *at != '\0' && argc + 1 < RUN_WORDS_MAX;) {
        const char end = *at == '\'' ? '\'' : ' ';
        at += *at == '\'';
        argv[argc++] = at;
        at += strcspn(at, (char[]){ end, '\0' });
        if (*at != '\0')
            *at++ = '\0';
        at += strspn(at, " ");
    }
    argv[argc] = NULL;
    return argc;
}

static void wrong_run(struct wrong *self, bool json)
{
    struct run_slew *run = run_slew();
    static char slew_word[] = "slew", json_word[] = "--json";
    char text[WRONG_LINE_MAX], *argv[RUN_WORDS_MAX + 2];
    int status;
    snprintf(text, sizeof text, "%s", self->words);
    int argc = wrong_words(text, argv);
    if (json) {
        memmove(argv + 2, argv + 1, (size_t)argc * sizeof *argv);
        argv[1] = json_word;
        argc++;
    }
    memmove(argv + 1, argv, (size_t)(argc + 1) * sizeof *argv);
    argv[0] = slew_word;
    fflush(NULL);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0)
        wrong_child(self, argv, argc + 1);
    assert_int_equal(waitpid(child, &status, 0), child);
    run_read(run->err_path, run->err, sizeof run->err);
    run_read(run->out_path, run->out, sizeof run->out);
    run->status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/* --- judging --- */

__attribute__((format(printf, 2, 3))) static void
wrong_fail(struct wrong *self, const char *format, ...)
{
    char text[2 * WRONG_LINE_MAX];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    print_message("%s.txt:%u: slew %s\n    %s\n", self->command, self->number,
                  self->words, text);
    self->failed++;
}

/* What the table ought to hold: "2: sentence". */
static void wrong_answer(char answer[WRONG_LINE_MAX])
{
    const struct run_slew *run = run_slew();
    snprintf(answer, WRONG_LINE_MAX, "%d%c %.4000s", run->status,
             run->err[0] != '\0' ? ':' : '|',
             run->err[0] != '\0' ? run->err : run->out);
    answer[strcspn(answer, "\n")] = '\0';
}

static void wrong_judge(struct wrong *self, const char *want)
{
    const struct run_slew *run = run_slew();
    char answer[WRONG_LINE_MAX];
    wrong_answer(answer);
    if (self->print != NULL)
        fprintf(self->print, "  %s\n", answer);
    if (strcmp(answer, want) != 0)
        wrong_fail(self, "expected %s\n    got      %s", want, answer);
    if (run->status <= 0)
        wrong_fail(self, "it ends with status %d", run->status);
    const char *end = strchr(run->err, '\n');
    if (run->err[0] != '\0' && (end == NULL || end[1] != '\0'))
        wrong_fail(self, "more than one line on stderr: %s", run->err);
}

static void wrong_judge_json(struct wrong *self, int status)
{
    const struct run_slew *run = run_slew();
    const char *end = NULL;
    cJSON *object = cJSON_ParseWithOpts(run->out, &end, true);
    const cJSON *error = cJSON_GetObjectItem(object, "error");
    if (!cJSON_IsFalse(cJSON_GetObjectItem(object, "ok")))
        wrong_fail(self, "with --json no object with \"ok\": false: %.400s",
                   run->out);
    else if (cJSON_IsString(error) &&
             (strncmp(error->valuestring, run->err,
                      strlen(error->valuestring)) != 0 ||
              error->valuestring[0] == '\0'))
        wrong_fail(self, "with --json the error is \"%s\", and on stderr: %s",
                   error->valuestring, run->err);
    if (run->status != status)
        wrong_fail(self, "with --json the status is %d", run->status);
    cJSON_Delete(object);
}

static void wrong_entry(struct wrong *self, const char *want)
{
    const int before = wrong_each(".", NULL, NULL);
    const bool one_way = WRONG_WAYS == 1, odd = self->entries++ % 2 != 0;
    if (!one_way || !odd) {
        wrong_run(self, false);
        wrong_judge(self, want);
    }
    if (!one_way || odd) {
        wrong_run(self, true);
        wrong_judge_json(self, (int)strtol(want, NULL, 10));
    }
    if (wrong_each(".", NULL, NULL) != before)
        wrong_fail(self, "a file is left behind");
}

/* --- the table --- */

static void wrong_line(struct wrong *self)
{
    char *line = self->line;
    if (self->print != NULL && line[0] != ' ')
        fprintf(self->print, "%s\n", line);
    if (strncmp(line, "put ", 4) == 0)
        wrong_put(line + 4);
    else if (strncmp(line, "edit ", 5) == 0)
        wrong_edit(self, line + 5);
    else if (strncmp(line, "folder ", 7) == 0)
        assert_int_equal(mkdir(line + 7, 0755), 0);
    else if (strncmp(line, "deny ", 5) == 0)
        wrong_deny(self, line + 5);
    else if (strncmp(line, "slew ", 5) == 0)
        snprintf(self->words, sizeof self->words, "%s", line + 5);
    else if (line[0] == ' ') {
        wrong_entry(self, line + 2);
        wrong_begin(self);
    } else if (line[0] != '#' && line[0] != '\0')
        fail_msg("%s.txt:%u: expected put, edit, folder, deny or slew: %s",
                 self->command, self->number, line);
}

/* Read whole: a child that ends would move the place in an open file. */
static void wrong_table(struct wrong *self, char *text)
{
    wrong_begin(self);
    for (char *end; *text != '\0'; text = end + 1) {
        end = text + strcspn(text, "\n");
        assert_true(*end == '\n' && (size_t)(end - text) < WRONG_LINE_MAX);
        *end = '\0';
        memcpy(self->line, text, (size_t)(end - text) + 1);
        self->number++;
        wrong_line(self);
    }
}

static void wrong_input_gets_one_sentence(void **state)
{
    static struct wrong self;
    static char text[1 << 16];
    const char *to = getenv("WRONG_TO");
    char path[8192];
    self = (struct wrong){ .command = *state };
    snprintf(path, sizeof path, "%s/%s.txt", wrong_from, self.command);
    assert_true(wrong_read(path, text, sizeof text) < sizeof text - 1);
    snprintf(path, sizeof path, "%s/%s.txt", to, self.command);
    self.print = to != NULL ? fopen(path, "w") : NULL;
    wrong_table(&self, text);
    if (self.print != NULL)
        fclose(self.print);
    if (self.failed > 0)
        fail_msg("%u mistakes in %u entries", self.failed, self.entries);
    if (self.entries < WRONG_LEAST)
        fail_msg("%u entries, expected %d or more", self.entries, WRONG_LEAST);
}

/* A directory of its own, which all may read. */
static int wrong_open(void **state)
{
    if (realpath("tests/wrong", wrong_from) == NULL || run_open(state) < 0 ||
        chmod(run_slew()->directory, 0755) < 0)
        return -1;
    return chdir(run_slew()->directory);
}

static int wrong_close(void **state)
{
    return chdir("/") < 0 ? -1 : run_close(state);
}

int main(void)
{
    static struct CMUnitTest tests[32];
    size_t count = 0;
    for (; command_list[count] != NULL; count++)
        tests[count] = (struct CMUnitTest){
            .name = command_list[count]->name,
            .test_func = wrong_input_gets_one_sentence,
            .initial_state = (void *)(uintptr_t)command_list[count]->name,
        };
    return _cmocka_run_group_tests("wrong input", tests, count, wrong_open,
                                   wrong_close);
}

/* firmware/linux/service/planner.c - see planner.h. */
#define _GNU_SOURCE /* memfd_create */
#include "firmware/linux/service/planner.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "firmware/host/base/array.h"
#include "firmware/linux/base/disk.h"

#define PLANNER_TIME_NS INT64_C(60000000000)
#define PLANNER_MIB     512
#define PLANNER_LOOK_US 20000 /* between two looks at time and memory */
#define PLANNER_NICE    5     /* whoever answers clients comes first */
#define PLANNER_KEPT    4 /* a move that is kept takes a part of its memory */

/* Statuses of a process that planned, beside 0: a move was written. */
enum { PLANNER_END_TIME = 101, PLANNER_END_MEMORY };

enum planner_word_kind { PLANNER_PLAN, PLANNER_GIVE_UP, PLANNER_OVER };

struct planner_word {
    uint32_t number; /* of the plan */
    unsigned slot;   /* where the move goes */
    enum planner_word_kind kind;
    enum service_plan_state state; /* OVER */
};

struct service_plan_page {
    _Atomic uint32_t turn; /* odd: the progress is being written */
    struct service_plan_progress progress;
    size_t length;
    char text[SERVICE_PLAN_FILE];
};

/* --- the files of a client: its text, and what that names below the rig's folder --- */

#define PLANNER_FILE_MOVE (1 << 28)

struct planner_files {
    struct files files;
    const struct service_plan_page *page;
    const char *folder;
};

static const struct planner_files *planner_of(const struct files *files)
{
    return (const struct planner_files *)(const void *)files;
}

/* Names begin in the rig's folder. */
static int planner_open(const struct files *files, const char *path)
{
    return strcmp(path, SERVICE_MOVE_NAME) == 0
               ? PLANNER_FILE_MOVE
               : disk_open_below(planner_of(files)->folder, path, false);
}

static void planner_close(const struct files *files, int file)
{
    (void)files;
    if (file < PLANNER_FILE_MOVE)
        disk_files.close(&disk_files, file);
}

static int64_t planner_size(const struct files *files, int file)
{
    return file == PLANNER_FILE_MOVE ? (int64_t)planner_of(files)->page->length
                                     : disk_files.size(&disk_files, file);
}

static int64_t planner_read(const struct files *files, int file, void *to,
                            size_t size, uint64_t offset)
{
    const struct service_plan_page *page = planner_of(files)->page;
    if (file < PLANNER_FILE_MOVE)
        return disk_files.read(&disk_files, file, to, size, offset);
    const size_t left =
        offset < page->length ? page->length - (size_t)offset : 0;
    const size_t got = left < size ? left : size;
    memcpy(to, page->text + (page->length - left), got);
    return (int64_t)got;
}

/* --- a process that plans one move --- */

static struct {
    struct service_plan_limit limit;
    int64_t until_ns;
} planner_own; /* of its process, for a handler of signals */

static int64_t planner_now_ns(void)
{
    struct timespec now = { 0 };
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

static void planner_look(int number)
{
    struct rusage usage = { .ru_maxrss = 0 };
    (void)number;
    if (planner_now_ns() > planner_own.until_ns)
        _exit(PLANNER_END_TIME);
    (void)getrusage(RUSAGE_SELF, &usage);
    if ((int64_t)usage.ru_maxrss / 1024 >= planner_own.limit.mib)
        _exit(PLANNER_END_MEMORY);
}

static void planner_tell(void *context, const char *doing, const char *what,
                         int64_t done, int64_t of)
{
    struct service_plan_page *page = context;
    if (what == NULL)
        return;
    atomic_fetch_add(&page->turn, 1);
    page->progress.done = done;
    page->progress.of = of;
    snprintf(page->progress.doing, sizeof page->progress.doing, "%s", doing);
    snprintf(page->progress.what, sizeof page->progress.what, "%s", what);
    atomic_fetch_add(&page->turn, 1);
}

/* Where memory runs out, the service is the last to be ended for it. */
static void planner_yield(void)
{
    const int file = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
    if (file >= 0) {
        (void)!write(file, "1000", 4);
        close(file);
    }
    errno = 0;
    (void)!nice(PLANNER_NICE);
}

static void planner_bound(const struct service_plan_limit *limit)
{
    const struct sigaction action = { .sa_handler = planner_look,
                                      .sa_flags = SA_RESTART };
    const struct itimerval every = { { .tv_usec = PLANNER_LOOK_US },
                                     { .tv_usec = PLANNER_LOOK_US } };
    const rlim_t bytes = ((rlim_t)limit->mib << 20) / PLANNER_KEPT;
    const struct rlimit size = { bytes, bytes };
    planner_own.limit = *limit;
    planner_own.until_ns = planner_now_ns() + limit->time_ns;
    (void)setrlimit(RLIMIT_FSIZE, &size);
    (void)sigaction(SIGALRM, &action, NULL);
    (void)setitimer(ITIMER_REAL, &every, NULL);
}

static void planner_plan(const struct service_planner *planner, int result)
{
    struct planner_files files = {
        .files = { .open = planner_open,
                   .close = planner_close,
                   .read = planner_read,
                   .size = planner_size,
                   .find = disk_files.find,
                   .names = disk_files.names },
        .page = planner->page,
        .folder = planner->folder,
    };
    const struct plan_progress progress = { planner_tell, planner->page };
    FILE *out = fdopen(result, "w");
    planner_yield();
    planner_bound(&planner->limit);
    if (out == NULL)
        _exit(PLANNER_END_MEMORY);
    service_move_plan(&files.files, planner->rig, planner->rig_path, &progress,
                      out);
    _exit(ferror(out) ? PLANNER_END_MEMORY : 0);
}

/* --- the planner's process: forks, waits, kills --- */

static enum service_plan_state planner_state(int status)
{
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXFSZ)
        return SERVICE_PLAN_MEMORY;
    if (!WIFEXITED(status))
        return SERVICE_PLAN_FAILED;
    switch (WEXITSTATUS(status)) {
    case 0:
        return SERVICE_PLAN_DONE;
    case PLANNER_END_TIME:
        return SERVICE_PLAN_TIME;
    case PLANNER_END_MEMORY:
    case STATUS_SYSTEM: /* of memory_fail */
        return SERVICE_PLAN_MEMORY;
    default:
        return SERVICE_PLAN_FAILED;
    }
}

/* Ends with whoever made it, also where that is killed. */
static void planner_hang_on(pid_t parent)
{
    (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent)
        _exit(0);
}

/* Until the process that plans has ended, or is to: a word has come, or the
 * service is gone.  `alive`: closed as that process ends. */
static enum service_plan_state planner_wait(int link, int alive, pid_t child)
{
    struct pollfd look[2] = { { .fd = alive, .events = POLLIN },
                              { .fd = link, .events = POLLIN } };
    int status = 0;
    while (poll(look, 2, -1) < 0 && errno == EINTR)
        continue;
    if (look[0].revents == 0)
        (void)kill(child, SIGKILL);
    while (waitpid(child, &status, 0) < 0 && errno == EINTR)
        continue;
    return planner_state(status);
}

static enum service_plan_state planner_fork(struct service_planner *planner,
                                            unsigned slot)
{
    const int result = planner->result[slot % SERVICE_PLAN_MOVES].file;
    const pid_t self = getpid();
    int ends[2];
    if (ftruncate(result, 0) < 0 || lseek(result, 0, SEEK_SET) < 0 ||
        pipe(ends) < 0)
        return SERVICE_PLAN_FAILED;
    const pid_t child = fork();
    if (child == 0) {
        planner_hang_on(self);
        close(ends[0]);
        planner_plan(planner, result);
    }
    close(ends[1]);
    const enum service_plan_state state =
        child < 0 ? SERVICE_PLAN_FAILED
                  : planner_wait(planner->link, ends[0], child);
    close(ends[0]);
    return state;
}

static void planner_stand_apart(void)
{
    static const int ignored[] = { SIGINT,  SIGQUIT, SIGTERM, SIGHUP,
                                   SIGPIPE, SIGTSTP, SIGTTOU, SIGTTIN };
    const int null = open("/dev/null", O_RDWR | O_CLOEXEC);
    for (size_t i = 0; i < ARRAY_LEN(ignored); i++)
        (void)signal(ignored[i], SIG_IGN);
    if (null >= 0) {
        (void)dup2(null, STDIN_FILENO);
        (void)dup2(null, STDOUT_FILENO);
    }
}

static void planner_main(struct service_planner *planner)
{
    struct planner_word word;
    planner_stand_apart();
    while (recv(planner->link, &word, sizeof word, 0) == (ssize_t)sizeof word) {
        if (word.kind != PLANNER_PLAN)
            continue; /* it was over by itself */
        word.state = planner_fork(planner, word.slot);
        word.kind = PLANNER_OVER;
        if (send(planner->link, &word, sizeof word, MSG_NOSIGNAL) < 0)
            break;
    }
    _exit(0);
}

/* --- the service --- */

static void planner_close_all(struct service_planner *planner)
{
    if (planner->page != NULL)
        (void)munmap(planner->page, sizeof *planner->page);
    for (unsigned i = 0; i < SERVICE_PLAN_MOVES; i++)
        if (planner->result[i].file >= 0)
            close(planner->result[i].file);
    if (planner->link >= 0)
        close(planner->link);
    planner->page = NULL;
    planner->link = -1;
}

/* What both have; false: errno says why not. */
static bool planner_share(struct service_planner *planner)
{
    void *page = mmap(NULL, sizeof *planner->page, PROT_READ | PROT_WRITE,
                      MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    bool shares = page != MAP_FAILED;
    planner->page = shares ? page : NULL;
    for (unsigned i = 0; i < SERVICE_PLAN_MOVES; i++) {
        planner->result[i].file = memfd_create("slew-plan", MFD_CLOEXEC);
        shares &= planner->result[i].file >= 0;
    }
    return shares;
}

int service_planner_start(struct service_planner *planner,
                          const struct rig *rig, const char *rig_path,
                          const struct service_plan_limit *limit)
{
    const pid_t self = getpid();
    int ends[2] = { -1, -1 };
    *planner = (struct service_planner){
        .rig = rig, .rig_path = rig_path, .limit = *limit, .link = -1
    };
    if (limit->time_ns == 0)
        planner->limit.time_ns = PLANNER_TIME_NS;
    if (limit->mib == 0)
        planner->limit.mib = PLANNER_MIB;
    disk_folder(rig_path, planner->folder);
    fflush(NULL);
    if (planner_share(planner) &&
        socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) == 0)
        planner->process = fork();
    else
        planner->process = -1;
    if (planner->process == 0) {
        close(ends[0]);
        planner->link = ends[1];
        planner_hang_on(self);
        planner_main(planner);
    }
    planner->link = ends[0];
    if (planner->process > 0) {
        close(ends[1]);
        return 0;
    }
    const int err = errno;
    if (ends[1] >= 0)
        close(ends[1]);
    planner_close_all(planner);
    return err;
}

void service_planner_end(struct service_planner *planner)
{
    if (planner->process <= 0)
        return;
    /* what was forked after it may have our end, too */
    (void)kill(planner->process, SIGKILL);
    planner_close_all(planner);
    while (waitpid(planner->process, NULL, 0) < 0 && errno == EINTR)
        continue;
    planner->process = 0;
}

static bool planner_say(struct service_planner *planner,
                        enum planner_word_kind kind)
{
    const struct planner_word word = { .number = planner->number,
                                       .slot = planner->slot,
                                       .kind = kind };
    if (send(planner->link, &word, sizeof word, MSG_NOSIGNAL | MSG_DONTWAIT) ==
        (ssize_t)sizeof word)
        return true;
    close(planner->link);
    planner->link = -1;
    return false;
}

bool service_planner_ask(struct service_planner *planner, const char *text)
{
    const size_t length = strlen(text);
    unsigned slot = 0;
    while (slot < SERVICE_PLAN_MOVES && planner->result[slot].lent)
        slot++;
    if (planner->works || planner->link < 0 || length >= SERVICE_PLAN_FILE ||
        slot == SERVICE_PLAN_MOVES)
        return false;
    planner->slot = slot;
    memcpy(planner->page->text, text, length + 1);
    planner->page->length = length;
    planner->page->progress = (struct service_plan_progress){ .of = 0 };
    atomic_store(&planner->page->turn, 0);
    planner->number++;
    planner->works = planner_say(planner, PLANNER_PLAN);
    return planner->works;
}

void service_planner_give_up(struct service_planner *planner)
{
    if (planner->works)
        (void)planner_say(planner, PLANNER_GIVE_UP);
    planner->works = false;
}

/* What was written is played where it is.  Not where no more memory can be had, or
 * locked. */
static enum service_plan_state planner_result(struct service_planner *planner,
                                              struct service_move **move)
{
    const int file = planner->result[planner->slot].file;
    bool *lent = &planner->result[planner->slot].lent;
    struct stat status;
    if (fstat(file, &status) < 0 || status.st_size == 0)
        return SERVICE_PLAN_FAILED;
    const size_t size = (size_t)status.st_size;
    void *bytes = mmap(NULL, size, PROT_READ, MAP_SHARED, file, 0);
    if (bytes == MAP_FAILED)
        return SERVICE_PLAN_MEMORY;
    *move = service_move_read(bytes, size, planner->rig, planner->page->text);
    if (*move == NULL) {
        (void)munmap(bytes, size);
        return SERVICE_PLAN_FAILED;
    }
    (*move)->lent = lent;
    *lent = true;
    return SERVICE_PLAN_DONE;
}

enum service_plan_state service_planner_take(struct service_planner *planner,
                                             struct service_move **move)
{
    struct planner_word word = { .state = SERVICE_PLAN_FAILED };
    ssize_t got;
    *move = NULL;
    do
        got = planner->link < 0
                  ? 0
                  : recv(planner->link, &word, sizeof word, MSG_DONTWAIT);
    while (got == (ssize_t)sizeof word &&
           (!planner->works || word.number != planner->number));
    if (got < 0 || !planner->works)
        return SERVICE_PLAN_NONE;
    planner->works = false;
    if (got == 0)
        return SERVICE_PLAN_FAILED;
    return word.state == SERVICE_PLAN_DONE ? planner_result(planner, move)
                                           : word.state;
}

void service_planner_progress(const struct service_planner *planner,
                              struct service_plan_progress *progress)
{
    const struct service_plan_page *page = planner->page;
    uint32_t turn;
    int tries = 0;
    do {
        turn = atomic_load(&page->turn);
        *progress = page->progress;
    } while ((turn % 2 != 0 || turn != atomic_load(&page->turn)) &&
             ++tries < 100);
    if (tries == 100)
        *progress = (struct service_plan_progress){ .of = 0 };
    progress->doing[sizeof progress->doing - 1] = '\0';
    progress->what[sizeof progress->what - 1] = '\0';
}

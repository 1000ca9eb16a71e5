#define _GNU_SOURCE
#include "link.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

extern char **environ;

// ---- the worker's end

// last line of the log that says something
static void link_last_line(const dem_link *link, char *line, size_t size) {
    char tail[4096];
    FILE *file = link->log ? fopen(link->log, "rbe") : NULL;
    size_t n = 0;

    line[0] = 0;
    if (file) {
        if (fseek(file, -(long)(sizeof tail - 1), SEEK_END) != 0)
            rewind(file);
        n = fread(tail, 1, sizeof tail - 1, file);
        fclose(file);
    }
    while (n > 0 && (unsigned char)tail[n - 1] <= ' ')
        n--;
    tail[n] = 0;
    char *start = n ? memrchr(tail, '\n', n) : NULL;
    start = start ? start + 1 : tail;
    while (*start == ' ' || *start == '\t')
        start++;
    snprintf(line, size, "%.*s", (int)size - 1, *start ? start : "(none)");
}

// takes the worker's exit status; kills it when it does not end by itself
static int link_reap(dem_link *link, double patience) {
    int status = 0;
    double until = silt_seconds() + patience;
    while (link->process > 0) {
        pid_t ended = waitpid(link->process, &status, WNOHANG);
        if (ended == link->process || (ended < 0 && errno != EINTR)) {
            link->process = 0;
        } else if (silt_seconds() > until) {
            kill(link->process, SIGKILL);
            until += 3600;
        } else {
            nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
        }
    }
    return status;
}

// remembers a failure and ends what is left of the worker
static silt_status link_broken(dem_link *link, silt_error *err) {
    if (link->process > 0)
        link_reap(link, 0);
    link->failed = true;
    link->busy = false;
    return silt_fail(err, SILT_FAILED, "%s", link->why.text);
}

silt_status dem_link_give_up(dem_link *link, silt_error *err, const char *format, ...) {
    char text[1024];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    memset(&link->why, 0, sizeof link->why);
    silt_fail(&link->why, SILT_FAILED, "%s", text);
    link->gave_up = true;
    return link_broken(link, err);
}

// the worker is gone: says why
static silt_status link_ended(dem_link *link, silt_error *err) {
    char line[512];
    int status = link_reap(link, 5);
    const char *log = link->log ? link->log : "none";

    memset(&link->why, 0, sizeof link->why);
    link->shared->text[sizeof link->shared->text - 1] = 0;
    link_last_line(link, line, sizeof line);
    link->gave_up = link->shared->text[0] != 0;
    if (link->gave_up)
        silt_fail(&link->why, SILT_FAILED, "the LIGGGHTS worker (pid %d) gave up: %s (log: %s)", link->pid,
                  link->shared->text, log);
    else if (WIFSIGNALED(status))
        silt_fail(&link->why, SILT_FAILED,
                  "the LIGGGHTS worker (pid %d) was killed by signal %d; its last log line: %s (log: %s)", link->pid,
                  WTERMSIG(status), line, log);
    else
        silt_fail(&link->why, SILT_FAILED,
                  "the LIGGGHTS worker (pid %d) ended with exit code %d; its last log line: %s (log: %s)", link->pid,
                  WEXITSTATUS(status), line, log);
    return link_broken(link, err);
}

// ---- talk

// waits for the worker's answer, or its end
silt_status dem_link_collect(dem_link *link, silt_error *err) {
    for (;;) {
        struct pollfd wait = {.fd = link->socket, .events = POLLIN};
        int ready = poll(&wait, 1, 200);
        if (ready > 0) {
            char word = 0;
            ssize_t got = recv(link->socket, &word, 1, 0);
            if (got < 0 && errno == EINTR)
                continue;
            link->busy = false;
            return got == 1 && word == DEM_DONE ? SILT_OK : link_ended(link, err);
        }
        // the socket closes when the worker ends; this is for a worker whose socket someone else holds open
        siginfo_t info = {0};
        if (ready == 0 &&
            (waitid(P_PID, (id_t)link->process, &info, WEXITED | WNOHANG | WNOWAIT) != 0 || info.si_pid != 0))
            return link_ended(link, err);
    }
}

silt_status dem_link_send(dem_link *link, char word, silt_error *err) {
    if (send(link->socket, &word, 1, MSG_NOSIGNAL) != 1)
        return link_ended(link, err);
    link->busy = true;
    return SILT_OK;
}

// makes room for the sections that shared's lengths ask for
silt_status dem_link_reserve(dem_link *link, silt_error *err) {
    uint64_t need = dem_shared_layout(link->shared);
    if (need <= link->shared->size)
        return SILT_OK;
    uint64_t old = link->shared->size, size = (need + need / 4 + 65535) & ~(uint64_t)65535;
    if (ftruncate(link->memory, (off_t)size) != 0)
        return silt_fail(err, SILT_FAILED, "shared memory of %llu bytes for the LIGGGHTS worker: %s",
                         (unsigned long long)size, strerror(errno));
    void *moved = mremap(link->shared, old, size, MREMAP_MAYMOVE);
    if (moved == MAP_FAILED)
        return silt_fail(err, SILT_FAILED, "shared memory of %llu bytes for the LIGGGHTS worker: %s",
                         (unsigned long long)size, strerror(errno));
    link->shared = moved;
    link->shared->size = size;
    return SILT_OK;
}

// ---- the restart file

silt_status dem_link_read(dem_link *link, unsigned char **bytes, size_t *size, silt_error *err) {
    off_t end = lseek(link->restart, 0, SEEK_END);
    size_t n = end > 0 ? (size_t)end : 0, done = 0;
    *bytes = silt_alloc(n + 1, 1);
    while (done < n) {
        ssize_t got = pread(link->restart, *bytes + done, n - done, (off_t)done);
        if (got <= 0 && errno != EINTR)
            break;
        done += got > 0 ? (size_t)got : 0;
    }
    *size = n;
    if (n > 0 && done == n)
        return SILT_OK;
    free(*bytes);
    *bytes = NULL;
    return silt_fail(err, SILT_FAILED, "the restart of the LIGGGHTS worker cannot be read: %zu of %zu bytes", done, n);
}

silt_status dem_link_write(dem_link *link, const unsigned char *bytes, size_t size, silt_error *err) {
    size_t done = 0;
    while (done < size) {
        ssize_t put = pwrite(link->restart, bytes + done, size - done, (off_t)done);
        if (put < 0 && errno != EINTR)
            return silt_fail(err, SILT_FAILED, "the restart for the LIGGGHTS worker: %s", strerror(errno));
        done += put > 0 ? (size_t)put : 0;
    }
    return SILT_OK;
}

// ---- opening and closing

// a descriptor above those that the worker gets, closed on exec
static int link_high(int fd) {
    if (fd < 0)
        return fd;
    int high = fcntl(fd, F_DUPFD_CLOEXEC, 16);
    close(fd);
    return high;
}

silt_status dem_link_open(dem_link *link, const char *worker, const char *log_path, bool append, silt_error *err) {
    silt_status status = SILT_OK;
    int pair[2] = {-1, -1}, log = -1, code;
    char parent[32];
    posix_spawn_file_actions_t action;
    posix_spawnattr_t attribute;
    sigset_t none, all;

    posix_spawn_file_actions_init(&action);
    posix_spawnattr_init(&attribute);
    const char *path = log_path ? log_path : "/dev/null";
    *link = (dem_link){.log = log_path, .socket = -1, .memory = -1, .restart = -1, .open = true};
    log = link_high(open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | (append ? 0 : O_TRUNC), 0666));
    if (log < 0) {
        status =
            silt_fail(err, SILT_FAILED, "%s: cannot write the log of the LIGGGHTS worker: %s", path, strerror(errno));
        goto done;
    }
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0 || (pair[1] = link_high(pair[1])) < 0 ||
        (link->memory = link_high(memfd_create("silt-dem", MFD_CLOEXEC))) < 0 ||
        (link->restart = link_high(memfd_create("silt-dem-restart", MFD_CLOEXEC))) < 0 ||
        ftruncate(link->memory, 65536) != 0) {
        status = silt_fail(err, SILT_FAILED, "shared memory for the LIGGGHTS worker: %s", strerror(errno));
        goto done;
    }
    link->socket = pair[0];
    link->shared = mmap(NULL, 65536, PROT_READ | PROT_WRITE, MAP_SHARED, link->memory, 0);
    if (link->shared == MAP_FAILED) {
        link->shared = NULL;
        status = silt_fail(err, SILT_FAILED, "shared memory for the LIGGGHTS worker: %s", strerror(errno));
        goto done;
    }
    link->shared->size = 65536;

    // default signals, nothing open but what it needs
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attribute, &none);
    posix_spawnattr_setsigdefault(&attribute, &all);
    posix_spawnattr_setflags(&attribute, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    posix_spawn_file_actions_addopen(&action, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&action, log, 1);
    posix_spawn_file_actions_adddup2(&action, log, 2);
    posix_spawn_file_actions_adddup2(&action, pair[1], DEM_FD_SOCKET);
    posix_spawn_file_actions_adddup2(&action, link->memory, DEM_FD_MEMORY);
    posix_spawn_file_actions_adddup2(&action, link->restart, DEM_FD_RESTART);
    posix_spawn_file_actions_addclosefrom_np(&action, DEM_FD_FREE);
    snprintf(parent, sizeof parent, "%d", (int)getpid());
    char word[48];
    dem_serve_word(word);
    char *argument[] = {(char *)(uintptr_t)worker, word, parent, NULL};
    code = posix_spawn(&link->process, worker, &action, &attribute, argument, environ);
    if (code != 0) {
        link->process = 0;
        status =
            silt_fail(err, SILT_FAILED,
                      "cannot start the LIGGGHTS worker \"%s\": %s (it is built and installed beside silt as silt-dem)",
                      worker, strerror(code));
        goto done;
    }
    link->pid = link->process;
done:
    if (log >= 0)
        close(log);
    if (pair[1] >= 0)
        close(pair[1]);
    if (pair[0] >= 0 && link->socket != pair[0])
        close(pair[0]);
    posix_spawnattr_destroy(&attribute);
    posix_spawn_file_actions_destroy(&action);
    return status;
}

void dem_link_close(dem_link *link) {
    if (!link->open)
        return;
    // asked to end, which takes its time where others run too; killed when it is in the middle of something
    if (link->process > 0) {
        char word = DEM_CLOSE;
        bool idle = !link->busy && send(link->socket, &word, 1, MSG_NOSIGNAL) == 1;
        link_reap(link, idle ? 30 : 0);
    }
    if (link->shared)
        munmap(link->shared, link->shared->size);
    int descriptor[] = {link->socket, link->memory, link->restart};
    for (int k = 0; k < 3; k++)
        if (descriptor[k] >= 0)
            close(descriptor[k]);
    memset(link, 0, sizeof *link);
}

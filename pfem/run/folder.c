// the output folder: made, locked, cleared of an earlier run; and where the worker is found
#define _GNU_SOURCE // dladdr
#include <dlfcn.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <fnmatch.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "run.h"

// one run at a time in a folder; the lock ends with the process. *lock: descriptor, -1 where the file system has no
// locks
silt_status silt_folder_lock(const char *out, int *lock, silt_error *err) {
    *lock = open(out, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (*lock < 0)
        return silt_fail(err, errno == ENOTDIR ? SILT_INPUT : SILT_FAILED, "%s: cannot be used as output folder: %s",
                         out, strerror(errno));
    if (flock(*lock, LOCK_EX | LOCK_NB) == 0)
        return SILT_OK;
    const bool busy = errno == EWOULDBLOCK;
    close(*lock);
    *lock = -1;
    return busy ? silt_fail(err, SILT_INPUT,
                            "%s: another silt is running in this folder; name another one with -o, or stop it first",
                            out)
                : SILT_OK;
}

// what an earlier run left in the folder, and nothing else
static void out_clear(const char *out) {
    static const char *const ours[] = {"checkpoint-[ab].h5",
                                       "summary.json",
                                       "run.log",
                                       "history.csv",
                                       "dem.log",
                                       "trace.csv",
                                       "run.h5",
                                       "*.hdf.series",
                                       "*_[0-9][0-9][0-9][0-9][0-9][0-9].hdf",
                                       "picture_*.png",
                                       "report.html"};
    DIR *folder = opendir(out);
    for (struct dirent *entry; folder && (entry = readdir(folder));)
        for (size_t k = 0; k < sizeof ours / sizeof *ours; k++) {
            char *part = silt_text("%s.part", ours[k]);
            if (fnmatch(ours[k], entry->d_name, 0) == 0 || fnmatch(part, entry->d_name, 0) == 0)
                unlinkat(dirfd(folder), entry->d_name, 0);
            free(part);
        }
    if (folder)
        closedir(folder);
}

// an existing folder is refused unless told otherwise
silt_status silt_folder_prepare(const char *out, bool force, int *lock, silt_error *err) {
    const bool fresh = mkdir(out, 0777) == 0;
    if (!fresh && errno != EEXIST)
        return silt_fail(err, SILT_FAILED, "%s: cannot make the output folder: %s", out, strerror(errno));
    if (!fresh && !force)
        return silt_fail(
            err, SILT_INPUT,
            "%s: exists already; name another folder with -o, replace it with --force, or go on with: silt resume %s",
            out, out);
    SILT_TRY(silt_folder_lock(out, lock, err));
    if (!fresh)
        out_clear(out);
    return SILT_OK;
}

// the scene's folder name plus .out, in the current folder
char *silt_folder_default(const silt_scene *scene) {
    char *full = realpath(scene->path, NULL);
    char *slash = full ? strrchr(full, '/') : NULL;
    if (slash)
        *slash = 0;
    const char *name = slash ? strrchr(full, '/') : NULL;
    char *out = silt_text("%s.out", name && name[1] ? name + 1 : "silt");
    free(full);
    return out;
}

// silt-dem stands beside the program, or in libexec of the installed tree
// the first that can be run of what lies near a file, in the build tree or installed; else where it should be
static char *worker_near(const char *file) {
    static const char *const place[] = {"silt-dem", "../silt-dem", "../libexec/silt/silt-dem", "../../libexec/silt/silt-dem"};
    const char *slash = strrchr(file, '/');
    for (size_t k = 0; slash && k < sizeof place / sizeof *place; k++) {
        char *path = silt_text("%.*s/%s", (int)(slash - file), file, place[k]);
        if (access(path, X_OK) == 0)
            return path;
        free(path);
    }
    return slash ? silt_text("%.*s/silt-dem", (int)(slash - file), file) : silt_text("silt-dem");
}

char *silt_worker_find(const char *asked) {
    if (asked)
        return silt_text("%s", asked);
    // beside libsilt, where another program has loaded silt as that; else beside the program
    Dl_info library;
    if (dladdr(__func__, &library) && library.dli_fname && strstr(library.dli_fname, "/libsilt.so"))
        return worker_near(library.dli_fname);
    char self[4096];
    const ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    self[n > 0 ? n : 0] = 0;
    return worker_near(self);
}

void silt_run_warn(const silt_run *run, const char *format, ...) {
    if (run->again)
        return;
    char text[512], *path = silt_text("%s/run.log", run->out);
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    FILE *log = fopen(path, "a");
    if (!run->def.quiet)
        fprintf(stderr, "warning: t = %.6g s: %s\n", run->time, text);
    if (log) {
        fprintf(log, "warning: t = %.6g s: %s\n", run->time, text);
        fclose(log);
    }
    free(path);
}

void silt_folder_remove(const char *path) {
    DIR *folder = opendir(path);
    for (struct dirent *entry; folder && (entry = readdir(folder));)
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0)
            unlinkat(dirfd(folder), entry->d_name, 0);
    if (folder)
        closedir(folder);
    rmdir(path);
}

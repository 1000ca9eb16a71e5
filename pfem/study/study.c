// silt study: jobs in parallel, each in a process of its own, then the table, the plots and the report
#include <errno.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "study.h"

// the study's name: that of its file, or of its folder where the file is called study.yaml, and .study
static char *study_folder_default(const char *path) {
    char *full = realpath(path, NULL), *slash = full ? strrchr(full, '/') : NULL;
    const char *file = slash ? slash + 1 : path;
    char *stem = silt_text("%.*s", (int)strcspn(file, "."), file), *out;
    if (slash)
        *slash = 0;
    const char *parent = slash ? strrchr(full, '/') : NULL;
    if (parent && parent[1] && strcmp(stem, "study") == 0)
        out = silt_text("%s.study", parent + 1);
    else
        out = silt_text("%s.study", *stem ? stem : "silt");
    free(stem);
    free(full);
    return out;
}

// a folder that is there must be one of a study
static silt_status study_folder(const char *out, silt_error *err) {
    char *runs = silt_text("%s/runs", out);
    silt_status status = SILT_OK;
    const bool made = mkdir(out, 0777) == 0;
    if (!made && errno != EEXIST)
        status = silt_fail(err, SILT_FAILED, "%s: cannot be made (%s)", out, strerror(errno));
    else if (!made && access(runs, F_OK) != 0 && rmdir(out) != 0)
        status = silt_fail(err, SILT_INPUT,
                           "%s: found something else than the results of a study, allowed: a new folder with -o, or "
                           "that of a study, which goes on",
                           out);
    else {
        mkdir(out, 0777);
        if (mkdir(runs, 0777) != 0 && errno != EEXIST)
            status = silt_fail(err, SILT_FAILED, "%s: cannot be made (%s)", runs, strerror(errno));
    }
    free(runs);
    return status;
}

// ---------------------------------------------------------------- the plan

// text as one word of a shell, behind what leads it
static void plan_word(const char *lead, const char *text) {
    printf("%s", lead);
    if (*text &&
        strspn(text, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=+,:") == strlen(text)) {
        printf("%s", text);
        return;
    }
    putchar('\'');
    for (; *text; text++)
        printf(*text == '\'' ? "'\\''" : "%c", *text);
    putchar('\'');
}

// absolute names, since the commands may run from anywhere
static void plan_place(const char *path) {
    char *full = realpath(path, NULL), *here = full ? NULL : realpath(".", NULL);
    char *made = full                    ? silt_text("%s", full)
                 : *path == '/' || !here ? silt_text("%s", path)
                                         : silt_text("%s/%s", here, path);
    plan_word(" ", made);
    free(made);
    free(here);
    free(full);
}

static void study_plan(const study *s, const silt_study_def *def, const char *out) {
    char self[4096];
    const ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    self[n > 0 ? n : 0] = 0;
    for (int k = 0; k < study_count(s); k++) {
        plan_word("", n > 0 ? self : "silt");
        printf(" study");
        plan_place(s->path);
        printf(" -q --run %d -o", k + 1);
        plan_place(out);
        for (int i = 0; i < def->n_set; i++) {
            printf(" -D");
            plan_word(" ", def->set[i]);
        }
        if (def->worker) {
            printf(" --worker");
            plan_place(def->worker);
        }
        putchar('\n');
    }
}

// ---------------------------------------------------------------- jobs

// a job whose process died itself: its runs have no row, so one says what happened
static silt_status job_lost(const study *s, const char *out, int k, int code, silt_error *err) {
    char *path = silt_text("%s/runs/%05d%s.row", out, k + 1, s->seek.on || s->repeats > 1 ? "-01" : "");
    study_row row = {0};
    silt_status status = SILT_OK;
    if (access(path, F_OK) != 0) {
        study_row_add(&row, "run", "%05d", k + 1);
        study_row_add(&row, "point", "%d", k + 1);
        for (int r = 0; r < s->n_range; r++)
            study_row_add(&row, s->range[r].key, "%s", study_value(s, k, r));
        study_row_add(&row, "status", "%s", study_status_word[RUN_CRASHED]);
        study_row_add(&row, "reason",
                      "the study's own process was ended by signal %d while it read the scene or the results",
                      WTERMSIG(code));
        status = study_row_write(&row, path, err);
    }
    study_row_clear(&row);
    free(path);
    return status;
}

static pid_t job_start(const study *s, const silt_study_def *def, const char *out, int k) {
    const pid_t child = fork();
    if (child != 0)
        return child;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    silt_error *err = silt_alloc(1, sizeof *err);
    const silt_status status = study_job(s, def, out, k, err);
    if (status != SILT_OK)
        fprintf(stderr, "%s\n", err->text);
    _exit((int)status);
}

static silt_status study_jobs(const study *s, const silt_study_def *def, const char *out, silt_error *err) {
    const int n = study_count(s), most = def->jobs > 0 ? def->jobs : 1;
    pid_t *child = silt_alloc((size_t)n, sizeof *child);
    int next = 0, running = 0, done = 0;
    silt_status status = SILT_OK;
    while ((next < n && status == SILT_OK) || running > 0) {
        if (next < n && running < most && status == SILT_OK) {
            child[next] = job_start(s, def, out, next);
            if (child[next] < 0)
                status = silt_fail(err, SILT_FAILED, "study: no process for a job (%s)", strerror(errno));
            else
                running++;
            next++;
            continue;
        }
        int code = 0;
        const pid_t ended = wait(&code);
        if (ended < 0 && errno != EINTR)
            break;
        for (int k = 0; k < next; k++) {
            if (child[k] != ended)
                continue;
            running--;
            done++;
            if (WIFSIGNALED(code) && status == SILT_OK)
                status = job_lost(s, out, k, code, err);
            else if (WIFEXITED(code) && WEXITSTATUS(code) && status == SILT_OK)
                status = silt_fail(err, SILT_FAILED, "study: job %d could not be done, see above", k + 1);
            if (!def->quiet)
                fprintf(stderr, "%d of %d jobs\n", done, n);
        }
    }
    free(child);
    return status;
}

// ---------------------------------------------------------------- all

static silt_status study_close(const study *s, const char *out, FILE *to, silt_error *err) {
    study_table table;
    silt_status status = study_collect(s, out, &table, err);
    int bad = 0;
    if (status == SILT_OK)
        status = study_plots(s, out, &table, to, err);
    if (status == SILT_OK)
        status = study_report(s, out, &table, to, err);
    if (status == SILT_OK && table.n == 0)
        status = silt_fail(err, SILT_FAILED, "%s: no run of this study is there", out);
    for (int i = 0; i < table.n; i++)
        bad += study_row_status(&table.row[i]) > RUN_UNFINISHED;
    if (status == SILT_OK && bad)
        status = silt_fail(err, SILT_FAILED, "%s: %d runs crashed, hung or are wrong", out, bad);
    study_table_clear(&table);
    return status;
}

silt_status silt_study(const silt_study_def *def, FILE *to, silt_error *err) {
    study s;
    char *out = def->out ? silt_text("%s", def->out) : study_folder_default(def->path);
    silt_status status = study_read(&s, def, err);
    if (status != SILT_OK)
        goto done;
    study_points(&s);
    if (def->only > study_count(&s)) {
        status = silt_fail(err, SILT_INPUT, "--run %d: allowed 1 to %d, the jobs of %s", def->only, study_count(&s),
                           def->path);
        goto done;
    }
    if (def->plan) {
        study_plan(&s, def, out);
        goto done;
    }
    status = study_folder(out, err);
    if (status == SILT_OK && def->only)
        status = study_job(&s, def, out, def->only - 1, err);
    else if (status == SILT_OK && !def->collect)
        status = study_jobs(&s, def, out, err);
    if (status == SILT_OK && !def->only)
        status = study_close(&s, out, to, err);
done:
    study_clear(&s);
    free(out);
    return status;
}

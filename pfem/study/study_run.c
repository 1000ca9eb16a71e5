// one run: the child, its limits, what became of it; and a job, which is the repeats of a point or its search
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "run.h"
#include "study.h"

#define WALL_FACTOR                                                                                                    \
    20.0                // the limit on the wall's clock in that of the processor: a busy machine is no fault of the run
#define WALL_LEAST 60.0 // s more
#define LOOK_EVERY 20   // ms

// ---------------------------------------------------------------- the child

// silt run SCENE -o OUT -q --threads N -D ...
static char **child_words(const study *s, const silt_study_def *def, const char *out, int n_set, char *const *set) {
    char **word = silt_alloc(2 * (size_t)n_set + 12, sizeof *word);
    int n = 0;
    word[n++] = silt_text("silt");
    word[n++] = silt_text("run");
    word[n++] = silt_text("%s", s->scene);
    word[n++] = silt_text("-o");
    word[n++] = silt_text("%s", out);
    word[n++] = silt_text("-q");
    word[n++] = silt_text("--threads");
    word[n++] = silt_text("%d", s->threads);
    if (def->worker) {
        word[n++] = silt_text("--worker");
        word[n++] = silt_text("%s", def->worker);
    }
    for (int i = 0; i < n_set; i++) {
        word[n++] = silt_text("-D");
        word[n++] = silt_text("%s", set[i]);
    }
    return word;
}

static void words_free(char **word) {
    for (int i = 0; word[i]; i++)
        free(word[i]);
    free(word);
}

static void child_limit(int what, double value) {
    struct rlimit limit = {(rlim_t)value, (rlim_t)value};
    setrlimit(what, &limit);
}

static void __attribute__((noreturn)) child_become(const study *s, const char *log, char *const *word) {
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int to = open(log, O_WRONLY | O_CREAT | O_TRUNC, 0666), from = open("/dev/null", O_RDONLY);
    if (to >= 0 && from >= 0) {
        dup2(from, 0);
        dup2(to, 1);
        dup2(to, 2);
        child_limit(RLIMIT_AS, 1e9 * s->memory);
        child_limit(RLIMIT_CORE, 0);
        execv("/proc/self/exe", word);
    }
    _exit(127);
}

static double process_cpu(pid_t process) {
    clockid_t clock;
    struct timespec now = {0};
    if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &now) != 0)
        return 0;
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// s of processor that a run has taken so far, with its threads and its worker
static double child_cpu(pid_t child) {
    char *path = silt_text("/proc/%d/task/%d/children", (int)child, (int)child);
    double sum = process_cpu(child);
    int worker;
    FILE *from = fopen(path, "r");
    while (from && fscanf(from, "%d", &worker) == 1)
        sum += process_cpu(worker);
    if (from)
        fclose(from);
    free(path);
    return sum;
}

// s since the run wrote a row, or since it began
static double child_idle(const char *history, double wall) {
    struct stat file;
    struct timespec now;
    if (stat(history, &file) != 0 || clock_gettime(CLOCK_REALTIME, &now) != 0)
        return wall;
    return silt_clamp((double)(now.tv_sec - file.st_mtim.tv_sec), 0, wall);
}

static silt_status child_run(const study *s, const char *out, const char *log, char *const *word, study_end *end,
                             silt_error *err) {
    const double began = silt_seconds();
    *end = (study_end){0};
    const pid_t child = fork();
    if (child == 0)
        child_become(s, log, word);
    if (child < 0)
        return silt_fail(err, SILT_FAILED, "study: no process for a run (%s)", strerror(errno));
    setpgid(child, child);
    char *history = silt_text("%s/history.csv", out);
    struct rusage usage = {0};
    int code = 0;
    for (;;) {
        const pid_t done = wait4(child, &code, WNOHANG, &usage);
        if (done == child || (done < 0 && errno != EINTR))
            break;
        end->wall = silt_seconds() - began;
        if (!end->late && (child_cpu(child) > s->limit || end->wall > WALL_FACTOR * s->limit + WALL_LEAST)) {
            end->late = true;
            end->stalled = child_idle(history, end->wall) > 0.5 * end->wall;
            kill(-child, SIGKILL);
        }
        nanosleep(&(struct timespec){0, LOOK_EVERY * 1000000L}, NULL);
    }
    free(history);
    end->wall = silt_seconds() - began;
    end->code = WIFEXITED(code) ? WEXITSTATUS(code) : -1;
    end->signal = WIFSIGNALED(code) ? WTERMSIG(code) : 0;
    end->cpu = (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
               1e-6 * (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
    end->memory = 1024.0 * (double)usage.ru_maxrss;
    return SILT_OK;
}

// ---------------------------------------------------------------- one run

// what the run hangs on: the scene as it is read with these replacements, or what is wrong with it, and how it is
// judged
static uint64_t run_hash(const study *s, int n_set, char *const *set) {
    silt_scene *scene = NULL;
    silt_error err = {0};
    uint64_t hash;
    if (silt_scene_read(s->scene, n_set, (const char *const *)set, &scene, &err) == SILT_OK)
        hash = silt_hash(0, &scene->hash, sizeof scene->hash);
    else
        hash = silt_hash(0, err.text, strlen(err.text));
    silt_scene_free(&scene);
    const double judged[] = {s->limit,       s->memory,          s->threads,      s->bounds.volume,
                             s->bounds.mass, s->bounds.sediment, s->bounds.energy};
    return silt_hash(hash, judged, sizeof judged);
}

silt_status study_run(const study *s, const silt_study_def *def, const char *out, const char *name, int n_set,
                      char *const *set, const study_row *head, study_row *row, silt_error *err) {
    char *file = silt_text("%s/runs/%s.row", out, name), *folder = silt_text("%s/runs/%s.out", out, name);
    char *log = silt_text("%s/runs/%s.log", out, name), hash[32];
    silt_status status = SILT_OK;
    snprintf(hash, sizeof hash, "%016llx", (unsigned long long)run_hash(s, n_set, set));
    const char *before = !def->force && study_row_read(row, file) ? study_row_text(row, "hash") : NULL;
    if (before && strcmp(before, hash) == 0)
        goto done;
    study_row_clear(row);
    unlink(file);
    silt_folder_remove(folder);
    for (int i = 0; i < head->n; i++)
        study_row_add(row, head->cell[i].name, "%s", head->cell[i].value);
    study_end end;
    char **word = child_words(s, def, folder, n_set, set);
    status = child_run(s, folder, log, word, &end, err);
    words_free(word);
    if (status != SILT_OK)
        goto done;
    study_result(s, folder, log, &end, row);
    study_row_add(row, "hash", "%s", hash);
    status = study_row_write(row, file, err);
    const bool good = study_row_status(row) <= RUN_REFUSED;
    if (s->keep == KEEP_NOTHING || (s->keep == KEEP_BAD && good))
        silt_folder_remove(folder);
done:
    free(file);
    free(folder);
    free(log);
    return status;
}

// ---------------------------------------------------------------- a job

static void job_head(const study *s, int k, const char *name, study_row *head) {
    study_row_add(head, "run", "%s", name);
    study_row_add(head, "point", "%d", k + 1);
    for (int r = 0; r < s->n_range; r++)
        study_row_add(head, s->range[r].key, "%s", study_value(s, k, r));
}

static void set_free(char **set, int n) {
    for (int i = 0; i < n; i++)
        free(set[i]);
    free(set);
}

// what the study and a point of it set; value: of the key that is sought, NULL: none
static char **job_set(const study *s, int k, const char *value, int *n_set) {
    char **set = NULL;
    int capacity = 0;
    *n_set = 0;
    SILT_RESERVE(set, capacity, s->n_set + 1);
    for (int i = 0; i < s->n_set; i++)
        set[(*n_set)++] = silt_text("%s", s->set[i]);
    for (int r = 0; r < s->n_range; r++)
        study_assign(&set, n_set, &capacity, s->range[r].key, s->range[r].form, s->range[r].n_with, s->range[r].with,
                     study_value(s, k, r));
    if (value)
        study_assign(&set, n_set, &capacity, s->seek.key, s->seek.form, s->seek.n_with, s->seek.with, value);
    return set;
}

static silt_status job_run(const study *s, const silt_study_def *def, const char *out, int k, const char *value,
                           const char *name, study_row *row, silt_error *err) {
    int n_set;
    char **set = job_set(s, k, value, &n_set);
    study_row head = {0};
    job_head(s, k, name, &head);
    if (value)
        study_row_add(&head, s->seek.key, "%s", value);
    const silt_status status = study_run(s, def, out, name, n_set, set, &head, row, err);
    study_row_clear(&head);
    set_free(set, n_set);
    return status;
}

/** the search at a point */
typedef struct job_search {
    const study *s;
    const silt_study_def *def;
    const char *out;
    int k, n_run;
    bool met;
} job_search;

// how far the check's scalar is above what is asked for at x of the key; NaN: the run gave none
static silt_status search_at(job_search *search, double x, double *above, silt_error *err) {
    const study_seek *seek = &search->s->seek;
    char name[32], value[32];
    study_row row = {0};
    snprintf(name, sizeof name, "%05d-%02d", search->k + 1, ++search->n_run);
    snprintf(value, sizeof value, "%.9g", x);
    const silt_status status = job_run(search->s, search->def, search->out, search->k, value, name, &row, err);
    if (status == SILT_OK) {
        char *column = silt_text("%s_value", seek->check);
        *above = study_row_status(&row) <= RUN_BEYOND ? study_row_number(&row, column) - seek->value : NAN;
        free(column);
    }
    study_row_clear(&row);
    search->met = fabs(*above) <= seek->tolerance * (seek->value != 0 ? fabs(seek->value) : 1);
    return status;
}

// OUT/runs/NNNNN.sought: what was found at the point
static silt_status search_tell(const job_search *search, double x, double above, const char *word, silt_error *err) {
    const study_seek *seek = &search->s->seek;
    char *file = silt_text("%s/runs/%05d.sought", search->out, search->k + 1);
    study_row row = {0};
    job_head(search->s, search->k, "sought", &row);
    study_row_add(&row, seek->key, "%.9g", x);
    study_row_add(&row, seek->check, "%.9g", above + seek->value);
    study_row_add(&row, "asked", "%.9g", seek->value);
    study_row_add(&row, "runs", "%d", search->n_run);
    study_row_add(&row, "result", "%s", word);
    const silt_status status = study_row_write(&row, file, err);
    study_row_clear(&row);
    free(file);
    return status;
}

static silt_status job_search_run(job_search *search, silt_error *err) {
    const study_seek *seek = &search->s->seek;
    double x[2] = {seek->low, seek->high}, above[2] = {NAN, NAN};
    for (int i = 0; i < 2; i++) {
        SILT_TRY(search_at(search, x[i], &above[i], err));
        if (search->met)
            return search_tell(search, x[i], above[i], "found", err);
        if (isnan(above[i]))
            return search_tell(search, x[i], above[i], "a run at an end of the range gave no value", err);
    }
    if ((above[0] > 0) == (above[1] > 0)) {
        const int near = fabs(above[1]) < fabs(above[0]);
        return search_tell(search, x[near], above[near], "both ends of the range are on the same side of the value",
                           err);
    }
    double middle = NAN, here = NAN;
    while (search->n_run < seek->runs) {
        middle = seek->log ? sqrt(x[0] * x[1]) : 0.5 * (x[0] + x[1]);
        SILT_TRY(search_at(search, middle, &here, err));
        if (search->met)
            return search_tell(search, middle, here, "found", err);
        if (isnan(here))
            return search_tell(search, middle, here, "a run gave no value", err);
        const int side = (here > 0) == (above[1] > 0);
        x[side] = middle;
        above[side] = here;
    }
    return search_tell(search, middle, here, "not within the tolerance after the most runs", err);
}

silt_status study_job(const study *s, const silt_study_def *def, const char *out, int k, silt_error *err) {
    if (s->seek.on) {
        job_search search = {.s = s, .def = def, .out = out, .k = k};
        return job_search_run(&search, err);
    }
    for (int i = 0; i < s->repeats; i++) {
        char name[32];
        study_row row = {0};
        snprintf(name, sizeof name, s->repeats > 1 ? "%05d-%02d" : "%05d", k + 1, i + 1);
        const silt_status status = job_run(s, def, out, k, NULL, name, &row, err);
        study_row_clear(&row);
        SILT_TRY(status);
    }
    return SILT_OK;
}

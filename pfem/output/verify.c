// checks: the scene's demands on history.csv, curves against reference files and scalars against values

#include "verify.h"

#include <errno.h>
#include <unistd.h>

// a windowed scalar needs a history that reaches the window's end, up to this share of the window
#define VERIFY_SLACK 0.01

// ---------------------------------------------------------------- history

/** the columns of history.csv that the checks need; it may be long, so the rest is not kept */
typedef struct verify_history {
    int n_row, time_capacity, value_capacity;
    double *time;  // owned, one per row
    double *value; // owned, n_check per row, NaN where the column is absent
    int *column;   // owned, one per check: its column in the file, -1: absent
} verify_history;

static void history_clear(verify_history *history) {
    free(history->time);
    free(history->value);
    free(history->column);
    memset(history, 0, sizeof *history);
}

// index of a name in the header line, -1: absent
int silt_history_find(const char *header, const char *name) {
    size_t length = strlen(name);
    for (int i = 0;; i++) {
        size_t field = strcspn(header, ",\r\n");
        if (field == length && strncmp(header, name, length) == 0)
            return i;
        if (header[field] != ',')
            return -1;
        header += field + 1;
    }
}

double silt_history_number(const char *row, int column) {
    for (; row && column > 0; column--)
        row = (row = strchr(row, ',')) ? row + 1 : NULL;
    char *end;
    double value = row ? strtod(row, &end) : NAN;
    return row && end > row ? value : NAN;
}

static silt_status history_read(verify_history *history, const silt_scene *scene, const char *out, silt_error *err) {
    char *path = silt_text("%s/history.csv", out), *line = NULL;
    size_t capacity = 0;
    ssize_t length;
    silt_status status = SILT_OK;
    FILE *from = fopen(path, "r");
    if (!from) {
        status = silt_fail(err, SILT_FAILED, "%s: cannot be read (%s)", path, strerror(errno));
        goto done;
    }
    int time = getline(&line, &capacity, from) > 0 ? silt_history_find(line, "time") : -1;
    if (time < 0) {
        status = silt_fail(err, SILT_FAILED, "%s: its first line has no column time", path);
        goto done;
    }
    int n = scene->n_check;
    history->column = silt_alloc((size_t)n + 1, sizeof *history->column);
    for (int i = 0; i < n; i++)
        history->column[i] = scene->check[i].column ? silt_history_find(line, scene->check[i].column) : -1;
    // a last line without its end is what a killed run left, and does not count
    while ((length = getline(&line, &capacity, from)) > 0 && line[length - 1] == '\n') {
        int row = history->n_row++;
        SILT_RESERVE(history->time, history->time_capacity, row + 1);
        SILT_RESERVE(history->value, history->value_capacity, (row + 1) * n);
        history->time[row] = silt_history_number(line, time);
        for (int i = 0; i < n; i++)
            history->value[row * n + i] = history->column[i] < 0 ? NAN : silt_history_number(line, history->column[i]);
    }
done:
    if (from)
        fclose(from);
    free(line);
    free(path);
    return status;
}

static bool inside(double x, const double window[2]) {
    return x >= window[0] && x <= window[1];
}

// ---------------------------------------------------------------- one check

static const char *plain_name(const char *path) {
    return strrchr(path, '/') ? strrchr(path, '/') + 1 : path;
}

// ---------------------------------------------------------------- copies of the scene's files

/** the files that a scene reads, and the names of their copies in OUT */
typedef struct verify_files {
    int n, path_capacity, name_capacity;
    char **path, **name; // owned, texts too
} verify_files;

// the plain name, or one with a number where that is taken, by another file or by what a run writes
static const char *verify_name(void *self, const char *path) {
    static const char *const own[] = {"history.csv", "scene.yaml", "summary.json", "run.log", "dem.log", "run.h5"};
    verify_files *files = self;
    const char *plain = plain_name(path);
    bool taken = false;
    for (int i = 0; i < files->n; i++) {
        if (strcmp(files->path[i], path) == 0)
            return files->name[i];
        taken |= strcmp(files->name[i], plain) == 0;
    }
    for (size_t i = 0; i < sizeof own / sizeof *own; i++)
        taken |= strcmp(plain, own[i]) == 0;
    SILT_RESERVE(files->path, files->path_capacity, files->n + 1);
    SILT_RESERVE(files->name, files->name_capacity, files->n + 1);
    files->path[files->n] = silt_text("%s", path);
    files->name[files->n] = taken ? silt_text("%d_%s", files->n, plain) : silt_text("%s", plain);
    return files->name[files->n++];
}

static void verify_files_clear(verify_files *files) {
    for (int i = 0; i < files->n; i++) {
        free(files->path[i]);
        free(files->name[i]);
    }
    free(files->path);
    free(files->name);
}

static void verify_note(silt_check_result *result, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void verify_note(silt_check_result *result, const char *format, ...) {
    va_list list;
    va_start(list, format);
    vsnprintf(result->note, sizeof result->note, format, list);
    va_end(list);
}

// the reference's rows that `where` picks
static bool verify_read(const silt_scene *scene, const char *out, verify_files *files, int check, silt_curve *curve,
                        silt_check_result *result) {
    const silt_check_def *def = &scene->check[check];
    const char *wanted[3] = {def->x, def->y, def->where_column};
    int column[3] = {-1, -1, -1};
    silt_series series = {0};
    silt_error err = {0};
    char *copy = silt_text("%s/%s", out, verify_name(files, def->reference));
    bool here = access(copy, R_OK) == 0;
    silt_status status = silt_series_read(here ? NULL : scene->folder, here ? copy : def->reference, &series, &err);
    free(copy);
    if (status)
        verify_note(result, "%.250s", err.text);
    for (int k = 0; k < 3 && !status; k++) {
        if (!wanted[k] && k == 2)
            continue;
        column[k] = wanted[k] ? silt_series_column(&series, wanted[k]) : -1;
        if (column[k] >= 0)
            continue;
        verify_note(result, "%.150s has no column %.60s", def->reference, wanted[k] ? wanted[k] : "for x and y");
        status = SILT_FAILED;
    }
    for (int i = 0; i < series.n_row && !status; i++) {
        const double *row = series.value + (size_t)i * (size_t)series.n_column;
        if (!isnan(row[column[0]]) && !isnan(row[column[1]]) && (column[2] < 0 || row[column[2]] == def->where_value))
            silt_curve_add(curve, row[column[0]], row[column[1]]);
    }
    silt_series_clear(&series);
    return !status;
}

// difference of the history, or of the profile, from the reference at the reference's abscissas; the caller clears the reference
static void verify_curve_check(const silt_scene *scene, const char *out, verify_files *files, int check,
                               silt_curve *history, silt_curve *reference, silt_check_result *result) {
    const silt_check_def *def = &scene->check[check];
    if (!verify_read(scene, out, files, check, reference, result))
        return;
    if (def->kind == CHECK_PROFILE && !(def->profile == PROFILE_GRAINS ? silt_profile_grains : silt_profile_sample)(
                                          scene, out, def, reference, history, result->note))
        return;
    if (def->kind != CHECK_PROFILE && !isnan(def->align)) {
        double here = silt_curve_reaches(history, def->align), there = silt_curve_reaches(reference, def->align);
        if (isnan(here) || isnan(there)) {
            verify_note(result, "the %s never reaches %g, where both are to be aligned",
                        isnan(here) ? "result" : "reference", def->align);
            return;
        }
        for (int i = 0; i < history->n; i++)
            history->x[i] += there - here;
    }
    double sum = 0, mean = 0, worst = 0, last = history->n ? history->x[history->n - 1] : -HUGE_VAL;
    int n = 0, wanted = 0, late = 0;
    for (int i = 0; i < reference->n; i++) {
        double x = reference->x[i], r = reference->y[i];
        if (!inside(x, def->window) || !inside(r, def->window_value))
            continue;
        wanted++;
        late += x > last;
        double h = silt_curve_at(history, x);
        if (isnan(h))
            continue;
        double scale = def->relative_to != 0 ? def->relative_to : r;
        if (scale == 0) {
            verify_note(result, "the reference is 0 at %g: give relative_to", x);
            return;
        }
        double e = fabs((h - r) / scale);
        sum += e * e;
        mean += (h - r) / scale;
        n++;
        if (n == 1 || e > worst) {
            worst = e;
            result->value = h;
            result->reference = r;
        }
    }
    if (n == 0)
        verify_note(result, "no data: %d rows of the reference are in the window, the result has none there", wanted);
    else if (late > 0 && isfinite(def->window[1]))
        verify_note(result, "the result ends at %g, %d rows of the reference in the window come later", last, late);
    else {
        result->error = def->norm == NORM_MAX ? worst : def->norm == NORM_MEAN ? fabs(mean / n) : sqrt(sum / n);
        result->pass = result->error <= def->tolerance;
        verify_note(result, n < wanted ? "%d of %d rows of the reference" : "%d rows of the reference", n, wanted);
    }
}

static void verify_scalar_check(const silt_check_def *def, const silt_curve *history, silt_check_result *result) {
    silt_curve part = {0};
    const bool gaps = def->scalar == SCALAR_REACHES; // the others know no gaps
    double last = history->n ? history->x[history->n - 1] : -HUGE_VAL;
    for (int i = 0; i < history->n; i++)
        if (inside(history->x[i], def->window) &&
            (inside(history->y[i], def->window_value) || (gaps && isnan(history->y[i]))))
            silt_curve_add(&part, history->x[i], history->y[i]);
    if (part.n == 0) {
        verify_note(result, "no data in the window");
        goto done;
    }
    double start = isfinite(def->window[0]) ? def->window[0] : 0;
    if (isfinite(def->window[1]) && last < def->window[1] - VERIFY_SLACK * (def->window[1] - start)) {
        verify_note(result, "the result ends at %g, before the window's end %g", last, def->window[1]);
        goto done;
    }
    result->value = silt_curve_scalar(&part, def);
    if (isnan(result->value)) {
        if (def->scalar == SCALAR_AT)
            verify_note(result, "no value at %g", def->at);
        else if (def->scalar == SCALAR_REACHES)
            verify_note(result, "%g is never reached", def->level);
        else
            verify_note(result, "%s",
                        def->scalar == SCALAR_PERIOD  ? "fewer than two upward crossings of the level in the window"
                        : def->scalar == SCALAR_DECAY ? "fewer than three half waves in the window"
                                                      : "fewer than two times in the window");
        goto done;
    }
    if (!isnan(def->low) || !isnan(def->high)) {
        // a range: the error is the distance to it
        double low = isnan(def->low) ? -HUGE_VAL : def->low, high = isnan(def->high) ? HUGE_VAL : def->high;
        result->reference = isfinite(low) && isfinite(high) ? 0.5 * (low + high) : isfinite(low) ? low : high;
        result->error = silt_max(0, silt_max(low - result->value, result->value - high));
        result->tolerance = 0;
        verify_note(result, "allowed %g to %g", low, high);
    } else {
        result->reference = def->value;
        result->error = fabs(result->value - def->value) / (def->value != 0 ? fabs(def->value) : 1);
    }
    result->pass = result->error <= result->tolerance;
done:
    silt_curve_clear(&part);
}

// ---------------------------------------------------------------- all checks

silt_status silt_check_measure_seen(const silt_scene *scene, const char *out, silt_check_result *result,
                                    const silt_check_watch *watch, silt_error *err) {
    verify_history history = {0};
    verify_files files = {0};
    free(silt_scene_named(scene, verify_name, &files));
    for (int i = 0; i < scene->n_check; i++) {
        const silt_check_def *def = &scene->check[i];
        result[i] = (silt_check_result){.name = def->name, .value = NAN, .reference = NAN, .error = NAN};
        result[i].tolerance = def->tolerance;
        verify_note(&result[i], "history.csv cannot be read");
    }
    silt_status status = scene->n_check > 0 ? history_read(&history, scene, out, err) : SILT_OK;
    for (int i = 0; i < scene->n_check && !status; i++) {
        const silt_check_def *def = &scene->check[i];
        const bool profile = def->kind == CHECK_PROFILE;
        if (!profile)
            verify_note(&result[i], "history.csv has no column %.80s", def->column);
        if (!profile && history.column[i] < 0)
            continue;
        result[i].note[0] = 0;
        silt_curve curve = {0}, reference = {0};
        for (int k = 0; k < history.n_row && !profile; k++) {
            // gauges are NaN where they measure nothing: gaps in the curve
            double x = def->time_scale * (history.time[k] + def->time_shift);
            if (isfinite(x))
                silt_curve_add(&curve, x, def->scale * (history.value[k * scene->n_check + i] + def->shift));
        }
        if (def->reference)
            verify_curve_check(scene, out, &files, i, &curve, &reference, &result[i]);
        else
            verify_scalar_check(def, &curve, &result[i]);
        if (watch)
            watch->see(watch->self, i, &curve, def->reference ? &reference : NULL);
        silt_curve_clear(&curve);
        silt_curve_clear(&reference);
    }
    history_clear(&history);
    verify_files_clear(&files);
    return status;
}

silt_status silt_check_measure(const silt_scene *scene, const char *out, silt_check_result *result, silt_error *err) {
    return silt_check_measure_seen(scene, out, result, NULL, err);
}

static silt_status verify_copy_file(const char *from, const char *to, silt_error *err) {
    char block[1 << 14];
    size_t n = 0;
    FILE *source = fopen(from, "rb"), *target = source ? fopen(to, "wb") : NULL;
    silt_status status = SILT_OK;
    errno = source ? errno : ENOENT;
    while (target && (n = fread(block, 1, sizeof block, source)) > 0 && fwrite(block, 1, n, target) == n)
        continue;
    if (!target || n > 0 || ferror(source) || fflush(target) != 0)
        status = silt_fail(err, SILT_FAILED, "%s: cannot be copied to %s (%s)", from, to, strerror(errno));
    if (source)
        fclose(source);
    if (target)
        fclose(target);
    return status;
}

// copies unless both are the same file: a scene may be run from its own output folder
static silt_status verify_copy_one(const char *base, const char *path, const char *to, silt_error *err) {
    char *from = *path == '/' || !base || !*base ? silt_text("%s", path) : silt_text("%s/%s", base, path);
    char *real_from = realpath(from, NULL), *real_to = realpath(to, NULL);
    silt_status status = SILT_OK;
    if (!real_from || !real_to || strcmp(real_from, real_to) != 0)
        status = verify_copy_file(from, to, err);
    free(real_from);
    free(real_to);
    free(from);
    return status;
}

silt_status silt_verify_copy(const silt_scene *scene, const char *out, silt_error *err) {
    verify_files files = {0};
    silt_status status = SILT_OK;
    char *text = silt_scene_named(scene, verify_name, &files);
    for (int i = 0; i < files.n && !status; i++) {
        char *to = silt_text("%s/%s", out, files.name[i]);
        status = verify_copy_one(scene->folder, files.path[i], to, err);
        free(to);
    }
    char *path = silt_text("%s/scene.yaml", out), *aside = silt_text("%s.part", path);
    FILE *to = status ? NULL : fopen(aside, "w");
    if (to)
        fputs(text, to);
    if (!status && (!to || fflush(to) != 0 || ferror(to) || rename(aside, path) != 0))
        status = silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", path, strerror(errno));
    if (to)
        fclose(to);
    free(aside);
    free(path);
    free(text);
    verify_files_clear(&files);
    return status;
}

static void verify_print(FILE *to, int width, double value) {
    if (isnan(value))
        fprintf(to, " %*s", width, "-");
    else
        fprintf(to, " %*.5g", width, value);
}

static void verify_line(FILE *to, const silt_check_result *r) {
    fprintf(to, "%-24s", r->name);
    verify_print(to, 14, r->value);
    verify_print(to, 14, r->reference);
    verify_print(to, 11, r->error);
    verify_print(to, 11, r->tolerance);
    fprintf(to, "  %s%s%s%s\n", r->pass ? "pass" : "FAIL", *r->note ? " (" : "", r->note, *r->note ? ")" : "");
}

// ledgers beyond the scene's bounds fail as checks do. @return how many
static int verify_bounds(const silt_scene *scene, const char *out, FILE *to) {
    silt_bounds bounds;
    int n = 0;
    silt_bounds_measure(scene, out, &bounds);
    for (silt_bound_kind k = 0; k < BOUND_COUNT; k++) {
        char name[32];
        silt_check_result r = {.name = name, .value = bounds.of[k].worst, .error = bounds.of[k].worst};
        if (!silt_bounds_broken(&bounds, scene, k, &r.tolerance, r.note))
            continue;
        snprintf(name, sizeof name, "bounds.%s", silt_bound_word[k]);
        verify_line(to, &r);
        n++;
    }
    return n;
}

silt_status silt_verify(const char *out, FILE *to, silt_error *err) {
    char *path = silt_text("%s/scene.yaml", out);
    silt_scene *scene = NULL;
    silt_check_result *result = NULL;
    silt_status status = silt_scene_read(path, 0, NULL, &scene, err);
    int failed = 0;
    if (status)
        goto done;
    result = silt_alloc((size_t)scene->n_check + 1, sizeof *result);
    status = silt_check_measure(scene, out, result, err);
    if (status)
        goto done;
    if (scene->n_check == 0)
        fprintf(to, "the scene has no checks\n");
    else
        fprintf(to, "%-24s %14s %14s %11s %11s\n", "check", "value", "reference", "error", "tolerance");
    for (int i = 0; i < scene->n_check; i++) {
        verify_line(to, &result[i]);
        failed += !result[i].pass;
    }
    const int beyond = verify_bounds(scene, out, to);
    if (failed || beyond)
        status = silt_fail(err, SILT_FAILED, beyond ? "%s: %d of %d checks failed, %d of the ledgers beyond their bounds" : "%s: %d of %d checks failed",
                           out, failed, scene->n_check, beyond);
done:
    free(result);
    silt_scene_free(&scene);
    free(path);
    return status;
}

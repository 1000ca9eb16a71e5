// what a run left, held against what a run must keep: numbers that are finite, volume, sediment, energy; then its
// status and reason
#include <libfyaml.h>
#include <sys/stat.h>

#include "study.h"

#define RESULT_BEYOND "beyond its bounds: " // what a run says of its ledgers at its end

// a number of the last frame that is none; @return false: all are
static bool frame_bad(const char *out, char text[64]) {
    static const char *const part[] = {"fluid", "grains"}, *const array[] = {"PointData/velocity",
                                                                             "PointData/pressure"};
    silt_frame_entry *entry = NULL;
    const int n = silt_frame_index(out, &entry);
    bool bad = false;
    for (int p = 0; p < 2 && n > 0; p++)
        for (int a = 0; a < 2 - p; a++) {
            silt_grid grid = {0};
            if (silt_grid_read(&grid, out, part[p], entry[n - 1].number, array[a])) {
                for (int i = 0; i < 3 * grid.n_point && !bad; i++)
                    bad = !isfinite(grid.x[i]);
                for (int i = 0; grid.value && i < grid.width * grid.n_point && !bad; i++)
                    bad = !isfinite(grid.value[i]);
                if (bad && !*text)
                    snprintf(text, 64, "%s of frame %d", array[a], entry[n - 1].number);
            }
            silt_grid_clear(&grid);
        }
    free(entry);
    return bad;
}

// ---------------------------------------------------------------- reasons

// first line of the message of a run that ended with one
static void log_reason(const char *log, char *reason, size_t size) {
    char *line = NULL;
    size_t capacity = 0;
    FILE *from = fopen(log, "r");
    *reason = 0;
    while (from && getline(&line, &capacity, from) > 0) {
        line[strcspn(line, "\n")] = 0;
        const bool warns = strncmp(line, "warning", 7) == 0 || strstr(line, ": warning: ");
        if (warns || !*line)
            continue;
        snprintf(reason, size, "%s", line);
        break;
    }
    if (from)
        fclose(from);
    free(line);
}

// what a run warned of while it went, a line each
static void log_warnings(const char *out, char *text, size_t size) {
    char *path = silt_text("%s/run.log", out), *line = NULL;
    size_t capacity = 0, used = 0;
    FILE *from = fopen(path, "r");
    *text = 0;
    while (from && getline(&line, &capacity, from) > 0 && used < size - 1)
        if (strncmp(line, "warning", 7) == 0) {
            snprintf(text + used, size - used, "%s", line);
            used = strlen(text);
        }
    if (from)
        fclose(from);
    free(line);
    free(path);
}

static double result_number(struct fy_document *summary, const char *key) {
    return strcmp(silt_summary_text(summary, key), "null") == 0 ? NAN : silt_summary_number(summary, key);
}

// @return true: the run is wrong, and text says in what; whole: it went to its end
static bool judge(const study *s, const silt_scene *scene, const char *out, struct fy_document *summary, bool whole,
                  const char *warned, study_row *row, char *text, size_t size) {
    static const char *const column[] = {"volume_error", "mass_error", "energy_excess"};
    const double allowed[] = {s->bounds.volume, s->bounds.mass, s->bounds.energy};
    silt_bounds b;
    char where[64] = "";
    const bool rows = silt_bounds_measure(scene, out, &b);
    const double sediment = result_number(summary, "/worst_sediment_error");
    for (silt_bound_kind k = 0; k < BOUND_COUNT; k++)
        study_row_add(row, column[k], isnan(b.of[k].worst) ? "" : "%.3g", b.of[k].worst);
    study_row_add(row, "sediment_error", "%.3g", sediment);
    if (!rows && whole)
        snprintf(text, size, "history.csv has no rows");
    else if (*b.bad)
        snprintf(text, size, "no number in column %s at t = %g s", b.bad, b.bad_time);
    else if (frame_bad(out, where))
        snprintf(text, size, "no number in %s", where);
    else if (whole && !(fabs(sediment) <= s->bounds.sediment))
        snprintf(text, size, "sediment error %.3g, allowed %g", sediment, s->bounds.sediment);
    else {
        // of what the run itself says that it is beyond its bounds there is no more to say
        for (silt_bound_kind k = 0; k < BOUND_COUNT && whole; k++) {
            char told[32];
            snprintf(told, sizeof told, "bounds.%s allows", silt_bound_word[k]);
            if (b.of[k].worst > allowed[k] && !strstr(warned, told)) {
                snprintf(text, size, "%s %.3g, allowed %g", column[k], b.of[k].worst, allowed[k]);
                return true;
            }
        }
        return false;
    }
    return true;
}

static void result_numbers(struct fy_document *summary, study_row *row) {
    const double steps = silt_summary_number(summary, "/steps_here"), time = silt_summary_number(summary, "/time");
    const double nodes =
        steps > 0 ? silt_summary_number(summary, "/node_steps") / steps : silt_summary_number(summary, "/nodes");
    const double retries = silt_summary_number(summary, "/retries");
    study_row_add(row, "nodes", "%.6g", nodes);
    study_row_add(row, "grains", "%s", silt_summary_text(summary, "/grains"));
    study_row_add(row, "steps", "%s", silt_summary_text(summary, "/steps"));
    study_row_add(row, "cut", "%.0f", retries);
    study_row_add(row, "time", "%.6g", time);
    study_row_add(row, "mean_dt", steps > 0 ? "%.6g" : "", time / silt_max(steps, 1));
}

static void result_checks(struct fy_document *summary, study_row *row) {
    struct fy_node *checks = fy_node_by_path(fy_document_root(summary), "/checks", FY_NT, FYNWF_DONT_FOLLOW);
    const int n = checks ? fy_node_sequence_item_count(checks) : 0;
    static const char *const cell[] = {"value", "error", "pass"};
    for (int i = 0; i < n; i++) {
        char key[64];
        snprintf(key, sizeof key, "/checks/%d/name", i);
        char *name = silt_text("%s", silt_summary_text(summary, key));
        for (int k = 0; k < 3; k++) {
            snprintf(key, sizeof key, "/checks/%d/%s", i, cell[k]);
            char *column = silt_text("%s_%s", name, cell[k]);
            const char *text = silt_summary_text(summary, key);
            study_row_add(row, column, "%s", strcmp(text, "null") == 0 ? "" : text);
            free(column);
        }
        free(name);
    }
}

void study_result(const study *s, const char *out, const char *log, const study_end *end, study_row *row) {
    struct fy_document *summary = end->code >= 0 ? silt_summary_open(out) : NULL;
    study_status status = RUN_OK;
    char reason[400] = "", why[200], warned[2000];
    study_row numbers = {0};
    log_reason(log, reason, sizeof reason);
    log_warnings(out, warned, sizeof warned);
    if (end->late) {
        status = end->stalled ? RUN_HUNG : RUN_UNFINISHED;
        snprintf(reason, sizeof reason, "stopped after %.3g s of the processor, %.3g s on the wall", end->cpu,
                 end->wall);
    } else if (end->signal) {
        status = RUN_CRASHED;
        snprintf(why, sizeof why, "%.150s", reason);
        snprintf(reason, sizeof reason, "ended by signal %d%s%s", end->signal, *why ? ": " : "", why);
    } else if (end->code == SILT_INPUT)
        status = RUN_REFUSED;
    else if (end->code == SILT_STOPPED)
        status = RUN_UNFINISHED; // by time.wall, or a signal
    else if ((end->code == SILT_FAILED && !*reason) || (end->code != SILT_OK && end->code != SILT_FAILED) || !summary) {
        status = RUN_CRASHED;
        snprintf(reason, sizeof reason, end->code ? "exit code %d without a word" : "no summary.json", end->code);
    } else {
        const double cut = silt_summary_number(summary, "/retries");
        const bool whole = end->code == SILT_OK;
        silt_scene *scene = NULL;
        silt_error err = {0};
        char *path = silt_text("%s/scene.yaml", out);
        const char *beyond = strstr(warned, RESULT_BEYOND);
        status = !whole ? RUN_FAILED : beyond ? RUN_BEYOND : *warned ? RUN_WARNED : cut > 0 ? RUN_CUT : RUN_OK;
        const char *tell = beyond ? beyond : warned;
        if (whole && *warned)
            snprintf(reason, sizeof reason, "%.*s", (int)strcspn(tell, "\n"), tell);
        else if (whole)
            snprintf(reason, sizeof reason, cut > 0 ? "%.0f steps cut" : "", cut);
        if (silt_scene_read(path, 0, NULL, &scene, &err) != SILT_OK ||
            judge(s, scene, out, summary, whole, warned, &numbers, why, sizeof why)) {
            status = RUN_WRONG;
            snprintf(reason, sizeof reason, "%s", scene ? why : "scene.yaml of the run cannot be read");
        }
        silt_scene_free(&scene);
        free(path);
    }
    study_row_add(row, "status", "%s", study_status_word[status]);
    study_row_add(row, "reason", "%s", reason);
    study_row_add(row, "cpu_seconds", "%.4g", end->cpu);
    study_row_add(row, "wall_seconds", "%.4g", end->wall);
    study_row_add(row, "memory_mb", "%.4g", 1e-6 * end->memory);
    if (summary) {
        result_numbers(summary, row);
        for (int i = 0; i < numbers.n; i++)
            study_row_add(row, numbers.cell[i].name, "%s", numbers.cell[i].value);
        result_checks(summary, row);
    }
    study_row_clear(&numbers);
    silt_summary_close(summary);
}

// what a run left, held against what a run must keep: numbers that are finite, volume, sediment, energy; then its
// status and reason
#include <libfyaml.h>
#include <sys/stat.h>

#include "study.h"

// ---------------------------------------------------------------- history.csv

/** what the history tells about */
typedef struct result_history {
    int64_t rows;
    char bad[64];    // first column with a number that is none
    double bad_time; // s
    double excess;   // of energy, J (2-D: J/m); NaN: not known for this scene
    double scale;    // J, what could move
    double mass;     // largest volume error less what is owed
} result_history;

// energies that the history can add up: of what moves, less what came from outside
typedef struct result_energy {
    bool water, grains; // counted
    bool worked;        // external_work is all that came from outside
    int column[6];      // kinetic, potential, owed, external_work, grain_kinetic, grain_potential
} result_energy;

// number of a row in a column, 0 where the scene has no such column
static double result_cell(const char *row, int column) {
    return column < 0 ? 0 : silt_history_number(row, column);
}

static bool walls_rest(const silt_scene *scene) {
    for (int i = 0; i < scene->n_wall; i++)
        if (scene->wall[i].motion.n_row > 0 || silt_length(3, scene->wall[i].velocity) > 0)
            return false;
    return true;
}

// Openings, a bed, bodies, forces, tension and closed air hold or bring energy that the history does not tell: no sum
// then. Of water and grains together the sum is known where nothing is driven from outside, of water beside walls that
// move through the work done on it.
static result_energy energy_known(const silt_scene *scene) {
    const silt_fluid_def *fluid = &scene->fluid;
    result_energy known = {0};
    const bool closed = fluid->n_inlet == 0 && fluid->n_outlet == 0 && !scene->bed.on && fluid->force.kind == 0 &&
                        fluid->surface_tension == 0 && fluid->air_pressure == 0 && scene->period[0] == scene->period[1];
    if (!closed)
        return known;
    const bool alone = walls_rest(scene) && scene->n_body == 0;
    // of bodies that hit water the history has no energy
    for (int i = 0; i < scene->n_body; i++)
        if (scene->body[i].motion == MOTION_FREE)
            return known;
    known.water = fluid->on;
    known.grains = scene->grains.on && alone;
    known.worked = fluid->on && !known.grains;
    return known;
}

static bool energy_counts(const result_energy *known, int i) {
    return i < 3 ? known->water : i == 3 ? known->worked : known->grains;
}

static double energy_sum(const result_energy *known, const char *row) {
    double sum = 0;
    for (int i = 0; i < 6; i++)
        if (energy_counts(known, i))
            sum += (i == 3 ? -1 : 1) * result_cell(row, known->column[i]);
    return sum;
}

// gauges have gaps, and wall units are known under water only
static bool *columns_finite(const silt_scene *scene, const char *header, int *n) {
    *n = 1;
    for (const char *c = header; *c; c++)
        *n += *c == ',';
    bool *finite = silt_alloc((size_t)*n, sizeof *finite);
    memset(finite, true, (size_t)*n * sizeof *finite);
    const int n_gauge = silt_gauges_count(scene);
    for (int i = 0; i < n_gauge + 2; i++) {
        char name[64];
        if (i < n_gauge)
            silt_gauges_name(scene, i, name);
        else
            snprintf(name, sizeof name, i == n_gauge ? "y_plus" : "bed_y_plus");
        const int column = silt_history_find(header, name);
        if (column >= 0)
            finite[column] = false;
    }
    return finite;
}

static void row_finite(const bool *finite, int n, const char *header, const char *row, result_history *h) {
    const char *name = header;
    for (int c = 0; c < n && row; c++) {
        char *end;
        const double x = strtod(row, &end);
        if (finite[c] && (end == row || !isfinite(x))) {
            snprintf(h->bad, sizeof h->bad, "%.*s", (int)strcspn(name, ",\n"), name);
            return;
        }
        row = (row = strchr(row, ',')) ? row + 1 : NULL;
        name = (name = strchr(name, ',')) ? name + 1 : "";
    }
}

static void history_read(const silt_scene *scene, const char *out, result_history *h) {
    static const char *const name[] = {"kinetic_energy", "potential_energy",     "owed_energy",
                                       "external_work",  "grain_kinetic_energy", "grain_potential_energy"};
    char *path = silt_text("%s/history.csv", out), *line = NULL, *header = NULL;
    size_t capacity = 0, room = 0;
    int n = 0;
    bool *finite = NULL;
    *h = (result_history){.excess = NAN, .scale = NAN};
    FILE *from = fopen(path, "r");
    if (!from || getline(&header, &room, from) <= 0)
        goto done;
    finite = columns_finite(scene, header, &n);
    result_energy known = energy_known(scene);
    for (int i = 0; i < 6; i++)
        known.column[i] = silt_history_find(header, name[i]);
    const int time = silt_history_find(header, "time");
    const int volume = silt_history_find(header, "volume_error"), owed = silt_history_find(header, "volume_owed");
    const int held = silt_history_find(header, "fluid_volume"), inflow = silt_history_find(header, "inflow_mass");
    double first = 0, moved[6] = {0}, start[6] = {0}, most = 0, base = 0;
    ssize_t length;
    while ((length = getline(&line, &capacity, from)) > 0 && line[length - 1] == '\n') {
        if (!*h->bad) {
            row_finite(finite, n, header, line, h);
            h->bad_time = result_cell(line, time);
        }
        const double sum = energy_sum(&known, line);
        for (int i = 0; i < 6; i++) {
            const double e = !energy_counts(&known, i) ? 0 : result_cell(line, known.column[i]);
            if (h->rows == 0)
                start[i] = e;
            moved[i] = silt_max(moved[i], fabs(e - (i == 1 || i == 5 ? start[i] : 0)));
        }
        if (h->rows++ == 0) {
            first = sum;
            base = result_cell(line, held);
        }
        const double in = result_cell(line, inflow) / scene->fluid.density;
        if (held >= 0 && base + in > 0)
            h->mass = silt_max(h->mass, fabs(result_cell(line, volume) + result_cell(line, owed) / (base + in)));
        most = silt_max(most, sum - first);
    }
    if (known.water || known.grains) {
        h->excess = most;
        for (int i = 0; i < 6; i++)
            h->scale = (i ? h->scale : 0) + moved[i];
    }
done:
    if (from)
        fclose(from);
    free(finite);
    free(header);
    free(line);
    free(path);
}

// J, what the water at the start would give up if all of it sank to the foot of where it stands
static double still_energy(const silt_scene *scene) {
    const double g = silt_length(3, scene->gravity);
    const int up = silt_scene_up(scene), n = scene->dimension == 3 ? 3 : 2;
    double energy = 0;
    for (int i = 0; i < scene->fluid.n_region; i++) {
        double lo[3] = {0}, hi[3] = {0};
        silt_region_bounds(&scene->fluid.region[i], lo, hi);
        energy += 0.5 * scene->fluid.density * g * silt_region_area(&scene->fluid.region[i]) *
                  (hi[up < n ? up : 1] - lo[up < n ? up : 1]);
    }
    return energy;
}

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
    ssize_t length;
    FILE *from = fopen(log, "r");
    *reason = 0;
    while (from && (length = getline(&line, &capacity, from)) > 0) {
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
    result_history h;
    char where[64] = "";
    history_read(scene, out, &h);
    const double volume = result_number(summary, "/worst_volume_error"),
                 sediment = result_number(summary, "/worst_sediment_error");
    const double scale = h.scale + (scene->fluid.on ? still_energy(scene) : 0), excess = scale > 0 ? h.excess / scale
                                                                                         : h.excess > 0 ? HUGE_VAL
                                                                                                        : h.excess;
    study_row_add(row, "volume_error", "%.3g", volume);
    study_row_add(row, "mass_error", "%.3g", h.mass);
    study_row_add(row, "sediment_error", "%.3g", sediment);
    study_row_add(row, "energy_excess", isnan(excess) ? "" : "%.3g", excess);
    if (*h.bad)
        snprintf(text, size, "no number in column %s at t = %g s", h.bad, h.bad_time);
    else if (frame_bad(out, where))
        snprintf(text, size, "no number in %s", where);
    else if (!whole)
        return false;
    else if (!(h.mass <= s->bounds.mass) && !strstr(warned, "water's volume is off"))
        snprintf(text, size, "mass error %.3g, allowed %g", h.mass, s->bounds.mass);
    else if (!(fabs(volume) <= s->bounds.volume) && !strstr(warned, "water's volume is off"))
        snprintf(text, size, "volume error %.3g, allowed %g", volume, s->bounds.volume);
    else if (!(fabs(sediment) <= s->bounds.sediment))
        snprintf(text, size, "sediment error %.3g, allowed %g", sediment, s->bounds.sediment);
    else if (excess > s->bounds.energy && !*warned)
        snprintf(text, size, "energy %.3g above the start and the work from outside, allowed %g", excess,
                 s->bounds.energy);
    else
        return false;
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
        status = !whole ? RUN_FAILED : *warned ? RUN_WARNED : cut > 0 ? RUN_CUT : RUN_OK;
        if (whole && *warned)
            snprintf(reason, sizeof reason, "%.*s", (int)strcspn(warned, "\n"), warned);
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

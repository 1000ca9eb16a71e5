// the ledgers of a run held against what they may be off by: volume, mass, energy, and numbers that are none
#include "output.h"

// energies that the history can add up: of what moves, less what came from outside
typedef enum { OF_KINETIC, OF_POTENTIAL, OF_OWED, OF_WORK, OF_GRAIN_KINETIC, OF_GRAIN_POTENTIAL, OF_BODY_KINETIC, OF_BODY_POTENTIAL, OF_COUNT } bounds_part;
static const char *const bounds_column[OF_COUNT] = {"kinetic_energy", "potential_energy", "owed_energy", "external_work",
    "grain_kinetic_energy", "grain_potential_energy", "body_kinetic_energy", "body_potential_energy"};

const char *const silt_bound_word[BOUND_COUNT] = {"volume", "mass", "energy"};

typedef struct bounds_energy {
    bool water, grains, bodies; // counted
    bool worked;                // external_work is all that came from outside
    int column[OF_COUNT];
} bounds_energy;

// number of a row in a column, 0 where the scene has no such column
static double bounds_cell(const char *row, int column) { return column < 0 ? 0 : silt_history_number(row, column); }

// nothing moves by itself, nothing is sprung
static bool nothing_drives(const silt_scene *scene) {
    for (int i = 0; i < scene->n_wall; i++)
        if (scene->wall[i].motion.n_row > 0 || silt_length(3, scene->wall[i].velocity) > 0)
            return false;
    for (int i = 0; i < scene->n_body; i++)
        if (scene->body[i].motion == MOTION_PRESCRIBED || scene->body[i].n_spring > 0)
            return false;
    return true;
}

// Openings, a bed, forces, tension and closed air hold or bring energy that the history does not tell: no sum then, nor
// of bodies without water (contacts hold some). Of water, grains and bodies together the sum is known where nothing is
// driven from outside, of water beside what is driven through the work done on it.
static bounds_energy energy_known(const silt_scene *scene) {
    const silt_fluid_def *fluid = &scene->fluid;
    const bool closed = fluid->n_inlet == 0 && fluid->n_outlet == 0 && !scene->bed.on && fluid->force.kind == 0 &&
                        fluid->surface_tension == 0 && fluid->air_pressure == 0 && scene->period[0] == scene->period[1];
    bool moves = false;
    for (int i = 0; i < scene->n_body; i++)
        moves |= scene->body[i].motion == MOTION_FREE;
    const bool alone = nothing_drives(scene);
    bounds_energy known = {0};
    if (!closed || (moves && !(alone && fluid->on)))
        return known;
    known.water = fluid->on;
    known.bodies = moves;
    known.grains = scene->grains.on && alone;
    known.worked = fluid->on && !known.grains && !known.bodies;
    return known;
}

static bool energy_counts(const bounds_energy *known, bounds_part i) {
    return i <= OF_OWED ? known->water : i == OF_WORK ? known->worked : i <= OF_GRAIN_POTENTIAL ? known->grains : known->bodies;
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

// columns that must hold numbers: gauges have gaps, and wall units are known under water only
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

static void row_finite(const bool *finite, int n, const char *header, const char *row, silt_bounds *b) {
    const char *name = header;
    for (int c = 0; c < n && row; c++) {
        char *end;
        const double x = strtod(row, &end);
        if (finite[c] && (end == row || !isfinite(x))) {
            snprintf(b->bad, sizeof b->bad, "%.*s", (int)strcspn(name, ",\n"), name);
            return;
        }
        row = (row = strchr(row, ',')) ? row + 1 : NULL;
        name = (name = strchr(name, ',')) ? name + 1 : "";
    }
}

static void bounds_most(silt_bound *bound, double value, double time) {
    if (value > bound->worst) {
        bound->worst = value;
        bound->time = time;
    }
}

bool silt_bounds_measure(const silt_scene *scene, const char *out, silt_bounds *b) {
    char *path = silt_text("%s/history.csv", out), *line = NULL, *header = NULL;
    size_t capacity = 0, room = 0;
    ssize_t length;
    int n = 0;
    bool *finite = NULL;
    *b = (silt_bounds){.of[BOUND_ENERGY].worst = NAN};
    FILE *from = fopen(path, "r");
    if (!from || getline(&header, &room, from) <= 0)
        goto done;
    finite = columns_finite(scene, header, &n);
    bounds_energy known = energy_known(scene);
    for (int i = 0; i < OF_COUNT; i++)
        known.column[i] = silt_history_find(header, bounds_column[i]);
    const int volume = silt_history_find(header, "volume_error"), owed = silt_history_find(header, "volume_owed");
    const int held = silt_history_find(header, "fluid_volume"), inflow = silt_history_find(header, "inflow_mass");
    const int clock = silt_history_find(header, "time");
    double first = 0, moved[OF_COUNT] = {0}, start[OF_COUNT] = {0}, base = 0;
    silt_bound excess = {0};
    while ((length = getline(&line, &capacity, from)) > 0 && line[length - 1] == '\n') {
        const double time = bounds_cell(line, clock);
        if (!*b->bad) {
            row_finite(finite, n, header, line, b);
            b->bad_time = time;
        }
        double sum = 0;
        for (bounds_part i = 0; i < OF_COUNT; i++) {
            const double e = !energy_counts(&known, i) ? 0 : bounds_cell(line, known.column[i]);
            const bool level = i == OF_POTENTIAL || i == OF_GRAIN_POTENTIAL || i == OF_BODY_POTENTIAL;
            if (b->rows == 0)
                start[i] = e;
            moved[i] = silt_max(moved[i], fabs(e - (level ? start[i] : 0)));
            sum += i == OF_WORK ? -e : e;
        }
        if (b->rows++ == 0) {
            first = sum;
            base = bounds_cell(line, held);
        }
        const double in = base + bounds_cell(line, inflow) / scene->fluid.density, off = bounds_cell(line, volume);
        bounds_most(&b->of[BOUND_VOLUME], fabs(off), time);
        if (held >= 0 && in > 0)
            bounds_most(&b->of[BOUND_MASS], fabs(off + bounds_cell(line, owed) / in), time);
        bounds_most(&excess, sum - first, time);
    }
    if (known.water || known.grains) {
        double scale = scene->fluid.on ? still_energy(scene) : 0;
        for (int i = 0; i < OF_COUNT; i++)
            scale += moved[i];
        b->of[BOUND_ENERGY] = (silt_bound){scale > 0 ? excess.worst / scale : excess.worst > 0 ? HUGE_VAL : 0, excess.time};
    }
done:
    if (from)
        fclose(from);
    free(finite);
    free(header);
    free(line);
    free(path);
    return b->rows > 0;
}

bool silt_bounds_broken(const silt_bounds *b, const silt_scene *scene, silt_bound_kind kind, double *allowed, char text[256]) {
    const silt_bound *of = &b->of[kind];
    *allowed = kind == BOUND_VOLUME ? scene->bounds.volume : kind == BOUND_MASS ? scene->bounds.mass : scene->bounds.energy;
    if (!(of->worst > *allowed)) // energy that is not known is no breach
        return false;
    static const char *const what[BOUND_COUNT] = {
        "the water's volume was off by up to %.3g %% (t = %.4g s), bounds.volume allows %.3g %%: what is owed comes back, until then depths and "
        "pressures are off as much; smaller fluid.size or time.cfl",
        "%.3g %% of the water were lost or gained (t = %.4g s), bounds.mass allows %.3g %%: results are off as much; smaller fluid.size or time.cfl",
        "energy rose by %.3g %% of what can move above the start and the work from outside (t = %.4g s), bounds.energy allows %.3g %%: speeds are "
        "too large; smaller fluid.size or time.cfl"};
    snprintf(text, 256, what[kind], 100 * of->worst, of->time, 100 * *allowed);
    return true;
}

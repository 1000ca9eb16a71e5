// the scenes of silt bench, made to the number of nodes that is asked for
#include <errno.h>

#include "bench.h"

#define WATER_SIZES "10k,40k,160k"
static const bench_scene bench_scenes[] = {
    {"dam-2d", "a column of water that collapses, laminar between walls that slip", 2, false, 0, WATER_SIZES},
    {"still-2d", "water at rest", 2, false, 0, WATER_SIZES},
    {"turbulent-2d", "the column with the default turbulence and law of the wall", 2, false, 0, WATER_SIZES},
    {"stiff-2d", "the column with dt nu/h^2 = 1e3", 2, false, 0, WATER_SIZES},
    {"dam-3d", "a column of water that collapses, laminar between walls that slip", 3, false, 0, WATER_SIZES},
    {"turbulent-3d", "the column with the default turbulence and law of the wall", 3, false, 0, WATER_SIZES},
    {"still-3d", "water at rest", 3, false, 0, WATER_SIZES},
    {"bed-2d", "the column on a bed that it wears", 2, false, 0, WATER_SIZES},
    {"grains-1k", "still water with a thousand grains that fall in it", 2, false, 1000, "10k,40k"},
    {"grains-10k", "ten thousand grains", 2, false, 10000, "10k,40k"},
    {"grains-100k", "a hundred thousand grains", 2, false, 100000, "40k"},
    {"grains-1k-3d", "a thousand grains in space", 3, false, 1000, "10k"},
    {"grains-10k-3d", "ten thousand grains in space", 3, false, 10000, "10k,40k"},
    {"grains-100k-3d", "a hundred thousand grains in space", 3, false, 100000, "40k"},
    {"collapse-2d", "a column N nodes wide to 0.5 s, as other codes ran it; sizes are N", 2, true, 0, "20,40,80"},
    {"collapse-3d", "the same in space", 3, true, 0, "10,20"},
};
enum { N_SCENE = sizeof bench_scenes / sizeof *bench_scenes };

const bench_scene *bench_scene_list(int *n) {
    *n = N_SCENE;
    return bench_scenes;
}

const bench_scene *bench_scene_find(const char *name) {
    for (int k = 0; k < N_SCENE; k++)
        if (strcmp(bench_scenes[k].name, name) == 0)
            return &bench_scenes[k];
    return NULL;
}

// ---------------------------------------------------------------- texts

#define GRAIN_DENSITY 2650.0

static bool starts(const bench_scene *kind, const char *word) { return strncmp(kind->name, word, strlen(word)) == 0; }

// distance between nodes that gives about n of them in a square or cube of 1 m: they stand in triangles, and on its sides too
static double spacing(int dimension, double n) {
    double h = dimension == 3 ? cbrt(1 / n) : sqrt(1 / n);
    for (int k = 0; k < 30; k++)
        h = dimension == 3 ? cbrt((1.3 + 3 * h) / n) : sqrt((1.155 + 2 * h) / n);
    return h;
}

// grains that take a third of the square (a tenth of the cube) when they begin to fall
static double grain_diameter(int dimension, int n) { return dimension == 3 ? 0.9 * cbrt(0.1 / n) : 0.9 * sqrt(0.33 / n); }

static void text_contact(FILE *to, double parcel) {
    fprintf(to, "grains: {parcel: %.9g}\ncontact: {youngs_modulus: 5.0e+6, poissons_ratio: 0.3, restitution: 0.3, friction: 0.5, rolling_friction: 0.1}\n",
            parcel);
}

// L = 0.146 m wide, 2 L high, in a tank of 4 L
static void text_collapse(FILE *to, int dimension, double n) {
    const double L = 0.146;
    fprintf(to, "silt: 1\ndimension: %d\ntime: {end: 0.5, output: 0.05}\ngravity: [0, %s-9.81]\nfluid:\n", dimension,
            dimension == 3 ? "0, " : "");
    fprintf(to, "  density: 1000\n  viscosity: 1.0e-3\n  size: %.9g\n  flow: laminar\n", L / n);
    if (dimension == 3)
        fprintf(to, "  regions: [{box: [[0, 0, 0], [%.9g, %.9g, %.9g]]}]\nwalls:\n  - {box: [[0, 0, 0], [%.9g, %.9g, %.9g]], condition: slip}\n",
                L, 1.2 * L, 2 * L, 4 * L, 1.2 * L, 6 * L);
    else
        fprintf(to, "  regions: [{box: [[0, 0], [%.9g, %.9g]]}]\nwalls:\n  - {polyline: [[0, %.9g], [0, 0], [%.9g, 0], [%.9g, %.9g]], condition: slip}\n",
                L, 2 * L, 6 * L, 4 * L, 4 * L, 6 * L);
}

// Columns 1 m wide and high. Those that collapse are in motion from the start: u = k x, v = -k y is what a broken dam looks like
// after a while, and takes no warm-up to get there.
static void text_column(FILE *to, const bench_scene *kind, double h) {
    const bool space = kind->dimension == 3, still = starts(kind, "still") || kind->n_grain, stiff = starts(kind, "stiff");
    const bool turbulent = starts(kind, "turbulent");
    const double floor = starts(kind, "bed") ? 0.1 : 0, wide = still ? 1 : 4;
    // stiff: steps of 0.25 s/m h
    double step = stiff ? 0.25 * h : 0;
    if (kind->n_grain)
        step = 0.19 * grain_diameter(kind->dimension, kind->n_grain); // s/m: about 20 steps of the grains
    fprintf(to, "silt: 1\ndimension: %d\ntime: {end: 1000, output: 1000, step: %.9g}\ngravity: [0, %s-9.81]\nfluid:\n", kind->dimension,
            step, space ? "0, " : "");
    fprintf(to, "  density: 1000\n  viscosity: %.9g\n  size: %.9g\n  flow: %s\n", stiff ? 1000 * 1000 * h * h / step : 1e-3, h,
            turbulent ? "turbulent" : "laminar");
    if (!still)
        fprintf(to, "  velocity: {formula: strain, rate: -1.5, centre: [0, %s%g]}\n", space ? "0, " : "", floor);
    const char *slip = turbulent ? "" : ", condition: slip";
    if (space)
        fprintf(to, "  regions: [{box: [[0, 0, 0], [1, 1, 1]]}]\nwalls:\n  - {box: [[0, 0, 0], [%g, 1, 3]]%s}\n", wide, slip);
    else
        fprintf(to, "  regions: [{box: [[0, %g], [1, %g]]}]\nwalls:\n  - {polyline: [[0, 3], [0, 0], [%g, 0], [%g, 3]]%s}\n", floor,
                floor + 1, wide, wide, slip);
    if (floor > 0)
        fprintf(to, "bed: {density: %g, porosity: 0.4, work: 1.0e+9, regions: [{box: [[0, 0], [4, %g]]}]}\n", GRAIN_DENSITY, floor);
    if (floor > 0 || kind->n_grain)
        text_contact(to, 0.6 * h);
}

// ---------------------------------------------------------------- scenes

// a lattice of grains with gaps, from the floor up
static void grains_place(silt_scene *scene, int n) {
    const bool space = scene->dimension == 3;
    const double d = grain_diameter(scene->dimension, n), gap = 1.1 * d;
    const int row = (int)floor((1 - 0.2 * d) / gap), layer = space ? row * row : row;
    free(scene->grains.grain);
    scene->grains.grain = silt_alloc((size_t)n, sizeof *scene->grains.grain);
    scene->grains.n_grain = n;
    for (int k = 0; k < n; k++) {
        const double along = gap * (k % row + 0.55), across = gap * (k % layer / row + 0.55), up = gap * (k / layer + 0.55);
        scene->grains.grain[k] = (silt_grain_def){.at = {along, space ? across : up, space ? up : 0}, .diameter = d, .density = GRAIN_DENSITY};
    }
}

silt_status bench_scene_make(silt_scene **scene, const bench_scene *kind, double size, const char *folder, int n_set,
                             const char *const *set, silt_error *err) {
    char *path = silt_text("%s/bench.yaml", folder);
    FILE *to = fopen(path, "w");
    if (to && kind->whole)
        text_collapse(to, kind->dimension, size);
    else if (to)
        text_column(to, kind, spacing(kind->dimension, size));
    silt_status status = SILT_OK;
    if (!to || fclose(to) != 0)
        status = silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", path, strerror(errno));
    if (status == SILT_OK)
        status = silt_scene_read(path, n_set, set, scene, err);
    if (status == SILT_OK && kind->n_grain)
        grains_place(*scene, kind->n_grain);
    free(path);
    return status;
}

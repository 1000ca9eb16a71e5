/** @file scene_settle.c
 * What reading leaves open: the tables that the scene names, with the columns they must hold, and the defaults that
 * hang on other keys.
 */
#include "scene_keys.h"

#include <limits.h>

// tables -----------------------------------------------------------------------------------------------
// "x, y" or "x, y, z": names of columns, in one text
static void settle_names(FILE *to, const char *const *name, int n) {
    for (int i = 0; i < n; i++)
        fprintf(to, "%s%s", i ? ", " : "", name[i]);
}

// A complaint when the table has a column of another name, lacks one of the first n_need, or has none of all; the first
// column of a table over time may have any name.
static bool settle_columns(silt_reader *reader, const silt_tree *node, const char *path, const silt_series *table,
                           const char *const *name, int n_name, int n_need, bool over_time) {
    const char *missing = NULL, *strange = NULL;
    int n_found = 0;
    for (int c = over_time ? 1 : 0; c < table->n_column; c++) {
        bool known = false;
        for (int i = 0; i < n_name; i++)
            known |= strcmp(name[i], table->name[c]) == 0;
        n_found += known;
        strange = known || strange ? strange : table->name[c];
    }
    for (int i = n_need - 1; i >= 0; i--)
        missing = silt_series_column(table, name[i]) < 0 ? name[i] : missing;
    if (!missing && !strange && n_found > 0)
        return true;
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (!to)
        return false;
    if (missing)
        fprintf(to, "no column '%s'", missing);
    else if (strange)
        fprintf(to, "the column '%.60s'", strange);
    else
        fprintf(to, "no column that counts");
    fprintf(to, " in %s, allowed the columns %s", table->path, over_time ? "time and any of " : "");
    settle_names(to, name, n_need ? n_need : n_name);
    if (n_need && n_name > n_need) {
        fprintf(to, ", with ");
        settle_names(to, name + n_need, n_name - n_need);
        fprintf(to, " if wanted");
    }
    fclose(to);
    silt_complain(reader, node, "key '%s': found %s", path, text);
    free(text);
    return false;
}

// every cell of the columns that count must hold a number
static bool settle_finite(silt_reader *reader, const silt_tree *node, const char *path, const silt_series *table) {
    for (int i = 0; i < table->n_row; i++)
        for (int c = 0; c < table->n_column; c++)
            if (!isfinite(table->value[(size_t)i * (size_t)table->n_column + (size_t)c])) {
                silt_complain(reader, node,
                              "key '%s': found no finite number in column '%s' at %s:%d, allowed one in each cell",
                              path, table->name[c], table->path, table->line[i]);
                return false;
            }
    return true;
}

// puts the columns in the order of the names, zeros for those that are not there; column 0 stays when it is time
static void settle_order(silt_series *table, const char *const *name, int n_name, bool over_time) {
    const int first = over_time ? 1 : 0, n = first + n_name;
    double *value = silt_alloc((size_t)table->n_row, (size_t)n * sizeof *value);
    char **names = silt_alloc((size_t)n, sizeof *names);
    for (int k = 0; k < n; k++) {
        const int c = k < first ? 0 : silt_series_column(table, name[k - first]);
        names[k] = silt_text("%s", k < first ? table->name[0] : name[k - first]);
        for (int i = 0; i < table->n_row && c >= 0; i++)
            value[(size_t)i * (size_t)n + (size_t)k] = table->value[(size_t)i * (size_t)table->n_column + (size_t)c];
    }
    for (int c = 0; c < table->n_column; c++)
        free(table->name[c]);
    free(table->name);
    free(table->value);
    table->name = names;
    table->value = value;
    table->n_column = n;
}

// a file of points, read; false after a complaint
static bool settle_read(silt_reader *reader, const silt_tree *node, const char *path, const char *file,
                        silt_series *table) {
    silt_error err = {0};
    if (silt_series_read(NULL, file, table, &err) == SILT_OK)
        return true;
    silt_complain(reader, node, "key '%s': found a file that cannot serve, allowed a CSV table: %s", path, err.text);
    return false;
}

// regions ----------------------------------------------------------------------------------------------
// the corners of an outline's file
static void settle_outline(silt_reader *reader, const silt_scene *scene, silt_region *region, const char *path) {
    static const char *const column[2][2] = {{"x", "y"}, {"x", "z"}};
    const silt_tree *item = silt_tree_find(reader->root, "%s.outline", path);
    if (!region->outline || region->n_point || !item)
        return;
    char *key = silt_text("%s.outline", path);
    const char *const *name = column[scene->dimension == 3];
    silt_series table = {0};
    if (settle_read(reader, item, key, region->outline, &table) &&
        settle_columns(reader, item, key, &table, name, 2, 2, false) && settle_finite(reader, item, key, &table)) {
        if (table.n_row < 3 || table.n_row > SCENE_CORNERS) {
            silt_complain(reader, item, "key '%s': found %d corners in %s, allowed 3 to %d", key, table.n_row,
                          table.path, SCENE_CORNERS);
        } else {
            double *point = silt_alloc((size_t)table.n_row, 3 * sizeof *point);
            for (int k = 0; k < 2; k++) {
                const int c = silt_series_column(&table, name[k]);
                for (int i = 0; i < table.n_row; i++)
                    point[3 * i + k] = table.value[(size_t)i * 2 + (size_t)c];
            }
            if (silt_polygon_sound(reader, item, NULL, key, table.n_row, point)) {
                region->point = point;
                region->n_point = table.n_row;
            } else {
                free(point);
            }
        }
    }
    silt_series_clear(&table);
    free(key);
}

static void settle_regions(silt_reader *reader, silt_scene *scene) {
    const int count[4] = {scene->fluid.n_region, scene->bed.n_region, scene->fluid.n_size, scene->grains.n_fill};
    static const char *const name[4] = {"fluid.regions", "bed.regions", "fluid.sizes", "grains.regions"};
    for (int l = 0; l < 4; l++)
        for (int i = 0; i < count[l]; i++) {
            char *path = silt_text("%s.%d", name[l], i);
            settle_outline(reader, scene,
                           l == 0   ? &scene->fluid.region[i]
                           : l == 1 ? &scene->bed.region[i]
                           : l == 2 ? &scene->fluid.size_at[i].region
                                    : &scene->grains.fill[i].region,
                           path);
            free(path);
        }
}

// surfaces ---------------------------------------------------------------------------------------------
bool silt_surface_is_shape(const char *path) {
    static const char *const ending[] = {".geo", ".step", ".stp", ".brep", ".iges", ".igs"};
    const char *dot = strrchr(path, '.');
    for (size_t k = 0; dot && k < sizeof ending / sizeof *ending; k++)
        if (strcasecmp(dot, ending[k]) == 0)
            return true;
    return false;
}

// walls ------------------------------------------------------------------------------------------------
// a path: columns that count, places or accelerations, which are integrated; item: the block, key: of the file in it
static void settle_path(silt_reader *reader, const silt_tree *item, const char *where, const char *key, silt_series *path, int dimension,
                        double scale, silt_baseline baseline) {
    const silt_tree *node = silt_tree_item(item, key);
    const char *const *name;
    const int n = silt_path_columns(dimension, &name);
    char *text = silt_text("%s.%s", where, key);
    if (path->n_row && settle_columns(reader, node, text, path, name, n, 0, true)) {
        const int doubled = silt_path_doubled(path);
        if (doubled >= 0)
            silt_complain(reader, node, "key '%s': found the columns '%s' and '%s' in %s, allowed the place or its acceleration", text,
                          path->name[doubled] + 1, path->name[doubled], path->path);
        else if (baseline != BASELINE_NONE && !silt_path_accelerates(path))
            silt_complain(reader, silt_tree_item(item, "baseline"),
                          "key '%s.baseline': found a file without accelerations, %s, allowed none, or one of the columns ax, ay%s, aangle", where,
                          path->path, dimension == 3 ? ", az" : "");
        else
            silt_path_settle(path, scale, baseline);
    }
    free(text);
}

static void settle_wall(silt_reader *reader, const silt_scene *scene, silt_wall *wall, int i) {
    const silt_tree *node = silt_tree_find(reader->root, "walls.%d", i);
    char *path = silt_text("walls.%d", i);
    if (wall->form == WALL_BOX && scene->dimension != 3 && wall->lo[0] < wall->hi[0]) {
        // its four corners, counter-clockwise
        const double *lo = wall->lo, *hi = wall->hi;
        const double corner[12] = {lo[0], lo[1], 0, hi[0], lo[1], 0, hi[0], hi[1], 0, lo[0], hi[1], 0};
        free(wall->point);
        wall->point = silt_alloc(12, sizeof(double));
        memcpy(wall->point, corner, sizeof corner);
        wall->n_point = 4;
        wall->closed = true;
        wall->form = WALL_POLYLINE;
    }
    for (int k = 0; k < 3 && wall->form != WALL_BOX; k++) {
        wall->lo[k] = 0;
        wall->hi[k] = -1;
    }
    if (wall->surface) {
        const silt_tree *item = silt_tree_item(node, "surface");
        const char *end = strrchr(wall->surface, '.');
        FILE *file = fopen(wall->surface, "rb");
        if (!end || (strcasecmp(end, ".stl") != 0 && strcasecmp(end, ".msh") != 0 && !silt_surface_is_shape(wall->surface)))
            silt_complain(reader, item,
                          "key 'walls.%d.surface': found the file '%s', allowed one whose name ends in .stl or .msh, or in "
                          ".geo, .step, .brep or .iges, for which gmsh is needed",
                          i, wall->surface);
        else if (!file)
            silt_complain(reader, item,
                          "key 'walls.%d.surface': found no file %s that can be opened, allowed an STL or .msh file", i,
                          wall->surface);
        if (file)
            fclose(file);
    }
    settle_path(reader, node, path, "motion", &wall->motion, scene->dimension, wall->motion_scale, wall->baseline);
    if (wall->condition == WALL_DEFAULT)
        wall->condition = scene->fluid.on && scene->fluid.flow == FLOW_TURBULENT ? WALL_LAW : WALL_NO_SLIP;
    free(path);
}

bool silt_scene_law(const silt_scene *scene) {
    bool law = scene->bed.on && scene->bed.condition == WALL_LAW;
    for (int i = 0; i < scene->n_wall; i++)
        law |= scene->wall[i].condition == WALL_LAW;
    for (int i = 0; i < scene->n_body; i++)
        law |= scene->body[i].condition == WALL_LAW;
    return law;
}

// bodies -----------------------------------------------------------------------------------------------
// Water that sticks takes half a cell along, which is right where that lies within the layer that viscosity makes. Of a disc that falls from rest
// the first velocity is too small by 3, 10, 25 % where h^3 g/nu^2 is 1.5, 12, 98 (cases/falling-cylinder); where water slips too large by 25 %.
static silt_condition body_default(const silt_scene *scene) {
    const silt_fluid_def *fluid = &scene->fluid;
    double h = fluid->size;
    for (int i = 0; i < fluid->n_size; i++)
        h = fluid->size_at[i].near == NEAR_BODIES ? silt_min(h, fluid->size_at[i].size) : h;
    if (!fluid->on || fluid->flow == FLOW_TURBULENT)
        return fluid->on ? WALL_LAW : WALL_NO_SLIP;
    const double g = silt_length(3, scene->gravity), nu = fluid->viscosity / fluid->density;
    return h * h * h * g < 100 * silt_square(nu) ? WALL_NO_SLIP : WALL_SLIP;
}

static void settle_body(silt_reader *reader, const silt_scene *scene, silt_body_def *body, int i) {
    char *path = silt_text("bodies.%d", i);
    settle_path(reader, silt_tree_find(reader->root, "%s", path), path, "path", &body->path, scene->dimension, body->path_scale,
                body->baseline);
    if (body->condition == WALL_DEFAULT)
        body->condition = body_default(scene);
    for (int k = 0; k < body->n_spring; k++) {
        silt_spring_def *s = &body->spring[k];
        const double way[3] = {s->to[0] - s->at[0], s->to[1] - s->at[1], s->to[2] - s->at[2]};
        s->length = isnan(s->length) ? silt_length(3, way) : s->length;
    }
    free(path);
}

// formulas ---------------------------------------------------------------------------------------------
static void settle_formula(silt_reader *reader, const silt_scene *scene, silt_formula *formula, const char *path) {
    static const char *const point[2][6] = {{"x", "y", "vx", "vy"}, {"x", "y", "z", "vx", "vy", "vz"}};
    static const char *const vector[3] = {"x", "y", "z"};
    const silt_tree *node = silt_tree_find(reader->root, "%s", path), *file = silt_tree_item(node, "file");
    const int dim = scene->dimension == 3 ? 3 : 2;
    char *key = silt_text("%s.file", path);
    silt_series *table = &formula->series;
    silt_error err = {0};
    formula->dimension = dim;
    if (formula->kind == FORMULA_UNIFORM && !silt_tree_item(node, "vector"))
        silt_complain_key(reader, node, "key '%s.vector': found nothing in this block, allowed %s", path,
                          dim == 3 ? "[x, y, z]" : "[x, y]");
    if (formula->kind == FORMULA_SOLITARY_WAVE && formula->depth > 0 && silt_tree_item(node, "amplitude")) {
        if (formula->amplitude > 0 && formula->amplitude <= 0.4 * formula->depth)
            silt_formula_prepare(formula);
        else
            silt_complain(reader, silt_tree_item(node, "amplitude"),
                          "key '%s.amplitude': found %.10g, allowed > 0 and <= 0.4 of the depth", path,
                          formula->amplitude);
    }
    if (formula->kind == FORMULA_FIELD && table->n_row) {
        const char *const *name = point[dim == 3];
        if (settle_columns(reader, file, key, table, name, 2 * dim, 2 * dim, false) &&
            settle_finite(reader, file, key, table)) {
            settle_order(table, name, 2 * dim, false);
            const int twice = silt_formula_prepare(formula);
            if (twice >= 0)
                silt_complain(reader, file, "key '%s': found a point again at %s:%d, allowed each point once", key,
                              table->path, table->line[twice]);
        }
    } else if (formula->kind == FORMULA_SERIES && table->n_row) {
        if (silt_series_rising(table, &err) != SILT_OK)
            silt_complain(reader, file,
                          "key '%s': found a file that cannot serve, allowed a CSV table over rising time: %s", key,
                          err.text);
        else if (settle_columns(reader, file, key, table, vector, dim, 0, true))
            settle_order(table, vector, dim, true);
    }
    free(key);
}

// water ------------------------------------------------------------------------------------------------
// the node cloud: coordinates, and all of the velocity or nothing of it
static void settle_cloud(silt_reader *reader, const silt_scene *scene) {
    static const char *const name[2][6] = {{"x", "y", "vx", "vy"}, {"x", "y", "z", "vx", "vy", "vz"}};
    const silt_fluid_def *fluid = &scene->fluid;
    const silt_tree *node = silt_tree_find(reader->root, "fluid.cloud");
    const int dim = scene->dimension == 3 ? 3 : 2;
    silt_series table = {0};
    if (!fluid->cloud || !node)
        return;
    if (settle_read(reader, node, "fluid.cloud", fluid->cloud, &table)) {
        const bool moves = silt_series_column(&table, "vx") >= 0;
        if (settle_columns(reader, node, "fluid.cloud", &table, name[dim == 3], 2 * dim, moves ? 2 * dim : dim,
                           false) &&
            settle_finite(reader, node, "fluid.cloud", &table) && table.n_row <= dim)
            silt_complain(reader, node, "key 'fluid.cloud': found %d nodes in %s, allowed %d or more", table.n_row,
                          table.path, dim + 1);
    }
    silt_series_clear(&table);
    if (!silt_tree_find(reader->root, "fluid.regions"))
        silt_complain(
            reader, node,
            "key 'fluid.cloud': found it without regions, allowed with fluid.regions, which say where between "
            "the nodes water is");
    if (fluid->jitter > 0)
        silt_complain(
            reader, silt_tree_find(reader->root, "fluid.jitter"),
            "key 'fluid.jitter': found it beside a cloud, allowed without: the cloud's nodes stand where they "
            "are");
}

static void settle_sizes(silt_reader *reader, const silt_scene *scene) {
    static const char *const form[] = {"box", "polygon", "outline", "circle", "sphere"};
    for (int i = 0; i < scene->fluid.n_size; i++) {
        const silt_size_def *size = &scene->fluid.size_at[i];
        const silt_tree *node = silt_tree_find(reader->root, "fluid.sizes.%d", i), *near = silt_tree_item(node, "near");
        const silt_tree *given = NULL;
        for (int k = 0; k < 5 && !given; k++)
            given = silt_tree_item(node, form[k]);
        const char *lacks = size->near == NEAR_WALLS && scene->n_wall == 0    ? "walls"
                            : size->near == NEAR_BED && !scene->bed.on        ? "bed"
                            : size->near == NEAR_BODIES && scene->n_body == 0 ? "bodies"
                                                                              : NULL;
        if (!node || node->kind != TREE_MAPPING)
            continue;
        if (size->near == NEAR_REGION && !given)
            silt_complain(
                reader, node,
                "key 'fluid.sizes.%d': found none of its forms, allowed near: walls, bed, bodies or surface, or "
                "one of: %s, polygon, outline, %s",
                i, "box", scene->dimension == 3 ? "sphere" : "circle");
        else if (size->near && size->near != NEAR_REGION && given)
            silt_complain_key(reader, given,
                              "key 'fluid.sizes.%d.%s': found it beside near: %s, allowed with near: region", i,
                              given->key, near && near->text ? near->text : "?");
        else if (lacks)
            silt_complain(reader, near, "key 'fluid.sizes.%d.near': found '%s', allowed in a scene that has %s", i,
                          lacks, lacks);
    }
}

// eddies of the start or of an inlet (k >= 0) are carried by one model alone, and known by one number
static void check_eddies(silt_reader *reader, const silt_fluid_def *fluid, int k) {
    const silt_eddy_def *eddy = k < 0 ? &fluid->eddy : &fluid->inlet[k].eddy;
    const char *const key[2] = {"eddy_viscosity", "shear_velocity"};
    const double value[2] = {eddy->viscosity, eddy->shear};
    char where[64] = "fluid";
    if (k >= 0)
        snprintf(where, sizeof where, "fluid.inlets.%d", k);
    for (int q = 0; q < 2; q++)
        if (value[q] > 0 && fluid->turbulence != TURBULENCE_SPALART_ALLMARAS)
            silt_complain(reader, silt_tree_find(reader->root, "%s.%s", where, key[q]),
                          "key '%s.%s': found %.10g with a model that carries no eddies, allowed with turbulence: spalart-allmaras", where, key[q],
                          value[q]);
    if (value[0] > 0 && value[1] > 0)
        silt_complain(reader, silt_tree_find(reader->root, "%s.shear_velocity", where),
                      "key '%s.shear_velocity': found %.10g beside an eddy_viscosity, allowed one of the two", where, value[1]);
}

static void settle_fluid(silt_reader *reader, silt_scene *scene) {
    silt_fluid_def *fluid = &scene->fluid;
    const silt_tree *node = silt_tree_item(reader->root, "fluid");
    const bool laminar = fluid->flow == FLOW_LAMINAR;
    if (!fluid->on)
        return;
    // turbulence
    if (laminar && fluid->turbulence != TURBULENCE_AUTO && fluid->turbulence != TURBULENCE_NONE)
        silt_complain(
            reader, silt_tree_item(node, "turbulence"),
            "key 'fluid.turbulence': found a model in laminar flow, allowed auto or none, or flow: turbulent");
    if (fluid->turbulence == TURBULENCE_AUTO)
        fluid->turbulence = laminar                 ? TURBULENCE_NONE
                            : scene->dimension == 3 ? TURBULENCE_WALE
                                                    : TURBULENCE_MIXING_LENGTH;
    for (int k = -1; k < fluid->n_inlet; k++)
        check_eddies(reader, fluid, k);
    // rheology
    if (fluid->rheology == RHEOLOGY_NEWTONIAN && fluid->yield_stress > 0)
        silt_complain(reader, silt_tree_item(node, "yield_stress"),
                      "key 'fluid.yield_stress': found %.10g in a Newtonian fluid, allowed 0, or rheology: bingham or "
                      "herschel-bulkley",
                      fluid->yield_stress);
    if (fluid->rheology != RHEOLOGY_HERSCHEL_BULKLEY && fluid->flow_index > 0 && fluid->flow_index != 1)
        silt_complain(reader, silt_tree_item(node, "flow_index"),
                      "key 'fluid.flow_index': found %.10g, allowed 1, or rheology: herschel-bulkley",
                      fluid->flow_index);
    // time
    if (fluid->theta > 0 && fluid->theta < 0.5)
        silt_complain(reader, silt_tree_item(node, "theta"),
                      "key 'fluid.theta': found %.10g, allowed 0.5 to 1, or 0: what fluid.order says", fluid->theta);
    if (fluid->theta == 0)
        fluid->theta = fluid->order == 1 ? 1 : 0.5;
    settle_cloud(reader, scene);
    settle_sizes(reader, scene);
    settle_formula(reader, scene, &fluid->velocity, "fluid.velocity");
    settle_formula(reader, scene, &fluid->force, "fluid.body_force");
}

// bed --------------------------------------------------------------------------------------------------
static void settle_bed(silt_reader *reader, silt_scene *scene) {
    silt_bed_def *bed = &scene->bed;
    const silt_tree *node = silt_tree_item(reader->root, "bed");
    if (!bed->on || !node)
        return;
    const silt_tree *law = silt_tree_item(node, "law"), *shear = silt_tree_item(node, "shear");
    const bool work = bed->law == BED_FRICTIONAL_WORK || bed->law == BED_DISSIPATION;
    if (bed->shear == SHEAR_DEFAULT)
        bed->shear = bed->law == BED_FRICTIONAL_WORK ? SHEAR_PAPER
                     : bed->law == BED_DISSIPATION   ? SHEAR_GRADIENT
                                                     : SHEAR_LOG_LAW;
    if (scene->fluid.on && scene->fluid.viscosity == 0 && (bed->law == BED_SHIELDS || (work && bed->shear == SHEAR_LOG_LAW)))
        silt_complain(reader, bed->law == BED_SHIELDS ? law : shear,
                      "key 'bed.%s': found '%s' in water without viscosity, allowed with fluid.viscosity > 0",
                      bed->law == BED_SHIELDS ? "law" : "shear", bed->law == BED_SHIELDS ? "shields" : "log-law");
    if (scene->fluid.on && bed->law == BED_SHIELDS &&
        (bed->density <= scene->fluid.density || silt_length(3, scene->gravity) == 0))
        silt_complain(reader, law, "key 'bed.law': found 'shields' for a bed that has no weight in the water, allowed with gravity and "
                                   "bed.density > fluid.density");
}

// grains that fill regions -----------------------------------------------------------------------------
// the sieve's columns in this order, diameters > 0, shares that rise from 0 to 1
static void settle_sieve(silt_reader *reader, const silt_tree *item, const char *path, silt_series *sieve) {
    static const char *const name[2] = {"diameter", "passing"};
    if (!settle_columns(reader, item, path, sieve, name, 2, 2, false) || !settle_finite(reader, item, path, sieve))
        return;
    settle_order(sieve, name, 2, false);
    const double *row = sieve->value;
    const int n = sieve->n_row;
    for (int i = 0; i < n; i++) {
        const char *fault = !(row[2 * i] > 0)                                  ? "a diameter that is not > 0"
                            : i > 0 && !(row[2 * i] > row[2 * i - 2])          ? "a diameter that does not rise"
                            : i > 0 && !(row[2 * i + 1] >= row[2 * i - 1])     ? "a share that falls"
                            : i == 0 && row[1] != 0                            ? "a first share that is not 0"
                            : i == n - 1 && (n < 2 || row[2 * i + 1] != 1)     ? "a last share that is not 1"
                                                                               : NULL;
        if (fault) {
            silt_complain(reader, item, "key '%s': found %s in %s:%d, allowed two rows or more with rising diameters in m and the "
                          "share that passes, from 0 to 1", path, fault, sieve->path, sieve->line[i]);
            return;
        }
    }
}

static void settle_fills(silt_reader *reader, silt_scene *scene) {
    if (scene->grains.sieve.n_row)
        settle_sieve(reader, silt_tree_find(reader->root, "grains.sieve"), "grains.sieve", &scene->grains.sieve);
    if (scene->grains.sieve.n_row && scene->grains.per_patch)
        silt_complain_key(reader, silt_tree_find(reader->root, "grains.per_patch"), "key 'grains.per_patch': found it beside a sieve, allowed only one of them");
    for (int i = 0; i < scene->grains.n_fill; i++) {
        silt_fill_def *fill = &scene->grains.fill[i];
        const silt_tree *node = silt_tree_find(reader->root, "grains.regions.%d", i);
        const silt_tree *sieve = silt_tree_item(node, "sieve"), *diameter = silt_tree_item(node, "diameter");
        const silt_tree *count = silt_tree_item(node, "count");
        if (!node || node->kind != TREE_MAPPING)
            continue;
        const bool both = sieve && fill->diameter > 0;
        if (both)
            silt_complain_key(reader, sieve, "key 'grains.regions.%d.sieve': found it beside a diameter, allowed only one of them", i);
        else if (!sieve && fill->diameter == 0)
            silt_complain(reader, diameter ? diameter : node,
                          "key 'grains.regions.%d.diameter': found %s, allowed a number in m, > 0, or a sieve", i,
                          diameter ? "0 without a sieve" : "neither diameter nor sieve");
        if (fill->count > 0 && fill->porosity > 0)
            silt_complain_key(reader, count, "key 'grains.regions.%d.count': found it beside a porosity, allowed only one of them", i);
        if (sieve && !both && fill->sieve.n_row) {
            char *path = silt_text("grains.regions.%d.sieve", i);
            settle_sieve(reader, sieve, path, &fill->sieve);
            free(path);
        }
    }
}

void silt_scene_settle(silt_reader *reader, silt_scene *scene) {
    if (!scene->bounds.on) {
        scene->bounds.volume = strtod(BOUNDS_VOLUME, NULL);
        scene->bounds.mass = strtod(BOUNDS_MASS, NULL);
        scene->bounds.energy = strtod(BOUNDS_ENERGY, NULL);
    }
    settle_regions(reader, scene);
    for (int i = 0; i < scene->n_wall; i++)
        settle_wall(reader, scene, &scene->wall[i], i);
    for (int i = 0; i < scene->n_body; i++)
        settle_body(reader, scene, &scene->body[i], i);
    settle_fluid(reader, scene);
    settle_bed(reader, scene);
    settle_fills(reader, scene);
}

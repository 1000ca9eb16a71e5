/** @file scene_check.c
 * What no single key can tell: names that clash, things that lie outside or in each other, blocks that need other
 * blocks.
 */
#include "scene_keys.h"

#include <limits.h>

// blocks -----------------------------------------------------------------------------------------------
// which blocks are there for the others
static void check_blocks(silt_reader *reader, const silt_scene *scene) {
    const silt_tree *root = reader->root;
    const silt_tree *bodies = silt_tree_item(root, "bodies"), *fluid = silt_tree_item(root, "fluid");
    const silt_tree *bed = silt_tree_item(root, "bed"), *grains = silt_tree_item(root, "grains");
    bool has_bodies = scene->n_body > 0;
    if (!fluid && !grains && !has_bodies && !bodies)
        silt_complain(reader, root,
                      "key 'fluid': found neither water nor grains nor bodies, allowed a scene with at least "
                      "one of fluid, grains, bodies");
    const bool fixed = !silt_bed_erodes(&scene->bed) && !grains; // a bed that gives nothing needs no grains
    if (bed && !grains && !fixed)
        silt_complain_key(reader, bed,
                          "key 'bed': found it without grains, allowed with a block grains {parcel: ...}, or one that gives nothing (work: .inf): "
                          "eroded bed becomes grains");
    if (bed && scene->grains.on && !silt_tree_item(grains, "parcel"))
        silt_complain_key(reader, grains,
                          "key 'grains.parcel': found nothing in this block, allowed a number in m, > 0: "
                          "the bed's parcels need a diameter");
    else if (bed && scene->grains.on && scene->grains.parcel == 0)
        silt_complain(reader, silt_tree_item(grains, "parcel"),
                      "key 'grains.parcel': found 0, allowed a number in m, > 0: "
                      "the bed's parcels need a diameter");
    const silt_tree *first = bed && !fixed ? bed : grains ? grains : has_bodies ? bodies : NULL;
    if (first && !silt_tree_item(root, "contact"))
        silt_complain_key(reader, first,
                          "key '%s': found it without contact properties, allowed with a block contact "
                          "{youngs_modulus, poissons_ratio, restitution, friction, rolling_friction}",
                          first->key);
    if (scene->fluid.on && !silt_tree_item(fluid, "regions") && !silt_tree_item(fluid, "inlets") &&
        !silt_tree_item(fluid, "cloud"))
        silt_complain_key(reader, fluid,
                          "key 'fluid.regions': found neither regions nor inlets, allowed at least one: there is no water");
    if (scene->grains.kernel_layers && !(scene->period[0] < scene->period[1]))
        silt_complain(reader, silt_tree_item(grains, "kernel_layers"),
                      "key 'grains.kernel_layers': found true, allowed in a periodic scene: its means are taken along the whole of x");
    if (scene->grains.across && !scene->grains.kernel_layers)
        silt_complain(reader, silt_tree_item(grains, "across"),
                      "key 'grains.across': found true, allowed with kernel_layers: true: the water does not repeat in y");
    const silt_tree *regions = silt_tree_item(bed, "regions");
    if (regions && regions->kind == TREE_LIST && regions->n_item == 0)
        silt_complain(reader, regions, "key 'bed.regions': found an empty list, allowed at least one region");
}

// seepage has its law's number and water to flow in
static void check_seepage(silt_reader *reader, const silt_scene *scene) {
    const silt_bed_def *bed = &scene->bed;
    const silt_tree *node = silt_tree_item(reader->root, "bed");
    if (!bed->on)
        return;
    if (bed->seepage == SEEPAGE_DARCY && bed->permeability == 0)
        silt_complain_key(reader, silt_tree_item(node, "seepage"),
                          "key 'bed.permeability': found none beside seepage: darcy, allowed a number in m2, > 0");
    if (bed->seepage != SEEPAGE_DARCY && bed->permeability > 0)
        silt_complain(reader, silt_tree_item(node, "permeability"),
                      "key 'bed.permeability': found %.10g, allowed with seepage: darcy alone", bed->permeability);
    if (bed->seepage != SEEPAGE_NONE && !scene->fluid.on)
        silt_complain_key(reader, silt_tree_item(node, "seepage"),
                          "key 'bed.seepage': found it without water, allowed in a scene with fluid");
    if (bed->seepage != SEEPAGE_NONE && scene->fluid.on && scene->fluid.viscosity == 0)
        silt_complain_key(reader, silt_tree_item(node, "seepage"),
                          "key 'bed.seepage': found it beside fluid.viscosity: 0, allowed with a viscosity > 0");
    if (bed->seepage != SEEPAGE_NONE && scene->fluid.on && scene->fluid.pressure == PRESSURE_LAPLACIAN)
        silt_complain_key(reader, silt_tree_item(node, "seepage"),
                          "key 'bed.seepage': found it beside fluid.pressure: laplacian, allowed consistent there");
}

// a number of frames that fits their names
static void check_time(silt_reader *reader, const silt_scene *scene) {
    if (scene->time.output > 0 && scene->time.end / scene->time.output > 999999)
        silt_complain(reader, silt_tree_find(reader->root, "time.output"),
                      "key 'time.output': found %.10g, which makes %.10g frames, allowed at most 999999",
                      scene->time.output, scene->time.end / scene->time.output);
}

#define CHECK_STEPS 1e7 // more of them are no run

// steps that the tension of the surface bounds: with too much of it they become too many
static void check_tension(silt_reader *reader, const silt_scene *scene) {
    const silt_fluid_def *fluid = &scene->fluid;
    double h = fluid->size;
    for (int i = 0; i < fluid->n_size; i++)
        h = silt_min(h, fluid->size_at[i].size);
    const double step = scene->time.cfl * silt_tension_time(fluid->surface_tension, fluid->density, h), n = scene->time.end / step;
    if (step > 0 && n > CHECK_STEPS && !(scene->time.steps > 0 && scene->time.steps <= CHECK_STEPS))
        silt_complain(reader, silt_tree_find(reader->root, "fluid.surface_tension"),
                      "key 'fluid.surface_tension': found %.10g, which bounds a step to %.3g s and makes %.3g steps, allowed at most %g "
                      "steps",
                      fluid->surface_tension, step, n, CHECK_STEPS);
}

// walls ------------------------------------------------------------------------------------------------
static void check_walls(silt_reader *reader, silt_scene *scene) {
    for (int i = 0; i < scene->n_wall; i++) {
        silt_wall *wall = &scene->wall[i];
        const silt_tree *node = silt_tree_find(reader->root, "walls.%d", i);
        const silt_tree *line = silt_tree_item(node, "polyline");
        int n = wall->n_point, crossing[2];
        // the first point again at the end says closed
        if (n > 2 && wall->point[0] == wall->point[3 * n - 3] && wall->point[1] == wall->point[3 * n - 2]) {
            wall->n_point = --n;
            wall->closed = true;
        }
        if (n == 2 && wall->closed)
            silt_complain(reader, line, "key 'walls.%d.polyline': found a closed wall of 2 points, allowed 3 or more",
                          i);
        else if (n > 2 && wall->closed && silt_chain_crosses(n, wall->point, true, crossing))
            silt_complain(reader, line,
                          "key 'walls.%d.polyline': found the closing edge %d meeting edge %d, allowed a "
                          "polyline that crosses or touches itself nowhere",
                          i, crossing[1], crossing[0]);
    }
}

// inside the walls -------------------------------------------------------------------------------------
/** the box spanned by walls and water; open where things fall in from */
typedef struct check_box {
    int dim;
    double lo[3], hi[3], slack;
    bool open_low[3], open_high[3];
    bool known;
} check_box;

// false for a region that a complaint was already made about
static bool check_region_whole(const silt_scene *scene, const silt_region *region) {
    return silt_region_space(region) == (scene->dimension == 3) &&
           ((region->kind == REGION_BOX && region->lo[0] < region->hi[0]) ||
            (region->kind == REGION_POLYGON && region->n_point > 0) ||
            (region->kind == REGION_CIRCLE && region->radius > 0) ||
            (region->kind == REGION_SPHERE && region->radius > 0));
}

static void check_box_add(check_box *box, const double *lo, const double *hi) {
    for (int k = 0; k < box->dim; k++) {
        box->lo[k] = silt_min(box->lo[k], lo[k]);
        box->hi[k] = silt_max(box->hi[k], hi[k]);
    }
    box->known = true;
}

// spanned by the walls alone, or by walls and water; what has gravity behind it may come in from above
static check_box check_box_make(const silt_scene *scene, bool water) {
    check_box box = {.dim = scene->dimension == 3 ? 3 : 2,
                     .lo = {HUGE_VAL, HUGE_VAL, HUGE_VAL},
                     .hi = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
    const int up = silt_scene_up(scene);
    for (int i = 0; i < scene->n_wall; i++) {
        const silt_wall *wall = &scene->wall[i];
        // where a surface lies is not known here
        if (wall->surface)
            return (check_box){.dim = box.dim};
        for (int k = 0; k < wall->n_point; k++)
            check_box_add(&box, wall->point + 3 * k, wall->point + 3 * k);
        if (wall->form == WALL_BOX && wall->lo[0] < wall->hi[0])
            check_box_add(&box, wall->lo, wall->hi);
    }
    for (int i = 0; water && i < scene->fluid.n_region; i++) {
        double lo[3], hi[3];
        if (!check_region_whole(scene, &scene->fluid.region[i]))
            continue;
        silt_region_bounds(&scene->fluid.region[i], lo, hi);
        check_box_add(&box, lo, hi);
    }
    box.slack = box.known ? 1e-9 * (box.hi[0] - box.lo[0] + box.hi[1] - box.lo[1]) : 0;
    for (int k = 0; k < box.dim; k++) {
        box.open_low[k] = scene->gravity[k] > 0;
        box.open_high[k] = scene->gravity[k] < 0 || (k == up && scene->gravity[up] == 0);
    }
    return box;
}

static bool check_box_holds(const check_box *box, const double *lo, const double *hi, double slack) {
    slack += box->slack;
    for (int k = 0; k < box->dim; k++)
        if ((!box->open_low[k] && lo[k] < box->lo[k] - slack) || (!box->open_high[k] && hi[k] > box->hi[k] + slack))
            return false;
    return true;
}

static void __attribute__((format(printf, 4, 5)))
check_outside(silt_reader *reader, const silt_tree *node, const check_box *box, const char *format, ...) {
    char path[128];
    va_list list;
    va_start(list, format);
    vsnprintf(path, sizeof path, format, list);
    va_end(list);
    if (box->dim == 3)
        silt_complain(
            reader, node,
            "key '%s': found it outside of the walls, allowed inside of the box from [%.10g, %.10g, %.10g] to "
            "[%.10g, %.10g, %.10g] that the walls and the water span",
            path, box->lo[0], box->lo[1], box->lo[2], box->hi[0], box->hi[1], box->hi[2]);
    else
        silt_complain(reader, node,
                      "key '%s': found it outside of the walls, allowed inside of the box from [%.10g, %.10g] to "
                      "[%.10g, %.10g] that the walls and the water span",
                      path, box->lo[0], box->lo[1], box->hi[0], box->hi[1]);
}

void silt_scene_check_within(silt_reader *reader, const silt_scene *scene, const silt_tree *node, const double *lo, const double *hi,
                             double slack, int body) {
    const check_box box = check_box_make(scene, true);
    if (box.known && !check_box_holds(&box, lo, hi, slack))
        check_outside(reader, node, &box, "bodies.%d.at", body);
}

// water, bed and grains where the walls can hold them
static void check_inside(silt_reader *reader, const silt_scene *scene) {
    check_box walls = check_box_make(scene, false), box = check_box_make(scene, true);
    double lo[3], hi[3];
    // water is outside when it lies beside the walls altogether, or below them
    for (int i = 0; walls.known && i < scene->fluid.n_region; i++) {
        if (!check_region_whole(scene, &scene->fluid.region[i]))
            continue;
        silt_region_bounds(&scene->fluid.region[i], lo, hi);
        bool apart = false;
        for (int k = 0; k < walls.dim; k++)
            apart |= (!walls.open_low[k] && hi[k] <= walls.lo[k] && walls.hi[k] > walls.lo[k]) ||
                     (!walls.open_high[k] && lo[k] >= walls.hi[k] && walls.hi[k] > walls.lo[k]);
        if (apart)
            check_outside(reader, silt_tree_find(reader->root, "fluid.regions.%d", i), &walls, "fluid.regions.%d", i);
    }
    for (int i = 0; box.known && i < scene->bed.n_region; i++) {
        if (!check_region_whole(scene, &scene->bed.region[i]))
            continue;
        silt_region_bounds(&scene->bed.region[i], lo, hi);
        if (!check_box_holds(&box, lo, hi, 0))
            check_outside(reader, silt_tree_find(reader->root, "bed.regions.%d", i), &box, "bed.regions.%d", i);
    }
    for (int i = 0; box.known && i < scene->grains.n_fill; i++) {
        if (!check_region_whole(scene, &scene->grains.fill[i].region))
            continue;
        silt_region_bounds(&scene->grains.fill[i].region, lo, hi);
        if (!check_box_holds(&box, lo, hi, 0))
            check_outside(reader, silt_tree_find(reader->root, "grains.regions.%d", i), &box, "grains.regions.%d", i);
    }
    for (int i = 0; box.known && i < scene->grains.n_grain; i++) {
        const double *at = scene->grains.grain[i].at;
        if (!check_box_holds(&box, at, at, 0))
            check_outside(reader, silt_tree_find(reader->root, "grains.list.%d.at", i), &box, "grains.list.%d.at", i);
    }
}

// what repeats lies inside of one period
static void check_period(silt_reader *reader, const silt_scene *scene) {
    const double *period = scene->period, slack = 1e-9 * (period[1] - period[0]);
    if (!(period[0] < period[1]))
        return;
    if (scene->fluid.on && period[1] - period[0] < 6 * scene->fluid.size)
        silt_complain(reader, silt_tree_item(reader->root, "periodic"),
                      "key 'periodic': found a period of %.10g m, allowed at least 6 fluid.size",
                      period[1] - period[0]);
    for (int i = 0; i < scene->fluid.n_region; i++) {
        double lo[3], hi[3];
        if (!check_region_whole(scene, &scene->fluid.region[i]))
            continue;
        silt_region_bounds(&scene->fluid.region[i], lo, hi);
        if (lo[0] < period[0] - slack || hi[0] > period[1] + slack)
            silt_complain(reader, silt_tree_find(reader->root, "fluid.regions.%d", i),
                          "key 'fluid.regions.%d': found it from x = %.10g to %.10g, allowed inside of the period from "
                          "%.10g to %.10g",
                          i, lo[0], hi[0], period[0], period[1]);
    }
}

// grains that fill regions -----------------------------------------------------------------------------
/** what they keep clear of */
typedef struct check_clear {
    const silt_scene *scene;
    silt_body_shape *body; // owned, one per body
} check_clear;

// from the wall's elements, and not inside of an obstacle; where surfaces from files lie is not known here
static bool clear_of_wall(const silt_scene *scene, const silt_wall *wall, const double *x, double radius) {
    if (wall->form == WALL_BOX && scene->dimension == 3) {
        for (int k = 0; k < 3; k++)
            if (x[k] - wall->lo[k] < radius || wall->hi[k] - x[k] < radius)
                return false;
        return true;
    }
    const int n = wall->n_point;
    for (int i = 0; i + 1 < n + wall->closed; i++)
        if (silt_segment_distance(wall->point + 3 * i, wall->point + 3 * ((i + 1) % n), x) < radius)
            return false;
    return !wall->closed || silt_polygon_area(n, wall->point) > 0 || !silt_polygon_contains(n, wall->point, x);
}

static bool check_clear_at(const void *context, const double *x, double radius) {
    const check_clear *clear = context;
    const silt_scene *scene = clear->scene;
    const double reach = radius * (1 - 1e-9); // touching is allowed
    for (int i = 0; i < scene->n_wall; i++)
        if (!clear_of_wall(scene, &scene->wall[i], x, reach))
            return false;
    for (int i = 0; i < scene->bed.n_region; i++)
        if (silt_region_depth(&scene->bed.region[i], x) > -reach)
            return false;
    for (int i = 0; i < scene->n_body; i++)
        if (silt_body_shape_near(&clear->body[i], x, reach))
            return false;
    return true;
}

// what all keys are sound for
static void check_fill(silt_reader *reader, silt_scene *scene) {
    if (reader->n_complaint > 0 || (scene->grains.n_fill == 0 && scene->grains.n_grain == 0))
        return;
    check_clear clear = {scene, silt_alloc((size_t)scene->n_body + 1, sizeof *clear.body)};
    for (int i = 0; i < scene->n_body; i++)
        clear.body[i] = silt_body_shape_make(scene, &scene->body[i]);
    silt_scene_check_grains(reader, scene, check_clear_at, &clear);
    if (scene->grains.n_fill > 0)
        silt_scene_fill(reader, scene, check_clear_at, &clear);
    for (int i = 0; i < scene->n_body; i++)
        free(clear.body[i].point);
    free(clear.body);
}

// columns of history.csv -------------------------------------------------------------------------------
typedef struct check_column {
    char name[64];
    int owner; // -1: always there; i: body i; n_body + i: gauge i
} check_column;

// the same as in history.c; a test holds them together
// clang-format off
static const char *const check_fixed[] = {
    "step", "time", "dt", "n_node", "n_cell", "fluid_volume", "flying_volume", "mesh_volume", "fluid_mass",
    "volume_error", "kinetic_energy", "potential_energy", "momentum_x", "momentum_y", "momentum_z", "momentum_error",
    "external_work", "dissipation", "max_speed", "volume_solved", "volume_moved", "volume_reconnected",
    "volume_refined", "volume_given", "volume_owed", "owed_energy", "y_plus", "angular_momentum_x", "angular_momentum_y",
    "angular_momentum_z", "bed_mass", "released_mass", "deposited_mass", "pore_water_mass", "bed_shear", "bed_work",
    "bed_y_plus", "seepage", "seepage_volume", "seepage_lost", "grain_count", "grain_mass", "grain_velocity_x",
    "grain_velocity_y", "grain_velocity_z", "grain_kinetic_energy", "grain_potential_energy", "grain_water_x",
    "grain_water_y", "grain_water_z", "grain_contact_x", "grain_contact_y", "grain_contact_z", "sediment_error",
    "left_mass", "fed_mass", "body_kinetic_energy", "body_potential_energy", "inflow_mass", "outflow_mass", "wall_mesh", "wall_assemble", "wall_solve", "wall_bed", "wall_dem",
    "wall_move", "wall_output"};
// clang-format on
static const char *const check_of_body[] = {"x",  "y",  "z",  "vx", "vy", "vz", "qw", "qx", "qy", "qz", "wx",
                                            "wy", "wz", "fx", "fy", "fz", "tx", "ty", "tz", "cx", "cy", "cz"};
enum {
    CHECK_FIXED = sizeof check_fixed / sizeof *check_fixed,
    CHECK_OF_BODY = sizeof check_of_body / sizeof *check_of_body,
};

static int check_column_order(const void *a, const void *b) {
    const check_column *p = a, *q = b;
    int by = strcmp(p->name, q->name);
    return by ? by : p->owner - q->owner;
}

// all columns of this scene's history, sorted by name; owned by the caller
static check_column *check_columns(const silt_scene *scene, int *count) {
    int capacity = 0, n = 0;
    check_column *column = NULL;
    for (int i = 0; i < CHECK_FIXED; i++) {
        SILT_RESERVE(column, capacity, n + 1);
        column[n].owner = -1;
        snprintf(column[n++].name, sizeof column->name, "%s", check_fixed[i]);
    }
    for (int i = 0; i < scene->n_body; i++)
        for (int k = 0; k < CHECK_OF_BODY && scene->body[i].name; k++) {
            SILT_RESERVE(column, capacity, n + 1);
            column[n].owner = i;
            snprintf(column[n++].name, sizeof column->name, "%.40s_%s", scene->body[i].name, check_of_body[k]);
        }
    for (int i = 0; i < scene->n_gauge; i++)
        for (int k = 0; k < silt_gauge_columns(scene, i) && scene->gauge[i].name; k++) {
            SILT_RESERVE(column, capacity, n + 1);
            column[n].owner = scene->n_body + i;
            silt_gauge_column(scene, i, k, column[n++].name);
        }
    qsort(column, (size_t)n, sizeof *column, check_column_order);
    *count = n;
    return column;
}

// neighbours of the same name: the later one is told
static void check_names(silt_reader *reader, const silt_scene *scene, const check_column *column, int n) {
    int last = INT_MIN; // one complaint per owner is enough
    for (int i = 1; i < n; i++) {
        if (strcmp(column[i].name, column[i - 1].name) != 0 || column[i].owner < 0 || column[i].owner == last)
            continue;
        last = column[i].owner;
        int before = column[i - 1].owner;
        bool body = last < scene->n_body, other_body = before < scene->n_body;
        int at = body ? last : last - scene->n_body;
        const char *list = body ? "bodies" : "gauges";
        const char *name = body ? scene->body[at].name : scene->gauge[at].name;
        const silt_tree *node = silt_tree_find(reader->root, "%s.%d.name", list, at);
        if (before >= 0 && body == other_body)
            silt_complain(reader, node, "key '%s.%d.name': found the name '%s' again, allowed a name of its own", list,
                          at, name);
        else
            silt_complain(reader, node,
                          "key '%s.%d.name': found '%s', which gives the column '%s' that history.csv already "
                          "has%s%s, allowed another name",
                          list, at, name, column[i].name, before < 0 ? "" : " from body ",
                          before < 0 ? "" : scene->body[before].name);
    }
}

// checks -----------------------------------------------------------------------------------------------
static const char *check_nearest_column(const check_column *column, int n, const char *name) {
    const char *nearest = NULL;
    int best = 3;
    for (int i = 0; i < n; i++) {
        int distance = silt_text_distance(name, column[i].name, best - 1);
        if (distance < best) {
            best = distance;
            nearest = column[i].name;
        }
    }
    return nearest;
}

static const char *check_nearest_gauge(const silt_scene *scene, const char *name) {
    const char *nearest = NULL;
    int best = 3;
    for (int k = 0; k < scene->n_gauge; k++) {
        const char *gauge = scene->gauge[k].name;
        const int distance = gauge ? silt_text_distance(name, gauge, best - 1) : best;
        if (distance < best) {
            best = distance;
            nearest = gauge;
        }
    }
    return nearest;
}

// by bisection
static bool check_has_column(const check_column *column, int n, const char *name) {
    check_column wanted;
    snprintf(wanted.name, sizeof wanted.name, "%s", name);
    int low = 0, high = n;
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (strcmp(column[middle].name, wanted.name) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return low < n && strcmp(column[low].name, name) == 0;
}

// the column that a check looks at
static void check_target(silt_reader *reader, const silt_scene *scene, int i, const check_column *column, int n) {
    const silt_check_def *check = &scene->check[i];
    const silt_tree *node = silt_tree_find(reader->root, "checks.%d", i);
    const silt_tree *gauge = silt_tree_item(node, "gauge"), *name = gauge ? gauge : silt_tree_item(node, "column");
    if (!check->column || !name || name->kind != TREE_SCALAR)
        return;
    if (gauge) {
        for (int k = 0; k < scene->n_gauge; k++)
            if (scene->gauge[k].name && strcmp(scene->gauge[k].name, check->column) == 0) {
                if (silt_gauge_columns(scene, k) == 3)
                    silt_complain(reader, gauge,
                                  "key 'checks.%d.gauge': found '%s', which has three columns, allowed column: "
                                  "%s_x, %s_y or %s_z",
                                  i, gauge->text, gauge->text, gauge->text, gauge->text);
                return;
            }
    } else if (check_has_column(column, n, check->column)) {
        return;
    }
    // a column by the wrong key, which is no gauge
    if (gauge && check_has_column(column, n, check->column)) {
        silt_complain(reader, name, "key 'checks.%d.gauge': found '%.80s', which is a column of history.csv and no gauge, allowed column: %.80s", i, name->text,
                      name->text);
        return;
    }
    const char *nearest = gauge ? check_nearest_gauge(scene, check->column) : check_nearest_column(column, n, check->column);
    silt_complain(reader, name, "key 'checks.%d.%s': found '%.80s', allowed a %s%s%s%s", i, name->key, name->text,
                  gauge ? "gauge of this scene" : "column of history.csv", nearest ? "; did you mean '" : "",
                  nearest ? nearest : "", nearest ? "'?" : "");
}

// a column of the reference by the key's text; missing x and y are its first two
static void check_reference_column(silt_reader *reader, int i, const silt_tree *node, const char *path,
                                   const silt_series *table, char **name, int fallback) {
    if (!*name && fallback >= 0 && fallback < table->n_column)
        *name = silt_text("%s", table->name[fallback]);
    if (*name && silt_series_column(table, *name) >= 0)
        return;
    const silt_tree *at = silt_tree_find(node, "%s", path);
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (!to)
        return;
    for (int k = 0; k < table->n_column && k < 20; k++)
        fprintf(to, "%s%.40s", k ? ", " : "", table->name[k]);
    fclose(to);
    silt_complain(reader, at ? at : node, "key 'checks.%d.%s': found %s%.80s%s, allowed a column of %s: %s", i, path,
                  *name ? "'" : "", *name ? *name : "nothing", *name ? "'" : "", table->path, text);
    free(text);
}

// the file, and the columns wanted of it
static void check_reference(silt_reader *reader, silt_check_def *check, int i, const silt_tree *node) {
    silt_error err = {0};
    silt_series table = {0};
    if (silt_series_read(NULL, check->reference, &table, &err) != SILT_OK) {
        silt_complain(reader, silt_tree_item(node, "reference"),
                      "key 'checks.%d.reference': found a file that cannot serve, allowed a CSV table: %s", i,
                      err.text);
        return;
    }
    check_reference_column(reader, i, node, "x", &table, &check->x, 0);
    check_reference_column(reader, i, node, "y", &table, &check->y, 1);
    if (check->where_column)
        check_reference_column(reader, i, node, "where.column", &table, &check->where_column, -1);
    silt_series_clear(&table);
}

// what a check needs besides: the abscissa of a scalar, the time of a profile, the line of a field
static void check_places(silt_reader *reader, const silt_scene *scene, int i, const silt_tree *node) {
    const silt_check_def *check = &scene->check[i];
    const bool profile = check->kind == CHECK_PROFILE;
    if ((profile || check->scalar == SCALAR_AT) && isnan(check->at))
        silt_complain(reader, node, "key 'checks.%d.at': found nothing in this block, allowed a number: %s", i,
                      profile ? "the time of the profile in s" : "where the scalar is taken");
    if (check->scalar == SCALAR_REACHES && isnan(check->level))
        silt_complain(reader, node,
                      "key 'checks.%d.level': found nothing in this block, allowed a number: what the scalar waits for",
                      i);
    if (profile && check->profile > PROFILE_SURFACE && !silt_tree_item(node, "line"))
        silt_complain(reader, node,
                      "key 'checks.%d.line': found nothing in this block, allowed two different points: "
                      "where the profile is taken",
                      i);
    if (profile && check->profile && !check->reference)
        silt_complain(reader, node, "key 'checks.%d.reference': found nothing in this block, allowed a CSV file", i);
}

// the mean over layers belongs to grains, which have to be there
static void check_layers(silt_reader *reader, const silt_scene *scene, int i, const silt_tree *node) {
    static const char *const own[] = {"since", "layer", "unit_at"};
    const silt_check_def *check = &scene->check[i];
    const bool grains = check->kind == CHECK_PROFILE && check->profile == PROFILE_GRAINS;
    const bool given[] = {!isnan(check->since), check->layer != 0, !isnan(check->unit_at)};
    for (int k = 0; k < 3 && check->kind == CHECK_PROFILE && !grains; k++)
        if (given[k])
            silt_complain_key(reader, silt_tree_item(node, own[k]),
                              "key 'checks.%d.%s': found it with another profile, allowed only with profile: grains", i, own[k]);
    if (!grains)
        return;
    if (!scene->grains.on)
        silt_complain_key(reader, silt_tree_item(node, "profile"),
                          "key 'checks.%d.profile': found a profile of grains, allowed in a scene with a block grains", i);
    if (check->layer <= 0)
        silt_complain(reader, node, "key 'checks.%d.layer': found no thickness, allowed a number in m, > 0", i);
    if (check->since > check->at)
        silt_complain_key(reader, silt_tree_item(node, "since"), "key 'checks.%d.since': found %g, allowed a time up to `at`, %g s", i,
                          check->since, check->at);
}

// each check has one target, one thing to hold it against, and a tolerance
static void check_checks(silt_reader *reader, silt_scene *scene, const check_column *column, int n) {
    for (int i = 0; i < scene->n_check; i++) {
        silt_check_def *check = &scene->check[i];
        const silt_tree *node = silt_tree_find(reader->root, "checks.%d", i);
        if (!node || node->kind != TREE_MAPPING)
            continue;
        check_target(reader, scene, i, column, n);
        check_places(reader, scene, i, node);
        check_layers(reader, scene, i, node);
        const silt_tree *reference = silt_tree_item(node, "reference"), *scalar = silt_tree_item(node, "scalar");
        const silt_tree *value = silt_tree_item(node, "value"), *range = silt_tree_item(node, "range");
        bool is_scalar = check->scalar != SCALAR_NONE;
        if (check->kind != CHECK_PROFILE && !reference &&
            (!scalar || strcmp(scalar->text ? scalar->text : "", "none") == 0))
            silt_complain(reader, node, "key 'checks.%d': found neither a reference nor a scalar, allowed one of them",
                          i);
        else if (reference && is_scalar)
            silt_complain_key(reader, scalar,
                              "key 'checks.%d.scalar': found it beside a reference, allowed only one of them", i);
        else if (is_scalar && !value && !range)
            silt_complain(reader, node,
                          "key 'checks.%d.value': found nothing to hold the scalar against, allowed value with "
                          "tolerance, or range",
                          i);
        else if (is_scalar && value && range)
            silt_complain_key(reader, range, "key 'checks.%d.range': found it beside a value, allowed only one of them",
                              i);
        else if (!(is_scalar && range) && !silt_tree_item(node, "tolerance"))
            silt_complain(reader, node,
                          "key 'checks.%d.tolerance': found nothing in this block, allowed a number, >= 0", i);
        if (check->reference)
            check_reference(reader, check, i, node);
        for (int k = 0; k < i && i < 1000; k++)
            if (check->name && scene->check[k].name && strcmp(check->name, scene->check[k].name) == 0) {
                silt_complain(reader, silt_tree_item(node, "name"),
                              "key 'checks.%d.name': found the name '%s' again, allowed a name of its own", i,
                              check->name);
                break;
            }
    }
}

// gauges that need a wall, or an axis of space
static void check_gauges(silt_reader *reader, const silt_scene *scene) {
    for (int i = 0; i < scene->n_gauge; i++) {
        const silt_gauge_def *gauge = &scene->gauge[i];
        const silt_tree *node = silt_tree_find(reader->root, "gauges.%d", i);
        if (gauge->kind == GAUGE_FORCE && gauge->index >= scene->n_wall)
            silt_complain(reader, silt_tree_item(node, "force_on"),
                          "key 'gauges.%d.force_on': found %d, allowed the number of a wall, the first is 0; there are %d", i,
                          gauge->index, scene->n_wall);
        const bool grain = gauge->kind >= GAUGE_GRAIN_PLACE && gauge->kind <= GAUGE_GRAIN_FORCE;
        const bool grains = grain || (gauge->kind >= GAUGE_GRAIN_FRONT && gauge->kind <= GAUGE_GRAIN_SLOPE);
        if (grains && !scene->grains.on)
            silt_complain(reader, node, "key 'gauges.%d': found a gauge of grains, allowed in a scene with a block grains", i);
        if (gauge->kind == GAUGE_EXTENT && gauge->from[0] == 2 && scene->dimension != 3)
            silt_complain(reader, silt_tree_item(node, "extent"),
                          "key 'gauges.%d.extent': found z, allowed x or y in two dimensions", i);
    }
}

void silt_scene_check(silt_reader *reader, silt_scene *scene) {
    check_blocks(reader, scene);
    check_time(reader, scene);
    check_seepage(reader, scene);
    check_tension(reader, scene);
    check_walls(reader, scene);
    const check_box box = check_box_make(scene, true);
    silt_scene_check_openings(reader, scene, box.lo, box.hi);
    check_inside(reader, scene);
    check_period(reader, scene);
    silt_scene_check_bodies(reader, scene);
    silt_scene_check_motion(reader, scene);
    check_gauges(reader, scene);
    int n;
    check_column *column = check_columns(scene, &n);
    check_names(reader, scene, column, n);
    check_checks(reader, scene, column, n);
    free(column);
    check_fill(reader, scene);
}

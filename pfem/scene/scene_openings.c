/** @file scene_openings.c
 * What must be true of inlets and outlets: their shape, which way they face, what a level behind them needs.
 */
#include "scene_keys.h"

static void check_opening(silt_reader *reader, const char *list, int i, const double *from, const double *to) {
    const silt_tree *node = silt_tree_find(reader->root, "fluid.%s.%d", list, i);
    const silt_tree *from_node = silt_tree_item(node, "from"), *to_node = silt_tree_item(node, "to");
    if (from_node && to_node && from[0] == to[0] && from[1] == to[1])
        silt_complain(reader, to_node,
                      "key 'fluid.%s.%d.to': found the point [%.10g, %.10g] of `from` again, allowed another "
                      "one",
                      list, i, to[0], to[1]);
}

// the corners of a polygon in space: in one plane, all turning the same way, none twice
static void check_corners(silt_reader *reader, const silt_scene *scene, int k) {
    const silt_opening o = silt_opening_of(scene, k);
    const int i = o.inlet ? k : k - scene->fluid.n_inlet;
    const char *list = o.inlet ? "inlets" : "outlets";
    const silt_tree *node = silt_tree_find(reader->root, "fluid.%s.%d.corners", list, i);
    if (!node || o.n_corner < 3)
        return;
    bool flat = true, convex = silt_length(3, o.normal) > 0;
    for (int c = 0; c < o.n_corner; c++) {
        const double *p = o.corner + 3 * c, *q = o.corner + 3 * ((c + 1) % o.n_corner);
        flat &= fabs(silt_opening_height(&o, p)) <= 1e-6 * o.size;
        convex &= silt_opening_depth(&o, p) >= -1e-9 * o.size && hypot(hypot(q[0] - p[0], q[1] - p[1]), q[2] - p[2]) > 0;
    }
    if (!flat || !convex)
        silt_complain(reader, node, "key 'fluid.%s.%d.corners': found %s, allowed a flat, convex polygon, each corner once", list, i,
                      flat ? "a polygon that is not convex or has no area" : "corners that do not lie in one plane");
}

// the Laplacian's increments are free on an opening: nothing there holds the pressure that the level gives
static void check_level_pressure(silt_reader *reader, const silt_scene *scene) {
    bool level = false;
    for (int k = 0; k < silt_opening_count(scene); k++)
        level |= silt_opening_of(scene, k).level != NULL;
    if (level && scene->fluid.pressure == PRESSURE_LAPLACIAN)
        silt_complain(reader, silt_tree_find(reader->root, "fluid.pressure"),
                      "key 'fluid.pressure': found laplacian beside an opening with a head or level, allowed consistent there");
}

// Still water behind an opening has a level where gravity points down; what gravity has beside that may not lie along the opening,
// or the level would be another one at every place of it.
static void check_level_gravity(silt_reader *reader, const silt_scene *scene, int k) {
    const silt_opening o = silt_opening_of(scene, k);
    const int up = silt_scene_up(scene), i = o.inlet ? k : k - scene->fluid.n_inlet;
    const char *list = o.inlet ? "inlets" : "outlets", *key = o.inlet ? "head" : "level";
    if (!o.level || !(silt_length(3, o.normal) > 0))
        return;
    const silt_tree *node = silt_tree_find(reader->root, "fluid.%s.%d.%s", list, i, key);
    if (scene->gravity[up] >= 0) {
        silt_complain(reader, node, "key 'fluid.%s.%d.%s': found it with a gravity of %.10g along %c, allowed where gravity points down",
                      list, i, key, scene->gravity[up], 'x' + up);
        return;
    }
    double side[3] = {scene->gravity[0], scene->gravity[1], scene->gravity[2]};
    side[up] = 0;
    const double across = silt_dot(3, side, o.normal);
    for (int d = 0; d < 3; d++)
        side[d] -= across * o.normal[d];
    if (silt_length(3, side) > 1e-9 * silt_length(3, scene->gravity))
        silt_complain(reader, node,
                      "key 'fluid.%s.%d.%s': found it where gravity has %.10g m/s2 sideways along the opening, allowed where gravity's "
                      "part besides %c points straight through the opening",
                      list, i, key, silt_length(3, side), 'x' + up);
}

// 1: the opening lies in one of the scene's walls and faces as that does, -1: the other way, 0: it lies in none
static int faces_wall(const silt_scene *scene, const silt_opening *o, const double middle[3]) {
    for (int w = 0; w < scene->n_wall; w++) {
        const silt_wall *wall = &scene->wall[w];
        if (wall->motion.n_row)
            continue;
        const int n_edge = o->dim == 3 ? 0 : wall->closed ? wall->n_point : wall->n_point - 1;
        for (int k = 0; k < n_edge; k++) {
            const double *p = wall->point + 3 * k, *q = wall->point + 3 * ((k + 1) % wall->n_point);
            const double d[2] = {q[0] - p[0], q[1] - p[1]}, at[2] = {middle[0] - p[0], middle[1] - p[1]}, length = hypot(d[0], d[1]);
            const double along = (d[0] * at[0] + d[1] * at[1]) / length, off = (d[0] * at[1] - d[1] * at[0]) / length;
            const double turn = (d[0] * o->normal[1] - d[1] * o->normal[0]) / length;
            if (fabs(off) <= 1e-6 * o->size && along > 0 && along < length && fabs(turn) > 1 - 1e-9)
                return turn > 0 ? 1 : -1;
        }
        for (int face = 0; o->dim == 3 && wall->form == WALL_BOX && face < 6; face++) {
            const int d = face / 2, e = (d + 1) % 3, f = (d + 2) % 3;
            const double at = face % 2 ? wall->hi[d] : wall->lo[d], turn = (face % 2 == 0) == !wall->inside_out ? o->normal[d] : -o->normal[d];
            if (fabs(middle[d] - at) <= 1e-6 * o->size && fabs(turn) > 1 - 1e-9 && middle[e] > wall->lo[e] && middle[e] < wall->hi[e] &&
                middle[f] > wall->lo[f] && middle[f] < wall->hi[f])
                return turn > 0 ? 1 : -1;
        }
    }
    return 0;
}

// an opening faces the water: as the wall does that it lies in, else into the box that walls and water span
static void check_turn(silt_reader *reader, const silt_scene *scene, int k, const double lo[3], const double hi[3]) {
    const silt_opening o = silt_opening_of(scene, k);
    const int i = o.inlet ? k : k - scene->fluid.n_inlet;
    double middle[3] = {0};
    if (!(silt_length(3, o.normal) > 0))
        return;
    for (int d = 0; d < o.dim; d++) {
        for (int c = 0; c < o.n_corner && o.dim == 3; c++)
            middle[d] += o.corner[3 * c + d] / o.n_corner;
        middle[d] += o.dim == 2 ? 0.5 * (o.from[d] + o.to[d]) : 0;
    }
    int faces = faces_wall(scene, &o, middle);
    if (faces == 0 && lo[0] < hi[0]) {
        bool front = true, back = true;
        for (int d = 0; d < o.dim; d++) {
            const double step = 1e-6 * o.size * o.normal[d];
            front &= middle[d] + step >= lo[d] && middle[d] + step <= hi[d];
            back &= middle[d] - step >= lo[d] && middle[d] - step <= hi[d];
        }
        faces = back && !front ? -1 : 0;
    }
    if (faces >= 0)
        return;
    const char *list = o.inlet ? "inlets" : "outlets";
    if (o.dim == 3)
        silt_complain(reader, silt_tree_find(reader->root, "fluid.%s.%d.corners", list, i),
                      "key 'fluid.%s.%d.corners': found corners that turn with their back to the water, allowed counter-clockwise as the "
                      "water in front of the opening sees them",
                      list, i);
    else
        silt_complain(reader, silt_tree_find(reader->root, "fluid.%s.%d.to", list, i),
                      "key 'fluid.%s.%d.to': found the water on the right of the way from `from` to `to`, allowed on its left: swap them",
                      list, i);
}

// grains that are fed are parcels of the bed
static void check_feed(silt_reader *reader, const silt_scene *scene) {
    for (int i = 0; i < scene->fluid.n_inlet; i++)
        if (scene->fluid.inlet[i].grains > 0 && !scene->bed.on)
            silt_complain(reader, silt_tree_find(reader->root, "fluid.inlets.%d.grains", i),
                          "key 'fluid.inlets.%d.grains': found %.10g in a scene without a bed, allowed with one: its density and "
                          "grains.parcel are those of the grains",
                          i, scene->fluid.inlet[i].grains);
}

void silt_scene_check_openings(silt_reader *reader, const silt_scene *scene, const double lo[3], const double hi[3]) {
    const silt_fluid_def *fluid = &scene->fluid;
    int n_in = fluid->n_inlet, n = n_in + fluid->n_outlet;
    check_level_pressure(reader, scene);
    for (int i = 0; i < n; i++) {
        if (scene->dimension == 3)
            check_corners(reader, scene, i);
        check_turn(reader, scene, i, lo, hi);
        check_level_gravity(reader, scene, i);
    }
    check_feed(reader, scene);
    for (int i = 0; i < n_in; i++)
        check_opening(reader, "inlets", i, fluid->inlet[i].from, fluid->inlet[i].to);
    for (int i = 0; i < fluid->n_outlet; i++)
        check_opening(reader, "outlets", i, fluid->outlet[i].from, fluid->outlet[i].to);
    // few: all pairs
    for (int i = 1; i < n && i < 1000; i++)
        for (int k = 0; k < i; k++) {
            const char *a = i < n_in ? fluid->inlet[i].name : fluid->outlet[i - n_in].name;
            const char *b = k < n_in ? fluid->inlet[k].name : fluid->outlet[k - n_in].name;
            if (!a || !b || strcmp(a, b) != 0)
                continue;
            const char *list = i < n_in ? "inlets" : "outlets";
            int at = i < n_in ? i : i - n_in;
            silt_complain(reader, silt_tree_find(reader->root, "fluid.%s.%d.name", list, at),
                          "key 'fluid.%s.%d.name': found the name '%s' again, allowed a name of its own", list, at, a);
            break;
        }
}


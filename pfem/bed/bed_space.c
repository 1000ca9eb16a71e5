// fills the bed's regions in space as the water's are filled: the same seed, the same first mesh, slivers mended

#include "bed_mesh.h"

#define FILL_LATTICE 1.08 // times the spacing: that of nodes on the edges of boxes, which have a body-centred lattice
#define FILL_APART 0.35   // times the spacing: nodes on edges that are nearer to each other are one
#define FILL_ALPHA 1.3 // of the first mesh: cells within regions up to twice that times the spacing

// the scene with the bed in the place of the water
static silt_scene scene_of_bed(const silt_scene *scene) {
    silt_scene own = *scene;
    own.fluid = (silt_fluid_def){.on = true,
                                 .size = bed_size(scene),
                                 .alpha = FILL_ALPHA,
                                 .density = scene->bed.density,
                                 .n_region = scene->bed.n_region,
                                 .region = scene->bed.region};
    own.period[0] = own.period[1] = 0;
    return own;
}

// ---- edges first: a crease that the lattice of another region had nodes beside would be rounded off

// a node on an edge, unless one is near or the place lies deep in another region
static void edge_node(silt_nodes *nodes, const silt_scene *scene, const silt_walls *walls, int region, const double *x, double apart) {
    const double size = bed_size(scene);
    for (int i = 0; i < nodes->count; i++)
        if (bed_apart(3, nodes->x + 3 * i, x) < apart)
            return;
    for (int r = 0; r < scene->bed.n_region; r++)
        if (r != region && silt_region_distance(&scene->bed.region[r], 3, x) < -1e-6 * size)
            return;
    double on[3];
    const int k = silt_nodes_add(nodes, NODE_FLUID, -1, x);
    if (walls->count && silt_walls_touching(walls, x, 1e-6 * size, nodes->wall[k], on))
        memcpy(nodes->x + 3 * k, on, sizeof on);
}

// corner k of a box or of a prism: the first half below, or in front
static void region_corner(const silt_region *region, int n, int k, double x[3]) {
    const int at = k % n;
    if (region->kind == REGION_BOX) {
        x[0] = at == 1 || at == 2 ? region->hi[0] : region->lo[0];
        x[1] = at >= 2 ? region->hi[1] : region->lo[1];
        x[2] = k >= n ? region->hi[2] : region->lo[2];
    } else {
        x[0] = region->point[3 * (size_t)at];
        x[1] = k >= n ? region->hi[1] : region->lo[1];
        x[2] = region->point[3 * (size_t)at + 1];
    }
}

static void seed_edges(silt_nodes *nodes, const silt_scene *scene, const silt_walls *walls) {
    const double size = bed_size(scene);
    for (int pass = 0; pass < 2; pass++) // corners, then what lies between
        for (int r = 0; r < scene->bed.n_region; r++) {
            const silt_region *region = &scene->bed.region[r];
            const int n = region->kind == REGION_BOX ? 4 : region->kind == REGION_POLYGON ? region->n_point : 0;
            const double spacing = size * (region->kind == REGION_BOX ? FILL_LATTICE : 1);
            for (int e = 0; e < 3 * n; e++) {
                double a[3], b[3];
                region_corner(region, n, e < 2 * n ? e : e - 2 * n, a);
                region_corner(region, n, e < n ? (e + 1) % n : e < 2 * n ? n + (e - n + 1) % n : e - n, b);
                const int pieces = (int)silt_max(1, floor(bed_apart(3, a, b) / spacing + 0.5));
                for (int m = pass; m <= (pass ? pieces - 1 : 0); m++) {
                    double x[3];
                    for (int d = 0; d < 3; d++)
                        x[d] = a[d] + (b[d] - a[d]) * m / pieces;
                    edge_node(nodes, scene, walls, r, x, pass ? FILL_APART * size : 1e-6 * size);
                }
            }
        }
}

// The walls' corners are seeded everywhere: those outside of the regions go.
static void drop_corners(silt_nodes *nodes, const silt_scene *scene) {
    uint8_t *dead = silt_alloc((size_t)nodes->count + 1, 1);
    int *map = silt_alloc((size_t)nodes->count + 1, sizeof *map);
    for (int i = 0; i < nodes->count; i++) {
        double off = HUGE_VAL;
        for (int r = 0; r < scene->bed.n_region && nodes->kind[i] == NODE_CORNER; r++)
            off = silt_min(off, silt_region_distance(&scene->bed.region[r], 3, nodes->x + 3 * i));
        dead[i] = nodes->kind[i] == NODE_CORNER && off > 1e-6 * bed_size(scene);
    }
    silt_nodes_compact(nodes, dead, map);
    free(dead);
    free(map);
}

// the mesh's nodes that have cells, and its cells
static void bed_take(silt_bed *bed, const silt_nodes *nodes, const silt_mesh *mesh, double size) {
    int *number = silt_alloc((size_t)nodes->count + 1, sizeof *number);
    for (int i = 0; i < nodes->count; i++) {
        number[i] = -1;
        if (!mesh->wet[i])
            continue;
        const int k = number[i] = silt_bed_node_add(bed, nodes->x + 3 * i);
        double on[3];
        if (bed->walls->count)
            silt_walls_touching(bed->walls, nodes->x + 3 * i, 1e-6 * size, bed->wall[k], on);
        if (nodes->kind[i] == NODE_CORNER)
            bed->corner[k] = nodes->owner[i];
    }
    for (int c = 0; c < mesh->n_cell; c++) {
        const int *cell = mesh->cell[c];
        silt_bed_cell_add(bed, (int[4]){number[cell[0]], number[cell[1]], number[cell[2]], number[cell[3]]}, 0);
    }
    free(number);
}

silt_status silt_bed_fill_space(silt_bed *bed, const silt_scene *scene, silt_error *err) {
    const silt_scene own = scene_of_bed(scene);
    const silt_barrier barrier = {.walls = bed->walls};
    silt_nodes nodes = {.dim = 3};
    silt_mesh mesh = {.dim = 3};
    seed_edges(&nodes, scene, bed->walls);
    silt_nodes_seed(&nodes, &own, bed->walls, NULL, NULL);
    drop_corners(&nodes, scene);
    const silt_status status = silt_mesh_first(&mesh, &nodes, &own, &barrier, err);
    if (status == SILT_OK)
        bed_take(bed, &nodes, &mesh, bed_size(scene));
    silt_mesh_clear(&mesh);
    silt_nodes_clear(&nodes);
    return status;
}

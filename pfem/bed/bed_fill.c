// fills the bed's regions with nodes and cells: outlines first, a triangular lattice between them, Delaunay of all

#include "bed_mesh.h"
#include "delaunay.h"

// nodes as they are found, and the pieces of outline between them that the cells must keep
typedef struct bed_cloud {
    int n_point, point_capacity;
    double (*point)[2];
    int n_piece, piece_capacity;
    int (*piece)[2];
} bed_cloud;

// a straight side of a region
typedef struct bed_side {
    double from[2], to[2];
    int region;
} bed_side;
typedef struct bed_sides {
    int count, capacity;
    bed_side *side;
} bed_sides;

static int cloud_point(bed_cloud *cloud, const double x[2], double close) {
    // regions that touch share their nodes
    for (int i = 0; i < cloud->n_point; i++)
        if (fabs(cloud->point[i][0] - x[0]) <= close && bed_distance(cloud->point[i], x) <= close)
            return i;
    SILT_RESERVE(cloud->point, cloud->point_capacity, cloud->n_point + 1);
    cloud->point[cloud->n_point][0] = x[0];
    cloud->point[cloud->n_point][1] = x[1];
    return cloud->n_point++;
}

static void cloud_piece(bed_cloud *cloud, int a, int b) {
    for (int k = 0; k < cloud->n_piece; k++)
        if ((cloud->piece[k][0] == a && cloud->piece[k][1] == b) ||
            (cloud->piece[k][0] == b && cloud->piece[k][1] == a))
            return;
    SILT_RESERVE(cloud->piece, cloud->piece_capacity, cloud->n_piece + 1);
    cloud->piece[cloud->n_piece][0] = a;
    cloud->piece[cloud->n_piece][1] = b;
    cloud->n_piece++;
}

// ---------------------------------------------------------------- outlines

static int region_corners(const silt_region *region, double size) {
    switch (region->kind) {
    case REGION_BOX:
        return 4;
    case REGION_POLYGON:
        return region->n_point;
    case REGION_CIRCLE:
    case REGION_SPHERE:
        break;
    }
    const double n = 2 * M_PI * region->radius / size;
    return n < 8 ? 8 : (int)lround(n);
}

static void region_corner(const silt_region *region, int n, int k, double x[2]) {
    k %= n;
    if (region->kind == REGION_BOX) {
        x[0] = k == 1 || k == 2 ? region->hi[0] : region->lo[0];
        x[1] = k >= 2 ? region->hi[1] : region->lo[1];
    } else if (region->kind == REGION_POLYGON) {
        x[0] = region->point[3 * (size_t)k];
        x[1] = region->point[3 * (size_t)k + 1];
    } else {
        x[0] = region->centre[0] + region->radius * cos(2 * M_PI * k / n);
        x[1] = region->centre[1] + region->radius * sin(2 * M_PI * k / n);
    }
}

static void sides_collect(bed_sides *sides, const silt_scene *scene) {
    for (int r = 0; r < scene->bed.n_region; r++) {
        const silt_region *region = &scene->bed.region[r];
        const int n = region_corners(region, bed_size(scene));
        for (int k = 0; k < n; k++) {
            SILT_RESERVE(sides->side, sides->capacity, sides->count + 1);
            bed_side *side = &sides->side[sides->count];
            region_corner(region, n, k, side->from);
            region_corner(region, n, k + 1, side->to);
            side->region = r;
            // a corner that is given twice makes no side
            if (bed_distance(side->from, side->to) > 1e-6 * bed_size(scene))
                sides->count++;
        }
    }
}

// where along the side (0 to 1) a point lies that is on it, or -1
static double side_foot(const bed_side *side, const double x[2], double close) {
    const double length = bed_distance(side->from, side->to);
    if (bed_segment_distance(side->from, side->to, x) > close)
        return -1;
    const double s = ((x[0] - side->from[0]) * (side->to[0] - side->from[0]) +
                      (x[1] - side->from[1]) * (side->to[1] - side->from[1])) /
                     (length * length);
    return s * length > close && (1 - s) * length > close ? s : -1;
}

// where the side is properly crossed by another one, or -1
static double side_crossing(const bed_side *side, const bed_side *other) {
    const double a = bed_cross(other->from, other->to, side->from), b = bed_cross(other->from, other->to, side->to);
    const double c = bed_cross(side->from, side->to, other->from), d = bed_cross(side->from, side->to, other->to);
    return a * b < 0 && c * d < 0 ? a / (a - b) : -1;
}

// places along a side, 0 to 1
typedef struct bed_cuts {
    int count, capacity;
    double *at;
} bed_cuts;

static void cuts_add(bed_cuts *cuts, double at) {
    if (at < 0)
        return;
    SILT_RESERVE(cuts->at, cuts->capacity, cuts->count + 1);
    cuts->at[cuts->count++] = at;
}

static int compare_double(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Divides a side evenly between its ends and the places where another region's corner or side, or a wall's corner,
// meets it.
static void side_divide(const bed_side *side, const bed_sides *sides, const silt_scene *scene, bed_cloud *cloud) {
    const double size = bed_size(scene), close = 1e-6 * size;
    bed_cuts cuts = {0};
    cuts_add(&cuts, 1);
    for (int k = 0; k < sides->count; k++)
        if (sides->side[k].region != side->region) {
            cuts_add(&cuts, side_foot(side, sides->side[k].from, close));
            cuts_add(&cuts, side_crossing(side, &sides->side[k]));
        }
    for (int w = 0; w < scene->n_wall; w++)
        for (int k = 0; k < scene->wall[w].n_point; k++)
            cuts_add(&cuts, side_foot(side, bed_wall_point(&scene->wall[w], k), close));
    qsort(cuts.at, (size_t)cuts.count, sizeof *cuts.at, compare_double);

    const double length = bed_distance(side->from, side->to);
    int last = cloud_point(cloud, side->from, close);
    double begin = 0;
    for (int k = 0; k < cuts.count; k++) {
        const double piece = cuts.at[k] - begin;
        if (piece * length <= close)
            continue;
        const long n = lround(silt_max(1, piece * length / size));
        for (long i = 1; i <= n; i++) {
            const double s = i == n ? cuts.at[k] : begin + piece * (double)i / (double)n;
            const double x[2] = {(1 - s) * side->from[0] + s * side->to[0], (1 - s) * side->from[1] + s * side->to[1]};
            const int next = cloud_point(cloud, x, close);
            if (next != last)
                cloud_piece(cloud, last, next);
            last = next;
        }
        begin = cuts.at[k];
    }
    free(cuts.at);
}

// ---------------------------------------------------------------- inside

static void cloud_lattice(bed_cloud *cloud, const bed_sides *sides, const silt_scene *scene, int r) {
    const silt_region *region = &scene->bed.region[r];
    const double size = bed_size(scene);
    double lo[2] = {HUGE_VAL, HUGE_VAL}, hi[2] = {-HUGE_VAL, -HUGE_VAL};
    for (int k = 0; k < sides->count; k++)
        for (int d = 0; d < 2 && sides->side[k].region == r; d++) {
            lo[d] = silt_min(lo[d], sides->side[k].from[d]);
            hi[d] = silt_max(hi[d], sides->side[k].from[d]);
        }
    if (!(hi[0] > lo[0] && hi[1] > lo[1]))
        return;
    // rows are counted from the top, where the water wears; columns are those of a level top
    const int rows = (int)lround(silt_max(1, (hi[1] - lo[1]) / (size * sqrt(0.75))));
    const int columns = (int)lround(silt_max(1, (hi[0] - lo[0]) / size));
    const double high = (hi[1] - lo[1]) / rows, wide = (hi[0] - lo[0]) / columns;
    for (int j = 1; j < rows; j++)
        for (int i = 0; i <= columns; i++) {
            const double x[3] = {lo[0] + (i + 0.5 * (j & 1)) * wide, hi[1] - j * high, 0};
            bool keep = silt_region_contains(region, x);
            for (int q = 0; q < r && keep; q++)
                keep = !silt_region_contains(&scene->bed.region[q], x);
            for (int k = 0; k < sides->count && keep; k++)
                keep = bed_segment_distance(sides->side[k].from, sides->side[k].to, x) >= 0.6 * size;
            if (!keep)
                continue;
            SILT_RESERVE(cloud->point, cloud->point_capacity, cloud->n_point + 1);
            cloud->point[cloud->n_point][0] = x[0];
            cloud->point[cloud->n_point][1] = x[1];
            cloud->n_point++;
        }
}

static int compare_pair(const void *a, const void *b) {
    const int *p = a, *q = b;
    return p[0] != q[0] ? (p[0] > q[0]) - (p[0] < q[0]) : (p[1] > q[1]) - (p[1] < q[1]);
}

// Halves every piece of outline that is no edge of the triangulation. @return how many
static int cloud_mend(bed_cloud *cloud, const int *triangle, int n_triangle) {
    int(*pair)[2] = silt_alloc((size_t)n_triangle * 3, sizeof *pair);
    for (int k = 0; k < 3 * n_triangle; k++) {
        const int a = triangle[k], b = triangle[k % 3 == 2 ? k - 2 : k + 1];
        pair[k][0] = a < b ? a : b;
        pair[k][1] = a < b ? b : a;
    }
    qsort(pair, (size_t)n_triangle * 3, sizeof *pair, compare_pair);
    int halved = 0;
    for (int k = 0, n = cloud->n_piece; k < n; k++) {
        const int a = cloud->piece[k][0], b = cloud->piece[k][1];
        const int key[2] = {a < b ? a : b, a < b ? b : a};
        if (bsearch(key, pair, (size_t)n_triangle * 3, sizeof *pair, compare_pair))
            continue;
        SILT_RESERVE(cloud->point, cloud->point_capacity, cloud->n_point + 1);
        const int middle = cloud->n_point++;
        for (int d = 0; d < 2; d++)
            cloud->point[middle][d] = 0.5 * (cloud->point[a][d] + cloud->point[b][d]);
        cloud->piece[k][1] = middle;
        cloud_piece(cloud, middle, b);
        halved++;
    }
    free(pair);
    return halved;
}

static bool cell_keep(const silt_scene *scene, const double p[2], const double q[2], const double r[2]) {
    // what rounding leaves between nodes on a straight line is no cell
    const double longest = silt_max(bed_distance(p, q), silt_max(bed_distance(q, r), bed_distance(r, p)));
    if (bed_cross(p, q, r) <= 1e-9 * bed_size(scene) * longest)
        return false;
    const double centre[3] = {(p[0] + q[0] + r[0]) / 3, (p[1] + q[1] + r[1]) / 3, 0};
    for (int k = 0; k < scene->bed.n_region; k++)
        if (silt_region_contains(&scene->bed.region[k], centre))
            return true;
    return false;
}

// triangles between outlines and lattice
static silt_status fill_plane(silt_bed *bed, const silt_scene *scene, silt_error *err) {
    const char *path = scene->path ? scene->path : "scene";
    bed_cloud cloud = {0};
    bed_sides sides = {0};
    int *triangle = NULL, n_triangle = 0;
    silt_status status = SILT_OK;
    sides_collect(&sides, scene);
    for (int k = 0; k < sides.count; k++)
        side_divide(&sides.side[k], &sides, scene, &cloud);
    for (int r = 0; r < scene->bed.n_region; r++)
        cloud_lattice(&cloud, &sides, scene, r);

    // the outline must stand in the triangulation: halve what does not, until it does
    for (int round = 0;; round++) {
        free(triangle);
        triangle = NULL;
        if (silt_delaunay_2d(cloud.n_point, cloud.point ? cloud.point[0] : NULL, &triangle, &n_triangle)) {
            status = silt_fail(err, SILT_FAILED, "%s: bed: no memory to triangulate %d nodes", path, cloud.n_point);
            goto out;
        }
        const int halved = cloud_mend(&cloud, triangle, n_triangle);
        if (!halved)
            break;
        if (round == 12) {
            status = silt_fail(err, SILT_INPUT,
                               "%s: bed.regions: an angle or a gap between outlines is too narrow for nodes "
                               "at spacing bed.size = %g m; allowed: outlines that cells of that size can follow",
                               path, bed_size(scene));
            goto out;
        }
    }

    for (int i = 0; i < cloud.n_point; i++)
        silt_bed_node_add(bed, cloud.point[i]);
    for (int k = 0; k < n_triangle; k++) {
        const int *t = triangle + 3 * (size_t)k;
        if (cell_keep(scene, cloud.point[t[0]], cloud.point[t[1]], cloud.point[t[2]])) {
            silt_bed_cell_add(bed, t, 0);
        }
    }
out:
    free(triangle);
    free(sides.side);
    free(cloud.point);
    free(cloud.piece);
    return status;
}

silt_status silt_bed_create(silt_bed *bed, const silt_scene *scene, const silt_walls *walls, silt_error *err) {
    const char *path = scene->path ? scene->path : "scene";
    silt_bed_clear(bed);
    bed->dim = scene->dimension == 3 ? 3 : 2;
    bed->walls = walls;
    silt_bed_index_build(bed);
    silt_status status = SILT_OK;
    if (!(bed_size(scene) > 0))
        status = silt_fail(err, SILT_INPUT, "%s: bed.size: %g found; allowed: a length above 0", path, bed_size(scene));
    else
        status = bed->dim == 3 ? silt_bed_fill_space(bed, scene, err) : fill_plane(bed, scene, err);
    if (status == SILT_OK && bed->n_cell == 0)
        status = silt_fail(err, SILT_INPUT,
                           "%s: bed.regions: %d regions hold no cell of bed.size = %g m; allowed: at least one "
                           "region with %s",
                           path, scene->bed.n_region, bed_size(scene), bed->dim == 3 ? "a volume" : "an area");
    if (status != SILT_OK) {
        silt_bed_clear(bed);
        return status;
    }
    silt_bed_index_build(bed);
    for (int c = 0; c < bed->n_cell; c++) {
        bed->mass[c] = scene->bed.density * (1 - scene->bed.porosity) * bed->area[c];
        for (int a = 0; a <= bed->dim; a++) {
            int facet[3], turned[3];
            bed_facet(bed->dim, bed->cell[c], a, facet);
            bed_facet_turned(facet, turned);
            if (silt_bed_cell_at(bed, turned) < 0)
                silt_bed_edge_add(bed, scene, facet);
        }
    }
    silt_bed_refresh(bed);
    bed->initial_mass = bed->solid_mass;
    bed->n_first = bed->n_node;
    return SILT_OK;
}

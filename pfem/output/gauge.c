// gauges: what the scene wants to know at a place in every step, one or three history columns each

#include "output.h"
#include "parallel.h"

// a point this close to the water's boundary (times fluid.size) is read at the boundary: wall sensors stand on the wall
#define GAUGE_REACH 0.05

struct silt_gauges {
    int n_gauge;
    double *start; // owned, one per gauge: bed level at the start, m
    int node_capacity, cell_capacity;
    int *parent;       // owned, one per node: groups of nodes joined by cells (silt_group_find)
    double *volume;    // owned, one per node: volume of the group at its lowest node, m3
    double (*span)[2]; // owned, one per cell: part of a section in the cell
    int *span_cell;    // owned
    int main;          // lowest node of the largest group, -1
    silt_heap heap;    // of grains
};

silt_status silt_gauges_create(silt_gauges **gauges, const silt_view *start, silt_error *err) {
    (void)err;
    silt_gauges *g = silt_alloc(1, sizeof *g);
    g->n_gauge = start->scene->n_gauge;
    g->start = silt_alloc((size_t)g->n_gauge + 1, sizeof *g->start);
    for (int i = 0; i < g->n_gauge; i++) {
        const silt_gauge_def *def = &start->scene->gauge[i];
        g->start[i] = def->kind == GAUGE_SCOUR && start->bed ? silt_bed_level(start->bed, def->from) : NAN;
    }
    *gauges = g;
    return SILT_OK;
}

void silt_gauges_free(silt_gauges **gauges) {
    silt_gauges *g = *gauges;
    if (!g)
        return;
    free(g->start);
    free(g->parent);
    free(g->volume);
    free(g->span);
    free(g->span_cell);
    silt_heap_clear(&g->heap);
    free(g);
    *gauges = NULL;
}

silt_status silt_gauges_save(const silt_gauges *gauges, silt_store *store, silt_error *err) {
    return silt_store_put(store, "gauges/start", STORE_DOUBLE, (size_t)gauges->n_gauge, gauges->start, err);
}

silt_status silt_gauges_load(silt_gauges *gauges, silt_store *store, silt_error *err) {
    return silt_store_take(store, "gauges/start", STORE_DOUBLE, (size_t)gauges->n_gauge, gauges->start, err);
}

// names of the columns of a gauge that has more than one
int silt_gauge_columns(const silt_scene *scene, int i) {
    switch (scene->gauge[i].kind) {
    case GAUGE_VELOCITY:
    case GAUGE_FORCE:
    case GAUGE_CENTROID:
    case GAUGE_GRAIN_PLACE:
    case GAUGE_GRAIN_VELOCITY:
    case GAUGE_GRAIN_SPIN:
    case GAUGE_GRAIN_FORCE:
        return 3;
    case GAUGE_GRAINS:
        return 4;
    case GAUGE_ANGULAR:
        return scene->dimension == 3 ? 3 : 1;
    default:
        return 1;
    }
}

void silt_gauge_column(const silt_scene *scene, int i, int k, char name[64]) {
    if (silt_gauge_columns(scene, i) == 1)
        snprintf(name, 64, "%.60s", scene->gauge[i].name);
    else
        snprintf(name, 64, "%.60s_%c", scene->gauge[i].name, "xyzm"[k]);
}

int silt_gauges_count(const silt_scene *scene) {
    int count = 0;
    for (int i = 0; i < scene->n_gauge; i++)
        count += silt_gauge_columns(scene, i);
    return count;
}

void silt_gauges_name(const silt_scene *scene, int column, char name[64]) {
    name[0] = 0;
    for (int i = 0; i < scene->n_gauge; i++) {
        int n = silt_gauge_columns(scene, i);
        if (column < n) {
            silt_gauge_column(scene, i, column, name);
            return;
        }
        column -= n;
    }
}

// ---------------------------------------------------------------- connected water

// cells that share nodes belong together; the group with the largest volume is the water, the rest is spray
static void gauge_connect(silt_gauges *g, const silt_view *view) {
    const silt_mesh *mesh = view->mesh;
    int n = mesh->n_node, capacity = g->node_capacity;
    SILT_RESERVE(g->parent, capacity, n + 1);
    SILT_RESERVE(g->volume, g->node_capacity, n + 1);
    for (int i = 0; i < n; i++) {
        g->parent[i] = i;
        g->volume[i] = 0;
    }
    for (int i = 0; i < mesh->n_cell; i++)
        silt_group_join(g->parent, mesh->cell[i]);
    g->main = -1;
    for (int i = 0; i < mesh->n_cell; i++)
        g->volume[silt_group_find(g->parent, mesh->cell[i][0])] += silt_cell_volume(mesh, view->nodes->x, i);
    for (int i = 0; i < n; i++)
        if (g->volume[i] > 0 && (g->main < 0 || g->volume[i] > g->volume[g->main]))
            g->main = i;
}

// the largest coordinate of connected water along an axis in the direction of the sign
static double gauge_reach(silt_gauges *g, const silt_view *view, int axis, double sign) {
    const int dim = silt_nodes_dim(view->nodes);
    double best = -HUGE_VAL;
    for (int i = 0; i < view->mesh->n_node; i++)
        if (view->mesh->wet[i] && silt_group_find(g->parent, i) == g->main)
            best = silt_max(best, sign * view->nodes->x[dim * i + axis]);
    return best > -HUGE_VAL ? sign * best : NAN;
}

// corners of a facet, dim numbers each, on the side of a periodic border where the point is
static void gauge_facet(const silt_view *view, int facet, const double *point, double *corner) {
    const silt_mesh *mesh = view->mesh;
    const int dim = silt_nodes_dim(view->nodes);
    for (int a = 0; a < dim; a++)
        for (int d = 0; d < dim; d++) {
            double x = view->nodes->x[dim * mesh->facet[facet][a] + d], near = a ? corner[d] : point[d];
            if (mesh->period[d] > 0)
                x -= mesh->period[d] * floor((x - near) / mesh->period[d] + 0.5);
            corner[dim * a + d] = x;
        }
}

// where the vertical line through the point meets a facet; false: nowhere
static bool gauge_cross(int dim, const double *corner, const double *point, double *top) {
    const double *a = corner, *b = corner + dim, *c = corner + 2 * dim;
    if (dim == 2) {
        if (point[0] < silt_min(a[0], b[0]) || point[0] > silt_max(a[0], b[0]))
            return false;
        *top = a[0] == b[0] ? silt_max(a[1], b[1]) : a[1] + (b[1] - a[1]) * (point[0] - a[0]) / (b[0] - a[0]);
        return true;
    }
    // upright faces are left to their neighbours
    const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    const double u = (point[0] - a[0]) * (c[1] - a[1]) - (point[1] - a[1]) * (c[0] - a[0]);
    const double v = (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]);
    const double slack = 1e-12 * fabs(area);
    if (area == 0 || u / area < -slack || v / area < -slack || (u + v) / area > 1 + slack)
        return false;
    *top = a[2] + (b[2] - a[2]) * u / area + (c[2] - a[2]) * v / area;
    return true;
}

// highest point of the boundary of connected water on a vertical line
static double gauge_height(silt_gauges *g, const silt_view *view, const double point[3]) {
    const int dim = silt_nodes_dim(view->nodes);
    double best = -HUGE_VAL, corner[9], top;
    for (int i = 0; i < view->mesh->n_facet; i++) {
        gauge_facet(view, i, (const double[3]){point[0], dim == 3 ? point[1] : 0, 0}, corner);
        if (gauge_cross(dim, corner, point, &top) && silt_group_find(g->parent, view->mesh->facet[i][0]) == g->main)
            best = silt_max(best, top);
    }
    return best > -HUGE_VAL ? best : NAN;
}

// Length of a vertical line in the water: where it leaves less where it enters. The line stands a little beside the point, so that
// it meets no edge, which two facets share.
static double gauge_depth(const silt_view *view, const double point[3]) {
    const int dim = silt_nodes_dim(view->nodes);
    const double aside = 1e-7 * view->scene->fluid.size;
    const double line[3] = {point[0] + 0.83 * aside, dim == 3 ? point[1] + 0.57 * aside : 0, 0};
    double sum = 0, corner[9], z;
    for (int i = 0; i < view->mesh->n_facet; i++) {
        gauge_facet(view, i, line, corner);
        if (!gauge_cross(dim, corner, line, &z))
            continue;
        const double *a = corner, *b = corner + dim, *c = corner + 2 * dim;
        const bool top = dim == 2 ? b[0] < a[0] : (b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0]);
        sum += top ? z : -z;
    }
    return sum;
}

// ---------------------------------------------------------------- integrals

// m3, water of a cell without the grains' share
static double gauge_water_volume(const silt_nodes *nodes, const silt_mesh *mesh, const double *solid, int e) {
    const int corners = silt_nodes_dim(nodes) + 1;
    double open = 1;
    for (int a = 0; solid && a < corners; a++)
        open -= solid[mesh->cell[e][a]] / corners;
    return open * silt_cell_volume(mesh, nodes->x, e);
}

static void gauge_turn(int dim, double mass, const double *x, const double *v, const double about[3],
                       double moment[3]) {
    const double z = dim == 3 ? x[2] - about[2] : 0, w = dim == 3 ? v[2] : 0;
    const double arm[3] = {x[0] - about[0], x[1] - about[1], z};
    moment[0] += mass * (arm[1] * w - arm[2] * v[1]);
    moment[1] += mass * (arm[2] * v[0] - arm[0] * w);
    moment[2] += mass * (arm[0] * v[1] - arm[1] * v[0]);
}

void silt_water_moment(const silt_nodes *nodes, const silt_mesh *mesh, const double *solid, double density,
                       const double about[3], double moment[3]) {
    const int dim = silt_nodes_dim(nodes);
    const int n = mesh->n_cell;
    double part[CHUNK_MOST][3] = {{0}};
    moment[0] = moment[1] = moment[2] = 0;
    SILT_PARALLEL(n)
    for (int c = 0; c < silt_chunks(n); c++)
        for (int e = silt_chunk_first(n, c); e < silt_chunk_first(n, c + 1); e++) {
            double corner[12];
            const double share = density * gauge_water_volume(nodes, mesh, solid, e) / (dim + 1);
            silt_cell_corners(mesh, nodes->x, mesh->cell[e], corner);
            for (int a = 0; a <= dim; a++)
                gauge_turn(dim, share, corner + dim * a, nodes->v + dim * mesh->cell[e][a], about, part[c]);
        }
    for (int c = 0; c < silt_chunks(n); c++)
        for (int d = 0; d < 3; d++)
            moment[d] += part[c][d];
    for (int i = 0; i < nodes->count && nodes->debt; i++)
        if (!mesh->wet[i])
            gauge_turn(dim, density * nodes->debt[i], nodes->x + dim * i, nodes->v + dim * i, about, moment);
}

static void gauge_centroid(const silt_view *view, double value[3]) {
    const silt_nodes *nodes = view->nodes;
    const int dim = silt_nodes_dim(nodes);
    double sum[3] = {0, 0, 0}, total = 0;
    for (int e = 0; e < view->mesh->n_cell; e++) {
        double corner[12];
        const double volume = gauge_water_volume(nodes, view->mesh, view->solid, e);
        silt_cell_corners(view->mesh, nodes->x, view->mesh->cell[e], corner);
        total += volume;
        for (int a = 0; a <= dim; a++)
            for (int d = 0; d < dim; d++)
                sum[d] += volume * corner[dim * a + d] / (dim + 1);
    }
    for (int i = 0; i < nodes->count && nodes->debt; i++) {
        if (view->mesh->wet[i])
            continue;
        total += nodes->debt[i];
        for (int d = 0; d < dim; d++)
            sum[d] += nodes->debt[i] * nodes->x[dim * i + d];
    }
    for (int d = 0; d < 3; d++)
        value[d] = total > 0 ? sum[d] / total : NAN;
}

// a = G^-1 b for up to three unit vectors; a pinch on the diagonal shares evenly what parallel ones have in common
static void gauge_parts(int n, const double (*normal)[3], const double r[3], double part[3]) {
    double g[3][4];
    for (int i = 0; i < n; i++) {
        g[i][n] = normal[i][0] * r[0] + normal[i][1] * r[1] + normal[i][2] * r[2];
        for (int j = 0; j < n; j++)
            g[i][j] = normal[i][0] * normal[j][0] + normal[i][1] * normal[j][1] + normal[i][2] * normal[j][2];
        g[i][i] += 1e-9;
    }
    for (int k = 0; k < n; k++)
        for (int i = k + 1; i < n; i++) {
            const double f = g[i][k] / g[k][k];
            for (int j = k; j <= n; j++)
                g[i][j] -= f * g[k][j];
        }
    for (int i = n - 1; i >= 0; i--) {
        part[i] = g[i][n];
        for (int j = i + 1; j < n; j++)
            part[i] -= g[i][j] * part[j];
        part[i] /= g[i][i];
    }
}

void silt_wall_forces(const silt_walls *walls, const silt_nodes *nodes, const silt_mesh *mesh, const double *reaction,
                      double (*force)[3]) {
    const int dim = silt_nodes_dim(nodes);
    memset(force, 0, (size_t)walls->n_wall * sizeof *force);
    for (int i = 0; i < mesh->n_node; i++) {
        int element[3] = {nodes->wall[i][0], nodes->wall[i][1], nodes->wall[i][2]}, n = 0;
        if (!mesh->wet[i])
            continue;
        // a corner in 2-D stands at the end of its segment
        if (element[0] < 0 && nodes->kind[i] == NODE_CORNER) {
            element[0] = nodes->owner[i];
            element[1] = dim == 2 && element[0] >= 0 ? walls->next[element[0]] : -1;
        }
        // one normal for every wall of the scene that holds the node
        double normal[3][3], part[3], r[3] = {0, 0, 0};
        int wall[3];
        for (int k = 0; k < 3; k++) {
            bool known = element[k] < 0;
            for (int j = 0; j < n && !known; j++)
                known = wall[j] == walls->wall[element[k]];
            if (known)
                continue;
            memcpy(normal[n], walls->normal[element[k]], sizeof normal[n]);
            wall[n++] = walls->wall[element[k]];
        }
        memcpy(r, reaction + dim * i, (size_t)dim * sizeof *r);
        if (n > 1)
            gauge_parts(n, normal, r, part);
        for (int k = 0; n > 1 && k < n; k++)
            for (int d = 0; d < 3; d++) {
                force[wall[k]][d] -= part[k] * normal[k][d];
                r[d] -= part[k] * normal[k][d];
            }
        for (int k = 0; k < n; k++)
            for (int d = 0; d < 3; d++)
                force[wall[k]][d] -= r[d] / n;
    }
}

// ---------------------------------------------------------------- points and sections

static double gauge_dot(int dim, const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + (dim == 3 ? a[2] * b[2] : 0);
}

// weights of the point of a segment (n = 2) or triangle (n = 3) that is nearest to a point; @return its distance
// squared
static double gauge_nearest(int dim, int n, const double *corner, const double *point, double *weight) {
    double e[2][3] = {{0}}, r[3] = {0}, g[2][2] = {{0}}, b[2] = {0};
    for (int k = 1; k < n; k++)
        for (int d = 0; d < dim; d++)
            e[k - 1][d] = corner[dim * k + d] - corner[d];
    for (int d = 0; d < dim; d++)
        r[d] = point[d] - corner[d];
    for (int i = 0; i < n - 1; i++) {
        b[i] = gauge_dot(dim, e[i], r);
        for (int j = 0; j < n - 1; j++)
            g[i][j] = gauge_dot(dim, e[i], e[j]);
    }
    if (n == 2) {
        weight[1] = g[0][0] > 0 ? silt_clamp(b[0] / g[0][0], 0, 1) : 0;
        weight[0] = 1 - weight[1];
    } else {
        const double det = g[0][0] * g[1][1] - g[0][1] * g[1][0];
        weight[1] = det > 0 ? (b[0] * g[1][1] - b[1] * g[0][1]) / det : -1;
        weight[2] = det > 0 ? (b[1] * g[0][0] - b[0] * g[0][1]) / det : -1;
        weight[0] = 1 - weight[1] - weight[2];
        if (weight[0] < 0 || weight[1] < 0 || weight[2] < 0) {
            // outside: the nearest of its edges
            double best = HUGE_VAL;
            for (int k = 0; k < 3; k++) {
                double edge[6], w[2];
                memcpy(edge, corner + 3 * k, 3 * sizeof *edge);
                memcpy(edge + 3, corner + 3 * ((k + 1) % 3), 3 * sizeof *edge);
                const double distance = gauge_nearest(3, 2, edge, point, w);
                if (distance >= best)
                    continue;
                best = distance;
                weight[k] = w[0], weight[(k + 1) % 3] = w[1], weight[(k + 2) % 3] = 0;
            }
            return best;
        }
    }
    double distance = 0;
    for (int d = 0; d < dim; d++) {
        double at = 0;
        for (int k = 0; k < n; k++)
            at += weight[k] * corner[dim * k + d];
        distance += silt_square(at - point[d]);
    }
    return distance;
}

// the cell's nodes and weights at a point, or those of the nearest boundary facet within reach; unused weights are 0
static bool gauge_point(const silt_view *view, const double point[3], int node[4], double weight[4]) {
    const int dim = silt_nodes_dim(view->nodes);
    weight[3] = 0;
    int cell = silt_locate(view->locator, view->mesh, view->nodes->x, point, weight);
    if (cell >= 0) {
        memcpy(node, view->mesh->cell[cell], 4 * sizeof *node);
        node[3] = dim == 3 ? node[3] : node[0];
        return true;
    }
    double best = silt_square(GAUGE_REACH * view->scene->fluid.size);
    bool found = false;
    for (int i = 0; i < view->mesh->n_facet; i++) {
        double corner[9], w[4] = {0};
        gauge_facet(view, i, point, corner);
        const double distance = gauge_nearest(dim, dim, corner, point, w);
        if (distance > best)
            continue;
        best = distance;
        found = true;
        memcpy(weight, w, sizeof w);
        for (int k = 0; k < 4; k++)
            node[k] = view->mesh->facet[i][k < dim ? k : 0];
    }
    return found;
}

// part [s0, s1] of the segment from-to inside the triangle; false when there is none
static bool gauge_clip(const double x[6], const double from[2], const double to[2], double s[2]) {
    s[0] = 0, s[1] = 1;
    for (int k = 0; k < 3; k++) {
        const double *a = x + 2 * k, *b = x + 2 * ((k + 1) % 3);
        double nx = a[1] - b[1], ny = b[0] - a[0]; // inward
        double f = nx * (from[0] - a[0]) + ny * (from[1] - a[1]), t = nx * (to[0] - a[0]) + ny * (to[1] - a[1]);
        if (f < 0 && t < 0)
            return false;
        if (f < 0)
            s[0] = silt_max(s[0], f / (f - t));
        else if (t < 0)
            s[1] = silt_min(s[1], f / (f - t));
    }
    return s[1] > s[0];
}

// corners of a triangle, on the side of a periodic border where the section's start is
static void gauge_corners(const silt_view *view, int e, const double from[2], double x[6]) {
    silt_cell_corners(view->mesh, view->nodes->x, view->mesh->cell[e], x);
    for (int d = 0; d < 2; d++) {
        const double period = view->mesh->period[d];
        const double shift = period > 0 ? period * floor((x[d] - from[d]) / period + 0.5) : 0;
        for (int k = 0; shift != 0 && k < 3; k++)
            x[2 * k + d] -= shift;
    }
}

// flux of water (porosity times velocity) through the part s of the segment in the cell; linear fields times linear:
// Simpson
static double gauge_flux(const silt_view *view, int e, const silt_gauge_def *def, double s0, double s1) {
    const double *v = view->nodes->v;
    const int *cell = view->mesh->cell[e];
    double x[6], flux = 0, dx = def->to[0] - def->from[0], dy = def->to[1] - def->from[1];
    gauge_corners(view, e, def->from, x);
    const double area = (x[2] - x[0]) * (x[5] - x[1]) - (x[3] - x[1]) * (x[4] - x[0]);
    for (int j = 0; j < 3; j++) {
        double s = s0 + 0.5 * j * (s1 - s0), px = def->from[0] + s * dx, py = def->from[1] + s * dy;
        double vx = 0, vy = 0, open = 1;
        for (int k = 0; k < 3; k++) {
            const double *a = x + 2 * ((k + 1) % 3), *b = x + 2 * ((k + 2) % 3);
            double w = ((b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0])) / area;
            vx += w * v[2 * cell[k]];
            vy += w * v[2 * cell[k] + 1];
            open -= view->solid ? w * view->solid[cell[k]] : 0;
        }
        // from left to right: along (dy, -dx)
        flux += (j == 1 ? 4 : 1) / 6.0 * open * (vx * dy - vy * dx);
    }
    return flux * (s1 - s0);
}

// the same of Darcy's velocity in a cell of the bed
static double gauge_seepage(const silt_bed *bed, int c, const silt_gauge_def *def, double s0, double s1) {
    const double dx = def->to[0] - def->from[0], dy = def->to[1] - def->from[1];
    return (bed->darcy[2 * c] * dy - bed->darcy[2 * c + 1] * dx) * (s1 - s0);
}

static double gauge_discharge(silt_gauges *g, const silt_view *view, const silt_gauge_def *def) {
    const silt_bed *bed = view->bed && view->bed->darcy ? view->bed : NULL;
    const int n_water = view->mesh->n_cell, n_cell = n_water + (bed ? bed->n_cell : 0); // those of the bed come after the water's
    int n = 0, capacity = g->cell_capacity;
    if (silt_nodes_dim(view->nodes) == 3)
        return NAN;
    SILT_RESERVE(g->span, capacity, n_cell + 1);
    SILT_RESERVE(g->span_cell, g->cell_capacity, n_cell + 1);
    // a section crosses few cells: kept in rising order by insertion
    for (int i = 0; i < n_cell; i++) {
        double s[2], x[6];
        if (i < n_water)
            gauge_corners(view, i, def->from, x);
        else
            for (int a = 0; a < 3; a++)
                memcpy(x + 2 * a, bed->x[bed->cell[i - n_water][a]], 2 * sizeof *x);
        if (!gauge_clip(x, def->from, def->to, s))
            continue;
        int j = n++;
        for (; j > 0 && g->span[j - 1][0] > s[0]; j--) {
            memcpy(g->span[j], g->span[j - 1], sizeof g->span[j]);
            g->span_cell[j] = g->span_cell[j - 1];
        }
        g->span[j][0] = s[0], g->span[j][1] = s[1];
        g->span_cell[j] = i;
    }
    // what two cells share, when the section runs along an edge, counts once
    double flux = 0, covered = 0;
    for (int j = 0; j < n; j++) {
        double s0 = silt_max(g->span[j][0], covered), s1 = g->span[j][1];
        const int i = g->span_cell[j];
        if (s1 > s0)
            flux += i < n_water ? gauge_flux(view, i, def, s0, s1) : gauge_seepage(bed, i - n_water, def, s0, s1);
        covered = silt_max(covered, s1);
    }
    return flux;
}

// mean velocity by mass, and mass, of the grains in a box
static void gauge_grains(const silt_view *view, const silt_gauge_def *def, double value[4]) {
    const silt_grain_state *grains = view->grains;
    double sum[4] = {0};
    for (int k = 0; grains && k < grains->count; k++) {
        bool inside = true;
        for (int d = 0; d < view->scene->dimension; d++)
            inside = inside && grains->x[3 * k + d] >= def->from[d] && grains->x[3 * k + d] <= def->to[d];
        for (int d = 0; d < 3 && inside; d++)
            sum[d] += grains->mass[k] * grains->v[3 * k + d];
        sum[3] += inside ? grains->mass[k] : 0;
    }
    for (int d = 0; d < 3; d++)
        value[d] = sum[3] > 0 ? sum[d] / sum[3] : NAN;
    value[3] = sum[3];
}

// ---------------------------------------------------------------- all gauges

static void gauge_water(silt_gauges *g, const silt_view *view, const silt_gauge_def *def, double *value) {
    const int dim = silt_nodes_dim(view->nodes), axis = (int)def->from[0];
    int node[4];
    double weight[4], moment[3];
    switch (def->kind) {
    case GAUGE_FRONT:
        value[0] = gauge_reach(g, view, 0, def->from[0]);
        break;
    case GAUGE_HEIGHT:
        value[0] = gauge_height(g, view, def->from);
        break;
    case GAUGE_DEPTH:
        value[0] = gauge_depth(view, def->from);
        break;
    case GAUGE_EXTENT:
        value[0] = gauge_reach(g, view, axis, 1) - gauge_reach(g, view, axis, -1);
        break;
    case GAUGE_WETTED:
        value[0] = gauge_point(view, def->from, node, weight);
        break;
    case GAUGE_PRESSURE:
        if (gauge_point(view, def->from, node, weight)) {
            value[0] = 0;
            for (int k = 0; k < 4; k++)
                value[0] += weight[k] * view->nodes->p[node[k]];
        } else if (view->bed)
            silt_seep_pressure_at(view->bed, def->from, value);
        break;
    case GAUGE_VELOCITY:
        if (gauge_point(view, def->from, node, weight)) {
            value[0] = value[1] = value[2] = 0;
            for (int k = 0; k < 4; k++)
                for (int d = 0; d < dim; d++)
                    value[d] += weight[k] * view->nodes->v[dim * node[k] + d];
        }
        break;
    case GAUGE_DISCHARGE:
        value[0] = gauge_discharge(g, view, def);
        break;
    case GAUGE_FORCE:
        if (view->wall_force)
            memcpy(value, view->wall_force[def->index], 3 * sizeof *value);
        break;
    case GAUGE_ANGULAR:
        silt_water_moment(view->nodes, view->mesh, view->solid, view->scene->fluid.density, def->from, moment);
        memcpy(value, dim == 3 ? moment : moment + 2, (dim == 3 ? 3 : 1) * sizeof *value);
        break;
    case GAUGE_CENTROID:
        gauge_centroid(view, value);
        break;
    default:
        break;
    }
}

void silt_gauges_read(silt_gauges *gauges, const silt_view *view, double *value) {
    bool water = view->nodes && view->mesh && view->locator, connected = false, heap = false;
    for (int i = 0; i < gauges->n_gauge; i++) {
        const silt_gauge_def *def = &view->scene->gauge[i];
        int n = silt_gauge_columns(view->scene, i);
        for (int k = 0; k < n; k++)
            value[k] = NAN;
        if (def->kind == GAUGE_BED_LEVEL || def->kind == GAUGE_SCOUR) {
            double level = view->bed ? silt_bed_level(view->bed, def->from) : -HUGE_VAL;
            if (level > -HUGE_VAL)
                value[0] = def->kind == GAUGE_SCOUR ? gauges->start[i] - level : level;
        } else if (def->kind == GAUGE_BED_LOWEST) {
            const double level = view->bed ? silt_bed_lowest(view->bed, def->from[0], def->from[1]) : HUGE_VAL;
            if (level < HUGE_VAL)
                value[0] = level;
        } else if (def->kind >= GAUGE_GRAIN_PLACE && def->kind <= GAUGE_GRAIN_FORCE) {
            silt_grain_gauge(view, def, value);
        } else if (def->kind >= GAUGE_GRAIN_FRONT && def->kind <= GAUGE_GRAIN_SLOPE) {
            if (!heap)
                silt_heap_find(&gauges->heap, view);
            heap = true;
            value[0] = silt_heap_gauge(&gauges->heap, view, def);
        } else if (def->kind == GAUGE_GRAINS) {
            gauge_grains(view, def, value);
        } else if (water) {
            if (!connected && (def->kind == GAUGE_FRONT || def->kind == GAUGE_HEIGHT || def->kind == GAUGE_EXTENT)) {
                gauge_connect(gauges, view);
                connected = true;
            }
            gauge_water(gauges, view, def, value);
        }
        value += n;
    }
}

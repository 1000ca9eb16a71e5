// gauges: what the scene wants to know at a place in every step, one or three history columns each

#include "output.h"

// a point this close to the water's boundary (times fluid.size) is read at the boundary: wall sensors stand on the wall
#define GAUGE_REACH 0.05

struct silt_gauges {
    int n_gauge;
    double *start; // owned, one per gauge: bed level at the start, m
    int node_capacity, cell_capacity;
    int *parent;       // owned, one per node: union-find forest of the cells' nodes
    double *area;      // owned, one per node: area of the component at its root, m2
    double (*span)[2]; // owned, one per cell: part of a section in the cell
    int *span_cell;    // owned
    int main;          // root of the largest component, -1
};

silt_status silt_gauges_create(silt_gauges **gauges, const silt_view *start, silt_error *err) {
    (void)err;
    silt_gauges *g = silt_alloc(1, sizeof *g);
    g->n_gauge = start->scene->n_gauge;
    g->start = silt_alloc((size_t)g->n_gauge + 1, sizeof *g->start);
    for (int i = 0; i < g->n_gauge; i++) {
        const silt_gauge_def *def = &start->scene->gauge[i];
        g->start[i] = def->kind == GAUGE_SCOUR && start->bed ? silt_bed_level(start->bed, def->from[0]) : NAN;
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
    free(g->area);
    free(g->span);
    free(g->span_cell);
    free(g);
    *gauges = NULL;
}

silt_status silt_gauges_save(const silt_gauges *gauges, silt_store *store, silt_error *err) {
    return silt_store_put(store, "gauges/start", STORE_DOUBLE, (size_t)gauges->n_gauge, gauges->start, err);
}

silt_status silt_gauges_load(silt_gauges *gauges, silt_store *store, silt_error *err) {
    return silt_store_take(store, "gauges/start", STORE_DOUBLE, (size_t)gauges->n_gauge, gauges->start, err);
}

static int gauge_columns(const silt_gauge_def *def) {
    return def->kind == GAUGE_VELOCITY ? 3 : 1;
}

int silt_gauges_count(const silt_scene *scene) {
    int count = 0;
    for (int i = 0; i < scene->n_gauge; i++)
        count += gauge_columns(&scene->gauge[i]);
    return count;
}

void silt_gauges_name(const silt_scene *scene, int column, char name[64]) {
    name[0] = 0;
    for (int i = 0; i < scene->n_gauge; i++) {
        const silt_gauge_def *def = &scene->gauge[i];
        int n = gauge_columns(def);
        if (column < n) {
            if (n == 1)
                snprintf(name, 64, "%.60s", def->name);
            else
                snprintf(name, 64, "%.60s_%c", def->name, "xyz"[column]);
            return;
        }
        column -= n;
    }
}

// ---------------------------------------------------------------- connected water

static int gauge_root(int *parent, int i) {
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    return i;
}

static double gauge_cell_area(const double *x, const int cell[3]) {
    const double *a = x + 2 * cell[0], *b = x + 2 * cell[1], *c = x + 2 * cell[2];
    return 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
}

// cells that share nodes belong together; the component with the largest area is the water, the rest is spray
static void gauge_connect(silt_gauges *g, const silt_view *view) {
    const silt_mesh *mesh = view->mesh;
    int n = mesh->n_node, capacity = g->node_capacity;
    SILT_RESERVE(g->parent, capacity, n + 1);
    SILT_RESERVE(g->area, g->node_capacity, n + 1);
    for (int i = 0; i < n; i++) {
        g->parent[i] = i;
        g->area[i] = 0;
    }
    for (int i = 0; i < mesh->n_cell; i++) {
        // the smaller index becomes the root, whatever the order of the cells
        for (int k = 1; k < 3; k++) {
            int a = gauge_root(g->parent, mesh->cell[i][0]), b = gauge_root(g->parent, mesh->cell[i][k]);
            g->parent[a > b ? a : b] = a > b ? b : a;
        }
    }
    g->main = -1;
    for (int i = 0; i < mesh->n_cell; i++)
        g->area[gauge_root(g->parent, mesh->cell[i][0])] += gauge_cell_area(view->nodes->x, mesh->cell[i]);
    for (int i = 0; i < n; i++)
        if (g->area[i] > 0 && (g->main < 0 || g->area[i] > g->area[g->main]))
            g->main = i;
}

static double gauge_front(silt_gauges *g, const silt_view *view, double sign) {
    double best = -HUGE_VAL;
    for (int i = 0; i < view->mesh->n_node; i++)
        if (view->mesh->wet[i] && gauge_root(g->parent, i) == g->main)
            best = silt_max(best, sign * view->nodes->x[2 * i]);
    return best > -HUGE_VAL ? sign * best : NAN;
}

// highest point of the boundary of connected water on the vertical line at x
static double gauge_height(silt_gauges *g, const silt_view *view, double x) {
    double top = -HUGE_VAL;
    for (int i = 0; i < view->mesh->n_facet; i++) {
        const int *edge = view->mesh->facet[i];
        const double *a = view->nodes->x + 2 * edge[0], *b = view->nodes->x + 2 * edge[1];
        if (x < silt_min(a[0], b[0]) || x > silt_max(a[0], b[0]) || gauge_root(g->parent, edge[0]) != g->main)
            continue;
        double y = a[0] == b[0] ? silt_max(a[1], b[1]) : a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0]);
        top = silt_max(top, y);
    }
    return top > -HUGE_VAL ? top : NAN;
}

// ---------------------------------------------------------------- points and sections

// the cell's nodes and weights at a point, or those of the nearest boundary edge within reach
static bool gauge_point(const silt_view *view, const double point[2], int node[3], double weight[3]) {
    const double *x = view->nodes->x;
    int cell = silt_locate(view->locator, view->mesh, x, point, weight);
    if (cell >= 0) {
        memcpy(node, view->mesh->cell[cell], 3 * sizeof *node);
        return true;
    }
    double best = silt_square(GAUGE_REACH * view->scene->fluid.size);
    bool found = false;
    for (int i = 0; i < view->mesh->n_facet; i++) {
        const int *edge = view->mesh->facet[i];
        const double *a = x + 2 * edge[0], *b = x + 2 * edge[1];
        double ex = b[0] - a[0], ey = b[1] - a[1];
        double s = ((point[0] - a[0]) * ex + (point[1] - a[1]) * ey) / (ex * ex + ey * ey);
        s = silt_clamp(s, 0, 1);
        double distance = silt_square(a[0] + s * ex - point[0]) + silt_square(a[1] + s * ey - point[1]);
        if (distance > best)
            continue;
        best = distance;
        found = true;
        node[0] = edge[0], node[1] = node[2] = edge[1];
        weight[0] = 1 - s, weight[1] = s, weight[2] = 0;
    }
    return found;
}

// part [s0, s1] of the segment from-to inside the triangle; false when there is none
static bool gauge_clip(const double *x, const int cell[3], const double from[2], const double to[2], double s[2]) {
    s[0] = 0, s[1] = 1;
    for (int k = 0; k < 3; k++) {
        const double *a = x + 2 * cell[k], *b = x + 2 * cell[(k + 1) % 3];
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

// flux of water (porosity times velocity) through the part s of the segment in the cell; linear fields times linear:
// Simpson
static double gauge_flux(const silt_view *view, const int cell[3], const silt_gauge_def *def, double s0, double s1) {
    const double *x = view->nodes->x, *v = view->nodes->v;
    double area = 2 * gauge_cell_area(x, cell), flux = 0;
    double dx = def->to[0] - def->from[0], dy = def->to[1] - def->from[1];
    for (int j = 0; j < 3; j++) {
        double s = s0 + 0.5 * j * (s1 - s0), px = def->from[0] + s * dx, py = def->from[1] + s * dy;
        double vx = 0, vy = 0, open = 1;
        for (int k = 0; k < 3; k++) {
            const double *a = x + 2 * cell[(k + 1) % 3], *b = x + 2 * cell[(k + 2) % 3];
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

static double gauge_discharge(silt_gauges *g, const silt_view *view, const silt_gauge_def *def) {
    const silt_mesh *mesh = view->mesh;
    int n = 0, capacity = g->cell_capacity;
    SILT_RESERVE(g->span, capacity, mesh->n_cell + 1);
    SILT_RESERVE(g->span_cell, g->cell_capacity, mesh->n_cell + 1);
    // a section crosses few cells: kept in rising order by insertion
    for (int i = 0; i < mesh->n_cell; i++) {
        double s[2];
        if (!gauge_clip(view->nodes->x, mesh->cell[i], def->from, def->to, s))
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
        if (s1 > s0)
            flux += gauge_flux(view, mesh->cell[g->span_cell[j]], def, s0, s1);
        covered = silt_max(covered, s1);
    }
    return flux;
}

// ---------------------------------------------------------------- all gauges

static void gauge_water(silt_gauges *g, const silt_view *view, const silt_gauge_def *def, double *value) {
    int node[3];
    double weight[3];
    switch (def->kind) {
    case GAUGE_FRONT:
        value[0] = gauge_front(g, view, def->from[0]);
        break;
    case GAUGE_HEIGHT:
        value[0] = gauge_height(g, view, def->from[0]);
        break;
    case GAUGE_WETTED:
        value[0] = gauge_point(view, def->from, node, weight);
        break;
    case GAUGE_PRESSURE:
        if (gauge_point(view, def->from, node, weight)) {
            value[0] = 0;
            for (int k = 0; k < 3; k++)
                value[0] += weight[k] * view->nodes->p[node[k]];
        }
        break;
    case GAUGE_VELOCITY:
        if (gauge_point(view, def->from, node, weight)) {
            value[0] = value[1] = value[2] = 0;
            for (int k = 0; k < 3; k++)
                for (int d = 0; d < 2; d++)
                    value[d] += weight[k] * view->nodes->v[2 * node[k] + d];
        }
        break;
    case GAUGE_DISCHARGE:
        value[0] = gauge_discharge(g, view, def);
        break;
    default:
        break;
    }
}

void silt_gauges_read(silt_gauges *gauges, const silt_view *view, double *value) {
    bool water = view->nodes && view->mesh && view->locator, connected = false;
    for (int i = 0; i < gauges->n_gauge; i++) {
        const silt_gauge_def *def = &view->scene->gauge[i];
        int n = gauge_columns(def);
        for (int k = 0; k < n; k++)
            value[k] = NAN;
        if (def->kind == GAUGE_BED_LEVEL || def->kind == GAUGE_SCOUR) {
            double level = view->bed ? silt_bed_level(view->bed, def->from[0]) : -HUGE_VAL;
            if (level > -HUGE_VAL)
                value[0] = def->kind == GAUGE_SCOUR ? gauges->start[i] - level : level;
        } else if (water) {
            if (!connected && (def->kind == GAUGE_FRONT || def->kind == GAUGE_HEIGHT)) {
                gauge_connect(gauges, view);
                connected = true;
            }
            gauge_water(gauges, view, def, value);
        }
        value += n;
    }
}

// how the water wears the bed: its shear on every node of the surface, the law that makes mass per area of it, what is due

#include "bed_law.h"
#include "bed_mesh.h"
#include "viscosity.h"

// mass per exposed area that wears off until the patch is due, kg/m2
static double patch_full(const silt_bed *bed, const silt_patch *patch) {
    return patch->mass / bed->index->length[patch->node];
}

// ---------------------------------------------------------------- what a release leaves to the nodes around it

static void heirs_add(silt_bed_heirs *heirs, const silt_bed *bed, int node) {
    for (int k = 0; k < heirs->count; k++)
        if (heirs->node[k] == node)
            return;
    SILT_RESERVE(heirs->node, heirs->node_capacity, heirs->count + 1);
    SILT_RESERVE(heirs->length, heirs->length_capacity, heirs->count + 1);
    heirs->node[heirs->count] = node;
    heirs->length[heirs->count++] = bed->exposed[node] ? bed->index->length[node] : 0;
}

void silt_bed_heirs_take(silt_bed_heirs *heirs, const silt_bed *bed, const silt_scene *scene, const silt_patch *patch) {
    *heirs = (silt_bed_heirs){0};
    for (int k = 0; k < patch->n_cell; k++)
        for (int a = 0; a < (int)(sizeof bed->cell[0] / sizeof bed->cell[0][0]); a++)
            if (bed->cell[patch->cell[k]][a] >= 0)
                heirs_add(heirs, bed, bed->cell[patch->cell[k]][a]);
    const double length = bed->index->length[patch->node];
    if (!(length > 0))
        return;
    heirs->work_length = length;
    const double full = silt_bed_work(bed, scene, patch->node);
    heirs->work = length * silt_clamp(bed->work[patch->node] - full, 0, full);
    // what its neighbours took out of the patch it has worn off as well: up to two patches
    heirs->eroded = silt_clamp(length * bed->eroded[patch->node] - patch->mass, 0, 2 * patch->mass);
}

void silt_bed_heirs_give(silt_bed_heirs *heirs, silt_bed *bed) {
    // the nodes that the release laid bare; where it laid none bare those around it
    double fresh = 0, around = 0;
    for (int k = 0; k < heirs->count; k++) {
        const int i = heirs->node[k];
        if (!bed->exposed[i])
            continue;
        *(heirs->length[k] > 0 ? &around : &fresh) += bed->index->length[i];
    }
    for (int k = 0; k < heirs->count; k++) {
        const int i = heirs->node[k];
        const double length = bed->index->length[i];
        if (!bed->exposed[i]) {
            // what no longer is the bed's surface forgets its work
            bed->work[i] = bed->eroded[i] = bed->shear[i] = 0;
        } else if (heirs->length[k] > 0) {
            // the same mass is worn off a node whose surface changed
            bed->eroded[i] *= heirs->length[k] / length;
            bed->eroded[i] += fresh > 0 ? 0 : heirs->eroded / around;
        } else {
            bed->work[i] = heirs->work / silt_max(fresh, heirs->work_length);
            bed->eroded[i] = heirs->eroded / fresh;
            bed->shear[i] = 0;
        }
    }
    free(heirs->node);
    free(heirs->length);
    *heirs = (silt_bed_heirs){0};
}

// ---------------------------------------------------------------- the laws

static double gravity_of(const silt_scene *scene) { return silt_length(3, scene->gravity); }

double silt_bed_dstar(const silt_scene *scene) {
    const double nu = scene->fluid.viscosity / scene->fluid.density;
    return scene->grains.diameter * cbrt((scene->bed.density / scene->fluid.density - 1) * gravity_of(scene) / (nu * nu));
}

double silt_shields_critical(double dstar) { return 0.30 / (1 + 1.2 * dstar) + 0.055 * -expm1(-0.020 * dstar); }

// submerged weight of a grain over its face: what a Shields number is relative to
static double shields_unit(const silt_scene *scene) {
    return (scene->bed.density - scene->fluid.density) * gravity_of(scene) * scene->grains.diameter;
}

static double shields_motion(const silt_scene *scene) {
    const double theta = scene->bed.critical > 0 ? scene->bed.critical : silt_shields_critical(silt_bed_dstar(scene));
    return theta * shields_unit(scene);
}

double silt_bed_threshold(const silt_scene *scene) {
    return scene->bed.law == BED_SHIELDS ? shields_motion(scene) : scene->bed.threshold;
}

double silt_bed_motion(const silt_scene *scene) {
    return scene->bed.threshold > 0 ? scene->bed.threshold : shields_motion(scene);
}

double silt_bed_slope(double upright, double uphill, double repose) {
    if (repose <= 0)
        return 1;
    const double friction = tan(repose * M_PI / 180);
    const double root = silt_square(upright * friction) - (1 - upright * upright) + uphill * uphill;
    if (upright <= 0 || root < 0)
        return 0;
    return silt_max((uphill + sqrt(root)) / friction, 0);
}

double silt_bed_rate(const silt_scene *scene, double tau, double threshold, double level) {
    const silt_bed_def *def = &scene->bed;
    const double excess = tau - threshold;
    if (!(excess > 0))
        return 0;
    switch (def->law) {
    case BED_POWER:
        return excess * sqrt(tau / scene->fluid.density) / silt_bed_least_work(def->work);
    case BED_EXCESS_SHEAR:
        return def->erodibility * excess;
    case BED_SHIELDS: {
        // van Rijn's pick-up (1984): kg/m2/s = 0.00033 rho_s sqrt((s - 1) g d) D*^0.3 T^1.5, T = (tau - tau_c)/tau_c
        const double unit = sqrt(shields_unit(scene) / scene->fluid.density);
        return 0.00033 * unit * pow(silt_bed_dstar(scene), 0.3) * pow(excess / level, 1.5) / (1 - def->porosity);
    }
    default:
        return 0;
    }
}

// ---------------------------------------------------------------- the stress on a node

// what the laws want to know of the water at a node of the surface
typedef struct bed_stress {
    double tau;     // Pa
    double rate;    // 1/s, of shear, for the frictional work
    double flow[3]; // unit, along the bed, or 0
    double y_plus;  // of the cell that the gradient was taken from, else 0
} bed_stress;

// v without its part along n. @return its length
static double tangential(int dim, const double *n, double *v) {
    const double across = silt_dot(dim, v, n);
    for (int d = 0; d < dim; d++)
        v[d] -= across * n[d];
    return silt_length(dim, v);
}

static void stress_flow(int dim, bed_stress *stress, const double *v, double length) {
    for (int d = 0; d < dim && length > 0; d++)
        stress->flow[d] = v[d] / length;
}

// velocity at distance h from the bed; false when there is no water at that place
static bool stress_sample(const silt_bed *bed, int k, const double *n, double h, const silt_nodes *nodes, const silt_mesh *mesh,
                          const silt_locator *locator, double v[3]) {
    const int dim = silt_nodes_dim(nodes);
    double point[3], weight[4];
    for (int d = 0; d < dim; d++) {
        point[d] = bed->x[k][d] + h * n[d];
        v[d] = 0;
    }
    const int cell = silt_locate(locator, mesh, nodes->x, point, weight);
    for (int a = 0; a <= dim && cell >= 0; a++)
        for (int d = 0; d < dim; d++)
            v[d] += weight[a] * nodes->v[dim * mesh->cell[cell][a] + d];
    return cell >= 0;
}

// equation 32 of the 2006 paper: half the tangential speed over the distance
static bool stress_paper(const silt_bed *bed, int k, const silt_scene *scene, const double *n, const silt_nodes *nodes,
                         const silt_mesh *mesh, const silt_locator *locator, bed_stress *stress) {
    const double h = scene->bed.distance > 0 ? scene->bed.distance : scene->fluid.size;
    double v[3];
    if (!stress_sample(bed, k, n, h, nodes, mesh, locator, v))
        return false;
    const double speed = tangential(silt_nodes_dim(nodes), n, v);
    stress->rate = speed / (2 * h);
    stress->tau = silt_apparent_viscosity(&scene->fluid, stress->rate) * stress->rate;
    stress_flow(silt_nodes_dim(nodes), stress, v, speed);
    return true;
}

// a rough wall's logarithm, looked at where it holds, beside a wall that the normal leans into straight above; in a film at its half,
// quarter, eighth
static bool stress_log_law(const silt_bed *bed, int k, const silt_scene *scene, const double *n, const silt_nodes *nodes,
                           const silt_mesh *mesh, const silt_locator *locator, bed_stress *stress) {
    const double ks = silt_bed_roughness(scene), rho = scene->fluid.density;
    const double h = bed->fluid_node[k] >= 0 ? silt_node_h(nodes, bed->fluid_node[k], scene->fluid.size) : scene->fluid.size;
    const double g = gravity_of(scene), up[3] = {-scene->gravity[0] / g, -scene->gravity[1] / g, -scene->gravity[2] / g};
    const bool leans = g > 0 && silt_dot(silt_nodes_dim(nodes), up, n) > 0.5;
    double y = silt_max(2 * h, 2 * ks), v[3];
    for (int halved = 0; !stress_sample(bed, k, n, y, nodes, mesh, locator, v); halved++) {
        if (leans && stress_sample(bed, k, up, y, nodes, mesh, locator, v))
            break;
        if (halved == 3)
            return false;
        y *= 0.5;
    }
    const double speed = tangential(silt_nodes_dim(nodes), n, v);
    const double star = SILT_KAPPA * speed / log(silt_max(30 * y / ks, 3));
    stress->tau = rho * star * star;
    stress->rate = scene->fluid.viscosity > 0 ? stress->tau / scene->fluid.viscosity : 0;
    stress_flow(silt_nodes_dim(nodes), stress, v, speed);
    return true;
}

// volume of a cell times the gradient of each of its shape functions; @return the volume
static double cell_gradients(int dim, const double *c, double (*g)[3]) {
    if (dim == 2) {
        for (int a = 0; a < 3; a++) {
            const double *q = c + 2 * ((a + 1) % 3), *r = c + 2 * ((a + 2) % 3);
            g[a][0] = 0.5 * (q[1] - r[1]);
            g[a][1] = 0.5 * (r[0] - q[0]);
        }
        return silt_simplex_volume(2, c);
    }
    for (int d = 0; d < 3; d++)
        g[0][d] = 0;
    for (int a = 1; a < 4; a++) {
        const double *p = c + 3 * (a % 3 + 1), *q = c + 3 * ((a + 1) % 3 + 1);
        for (int d = 0; d < 3; d++) {
            const int e = (d + 1) % 3, f = (d + 2) % 3;
            g[a][d] = ((p[e] - c[e]) * (q[f] - c[f]) - (p[f] - c[f]) * (q[e] - c[e])) / 6;
            g[0][d] -= g[a][d];
        }
    }
    return silt_simplex_volume(3, c);
}

// the true shear: viscosity times the gradient, recovered at the bed's node from the water's cells around it
static bool stress_gradient(const silt_bed *bed, int k, const silt_scene *scene, const double *n, const silt_nodes *nodes,
                            const silt_mesh *mesh, bed_stress *stress) {
    const int node = bed->fluid_node[k], dim = silt_nodes_dim(nodes);
    if (node < 0 || node >= mesh->n_node || mesh->node_cell_start[node] == mesh->node_cell_start[node + 1])
        return false;
    double gradient[3][3] = {{0}}, whole = 0, off = HUGE_VAL; // sums of volume times d v_i / d x_j
    for (int m = mesh->node_cell_start[node]; m < mesh->node_cell_start[node + 1]; m++) {
        const int *cell = mesh->cell[mesh->node_cell[m]];
        double corner[12], shape[4][3];
        silt_cell_corners(mesh, nodes->x, cell, corner);
        whole += cell_gradients(dim, corner, shape);
        for (int a = 0; a <= dim; a++) {
            double way = 0, up = 0;
            for (int d = 0; d < dim; d++) {
                const double part = silt_shortest(mesh, d, corner[dim * a + d] - nodes->x[dim * node + d]);
                way += part * part;
                up += part * n[d];
                for (int i = 0; i < dim; i++)
                    gradient[i][d] += shape[a][d] * nodes->v[dim * cell[a] + i];
            }
            if (up > 0.3 * sqrt(way))
                off = silt_min(off, up);
        }
    }
    if (!(whole > 0))
        return false;
    double shear[3] = {0};
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            shear[i] += (gradient[i][j] + gradient[j][i]) * n[j] / whole;
    stress->rate = tangential(dim, n, shear);
    const double mu = silt_apparent_viscosity(&scene->fluid, stress->rate), rho = scene->fluid.density;
    stress->tau = mu * stress->rate;
    stress->y_plus = mu > 0 && off < HUGE_VAL ? off * sqrt(rho * stress->tau) / mu : 0;
    stress_flow(dim, stress, shear, stress->rate);
    return true;
}

// ---------------------------------------------------------------- wear

enum { WEAR_ROUNDS = 6 }; // of smoothing: nodes of the surface on either side that make the normal of the ground at large

// Outward areas summed over every node's surroundings: the ground without the steps that single releases cut into it. What wears is
// the node's share of that ground; with its own exposed area a bed in steps would wear faster the more ragged it is.
static void wear_ground(const silt_bed *bed, double (*ground)[3]) {
    enum { CORNERS = sizeof bed->edge[0] / sizeof bed->edge[0][0] };
    double(*sum)[3] = silt_alloc((size_t)bed->n_node + 1, sizeof *sum);
    for (int k = 0; k < bed->n_node; k++)
        for (int d = 0; d < (int)(sizeof bed->x[0] / sizeof bed->x[0][0]); d++)
            ground[k][d] = bed->exposed[k] ? bed->index->outward[k][d] : 0;
    for (int round = 0; round < WEAR_ROUNDS; round++) {
        memcpy(sum, ground, (size_t)bed->n_node * sizeof *sum);
        for (int e = 0; e < bed->n_edge; e++)
            for (int a = 0; a < CORNERS; a++)
                for (int b = 0; b < CORNERS; b++)
                    for (int d = 0; d < 3 && b != a && bed->edge[e][a] >= 0 && bed->edge[e][b] >= 0; d++)
                        sum[bed->edge[e][a]][d] += ground[bed->edge[e][b]][d];
        memcpy(ground, sum, (size_t)bed->n_node * sizeof *sum);
    }
    free(sum);
}

// share of the node's exposed area that lies along the ground at large; normal: of that ground
static double wear_plan(const silt_bed *bed, int k, int dim, const double *ground, const double *own, double normal[3]) {
    const double size = silt_length(dim, ground);
    for (int d = 0; d < dim; d++)
        normal[d] = size > 0 ? ground[d] / size : own[d];
    double along = 0;
    for (int d = 0; d < dim; d++)
        along += bed->index->outward[k][d] * normal[d];
    return silt_clamp(along / bed->index->length[k], 0, 1);
}

static double wear_threshold(const silt_scene *scene, int dim, double level, const double *normal, const double *flow) {
    const double g = gravity_of(scene);
    if (!scene->bed.slope || scene->bed.repose <= 0 || !(g > 0))
        return level;
    return level * silt_bed_slope(-silt_dot(dim, normal, scene->gravity) / g, -silt_dot(dim, flow, scene->gravity) / g, scene->bed.repose);
}

void silt_bed_wear(silt_bed *bed, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                   const silt_locator *locator, const double *cover, double dt) {
    const silt_bed_def *def = &scene->bed;
    const int dim = silt_nodes_dim(nodes);
    const bool works = def->law == BED_FRICTIONAL_WORK || def->law == BED_DISSIPATION;
    const double level = silt_bed_threshold(scene);
    double(*ground)[3] = silt_alloc((size_t)bed->n_node + 1, sizeof *ground);
    wear_ground(bed, ground);
    bed->y_plus = 0;
    for (int k = 0; k < bed->n_node; k++) {
        bed->shear[k] = 0;
        if (!bed->exposed[k])
            continue;
        double own[3] = {0}, normal[3] = {0};
        silt_bed_normal(bed, k, own);
        const double plan = wear_plan(bed, k, dim, ground[k], own, normal);
        bed_stress stress = {0};
        const bool known = def->shear == SHEAR_PAPER      ? stress_paper(bed, k, scene, own, nodes, mesh, locator, &stress)
                           : def->shear == SHEAR_GRADIENT ? stress_gradient(bed, k, scene, own, nodes, mesh, &stress)
                                                          : stress_log_law(bed, k, scene, normal, nodes, mesh, locator, &stress);
        if (!known)
            continue;
        bed->shear[k] = stress.tau;
        bed->y_plus = silt_max(bed->y_plus, stress.y_plus);
        const double threshold = wear_threshold(scene, dim, level, normal, stress.flow);
        const double open = cover ? 1 - cover[k] : 1;
        if (stress.tau < threshold)
            continue;
        silt_patch patch;
        silt_bed_patch(bed, k, &patch);
        const double solid = patch.mass / patch.area; // rho_s (1 - n)
        if (works) {
            const double work = open * stress.tau * stress.rate * dt;
            bed->work[k] += work;
            // rho_s (1 - n) h_0 dW / W_c; without a layer h_0 is the patch's height and what counts is the work
            if (isfinite(def->work))
                bed->eroded[k] += solid * (def->layer > 0 ? plan * def->layer : patch.height) * work / silt_bed_work(bed, scene, k);
        } else {
            const double weaker = def->law == BED_POWER ? silt_bed_least_work(def->work) / silt_bed_work(bed, scene, k) : 1;
            bed->eroded[k] += weaker * plan * open * solid * silt_bed_rate(scene, stress.tau, threshold, level) * dt;
        }
    }
    free(ground);
}

// how full the accumulator is; 1: due
static double wear_share(const silt_bed *bed, const silt_scene *scene, int node) {
    const silt_bed_def *def = &scene->bed;
    if ((def->law == BED_FRICTIONAL_WORK || def->law == BED_DISSIPATION) && def->layer <= 0)
        return bed->work[node] / silt_bed_work(bed, scene, node);
    silt_patch patch;
    silt_bed_patch(bed, node, &patch);
    return bed->eroded[node] / patch_full(bed, &patch);
}

typedef struct wear_full {
    int node;
    double share;
} wear_full;

// the fullest first, of equals the lower number
static int full_compare(const void *a, const void *b) {
    const wear_full *p = a, *q = b;
    return p->share != q->share ? (p->share < q->share) - (p->share > q->share) : (p->node > q->node) - (p->node < q->node);
}

int silt_bed_due(const silt_bed *bed, const silt_scene *scene, int capacity, int *due) {
    wear_full *full = NULL;
    int n = 0, room = 0;
    if (!silt_bed_erodes(&scene->bed))
        return 0;
    for (int k = 0; k < bed->n_node; k++) {
        if (!bed->exposed[k] || (bed->work[k] <= 0 && bed->eroded[k] <= 0))
            continue;
        // a sum of many steps' work may miss the mark by its rounding
        const double share = wear_share(bed, scene, k);
        if (!(share >= 1 - 1e-12))
            continue;
        SILT_RESERVE(full, room, n + 1);
        full[n++] = (wear_full){k, share};
    }
    if (n > 1)
        qsort(full, (size_t)n, sizeof *full, full_compare);
    n = n < capacity ? n : capacity;
    for (int k = 0; k < n; k++)
        due[k] = full[k].node;
    free(full);
    return n;
}

// ---------------------------------------------------------------- what deposition asks

double silt_bed_shear_at(const silt_bed *bed, const double *x) {
    const int dim = bed_dim(bed);
    double nearest = HUGE_VAL, shear = 0;
    for (int k = 0; k < bed->n_node; k++) {
        double way = 0;
        for (int d = 0; d < dim && bed->exposed[k]; d++)
            way += silt_square(bed->x[k][d] - x[d]);
        if (bed->exposed[k] && way < nearest) {
            nearest = way;
            shear = bed->shear[k];
        }
    }
    return shear;
}

typedef struct bed_room {
    int cell;
    double way, room; // m to its centre, kg/m that it still takes
} bed_room;

static int room_compare(const void *a, const void *b) {
    const bed_room *p = a, *q = b;
    return p->way != q->way ? (p->way > q->way) - (p->way < q->way) : (p->cell > q->cell) - (p->cell < q->cell);
}

// cells with pores to spare within reach of x, the nearest first; @return kg/m that they take
static double room_list(const silt_bed *bed, const silt_scene *scene, const double *x, double reach, double porosity, int *n, bed_room *list) {
    const int dim = bed_dim(bed);
    double sum = 0;
    *n = 0;
    for (int c = 0; c < bed->n_cell; c++) {
        double centre[3] = {0}, way = 0;
        for (int a = 0; a <= dim; a++)
            for (int d = 0; d < dim; d++)
                centre[d] += bed->x[bed->cell[c][a]][d] / (dim + 1);
        for (int d = 0; d < dim; d++)
            way += silt_square(centre[d] - x[d]);
        const double room = scene->bed.density * (1 - porosity) * bed->area[c] - bed->mass[c];
        if (way > reach * reach || room <= 1e-9 * bed->mass[c])
            continue;
        list[(*n)++] = (bed_room){c, sqrt(way), room};
        sum += room;
    }
    qsort(list, (size_t)*n, sizeof *list, room_compare);
    return sum;
}

silt_deposit_kind silt_bed_densify(silt_bed *bed, const silt_scene *scene, const double *x, double reach, double porosity, double mass,
                                   silt_deposit *deposit) {
    *deposit = (silt_deposit){.kind = DEPOSIT_REFUSED, .node = -1};
    bed_room *list = silt_alloc((size_t)bed->n_cell + 1, sizeof *list);
    int n;
    if (mass > 0 && room_list(bed, scene, x, reach, porosity, &n, list) >= mass) {
        double left = mass;
        for (int k = 0; k < n && left > 0; k++) {
            const double part = silt_min(left, list[k].room);
            bed->mass[list[k].cell] += part;
            left -= part;
        }
        silt_bed_refresh(bed);
        deposit->kind = DEPOSIT_DENSER;
        deposit->pore_water = -scene->bed.saturation * mass / scene->bed.density * scene->fluid.density;
        silt_sum(&bed->pore_water, &bed->pore_rest, -deposit->pore_water);
    }
    free(list);
    return deposit->kind;
}

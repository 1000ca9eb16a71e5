// how the water wears the bed: its shear on every node of the surface, the law that makes mass per area of it, what is due

#include "bed_law.h"
#include "bed_mesh.h"

// mass per exposed area that wears off until the patch is due, kg/m2
static double patch_full(const silt_bed *bed, const silt_patch *patch) {
    return patch->mass / bed->index->length[patch->node];
}

void silt_bed_excess(const silt_bed *bed, const silt_scene *scene, const silt_patch *patch, double *work, double *eroded) {
    *work = *eroded = 0;
    if (!(bed->index->length[patch->node] > 0))
        return;
    const double full = patch_full(bed, patch);
    *work = silt_clamp(bed->work[patch->node] - scene->bed.work, 0, scene->bed.work);
    *eroded = silt_clamp(bed->eroded[patch->node] - full, 0, full);
}

// ---------------------------------------------------------------- wear

// Speed along the bed at distance h from it; false when there is no water at that place.
static bool wear_sample(const silt_bed *bed, int k, const double n[2], double h, const silt_nodes *nodes,
                        const silt_mesh *mesh, const silt_locator *locator, double *speed) {
    const double point[2] = {bed->x[k][0] + h * n[0], bed->x[k][1] + h * n[1]};
    double weight[3], v[2] = {0};
    const int cell = silt_locate(locator, mesh, nodes->x, point, weight);
    if (cell < 0)
        return false;
    for (int a = 0; a < 3; a++)
        for (int d = 0; d < 2; d++)
            v[d] += weight[a] * nodes->v[2 * mesh->cell[cell][a] + d];
    *speed = fabs(v[0] * n[1] - v[1] * n[0]);
    return true;
}

// Shear rate along the bed from the gradient in the water's cells at the bed's node; false when it has none.
static bool wear_gradient(const silt_bed *bed, int k, const double n[2], const silt_nodes *nodes, const silt_mesh *mesh,
                          double *rate) {
    const int node = bed->fluid_node[k];
    if (node < 0 || node >= mesh->n_node || mesh->node_cell_start[node] == mesh->node_cell_start[node + 1])
        return false;
    // sum of area times gradient; gradient[i][j] = d v_i / d x_j
    double gradient[2][2] = {{0}}, area = 0;
    for (int m = mesh->node_cell_start[node]; m < mesh->node_cell_start[node + 1]; m++) {
        const int *cell = mesh->cell[mesh->node_cell[m]];
        const double *x[3] = {nodes->x + 2 * cell[0], nodes->x + 2 * cell[1], nodes->x + 2 * cell[2]};
        area += 0.5 * bed_cross(x[0], x[1], x[2]);
        for (int a = 0; a < 3; a++) {
            const double *q = x[(a + 1) % 3], *r = x[(a + 2) % 3];
            for (int i = 0; i < 2; i++) {
                gradient[i][0] += 0.5 * (q[1] - r[1]) * nodes->v[2 * cell[a] + i];
                gradient[i][1] += 0.5 * (r[0] - q[0]) * nodes->v[2 * cell[a] + i];
            }
        }
    }
    if (!(area > 0))
        return false;
    const double t[2] = {n[1], -n[0]};
    double shear = 0;
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            shear += t[i] * (gradient[i][j] + gradient[j][i]) * n[j];
    *rate = fabs(shear) / area;
    return true;
}

void silt_bed_wear(silt_bed *bed, const silt_scene *scene, const silt_nodes *nodes, const silt_mesh *mesh,
                   const silt_locator *locator, double dt) {
    const silt_bed_def *def = &scene->bed;
    const double mu = scene->fluid.viscosity, h = def->distance > 0 ? def->distance : scene->fluid.size;
    for (int k = 0; k < bed->n_node; k++) {
        bed->shear[k] = 0;
        if (!bed->exposed[k])
            continue;
        double n[2], value, rate;
        silt_bed_normal(bed, k, n);
        if (def->law == BED_FRICTIONAL_WORK) {
            // equation 32 of the 2006 paper: half the tangential speed over the distance
            if (!wear_sample(bed, k, n, h, nodes, mesh, locator, &value))
                continue;
            rate = value / (2 * h);
        } else if (!wear_gradient(bed, k, n, nodes, mesh, &rate))
            continue;
        const double tau = mu * rate, work = tau * rate * dt;
        bed->shear[k] = tau;
        if (tau < def->threshold)
            continue;
        bed->work[k] += work;
        if (isinf(def->work))
            continue;
        // rho_s (1 - n) h_0 dW / W_c; without a layer h_0 is the patch's height
        silt_patch patch;
        silt_bed_patch(bed, k, &patch);
        const double layer = def->layer > 0 ? def->layer : patch.height;
        bed->eroded[k] += patch.mass / patch.area * layer * work / def->work;
    }
}

// how full the accumulator is; 1: due
static double wear_share(const silt_bed *bed, const silt_scene *scene, int node) {
    if (scene->bed.layer <= 0)
        return bed->work[node] / scene->bed.work;
    silt_patch patch;
    silt_bed_patch(bed, node, &patch);
    return bed->eroded[node] / patch_full(bed, &patch);
}

int silt_bed_due(const silt_bed *bed, const silt_scene *scene, int capacity, int *due) {
    int n = 0;
    if (isinf(scene->bed.work) || capacity <= 0)
        return 0;
    for (int k = 0; k < bed->n_node; k++) {
        if (!bed->exposed[k] || bed->work[k] <= 0)
            continue;
        // a sum of many steps' work may miss the mark by its rounding
        const double share = wear_share(bed, scene, k);
        if (!(share >= 1 - 1e-12))
            continue;
        // the fullest stand in front, and push the least full one out when there are too many
        int at = n;
        while (at > 0 && wear_share(bed, scene, due[at - 1]) < share)
            at--;
        if (at == capacity)
            continue;
        const int moved = (n < capacity ? n : capacity - 1) - at;
        memmove(due + at + 1, due + at, (size_t)moved * sizeof *due);
        due[at] = k;
        n += n < capacity;
    }
    return n;
}

// how the water wears the bed: its shear on every node of the surface, the law that makes mass per area of it, what is due

#include "bed_law.h"
#include "bed_mesh.h"

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
    heirs->work = length * silt_clamp(bed->work[patch->node] - scene->bed.work, 0, scene->bed.work);
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

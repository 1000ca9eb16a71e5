// the bed's wear: frictional work at its surface, what is due, what a release takes along

#include "bed_mesh.h"

// ---------------------------------------------------------------- patch

void silt_bed_patch(const silt_bed *bed, int node, silt_patch *patch) {
    *patch = (silt_patch){.node = node};
    if (!bed->alive[node])
        return;
    // rising cell numbers: sums have the same bits after a restart
    for (int place = bed->index->first[node]; place >= 0 && patch->n_cell < 32; place = bed->index->next[place]) {
        int k = patch->n_cell++;
        for (; k > 0 && patch->cell[k - 1] > place / 3; k--)
            patch->cell[k] = patch->cell[k - 1];
        patch->cell[k] = place / 3;
    }
    for (int k = 0; k < patch->n_cell; k++) {
        const int c = patch->cell[k];
        patch->mass += bed->mass[c];
        patch->area += bed->area[c];
        for (int d = 0; d < 2; d++)
            patch->centre[d] += bed->area[c] / 3 *
                                (bed->x[bed->cell[c][0]][d] + bed->x[bed->cell[c][1]][d] + bed->x[bed->cell[c][2]][d]);
    }
    for (int d = 0; d < 2; d++)
        patch->centre[d] /= patch->area;
    silt_bed_normal(bed, node, patch->normal);
    const double length = bed->index->length[node];
    patch->height = length > 0 ? patch->area / length : 0;
}

// mass per exposed area that wears off until the patch is due, kg/m2
static double patch_full(const silt_bed *bed, const silt_patch *patch) {
    return patch->mass / bed->index->length[patch->node];
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

// ---------------------------------------------------------------- release

void silt_bed_release(silt_bed *bed, const silt_scene *scene, const silt_patch *patch) {
    if (patch->n_cell == 0)
        return;
    // what was done beyond the release, over the node's length of surface
    const double length = bed->index->length[patch->node], full = length > 0 ? patch_full(bed, patch) : 0;
    const double work = length > 0 ? silt_clamp(bed->work[patch->node] - scene->bed.work, 0, scene->bed.work) : 0;
    const double eroded = length > 0 ? silt_clamp(bed->eroded[patch->node] - full, 0, full) : 0;

    // the patch's own edges: those on the surface go, those towards the rest of the bed come
    int ring[32][3], buried[96], n_buried = 0, n_ring = patch->n_cell;
    for (int k = 0; k < n_ring; k++)
        memcpy(ring[k], bed->cell[patch->cell[k]], sizeof ring[k]);
    for (int k = n_ring - 1; k >= 0; k--)
        silt_bed_cell_remove(bed, patch->cell[k]);
    for (int k = 0; k < n_ring; k++)
        for (int a = 0; a < 3; a++)
            if (bed->alive[ring[k][a]] && !bed->exposed[ring[k][a]])
                buried[n_buried++] = ring[k][a];
    for (int k = 0; k < n_ring; k++)
        for (int a = 0; a < 3; a++) {
            const int from = ring[k][a], to = ring[k][(a + 1) % 3];
            silt_bed_edge_remove(bed, to, from);
            if (silt_bed_cell_at(bed, to, from) >= 0)
                silt_bed_edge_add(bed, scene, from, to);
        }
    silt_bed_refresh(bed);
    bed->pore_water += scene->bed.saturation * (patch->area - patch->mass / scene->bed.density) * scene->fluid.density;

    // newly exposed nodes start with the excess, shared over their lengths of surface
    double fresh = 0;
    for (int k = 0; k < n_buried; k++) {
        bool again = false;
        for (int q = 0; q < k; q++)
            again |= buried[q] == buried[k];
        if (again || !bed->exposed[buried[k]])
            buried[k--] = buried[--n_buried];
        else
            fresh += bed->index->length[buried[k]];
    }
    const double share = fresh > 0 ? silt_min(length / fresh, 1) : 0;
    for (int k = 0; k < n_buried; k++) {
        bed->work[buried[k]] = share * work;
        bed->eroded[buried[k]] = share * eroded;
        bed->shear[buried[k]] = 0;
    }
    // what no longer is the bed's surface forgets its work
    for (int k = 0; k < n_ring; k++)
        for (int a = 0; a < 3; a++)
            if (!bed->exposed[ring[k][a]])
                bed->work[ring[k][a]] = bed->eroded[ring[k][a]] = bed->shear[ring[k][a]] = 0;
}

// ---------------------------------------------------------------- loose pieces

static int piece_root(int *root, int c) {
    while (root[c] != c)
        c = root[c] = root[root[c]];
    return c;
}

int silt_bed_loose(const silt_bed *bed, const silt_scene *scene, int capacity, int *node) {
    if (bed->n_cell == 0)
        return 0;
    // pieces: cells joined through edges; held when one of their edges lies on a wall
    const size_t n_cell = (size_t)bed->n_cell;
    int *root = silt_alloc(n_cell, sizeof *root);
    double *area = silt_alloc(n_cell, sizeof *area);
    uint8_t *held = silt_alloc(n_cell, 1), *covered = silt_alloc(n_cell, 1);
    for (int c = 0; c < bed->n_cell; c++)
        root[c] = c;
    for (int c = 0; c < bed->n_cell; c++)
        for (int a = 0; a < 3; a++) {
            const int across = silt_bed_cell_at(bed, bed->cell[c][(a + 1) % 3], bed->cell[c][a]);
            const int p = piece_root(root, c), q = across >= 0 ? piece_root(root, across) : p;
            root[p > q ? p : q] = p > q ? q : p;
        }
    for (int c = 0; c < bed->n_cell; c++) {
        const int p = piece_root(root, c);
        area[p] += bed->area[c];
        for (int a = 0; a < 3 && !held[p]; a++) {
            const int from = bed->cell[c][a], to = bed->cell[c][(a + 1) % 3];
            held[p] = silt_bed_cell_at(bed, to, from) < 0 && silt_bed_on_wall(scene, bed->x[from], bed->x[to]);
        }
    }

    // nodes whose patches cover the loose cells, those first that take nothing else along
    const double small = 10 * 3 * sqrt(3.0) / 4 * silt_square(bed_size(scene));
    int n = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int c = 0; c < bed->n_cell && n < capacity; c++) {
            const int p = piece_root(root, c);
            if (held[p] || area[p] >= small || covered[c])
                continue;
            int best = -1, most = 0;
            for (int a = 0; a < 3; a++) {
                const int k = bed->cell[c][a];
                int own = 0, other = 0;
                for (int place = bed->index->first[k]; place >= 0; place = bed->index->next[place]) {
                    own += piece_root(root, place / 3) == p && !covered[place / 3];
                    other += piece_root(root, place / 3) != p;
                }
                if (bed->exposed[k] && own > most && (pass == 1 || other == 0)) {
                    best = k;
                    most = own;
                }
            }
            if (best < 0)
                continue;
            node[n++] = best;
            for (int place = bed->index->first[best]; place >= 0; place = bed->index->next[place])
                covered[place / 3] = 1;
        }
    free(root);
    free(area);
    free(held);
    free(covered);
    return n;
}

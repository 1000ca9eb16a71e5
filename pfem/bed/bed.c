// the bed's patches: what a release takes along, what hangs loose

#include "bed_law.h"
#include "bed_mesh.h"

// ---------------------------------------------------------------- patch

void silt_bed_patch(const silt_bed *bed, int node, silt_patch *patch) {
    *patch = (silt_patch){.node = node};
    if (!bed->alive[node])
        return;
    // rising cell numbers: sums have the same bits after a restart
    for (int place = bed->index->first[node]; place >= 0 && patch->n_cell < PATCH_CELLS; place = bed->index->next[place]) {
        int k = patch->n_cell++;
        for (; k > 0 && patch->cell[k - 1] > place / 4; k--)
            patch->cell[k] = patch->cell[k - 1];
        patch->cell[k] = place / 4;
    }
    for (int k = 0; k < patch->n_cell; k++) {
        const int c = patch->cell[k];
        patch->mass += bed->mass[c];
        patch->area += bed->area[c];
        for (int d = 0; d < 3; d++) {
            double sum = bed->x[bed->cell[c][0]][d] + bed->x[bed->cell[c][1]][d] + bed->x[bed->cell[c][2]][d];
            if (bed_dim(bed) == 3)
                sum += bed->x[bed->cell[c][3]][d];
            patch->centre[d] += bed->area[c] / (bed_dim(bed) + 1) * sum;
        }
    }
    for (int d = 0; d < 3; d++)
        patch->centre[d] /= patch->area;
    silt_bed_normal(bed, node, patch->normal);
    const double length = bed->index->length[node];
    patch->height = length > 0 ? patch->area / length : 0;
}

// ---------------------------------------------------------------- release

void silt_bed_take_out(silt_bed *bed, const silt_scene *scene, const silt_patch *patch) {
    if (patch->n_cell == 0)
        return;
    silt_bed_heirs heirs;
    silt_bed_heirs_take(&heirs, bed, scene, patch);

    // the patch's own edges: those on the surface go, those towards the rest of the bed come
    const int dim = bed_dim(bed), n_ring = patch->n_cell;
    int ring[PATCH_CELLS][4];
    for (int k = 0; k < n_ring; k++)
        memcpy(ring[k], bed->cell[patch->cell[k]], sizeof ring[k]);
    for (int k = n_ring - 1; k >= 0; k--)
        silt_bed_cell_remove(bed, patch->cell[k]);
    for (int k = 0; k < n_ring; k++)
        for (int a = 0; a <= dim; a++) {
            int facet[3], turned[3];
            bed_facet(dim, ring[k], a, facet);
            bed_facet_turned(facet, turned);
            silt_bed_edge_remove(bed, facet);
            if (silt_bed_cell_at(bed, turned) >= 0)
                silt_bed_edge_add(bed, scene, turned);
        }
    silt_bed_refresh_nodes(bed, heirs.count, heirs.node);
    silt_sum(&bed->pore_water, &bed->pore_rest,
             scene->bed.saturation * (patch->area - patch->mass / scene->bed.density) * scene->fluid.density);
    silt_bed_heirs_give(&heirs, bed);
}

void silt_bed_release(silt_bed *bed, const silt_scene *scene, const silt_patch *patch) {
    if (patch->n_cell == 0)
        return;
    silt_bed_take_out(bed, scene, patch);
    silt_bed_refresh(bed);
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
    const int dim = bed_dim(bed);
    int *root = silt_alloc(n_cell, sizeof *root);
    double *area = silt_alloc(n_cell, sizeof *area);
    uint8_t *held = silt_alloc(n_cell, 1), *covered = silt_alloc(n_cell, 1);
    for (int c = 0; c < bed->n_cell; c++)
        root[c] = c;
    for (int c = 0; c < bed->n_cell; c++)
        for (int a = 0; a <= dim; a++) {
            int facet[3], turned[3];
            bed_facet(dim, bed->cell[c], a, facet);
            bed_facet_turned(facet, turned);
            const int across = silt_bed_cell_at(bed, turned);
            const int p = piece_root(root, c), q = across >= 0 ? piece_root(root, across) : p;
            root[p > q ? p : q] = p > q ? q : p;
        }
    for (int c = 0; c < bed->n_cell; c++) {
        const int p = piece_root(root, c);
        area[p] += bed->area[c];
        for (int a = 0; a <= dim && !held[p]; a++) {
            int facet[3], turned[3];
            bed_facet(dim, bed->cell[c], a, facet);
            bed_facet_turned(facet, turned);
            held[p] = silt_bed_cell_at(bed, turned) < 0 && silt_bed_on_wall(bed, scene, facet);
        }
    }

    // nodes whose patches cover the loose cells, those first that take nothing else along
    const double size = bed_size(scene), small = dim == 3 ? 10 * 1.25 * size * size * size : 10 * 3 * sqrt(3.0) / 4 * silt_square(size);
    int n = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int c = 0; c < bed->n_cell && n < capacity; c++) {
            const int p = piece_root(root, c);
            if (held[p] || area[p] >= small || covered[c])
                continue;
            int best = -1, most = 0;
            for (int a = 0; a <= dim; a++) {
                const int k = bed->cell[c][a];
                int own = 0, other = 0;
                for (int place = bed->index->first[k]; place >= 0; place = bed->index->next[place]) {
                    own += piece_root(root, place / 4) == p && !covered[place / 4];
                    other += piece_root(root, place / 4) != p;
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
                covered[place / 4] = 1;
        }
    free(root);
    free(area);
    free(held);
    free(covered);
    return n;
}

// keeps the water's mesh on the bed and, in space, on bodies: edges (in space faces) of theirs that the triangulation has lost

#include "remesh.h"
#include "solid.h"

// A node close over a face of the bed or a body is joined by the triangulation to nodes on its other side, right through it. Such cells are
// no water, and a hollow without pressure would stay on the face. It is filled by cells between faces and node.
#define FIT_FLAT 0.002 // times h: flatter cells are left out

/** a free facet with two nodes on the bed or on one body, from -> to as it lists them, and its third node */
typedef struct fit_rim {
    int from, to, apex;
} fit_rim;

/** a side of a face of the bed or a body that is no facet of the water */
typedef struct fit_side {
    int from, to, face;
} fit_side;

typedef struct fit {
    silt_draft *draft;
    const silt_nodes *nodes;
    int n_rim, rim_capacity, n_side, side_capacity, n_face, face_capacity;
    fit_rim *rim;   // owned, sorted
    fit_side *side; // owned, sorted
    int (*face)[4]; // owned, the faces that are missing, in the water's numbers, counter-clockwise seen from it; fourth -1
    int *stack, *state; // owned, one per face: of the fill at work (state 1), filled (2)
} fit;

static int compare_three(const void *p, const void *q) {
    const int *a = p, *b = q;
    for (int k = 0; k < 3; k++)
        if (a[k] != b[k])
            return a[k] < b[k] ? -1 : 1;
    return 0;
}

// the first of n sorted records of three numbers that is not before from, to, -1
static int first_from(int n, const void *record, int from, int to) {
    const int(*all)[3] = record, key[3] = {from, to, -1};
    int lo = 0, hi = n;
    while (lo < hi) {
        const int middle = (lo + hi) / 2;
        if (compare_three(all[middle], key) < 0)
            lo = middle + 1;
        else
            hi = middle;
    }
    return lo;
}

// which solid a node is of: a body, -1 the bed, -2 none
static int fit_owner(const silt_nodes *nodes, int i) {
    return nodes->kind[i] == NODE_BODY ? nodes->owner[i] : nodes->kind[i] == NODE_BED ? -1 : -2;
}

// a face that no facet of the water is
static void fit_missing(fit *f, const silt_cell_set *set, const int face[4]) {
    if (face[0] < 0 || face[1] < 0 || face[2] < 0 || silt_cell_set_find(set, face) >= 0)
        return;
    SILT_RESERVE(f->face, f->face_capacity, f->n_face + 1);
    memcpy(f->face[f->n_face], face, sizeof *f->face);
    SILT_RESERVE(f->side, f->side_capacity, f->n_side + 3);
    for (int a = 0; a < 3; a++)
        f->side[f->n_side++] = (fit_side){face[a], face[(a + 1) % 3], f->n_face};
    f->n_face++;
}

// The water's node of every point of the bodies' surfaces, one body after the other: they were the first nodes, in this order, and
// keep their ids. @return owned by the caller
static int *fit_body_nodes(const silt_nodes *nodes, const silt_body_state *bodies) {
    int n = 0;
    for (int b = 0; b < bodies->count; b++)
        n += bodies->body[b].n_point;
    int *node = silt_alloc((size_t)n + 1, sizeof *node);
    for (int k = 0; k < n; k++)
        node[k] = -1;
    for (int i = 0; i < nodes->count; i++)
        if (nodes->kind[i] == NODE_BODY && nodes->id[i] < n)
            node[nodes->id[i]] = i;
    return node;
}

static void fit_bodies(fit *f, const silt_cell_set *set, const silt_body_state *bodies) {
    int *node = fit_body_nodes(f->nodes, bodies), first = 0;
    for (int b = 0; b < bodies->count; b++) {
        const struct silt_body *body = &bodies->body[b];
        for (int k = 0; k < body->n_face; k++) {
            const int *point = body->face[k], face[4] = {node[first + point[0]], node[first + point[1]], node[first + point[2]], -1};
            fit_missing(f, set, face);
        }
        first += body->n_point;
    }
    free(node);
}

// the cell behind one of the listed facets, and its node that is not on it; -1: there is no such facet
static int facet_cell(const silt_mesh *mesh, const silt_cell_set *set, const int *behind, int a, int b, int c, int *apex) {
    const int key[4] = {a, b, c, -1}, k = silt_cell_set_find(set, key);
    if (k < 0)
        return -1;
    for (int n = 0; n < 4; n++) {
        const int i = mesh->cell[behind[k]][n];
        *apex = i == a || i == b || i == c ? *apex : i;
    }
    return behind[k];
}

// An edge A D between the faces A D C and D A B of a body that stands out, with a node W close over it: the triangulation has the cells
// A B C W and B D C W, which go through the body, in place of A D C W and D A B W.
static void fit_ridges(silt_draft *draft, const silt_nodes *nodes, const silt_body_state *bodies, double size) {
    silt_mesh *mesh = draft->mesh;
    int(*facet)[4] = NULL, *behind = NULL, n = 0, capacity = 0, behind_capacity = 0, exchanged = 0, first = 0;
    for (int e = 0; e < mesh->n_cell; e++)
        for (int a = 0; a < 4; a++) {
            int own[4] = {-1, -1, -1, -1};
            if (mesh->across[e][a] >= 0)
                continue;
            silt_cell_facet(3, mesh->cell[e], a, own);
            const int of = fit_owner(nodes, own[0]);
            if (of < 0 || fit_owner(nodes, own[1]) != of || fit_owner(nodes, own[2]) != of)
                continue;
            SILT_RESERVE(facet, capacity, n + 1);
            SILT_RESERVE(behind, behind_capacity, n + 1);
            memcpy(facet[n], own, sizeof own);
            behind[n++] = e;
        }
    silt_cell_set set;
    silt_cell_set_create(&set, nodes->count, n, (const int(*)[4])facet);
    int *node = fit_body_nodes(nodes, bodies);
    for (int b = 0; b < bodies->count; first += bodies->body[b++].n_point) {
        const silt_solid *solid = bodies->body[b].solid;
        for (int f = 0; solid && f < solid->n_face; f++)
            for (int k = 0; k < 3; k++) {
                const int g = solid->beside[f][k], *at = solid->face[f], *other = solid->face[g];
                const int m = other[0] != at[k] && other[0] != at[(k + 1) % 3] ? 0 : other[1] != at[k] && other[1] != at[(k + 1) % 3] ? 1 : 2;
                const int A = node[first + at[k]], D = node[first + at[(k + 1) % 3]], C = node[first + at[(k + 2) % 3]], B = node[first + other[m]];
                int apex[4] = {-1, -1, -1, -1};
                if (g < f || A < 0 || B < 0 || C < 0 || D < 0 || facet_cell(mesh, &set, behind, A, D, C, &apex[2]) >= 0 ||
                    facet_cell(mesh, &set, behind, D, A, B, &apex[3]) >= 0)
                    continue;
                const int e = facet_cell(mesh, &set, behind, A, B, C, &apex[0]), o = facet_cell(mesh, &set, behind, B, D, C, &apex[1]);
                if (e < 0 || o < 0 || e == o || apex[0] != apex[1])
                    continue;
                const int fresh[2][4] = {{A, D, C, apex[0]}, {D, A, B, apex[0]}}, old[2] = {e, o};
                const double h = silt_node_h(nodes, apex[0], size);
                silt_cell_shape shape[2];
                double corner[12];
                bool sound = true;
                for (int c = 0; c < 2; c++) {
                    silt_cell_corners(mesh, nodes->x, fresh[c], corner);
                    shape[c] = silt_cell_measure(3, corner);
                    sound &= shape[c].volume > 0 && shape[c].height > FIT_FLAT * h;
                }
                for (int c = 0; c < 2 && sound; c++) {
                    memcpy(mesh->cell[old[c]], fresh[c], sizeof fresh[c]);
                    draft->before[old[c]] = -2;
                    draft->quality[old[c]] = shape[c].height / h;
                    exchanged++;
                }
            }
    }
    silt_cell_set_clear(&set);
    free(facet);
    free(behind);
    free(node);
    if (exchanged)
        silt_cells_across(3, nodes->count, mesh->n_cell, (const int(*)[4])mesh->cell, mesh->across);

}

// free facets at the bed and bodies, and which of their faces are facets of the water
static void fit_collect(fit *f, const silt_barrier *barrier) {
    const silt_mesh *mesh = f->draft->mesh;
    int(*facet)[4] = NULL, n = 0, capacity = 0;
    for (int e = 0; e < mesh->n_cell; e++)
        for (int a = 0; a < 4; a++) {
            if (mesh->across[e][a] >= 0)
                continue;
            int own[4] = {-1, -1, -1, -1}, of[3], other = -1;
            silt_cell_facet(3, mesh->cell[e], a, own);
            for (int k = 0; k < 3; k++)
                of[k] = fit_owner(f->nodes, own[k]);
            // the one that is not of the others' solid
            for (int k = 0; k < 3; k++)
                if (of[(k + 1) % 3] == of[(k + 2) % 3] && of[(k + 1) % 3] != -2 && of[k] != of[(k + 1) % 3])
                    other = k;
            if (of[0] == of[1] && of[1] == of[2] && of[0] != -2) {
                SILT_RESERVE(facet, capacity, n + 1);
                memcpy(facet[n++], own, sizeof own);
            } else if (other >= 0 && silt_facet_kind_of(mesh, f->nodes, own) == FACET_FREE) {
                SILT_RESERVE(f->rim, f->rim_capacity, f->n_rim + 1);
                f->rim[f->n_rim++] = (fit_rim){own[(other + 1) % 3], own[(other + 2) % 3], own[other]};
            }
        }
    silt_cell_set set;
    silt_cell_set_create(&set, f->nodes->count, n, (const int(*)[4])facet);
    const silt_bed *bed = barrier->bed;
    for (int k = 0; bed && k < bed->n_edge && f->n_rim; k++) {
        int face[4] = {-1, -1, -1, -1};
        for (int a = 0; a < 3; a++)
            face[a] = bed->fluid_node[bed->edge[k][a]];
        fit_missing(f, &set, face);
    }
    if (barrier->bodies && f->n_rim)
        fit_bodies(f, &set, barrier->bodies);
    silt_cell_set_clear(&set);
    free(facet);
    if (f->n_face) {
        qsort(f->rim, (size_t)f->n_rim, sizeof *f->rim, compare_three);
        qsort(f->side, (size_t)f->n_side, sizeof *f->side, compare_three);
    }
}

// the first free facet that has from -> to, or -1
static int fit_first(const fit *f, int from, int to) {
    const int lo = first_from(f->n_rim, f->rim, from, to);
    return lo < f->n_rim && f->rim[lo].from == from && f->rim[lo].to == to ? lo : -1;
}

// the missing face that has from -> to, or -1
static int fit_neighbour(const fit *f, int from, int to) {
    const int lo = first_from(f->n_side, f->side, from, to);
    return lo < f->n_side && f->side[lo].from == from && f->side[lo].to == to ? f->side[lo].face : -1;
}

static silt_cell_shape fit_shape(const fit *f, int face, int apex) {
    const int cell[4] = {f->face[face][0], f->face[face][1], f->face[face][2], apex};
    double corner[12];
    silt_cell_corners(f->draft->mesh, f->nodes->x, cell, corner);
    return silt_cell_measure(3, corner);
}

// true when a free facet closes the fill there, or a wall does
static bool fit_closed(const fit *f, int from, int to, int apex) {
    const int facet[3] = {from, to, apex};
    for (int k = fit_first(f, to, from); k >= 0 && k < f->n_rim && f->rim[k].from == to && f->rim[k].to == from; k++)
        if (f->rim[k].apex == apex)
            return true;
    return silt_facet_kind_of(f->draft->mesh, f->nodes, facet) == FACET_WALL;
}

// The faces from `face` on that the hollow under `apex` lies on, into the stack. @return how many; 0: it does not close
static int fit_flood(fit *f, int face, int apex, double size) {
    int n = 1;
    bool whole = true;
    f->stack[0] = face;
    f->state[face] = 1;
    for (int top = 0; top < n && whole; top++) {
        const int *own = f->face[f->stack[top]];
        const silt_cell_shape shape = fit_shape(f, f->stack[top], apex);
        const double h = silt_node_h(f->nodes, apex, size);
        whole = shape.volume > 0 && shape.height > FIT_FLAT * h;
        for (int a = 0; a < 3 && whole; a++) {
            const int from = own[a], to = own[(a + 1) % 3], next = fit_neighbour(f, to, from);
            if (fit_closed(f, from, to, apex) || (next >= 0 && f->state[next] == 1))
                continue;
            whole = next >= 0 && f->state[next] == 0;
            if (whole) {
                f->stack[n++] = next;
                f->state[next] = 1;
            }
        }
    }
    for (int k = 0; k < n; k++)
        f->state[f->stack[k]] = whole ? 2 : 0;
    return whole ? n : 0;
}

// ---- in the plane

// sides of the water's cells without a neighbour, as the cells go round; sorted. @return how many
static int free_sides(const silt_mesh *mesh, int (**side)[3]) {
    int n = 0, capacity = 0;
    for (int e = 0; e < mesh->n_cell; e++)
        for (int a = 0; a < 3; a++)
            if (mesh->across[e][a] < 0) {
                SILT_RESERVE(*side, capacity, n + 1);
                memcpy((*side)[n++], (int[3]){mesh->cell[e][(a + 1) % 3], mesh->cell[e][(a + 2) % 3], 0}, sizeof **side);
            }
    if (n)
        qsort(*side, (size_t)n, sizeof **side, compare_three);
    return n;
}

static bool side_there(int n, const int (*side)[3], int from, int to) {
    const int k = first_from(n, side, from, to);
    return k < n && side[k][0] == from && side[k][1] == to;
}

// the hollow between a lost edge of the bed and two sides of the water, or one and a wall
static void fit_edges(silt_draft *draft, const silt_nodes *nodes, const silt_bed *bed, double size) {
    int(*side)[3] = NULL;
    const silt_mesh *mesh = draft->mesh;
    const int n = free_sides(mesh, &side);
    for (int k = 0; k < bed->n_edge; k++) {
        const int from = bed->fluid_node[bed->edge[k][0]], to = bed->fluid_node[bed->edge[k][1]];
        if (from < 0 || to < 0 || side_there(n, side, from, to))
            continue;
        for (int m = first_from(n, side, from, -1); m < n && side[m][0] == from; m++) {
            const int cell[4] = {from, to, side[m][1], -1}, last[3] = {side[m][1], to, -1};
            if (cell[2] == to || !(side_there(n, side, cell[2], to) || silt_facet_kind_of(mesh, nodes, last) == FACET_WALL))
                continue;
            double corner[12];
            silt_cell_corners(mesh, nodes->x, cell, corner);
            const silt_cell_shape shape = silt_cell_measure(2, corner);
            if (shape.volume > 0 && shape.height > FIT_FLAT * silt_node_h(nodes, cell[2], size)) {
                silt_draft_push(draft, cell, -2, shape.height / size);
                break;
            }
        }
    }
    free(side);
}

int silt_mesh_fit(silt_draft *draft, const silt_nodes *nodes, const silt_barrier *barrier, double size) {
    const bool bed = barrier->bed && barrier->bed->n_cell;
    if (draft->mesh->dim != 3) {
        const int first = draft->mesh->n_cell;
        if (bed)
            fit_edges(draft, nodes, barrier->bed, size);
        return draft->mesh->n_cell - first;
    }
    if (!bed && !(barrier->bodies && barrier->bodies->count))
        return 0;
    if (barrier->bodies && barrier->bodies->count)
        fit_ridges(draft, nodes, barrier->bodies, size);
    fit f = {.draft = draft, .nodes = nodes};
    const int before = draft->mesh->n_cell;
    fit_collect(&f, barrier);
    f.stack = silt_alloc((size_t)f.n_face + 1, sizeof *f.stack);
    f.state = silt_alloc((size_t)f.n_face + 1, sizeof *f.state);
    for (int k = 0; k < f.n_face; k++)
        for (int a = 0; a < 3 && f.state[k] == 0; a++) {
            const int from = f.face[k][a], to = f.face[k][(a + 1) % 3];
            for (int r = fit_first(&f, to, from); r >= 0 && r < f.n_rim && f.rim[r].from == to && f.rim[r].to == from; r++) {
                const int n = fit_flood(&f, k, f.rim[r].apex, size);
                for (int m = 0; m < n; m++) {
                    const int *face = f.face[f.stack[m]], cell[4] = {face[0], face[1], face[2], f.rim[r].apex};
                    silt_draft_push(draft, cell, -2, fit_shape(&f, f.stack[m], f.rim[r].apex).height / size);
                }
                if (n)
                    break;
            }
        }
    free(f.rim);
    free(f.side);
    free(f.face);
    free(f.stack);
    free(f.state);
    return draft->mesh->n_cell - before;
}

// traction of walls and of the bed on water whose boundary layer is thinner than a cell
#include "viscosity.h"

#define WALL_SMOOTH 9.8    // E of u+ = ln(E y+)/kappa
#define WALL_THIN 3.0      // least 30 y/k_s: water that is thinner than a tenth of the roughness
#define WALL_HEIGHT 2.0    // times h, where the scene says nothing
#define TOE_REACH 30.0     // times h: farther behind the water's edge the layer has grown up
#define TOE_STRESS 0.4438  // tau sqrt(U s/nu)/(rho U^2) of a wall drawn through still water (Sakiadis 1961)
#define WALK_LIMIT 64      // cells on the way to a sample
#define BISECTIONS 10

// the element that the nodes of a wall's facet share, or that one of them has
static int facet_element(const silt_walls *walls, const silt_nodes *nodes, const int *facet, int n) {
    int any = -1;
    for (int a = 0; a < n; a++)
        for (int s = 0; s < 3; s++) {
            const int element = nodes->wall[facet[a]][s];
            if (element < 0)
                continue;
            if (any < 0)
                any = element;
            int sharing = 0;
            for (int b = 0; b < n; b++)
                for (int t = 0; t < 3; t++) {
                    const int other = nodes->wall[facet[b]][t];
                    if (other >= 0 && walls->patch[other] == walls->patch[element]) {
                        sharing++;
                        break;
                    }
                }
            if (sharing == n)
                return element;
        }
    // between corners that point into the water
    for (int a = 0; a < n && any < 0; a++)
        if (nodes->kind[facet[a]] == NODE_CORNER)
            any = nodes->owner[facet[a]];
    return any;
}

// condition, roughness and element (-1: bed or body) of a facet
static int condition_of(const silt_scene *scene, const silt_walls *walls, const silt_nodes *nodes, const silt_mesh *mesh,
                        int facet, double *roughness, int *element) {
    *roughness = 0;
    *element = -1;
    switch (mesh->facet_kind[facet]) {
    case FACET_BED:
        if (scene->bed.condition == WALL_LAW)
            *roughness = silt_bed_roughness(scene);
        return scene->bed.condition == WALL_DEFAULT ? WALL_NO_SLIP : (int)scene->bed.condition;
    case FACET_BODY:
        *roughness = scene->body[nodes->owner[mesh->facet[facet][0]]].roughness;
        return (int)scene->body[nodes->owner[mesh->facet[facet][0]]].condition;
    case FACET_WALL:
        *element = walls ? facet_element(walls, nodes, mesh->facet[facet], mesh->dim == 3 ? 3 : 2) : -1;
        if (*element < 0 || !walls->slip[*element])
            return WALL_NO_SLIP;
        if (walls->roughness[*element] < 0)
            return WALL_SLIP;
        *roughness = walls->roughness[*element];
        return WALL_LAW;
    default:
        return -1;
    }
}

int silt_facet_condition(const silt_scene *scene, const silt_walls *walls, const silt_nodes *nodes, const silt_mesh *mesh,
                         int facet, double *roughness) {
    int element;
    return condition_of(scene, walls, nodes, mesh, facet, roughness, &element);
}

double silt_wall_height(const silt_fluid_def *fluid) { return fluid->wall_height > 0 ? fluid->wall_height : WALL_HEIGHT; }

double silt_wall_stress(double rho, double nu, double speed, double height, double roughness, double *slope) {
    // laminar up to where the log layer resists more
    double star = sqrt(nu * speed / height), rise = rho * nu / height;
    if (speed > 0 && height * star > 5 * nu) {
        // Newton on u* ln(E y u*/nu)/kappa = speed, convex and rising from above the root of the logarithm's argument
        const double scale = WALL_SMOOTH * height / nu;
        double guess = nu > 0 ? silt_max(0.06 * speed, 2.72 / scale) : 0;
        for (int k = 0; k < 50 && nu > 0; k++) {
            const double part = log(silt_max(scale * guess, 2.72));
            const double step = (guess * part / SILT_KAPPA - speed) * SILT_KAPPA / (part + 1);
            guess = silt_max(guess - step, 1 / scale);
            if (fabs(step) <= 1e-13 * guess)
                break;
        }
        if (guess > star) {
            star = guess;
            rise = 2 * rho * star * SILT_KAPPA / (log(scale * star) + 1);
        }
    }
    if (roughness > 0) {
        const double part = SILT_KAPPA / log(silt_max(30 * height / roughness, WALL_THIN));
        if (part * speed > star) {
            star = part * speed;
            rise = 2 * rho * part * star;
        }
    }
    if (slope)
        *slope = rise;
    return rho * star * star;
}

// ---- where to look at the water

static double volume6(const double *a, const double *b, const double *c, const double *d) {
    double u[3], v[3], w[3];
    for (int k = 0; k < 3; k++) {
        u[k] = b[k] - a[k];
        v[k] = c[k] - a[k];
        w[k] = d[k] - a[k];
    }
    return silt_triple(u, v, w);
}

// barycentric weights of a point in a cell; false when the cell is flat
static bool weights(const silt_mesh *mesh, const double *x, int e, const double *point, double weight[4]) {
    const int dim = mesh->dim == 3 ? 3 : 2;
    double c[12], p[3];
    silt_cell_corners(mesh, x, mesh->cell[e], c);
    for (int d = 0; d < dim; d++)
        p[d] = c[d] + silt_shortest(mesh, d, point[d] - c[d]);
    if (dim == 2) {
        const double twice = (c[2] - c[0]) * (c[5] - c[1]) - (c[3] - c[1]) * (c[4] - c[0]);
        weight[1] = ((p[0] - c[0]) * (c[5] - c[1]) - (p[1] - c[1]) * (c[4] - c[0])) / twice;
        weight[2] = ((c[2] - c[0]) * (p[1] - c[1]) - (c[3] - c[1]) * (p[0] - c[0])) / twice;
        weight[0] = 1 - weight[1] - weight[2];
        return twice > 0;
    }
    const double six = volume6(c, c + 3, c + 6, c + 9);
    weight[0] = volume6(p, c + 3, c + 6, c + 9) / six;
    weight[1] = volume6(c, p, c + 6, c + 9) / six;
    weight[2] = volume6(c, c + 3, p, c + 9) / six;
    weight[3] = 1 - weight[0] - weight[1] - weight[2];
    return six > 0;
}

// the cell across the face opposite to corner a, -1
static int cell_across(const silt_mesh *mesh, int e, int a) {
    const int dim = mesh->dim == 3 ? 3 : 2, *cell = mesh->cell[e];
    const int pivot = cell[a == 0 ? 1 : 0];
    for (int k = mesh->node_cell_start[pivot]; k < mesh->node_cell_start[pivot + 1]; k++) {
        const int other = mesh->node_cell[k];
        int shared = 0;
        for (int b = 0; b <= dim; b++)
            for (int c = 0; c <= dim && b != a; c++)
                shared += mesh->cell[other][c] == cell[b];
        if (other != e && shared == dim)
            return other;
    }
    return -1;
}

// walks from cell to cell towards the point; -1: it does not lie in water
static int walk(const silt_mesh *mesh, const double *x, int from, const double *point, double weight[4]) {
    const int dim = mesh->dim == 3 ? 3 : 2;
    int e = from;
    for (int step = 0; step < WALK_LIMIT && e >= 0; step++) {
        if (!weights(mesh, x, e, point, weight))
            return -1;
        int next = -1;
        double least = -1e-9;
        bool inside = true;
        for (int a = 0; a <= dim; a++) {
            if (weight[a] >= -1e-9)
                continue;
            inside = false;
            const int other = weight[a] < least ? cell_across(mesh, e, a) : -1;
            if (other >= 0) {
                least = weight[a];
                next = other;
            }
        }
        if (inside)
            return e;
        e = next;
    }
    return -1;
}

// along the normal to the height that is wanted or to where the water ends; else the neighbour that lies farthest off the wall
static void point_sample(silt_wall_point *point, const silt_mesh *mesh, const double *x, double wanted) {
    const int dim = mesh->dim == 3 ? 3 : 2, i = point->node;
    const double *origin = x + dim * i;
    double low = 0, high = wanted, place[3], weight[4] = {0};
    int found = -1;
    for (int k = 0; k <= BISECTIONS; k++) {
        const double height = k == 0 ? wanted : 0.5 * (low + high);
        for (int d = 0; d < dim; d++)
            place[d] = origin[d] + height * point->normal[d];
        // the walk may meet a bay of the boundary: try from every cell of the node
        int e = -1;
        for (int m = mesh->node_cell_start[i]; m < mesh->node_cell_start[i + 1] && e < 0; m++)
            e = walk(mesh, x, mesh->node_cell[m], place, weight);
        if (e < 0) {
            high = height;
            continue;
        }
        low = height;
        found = e;
        for (int a = 0; a < 4; a++) {
            point->sample[a] = a <= dim ? mesh->cell[e][a] : -1;
            point->weight[a] = a <= dim ? weight[a] : 0;
        }
        if (k == 0)
            break;
    }
    point->height = found >= 0 ? low : 0;
    if (point->height == wanted)
        return;
    for (int m = mesh->neighbour_start[i]; m < mesh->neighbour_start[i + 1]; m++) {
        const int j = mesh->neighbour[m];
        double off = 0;
        for (int d = 0; d < dim; d++)
            off += silt_shortest(mesh, d, x[dim * j + d] - origin[d]) * point->normal[d];
        if (silt_min(off, wanted) <= point->height)
            continue;
        const double part = silt_min(wanted / off, 1);
        point->height = silt_min(off, wanted);
        for (int a = 0; a < 4; a++) {
            point->sample[a] = a == 0 ? j : a == 1 ? i : -1;
            point->weight[a] = a == 0 ? part : a == 1 ? 1 - part : 0;
        }
    }
    if (!(point->height > 0))
        point->area = 0;
}

// ---- the edge of water that runs over dry wall

// The layer of slow water on a wall begins where the water first meets it: behind the edge of water that runs over dry wall it is
// thinner than any film, and its stress larger than that of a layer grown through the water. Finds how far each point is from
// such an edge. law->entry: points of the nodes; facets of the law only.
static void toe_find(silt_wall_law *law, const silt_scene *scene, const silt_walls *walls, const silt_nodes *nodes,
                     const silt_mesh *mesh, const double *x) {
    const int dim = mesh->dim == 3 ? 3 : 2, n = mesh->n_node;
    uint8_t *edge = silt_alloc((size_t)n + 1, 1);
    double *out = silt_alloc((size_t)n + 1, 3 * sizeof *out), roughness;
    int element, n_edge = 0;
    for (int k = 0; k < mesh->n_facet; k++) {
        const bool open = mesh->facet_kind[k] == FACET_FREE;
        const bool law_wall = !open && condition_of(scene, walls, nodes, mesh, k, &roughness, &element) == WALL_LAW;
        const int *facet = mesh->facet[k];
        for (int a = 0; a < dim; a++) {
            edge[facet[a]] |= open ? 1 : law_wall && nodes->kind[facet[a]] != NODE_BODY ? 2 : 0;
            // out of the wetted part of the wall
            for (int b = 0; b < dim && law_wall; b++)
                for (int d = 0; d < dim && b != a; d++)
                    out[3 * facet[a] + d] += silt_shortest(mesh, d, x[dim * facet[a] + d] - x[dim * facet[b] + d]);
        }
    }
    int *list = silt_alloc((size_t)law->n_point + 1, sizeof *list);
    for (int q = 0; q < law->n_point; q++) {
        const silt_wall_point *point = &law->point[q];
        const int i = point->node;
        double ahead = 0;
        for (int d = 0; d < dim && edge[i] == 3; d++)
            ahead += (nodes->v[dim * i + d] - point->velocity[d]) * out[3 * i + d];
        if (ahead > 0)
            list[n_edge++] = i;
    }
    for (int q = 0; q < law->n_point; q++) {
        silt_wall_point *point = &law->point[q];
        const double h = silt_node_h(nodes, point->node, scene->fluid.size);
        double nearest = silt_square(TOE_REACH * h);
        for (int k = 0; k < n_edge; k++) {
            double way = 0, off = 0;
            for (int d = 0; d < dim; d++) {
                const double part = silt_shortest(mesh, d, x[dim * point->node + d] - x[dim * list[k] + d]);
                way += part * part;
                off += part * point->normal[d];
            }
            // on this wall, not on one across the corner
            if (off * off < 0.25 * h * h && way < nearest)
                nearest = way;
        }
        // the edge itself stands for the half facet behind it: mean of s^-1/2
        point->toe = nearest < silt_square(TOE_REACH * h) ? silt_max(sqrt(nearest), 0.125 * h) : 0;
    }
    free(edge);
    free(out);
    free(list);
}

void silt_wall_law_place(silt_wall_law *law, const silt_scene *scene, const silt_walls *walls, const silt_nodes *nodes,
                         const silt_mesh *mesh, const double *x) {
    const int dim = mesh->dim == 3 ? 3 : 2, n = mesh->n_node;
    law->n_point = 0;
    memset(law->y_plus, 0, sizeof law->y_plus);

    // nodes of the law's facets, rising
    SILT_RESERVE(law->entry, law->entry_capacity, n + 1);
    memset(law->entry, 0, (size_t)n * sizeof *law->entry);
    bool any = false;
    double roughness;
    int element;
    for (int k = 0; k < mesh->n_facet; k++)
        if (condition_of(scene, walls, nodes, mesh, k, &roughness, &element) == WALL_LAW) {
            any = true;
            for (int a = 0; a < dim; a++)
                law->entry[mesh->facet[k][a]] = 1;
        }
    if (!any)
        return;
    for (int i = 0; i < n; i++) {
        if (!law->entry[i])
            continue;
        SILT_RESERVE(law->point, law->point_capacity, law->n_point + 1);
        law->entry[i] = law->n_point;
        law->point[law->n_point++] = (silt_wall_point){.node = i, .element = -1};
    }

    // shares of the facets, their normals into the water
    for (int k = 0; k < mesh->n_facet; k++) {
        const int *facet = mesh->facet[k];
        if (condition_of(scene, walls, nodes, mesh, k, &roughness, &element) != WALL_LAW)
            continue;
        double edge[2][3] = {{0}}, normal[3];
        for (int a = 1; a < dim; a++)
            for (int d = 0; d < dim; d++)
                edge[a - 1][d] = silt_shortest(mesh, d, x[dim * facet[a] + d] - x[dim * facet[0] + d]);
        if (dim == 2) {
            normal[0] = -edge[0][1];
            normal[1] = edge[0][0];
            normal[2] = 0;
        } else
            for (int d = 0; d < 3; d++)
                normal[d] = -0.5 * (edge[0][(d + 1) % 3] * edge[1][(d + 2) % 3] - edge[0][(d + 2) % 3] * edge[1][(d + 1) % 3]);
        const double share = sqrt(silt_square(normal[0]) + silt_square(normal[1]) + silt_square(normal[2])) / dim;
        for (int a = 0; a < dim; a++) {
            silt_wall_point *point = &law->point[law->entry[facet[a]]];
            if (point->area == 0)
                point->element = element;
            point->area += share;
            point->roughness += share * roughness;
            for (int d = 0; d < 3; d++)
                point->normal[d] += normal[d];
        }
    }
    for (int q = 0; q < law->n_point; q++) {
        silt_wall_point *point = &law->point[q];
        double *m = point->normal, length = sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
        if (!(length > 0) || !(point->area > 0)) {
            point->area = 0;
            continue;
        }
        for (int d = 0; d < 3; d++)
            m[d] /= length;
        point->roughness /= point->area;
        if (point->element >= 0)
            silt_walls_velocity(walls, scene, point->element, x + dim * point->node, point->velocity);
        const double h = silt_node_h(nodes, point->node, scene->fluid.size);
        point_sample(point, mesh, x, silt_max(silt_wall_height(&scene->fluid) * h, 2 * point->roughness));
    }
    toe_find(law, scene, walls, nodes, mesh, x);
}

void silt_wall_law_traction(silt_wall_law *law, const silt_scene *scene, int dim, const double *v, double *friction,
                            double *force) {
    const double rho = scene->fluid.density, nu = scene->fluid.viscosity / rho;
    double area = 0, sum = 0, low = HUGE_VAL, high = 0;
    for (int q = 0; q < law->n_point; q++) {
        silt_wall_point *point = &law->point[q];
        const int i = point->node;
        friction[i] = 0;
        for (int d = 0; d < dim; d++)
            force[dim * i + d] = point->shear[d] = 0;
        if (!(point->area > 0))
            continue;
        // what passes along the wall at the sample
        double along[3] = {0}, across = 0, speed = 0;
        for (int d = 0; d < dim; d++) {
            for (int a = 0; a < 4 && point->sample[a] >= 0; a++)
                along[d] += point->weight[a] * v[dim * point->sample[a] + d];
            along[d] -= point->velocity[d];
            across += along[d] * point->normal[d];
        }
        for (int d = 0; d < dim; d++) {
            along[d] -= across * point->normal[d];
            speed += silt_square(along[d]);
        }
        speed = sqrt(speed);
        double slope;
        double stress = silt_wall_stress(rho, nu, speed, point->height, point->roughness, &slope);
        const double thin = point->toe > 0 ? TOE_STRESS * rho * speed * sqrt(nu * speed / point->toe) : 0;
        if (thin > stress) {
            stress = thin;
            slope = 1.5 * thin / speed;
        }
        friction[i] = point->area * slope;
        for (int d = 0; d < dim; d++) {
            point->shear[d] = speed > 0 ? stress * along[d] / speed : 0;
            force[dim * i + d] = friction[i] * v[dim * i + d] - point->area * point->shear[d];
        }
        const double plus = nu > 0 ? point->height * sqrt(stress / rho) / nu : 0;
        low = silt_min(low, plus);
        high = silt_max(high, plus);
        sum += point->area * plus;
        area += point->area;
    }
    law->y_plus[0] = area > 0 ? low : 0;
    law->y_plus[1] = area > 0 ? sum / area : 0;
    law->y_plus[2] = high;
}

void silt_wall_law_clear(silt_wall_law *law) {
    free(law->point);
    free(law->entry);
    *law = (silt_wall_law){0};
}

// shapes of the cells on the midpoint mesh, masses and stabilisation. Cells are taken two at a time: what is reckoned for one
// is reckoned for both by the same instruction
#include "fluid.h"
#include "kernel.h"

#define LEAST_WATER 0.05 // share of a cell whose inertia is there however many grains are
#define FLAT_STEP 0.05 // a cell that shrinks below this share on its way keeps the shape it had at the start
#define SLIVER 0.02    // gradients of a tetrahedron are bounded as if its volume were this share of a regular one's
#define REGULAR 0.1178511 // volume of a regular tetrahedron of edge 1

#pragma GCC diagnostic ignored "-Wpsabi" // lanes are passed within this file only
#define LANES 2 // what an SSE2 register holds
typedef double lane __attribute__((vector_size(LANES * sizeof(double))));
#define LANE static inline __attribute__((always_inline)) lane

/** what a cell's shape is made of, for LANES cells */
typedef struct silt_shapes {
    lane flux[4][3], volume, inverse; // V grad N_a, V, 1/V bounded
} silt_shapes;

LANE take(const double *x, const int at[LANES]) { return (lane){x[at[0]], x[at[1]]}; }
typedef long long lane_order __attribute__((vector_size(LANES * sizeof(long long))));

// corners of cells, joined the shortest way across a periodic border
KERNEL corners(const int D, const double period, const double *x, const int at[4][LANES], lane c[4][3]) {
    for (int a = 0; a <= D; a++)
        for (int d = 0; d < D; d++)
            c[a][d] = take(x + d, at[a]);
    for (int a = 1; a <= D && period > 0; a++)
        for (int l = 0; l < LANES; l++)
            c[a][0][l] -= period * floor((c[a][0][l] - c[0][0][l]) / period + 0.5);
}

// V grad N_a. @return volume
LANE shape(const int D, lane c[4][3], lane flux[4][3]) {
    if (D == 2) {
        flux[0][0] = 0.5 * (c[1][1] - c[2][1]);
        flux[0][1] = 0.5 * (c[2][0] - c[1][0]);
        flux[1][0] = 0.5 * (c[2][1] - c[0][1]);
        flux[1][1] = 0.5 * (c[0][0] - c[2][0]);
        flux[2][0] = 0.5 * (c[0][1] - c[1][1]);
        flux[2][1] = 0.5 * (c[1][0] - c[0][0]);
        return 0.5 * ((c[1][0] - c[0][0]) * (c[2][1] - c[0][1]) - (c[1][1] - c[0][1]) * (c[2][0] - c[0][0]));
    }
    lane u[3][3];
    for (int a = 0; a < 3; a++)
        for (int d = 0; d < 3; d++)
            u[a][d] = c[a + 1][d] - c[0][d];
    for (int a = 0; a < 3; a++) {
        const lane *p = u[(a + 1) % 3], *q = u[(a + 2) % 3];
        flux[a + 1][0] = (p[1] * q[2] - p[2] * q[1]) * (1.0 / 6);
        flux[a + 1][1] = (p[2] * q[0] - p[0] * q[2]) * (1.0 / 6);
        flux[a + 1][2] = (p[0] * q[1] - p[1] * q[0]) * (1.0 / 6);
    }
    for (int d = 0; d < 3; d++)
        flux[0][d] = -(flux[1][d] + flux[2][d] + flux[3][d]);
    return u[0][0] * flux[1][0] + u[0][1] * flux[1][1] + u[0][2] * flux[1][2];
}

// 1/volume; of a tetrahedron that is flat for its edges that of a fuller one
LANE bounded_inverse(const int D, lane c[4][3], const lane *whole) {
    lane volume = *whole;
    if (D == 2)
        return 1 / volume;
    lane square = {0};
    for (int a = 0; a < 4; a++)
        for (int b = a + 1; b < 4; b++)
            for (int d = 0; d < 3; d++)
                square += (c[b][d] - c[a][d]) * (c[b][d] - c[a][d]);
    square = square * (1.0 / 6);
    const lane least = SLIVER * SLIVER * REGULAR * REGULAR * square * square * square; // its square
    if (!(volume[0] > 0 && volume[0] * volume[0] >= least[0]))
        volume[0] = sqrt(least[0]);
    if (!(volume[1] > 0 && volume[1] * volume[1] >= least[1]))
        volume[1] = sqrt(least[1]);
    return 1 / volume;
}

// cells at the midpoint; in 3-D fluxes are quadratic in time: their mean over the step is that in the middle and a third of that
// of the way, from the start to the middle
KERNEL shapes_way(const int D, const double period, const double *x, const double *x_mid, const int at[4][LANES], silt_shapes *out) {
    lane c[4][3];
    corners(D, period, x_mid, at, c);
    out->volume = shape(D, c, out->flux);
    out->inverse = bounded_inverse(D, c, &out->volume);
    if (D == 2)
        return;
    lane way[4][3], more[4][3];
    for (int a = 0; a < 4; a++)
        for (int d = 0; d < 3; d++)
            way[a][d] = take(x_mid + d, at[a]) - take(x + d, at[a]);
    shape(D, way, more);
    for (int a = 0; a < 4; a++)
        for (int d = 0; d < 3; d++)
            out->flux[a][d] += more[a][d] * (1.0 / 3);
}

// lanes of cells that went flat on their way: the shape at the start. Few: in registers what is out of the way here would be in memory
static __attribute__((noinline, cold)) void shapes_flat(int D, double period, const double *x, const int at[4][LANES],
                                                        const bool flat[LANES], silt_shapes *out) {
    lane c[4][3], flux[4][3];
    corners(D, period, x, at, c);
    const lane volume = shape(D, c, flux), inverse = bounded_inverse(D, c, &volume);
    for (int l = 0; l < LANES; l++) {
        if (!flat[l])
            continue;
        out->volume[l] = volume[l];
        out->inverse[l] = inverse[l];
        for (int a = 0; a <= D && D == 2; a++)
            for (int d = 0; d < D; d++)
                out->flux[a][d][l] = flux[a][d][l];
    }
}

// places of the nodes of LANES cells; where there are fewer the last one fills up. @return how many
static inline __attribute__((always_inline)) int places(const int D, const silt_fluid *f, const silt_mesh *mesh, int e, int at[4][LANES]) {
    for (int l = 0; l < LANES; l++)
        for (int a = 0; a <= D; a++)
            at[a][l] = D * mesh->cell[e + l < f->n_cell ? e + l : f->n_cell - 1][a];
    return e + LANES <= f->n_cell ? LANES : f->n_cell - e;
}

// volumes where the nodes are, of the cells of a part
KERNEL starts(const int D, const double period, silt_fluid *f, const silt_mesh *mesh, const double *x, int part) {
    for (int e = f->parts.first[part]; e < f->parts.first[part + 1]; e += LANES) {
        int at[4][LANES];
        lane c[4][3], flux[4][3];
        const int many = places(D, f, mesh, e, at);
        corners(D, period, x, at, c);
        const lane volume = shape(D, c, flux);
        for (int l = 0; l < many; l++)
            f->start[e + l] = volume[l];
    }
}

// V grad N_a to the cells, two numbers at a time
KERNEL store_flux(const int D, lane flux[4][3], bool both, double *out) {
    const int n = (D + 1) * D;
    for (int k = 0; k < n; k += 2) {
        const lane one = flux[k / D][k % D], two = flux[(k + 1) / D][(k + 1) % D];
        const lane first = __builtin_shuffle(one, two, (lane_order){0, 2}), second = __builtin_shuffle(one, two, (lane_order){1, 3});
        memcpy(out + k, &first, sizeof first);
        if (both)
            memcpy(out + n + k, &second, sizeof second);
    }
}

// shapes and volumes of the cells of a part; its border cells come next, from b on
KERNEL shapes(const int D, const double period, silt_fluid *f, const silt_mesh *mesh, const double *x, int part) {
    const silt_parts *parts = &f->parts;
    int b = parts->border[part];
    const int end = parts->border[part + 1];
    for (int e = parts->first[part]; e < parts->first[part + 1]; e += LANES) {
        int at[4][LANES];
        silt_shapes s;
        const bool both = places(D, f, mesh, e, at) == LANES;
        shapes_way(D, period, x, f->x_mid, at, &s);
        const bool flat[LANES] = {!(s.volume[0] > FLAT_STEP * f->start[e]), both && !(s.volume[1] > FLAT_STEP * f->start[e + 1])};
        if (flat[0] || flat[1]) {
            silt_shapes mended = s;
            shapes_flat(D, period, x, at, flat, &mended);
            s = mended;
        }
        store_flux(D, s.flux, both, f->flux + (D + 1) * D * e);
        const lane share = s.volume * (1.0 / (D + 1));
        for (int l = 0; l < LANES && (l == 0 || both); l++) {
            f->cell_volume[e + l] = s.volume[l];
            f->inverse[e + l] = s.inverse[l];
            const bool border = b < end && parts->cell[b] == e + l;
            const silt_to to = border ? silt_parts_aside(parts, b) : (silt_to){NULL, f->volume, mesh->cell[e + l]};
            for (int a = 0; a <= D; a++)
                to.one[to.at[a]] += share[l];
            if (border)
                silt_parts_settle(parts, mesh, SUMS(1, NULL, f->volume), b++);
        }
    }
}

KERNEL shapes_part(const int D, silt_fluid *f, const silt_mesh *mesh, const double *x, int part) {
    if (!f->shaped && mesh->period[0] > 0)
        starts(D, mesh->period[0], f, mesh, x, part);
    else if (!f->shaped)
        starts(D, 0, f, mesh, x, part);
    if (mesh->period[0] > 0)
        shapes(D, mesh->period[0], f, mesh, x, part);
    else
        shapes(D, 0, f, mesh, x, part);
}

static void shapes_anywhere(silt_fluid *f, const silt_mesh *mesh, const double *x) {
    memset(f->volume, 0, (size_t)f->n_node * sizeof(double));
    SILT_PRAGMA(omp parallel num_threads(f->parts.n))
    {
        SILT_PRAGMA(omp for schedule(static))
        for (int part = 0; part < f->parts.n; part++)
            BY_DIM(shapes_part, f, mesh, x, part);
        SILT_PRAGMA(omp for schedule(static))
        for (int part = 0; part < f->parts.n; part++)
            silt_parts_finish(&f->parts, SUMS(1, NULL, f->volume), part);
    }
    f->shaped = true;
}

static inline uint64_t bits_of(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

// positions half way. @return whether any is another one than last time
static bool midpoints(silt_fluid *f, const double *x, double dt) {
    uint64_t moved = 0; // bits, since a loop that compares numbers is not reckoned in lanes
    double *x_mid = f->x_mid;
    const double *w = f->w, *shift = f->shift, half = 0.5 * dt;
    const int n = f->dim * f->n_node;
    const int sure = f->belt || f->still ? 0 : n;
    SILT_PRAGMA(omp parallel for schedule(static) num_threads(silt_threads(n)) reduction(|:moved))
    for (int k = 0; k < sure; k++) {
        const double to = x[k] + half * (shift ? w[k] + shift[k] : w[k]);
        moved |= bits_of(to) ^ bits_of(x_mid[k]);
        x_mid[k] = to;
    }
    for (int k = sure; k < n; k++) {
        const double to = x[k] + half * silt_mesh_velocity(f, k);
        moved |= bits_of(to) ^ bits_of(x_mid[k]);
        x_mid[k] = to;
    }
    return moved != 0;
}

// Masses of water between grains, and the grains' share of the cells. Where grains crowd, in a film of water over a heap say, their
// share passes 1: the water keeps the inertia of a twentieth.
KERNEL shares(const int D, silt_fluid *f, const silt_mesh *mesh, const double *solid, double rho) {
    memset(f->mass, 0, (size_t)f->n_node * sizeof(double));
    for (int e = 0; e < f->n_cell; e++) {
        const int *cell = mesh->cell[e];
        for (int a = 0; a <= D; a++) {
            double share = 0;
            for (int b = 0; b <= D; b++)
                share += solid[cell[b]] * (a == b ? 2 : 1) / ((D + 1) * (D + 2));
            f->share[(D + 1) * e + a] = share;
            const double water = 1.0 / (D + 1) - share, least = LEAST_WATER / (D + 1);
            f->mass[cell[a]] += rho * f->cell_volume[e] * (water > least ? water : least);
        }
    }
}

// x^(-1/3): the exponent's third off a constant that makes the first guess good to 3.5 %, then Newton's method without a division,
// which squares the error four times. A loop of it is reckoned in lanes, one of cbrt is not (a fifth of geometry in 3-D).
static inline double inverse_cube_root(double x) {
    uint64_t bits = bits_of(x);
    uint64_t third = (bits >> 2) + (bits >> 4);
    third += third >> 4;
    third += third >> 8;
    third += third >> 16;
    third += third >> 32;
    bits = 0x553ef0ff289dd796u - third;
    double r;
    memcpy(&r, &bits, sizeof r);
    for (int k = 0; k < 4; k++)
        r *= 4.0 / 3 - 1.0 / 3 * x * (r * r * r);
    return r;
}

#define PER_SQUARE 0.740183454 // 8/3 over 0.866 (6 sqrt 2)^(2/3)

// stabilisation: 1/(2 rho/(theta dt) + 8 mu/(3 h^2)), h^2 twice the area of a triangle, of a tetrahedron 0.866 times the square of
// a regular one's edge
static void stabilisation(silt_fluid *f, double inertia) {
    const int n = f->n_cell;
    const double *mu = f->mu, *inverse = f->inverse;
    double *tau = f->tau;
    if (f->dim == 2) {
        SILT_PARALLEL(n)
        for (int e = 0; e < n; e++)
            tau[e] = 1 / (inertia + 4.0 / 3 * mu[e] * inverse[e]);
        return;
    }
    SILT_PARALLEL(n)
    for (int e = 0; e < n; e++) {
        const double per_square = inverse[e] * inverse_cube_root(inverse[e]);
        tau[e] = 1 / (inertia + PER_SQUARE * mu[e] * per_square);
    }
}

void silt_assemble_geometry(silt_fluid *f, const silt_step *step, double dt) {
    const silt_scene *scene = step->scene;
    const silt_drag *drag = step->drag;
    const double rho = scene->fluid.density, per_time = 1 / (f->theta * step->dt);
    // most steps ask twice or three times for what is there: a fifth of their geometry
    if (midpoints(f, step->nodes->x, dt) || !f->shaped) {
        shapes_anywhere(f, step->mesh, step->nodes->x);
        if (f->wall_normals.n_row || f->ride)
            silt_hold_bent(f, step);
        silt_hold_light(f, step);
    }
    if (f->film)
        silt_film_place(f->film, step, f->x_mid, dt);
    stabilisation(f, 2 * rho * per_time);
    if (drag)
        BY_DIM(shares, f, step->mesh, drag->solid, rho);
    SILT_PARALLEL(f->n_node)
    for (int i = 0; i < f->n_node; i++) {
        if (!drag)
            f->mass[i] = rho * f->volume[i];
        f->inertia[i] = step->mesh->wet[i] ? f->mass[i] * per_time + (drag ? drag->coefficient[i] : 0) + f->friction[i] : 1;
    }
    for (int i = 0; f->potential && i < f->n_node; i++)
        f->potential[i] = scene->fluid.density * silt_formula_potential(&scene->fluid.force, f->x_mid + f->dim * i);
}

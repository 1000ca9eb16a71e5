/** @file formula.c
 * Velocities and accelerations by name, by table and by field.
 */
#include "scene.h"

#include <complex.h>

// a small linear system, n rows of n + 1 numbers, the last one the right-hand side; the answer goes into x. False:
// singular
static bool formula_solve(int n, double *a, double *x) {
    const int m = n + 1;
    double largest = 0;
    for (int i = 0; i < n * m; i++)
        largest = i % m < n ? silt_max(largest, fabs(a[i])) : largest;
    for (int i = 0; i < n; i++) {
        int best = i;
        for (int r = i + 1; r < n; r++)
            best = fabs(a[r * m + i]) > fabs(a[best * m + i]) ? r : best;
        if (fabs(a[best * m + i]) <= 1e-12 * largest)
            return false;
        for (int c = i; c < m && best != i; c++) {
            const double other = a[i * m + c];
            a[i * m + c] = a[best * m + c];
            a[best * m + c] = other;
        }
        for (int r = i + 1; r < n; r++) {
            const double share = a[r * m + i] / a[i * m + i];
            for (int c = i; c < m && share != 0; c++)
                a[r * m + c] -= share * a[i * m + c];
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        x[i] = a[i * m + n];
        for (int c = i + 1; c < n; c++)
            x[i] -= a[i * m + c] * x[c];
        x[i] /= a[i * m + i];
    }
    return true;
}

// waves ------------------------------------------------------------------------------------------------
// linear potential wave over a flat bed, about to rise from a flat surface with full velocity:
// eta = a cos(k(x - xc)) sin(omega t), omega^2 = g k tanh(k d). At t = 0 the surface moves with v = a omega cos(k(x -
// xc)), and du/dx + dv/dy = 0 gives u the minus sign.
static void formula_standing_wave(const silt_formula *f, double g, double dx, double dy, double *u, double *w) {
    double k = 2 * M_PI / f->length;
    double omega = sqrt(g * k * tanh(k * f->depth));
    double phase = k * dx, height = k * dy, depth = k * f->depth;
    // cosh(h)/sinh(d) by exponentials that cannot overflow in deep water
    double up = exp(height - depth), down = exp(-height - depth), bottom = 1 - exp(-2 * depth);
    *u = -f->amplitude * omega * sin(phase) * (up + down) / bottom;
    *w = f->amplitude * omega * cos(phase) * (up - down) / bottom;
}

double silt_formula_surface(const silt_formula *formula, const double *x) {
    const double d = formula->depth, k = sqrt(0.75 * formula->amplitude / (d * d * d));
    return formula->amplitude / silt_square(cosh(k * (x[0] - formula->centre[0])));
}

// Solitary wave of Boussinesq's profile eta = H sech^2(k (x - xc)), k^2 = 3 H/(4 d^3), that moves with c^2 = g (d + H).
// First order gives u = eta sqrt(g/d) over the whole depth, which is neither free of sources nor of rotation. Here the
// velocity is that of the potential flow over a flat bed whose surface moves exactly so: u - i v = F(x + i y) with
// F(z) = c sum_k a_k sech^(2k)(k z), which satisfies div u = rot u = 0 everywhere and v = 0 on the bed; the a_k are
// such that the stream function is psi = c eta on the surface, i.e. d(eta)/dt = -c eta' there. Expanded in H/d, this is
// Laitone's (1960) and Grimshaw's (1971) series for the profile given.
enum { SOLITARY_TERMS = 6 };
static void formula_solitary_wave(const silt_formula *f, double g, double dx, double dy, double *u, double *w) {
    const double d = f->depth, k = sqrt(0.75 * f->amplitude / (d * d * d)), c = sqrt(g * (d + f->amplitude));
    double a[SOLITARY_TERMS * (SOLITARY_TERMS + 1)], share[SOLITARY_TERMS];
    // psi = c eta at as many places of the surface as there are terms, both sides divided by sech^2
    for (int j = 0; j < SOLITARY_TERMS; j++) {
        const double s2 = 0.5 * (1 - cos(M_PI * (2 * j + 1) / (2 * SOLITARY_TERMS)));
        const double eta = f->amplitude * s2;
        const double complex t = ctanh(acosh(1 / sqrt(s2)) + I * k * (d + eta));
        for (int n = 0; n < SOLITARY_TERMS; n++) {
            // integral of sech^(2n + 2): sum over m of binomial(n, m) (-1)^m t^(2m + 1)/(2m + 1)
            double complex sum = 0, power = t;
            double binomial = 1;
            for (int m = 0; m <= n; m++) {
                sum += binomial * power / (2 * m + 1);
                power *= t * t;
                binomial *= -(double)(n - m) / (m + 1);
            }
            a[j * (SOLITARY_TERMS + 1) + n] = cimag(sum) / (k * s2);
        }
        a[j * (SOLITARY_TERMS + 1) + SOLITARY_TERMS] = f->amplitude;
    }
    *u = *w = 0;
    if (!formula_solve(SOLITARY_TERMS, a, share))
        return;
    const double complex t = ctanh(k * dx + I * k * dy), s2 = 1 - t * t;
    double complex flow = 0, power = s2;
    for (int n = 0; n < SOLITARY_TERMS; n++, power *= s2)
        flow += share[n] * power;
    const double to = f->rate < 0 ? -c : c;
    *u = to * creal(flow);
    *w = -to * cimag(flow);
}

// fields -----------------------------------------------------------------------------------------------
/** points as a balanced tree: the middle of a stretch of `order` divides it along the coordinate of its level */
struct silt_field {
    int n, dim;
    int *order;     // owned, rows of the series
    uint8_t *along; // owned, coordinate that the node divides
};

enum { FIELD_NEAR_2D = 16, FIELD_NEAR_3D = 24, FIELD_NEAR = FIELD_NEAR_3D, FIELD_FIRST = 16 };
/** the nearest points found so far, nearest first */
typedef struct field_near {
    int n, most, row[FIELD_NEAR];
    double square[FIELD_NEAR];
} field_near;

static int field_dim(const silt_formula *f) {
    return f->dimension == 3 ? 3 : 2;
}

// puts the k-th smallest of a stretch in its place (quickselect), ties by row
static void field_select(const silt_series *series, int *order, int n, int k, int along) {
    const double *value = series->value;
    const size_t m = (size_t)series->n_column;
#define FIELD_LESS(p, q)                                                                                               \
    (value[(size_t)(p)*m + along] < value[(size_t)(q)*m + along] ||                                                    \
     (value[(size_t)(p)*m + along] == value[(size_t)(q)*m + along] && (p) < (q)))
    int low = 0, high = n - 1;
    while (low < high) {
        const int pivot = order[low + (high - low) / 2];
        int i = low, j = high;
        while (i <= j) {
            while (FIELD_LESS(order[i], pivot))
                i++;
            while (FIELD_LESS(pivot, order[j]))
                j--;
            if (i <= j) {
                const int other = order[i];
                order[i++] = order[j];
                order[j--] = other;
            }
        }
        if (k <= j)
            high = j;
        else if (k >= i)
            low = i;
        else
            break;
    }
#undef FIELD_LESS
}

// divides a stretch along its longest side; the depth is the logarithm of its length
static void field_build(silt_field *field, const silt_series *series, int first, int n) {
    if (n < 1)
        return;
    int along = 0;
    double widest = -1;
    for (int k = 0; k < field->dim; k++) {
        double lo = HUGE_VAL, hi = -HUGE_VAL;
        for (int i = first; i < first + n; i++) {
            const double x = series->value[(size_t)field->order[i] * (size_t)series->n_column + k];
            lo = silt_min(lo, x);
            hi = silt_max(hi, x);
        }
        if (hi - lo > widest) {
            widest = hi - lo;
            along = k;
        }
    }
    const int middle = n / 2;
    field_select(series, field->order + first, n, middle, along);
    field->along[first + middle] = (uint8_t)along;
    field_build(field, series, first, middle);
    field_build(field, series, first + middle + 1, n - middle - 1);
}

static void field_offer(field_near *near, const silt_series *series, int dim, int row, const double *x) {
    double square = 0;
    for (int k = 0; k < dim; k++)
        square += silt_square(series->value[(size_t)row * (size_t)series->n_column + k] - x[k]);
    if (near->n == near->most && square >= near->square[near->n - 1])
        return;
    int at = near->n < near->most ? near->n++ : near->n - 1;
    for (; at > 0 && near->square[at - 1] > square; at--) {
        near->square[at] = near->square[at - 1];
        near->row[at] = near->row[at - 1];
    }
    near->square[at] = square;
    near->row[at] = row;
}

static void field_search(const silt_field *field, const silt_series *series, int first, int n, const double *x,
                         field_near *near) {
    if (n < 1)
        return;
    const int middle = n / 2, row = field->order[first + middle], along = field->along[first + middle];
    const double apart = x[along] - series->value[(size_t)row * (size_t)series->n_column + along];
    field_offer(near, series, field->dim, row, x);
    // the side of the point first, the other one only when it may hold a nearer point
    for (int side = 0; side < 2; side++) {
        if (side == 1 && near->n == near->most && silt_square(apart) >= near->square[near->n - 1])
            break;
        if ((apart < 0) == (side == 0))
            field_search(field, series, first, middle, x, near);
        else
            field_search(field, series, first + middle + 1, n - middle - 1, x, near);
    }
}

int silt_formula_index(silt_formula *formula) {
    const silt_series *series = &formula->series;
    const int n = series->n_row, dim = field_dim(formula);
    silt_field *field = silt_alloc(1, sizeof *field);
    field->n = n;
    field->dim = dim;
    field->order = silt_alloc((size_t)n, sizeof *field->order);
    field->along = silt_alloc((size_t)n, sizeof *field->along);
    for (int i = 0; i < n; i++)
        field->order[i] = i;
    field_build(field, series, 0, n);
    formula->field = field;
    // two points at one place would have two velocities
    for (int i = 0; i < n; i++) {
        field_near near = {.most = 2};
        field_search(field, series, 0, n, series->value + (size_t)i * (size_t)series->n_column, &near);
        if (near.n == 2 && near.square[1] == 0) {
            free(field->order);
            free(field->along);
            free(field);
            formula->field = NULL;
            return near.row[0] > near.row[1] ? near.row[0] : near.row[1];
        }
    }
    return -1;
}

void silt_formula_clear(silt_formula *formula) {
    silt_series_clear(&formula->series);
    if (formula->field) {
        free(formula->field->order);
        free(formula->field->along);
        free(formula->field);
        formula->field = NULL;
    }
}

/** a cell of dim + 1 of the near points around the origin, and the weights of its corners there */
typedef struct field_cell {
    int corner[4];
    double weight[4];
    double lift; // weighted sum of the corners' squared distances: smallest for the Delaunay cell
} field_cell;

// false when the cell is flat or the origin lies outside
static bool field_cell_make(int dim, const double (*q)[3], const double *square, field_cell *cell) {
    double a[20];
    const int n = dim + 1;
    for (int r = 0; r < n; r++) {
        for (int c = 0; c < n; c++)
            a[r * (n + 1) + c] = r < dim ? q[cell->corner[c]][r] : 1;
        a[r * (n + 1) + n] = r < dim ? 0 : 1;
    }
    if (!formula_solve(n, a, cell->weight))
        return false;
    cell->lift = 0;
    for (int c = 0; c < n; c++) {
        if (!(cell->weight[c] >= -1e-9))
            return false;
        cell->lift += cell->weight[c] * square[cell->corner[c]];
    }
    return true;
}

// the first cell of the nearest points that holds the origin
static bool field_cell_first(int dim, int n, const double (*q)[3], const double *square, field_cell *cell) {
    for (int last = dim; last < n && last < FIELD_FIRST; last++)
        for (int i = 0; i < last; i++)
            for (int j = i + 1; j < last; j++) {
                if (dim == 2) {
                    *cell = (field_cell){.corner = {i, j, last}};
                    if (field_cell_make(dim, q, square, cell))
                        return true;
                    continue;
                }
                for (int k = j + 1; k < last; k++) {
                    *cell = (field_cell){.corner = {i, j, k, last}};
                    if (field_cell_make(dim, q, square, cell))
                        return true;
                }
            }
    return false;
}

// The Delaunay triangulation is the lower hull of the points lifted onto a paraboloid, so the cell around the origin is
// that with the smallest lift: corners are exchanged while that lowers it.
static void field_cell_improve(int dim, int n, const double (*q)[3], const double *square, field_cell *cell) {
    for (int round = 0; round < 64; round++) {
        field_cell best = *cell;
        for (int p = 0; p < n; p++)
            for (int c = 0; c <= dim; c++) {
                field_cell other = *cell;
                bool new = true;
                for (int e = 0; e <= dim; e++)
                    new = new &&other.corner[e] != p;
                other.corner[c] = p;
                if (new &&field_cell_make(dim, q, square, &other) && other.lift < best.lift - 1e-12 * square[n - 1])
                    best = other;
            }
        if (best.lift == cell->lift)
            return;
        *cell = best;
    }
}

// the plane through all near points with the smallest squared difference, at the origin; weights of the points
static bool field_plane(int dim, int n, const double (*q)[3], double *weight) {
    double a[20], x[4];
    const int m = dim + 1;
    // normal equations: sum over points of (1, q)(1, q)^T x = e_0
    for (int r = 0; r < m; r++) {
        for (int c = 0; c < m; c++) {
            a[r * (m + 1) + c] = 0;
            for (int i = 0; i < n; i++)
                a[r * (m + 1) + c] += (r ? q[i][r - 1] : 1) * (c ? q[i][c - 1] : 1);
        }
        a[r * (m + 1) + m] = r == 0;
    }
    if (!formula_solve(m, a, x))
        return false;
    for (int i = 0; i < n; i++) {
        weight[i] = x[0];
        for (int k = 0; k < dim; k++)
            weight[i] += x[k + 1] * q[i][k];
    }
    return true;
}

// At a point of the table its values; between them linear on the cell of the Delaunay triangulation of the nearest
// points; beside the cloud the plane through the nearest ones, farther than half their reach the nearest one's values.
static void formula_field(const silt_formula *f, const double *x, double *v) {
    const silt_series *series = &f->series;
    const int dim = field_dim(f);
    field_near near = {.most = dim == 3 ? FIELD_NEAR_3D : FIELD_NEAR_2D};
    if (f->field)
        field_search(f->field, series, 0, f->field->n, x, &near);
    else
        for (int i = 0; i < series->n_row; i++)
            field_offer(&near, series, dim, i, x);
    const int n = near.n;
    if (n == 0)
        return;
    double q[FIELD_NEAR][3] = {{0}}, square[FIELD_NEAR], weight[FIELD_NEAR] = {0};
    // in units of the reach, so that the tests for flatness have no length in them
    const double reach = sqrt(near.square[n - 1]);
    for (int i = 0; i < n && reach > 0; i++) {
        for (int k = 0; k < dim; k++)
            q[i][k] = (series->value[(size_t)near.row[i] * (size_t)series->n_column + k] - x[k]) / reach;
        square[i] = near.square[i] / (reach * reach);
    }
    field_cell cell;
    if (reach == 0 || near.square[0] <= 1e-24 * reach * reach) {
        weight[0] = 1;
    } else if (field_cell_first(dim, n, q, square, &cell)) {
        field_cell_improve(dim, n, q, square, &cell);
        for (int c = 0; c <= dim; c++)
            weight[cell.corner[c]] = cell.weight[c];
    } else if (square[0] > 0.25 || n <= dim || !field_plane(dim, n, q, weight)) {
        memset(weight, 0, sizeof weight);
        weight[0] = 1;
    }
    for (int i = 0; i < n; i++)
        for (int k = 0; k < dim; k++)
            v[k] += weight[i] * series->value[(size_t)near.row[i] * (size_t)series->n_column + dim + k];
}

// both ---------------------------------------------------------------------------------------------------
// right-handed about the axis; counter-clockwise in 2-D
static void formula_rotation(const silt_formula *f, const double *x, double *v) {
    const int axis = f->axis > 0 ? f->axis - 1 : 2, p = (axis + 1) % 3, q = (axis + 2) % 3;
    if (field_dim(f) == 2) {
        v[0] = -f->rate * (x[1] - f->centre[1]);
        v[1] = f->rate * (x[0] - f->centre[0]);
        return;
    }
    v[p] = -f->rate * (x[q] - f->centre[q]);
    v[q] = f->rate * (x[p] - f->centre[p]);
}

static void formula_add(const silt_formula *f, double *v) {
    for (int k = 0; k < 3; k++)
        v[k] += f->vector[k];
}

void silt_formula_velocity(const silt_formula *formula, double g, const double *x, double *v) {
    const int up = field_dim(formula) - 1;
    v[0] = v[1] = v[2] = 0;
    if (formula->kind == FORMULA_NONE)
        return;
    const double dx = x[0] - formula->centre[0], dy = x[up] - formula->centre[up];
    switch (formula->kind) {
    case FORMULA_SOLID_ROTATION:
        formula_rotation(formula, x, v);
        break;
    case FORMULA_SHEAR:
        v[0] = formula->rate * dy;
        break;
    case FORMULA_STRAIN:
        v[0] = -formula->rate * dx;
        v[up] = formula->rate * dy;
        break;
    case FORMULA_TAYLOR_GREEN:
        v[0] = formula->amplitude * sin(M_PI * dx / formula->length) * cos(M_PI * dy / formula->length);
        v[up] = -formula->amplitude * cos(M_PI * dx / formula->length) * sin(M_PI * dy / formula->length);
        break;
    case FORMULA_STANDING_WAVE:
        formula_standing_wave(formula, g, dx, dy, &v[0], &v[up]);
        break;
    case FORMULA_SOLITARY_WAVE:
        formula_solitary_wave(formula, g, dx, dy, &v[0], &v[up]);
        break;
    case FORMULA_FIELD:
        formula_field(formula, x, v);
        break;
    default:
        break;
    }
    formula_add(formula, v);
}

void silt_formula_acceleration(const silt_formula *formula, double time, const double *x, double *a) {
    const int dim = field_dim(formula);
    a[0] = a[1] = a[2] = 0;
    switch (formula->kind) {
    case FORMULA_NONE:
        return;
    case FORMULA_SOLID_ROTATION:
        formula_rotation(formula, x, a);
        break;
    case FORMULA_CENTRAL:
        for (int k = 0; k < dim; k++)
            a[k] = k + 1 == formula->axis ? 0 : -formula->rate * fabs(formula->rate) * (x[k] - formula->centre[k]);
        break;
    case FORMULA_SERIES:
        for (int k = 0; k < dim; k++)
            a[k] = silt_series_at(&formula->series, k + 1, time);
        break;
    case FORMULA_FIELD:
        formula_field(formula, x, a);
        break;
    default:
        break;
    }
    formula_add(formula, a);
}

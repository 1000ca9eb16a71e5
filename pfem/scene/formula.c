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

// profile of the solitary wave in units of the still depth, e = H/d, s2 = sech^2(k x): surface, k and c^2/(g d).
// Boussinesq's: eta = e s2. Grimshaw's (1971, J. Fluid Mech. 46, 611) to third order.
static double formula_profile(bool third, double e, double s2, double *k, double *speed) {
    const double t2 = 1 - s2;
    *k = sqrt(0.75 * e) * (third ? 1 - 5.0 / 8 * e + 71.0 / 128 * e * e : 1);
    *speed = sqrt(1 + e - (third ? e * e / 20 + 3 * e * e * e / 70 : 0));
    return e * s2 * (1 + (third ? -0.75 * e * t2 + e * e * t2 * (5.0 / 8 - 101.0 / 80 * s2) : 0));
}

double silt_formula_surface(const silt_formula *formula, const double *x) {
    const double e = formula->amplitude / formula->depth;
    double k, speed;
    formula_profile(formula->profile == WAVE_GRIMSHAW, e, 1, &k, &speed);
    const double s2 = 1 / silt_square(cosh(k * (x[0] - formula->centre[0]) / formula->depth));
    return formula->depth * formula_profile(formula->profile == WAVE_GRIMSHAW, e, s2, &k, &speed);
}

// The velocity under a solitary wave. u = eta sqrt(g/d) over the whole depth, the first order, is neither free of
// sources nor of rotation, and series in H/d (Laitone 1960, Grimshaw 1971) are so to their order only. Here u - i v =
// F(x + i y) with F(z) = c sum_n a_n sech^(2n)(k z): div u = rot u = 0 everywhere and v = 0 on the flat bed, whatever
// the a_n. They are those for which the stream function on the surface comes closest to c eta, i.e. the surface goes on
// with the speed c and keeps its form: least squares of (psi/c - eta)/sech^2 over the surface.
enum { WAVE_TERMS = sizeof((silt_formula *)0)->wave / sizeof(double), WAVE_PLACES = 60 };
static void formula_wave_fit(const silt_formula *f, double *wave) {
    const bool third = f->profile == WAVE_GRIMSHAW;
    const double e = f->amplitude / f->depth;
    double q[WAVE_TERMS][WAVE_PLACES], r[WAVE_TERMS][WAVE_TERMS] = {{0}}, b[WAVE_PLACES], k, speed;
    for (int j = 0; j < WAVE_PLACES; j++) {
        const double s2 = (j + 0.5) / WAVE_PLACES;
        const double eta = formula_profile(third, e, s2, &k, &speed);
        const double complex t = ctanh(acosh(1 / sqrt(s2)) + I * k * (1 + eta));
        for (int n = 0; n < WAVE_TERMS; n++) {
            // integral of sech^(2n + 2): sum over m of binomial(n, m) (-1)^m t^(2m + 1)/(2m + 1)
            double complex sum = 0, power = t;
            double binomial = 1;
            for (int m = 0; m <= n; m++) {
                sum += binomial * power / (2 * m + 1);
                power *= t * t;
                binomial *= -(double)(n - m) / (m + 1);
            }
            q[n][j] = cimag(sum) / (k * s2);
        }
        b[j] = eta / s2;
    }
    // Gram and Schmidt, modified and done twice
    for (int n = 0; n < WAVE_TERMS; n++) {
        for (int twice = 0; twice < 2; twice++)
            for (int m = 0; m < n; m++) {
                double along = 0;
                for (int j = 0; j < WAVE_PLACES; j++)
                    along += q[m][j] * q[n][j];
                for (int j = 0; j < WAVE_PLACES; j++)
                    q[n][j] -= along * q[m][j];
                r[m][n] += along;
            }
        double length = 0;
        for (int j = 0; j < WAVE_PLACES; j++)
            length += silt_square(q[n][j]);
        r[n][n] = sqrt(length);
        for (int j = 0; j < WAVE_PLACES; j++)
            q[n][j] /= r[n][n];
    }
    for (int n = WAVE_TERMS - 1; n >= 0; n--) {
        wave[n] = 0;
        for (int j = 0; j < WAVE_PLACES; j++)
            wave[n] += q[n][j] * b[j];
        for (int m = n + 1; m < WAVE_TERMS; m++)
            wave[n] -= r[n][m] * wave[m];
        wave[n] /= r[n][n];
    }
}

static void formula_solitary_wave(const silt_formula *f, double g, double dx, double dy, double *u, double *w) {
    double fitted[WAVE_TERMS], k, speed;
    const double *wave = f->wave;
    if (wave[0] == 0) {
        formula_wave_fit(f, fitted);
        wave = fitted;
    }
    formula_profile(f->profile == WAVE_GRIMSHAW, f->amplitude / f->depth, 1, &k, &speed);
    const double complex t = ctanh(k * (dx + I * dy) / f->depth), s2 = 1 - t * t;
    double complex flow = 0, power = s2;
    for (int n = 0; n < WAVE_TERMS; n++, power *= s2)
        flow += wave[n] * power;
    const double c = (f->rate < 0 ? -speed : speed) * sqrt(g * f->depth);
    *u = c * creal(flow);
    *w = -c * cimag(flow);
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

int silt_formula_prepare(silt_formula *formula) {
    if (formula->kind == FORMULA_SOLITARY_WAVE)
        formula_wave_fit(formula, formula->wave);
    if (formula->kind != FORMULA_FIELD)
        return -1;
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
// that with the smallest lift: the point farthest below the cell's plane becomes a corner until none lies below.
static void field_cell_improve(int dim, int n, const double (*q)[3], const double *square, field_cell *cell) {
    for (int round = 0; round < 64; round++) {
        double a[20], lifted[4], deepest = -1e-12;
        int below = -1;
        for (int r = 0; r <= dim; r++) {
            a[r * (dim + 2)] = 1;
            for (int k = 0; k < dim; k++)
                a[r * (dim + 2) + k + 1] = q[cell->corner[r]][k];
            a[r * (dim + 2) + dim + 1] = square[cell->corner[r]];
        }
        if (!formula_solve(dim + 1, a, lifted))
            return;
        for (int p = 0; p < n; p++) {
            double above = square[p] - lifted[0];
            for (int k = 0; k < dim; k++)
                above -= lifted[k + 1] * q[p][k];
            if (above < deepest) {
                deepest = above;
                below = p;
            }
        }
        field_cell best = *cell;
        for (int c = 0; c <= dim && below >= 0; c++) {
            field_cell other = *cell;
            other.corner[c] = below;
            if (field_cell_make(dim, q, square, &other) && other.lift < best.lift)
                best = other;
        }
        if (!(best.lift < cell->lift))
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
// points; beside the cloud the plane through the nearest ones, farther than 0.7 of their reach the nearest one's
// values.
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
    } else if (square[0] > 0.49 || n <= dim || !field_plane(dim, n, q, weight)) {
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

double silt_formula_potential(const silt_formula *formula, const double *x) {
    double square = 0;
    for (int k = 0; k < field_dim(formula); k++)
        square += k + 1 == formula->axis ? 0 : silt_square(x[k] - formula->centre[k]);
    return 0.5 * formula->rate * fabs(formula->rate) * square;
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

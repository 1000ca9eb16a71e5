/** @file formula.c
 * Initial velocities by name.
 */
#include "scene.h"

// linear potential wave over a flat bed, about to rise from a flat surface with full velocity:
// eta = a cos(k(x - xc)) sin(omega t), omega^2 = g k tanh(k d). At t = 0 the surface moves with v = a omega cos(k(x -
// xc)), and du/dx + dv/dy = 0 gives u the minus sign.
static void formula_standing_wave(const silt_formula *f, double g, const double *x, double *v) {
    double k = 2 * M_PI / f->length;
    double omega = sqrt(g * k * tanh(k * f->depth));
    double phase = k * (x[0] - f->centre[0]), height = k * (x[1] - f->centre[1]), depth = k * f->depth;
    // cosh(h)/sinh(d) by exponentials that cannot overflow in deep water
    double up = exp(height - depth), down = exp(-height - depth), bottom = 1 - exp(-2 * depth);
    v[0] = -f->amplitude * omega * sin(phase) * (up + down) / bottom;
    v[1] = f->amplitude * omega * cos(phase) * (up - down) / bottom;
}

void silt_formula_velocity(const silt_formula *formula, double g, const double *x, double *v) {
    double dx = x[0] - formula->centre[0], dy = x[1] - formula->centre[1];
    v[0] = v[1] = v[2] = 0;
    switch (formula->kind) {
    case FORMULA_NONE:
        break;
    case FORMULA_UNIFORM:
        memcpy(v, formula->vector, sizeof formula->vector);
        break;
    case FORMULA_SOLID_ROTATION:
        v[0] = -formula->rate * dy;
        v[1] = formula->rate * dx;
        break;
    case FORMULA_SHEAR:
        v[0] = formula->rate * dy;
        break;
    case FORMULA_STRAIN:
        v[0] = -formula->rate * dx;
        v[1] = formula->rate * dy;
        break;
    case FORMULA_TAYLOR_GREEN:
        v[0] = formula->amplitude * sin(M_PI * dx / formula->length) * cos(M_PI * dy / formula->length);
        v[1] = -formula->amplitude * cos(M_PI * dx / formula->length) * sin(M_PI * dy / formula->length);
        break;
    case FORMULA_STANDING_WAVE:
        formula_standing_wave(formula, g, x, v);
        break;
    default:
        break;
    }
}

void silt_formula_acceleration(const silt_formula *formula, double time, const double *x, double *a) {
    (void)time;
    for (int d = 0; d < 3; d++)
        a[d] = formula->kind == FORMULA_CENTRAL ? -silt_square(formula->rate) * (x[d] - formula->centre[d]) : formula->vector[d];
}

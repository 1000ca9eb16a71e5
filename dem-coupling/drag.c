// drag.c: drag laws
#include "drag.h"

#include "vector.h"

static const double solid_most = 0.75; // densest packing that the formulas are asked about
static const double least_square = 1e-200; // of a speed whose logarithm is asked for

// What the laws hold of a grain: Reynolds number per speed; then Stokes' factor and that of Newton's drag per speed, or the part of
// the root that does not hang on the speed, Newton's factor and the logarithm of the porosity
enum { NUMBER_REYNOLDS, NUMBER_STOKES, NUMBER_NEWTON, NUMBER_POROSITY };

void silt_drag_numbers(silt_drag_law law, double density, double viscosity, double d, double number, double solid,
                       double out[DRAG_NUMBERS]) {
    const double porosity = 1.0 - silt_clamp(solid, 0.0, solid_most), area = number * M_PI * d * d / 8.0;
    memset(out, 0, DRAG_NUMBERS * sizeof *out);
    if (law == DRAG_SCHILLER_NAUMANN) {
        out[NUMBER_REYNOLDS] = density * d / viscosity;
        out[NUMBER_STOKES] = number * 3.0 * M_PI * viscosity * d;
        out[NUMBER_NEWTON] = 0.44 * area * density;
    } else if (law == DRAG_DI_FELICE) {
        out[NUMBER_REYNOLDS] = porosity * density * d / viscosity;
        out[NUMBER_STOKES] = 4.8 * sqrt(viscosity / (porosity * density * d));
        out[NUMBER_NEWTON] = area * density;
        out[NUMBER_POROSITY] = log(porosity);
    }
}

// Cd = 24/Re (1 + 0.15 Re^0.687) below Re = 1000, 0.44 above; beta = Cd pi d^2/8 rho w
VECTOR_INLINE void drag_schiller_naumann(const eight *number, const eight *square, eight *factor) {
    const eight speed = eight_root(*square), reynolds = number[NUMBER_REYNOLDS] * speed;
    const eight slow = number[NUMBER_STOKES] *
                       (1.0 + 0.15 * eight_exp(0.687 * eight_log(eight_most(reynolds, sqrt(least_square)))));
    const eight fast = number[NUMBER_NEWTON] * speed;
    *factor = eight_choose(reynolds >= 1000.0, fast, slow);
}

// Cd = (0.63 + 4.8/sqrt Re)^2, beta = Cd pi d^2/8 rho w eps^(2 - chi), chi = 3.7 - 0.65 exp(-(1.5 - lg Re)^2/2); sqrt(Cd w)
// instead of Cd, so that a grain at rest has its Stokes limit
VECTOR_INLINE void drag_di_felice(const eight *number, const eight *square, eight *factor) {
    const eight speed = eight_root(*square), reynolds = number[NUMBER_REYNOLDS] * speed;
    const eight root = 0.63 * eight_root(speed) + number[NUMBER_STOKES];
    const eight off = 1.5 - eight_log(eight_most(reynolds, sqrt(least_square))) * (1.0 / M_LN10);
    const eight chi = 3.7 - 0.65 * eight_exp(-0.5 * off * off);
    *factor = root * root * number[NUMBER_NEWTON] * eight_exp((2.0 - chi) * number[NUMBER_POROSITY]);
}

VECTOR_CLONES void silt_drag_group(silt_drag_law law, const double numbers[DRAG_NUMBERS][DRAG_GROUP],
                                   const double square[DRAG_GROUP], double factor[DRAG_GROUP]) {
    if (law == DRAG_SCHILLER_NAUMANN)
        drag_schiller_naumann((const eight *)numbers, (const eight *)square, (eight *)factor);
    else if (law == DRAG_DI_FELICE)
        drag_di_felice((const eight *)numbers, (const eight *)square, (eight *)factor);
    else
        memset(factor, 0, DRAG_GROUP * sizeof *factor);
}

double silt_drag_factor(silt_drag_law law, double density, double viscosity, double d, double solid, double w) {
    double one[DRAG_NUMBERS], numbers[DRAG_NUMBERS][DRAG_GROUP], square[DRAG_GROUP], factor[DRAG_GROUP];
    silt_drag_numbers(law, density, viscosity, d, 1.0, solid, one);
    for (int k = 0; k < DRAG_GROUP; k++) {
        square[k] = w * w;
        for (int m = 0; m < DRAG_NUMBERS; m++)
            numbers[m][k] = one[m];
    }
    silt_drag_group(law, numbers, square, factor);
    return factor[0];
}

// drag.c: drag laws
#include "drag.h"

#include "vector.h"

static const double solid_most = 0.75; // densest packing that the formulas are asked about
static const double least_square = 1e-200; // of a speed whose logarithm is asked for

// What the laws hold of a grain: Reynolds number per speed; then Stokes' factor and that of Newton's drag per speed, or the part of
// the root that does not hang on the speed, Newton's factor and the logarithm of the porosity
enum { NUMBER_REYNOLDS, NUMBER_STOKES, NUMBER_NEWTON, NUMBER_POROSITY };

VECTOR_CLONES void silt_drag_numbers(silt_drag_law law, double density, double viscosity, const double d[DRAG_GROUP],
                                     const double number[DRAG_GROUP], const double solid[DRAG_GROUP],
                                     double out[DRAG_NUMBERS][DRAG_GROUP]) {
    const eight width = *(const eight *)d, count = *(const eight *)number, share = *(const eight *)solid;
    const eight porosity = eight_most(1.0 - eight_most(share, 0.0), 1.0 - solid_most), area = count * M_PI * width * width / 8.0;
    eight *to = (eight *)out;
    if (law == DRAG_SCHILLER_NAUMANN) {
        to[NUMBER_REYNOLDS] = density * width / viscosity;
        to[NUMBER_STOKES] = count * 3.0 * M_PI * viscosity * width;
        to[NUMBER_NEWTON] = 0.44 * area * density;
    } else {
        to[NUMBER_REYNOLDS] = porosity * density * width / viscosity;
        to[NUMBER_STOKES] = 4.8 * eight_root(viscosity / (porosity * density * width));
        to[NUMBER_NEWTON] = area * density;
        to[NUMBER_POROSITY] = eight_log(porosity);
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
    double width[DRAG_GROUP], number[DRAG_GROUP], share[DRAG_GROUP], square[DRAG_GROUP], factor[DRAG_GROUP];
    double numbers[DRAG_NUMBERS][DRAG_GROUP] = {{0.0}};
    for (int k = 0; k < DRAG_GROUP; k++) {
        width[k] = d;
        number[k] = 1.0;
        share[k] = solid;
        square[k] = w * w;
    }
    silt_drag_numbers(law, density, viscosity, width, number, share, numbers);
    silt_drag_group(law, (const double(*)[DRAG_GROUP])numbers, square, factor);
    return factor[0];
}

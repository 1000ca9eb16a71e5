// drag.c: drag laws
#include "drag.h"

#include "vector.h"

static const double solid_most = 0.75; // densest packing that the formulas are asked about
static const double least_square = 1e-200; // of a speed whose logarithm is asked for
static const double dense = 0.2;      // solid fraction from which Gidaspow's law is Ergun's
static const double koch_dense = 0.4; // and Koch and Hill's that of Carman

// What a law holds of a grain, by its form:
// power (Schiller-Naumann, Wen-Yu, Gidaspow): Reynolds number per speed, Stokes' factor, Newton's drag per speed, more per speed
// root (Abraham, Di Felice): Reynolds number per speed, the root's part without speed, Newton's factor, logarithm of the porosity
// line (Stokes, Ergun, Koch-Hill): -, factor at rest, factor per speed
// Beetstra: Reynolds number per speed, factor at rest, factor of the inertial part, solid fraction
enum { NUMBER_REYNOLDS, NUMBER_STOKES, NUMBER_NEWTON, NUMBER_MORE };

// Ergun 1952, per grain: V (150 (1 - eps) mu/(eps d^2) + 1.75 rho w/d)
VECTOR_INLINE void drag_numbers_ergun(double density, double viscosity, eight width, eight count, eight porosity, eight *rest,
                                      eight *line) {
    const eight volume = count * (M_PI / 6.0) * width * width * width;
    *rest = volume * 150.0 * (1.0 - porosity) * viscosity / (porosity * width * width);
    *line = volume * 1.75 * density / width;
}

// Wen and Yu 1966 as Gidaspow prints it: Schiller and Naumann at Re = eps rho w d/mu, times eps eps^-2.65
VECTOR_INLINE void drag_numbers_wen_yu(double density, double viscosity, eight width, eight count, eight porosity, eight *to) {
    const eight crowd = eight_exp(-1.65 * eight_log(porosity));
    to[NUMBER_REYNOLDS] = porosity * density * width / viscosity;
    to[NUMBER_STOKES] = count * 3.0 * M_PI * viscosity * width * crowd / porosity;
    to[NUMBER_NEWTON] = 0.44 * count * M_PI * width * width / 8.0 * density * crowd;
}

// Koch and Hill 2001: F = F0 + F3 Re/2 of 3 pi mu d U, all of the water's force; of that drag is eps, and U is eps w
VECTOR_INLINE void drag_numbers_koch_hill(double density, double viscosity, eight width, eight count, eight porosity, eight *to) {
    const eight p = 1.0 - porosity, e3 = porosity * porosity * porosity;
    const eight loose = (1.0 + 3.0 * eight_root(p / 2.0) + 135.0 / 64.0 * p * eight_log(eight_most(p, least_square)) + 16.14 * p) /
                        (1.0 + p * (0.681 + p * (-8.48 + 8.16 * p)));
    const eight rest = eight_choose(p < koch_dense, loose, 10.0 * p / e3);
    const eight inertia = 0.0673 + 0.212 * p + 0.0232 / (e3 * porosity * porosity);
    const eight stokes = count * 3.0 * M_PI * viscosity * width * porosity * porosity;
    to[NUMBER_STOKES] = stokes * rest;
    to[NUMBER_NEWTON] = stokes * inertia * 0.5 * porosity * density * width / viscosity;
}

// Beetstra, van der Hoef and Kuipers 2007, see drag_beetstra
VECTOR_INLINE void drag_numbers_beetstra(double density, double viscosity, eight width, eight count, eight porosity, eight *to) {
    const eight p = 1.0 - porosity, stokes = count * 3.0 * M_PI * viscosity * width * porosity, e2 = porosity * porosity;
    to[NUMBER_REYNOLDS] = porosity * density * width / viscosity;
    to[NUMBER_STOKES] = stokes * (10.0 * p / e2 + e2 * (1.0 + 1.5 * eight_root(p)));
    to[NUMBER_NEWTON] = stokes * 0.413 / 24.0 / e2;
    to[NUMBER_MORE] = p;
}

VECTOR_CLONES void silt_drag_numbers(silt_drag_law law, double density, double viscosity, const double d[DRAG_GROUP],
                                     const double number[DRAG_GROUP], const double solid[DRAG_GROUP],
                                     double out[DRAG_NUMBERS][DRAG_GROUP]) {
    const eight width = *(const eight *)d, count = *(const eight *)number, share = *(const eight *)solid;
    const eight porosity = eight_most(1.0 - eight_most(share, 0.0), 1.0 - solid_most), area = count * M_PI * width * width / 8.0;
    eight *to = (eight *)out, rest, line;
    memset(out, 0, DRAG_NUMBERS * sizeof *out);
    switch (law) {
    case DRAG_NONE:
        break;
    case DRAG_STOKES:
        to[NUMBER_STOKES] = count * 3.0 * M_PI * viscosity * width;
        break;
    case DRAG_SCHILLER_NAUMANN:
        to[NUMBER_REYNOLDS] = density * width / viscosity;
        to[NUMBER_STOKES] = count * 3.0 * M_PI * viscosity * width;
        to[NUMBER_NEWTON] = 0.44 * area * density;
        break;
    case DRAG_ABRAHAM:
        to[NUMBER_STOKES] = 9.06 * eight_root(viscosity / (density * width));
        to[NUMBER_NEWTON] = 24.0 / (9.06 * 9.06) * area * density;
        break;
    case DRAG_DI_FELICE:
        to[NUMBER_REYNOLDS] = porosity * density * width / viscosity;
        to[NUMBER_STOKES] = 4.8 * eight_root(viscosity / (porosity * density * width));
        to[NUMBER_NEWTON] = area * density;
        to[NUMBER_MORE] = eight_log(porosity);
        break;
    case DRAG_ERGUN:
        drag_numbers_ergun(density, viscosity, width, count, porosity, &to[NUMBER_STOKES], &to[NUMBER_NEWTON]);
        break;
    case DRAG_WEN_YU:
        drag_numbers_wen_yu(density, viscosity, width, count, porosity, to);
        break;
    case DRAG_GIDASPOW: { // Ergun's grains have no Reynolds number: their power is 0
        drag_numbers_wen_yu(density, viscosity, width, count, porosity, to);
        drag_numbers_ergun(density, viscosity, width, count, porosity, &rest, &line);
        const eight_bits packed = 1.0 - porosity > dense;
        to[NUMBER_REYNOLDS] = eight_choose(packed, 0.0 * width, to[NUMBER_REYNOLDS]);
        to[NUMBER_STOKES] = eight_choose(packed, rest, to[NUMBER_STOKES]);
        to[NUMBER_MORE] = eight_choose(packed, line, 0.0 * width);
        break;
    }
    case DRAG_KOCH_HILL:
        drag_numbers_koch_hill(density, viscosity, width, count, porosity, to);
        break;
    case DRAG_BEETSTRA:
        drag_numbers_beetstra(density, viscosity, width, count, porosity, to);
        break;
    }
}

// Cd = 24/Re (1 + 0.15 Re^0.687) below Re = 1000, 0.44 above; beta = Cd pi d^2/8 rho w; and a part that grows with the speed
VECTOR_INLINE void drag_power(const eight *number, const eight *square, eight *factor) {
    const eight speed = eight_root(*square), reynolds = number[NUMBER_REYNOLDS] * speed;
    const eight slow = number[NUMBER_STOKES] *
                       (1.0 + 0.15 * eight_exp(0.687 * eight_log(eight_most(reynolds, sqrt(least_square)))));
    const eight fast = number[NUMBER_NEWTON] * speed;
    *factor = eight_choose(reynolds >= 1000.0, fast, slow) + number[NUMBER_MORE] * speed;
}

// Cd = (0.63 + 4.8/sqrt Re)^2, beta = Cd pi d^2/8 rho w eps^(2 - chi), chi = 3.7 - 0.65 exp(-(1.5 - lg Re)^2/2); sqrt(Cd w)
// instead of Cd, so that a grain at rest has its Stokes limit
VECTOR_INLINE void drag_di_felice(const eight *number, const eight *square, eight *factor) {
    const eight speed = eight_root(*square), reynolds = number[NUMBER_REYNOLDS] * speed;
    const eight root = 0.63 * eight_root(speed) + number[NUMBER_STOKES];
    const eight off = 1.5 - eight_log(eight_most(reynolds, sqrt(least_square))) * (1.0 / M_LN10);
    const eight chi = 3.7 - 0.65 * eight_exp(-0.5 * off * off);
    *factor = root * root * number[NUMBER_NEWTON] * eight_exp((2.0 - chi) * number[NUMBER_MORE]);
}

// Cd = 24/9.06^2 (1 + 9.06/sqrt Re)^2, Abraham 1970; the same root
VECTOR_INLINE void drag_abraham(const eight *number, const eight *square, eight *factor) {
    const eight root = eight_root(eight_root(*square)) + number[NUMBER_STOKES];
    *factor = root * root * number[NUMBER_NEWTON];
}

VECTOR_INLINE void drag_line(const eight *number, const eight *square, eight *factor) {
    *factor = number[NUMBER_STOKES] + number[NUMBER_NEWTON] * eight_root(*square);
}

// F = 10 p/e^2 + e^2 (1 + 1.5 sqrt p) + 0.413 Re/(24 e^2) (1/e + 3 e p + 8.4 Re^-0.343)/(1 + 10^(3 p) Re^(-(1 + 4 p)/2)), p = 1 - e,
// of 3 pi mu d e w
VECTOR_INLINE void drag_beetstra(const eight *number, const eight *square, eight *factor) {
    const eight p = number[NUMBER_MORE], e = 1.0 - p;
    const eight reynolds = eight_most(number[NUMBER_REYNOLDS] * eight_root(*square), sqrt(least_square));
    const eight log_re = eight_log(reynolds);
    const eight top = 1.0 / e + 3.0 * e * p + 8.4 * eight_exp(-0.343 * log_re);
    const eight bottom = 1.0 + eight_exp(3.0 * M_LN10 * p - 0.5 * (1.0 + 4.0 * p) * log_re);
    *factor = number[NUMBER_STOKES] + number[NUMBER_NEWTON] * reynolds * top / bottom;
}

VECTOR_CLONES void silt_drag_group(silt_drag_law law, const double numbers[DRAG_NUMBERS][DRAG_GROUP],
                                   const double square[DRAG_GROUP], double factor[DRAG_GROUP]) {
    const eight *number = (const eight *)numbers, *speed = (const eight *)square;
    eight *to = (eight *)factor;
    switch (law) {
    case DRAG_NONE:
        memset(factor, 0, DRAG_GROUP * sizeof *factor);
        break;
    case DRAG_SCHILLER_NAUMANN:
    case DRAG_WEN_YU:
    case DRAG_GIDASPOW:
        drag_power(number, speed, to);
        break;
    case DRAG_DI_FELICE:
        drag_di_felice(number, speed, to);
        break;
    case DRAG_ABRAHAM:
        drag_abraham(number, speed, to);
        break;
    case DRAG_STOKES:
    case DRAG_ERGUN:
    case DRAG_KOCH_HILL:
        drag_line(number, speed, to);
        break;
    case DRAG_BEETSTRA:
        drag_beetstra(number, speed, to);
        break;
    }
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

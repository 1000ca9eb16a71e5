// apparent viscosity of fluids with a yield stress
#include "viscosity.h"

double silt_apparent_viscosity(const silt_fluid_def *fluid, double rate) {
    if (fluid->rheology == RHEOLOGY_NEWTONIAN)
        return fluid->viscosity;
    // rate/(1 - exp(-rate/p)): p at rest, the rate itself above some p
    const double p = fluid->plastic_rate, m = rate / p;
    const double r = m > 1e-8 ? rate / -expm1(-m) : p * (1 + 0.5 * m);
    if (fluid->rheology == RHEOLOGY_BINGHAM)
        return fluid->viscosity + fluid->yield_stress / r;
    return fluid->yield_stress / r + fluid->viscosity * pow(r, fluid->flow_index - 1);
}

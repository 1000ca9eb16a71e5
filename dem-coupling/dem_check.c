// what a definition of discrete elements must be
#include "dem_check.h"

bool silt_dem_finite(int n, const double *value) {
    for (int i = 0; i < n; i++)
        if (!isfinite(value[i]))
            return false;
    return true;
}

silt_dem_text silt_dem_place(const silt_dem_def *def, const double *x) {
    silt_dem_text place;
    if (def->dim == 3)
        snprintf(place.text, sizeof place.text, "(%g, %g, %g)", x[0], x[1], x[2]);
    else
        snprintf(place.text, sizeof place.text, "(%g, %g)", x[0], x[1]);
    return place;
}

silt_status silt_dem_check(const silt_dem_def *def, silt_error *err) {
    const bool space = def->dim == 3;
    const double number[] = {def->lo[0],      def->lo[1],      def->lo[2],      def->hi[0],            def->hi[1],    def->hi[2],
                             def->gravity[0], def->gravity[1], def->gravity[2], def->rolling_friction, def->friction, def->body_friction};
    const double positive[] = {def->hi[0] - def->lo[0], def->hi[1] - def->lo[1], space ? def->hi[2] - def->lo[2] : def->period,
                               def->youngs_modulus,     def->restitution,        def->step,
                               def->min_radius,         def->max_radius};
    const char *const name[] = {"box width",   "box height", space ? "third extent of the box" : "period", "Young's modulus",
                                "restitution", "time step",  "smallest radius",                            "largest radius"};
    if (!silt_dem_finite(12, number))
        return silt_fail(err, SILT_FAILED, "discrete elements: the box, gravity or a friction is not a finite number");
    for (int k = 0; k < 8; k++)
        if (!(positive[k] > 0) || !isfinite(positive[k]))
            return silt_fail(err, SILT_FAILED, "discrete elements: the %s is %g, it must be above 0", name[k],
                             positive[k]);
    if (def->restitution < 0.05 || def->restitution > 1)
        return silt_fail(err, SILT_FAILED, "discrete elements: the restitution is %g, LIGGGHTS allows 0.05 to 1",
                         def->restitution);
    if (!space && def->period < 6 * def->max_radius * (1 - 1e-12))
        return silt_fail(err, SILT_FAILED,
                         "discrete elements: the period %g m must be at least 3 diameters of the largest sphere, %g m",
                         def->period, 6 * def->max_radius);
    for (int k = 0; k < def->n_wall; k++)
        if (!silt_dem_finite(4, def->wall[k]))
            return silt_fail(err, SILT_FAILED, "discrete elements: wall %d is not finite", k);
    for (int k = 0; k < def->n_triangle; k++)
        if (!silt_dem_finite(10, def->triangle[k]))
            return silt_fail(err, SILT_FAILED, "discrete elements: triangle %d of the walls is not finite", k);
    return SILT_OK;
}

double silt_dem_rayleigh(double radius, double density, double youngs_modulus, double poissons_ratio) {
    double shear = youngs_modulus / (2 * (1 + poissons_ratio));
    return M_PI * radius * sqrt(density / shear) / (0.1631 * poissons_ratio + 0.8766);
}

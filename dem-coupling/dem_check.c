// what a definition of discrete elements must be
#include "dem_check.h"

#include "pose.h"

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

double silt_dem_sphere_at(const silt_dem_def *def, const silt_dem_body *body, int i, double x[3]) {
    const double *p = &body->sphere[silt_clump_width(def->dim) * i];
    if (def->dim == 3) {
        silt_turn(body->q, false, p, x);
        for (int d = 0; d < 3; d++)
            x[d] += body->x[d];
        return p[3];
    }
    double c = cos(body->angle), s = sin(body->angle);
    x[0] = body->x[0] + c * p[0] - s * p[1];
    x[1] = body->x[1] + s * p[0] + c * p[1];
    x[2] = 0;
    return p[2];
}

silt_status silt_dem_check_body(const silt_dem_def *def, int index, const silt_dem_body *body, silt_error *err) {
    const bool space = def->dim == 3;
    const double number[] = {body->mass, body->inertia, body->x[0], body->x[1], body->v[0], body->v[1], body->omega[2], body->angle,
                             body->x[2], body->v[2], body->omega[0], body->omega[1]};
    const bool turned = !space || (silt_dem_finite(6, body->tensor) && silt_dem_finite(4, body->q) && silt_length(4, body->q) > 0);
    const bool heavy = body->mass > 0 && (space ? silt_pose_tensor(body->tensor) : body->inertia > 0);
    if (body->n_sphere < 1 || !silt_dem_finite(12, number) || !turned ||
        !silt_dem_finite(silt_clump_width(def->dim) * body->n_sphere, body->sphere) || (!body->fixed && !heavy))
        return silt_fail(err, SILT_FAILED,
                         "rigid body %d: %d spheres, mass %g kg, inertia %g kg m2; at least one sphere and positive "
                         "finite numbers are needed",
                         index, body->n_sphere, body->mass, space ? body->tensor[0] : body->inertia);
    for (int i = 0; i < body->n_sphere; i++) {
        double x[3];
        const double radius = silt_dem_sphere_at(def, body, i, x);
        bool outside = false;
        if (!(radius > 0) || radius > def->max_radius * (1 + 1e-12))
            return silt_fail(err, SILT_FAILED,
                             "rigid body %d: sphere %d has radius %g m; it must be above 0 and at most %g m",
                             index, i, radius, def->max_radius);
        for (int d = 0; d < (space ? 3 : 2); d++)
            outside |= x[d] < def->lo[d] || x[d] >= def->hi[d];
        if (outside)
            return silt_fail(err, SILT_FAILED, "rigid body %d: sphere %d at %s lies outside the box %s to %s", index, i,
                             silt_dem_place(def, x).text, silt_dem_place(def, def->lo).text, silt_dem_place(def, def->hi).text);
    }
    return SILT_OK;
}

silt_status silt_dem_check_load(const silt_dem_def *def, const silt_dem_state *state, const double *force, const double *body_force,
                                const double *body_torque, silt_error *err) {
    for (int k = 0; force && k < state->n_grain; k++)
        if (!silt_dem_finite(3, &force[3 * k]))
            return silt_fail(err, SILT_FAILED, "the force on grain %lld at %s is not finite: %s", (long long)state->id[k],
                             silt_dem_place(def, &state->x[3 * k]).text, silt_dem_place(def, &force[3 * k]).text);
    for (int k = 0; k < state->n_body; k++)
        if ((body_force && !silt_dem_finite(3, &body_force[3 * k])) || (body_torque && !silt_dem_finite(3, &body_torque[3 * k])))
            return silt_fail(err, SILT_FAILED, "the force or torque on rigid body %d at (%g, %g) is not finite", k,
                             state->body_x[3 * k], state->body_x[3 * k + 1]);
    return SILT_OK;
}

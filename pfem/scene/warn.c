// what is allowed but will probably not do what was meant
#include "output.h"

// one line when the condition holds
static void __attribute__((format(printf, 5, 6)))
warn_when(bool condition, const silt_scene *scene, FILE *to, int *count, const char *format, ...) {
    if (!condition)
        return;
    va_list list;
    va_start(list, format);
    fprintf(to, "%s: warning: ", scene->path);
    vfprintf(to, format, list);
    fputc('\n', to);
    va_end(list);
    ++*count;
}

// the water's model: what is allowed together and rarely right
static int warn_fluid(const silt_scene *scene, FILE *to) {
    const silt_fluid_def *fluid = &scene->fluid;
    const bool turbulent = fluid->flow == FLOW_TURBULENT;
    const bool eddies = fluid->turbulence == TURBULENCE_SMAGORINSKY || fluid->turbulence == TURBULENCE_WALE;
    const bool others = scene->bed.on || scene->n_body > 0 || fluid->n_inlet || fluid->n_outlet;
    int n_smooth = 0, n_pulled = 0, count = 0;
    for (int i = 0; i < scene->n_wall; i++) {
        const silt_wall *wall = &scene->wall[i];
        const bool pulled = wall->velocity[0] != 0 || wall->velocity[1] != 0 || wall->velocity[2] != 0;
        n_smooth += wall->condition == WALL_LAW && wall->roughness == 0;
        n_pulled += wall->condition == WALL_SLIP && pulled;
    }
    warn_when(n_smooth && fluid->viscosity == 0, scene, to, &count,
              "%d smooth walls have the wall law, but the water has no viscosity for it; slip is the same", n_smooth);
    warn_when(turbulent && fluid->turbulence != TURBULENCE_NONE && fluid->yield_stress > 0, scene, to, &count,
              "a fluid with a yield stress and a turbulence model; mud mostly wants flow: laminar");
    warn_when(eddies && scene->dimension != 3, scene, to, &count,
              "fluid.turbulence is a model of three-dimensional eddies; in two dimensions mixing-length is meant");
    warn_when(fluid->turbulence == TURBULENCE_SPALART_ALLMARAS && fluid->viscosity == 0 && fluid->eddy.viscosity == 0 && fluid->eddy.shear == 0, scene,
              to, &count, "fluid.turbulence: spalart-allmaras makes eddies of eddies, and there are none at the start: water without viscosity "
              "needs fluid.eddy_viscosity or fluid.shear_velocity");
    warn_when(n_pulled, scene, to, &count,
              "%d walls slip and have a velocity along themselves, which does not reach the water", n_pulled);
    warn_when(turbulent && scene->bed.on && scene->bed.condition == WALL_NO_SLIP && silt_bed_erodes(&scene->bed), scene, to,
              &count, "turbulent flow and bed.condition no-slip: the shear on the bed hangs on fluid.size; see wall-law");
    warn_when(fluid->shuffle > 0, scene, to, &count,
              "fluid.shuffle shifts nodes at random in every step: a test, no flow is better for it");
    warn_when(scene->period[0] < scene->period[1] && others, scene, to, &count,
              "the scene is periodic for water and grains alone: bed, bodies, inlets and outlets do not repeat");
    return count;
}

int silt_scene_warn(const silt_scene *scene, FILE *to) {
    int count = scene->fluid.on ? warn_fluid(scene, to) : 0;
    // the pores of such gravel are turbulent, and steps are short against the time that its water takes to move
    const double g = silt_length(3, scene->gravity), n = scene->bed.porosity;
    const double k = scene->bed.seepage == SEEPAGE_DARCY ? scene->bed.permeability
                   : scene->bed.seepage == SEEPAGE_NONE  ? 0
                                                         : silt_square(scene->grains.diameter) * n * n * n / (180 * silt_square(1 - n));
    warn_when(scene->bed.on && scene->fluid.on && k * scene->fluid.density * g > scene->fluid.viscosity, scene, to, &count,
              "the bed's conductivity is above 1 m/s, where Darcy's law does not hold");
    // parcels about as large as the patches that release them find room again; much smaller ones mostly fill pores
    const double parcel = scene->grains.parcel;
    if (scene->bed.on && scene->grains.on && silt_bed_erodes(&scene->bed) && parcel > 0 &&
        (parcel < 0.3 * scene->bed.size || parcel > 1.2 * scene->bed.size)) {
        fprintf(to, "%s: warning: grains.parcel is %g of bed.size; 0.5 to 0.8 lets released parcels find room and come to rest as bed\n",
                scene->path, parcel / scene->bed.size);
        count++;
    }
    return count;
}

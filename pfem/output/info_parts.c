// which parts of the program a scene uses, what they cost, and which it goes without

#include "output.h"

const silt_costs silt_costs_measured[2] = {
    {.water = 1.75e3, .bed = 0.3e3, .seepage = 0.8e3, .coupling = 0.25e3, .grain = 9e3},
    {.water = 2.9e3, .bed = 0.6e3, .seepage = 2.8e3, .coupling = 0.75e3, .grain = 10e3},
};

// nodes of regions at a distance
static double parts_nodes(int n, const silt_region *region, double size, bool space) {
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += silt_region_area(&region[i]);
    return sum / (size * size * (space ? size : 1));
}

/** a part that a scene may go without */
typedef struct info_part {
    const char *name;
    bool used;
} info_part;

static bool parts_gmsh(const silt_scene *scene) {
    bool used = false;
    for (int i = 0; i < scene->n_wall; i++) {
        const char *file = scene->wall[i].surface, *ending = file ? strrchr(file, '.') : NULL;
        used |= ending && (strcmp(ending, ".geo") == 0 || strcmp(ending, ".step") == 0 || strcmp(ending, ".stp") == 0);
    }
    return used;
}

void silt_info_parts(const silt_scene *scene, FILE *to) {
    const bool space = scene->dimension == 3, grains = scene->grains.on, bodies = scene->n_body > 0;
    const silt_fluid_def *fluid = &scene->fluid;
    const silt_costs *cost = &silt_costs_measured[space];
    const double nodes = fluid->on ? parts_nodes(fluid->n_region, fluid->region, fluid->size, space) : 0;
    const bool law = silt_scene_law(scene);
    bool levels = false, motion = false, feeds = false;
    for (int i = 0; i < scene->n_wall; i++)
        motion |= scene->wall[i].motion.n_row > 0;
    for (int i = 0; i < fluid->n_outlet; i++)
        levels |= fluid->outlet[i].level.n_row > 0;
    for (int i = 0; i < fluid->n_inlet; i++) {
        levels |= fluid->inlet[i].drive == INLET_HEAD;
        feeds |= fluid->inlet[i].grains > 0;
    }
    fputs("  memory    ", to);
    if (fluid->on)
        fprintf(to, " water %.2g kB a node, %.2g MB at the start;", cost->water / 1e3, cost->water * nodes / 1e6);
    if (scene->bed.on) {
        const double n = parts_nodes(scene->bed.n_region, scene->bed.region, scene->bed.size, space);
        const double each = cost->bed + (silt_seep_on(scene) ? cost->seepage : 0);
        fprintf(to, " bed %.2g kB a node, %.2g MB;", each / 1e3, each * n / 1e6);
    }
    if (fluid->on && (grains || bodies))
        fprintf(to, " coupling %.2g kB a node of the water;", cost->coupling / 1e3);
    if (grains)
        fprintf(to, " grains %.2g kB each;", cost->grain / 1e3);
    fputs(" half as much again while a step is solved\n  processes  ", to);
    if (grains || bodies)
        fputs("two: silt, and silt-dem with LIGGGHTS, MPI and VTK: about 35 MB, 0.15 s to start\n", to);
    else
        fputs("one; no LIGGGHTS, MPI or VTK\n", to);
    fprintf(to, "  modules    %s; silt-draw.so (cairo) is loaded by draw and report alone\n",
            parts_gmsh(scene) ? "silt-gmsh.so, for surfaces that only gmsh reads" : "none");
    const info_part part[] = {
        {"water", fluid->on},
        {"sizes", fluid->n_size > 0},
        {"turbulence model", fluid->on && fluid->turbulence > TURBULENCE_NONE},
        {"eddies that go with the water", fluid->on && fluid->turbulence == TURBULENCE_SPALART_ALLMARAS},
        {"law of the wall", fluid->on && law},
        {"openings with levels", levels},
        {"body force", fluid->force.kind != 0},
        {"surface tension", fluid->surface_tension > 0},
        {"pockets of air", fluid->air_pressure > 0},
        {"moving walls", motion},
        {"bed", scene->bed.on},
        {"seepage", scene->bed.on && silt_seep_on(scene)},
        {"grains", grains},
        {"fed grains", feeds},
        {"bodies", bodies},
        {"gauges", scene->n_gauge > 0},
        {"checks", scene->n_check > 0},
    };
    for (int used = 1; used >= 0; used--) {
        int n = 0;
        fprintf(to, "  %s", used ? "uses      " : "without   ");
        for (size_t k = 0; k < sizeof part / sizeof *part; k++)
            if (part[k].used == (used == 1))
                fprintf(to, "%s %s", n++ ? "," : "", part[k].name);
        fputs(n ? "\n" : " nothing\n", to);
    }
}

// how long the next step may be
#include "run.h"

#define STEP_FEW    0.03 // share of the water's nodes that may be spray
#define STEP_SPRAY  2    // times the root mean square of the water's speed
#define STEP_FLYING 4    // drops in free flight, whose paths are exact, may cross as many shares of a cell in the plane
#define STEP_BINS   64

// time in which a wall that moves passes a cell of the water on it: a gate also that slides along the water
static double walls_time(const silt_run *run) {
    const silt_nodes *nodes = &run->nodes;
    const silt_walls *walls = &run->walls;
    const int D = silt_nodes_dim(nodes);
    double least = HUGE_VAL;
    for (int i = 0; i < nodes->count; i++)
        for (int k = 0; k < 3 && nodes->wall[i][k] >= 0; k++) {
            const silt_wall_motion *m = &walls->motion[walls->wall[nodes->wall[i][k]]];
            const int up = D == 3 ? 2 : 1;
            double v[3] = {m->velocity[0], m->velocity[1], m->velocity[2]};
            v[0] -= m->spin * (nodes->x[D * i + up] - m->centre[up]);
            v[up] += m->spin * (nodes->x[D * i] - m->centre[0]);
            const double speed = silt_length(3, v);
            if (speed > 0)
                least = silt_min(least, silt_node_h(nodes, i, run->scene->fluid.size) / speed);
        }
    return least;
}

// speed beyond which water is spray
static double spray_speed(const silt_run *run) {
    const int D = silt_nodes_dim(&run->nodes), n = run->mesh.n_node;
    double sum = 0, count = 0;
    for (int i = 0; i < n; i++)
        if (run->mesh.wet[i]) {
            sum += silt_dot(D, run->nodes.v + D * i, run->nodes.v + D * i);
            count++;
        }
    return count > 0 ? STEP_SPRAY * sqrt(sum / count) : 0;
}

// Time in which a node crosses a cell. What little spray there is costs steps and is worth none: it may cross up to twice as
// much as the rest, drops in free flight four times in the plane: the collapse at 40 cells takes 642 steps in place of 990, its volume
// error stays. In space it does not, 0.3 to 0.6 % in place of 0.05 at 10 cells, where drops land: there they set the pace too.
static double crossing_time(const silt_run *run) {
    const silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    const double spray = spray_speed(run);
    double every = HUGE_VAL, least = HUGE_VAL;
    int bin[STEP_BINS] = {0}, n_water = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < nodes->count; i++) {
            const double speed = silt_length(D, nodes->v + D * i);
            if (nodes->kind[i] == NODE_CORNER || nodes->kind[i] == NODE_BED || speed == 0)
                continue;
            const double time = silt_node_h(nodes, i, run->scene->fluid.size) / speed;
            const bool wet = i < run->mesh.n_node && run->mesh.wet[i], water = nodes->kind[i] == NODE_FLUID && wet;
            if (!water || speed < spray)
                every = silt_min(every, D == 2 && nodes->kind[i] == NODE_FLUID && !wet ? STEP_FLYING * time : time);
            else if (pass == 0)
                least = silt_min(least, time);
            else if (time < 2 * least)
                bin[(int)(STEP_BINS * silt_min(time / least - 1, 1 - 1e-9))]++;
            n_water += pass == 0 && water;
        }
    int few = 0, k = 0;
    while (k < STEP_BINS && few + bin[k] <= STEP_FEW * n_water)
        few += bin[k++];
    return silt_min(every, least < HUGE_VAL ? least * (1 + (double)k / STEP_BINS) : least);
}

// largest step that accuracy allows: courant number, cells that do not turn over, gravity, growth
double silt_run_pace(const silt_run *run) {
    const silt_scene *scene = run->scene;
    const silt_nodes *nodes = &run->nodes;
    const int D = silt_nodes_dim(nodes);
    double dt = scene->time.step > 0 ? scene->time.step : HUGE_VAL;
    dt = silt_min(dt, scene->time.output);
    if (!scene->fluid.on)
        return dt;
    double least = crossing_time(run);
    // time in which a node falls through a cell
    for (int i = 0; i < nodes->count; i++) {
        if (nodes->kind[i] == NODE_CORNER || nodes->kind[i] == NODE_BED)
            continue;
        const double h = silt_node_h(nodes, i, scene->fluid.size);
        double a[3];
        silt_run_acceleration(run, nodes->x + D * i, a);
        const double g = silt_length(D, a);
        if (g > 0)
            least = silt_min(least, sqrt(h / g));
        least = silt_min(least, silt_tension_time(scene->fluid.surface_tension, scene->fluid.density, h));
    }
    least = silt_min(least, walls_time(run));
    // water at rest meets a belt or a lid
    for (int k = 0; k < scene->n_wall; k++) {
        const double speed = silt_length(3, scene->wall[k].velocity);
        if (speed > 0)
            least = silt_min(least, scene->fluid.size / speed);
    }
    dt = silt_min(dt, scene->time.cfl * least);
    // it grows by half at most, and with grains by one of their steps at least
    if (run->dt > 0) {
        const double small = run->coupling ? silt_coupling_dem.step(run->coupling) : 0;
        dt = silt_min(dt, run->dt + silt_max(small, 0.5 * run->dt));
    }

    // a cell may lose four fifths of its volume; slivers do not decide
    const double shortest = 0.25 * dt;
    for (int e = 0; e < run->mesh.n_cell && dt > shortest; e++) {
        const int *cell = run->mesh.cell[e];
        double h = 0, volume = silt_cell_volume(&run->mesh, nodes->x, e), start[12], x[12];
        for (int a = 0; a <= D; a++)
            h += silt_node_h(nodes, cell[a], scene->fluid.size) / (D + 1);
        if (volume < (D == 3 ? 0.03 * h * h * h : 0.1 * h * h))
            continue;
        silt_cell_corners(&run->mesh, nodes->x, cell, start);
        while (dt > shortest) {
            for (int a = 0; a <= D; a++)
                for (int d = 0; d < D; d++)
                    x[D * a + d] = start[D * a + d] + dt * nodes->v[D * cell[a] + d];
            if (silt_simplex_volume(D, x) > 0.2 * volume)
                break;
            dt *= 0.8;
        }
    }
    return dt;
}

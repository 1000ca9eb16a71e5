// walls.c: the scene's walls as LIGGGHTS has them, and the way that those that move go in a step
#include "state.h"

#define WALL_GRAIN 0x1p-40 // m, that a wall's way in a substep is a multiple of

static double walls_grain(double way) { return WALL_GRAIN * rint(way / WALL_GRAIN); }

// the walls as the discrete elements take them, where they are now
static void walls_take(const silt_coupling *c, double (*wall)[4], double (*triangle)[10]) {
    const silt_walls *walls = c->walls;
    for (int i = 0; i < walls->count && c->dim == 2; i++)
        for (int k = 0; k < 2; k++) {
            wall[i][k] = walls->from[i][k];
            wall[i][2 + k] = walls->to[i][k];
        }
    for (int i = 0; i < walls->count && c->dim == 3; i++) {
        memcpy(triangle[i], walls->corner[i], sizeof walls->corner[i]);
        triangle[i][9] = 0.0;
        for (int k = 0; k < 3; k++)
            triangle[i][9] += walls->joined[i][k] < 0 ? 1 << k : 0;
    }
}

void silt_coupling_walls_stand(silt_coupling *c) {
    walls_take(c, c->wall, c->triangle);
    for (int m = 0; m < c->n_motion; m++) {
        memcpy(c->centre[m], c->towards[m], sizeof *c->centre);
        memcpy(c->pivot[m], c->centre[m], sizeof *c->pivot);
    }
}

void silt_coupling_walls(silt_coupling *c) {
    const silt_walls *walls = c->walls;
    const size_t n = (size_t)walls->n_wall + 1;
    c->wall = silt_alloc((size_t)walls->count + 1, sizeof *c->wall);
    c->triangle = silt_alloc((size_t)walls->count + 1, sizeof *c->triangle);
    c->wall_motion = silt_alloc((size_t)walls->count + 1, sizeof *c->wall_motion);
    c->moving = silt_alloc(n, sizeof *c->moving);
    c->centre = silt_alloc(n, sizeof *c->centre);
    c->pivot = silt_alloc(n, sizeof *c->pivot);
    c->towards = silt_alloc(n, sizeof *c->towards);
    c->rate = silt_alloc(n, sizeof *c->rate);
    for (int i = 0; i < walls->count; i++)
        c->wall_motion[i] = -1;
    for (int w = 0; w < walls->n_wall; w++) {
        if (c->scene->wall[w].motion.n_row == 0)
            continue;
        for (int i = 0; i < walls->count; i++)
            if (walls->wall[i] == w)
                c->wall_motion[i] = c->n_motion;
        c->accelerates |= silt_path_accelerates(&c->scene->wall[w].motion);
        const silt_wall_motion *motion = &walls->motion[w];
        double *at = c->towards[c->n_motion];
        for (int k = 0; k < c->dim; k++)
            at[k] = walls_grain(motion->centre[k]);
        at[3] = motion->angle;
        c->moving[c->n_motion++] = w;
    }
    silt_coupling_walls_stand(c);
}

void silt_coupling_wall_rates(silt_coupling *c, int m, int n, double (*rate)[4]) {
    const silt_wall *wall = &c->scene->wall[c->moving[m]];
    double from[4], to[4];
    memcpy(from, c->centre[m], sizeof from);
    for (int k = 0; k < n; k++) {
        silt_path_at(&wall->motion, c->walls->time - (n - 1 - k) * c->step, to);
        for (int d = 0; d < 3; d++)
            to[d] = d < c->dim ? from[d] + walls_grain(wall->pivot[d] + to[d] - from[d]) : 0;
        for (int d = 0; d < 4; d++)
            rate[k][d] = (to[d] - from[d]) / c->step;
        memcpy(from, to, sizeof from);
    }
    memcpy(c->towards[m], from, sizeof from);
}

// LIGGGHTS adds up the way of a wall's pivot substep by substep: by such multiples the sum is exact, and a run that goes on from a
// checkpoint has the same bits
void silt_coupling_walls_go(silt_coupling *c, int n) {
    if (c->n_motion == 0)
        return;
    for (int m = 0; m < c->n_motion; m++) {
        const silt_wall_motion *motion = &c->walls->motion[c->moving[m]];
        for (int k = 0; k < c->dim; k++) {
            const double way = walls_grain((motion->centre[k] - c->centre[m][k]) / n);
            c->rate[m][k] = way / c->step;
            c->towards[m][k] = c->centre[m][k] + n * way;
        }
        c->rate[m][3] = (motion->angle - c->centre[m][3]) / (n * c->step);
        c->towards[m][3] = motion->angle;
    }
    double(*wall)[4] = silt_alloc((size_t)c->walls->count + 1, sizeof *wall);
    double(*triangle)[10] = silt_alloc((size_t)c->walls->count + 1, sizeof *triangle);
    walls_take(c, wall, triangle);
    silt_dem_move_walls(c->dem, (const double(*)[4])c->rate, c->dim == 3 ? triangle[0] : wall[0]);
    free(wall);
    free(triangle);
}

void silt_coupling_sides(silt_coupling *c) {
    double *lo = &c->dem_def.lo[1], *hi = &c->dem_def.hi[1];
    for (int i = 0; i < c->walls->count; i++)
        for (int k = 0; k < 3; k++) {
            const double y = c->walls->corner[i][k][1];
            *lo = i + k > 0 ? silt_min(*lo, y) : y;
            *hi = i + k > 0 ? silt_max(*hi, y) : y;
        }
}

double silt_coupling_across(const silt_coupling *c, double y) {
    const double low = c->dem_def.lo[1], wide = c->dem_def.hi[1] - low;
    return c->dem_def.across ? y - wide * floor((y - low) / wide) : y;
}

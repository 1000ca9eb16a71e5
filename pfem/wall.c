// the tank's straight walls: where they are, and what happens to water nodes that meet them
#include "pfem.h"

void silt_walls_create(silt_walls *walls, const silt_scene *scene) {
    int n = 0;
    for (int w = 0; w < scene->n_wall; w++)
        n += scene->wall[w].n_point - (scene->wall[w].closed ? 0 : 1);
    *walls = (silt_walls){.count = n};
    const size_t room = (size_t)(n ? n : 1);
    walls->from = silt_alloc(room, sizeof *walls->from);
    walls->to = silt_alloc(room, sizeof *walls->to);
    walls->normal = silt_alloc(room, sizeof *walls->normal);
    walls->slip = silt_alloc(room, 1);
    walls->roughness = silt_alloc(room, sizeof *walls->roughness);
    walls->wall = silt_alloc(room, sizeof *walls->wall);
    walls->patch = silt_alloc(room, sizeof *walls->patch);
    walls->n_wall = scene->n_wall;
    walls->motion = silt_alloc((size_t)scene->n_wall + 1, sizeof *walls->motion);
    walls->next = silt_alloc(room, sizeof *walls->next);
    walls->previous = silt_alloc(room, sizeof *walls->previous);

    int s = 0;
    for (int w = 0; w < scene->n_wall; w++) {
        const silt_wall *wall = &scene->wall[w];
        const int count = wall->n_point - (wall->closed ? 0 : 1);
        for (int k = 0; k < count; k++, s++) {
            const double *a = wall->point + 3 * k, *b = wall->point + 3 * ((k + 1) % wall->n_point);
            const double dx = b[0] - a[0], dy = b[1] - a[1], length = hypot(dx, dy);
            for (int d = 0; d < 2; d++) {
                walls->from[s][d] = a[d];
                walls->to[s][d] = b[d];
            }
            walls->normal[s][0] = -dy / length;
            walls->normal[s][1] = dx / length;
            walls->wall[s] = w;
            walls->patch[s] = s;
            walls->slip[s] = wall->condition != WALL_NO_SLIP;
            walls->roughness[s] = wall->condition == WALL_LAW ? wall->roughness : -1;
        }
    }
    // segments that meet, also of different walls
    for (int i = 0; i < n; i++) {
        walls->next[i] = walls->previous[i] = -1;
        for (int j = 0; j < n; j++) {
            if (j == i)
                continue;
            if (walls->from[j][0] == walls->to[i][0] && walls->from[j][1] == walls->to[i][1])
                walls->next[i] = j;
            if (walls->to[j][0] == walls->from[i][0] && walls->to[j][1] == walls->from[i][1])
                walls->previous[i] = j;
        }
    }
}

void silt_walls_clear(silt_walls *walls) {
    free(walls->from);
    free(walls->to);
    free(walls->normal);
    free(walls->slip);
    free(walls->roughness);
    free(walls->wall);
    free(walls->patch);
    free(walls->motion);
    free(walls->next);
    free(walls->previous);
    *walls = (silt_walls){0};
}

// sine of the turn from segment s to t: positive where the water sits in the corner, negative where the wall points into it
static double wall_turn(const silt_walls *walls, int s, int t) {
    return walls->normal[s][0] * walls->normal[t][1] - walls->normal[s][1] * walls->normal[t][0];
}

double silt_walls_distance(const silt_walls *walls, const double *point, int *segment) {
    double best = HUGE_VAL, sign = 1, best_side = 0;
    *segment = -1;
    for (int s = 0; s < walls->count; s++) {
        const double *a = walls->from[s], *b = walls->to[s], *n = walls->normal[s];
        const double dx = b[0] - a[0], dy = b[1] - a[1];
        const double t = silt_clamp(((point[0] - a[0]) * dx + (point[1] - a[1]) * dy) / (dx * dx + dy * dy), 0, 1);
        const double distance = hypot(point[0] - a[0] - t * dx, point[1] - a[1] - t * dy);
        const double side = (point[0] - a[0]) * n[0] + (point[1] - a[1]) * n[1];
        // nearest to a shared vertex: the segment that the point is farther in front or behind of decides
        const bool tie = fabs(distance - best) <= 1e-12 * (1 + distance);
        if ((!tie && distance < best) || (tie && fabs(side) > fabs(best_side))) {
            best = silt_min(best, distance);
            best_side = side;
            sign = side < 0 ? -1 : 1;
            *segment = s;
        }
    }
    return sign * best;
}

// slides an attached node along its segment; past an end it turns the corner, sticks in it, or comes free
static void wall_slide(const silt_walls *walls, silt_nodes *nodes, int i, double h) {
    double *x = nodes->x + 2 * i;
    for (int turn = 0; turn < 4; turn++) {
        const int s = nodes->wall[i][0];
        const double *a = walls->from[s], *b = walls->to[s];
        const double dx = b[0] - a[0], dy = b[1] - a[1], length = hypot(dx, dy);
        const double along = ((x[0] - a[0]) * dx + (x[1] - a[1]) * dy) / length;
        const double snap = 1e-9 * h;
        const int other = along > length ? walls->next[s] : along < 0 ? walls->previous[s] : -1;
        if (along >= -snap && along <= length + snap) {
            x[0] = a[0] + along * dx / length;
            x[1] = a[1] + along * dy / length;
            return;
        }
        const double sine = other < 0 ? -1 : along > length ? wall_turn(walls, s, other) : wall_turn(walls, other, s);
        if (sine < -1e-9) { // round a corner into the open
            nodes->wall[i][0] = nodes->wall[i][1] = -1;
            return;
        }
        const double *vertex = along > length ? b : a;
        const double beyond = along > length ? along - length : -along;
        const double turn_cosine = walls->normal[s][0] * walls->normal[other][0] + walls->normal[s][1] * walls->normal[other][1];
        if (sine > 0.5 || turn_cosine < 0) { // a corner that holds it
            x[0] = vertex[0];
            x[1] = vertex[1];
            nodes->wall[i][1] = other;
            return;
        }
        // a gentle bend: go on along the next segment with the speed turned
        const double ox = walls->to[other][0] - walls->from[other][0], oy = walls->to[other][1] - walls->from[other][1];
        const double ol = hypot(ox, oy), way = along > length ? beyond : -beyond;
        x[0] = vertex[0] + way * ox / ol;
        x[1] = vertex[1] + way * oy / ol;
        const double speed = (nodes->v[2 * i] * dx + nodes->v[2 * i + 1] * dy) / length;
        nodes->v[2 * i] = speed * ox / ol;
        nodes->v[2 * i + 1] = speed * oy / ol;
        nodes->wall[i][0] = other;
    }
}

// attaches a free node that has come through a segment, or touches it while moving towards it
static void wall_attach(const silt_walls *walls, silt_nodes *nodes, int i, const double *old, double reach) {
    double *x = nodes->x + 2 * i, *v = nodes->v + 2 * i;
    int best = -1;
    double best_along = 0, best_distance = HUGE_VAL;
    for (int s = 0; s < walls->count; s++) {
        const double *a = walls->from[s], *b = walls->to[s], *n = walls->normal[s];
        const double now = (x[0] - a[0]) * n[0] + (x[1] - a[1]) * n[1];
        if (now >= reach || (now >= 0 && v[0] * n[0] + v[1] * n[1] >= 0))
            continue;
        const double before = (old[0] - a[0]) * n[0] + (old[1] - a[1]) * n[1];
        if (now < 0 && before < -reach)
            continue; // was behind it already: another wall's business
        const double dx = b[0] - a[0], dy = b[1] - a[1], length = hypot(dx, dy);
        // where the path meets the line (or the foot point when it only touches)
        const double f = now < 0 && before > 0 ? before / (before - now) : 1;
        const double px = old[0] + f * (x[0] - old[0]), py = old[1] + f * (x[1] - old[1]);
        const double along = ((px - a[0]) * dx + (py - a[1]) * dy) / length;
        if (along < -1e-9 * length || along > length * (1 + 1e-9))
            continue;
        if (f < best_distance) {
            best_distance = f;
            best = s;
            best_along = silt_clamp(((x[0] - a[0]) * dx + (x[1] - a[1]) * dy) / length, 0, length);
        }
    }
    if (best < 0)
        return;
    const double *a = walls->from[best], *b = walls->to[best], *n = walls->normal[best];
    const double length = hypot(b[0] - a[0], b[1] - a[1]);
    for (int d = 0; d < 2; d++)
        x[d] = a[d] + best_along * (b[d] - a[d]) / length;
    nodes->wall[i][0] = best;
    nodes->wall[i][1] = -1;
    const double normal_speed = v[0] * n[0] + v[1] * n[1];
    for (int d = 0; d < 2; d++)
        v[d] = walls->slip[best] ? v[d] - normal_speed * n[d] : 0;
}

// the first water node that comes within reach of an empty inner corner is put into it
static void wall_fill_corners(const silt_walls *walls, silt_nodes *nodes, double reach) {
    for (int s = 0; s < walls->count; s++) {
        const int t = walls->next[s];
        if (t < 0 || wall_turn(walls, s, t) < 0.5)
            continue;
        int best = -1;
        double best_distance = reach;
        for (int i = 0; i < nodes->count; i++) {
            const int *wall = nodes->wall[i];
            if (nodes->kind[i] != NODE_FLUID || wall[0] < 0 || (wall[0] != s && wall[0] != t))
                continue;
            const double distance = hypot(nodes->x[2 * i] - walls->to[s][0], nodes->x[2 * i + 1] - walls->to[s][1]);
            if (distance < best_distance) {
                best_distance = distance;
                best = i;
            }
        }
        if (best < 0 || best_distance == 0)
            continue;
        nodes->x[2 * best] = walls->to[s][0];
        nodes->x[2 * best + 1] = walls->to[s][1];
        nodes->wall[best][0] = s;
        nodes->wall[best][1] = t;
        nodes->v[2 * best] = nodes->v[2 * best + 1] = 0;
    }
}

void silt_walls_contact(const silt_walls *walls, silt_nodes *nodes, const double *x_old, const uint8_t *interior, double h) {
    for (int i = 0; i < nodes->count; i++) {
        if (nodes->kind[i] != NODE_FLUID)
            continue;
        if (nodes->wall[i][0] >= 0 && nodes->wall[i][1] < 0)
            wall_slide(walls, nodes, i, h);
        if (nodes->wall[i][0] < 0)
            wall_attach(walls, nodes, i, x_old + 2 * i, interior[i] ? 0 : 0.1 * h);
    }
    wall_fill_corners(walls, nodes, 0.3 * h);
}

void silt_walls_move(silt_walls *walls, const silt_scene *scene, double time, double dt) {
    (void)walls, (void)scene, (void)time, (void)dt;
}

silt_hold silt_walls_hold(const silt_walls *walls, const int element[3], double vector[3]) {
    memset(vector, 0, 3 * sizeof *vector);
    if (element[0] < 0)
        return HOLD_FREE;
    if (!walls->slip[element[0]] || element[1] >= 0)
        return HOLD_ALL;
    memcpy(vector, walls->normal[element[0]], 3 * sizeof *vector);
    return HOLD_NORMAL;
}

void silt_walls_velocity(const silt_walls *walls, const silt_scene *scene, int element, const double *x, double v[3]) {
    (void)x;
    memcpy(v, scene->wall[walls->wall[element]].velocity, 3 * sizeof *v);
}

bool silt_walls_share(const silt_walls *walls, int n, const int *const element[]) {
    for (int s = 0; s < 3; s++) {
        bool all = element[0][s] >= 0;
        for (int k = 1; k < n && all; k++) {
            bool has = false;
            for (int t = 0; t < 3; t++)
                has |= element[k][t] >= 0 && walls->patch[element[k][t]] == walls->patch[element[0][s]];
            all = has;
        }
        if (all)
            return true;
    }
    return false;
}

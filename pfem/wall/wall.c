// the tank's walls: what they are made of, how they move, what they ask of the water that lies on them
#include "wall.h"

// ---------------------------------------------------------------- build

static void walls_reserve(silt_walls *walls, const silt_scene *scene, int n) {
    const size_t room = (size_t)(n ? n : 1);
    const int dim = scene->dimension == 3 ? 3 : 2;
    *walls = (silt_walls){.dim = dim, .count = n, .n_wall = scene->n_wall};
    if (dim == 3) {
        walls->corner = silt_alloc(room, sizeof *walls->corner);
        walls->joined = silt_alloc(room, sizeof *walls->joined);
    } else {
        walls->from = silt_alloc(room, sizeof *walls->from);
        walls->to = silt_alloc(room, sizeof *walls->to);
        walls->next = silt_alloc(room, sizeof *walls->next);
        walls->previous = silt_alloc(room, sizeof *walls->previous);
    }
    walls->normal = silt_alloc(room, sizeof *walls->normal);
    walls->slip = silt_alloc(room, 1);
    walls->roughness = silt_alloc(room, sizeof *walls->roughness);
    walls->wall = silt_alloc(room, sizeof *walls->wall);
    walls->patch = silt_alloc(room, sizeof *walls->patch);
    walls->motion = silt_alloc((size_t)scene->n_wall + 1, sizeof *walls->motion);
    walls->index = silt_alloc(1, sizeof *walls->index);
    walls->index->surface = silt_alloc((size_t)scene->n_wall + 1, sizeof *walls->index->surface);
    walls->index->step = silt_alloc((size_t)scene->n_wall + 1, sizeof *walls->index->step);
    for (int w = 0; w < scene->n_wall; w++) {
        memcpy(walls->index->surface[w], scene->wall[w].velocity, sizeof walls->index->surface[w]);
        walls->index->step[w] = (wall_step){.moves = scene->wall[w].motion.n_row > 0, .cosine = 1, .whole_cosine = 1};
    }
}

static void element_condition(silt_walls *walls, int e, int w, const silt_wall *wall) {
    walls->wall[e] = w;
    walls->slip[e] = wall->condition != WALL_NO_SLIP;
    walls->roughness[e] = wall->condition == WALL_LAW ? wall->roughness : -1;
}

// A wall that ends where the scene repeats goes on behind: nodes there slide on it before they are taken to the other end.
static void segment_overhang(const silt_scene *scene, double *end, double dx, double dy) {
    const double period = scene->period[1] - scene->period[0];
    if (!(period > 0) || fabs(dx) < 1e-6 * fabs(dy))
        return;
    const double border = dx > 0 ? scene->period[1] : scene->period[0], reach = 0.25 * period;
    if (fabs(end[0] - border) > 1e-9 * period)
        return;
    end[0] += dx > 0 ? reach : -reach;
    end[1] += reach * dy / fabs(dx);
}

static void segments_make(silt_walls *walls, const silt_scene *scene) {
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
            if (!wall->closed && k == 0)
                segment_overhang(scene, walls->from[s], -dx, -dy);
            if (!wall->closed && k == count - 1)
                segment_overhang(scene, walls->to[s], dx, dy);
            walls->normal[s][0] = -dy / length;
            walls->normal[s][1] = dx / length;
            element_condition(walls, s, w, wall);
        }
    }
}

static bool wall_has_box(const silt_wall *wall) {
    return wall->hi[0] > wall->lo[0] && wall->hi[1] > wall->lo[1] && wall->hi[2] > wall->lo[2];
}

// triangle e from three corners, and its normal
static void triangle_set(silt_walls *walls, int e, const double *a, const double *b, const double *c) {
    const double *from[3] = {a, b, c};
    double u[3], v[3], n[3];
    for (int d = 0; d < 3; d++) {
        for (int k = 0; k < 3; k++)
            walls->corner[e][k][d] = from[k][d];
        u[d] = b[d] - a[d];
        v[d] = c[d] - a[d];
    }
    silt_cross(u, v, n);
    const double length = sqrt(wall_dot(n, n));
    for (int d = 0; d < 3; d++)
        walls->normal[e][d] = n[d] / length;
}

// twelve triangles whose normals point into the box
static void box_make(silt_walls *walls, int e, const silt_wall *wall) {
    double at[8][3];
    for (int k = 0; k < 8; k++)
        for (int d = 0; d < 3; d++)
            at[k][d] = k >> d & 1 ? wall->hi[d] : wall->lo[d];
    static const int face[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    for (int f = 0; f < 6; f++)
        for (int half = 0; half < 2; half++) {
            const int a = face[f][0], b = face[f][1 + half], c = face[f][2 + half];
            // the corners as listed turn the normals out of the box
            const bool out = wall->inside_out;
            triangle_set(walls, e++, at[a], at[out ? b : c], at[out ? c : b]);
        }
}

// in walls from files; the scene's own ones were looked at when it was read
static silt_status openings_face(silt_walls *walls, const silt_scene *scene, silt_error *err) {
    const int k = wall_turned(walls, scene), n_in = scene->fluid.n_inlet;
    if (k < 0)
        return SILT_OK;
    silt_walls_clear(walls);
    return silt_fail(err, SILT_INPUT,
                     "%s: key 'fluid.%s.%d.corners': found corners that turn with their back to the water of the wall they lie in, allowed "
                     "counter-clockwise as the water in front of the opening sees them",
                     scene->path ? scene->path : "scene", k < n_in ? "inlets" : "outlets", k < n_in ? k : k - n_in);
}

// the walls once more, with holes where openings are
static void elements_cut(silt_walls *walls, const silt_scene *scene) {
    if (!silt_opening_count(scene))
        return;
    wall_piece *piece;
    const int n = wall_cut(walls, scene, &piece);
    silt_walls whole = *walls;
    walls_reserve(walls, scene, n);
    walls->n_degenerate = whole.n_degenerate;
    for (int e = 0; e < n; e++) {
        const int source = piece[e].source;
        if (walls->dim == 3)
            triangle_set(walls, e, piece[e].corner[0], piece[e].corner[1], piece[e].corner[2]);
        for (int d = 0; d < 2 && walls->dim == 2; d++) {
            walls->from[e][d] = piece[e].corner[0][d];
            walls->to[e][d] = piece[e].corner[1][d];
        }
        memcpy(walls->normal[e], whole.normal[source], sizeof *walls->normal);
        element_condition(walls, e, whole.wall[source], &scene->wall[whole.wall[source]]);
    }
    free(piece);
    silt_walls_clear(&whole);
}

static void triangles_make(silt_walls *walls, const silt_scene *scene, const silt_surface *surface) {
    int e = 0;
    for (int w = 0; w < scene->n_wall; w++) {
        const int first = e;
        if (wall_has_box(&scene->wall[w])) {
            box_make(walls, e, &scene->wall[w]);
            e += 12;
        }
        for (int k = 0; k < surface[w].n_triangle; k++) {
            const int *t = surface[w].triangle[k];
            triangle_set(walls, e++, surface[w].point[t[0]], surface[w].point[t[1]], surface[w].point[t[2]]);
        }
        for (int k = first; k < e; k++)
            element_condition(walls, k, w, &scene->wall[w]);
        walls->n_degenerate += surface[w].n_degenerate;
    }
}

// ---------------------------------------------------------------- joints

// one side of an edge (3-D) or an end (2-D)
typedef struct wall_side {
    int low, high; // vertices
    int element, edge;
} wall_side;

static int compare_sides(const void *a, const void *b) {
    const wall_side *p = a, *q = b;
    if (p->low != q->low)
        return p->low < q->low ? -1 : 1;
    if (p->high != q->high)
        return p->high < q->high ? -1 : 1;
    if (p->element != q->element)
        return p->element < q->element ? -1 : 1;
    return p->edge - q->edge;
}

// corners that coincide get one number: exactly in the scene's polylines, within a hair for triangles; what moves is apart
static void vertices_weld(silt_walls *walls) {
    const int dim = wall_dim(walls), n = dim * walls->count;
    struct silt_wall_index *index = walls->index;
    double(*point)[3] = silt_alloc((size_t)n + 1, sizeof *point);
    int *number = silt_alloc((size_t)n + 1, sizeof *number);
    index->vertex = silt_alloc((size_t)walls->count + 1, sizeof *index->vertex);
    for (int w = -1; w < walls->n_wall; w++) {
        if (w >= 0 && !index->step[w].moves)
            continue;
        double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, extent = 0;
        int count = 0;
        for (int e = 0; e < walls->count; e++)
            for (int k = 0; k < dim && (index->step[walls->wall[e]].moves ? walls->wall[e] : -1) == w; k++, count++) {
                double room[3];
                memcpy(point[count], wall_corner(walls, e, k, room), sizeof *point);
                for (int d = 0; d < 3; d++) {
                    lo[d] = silt_min(lo[d], point[count][d]);
                    hi[d] = silt_max(hi[d], point[count][d]);
                }
            }
        for (int d = 0; d < 3 && count; d++)
            extent = silt_max(extent, hi[d] - lo[d]);
        const int found = wall_weld(count, (const double(*)[3])point, dim == 3 ? 1e-9 * extent : 0, number);
        count = 0;
        for (int e = 0; e < walls->count; e++) {
            if ((index->step[walls->wall[e]].moves ? walls->wall[e] : -1) != w)
                continue;
            for (int k = 0; k < 3; k++)
                index->vertex[e][k] = k < dim ? index->n_vertex + number[count++] : -1;
        }
        index->n_vertex += found;
    }
    free(point);
    free(number);
}

// angle through the water from element e to element f around the edge k of e, rad, above 0
static double water_angle(const silt_walls *walls, int e, int k, int f, int edge_f) {
    double into_e[3], into_f[3], room[2][3];
    if (walls->dim == 3) {
        double along[3];
        for (int d = 0; d < 3; d++)
            along[d] = walls->corner[e][(k + 1) % 3][d] - walls->corner[e][k][d];
        silt_cross(walls->normal[e], along, into_e);
        for (int d = 0; d < 3; d++)
            along[d] = walls->corner[f][(edge_f + 1) % 3][d] - walls->corner[f][edge_f][d];
        silt_cross(walls->normal[f], along, into_f);
    } else
        for (int d = 0; d < 3; d++) {
            into_e[d] = wall_corner(walls, e, 1 - k, room[0])[d] - wall_corner(walls, e, k, room[1])[d];
            into_f[d] = wall_corner(walls, f, 1 - edge_f, room[0])[d] - wall_corner(walls, f, edge_f, room[1])[d];
        }
    const double angle = atan2(wall_dot(into_f, walls->normal[e]) * sqrt(wall_dot(into_e, into_e)), wall_dot(into_f, into_e));
    return angle > 1e-12 ? angle : angle + 2 * M_PI;
}

// elements that meet at an edge: the next one around it on the water's side; walls that move join only themselves
static void elements_join(silt_walls *walls) {
    const int dim = wall_dim(walls), n = dim * walls->count;
    wall_side *side = silt_alloc((size_t)n + 1, sizeof *side);
    for (int e = 0; e < walls->count; e++)
        for (int k = 0; k < dim; k++) {
            const int *vertex = walls->index->vertex[e], a = vertex[k], b = dim == 3 ? vertex[(k + 1) % 3] : 0;
            side[dim * e + k] = (wall_side){dim == 3 && b < a ? b : a, dim == 3 && b < a ? a : b, e, k};
            if (dim == 3)
                walls->joined[e][k] = -1;
            else
                walls->next[e] = walls->previous[e] = -1;
        }
    qsort(side, (size_t)n, sizeof *side, compare_sides);
    for (int first = 0, last; first < n; first = last) {
        for (last = first + 1; last < n && side[last].low == side[first].low && side[last].high == side[first].high;)
            last++;
        for (int i = first; i < last; i++) {
            const int e = side[i].element, k = side[i].edge;
            int best = -1;
            double least = HUGE_VAL;
            for (int j = first; j < last; j++) {
                const int f = side[j].element, m = side[j].edge;
                // turned the same way: the edge runs backwards in one, an end meets a beginning
                const bool against = dim == 3 ? walls->index->vertex[e][k] != walls->index->vertex[f][m] : k != m;
                const bool moves = walls->index->step[walls->wall[e]].moves || walls->index->step[walls->wall[f]].moves;
                if (e == f || !against || (moves && walls->wall[e] != walls->wall[f]))
                    continue;
                const double angle = last - first == 2 ? 0 : water_angle(walls, e, k, f, m);
                if (angle < least) {
                    least = angle;
                    best = f;
                }
            }
            if (dim == 3)
                walls->joined[e][k] = best;
            else
                *(k ? &walls->next[e] : &walls->previous[e]) = best;
        }
    }
    free(side);
}

// patches, and the closed pieces with the water outside
static void elements_group(silt_walls *walls) {
    const int n = walls->count, dim = wall_dim(walls);
    int *piece = walls->index->piece = silt_alloc((size_t)n + 1, sizeof *piece);
    uint8_t *bends = silt_alloc((size_t)n + 1, 1);
    walls->index->bent = silt_alloc((size_t)n + 1, 1);
    for (int e = 0; e < n; e++)
        walls->patch[e] = piece[e] = e;
    for (int e = 0; e < n; e++)
        for (int k = 0; k < dim; k++) {
            const int f = wall_joined(walls, e, k), both[4] = {e, f, -1, -1};
            if (f < 0)
                continue;
            silt_group_join(piece, both);
            const double bend = wall_dot(walls->normal[e], walls->normal[f]);
            if (bend > WALL_BEND) {
                silt_group_join(walls->patch, both);
                bends[e] |= bend < 1 - 1e-9;
            }
        }
    uint8_t *obstacle = silt_alloc((size_t)n + 1, 1);
    double *volume = silt_alloc((size_t)n + 1, sizeof *volume);
    for (int e = 0; e < n; e++) {
        piece[e] = silt_group_find(piece, e);
        walls->patch[e] = silt_group_find(walls->patch, e);
        obstacle[e] = 1;
        walls->index->bent[walls->patch[e]] |= bends[e];
        walls->index->any_bent |= bends[e];
    }
    for (int e = 0; e < n; e++)
        walls->index->bent[e] = walls->index->bent[walls->patch[e]];
    free(bends);
    for (int e = 0; e < n; e++) {
        // twice the area or six times the volume that lies behind, from the piece's first corner
        double room[4][3], r[3][3], c[3];
        const double *origin = wall_corner(walls, piece[e], 0, room[3]);
        for (int k = 0; k < dim; k++) {
            const double *at = wall_corner(walls, e, k, room[k]);
            for (int d = 0; d < 3; d++)
                r[k][d] = at[d] - origin[d];
            obstacle[piece[e]] &= wall_joined(walls, e, k) >= 0;
        }
        silt_cross(r[0], r[1], c);
        volume[piece[e]] += dim == 3 ? wall_dot(c, r[2]) : -c[2];
    }
    walls->index->closed = silt_alloc((size_t)n + 1, 1);
    for (int e = 0; e < n; e++)
        walls->index->closed[e] = obstacle[piece[e]];
    for (int e = 0; e < n; e++)
        obstacle[e] &= volume[e] > 0;
    walls->index->obstacle = silt_alloc((size_t)n + 1, 1);
    for (int e = 0; e < n; e++)
        walls->index->obstacle[e] = obstacle[piece[e]];
    wall_index_create(walls, piece, obstacle);
    free(obstacle);
    free(volume);
}

// normals at vertices, weighted with the angle of each triangle there
static void vertex_normals(silt_walls *walls) {
    struct silt_wall_index *index = walls->index;
    index->vertex_normal = silt_alloc((size_t)index->n_vertex + 1, sizeof *index->vertex_normal);
    for (int e = 0; e < walls->count; e++)
        for (int k = 0; k < 3; k++) {
            double u[3], v[3], c[3];
            for (int d = 0; d < 3; d++) {
                u[d] = walls->corner[e][(k + 1) % 3][d] - walls->corner[e][k][d];
                v[d] = walls->corner[e][(k + 2) % 3][d] - walls->corner[e][k][d];
            }
            silt_cross(u, v, c);
            const double angle = atan2(sqrt(wall_dot(c, c)), wall_dot(u, v));
            for (int d = 0; d < 3; d++)
                index->vertex_normal[index->vertex[e][k]][d] += angle * walls->normal[e][d];
        }
}

// where everything is in the scene, when something will leave it
static void places_keep(silt_walls *walls) {
    struct silt_wall_index *index = walls->index;
    bool any = false;
    for (int w = 0; w < walls->n_wall; w++)
        any |= index->step[w].moves;
    if (!any)
        return;
    index->place = silt_alloc((size_t)walls->count + 1, sizeof *index->place);
    index->place_normal = silt_alloc((size_t)walls->count + 1, sizeof *index->place_normal);
    for (int e = 0; e < walls->count; e++) {
        for (int k = 0; k < wall_dim(walls); k++) {
            double room[3];
            memcpy(index->place[e][k], wall_corner(walls, e, k, room), sizeof room);
        }
        memcpy(index->place_normal[e], walls->normal[e], sizeof index->place_normal[e]);
    }
    if (walls->dim != 3)
        return;
    index->place_vertex = silt_alloc((size_t)index->n_vertex + 1, sizeof *index->place_vertex);
    memcpy(index->place_vertex, index->vertex_normal, (size_t)index->n_vertex * sizeof *index->place_vertex);
}

silt_status silt_walls_create(silt_walls *walls, const silt_scene *scene, silt_error *err) {
    *walls = (silt_walls){0};
    silt_surface *surface = silt_alloc((size_t)scene->n_wall + 1, sizeof *surface);
    silt_status status = SILT_OK;
    int n = 0;
    for (int w = 0; w < scene->n_wall && status == SILT_OK; w++) {
        const silt_wall *wall = &scene->wall[w];
        if (scene->dimension != 3) {
            n += wall->n_point - (wall->closed ? 0 : 1);
            continue;
        }
        n += wall_has_box(wall) ? 12 : 0;
        if (wall->surface)
            status = silt_surface_read(wall->surface, wall->scale > 0 ? wall->scale : 1, wall->inside_out, &surface[w], err);
        n += surface[w].n_triangle;
    }
    if (status == SILT_OK) {
        walls_reserve(walls, scene, n);
        if (scene->dimension == 3)
            triangles_make(walls, scene, surface);
        else
            segments_make(walls, scene);
        status = openings_face(walls, scene, err);
    }
    if (status == SILT_OK) {
        elements_cut(walls, scene);
        vertices_weld(walls);
        elements_join(walls);
        elements_group(walls);
        if (walls->dim == 3)
            vertex_normals(walls);
        places_keep(walls);
        silt_walls_move(walls, scene, 0, 0);
    }
    for (int w = 0; w < scene->n_wall; w++)
        silt_surface_clear(&surface[w]);
    free(surface);
    return status;
}

void silt_walls_clear(silt_walls *walls) {
    free(walls->from);
    free(walls->to);
    free(walls->corner);
    free(walls->normal);
    free(walls->slip);
    free(walls->roughness);
    free(walls->wall);
    free(walls->patch);
    free(walls->motion);
    free(walls->next);
    free(walls->previous);
    free(walls->joined);
    struct silt_wall_index *index = walls->index;
    if (index) {
        free(index->tree);
        free(index->box);
        free(index->item);
        free(index->vertex);
        free(index->piece);
        free(index->bent);
        free(index->closed);
        free(index->obstacle);
        free(index->vertex_normal);
        free(index->place);
        free(index->place_normal);
        free(index->place_vertex);
        free(index->surface);
        free(index->step);
        free(index);
    }
    *walls = (silt_walls){0};
}

// ---------------------------------------------------------------- motion

// a turn in the plane of the scene: from x to y in 2-D, from x to z in 3-D
static void turn(int dim, double cosine, double sine, const double v[3], double out[3]) {
    const int up = dim == 3 ? 2 : 1;
    const double p = v[0], q = v[up];
    memmove(out, v, 3 * sizeof *out);
    out[0] = cosine * p - sine * q;
    out[up] = sine * p + cosine * q;
}

static void series_place(const silt_series *motion, double time, double shift[3], double *angle) {
    double place[4];
    silt_path_at(motion, time, place);
    memcpy(shift, place, 3 * sizeof *shift);
    *angle = place[3];
}

static void motion_take(silt_walls *walls, const silt_wall *wall, int w, double time, double dt) {
    const int dim = wall_dim(walls);
    silt_wall_motion *motion = &walls->motion[w];
    wall_step *step = &walls->index->step[w];
    double before[3], angle;
    // without a step: the velocity of that moment, from the slope of the series behind it
    const double span = dt > 0 ? dt : 1e-6;
    series_place(&wall->motion, dt > 0 ? time - dt : time + span, before, &angle);
    series_place(&wall->motion, time, motion->shift, &motion->angle);
    const double sign = dt > 0 ? 1 : -1;
    if (dim == 2)
        motion->shift[2] = before[2] = 0;
    for (int d = 0; d < 3; d++) {
        motion->velocity[d] = sign * (motion->shift[d] - before[d]) / span;
        motion->centre[d] = wall->pivot[d] + motion->shift[d];
        step->before[d] = wall->pivot[d] + (dt > 0 ? before[d] : motion->shift[d]);
    }
    motion->spin = sign * (motion->angle - angle) / span;
    step->dt = dt > 0 ? dt : 0;
    step->cosine = dt > 0 ? cos(motion->angle - angle) : 1;
    step->sine = dt > 0 ? sin(motion->angle - angle) : 0;
    step->whole_cosine = cos(motion->angle);
    step->whole_sine = sin(motion->angle);
}

void silt_walls_move(silt_walls *walls, const silt_scene *scene, double time, double dt) {
    struct silt_wall_index *index = walls->index;
    walls->time = time;
    if (!index || !index->place)
        return;
    const int dim = wall_dim(walls);
    for (int w = 0; w < walls->n_wall; w++)
        if (index->step[w].moves)
            motion_take(walls, &scene->wall[w], w, time, dt);
    for (int e = 0; e < walls->count; e++) {
        const int w = walls->wall[e];
        const wall_step *step = &index->step[w];
        if (!step->moves)
            continue;
        for (int k = 0; k < dim; k++) {
            double r[3], *corner = dim == 3 ? walls->corner[e][k] : k ? walls->to[e] : walls->from[e];
            for (int d = 0; d < 3; d++)
                r[d] = index->place[e][k][d] - scene->wall[w].pivot[d];
            turn(dim, step->whole_cosine, step->whole_sine, r, r);
            for (int d = 0; d < dim; d++)
                corner[d] = walls->motion[w].centre[d] + r[d];
            if (dim == 3)
                turn(dim, step->whole_cosine, step->whole_sine, index->place_vertex[index->vertex[e][k]],
                     index->vertex_normal[index->vertex[e][k]]);
        }
        turn(dim, step->whole_cosine, step->whole_sine, index->place_normal[e], walls->normal[e]);
    }
    for (int t = 0; t < index->n_tree; t++)
        if (index->tree[t].wall >= 0)
            wall_index_refit(walls, t);
}

void wall_carry(const silt_walls *walls, int wall, const double x[3], double out[3]) {
    const wall_step *step = &walls->index->step[wall];
    memmove(out, x, 3 * sizeof *out);
    if (!step->moves)
        return;
    for (int d = 0; d < 3; d++)
        out[d] -= step->before[d];
    turn(wall_dim(walls), step->cosine, step->sine, out, out);
    for (int d = 0; d < 3; d++)
        out[d] += walls->motion[wall].centre[d];
}

void wall_carry_back(const silt_walls *walls, int wall, const double x[3], double out[3]) {
    const wall_step *step = &walls->index->step[wall];
    memmove(out, x, 3 * sizeof *out);
    if (!step->moves)
        return;
    for (int d = 0; d < 3; d++)
        out[d] -= walls->motion[wall].centre[d];
    turn(wall_dim(walls), step->cosine, -step->sine, out, out);
    for (int d = 0; d < 3; d++)
        out[d] += step->before[d];
}

void wall_sliding(const silt_walls *walls, int e, double v[3]) {
    const double *own = walls->index->surface[walls->wall[e]], *n = walls->normal[e], normal = wall_dot(own, n);
    for (int d = 0; d < 3; d++)
        v[d] = own[d] - normal * n[d];
}

void silt_walls_velocity(const silt_walls *walls, const silt_scene *scene, int element, const double *x, double v[3]) {
    if (!walls->index) { // elements made by hand stand still
        memcpy(v, scene->wall[walls->wall[element]].velocity, 3 * sizeof *v);
        return;
    }
    const int w = walls->wall[element], dim = wall_dim(walls);
    const wall_step *step = &walls->index->step[w];
    const silt_wall_motion *motion = &walls->motion[w];
    wall_sliding(walls, element, v);
    if (!step->moves)
        return;
    const double at[3] = {x[0], x[1], dim == 3 ? x[2] : 0};
    double way[3];
    if (step->dt > 0) {
        wall_carry(walls, w, at, way);
        for (int d = 0; d < dim; d++)
            v[d] += (way[d] - at[d]) / step->dt;
        return;
    }
    for (int d = 0; d < 3; d++)
        way[d] = at[d] - motion->centre[d];
    turn(dim, 0, 1, way, way); // a quarter turn
    if (dim == 3)
        way[1] = 0;
    for (int d = 0; d < dim; d++)
        v[d] += motion->velocity[d] + motion->spin * way[d];
}

// ---------------------------------------------------------------- what walls hold

static silt_hold hold_by(const silt_walls *walls, int n, const int element[3], const double *const normal[3], double vector[3]) {
    memset(vector, 0, 3 * sizeof *vector);
    for (int k = 0; k < n; k++)
        if (!walls->slip[element[k]])
            return HOLD_ALL;
    if (n == 0)
        return HOLD_FREE;
    if (n == wall_dim(walls))
        return HOLD_ALL;
    if (n == 2) {
        silt_cross(normal[0], normal[1], vector);
        const double length = sqrt(wall_dot(vector, vector));
        for (int d = 0; d < 3 && length > 0; d++)
            vector[d] /= length;
        if (length > 1e-3)
            return HOLD_LINE;
    }
    memcpy(vector, normal[0], 3 * sizeof *vector);
    return HOLD_NORMAL;
}

// how many elements, and their normals
static int elements_normals(const silt_walls *walls, const int element[3], const double *normal[3]) {
    int n = 0;
    for (; n < wall_dim(walls) && element[n] >= 0; n++)
        normal[n] = walls->normal[element[n]];
    return n;
}

silt_hold silt_walls_hold(const silt_walls *walls, const int element[3], double vector[3]) {
    const double *normal[3] = {NULL};
    const int n = elements_normals(walls, element, normal);
    return hold_by(walls, n, element, normal, vector);
}

bool wall_given(const silt_walls *walls, int n, const int element[3], const double *const normal[3], const double own[3][3],
                double out[3]) {
    double value[3] = {0}, along[3] = {0};
    int stuck = 0;
    for (int k = 0; k < n; k++) {
        value[k] = wall_dot(normal[k], own[k]);
        if (walls->slip[element[k]])
            continue;
        stuck++;
        for (int d = 0; d < 3; d++)
            along[d] += own[k][d];
    }
    int used = n;
    while (used && !wall_solve(used, normal, value, out))
        used--;
    if (!used)
        out[0] = out[1] = out[2] = 0;
    if (stuck) {
        // the mean of those without slip, less what the normals have decided already
        double rest[3], decided[3], of_rest[3];
        for (int d = 0; d < 3; d++)
            rest[d] = along[d] / stuck;
        for (int k = 0; k < used; k++)
            of_rest[k] = wall_dot(normal[k], rest);
        wall_solve(used, normal, of_rest, decided);
        for (int d = 0; d < 3; d++)
            out[d] += rest[d] - decided[d];
    }
    return stuck || used == wall_dim(walls);
}

static void given_by(const silt_walls *walls, const silt_scene *scene, int n, const int element[3], const double *const normal[3],
                     const double *x, double v[3]) {
    double own[3][3];
    memset(v, 0, 3 * sizeof *v);
    for (int k = 0; k < n; k++)
        silt_walls_velocity(walls, scene, element[k], x, own[k]);
    if (n)
        wall_given(walls, n, element, normal, (const double(*)[3])own, v);
}

void silt_walls_given(const silt_walls *walls, const silt_scene *scene, const int element[3], const double *x, double v[3]) {
    const double *normal[3] = {NULL};
    const int n = elements_normals(walls, element, normal);
    given_by(walls, scene, n, element, normal, x, v);
}

// ---------------------------------------------------------------- normals on bent patches

void silt_wall_normals_clear(silt_wall_normals *normals) {
    free(normals->row);
    free(normals->normal);
    *normals = (silt_wall_normals){0};
}

// the patch that all nodes of a wall's facet share, but for those that know no walls (fixed ones); -1
static int facet_patch(const silt_walls *walls, const silt_nodes *nodes, int n, const int *facet) {
    const int *first = NULL;
    for (int c = 0; c < n && !first; c++)
        first = nodes->wall[facet[c]][0] >= 0 ? nodes->wall[facet[c]] : NULL;
    for (int s = 0; first && s < 3 && first[s] >= 0; s++) {
        bool all = true;
        for (int c = 0; c < n && all; c++) {
            const int *other = nodes->wall[facet[c]];
            all = other[0] < 0;
            for (int t = 0; t < 3 && !all; t++)
                all = other[t] >= 0 && walls->patch[other[t]] == walls->patch[first[s]];
        }
        if (all)
            return walls->patch[first[s]];
    }
    return -1;
}

void silt_wall_normals_take(silt_wall_normals *normals, const silt_walls *walls, const silt_nodes *nodes, const silt_mesh *mesh,
                            const double *x) {
    normals->n_row = 0;
    if (!walls->count || !walls->index->any_bent)
        return;
    const int dim = wall_dim(walls);
    SILT_RESERVE(normals->row, normals->row_capacity, nodes->count + 1);
    for (int i = 0; i < nodes->count; i++)
        normals->row[i] = -1;
    for (int k = 0; k < mesh->n_facet; k++) {
        const int *facet = mesh->facet[k];
        const int patch = mesh->facet_kind[k] == FACET_WALL ? facet_patch(walls, nodes, dim, facet) : -1;
        if (patch < 0 || !walls->index->bent[patch])
            continue;
        // the facet's size and direction, into the water
        double side[2][3] = {{0}}, area[3];
        for (int c = 1; c < dim; c++)
            for (int d = 0; d < dim; d++) {
                side[c - 1][d] = x[dim * facet[c] + d] - x[dim * facet[0] + d];
                if (mesh->period[d] > 0)
                    side[c - 1][d] -= mesh->period[d] * floor(side[c - 1][d] / mesh->period[d] + 0.5);
            }
        if (dim == 3)
            silt_cross(side[1], side[0], area);
        else {
            area[0] = -side[0][1];
            area[1] = side[0][0];
            area[2] = 0;
        }
        for (int c = 0; c < dim; c++) {
            const int i = facet[c];
            for (int s = 0; s < dim && nodes->wall[i][s] >= 0; s++) {
                if (walls->patch[nodes->wall[i][s]] != patch)
                    continue;
                if (normals->row[i] < 0) {
                    SILT_RESERVE(normals->normal, normals->normal_capacity, normals->n_row + 1);
                    normals->row[i] = normals->n_row++;
                    memset(normals->normal[normals->row[i]], 0, sizeof *normals->normal);
                }
                for (int d = 0; d < 3; d++)
                    normals->normal[normals->row[i]][s][d] += area[d];
            }
        }
    }
    for (int i = 0; i < nodes->count; i++)
        for (int s = 0; s < dim && normals->row[i] >= 0 && nodes->wall[i][s] >= 0; s++) {
            double *n = normals->normal[normals->row[i]][s];
            const double *own = walls->normal[nodes->wall[i][s]], length = sqrt(wall_dot(n, n));
            // facets that say something else than the wall are not believed
            const bool sound = length > 0 && wall_dot(n, own) > 0.8 * length;
            for (int d = 0; d < 3; d++)
                n[d] = sound ? n[d] / length : own[d];
        }
}

silt_hold silt_walls_held(const silt_walls *walls, const silt_scene *scene, const silt_wall_normals *normals, const silt_nodes *nodes,
                          int i, double vector[3], double given[3]) {
    const double *normal[3] = {NULL};
    const int n = elements_normals(walls, nodes->wall[i], normal);
    if (normals && normals->n_row && normals->row[i] >= 0)
        for (int k = 0; k < n; k++)
            normal[k] = normals->normal[normals->row[i]][k];
    given_by(walls, scene, n, nodes->wall[i], normal, nodes->x + wall_dim(walls) * i, given);
    return hold_by(walls, n, nodes->wall[i], normal, vector);
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

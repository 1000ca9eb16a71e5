// pictures of space: the water's surface and the walls behind it, seen from the front, the right and above without
// perspective, hidden parts taken out pixel by pixel

#include "draw.h"

// where the eye is: turned about z from the negative y axis, raised over the ground, degrees
#define SPACE_TURN 28
#define SPACE_RISE 26
// samples of a pixel along each side
enum { SPACE_FINE = 2 };
// share of the room's diagonal by which lines lie in front of the faces that they bound
#define SPACE_LIFT 0.002

/** the picture while it is painted, SPACE_FINE^2 samples a pixel */
typedef struct space {
    silt_draw_canvas *c;
    double right[3], up[3], eye[3]; // unit: along the picture's axes, and towards the eye
    double light[3];                // unit, towards the light
    double lo[2], hi[2];            // m, the plot's extent along right and up
    int width, height;              // samples
    double scale;                   // samples per metre
    float *depth;                   // owned, m towards the eye, -HUGE_VALF: nothing there
    float (*ink)[3];                // owned
} space;

static double space_dot(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double space_unit(double *v) {
    const double length = sqrt(space_dot(v, v));
    for (int d = 0; d < 3 && length > 0; d++)
        v[d] /= length;
    return length;
}

// the normal of a triangle, by its corners' order, not yet of unit length
static void space_normal(const double *a, const double *b, const double *c, double *normal) {
    double u[3], v[3];
    for (int d = 0; d < 3; d++) {
        u[d] = b[d] - a[d];
        v[d] = c[d] - a[d];
    }
    silt_cross(u, v, normal);
}

static void space_axes(space *s) {
    const double turn = SPACE_TURN * M_PI / 180, rise = SPACE_RISE * M_PI / 180;
    const double eye[3] = {sin(turn) * cos(rise), -cos(turn) * cos(rise), sin(rise)};
    const double right[3] = {cos(turn), sin(turn), 0};
    const double light[3] = {0.25, -0.45, 0.9};
    memcpy(s->eye, eye, sizeof eye);
    memcpy(s->right, right, sizeof right);
    memcpy(s->light, light, sizeof light);
    silt_cross(s->eye, s->right, s->up);
    space_unit(s->light);
}

// samples from the left and from the top, and the depth
static void space_place(const space *s, const double *x, double q[3]) {
    q[0] = (space_dot(s->right, x) - s->lo[0]) * s->scale;
    q[1] = s->height - (space_dot(s->up, x) - s->lo[1]) * s->scale;
    q[2] = space_dot(s->eye, x);
}

// the same in pixels of the picture
static void space_pixel(const space *s, const double *x, double p[2]) {
    double q[3];
    space_place(s, x, q);
    p[0] = MARGIN_LEFT + q[0] / SPACE_FINE;
    p[1] = MARGIN_TOP + q[1] / SPACE_FINE;
}

static void space_dab(space *s, int x, int y, double depth, silt_draw_colour colour, double shade) {
    const size_t k = (size_t)y * (size_t)s->width + (size_t)x;
    if (x < 0 || y < 0 || x >= s->width || y >= s->height || depth <= s->depth[k])
        return;
    s->depth[k] = (float)depth;
    s->ink[k][0] = (float)silt_min(1, shade * colour.r);
    s->ink[k][1] = (float)silt_min(1, shade * colour.g);
    s->ink[k][2] = (float)silt_min(1, shade * colour.b);
}

// ---------------------------------------------------------------- faces and lines

/** a triangle as it is painted: places, what is interpolated on it */
typedef struct space_face {
    const double *x[3];
    double normal[3][3]; // of the corners
    double value[3];
    silt_draw_colour flat; // where it is not coloured by value
    bool coloured;
    double plain, lit; // brightness in the shade, and what the light adds
    double gloss;      // brightness of the light's reflection
} space_face;

static void space_fill(space *s, const space_face *f) {
    double q[3][3];
    for (int k = 0; k < 3; k++)
        space_place(s, f->x[k], q[k]);
    const double area = (q[1][0] - q[0][0]) * (q[2][1] - q[0][1]) - (q[2][0] - q[0][0]) * (q[1][1] - q[0][1]);
    if (area == 0)
        return;
    const int x0 = (int)silt_max(0, floor(silt_min(q[0][0], silt_min(q[1][0], q[2][0]))));
    const int x1 = (int)silt_min(s->width - 1, ceil(silt_max(q[0][0], silt_max(q[1][0], q[2][0]))));
    const int y0 = (int)silt_max(0, floor(silt_min(q[0][1], silt_min(q[1][1], q[2][1]))));
    const int y1 = (int)silt_min(s->height - 1, ceil(silt_max(q[0][1], silt_max(q[1][1], q[2][1]))));
    for (int y = y0; y <= y1; y++)
        for (int x = x0; x <= x1; x++) {
            const double px = x + 0.5, py = y + 0.5;
            double w[3], at[3], normal[3], half[3];
            w[0] = ((q[1][0] - px) * (q[2][1] - py) - (q[2][0] - px) * (q[1][1] - py)) / area;
            w[1] = ((q[2][0] - px) * (q[0][1] - py) - (q[0][0] - px) * (q[2][1] - py)) / area;
            w[2] = 1 - w[0] - w[1];
            if (w[0] < 0 || w[1] < 0 || w[2] < 0)
                continue;
            for (int d = 0; d < 3; d++) {
                at[d] = w[0] * f->x[0][d] + w[1] * f->x[1][d] + w[2] * f->x[2][d];
                normal[d] = w[0] * f->normal[0][d] + w[1] * f->normal[1][d] + w[2] * f->normal[2][d];
                half[d] = s->light[d] + s->eye[d];
            }
            // what stands higher than the room that is shown is cut off
            if (at[2] > s->c->hi[2])
                continue;
            space_unit(normal);
            space_unit(half);
            const double value = w[0] * f->value[0] + w[1] * f->value[1] + w[2] * f->value[2];
            silt_draw_colour ink = f->coloured ? silt_draw_value(s->c, value) : f->flat;
            const double gloss = f->gloss * pow(silt_max(0, space_dot(normal, half)), 40);
            const double shade = f->plain + f->lit * silt_max(0, space_dot(normal, s->light));
            ink = (silt_draw_colour){ink.r * shade + gloss, ink.g * shade + gloss, ink.b * shade + gloss};
            space_dab(s, x, y, w[0] * q[0][2] + w[1] * q[1][2] + w[2] * q[2][2], ink, 1);
        }
}

// a line of some samples' width, a little in front of what it bounds
static void space_line(space *s, const double *a, const double *b, double lift, double width, silt_draw_colour ink) {
    double p[3], q[3], top = s->c->hi[2], end[2][3];
    memcpy(end[0], a, sizeof end[0]);
    memcpy(end[1], b, sizeof end[1]);
    if (end[0][2] > top && end[1][2] > top)
        return;
    for (int k = 0; k < 2; k++)
        if (end[k][2] > top) {
            const double *other = k ? a : b, t = (top - other[2]) / (end[k][2] - other[2]);
            for (int d = 0; d < 3; d++)
                end[k][d] = other[d] + t * (end[k][d] - other[d]);
        }
    space_place(s, end[0], p);
    space_place(s, end[1], q);
    const int n = (int)ceil(silt_max(fabs(q[0] - p[0]), fabs(q[1] - p[1]))) + 1, r = (int)ceil(0.5 * width);
    for (int i = 0; i <= n; i++) {
        const double t = (double)i / n, x = p[0] + t * (q[0] - p[0]), y = p[1] + t * (q[1] - p[1]);
        for (int dy = -r; dy <= r; dy++)
            for (int dx = -r; dx <= r; dx++)
                if (silt_square(floor(x) + dx + 0.5 - x) + silt_square(floor(y) + dy + 0.5 - y) <=
                    0.25 * width * width + 0.25)
                    space_dab(s, (int)floor(x) + dx, (int)floor(y) + dy, p[2] + t * (q[2] - p[2]) + lift, ink, 1);
    }
}

// a sphere
static void space_ball(space *s, const double *x, double radius, double least, silt_draw_colour ink) {
    double q[3];
    space_place(s, x, q);
    const double r = silt_max(least, radius * s->scale);
    for (int j = (int)floor(q[1] - r); j <= (int)ceil(q[1] + r); j++)
        for (int i = (int)floor(q[0] - r); i <= (int)ceil(q[0] + r); i++) {
            const double u = (i + 0.5 - q[0]) / r, v = (q[1] - j - 0.5) / r, rest = 1 - u * u - v * v;
            if (rest < 0)
                continue;
            double lit = 0;
            for (int d = 0; d < 3; d++)
                lit += s->light[d] * (u * s->right[d] + v * s->up[d] + sqrt(rest) * s->eye[d]);
            space_dab(s, i, j, q[2] + sqrt(rest) * r / s->scale, ink, 0.55 + 0.5 * silt_max(0, lit));
        }
}

// ---------------------------------------------------------------- walls

// the size of the room that is shown
static double space_lift(const space *s) {
    double sum = 0;
    for (int d = 0; d < 3; d++)
        sum += silt_square(s->c->hi[d] - s->c->lo[d]);
    return SPACE_LIFT * sqrt(sum);
}

// an edge that shows: at the wall's border, or where it bends by more than 20 degrees
bool silt_draw_sharp(const silt_walls *walls, int element, int edge) {
    const int other = walls->joined[element][edge];
    if (other < 0)
        return true;
    return other > element && space_dot(walls->normal[element], walls->normal[other]) < cos(20 * M_PI / 180);
}

// faces that the water's side turns to the eye; edges of all, those of faces seen from behind thin
static void space_walls(space *s, const silt_walls *walls) {
    const silt_draw_colour grey = silt_draw_hex(0xe4e6e8), dark = silt_draw_hex(0x54585c),
                           pale = silt_draw_hex(0xa9adb1);
    const double lift = space_lift(s);
    for (int i = 0; i < walls->count; i++) {
        const double facing = space_dot(walls->normal[i], s->eye);
        if (facing > 0) {
            space_face face = {.flat = grey, .plain = 0.8, .lit = 0.24};
            for (int k = 0; k < 3; k++) {
                face.x[k] = walls->corner[i][k];
                memcpy(face.normal[k], walls->normal[i], sizeof face.normal[k]);
            }
            space_fill(s, &face);
        }
        for (int k = 0; k < 3; k++)
            if (walls->joined && silt_draw_sharp(walls, i, k)) {
                const int other = walls->joined[i][k];
                const bool seen = facing > 0 || (other >= 0 && space_dot(walls->normal[other], s->eye) > 0);
                space_line(s, walls->corner[i][k], walls->corner[i][(k + 1) % 3], lift, seen ? 2.2 : 1.2,
                           seen ? dark : pale);
            }
    }
}

// ---------------------------------------------------------------- water and grains

static void space_water(space *s, int number) {
    const silt_draw_colour plain = {0.55, 0.75, 0.88}, line = silt_draw_hex(0x2f6690), drop = silt_draw_hex(0x3f7fae);
    const bool mesh = strcmp(s->c->field->name, "mesh") == 0;
    silt_grid grid;
    if (silt_draw_read(s->c, &grid, "surface", number, s->c->field->water)) {
        // the free surface is smooth, faces on walls are as they are
        double *smooth = silt_alloc(3 * (size_t)grid.n_point + 1, sizeof *smooth);
        for (int pass = 0; pass < 2; pass++)
            for (int i = 0; i < grid.n_cell; i++) {
                const int *node = grid.link + grid.offset[i];
                const bool open = !grid.kind || grid.kind[i] == FACET_FREE;
                double normal[3];
                space_face face = {.flat = plain, .plain = 0.68, .lit = 0.36, .gloss = open ? 0.22 : 0};
                for (int k = 0; k < 3; k++)
                    face.x[k] = grid.x + 3 * node[k];
                space_normal(face.x[0], face.x[1], face.x[2], normal);
                for (int k = 0; k < 3 && pass == 0 && open; k++)
                    for (int d = 0; d < 3; d++)
                        smooth[3 * node[k] + d] += normal[d];
                if (pass == 0 || space_dot(normal, s->eye) <= 0)
                    continue;
                face.coloured = grid.value != NULL;
                for (int k = 0; k < 3; k++) {
                    memcpy(face.normal[k], open ? smooth + 3 * node[k] : normal, sizeof normal);
                    space_unit(face.normal[k]);
                    face.value[k] = grid.value ? grid.value[node[k]] : 0;
                }
                space_fill(s, &face);
                for (int k = 0; k < 3 && mesh; k++)
                    space_line(s, face.x[k], face.x[(k + 1) % 3], 0.3 * space_lift(s), 1, line);
            }
        free(smooth);
        silt_grid_clear(&grid);
    }
    // drops
    if (silt_draw_read(s->c, &grid, "fluid", number, NULL)) {
        for (int i = 0; i < grid.n_cell; i++) {
            const int node = grid.link[grid.offset[i]];
            if (silt_grid_corners(&grid, i) == 1 && (!grid.kind || grid.kind[node] == NODE_FLUID))
                space_ball(s, grid.x + 3 * node, 0, 1.6 * SPACE_FINE, drop);
        }
        silt_grid_clear(&grid);
    }
    if (silt_draw_read(s->c, &grid, "grains", number, silt_draw_grain_array(s->c))) {
        for (int i = 0; i < grid.n_point; i++)
            space_ball(s, grid.x + 3 * i, grid.radius ? grid.radius[i] : 0, 1.2 * SPACE_FINE,
                       grid.value ? silt_draw_value(s->c, grid.value[i]) : silt_draw_hex(0xd9a441));
        silt_grid_clear(&grid);
    }
}

// from a face to the mean of those around a corner: below this angle the surface is round there, above it has an edge (of a box 45)
#define SPACE_ROUND 38

// corners of the triangle of polygon i that ends at its corner k + 1: polygons are taken as fans
static void space_fan(const silt_grid *grid, int i, int k, int node[3]) {
    node[0] = grid->link[grid->offset[i]];
    node[1] = grid->link[k];
    node[2] = grid->link[k + 1];
}

// round where they are round
static void space_bodies(space *s, const silt_frame_entry *entry) {
    const silt_draw_colour stone = silt_draw_hex(0xb9b4ac);
    silt_grid grid;
    if (!silt_draw_bodies(s->c, entry, &grid))
        return;
    double *smooth = silt_alloc(3 * (size_t)grid.n_point + 1, sizeof *smooth), normal[3], mean[3];
    int node[3];
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < grid.n_cell; i++)
            for (int k = grid.offset[i] + 1; k + 1 < grid.offset[i + 1]; k++) {
                space_fan(&grid, i, k, node);
                space_face face = {.x = {grid.x + 3 * node[0], grid.x + 3 * node[1], grid.x + 3 * node[2]}, .flat = stone, .plain = 0.5, .lit = 0.55};
                space_normal(face.x[0], face.x[1], face.x[2], normal);
                for (int a = 0; a < 3 && pass == 0; a++)
                    for (int d = 0; d < 3; d++)
                        smooth[3 * node[a] + d] += normal[d];
                space_unit(normal);
                if (pass == 0 || space_dot(normal, s->eye) <= 0)
                    continue;
                for (int a = 0; a < 3; a++) {
                    memcpy(mean, smooth + 3 * node[a], sizeof mean);
                    space_unit(mean);
                    memcpy(face.normal[a], space_dot(mean, normal) > cos(SPACE_ROUND * M_PI / 180) ? mean : normal, sizeof mean);
                }
                space_fill(s, &face);
            }
    free(smooth);
    silt_grid_clear(&grid);
}

// ---------------------------------------------------------------- bed

/** a face of a cell: its corners rising, the corner opposite */
typedef struct space_side {
    int node[3], opposite;
} space_side;

static int compare_side(const void *p, const void *q) {
    const int *a = ((const space_side *)p)->node, *b = ((const space_side *)q)->node;
    for (int k = 0; k < 3; k++)
        if (a[k] != b[k])
            return a[k] < b[k] ? -1 : 1;
    return 0;
}

// the face of a cell opposite its corner k
static space_side space_side_of(const silt_grid *grid, int cell, int k) {
    space_side side = {.opposite = -1};
    int m = 0;
    for (int a = 0; a < 4; a++) {
        const int at = grid->link[grid->offset[cell] + a];
        int to = m;
        if (a == k) {
            side.opposite = at;
            continue;
        }
        for (; to > 0 && side.node[to - 1] > at; to--)
            side.node[to] = side.node[to - 1];
        side.node[to] = at;
        m++;
    }
    return side;
}

int silt_draw_outside(const silt_grid *grid, int (**face)[3]) {
    space_side *side = silt_alloc(4 * (size_t)grid->n_cell + 1, sizeof *side);
    int n = 0, kept = 0;
    for (int i = 0; i < grid->n_cell; i++)
        for (int k = 0; k < 4 && silt_grid_corners(grid, i) == 4; k++)
            side[n++] = space_side_of(grid, i, k);
    qsort(side, (size_t)n, sizeof *side, compare_side);
    *face = silt_alloc((size_t)n + 1, sizeof **face);
    for (int i = 0; i < n; i++) {
        if (i + 1 < n && compare_side(&side[i], &side[i + 1]) == 0) {
            i++;
            continue;
        }
        const double *x = grid->x + 3 * side[i].node[0];
        double normal[3], in[3];
        space_normal(x, grid->x + 3 * side[i].node[1], grid->x + 3 * side[i].node[2], normal);
        for (int d = 0; d < 3; d++)
            in[d] = grid->x[3 * side[i].opposite + d] - x[d];
        const bool turned = space_dot(normal, in) > 0;
        (*face)[kept][0] = side[i].node[0];
        (*face)[kept][1] = side[i].node[turned ? 2 : 1];
        (*face)[kept++][2] = side[i].node[turned ? 1 : 2];
    }
    free(side);
    return kept;
}

static void space_bed(space *s, int number) {
    const silt_draw_colour sand = silt_draw_hex(0xcfae78), line = silt_draw_hex(0x8a6a3a);
    const bool mesh = strcmp(s->c->field->name, "mesh") == 0;
    silt_grid grid;
    if (!silt_draw_read(s->c, &grid, "bed", number, s->c->field->bed))
        return;
    int(*side)[3];
    const int n = silt_draw_outside(&grid, &side);
    for (int i = 0; i < n; i++) {
        space_face face = {.flat = sand, .coloured = grid.value != NULL, .plain = 0.62, .lit = 0.42};
        for (int k = 0; k < 3; k++) {
            face.x[k] = grid.x + 3 * side[i][k];
            face.value[k] = grid.value ? grid.value[side[i][k]] : 0;
        }
        space_normal(face.x[0], face.x[1], face.x[2], face.normal[0]);
        space_unit(face.normal[0]);
        memcpy(face.normal[1], face.normal[0], sizeof face.normal[0]);
        memcpy(face.normal[2], face.normal[0], sizeof face.normal[0]);
        if (space_dot(face.normal[0], s->eye) <= 0)
            continue;
        space_fill(s, &face);
        for (int k = 0; k < 3 && mesh; k++)
            space_line(s, face.x[k], face.x[(k + 1) % 3], 0.3 * space_lift(s), 1, line);
    }
    free(side);
    silt_grid_clear(&grid);
}

// ---------------------------------------------------------------- axes

// ticks and numbers along an edge of the room; they stand off to the side `away`
static void space_axis(space *s, int axis, const double *corner, const double away[2], const char *label) {
    const silt_draw_canvas *c = s->c;
    cairo_t *cr = c->cr;
    double a[3], b[3], p[2], q[2];
    memcpy(a, corner, sizeof a);
    memcpy(b, corner, sizeof b);
    a[axis] = c->lo[axis];
    b[axis] = c->hi[axis];
    space_pixel(s, a, p);
    space_pixel(s, b, q);
    const double length = hypot(q[0] - p[0], q[1] - p[1]), span = c->hi[axis] - c->lo[axis];
    silt_draw_ink(cr, 0x333333);
    cairo_set_line_width(cr, 1);
    cairo_move_to(cr, p[0], p[1]);
    cairo_line_to(cr, q[0], q[1]);
    cairo_stroke(cr);
    const double step = silt_draw_step(silt_max(1e-12, 62 * span / silt_max(length, 1)));
    const int align = away[0] > 0.3 ? -1 : away[0] < -0.3 ? 1 : 0;
    for (double v = step * ceil(c->lo[axis] / step - 1e-9); v <= c->hi[axis] + 1e-9 * span; v += step) {
        char text[32];
        double at[3];
        memcpy(at, corner, sizeof at);
        at[axis] = v;
        space_pixel(s, at, p);
        cairo_move_to(cr, p[0], p[1]);
        cairo_line_to(cr, p[0] + 6 * away[0], p[1] + 6 * away[1]);
        cairo_stroke(cr);
        silt_draw_number(text, v, step);
        if (axis != 1 || v > c->lo[axis] + 0.3 * step) // the number of the first axis' end stands there
            silt_draw_text(cr, p[0] + 12 * away[0], p[1] + 14 * away[1], align, 14, false, text);
    }
    a[axis] = 0.5 * (c->lo[axis] + c->hi[axis]);
    space_pixel(s, a, p);
    silt_draw_text(cr, p[0] + 52 * away[0], p[1] + 44 * away[1], align, 15, false, label);
}

// along the front and the right side of the floor, and upwards at the left
static void space_scales(space *s) {
    const double *lo = s->c->lo, *hi = s->c->hi;
    space_axis(s, 0, (const double[3]){0, lo[1], lo[2]}, (const double[2]){-0.2, 1}, "x, m");
    space_axis(s, 1, (const double[3]){hi[0], 0, lo[2]}, (const double[2]){0.7, 0.7}, "y, m");
    space_axis(s, 2, (const double[3]){lo[0], lo[1], 0}, (const double[2]){-1, 0}, "z, m");
}

// ---------------------------------------------------------------- a picture

// extents of the plot for the room that is shown
static void space_frame(space *s) {
    silt_draw_canvas *c = s->c;
    space_axes(s);
    s->lo[0] = s->lo[1] = HUGE_VAL;
    s->hi[0] = s->hi[1] = -HUGE_VAL;
    for (int k = 0; k < 8; k++) {
        const double x[3] = {k & 1 ? c->hi[0] : c->lo[0], k & 2 ? c->hi[1] : c->lo[1], k & 4 ? c->hi[2] : c->lo[2]};
        const double at[2] = {space_dot(s->right, x), space_dot(s->up, x)};
        for (int d = 0; d < 2; d++) {
            s->lo[d] = silt_min(s->lo[d], at[d]);
            s->hi[d] = silt_max(s->hi[d], at[d]);
        }
    }
    // room for the numbers of the axes, in shares of the plot
    const double wide = s->hi[0] - s->lo[0], high = s->hi[1] - s->lo[1];
    s->lo[0] -= 0.04 * wide;
    s->hi[0] += 0.04 * wide;
    s->lo[1] -= 0.05 * high;
    s->hi[1] += 0.03 * high;
}

// the box of the walls; false: there are none
static bool space_walls_box(const silt_draw_canvas *c, double lo[3], double hi[3]) {
    const silt_walls *walls = c->walls;
    for (int d = 0; d < 3; d++)
        lo[d] = HUGE_VAL, hi[d] = -HUGE_VAL;
    for (int i = 0; walls && walls->corner && i < walls->count; i++)
        for (int k = 0; k < 9; k++) {
            lo[k % 3] = silt_min(lo[k % 3], walls->corner[i][k / 3][k % 3]);
            hi[k % 3] = silt_max(hi[k % 3], walls->corner[i][k / 3][k % 3]);
        }
    return lo[0] <= hi[0];
}

// a frame's part widens the room; grains and bodies that have left the walls' box do not
static void space_widen(silt_draw_canvas *c, const silt_grid *grid, const double *within_lo, const double *within_hi, double lo[3], double hi[3]) {
    bool *counts = silt_alloc((size_t)grid->n_point + 1, sizeof *counts);
    for (int i = 0; i < grid->n_point; i++) {
        counts[i] = true;
        for (int d = 0; d < 3 && within_lo; d++)
            counts[i] &= grid->x[3 * i + d] >= within_lo[d] && grid->x[3 * i + d] <= within_hi[d];
        for (int d = 0; d < 3 && counts[i]; d++) {
            lo[d] = silt_min(lo[d], grid->x[3 * i + d]);
            hi[d] = silt_max(hi[d], grid->x[3 * i + d]);
        }
    }
    silt_draw_range(c, grid, counts);
    free(counts);
}

void silt_draw_space_survey(silt_draw_canvas *c, const silt_frame_entry *entry, int n_frame) {
    double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, wall_lo[3], wall_hi[3];
    const bool walled = space_walls_box(c, wall_lo, wall_hi);
    c->low = HUGE_VAL, c->high = -HUGE_VAL;
    int samples = n_frame < DRAW_SAMPLES ? n_frame : DRAW_SAMPLES;
    for (int k = 0; k < samples; k++) {
        int number = entry[samples > 1 ? (int)((long)k * (n_frame - 1) / (samples - 1)) : 0].number;
        static const char *const name[] = {"surface", "bed", "grains", "bodies"};
        const char *const array[] = {c->field->water, c->field->bed, silt_draw_grain_array(c), NULL};
        for (int part = 0; part < 4; part++) {
            silt_grid grid;
            if (!silt_draw_read(c, &grid, name[part], number, array[part]))
                continue;
            space_widen(c, &grid, walled && part >= 2 ? wall_lo : NULL, wall_hi, lo, hi);
            silt_grid_clear(&grid);
        }
    }
    // walls bound the room; upwards the water does, high empty tanks are cut
    const double room = lo[2] <= hi[2] ? hi[2] + 0.15 * (hi[2] - lo[2]) : HUGE_VAL;
    for (int d = 0; d < 3 && walled; d++) {
        lo[d] = silt_min(lo[d], wall_lo[d]);
        hi[d] = silt_max(hi[d], wall_hi[d]);
    }
    hi[2] = silt_min(hi[2], room);
    for (int d = 0; d < 3; d++) {
        c->lo[d] = lo[d] <= hi[d] ? lo[d] : 0;
        c->hi[d] = hi[d] > c->lo[d] ? hi[d] : c->lo[d] + 1;
    }
    silt_draw_range_round(c);
    space s = {.c = c};
    space_frame(&s);
    const double wide = s.hi[0] - s.lo[0], high = s.hi[1] - s.lo[1];
    c->right = c->plain ? MARGIN_RIGHT : MARGIN_BAR;
    c->scale = silt_min((PICTURE_WIDTH - MARGIN_LEFT - c->right) / wide, PLOT_HEIGHT / high);
    c->width = (int)silt_max(PLOT_NARROW, lround(wide * c->scale));
    c->height = (int)silt_max(PLOT_LOW, lround(high * c->scale));
}

// the samples' mean goes into the picture
static void space_show(space *s) {
    silt_draw_canvas *c = s->c;
    cairo_surface_flush(c->surface);
    uint8_t *pixels = cairo_image_surface_get_data(c->surface);
    const int stride = cairo_image_surface_get_stride(c->surface);
    for (int y = 0; y < c->height; y++) {
        uint32_t *row = (uint32_t *)(void *)(pixels + (size_t)(y + MARGIN_TOP) * (size_t)stride) + MARGIN_LEFT;
        for (int x = 0; x < c->width; x++) {
            double sum[3] = {0, 0, 0};
            for (int k = 0; k < SPACE_FINE * SPACE_FINE; k++) {
                const size_t at = (size_t)(SPACE_FINE * y + k / SPACE_FINE) * (size_t)s->width +
                                  (size_t)(SPACE_FINE * x + k % SPACE_FINE);
                for (int d = 0; d < 3; d++)
                    sum[d] += (double)s->ink[at][d] / (SPACE_FINE * SPACE_FINE);
            }
            row[x] = 0xff000000u | (uint32_t)lround(255 * sum[0]) << 16 | (uint32_t)lround(255 * sum[1]) << 8 |
                     (uint32_t)lround(255 * sum[2]);
        }
    }
    cairo_surface_mark_dirty(c->surface);
}

void silt_draw_space(silt_draw_canvas *c, const silt_frame_entry *entry) {
    space s = {
        .c = c, .width = SPACE_FINE * c->width, .height = SPACE_FINE * c->height, .scale = SPACE_FINE * c->scale};
    const size_t n = (size_t)s.width * (size_t)s.height;
    space_frame(&s);
    s.depth = silt_alloc(n, sizeof *s.depth);
    s.ink = silt_alloc(n, sizeof *s.ink);
    for (size_t k = 0; k < n; k++) {
        s.depth[k] = -HUGE_VALF;
        s.ink[k][0] = s.ink[k][1] = s.ink[k][2] = 1;
    }
    if (c->walls && c->walls->corner)
        space_walls(&s, c->walls);
    space_bed(&s, entry->number);
    space_bodies(&s, entry);
    space_water(&s, entry->number);
    space_show(&s);
    space_scales(&s);
    free(s.depth);
    free(s.ink);
}

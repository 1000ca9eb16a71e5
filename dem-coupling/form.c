// form.c: surfaces of rigid objects in space: prisms, bodies of revolution, tetrapod, temple, and what a file holds
#include "form.h"

#include "wall.h"

enum { FORM_ROUND = 128, FORM_RINGS = 32, FORM_SPHERE = 5, FORM_LEG = 72 };

/* Tetrapod of height h (P. Danel, "Tetrapods", Coastal Engineering Proceedings 1(4), 1953; proportions as the Shore Protection Manual,
 * 1984, has them): tips 0.302 h across, volume 0.280 h3. The legs' length follows from standing on three of them,
 * L (1 + 1/3) + 0.151 h sqrt(8)/3 = h; how much they taper from the volume. */
static const double tetrapod_tip = 0.151, tetrapod_length = 0.64322687604, tetrapod_root = 0.264915;

/** triangles before their corners are joined */
typedef struct form {
    int n, capacity;
    double (*corner)[3]; // owned, 3 per triangle
} form;

static void form_triangle(form *f, const double *a, const double *b, const double *c) {
    SILT_RESERVE(f->corner, f->capacity, 3 * (f->n + 1));
    memcpy(f->corner[3 * f->n], a, sizeof *f->corner);
    memcpy(f->corner[3 * f->n + 1], b, sizeof *f->corner);
    memcpy(f->corner[3 * f->n++ + 2], c, sizeof *f->corner);
}

static void form_quad(form *f, const double *a, const double *b, const double *c, const double *d) {
    form_triangle(f, a, b, c);
    form_triangle(f, a, c, d);
}

// corners that coincide become one; what has no area then goes
static silt_status form_finish(form *f, silt_solid *s, const char *what, silt_error *err) {
    double extent = 0;
    for (int i = 0; i < 3 * f->n; i++)
        for (int d = 0; d < 3; d++)
            extent = silt_max(extent, fabs(f->corner[i][d]));
    int *number = silt_alloc(3 * (size_t)f->n + 1, sizeof *number);
    s->n_point = wall_weld(3 * f->n, (const double(*)[3])f->corner, 1e-9 * extent, number);
    s->point = silt_alloc((size_t)s->n_point + 1, sizeof *s->point);
    s->face = silt_alloc((size_t)f->n + 1, sizeof *s->face);
    for (int i = 3 * f->n - 1; i >= 0; i--)
        memcpy(s->point[number[i]], f->corner[i], sizeof *s->point);
    for (int t = 0; t < f->n; t++) {
        const int *c = number + 3 * t;
        if (c[0] != c[1] && c[1] != c[2] && c[2] != c[0])
            memcpy(s->face[s->n_face++], c, sizeof *s->face);
    }
    free(number);
    free(f->corner);
    return silt_solid_close(s, what, err);
}

// ---------------------------------------------------------------- prisms

static double turn_at(const double *a, const double *b, const double *c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// true when the corner k of what is left is an ear: convex, with no other corner in it
static bool is_ear(int n, const int *left, const double *p, int k) {
    const double *a = p + 2 * left[(k + n - 1) % n], *b = p + 2 * left[k], *c = p + 2 * left[(k + 1) % n];
    if (!(turn_at(a, b, c) > 0))
        return false;
    for (int i = 0; i < n; i++) {
        const double *x = p + 2 * left[i];
        if (x != a && x != b && x != c && turn_at(a, b, x) >= 0 && turn_at(b, c, x) >= 0 && turn_at(c, a, x) >= 0)
            return false;
    }
    return true;
}

// over the polygon in x-z, counter-clockwise, 2 per point, from y = -depth/2 to depth/2
static void form_prism(form *f, int n, const double *p, double depth) {
    double(*side[2])[3] = {silt_alloc((size_t)n, sizeof **side), silt_alloc((size_t)n, sizeof **side)};
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 2; k++) {
            side[k][i][0] = p[2 * i];
            side[k][i][1] = k ? depth / 2 : -depth / 2;
            side[k][i][2] = p[2 * i + 1];
        }
    for (int i = 0; i < n; i++) {
        const int j = (i + 1) % n;
        form_quad(f, side[0][i], side[1][i], side[1][j], side[0][j]);
    }
    int *left = silt_alloc((size_t)n, sizeof *left), m = n;
    for (int i = 0; i < n; i++)
        left[i] = i;
    while (m > 2) {
        int k = 0;
        while (k < m - 1 && !is_ear(m, left, p, k))
            k++;
        const int a = left[(k + m - 1) % m], b = left[k], c = left[(k + 1) % m];
        form_triangle(f, side[0][a], side[0][b], side[0][c]);
        form_triangle(f, side[1][a], side[1][c], side[1][b]);
        memmove(left + k, left + k + 1, (size_t)(--m - k) * sizeof *left);
    }
    free(left);
    free(side[0]);
    free(side[1]);
}

// ---------------------------------------------------------------- round ones

// radius of the regular polygon of n corners that has the circle's area
static double round_radius(double radius, int n) { return radius * sqrt(2 * M_PI / n / sin(2 * M_PI / n)); }

// about z, from the bottom to the top: n pairs of radius and height
static void form_revolve(form *f, int n, const double (*profile)[2]) {
    for (int k = 0; k + 1 < n; k++)
        for (int i = 0; i < FORM_ROUND; i++) {
            double x[4][3];
            for (int c = 0; c < 4; c++) {
                const int at = (c == 1 || c == 2) ? (i + 1) % FORM_ROUND : i;
                const double *of = profile[c < 2 ? k : k + 1];
                x[c][0] = of[0] * cos(2 * M_PI * at / FORM_ROUND);
                x[c][1] = of[0] * sin(2 * M_PI * at / FORM_ROUND);
                x[c][2] = of[1];
            }
            form_quad(f, x[0], x[1], x[2], x[3]);
        }
}

// the icosahedron's faces, each in four, and so on
static void form_ball(form *f, const double *a, const double *b, const double *c, int level) {
    if (level == 0) {
        form_triangle(f, a, b, c);
        return;
    }
    double m[3][3];
    const double *end[4] = {a, b, c, a};
    for (int k = 0; k < 3; k++) {
        for (int d = 0; d < 3; d++)
            m[k][d] = end[k][d] + end[k + 1][d];
        const double length = silt_length(3, m[k]);
        for (int d = 0; d < 3; d++)
            m[k][d] /= length;
    }
    form_ball(f, a, m[0], m[2], level - 1);
    form_ball(f, b, m[1], m[0], level - 1);
    form_ball(f, c, m[2], m[1], level - 1);
    form_ball(f, m[0], m[1], m[2], level - 1);
}

static void form_sphere(form *f) {
    static const int face[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},   {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                                    {3, 8, 9},  {4, 9, 5},  {2, 4, 11},  {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    const double t = (1 + sqrt(5)) / 2, r = sqrt(1 + t * t);
    double x[12][3] = {{-1, t, 0}, {1, t, 0}, {-1, -t, 0}, {1, -t, 0}, {0, -1, t}, {0, 1, t}, {0, -1, -t}, {0, 1, -t}, {t, 0, -1}, {t, 0, 1}, {-t, 0, -1}, {-t, 0, 1}};
    for (int i = 0; i < 12; i++)
        for (int d = 0; d < 3; d++)
            x[i][d] /= r;
    for (int k = 0; k < 20; k++)
        form_ball(f, x[face[k][0]], x[face[k][1]], x[face[k][2]], FORM_SPHERE);
}

static void form_capsule(form *f, double length, double thick) {
    double profile[2 * FORM_RINGS + 2][2];
    const double r = thick / 2, half = length / 2 - r;
    for (int k = 0; k <= FORM_RINGS; k++) {
        const double angle = M_PI / 2 * k / FORM_RINGS;
        profile[k][0] = k == 0 ? 0 : r * sin(angle);
        profile[k][1] = -half - r * cos(angle);
        profile[2 * FORM_RINGS + 1 - k][0] = profile[k][0];
        profile[2 * FORM_RINGS + 1 - k][1] = -profile[k][1];
    }
    form_revolve(f, 2 * FORM_RINGS + 2, (const double(*)[2])profile);
    // along x
    for (int i = 0; i < 3 * f->n; i++) {
        const double *x = f->corner[i], turned[3] = {x[2], x[0], x[1]};
        memcpy(f->corner[i], turned, sizeof turned);
    }
}

// ---------------------------------------------------------------- tetrapod

// Each leg is a cone from the middle to its tip, cut by the planes halfway to the other legs. Seen along its axis the angle is counted
// from another leg, so that both legs at a cut have the same points there.
static void form_tetrapod(form *f) {
    static const double axis[4][3] = {{0, 0, 1}, {0.94280904158206336, 0, -1.0 / 3}, {-0.47140452079103168, 0.81649658092772603, -1.0 / 3}, {-0.47140452079103168, -0.81649658092772603, -1.0 / 3}};
    const double tip = round_radius(tetrapod_tip, FORM_LEG), root = round_radius(tetrapod_root, FORM_LEG);
    const double taper = (root - tip) / tetrapod_length, cosine = -1.0 / 3, sine = sqrt(8) / 3;
    for (int leg = 0; leg < 4; leg++) {
        const double *a = axis[leg], *towards = axis[(leg + 1) % 4];
        double e[3], g[3], rim[FORM_LEG][3], cut[FORM_LEG][3], middle[3];
        for (int d = 0; d < 3; d++) {
            e[d] = (towards[d] - cosine * a[d]) / sine;
            middle[d] = tetrapod_length * a[d];
        }
        silt_cross(a, e, g);
        for (int i = 0; i < FORM_LEG; i++) {
            const double angle = 2 * M_PI * i / FORM_LEG;
            // the nearest other leg: at the angles 0, 120, 240 degrees; s goes along the axis, r outwards:
            // s = s cosine + r cos(angle) sine where both legs are as far
            const double off = angle - 2 * M_PI / 3 * floor(angle / (2 * M_PI / 3) + 0.5);
            const double slope = cos(off) * sine / (1 - cosine), s = slope * root / (1 + slope * taper);
            for (int d = 0; d < 3; d++) {
                const double out = cos(angle) * e[d] + sin(angle) * g[d];
                rim[i][d] = middle[d] + tip * out;
                cut[i][d] = s * a[d] + (root - taper * s) * out;
            }
        }
        for (int i = 0; i < FORM_LEG; i++) {
            const int j = (i + 1) % FORM_LEG;
            form_triangle(f, middle, rim[i], rim[j]);
            form_quad(f, cut[i], cut[j], rim[j], rim[i]);
        }
    }
}

// ---------------------------------------------------------------- temple

// what of the grid is stone: slab, eight columns, entablature, roof
static bool temple_full(int i, int j, int k) {
    static const bool column[8] = {false, true, false, true, true, false, true, false};
    if (i < 0 || i > 7 || j < 0 || j > 7 || k < 0 || k > 3)
        return false;
    const bool inner = (i == 3 || i == 4) && (j == 3 || j == 4);
    return k != 1 || (column[i] && column[j] && !inner);
}

// width 1, of any depth, 0.75 high: slab, columns 0.12 wide, entablature, roof with its ridge along y
static void form_temple(form *f, double depth) {
    static const double across[9] = {-0.5, -0.46, -0.34, -0.06, 0, 0.06, 0.34, 0.46, 0.5}, up[5] = {0, 0.06, 0.46, 0.56, 0.75};
    for (int k = 0; k < 4; k++)
        for (int j = 0; j < 8; j++)
            for (int i = 0; i < 8; i++) {
                double x[8][3];
                if (!temple_full(i, j, k))
                    continue;
                for (int c = 0; c < 8; c++) {
                    const int p = i + (c & 1), q = j + (c >> 1 & 1), r = k + (c >> 2);
                    // columns keep their width, what is between them does not
                    const double end = across[q] < 0 ? -1 : across[q] > 0 ? 1 : 0, from_end = 0.5 - fabs(across[q]);
                    x[c][0] = across[p];
                    x[c][1] = fabs(across[q]) < 0.1 ? across[q] : end * (depth / 2 - from_end);
                    x[c][2] = r == 4 ? up[3] + (up[4] - up[3]) * (1 - 2 * fabs(across[p])) : up[r];
                }
                static const int side[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
                for (int s = 0; s < 6; s++) {
                    const int step = s % 2 ? 1 : -1;
                    if (!temple_full(i + (s / 2 == 0) * step, j + (s / 2 == 1) * step, k + (s / 2 == 2) * step))
                        form_quad(f, x[side[s][0]], x[side[s][1]], x[side[s][2]], x[side[s][3]]);
                }
            }
}

// ---------------------------------------------------------------- all

static silt_status form_read(form *f, const silt_body_def *body, silt_error *err) {
    silt_surface surface;
    SILT_TRY(silt_surface_read(body->file, 1, false, &surface, err));
    for (int t = 0; t < surface.n_triangle; t++)
        form_triangle(f, surface.point[surface.triangle[t][0]], surface.point[surface.triangle[t][1]], surface.point[surface.triangle[t][2]]);
    silt_surface_clear(&surface);
    double lo = HUGE_VAL, hi = -HUGE_VAL;
    for (int i = 0; i < 3 * f->n; i++) {
        lo = silt_min(lo, f->corner[i][0]);
        hi = silt_max(hi, f->corner[i][0]);
    }
    for (int i = 0; i < 3 * f->n && body->scale > 0; i++)
        for (int d = 0; d < 3; d++)
            f->corner[i][d] *= body->scale / (hi - lo);
    return SILT_OK;
}

static void form_scale(form *f, double x, double y, double z) {
    for (int i = 0; i < 3 * f->n; i++) {
        f->corner[i][0] *= x;
        f->corner[i][1] *= y;
        f->corner[i][2] *= z;
    }
}

// triangles of the shape. @param exact  out, m3, its volume where the triangles stand for something round, else 0
static silt_status form_make(form *f, const silt_body_def *body, double *exact, silt_error *err) {
    const double w = body->scale, h = body->height > 0 ? body->height : w, depth = body->depth > 0 ? body->depth : w;
    *exact = 0;
    switch (body->shape) {
    case SHAPE_BOX:
    case SHAPE_POLYGON:
    case SHAPE_WEDGE: {
        silt_outline outline;
        SILT_TRY(silt_outline_create(&outline, body, err));
        double lo = HUGE_VAL, hi = -HUGE_VAL;
        for (int i = 0; i < outline.n_point; i++) {
            lo = silt_min(lo, outline.point[2 * i]);
            hi = silt_max(hi, outline.point[2 * i]);
        }
        form_prism(f, outline.n_point, outline.point, body->depth > 0 ? body->depth : hi - lo);
        silt_outline_clear(&outline);
        return SILT_OK;
    }
    case SHAPE_SPHERE:
        form_sphere(f);
        form_scale(f, w / 2, w / 2, w / 2);
        *exact = M_PI / 6 * w * w * w;
        return SILT_OK;
    case SHAPE_CYLINDER: {
        const double r = round_radius(w / 2, FORM_ROUND);
        form_revolve(f, 4, (const double[4][2]){{0, -h / 2}, {r, -h / 2}, {r, h / 2}, {0, h / 2}});
        return SILT_OK;
    }
    case SHAPE_CAPSULE: {
        const double thick = body->height > 0 ? body->height : w / 2;
        if (!(thick < w))
            return silt_fail(err, SILT_INPUT, "body %s: height: found %g m, allowed less than its scale of %g m: a capsule is longer than thick", body->name, thick, w);
        form_capsule(f, w, thick);
        *exact = M_PI / 4 * thick * thick * (w - thick) + M_PI / 6 * thick * thick * thick;
        return SILT_OK;
    }
    case SHAPE_TETRAPOD:
        form_tetrapod(f);
        form_scale(f, w, w, w);
        return SILT_OK;
    case SHAPE_TEMPLE:
        form_temple(f, depth / w);
        form_scale(f, w, w, w);
        return SILT_OK;
    case SHAPE_SURFACE:
        return form_read(f, body, err);
    default:
        return silt_fail(err, SILT_INPUT, "body %s: shape: found disc, allowed in 3-D: sphere", body->name);
    }
}

silt_status silt_form_create(silt_solid *s, const silt_body_def *body, silt_error *err) {
    const char *name = body->name ? body->name : "?";
    char what[128];
    form f = {0};
    double exact;
    *s = (silt_solid){0};
    snprintf(what, sizeof what, "body %s%s%s", name, body->file ? ": " : "", body->file ? strrchr(body->file, '/') ? strrchr(body->file, '/') + 1 : body->file : "");
    silt_status status = form_make(&f, body, &exact, err);
    if (status == SILT_OK)
        status = form_finish(&f, s, what, err);
    else
        free(f.corner);
    if (status != SILT_OK) {
        silt_solid_clear(s);
        return status;
    }
    const double scale = exact > 0 ? cbrt(exact / s->volume) : 1, centroid[3] = {s->centroid[0], s->centroid[1], s->centroid[2]};
    for (int i = 0; i < s->n_point; i++)
        for (int d = 0; d < 3; d++)
            s->point[i][d] = scale * (s->point[i][d] - centroid[d]);
    silt_solid_refit(s);
    return SILT_OK;
}

double silt_form_thickness(const silt_solid *s) {
    // points that lie on no diagonal of what is opposite
    static const double weight[3] = {0.5, 0.3, 0.2};
    double thickness = HUGE_VAL;
    for (int f = 0; f < s->n_face; f++)
        for (int turn = 0; turn < 3; turn++) {
            double x[3] = {0}, inwards[3];
            int hit = -1;
            for (int d = 0; d < 3; d++) {
                for (int k = 0; k < 3; k++)
                    x[d] += weight[(k + turn) % 3] * s->point[s->face[f][k]][d];
                inwards[d] = -s->normal[f][d];
            }
            const double way = silt_solid_ray(s, x, inwards, 1e-9 * s->radius, &hit);
            if (hit >= 0 && wall_dot(s->normal[hit], inwards) > 0.7)
                thickness = silt_min(thickness, way);
        }
    return thickness;
}

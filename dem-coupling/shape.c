// shape.c: outlines of rigid objects, their integrals, and the clumps of spheres inside them
#include "shape.h"

static const int disc_points = 128;
static const double corner_turn = 0.35; // rad: an outline that turns by more at a point has a corner there
static const double clump_stand_out =
    2e-3;                               // of its radius: how far a sphere may, so that a polygon can stand for a curve
static const double clump_floor = 0.25; // smallest sphere in a corner as a share of the radius

// ---------------------------------------------------------------- polygon integrals

// area, centroid and second moment about the origin
static void shape_integrate(int n, const double *p, double *area, double centroid[2], double *moment) {
    double a = 0.0, cx = 0.0, cy = 0.0, m = 0.0;
    for (int i = 0; i < n; i++) {
        const double *s = p + 2 * i, *t = p + 2 * ((i + 1) % n);
        double cross = s[0] * t[1] - s[1] * t[0];
        a += cross / 2.0;
        cx += cross * (s[0] + t[0]) / 6.0;
        cy += cross * (s[1] + t[1]) / 6.0;
        m += cross * (s[0] * s[0] + s[0] * t[0] + t[0] * t[0] + s[1] * s[1] + s[1] * t[1] + t[1] * t[1]) / 12.0;
    }
    *area = a;
    centroid[0] = a != 0.0 ? cx / a : 0.0;
    centroid[1] = a != 0.0 ? cy / a : 0.0;
    *moment = m;
}

static double shape_side(const double *a, const double *b, const double *c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// true when two edges without a common point cross
static bool shape_crosses(int n, const double *p) {
    for (int i = 0; i < n; i++)
        for (int j = i + 2; j < n; j++) {
            if (i == 0 && j == n - 1)
                continue;
            const double *a = p + 2 * i, *b = p + 2 * ((i + 1) % n), *c = p + 2 * j, *d = p + 2 * ((j + 1) % n);
            if (shape_side(a, b, c) * shape_side(a, b, d) < 0.0 && shape_side(c, d, a) * shape_side(c, d, b) < 0.0)
                return true;
        }
    return false;
}

// ---------------------------------------------------------------- outlines

// pediment on an entablature on three columns, width 1, height 0.75; columns 0.12 wide, 0.32 apart
static const double temple_point[][2] = {
    {-0.50, 0.00}, {-0.38, 0.00}, {-0.38, 0.40}, {-0.06, 0.40}, {-0.06, 0.00}, {0.06, 0.00},  {0.06, 0.40},
    {0.38, 0.40},  {0.38, 0.00},  {0.50, 0.00},  {0.50, 0.52},  {0.00, 0.75},  {-0.50, 0.52},
};

silt_status silt_outline_create(silt_outline *shape, const silt_body_def *body, silt_error *err) {
    const char *name = body->name != NULL ? body->name : "?";
    *shape = (silt_outline){0};
    if (body->shape != SHAPE_POLYGON && !(body->scale > 0.0))
        return silt_fail(err, SILT_INPUT, "body %s: scale: found %g, must be a width above 0 m", name, body->scale);

    // points about any origin
    double w = body->scale;
    switch (body->shape) {
    case SHAPE_BOX: {
        double h = body->height > 0.0 ? body->height : w;
        const double box[8] = {-w / 2, -h / 2, w / 2, -h / 2, w / 2, h / 2, -w / 2, h / 2};
        shape->n_point = 4;
        shape->point = silt_alloc(8, sizeof(double));
        memcpy(shape->point, box, sizeof box);
        break;
    }
    case SHAPE_DISC:
        shape->n_point = disc_points;
        shape->point = silt_alloc(2 * (size_t)disc_points, sizeof(double));
        for (int i = 0; i < disc_points; i++) {
            // a polygon of the circle's area
            const double r = w / 2.0 * sqrt(2.0 * M_PI / disc_points / sin(2.0 * M_PI / disc_points));
            shape->point[2 * i] = r * cos(2.0 * M_PI * i / disc_points);
            shape->point[2 * i + 1] = r * sin(2.0 * M_PI * i / disc_points);
        }
        break;
    case SHAPE_WEDGE: {
        double h = body->height > 0.0 ? body->height : w;
        const double wedge[6] = {0.0, 0.0, w / 2, h, -w / 2, h};
        shape->n_point = 3;
        shape->point = silt_alloc(6, sizeof(double));
        memcpy(shape->point, wedge, sizeof wedge);
        break;
    }
    case SHAPE_CAPSULE: {
        double r = (body->height > 0.0 ? body->height : w / 2) / 2;
        if (!(2 * r < w))
            return silt_fail(err, SILT_INPUT, "body %s: height: found %g m, allowed less than its scale of %g m: a capsule is longer than thick",
                             name, 2 * r, w);
        shape->n_point = disc_points + 2;
        shape->point = silt_alloc(2 * (size_t)shape->n_point, sizeof(double));
        for (int i = 0; i < shape->n_point; i++) {
            const int half = i > disc_points / 2;
            const double angle = 2.0 * M_PI * (i - half) / disc_points - M_PI / 2;
            shape->point[2 * i] = (half ? -1 : 1) * (w / 2 - r) + r * cos(angle);
            shape->point[2 * i + 1] = r * sin(angle);
        }
        break;
    }
    case SHAPE_TEMPLE:
        shape->n_point = (int)(sizeof temple_point / sizeof *temple_point);
        shape->point = silt_alloc(2 * (size_t)shape->n_point, sizeof(double));
        for (int i = 0; i < 2 * shape->n_point; i++)
            shape->point[i] = w * temple_point[i / 2][i % 2];
        break;
    case SHAPE_POLYGON: {
        if (body->n_point < 3)
            return silt_fail(err, SILT_INPUT, "body %s: points: found %d, a polygon has at least 3", name,
                             body->n_point);
        double lo = body->point[0], hi = body->point[0];
        for (int i = 1; i < body->n_point; i++) {
            lo = silt_min(lo, body->point[3 * i]);
            hi = silt_max(hi, body->point[3 * i]);
        }
        if (!(hi > lo))
            return silt_fail(err, SILT_INPUT, "body %s: points: all have x = %g, a polygon has a width", name, lo);
        double scale = w > 0.0 ? w / (hi - lo) : 1.0;
        shape->n_point = body->n_point;
        shape->point = silt_alloc(2 * (size_t)body->n_point, sizeof(double));
        for (int i = 0; i < body->n_point; i++) {
            shape->point[2 * i] = scale * (body->point[3 * i] - lo);
            shape->point[2 * i + 1] = scale * (body->point[3 * i + 1] - body->point[1]);
        }
        break;
    }
    default:
        return silt_fail(err, SILT_INPUT, "body %s: shape: found one that is of space only, allowed in 2-D: box, disc, polygon, temple, capsule, wedge",
                         name);
    }

    // counter-clockwise, about the centroid
    double centroid[2], moment;
    shape_integrate(shape->n_point, shape->point, &shape->area, centroid, &moment);
    if (shape->area < 0.0) {
        for (int i = 0, j = shape->n_point - 1; i < j; i++, j--)
            for (int k = 0; k < 2; k++) {
                double t = shape->point[2 * i + k];
                shape->point[2 * i + k] = shape->point[2 * j + k];
                shape->point[2 * j + k] = t;
            }
    }
    for (int i = 0; i < shape->n_point; i++) {
        shape->point[2 * i] -= centroid[0];
        shape->point[2 * i + 1] -= centroid[1];
        shape->radius = silt_max(shape->radius, hypot(shape->point[2 * i], shape->point[2 * i + 1]));
    }
    shape_integrate(shape->n_point, shape->point, &shape->area, centroid, &shape->inertia);
    bool crossed = shape_crosses(shape->n_point, shape->point);
    if (crossed || !(shape->area > 1e-9 * silt_square(shape->radius))) {
        silt_outline_clear(shape);
        return silt_fail(err, SILT_INPUT, "body %s: points: the polygon %s, give its corners in order around it", name,
                         crossed ? "crosses itself" : "has no area");
    }
    return SILT_OK;
}

void silt_outline_clear(silt_outline *shape) {
    free(shape->point);
    *shape = (silt_outline){0};
}

// ---------------------------------------------------------------- walking along the outline

static double shape_edge_length(const silt_outline *shape, int i) {
    const double *a = shape->point + 2 * i, *b = shape->point + 2 * ((i + 1) % shape->n_point);
    return hypot(b[0] - a[0], b[1] - a[1]);
}

// true when the outline turns at point i by more than a smooth curve would
static bool shape_corner(const silt_outline *shape, int i) {
    int n = shape->n_point;
    const double *a = shape->point + 2 * ((i + n - 1) % n), *b = shape->point + 2 * i,
                 *c = shape->point + 2 * ((i + 1) % n);
    double cross = (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]);
    double dot = (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]);
    return fabs(atan2(cross, dot)) > corner_turn;
}

/** a piece of the outline between two corners, or all of it when there are none */
typedef struct shape_run {
    int first; // point it starts at
    int n_edge;
    double length;
} shape_run;

// the run that starts at corner `first`; without corners the whole outline
static shape_run shape_run_from(const silt_outline *shape, int first) {
    shape_run run = {first, 0, 0.0};
    do {
        run.length += shape_edge_length(shape, (first + run.n_edge) % shape->n_point);
        run.n_edge++;
    } while (run.n_edge < shape->n_point && !shape_corner(shape, (first + run.n_edge) % shape->n_point));
    return run;
}

// all runs; @return how many, `run` has room for n_point
static int shape_runs(const silt_outline *shape, shape_run *run) {
    int n = 0;
    for (int i = 0; i < shape->n_point; i++)
        if (shape_corner(shape, i))
            run[n++] = shape_run_from(shape, i);
    if (n == 0)
        run[n++] = shape_run_from(shape, 0);
    return n;
}

// point and inward normal at the distance s along a run
static void shape_at(const silt_outline *shape, const shape_run *run, double s, double x[2], double normal[2]) {
    int edge = run->first;
    double length = shape_edge_length(shape, edge);
    for (int k = 1; k < run->n_edge && s > length; k++) {
        s -= length;
        edge = (edge + 1) % shape->n_point;
        length = shape_edge_length(shape, edge);
    }
    const double *a = shape->point + 2 * edge, *b = shape->point + 2 * ((edge + 1) % shape->n_point);
    double t = silt_clamp(s / length, 0.0, 1.0);
    x[0] = a[0] + t * (b[0] - a[0]);
    x[1] = a[1] + t * (b[1] - a[1]);
    normal[0] = -(b[1] - a[1]) / length;
    normal[1] = (b[0] - a[0]) / length;
}

int silt_outline_nodes(const silt_outline *shape, double h, double *point, int capacity) {
    shape_run *run = silt_alloc((size_t)shape->n_point, sizeof *run);
    int n_run = shape_runs(shape, run), n = 0;
    for (int i = 0; i < n_run; i++) {
        // a closed smooth outline needs three points to be one
        int parts = (int)ceil(run[i].length / h - 1e-9);
        parts = parts < 1 ? 1 : parts;
        if (n_run < 3 && parts < 3)
            parts = 3;
        for (int k = 0; k < parts; k++, n++) {
            double x[2], normal[2];
            shape_at(shape, &run[i], run[i].length * k / parts, x, normal);
            if (point != NULL && n < capacity)
                memcpy(point + 2 * n, x, sizeof x);
        }
    }
    // what is round all the way stands a little outside of the outline, so that the area is the same
    bool round = n_run == 1 && point != NULL && n <= capacity;
    for (int i = 0; i < shape->n_point && round; i++)
        round = !shape_corner(shape, i);
    if (round) {
        double area, centroid[2], moment;
        shape_integrate(n, point, &area, centroid, &moment);
        for (int i = 0; i < 2 * n; i++)
            point[i] *= sqrt(shape->area / area);
    }
    free(run);
    return n;
}

// ---------------------------------------------------------------- distances

// nearest point of the outline; @return the distance
static double shape_nearest(const silt_outline *shape, const double x[2], double nearest[2]) {
    double best = HUGE_VAL;
    for (int i = 0; i < shape->n_point; i++) {
        const double *a = shape->point + 2 * i, *b = shape->point + 2 * ((i + 1) % shape->n_point);
        double e[2] = {b[0] - a[0], b[1] - a[1]}, d[2] = {x[0] - a[0], x[1] - a[1]};
        double t = silt_clamp((e[0] * d[0] + e[1] * d[1]) / (e[0] * e[0] + e[1] * e[1]), 0.0, 1.0);
        double q[2] = {a[0] + t * e[0], a[1] + t * e[1]};
        double distance = hypot(x[0] - q[0], x[1] - q[1]);
        if (distance < best) {
            best = distance;
            memcpy(nearest, q, sizeof q);
        }
    }
    return best;
}

double silt_outline_distance(const silt_outline *shape, const double x[2]) {
    double nearest[2];
    double distance = shape_nearest(shape, x, nearest);
    bool inside = false;
    for (int i = 0; i < shape->n_point; i++) {
        const double *a = shape->point + 2 * i, *b = shape->point + 2 * ((i + 1) % shape->n_point);
        if ((a[1] > x[1]) != (b[1] > x[1]) && x[0] < a[0] + (x[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
            inside = !inside;
    }
    return inside ? 0.0 : distance;
}

// ---------------------------------------------------------------- clumps

// largest circle inside that touches the outline at x, at most `radius`: shrunk until its nearest outline point is x
static double clump_ball(const silt_outline *shape, const double x[2], const double normal[2], double radius) {
    for (int k = 0; k < 50; k++) {
        double centre[2] = {x[0] + radius * normal[0], x[1] + radius * normal[1]}, q[2];
        if (shape_nearest(shape, centre, q) >= radius * (1.0 - clump_stand_out))
            break;
        double d[2] = {q[0] - x[0], q[1] - x[1]};
        double depth = d[0] * normal[0] + d[1] * normal[1];
        if (!(depth > 0.0))
            break;
        radius = silt_min(radius, (d[0] * d[0] + d[1] * d[1]) / (2.0 * depth));
    }
    return radius;
}

// the middle of each edge, away from corners, sees how thick the body is there
static double clump_radius(const silt_outline *shape) {
    double lo = HUGE_VAL, hi = -HUGE_VAL, thinnest = HUGE_VAL;
    for (int i = 0; i < shape->n_point; i++) {
        lo = silt_min(lo, shape->point[2 * i]);
        hi = silt_max(hi, shape->point[2 * i]);
    }
    shape_run *run = silt_alloc((size_t)shape->n_point, sizeof *run);
    int n_run = shape_runs(shape, run);
    for (int i = 0; i < n_run; i++) {
        double x[2], normal[2];
        shape_at(shape, &run[i], run[i].length / 2.0, x, normal);
        thinnest = silt_min(thinnest, 2.0 * clump_ball(shape, x, normal, 2.0 * shape->radius));
    }
    free(run);
    return silt_min(0.06 * (hi - lo), thinnest / 4.0);
}

// a sphere unless an equal one is there already
static void clump_add(silt_clump *clump, const double centre[2], double radius, double near) {
    for (int k = 0; k < clump->n_sphere; k++) {
        const double *s = clump->sphere + 3 * k;
        if (hypot(s[0] - centre[0], s[1] - centre[1]) < near * radius && fabs(s[2] - radius) < near * radius)
            return;
    }
    int capacity = 3 * clump->capacity;
    clump->sphere = silt_grow(clump->sphere, &capacity, 3 * (clump->n_sphere + 1), sizeof(double));
    clump->capacity = capacity / 3;
    double *s = clump->sphere + 3 * clump->n_sphere++;
    s[0] = centre[0];
    s[1] = centre[1];
    s[2] = radius;
    clump->largest = silt_max(clump->largest, radius);
    clump->smallest = clump->smallest > 0.0 ? silt_min(clump->smallest, radius) : radius;
}

// the sphere that touches a run at s, if it is large enough; @return its radius or the floor
static double clump_put(silt_clump *clump, const silt_outline *shape, const shape_run *run, double s, double radius,
                        double spacing) {
    double x[2], normal[2], least = clump_floor * radius;
    shape_at(shape, run, s, x, normal);
    double r = clump_ball(shape, x, normal, radius);
    if (r >= least * (1.0 - 1e-6)) {
        double centre[2] = {x[0] + r * normal[0], x[1] + r * normal[1]};
        clump_add(clump, centre, r, spacing / 8.0);
    }
    return silt_max(r, least);
}

void silt_clump_create(silt_clump *clump, const silt_outline *shape, double radius, double spacing) {
    silt_clump_clear(clump);
    if (!(radius > 0.0))
        radius = clump_radius(shape);
    shape_run *run = silt_alloc((size_t)shape->n_point, sizeof *run);
    int n_run = shape_runs(shape, run);
    for (int i = 0; i < n_run; i++) {
        // from both ends to the middle, so that a symmetric body has a symmetric clump
        double half = run[i].length / 2.0, s = 0.0;
        while (s < half) {
            double r = clump_put(clump, shape, &run[i], s, radius, spacing);
            clump_put(clump, shape, &run[i], run[i].length - s, radius, spacing);
            s += spacing * r;
        }
        clump_put(clump, shape, &run[i], half, radius, spacing);
    }
    free(run);
    clump->error = silt_clump_error(clump, shape);
}

void silt_clump_clear(silt_clump *clump) {
    free(clump->sphere);
    *clump = (silt_clump){0};
}

double silt_clump_error(const silt_clump *clump, const silt_outline *shape) {
    double worst = 0.0, step = 0.05 * clump->smallest;
    for (int i = 0; i < shape->n_point; i++) {
        const double *a = shape->point + 2 * i, *b = shape->point + 2 * ((i + 1) % shape->n_point);
        int n = (int)ceil(shape_edge_length(shape, i) / silt_max(step, 1e-12)) + 1;
        n = n > 2000 ? 2000 : n;
        for (int k = 0; k <= n; k++) {
            double x[2] = {a[0] + (b[0] - a[0]) * k / n, a[1] + (b[1] - a[1]) * k / n}, gap = HUGE_VAL;
            for (int m = 0; m < clump->n_sphere; m++) {
                const double *s = clump->sphere + 3 * m;
                gap = silt_min(gap, hypot(x[0] - s[0], x[1] - s[1]) - s[2]);
            }
            worst = silt_max(worst, gap);
        }
    }
    return worst;
}

/** @file scene_bodies.c
 * What must be true of rigid objects: names, sizes, places, none in another. In space only what needs no surface: the rest is
 * seen when the surfaces are made.
 */
#include "scene_keys.h"

enum { BODY_ROUND = 16 }; // corners of half a capsule's end
static const double body_sunk = 1e-3, body_sunk_cell = 0.05; // of its radius and of fluid.size: how far a body may stand in a wall

static double body_height(const silt_body_def *body) {
    return body->shape == SHAPE_TEMPLE ? 0.8 * body->scale
           : body->height > 0          ? body->height
           : body->shape == SHAPE_CAPSULE ? 0.5 * body->scale
                                       : body->scale;
}

// radius of a sphere around it
static double body_reach(const silt_body_def *body) {
    const double depth = body->depth > 0 ? body->depth : body->scale;
    if (body->shape == SHAPE_SPHERE)
        return body->scale / 2;
    double width = body->scale, height = body_height(body);
    for (int i = 0; i < body->n_point; i++)
        for (int k = 0; k < i; k++) {
            width = silt_max(width, fabs(body->point[3 * i] - body->point[3 * k]));
            height = silt_max(height, fabs(body->point[3 * i + 1] - body->point[3 * k + 1]));
        }
    return sqrt(silt_square(width) + silt_square(height) + silt_square(depth)) * (body->shape == SHAPE_POLYGON || body->shape == SHAPE_WEDGE ? 0.7 : 0.5);
}

// a little smaller than the body: touching is allowed
silt_body_shape silt_body_shape_make(const silt_scene *scene, const silt_body_def *body) {
    const double shrink = 1 - 1e-6;
    silt_body_shape shape = {.dim = scene->dimension == 3 ? 3 : 2, .centre = {body->at[0], body->at[1], body->at[2]}};
    if (shape.dim == 3 || body->shape == SHAPE_DISC) {
        shape.radius = shrink * (shape.dim == 3 ? body_reach(body) : body->scale / 2);
        return shape;
    }
    double centre[3] = {0}, scale = 1, width = body->scale, height = body_height(body), round[3 * (2 * BODY_ROUND + 2)];
    const double corner[12] = {-width / 2, -height / 2, 0, width / 2,  -height / 2, 0,
                               width / 2,  height / 2,  0, -width / 2, height / 2,  0};
    const double wedge[9] = {0, -2 * height / 3, 0, width / 2, height / 3, 0, -width / 2, height / 3, 0};
    const double *point = body->shape == SHAPE_WEDGE ? wedge : corner;
    shape.n_point = body->shape == SHAPE_WEDGE ? 3 : 4;
    if (body->shape == SHAPE_CAPSULE) {
        shape.n_point = 2 * BODY_ROUND + 2;
        for (int i = 0; i < shape.n_point; i++) {
            const int left = i > BODY_ROUND;
            const double angle = M_PI * (i - left) / BODY_ROUND - M_PI / 2;
            round[3 * i] = (left ? -1 : 1) * (width - height) / 2 + height / 2 * cos(angle);
            round[3 * i + 1] = height / 2 * sin(angle);
            round[3 * i + 2] = 0;
        }
        point = round;
    }
    if (body->shape == SHAPE_POLYGON) {
        point = body->point;
        shape.n_point = body->n_point;
        silt_polygon_centroid(shape.n_point, point, centre);
        double lo = HUGE_VAL, hi = -HUGE_VAL;
        for (int i = 0; i < shape.n_point; i++) {
            lo = silt_min(lo, point[3 * i]);
            hi = silt_max(hi, point[3 * i]);
        }
        scale = body->scale > 0 ? body->scale / (hi - lo) : 1;
    }
    shape.point = silt_alloc((size_t)shape.n_point, 3 * sizeof *shape.point);
    double turn = body->angle * M_PI / 180, c = cos(turn) * scale * shrink, s = sin(turn) * scale * shrink;
    for (int i = 0; i < shape.n_point; i++) {
        double x = point[3 * i] - centre[0], y = point[3 * i + 1] - centre[1];
        shape.point[3 * i] = body->at[0] + c * x - s * y;
        shape.point[3 * i + 1] = body->at[1] + s * x + c * y;
        shape.radius = silt_max(shape.radius, hypot(c * x - s * y, s * x + c * y));
    }
    return shape;
}

// circles first, they are cheap
static bool bodies_overlap(const silt_body_shape *a, const silt_body_shape *b) {
    if (hypot(a->centre[0] - b->centre[0], a->centre[1] - b->centre[1]) >= a->radius + b->radius)
        return false;
    if (a->n_point == 0 && b->n_point == 0)
        return true;
    if (a->n_point == 0) {
        const silt_body_shape *other = a;
        a = b;
        b = other;
    }
    // a is a polygon now; b lies in it, crosses it, or holds it
    if (b->n_point == 0) {
        bool near = silt_polygon_contains(a->n_point, a->point, b->centre);
        for (int i = 0; i < a->n_point && !near; i++)
            near = silt_segment_distance(a->point + 3 * i, a->point + 3 * ((i + 1) % a->n_point), b->centre) < b->radius;
        return near;
    }
    for (int i = 0; i < a->n_point; i++)
        for (int k = 0; k < b->n_point; k++)
            if (silt_segments_meet(a->point + 3 * i, a->point + 3 * ((i + 1) % a->n_point), b->point + 3 * k,
                                   b->point + 3 * ((k + 1) % b->n_point)))
                return true;
    return silt_polygon_contains(a->n_point, a->point, b->point) ||
           silt_polygon_contains(b->n_point, b->point, a->point);
}

bool silt_body_shape_near(const silt_body_shape *shape, const double *x, double radius) {
    if (shape->dim == 3) {
        const double d[3] = {x[0] - shape->centre[0], x[1] - shape->centre[1], x[2] - shape->centre[2]};
        return silt_length(3, d) < shape->radius + radius;
    }
    const silt_body_shape grain = {.centre = {x[0], x[1]}, .radius = radius};
    return bodies_overlap(shape, &grain);
}

// box around the outline
static void body_bounds(const silt_body_shape *shape, double lo[2], double hi[2]) {
    for (int k = 0; k < 2; k++) {
        lo[k] = shape->n_point ? HUGE_VAL : shape->centre[k] - shape->radius;
        hi[k] = shape->n_point ? -HUGE_VAL : shape->centre[k] + shape->radius;
        for (int i = 0; i < shape->n_point; i++) {
            lo[k] = silt_min(lo[k], shape->point[3 * i + k]);
            hi[k] = silt_max(hi[k], shape->point[3 * i + k]);
        }
    }
}

// ---------------------------------------------------------------- bodies in walls, in the plane

// how far x lies inside of the outline, m; 0: it does not
static double outline_depth(const silt_body_shape *shape, const double *x) {
    double depth = HUGE_VAL;
    if (!silt_polygon_contains(shape->n_point, shape->point, x))
        return 0;
    for (int i = 0; i < shape->n_point; i++)
        depth = silt_min(depth, silt_segment_distance(shape->point + 3 * i, shape->point + 3 * ((i + 1) % shape->n_point), x));
    return depth;
}

static int compare_numbers(const void *a, const void *b) {
    const double p = *(const double *)a, q = *(const double *)b;
    return p < q ? -1 : p > q;
}

// how far the segment a b goes into the body: the middles of the parts into which the outline cuts it, and its ends
static double body_pierced(const silt_body_shape *shape, const double *a, const double *b) {
    if (shape->n_point == 0)
        return silt_max(shape->radius - silt_segment_distance(a, b, shape->centre), 0);
    if (silt_segment_distance(a, b, shape->centre) >= shape->radius)
        return 0;
    double *t = silt_alloc((size_t)shape->n_point + 2, sizeof *t), deepest = 0;
    int n = 0;
    t[n++] = 0;
    t[n++] = 1;
    for (int i = 0; i < shape->n_point; i++) {
        const double *c = shape->point + 3 * i, *d = shape->point + 3 * ((i + 1) % shape->n_point);
        const double u[2] = {b[0] - a[0], b[1] - a[1]}, v[2] = {d[0] - c[0], d[1] - c[1]}, w[2] = {c[0] - a[0], c[1] - a[1]};
        const double across = u[0] * v[1] - u[1] * v[0];
        if (across != 0 && silt_segments_meet(a, b, c, d))
            t[n++] = silt_clamp((w[0] * v[1] - w[1] * v[0]) / across, 0, 1);
    }
    qsort(t, (size_t)n, sizeof *t, compare_numbers);
    for (int k = 0; k < n; k++) {
        const double middle = k + 1 < n ? 0.5 * (t[k] + t[k + 1]) : 1;
        deepest = silt_max(deepest, outline_depth(shape, (double[2]){a[0] + middle * (b[0] - a[0]), a[1] + middle * (b[1] - a[1])}));
    }
    deepest = silt_max(deepest, outline_depth(shape, a));
    free(t);
    return deepest;
}

// walls that move may have begun to elsewhere; what stands in a closed obstacle altogether is not pierced
static void body_in_walls(silt_reader *reader, const silt_scene *scene, const silt_body_shape *shape, int i) {
    const double slack = silt_max(body_sunk * shape->radius, scene->fluid.on ? body_sunk_cell * scene->fluid.size : 0);
    for (int w = 0; w < scene->n_wall; w++) {
        const silt_wall *wall = &scene->wall[w];
        const int n = wall->n_point;
        double depth = 0;
        for (int k = 0; k + 1 < n + wall->closed && wall->motion.n_row == 0; k++)
            depth = silt_max(depth, body_pierced(shape, wall->point + 3 * k, wall->point + 3 * ((k + 1) % n)));
        const bool inside = wall->closed && silt_polygon_area(n, wall->point) < 0 && silt_polygon_contains(n, wall->point, shape->centre);
        if (depth > slack || inside)
            silt_complain(reader, silt_tree_find(reader->root, "bodies.%d.at", i),
                          inside ? "key 'bodies.%d.at': found body '%s' inside of the obstacle walls.%d, allowed bodies beside the walls"
                                 : "key 'bodies.%d.at': found body '%s' set into walls.%d by %.3g m, allowed bodies that stand in a wall by no more than %.3g m",
                          i, scene->body[i].name ? scene->body[i].name : "?", w, depth, slack);
    }
}

// ---------------------------------------------------------------- all that is asked

// the reader let capitals through, for gauges
static bool body_name(const char *name) {
    for (const char *c = name; *c; c++)
        if (*c >= 'A' && *c <= 'Z')
            return false;
    return true;
}

typedef struct body_span {
    double left;
    int index;
} body_span;

static int body_span_order(const void *a, const void *b) {
    const body_span *p = a, *q = b;
    return p->left != q->left ? (p->left < q->left ? -1 : 1) : p->index - q->index;
}

// a shape of this dimension, and an axis to turn about
static void body_fits(silt_reader *reader, const silt_scene *scene, int i, const silt_tree *node) {
    const silt_shape shape = scene->body[i].shape;
    const double *axis = scene->body[i].axis;
    const bool space = shape == SHAPE_SPHERE || shape == SHAPE_CYLINDER || shape == SHAPE_TETRAPOD || shape == SHAPE_SURFACE;
    const silt_tree *word = silt_tree_item(node, "shape");
    if (!word)
        return;
    if (scene->dimension != 3 && space)
        silt_complain(reader, word, "key 'bodies.%d.shape': found '%s', allowed in two dimensions: box, disc, polygon, temple, capsule, wedge", i,
                      word->text ? word->text : "");
    if (scene->dimension == 3 && shape == SHAPE_DISC)
        silt_complain(reader, word, "key 'bodies.%d.shape': found 'disc', allowed in three dimensions: sphere", i);
    if (scene->dimension == 3 && silt_tree_item(node, "axis") && !(silt_length(3, axis) > 0))
        silt_complain(reader, silt_tree_item(node, "axis"), "key 'bodies.%d.axis': found no direction, allowed one that is not zero", i);
}

// names, sizes, places; then pairs that overlap
void silt_scene_check_bodies(silt_reader *reader, const silt_scene *scene) {
    int n = scene->n_body, n_span = 0;
    const int dim = scene->dimension == 3 ? 3 : 2;
    silt_body_shape *shape = silt_alloc((size_t)n, sizeof *shape);
    body_span *span = silt_alloc((size_t)n, sizeof *span);
    for (int i = 0; i < n; i++) {
        const silt_body_def *body = &scene->body[i];
        const silt_tree *node = silt_tree_find(reader->root, "bodies.%d", i);
        if (body->name && !body_name(body->name))
            silt_complain(reader, silt_tree_item(node, "name"),
                          "key 'bodies.%d.name': found '%s', allowed a name of small "
                          "letters, digits and underscores that begins with a letter",
                          i, body->name);
        const bool own = body->shape == SHAPE_POLYGON || body->shape == SHAPE_SURFACE; // has a size of its own
        bool sized = body->scale > 0 || (body->shape == SHAPE_POLYGON && body->n_point) || body->file;
        body_fits(reader, scene, i, node);
        if (body->shape && !own && body->scale == 0) {
            const silt_tree *scale = silt_tree_item(node, "scale");
            silt_complain(reader, scale ? scale : node, "key 'bodies.%d.scale': found %s, allowed a number in m, > 0",
                          i, scale ? "no usable width" : "nothing in this block");
        }
        // only bodies that are whole so far have a place
        if (!body->shape || !sized || !silt_tree_item(node, "at") || (body->shape == SHAPE_POLYGON && !body->n_point))
            continue;
        shape[i] = silt_body_shape_make(scene, body);
        double lo[2], hi[2];
        body_bounds(&shape[i], lo, hi);
        silt_scene_check_within(reader, scene, silt_tree_item(node, "at"), dim == 3 ? body->at : lo, dim == 3 ? body->at : hi,
                                1e-3 * shape[i].radius, i);
        if (dim == 3)
            continue;
        body_in_walls(reader, scene, &shape[i], i);
        span[n_span++] = (body_span){shape[i].centre[0] - shape[i].radius, i};
    }
    // overlapping pairs, found along x
    qsort(span, (size_t)n_span, sizeof *span, body_span_order);
    for (int p = 0; p < n_span; p++) {
        const silt_body_shape *a = &shape[span[p].index];
        for (int q = p + 1; q < n_span && span[q].left < a->centre[0] + a->radius; q++) {
            if (reader->n_complaint > SCENE_COMPLAINTS || !bodies_overlap(a, &shape[span[q].index]))
                continue;
            int late = span[p].index > span[q].index ? span[p].index : span[q].index;
            int early = span[p].index + span[q].index - late;
            silt_complain(
                reader, silt_tree_find(reader->root, "bodies.%d.at", late),
                "key 'bodies.%d.at': found the body overlapping body '%s', allowed bodies apart from each other", late,
                scene->body[early].name ? scene->body[early].name : "?");
        }
    }
    for (int i = 0; i < n; i++)
        free(shape[i].point);
    free(shape);
    free(span);
}


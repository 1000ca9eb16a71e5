// clump.c: spheres along the inside of a surface in space, tangent to it: large ones on faces, small ones along edges
#include "form.h"

#include "wall.h"

static const double clump_stand_out = 2e-3; // of its radius: how far a sphere may, so that triangles can stand for what is round
static const double clump_spacing[] = {0.2, 0.26, 0.34, 0.44, 0.57, 0.74, 1.0}; // between centres, times the radius
enum { CLUMP_SPACINGS = sizeof clump_spacing / sizeof *clump_spacing, CLUMP_MOST = 800, CLUMP_TRIES = 4 };

/** a sphere that fits under a point of the surface */
typedef struct clump_ball {
    double centre[3], radius;
    int point;
} clump_ball;

static int compare_balls(const void *a, const void *b) {
    const clump_ball *p = a, *q = b;
    return p->radius != q->radius ? (p->radius > q->radius ? -1 : 1) : p->point - q->point;
}

// largest sphere inside that touches the surface at x, at most `radius`: shrunk until the nearest point of the surface is x
static double ball_radius(const silt_solid *s, const double x[3], const double inwards[3], double radius) {
    for (int k = 0; k < 50; k++) {
        double centre[3], on[3], d[3];
        for (int c = 0; c < 3; c++)
            centre[c] = x[c] + radius * inwards[c];
        if (silt_solid_nearest(s, centre, radius * (1 - clump_stand_out), NULL, on, NULL) == HUGE_VAL)
            break;
        for (int c = 0; c < 3; c++)
            d[c] = on[c] - x[c];
        const double depth = wall_dot(d, inwards);
        if (!(depth > 0))
            break;
        radius = silt_min(radius, wall_dot(d, d) / (2 * depth));
    }
    return radius;
}

// a sphere under each point of `skin`, a fine mesh of the surface, and under each of its faces; @return how many, the largest first
static int clump_balls(const silt_solid *s, const silt_solid *skin, double largest, double least, clump_ball *ball) {
    int n = 0;
    for (int i = 0; i < skin->n_point + skin->n_face; i++) {
        double x[3] = {0}, inwards[3];
        const int f = i - skin->n_point;
        for (int d = 0; d < 3; d++) {
            if (f < 0)
                x[d] = skin->point[i][d];
            for (int k = 0; k < 3 && f >= 0; k++)
                x[d] += skin->point[skin->face[f][k]][d] / 3;
            inwards[d] = f < 0 ? -skin->corner[i][d] : -skin->normal[f][d];
        }
        const double length = silt_length(3, inwards);
        if (!(length > 0)) // a folded skin has no inside there
            continue;
        for (int d = 0; d < 3; d++)
            inwards[d] /= length;
        const double radius = ball_radius(s, x, inwards, largest);
        if (radius < least)
            continue;
        ball[n] = (clump_ball){.radius = radius, .point = i};
        for (int d = 0; d < 3; d++)
            ball[n].centre[d] = x[d] + radius * inwards[d];
        n++;
    }
    qsort(ball, (size_t)n, sizeof *ball, compare_balls);
    return n;
}

static void clump_add(silt_clump *clump, const double centre[3], double radius) {
    int capacity = 4 * clump->capacity;
    clump->sphere = silt_grow(clump->sphere, &capacity, 4 * (clump->n_sphere + 1), sizeof(double));
    clump->capacity = capacity / 4;
    double *s = clump->sphere + 4 * clump->n_sphere++;
    memcpy(s, centre, 3 * sizeof *s);
    s[3] = radius;
    clump->largest = silt_max(clump->largest, radius);
    clump->smallest = clump->smallest > 0 ? silt_min(clump->smallest, radius) : radius;
}

// those that have no other nearer than the spacing
static void clump_choose(silt_clump *clump, int n, const clump_ball *ball, double spacing, int most) {
    silt_clump_clear(clump);
    for (int i = 0; i < n && clump->n_sphere <= most; i++) {
        bool near = false;
        for (int k = clump->n_sphere - 1; k >= 0 && !near; k--) {
            const double *s = clump->sphere + 4 * k, d[3] = {s[0] - ball[i].centre[0], s[1] - ball[i].centre[1], s[2] - ball[i].centre[2]};
            near = silt_length(3, d) < spacing * ball[i].radius;
        }
        if (!near)
            clump_add(clump, ball[i].centre, ball[i].radius);
    }
}

static double clump_gap(const silt_clump *clump, const silt_solid *skin) {
    double worst = 0;
    for (int i = 0; i < skin->n_point; i++) {
        double gap = HUGE_VAL;
        for (int k = 0; k < clump->n_sphere; k++) {
            const double *s = clump->sphere + 4 * k, d[3] = {s[0] - skin->point[i][0], s[1] - skin->point[i][1], s[2] - skin->point[i][2]};
            gap = silt_min(gap, silt_length(3, d) - s[3]);
        }
        worst = silt_max(worst, gap);
    }
    return worst;
}

double silt_form_clump_error(const silt_clump *clump, const silt_solid *solid) {
    silt_solid skin;
    if (silt_solid_mesh(solid, silt_clamp(0.9 * clump->smallest, solid->radius / 20, solid->radius / 15), "clump", &skin, NULL) != SILT_OK)
        return HUGE_VAL;
    const double error = clump_gap(clump, &skin);
    silt_solid_clear(&skin);
    return error;
}

// one sphere; LIGGGHTS wants two in a clump: the other is deep inside and touches nothing
static void clump_single(silt_clump *clump, const silt_solid *solid) {
    const double middle[3] = {0}, radius = cbrt(3 * solid->volume / (4 * M_PI));
    silt_clump_clear(clump);
    clump_add(clump, middle, radius);
    clump_add(clump, middle, radius / 2);
    clump->smallest = radius;
    clump->error = radius - silt_solid_nearest(solid, middle, HUGE_VAL, NULL, (double[3]){0}, NULL);
}

void silt_form_clump(silt_clump *clump, const silt_solid *solid, double error) {
    if (silt_solid_nearest(solid, (double[3]){0}, HUGE_VAL, NULL, (double[3]){0}, NULL) > 0.98 * solid->radius) {
        clump_single(clump, solid);
        return;
    }
    const double thickness = silt_min(silt_form_thickness(solid), 2 * solid->radius), asked = error > 0 ? error : thickness / 15;
    silt_clump best = {.error = HUGE_VAL};
    for (int try = 0; try < CLUMP_TRIES && best.error > asked; try++) {
        // in a corner of a cube a sphere stays 0.73 of its radius away
        const double least = 0.8 * asked * pow(0.6, try), size = silt_max(least, solid->radius / 40);
        silt_solid skin;
        if (silt_solid_mesh(solid, size, "clump", &skin, NULL) != SILT_OK)
            break;
        clump_ball *ball = silt_alloc((size_t)(skin.n_point + skin.n_face) + 1, sizeof *ball);
        const int n = clump_balls(solid, &skin, thickness / 3, least, ball);
        // the closest spacing that the number allows; where that misses what is asked for, more of them
        for (int k = 0; k < CLUMP_SPACINGS; k++) {
            silt_clump now = {0};
            clump_choose(&now, n, ball, clump_spacing[k], 10 * CLUMP_MOST);
            now.error = now.n_sphere ? clump_gap(&now, &skin) : HUGE_VAL;
            const bool few = now.n_sphere <= CLUMP_MOST, better = now.error <= asked || now.error < best.error;
            if (!better || (best.error <= asked && best.n_sphere <= CLUMP_MOST)) {
                silt_clump_clear(&now);
                continue;
            }
            silt_clump_clear(&best);
            best = now;
            if (few && now.error <= asked)
                break;
        }
        free(ball);
        silt_solid_clear(&skin);
    }
    silt_clump_clear(clump);
    *clump = best;
}

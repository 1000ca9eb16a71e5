// deposition among other grains: one whose centre comes to lie in the bed is wedged between the spheres of the surface and flung out,
// so it becomes bed too, or the deposit waits

#include "bed_mesh.h"

#define OTHER_ROOM 0.5 // of the radius: how near new cells may come to the centre of a grain

static int other_compare(const void *a, const void *b) {
    const silt_bed_other *p = a, *q = b;
    return (p->x[0] > q->x[0]) - (p->x[0] < q->x[0]);
}

void silt_bed_others_take(silt_bed_others *others, const silt_grain_state *grains, const uint8_t *at_rest) {
    const size_t n = (size_t)grains->count;
    silt_bed_others_clear(others);
    others->count = grains->count;
    others->grain = silt_alloc(n + 1, sizeof *others->grain);
    for (size_t k = 0; k < n; k++) {
        silt_bed_other *to = &others->grain[k];
        memcpy(to->x, grains->x + 3 * k, sizeof to->x);
        to->radius = grains->radius[k];
        to->mass = grains->mass[k];
        to->grain = (int)k;
        to->at_rest = at_rest[k] != 0;
        others->largest = silt_max(others->largest, to->radius);
    }
    qsort(others->grain, n, sizeof *others->grain, other_compare);
}

void silt_bed_others_clear(silt_bed_others *others) {
    free(others->grain);
    *others = (silt_bed_others){0};
}

static int other_first(const silt_bed_others *others, double x) {
    int lo = 0, hi = others->count;
    while (lo < hi) {
        const int middle = (lo + hi) / 2;
        if (others->grain[middle].x[0] < x)
            lo = middle + 1;
        else
            hi = middle;
    }
    return lo;
}

void silt_bed_others_mark(silt_bed_others *others, const double *x, bool bed) {
    for (int k = other_first(others, x[0]); k < others->count && others->grain[k].x[0] <= x[0]; k++)
        if (memcmp(others->grain[k].x, x, sizeof others->grain[k].x) == 0)
            others->grain[k].bed = bed;
}

// distance of a place from a cell, 0 inside
static double cell_distance(int dim, const double *const corner[4], const double *x) {
    bool inside = true;
    double distance = HUGE_VAL;
    for (int a = 0; a <= dim; a++) {
        const double *p = corner[(a + 1) % (dim + 1)], *q = corner[(a + 2) % (dim + 1)], *r = corner[(a + 3) % (dim + 1)];
        const double own = dim == 3 ? bed_volume6(p, q, r, corner[a]) : bed_cross(p, q, corner[a]);
        const double other = dim == 3 ? bed_volume6(p, q, r, x) : bed_cross(p, q, x);
        inside &= own * other >= 0;
        distance = silt_min(distance, dim == 3 ? silt_bed_triangle_distance(p, q, r, x) : bed_segment_distance(p, q, x));
    }
    return inside ? 0 : distance;
}

static bool taking_has(const bed_taking *taking, int k) {
    for (int q = 0; q < taking->n; q++)
        if (taking->other[q] == k)
            return true;
    return false;
}

bool silt_bed_others_in(int dim, const double *const corner[4], const silt_bed_others *others, bed_taking *taking) {
    if (!others)
        return true;
    double lo = HUGE_VAL, hi = -HUGE_VAL;
    for (int a = 0; a <= dim; a++) {
        lo = silt_min(lo, corner[a][0]);
        hi = silt_max(hi, corner[a][0]);
    }
    const double reach = OTHER_ROOM * others->largest;
    for (int k = other_first(others, lo - reach); k < others->count && others->grain[k].x[0] <= hi + reach; k++) {
        const silt_bed_other *other = &others->grain[k];
        if (other->bed || cell_distance(dim, corner, other->x) >= OTHER_ROOM * other->radius || taking_has(taking, k))
            continue;
        if (!other->at_rest || taking->n == DEPOSIT_OTHERS)
            return false;
        taking->other[taking->n++] = k;
        taking->mass += other->mass;
    }
    return true;
}

void silt_bed_others_tell(const silt_bed_others *others, const bed_taking *taking, double mass, silt_deposit *deposit) {
    deposit->mass = mass + taking->mass;
    for (int k = 0; k < taking->n; k++)
        deposit->other[deposit->n_other++] = others->grain[taking->other[k]].grain;
}

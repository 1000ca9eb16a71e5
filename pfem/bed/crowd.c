// spheres by place: a hash of bins, each with its spheres in a list
#include "crowd.h"

static int64_t bin_at(const silt_crowd *crowd, double x) { return (int64_t)floor(silt_clamp(x / crowd->bin, -1e15, 1e15)); }

static int bin_head(const silt_crowd *crowd, int64_t i, int64_t j, int64_t k) {
    uint64_t mixed = (uint64_t)i * 0x9e3779b97f4a7c15u ^ (uint64_t)j * 0xc2b2ae3d27d4eb4fu ^ (uint64_t)k * 0x165667b19e3779f9u;
    mixed ^= mixed >> 29;
    return (int)(mixed & (uint64_t)(crowd->n_head - 1));
}

static void bin_enter(silt_crowd *crowd, int k) {
    struct silt_crowd_sphere *s = &crowd->sphere[k];
    int64_t at[3];
    for (int d = 0; d < 3; d++) {
        at[d] = bin_at(crowd, s->x[d]);
        crowd->lo[d] = k == 0 || at[d] < crowd->lo[d] ? at[d] : crowd->lo[d];
        crowd->hi[d] = k == 0 || at[d] > crowd->hi[d] ? at[d] : crowd->hi[d];
    }
    int *head = &crowd->head[bin_head(crowd, at[0], at[1], at[2])];
    s->next = *head;
    *head = k;
}

void silt_crowd_start(silt_crowd *crowd, double bin) {
    crowd->count = crowd->n_head = 0;
    crowd->bin = bin;
    crowd->largest = 0;
}

void silt_crowd_add(silt_crowd *crowd, const double x[3], double radius) {
    SILT_RESERVE(crowd->sphere, crowd->capacity, crowd->count + 1);
    crowd->sphere[crowd->count] = (struct silt_crowd_sphere){{x[0], x[1], x[2]}, radius, -1};
    crowd->largest = silt_max(crowd->largest, radius);
    if (++crowd->count <= crowd->n_head) {
        bin_enter(crowd, crowd->count - 1);
        return;
    }
    crowd->n_head = crowd->n_head > 0 ? 2 * crowd->n_head : 64;
    SILT_RESERVE(crowd->head, crowd->head_capacity, crowd->n_head);
    for (int b = 0; b < crowd->n_head; b++)
        crowd->head[b] = -1;
    for (int k = 0; k < crowd->count; k++)
        bin_enter(crowd, k);
}

static double sphere_gap(const struct silt_crowd_sphere *s, const double x[3]) {
    return hypot(hypot(x[0] - s->x[0], x[1] - s->x[1]), x[2] - s->x[2]) - s->radius;
}

double silt_crowd_gap(const silt_crowd *crowd, const double x[3], double far) {
    const double reach = far + crowd->largest;
    int64_t lo[3], hi[3];
    double gap = far, bins = 1;
    if (crowd->count == 0 || !(reach > 0))
        return gap;
    for (int d = 0; d < 3; d++) {
        lo[d] = (int64_t)silt_max((double)bin_at(crowd, x[d] - reach), (double)crowd->lo[d]);
        hi[d] = (int64_t)silt_min((double)bin_at(crowd, x[d] + reach), (double)crowd->hi[d]);
        bins *= (double)(hi[d] - lo[d] + 1);
    }
    if (bins > crowd->count) {
        for (int s = 0; s < crowd->count; s++)
            gap = silt_min(gap, sphere_gap(&crowd->sphere[s], x));
        return gap;
    }
    for (int64_t k = lo[2]; k <= hi[2]; k++)
        for (int64_t j = lo[1]; j <= hi[1]; j++)
            for (int64_t i = lo[0]; i <= hi[0]; i++)
                for (int s = crowd->head[bin_head(crowd, i, j, k)]; s >= 0; s = crowd->sphere[s].next)
                    gap = silt_min(gap, sphere_gap(&crowd->sphere[s], x));
    return gap;
}

void silt_crowd_clear(silt_crowd *crowd) {
    free(crowd->sphere);
    free(crowd->head);
    *crowd = (silt_crowd){0};
}

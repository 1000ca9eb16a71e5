// gauges of grains: the heap that they form, its foremost point, its height and slope

#include "output.h"

// grains whose surfaces are less than this apart, times the sum of their radii, hang together
#define HEAP_GAP 0.1
// columns of a slope are as wide as the mean grain times this
#define HEAP_COLUMN 1.5

typedef struct heap_bins {
    double lo[3], width;
    int n[3];
    int *first, *next; // owned
} heap_bins;

static void heap_bins_create(heap_bins *bins, const silt_grain_state *grains, int dim) {
    double hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, largest = 0, count = 1;
    *bins = (heap_bins){.lo = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, .n = {1, 1, 1}};
    for (int i = 0; i < grains->count; i++) {
        largest = silt_max(largest, grains->radius[i]);
        for (int k = 0; k < dim; k++) {
            bins->lo[k] = silt_min(bins->lo[k], grains->x[3 * i + k]);
            hi[k] = silt_max(hi[k], grains->x[3 * i + k]);
        }
    }
    // at most a few bins per grain, none narrower than two that hang together reach
    bins->width = 2 * (1 + HEAP_GAP) * largest;
    do {
        count = 1;
        for (int k = 0; k < dim; k++)
            count *= floor((hi[k] - bins->lo[k]) / bins->width) + 1;
    } while (count > 4.0 * grains->count + 64 && (bins->width *= 1.5) > 0);
    for (int k = 0; k < dim; k++)
        bins->n[k] = (int)((hi[k] - bins->lo[k]) / bins->width) + 1;
    bins->first = silt_alloc((size_t)count, sizeof *bins->first);
    bins->next = silt_alloc((size_t)grains->count, sizeof *bins->next);
    for (int b = 0; b < (int)count; b++)
        bins->first[b] = -1;
}

static int heap_place(const heap_bins *bins, const double *x, int dim, int at[3]) {
    at[0] = at[1] = at[2] = 0;
    for (int k = 0; k < dim; k++)
        at[k] = (int)((x[k] - bins->lo[k]) / bins->width);
    return (at[2] * bins->n[1] + at[1]) * bins->n[0] + at[0];
}

// joins grain i with those in the bins around it that came before it
static void heap_join(heap_bins *bins, const silt_grain_state *grains, int dim, int i, int *parent) {
    int at[3], bin = heap_place(bins, grains->x + 3 * i, dim, at), to[3];
    for (to[2] = at[2] > 0 ? at[2] - 1 : 0; to[2] <= at[2] + 1 && to[2] < bins->n[2]; to[2]++)
        for (to[1] = at[1] > 0 ? at[1] - 1 : 0; to[1] <= at[1] + 1 && to[1] < bins->n[1]; to[1]++)
            for (to[0] = at[0] > 0 ? at[0] - 1 : 0; to[0] <= at[0] + 1 && to[0] < bins->n[0]; to[0]++)
                for (int j = bins->first[(to[2] * bins->n[1] + to[1]) * bins->n[0] + to[0]]; j >= 0; j = bins->next[j]) {
                    double square = 0;
                    for (int k = 0; k < dim; k++)
                        square += silt_square(grains->x[3 * i + k] - grains->x[3 * j + k]);
                    if (square > silt_square((1 + HEAP_GAP) * (grains->radius[i] + grains->radius[j])))
                        continue;
                    const int a = silt_group_find(parent, i), b = silt_group_find(parent, j);
                    parent[a > b ? a : b] = a < b ? a : b;
                }
    bins->next[i] = bins->first[bin];
    bins->first[bin] = i;
}

void silt_heap_find(silt_heap *heap, const silt_view *view) {
    const silt_grain_state *grains = view->grains;
    const int dim = view->scene->dimension == 3 ? 3 : 2, n = grains ? grains->count : 0;
    SILT_RESERVE(heap->in, heap->in_capacity, n + 1);
    SILT_RESERVE(heap->parent, heap->parent_capacity, n + 1);
    SILT_RESERVE(heap->mass, heap->mass_capacity, n + 1);
    if (n == 0)
        return;
    heap_bins bins;
    heap_bins_create(&bins, grains, dim);
    for (int i = 0; i < n; i++) {
        heap->parent[i] = i;
        heap->mass[i] = 0;
    }
    for (int i = 0; i < n; i++)
        heap_join(&bins, grains, dim, i, heap->parent);
    free(bins.first);
    free(bins.next);
    int main = 0;
    for (int i = 0; i < n; i++)
        heap->mass[silt_group_find(heap->parent, i)] += grains->mass[i];
    for (int i = 0; i < n; i++)
        main = heap->mass[i] > heap->mass[main] ? i : main;
    for (int i = 0; i < n; i++)
        heap->in[i] = silt_group_find(heap->parent, i) == main;
}

void silt_heap_clear(silt_heap *heap) {
    free(heap->in);
    free(heap->parent);
    free(heap->mass);
    *heap = (silt_heap){0};
}

// least squares through the tops of columns from x0 to x1, in space slices across the whole heap: degrees by which it falls to the right
static double heap_slope(const silt_heap *heap, const silt_grain_state *grains, int up, double x0, double x1) {
    double radius = 0;
    for (int i = 0; i < grains->count; i++)
        radius += grains->radius[i] / grains->count;
    const int n = (int)silt_clamp((x1 - x0) / (2 * HEAP_COLUMN * radius), 2, 1e6);
    double *top = silt_alloc((size_t)n, sizeof *top), sum[5] = {0};
    for (int c = 0; c < n; c++)
        top[c] = -HUGE_VAL;
    for (int i = 0; i < grains->count; i++) {
        const double at = (grains->x[3 * i] - x0) / (x1 - x0) * n;
        if (heap->in[i] && at >= 0 && at < n)
            top[(int)at] = silt_max(top[(int)at], grains->x[3 * i + up] + grains->radius[i]);
    }
    for (int c = 0; c < n; c++) {
        const double x = (c + 0.5) / n * (x1 - x0), y = top[c];
        if (y == -HUGE_VAL)
            continue;
        const double term[5] = {1, x, y, x * x, x * y};
        for (int k = 0; k < 5; k++)
            sum[k] += term[k];
    }
    free(top);
    const double spread = sum[0] * sum[3] - sum[1] * sum[1];
    return spread > 0 ? -180 / M_PI * atan((sum[0] * sum[4] - sum[1] * sum[2]) / spread) : NAN;
}

double silt_heap_gauge(const silt_heap *heap, const silt_view *view, const silt_gauge_def *def) {
    const silt_grain_state *grains = view->grains;
    const int dim = view->scene->dimension == 3 ? 3 : 2;
    double best = -HUGE_VAL, sign = 1;
    if (!grains || grains->count == 0)
        return NAN;
    if (def->kind == GAUGE_GRAIN_SLOPE)
        return heap_slope(heap, grains, dim - 1, def->from[0], def->from[1]);
    for (int i = 0; i < grains->count; i++) {
        const double *x = grains->x + 3 * i, r = grains->radius[i];
        if (!heap->in[i])
            continue;
        if (def->kind == GAUGE_GRAIN_FRONT) {
            sign = def->from[0];
            best = silt_max(best, sign * x[0] + r);
            continue;
        }
        double under = r * r;
        for (int k = 0; k < dim - 1; k++)
            under -= silt_square(x[k] - def->from[k]);
        if (under >= 0)
            best = silt_max(best, x[dim - 1] + sqrt(under));
    }
    return best > -HUGE_VAL ? sign * best : NAN;
}

void silt_grain_gauge(const silt_view *view, const silt_gauge_def *def, double value[3]) {
    const silt_grain_state *grains = view->grains;
    int low = 0, high = grains ? grains->count : 0;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (grains->id[middle] < def->index)
            low = middle + 1;
        else
            high = middle;
    }
    if (!grains || low == grains->count || grains->id[low] != def->index)
        return;
    const double *from = def->kind == GAUGE_GRAIN_PLACE      ? grains->x
                         : def->kind == GAUGE_GRAIN_VELOCITY ? grains->v
                         : def->kind == GAUGE_GRAIN_SPIN     ? grains->omega
                                                             : grains->contact;
    if (from)
        memcpy(value, from + 3 * low, 3 * sizeof *value);
}

/** @file fill.c
 * Regions full of grains at the start: how many and how large (a sieve curve by mass), then where, at random or in rows.
 * A hundred thousand grains take 0.2 s.
 */
#include "scene_keys.h"

#define FILL_SHARE_PLANE 0.45 // of the area, up to which one grain after the other finds a place at random (it jams at 0.547)
#define FILL_SHARE_SPACE 0.3  // of the volume (it jams at 0.384)
#define FILL_TRIES       5000 // places tried for a grain
#define FILL_SLACK       1e-9 // of the distance of two grains that touch

/** grains by place: bins with linked lists */
typedef struct fill_grid {
    int dim, n[3], capacity;
    double lo[3], cell;
    int *first, *next; // owned
} fill_grid;

typedef struct fill_state {
    silt_scene *scene;
    const silt_fill_def *fill;
    silt_fill_clear *clear;
    const void *context;
    fill_grid grid;
    double largest; // m, radius of all grains of the scene
    int n;          // grains of this region
    double *radius; // owned, their radii, falling
    double wide;    // m, the largest of them
    double lo[3], hi[3]; // the region's box
    uint64_t random;
} fill_state;

// sizes ------------------------------------------------------------------------------------------------
// Mean over grains of d^power (0, 2 or 3) times a constant that is the same for all powers. By mass, diameters are spread evenly
// between two rows of the sieve, so by number as d^-3.
static double sieve_moment(const silt_series *sieve, int power) {
    double sum = 0;
    for (int i = 0; i + 1 < sieve->n_row; i++) {
        const double *row = sieve->value + 2 * i, a = row[0], b = row[2], share = (row[3] - row[1]) / (b - a);
        sum += share * (power == 0 ? 0.5 * (1 / (a * a) - 1 / (b * b)) : power == 2 ? log(b / a) : b - a);
    }
    return sum;
}

double silt_sieve_quantile(const silt_series *sieve, double q) {
    double left = q * sieve_moment(sieve, 0);
    for (int i = 0; i + 1 < sieve->n_row; i++) {
        const double *row = sieve->value + 2 * i, a = row[0], b = row[2], share = (row[3] - row[1]) / (b - a);
        const double part = share * 0.5 * (1 / (a * a) - 1 / (b * b));
        if (left < part)
            return silt_clamp(1 / sqrt(1 / (a * a) - 2 * left / share), a, b);
        left -= part;
    }
    return sieve->value[2 * sieve->n_row - 2];
}

int silt_sieve_draw(const silt_series *sieve, uint64_t seed, double whole, double power, int capacity, double *share) {
    double sum = 0;
    int n = 0;
    for (; n < capacity; n++) {
        share[n] = pow(silt_sieve_quantile(sieve, silt_uniform(&seed)) / whole, power);
        // the last one is kept when more than its half has room
        if (n > 0 && sum + 0.5 * share[n] > 1)
            break;
        sum += share[n];
    }
    for (int k = 0; k < n; k++)
        share[k] /= sum;
    return n;
}

// area or volume of a grain in the mean
static double fill_grain_share(const silt_fill_def *fill, int dim) {
    const double d = fill->diameter, form = dim == 3 ? M_PI / 6 : M_PI / 4;
    if (d > 0)
        return form * pow(d, dim);
    return form * sieve_moment(&fill->sieve, dim) / sieve_moment(&fill->sieve, 0);
}

static double fill_widest(const silt_fill_def *fill) {
    return 0.5 * (fill->diameter > 0 ? fill->diameter : fill->sieve.value[2 * fill->sieve.n_row - 2]);
}

// as many radii as grains, the largest first: the middles of n equal shares of the sieve curve by number
static void fill_sizes(fill_state *f) {
    const silt_fill_def *fill = f->fill;
    f->radius = silt_alloc((size_t)f->n + 1, sizeof *f->radius);
    for (int i = 0; i < f->n; i++)
        f->radius[i] = 0.5 * (fill->diameter > 0 ? fill->diameter : silt_sieve_quantile(&fill->sieve, (f->n - i - 0.5) / f->n));
    f->wide = f->n > 0 ? f->radius[0] : fill_widest(fill);
}

// bins -------------------------------------------------------------------------------------------------
static void grid_create(fill_grid *grid, int dim, const double *lo, const double *hi, double cell, int n_grain) {
    *grid = (fill_grid){.dim = dim, .n = {1, 1, 1}};
    double volume = 1, n_bin = 1;
    for (int k = 0; k < dim; k++)
        volume *= silt_max(hi[k] - lo[k], cell);
    // no more bins than a few per grain
    grid->cell = silt_max(cell, pow(volume / (4.0 * n_grain + 1000), 1.0 / dim));
    for (int k = 0; k < dim; k++) {
        grid->lo[k] = lo[k];
        grid->n[k] = (int)silt_max(1, ceil((hi[k] - lo[k]) / grid->cell));
        n_bin *= grid->n[k];
    }
    grid->first = silt_alloc((size_t)n_bin, sizeof *grid->first);
    for (size_t b = 0; b < (size_t)n_bin; b++)
        grid->first[b] = -1;
}

static int grid_place(const fill_grid *grid, int k, double x) {
    return (int)silt_clamp(floor((x - grid->lo[k]) / grid->cell), 0, grid->n[k] - 1);
}

static size_t grid_bin(const fill_grid *grid, const int at[3]) {
    return ((size_t)at[2] * (size_t)grid->n[1] + (size_t)at[1]) * (size_t)grid->n[0] + (size_t)at[0];
}

static void grid_add(fill_grid *grid, int grain, const double *x) {
    int at[3] = {0};
    for (int k = 0; k < grid->dim; k++)
        at[k] = grid_place(grid, k, x[k]);
    SILT_RESERVE(grid->next, grid->capacity, grain + 1);
    grid->next[grain] = grid->first[grid_bin(grid, at)];
    grid->first[grid_bin(grid, at)] = grain;
}

// true when a grain of that radius at x would overlap none that is there
static bool grid_free(const fill_state *f, const double *x, double radius) {
    const fill_grid *grid = &f->grid;
    int from[3] = {0}, to[3] = {0}, at[3];
    for (int k = 0; k < grid->dim; k++) {
        from[k] = grid_place(grid, k, x[k] - radius - f->largest);
        to[k] = grid_place(grid, k, x[k] + radius + f->largest);
    }
    for (at[2] = from[2]; at[2] <= to[2]; at[2]++)
        for (at[1] = from[1]; at[1] <= to[1]; at[1]++)
            for (at[0] = from[0]; at[0] <= to[0]; at[0]++)
                for (int i = grid->first[grid_bin(grid, at)]; i >= 0; i = grid->next[i]) {
                    const silt_grain_def *g = silt_scene_grain(f->scene, i);
                    double square = 0;
                    for (int k = 0; k < grid->dim; k++)
                        square += silt_square(x[k] - g->at[k]);
                    if (square < silt_square((radius + 0.5 * g->diameter) * (1 - FILL_SLACK)))
                        return false;
                }
    return true;
}

// places -----------------------------------------------------------------------------------------------
// room for a whole grain: in the region, clear of all that stands there
static bool fill_fits(const fill_state *f, const double *x, double radius) {
    return silt_region_depth(&f->fill->region, x) >= radius * (1 - FILL_SLACK) && grid_free(f, x, radius) &&
           f->clear(f->context, x, radius);
}

static void fill_add(fill_state *f, const double *x, double radius) {
    silt_grains_def *grains = &f->scene->grains;
    SILT_RESERVE(grains->filled, grains->filled_capacity, grains->n_filled + 1);
    silt_grain_def *g = &grains->filled[grains->n_filled++];
    *g = (silt_grain_def){.diameter = 2 * radius, .density = f->fill->density, .fixed = f->fill->fixed};
    memcpy(g->at, x, (size_t)f->grid.dim * sizeof *x);
    memcpy(g->velocity, f->fill->velocity, sizeof g->velocity);
    grid_add(&f->grid, silt_scene_grains(f->scene) - 1, x);
}

// takes back what this region has got so far
static void fill_undo(fill_state *f, int n_before) {
    silt_grains_def *grains = &f->scene->grains;
    const fill_grid *grid = &f->grid;
    while (grains->n_filled > n_before) {
        const silt_grain_def *g = &grains->filled[--grains->n_filled];
        int at[3] = {0};
        for (int k = 0; k < grid->dim; k++)
            at[k] = grid_place(grid, k, g->at[k]);
        grid->first[grid_bin(grid, at)] = grid->next[silt_scene_grains(f->scene)]; // added last: it is the bin's first
    }
}

// one after the other, the largest first, each at the first of many random places that is free; false: one found none
static bool fill_scatter(fill_state *f) {
    const int dim = f->grid.dim;
    for (int i = 0; i < f->n; i++) {
        double x[3] = {0};
        int left = FILL_TRIES;
        do
            for (int k = 0; k < dim; k++)
                x[k] = f->lo[k] + silt_uniform(&f->random) * (f->hi[k] - f->lo[k]);
        while (!fill_fits(f, x, f->radius[i]) && --left > 0);
        if (left == 0)
            return false;
        fill_add(f, x, f->radius[i]);
    }
    return true;
}

// Sites of triangular rows, in space of rows upon rows, in rising height, `spacing` from each other, with room for the widest grain.
// @param site  out, 3 numbers each, as many as `most`; NULL: only counted
static int fill_sites(const fill_state *f, double spacing, int most, double *site) {
    const int dim = f->grid.dim, up = dim - 1;
    const double layer = spacing * (dim == 3 ? sqrt(2.0 / 3) : sqrt(0.75)), row = spacing * sqrt(0.75);
    int n = 0;
    double x[3] = {0}, lo[3], hi[3];
    for (int k = 0; k < dim; k++) {
        lo[k] = f->lo[k] + f->wide;
        hi[k] = f->hi[k] - f->wide + FILL_SLACK * spacing;
    }
    for (int l = 0; n < most && (x[up] = lo[up] + l * layer) <= hi[up]; l++) {
        const int n_row = dim == 3 ? (int)ceil((hi[1] - lo[1]) / row) + 1 : 1;
        for (int r = 0; n < most && r < n_row; r++) {
            if (dim == 3)
                x[1] = lo[1] + r * row + (l % 2 ? spacing / sqrt(12) : 0);
            const double shift = (dim == 3 ? (l + r) % 2 : l % 2) ? 0.5 * spacing : 0;
            for (int c = 0; n < most && (x[0] = lo[0] + shift + c * spacing) <= hi[0]; c++) {
                if (!fill_fits(f, x, f->wide))
                    continue;
                if (site)
                    memcpy(site + 3 * n, x, sizeof x);
                n++;
            }
        }
    }
    return n;
}

// the widest spacing that has a site for each grain: they spread over the region
static double fill_spacing(const fill_state *f, double closest) {
    double low = closest, high = closest;
    for (int k = 0; k < f->grid.dim; k++)
        high = silt_max(high, f->hi[k] - f->lo[k]);
    for (int i = 0; i < 30; i++) {
        const double middle = sqrt(low * high);
        if (fill_sites(f, middle, f->n, NULL) >= f->n)
            low = middle;
        else
            high = middle;
    }
    return low;
}

// in a random direction, as far as two that meet may both go
static void fill_shake(fill_state *f, double *x, double radius, double room) {
    double to[3] = {0}, length = 2;
    for (int left = 20; left > 0; left--) {
        for (length = 2; length > 1; length = silt_length(f->grid.dim, to))
            for (int k = 0; k < f->grid.dim; k++)
                to[k] = 2 * silt_uniform(&f->random) - 1;
        for (int k = 0; k < f->grid.dim; k++)
            to[k] = x[k] + room * to[k];
        if (fill_fits(f, to, radius)) {
            memcpy(x, to, sizeof to);
            return;
        }
    }
}

// on sites of rows, sizes in random order; shaken: from there as far as there is room
static void fill_rows(fill_state *f, bool shaken) {
    const double spacing = fill_spacing(f, 2 * f->wide), room = shaken ? 0.5 * (spacing - 2 * f->wide) : 0;
    double *site = silt_alloc(3 * (size_t)f->n + 1, sizeof *site);
    fill_sites(f, spacing, f->n, site);
    for (int i = f->n - 1; i > 0 && f->fill->diameter == 0; i--) {
        const int k = (int)(silt_uniform(&f->random) * (i + 1));
        const double other = f->radius[i];
        f->radius[i] = f->radius[k];
        f->radius[k] = other;
    }
    for (int i = 0; i < f->n; i++) {
        if (room > 0)
            fill_shake(f, site + 3 * i, f->radius[i], room);
        fill_add(f, site + 3 * i, f->radius[i]);
    }
    free(site);
}

// order ------------------------------------------------------------------------------------------------
typedef struct fill_ranked {
    int64_t rank;
    int index;
} fill_ranked;

static int fill_order(const void *a, const void *b) {
    const fill_ranked *p = a, *q = b;
    return p->rank != q->rank ? (p->rank < q->rank ? -1 : 1) : p->index - q->index;
}

// neighbours get numbers near each other, strip by strip across the region's longest side
static void fill_sort(const fill_state *f, int n_before) {
    silt_grain_def *grain = f->scene->grains.filled + n_before;
    const int n = f->scene->grains.n_filled - n_before, dim = f->grid.dim;
    int axis[3] = {0, 1, 2}; // the longest first
    for (int i = 0; i < dim; i++)
        for (int k = i + 1; k < dim; k++)
            if (f->hi[axis[k]] - f->lo[axis[k]] > f->hi[axis[i]] - f->lo[axis[i]]) {
                const int other = axis[i];
                axis[i] = axis[k];
                axis[k] = other;
            }
    fill_ranked *ranked = silt_alloc((size_t)n + 1, sizeof *ranked);
    silt_grain_def *old = silt_alloc((size_t)n + 1, sizeof *old);
    memcpy(old, grain, (size_t)n * sizeof *old);
    for (int i = 0; i < n; i++) {
        ranked[i].index = i;
        for (int k = 0; k < dim; k++)
            ranked[i].rank = ranked[i].rank * 100000 + (int64_t)silt_clamp((old[i].at[axis[k]] - f->lo[axis[k]]) / (3 * f->wide), 0, 99999);
    }
    qsort(ranked, (size_t)n, sizeof *ranked, fill_order);
    for (int i = 0; i < n; i++)
        grain[i] = old[ranked[i].index];
    free(ranked);
    free(old);
}

// regions ----------------------------------------------------------------------------------------------
// what was asked for, and the most that there is room for; the complaint stands at the key that asks
static void fill_refuse(silt_reader *reader, const fill_state *f, int i, double asked, int most) {
    const silt_tree *node = silt_tree_find(reader->root, "grains.regions.%d", i);
    const silt_tree *porosity = silt_tree_item(node, "porosity"), *count = silt_tree_item(node, "count");
    const double share = fill_grain_share(f->fill, f->grid.dim) / silt_region_area(&f->fill->region);
    const char *hint = "; denser packings come by letting grains settle";
    if (most == 0)
        silt_complain(reader, node, "key 'grains.regions.%d': found no room for a grain of %.4g m, allowed a region that holds one", i,
                      2 * f->wide);
    else if (most == SCENE_GRAINS)
        silt_complain(reader, node, "key 'grains.regions.%d': found room for %.10g grains, allowed at most %d", i, asked, most);
    else if (count && f->fill->count > 0)
        silt_complain(reader, count, "key 'grains.regions.%d.count': found %d, allowed at most the %d that the region has room for%s", i,
                      f->fill->count, most, hint);
    else
        silt_complain(reader, porosity ? porosity : node,
                      "key 'grains.regions.%d.porosity': found %.10g, which asks for %.10g grains, allowed %.4g or more, %d grains: there is "
                      "room for no more%s",
                      i, f->fill->porosity, asked, 1 - most * share, most, hint);
}

// on rows when they were asked for, and where there is no place left at random. open: as many as there is room for.
// @return how many there is room for
static int fill_in_rows(fill_state *f, bool open) {
    const silt_fill_def *fill = f->fill;
    const bool shaken = fill->arrangement == ARRANGE_RANDOM;
    const int most = fill_sites(f, 2 * f->wide, open && shaken ? f->n : SCENE_GRAINS, NULL);
    if (open) { // other sizes for another number
        free(f->radius);
        f->n = most;
        fill_sizes(f);
    }
    if (f->n <= most)
        fill_rows(f, shaken);
    return most;
}

// @return false after a complaint
static bool fill_region(silt_reader *reader, fill_state *f, int i) {
    const silt_fill_def *fill = f->fill = &f->scene->grains.fill[i];
    const int dim = f->grid.dim, n_before = f->scene->grains.n_filled;
    const double usual = dim == 3 ? FILL_SHARE_SPACE : FILL_SHARE_PLANE, area = silt_region_area(&fill->region);
    const double each = fill_grain_share(fill, dim), share = fill->porosity > 0 ? 1 - fill->porosity : usual;
    const bool open = fill->count == 0 && fill->porosity == 0;
    const double asked = fill->count > 0 ? fill->count : silt_max(1, floor(share * area / each + 0.5));
    int most = SCENE_GRAINS;
    silt_region_bounds(&fill->region, f->lo, f->hi);
    f->random = (uint64_t)fill->seed;
    if (asked <= most) {
        f->n = (int)asked;
        fill_sizes(f);
        if (fill->arrangement == ARRANGE_LATTICE || f->n * each > usual * area + each || !fill_scatter(f)) {
            fill_undo(f, n_before);
            most = fill_in_rows(f, open);
        }
        free(f->radius);
        f->radius = NULL;
    }
    if (most == 0 || asked > SCENE_GRAINS || (!open && asked > most)) {
        fill_refuse(reader, f, i, asked, most);
        return false;
    }
    fill_sort(f, n_before);
    return true;
}

void silt_scene_fill(silt_reader *reader, silt_scene *scene, silt_fill_clear *clear, const void *context) {
    const silt_grains_def *grains = &scene->grains;
    const int dim = scene->dimension == 3 ? 3 : 2;
    fill_state f = {.scene = scene, .clear = clear, .context = context};
    double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, number = 0;
    for (int i = 0; i < grains->n_grain; i++)
        f.largest = silt_max(f.largest, 0.5 * grains->grain[i].diameter);
    for (int i = 0; i < grains->n_fill; i++) {
        double a[3], b[3];
        silt_region_bounds(&grains->fill[i].region, a, b);
        for (int k = 0; k < dim; k++) {
            lo[k] = silt_min(lo[k], a[k]);
            hi[k] = silt_max(hi[k], b[k]);
        }
        f.largest = silt_max(f.largest, fill_widest(&grains->fill[i]));
        number += silt_region_area(&grains->fill[i].region) / fill_grain_share(&grains->fill[i], dim);
    }
    if (grains->n_fill == 0)
        return;
    grid_create(&f.grid, dim, lo, hi, 2 * f.largest, (int)silt_min(number, SCENE_GRAINS));
    for (int i = 0; i < grains->n_grain; i++)
        grid_add(&f.grid, i, grains->grain[i].at);
    for (int i = 0; i < grains->n_fill && fill_region(reader, &f, i); i++) {
        // the grains have other numbers now
        for (size_t b = 0, n = (size_t)f.grid.n[0] * (size_t)f.grid.n[1] * (size_t)f.grid.n[2]; b < n; b++)
            f.grid.first[b] = -1;
        for (int k = 0; k < silt_scene_grains(scene); k++)
            grid_add(&f.grid, k, silt_scene_grain(scene, k)->at);
    }
    free(f.grid.first);
    free(f.grid.next);
}

// ---------------------------------------------------------------- grains of the list

#define FILL_OVERLAP 0.1 // share of a grain's radius that may stand in something at the start

/** a grain of the list by its left end */
typedef struct fill_end {
    double left;
    int grain;
} fill_end;

static int fill_end_order(const void *a, const void *b) {
    const fill_end *p = a, *q = b;
    return p->left != q->left ? (p->left < q->left ? -1 : 1) : p->grain - q->grain;
}

static void fill_check_pairs(silt_reader *reader, const silt_scene *scene) {
    const int n = scene->grains.n_grain;
    const silt_grain_def *grain = scene->grains.grain;
    fill_end *end = silt_alloc((size_t)n + 1, sizeof *end);
    for (int i = 0; i < n; i++)
        end[i] = (fill_end){grain[i].at[0] - 0.5 * grain[i].diameter, i};
    qsort(end, (size_t)n, sizeof *end, fill_end_order);
    for (int i = 0; i < n; i++)
        for (int k = i + 1; k < n && end[k].left < end[i].left + grain[end[i].grain].diameter; k++) {
            const int a = end[i].grain < end[k].grain ? end[i].grain : end[k].grain, b = end[i].grain + end[k].grain - a;
            const silt_grain_def *p = &grain[a], *q = &grain[b];
            const double apart[3] = {p->at[0] - q->at[0], p->at[1] - q->at[1], p->at[2] - q->at[2]};
            const double overlap = 0.5 * (p->diameter + q->diameter) - silt_length(3, apart);
            if (overlap > 0.5 * FILL_OVERLAP * silt_min(p->diameter, q->diameter) && !(p->fixed && q->fixed))
                silt_complain(reader, silt_tree_find(reader->root, "grains.list.%d.at", b),
                              "key 'grains.list.%d.at': found a grain that stands %.3g m in grain %d, allowed places that are clear of the others", b, overlap, a);
        }
    free(end);
}

void silt_scene_check_grains(silt_reader *reader, const silt_scene *scene, silt_fill_clear *clear, const void *context) {
    for (int i = 0; i < scene->grains.n_grain; i++) {
        const silt_grain_def *grain = &scene->grains.grain[i];
        if (!grain->fixed && !clear(context, grain->at, 0.5 * (1 - FILL_OVERLAP) * grain->diameter))
            silt_complain(reader, silt_tree_find(reader->root, "grains.list.%d.at", i),
                          "key 'grains.list.%d.at': found a grain of %.4g m that stands in a wall, the bed or a body, allowed places that are clear of them", i,
                          grain->diameter);
    }
    fill_check_pairs(reader, scene);
}

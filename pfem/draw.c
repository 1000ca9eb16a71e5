// pictures of frames: water, bed, grains, bodies and walls with axes and a colour bar, drawn from the .hdf files

#include "output.h"

#include <cairo.h>
#include <errno.h>
#include <hdf5.h>
#include <unistd.h>

// pixels: the picture's largest width, the plot's largest and smallest height, the margins around the plot
enum { PICTURE_WIDTH = 1600, PLOT_HEIGHT = 1000, PLOT_LOW = 220, PLOT_NARROW = 420 };
enum { MARGIN_LEFT = 84, MARGIN_BAR = 132, MARGIN_RIGHT = 24, MARGIN_TOP = 58, MARGIN_BOTTOM = 66 };

// frames that are looked at to fix the extent and the colour range for all pictures of a run
#define DRAW_SAMPLES 16
// share of the values that the colour bar covers: a few flung nodes shall not wash out the rest
#define DRAW_QUANTILE 0.995

// ---------------------------------------------------------------- frames from files

/** what one frame file holds */
typedef struct draw_grid {
    int n_point, n_cell;
    double *x;      // owned, 3 per point
    int *offset;    // owned, n_cell + 1
    int *link;      // owned
    double *value;  // owned, one per point (per cell for bed density): what is coloured; NULL: nothing
    double *radius; // owned, grains only
    int *kind;      // owned, fluid only: silt_node_kind
    double time;
} draw_grid;

static void grid_clear(draw_grid *grid) {
    free(grid->x);
    free(grid->offset);
    free(grid->link);
    free(grid->value);
    free(grid->radius);
    free(grid->kind);
    memset(grid, 0, sizeof *grid);
}

// all values of a data set as doubles (integers with whole: as ints); NULL when it is absent
static void *grid_array(hid_t root, const char *name, bool whole, size_t *n) {
    hid_t set = H5Dopen2(root, name, H5P_DEFAULT);
    if (set < 0)
        return NULL;
    hid_t space = H5Dget_space(set);
    *n = (size_t)H5Sget_simple_extent_npoints(space);
    H5Sclose(space);
    void *data = silt_alloc(*n + 1, whole ? sizeof(int) : sizeof(double));
    hid_t type = whole ? H5T_NATIVE_INT : H5T_NATIVE_DOUBLE;
    if (*n > 0 && H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0) {
        free(data);
        data = NULL;
    }
    H5Dclose(set);
    return data;
}

// false when there is no such file: the scene has no such part
static bool grid_read(draw_grid *grid, const char *out, const char *part, int number, const char *array) {
    size_t n, cells, links;
    memset(grid, 0, sizeof *grid);
    char *path = silt_text("%s/%s_%06d.hdf", out, part, number);
    hid_t file = access(path, R_OK) == 0 ? H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT) : -1;
    free(path);
    if (file < 0)
        return false;
    hid_t root = H5Gopen2(file, "VTKHDF", H5P_DEFAULT);
    grid->x = grid_array(root, "Points", false, &n);
    grid->n_point = (int)(n / 3);
    grid->offset = grid_array(root, "Offsets", true, &cells);
    grid->n_cell = (int)cells - 1;
    grid->link = grid_array(root, "Connectivity", true, &links);
    double *time = grid_array(root, "FieldData/TimeValue", false, &n);
    grid->time = time ? *time : 0;
    free(time);
    grid->radius = grid_array(root, "PointData/radius", false, &n);
    grid->kind = grid_array(root, "PointData/kind", true, &n);
    if (array)
        grid->value = grid_array(root, array, false, &n);
    // vectors are shown by their length
    if (grid->value && n == 3 * (size_t)grid->n_point && n > 0) {
        for (int i = 0; i < grid->n_point; i++) {
            const double *v = grid->value + 3 * i;
            grid->value[i] = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        }
    }
    bool whole = grid->x && grid->offset && grid->link;
    if (root >= 0)
        H5Gclose(root);
    H5Fclose(file);
    if (!whole)
        grid_clear(grid);
    return whole;
}

static int grid_corners(const draw_grid *grid, int cell) {
    return grid->offset[cell + 1] - grid->offset[cell];
}

// ---------------------------------------------------------------- colours

typedef struct draw_colour {
    double r, g, b;
} draw_colour;

// even steps of lightness from dark blue to yellow (the palette known as viridis)
static const unsigned draw_map[] = {0x440154, 0x482878, 0x3e4989, 0x31688e, 0x26828e,
                                    0x1f9e89, 0x35b779, 0x6ece58, 0xb5de2b, 0xfde725};
// untouched sand to worn
static const unsigned draw_worn[] = {0xf3e6c4, 0xf8cf87, 0xf0a050, 0xd96a2c, 0xa63c1e, 0x641a12};
// loose to dense sand
static const unsigned draw_sand[] = {0xf3e6c4, 0xe8d2a0, 0xd6b67a, 0xbb955c};

static draw_colour draw_hex(unsigned c) {
    return (draw_colour){(c >> 16 & 255) / 255.0, (c >> 8 & 255) / 255.0, (c & 255) / 255.0};
}

// colour at s in [0, 1] of a table
static draw_colour draw_mix(const unsigned *table, int n, double s) {
    s = (n - 1) * (s > 0 ? silt_min(s, 1) : 0);
    int i = s >= n - 1 ? n - 2 : (int)s;
    draw_colour a = draw_hex(table[i]), b = draw_hex(table[i + 1]);
    s -= i;
    return (draw_colour){a.r + s * (b.r - a.r), a.g + s * (b.g - a.g), a.b + s * (b.b - a.b)};
}

static void draw_ink(cairo_t *cr, unsigned c) {
    draw_colour colour = draw_hex(c);
    cairo_set_source_rgb(cr, colour.r, colour.g, colour.b);
}

// ---------------------------------------------------------------- the field and the canvas

typedef struct draw_field {
    const char *name, *label;
    const char *water; // array of the fluid that colours it
    const char *bed;   // array of the bed that colours it, else its density in sand colours
    const unsigned *map;
    int n_map;
} draw_field;

#define DRAW_MAP(table) table, sizeof(table) / sizeof *(table)

static const draw_field draw_fields[] = {
    {"speed", "speed, m/s", "PointData/velocity", NULL, DRAW_MAP(draw_map)},
    {"pressure", "pressure, Pa", "PointData/pressure", NULL, DRAW_MAP(draw_map)},
    {"porosity", "porosity", "PointData/porosity", NULL, DRAW_MAP(draw_map)},
    {"mesh", NULL, NULL, NULL, DRAW_MAP(draw_map)},
    {"bed", "frictional work, J/m³", NULL, "PointData/work", DRAW_MAP(draw_worn)},
};

/** fixed for all pictures of a run, then the picture being drawn */
typedef struct draw_canvas {
    const char *out;
    const silt_scene *scene;
    const draw_field *field;
    double lo[2], hi[2]; // m, the plot's extent
    double low, high;    // colour range
    double density;      // kg/m3, largest density of the bed
    double scale;        // pixels per metre
    int width, height;   // of the plot, pixels
    int right;           // margin with or without a colour bar, pixels
    cairo_surface_t *surface;
    cairo_t *cr;
} draw_canvas;

static double draw_x(const draw_canvas *c, double x) {
    return MARGIN_LEFT + (x - c->lo[0]) * c->scale;
}
static double draw_y(const draw_canvas *c, double y) {
    return MARGIN_TOP + c->height - (y - c->lo[1]) * c->scale;
}

static void draw_extend(double lo[2], double hi[2], double x, double y) {
    lo[0] = silt_min(lo[0], x), hi[0] = silt_max(hi[0], x);
    lo[1] = silt_min(lo[1], y), hi[1] = silt_max(hi[1], y);
}

static int draw_ascending(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// 1, 2 or 5 times a power of ten: the smallest step that is at least `least`
static double draw_step(double least) {
    double power = pow(10, floor(log10(least)));
    return power * (least <= power ? 1 : least <= 2 * power ? 2 : least <= 5 * power ? 5 : 10);
}

// extent and colour range over some frames of the whole run
static void draw_survey(draw_canvas *c, const silt_frame_entry *entry, int n_frame) {
    double wall_lo[2] = {HUGE_VAL, HUGE_VAL}, wall_hi[2] = {-HUGE_VAL, -HUGE_VAL};
    double lo[2] = {HUGE_VAL, HUGE_VAL}, hi[2] = {-HUGE_VAL, -HUGE_VAL};
    for (int i = 0; i < c->scene->n_wall; i++)
        for (int k = 0; k < c->scene->wall[i].n_point; k++)
            draw_extend(wall_lo, wall_hi, c->scene->wall[i].point[3 * k], c->scene->wall[i].point[3 * k + 1]);
    c->low = HUGE_VAL, c->high = -HUGE_VAL;
    int samples = n_frame < DRAW_SAMPLES ? n_frame : DRAW_SAMPLES;
    for (int s = 0; s < samples; s++) {
        int number = entry[samples > 1 ? (int)((long)s * (n_frame - 1) / (samples - 1)) : 0].number;
        static const char *const part[] = {"fluid", "bed", "grains", "bodies"};
        for (int k = 0; k < 4; k++) {
            draw_grid grid;
            const char *array = k == 0 ? c->field->water : k == 1 ? c->field->bed : NULL;
            if (!grid_read(&grid, c->out, part[k], number, array))
                continue;
            double *list = silt_alloc((size_t)grid.n_point + 1, sizeof *list);
            bool *counts = silt_alloc((size_t)grid.n_point + 1, sizeof *counts);
            int n = 0;
            // water: nodes of triangles only, spray does not count
            for (int i = 0; i < grid.n_cell; i++) {
                if (k == 0 && grid_corners(&grid, i) < 3)
                    continue;
                for (int j = grid.offset[i]; j < grid.offset[i + 1]; j++) {
                    const double *x = grid.x + 3 * grid.link[j];
                    counts[grid.link[j]] = true;
                    double r = grid.radius ? grid.radius[grid.link[j]] : 0;
                    draw_extend(lo, hi, x[0] - r, x[1] - r);
                    draw_extend(lo, hi, x[0] + r, x[1] + r);
                }
            }
            for (int i = 0; grid.value && i < grid.n_point; i++)
                if (counts[i])
                    list[n++] = grid.value[i];
            qsort(list, (size_t)n, sizeof *list, draw_ascending);
            if (n > 0) {
                c->low = silt_min(c->low, list[(int)((1 - DRAW_QUANTILE) * (n - 1))]);
                c->high = silt_max(c->high, list[(int)(DRAW_QUANTILE * (n - 1))]);
            }
            free(list);
            free(counts);
            grid_clear(&grid);
            if (k == 1 && grid_read(&grid, c->out, part[k], number, "CellData/density")) {
                for (int i = 0; i < grid.n_cell; i++)
                    c->density = silt_max(c->density, grid.value ? grid.value[i] : 0);
                grid_clear(&grid);
            }
        }
    }
    // walls bound the plot sideways; upwards the water does, high empty tanks are cut
    if (wall_lo[0] <= wall_hi[0] && lo[0] <= hi[0]) {
        double room = 0.25 * (hi[1] - lo[1]);
        lo[0] = wall_lo[0], hi[0] = wall_hi[0], lo[1] = silt_min(wall_lo[1], lo[1]);
        hi[1] = silt_min(wall_hi[1] > lo[1] ? wall_hi[1] : HUGE_VAL, hi[1] + room);
    }
    if (!(lo[0] <= hi[0]))
        lo[0] = lo[1] = 0, hi[0] = hi[1] = 1;
    double margin = 0.02 * silt_max(hi[0] - lo[0], hi[1] - lo[1]);
    for (int d = 0; d < 2; d++) {
        c->lo[d] = lo[d] - (margin > 0 ? margin : 0.5);
        c->hi[d] = hi[d] + (margin > 0 ? margin : 0.5);
    }
    // speed and work begin at 0, the ends of the range are round
    if (!(c->low < HUGE_VAL))
        c->low = 0, c->high = 1;
    if (c->low > 0 && c->low < 0.5 * c->high)
        c->low = 0;
    double step = draw_step(silt_max(1e-300, (c->high - c->low) / 10));
    if (c->high - c->low > 1e-9 * fabs(c->high)) {
        c->low = step * floor(c->low / step + 1e-6);
        c->high = step * ceil(c->high / step - 1e-6);
    } else {
        c->low -= 0.5 * fabs(c->low);
        c->high = c->low + silt_max(fabs(c->high), 1);
    }
}

// pixels per metre, aspect 1:1; a flat scene gets air above, a high and narrow one gets room at the sides
static void draw_layout(draw_canvas *c) {
    double wide = c->hi[0] - c->lo[0], high = c->hi[1] - c->lo[1];
    c->right = c->field->label ? MARGIN_BAR : MARGIN_RIGHT;
    c->scale = silt_min((PICTURE_WIDTH - MARGIN_LEFT - c->right) / wide, PLOT_HEIGHT / high);
    if (high * c->scale < PLOT_LOW)
        c->hi[1] = c->lo[1] + PLOT_LOW / c->scale;
    if (wide * c->scale < PLOT_NARROW) {
        double more = 0.5 * (PLOT_NARROW / c->scale - wide);
        c->lo[0] -= more;
        c->hi[0] += more;
    }
    c->width = (int)lround((c->hi[0] - c->lo[0]) * c->scale);
    c->height = (int)lround((c->hi[1] - c->lo[1]) * c->scale);
}

// ---------------------------------------------------------------- triangles

// fills a triangle pixel by pixel: the value is interpolated, then coloured
static void draw_triangle(draw_canvas *c, const draw_grid *grid, const int node[3], const draw_colour *flat) {
    double px[3], py[3];
    for (int k = 0; k < 3; k++) {
        px[k] = draw_x(c, grid->x[3 * node[k]]);
        py[k] = draw_y(c, grid->x[3 * node[k] + 1]);
    }
    double area = (px[1] - px[0]) * (py[2] - py[0]) - (px[2] - px[0]) * (py[1] - py[0]);
    if (area == 0)
        return;
    int x0 = (int)silt_max(MARGIN_LEFT, floor(silt_min(px[0], silt_min(px[1], px[2]))));
    int x1 = (int)silt_min(MARGIN_LEFT + c->width - 1, ceil(silt_max(px[0], silt_max(px[1], px[2]))));
    int y0 = (int)silt_max(MARGIN_TOP, floor(silt_min(py[0], silt_min(py[1], py[2]))));
    int y1 = (int)silt_min(MARGIN_TOP + c->height - 1, ceil(silt_max(py[0], silt_max(py[1], py[2]))));
    uint8_t *pixels = cairo_image_surface_get_data(c->surface);
    int stride = cairo_image_surface_get_stride(c->surface);
    for (int y = y0; y <= y1; y++) {
        uint32_t *row = (uint32_t *)(void *)(pixels + (size_t)y * (size_t)stride);
        for (int x = x0; x <= x1; x++) {
            double qx = x + 0.5, qy = y + 0.5;
            double a = ((px[1] - qx) * (py[2] - qy) - (px[2] - qx) * (py[1] - qy)) / area;
            double b = ((px[2] - qx) * (py[0] - qy) - (px[0] - qx) * (py[2] - qy)) / area;
            if (a < 0 || b < 0 || a + b > 1)
                continue;
            draw_colour ink;
            if (flat) {
                ink = *flat;
            } else {
                double value = a * grid->value[node[0]] + b * grid->value[node[1]] + (1 - a - b) * grid->value[node[2]];
                ink = draw_mix(c->field->map, c->field->n_map, (value - c->low) / (c->high - c->low));
            }
            row[x] = 0xff000000u | (uint32_t)lround(255 * ink.r) << 16 | (uint32_t)lround(255 * ink.g) << 8 |
                     (uint32_t)lround(255 * ink.b);
        }
    }
}

static int draw_edge_order(const void *a, const void *b) {
    const int *p = a, *q = b;
    return p[0] != q[0] ? (p[0] > q[0]) - (p[0] < q[0]) : (p[1] > q[1]) - (p[1] < q[1]);
}

// lines along the edges of the triangles: those of one triangle only, or all
static void draw_edges(draw_canvas *c, const draw_grid *grid, bool all, unsigned ink, double width) {
    int(*edge)[2] = silt_alloc(3 * (size_t)grid->n_cell + 1, sizeof *edge), n = 0;
    for (int i = 0; i < grid->n_cell; i++) {
        for (int k = 0; grid_corners(grid, i) == 3 && k < 3; k++) {
            int a = grid->link[grid->offset[i] + k], b = grid->link[grid->offset[i] + (k + 1) % 3];
            edge[n][0] = a < b ? a : b;
            edge[n++][1] = a < b ? b : a;
        }
    }
    qsort(edge, (size_t)n, sizeof *edge, draw_edge_order);
    draw_ink(c->cr, ink);
    cairo_set_line_width(c->cr, width);
    for (int i = 0, same; i < n; i += same) {
        for (same = 1; i + same < n && draw_edge_order(edge[i], edge[i + same]) == 0;)
            same++;
        if (same > 1 && !all)
            continue;
        cairo_move_to(c->cr, draw_x(c, grid->x[3 * edge[i][0]]), draw_y(c, grid->x[3 * edge[i][0] + 1]));
        cairo_line_to(c->cr, draw_x(c, grid->x[3 * edge[i][1]]), draw_y(c, grid->x[3 * edge[i][1] + 1]));
        cairo_stroke(c->cr);
    }
    free(edge);
}

// ---------------------------------------------------------------- the parts

static void draw_water(draw_canvas *c, int number) {
    static const draw_colour plain = {0.72, 0.85, 0.93};
    draw_grid grid;
    if (!grid_read(&grid, c->out, "fluid", number, c->field->water))
        return;
    bool mesh = strcmp(c->field->name, "mesh") == 0;
    cairo_surface_flush(c->surface);
    for (int i = 0; i < grid.n_cell; i++)
        if (grid_corners(&grid, i) == 3)
            draw_triangle(c, &grid, grid.link + grid.offset[i], grid.value ? NULL : &plain);
    cairo_surface_mark_dirty(c->surface);
    if (mesh)
        draw_edges(c, &grid, true, 0x4f86ab, 0.6);
    draw_edges(c, &grid, false, 0x1d4e73, 1.2);
    // nodes that fly freely; those of dry walls, beds and bodies are no water
    draw_ink(c->cr, 0x1d4e73);
    for (int i = 0; i < grid.n_cell; i++) {
        if (grid_corners(&grid, i) != 1 || (grid.kind && grid.kind[grid.link[grid.offset[i]]] != NODE_FLUID))
            continue;
        const double *x = grid.x + 3 * grid.link[grid.offset[i]];
        cairo_arc(c->cr, draw_x(c, x[0]), draw_y(c, x[1]), 1.6, 0, 2 * M_PI);
        cairo_fill(c->cr);
    }
    grid_clear(&grid);
}

static void draw_bed(draw_canvas *c, int number) {
    draw_grid grid, cells;
    if (!grid_read(&grid, c->out, "bed", number, c->field->bed))
        return;
    bool dense = grid_read(&cells, c->out, "bed", number, "CellData/density") && cells.value;
    cairo_surface_flush(c->surface);
    for (int i = 0; i < grid.n_cell; i++) {
        double density = dense && c->density > 0 ? cells.value[i] / c->density : 1;
        // the upper half of the scale: even loose sand is sand
        draw_colour sand = draw_mix(draw_sand, sizeof draw_sand / sizeof *draw_sand, 2 * density - 1);
        draw_triangle(c, &grid, grid.link + grid.offset[i], grid.value ? NULL : &sand);
    }
    cairo_surface_mark_dirty(c->surface);
    if (strcmp(c->field->name, "mesh") == 0)
        draw_edges(c, &grid, true, 0x9b7a48, 0.6);
    draw_edges(c, &grid, false, 0x6b4f2a, 1.4);
    grid_clear(&grid);
    grid_clear(&cells);
}

static void draw_grains(draw_canvas *c, int number) {
    draw_grid grid;
    if (!grid_read(&grid, c->out, "grains", number, NULL))
        return;
    for (int i = 0; i < grid.n_point; i++) {
        double r = silt_max(1.2, c->scale * (grid.radius ? grid.radius[i] : 0));
        cairo_arc(c->cr, draw_x(c, grid.x[3 * i]), draw_y(c, grid.x[3 * i + 1]), r, 0, 2 * M_PI);
        draw_ink(c->cr, 0xd9a441);
        cairo_fill_preserve(c->cr);
        draw_ink(c->cr, 0x5f4315);
        cairo_set_line_width(c->cr, silt_clamp(0.12 * r, 0.4, 1.2));
        cairo_stroke(c->cr);
    }
    grid_clear(&grid);
}

static void draw_bodies(draw_canvas *c, int number) {
    draw_grid grid;
    if (!grid_read(&grid, c->out, "bodies", number, NULL))
        return;
    for (int i = 0; i < grid.n_cell; i++) {
        for (int k = grid.offset[i]; k < grid.offset[i + 1]; k++) {
            const double *x = grid.x + 3 * grid.link[k];
            cairo_line_to(c->cr, draw_x(c, x[0]), draw_y(c, x[1]));
        }
        cairo_close_path(c->cr);
        draw_ink(c->cr, 0xb9b4ac);
        cairo_fill_preserve(c->cr);
        draw_ink(c->cr, 0x3a3733);
        cairo_set_line_width(c->cr, 1.6);
        cairo_stroke(c->cr);
    }
    grid_clear(&grid);
}

static void draw_walls(draw_canvas *c) {
    draw_ink(c->cr, 0x2b2b2b);
    cairo_set_line_width(c->cr, 3);
    cairo_set_line_join(c->cr, CAIRO_LINE_JOIN_MITER);
    for (int i = 0; i < c->scene->n_wall; i++) {
        const silt_wall *wall = &c->scene->wall[i];
        for (int k = 0; k < wall->n_point; k++)
            cairo_line_to(c->cr, draw_x(c, wall->point[3 * k]), draw_y(c, wall->point[3 * k + 1]));
        if (wall->closed)
            cairo_close_path(c->cr);
        cairo_stroke(c->cr);
    }
}

// ---------------------------------------------------------------- text

// align -1: x is the left end, 0: the middle, 1: the right end; y is the middle of the digits
static void draw_text(cairo_t *cr, double x, double y, int align, double size, bool bold, const char *text) {
    cairo_text_extents_t e;
    cairo_select_font_face(cr, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cr, size);
    cairo_text_extents(cr, text, &e);
    cairo_move_to(cr, x - 0.5 * (align + 1) * e.x_advance, y + 0.36 * size);
    cairo_show_text(cr, text);
}

// digits after the point that a step needs
static void draw_number(char text[32], double value, double step) {
    int digits = step < 1 ? (int)ceil(-log10(step) - 1e-9) : 0;
    if (fabs(value) < 1e-9 * step)
        value = 0;
    if (digits > 4 || fabs(value) >= 1e6)
        snprintf(text, 32, "%.3g", value);
    else
        snprintf(text, 32, "%.*f", digits, value);
}

static void draw_axes(draw_canvas *c) {
    cairo_t *cr = c->cr;
    double left = MARGIN_LEFT, bottom = MARGIN_TOP + c->height;
    char text[32];
    draw_ink(cr, 0x333333);
    cairo_set_line_width(cr, 1);
    cairo_rectangle(cr, left - 0.5, MARGIN_TOP - 0.5, c->width + 1, c->height + 1);
    cairo_stroke(cr);
    double step = draw_step(90 / c->scale);
    for (double x = step * ceil(c->lo[0] / step); x <= c->hi[0]; x += step) {
        double p = floor(draw_x(c, x)) + 0.5;
        cairo_move_to(cr, p, bottom);
        cairo_line_to(cr, p, bottom + 6);
        cairo_stroke(cr);
        draw_number(text, x, step);
        draw_text(cr, p, bottom + 18, 0, 14, false, text);
    }
    step = draw_step(48 / c->scale);
    for (double y = step * ceil(c->lo[1] / step); y <= c->hi[1]; y += step) {
        double p = floor(draw_y(c, y)) + 0.5;
        cairo_move_to(cr, left, p);
        cairo_line_to(cr, left - 6, p);
        cairo_stroke(cr);
        draw_number(text, y, step);
        draw_text(cr, left - 11, p, 1, 14, false, text);
    }
    draw_text(cr, left + 0.5 * c->width, bottom + 44, 0, 15, false, "x, m");
    cairo_save(cr);
    cairo_translate(cr, 20, MARGIN_TOP + 0.5 * c->height);
    cairo_rotate(cr, -M_PI / 2);
    draw_text(cr, 0, 0, 0, 15, false, "y, m");
    cairo_restore(cr);
}

static void draw_bar(draw_canvas *c) {
    if (!c->field->label)
        return;
    cairo_t *cr = c->cr;
    double x = MARGIN_LEFT + c->width + 26, width = 18, high = silt_min(c->height, 420);
    double y = MARGIN_TOP + 0.5 * (c->height - high);
    for (int i = 0; i < (int)high; i++) {
        draw_colour ink = draw_mix(c->field->map, c->field->n_map, 1 - (i + 0.5) / high);
        cairo_set_source_rgb(cr, ink.r, ink.g, ink.b);
        cairo_rectangle(cr, x, y + i, width, 1.5);
        cairo_fill(cr);
    }
    draw_ink(cr, 0x333333);
    cairo_set_line_width(cr, 1);
    cairo_rectangle(cr, x - 0.5, y - 0.5, width + 1, high + 1);
    cairo_stroke(cr);
    double span = c->high - c->low, step = draw_step(45 * span / high);
    for (double v = step * ceil(c->low / step - 1e-6); v <= c->high + 1e-6 * step; v += step) {
        char text[32];
        double p = floor(y + high * (1 - (v - c->low) / span)) + 0.5;
        cairo_move_to(cr, x + width, p);
        cairo_line_to(cr, x + width + 5, p);
        cairo_stroke(cr);
        draw_number(text, v, step);
        draw_text(cr, x + width + 9, p, -1, 14, false, text);
    }
    cairo_save(cr);
    cairo_translate(cr, MARGIN_LEFT + c->width + c->right - 16, MARGIN_TOP + 0.5 * c->height);
    cairo_rotate(cr, -M_PI / 2);
    draw_text(cr, 0, 0, 0, 15, false, c->field->label);
    cairo_restore(cr);
}

// ---------------------------------------------------------------- a picture

static silt_status draw_picture(draw_canvas *c, const silt_frame_entry *entry, const char *to, FILE *say,
                                silt_error *err) {
    char *path = silt_text("%s/picture_%06d.png", to, entry->number), *aside = silt_text("%s.part", path);
    silt_status status = SILT_OK;
    int width = MARGIN_LEFT + c->width + c->right, height = MARGIN_TOP + c->height + MARGIN_BOTTOM;
    c->surface = cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
    c->cr = cairo_create(c->surface);
    cairo_set_source_rgb(c->cr, 1, 1, 1);
    cairo_paint(c->cr);

    cairo_save(c->cr);
    cairo_rectangle(c->cr, MARGIN_LEFT, MARGIN_TOP, c->width, c->height);
    cairo_clip(c->cr);
    draw_water(c, entry->number);
    draw_bed(c, entry->number);
    draw_grains(c, entry->number);
    draw_bodies(c, entry->number);
    draw_walls(c);
    cairo_restore(c->cr);
    draw_axes(c);
    draw_bar(c);

    char time[64];
    snprintf(time, sizeof time, "t = %.4g s", entry->time);
    draw_ink(c->cr, 0x111111);
    draw_text(c->cr, MARGIN_LEFT + c->width, 32, 1, 18, false, time);
    if (c->scene->title) {
        // the title has the room that the time leaves
        cairo_rectangle(c->cr, 0, 0, MARGIN_LEFT + c->width - 150, MARGIN_TOP);
        cairo_clip(c->cr);
        draw_text(c->cr, MARGIN_LEFT, 32, -1, 18, true, c->scene->title);
    }
    cairo_destroy(c->cr);
    errno = 0;
    cairo_status_t written = cairo_surface_write_to_png(c->surface, aside);
    cairo_surface_destroy(c->surface);
    if (written != CAIRO_STATUS_SUCCESS || rename(aside, path) != 0)
        status = silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", path,
                           written ? cairo_status_to_string(written) : strerror(errno));
    else if (say)
        fprintf(say, "%s\n", path);
    free(aside);
    free(path);
    return status;
}

silt_status silt_draw(const char *out, int frame, const char *field, const char *to, FILE *say, silt_error *err) {
    enum { N_FIELD = sizeof draw_fields / sizeof draw_fields[0] };
    draw_canvas canvas = {.out = out};
    silt_frame_entry *entry = NULL;
    silt_scene *scene = NULL;
    silt_status status = SILT_OK;
    int n, drawn = 0;
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    for (int i = 0; i < N_FIELD; i++)
        if (!field || strcmp(field, draw_fields[i].name) == 0) {
            canvas.field = &draw_fields[i];
            break;
        }
    if (!canvas.field)
        return silt_fail(err, SILT_INPUT, "field %s is not known: mesh, pressure, speed, porosity or bed", field);

    char *path = silt_text("%s/scene.yaml", out);
    n = silt_frame_index(out, &entry);
    if (n == 0) {
        status = silt_fail(err, SILT_FAILED, "%s: has no frames", out);
        goto done;
    }
    status = silt_scene_read(path, 0, NULL, &scene, err);
    if (status)
        goto done;
    canvas.scene = scene;
    draw_survey(&canvas, entry, n);
    draw_layout(&canvas);
    for (int i = 0; i < n && !status; i++) {
        if (frame == -1 || (frame == -2 ? i == n - 1 : entry[i].number == frame)) {
            status = draw_picture(&canvas, &entry[i], to ? to : out, say, err);
            drawn++;
        }
    }
    if (!status && drawn == 0)
        status = silt_fail(err, SILT_INPUT, "%s: has no frame %d; its frames are %d to %d", out, frame, entry[0].number,
                           entry[n - 1].number);
done:
    silt_scene_free(&scene);
    free(entry);
    free(path);
    return status;
}

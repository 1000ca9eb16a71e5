// pictures in the plane: water, bed, grains, bodies and walls with axes

#include "draw.h"

// loose to dense sand
static const unsigned draw_sand[] = {0xf3e6c4, 0xe8d2a0, 0xd6b67a, 0xbb955c};

static double draw_x(const silt_draw_canvas *c, double x) {
    return MARGIN_LEFT + (x - c->lo[0]) * c->scale;
}
static double draw_y(const silt_draw_canvas *c, double y) {
    return MARGIN_TOP + c->height - (y - c->lo[1]) * c->scale;
}

static void draw_extend(double lo[2], double hi[2], double x, double y) {
    lo[0] = silt_min(lo[0], x), hi[0] = silt_max(hi[0], x);
    lo[1] = silt_min(lo[1], y), hi[1] = silt_max(hi[1], y);
}

// pixels per metre, aspect 1:1; a flat scene gets air above, a high and narrow one gets room at the sides
static void draw_layout(silt_draw_canvas *c) {
    double wide = c->hi[0] - c->lo[0], high = c->hi[1] - c->lo[1];
    c->right = c->plain ? MARGIN_RIGHT : MARGIN_BAR;
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

void silt_draw_flat_survey(silt_draw_canvas *c, const silt_frame_entry *entry, int n_frame) {
    double wall_lo[2] = {HUGE_VAL, HUGE_VAL}, wall_hi[2] = {-HUGE_VAL, -HUGE_VAL};
    double lo[2] = {HUGE_VAL, HUGE_VAL}, hi[2] = {-HUGE_VAL, -HUGE_VAL};
    for (int i = 0; i < c->scene->n_wall && !c->slice; i++)
        for (int k = 0; k < c->scene->wall[i].n_point; k++)
            draw_extend(wall_lo, wall_hi, c->scene->wall[i].point[3 * k], c->scene->wall[i].point[3 * k + 1]);
    double(*line)[4];
    const int n_line = c->slice ? silt_draw_lines(c, &line) : 0;
    for (int i = 0; i < n_line; i++)
        for (int k = 0; k < 4; k += 2)
            draw_extend(wall_lo, wall_hi, line[i][k], line[i][k + 1]);
    if (c->slice)
        free(line);
    c->low = HUGE_VAL, c->high = -HUGE_VAL;
    int samples = n_frame < DRAW_SAMPLES ? n_frame : DRAW_SAMPLES;
    for (int s = 0; s < samples; s++) {
        int number = entry[samples > 1 ? (int)((long)s * (n_frame - 1) / (samples - 1)) : 0].number;
        static const char *const part[] = {"fluid", "bed", "grains", "bodies"};
        for (int k = 0; k < 4; k++) {
            silt_grid grid;
            const char *array = k == 0 ? c->field->water : k == 1 ? c->field->bed : k == 2 ? silt_draw_grain_array(c) : NULL;
            if (!silt_draw_read(c, &grid, part[k], number, array))
                continue;
            if (k == 3 && c->slice) {
                double(*cut)[4];
                for (int i = silt_draw_slice_faces(c, &grid, &cut); i-- > 0;)
                    draw_extend(lo, hi, cut[i][0], cut[i][1]);
                free(cut);
                silt_grid_clear(&grid);
                continue;
            }
            bool *counts = silt_alloc((size_t)grid.n_point + 1, sizeof *counts);
            // water: nodes of triangles only, spray does not count
            for (int i = 0; i < grid.n_cell; i++) {
                if (k == 0 && silt_grid_corners(&grid, i) < 3)
                    continue;
                for (int j = grid.offset[i]; j < grid.offset[i + 1]; j++) {
                    const double *x = grid.x + 3 * grid.link[j];
                    // empty ground has no pressure
                    counts[grid.link[j]] = k != 1 || !grid.value || grid.value[grid.link[j]] >= 0;
                    double r = grid.radius ? grid.radius[grid.link[j]] : 0;
                    draw_extend(lo, hi, x[0] - r, x[1] - r);
                    draw_extend(lo, hi, x[0] + r, x[1] + r);
                }
            }
            silt_draw_range(c, &grid, counts);
            free(counts);
            silt_grid_clear(&grid);
            if (k == 1 && !c->slice && silt_grid_read(&grid, c->out, part[k], number, "CellData/density")) {
                for (int i = 0; i < grid.n_cell; i++)
                    c->density = silt_max(c->density, grid.value ? grid.value[i] : 0);
                silt_grid_clear(&grid);
            }
        }
    }
    // walls bound the plot sideways; upwards the water does, high empty tanks are cut
    if (wall_lo[0] <= wall_hi[0] && lo[0] <= hi[0]) {
        double room = 0.25 * (hi[1] - lo[1]);
        lo[0] = wall_lo[0], hi[0] = wall_hi[0], lo[1] = silt_min(wall_lo[1], lo[1]);
        // a floor alone bounds nothing from above; grains that lie on it reach into it
        hi[1] = silt_min(wall_hi[1] > lo[1] + 0.04 * room ? wall_hi[1] : HUGE_VAL, hi[1] + room);
    }
    if (!(lo[0] <= hi[0]))
        lo[0] = lo[1] = 0, hi[0] = hi[1] = 1;
    double margin = 0.02 * silt_max(hi[0] - lo[0], hi[1] - lo[1]);
    for (int d = 0; d < 2; d++) {
        c->lo[d] = lo[d] - (margin > 0 ? margin : 0.5);
        c->hi[d] = hi[d] + (margin > 0 ? margin : 0.5);
    }
    silt_draw_range_round(c);
    draw_layout(c);
}

// ---------------------------------------------------------------- triangles

// fills a triangle pixel by pixel: the value is interpolated, then coloured; below nought with `under`, if it is given
static void draw_triangle(silt_draw_canvas *c, const silt_grid *grid, const int node[3], const silt_draw_colour *flat,
                          const silt_draw_colour *under) {
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
            silt_draw_colour ink;
            if (flat) {
                ink = *flat;
            } else {
                double value = a * grid->value[node[0]] + b * grid->value[node[1]] + (1 - a - b) * grid->value[node[2]];
                ink = under && value < 0 ? *under : silt_draw_value(c, value);
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

int silt_draw_edges(const silt_grid *grid, bool all, int (**out)[2]) {
    int(*edge)[2] = silt_alloc(3 * (size_t)grid->n_cell + 1, sizeof *edge), n = 0, kept = 0;
    for (int i = 0; i < grid->n_cell; i++) {
        for (int k = 0; silt_grid_corners(grid, i) == 3 && k < 3; k++) {
            int a = grid->link[grid->offset[i] + k], b = grid->link[grid->offset[i] + (k + 1) % 3];
            edge[n][0] = a < b ? a : b;
            edge[n++][1] = a < b ? b : a;
        }
    }
    qsort(edge, (size_t)n, sizeof *edge, draw_edge_order);
    for (int i = 0, same; i < n; i += same) {
        for (same = 1; i + same < n && draw_edge_order(edge[i], edge[i + same]) == 0;)
            same++;
        if (same == 1 || all)
            memcpy(edge[kept++], edge[i], sizeof *edge);
    }
    *out = edge;
    return kept;
}

static void draw_edges(silt_draw_canvas *c, const silt_grid *grid, bool all, unsigned ink, double width) {
    int(*edge)[2];
    const int n = silt_draw_edges(grid, all, &edge);
    silt_draw_ink(c->cr, ink);
    cairo_set_line_width(c->cr, width);
    for (int i = 0; i < n; i++) {
        cairo_move_to(c->cr, draw_x(c, grid->x[3 * edge[i][0]]), draw_y(c, grid->x[3 * edge[i][0] + 1]));
        cairo_line_to(c->cr, draw_x(c, grid->x[3 * edge[i][1]]), draw_y(c, grid->x[3 * edge[i][1] + 1]));
        cairo_stroke(c->cr);
    }
    free(edge);
}

// ---------------------------------------------------------------- the parts

static void draw_water(silt_draw_canvas *c, int number) {
    static const silt_draw_colour plain = {0.72, 0.85, 0.93};
    silt_grid grid;
    if (!silt_draw_read(c, &grid, "fluid", number, c->field->water))
        return;
    bool mesh = strcmp(c->field->name, "mesh") == 0;
    cairo_surface_flush(c->surface);
    for (int i = 0; i < grid.n_cell; i++)
        if (silt_grid_corners(&grid, i) == 3)
            draw_triangle(c, &grid, grid.link + grid.offset[i], grid.value ? NULL : &plain, NULL);
    cairo_surface_mark_dirty(c->surface);
    if (mesh)
        draw_edges(c, &grid, true, 0x4f86ab, 0.6);
    draw_edges(c, &grid, false, 0x1d4e73, 1.2);
    // nodes that fly freely; those of dry walls, beds and bodies are no water
    silt_draw_ink(c->cr, 0x1d4e73);
    for (int i = 0; i < grid.n_cell; i++) {
        if (silt_grid_corners(&grid, i) != 1 || (grid.kind && grid.kind[grid.link[grid.offset[i]]] != NODE_FLUID))
            continue;
        const double *x = grid.x + 3 * grid.link[grid.offset[i]];
        cairo_arc(c->cr, draw_x(c, x[0]), draw_y(c, x[1]), 1.6, 0, 2 * M_PI);
        cairo_fill(c->cr);
    }
    silt_grid_clear(&grid);
}

static void draw_bed(silt_draw_canvas *c, int number) {
    silt_grid grid, cells;
    if (!silt_draw_read(c, &grid, "bed", number, c->field->bed))
        return;
    // a cut has other cells
    bool dense = silt_grid_read(&cells, c->out, "bed", number, "CellData/density") && cells.value && !c->slice;
    cairo_surface_flush(c->surface);
    for (int i = 0; i < grid.n_cell; i++) {
        double density = dense && c->density > 0 ? cells.value[i] / c->density : 1;
        // the upper half of the scale: even loose sand is sand
        silt_draw_colour sand = silt_draw_mix(draw_sand, sizeof draw_sand / sizeof *draw_sand, 2 * density - 1);
        draw_triangle(c, &grid, grid.link + grid.offset[i], grid.value ? NULL : &sand, &sand);
    }
    cairo_surface_mark_dirty(c->surface);
    if (strcmp(c->field->name, "mesh") == 0)
        draw_edges(c, &grid, true, 0x9b7a48, 0.6);
    draw_edges(c, &grid, false, 0x6b4f2a, 1.4);
    silt_grid_clear(&grid);
    silt_grid_clear(&cells);
}

static void draw_grains(silt_draw_canvas *c, int number) {
    silt_grid grid;
    if (!silt_draw_read(c, &grid, "grains", number, silt_draw_grain_array(c)))
        return;
    for (int i = 0; i < grid.n_point; i++) {
        const silt_draw_colour speed = grid.value ? silt_draw_value(c, grid.value[i]) : (silt_draw_colour){0};
        double r = silt_max(1.2, c->scale * (grid.radius ? grid.radius[i] : 0));
        cairo_arc(c->cr, draw_x(c, grid.x[3 * i]), draw_y(c, grid.x[3 * i + 1]), r, 0, 2 * M_PI);
        silt_draw_ink(c->cr, 0xd9a441);
        if (grid.value)
            cairo_set_source_rgb(c->cr, speed.r, speed.g, speed.b);
        cairo_fill_preserve(c->cr);
        silt_draw_ink(c->cr, 0x5f4315);
        cairo_set_line_width(c->cr, silt_clamp(0.12 * r, 0.4, 1.2));
        cairo_stroke(c->cr);
    }
    silt_grid_clear(&grid);
}

static const unsigned draw_stone = 0xb9b4ac, draw_stone_edge = 0x3a3733;

static int draw_rising(const void *a, const void *b) {
    const double *p = a, *q = b;
    return (*p > *q) - (*p < *q);
}

// fills what the lines of a cut enclose, row by row between every other crossing, then draws the lines
static void draw_cut_bodies(silt_draw_canvas *c, const silt_grid *grid) {
    double(*line)[4], *at = NULL;
    const int n = silt_draw_slice_faces(c, grid, &line);
    int capacity = 0;
    silt_draw_ink(c->cr, draw_stone);
    for (int y = MARGIN_TOP; y < MARGIN_TOP + c->height; y++) {
        int m = 0;
        for (int i = 0; i < n; i++) {
            const double p = draw_y(c, line[i][1]) - y - 0.5, q = draw_y(c, line[i][3]) - y - 0.5;
            if ((p < 0) == (q < 0))
                continue;
            SILT_RESERVE(at, capacity, m + 1);
            at[m++] = draw_x(c, line[i][0] + (line[i][2] - line[i][0]) * p / (p - q));
        }
        if (m > 0)
            qsort(at, (size_t)m, sizeof *at, draw_rising);
        for (int k = 0; k + 1 < m; k += 2)
            cairo_rectangle(c->cr, at[k], y, at[k + 1] - at[k], 1);
    }
    cairo_fill(c->cr);
    silt_draw_ink(c->cr, draw_stone_edge);
    cairo_set_line_width(c->cr, 1.6);
    for (int i = 0; i < n; i++) {
        cairo_move_to(c->cr, draw_x(c, line[i][0]), draw_y(c, line[i][1]));
        cairo_line_to(c->cr, draw_x(c, line[i][2]), draw_y(c, line[i][3]));
    }
    cairo_stroke(c->cr);
    free(line);
    free(at);
}

static void draw_bodies(silt_draw_canvas *c, const silt_frame_entry *entry) {
    silt_grid grid;
    if (!silt_draw_bodies(c, entry, &grid))
        return;
    if (c->slice)
        draw_cut_bodies(c, &grid);
    for (int i = 0; i < grid.n_cell && !c->slice; i++) {
        for (int k = grid.offset[i]; k < grid.offset[i + 1]; k++) {
            const double *x = grid.x + 3 * grid.link[k];
            cairo_line_to(c->cr, draw_x(c, x[0]), draw_y(c, x[1]));
        }
        cairo_close_path(c->cr);
        silt_draw_ink(c->cr, draw_stone);
        cairo_fill_preserve(c->cr);
        silt_draw_ink(c->cr, draw_stone_edge);
        cairo_set_line_width(c->cr, 1.6);
        cairo_stroke(c->cr);
    }
    silt_grid_clear(&grid);
}

static void draw_walls(silt_draw_canvas *c) {
    silt_draw_ink(c->cr, 0x2b2b2b);
    cairo_set_line_width(c->cr, 3);
    cairo_set_line_join(c->cr, CAIRO_LINE_JOIN_MITER);
    for (int i = 0; i < c->scene->n_wall && !c->slice && silt_draw_shows(c, DRAW_WALLS); i++) {
        const silt_wall *wall = &c->scene->wall[i];
        for (int k = 0; k < wall->n_point && wall->motion.n_row == 0; k++)
            cairo_line_to(c->cr, draw_x(c, wall->point[3 * k]), draw_y(c, wall->point[3 * k + 1]));
        if (wall->closed)
            cairo_close_path(c->cr);
        cairo_stroke(c->cr);
    }
    // those that move, or the cut ones
    double(*line)[4];
    const int n = silt_draw_lines(c, &line);
    cairo_set_line_cap(c->cr, CAIRO_LINE_CAP_ROUND);
    for (int i = 0; i < n; i++) {
        cairo_move_to(c->cr, draw_x(c, line[i][0]), draw_y(c, line[i][1]));
        cairo_line_to(c->cr, draw_x(c, line[i][2]), draw_y(c, line[i][3]));
        cairo_stroke(c->cr);
    }
    free(line);
}

// ---------------------------------------------------------------- axes

static void draw_axes(silt_draw_canvas *c) {
    cairo_t *cr = c->cr;
    double left = MARGIN_LEFT, bottom = MARGIN_TOP + c->height;
    char text[32];
    silt_draw_ink(cr, 0x333333);
    cairo_set_line_width(cr, 1);
    cairo_rectangle(cr, left - 0.5, MARGIN_TOP - 0.5, c->width + 1, c->height + 1);
    cairo_stroke(cr);
    double step = silt_draw_step(90 / c->scale);
    for (double x = step * ceil(c->lo[0] / step); x <= c->hi[0]; x += step) {
        double p = floor(draw_x(c, x)) + 0.5;
        cairo_move_to(cr, p, bottom);
        cairo_line_to(cr, p, bottom + 6);
        cairo_stroke(cr);
        silt_draw_number(text, x, step);
        silt_draw_text(cr, p, bottom + 18, 0, 14, false, text);
    }
    step = silt_draw_step(48 / c->scale);
    for (double y = step * ceil(c->lo[1] / step); y <= c->hi[1]; y += step) {
        double p = floor(draw_y(c, y)) + 0.5;
        cairo_move_to(cr, left, p);
        cairo_line_to(cr, left - 6, p);
        cairo_stroke(cr);
        silt_draw_number(text, y, step);
        silt_draw_text(cr, left - 11, p, 1, 14, false, text);
    }
    silt_draw_text(cr, left + 0.5 * c->width, bottom + 44, 0, 15, false, c->slice == 1 ? "y, m" : "x, m");
    cairo_save(cr);
    cairo_translate(cr, 20, MARGIN_TOP + 0.5 * c->height);
    cairo_rotate(cr, -M_PI / 2);
    silt_draw_text(cr, 0, 0, 0, 15, false, c->slice == 1 || c->slice == 2 ? "z, m" : "y, m");
    cairo_restore(cr);
}

void silt_draw_flat(silt_draw_canvas *c, const silt_frame_entry *entry) {
    cairo_save(c->cr);
    cairo_rectangle(c->cr, MARGIN_LEFT, MARGIN_TOP, c->width, c->height);
    cairo_clip(c->cr);
    draw_water(c, entry->number);
    draw_bed(c, entry->number);
    draw_grains(c, entry->number);
    draw_bodies(c, entry);
    draw_walls(c);
    cairo_restore(c->cr);
    draw_axes(c);
}

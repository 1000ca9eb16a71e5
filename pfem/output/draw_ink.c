// colours, texts, the colour bar and its range

#include "draw.h"

// ---------------------------------------------------------------- colours

silt_draw_colour silt_draw_hex(unsigned c) {
    return (silt_draw_colour){(c >> 16 & 255) / 255.0, (c >> 8 & 255) / 255.0, (c & 255) / 255.0};
}

silt_draw_colour silt_draw_mix(const unsigned *table, int n, double s) {
    s = (n - 1) * (s > 0 ? silt_min(s, 1) : 0);
    int i = s >= n - 1 ? n - 2 : (int)s;
    silt_draw_colour a = silt_draw_hex(table[i]), b = silt_draw_hex(table[i + 1]);
    s -= i;
    return (silt_draw_colour){a.r + s * (b.r - a.r), a.g + s * (b.g - a.g), a.b + s * (b.b - a.b)};
}

void silt_draw_ink(cairo_t *cr, unsigned c) {
    silt_draw_colour colour = silt_draw_hex(c);
    cairo_set_source_rgb(cr, colour.r, colour.g, colour.b);
}

silt_draw_colour silt_draw_value(const silt_draw_canvas *c, double value) {
    return silt_draw_mix(c->field->map, c->field->n_map, (value - c->low) / (c->high - c->low));
}

// ---------------------------------------------------------------- values

// 2-D: curl of the velocity at the points, mean of their cells by area
static void draw_vorticity(silt_grid *grid) {
    double *area = silt_alloc((size_t)grid->n_point + 1, sizeof *area),
           *curl = silt_alloc((size_t)grid->n_point + 1, sizeof *curl);
    for (int i = 0; i < grid->n_cell; i++) {
        const int *node = grid->link + grid->offset[i];
        double twice = 0, turn = 0;
        for (int k = 0; k < 3 && silt_grid_corners(grid, i) == 3; k++) {
            const double *a = grid->x + 3 * node[k], *b = grid->x + 3 * node[(k + 1) % 3];
            const double *v = grid->value + 3 * node[k], *w = grid->value + 3 * node[(k + 1) % 3];
            twice += a[0] * b[1] - a[1] * b[0];
            // circulation along the edge
            turn += 0.5 * ((v[0] + w[0]) * (b[0] - a[0]) + (v[1] + w[1]) * (b[1] - a[1]));
        }
        for (int k = 0; k < 3 && twice > 0; k++) {
            area[node[k]] += 0.5 * twice;
            curl[node[k]] += turn;
        }
    }
    for (int i = 0; i < grid->n_point; i++)
        grid->value[i] = area[i] > 0 ? curl[i] / area[i] : 0;
    free(area);
    free(curl);
}

const char *silt_draw_grain_array(const silt_draw_canvas *c) {
    return !c->scene->fluid.on && strcmp(c->field->name, "speed") == 0 ? c->field->water : NULL;
}

// the part of the picture that a file of a frame belongs to
static silt_draw_part draw_part(const char *part) {
    return strcmp(part, "bed") == 0      ? DRAW_BED
           : strcmp(part, "grains") == 0 ? DRAW_GRAINS
           : strcmp(part, "bodies") == 0 ? DRAW_BODIES
                                         : DRAW_WATER;
}

bool silt_draw_read(const silt_draw_canvas *c, silt_grid *grid, const char *part, int number, const char *array) {
    const silt_draw_part shown = draw_part(part);
    memset(grid, 0, sizeof *grid);
    if (!silt_draw_shows(c, shown) || !silt_grid_read(grid, c->out, part, number, array))
        return false;
    if (array && c->field->made == MADE_ELEVATION) {
        free(grid->value);
        grid->value = silt_alloc((size_t)grid->n_point + 1, sizeof *grid->value);
        for (int i = 0; i < grid->n_point; i++)
            grid->value[i] = grid->x[3 * i + (c->scene->dimension == 3 ? 2 : 1)];
    } else if (grid->width == 3 && c->field->made == MADE_VORTICITY && c->scene->dimension != 3) {
        draw_vorticity(grid);
    } else if (grid->width == 3) {
        for (int i = 0; i < grid->n_point; i++) {
            const double *v = grid->value + 3 * i;
            grid->value[i] = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        }
    }
    grid->width = grid->value ? 1 : 0;
    if (c->slice && shown == DRAW_GRAINS)
        silt_draw_slice_grains(c, grid);
    else if (c->slice && shown != DRAW_BODIES)
        silt_draw_slice(c, grid);
    return true;
}

static int draw_ascending(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void silt_draw_range(silt_draw_canvas *c, const silt_grid *grid, const bool *counts) {
    double *list = silt_alloc((size_t)grid->n_point + 1, sizeof *list);
    int n = 0;
    for (int i = 0; grid->value && i < grid->n_point; i++)
        if (counts[i])
            list[n++] = grid->value[i];
    qsort(list, (size_t)n, sizeof *list, draw_ascending);
    if (n > 0) {
        c->low = silt_min(c->low, list[(int)((1 - DRAW_QUANTILE) * (n - 1))]);
        c->high = silt_max(c->high, list[(int)(DRAW_QUANTILE * (n - 1))]);
    }
    free(list);
}

// speed and work begin at 0, the ends of the range are round
void silt_draw_range_round(silt_draw_canvas *c) {
    // what turns either way is shown with white in the middle
    if (c->field->made == MADE_VORTICITY && c->low < HUGE_VAL) {
        c->high = silt_max(fabs(c->low), fabs(c->high));
        c->low = -c->high;
    }
    c->plain = !c->field->label || !(c->low < HUGE_VAL);
    if (!(c->low < HUGE_VAL))
        c->low = 0, c->high = 1;
    if (c->low > 0 && c->low < 0.5 * c->high)
        c->low = 0;
    double step = silt_draw_step(silt_max(1e-300, (c->high - c->low) / 10));
    if (c->high - c->low > 1e-9 * fabs(c->high)) {
        c->low = step * floor(c->low / step + 1e-6);
        c->high = step * ceil(c->high / step - 1e-6);
    } else {
        c->low -= 0.5 * fabs(c->low);
        c->high = c->low + silt_max(fabs(c->high), 1);
    }
}

double silt_draw_step(double least) {
    double power = pow(10, floor(log10(least)));
    return power * (least <= power ? 1 : least <= 2 * power ? 2 : least <= 5 * power ? 5 : 10);
}

// ---------------------------------------------------------------- text

void silt_draw_text(cairo_t *cr, double x, double y, int align, double size, bool bold, const char *text) {
    cairo_text_extents_t e;
    cairo_select_font_face(cr, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cr, size);
    cairo_text_extents(cr, text, &e);
    cairo_move_to(cr, x - 0.5 * (align + 1) * e.x_advance, y + 0.36 * size);
    cairo_show_text(cr, text);
}

void silt_draw_number(char text[32], double value, double step) {
    int digits = step < 1 ? (int)ceil(-log10(step) - 1e-9) : 0;
    if (fabs(value) < 1e-9 * step)
        value = 0;
    if (digits > 4 || fabs(value) >= 1e6)
        snprintf(text, 32, "%.3g", value);
    else
        snprintf(text, 32, "%.*f", digits, value);
}

void silt_draw_bar(silt_draw_canvas *c) {
    if (c->plain)
        return;
    cairo_t *cr = c->cr;
    double x = MARGIN_LEFT + c->width + 26, width = 18, high = silt_min(c->height, 420);
    double y = MARGIN_TOP + 0.5 * (c->height - high);
    for (int i = 0; i < (int)high; i++) {
        silt_draw_colour ink = silt_draw_mix(c->field->map, c->field->n_map, 1 - (i + 0.5) / high);
        cairo_set_source_rgb(cr, ink.r, ink.g, ink.b);
        cairo_rectangle(cr, x, y + i, width, 1.5);
        cairo_fill(cr);
    }
    silt_draw_ink(cr, 0x333333);
    cairo_set_line_width(cr, 1);
    cairo_rectangle(cr, x - 0.5, y - 0.5, width + 1, high + 1);
    cairo_stroke(cr);
    double span = c->high - c->low, step = silt_draw_step(45 * span / high);
    for (double v = step * ceil(c->low / step - 1e-6); v <= c->high + 1e-6 * step; v += step) {
        char text[32];
        double p = floor(y + high * (1 - (v - c->low) / span)) + 0.5;
        cairo_move_to(cr, x + width, p);
        cairo_line_to(cr, x + width + 5, p);
        cairo_stroke(cr);
        silt_draw_number(text, v, step);
        silt_draw_text(cr, x + width + 9, p, -1, 14, false, text);
    }
    cairo_save(cr);
    cairo_translate(cr, MARGIN_LEFT + c->width + c->right - 16, MARGIN_TOP + 0.5 * c->height);
    cairo_rotate(cr, -M_PI / 2);
    silt_draw_text(cr, 0, 0, 0, 15, false, c->field->label);
    cairo_restore(cr);
}

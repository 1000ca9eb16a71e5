// plots as inline SVG: axes, lines and dots with a legend, the range that a check allows

#include "plot.h"

#include "draw.h"

// of the SVG and its margins, its own units; rows of the legend
enum { SVG_WIDTH = 560, SVG_HEIGHT = 300, SVG_LEFT = 74, SVG_RIGHT = 14, SVG_BOTTOM = 46, SVG_ROW = 17, SVG_LETTER = 7 };
#define PLOT_INKS 8
static const char *const plot_ink[PLOT_INKS] = {"#1f5f99", "#c8581f", "#3d8a4f", "#8a4fa3", "#b8960c", "#3aa1a8", "#9b2d4f", "#6b6b6b"};

/** the plot's place in the SVG */
typedef struct plot_frame {
    double lo[2], hi[2];     // of abscissa and ordinate
    double top, wide, high;  // of the field inside the axes
} plot_frame;

void silt_html_text(FILE *to, const char *text) {
    for (; text && *text; text++)
        switch (*text) {
        case '<':
            fputs("&lt;", to);
            break;
        case '>':
            fputs("&gt;", to);
            break;
        case '&':
            fputs("&amp;", to);
            break;
        case '"':
            fputs("&quot;", to);
            break;
        default:
            fputc(*text, to);
        }
}

static double plot_x(const plot_frame *f, double x) {
    return SVG_LEFT + f->wide * (x - f->lo[0]) / (f->hi[0] - f->lo[0]);
}
static double plot_y(const plot_frame *f, double y) {
    return f->top + f->high * (1 - (y - f->lo[1]) / (f->hi[1] - f->lo[1]));
}

static bool plot_shows(const silt_plot *plot, const silt_plot_line *line, int i) {
    return isfinite(line->x[i]) && isfinite(line->y[i]) &&
           (!plot->cropped || (line->x[i] >= plot->crop[0] && line->x[i] <= plot->crop[1]));
}

bool silt_plot_empty(const silt_plot *plot) {
    for (int k = 0; k < plot->n; k++)
        for (int i = 0; i < plot->line[k].n; i++)
            if (plot_shows(plot, &plot->line[k], i))
                return false;
    return true;
}

static void plot_widen(double *lo, double *hi, double value) {
    if (isfinite(value))
        *lo = silt_min(*lo, value), *hi = silt_max(*hi, value);
}

static void plot_range(const silt_plot *plot, plot_frame *f) {
    f->lo[0] = f->lo[1] = HUGE_VAL;
    f->hi[0] = f->hi[1] = -HUGE_VAL;
    for (int k = 0; k < plot->n; k++)
        for (int i = 0; i < plot->line[k].n; i++)
            if (plot_shows(plot, &plot->line[k], i)) {
                plot_widen(&f->lo[0], &f->hi[0], plot->line[k].x[i]);
                plot_widen(&f->lo[1], &f->hi[1], plot->line[k].y[i]);
            }
    for (int k = 0; k < 2 && plot->banded; k++) {
        plot_widen(&f->lo[1], &f->hi[1], plot->band[k]);
        if (plot->span[0] == plot->span[1])
            plot_widen(&f->lo[0], &f->hi[0], plot->span[k]);
    }
    for (int k = 0; k < 2; k++) {
        double room = f->hi[k] - f->lo[k];
        if (!(room > 1e-12 * silt_max(fabs(f->hi[k]), fabs(f->lo[k]))))
            room = f->hi[k] != 0 ? fabs(f->hi[k]) : 1;
        f->lo[k] -= (k ? 0.05 : 0) * room;
        f->hi[k] += (k ? 0.05 : 0) * room;
        if (!(f->hi[k] > f->lo[k]))
            f->hi[k] = f->lo[k] + room;
    }
}

// ---------------------------------------------------------------- the parts

// names in rows, as many in each as there is room for. @return rows; to NULL: only counts them
static int plot_legend(FILE *to, const silt_plot *plot, double top) {
    int rows = 1;
    double at = SVG_LEFT;
    for (int k = 0; k < plot->n; k++) {
        const double wide = 30 + SVG_LETTER * (double)strlen(plot->line[k].name);
        if (at > SVG_LEFT && at + wide > SVG_WIDTH - SVG_RIGHT)
            at = SVG_LEFT, rows++;
        if (to) {
            const double y = top + SVG_ROW * (rows - 0.5);
            if (plot->line[k].dots)
                fprintf(to, "<circle cx=\"%.0f\" cy=\"%.0f\" r=\"3\" fill=\"%s\"/>", at + 9, y, plot_ink[k % PLOT_INKS]);
            else
                fprintf(to, "<path d=\"M%.0f,%.0fh18\" stroke=\"%s\" stroke-width=\"2\"/>", at, y, plot_ink[k % PLOT_INKS]);
            fprintf(to, "<text x=\"%.0f\" y=\"%.0f\">", at + 22, y + 4);
            silt_html_text(to, plot->line[k].name);
            fputs("</text>\n", to);
        }
        at += wide + 8;
    }
    return rows;
}

static void plot_axes(FILE *to, const silt_plot *plot, const plot_frame *f) {
    char text[32];
    fputs("<g class=\"axis\">", to);
    double step = silt_draw_step((f->hi[0] - f->lo[0]) * 62 / f->wide);
    for (double v = step * ceil(f->lo[0] / step - 1e-9); v <= f->hi[0] + 1e-9 * step; v += step) {
        silt_draw_number(text, v, step);
        fprintf(to, "<path d=\"M%.1f,%.1fv%.1f\"/><text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%s</text>\n", plot_x(f, v),
                f->top + f->high, -f->high, plot_x(f, v), f->top + f->high + 16, text);
    }
    step = silt_draw_step((f->hi[1] - f->lo[1]) * 34 / f->high);
    for (double v = step * ceil(f->lo[1] / step - 1e-9); v <= f->hi[1] + 1e-9 * step; v += step) {
        silt_draw_number(text, v, step);
        fprintf(to, "<path d=\"M%d,%.1fh%.1f\"/><text x=\"%d\" y=\"%.1f\" text-anchor=\"end\">%s</text>\n", SVG_LEFT, plot_y(f, v),
                f->wide, SVG_LEFT - 6, plot_y(f, v) + 4, text);
    }
    fprintf(to, "</g><rect x=\"%d\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" class=\"field\"/>\n", SVG_LEFT, f->top, f->wide, f->high);
    if (plot->across) {
        fprintf(to, "<text x=\"%.1f\" y=\"%d\" text-anchor=\"middle\">", SVG_LEFT + 0.5 * f->wide, SVG_HEIGHT - 8);
        silt_html_text(to, plot->across);
        fputs("</text>\n", to);
    }
    if (plot->up) {
        fprintf(to, "<text transform=\"translate(13,%.1f) rotate(-90)\" text-anchor=\"middle\">", f->top + 0.5 * f->high);
        silt_html_text(to, plot->up);
        fputs("</text>\n", to);
    }
}

// what a check allows: a stripe, a line where only one value is right, a mark where it is one place
static void plot_band(FILE *to, const silt_plot *plot, const plot_frame *f) {
    const double x0 = silt_clamp(plot->span[0], f->lo[0], f->hi[0]), x1 = silt_clamp(plot->span[1], f->lo[0], f->hi[0]);
    const double y0 = silt_clamp(plot->band[0], f->lo[1], f->hi[1]), y1 = silt_clamp(plot->band[1], f->lo[1], f->hi[1]);
    if (plot->span[0] == plot->span[1])
        fprintf(to, "<path d=\"M%.1f,%.1fV%.1f\" class=\"wanted\"/>\n", plot_x(f, x0), plot_y(f, y0) + 7, plot_y(f, y1) - 7);
    else if (plot->band[0] == plot->band[1])
        fprintf(to, "<path d=\"M%.1f,%.1fH%.1f\" class=\"wanted\"/>\n", plot_x(f, x0), plot_y(f, y0), plot_x(f, x1));
    else
        fprintf(to, "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" class=\"allowed\"/>\n", plot_x(f, x0), plot_y(f, y1),
                plot_x(f, x1) - plot_x(f, x0), plot_y(f, y0) - plot_y(f, y1));
}

static void plot_dots(FILE *to, const silt_plot *plot, const silt_plot_line *line, const plot_frame *f, const char *ink) {
    fprintf(to, "<g fill=\"%s\">", ink);
    for (int i = 0; i < line->n; i++)
        if (plot_shows(plot, line, i))
            fprintf(to, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"2.6\"/>", plot_x(f, line->x[i]), plot_y(f, line->y[i]));
    fputs("</g>\n", to);
}

/** points of a line that fall into one column of the picture: the first, the extremes and the last of them are drawn */
typedef struct plot_column {
    long column;
    double first, least, most, last;
} plot_column;

static void plot_column_end(FILE *to, const plot_column *c, bool *pen) {
    const double y[4] = {c->first, c->least, c->most, c->last};
    for (int k = 0; k < 4; k++)
        if (k == 0 || y[k] != y[k - 1]) {
            fprintf(to, "%c%.1f,%.1f", *pen ? 'L' : 'M', (double)c->column, y[k]);
            *pen = true;
        }
}

static void plot_curve(FILE *to, const silt_plot *plot, const silt_plot_line *line, const plot_frame *f, const char *ink) {
    bool pen = false, open = false;
    plot_column c = {0};
    fprintf(to, "<path fill=\"none\" stroke=\"%s\" stroke-width=\"1.6\" stroke-linejoin=\"round\" d=\"", ink);
    for (int i = 0; i <= line->n; i++) {
        const bool there = i < line->n && plot_shows(plot, line, i);
        const long column = there ? lround(plot_x(f, line->x[i])) : 0;
        const double y = there ? plot_y(f, line->y[i]) : 0;
        if (open && (!there || column != c.column)) {
            plot_column_end(to, &c, &pen);
            open = false;
        }
        if (!there) {
            pen = false;
            continue;
        }
        if (!open)
            c = (plot_column){column, y, y, y, y};
        c.least = silt_min(c.least, y);
        c.most = silt_max(c.most, y);
        c.last = y;
        open = true;
    }
    fputs("\"/>\n", to);
}

void silt_plot_svg(FILE *to, const silt_plot *plot) {
    plot_frame f;
    const int rows = plot_legend(NULL, plot, 0);
    plot_range(plot, &f);
    f.top = 24 + SVG_ROW * rows + 8;
    f.wide = SVG_WIDTH - SVG_LEFT - SVG_RIGHT;
    f.high = SVG_HEIGHT - SVG_BOTTOM - f.top;
    fprintf(to, "<svg class=\"plot\" viewBox=\"0 0 %d %d\" role=\"img\"><text x=\"%d\" y=\"16\" class=\"title\">", SVG_WIDTH, SVG_HEIGHT,
            SVG_LEFT);
    silt_html_text(to, plot->title);
    fputs("</text>\n", to);
    plot_legend(to, plot, 24);
    plot_axes(to, plot, &f);
    if (plot->banded)
        plot_band(to, plot, &f);
    for (int k = 0; k < plot->n; k++)
        (plot->line[k].dots ? plot_dots : plot_curve)(to, plot, &plot->line[k], &f, plot_ink[k % PLOT_INKS]);
    fputs("</svg>\n", to);
}

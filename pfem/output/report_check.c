// the report's checks: a table, then each with what it is held against drawn over the result

#include "report.h"

#include "verify.h"

/** what the checks' plots need besides their curves */
typedef struct check_plots {
    const silt_report_page *report;
    char *text; // owned, the plots; they come before their results are known
    size_t size;
    FILE *to;
} check_plots;

static bool check_ranged(const silt_check_def *def) {
    return !isnan(def->low) || !isnan(def->high);
}

// the stripe, line or mark of a scalar check: where and what it allows. @param end  of the result
static void check_band(const silt_check_def *def, double end, silt_plot *plot) {
    const bool ranged = check_ranged(def);
    const double room = def->tolerance * (def->value != 0 ? fabs(def->value) : 1);
    double low = ranged ? def->low : def->value - room, high = ranged ? def->high : def->value + room;
    low = isnan(low) ? -HUGE_VAL : low;
    high = isnan(high) ? HUGE_VAL : high;
    memcpy(plot->span, def->window, sizeof plot->span);
    switch (def->scalar) {
    case SCALAR_REACHES:
        // the range is one of the abscissa: it stands on the level
        plot->banded = true;
        plot->span[0] = low, plot->span[1] = high;
        plot->band[0] = plot->band[1] = def->level;
        return;
    case SCALAR_AT:
        plot->span[0] = plot->span[1] = def->at;
        break;
    case SCALAR_LAST:
        plot->span[0] = plot->span[1] = silt_min(end, def->window[1]);
        break;
    case SCALAR_MAX:
    case SCALAR_MIN:
    case SCALAR_MEAN:
        break;
    default:
        return; // a period, an amplitude, a slope: no ordinate
    }
    plot->banded = true;
    plot->band[0] = low, plot->band[1] = high;
}

// the abscissas that a check looks at, with some room
static void check_crop(const silt_check_def *def, const silt_curve *result, const silt_curve *reference, silt_plot *plot) {
    double lo = HUGE_VAL, hi = -HUGE_VAL;
    for (int i = 0; reference && i < reference->n; i++)
        if (reference->x[i] >= def->window[0] && reference->x[i] <= def->window[1])
            lo = silt_min(lo, reference->x[i]), hi = silt_max(hi, reference->x[i]);
    if (!(lo < hi) && result->n > 0) {
        lo = silt_max(def->window[0], result->x[0]);
        hi = silt_min(def->window[1], result->x[result->n - 1]);
    }
    if (!(lo < hi))
        return;
    plot->cropped = true;
    plot->crop[0] = lo - 0.1 * (hi - lo);
    plot->crop[1] = hi + 0.1 * (hi - lo);
}

static bool check_equal(double a, double b) {
    return a == b || (isnan(a) && isnan(b));
}

// two scalar checks that make the same picture
static bool check_same(const silt_check_def *a, const silt_check_def *b) {
    silt_plot p = {0}, q = {0};
    if (a->kind == CHECK_PROFILE || b->kind == CHECK_PROFILE || a->reference || b->reference || strcmp(a->column, b->column) != 0 ||
        a->time_scale != b->time_scale || a->time_shift != b->time_shift || a->scale != b->scale || a->shift != b->shift ||
        (a->scalar == SCALAR_REACHES) != (b->scalar == SCALAR_REACHES))
        return false;
    check_band(a, 0, &p);
    check_band(b, 0, &q);
    bool same = p.banded == q.banded;
    for (int k = 0; k < 2; k++)
        same &= a->window[k] == b->window[k] && check_equal(p.band[k], q.band[k]) && check_equal(p.span[k], q.span[k]);
    return same;
}

// the names of all checks that share a check's picture; NULL: an earlier one has drawn it. Owned by the caller
static char *check_title(const silt_scene *scene, int check) {
    char *title = silt_text("%s", scene->check[check].name);
    for (int k = 0; k < scene->n_check; k++) {
        if (k == check || !check_same(&scene->check[k], &scene->check[check]))
            continue;
        char *longer = k < check ? NULL : silt_text("%s, %s", title, scene->check[k].name);
        free(title);
        title = longer;
        if (!title)
            break;
    }
    return title;
}

static void check_see(void *self, int check, const silt_curve *result, const silt_curve *reference) {
    check_plots *plots = self;
    const silt_check_def *def = &plots->report->scene->check[check];
    const bool profile = def->kind == CHECK_PROFILE;
    char *title = check_title(plots->report->scene, check);
    if (!title)
        return;
    const bool plain = def->time_scale == 1 && def->time_shift == 0;
    silt_plot plot = {.title = title, .across = profile ? "place" : plain ? "time, s" : def->x ? def->x : "time, scaled"};
    plot.up = reference && def->y ? def->y : NULL;
    plot.line[plot.n++] = (silt_plot_line){profile ? "silt" : def->column, result->n, result->x, result->y, false};
    if (reference)
        plot.line[plot.n++] = (silt_plot_line){"reference", reference->n, reference->x, reference->y, true};
    else
        check_band(def, result->n ? result->x[result->n - 1] : 0, &plot);
    check_crop(def, result, reference, &plot);
    if (!silt_plot_empty(&plot))
        silt_plot_svg(plots->to, &plot);
    free(title);
}

static void check_number(FILE *to, double value) {
    if (isnan(value))
        fputs("<td class=\"number\">-</td>", to);
    else
        fprintf(to, "<td class=\"number\">%.5g</td>", value);
}

// the lines that begin the references, which tell where they come from, each file once
static void check_sources(const silt_report_page *report) {
    const silt_scene *scene = report->scene;
    for (int i = 0; i < scene->n_check; i++) {
        const char *path = scene->check[i].reference;
        bool told = !path;
        for (int k = 0; k < i && !told; k++)
            told = scene->check[k].reference && strcmp(scene->check[k].reference, path) == 0;
        if (told)
            continue;
        char *full = *path == '/' || !scene->folder || !*scene->folder ? silt_text("%s", path) : silt_text("%s/%s", scene->folder, path);
        FILE *from = fopen(full, "r");
        char *line = NULL;
        size_t capacity = 0;
        bool any = false;
        while (from && getline(&line, &capacity, from) > 0 && *line == '#') {
            if (!any) {
                fputs("<p class=\"note\">", report->to);
                silt_html_text(report->to, strrchr(path, '/') ? strrchr(path, '/') + 1 : path);
                fputc(':', report->to);
            }
            any = true;
            silt_html_text(report->to, line + 1);
        }
        if (any)
            fputs("</p>\n", report->to);
        if (from)
            fclose(from);
        free(line);
        free(full);
    }
}

void silt_report_checks(const silt_report_page *report) {
    const silt_scene *scene = report->scene;
    FILE *to = report->to;
    if (scene->n_check == 0)
        return;
    check_plots plots = {.report = report};
    plots.to = open_memstream(&plots.text, &plots.size);
    silt_check_result *result = silt_alloc((size_t)scene->n_check, sizeof *result);
    const silt_check_watch watch = {check_see, &plots};
    silt_check_measure_seen(scene, report->out, result, &watch, NULL);
    fclose(plots.to);
    int passed = 0;
    for (int i = 0; i < scene->n_check; i++)
        passed += result[i].pass;
    fprintf(to, "<section id=\"checks\"><h2>Checks: %d of %d pass</h2>\n<table class=\"checks\"><tr><th>check</th><th class=\"number\">value</th>"
                "<th class=\"number\">reference</th><th class=\"number\">error</th><th class=\"number\">tolerance</th><th></th><th>held against</th></tr>\n", passed, scene->n_check);
    for (int i = 0; i < scene->n_check; i++) {
        const silt_check_result *r = &result[i];
        fputs("<tr><td>", to);
        silt_html_text(to, r->name);
        fputs("</td>", to);
        check_number(to, r->value);
        // a range has neither, the note tells it
        check_number(to, check_ranged(&scene->check[i]) ? NAN : r->reference);
        check_number(to, r->error);
        check_number(to, check_ranged(&scene->check[i]) ? NAN : r->tolerance);
        fprintf(to, "<td class=\"%s\">%s</td><td class=\"note\">", r->pass ? "pass" : "fail", r->pass ? "pass" : "FAIL");
        if (scene->check[i].reference) {
            const char *plain = strrchr(scene->check[i].reference, '/');
            silt_html_text(to, plain ? plain + 1 : scene->check[i].reference);
            fputs(*r->note ? ": " : "", to);
        }
        silt_html_text(to, r->note);
        fputs("</td></tr>\n", to);
    }
    fputs("</table>\n<p class=\"note\">Green: what a check allows, in its window. Dots: the reference.</p>\n<div class=\"plots\">\n", to);
    fputs(plots.text, to);
    fputs("</div>\n", to);
    check_sources(report);
    fputs("</section>\n", to);
    free(plots.text);
    free(result);
}

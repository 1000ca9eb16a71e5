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

// the stripe, line or mark of a scalar check: where and what it allows
static void check_band(const silt_check_def *def, silt_plot *plot) {
    const bool ranged = !isnan(def->low) || !isnan(def->high);
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
    case SCALAR_MAX:
    case SCALAR_MIN:
    case SCALAR_LAST:
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

static void check_see(void *self, int check, const silt_curve *result, const silt_curve *reference) {
    check_plots *plots = self;
    const silt_check_def *def = &plots->report->scene->check[check];
    const bool profile = def->kind == CHECK_PROFILE;
    char *here = silt_text("%s", profile ? "silt" : def->column);
    const bool plain = def->time_scale == 1 && def->time_shift == 0;
    silt_plot plot = {.title = def->name, .across = profile ? "place" : plain ? "time, s" : def->x ? def->x : "time, scaled"};
    plot.up = reference && def->y ? def->y : NULL;
    plot.line[plot.n++] = (silt_plot_line){here, result->n, result->x, result->y, false};
    if (reference)
        plot.line[plot.n++] = (silt_plot_line){"reference", reference->n, reference->x, reference->y, true};
    else
        check_band(def, &plot);
    check_crop(def, result, reference, &plot);
    if (!silt_plot_empty(&plot))
        silt_plot_svg(plots->to, &plot);
    free(here);
}

static void check_number(FILE *to, double value) {
    if (isnan(value))
        fputs("<td class=\"number\">-</td>", to);
    else
        fprintf(to, "<td class=\"number\">%.5g</td>", value);
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
    fprintf(to, "<section id=\"checks\"><h2>Checks: %d of %d pass</h2>\n<table class=\"checks\"><tr><th>check</th><th>value</th>"
                "<th>reference</th><th>error</th><th>tolerance</th><th></th><th>held against</th></tr>\n", passed, scene->n_check);
    for (int i = 0; i < scene->n_check; i++) {
        const silt_check_result *r = &result[i];
        fputs("<tr><td>", to);
        silt_html_text(to, r->name);
        fputs("</td>", to);
        check_number(to, r->value);
        check_number(to, r->reference);
        check_number(to, r->error);
        check_number(to, r->tolerance);
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
    fputs("</div></section>\n", to);
    free(plots.text);
    free(result);
}

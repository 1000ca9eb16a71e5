// the report: one HTML page on a run, with everything in it

#include "report.h"

#include <errno.h>
#include <time.h>
#include <unistd.h>

void silt_report_base64(FILE *to, const void *data, size_t n) {
    static const char letter[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const uint8_t *from = data;
    for (size_t i = 0; i < n; i += 3) {
        const size_t left = n - i;
        const unsigned bits = (unsigned)from[i] << 16 | (left > 1 ? (unsigned)from[i + 1] << 8 : 0) | (left > 2 ? from[i + 2] : 0);
        fputc(letter[bits >> 18], to);
        fputc(letter[bits >> 12 & 63], to);
        fputc(left > 1 ? letter[bits >> 6 & 63] : '=', to);
        fputc(left > 2 ? letter[bits & 63] : '=', to);
    }
}

// ---------------------------------------------------------------- head

static void report_row(FILE *to, const char *name, const char *format, ...) __attribute__((format(printf, 3, 4)));
static void report_row(FILE *to, const char *name, const char *format, ...) {
    char text[1024];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    fprintf(to, "<tr><th>%s</th><td>", name);
    silt_html_text(to, text);
    fputs("</td></tr>\n", to);
}

// the ledgers against the scene's bounds; of a run that goes on, so far
static void report_bounds(const silt_report_page *r) {
    silt_bounds b;
    if (!silt_bounds_measure(r->scene, r->out, &b))
        return;
    char energy[64] = "";
    if (!isnan(b.of[BOUND_ENERGY].worst))
        snprintf(energy, sizeof energy, "; energy gained %.2g %%", 100 * b.of[BOUND_ENERGY].worst);
    if (r->scene->fluid.on)
        report_row(r->to, "worst of the ledger", "volume off by %.2g %%, of which lost or gained %.2g %%%s", 100 * b.of[BOUND_VOLUME].worst,
                   100 * b.of[BOUND_MASS].worst, energy);
    for (silt_bound_kind k = 0; k < BOUND_COUNT; k++) {
        char text[256];
        double allowed;
        if (!silt_bounds_broken(&b, r->scene, k, &allowed, text))
            continue;
        fputs("<tr><th class=\"fail\">beyond its bounds</th><td>", r->to);
        silt_html_text(r->to, text);
        fputs("</td></tr>\n", r->to);
    }
}

// what ran, how it ended and on what, from summary.json; a run that goes on has none
static void report_run(const silt_report_page *r, const silt_table *table, const silt_draw_book *book) {
    struct fy_document *summary = silt_summary_open(r->out);
    const double *time = silt_table_column(table, "time"), *n_node = silt_table_column(table, "n_node");
    const int last = table->n_row - 1;
    const char *message = silt_summary_text(summary, "/message"), *processor = silt_summary_text(summary, "/machine/processor");
    if (summary)
        fprintf(r->to, "<p class=\"status\"><span class=\"%s\">%s</span>", strcmp(silt_summary_text(summary, "/status"), "done") ? "fail" : "pass",
                silt_summary_text(summary, "/status"));
    else
        fputs("<p class=\"status\">no summary: it is running or was killed", r->to);
    if (*message) {
        fputs(": ", r->to);
        silt_html_text(r->to, message);
    }
    fputs("</p>\n<table>\n", r->to);
    if (last >= 0)
        report_row(r->to, "reached", "%.6g of %.6g s in %.0f steps, %d frames", time ? time[last] : 0, r->scene->time.end,
                   table->value[0][last], book->n_frame);
    if (n_node && last >= 0) {
        double least = n_node[0], most = n_node[0];
        for (int i = 1; i <= last; i++)
            least = silt_min(least, n_node[i]), most = silt_max(most, n_node[i]);
        report_row(r->to, "nodes of the water", "%.0f to %.0f", least, most);
    }
    if (summary) {
        report_row(r->to, "took", "%.4g s of the clock, %.0f MB at the most", silt_summary_number(summary, "/seconds"),
                   silt_summary_number(summary, "/peak_memory_bytes") / 1e6);
        report_row(r->to, "sediment, momentum", "not closed by %.2g, %.2g at the most", silt_summary_number(summary, "/worst_sediment_error"),
                   silt_summary_number(summary, "/worst_momentum_error"));
    }
    report_bounds(r);
    if (*processor)
        report_row(r->to, "machine", "%s, %.0f processors, threads used: %.0f, %s", processor, silt_summary_number(summary, "/machine/processors"),
                   silt_summary_number(summary, "/machine/threads"), silt_summary_text(summary, "/machine/system"));
    if (*silt_summary_text(summary, "/ended"))
        report_row(r->to, "ended", "%s", silt_summary_text(summary, "/ended"));
    if (summary)
        report_row(r->to, "program", "silt %s; scene %s", silt_summary_text(summary, "/version"), silt_summary_text(summary, "/scene_hash"));
    fputs("</table>\n", r->to);
    silt_summary_close(summary);
}

// ---------------------------------------------------------------- pictures and scene

/** bytes of a picture as they come */
typedef struct report_png {
    int n, capacity;
    uint8_t *data; // owned
} report_png;

static cairo_status_t report_png_add(void *self, const unsigned char *data, unsigned n) {
    report_png *png = self;
    SILT_RESERVE(png->data, png->capacity, png->n + (int)n);
    memcpy(png->data + png->n, data, n);
    png->n += (int)n;
    return CAIRO_STATUS_SUCCESS;
}

static void report_picture(const silt_report_page *r, silt_draw_canvas *canvas, const silt_frame_entry *entry) {
    report_png png = {0};
    cairo_surface_t *surface = silt_draw_picture(canvas, entry);
    if (cairo_surface_write_to_png_stream(surface, report_png_add, &png) == CAIRO_STATUS_SUCCESS) {
        fprintf(r->to, "<figure><img alt=\"t = %.4g s\" src=\"data:image/png;base64,", entry->time);
        silt_report_base64(r->to, png.data, (size_t)png.n);
        fputs("\"></figure>\n", r->to);
    }
    cairo_surface_destroy(surface);
    free(png.data);
}

// the first, the last and two between; with a cut that, too
static void report_pictures(const silt_report_page *r, silt_draw_canvas *canvas, silt_draw_canvas *cut, const silt_draw_book *book) {
    enum { N_PICTURE = 4 };
    const int n = (int)silt_min(N_PICTURE, book->n_frame);
    fputs("<section id=\"pictures\"><h2>Pictures</h2>\n<div class=\"pictures\">\n", r->to);
    for (int k = 0; k < n; k++) {
        const silt_frame_entry *entry = &book->entry[n > 1 ? k * (book->n_frame - 1) / (n - 1) : 0];
        report_picture(r, canvas, entry);
        if (cut)
            report_picture(r, cut, entry);
    }
    fputs("</div></section>\n", r->to);
}

static void report_scene(const silt_report_page *r) {
    char *text = NULL;
    size_t size;
    FILE *to = open_memstream(&text, &size);
    silt_info_scene(r->scene, to);
    fclose(to);
    fputs("<section id=\"scene\"><h2>Scene</h2>\n<pre>", r->to);
    silt_html_text(r->to, text);
    fputs("</pre>\n<details><summary>The whole scene, with every default: it runs again to the same result</summary>\n<pre>", r->to);
    silt_html_text(r->to, r->scene->resolved);
    fputs("</pre></details></section>\n", r->to);
    free(text);
}

// ---------------------------------------------------------------- the page

static const char *report_write(const silt_report_page *r, silt_draw_canvas *canvas, silt_draw_canvas *cut, const silt_draw_book *book) {
    const char *title = r->scene->title && *r->scene->title ? r->scene->title : "untitled";
    silt_table table;
    silt_table_read(&table, r->out);
    fputs("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\n<title>", r->to);
    silt_html_text(r->to, title);
    fprintf(r->to, "</title>\n<style>\n%s</style></head>\n<body>\n<h1>", silt_report_css);
    silt_html_text(r->to, title);
    fputs("</h1>\n", r->to);
    report_run(r, &table, book);
    const char *lack = silt_report_view(r, canvas, book);
    if (lack)
        fprintf(r->to, "<p class=\"note\">%s</p>\n", lack);
    report_pictures(r, canvas, cut, book);
    silt_report_checks(r);
    silt_report_gauges(r, &table);
    silt_report_ledgers(r, &table);
    silt_report_times(r, &table);
    report_scene(r);
    fputs("</body></html>\n", r->to);
    silt_table_clear(&table);
    return lack;
}

silt_status silt_report(const char *out, const silt_report_def *def, FILE *say, silt_error *err) {
    silt_draw_canvas canvas, cut;
    silt_draw_book book = {0}, cut_book = {0};
    silt_draw_def draw = def->draw;
    char *path = def->path ? silt_text("%s", def->path) : silt_text("%s/report.html", out), *aside = silt_text("%s.part", path);
    draw.slice = NULL;
    silt_status status = silt_draw_open(&canvas, &book, out, &draw, err);
    if (!status && def->draw.slice)
        status = silt_draw_open(&cut, &cut_book, out, &def->draw, err);
    FILE *to = status ? NULL : fopen(aside, "w");
    if (!status && !to)
        status = silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", path, strerror(errno));
    if (to) {
        const silt_report_page report = {to, out, book.scene, 1e6 * (def->megabytes > 0 ? def->megabytes : REPORT_MEGABYTES)};
        const char *lack = report_write(&report, &canvas, def->draw.slice ? &cut : NULL, &book);
        const bool whole = fflush(to) == 0 && !ferror(to);
        const long size = ftell(to);
        errno = whole ? 0 : errno;
        if (fclose(to) != 0 || !whole || rename(aside, path) != 0) {
            status = silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", path, strerror(errno));
            unlink(aside);
        } else if (say)
            fprintf(say, "%s%s%s (%.1f MB)\n", lack ? lack : "", lack ? "\n" : "", path, (double)size / 1e6);
    }
    silt_draw_close(&book);
    silt_draw_close(&cut_book);
    free(path);
    free(aside);
    return status;
}

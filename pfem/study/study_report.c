// study.md: what came of the runs in words and characters
#include <ctype.h>
#include <errno.h>

#include "study.h"

#define MOST_ROWS 60

static const char *const report_mark[RUN_STATUS_COUNT] = {
    "ok", "cut", "warned", "beyond", "refused", "**failed**", "**unfinished**", "**hung**", "**crashed**", "**wrong**"};

static void report_cell(FILE *to, const char *text) {
    for (; text && *text; text++)
        fprintf(to, *text == '|' ? "\\|" : "%c", *text);
}

// ---------------------------------------------------------------- counts

static void report_counts(FILE *to, const study_table *table, int wanted) {
    int count[RUN_STATUS_COUNT] = {0};
    double cpu = 0, volume = 0, energy = -HUGE_VAL;
    const char *between = "";
    for (int i = 0; i < table->n; i++) {
        const study_row *row = &table->row[i];
        const double seconds = study_row_number(row, "cpu_seconds"), v = study_row_number(row, "volume_error"),
                     e = study_row_number(row, "energy_excess");
        count[study_row_status(row)]++;
        cpu += isnan(seconds) ? 0 : seconds;
        if (study_row_status(row) > RUN_WARNED)
            continue;
        volume = v > volume ? v : volume;
        energy = e > energy ? e : energy;
    }
    fprintf(to, "%d runs", table->n);
    if (wanted > table->n)
        fprintf(to, " of %d", wanted);
    fprintf(to, ": ");
    for (int k = 0; k < RUN_STATUS_COUNT; k++)
        if (count[k]) {
            fprintf(to, "%s%d %s", between, count[k], study_status_word[k]);
            between = ", ";
        }
    fprintf(to, "; %.3g s of processor. ", cpu);
    if (count[RUN_OK] + count[RUN_CUT]) {
        fprintf(to, "Of those that ended within their bounds: largest volume error %.2g", volume);
        if (isfinite(energy))
            fprintf(to, ", largest energy excess %.2g", energy);
        fprintf(to, ".");
    }
    fputc('\n', to);
}

// ---------------------------------------------------------------- maps

// what came of the runs with these two values; the worst of several
static const char *map_mark(const study *s, const study_table *table, int a, int x, int b, int y) {
    int worst = -1;
    for (int i = 0; i < table->n; i++) {
        const char *p = study_row_text(&table->row[i], s->range[a].key),
                   *q = study_row_text(&table->row[i], s->range[b].key);
        if (p && q && strcmp(p, s->range[a].text[x]) == 0 && strcmp(q, s->range[b].text[y]) == 0) {
            const int status = (int)study_row_status(&table->row[i]);
            worst = status > worst ? status : worst;
        }
    }
    return worst < 0 ? "" : report_mark[worst];
}

static void report_map(FILE *to, const study *s, const study_table *table, int a, int b) {
    fprintf(to, "\n| %s \\\\ %s |", s->range[b].key, s->range[a].key);
    for (int x = 0; x < s->range[a].n_text; x++)
        fprintf(to, " %s |", s->range[a].text[x]);
    fprintf(to, "\n|---|");
    for (int x = 0; x < s->range[a].n_text; x++)
        fprintf(to, "---|");
    fputc('\n', to);
    for (int y = 0; y < s->range[b].n_text; y++) {
        fprintf(to, "| %s |", s->range[b].text[y]);
        for (int x = 0; x < s->range[a].n_text; x++)
            fprintf(to, " %s |", map_mark(s, table, a, x, b, y));
        fputc('\n', to);
    }
}

static void report_rows(FILE *to, const study *s, const study_table *table) {
    static const char *const column[] = {"status",     "steps",         "time",  "volume_error",
                                         "mass_error", "energy_excess", "reason"};
    fprintf(to, "\n|");
    for (int r = 0; r < s->n_range; r++)
        fprintf(to, " %s |", s->range[r].key);
    fprintf(to,
            s->seek.on ? " %s | status | steps | time | volume error | mass error | energy excess | reason |\n|"
                       : "%s status | steps | time | volume error | mass error | energy excess | reason |\n|",
            s->seek.on ? s->seek.key : "");
    for (int k = 0; k < s->n_range + 7 + s->seek.on; k++)
        fprintf(to, "---|");
    fputc('\n', to);
    for (int i = 0; i < table->n; i++) {
        const study_row *row = &table->row[i];
        fprintf(to, "|");
        for (int r = 0; r < s->n_range + s->seek.on; r++) {
            fputc(' ', to);
            report_cell(to, study_row_text(row, r < s->n_range ? s->range[r].key : s->seek.key));
            fprintf(to, " |");
        }
        for (int k = 0; k < 7; k++) {
            fputc(' ', to);
            report_cell(to, k == 0 ? report_mark[study_row_status(row)] : study_row_text(row, column[k]));
            fprintf(to, " |");
        }
        fputc('\n', to);
    }
}

// ---------------------------------------------------------------- reasons

// the same reason but for numbers
static bool reason_same(const char *a, const char *b) {
    while (*a || *b) {
        const bool p = isdigit((unsigned char)*a), q = isdigit((unsigned char)*b);
        if (p && q) {
            a += strspn(a, "0123456789.e+-");
            b += strspn(b, "0123456789.e+-");
        } else if (*a++ != *b++)
            return false;
    }
    return true;
}

static const char *reason_of(const study_row *row) {
    const char *text = study_row_text(row, "reason");
    const char *place = text ? strstr(text, ": key '") : NULL; // without the file's name
    return !text ? "" : place ? place + 2 : text;
}

static void report_reasons(FILE *to, const study_table *table) {
    bool *told = silt_alloc((size_t)table->n + 1, sizeof *told), any = false;
    for (int i = 0; i < table->n; i++) {
        const study_status status = study_row_status(&table->row[i]);
        if (told[i] || status < RUN_WARNED)
            continue;
        int n = 0;
        for (int k = i; k < table->n; k++)
            if (!told[k] && study_row_status(&table->row[k]) == status &&
                reason_same(reason_of(&table->row[i]), reason_of(&table->row[k]))) {
                told[k] = true;
                n++;
            }
        fprintf(to, "%s- %d %s: %s\n", any ? "" : "\n", n, report_mark[status], reason_of(&table->row[i]));
        any = true;
    }
    free(told);
}

// ---------------------------------------------------------------- searches, orders

static void report_sought(FILE *to, const study *s, const char *out) {
    for (int k = 0; s->seek.on && k < study_count(s); k++) {
        char *path = silt_text("%s/runs/%05d.sought", out, k + 1);
        study_row row = {0};
        if (study_row_read(&row, path)) {
            fprintf(to, "sought: ");
            for (int r = 0; r < s->n_range; r++)
                fprintf(to, "%s %s, ", s->range[r].key, study_value(s, k, r));
            fprintf(to, "%s = %s gives %s = %s (asked %s) after %s runs: %s\n", s->seek.key,
                    study_row_text(&row, s->seek.key), s->seek.check, study_row_text(&row, s->seek.check),
                    study_row_text(&row, "asked"), study_row_text(&row, "runs"), study_row_text(&row, "result"));
        }
        study_row_clear(&row);
        free(path);
    }
}

static void report_orders(FILE *to, const study *s, const study_table *table) {
    for (int i = 0; i < s->n_plot; i++) {
        const study_plot *plot = &s->plot[i];
        const char *x, *value;
        char *y;
        if (plot->kind != PLOT_ORDER && plot->kind != PLOT_COST)
            continue;
        study_axes(s, table, plot, &x, &y);
        for (int k = 0; y && (value = study_distinct(table, plot->by, k)); k++) {
            double slope, at_one;
            const int n = study_slope(table, x, y, plot->by, value, &slope, &at_one);
            if (n > 1 && isfinite(slope))
                fprintf(to, "%s: %s goes with %s to the power %.2f (%d runs%s%s%s%s)\n", plot->name, y, x, slope, n,
                        plot->by ? ", " : "", plot->by ? plot->by : "", plot->by ? " = " : "", value);
        }
        free(y);
    }
}

silt_status study_report(const study *s, const char *out, const study_table *table, FILE *to, silt_error *err) {
    const int wanted = study_count(s) * s->repeats;
    char *path = silt_text("%s/study.md", out);
    FILE *file = fopen(path, "w");
    silt_status status = SILT_OK;
    if (file) {
        fprintf(file, "## %s\n\n", s->title && *s->title ? s->title : "Study");
        report_counts(file, table, s->seek.on ? 0 : wanted);
        report_sought(file, s, out);
        report_orders(file, s, table);
        if (s->n_range == 2 && s->combine == COMBINE_GRID && s->repeats == 1 && !s->seek.on) {
            report_map(file, s, table, 0, 1);
            report_reasons(file, table);
        } else if (table->n <= MOST_ROWS)
            report_rows(file, s, table);
        else
            report_reasons(file, table);
    }
    const bool wrong = !file || ferror(file);
    if ((file && fclose(file) != 0) || wrong)
        status = silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", path, strerror(errno));
    free(path);
    report_counts(to, table, s->seek.on ? 0 : wanted);
    report_sought(to, s, out);
    report_orders(to, s, table);
    report_reasons(to, table);
    return status;
}

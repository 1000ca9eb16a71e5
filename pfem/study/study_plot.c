// plots of study.csv through gnuplot: its own data file and script each, so that they can be drawn again by hand
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "study.h"

static bool row_counts(const study_row *row) {
    return study_row_status(row) <= RUN_BEYOND;
}

// text or a file's name in single quotes, in which gnuplot takes all but the quote as it is; in double ones it would run what stands in `
static void plot_quote(FILE *to, const char *text) {
    fputc('\'', to);
    for (; *text; text++)
        if (*text == '\'')
            fputs("''", to);
        else
            fputc(*text == '\n' ? ' ' : *text, to);
    fputc('\'', to);
}

/** what a plot is drawn from */
typedef struct plot_files {
    char *data, *script, *picture; // owned
} plot_files;

static FILE *script_begin(const plot_files *files, const study *s, const study_plot *plot, const char *x,
                          const char *y) {
    FILE *to = fopen(files->script, "w");
    if (!to)
        return NULL;
    fprintf(to, "set terminal svg size 640,480 noenhanced background 'white'\nset output ");
    plot_quote(to, files->picture);
    fprintf(to, "\nset grid\nset title ");
    char *title = silt_text("%s: %s", s->title && *s->title ? s->title : "study", plot->name);
    plot_quote(to, title);
    free(title);
    fprintf(to, "\nset xlabel ");
    plot_quote(to, x);
    fprintf(to, "\nset ylabel ");
    plot_quote(to, y);
    fputc('\n', to);
    return to;
}

// points of x and y, added to the file as a block; or alone, and in a second block those that no other beats in both
// (in y where that is all that counts)
static int data_points(const char *path, const study_table *table, const char *x, const char *y, const char *by,
                       const char *value, bool front) {
    FILE *to = fopen(path, front ? "w" : "a");
    int n = 0;
    for (int pass = 0; pass < (front ? 2 : 1) && to; pass++) {
        double last = -HUGE_VAL;
        fprintf(to, pass ? "\n\n" : "# x y\n");
        if (pass == 0)
            for (int i = 0; i < table->n; i++) {
                const double a = study_row_number(&table->row[i], x), b = study_row_number(&table->row[i], y);
                if (row_counts(&table->row[i]) && study_row_of(&table->row[i], by, value) && a > 0 && b > 0) {
                    fprintf(to, "%.9g %.9g\n", a, b);
                    n++;
                }
            }
        // the front from cheap to dear: the next is the cheapest of those with a smaller error
        double least = HUGE_VAL;
        for (bool more = pass == 1; more;) {
            double best_a = HUGE_VAL, best_b = HUGE_VAL;
            for (int i = 0; i < table->n; i++) {
                const double a = study_row_number(&table->row[i], x), b = study_row_number(&table->row[i], y);
                if (row_counts(&table->row[i]) && a > 0 && b > 0 && b < least && a >= last &&
                    (a < best_a || (a == best_a && b < best_b))) {
                    best_a = a;
                    best_b = b;
                }
            }
            if ((more = isfinite(best_a))) {
                fprintf(to, "%.9g %.9g\n", best_a, best_b);
                last = best_a;
                least = best_b;
            }
        }
    }
    if (to && !front && n)
        fprintf(to, "\n\n");
    if (to)
        fclose(to);
    return n;
}

// error over time with the Pareto front
static bool plot_time(const plot_files *files, const study *s, const study_plot *plot, const study_table *table,
                      const char *x, const char *y) {
    if (data_points(files->data, table, x, y, NULL, NULL, true) == 0)
        return false;
    FILE *to = script_begin(files, s, plot, x, y);
    if (!to)
        return false;
    fprintf(to, "set logscale xy\nset format x '%%.2g'\nset format y '%%.2g'\nset key top right\n");
    fprintf(to, "plot ");
    plot_quote(to, files->data);
    fprintf(to, " index 0 with points pt 7 title 'runs', '' index 1 with linespoints pt 6 lw 2 title 'Pareto front'\n");
    fclose(to);
    return true;
}

// lines of one value of `by` each, with their orders
static bool plot_line(const plot_files *files, const study *s, const study_plot *plot, const study_table *table,
                      const char *x, const char *y) {
    int n = 0, block = 0;
    const char *value;
    unlink(files->data);
    for (int k = 0; (value = study_distinct(table, plot->by, k)); k++)
        n += data_points(files->data, table, x, y, plot->by, value, false);
    FILE *to = n ? script_begin(files, s, plot, x, y) : NULL;
    if (!to)
        return false;
    fprintf(to, "set logscale xy\nset format x '%%.2g'\nset format y '%%.2g'\nset key bottom right\nplot ");
    for (int k = 0; (value = study_distinct(table, plot->by, k)); k++) {
        double slope, at_one;
        const int m = study_slope(table, x, y, plot->by, value, &slope, &at_one);
        if (m == 0)
            continue;
        fputs(block ? ", " : "", to);
        plot_quote(to, files->data);
        fprintf(to, " index %d with points pt 7 lc %d ", block, block + 1);
        char *title = plot->by ? silt_text("%s %s", plot->by, value) : silt_text("runs");
        fprintf(to, "title ");
        plot_quote(to, title);
        free(title);
        if (m > 1 && isfinite(slope))
            fprintf(to, ", %.9g * x**%.9g with lines lc %d title 'order %.2f'", at_one, slope, block + 1, slope);
        block++;
    }
    fputc('\n', to);
    fclose(to);
    return true;
}

// place of a row's text among the values that a range has, from 0
static int map_place(const study *s, const char *key, const study_row *row) {
    const char *text = study_row_text(row, key);
    for (int r = 0; r < s->n_range; r++)
        for (int k = 0; text && k < s->range[r].n_text && strcmp(s->range[r].key, key) == 0; k++)
            if (strcmp(s->range[r].text[k], text) == 0)
                return k;
    return -1;
}

static void map_tics(FILE *to, const study *s, char axis, const char *key) {
    for (int r = 0; r < s->n_range; r++) {
        const int n = s->range[r].n_text;
        if (strcmp(s->range[r].key, key) != 0)
            continue;
        fprintf(to, "set %crange [-0.5:%g]\nset %ctics%s (", axis, n - 0.5, axis, axis == 'x' ? " rotate by -45" : "");
        for (int k = 0; k < n; k++) {
            fputs(k ? ", " : "", to);
            plot_quote(to, s->range[r].text[k]);
            fprintf(to, " %d", k);
        }
        fputs(")\n", to);
    }
}

static bool plot_map(const plot_files *files, const study *s, const study_plot *plot, const study_table *table,
                     const char *x, const char *y) {
    static const char *const colour[RUN_STATUS_COUNT] = {"#4daf4a", "#a6d96a", "#80cdc1", "#e6ab02", "#bdbdbd", "#fdae61",
                                                         "#ffff66", "#d73027", "#000000", "#984ea3"};
    FILE *data = fopen(files->data, "w");
    int found[RUN_STATUS_COUNT] = {0};
    if (!data)
        return false;
    for (int k = 0; k < RUN_STATUS_COUNT; k++) {
        fprintf(data, "# %s\n", study_status_word[k]);
        for (int i = 0; i < table->n; i++) {
            const int a = map_place(s, x, &table->row[i]), b = map_place(s, y, &table->row[i]);
            if (a < 0 || b < 0 || study_row_status(&table->row[i]) != (study_status)k)
                continue;
            fprintf(data, "%d %d\n", a, b);
            found[k]++;
        }
        // an empty block would not count
        fprintf(data, found[k] ? "\n\n" : "nan nan\n\n\n");
    }
    fclose(data);
    FILE *to = script_begin(files, s, plot, x, y);
    if (!to)
        return false;
    map_tics(to, s, 'x', x);
    map_tics(to, s, 'y', y);
    fprintf(to, "set key outside top\nset style fill solid border lc 'white'\nplot ");
    bool any = false;
    for (int k = 0; k < RUN_STATUS_COUNT; k++) {
        if (!found[k])
            continue;
        fputs(any ? ", " : "", to);
        plot_quote(to, files->data);
        fprintf(to, " index %d using 1:2:(0.45):(0.45) with boxxyerror lc '%s' title '%s'", k, colour[k], study_status_word[k]);
        any = true;
    }
    fputc('\n', to);
    fclose(to);
    return any;
}

// ---------------------------------------------------------------- gnuplot

// its words go to a log beside the script
static const char *plot_draw(const char *script, const char *log) {
    const pid_t child = fork();
    int code = 0;
    if (child == 0) {
        const int to = open(log, O_WRONLY | O_CREAT | O_TRUNC, 0666);
        if (to >= 0)
            dup2(to, 2);
        execlp("gnuplot", "gnuplot", script, (char *)NULL);
        _exit(127);
    }
    if (child < 0)
        return "no process for gnuplot";
    while (waitpid(child, &code, 0) < 0 && errno == EINTR)
        ;
    if (WIFEXITED(code) && WEXITSTATUS(code) == 127)
        return "gnuplot is not installed (Debian: apt install gnuplot-nox)";
    return WIFEXITED(code) && WEXITSTATUS(code) == 0 ? NULL : "gnuplot failed, see gnuplot.log";
}

// ---------------------------------------------------------------- which

// name of the first check in the rows, "": none
static const char *first_check(const study_table *table, char name[128]) {
    *name = 0;
    for (int i = 0; i < table->n && !*name; i++)
        for (int k = 0; k < table->row[i].n && !*name; k++) {
            const char *cell = table->row[i].cell[k].name;
            const size_t n = strlen(cell);
            if (n > 6 && strcmp(cell + n - 6, "_error") == 0 && strcmp(cell, "volume_error") != 0 &&
                strcmp(cell, "sediment_error") != 0)
                snprintf(name, 128, "%.*s", (int)(n - 6), cell);
        }
    return name;
}

void study_axes(const study *s, const study_table *table, const study_plot *plot, const char **x, char **y) {
    char first[128];
    const char *range[2] = {s->n_range > 0 ? s->range[0].key : s->seek.key, s->n_range > 1 ? s->range[1].key : NULL};
    const char *check = plot->check ? plot->check : first_check(table, first);
    *x = plot->kind == PLOT_TIME ? "cpu_seconds" : plot->x ? plot->x : plot->kind == PLOT_COST ? "nodes" : range[0];
    if (plot->kind == PLOT_MAP)
        *y = plot->y || range[1] ? silt_text("%s", plot->y ? plot->y : range[1]) : NULL;
    else if (plot->kind == PLOT_COST)
        *y = silt_text("cpu_seconds");
    else
        *y = *check ? silt_text("%s_error", check) : NULL;
}

static const char *plot_one(const study *s, const char *out, const study_table *table, const study_plot *plot,
                            bool asked) {
    const char *x, *missing = NULL;
    char *y;
    plot_files files = {silt_text("%s/%s.dat", out, plot->name), silt_text("%s/%s.gp", out, plot->name),
                        silt_text("%s/%s.svg", out, plot->name)};
    study_axes(s, table, plot, &x, &y);
    const bool made = y && (plot->kind == PLOT_TIME  ? plot_time(&files, s, plot, table, x, y)
                            : plot->kind == PLOT_MAP ? plot_map(&files, s, plot, table, x, y)
                                                     : plot_line(&files, s, plot, table, x, y));
    if (made) {
        char *log = silt_text("%s/gnuplot.log", out);
        missing = plot_draw(files.script, log);
        free(log);
    } else if (asked)
        missing = "there is nothing to draw";
    free(y);
    free(files.data);
    free(files.script);
    free(files.picture);
    return missing;
}

silt_status study_plots(const study *s, const char *out, const study_table *table, FILE *to, silt_error *err) {
    static const study_plot usual[] = {{.kind = PLOT_TIME, .name = "time"},
                                       {.kind = PLOT_ORDER, .name = "order"},
                                       {.kind = PLOT_COST, .name = "cost"},
                                       {.kind = PLOT_MAP, .name = "map"}};
    const int n = s->n_plot ? s->n_plot : (int)(sizeof usual / sizeof *usual);
    (void)err;
    for (int i = 0; i < n; i++) {
        const study_plot *plot = s->n_plot ? &s->plot[i] : &usual[i];
        const char *missing = plot_one(s, out, table, plot, s->n_plot > 0);
        if (missing)
            fprintf(to, "plot %s: %s; study.csv has all figures\n", plot->name, missing);
    }
    return SILT_OK;
}

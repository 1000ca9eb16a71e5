// the report's plots of history.csv: ledgers, gauges, phase times

#include "report.h"

// ---------------------------------------------------------------- the table

static void table_header(silt_table *table, char *line) {
    int capacity = 0;
    line[strcspn(line, "\r\n")] = 0;
    for (char *rest = line, *name; (name = strsep(&rest, ","));) {
        SILT_RESERVE(table->name, capacity, table->n_column + 1);
        table->name[table->n_column++] = silt_text("%s", name);
    }
    table->value = silt_alloc((size_t)table->n_column, sizeof *table->value);
}

static void table_row(silt_table *table, const char *line) {
    const int row = table->n_row;
    if (row >= table->capacity) {
        int capacity = 0;
        for (int k = 0; k < table->n_column; k++) {
            capacity = table->capacity;
            table->value[k] = silt_grow(table->value[k], &capacity, row + 1, sizeof **table->value);
        }
        table->capacity = capacity;
    }
    for (int k = 0; k < table->n_column; k++) {
        char *end;
        const double value = strtod(line, &end);
        table->value[k][row] = end > line ? value : NAN;
        line = end + strcspn(end, ",");
        line += *line == ',';
    }
    table->n_row++;
}

bool silt_table_read(silt_table *table, const char *out) {
    char *path = silt_text("%s/history.csv", out), *line = NULL;
    size_t capacity = 0;
    ssize_t length;
    memset(table, 0, sizeof *table);
    FILE *from = fopen(path, "r");
    if (from && getline(&line, &capacity, from) > 0)
        table_header(table, line);
    // a last line without its end is being written
    while (table->n_column > 0 && (length = getline(&line, &capacity, from)) > 0 && line[length - 1] == '\n')
        table_row(table, line);
    if (from)
        fclose(from);
    free(line);
    free(path);
    return table->n_column > 0;
}

void silt_table_clear(silt_table *table) {
    for (int k = 0; k < table->n_column; k++) {
        free(table->name[k]);
        free(table->value[k]);
    }
    free(table->name);
    free(table->value);
    memset(table, 0, sizeof *table);
}

const double *silt_table_column(const silt_table *table, const char *name) {
    for (int k = 0; k < table->n_column; k++)
        if (strcmp(table->name[k], name) == 0)
            return table->value[k];
    return NULL;
}

// ---------------------------------------------------------------- plots

/** columns that one plot shows */
typedef struct ledger_plot {
    const char *title, *up;
    bool rise; // what they rise by from the start
    const char *column[PLOT_LINES];
} ledger_plot;

static const ledger_plot ledger_water[] = {
    {"Volume error", "share of the volume", false, {"volume_error"}},
    {"Where volume went", "m³", false,
     {"volume_solved", "volume_moved", "volume_reconnected", "volume_refined", "volume_given", "volume_owed"}},
    {"Energy, rise from the start", "J", true, {"kinetic_energy", "potential_energy", "external_work", "dissipation"}},
    {"Water in and out", "kg", false, {"inflow_mass", "outflow_mass"}},
    {"Momentum of the water", "kg m/s", false, {"momentum_x", "momentum_y", "momentum_z"}},
    {"Momentum error", "share of the forces", false, {"momentum_error"}},
    {"Fastest node", "m/s", false, {"max_speed"}},
    {"Water in drops", "m³", false, {"flying_volume"}},
    {"Nodes and cells", NULL, false, {"n_node", "n_cell"}},
    {"Length of the steps", "s", false, {"dt"}},
};
static const ledger_plot ledger_sediment[] = {
    {"Sediment", "kg", false, {"bed_mass", "grain_mass", "released_mass", "deposited_mass", "left_mass", "fed_mass"}},
    {"Sediment error", "share of the start", false, {"sediment_error"}},
    {"Largest shear on the bed", "Pa", false, {"bed_shear"}},
    {"Largest work on the bed", "J/m³", false, {"bed_work"}},
    {"Water out of pores", "kg", false, {"pore_water_mass"}},
    {"Seepage", "m³/s", false, {"seepage"}},
    {"Grains", NULL, false, {"grain_count"}},
    {"Mean velocity of the grains that move", "m/s", false, {"grain_velocity_x", "grain_velocity_y", "grain_velocity_z"}},
    {"Force of the water on the grains", "N", false, {"grain_water_x", "grain_water_y", "grain_water_z"}},
    {"Force of contacts on the grains", "N", false, {"grain_contact_x", "grain_contact_y", "grain_contact_z"}},
    {"Energy of the grains, rise from the start", "J", true, {"grain_kinetic_energy", "grain_potential_energy"}},
};
#define LEDGER_COUNT(list) ((int)(sizeof(list) / sizeof *(list)))

// a column that says something: not absent, not 0 or NaN throughout
static bool column_speaks(const silt_table *table, const double *value) {
    for (int i = 0; value && i < table->n_row; i++)
        if (value[i] != 0 && !isnan(value[i]))
            return true;
    return false;
}

// Writes the plot of what is there of its columns; the section's head goes before the first of them.
// keep: a column of zeros is news too
static void ledger_draw(const silt_report_page *r, const silt_table *table, const ledger_plot *def, bool keep, const char **head) {
    const double *time = silt_table_column(table, "time");
    silt_plot plot = {.title = def->title, .across = "time, s", .up = def->up};
    double *risen[PLOT_LINES] = {NULL};
    for (int k = 0; k < PLOT_LINES && def->column[k] && time && table->n_row > 0; k++) {
        const double *value = silt_table_column(table, def->column[k]);
        if (!value || (!keep && !column_speaks(table, value)))
            continue;
        if (def->rise) {
            risen[k] = silt_alloc((size_t)table->n_row, sizeof *risen[k]);
            for (int i = 0; i < table->n_row; i++)
                risen[k][i] = value[i] - value[0];
        }
        plot.line[plot.n++] = (silt_plot_line){def->column[k], table->n_row, time, def->rise ? risen[k] : value, false};
    }
    if (!silt_plot_empty(&plot)) {
        if (*head)
            fprintf(r->to, "<section><h2>%s</h2>%s\n<div class=\"plots\">\n", *head,
                    r->scene->dimension == 3 ? "" : "<p class=\"note\">Masses, volumes, forces and energies are per metre of width.</p>");
        *head = NULL;
        silt_plot_svg(r->to, &plot);
    }
    for (int k = 0; k < PLOT_LINES; k++)
        free(risen[k]);
}

static void ledger_list(const silt_report_page *r, const silt_table *table, const char *title, int n, const ledger_plot *list) {
    const char *head = title;
    for (int k = 0; k < n; k++)
        // an error of 0 throughout is worth a picture
        ledger_draw(r, table, &list[k], strstr(list[k].column[0], "error") != NULL, &head);
    if (!head)
        fputs("</div></section>\n", r->to);
}

void silt_report_ledgers(const silt_report_page *report, const silt_table *table) {
    ledger_list(report, table, "Ledger of the water", LEDGER_COUNT(ledger_water), ledger_water);
    ledger_list(report, table, "Ledger of bed and grains", LEDGER_COUNT(ledger_sediment), ledger_sediment);
}

// ---------------------------------------------------------------- bodies and gauges

// columns PREFIX_a, PREFIX_b, ... in one plot
static void gauge_draw(const silt_report_page *r, const silt_table *table, const char *prefix, const char *what, const char *up, bool rise,
                       const char *const ending[3], const char **head) {
    char *name[3], *title = silt_text("%s%s%s", prefix, *what ? ": " : "", what);
    ledger_plot def = {.title = title, .up = up, .rise = rise};
    for (int k = 0; k < 3; k++)
        def.column[k] = name[k] = silt_text("%s_%s", prefix, ending[k]);
    ledger_draw(r, table, &def, false, head);
    for (int k = 0; k < 3; k++)
        free(name[k]);
    free(title);
}

static bool gauge_begins(const char *name, const char *prefix, size_t n) {
    return strncmp(name, prefix, n) == 0;
}

void silt_report_gauges(const silt_report_page *report, const silt_table *table) {
    static const char *const xyz[] = {"x", "y", "z"}, *const v[] = {"vx", "vy", "vz"}, *const f[] = {"fx", "fy", "fz"},
                      *const t[] = {"tx", "ty", "tz"};
    const silt_scene *scene = report->scene;
    const char *head = "Objects";
    for (int i = 0; i < scene->n_body; i++) {
        const char *name = scene->body[i].name;
        gauge_draw(report, table, name, "way from the start", "m", true, xyz, &head);
        gauge_draw(report, table, name, "velocity", "m/s", false, v, &head);
        gauge_draw(report, table, name, "force of the water", "N", false, f, &head);
        gauge_draw(report, table, name, "torque of the water", "N m", false, t, &head);
    }
    if (!head)
        fputs("</div></section>\n", report->to);
    // columns of gauges; those of one gauge with several share a plot
    head = "Gauges";
    const int n = silt_gauges_count(scene);
    for (int k = 0; k < n;) {
        char first[64], name[PLOT_LINES][64];
        ledger_plot def = {.title = first};
        int m = 0;
        silt_gauges_name(scene, k, first);
        char *bar = strrchr(first, '_');
        const size_t length = bar && strlen(bar) == 2 ? (size_t)(bar - first) + 1 : 0;
        do {
            silt_gauges_name(scene, k++, name[m]);
            def.column[m] = name[m];
            m++;
            if (k < n && m < PLOT_LINES)
                silt_gauges_name(scene, k, name[m]);
        } while (k < n && length > 0 && m < PLOT_LINES && strlen(name[m]) == length + 1 && gauge_begins(name[m], first, length));
        if (m > 1)
            *bar = 0;
        ledger_draw(report, table, &def, false, &head);
    }
    if (!head)
        fputs("</div></section>\n", report->to);
}

// ---------------------------------------------------------------- times

void silt_report_times(const silt_report_page *report, const silt_table *table) {
    static const char *const phase[PHASE_COUNT] = {
#define X(name) "wall_" #name,
        SILT_PHASES(X)
#undef X
    };
    static const char *const what[PHASE_COUNT] = {"triangulation and remeshing", "assembling the equations",
                                                  "solving them",                "wear of the bed",
                                                  "grains and bodies (LIGGGHTS)", "moving nodes, exchange, walls",
                                                  "history, frames, checkpoints"};
    const double *column[PHASE_COUNT];
    double sum[PHASE_COUNT] = {0}, all = 0;
    for (int k = 0; k < PHASE_COUNT; k++) {
        column[k] = silt_table_column(table, phase[k]);
        for (int i = 0; column[k] && i < table->n_row; i++)
            sum[k] += isfinite(column[k][i]) ? column[k][i] : 0;
        all += sum[k];
    }
    if (!(all > 0))
        return;
    fprintf(report->to, "<section><h2>Where the time went</h2>\n<p>%.4g s of the clock in %d steps.</p><table class=\"bars\">\n", all,
            table->n_row);
    for (int k = 0; k < PHASE_COUNT; k++)
        if (sum[k] > 0)
            fprintf(report->to, "<tr><th>%s</th><td>%s</td><td class=\"number\">%.4g s</td><td class=\"number\">%.1f %%</td>"
                                "<td class=\"bar\"><span style=\"width:%.1f%%\"></span></td></tr>\n",
                    phase[k] + 5, what[k], sum[k], 100 * sum[k] / all, 100 * sum[k] / all);
    fputs("</table>\n<div class=\"plots\">\n", report->to);
    // summed over the run: the slope is what a second of the scene costs
    silt_plot plot = {.title = "Seconds of the clock up to a time of the scene", .across = "time, s", .up = "s"};
    double *total[PHASE_COUNT] = {NULL};
    for (int k = 0; k < PHASE_COUNT; k++) {
        if (!(sum[k] > 0.005 * all))
            continue;
        total[k] = silt_alloc((size_t)table->n_row, sizeof *total[k]);
        for (int i = 0; i < table->n_row; i++)
            total[k][i] = (i > 0 ? total[k][i - 1] : 0) + (isfinite(column[k][i]) ? column[k][i] : 0);
        plot.line[plot.n++] = (silt_plot_line){phase[k] + 5, table->n_row, silt_table_column(table, "time"), total[k], false};
    }
    if (!silt_plot_empty(&plot))
        silt_plot_svg(report->to, &plot);
    fputs("</div></section>\n", report->to);
    for (int k = 0; k < PHASE_COUNT; k++)
        free(total[k]);
}

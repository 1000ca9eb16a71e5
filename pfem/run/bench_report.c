// what silt bench measured: a table a scene, a column a size, and JSON
#include <errno.h>

#include "bench.h"

static const char *const phase_name[CLOCK_COUNT] = {
#define X(name) #name,
    SILT_CLOCKS(X)
#undef X
};

// exponent of n by which a cost per node grows from one size to another
static double growth(const bench_row *a, const bench_row *b, double cost_a, double cost_b) {
    return cost_a > 0 && cost_b > 0 && a->nodes != b->nodes ? log(cost_b / cost_a) / log(b->nodes / a->nodes) : NAN;
}

static void growth_print(FILE *to, const bench_row *row, int n, double first, double last) {
    const double power = n > 1 ? growth(&row[0], &row[n - 1], first, last) : NAN;
    if (isfinite(power))
        fprintf(to, "   n^%+.2f", power);
    fputc('\n', to);
}

// a line of one number a size
#define LINE(name, unit, format, value)                                                                                \
    do {                                                                                                               \
        fprintf(to, "  %-14s %-8s", name, unit);                                                                       \
        for (int k = 0; k < n; k++) {                                                                                  \
            const bench_row *r = &row[k];                                                                              \
            fprintf(to, "  " format "      ", value);                                                                  \
        }                                                                                                              \
        fputc('\n', to);                                                                                               \
    } while (0)

void bench_table(FILE *to, const bench_row *row, int n) {
    const bench_scene *kind = bench_scene_find(row->name);
    fprintf(to, "%s: %s; %d thread%s", row->name, kind ? kind->document : "a scene's file", row->threads, row->threads > 1 ? "s" : "");
    fprintf(to, ", %s time", row->cpu ? "CPU" : "wall");
    if (row->threads > 1 && !row->whole)
        fprintf(to, ", every other step on one (x: how much longer that takes)");
    if (!row->whole)
        fprintf(to, ", medians of %d steps after %d", row->steps, row->warm_up);
    fputc('\n', to);
    if (row->whole)
        LINE("N", "", "%10.0f", r->size);
    LINE("nodes", "", "%10.0f", r->nodes);
    LINE("cells", "", "%10.0f", r->cells);
    if (row->grains > 0)
        LINE("grains", "", "%10.0f", r->grains);
    for (int c = 0; c < CLOCK_COUNT; c++) {
        bool any = false;
        for (int k = 0; k < n; k++)
            any |= row[k].phase[c] >= 5e-10; // half a nanosecond
        if (!any)
            continue;
        fprintf(to, "  %-14s %-8s", phase_name[c], "ns");
        for (int k = 0; k < n; k++) {
            fprintf(to, "  %10.0f %3.0f %%", 1e9 * row[k].phase[c], 100 * row[k].phase[c] / row[k].step);
            if (row->threads > 1 && !row->whole)
                fprintf(to, " x%4.2f", row[k].phase_one[c] / row[k].phase[c]);
        }
        growth_print(to, row, n, row[0].phase[c], row[n - 1].phase[c]);
    }
    fprintf(to, "  %-14s %-8s", "step", "ns");
    for (int k = 0; k < n; k++)
        fprintf(to, "  %10.0f      ", 1e9 * row[k].step);
    growth_print(to, row, n, row[0].step, row[n - 1].step);
    if (row->threads > 1 && !row->whole)
        LINE("one thread", "over all", "%10.2f", r->faster);
    LINE("U1", "ns", "%10.0f", 1e9 * r->unit);
    fprintf(to, "  %-14s %-8s", "step", "U1");
    for (int k = 0; k < n; k++)
        fprintf(to, "  %10.2f      ", row[k].in_unit);
    growth_print(to, row, n, row[0].in_unit, row[n - 1].in_unit);
    LINE("iterations", "a step", "%10.1f", r->iterations);
    LINE("momentum CG", "a step", "%10.1f", r->momentum_iterations);
    if (row->dimension == 3)
        LINE("pressure CG", "a step", "%10.1f", r->pressure_iterations);
    LINE("courant", "", "%10.2f", r->courant);
    LINE("peak memory", "B/node", "%10.0f", r->bytes);
    LINE("start", "s", "%10.3f", r->start);
    if (row->grains > 0) {
        LINE("substeps", "a step", "%10.1f", r->substeps);
        LINE("grains", "ns each", "%10.0f", 1e9 * r->phase[CLOCK_grains] * r->nodes / (r->grains * silt_max(r->substeps, 1)));
        LINE("coupling", "ns/grain", "%10.0f", 1e9 * r->phase[CLOCK_coupling] * r->nodes / r->grains);
        if (!row->whole)
            LINE("the mean of it", "ns/grain", "%10.0f", 1e9 * r->coupling);
    }
    if (row->whole) {
        LINE("steps", "", "%10.0f", (double)r->steps);
        LINE("run", "s", "%10.2f", r->seconds);
        LINE("run/model", "s/s", "%10.2f", r->seconds / r->time);
        LINE("U2", "s", "%10.3f", r->unit_2);
        LINE("run/model", "U2", "%10.2f", r->seconds / r->time / r->unit_2);
        LINE("volume error", "0.3 s, %", "%10.3f", 100 * r->volume_early);
        LINE("volume error", "%", "%10.3f", 100 * r->volume);
    }
    fputc('\n', to);
}

static void row_json(FILE *to, const bench_row *r, const bench_row *before) {
    fputs("    {\"scene\": ", to);
    silt_json_text(to, r->name);
    fprintf(to, ", \"clock\": \"%s\", \"dimension\": %d, \"threads\": %d, \"steps\": %d, \"warm_up\": %d,\n     ", r->cpu ? "cpu" : "wall", r->dimension, r->threads, r->steps, r->warm_up);
    const struct {
        const char *name;
        double value;
    } number[] = {
        {"size", r->size}, {"nodes", r->nodes}, {"cells", r->cells}, {"grains", r->grains}, {"ns_per_node_step", 1e9 * r->step},
        {"mean_ns_per_node_step", 1e9 * r->mean}, {"u1_ns_per_point", 1e9 * r->unit}, {"step_in_u1", r->in_unit},
        {"worst_step_in_u1", r->worst_in_unit},
        {"growth", before ? growth(before, r, before->step, r->step) : NAN},
        {"growth_in_u1", before ? growth(before, r, before->in_unit, r->in_unit) : NAN},
        {"iterations", r->iterations}, {"momentum_iterations", r->momentum_iterations}, {"pressure_iterations", r->pressure_iterations},
        {"retries", r->retries}, {"dt", r->dt}, {"courant", r->courant}, {"start_seconds", r->start}, {"peak_bytes_per_node", r->bytes},
        {"substeps", r->substeps}, {"one_thread_over_all", r->faster},
        // of a whole run only
        {"seconds", r->whole ? r->seconds : NAN}, {"model_seconds", r->whole ? r->time : NAN}, {"u2_seconds", r->whole ? r->unit_2 : NAN},
        {"run_per_model_in_u2", r->whole ? r->seconds / r->time / r->unit_2 : NAN},
        {"volume_error_early", r->whole ? r->volume_early : NAN}, {"volume_error", r->whole ? r->volume : NAN},
    };
    for (size_t k = 0; k < sizeof number / sizeof *number; k++)
        silt_json_number(to, number[k].name, number[k].value, k % 4 == 3 ? ",\n     " : ", ");
    fputs("\"phases\": {", to);
    for (int c = 0; c < CLOCK_COUNT; c++) {
        fprintf(to, "%s\n       \"%s\": {", c ? "," : "", phase_name[c]);
        silt_json_number(to, "ns_per_node_step", 1e9 * r->phase[c], ", ");
        silt_json_number(to, "share", r->phase[c] / r->step, "}");
    }
    fputs("}}", to);
}

silt_status bench_json(const char *path, const bench_row *row, int n, silt_error *err) {
    FILE *to = fopen(path, "w");
    if (to) {
        fputs("{\n  \"version\": ", to);
        silt_json_text(to, SILT_VERSION);
        fputs(",\n  \"rows\": [\n", to);
        for (int k = 0; k < n; k++) {
            const bool next = k > 0 && strcmp(row[k].name, row[k - 1].name) == 0;
            row_json(to, &row[k], next ? &row[k - 1] : NULL);
            fputs(k + 1 < n ? ",\n" : "\n", to);
        }
        fputs("  ]\n}\n", to);
    }
    const bool wrong = !to || ferror(to) != 0;
    if ((to && fclose(to) != 0) || wrong)
        return silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", path, strerror(errno));
    return SILT_OK;
}

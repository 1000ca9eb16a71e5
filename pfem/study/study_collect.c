// the rows of all runs as one table and study.csv; lines through what stands in it
#include <errno.h>

#include "study.h"

void study_table_clear(study_table *table) {
    for (int i = 0; i < table->n; i++)
        study_row_clear(&table->row[i]);
    free(table->row);
    *table = (study_table){0};
}

static bool table_take(study_table *table, const char *out, const char *name) {
    char *path = silt_text("%s/runs/%s.row", out, name);
    SILT_RESERVE(table->row, table->capacity, table->n + 1);
    const bool there = study_row_read(&table->row[table->n], path);
    table->n += there;
    free(path);
    return there;
}

// names of the columns, in the order in which they come
typedef struct collect_names {
    int n, capacity;
    const char **name;
} collect_names;

static void names_add(collect_names *names, const char *name) {
    for (int i = 0; i < names->n; i++)
        if (strcmp(names->name[i], name) == 0)
            return;
    SILT_RESERVE(names->name, names->capacity, names->n + 1);
    names->name[names->n++] = name;
}

static void collect_cell(FILE *to, const char *text) {
    if (text && strpbrk(text, ",\"")) {
        fputc('"', to);
        for (; *text; text++)
            fprintf(to, *text == '"' ? "\"\"" : "%c", *text);
        fputc('"', to);
    } else if (text)
        fputs(text, to);
}

static silt_status collect_write(const char *path, const study_table *table, silt_error *err) {
    collect_names names = {0};
    for (int i = 0; i < table->n; i++)
        for (int k = 0; k < table->row[i].n; k++)
            names_add(&names, table->row[i].cell[k].name);
    FILE *to = fopen(path, "w");
    for (int k = 0; to && k < names.n; k++) {
        fputs(k ? "," : "", to);
        collect_cell(to, names.name[k]);
    }
    if (to)
        fputc('\n', to);
    for (int i = 0; to && i < table->n; i++) {
        for (int k = 0; k < names.n; k++) {
            fputs(k ? "," : "", to);
            collect_cell(to, study_row_text(&table->row[i], names.name[k]));
        }
        fputc('\n', to);
    }
    free(names.name);
    const bool wrong = !to || ferror(to);
    if ((to && fclose(to) != 0) || wrong)
        return silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", path, strerror(errno));
    return SILT_OK;
}

silt_status study_collect(const study *s, const char *out, study_table *table, silt_error *err) {
    *table = (study_table){0};
    char name[32];
    for (int k = 0; k < study_count(s); k++)
        for (int i = 0; i < (s->seek.on ? s->seek.runs : s->repeats); i++) {
            snprintf(name, sizeof name, s->seek.on || s->repeats > 1 ? "%05d-%02d" : "%05d", k + 1, i + 1);
            if (!table_take(table, out, name) && s->seek.on)
                break;
        }
    char *path = silt_text("%s/study.csv", out);
    const silt_status status = collect_write(path, table, err);
    free(path);
    return status;
}

bool study_row_of(const study_row *row, const char *by, const char *value) {
    const char *text = by ? study_row_text(row, by) : "";
    return !by || (text && strcmp(text, value) == 0);
}

const char *study_distinct(const study_table *table, const char *by, int k) {
    if (!by)
        return k == 0 ? "" : NULL;
    for (int i = 0; i < table->n; i++) {
        const char *text = study_row_text(&table->row[i], by);
        bool known = !text;
        for (int j = 0; j < i && !known; j++)
            known = study_row_of(&table->row[j], by, text);
        if (!known && k-- == 0)
            return text;
    }
    return NULL;
}

int study_slope(const study_table *table, const char *x, const char *y, const char *by, const char *value,
                double *slope, double *at_one) {
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int i = 0; i < table->n; i++) {
        const double a = study_row_number(&table->row[i], x), b = study_row_number(&table->row[i], y);
        if (study_row_status(&table->row[i]) > RUN_BEYOND || !study_row_of(&table->row[i], by, value) || !(a > 0) ||
            !(b > 0) || !isfinite(a) || !isfinite(b))
            continue;
        const double u = log(a), v = log(b);
        n++;
        sx += u;
        sy += v;
        sxx += u * u;
        sxy += u * v;
    }
    const double spread = n * sxx - sx * sx;
    *slope = n > 1 && spread > 1e-12 * n * sxx ? (n * sxy - sx * sy) / spread : NAN;
    *at_one = exp((sy - *slope * sx) / n);
    return (int)n;
}

/** @file series.c
 * Tables in CSV files: time series of a scene, reference curves of its checks.
 */
#include "scene.h"

#include <errno.h>

enum { SERIES_BYTES = 64 << 20, SERIES_COLUMNS = 4096 };

double silt_series_at(const silt_series *series, int column, double x) {
    int n = series->n_row, m = series->n_column;
    if (n < 1 || column < 0 || column >= m)
        return NAN;
    const double *value = series->value;
    if (x <= value[0])
        return value[column];
    if (x >= value[(size_t)(n - 1) * m])
        return value[(size_t)(n - 1) * m + column];
    // last row at or before x
    int low = 0, high = n - 1;
    while (high - low > 1) {
        int middle = low + (high - low) / 2;
        if (value[(size_t)middle * m] <= x)
            low = middle;
        else
            high = middle;
    }
    const double *a = value + (size_t)low * m, *b = value + (size_t)high * m;
    return b[0] > a[0] ? a[column] + (b[column] - a[column]) * ((x - a[0]) / (b[0] - a[0])) : b[column];
}

void silt_series_clear(silt_series *series) {
    for (int i = 0; i < series->n_column; i++)
        free(series->name[i]);
    free(series->name);
    free(series->value);
    free(series->line);
    free(series->path);
    *series = (silt_series){0};
}

void silt_series_constant(silt_series *series, double value) {
    silt_series_clear(series);
    series->n_row = 1;
    series->n_column = 2;
    series->name = silt_alloc(2, sizeof *series->name);
    series->name[0] = silt_text("time");
    series->name[1] = silt_text("value");
    series->value = silt_alloc(2, sizeof *series->value);
    series->value[1] = value;
}

int silt_series_column(const silt_series *series, const char *name) {
    for (int i = 0; i < series->n_column; i++)
        if (strcmp(series->name[i], name) == 0)
            return i;
    return -1;
}

// whole file with a zero behind it
static silt_status series_load(const char *path, char **text, size_t *size, silt_error *err) {
    FILE *file = fopen(path, "rb");
    if (!file)
        return silt_fail(err, SILT_INPUT, "%s: cannot be opened: %s", path, strerror(errno));
    silt_status status = SILT_OK;
    int capacity = 0;
    *size = 0;
    for (;;) {
        *text = silt_grow(*text, &capacity, (int)*size + 65537, 1);
        size_t got = fread(*text + *size, 1, 65536, file);
        *size += got;
        if (got == 0 || *size > SERIES_BYTES)
            break;
    }
    if (ferror(file))
        status = silt_fail(err, SILT_INPUT, "%s: cannot be read: %s", path, strerror(errno));
    else if (*size > SERIES_BYTES)
        status =
            silt_fail(err, SILT_INPUT, "%s: found more than %d MB, allowed at most that", path, SERIES_BYTES >> 20);
    else if (memchr(*text, 0, *size))
        status = silt_fail(err, SILT_INPUT, "%s: found a zero byte, allowed CSV text", path);
    else
        (*text)[*size] = 0;
    fclose(file);
    return status;
}

// takes the next cell off a line: blanks and double quotes around it go; NULL at the end
static char *series_cell(char **rest) {
    if (!*rest)
        return NULL;
    char *cell = *rest, *comma;
    cell += strspn(cell, " \t");
    if (*cell == '"' && strchr(cell + 1, '"')) {
        char *end = strchr(cell + 1, '"');
        comma = strchr(end, ',');
        *end = 0;
        cell++;
    } else {
        comma = strchr(cell, ',');
        char *end = comma ? comma : cell + strlen(cell);
        while (end > cell && strchr(" \t\r", end[-1]))
            end--;
        if (end < cell + strlen(cell) && end != comma)
            *end = 0;
    }
    if (comma)
        *comma = 0;
    *rest = comma ? comma + 1 : NULL;
    return cell;
}

static bool series_number(const char *cell, double *value) {
    char *end;
    *value = strtod(cell, &end);
    return end != cell && *end == 0;
}

static silt_status series_header(const char *path, int line, char *rest, silt_series *series, silt_error *err) {
    int capacity = 0;
    double number;
    for (char *cell; (cell = series_cell(&rest));) {
        if (!*cell || series_number(cell, &number))
            return silt_fail(err, SILT_INPUT,
                             "%s:%d: column %d: found %s%s%s, allowed a column name in the header line", path, line,
                             series->n_column + 1, *cell ? "'" : "nothing", cell, *cell ? "'" : "");
        if (series->n_column == SERIES_COLUMNS)
            return silt_fail(err, SILT_INPUT, "%s:%d: found more than %d columns, allowed at most that", path, line,
                             SERIES_COLUMNS);
        if (silt_series_column(series, cell) >= 0)
            return silt_fail(err, SILT_INPUT, "%s:%d: column %d: found the name '%s' again, allowed different names",
                             path, line, series->n_column + 1, cell);
        SILT_RESERVE(series->name, capacity, series->n_column + 1);
        series->name[series->n_column++] = silt_text("%s", cell);
    }
    return SILT_OK;
}

// one row of numbers; a column whose first cell is no number holds words and becomes NaN throughout
static silt_status series_row(const char *path, int line, char *rest, silt_series *series, bool **words,
                              silt_error *err) {
    int m = series->n_column, n = 0;
    bool first = series->n_row == 0;
    double *row = series->value + (size_t)series->n_row * m;
    for (char *cell; (cell = series_cell(&rest)); n++) {
        if (n >= m)
            continue;
        double value = NAN;
        bool number = !*cell || series_number(cell, &value);
        if (!number && first)
            (*words)[n] = true;
        if (!number && !(*words)[n])
            return silt_fail(err, SILT_INPUT, "%s:%d: column '%s': found '%.60s', allowed a number", path, line,
                             series->name[n], cell);
        row[n] = number && !(*words)[n] ? value : NAN;
    }
    if (n != m)
        return silt_fail(err, SILT_INPUT, "%s:%d: found %d cells, allowed %d, one per column of the header", path, line,
                         n, m);
    series->line[series->n_row++] = line;
    return SILT_OK;
}

silt_status silt_series_read(const char *base, const char *path, silt_series *series, silt_error *err) {
    silt_status status;
    char *text = NULL;
    size_t size = 0;
    bool *words = NULL;
    int value_capacity = 0, line_capacity = 0, line = 0;
    *series = (silt_series){0};
    series->path = path[0] == '/' || !base || !*base ? silt_text("%s", path) : silt_text("%s/%s", base, path);
    status = series_load(series->path, &text, &size, err);
    if (status != SILT_OK)
        goto cleanup;
    char *next = text;
    // a byte order mark is no part of the first name
    if (strncmp(next, "\xef\xbb\xbf", 3) == 0)
        next += 3;
    while (next && *next && status == SILT_OK) {
        char *start = next, *end = strchr(next, '\n');
        next = end ? end + 1 : NULL;
        if (end)
            *end = 0;
        line++;
        size_t blank = strspn(start, " \t\r");
        if (!start[blank] || start[blank] == '#')
            continue;
        if (series->n_column == 0) {
            status = series_header(series->path, line, start, series, err);
            words = silt_alloc((size_t)series->n_column, sizeof *words);
            continue;
        }
        SILT_RESERVE(series->value, value_capacity, (series->n_row + 1) * series->n_column);
        SILT_RESERVE(series->line, line_capacity, series->n_row + 1);
        status = series_row(series->path, line, start, series, &words, err);
    }
    if (status == SILT_OK && series->n_row == 0)
        status =
            silt_fail(err, SILT_INPUT, "%s:%d: found no row of numbers, allowed a header line and at least one row",
                      series->path, line ? line : 1);
cleanup:
    free(words);
    free(text);
    if (status != SILT_OK)
        silt_series_clear(series);
    return status;
}

silt_status silt_series_rising(const silt_series *series, silt_error *err) {
    int m = series->n_column;
    if (m < 2)
        return silt_fail(err, SILT_INPUT, "%s: found one column, allowed time in s and at least one value",
                         series->path);
    for (int i = 0; i < series->n_row; i++) {
        const double *row = series->value + (size_t)i * m;
        for (int k = 0; k < m; k++)
            if (!isfinite(row[k]))
                return silt_fail(err, SILT_INPUT,
                                 "%s:%d: column '%s': found no finite number, allowed one in each cell", series->path,
                                 series->line[i], series->name[k]);
        if (i > 0 && row[0] <= row[-m])
            return silt_fail(err, SILT_INPUT, "%s:%d: column '%s': found %.17g after %.17g, allowed rising values",
                             series->path, series->line[i], series->name[0], row[0], row[-m]);
    }
    return SILT_OK;
}

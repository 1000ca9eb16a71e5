// a row of study.csv: cells with names, as the file of one run and in the table of all
#include <errno.h>
#include <unistd.h>

#include "study.h"

const char *const study_status_word[RUN_STATUS_COUNT] = {
    "ok", "cut-and-recovered", "warned", "beyond-bounds", "refused", "failed", "unfinished", "hung", "crashed", "wrong"};

void study_row_add(study_row *row, const char *name, const char *format, ...) {
    va_list list;
    char text[1024];
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    for (char *c = text; *c; c++)
        if ((unsigned char)*c < 32)
            *c = ' ';
    SILT_RESERVE(row->cell, row->capacity, row->n + 1);
    row->cell[row->n++] = (study_cell){silt_text("%s", name), silt_text("%s", text)};
}

const char *study_row_text(const study_row *row, const char *name) {
    for (int i = 0; i < row->n; i++)
        if (strcmp(row->cell[i].name, name) == 0)
            return row->cell[i].value;
    return NULL;
}

double study_row_number(const study_row *row, const char *name) {
    const char *text = study_row_text(row, name);
    double x;
    return text && silt_text_number(text, &x) ? x : NAN;
}

study_status study_row_status(const study_row *row) {
    const char *text = study_row_text(row, "status");
    for (int k = 0; text && k < RUN_STATUS_COUNT; k++)
        if (strcmp(text, study_status_word[k]) == 0)
            return (study_status)k;
    return RUN_CRASHED;
}

void study_row_clear(study_row *row) {
    for (int i = 0; i < row->n; i++) {
        free(row->cell[i].name);
        free(row->cell[i].value);
    }
    free(row->cell);
    *row = (study_row){0};
}

silt_status study_row_write(const study_row *row, const char *path, silt_error *err) {
    char *aside = silt_text("%s.part", path);
    FILE *to = fopen(aside, "w");
    for (int i = 0; to && i < row->n; i++)
        fprintf(to, "%s\t%s\n", row->cell[i].name, row->cell[i].value);
    const bool sound = to && !ferror(to);
    silt_status status = SILT_OK;
    // whole or not there: a study that is killed takes up from it
    if ((to && fclose(to) != 0) || !sound || rename(aside, path) != 0)
        status = silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", path, strerror(errno));
    free(aside);
    return status;
}

bool study_row_read(study_row *row, const char *path) {
    char *line = NULL;
    size_t capacity = 0;
    ssize_t length;
    *row = (study_row){0};
    FILE *from = fopen(path, "r");
    while (from && (length = getline(&line, &capacity, from)) > 0) {
        char *tab = strchr(line, '\t');
        if (!tab || line[length - 1] != '\n')
            continue;
        *tab = line[length - 1] = 0;
        study_row_add(row, line, "%s", tab + 1);
    }
    free(line);
    if (from)
        fclose(from);
    return row->n > 0;
}

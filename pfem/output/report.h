/** @file report.h
 * The inside of the report, shared by report*.c only.
 */
#ifndef SILT_REPORT_H
#define SILT_REPORT_H

#include "draw.h"
#include "plot.h"

// megabytes that the frames of the view may take unless told otherwise
#define REPORT_MEGABYTES 18.0

/** a page while it is written */
typedef struct silt_report_page {
    FILE *to;
    const char *out;
    const silt_scene *scene; // borrowed, the resolved one of OUT
    double bytes; // of the view's frames, at the most
} silt_report_page;

/** bytes as base64, without line ends */
void silt_report_base64(FILE *to, const void *data, size_t n);

/** history.csv by columns */
typedef struct silt_table {
    int n_column, n_row, capacity;
    char **name;    // owned, texts too
    double **value; // owned, n_row numbers a column, NaN where there is none
} silt_table;
/** Rows that are not whole are left out: the run may be going on. @return false: no header line */
bool silt_table_read(silt_table *table, const char *out);
void silt_table_clear(silt_table *table);
/** @return NULL: no such column */
const double *silt_table_column(const silt_table *table, const char *name);

// the sections; each writes nothing where there is nothing to say
void silt_report_checks(const silt_report_page *report);                          // report_check.c
void silt_report_ledgers(const silt_report_page *report, const silt_table *table); // report_ledger.c: what the scene keeps account of
void silt_report_gauges(const silt_report_page *report, const silt_table *table);
void silt_report_times(const silt_report_page *report, const silt_table *table);
/** The frames to turn and to play. @return NULL, or a word why there is no view (report_view.c) */
const char *silt_report_view(const silt_report_page *report, silt_draw_canvas *canvas, const silt_draw_book *book);

// report_text.c, made of report.css and report_view.js when silt is built
extern const char silt_report_css[], silt_report_script[];

#endif

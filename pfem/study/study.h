/** @file study.h
 * silt study: one scene over ranges of its keys; every run in a process of its own, what it gave in a row of study.csv,
 * plots. Flow: study_keys.c (file -> struct) -> study_points.c (ranges -> points) -> study.c (points -> jobs in
 * parallel) -> study_run.c (one run: child, limits, row file) -> study_result.c (what a run left -> row) ->
 * study_collect.c (rows -> study.csv)
 * -> study_plot.c, study_report.c (study.csv -> SVG, study.md).
 */
#ifndef SILT_STUDY_H
#define SILT_STUDY_H

#include "output.h"
#include "scene_keys.h"

/** what the command line asks for */
typedef struct silt_study_def {
    const char *path; // the study's file
    const char *out;  // folder of the results; NULL: by the file's name in the current folder
    int jobs;         // how many at once; 0: one
    int only;         // this job alone, from 1; 0: all
    bool plan;        // print a command per job and do nothing
    bool collect;     // rows to study.csv and plots alone
    bool force, quiet;
    int n_set;
    const char *const *set; // -D, keys of the study
    const char *worker;     // see silt_run_def
} silt_study_def;

/** Does, plans or collects a study; prints a table of what came of it. SILT_INPUT: a wrong file; SILT_FAILED: a run
 * that crashed, hung or is wrong (a run that failed or was refused is a result). */
silt_status silt_study(const silt_study_def *def, FILE *to, silt_error *err);
/** silt_scene_help for the keys of a study */
silt_status silt_study_help(const char *key, FILE *to, silt_error *err);
void silt_study_document(FILE *to); /**< the tables of docs/study.md */

// the study as it was read ------------------------------------------------------------------------------
/** a key that goes along with another */
typedef struct study_with {
    char *key;     // owned
    char *form;    // owned, value with the number (or text) in the place of %
    double factor; // on the number
} study_with;

typedef enum { RANGE_VALUES = 1, RANGE_LINEAR, RANGE_LOG, RANGE_RANDOM, RANGE_LOG_RANDOM } study_range_kind;
typedef struct study_range {
    char *key, *form; // owned
    study_range_kind kind;
    int n_value, count;
    char **value; // owned, RANGE_VALUES
    double low, high;
    int n_text;
    char **text; // owned, the values of any kind as texts (study_points)
    int n_with;
    study_with *with; // owned
} study_range;

/** bisection on a key until a check's number is what is asked for */
typedef struct study_seek {
    bool on;
    char *key, *form; // owned
    char *check;      // owned, name of a check of the scene with a scalar
    double low, high; // of the key
    int log;          // halves are of the logarithm
    double value;     // that the check's scalar shall have
    double tolerance; // on it, relative; absolute when value is 0
    int runs;         // most
    int n_with;
    study_with *with; // owned
} study_seek;

typedef enum { PLOT_TIME = 1, PLOT_ORDER, PLOT_COST, PLOT_MAP } study_plot_kind;
typedef struct study_plot {
    study_plot_kind kind;
    char *name, *x, *y, *check, *by; // owned
} study_plot;

typedef enum { COMBINE_GRID = 0, COMBINE_TOGETHER } study_combine;
typedef struct study {
    char *path, *folder; // owned
    int version;
    char *title, *scene; // owned
    int n_set;
    char **set; // owned
    int n_range;
    study_range *range; // owned
    study_combine combine;
    int seed, repeats, threads;
    double limit;  // s of processor a run
    double memory; // bytes / 1e9
    struct {
        bool on;
        double volume, mass, sediment, energy;
    } bounds;
    int keep; // study_keep
    study_seek seek;
    int n_plot;
    study_plot *plot; // owned
} study;
typedef enum { KEEP_NOTHING = 0, KEEP_BAD, KEEP_ALL } study_keep;

extern const silt_key_table study_keys;
silt_status study_read(study *s, const silt_study_def *def, silt_error *err);
void study_clear(study *s);

// points (study_points.c) -------------------------------------------------------------------------------
/** fills range[].text of all ranges */
void study_points(study *s);
int study_count(const study *s); // points
/** text of range r at point k */
const char *study_value(const study *s, int k, int r);
/** appends what a key and those that go with it become as -D takes it; the texts are owned by the caller */
void study_assign(char ***set, int *n_set, int *capacity, const char *key, const char *form, int n_with,
                  const study_with *with, const char *value);

// one run -----------------------------------------------------------------------------------------------
typedef enum {
    RUN_OK = 0,
    RUN_CUT,
    RUN_WARNED,
    RUN_BEYOND,
    RUN_REFUSED,
    RUN_FAILED,
    RUN_UNFINISHED,
    RUN_HUNG,
    RUN_CRASHED,
    RUN_WRONG,
    RUN_STATUS_COUNT
} study_status;
extern const char *const study_status_word[RUN_STATUS_COUNT];

/** one cell of a row; rows are lists of them, so that each run may have other columns */
typedef struct study_cell {
    char *name, *value; // owned
} study_cell;
typedef struct study_row {
    int n, capacity;
    study_cell *cell; // owned
} study_row;
void study_row_add(study_row *row, const char *name, const char *format, ...) __attribute__((format(printf, 3, 4)));
const char *study_row_text(const study_row *row, const char *name); // NULL: no such cell
double study_row_number(const study_row *row, const char *name);    // NAN: none, or no number
study_status study_row_status(const study_row *row);
void study_row_clear(study_row *row);
/** name value a line; what cannot be read is an empty row */
silt_status study_row_write(const study_row *row, const char *path, silt_error *err);
bool study_row_read(study_row *row, const char *path);

/** how the child ended */
typedef struct study_end {
    int code; // exit code, -1: by a signal
    int signal;
    bool late, stalled; // the limit came; no step in the last half of the time
    double cpu, wall;   // s
    double memory;      // bytes, peak
} study_end;
/** what a run left in its folder and log, as cells of the row (study_result.c) */
void study_result(const study *s, const char *out, const char *log, const study_end *end, study_row *row);

/** Runs the scene with these -D in OUT/runs/NAME.out, or takes the row of an earlier such run; row: what came of it.
 * @param head  cells that the row begins with */
silt_status study_run(const study *s, const silt_study_def *def, const char *out, const char *name, int n_set,
                      char *const *set, const study_row *head, study_row *row, silt_error *err);
/** job k, from 0: the repeats of a point, or its search */
silt_status study_job(const study *s, const silt_study_def *def, const char *out, int k, silt_error *err);

// rows of all runs --------------------------------------------------------------------------------------
typedef struct study_table {
    int n, capacity;
    study_row *row; // owned
} study_table;
/** reads the rows that are there and writes OUT/study.csv */
silt_status study_collect(const study *s, const char *out, study_table *table, silt_error *err);
void study_table_clear(study_table *table);
/** plots that are asked for, or those that suit; a missing gnuplot is told to `to`, and the CSV stays */
silt_status study_plots(const study *s, const char *out, const study_table *table, FILE *to, silt_error *err);
/** a least-squares line through the logarithms of what is positive in both; by: of the rows that have this value there,
 * NULL: of all.
 * @return points used */
int study_slope(const study_table *table, const char *x, const char *y, const char *by, const char *value,
                double *slope, double *at_one);
/** the k-th of the different values in a column, in the order of the rows; NULL: there are no more (by NULL: one, "")
 */
const char *study_distinct(const study_table *table, const char *by, int k);
/** the row is of that value */
bool study_row_of(const study_row *row, const char *by, const char *value);
/** columns that a plot is drawn over; y is the caller's to free */
void study_axes(const study *s, const study_table *table, const study_plot *plot, const char **x, char **y);
/** OUT/study.md: maps in characters, reasons, orders; the short form to `to` */
silt_status study_report(const study *s, const char *out, const study_table *table, FILE *to, silt_error *err);

#endif

/** @file output.h
 * What a run leaves behind: history.csv, frames, summary.json, pictures, checks.
 */
#ifndef SILT_OUTPUT_H
#define SILT_OUTPUT_H

#include "bed.h"
#include "seep.h"

#define SILT_PHASES(X) X(mesh) X(assemble) X(solve) X(bed) X(dem) X(move) X(output)
typedef enum {
#define X(name) PHASE_##name,
    SILT_PHASES(X)
#undef X
        PHASE_COUNT
} silt_phase;

/** everything that output may look at, borrowed from the run; absent parts are NULL */
typedef struct silt_view {
    const silt_scene *scene;
    const silt_nodes *nodes;      // NULL without fluid
    const silt_mesh *mesh;
    const silt_locator *locator;  // of mesh at the present positions
    const double *solid;          // 1 - porosity per node, NULL: 0
    const silt_bed *bed;
    const silt_grain_state *grains;
    const silt_body_state *bodies;
    const silt_ledger *ledger;
    const double (*wall_force)[3]; // N, of the water on each wall of the scene in the last step (silt_wall_forces), NULL: none
    int64_t step;
    double time, dt;
    double wall[PHASE_COUNT]; // s, of the last step
    int iterations;           // of the last step
} silt_view;

// gauge.c ------------------------------------------------------------------------------------------
typedef struct silt_gauges silt_gauges; // keeps what gauges need from the start (bed level)
silt_status silt_gauges_create(silt_gauges **gauges, const silt_view *start, silt_error *err);
void silt_gauges_free(silt_gauges **gauges);
int silt_gauges_count(const silt_scene *scene);                        // number of history columns
void silt_gauges_name(const silt_scene *scene, int column, char name[64]);
void silt_gauges_read(silt_gauges *gauges, const silt_view *view, double *value); // NaN where there is nothing to measure
/** the grains that hang together, those with the most mass */
typedef struct silt_heap {
    int in_capacity, parent_capacity, mass_capacity;
    uint8_t *in;  // owned, one per grain
    int *parent;  // owned, groups of grains
    double *mass; // owned, of a group at its lowest grain
} silt_heap;
void silt_heap_find(silt_heap *heap, const silt_view *view);
/** front, height or slope of the heap that was found; NaN where there is none */
double silt_heap_gauge(const silt_heap *heap, const silt_view *view, const silt_gauge_def *def);
void silt_heap_clear(silt_heap *heap);
/** place, velocity, spin or contact force of one grain; value keeps what it holds where that is gone */
void silt_grain_gauge(const silt_view *view, const silt_gauge_def *def, double value[3]);
/** what gauges keep from the start goes through checkpoints: after a resume create, then load */
silt_status silt_gauges_save(const silt_gauges *gauges, silt_store *store, silt_error *err);
silt_status silt_gauges_load(silt_gauges *gauges, silt_store *store, silt_error *err);
/** Shares the reactions of a step among the walls of the scene; before its nodes move, while they are those of the step.
 * Where walls meet, a reaction is taken apart along their normals; what these do not span is halved.
 * @param reaction  dim per node, N, force of walls, bed and bodies on the water (silt_fluid)
 * @param force  out, one per wall of the scene, N, force of the water on it; in 2-D per m of width, z = 0 */
void silt_wall_forces(const silt_walls *walls, const silt_nodes *nodes, const silt_mesh *mesh, const double *reaction,
                      double (*force)[3]);
/** Angular momentum of the water about a point, kg m2/s: sum of lumped mass times arm times velocity, drops included, the
 * share of grains (solid, one per node, NULL: none) left out. In 2-D the last component only. */
void silt_water_moment(const silt_nodes *nodes, const silt_mesh *mesh, const double *solid, double density,
                       const double about[3], double moment[3]);

// history.c ----------------------------------------------------------------------------------------
typedef struct silt_history silt_history;
silt_status silt_history_create(silt_history **history, const char *out, const silt_scene *scene, silt_error *err);
/** opens an existing history.csv, cuts rows with step > last away, goes on behind it */
silt_status silt_history_reopen(silt_history **history, const char *out, const silt_scene *scene, int64_t last, silt_error *err);
silt_status silt_history_row(silt_history *history, const silt_view *view, const double *gauge, silt_error *err);
/** a column of the row that the view has, by its name; NaN where there is no such column */
double silt_history_value(silt_history *history, const silt_view *view, const double *gauge, const char *column);
/** forces the rows to the disk; before a checkpoint is committed, so that no checkpoint is ahead of its history */
silt_status silt_history_sync(silt_history *history, silt_error *err);
silt_status silt_history_close(silt_history **history, silt_error *err);

/** index of a name in the header line, -1: absent; the number of a row in that column, NaN: none (verify.c) */
int silt_history_find(const char *header, const char *name);
double silt_history_number(const char *row, int column);

// frame.c ------------------------------------------------------------------------------------------
/** writes fluid_NNNNNN.hdf etc., the .series indices, run.h5 and a line of run.log */
silt_status silt_frame_write(const char *out, int number, const silt_view *view, silt_error *err);
/** after a resume: drops index entries of frames past `number` */
silt_status silt_frame_cut(const char *out, int number, silt_error *err);
typedef struct silt_frame_entry {
    int number;
    double time; // s
} silt_frame_entry;
/** the frames that OUT's indices name, in order. @return how many; *entry is owned by the caller */
int silt_frame_index(const char *out, silt_frame_entry **entry);

// grid.c -------------------------------------------------------------------------------------------
/** what one file of a frame holds */
typedef struct silt_grid {
    int n_point, n_cell;
    double *x;      // owned, 3 per point, m
    int *offset;    // owned, n_cell + 1: where the corners of each cell begin in `link`
    int *link;      // owned, points of the cells
    double *value;  // owned, the array that was asked for, `width` numbers a point (or cell); NULL: it is not there
    int width;
    double *radius; // owned, grains only
    int *kind;      // owned, silt_node_kind of the fluid's points, silt_facet_kind of the surface's cells; NULL elsewhere
    double time;    // s
} silt_grid;
/** Reads OUT/PART_NNNNNN.hdf; array like "PointData/pressure", NULL: none. @return false when there is no such file */
bool silt_grid_read(silt_grid *grid, const char *out, const char *part, int number, const char *array);
void silt_grid_clear(silt_grid *grid);
static inline int silt_grid_corners(const silt_grid *grid, int cell) { return grid->offset[cell + 1] - grid->offset[cell]; }

// bounds.c -----------------------------------------------------------------------------------------
/** what a run may be off by: the scene's bounds block */
typedef enum { BOUND_VOLUME = 0, BOUND_MASS, BOUND_ENERGY, BOUND_COUNT } silt_bound_kind;
extern const char *const silt_bound_word[BOUND_COUNT];
typedef struct silt_bound {
    double worst; // share
    double time;  // s, when
} silt_bound;
typedef struct silt_bounds {
    silt_bound of[BOUND_COUNT]; // energy: NaN where the history does not tell all of it
    int64_t rows;               // of history.csv
    char bad[64];               // its first column with a number that is none
    double bad_time;            // s
} silt_bounds;
/** Reads them from OUT/history.csv. @return false: it has no rows */
bool silt_bounds_measure(const silt_scene *scene, const char *out, silt_bounds *bounds);
/** @return true: more than the scene allows; text says by how much and what to do */
bool silt_bounds_broken(const silt_bounds *bounds, const silt_scene *scene, silt_bound_kind kind, double *allowed, char text[256]);

// summary.c ----------------------------------------------------------------------------------------
typedef struct silt_summary {
    const char *status;           // "done", "failed", "stopped"
    const char *message;          // why, when not done
    double seconds;               // wall clock of this process' run
    double phase[PHASE_COUNT];    // s, summed
    double node_steps;            // sum over steps of nodes
    double worst_volume_error, worst_sediment_error, worst_momentum_error;
    int64_t steps, retries, iterations, most_iterations, clipped; // clipped: motions of bodies whose inertia in the water was less than nought
    silt_bounds bounds;           // of the whole run; without rows: not measured
} silt_summary;
silt_status silt_summary_write(const char *out, const silt_view *view, const silt_summary *summary, silt_error *err);
struct fy_document; // of libfyaml
/** OUT/summary.json; NULL: absent or broken */
struct fy_document *silt_summary_open(const char *out);
void silt_summary_close(struct fy_document *summary);
/** a scalar of it by its path, "/phases/mesh/seconds"; "" and 0 where there is none */
const char *silt_summary_text(struct fy_document *summary, const char *key);
double silt_summary_number(struct fy_document *summary, const char *key);
/** a text in quotes or null; a name with its number (NaN and infinity: null) and what follows it */
void silt_json_text(FILE *to, const char *text);
void silt_json_number(FILE *to, const char *name, double value, const char *end);
void silt_progress(const silt_view *view, double until, double seconds, bool last); // one terminal line on stderr

// verify.c, draw.c, info.c ---------------------------------------------------------------------------
/** one check of the scene, measured */
typedef struct silt_check_result {
    const char *name;      // borrowed from the scene
    double value;          // the scalar; for a curve the result where it is worst
    double reference;      // expected there
    double error, tolerance;
    bool pass;
    char note[256];        // why there is no value, or how much of the reference was covered; else empty
} silt_check_result;
/** Holds OUT/history.csv against the scene's checks; result has scene->n_check items. References are looked for in OUT
 * first, then beside the scene. A check that cannot be measured fails with a note; only an unreadable history is an error. */
silt_status silt_check_measure(const silt_scene *scene, const char *out, silt_check_result *result, silt_error *err);
/** Copies the files that the scene reads (references, series, surfaces, outlines, clouds) into OUT and writes OUT/scene.yaml: the resolved scene,
 * which names the copies, so that OUT can be verified, resumed and run again anywhere. */
silt_status silt_verify_copy(const silt_scene *scene, const char *out, silt_error *err);
/** what pictures are asked for; all zero: the last frame, coloured by speed, into OUT */
typedef enum { DRAW_LAST = 0, DRAW_ALL, DRAW_ONE } silt_draw_frames;
typedef struct silt_draw_def {
    silt_draw_frames frames;
    int frame;           // of DRAW_ONE
    const char *field;   // mesh, pressure, speed, elevation, vorticity, porosity, eddies, bed; NULL: speed
    const char *slice;   // "y=0.5": a plane cut through three dimensions; NULL: none
    const char *without; // "water,grains": what is left out, of water, bed, grains, bodies, walls; NULL: nothing
    const char *to;      // folder of the pictures; NULL: OUT
    const char *film;    // all frames as this moving picture instead (draw_film.c); NULL: none
} silt_draw_def;
/** PNG pictures of frames, TO/picture_NNNNNN.png; say: a line a file, NULL: none */
silt_status silt_draw(const char *out, const silt_draw_def *def, FILE *say, silt_error *err);

// report.c -------------------------------------------------------------------------------------------
typedef struct silt_report_def {
    const char *path;    // of the page; NULL: OUT/report.html
    silt_draw_def draw;  // field, slice and without of its pictures
    double megabytes;    // of the view's frames; 0: 20
} silt_report_def;
/** One HTML page on a run that needs no network: what ran, pictures, a view to turn, checks, ledgers, times. It may be made while the
 * run goes. say: what it lacks and where it is, NULL: nothing */
silt_status silt_report(const char *out, const silt_report_def *def, FILE *say, silt_error *err);

// pictures.c ------------------------------------------------------------------------------------------
/** silt_draw and silt_report: a module has them, so that nothing else loads cairo */
typedef struct silt_pictures {
    silt_status (*draw)(const char *out, const silt_draw_def *def, FILE *say, silt_error *err);
    silt_status (*report)(const char *out, const silt_report_def *def, FILE *say, silt_error *err);
} silt_pictures;
silt_status silt_pictures_load(const silt_pictures **pictures, silt_error *err);
silt_status silt_info(const char *path, FILE *to, silt_error *err);
/** the part of it about a scene */
void silt_info_scene(const silt_scene *scene, FILE *to);
/** info_parts.c: what the scene uses and what that costs, and what it goes without */
void silt_info_parts(const silt_scene *scene, FILE *to);
/** bytes that are kept from step to step: of a node of the water, of the bed, of the bed with water in its pores on top, of a node of the
 * water where grains or bodies are, of a grain. As measured: tests/test_parts.c holds them. */
typedef struct silt_costs {
    double water, bed, seepage, coupling, grain;
} silt_costs;
extern const silt_costs silt_costs_measured[2]; // in the plane, in space
/** warn.c: prints what is allowed but probably not meant, a line each; @return how many */
int silt_scene_warn(const silt_scene *scene, FILE *to);

#endif

/** @file coupling.h
 * The door between the time loop and the discrete elements. pfem/ knows this table only; dem-coupling/coupling.c fills it.
 * Everything on this side is per metre of width in 2-D; the coupling scales to real spheres and back. In 3-D spheres are what they are.
 */
#ifndef SILT_COUPLING_H
#define SILT_COUPLING_H

#include "bed.h"

typedef struct silt_coupling silt_coupling; // opaque, owned by the run

typedef struct silt_coupling_def {
    const silt_scene *scene; // borrowed
    const silt_walls *walls; // borrowed
    const silt_bed *bed;     // borrowed, NULL without bed
    const char *worker;      // path of silt-dem
    const char *log;         // OUT/dem.log
    const char *trace;       // OUT/trace.csv
    bool resumed;            // the run goes on from a checkpoint
    double lo[3], hi[3];     // the domain's box (with margin): what leaves it has left
    double margin;           // m, of that box around what the scene spans
    double way_lo[3], way_hi[3]; // m, what walls with a motion span from the start to the end
} silt_coupling_def;

/** what passed between grains, water and the rest in a step: N per m of width, mean over the step */
typedef struct silt_exchanged {
    double grains[3];  // the water's force on all grains, pressure gradient and drag
    double size;       // the magnitudes of its parts, grain by grain: what an error of it is relative to
    double water[3];   // the grains' drag on the water: sum over nodes of push - coefficient velocity
    double contact[3]; // of all contacts on all grains; those of grains with each other cancel
} silt_exchanged;

typedef struct silt_coupling_type {
    silt_status (*open)(silt_coupling **coupling, const silt_coupling_def *def, silt_error *err);
    /** s, the discrete elements' time step; the fluid's step is an integer multiple of it */
    double (*step)(const silt_coupling *coupling);
    /** radius in m of a parcel with this solid mass per metre of width */
    double (*parcel_radius)(const silt_coupling *coupling, double mass);
    const silt_grain_state *(*grains)(const silt_coupling *coupling); // count 0 when there are none
    silt_body_state *(*bodies)(const silt_coupling *coupling);        // count 0 when there are none

    /** Before the water's step: finds the grains in the mesh, spreads their volume, prepares the drag for a step dt.
     * *drag is NULL when no grain is in the water. May be called again with another dt; with 0 only the volume is spread
     * (drag->solid), the rest of the drag is not to be used. */
    silt_status (*prepare)(silt_coupling *coupling, const silt_nodes *nodes, const silt_mesh *mesh, double dt,
                           const silt_drag **drag, silt_error *err);
    /** After the water's step, before nodes move: forces on grains from the accepted pressure and the velocity that the drag
     * was solved with (nodes->v must be the fluid's w, and nodes->x its midpoint mesh; their sum is then what the water felt),
     * forces on bodies: force and torque in bodies()->body[] were set by the run. */
    void (*load)(silt_coupling *coupling, const silt_nodes *nodes, const silt_mesh *mesh, double dt);

    /** Before start: in every substep R C is added to the forces and torques C of contacts on free bodies, 6 numbers a body; size
     * rows and columns. bodies()->body[].force and torque then tell what the water exerted in all. */
    void (*respond)(silt_coupling *coupling, int size, const double *matrix);
    /** After load: a step of the random walk of suspended grains, if the scene asks for it. viscosity: per cell of the water, Pa s,
     * with its eddies; step: counts the steps of the run. Grains are where they go at the next start. */
    void (*walk)(silt_coupling *coupling, const silt_nodes *nodes, const silt_mesh *mesh, const double *viscosity, double dt, int64_t step);
    /** After load: the gusts of the step that begins at `time`, if the scene asks for them. */
    void (*gusts)(silt_coupling *coupling, const silt_nodes *nodes, const silt_mesh *mesh, const double *viscosity, double time);

    /** a line about every body of a scene: volume, mass, clump; errors as open's for bodies, walls apart */
    silt_status (*describe)(const silt_scene *scene, FILE *to, silt_error *err);
    /** of the last load and the last substeps */
    void (*exchanged)(const silt_coupling *coupling, silt_exchanged *exchanged);
    /** Points on a body's outline at spacing h, corners kept, in the body's frame, dim numbers each; in space those of its surface,
     * which has the local size. @return how many (none written beyond capacity) */
    int (*outline)(const silt_coupling *coupling, int body, double h, double *point, int capacity);

    /** true when a sphere fits there: overlap with grains, frozen spheres, bodies and walls at most 1 % of its radius.
     * Ask after bed_changed: the frozen spheres of a patch fill the place where its parcel goes. */
    bool (*room)(const silt_coupling *coupling, const double x[3], double radius);
    void (*release)(silt_coupling *coupling, int n, const silt_release *release); // queued
    void (*deposit)(silt_coupling *coupling, int grain);  // grain: index into grains(); becomes a frozen sphere, queued
    /** the bed's surface changed (bed->revision): the frozen spheres along it are brought up to date, queued */
    void (*bed_changed)(silt_coupling *coupling, const silt_bed *bed);
    /** The next start need not set the discrete elements up anew. Such set-ups must come at the same steps whatever happens to the
     * run, and at every step that begins from a checkpoint. */
    void (*keep)(silt_coupling *coupling);
    /** Runs n substeps: start returns at once, finish waits and refreshes grains() and bodies(). */
    silt_status (*start)(silt_coupling *coupling, int n, silt_error *err);
    silt_status (*finish)(silt_coupling *coupling, silt_error *err);
    /** After a finish that failed, before the next prepare: new discrete elements with grains and bodies as they were at the start;
     * contacts forget their tangential springs. @return SILT_FAILED when they were ended from outside: that is no fault of the step */
    silt_status (*recover)(silt_coupling *coupling, silt_error *err);
    /** sediment that crossed an outlet of the scene out of the water since the start: kg per m of width, m3 of water that it
     * displaced there, grains */
    void (*left)(const silt_coupling *coupling, double *mass, double *solid, int64_t *count);
    silt_status (*save)(silt_coupling *coupling, silt_store *store, silt_error *err);
    silt_status (*load_state)(silt_coupling **coupling, const silt_coupling_def *def, silt_store *store, silt_error *err);
    int (*process)(const silt_coupling *coupling);
    void (*close)(silt_coupling **coupling);
} silt_coupling_type;

/** dem-coupling/coupling.c; linked into the program, loads nothing before open */
extern const silt_coupling_type silt_coupling_dem;

#endif

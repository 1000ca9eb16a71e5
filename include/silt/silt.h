/** @file silt.h
 * The product's C API: read a scene, run it or step through it, resume it, hold the result against its checks.
 * A function that can fail returns a silt_status and fills a silt_error (which may be NULL); nothing here exits. silt_scene_run and
 * silt_run_resume print a progress line on stderr unless quiet, and take SIGTERM and SIGUSR1 while they last. Exhausted memory alone
 * ends the program. Several runs may be open at once in a process, each in a folder of its own; call them from one thread at a time.
 */
#ifndef SILT_SILT_H
#define SILT_SILT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SILT_API __attribute__((visibility("default")))
#define SILT_VERSION "0.1.0"

SILT_API const char *silt_version(void); /**< of the library, SILT_VERSION is that of this header */

/** What became of a call. The command line maps these to exit codes: OK 0, FAILED 1, INPUT 2, STOPPED 3. */
typedef enum silt_status {
    SILT_OK = 0,
    SILT_FAILED = 1,  /**< the run or a check failed, or the machine did (disk, memory, worker) */
    SILT_INPUT = 2,   /**< wrong usage or a wrong scene */
    SILT_STOPPED = 3, /**< stopped by a signal, a checkpoint is written */
} silt_status;

/** A complete message, written at the place of knowledge. Callers pass it up, they add nothing. */
typedef struct silt_error {
    silt_status status;
    char text[16384]; /**< the message(s), one per line group, ready to print; several scene errors stand in it in a row */
    int count;       /**< how many errors are in text */
} silt_error;

typedef struct silt_scene silt_scene; /**< what was asked; constant once read */
typedef struct silt_run silt_run;     /**< what happens; mutable */

/** Reads and checks a scene.
 * @param path     YAML (or JSON) file
 * @param set      n_set strings "path=value" (-D), applied before checking; borrowed
 * @param scene    out, owned by the caller, freed with silt_scene_free
 * Errors: SILT_INPUT with every key error at once. */
SILT_API silt_status silt_scene_read(const char *path, int n_set, const char *const *set, silt_scene **scene,
                                     silt_error *err);
SILT_API void silt_scene_free(silt_scene **scene); /**< takes NULL, frees, sets NULL */

/** How to run a scene. Zero means the default. */
typedef struct silt_run_def {
    const char *out;   /**< output folder, NULL: the scene's folder name plus ".out" in the current folder */
    const char *worker; /**< path of silt-dem, NULL: beside the program, else the installed one */
    double until;      /**< s, 0: the scene's time.end */
    int threads;       /**< 0: all */
    bool force;        /**< replace an existing output folder */
    bool quiet;        /**< no progress line */
} silt_run_def;

/** Runs a scene from its start. SILT_STOPPED after SIGTERM. */
SILT_API silt_status silt_scene_run(const silt_scene *scene, const silt_run_def *def, silt_error *err);
/** Goes on from the newest whole checkpoint in def->out. */
SILT_API silt_status silt_run_resume(const silt_run_def *def, silt_error *err);
/** Holds a folder of results against the checks of its scene; prints a line a check to `to`. SILT_FAILED when one fails. */
SILT_API silt_status silt_verify(const char *out, FILE *to, silt_error *err);

/* ---- step by step: start or take_up, advance until ended, finish ---- */

/** Makes the output folder and the state at t = 0 with its row and frame.
 * @param run    out, owned by the caller until silt_run_finish; NULL when it failed
 * @param scene  borrowed, until silt_run_finish */
SILT_API silt_status silt_run_start(silt_run **run, const silt_scene *scene, const silt_run_def *def, silt_error *err);
/** The same from the newest whole checkpoint in def->out. */
SILT_API silt_status silt_run_take_up(silt_run **run, const silt_run_def *def, silt_error *err);
/** One step, with its row and, if it is due, its frame; also past the scene's end. After a failure only silt_run_finish may follow. */
SILT_API silt_status silt_run_advance(silt_run *run, silt_error *err);
SILT_API bool silt_run_ended(const silt_run *run); /**< true at the scene's (or def->until's) end */
/** Writes a checkpoint of the present state. With grains or bodies: a run that goes on from it does so to the same bits only where
 * silt_scene_run would have written one, at the end of a frame. */
SILT_API silt_status silt_run_checkpoint(silt_run *run, silt_error *err);
/** Writes the summary, closes, frees and sets NULL. @param status  what the last call gave: it is told in the summary, and a
 * failed run leaves a checkpoint of its last whole step. @return status, or what closing itself met */
SILT_API silt_status silt_run_finish(silt_run **run, silt_status status, silt_error *err);

/** What a run holds at this moment. All arrays are borrowed until the next call with the run; SI units; in 2-D cell[][3] is -1. */
typedef struct silt_fields {
    int dim;
    int64_t step;
    double time, dt;       /**< s, now; of the last step */
    int n_node;            /**< 0 without water */
    const double *x, *v;   /**< dim per node, m and m/s */
    const double *p;       /**< per node, Pa */
    int n_cell;
    const int (*cell)[4];  /**< nodes of each triangle or tetrahedron of water */
    int n_grain;
    const int64_t *grain_id;
    const double *grain_x, *grain_v; /**< 3 per grain */
    const double *grain_radius;      /**< m */
    int n_body;                      /**< see silt_run_body */
} silt_fields;
SILT_API void silt_run_fields(silt_run *run, silt_fields *fields);

/** where a rigid body is and how it moves */
typedef struct silt_pose {
    double x[3], v[3]; /**< centroid, m; m/s */
    double q[4], w[3]; /**< orientation w, x, y, z; rad/s */
} silt_pose;
/** @return false where the scene has no body of that name */
SILT_API bool silt_run_body(silt_run *run, const char *name, silt_pose *pose);
/** The present value of any column of history.csv, gauges and forces on bodies among them; NaN where there is none of that name. */
SILT_API double silt_run_value(silt_run *run, const char *column);

#ifdef __cplusplus
}
#endif
#endif

/** @file silt.h
 * The product's C API: read a scene, run it, resume it, hold the result against its checks.
 * A function that can fail returns a silt_status and fills a silt_error; nothing here exits. A run prints a progress line on
 * stderr unless it is quiet, and takes SIGTERM and SIGUSR1 while it lasts. Exhausted memory alone ends the program.
 */
#ifndef SILT_SILT_H
#define SILT_SILT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SILT_API __attribute__((visibility("default")))
#define SILT_VERSION "0.1.0"

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

#ifdef __cplusplus
}
#endif
#endif

/** @file run_folder.h
 * A run in a folder of its own, for tests of single steps; after cmocka.h.
 */
#ifndef SILT_RUN_FOLDER_H
#define SILT_RUN_FOLDER_H

#include <dirent.h>
#include <unistd.h>

#include "check.h"
#include "run.h"

static char folder[512];

// the scene at its start, in a new folder
static inline void folder_begin(silt_run *run, const silt_scene *scene) {
    const silt_run_def def = {.quiet = true};
    snprintf(folder, sizeof folder, "%s/tests/run-XXXXXX", SILT_BINARY);
    assert_non_null(mkdtemp(folder));
    OK(silt_run_open(run, scene, &def, folder, -1, &error));
}

static inline void end(silt_run *run, silt_scene **scene) {
    silt_run_free(run);
    silt_scene_free(scene);
    DIR *list = opendir(folder);
    for (struct dirent *entry; list && (entry = readdir(list));)
        if (entry->d_name[0] != '.')
            unlinkat(dirfd(list), entry->d_name, 0);
    closedir(list);
    rmdir(folder);
}

#endif

/** @file scene_folder.h
 * Scenes that tests write, read, and expect to be right or wrong, in a folder of their own; after cmocka.h.
 */
#ifndef SILT_SCENE_FOLDER_H
#define SILT_SCENE_FOLDER_H

#include <errno.h>

#include "scene.h"

static char folder[4096]; // temporary

static inline const char *place(const char *name) {
    static char path[32][4400];
    static int i;
    i = (i + 1) % 32;
    snprintf(path[i], sizeof path[i], "%s/%s", folder, name);
    return path[i];
}

static inline const char *make(const char *name, const void *text, size_t size) {
    const char *path = place(name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, size, file), size);
    fclose(file);
    return path;
}

static inline const char *make_text(const char *name, const char *text) {
    return make(name, text, strlen(text));
}

static inline char *slurp(const char *path, size_t *size) {
    FILE *file = fopen(path, "rb");
    if (!file)
        fail_msg("%s: %s", path, strerror(errno));
    char *text = silt_alloc(1 << 20, 1);
    *size = fread(text, 1, (1 << 20) - 1, file);
    fclose(file);
    return text;
}

static inline silt_scene *right(const char *path, int n_set, const char *const *set) {
    silt_error err = {0};
    silt_scene *scene = NULL;
    if (silt_scene_read(path, n_set, set, &scene, &err) != SILT_OK)
        fail_msg("%s", err.text);
    assert_non_null(scene);
    return scene;
}

// a scene that must be refused with this in the message
static inline void wrong(const char *path, int n_set, const char *const *set, int count, const char *part) {
    silt_error err = {0};
    silt_scene *scene = (silt_scene *)&err;
    assert_int_equal(silt_scene_read(path, n_set, set, &scene, &err), SILT_INPUT);
    assert_null(scene);
    assert_int_equal(err.status, SILT_INPUT);
    if (!strstr(err.text, part))
        fail_msg("not in the message: %s\n%s", part, err.text);
    if (count && err.count != count)
        fail_msg("%d errors, not %d:\n%s", err.count, count, err.text);
}

#endif

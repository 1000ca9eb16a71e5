// a scene from its text, for tests that build their benches from a few lines of YAML
#ifndef SILT_TEST_SCENE_TEXT_H
#define SILT_TEST_SCENE_TEXT_H

#include <unistd.h>

#include "scene.h"

static silt_scene *scene_of(const char *text) {
    char path[] = "/tmp/silt-scene-XXXXXX";
    const int fd = mkstemp(path);
    assert_true(fd >= 0 && write(fd, text, strlen(text)) == (ssize_t)strlen(text));
    close(fd);
    silt_scene *scene = NULL;
    silt_error err = {0};
    if (silt_scene_read(path, 0, NULL, &scene, &err) != SILT_OK)
        fail_msg("%s", err.text);
    unlink(path);
    return scene;
}

#endif

// scenes: any bytes are refused with a word, or are a scene whose resolved text is read to the same text.
// The tables and surfaces of tests/wrong and tests/scenes lie beside it.
#include "fuzz.h"
#include "scene_keys.h"

static void link_files(const char *from) {
    char to[512], target[512];
    DIR *folder = opendir(from);
    for (struct dirent *entry; folder && (entry = readdir(folder));) {
        const char *dot = strrchr(entry->d_name, '.');
        snprintf(target, sizeof target, "%s/%s", from, entry->d_name);
        snprintf(to, sizeof to, "%s/%s", fuzz_folder, entry->d_name);
        // what is there already stays
        if (dot && (strcmp(dot, ".csv") == 0 || strcmp(dot, ".stl") == 0) && symlink(target, to) != 0)
            continue;
    }
    if (folder)
        closedir(folder);
}

// libfyaml 0.7.12 keeps a list of its own with each quoted text of more than four escapes (its issue 233); that the reader gives back what
// it had from there is seen by `scene` in a build with SILT_SANITIZE, which passes nothing over
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) { return "leak:libfyaml\n"; }

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    silt_scene *scene = NULL, *again = NULL;
    silt_error err = {0};
    if (fuzz_folder_make()) {
        link_files(SILT_SOURCE "/tests/wrong");
        link_files(SILT_SOURCE "/tests/scenes");
    }
    const silt_status status = silt_scene_read(fuzz_file("scene.yaml", data, size), 0, NULL, &scene, &err);
    FUZZ_HOLDS(status == SILT_OK || (status == SILT_INPUT && err.text[0] && !scene));
    if (status != SILT_OK)
        return 0;
    char *text = silt_scene_text(scene, true);
    if (silt_scene_read(fuzz_file("again.yaml", text, strlen(text)), 0, NULL, &again, &err) != SILT_OK) {
        fprintf(stderr, "%s\n%s\n", text, err.text);
        abort();
    }
    char *text_again = silt_scene_text(again, true);
    FUZZ_HOLDS(strcmp(text, text_again) == 0);
    FUZZ_HOLDS(silt_scene_hash(scene) == silt_scene_hash(again));
    free(text);
    free(text_again);
    silt_scene_free(&scene);
    silt_scene_free(&again);
    return 0;
}

/** @file output_folder.h
 * What the tests of the output share: a folder of their own, its files as text, a scene.
 */
#ifndef SILT_OUTPUT_FOLDER_H
#define SILT_OUTPUT_FOLDER_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <sys/stat.h>
#include <unistd.h>

#include "output.h"

static char folder[512]; // made new for every run of the tests, below the build folder

#define near(a, b, tolerance) near_at((a), (b), (tolerance), __LINE__)
static inline void near_at(double a, double b, double tolerance, int line) {
    if (!(fabs(a - b) <= tolerance))
        fail_msg("line %d: %.17g is not %.17g within %g", line, a, b, tolerance);
}

static inline const char *place(const char *name) {
    static char path[4][640];
    static int turn;
    turn = (turn + 1) % 4;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

static inline bool exists(const char *name) {
    return access(place(name), F_OK) == 0;
}

// a copy of a frame with the seal of a checkpoint behind it: a word, and the hash of what stands before
static inline const char *sealed(const char *file) {
    struct stat status;
    assert_int_equal(stat(place(file), &status), 0);
    const size_t size = (size_t)status.st_size;
    char *bytes = silt_alloc(size, 1);
    FILE *from = fopen(place(file), "rb"), *to = fopen(place("sealed.h5"), "wb");
    assert_true(from && to && fread(bytes, 1, size, from) == size && fwrite(bytes, 1, size, to) == size);
    const uint64_t hash = silt_hash(0, bytes, size);
    assert_true(fwrite("siltseal", 8, 1, to) == 1 && fwrite(&hash, sizeof hash, 1, to) == 1);
    fclose(from);
    fclose(to);
    free(bytes);
    return place("sealed.h5");
}

// frames are read with the checkpoint reader: it insists on names, types and counts
static inline void values(const char *file, const char *name, silt_store_type type, size_t n, void *data) {
    silt_error err = {0};
    silt_store *store = NULL;
    if (silt_store_open(&store, sealed(file), &err) || silt_store_take(store, name, type, n, data, &err))
        fail_msg("%s", err.text);
    silt_store_close(&store);
}

static inline char *content(const char *name) {
    static char text[1 << 16];
    FILE *from = fopen(place(name), "r");
    assert_non_null(from);
    text[fread(text, 1, sizeof text - 1, from)] = 0;
    fclose(from);
    return text;
}

static inline void make(const char *name, const char *text) {
    FILE *to = fopen(place(name), "w");
    assert_non_null(to);
    fputs(text, to);
    fclose(to);
}

static inline void contains(const char *text, const char *part) {
    if (!strstr(text, part))
        fail_msg("'%s' is not in '%s'", part, text);
}

#define SCENE                                                                                                          \
    "silt: 1\n"                                                                                                        \
    "title: A small world\n"                                                                                           \
    "dimension: 2\n"                                                                                                   \
    "time: {end: 10, output: 0.25}\n"                                                                                  \
    "gravity: [0, -9.81]\n"                                                                                            \
    "fluid: {density: 1000, viscosity: 0.001, size: 0.1, regions: [{box: [[0, 0], [1, 1]]}]}\n"                        \
    "walls: [{polyline: [[0, 2], [0, 0], [4, 0], [4, 2]]}]\n"                                                          \
    "gauges: [{name: front, front: x}]\n"                                                                              \
    "checks:\n"                                                                                                        \
    "  - {name: line, column: external_work, scalar: last, value: -21, tolerance: 0.01}\n"                             \
    "  - {name: curve, column: front, reference: curve.csv, x: t, y: x, norm: l2, tolerance: 0.01}\n"

// fontconfig keeps its caches to the end of the program; the leak checker shall not mind
const char *__lsan_default_suppressions(void);
__attribute__((visibility("default"))) const char *__lsan_default_suppressions(void) {
    return "leak:libfontconfig\n";
}

static inline int make_folder(void **state) {
    (void)state;
    snprintf(folder, sizeof folder, "%s/output_XXXXXX", SILT_BINARY);
    return mkdtemp(folder) ? 0 : -1;
}

static inline int remove_folder(void **state) {
    (void)state;
    char command[600];
    snprintf(command, sizeof command, "rm -r '%s'", folder);
    return system(command);
}

#endif

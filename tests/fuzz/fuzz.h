// what the fuzz targets share: a folder in memory that goes with the program, a file in it
#ifndef SILT_FUZZ_H
#define SILT_FUZZ_H

#include "base.h"

#include <dirent.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static char fuzz_folder[64];

static inline void fuzz_folder_leave(void) {
    char path[512];
    DIR *folder = opendir(fuzz_folder);
    for (struct dirent *entry; folder && (entry = readdir(folder));) {
        snprintf(path, sizeof path, "%s/%s", fuzz_folder, entry->d_name);
        if (entry->d_name[0] != '.')
            unlink(path);
    }
    if (folder)
        closedir(folder);
    rmdir(fuzz_folder);
}

/** makes the folder at the first call; @return true at the first call */
static inline bool fuzz_folder_make(void) {
    if (fuzz_folder[0])
        return false;
    snprintf(fuzz_folder, sizeof fuzz_folder, "%s/silt-fuzz-XXXXXX", access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp");
    if (!mkdtemp(fuzz_folder))
        abort();
    atexit(fuzz_folder_leave);
    return true;
}

/** a file of that name in the folder with these bytes; @return its path, valid until the next call */
static inline const char *fuzz_file(const char *name, const void *data, size_t size) {
    static char path[512];
    snprintf(path, sizeof path, "%s/%s", fuzz_folder, name);
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(data, 1, size, file) != size || fclose(file) != 0)
        abort();
    return path;
}

/** what must hold whatever the input */
#define FUZZ_HOLDS(condition)                                                                                          \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition);                             \
            abort();                                                                                                   \
        }                                                                                                              \
    } while (0)

#endif

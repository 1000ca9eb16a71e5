// checkpoints: any bytes are refused with the file's name, or arrays are taken from them with their counts. The bytes that come in
// are a checkpoint that may be damaged, or (first byte 'v') places and values of damage to one that is made here.
#include "fuzz.h"
#include "pfem.h"

enum { VALUES = 60 };
static uint8_t *whole; // a sound checkpoint
static size_t whole_size;

static void make_whole(void) {
    silt_store *store = NULL;
    silt_error err = {0};
    double real[VALUES];
    int index[VALUES];
    for (int i = 0; i < VALUES; i++) {
        real[i] = 0.1 * i;
        index[i] = i;
    }
    const char *path = fuzz_file("whole.h5", "", 0);
    if (silt_store_create(&store, path, &err) || silt_store_put(store, "nodes/x", STORE_DOUBLE, VALUES, real, &err) ||
        silt_store_put(store, "mesh/cell", STORE_INT, VALUES, index, &err) || silt_store_commit(&store, &err))
        abort();
    FILE *file = fopen(path, "rb");
    whole = silt_alloc(1 << 20, 1);
    whole_size = file ? fread(whole, 1, 1 << 20, file) : 0;
    if (!whole_size || fclose(file) != 0)
        abort();
}

static void take_all(const char *path, bool sound) {
    silt_store *store = NULL;
    silt_error err = {0};
    size_t n = 0;
    double real[VALUES] = {0};
    const silt_status status = silt_store_open(&store, path, &err);
    FUZZ_HOLDS(status == SILT_OK || (status == SILT_FAILED && strstr(err.text, "some.h5") && !store));
    FUZZ_HOLDS(status == SILT_OK || !sound);
    if (status != SILT_OK)
        return;
    if (silt_store_count(store, "nodes/x", &n, &err) == SILT_OK && n == VALUES &&
        silt_store_take(store, "nodes/x", STORE_DOUBLE, n, real, &err) == SILT_OK)
        for (int i = 0; i < VALUES; i++)
            FUZZ_HOLDS(real[i] == 0.1 * i); // never other numbers than were written
    FUZZ_HOLDS(silt_store_take(store, "nodes/x", STORE_LONG, VALUES, real, &err) == SILT_FAILED);
    silt_store_close(&store);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (fuzz_folder_make()) {
        make_whole();
        take_all(fuzz_file("some.h5", whole, whole_size), true);
    }
    if (!size || data[0] != 'v') {
        take_all(fuzz_file("some.h5", data, size), false);
        return 0;
    }
    // three bytes each: where, and what is to be there; a place without a value at the end cuts the file
    uint8_t *damaged = silt_alloc(whole_size, 1);
    memcpy(damaged, whole, whole_size);
    size_t left = whole_size, k = 1;
    for (; k + 2 < size; k += 3)
        damaged[((size_t)data[k] << 8 | data[k + 1]) % whole_size] = data[k + 2];
    if (k + 1 < size)
        left = ((size_t)data[k] << 8 | data[k + 1]) % whole_size;
    take_all(fuzz_file("some.h5", damaged, left), left == whole_size && memcmp(damaged, whole, whole_size) == 0);
    free(damaged);
    return 0;
}

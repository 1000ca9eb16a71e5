// checkpoints: named arrays in an HDF5 file that is written aside and renamed into place when it is whole

#include "image.h"
#include "pfem.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <unistd.h>

struct silt_store {
    hid_t file;
    char *path; // owned, where the file belongs
    char *part; // owned, where it is written, NULL when reading
    bool bad;   // a put failed: commit refuses
};

static hid_t store_type(silt_store_type type) {
    switch (type) {
    case STORE_BYTE:
        return H5T_NATIVE_UINT8;
    case STORE_INT:
        return H5T_NATIVE_INT32;
    case STORE_LONG:
        return H5T_NATIVE_INT64;
    case STORE_DOUBLE:
        break;
    }
    return H5T_NATIVE_DOUBLE;
}

static const char *store_type_name(silt_store_type type) {
    static const char *const name[] = {"", "bytes", "32-bit integers", "64-bit integers", "doubles"};
    return name[type];
}

// HDF5 would print its own error stack
static void store_quiet(void) {
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
}

silt_status silt_store_create(silt_store **store, const char *path, silt_error *err) {
    store_quiet();
    silt_store *s = silt_alloc(1, sizeof *s);
    s->path = silt_text("%s", path);
    s->part = silt_text("%s.part", path);
    // a folder that takes no file is found out before all the work
    int fd = open(s->part, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    int reason = fd < 0 ? errno : 0;
    if (fd >= 0)
        close(fd);
    s->file = reason ? -1 : silt_image_create(s->part);
    if (s->file < 0) {
        silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", s->part, reason ? strerror(reason) : "HDF5 refused");
        silt_store_close(&s);
        return SILT_FAILED;
    }
    *store = s;
    return SILT_OK;
}

// makes a folder's entries survive a power cut: best effort, some file systems refuse to sync a folder
static void store_sync(const char *folder) {
    int fd = open(folder, O_RDONLY | O_CLOEXEC);
    if (fd >= 0) {
        fsync(fd);
        close(fd);
    }
}

silt_status silt_store_commit(silt_store **store, silt_error *err) {
    silt_store *s = *store;
    silt_status status = SILT_FAILED;
    char *folder = silt_text("%s", s->path);
    if (s->bad || !s->part) {
        silt_fail(err, SILT_FAILED, "%s: not kept, because it is not whole", s->path);
        goto done;
    }
    int reason = silt_image_write(s->file, s->part, true);
    s->file = -1;
    if (reason) {
        silt_fail(err, SILT_FAILED, "%s: cannot be written to the end (%s)", s->part, strerror(reason));
        goto done;
    }
    if (rename(s->part, s->path) != 0) {
        silt_fail(err, SILT_FAILED, "%s: cannot be renamed to %s (%s)", s->part, s->path, strerror(errno));
        goto done;
    }
    free(s->part);
    s->part = NULL;
    store_sync(dirname(folder));
    status = SILT_OK;
done:
    free(folder);
    silt_store_close(store);
    return status;
}

static bool store_signed(const char *path) {
    static const char signature[8] = {(char)0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
    char found[sizeof signature] = {0};
    FILE *from = fopen(path, "rb");
    const bool read = from && fread(found, sizeof found, 1, from) == 1;
    if (from)
        fclose(from);
    return read && memcmp(found, signature, sizeof found) == 0;
}

silt_status silt_store_open(silt_store **store, const char *path, silt_error *err) {
    store_quiet();
    if (access(path, R_OK) != 0)
        return silt_fail(err, SILT_FAILED, "%s: cannot be read (%s)", path, strerror(errno));
    // HDF5 would take other numbers for those that were written, and crash in some damaged files
    if (!store_signed(path))
        return silt_fail(err, SILT_FAILED, "%s: not an HDF5 file, or its beginning is damaged", path);
    if (!silt_image_sealed(path))
        return silt_fail(err, SILT_FAILED, "%s: damaged or cut short", path);
    silt_store *s = silt_alloc(1, sizeof *s);
    s->path = silt_text("%s", path);
    hid_t access_list = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_fclose_degree(access_list, H5F_CLOSE_STRONG);
    s->file = H5Fopen(path, H5F_ACC_RDONLY, access_list);
    H5Pclose(access_list);
    if (s->file < 0) {
        silt_store_close(&s);
        return silt_fail(err, SILT_FAILED, "%s: damaged or cut short", path);
    }
    *store = s;
    return SILT_OK;
}

void silt_store_close(silt_store **store) {
    silt_store *s = *store;
    if (!s)
        return;
    if (s->file >= 0)
        H5Fclose(s->file);
    if (s->part)
        unlink(s->part);
    free(s->part);
    free(s->path);
    free(s);
    *store = NULL;
}

silt_status silt_store_put(silt_store *store, const char *name, silt_store_type type, size_t n, const void *data,
                           silt_error *err) {
    hsize_t count = n;
    hid_t space = H5Screate_simple(1, &count, NULL);
    hid_t links = H5Pcreate(H5P_LINK_CREATE), create = H5Pcreate(H5P_DATASET_CREATE);
    hid_t set = -1;
    silt_status status = SILT_OK;

    // groups of the name come by themselves; no time stamps, so that equal states are equal files
    H5Pset_create_intermediate_group(links, 1);
    H5Pset_obj_track_times(create, false);
    errno = 0;
    set = H5Dcreate2(store->file, name, store_type(type), space, links, create, H5P_DEFAULT);
    if (set < 0 || (n > 0 && H5Dwrite(set, store_type(type), H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0)) {
        store->bad = true;
        status = silt_fail(err, SILT_FAILED, "%s: array %s (%zu %s) cannot be written (%s)",
                           store->part ? store->part : store->path, name, n, store_type_name(type),
                           errno                                                      ? strerror(errno)
                           : set < 0 && H5Lexists(store->file, name, H5P_DEFAULT) > 0 ? "it is there already"
                                                                                      : "HDF5 refused");
    }
    if (set >= 0)
        H5Dclose(set);
    H5Pclose(create);
    H5Pclose(links);
    H5Sclose(space);
    return status;
}

// the data set and its number of values
static silt_status store_find(silt_store *store, const char *name, hid_t *set, size_t *n, silt_error *err) {
    *set = H5Dopen2(store->file, name, H5P_DEFAULT);
    if (*set < 0)
        return silt_fail(err, SILT_FAILED, "%s: array %s is absent", store->path, name);
    hid_t space = H5Dget_space(*set);
    hssize_t found = H5Sget_simple_extent_npoints(space);
    H5Sclose(space);
    *n = found > 0 ? (size_t)found : 0;
    return SILT_OK;
}

silt_status silt_store_count(silt_store *store, const char *name, size_t *n, silt_error *err) {
    hid_t set;
    SILT_TRY(store_find(store, name, &set, n, err));
    H5Dclose(set);
    return SILT_OK;
}

silt_status silt_store_take(silt_store *store, const char *name, silt_store_type type, size_t n, void *data,
                            silt_error *err) {
    hid_t set;
    size_t found = 0;
    SILT_TRY(store_find(store, name, &set, &found, err));
    silt_status status = SILT_OK;
    hid_t stored = H5Dget_type(set);
    if (found != n)
        status =
            silt_fail(err, SILT_FAILED, "%s: array %s has %zu values, %zu are needed", store->path, name, found, n);
    else if (H5Tequal(stored, store_type(type)) <= 0)
        status = silt_fail(err, SILT_FAILED, "%s: array %s does not hold %s", store->path, name, store_type_name(type));
    else if (n > 0 && H5Dread(set, store_type(type), H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0)
        status = silt_fail(err, SILT_FAILED, "%s: array %s cannot be read, the file is damaged", store->path, name);
    H5Tclose(stored);
    H5Dclose(set);
    return status;
}

// HDF5 files in memory, written in one piece
#include "image.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base.h"

hid_t silt_image_create(const char *name) {
    const size_t step = 1 << 16; // the memory grows by this
    hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
    H5Pset_fapl_core(access, step, 0);
    const hid_t file = H5Fcreate(name, H5F_ACC_TRUNC, H5P_DEFAULT, access);
    H5Pclose(access);
    return file;
}

// What stands behind a file that has to be whole: a word and the hash of all before it. HDF5 looks up where its file ends and reads no
// further; of what lies between it checks little.
typedef struct image_seal {
    char word[8];
    uint64_t hash;
} image_seal;
static const char image_seal_word[8] = {'s', 'i', 'l', 't', 's', 'e', 'a', 'l'};

static int image_put(const char *path, const char *bytes, size_t size, bool sync) {
    int reason = 0;
    const int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (fd < 0)
        return errno;
    for (size_t done = 0; done < size && !reason;) {
        const ssize_t put = write(fd, bytes + done, size - done);
        if (put > 0)
            done += (size_t)put;
        else if (put == 0 || errno != EINTR)
            reason = put == 0 ? ENOSPC : errno;
    }
    if (sync && !reason && fsync(fd) != 0 && errno != EINVAL) // not every file system can
        reason = errno;
    if (close(fd) != 0 && !reason)
        reason = errno;
    return reason;
}

int silt_image_write(hid_t file, const char *path, bool sealed) {
    int reason = EIO;
    const ssize_t size = file >= 0 && H5Fflush(file, H5F_SCOPE_GLOBAL) >= 0 ? H5Fget_file_image(file, NULL, 0) : -1;
    if (size > 0) {
        image_seal seal;
        char *bytes = silt_alloc((size_t)size + sizeof seal, 1);
        if (H5Fget_file_image(file, bytes, (size_t)size) == size) {
            if (sealed) {
                memcpy(seal.word, image_seal_word, sizeof seal.word);
                seal.hash = silt_hash(0, bytes, (size_t)size);
                memcpy(bytes + size, &seal, sizeof seal);
            }
            reason = image_put(path, bytes, (size_t)size + (sealed ? sizeof seal : 0), sealed);
        }
        free(bytes);
    }
    if (file >= 0)
        H5Fclose(file);
    return reason;
}

static bool image_whole(FILE *from, size_t size) {
    char block[1 << 14];
    image_seal seal;
    uint64_t hash = 0;
    if (size <= sizeof seal)
        return false;
    for (size_t left = size - sizeof seal; left;) {
        const size_t want = left < sizeof block ? left : sizeof block;
        if (fread(block, 1, want, from) != want)
            return false;
        hash = silt_hash(hash, block, want);
        left -= want;
    }
    return fread(&seal, sizeof seal, 1, from) == 1 && memcmp(seal.word, image_seal_word, sizeof seal.word) == 0 && seal.hash == hash;
}

bool silt_image_sealed(const char *path) {
    struct stat status;
    FILE *from = fopen(path, "rb");
    const bool whole = from && fstat(fileno(from), &status) == 0 && image_whole(from, (size_t)status.st_size);
    if (from)
        fclose(from);
    return whole;
}

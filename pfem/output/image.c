// HDF5 files in memory, written in one piece
#include "image.h"

#include <errno.h>
#include <fcntl.h>
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

int silt_image_write(hid_t file, const char *path, bool sync) {
    int reason = EIO;
    const ssize_t size = file >= 0 && H5Fflush(file, H5F_SCOPE_GLOBAL) >= 0 ? H5Fget_file_image(file, NULL, 0) : -1;
    if (size > 0) {
        char *bytes = silt_alloc((size_t)size, 1);
        if (H5Fget_file_image(file, bytes, (size_t)size) == size)
            reason = image_put(path, bytes, (size_t)size, sync);
        free(bytes);
    }
    if (file >= 0)
        H5Fclose(file);
    return reason;
}

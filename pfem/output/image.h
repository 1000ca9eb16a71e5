/** @file image.h
 * HDF5 files that are made in memory and written in one piece. A disk that is full is then an error of write(), with
 * its reason; HDF5 itself would not let go of a file that it cannot finish, and crash at the end of the program.
 */
#ifndef SILT_IMAGE_H
#define SILT_IMAGE_H

#include <hdf5.h>
#include <stdbool.h>

/** an empty HDF5 file in memory; negative when HDF5 refuses. The name is for messages only. */
hid_t silt_image_create(const char *name);
/** Writes the file to path, then closes it whatever happened.
 * @param sealed  down to the disk, with a seal behind it that tells whether it is whole
 * @return 0, or errno (EIO: HDF5 refused) */
int silt_image_write(hid_t file, const char *path, bool sealed);
/** true when the file has its seal and every byte is as it was written */
bool silt_image_sealed(const char *path);

#endif

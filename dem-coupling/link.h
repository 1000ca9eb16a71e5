/** @file link.h
 * The client's end of the worker: its process, the shared memory, the socket that hands it to and fro, and what is
 * known when it dies.
 */
#ifndef SILT_LINK_H
#define SILT_LINK_H

#include "base.h"
#include "protocol.h"

#include <sys/types.h>

typedef struct dem_link {
    const char *log;             // borrowed, NULL: none
    pid_t process;               // 0: has ended
    int pid;                     // the same, kept for messages
    int socket, memory, restart; // descriptors, owned; restart is the file that LIGGGHTS' restarts pass through
    dem_shared *shared;          // mapped, owned
    bool open, busy;             // busy: an instruction is under way
    bool failed;                 // and why: every later call answers the same
    bool gave_up;                // it failed at what it was told to do; nobody ended it from outside
    silt_error why;
} dem_link;

/** Starts the program `worker`; its output goes to log (appended to, or begun anew). */
silt_status dem_link_open(dem_link *link, const char *worker, const char *log, bool append, silt_error *err);
/** Lays out shared's sections for its lengths, making room; shared may move. */
silt_status dem_link_reserve(dem_link *link, silt_error *err);
silt_status dem_link_send(dem_link *link, char word, silt_error *err);
/** Waits for the answer to what was sent. When the worker has ended instead: SILT_FAILED with its last words. */
silt_status dem_link_collect(dem_link *link, silt_error *err);
/** Ends the worker for a reason that the client found. @return SILT_FAILED */
silt_status dem_link_give_up(dem_link *link, silt_error *err, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/** the restart file: all of it (bytes owned by the caller), and its new content */
silt_status dem_link_read(dem_link *link, unsigned char **bytes, size_t *size, silt_error *err);
silt_status dem_link_write(dem_link *link, const unsigned char *bytes, size_t size, silt_error *err);
void dem_link_close(dem_link *link); // takes a zeroed one

#endif

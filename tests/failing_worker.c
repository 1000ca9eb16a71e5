/* A worker that stands between silt and silt-dem and gives up, as LIGGGHTS would, at every run of more than SILT_FAIL_MOST
 * substeps from its SILT_FAIL_FROM-th on. The real one is SILT_FAIL_WORKER. */
#include "../dem-coupling/protocol.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

static int number(const char *name) {
    const char *text = getenv(name);
    return text ? atoi(text) : 0;
}

static int substeps(const char *why) {
    struct stat file;
    if (fstat(DEM_FD_MEMORY, &file) != 0)
        return -1;
    dem_shared *shared = mmap(NULL, (size_t)file.st_size, PROT_READ | PROT_WRITE, MAP_SHARED, DEM_FD_MEMORY, 0);
    if (shared == MAP_FAILED)
        return -1;
    const int n = shared->n_step;
    if (why)
        snprintf(shared->text, sizeof shared->text, "%s", why);
    munmap(shared, (size_t)file.st_size);
    return n;
}

int main(int argc, char **argv) {
    int pair[2];
    const char *real = getenv("SILT_FAIL_WORKER");
    if (argc != 3 || strncmp(argv[1], "serve", 5) != 0 || !real || socketpair(AF_UNIX, SOCK_STREAM, 0, pair) != 0)
        return 2;
    char parent[32];
    snprintf(parent, sizeof parent, "%d", (int)getpid());
    if (fork() == 0) {
        dup2(pair[1], DEM_FD_SOCKET);
        close(pair[0]);
        close(pair[1]);
        execl(real, real, argv[1], parent, (char *)NULL);
        _exit(2);
    }
    close(pair[1]);
    char word;
    for (int runs = 0; recv(DEM_FD_SOCKET, &word, 1, 0) == 1;) {
        runs += word == DEM_RUN;
        if (word == DEM_RUN && runs >= number("SILT_FAIL_FROM") && substeps(NULL) > number("SILT_FAIL_MOST")) {
            substeps("LIGGGHTS: made to fail");
            return 70;
        }
        if (send(pair[0], &word, 1, MSG_NOSIGNAL) != 1 || recv(pair[0], &word, 1, 0) != 1)
            break;
        send(DEM_FD_SOCKET, &word, 1, MSG_NOSIGNAL);
    }
    return 0;
}

// a film: the pictures of all frames go through a pipe to ffmpeg

#include "draw.h"

#include <errno.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

// seconds that a film lasts at the least, and pictures a second at the most
#define FILM_SECONDS 4.0
#define FILM_RATE 25.0

/** what ffmpeg is told for a kind of file; sides of mp4 and webm are even */
typedef struct film_kind {
    const char *ending, *option[9];
} film_kind;
static const film_kind film_kinds[] = {
    {".mp4", {"-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "20"}},
    {".webm", {"-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2", "-c:v", "libvpx-vp9", "-crf", "30", "-b:v", "0"}},
    {".webp", {"-vf", "scale=iw/2:-1", "-c:v", "libwebp_anim", "-loop", "0", "-q:v", "75"}},
    {".gif", {"-vf", "scale=iw/2:-1,split[a][b];[a]palettegen[p];[b][p]paletteuse", "-loop", "0"}},
};
enum { FILM_KINDS = sizeof film_kinds / sizeof *film_kinds };

static const film_kind *film_find(const char *path) {
    const char *ending = strrchr(path, '.');
    for (int k = 0; ending && k < FILM_KINDS; k++)
        if (strcmp(ending, film_kinds[k].ending) == 0)
            return &film_kinds[k];
    return NULL;
}

// starts ffmpeg; *pipe_end takes the pictures. @return 0 or errno
static int film_start(const film_kind *kind, int width, int height, double rate, const char *path, pid_t *child, int *pipe_end) {
    char size[32], rate_text[32];
    int ends[2];
    snprintf(size, sizeof size, "%dx%d", width, height);
    snprintf(rate_text, sizeof rate_text, "%.6g", rate);
    const char *argument[32] = {"ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "bgra", "-s", size,
                                "-r", rate_text, "-i", "-"};
    int n = 14;
    for (int k = 0; kind->option[k]; k++)
        argument[n++] = kind->option[k];
    if (pipe(ends) != 0)
        return errno;
    char *name = silt_text("file:%s", path); // a name with : or - in front is one all the same
    argument[n] = name;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
    posix_spawn_file_actions_addclose(&actions, ends[0]);
    posix_spawn_file_actions_addclose(&actions, ends[1]);
    const int reason = posix_spawnp(child, "ffmpeg", &actions, NULL, (char *const *)(uintptr_t)argument, environ);
    posix_spawn_file_actions_destroy(&actions);
    free(name);
    close(ends[0]);
    *pipe_end = ends[1];
    if (reason)
        close(ends[1]);
    return reason;
}

// all bytes of a picture's rows. @return 0 or errno
static int film_put(int to, cairo_surface_t *surface) {
    cairo_surface_flush(surface);
    const uint8_t *pixels = cairo_image_surface_get_data(surface);
    const size_t stride = (size_t)cairo_image_surface_get_stride(surface), row = 4 * (size_t)cairo_image_surface_get_width(surface);
    for (int y = 0; y < cairo_image_surface_get_height(surface); y++)
        for (size_t done = 0; done < row;) {
            const ssize_t n = write(to, pixels + (size_t)y * stride + done, row - done);
            if (n < 0 && errno != EINTR)
                return errno;
            done += n > 0 ? (size_t)n : 0;
        }
    return 0;
}

silt_status silt_draw_film(silt_draw_canvas *c, const silt_draw_book *book, const char *path, silt_error *err) {
    const film_kind *kind = film_find(path);
    pid_t child;
    int to, outcome = 0;
    if (!kind)
        return silt_fail(err, SILT_INPUT, "film %s: its name ends in .mp4, .webm, .webp or .gif", path);
    const double rate = silt_clamp(book->n_frame / FILM_SECONDS, 1, FILM_RATE);
    int reason = film_start(kind, MARGIN_LEFT + c->width + c->right, MARGIN_TOP + c->height + MARGIN_BOTTOM, rate, path, &child, &to);
    if (reason)
        return silt_fail(err, SILT_FAILED, reason == ENOENT ? "film %s: ffmpeg is not installed; Debian: apt-get install ffmpeg (%s)"
                                                            : "film %s: ffmpeg cannot be started (%s)", path, strerror(reason));
    // a child that ends early is told by write, not by a signal
    void (*before)(int) = signal(SIGPIPE, SIG_IGN);
    for (int i = 0; i < book->n_frame && !reason; i++) {
        cairo_surface_t *surface = silt_draw_picture(c, &book->entry[i]);
        reason = film_put(to, surface);
        cairo_surface_destroy(surface);
    }
    close(to);
    while (waitpid(child, &outcome, 0) < 0 && errno == EINTR)
        continue;
    signal(SIGPIPE, before);
    if (!WIFEXITED(outcome) || WEXITSTATUS(outcome) != 0)
        return silt_fail(err, SILT_FAILED, "film %s: ffmpeg failed, see above", path);
    return reason ? silt_fail(err, SILT_FAILED, "film %s: ffmpeg does not listen (%s)", path, strerror(reason)) : SILT_OK;
}

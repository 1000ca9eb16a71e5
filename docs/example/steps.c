// Steps through a run and looks at it: where the water's front is, how fast the fastest node goes.
// cc steps.c $(pkg-config --cflags --libs silt) -o steps && ./steps SCENE OUT
#include <silt/silt.h>

#include <math.h>
#include <stdio.h>

int main(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "usage: steps SCENE OUT\n");
        return SILT_INPUT;
    }
    silt_error error = {0};
    silt_scene *scene = NULL;
    silt_run *run = NULL;
    silt_status status = silt_scene_read(argv[1], 0, NULL, &scene, &error);
    const silt_run_def def = {.out = argv[2], .force = true, .threads = 1};
    if (status == SILT_OK)
        status = silt_run_start(&run, scene, &def, &error);

    while (status == SILT_OK && !silt_run_ended(run)) {
        status = silt_run_advance(run, &error);
        silt_fields now;
        silt_run_fields(run, &now);
        double front = -INFINITY, fastest = 0;
        for (int i = 0; i < now.n_node; i++) {
            const double *x = now.x + now.dim * i, *v = now.v + now.dim * i;
            front = fmax(front, x[0]);
            fastest = fmax(fastest, hypot(hypot(v[0], v[1]), now.dim == 3 ? v[2] : 0));
        }
        printf("%8.4f s  front %.4f m  fastest %.4f m/s  volume error %.2e\n", now.time, front, fastest,
               silt_run_value(run, "volume_error"));
    }

    if (run)
        status = silt_run_finish(&run, status, &error);
    silt_scene_free(&scene);
    if (status != SILT_OK)
        fprintf(stderr, "%s\n", error.text);
    return (int)status;
}

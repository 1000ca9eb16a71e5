// profile of the grains of a run along a line, mean over its frames

#include "verify.h"

// a time this close to a frame's, times the distance of frames, is that frame's
#define GRAINS_SAME 1e-6

// volume of a frame's grains in layers around the places, m3 (in the plane the area, m2)
static void grains_count(const silt_grid *grid, bool space, const silt_check_def *def, int n, const double *place, double *sum) {
    double direction[3], length = 0;
    for (int d = 0; d < 3; d++)
        length += silt_square(direction[d] = def->line[3 + d] - def->line[d]);
    for (int k = 0; k < grid->n_point; k++) {
        const double r = grid->radius[k], volume = space ? 4.0 / 3 * M_PI * r * r * r : M_PI * r * r;
        double along = 0;
        for (int d = 0; d < 3; d++)
            along += (grid->x[3 * k + d] - def->line[d]) * direction[d] / sqrt(length);
        for (int i = 0; i < n; i++)
            if (fabs(along - place[i]) <= 0.5 * def->layer)
                sum[i] += volume;
    }
}

bool silt_profile_grains(const silt_scene *scene, const char *out, const silt_check_def *def, const silt_curve *reference,
                         silt_curve *profile, char *note) {
    silt_frame_entry *entry = NULL;
    const int n_frame = silt_frame_index(out, &entry), n = reference->n;
    const double apart = n_frame > 1 ? (entry[n_frame - 1].time - entry[0].time) / (n_frame - 1) : scene->time.output;
    const double since = isnan(def->since) ? def->at : def->since, slack = GRAINS_SAME * apart;
    // the last place is where the profile is 1
    double *place = silt_alloc((size_t)n + 1, sizeof *place), *sum = silt_alloc((size_t)n + 1, sizeof *sum);
    for (int i = 0; i <= n; i++)
        place[i] = (i < n ? reference->x[i] : isnan(def->unit_at) ? 0 : def->unit_at) / def->place_scale - def->place_shift;
    int count = 0;
    bool good = n_frame > 0 && entry[0].time <= since + slack && entry[n_frame - 1].time >= def->at - slack;
    if (!good)
        snprintf(note, 256, n_frame ? "the frames are from %g to %g s, the profile is wanted from %g to %g" : "there are no frames",
                 n_frame ? entry[0].time : 0, n_frame ? entry[n_frame - 1].time : 0, since, def->at);
    for (int f = 0; f < n_frame && good; f++) {
        if (entry[f].time < since - slack || entry[f].time > def->at + slack)
            continue;
        silt_grid grid;
        good = silt_grid_read(&grid, out, "grains", entry[f].number, NULL);
        if (good && grid.radius)
            grains_count(&grid, scene->dimension == 3, def, n + 1, place, sum);
        if (good)
            silt_grid_clear(&grid);
        else
            snprintf(note, 256, "the grains of frame %d cannot be read", entry[f].number);
        count++;
    }
    if (good && count == 0) {
        snprintf(note, 256, "no frame is from %g to %g s", since, def->at);
        good = false;
    }
    if (good && !isnan(def->unit_at) && sum[n] <= 0) {
        snprintf(note, 256, "there are no grains at %g, where the profile is to be 1", def->unit_at);
        good = false;
    }
    const double unit = isnan(def->unit_at) ? count * def->layer : sum[n];
    for (int i = 0; i < n && good; i++)
        silt_curve_add(profile, reference->x[i], def->scale * (sum[i] / unit + def->shift));
    free(place);
    free(sum);
    free(entry);
    return good;
}

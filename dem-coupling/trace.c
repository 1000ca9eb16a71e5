// trace.c: contact forces substep by substep, in a file of their own
#define _GNU_SOURCE // ftruncate
#include "guide.h"

#include <errno.h>
#include <unistd.h>

#include "state.h"

// the grain of a gauge that asks for contact forces, -1: another gauge
static int trace_grain(const silt_scene *scene, int gauge) {
    return scene->gauge[gauge].kind == GAUGE_GRAIN_FORCE ? scene->gauge[gauge].index : -1;
}

static void trace_header(const silt_scene *scene, FILE *to) {
    fprintf(to, "time");
    for (int i = 0; i < scene->n_body; i++)
        if (scene->body[i].motion != MOTION_FIXED)
            fprintf(to, ",%s_cx,%s_cy,%s_cz", scene->body[i].name, scene->body[i].name, scene->body[i].name);
    for (int k = 0; k < scene->n_gauge; k++)
        if (trace_grain(scene, k) > 0)
            fprintf(to, ",%s_x,%s_y,%s_z", scene->gauge[k].name, scene->gauge[k].name, scene->gauge[k].name);
    fputc('\n', to);
}

// cuts the rows after a time: a run that goes on writes them again
static void trace_cut(FILE *file, double after) {
    char line[64];
    long end = 0;
    bool begun = true, first = true;
    rewind(file);
    while (fgets(line, sizeof line, file)) {
        if (begun && !first && strtod(line, NULL) > after)
            break;
        begun = strchr(line, '\n') != NULL;
        if (begun) {
            end = ftell(file);
            first = false;
        }
    }
    fseek(file, end, SEEK_SET);
    if (ftruncate(fileno(file), end) != 0)
        rewind(file);
}

silt_status silt_trace_open(silt_coupling *c, const char *path, bool resumed, double time, silt_error *err) {
    if (!c->scene->contact.trace || !path)
        return SILT_OK;
    c->trace = fopen(path, resumed ? "r+" : "w");
    if (!c->trace && resumed)
        c->trace = fopen(path, "w");
    if (!c->trace)
        return silt_fail(err, SILT_FAILED, "%s: cannot be written: %s", path, strerror(errno));
    if (resumed)
        trace_cut(c->trace, time + 0.5 * c->step);
    if (ftell(c->trace) == 0)
        trace_header(c->scene, c->trace);
    return SILT_OK;
}

int silt_trace_count(const silt_coupling *c) {
    int n = 0;
    for (int i = 0; i < c->scene->n_body && c->trace; i++)
        n += !c->body[i].fixed;
    for (int k = 0; k < c->scene->n_gauge && c->trace; k++)
        n += trace_grain(c->scene, k) > 0;
    return n;
}

void silt_trace_ask(const silt_coupling *c, dem_guide *guide) {
    dem_traced *to = dem_guide_traced(guide);
    for (int i = 0, slot = 0; i < c->scene->n_body; i++)
        if (!c->body[i].fixed)
            *to++ = (dem_traced){slot++, -1};
    for (int k = 0; k < c->scene->n_gauge; k++) {
        const int id = trace_grain(c->scene, k);
        int order = -1;
        for (int i = 0; id > 0 && i < c->n_last && order < 0; i++)
            order = c->last[i] == id ? i : -1;
        if (id > 0)
            *to++ = (dem_traced){-1, order};
    }
}

silt_status silt_trace_write(silt_coupling *c, const dem_guide *told, silt_error *err) {
    if (!c->trace || !told)
        return SILT_OK;
    dem_guide *guide = (dem_guide *)(uintptr_t)told;
    const double *force = dem_guide_trace(guide);
    for (int k = 1; k <= guide->n_step; k++) {
        fprintf(c->trace, "%.17g", c->walls->time - (guide->n_step - k) * c->step);
        for (int i = 0; i < 3 * guide->n_trace; i++)
            fprintf(c->trace, ",%.9g", *force++ / c->width);
        fputc('\n', c->trace);
    }
    return fflush(c->trace) == 0 ? SILT_OK : silt_fail(err, SILT_FAILED, "trace.csv: cannot be written: %s", strerror(errno));
}

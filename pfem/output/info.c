// what a scene asks for, or what stands in an output folder, in a few lines

#include "output.h"

#include <errno.h>
#include <libfyaml.h>
#include <sys/stat.h>

// ---------------------------------------------------------------- a scene

// which equations the water gets: turbulence, rheology, walls, time, sizes, air, forces
static void info_model(const silt_scene *scene, FILE *to) {
    static const char *const turbulence[] = {"", "no turbulence model", "mixing length", "Smagorinsky", "WALE", "Spalart-Allmaras"};
    static const char *const near[] = {"", "regions", "walls", "bed", "bodies", "the surface"};
    static const char *const formula[] = {"at rest", "uniform",      "solid rotation", "shear",
                                          "strain",  "Taylor-Green", "standing wave",  "solitary wave",
                                          "field",   "central",      "series"};
    const silt_fluid_def *fluid = &scene->fluid;
    fprintf(to, "  model      %s, %s", fluid->flow == FLOW_LAMINAR ? "laminar" : "turbulent",
            turbulence[fluid->turbulence]);
    if (fluid->rheology == RHEOLOGY_NEWTONIAN)
        fprintf(to, ", Newtonian");
    else if (fluid->rheology == RHEOLOGY_BINGHAM)
        fprintf(to, ", Bingham with %g Pa, smoothed below %g 1/s", fluid->yield_stress, fluid->plastic_rate);
    else
        fprintf(to, ", Herschel-Bulkley with %g Pa and index %g, smoothed below %g 1/s", fluid->yield_stress,
                fluid->flow_index, fluid->plastic_rate);
    fprintf(to, "\n  steps      %s, theta %g%s\n", fluid->scheme == SCHEME_IMPLICIT ? "implicit" : "fractional step",
            fluid->theta, fluid->theta == 0.5 ? " (second order)" : "");
    // walls by what they do to the water
    int n[3] = {0}, n_rough = 0, n_moving = 0;
    for (int i = 0; i < scene->n_wall; i++) {
        n[scene->wall[i].condition == WALL_DEFAULT ? WALL_NO_SLIP : scene->wall[i].condition]++;
        n_rough += scene->wall[i].condition == WALL_LAW && scene->wall[i].roughness > 0;
        n_moving += scene->wall[i].motion.n_row > 0;
    }
    fprintf(to, "  condition  %d walls no-slip, %d slip, %d wall law", n[WALL_NO_SLIP], n[WALL_SLIP], n[WALL_LAW]);
    if (n[WALL_LAW])
        fprintf(to, " (%d rough; sampled %g h off)", n_rough, fluid->wall_height);
    fprintf(to, n_moving ? ", %d of them moving\n" : "\n", n_moving);
    if (fluid->n_size) {
        double least = fluid->size;
        fprintf(to, "  sizes     ");
        for (int i = 0; i < fluid->n_size; i++) {
            fprintf(to, "%s %g m near %s", i ? "," : "", fluid->size_at[i].size, near[fluid->size_at[i].near]);
            least = silt_min(least, fluid->size_at[i].size);
        }
        fprintf(to, "; least %g m, growing by %g per distance\n", least, fluid->size_growth);
    }
    if (fluid->velocity.kind)
        fprintf(to, "  start      velocity: %s\n", formula[fluid->velocity.kind]);
    if (fluid->force.kind)
        fprintf(to, "  force      body force: %s\n", formula[fluid->force.kind]);
    if (fluid->air_pressure > 0)
        fprintf(to, "  air        closed pockets, %g Pa when they close, exponent %g\n", fluid->air_pressure,
                fluid->air_exponent);
    if (fluid->surface_tension > 0)
        fprintf(to, "  surface    tension %g N/m\n", fluid->surface_tension);
    if (scene->period[0] < scene->period[1])
        fprintf(to, "  periodic   in x from %g to %g m\n", scene->period[0], scene->period[1]);
}

void silt_info_scene(const silt_scene *scene, FILE *to) {
    const silt_fluid_def *fluid = &scene->fluid;
    const silt_bed_def *bed = &scene->bed;
    fprintf(to, "%s\n", scene->title && *scene->title ? scene->title : "untitled");
    fprintf(to, "  scene      %s, hash %016llx\n", scene->path, (unsigned long long)scene->hash);
    fprintf(to,
            scene->dimension == 3 ? "  space      three dimensions, z up\n" : "  space      two dimensions, y up\n");
    fprintf(to, "  time       to %g s, output every %g s\n", scene->time.end, scene->time.output);
    if (fluid->on) {
        double area = 0;
        for (int i = 0; i < fluid->n_region; i++)
            area += silt_region_area(&fluid->region[i]);
        const bool space = scene->dimension == 3;
        fprintf(to, "  water      %g kg/m3, %g Pa s, spacing %g m, %d regions of %g %s: about %.0f nodes%s\n",
                fluid->density, fluid->viscosity, fluid->size, fluid->n_region, area, space ? "m3" : "m2",
                area / (silt_square(fluid->size) * (space ? fluid->size : 1)),
                fluid->n_size ? " without the sizes" : "");
        info_model(scene, to);
        if (fluid->n_inlet || fluid->n_outlet)
            fprintf(to, "  openings   %d inlets, %d outlets\n", fluid->n_inlet, fluid->n_outlet);
    }
    if (bed->on) {
        double area = 0;
        for (int i = 0; i < bed->n_region; i++)
            area += silt_region_area(&bed->region[i]);
        fprintf(to,
                "  bed        %g kg/m3, porosity %g, %g J/m3, spacing %g m, %d regions of %g m2: about %.0f nodes\n",
                bed->density, bed->porosity, bed->work, bed->size, bed->n_region, area, area / silt_square(bed->size));
    }
    if (scene->grains.on)
        fprintf(to, "  grains     %d at the start, parcels of %g m\n", silt_scene_grains(scene), scene->grains.parcel);
    for (int i = 0; i < scene->n_body; i++)
        fprintf(to, "  body       %s, %g kg/m3, %g m wide at (%g, %g)\n", scene->body[i].name, scene->body[i].density,
                scene->body[i].scale, scene->body[i].at[0], scene->body[i].at[1]);
    fprintf(to, "  walls      %d, gauges %d, checks %d\n", scene->n_wall, scene->n_gauge, scene->n_check);
    silt_info_parts(scene, to);
}

// ---------------------------------------------------------------- an output folder

struct fy_document *silt_summary_open(const char *out) {
    char *path = silt_text("%s/summary.json", out);
    struct stat file;
    struct fy_document *summary = NULL;
    if (stat(path, &file) == 0)
        summary = fy_document_build_from_file(&(struct fy_parse_cfg){.flags = FYPCF_QUIET | FYPCF_JSON_AUTO}, path);
    free(path);
    return summary;
}

void silt_summary_close(struct fy_document *summary) {
    fy_document_destroy(summary);
}

const char *silt_summary_text(struct fy_document *summary, const char *key) {
    struct fy_node *node = summary ? fy_node_by_path(fy_document_root(summary), key, FY_NT, FYNWF_DONT_FOLLOW) : NULL;
    const char *text = node && fy_node_is_scalar(node) ? fy_node_get_scalar0(node) : NULL;
    return text ? text : "";
}

double silt_summary_number(struct fy_document *summary, const char *key) {
    return atof(silt_summary_text(summary, key));
}

static void info_summary(struct fy_document *summary, FILE *to) {
    static const char *const phase[PHASE_COUNT] = {
#define X(name) #name,
        SILT_PHASES(X)
#undef X
    };
    const char *title = silt_summary_text(summary, "/title"), *message = silt_summary_text(summary, "/message");
    fprintf(to, "%s\n", *title ? title : "untitled");
    fprintf(to, "  status     %s%s%s (silt %s)\n", silt_summary_text(summary, "/status"), *message ? ": " : "", message,
            silt_summary_text(summary, "/version"));
    fprintf(to, "  reached    %g of %g s in %.0f steps\n", silt_summary_number(summary, "/time"),
            silt_summary_number(summary, "/time_end"), silt_summary_number(summary, "/steps"));
    fprintf(to, "  nodes      %.0f, grains %.0f\n", silt_summary_number(summary, "/nodes"), silt_summary_number(summary, "/grains"));
    fprintf(to, "  took       %.4g s, %.3g us per node and step, %.0f MB\n", silt_summary_number(summary, "/seconds"),
            silt_summary_number(summary, "/microseconds_per_node_step"), silt_summary_number(summary, "/peak_memory_bytes") / 1e6);
    fprintf(to, "  phases    ");
    for (int i = 0; i < PHASE_COUNT; i++) {
        char key[80];
        snprintf(key, sizeof key, "/phases/%s/seconds", phase[i]);
        fprintf(to, " %s %.3g s%s", phase[i], silt_summary_number(summary, key), i + 1 < PHASE_COUNT ? "," : "\n");
    }
    fprintf(to, "  worst      volume error %.3e, sediment error %.3e, momentum error %.3e\n",
            silt_summary_number(summary, "/worst_volume_error"), silt_summary_number(summary, "/worst_sediment_error"),
            silt_summary_number(summary, "/worst_momentum_error"));
    struct fy_node *checks = fy_node_by_path(fy_document_root(summary), "/checks", FY_NT, FYNWF_DONT_FOLLOW);
    int n = checks ? fy_node_sequence_item_count(checks) : 0, passed = 0;
    for (int i = 0; i < n; i++) {
        char key[40];
        snprintf(key, sizeof key, "/checks/%d/pass", i);
        passed += strcmp(silt_summary_text(summary, key), "true") == 0;
    }
    fprintf(to, "  checks     %d of %d pass\n", passed > 0 ? passed : 0, n > 0 ? n : 0);
}

// step and time of the last whole row of a run that left no summary
static void info_last_row(const char *out, FILE *to) {
    char *path = silt_text("%s/history.csv", out), *line = NULL;
    size_t capacity = 0;
    ssize_t length;
    long long step = -1;
    double time = 0;
    FILE *from = fopen(path, "r");
    while (from && (length = getline(&line, &capacity, from)) > 0 && line[length - 1] == '\n')
        sscanf(line, "%lld,%lf", &step, &time);
    if (from)
        fclose(from);
    if (step >= 0)
        fprintf(to, "  reached    %g s in %lld steps so far; no summary: it is running or was killed\n", time, step);
    free(line);
    free(path);
}

static silt_status info_out(const char *out, FILE *to, silt_error *err) {
    char *history = silt_text("%s/history.csv", out);
    struct stat file;
    struct fy_document *summary = NULL;
    silt_status status = SILT_OK;
    if (stat(history, &file) != 0) {
        status = silt_fail(err, SILT_INPUT, "%s: no output of a run stands there, history.csv is absent", out);
        goto done;
    }
    summary = silt_summary_open(out);
    if (summary) {
        info_summary(summary, to);
    } else {
        fprintf(to, "%s\n", out);
        info_last_row(out, to);
    }
    silt_frame_entry *entry = NULL;
    int n = silt_frame_index(out, &entry);
    fprintf(to, "  frames     %d", n);
    fprintf(to, n > 0 ? ", to %g s\n" : "\n", n > 0 ? entry[n - 1].time : 0);
    free(entry);
    for (int k = 0; k < 2; k++) {
        char *checkpoint = silt_text("%s/checkpoint-%c.h5", out, "ab"[k]);
        if (stat(checkpoint, &file) == 0)
            fprintf(to, "  checkpoint %s, %.1f MB\n", checkpoint, file.st_size / 1e6);
        free(checkpoint);
    }
done:
    silt_summary_close(summary);
    free(history);
    return status;
}

silt_status silt_info(const char *path, FILE *to, silt_error *err) {
    struct stat file;
    if (stat(path, &file) != 0)
        return silt_fail(err, SILT_INPUT, "%s: cannot be read (%s)", path, strerror(errno));
    if (S_ISDIR(file.st_mode))
        return info_out(path, to, err);
    silt_scene *scene = NULL;
    SILT_TRY(silt_scene_read(path, 0, NULL, &scene, err));
    silt_info_scene(scene, to);
    silt_scene_free(&scene);
    return SILT_OK;
}

// history.csv: a row per step, columns by what the scene has

#include "output.h"

#include <errno.h>
#include <unistd.h>

// longer than any row: a row goes out in one piece
#define HISTORY_BUFFER (1 << 16)

struct silt_history {
    FILE *file;
    char *path;              // owned
    const silt_scene *scene; // borrowed
    int n_gauge;             // columns of gauges
};

// a ledger column and the part of the scene that it belongs to
typedef enum { PART_FLUID, PART_LAW, PART_BED, PART_SEEPAGE, PART_GRAINS, PART_FEED, PART_BODIES, PART_FLOW } history_part;
typedef struct history_column {
    const char *name;
    history_part part;
    size_t offset; // in silt_ledger
    bool whole;    // an int, else a double
} history_column;

static const history_column history_ledger[] = {
    {"fluid_volume", PART_FLUID, offsetof(silt_ledger, fluid_volume), false},
    {"flying_volume", PART_FLUID, offsetof(silt_ledger, flying_volume), false},
    {"mesh_volume", PART_FLUID, offsetof(silt_ledger, mesh_volume), false},
    {"fluid_mass", PART_FLUID, offsetof(silt_ledger, fluid_mass), false},
    {"volume_error", PART_FLUID, offsetof(silt_ledger, volume_error), false},
    {"kinetic_energy", PART_FLUID, offsetof(silt_ledger, kinetic_energy), false},
    {"potential_energy", PART_FLUID, offsetof(silt_ledger, potential_energy), false},
    {"momentum_x", PART_FLUID, offsetof(silt_ledger, momentum[0]), false},
    {"momentum_y", PART_FLUID, offsetof(silt_ledger, momentum[1]), false},
    {"momentum_z", PART_FLUID, offsetof(silt_ledger, momentum[2]), false},
    {"momentum_error", PART_FLUID, offsetof(silt_ledger, momentum_error), false},
    {"external_work", PART_FLUID, offsetof(silt_ledger, external_work), false},
    {"dissipation", PART_FLUID, offsetof(silt_ledger, dissipation), false},
    {"max_speed", PART_FLUID, offsetof(silt_ledger, max_speed), false},
    {"volume_solved", PART_FLUID, offsetof(silt_ledger, volume_solved), false},
    {"volume_moved", PART_FLUID, offsetof(silt_ledger, volume_moved), false},
    {"volume_reconnected", PART_FLUID, offsetof(silt_ledger, volume_reconnected), false},
    {"volume_refined", PART_FLUID, offsetof(silt_ledger, volume_refined), false},
    {"volume_given", PART_FLUID, offsetof(silt_ledger, volume_given), false},
    {"volume_owed", PART_FLUID, offsetof(silt_ledger, volume_owed), false},
    {"owed_energy", PART_FLUID, offsetof(silt_ledger, owed_energy), false},
    {"y_plus", PART_LAW, offsetof(silt_ledger, y_plus), false},
    {"angular_momentum_x", PART_FLUID, offsetof(silt_ledger, angular_momentum[0]), false},
    {"angular_momentum_y", PART_FLUID, offsetof(silt_ledger, angular_momentum[1]), false},
    {"angular_momentum_z", PART_FLUID, offsetof(silt_ledger, angular_momentum[2]), false},
    {"bed_mass", PART_BED, offsetof(silt_ledger, bed_mass), false},
    {"released_mass", PART_BED, offsetof(silt_ledger, released_mass), false},
    {"deposited_mass", PART_BED, offsetof(silt_ledger, deposited_mass), false},
    {"pore_water_mass", PART_BED, offsetof(silt_ledger, pore_water_mass), false},
    {"bed_shear", PART_BED, offsetof(silt_ledger, bed_shear), false},
    {"bed_work", PART_BED, offsetof(silt_ledger, bed_work), false},
    {"bed_y_plus", PART_BED, offsetof(silt_ledger, bed_y_plus), false},
    {"seepage", PART_SEEPAGE, offsetof(silt_ledger, seepage), false},
    {"seepage_volume", PART_SEEPAGE, offsetof(silt_ledger, seepage_volume), false},
    {"seepage_lost", PART_SEEPAGE, offsetof(silt_ledger, seepage_lost), false},
    {"grain_count", PART_GRAINS, offsetof(silt_ledger, grain_count), true},
    {"grain_mass", PART_GRAINS, offsetof(silt_ledger, grain_mass), false},
    {"grain_velocity_x", PART_GRAINS, offsetof(silt_ledger, grain_velocity[0]), false},
    {"grain_velocity_y", PART_GRAINS, offsetof(silt_ledger, grain_velocity[1]), false},
    {"grain_velocity_z", PART_GRAINS, offsetof(silt_ledger, grain_velocity[2]), false},
    {"grain_kinetic_energy", PART_GRAINS, offsetof(silt_ledger, grain_kinetic), false},
    {"grain_potential_energy", PART_GRAINS, offsetof(silt_ledger, grain_potential), false},
    {"grain_water_x", PART_GRAINS, offsetof(silt_ledger, grain_water[0]), false},
    {"grain_water_y", PART_GRAINS, offsetof(silt_ledger, grain_water[1]), false},
    {"grain_water_z", PART_GRAINS, offsetof(silt_ledger, grain_water[2]), false},
    {"grain_contact_x", PART_GRAINS, offsetof(silt_ledger, grain_contact[0]), false},
    {"grain_contact_y", PART_GRAINS, offsetof(silt_ledger, grain_contact[1]), false},
    {"grain_contact_z", PART_GRAINS, offsetof(silt_ledger, grain_contact[2]), false},
    {"sediment_error", PART_GRAINS, offsetof(silt_ledger, sediment_error), false},
    {"left_mass", PART_GRAINS, offsetof(silt_ledger, left_mass), false},
    {"fed_mass", PART_FEED, offsetof(silt_ledger, fed_mass), false},
    {"body_kinetic_energy", PART_BODIES, offsetof(silt_ledger, body_kinetic), false},
    {"body_potential_energy", PART_BODIES, offsetof(silt_ledger, body_potential), false},
    {"inflow_mass", PART_FLOW, offsetof(silt_ledger, inflow_mass), false},
    {"outflow_mass", PART_FLOW, offsetof(silt_ledger, outflow_mass), false},
};
enum { HISTORY_LEDGER = sizeof history_ledger / sizeof history_ledger[0] };

// the columns of a body after its name, in the order of history_body
static const char *const history_body_column[] = {"x",  "y",  "z",  "vx", "vy", "vz", "qw", "qx", "qy", "qz", "wx",
                                                  "wy", "wz", "fx", "fy", "fz", "tx", "ty", "tz", "cx", "cy", "cz"};
enum { HISTORY_BODY = sizeof history_body_column / sizeof history_body_column[0] };

static const char *const history_phase[PHASE_COUNT] = {
#define X(name) #name,
    SILT_PHASES(X)
#undef X
};

static bool history_has(const silt_scene *scene, history_part part) {
    switch (part) {
    case PART_FLUID:
        return scene->fluid.on;
    case PART_LAW:
        return scene->fluid.on && silt_scene_law(scene);
    case PART_BED:
        return scene->bed.on;
    case PART_SEEPAGE:
        return silt_seep_on(scene);
    case PART_GRAINS:
        return scene->grains.on;
    case PART_FEED: {
        bool fed = false;
        for (int k = 0; k < scene->fluid.n_inlet; k++)
            fed |= scene->fluid.inlet[k].grains > 0;
        return fed;
    }
    case PART_BODIES:
        return silt_scene_moves(scene) > 0;
    case PART_FLOW:
        break;
    }
    return scene->fluid.n_inlet > 0 || scene->fluid.n_outlet > 0;
}

// header line with its newline; owned by the caller
static char *history_header(const silt_scene *scene) {
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    fputs("step,time,dt", to);
    if (scene->fluid.on)
        fputs(",n_node,n_cell", to);
    for (int i = 0; i < HISTORY_LEDGER; i++) {
        if (history_has(scene, history_ledger[i].part))
            fprintf(to, ",%s", history_ledger[i].name);
    }
    for (int i = 0; i < scene->n_body; i++)
        for (int k = 0; k < HISTORY_BODY; k++)
            fprintf(to, ",%s_%s", scene->body[i].name, history_body_column[k]);
    for (int i = 0; i < silt_gauges_count(scene); i++) {
        char name[64];
        silt_gauges_name(scene, i, name);
        fprintf(to, ",%s", name);
    }
    for (int i = 0; i < PHASE_COUNT; i++)
        fprintf(to, ",wall_%s", history_phase[i]);
    fputc('\n', to);
    fclose(to);
    return text;
}

static silt_history *history_new(const char *out, const silt_scene *scene) {
    silt_history *h = silt_alloc(1, sizeof *h);
    h->path = silt_text("%s/history.csv", out);
    h->scene = scene;
    h->n_gauge = silt_gauges_count(scene);
    return h;
}

static void history_free(silt_history **history) {
    silt_history *h = *history;
    if (!h)
        return;
    if (h->file)
        fclose(h->file);
    free(h->path);
    free(h);
    *history = NULL;
}

silt_status silt_history_create(silt_history **history, const char *out, const silt_scene *scene, silt_error *err) {
    silt_history *h = history_new(out, scene);
    char *header = history_header(scene);
    silt_status status = SILT_OK;
    h->file = fopen(h->path, "w");
    if (h->file)
        setvbuf(h->file, NULL, _IOFBF, HISTORY_BUFFER);
    if (!h->file || fputs(header, h->file) < 0 || fflush(h->file) != 0) {
        status = silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", h->path, strerror(errno));
        history_free(&h);
    }
    free(header);
    *history = h;
    return status;
}

silt_status silt_history_reopen(silt_history **history, const char *out, const silt_scene *scene, int64_t last,
                                silt_error *err) {
    silt_history *h = history_new(out, scene);
    char *header = history_header(scene), *line = NULL;
    size_t capacity = 0;
    int64_t found = -1;
    silt_status status = SILT_FAILED;

    h->file = fopen(h->path, "r+");
    if (!h->file) {
        silt_fail(err, SILT_FAILED, "%s: cannot be opened (%s)", h->path, strerror(errno));
        goto done;
    }
    setvbuf(h->file, NULL, _IOFBF, HISTORY_BUFFER);
    ssize_t length = getline(&line, &capacity, h->file);
    if (length < 0 || strcmp(line, header) != 0) {
        silt_fail(err, SILT_FAILED, "%s: its header does not belong to the scene; expected: %.300s", h->path, header);
        goto done;
    }
    // whole rows up to the last step stay
    off_t end = length;
    while ((length = getline(&line, &capacity, h->file)) > 0 && line[length - 1] == '\n') {
        int64_t step = strtoll(line, NULL, 10);
        if (step > last)
            break;
        found = step;
        end += length;
    }
    if (found < last) {
        silt_fail(err, SILT_FAILED, "%s: ends at step %lld, before the checkpoint's step %lld", h->path,
                  (long long)found, (long long)last);
        goto done;
    }
    if (ftruncate(fileno(h->file), end) != 0 || fseeko(h->file, end, SEEK_SET) != 0) {
        silt_fail(err, SILT_FAILED, "%s: cannot be cut back (%s)", h->path, strerror(errno));
        goto done;
    }
    status = SILT_OK;
done:
    free(line);
    free(header);
    if (status)
        history_free(&h);
    *history = h;
    return status;
}

static void history_vector(FILE *to, int n, const double *value) {
    for (int i = 0; i < n; i++)
        fprintf(to, ",%.17g", value[i]);
}

static void history_body(FILE *to, const silt_body_state *bodies, int i) {
    static const struct silt_body none;
    const struct silt_body *b = bodies && i < bodies->count ? &bodies->body[i] : &none;
    history_vector(to, 3, b->x);
    history_vector(to, 3, b->v);
    history_vector(to, 4, b->q);
    history_vector(to, 3, b->w);
    history_vector(to, 3, b->force);
    history_vector(to, 3, b->torque);
    history_vector(to, 3, b->contact);
}

static void history_write(const silt_history *history, FILE *to, const silt_view *view, const double *gauge) {
    const silt_scene *scene = history->scene;
    fprintf(to, "%lld,%.17g,%.17g", (long long)view->step, view->time, view->dt);
    if (scene->fluid.on)
        fprintf(to, ",%d,%d", view->nodes ? view->nodes->count : 0, view->mesh ? view->mesh->n_cell : 0);
    for (int i = 0; i < HISTORY_LEDGER; i++) {
        const char *value = (const char *)view->ledger + history_ledger[i].offset;
        if (!history_has(scene, history_ledger[i].part))
            continue;
        if (history_ledger[i].whole)
            fprintf(to, ",%d", *(const int *)value);
        else
            history_vector(to, 1, (const double *)value);
    }
    for (int i = 0; i < scene->n_body; i++)
        history_body(to, view->bodies, i);
    history_vector(to, history->n_gauge, gauge);
    for (int i = 0; i < PHASE_COUNT; i++)
        fprintf(to, ",%.6g", view->wall[i]);
    fputc('\n', to);
}

silt_status silt_history_row(silt_history *history, const silt_view *view, const double *gauge, silt_error *err) {
    history_write(history, history->file, view, gauge);
    // a killed run leaves whole rows
    if (fflush(history->file) != 0)
        return silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", history->path, strerror(errno));
    return SILT_OK;
}

double silt_history_value(silt_history *history, const silt_view *view, const double *gauge, const char *column) {
    char *row = NULL, *name = history_header(history->scene), *next_name, *next;
    size_t size;
    double value = NAN;
    FILE *to = open_memstream(&row, &size);
    history_write(history, to, view, gauge);
    fclose(to);
    const char *word = strtok_r(name, ",\n", &next_name), *number = strtok_r(row, ",\n", &next);
    while (word && number && strcmp(word, column) != 0) {
        word = strtok_r(NULL, ",\n", &next_name);
        number = strtok_r(NULL, ",\n", &next);
    }
    if (word && number)
        value = strtod(number, NULL);
    free(name);
    free(row);
    return value;
}

silt_status silt_history_sync(silt_history *history, silt_error *err) {
    if (fflush(history->file) != 0 || fsync(fileno(history->file)) != 0)
        return silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", history->path, strerror(errno));
    return SILT_OK;
}

silt_status silt_history_close(silt_history **history, silt_error *err) {
    if (!*history)
        return SILT_OK;
    silt_status status = silt_history_sync(*history, err);
    history_free(history);
    return status;
}

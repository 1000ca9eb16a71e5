/** @file scene_hash.c
 * A number for all that a scene says: the resolved text without folders, and what the files hold that it names.
 */
#include "scene_keys.h"

// numbers of the tables and bytes of the files that the water's start and its walls are made from
static uint64_t hash_series(uint64_t hash, const silt_series *series) {
    return silt_hash(hash, series->value, (size_t)series->n_row * (size_t)series->n_column * sizeof *series->value);
}

static uint64_t hash_file(uint64_t hash, const char *path) {
    char block[1 << 14];
    FILE *file = path ? fopen(path, "rb") : NULL;
    for (size_t n; file && (n = fread(block, 1, sizeof block, file)) > 0;)
        hash = silt_hash(hash, block, n);
    if (file)
        fclose(file);
    return hash;
}

static uint64_t hash_outline(uint64_t hash, const silt_region *region) {
    return region->outline ? silt_hash(hash, region->point, (size_t)region->n_point * 3 * sizeof(double)) : hash;
}

uint64_t silt_scene_hash(const silt_scene *scene) {
    const silt_fluid_def *fluid = &scene->fluid;
    char *text = silt_scene_text(scene, false);
    uint64_t hash = silt_hash(0, text, strlen(text));
    free(text);
    for (int i = 0; i < fluid->n_inlet; i++)
        hash = hash_series(hash_series(hash, &fluid->inlet[i].series), &fluid->inlet[i].head);
    for (int i = 0; i < fluid->n_outlet; i++)
        hash = hash_series(hash, &fluid->outlet[i].level);
    for (int i = 0; i < scene->n_wall; i++) {
        hash = hash_series(hash, &scene->wall[i].motion);
        hash = hash_file(hash, scene->wall[i].surface);
    }
    for (int i = 0; i < scene->n_body; i++)
        hash = hash_series(hash, &scene->body[i].path);
    for (int i = 0; i < fluid->n_region; i++)
        hash = hash_outline(hash, &fluid->region[i]);
    hash = hash_series(hash, &scene->grains.sieve);
    for (int i = 0; i < scene->bed.n_region; i++)
        hash = hash_outline(hash, &scene->bed.region[i]);
    for (int i = 0; i < fluid->n_size; i++)
        hash = hash_outline(hash, &fluid->size_at[i].region);
    for (int i = 0; i < scene->grains.n_fill; i++)
        hash = hash_outline(hash_series(hash, &scene->grains.fill[i].sieve), &scene->grains.fill[i].region);
    hash = hash_series(hash, &fluid->velocity.series);
    hash = hash_series(hash, &fluid->force.series);
    return hash_file(hash, fluid->cloud);
}

// checkpoints: everything that the next step depends on, nothing that it derives
#include "run.h"

// one list for both directions
#define STATE_SCALARS(X)                                                                                               \
    X("run/step", STORE_LONG, run->step)                                                                               \
    X("run/frame", STORE_LONG, run->frame)                                                                             \
    X("run/tick", STORE_LONG, run->tick)                                                                               \
    X("run/offset", STORE_DOUBLE, run->offset)                                                                         \
    X("run/time", STORE_DOUBLE, run->time)                                                                             \
    X("run/wear_ahead", STORE_DOUBLE, run->wear_ahead)                                                                 \
    X("run/dt", STORE_DOUBLE, run->dt)                                                                                 \
    X("run/next_id", STORE_LONG, run->nodes.next_id)                                                                   \
    X("mesh/revision", STORE_LONG, run->mesh.revision)                                                                 \
    X("bed/revision_known", STORE_LONG, run->bed_revision)

#define STATE_NODES(X)                                                                                                 \
    X("nodes/x", STORE_DOUBLE, run->nodes.x, D)                                                                        \
    X("nodes/v", STORE_DOUBLE, run->nodes.v, D)                                                                        \
    X("nodes/p", STORE_DOUBLE, run->nodes.p, 1)                                                                        \
    X("nodes/debt", STORE_DOUBLE, run->nodes.debt, 1)                                                                  \
    X("nodes/id", STORE_LONG, run->nodes.id, 1)                                                                        \
    X("nodes/kind", STORE_BYTE, run->nodes.kind, 1)                                                                    \
    X("nodes/owner", STORE_INT, run->nodes.owner, 1)                                                                   \
    X("nodes/wall", STORE_INT, run->nodes.wall, 3)

silt_status silt_run_save(silt_run *run, const char *path, silt_error *err) {
    silt_store *store = NULL;
    const size_t n = (size_t)run->nodes.count, D = (size_t)silt_nodes_dim(&run->nodes);
    silt_status status = silt_store_create(&store, path, err);
#define PUT(name, type, value)                                                                                         \
    if (status == SILT_OK)                                                                                             \
        status = silt_store_put(store, name, type, 1, &(value), err);
    STATE_SCALARS(PUT)
#undef PUT
#define PUT(name, type, array, per)                                                                                    \
    if (status == SILT_OK)                                                                                             \
        status = silt_store_put(store, name, type, n * (per), array, err);
    STATE_NODES(PUT)
#undef PUT
    if (status == SILT_OK && run->nodes.eddy)
        status = silt_store_put(store, "nodes/eddy", STORE_DOUBLE, n, run->nodes.eddy, err);
    if (status == SILT_OK)
        status = silt_store_put(store, "mesh/cell", STORE_INT, 4 * (size_t)run->mesh.n_cell, run->mesh.cell, err);
    if (status == SILT_OK)
        status = silt_store_put(store, "run/ledger", STORE_BYTE, sizeof run->ledger, &run->ledger, err);
    if (status == SILT_OK)
        status = silt_store_put(store, "sediment/waiting", STORE_BYTE, (size_t)run->n_waiting * sizeof *run->waiting, run->waiting, err);
    if (status == SILT_OK)
        status = silt_store_put(store, "sediment/rest", STORE_BYTE, (size_t)run->n_rest * sizeof *run->rest, run->rest, err);
    if (status == SILT_OK)
        status = silt_store_put(store, "sediment/owed", STORE_BYTE, (size_t)run->n_owed * sizeof *run->owed, run->owed, err);
    if (status == SILT_OK && run->scene->n_body) {
        SILT_RESERVE(run->body_carry, run->body_carry_capacity, run->scene->n_body);
        status = silt_store_put(store, "bodies/carry", STORE_DOUBLE, 6 * (size_t)run->scene->n_body, run->body_carry, err);
    }
    if (status == SILT_OK && run->scene->n_body) {
        SILT_RESERVE(run->body_water, run->body_water_capacity, run->scene->n_body);
        status = silt_store_put(store, "bodies/water", STORE_BYTE, (size_t)run->scene->n_body * sizeof *run->body_water, run->body_water, err);
    }
    if (status == SILT_OK && run->scene->n_body)
        status = silt_store_put(store, "bodies/inertia", STORE_DOUBLE,
                                run->body_inertia ? 36 * (size_t)run->scene->n_body * (size_t)run->scene->n_body : 0, run->body_inertia, err);
    if (status == SILT_OK)
        status = silt_gauges_save(run->gauges, store, err);
    if (status == SILT_OK && run->scene->fluid.air_pressure > 0)
        status = silt_pockets_save(&run->pockets, store, err);
    if (status == SILT_OK && run->scene->bed.on)
        status = silt_bed_save(&run->bed, store, err);
    if (status == SILT_OK && silt_seep_on(run->scene))
        status = silt_seep_save(&run->seep, store, err);
    if (status == SILT_OK && run->coupling)
        status = silt_coupling_dem.save(run->coupling, store, err);
    if (status == SILT_OK)
        status = silt_store_commit(&store, err);
    else
        silt_store_close(&store);
    // what outlives a step is dropped on both sides of a checkpoint
    silt_pressure_forget(run->fluid.pressure);
    silt_stiff_forget(run->fluid.stiff);
    return status;
}

static silt_status take_list(silt_store *store, const char *name, size_t size, void **data, int *count, int *capacity,
                             silt_error *err) {
    size_t bytes;
    SILT_TRY(silt_store_count(store, name, &bytes, err));
    *count = (int)(bytes / size);
    *data = silt_grow(*data, capacity, *count + 1, size);
    return silt_store_take(store, name, STORE_BYTE, bytes, *data, err);
}

silt_status silt_run_load(silt_run *run, silt_store *store, silt_error *err) {
    const silt_scene *scene = run->scene;
    size_t n = 0, n_index = 0;
    SILT_TRY(silt_store_count(store, "nodes/p", &n, err));
    const double nowhere[3] = {0};
    const size_t D = (size_t)silt_nodes_dim(&run->nodes);
    for (size_t i = 0; i < n; i++)
        silt_nodes_add(&run->nodes, NODE_FLUID, -1, nowhere);
#define TAKE(name, type, value) SILT_TRY(silt_store_take(store, name, type, 1, &(value), err));
    STATE_SCALARS(TAKE)
#undef TAKE
#define TAKE(name, type, array, per)                                                                                   \
    if (n)                                                                                                             \
        SILT_TRY(silt_store_take(store, name, type, n * (per), array, err));
    STATE_NODES(TAKE)
#undef TAKE
    if (scene->fluid.on && silt_turbulence_model(scene) == TURBULENCE_SPALART_ALLMARAS) {
        silt_nodes_eddies(&run->nodes);
        SILT_TRY(silt_store_take(store, "nodes/eddy", STORE_DOUBLE, n, run->nodes.eddy, err));
    }
    silt_walls_move(&run->walls, scene, run->time, 0);
    SILT_TRY(silt_store_count(store, "mesh/cell", &n_index, err));
    run->mesh.n_cell = (int)(n_index / 4);
    SILT_RESERVE(run->mesh.cell, run->mesh.cell_capacity, run->mesh.n_cell + 1);
    if (n_index)
        SILT_TRY(silt_store_take(store, "mesh/cell", STORE_INT, n_index, run->mesh.cell, err));
    SILT_TRY(silt_store_take(store, "run/ledger", STORE_BYTE, sizeof run->ledger, &run->ledger, err));
    SILT_TRY(take_list(store, "sediment/waiting", sizeof *run->waiting, (void **)&run->waiting, &run->n_waiting,
                       &run->waiting_capacity, err));
    SILT_TRY(take_list(store, "sediment/rest", sizeof *run->rest, (void **)&run->rest, &run->n_rest, &run->rest_capacity, err));
    SILT_TRY(take_list(store, "sediment/owed", sizeof *run->owed, (void **)&run->owed, &run->n_owed, &run->owed_capacity, err));

    if (scene->n_body) {
        SILT_RESERVE(run->body_carry, run->body_carry_capacity, scene->n_body);
        SILT_TRY(silt_store_take(store, "bodies/carry", STORE_DOUBLE, 6 * (size_t)scene->n_body, run->body_carry, err));
        SILT_RESERVE(run->body_water, run->body_water_capacity, scene->n_body);
        SILT_TRY(silt_store_take(store, "bodies/water", STORE_BYTE, (size_t)scene->n_body * sizeof *run->body_water, run->body_water, err));
        SILT_TRY(silt_store_count(store, "bodies/inertia", &n_index, err));
        if (n_index)
            SILT_RESERVE(run->body_inertia, run->body_inertia_capacity, (int)n_index);
        SILT_TRY(silt_store_take(store, "bodies/inertia", STORE_DOUBLE, n_index, run->body_inertia, err));
    }
    if (scene->bed.on)
        SILT_TRY(silt_bed_load(&run->bed, &run->walls, store, err));
    if (silt_seep_on(scene))
        SILT_TRY(silt_seep_load(&run->seep, &run->bed, &run->nodes, store, err));
    if (silt_scene_has_dem(scene)) {
        silt_coupling_def def;
        silt_coupling_def_fill(run, &def);
        def.resumed = true;
        SILT_TRY(silt_coupling_dem.load_state(&run->coupling, &def, store, err));
        run->barrier.bodies = silt_coupling_dem.bodies(run->coupling);
    }
    run->barrier.bed = scene->bed.on ? &run->bed : NULL;
    run->barrier.walls = &run->walls;

    // the topology is derived anew from the cells, under the revision it had
    if (scene->fluid.on) {
        const int64_t revision = run->mesh.revision;
        run->mesh.walls = &run->walls;
        silt_mesh_connect(&run->mesh, &run->nodes);
        run->mesh.revision = revision;
        silt_size_create(&run->size, scene, &run->walls);
        silt_size_update(run->size, &run->nodes, &run->mesh);
        silt_run_locate(run);
    }
    silt_view view = {.scene = scene, .ledger = &run->ledger, .bed = scene->bed.on ? &run->bed : NULL};
    SILT_TRY(silt_gauges_create(&run->gauges, &view, err));
    SILT_TRY(silt_gauges_load(run->gauges, store, err));
    if (scene->fluid.air_pressure > 0)
        SILT_TRY(silt_pockets_restore(&run->pockets, &run->mesh, store, err));
    // porosity of the state that was saved
    if (run->coupling && scene->fluid.on)
        SILT_TRY(silt_coupling_dem.prepare(run->coupling, &run->nodes, &run->mesh, 0, &run->drag, err));
    return SILT_OK;
}

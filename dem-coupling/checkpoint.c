// checkpoint.c: what the coupling knows, as named arrays in the store
#include "state.h"

enum { GRAIN_DOUBLES = 23, FROZEN_DOUBLES = 13, BODY_DOUBLES = 22 };

// one row of numbers per grain, sphere or body, filled or read in one place
static void checkpoint_copy(bool out, double **row, double *value, int n) {
    memcpy(out ? *row : value, out ? value : *row, (size_t)n * sizeof(double));
    *row += n;
}

static void checkpoint_grain_row(bool out, double *row, coupling_grain *g) {
    checkpoint_copy(out, &row, g->x, 3);
    checkpoint_copy(out, &row, g->v, 3);
    checkpoint_copy(out, &row, g->omega, 3);
    double *one[] = {&g->radius, &g->mass, &g->solid, &g->diameter, &g->number, &g->net};
    for (int k = 0; k < 6; k++)
        checkpoint_copy(out, &row, one[k], 1);
    checkpoint_copy(out, &row, g->force, 3);
    checkpoint_copy(out, &row, g->contact, 3);
    double last[2] = {g->contacts, g->on_bed};
    checkpoint_copy(out, &row, last, 2);
    g->contacts = (int)last[0];
    g->on_bed = (uint8_t)last[1];
}

static void checkpoint_frozen_row(bool out, double *row, silt_frozen_sphere *s) {
    checkpoint_copy(out, &row, s->x, 3);
    checkpoint_copy(out, &row, &s->radius, 1);
    checkpoint_copy(out, &row, s->end[0], 9);
}

static void checkpoint_body_row(bool out, double *row, struct silt_body *b) {
    checkpoint_copy(out, &row, b->x, 3);
    checkpoint_copy(out, &row, b->v, 3);
    checkpoint_copy(out, &row, b->q, 4);
    checkpoint_copy(out, &row, b->w, 3);
    checkpoint_copy(out, &row, b->force, 3);
    checkpoint_copy(out, &row, b->torque, 3);
    checkpoint_copy(out, &row, b->contact, 3);
}

/** the arrays of a checkpoint; owned */
typedef struct checkpoint_rows {
    int64_t number[5]; // grains, frozen spheres, bodies, next id, grains that left
    double left[3];
    int64_t *grain_id, *frozen_id;
    int *frozen_node;
    double *grain, *frozen, *body;
} checkpoint_rows;

static void checkpoint_rows_create(checkpoint_rows *r) {
    r->grain_id = silt_alloc((size_t)r->number[0], sizeof(int64_t));
    r->grain = silt_alloc((size_t)r->number[0] * GRAIN_DOUBLES, sizeof(double));
    r->frozen_id = silt_alloc((size_t)r->number[1], sizeof(int64_t));
    r->frozen_node = silt_alloc((size_t)r->number[1] * 3, sizeof(int));
    r->frozen = silt_alloc((size_t)r->number[1] * FROZEN_DOUBLES, sizeof(double));
    r->body = silt_alloc((size_t)r->number[2] * BODY_DOUBLES, sizeof(double));
}

static void checkpoint_rows_clear(checkpoint_rows *r) {
    free(r->grain_id);
    free(r->grain);
    free(r->frozen_id);
    free(r->frozen_node);
    free(r->frozen);
    free(r->body);
}

// the one list of names for both ways
static silt_status checkpoint_rows_store(checkpoint_rows *r, bool out, silt_store *store, silt_error *err) {
    size_t grains = (size_t)r->number[0], frozen = (size_t)r->number[1], bodies = (size_t)r->number[2];
    const struct {
        const char *name;
        silt_store_type type;
        size_t n;
        void *data;
    } array[] = {
        {"coupling/left", STORE_DOUBLE, 3, r->left},
        {"coupling/grain_id", STORE_LONG, grains, r->grain_id},
        {"coupling/grain", STORE_DOUBLE, grains * GRAIN_DOUBLES, r->grain},
        {"coupling/frozen_id", STORE_LONG, frozen, r->frozen_id},
        {"coupling/frozen_node", STORE_INT, frozen * 3, r->frozen_node},
        {"coupling/frozen", STORE_DOUBLE, frozen * FROZEN_DOUBLES, r->frozen},
        {"coupling/body", STORE_DOUBLE, bodies * BODY_DOUBLES, r->body},
    };
    for (size_t i = 0; i < sizeof array / sizeof *array; i++) {
        if (out)
            SILT_TRY(silt_store_put(store, array[i].name, array[i].type, array[i].n, array[i].data, err));
        else
            SILT_TRY(silt_store_take(store, array[i].name, array[i].type, array[i].n, array[i].data, err));
    }
    return SILT_OK;
}

// state to rows or back
static void checkpoint_rows_fill(checkpoint_rows *r, bool out, silt_coupling *c) {
    for (int i = 0; i < c->n_grain; i++) {
        checkpoint_grain_row(out, r->grain + (size_t)i * GRAIN_DOUBLES, &c->grain[i]);
        *(out ? &r->grain_id[i] : &c->grain[i].id) = out ? c->grain[i].id : r->grain_id[i];
    }
    for (int i = 0; i < c->frozen.count; i++) {
        silt_frozen_sphere *s = &c->frozen.sphere[i];
        checkpoint_frozen_row(out, r->frozen + (size_t)i * FROZEN_DOUBLES, s);
        *(out ? &r->frozen_id[i] : &s->id) = out ? s->id : r->frozen_id[i];
        memcpy(out ? r->frozen_node + 3 * i : s->node, out ? s->node : r->frozen_node + 3 * i, sizeof s->node);
    }
    for (int i = 0; i < c->bodies->count; i++)
        checkpoint_body_row(out, r->body + (size_t)i * BODY_DOUBLES, &c->bodies->body[i]);
}

// three numbers a grain, where there are gusts
static silt_status checkpoint_gusts(silt_coupling *c, bool out, silt_store *store, silt_error *err) {
    const size_t n = 3 * (size_t)c->n_grain;
    double *gust = silt_alloc(n + 1, sizeof *gust);
    for (int i = 0; i < c->n_grain && out; i++)
        memcpy(gust + 3 * i, c->grain[i].gust, sizeof c->grain[i].gust);
    const silt_status status = out ? silt_store_put(store, "coupling/gust", STORE_DOUBLE, n, gust, err)
                                   : silt_store_take(store, "coupling/gust", STORE_DOUBLE, n, gust, err);
    for (int i = 0; i < c->n_grain && !out && status == SILT_OK; i++)
        memcpy(c->grain[i].gust, gust + 3 * i, sizeof c->grain[i].gust);
    free(gust);
    return status;
}

silt_status silt_checkpoint_save(silt_coupling *c, silt_store *store, silt_error *err) {
    checkpoint_rows r = {.number = {c->n_grain, c->frozen.count, c->bodies->count, c->next_id, c->left_count},
                         .left = {c->left_mass, c->left_rest, c->left_solid}};
    checkpoint_rows_create(&r);
    checkpoint_rows_fill(&r, true, c);
    silt_status status = silt_store_put(store, "coupling/number", STORE_LONG, 5, r.number, err);
    if (status == SILT_OK)
        status = checkpoint_rows_store(&r, true, store, err);
    if (status == SILT_OK && c->n_motion > 0)
        status = silt_store_put(store, "coupling/wall", STORE_DOUBLE, sizeof *c->centre / sizeof(double) * (size_t)c->n_motion, c->centre,
                                err);
    if (status == SILT_OK && c->exchange.gusts)
        status = checkpoint_gusts(c, true, store, err);
    if (status == SILT_OK)
        status = silt_coupling_freed(c, true, store, err);
    checkpoint_rows_clear(&r);
    return status;
}

silt_status silt_checkpoint_load(silt_coupling *c, silt_store *store, silt_error *err) {
    checkpoint_rows r = {0};
    SILT_TRY(silt_store_take(store, "coupling/number", STORE_LONG, 5, r.number, err));
    if (r.number[2] != c->bodies->count)
        return silt_fail(err, SILT_FAILED, "checkpoint: coupling/number has %lld bodies, the scene has %d",
                         (long long)r.number[2], c->bodies->count);
    checkpoint_rows_create(&r);
    silt_status status = checkpoint_rows_store(&r, false, store, err);
    if (status == SILT_OK && c->n_motion > 0)
        status = silt_store_take(store, "coupling/wall", STORE_DOUBLE, sizeof *c->centre / sizeof(double) * (size_t)c->n_motion,
                                 c->towards, err);
    if (status == SILT_OK)
        status = silt_coupling_freed(c, false, store, err);
    if (status != SILT_OK)
        goto done;
    silt_coupling_walls_stand(c);

    c->next_id = r.number[3];
    c->left_count = r.number[4];
    c->left_mass = r.left[0];
    c->left_rest = r.left[1];
    c->left_solid = r.left[2];
    c->n_grain = (int)r.number[0];
    c->n_last = 0;
    c->sent_id = r.number[3];
    c->frozen.count = (int)r.number[1];
    SILT_RESERVE(c->grain, c->grain_capacity, c->n_grain);
    SILT_RESERVE(c->last, c->last_capacity, c->n_grain);
    SILT_RESERVE(c->frozen.sphere, c->frozen.capacity, c->frozen.count);
    checkpoint_rows_fill(&r, false, c);
    for (int i = 0; i < c->n_grain; i++) {
        c->grain[i].sent = true;
        c->grain[i].near = -1;
        c->grain[i].fixed = coupling_fixes(c, c->grain[i].id);
        if (!c->grain[i].fixed)
            c->last[c->n_last++] = c->grain[i].id;
    }
    for (int i = 0; i < c->frozen.count; i++)
        c->frozen.sphere[i].sent = true;
    if (c->exchange.gusts)
        status = checkpoint_gusts(c, false, store, err);
done:
    checkpoint_rows_clear(&r);
    return status;
}

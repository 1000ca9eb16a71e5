// answer.c: bodies that the water moves with: their answer to contacts, what they received, and steps that are taken back
#include "state.h"

void silt_coupling_respond(silt_coupling *c, int size, const double *matrix) {
    c->responds = size > 0;
    SILT_RESERVE(c->response, c->response_capacity, size * size + 1);
    memcpy(c->response, matrix, (size_t)size * (size_t)size * sizeof *matrix);
    silt_dem_respond(c->dem, c->response);
}

void silt_coupling_bodies_receive(silt_coupling *c, const silt_dem_state *state) {
    for (int i = 0; i < state->n_body && i < c->bodies->count; i++) {
        struct silt_body *b = &c->bodies->body[i];
        const double *answer = state->body_answer + 6 * i, *contact = state->body_contact + 6 * i;
        memcpy(b->x, state->body_x + 3 * i, sizeof b->x);
        memcpy(b->v, state->body_v + 3 * i, sizeof b->v);
        memcpy(b->w, state->body_omega + 3 * i, sizeof b->w);
        memcpy(b->q, state->body_q + 4 * i, sizeof b->q);
        for (int k = 0; k < 3 && c->elapsed > 0.0; k++) {
            b->force[k] += c->responds ? answer[k] / c->width : 0.0;
            b->torque[k] += c->responds ? answer[3 + k] / c->width : 0.0;
            const double change = b->mass * ((b->v[k] - c->body[i].old_v[k]) / c->elapsed - c->scene->gravity[k]);
            b->contact[k] = c->responds && !c->body[i].fixed ? contact[k] / c->width : change - b->force[k];
        }
    }
    c->responds = false;
}

void silt_coupling_keep_old(silt_coupling *c) {
    coupling_old *old = &c->old;
    const size_t n_wall = (size_t)c->walls->count, n_motion = (size_t)c->n_motion, n_body = (size_t)c->bodies->count;
    if (!old->body) {
        old->body = silt_alloc(n_body + 1, sizeof *old->body);
        old->freed = silt_alloc(n_body + 1, sizeof *old->freed);
        old->wall = silt_alloc(n_wall + 1, sizeof *old->wall);
        old->triangle = silt_alloc(n_wall + 1, sizeof *old->triangle);
        old->centre = silt_alloc(n_motion + 1, sizeof *old->centre);
        old->pivot = silt_alloc(n_motion + 1, sizeof *old->pivot);
    }
    SILT_RESERVE(old->grain, old->grain_capacity, c->n_grain + 1);
    old->kept = true;
    old->n_grain = c->n_grain;
    if (c->n_grain)
        memcpy(old->grain, c->grain, (size_t)c->n_grain * sizeof *c->grain);
    memcpy(old->body, c->bodies->body, n_body * sizeof *old->body);
    for (int i = 0; i < c->bodies->count; i++)
        old->freed[i] = c->body[i].freed;
    memcpy(old->wall, c->wall, n_wall * sizeof *old->wall);
    memcpy(old->triangle, c->triangle, n_wall * sizeof *old->triangle);
    memcpy(old->centre, c->centre, n_motion * sizeof *old->centre);
    memcpy(old->pivot, c->pivot, n_motion * sizeof *old->pivot);
    const double left[3] = {c->left_mass, c->left_rest, c->left_solid};
    memcpy(old->left, left, sizeof left);
    old->left_count = c->left_count;
}

void silt_coupling_take_old(silt_coupling *c) {
    const coupling_old *old = &c->old;
    if (!old->kept)
        return;
    c->n_grain = old->n_grain;
    c->n_gone = 0;
    if (c->n_grain)
        memcpy(c->grain, old->grain, (size_t)c->n_grain * sizeof *c->grain);
    memcpy(c->bodies->body, old->body, (size_t)c->bodies->count * sizeof *old->body);
    for (int i = 0; i < c->bodies->count; i++)
        c->body[i].freed = old->freed[i];
    memcpy(c->wall, old->wall, (size_t)c->walls->count * sizeof *old->wall);
    memcpy(c->triangle, old->triangle, (size_t)c->walls->count * sizeof *old->triangle);
    memcpy(c->centre, old->centre, (size_t)c->n_motion * sizeof *old->centre);
    memcpy(c->pivot, old->pivot, (size_t)c->n_motion * sizeof *old->pivot);
    c->left_mass = old->left[0];
    c->left_rest = old->left[1];
    c->left_solid = old->left[2];
    c->left_count = old->left_count;
    c->responds = false;
}

void silt_coupling_forget_old(silt_coupling *c) {
    coupling_old *old = &c->old;
    free(old->grain);
    free(old->body);
    free(old->freed);
    free(old->wall);
    free(old->triangle);
    free(old->centre);
    free(old->pivot);
    *old = (coupling_old){0};
}

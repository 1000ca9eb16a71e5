// bodies in space with the surface that the scene gives them, which is finer than the one that the water sees

#include "draw.h"
#include "form.h"
#include "report.h"

struct silt_draw_forms {
    int n;
    silt_solid *solid; // owned, one per body; empty: it cannot be made
    silt_table table;  // of history.csv
};

void silt_draw_forms_make(silt_draw_forms **forms, const silt_scene *scene, const char *out) {
    if (scene->dimension != 3 || scene->n_body == 0)
        return;
    silt_draw_forms *f = *forms = silt_alloc(1, sizeof **forms);
    f->n = scene->n_body;
    f->solid = silt_alloc((size_t)f->n, sizeof *f->solid);
    for (int i = 0; i < f->n; i++)
        if (silt_form_create(&f->solid[i], &scene->body[i], NULL) != SILT_OK) // a file that is gone since: the frame has a surface
            silt_solid_clear(&f->solid[i]);
    silt_table_read(&f->table, out);
}

void silt_draw_forms_free(silt_draw_forms **forms) {
    silt_draw_forms *f = *forms;
    if (!f)
        return;
    for (int i = 0; i < f->n; i++)
        silt_solid_clear(&f->solid[i]);
    silt_table_clear(&f->table);
    free(f->solid);
    free(f);
    *forms = NULL;
}

const silt_solid *silt_draw_form(const silt_draw_forms *f, const silt_scene *scene, int body, double time, double **point) {
    static const char *const part[] = {"x", "y", "z", "qw", "qx", "qy", "qz"};
    double pose[7];
    if (!f || f->solid[body].n_face == 0)
        return NULL;
    const double *clock = silt_table_column(&f->table, "time");
    int row = clock ? f->table.n_row - 1 : -1;
    while (row >= 0 && fabs(clock[row] - time) > 1e-9 * silt_max(1, time))
        row--;
    for (int k = 0; k < 7 && row >= 0; k++) {
        char name[128];
        snprintf(name, sizeof name, "%.100s_%s", scene->body[body].name, part[k]);
        const double *column = silt_table_column(&f->table, name);
        if (!column)
            return NULL;
        pose[k] = column[row];
    }
    if (row < 0)
        return NULL;
    const silt_solid *solid = &f->solid[body];
    *point = silt_alloc(3 * (size_t)solid->n_point, sizeof **point);
    for (int i = 0; i < solid->n_point; i++) {
        silt_turn(pose + 3, false, solid->point[i], *point + 3 * i);
        for (int d = 0; d < 3; d++)
            (*point)[3 * i + d] += pose[d];
    }
    return solid;
}

// the surfaces of all bodies in one grid, or false: the frame's stays
static bool form_grid(const silt_draw_canvas *c, double time, silt_grid *grid) {
    silt_grid made = {.time = grid->time};
    int points = 0, cells = 0;
    for (int i = 0; i < c->forms->n; i++) {
        points += c->forms->solid[i].n_point;
        cells += c->forms->solid[i].n_face;
    }
    made.x = silt_alloc(3 * (size_t)points + 1, sizeof *made.x);
    made.offset = silt_alloc((size_t)cells + 1, sizeof *made.offset);
    made.link = silt_alloc(3 * (size_t)cells + 1, sizeof *made.link);
    for (int i = 0; i < c->forms->n; i++) {
        double *point = NULL;
        const silt_solid *solid = silt_draw_form(c->forms, c->scene, i, time, &point);
        if (!solid) {
            silt_grid_clear(&made);
            return false;
        }
        memcpy(made.x + 3 * made.n_point, point, 3 * (size_t)solid->n_point * sizeof *point);
        for (int f = 0; f < solid->n_face; f++, made.n_cell++) {
            for (int k = 0; k < 3; k++)
                made.link[3 * made.n_cell + k] = made.n_point + solid->face[f][k];
            made.offset[made.n_cell + 1] = 3 * (made.n_cell + 1);
        }
        made.n_point += solid->n_point;
        free(point);
    }
    silt_grid_clear(grid);
    *grid = made;
    return true;
}

bool silt_draw_bodies(const silt_draw_canvas *c, const silt_frame_entry *entry, silt_grid *grid) {
    if (!silt_draw_read(c, grid, "bodies", entry->number, NULL))
        return false;
    if (c->forms)
        form_grid(c, entry->time, grid);
    return true;
}

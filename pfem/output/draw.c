// pictures of frames with a title, the time and a colour bar, drawn from the .hdf files

#include "draw.h"

#include <errno.h>
#include <unistd.h>

// even steps of lightness: still water deep blue, fast water pale
static const unsigned draw_water[] = {0x123f78, 0x1b5996, 0x2673b2, 0x338fc2, 0x4dabc8, 0x79c6c0, 0xaadaad, 0xd8e79a, 0xf6ee8c};
// from dark blue to yellow (the palette known as viridis)
static const unsigned draw_map[] = {0x440154, 0x482878, 0x3e4989, 0x31688e, 0x26828e,
                                    0x1f9e89, 0x35b779, 0x6ece58, 0xb5de2b, 0xfde725};
// untouched sand to worn
static const unsigned draw_worn[] = {0xf3e6c4, 0xf8cf87, 0xf0a050, 0xd96a2c, 0xa63c1e, 0x641a12};
// left-handed blue, right-handed red
static const unsigned draw_turn[] = {0x16345f, 0x2f6da8, 0x86b7d8, 0xf4f4f2, 0xe9a285, 0xbe4440, 0x5f1227};
#define DRAW_MAP(table) table, sizeof(table) / sizeof *(table)

static const silt_draw_field draw_fields[] = {
    {"speed", "speed, m/s", "PointData/velocity", NULL, MADE_LENGTH, DRAW_MAP(draw_water)},
    {"pressure", "pressure, Pa", "PointData/pressure", "PointData/pressure", MADE_LENGTH, DRAW_MAP(draw_map)},
    {"porosity", "porosity", "PointData/porosity", NULL, MADE_LENGTH, DRAW_MAP(draw_map)},
    {"eddies", "eddy viscosity, m²/s", "PointData/eddy_viscosity", NULL, MADE_LENGTH, DRAW_MAP(draw_map)},
    {"elevation", "elevation, m", "PointData/pressure", NULL, MADE_ELEVATION, DRAW_MAP(draw_water)},
    {"vorticity", "vorticity, 1/s", "PointData/velocity", NULL, MADE_VORTICITY, DRAW_MAP(draw_turn)},
    {"mesh", NULL, NULL, NULL, MADE_LENGTH, DRAW_MAP(draw_map)},
    {"bed", "frictional work, J/m³", NULL, "PointData/work", MADE_LENGTH, DRAW_MAP(draw_worn)},
};

// ---------------------------------------------------------------- a picture

cairo_surface_t *silt_draw_picture(silt_draw_canvas *c, const silt_frame_entry *entry) {
    int width = MARGIN_LEFT + c->width + c->right, height = MARGIN_TOP + c->height + MARGIN_BOTTOM;
    c->surface = cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
    c->cr = cairo_create(c->surface);
    cairo_set_source_rgb(c->cr, 1, 1, 1);
    cairo_paint(c->cr);

    if (c->walls)
        silt_walls_move(c->walls, c->scene, entry->time, 0);
    if (c->scene->dimension == 3 && !c->slice)
        silt_draw_space(c, entry);
    else
        silt_draw_flat(c, entry);
    silt_draw_bar(c);

    char time[64];
    snprintf(time, sizeof time, "t = %.4g s", entry->time);
    silt_draw_ink(c->cr, 0x111111);
    silt_draw_text(c->cr, MARGIN_LEFT + c->width, 32, 1, 18, false, time);
    if (c->scene->title) {
        // the title has the room that the time leaves
        cairo_rectangle(c->cr, 0, 0, MARGIN_LEFT + c->width - 150, MARGIN_TOP);
        cairo_clip(c->cr);
        silt_draw_text(c->cr, MARGIN_LEFT, 32, -1, 18, true, c->scene->title);
    }
    cairo_destroy(c->cr);
    c->cr = NULL;
    return c->surface;
}

static silt_status draw_file(silt_draw_canvas *c, const silt_frame_entry *entry, const char *to, FILE *say, silt_error *err) {
    char *path = silt_text("%s/picture_%06d.png", to, entry->number), *aside = silt_text("%s.part", path);
    silt_status status = SILT_OK;
    cairo_surface_t *surface = silt_draw_picture(c, entry);
    errno = 0;
    cairo_status_t written = cairo_surface_write_to_png(surface, aside);
    cairo_surface_destroy(surface);
    if (written != CAIRO_STATUS_SUCCESS || rename(aside, path) != 0)
        status = silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", path,
                           written ? cairo_status_to_string(written) : strerror(errno));
    else if (say)
        fprintf(say, "%s\n", path);
    free(aside);
    free(path);
    return status;
}

// ---------------------------------------------------------------- what is asked for

// "y=0.5"
static bool draw_plane(const char *text, silt_draw_canvas *c) {
    char *end = NULL;
    c->slice = text[0] >= 'x' && text[0] <= 'z' && text[1] == '=' ? text[0] - 'x' + 1 : 0;
    c->slice_at = c->slice ? strtod(text + 2, &end) : 0;
    return c->slice && end > text + 2 && *end == 0 && isfinite(c->slice_at);
}

// "water,grains"
static bool draw_without(const char *text, silt_draw_canvas *c) {
    static const char *const part[] = {"water", "bed", "grains", "bodies", "walls"};
    enum { N_PART = sizeof part / sizeof *part };
    for (size_t n; *text; text += n + (text[n] == ',')) {
        int k = 0;
        for (n = strcspn(text, ","); k < N_PART && (strlen(part[k]) != n || strncmp(part[k], text, n) != 0);)
            k++;
        if (k == N_PART)
            return false;
        c->without |= 1u << k;
    }
    return c->without != 0;
}

static silt_status draw_asked(silt_draw_canvas *c, const silt_draw_def *def, silt_error *err) {
    enum { N_FIELD = sizeof draw_fields / sizeof draw_fields[0] };
    for (int i = 0; i < N_FIELD && !c->field; i++)
        if (!def->field || strcmp(def->field, draw_fields[i].name) == 0)
            c->field = &draw_fields[i];
    if (!c->field)
        return silt_fail(err, SILT_INPUT,
                         "field %s is not known: mesh, pressure, speed, elevation, vorticity, porosity, eddies or bed", def->field);
    if (def->slice && !draw_plane(def->slice, c))
        return silt_fail(err, SILT_INPUT, "slice %s is no plane: for example y=0.5", def->slice);
    if (def->without && !draw_without(def->without, c))
        return silt_fail(err, SILT_INPUT, "without %s: water, bed, grains, bodies, walls or several with commas between", def->without);
    return SILT_OK;
}

silt_status silt_draw_open(silt_draw_canvas *c, silt_draw_book *book, const char *out, const silt_draw_def *def, silt_error *err) {
    *c = (silt_draw_canvas){.out = out};
    memset(book, 0, sizeof *book);
    SILT_TRY(draw_asked(c, def, err));
    book->n_frame = silt_frame_index(out, &book->entry);
    if (book->n_frame == 0)
        return silt_fail(err, SILT_FAILED, "%s: has no frames", out);
    char *path = silt_text("%s/scene.yaml", out);
    silt_status status = silt_scene_read(path, 0, NULL, &book->scene, err);
    free(path);
    if (status)
        return status;
    c->scene = book->scene;
    if ((c->slice && c->scene->dimension != 3) || (c->field->made == MADE_VORTICITY && c->scene->dimension == 3))
        return silt_fail(err, SILT_INPUT, "%s: %s", out,
                         c->slice ? "a slice is for three dimensions" : "vorticity is drawn in two dimensions");
    // the run had them: a surface file that is gone since is no reason not to draw
    if (silt_draw_shows(c, DRAW_WALLS) && silt_walls_create(&book->walls, book->scene, NULL) == SILT_OK)
        c->walls = &book->walls;
    silt_draw_forms_make(&book->forms, book->scene, out);
    c->forms = book->forms;
    if (c->scene->dimension == 3 && !c->slice)
        silt_draw_space_survey(c, book->entry, book->n_frame);
    else
        silt_draw_flat_survey(c, book->entry, book->n_frame);
    return SILT_OK;
}

void silt_draw_close(silt_draw_book *book) {
    silt_walls_clear(&book->walls);
    silt_draw_forms_free(&book->forms);
    silt_scene_free(&book->scene);
    free(book->entry);
    memset(book, 0, sizeof *book);
}

silt_status silt_draw(const char *out, const silt_draw_def *def, FILE *say, silt_error *err) {
    silt_draw_canvas canvas;
    silt_draw_book book;
    int drawn = 0;
    silt_status status = silt_draw_open(&canvas, &book, out, def, err);
    const int n = book.n_frame;
    if (!status && def->film) {
        status = silt_draw_film(&canvas, &book, def->film, err);
        if (!status && say)
            fprintf(say, "%s\n", def->film);
        drawn = n;
    }
    for (int i = 0; i < n && !status && !def->film; i++) {
        if (def->frames == DRAW_ALL || (def->frames == DRAW_LAST ? i == n - 1 : book.entry[i].number == def->frame)) {
            status = draw_file(&canvas, &book.entry[i], def->to ? def->to : out, say, err);
            drawn++;
        }
    }
    if (!status && drawn == 0)
        status = silt_fail(err, SILT_INPUT, "%s: has no frame %d; its frames are %d to %d", out, def->frame, book.entry[0].number,
                           book.entry[n - 1].number);
    silt_draw_close(&book);
    return status;
}

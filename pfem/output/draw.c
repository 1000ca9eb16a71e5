// pictures of frames with a title, the time and a colour bar, drawn from the .hdf files

#include "draw.h"

#include <errno.h>
#include <unistd.h>

// even steps of lightness from dark blue to yellow (the palette known as viridis)
static const unsigned draw_map[] = {0x440154, 0x482878, 0x3e4989, 0x31688e, 0x26828e,
                                    0x1f9e89, 0x35b779, 0x6ece58, 0xb5de2b, 0xfde725};
// untouched sand to worn
static const unsigned draw_worn[] = {0xf3e6c4, 0xf8cf87, 0xf0a050, 0xd96a2c, 0xa63c1e, 0x641a12};
// left-handed blue, right-handed red
static const unsigned draw_turn[] = {0x16345f, 0x2f6da8, 0x86b7d8, 0xf4f4f2, 0xe9a285, 0xbe4440, 0x5f1227};
#define DRAW_MAP(table) table, sizeof(table) / sizeof *(table)

static const silt_draw_field draw_fields[] = {
    {"speed", "speed, m/s", "PointData/velocity", NULL, MADE_LENGTH, DRAW_MAP(draw_map)},
    {"pressure", "pressure, Pa", "PointData/pressure", "PointData/pressure", MADE_LENGTH, DRAW_MAP(draw_map)},
    {"porosity", "porosity", "PointData/porosity", NULL, MADE_LENGTH, DRAW_MAP(draw_map)},
    {"elevation", "elevation, m", "PointData/pressure", NULL, MADE_ELEVATION, DRAW_MAP(draw_map)},
    {"vorticity", "vorticity, 1/s", "PointData/velocity", NULL, MADE_VORTICITY, DRAW_MAP(draw_turn)},
    {"mesh", NULL, NULL, NULL, MADE_LENGTH, DRAW_MAP(draw_map)},
    {"bed", "frictional work, J/m³", NULL, "PointData/work", MADE_LENGTH, DRAW_MAP(draw_worn)},
};

// ---------------------------------------------------------------- a picture

static silt_status draw_picture(silt_draw_canvas *c, const silt_frame_entry *entry, const char *to, FILE *say,
                                silt_error *err) {
    char *path = silt_text("%s/picture_%06d.png", to, entry->number), *aside = silt_text("%s.part", path);
    silt_status status = SILT_OK;
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
    errno = 0;
    cairo_status_t written = cairo_surface_write_to_png(c->surface, aside);
    cairo_surface_destroy(c->surface);
    if (written != CAIRO_STATUS_SUCCESS || rename(aside, path) != 0)
        status = silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", path,
                           written ? cairo_status_to_string(written) : strerror(errno));
    else if (say)
        fprintf(say, "%s\n", path);
    free(aside);
    free(path);
    return status;
}

// "y=0.5"
static bool draw_plane(const char *text, silt_draw_canvas *c) {
    char *end = NULL;
    c->slice = text[0] >= 'x' && text[0] <= 'z' && text[1] == '=' ? text[0] - 'x' + 1 : 0;
    c->slice_at = c->slice ? strtod(text + 2, &end) : 0;
    return c->slice && end > text + 2 && *end == 0 && isfinite(c->slice_at);
}

silt_status silt_draw(const char *out, int frame, const char *field, const char *slice, const char *to, FILE *say,
                      silt_error *err) {
    enum { N_FIELD = sizeof draw_fields / sizeof draw_fields[0] };
    silt_draw_canvas canvas = {.out = out};
    silt_frame_entry *entry = NULL;
    silt_scene *scene = NULL;
    silt_walls walls = {0};
    silt_status status = SILT_OK;
    int n, drawn = 0;
    for (int i = 0; i < N_FIELD; i++)
        if (!field || strcmp(field, draw_fields[i].name) == 0) {
            canvas.field = &draw_fields[i];
            break;
        }
    if (!canvas.field)
        return silt_fail(err, SILT_INPUT,
                         "field %s is not known: mesh, pressure, speed, elevation, vorticity, porosity or bed", field);
    if (slice && !draw_plane(slice, &canvas))
        return silt_fail(err, SILT_INPUT, "slice %s is no plane: for example y=0.5", slice);

    char *path = silt_text("%s/scene.yaml", out);
    n = silt_frame_index(out, &entry);
    if (n == 0) {
        status = silt_fail(err, SILT_FAILED, "%s: has no frames", out);
        goto done;
    }
    status = silt_scene_read(path, 0, NULL, &scene, err);
    if (status)
        goto done;
    canvas.scene = scene;
    if ((canvas.slice && scene->dimension != 3) || (canvas.field->made == MADE_VORTICITY && scene->dimension == 3)) {
        status = silt_fail(err, SILT_INPUT, "%s: %s", out,
                           canvas.slice ? "a slice is for three dimensions" : "vorticity is drawn in two dimensions");
        goto done;
    }
    // the run had them: a surface file that is gone since is no reason not to draw
    if (silt_walls_create(&walls, scene, NULL) == SILT_OK)
        canvas.walls = &walls;
    if (scene->dimension == 3 && !canvas.slice)
        silt_draw_space_survey(&canvas, entry, n);
    else
        silt_draw_flat_survey(&canvas, entry, n);
    for (int i = 0; i < n && !status; i++) {
        if (frame == -1 || (frame == -2 ? i == n - 1 : entry[i].number == frame)) {
            status = draw_picture(&canvas, &entry[i], to ? to : out, say, err);
            drawn++;
        }
    }
    if (!status && drawn == 0)
        status = silt_fail(err, SILT_INPUT, "%s: has no frame %d; its frames are %d to %d", out, frame, entry[0].number,
                           entry[n - 1].number);
done:
    silt_walls_clear(&walls);
    silt_scene_free(&scene);
    free(entry);
    free(path);
    return status;
}

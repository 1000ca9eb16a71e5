// the report's view: frames as whole numbers of 16 bits in base64, and the scripts that show them

#include "report.h"

#include <unistd.h>

// frames of the view at the most, those that are looked at for its size, grains of a frame at the most, numbers of a place
enum { VIEW_FRAMES = 400, VIEW_SAMPLES = 5, VIEW_GRAINS = 40000, VIEW_STEPS = 65535 };

static const char *const view_library[] = {"/usr/share/javascript/three/three.min.js",
                                           "/usr/share/javascript/three/examples/js/controls/OrbitControls.js"};
enum { VIEW_LIBRARIES = sizeof view_library / sizeof *view_library };

/** the frames while they are written: an index in JSON that names blocks, and the blocks */
typedef struct view {
    const silt_report_page *report;
    silt_draw_canvas *canvas;
    double lo[3], step; // m: place = lo + step * number
    FILE *index, *blocks; // NULL: only counts
    int n_block, capacity;
    uint64_t *hash; // owned, of the blocks: what does not change is there once
    double bytes;
    int left_out; // grains that were left out of a frame, at the most
} view;

/** bytes that become a block */
typedef struct view_bytes {
    int n, capacity;
    uint8_t *data; // owned
} view_bytes;

static void bytes_add(view_bytes *b, unsigned long value, int width) {
    SILT_RESERVE(b->data, b->capacity, b->n + width);
    for (int k = 0; k < width; k++, value >>= 8)
        b->data[b->n++] = (uint8_t)(value & 255);
}

static void bytes_place(const view *v, view_bytes *b, const double *x) {
    for (int d = 0; d < 3; d++)
        bytes_add(b, (unsigned long)lround(silt_clamp((x[d] - v->lo[d]) / v->step, 0, VIEW_STEPS)), 2);
}

// "name":block, once for equal ones; empties the bytes
static void view_block(view *v, const char *name, view_bytes *b) {
    const uint64_t hash = silt_hash((uint64_t)b->n + 1, b->data, (size_t)b->n);
    int k = 0;
    while (k < v->n_block && v->hash[k] != hash)
        k++;
    if (k == v->n_block) {
        SILT_RESERVE(v->hash, v->capacity, k + 1);
        v->hash[v->n_block++] = hash;
        v->bytes += 4.0 * b->n / 3 + 3;
        if (v->blocks) {
            fputs(k ? ",\n\"" : "\n\"", v->blocks);
            silt_report_base64(v->blocks, b->data, (size_t)b->n);
            fputc('"', v->blocks);
        }
    }
    if (v->index)
        fprintf(v->index, "\"%s\":%d,", name, k);
    b->n = 0;
}

static void view_open(view *v, const char *name) {
    if (v->index)
        fprintf(v->index, ",\"%s\":{", name);
}

// what a part is told besides its blocks; ends it
static void view_close(view *v, const char *name, int number) {
    if (v->index)
        fprintf(v->index, "\"%s\":%d}", name, number);
}

static void view_points(view *v, const silt_grid *grid, bool coloured) {
    view_bytes b = {0};
    for (int i = 0; i < grid->n_point; i++)
        bytes_place(v, &b, grid->x + 3 * i);
    view_block(v, "x", &b);
    for (int i = 0; coloured && grid->value && i < grid->n_point; i++)
        bytes_add(&b, (unsigned long)lround(255 * silt_clamp((grid->value[i] - v->canvas->low) / (v->canvas->high - v->canvas->low), 0, 1)), 1);
    if (coloured && grid->value)
        view_block(v, "c", &b);
    free(b.data);
}

// bytes of a number of a point
static int view_width(const silt_grid *grid) {
    return grid->n_point <= VIEW_STEPS ? 2 : 4;
}

static void view_link(view_bytes *b, const silt_grid *grid, int n, const int *node) {
    for (int k = 0; k < n; k++)
        bytes_add(b, (unsigned long)node[k], view_width(grid));
}

// ---------------------------------------------------------------- the parts

static bool view_read(const view *v, silt_grid *grid, const char *part, int number, const char *array) {
    return silt_draw_read(v->canvas, grid, part, number, array);
}

// triangles of the plane with the edges around them
static void view_plane(view *v, const silt_grid *grid) {
    view_bytes b = {0};
    int(*edge)[2];
    for (int i = 0; i < grid->n_cell; i++)
        if (silt_grid_corners(grid, i) == 3)
            view_link(&b, grid, 3, grid->link + grid->offset[i]);
    view_block(v, "f", &b);
    const int n = silt_draw_edges(grid, false, &edge);
    for (int i = 0; i < n; i++)
        view_link(&b, grid, 2, edge[i]);
    view_block(v, "e", &b);
    free(edge);
    free(b.data);
}

static void view_water(view *v, int number) {
    const bool space = v->canvas->scene->dimension == 3;
    silt_grid grid;
    view_bytes b = {0};
    if (view_read(v, &grid, space ? "surface" : "fluid", number, v->canvas->field->water)) {
        int n_free = 0;
        view_open(v, "water");
        view_points(v, &grid, true);
        // in space the free surface first, then what lies on walls, bed and objects
        for (int pass = 0; pass < 2 && space; pass++)
            for (int i = 0; i < grid.n_cell; i++)
                if ((grid.kind && grid.kind[i] != FACET_FREE) == (pass == 1)) {
                    view_link(&b, &grid, 3, grid.link + grid.offset[i]);
                    n_free += pass == 0;
                }
        if (space)
            view_block(v, "f", &b);
        else
            view_plane(v, &grid);
        view_close(v, "free", n_free);
        silt_grid_clear(&grid);
    }
    // drops: nodes of water without a cell
    if (view_read(v, &grid, "fluid", number, NULL)) {
        for (int i = 0; i < grid.n_cell; i++) {
            const int node = grid.link[grid.offset[i]];
            if (silt_grid_corners(&grid, i) == 1 && (!grid.kind || grid.kind[node] == NODE_FLUID))
                bytes_place(v, &b, grid.x + 3 * node);
        }
        if (b.n > 0) {
            view_open(v, "drops");
            view_block(v, "x", &b);
            view_close(v, "n", 0);
        }
        silt_grid_clear(&grid);
    }
    free(b.data);
}

static void view_bed(view *v, int number) {
    silt_grid grid;
    if (!view_read(v, &grid, "bed", number, v->canvas->field->bed))
        return;
    view_open(v, "bed");
    if (v->canvas->scene->dimension == 3) {
        int(*face)[3];
        view_bytes b = {0};
        const int n = silt_draw_outside(&grid, &face);
        // the faces' points alone
        int *place = silt_alloc((size_t)grid.n_point + 1, sizeof *place), kept = 0;
        for (int i = 0; i < 3 * n; i++)
            place[face[i / 3][i % 3]] = 1;
        for (int i = 0; i < grid.n_point; i++) {
            if (!place[i])
                continue;
            memmove(grid.x + 3 * kept, grid.x + 3 * i, 3 * sizeof *grid.x);
            if (grid.value)
                grid.value[kept] = grid.value[i];
            place[i] = kept++;
        }
        grid.n_point = kept;
        view_points(v, &grid, true);
        for (int i = 0; i < 3 * n; i++)
            bytes_add(&b, (unsigned long)place[face[i / 3][i % 3]], view_width(&grid));
        view_block(v, "f", &b);
        free(place);
        free(face);
        free(b.data);
    } else {
        view_points(v, &grid, true);
        view_plane(v, &grid);
    }
    view_close(v, "n", grid.n_cell);
    silt_grid_clear(&grid);
}

static void view_grains(view *v, int number) {
    silt_grid grid;
    view_bytes b = {0}, radius = {0};
    if (!view_read(v, &grid, "grains", number, silt_draw_grain_array(v->canvas)))
        return;
    const int every = 1 + (grid.n_point - 1) / VIEW_GRAINS;
    for (int i = 0; i < grid.n_point; i += every) {
        const double *x = grid.x + 3 * i, r = grid.radius ? grid.radius[i] : 0;
        bytes_place(v, &b, x);
        bytes_add(&radius, (unsigned long)lround(silt_clamp(r / v->step * 16, 0, VIEW_STEPS)), 2);
    }
    if (b.n > 0) {
        view_open(v, "grains");
        view_block(v, "x", &b);
        view_block(v, "r", &radius);
        view_close(v, "n", b.n / 6);
    }
    if (every > 1)
        v->left_out = (int)silt_max(v->left_out, grid.n_point - grid.n_point / every);
    free(b.data);
    free(radius.data);
    silt_grid_clear(&grid);
}

// faces as fans of triangles; outlines in the plane are not convex: the page takes them apart itself
static void view_bodies(view *v, const silt_frame_entry *entry) {
    const bool space = v->canvas->scene->dimension == 3;
    silt_grid grid;
    view_bytes b = {0};
    if (!silt_draw_bodies(v->canvas, entry, &grid))
        return;
    view_open(v, "bodies");
    view_points(v, &grid, false);
    for (int i = 0; i < grid.n_cell; i++) {
        const int first = grid.offset[i];
        if (!space)
            bytes_add(&b, (unsigned long)silt_grid_corners(&grid, i), 2);
        for (int k = first + 1; space && k + 1 < grid.offset[i + 1]; k++)
            view_link(&b, &grid, 3, (const int[]){grid.link[first], grid.link[k], grid.link[k + 1]});
    }
    view_block(v, space ? "f" : "outline", &b);
    view_close(v, "n", grid.n_cell);
    silt_grid_clear(&grid);
    free(b.data);
}

static void view_walls(view *v, double time) {
    silt_walls *walls = v->canvas->walls;
    view_bytes face = {0}, edge = {0};
    if (!walls)
        return;
    silt_walls_move(walls, v->canvas->scene, time, 0);
    for (int i = 0; i < walls->count; i++)
        for (int k = 0; k < 3; k++)
            if (walls->corner) {
                bytes_place(v, &face, walls->corner[i][k]);
                if (walls->joined && silt_draw_sharp(walls, i, k)) {
                    bytes_place(v, &edge, walls->corner[i][k]);
                    bytes_place(v, &edge, walls->corner[i][(k + 1) % 3]);
                }
            } else if (k < 2) {
                const double *at = k ? walls->to[i] : walls->from[i];
                bytes_place(v, &edge, (const double[]){at[0], at[1], 0});
            }
    view_open(v, "walls");
    if (face.n > 0)
        view_block(v, "x", &face);
    view_block(v, "e", &edge);
    view_close(v, "n", walls->count);
    free(face.data);
    free(edge.data);
}

static void view_frame(view *v, const silt_frame_entry *entry) {
    if (v->index)
        fprintf(v->index, "{\"t\":%.9g,\"frame\":%d", entry->time, entry->number);
    view_water(v, entry->number);
    view_bed(v, entry->number);
    view_grains(v, entry->number);
    view_bodies(v, entry);
    view_walls(v, entry->time);
    if (v->index)
        fputc('}', v->index);
}

// ---------------------------------------------------------------- all frames

static int view_pick(int k, int n, int of) {
    return n > 1 ? (int)((long)k * (of - 1) / (n - 1)) : of - 1;
}

// the room of the numbers: what the pictures show, and room for what flies out of it
static void view_room(view *v, const silt_draw_book *book) {
    static const char *const part[] = {"fluid", "bed", "bodies"};
    const silt_draw_canvas *c = v->canvas;
    double hi[3], most = 0;
    for (int d = 0; d < 3; d++) {
        v->lo[d] = c->scene->dimension == 3 || d < 2 ? c->lo[d] : 0;
        hi[d] = c->scene->dimension == 3 || d < 2 ? c->hi[d] : 0;
    }
    for (int s = 0; s < 3 * VIEW_SAMPLES; s++) {
        silt_grid grid;
        const int number = book->entry[view_pick(s / 3, VIEW_SAMPLES, book->n_frame)].number;
        if (!view_read(v, &grid, part[s % 3], number, NULL))
            continue;
        for (int i = 0; i < grid.n_cell; i++)
            for (int k = grid.offset[i]; k < grid.offset[i + 1] && silt_grid_corners(&grid, i) > 1; k++)
                for (int d = 0; d < 3; d++) {
                    v->lo[d] = silt_min(v->lo[d], grid.x[3 * grid.link[k] + d]);
                    hi[d] = silt_max(hi[d], grid.x[3 * grid.link[k] + d]);
                }
        silt_grid_clear(&grid);
    }
    for (int i = 0; c->walls && i < c->walls->count; i++)
        for (int k = 0; k < 3; k++)
            for (int d = 0; d < (c->walls->corner ? 3 : 2); d++) {
                const double x = c->walls->corner ? c->walls->corner[i][k][d] : k ? c->walls->to[i][d] : c->walls->from[i][d];
                v->lo[d] = silt_min(v->lo[d], x);
                hi[d] = silt_max(hi[d], x);
            }
    for (int d = 0; d < 3; d++)
        most = silt_max(most, hi[d] - v->lo[d]);
    for (int d = 0; d < 3; d++)
        v->lo[d] -= 0.1 * most;
    v->step = 1.2 * most / VIEW_STEPS;
}

// frames that fit, by the size of some
static int view_count(const view *v, const silt_draw_book *book) {
    view try = *v;
    try.hash = NULL;
    const int n = (int)silt_min(VIEW_SAMPLES, book->n_frame);
    for (int k = 0; k < n; k++)
        view_frame(&try, &book->entry[view_pick(k, n, book->n_frame)]);
    free(try.hash);
    const double fit = v->report->bytes / silt_max(1, try.bytes / n);
    return (int)silt_clamp(fit, 1, silt_min(VIEW_FRAMES, book->n_frame));
}

static void view_head(FILE *to, const view *v) {
    const silt_draw_canvas *c = v->canvas;
    fprintf(to, "{\"dim\":%d,\"lo\":[%.9g,%.9g,%.9g],\"step\":%.9g,\n\"room\":[[%.9g,%.9g,%.9g],[%.9g,%.9g,%.9g]],\n\"map\":[",
            c->scene->dimension, v->lo[0], v->lo[1], v->lo[2], v->step, c->lo[0], c->lo[1], c->scene->dimension == 3 ? c->lo[2] : 0,
            c->hi[0], c->hi[1], c->scene->dimension == 3 ? c->hi[2] : 0);
    for (int k = 0; k < c->field->n_map; k++)
        fprintf(to, "%s\"#%06x\"", k ? "," : "", c->field->map[k]);
    fprintf(to, "],\"low\":%.9g,\"high\":%.9g,\"label\":", c->low, c->high);
    silt_json_text(to, c->plain ? NULL : c->field->label);
    fputs(",\n\"frames\":[", to);
}

// a script of the machine into the page; false: it is not there. A script must not hold its own end.
static bool view_script(FILE *to, const char *path) {
    char block[4096];
    size_t n;
    FILE *from = fopen(path, "r");
    if (!from)
        return false;
    fputs("<script>\n", to);
    while ((n = fread(block, 1, sizeof block, from)) > 0)
        fwrite(block, 1, n, to);
    fputs("\n</script>\n", to);
    fclose(from);
    return true;
}

const char *silt_report_view(const silt_report_page *report, silt_draw_canvas *canvas, const silt_draw_book *book) {
    for (int k = 0; k < VIEW_LIBRARIES; k++)
        if (access(view_library[k], R_OK) != 0)
            return "no view: three.js is not installed (Debian: apt-get install libjs-three)";
    FILE *to = report->to;
    view v = {.report = report, .canvas = canvas};
    char *index = NULL, *blocks = NULL;
    size_t index_size, blocks_size;
    view_room(&v, book);
    const int n = view_count(&v, book);
    v.index = open_memstream(&index, &index_size);
    v.blocks = open_memstream(&blocks, &blocks_size);
    for (int k = 0; k < n; k++) {
        fputs(k ? ",\n" : "\n", v.index);
        view_frame(&v, &book->entry[view_pick(k, n, book->n_frame)]);
    }
    fclose(v.index);
    fclose(v.blocks);
    fputs("<section id=\"view\"><h2>View</h2>\n<div id=\"stage\"></div>\n<div id=\"controls\"></div>\n<p class=\"note\">", to);
    fprintf(to, canvas->scene->dimension == 3 ? "Drag to turn, with the right button to move, wheel to zoom. "
                                              : "Drag to move, wheel to zoom. ");
    if (n < book->n_frame)
        fprintf(to, "%d of %d frames, evenly spread: the others are left out to keep the page small.", n, book->n_frame);
    else
        fprintf(to, "All %d frames.", n);
    if (v.left_out)
        fprintf(to, " Up to %d grains of a frame are left out, evenly.", v.left_out);
    fputs(" Places are rounded to a 65000th of the room; what flew farther stands at its border.</p>\n", to);
    fputs("<script type=\"application/json\" id=\"view-data\">\n", to);
    view_head(to, &v);
    fprintf(to, "%s],\n\"blocks\":[%s]}\n</script>\n", index, blocks);
    for (int k = 0; k < VIEW_LIBRARIES; k++)
        view_script(to, view_library[k]);
    fprintf(to, "<script>\n%s</script>\n</section>\n", silt_report_script);
    free(index);
    free(blocks);
    free(v.hash);
    return NULL;
}

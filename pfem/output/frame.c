// frames: fluid, its surface in 3-D, bed, grains and bodies as VTKHDF files, their .series indices, run.h5 and run.log

#include "image.h"
#include "output.h"

#include <errno.h>
#include <unistd.h>

// cell types of VTK
enum { VTK_VERTEX = 1, VTK_TRIANGLE = 5, VTK_POLYGON = 7, VTK_TETRA = 10 };

static const char *const frame_part[] = {"fluid", "surface", "bed", "grains", "bodies"};
enum { FRAME_FLUID, FRAME_SURFACE, FRAME_BED, FRAME_GRAINS, FRAME_BODIES, FRAME_PARTS };

// ---------------------------------------------------------------- one VTKHDF file

typedef struct frame_file {
    char *path, *part; // owned, final name and the name while it is written
    hid_t file, root, point, cell;
    bool bad; // some call failed; frame_close reports
} frame_file;

// rows x columns values; columns 0: a list of single values
static void frame_put(frame_file *f, hid_t group, const char *name, hid_t type, size_t rows, int columns,
                      const void *data) {
    hsize_t size[2] = {rows, (hsize_t)columns};
    hid_t space = H5Screate_simple(columns > 0 ? 2 : 1, size, NULL);
    hid_t create = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_obj_track_times(create, false);
    hid_t set = H5Dcreate2(group, name, type, space, H5P_DEFAULT, create, H5P_DEFAULT);
    f->bad |= set < 0 || (rows > 0 && H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0);
    if (set >= 0)
        H5Dclose(set);
    H5Pclose(create);
    H5Sclose(space);
}

static void frame_attribute(hid_t object, const char *name, hid_t type, hsize_t n, const void *data) {
    hid_t space = n > 1 ? H5Screate_simple(1, &n, NULL) : H5Screate(H5S_SCALAR);
    hid_t attribute = H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    if (attribute >= 0) {
        H5Awrite(attribute, type, data);
        H5Aclose(attribute);
    }
    H5Sclose(space);
}

static void frame_open(frame_file *f, const char *out, const char *part, int number, const silt_view *view) {
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    memset(f, 0, sizeof *f);
    f->path = silt_text("%s/%s_%06d.hdf", out, part, number);
    f->part = silt_text("%s.part", f->path);
    f->file = silt_image_create(f->part);
    f->root = H5Gcreate2(f->file, "VTKHDF", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    f->point = H5Gcreate2(f->root, "PointData", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    f->cell = H5Gcreate2(f->root, "CellData", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    hid_t field = H5Gcreate2(f->root, "FieldData", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    f->bad = f->file < 0 || field < 0;

    // readers want the type as text of fixed length
    static const char kind[] = "UnstructuredGrid";
    hid_t text = H5Tcopy(H5T_C_S1);
    H5Tset_size(text, sizeof kind - 1);
    H5Tset_strpad(text, H5T_STR_NULLPAD);
    frame_attribute(f->root, "Version", H5T_NATIVE_INT64, 2, (int64_t[]){1, 0});
    frame_attribute(f->root, "Type", text, 1, kind);
    H5Tclose(text);
    frame_put(f, field, "TimeValue", H5T_NATIVE_DOUBLE, 1, 0, &view->time);
    frame_put(f, field, "step", H5T_NATIVE_INT64, 1, 0, &view->step);
    H5Gclose(field);
}

// points and cells; offset has n_cell + 1 entries
static void frame_grid(frame_file *f, int n_point, const double *x, int n_cell, const int64_t *offset,
                       const int64_t *connectivity, const uint8_t *type) {
    int64_t points = n_point, cells = n_cell, ids = offset[n_cell];
    frame_put(f, f->root, "NumberOfPoints", H5T_NATIVE_INT64, 1, 0, &points);
    frame_put(f, f->root, "NumberOfCells", H5T_NATIVE_INT64, 1, 0, &cells);
    frame_put(f, f->root, "NumberOfConnectivityIds", H5T_NATIVE_INT64, 1, 0, &ids);
    frame_put(f, f->root, "Points", H5T_NATIVE_DOUBLE, (size_t)points, 3, x);
    frame_put(f, f->root, "Offsets", H5T_NATIVE_INT64, (size_t)cells + 1, 0, offset);
    frame_put(f, f->root, "Connectivity", H5T_NATIVE_INT64, (size_t)ids, 0, connectivity);
    frame_put(f, f->root, "Types", H5T_NATIVE_UINT8, (size_t)cells, 0, type);
}

// closes and renames into place; a file that failed is removed
static silt_status frame_close(frame_file *f, silt_error *err) {
    silt_status status = SILT_OK;
    int reason = silt_image_write(f->file, f->part, false);
    if (!reason && !f->bad && rename(f->part, f->path) != 0)
        reason = errno;
    if (reason || f->bad) {
        status = silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", f->part,
                           reason ? strerror(reason) : "HDF5 refused");
        unlink(f->part);
    }
    free(f->path);
    free(f->part);
    return status;
}

// ---------------------------------------------------------------- points of the water

/** The nodes as points of a file. Cells that join nodes across a periodic border get copies of the far ones beside the
 * near ones: nothing is stretched over the domain. */
typedef struct frame_cloud {
    const silt_view *view;
    int n, node_capacity, x_capacity;
    int *node;  // owned, the node that each point shows
    double *x;  // owned, 3 per point, m
    int *place; // owned, 3 per node: its point one period back, at home, one period on; -1: none
} frame_cloud;

static int frame_cloud_add(frame_cloud *c, int node, int turn) {
    const int dim = silt_nodes_dim(c->view->nodes), place = 3 * node + 1 + turn;
    if (c->place[place] >= 0)
        return c->place[place];
    SILT_RESERVE(c->node, c->node_capacity, c->n + 1);
    SILT_RESERVE(c->x, c->x_capacity, 3 * (c->n + 1));
    for (int d = 0; d < 3; d++)
        c->x[3 * c->n + d] = d < dim ? c->view->nodes->x[dim * node + d] : 0;
    c->x[3 * c->n] += turn * c->view->mesh->period[0];
    c->node[c->n] = node;
    return c->place[place] = c->n++;
}

static void frame_cloud_make(frame_cloud *c, const silt_view *view) {
    *c = (frame_cloud){.view = view};
    c->place = silt_alloc(3 * (size_t)view->nodes->count + 1, sizeof *c->place);
    for (int i = 0; i < 3 * view->nodes->count; i++)
        c->place[i] = -1;
}

static void frame_cloud_clear(frame_cloud *c) {
    free(c->node);
    free(c->x);
    free(c->place);
}

// points of a cell or facet of n nodes; across the border it lies where its middle is between the domain's ends
static void frame_cloud_cell(frame_cloud *c, int n, const int *node, int64_t *link) {
    const silt_mesh *mesh = c->view->mesh;
    const int dim = silt_nodes_dim(c->view->nodes);
    const double period = mesh->period[0], *x = c->view->nodes->x;
    double corner[12], middle = 0;
    const int cell[4] = {node[0], node[1], n > 2 ? node[2] : node[0], n > 3 ? node[3] : node[0]};
    if (period > 0)
        silt_cell_corners(mesh, x, cell, corner);
    for (int k = 0; k < n && period > 0; k++)
        middle += corner[dim * k] / n;
    const double home = period > 0 ? period * floor((middle - c->view->scene->period[0]) / period) : 0;
    for (int k = 0; k < n; k++) {
        const int turn = period > 0 ? (int)lround((corner[dim * k] - home - x[dim * node[k]]) / period) : 0;
        link[k] = frame_cloud_add(c, node[k], turn < -1 ? -1 : turn > 1 ? 1 : turn);
    }
}

// the nodes' values at the points: `width` of a node's numbers, in a row of three when there are several
static void frame_field(frame_file *f, const frame_cloud *c, const char *name, int width, const double *value) {
    const int row = width > 1 ? 3 : 1;
    double *wide = silt_alloc((size_t)row * (size_t)c->n + 1, sizeof *wide);
    for (int i = 0; i < c->n; i++)
        for (int d = 0; d < width; d++)
            wide[row * i + d] = value[width * c->node[i] + d];
    frame_put(f, f->point, name, H5T_NATIVE_DOUBLE, (size_t)c->n, row > 1 ? row : 0, wide);
    free(wide);
}

// ---------------------------------------------------------------- the parts

static silt_status frame_fluid(const char *out, int number, const silt_view *view, silt_error *err) {
    const silt_nodes *nodes = view->nodes;
    const silt_mesh *mesh = view->mesh;
    const int dim = silt_nodes_dim(nodes);
    size_t n = (size_t)nodes->count, cells = (size_t)mesh->n_cell;
    int64_t *link = silt_alloc((size_t)(dim + 1) * cells + n + 1, sizeof *link);
    int64_t *offset = silt_alloc(cells + n + 1, sizeof *offset);
    uint8_t *type = silt_alloc(cells + n + 1, 1);

    // all nodes first; the cells, then every node without a cell as a vertex
    frame_cloud c;
    frame_cloud_make(&c, view);
    for (int i = 0; i < nodes->count; i++)
        frame_cloud_add(&c, i, 0);
    int n_cell = 0;
    int64_t used = 0;
    for (; n_cell < mesh->n_cell; n_cell++) {
        frame_cloud_cell(&c, dim + 1, mesh->cell[n_cell], link + used);
        used += dim + 1;
        offset[n_cell + 1] = used;
        type[n_cell] = dim == 3 ? VTK_TETRA : VTK_TRIANGLE;
    }
    for (int i = 0; i < nodes->count; i++) {
        if (i < mesh->n_node && mesh->wet[i])
            continue;
        link[used++] = i;
        type[n_cell] = VTK_VERTEX;
        offset[++n_cell] = used;
    }

    frame_file f;
    frame_open(&f, out, frame_part[FRAME_FLUID], number, view);
    frame_grid(&f, c.n, c.x, n_cell, offset, link, type);
    frame_field(&f, &c, "velocity", dim, nodes->v);
    frame_field(&f, &c, "pressure", 1, nodes->p);
    if (nodes->eddy)
        frame_field(&f, &c, "eddy_viscosity", 1, nodes->eddy);
    double *porosity = silt_alloc(n + 1, sizeof *porosity);
    int64_t *id = silt_alloc((size_t)c.n + 1, sizeof *id);
    uint8_t *kind = silt_alloc((size_t)c.n + 1, 1);
    if (view->scene->grains.on || view->solid) {
        for (size_t i = 0; i < n; i++)
            porosity[i] = view->solid ? 1 - view->solid[i] : 1;
        frame_field(&f, &c, "porosity", 1, porosity);
    }
    for (int i = 0; i < c.n; i++) {
        id[i] = nodes->id[c.node[i]];
        kind[i] = nodes->kind[c.node[i]];
    }
    frame_put(&f, f.point, "id", H5T_NATIVE_INT64, (size_t)c.n, 0, id);
    frame_put(&f, f.point, "kind", H5T_NATIVE_UINT8, (size_t)c.n, 0, kind);
    free(link);
    free(offset);
    free(type);
    free(porosity);
    free(id);
    free(kind);
    frame_cloud_clear(&c);
    return frame_close(&f, err);
}

// 3-D: the water's boundary as triangles
static silt_status frame_surface(const char *out, int number, const silt_view *view, silt_error *err) {
    const silt_mesh *mesh = view->mesh;
    size_t facets = (size_t)mesh->n_facet;
    int64_t *link = silt_alloc(3 * facets + 1, sizeof *link), *offset = silt_alloc(facets + 1, sizeof *offset);
    uint8_t *type = silt_alloc(facets + 1, 1);
    frame_cloud c;
    frame_cloud_make(&c, view);
    for (int i = 0; i < mesh->n_facet; i++) {
        frame_cloud_cell(&c, 3, mesh->facet[i], link + 3 * i);
        offset[i + 1] = 3 * (i + 1);
        type[i] = VTK_TRIANGLE;
    }
    frame_file f;
    frame_open(&f, out, frame_part[FRAME_SURFACE], number, view);
    frame_grid(&f, c.n, c.x, mesh->n_facet, offset, link, type);
    frame_field(&f, &c, "velocity", 3, view->nodes->v);
    frame_field(&f, &c, "pressure", 1, view->nodes->p);
    frame_put(&f, f.cell, "kind", H5T_NATIVE_UINT8, facets, 0, mesh->facet_kind);
    free(link);
    free(offset);
    free(type);
    frame_cloud_clear(&c);
    return frame_close(&f, err);
}

static silt_status frame_bed(const char *out, int number, const silt_view *view, silt_error *err) {
    const silt_bed *bed = view->bed;
    size_t n = (size_t)bed->n_node, cells = (size_t)bed->n_cell;
    int *place = silt_alloc(n + 1, sizeof *place);
    const int n_corner = bed->dim == 3 ? 4 : 3;
    int64_t *link = silt_alloc(4 * cells + 1, sizeof *link), *offset = silt_alloc(cells + 1, sizeof *offset);
    uint8_t *type = silt_alloc(cells + 1, 1);
    double *x = silt_alloc(3 * n + 1, sizeof *x), *work = silt_alloc(n + 1, sizeof *work);
    double *shear = silt_alloc(n + 1, sizeof *shear), *density = silt_alloc(cells + 1, sizeof *density);
    const bool seeps = bed->pressure != NULL;
    double *pressure = silt_alloc(seeps ? n + 1 : 1, sizeof *pressure), *seepage = silt_alloc(seeps ? n + 1 : 1, sizeof *seepage);
    double *darcy = silt_alloc(seeps ? 3 * cells + 1 : 1, sizeof *darcy);

    // living nodes only
    int n_point = 0;
    for (int i = 0; i < bed->n_node; i++) {
        if (!bed->alive[i])
            continue;
        place[i] = n_point;
        memcpy(x + 3 * n_point, bed->x[i], sizeof bed->x[i]);
        work[n_point] = bed->work[i];
        if (seeps) {
            pressure[n_point] = bed->pressure[i];
            seepage[n_point] = bed->seepage[i];
        }
        shear[n_point++] = bed->shear[i];
    }
    for (int i = 0; i < bed->n_cell; i++) {
        for (int k = 0; k < n_corner; k++)
            link[n_corner * i + k] = place[bed->cell[i][k]];
        offset[i + 1] = n_corner * (i + 1);
        type[i] = n_corner == 4 ? VTK_TETRA : VTK_TRIANGLE;
        density[i] = bed->mass[i] / bed->area[i];
        for (int d = 0; d < n_corner - 1 && seeps; d++)
            darcy[3 * i + d] = bed->darcy[(n_corner - 1) * i + d];
    }

    frame_file f;
    frame_open(&f, out, frame_part[FRAME_BED], number, view);
    frame_grid(&f, n_point, x, bed->n_cell, offset, link, type);
    frame_put(&f, f.point, "work", H5T_NATIVE_DOUBLE, (size_t)n_point, 0, work);
    frame_put(&f, f.point, "shear", H5T_NATIVE_DOUBLE, (size_t)n_point, 0, shear);
    frame_put(&f, f.cell, "density", H5T_NATIVE_DOUBLE, cells, 0, density);
    if (seeps) {
        frame_put(&f, f.point, "pressure", H5T_NATIVE_DOUBLE, (size_t)n_point, 0, pressure);
        frame_put(&f, f.point, "seepage", H5T_NATIVE_DOUBLE, (size_t)n_point, 0, seepage);
        frame_put(&f, f.cell, "darcy", H5T_NATIVE_DOUBLE, cells, 3, darcy);
    }
    free(pressure);
    free(seepage);
    free(darcy);
    free(place);
    free(link);
    free(offset);
    free(type);
    free(x);
    free(work);
    free(shear);
    free(density);
    return frame_close(&f, err);
}

static silt_status frame_grains(const char *out, int number, const silt_view *view, silt_error *err) {
    static const silt_grain_state none;
    const silt_grain_state *grains = view->grains ? view->grains : &none;
    size_t n = (size_t)grains->count;
    int64_t *link = silt_alloc(n + 1, sizeof *link);
    uint8_t *type = silt_alloc(n + 1, 1);
    for (size_t i = 0; i <= n; i++) {
        link[i] = (int64_t)i;
        type[i] = VTK_VERTEX;
    }

    frame_file f;
    frame_open(&f, out, frame_part[FRAME_GRAINS], number, view);
    frame_grid(&f, grains->count, grains->x, grains->count, link, link, type);
    frame_put(&f, f.point, "radius", H5T_NATIVE_DOUBLE, n, 0, grains->radius);
    frame_put(&f, f.point, "velocity", H5T_NATIVE_DOUBLE, n, 3, grains->v);
    frame_put(&f, f.point, "omega", H5T_NATIVE_DOUBLE, n, 3, grains->omega);
    frame_put(&f, f.point, "id", H5T_NATIVE_INT64, n, 0, grains->id);
    free(link);
    free(type);
    return frame_close(&f, err);
}

static silt_status frame_bodies(const char *out, int number, const silt_view *view, silt_error *err) {
    const silt_body_state *bodies = view->bodies;
    size_t n = (size_t)bodies->count, points = 0;
    for (size_t i = 0; i < n; i++)
        points += (size_t)bodies->body[i].n_point;
    // a cell per outline, in space one per face
    size_t n_cell = 0, n_link = 0;
    for (size_t i = 0; i < n; i++) {
        n_cell += bodies->body[i].n_face ? (size_t)bodies->body[i].n_face : 1;
        n_link += bodies->body[i].n_face ? 3 * (size_t)bodies->body[i].n_face : (size_t)bodies->body[i].n_point;
    }
    double *x = silt_alloc(3 * points + 1, sizeof *x), *v = silt_alloc(3 * n_cell + 1, sizeof *v);
    int64_t *link = silt_alloc(n_link + 1, sizeof *link), *offset = silt_alloc(n_cell + 1, sizeof *offset);
    int64_t *id = silt_alloc(n_cell + 1, sizeof *id);
    uint8_t *type = silt_alloc(n_cell + 1, 1);

    // outlines turned by the quaternion about z: cos = 1 - 2 qz^2, sin = 2 qw qz
    int64_t used = 0, linked = 0;
    size_t cell = 0;
    for (size_t i = 0; i < n; i++) {
        const struct silt_body *b = &bodies->body[i];
        double c = 1 - 2 * b->q[3] * b->q[3], s = 2 * b->q[0] * b->q[3];
        for (int k = 0; k < b->n_face; k++, cell++) {
            for (int a = 0; a < 3; a++)
                link[linked++] = used + b->face[k][a];
            memcpy(v + 3 * cell, b->v, sizeof b->v);
            offset[cell + 1] = linked;
            type[cell] = VTK_TRIANGLE;
            id[cell] = (int64_t)i;
        }
        for (int k = 0; k < b->n_point && b->n_face; k++, used++) {
            silt_turn(b->q, false, b->point + 3 * k, x + 3 * used);
            for (int d = 0; d < 3; d++)
                x[3 * used + d] += b->x[d];
        }
        if (b->n_face)
            continue;
        for (int k = 0; k < b->n_point; k++, used++) {
            x[3 * used] = b->x[0] + c * b->point[2 * k] - s * b->point[2 * k + 1];
            x[3 * used + 1] = b->x[1] + s * b->point[2 * k] + c * b->point[2 * k + 1];
            link[linked++] = used;
        }
        memcpy(v + 3 * cell, b->v, sizeof b->v);
        offset[cell + 1] = linked;
        type[cell] = VTK_POLYGON;
        id[cell++] = (int64_t)i;
    }

    frame_file f;
    frame_open(&f, out, frame_part[FRAME_BODIES], number, view);
    frame_grid(&f, (int)points, x, (int)n_cell, offset, link, type);
    frame_put(&f, f.cell, "velocity", H5T_NATIVE_DOUBLE, n_cell, 3, v);
    frame_put(&f, f.cell, "id", H5T_NATIVE_INT64, n_cell, 0, id);
    free(x);
    free(v);
    free(link);
    free(offset);
    free(id);
    free(type);
    return frame_close(&f, err);
}

// ---------------------------------------------------------------- indices

typedef struct frame_list {
    int n, capacity;
    silt_frame_entry *entry; // owned
} frame_list;

// the entries of an index; none when it is absent
static void frame_list_read(frame_list *list, const char *out, const char *part) {
    char *path = silt_text("%s/%s.hdf.series", out, part), *line = NULL;
    size_t capacity = 0;
    FILE *from = fopen(path, "r");
    list->n = 0;
    while (from && getline(&line, &capacity, from) > 0) {
        char *name = strstr(line, "\"name\": \""), *time = strstr(line, "\"time\": ");
        if (!name || !time)
            continue;
        SILT_RESERVE(list->entry, list->capacity, list->n + 1);
        list->entry[list->n++] = (silt_frame_entry){atoi(name + 9 + strlen(part) + 1), atof(time + 8)};
    }
    if (from)
        fclose(from);
    free(line);
    free(path);
}

// how many entries, from the first, belong to frames up to `last`
static int frame_list_until(const frame_list *list, int last) {
    int n = 0;
    while (n < list->n && list->entry[n].number <= last)
        n++;
    return n;
}

static silt_status frame_list_write(const frame_list *list, const char *out, const char *part, silt_error *err) {
    char *path = silt_text("%s/%s.hdf.series", out, part), *aside = silt_text("%s.part", path);
    silt_status status = SILT_OK;
    FILE *to = fopen(aside, "w");
    if (to) {
        fprintf(to, "{\n  \"file-series-version\": \"1.0\",\n  \"files\": [\n");
        for (int i = 0; i < list->n; i++)
            fprintf(to, "    {\"name\": \"%s_%06d.hdf\", \"time\": %.17g}%s\n", part, list->entry[i].number,
                    list->entry[i].time, i + 1 < list->n ? "," : "");
        fprintf(to, "  ]\n}\n");
    }
    if (!to || fflush(to) != 0 || ferror(to) || rename(aside, path) != 0) {
        status = silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", path, strerror(errno));
        unlink(aside);
    }
    if (to)
        fclose(to);
    free(aside);
    free(path);
    return status;
}

// run.h5: /frames/000123/fluid etc. are links into the frame files; the attribute `time` on each frame
static silt_status frame_links(const frame_list *list, const bool has[FRAME_PARTS], const char *out, silt_error *err) {
    char *path = silt_text("%s/run.h5", out), *aside = silt_text("%s.part", path);
    silt_status status = SILT_OK;
    hid_t file = silt_image_create(aside);
    hid_t frames = H5Gcreate2(file, "frames", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    bool bad = frames < 0;
    for (int i = 0; i < list->n && !bad; i++) {
        char name[16], target[32];
        snprintf(name, sizeof name, "%06d", list->entry[i].number);
        hid_t group = H5Gcreate2(frames, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        frame_attribute(group, "time", H5T_NATIVE_DOUBLE, 1, &list->entry[i].time);
        for (int k = 0; k < FRAME_PARTS; k++) {
            snprintf(target, sizeof target, "%s_%06d.hdf", frame_part[k], list->entry[i].number);
            bad |= has[k] && H5Lcreate_external(target, "/VTKHDF", group, frame_part[k], H5P_DEFAULT, H5P_DEFAULT) < 0;
        }
        H5Gclose(group);
    }
    if (frames >= 0)
        H5Gclose(frames);
    int reason = silt_image_write(file, aside, false);
    if (!reason && !bad && rename(aside, path) != 0)
        reason = errno;
    if (reason || bad) {
        status =
            silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", path, reason ? strerror(reason) : "HDF5 refused");
        unlink(aside);
    }
    free(aside);
    free(path);
    return status;
}

// ---------------------------------------------------------------- log

// equal states have equal hashes: compare runs line by line
static uint64_t frame_hash(const silt_view *view) {
    uint64_t hash = silt_hash(0, &view->step, sizeof view->step);
    if (view->nodes && view->nodes->count) {
        size_t one = (size_t)view->nodes->count * sizeof(double), size = (size_t)silt_nodes_dim(view->nodes) * one;
        hash = silt_hash(hash, view->nodes->x, size);
        hash = silt_hash(hash, view->nodes->v, size);
        hash = silt_hash(hash, view->nodes->p, one);
        if (view->nodes->eddy)
            hash = silt_hash(hash, view->nodes->eddy, one);
    }
    if (view->grains && view->grains->count) {
        size_t size = 3 * (size_t)view->grains->count * sizeof(double);
        hash = silt_hash(hash, view->grains->x, size);
        hash = silt_hash(hash, view->grains->v, size);
    }
    return hash;
}

static silt_status frame_log(const char *out, int number, const silt_view *view, silt_error *err) {
    char *path = silt_text("%s/run.log", out);
    silt_status status = SILT_OK;
    FILE *to = fopen(path, "a");
    if (to) {
        fprintf(to, "frame %06d  time %.9g  step %lld  dt %.4g", number, view->time, (long long)view->step, view->dt);
        if (view->nodes && view->mesh)
            fprintf(to, "  nodes %d  cells %d  volume error %.3e", view->nodes->count, view->mesh->n_cell,
                    view->ledger->volume_error);
        if (view->scene->grains.on)
            fprintf(to, "  grains %d  sediment error %.3e", view->ledger->grain_count, view->ledger->sediment_error);
        fprintf(to, "  iterations %d  state %016llx\n", view->iterations, (unsigned long long)frame_hash(view));
    }
    if (!to || fflush(to) != 0)
        status = silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", path, strerror(errno));
    if (to)
        fclose(to);
    free(path);
    return status;
}

// ---------------------------------------------------------------- frames

typedef silt_status frame_writer(const char *out, int number, const silt_view *view, silt_error *err);

silt_status silt_frame_write(const char *out, int number, const silt_view *view, silt_error *err) {
    static frame_writer *const write[FRAME_PARTS] = {frame_fluid, frame_surface, frame_bed, frame_grains, frame_bodies};
    const bool water = view->nodes && view->mesh;
    const bool has[FRAME_PARTS] = {water, water && silt_nodes_dim(view->nodes) == 3, view->bed && view->scene->bed.on,
                                   view->scene->grains.on, view->bodies && view->bodies->count > 0};
    frame_list list = {0};
    silt_status status = SILT_OK;
    // a file first, then its index: what an index names is always whole
    for (int k = 0; k < FRAME_PARTS && !status; k++) {
        if (!has[k])
            continue;
        status = write[k](out, number, view, err);
        if (status)
            break;
        frame_list_read(&list, out, frame_part[k]);
        list.n = frame_list_until(&list, number - 1);
        SILT_RESERVE(list.entry, list.capacity, list.n + 1);
        list.entry[list.n++] = (silt_frame_entry){number, view->time};
        status = frame_list_write(&list, out, frame_part[k], err);
    }
    if (!status)
        status = frame_links(&list, has, out, err);
    if (!status)
        status = frame_log(out, number, view, err);
    free(list.entry);
    return status;
}

silt_status silt_frame_cut(const char *out, int number, silt_error *err) {
    bool has[FRAME_PARTS] = {false};
    frame_list list = {0};
    silt_status status = SILT_OK;
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    for (int k = 0; k < FRAME_PARTS && !status; k++) {
        char *path = silt_text("%s/%s.hdf.series", out, frame_part[k]);
        has[k] = access(path, R_OK) == 0;
        if (has[k]) {
            // the index first, then the files that it no longer names
            frame_list_read(&list, out, frame_part[k]);
            int all = list.n;
            list.n = frame_list_until(&list, number);
            if (list.n > 0)
                status = frame_list_write(&list, out, frame_part[k], err);
            else
                unlink(path);
            for (int i = list.n; i < all && !status; i++) {
                char *old = silt_text("%s/%s_%06d.hdf", out, frame_part[k], list.entry[i].number);
                unlink(old);
                free(old);
            }
        }
        free(path);
    }
    if (!status)
        status = frame_links(&list, has, out, err);
    free(list.entry);
    return status;
}

int silt_frame_index(const char *out, silt_frame_entry **entry) {
    frame_list list = {0};
    for (int k = 0; k < FRAME_PARTS && list.n == 0; k++)
        frame_list_read(&list, out, frame_part[k]);
    *entry = list.entry;
    return list.n;
}

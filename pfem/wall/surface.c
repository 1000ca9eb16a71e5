// triangulated surfaces from files: STL, text and binary, and gmsh's .msh as text (2.2 and 4.1)
#include "wall.h"

#include <errno.h>

#define SURFACE_BYTES ((size_t)1 << 30)
#define SURFACE_ITEMS 20000000
#define SURFACE_GAP 1e-7 // of the extent: corners closer than that are one

// ---------------------------------------------------------------- text

typedef struct surface_text {
    const char *path;
    char *start, *at, *end; // start owned, a zero behind the end
} surface_text;

static silt_status text_load(surface_text *text, const char *path, silt_error *err) {
    *text = (surface_text){.path = path};
    FILE *file = fopen(path, "rb");
    if (!file)
        return silt_fail(err, SILT_INPUT, "%s: cannot be opened: %s", path, strerror(errno));
    silt_status status = SILT_OK;
    int capacity = 0, size = 0;
    for (;;) {
        text->start = silt_grow(text->start, &capacity, size + (1 << 16) + 1, 1);
        const size_t got = fread(text->start + size, 1, 1 << 16, file);
        size += (int)got;
        if (got == 0)
            break;
        if ((size_t)size > SURFACE_BYTES) {
            status = silt_fail(err, SILT_INPUT, "%s: found more than %zu MB, allowed at most that", path, SURFACE_BYTES >> 20);
            break;
        }
    }
    if (status == SILT_OK && ferror(file))
        status = silt_fail(err, SILT_INPUT, "%s: cannot be read: %s", path, strerror(errno));
    fclose(file);
    text->start[size] = 0;
    text->at = text->start;
    text->end = text->start + size;
    return status;
}

static int text_line(const surface_text *text) {
    int line = 1;
    for (const char *c = text->start; c < text->at; c++)
        line += *c == '\n';
    return line;
}

static void text_blank(surface_text *text) {
    while (text->at < text->end && strchr(" \t\r\n\v\f", *text->at) && *text->at)
        text->at++;
}

// takes a word when it comes next, whatever its letters' size
static bool text_word(surface_text *text, const char *word) {
    text_blank(text);
    const size_t length = strlen(word);
    if ((size_t)(text->end - text->at) < length)
        return false;
    for (size_t k = 0; k < length; k++) {
        const char c = text->at[k];
        if ((c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c) != word[k])
            return false;
    }
    const char after = text->at[length];
    if (after && !strchr(" \t\r\n\v\f", after))
        return false;
    text->at += length;
    return true;
}

static void text_rest(surface_text *text) {
    while (text->at < text->end && *text->at != '\n')
        text->at++;
}

static silt_status text_missing(const surface_text *text, const char *allowed, silt_error *err) {
    char found[24];
    int n = 0;
    for (const char *c = text->at; c < text->end && n < (int)sizeof found - 1 && !strchr(" \t\r\n", *c); c++)
        found[n++] = *c >= 32 && *c < 127 ? *c : '?';
    found[n] = 0;
    return silt_fail(err, SILT_INPUT, "%s:%d: found %s%s%s, allowed %s", text->path, text_line(text), n ? "'" : "the end", found,
                     n ? "'" : "", allowed);
}

static silt_status text_number(surface_text *text, double *value, silt_error *err) {
    text_blank(text);
    char *end;
    *value = strtod(text->at, &end);
    if (end == text->at || end > text->end || !isfinite(*value))
        return text_missing(text, "a number", err);
    text->at = end;
    return SILT_OK;
}

static silt_status text_integer(surface_text *text, int64_t low, int64_t high, int64_t *value, silt_error *err) {
    text_blank(text);
    char *end;
    errno = 0;
    *value = strtoll(text->at, &end, 10);
    if (end == text->at || end > text->end || errno || *value < low || *value > high || (*end && !strchr(" \t\r\n\v\f", *end)))
        return text_missing(text, "a whole number", err);
    text->at = end;
    return SILT_OK;
}

// ---------------------------------------------------------------- building

typedef struct surface_build {
    silt_surface *surface;
    int point_capacity, triangle_capacity, source_capacity;
} surface_build;

static int build_point(surface_build *b, const double x[3]) {
    SILT_RESERVE(b->surface->point, b->point_capacity, b->surface->n_point + 1);
    memcpy(b->surface->point[b->surface->n_point], x, 3 * sizeof *x);
    return b->surface->n_point++;
}

static void build_triangle(surface_build *b, int p, int q, int r, int source) {
    silt_surface *s = b->surface;
    SILT_RESERVE(s->triangle, b->triangle_capacity, s->n_triangle + 1);
    SILT_RESERVE(s->source, b->source_capacity, s->n_triangle + 1);
    s->triangle[s->n_triangle][0] = p;
    s->triangle[s->n_triangle][1] = q;
    s->triangle[s->n_triangle][2] = r;
    s->source[s->n_triangle++] = source;
}

// ---------------------------------------------------------------- STL

static silt_status stl_text(surface_text *text, surface_build *b, silt_error *err) {
    text_word(text, "solid");
    text_rest(text);
    for (;;) {
        if (text_word(text, "endsolid")) {
            text_rest(text);
            text_blank(text);
            if (text->at == text->end)
                return SILT_OK;
            if (!text_word(text, "solid"))
                return text_missing(text, "solid or the end", err);
            text_rest(text);
            continue;
        }
        if (!text_word(text, "facet"))
            return text_missing(text, "facet or endsolid", err);
        double x[3];
        if (!text_word(text, "normal"))
            return text_missing(text, "normal", err);
        // written by some programs as nan: not used
        text_rest(text);
        if (!text_word(text, "outer") || !text_word(text, "loop"))
            return text_missing(text, "outer loop", err);
        int corner[3];
        for (int k = 0; k < 3; k++) {
            if (!text_word(text, "vertex"))
                return text_missing(text, "vertex", err);
            for (int d = 0; d < 3; d++)
                SILT_TRY(text_number(text, &x[d], err));
            corner[k] = build_point(b, x);
        }
        if (!text_word(text, "endloop") || !text_word(text, "endfacet"))
            return text_missing(text, "endloop and endfacet: three corners", err);
        if (b->surface->n_triangle >= SURFACE_ITEMS)
            return silt_fail(err, SILT_INPUT, "%s: found more than %d triangles, allowed at most that", text->path, SURFACE_ITEMS);
        build_triangle(b, corner[0], corner[1], corner[2], b->surface->n_triangle + 1);
    }
}

static uint32_t little_endian(const unsigned char *c) {
    return (uint32_t)c[0] | (uint32_t)c[1] << 8 | (uint32_t)c[2] << 16 | (uint32_t)c[3] << 24;
}

static silt_status stl_binary(const surface_text *text, surface_build *b, silt_error *err) {
    const unsigned char *c = (const unsigned char *)text->start;
    const uint32_t n = little_endian(c + 80);
    if (n > SURFACE_ITEMS)
        return silt_fail(err, SILT_INPUT, "%s: found %u triangles, allowed at most %d", text->path, n, SURFACE_ITEMS);
    for (uint32_t t = 0; t < n; t++) {
        int corner[3];
        for (int k = 0; k < 3; k++) {
            double x[3];
            for (int d = 0; d < 3; d++) {
                const uint32_t bits = little_endian(c + 84 + 50 * (size_t)t + 12 + 12 * k + 4 * d);
                float value;
                memcpy(&value, &bits, sizeof value);
                if (!isfinite(value))
                    return silt_fail(err, SILT_INPUT, "%s: triangle %u: found a corner that is not finite", text->path, t + 1);
                x[d] = (double)value;
            }
            corner[k] = build_point(b, x);
        }
        build_triangle(b, corner[0], corner[1], corner[2], (int)t + 1);
    }
    return SILT_OK;
}

// ---------------------------------------------------------------- gmsh

typedef struct msh_node {
    int64_t tag;
    int index;
} msh_node;

typedef struct msh_reader {
    surface_text *text;
    surface_build *build;
    int n_node, node_capacity;
    msh_node *node; // owned
    int count;      // elements seen
} msh_reader;

static int compare_nodes(const void *a, const void *b) {
    const int64_t p = ((const msh_node *)a)->tag, q = ((const msh_node *)b)->tag;
    return p < q ? -1 : p > q;
}

static silt_status msh_point(msh_reader *m, int64_t tag, silt_error *err) {
    double x[3];
    for (int d = 0; d < 3; d++)
        SILT_TRY(text_number(m->text, &x[d], err));
    SILT_RESERVE(m->node, m->node_capacity, m->n_node + 1);
    m->node[m->n_node++] = (msh_node){tag, build_point(m->build, x)};
    return SILT_OK;
}

static silt_status msh_nodes(msh_reader *m, bool blocks, silt_error *err) {
    surface_text *text = m->text;
    int64_t n_block = 1, count, skip;
    if (blocks) {
        SILT_TRY(text_integer(text, 0, SURFACE_ITEMS, &n_block, err));
        for (int k = 0; k < 3; k++)
            SILT_TRY(text_integer(text, 0, INT64_MAX, &skip, err));
    }
    for (int64_t block = 0; block < n_block; block++) {
        int64_t dimension = 0, parametric = 0;
        if (blocks) {
            SILT_TRY(text_integer(text, 0, 3, &dimension, err));
            SILT_TRY(text_integer(text, INT32_MIN, INT32_MAX, &skip, err));
            SILT_TRY(text_integer(text, 0, 1, &parametric, err));
        }
        SILT_TRY(text_integer(text, 0, SURFACE_ITEMS, &count, err));
        if (!blocks) {
            for (int64_t k = 0; k < count; k++) {
                int64_t tag;
                SILT_TRY(text_integer(text, 0, INT64_MAX, &tag, err));
                SILT_TRY(msh_point(m, tag, err));
            }
            continue;
        }
        // the tags first, then the coordinates, with parameters on curves and faces where they were asked for
        const int first = m->n_node;
        SILT_RESERVE(m->node, m->node_capacity, first + 1);
        int64_t *tag = NULL;
        int capacity = 0;
        silt_status status = SILT_OK;
        for (int64_t k = 0; k < count && status == SILT_OK; k++) {
            SILT_RESERVE(tag, capacity, (int)k + 1);
            status = text_integer(text, 0, INT64_MAX, &tag[k], err);
        }
        for (int64_t k = 0; k < count && status == SILT_OK; k++) {
            double unused;
            status = msh_point(m, tag[k], err);
            for (int64_t d = 0; parametric && d < dimension && status == SILT_OK; d++)
                status = text_number(text, &unused, err);
        }
        free(tag);
        SILT_TRY(status);
    }
    if (m->n_node)
        qsort(m->node, (size_t)m->n_node, sizeof *m->node, compare_nodes);
    return SILT_OK;
}

// how many nodes an element type of gmsh has, 0: not known
static int msh_type_nodes(int64_t type) {
    static const int nodes[32] = {0, 2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13, 9, 10, 12, 15, 15, 21, 4, 5, 6, 20, 35, 56};
    return type > 0 && type < 32 ? nodes[type] : 0;
}

static silt_status msh_element(msh_reader *m, int64_t type, silt_error *err) {
    const int n = msh_type_nodes(type);
    int corner[4] = {-1, -1, -1, -1};
    if (!n)
        return silt_fail(err, SILT_INPUT, "%s:%d: found elements of type %lld, allowed types of gmsh up to 31", m->text->path,
                         text_line(m->text), (long long)type);
    // triangles and quadrilaterals, the corners of curved ones
    const int used = type == 2 || type == 9 ? 3 : type == 3 || type == 10 || type == 16 ? 4 : 0;
    m->count++;
    for (int k = 0; k < n; k++) {
        int64_t tag;
        SILT_TRY(text_integer(m->text, 0, INT64_MAX, &tag, err));
        if (k >= used)
            continue;
        const msh_node key = {tag, 0}, *found = m->n_node ? bsearch(&key, m->node, (size_t)m->n_node, sizeof key, compare_nodes) : NULL;
        if (!found)
            return silt_fail(err, SILT_INPUT, "%s:%d: element %d: found node %lld, allowed nodes that are listed before",
                             m->text->path, text_line(m->text), m->count, (long long)tag);
        corner[k] = found->index;
    }
    if (used)
        build_triangle(m->build, corner[0], corner[1], corner[2], m->count);
    if (used == 4)
        build_triangle(m->build, corner[0], corner[2], corner[3], m->count);
    return SILT_OK;
}

static silt_status msh_elements(msh_reader *m, bool blocks, silt_error *err) {
    surface_text *text = m->text;
    int64_t n_block = 1, count, skip, type = 0;
    if (blocks) {
        SILT_TRY(text_integer(text, 0, SURFACE_ITEMS, &n_block, err));
        for (int k = 0; k < 3; k++)
            SILT_TRY(text_integer(text, 0, INT64_MAX, &skip, err));
    }
    for (int64_t block = 0; block < n_block; block++) {
        if (blocks) {
            SILT_TRY(text_integer(text, 0, 3, &skip, err));
            SILT_TRY(text_integer(text, INT32_MIN, INT32_MAX, &skip, err));
            SILT_TRY(text_integer(text, 1, 1000, &type, err));
        }
        SILT_TRY(text_integer(text, 0, SURFACE_ITEMS, &count, err));
        for (int64_t k = 0; k < count; k++) {
            SILT_TRY(text_integer(text, 0, INT64_MAX, &skip, err));
            if (!blocks) {
                int64_t n_tag;
                SILT_TRY(text_integer(text, 1, 1000, &type, err));
                SILT_TRY(text_integer(text, 0, 1000, &n_tag, err));
                for (int64_t t = 0; t < n_tag; t++)
                    SILT_TRY(text_integer(text, INT64_MIN, INT64_MAX, &skip, err));
            }
            SILT_TRY(msh_element(m, type, err));
        }
    }
    return SILT_OK;
}

static silt_status msh_read(msh_reader *m, silt_error *err) {
    surface_text *text = m->text;
    double version = 0;
    int64_t binary, size;
    if (!text_word(text, "$meshformat"))
        return text_missing(text, "$MeshFormat", err);
    SILT_TRY(text_number(text, &version, err));
    SILT_TRY(text_integer(text, 0, 1, &binary, err));
    SILT_TRY(text_integer(text, 0, 64, &size, err));
    const bool foreign = binary || (version != 2.2 && version != 2.1 && version != 2 && version != 4.1);
    if (foreign && wall_gmsh_there())
        return wall_gmsh_read(text->path, m->build->surface, err);
    if (foreign)
        return silt_fail(err, SILT_INPUT, "%s: found version %g%s, allowed 2.2 or 4.1 as text (gmsh -0 -bin 0 -format msh41 -o NEW.msh %s)",
                         text->path, version, binary ? ", binary" : "", text->path);
    for (;;) {
        text_blank(text);
        if (text->at == text->end)
            return SILT_OK;
        if (text_word(text, "$nodes"))
            SILT_TRY(msh_nodes(m, version > 4, err));
        else if (text_word(text, "$elements"))
            SILT_TRY(msh_elements(m, version > 4, err));
        else // other blocks, and ends of blocks
            text_rest(text);
    }
}

// ---------------------------------------------------------------- mending and checking

int wall_weld(int n, const double (*point)[3], double gap, int *number) {
    // points in a hash of cells four gaps wide; the neighbours on the near sides are looked through too
    const double cell = gap > 0 ? 4 * gap : 0;
    size_t size = 64;
    while (size < 2 * (size_t)n)
        size *= 2;
    int *head = silt_alloc(size, sizeof *head), *next = silt_alloc((size_t)n + 1, sizeof *next);
    int count = 0;
    for (int i = 0; i < n; i++) {
        int found = -1;
        int64_t key[3], near[3][2];
        for (int d = 0; d < 3; d++) {
            const double at = point[i][d] + 0.0; // no negative zero
            if (cell > 0) {
                // far from the origin for its size: cells are no help, but nothing overflows
                key[d] = (int64_t)silt_clamp(floor(at / cell), -1e18, 1e18);
                near[d][0] = (int64_t)silt_clamp(floor((at - gap) / cell), -1e18, 1e18);
                near[d][1] = (int64_t)silt_clamp(floor((at + gap) / cell), -1e18, 1e18);
            } else {
                memcpy(&key[d], &at, sizeof key[d]);
                near[d][0] = near[d][1] = key[d];
            }
        }
        for (int c = 0; c < 8 && found < 0; c++) {
            int64_t k[3];
            bool again = false;
            for (int d = 0; d < 3; d++) {
                k[d] = near[d][c >> d & 1];
                again |= (c >> d & 1) && near[d][0] == near[d][1];
            }
            if (again)
                continue;
            for (int j = head[silt_hash(0, k, sizeof k) & (size - 1)] - 1; j >= 0 && found < 0; j = next[j] - 1) {
                bool same = true;
                for (int d = 0; d < 3; d++)
                    same &= fabs(point[j][d] - point[i][d]) <= gap;
                if (same)
                    found = number[j];
            }
        }
        if (found >= 0) {
            number[i] = found;
            continue;
        }
        number[i] = count++;
        int *slot = &head[silt_hash(0, key, sizeof key) & (size - 1)];
        next[i] = *slot;
        *slot = i + 1;
    }
    free(head);
    free(next);
    return count;
}

// corners that coincide become one, triangles without area go
static void surface_mend(silt_surface *s) {
    double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, extent = 0;
    for (int i = 0; i < s->n_point; i++)
        for (int d = 0; d < 3; d++) {
            lo[d] = silt_min(lo[d], s->point[i][d]);
            hi[d] = silt_max(hi[d], s->point[i][d]);
        }
    for (int d = 0; d < 3 && s->n_point; d++)
        extent = silt_max(extent, hi[d] - lo[d]);
    int *number = silt_alloc((size_t)s->n_point + 1, sizeof *number);
    const int count = wall_weld(s->n_point, (const double(*)[3])s->point, SURFACE_GAP * extent, number);
    // the first of each number stays: numbers rise with it
    for (int i = 0, seen = 0; i < s->n_point; i++)
        if (number[i] == seen)
            memcpy(s->point[seen++], s->point[i], sizeof *s->point);
    s->n_point = count;
    int kept = 0;
    for (int t = 0; t < s->n_triangle; t++) {
        int c[3];
        double u[3], v[3], n[3], longest = 0;
        for (int k = 0; k < 3; k++)
            c[k] = number[s->triangle[t][k]];
        for (int d = 0; d < 3; d++) {
            u[d] = s->point[c[1]][d] - s->point[c[0]][d];
            v[d] = s->point[c[2]][d] - s->point[c[0]][d];
        }
        silt_cross(u, v, n);
        longest = silt_max(wall_dot(u, u), wall_dot(v, v));
        if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0] || !(sqrt(wall_dot(n, n)) > 1e-9 * longest))
            continue;
        memcpy(s->triangle[kept], c, sizeof c);
        s->source[kept++] = s->source[t];
    }
    s->n_degenerate = s->n_triangle - kept;
    s->n_triangle = kept;
    free(number);
}

typedef struct surface_edge {
    int low, high;
    int triangle;
    bool backwards; // runs from the higher to the lower point
} surface_edge;

static int compare_edges(const void *a, const void *b) {
    const surface_edge *p = a, *q = b;
    if (p->low != q->low)
        return p->low < q->low ? -1 : 1;
    if (p->high != q->high)
        return p->high < q->high ? -1 : 1;
    return p->triangle - q->triangle;
}

// two triangles at an edge run through it in opposite directions
static silt_status surface_check(const char *path, const silt_surface *s, silt_error *err) {
    const int n = 3 * s->n_triangle;
    surface_edge *edge = silt_alloc((size_t)n + 1, sizeof *edge);
    for (int t = 0; t < s->n_triangle; t++)
        for (int k = 0; k < 3; k++) {
            const int a = s->triangle[t][k], b = s->triangle[t][(k + 1) % 3];
            edge[3 * t + k] = (surface_edge){a < b ? a : b, a < b ? b : a, t, a > b};
        }
    qsort(edge, (size_t)n, sizeof *edge, compare_edges);
    int worst = -1, other = -1, at = -1;
    for (int first = 0, last; first < n; first = last) {
        int backwards = 0;
        for (last = first; last < n && edge[last].low == edge[first].low && edge[last].high == edge[first].high; last++)
            backwards += edge[last].backwards;
        const int t = edge[last - 1].triangle;
        if (last - first < 2 || 2 * backwards == last - first || (last - first > 2 && (last - first) % 2))
            continue;
        if (worst < 0 || t < worst) {
            worst = t;
            other = edge[first].triangle;
            at = edge[first].low;
        }
    }
    free(edge);
    if (worst < 0)
        return SILT_OK;
    return silt_fail(err, SILT_INPUT, "%s: triangle %d: found it turned against its neighbour %d at (%g, %g, %g), allowed triangles that all have the water on the same side",
                     path, s->source[worst], s->source[other], s->point[at][0], s->point[at][1], s->point[at][2]);
}

static silt_status surface_parse(surface_text *text, silt_surface *surface, silt_error *err) {
    const char *dot = strrchr(text->path, '.');
    const size_t size = (size_t)(text->end - text->start);
    surface_build build = {.surface = surface};
    if (silt_surface_is_shape(text->path))
        return wall_gmsh_read(text->path, surface, err);
    if (dot && (strcmp(dot, ".msh") == 0 || strcmp(dot, ".MSH") == 0)) {
        msh_reader m = {.text = text, .build = &build};
        const silt_status status = msh_read(&m, err);
        free(m.node);
        return status;
    }
    // binary when the length is exactly what the count asks for: some binary files begin with "solid" too
    if (size >= 84 && size == 84 + 50 * (size_t)little_endian((const unsigned char *)text->start + 80))
        return stl_binary(text, &build, err);
    if (text_word(text, "solid")) {
        text->at = text->start;
        return stl_text(text, &build, err);
    }
    if (size >= 84)
        return silt_fail(err, SILT_INPUT, "%s: found %zu bytes for %u triangles, allowed an STL file with 84 + 50 bytes per triangle, or text",
                         text->path, size, little_endian((const unsigned char *)text->start + 80));
    return silt_fail(err, SILT_INPUT, "%s: found neither STL nor .msh, allowed one of them", text->path);
}

silt_status silt_surface_read(const char *path, double scale, bool inside_out, silt_surface *surface, silt_error *err) {
    surface_text text;
    *surface = (silt_surface){0};
    silt_status status = text_load(&text, path, err);
    if (status == SILT_OK)
        status = surface_parse(&text, surface, err);
    free(text.start);
    if (status == SILT_OK) {
        bool sane = true;
        for (int i = 0; i < surface->n_point; i++)
            for (int d = 0; d < 3; d++)
                sane &= fabs(surface->point[i][d] *= scale) < 1e12;
        if (sane)
            surface_mend(surface);
        if (!sane)
            status = silt_fail(err, SILT_INPUT, "%s: found coordinates above 1e12 m, allowed less: see scale", path);
        else if (!surface->n_triangle)
            status = silt_fail(err, SILT_INPUT, "%s: found no triangles, allowed at least one with an area", path);
    }
    if (status == SILT_OK)
        status = surface_check(path, surface, err);
    for (int t = 0; t < surface->n_triangle && inside_out; t++) {
        const int swap = surface->triangle[t][1];
        surface->triangle[t][1] = surface->triangle[t][2];
        surface->triangle[t][2] = swap;
    }
    if (status != SILT_OK)
        silt_surface_clear(surface);
    return status;
}

void silt_surface_clear(silt_surface *surface) {
    free(surface->point);
    free(surface->triangle);
    free(surface->source);
    *surface = (silt_surface){0};
}

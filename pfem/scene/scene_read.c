/** @file scene_read.c
 * From the tree and the table of keys to the struct: types, ranges, words, lists, defaults. Every row is treated alike.
 */
#include "scene_keys.h"

#include <limits.h>

/** a default that is another key's value, looked up when all is read */
typedef struct read_pending {
    const silt_key *key;
    double *value;         // borrowed, in the scene
    const silt_tree *node; // the block
    const char *path;      // owned
} read_pending;

typedef struct read_state {
    silt_reader *reader;
    silt_scene *scene;
    int n_pending, capacity;
    read_pending *pending; // owned
} read_state;

static void read_table(read_state *state, const silt_key_table *table, void *base, const silt_tree *node,
                       const char *path);

// what a value looks like, for messages
static char *read_found(const silt_tree *node) {
    if (node->kind == TREE_LIST)
        return node->n_item ? silt_text("a list of %d", node->n_item) : silt_text("an empty list");
    if (node->kind == TREE_MAPPING)
        return silt_text("a block of keys");
    if (!node->quoted && (!*node->text || strcmp(node->text, "~") == 0 || strcmp(node->text, "null") == 0))
        return silt_text("nothing");
    return silt_text(node->quoted ? "the text \"%.60s\"" : "'%.60s'", node->text);
}

static bool read_empty(const silt_tree *node) {
    return node->kind == TREE_SCALAR && !node->quoted &&
           (!*node->text || strcmp(node->text, "~") == 0 || strcmp(node->text, "null") == 0);
}

// the common message; says a word about what often goes wrong
static void read_refuse(read_state *state, const silt_tree *node, const silt_key *key, const char *path,
                        const char *hint) {
    char *found = read_found(node), *allowed = silt_key_allowed(key, state->scene->dimension);
    silt_complain(state->reader, node, "key '%s': found %s, allowed %s%s", path, found, allowed, hint);
    free(found);
    free(allowed);
}

// numbers ----------------------------------------------------------------------------------------------
static bool read_in_range(const silt_key *key, double x) {
    if (isnan(x) || (isinf(x) && !(key->flags & KEY_INFINITE)))
        return false;
    if (key->low == 0 && key->high == 0)
        return true;
    return (key->flags & KEY_OPEN_LOW ? x > key->low : x >= key->low) &&
           (key->flags & KEY_OPEN_HIGH ? x < key->high : x <= key->high);
}

static bool read_plain_number(const silt_tree *node, double *x) {
    return node->kind == TREE_SCALAR && !node->quoted && silt_text_number(node->text, x);
}

static bool read_number(read_state *state, const silt_key *key, const silt_tree *node, const char *path,
                        double *value) {
    double x;
    if (!read_plain_number(node, &x)) {
        bool quoted = node->kind == TREE_SCALAR && node->quoted && silt_text_number(node->text, &x);
        read_refuse(state, node, key, path, quoted ? "; leave the quotes out" : "");
        return false;
    }
    if (!read_in_range(key, x)) {
        read_refuse(state, node, key, path, "");
        return false;
    }
    *value = x;
    return true;
}

static void read_integer(read_state *state, const silt_key *key, const silt_tree *node, const char *path, void *value) {
    double x, most = key->kind == KEY_LONG ? 9e15 : INT_MAX;
    if (!read_plain_number(node, &x) || !read_in_range(key, x) || x != floor(x) || fabs(x) > most) {
        read_refuse(state, node, key, path, "");
        return;
    }
    if (key->kind == KEY_LONG)
        *(int64_t *)value = (int64_t)x;
    else
        *(int *)value = (int)x;
}

// numbers in a list; in two dimensions a third one may stand there if it is 0
static bool read_coordinates(read_state *state, const silt_key *key, const silt_tree *node, const char *path, int n,
                             const char *form, double *point) {
    double x[3] = {0};
    int most = state->scene->dimension == 3 ? n : 3;
    const char *in = key->unit ? " in " : "", *unit = key->unit ? key->unit : "";
    if (node->kind != TREE_LIST || node->n_item < n || node->n_item > most) {
        char *found = read_found(node);
        silt_complain(state->reader, node, "key '%s': found %s, allowed a point %s%s%s", path, found, form, in, unit);
        free(found);
        return false;
    }
    for (int i = 0; i < node->n_item; i++)
        if (!read_plain_number(node->item[i], &x[i]) || !isfinite(x[i])) {
            char *found = read_found(node->item[i]);
            silt_complain(state->reader, node->item[i], "key '%s': found %s, allowed a number%s%s", path, found, in,
                          unit);
            free(found);
            return false;
        }
    if (n == 2 && x[2] != 0) {
        silt_complain(state->reader, node->item[2],
                      "key '%s': found the third coordinate %.10g, allowed 0 in two dimensions", path, x[2]);
        return false;
    }
    memcpy(point, x, sizeof x);
    return true;
}

static bool read_point(read_state *state, const silt_key *key, const silt_tree *node, const char *path, double *point) {
    bool space = state->scene->dimension == 3;
    return read_coordinates(state, key, node, path, space ? 3 : 2, space ? "[x, y, z]" : "[x, y]", point);
}

// seen from above: in 2-D a number
static void read_place(read_state *state, const silt_key *key, const silt_tree *node, const char *path, double *place) {
    if (state->scene->dimension == 3)
        read_coordinates(state, key, node, path, 2, "[x, y] seen from above", place);
    else
        read_number(state, key, node, path, place);
}

static bool read_pair(read_state *state, const silt_key *key, const silt_tree *node, const char *path, double *pair) {
    double x[2] = {0};
    bool sound = node->kind == TREE_LIST && node->n_item == 2;
    for (int i = 0; i < 2 && sound; i++)
        sound = read_plain_number(node->item[i], &x[i]) && read_in_range(key, x[i]);
    if (!sound || !(x[0] < x[1])) {
        read_refuse(state, node, key, path, "");
        return false;
    }
    memcpy(pair, x, sizeof x);
    return true;
}

// two points: a segment, or the corners of a box
static bool read_two_points(read_state *state, const silt_key *key, const silt_tree *node, const char *path,
                            double *two) {
    double x[6];
    if (node->kind != TREE_LIST || node->n_item != 2) {
        read_refuse(state, node, key, path, "");
        return false;
    }
    for (int i = 0; i < 2; i++)
        if (!read_point(state, key, node->item[i], path, x + 3 * i))
            return false;
    bool box = key->kind != KEY_SEGMENT, space = state->scene->dimension == 3;
    bool sound =
        box ? x[0] < x[3] && x[1] < x[4] && (!space || x[2] < x[5]) : x[0] != x[3] || x[1] != x[4] || x[2] != x[5];
    if (!sound) {
        char *allowed = silt_key_allowed(key, state->scene->dimension);
        if (space)
            silt_complain(state->reader, node,
                          "key '%s': found [[%.10g, %.10g, %.10g], [%.10g, %.10g, %.10g]], allowed %s", path, x[0],
                          x[1], x[2], x[3], x[4], x[5], allowed);
        else
            silt_complain(state->reader, node, "key '%s': found [[%.10g, %.10g], [%.10g, %.10g]], allowed %s", path,
                          x[0], x[1], x[3], x[4], allowed);
        free(allowed);
        return false;
    }
    memcpy(two, x, sizeof x);
    return true;
}

// a polygon or chain: no point twice in a row, no crossing, some area
static bool read_sound(silt_reader *reader, const silt_tree *whole, const silt_tree *corners, const char *path,
                       bool polygon, int n, double *x) {
    int crossing[2];
    for (int i = 1; i < n; i++)
        if (x[3 * i] == x[3 * i - 3] && x[3 * i + 1] == x[3 * i - 2]) {
            silt_complain(reader, corners ? corners->item[i] : whole,
                          "key '%s': found the point [%.10g, %.10g] twice in a row, allowed once", path, x[3 * i],
                          x[3 * i + 1]);
            return false;
        }
    // a chain that comes back is closed
    bool back = x[0] == x[3 * n - 3] && x[1] == x[3 * n - 2];
    if (polygon && back) {
        silt_complain(reader, corners ? corners->item[n - 1] : whole,
                      "key '%s': found the first point again at the end, allowed once: a polygon closes by itself",
                      path);
        return false;
    }
    if (polygon && silt_chain_straight(n, x)) {
        silt_complain(reader, whole, "key '%s': found a polygon without area, allowed one with area", path);
        return false;
    }
    if (silt_chain_crosses(back ? n - 1 : n, x, polygon || back, crossing)) {
        silt_complain(reader, corners ? corners->item[crossing[1]] : whole,
                      "key '%s': found edge %d%s meeting edge %d, allowed a %s that crosses or "
                      "touches itself nowhere",
                      path, crossing[1], corners ? " (from here)" : "", crossing[0], polygon ? "polygon" : "polyline");
        return false;
    }
    // clockwise: turn it over, the first corner stays
    bool turned = polygon && silt_polygon_area(n, x) < 0;
    for (int i = 1, k = n - 1; turned && i < k; i++, k--)
        for (int c = 0; c < 3; c++) {
            double other = x[3 * i + c];
            x[3 * i + c] = x[3 * k + c];
            x[3 * k + c] = other;
        }
    return true;
}

bool silt_polygon_sound(silt_reader *reader, const silt_tree *whole, const silt_tree *corners, const char *path, int n,
                        double *point) {
    return read_sound(reader, whole, corners, path, true, n, point);
}

static void read_points(read_state *state, const silt_key *key, const silt_tree *node, const char *path, int *count,
                        double **points) {
    bool polygon = key->kind == KEY_POLYGON, space = state->scene->dimension == 3, corners = key->kind == KEY_CORNERS;
    int n = node->kind == TREE_LIST ? node->n_item : 0;
    if (n < (polygon || corners ? 3 : 2) || n > SCENE_CORNERS) {
        read_refuse(state, node, key, path, n > SCENE_CORNERS ? "; at most 20000" : "");
        return;
    }
    double *x = silt_alloc((size_t)n, 3 * sizeof *x);
    for (int i = 0; i < n; i++)
        if (!read_coordinates(state, key, node->item[i], path, corners ? 3 : 2,
                              corners ? "[x, y, z]" : space ? "[x, z]" : "[x, y]", x + 3 * i))
            goto cleanup;
    if (!corners && !read_sound(state->reader, node, node, path, polygon, n, x))
        goto cleanup;
    free(*points);
    *points = x;
    *count = n;
    return;
cleanup:
    free(x);
}

// words and texts --------------------------------------------------------------------------------------
static const silt_word *read_word(read_state *state, const silt_key *key, const silt_tree *node, const char *path) {
    if (node->kind == TREE_SCALAR) {
        for (const silt_word *word = key->words; word->text; word++)
            if (strcmp(word->text, node->text) == 0)
                return word;
        const char *nearest = silt_word_nearest(key->words, node->text);
        char *hint = nearest ? silt_text("; did you mean '%s'?", nearest) : NULL;
        read_refuse(state, node, key, path, hint ? hint : "");
        free(hint);
    } else {
        read_refuse(state, node, key, path, "");
    }
    return NULL;
}

static void read_switch(read_state *state, const silt_key *key, const silt_tree *node, const char *path, bool *value) {
    bool yes = node->kind == TREE_SCALAR && !node->quoted && strcmp(node->text, "true") == 0;
    bool no = node->kind == TREE_SCALAR && !node->quoted && strcmp(node->text, "false") == 0;
    if (yes || no)
        *value = yes;
    else
        read_refuse(state, node, key, path, "");
}

static bool read_is_name(const char *text) {
    static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
    size_t n = strlen(text);
    if (n == 0 || n > 40 || !strchr(letters, text[0]))
        return false;
    for (size_t i = 0; i < n; i++)
        if (!strchr(letters, text[i]) && !strchr("0123456789_", text[i]))
            return false;
    return true;
}

// An absolute name, since the resolved scene is read again from another folder. Where the file is no more, a copy
// beside the scene will do: under its plain name, or with the number of the list's item in front.
static char *read_file_name(const char *folder, const char *name, const char *path) {
    const char *slash = strrchr(name, '/'), *plain = slash ? slash + 1 : name;
    char *place[3] = {name[0] == '/' ? silt_text("%s", name) : silt_text("%s/%s", folder, name),
                      silt_text("%s/%d_%s", folder, atoi(path + strcspn(path, "0123456789")), plain),
                      silt_text("%s/%s", folder, plain)};
    char *full = NULL;
    for (int i = 0; i < 3 && !full; i++)
        full = realpath(place[i], NULL);
    char *found = full ? full : silt_text("%s", place[0]);
    for (int i = 0; i < 3; i++)
        free(place[i]);
    return found;
}

static void read_text(read_state *state, const silt_key *key, const silt_tree *node, const char *path, char **value) {
    bool file = key->kind == KEY_FILE || key->kind == KEY_SURFACE;
    bool plain = node->kind == TREE_SCALAR && (!read_empty(node) || key->fallback);
    if (!plain || (key->kind == KEY_NAME && !read_is_name(node->text)) || (file && !*node->text)) {
        read_refuse(state, node, key, path, key->kind == KEY_NAME && plain ? ", 40 characters at most" : "");
        return;
    }
    free(*value);
    if (file)
        *value = read_file_name(state->reader->folder, node->text, path);
    else
        *value = silt_text("%s", read_empty(node) ? "" : node->text);
}

static void read_series(read_state *state, const silt_key *key, const silt_tree *node, const char *path,
                        silt_series *value) {
    silt_error err = {0};
    char *file = NULL;
    double x;
    if (key->kind == KEY_CURVE && node->kind == TREE_SCALAR && !node->quoted && silt_text_number(node->text, &x)) {
        silt_series_constant(value, read_number(state, key, node, path, &x) ? x : 0);
        return;
    }
    if (key->kind == KEY_CURVE && (node->kind != TREE_SCALAR || read_empty(node))) {
        read_refuse(state, node, key, path, "");
        return;
    }
    read_text(state, &(silt_key){.kind = KEY_FILE, .name = key->name}, node, path, &file);
    if (!file)
        return;
    silt_series_clear(value);
    silt_status status = silt_series_read(NULL, file, value, &err);
    if (status == SILT_OK && key->kind != KEY_TABLE)
        status = silt_series_rising(value, &err);
    if (status != SILT_OK) {
        silt_complain(state->reader, node, "key '%s': found a file that cannot serve, allowed a CSV table%s: %s", path,
                      key->kind != KEY_TABLE ? " over rising time" : "", err.text);
        silt_series_clear(value);
    }
    free(file);
}

// rows -------------------------------------------------------------------------------------------------
static void read_list(read_state *state, const silt_key *key, const silt_tree *node, const char *path, int *count,
                      void **items) {
    if (node->kind != TREE_LIST) {
        read_refuse(state, node, key, path, "");
        return;
    }
    if (*count || node->n_item == 0)
        return;
    *items = silt_alloc((size_t)node->n_item, key->sub->size);
    *count = node->n_item;
    for (int i = 0; i < node->n_item; i++) {
        char *below = silt_text("%s.%d", path, i);
        read_table(state, key->sub, (char *)*items + (size_t)i * key->sub->size, node->item[i], below);
        free(below);
    }
}

static void read_texts(read_state *state, const silt_key *key, const silt_tree *node, const char *path, int *count, char ***text) {
    if (node->kind != TREE_LIST || node->n_item == 0) {
        read_refuse(state, node, key, path, "");
        return;
    }
    *text = silt_alloc((size_t)node->n_item, sizeof **text);
    *count = node->n_item;
    for (int i = 0; i < node->n_item; i++)
        (*text)[i] = silt_tree_text(node->item[i]);
}

static void read_row(read_state *state, const silt_key_table *table, const silt_key *key, void *base,
                     const silt_tree *node, const char *path) {
    void *at = (char *)base + key->offset, *count = (char *)base + key->count;
    const silt_word *word;
    switch (key->kind) {
    case KEY_NUMBER:
        read_number(state, key, node, path, at);
        break;
    case KEY_INTEGER:
    case KEY_LONG:
        read_integer(state, key, node, path, at);
        break;
    case KEY_SWITCH:
        read_switch(state, key, node, path, at);
        break;
    case KEY_WORD:
        if ((word = read_word(state, key, node, path)))
            memcpy(at, &word->value, sizeof word->value);
        break;
    case KEY_SET:
        if (node->kind != TREE_LIST)
            read_refuse(state, node, key, path, "");
        for (int i = 0; node->kind == TREE_LIST && i < node->n_item; i++)
            if ((word = read_word(state, key, node->item[i], path)))
                *(int *)at |= word->value;
        break;
    case KEY_SIGN:
        if ((word = read_word(state, key, node, path)))
            *(double *)at = word->value;
        break;
    case KEY_TEXT:
    case KEY_NAME:
    case KEY_FILE:
    case KEY_SURFACE:
        read_text(state, key, node, path, at);
        break;
    case KEY_SERIES:
    case KEY_TABLE:
    case KEY_CURVE:
        read_series(state, key, node, path, at);
        break;
    case KEY_POINT:
        read_point(state, key, node, path, at);
        break;
    case KEY_PLACE:
        read_place(state, key, node, path, at);
        break;
    case KEY_PAIR:
        read_pair(state, key, node, path, at);
        break;
    case KEY_ACROSS: {
        double pair[2], *box = at;
        if (read_pair(state, key, node, path, pair)) {
            box[1] = pair[0];
            box[4] = pair[1];
        }
        break;
    }
    case KEY_SEGMENT:
    case KEY_BOX:
        read_two_points(state, key, node, path, at);
        break;
    case KEY_CHAIN:
    case KEY_POLYGON:
    case KEY_CORNERS:
        read_points(state, key, node, path, count, at);
        break;
    case KEY_BLOCK:
        if (key->presence == PRESENT_FLAG && node->kind == TREE_MAPPING)
            *((bool *)base + key->present) = true;
        if (node->kind == TREE_MAPPING)
            read_table(state, key->sub, at, node, path);
        else
            read_refuse(state, node, key, path, "");
        break;
    case KEY_LIST:
        read_list(state, key, node, path, count, at);
        break;
    case KEY_TEXTS:
        read_texts(state, key, node, path, count, at);
        break;
    }
    if (key->flags & KEY_CHOICE && key->select)
        memcpy((char *)base + table->selector, &key->select, sizeof key->select);
}

// the default, or the complaint that there is none
static void read_default(read_state *state, const silt_key *key, void *base, const silt_tree *node, const char *path) {
    void *at = (char *)base + key->offset;
    const char *text = key->fallback;
    if (key->flags & (KEY_CHOICE | KEY_OPTIONAL))
        return;
    if (!text) {
        char *allowed = silt_key_allowed(key, state->scene->dimension);
        silt_complain_key(state->reader, node, "key '%s': found nothing in this block, allowed %s", path, allowed);
        free(allowed);
        return;
    }
    if (text[0] == '=') {
        SILT_RESERVE(state->pending, state->capacity, state->n_pending + 1);
        state->pending[state->n_pending++] = (read_pending){key, at, node, silt_text("%s", path)};
        return;
    }
    double x[3] = {0, 0, 0};
    if (text[0] == '[') {
        // pairs and points: two or three numbers
        char number[3][16] = {"", "", ""};
        sscanf(text, "[%15[^,], %15[^],], %15[^]]]", number[0], number[1], number[2]);
        for (int d = 0; d < 3; d++)
            silt_text_number(number[d], &x[d]);
    } else if (silt_text_number(text, &x[0])) {
        x[1] = x[0];
    }
    switch (key->kind) {
    case KEY_NUMBER:
        *(double *)at = x[0];
        break;
    case KEY_INTEGER:
        *(int *)at = (int)x[0];
        break;
    case KEY_LONG:
        *(int64_t *)at = (int64_t)x[0];
        break;
    case KEY_SWITCH:
        *(bool *)at = strcmp(text, "true") == 0;
        break;
    case KEY_WORD:
        for (const silt_word *word = key->words; word->text; word++)
            if (strcmp(word->text, text) == 0)
                memcpy(at, &word->value, sizeof word->value);
        break;
    case KEY_SIGN:
        for (const silt_word *word = key->words; word->text; word++)
            if (strcmp(word->text, text) == 0)
                *(double *)at = word->value;
        break;
    case KEY_TEXT:
        *(char **)at = silt_text("%s", text);
        break;
    case KEY_PAIR:
        memcpy(at, x, 2 * sizeof *x);
        break;
    case KEY_POINT:
        memcpy(at, x, sizeof x);
        break;
    default:
        break;
    }
}

static void read_unknown(read_state *state, const silt_key_table *table, const silt_tree *item, const char *path,
                         const char *nearest) {
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (!to)
        return;
    fprintf(to, "key '%.200s': found no such key, ", path);
    if (nearest) {
        fprintf(to, "did you mean '%s'?", nearest);
    } else {
        fprintf(to, "allowed in %s: ", table->what);
        const char *between = "";
        for (const silt_key *key = table->key; key->name; key++)
            if (silt_key_fits(key, state->scene->dimension)) {
                fprintf(to, "%s%s", between, key->name);
                between = ", ";
            }
    }
    fclose(to);
    silt_complain_key(state->reader, item, "%s", text);
    free(text);
}

// "height counts only with shape: box"
static void read_unused(read_state *state, const silt_key_table *table, const silt_key *key, const silt_tree *item,
                        const char *path) {
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (!to)
        return;
    for (const silt_key *row = table->key; row->name; row++) {
        if (row->flags & KEY_CHOICE && key->when >> row->select & 1 && silt_key_fits(row, state->scene->dimension))
            fprintf(to, " %s", row->name);
        for (const silt_word *word = row->flags & KEY_SELECTOR ? row->words : NULL; word && word->text; word++)
            if (key->when >> word->value & 1)
                fprintf(to, " '%s: %s'", row->name, word->text);
    }
    fclose(to);
    silt_complain_key(state->reader, item, "key '%s': found it without what it belongs to, allowed only with%s", path,
                      text);
    free(text);
}

// a key of the plane in space, or the other way round
static void read_misplaced(read_state *state, const silt_key_table *table, const silt_key *key, const silt_tree *item,
                           const char *path) {
    const char *here = state->scene->dimension == 3 ? "three" : "two";
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (!to)
        return;
    if (key->flags & KEY_CHOICE) {
        const char *between = "allowed there: ";
        for (const silt_key *row = table->key; row->name; row++)
            if (row->flags & KEY_CHOICE && silt_key_fits(row, state->scene->dimension)) {
                fprintf(to, "%s%s", between, row->name);
                between = ", ";
            }
    } else {
        fprintf(to, "allowed in %s only", key->flags & KEY_PLANE ? "two" : "three");
    }
    fclose(to);
    silt_complain_key(state->reader, item, "key '%s': found it in a scene of %s dimensions, %s", path, here, text);
    free(text);
}

// exactly one of the choices of a table; `meant` marks rows that a misspelt key was meant for
static void read_choices(read_state *state, const silt_key_table *table, const silt_tree *const *given,
                         const bool *meant, const silt_tree *node, const char *path) {
    const silt_tree *first = NULL;
    bool misspelt = false;
    const char *first_name = NULL;
    int n_choice = 0;
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (!to)
        return;
    for (int i = 0; table->key[i].name; i++) {
        if (!(table->key[i].flags & KEY_CHOICE))
            continue;
        if (silt_key_fits(&table->key[i], state->scene->dimension))
            fprintf(to, "%s%s", n_choice++ ? ", " : "", table->key[i].name);
        misspelt |= meant[i];
        if (given[i] && first)
            silt_complain_key(state->reader, given[i], "key '%s.%s': found it beside '%s', allowed only one of them",
                              path, table->key[i].name, first_name);
        else if (given[i]) {
            first = given[i];
            first_name = table->key[i].name;
        }
    }
    fclose(to);
    if (n_choice && !first && !misspelt && !table->loose)
        silt_complain(state->reader, node, "key '%s': found none of its forms, allowed exactly one of: %s", path, text);
    free(text);
}

static void read_table(read_state *state, const silt_key_table *table, void *base, const silt_tree *node,
                       const char *path) {
    enum { MOST_ROWS = 64 };
    const silt_tree *given[MOST_ROWS] = {0};
    bool meant[MOST_ROWS] = {0};
    int n_row = 0;
    while (table->key[n_row].name)
        n_row++;
    if (node->kind != TREE_MAPPING) {
        char *found = read_found(node);
        silt_complain(state->reader, node, "key '%s': found %s, allowed a block of keys: %s", path, found, table->what);
        free(found);
        return;
    }
    // which rows are there, which keys are none
    for (int i = 0; i < node->n_item; i++) {
        const silt_tree *item = node->item[i];
        const silt_key *key = silt_key_find(table, item->key);
        char *below = silt_text("%s%s%s", path, *path ? "." : "", item->key);
        if (!key) {
            const char *nearest = silt_key_nearest(table, item->key);
            read_unknown(state, table, item, below, nearest);
            if (nearest)
                meant[silt_key_find(table, nearest) - table->key] = true;
        } else if (given[key - table->key])
            silt_complain_key(state->reader, item, "key '%s': found it again, allowed once (first in line %d)", below,
                              given[key - table->key]->key_line);
        else
            given[key - table->key] = item;
        free(below);
    }
    read_choices(state, table, given, meant, node, path);
    // what decides about the other rows goes first
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < n_row; i++) {
            const silt_key *key = &table->key[i];
            bool first = key->flags & (KEY_CHOICE | KEY_SELECTOR);
            if (first != (pass == 0))
                continue;
            int kind = 0;
            if (table->selector >= 0)
                memcpy(&kind, (char *)base + table->selector, sizeof kind);
            bool used = !key->when || (key->when >> kind & 1);
            char *below = silt_text("%s%s%s", path, *path ? "." : "", key->name);
            if (!silt_key_fits(key, state->scene->dimension)) {
                if (given[i])
                    read_misplaced(state, table, key, given[i], below);
            } else if (given[i] && used)
                read_row(state, table, key, base, given[i], below);
            else if (given[i] && kind)
                read_unused(state, table, key, given[i], below);
            else if (!given[i] && used && !(meant[i] && !key->fallback) &&
                     !(key->flags & KEY_SPACE && state->scene->dimension != 3))
                read_default(state, key, base, node, below);
            free(below);
        }
}

// defaults that are other keys' values -----------------------------------------------------------------
static void read_pendings(read_state *state) {
    for (int i = 0; i < state->n_pending; i++) {
        read_pending *pending = &state->pending[i];
        char block[32], name[32];
        sscanf(pending->key->fallback, "=%31[^.].%31s", block, name);
        const silt_key *outer = silt_key_find(&silt_scene_keys, block), *inner = silt_key_find(outer->sub, name);
        bool on = *((bool *)state->scene + outer->present);
        if (on)
            *pending->value = *(double *)((char *)state->scene + outer->offset + inner->offset);
        else
            silt_complain_key(state->reader, pending->node,
                              "key '%s': found nothing in this block, allowed %s; its default is %s.%s, "
                              "which is not there",
                              pending->path, "a number > 0", block, name);
        free((char *)pending->path);
    }
    free(state->pending);
}

// freeing ----------------------------------------------------------------------------------------------
static void read_free(const silt_key_table *table, void *base) {
    for (const silt_key *key = table->key; key->name; key++) {
        void *at = (char *)base + key->offset;
        switch (key->kind) {
        case KEY_TEXTS:
            for (int i = 0; i < *(int *)((char *)base + key->count); i++)
                free((*(char ***)at)[i]);
            free(*(void **)at);
            *(void **)at = NULL;
            break;
        case KEY_LIST: {
            int n = *(int *)((char *)base + key->count);
            for (int i = 0; i < n; i++)
                read_free(key->sub, *(char **)at + (size_t)i * key->sub->size);
        }
            // fallthrough
        case KEY_TEXT:
        case KEY_NAME:
        case KEY_FILE:
        case KEY_SURFACE:
        case KEY_CHAIN:
        case KEY_POLYGON:
        case KEY_CORNERS:
            free(*(void **)at);
            *(void **)at = NULL;
            break;
        case KEY_SERIES:
        case KEY_TABLE:
        case KEY_CURVE:
            silt_series_clear(at);
            break;
        case KEY_BLOCK:
            read_free(key->sub, at);
            break;
        default:
            break;
        }
    }
}

void silt_keys_free(const silt_key_table *table, void *base) { read_free(table, base); }

void silt_keys_read(silt_reader *reader, const silt_key_table *table, void *base) {
    silt_scene none = {.dimension = 2};
    read_state state = {.reader = reader, .scene = &none};
    read_table(&state, table, base, reader->root, "");
}

void silt_scene_free(silt_scene **scene) {
    if (!scene || !*scene)
        return;
    silt_formula_clear(&(*scene)->fluid.velocity);
    silt_formula_clear(&(*scene)->fluid.force);
    read_free(&silt_scene_keys, *scene);
    free((*scene)->grains.filled);
    free((*scene)->path);
    free((*scene)->folder);
    free((*scene)->resolved);
    free(*scene);
    *scene = NULL;
}

silt_status silt_scene_read(const char *path, int n_set, const char *const *set, silt_scene **scene, silt_error *err) {
    silt_reader reader = {0};
    read_state state = {.reader = &reader};
    silt_scene *made = silt_alloc(1, sizeof *made);
    *scene = NULL;
    made->path = silt_text("%s", path);
    const char *slash = strrchr(path, '/');
    made->folder = slash == path ? silt_text("/")
                   : slash       ? silt_text("%.*s", (int)(slash - path), path)
                                 : silt_text(".");
    reader.folder = made->folder;
    state.scene = made;
    silt_tree_read(&reader, path, n_set, set);
    if (reader.root) {
        read_table(&state, &silt_scene_keys, made, reader.root, "");
        read_pendings(&state);
        silt_scene_settle(&reader, made);
        silt_scene_check(&reader, made);
    }
    silt_status status = silt_complaints_report(&reader, err);
    if (status == SILT_OK) {
        made->resolved = silt_scene_text(made, true);
        made->hash = silt_scene_hash(made);
        // the resolved scene must be readable again
        if (strlen(made->resolved) > SCENE_BYTES)
            status = silt_fail(err, SILT_INPUT,
                               "%s: found a scene that has more than %d MB with all defaults, allowed at most "
                               "that",
                               path, SCENE_BYTES >> 20);
    }
    if (status == SILT_OK) {
        *scene = made;
    } else {
        silt_scene_free(&made);
    }
    silt_reader_clear(&reader);
    return status;
}

/** @file scene_write.c
 * The resolved scene: every key that counts, with defaults and replacements worked in, as YAML that reads back to the
 * same.
 */
#include "scene_keys.h"

static bool write_present(const silt_key *key, const void *base) {
    const char *at = (const char *)base + key->present;
    int word;
    switch (key->presence) {
    case PRESENT_FLAG:
        return *(const bool *)at;
    case PRESENT_WORD:
        memcpy(&word, at, sizeof word);
        return word != 0;
    case PRESENT_TEXT:
        return *(char *const *)at != NULL;
    case ABSENT_TEXT:
        return *(char *const *)at == NULL;
    case PRESENT_ALWAYS:
        break;
    }
    return true;
}

// true when fifteen digits read back to x: it is the nearest double to whole numbers m/10^k, whose quotient is rounded once where
// both are exact. (By printing and reading back a list of 100k grains takes 0.2 s more.)
static bool fifteen_digits(double x) {
    const int k = x == 0 ? -1 : 14 - (int)floor(log10(fabs(x)));
    if (k >= 0 && k <= 22) {
        double power = 1;
        for (int n = 0; n < k; n++)
            power *= 10;
        const double m = nearbyint(x * power);
        return fabs(m) <= 1e15 && m / power == x;
    }
    char text[32];
    snprintf(text, sizeof text, "%.15g", x);
    return strtod(text, NULL) == x;
}

static void write_number(FILE *to, double x) {
    if (isinf(x)) {
        fprintf(to, x > 0 ? ".inf" : "-.inf");
        return;
    }
    if (fabs(x) < 1e9 && x == (int)x && !(x == 0 && signbit(x))) {
        fprintf(to, "%d", (int)x);
        return;
    }
    // the fewest digits that read back to the same bits
    char text[32];
    for (int digits = fifteen_digits(x) ? 15 : 16; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, x);
        if (digits != 16 || strtod(text, NULL) == x)
            break;
    }
    fputs(text, to);
}

// numbers of one point or pair in brackets
static void write_numbers(FILE *to, int n, const double *x) {
    for (int i = 0; i < n; i++) {
        fprintf(to, i ? ", " : "[");
        write_number(to, x[i]);
    }
    fputc(']', to);
}

static void write_points(FILE *to, int n, int dimension, const double *x) {
    for (int i = 0; i < n; i++) {
        fprintf(to, i ? ", " : "[");
        write_numbers(to, dimension, x + 3 * i);
    }
    fputc(']', to);
}

// in double quotes; what YAML may take for a line break or does not print is escaped
static void write_text(FILE *to, const char *text) {
    fputc('"', to);
    for (const unsigned char *c = (const unsigned char *)text; *c;) {
        int n = *c < 0x80 ? 1 : *c < 0xe0 ? 2 : *c < 0xf0 ? 3 : 4;
        uint32_t code = n == 1 ? *c : *c & (0xff >> (n + 1));
        for (int i = 1; i < n; i++)
            code = code << 6 | (c[i] & 0x3f);
        bool odd = code < 0x20 || (code >= 0x7f && code < 0xa0) || code == 0x2028 || code == 0x2029 || code == 0xfeff ||
                   (code & 0xfffe) == 0xfffe;
        if (*c == '"' || *c == '\\')
            fprintf(to, "\\%c", *c);
        else if (odd && code > 0xffff)
            fprintf(to, "\\U%08x", (unsigned)code);
        else if (odd)
            fprintf(to, "\\u%04x", (unsigned)code);
        else
            fwrite(c, 1, (size_t)n, to);
        c += n;
    }
    fputc('"', to);
}

static const char *write_word(const silt_key *key, int value) {
    for (const silt_word *word = key->words; word->text; word++)
        if (word->value == value)
            return word->text;
    return "none";
}

// true when the row has something to say about this struct
static bool write_counts(const silt_key_table *table, const silt_key *key, const void *base, int dimension) {
    const void *at = (const char *)base + key->offset, *count = (const char *)base + key->count;
    int kind = 0;
    if (table->selector >= 0)
        memcpy(&kind, (const char *)base + table->selector, sizeof kind);
    if (key->flags & KEY_SHORTHAND || (key->when && !(key->when >> kind & 1)) || (key->select && key->select != kind) ||
        !silt_key_fits(key, dimension))
        return false;
    switch (key->kind) {
    case KEY_NUMBER:
        return !isnan(*(const double *)at);
    case KEY_SEGMENT:
        return memcmp(at, (const char *)at + 3 * sizeof(double), 3 * sizeof(double)) != 0;
    case KEY_SET:
        return *(const int *)at != 0;
    case KEY_PAIR:
        return ((const double *)at)[0] < ((const double *)at)[1];
    case KEY_TEXT:
    case KEY_NAME:
    case KEY_FILE:
    case KEY_SURFACE:
        return *(char *const *)at != NULL;
    case KEY_SERIES:
    case KEY_TABLE:
    case KEY_CURVE:
        return ((const silt_series *)at)->n_row > 0;
    case KEY_LIST:
    case KEY_CHAIN:
    case KEY_POLYGON:
    case KEY_CORNERS:
        return *(const int *)count > 0 && write_present(key, base);
    case KEY_BLOCK:
        return write_present(key, base);
    default:
        return true;
    }
}

/** where the text goes and how files are named in it */
typedef struct write_state {
    FILE *to;
    int dimension;
    bool files_only;         // numbers are left out: only the names of files are wanted
    bool folders;            // files with their folder, or their last part only
    const char *const *name; // or the k-th file as name[k]; NULL: not
    int n_file, capacity;
    const char **file; // owned by the caller in the end, the files met so far
} write_state;

static void write_file(write_state *state, const char *path) {
    const char *slash = strrchr(path, '/');
    SILT_RESERVE(state->file, state->capacity, state->n_file + 1);
    state->file[state->n_file++] = path;
    write_text(state->to, state->name ? state->name[state->n_file - 1] : state->folders || !slash ? path : slash + 1);
}

static void write_value(write_state *state, const silt_key *key, const void *base) {
    FILE *to = state->to;
    const int dimension = state->dimension;
    const void *at = (const char *)base + key->offset;
    int number = 0;
    // numbers are most of the work in a scene with many grains
    const bool file = key->kind == KEY_FILE || key->kind == KEY_SURFACE || key->kind == KEY_SERIES || key->kind == KEY_TABLE ||
                      key->kind == KEY_CURVE;
    if (state->files_only && !file)
        return;
    switch (key->kind) {
    case KEY_NUMBER:
        write_number(to, *(const double *)at);
        break;
    case KEY_INTEGER:
        fprintf(to, "%d", *(const int *)at);
        break;
    case KEY_LONG:
        fprintf(to, "%lld", (long long)*(const int64_t *)at);
        break;
    case KEY_SWITCH:
        fprintf(to, *(const bool *)at ? "true" : "false");
        break;
    case KEY_WORD:
        memcpy(&number, at, sizeof number);
        fprintf(to, "%s", write_word(key, number));
        break;
    case KEY_SET:
        for (const silt_word *word = key->words; word->text; word++)
            if (*(const int *)at & word->value)
                fprintf(to, "%s%s", number++ ? ", " : "[", word->text);
        fputc(']', to);
        break;
    case KEY_SIGN:
        fprintf(to, "%s", write_word(key, (int)*(const double *)at));
        break;
    case KEY_TEXT:
    case KEY_NAME:
        write_text(to, *(char *const *)at);
        break;
    case KEY_FILE:
    case KEY_SURFACE:
        write_file(state, *(char *const *)at);
        break;
    case KEY_SERIES:
    case KEY_TABLE:
    case KEY_CURVE:
        if (((const silt_series *)at)->path)
            write_file(state, ((const silt_series *)at)->path);
        else
            write_number(to, ((const silt_series *)at)->value[1]);
        break;
    case KEY_POINT:
        write_numbers(to, dimension, at);
        break;
    case KEY_PLACE:
        if (dimension == 3)
            write_numbers(to, 2, at);
        else
            write_number(to, *(const double *)at);
        break;
    case KEY_PAIR:
        write_numbers(to, 2, at);
        break;
    case KEY_ACROSS:
        write_numbers(to, 2, (const double[2]){((const double *)at)[1], ((const double *)at)[4]});
        break;
    case KEY_SEGMENT:
    case KEY_BOX:
        write_points(to, 2, dimension, at);
        break;
    case KEY_CHAIN:
    case KEY_POLYGON:
    case KEY_CORNERS:
        write_points(to, *(const int *)((const char *)base + key->count), key->kind == KEY_CORNERS ? 3 : 2, *(double *const *)at);
        break;
    default:
        break;
    }
}

// `dash`: the first row goes behind "- " of a list
static void write_table(write_state *state, const silt_key_table *table, const void *base, int indent, bool dash) {
    FILE *to = state->to;
    for (const silt_key *key = table->key; key->name; key++) {
        if (!write_counts(table, key, base, state->dimension))
            continue;
        fprintf(to, "%*s%s%s:", dash ? indent - 2 : indent, "", dash ? "- " : "", key->name);
        dash = false;
        if (key->kind == KEY_BLOCK) {
            fputc('\n', to);
            long before = ftell(to);
            write_table(state, key->sub, (const char *)base + key->offset, indent + 2, false);
            // a block may have nothing to say but that it is there
            if (ftell(to) == before)
                fprintf(to, "%*s{}\n", indent + 2, "");
        } else if (key->kind == KEY_LIST) {
            fputc('\n', to);
            int n = *(const int *)((const char *)base + key->count);
            const char *item = *(char *const *)((const char *)base + key->offset);
            for (int i = 0; i < n; i++)
                write_table(state, key->sub, item + (size_t)i * key->sub->size, indent + 4, true);
        } else {
            fputc(' ', to);
            write_value(state, key, base);
            fputc('\n', to);
        }
    }
}

// the whole text; state->file keeps what files are in it
static char *write_scene(const silt_scene *scene, write_state *state) {
    char *text = NULL;
    size_t size = 0;
    state->to = open_memstream(&text, &size);
    state->dimension = scene->dimension == 3 ? 3 : 2;
    if (!state->to)
        return silt_text("%s", "");
    write_table(state, &silt_scene_keys, scene, 0, false);
    fclose(state->to);
    return text;
}

char *silt_scene_text(const silt_scene *scene, bool folders) {
    write_state state = {.folders = folders};
    char *text = write_scene(scene, &state);
    free(state.file);
    return text;
}

int silt_scene_files(const silt_scene *scene, const char ***file) {
    write_state state = {.folders = true, .files_only = true};
    free(write_scene(scene, &state));
    *file = state.file;
    return state.n_file;
}

char *silt_scene_text_named(const silt_scene *scene, const char *const *name) {
    write_state state = {.name = name};
    char *text = write_scene(scene, &state);
    free(state.file);
    return text;
}

char *silt_scene_named(const silt_scene *scene, silt_file_name *name, void *self) {
    const char **file = NULL;
    const int n = silt_scene_files(scene, &file);
    const char **named = silt_alloc((size_t)n + 1, sizeof *named);
    for (int k = 0; k < n; k++)
        named[k] = name(self, file[k]);
    char *text = silt_scene_text_named(scene, named);
    free(named);
    free(file);
    return text;
}

/** @file scene_help.c
 * What the table of keys says in words: ranges for messages, the nearest name, `silt help`, docs/scene.md.
 */
#include "scene_keys.h"

#include <ctype.h>

// looking up -------------------------------------------------------------------------------------------
const silt_key *silt_key_find(const silt_key_table *table, const char *name) {
    for (const silt_key *key = table->key; key->name; key++)
        if (strcmp(key->name, name) == 0)
            return key;
    return NULL;
}

int silt_text_distance(const char *a, const char *b, int limit) {
    enum { LONGEST = 40 };
    int n = (int)strlen(a), m = (int)strlen(b);
    if (n > LONGEST || m > LONGEST || abs(n - m) > limit)
        return limit + 1;
    // three rows of the table of distances between beginnings
    int row[3][LONGEST + 1];
    int *before = row[0], *last = row[1], *now = row[2];
    for (int k = 0; k <= m; k++)
        last[k] = k;
    for (int i = 1; i <= n; i++) {
        now[0] = i;
        for (int k = 1; k <= m; k++) {
            int change = last[k - 1] + (tolower((unsigned char)a[i - 1]) != tolower((unsigned char)b[k - 1]));
            int best = change < last[k] + 1 ? change : last[k] + 1;
            best = best < now[k - 1] + 1 ? best : now[k - 1] + 1;
            if (i > 1 && k > 1 && a[i - 1] == b[k - 2] && a[i - 2] == b[k - 1] && before[k - 2] + 1 < best)
                best = before[k - 2] + 1;
            now[k] = best;
        }
        int *free_row = before;
        before = last;
        last = now;
        now = free_row;
    }
    return last[m] <= limit ? last[m] : limit + 1;
}

// how many slips still mean the same word
static int help_slips(const char *name) {
    int n = (int)strlen(name);
    return n <= 2 ? 0 : n <= 4 ? 1 : n <= 9 ? 2 : 3;
}

const char *silt_key_nearest(const silt_key_table *table, const char *name) {
    const char *nearest = NULL;
    int best = help_slips(name) + 1;
    for (const silt_key *key = table->key; key->name; key++) {
        int distance = silt_text_distance(name, key->name, best - 1);
        if (distance < best) {
            best = distance;
            nearest = key->name;
        }
    }
    return nearest;
}

const char *silt_word_nearest(const silt_word *words, const char *text) {
    const char *nearest = NULL;
    int best = help_slips(text) + 1;
    for (; words->text; words++) {
        int distance = silt_text_distance(text, words->text, best - 1);
        if (distance < best) {
            best = distance;
            nearest = words->text;
        }
    }
    return nearest;
}

bool silt_text_number(const char *text, double *value) {
    const char *c = text;
    double sign = *c == '-' ? -1 : 1;
    c += *c == '-' || *c == '+';
    if (strcmp(c, ".inf") == 0 || strcmp(c, ".Inf") == 0 || strcmp(c, ".INF") == 0) {
        *value = sign * HUGE_VAL;
        return true;
    }
    if (strcmp(text, ".nan") == 0 || strcmp(text, ".NaN") == 0 || strcmp(text, ".NAN") == 0) {
        *value = NAN;
        return true;
    }
    // decimal digits only: strtod alone would take hexadecimal, "infinity" and more
    int digits = 0;
    for (; isdigit((unsigned char)*c); c++)
        digits++;
    if (*c == '.')
        for (c++; isdigit((unsigned char)*c); c++)
            digits++;
    if (digits == 0)
        return false;
    if (*c == 'e' || *c == 'E') {
        c++;
        c += *c == '-' || *c == '+';
        if (!isdigit((unsigned char)*c))
            return false;
        while (isdigit((unsigned char)*c))
            c++;
    }
    if (*c)
        return false;
    *value = strtod(text, NULL);
    return true;
}

// words for messages -----------------------------------------------------------------------------------
static void help_range(FILE *to, const silt_key *key) {
    double low = key->low, high = key->high;
    if (low == 0 && high == 0)
        return;
    if (low == high)
        fprintf(to, "%.10g", low);
    else if (isinf(high))
        fprintf(to, "%s %.10g", key->flags & KEY_OPEN_LOW ? ">" : ">=", low);
    else if (key->flags & (KEY_OPEN_LOW | KEY_OPEN_HIGH))
        fprintf(to, "%s %.10g and %s %.10g", key->flags & KEY_OPEN_LOW ? ">" : ">=", low,
                key->flags & KEY_OPEN_HIGH ? "<" : "<=", high);
    else
        fprintf(to, "%.10g to %.10g", low, high);
    if (key->flags & KEY_INFINITE)
        fprintf(to, ", or .inf");
}

static void help_words(FILE *to, const silt_word *words) {
    for (const silt_word *word = words; word->text; word++)
        fprintf(to, "%s%s", word == words ? "" : ", ", word->text);
}

static const char *help_type(const silt_key *key) {
    switch (key->kind) {
    case KEY_NUMBER:
        return "number";
    case KEY_INTEGER:
    case KEY_LONG:
        return "integer";
    case KEY_SWITCH:
        return "true or false";
    case KEY_WORD:
    case KEY_SIGN:
        return "word";
    case KEY_SET:
        return "list of words";
    case KEY_TEXT:
        return "text";
    case KEY_NAME:
        return "name";
    case KEY_FILE:
    case KEY_SURFACE:
    case KEY_SERIES:
    case KEY_TABLE:
        return "file";
    case KEY_CURVE:
        return "number or file";
    case KEY_POINT:
        return "[x, y]";
    case KEY_PLACE:
        return "number";
    case KEY_PAIR:
    case KEY_ACROSS:
        return "[low, high]";
    case KEY_SEGMENT:
        return "[[x, y], [x, y]]";
    case KEY_BOX:
        return "[[x0, y0], [x1, y1]]";
    case KEY_CHAIN:
    case KEY_POLYGON:
        return "[[x, y], ...]";
    case KEY_CORNERS:
        return "[[x, y, z], ...]";
    case KEY_BLOCK:
        return "block";
    case KEY_LIST:
        return "list";
    case KEY_TEXTS:
        return "[value, ...]";
    }
    return "";
}

char *silt_key_allowed(const silt_key *key, int dimension) {
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (!to)
        return silt_text("%s", help_type(key));
    if (key->words) {
        fprintf(to, key->kind == KEY_SET ? "a list of any of " : "");
        help_words(to, key->words);
    } else if (key->kind == KEY_BOX) {
        fprintf(to, dimension == 3 ? "two corners [[x0, y0, z0], [x1, y1, z1]] with x0 < x1, y0 < y1 and z0 < z1"
                                   : "two corners [[x0, y0], [x1, y1]] with x0 < x1 and y0 < y1");
    } else if (key->kind == KEY_POINT && dimension == 3) {
        fprintf(to, "[x, y, z]");
    } else if (key->kind == KEY_POLYGON && dimension == 3) {
        fprintf(to, "a list of 3 or more points [[x, z], ...]");
    } else if (key->kind == KEY_CORNERS) {
        fprintf(to, "a list of 3 or more points [[x, y, z], ...]");
    } else if (key->kind == KEY_CURVE) {
        fprintf(to, "a number or a CSV file beside the scene");
    } else if (key->kind == KEY_SEGMENT) {
        fprintf(to, "two different points [[x, y], [x, y]]");
    } else if (key->kind == KEY_CHAIN || key->kind == KEY_POLYGON) {
        fprintf(to, "a list of %d or more points [[x, y], ...]", key->kind == KEY_CHAIN ? 2 : 3);
    } else if (key->kind == KEY_PAIR || key->kind == KEY_ACROSS) {
        fprintf(to, "two numbers [low, high] with low < high%s",
                key->flags & KEY_INFINITE ? ", -.inf and .inf too" : "");
    } else if (key->kind == KEY_BLOCK) {
        fprintf(to, "a block of keys: ");
        for (const silt_key *row = key->sub->key; row->name; row++)
            fprintf(to, "%s%s", row == key->sub->key ? "" : ", ", row->name);
    } else if (key->kind == KEY_LIST) {
        fprintf(to, "a list of blocks, each %s", key->sub->what);
    } else if (key->kind == KEY_SWITCH || key->kind == KEY_POINT) {
        fprintf(to, "%s", help_type(key));
    } else if (key->kind == KEY_TEXTS) {
        fprintf(to, "a list of one or more values [value, ...]");
    } else if (key->kind == KEY_NAME) {
        fprintf(to, "a name of letters, digits and underscores that begins with a letter");
    } else if (key->kind == KEY_SURFACE) {
        fprintf(to, "an STL or .msh file beside the scene, or a shape for gmsh");
    } else if (key->kind == KEY_FILE || key->kind == KEY_SERIES || key->kind == KEY_TABLE) {
        fprintf(to, "a CSV file beside the scene");
    } else {
        fprintf(to, "%s %s", key->kind == KEY_INTEGER || key->kind == KEY_LONG ? "an" : "a", help_type(key));
    }
    if (key->unit)
        fprintf(to, " in %s", key->unit);
    if (key->low != 0 || key->high != 0) {
        fprintf(to, ", ");
        help_range(to, key);
    }
    fclose(to);
    return text;
}

// silt help and docs/scene.md --------------------------------------------------------------------------
static char *help_default(const silt_key *key) {
    if (key->flags & KEY_CHOICE)
        return silt_text("one of");
    if (key->flags & KEY_OPTIONAL)
        return silt_text("none");
    if (!key->fallback)
        return silt_text("required");
    if (key->fallback[0] == '=')
        return silt_text("%s", key->fallback + 1);
    if (strcmp(key->fallback, ".nan") == 0)
        return silt_text("none");
    return silt_text("%s", *key->fallback ? key->fallback : "empty");
}

static char *help_allowed(const silt_key *key) {
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (!to)
        return silt_text("%s", "");
    if (key->words)
        help_words(to, key->words);
    else if (key->kind == KEY_PAIR && key->flags & KEY_INFINITE)
        fprintf(to, "-.inf and .inf too");
    else
        help_range(to, key);
    fclose(to);
    return text;
}

// which word of the selector makes this key count: ", only with shape: box"
static void help_when(FILE *to, const silt_key_table *table, const silt_key *key) {
    if (!key->when)
        return;
    const char *between = "only with ";
    for (const silt_key *row = table->key; row->name; row++) {
        if (row->flags & KEY_CHOICE && key->when >> row->select & 1) {
            fprintf(to, "%s%s", between, row->name);
            between = " or ";
        }
        for (const silt_word *word = row->flags & KEY_SELECTOR ? row->words : NULL; word && word->text; word++)
            if (key->when >> word->value & 1) {
                fprintf(to, "%s%s: %s", between, row->name, word->text);
                between = ", ";
            }
    }
}

static void help_doc(FILE *to, const silt_key_table *table, const silt_key *key) {
    fprintf(to, "%s", key->doc);
    if (key->when && *key->doc)
        fprintf(to, "; ");
    help_when(to, table, key);
    if (key->flags & (KEY_PLANE | KEY_SPACE))
        fprintf(to, key->flags & KEY_PLANE ? "; 2-D only" : "; 3-D only");
}

static void help_line(FILE *to, const silt_key_table *table, const char *path, const silt_key *key) {
    char *fallback = help_default(key), *allowed = help_allowed(key);
    fprintf(to, "%-26s %-21s %-8s %-14s ", path, help_type(key), key->unit ? key->unit : "", fallback);
    if (*allowed)
        fprintf(to, "%s; ", allowed);
    help_doc(to, table, key);
    fputc('\n', to);
    free(fallback);
    free(allowed);
}

static void help_full(FILE *to, const silt_key_table *table, const char *path, const silt_key *key) {
    char *fallback = help_default(key), *allowed = help_allowed(key);
    fprintf(to, "%s\n  type     %s\n", path, help_type(key));
    if (key->unit)
        fprintf(to, "  unit     %s\n", key->unit);
    fprintf(to, "  default  %s\n", fallback);
    if (*allowed)
        fprintf(to, "  allowed  %s\n", allowed);
    fprintf(to, "  meaning  ");
    help_doc(to, table, key);
    fputc('\n', to);
    free(fallback);
    free(allowed);
}

// a list's item number in the path counts for nothing, a last part alone will do, a block shows all in it
static bool help_matches(const char *path, const char *wanted) {
    size_t n = strlen(path), m = strlen(wanted);
    if (strcmp(path, wanted) == 0 || (strncmp(path, wanted, m) == 0 && path[m] == '.'))
        return true;
    return n > m && path[n - m - 1] == '.' && strcmp(path + n - m, wanted) == 0;
}

static int help_walk(FILE *to, const silt_key_table *table, const char *prefix, const char *wanted, bool full) {
    int n = 0;
    for (const silt_key *key = table->key; key->name; key++) {
        char *path = silt_text("%s%s%s", prefix, *prefix ? "." : "", key->name);
        bool match = !wanted || help_matches(path, wanted);
        n += match;
        if (match && to && full)
            help_full(to, table, path, key);
        else if (match && to)
            help_line(to, table, path, key);
        if (key->sub)
            n += help_walk(to, key->sub, path, wanted, full);
        free(path);
    }
    return n;
}

// name whose path's last part is nearest to the wanted one
static const char *help_nearest(const silt_key_table *table, const char *wanted, int *best) {
    const char *nearest = NULL;
    for (const silt_key *key = table->key; key->name; key++) {
        int distance = silt_text_distance(wanted, key->name, *best - 1);
        if (distance < *best) {
            *best = distance;
            nearest = key->name;
        }
        const char *below = key->sub ? help_nearest(key->sub, wanted, best) : NULL;
        nearest = below ? below : nearest;
    }
    return nearest;
}

silt_status silt_keys_help(const silt_key_table *table, const char *key, const char *list, FILE *to, silt_error *err) {
    if (!key || !*key) {
        fprintf(to, "%-26s %-21s %-8s %-14s %s\n", "key", "type", "unit", "default", "range; meaning");
        help_walk(to, table, "", NULL, false);
        return SILT_OK;
    }
    // drop item numbers: bodies.0.density is bodies.density
    char *wanted = silt_text("%s", key), *end = wanted;
    for (const char *part = key; *part;) {
        size_t n = strcspn(part, "."), digits = strspn(part, "0123456789");
        if (n == 0 || digits != n) {
            if (end > wanted)
                *end++ = '.';
            memmove(end, part, n);
            end += n;
        }
        part += n + (part[n] == '.');
    }
    *end = 0;
    int n = *wanted ? help_walk(NULL, table, "", wanted, false) : 0;
    silt_status status = SILT_OK;
    if (n == 0) {
        const char *last = strrchr(wanted, '.');
        last = last ? last + 1 : wanted;
        int best = help_slips(last) + 1;
        const char *nearest = help_nearest(table, last, &best);
        status =
            silt_fail(err, SILT_INPUT, "help: found no key '%s'%s%s%s, allowed: one of the keys that `%s` lists",
                      key, nearest ? ", did you mean '" : "", nearest ? nearest : "", nearest ? "'?" : "", list);
    } else {
        help_walk(to, table, "", wanted, n == 1);
    }
    free(wanted);
    return status;
}

silt_status silt_scene_help(const char *key, FILE *to, silt_error *err) {
    return silt_keys_help(&silt_scene_keys, key, "silt help", to, err);
}

static void help_cell(FILE *to, const char *text) {
    for (; *text; text++)
        fprintf(to, "%s%c", *text == '|' ? "\\" : "", *text);
}

static void help_section(FILE *to, const silt_key_table *table, const char *path, bool list) {
    if (*path)
        fprintf(to, "\n## %s\n\n%s%s%s\n\n", path, list ? "A list; each item is " : "", list ? table->what : "",
                list ? "." : "One block.");
    fprintf(to, "| key | type | unit | default | range | meaning |\n|---|---|---|---|---|---|\n");
    for (const silt_key *key = table->key; key->name; key++) {
        char *fallback = help_default(key), *allowed = help_allowed(key);
        const char *cell[] = {key->name, help_type(key), key->unit ? key->unit : "", fallback, allowed};
        for (int i = 0; i < 5; i++) {
            fprintf(to, i == 0 ? "| `" : i == 1 ? "` | " : " | ");
            help_cell(to, cell[i]);
        }
        fprintf(to, " | ");
        help_doc(to, table, key);
        fprintf(to, " |\n");
        free(fallback);
        free(allowed);
    }
    for (const silt_key *key = table->key; key->name; key++)
        if (key->sub) {
            char *below = silt_text("%s%s%s", path, *path ? "." : "", key->name);
            help_section(to, key->sub, below, key->kind == KEY_LIST);
            free(below);
        }
}

void silt_keys_document(const silt_key_table *table, FILE *to) { help_section(to, table, "", false); }

void silt_scene_document(FILE *to) {
    fprintf(to,
            "# Keys of a scene\n\n"
            "This page is made from the table in `pfem/scene/scene_keys.c`; `silt help KEY` prints the same.\n\n"
            "A scene is a YAML 1.2 (or JSON) file. Units are SI, angles in degrees. Points have two numbers "
            "[x, y], y up, in two dimensions (a third one must be 0) and three\n[x, y, z], z up, in three. Physical "
            "properties have no default, numerical ones have one. Of the keys marked \"one of\" "
            "exactly one is given per item.\nFiles are CSV files beside the scene: `#` comments, a header with names, "
            "numbers.\n`-D path=value` replaces or adds a key from the command line; list items by number or by their "
            "name:\n`-D fluid.size=0.01`, `-D bodies.0.density=700`, `-D bodies.temple.density=700`.\n\n");
    help_section(to, &silt_scene_keys, "", false);
    fprintf(
        to,
        "\n## Formulas\n\n"
        "With X = x - centre and Y = y - centre (3-D: z - centre); components along x and up; `vector` is added to "
        "all.\n\n"
        "| formula | field |\n|---|---|\n"
        "| solid-rotation | rate about the centre, counter-clockwise; 3-D: right-handed about `axis` |\n"
        "| shear, strain | (rate Y, 0); (-rate X, rate Y) |\n"
        "| taylor-green | amplitude (sin(pi X/length) cos(pi Y/length), -cos(pi X/length) sin(pi Y/length)) |\n"
        "| standing-wave | linear wave over a flat bed at Y = 0 whose surface is flat and rises as amplitude omega "
        "cos(2 pi X/length), omega^2 = g k tanh(k depth) |\n"
        "| solitary-wave | potential flow over a flat bed at Y = 0 under the surface depth (1 + s(X)), e = "
        "amplitude/depth, S = sech^2(k X), T = 1 - S. boussinesq: s = e S, k depth = sqrt(3 e/4), c^2 = g depth (1 + "
        "e). grimshaw: s = e S - 3/4 e^2 S T + e^3 (5/8 S T - 101/80 S^2 T), k depth = sqrt(3 e/4) (1 - 5/8 e + "
        "71/128 e^2), c^2 = g depth (1 + e - e^2/20 - 3/70 e^3). A region's `outline` gives the surface |\n"
        "| field | the values of a point at the point, linear on the Delaunay cells between points, the plane "
        "through the nearest ones beside the cloud |\n"
        "| central | -rate \\|rate\\| (X, Y), 3-D: from the point or from `axis` |\n"
        "| series | x, y (z) of the file at the time, linear between rows, constant outside |\n");
}

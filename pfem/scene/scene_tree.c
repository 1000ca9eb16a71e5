/** @file scene_tree.c
 * The scene's text as a tree: every value and key knows its source, line and column. Replacements from the command line
 * are worked into the tree. Complaints are kept here too, since they need the text for their carets.
 */
#include "scene_keys.h"

#include <ctype.h>
#include <errno.h>
#include <libfyaml.h>
#include <sys/stat.h>

// complaints -------------------------------------------------------------------------------------------
static void tree_complain_at(silt_reader *reader, int source, int line, int column, char *text) {
    int i = reader->n_complaint++;
    if (i < SCENE_COMPLAINTS)
        reader->complaint[i] = (silt_complaint){source, line, column, i, text};
    else
        free(text);
}

static char *tree_format(const char *format, va_list list) {
    char text[2048];
    vsnprintf(text, sizeof text, format, list);
    return silt_text("%s", text);
}

void silt_complain(silt_reader *reader, const silt_tree *node, const char *format, ...) {
    va_list list;
    va_start(list, format);
    char *text = tree_format(format, list);
    va_end(list);
    tree_complain_at(reader, node ? node->source : 0, node ? node->line : 1, node ? node->column : 1, text);
}

void silt_complain_key(silt_reader *reader, const silt_tree *node, const char *format, ...) {
    va_list list;
    va_start(list, format);
    char *text = tree_format(format, list);
    va_end(list);
    if (node && node->key)
        tree_complain_at(reader, node->key_source, node->key_line, node->key_column, text);
    else
        tree_complain_at(reader, node ? node->source : 0, node ? node->line : 1, node ? node->column : 1, text);
}

static int tree_complaint_order(const void *a, const void *b) {
    const silt_complaint *p = a, *q = b;
    int by[] = {p->source - q->source, p->line - q->line, p->column - q->column, p->order - q->order};
    for (int i = 0; i < 4; i++)
        if (by[i])
            return by[i];
    return 0;
}

// the source line and a caret under the column; long lines are cut to a window around it
static void tree_caret(FILE *to, const silt_source *source, int line, int column) {
    enum { WINDOW = 150, BEFORE = 100 };
    const char *start = source->text, *last = source->text + source->size;
    for (int i = 1; i < line && start; i++) {
        start = memchr(start, '\n', (size_t)(last - start));
        start = start ? start + 1 : NULL;
    }
    if (!start || start >= last)
        return;
    const char *end = memchr(start, '\n', (size_t)(last - start));
    end = end ? end : last;
    while (end > start && end[-1] == '\r')
        end--;
    // columns count characters, not bytes
    int at = 1, first = column > BEFORE + 20 ? column - BEFORE : 1;
    fprintf(to, "\n    ");
    for (const char *c = start; c < end; at++) {
        const char *next = c + 1;
        while (next < end && ((unsigned char)*next & 0xc0) == 0x80)
            next++;
        if (at >= first && at < first + WINDOW) {
            if (next == c + 1)
                fputc((unsigned char)*c < 32 ? ' ' : *c, to);
            else
                fwrite(c, 1, (size_t)(next - c), to);
        }
        c = next;
    }
    fprintf(to, "\n    %*s^", column - first, "");
}

silt_status silt_complaints_report(silt_reader *reader, silt_error *err) {
    if (reader->n_complaint == 0)
        return SILT_OK;
    int n = reader->n_complaint < SCENE_COMPLAINTS ? reader->n_complaint : SCENE_COMPLAINTS;
    qsort(reader->complaint, (size_t)n, sizeof *reader->complaint, tree_complaint_order);
    if (!err)
        return SILT_INPUT;
    // as many whole complaints as there is room for, then how many are left
    enum { LAST_LINE = 64 };
    size_t used = 0, room = sizeof err->text - LAST_LINE;
    int shown = 0;
    err->text[0] = 0;
    for (; shown < n; shown++) {
        const silt_complaint *c = &reader->complaint[shown];
        const silt_source *source = &reader->source[c->source];
        char *text = NULL;
        size_t size = 0;
        FILE *to = open_memstream(&text, &size);
        if (!to)
            break;
        fprintf(to, "%s%s:%d:%d: %s", shown ? "\n" : "", source->name, c->line, c->column, c->text);
        tree_caret(to, source, c->line, c->column);
        fclose(to);
        bool fits = used + size < room;
        if (!fits && shown == 0)
            size = room - 1;
        if (fits || shown == 0) {
            memcpy(err->text + used, text, size);
            used += size;
            err->text[used] = 0;
        }
        free(text);
        if (!fits && shown > 0)
            break;
    }
    if (reader->n_complaint > shown)
        snprintf(err->text + used, sizeof err->text - used, "\n... and %d more errors", reader->n_complaint - shown);
    err->status = SILT_INPUT;
    err->count = reader->n_complaint;
    return SILT_INPUT;
}

// nodes ------------------------------------------------------------------------------------------------
// NULL when the scene has grown past all reason
static silt_tree *tree_node(silt_reader *reader, silt_tree_kind kind, int source, int line, int column) {
    if (reader->n_node >= SCENE_NODES) {
        tree_complain_at(reader, source, line, column,
                         silt_text("syntax: found more than %d values, allowed at most that", SCENE_NODES));
        return NULL;
    }
    SILT_RESERVE(reader->node, reader->node_capacity, reader->n_node + 1);
    silt_tree *node = silt_alloc(1, sizeof *node);
    *node = (silt_tree){.kind = kind, .source = source, .line = line, .column = column};
    reader->node[reader->n_node++] = node;
    return node;
}

static void tree_push(silt_tree *parent, silt_tree *node) {
    SILT_RESERVE(parent->item, parent->capacity, parent->n_item + 1);
    parent->item[parent->n_item++] = node;
}

silt_tree *silt_tree_item(const silt_tree *mapping, const char *key) {
    if (!mapping || mapping->kind != TREE_MAPPING)
        return NULL;
    for (int i = 0; i < mapping->n_item; i++)
        if (strcmp(mapping->item[i]->key, key) == 0)
            return mapping->item[i];
    return NULL;
}

// child by key, number or name of a list's item
static silt_tree *tree_child(const silt_tree *node, const char *part) {
    if (node->kind == TREE_MAPPING)
        return silt_tree_item(node, part);
    if (node->kind != TREE_LIST)
        return NULL;
    if (*part && strspn(part, "0123456789") == strlen(part)) {
        long i = strlen(part) < 9 ? strtol(part, NULL, 10) : -1;
        return i >= 0 && i < node->n_item ? node->item[i] : NULL;
    }
    for (int i = 0; i < node->n_item; i++) {
        const silt_tree *name = silt_tree_item(node->item[i], "name");
        if (name && name->kind == TREE_SCALAR && strcmp(name->text, part) == 0)
            return node->item[i];
    }
    return NULL;
}

silt_tree *silt_tree_find(const silt_tree *root, const char *format, ...) {
    char path[256];
    va_list list;
    va_start(list, format);
    vsnprintf(path, sizeof path, format, list);
    va_end(list);
    silt_tree *node = (silt_tree *)root;
    char *rest = NULL;
    for (char *part = strtok_r(path, ".", &rest); part && node; part = strtok_r(NULL, ".", &rest))
        node = tree_child(node, part);
    return node;
}

static void tree_flow(FILE *to, const silt_tree *node, bool inside) {
    const char *between = "";
    if (node->kind == TREE_SCALAR) {
        fprintf(to, inside && node->quoted ? "'%s'" : "%s", node->text);
        return;
    }
    fputc(node->kind == TREE_LIST ? '[' : '{', to);
    for (int i = 0; i < node->n_item; i++, between = ", ") {
        fputs(between, to);
        if (node->kind == TREE_MAPPING)
            fprintf(to, "%s: ", node->item[i]->key);
        tree_flow(to, node->item[i], true);
    }
    fputc(node->kind == TREE_LIST ? ']' : '}', to);
}

char *silt_tree_text(const silt_tree *node) {
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (!to)
        return silt_text("%s", "");
    tree_flow(to, node, false);
    fclose(to);
    return text;
}

void silt_reader_clear(silt_reader *reader) {
    for (int i = 0; i < reader->n_node; i++) {
        silt_tree *node = reader->node[i];
        free(node->key);
        free(node->text);
        free(node->item);
        free(node);
    }
    free(reader->node);
    for (int i = 0; i < reader->n_source; i++) {
        free(reader->source[i].name);
        free(reader->source[i].text);
    }
    free(reader->source);
    for (int i = 0; i < reader->n_complaint && i < SCENE_COMPLAINTS; i++)
        free(reader->complaint[i].text);
    *reader = (silt_reader){0};
}

// YAML -------------------------------------------------------------------------------------------------
typedef struct tree_anchor {
    char *name; // owned
    silt_tree *node;
} tree_anchor;

/** state while one text is parsed */
typedef struct tree_parse {
    silt_reader *reader;
    int source;
    silt_tree *stack[SCENE_DEPTH + 1];
    int depth;
    silt_tree *root;
    char *key; // owned, a key that waits for its value
    int key_line, key_column, line, column;
    int n_anchor, anchor_capacity;
    tree_anchor *anchor; // owned
    bool failed;
} tree_parse;

static void __attribute__((format(printf, 2, 3))) tree_refuse(tree_parse *parse, const char *format, ...) {
    va_list list;
    va_start(list, format);
    char *text = tree_format(format, list);
    va_end(list);
    tree_complain_at(parse->reader, parse->source, parse->line, parse->column, text);
    parse->failed = true;
}

// aliases become copies, which keep the positions of what they copy
static silt_tree *tree_copy(tree_parse *parse, const silt_tree *from, int depth) {
    if (depth > SCENE_DEPTH) {
        tree_refuse(parse, "syntax: found more than %d levels, allowed at most that", SCENE_DEPTH);
        return NULL;
    }
    silt_tree *node = tree_node(parse->reader, from->kind, from->source, from->line, from->column);
    if (!node) {
        parse->failed = true;
        return NULL;
    }
    node->quoted = from->quoted;
    node->text = from->text ? silt_text("%s", from->text) : NULL;
    for (int i = 0; i < from->n_item; i++) {
        silt_tree *item = tree_copy(parse, from->item[i], depth + 1);
        if (!item)
            return NULL;
        const silt_tree *old = from->item[i];
        item->key = old->key ? silt_text("%s", old->key) : NULL;
        item->key_source = old->key_source;
        item->key_line = old->key_line;
        item->key_column = old->key_column;
        tree_push(node, item);
    }
    return node;
}

static char *tree_token_text(struct fy_token *token, size_t *size) {
    *size = 0;
    const char *text = token ? fy_token_get_text(token, size) : NULL;
    char *copy = silt_alloc(*size + 1, 1);
    if (text && *size)
        memcpy(copy, text, *size);
    return copy;
}

// hangs a value under the open container, with the key that waits for it
static void tree_attach(tree_parse *parse, silt_tree *node) {
    silt_tree *parent = parse->depth ? parse->stack[parse->depth - 1] : NULL;
    if (!parent) {
        parse->root = node;
        return;
    }
    if (parent->kind == TREE_MAPPING) {
        node->key = parse->key;
        node->key_source = parse->source;
        node->key_line = parse->key_line;
        node->key_column = parse->key_column;
        parse->key = NULL;
    }
    tree_push(parent, node);
}

static void tree_anchored(tree_parse *parse, struct fy_event *event, silt_tree *node) {
    struct fy_token *token = fy_event_get_anchor_token(event);
    if (!token)
        return;
    size_t size;
    SILT_RESERVE(parse->anchor, parse->anchor_capacity, parse->n_anchor + 1);
    parse->anchor[parse->n_anchor++] = (tree_anchor){tree_token_text(token, &size), node};
}

static void tree_alias(tree_parse *parse, struct fy_event *event) {
    size_t size;
    char *name = tree_token_text(event->alias.anchor, &size);
    const silt_tree *from = NULL;
    // the last anchor of that name counts
    for (int i = parse->n_anchor - 1; i >= 0 && !from; i--)
        if (strcmp(parse->anchor[i].name, name) == 0)
            from = parse->anchor[i].node;
    if (!from) {
        tree_refuse(parse, "syntax: found the alias '*%s' without an anchor '&%s' before it", name, name);
    } else if (from->open) {
        tree_refuse(parse, "syntax: found the alias '*%s' inside of what it stands for, allowed: after its end", name);
    } else {
        silt_tree *node = tree_copy(parse, from, parse->depth);
        if (node)
            tree_attach(parse, node);
    }
    free(name);
}

static void tree_event(tree_parse *parse, struct fy_event *event) {
    // an empty value has no place of its own: it is where its key is
    const struct fy_mark *mark = fy_event_start_mark(event);
    const silt_source *source = &parse->reader->source[parse->source];
    if (mark) {
        parse->line = mark->line + 1;
        parse->column = mark->column + 1 + (mark->line == 0 ? source->shift : 0);
    } else if (parse->key) {
        parse->line = parse->key_line;
        parse->column = parse->key_column;
    }
    silt_tree *parent = parse->depth ? parse->stack[parse->depth - 1] : NULL;
    bool wants_key = parent && parent->kind == TREE_MAPPING && !parse->key;
    if (event->type >= FYET_MAPPING_START && fy_event_get_tag_token(event)) {
        tree_refuse(parse, "syntax: found a tag, allowed: values without one");
        return;
    }
    switch (event->type) {
    case FYET_DOCUMENT_START:
        if (parse->root)
            tree_refuse(parse, "syntax: found a second document, allowed: one scene per file");
        break;
    case FYET_SCALAR: {
        size_t size;
        char *text = tree_token_text(event->scalar.value, &size);
        if (strlen(text) != size) {
            tree_refuse(parse, "syntax: found a zero character in a text, allowed: any other");
            free(text);
        } else if (wants_key && strcmp(text, "<<") == 0) {
            tree_refuse(parse, "key '<<': found a merge key, allowed: the keys written out, or a plain alias as value");
            free(text);
        } else if (wants_key) {
            parse->key = text;
            parse->key_line = parse->line;
            parse->key_column = parse->column;
        } else {
            silt_tree *node = tree_node(parse->reader, TREE_SCALAR, parse->source, parse->line, parse->column);
            if (!node) {
                parse->failed = true;
                free(text);
                return;
            }
            node->text = text;
            node->quoted = event->scalar.value && fy_token_scalar_style(event->scalar.value) != FYSS_PLAIN;
            tree_attach(parse, node);
            tree_anchored(parse, event, node);
        }
        break;
    }
    case FYET_MAPPING_START:
    case FYET_SEQUENCE_START: {
        if (wants_key) {
            tree_refuse(parse, "syntax: found a list or block as a key, allowed: a name");
            return;
        }
        if (parse->depth == SCENE_DEPTH) {
            tree_refuse(parse, "syntax: found more than %d levels, allowed at most that", SCENE_DEPTH);
            return;
        }
        silt_tree_kind kind = event->type == FYET_MAPPING_START ? TREE_MAPPING : TREE_LIST;
        silt_tree *node = tree_node(parse->reader, kind, parse->source, parse->line, parse->column);
        if (!node) {
            parse->failed = true;
            return;
        }
        node->open = true;
        tree_attach(parse, node);
        tree_anchored(parse, event, node);
        parse->stack[parse->depth++] = node;
        break;
    }
    case FYET_MAPPING_END:
    case FYET_SEQUENCE_END:
        parse->stack[--parse->depth]->open = false;
        break;
    case FYET_ALIAS:
        if (wants_key)
            tree_refuse(parse, "syntax: found an alias as a key, allowed: a name");
        else
            tree_alias(parse, event);
        break;
    default:
        break;
    }
}

// the parser's own message and position
static void tree_syntax(tree_parse *parse, struct fy_diag *diag) {
    void *next = NULL;
    const struct fy_diag_error *error = fy_diag_errors_iterate(diag, &next);
    const silt_source *source = &parse->reader->source[parse->source];
    if (error && error->line > 0) {
        parse->line = error->line;
        parse->column = error->column + (error->line == 1 ? source->shift : 0);
    }
    // behind the only line of a -D: at its end
    if (parse->line == 2 && !memchr(source->text, '\n', source->size)) {
        parse->line = 1;
        parse->column = source->shift + (int)source->size + 1;
    }
    tree_refuse(parse, "syntax: %s", error && error->msg ? error->msg : "not YAML");
}

static void tree_quiet(struct fy_diag *diag, void *user, const char *text, size_t size) {
    (void)diag, (void)user, (void)text, (void)size;
}

// builds the tree of one source; NULL after a syntax error
static silt_tree *tree_parse_source(silt_reader *reader, int source) {
    tree_parse parse = {.reader = reader, .source = source, .line = 1, .column = 1};
    if (reader->source[source].size == 0)
        return NULL;
    struct fy_diag_cfg quiet;
    fy_diag_cfg_default(&quiet);
    quiet.fp = NULL;
    quiet.output_fn = tree_quiet;
    struct fy_diag *diag = fy_diag_create(&quiet);
    if (diag)
        fy_diag_set_collect_errors(diag, true);
    struct fy_parse_cfg config = {.flags = FYPCF_DEFAULT_PARSE, .diag = diag};
    struct fy_parser *parser = diag ? fy_parser_create(&config) : NULL;
    if (!parser || fy_parser_set_string(parser, reader->source[source].text, reader->source[source].size) != 0) {
        tree_refuse(&parse, "syntax: the YAML parser could not be started");
        goto cleanup;
    }
    for (struct fy_event *event; !parse.failed && (event = fy_parser_parse(parser));) {
        tree_event(&parse, event);
        fy_parser_event_free(parser, event);
    }
    if (!parse.failed && (fy_parser_get_stream_error(parser) || parse.depth > 0))
        tree_syntax(&parse, diag);
cleanup:
    fy_parser_destroy(parser);
    fy_diag_destroy(diag);
    free(parse.key);
    for (int i = 0; i < parse.n_anchor; i++)
        free(parse.anchor[i].name);
    free(parse.anchor);
    return parse.failed ? NULL : parse.root;
}

// the file ---------------------------------------------------------------------------------------------
static int tree_source(silt_reader *reader, char *name, char *text, size_t size, int shift) {
    SILT_RESERVE(reader->source, reader->source_capacity, reader->n_source + 1);
    reader->source[reader->n_source] = (silt_source){name, text, size, shift};
    return reader->n_source++;
}

// position of a byte
static void tree_position(const char *text, size_t at, int *line, int *column) {
    *line = 1;
    *column = 1;
    for (size_t i = 0; i < at; i++) {
        if (text[i] == '\n') {
            ++*line;
            *column = 1;
        } else if (((unsigned char)text[i] & 0xc0) != 0x80) {
            ++*column;
        }
    }
}

// first byte that is not part of well-formed UTF-8, or size
static size_t tree_not_utf8(const char *text, size_t size) {
    const unsigned char *c = (const unsigned char *)text;
    for (size_t i = 0; i < size;) {
        size_t n = c[i] < 0x80                   ? 1
                   : c[i] >= 0xc2 && c[i] < 0xe0 ? 2
                   : (c[i] & 0xf0) == 0xe0       ? 3
                   : c[i] >= 0xf0 && c[i] < 0xf5 ? 4
                                                 : 0;
        if (n == 0 || i + n > size)
            return i;
        for (size_t k = 1; k < n; k++)
            if ((c[i + k] & 0xc0) != 0x80)
                return i;
        // too long, surrogates, past the last code point
        if ((c[i] == 0xe0 && c[i + 1] < 0xa0) || (c[i] == 0xed && c[i + 1] > 0x9f) ||
            (c[i] == 0xf0 && c[i + 1] < 0x90) || (c[i] == 0xf4 && c[i + 1] > 0x8f))
            return i;
        i += n;
    }
    return size;
}

// the file's text as source 0; false with a complaint when it cannot be a scene
static bool tree_load(silt_reader *reader, const char *path) {
    char *problem = NULL, *text = silt_alloc(1, 1);
    size_t size = 0;
    int line = 1, column = 1;
    struct stat state;
    FILE *file = fopen(path, "rb");
    if (!file) {
        problem = silt_text("cannot be opened: %s", strerror(errno));
    } else if (fstat(fileno(file), &state) == 0 && S_ISDIR(state.st_mode)) {
        problem = silt_text("found a folder, allowed a YAML file");
    } else {
        // one byte more than allowed tells a larger file
        free(text);
        text = silt_alloc(SCENE_BYTES + 2, 1);
        size = fread(text, 1, SCENE_BYTES + 1, file);
        const char *zero = memchr(text, 0, size);
        size_t bad = 0;
        if (ferror(file)) {
            problem = silt_text("cannot be read: %s", strerror(errno));
        } else if (size > SCENE_BYTES) {
            problem = silt_text("found more than %d MB, allowed at most that", SCENE_BYTES >> 20);
            size = 0;
        } else if (zero) {
            tree_position(text, (size_t)(zero - text), &line, &column);
            problem = silt_text("found a zero byte (a binary file?), allowed YAML text");
            size = 0;
        } else if ((bad = tree_not_utf8(text, size)) < size) {
            tree_position(text, bad, &line, &column);
            problem = silt_text("found a byte that is not UTF-8, allowed YAML text in UTF-8");
            size = 0;
        }
    }
    if (file)
        fclose(file);
    tree_source(reader, silt_text("%s", path), text, size, 0);
    if (problem)
        tree_complain_at(reader, 0, line, column, problem);
    return problem == NULL;
}

// -D ---------------------------------------------------------------------------------------------------
// what a node offers to a path, for messages
static char *tree_offer(const silt_tree *node) {
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (!to)
        return silt_text("%s", "");
    if (node->kind == TREE_LIST && node->n_item == 0)
        fprintf(to, "nothing, the list is empty");
    else if (node->kind == TREE_LIST)
        fprintf(to, "0 to %d, or the name of an item", node->n_item - 1);
    else
        fprintf(to, "nothing below a plain value");
    fclose(to);
    return text;
}

// Puts a value at the path; missing blocks on the way are made.
static void tree_set(silt_reader *reader, int source, char *path, silt_tree *value) {
    silt_tree *node = reader->root;
    int column = 1;
    char *rest = path;
    while (rest) {
        char *part = strsep(&rest, ".");
        silt_tree *child = tree_child(node, part);
        bool missing = !child && node->kind == TREE_MAPPING && *part;
        if (!child && !missing) {
            char *offer = tree_offer(node);
            tree_complain_at(reader, source, 1, column,
                             silt_text("key '%s': found no item '%s', allowed %s", path, part,
                                       node->kind == TREE_MAPPING ? "a name between the dots" : offer));
            free(offer);
            return;
        }
        if (missing) {
            child = rest ? tree_node(reader, TREE_MAPPING, source, 1, column) : value;
            if (!child)
                return;
            child->key = silt_text("%s", part);
            child->key_source = source;
            child->key_line = 1;
            child->key_column = column;
            tree_push(node, child);
        } else if (!rest) {
            // the old value stays in the reader's list and dies with it
            value->key = child->key ? silt_text("%s", child->key) : NULL;
            value->key_source = source;
            value->key_line = 1;
            value->key_column = column;
            for (int i = 0; i < node->n_item; i++)
                if (node->item[i] == child)
                    node->item[i] = value;
        }
        // an empty block ("fluid:" without anything) may be filled
        if (rest && child->kind == TREE_SCALAR && !child->quoted && !*child->text)
            child->kind = TREE_MAPPING;
        node = child;
        column += (int)strlen(part) + 1;
        // put the dot back, for messages
        if (rest)
            rest[-1] = '.';
    }
}

static char *tree_begins(const silt_reader *reader, const char *found) {
    const char *first = reader->first ? reader->first : "silt";
    return silt_text("key '%s': found %s, allowed a %s, which begins with %s: 1", first, found, reader->what ? reader->what : "scene", first);
}

void silt_tree_read(silt_reader *reader, const char *path, int n_set, const char *const *set) {
    if (!tree_load(reader, path))
        return;
    reader->root = tree_parse_source(reader, 0);
    if (reader->n_complaint)
        return;
    if (!reader->root) {
        tree_complain_at(reader, 0, 1, 1, tree_begins(reader, "an empty file"));
        return;
    }
    if (reader->root->kind != TREE_MAPPING) {
        char *text = tree_begins(reader, "no keys");
        silt_complain(reader, reader->root, "%s", text);
        free(text);
        reader->root = NULL;
        return;
    }
    for (int i = 0; i < n_set; i++) {
        const char *equals = strchr(set[i], '=');
        size_t size = strlen(set[i]), bad = tree_not_utf8(set[i], size);
        int source = tree_source(reader, silt_text("-D %s", set[i]), silt_text("%s", set[i]), size, 0);
        if (!equals || equals == set[i] || bad < size) {
            tree_complain_at(reader, source, 1, 1,
                             silt_text("found no path=value, allowed for example fluid.size=0.01"));
            continue;
        }
        // only the value is YAML; its columns are counted in the whole text
        char *name = silt_text("%.*s", (int)(equals - set[i]), set[i]);
        char *whole = reader->source[source].text, *text = silt_text("%s", equals + 1);
        int line, column;
        tree_position(whole, (size_t)(equals + 1 - set[i]), &line, &column);
        reader->source[source].text = text;
        reader->source[source].size = strlen(text);
        reader->source[source].shift = column - 1;
        int before = reader->n_complaint;
        silt_tree *value = tree_parse_source(reader, source);
        reader->source[source] = (silt_source){reader->source[source].name, whole, size, 0};
        free(text);
        if (!value && reader->n_complaint == before)
            tree_complain_at(reader, source, 1, column,
                             silt_text("key '%s': found no value, allowed a YAML value", name));
        else if (value)
            tree_set(reader, source, name, value);
        free(name);
    }
}

// the keys of a study's file, its reading and what no single key can tell
#include <unistd.h>

#include "study.h"

#define AT(type, field)           .offset = offsetof(type, field)
#define MANY(type, number, field) .count = offsetof(type, number), .offset = offsetof(type, field)
#define POSITIVE                  .flags = KEY_OPEN_LOW, .low = 0, .high = HUGE_VAL
#define RANGE(from, to)           .low = (from), .high = (to)
#define DRAWN                     (1u << RANGE_LINEAR | 1u << RANGE_LOG | 1u << RANGE_RANDOM | 1u << RANGE_LOG_RANDOM)
#define FORM                      "what the key becomes, with the value in the place of %, for example \"[0, -%]\""

static const silt_word combine_words[] = {{"grid", COMBINE_GRID}, {"together", COMBINE_TOGETHER}, {0}};
static const silt_word keep_words[] = {{"nothing", KEEP_NOTHING}, {"bad", KEEP_BAD}, {"all", KEEP_ALL}, {0}};
static const silt_word scale_words[] = {{"linear", 0}, {"log", 1}, {0}};
static const silt_word plot_words[] = {
    {"time", PLOT_TIME}, {"order", PLOT_ORDER}, {"cost", PLOT_COST}, {"map", PLOT_MAP}, {0}};

static const silt_key with_rows[] = {
    {"key", KEY_TEXT, AT(study_with, key), .doc = "a key of the scene, as for -D"},
    {"factor", KEY_NUMBER, .fallback = "1", AT(study_with, factor), .doc = "on the value, which is then a number"},
    {"form", KEY_TEXT, .fallback = "%", AT(study_with, form), .doc = FORM},
    {0}};
static const silt_key_table with_table = {"a key that goes along", sizeof(study_with), with_rows, -1, false};

static const silt_key range_rows[] = {
    {"key", KEY_TEXT, AT(study_range, key), .doc = "a key of the scene, as for -D: fluid.size, bodies.temple.density"},
    {"form", KEY_TEXT, .fallback = "%", AT(study_range, form), .doc = FORM},
    {"values", KEY_TEXTS, .flags = KEY_CHOICE, .select = RANGE_VALUES, MANY(study_range, n_value, value),
     .doc = "one by one: numbers, words, lists"},
    {"linear", KEY_PAIR, .flags = KEY_CHOICE, .select = RANGE_LINEAR, AT(study_range, low),
     .doc = "`count` numbers at even distances, both ends among them"},
    {"log", KEY_PAIR, .flags = KEY_CHOICE, .select = RANGE_LOG, AT(study_range, low),
     .doc = "`count` numbers at even ratios, both ends among them"},
    {"random", KEY_PAIR, .flags = KEY_CHOICE, .select = RANGE_RANDOM, AT(study_range, low),
     .doc = "`count` random numbers between, by `seed`"},
    {"log_random", KEY_PAIR, .flags = KEY_CHOICE, .select = RANGE_LOG_RANDOM, AT(study_range, low),
     .doc = "`count` numbers with random logarithms"},
    {"count", KEY_INTEGER, RANGE(1, 10000), .when = DRAWN, AT(study_range, count), .doc = "how many values"},
    {"with", KEY_LIST, .flags = KEY_OPTIONAL, .sub = &with_table, MANY(study_range, n_with, with),
     .doc = "keys that take the same value"},
    {0}};
static const silt_key_table range_table = {"a range of a key", sizeof(study_range), range_rows,
                                           offsetof(study_range, kind), false};

static const silt_key bounds_rows[] = {
    {"volume", KEY_NUMBER, .fallback = "0.05", POSITIVE, AT(study, bounds.volume),
     .doc = "largest `volume_error` of history.csv; a run that says at its end that it is beyond its own bounds is `beyond-bounds`, not wrong"},
    {"mass", KEY_NUMBER, .fallback = "0.02", POSITIVE, AT(study, bounds.mass),
     .doc = "the same without the volume that is owed: what is really lost or gained"},
    {"sediment", KEY_NUMBER, .fallback = "1e-9", POSITIVE, AT(study, bounds.sediment),
     .doc = "largest `worst_sediment_error`"},
    {"energy", KEY_NUMBER, .fallback = "0.01", POSITIVE, AT(study, bounds.energy),
     .doc = "largest energy above that at the start and the work done from outside, as a share of what could move"},
    {0}};
static const silt_key_table bounds_table = {"what a run must keep", 0, bounds_rows, -1, false};

static const silt_key seek_rows[] = {
    {"key", KEY_TEXT, AT(study_seek, key), .doc = "a key of the scene, as for -D"},
    {"form", KEY_TEXT, .fallback = "%", AT(study_seek, form), .doc = FORM},
    {"range", KEY_PAIR, AT(study_seek, low), .doc = "between which values of the key it lies"},
    {"scale", KEY_WORD, .fallback = "linear", .words = scale_words, AT(study_seek, log),
     .doc = "what is halved: the range, or that of the logarithm"},
    {"check", KEY_TEXT, AT(study_seek, check), .doc = "name of a check of the scene that has a `scalar`"},
    {"value", KEY_NUMBER, AT(study_seek, value), .doc = "that the scalar shall have"},
    {"tolerance", KEY_NUMBER, .fallback = "0.01", POSITIVE, AT(study_seek, tolerance),
     .doc = "of the scalar, relative; absolute where `value` is 0"},
    {"runs", KEY_INTEGER, .fallback = "20", RANGE(3, 100), AT(study_seek, runs), .doc = "most runs of a search"},
    {"with", KEY_LIST, .flags = KEY_OPTIONAL, .sub = &with_table, MANY(study_seek, n_with, with),
     .doc = "keys that take the same value"},
    {0}};
static const silt_key_table seek_table = {"a search", sizeof(study_seek), seek_rows, -1, false};

static const silt_key plot_rows[] = {
    {"kind", KEY_WORD, .words = plot_words, AT(study_plot, kind),
     .doc = "time: error over run time with the Pareto front; order: error over x with the fitted order; cost: "
            "processor time over x; map: what became of "
            "the runs, over x and y"},
    {"name", KEY_NAME, AT(study_plot, name), .doc = "of the file, NAME.svg"},
    {"check", KEY_TEXT, .flags = KEY_OPTIONAL, AT(study_plot, check), .doc = "whose error; default: the first check"},
    {"x", KEY_TEXT, .flags = KEY_OPTIONAL, AT(study_plot, x),
     .doc = "column of study.csv; default: the first range, for cost nodes"},
    {"by", KEY_TEXT, .flags = KEY_OPTIONAL, AT(study_plot, by),
     .doc = "column of study.csv: a line, with its own order, for each of its values; for order and cost"},
    {"y", KEY_TEXT, .flags = KEY_OPTIONAL, AT(study_plot, y),
     .doc = "column of study.csv, for map; default: the second range"},
    {0}};
static const silt_key_table plot_table = {"a plot", sizeof(study_plot), plot_rows, -1, false};

static const silt_key study_rows[] = {
    {"study", KEY_INTEGER, RANGE(1, 1), AT(study, version), .doc = "version of these keys"},
    {"title", KEY_TEXT, .fallback = "", AT(study, title), .doc = "one line about the study"},
    {"scene", KEY_FILE, AT(study, scene), .doc = "the scene, a file beside the study or below it"},
    {"set", KEY_TEXTS, .flags = KEY_OPTIONAL, MANY(study, n_set, set),
     .doc = "path=value as for -D, the same in all runs"},
    {"vary", KEY_LIST, .flags = KEY_OPTIONAL, .sub = &range_table, MANY(study, n_range, range),
     .doc = "ranges of keys"},
    {"combine", KEY_WORD, .fallback = "grid", .words = combine_words, AT(study, combine),
     .doc = "every value of a range with every value of the others, or the first with the first, the second with the "
            "second, ..."},
    {"seed", KEY_INTEGER, .fallback = "1", RANGE(0, 2147483647), AT(study, seed), .doc = "of random values"},
    {"repeats", KEY_INTEGER, .fallback = "1", RANGE(1, 1000), AT(study, repeats),
     .doc = "runs of each point, for their times"},
    {"threads", KEY_INTEGER, .fallback = "1", RANGE(1, 1024), AT(study, threads), .doc = "of a run"},
    {"limit", KEY_NUMBER, .unit = "s", .fallback = "600", POSITIVE, AT(study, limit),
     .doc = "processor time of a run; and 20 times that plus a minute on the wall. A run that is stopped there is "
            "unfinished when it still made steps, hung when not"},
    {"memory", KEY_NUMBER, .unit = "GB", .fallback = "8", POSITIVE, AT(study, memory), .doc = "address space of a run"},
    {"bounds", KEY_BLOCK, .flags = KEY_OPTIONAL, .sub = &bounds_table, .presence = PRESENT_FLAG,
     .present = offsetof(study, bounds.on), .doc = "what a run that ends well must keep, or it is wrong"},
    {"keep", KEY_WORD, .fallback = "nothing", .words = keep_words, AT(study, keep),
     .doc = "output folders that stay: none, those of runs that did not end well, all"},
    {"seek", KEY_BLOCK, .flags = KEY_OPTIONAL, .sub = &seek_table, .presence = PRESENT_FLAG,
     .present = offsetof(study, seek.on), AT(study, seek),
     .doc = "at every point, a value of one more key by bisection"},
    {"plots", KEY_LIST, .flags = KEY_OPTIONAL, .sub = &plot_table, MANY(study, n_plot, plot),
     .doc = "default: time and cost, order over a range of sizes or steps, a map over two ranges"},
    {0}};
const silt_key_table study_keys = {"the study", sizeof(study), study_rows, -1, false};
_Static_assert(offsetof(study_range, high) == offsetof(study_range, low) + sizeof(double), "pair: low, high");
_Static_assert(offsetof(study_seek, high) == offsetof(study_seek, low) + sizeof(double), "pair: low, high");

// reading ----------------------------------------------------------------------------------------------
static bool keys_logarithm(const study_range *r) {
    return r->kind == RANGE_LOG || r->kind == RANGE_LOG_RANDOM;
}

static void keys_form(silt_reader *reader, const silt_tree *item, const char *path, const char *form) {
    if (form && !strchr(form, '%'))
        silt_complain(reader, silt_tree_item(item, "form"),
                      "key '%s.form': found '%s', allowed a text with %% in the place of the value", path, form);
}

static void keys_with(silt_reader *reader, const silt_tree *list, const char *path, int n, const study_with *with,
                      bool numbers) {
    for (int i = 0; i < n; i++) {
        char *below = silt_text("%s.with.%d", path, i);
        const silt_tree *item = list && i < list->n_item ? list->item[i] : NULL;
        keys_form(reader, item, below, with[i].form);
        if (with[i].factor != 1 && !numbers)
            silt_complain(reader, silt_tree_item(item, "factor"),
                          "key '%s.factor': found it on values that are no numbers, allowed with numbers", below);
        free(below);
    }
}

static void keys_range(silt_reader *reader, study_range *r, int i) {
    char *path = silt_text("vary.%d", i);
    const silt_tree *item = silt_tree_find(reader->root, "%s", path);
    bool numbers = true;
    for (int k = 0; k < r->n_value; k++) {
        double x;
        numbers &= silt_text_number(r->value[k], &x);
    }
    if (keys_logarithm(r) && !(r->low > 0))
        silt_complain(reader, silt_tree_item(item, r->kind == RANGE_LOG ? "log" : "log_random"),
                      "key '%s.%s': found the low end %g, allowed a number > 0, which has a logarithm", path,
                      r->kind == RANGE_LOG ? "log" : "log_random", r->low);
    keys_form(reader, item, path, r->form);
    keys_with(reader, silt_tree_item(item, "with"), path, r->n_with, r->with, numbers);
    free(path);
}

static void keys_check(silt_reader *reader, study *s) {
    const silt_tree *root = reader->root;
    if (s->scene && access(s->scene, R_OK) != 0)
        silt_complain(reader, silt_tree_item(root, "scene"),
                      "key 'scene': found '%s', which cannot be read, allowed a scene's file", s->scene);
    for (int i = 0; i < s->n_set; i++)
        if (!strchr(s->set[i], '=') || *s->set[i] == '=')
            silt_complain(reader, silt_tree_item(root, "set")->item[i],
                          "key 'set.%d': found '%s', allowed path=value, for example fluid.size=0.01", i, s->set[i]);
    for (int i = 0; i < s->n_range; i++)
        keys_range(reader, &s->range[i], i);
    for (int i = 1; i < s->n_range && s->combine == COMBINE_TOGETHER; i++) {
        const study_range *a = &s->range[0], *b = &s->range[i];
        const int n = a->kind == RANGE_VALUES ? a->n_value : a->count,
                  m = b->kind == RANGE_VALUES ? b->n_value : b->count;
        if (n != m)
            silt_complain(reader, silt_tree_find(root, "vary.%d", i),
                          "key 'vary.%d': found %d values, allowed %d as of the first range, since they go together", i,
                          m, n);
    }
    if (s->seek.on) {
        const silt_tree *seek = silt_tree_item(root, "seek");
        keys_form(reader, seek, "seek", s->seek.form);
        keys_with(reader, silt_tree_item(seek, "with"), "seek", s->seek.n_with, s->seek.with, true);
        if (s->seek.log && !(s->seek.low > 0))
            silt_complain(reader, silt_tree_item(seek, "range"),
                          "key 'seek.range': found the low end %g, allowed a number > 0, which has a logarithm",
                          s->seek.low);
        if (s->repeats > 1)
            silt_complain(reader, silt_tree_item(root, "repeats"),
                          "key 'repeats': found %d beside 'seek', allowed 1: a search has no repeats", s->repeats);
    } else if (s->n_range == 0)
        silt_complain(
            reader, root,
            "key 'vary': found neither it nor 'seek', allowed a list of ranges: a study of one run is silt run");
    double n = 1;
    for (int i = 0; i < s->n_range && s->combine == COMBINE_GRID; i++)
        n *= s->range[i].kind == RANGE_VALUES ? s->range[i].n_value : s->range[i].count;
    if (n * s->repeats > 100000)
        silt_complain(reader, silt_tree_item(root, "vary"), "key 'vary': found %.0f runs, allowed at most 100000",
                      n * s->repeats);
}

silt_status study_read(study *s, const silt_study_def *def, silt_error *err) {
    *s = (study){.path = silt_text("%s", def->path)};
    const char *slash = strrchr(def->path, '/');
    s->folder = slash == def->path ? silt_text("/")
                : slash            ? silt_text("%.*s", (int)(slash - def->path), def->path)
                                   : silt_text(".");
    silt_reader reader = {.folder = s->folder, .what = "study", .first = "study"};
    silt_tree_read(&reader, def->path, def->n_set, def->set);
    if (reader.root) {
        silt_keys_read(&reader, &study_keys, s);
        if (!s->bounds.on) {
            s->bounds.volume = 0.05;
            s->bounds.mass = 0.02;
            s->bounds.sediment = 1e-9;
            s->bounds.energy = 0.01;
        }
        if (reader.n_complaint == 0)
            keys_check(&reader, s);
    }
    const silt_status status = silt_complaints_report(&reader, err);
    silt_reader_clear(&reader);
    return status;
}

void study_clear(study *s) {
    for (int i = 0; i < s->n_range; i++) {
        for (int k = 0; k < s->range[i].n_text; k++)
            free(s->range[i].text[k]);
        free(s->range[i].text);
    }
    silt_keys_free(&study_keys, s);
    free(s->path);
    free(s->folder);
}

silt_status silt_study_help(const char *key, FILE *to, silt_error *err) {
    return silt_keys_help(&study_keys, key, "silt help study", to, err);
}

void silt_study_document(FILE *to) {
    silt_keys_document(&study_keys, to);
}

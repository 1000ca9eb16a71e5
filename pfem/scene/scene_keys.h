/** @file scene_keys.h
 * The inside of the scene reader, shared by scene_*.c only: the table of keys, the YAML text as a tree with positions,
 * and the list of complaints. Flow: tree (text, -D) -> read (tree + table -> struct) -> check (what no single key can
 * tell)
 * -> write (struct + table -> resolved text).
 */
#ifndef SILT_SCENE_KEYS_H
#define SILT_SCENE_KEYS_H

#include "scene.h"

// defaults of the bounds block, as YAML
#define BOUNDS_VOLUME "0.05"
#define BOUNDS_MASS "0.02"
#define BOUNDS_ENERGY "0.01"

// the table of keys ----------------------------------------------------------------------------------
typedef enum {
    KEY_NUMBER = 1, // double
    KEY_INTEGER,    // int
    KEY_LONG,       // int64_t
    KEY_SWITCH,     // bool
    KEY_WORD,       // int (an enum), one of words
    KEY_SET,        // int, bits of any of words
    KEY_SIGN,       // double, one of words
    KEY_TEXT,       // char *
    KEY_NAME,       // char *, letters, digits, underscores
    KEY_FILE,       // char *, made absolute
    KEY_SURFACE,    // char *, made absolute, a triangulated surface
    KEY_SERIES,     // silt_series, read from a CSV over rising time
    KEY_TABLE,      // silt_series, read from a CSV in any order
    KEY_CURVE,      // silt_series, a number or a CSV over rising time
    KEY_POINT,      // double[3], as many numbers as dimensions
    KEY_PLACE,      // double[3], a place seen from above: a number in 2-D, [x, y] in 3-D
    KEY_PAIR,       // double[2]
    KEY_ACROSS,     // double[6], a pair that goes to the second and the fifth
    KEY_SEGMENT,    // double[6], two different points
    KEY_BOX,        // double[6], two opposite corners, the lower first
    KEY_CHAIN,      // int at count, double * of 3 per point: at least 2 points
    KEY_POLYGON,    // int at count, double * of 3 per point: at least 3 points [x, y] (3-D: [x, z]), made counter-clockwise
    KEY_CORNERS,    // int at count, double * of 3 per point: at least 3 points [x, y, z]
    KEY_BLOCK,      // mapping
    KEY_LIST,       // int at count, array of structs: sequence of mappings
    KEY_TEXTS,      // int at count, char ** at offset: values of any kind, as the text that -D takes
} silt_key_kind;

enum {
    KEY_OPEN_LOW = 1,   // low itself is not allowed
    KEY_OPEN_HIGH = 2,  // high itself is not allowed
    KEY_INFINITE = 4,   // .inf is allowed
    KEY_CHOICE = 8,     // exactly one of the choices of its table is given; sets the selector to `select`
    KEY_SELECTOR = 16,  // its value is the selector of its table
    KEY_SHORTHAND = 32, // never written back: another key holds the same
    KEY_OPTIONAL = 64,  // list, block or pair that may be absent; text without default
    KEY_PLANE = 128,    // in two dimensions only
    KEY_SPACE = 256,    // in three dimensions only
};

/** how to see in the struct whether a block was there */
typedef enum {
    PRESENT_ALWAYS = 0,
    PRESENT_FLAG,
    PRESENT_WORD,
    PRESENT_TEXT,
    ABSENT_TEXT, // a value, not a block: only where that text is not there, since the value was made from it
} silt_presence;

typedef struct silt_word {
    const char *text; // NULL ends the list
    int value;
} silt_word;

typedef struct silt_key_table silt_key_table;
typedef struct silt_key {
    const char *name;
    silt_key_kind kind;
    unsigned flags;
    const char *unit;
    const char *fallback; // default as YAML; NULL: required; ".nan": none; "=block.key": the value of that key
    double low, high;     // range; both 0: any
    const silt_word *words;
    size_t offset, count;      // in the struct of the table
    const silt_key_table *sub; // of blocks and lists
    silt_presence presence;
    size_t present; // offset of the flag, word or text
    unsigned when;  // bits of the selector's values for which the key is used; 0: always
    int select;
    const char *doc;
} silt_key;

struct silt_key_table {
    const char *what;    // one item, for messages: "a region"
    size_t size;         // of the struct
    const silt_key *key; // ends with a row without name
    int selector;        // offset of an int that says which rows with `when` are used, -1: none
    bool loose;          // none of its choices need be given
};

extern const silt_key_table silt_scene_keys;
/** row of that name, or NULL */
const silt_key *silt_key_find(const silt_key_table *table, const char *name);
/** range, words or form of a key in words: "a number in m, > 0"; owned by the caller */
char *silt_key_allowed(const silt_key *key, int dimension);
/** counts in a scene of that dimension (0: not known) */
static inline bool silt_key_fits(const silt_key *key, int dimension) {
    return !((key->flags & KEY_PLANE && dimension == 3) || (key->flags & KEY_SPACE && dimension == 2));
}
/** the nearest of the table's names, or NULL when none is near */
const char *silt_key_nearest(const silt_key_table *table, const char *name);
const char *silt_word_nearest(const silt_word *words, const char *text);
/** the smaller of edit distance (swaps count once) and limit + 1 */
int silt_text_distance(const char *a, const char *b, int limit);
/** a YAML 1.2 number: decimal, .inf or .nan */
bool silt_text_number(const char *text, double *value);

// the text as a tree -----------------------------------------------------------------------------------
typedef enum { TREE_SCALAR = 1, TREE_LIST, TREE_MAPPING } silt_tree_kind;
typedef struct silt_tree {
    silt_tree_kind kind;
    bool quoted, open;        // scalar in quotes; container not yet closed
    int source, line, column; // of the value, from 1
    int key_source, key_line, key_column;
    char *key;  // owned, in a mapping
    char *text; // owned, scalar
    int n_item, capacity;
    struct silt_tree **item; // owned array, items owned by the reader
} silt_tree;

enum { SCENE_COMPLAINTS = 50, SCENE_DEPTH = 64, SCENE_NODES = 1000000, SCENE_BYTES = 8 << 20, SCENE_CORNERS = 20000, SCENE_GRAINS = 2000000 };

typedef struct silt_source {
    char *name, *text; // owned
    size_t size;
    int shift; // columns before the text's first one (-D path=)
} silt_source;
typedef struct silt_complaint {
    int source, line, column, order;
    char *text; // owned
} silt_complaint;

/** everything that lives while a scene is read */
typedef struct silt_reader {
    int n_source, source_capacity;
    silt_source *source; // 0 the file, then one per -D
    int n_node, node_capacity;
    silt_tree **node; // owned, all of them
    silt_tree *root;
    int n_complaint; // may pass SCENE_COMPLAINTS, the rest is only counted
    silt_complaint complaint[SCENE_COMPLAINTS];
    const char *folder; // borrowed from the scene
    const char *what, *first; // what such a file is and the key that it begins with; NULL: a scene, silt
} silt_reader;

/** Reads the file and the -D texts into reader->root. Syntax errors and -D errors become complaints. */
void silt_tree_read(silt_reader *reader, const char *path, int n_set, const char *const *set);
void silt_reader_clear(silt_reader *reader);
silt_tree *silt_tree_item(const silt_tree *mapping, const char *key); // NULL when absent, or when mapping is NULL
/** the node at a path like "bodies.0.name", or NULL */
silt_tree *silt_tree_find(const silt_tree *root, const char *format, ...) __attribute__((format(printf, 2, 3)));

/** a value as -D takes it: lists and blocks on one line, a scalar as it stands; owned by the caller */
char *silt_tree_text(const silt_tree *node);

/** Adds a complaint at the node's value (or at its key). Text: "key 'a.b': found ..., allowed ..." */
void silt_complain(silt_reader *reader, const silt_tree *node, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void silt_complain_key(silt_reader *reader, const silt_tree *node, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/** All complaints in the order of the text, each with its line and a caret, into err. SILT_OK when there are none. */
silt_status silt_complaints_report(silt_reader *reader, silt_error *err);

// files with another table than the scene's (studies) ------------------------------------------------------
/** fills the struct of the table from reader->root; complaints as for a scene */
void silt_keys_read(silt_reader *reader, const silt_key_table *table, void *base);
/** frees what stands in the struct */
void silt_keys_free(const silt_key_table *table, void *base);
/** silt_scene_help and the tables of silt_scene_document for any table. @param list  what prints them all, for the message */
silt_status silt_keys_help(const silt_key_table *table, const char *key, const char *list, FILE *to, silt_error *err);
void silt_keys_document(const silt_key_table *table, FILE *to);

// checks over several keys, and writing ------------------------------------------------------------------
/** What a polygon of the scene must be: no corner twice in a row, no crossing, some area; turned counter-clockwise. A
 * complaint is made at the item of `corners` in question, or at `whole` where that is NULL; where: text before ", allowed".
 * @return true when sound */
bool silt_polygon_sound(silt_reader *reader, const silt_tree *whole, const silt_tree *corners, const char *path, int n,
                        double *point);
/** Reads the tables that the scene names and checks what they hold; settles the defaults that hang on other keys. */
void silt_scene_settle(silt_reader *reader, silt_scene *scene);
void silt_scene_check(silt_reader *reader, silt_scene *scene);
/** Inlets and outlets (scene_openings.c). @param lo, hi  of the box that walls and water span, hi < lo: not known */
void silt_scene_check_openings(silt_reader *reader, const silt_scene *scene, const double lo[3], const double hi[3]);
/** Rigid objects (scene_bodies.c) */
void silt_scene_check_bodies(silt_reader *reader, const silt_scene *scene);
/** A complaint at the node where lo to hi, of a body, leaves what walls and water span by more than slack (scene_check.c) */
void silt_scene_check_within(silt_reader *reader, const silt_scene *scene, const silt_tree *node, const double *lo, const double *hi,
                             double slack, int body);
/** a body's outline in place: a polygon, or a circle when n_point is 0; in space a sphere around it */
typedef struct silt_body_shape {
    int dim, n_point;
    double *point;            // owned
    double centre[3], radius; // circumscribed; the circle itself
} silt_body_shape;
silt_body_shape silt_body_shape_make(const silt_scene *scene, const silt_body_def *body);
/** true where a circle or sphere of that radius at x meets it */
bool silt_body_shape_near(const silt_body_shape *shape, const double *x, double radius);
/** What moves bodies (scene_motion.c). */
void silt_scene_check_motion(silt_reader *reader, const silt_scene *scene);
/** true where a grain of that radius at x touches no wall, bed or body */
typedef bool silt_fill_clear(const void *context, const double *x, double radius);
/** Grains of the list that stand in each other, in a wall, the bed or a body: contacts would throw them apart (fill.c). Fixed ones may. */
void silt_scene_check_grains(silt_reader *reader, const silt_scene *scene, silt_fill_clear *clear, const void *context);
/** Fills grains.regions into grains.filled; a complaint where more is asked for than fits (fill.c). */
void silt_scene_fill(silt_reader *reader, silt_scene *scene, silt_fill_clear *clear, const void *context);
/** the resolved scene as YAML; owned by the caller. names: files with their folder (true), or their last part only */
char *silt_scene_text(const silt_scene *scene, bool folders);
uint64_t silt_scene_hash(const silt_scene *scene); // scene_hash.c

#endif

/** @file draw.h
 * The inside of `silt draw`, shared by draw*.c only: the canvas, colours and texts; plane pictures and pictures of
 * space.
 */
#ifndef SILT_DRAW_H
#define SILT_DRAW_H

#include <cairo.h>

#include "output.h"
#include "solid.h"

// pixels: the picture's largest width, the plot's largest and smallest height, the margins around the plot
enum { PICTURE_WIDTH = 1600, PLOT_HEIGHT = 1000, PLOT_LOW = 220, PLOT_NARROW = 420 };
enum { MARGIN_LEFT = 84, MARGIN_BAR = 132, MARGIN_RIGHT = 24, MARGIN_TOP = 58, MARGIN_BOTTOM = 66 };

// frames that are looked at to fix the extent and the colour range for all pictures of a run
#define DRAW_SAMPLES 16
// share of the values that the colour bar covers: a few flung nodes shall not wash out the rest
#define DRAW_QUANTILE 0.995

typedef struct silt_draw_colour {
    double r, g, b;
} silt_draw_colour;

/** values that no array holds */
typedef enum { MADE_LENGTH = 0, MADE_ELEVATION, MADE_VORTICITY } silt_draw_made;

typedef struct silt_draw_field {
    const char *name, *label;
    const char *water;   // array of the fluid that colours it
    const char *bed;     // array of the bed that colours it, else its density in sand colours
    silt_draw_made made; // what is made of the array
    const unsigned *map;
    int n_map;
} silt_draw_field;

/** what a picture may show or leave out */
typedef enum { DRAW_WATER = 1, DRAW_BED = 2, DRAW_GRAINS = 4, DRAW_BODIES = 8, DRAW_WALLS = 16 } silt_draw_part;

typedef struct silt_draw_forms silt_draw_forms; // draw_form.c

/** fixed for all pictures of a run, then the picture being drawn */
typedef struct silt_draw_canvas {
    const char *out;
    const silt_scene *scene;
    const silt_draw_forms *forms; // of the bodies; NULL: as the frames have them
    silt_walls *walls; // of the scene, moved to the time of the picture; NULL: none
    unsigned without;  // silt_draw_part: what is left out
    const silt_draw_field *field;
    double lo[3], hi[3]; // m, the plot's extent; in 3-D the box that is shown
    int slice;           // 3-D: 1 to 3: a cut across x, y or z, drawn in the plane; 0: none
    double slice_at;     // m
    double low, high;    // colour range
    bool plain;          // nothing is coloured by value: no colour bar
    double density;      // kg/m3, largest density of the bed
    double scale;        // pixels per metre
    int width, height;   // of the plot, pixels
    int right;           // margin with or without a colour bar, pixels
    cairo_surface_t *surface;
    cairo_t *cr;
} silt_draw_canvas;

// draw.c: the canvas of a run
/** what stays from picture to picture, owned by who opened it */
typedef struct silt_draw_book {
    silt_scene *scene;
    silt_walls walls;
    silt_draw_forms *forms;
    silt_frame_entry *entry;
    int n_frame;
} silt_draw_book;
/** Finds the run's frames, reads its scene, fixes extent, colours and size of the pictures. Errors: SILT_INPUT for what cannot be drawn so,
 * SILT_FAILED without frames. @param frame  of def is not looked at */
silt_status silt_draw_open(silt_draw_canvas *c, silt_draw_book *book, const char *out, const silt_draw_def *def, silt_error *err);
void silt_draw_close(silt_draw_book *book);
/** the picture of a frame, owned by the caller */
cairo_surface_t *silt_draw_picture(silt_draw_canvas *c, const silt_frame_entry *entry);
static inline bool silt_draw_shows(const silt_draw_canvas *c, silt_draw_part part) { return !(c->without & (unsigned)part); }

// draw_form.c
/** the surfaces of the scene's bodies in space; NULL where there are none */
void silt_draw_forms_make(silt_draw_forms **forms, const silt_scene *scene, const char *out);
void silt_draw_forms_free(silt_draw_forms **forms);
/** Body's surface at a time of history.csv. *point: its points there, owned by the caller. @return NULL: not known */
const silt_solid *silt_draw_form(const silt_draw_forms *forms, const silt_scene *scene, int body, double time, double **point);

/** silt_draw_read of the bodies, in space with those surfaces where they are known */
bool silt_draw_bodies(const silt_draw_canvas *c, const silt_frame_entry *entry, silt_grid *grid);

// draw_film.c
/** All frames as one moving picture. The file's ending says which kind: mp4, webm, webp, gif; made by ffmpeg, which must be
 * installed. */
silt_status silt_draw_film(silt_draw_canvas *c, const silt_draw_book *book, const char *path, silt_error *err);

// draw_ink.c: colours, texts, the colour bar
silt_draw_colour silt_draw_hex(unsigned c);
/** colour at s in [0, 1] of a table */
silt_draw_colour silt_draw_mix(const unsigned *table, int n, double s);
void silt_draw_ink(cairo_t *cr, unsigned c);
/** the field's colour of a value */
silt_draw_colour silt_draw_value(const silt_draw_canvas *c, double value);
/** 1, 2 or 5 times a power of ten: the smallest step that is at least `least` */
double silt_draw_step(double least);
/** align -1: x is the left end, 0: the middle, 1: the right end; y is the middle of the digits */
void silt_draw_text(cairo_t *cr, double x, double y, int align, double size, bool bold, const char *text);
/** digits after the point that a step needs */
void silt_draw_number(char text[32], double value, double step);
void silt_draw_bar(silt_draw_canvas *c);
/** array that colours the grains, where there is no water to show it; NULL: none */
const char *silt_draw_grain_array(const silt_draw_canvas *c);
/** The grid of a frame, or its cut (bodies are not cut), with one value a point: a vector's length, or what the field makes.
 * @return false: no such file, or the part is left out */
bool silt_draw_read(const silt_draw_canvas *c, silt_grid *grid, const char *part, int number, const char *array);
/** takes the values of the points with counts[i] into the colour range */
void silt_draw_range(silt_draw_canvas *c, const silt_grid *grid, const bool *counts);
/** makes the ends of the range round */
void silt_draw_range_round(silt_draw_canvas *c);

// draw_flat.c and draw_space.c: pictures of two and of three dimensions
/** extent and colour range over some frames of the whole run, then the plot's size in pixels */
void silt_draw_flat_survey(silt_draw_canvas *c, const silt_frame_entry *entry, int n_frame);
void silt_draw_flat(silt_draw_canvas *c, const silt_frame_entry *entry);
/** Edges of the triangles: those of one triangle only, or all, once each. @return how many; owned by the caller */
int silt_draw_edges(const silt_grid *grid, bool all, int (**edge)[2]);
// draw_slice.c
/** puts the cut through the canvas' plane in place of a grid of tetrahedra */
void silt_draw_slice(const silt_draw_canvas *c, silt_grid *grid);
/** the same for grains: the circles in which the plane cuts them */
void silt_draw_slice_grains(const silt_draw_canvas *c, silt_grid *grid);
/** Faces of bodies as lines in the canvas' plane, m. @return how many; owned by the caller */
int silt_draw_slice_faces(const silt_draw_canvas *c, const silt_grid *grid, double (**line)[4]);
/** Walls as lines in the picture's plane, m: those that move (2-D), or the cut ones. @return how many; owned by the
 * caller */
int silt_draw_lines(const silt_draw_canvas *c, double (**line)[4]);
/** faces of tetrahedra that no other one has, counter-clockwise from outside. @return how many; owned by the caller */
int silt_draw_outside(const silt_grid *grid, int (**face)[3]);
/** an edge of a wall in space that shows: at the border, or where the wall bends by more than 20 degrees */
bool silt_draw_sharp(const silt_walls *walls, int element, int edge);
void silt_draw_space_survey(silt_draw_canvas *c, const silt_frame_entry *entry, int n_frame);
void silt_draw_space(silt_draw_canvas *c, const silt_frame_entry *entry);

#endif

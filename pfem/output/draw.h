/** @file draw.h
 * The inside of `silt draw`, shared by draw*.c only: the canvas, colours and texts; plane pictures and pictures of
 * space.
 */
#ifndef SILT_DRAW_H
#define SILT_DRAW_H

#include <cairo.h>

#include "output.h"

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

/** fixed for all pictures of a run, then the picture being drawn */
typedef struct silt_draw_canvas {
    const char *out;
    const silt_scene *scene;
    silt_walls *walls; // of the scene, moved to the time of the picture; NULL: none
    const silt_draw_field *field;
    double lo[3], hi[3]; // m, the plot's extent; in 3-D the box that is shown
    int slice;           // 3-D: 1 to 3: a cut across x, y or z, drawn in the plane; 0: none
    double slice_at;     // m
    double low, high;    // colour range
    double density;      // kg/m3, largest density of the bed
    double scale;        // pixels per metre
    int width, height;   // of the plot, pixels
    int right;           // margin with or without a colour bar, pixels
    cairo_surface_t *surface;
    cairo_t *cr;
} silt_draw_canvas;

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
/** The grid of a frame, or its cut, with one value a point: a vector's length, or what the field makes.
 * @return false: no such file */
bool silt_draw_read(const silt_draw_canvas *c, silt_grid *grid, const char *part, int number, const char *array);
/** takes the values of the points with counts[i] into the colour range */
void silt_draw_range(silt_draw_canvas *c, const silt_grid *grid, const bool *counts);
/** makes the ends of the range round */
void silt_draw_range_round(silt_draw_canvas *c);

// draw_flat.c and draw_space.c: pictures of two and of three dimensions
/** extent and colour range over some frames of the whole run, then the plot's size in pixels */
void silt_draw_flat_survey(silt_draw_canvas *c, const silt_frame_entry *entry, int n_frame);
void silt_draw_flat(silt_draw_canvas *c, const silt_frame_entry *entry);
// draw_slice.c
/** puts the cut through the canvas' plane in place of a grid of tetrahedra */
void silt_draw_slice(const silt_draw_canvas *c, silt_grid *grid);
/** Walls as lines in the picture's plane, m: those that move (2-D), or the cut ones. @return how many; owned by the
 * caller */
int silt_draw_lines(const silt_draw_canvas *c, double (**line)[4]);
void silt_draw_space_survey(silt_draw_canvas *c, const silt_frame_entry *entry, int n_frame);
void silt_draw_space(silt_draw_canvas *c, const silt_frame_entry *entry);

#endif

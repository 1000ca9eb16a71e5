/** @file plot.h
 * Small plots over an abscissa as inline SVG, for the report.
 */
#ifndef SILT_PLOT_H
#define SILT_PLOT_H

#include "output.h"

enum { PLOT_LINES = 12 };

typedef struct silt_plot_line {
    const char *name;
    int n;
    const double *x, *y; // borrowed; a NaN ordinate is a gap
    bool dots;           // single points, else a line
} silt_plot_line;

typedef struct silt_plot {
    const char *title, *across, *up; // the latter two label the axes; NULL: none
    int n;
    silt_plot_line line[PLOT_LINES];
    bool banded;
    double band[2]; // banded: ordinates that are allowed; may be infinite; equal: a value that is wanted
    double span[2]; // of the abscissa where they are; equal and banded: a mark there
    bool cropped;
    double crop[2]; // cropped: of the abscissa that is shown
} silt_plot;

/** no line has a number to show */
bool silt_plot_empty(const silt_plot *plot);
void silt_plot_svg(FILE *to, const silt_plot *plot);
/** text with what HTML reads as marks replaced */
void silt_html_text(FILE *to, const char *text);

#endif

/* Factors along a track: on both friction coefficients by distance, under either wheel, and by
 * time; and on the initial slope of the creep force by distance. And its grade by distance.
 *
 * A profile is piecewise linear and constant beyond its ends. A place given twice is a jump; its
 * second value holds there. */
#ifndef TRACK_H
#define TRACK_H

#include <stddef.h>

typedef struct {
    size_t count;
    const double *at, *value; /* count elements each; at rises */
} profile;

typedef struct {
    profile left, right; /* over distance [m] */
    profile over_time;   /* for both wheels [s] */
    profile slope;       /* for both wheels, over distance [m] */
    profile grade;       /* rise over distance, over distance [m] */
    double scale;        /* on friction under both wheels everywhere [1] */
} track;

#endif

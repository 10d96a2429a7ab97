/* Factors along a track: on both friction coefficients by distance, under either wheel, and by
 * time; and on the initial slope of the creep force by distance. And its grade by distance. In
 * place of the factors by distance there may be the largest traction coefficients.
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

/* Friction factors over the largest traction coefficients that they give a wheel, at places that
 * are evenly spaced in the logarithms of that coefficient [1], of the speed [m/s], of the load of
 * all wheels, if all were loaded like this one [N], and of the factor on the slope [1]. */
enum { PEAK_AXES = 4, STENCIL = 4 };
typedef struct {
    double first[PEAK_AXES], step[PEAK_AXES], count[PEAK_AXES];
    double branches;     /* the largest of their values holds */
    const double *value; /* of one branch after the other; the last axis varies fastest */
} peak_map;

typedef struct {
    profile left, right;   /* over distance [m] */
    profile over_time;     /* for both wheels [s] */
    profile slope;         /* for both wheels, over distance [m] */
    profile grade;         /* rise over distance, over distance [m] */
    double scale;          /* on friction under both wheels everywhere [1] */
    const peak_map *peaks; /* of left and right; NULL: they are factors on friction */
} track;

#endif

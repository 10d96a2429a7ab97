/* Friction along a track: factors on both coefficients by distance, under either wheel, and by
 * time.
 *
 * A profile is piecewise linear and constant beyond its ends; a place given twice is a jump, where
 * the value is the one from it on. */
#ifndef TRACK_H
#define TRACK_H

#include <stddef.h>

typedef struct {
    size_t count;
    const double *at, *value; /* count of each, the places rising */
} profile;

typedef struct {
    profile left, right; /* over distance [m] */
    profile over_time;   /* for both wheels [s] */
} track;

/* Factors under the left and the right wheel. */
void track_friction(const track *rails, double distance, double time, double friction[2]);

/* Time until a profile has a corner or a jump, at a constant speed; may be infinite. Who starts
 * from rest meets a corner where its step ends. */
double track_until_change(const track *rails, double distance, double speed, double time);

#endif

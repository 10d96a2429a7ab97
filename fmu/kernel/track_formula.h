/* Formulas of the factors along a track (track.h). */
#ifndef TRACK_FORMULA_H
#define TRACK_FORMULA_H

#include <math.h>

#include "track.h"

static const double NEAR = 1e-9; /* a place closer than that counts as reached [m, s] */

/* Number of the profile's places that are not beyond a place. */
static inline size_t passed(const profile *p, double place) {
    size_t low = 0, high = p->count;
    while (low < high) {
        size_t middle = (low + high) / 2;
        if (p->at[middle] <= place) low = middle + 1;
        else high = middle;
    }
    return low;
}

static inline double profile_value(const profile *p, double place) {
    size_t next = passed(p, place);
    if (next == 0) return p->value[0];
    if (next == p->count) return p->value[p->count - 1];
    double from = p->at[next - 1], part = (place - from) / (p->at[next] - from);
    return p->value[next - 1] + part * (p->value[next] - p->value[next - 1]);
}

/* Factors on friction under the left and the right wheel, and on the slope; and the grade. */
static inline void track_factors(const track *rails, double distance, double time,
                                 double factor[4]) {
    double over_time = rails->scale * profile_value(&rails->over_time, time);
    factor[0] = over_time * profile_value(&rails->left, distance);
    factor[1] = over_time * profile_value(&rails->right, distance);
    factor[2] = profile_value(&rails->slope, distance);
    factor[3] = profile_value(&rails->grade, distance);
}

static inline double distance_ahead(const profile *p, double distance) {
    size_t next = passed(p, distance + NEAR);
    return next < p->count ? p->at[next] - distance : INFINITY;
}

static inline double distance_behind(const profile *p, double distance) {
    size_t next = passed(p, distance - NEAR);
    if (next > 0 && p->at[next - 1] == distance - NEAR) next--; /* this one is reached */
    return next > 0 ? distance - p->at[next - 1] : INFINITY;
}

/* Time at a constant speed until a profile has a corner or a jump; may be infinite. For a vehicle
 * at rest only the profile over time counts. */
static inline double track_until_change(const track *rails, double distance, double speed,
                                        double time) {
    const profile *along[] = {&rails->left, &rails->right, &rails->slope, &rails->grade};
    double found = distance_ahead(&rails->over_time, time);
    for (size_t i = 0; speed != 0.0 && i < sizeof along / sizeof *along; i++) {
        double way =
            speed > 0.0 ? distance_ahead(along[i], distance) : distance_behind(along[i], distance);
        found = fmin(found, way / fabs(speed));
    }
    return found;
}

#endif

/* Formulas of the factors along a track (track.h). */
#ifndef TRACK_FORMULA_H
#define TRACK_FORMULA_H

#include <math.h>

#include "simd_math.h"
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

/* Sum over the places of an axis and all that follow, by the polynomials through the nearest ones.
 */
static inline double peak_sum(const peak_map *map, const double *place, int axis, size_t index) {
    if (axis == PEAK_AXES) return map->value[index];
    double count = map->count[axis], points = smaller(count, STENCIL), sum = 0.0;
    double from = smaller(larger(floor(place[axis]) - 1.0, 0.0), count - points);
    for (double i = 0.0; i < points; i += 1.0) {
        double weight = 1.0;
        for (double k = 0.0; k < points; k += 1.0)
            if (k != i) weight *= (place[axis] - from - k) / (i - k);
        size_t next = index * (size_t)count + (size_t)(from + i);
        sum += weight * peak_sum(map, place, axis + 1, next);
    }
    return sum;
}

/* Value of a map; beyond its ends that at them. */
static inline double peak_factor(const peak_map *map, const double at[PEAK_AXES]) {
    double place[PEAK_AXES];
    for (int axis = 0; axis < PEAK_AXES; axis++) {
        double log = logarithm(larger(at[axis], 1e-300)) - map->first[axis];
        place[axis] = smaller(larger(log / map->step[axis], 0.0), map->count[axis] - 1.0);
    }
    double first = peak_sum(map, place, 0, 0);
    return map->branches > 1.0 ? larger(first, peak_sum(map, place, 0, 1)) : first;
}

/* Whether both wheels meet the same friction. */
static inline int has_equal_sides(const track *rails) {
    return rails->left.at == rails->right.at && rails->left.value == rails->right.value;
}

/* Where a wheel is, and how it rolls there. */
typedef struct {
    double distance, time, speed, load[2]; /* loads of all wheels as in peak_map */
} track_place;

/* Factors on friction under the left and the right wheel, and on the slope; and the grade. */
static inline void track_factors(const track *rails, const track_place *at, double factor[4]) {
    double over_time = rails->scale * profile_value(&rails->over_time, at->time);
    factor[0] = profile_value(&rails->left, at->distance);
    factor[1] = has_equal_sides(rails) ? factor[0] : profile_value(&rails->right, at->distance);
    factor[2] = profile_value(&rails->slope, at->distance);
    factor[3] = profile_value(&rails->grade, at->distance);
    for (int side = 0; side < 2; side++) {
        if (rails->peaks) {
            double given[PEAK_AXES] = {factor[side], fabs(at->speed), at->load[side], factor[2]};
            factor[side] *= peak_factor(rails->peaks, given);
        }
        factor[side] *= over_time;
    }
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
    const profile *along[] = {&rails->left, &rails->slope, &rails->grade, &rails->right};
    size_t count = has_equal_sides(rails) ? 3 : 4;
    double found = distance_ahead(&rails->over_time, time);
    for (size_t i = 0; speed != 0.0 && i < count; i++) {
        double way =
            speed > 0.0 ? distance_ahead(along[i], distance) : distance_behind(along[i], distance);
        found = fmin(found, way / fabs(speed));
    }
    return found;
}

#endif

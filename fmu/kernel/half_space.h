/* Stiffness of an ellipse that rolls on an elastic half-space against creepage, and its lag. */
#ifndef HALF_SPACE_H
#define HALF_SPACE_H

#include "export.h"

typedef struct {
    double c11; /* Kalker's creep coefficients [1] */
    double c22;
    double c23;
    double c33;
    double stiffness_x; /* along and across rolling, over those of strips [1] */
    double stiffness_y;
    double softening_x; /* parts of them lost as the stick area shrinks, up to saturation [1] */
    double softening_y;
    /* Normalized spin per spin in units of f_d N/(G (a b)^1.5): the normalized spin is the
     * mean of the creepages that spin causes half a semi-axis away from the centre. */
    double spin_scale;
} half_space_scales;

/* Range of the ratio of semi-axes, along over across rolling. */
#define MIN_ASPECT 0.05
#define MAX_ASPECT 20.0

/* Scales of an ellipse; the ratio is held within its range, and 0 <= poisson_ratio <= 0.5. */
CONTACTLIB_API void half_space_scales_of(double a_over_b, double poisson_ratio,
                                         half_space_scales *scales);

/* Rolled distances over a by which the force of an ellipse in full stick lags behind a creepage
 * that changes slowly [1]. */
typedef struct {
    double longitudinal; /* longitudinal force behind longitudinal creepage */
    double lateral;      /* lateral force behind lateral creepage */
    double spin;         /* lateral force behind spin */
} relaxation_lengths;

/* Relaxation lengths of an ellipse, with the arguments held as above. */
CONTACTLIB_API void relaxation_lengths_of(double a_over_b, double poisson_ratio,
                                          relaxation_lengths *lengths);

#endif

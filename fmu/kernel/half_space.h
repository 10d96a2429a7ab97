/* Stiffness of an ellipse that rolls on an elastic half-space against creepage, and its lag. */
#ifndef HALF_SPACE_H
#define HALF_SPACE_H

#include "export.h"

/* Range of the ratio of semi-axes, along over across rolling. */
#define MIN_ASPECT 0.05
#define MAX_ASPECT 20.0

/* Largest semi-width of a line contact over half its length. */
#define MAX_LINE_ASPECT 0.5

/* What memory.h needs of a contact, from its shape and its layer. */
typedef struct {
    double relaxation_length;         /* over a: the longitudinal force in full stick lags so far
                                         behind a creepage that changes slowly [1] */
    double lateral_relaxation_length; /* the same of the lateral force [1] */
    double standing_stiffness;        /* at standstill in full stick: growth of the longitudinal
                                         force over f P per displacement over a 2 f p0/E* [1] */
} contact_memory;

/* What the shape of a contact gives to it; that of an ellipse is the same at any load. */
typedef struct {
    double length[2];        /* relaxation lengths of the bodies along and across rolling, over a */
    double compliance, rise; /* see standing_compliance in half_space.c */
    double lateral;          /* stiffness across over along rolling */
} shape_memory;

/* Memory of bodies with a layer between them. E* is the contact modulus of Hertz's pressure,
 * whatever the stiffness in rolling.
 *
 *     a_over_b      semi-axes of an ellipse along over across rolling, or the semi-width of a line
 *                   contact over half its length; held within its range
 *     layer_ratio   lam = L E* / (2 a), with the layer's compliance L; 0: no layer
 *     softer        initial slope of the steady law without the layer, over that with it, minus 1
 */
void shape_memory_of(int elliptic, double a_over_b, double poisson_ratio, shape_memory *shape);
void memory_with_layer(int elliptic, const shape_memory *shape, double layer_ratio, double softer,
                       contact_memory *memory);

#ifndef ONE_FILE_KERNEL
/* The same in one step. */
CONTACTLIB_API void contact_memory_of(int elliptic, double a_over_b, double poisson_ratio,
                                      double layer_ratio, double softer, contact_memory *memory);

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
#endif /* ONE_FILE_KERNEL */

#endif

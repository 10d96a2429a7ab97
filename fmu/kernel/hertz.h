/* The ellipse of Hertz's contact. */
#ifndef HERTZ_H
#define HERTZ_H

#include "export.h"

/* Integral of (a cos^2 t + b sin^2 t)/sqrt(cos^2 t + k^2 sin^2 t) over t from 0 to pi/2, k > 0. */
double elliptic_integral(double k, double a, double b);

#ifndef ONE_FILE_KERNEL
/* Carlson's complete elliptic integral R_D(0, across^2, along^2) of an ellipse's semi-axes, both
 * positive [1/m^3]: times P/(pi E*) it is the curvature along rolling that the pressure flattens.
 */
CONTACTLIB_API double hertz_integral(double along, double across);

/* Semi-axes along and across rolling [m] of the contact of two surfaces with these relative radii
 * [m], for a compliance P/(pi E*) [m2]. All are positive, the radii's ratio from 1e-60 to 1e60. */
CONTACTLIB_API void hertz_semi_axes(double radius_x, double radius_y, double compliance,
                                    double *semi_axes);
#endif /* ONE_FILE_KERNEL */

#endif

/* Traction ratio of a creep force law, read from a table.
 *
 * A table of two axes contains the difference of a law from the Carter-Griffith law of a line
 * contact, as a bicubic C2 spline over the line contact's parameter t and the intensity k_hat:
 *
 *     x = m + k_hat t,   m = t^4 / (1 + t^4),   u = t / (1 + t)
 *     q(x, k_hat) = q_line(x, k_hat) + x (1 - u)^d (H(u, sqrt(k_hat)) + C)
 *
 * In these coordinates both boundary layers of the law (small x, and x near 1 at small k_hat) are
 * smooth. The tail falls like the power d, and H of the line contact is zero. C describes the
 * corner of a law, a creepage t = T(k_hat) where its second derivative is not continuous: with
 * y = t/T and z = 1 - y > 0,
 *
 *     C = y^4 z^p (c0 + c2 z + c4 z^2 + (c1 + c3 z + c5 z^2) ln z)
 *
 * A table of one axis contains q = u H(u) with u = x / (1 + x), for every k_hat.
 *
 * A law of two axes may have a third one: a thin layer with the ratio lam > 0 (layer_ratio) has a
 * tricubic spline over u, sqrt(k_hat) and w = g/(0.6 + g) with g = lam^(1/4), for all layers from
 * w = 0 without one to w = 1, where there are only springs:
 *
 *     x = m + lam t^2 + k_hat t r,   s = 1 - m,   r^2 = 1 + A/s,   A = (pi/2) lam
 *     q = (1 - B) (1 - s^2) + B sqrt(m) (1 + s/2 - (3/2 - 4/pi) s^2) + 2 k_hat t s/r
 *         + x (1 - u)^4/(1 + A) H(u, sqrt(k_hat), w),   B = A/(1 + A)
 *
 * t is nearly the parameter of the line contact with a layer, and q without H nearly its law.
 */
#ifndef CREEP_TABLE_H
#define CREEP_TABLE_H

#include <stddef.h>
#include <stdint.h>

#include "export.h"

typedef struct {
    uint32_t cells_u;                   /* spline cells along u = t / (1 + t), 0 if H is zero */
    uint32_t cells_k;                   /* spline cells along sqrt(k_hat) */
    double k_max;                       /* largest k_hat */
    double max_error;                   /* certificate: largest error of q found */
    double max_slope_error;             /* certificate: largest error of dq/dx found */
    double certificate_points;          /* number of points that the certificate compares */
    double static_to_kinetic;           /* f_s/f_d to which the law applies; 0: any */
    uint32_t one_axis;                  /* 1 if the law does not depend on k_hat */
    uint32_t twice_decay;               /* 2 d */
    uint32_t twice_corner;              /* 2 p, 0 if there is no corner */
    uint32_t root_k;                    /* 1 if H + C has the factor sqrt(k_hat) */
    uint32_t layer_u, layer_k, layer_w; /* spline cells with a layer, 0 if the law has none */
    uint32_t reserved;
    double max_layer_error;     /* certificate: largest error of q with a layer */
    const double *coefficients; /* rows along sqrt(k_hat), in the caller's bytes: each has 1/T and
                                   c0 to c5 if there is a corner, then cells_u + 3 numbers */
    const float *layer_coefficients; /* planes along w of rows along sqrt(k_hat) */
    /* Of one ellipse, see lateral_spin_law.h; or NULL. */
    const struct lateral_spin_contact *lateral_spin;
    const struct creep_forces *bodies; /* of any ellipse, see creep_forces.h; or NULL */
    const struct vehicle_rails *rails; /* of the model "vehicle", see rails.h; or NULL */
    /* Where q rises most steeply, and its slope there. For two axes the place is zero, and the
     * slope is not set: it depends on k_hat and the layer. */
    double steepest_creepage, steepest_slope;
    double clean_slope; /* creep_table_initial_slope of bodies without a layer at k_hat = 0 */
} creep_table;

typedef struct {
    double traction_ratio;       /* q */
    double slope;                /* dq/dx */
    double log_k_derivative;     /* k_hat dq/dk_hat */
    double log_layer_derivative; /* lam dq/dlam */
} creep_value;

/* Where a law is sampled to make the table's spline. */
typedef struct {
    double normalized_creepage; /* x */
    double line;                /* q_line */
    double weight;              /* x (1 - u)^d; u in a table of one axis */
} creep_node;

enum { TABLE_VERSION = 3 }; /* of the file's format */

/* Open a table file in memory that is aligned to 8 bytes and must outlive the table. Returns NULL,
 * or an error message. */
CONTACTLIB_API const char *creep_table_open(creep_table *table, const void *bytes, size_t size);

/* q and its derivatives at any finite x, 0 <= k_hat <= k_max and lam >= 0, which counts as zero in
 * a table without layers. */
CONTACTLIB_API void creep_table_evaluate(const creep_table *table, double normalized_creepage,
                                         double k_hat, double layer_ratio, creep_value *value);

/* The steepest slope of a table of one axis, else dq/dx at x = 0, where any law is steepest. */
CONTACTLIB_API double creep_table_initial_slope(const creep_table *table, double k_hat,
                                                double layer_ratio);

enum { MAX_LAYER_RATIO = 10000000 }; /* that callers accept */

/* q or dq/dx at one point, NaN if an argument is out of range. */
CONTACTLIB_API double creep_table_ratio(const creep_table *table, double normalized_creepage,
                                        double k_hat, double layer_ratio);
CONTACTLIB_API double creep_table_slope(const creep_table *table, double normalized_creepage,
                                        double k_hat, double layer_ratio);

/* q and dq/dx at n points, or one of them if the other's array is NULL; a stride is 1 if each point
 * has its own value, 0 if all share one. */
CONTACTLIB_API void creep_table_evaluate_many(const creep_table *table, size_t n, const double *x,
                                              const double *k_hat, size_t k_stride,
                                              const double *layer_ratio, size_t layer_stride,
                                              double *ratio, double *slope);

/* The node at the spline coordinates 0 <= u < 1 and k_hat of a table of this shape; with a layer if
 * lam > 0. */
CONTACTLIB_API void creep_table_node(const creep_table *shape, double u, double k_hat,
                                     double layer_ratio, creep_node *node);

/* t at a creepage x > 0 and k_hat > 0. */
CONTACTLIB_API double creep_table_coordinate(double normalized_creepage, double k_hat);

#endif

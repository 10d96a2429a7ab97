/* Traction ratio of a creep force law, read from a table.
 *
 * A table holds what a law adds to the Carter-Griffith law of a line contact, as a bicubic C2
 * spline over the line contact's own parameter t and the intensity k_hat:
 *
 *     x = m + k_hat t,   m = t^4 / (1 + t^4),   s = 1 - m
 *     q(x, k_hat) = q_line(x, k_hat) + s x H(t / (1 + t), sqrt(k_hat))
 *
 * In these coordinates both boundary layers of the law (small x, and x near 1 at small k_hat)
 * are smooth, the tail keeps its sign, and H of the line contact is zero.
 */
#ifndef CREEP_TABLE_H
#define CREEP_TABLE_H

#include <stddef.h>
#include <stdint.h>

#include "export.h"

typedef struct {
    uint32_t cells_u;           /* spline cells along u = t / (1 + t), 0 if H is zero */
    uint32_t cells_k;           /* spline cells along sqrt(k_hat) */
    double k_max;               /* largest k_hat */
    double max_error;           /* certificate: largest error of q found */
    double max_slope_error;     /* certificate: largest error of dq/dx found */
    double certificate_points;  /* number of points behind the certificate */
    const double *coefficients; /* (cells_k + 3) rows of (cells_u + 3), in the caller's bytes */
} creep_table;

typedef struct {
    double traction_ratio;   /* q */
    double slope;            /* dq/dx */
    double log_k_derivative; /* k_hat dq/dk_hat */
} creep_value;

/* What a law must be sampled at to make the table's spline. */
typedef struct {
    double normalized_creepage; /* x */
    double line;                /* q_line */
    double weight;              /* s x */
} creep_node;

/* Read a table file that lies in memory, aligned to 8 bytes. The bytes must outlive the table.
 * Returns NULL, or a message that says what is wrong with the bytes. */
CONTACTLIB_API const char *creep_table_open(creep_table *table, const void *bytes, size_t size);

/* q and its derivatives at any finite x and at 0 <= k_hat <= k_max. */
CONTACTLIB_API void creep_table_evaluate(const creep_table *table, double normalized_creepage,
                                         double k_hat, creep_value *value);

/* The same for n points; k_hat steps by k_stride (0 or 1). */
CONTACTLIB_API void creep_table_evaluate_many(const creep_table *table, size_t n, const double *x,
                                              const double *k_hat, size_t k_stride, double *ratio,
                                              double *slope);

/* The law's argument at the spline coordinates 0 <= u < 1 and k_hat. */
CONTACTLIB_API void creep_table_node(double u, double k_hat, creep_node *node);

#endif

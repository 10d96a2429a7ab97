#ifndef RIVALS_H
#define RIVALS_H

#include <stddef.h>

#include "creep_forces.h"
#include "creep_table.h"

typedef struct {
    size_t cells;
    double per_length;   /* cells per unit of x */
    const double *nodes; /* cells + 1 pairs of value and slope times the cell's length */
} hermite;

typedef void (*table_function)(const creep_table *, double, double, double, creep_value *);
typedef void (*forces_function)(const creep_forces *, size_t, const creep_forces_input *,
                                creep_forces_output *);

/* Polach's traction ratio; the factors are his reductions times the gradient. */
double polach_ratio(double stick_factor, double slip_factor, double x);
void polach_each(double stick_factor, double slip_factor, size_t n, const double *x, double *ratio);

/* Polach's forces along and across over mu P, with spin. Stiffness: Kalker's c11, c22 and c23 times
 * G a b/(mu P). Creepages in Kalker's signs, spin times sqrt(a b). */
typedef struct {
    double a_over_b;
    double stiffness[3];
    double creepage[3];
} polach_contact;

void polach_with_spin(const polach_contact *c, double force[2]);
void polach_with_spin_each(size_t n, const polach_contact *contact, double *force);

/* An odd function of x. */
void hermite_evaluate(const hermite *h, double x, double *value, double *slope);
void hermite_each(const hermite *h, size_t n, const double *x, double *value, double *slope);

/* Forces over mu P; the rates are those of the longitudinal and lateral creepage, and of spin along
 * and across rolling. n times 4 rates, n times 2 forces. */
void fastsim(size_t strips, size_t elements, const double rate[4], double force[2]);
void fastsim_each(size_t n, size_t strips, size_t elements, const double *rate, double *force);

/* Multilinear in a place of a/b, up to 1, and in v/(1 + |v|) of three normalized creepages. Forces
 * along and across and moment over mu P; n times 4 places, n times 3 forces. */
typedef struct {
    size_t nodes[4];
    double start[4]; /* where each axis begins: 0 or -1 */
    const double *values;
} usetab;

void usetab_force(const usetab *table, const double at[4], double force[3]);
void usetab_each(const usetab *table, size_t n, const double *at, double *force);

void table_each(table_function evaluate, const creep_table *table, size_t n, const double *x,
                const double *k_hat, size_t k_stride, double *ratio, double *slope);
void forces_each(forces_function evaluate, const creep_forces *pair, size_t n,
                 const creep_forces_input *input, creep_forces_output *output);

#endif

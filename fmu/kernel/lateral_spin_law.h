/* The dimensionless law of lateral and spin force: longitudinal and lateral force and spin moment
 * of an ellipse that rolls on a half-space, from longitudinal and lateral creepage and spin. */
#ifndef LATERAL_SPIN_LAW_H
#define LATERAL_SPIN_LAW_H

#include "creep_table.h"
#include "export.h"

/* Cubic splines with cells of equal size over -1 <= u <= 1 in each of three directions; of the
 * first and the last only one half is stored. They give the contribution of spin and, in two terms,
 * what weakening friction adds to it. A set of coefficients contains for each place those of
 * longitudinal force, lateral force and moment; then those of both terms; then all of them without
 * spin: the moment, and the derivatives of both forces and the moment by u[2]. */
enum {
    LATERAL_SPIN_CELLS = 16,
    LATERAL_SPIN_FLAT_POINTS = (LATERAL_SPIN_CELLS / 2 + 3) * (LATERAL_SPIN_CELLS + 3),
    LATERAL_SPIN_POINTS = LATERAL_SPIN_FLAT_POINTS * (LATERAL_SPIN_CELLS / 2 + 3),
    LATERAL_SPIN_WEAKENING = 3 * LATERAL_SPIN_POINTS,
    LATERAL_SPIN_FLAT = 9 * LATERAL_SPIN_POINTS,
    LATERAL_SPIN_WEAKENING_FLAT = LATERAL_SPIN_FLAT + 4 * LATERAL_SPIN_FLAT_POINTS,
    LATERAL_SPIN_COEFFICIENTS = LATERAL_SPIN_FLAT + 12 * LATERAL_SPIN_FLAT_POINTS
};

/* Stiffness, softening and splines of an ellipse of one shape. */
typedef struct {
    double stiffness_ratio;     /* c22/c11: stiffness across over that along rolling [1] */
    double softening_x;         /* see half_space.h [1] */
    double softening_y;         /* [1] */
    double static_ratio;        /* f_s/f_d; up to 1 spin has no terms of weakening [1] */
    const double *coefficients; /* sets of LATERAL_SPIN_COEFFICIENTS numbers; NULL: no spin */
    double share[4];            /* weight of each set */
    int sets;                   /* 1, or 4 in a row */
} lateral_spin_shape;

typedef struct {
    double force[3];          /* along, across [f_d N]; moment [f_d N sqrt(a b)] */
    double by_creepage[3][3]; /* rows: force; columns: creepage */
    double by_log_k[3];       /* k_hat d(force)/d(k_hat) */
    double by_log_layer[3];   /* lam d(force)/d(lam) */
} lateral_spin_value;

/* Forces and moment at normalized creepages along and across rolling and a normalized spin, which
 * have the signs of their forces. In full stick a force is 3 pi/4 times its normalized creepage;
 * spin has a scale of its own (half_space.h). k_hat must not exceed the table's maximum.
 *
 * Without spin a closed form gives the forces, and the splines give the moment. The splines were
 * fitted for a/b from 1/8 to 8, those of weakening for nu 0.28, f_s/f_d 11/7 and k_hat up to 0.8.
 * The forces dissipate power everywhere except at a/b 8 and nu 0.5 with weakening.
 * contactlib/element/creep_forces.py lists their errors. A layer (lam > 0) is equally stiff along
 * and across rolling; spin acts as with creepages and k_hat that are smaller by the stiffness lost.
 */
CONTACTLIB_API void lateral_spin_evaluate(const creep_table *table, const lateral_spin_shape *shape,
                                          const double creepage[3], double k_hat,
                                          double layer_ratio, lateral_spin_value *value);

/* Data of a force element's contact for lateral and spin force. */
typedef struct lateral_spin_contact {
    lateral_spin_shape shape; /* its softening along rolling is that of the element's parameters */
    double axes_ratio;        /* b/a; 0 for a contact without spin [1] */
    double spin_arm;          /* creepage with the effect of a spin, over this spin and a [1] */
    double slip_spread;       /* root mean square distance from the centre over a [1] */
} lateral_spin_contact;

/* Read a file in memory that is aligned to 8 bytes and must outlive the contact. Returns NULL, or a
 * message if the bytes are damaged. */
CONTACTLIB_API const char *lateral_spin_contact_open(lateral_spin_contact *contact,
                                                     const void *bytes, size_t size);

#endif

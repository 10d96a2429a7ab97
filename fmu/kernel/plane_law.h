/* Forces of a rolling ellipse on a half-space, longitudinal, lateral and spin moment, from
 * longitudinal and lateral creepage and spin. */
#ifndef PLANE_LAW_H
#define PLANE_LAW_H

#include "creep_table.h"
#include "export.h"

/* Splines have cubic cells of equal size over -1 <= u <= 1 in each of three directions, in halves
 * of the first and the last: the contribution of spin, and two terms of weakening friction to it. A
 * set of coefficients contains for each place those of longitudinal and lateral force and of the
 * moment; then those of both terms; then all of them without spin: the moment, and the slopes of
 * both forces and the moment by u[2]. */
enum {
    PLANE_CELLS = 16,
    PLANE_FLAT_PLACES = (PLANE_CELLS / 2 + 3) * (PLANE_CELLS + 3),
    PLANE_PLACES = PLANE_FLAT_PLACES * (PLANE_CELLS / 2 + 3),
    PLANE_WEAKENING = 3 * PLANE_PLACES,
    PLANE_FLAT = 9 * PLANE_PLACES,
    PLANE_WEAKENING_FLAT = PLANE_FLAT + 4 * PLANE_FLAT_PLACES,
    PLANE_COEFFICIENTS = PLANE_FLAT + 12 * PLANE_FLAT_PLACES
};

/* Data of an ellipse of one shape for lateral creepage and spin. */
typedef struct {
    double stiffness_ratio;     /* c22/c11: stiffness across over that along rolling [1] */
    double softening_x;         /* see half_space.h [1] */
    double softening_y;         /* [1] */
    double static_ratio;        /* f_s/f_d; up to 1 nothing weakens under spin [1] */
    const double *coefficients; /* sets of PLANE_COEFFICIENTS numbers; NULL: no spin */
    double share[4];            /* of each set */
    int sets;                   /* 1, or 4 in a row */
} plane_shape;

typedef struct {
    double force[3];          /* along, across [f_d N]; moment [f_d N sqrt(a b)] */
    double by_creepage[3][3]; /* rows: force; columns: creepage */
    double by_log_k[3];       /* k_hat d(force)/d(k_hat) */
} plane_value;

/* The force at normalized creepages along and across rolling and a normalized spin, of the sign of
 * the force. Their unit is that of the force in full stick: 3 pi/4 of the first two is the force,
 * and so is that of spin but for its own scale (half_space.h). k_hat is at most the table's.
 *
 * Without spin the forces are a closed form, and the splines give the moment. They were made for
 * a/b from 1/8 to 8, and those of weakening for nu 0.28, f_s/f_d 11/7 and k_hat up to 0.8. Power is
 * dissipated everywhere except at a/b 8 and nu 0.5 with weakening. Errors:
 * contactlib/element/creep_forces.py. */
CONTACTLIB_API void plane_evaluate(const creep_table *table, const plane_shape *shape,
                                   const double creepage[3], double k_hat, plane_value *value);

/* Data of a force element's contact for lateral and spin force. */
typedef struct plane_contact {
    plane_shape shape;  /* its softening along rolling is that of the element's parameters */
    double axes_ratio;  /* b/a; 0 for a contact without spin [1] */
    double spin_arm;    /* creepage that weighs as much as a spin, over spin and a [1] */
    double slip_spread; /* root mean square distance from the centre over a [1] */
} plane_contact;

/* Read a file in memory that is aligned to 8 bytes and must outlive the contact. Returns NULL, or a
 * message that says what is wrong with the bytes. */
CONTACTLIB_API const char *plane_contact_open(plane_contact *contact, const void *bytes,
                                              size_t size);

#endif

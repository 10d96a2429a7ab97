/* Steady creep: the drive torque that holds each creepage of a wheelset, and its turns.
 *
 * With the speed V at this instant, a drive torque T changes the creepage zeta by
 *
 *     dzeta/dt = (r/(J V)) (T - T_s(zeta)),   T_s = r Q + b omega + (J/r) (1 + zeta) dV/dt.
 *
 * All peaks, folds, steady states and worst poles are found here, on the curve of T_s. */
#ifndef CREEP_CURVE_H
#define CREEP_CURVE_H

#include "drivetrain.h"

/* The conditions of a curve. Each of two wheels gives half of the force that the contact would give
 * under the load and friction named here for it. */
typedef struct {
    double speed;             /* V, not negative [m/s] */
    double normal_load[2];    /* of all wheels, if both were loaded like this one [N] */
    double friction_scale[2]; /* [1] */
    double resistance_force;  /* of the train, against the motion [N] */
    double acceleration;      /* dV/dt if the speed is held [m/s2] */
    double balanced;          /* 1: at each creepage the speed, at most 1000 m/s, is that at which
                                 the resistance equals the force; the speed above is not used */
} creep_conditions;

typedef struct {
    double creepage;     /* zeta [1] */
    double torque;       /* T_s [N.m], or the creep force [N] of a curve without a body */
    double slope;        /* its derivative by the creepage */
    double force;        /* creep force [N] */
    double speed;        /* [m/s] */
    double acceleration; /* dV/dt [m/s2]; 0 without a body */
    double pole;         /* real part of the eigenvalue of the creepage [1/s]; 0 without a body */
    double minimum_gain; /* smallest Kp of T = T0 + Kp (reference - creepage) that holds the point,
                          if forces balance it [N.m]; infinite if no gain does; 0 without a body */
} creep_point;

/* Points at n creepages. Without a body (NULL) the curve is that of the creep force. A point whose
 * speed is not found is NaN. */
CONTACTLIB_API void creep_curve_points(const creep_table *table,
                                       const force_element_parameters *contact,
                                       const wheelset_parameters *body, const creep_conditions *at,
                                       size_t n, const double *creepage, creep_point *points);

/* Points of one side (1 or -1, that of traction or of braking) at which the torque turns, and at
 * which a plateau begins, from the smallest creepage outward; last comes the end of the search.
 * Returns how many there are, and stores no more than there is room for. */
CONTACTLIB_API size_t creep_curve_turns(const creep_table *table,
                                        const force_element_parameters *contact,
                                        const wheelset_parameters *body, const creep_conditions *at,
                                        double side, size_t room, creep_point *points);

/* The same for the points at which the curve crosses a torque; zero creepage belongs to traction.
 * The search ends when there is no more room. */
CONTACTLIB_API size_t creep_curve_steady(const creep_table *table,
                                         const force_element_parameters *contact,
                                         const wheelset_parameters *body,
                                         const creep_conditions *at, double torque, double side,
                                         size_t room, creep_point *points);

/* The fold of traction, which is the first maximum of the torque, and the point at which a falling
 * torque leaves the branch that it slips away to. Where the torque falls to its end without a
 * minimum, the second creepage is infinite, and its torque that of the end but not below 0. Returns
 * the number of points: 2, or 0 if the torque never falls. */
CONTACTLIB_API size_t creep_curve_fold(const creep_table *table,
                                       const force_element_parameters *contact,
                                       const wheelset_parameters *body, const creep_conditions *at,
                                       creep_point points[2]);

/* Point of traction with the largest pole. */
CONTACTLIB_API void creep_curve_worst(const creep_table *table,
                                      const force_element_parameters *contact,
                                      const wheelset_parameters *body, const creep_conditions *at,
                                      creep_point *point);

/* Creepage at which a torque is held on the rising branch. The branch ends at the peak, of two
 * wheels at that of the wheel that peaks last. NaN if the torque is larger than any on the branch;
 * then the limit is set to the largest one. */
CONTACTLIB_API double creep_curve_grip(const creep_table *table,
                                       const force_element_parameters *contact,
                                       const wheelset_parameters *body, const creep_conditions *at,
                                       double torque, double *limit);

/* Largest creep force in traction [N] and the smallest creepage with it, infinite if the force
 * rises forever, NaN if there is no force. */
CONTACTLIB_API double creep_curve_peak(const creep_table *table,
                                       const force_element_parameters *contact,
                                       const creep_conditions *at, double *creepage);

/* The last two for drivetrains whose wheels turn alike: for n of them, and for n inputs of those
 * that `which` numbers. */
CONTACTLIB_API void drivetrains_grip(const drivetrain_member *members, size_t n,
                                     const drivetrain_input *input, const double *speed,
                                     const double *torque, double *creepage, double *limit);
CONTACTLIB_API void drivetrains_peak(const drivetrain_member *members, const size_t *which,
                                     size_t n, const drivetrain_input *input, const double *speed,
                                     double *force);

#endif

/* Time integration of a wheelset and the memory of its contact, stable at any step. */
#ifndef WHEELSET_STEP_H
#define WHEELSET_STEP_H

#include "wheelset.h"

typedef struct {
    double omega;         /* [rad/s] */
    double speed;         /* [m/s] */
    double held_traction; /* this and the next ones are constant without memory [1] */
    double held_lateral;  /* [1] */
    double unslipped;     /* [1] */
} wheelset_state;

/* Held over the step. */
typedef struct {
    double drive_torque;     /* [N.m] */
    double resistance_force; /* [N] */
    double normal_load;      /* [N] */
    double friction_scale;   /* [1] */
    double lateral_velocity; /* [m/s] */
    double spin_velocity;    /* [rad/s] */
} wheelset_input;

/* Advance the state by one step. The tolerance is relative: to the slip velocity plus that of
 * saturation, to the speed plus the minimum speed, and to the held forces over the load plus
 * kinetic friction. It returns the one that was held, which is larger after very many substeps.
 * substep is the length to try first (0: not known) and returns the one to try next. Returns NULL,
 * or why the step failed; the state is then unchanged. */
CONTACTLIB_API const char *wheelset_advance(const creep_table *table,
                                            const force_element_parameters *contact,
                                            const wheelset_parameters *body,
                                            const wheelset_input *input, wheelset_state *state,
                                            double step, double *tolerance, double *substep);

/* Advance the memory of a contact by one step with held velocities, load and friction. Returns
 * NULL, or why it failed. */
CONTACTLIB_API const char *force_element_advance(const creep_table *table,
                                                 const force_element_parameters *contact,
                                                 force_element_input *input, double step,
                                                 double tolerance);

/* Creep force at n distances rolled, from the steady state of the first
 * creepage, which changes evenly with distance in between. Returns NULL, or why it failed. */
CONTACTLIB_API const char *force_element_roll(const creep_table *table,
                                              const force_element_parameters *contact, double speed,
                                              double normal_load, double friction_scale, size_t n,
                                              const double *creepage, const double *distance,
                                              double tolerance, double *force);

#endif

/* Time integration of a wheelset and the memory of its contact, stable at any step. */
#ifndef WHEELSET_STEP_H
#define WHEELSET_STEP_H

#include "wheelset.h"

/* A wheelset to be advanced. The tolerance is relative: to the slip velocity plus that of
 * saturation, to the speed plus the minimum speed, and to the held forces over the load plus
 * kinetic friction. */
typedef struct {
    const force_element_parameters *contact;
    const wheelset_parameters *body; /* NULL: omega changes at its rate, the speed is constant */
    double omega_rate;               /* only then [rad/s2] */
    double drive_torque;             /* held over the step [N.m] */
    double resistance_force;         /* likewise [N] */
    double brake_torque;             /* of a friction brake, at least 0; likewise [N.m] */
    double pads;                     /* state of its pads, as a drivetrain's [1] */
    force_element_input input;       /* velocities and memory are the state, the rest is held */
    double tolerance;    /* returns the one that was held, larger after very many substeps [1] */
    double substep;      /* length to try first (0: not known); returns the one to try next [s] */
    double max_substeps; /* 0: as many as the tolerance needs; see wheelset_advance */
} wheelset_task;

/* Advance the state by one step. Returns NULL, or why the step failed; the state is then
 * unchanged. Where max_substeps cannot meet the tolerance, those that are left divide the rest of
 * the step evenly, and the tolerance returns their largest estimated error. */
CONTACTLIB_API const char *wheelset_advance(const creep_table *table, wheelset_task *task,
                                            double step);

/* Advance n wheelsets with the same table, tolerance and kinds of contact, with the same bits as
 * one by one. On failure `failed` returns the first one that failed; the others may have been
 * advanced. */
CONTACTLIB_API const char *wheelsets_advance(const creep_table *table, wheelset_task *tasks,
                                             size_t n, double step, size_t *failed);
const char *wheelsets_advance_wide(const creep_table *table, wheelset_task *tasks, size_t n,
                                   double step, size_t *failed);

/* Creep force at n distances rolled, from the steady state of the first
 * creepage, which changes evenly with distance in between. Returns NULL, or why it failed. */
CONTACTLIB_API const char *force_element_roll(const creep_table *table,
                                              const force_element_parameters *contact, double speed,
                                              double normal_load, double friction_scale, size_t n,
                                              const double *creepage, const double *distance,
                                              double tolerance, double *force);

#endif

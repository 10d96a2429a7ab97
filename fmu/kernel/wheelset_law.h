/* The equations of motion, without branches. */
#ifndef WHEELSET_LAW_H
#define WHEELSET_LAW_H

#include "simd_math.h"
#include "wheelset.h"

/* The body on a grade that is added to its own. */
ALWAYS_INLINE wheelset_parameters on_grade(const wheelset_parameters *p, double grade) {
    wheelset_parameters there = *p;
    there.grade_acceleration += 9.80665 * grade; /* standard gravity */
    return there;
}

/* Creep force on the body and its derivatives by the body's states. */
typedef struct {
    double force, by_omega, by_speed; /* creep force [N, N.s, N.s/m] */
} contact_action;

ALWAYS_INLINE wheelset_rates motion_rates(const wheelset_parameters *p, double omega, double speed,
                                          double drive_torque, double resistance_force,
                                          contact_action contact) {
    wheelset_rates rates;
    double reference, reference_slope;
    regularized_speed(speed, p->minimum_speed, &reference, &reference_slope);
    double inverse_reference = 1.0 / reference, inverse_inertia = 1.0 / p->inertia;
    double direction = speed * inverse_reference; /* -1 or 1 above the minimum speed */
    double direction_slope = (1.0 - direction * reference_slope) * inverse_reference;

    double davis = p->constant_resistance * direction + p->linear_resistance * speed +
                   p->quadratic_resistance * speed * fabs(speed);
    double davis_slope = p->constant_resistance * direction_slope + p->linear_resistance +
                         2.0 * p->quadratic_resistance * fabs(speed);
    double moved = p->inverse_mass > 0.0 ? 1.0 : 0.0; /* a held speed has no grade either */
    double grade = moved * p->grade_acceleration;

    /* J domega/dt = T - r Q - b omega,  M dV/dt = Q - F(V) */
    rates.omega_rate =
        (drive_torque - p->radius * contact.force - p->damping * omega) * inverse_inertia;
    rates.speed_rate = (contact.force - davis - resistance_force) * p->inverse_mass - grade;
    double mass = 1.0 / (moved > 0.0 ? p->inverse_mass : 1.0);
    rates.resistance = davis + grade * mass;
    rates.resistance_slope = davis_slope;
    rates.jacobian[0][0] = -(p->radius * contact.by_omega + p->damping) * inverse_inertia;
    rates.jacobian[0][1] = -p->radius * contact.by_speed * inverse_inertia;
    rates.jacobian[1][0] = contact.by_omega * p->inverse_mass;
    rates.jacobian[1][1] = (contact.by_speed - davis_slope) * p->inverse_mass;
    return rates;
}

#endif

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

/* Chosen, as rim speeds and ways: the pads of a brake give that way in their holders before they
 * slide, and the holders damp them as long as they stick. */
static const double PADS_GIVE = 1e-4; /* [m] */
static const double PADS_DAMP = 5e-3; /* speed from which the damping is full [m/s] */

/* Part of the brake's torque that acts against a wheel, -1 to 1, and its derivatives. It is that of
 * the pads, which a turning wheel carries along until they slide: dpads/dt = (u - |u| pads)/give.
 * Where the pads' friction changes, part is multiplied by it, and so may be larger. */
typedef struct {
    double part, by_omega, by_pads; /* [1], [s], [1] */
    double by_torque;               /* derivative of part times torque [1] */
    double pads_rate, rate_by_omega, rate_by_pads;
} braking;

ALWAYS_INLINE braking braking_of(double radius, double omega, double pads) {
    double rim = radius * omega, pace = fabs(rim) / PADS_GIVE, reference, reference_slope;
    regularized_speed(rim, PADS_DAMP, &reference, &reference_slope);
    double held = smaller(larger(pads, -1.0), 1.0); /* a solver may try more */
    double along = rim / reference, left = 0.5 * (1.0 - held * held);
    double along_slope = (1.0 - along * reference_slope) * radius / reference;
    double sign = rim > 0.0 ? 1.0 : -1.0;
    braking found = {held + left * along,
                     left * along_slope,
                     held == pads ? 1.0 - pads * along : 0.0,
                     held + left * along,
                     rim / PADS_GIVE - pace * pads,
                     (1.0 - sign * pads) * radius / PADS_GIVE,
                     -pace};
    return found;
}

/* The same of a brake that may be off: the wheel does not carry pads that nothing presses. */
ALWAYS_INLINE braking braking_under(double torque, double radius, double omega, double pads) {
    braking found = braking_of(radius, omega, pads);
    double pressed = torque > 0.0 ? 1.0 : 0.0;
    found.pads_rate *= pressed;
    found.rate_by_omega *= pressed;
    found.rate_by_pads *= pressed;
    return found;
}

#endif

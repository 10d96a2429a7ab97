#include "wheelset.h"

#include <math.h>

#include "regularized_speed.h"

void wheelset_motion(const wheelset_parameters *p, double omega, double speed, double drive_torque,
                     double resistance_force, const force_element_output *contact,
                     wheelset_rates *rates) {
    double reference, reference_slope;
    regularized_speed(speed, p->minimum_speed, &reference, &reference_slope);
    double direction = speed / reference; /* -1 or 1 but for the lowest speeds */
    double direction_slope = (1.0 - direction * reference_slope) / reference;

    double davis = p->constant_resistance * direction + p->linear_resistance * speed +
                   p->quadratic_resistance * speed * fabs(speed);
    double davis_slope = p->constant_resistance * direction_slope + p->linear_resistance +
                         2.0 * p->quadratic_resistance * fabs(speed);
    double moved = p->inverse_mass > 0.0 ? 1.0 : 0.0; /* a held speed feels no grade either */
    double grade = moved * p->grade_acceleration;

    /* J domega/dt = T - r Q - b omega,  M dV/dt = Q - F(V) */
    rates->omega_rate =
        (drive_torque - p->radius * contact->creep_force - p->damping * omega) / p->inertia;
    rates->speed_rate = (contact->creep_force - davis - resistance_force) * p->inverse_mass - grade;
    rates->resistance = davis + (moved > 0.0 ? grade / p->inverse_mass : 0.0);
    rates->resistance_slope = davis_slope;
    rates->jacobian[0][0] = -(p->radius * contact->force_by_omega + p->damping) / p->inertia;
    rates->jacobian[0][1] = -p->radius * contact->force_by_speed / p->inertia;
    rates->jacobian[1][0] = contact->force_by_omega * p->inverse_mass;
    rates->jacobian[1][1] = (contact->force_by_speed - davis_slope) * p->inverse_mass;
}

void wheelset_tangent(const wheelset_parameters *p, double omega, double speed,
                      double resistance_force, const force_element_output *contact,
                      const wheelset_rates *rates, const wheelset_parameters *dp, double domega,
                      double dspeed, double dtorque, double dresistance, double dforce,
                      wheelset_rates *change) {
    double reference, slope;
    regularized_speed(speed, p->minimum_speed, &reference, &slope);
    double direction = speed / reference;
    double dreference = slope * dspeed + (reference - slope * speed) * dp->minimum_speed /
                                             p->minimum_speed; /* homogeneous of degree one */
    double ddirection = (dspeed - direction * dreference) / reference;
    double davis = p->constant_resistance * direction + p->linear_resistance * speed +
                   p->quadratic_resistance * speed * fabs(speed);
    double ddavis = dp->constant_resistance * direction + p->constant_resistance * ddirection +
                    dp->linear_resistance * speed + p->linear_resistance * dspeed +
                    dp->quadratic_resistance * speed * fabs(speed) +
                    2.0 * p->quadratic_resistance * fabs(speed) * dspeed;
    double moved = p->inverse_mass > 0.0 ? 1.0 : 0.0;

    *change = (wheelset_rates){0};
    change->omega_rate = (dtorque - dp->radius * contact->creep_force - p->radius * dforce -
                          dp->damping * omega - p->damping * domega) /
                             p->inertia -
                         rates->omega_rate * dp->inertia / p->inertia;
    change->speed_rate = (dforce - ddavis - dresistance) * p->inverse_mass +
                         (contact->creep_force - davis - resistance_force) * dp->inverse_mass -
                         moved * dp->grade_acceleration;
}

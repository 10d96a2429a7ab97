#include "wheelset.h"

#include <math.h>

#include "wheelset_law.h"

void wheelset_motion(const wheelset_parameters *p, double omega, double speed, double drive_torque,
                     double resistance_force, const force_element_output *contact,
                     wheelset_rates *rates) {
    contact_action action = {contact->creep_force, contact->force_by_omega,
                             contact->force_by_speed};
    *rates = motion_rates(p, omega, speed, drive_torque, resistance_force, action);
}

#ifndef ONE_FILE_KERNEL
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
#endif /* ONE_FILE_KERNEL */

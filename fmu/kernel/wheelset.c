#include "wheelset.h"

#include "wheelset_law.h"

void wheelset_motion(const wheelset_parameters *p, double omega, double speed, double drive_torque,
                     double resistance_force, const force_element_output *contact,
                     wheelset_rates *rates) {
    contact_action action = {contact->creep_force, contact->force_by_omega,
                             contact->force_by_speed};
    *rates = motion_rates(p, omega, speed, drive_torque, resistance_force, action);
}

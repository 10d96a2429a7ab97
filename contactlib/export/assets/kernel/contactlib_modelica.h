/* What the function creepForce of package.mo calls. Written by contactlib @version@. */
#ifndef CONTACTLIB_MODELICA_H
#define CONTACTLIB_MODELICA_H

#include "ModelicaUtilities.h" /* of the Modelica tool */
#include "contactlib.h"

static void contactlib_modelica_force(double omega, double speed, double normal_load,
                                      double friction_scale, double lateral_velocity,
                                      double spin_velocity, double *creep_force,
                                      double *wheel_torque, double *lateral_force,
                                      double *spin_moment, double *creepage) {
    contactlib_element wheel;
    contactlib_start(&wheel);
    wheel.input.omega = omega;
    wheel.input.speed = speed;
    wheel.input.normal_load = normal_load;
    wheel.input.friction_scale = friction_scale;
    wheel.input.lateral_velocity = lateral_velocity;
    wheel.input.spin_velocity = spin_velocity;
    const char *error = contactlib_force(&wheel.contact, &wheel.input, &wheel.output);
    if (error != NULL) ModelicaFormatError("contactlib: %s\n", error);
    *creep_force = wheel.output.creep_force;
    *wheel_torque = wheel.output.wheel_torque;
    *lateral_force = wheel.output.lateral_force;
    *spin_moment = wheel.output.spin_moment;
    *creepage = wheel.output.creepage;
}

#endif

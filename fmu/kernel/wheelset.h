/* Equations of motion of a single wheelset: longitudinal speed and rotation. */
#ifndef WHEELSET_H
#define WHEELSET_H

#include "export.h"
#include "force_element.h"

typedef struct {
    double radius;               /* r [m] */
    double inertia;              /* J, with the drive's inertia [kg.m2] */
    double inverse_mass;         /* 1/M [1/kg]; 0 holds the speed, as a roller rig does */
    double damping;              /* b, drive torque lost per angular velocity [N.m.s/rad] */
    double constant_resistance;  /* Davis: A [N] */
    double linear_resistance;    /* B [N.s/m] */
    double quadratic_resistance; /* C [N.s2/m2] */
    double grade_acceleration;   /* g times the grade, positive uphill [m/s2] */
    double minimum_speed;        /* the constant resistance fades out below it [m/s] */
} wheelset_parameters;

typedef struct {
    double omega_rate;       /* d(omega)/dt [rad/s2] */
    double speed_rate;       /* d(speed)/dt [m/s2] */
    double resistance;       /* F(V): running resistance and grade, without the input's force [N] */
    double resistance_slope; /* dF/dV [N.s/m] */
    double jacobian[2][2];   /* rates by (omega, speed) */
} wheelset_rates;

/* Rates of change under a drive torque, an outer resistance force and the contact's force. */
CONTACTLIB_API void wheelset_motion(const wheelset_parameters *parameters, double omega,
                                    double speed, double drive_torque, double resistance_force,
                                    const force_element_output *contact, wheelset_rates *rates);

#endif

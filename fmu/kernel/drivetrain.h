/* A wheelset with motor, shaft, brake, axle and two wheels that may differ, and the work done by
 * each part.
 *
 * Contact and body are those of both wheels together: each wheel has half of the inertia and of the
 * drive's damping, and half of the force that the contact would give under twice the wheel's own
 * load. The rotor and its shaft are seen from the axle: torques are multiplied by the gear ratio,
 * speeds divided by it. */
#ifndef DRIVETRAIN_H
#define DRIVETRAIN_H

#include "half_space.h"
#include "track.h"
#include "vehicle.h"
#include "wheelset.h"

typedef struct {
    wheelset_parameters body;
    double axle_stiffness;  /* k, between the wheels [N.m/rad]; 0 if the axle is rigid */
    double axle_damping;    /* d [N.m.s/rad] */
    double drive_share;     /* part of the drive torque that acts on the left wheel [1] */
    double motor_lag;       /* time constant of the drive torque [s]; 0 if it follows at once */
    double motor_inertia;   /* of the rotor [kg.m2]; 0 if the body contains it */
    double shaft_stiffness; /* between rotor and axle [N.m/rad] */
    double shaft_damping;   /* [N.m.s/rad] */
    double brake_fill_time; /* time constant of a rising brake torque [s]; 0 if there is no brake */
    double brake_vent_time; /* and of a falling one [s] */
    double sand_friction;   /* factor on friction where there is sand [1] */
    double sand_slope;      /* and on the initial slope of the creep force [1] */
} drivetrain_parameters;

typedef struct {
    double speed;         /* [m/s] */
    double omega_left;    /* [rad/s] */
    double omega_right;   /* equals omega_left if the axle is rigid [rad/s] */
    double twist;         /* angle of the left wheel ahead of the right one [rad] */
    rolling_memory left;  /* of the wheels' contacts with memory under twice the load */
    rolling_memory right; /* likewise */
    double drive_torque;  /* of the motor, at the axle [N.m] */
    double brake_torque;  /* of the turning axle, against its rotation, at pad friction 1 [N.m] */
    double pads_left;     /* how far the wheel has carried its brake's pads along, over what they */
    double pads_right;    /* give before they slide: 1 on a wheel that turns forward, -1 backward */
    double motor_omega;   /* of the rotor [rad/s] */
    double shaft_twist;   /* angle of the rotor ahead of the axle [rad] */
    double distance;      /* [m] */
    double drive_work;    /* of the torques of motor and brake [J] */
    double creep_work;    /* of the creep forces on the slip velocities [J] */
    double resistance_work; /* of the resistances; of the rig if the speed is held [J] */
    double loss_work;       /* of the damping of drive, axle and shaft [J] */
} drivetrain_state;

/* Held over a step. */
typedef struct {
    double commanded_torque; /* of the motor; beside a brake only above 0 [N.m] */
    double commanded_brake;  /* at least 0 [N.m] */
    double resistance_force; /* of a vehicle's axle, its part of what pulls the couplers [N] */
    double acceleration;     /* prescribed, if the speed is held (inverse_mass is 0) [m/s2] */
    double load_left;        /* of the wheel [N] */
    double load_right;       /* [N] */
    double friction_left;    /* multiplies f_s and f_d [1] */
    double friction_right;   /* [1] */
    double slope;            /* multiplies the initial slope of the creep force [1] */
    double grade;            /* rise over distance where the wheel is; added to the body's [1] */
    double sand;             /* part of its whole effect that sand has on the track's factors [1] */
} drivetrain_input;

typedef struct {
    double creep_force_left;  /* [N] */
    double creep_force_right; /* [N] */
    double creepage_left;     /* [1] */
    double creepage_right;    /* [1] */
    double falling_left;      /* 1 if the steady force falls with creepage at fixed speed */
    double falling_right;     /* [1] */
    double drive_torque;      /* of motor and brake [N.m] */
    double axle_torque;       /* from left to right, damping included [N.m] */
    double shaft_torque;      /* from the rotor to the axle, likewise [N.m] */
    double pad_friction;      /* mean of both wheels' brakes, 1 without a table [1] */
    double speed_rate;        /* [m/s2] */
    double stored_energy;     /* kinetic energy and that of the twisted axle and shaft [J] */
} drivetrain_output;

/* Friction of a brake's pads over that for which its torque is given, bilinear between speeds of
 * the rim and torques at that friction, which both rise; constant beyond. */
typedef struct {
    size_t speeds, torques;
    const double *speed, *torque; /* [m/s, N.m] */
    const double *friction;       /* at each speed those at all torques [1] */
} pad_table;

/* One drivetrain of many. If rails is NULL, the input gives friction, slope and grade. */
typedef struct {
    const creep_table *table;
    const force_element_parameters *contact;
    const drivetrain_parameters *drivetrain;
    const track *rails;
    const pad_table *pads; /* NULL: their friction is constant */
    contact_scales scales; /* of the contact at its nominal load */
    shape_memory shape;    /* likewise, with memory */
} drivetrain_member;

/* Set scales and shapes of n members. */
CONTACTLIB_API void drivetrains_prepare(drivetrain_member *members, size_t n);

/* Advance n drivetrains by one step. Each `axles` neighbours share their speed, as those of one
 * vehicle, whose mass is the sum of theirs: then all have a mass, equal speeds, and the same table
 * and kinds of states. 1: each has its own speed. The input's friction, slope and grade are set to
 * the track's at the start; each stretch between two corners of the track's profiles is integrated
 * under those in its middle. The tolerance is relative, as in wheelset_advance; substep holds the
 * length to try first for each drivetrain (0: not known). A drivetrain or vehicle that fails keeps
 * its state, its failed flags are set, and it is not stepped any more.
 *
 * `vehicles`, unless it is NULL, holds one for every `axles` drivetrains. Then loads and friction
 * are those of the middle of each substep, whose length keeps their error within the tolerance too,
 * and those of the inputs are set to the values at the start. */
CONTACTLIB_API void drivetrains_advance(const drivetrain_member *members, size_t n, size_t axles,
                                        vehicle *vehicles, drivetrain_input *input,
                                        drivetrain_state *state, double time, double step,
                                        double tolerance, double *substep, unsigned char *failed);

/* Let the loads and the axles' own slip work be those of the forces in the outputs, as if nothing
 * had changed for long. The forces depend on the loads: at a start this is done SETTLING times. */
enum { SETTLING = 6 };
CONTACTLIB_API void vehicles_settle(const drivetrain_member *members, size_t n, size_t axles,
                                    vehicle *vehicles, const drivetrain_input *input,
                                    const drivetrain_state *state, const drivetrain_output *output);

/* Outputs of n drivetrains, for several rows of inputs and states, and unless it is NULL those of
 * the contacts of each one's left and right wheel, whose forces are those of both wheels under
 * twice the load. */
CONTACTLIB_API void drivetrains_evaluate(const drivetrain_member *members, size_t n, size_t rows,
                                         const drivetrain_input *input,
                                         const drivetrain_state *state, drivetrain_output *output,
                                         force_element_output *contact);

/* Let the contacts of n drivetrains have rolled steadily at their present creepages. */
CONTACTLIB_API void drivetrains_settle(const drivetrain_member *members, size_t n,
                                       const drivetrain_input *input, drivetrain_state *state);

#endif

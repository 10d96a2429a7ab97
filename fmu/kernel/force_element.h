/* Creep force of a wheel as a function of angular velocity, forward velocity and load. */
#ifndef FORCE_ELEMENT_H
#define FORCE_ELEMENT_H

#include "creep_table.h"
#include "export.h"

typedef struct {
    double radius;                /* rolling radius [m] */
    double static_friction;       /* f_s [1] */
    double kinetic_friction;      /* f_d [1] */
    double weakening_length;      /* Delta [m] */
    double slope_reduction;       /* initial slope over that of the bodies with their layer [1] */
    double layer_compliance;      /* L of a layer between the bodies [m/Pa]; 0 without it */
    double semi_width;            /* a at nominal load [m] */
    double peak_pressure;         /* p0 at nominal load [Pa] */
    double contact_modulus;       /* E* of rolling: an ellipse on a half-space is stiffer [Pa] */
    double softening;             /* part of that stiffness lost as its stick area shrinks [1] */
    double nominal_load;          /* P [N] */
    double load_exponent;         /* a and p0 grow like the load to this power [1] */
    double minimum_speed;         /* below it the creepage's reference speed is regularised [m/s] */
    double slip_rate_residual;    /* A of the factor (1 - A) exp(-B w) + A on friction [1] */
    double slip_rate_decay;       /* B, w being the slip speed [s/m] */
    double softening_temperature; /* T_m of the factor 1 - T/T_m on friction [K]; 0 without it */
    double thermal_effusivity;    /* e of both bodies [W s^0.5/(m^2 K)] */
    double elliptic;              /* 1 if the contact is an ellipse, 0 if it is a line */
    double memory; /* 1: the contact remembers what it rolled over; FROZEN_PACES: see memory.h */
    double body_modulus;           /* E* of Hertz's pressure [Pa]; this and the next for memory */
    double poisson_ratio;          /* of the bodies [1] */
    double transverse_half_length; /* b of an ellipse at nominal load, or half of a line [m] */
} force_element_parameters;

/* States of a contact with memory (memory.h) along rolling, which every struct with such states
 * contains, and across it. A new one needs its rate in force_element_formula.h. */
typedef struct {
    double held_force;  /* creep force [N] */
    double unslipped;   /* part of the contact that has not slipped since it entered [1] */
    double outer_force; /* part of the creep force in the zone that slips first [N] */
} rolling_memory;

typedef struct {
    double held_lateral;  /* lateral force [N] */
    double outer_lateral; /* the part of it in that zone [N] */
} lateral_memory;

typedef struct {
    double omega;            /* angular velocity [rad/s] */
    double speed;            /* forward velocity [m/s] */
    double normal_load;      /* of all its wheels; a negative load counts as zero [N] */
    double friction_scale;   /* multiplies f_s and f_d; zero below MIN_FRICTION_SCALE [1] */
    rolling_memory memory;   /* of a contact with memory */
    lateral_memory lateral;  /* likewise */
    double lateral_velocity; /* of the wheel's surface against the rail, to the left [m/s] */
    double spin_velocity;    /* likewise, about the vertical axis upwards [rad/s] */
} force_element_input;

typedef struct {
    double creep_force;          /* on the wheel, forward [N] */
    double wheel_torque;         /* of the creep force on the wheel [N.m] */
    double lateral_force;        /* on the wheel, to the left [N] */
    double spin_moment;          /* on the wheel, about the vertical axis upwards [N.m] */
    double creepage;             /* zeta [1] */
    double traction_coefficient; /* creep force over normal load [1] */
    /* force_element_tangent differentiates those above; the FMU takes differences of others. */
    double normalized_creepage; /* x = zeta/zeta0 [1] */
    double force_gradient;      /* of the steady force by slip velocity at fixed speed [N.s/m] */
    double k_hat;               /* at this load, friction and slip speed [1] */
    double saturation_creepage; /* zeta0 at this load, friction and slip speed [1] */
    double process_zone_ratio;  /* weakening zone over contact semi-width, as above [1] */
    double contact_temperature; /* T, mean flash temperature by which friction falls [K] */
    double steady_force;        /* creep force in steady rolling [N] */
    double sticking;           /* part of a contact with memory that sticks in steady rolling [1] */
    double steady_outer;       /* part of the steady creep force in the zone that slips first [N] */
    double held_rate;          /* d(held_force)/dt [N/s] */
    double unslipped_rate;     /* d(unslipped)/dt [1/s] */
    double outer_rate;         /* d(outer_force)/dt [N/s] */
    double lateral_rate;       /* d(held_lateral)/dt [N/s] */
    double outer_lateral_rate; /* d(outer_lateral)/dt [N/s] */
    double falling_branch;     /* 1 if the steady force falls with creepage at fixed speed */
    double speed_regularized;  /* 1 if |speed| < minimum_speed, without memory */
    double k_hat_limited;      /* 1 if k_hat is held at the table's largest value */
    double force_limited;      /* 1 if static friction limits the force: that of the law, or with
                                  memory that of a zone, is larger (by 1 %) */
    double length_limited;     /* 1 if the memory of a line contact shorter than 4 semi-widths is
                                  that of 4 */
    double unloaded;           /* 1 if there is no load, and so no force */
    double falling_margin;     /* each of these flags is 1 where its margin is > 0 [1] */
    double speed_margin;       /* [m/s] */
    double k_hat_margin;       /* [1] */
    double force_margin;       /* of the force over the load [1] */
    double length_margin;      /* of the semi-width over half the length [1] */
    double load_margin;        /* [N] */
    double force_by_omega;     /* partial derivatives of the creep force [N.s] */
    double force_by_speed;     /* [N.s/m] */
    double force_by_load;      /* [1] */
    double creepage_by_omega;  /* partial derivatives of the creepage [s] */
    double creepage_by_speed;  /* [s/m] */
    /* Partial derivatives by omega, speed and the states of the memory, in the order above. */
    double force_by_memory[5]; /* of the creep force, by the states of the memory */
    double memory_by[5][7];    /* of their rates */
} force_element_output;

/* A smaller friction scale counts as zero: the scales of its contact would overflow. */
#define MIN_FRICTION_SCALE 1e-6

/* Largest process zone ratio for which the law's limit of a vanishing weakening zone is good. */
#define PROCESS_ZONE_LIMIT 0.5
CONTACTLIB_API double process_zone_limit(void); /* the same, for other languages */

/* Dimensionless numbers by which load, friction and materials enter the law. */
typedef struct {
    double saturation_creepage; /* zeta0 [1] */
    double k_hat;               /* [1] */
    double process_zone_ratio;  /* [1] */
    double heating;             /* (sqrt(V) + sqrt(omega r))/w_T; 0 without heat [s^0.5/m^0.5] */
    double layer_ratio;         /* lam = L E_t/(2 a), E_t being the modulus [1] */
    double relaxation_length;   /* of a contact with memory: sigma a of small creepages [m] */
    double lateral_relaxation_length; /* the same across rolling [m] */
    double standing_stiffness;        /* kappa, see memory.h [1] */
    double initial_slope;             /* S0 of its law in normalized creepage [1] */
} contact_scales;

/* Scales at a load above zero; friction_scale includes the factor of the slip speed. Without a
 * table (NULL) those of the memory are 0. */
CONTACTLIB_API void force_element_scales(const creep_table *table,
                                         const force_element_parameters *parameters,
                                         double normal_load, double friction_scale,
                                         contact_scales *scales);

/* Factors on friction f0 (1 - T/T_m) by thermal softening at n normalized creepages x, numbers
 * n = V zeta0/w_T and k_hat; all not negative, and x and heat numbers at most 1e20. */
CONTACTLIB_API void thermal_softening_many(int elliptic, size_t n, const double *x,
                                           const double *heat_number, const double *k_hat,
                                           double *fraction);

/* The largest force gradient at creepages from that of the input on, in traction or in braking,
 * where the force still rises; elsewhere that of the output, which must belong to the input
 * [N.s/m]. */
CONTACTLIB_API double force_element_steepest(const creep_table *table,
                                             const force_element_parameters *parameters,
                                             const force_element_input *input,
                                             const force_element_output *output);

/* Output at one input. Parameters and input must be valid. */
CONTACTLIB_API void force_element_evaluate(const creep_table *table,
                                           const force_element_parameters *parameters,
                                           const force_element_input *input,
                                           force_element_output *output);

/* Minimum and maximum of omega, speed, normal load and friction scale that a caller accepts. */
typedef struct {
    double minimum[4], maximum[4];
} force_ranges;

/* Creep force at one input, NaN if the input is out of range. */
CONTACTLIB_API double force_element_force(const creep_table *table,
                                          const force_element_parameters *parameters,
                                          const force_ranges *ranges, double omega, double speed,
                                          double normal_load, double friction_scale);

CONTACTLIB_API void force_element_evaluate_many(const creep_table *table,
                                                const force_element_parameters *parameters,
                                                size_t n, const force_element_input *input,
                                                force_element_output *output);

/* Creep forces alone at n inputs of omega, speed, normal load and friction scale, without lateral
 * slip and spin; a stride is 1 if each has its own value, 0 if all share one. */
CONTACTLIB_API void force_element_forces(const creep_table *table,
                                         const force_element_parameters *parameters, size_t n,
                                         const double *const input[4], const size_t stride[4],
                                         double *force);

/* A contact among several. */
typedef struct {
    const force_element_parameters *parameters;
    const force_element_input *input;
    force_element_output *output;
} force_task;

/* The same for contacts with the same table, which all have memory or none. */
CONTACTLIB_API void force_elements_evaluate(const creep_table *table, const force_task *tasks,
                                            size_t n);

/* Up to this many contacts or wheelsets are quicker one after another. */
#define FEW_WHEELS 2
void force_elements_evaluate_wide(const creep_table *table, const force_task *tasks, size_t n);

/* Exact changes of the output's members from the creep force to the traction coefficient, and of
 * the rates of the memory, when the input changes along a direction; output must belong to it. */
CONTACTLIB_API void force_element_tangent(const creep_table *table,
                                          const force_element_parameters *parameters,
                                          const force_element_input *input,
                                          const force_element_output *output,
                                          const force_element_input *input_direction,
                                          force_element_output *change);

#endif

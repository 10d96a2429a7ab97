/* Creep force of a wheel: angular and forward velocity and load in, force out. */
#ifndef FORCE_ELEMENT_H
#define FORCE_ELEMENT_H

#include "creep_table.h"
#include "export.h"
#include "variable.h"

typedef struct {
    double radius;           /* rolling radius [m] */
    double static_friction;  /* f_s [1] */
    double kinetic_friction; /* f_d [1] */
    double weakening_length; /* Delta [m] */
    double slope_reduction;  /* third-body layer: initial slope is this times the elastic one [1] */
    double semi_width;       /* a at nominal load [m] */
    double peak_pressure;    /* p0 at nominal load [Pa] */
    double contact_modulus;  /* E* [Pa] */
    double nominal_load;     /* P [N] */
    double load_exponent;    /* a and p0 grow like load to this power [1] */
    double minimum_speed;    /* below it the creepage's reference speed is regularised [m/s] */
    double slip_rate_residual; /* A of the factor (1 - A) exp(-B w) + A on friction [1] */
    double slip_rate_decay;    /* B, w being the slip speed [s/m] */
} force_element_parameters;

typedef struct {
    double omega;          /* angular velocity [rad/s] */
    double speed;          /* forward velocity [m/s] */
    double normal_load;    /* [N] */
    double friction_scale; /* multiplies f_s and f_d [1] */
} force_element_input;

typedef struct {
    double creep_force;          /* on the wheel, forward [N] */
    double wheel_torque;         /* of the creep force on the wheel [N.m] */
    double creepage;             /* zeta [1] */
    double normalized_creepage;  /* x = zeta/zeta0 [1] */
    double traction_coefficient; /* creep force over normal load [1] */
    double force_gradient;       /* d(creep force)/d(slip velocity) at fixed speed [N.s/m] */
    double k_hat;                /* at this load, friction and slip speed [1] */
    double saturation_creepage;  /* zeta0 at this load, friction and slip speed [1] */
    double process_zone_ratio;   /* weakening zone over contact semi-width, likewise [1] */
    double falling_branch;       /* 1 if the force falls with creepage at fixed speed */
    double speed_regularized;    /* 1 if |speed| < minimum_speed */
    double k_hat_limited;        /* 1 if k_hat is held at the table's largest value */
    double force_limited;        /* 1 if the force is held at f_s times the load */
    double force_by_omega;       /* partial derivatives of the creep force [N.s] */
    double force_by_speed;       /* [N.s/m] */
    double force_by_load;        /* [1] */
    double creepage_by_omega;    /* partial derivatives of the creepage [s] */
    double creepage_by_speed;    /* [s/m] */
} force_element_output;

typedef struct {
    force_element_parameters parameters;
    force_element_input input;
    force_element_output output;
} force_element;

/* The list of variables; sets *count. */
CONTACTLIB_API const model_variable *force_element_variables(size_t *count);

/* The first variable of this role whose value is not finite or out of its limits, or NULL. */
CONTACTLIB_API const model_variable *force_element_invalid(const force_element *element,
                                                           variable_role role);

/* What load, friction and materials amount to in the law's own measures. */
typedef struct {
    double saturation_creepage; /* zeta0 [1] */
    double k_hat;               /* [1] */
    double process_zone_ratio;  /* [1] */
} contact_scales;

/* Scales at a load above zero; friction_scale is to hold the factor of the slip speed too. */
CONTACTLIB_API void force_element_scales(const force_element_parameters *parameters,
                                         double normal_load, double friction_scale,
                                         contact_scales *scales);

/* Output at one input. Parameters and input must be valid. */
CONTACTLIB_API void force_element_evaluate(const creep_table *table,
                                           const force_element_parameters *parameters,
                                           const force_element_input *input,
                                           force_element_output *output);

CONTACTLIB_API void force_element_evaluate_many(const creep_table *table,
                                                const force_element_parameters *parameters,
                                                size_t n, const force_element_input *input,
                                                force_element_output *output);

#endif

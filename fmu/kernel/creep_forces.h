/* Creep forces of a wheel on a rail as a vehicle tool needs them: from the ellipse, the load and
 * Kalker's creepages. */
#ifndef CREEP_FORCES_H
#define CREEP_FORCES_H

#include "lateral_spin_law.h"

typedef struct {
    double shear_modulus;         /* G of both bodies [Pa] */
    double poisson_ratio;         /* nu [1] */
    double static_friction;       /* f_s [1] */
    double kinetic_friction;      /* f_d [1] */
    double weakening_length;      /* Delta [m] */
    double slip_rate_residual;    /* A, fraction of friction at high slip speed [1] */
    double slip_rate_decay;       /* B, rate at which friction falls with slip speed [s/m] */
    double softening_temperature; /* T_m of the factor 1 - T/T_m on friction [K]; 0 without it */
    double thermal_effusivity;    /* e of both bodies [W s^0.5/(m^2 K)] */
    double layer_compliance;      /* L of a layer between them [m/Pa]; 0 without it */
} creep_forces_parameters;

/* Creepages are those of the wheel against the rail in Kalker's signs, so the longitudinal one is
 * negative in traction: (V - omega r)/V, v_y/V and omega_z/V. y is to the left and z up. */
typedef struct {
    double semi_axis_x;    /* a, along rolling; 0 without contact [m] */
    double semi_axis_y;    /* b [m] */
    double normal_load;    /* [N] */
    double friction_scale; /* multiplies f_s and f_d [1] */
    double creepage_x;     /* xi [1] */
    double creepage_y;     /* eta [1] */
    double spin;           /* phi [1/m] */
    double speed;          /* V, by which friction falls with slip [m/s] */
} creep_forces_input;

typedef struct {
    double force_x;               /* on the wheel [N] */
    double force_y;               /* [N] */
    double spin_moment;           /* about z [N.m] */
    double utilisation;           /* force over f_s times the load [1] */
    double force_x_by_creepage_x; /* partial derivatives [N] */
    double force_x_by_creepage_y; /* [N] */
    double force_x_by_spin;       /* [N.m] */
    double force_y_by_creepage_x; /* [N] */
    double force_y_by_creepage_y; /* [N] */
    double force_y_by_spin;       /* [N.m] */
    double moment_by_creepage_x;  /* [N.m] */
    double moment_by_creepage_y;  /* [N.m] */
    double moment_by_spin;        /* [N.m2] */
    double aspect_limited;        /* 1 if a/b is held within 1/8 and 8 */
} creep_forces_output;

/* Ratios a/b whose sets of coefficients are given: 1/8, 1/4, ..., 8; and cells and scales over
 * ln(a/b). */
enum { LATERAL_SPIN_ASPECTS = 7, ASPECT_CELLS = 48, ASPECT_SCALES = 5 };
#define LN_2 0.69314718055994531

/* A material pair, prepared for any ellipse. */
typedef struct creep_forces {
    creep_forces_parameters parameters;
    const creep_table *table;   /* of an elliptic contact */
    const double *coefficients; /* LATERAL_SPIN_ASPECTS sets */
    /* c11, c22, both softenings and the scale of spin over ln(a/b), and their slopes. */
    double scales[ASPECT_CELLS + 1][2 * ASPECT_SCALES];
} creep_forces;

/* Prepare a pair; table and coefficients must outlive it. */
CONTACTLIB_API void creep_forces_prepare(creep_forces *bodies, const creep_table *table,
                                         const double *coefficients,
                                         const creep_forces_parameters *parameters);

/* Prepare it from a file in memory that is aligned to 8 bytes: Poisson's ratio and coefficients.
 * Returns NULL, or an error message if the bytes are damaged. */
CONTACTLIB_API const char *creep_forces_open(creep_forces *bodies, const creep_table *table,
                                             const void *bytes, size_t size);

/* Smaller loads [N] and friction coefficients [1] count as zero. */
#define MIN_LOAD 1e-30
#define MIN_FRICTION 1e-9
/* An ellipse with a shorter axis [m] is no contact, as when the wheel lifts off. One that bears
 * more than this load [N] is a mistake: Hertz's axes under it are about a thousand times as long.
 */
#define MIN_SEMI_AXIS 1e-9
#define MAX_LOAD_OF_NO_CONTACT 1e-6

/* Forces of one contact, with other parameters than the bodies' but Poisson's ratio, and of n. */
void creep_forces_of_one(const creep_forces *bodies, const creep_forces_parameters *parameters,
                         const creep_forces_input *input, creep_forces_output *output);
CONTACTLIB_API void creep_forces_evaluate(const creep_forces *bodies, size_t n,
                                          const creep_forces_input *input,
                                          creep_forces_output *output);

#endif

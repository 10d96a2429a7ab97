/* The interface between physics and FMI: five models that a tool can step, each with one list of
 * variables. The sources above contain no contact mechanics, the kernel below is independent of
 * FMI. */
#ifndef MODEL_H
#define MODEL_H

#include "creep_forces.h"
#include "export.h"
#include "force_element.h"
#include "variable.h"
#include "vehicle.h"
#include "wheelset.h"

/* Memory of the force element of the previous steps. */
typedef struct {
    double known;   /* 1 after the first step */
    double slip;    /* slip velocity at the start of the last step, as the tool gave it [m/s] */
    double step;    /* length of the last step [s] */
    double applied; /* creep force on the tool's body during the last step [N] */
    double force;   /* creep force of the last step; the mean one, if implicit [N] */
    double acting, rate; /* held creep force and slip acceleration in the step before [N, m/s2] */
    double rise;         /* last large change of the held force [N] */
    double inverse_mass; /* with which the slip followed it [1/kg] */
    double turns;        /* how often its sign has changed while the slip follows the force [1] */
    double too_long;     /* stable step, once a longer one made the force swing; else 0 [s] */
} slip_memory;

/* Largest number of wheels in one FMU. */
enum { MAX_WHEELS = 32 };

/* Of an axle of the model "vehicle", beside what a wheelset has. The memory of its left wheel is
 * the contact's, its load is the contact's. */
typedef struct {
    double position;  /* behind the first axle [m] */
    double motor_lag; /* as in drivetrain_parameters, as are */
    double brake_fill_time, brake_vent_time;
    double torque_per_pressure;        /* of the brake; 0 if its torque is commanded [N.m/Pa] */
    double brake_pressure;             /* in its cylinder [Pa] */
    double motor_torque;               /* commanded [N.m] */
    double acting_motor, acting_brake; /* torques that follow their commands [N.m] */
    rolling_memory right;              /* of the right wheel's contact */
} axle_values;

/* Of the whole vehicle. */
typedef struct {
    vehicle_parameters body;                        /* its positions are those of the axles */
    double distance;                                /* of the first axle [m] */
    double grade;                                   /* added to that of the rails [1] */
    double front_coupler_force, rear_coupler_force; /* tension [N] */
} whole_values;

typedef struct {
    double distance_rate;          /* [m/s] */
    double drive_torque;           /* of motor and brake [N.m] */
    double friction;               /* factor under the wheels, mean of both [1] */
    double available_force;        /* largest creep force [N] */
    double load_rate;              /* [N/s] */
    double motor_rate, brake_rate; /* [N.m/s] */
    rolling_memory right_rate;     /* [N/s, 1/s, N/s] */
    double slip_left, slip_right;  /* slip work per length of the wheels [J/m] */
} axle_outputs;

/* All numbers of all models, of one wheel. The states of the wheelset are the contact's input. */
typedef struct {
    double time;
    force_element_parameters contact;
    wheelset_parameters body; /* its radius and minimum speed are the contact's */
    double effective_inverse_mass;
    double implicit;
    double parallel_exchange;
    force_element_input input;
    double drive_torque;
    double resistance_force;
    double brake_torque;
    double pads; /* state of the brake's */
    axle_values axle;
    whole_values whole; /* the same for all axles */
    force_element_output output;
    double step_size_hint;
    wheelset_rates rates;
    double pads_rate;
    slip_memory memory;
    double substep;                 /* length that the integrator tries next [s] */
    double held_tolerance;          /* of the last step [1] */
    double max_substeps;            /* in a step, rounded up; 0: no limit */
    double spins;                   /* 1 if the contact has spin as an input */
    creep_forces_parameters bodies; /* without Poisson's ratio, which is the prepared bodies' */
    creep_forces_input ellipse;
    creep_forces_output forces;
    axle_outputs of_axle;
    axle_state past;
    double completed; /* distance at the end of a solver's last step [m] */
} model_values;

typedef struct {
    const char *kind;
    int has_contact; /* 1 if there are a table, its contact, truth values and their margins */
    int has_bodies;  /* 1 if there are a table and bodies that touch in any ellipse */
    int moves;       /* 1 if there is a body: its steps do not need the outputs at their start */
    int is_vehicle; /* 1 if its wheels are the axles of one vehicle, which are evaluated together */
    const model_variable *variables;
    size_t count;
    /* Calculate outputs and derivatives of n wheels from everything else. */
    void (*evaluate)(const creep_table *table, model_values *values, size_t n);
    /* Set the exact changes of derivatives, and of outputs that are not diagnostic, when inputs and
     * states change along a direction; in the model creep_forces only creepages and spin count.
     * NULL if all of them are differences. */
    void (*tangent)(const creep_table *table, const model_values *values,
                    const model_values *direction, model_values *change);
    /* Step the states of n wheels, and outputs that belong to a step, to the next communication
     * point with the inputs held. Returns NULL, or why the step failed; `failed` is then the index
     * of the wheel, and values are unchanged but for its substep, the longest possible step. */
    const char *(*advance)(const creep_table *table, model_values *values, size_t n, double step,
                           double tolerance, size_t *failed);
    /* NULL, or what a vehicle needs beside: settle what its start values leave open; note a
     * completed step of a solver; calculate the available forces, which takes a search. */
    void (*begin)(const creep_table *table, model_values *values, size_t n);
    void (*complete)(const creep_table *table, model_values *values, size_t n);
    void (*search)(const creep_table *table, model_values *values, size_t n);
} model;

/* The model of a kind ("force_element", "wheelset", "wheelset_body", "creep_forces", "vehicle");
 * NULL for another name. */
CONTACTLIB_API const model *model_of(const char *kind);

/* Whether the variable is part of the model with these values. */
CONTACTLIB_API int model_has(const model_variable *variable, const model_values *values);

CONTACTLIB_API double model_get(const model_variable *variable, const model_values *values);
CONTACTLIB_API void model_set(const model_variable *variable, model_values *values, double value);

/* Largest step with which Euler's method integrates the states stably while the wheel sticks, where
 * they are stiffest, and up to twice the saturation creepage; infinite if there are no stiff ones
 * [s]. */
CONTACTLIB_API double model_explicit_step(const model *m, const creep_table *table,
                                          const model_values *values);

/* Whether it has a start value: a parameter, an input or a state. */
int model_is_given(const model_variable *variable);

/* Whether it is an output that only describes the contact: its derivatives are differences. */
int model_is_diagnostic(const model_variable *variable);

/* Whether it is an output that the model's `search` calculates. */
int model_is_searched(const model_variable *variable);

/* Changes of outputs, derivatives and indicators of n wheels that are evaluated together when
 * everything else changes along a direction: those by inputs and states exactly, those by
 * parameters and of diagnostic outputs by central differences. Without diagnostics the latter
 * follow only the parameters. */
CONTACTLIB_API void model_tangent(const model *m, const creep_table *table,
                                  const model_values *values, const model_values *direction,
                                  size_t n, int diagnostics, model_values *change);

/* The model's functions for Python, which cannot call the struct's members. The first ends the
 * initialization. */
CONTACTLIB_API void model_begin(const model *m, const creep_table *table, model_values *values,
                                size_t n);
CONTACTLIB_API void model_evaluate(const model *m, const creep_table *table, model_values *values,
                                   size_t n);
CONTACTLIB_API const char *model_advance(const model *m, const creep_table *table,
                                         model_values *values, size_t n, double step,
                                         double tolerance, size_t *failed);

#endif

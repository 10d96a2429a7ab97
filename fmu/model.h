/* The seam between physics and FMI: three models that a tool can step, each with one list of
 * variables. The shells above know nothing of contact mechanics, the kernel below nothing of FMI.
 */
#ifndef MODEL_H
#define MODEL_H

#include "export.h"
#include "force_element.h"
#include "variable.h"
#include "wheelset.h"

/* What the implicit force element remembers of its last step. */
typedef struct {
    double known;   /* 1 once there was a step */
    double slip;    /* slip velocity at its start, as the tool gave it [m/s] */
    double step;    /* its length [s] */
    double applied; /* creep force that acted on the tool's body during it [N] */
    double force;   /* mean creep force that it ended with [N] */
} slip_memory;

/* Every number of any of the models. The states of the wheelset are the contact's input. */
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
    force_element_output output;
    double step_size_hint;
    wheelset_rates rates;
    slip_memory memory;
    double substep; /* for the integrator to go on with */
} model_values;

typedef struct {
    const char *kind;
    int has_contact; /* and hence a table, and flags that a margin tells */
    const model_variable *variables;
    size_t count;
    /* Make the outputs and derivatives from all else. */
    void (*evaluate)(const creep_table *table, model_values *values);
    /* Change of outputs and derivatives when all else changes along a direction. */
    void (*tangent)(const creep_table *table, const model_values *values,
                    const model_values *direction, model_values *change);
    /* Step the states from one communication point to the next with the inputs held, and the
     * outputs where they belong to a step. NULL, or why it failed; values are then not changed. */
    const char *(*advance)(const creep_table *table, model_values *values, double step,
                           double tolerance);
} model;

/* The model of a kind ("force_element", "wheelset", "wheelset_body"); NULL if there is none. */
CONTACTLIB_API const model *model_of(const char *kind);

/* Whether the variable is part of the model with these values. */
CONTACTLIB_API int model_has(const model_variable *variable, const model_values *values);

CONTACTLIB_API double model_get(const model_variable *variable, const model_values *values);
CONTACTLIB_API void model_set(const model_variable *variable, model_values *values, double value);

/* For a call from Python, which cannot call through the struct's members. */
CONTACTLIB_API void model_evaluate(const model *m, const creep_table *table, model_values *values);
CONTACTLIB_API void model_tangent(const model *m, const creep_table *table,
                                  const model_values *values, const model_values *direction,
                                  model_values *change);
CONTACTLIB_API const char *model_advance(const model *m, const creep_table *table,
                                         model_values *values, double step, double tolerance);

#endif

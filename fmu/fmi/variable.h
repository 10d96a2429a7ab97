/* An entry of a model's list of variables, which gives value references, modelDescription.xml,
 * range checks and error messages. */
#ifndef VARIABLE_H
#define VARIABLE_H

#include <stddef.h>

typedef enum {
    INDEPENDENT, /* time */
    FIXED_PARAMETER,
    TUNABLE_PARAMETER,
    INPUT,
    OUTPUT,
    STATE,      /* continuous; also an output */
    DERIVATIVE, /* of the states, in their order */
    INDICATOR   /* of an event: a truth value changes where the indicator changes sign */
} variable_role;

typedef enum {
    ALWAYS,
    ONCE, /* always, and the same for all wheels: time, and what belongs to a whole vehicle */
    IF_REMEMBERING,
    IF_SPINNING,
    IF_THERMAL,
    IF_LAYERED,
    IF_FALLING,
    IF_SLIP_COUNTS,
    IF_LAGGING,
    IF_BRAKED,
    IF_BRAKE_TORQUE, /* its input is a torque, which lags; else a pressure */
    IF_BRAKE_PRESSURE
} variable_part;

/* The unit of a truth value, which is held as 0 or 1: "Boolean". */
extern const char TRUTH[];

typedef struct {
    const char *name;
    const char *unit;
    const char *description;
    double minimum, maximum; /* limits, both allowed; infinite values are not */
    size_t offset;           /* of the double in model_values */
    variable_role role;
    variable_part part; /* when the variable is part of the model */
} model_variable;

#endif

/* One list of variables per model serves the FMU's value references, its modelDescription.xml,
 * the range checks and the error messages. */
#ifndef VARIABLE_H
#define VARIABLE_H

#include <stddef.h>

typedef enum {
    INDEPENDENT, /* time */
    FIXED_PARAMETER,
    TUNABLE_PARAMETER,
    INPUT,
    OUTPUT,
    STATE,      /* continuous, and an output */
    DERIVATIVE, /* of the states, in their order */
    INDICATOR   /* of an event: where it changes sign, a truth value does */
} variable_role;

typedef enum { ALWAYS, IF_RELAXED } variable_part;

/* The unit of a truth value, which is held as 0 or 1: "Boolean". */
extern const char TRUTH[];

typedef struct {
    const char *name;
    const char *unit;
    const char *description;
    double minimum, maximum; /* limits, both allowed; infinite values never are */
    size_t offset;           /* of the double in model_values */
    variable_role role;
    variable_part part; /* of the model that the variable belongs to */
} model_variable;

#endif

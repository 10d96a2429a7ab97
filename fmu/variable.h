/* One list of variables per model serves the FMU's value references, its modelDescription.xml,
 * the range checks and the error messages. */
#ifndef VARIABLE_H
#define VARIABLE_H

#include <stddef.h>

typedef enum { FIXED_PARAMETER, TUNABLE_PARAMETER, INPUT, OUTPUT } variable_role;

typedef struct {
    const char *name;
    const char *unit; /* "Boolean" marks a truth value, held as 0 or 1 */
    const char *description;
    double minimum, maximum; /* limits, both allowed; infinite values never are */
    size_t offset;           /* of the double in the model's struct */
    variable_role role;
} model_variable;

#endif

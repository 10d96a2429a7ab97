/* The functions of each model; the struct in model.h describes what they do. */
#ifndef MODEL_FUNCTIONS_H
#define MODEL_FUNCTIONS_H

#include "model.h"

#ifndef ONE_FILE_KERNEL
#define MODEL_FUNCTIONS(name)                                                            \
    void evaluate_##name(const creep_table *table, model_values *values, size_t n);      \
    void tangent_##name(const creep_table *table, const model_values *values,            \
                        const model_values *direction, model_values *change);            \
    const char *advance_##name(const creep_table *table, model_values *values, size_t n, \
                               double step, double tolerance, size_t *failed);

MODEL_FUNCTIONS(force)
MODEL_FUNCTIONS(wheelset)
MODEL_FUNCTIONS(body)
MODEL_FUNCTIONS(creep_forces)
MODEL_FUNCTIONS(vehicle)
void begin_vehicle(const creep_table *table, model_values *values, size_t n);
void complete_vehicle(const creep_table *table, model_values *values, size_t n);
void search_vehicle(const creep_table *table, model_values *values, size_t n);

/* One over the mass that each axle moves [1/kg]. */
double inverse_mass_of_axle(const model_values *values);

/* Evaluate the contacts of n wheels. */
void evaluate_contacts(const creep_table *table, model_values *values, size_t n);
#endif /* ONE_FILE_KERNEL */

#endif

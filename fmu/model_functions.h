/* The functions of each model; the struct in model.h says what they do. */
#ifndef MODEL_FUNCTIONS_H
#define MODEL_FUNCTIONS_H

#include "model.h"

void evaluate_force(const creep_table *table, model_values *values);
void tangent_force(const creep_table *table, const model_values *values,
                   const model_values *direction, model_values *change);
const char *advance_force(const creep_table *table, model_values *values, double step,
                          double tolerance);

void evaluate_wheelset(const creep_table *table, model_values *values);
void tangent_wheelset(const creep_table *table, const model_values *values,
                      const model_values *direction, model_values *change);
const char *advance_wheelset(const creep_table *table, model_values *values, double step,
                             double tolerance);

void evaluate_body(const creep_table *table, model_values *values);
void tangent_body(const creep_table *table, const model_values *values,
                  const model_values *direction, model_values *change);
const char *advance_body(const creep_table *table, model_values *values, double step,
                         double tolerance);

void evaluate_pair(const creep_table *table, model_values *values);
void tangent_pair(const creep_table *table, const model_values *values,
                  const model_values *direction, model_values *change);
const char *advance_pair(const creep_table *table, model_values *values, double step,
                         double tolerance);

#endif

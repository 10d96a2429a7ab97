/* The functions of simd_dispatch.h for one vector width, which the including file has chosen. */
#include "creep_forces_formula.h"
#include "simd_dispatch.h"
#include "table_points.h"

void WIDE(creep_table_evaluate_many)(const creep_table *table, size_t n, const double *x,
                                     const double *k_hat, size_t k_stride,
                                     const double *layer_ratio, size_t layer_stride, double *ratio,
                                     double *slope) {
    double k[MAX_POINTS], layer[MAX_POINTS], spare[MAX_POINTS];
    for (size_t first = 0; first < n; first += MAX_POINTS) {
        size_t count = n - first < MAX_POINTS ? n - first : MAX_POINTS;
        for (size_t i = 0; i < count; i++) k[i] = k_hat[(first + i) * k_stride];
        for (size_t i = 0; i < count; i++) layer[i] = layer_ratio[(first + i) * layer_stride];
        evaluate_points(table, count, x + first, k, layer, ratio != NULL ? ratio + first : spare,
                        slope != NULL ? slope + first : spare, NULL, NULL);
    }
}

void WIDE(creep_forces_evaluate)(const creep_forces *pair, size_t n,
                                 const creep_forces_input *input, creep_forces_output *output) {
    for (size_t first = 0; first < n; first += MAX_POINTS) {
        size_t count = n - first < MAX_POINTS ? n - first : MAX_POINTS;
        creep_forces_at(pair, &pair->parameters, count, input + first, output + first);
    }
}

/* A vehicle has few wheels, so more lanes would stay idle. */
#define LANES 8
#include "drivetrain_many.h"
#include "wheels_many.h"

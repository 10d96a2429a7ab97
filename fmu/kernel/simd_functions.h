/* The functions of simd_dispatch.h for one vector width, which the including file has chosen. */
#include "creep_forces_formula.h"
#include "force_element_formula.h"
#include "lateral_spin_force.h"
#include "simd_dispatch.h"
#include "table_points.h"

void WIDE(creep_table_evaluate_many)(const creep_table *table, size_t n, const double *x,
                                     const double *k_hat, size_t k_stride,
                                     const double *layer_ratio, size_t layer_stride, double *ratio,
                                     double *slope) {
    double k[MAX_POINTS], layer[MAX_POINTS], log_k[MAX_POINTS], log_layer[MAX_POINTS];
    for (size_t first = 0; first < n; first += MAX_POINTS) {
        size_t count = n - first < MAX_POINTS ? n - first : MAX_POINTS;
        for (size_t i = 0; i < count; i++) k[i] = k_hat[(first + i) * k_stride];
        for (size_t i = 0; i < count; i++) layer[i] = layer_ratio[(first + i) * layer_stride];
        evaluate_points(table, count, x + first, k, layer, ratio + first, slope + first, log_k,
                        log_layer);
    }
}

void WIDE(creep_forces_evaluate)(const creep_forces *pair, size_t n,
                                 const creep_forces_input *input, creep_forces_output *output) {
    for (size_t first = 0; first < n; first += MAX_POINTS) {
        size_t count = n - first < MAX_POINTS ? n - first : MAX_POINTS;
        creep_forces_at(pair, &pair->parameters, count, input + first, output + first);
    }
}

void WIDE(force_element_evaluate_many)(const creep_table *table,
                                       const force_element_parameters *parameters, size_t n,
                                       const force_element_input *input,
                                       force_element_output *output) {
    force_element_parameters p = *parameters;
    contact_scales scales = contact_scales_of(&p);
    force_state at[MAX_POINTS];
    double x[MAX_POINTS], k_hat[MAX_POINTS], layer[MAX_POINTS];
    double ratio[MAX_POINTS], slope[MAX_POINTS], log_k[MAX_POINTS], log_layer[MAX_POINTS];
    int thermal = softens_with_heat(&p);
    for (size_t first = 0; first < n; first += MAX_POINTS) {
        const force_element_input *in = input + first;
        size_t count = n - first < MAX_POINTS ? n - first : MAX_POINTS;
        for (size_t i = 0; i < count; i++) {
            int loaded = is_loaded(parameters, in[i].normal_load);
            if (loaded && in[i].normal_load != p.nominal_load) {
                p = force_element_at_load(parameters, in[i].normal_load);
                scales = contact_scales_of(&p);
            }
            double slip = slip_of(&p, &in[i]), size = fabs(slip), decay = decay_at(&p, size);
            friction_fall fall = falling_friction(table, &p, scales, &in[i], size, decay, thermal);
            at[i] = begin_force(table, &p, scales, &in[i], &fall, direction_of(slip));
            add_layer(&p, &at[i]);
            x[i] = at[i].place.x;
            k_hat[i] = at[i].place.k_hat;
            layer[i] = at[i].place.layer_ratio;
        }
        evaluate_points(table, count, x, k_hat, layer, ratio, slope, log_k, log_layer);
        for (size_t i = 0; i < count; i++) {
            force_element_output *out = &output[first + i];
            creep_value q = {ratio[i], slope[i], log_k[i], log_layer[i]};
            if (!can_grip(parameters, &in[i]) || has_lateral_or_spin(table, &in[i])) {
                force_element_evaluate(table, parameters, &in[i], out);
                continue;
            }
            finish_force(table, parameters, &in[i], &at[i], q, out);
            if (remembers(parameters)) {
                force_element_parameters there =
                    force_element_at_load(parameters, in[i].normal_load);
                memory_action(&there, &in[i], &at[i], out);
            }
        }
    }
}

#define LANES 16
#include "drivetrain_many.h"

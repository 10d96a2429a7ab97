/* The force of LANES contacts up to the values of the table. */
#ifndef FORCE_LANES_H
#define FORCE_LANES_H

#include "force_element_formula.h"
#include "lanes.h"
#include "table_points.h"

/* States of the formulas, and arguments and values of the table. */
typedef struct {
    lanes state[FIELDS(force_state)];
    lanes x, k_hat, layer, ratio, slope, log_k, log_layer;
} force_lanes;

ALWAYS_INLINE void put_force_state(force_lanes *f, int l, const force_state *at) {
    put(f->state, l, FIELDS(force_state), (const double *)at);
    f->x[l] = at->place.x;
    f->k_hat[l] = at->place.k_hat;
    f->layer[l] = at->place.layer_ratio;
}

/* Begin with one lane; parameters and scales are those at its load. */
ALWAYS_INLINE void begin_lane(force_lanes *f, int l, const creep_table *table,
                              const force_element_parameters *p, contact_scales scales,
                              const force_element_input *in, int thermal) {
    double slip = slip_of(p, in), size = fabs(slip), decay = slip_decay(p, size);
    friction_fall fall = falling_friction(table, p, scales, in, size, decay, thermal);
    force_state at = begin_force(table, p, scales, in, &fall, direction_of(slip));
    put_force_state(f, l, &at);
}

/* Set the values of the table, with the layer of contacts that have one. */
ALWAYS_INLINE void evaluate_lanes(force_lanes *f, const creep_table *table, lanes *parameters,
                                  int layered, int derivatives) {
    if (layered) {
        stiffness_left left[LANES];
        lanes *scales = f->state + PLACE(force_state, scales);
        stiffness_of_layers(LANES, parameters[PLACE(force_element_parameters, softening)],
                            f->state[PLACE(force_state, x)],
                            scales[PLACE(contact_scales, layer_ratio)], left);
        EACH_LANE (l) {
            TAKE(force_element_parameters, p, parameters);
            TAKE(force_state, at, f->state);
            add_layer(&p, left[l], &at);
            put_force_state(f, l, &at);
        }
    }
    if (derivatives)
        evaluate_points(table, LANES, f->x, f->k_hat, f->layer, f->ratio, f->slope, f->log_k,
                        f->log_layer);
    else evaluate_points(table, LANES, f->x, f->k_hat, f->layer, f->ratio, NULL, NULL, NULL);
}

#endif

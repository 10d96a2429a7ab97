/* The force of LANES contacts at once, each with parameters of its own. */
#ifndef CONTACT_LANES_H
#define CONTACT_LANES_H

#include "force_lanes.h"
#include "lateral_spin_force.h"

/* Contacts with the same table, with or without memory. */
typedef struct {
    const creep_table *table;
    int remembering;
    int thermal, layered; /* 1 if friction softens, or there is a layer, in any lane */
    const force_element_parameters *given[LANES];
    int alone[LANES]; /* 1 without load or friction, or with lateral slip or spin */
    lanes there[FIELDS(force_element_parameters)]; /* at each one's load */
    lanes scales[FIELDS(contact_scales)];
    lanes in[FIELDS(force_element_input)], out[FIELDS(force_element_output)];
} contacts;

static inline void contacts_begin(contacts *c, const creep_table *table,
                                  const force_element_parameters *given) {
    c->table = table;
    c->remembering = remembers(given);
    c->thermal = c->layered = 0;
    for (int l = 0; l < LANES; l++) c->given[l] = NULL;
}

/* Put a contact into a lane, with its parameters and scales at the load if there is one. */
ALWAYS_INLINE void contacts_put(contacts *c, int l, const force_element_parameters *given,
                                const force_element_parameters *there,
                                const contact_scales *scales) {
    put(c->there, l, FIELDS(force_element_parameters), (const double *)there);
    put(c->scales, l, FIELDS(contact_scales), (const double *)scales);
    c->given[l] = given;
    c->thermal |= softens_with_heat(given);
    c->layered |= has_layer(given);
}

/* Load a contact and its input into a lane. */
static inline void contacts_load(contacts *c, int l, const force_element_parameters *given,
                                 const force_element_input *in) {
    int grips = can_grip(given, in);
    double load = grips ? in->normal_load : given->nominal_load;
    if (c->given[l] != given ||
        c->there[PLACE(force_element_parameters, nominal_load)][l] != load) {
        force_element_parameters there = force_element_at_load(given, load);
        contact_scales scales = contact_scales_of(c->table, &there);
        contacts_put(c, l, given, &there, &scales);
    }
    c->alone[l] = !grips || has_lateral_or_spin(c->table, in) || holds_lateral(in);
    put(c->in, l, FIELDS(force_element_input), (const double *)in);
}

#define INPUT(field) in[PLACE(force_element_input, field)]
#define OUTPUT_OF(field) out[PLACE(force_element_output, field)]
#define STORE(field) c->OUTPUT_OF(field)[l] = out.field

/* Which outputs to set: creep force and rates of the memory, also the derivatives that the
 * equations of motion need, or all. */
enum { ONLY_FORCE, MOTION, ALL };

/* Without memory the derivatives of its rates, which are the last outputs, are 0 and not set. */
enum { NO_MEMORY_FIELDS = PLACE(force_element_output, force_by_memory) };

ALWAYS_INLINE void evaluate_together(contacts *c, int thermal, int remembering, int which) {
    force_lanes f;
    EACH_LANE (l) {
        TAKE(force_element_parameters, p, c->there);
        TAKE(force_element_input, in, c->in);
        TAKE(contact_scales, scales, c->scales);
        begin_lane(&f, l, c->table, &p, scales, &in, thermal);
    }
    evaluate_lanes(&f, c->table, c->there, c->layered, which != ONLY_FORCE);
    if (remembering && c->table->lateral_spin != NULL) { /* no lateral force is held here */
        memset(&c->OUTPUT_OF(held_rate), 0, MEMORY_STATES * sizeof(lanes));
        memset(&c->OUTPUT_OF(force_by_memory), 0, 8 * MEMORY_STATES * sizeof(lanes));
    }
    EACH_LANE (l) {
        TAKE(force_element_parameters, p, c->there);
        TAKE(force_element_input, in, c->in);
        TAKE(force_state, at, f.state);
        creep_value q = {f.ratio[l], 0.0, 0.0, 0.0};
        if (which != ONLY_FORCE) {
            q.slope = f.slope[l];
            q.log_k_derivative = f.log_k[l];
            q.log_layer_derivative = f.log_layer[l];
        }
        force_element_output out;
        finish_force(c->table, &p, &in, &at, q, &out);
        if (remembering) memory_action(1, &p, &in, &at, which != ONLY_FORCE, which == ALL, &out);
        if (which == ALL) {
            put(c->out, l, remembering ? (int)FIELDS(force_element_output) : (int)NO_MEMORY_FIELDS,
                (const double *)&out);
            continue;
        }
        STORE(creep_force);
        if (remembering) {
            const double *rate = &out.held_rate;
            UNROLLED for (int i = 0; i < LATERAL; i++)(&c->OUTPUT_OF(held_rate))[i][l] = rate[i];
        }
        if (which == ONLY_FORCE) continue;
        STORE(force_by_omega);
        STORE(force_by_speed);
        STORE(saturation_creepage);
        if (!remembering) continue;
        lanes *by = &c->OUTPUT_OF(force_by_memory), *rate_by = &c->OUTPUT_OF(memory_by);
        UNROLLED for (int i = 0; i < LATERAL; i++) by[i][l] = out.force_by_memory[i];
        UNROLLED for (int i = 0; i < LATERAL; i++) UNROLLED for (int k = 0; k < 2 + LATERAL; k++)
            rate_by[(2 + MEMORY_STATES) * i + k][l] = out.memory_by[i][k];
    }
}

/* Velocities and memory may have changed since the loading. */
ALWAYS_INLINE void evaluate_contacts_of(contacts *c, int which) {
    int alone = 0;
    for (int l = 0; l < LANES; l++) alone += c->alone[l];
    if (alone == LANES) { /* nothing is left to do together */
    } else if (c->remembering && c->thermal) evaluate_together(c, 1, 1, which);
    else if (c->remembering) evaluate_together(c, 0, 1, which);
    else if (c->thermal) evaluate_together(c, 1, 0, which);
    else evaluate_together(c, 0, 0, which);
    for (int l = 0; alone > 0 && l < LANES; l++) {
        if (!c->alone[l]) continue;
        TAKE(force_element_input, in, c->in);
        force_element_output out;
        force_element_evaluate(c->table, c->given[l], &in, &out);
        put(c->out, l, FIELDS(force_element_output), (const double *)&out);
    }
}

/* One function each, as the compiler leaves out what the caller does not need. */
static inline void contacts_evaluate_force(contacts *c) { evaluate_contacts_of(c, ONLY_FORCE); }

static inline void contacts_evaluate_motion(contacts *c) { evaluate_contacts_of(c, MOTION); }

static inline void contacts_evaluate_all(contacts *c) { evaluate_contacts_of(c, ALL); }

#endif

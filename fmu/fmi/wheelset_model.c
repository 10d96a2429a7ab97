/* The models "wheelset" and "wheelset_body", which has no contact of its own. */
#include "model_functions.h"
#include "wheelset_step.h"

static wheelset_parameters body_of(const model_values *v) {
    wheelset_parameters body = v->body;
    body.radius = v->contact.radius;
    body.minimum_speed = v->contact.minimum_speed;
    return body;
}

void evaluate_body(const creep_table *table, model_values *v) {
    (void)table;
    wheelset_parameters body = body_of(v);
    wheelset_motion(&body, v->input.omega, v->input.speed, v->drive_torque, v->resistance_force,
                    &v->output, &v->rates);
}

void evaluate_wheelset(const creep_table *table, model_values *v) {
    force_element_evaluate(table, &v->contact, &v->input, &v->output);
    evaluate_body(table, v);
}

/* Change of the accelerations, from that of the creep force. */
static void follow_motion(const model_values *v, const model_values *direction, double dforce,
                          wheelset_rates *change) {
    const force_element_input *din = &direction->input;
    change->omega_rate =
        (direction->drive_torque - v->contact.radius * dforce - v->body.damping * din->omega) /
        v->body.inertia;
    change->speed_rate =
        (dforce - v->rates.resistance_slope * din->speed - direction->resistance_force) *
        v->body.inverse_mass;
}

void tangent_wheelset(const creep_table *table, const model_values *v,
                      const model_values *direction, model_values *change) {
    force_element_tangent(table, &v->contact, &v->input, &v->output, &direction->input,
                          &change->output);
    follow_motion(v, direction, change->output.creep_force, &change->rates);
}

void tangent_body(const creep_table *table, const model_values *v, const model_values *direction,
                  model_values *change) {
    (void)table;
    follow_motion(v, direction, direction->output.creep_force, &change->rates); /* an input here */
}

/* Step the states with all else held. */
static const char *advance_states(const creep_table *table, const force_element_parameters *contact,
                                  const wheelset_input *held, model_values *v, double step,
                                  double tolerance) {
    wheelset_parameters body = body_of(v);
    wheelset_state state = {.omega = v->input.omega,
                            .speed = v->input.speed,
                            .held_traction = v->input.held_traction,
                            .held_lateral = v->input.held_lateral,
                            .unslipped = v->input.unslipped};
    const char *error =
        wheelset_advance(table, contact, &body, held, &state, step, &tolerance, &v->substep);
    if (error != NULL) return error;
    v->held_tolerance = tolerance;
    v->input.omega = state.omega;
    v->input.speed = state.speed;
    v->input.held_traction = state.held_traction;
    v->input.held_lateral = state.held_lateral;
    v->input.unslipped = state.unslipped;
    return NULL;
}

const char *advance_wheelset(const creep_table *table, model_values *v, double step,
                             double tolerance) {
    wheelset_input held = {.drive_torque = v->drive_torque,
                           .resistance_force = v->resistance_force,
                           .normal_load = v->input.normal_load,
                           .friction_scale = v->input.friction_scale,
                           .lateral_velocity = v->input.lateral_velocity,
                           .spin_velocity = v->input.spin_velocity};
    return advance_states(table, &v->contact, &held, v, step, tolerance);
}

/* The same equations with an unloaded contact; torque and resistance contain the held creep force.
 */
const char *advance_body(const creep_table *table, model_values *v, double step, double tolerance) {
    (void)table;
    static const creep_table none = {.k_max = 1.0};
    force_element_parameters contact = {.radius = v->contact.radius,
                                        .kinetic_friction = 1.0,
                                        .static_friction = 1.0,
                                        .slip_rate_residual = 1.0,
                                        .minimum_speed = v->contact.minimum_speed};
    double force = v->output.creep_force;
    wheelset_input held = {.drive_torque = v->drive_torque - contact.radius * force,
                           .resistance_force = v->resistance_force - force,
                           .friction_scale = 1.0};
    return advance_states(&none, &contact, &held, v, step, tolerance);
}

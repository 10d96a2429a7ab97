/* The model "force_element", whose force is held, remembers or is implicit. */
#include <math.h>
#include <string.h>

#include "force_element_formula.h"
#include "model_functions.h"
#include "simd_math.h"
#include "wheelset_step.h"

/* The hint where the coupling does not limit the step [s]. */
static const double LONG_STEP = 1000.0;

/* Half of the maximum step over which the force may be held. Stability needs h lambda < 2 with the
 * slip pole lambda, or h lambda < 1 if both sides step at once. A contact with memory is a spring,
 * never stiffer than while it sticks: h < 2/omega is enough too, with the frequency omega of the
 * wheel on that spring. */
static double stable_step(const model_values *v) {
    double gradient = fabs(v->output.force_gradient), pole = gradient * v->effective_inverse_mass;
    double hint = v->parallel_exchange != 0.0 ? 0.5 / pole : 1.0 / pole;
    if (v->contact.relaxation_length > 0.0 && v->parallel_exchange == 0.0) {
        double load = is_loaded(&v->contact, v->input.normal_load) ? v->input.normal_load : 0.0;
        force_element_parameters p =
            load > 0.0 ? force_element_at_load(&v->contact, load) : v->contact;
        double compliance = 2.0 * p.peak_pressure * p.relaxation_length /
                            (p.contact_modulus * p.slope_reduction * p.initial_slope);
        double stiffness = fmax(p.standing_stiffness, 1.0) * load / compliance;
        hint = fmax(hint, 1.0 / sqrt(stiffness * v->effective_inverse_mass));
    }
    return v->implicit == 0.0 && hint < LONG_STEP ? hint : LONG_STEP; /* false for NaN */
}

void evaluate_force(const creep_table *table, model_values *v) {
    if (v->implicit != 0.0 && v->memory.known != 0.0) return; /* the last step set the outputs */
    force_element_evaluate(table, &v->contact, &v->input, &v->output);
    v->step_size_hint = stable_step(v);
}

#ifndef ONE_FILE_KERNEL
void tangent_force(const creep_table *table, const model_values *v, const model_values *direction,
                   model_values *change) {
    if (v->implicit != 0.0 && v->memory.known != 0.0) return;
    force_element_tangent(table, &v->contact, &v->input, &v->output, &direction->input,
                          &change->output);
}
#endif /* ONE_FILE_KERNEL */

/* Count the turns of a force that oscillates from step to step and makes the slip oscillate: the
 * slip's acceleration then changes by minus an inverse mass times the change of the force, and
 * nothing else of that size changes it. A force that its surroundings excite lacks this effect, and
 * one that oscillates slowly turns less often. */
static void count_turns(slip_memory *memory, double force, double rate, double friction_force) {
    static const double FADING = 0.9, MIN_SWING = 0.05, MIN_CORRELATION = 0.95, MAX_PAUSE = 25.0;
    double rise = force - memory->acting, bend = rate - memory->rate;
    double *sums = memory->products;
    sums[0] = FADING * sums[0] + rise * rise;
    sums[1] = FADING * sums[1] + rise * bend;
    sums[2] = FADING * sums[2] + bend * bend;
    if (!(sums[0] + fabs(sums[1]) + sums[2] < 1e100)) sums[0] = sums[1] = sums[2] = 0.0;
    int large = fabs(rise) > MIN_SWING * friction_force;
    int turning = large && rise * memory->rise < 0.0;
    int follows = sums[1] < 0.0 && sums[1] * sums[1] > MIN_CORRELATION * sums[0] * sums[2];
    memory->steady = turning ? 0.0 : fmin(memory->steady + 1.0, 1e3);
    memory->turns = turning ? fmin(memory->turns + 1.0, DOUBTFUL_STEPS) : memory->turns;
    if (!follows || memory->steady > MAX_PAUSE) memory->turns = 0.0;
    if (large) memory->rise = rise;
    memory->acting = force;
    memory->rate = rate;
}

/* The inverse mass with which the slip follows the force [1/kg]. */
static double followed_inverse_mass(const slip_memory *memory) {
    return -memory->products[1] / memory->products[0];
}

/* The memory at the start of a step, with the last step judged. Either the last force or the one
 * before may have acted in it; each hypothesis gives a slip acceleration by everything else. The
 * drive is independent of our steps: if it follows their oscillation under the declared hypothesis
 * and not under the other one, the declaration is wrong. A drive that oscillates by itself, at any
 * frequency, makes both rough. */
static slip_memory judged(const model_values *v) {
    static const double FADING = 0.8, MIN_SWING = 0.1, MIN_CONTRAST = 30.0;
    slip_memory memory = v->memory;
    double m = v->effective_inverse_mass, friction = v->contact.static_friction;
    double slip = v->contact.radius * v->input.omega - v->input.speed;
    double swing = MIN_SWING * m * friction * v->input.friction_scale * v->input.normal_load;
    double rate = (slip - memory.slip) / memory.step;
    if (memory.known == 0.0) return memory;
    int parallel = v->parallel_exchange != 0.0;
    double force[2] = {parallel ? memory.previous : memory.force,
                       parallel ? memory.force : memory.previous};
    for (int i = 0; i < 2; i++) {
        double external = rate + m * force[i], change = external - memory.external[i];
        memory.external[i] = external;
        memory.roughness[i] = FADING * memory.roughness[i] + change * change;
        if (!(memory.roughness[i] < 1e100)) memory.roughness[i] = memory.external[i] = 0.0;
    }
    count_turns(&memory, force[0], rate, friction * v->input.friction_scale * v->input.normal_load);
    int rough = memory.roughness[0] > swing * swing && swing > 0.0;
    int doubtful = rough && memory.roughness[0] > MIN_CONTRAST * memory.roughness[1];
    memory.doubtful = doubtful ? fmin(memory.doubtful + 1.0, DOUBTFUL_STEPS) : 0.0;
    return memory;
}

/* The implicit mode. During a step the slip velocity w obeys dw/dt = a - m Q(w), where m is the
 * effective inverse mass and a the slip acceleration by everything except the creep force. The
 * value of a in the step before follows from the slip at its ends and the force that acted; it is
 * assumed to continue. The element solves the equation and gives the mean force, so the tool's body
 * moves as in a solution of the coupled equations. A wheel of inertia r^2 / m at held speed, driven
 * by a torque a r / m, has the same equation of slip. */
static const char *step_slip(const creep_table *table, model_values *v, double step,
                             double tolerance) {
    const force_element_parameters *contact = &v->contact;
    double m = v->effective_inverse_mass, radius = contact->radius;
    double slip = radius * v->input.omega - v->input.speed, a;
    slip_memory memory = judged(v);
    if (memory.known == 0.0) { /* assume a steady slip */
        memory.force = v->output.creep_force;
        a = m * memory.force;
    } else {
        a = (slip - memory.slip) / memory.step + m * memory.applied;
    }
    double start = slip;
    if (v->parallel_exchange != 0.0) { /* the last force acts in this step, the new one after it */
        start += step * (a - m * memory.force);
        memory.applied = memory.force;
    }
    wheelset_parameters body;
    memset(&body, 0, sizeof body);
    body.radius = radius;
    body.inertia = radius * radius / m;
    body.minimum_speed = contact->minimum_speed;
    wheelset_input given = {a * radius / m,
                            0.0,
                            v->input.normal_load,
                            v->input.friction_scale,
                            v->input.lateral_velocity,
                            v->input.spin_velocity};
    wheelset_state state = {(start + v->input.speed) / radius, v->input.speed,
                            v->input.held_traction, v->input.held_lateral, v->input.unslipped};
    double begin = radius * state.omega - state.speed;
    const char *error =
        wheelset_advance(table, contact, &body, &given, &state, step, &tolerance, &v->substep);
    if (error != NULL) return error;
    v->held_tolerance = tolerance;
    if (memory.turns >= DOUBTFUL_STEPS) { /* see the guide for these bounds */
        double found = followed_inverse_mass(&memory);
        int parallel = v->parallel_exchange != 0.0;
        if (found > (parallel ? 1.25 : 1.3) * m || (parallel && found < 0.8 * m))
            memory.misfit = found;
    }
    memory.previous = memory.force;
    double end = radius * state.omega - state.speed;
    /* Under a small load the rounding of this difference may exceed the force. */
    double load = fmax(0.0, v->input.normal_load);
    double largest = contact->static_friction * v->input.friction_scale * load;
    memory.force = fmin(largest, fmax(-largest, (a - (end - begin) / step) / m));
    memory.known = 1.0;
    memory.slip = slip;
    memory.step = step;
    if (v->parallel_exchange == 0.0) memory.applied = memory.force;

    force_element_input last = v->input;
    last.omega = state.omega;
    last.held_traction = v->input.held_traction = state.held_traction;
    last.held_lateral = v->input.held_lateral = state.held_lateral;
    last.unslipped = v->input.unslipped = state.unslipped;
    force_element_evaluate(table, contact, &last, &v->output);
    v->memory = memory;
    int loaded = v->output.saturation_creepage > 0.0;
    v->output.creep_force = loaded ? memory.force : 0.0;
    v->output.wheel_torque = -radius * v->output.creep_force;
    v->output.traction_coefficient = loaded ? memory.force / v->input.normal_load : 0.0;
    return NULL;
}

/* A force that is held or remembers needs no solution: store the step, to detect instability. */
static void remember(const creep_table *table, model_values *v, double step) {
    double force = v->output.creep_force;
    slip_memory memory = judged(v);
    if (memory.turns >= DOUBTFUL_STEPS) { /* the pole is largest where there is no slip */
        model_values rolling = *v;
        rolling.effective_inverse_mass =
            fmin(v->effective_inverse_mass, followed_inverse_mass(&memory));
        rolling.input.omega = v->input.speed / v->contact.radius;
        rolling.input.held_traction = rolling.input.held_lateral = 0.0;
        rolling.input.unslipped = 1.0;
        evaluate_force(table, &rolling);
        double longest = 2.0 * rolling.step_size_hint;
        if (memory.step > longest) memory.too_long = longest;
    }
    if (memory.known == 0.0) memory.force = force;
    if (v->contact.relaxation_length == 0.0) memory.previous = memory.force, memory.force = force;
    double stable = 2.0 * v->step_size_hint;
    if (memory.stable == 0.0 || stable < memory.stable) memory.stable = stable;
    memory.known = 1.0;
    memory.slip = v->contact.radius * v->input.omega - v->input.speed;
    memory.step = step;
    v->memory = memory;
}

const char *advance_force(const creep_table *table, model_values *v, double step,
                          double tolerance) {
    if (v->implicit != 0.0) return step_slip(table, v, step, tolerance);
    remember(table, v, step);
    if (v->contact.relaxation_length > 0.0) { /* the tool applies the force at the step's end */
        const char *error = force_element_advance(table, &v->contact, &v->input, step, tolerance);
        if (error != NULL) return error;
        evaluate_force(table, v);
        v->memory.previous = v->memory.force, v->memory.force = v->output.creep_force;
    }
    return NULL;
}

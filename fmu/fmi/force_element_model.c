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
static double stable_step(const creep_table *table, const model_values *v) {
    double gradient = fabs(force_element_steepest(table, &v->contact, &v->input, &v->output));
    double pole = gradient * v->effective_inverse_mass;
    double hint = v->parallel_exchange != 0.0 ? 0.5 / pole : 1.0 / pole;
    if (remembers(&v->contact) && v->parallel_exchange == 0.0) {
        double load = is_loaded(&v->contact, v->input.normal_load) ? v->input.normal_load : 0.0;
        force_element_parameters p =
            load > 0.0 ? force_element_at_load(&v->contact, load) : v->contact;
        contact_scales s = contact_scales_of(table, &p);
        double compliance = 2.0 * p.peak_pressure * s.relaxation_length /
                            (p.contact_modulus * p.slope_reduction * s.initial_slope);
        double stiffness = fmax(s.standing_stiffness, 1.0) * load / compliance;
        hint = fmax(hint, 1.0 / sqrt(stiffness * v->effective_inverse_mass));
    }
    return v->implicit == 0.0 && hint < LONG_STEP ? hint : LONG_STEP; /* false for NaN */
}

void evaluate_contacts(const creep_table *table, model_values *values, size_t n) {
    force_task tasks[MAX_WHEELS];
    if (n == 1) {
        force_element_evaluate(table, &values->contact, &values->input, &values->output);
        return;
    }
    for (size_t i = 0; i < n; i++) {
        tasks[i].parameters = &values[i].contact;
        tasks[i].input = &values[i].input;
        tasks[i].output = &values[i].output;
    }
    force_elements_evaluate(table, tasks, n);
}

/* Whether the last step set the outputs. */
static int is_stepped(const model_values *v) {
    return v->implicit != 0.0 && v->memory.known != 0.0;
}

void evaluate_force(const creep_table *table, model_values *values, size_t n) {
    if (is_stepped(values)) return; /* wheels are stepped together */
    evaluate_contacts(table, values, n);
    for (size_t i = 0; i < n; i++) values[i].step_size_hint = stable_step(table, &values[i]);
}

#ifndef ONE_FILE_KERNEL
void tangent_force(const creep_table *table, const model_values *v, const model_values *direction,
                   model_values *change) {
    if (is_stepped(v)) return;
    force_element_tangent(table, &v->contact, &v->input, &v->output, &direction->input,
                          &change->output);
}
#endif /* ONE_FILE_KERNEL */

/* Weight of a square in a sum in which older ones count less: it counts as much as the others and a
 * usual one together at most, so that one wild jump of the inputs does not hide the steps after it.
 */
static double weight_of(double square, double sum, double usual) {
    return square > sum + usual ? (sum + usual) / square : 1.0;
}

/* Count the turns of a force that oscillates from step to step and makes the slip oscillate: the
 * slip's acceleration then changes by minus an inverse mass times the change of the force, and
 * nothing else of that size changes it. A force that its surroundings excite lacks this effect, and
 * one that oscillates slowly turns less often. */
static void count_turns(slip_memory *memory, double force, double rate, double friction_force,
                        double inverse_mass) {
    static const double FADING = 0.9, MIN_SWING = 0.05, MIN_CORRELATION = 0.95, MAX_PAUSE = 25.0;
    double rise = force - memory->acting, bend = rate - memory->rate;
    double *sums = memory->products, usual = inverse_mass * friction_force;
    double weight = weight_of(bend * bend, sums[2], usual * usual);
    sums[0] = FADING * sums[0] + weight * rise * rise;
    sums[1] = FADING * sums[1] + weight * rise * bend;
    sums[2] = FADING * sums[2] + weight * bend * bend;
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
        double weight = weight_of(change * change, memory.roughness[i], swing * swing);
        memory.external[i] = external;
        memory.roughness[i] = FADING * memory.roughness[i] + weight * change * change;
        if (!(memory.roughness[i] < 1e100)) memory.roughness[i] = memory.external[i] = 0.0;
    }
    count_turns(&memory, force[0], rate, friction * v->input.friction_scale * v->input.normal_load,
                m);
    int rough = memory.roughness[0] > swing * swing && swing > 0.0;
    int doubtful = rough && memory.roughness[0] > MIN_CONTRAST * memory.roughness[1];
    memory.doubtful = doubtful ? fmin(memory.doubtful + 1.0, DOUBTFUL_STEPS) : 0.0;
    return memory;
}

/* A step of the implicit mode. */
typedef struct {
    slip_memory memory;
    double acceleration; /* a [m/s2] */
    double slip, begin;  /* slip velocity as the tool gave it, and where the step begins [m/s] */
    wheelset_parameters body;
} slip_step;

/* The implicit mode. During a step the slip velocity w obeys dw/dt = a - m Q(w), where m is the
 * effective inverse mass and a the slip acceleration by everything except the creep force. The
 * value of a in the step before follows from the slip at its ends and the force that acted; it is
 * assumed to continue. The element solves the equation and gives the mean force, so the tool's body
 * moves as in a solution of the coupled equations. A wheel of inertia r^2 / m at held speed, driven
 * by a torque a r / m, has the same equation of slip. */
static void begin_slip_step(const model_values *v, double step, double tolerance, slip_step *s,
                            wheelset_task *task) {
    double m = v->effective_inverse_mass, radius = v->contact.radius, a;
    slip_memory memory = judged(v);
    s->slip = radius * v->input.omega - v->input.speed;
    if (memory.known == 0.0) { /* assume a steady slip */
        memory.force = v->output.creep_force;
        a = m * memory.force;
    } else {
        a = (s->slip - memory.slip) / memory.step + m * memory.applied;
    }
    double start = s->slip;
    if (v->parallel_exchange != 0.0) { /* the last force acts in this step, the new one after it */
        start += step * (a - m * memory.force);
        memory.applied = memory.force;
    }
    memset(&s->body, 0, sizeof s->body);
    s->body.radius = radius;
    s->body.inertia = radius * radius / m;
    s->body.minimum_speed = v->contact.minimum_speed;
    memset(task, 0, sizeof *task);
    task->contact = &v->contact;
    task->body = &s->body;
    task->drive_torque = a * radius / m;
    task->input = v->input;
    task->input.omega = (start + v->input.speed) / radius;
    task->tolerance = tolerance;
    task->substep = v->substep;
    task->max_substeps = v->max_substeps;
    s->begin = radius * task->input.omega - v->input.speed;
    s->acceleration = a;
    s->memory = memory;
}

/* Set force and memory after the step; the outputs are those at its end. */
static void end_slip_step(model_values *v, double step, const slip_step *s,
                          const wheelset_task *task) {
    double m = v->effective_inverse_mass, radius = v->contact.radius;
    slip_memory memory = s->memory;
    if (memory.turns >= DOUBTFUL_STEPS) { /* see the guide for these bounds */
        double found = followed_inverse_mass(&memory);
        int parallel = v->parallel_exchange != 0.0;
        if (found > (parallel ? 1.25 : 1.3) * m || (parallel && found < 0.8 * m))
            memory.misfit = found;
    }
    memory.previous = memory.force;
    double end = radius * task->input.omega - task->input.speed;
    /* Under a small load the rounding of this difference may exceed the force. */
    double load = fmax(0.0, v->input.normal_load);
    double largest = v->contact.static_friction * v->input.friction_scale * load;
    double mean = (s->acceleration - (end - s->begin) / step) / m;
    memory.force = fmin(largest, fmax(-largest, mean));
    memory.known = 1.0;
    memory.slip = s->slip;
    memory.step = step;
    if (v->parallel_exchange == 0.0) memory.applied = memory.force;
    v->memory = memory;
    v->held_tolerance = task->tolerance;
    v->substep = task->substep;
    take_memory(&v->input, &task->input);
    if (!can_grip(&v->contact, &v->input)) return;
    force_element_parameters there = force_element_at_load(&v->contact, load);
    v->output.creep_force = memory.force;
    v->output.traction_coefficient = memory.force / load;
    set_by_force(&there, &task->input, &v->output);
}

static const char *step_slips(const creep_table *table, model_values *values, size_t n, double step,
                              double tolerance, size_t *failed) {
    slip_step steps[MAX_WHEELS];
    wheelset_task tasks[MAX_WHEELS];
    force_task ends[MAX_WHEELS];
    for (size_t i = 0; i < n; i++) {
        begin_slip_step(&values[i], step, tolerance, &steps[i], &tasks[i]);
        ends[i].parameters = &values[i].contact;
        ends[i].input = &tasks[i].input;
        ends[i].output = &values[i].output;
    }
    const char *error = wheelsets_advance(table, tasks, n, step, failed);
    if (error != NULL) values[*failed].substep = tasks[*failed].substep;
    if (error != NULL) return error;
    force_elements_evaluate(table, ends, n);
    for (size_t i = 0; i < n; i++) end_slip_step(&values[i], step, &steps[i], &tasks[i]);
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
        forget(&rolling.input);
        evaluate_force(table, &rolling, 1);
        double longest = 2.0 * rolling.step_size_hint;
        if (memory.step > longest) memory.too_long = longest;
    }
    if (memory.known == 0.0) memory.force = force;
    if (!remembers(&v->contact)) memory.previous = memory.force, memory.force = force;
    double stable = 2.0 * v->step_size_hint;
    if (memory.stable == 0.0 || stable < memory.stable) memory.stable = stable;
    memory.known = 1.0;
    memory.slip = v->contact.radius * v->input.omega - v->input.speed;
    memory.step = step;
    v->memory = memory;
}

/* Advance the memory of the contacts at held velocities. */
static const char *advance_memories(const creep_table *table, model_values *values, size_t n,
                                    double step, double tolerance, size_t *failed) {
    wheelset_task tasks[MAX_WHEELS];
    for (size_t i = 0; i < n; i++) {
        memset(&tasks[i], 0, sizeof tasks[i]);
        tasks[i].contact = &values[i].contact;
        tasks[i].input = values[i].input;
        tasks[i].tolerance = tolerance;
        tasks[i].max_substeps = values[i].max_substeps;
    }
    const char *error = wheelsets_advance(table, tasks, n, step, failed);
    for (size_t i = 0; i < n && error == NULL; i++) {
        remember(table, &values[i], step);
        values[i].input = tasks[i].input;
    }
    return error;
}

const char *advance_force(const creep_table *table, model_values *values, size_t n, double step,
                          double tolerance, size_t *failed) {
    if (values->implicit != 0.0) return step_slips(table, values, n, step, tolerance, failed);
    if (!remembers(&values->contact)) {
        for (size_t i = 0; i < n; i++) remember(table, &values[i], step);
        return NULL;
    }
    const char *error = advance_memories(table, values, n, step, tolerance, failed);
    if (error != NULL) return error;
    evaluate_force(table, values, n); /* the tool applies the force at the step's end */
    for (size_t i = 0; i < n; i++) {
        model_values *v = &values[i];
        v->memory.previous = v->memory.force, v->memory.force = v->output.creep_force;
    }
    return NULL;
}

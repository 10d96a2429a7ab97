/* @text@
 * Written by contactlib @version@.
 *
 * Creep force of @carriers@ without FMI, in C99 or C++: no file is read, nothing is allocated, and
 * the state is the caller's, so any number of contacts and threads can call these functions.
 * Everything is in SI units; x forward, y to the left, z upwards. Slip and creepage are positive
 * in traction, and forces are those on the wheel. Lateral velocity and spin are zero at the start;
 * only an ellipse on a half-space answers spin.
 *
 *     contactlib_element wheel;
 *     contactlib_start(&wheel);
 *     for (;;) {
 *         wheel.input.omega = ...; wheel.input.speed = ...; wheel.input.normal_load = ...;
 *         error = contactlib_step(&wheel, 1e-3, CONTACTLIB_TOLERANCE);
 *         ... apply wheel.output.creep_force and wheel_torque over this step
 *     }
 *
 * Compile contactlib.c with -O2 -ffp-contract=off -fno-math-errno -fno-trapping-math, and link the
 * C library's mathematics: then it gives the numbers of the model's FMU to the last bit. For the
 * bits only -ffp-contract=off matters, which keeps a * b + c from being rounded once where the
 * processor can; -ffast-math is refused. C leaves the sign of a zero open. */
#ifndef CONTACTLIB_H
#define CONTACTLIB_H

#ifdef __cplusplus
extern "C" {
#endif

@structs@
/* A contact between two steps. contactlib_start fills it; set its input before each step. */
typedef struct {
    contactlib_parameters contact;
    /* Slip acceleration per creep force, radius^2/inertia + 1/mass of what it moves [1/kg]. */
    double effective_inverse_mass;
    double implicit; /* 1, as at the start: the force is the mean over a step whose slip the
                        element solves, stable at any step; 0: it is held over the step */
    double parallel_exchange; /* 1 if a force acts on the wheel one step later [0 or 1] */
    contactlib_input input;
    contactlib_output output;
    double step_size_hint;    /* half of the largest stable step if the force is held [s] */
    contactlib_memory memory; /* of the steps before; the caller leaves it alone */
    double substep;           /* likewise */
    double held_tolerance;    /* that of the last implicit step: larger than the given one if the
                                 wheel swings too often on its contact to be followed, or if
                                 max_substeps could not meet it; then the estimated error */
    double max_substeps;      /* largest number of the integrator's substeps in a step, for a
                                 bounded time, rounded up; 0, as at the start: no limit */
} contactlib_element;

/* Relative tolerance of the slip over an implicit step, the default of an FMU. */
#define CONTACTLIB_TOLERANCE @tolerance@

/* Fill in parameters and inputs of the model; parameters may then be changed within their limits. */
void contactlib_start(contactlib_element *element);

/* Output at an input, with partial derivatives: the steady force, or that of the held traction if
 * the contact has memory, as with a relaxation length above zero. Returns NULL, or a text
 * that names what is out of its limits; the output is then unchanged. No friction (a friction
 * scale of zero) and no load are no errors: there is no force. */
const char *contactlib_force(const contactlib_parameters *parameters,
                             const contactlib_input *input, contactlib_output *output);

/* Make a step with the inputs held and set outputs, and the states of a memory, at its end. Returns
 * NULL, or a message: what is out of its limits, or why the step failed; the element is then
 * unchanged. The mean force of an implicit step replaces creep_force, wheel_torque and
 * traction_coefficient; what drives the slip is taken from its change over the step before, so a
 * tool calls this once for each of its steps and applies the force over that step. */
const char *contactlib_step(contactlib_element *element, double step, double tolerance);

#ifdef __cplusplus
}
#endif

#endif

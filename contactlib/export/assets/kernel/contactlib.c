/* @text@
 * Written by contactlib @version@; contactlib.h shows how to use and compile it. The parts are those
 * of the kernel in contactlib's FMUs. */
#include "contactlib.h"

#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-function" /* what only FMUs call */
#endif

#ifdef __FAST_MATH__
#error "contactlib needs IEEE arithmetic: compile it without -ffast-math"
#endif

@kernel@
/* ---- the model ------------------------------------------------------------------------------ */

@data@
/* ---- the interface of contactlib.h ---------------------------------------------------------- */

static const char *wrong_parameters(const contactlib_parameters *p) {
@limits_p@
    if (!(p->static_friction >= p->kinetic_friction))
        return "static_friction must be at least kinetic_friction";
    if (p->softening_temperature > 0.0 && p->slip_rate_decay > 0.0)
        return "softening_temperature and slip_rate_decay: at most one may be above 0";
    if (p->memory > 0.0 && !(p->body_modulus > 0.0 && p->transverse_half_length > 0.0))
        return "memory needs body_modulus and transverse_half_length";
@shape@
    if (p->memory > 0.0 && p->elliptic == 0.0 &&
        !(p->semi_width <= (1.0 + 1e-9) * MAX_LINE_ASPECT * p->transverse_half_length))
        return "memory needs a transverse_half_length of at least 2 semi_width";
    double expected = TABLE.static_to_kinetic * p->kinetic_friction;
    if (expected > 0.0 && !(fabs(p->static_friction - expected) <= 1e-9 * expected))
        return "static_friction over kinetic_friction must be the table's ratio";
    return NULL;
}

static const char *wrong_input(const contactlib_input *in) {
@limits_in@
    return NULL;
}

void contactlib_start(contactlib_element *element) {
    memset(element, 0, sizeof *element);
@start@
}

const char *contactlib_force(const contactlib_parameters *parameters,
                             const contactlib_input *input, contactlib_output *output) {
    const char *error = wrong_parameters(parameters);
    if (error == NULL) error = wrong_input(input);
    if (error == NULL) force_element_evaluate(&TABLE, parameters, input, output);
    return error;
}

static const char *wrong_step(const contactlib_element *e, double step, double tolerance) {
    const char *error = wrong_parameters(&e->contact);
    if (error == NULL) error = wrong_input(&e->input);
    if (error != NULL) return error;
@limits_e@
    if (!(step > 0.0 && step < INFINITY)) return "step must be finite and above zero";
    if (!(tolerance >= 1e-10 && tolerance <= 1e-2)) return "tolerance must be from 1e-10 to 1e-2";
    return NULL;
}

const char *contactlib_step(contactlib_element *element, double step, double tolerance) {
    const contactlib_element before = *element;
    const char *error = wrong_step(element, step, tolerance);
    if (error != NULL) return error;
    size_t failed = 0;
    evaluate_force(&TABLE, element, 1);
    error = advance_force(&TABLE, element, 1, step, tolerance, &failed);
    if (error == NULL) error = wrong_input(&element->input); /* the state may have left its limits */
    if (error != NULL) *element = before;
    return error;
}

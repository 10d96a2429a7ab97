#include <string.h>

#include "models.h"

#define LARGE 1e300
#define AT(member) offsetof(model_values, member)

/* ---- variables ----------------------------------------------------------------------------- */

const char TRUTH[] = "Boolean";

#define TIME {"time", "s", "simulation time", -LARGE, LARGE, AT(time), INDEPENDENT, ALWAYS}

/* clang-format off */
#define CONTACT_PARAMETERS \
    {"radius", "m", "rolling radius of the wheel", 1e-6, 1e6, AT(contact.radius), \
     FIXED_PARAMETER, ALWAYS}, \
    {"static_friction", "1", "friction coefficient before slip, not below the kinetic one", 1e-6, \
     1e3, AT(contact.static_friction), TUNABLE_PARAMETER, ALWAYS}, \
    {"kinetic_friction", "1", "friction coefficient after much slip", 1e-6, 1e3, \
     AT(contact.kinetic_friction), TUNABLE_PARAMETER, ALWAYS}, \
    {"weakening_length", "m", "slip over which friction weakens", 0.0, 1.0, \
     AT(contact.weakening_length), TUNABLE_PARAMETER, ALWAYS}, \
    {"slope_reduction", "1", "third-body layer: initial slope over the elastic one", 1e-6, 1.0, \
     AT(contact.slope_reduction), TUNABLE_PARAMETER, ALWAYS}, \
    {"slip_rate_residual", "1", "part of friction that high slip speed leaves", 1e-6, 1.0, \
     AT(contact.slip_rate_residual), TUNABLE_PARAMETER, ALWAYS}, \
    {"slip_rate_decay", "s/m", "rate at which friction falls with slip speed", 0.0, 1e6, \
     AT(contact.slip_rate_decay), TUNABLE_PARAMETER, ALWAYS}, \
    {"semi_width", "m", "contact semi-width at nominal load", 1e-9, 1e3, AT(contact.semi_width), \
     FIXED_PARAMETER, ALWAYS}, \
    {"peak_pressure", "Pa", "peak contact pressure at nominal load", 1e-3, 1e15, \
     AT(contact.peak_pressure), FIXED_PARAMETER, ALWAYS}, \
    {"contact_modulus", "Pa", "composite contact modulus", 1e-3, 1e15, \
     AT(contact.contact_modulus), FIXED_PARAMETER, ALWAYS}, \
    {"nominal_load", "N", "load of the given semi-width and peak pressure", 1e-6, 1e12, \
     AT(contact.nominal_load), FIXED_PARAMETER, ALWAYS}, \
    {"load_exponent", "1", "semi-width and pressure grow like load to this power", 0.0, 1.0, \
     AT(contact.load_exponent), FIXED_PARAMETER, ALWAYS}, \
    {"minimum_speed", "m/s", "speed below which the creepage is regularised", 1e-9, 1e3, \
     AT(contact.minimum_speed), FIXED_PARAMETER, ALWAYS}, \
    {"relaxation_length", "m", "distance rolled in which the force follows the creepage", 1e-6, \
     1e3, AT(contact.relaxation_length), FIXED_PARAMETER, IF_RELAXED}

#define CONTACT_INPUTS \
    {"normal_load", "N", "normal load", 0.0, 1e12, AT(input.normal_load), INPUT, ALWAYS}, \
    {"friction_scale", "1", "multiplies both friction coefficients", 1e-6, 1e3, \
     AT(input.friction_scale), INPUT, ALWAYS}

#define CONTACT_OUTPUTS \
    {"creep_force", "N", "force on the wheel, positive forward", -LARGE, LARGE, \
     AT(output.creep_force), OUTPUT, ALWAYS}, \
    {"wheel_torque", "N.m", "torque of the creep force on the wheel: -radius * creep_force", \
     -LARGE, LARGE, AT(output.wheel_torque), OUTPUT, ALWAYS}, \
    {"creepage", "1", "slip velocity over speed, positive in traction", -LARGE, LARGE, \
     AT(output.creepage), OUTPUT, ALWAYS}, \
    {"normalized_creepage", "1", "acting creepage over saturation creepage", -LARGE, LARGE, \
     AT(output.normalized_creepage), OUTPUT, ALWAYS}, \
    {"traction_coefficient", "1", "creep force over normal load", -LARGE, LARGE, \
     AT(output.traction_coefficient), OUTPUT, ALWAYS}, \
    {"force_gradient", "N.s/m", "change of creep force with slip velocity at fixed speed", -LARGE, \
     LARGE, AT(output.force_gradient), OUTPUT, ALWAYS}, \
    {"k_hat", "1", "normalized stress-intensity factor at this load, friction and slip speed", \
     0.0, LARGE, AT(output.k_hat), OUTPUT, ALWAYS}, \
    {"saturation_creepage", "1", \
     "creepage where Carter's stick zone vanishes, at this load, friction and slip speed", 0.0, \
     LARGE, AT(output.saturation_creepage), OUTPUT, ALWAYS}, \
    {"process_zone_ratio", "1", "length of the weakening zone over semi-width; valid below 0.5", \
     0.0, LARGE, AT(output.process_zone_ratio), OUTPUT, ALWAYS}, \
    {"falling_branch", TRUTH, "the force falls with creepage at fixed speed", 0.0, 1.0, \
     AT(output.falling_branch), OUTPUT, ALWAYS}, \
    {"speed_regularized", TRUTH, "speed is below minimum_speed", 0.0, 1.0, \
     AT(output.speed_regularized), OUTPUT, ALWAYS}, \
    {"k_hat_limited", TRUTH, "k_hat is held at the largest value of the table", 0.0, 1.0, \
     AT(output.k_hat_limited), OUTPUT, ALWAYS}, \
    {"force_limited", TRUTH, "the force is held at static friction times load", 0.0, 1.0, \
     AT(output.force_limited), OUTPUT, ALWAYS}

#define INDICATORS \
    {"falling_indicator", "1", "positive where falling_branch is true", -LARGE, LARGE, \
     AT(output.falling_margin), INDICATOR, ALWAYS}, \
    {"speed_indicator", "m/s", "positive where speed_regularized is true", -LARGE, LARGE, \
     AT(output.speed_margin), INDICATOR, ALWAYS}, \
    {"k_hat_indicator", "1", "positive where k_hat_limited is true", -LARGE, LARGE, \
     AT(output.k_hat_margin), INDICATOR, ALWAYS}, \
    {"force_indicator", "1", "positive where force_limited is true", -LARGE, LARGE, \
     AT(output.force_margin), INDICATOR, ALWAYS}

#define RELAXATION \
    {"relaxed_creepage", "1", "creepage that the force follows", -1e9, 1e9, \
     AT(input.relaxed_creepage), STATE, IF_RELAXED}

#define RELAXATION_RATE \
    {"der(relaxed_creepage)", "1/s", "rate of change of the relaxed creepage", -LARGE, LARGE, \
     AT(output.relaxation_rate), DERIVATIVE, IF_RELAXED}

#define BODY_PARAMETERS \
    {"inertia", "kg.m2", "moment of inertia about the axle, with the drive's", 1e-9, 1e12, \
     AT(body.inertia), FIXED_PARAMETER, ALWAYS}, \
    {"inverse_mass", "1/kg", "one over the mass moved; 0 holds the speed, as a roller rig does", \
     0.0, 1e9, AT(body.inverse_mass), FIXED_PARAMETER, ALWAYS}, \
    {"damping", "N.m.s/rad", "drive torque lost per angular velocity", 0.0, 1e12, \
     AT(body.damping), TUNABLE_PARAMETER, ALWAYS}, \
    {"constant_resistance", "N", "running resistance at low speed", 0.0, 1e12, \
     AT(body.constant_resistance), TUNABLE_PARAMETER, ALWAYS}, \
    {"linear_resistance", "N.s/m", "running resistance per speed", 0.0, 1e12, \
     AT(body.linear_resistance), TUNABLE_PARAMETER, ALWAYS}, \
    {"quadratic_resistance", "N.s2/m2", "running resistance per speed squared", 0.0, 1e12, \
     AT(body.quadratic_resistance), TUNABLE_PARAMETER, ALWAYS}, \
    {"grade_acceleration", "m/s2", "standard gravity times the grade, positive uphill", -10.0, \
     10.0, AT(body.grade_acceleration), TUNABLE_PARAMETER, ALWAYS}

#define BODY_INPUTS \
    {"drive_torque", "N.m", "torque of the drive on the wheelset", -1e12, 1e12, \
     AT(drive_torque), INPUT, ALWAYS}, \
    {"resistance_force", "N", "further force against the motion, as of a train", -1e12, 1e12, \
     AT(resistance_force), INPUT, ALWAYS}

#define BODY_STATES \
    {"omega", "rad/s", "angular velocity of the wheel, positive when rolling forward", -1e9, 1e9, \
     AT(input.omega), STATE, ALWAYS}, \
    {"speed", "m/s", "forward velocity of the wheel's centre", -1e9, 1e9, AT(input.speed), STATE, \
     ALWAYS}

#define BODY_RATES \
    {"der(omega)", "rad/s2", "angular acceleration", -LARGE, LARGE, AT(rates.omega_rate), \
     DERIVATIVE, ALWAYS}, \
    {"der(speed)", "m/s2", "forward acceleration", -LARGE, LARGE, AT(rates.speed_rate), \
     DERIVATIVE, ALWAYS}

static const model_variable FORCE_ELEMENT_VARIABLES[] = {
    TIME,
    CONTACT_PARAMETERS,
    {"effective_inverse_mass", "1/kg",
     "slip acceleration per creep force: radius^2 / inertia + 1 / mass of what is coupled", 1e-12,
     1e9, AT(effective_inverse_mass), TUNABLE_PARAMETER, ALWAYS},
    {"implicit", TRUTH, "the force is the mean over a step whose slip the element solves", 0.0,
     1.0, AT(implicit), FIXED_PARAMETER, ALWAYS},
    {"parallel_exchange", TRUTH, "both sides step at once, so a force acts one step later",
     0.0, 1.0, AT(parallel_exchange), FIXED_PARAMETER, ALWAYS},
    {"omega", "rad/s", "angular velocity of the wheel, positive when rolling forward", -1e9, 1e9,
     AT(input.omega), INPUT, ALWAYS},
    {"speed", "m/s", "forward velocity of the wheel's centre", -1e9, 1e9, AT(input.speed), INPUT,
     ALWAYS},
    CONTACT_INPUTS,
    CONTACT_OUTPUTS,
    {"step_size_hint", "s", "half of the largest stable communication step", 0.0, LARGE,
     AT(step_size_hint), OUTPUT, ALWAYS},
    RELAXATION,
    RELAXATION_RATE,
    INDICATORS,
};

static const model_variable WHEELSET_VARIABLES[] = {
    TIME,        CONTACT_PARAMETERS, BODY_PARAMETERS, BODY_INPUTS,     CONTACT_INPUTS,
    BODY_STATES, RELAXATION,         BODY_RATES,      RELAXATION_RATE, CONTACT_OUTPUTS,
    INDICATORS,
};

static const model_variable BODY_VARIABLES[] = {
    TIME,
    {"radius", "m", "rolling radius of the wheel", 1e-6, 1e6, AT(contact.radius),
     FIXED_PARAMETER, ALWAYS},
    {"minimum_speed", "m/s", "speed below which the constant resistance fades out", 1e-9, 1e3,
     AT(contact.minimum_speed), FIXED_PARAMETER, ALWAYS},
    BODY_PARAMETERS,
    BODY_INPUTS,
    {"creep_force", "N", "force on the wheel, positive forward", -1e15, 1e15,
     AT(output.creep_force), INPUT, ALWAYS},
    BODY_STATES,
    BODY_RATES,
};
/* clang-format on */

int model_has(const model_variable *variable, const model_values *values) {
    return variable->part == ALWAYS || values->contact.relaxation_length > 0.0;
}

double model_get(const model_variable *variable, const model_values *values) {
    double value;
    memcpy(&value, (const char *)values + variable->offset, sizeof value);
    return value;
}

void model_set(const model_variable *variable, model_values *values, double value) {
    memcpy((char *)values + variable->offset, &value, sizeof value);
}

/* ---- the three ----------------------------------------------------------------------------- */

#define LIST(variables) variables, sizeof variables / sizeof variables[0]

static const model MODELS[] = {
    {"force_element", 1, LIST(FORCE_ELEMENT_VARIABLES), evaluate_force, tangent_force,
     advance_force},
    {"wheelset", 1, LIST(WHEELSET_VARIABLES), evaluate_wheelset, tangent_wheelset,
     advance_wheelset},
    {"wheelset_body", 0, LIST(BODY_VARIABLES), evaluate_body, tangent_body, advance_body},
};

const model *model_of(const char *kind) {
    for (size_t i = 0; i < sizeof MODELS / sizeof MODELS[0]; i++)
        if (strcmp(kind, MODELS[i].kind) == 0) return &MODELS[i];
    return NULL;
}

void model_evaluate(const model *m, const creep_table *table, model_values *values) {
    m->evaluate(table, values);
}

void model_tangent(const model *m, const creep_table *table, const model_values *values,
                   const model_values *direction, model_values *change) {
    m->tangent(table, values, direction, change);
}

const char *model_advance(const model *m, const creep_table *table, model_values *values,
                          double step, double tolerance) {
    return m->advance(table, values, step, tolerance);
}

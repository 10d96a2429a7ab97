#include <math.h>
#include <string.h>

#include "force_element_formula.h"
#include "model_functions.h"
#include "simd_math.h"
#include "wheelset_law.h"

#define LARGE 1e300
#define AT(member) offsetof(model_values, member)

/* ---- variables ----------------------------------------------------------------------------- */

const char TRUTH[] = "Boolean";

/* clang-format off */
#define GIVEN(...) OF(ALWAYS, __VA_ARGS__)
#define MADE(role, name, unit, text, member) \
    GIVEN(role, name, unit, text, -LARGE, LARGE, member)

#define OF(part, role, name, unit, text, low, high, member) \
    {name, unit, text, low, high, AT(member), role, part}
#define TIME OF(ONCE, INDEPENDENT, "time", "s", "simulation time", -LARGE, LARGE, time)
#define FIXED(...) GIVEN(FIXED_PARAMETER, __VA_ARGS__)
#define TUNABLE(...) GIVEN(TUNABLE_PARAMETER, __VA_ARGS__)

#define RADIUS \
    FIXED("radius", "m", "rolling radius of the wheel; the start value of omega moves with it", 1e-6, \
          1e6, contact.radius)

#define CONTACT_PARAMETERS \
    RADIUS, \
    FRICTION_PARAMETERS(contact), \
    TUNABLE("slope_reduction", "1", "initial slope over that of clean elastic bodies", 1e-6, 1e6, \
            contact.slope_reduction), \
    LAYER_PARAMETER(contact), \
    TUNABLE("slip_rate_residual", "1", "part of friction that high slip speed leaves", 1e-6, 1.0, \
            contact.slip_rate_residual), \
    TUNABLE("slip_rate_decay", "s/m", "rate at which friction falls with slip speed", 0.0, 1e6, \
            contact.slip_rate_decay), \
    HEAT_PARAMETERS(contact), \
    FIXED("elliptic", TRUTH, "the contact is an ellipse, else a line", 0.0, 1.0, contact.elliptic), \
    FIXED("semi_width", "m", "contact semi-width at nominal load", 1e-9, 1e3, contact.semi_width), \
    FIXED("peak_pressure", "Pa", "peak contact pressure at nominal load", 1e-3, 1e15, \
          contact.peak_pressure), \
    FIXED("contact_modulus", "Pa", "composite contact modulus; of an ellipse on a half-space, " \
          "that of rolling", 1e-3, 1e15, contact.contact_modulus), \
    FIXED("softening", "1", "part of the stiffness that an ellipse on a half-space loses up to " \
          "saturation", -0.1, 0.4, contact.softening), \
    FIXED("nominal_load", "N", "load of the given semi-width and peak pressure", 1e-6, 1e12, \
          contact.nominal_load), \
    FIXED("load_exponent", "1", "semi-width and pressure grow like load to this power", 0.0, 1.0, \
          contact.load_exponent), \
    FIXED("minimum_speed", "m/s", "speed below which the creepage is regularised", 1e-9, 1e3, \
          contact.minimum_speed), \
    {"memory", TRUTH, "the contact remembers what it rolled over", 1.0, 1.0, AT(contact.memory), \
     FIXED_PARAMETER, IF_REMEMBERING}, \
    {"body_modulus", "Pa", "composite contact modulus of the bodies", 1e-3, 1e15, \
     AT(contact.body_modulus), FIXED_PARAMETER, IF_REMEMBERING}, \
    {"poisson_ratio", "1", "of the bodies", 0.0, 0.5, AT(contact.poisson_ratio), FIXED_PARAMETER, \
     IF_REMEMBERING}, \
    {"transverse_half_length", "m", "half of the contact's length across rolling at nominal load", \
     1e-9, 1e3, AT(contact.transverse_half_length), FIXED_PARAMETER, IF_REMEMBERING}

#define FRICTION_PARAMETERS(of) \
    TUNABLE("static_friction", "1", "friction coefficient before slip, not below the kinetic one", \
            1e-6, 1e3, of.static_friction), \
    TUNABLE("kinetic_friction", "1", "friction coefficient after much slip", 1e-6, 1e3, \
            of.kinetic_friction), \
    TUNABLE("weakening_length", "m", "slip over which friction weakens", 0.0, 1.0, \
            of.weakening_length)

#define HEAT_PARAMETERS(of) \
    THERMAL(TUNABLE_PARAMETER, "softening_temperature", "K", "rise of temperature at which friction " \
        "would vanish", 1.0, 1e6, of.softening_temperature), \
    THERMAL(TUNABLE_PARAMETER, "thermal_effusivity", "W.s0.5/(m2.K)", "root of conductivity, density " \
        "and heat capacity of wheel and rail", 1e-3, 1e9, of.thermal_effusivity)

#define LAYER_PARAMETER(of) \
    {"layer_compliance", "m/Pa", "thickness over shear modulus of a layer between the bodies", \
     1e-20, 1e-6, AT(of.layer_compliance), TUNABLE_PARAMETER, IF_LAYERED}

#define THERMAL(role, name, unit, text, low, high, member) \
    {name, unit, text, low, high, AT(member), role, IF_THERMAL}

#define LOAD_AND_FRICTION(of) \
    GIVEN(INPUT, "normal_load", "N", "normal load; a negative one counts as none", -1e12, 1e12, \
          of.normal_load), \
    GIVEN(INPUT, "friction_scale", "1", "multiplies both friction coefficients; below " \
          TEXT(MIN_FRICTION_SCALE) " there is no friction, also where a solver looks just below " \
          "0", -MIN_FRICTION_SCALE, 1e3, of.friction_scale)

#define CONTACT_INPUTS \
    LOAD_AND_FRICTION(input), \
    GIVEN(INPUT, "lateral_velocity", "m/s", "velocity of the wheel's surface against the rail, " \
          "positive to the left", -1e6, 1e6, input.lateral_velocity), \
    {"spin_velocity", "rad/s", "angular velocity of the wheel against the rail about the " \
     "vertical axis, positive upwards", -1e6, 1e6, AT(input.spin_velocity), INPUT, IF_SPINNING}

#define CONTACT_OUTPUTS \
    MADE(OUTPUT, "creep_force", "N", "force on the wheel, positive forward", output.creep_force), \
    MADE(OUTPUT, "wheel_torque", "N.m", "torque of the creep force on the wheel: -radius * " \
         "creep_force", output.wheel_torque), \
    MADE(OUTPUT, "lateral_force", "N", "force on the wheel, positive to the left", \
         output.lateral_force), \
    {"spin_moment", "N.m", "moment on the wheel about the vertical axis, positive upwards", \
     -LARGE, LARGE, AT(output.spin_moment), OUTPUT, IF_SPINNING}, \
    MADE(OUTPUT, "creepage", "1", "slip velocity over speed, positive in traction", \
         output.creepage), \
    MADE(OUTPUT, "normalized_creepage", "1", "acting creepage over saturation creepage", \
         output.normalized_creepage), \
    MADE(OUTPUT, "traction_coefficient", "1", "creep force over normal load", \
         output.traction_coefficient), \
    MADE(OUTPUT, "force_gradient", "N.s/m", "change of creep force with slip velocity at fixed " \
         "speed", output.force_gradient), \
    MADE_POSITIVE("k_hat", "1", "normalized stress-intensity factor at this load, friction and " \
                  "slip speed", output.k_hat), \
    MADE_POSITIVE("saturation_creepage", "1", "creepage where Carter's stick zone vanishes, at " \
                  "this load, friction and slip speed", output.saturation_creepage), \
    MADE_POSITIVE("process_zone_ratio", "1", "length of the weakening zone over semi-width; " \
                  "valid below " TEXT(PROCESS_ZONE_LIMIT), output.process_zone_ratio), \
    THERMAL(OUTPUT, "contact_temperature", "K", "mean flash temperature of the contact above that of " \
        "wheel and rail", 0.0, LARGE, output.contact_temperature), \
    FLAGS(FLAG)
#define MADE_POSITIVE(name, unit, text, member) GIVEN(OUTPUT, name, unit, text, 0.0, LARGE, member)
#define TEXT(number) TEXT_OF(number)
#define TEXT_OF(number) #number

/* Truth values, each with its margin, which is positive where it is true, and the margin's unit. */
#define FLAGS(ROW) \
    ROW(falling_branch, falling, "1", "the force falls with creepage at fixed speed"), \
    ROW(speed_regularized, speed, "m/s", "speed is below minimum_speed"), \
    ROW(k_hat_limited, k_hat, "1", "k_hat is held at the largest value of the table"), \
    ROW(force_limited, force, "1", "static friction limits the force: that of the law, or with " \
        "memory that of a zone, is larger"), \
    ROW(length_limited, length, "1", "a line contact is shorter than 4 semi-widths: its memory is " \
        "that of 4"), \
    ROW(unloaded, load, "N", "there is no load, and so no force")
#define FLAG(flag, margin, unit, text) GIVEN(OUTPUT, #flag, TRUTH, text, 0.0, 1.0, output.flag)
#define INDICATOR_OF(flag, margin, unit, text) \
    MADE(INDICATOR, #margin "_indicator", unit, "positive where " #flag " is true", \
         output.margin##_margin)

#define MEMORY \
    {"held_force", "N", "creep force that the contact holds", -1e15, 1e15, AT(input.memory.held_force), \
     STATE, IF_REMEMBERING}, \
    {"unslipped", "1", "part of the contact that has not slipped since it entered", -0.1, 1.1, \
     AT(input.memory.unslipped), STATE, IF_REMEMBERING}, \
    {"outer_force", "N", "part of the creep force in the zone that slips first", -1e15, 1e15, \
     AT(input.memory.outer_force), STATE, IF_REMEMBERING}, \
    {"held_lateral", "N", "lateral force that the contact holds", -1e15, 1e15, \
     AT(input.lateral.held_lateral), STATE, IF_REMEMBERING}, \
    {"outer_lateral", "N", "part of the lateral force in the zone that slips first", -1e15, 1e15, \
     AT(input.lateral.outer_lateral), STATE, IF_REMEMBERING}

#define MEMORY_RATES \
    {"der(held_force)", "N/s", "rate of change of the held force", -LARGE, LARGE, \
     AT(output.held_rate), DERIVATIVE, IF_REMEMBERING}, \
    {"der(unslipped)", "1/s", "rate of change of the unslipped part", -LARGE, LARGE, \
     AT(output.unslipped_rate), DERIVATIVE, IF_REMEMBERING}, \
    {"der(outer_force)", "N/s", "rate of change of the force in the zone that slips first", -LARGE, \
     LARGE, AT(output.outer_rate), DERIVATIVE, IF_REMEMBERING}, \
    {"der(held_lateral)", "N/s", "rate of change of the held lateral force", -LARGE, LARGE, \
     AT(output.lateral_rate), DERIVATIVE, IF_REMEMBERING}, \
    {"der(outer_lateral)", "N/s", "rate of change of the lateral force in the zone that slips " \
     "first", -LARGE, LARGE, AT(output.outer_lateral_rate), DERIVATIVE, IF_REMEMBERING}

#define BODY_PARAMETERS \
    INERTIA, \
    FIXED("inverse_mass", "1/kg", "one over the mass moved; 0 holds the speed, as a roller rig " \
          "does", 0.0, 1e9, body.inverse_mass), \
    RESISTANCES
#define INERTIA \
    FIXED("inertia", "kg.m2", "moment of inertia about the axle, with the drive's", 1e-9, 1e12, \
          body.inertia)
#define RESISTANCES \
    TUNABLE("damping", "N.m.s/rad", "drive torque lost per angular velocity", 0.0, 1e12, \
            body.damping), \
    TUNABLE("constant_resistance", "N", "running resistance at low speed", 0.0, 1e12, \
            body.constant_resistance), \
    TUNABLE("linear_resistance", "N.s/m", "running resistance per speed", 0.0, 1e12, \
            body.linear_resistance), \
    TUNABLE("quadratic_resistance", "N.s2/m2", "running resistance per speed squared", 0.0, 1e12, \
            body.quadratic_resistance), \
    TUNABLE("grade_acceleration", "m/s2", "standard gravity times the grade, positive uphill", \
            -10.0, 10.0, body.grade_acceleration)

#define BODY_INPUTS \
    GIVEN(INPUT, "drive_torque", "N.m", "torque of the drive on the wheelset; a negative one is a " \
          "motor's, which turns a wheel backward that does not grip", -1e12, 1e12, drive_torque), \
    GIVEN(INPUT, "brake_torque", "N.m", "torque that a friction brake can hold, at the axle, " \
          "against the rotation; the wheel locks where it does not grip", 0.0, 1e12, \
          brake_torque), \
    GIVEN(INPUT, "resistance_force", "N", "further force against the motion, such as that of a train", \
          -1e12, 1e12, resistance_force)

#define VELOCITIES(role) \
    GIVEN(role, "omega", "rad/s", "angular velocity of the wheel, positive when rolling forward", \
          -1e9, 1e9, input.omega), \
    GIVEN(role, "speed", "m/s", "forward velocity of the wheel's centre", -1e9, 1e9, input.speed)
#define BODY_STATES \
    VELOCITIES(STATE), \
    GIVEN(STATE, "pads", "1", "way by which the wheel has carried the pads of its brake along, over " \
          "what they give: 1 where they slide forward, -1 backward", -1e9, 1e9, pads)
#define BODY_RATES \
    MADE(DERIVATIVE, "der(omega)", "rad/s2", "angular acceleration", rates.omega_rate), \
    MADE(DERIVATIVE, "der(speed)", "m/s2", "forward acceleration", rates.speed_rate), \
    MADE(DERIVATIVE, "der(pads)", "1/s", "rate of the pads", pads_rate)

#define SUBSTEP_LIMIT \
    FIXED("max_substeps", "1", "largest number of the integrator's substeps in a communication step, " \
          "rounded up, for hardware in the loop; 0: as many as the tolerance needs", 0.0, 1e5, \
          max_substeps)

static const model_variable FORCE_ELEMENT_VARIABLES[] = {
    TIME,
    CONTACT_PARAMETERS,
    TUNABLE("effective_inverse_mass", "1/kg",
            "slip acceleration per creep force: radius^2 / inertia + 1 / mass of what is coupled",
            1e-12, 1e9, effective_inverse_mass),
    FIXED("implicit", TRUTH, "the force is the mean over a step whose slip the element solves", 0.0,
          1.0, implicit),
    FIXED("parallel_exchange", TRUTH, "both sides step at once, so a force acts one step later",
          0.0, 1.0, parallel_exchange),
    SUBSTEP_LIMIT,
    VELOCITIES(INPUT),
    CONTACT_INPUTS,
    CONTACT_OUTPUTS,
    MADE_POSITIVE("step_size_hint", "s", "half of the largest stable communication step",
                  step_size_hint),
    MEMORY,
    MEMORY_RATES,
    FLAGS(INDICATOR_OF),
};

static const model_variable WHEELSET_VARIABLES[] = {
    TIME,
    CONTACT_PARAMETERS,
    BODY_PARAMETERS,
    SUBSTEP_LIMIT,
    BODY_INPUTS,
    CONTACT_INPUTS,
    BODY_STATES,
    MEMORY,
    BODY_RATES,
    MEMORY_RATES,
    CONTACT_OUTPUTS,
    FLAGS(INDICATOR_OF),
};

static const model_variable BODY_VARIABLES[] = {
    TIME,
    RADIUS,
    FIXED("minimum_speed", "m/s", "speed below which the constant resistance fades out", 1e-9, 1e3,
          contact.minimum_speed),
    BODY_PARAMETERS,
    BODY_INPUTS,
    GIVEN(INPUT, "creep_force", "N", "force on the wheel, positive forward", -1e15, 1e15,
          output.creep_force),
    BODY_STATES,
    BODY_RATES,
};

#define FALLING(name, unit, text, low, high, member) \
    {name, unit, text, low, high, AT(member), TUNABLE_PARAMETER, IF_FALLING}
#define SEMI_AXIS(name, text, member) \
    GIVEN(INPUT, name, "m", text "; below " TEXT(MIN_SEMI_AXIS) " there is no contact, also where " \
          "a solver looks just below 0", -MIN_SEMI_AXIS, 1e3, member)
static const model_variable BODIES_VARIABLES[] = {
    TIME,
    FRICTION_PARAMETERS(bodies),
    FALLING("slip_rate_residual", "1", "part of friction that high slip speed "
            "leaves", 1e-6, 1.0, bodies.slip_rate_residual),
    FALLING("slip_rate_decay", "s/m", "rate at which friction falls with slip "
            "speed", 0.0, 1e6, bodies.slip_rate_decay),
    HEAT_PARAMETERS(bodies),
    LAYER_PARAMETER(bodies),
    TUNABLE("shear_modulus", "Pa", "shear modulus of both bodies", 1e-3, 1e15, bodies.shear_modulus),
    SEMI_AXIS("semi_axis_x", "semi-axis of the contact ellipse along rolling", ellipse.semi_axis_x),
    SEMI_AXIS("semi_axis_y", "semi-axis across rolling", ellipse.semi_axis_y),
    LOAD_AND_FRICTION(ellipse),
    GIVEN(INPUT, "creepage_x", "1", "Kalker's longitudinal creepage (V - omega r)/V, negative in "
          "traction", -1e9, 1e9, ellipse.creepage_x),
    GIVEN(INPUT, "creepage_y", "1", "Kalker's lateral creepage v_y/V, y to the left", -1e9, 1e9,
          ellipse.creepage_y),
    GIVEN(INPUT, "spin", "1/m", "Kalker's spin omega_z/V, z up", -1e9, 1e9, ellipse.spin),
    {"speed", "m/s", "forward velocity V of the wheel's centre", -1e9, 1e9, AT(ellipse.speed), INPUT,
     IF_SLIP_COUNTS},
    MADE(OUTPUT, "force_x", "N", "force on the wheel along rolling", forces.force_x),
    MADE(OUTPUT, "force_y", "N", "force on the wheel to the left", forces.force_y),
    MADE(OUTPUT, "spin_moment", "N.m", "moment on the wheel about the vertical axis", forces.spin_moment),
    MADE(OUTPUT, "utilisation", "1", "force over static friction times load", forces.utilisation),
};

#define WHOLE(role, ...) OF(ONCE, role, __VA_ARGS__)
#define HEIGHT(name, text, member) WHOLE(FIXED_PARAMETER, name, "m", text, 0.0, 10.0, whole.body.member)
#define MASS(name, text, least, member) \
    WHOLE(FIXED_PARAMETER, name, "kg", text, least, 1e8, whole.body.member)
#define VEHICLE_PARAMETERS \
    WHOLE(FIXED_PARAMETER, "axles", "1", "number of axles, that of the exported vehicle", 1.0, \
          MAX_AXLES, whole.body.axles), \
    WHOLE(FIXED_PARAMETER, "axles_per_bogie", "1", "number of axles of each bogie; a single axle has a " \
          "bogie of its own", 1.0, MAX_AXLES, whole.body.axles_per_bogie), \
    FIXED("position", "m", "distance of the axle behind the first one", 0.0, 100.0, axle.position), \
    MASS("body_mass", "mass of the body", 1e-6, body_mass), \
    MASS("bogie_mass", "mass of one bogie without its wheelsets", 0.0, bogie_mass), \
    MASS("wheelset_mass", "mass of one wheelset", 0.0, wheelset_mass), \
    MASS("train_mass", "mass of the train behind the coupler", 0.0, train_mass), \
    HEIGHT("body_height", "height of the body's centre of mass above the rail", body_height), \
    HEIGHT("bogie_height", "height of a bogie's centre of mass, without its wheelsets", bogie_height), \
    HEIGHT("pivot_height", "height at which the bogies pull the body", pivot_height), \
    HEIGHT("coupler_height", "height of the couplers", coupler_height), \
    WHOLE(FIXED_PARAMETER, "pitch_inertia", "kg.m2", "angular momentum of wheelset and rotor over the " \
          "wheelset's angular velocity", -1e5, 1e5, whole.body.pitch_inertia), \
    WHOLE(FIXED_PARAMETER, "load_lag", "s", "time constant with which the loads follow the forces", \
          1e-6, 10.0, whole.body.load_lag)
#define LAGGING(role, ...) OF(IF_LAGGING, role, __VA_ARGS__)
#define BRAKED(role, ...) OF(IF_BRAKED, role, __VA_ARGS__)
#define BY_TORQUE(role, ...) OF(IF_BRAKE_TORQUE, role, __VA_ARGS__)
#define BY_PRESSURE(role, ...) OF(IF_BRAKE_PRESSURE, role, __VA_ARGS__)
#define MEMORY_OF(side, at) \
    OF(IF_REMEMBERING, STATE, "held_force_" #side, "N", "creep force that both wheels would hold with " \
       "the " #side " one's contact", -1e15, 1e15, at.held_force), \
    OF(IF_REMEMBERING, STATE, "unslipped_" #side, "1", "part of the " #side " contact that has not " \
       "slipped since it entered", -0.1, 1.1, at.unslipped), \
    OF(IF_REMEMBERING, STATE, "outer_force_" #side, "N", "part of held_force_" #side " in the zone " \
       "that slips first", -1e15, 1e15, at.outer_force)
#define MEMORY_RATE(name, unit, member) \
    OF(IF_REMEMBERING, DERIVATIVE, "der(" name ")", unit, "rate of change of " name, -LARGE, LARGE, \
       member)
static const model_variable VEHICLE_VARIABLES[] = {
    TIME,
    CONTACT_PARAMETERS,
    INERTIA,
    RESISTANCES,
    VEHICLE_PARAMETERS,
    LAGGING(FIXED_PARAMETER, "motor_lag", "s", "time constant with which the motor's torque follows its "
            "command", 1e-6, 10.0, axle.motor_lag),
    BY_TORQUE(FIXED_PARAMETER, "brake_fill_time", "s", "time constant with which the brake's torque "
              "rises to its command", 1e-6, 10.0, axle.brake_fill_time),
    BY_TORQUE(FIXED_PARAMETER, "brake_vent_time", "s", "time constant with which the brake's torque "
              "falls to its command", 1e-6, 10.0, axle.brake_vent_time),
    BY_PRESSURE(FIXED_PARAMETER, "torque_per_pressure", "N.m/Pa", "torque that the friction brake can "
                "hold, at the axle, over the pressure in its cylinder", 1e-12, 1e12,
                axle.torque_per_pressure),
    GIVEN(INPUT, "motor_torque", "N.m", "commanded torque of the motor, at the axle; a vehicle with "
          "friction brakes takes a negative one as none", -1e12, 1e12, axle.motor_torque),
    BY_TORQUE(INPUT, "brake_torque", "N.m", "commanded torque of the friction brake, at the axle, "
              "against the rotation", 0.0, 1e12, brake_torque),
    BY_PRESSURE(INPUT, "brake_pressure", "Pa", "gauge pressure in the axle's brake cylinder; a negative "
                "one counts as none", -1e12, 1e12, axle.brake_pressure),
    GIVEN(INPUT, "friction_scale", "1", "multiplies the factors on friction of the rails before slip "
          "cleans them; below " TEXT(MIN_FRICTION_SCALE) " there is no friction", 0.0, 1e3,
          input.friction_scale),
    WHOLE(INPUT, "grade", "1", "rise over distance, positive uphill; added to that of the rails and the "
          "vehicle's own", -1.0, 1.0, whole.grade),
    WHOLE(INPUT, "front_coupler_force", "N", "tension of the front coupler, which pulls the vehicle "
          "forward", -1e12, 1e12, whole.front_coupler_force),
    WHOLE(INPUT, "rear_coupler_force", "N", "tension of the rear coupler, which pulls the vehicle "
          "backward", -1e12, 1e12, whole.rear_coupler_force),
    WHOLE(STATE, "speed", "m/s", "forward velocity of the vehicle", -1e9, 1e9, input.speed),
    WHOLE(STATE, "distance", "m", "distance that the first axle is from its start on the rails", -1e9,
          1e9, whole.distance),
    GIVEN(STATE, "omega", "rad/s", "angular velocity of the wheelset, positive when rolling forward; its "
          "start value moves with speed and radius", -1e9, 1e9, input.omega),
    MEMORY_OF(left, input.memory),
    MEMORY_OF(right, axle.right),
    LAGGING(STATE, "acting_motor_torque", "N.m", "torque of the motor, at the axle", -1e12, 1e12,
            axle.acting_motor),
    BY_TORQUE(STATE, "acting_brake_torque", "N.m", "torque that the friction brake can hold, at the "
              "axle", -1e12, 1e12, axle.acting_brake),
    BRAKED(STATE, "pads", "1", "way by which the wheel has carried the pads of its brake along, over "
           "what they give: 1 where they slide forward, -1 backward", -1e9, 1e9, pads),
    GIVEN(STATE, "axle_load", "N", "load of both wheels; it settles at the end of the initialization",
          -1e12, 1e12, input.normal_load),
    WHOLE(DERIVATIVE, "der(speed)", "m/s2", "forward acceleration", -LARGE, LARGE, rates.speed_rate),
    WHOLE(DERIVATIVE, "der(distance)", "m/s", "rate of the distance", -LARGE, LARGE,
          of_axle.distance_rate),
    MADE(DERIVATIVE, "der(omega)", "rad/s2", "angular acceleration", rates.omega_rate),
    MEMORY_RATE("held_force_left", "N/s", output.held_rate),
    MEMORY_RATE("unslipped_left", "1/s", output.unslipped_rate),
    MEMORY_RATE("outer_force_left", "N/s", output.outer_rate),
    MEMORY_RATE("held_force_right", "N/s", of_axle.right_rate.held_force),
    MEMORY_RATE("unslipped_right", "1/s", of_axle.right_rate.unslipped),
    MEMORY_RATE("outer_force_right", "N/s", of_axle.right_rate.outer_force),
    LAGGING(DERIVATIVE, "der(acting_motor_torque)", "N.m/s", "rate of the motor's torque", -LARGE, LARGE,
            of_axle.motor_rate),
    BY_TORQUE(DERIVATIVE, "der(acting_brake_torque)", "N.m/s", "rate of the brake's torque", -LARGE,
              LARGE, of_axle.brake_rate),
    BRAKED(DERIVATIVE, "der(pads)", "1/s", "rate of the pads", -LARGE, LARGE, pads_rate),
    MADE(DERIVATIVE, "der(axle_load)", "N/s", "rate of the load", of_axle.load_rate),
    WHOLE(OUTPUT, "acceleration", "m/s2", "forward acceleration of the vehicle", -LARGE, LARGE,
          rates.speed_rate),
    MADE(OUTPUT, "creepage", "1", "slip velocity over speed, positive in traction", output.creepage),
    MADE(OUTPUT, "creep_force", "N", "force on the axle, positive forward", output.creep_force),
    MADE_POSITIVE("friction", "1", "factor on friction under the wheels, mean of both", of_axle.friction),
    MADE_POSITIVE("available_force", "N", "largest creep force that friction allows",
                  of_axle.available_force),
    MADE(OUTPUT, "drive_torque", "N.m", "torque of motor and brake, at the axle", of_axle.drive_torque),
    THERMAL(OUTPUT, "contact_temperature", "K", "mean flash temperature of the contacts above that of "
            "wheel and rail", 0.0, LARGE, output.contact_temperature),
    FLAG(falling_branch, falling, "1", "the force of a wheel falls with creepage at fixed speed"),
    INDICATOR_OF(falling_branch, falling, "1", ""),
};
/* clang-format on */

int model_has(const model_variable *variable, const model_values *values) {
    if (variable->part == IF_REMEMBERING) return remembers(&values->contact);
    int thermal =
        values->contact.softening_temperature > 0.0 || values->bodies.softening_temperature > 0.0;
    int falling = values->bodies.slip_rate_decay > 0.0;
    if (variable->part == IF_THERMAL) return thermal;
    if (variable->part == IF_LAYERED)
        return values->contact.layer_compliance > 0.0 || values->bodies.layer_compliance > 0.0;
    if (variable->part == IF_FALLING) return falling;
    if (variable->part == IF_SLIP_COUNTS) return thermal || falling;
    if (variable->part == IF_LAGGING) return values->axle.motor_lag > 0.0;
    int braked = values->axle.brake_fill_time > 0.0;
    int by_pressure = values->axle.torque_per_pressure > 0.0;
    if (variable->part == IF_BRAKED) return braked;
    if (variable->part == IF_BRAKE_TORQUE) return braked && !by_pressure;
    if (variable->part == IF_BRAKE_PRESSURE) return braked && by_pressure;
    return variable->part == ALWAYS || variable->part == ONCE || values->spins > 0.0;
}

double model_get(const model_variable *variable, const model_values *values) {
    double value;
    memcpy(&value, (const char *)values + variable->offset, sizeof value);
    return value;
}

void model_set(const model_variable *variable, model_values *values, double value) {
    memcpy((char *)values + variable->offset, &value, sizeof value);
}

/* ---- models -------------------------------------------------------------------------------- */

#define LIST(list) .variables = list, .count = sizeof list / sizeof list[0]

static const model MODELS[] = {
    {.kind = "force_element",
     .has_contact = 1,
     LIST(FORCE_ELEMENT_VARIABLES),
     .evaluate = evaluate_force,
     .tangent = tangent_force,
     .advance = advance_force},
    {.kind = "wheelset",
     .has_contact = 1,
     .moves = 1,
     LIST(WHEELSET_VARIABLES),
     .evaluate = evaluate_wheelset,
     .tangent = tangent_wheelset,
     .advance = advance_wheelset},
    {.kind = "wheelset_body",
     .moves = 1,
     LIST(BODY_VARIABLES),
     .evaluate = evaluate_body,
     .tangent = tangent_body,
     .advance = advance_body},
    {.kind = "creep_forces",
     .has_bodies = 1,
     LIST(BODIES_VARIABLES),
     .evaluate = evaluate_creep_forces,
     .tangent = tangent_creep_forces,
     .advance = advance_creep_forces},
    {.kind = "vehicle",
     .has_contact = 1,
     .moves = 1,
     .is_vehicle = 1,
     LIST(VEHICLE_VARIABLES),
     .evaluate = evaluate_vehicle,
     .advance = advance_vehicle,
     .begin = begin_vehicle,
     .complete = complete_vehicle,
     .search = search_vehicle},
};

const model *model_of(const char *kind) {
    for (size_t i = 0; i < sizeof MODELS / sizeof MODELS[0]; i++)
        if (strcmp(kind, MODELS[i].kind) == 0) return &MODELS[i];
    return NULL;
}

/* Pads approach their end at a rate of their way's speed over what they give.
 * With memory a wheelset's slip w and its force Q obey m dw/dt = -Q and sigma dQ/dt = c w - v Q,
 * c/v being the slope of the steady force. Euler's method is stable below 1 / lambda, with the slip
 * pole lambda, where they swing, and below 2 sigma / v where both decay. The lag shortens to
 * about a hundredth of sigma where the contact slides. */
double model_explicit_step(const model *m, const creep_table *table, const model_values *values) {
    model_values v = *values;
    const force_element_parameters *p = &v.contact;
    int remembering = remembers(p);
    double longest = INFINITY;
    if (remembering)
        longest = 0.01 * contact_scales_of(table, p).relaxation_length / fabs(v.input.speed);
    if (values->brake_torque > 0.0 || values->axle.brake_pressure > 0.0)
        longest = fmin(longest, 2.0 * PADS_GIVE / fabs(p->radius * v.input.omega));
    if (!m->has_contact || !m->moves) return longest; /* no wheelset that slips */
    v.input.omega = v.input.speed / p->radius;
    forget(&v.input);
    evaluate_contacts(table, &v, 1);
    double moved = m->is_vehicle ? inverse_mass_of_axle(&v) : v.body.inverse_mass;
    double inverse_mass = p->radius * p->radius / v.body.inertia + moved;
    double pole = force_element_steepest(table, p, &v.input, &v.output) * inverse_mass;
    return fmin(longest, (remembering ? 1.0 : 2.0) / pole);
}

void model_begin(const model *m, const creep_table *table, model_values *values, size_t n) {
    if (m->begin) m->begin(table, values, n);
}

void model_evaluate(const model *m, const creep_table *table, model_values *values, size_t n) {
    m->evaluate(table, values, n);
    if (m->search) m->search(table, values, n);
}

/* ---- derivatives --------------------------------------------------------------------------- */

int model_is_given(const model_variable *v) {
    return v->role == FIXED_PARAMETER || v->role == TUNABLE_PARAMETER || v->role == INPUT ||
           v->role == STATE;
}

int model_is_diagnostic(const model_variable *v) {
    return (v->role == OUTPUT || v->role == INDICATOR) &&
           v->offset >= AT(output.normalized_creepage) && v->offset < AT(forces);
}

int model_is_searched(const model_variable *v) { return v->offset == AT(of_axle.available_force); }

/* Numbers of the values; from the first of these on `evaluate` sets them. */
enum { FIRST_MADE = AT(output) / sizeof(double), NUMBERS = sizeof(model_values) / sizeof(double) };

/* Whether a model's own tangent contains the derivatives by this variable. */
static int is_exact(const model *m, const model_variable *v) {
    if (m->tangent == NULL) return 0;
    return (v->offset >= AT(input) && v->offset < AT(output.wheel_torque)) ||
           (v->offset >= AT(ellipse.creepage_x) && v->offset < AT(ellipse.speed));
}

/* Typical change of a variable: for velocities the slip velocity at saturation. */
static double magnitude(const model *m, const model_values *values, const model_variable *v) {
    const force_element_parameters *p = &values->contact;
    const force_element_input *in = &values->input;
    double size = fabs(model_get(v, values)), reference, slope;
    size_t of = v->offset;
    if (m->has_contact) {
        double zeta0 = values->output.saturation_creepage;
        if (zeta0 == 0.0) zeta0 = 1e-3; /* without load */
        regularized_speed(in->speed, slowest_speed(p), &reference, &slope);
        double slip = fabs(p->radius * in->omega - in->speed) + zeta0 * reference;
        if (of == AT(contact.radius)) return fmin(size, slip / fabs(in->omega));
        if (of == AT(input.omega)) return slip / p->radius;
        /* At almost no speed outputs change over the reference speed too. */
        if (of == AT(input.speed)) return fmin(slip, sqrt(slip * reference));
        if (of == AT(input.lateral_velocity)) return slip;
        if (of == AT(input.spin_velocity)) return slip / p->semi_width;
        if (of == AT(input.memory.held_force) || of == AT(input.memory.outer_force) ||
            of == AT(input.lateral.held_lateral) || of == AT(input.lateral.outer_lateral) ||
            of == AT(axle.right.held_force) || of == AT(axle.right.outer_force))
            return size + 0.01 * p->kinetic_friction * p->nominal_load;
        if (of == AT(input.normal_load) && size == 0.0) return 1e-100 * p->nominal_load;
    }
    /* Without load, contact or friction it stays so. */
    if (size == 0.0 && (of == AT(input.friction_scale) || of == AT(ellipse.friction_scale)))
        return MIN_FRICTION_SCALE;
    if (size == 0.0 && (of == AT(ellipse.semi_axis_x) || of == AT(ellipse.semi_axis_y)))
        return MIN_SEMI_AXIS;
    if (size == 0.0 && of == AT(ellipse.normal_load)) return MIN_LOAD;
    return size > 0.0 ? size : 1.0;
}

/* Add the changes when a variable of one of n wheels changes, or one that they have in common, by
 * central differences up to the variable's limits. */
static void difference(const model *m, const creep_table *table, const model_values *values,
                       size_t n, size_t wheel, const model_variable *v, double seed, int searching,
                       model_values *change) {
    static const double STEP = 6e-6; /* cube root of the rounding */
    const model_values *own = &values[wheel];
    double value = model_get(v, own), at[2];
    double move = fmax(STEP * magnitude(m, own, v), 1e-10 * fabs(value)); /* not lost in it */
    model_values moved[2][MAX_AXLES];
    for (int i = 0; i < 2; i++) {
        memcpy(moved[i], values, n * sizeof *values);
        model_values *there = &moved[i][wheel];
        at[i] = fmin(v->maximum, fmax(v->minimum, value + (i == 0 ? move : -move)));
        model_set(v, there, at[i]);
        if (there->contact.static_friction < there->contact.kinetic_friction ||
            there->bodies.static_friction < there->bodies.kinetic_friction)
            model_set(v, there, at[i] = value);
        for (size_t w = 0; v->part == ONCE && w < n; w++) model_set(v, &moved[i][w], at[i]);
        m->evaluate(table, moved[i], n);
        if (searching && m->search) m->search(table, moved[i], n);
    }
    double per = at[0] > at[1] ? seed / (at[0] - at[1]) : 0.0;
    for (size_t w = 0; w < n; w++) {
        const double *after = (const double *)&moved[0][w], *before = (const double *)&moved[1][w];
        double *sum = (double *)&change[w];
        for (size_t i = FIRST_MADE; i < NUMBERS; i++) sum[i] += per * (after[i] - before[i]);
    }
}

void model_tangent(const model *m, const creep_table *table, const model_values *values,
                   const model_values *direction, size_t n, int diagnostics, model_values *change) {
    model_values by_rest[MAX_AXLES];
    memset(change, 0, n * sizeof *change);
    memset(by_rest, 0, n * sizeof *by_rest);
    for (size_t i = 0; i < m->count * n; i++) {
        const model_variable *v = &m->variables[i / n];
        size_t wheel = i % n;
        double seed = model_get(v, &direction[wheel]);
        if (seed == 0.0 || !model_is_given(v) || v->unit == TRUTH) continue;
        if (v->part == ONCE && wheel > 0) continue;
        int exact = is_exact(m, v);
        if (exact && !diagnostics) continue;
        difference(m, table, values, n, wheel, v, seed, diagnostics, exact ? change : by_rest);
    }
    if (m->tangent) m->tangent(table, values, direction, change);
    double *sum = (double *)change;
    for (size_t i = 0; i < n * NUMBERS; i++)
        if (i % NUMBERS >= FIRST_MADE) sum[i] += ((const double *)by_rest)[i];
}

const char *model_advance(const model *m, const creep_table *table, model_values *values, size_t n,
                          double step, double tolerance, size_t *failed) {
    return m->advance(table, values, n, step, tolerance, failed);
}

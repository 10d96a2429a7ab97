/* Run under the address and undefined-behaviour sanitizers: the kernel over its whole range.
 *
 *     test_native POINTS RESOURCES TOKEN [KIND]
 *
 * POINTS is the number of points at which each law is evaluated; RESOURCES is a URI. With the kind
 * of the FMU, variables of so many instances are set to any values, and that is all. */
#include <float.h>

#include "checks.h"
#include "component.h"
#include "creep_curve.h"
#include "creep_forces.h"
#include "drivetrain.h"
#include "file_io.h"
#include "fmi.h"
#include "half_space.h"
#include "hertz.h"
#include "simd_dispatch.h"
#include "wheelset_run.h"
#include "wheelset_step.h"

enum { CONTACTS = 3 }; /* a line; an ellipse whose force follows; a hot one with a layer */
static int points;     /* at which each law is evaluated */

/* Every finite creepage and every k_hat: finite, odd, bounded by the law's own maximum. */
static void test_table(const creep_table *table) {
    static const double edges[] = {
        0.0, 4.9406564584124654e-324, DBL_MIN, 1.0 - 1e-16, 1.0, 1.0 + 3e-16, 1e300, DBL_MAX};
    for (int i = 0; i < points; i++) {
        double x = random_exponent(-320.0, 308.0), k = random_exponent(-320.0, 0.30);
        if (i % 16 == 0) x = edges[(i / 16) % 8];
        if (i % 7 == 0) k = i % 14 == 0 ? 0.0 : table->k_max;
        if (i % 3 == 0) x = 1.0 + (random_unit() - 0.5) * random_exponent(-16.0, 1.0);
        k = fmin(k, table->k_max);
        double layer = i % 2 ? random_exponent(-320.0, 300.0) : 0.0;
        creep_value there, back;
        creep_table_evaluate(table, x, k, layer, &there);
        creep_table_evaluate(table, -x, k, layer, &back);
        CHECK(isfinite(there.traction_ratio) && isfinite(there.slope));
        CHECK(isfinite(there.log_k_derivative) && isfinite(there.log_layer_derivative));
        CHECK(there.traction_ratio == -back.traction_ratio && there.slope == back.slope);
        CHECK(fabs(there.traction_ratio) <= 1.0 + 1.7 * k + 1e-8 && fabs(there.slope) <= 2.36);
    }
}

/* Any memory and any step: stepped on, or left as it was with a message. */
static void test_advance(const creep_table *table, const force_element_parameters *parameters,
                         force_element_input in) {
    double step = random_exponent(-9.0, 3.0);
    in.speed *= 1e-7;
    in.omega *= 1e-7;
    wheelset_task task = {.contact = parameters, .input = in, .tolerance = 1e-3};
    const char *error = wheelset_advance(table, &task, step);
    force_element_input after = task.input;
    double friction = parameters->static_friction * in.friction_scale * fmax(in.normal_load, 0.0);
    /* What errors of a small force are relative to. */
    double least = 1e-3 * parameters->kinetic_friction * parameters->nominal_load;
    double most =
        2.0 * (friction + fabs(in.memory.held_force) + fabs(in.memory.outer_force)) + least;
    CHECK(fabs(after.lateral.held_lateral) <=
          2.0 * (fabs(in.lateral.held_lateral) + fabs(in.lateral.outer_lateral)) + least);
    CHECK(fabs(after.memory.held_force) <= most && fabs(after.memory.outer_force) <= most);
    CHECK(isfinite(after.memory.held_force) && isfinite(after.memory.outer_force));
    CHECK(after.memory.unslipped > -0.2 && after.memory.unslipped < 1.2);
    CHECK(error == NULL || memcmp(&in, &after, sizeof in) == 0);
}

/* The creep force of a history of creepage is bounded by friction, at any load and step. */
static void test_roll(const creep_table *table, const force_element_parameters *parameters) {
    for (int i = 0; i < 1 + points / 1000; i++) {
        double creepage[3], distance[3] = {0.0}, force[3];
        double load = random_exponent(-3.0, 9.0), scale = random_exponent(-6.0, 3.0);
        for (int k = 0; k < 3; k++) {
            creepage[k] = (random_unit() - 0.5) * random_exponent(-9.0, 1.0);
            if (k > 0) distance[k] = distance[k - 1] + random_exponent(-9.0, 0.0);
        }
        const char *error = force_element_roll(table, parameters, random_exponent(-3.0, 2.0), load,
                                               scale, 3, creepage, distance, 1e-3, force);
        for (int k = 0; k < 3 && error == NULL; k++)
            CHECK(fabs(force[k]) <= (1.0 + 1e-12) * parameters->static_friction * scale * load);
    }
}

static void test_force(const creep_table *table, const force_element_parameters *parameters) {
    CHECK(process_zone_limit() == PROCESS_ZONE_LIMIT);
    relaxation_lengths lengths;
    relaxation_lengths_of(1.0, 0.28, &lengths);
    CHECK(lengths.lateral < lengths.longitudinal && lengths.longitudinal < lengths.spin);
    contact_memory memory; /* without a layer it lags by these lengths */
    contact_memory_of(1, 1.0, 0.28, 0.0, 0.0, &memory);
    CHECK(fabs(memory.relaxation_length / lengths.longitudinal - 1.0) < 1e-12);
    for (int i = 0; i < points; i++) {
        force_element_input in = {
            .omega = (random_unit() - 0.5) * random_exponent(-12.0, 9.0),
            .speed = (random_unit() - 0.5) * random_exponent(-12.0, 9.0),
            .normal_load = i % 10 == 0 ? 0.0 : random_exponent(-300.0, 12.0),
            .friction_scale = i % 11 == 0 ? 0.0 : random_exponent(-6.0, 3.0),
            .memory.unslipped = 1.2 * random_unit() - 0.1,
        };
        double held = in.normal_load * random_exponent(-6.0, 3.0);
        in.memory.held_force = (random_unit() - 0.5) * held;
        in.memory.outer_force = (random_unit() - 0.5) * held;
        in.lateral.held_lateral = (random_unit() - 0.5) * held;
        in.lateral.outer_lateral = (random_unit() - 0.5) * held;
        if (i % 12 == 0) in.normal_load = -in.normal_load;
        if (i % 13 == 0) in.omega = in.speed / parameters->radius;
        force_element_output out;
        force_element_evaluate(table, parameters, &in, &out);
        force_ranges any = {{-1e9, -1e9, -1e12, 0.0}, {1e9, 1e9, 1e12, 1e3}};
        double steepest = force_element_steepest(table, parameters, &in, &out);
        CHECK(isfinite(steepest) && steepest >= out.force_gradient);
        double alone = force_element_force(table, parameters, &any, in.omega, in.speed,
                                           in.normal_load, in.friction_scale);
        CHECK(alone == out.creep_force || parameters->memory > 0.0);
        any.maximum[3] = 0.5 * in.friction_scale - 1e-9;
        CHECK(isnan(force_element_force(table, parameters, &any, in.omega, in.speed, in.normal_load,
                                        in.friction_scale)));
        CHECK(isfinite(out.creep_force) && isfinite(out.force_by_omega));
        CHECK(isfinite(out.force_by_speed) && isfinite(out.force_by_load));
        double steady = out.steady_force;
        double most = parameters->static_friction * in.friction_scale * fmax(0.0, in.normal_load);
        CHECK(fabs(steady) <= most * (1.0 + 1e-15));
        CHECK(hypot(out.creep_force, out.lateral_force) <= most * (1.0 + 1e-12));
        CHECK(steady * out.creepage >= 0.0);
        CHECK(parameters->memory > 0.0 ||
              fabs(steady - out.creep_force) <= 1e-14 * fabs(steady) + DBL_MIN);
        for (size_t k = 0; k < sizeof out / sizeof(double); k++)
            CHECK(isfinite(((const double *)&out)[k]));
        if (parameters->memory == 0.0 || i % 20 != 1) continue;
        test_advance(table, parameters, in);
    }
    if (parameters->memory > 0.0) test_roll(table, parameters);
}

/* Twice the direction is twice the change, to the last bit. */
static void test_tangent(const creep_table *table, const force_element_parameters *parameters) {
    for (int i = 0; i < points; i++) {
        force_element_input in = {.omega = random_exponent(0.0, 3.0),
                                  .speed = random_exponent(-2.0, 2.0),
                                  .normal_load = random_exponent(3.0, 6.0),
                                  .friction_scale = random_exponent(-2.0, 0.5)};
        force_element_output out, change[2];
        force_element_evaluate(table, parameters, &in, &out);
        for (int twice = 0; twice < 2; twice++) {
            force_element_input moved = {.omega = 1.0 + twice, .speed = 0.5 + 0.5 * twice};
            force_element_tangent(table, parameters, &in, &out, &moved, &change[twice]);
        }
        CHECK(isfinite(change[0].creep_force));
        CHECK(change[1].creep_force == 2.0 * change[0].creep_force);
    }
}

/* A part of friction is left at any creepage, heat number and k_hat, and the less the hotter. */
static void test_thermal_softening(void) {
    for (int i = 0; i < points; i++) {
        double x = random_exponent(-20.0, 20.0), k_hat = random_exponent(-3.0, 6.0), left[2];
        double place[2] = {x, x}, number[2] = {random_exponent(-20.0, 19.0)}, k[2] = {k_hat, k_hat};
        number[1] = 2.0 * number[0];
        thermal_softening_many(i % 2, 2, place, number, k, left);
        CHECK(left[1] > 0.0 && left[0] <= 1.0 && left[1] <= left[0] * (1.0 + 1e-15));
    }
}

/* Forces of any contact: finite, bounded, none from nothing, and those of the mirror image. */
static void test_creep_forces(const creep_table *table) {
    static double coefficients[LATERAL_SPIN_ASPECTS * LATERAL_SPIN_COEFFICIENTS];
    creep_forces_parameters parameters = {.shear_modulus = 8.2e10,
                                          .poisson_ratio = 0.28,
                                          .static_friction = 0.4,
                                          .kinetic_friction = 0.3,
                                          .weakening_length = 1e-6};
    creep_forces pair;
    lateral_spin_value found;
    lateral_spin_shape shape = {.stiffness_ratio = 0.9, .softening_x = 0.05, .softening_y = 0.08};
    const double creepage[3] = {0.5, 0.2, 0.1};
    for (size_t i = 0; i < LATERAL_SPIN_ASPECTS * LATERAL_SPIN_COEFFICIENTS; i++)
        coefficients[i] = 2.0 * (random_unit() - 0.5);
    lateral_spin_evaluate(table, &shape, creepage, 0.3, 0.0, &found);
    CHECK(found.force[0] > found.force[1] && found.force[1] > 0.0 && found.force[2] == 0.0);
    for (int i = 0; i < points; i++) {
        if (i % 50 == 0) {
            parameters.weakening_length = i % 100 == 0 ? 0.0 : random_exponent(-9.0, -3.0);
            parameters.slip_rate_decay = i % 150 == 0 ? random_exponent(-2.0, 1.0) : 0.0;
            parameters.slip_rate_residual = 0.4;
            parameters.softening_temperature = i % 350 == 0 ? random_exponent(2.0, 3.5) : 0.0;
            parameters.thermal_effusivity = 1.3e4;
            parameters.layer_compliance = i % 400 == 0 ? random_exponent(-15.0, -9.0) : 0.0;
            creep_forces_prepare(&pair, table, coefficients, &parameters);
        }
        creep_forces_input in = {
            .semi_axis_x = random_exponent(-4.0, -1.0),
            .semi_axis_y = random_exponent(-4.0, -1.0),
            .normal_load = i % 10 == 0 ? 0.0 : random_exponent(-40.0, 12.0),
            .friction_scale = i % 11 == 0 ? 0.0 : random_exponent(-6.0, 3.0),
            .creepage_x = (random_unit() - 0.5) * random_exponent(-12.0, 9.0),
            .creepage_y = i % 7 == 0 ? 0.0 : (random_unit() - 0.5) * random_exponent(-12.0, 9.0),
            .spin = i % 5 == 0 ? 0.0 : (random_unit() - 0.5) * random_exponent(-12.0, 9.0),
            .speed = 60.0 * random_unit(),
        };
        creep_forces_output out[2], alone;
        creep_forces_input both[2] = {in, in};
        /* A hot wheel carries off more heat the faster it turns. */
        double turned = parameters.softening_temperature > 0.0 ? 1.0 : -1.0;
        both[1].creepage_x = turned * in.creepage_x;
        both[1].creepage_y = -in.creepage_y;
        both[1].spin = -in.spin;
        creep_forces_evaluate(&pair, 2, both, out);
        creep_forces_evaluate(&pair, 1, both, &alone);
        CHECK(memcmp(&alone, out, sizeof alone) == 0);
        for (size_t k = 0; k < sizeof out[0] / sizeof(double); k++)
            CHECK(isfinite(((const double *)&out[0])[k]));
        CHECK(out[0].force_x == turned * out[1].force_x && out[0].force_y == -out[1].force_y);
        CHECK(out[0].spin_moment == -out[1].spin_moment);
        CHECK(out[0].utilisation >= 0.0 && out[0].utilisation <= 1.0 + 1e-12);
        double aspect = in.semi_axis_x / in.semi_axis_y;
        CHECK(in.normal_load <= MIN_LOAD ||
              (aspect > 8.0 || aspect < 0.125) == (out[0].aspect_limited > 0.0));
        if (in.normal_load == 0.0 || in.friction_scale == 0.0) CHECK(out[0].force_x == 0.0);
    }
}

/* Any state and any step: stepped on, or left as it was with a message. */
static void test_steps(const creep_table *table, const force_element_parameters *parameters) {
    wheelset_parameters body = SOME_BODY;
    for (int i = 0; i < 100 && i < points / 10; i++) {
        wheelset_task task = {
            .contact = parameters,
            .body = &body,
            .drive_torque = (random_unit() - 0.5) * random_exponent(0.0, 7.0),
            .brake_torque = i % 3 == 0 ? 0.0 : random_exponent(0.0, 7.0),
            .pads = cos((double)i),
            .input = {.omega = (random_unit() - 0.5) * random_exponent(-6.0, 3.0),
                      .speed = (random_unit() - 0.5) * random_exponent(-6.0, 3.0),
                      .normal_load = i % 10 == 0 ? 0.0 : random_exponent(0.0, 6.0),
                      .friction_scale = 1.0,
                      .memory.held_force = (random_unit() - 0.5) * random_exponent(0.0, 6.0),
                      .memory.unslipped = random_unit(),
                      .memory.outer_force = (random_unit() - 0.5) * random_exponent(0.0, 6.0)},
            .tolerance = 1e-3,
            .max_substeps = i % 4, /* none, or too few */
        };
        const force_element_input before = task.input, *after = &task.input;
        const char *error = wheelset_advance(table, &task, random_exponent(-6.0, -1.0));
        CHECK(task.tolerance >= 1e-3);
        CHECK(isfinite(after->omega) && isfinite(after->speed) && fabs(task.pads) <= 1.0);
        CHECK(isfinite(after->memory.held_force) && isfinite(after->memory.unslipped));
        CHECK(isfinite(after->memory.outer_force));
        CHECK(error == NULL || memcmp(after, &before, sizeof before) == 0);
    }
}

/* Many contacts and wheelsets have the bits of one by one, and the first that fails is named, which
 * takes all the substeps that there can be. */
static void test_together(const creep_table *table, const force_element_parameters *parameters,
                          int failing) {
    enum { MANY_WHEELS = 19, LATE = 11 };
    wheelset_parameters body = SOME_BODY;
    force_element_parameters contact[MANY_WHEELS];
    force_element_output out[MANY_WHEELS], alone;
    force_task contacts[MANY_WHEELS];
    wheelset_task tasks[MANY_WHEELS];
    for (int i = 0; i < MANY_WHEELS; i++) {
        contact[i] = *parameters;
        contact[i].static_friction *= 1.0 + 0.02 * i;
        tasks[i] = (wheelset_task){
            .contact = &contact[i],
            .body = &body,
            .drive_torque = 1e3 * i,
            .brake_torque = i % 3 == 1 ? 2e3 * i : 0.0,
            .pads = 0.5,
            .input = {.omega = 20.0 + 0.01 * i,
                      .speed = 10.0,
                      .normal_load = i == 3 ? 0.0 : 1e5 - 1e3 * i,
                      .friction_scale = i == 4 ? 0.0 : 1.0,
                      .lateral_velocity = i == 5 ? 0.01 : 0.0,
                      .memory.unslipped = 1.0},
            .tolerance = 1e-4,
        };
        contacts[i] = (force_task){&contact[i], &tasks[i].input, &out[i]};
    }
    for (size_t n = 1; n <= MANY_WHEELS; n += 3) {
        wheelset_task together[MANY_WHEELS];
        size_t failed = 0;
        force_elements_evaluate(table, contacts, n);
        memcpy(together, tasks, sizeof tasks);
        CHECK(wheelsets_advance(table, together, n, 0.01, &failed) == NULL);
        for (size_t i = 0; i < n; i++) {
            wheelset_task one = tasks[i];
            force_element_evaluate(table, one.contact, &one.input, &alone);
            CHECK(memcmp(&alone, &out[i], sizeof alone) == 0);
            CHECK(wheelset_advance(table, &one, 0.01) == NULL);
            CHECK(memcmp(&one.input, &together[i].input, sizeof one.input) == 0);
            CHECK(one.substep == together[i].substep && one.pads == together[i].pads);
        }
    }
    if (!failing) return;
    size_t failed = 0;
    tasks[LATE].drive_torque = NAN;
    CHECK(wheelsets_advance(table, tasks, MANY_WHEELS, 0.01, &failed) != NULL);
    CHECK(failed == LATE);
    CHECK(wheelsets_advance(table, &tasks[LATE - 1], 2, 0.01, &failed) != NULL);
    CHECK(failed == 1);
    CHECK(isfinite(tasks[LATE].input.omega) && isfinite(tasks[0].input.omega));
}

/* Two wheels, with any of axle, motor and memory, that differ in everything. */
typedef struct {
    force_element_parameters contact;
    drivetrain_parameters train;
    drivetrain_input in;
    drivetrain_state state;
} some_drivetrain;

static some_drivetrain random_drivetrain(int i, const force_element_parameters *parameters) {
    some_drivetrain d = {.contact = *parameters};
    d.contact.memory = i % 2 ? 1.0 : 0.0;
    d.train = (drivetrain_parameters){
        .body = SOME_BODY,
        .axle_stiffness = i % 3 ? random_exponent(3.0, 8.0) : 0.0,
        .axle_damping = i % 3 ? random_exponent(0.0, 4.0) : 0.0,
        .drive_share = random_unit(),
        .motor_lag = i % 7 ? random_exponent(-3.0, 0.0) : 0.0,
        .motor_inertia = i % 4 > 1 ? random_exponent(0.0, 4.0) : 0.0,
        .shaft_stiffness = random_exponent(3.0, 8.0),
        .shaft_damping = i % 8 ? random_exponent(0.0, 4.0) : 0.0,
        .brake_fill_time = i % 6 == 1 ? random_exponent(-3.0, 0.0) : 0.0,
        .brake_vent_time = random_exponent(-3.0, 0.0),
    };
    if (i % 5 == 0) d.train.body.inverse_mass = 0.0;
    d.in = (drivetrain_input){
        .commanded_torque = (random_unit() - 0.5) * random_exponent(0.0, 6.0),
        .commanded_brake = i % 6 == 1 ? random_exponent(0.0, 6.0) : 0.0,
        .load_left = i % 10 ? random_exponent(0.0, 6.0) : 0.0,
        .load_right = i % 11 ? random_exponent(0.0, 6.0) : 0.0,
        .friction_left = 1.0,
        .friction_right = random_exponent(-2.0, 0.0),
        .slope = random_exponent(-2.0, 1.0),
    };
    if (i % 13 == 0) { /* both wheels alike */
        d.in.load_right = d.in.load_left;
        d.in.friction_right = d.in.friction_left;
    }
    d.state.speed = (random_unit() - 0.5) * random_exponent(-6.0, 3.0);
    d.state.omega_left = d.state.omega_right = (random_unit() - 0.5) * random_exponent(-6.0, 3.0);
    if (i % 4 == 1) {
        d.state.left.held_force = (random_unit() - 0.5) * random_exponent(0.0, 6.0);
        d.state.right.held_force = (random_unit() - 0.5) * random_exponent(0.0, 6.0);
        d.state.left.outer_force = (random_unit() - 0.5) * random_exponent(0.0, 6.0);
        d.state.right.outer_force = (random_unit() - 0.5) * random_exponent(0.0, 6.0);
        d.state.left.unslipped = random_unit();
        d.state.right.unslipped = random_unit();
    }
    if (i % 6 == 1) {
        d.state.pads_left = cos((double)i);
        d.state.pads_right = sin((double)i);
    }
    return d;
}

/* The pressure over the ellipse flattens the curvatures of both surfaces. */
static void test_hertz(void) {
    for (int i = 0; i < points / 100; i++) {
        double x = random_exponent(-3.0, 3.0), y = random_exponent(-3.0, 3.0), axes[2];
        double compliance = random_exponent(-9.0, -4.0);
        hertz_semi_axes(x, y, compliance, axes);
        CHECK(fabs(x * compliance * hertz_integral(axes[0], axes[1]) - 1.0) < 1e-12);
        CHECK(fabs(y * compliance * hertz_integral(axes[1], axes[0]) - 1.0) < 1e-12);
    }
}

/* Turns and steady states lie in order on their side of the curve; a search with less room finds
 * the first of them; the grip and the peak are among them. */
static void test_curve(const creep_table *table, const force_element_parameters *contacts) {
    enum { ROOM = 64, NEAR = 4 };
    for (int i = 0; i < 6 * CONTACTS; i++) {
        const force_element_parameters *parameters = &contacts[i / 2 % CONTACTS];
        wheelset_parameters body = SOME_BODY;
        body.damping = i % 3 == 0 ? 0.0 : random_exponent(-1.0, 3.0);
        if (i % 4 == 0) body.inverse_mass = 0.0;
        if (i % 4 == 1) body.linear_resistance = body.quadratic_resistance = 0.0;
        creep_conditions at = {
            .speed = i % 5 == 0 ? 0.0 : random_exponent(-1.0, 2.0),
            .normal_load = {random_exponent(4.0, 6.0), random_exponent(4.0, 6.0)},
            .friction_scale = {random_exponent(-1.0, 0.0), random_exponent(-1.0, 0.0)},
            .resistance_force = random_exponent(0.0, 4.0),
            .balanced = i % 7 == 1 ? 1.0 : 0.0,
        };
        if (i % 2 == 0) at.normal_load[1] = at.normal_load[0];
        if (i % 2 == 0) at.friction_scale[1] = at.friction_scale[0];
        if (i % 6 == 5) at.normal_load[0] = at.friction_scale[1] = 0.0;
        const wheelset_parameters *with = i % 11 == 3 ? NULL : &body;
        creep_point turns[ROOM], steady[ROOM], one, worst;
        double creepage, limit, largest;
        for (double side = -1.0; side < 2.0; side += 2.0) {
            size_t n = creep_curve_turns(table, parameters, with, &at, side, ROOM, turns);
            CHECK(n >= 1 && n <= ROOM);
            for (size_t k = 1; k < n; k++)
                CHECK(side * turns[k].creepage > side * turns[k - 1].creepage);
            CHECK(creep_curve_turns(table, parameters, with, &at, side, 1, &one) == n);
            CHECK(one.creepage == turns[0].creepage);
            double torque = 0.9 * turns[0].torque;
            n = creep_curve_steady(table, parameters, with, &at, torque, side, ROOM, steady);
            for (size_t k = 0; k < n; k++) {
                creep_curve_points(table, parameters, with, &at, 1, &steady[k].creepage, &one);
                CHECK(one.torque == steady[k].torque);
            }
        }
        double rest = 0.0; /* belongs to traction */
        creep_curve_points(table, parameters, with, &at, 1, &rest, &one);
        size_t kept =
            creep_curve_steady(table, parameters, with, &at, one.torque, -1.0, ROOM, steady);
        CHECK(kept == 0 || steady[0].creepage < 0.0);
        double torque = 0.5 * turns[0].torque;
        size_t n = creep_curve_steady(table, parameters, &body, &at, torque, 1.0, ROOM, steady);
        creepage = creep_curve_grip(table, parameters, &body, &at, torque, &limit);
        CHECK(isnan(creepage) || creepage <= 0.0 || (n > 0 && creepage == steady[0].creepage));
        CHECK(isnan(creep_curve_grip(table, parameters, &body, &at, 1e12, &limit)));
        CHECK(limit < 1e12 || at.balanced != 0.0); /* where a speed may be missing */
        creep_point fold[2];
        size_t folds = creep_curve_fold(table, parameters, &body, &at, fold);
        n = creep_curve_turns(table, parameters, &body, &at, 1.0, ROOM, turns);
        CHECK(folds == (n > 1 ? 2 : 0));
        if (folds) CHECK(fold[0].creepage == turns[0].creepage && fold[1].torque >= 0.0);
        largest = creep_curve_peak(table, parameters, &at, &creepage);
        CHECK(largest > 0.0 ? creepage > 0.0 : isnan(creepage));
        creep_curve_worst(table, parameters, &body, &at, &worst);
        CHECK(at.balanced != 0.0 || isfinite(worst.pole));

        drivetrain_parameters train = {.body = body};
        drivetrain_member member = {
            .table = table, .contact = parameters, .drivetrain = &train, .rails = NULL};
        drivetrain_input in = {.resistance_force = at.resistance_force,
                               .load_left = 0.5 * at.normal_load[0],
                               .load_right = 0.5 * at.normal_load[1],
                               .friction_left = at.friction_scale[0],
                               .friction_right = at.friction_scale[1],
                               .slope = 1.0};
        double force, held, top, near[NEAR], alone, speeds[NEAR];
        const size_t which[NEAR] = {0};
        drivetrains_peak(&member, which, 1, &in, &at.speed, &force);
        CHECK(force == largest);
        drivetrain_input inputs[NEAR];
        for (int k = 0; k < NEAR; k++) { /* peaks that the search finds from the one before */
            double change = k == 0 ? 1.0 : random_exponent(-0.3, 0.3);
            inputs[k] = in;
            inputs[k].friction_left *= change;
            inputs[k].friction_right *= change;
            speeds[k] = at.speed;
        }
        drivetrains_peak(&member, which, NEAR, inputs, speeds, near);
        for (int k = 0; k < NEAR; k++) {
            drivetrains_peak(&member, which, 1, &inputs[k], speeds, &alone);
            CHECK(near[k] == alone);
        }
        at.balanced = 0.0;
        torque = creep_curve_grip(table, parameters, &body, &at, torque, &limit);
        drivetrains_grip(&member, 1, &in, &at.speed, &worst.torque, &held, &top);
        creepage = creep_curve_grip(table, parameters, &body, &at, worst.torque, &limit);
        CHECK(held == creepage || (isnan(held) && isnan(creepage)));
    }
}

static drivetrain_member member_of(const creep_table *table, const some_drivetrain *d,
                                   const track *rails) {
    drivetrain_member member = {
        .table = table, .contact = &d->contact, .drivetrain = &d->train, .rails = rails};
    drivetrains_prepare(&member, 1);
    return member;
}

static void test_drivetrains(const creep_table *table, const force_element_parameters *parameters) {
    for (int i = 0; i < 24 && i < points / 10; i++) {
        some_drivetrain d = random_drivetrain(i, parameters), before = d;
        drivetrain_member member = member_of(table, &d, NULL);
        drivetrain_output out;
        double substep = 0.0;
        unsigned char failed = 0;
        drivetrains_advance(&member, 1, 1, NULL, &d.in, &d.state, 0.0, random_exponent(-6.0, -2.0),
                            1e-3, &substep, &failed);
        const double *numbers = (const double *)&d.state;
        for (size_t k = 0; k < sizeof d.state / sizeof *numbers; k++) CHECK(isfinite(numbers[k]));
        CHECK(!failed || memcmp(&d.state, &before.state, sizeof d.state) == 0);
        drivetrains_evaluate(&member, 1, 1, &d.in, &d.state, &out, NULL);
        CHECK(isfinite(out.creep_force_left) && isfinite(out.stored_energy));
        if (d.train.axle_stiffness == 0.0) CHECK(d.state.omega_left == d.state.omega_right);
    }
}

/* Rows of a stretch; at most ROWS are kept, a few at a time. The events are in order. */
enum { ROWS = 4096, ROWS_AT_ONCE = 7 };
static size_t all_rows(const drivetrain_member *member, const run_stretch *given,
                       const run_row *first, run_row *rows, int *status) {
    wheelset_run *run = wheelset_run_begin(member, given, first);
    run_event events[RUN_CROSSINGS];
    size_t n = 0, count;
    do {
        size_t written = wheelset_run_rows(run, ROWS_AT_ONCE, &rows[n], status, &count, events);
        n += written;
        CHECK(written <= ROWS_AT_ONCE && count <= RUN_CROSSINGS);
        for (size_t k = 0; k < count; k++) {
            CHECK(isfinite(events[k].creepage) && isfinite(events[k].row.omega));
            double after = events[k].row.time - (k > 0 ? events[k - 1].row.time : given->start);
            CHECK((given->end > given->start ? after : -after) >= 0.0);
        }
    } while (*status == RUN_GOES_ON && n + ROWS_AT_ONCE < ROWS);
    wheelset_run_free(run);
    return n;
}

/* A run balances its energy, passes each row of its grid, comes back when it runs backward for a
 * moment, and gives up where no step meets the tolerance. */
static void test_run(const creep_table *table, const force_element_parameters *contacts) {
    static run_row rows[ROWS];
    for (int i = 0; i < 4 * CONTACTS; i++) {
        some_drivetrain d = {.contact = contacts[i / 4], .train = {.body = SOME_BODY}};
        d.contact.memory = 0.0;
        d.train.drive_share = 0.5;
        drivetrain_member member = member_of(table, &d, NULL);
        run_stretch given = {
            .law = {i % 2, 1e6, 2e6, 0.0, 2.5e4},
            .end = random_exponent(-1.0, 0.5),
            .from = {i % 2 ? 0.005 : 1e4, d.contact.nominal_load, 1.0, 0.0},
            .to = {i % 2 ? 0.05 : 6e4, i % 3 * d.contact.nominal_load, i % 5 ? 0.5 : 1.0, 1e3},
            .interval = 0.1,
            .tolerance = 1e-8,
            .scale = {.speed = 0.1,
                      .integral_torque = 1.0,
                      .distance = 1.0,
                      .drive_work = 1e3,
                      .creep_work = 1e3,
                      .resistance_work = 1e3,
                      .loss_work = 1e3},
            .crossings = 4,
            .crossing = {{.creepage = 1.0, .level = 0.01},
                         {.creepage = 1.0, .level = 0.01 - 1e-9}, /* in the same step */
                         {.fall = 1.0, .direction = 1},
                         {.abs_creepage = 1.0, .level = 0.5, .direction = 1, .ends = i % 4 == 0}},
        };
        run_row first = {
            .speed = i % 6 ? 10.0 : 0.0, .omega = i % 6 ? 20.05 : 0.0, .integral_torque = 1e4};
        int status;
        size_t n = all_rows(&member, &given, &first, rows, &status), on_grid = 0;
        CHECK(status == RUN_AT_END || (status == RUN_STOPPED && i % 4 == 0));
        const run_row *last = &rows[n - 1];
        CHECK(rows[0].time == 0.0 && (status == RUN_STOPPED || last->time == given.end));
        for (size_t k = 1; k < n; k++) {
            CHECK(rows[k].time > rows[k - 1].time);
            on_grid += rows[k].time == floor(rows[k].time / 0.1 + 0.5) * 0.1;
        }
        CHECK(on_grid == (size_t)floor(last->time / 0.1));
        double stored = 125.0 * (last->omega * last->omega - first.omega * first.omega) +
                        0.5e5 * (last->speed * last->speed - first.speed * first.speed);
        double lost = last->creep_work + last->resistance_work + last->loss_work;
        CHECK(fabs(last->drive_work - stored - lost) < 1e-5 * (1e3 + fabs(last->drive_work)));

        given.start = 0.002; /* some 0.1 of a time constant */
        given.end = given.interval = 0.0;
        given.crossings = 0;
        run_stretch forward = given;
        forward.start = 0.0;
        forward.end = given.start;
        forward.from = forward.to;
        given.to = given.from = forward.from;
        n = all_rows(&member, &forward, &first, rows, &status);
        run_row there = rows[n - 1];
        n = all_rows(&member, &given, &there, rows, &status);
        CHECK(status == RUN_AT_END && fabs(rows[n - 1].omega - first.omega) < 1e-4);
        forward.tolerance = NAN;
        n = all_rows(&member, &forward, &first, rows, &status);
        CHECK(n == 1 && status == RUN_FAILED);
    }
}

/* What is done to many, by name of the vectors. */
typedef struct {
    void (*advance)(const drivetrain_member *, size_t, size_t, vehicle *, drivetrain_input *,
                    drivetrain_state *, double, double, double, double *, unsigned char *);
    void (*evaluate)(const drivetrain_member *, size_t, size_t, const drivetrain_input *,
                     const drivetrain_state *, drivetrain_output *, force_element_output *);
    void (*ratios)(const creep_table *, size_t, const double *, const double *, size_t,
                   const double *, size_t, double *, double *);
    void (*forces)(const creep_table *, const force_element_parameters *, size_t,
                   const force_element_input *, force_element_output *);
    void (*only_forces)(const creep_table *, const force_element_parameters *, size_t,
                        const double *const[4], const size_t[4], double *);
} many_functions;

#define MANY_FUNCTIONS(suffix)                                                                     \
    {drivetrains_advance##suffix, drivetrains_evaluate##suffix, creep_table_evaluate_many##suffix, \
     force_element_evaluate_many##suffix, force_element_forces##suffix}

/* Those that this processor has; the first are those that it chooses for itself. */
static size_t widths(many_functions found[3]) {
    static const many_functions known[] = {MANY_FUNCTIONS(), MANY_FUNCTIONS(_portable),
                                           MANY_FUNCTIONS(_avx2)};
    size_t n = 2;
#ifdef __x86_64__
    if (__builtin_cpu_supports("avx2")) n = 3;
#endif
    memcpy(found, known, n * sizeof *known);
    return n;
}

enum { MANY = 40, OF_ONE_KIND = 24, NOT_A_NUMBER = 20 };

static void test_trains_of_width(const many_functions *with, const drivetrain_member *members,
                                 const some_drivetrain *given, drivetrain_state *state,
                                 double *tried, unsigned char *failed, drivetrain_output *out) {
    drivetrain_input in[MANY];
    memset(tried, 0, MANY * sizeof *tried);
    memset(failed, 0, MANY);
    for (int i = 0; i < MANY; i++) {
        in[i] = given[i].in;
        state[i] = given[i].state;
    }
    with->advance(members, MANY, 1, NULL, in, state, 0.0, 5e-4, 1e-2, tried, failed);
    for (int i = 0; i < MANY; i++) CHECK(failed[i] == (i == NOT_A_NUMBER));
    with->evaluate(members, MANY, 1, in, state, out, NULL);
}

static void test_points_of_width(const many_functions *with, const creep_table *table,
                                 const force_element_parameters *parameters) {
    double x[MANY], k[MANY], layer[MANY], ratio[MANY], slope[MANY];
    double speed[MANY], load[MANY], friction[MANY], only[MANY];
    const double omega = 20.0, *const inputs[4] = {&omega, speed, load, friction};
    const size_t strides[4] = {0, 1, 1, 1};
    force_element_input in[MANY];
    force_element_output out[MANY];
    for (int i = 0; i < MANY; i++) {
        x[i] = (random_unit() - 0.5) * random_exponent(-12.0, 3.0);
        k[i] = random_unit() * fmin(table->k_max, 2.0);
        layer[i] = i % 3 ? random_exponent(-3.0, 2.0) : 0.0;
        in[i] = (force_element_input){
            .omega = 20.0,
            .speed = 10.0 * random_unit(),
            .normal_load = i % 7 ? 1e5 * random_unit() : 0.0,
            .friction_scale = i % 9 ? random_unit() + 0.1 : 0.0,
            .memory.held_force = 0.4e5 * random_unit(),
            .memory.unslipped = random_unit(),
            .memory.outer_force = 0.1e5 * random_unit(),
        };
        if (i % 5 == 0) in[i].normal_load = -in[i].normal_load;
        speed[i] = in[i].speed;
        load[i] = in[i].normal_load;
        friction[i] = in[i].friction_scale;
    }
    with->ratios(table, MANY, x, k, 1, layer, 1, ratio, slope);
    with->forces(table, parameters, MANY, in, out);
    with->only_forces(table, parameters, MANY, inputs, strides, only);
    for (int i = 0; i < MANY; i++) {
        creep_value one;
        force_element_output force;
        creep_table_evaluate(table, x[i], k[i], layer[i], &one);
        CHECK(one.traction_ratio == ratio[i] && one.slope == slope[i]);
        double lam = table->layer_w > 0 ? layer[i] : 0.0;
        CHECK(creep_table_ratio(table, x[i], k[i], lam) == ratio[i]);
        CHECK(creep_table_slope(table, x[i], k[i], lam) == slope[i]);
        CHECK(isnan(creep_table_ratio(table, INFINITY, k[i], lam)));
        CHECK(isnan(creep_table_slope(table, x[i], k[i], -1.0)));
        force_element_evaluate(table, parameters, &in[i], &force);
        CHECK(fabs(force.creep_force - out[i].creep_force) <= 1e-12 * fabs(force.creep_force));
        CHECK((force.falling_branch > 0.0) == (out[i].falling_branch > 0.0));
        in[i].memory.held_force = in[i].memory.unslipped = in[i].memory.outer_force = 0.0;
        force_element_evaluate(table, parameters, &in[i], &force);
        CHECK(fabs(force.creep_force - only[i]) <= 1e-12 * fabs(force.creep_force));
    }
}

/* Vectors of any width, many together or one by one: the same bits. */
static void test_widths(const creep_table *table, const force_element_parameters *parameters) {
    static const double at[] = {-0.01, 0.0, 0.001, 0.02, 0.02}, value[] = {1.0, 0.9, 0.7, 0.3, 1.1};
    const track rails = {.left = {.count = 5, .at = at, .value = value},
                         .right = {.count = 4, .at = at + 1, .value = value + 1},
                         .over_time = {.count = 1, .at = at, .value = value},
                         .slope = {.count = 3, .at = at, .value = value + 2},
                         .grade = {.count = 2, .at = at + 2, .value = value + 3},
                         .scale = 1.0};
    static const double lines[] = {1.0, 1.1, 1.3, 0.8, 0.9, 1.2};
    const peak_map peaks = {{-1.0, 0.0, 0.0, 0.0}, {1.0, 1.0, 1.0, 1.0}, {3, 1, 1, 1}, 2.0, lines};
    track by_peaks = rails;
    by_peaks.peaks = &peaks;
    static const double axis[] = {0.0, 10.0, 1e3}, friction[] = {1.3, 1.2, 1.0, 0.9, 0.8, 0.6};
    const pad_table pads = {3, 2, axis, axis, friction};
    some_drivetrain d[MANY];
    drivetrain_member members[MANY];
    drivetrain_state state[2][MANY];
    drivetrain_output out[2][MANY];
    double tried[2][MANY];
    unsigned char failed[2][MANY];
    many_functions known[3];
    size_t count = widths(known);
    for (int i = 0; i < MANY; i++) {
        d[i] = random_drivetrain(i < OF_ONE_KIND ? 1 : i, parameters);
        if (i == NOT_A_NUMBER) d[i].in.commanded_torque = NAN;
        members[i] = member_of(table, &d[i], i % 4 ? i % 3 ? &rails : &by_peaks : NULL);
        if (i % 2) members[i].pads = &pads;
    }
    for (size_t w = 0; w < count; w++) {
        size_t k = w > 0;
        test_trains_of_width(&known[w], members, d, state[k], tried[k], failed[k], out[k]);
        test_points_of_width(&known[w], table, parameters);
        if (w == 0) continue;
        CHECK(memcmp(state[0], state[1], sizeof state[0]) == 0);
        CHECK(memcmp(tried[0], tried[1], sizeof tried[0]) == 0);
        /* The next one is not a number. */
        CHECK(memcmp(out[0], out[1], NOT_A_NUMBER * sizeof out[0][0]) == 0);
    }
    for (int i = 0; i < MANY; i++) {
        double substep = 0.0;
        unsigned char fails = 0;
        drivetrains_advance(&members[i], 1, 1, NULL, &d[i].in, &d[i].state, 0.0, 5e-4, 1e-2,
                            &substep, &fails);
        CHECK(memcmp(&d[i].state, &state[0][i], sizeof d[i].state) == 0);
        CHECK(substep == tried[0][i] && fails == failed[0][i]);
        drivetrains_evaluate(&members[i], 1, 1, &d[i].in, &d[i].state, &out[1][i], NULL);
        CHECK(i >= NOT_A_NUMBER || memcmp(&out[0][i], &out[1][i], sizeof out[0][i]) == 0);
    }
}

/* The axles of a vehicle keep one speed at any width; one with different kinds of axles fails.
 * Where loads and rails follow, all weight stays on the axles, and only wheels that slip clean. */
static void test_vehicles(const creep_table *table, const force_element_parameters *parameters) {
    enum { AXLES = 3, ALL = 9, VEHICLES = ALL / AXLES, NODES = 128 };
    static const double at[] = {-1.0, 0.05, 0.05}, value[] = {0.7, 0.5, 0.6};
    static const double one = 1.0, rise = 0.01;
    const profile even = {.count = 1, .at = at, .value = &one};
    const profile stepped = {.count = 3, .at = at, .value = value};
    const track rails = {.left = stepped,
                         .right = stepped,
                         .over_time = even,
                         .slope = even,
                         .grade = {.count = 1, .at = at, .value = &rise},
                         .scale = 1.0};
    const vehicle_parameters body = {.axles = AXLES,
                                     .axles_per_bogie = 1.0,
                                     .position = {0.0, 2.0, 5.0},
                                     .body_mass = 4e4,
                                     .bogie_mass = 1e3,
                                     .wheelset_mass = 1e3,
                                     .train_mass = 1e5,
                                     .body_height = 1.5,
                                     .pivot_height = 0.5,
                                     .coupler_height = 1.0,
                                     .pitch_inertia = 50.0,
                                     .load_lag = 0.02};
    double weight = 9.80665 * (4e4 + AXLES * 2e3), work[2][VEHICLES][2 * NODES];
    const vehicle_forces none = {.towed_force = 0.0};
    double at_rest[1][MAX_AXLES];
    vehicle_loads(&body, 1, &none, at_rest);
    CHECK(fabs((at_rest[0][0] + at_rest[0][1] + at_rest[0][2]) / weight - 1.0) < 1e-14);
    some_drivetrain d[ALL];
    drivetrain_member members[ALL];
    drivetrain_state state[2][ALL];
    axle_state axles[2][ALL];
    many_functions known[3];
    size_t count = widths(known);
    for (int i = 0; i < ALL; i++) {
        d[i] = random_drivetrain(39, parameters); /* whose wheels are alike */
        if (i / AXLES == 1 || i == ALL - 1) d[i].train.motor_lag = 0.0;
        if (i / AXLES == 1) d[i].train.motor_inertia = 0.0;
        d[i].state.speed = i % AXLES ? d[i - 1].state.speed : (i ? -8.0 : 60.0);
        d[i].state.distance = -body.position[i % AXLES];
        d[i].state.omega_left = d[i].state.omega_right =
            (1.0 + 0.01 * random_unit()) * d[i].state.speed / d[i].train.body.radius;
        members[i] = member_of(table, &d[i], &rails);
    }
    for (size_t w = 0; w < 2 * count; w++) {
        int follows = w >= count;
        size_t k = w % count > 0;
        drivetrain_input in[ALL];
        double tried[ALL] = {0.0};
        unsigned char failed[ALL] = {0};
        vehicle vehicles[VEHICLES];
        rail_range range[VEHICLES];
        for (int i = 0; i < ALL; i++) {
            in[i] = d[i].in;
            state[k][i] = d[i].state;
            in[i].friction_left = in[i].friction_right = 0.5;
            if (i / AXLES == 1) in[i].resistance_force = 1e7; /* an axle lifts off */
        }
        for (int i = 0; i < VEHICLES; i++) {
            range[i] = (rail_range){.first = 0.0, .last = -1.0};
            vehicles[i] = (vehicle){.body = &body,
                                    .cleaning = 1e-4,
                                    .recovered = 0.9,
                                    .node_distance = i > 0 ? 0.1 : 1e-4, /* passed at once */
                                    .axle = &axles[k][AXLES * i],
                                    .range = &range[i],
                                    .work = work[k][i],
                                    .nodes = NODES};
        }
        if (follows) {
            drivetrain_output out[ALL];
            force_element_output contact[2 * ALL];
            drivetrains_settle(members, ALL, in, state[k]);
            drivetrains_evaluate(members, ALL, 1, in, state[k], out, contact);
            for (int i = 0; i < 2 * ALL; i++)
                CHECK(fabs(contact[i].creep_force - contact[i].steady_force) <=
                      1e-9 * fabs(contact[i].steady_force));
            vehicles_settle(members, ALL, AXLES, vehicles, in, state[k], out);
        }
        for (int row = 0; row < 20; row++)
            known[w % count].advance(members, ALL, AXLES, follows ? vehicles : NULL, in, state[k],
                                     1e-3 * row, 1e-3, 1e-4, tried, failed);
        for (int i = 0; i < ALL; i++) {
            const drivetrain_state *now = &state[k][i];
            CHECK(failed[i] == (i >= ALL - AXLES));
            CHECK(isfinite(now->omega_left) && now->omega_left == now->omega_right);
            CHECK(fabs(now->speed / now[-(i % AXLES)].speed - 1.0) < 1e-15);
            if (!follows || failed[i]) continue;
            CHECK(in[i].friction_left >= 0.5 && in[i].friction_left <= 0.9);
            double *axle = &axles[k][i].load, sum = 0.0;
            for (size_t n = 0; n < sizeof(axle_state) / sizeof *axle; n++) CHECK(isfinite(axle[n]));
            for (int n = 0; n < AXLES; n++) sum += axles[k][i - i % AXLES + n].load;
            CHECK(sum > (1.0 - 1e-12) * weight); /* none is below zero */
        }
        if (follows)
            for (double n = range[1].first; n <= range[1].last; n++)
                CHECK(work[k][1][2 * ((size_t)(long long)n & (NODES - 1))] >= 0.0);
        if (k == 0) continue;
        CHECK(memcmp(state[0], state[1], sizeof state[0]) == 0);
        if (follows) CHECK(memcmp(axles[0], axles[1], sizeof axles[0]) == 0);
    }
}

/* Values that a tool could hand over by mistake, and many that it could mean. */
static double any_value(void) {
    static const double odd[] = {0.0,     -0.0,    1.0,      NAN,      INFINITY, -INFINITY,
                                 DBL_MAX, DBL_MIN, -DBL_MAX, 4.9e-324, 1e9,      1e-6};
    if (random_unit() < 0.3) return odd[(int)(random_unit() * 12.0)];
    double sign = random_unit() < 0.5 ? -1.0 : 1.0;
    return sign * random_exponent(-6.0, 6.0);
}

/* Any variable of any wheel set to any value: never a number that is not finite and yet fine. The
 * fuzz targets call all functions in any order. */
static void test_any_values(const char *location, const char *token, const model *m) {
    const fmi *v = fmi_of(2);
    for (int life = 0; life < points; life++) {
        int messages = 0;
        void *c = v->open(0, token, location, 1, &messages);
        double time = 0.0, found;
        start(v, c, 0.0);
        for (int i = 0; i < 200; i++) {
            unsigned r[2], wheels = (unsigned)((component *)c)->wheels;
            for (int k = 0; k < 2; k++)
                r[k] = (unsigned)(random_unit() * (double)(m->count + 1)) +
                       MAX_VARIABLES * (unsigned)(random_unit() * wheels);
            double value = any_value(), seed = random_exponent(-6.0, 6.0);
            double step = random_exponent(-9.0, 0.0);
            v->set(c, r, 1, &value);
            if (v->step(c, time, step) == RESULT_OK) time += step;
            if (v->get(c, r + 1, 1, &found) == RESULT_OK) CHECK(isfinite(found));
            if (v->derivative(c, 0, r, 1, r + 1, 1, &seed, &found) == RESULT_OK)
                CHECK(isfinite(found));
        }
        v->close(c);
    }
}

int main(int count, char **arguments) {
    char message[4096];
    void *bytes;
    size_t size;
    creep_table table;
    if (count != 4 && count != 5) return 2;
    const char *location = arguments[2], *token = arguments[3];
    points = atoi(arguments[1]);
    if (count == 5) {
        test_any_values(location, token, model_of(arguments[4]));
        return verdict();
    }
    const char *error =
        resource_read(location, "creep_table.bin", &bytes, &size, message, sizeof message);
    if (error == NULL) error = creep_table_open(&table, bytes, size);
    if (error != NULL) {
        printf("%s\n", error);
        return 2;
    }
    force_element_parameters contacts[CONTACTS] = {SOME_CONTACT}, *parameters = contacts;
    test_table(&table);
    test_force(&table, parameters);
    test_steps(&table, parameters);
    test_creep_forces(&table);
    parameters++;
    *parameters = contacts[0];
    parameters->load_exponent = 1.0 / 3.0; /* an ellipse */
    parameters->softening = 0.1;
    parameters->slip_rate_residual = 0.4;
    parameters->slip_rate_decay = 0.6;
    test_force(&table, parameters);
    parameters->load_exponent = 0.4; /* as a tool may set it */
    test_force(&table, parameters);
    parameters->load_exponent = 0.5;
    parameters->memory = 1.0;
    test_force(&table, parameters);
    test_steps(&table, parameters);
    test_drivetrains(&table, parameters);
    test_widths(&table, parameters);
    test_vehicles(&table, parameters);
    test_together(&table, contacts, 1);
    test_together(&table, parameters, 0);
    parameters++;
    *parameters = contacts[1];
    parameters->softening_temperature =
        600.0; /* and with the fall with slip speed, as a tool may */
    parameters->thermal_effusivity = 13e3;
    test_force(&table, parameters);
    test_together(&table, parameters, 0);
    parameters->memory = parameters->slip_rate_decay = 0.0;
    parameters->elliptic = 1.0;
    parameters->layer_compliance = 1.3e-13;
    test_force(&table, parameters);
    test_drivetrains(&table, parameters);
    test_widths(&table, parameters);
    test_together(&table, parameters, 0);
    test_tangent(&table, parameters);
    test_curve(&table, contacts);
    test_run(&table, contacts);
    test_hertz();
    test_thermal_softening();
    free(bytes);
    return verdict();
}

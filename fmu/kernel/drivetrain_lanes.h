/* The drivetrain's equations for LANES drivetrains at once. */
#include <math.h>
#include <stddef.h>

#include "drivetrain.h"
#include "force_lanes.h"
#include "rosenbrock.h"
#include "wheelset_law.h"

enum {
    SPEED = PLACE(drivetrain_state, speed),
    LEFT = PLACE(drivetrain_state, omega_left),
    RIGHT = PLACE(drivetrain_state, omega_right),
    TWIST = PLACE(drivetrain_state, twist),
    TRACTION_LEFT = PLACE(drivetrain_state, traction_left),
    TRACTION_RIGHT = PLACE(drivetrain_state, traction_right),
    UNSLIPPED_LEFT = PLACE(drivetrain_state, unslipped_left),
    UNSLIPPED_RIGHT = PLACE(drivetrain_state, unslipped_right),
    TORQUE = PLACE(drivetrain_state, drive_torque),
    BRAKE = PLACE(drivetrain_state, brake_torque),
    DISTANCE = PLACE(drivetrain_state, distance),
    DRIVE = PLACE(drivetrain_state, drive_work),
    CREEP = PLACE(drivetrain_state, creep_work),
    RESISTANCE = PLACE(drivetrain_state, resistance_work),
    LOSS = PLACE(drivetrain_state, loss_work)
};
/* The states come first, then the integrals; a right wheel follows its left one. */
ASSERT_LAYOUT(integrals_follow_states, (int)DISTANCE == (int)MAX_STATES && LOSS + 1 == MAX_ROWS);
ASSERT_LAYOUT(right_follows_left, RIGHT == LEFT + 1 && TRACTION_RIGHT == TRACTION_LEFT + 1 &&
                                      UNSLIPPED_RIGHT == UNSLIPPED_LEFT + 1);

enum {
    COMMANDED = PLACE(drivetrain_input, commanded_torque),
    COMMANDED_BRAKE = PLACE(drivetrain_input, commanded_brake),
    OUTER_RESISTANCE = PLACE(drivetrain_input, resistance_force),
    ACCELERATION = PLACE(drivetrain_input, acceleration),
    LOAD_LEFT = PLACE(drivetrain_input, load_left),
    LOAD_RIGHT = PLACE(drivetrain_input, load_right),
    FRICTION_LEFT = PLACE(drivetrain_input, friction_left),
    FRICTION_RIGHT = PLACE(drivetrain_input, friction_right),
    SLOPE = PLACE(drivetrain_input, slope)
};
ASSERT_LAYOUT(factors_of_the_track,
              FRICTION_RIGHT == FRICTION_LEFT + 1 && SLOPE == FRICTION_LEFT + 2);

/* Contact force and memory of one wheel. */
typedef struct {
    double force, by_omega, by_speed, by_traction; /* half of those of the wheelset's contact */
    double saturation, creepage, falling;
    double steady, sticking;
    /* Rates of held traction and unslipped part, and their derivatives by omega, speed and both. */
    double rate[2], by[2][4];
} wheel_action;

/* Drivetrains with the same table, states and kind of friction. */
typedef struct {
    const creep_table *table;
    int elastic, remembering, lagging, braked, thermal, layered;
    lanes contact[2][FIELDS(force_element_parameters)]; /* under each wheel's load */
    lanes scales[2][FIELDS(contact_scales)];            /* likewise */
    lanes loaded[2];                                    /* 1 or 0 */
    lanes train[FIELDS(drivetrain_parameters)];
    lanes input[FIELDS(drivetrain_input)];
    lanes wheel[2][FIELDS(wheel_action)];
    lanes saturation[2]; /* creepages at the start of the substep */
    lanes nominal_load;
} group;

ALWAYS_INLINE force_element_input wheel_input(group *g, int side, rows y,
                                              const force_element_parameters *p, int l) {
    TAKE(drivetrain_input, in, g->input);
    double friction = side == 0 ? in.friction_left : in.friction_right;
    return (force_element_input){.omega = y[LEFT + side][l],
                                 .speed = y[SPEED][l],
                                 .normal_load = p->nominal_load,
                                 .friction_scale = friction,
                                 .held_traction = y[TRACTION_LEFT + side][l],
                                 .unslipped = y[UNSLIPPED_LEFT + side][l]};
}

/* Set force and memory; half a wheelset's force is that of a wheel. */
ALWAYS_INLINE void set_action(double half, const force_element_output *out, wheel_action *action) {
    const double rates[2][5] = {
        {out->traction_rate, out->traction_by_omega, out->traction_by_speed,
         out->traction_by_traction, out->traction_by_unslipped},
        {out->unslipped_rate, out->unslipped_by_omega, out->unslipped_by_speed,
         out->unslipped_by_traction, out->unslipped_by_unslipped},
    };
    for (int k = 0; k < 2; k++) {
        action->rate[k] = rates[k][0];
        for (int i = 0; i < 4; i++) action->by[k][i] = rates[k][1 + i];
    }
    action->force = half * out->creep_force;
    action->by_omega = half * out->force_by_omega;
    action->by_speed = half * out->force_by_speed;
    action->by_traction = half * out->force_by_traction;
    action->sticking = out->sticking;
}

/* Evaluate one wheel: half of what the wheelset's contact gives under twice the wheel's load. */
ALWAYS_INLINE void wheel_of(group *g, int side, rows y, int thermal, int remembering) {
    force_lanes f;
    EACH_LANE (l) {
        TAKE(force_element_parameters, p, g->contact[side]);
        force_element_input in = wheel_input(g, side, y, &p, l);
        TAKE(contact_scales, scales, g->scales[side]);
        scales.saturation_creepage /= g->input[SLOPE][l]; /* as slope_reduction does; k_hat stays */
        begin_lane(&f, l, g->table, &p, scales, &in, thermal);
    }
    evaluate_lanes(&f, g->table, g->contact[side], g->layered);
    EACH_LANE (l) {
        TAKE(force_element_parameters, p, g->contact[side]);
        TAKE(force_state, at, f.state);
        force_element_input in = wheel_input(g, side, y, &p, l);
        force_element_output out;
        creep_value q = {f.ratio[l], f.slope[l], f.log_k[l], f.log_layer[l]};
        double half = 0.5 * g->loaded[side][l];
        finish_force(g->table, &p, &in, &at, q, &out);
        int loaded = g->loaded[side][l] > 0.0;
        wheel_action action = {
            .saturation = loaded ? out.saturation_creepage : 1.0,
            .creepage = out.creepage,
            .falling = loaded ? out.falling_branch : 0.0,
            .steady = loaded ? out.steady_traction : 0.0,
        };
        if (remembering) memory_action(&p, &in, &at, &out);
        set_action(half, &out, &action);
        put(g->wheel[side], l, FIELDS(wheel_action), (const double *)&action);
    }
    for (int l = 0; remembering && l < LANES; l++) {
        TAKE(force_element_parameters, p, g->contact[side]);
        force_element_input in = wheel_input(g, side, y, &p, l);
        if (g->loaded[side][l] > 0.0 && has_friction(&in)) continue;
        TAKE(force_state, at, f.state);
        TAKE(wheel_action, action, g->wheel[side]);
        force_element_output out;
        memset(&out, 0, sizeof out);
        fade_memory(&p, &in, &at, &out);
        set_action(0.0, &out, &action);
        put(g->wheel[side], l, FIELDS(wheel_action), (const double *)&action);
    }
}

static void wheel(group *g, int side, rows y) {
    if (g->remembering && g->thermal) wheel_of(g, side, y, 1, 1);
    else if (g->remembering) wheel_of(g, side, y, 0, 1);
    else if (g->thermal) wheel_of(g, side, y, 1, 0);
    else wheel_of(g, side, y, 0, 0);
}

/* Whether two numbers differ in any bit; zeros of different sign do. */
static int differs(double a, double b) { return bits_of(a) != bits_of(b); }

/* Evaluate both wheels; copy the first to the second if they are equal in every lane. */
static void wheels(group *g, rows y) {
    lanes *in = g->input;
    int differ = 0;
    for (int l = 0; l < LANES; l++)
        differ |= differs(y[LEFT][l], y[RIGHT][l]) |
                  differs(y[TRACTION_LEFT][l], y[TRACTION_RIGHT][l]) |
                  differs(y[UNSLIPPED_LEFT][l], y[UNSLIPPED_RIGHT][l]) |
                  differs(in[LOAD_LEFT][l], in[LOAD_RIGHT][l]) |
                  differs(in[FRICTION_LEFT][l], in[FRICTION_RIGHT][l]);
    wheel(g, 0, y);
    if (differ) wheel(g, 1, y);
    else memcpy(g->wheel[1], g->wheel[0], sizeof g->wheel[0]);
}

/* Set the fields of the state that are not states of this kind of drivetrain. */
static void fill(group *g, rows y) {
    EACH_LANE (l) {
        if (!g->elastic) y[RIGHT][l] = y[LEFT][l];
        if (!g->elastic) y[TWIST][l] = 0.0;
        for (int i = 0; !g->remembering && i < 2; i++)
            y[TRACTION_LEFT + i][l] = y[UNSLIPPED_LEFT + i][l] = 0.0;
        if (!g->lagging) y[TORQUE][l] = g->input[COMMANDED][l];
        if (!g->braked) y[BRAKE][l] = 0.0;
    }
}

/* Rates of a wheelset with a rigid axle; that of the speed holds for an elastic axle too. */
ALWAYS_INLINE wheelset_rates rates_together(const drivetrain_parameters *p,
                                            const drivetrain_input *in, rows y,
                                            const wheel_action a[2], int l) {
    contact_action both = {.force = a[0].force + a[1].force,
                           .by_omega = a[0].by_omega + a[1].by_omega,
                           .by_speed = a[0].by_speed + a[1].by_speed};
    return motion_rates(&p->body, y[LEFT][l], y[SPEED][l], y[TORQUE][l], in->resistance_force,
                        both);
}

/* Set the rates of all rows, and the elements of the Jacobian that can differ from zero. */
ALWAYS_INLINE void set_rates(group *g, rows y, rows f, matrix *jacobian) {
    EACH_LANE (l) {
        TAKE(drivetrain_parameters, p, g->train);
        TAKE(drivetrain_input, in, g->input);
        wheel_action a[2];
        take(g->wheel[0], l, FIELDS(wheel_action), (double *)&a[0]);
        take(g->wheel[1], l, FIELDS(wheel_action), (double *)&a[1]);
        wheelset_rates rates = rates_together(&p, &in, y, a, l);
        double r = p.body.radius, b = 0.5 * p.body.damping, v = y[SPEED][l];
        int held = p.body.inverse_mass == 0.0;
        double pace = 1.0 / (g->lagging ? p.motor_lag : 1.0);
        f[SPEED][l] = held ? in.acceleration : rates.speed_rate;
        f[TORQUE][l] = (in.commanded_torque - y[TORQUE][l]) * pace;

        /* J/2 d(omega)/dt = share T - r Q - b/2 omega -+ (k twist + d d(twist)/dt); half is 2/J */
        double inverse = 1.0 / p.body.inertia, half = 2.0 * inverse,
               share[2] = {p.drive_share, 1.0 - p.drive_share};
        double omega[2] = {y[LEFT][l], y[RIGHT][l]}, difference = omega[0] - omega[1];
        double axle = p.axle_stiffness * y[TWIST][l] + p.axle_damping * difference;
        double rate[2];
        for (int i = 0; i < 2; i++)
            rate[i] = (share[i] * y[TORQUE][l] - r * a[i].force - b * omega[i] -
                       (i == 0 ? axle : -axle)) *
                      half;
        f[LEFT][l] = g->elastic ? rate[0] : rates.omega_rate;
        f[RIGHT][l] = rate[1];
        f[TWIST][l] = difference;

        /* Powers of drive, creep, resistance and damping. */
        double force = a[0].force + a[1].force, by_speed = a[0].by_speed + a[1].by_speed;
        double resisting = held ? force : rates.resistance + in.resistance_force;
        double rolling = share[0] * omega[0] + share[1] * omega[1];
        double slip[2] = {r * omega[0] - v, r * omega[1] - v};
        f[DISTANCE][l] = v;
        f[DRIVE][l] = y[TORQUE][l] * rolling;
        f[CREEP][l] = a[0].force * slip[0] + a[1].force * slip[1];
        f[RESISTANCE][l] = resisting * v;
        f[LOSS][l] = b * (omega[0] * omega[0] + omega[1] * omega[1]) +
                     p.axle_damping * difference * difference;
        if (!jacobian) continue;

        g->saturation[0][l] = a[0].saturation;
        g->saturation[1][l] = a[1].saturation;
        lanes(*j)[MAX_STATES] = *jacobian;
        /* With a rigid axle the left omega stands for both wheels. */
        double one = g->elastic ? 0.0 : 1.0, inverse_mass = p.body.inverse_mass;
        double by_omega[2] = {a[0].by_omega + one * a[1].by_omega, a[1].by_omega};
        j[SPEED][SPEED][l] = rates.jacobian[1][1];
        j[TORQUE][TORQUE][l] = -pace;
        j[TWIST][LEFT][l] = 1.0;
        j[TWIST][RIGHT][l] = -1.0;
        j[LEFT][RIGHT][l] = j[RIGHT][LEFT][l] = p.axle_damping * half;
        j[DISTANCE][SPEED][l] = 1.0;
        double steepness = held ? by_speed : rates.resistance_slope;
        j[RESISTANCE][SPEED][l] = resisting + v * steepness;
        j[CREEP][SPEED][l] = slip[0] * a[0].by_speed + slip[1] * a[1].by_speed - force;
        j[DRIVE][TORQUE][l] = rolling;
        for (int i = 0; i < 2; i++) {
            double sign = i == 0 ? 1.0 : -1.0;
            double own = -(r * a[i].by_omega + b + p.axle_damping) * half;
            double body = g->elastic ? half : inverse;
            j[SPEED][LEFT + i][l] = by_omega[i] * inverse_mass;
            j[LEFT + i][SPEED][l] = g->elastic ? -r * a[i].by_speed * half : rates.jacobian[0][1];
            j[LEFT + i][LEFT + i][l] = g->elastic ? own : rates.jacobian[0][0];
            j[LEFT + i][TWIST][l] = -sign * p.axle_stiffness * half;
            j[LEFT + i][TORQUE][l] = g->elastic ? share[i] * half : body;
            double creep = slip[i] * a[i].by_omega + r * a[i].force;
            double other = slip[1] * a[1].by_omega + r * a[1].force;
            j[CREEP][LEFT + i][l] = creep + (i == 0 ? one * other : 0.0);
            j[DRIVE][LEFT + i][l] = y[TORQUE][l] * (share[i] + (i == 0 ? one * share[1] : 0.0));
            double loss = 2.0 * b * omega[i] + 2.0 * sign * p.axle_damping * difference;
            j[LOSS][LEFT + i][l] = loss + (i == 0 ? one * (2.0 * b * omega[1]) : 0.0);
            j[RESISTANCE][LEFT + i][l] = held ? v * by_omega[i] : 0.0;
        }
    }
}

static int is_elastic(const drivetrain_member *m) { return m->drivetrain->axle_stiffness > 0.0; }

static int is_remembering(const drivetrain_member *m) { return remembers(m->contact); }

static int is_lagging(const drivetrain_member *m) { return m->drivetrain->motor_lag > 0.0; }

static int is_braked(const drivetrain_member *m) { return m->drivetrain->brake_fill_time > 0.0; }

static void set_kind(group *g, const drivetrain_member *member) {
    g->table = member->table;
    g->elastic = is_elastic(member);
    g->remembering = is_remembering(member);
    g->lagging = is_lagging(member);
    g->braked = is_braked(member);
    g->thermal = softens_with_heat(member->contact);
    g->layered = has_layer(member->contact);
}

/* Load a drivetrain into a lane. */
static void load(group *g, int l, const drivetrain_member *member, const drivetrain_input *input,
                 const drivetrain_state *state, rows y) {
    const force_element_parameters *contact = member->contact;
    double weight[2] = {2.0 * input->load_left, 2.0 * input->load_right};
    force_element_parameters there = *contact;
    contact_scales scales = member->scales;
    for (int side = 0; side < 2; side++) {
        int loaded = is_loaded(contact, weight[side]);
        double of = loaded ? weight[side] : contact->nominal_load;
        if (of != there.nominal_load) {
            there = force_element_at_load(contact, of);
            scales = contact_scales_of(&there);
        }
        put(g->contact[side], l, FIELDS(force_element_parameters), (const double *)&there);
        put(g->scales[side], l, FIELDS(contact_scales), (const double *)&scales);
        g->loaded[side][l] = loaded ? 1.0 : 0.0;
    }
    g->nominal_load[l] = contact->nominal_load;
    put(g->train, l, FIELDS(drivetrain_parameters), (const double *)member->drivetrain);
    put(g->input, l, FIELDS(drivetrain_input), (const double *)input);
    if (g->braked) g->input[COMMANDED][l] = larger(input->commanded_torque, 0.0);
    put(y, l, FIELDS(drivetrain_state), (const double *)state);
}

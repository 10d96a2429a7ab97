/* The drivetrain's equations for LANES drivetrains at once. */
#include <math.h>
#include <stddef.h>

#include "contact_lanes.h"
#include "drivetrain.h"
#include "rosenbrock.h"
#include "wheelset_law.h"

enum {
    SPEED = PLACE(drivetrain_state, speed),
    LEFT = PLACE(drivetrain_state, omega_left),
    RIGHT = PLACE(drivetrain_state, omega_right),
    TWIST = PLACE(drivetrain_state, twist),
    HELD_LEFT = PLACE(drivetrain_state, held_left),
    HELD_RIGHT = PLACE(drivetrain_state, held_right),
    UNSLIPPED_LEFT = PLACE(drivetrain_state, unslipped_left),
    UNSLIPPED_RIGHT = PLACE(drivetrain_state, unslipped_right),
    OUTER_LEFT = PLACE(drivetrain_state, outer_left),
    OUTER_RIGHT = PLACE(drivetrain_state, outer_right),
    TORQUE = PLACE(drivetrain_state, drive_torque),
    BRAKE = PLACE(drivetrain_state, brake_torque),
    PADS_LEFT = PLACE(drivetrain_state, pads_left),
    PADS_RIGHT = PLACE(drivetrain_state, pads_right),
    DISTANCE = PLACE(drivetrain_state, distance),
    DRIVE = PLACE(drivetrain_state, drive_work),
    CREEP = PLACE(drivetrain_state, creep_work),
    RESISTANCE = PLACE(drivetrain_state, resistance_work),
    LOSS = PLACE(drivetrain_state, loss_work)
};
/* The states come first, then the integrals; a right wheel follows its left one. */
ASSERT_LAYOUT(integrals_follow_states, (int)DISTANCE == (int)MAX_STATES && LOSS + 1 == MAX_ROWS);
ASSERT_LAYOUT(right_follows_left, RIGHT == LEFT + 1 && HELD_RIGHT == HELD_LEFT + 1 &&
                                      UNSLIPPED_RIGHT == UNSLIPPED_LEFT + 1 &&
                                      OUTER_RIGHT == OUTER_LEFT + 1 && PADS_RIGHT == PADS_LEFT + 1);

enum {
    COMMANDED = PLACE(drivetrain_input, commanded_torque),
    COMMANDED_BRAKE = PLACE(drivetrain_input, commanded_brake),
    OUTER_RESISTANCE = PLACE(drivetrain_input, resistance_force),
    ACCELERATION = PLACE(drivetrain_input, acceleration),
    LOAD_LEFT = PLACE(drivetrain_input, load_left),
    LOAD_RIGHT = PLACE(drivetrain_input, load_right),
    FRICTION_LEFT = PLACE(drivetrain_input, friction_left),
    FRICTION_RIGHT = PLACE(drivetrain_input, friction_right),
    SLOPE = PLACE(drivetrain_input, slope),
    GRADE = PLACE(drivetrain_input, grade)
};
ASSERT_LAYOUT(factors_of_the_track, FRICTION_RIGHT == FRICTION_LEFT + 1 &&
                                        SLOPE == FRICTION_LEFT + 2 && GRADE == FRICTION_LEFT + 3);

/* Drivetrains with the same table, states and kind of friction. A wheel's contact has the
 * parameters of both under twice its load, and half of their force. */
typedef struct {
    contacts wheel[2];
    const contacts *right; /* the left one's contact, as long as both are equal in every lane */
    int elastic, remembering, lagging, braked;
    int alike;                  /* the memory of the right wheel is that of the left one */
    lanes saturation_at_one[2]; /* of each contact where the track's factor on the slope is 1 */
    lanes train[FIELDS(drivetrain_parameters)];
    lanes input[FIELDS(drivetrain_input)];
    lanes saturation[2]; /* creepages at the start of the substep */
    lanes nominal_load;
    int axles;   /* of one vehicle, in neighbouring lanes */
    lanes share; /* of the vehicle's mass */
} group;

/* Set what depends on friction and slope, which the track changes. */
static inline void set_rails(group *g, int l) {
    for (int side = 0; side < 2; side++) {
        contacts *c = &g->wheel[side];
        c->INPUT(friction_scale)[l] = g->input[FRICTION_LEFT + side][l];
        TAKE(force_element_input, in, c->in);
        c->alone[l] = !can_grip(c->given[l], &in);
        c->scales[PLACE(contact_scales, saturation_creepage)][l] = /* as slope_reduction does; */
            g->saturation_at_one[side][l] / g->input[SLOPE][l];    /* k_hat stays */
    }
}

/* Whether two numbers differ in any bit; zeros of different sign do. */
static int differs(double a, double b) { return bits_of(a) != bits_of(b); }

/* Evaluate both wheels, or one if they are equal in every lane. */
static void wheels(group *g, rows y, void (*evaluate_contacts)(contacts *)) {
    lanes *input = g->input;
    int differ = 0;
    for (int l = 0; l < LANES; l++)
        differ |= differs(y[LEFT][l], y[RIGHT][l]) | differs(y[HELD_LEFT][l], y[HELD_RIGHT][l]) |
                  differs(y[UNSLIPPED_LEFT][l], y[UNSLIPPED_RIGHT][l]) |
                  differs(y[OUTER_LEFT][l], y[OUTER_RIGHT][l]) |
                  differs(input[LOAD_LEFT][l], input[LOAD_RIGHT][l]) |
                  differs(input[FRICTION_LEFT][l], input[FRICTION_RIGHT][l]);
    for (int side = 0; side < 1 + differ; side++) {
        lanes *in = g->wheel[side].in;
        memcpy(INPUT(omega), y[LEFT + side], sizeof(lanes));
        memcpy(INPUT(speed), y[SPEED], sizeof(lanes));
        memcpy(INPUT(held_force), y[HELD_LEFT + side], sizeof(lanes));
        memcpy(INPUT(outer_force), y[OUTER_LEFT + side], sizeof(lanes));
        memcpy(INPUT(unslipped), y[UNSLIPPED_LEFT + side], sizeof(lanes));
        evaluate_contacts(&g->wheel[side]);
    }
    g->right = &g->wheel[differ];
}

/* Force of one wheel, and its derivatives. */
typedef struct {
    double force, by_omega, by_speed;
} wheel_action;

ALWAYS_INLINE wheel_action action_of(const contacts *c, int l) {
    wheel_action action = {0.5 * c->OUTPUT_OF(creep_force)[l],
                           0.5 * c->OUTPUT_OF(force_by_omega)[l],
                           0.5 * c->OUTPUT_OF(force_by_speed)[l]};
    return action;
}

/* Its saturation creepage; without contact the accuracy of the slip does not matter. */
ALWAYS_INLINE double saturation_of(const contacts *c, int l) {
    double saturation = c->OUTPUT_OF(saturation_creepage)[l];
    return saturation > 0.0 ? saturation : 1.0;
}

/* Set the fields of the state that are not states of this kind of drivetrain. */
static void fill(group *g, rows y) {
    EACH_LANE (l) {
        if (!g->elastic) y[RIGHT][l] = y[LEFT][l];
        if (!g->elastic) y[TWIST][l] = 0.0;
        if (g->alike)
            for (int i = 0; i < 2 * LATERAL; i += 2) y[HELD_RIGHT + i][l] = y[HELD_LEFT + i][l];
        for (int i = 0; !g->remembering && i < 2; i++)
            y[HELD_LEFT + i][l] = y[UNSLIPPED_LEFT + i][l] = y[OUTER_LEFT + i][l] = 0.0;
        if (!g->lagging) y[TORQUE][l] = g->input[COMMANDED][l];
        if (!g->braked) y[BRAKE][l] = y[PADS_LEFT][l] = 0.0;
        if (!(g->braked && g->elastic)) y[PADS_RIGHT][l] = y[PADS_LEFT][l];
    }
}

/* Rates of a wheelset with a rigid axle; that of the speed holds for an elastic axle too. */
ALWAYS_INLINE wheelset_rates rates_together(const drivetrain_parameters *p,
                                            const drivetrain_input *in, rows y,
                                            const wheel_action a[2], int l) {
    contact_action both = {.force = a[0].force + a[1].force,
                           .by_omega = a[0].by_omega + a[1].by_omega,
                           .by_speed = a[0].by_speed + a[1].by_speed};
    wheelset_parameters body = on_grade(&p->body, in->grade);
    return motion_rates(&body, y[LEFT][l], y[SPEED][l], y[TORQUE][l], in->resistance_force, both);
}

/* Set the rates of all rows, and the elements of the Jacobian that can differ from zero. */
ALWAYS_INLINE void set_rates(group *g, rows y, rows f, matrix *jacobian) {
    EACH_LANE (l) {
        TAKE(drivetrain_parameters, p, g->train);
        TAKE(drivetrain_input, in, g->input);
        wheel_action a[2] = {action_of(&g->wheel[0], l), action_of(g->right, l)};
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

        g->saturation[0][l] = saturation_of(&g->wheel[0], l);
        g->saturation[1][l] = saturation_of(g->right, l);
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

/* Rates of the memory of both contacts, and their part of the Jacobian. */
static void set_memory_rates(group *g, rows y, rows f, matrix *jacobian) {
    for (int l = 0; l < LANES; l++) {
        TAKE(drivetrain_parameters, p, g->train);
        double r = p.body.radius, v = y[SPEED][l];
        double body = g->elastic ? 2.0 / p.body.inertia : 1.0 / p.body.inertia;
        const double wheels = g->alike ? 2.0 : 1.0;
        for (int i = 0; i < (g->alike ? 1 : 2); i++) {
            const contacts *c = i == 0 ? &g->wheel[0] : g->right;
            const lanes *by = &c->OUTPUT_OF(memory_by);
            const int state[LATERAL] = {HELD_LEFT + i, UNSLIPPED_LEFT + i, OUTER_LEFT + i};
            int own = g->elastic ? LEFT + i : LEFT, held = p.body.inverse_mass == 0.0;
            for (int k = 0; k < LATERAL; k++) f[state[k]][l] = (&c->OUTPUT_OF(held_rate))[k][l];
            if (!jacobian) continue;
            lanes(*j)[MAX_STATES] = *jacobian;
            for (int k = 0; k < LATERAL; k++, by += 2 + MEMORY_STATES) {
                j[state[k]][own][l] = by[0][l];
                j[state[k]][SPEED][l] = by[1][l];
                for (int n = 0; n < LATERAL; n++) j[state[k]][state[n]][l] = by[2 + n][l];
                double force_by = 0.5 * wheels * (&c->OUTPUT_OF(force_by_memory))[k][l];
                j[SPEED][state[k]][l] = force_by * p.body.inverse_mass;
                j[own][state[k]][l] = -r * force_by * body;
                j[CREEP][state[k]][l] = (r * y[LEFT + i][l] - v) * force_by;
                j[RESISTANCE][state[k]][l] = held ? v * force_by : 0.0;
            }
        }
    }
}

static int is_elastic(const drivetrain_member *m) { return m->drivetrain->axle_stiffness > 0.0; }

static int is_remembering(const drivetrain_member *m) { return remembers(m->contact); }

static int is_lagging(const drivetrain_member *m) { return m->drivetrain->motor_lag > 0.0; }

static int is_braked(const drivetrain_member *m) { return m->drivetrain->brake_fill_time > 0.0; }

static void set_kind(group *g, const drivetrain_member *member, int alike) {
    contacts_begin(&g->wheel[0], member->table, member->contact);
    contacts_begin(&g->wheel[1], member->table, member->contact);
    g->elastic = is_elastic(member);
    g->remembering = is_remembering(member);
    g->alike = alike;
    g->axles = 1;
    g->lagging = is_lagging(member);
    g->braked = is_braked(member);
}

/* Load a drivetrain into a lane. */
static void load(group *g, int l, const drivetrain_member *member, const drivetrain_input *input,
                 const drivetrain_state *state, rows y) {
    const force_element_parameters *contact = member->contact;
    double weight[2] = {2.0 * input->load_left, 2.0 * input->load_right};
    force_element_parameters there = *contact;
    contact_scales scales = member->scales;
    for (int side = 0; side < 2; side++) {
        force_element_input in;
        memset(&in, 0, sizeof in);
        in.normal_load = weight[side];
        double of = is_loaded(contact, weight[side]) ? weight[side] : contact->nominal_load;
        if (of != there.nominal_load) {
            there = force_element_at_load(contact, of);
            scales = contact_scales_of(member->table, &there);
        }
        contacts_put(&g->wheel[side], l, contact, &there, &scales);
        put(g->wheel[side].in, l, FIELDS(force_element_input), (const double *)&in);
        g->saturation_at_one[side][l] = scales.saturation_creepage;
    }
    g->nominal_load[l] = contact->nominal_load;
    put(g->train, l, FIELDS(drivetrain_parameters), (const double *)member->drivetrain);
    put(g->input, l, FIELDS(drivetrain_input), (const double *)input);
    if (g->braked) g->input[COMMANDED][l] = larger(input->commanded_torque, 0.0);
    put(y, l, FIELDS(drivetrain_state), (const double *)state);
    set_rails(g, l);
}

/* Stepping and evaluating many drivetrains, LANES at a time. */
#include "drivetrain_lanes.h"
#include "simd_dispatch.h"
#include "track_formula.h"

/* Add the brake's torque, which acts against the rotation of each wheel, its first-order lag, and
 * its pads. */
static void set_brake_rates(group *g, rows y, rows f, matrix *jacobian) {
    for (int l = 0; l < LANES; l++) {
        TAKE(drivetrain_parameters, p, g->train);
        double torque = y[BRAKE][l], missing = g->input[COMMANDED_BRAKE][l] - torque;
        double pace = 1.0 / (missing > 0.0 ? p.brake_fill_time : p.brake_vent_time);
        double share = g->elastic ? 0.5 : 1.0, power = 0.0; /* of a wheel, whatever the gear's */
        double body = 1.0 / (share * p.body.inertia);
        lanes(*j)[MAX_STATES] = NULL;
        if (jacobian) j = *jacobian;
        f[BRAKE][l] = missing * pace;
        for (int i = 0; i < (g->elastic ? 2 : 1); i++) {
            double omega = y[LEFT + i][l];
            braking b = braking_of(p.body.radius, omega, y[PADS_LEFT + i][l]);
            f[PADS_LEFT + i][l] = b.pads_rate;
            f[LEFT + i][l] -= share * torque * b.part * body;
            power += share * b.part * omega;
            if (!j) continue;
            j[PADS_LEFT + i][PADS_LEFT + i][l] = b.rate_by_pads;
            j[PADS_LEFT + i][LEFT + i][l] = b.rate_by_omega;
            j[LEFT + i][PADS_LEFT + i][l] = -share * torque * b.by_pads * body;
            j[LEFT + i][BRAKE][l] = -share * b.part * body;
            j[LEFT + i][LEFT + i][l] -= share * torque * b.by_omega * body;
            j[DRIVE][LEFT + i][l] -= share * torque * (b.part + b.by_omega * omega);
            j[DRIVE][PADS_LEFT + i][l] = -share * torque * b.by_pads * omega;
        }
        f[DRIVE][l] -= torque * power;
        if (!j) continue;
        j[BRAKE][BRAKE][l] = -pace;
        j[DRIVE][BRAKE][l] = -power;
    }
}

/* Let the axles of a vehicle share its speed: sum m_i dV/dt = sum of the axles' forces. */
static void share_speed(group *g, rows f, matrix *jacobian) {
    for (int first = 0; first + g->axles <= LANES; first += g->axles) {
        double rate = 0.0;
        for (int i = 0; i < g->axles; i++) rate += g->share[first + i] * f[SPEED][first + i];
        for (int i = 0; i < g->axles; i++) f[SPEED][first + i] = rate;
    }
    for (int c = 0; jacobian && c < MAX_STATES; c++)
        EACH_LANE (l) (*jacobian)[SPEED][c][l] *= g->share[l];
}

static void evaluate(void *model, rows y, rows f, matrix *jacobian) {
    group *g = model;
    fill(g, y);
    wheels(g, y, jacobian ? contacts_evaluate_motion : contacts_evaluate_force);
    if (jacobian) set_rates(g, y, f, jacobian);
    else set_rates(g, y, f, NULL);
    if (g->remembering) set_memory_rates(g, y, f, jacobian);
    if (g->braked) set_brake_rates(g, y, f, jacobian);
    if (g->axles > 1) share_speed(g, f, jacobian);
}

/* Errors of slips are relative to slip plus saturation slip, of the speed to speed plus minimum
 * speed, of torques to torque plus that of kinetic friction, of held forces to force plus kinetic
 * friction. */
static void drivetrain_error(void *model, rows y, rows error, lanes size) {
    group *g = model;
    EACH_LANE (l) {
        TAKE(drivetrain_parameters, p, g->train);
        TAKE(force_element_parameters, contact, g->wheel[0].there);
        double r = p.body.radius, speed = fabs(y[SPEED][l]) + p.body.minimum_speed;
        double torque = r * contact.kinetic_friction * g->nominal_load[l];
        double found = fabs(error[SPEED][l]) / speed;
        /* A wheel that hardly bears need not be more accurate than the other one. */
        double least = 2e-3 * larger(g->input[LOAD_LEFT][l], g->input[LOAD_RIGHT][l]);
        for (int i = 0; i < 2; i++) {
            int place = g->elastic ? LEFT + i : LEFT, of = g->alike ? 0 : i;
            double slip = fabs(r * y[place][l] - y[SPEED][l]), saturation = g->saturation[i][l];
            found += fabs(r * error[place][l] - error[SPEED][l]) / (slip + saturation * speed);
            if (g->remembering)
                found += (fabs(error[HELD_LEFT + of][l]) + fabs(error[OUTER_LEFT + of][l])) /
                             force_scale(&contact, larger(2.0 * g->input[LOAD_LEFT + of][l], least),
                                         fabs(y[HELD_LEFT + of][l])) +
                         fabs(error[UNSLIPPED_LEFT + of][l]);
        }
        double twist = fabs(y[TWIST][l]) + torque / (g->elastic ? p.axle_stiffness : 1.0);
        if (g->elastic) found += fabs(error[TWIST][l]) / twist;
        if (g->lagging) found += fabs(error[TORQUE][l]) / (fabs(y[TORQUE][l]) + torque);
        if (g->braked)
            found += (fabs(error[BRAKE][l]) + fabs(y[BRAKE][l] * error[PADS_LEFT][l])) /
                     (fabs(y[BRAKE][l]) + torque);
        size[l] = found;
    }
}

static int are_of_one_kind(const drivetrain_member *a, const drivetrain_member *b) {
    return a->table == b->table && is_elastic(a) == is_elastic(b) &&
           is_remembering(a) == is_remembering(b) && is_lagging(a) == is_lagging(b) &&
           is_braked(a) == is_braked(b) &&
           softens_with_heat(a->contact) == softens_with_heat(b->contact) &&
           has_layer(a->contact) == has_layer(b->contact);
}

/* Whether both wheels of a rigid axle remember the same and will meet the same rails. */
static int is_alike(const drivetrain_member *m, const drivetrain_input *in,
                    const drivetrain_state *state) {
    const track *rails = m->rails;
    int same = rails ? rails->left.at == rails->right.at && rails->left.value == rails->right.value
                     : in->friction_left == in->friction_right;
    return is_remembering(m) && !is_elastic(m) && same && in->load_left == in->load_right &&
           in->cleaned_left == in->cleaned_right && state->held_left == state->held_right &&
           state->unslipped_left == state->unslipped_right &&
           state->outer_left == state->outer_right;
}

/* How many of the next n members are of the first one's kind. */
static size_t count_of_one_kind(const drivetrain_member *members, size_t n) {
    size_t count = 1;
    while (count < n && are_of_one_kind(members, &members[count])) count++;
    return count;
}

static equations equations_of(group *g) {
    equations problem = {
        .parts = g->axles, .model = g, .rates = evaluate, .error_size = drivetrain_error};
    int *place = problem.place, n = 0;
    if (g->axles == 1) place[n++] = SPEED;
    place[n++] = LEFT;
    if (g->elastic) place[n++] = RIGHT;
    if (g->elastic) place[n++] = TWIST;
    for (int i = 0; g->remembering && i < 2 * LATERAL; i += g->alike ? 2 : 1)
        place[n++] = HELD_LEFT + i;
    if (g->lagging) place[n++] = TORQUE;
    if (g->braked) place[n++] = BRAKE;
    for (int i = 0; g->braked && i < (g->elastic ? 2 : 1); i++) place[n++] = PADS_LEFT + i;
    if (g->axles > 1) place[n++] = SPEED; /* the state that the axles share */
    problem.states = n;
    for (int i = DISTANCE; i <= LOSS; i++) place[n++] = i;
    problem.rows = n;
    return problem;
}

/* A step of many drivetrains of one kind, or of vehicles of as many axles: lanes that have finished
 * one take the next. */
typedef struct {
    const drivetrain_member *members;
    const drivetrain_input *input;
    drivetrain_state *state;
    double *tried;
    unsigned char *failed;
    size_t n, next; /* number of drivetrains, and the first that no lane has taken yet */
    size_t axles;   /* drivetrains of one vehicle */
    double start, step, tolerance;
    size_t at[LANES]; /* drivetrain in each lane */
    lanes time;       /* end of the present stretch */
    lanes rest;       /* part of the step after that stretch; below zero if the lane is idle */
} journey;

/* Factors and grade of the track where a drivetrain is, under the cleaning that its input holds. */
static void factors_of(const drivetrain_member *member, const drivetrain_input *in, double distance,
                       double time, double factor[4]) {
    track_factors(member->rails, distance, time, factor);
    factor[0] += in->cleaned_left * larger(in->recovered - factor[0], 0.0);
    factor[1] += in->cleaned_right * larger(in->recovered - factor[1], 0.0);
}

/* Begin the stretch of a vehicle up to the next corner of the track's profiles under any axle, with
 * the factors in its middle; `first` is the lane of its first axle. */
static void begin_stretch(journey *j, group *g, integration *run, int first) {
    double left = j->rest[first], part = left;
    int end = first + (int)j->axles;
    for (int l = first; l < end; l++) {
        const track *rails = j->members[j->at[l]].rails;
        if (!rails) continue;
        double until = track_until_change(rails, run->y[DISTANCE][l], run->y[SPEED][l], j->time[l]);
        if (until < left * (1.0 - 1e-9) && until < part) part = until;
    }
    for (int l = first; l < end; l++) {
        size_t i = j->at[l];
        if (j->members[i].rails) {
            double middle = run->y[DISTANCE][l] + 0.5 * part * run->y[SPEED][l], factor[4];
            factors_of(&j->members[i], &j->input[i], middle, j->time[l] + 0.5 * part, factor);
            for (int k = 0; k < 4; k++) g->input[FRICTION_LEFT + k][l] = factor[k];
            set_rails(g, l);
        }
        run->left[l] = part;
        j->time[l] += part;
        j->rest[l] = part < left ? left - part : 0.0;
    }
}

/* Let the lanes of a vehicle take the next one that has not failed; without one they stay idle. */
static void take_next(journey *j, group *g, integration *run, int first) {
    while (j->next < j->n && j->failed[j->next]) j->next += j->axles;
    if (j->next == j->n) return;
    double mass = 0.0, tried = 0.0;
    for (size_t i = j->next; i < j->next + j->axles; i++) {
        double h = j->tried[i];
        if (h > 0.0 && (tried == 0.0 || h < tried)) tried = h;
        if (j->axles > 1) mass += 1.0 / j->members[i].drivetrain->body.inverse_mass;
    }
    for (int l = first; l < first + (int)j->axles; l++) {
        size_t i = j->at[l] = j->next++;
        load(g, l, &j->members[i], &j->input[i], &j->state[i], run->y);
        if (j->axles > 1) g->share[l] = 1.0 / (mass * j->members[i].drivetrain->body.inverse_mass);
        run->h[l] = tried > 0.0 ? tried : j->step;
        run->count[l] = 0.0;
        j->time[l] = j->start;
        j->rest[l] = j->step;
    }
    begin_stretch(j, g, run, first);
}

/* Store a lane's state, with the fields that are not states of this kind of drivetrain. */
static void arrive(journey *j, group *g, integration *run, int l) {
    size_t i = j->at[l];
    drivetrain_state *state = &j->state[i];
    take(run->y, l, FIELDS(drivetrain_state), (double *)state);
    if (!g->elastic) state->omega_right = state->omega_left;
    if (!(g->braked && g->elastic)) state->pads_right = state->pads_left;
    if (g->alike) {
        state->held_right = state->held_left;
        state->unslipped_right = state->unslipped_left;
        state->outer_right = state->outer_left;
    }
    if (!g->lagging) state->drive_torque = g->input[COMMANDED][l];
    j->tried[i] = run->h[l];
}

/* Let a vehicle give up: its states stay as they were. */
static void give_up(journey *j, integration *run, int first) {
    for (int l = first; l < first + (int)j->axles; l++) {
        j->failed[j->at[l]] = 1;
        run->left[l] = 0.0;
    }
}

static void advance(journey *j, int alike) {
    group g;
    integration run;
    memset(run.j, 0, sizeof run.j);
    set_kind(&g, j->members, alike);
    int axles = g.axles = (int)j->axles;
    equations problem = equations_of(&g);
    int busy = 0;
    drivetrain_input resting = *j->input; /* at the nominal load, whose scales are known */
    resting.load_left = resting.load_right = 0.5 * j->members->contact->nominal_load;
    for (int l = 0; l < LANES; l++) { /* idle lanes hold the numbers of the first drivetrain */
        load(&g, l, j->members, &resting, j->state, run.y);
        run.left[l] = run.count[l] = g.share[l] = 0.0;
        run.h[l] = 1.0;
        j->rest[l] = -1.0;
    }
    for (int l = 0; l + axles <= LANES; l += axles) {
        take_next(j, &g, &run, l);
        busy |= run.left[l] > 0.0;
    }
    while (busy) {
        rosenbrock_substep(&problem, &run, j->tolerance);
        busy = 0;
        for (int l = 0; l + axles <= LANES; l += axles) {
            int there = run.left[l] == 0.0, waiting = there && j->rest[l] < 0.0;
            int hopeless = !there && is_hopeless(&run, l, j->step);
            if (there && !waiting && j->rest[l] > 0.0) {
                begin_stretch(j, &g, &run, l);
            } else if (hopeless || (there && !waiting)) {
                if (hopeless) give_up(j, &run, l);
                for (int k = l; k < l + axles; k++) {
                    if (!hopeless) arrive(j, &g, &run, k);
                    j->rest[k] = -1.0;
                }
                take_next(j, &g, &run, l);
            }
            busy |= run.left[l] > 0.0;
        }
    }
}

/* Whether the wheels of each axle of a vehicle remember the same. */
static int are_alike(const drivetrain_member *members, const drivetrain_input *input,
                     const drivetrain_state *state, size_t axles) {
    int alike = 1;
    for (size_t i = 0; i < axles; i++) alike &= is_alike(&members[i], &input[i], &state[i]);
    return alike;
}

void WIDE(drivetrain_advance_many)(const drivetrain_member *members, size_t n, size_t axles,
                                   drivetrain_input *input, drivetrain_state *state, double time,
                                   double step, double tolerance, double *substep,
                                   unsigned char *failed) {
    for (size_t i = 0; i < n; i++) {
        if (!members[i].rails) continue;
        double factor[4];
        factors_of(&members[i], &input[i], state[i].distance, time, factor);
        input[i].friction_left = factor[0];
        input[i].friction_right = factor[1];
        input[i].slope = factor[2];
        input[i].grade = factor[3];
    }
    if (!(step > 0.0)) return;
    for (size_t i = 0, count; i < n; i += count) {
        count = count_of_one_kind(&members[i], n - i);
        count -= count % axles;
        if (count == 0) { /* a vehicle of several kinds, which has no common equations */
            for (; count < axles; count++) failed[i + count] = 1;
            continue;
        }
        int alike = are_alike(&members[i], &input[i], &state[i], axles);
        for (size_t k = axles; k < count; k += axles)
            if (are_alike(&members[i + k], &input[i + k], &state[i + k], axles) != alike) count = k;
        journey j = {.members = &members[i],
                     .input = &input[i],
                     .state = &state[i],
                     .tried = &substep[i],
                     .failed = &failed[i],
                     .n = count,
                     .axles = axles,
                     .start = time,
                     .step = step,
                     .tolerance = tolerance};
        advance(&j, alike);
    }
}

static void set_outputs(group *g, rows y, int count, drivetrain_output *output) {
    for (int l = 0; l < count; l++) {
        TAKE(drivetrain_parameters, p, g->train);
        TAKE(drivetrain_input, in, g->input);
        const contacts *left = &g->wheel[0], *right = g->right;
        wheel_action a[2] = {action_of(left, l), action_of(right, l)};
        wheelset_rates rates = rates_together(&p, &in, y, a, l);
        double v = y[SPEED][l], omega[2] = {y[LEFT][l], y[RIGHT][l]}, twist = y[TWIST][l];
        double turning = omega[0] * omega[0] + omega[1] * omega[1];
        double braked = 0.0;
        for (int i = 0; g->braked && i < 2; i++)
            braked +=
                0.5 * y[BRAKE][l] * braking_of(p.body.radius, omega[i], y[PADS_LEFT + i][l]).part;
        int held = p.body.inverse_mass == 0.0;
        double moving = held ? 0.0 : 0.5 * v * v / p.body.inverse_mass;
        output[l] = (drivetrain_output){
            .creep_force_left = a[0].force,
            .creep_force_right = a[1].force,
            .creepage_left = left->OUTPUT_OF(creepage)[l],
            .creepage_right = right->OUTPUT_OF(creepage)[l],
            .falling_left = left->OUTPUT_OF(falling_branch)[l],
            .falling_right = right->OUTPUT_OF(falling_branch)[l],
            .steady_left = left->OUTPUT_OF(steady_force)[l],
            .steady_right = right->OUTPUT_OF(steady_force)[l],
            .sticking_left = left->OUTPUT_OF(sticking)[l],
            .sticking_right = right->OUTPUT_OF(sticking)[l],
            .steady_outer_left = left->OUTPUT_OF(steady_outer)[l],
            .steady_outer_right = right->OUTPUT_OF(steady_outer)[l],
            .drive_torque = g->braked ? y[TORQUE][l] - braked : y[TORQUE][l],
            .axle_torque = p.axle_stiffness * twist + p.axle_damping * (omega[0] - omega[1]),
            .speed_rate = held ? in.acceleration : rates.speed_rate,
            .stored_energy =
                0.25 * p.body.inertia * turning + moving + 0.5 * p.axle_stiffness * twist * twist,
        };
    }
}

void WIDE(drivetrain_evaluate_many)(const drivetrain_member *members, size_t n, size_t rows_of_n,
                                    const drivetrain_input *input, const drivetrain_state *state,
                                    drivetrain_output *output) {
    group g;
    rows y;
    for (size_t i = 0, count; i < n; i += count) {
        count = count_of_one_kind(&members[i], n - i < LANES ? n - i : LANES);
        set_kind(&g, &members[i], 0);
        for (size_t row = 0; row < rows_of_n; row++) {
            size_t at = row * n + i;
            for (size_t l = 0; l < LANES; l++) {
                size_t k = l < count ? l : 0;
                load(&g, (int)l, &members[i + k], &input[at + k], &state[at + k], y);
            }
            fill(&g, y);
            wheels(&g, y, contacts_evaluate_all);
            set_outputs(&g, y, (int)count, &output[at]);
        }
    }
}

#include "wheelset_run.h"

#include <stdlib.h>

#define LANES 1
#include "drivetrain_lanes.h"
#include "radau.h"

void control_law_command(const control_law *law, double reference, double creepage, double memory,
                         control_command *command) {
    *command = (control_command){.torque = reference};
    if (!law->of_creepage) return;
    double error = reference - creepage, gain = law->proportional_gain;
    double unlimited = gain * error + memory, tracking = law->integral_gain / gain;
    command->torque = fmin(fmax(unlimited, law->torque_min), law->torque_max);
    command->memory_rate = law->integral_gain * error + tracking * (command->torque - unlimited);
    if (command->torque == unlimited) {
        command->torque_by_creepage = -gain;
        command->torque_by_memory = 1.0;
        command->rate_by_creepage = -law->integral_gain;
    } else { /* Ki e - (Ki/Kp)(Kp e + I) = -(Ki/Kp) I depends on the memory alone */
        command->rate_by_memory = -tracking;
    }
}

/* Places of the integrator's rows in those of a drivetrain; the memory has none. */
enum { ROW_SPEED, ROW_OMEGA, ROW_MEMORY, ROW_INTEGRALS };
ASSERT_LAYOUT(rows_of_the_run, ROW_MEMORY + 1 == RADAU_STATES &&
                                   (int)ROW_INTEGRALS + MOST_ROWS - DISTANCE == (int)RADAU_ROWS);
ASSERT_LAYOUT(row_has_the_states_between, sizeof(run_row) == (RADAU_ROWS + 2) * sizeof(double) &&
                                              offsetof(run_row, speed) == sizeof(double));

struct wheelset_run {
    drivetrain_member member;
    run_stretch given;
    group wheels;
    double load; /* under which the wheels are prepared [N] */
    radau_problem problem;
    radau steps;
    double level[RUN_CROSSINGS]; /* what each crossing's signals are above its level */
    double end;                  /* of the last step, or the event that ends the run [s] */
    double grid;                 /* number of the next row of the grid */
    int unwritten;               /* whether the last step has rows that are not written yet */
    int status;
    size_t count;
    run_event events[RUN_CROSSINGS];
};

static double between(double a, double b, double part) { return a + part * (b - a); }

/* Prepare the wheels for the load [N] at this time, and return the reference. */
static double set_input(wheelset_run *run, double time) {
    const run_stretch *s = &run->given;
    double part = s->end == s->start ? 0.0 : (time - s->start) / (s->end - s->start);
    double weight = between(s->from.normal_load, s->to.normal_load, part);
    drivetrain_input in = {
        .resistance_force = between(s->from.resistance_force, s->to.resistance_force, part),
        .load_left = 0.5 * weight,
        .load_right = 0.5 * weight,
        .friction_left = between(s->from.friction_scale, s->to.friction_scale, part),
        .slope = 1.0};
    in.friction_right = in.friction_left;
    if (weight != run->load) {
        drivetrain_state none = {0};
        rows unused;
        load(&run->wheels, 0, &run->member, &in, &none, unused);
        run->load = weight;
    }
    put(run->wheels.input, 0, FIELDS(drivetrain_input), (const double *)&in);
    return between(s->from.reference, s->to.reference, part);
}

/* Evaluate wheels and controller; sets the drivetrain's rows, with the torque among them. */
static control_command evaluate_loop(wheelset_run *run, double time, const double *y, rows all) {
    double reference = set_input(run, time);
    memset(all, 0, sizeof(rows));
    all[SPEED][0] = y[ROW_SPEED];
    all[LEFT][0] = y[ROW_OMEGA];
    fill(&run->wheels, all);
    wheels(&run->wheels, all);
    control_command command;
    control_law_command(&run->given.law, reference,
                        ((wheel_action *)run->wheels.wheel[0])->creepage, y[ROW_MEMORY], &command);
    all[TORQUE][0] = command.torque;
    return command;
}

static void rates_of_loop(void *model, double time, const double *y, double *f,
                          double (*jacobian)[RADAU_STATES]) {
    wheelset_run *run = (wheelset_run *)model;
    rows all, found;
    matrix j;
    if (jacobian) memset(j, 0, sizeof j);
    control_command command = evaluate_loop(run, time, y, all);
    set_rates(&run->wheels, all, found, jacobian ? &j : NULL);
    f[ROW_SPEED] = found[SPEED][0];
    f[ROW_OMEGA] = found[LEFT][0];
    f[ROW_MEMORY] = command.memory_rate;
    for (int i = DISTANCE; i <= LOSS; i++) f[ROW_INTEGRALS + i - DISTANCE] = found[i][0];
    if (!jacobian) return;
    const wheelset_parameters *body = &run->member.drivetrain->body;
    double creepage = ((wheel_action *)run->wheels.wheel[0])->creepage, reference, slope;
    regularized_speed(y[ROW_SPEED], body->minimum_speed, &reference, &slope);
    double by[2] = {(-1.0 - creepage * slope) / reference, body->radius / reference};
    int place[2] = {SPEED, LEFT};
    for (int c = 0; c < 2; c++) {
        for (int i = 0; i < 2; i++)
            jacobian[i][c] = j[place[i]][place[c]][0] +
                             j[place[i]][TORQUE][0] * command.torque_by_creepage * by[c];
        jacobian[c][ROW_MEMORY] = j[place[c]][TORQUE][0] * command.torque_by_memory;
        jacobian[ROW_MEMORY][c] = command.rate_by_creepage * by[c];
    }
    jacobian[ROW_MEMORY][ROW_MEMORY] = command.rate_by_memory;
}

/* What the signals of a crossing are above its level, in the state that was evaluated last. */
static double above_level(const wheelset_run *run, int crossing, const double *y) {
    const run_crossing *c = &run->given.crossing[crossing];
    const wheel_action *wheel = (const wheel_action *)run->wheels.wheel[0];
    return c->abs_speed * fabs(y[ROW_SPEED]) + c->creepage * wheel->creepage +
           c->abs_creepage * fabs(wheel->creepage) - c->fall * wheel->by_omega - c->level;
}

static run_row row_of(double time, const double *y, double torque) {
    run_row row = {.time = time, .drive_torque = torque};
    memcpy(&row.speed, y, RADAU_ROWS * sizeof(double));
    return row;
}

/* The row at a time of the last step. */
static run_row row_at(wheelset_run *run, double time) {
    const radau *s = &run->steps;
    double y[RADAU_ROWS];
    rows all;
    if (time == s->end_time) memcpy(y, s->end, sizeof y);
    else radau_at(s, (time - s->time) / s->h, y);
    return row_of(time, y, evaluate_loop(run, time, y, all).torque);
}

/* Find the part of the last step at which a crossing happens, between its ends. */
static double crossing_part(wheelset_run *run, int crossing) {
    const radau *s = &run->steps;
    double low = 0.0, high = 1.0, y[RADAU_ROWS];
    int begins_below = run->level[crossing] < 0.0;
    rows all;
    for (;;) {
        double middle = 0.5 * (low + high);
        if (middle == low || middle == high) return high;
        radau_at(s, middle, y);
        evaluate_loop(run, s->time + middle * s->h, y, all);
        double level = above_level(run, crossing, y);
        if (begins_below ? level < 0.0 : level > 0.0) low = middle;
        else high = middle;
    }
}

/* Find the events of the last step, in order; one that ends the run is the last. */
static void find_events(wheelset_run *run) {
    const radau *s = &run->steps;
    rows all;
    double was[RUN_CROSSINGS], is[RUN_CROSSINGS];
    evaluate_loop(run, s->end_time, s->end, all);
    for (int i = 0; i < run->given.crossings; i++) is[i] = above_level(run, i, s->end);
    memcpy(was, run->level, sizeof was);
    for (int i = 0; i < run->given.crossings; i++) {
        int direction = run->given.crossing[i].direction;
        int rises = was[i] < 0.0 && is[i] >= 0.0, falls = was[i] > 0.0 && is[i] <= 0.0;
        if (!(rises && direction >= 0) && !(falls && direction <= 0)) continue;
        run_event event = {.crossing = i};
        event.row = row_at(run, s->time + crossing_part(run, i) * s->h);
        event.creepage = ((wheel_action *)run->wheels.wheel[0])->creepage;
        size_t place = run->count++;
        for (; place > 0 && (run->events[place - 1].row.time - event.row.time) * s->h > 0.0;
             place--)
            run->events[place] = run->events[place - 1];
        run->events[place] = event;
    }
    memcpy(run->level, is, sizeof is);
    for (size_t i = 0; i < run->count; i++)
        if (run->given.crossing[run->events[i].crossing].ends) {
            run->count = i + 1;
            run->end = run->events[i].row.time;
            run->status = RUN_STOPPED;
        }
}

wheelset_run *wheelset_run_begin(const drivetrain_member *member, const run_stretch *given,
                                 const run_row *first) {
    wheelset_run *run = (wheelset_run *)calloc(1, sizeof *run);
    if (!run) return NULL;
    run->member = *member;
    run->given = *given;
    run->load = NAN;
    set_kind(&run->wheels, member);
    run->problem =
        (radau_problem){.model = run, .rates = rates_of_loop, .tolerance = given->tolerance};
    memcpy(run->problem.scale, given->scale, sizeof given->scale);
    radau *s = &run->steps;
    s->end_time = run->end = given->start;
    memcpy(s->end, &first->speed, sizeof s->end);
    rows all;
    evaluate_loop(run, given->start, s->end, all);
    for (int i = 0; i < given->crossings; i++) run->level[i] = above_level(run, i, s->end);
    run->unwritten = 1;
    run->grid = given->interval > 0.0 ? floor(given->start / given->interval) + 1.0 : 0.0;
    return run;
}

void wheelset_run_free(wheelset_run *run) { free(run); }

size_t wheelset_run_rows(wheelset_run *run, size_t room, run_row *rows, int *status, size_t *count,
                         run_event events[RUN_CROSSINGS]) {
    const run_stretch *given = &run->given;
    size_t written = 0;
    *count = 0;
    for (;;) {
        while (run->unwritten && written < room) {
            double next = run->grid * given->interval;
            int inside = given->interval > 0.0 && next < run->end;
            rows[written++] = row_at(run, inside ? next : run->end);
            run->unwritten = inside;
            if (inside || next == run->end) run->grid += 1.0;
        }
        if (run->unwritten) break;
        if (run->count) {
            *count = run->count;
            memcpy(events, run->events, sizeof run->events);
            run->count = 0;
            break;
        }
        if (run->status != RUN_GOES_ON || written == room) break;
        if (!radau_step(&run->problem, &run->steps, given->end)) {
            run->status = RUN_FAILED;
            break;
        }
        run->end = run->steps.end_time;
        if (run->end == given->end) run->status = RUN_AT_END;
        find_events(run);
        run->unwritten = 1;
    }
    *status = run->unwritten ? RUN_GOES_ON : run->status;
    return written;
}

#include "wheelset_run.h"

#include <float.h>
#include <stdlib.h>

#define LANES 1
#include "drivetrain_lanes.inc"

void control_law_command(const control_law *law, double reference, double creepage,
                         double integral_torque, control_command *command) {
    *command = (control_command){.torque = reference};
    if (!law->of_creepage) return;
    double error = reference - creepage, gain = law->proportional_gain;
    double unlimited = gain * error + integral_torque, tracking = law->integral_gain / gain;
    command->torque = fmin(fmax(unlimited, law->torque_min), law->torque_max);
    command->integral_rate = law->integral_gain * error + tracking * (command->torque - unlimited);
    if (command->torque == unlimited) {
        command->torque_by_creepage = -gain;
        command->torque_by_integral = 1.0;
        command->rate_by_creepage = -law->integral_gain;
    } else { /* Ki e - (Ki/Kp)(Kp e + I) = -(Ki/Kp) I depends on the integral alone */
        command->rate_by_integral = -tracking;
    }
}

/* The integrator's rows are those of run_row up to the torque; the first ones are states, the last
 * of them only of a contact with memory. */
enum {
    ROW_SPEED,
    ROW_OMEGA,
    ROW_INTEGRAL,
    ROW_TIME,
    ROW_HELD,
    ROW_DISTANCE = ROW_HELD + ROLLING_STATES,
    RUN_ROWS = ROW_DISTANCE + 5
};
static const int DRIVETRAIN_ROW[RUN_ROWS] = {
    SPEED,           LEFT,     -1,    -1,    MEMORY_LEFT, MEMORY_LEFT + 1,
    MEMORY_LEFT + 2, DISTANCE, DRIVE, CREEP, RESISTANCE,  LOSS};
ASSERT_LAYOUT(rows_of_the_run,
              ROW_OF(run_row, time) == ROW_TIME && ROW_OF(run_row, memory) == ROW_HELD &&
                  ROW_OF(run_row, distance) == ROW_DISTANCE &&
                  ROW_OF(run_row, loss_work) + 1 == RUN_ROWS && (int)RUN_ROWS <= (int)MAX_ROWS);

struct wheelset_run {
    drivetrain_member member;
    run_stretch given;
    group wheels;
    double load;  /* under which the wheels are prepared [N] */
    int changes;  /* whether the inputs change within the stretch */
    double ahead; /* part of the stretch by which they are ahead of time, for differences */
    equations problem;
    rows before, now;            /* at both ends of the last step */
    rows bend[3];                /* of the solution within it */
    double h, next;              /* length of that step; the one to try next [s] */
    int steps;                   /* that were tried */
    double level[RUN_CROSSINGS]; /* what each crossing's signals are above its level */
    double end;                  /* of the last step, or the event that ends the run [s] */
    double grid;                 /* number of the next row of the grid */
    int unwritten;               /* whether the last step has rows that are not written yet */
    int status;
    size_t count;
    run_event events[RUN_CROSSINGS];
};

enum { MAX_STEPS = 1000000 };

/* The solution within a step of Rodas5P, of fourth order: weights of the stages in its bends. */
static const double BEND[3][MAX_STAGES] = {
    {25.948786856663858, -2.5579724845846235, 10.433815404888879, -2.3679251022685204,
     0.524948541321073, 1.1241088310450404, 0.4272876194431874, -0.17202221070155493},
    {-9.91568850695171, -0.9689944594115154, 3.0438037242978453, -24.495224566215796,
     20.176138334709044, 15.98066361424651, -6.789040303419874, -6.710236069923372},
    {11.419903575922262, 2.8879645146136994, 72.92137995996029, 80.12511834622643,
     -52.072871366152654, -59.78993625266729, -0.15582684282751913, 4.883087185713722}};

/* Value of an input at a time. */
static double between(const wheelset_run *run, double from, double to, double time) {
    double start = run->given.start, end = run->given.end;
    double part = end == start ? 0.0 : (time - start) / (end - start);
    return from + part * (to - from) + run->ahead * (to - from);
}

/* Part of the stretch over which the rates are differenced: load and friction change there by
 * 1e-8 of their values, as rates have corners close to the states of a sliding contact. */
static double small_part(const wheelset_run *run, double time) {
    const run_input *from = &run->given.from, *to = &run->given.to;
    double ends[2][2] = {{from->axle_load, to->axle_load},
                         {from->friction_scale, to->friction_scale}};
    double part = 1e-4;
    for (int i = 0; i < 2; i++) {
        double largest = fmax(fabs(ends[i][0]), fabs(ends[i][1]));
        double value = fabs(between(run, ends[i][0], ends[i][1], time)) + 1e-9 * largest;
        part = fmin(part, 1e-8 * value / fmax(fabs(ends[i][1] - ends[i][0]), DBL_MIN));
    }
    return part;
}

/* Prepare the wheels for the load [N] at this time, and return the reference. */
static double set_input(wheelset_run *run, double time) {
    const run_input *from = &run->given.from, *to = &run->given.to;
    double weight = between(run, from->axle_load, to->axle_load, time);
    drivetrain_input in = {
        .resistance_force = between(run, from->resistance_force, to->resistance_force, time),
        .load_left = 0.5 * weight,
        .load_right = 0.5 * weight,
        .friction_left = between(run, from->friction_scale, to->friction_scale, time),
        .slope = 1.0};
    in.friction_right = in.friction_left;
    if (weight != run->load) {
        drivetrain_state none = {0};
        rows unused;
        put_drivetrain(&run->wheels, 0, &run->member, &in, &none, unused);
        run->load = weight;
    }
    put(run->wheels.input, 0, FIELDS(drivetrain_input), (const double *)&in);
    set_rails(&run->wheels, 0);
    return between(run, from->reference, to->reference, time);
}

static const contacts *wheel_now(const wheelset_run *run) { return &run->wheels.wheel[0]; }

static double creepage_now(const wheelset_run *run) {
    return wheel_now(run)->OUTPUT_OF(creepage)[0];
}

/* Evaluate wheels and controller; sets the drivetrain's rows, with the torque among them. */
static control_command evaluate_loop(wheelset_run *run, rows y, rows all) {
    double reference = set_input(run, y[ROW_TIME][0]);
    memset(all, 0, sizeof(rows));
    all[SPEED][0] = y[ROW_SPEED][0];
    all[LEFT][0] = y[ROW_OMEGA][0];
    for (int i = 0; i < ROLLING_STATES; i++)
        all[DRIVETRAIN_ROW[ROW_HELD + i]][0] = y[ROW_HELD + i][0];
    fill(&run->wheels, all);
    wheels(&run->wheels, all, contacts_evaluate_all);
    control_command command;
    control_law_command(&run->given.law, reference, creepage_now(run), y[ROW_INTEGRAL][0],
                        &command);
    all[TORQUE][0] = command.torque;
    return command;
}

static void rates_of_loop(void *model, lanes *y, lanes *f, matrix *jacobian) {
    wheelset_run *run = (wheelset_run *)model;
    rows all, found;
    matrix j;
    if (jacobian) memset(j, 0, sizeof j);
    control_command command = evaluate_loop(run, y, all);
    set_rates(&run->wheels, all, found, jacobian ? &j : NULL);
    if (run->wheels.remembering) set_memory_rates(&run->wheels, all, found, jacobian ? &j : NULL);
    const equations *p = &run->problem;
    for (int n = 0; n < p->rows; n++) {
        int i = p->index[n];
        if (DRIVETRAIN_ROW[i] >= 0) f[i][0] = found[DRIVETRAIN_ROW[i]][0];
    }
    f[ROW_INTEGRAL][0] = command.integral_rate;
    f[ROW_TIME][0] = 1.0;
    if (!jacobian) return;
    const lanes *out = wheel_now(run)->out;
    double by[2] = {OUTPUT_OF(creepage_by_speed)[0], OUTPUT_OF(creepage_by_omega)[0]};
    lanes(*to)[MAX_STATES] = *jacobian;
    for (int n = 0; n < p->rows; n++) {
        int i = p->index[n], from = DRIVETRAIN_ROW[i];
        if (from < 0) continue;
        for (int c = 0; c < 2; c++)
            to[i][c][0] = j[from][DRIVETRAIN_ROW[c]][0] +
                          j[from][TORQUE][0] * command.torque_by_creepage * by[c];
        to[i][ROW_INTEGRAL][0] = j[from][TORQUE][0] * command.torque_by_integral;
        for (int c = ROW_HELD; c < p->states; c++) to[i][c][0] = j[from][DRIVETRAIN_ROW[c]][0];
    }
    for (int c = 0; c < 2; c++) to[ROW_INTEGRAL][c][0] = command.rate_by_creepage * by[c];
    to[ROW_INTEGRAL][ROW_INTEGRAL][0] = command.rate_by_integral;
    if (!run->changes) return;
    rows sooner, later;
    double part = small_part(run, y[ROW_TIME][0]);
    run->ahead = -part;
    rates_of_loop(run, y, sooner, NULL);
    run->ahead = part;
    rates_of_loop(run, y, later, NULL);
    run->ahead = 0.0;
    double per = 0.5 / (part * (run->given.end - run->given.start));
    for (int n = 0; n < p->rows; n++) {
        int i = p->index[n];
        to[i][ROW_TIME][0] = per * (later[i][0] - sooner[i][0]);
    }
}

/* Root mean square of a change of the rows but the time, relative to their sizes; in place of omega
 * that of the slip, relative to slip plus saturation slip. */
static double relative_size(const wheelset_run *run, rows y, rows change) {
    const double *scale = (const double *)&run->given.scale;
    double radius = run->member.drivetrain->body.radius, sum = 0.0;
    double saturation =
        saturation_of(wheel_now(run), 0) * (fabs(y[ROW_SPEED][0]) + scale[ROW_SPEED]);
    for (int n = 0; n < run->problem.rows; n++) {
        int i = run->problem.index[n];
        if (i == ROW_TIME) continue;
        double size = fabs(y[i][0]) + scale[i], part = change[i][0];
        if (i == ROW_OMEGA) {
            size = fabs(radius * y[ROW_OMEGA][0] - y[ROW_SPEED][0]) + saturation;
            part = radius * change[ROW_OMEGA][0] - change[ROW_SPEED][0];
        }
        sum += part / size * (part / size);
    }
    return sqrt(sum / (run->problem.rows - 1));
}

/* Take one step towards the end; returns whether the tolerance is met. */
static int take_step(wheelset_run *run) {
    rows f, rates, error, next, k[MAX_STAGES];
    matrix j;
    factors one = {.problem = &run->problem, .j = &j, .by_part = NULL};
    double time = run->now[ROW_TIME][0], left = run->given.end - time, h = run->next;
    memset(j, 0, sizeof j);
    rates_of_loop(run, run->now, f, &j);
    if (run->h == 0.0) /* at first the rows change by a hundredth of their sizes, at most */
        h = copysign(fmin(1e-3 * fabs(left), 0.01 / fmax(relative_size(run, run->now, f), DBL_MIN)),
                     left);
    for (;;) {
        if (!(fabs(h) > 10.0 * DBL_EPSILON * fabs(time)) || run->steps++ == MAX_STEPS) return 0;
        int last = fabs(h) * (1.0 + 1e-9) >= fabs(left);
        if (last) h = left;
        one.h[0] = h;
        one.inverse[0] = 1.0 / h;
        memcpy(rates, f, sizeof rates);
        rodas5p(&one, run->now, rates, next, error, k);
        double ratio = relative_size(run, next, error) / run->given.tolerance;
        double factor = step_factor(ratio, 1);
        if (ratio <= 1.0) {
            memcpy(run->before, run->now, sizeof(rows));
            memcpy(run->now, next, sizeof(rows));
            run->now[ROW_TIME][0] = last ? run->given.end : time + h;
            memset(run->bend, 0, sizeof run->bend);
            for (int d = 0; d < 3; d++)
                for (int at = 0; at < MAX_STAGES; at++)
                    for (int i = 0; i < run->problem.rows; i++)
                        run->bend[d][run->problem.index[i]][0] += BEND[d][at] * k[at][i][0];
            run->h = h;
            run->next = h * factor;
            return 1;
        }
        h *= fmin(factor, 0.8);
    }
}

/* The solution at a time of the last step. */
static void solution_at(const wheelset_run *run, double time, rows y) {
    memcpy(y, run->now, sizeof(rows));
    if (time == run->now[ROW_TIME][0]) return;
    double part = (time - run->before[ROW_TIME][0]) / run->h, rest = 1.0 - part;
    for (int i = 0; i < RUN_ROWS; i++) {
        double bend = run->bend[0][i][0] + part * (run->bend[1][i][0] + part * run->bend[2][i][0]);
        y[i][0] = rest * run->before[i][0] + part * (run->now[i][0] + rest * bend);
    }
    y[ROW_TIME][0] = time;
}

/* What the signals of a crossing are above its level, in the state that was evaluated last. */
static double above_level(const wheelset_run *run, int crossing, rows y) {
    const run_crossing *c = &run->given.crossing[crossing];
    double creepage = creepage_now(run), radius = run->member.drivetrain->body.radius;
    double by_omega = 0.5 * radius * wheel_now(run)->OUTPUT_OF(force_gradient)[0];
    return c->abs_speed * fabs(y[ROW_SPEED][0]) + c->creepage * creepage +
           c->abs_creepage * fabs(creepage) - c->fall * by_omega - c->level;
}

/* The row at a time of the last step, or at the start. */
static run_row row_at(wheelset_run *run, double time) {
    rows y, all;
    run_row row;
    solution_at(run, time, y);
    memcpy(&row, y, RUN_ROWS * sizeof(double));
    row.drive_torque = evaluate_loop(run, y, all).torque;
    return row;
}

/* Find the time of the last step at which a crossing happens, between its ends. */
static double crossing_time(wheelset_run *run, int crossing) {
    double low = run->before[ROW_TIME][0], high = run->now[ROW_TIME][0];
    int begins_below = run->level[crossing] < 0.0;
    rows y, all;
    for (;;) {
        double middle = 0.5 * (low + high);
        if (middle == low || middle == high) return high;
        solution_at(run, middle, y);
        evaluate_loop(run, y, all);
        double level = above_level(run, crossing, y);
        if (begins_below ? level < 0.0 : level > 0.0) low = middle;
        else high = middle;
    }
}

/* Find the events of the last step, in order; one that ends the run is the last. */
static void find_events(wheelset_run *run) {
    rows all;
    double is[RUN_CROSSINGS];
    evaluate_loop(run, run->now, all);
    for (int i = 0; i < run->given.crossings; i++) is[i] = above_level(run, i, run->now);
    for (int i = 0; i < run->given.crossings; i++) {
        int direction = run->given.crossing[i].direction;
        int rises = run->level[i] < 0.0 && is[i] >= 0.0,
            falls = run->level[i] > 0.0 && is[i] <= 0.0;
        if (!(rises && direction >= 0) && !(falls && direction <= 0)) continue;
        run_event event = {.crossing = i};
        event.row = row_at(run, crossing_time(run, i));
        event.creepage = creepage_now(run);
        size_t index = run->count++;
        while (index > 0 && (run->events[index - 1].row.time - event.row.time) * run->h > 0.0) {
            run->events[index] = run->events[index - 1];
            index--;
        }
        run->events[index] = event;
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
    run->changes = memcmp(&given->from, &given->to, sizeof given->to) != 0;
    set_kind(&run->wheels, member, 1);
    int last = remembers(member->contact) ? ROW_DISTANCE : ROW_HELD;
    run->problem = (equations){.parts = 1, .model = run, .rates = rates_of_loop, .states = last};
    for (int i = 0; i < RUN_ROWS; i++)
        if (i < last || i >= ROW_DISTANCE) run->problem.index[run->problem.rows++] = i;
    memcpy(run->now, first, RUN_ROWS * sizeof(double));
    run->now[ROW_TIME][0] = run->end = given->start;
    rows all;
    evaluate_loop(run, run->now, all);
    for (int i = 0; i < given->crossings; i++) run->level[i] = above_level(run, i, run->now);
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
        if (!take_step(run)) {
            run->status = RUN_FAILED;
            break;
        }
        run->end = run->now[ROW_TIME][0];
        if (run->end == given->end) run->status = RUN_AT_END;
        find_events(run);
        run->unwritten = 1;
    }
    *status = run->unwritten ? RUN_GOES_ON : run->status;
    return written;
}

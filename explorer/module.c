/* What the page's WebAssembly module adds to the kernel: new objects, which nobody frees, and calls
 * that take and give structs of doubles alone. */
#include <stdlib.h>

#include "creep_curve.h"
#include "half_space.h"
#include "simd_dispatch.h"
#include "track.h"
#include "wheelset.h"
#include "wheelset_run.h"

/* A drivetrain, which keeps its parameters, and a stretch of rail with friction times a factor
 * under both wheels. */
typedef struct {
    drivetrain_member member;
    force_element_parameters contact;
    drivetrain_parameters drivetrain;
    track rails;
    double at[4], factor[4];
    double substep;
} train;

static const double ALWAYS = 0.0, UNCHANGED = 1.0;

double *new_doubles(size_t count) { return (double *)calloc(count, sizeof(double)); }

creep_table *new_table(void) { return (creep_table *)calloc(1, sizeof(creep_table)); }

train *new_train(void) { return (train *)calloc(1, sizeof(train)); }

void train_configure(train *t, const creep_table *table, const force_element_parameters *contact,
                     const drivetrain_parameters *drivetrain) {
    t->contact = *contact;
    t->drivetrain = *drivetrain;
    t->member.table = table;
    t->member.contact = &t->contact;
    t->member.drivetrain = &t->drivetrain;
    force_element_scales(contact, contact->nominal_load, 1.0, &t->member.scales);
}

/* Lay a patch in place of the last one; two equal places remove it. */
void train_lay_patch(train *t, double begins, double ends, double factor) {
    const double at[4] = {begins, begins, ends, ends}, value[4] = {1.0, factor, factor, 1.0};
    for (int i = 0; i < 4; i++) {
        t->at[i] = at[i];
        t->factor[i] = value[i];
    }
    const profile both = {.count = 4, .at = t->at, .value = t->factor};
    const profile one = {.count = 1, .at = &ALWAYS, .value = &UNCHANGED};
    t->rails = (track){.left = both, .right = both, .over_time = one, .slope = one};
    t->member.rails = begins < ends ? &t->rails : NULL;
}

/* Returns whether the tolerance is not met. */
int train_advance(train *t, drivetrain_input *input, drivetrain_state *state, double time,
                  double step, double tolerance) {
    unsigned char failed = 0;
    drivetrain_advance_many_in_turn(&t->member, 1, input, state, time, step, tolerance, &t->substep,
                                    &failed);
    if (failed) t->substep = 0.0; /* another attempt is free to begin */
    return failed;
}

void train_evaluate(const train *t, const drivetrain_input *input, const drivetrain_state *state,
                    drivetrain_output *output) {
    drivetrain_evaluate_many_in_turn(&t->member, 1, 1, input, state, output);
}

/* Move on from a row under held inputs, whose reference is the torque, until the creepage passes
 * base + slope speed, or the speed falls below the least, for a time at most. Overwrites the row
 * with that of the end. Returns whether the creepage has passed. */
int train_pass(const train *t, const run_input *held, double base, double slope, double longest,
               double tolerance, run_row *row) {
    run_stretch given = {.end = longest, .from = *held, .to = *held, .tolerance = tolerance};
    const run_crossing passes = {
        .creepage = 1.0, .abs_speed = -slope, .level = base, .direction = 1, .ends = 1};
    const run_crossing stands = {
        .abs_speed = 1.0, .level = t->drivetrain.body.minimum_speed, .direction = -1, .ends = 1};
    double *scale = (double *)&given.scale; /* works and memory do not matter */
    for (size_t i = 0; i < sizeof given.scale / sizeof *scale; i++) scale[i] = 1e300;
    given.scale.speed = row->speed;
    given.scale.distance = row->speed * longest;
    given.crossings = 2;
    given.crossing[0] = passes;
    given.crossing[1] = stands;
    wheelset_run *run = wheelset_run_begin(&t->member, &given, row);
    if (!run) return 0;
    run_event events[RUN_CROSSINGS];
    int status = RUN_GOES_ON;
    size_t count = 0;
    while (status == RUN_GOES_ON) wheelset_run_rows(run, 1, row, &status, &count, events);
    wheelset_run_free(run);
    return status == RUN_STOPPED && events[count - 1].crossing == 0;
}

/* What the page's WebAssembly module adds to the kernel: new objects, which nobody frees, and calls
 * that take and give structs of doubles alone. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "checked_file.h"
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

/* Restore numbers from their second differences along all axes, given byte by byte: undoes _planes
 * of contactlib/export/explorer.py. */
static void restore(const unsigned char *plane, uint64_t *number, const size_t *length, int axes) {
    size_t count = 1;
    for (int axis = 0; axis < axes; axis++) count *= length[axis];
    for (size_t i = 0; i < count; i++) {
        uint64_t all = 0;
        for (size_t byte = 0; byte < sizeof all; byte++)
            all |= (uint64_t)plane[byte * count + i] << (8 * byte);
        number[i] = (all >> 1) ^ (0 - (all & 1));
    }
    for (size_t axis = 0, stride = 1; axis < (size_t)axes; stride *= length[axis++])
        for (int twice = 0; twice < 2; twice++)
            for (size_t i = stride; i < count; i++)
                if (i / stride % length[axis] > 0) number[i] += number[i - stride];
}

/* Open a table as packed_table of contactlib/export/explorer.py has packed it, and free it. Returns
 * NULL, or an error message. */
const char *open_packed_table(creep_table *table, unsigned char *packed, size_t size) {
    enum { HEADER = 216 };
    static const double STEP = 1.0 / (1 << 22);
    if (size < HEADER) return "the table is shorter than its header";
    memcpy(table, packed + CHECKED_FILE_FRAME, offsetof(creep_table, coefficients));
    const size_t cells[2] = {table->cells_u + 3, table->cells_k + 3};
    const size_t layer_cells[3] = {table->layer_u + 3, table->layer_k + 3, table->layer_w + 3};
    const size_t count = table->cells_u > 0 ? cells[0] * cells[1] : 0;
    const size_t layers = layer_cells[0] * layer_cells[1] * layer_cells[2];
    if (size != HEADER + sizeof(uint64_t) * (count + layers))
        return "the table's length does not fit its number of cells";
    const size_t file_size = HEADER + sizeof(double) * count + sizeof(float) * layers;
    unsigned char *file = (unsigned char *)malloc(file_size);
    uint64_t *number = (uint64_t *)malloc(sizeof(uint64_t) * layers);
    if (!file || !number) return "there is no memory for the table";
    memcpy(file, packed, HEADER);
    if (count > 0) restore(packed + HEADER, (uint64_t *)(void *)(file + HEADER), cells, 2);
    restore(packed + HEADER + sizeof(uint64_t) * count, number, layer_cells, 3);
    float *coefficient = (float *)(void *)(file + HEADER + sizeof(double) * count);
    for (size_t i = 0; i < layers; i++) coefficient[i] = (float)(STEP * (double)(int64_t)number[i]);
    free(number);
    free(packed);
    return creep_table_open(table, file, file_size);
}

train *new_train(void) { return (train *)calloc(1, sizeof(train)); }

void train_configure(train *t, const creep_table *table, const force_element_parameters *contact,
                     const drivetrain_parameters *drivetrain) {
    t->contact = *contact;
    t->drivetrain = *drivetrain;
    t->member.table = table;
    t->member.contact = &t->contact;
    t->member.drivetrain = &t->drivetrain;
    drivetrains_prepare(&t->member, 1);
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
    const profile level = {.count = 1, .at = &ALWAYS, .value = &ALWAYS};
    t->rails = (track){
        .left = both, .right = both, .over_time = one, .slope = one, .grade = level, .scale = 1.0};
    t->member.rails = begins < ends ? &t->rails : NULL;
}

/* Returns whether the tolerance is not met. */
int train_advance(train *t, drivetrain_input *input, drivetrain_state *state, double time,
                  double step, double tolerance) {
    unsigned char failed = 0;
    drivetrains_advance_one_lane(&t->member, 1, 1, NULL, input, state, time, step, tolerance,
                                 &t->substep, &failed);
    if (failed) t->substep = 0.0; /* another attempt is free to begin */
    return failed;
}

void train_evaluate(const train *t, const drivetrain_input *input, const drivetrain_state *state,
                    drivetrain_output *output) {
    drivetrains_evaluate_one_lane(&t->member, 1, 1, input, state, output, NULL);
}

void train_settle(const train *t, const drivetrain_input *input, drivetrain_state *state) {
    drivetrains_settle(&t->member, 1, input, state);
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

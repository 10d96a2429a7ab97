/* Stepping and evaluating drivetrains one after another. For a few of them this is quicker, as a
 * lane that stays idle costs as much as any other. */
#define LANES 1
#define WIDE_SUFFIX one_lane
#include "drivetrains.inc"

void drivetrains_settle(const drivetrain_member *members, size_t n, const drivetrain_input *input,
                        drivetrain_state *state) {
    for (size_t i = 0; i < n; i++) {
        drivetrain_output output;
        force_element_output contact[2];
        drivetrains_evaluate_one_lane(&members[i], 1, 1, &input[i], &state[i], &output, contact);
        state[i].left = settled(&contact[0]);
        state[i].right = settled(&contact[1]);
    }
}

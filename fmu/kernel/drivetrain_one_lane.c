/* Stepping and evaluating drivetrains one after another. For a few of them this is quicker, as a
 * lane that stays idle costs as much as any other. */
#define LANES 1
#define WIDE_SUFFIX one_lane
#include "drivetrains.inc"

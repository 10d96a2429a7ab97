/* A contact whose force follows the creepage over a distance rolled.
 *
 * sigma_e dzeta'/dt = w - |v| zeta', with w the slip velocity. The length sigma_e is sigma while
 * |zeta'| stays below the saturation creepage, and shrinks like 1/|zeta'| beyond: what slides
 * stores no more deflection, so a wheel that spins at standstill winds up no spring without end.
 */
#ifndef RELAXATION_H
#define RELAXATION_H

#include <math.h>

#include "force_element.h"

/* Beyond saturation the decay is by |v|, but at least by this part of |w|/zeta0: it ends the growth
 * at a million times zeta0, where every law has long come to its tail. */
static const double LEAST_DECAY = 1e-6;

static inline double sliding_decay(double slip, double speed, double limit) {
    return fmax(fabs(speed), LEAST_DECAY * fabs(slip) / limit);
}

/* The relaxed creepage beyond which the patch slides. The saturation creepage vanishes with the
 * load, and the length would with it; it stops where nothing is transmitted any more. */
static inline double sliding_limit(double saturation_creepage) {
    return fmax(saturation_creepage, 1e-5);
}

/* Set the relaxation rate and its partial derivatives; log_by_slip is that of the saturation
 * creepage to the slip velocity. */
void relaxation_rate(const force_element_parameters *parameters, const force_element_input *input,
                     double slip, double saturation_creepage, double log_by_slip,
                     force_element_output *output);

#endif

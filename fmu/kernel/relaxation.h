/* A contact whose force follows the creepage over a distance rolled.
 *
 * sigma_e dzeta'/dt = w - |v| zeta', with w the slip velocity. The length sigma_e is sigma while
 * |zeta'| stays below the saturation creepage, and shrinks like 1/|zeta'| beyond: a sliding patch
 * stores no further deflection, so a wheel that spins at standstill does not stretch the contact
 * spring by metres. */
#ifndef RELAXATION_H
#define RELAXATION_H

#include <math.h>

#include "force_element.h"
#include "simd_math.h"

/* Beyond saturation the rate of decay is |v|, but at least this fraction of |w|/zeta0: it ends the
 * growth at a million times zeta0, far in the tail of every law. */
static const double MIN_DECAY = 1e-6;

ALWAYS_INLINE double sliding_decay(double slip, double speed, double limit) {
    return larger(fabs(speed), MIN_DECAY * fabs(slip) / limit);
}

/* The relaxed creepage beyond which the patch slides. The saturation creepage vanishes with the
 * load; the lower limit prevents sigma_e from vanishing. */
ALWAYS_INLINE double sliding_limit(double saturation_creepage) {
    return larger(saturation_creepage, 1e-5);
}

/* Set the relaxation rate and its partial derivatives, and return that by ln(saturation_creepage);
 * all are zero without a relaxation length. log_by_rolling and log_by_speed are derivatives of
 * ln(saturation_creepage) by omega r and by the speed. */
ALWAYS_INLINE double relaxation_rate(const force_element_parameters *p,
                                     const force_element_input *in, double slip,
                                     double saturation_creepage, double log_by_rolling,
                                     double log_by_speed, force_element_output *out) {
    int relaxed = p->relaxation_length > 0.0;
    double zeta = in->relaxed_creepage, limit = sliding_limit(saturation_creepage);
    double pace = fabs(in->speed), direction = copysign(in->speed == 0.0 ? 0.0 : 1.0, in->speed);
    int sliding = fabs(zeta) > limit;
    double size = sliding ? fabs(zeta) : limit;
    double inverse = size / ((relaxed ? p->relaxation_length : 1.0) * limit); /* 1/sigma_e */
    double decay = sliding ? sliding_decay(slip, in->speed, limit) : pace;
    double rate = (slip - decay * zeta) * inverse;
    int moves = sliding & (limit == saturation_creepage);
    int bounded = decay > pace; /* MIN_DECAY applies; the slip is not zero then */
    direction = bounded ? 0.0 : direction;
    double by_slip = (1.0 - (bounded ? decay / slip : 0.0) * zeta) * inverse;
    double by_log_limit = moves ? (bounded ? decay * zeta * inverse : 0.0) - rate : 0.0;
    double by_relaxed = -decay * inverse + (sliding ? rate / zeta : 0.0);
    out->relaxation_rate = relaxed ? rate : 0.0;
    double by_rolling = by_slip + by_log_limit * log_by_rolling;
    double by_speed = by_log_limit * log_by_speed - by_slip - direction * zeta * inverse;
    out->rate_by_omega = relaxed ? by_rolling * p->radius : 0.0;
    out->rate_by_speed = relaxed ? by_speed : 0.0;
    out->rate_by_relaxed = relaxed ? by_relaxed : 0.0;
    return relaxed ? by_log_limit : 0.0;
}

#endif

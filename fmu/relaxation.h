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
#include "inline.h"

/* Beyond saturation the decay is by |v|, but at least by this part of |w|/zeta0: it ends the growth
 * at a million times zeta0, where every law has long come to its tail. */
static const double LEAST_DECAY = 1e-6;

ALWAYS_INLINE double sliding_decay(double slip, double speed, double limit) {
    return larger(fabs(speed), LEAST_DECAY * fabs(slip) / limit);
}

/* The relaxed creepage beyond which the patch slides. The saturation creepage vanishes with the
 * load, and the length would with it; it stops where nothing is transmitted any more. */
ALWAYS_INLINE double sliding_limit(double saturation_creepage) {
    return larger(saturation_creepage, 1e-5);
}

/* Set the relaxation rate and its partial derivatives, all zero without a relaxation length;
 * log_by_slip is that of the saturation creepage to the slip velocity. */
ALWAYS_INLINE void relaxation_rate(const force_element_parameters *p, const force_element_input *in,
                                   double slip, double saturation_creepage, double log_by_slip,
                                   force_element_output *out) {
    int relaxed = p->relaxation_length > 0.0;
    double zeta = in->relaxed_creepage, limit = sliding_limit(saturation_creepage);
    double pace = fabs(in->speed), direction = copysign(in->speed == 0.0 ? 0.0 : 1.0, in->speed);
    int sliding = fabs(zeta) > limit;
    double size = sliding ? fabs(zeta) : limit; /* not zero: it divides */
    double inverse = size / ((relaxed ? p->relaxation_length : 1.0) * limit); /* of the length */
    double decay = sliding ? sliding_decay(slip, in->speed, limit) : pace;
    double rate = (slip - decay * zeta) * inverse;
    int moves = sliding & (limit == saturation_creepage);
    double log_limit_by_slip = moves ? log_by_slip : 0.0;
    int least = decay > pace; /* the least decay, by the slip, which then is not zero */
    double decay_by_slip = least ? decay / slip - decay * log_limit_by_slip : 0.0;
    direction = least ? 0.0 : direction;
    double by_slip = (1.0 - decay_by_slip * zeta) * inverse - rate * log_limit_by_slip;
    double by_relaxed = -decay * inverse + (sliding ? rate / zeta : 0.0);
    out->relaxation_rate = relaxed ? rate : 0.0;
    out->rate_by_omega = relaxed ? by_slip * p->radius : 0.0;
    out->rate_by_speed = relaxed ? -by_slip - direction * zeta * inverse : 0.0;
    out->rate_by_relaxed = relaxed ? by_relaxed : 0.0;
}

#endif

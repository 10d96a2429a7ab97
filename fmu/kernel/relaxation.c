#include "relaxation.h"

/* (1 - exp(-z)) / z */
static double mean_decay(double z) {
    if (z == 0.0) return 1.0;
    return fabs(z) < 0.34 ? -exponential_less_one(-z) / z : (1.0 - exponential(-z)) / z;
}

/* Time in which y' = a - b y covers a distance at whose end the rate is rate_at_end. */
static double time_to_go(double distance, double rate_at_end, double b) {
    double growth = b * distance / rate_at_end;
    /* ln(v) / (v - 1) hardly changes when v = 1 + growth is rounded. */
    double v = 1.0 + growth, mean = v == 1.0 ? 1.0 : logarithm(v) / (v - 1.0);
    return distance / rate_at_end * mean;
}

double force_element_relax(const force_element_parameters *p, const force_element_input *in,
                           double saturation_creepage, double step) {
    double limit = sliding_limit(saturation_creepage);
    double slip = p->radius * in->omega - in->speed, v = fabs(in->speed);
    double zeta = in->relaxed_creepage, sigma = p->relaxation_length, left = step;
    /* At most three passes: sliding, sticking, sliding the other way. */
    for (int i = 0; i < 4 && left > 0.0; i++) {
        double rate = slip - v * zeta, went = left;
        int sliding = fabs(zeta) > limit ||
                      (fabs(zeta) == limit && rate * zeta > 0.0); /* about to slide on */
        if (!sliding) {
            /* sigma zeta' = w - v zeta: an exponential */
            double edge = copysign(limit, rate), rate_at_edge = slip - v * edge;
            int leaves = rate * rate_at_edge > 0.0;
            if (leaves) went = fmin(left, sigma * time_to_go(edge - zeta, rate_at_edge, v));
            double z = v * went / sigma;
            if (leaves && went < left) zeta = edge;
            else zeta = zeta * exponential(-z) + slip * went / sigma * mean_decay(z);
        } else {
            /* y = 1/|zeta|: sigma limit y' = v - w y, an exponential again */
            double sign = copysign(1.0, zeta), w = sign * slip, slow = sigma * limit;
            double decay = sliding_decay(slip, v, limit), y = 1.0 / fabs(zeta), edge = 1.0 / limit;
            double rate_at_edge = decay - w * edge;
            int returns = rate_at_edge > 0.0 && decay - w * y > 0.0;
            if (returns) went = fmin(left, slow * time_to_go(edge - y, rate_at_edge, w));
            double z = w * went / slow;
            if (returns && went < left) zeta = sign * limit;
            else zeta = sign / (y * exponential(-z) + decay * went / slow * mean_decay(z));
        }
        left -= went;
    }
    return zeta;
}

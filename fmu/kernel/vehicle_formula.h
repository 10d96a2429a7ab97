/* Formulas of a vehicle (vehicle.h). */
#ifndef VEHICLE_FORMULA_H
#define VEHICLE_FORMULA_H

#include <math.h>

#include "simd_math.h"
#include "vehicle.h"

/* Number of axles in a bogie: one axle is a bogie by itself. */
static inline int axles_of_bogie(const vehicle_parameters *p) {
    return (int)smaller(p->axles_per_bogie, p->axles);
}

/* Mass of a vehicle and its train [kg]. */
static inline double mass_of(const vehicle_parameters *p) {
    double bogies = p->axles / axles_of_bogie(p);
    double own = p->body_mass + bogies * p->bogie_mass + p->axles * p->wheelset_mass;
    return own + p->train_mass;
}

/* Moment balances of bogies and body, whose inertia and resistance act at their centres of mass.
 * Moments that lift the front are positive; those of the body are about the pivots' height, those
 * of a bogie about the rail. */
static inline void loads_by_statics(const vehicle_parameters *p, const vehicle_forces *forces,
                                    double load[MAX_AXLES]) {
    const int n = (int)p->axles, each = axles_of_bogie(p), bogies = n / each;
    const double *at = p->position, a = forces->acceleration;
    double middle[MAX_AXLES], centre = 0.0, squares = 0.0, moment[MAX_AXLES];
    double wheelsets = each * p->wheelset_mass, all = 0.0, pulling = -p->body_mass * a;
    for (int b = 0; b < bogies; b++) {
        double force = 0.0, turning = 0.0, heights = 0.0;
        middle[b] = 0.0;
        for (int i = b * each; i < (b + 1) * each; i++) {
            force += forces->creep_force[i];
            turning += forces->omega_rate[i];
            heights += forces->radius[i];
            middle[b] -= at[i] / each;
        }
        double pull = force - (p->bogie_mass + wheelsets) * a; /* on the body */
        moment[b] = pull * p->pivot_height + p->bogie_mass * a * p->bogie_height +
                    p->wheelset_mass * a * heights + p->pitch_inertia * turning;
        all += force;
        pulling += pull;
        centre += middle[b] / bogies;
    }
    /* Resistance acts on vehicle and train in proportion to their masses. */
    double mass = mass_of(p);
    double coupler = forces->towed_force + (all - forces->towed_force) * p->train_mass / mass;
    double resistance = pulling - coupler;
    double body = coupler * (p->coupler_height - p->pivot_height) +
                  (resistance + p->body_mass * a) * (p->body_height - p->pivot_height);
    for (int b = 0; b < bogies; b++) {
        squares += (middle[b] - centre) * (middle[b] - centre);
        if (each == 1) body += moment[b]; /* such a bogie carries none: it hands it to the body */
    }
    double weight = 9.80665 * (p->body_mass / n + p->bogie_mass / each + p->wheelset_mass);
    for (int b = 0; b < bogies; b++) {
        double around = 0.0, lever = bogies > 1 ? (middle[b] - centre) / squares : 0.0;
        for (int i = b * each; i < (b + 1) * each; i++)
            around += (at[i] + middle[b]) * (at[i] + middle[b]);
        for (int i = b * each; i < (b + 1) * each; i++) {
            double arm = each > 1 ? -(at[i] + middle[b]) / around : 0.0;
            load[i] = larger(weight - lever * body / each - arm * moment[b], 0.0);
        }
    }
}

/* exp(-time/lag) */
static inline double left_of(double time, double lag) { return decaying_exponential(time / lag); }

/* Number of the interval of the rails around a distance: there are nodes at its ends. */
static inline double interval_at(const vehicle *v, double distance) {
    return floor(distance / v->node_distance + 0.5);
}

/* Slip work at a node, which has the number of the interval behind it. */
static inline double *work_at(const vehicle *v, double number) {
    return v->work + 2 * ((size_t)(long long)number & (v->nodes - 1));
}

/* Slip work per length that other axles have left at a distance. */
static inline void work_left_at(const vehicle *v, double distance, double work[2]) {
    double interval = interval_at(v, distance);
    double part = distance / v->node_distance - interval + 0.5; /* 0 to 1 within the interval */
    work[0] = work[1] = 0.0;
    for (int end = 0; v->range && end < 2; end++) {
        double node = interval - 1.0 + end, weight = end == 0 ? 1.0 - part : part;
        if (node < v->range->first || node > v->range->last) continue;
        for (int side = 0; side < 2; side++) work[side] += weight * work_at(v, node)[side];
    }
}

/* Add slip work per length to a node, which may be new. */
static inline void add_work(const vehicle *v, double node, const double work[2]) {
    rail_range *range = v->range;
    double ring = (double)v->nodes;
    int beside = node > range->first - ring && node < range->last + ring;
    if (range->last < range->first || !beside) range->first = node, range->last = node - 1.0;
    while (range->last < node) {
        double *fresh = work_at(v, ++range->last);
        fresh[0] = fresh[1] = 0.0;
        if (range->last - range->first >= ring) range->first += 1.0;
    }
    while (range->first > node) {
        double *fresh = work_at(v, --range->first);
        fresh[0] = fresh[1] = 0.0;
        if (range->last - range->first >= ring) range->last -= 1.0;
    }
    for (int side = 0; side < 2; side++) work_at(v, node)[side] += work[side];
    if (work[0] != work[1]) range->sides = 1.0;
}

/* Let an axle do slip work [J] evenly on its way to a distance. Each interval gives half of its
 * work to the node at either end, once the axle has left the intervals beside that node: until then
 * it is the axle's own. */
static inline void slide(const vehicle *v, axle_state *axle, double from, double to,
                         const double slip_work[2]) {
    const double target = interval_at(v, to), direction = target < axle->interval ? -1.0 : 1.0;
    if (!(fabs(target - axle->interval) < (double)v->nodes)) { /* it has left all nodes behind */
        axle->work_left = axle->work_right = axle->came = 0.0;
        axle->interval = target;
    }
    double rest[2] = {slip_work[0], slip_work[1]}, place = from;
    while (axle->interval != target) {
        double edge = (axle->interval + 0.5 * direction) * v->node_distance;
        double part = fabs(to - place) > 0.0 ? (edge - place) / (to - place) : 0.0;
        double *work = &axle->work_left, *before = &axle->before_left, given[2];
        part = smaller(larger(part, 0.0), 1.0);
        for (int side = 0; side < 2; side++) {
            work[side] += part * rest[side];
            rest[side] -= part * rest[side];
            double along = axle->came == direction ? before[side] : 0.0;
            double back = axle->came == -direction ? before[side] : 0.0;
            given[side] = 0.5 * (work[side] + along) / v->node_distance;
            before[side] = work[side] + back;
            work[side] = 0.0;
        }
        if (given[0] > 0.0 || given[1] > 0.0)
            add_work(v, direction > 0.0 ? axle->interval - 1.0 : axle->interval, given);
        axle->came = direction;
        axle->interval += direction;
        place = edge;
    }
    axle->work_left += rest[0];
    axle->work_right += rest[1];
}

/* Friction where slip work per length has cleaned the rails. */
static inline double cleaned(const vehicle *v, double friction, double work) {
    double missing = larger(v->recovered - friction, 0.0);
    return friction + (1.0 - decaying_exponential(v->cleaning * work)) * missing;
}

#endif

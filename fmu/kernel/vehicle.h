/* A vehicle of one to eight axles: the loads of its axles, and what they leave on its rails.
 *
 * The loads follow, with a lag, the forces at rails, couplers and masses by statics of rigid bodies
 * in the vertical plane: equal springs on all axles of a bogie and under both ends of the body.
 * Slip cleans the rails: friction rises towards a limit with the slip work per length that all
 * axles have done there. */
#ifndef VEHICLE_H
#define VEHICLE_H

#include <stddef.h>

#include "export.h"

/* Largest number of axles of a vehicle. */
enum { MAX_AXLES = 8 };

typedef struct {
    double axles;
    double axles_per_bogie;
    double position[MAX_AXLES]; /* of each axle behind the first one [m] */
    double body_mass;           /* [kg] */
    double bogie_mass;          /* of one, without its wheelsets [kg] */
    double wheelset_mass;       /* of one [kg] */
    double train_mass;          /* behind the coupler [kg] */
    double body_height;         /* of the centre of mass above the rail [m] */
    double bogie_height;        /* likewise [m] */
    double pivot_height;        /* at which the bogies pull the body [m] */
    double coupler_height;      /* [m] */
    double pitch_inertia;       /* angular momentum of wheelset and rotor over omega [kg.m2] */
    double load_lag;            /* time constant of the loads [s]; 0: at once */
} vehicle_parameters;

/* What acts on a vehicle. */
typedef struct {
    double creep_force[MAX_AXLES]; /* [N] */
    double omega_rate[MAX_AXLES];  /* [rad/s2] */
    double acceleration;           /* of the vehicle, plus g times the grade [m/s2] */
    double towed_force;            /* with which others pull its couplers backward [N] */
    double radius[MAX_AXLES];      /* height of each wheelset's centre [m] */
} vehicle_forces;

/* Loads by statics under n sets of forces, of both wheels of each axle, at least 0 [N]. */
CONTACTLIB_API void vehicle_loads(const vehicle_parameters *vehicle, size_t n,
                                  const vehicle_forces *forces, double (*load)[MAX_AXLES]);

/* What an axle has of the past. Integrals over the interval between two nodes of the rails count
 * from the axle's arrival there. */
typedef struct {
    double load;                          /* of both wheels [N] */
    double target, target_rate;           /* load by statics, mean of the last substep [N, N/s] */
    double own_left, own_right;           /* slip work per length in it [J/m] */
    double own_rate_left, own_rate_right; /* its change with time [J/(m.s)] */
    double speed_rate;                    /* of the vehicle, mean of the last substep [m/s2] */
    double length;                        /* of the substep [s]; 0: none yet, and no rates */
    double commanded_torque;              /* [N.m] */
    double interval;                      /* number of the interval of the rails */
    double work_left, work_right;         /* slip work in it [J] */
    double before_left, before_right;     /* slip work in the last one, for the node between [J] */
    double came;                          /* 1: forward from the last one, -1: backward, or 0 */
} axle_state;

/* Slip work on the rails. Nodes are `node_distance` apart; beyond the known ones it is 0. The nodes
 * behind are forgotten when the ring of them is full. */
typedef struct {
    double first, last; /* numbers of known nodes; none if last < first */
    double sides;       /* 1 once the work on the left and the right rail has differed */
} rail_range;

typedef struct {
    const vehicle_parameters *body; /* NULL: the loads are those of the inputs */
    double cleaning;                /* of the rails by slip work per length [m/J]; 0: none */
    double recovered;               /* factor on friction towards which cleaning raises it [1] */
    double node_distance;           /* [m] */
    axle_state *axle;               /* of each axle */
    rail_range *range;              /* NULL if only the axle's own work counts; then also: */
    double *work;                   /* on the left and the right rail at each node [J/m] */
    size_t nodes;                   /* in the ring: a power of two */
} vehicle;

#endif

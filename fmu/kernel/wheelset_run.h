/* A run of one wheelset under continuous control: rows of its motion, and events. */
#ifndef WHEELSET_RUN_H
#define WHEELSET_RUN_H

#include "drivetrain.h"

/* Torque control: the reference is the torque. Creep control: a PI law with limits,
 * T = Kp e + I within them, dI/dt = Ki e + (Ki/Kp)(T - (Kp e + I)), e = reference - creepage. */
typedef struct {
    int of_creepage;          /* 0: torque control, without the parameters below */
    double proportional_gain; /* Kp [N.m] */
    double integral_gain;     /* Ki [N.m/s] */
    double torque_min;        /* [N.m] */
    double torque_max;        /* [N.m] */
} control_law;

typedef struct {
    double torque;             /* [N.m] */
    double torque_by_creepage; /* [N.m] */
    double torque_by_integral; /* [1] */
    double integral_rate;      /* dI/dt [N.m/s] */
    double rate_by_creepage;   /* [N.m/s] */
    double rate_by_integral;   /* [1/s] */
} control_command;

CONTACTLIB_API void control_law_command(const control_law *law, double reference, double creepage,
                                        double integral_torque, control_command *command);

typedef struct {
    double reference;        /* of the controller: torque [N.m] or creepage [1] */
    double axle_load;        /* of both wheels [N] */
    double friction_scale;   /* [1] */
    double resistance_force; /* [N] */
} run_input;

/* State, and torque that it gets. */
typedef struct {
    double speed;           /* [m/s] */
    double omega;           /* [rad/s] */
    double integral_torque; /* of the controller [N.m] */
    double time;            /* [s] */
    rolling_memory memory;  /* of a contact with memory */
    double distance;        /* [m] */
    double drive_work;      /* works, as in a drivetrain [J] */
    double creep_work;      /* [J] */
    double resistance_work; /* [J] */
    double loss_work;       /* [J] */
    double drive_torque;    /* [N.m] */
} run_row;

/* A weighted sum of signals passes a level. */
enum { RUN_CROSSINGS = 4 };
typedef struct {
    double abs_speed;    /* weight of the speed's size [1/(m/s)] */
    double creepage;     /* of the creepage */
    double abs_creepage; /* of its size */
    double fall;         /* of the fall of the steady force with omega at fixed speed [1/(N.s)] */
    double level;
    int direction; /* 1: rising only, -1: falling only, 0: either */
    int ends;      /* whether it ends the run */
} run_crossing;

typedef struct {
    int crossing; /* index of the crossing */
    double creepage;
    run_row row;
} run_event;

/* Everything that is given for one stretch of time, on which all inputs are linear. */
typedef struct {
    control_law law;
    double start, end; /* the run begins at the start; an end before it runs backward [s] */
    run_input from, to;
    double interval;  /* a row at each multiple of it, beside those at the steps [s]; 0: none */
    double tolerance; /* relative error of a step in each number of a row but time and torque; in
                       * place of omega that of the slip, relative to slip plus saturation slip */
    run_row scale;    /* added to the sizes of the other numbers there */
    int crossings;
    run_crossing crossing[RUN_CROSSINGS];
} run_stretch;

enum { RUN_GOES_ON, RUN_AT_END, RUN_STOPPED, RUN_FAILED };
typedef struct wheelset_run wheelset_run;

/* Begin a run from a row, whose time and torque are not used; NULL if memory is lacking. */
CONTACTLIB_API wheelset_run *wheelset_run_begin(const drivetrain_member *member,
                                                const run_stretch *given, const run_row *first);
CONTACTLIB_API void wheelset_run_free(wheelset_run *run);

/* Go on with a run whose axle is rigid, without motor lag. Writes rows, the first one too, until
 * there is no room, an event happens or the run ends; sets the status, and the
 * events of the last step if all of its rows are written. Returns the number of rows. */
CONTACTLIB_API size_t wheelset_run_rows(wheelset_run *run, size_t room, run_row *rows, int *status,
                                        size_t *count, run_event events[RUN_CROSSINGS]);

#endif

/* One instance of a model, for any version of FMI: its life cycle, variables by value reference,
 * steps, derivatives, saved states and error messages. fmi2.c and fmi3.c only translate calls to
 * these functions. */
#ifndef COMPONENT_H
#define COMPONENT_H

#include <stdint.h>

#include "model.h"
#include "rails.h"

/* The numbers of fmi2Status and fmi3Status. */
typedef enum { RESULT_OK, RESULT_WARNING, RESULT_DISCARD, RESULT_ERROR } result;

typedef enum {
    INSTANTIATED,
    INITIALIZING,
    EVENTS,     /* model exchange */
    CONTINUOUS, /* model exchange */
    STEPPING,   /* co-simulation */
    TERMINATED
} component_stage;

#define IN(stage) (1u << (stage))
#define ANY_STAGE 0xFFu
#define RUNNING (IN(EVENTS) | IN(CONTINUOUS) | IN(STEPPING))

/* Formats of the files and states that are read. */
enum { START_VALUES_VERSION = 4, STATE_VERSION = 3 };

enum { CATEGORY_COUNT = 3, FLAG_COUNT = 6, MAX_VARIABLES = 128, MAX_STATES = 256, TOKEN_SIZE = 80 };

/* Names of the log's categories, by rising severity. */
extern const char *const CATEGORIES[CATEGORY_COUNT];

typedef void component_logger(void *shell, result status, const char *category, const char *text);

/* Everything that a saved state keeps; it holds no pointer. */
typedef struct {
    double held_flags[MAX_WHEELS][FLAG_COUNT]; /* truth values between events of model exchange */
    double stop_time;                          /* infinite if the tool gave no stop time */
    double tolerance;                          /* of the integrator */
    int32_t stage;
    int32_t stale;         /* 1 until the outputs are evaluated for the present inputs */
    int32_t unsearched;    /* 1 until those of a search are too */
    model_values values[]; /* of each wheel; then the slip work on the rails of a vehicle */
} component_state;

/* A continuous state of a wheel, and its rate. */
typedef struct {
    const model_variable *variable, *rate;
    size_t wheel;
} continuous_state;

typedef struct {
    component_state *now;
    model_values *start; /* of each wheel */
    size_t wheels;
    int has_arrays; /* 1 if a variable of each wheel is one array, else each element is a variable
                     */
    unsigned char is_common[MAX_VARIABLES];  /* 1 for variables that all wheels have in common */
    unsigned char is_present[MAX_VARIABLES]; /* 1 for those that are part of this model */
    const model *model;
    char token[TOKEN_SIZE]; /* of the FMU, padded with zeros */
    creep_table table;
    void *table_bytes;
    lateral_spin_contact lateral_spin;
    creep_forces bodies;
    void *shape_bytes; /* of one of the two */
    vehicle_rails rails;
    void *rails_bytes;
    component_state *before; /* room to keep the state over a step */
    size_t states;
    continuous_state state[MAX_STATES];
    int model_exchange;
    int has_booleans; /* 0 if truth values are real numbers, 0 or 1 */
    unsigned warned;  /* one bit for each warning that is given once */
    unsigned logged;  /* one bit for each category */
    component_logger *logger;
    void *shell;
} component;

/* Make an instance of the model that the token names. resources is a URI or a path. A failure is
 * logged, and component_close must still be called. */
result component_open(component *self, int model_exchange, const char *token,
                      const char *resources);
void component_close(component *self);

/* Check that the call is allowed now; if not, log an error that names the function. */
result component_called(component *self, const char *function, unsigned allowed_stages);
/* Returns the status. */
result component_log(component *self, result status, const char *format, ...);
/* Log that the call needs what this pointer should point to. */
result component_null(component *self, const char *function, const char *pointer);
/* Enable or disable logging of these categories. Without a name all of them stay enabled: there are
 * no debugging messages, which tools disable by default. */
result component_set_logging(component *self, int on, size_t count, const char *const names[]);

result component_set_up(component *self, double start, int has_stop, double stop, int has_tolerance,
                        double tolerance);
result component_start(component *self); /* end the initialization */
void component_reset(component *self);
result component_update_flags(component *self); /* at an event */

/* Number of elements of a variable, 1 without arrays. */
size_t component_size(const component *self, unsigned reference);
size_t component_total_size(const component *self, const unsigned *references, size_t n);
/* All elements of a variable by reference; truth values are 0 or 1. */
result component_get(component *self, unsigned reference, int boolean, double *values);
/* Check all values of a call first, then set them, so that the call sets all of them or none. */
result component_check(component *self, unsigned reference, int boolean, const double *values);
void component_put(component *self, unsigned reference, const double *values);

result component_step(component *self, double point, double step);

/* Model exchange. Each array holds one double per state or per indicator, of each wheel in turn. */
size_t component_states(const component *self);
size_t component_indicators(const component *self);
result component_complete(component *self); /* a step of the solver */
result component_set_time(component *self, double time);
result component_get_states(component *self, size_t count, double *values);
result component_set_states(component *self, size_t count, const double *values);
result component_get_derivatives(component *self, size_t count, double *values);
result component_get_indicators(component *self, size_t count, double *values);
result component_get_nominals(component *self, size_t count, double *values);

/* sensitivity = (d unknowns / d knowns) seed; if adjoint, its transpose times seed. Both have one
 * number for each element of their variables. */
result component_derivative(component *self, int adjoint, const unsigned *unknowns,
                            size_t unknown_count, const unsigned *knowns, size_t known_count,
                            const double *seed, double *sensitivity);

/* Saved states. A tool keeps the pointer; NULL is a state not saved yet. */
result component_save(component *self, void **saved);
result component_restore(component *self, const void *saved);
result component_forget(component *self, void **saved);

/* Saved states as bytes, which any instance of the same FMU in any process can read. */
size_t component_serialized_size(const component *self);
result component_serialize(component *self, const void *saved, void *bytes, size_t size);
result component_deserialize(component *self, const void *bytes, size_t size, void **saved);

#endif

/* FMI 2 and FMI 3 under one name: what a tool calls of an instance. A call returns the standard's
 * status, which both versions number alike - 0 is fine, 1 a warning, 2 discarded, 3 an error - or
 * -1 where a version has no such call.
 *
 * With OPENED defined the functions are those of an FMU's library, which `open_library` opens, and
 * not those that the program is linked to. */
#ifndef FMI_H
#define FMI_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef OPENED
#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"
#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

static void *library;

static void fail(const char *what, const char *why) {
    fprintf(stderr, "%s: %s\n", what, why);
    exit(1);
}

static void open_library(const char *path) {
#ifdef _WIN32
    library = (void *)LoadLibraryA(path);
#else
    library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
#endif
    if (library == NULL) fail(path, "cannot be loaded");
}

/* C has no cast between the pointer that is found and one to a function, hence the copy. */
static void find(const char *name, void *function, size_t size) {
#ifdef _WIN32
    FARPROC found = GetProcAddress((HMODULE)library, name);
#else
    void *found = dlsym(library, name);
#endif
    if (found == NULL) fail(name, "is missing");
    memcpy(function, &found, size);
}

#define FUNCTION(name)       \
    static name##TYPE *name; \
    if (name == NULL) find(#name, (void *)&name, sizeof name)

#define FINE(call)                                 \
    do {                                           \
        if ((call) > 1) fail(#call, "is refused"); \
    } while (0)
#else
#include "fmi2Functions.h"
#include "fmi3Functions.h"
#define FUNCTION(name) (void)0
#endif

typedef struct {
    double tolerance, start, stop;
    int has_tolerance, has_stop;
} experiment;

/* ---- messages ------------------------------------------------------------------------------ */

static const char *must_say = ""; /* what every message must contain */

/* A message of an instance, for which its tool keeps a count. */
static void note(void *count, int status, const char *category, const char *message) {
    if (status < 1 || status > 3 || category[0] == '\0' || message[0] == '\0') abort();
    if (strstr(message, must_say) == NULL) abort();
    ++*(int *)count;
#ifdef OPENED
    if (strcmp(must_say, "") == 0) fprintf(stderr, "status %d: %s\n", status, message);
#endif
}

static void note2(fmi2ComponentEnvironment count, fmi2String name, fmi2Status status,
                  fmi2String category, fmi2String message, ...) {
    if (strcmp(name, "an instance") != 0) abort();
    note(count, (int)status, category, message);
}

static void note3(fmi3InstanceEnvironment count, fmi3Status status, fmi3String category,
                  fmi3String message) {
    note(count, (int)status, category, message);
}

/* ---- calls --------------------------------------------------------------------------------- */

static void *open2(int exchange, const char *token, const char *location, int logging,
                   int *messages) {
    fmi2CallbackFunctions callbacks = {note2, calloc, free, NULL, messages};
    FUNCTION(fmi2Instantiate);
    return fmi2Instantiate("an instance", exchange ? fmi2ModelExchange : fmi2CoSimulation, token,
                           location, messages != NULL ? &callbacks : NULL, 0, logging);
}

static void *open3(int exchange, const char *token, const char *location, int logging,
                   int *messages) {
    fmi3LogMessageCallback logger = messages != NULL ? note3 : NULL;
    FUNCTION(fmi3InstantiateModelExchange);
    FUNCTION(fmi3InstantiateCoSimulation);
    return exchange ? fmi3InstantiateModelExchange("an instance", token, location, 0, logging != 0,
                                                   messages, logger)
                    : fmi3InstantiateCoSimulation("an instance", token, location, 0, logging != 0,
                                                  0, 0, NULL, 0, messages, logger, NULL);
}

static void close2(void *c) {
    FUNCTION(fmi2FreeInstance);
    fmi2FreeInstance(c);
}

static void close3(void *c) {
    FUNCTION(fmi3FreeInstance);
    fmi3FreeInstance(c);
}

static int enter3(void *c, const experiment *e) {
    FUNCTION(fmi3EnterInitializationMode);
    return (int)fmi3EnterInitializationMode(c, e->has_tolerance != 0, e->tolerance, e->start,
                                            e->has_stop != 0, e->stop);
}

static int nothing_to_set_up(void *c, const experiment *e) {
    (void)c, (void)e;
    return -1; /* a part of what enters the initialization */
}

static int step3(void *c, double time, double step) {
    fmi3Boolean event, terminate = 0, early = 0;
    double last = 0.0;
    FUNCTION(fmi3DoStep);
    int status = (int)fmi3DoStep(c, time, step, 1, &event, &terminate, &early, &last);
    if (!isfinite(last) || (status <= 1 && (terminate || early))) abort();
    return status;
}

enum { MAX_BOOLEANS = 8 };

static int set_boolean3(void *c, const unsigned *of, size_t n, const int *values) {
    fmi3Boolean flags[MAX_BOOLEANS];
    for (size_t i = 0; i < n && values != NULL; i++) flags[i] = values[i] != 0;
    FUNCTION(fmi3SetBoolean);
    return (int)fmi3SetBoolean(c, of, n, values != NULL ? flags : NULL, n);
}

static int get_boolean3(void *c, const unsigned *of, size_t n, int *values) {
    fmi3Boolean flags[MAX_BOOLEANS] = {0};
    FUNCTION(fmi3GetBoolean);
    int status = (int)fmi3GetBoolean(c, of, n, values != NULL ? flags : NULL, n);
    for (size_t i = 0; i < n && values != NULL; i++) values[i] = flags[i];
    return status;
}

static int update2(void *c) {
    fmi2EventInfo info = {0};
    FUNCTION(fmi2NewDiscreteStates);
    int status = (int)fmi2NewDiscreteStates(c, &info);
    if (info.newDiscreteStatesNeeded || info.terminateSimulation) abort();
    return status;
}

static int update3(void *c) {
    fmi3Boolean b[5] = {0};
    double next;
    FUNCTION(fmi3UpdateDiscreteStates);
    int status = (int)fmi3UpdateDiscreteStates(c, b, b + 1, b + 2, b + 3, b + 4, &next);
    if (b[0] || b[1]) abort();
    return status;
}

static int completed2(void *c) {
    fmi2Boolean event = 0, terminate = 0;
    FUNCTION(fmi2CompletedIntegratorStep);
    int status = (int)fmi2CompletedIntegratorStep(c, 1, &event, &terminate);
    if (event || terminate) abort();
    return status;
}

static int completed3(void *c) {
    fmi3Boolean event = 0, terminate = 0;
    FUNCTION(fmi3CompletedIntegratorStep);
    int status = (int)fmi3CompletedIntegratorStep(c, 1, &event, &terminate);
    if (event || terminate) abort();
    return status;
}

static int derivative2(void *c, int adjoint, const unsigned *unknowns, size_t n,
                       const unsigned *knowns, size_t m, const double *seed, double *change) {
    FUNCTION(fmi2GetDirectionalDerivative);
    if (adjoint) return -1;
    return (int)fmi2GetDirectionalDerivative(c, unknowns, n, knowns, m, seed, change);
}

static int derivative3(void *c, int adjoint, const unsigned *unknowns, size_t n,
                       const unsigned *knowns, size_t m, const double *seed, double *change) {
    FUNCTION(fmi3GetDirectionalDerivative);
    FUNCTION(fmi3GetAdjointDerivative);
    return adjoint
               ? (int)fmi3GetAdjointDerivative(c, unknowns, n, knowns, m, seed, n, change, m)
               : (int)fmi3GetDirectionalDerivative(c, unknowns, n, knowns, m, seed, m, change, n);
}

/* Calls that differ in their names, and in FMI 3 in that they pass numbers of values. */
#define CALL(own, name, parameters, ...)  \
    static int own parameters {           \
        FUNCTION(name);                   \
        return (int)name(c, __VA_ARGS__); \
    }
#define PLAIN(own, name)      \
    static int own(void *c) { \
        FUNCTION(name);       \
        return (int)name(c);  \
    }
#define BOTH(own, name2, name3, parameters, ...)       \
    CALL(own##2, fmi2##name2, parameters, __VA_ARGS__) \
    CALL(own##3, fmi3##name3, parameters, __VA_ARGS__)
#define PLAIN_BOTH(own, name) PLAIN(own##2, fmi2##name) PLAIN(own##3, fmi3##name)
#define SETTER (void *c, const unsigned *of, size_t n, const double *x)
#define GETTER (void *c, const unsigned *of, size_t n, double *x)
#define STATES (void *c, double *x, size_t n)

CALL(set_up2, fmi2SetupExperiment, (void *c, const experiment *e), e->has_tolerance, e->tolerance,
     e->start, e->has_stop, e->stop)
CALL(step2, fmi2DoStep, (void *c, double time, double step), time, step, 1)
CALL(set2, fmi2SetReal, SETTER, of, n, x)
CALL(set3, fmi3SetFloat64, SETTER, of, n, x, n)
CALL(get2, fmi2GetReal, GETTER, of, n, x)
CALL(get3, fmi3GetFloat64, GETTER, of, n, x, n)
CALL(set_boolean2, fmi2SetBoolean, (void *c, const unsigned *of, size_t n, const int *x), of, n, x)
CALL(get_boolean2, fmi2GetBoolean, (void *c, const unsigned *of, size_t n, int *x), of, n, x)
BOTH(set_time, SetTime, SetTime, (void *c, double time), time)
BOTH(set_states, SetContinuousStates, SetContinuousStates, STATES, x, n)
BOTH(get_states, GetContinuousStates, GetContinuousStates, STATES, x, n)
BOTH(get_rates, GetDerivatives, GetContinuousStateDerivatives, STATES, x, n)
BOTH(get_indicators, GetEventIndicators, GetEventIndicators, STATES, x, n)
BOTH(get_nominals, GetNominalsOfContinuousStates, GetNominalsOfContinuousStates, STATES, x, n)
BOTH(save, GetFMUstate, GetFMUState, (void *c, void **saved), saved)
BOTH(restore, SetFMUstate, SetFMUState, (void *c, void *saved), saved)
BOTH(forget, FreeFMUstate, FreeFMUState, (void *c, void **saved), saved)
BOTH(size, SerializedFMUstateSize, SerializedFMUStateSize, (void *c, void *saved, size_t *size),
     saved, size)
BOTH(serialize, SerializeFMUstate, SerializeFMUState,
     (void *c, void *saved, void *bytes, size_t size), saved, bytes, size)
BOTH(deserialize, DeSerializeFMUstate, DeserializeFMUState,
     (void *c, const void *bytes, size_t size, void **saved), bytes, size, saved)
BOTH(set_logging, SetDebugLogging, SetDebugLogging,
     (void *c, int on, size_t n, const char *const *names), on != 0, n, names)
PLAIN(enter2_, fmi2EnterInitializationMode)
PLAIN_BOTH(leave, ExitInitializationMode)
PLAIN_BOTH(terminate, Terminate)
PLAIN_BOTH(reset, Reset)
PLAIN_BOTH(events, EnterEventMode)
PLAIN_BOTH(continuous, EnterContinuousTimeMode)

static int enter2(void *c, const experiment *e) {
    (void)e;
    return enter2_(c);
}

typedef struct {
    int version;
    void *(*open)(int exchange, const char *token, const char *location, int logging,
                  int *messages);
    void (*close)(void *c);
    int (*set_up)(void *c, const experiment *e);
    int (*enter)(void *c, const experiment *e); /* the initialization */
    int (*leave)(void *c);
    int (*terminate)(void *c);
    int (*reset)(void *c);
    int(*set) SETTER;
    int(*get) GETTER;
    int (*set_boolean)(void *c, const unsigned *of, size_t n, const int *x);
    int (*get_boolean)(void *c, const unsigned *of, size_t n, int *x);
    int (*step)(void *c, double time, double step);
    int (*save)(void *c, void **saved);
    int (*restore)(void *c, void *saved);
    int (*forget)(void *c, void **saved);
    int (*size)(void *c, void *saved, size_t *size);
    int (*serialize)(void *c, void *saved, void *bytes, size_t size);
    int (*deserialize)(void *c, const void *bytes, size_t size, void **saved);
    int (*derivative)(void *c, int adjoint, const unsigned *unknowns, size_t n,
                      const unsigned *knowns, size_t m, const double *seed, double *change);
    int (*set_logging)(void *c, int on, size_t n, const char *const *names);
    int (*events)(void *c);
    int (*continuous)(void *c);
    int (*update)(void *c);
    int (*completed)(void *c);
    int (*set_time)(void *c, double time);
    int(*set_states) STATES;
    int(*get_states) STATES;
    int(*get_rates) STATES;
    int(*get_indicators) STATES;
    int(*get_nominals) STATES;
} fmi;

#define OF_VERSION(v, set_up) \
    {v,                       \
     open##v,                 \
     close##v,                \
     set_up,                  \
     enter##v,                \
     leave##v,                \
     terminate##v,            \
     reset##v,                \
     set##v,                  \
     get##v,                  \
     set_boolean##v,          \
     get_boolean##v,          \
     step##v,                 \
     save##v,                 \
     restore##v,              \
     forget##v,               \
     size##v,                 \
     serialize##v,            \
     deserialize##v,          \
     derivative##v,           \
     set_logging##v,          \
     events##v,               \
     continuous##v,           \
     update##v,               \
     completed##v,            \
     set_time##v,             \
     set_states##v,           \
     get_states##v,           \
     get_rates##v,            \
     get_indicators##v,       \
     get_nominals##v}

/* The calls of version 2 or 3. */
static inline const fmi *fmi_of(int version) {
    static const fmi versions[] = {OF_VERSION(2, set_up2), OF_VERSION(3, nothing_to_set_up)};
    return &versions[version == 3];
}

/* Initialize an instance from its start values; the largest status on the way. */
static inline int start(const fmi *v, void *c, double tolerance) {
    const experiment e = {.tolerance = tolerance, .has_tolerance = tolerance > 0.0};
    int status[3] = {v->set_up(c, &e), v->enter(c, &e), v->leave(c)};
    int worst = status[0] > status[1] ? status[0] : status[1];
    return worst > status[2] ? worst : status[2];
}

#endif

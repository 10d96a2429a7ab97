/* FMI 3.0: translates calls of the standard to those of component.h. */
#include <stdlib.h>
#include <string.h>

#include "component.h"
#include "export.h"
#include "fmi3_types.h"

typedef struct {
    component core;
    fmi3LogMessageCallback logger;
    fmi3InstanceEnvironment environment;
} instance;

static void log_message(void *shell, result status, const char *category, const char *text) {
    const instance *self = shell;
    self->logger(self->environment, (fmi3Status)status, category, text);
}

/* Called for capabilities that modelDescription.xml denies and for types that no variable has. */
static fmi3Status not_offered(void *pointer, const char *function) {
    instance *self = pointer;
    if (self != NULL)
        component_log(&self->core, RESULT_ERROR, "%s: this FMU does not offer it", function);
    return fmi3Error;
}

/* A call without values is allowed, any other is an error of the tool. */
static fmi3Status none(void *pointer, size_t n, const char *function) {
    return n == 0 && pointer != NULL ? fmi3OK : not_offered(pointer, function);
}

/* Every function of an instance starts with this: it finds the instance and checks that the call is
 * allowed now. */
#define CORE(c, allowed)                                             \
    component *core = (c) != NULL ? &((instance *)(c))->core : NULL; \
    if (core == NULL || component_called(core, __func__, (allowed)) != RESULT_OK) return fmi3Error

/* Refuse a null pointer to n values. */
#define NEEDS(n, pointer) \
    if ((n) > 0 && (pointer) == NULL) return (fmi3Status)component_null(core, __func__, #pointer)

#define BEFORE_RUN (IN(INSTANTIATED) | IN(INITIALIZING))

/* ---- life ---------------------------------------------------------------------------------- */

CONTACTLIB_API const char *fmi3GetVersion(void) { return fmi3Version; }

CONTACTLIB_API void fmi3FreeInstance(fmi3Instance c) {
    instance *self = c;
    if (self == NULL) return;
    component_close(&self->core);
    free(self);
}

static fmi3Instance instantiate(int model_exchange, fmi3String token, fmi3String resources,
                                fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                fmi3LogMessageCallback logger) {
    instance *self = calloc(1, sizeof *self);
    if (self == NULL) {
        if (logger != NULL)
            logger(environment, fmi3Error, CATEGORIES[RESULT_ERROR - RESULT_WARNING],
                   "out of memory");
        return NULL;
    }
    self->core.shell = self;
    self->environment = environment;
    self->logger = logger;
    if (logger != NULL) self->core.logger = log_message;
    component_set_logging(&self->core, logging, 0, NULL);
    if (component_open(&self->core, model_exchange, token, resources) == RESULT_OK) return self;
    fmi3FreeInstance(self);
    return NULL;
}

CONTACTLIB_API fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token,
                                                         fmi3String resources, fmi3Boolean visible,
                                                         fmi3Boolean logging,
                                                         fmi3InstanceEnvironment environment,
                                                         fmi3LogMessageCallback logger) {
    (void)name, (void)visible;
    return instantiate(1, token, resources, logging, environment, logger);
}

CONTACTLIB_API fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean event_mode_used, fmi3Boolean early_return_allowed,
    const fmi3ValueReference required[], size_t required_count, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback logger, fmi3IntermediateUpdateCallback intermediate_update) {
    (void)name, (void)visible, (void)early_return_allowed, (void)required, (void)required_count;
    (void)intermediate_update;
    if (event_mode_used) {
        if (logger != NULL)
            logger(environment, fmi3Error, CATEGORIES[RESULT_ERROR - RESULT_WARNING],
                   "eventModeUsed = true must be false: co-simulation has no events here");
        return NULL;
    }
    return instantiate(0, token, resources, logging, environment, logger);
}

CONTACTLIB_API fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
    fmi3ClockUpdateCallback clock_update, fmi3LockPreemptionCallback lock,
    fmi3UnlockPreemptionCallback unlock) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)clock_update;
    (void)lock, (void)unlock;
    if (logger != NULL)
        logger(environment, fmi3Error, CATEGORIES[RESULT_ERROR - RESULT_WARNING],
               "this FMU offers model exchange and co-simulation only");
    return NULL;
}

CONTACTLIB_API fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n,
                                              const fmi3String categories[]) {
    CORE(c, ANY_STAGE);
    NEEDS(n, categories);
    return (fmi3Status)component_set_logging(core, on, n, categories);
}

CONTACTLIB_API fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance,
                                                      fmi3Float64 tolerance, fmi3Float64 start,
                                                      fmi3Boolean has_stop, fmi3Float64 stop) {
    CORE(c, IN(INSTANTIATED));
    result status = component_set_up(core, start, has_stop, stop, has_tolerance, tolerance);
    if (status == RESULT_OK) core->now.stage = INITIALIZING;
    return (fmi3Status)status;
}

CONTACTLIB_API fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    CORE(c, IN(INITIALIZING));
    return (fmi3Status)component_start(core);
}

CONTACTLIB_API fmi3Status fmi3Terminate(fmi3Instance c) {
    CORE(c, RUNNING);
    core->now.stage = TERMINATED;
    return fmi3OK;
}

CONTACTLIB_API fmi3Status fmi3Reset(fmi3Instance c) {
    CORE(c, ANY_STAGE);
    component_reset(core);
    return fmi3OK;
}

/* ---- values -------------------------------------------------------------------------------- */

static fmi3Status check_count(component *core, size_t references, size_t values) {
    if (references == values) return fmi3OK;
    component_log(core, RESULT_ERROR, "nValues = %zu must be the number of variables, %zu", values,
                  references);
    return fmi3Error;
}

/* Getter and setter of real numbers and of truth values. A setter checks all values, then puts
 * them.
 */
#define VALUES_OF(type, boolean, from_double, to_double)                                           \
    CONTACTLIB_API fmi3Status fmi3Get##type(fmi3Instance c, const fmi3ValueReference references[], \
                                            size_t n, fmi3##type values[], size_t value_count) {   \
        CORE(c, ANY_STAGE);                                                                        \
        if (check_count(core, n, value_count) != fmi3OK) return fmi3Error;                         \
        NEEDS(n, references);                                                                      \
        NEEDS(n, values);                                                                          \
        result status = RESULT_OK;                                                                 \
        for (size_t i = 0; i < n && status == RESULT_OK; i++) {                                    \
            double value = 0.0;                                                                    \
            status = component_get(core, references[i], boolean, &value);                          \
            if (status == RESULT_OK) values[i] = from_double;                                      \
        }                                                                                          \
        return (fmi3Status)status;                                                                 \
    }                                                                                              \
    CONTACTLIB_API fmi3Status fmi3Set##type(fmi3Instance c, const fmi3ValueReference references[], \
                                            size_t n, const fmi3##type values[],                   \
                                            size_t value_count) {                                  \
        CORE(c, BEFORE_RUN | RUNNING);                                                             \
        if (check_count(core, n, value_count) != fmi3OK) return fmi3Error;                         \
        NEEDS(n, references);                                                                      \
        NEEDS(n, values);                                                                          \
        result status = RESULT_OK;                                                                 \
        for (size_t i = 0; i < n && status == RESULT_OK; i++)                                      \
            status = component_check(core, references[i], boolean, to_double);                     \
        for (size_t i = 0; i < n && status == RESULT_OK; i++)                                      \
            component_put(core, references[i], to_double);                                         \
        return (fmi3Status)status;                                                                 \
    }

VALUES_OF(Float64, 0, value, values[i])
VALUES_OF(Boolean, 1, value != 0.0, values[i] ? 1.0 : 0.0)

/* No model has variables of these types. */
#define ABSENT_TYPE(type)                                                                          \
    CONTACTLIB_API fmi3Status fmi3Get##type(fmi3Instance c, const fmi3ValueReference references[], \
                                            size_t n, fmi3##type values[], size_t value_count) {   \
        (void)references, (void)values, (void)value_count;                                         \
        return none(c, n, __func__);                                                               \
    }                                                                                              \
    CONTACTLIB_API fmi3Status fmi3Set##type(fmi3Instance c, const fmi3ValueReference references[], \
                                            size_t n, const fmi3##type values[],                   \
                                            size_t value_count) {                                  \
        (void)references, (void)values, (void)value_count;                                         \
        return none(c, n, __func__);                                                               \
    }

ABSENT_TYPE(Float32)
ABSENT_TYPE(Int8)
ABSENT_TYPE(UInt8)
ABSENT_TYPE(Int16)
ABSENT_TYPE(UInt16)
ABSENT_TYPE(Int32)
ABSENT_TYPE(UInt32)
ABSENT_TYPE(Int64)
ABSENT_TYPE(UInt64)
ABSENT_TYPE(String)

CONTACTLIB_API fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference references[],
                                        size_t n, size_t sizes[], fmi3Binary values[],
                                        size_t value_count) {
    (void)references, (void)sizes, (void)values, (void)value_count;
    return none(c, n, __func__);
}

CONTACTLIB_API fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference references[],
                                        size_t n, const size_t sizes[], const fmi3Binary values[],
                                        size_t value_count) {
    (void)references, (void)sizes, (void)values, (void)value_count;
    return none(c, n, __func__);
}

CONTACTLIB_API fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c,
                                                              fmi3ValueReference reference,
                                                              size_t *n) {
    (void)reference, (void)n;
    return not_offered(c, __func__);
}

CONTACTLIB_API fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference dependent,
                                                      size_t elements[],
                                                      fmi3ValueReference independents[],
                                                      size_t independent_elements[],
                                                      fmi3DependencyKind kinds[], size_t n) {
    (void)dependent, (void)elements, (void)independents, (void)independent_elements, (void)kinds;
    (void)n;
    return not_offered(c, __func__);
}

static fmi3Status derivative(component *core, int adjoint, const fmi3ValueReference unknowns[],
                             size_t unknown_count, const fmi3ValueReference knowns[],
                             size_t known_count, const fmi3Float64 seed[], size_t seed_count,
                             fmi3Float64 sensitivity[], size_t sensitivity_count) {
    size_t given = adjoint ? unknown_count : known_count;
    size_t wanted = adjoint ? known_count : unknown_count;
    if (check_count(core, given, seed_count) != fmi3OK ||
        check_count(core, wanted, sensitivity_count) != fmi3OK)
        return fmi3Error;
    return (fmi3Status)component_derivative(core, adjoint, unknowns, unknown_count, knowns,
                                            known_count, seed, sensitivity);
}

#define DERIVATIVE(kind, adjoint)                                                            \
    CONTACTLIB_API fmi3Status fmi3Get##kind##Derivative(                                     \
        fmi3Instance c, const fmi3ValueReference unknowns[], size_t unknown_count,           \
        const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[],     \
        size_t seed_count, fmi3Float64 sensitivity[], size_t sensitivity_count) {            \
        CORE(c, IN(INITIALIZING) | RUNNING);                                                 \
        NEEDS(unknown_count, unknowns);                                                      \
        NEEDS(known_count, knowns);                                                          \
        NEEDS(seed_count, seed);                                                             \
        NEEDS(sensitivity_count, sensitivity);                                               \
        return derivative(core, adjoint, unknowns, unknown_count, knowns, known_count, seed, \
                          seed_count, sensitivity, sensitivity_count);                       \
    }

DERIVATIVE(Directional, 0)
DERIVATIVE(Adjoint, 1)

/* ---- saved states -------------------------------------------------------------------------- */

CONTACTLIB_API fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *saved) {
    CORE(c, ANY_STAGE);
    return (fmi3Status)component_save(core, saved);
}

CONTACTLIB_API fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState saved) {
    CORE(c, ANY_STAGE);
    return (fmi3Status)component_restore(core, saved);
}

CONTACTLIB_API fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *saved) {
    CORE(c, ANY_STAGE);
    return (fmi3Status)component_forget(core, saved);
}

CONTACTLIB_API fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState saved,
                                                     size_t *size) {
    CORE(c, ANY_STAGE);
    NEEDS(1, size);
    (void)saved;
    *size = component_serialized_size();
    return fmi3OK;
}

CONTACTLIB_API fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState saved,
                                                fmi3Byte bytes[], size_t size) {
    CORE(c, ANY_STAGE);
    NEEDS(1, bytes);
    return (fmi3Status)component_serialize(core, saved, bytes, size);
}

CONTACTLIB_API fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[],
                                                  size_t size, fmi3FMUState *saved) {
    CORE(c, ANY_STAGE);
    NEEDS(1, bytes);
    return (fmi3Status)component_deserialize(core, bytes, size, saved);
}

/* ---- modes and clocks that no model has ---------------------------------------------------- */

CONTACTLIB_API fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) {
    return not_offered(c, __func__);
}

CONTACTLIB_API fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) {
    return not_offered(c, __func__);
}

CONTACTLIB_API fmi3Status fmi3EnterStepMode(fmi3Instance c) { return not_offered(c, __func__); }

CONTACTLIB_API fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock,
                                                     fmi3Float64 time) {
    (void)clock, (void)time;
    return not_offered(c, __func__);
}

CONTACTLIB_API fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference references[],
                                       size_t n, fmi3Clock values[]) {
    (void)references, (void)values;
    return none(c, n, __func__);
}

CONTACTLIB_API fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference references[],
                                       size_t n, const fmi3Clock values[]) {
    (void)references, (void)values;
    return none(c, n, __func__);
}

CONTACTLIB_API fmi3Status fmi3GetIntervalDecimal(fmi3Instance c,
                                                 const fmi3ValueReference references[], size_t n,
                                                 fmi3Float64 intervals[],
                                                 fmi3IntervalQualifier qualifiers[]) {
    (void)references, (void)intervals, (void)qualifiers;
    return none(c, n, __func__);
}

CONTACTLIB_API fmi3Status fmi3GetIntervalFraction(fmi3Instance c,
                                                  const fmi3ValueReference references[], size_t n,
                                                  fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                                  fmi3IntervalQualifier qualifiers[]) {
    (void)references, (void)counters, (void)resolutions, (void)qualifiers;
    return none(c, n, __func__);
}

CONTACTLIB_API fmi3Status fmi3GetShiftDecimal(fmi3Instance c, const fmi3ValueReference references[],
                                              size_t n, fmi3Float64 shifts[]) {
    (void)references, (void)shifts;
    return none(c, n, __func__);
}

CONTACTLIB_API fmi3Status fmi3GetShiftFraction(fmi3Instance c,
                                               const fmi3ValueReference references[], size_t n,
                                               fmi3UInt64 counters[], fmi3UInt64 resolutions[]) {
    (void)references, (void)counters, (void)resolutions;
    return none(c, n, __func__);
}

CONTACTLIB_API fmi3Status fmi3SetIntervalDecimal(fmi3Instance c,
                                                 const fmi3ValueReference references[], size_t n,
                                                 const fmi3Float64 intervals[]) {
    (void)references, (void)intervals;
    return none(c, n, __func__);
}

CONTACTLIB_API fmi3Status fmi3SetIntervalFraction(fmi3Instance c,
                                                  const fmi3ValueReference references[], size_t n,
                                                  const fmi3UInt64 counters[],
                                                  const fmi3UInt64 resolutions[]) {
    (void)references, (void)counters, (void)resolutions;
    return none(c, n, __func__);
}

CONTACTLIB_API fmi3Status fmi3SetShiftDecimal(fmi3Instance c, const fmi3ValueReference references[],
                                              size_t n, const fmi3Float64 shifts[]) {
    (void)references, (void)shifts;
    return none(c, n, __func__);
}

CONTACTLIB_API fmi3Status fmi3SetShiftFraction(fmi3Instance c,
                                               const fmi3ValueReference references[], size_t n,
                                               const fmi3UInt64 counters[],
                                               const fmi3UInt64 resolutions[]) {
    (void)references, (void)counters, (void)resolutions;
    return none(c, n, __func__);
}

/* ---- model exchange ------------------------------------------------------------------------ */

CONTACTLIB_API fmi3Status fmi3EnterEventMode(fmi3Instance c) {
    CORE(c, IN(EVENTS) | IN(CONTINUOUS));
    core->now.stage = EVENTS;
    return fmi3OK;
}

CONTACTLIB_API fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) {
    CORE(c, IN(INITIALIZING) | IN(EVENTS));
    return (fmi3Status)component_update_flags(core);
}

CONTACTLIB_API fmi3Status fmi3UpdateDiscreteStates(
    fmi3Instance c, fmi3Boolean *need_update, fmi3Boolean *terminate, fmi3Boolean *nominals_changed,
    fmi3Boolean *states_changed, fmi3Boolean *has_next_time, fmi3Float64 *next_time) {
    CORE(c, IN(EVENTS));
    NEEDS(1, need_update);
    NEEDS(1, terminate);
    NEEDS(1, nominals_changed);
    NEEDS(1, states_changed);
    NEEDS(1, has_next_time);
    NEEDS(1, next_time);
    *need_update = *terminate = *nominals_changed = *states_changed = *has_next_time = fmi3False;
    *next_time = 0.0;
    return (fmi3Status)component_update_flags(core);
}

CONTACTLIB_API fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) {
    CORE(c, IN(EVENTS));
    core->now.stage = CONTINUOUS;
    return fmi3OK;
}

CONTACTLIB_API fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c,
                                                      fmi3Boolean no_set_state_before,
                                                      fmi3Boolean *enter_event_mode,
                                                      fmi3Boolean *terminate) {
    CORE(c, IN(CONTINUOUS));
    NEEDS(1, enter_event_mode);
    NEEDS(1, terminate);
    (void)no_set_state_before;
    *enter_event_mode = *terminate = fmi3False;
    return fmi3OK;
}

CONTACTLIB_API fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time) {
    CORE(c, IN(EVENTS) | IN(CONTINUOUS));
    return (fmi3Status)component_set_time(core, time);
}

/* Arrays with one number for each state or event indicator. */
#define ARRAY(function, call, allowed, kind)                                            \
    CONTACTLIB_API fmi3Status fmi3##function(fmi3Instance c, kind values[], size_t n) { \
        CORE(c, allowed);                                                               \
        NEEDS(n, values);                                                               \
        return (fmi3Status)component_##call(core, n, values);                           \
    }

ARRAY(SetContinuousStates, set_states, IN(EVENTS) | IN(CONTINUOUS), const fmi3Float64)
ARRAY(GetContinuousStates, get_states, ANY_STAGE, fmi3Float64)
ARRAY(GetContinuousStateDerivatives, get_derivatives, ANY_STAGE, fmi3Float64)
ARRAY(GetEventIndicators, get_indicators, ANY_STAGE, fmi3Float64)
ARRAY(GetNominalsOfContinuousStates, get_nominals, ANY_STAGE, fmi3Float64)

CONTACTLIB_API fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) {
    CORE(c, ANY_STAGE);
    NEEDS(1, n);
    *n = component_indicators(core);
    return fmi3OK;
}

CONTACTLIB_API fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) {
    CORE(c, ANY_STAGE);
    NEEDS(1, n);
    *n = core->states;
    return fmi3OK;
}

/* ---- co-simulation ------------------------------------------------------------------------- */

CONTACTLIB_API fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 point, fmi3Float64 step,
                                     fmi3Boolean no_set_state_before,
                                     fmi3Boolean *event_handling_needed, fmi3Boolean *terminate,
                                     fmi3Boolean *early_return, fmi3Float64 *last_successful_time) {
    CORE(c, IN(STEPPING));
    NEEDS(1, event_handling_needed);
    NEEDS(1, terminate);
    NEEDS(1, early_return);
    NEEDS(1, last_successful_time);
    (void)no_set_state_before;
    *event_handling_needed = *terminate = *early_return = fmi3False;
    result status = component_step(core, point, step);
    *last_successful_time = core->now.values.time;
    return (fmi3Status)status;
}

CONTACTLIB_API fmi3Status fmi3GetOutputDerivatives(fmi3Instance c,
                                                   const fmi3ValueReference references[], size_t n,
                                                   const fmi3Int32 orders[], fmi3Float64 values[],
                                                   size_t value_count) {
    (void)references, (void)orders, (void)values, (void)value_count;
    return none(c, n, __func__);
}

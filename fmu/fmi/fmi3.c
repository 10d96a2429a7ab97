/* FMI 3.0: translates calls of the standard to those of component.h. */
#include "component.h"
#include "fmi3_types.h"

typedef struct {
    component core;
    fmi3LogMessageCallback logger;
    fmi3InstanceEnvironment environment;
} instance;

#define FMI(name) fmi3##name
#define INSTANCE fmi3Instance
#define SAVED fmi3FMUState
#define STATUS(status) ((fmi3Status)(status))
#define DISCARDED STATUS
#include "fmi_calls.inc"

static void log_message(void *shell, result status, const char *category, const char *text) {
    const instance *self = shell;
    self->logger(self->environment, (fmi3Status)status, category, text);
}

/* ---- life ---------------------------------------------------------------------------------- */

CONTACTLIB_API const char *fmi3GetVersion(void) { return fmi3Version; }

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
    self->core.has_arrays = 1;
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
    return instantiate(1, token, resources, logging, environment, logger);
}

CONTACTLIB_API fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean event_mode_used, fmi3Boolean early_return_allowed,
    const fmi3ValueReference required[], size_t required_count, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback logger, fmi3IntermediateUpdateCallback intermediate_update) {
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
    if (logger != NULL)
        logger(environment, fmi3Error, CATEGORIES[RESULT_ERROR - RESULT_WARNING],
               "this FMU offers model exchange and co-simulation only");
    return NULL;
}

CALL(EnterInitializationMode, fmi3Boolean has_tolerance, fmi3Float64 tolerance, fmi3Float64 start,
     fmi3Boolean has_stop, fmi3Float64 stop) {
    CORE(c, IN(INSTANTIATED));
    result status = component_set_up(core, start, has_stop, stop, has_tolerance, tolerance);
    if (status == RESULT_OK) core->now->stage = INITIALIZING;
    return STATUS(status);
}

/* ---- values -------------------------------------------------------------------------------- */

static fmi3Status check_count(component *core, const fmi3ValueReference references[], size_t n,
                              size_t values) {
    size_t expected = component_total_size(core, references, n);
    if (expected == values) return fmi3OK;
    return STATUS(component_log(core, RESULT_ERROR,
                                "nValues = %zu must be the number of the variables' values, %zu",
                                values, expected));
}

#define COUNTED , size_t value_count
#define CHECK_COUNT \
    if (check_count(core, references, n, value_count) != fmi3OK) return fmi3Error

VALUES_OF(Float64, 0, STATUS, number[k], *value, COUNTED, CHECK_COUNT)
VALUES_OF(Boolean, 1, STATUS, number[k] != 0.0, *value, COUNTED, CHECK_COUNT)

#define ABSENT_TYPE(type)                                       \
    OF_NONE(Get##type, REFERENCES, fmi3##type values[] COUNTED) \
    OF_NONE(Set##type, REFERENCES, const fmi3##type values[] COUNTED)

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
OF_NONE(GetBinary, REFERENCES, size_t sizes[], fmi3Binary values[] COUNTED)
OF_NONE(SetBinary, REFERENCES, const size_t sizes[], const fmi3Binary values[] COUNTED)

NOT_OFFERED(GetNumberOfVariableDependencies, fmi3ValueReference reference, size_t *n)
NOT_OFFERED(GetVariableDependencies, fmi3ValueReference dependent, size_t elements[],
            fmi3ValueReference independents[], size_t independent_elements[],
            fmi3DependencyKind kinds[], size_t n)

static fmi3Status derivative(component *core, int adjoint, const fmi3ValueReference unknowns[],
                             size_t unknown_count, const fmi3ValueReference knowns[],
                             size_t known_count, const fmi3Float64 seed[], size_t seed_count,
                             fmi3Float64 sensitivity[], size_t sensitivity_count) {
    size_t of_unknowns = adjoint ? seed_count : sensitivity_count;
    size_t of_knowns = adjoint ? sensitivity_count : seed_count;
    if (check_count(core, unknowns, unknown_count, of_unknowns) != fmi3OK ||
        check_count(core, knowns, known_count, of_knowns) != fmi3OK)
        return fmi3Error;
    return (fmi3Status)component_derivative(core, adjoint, unknowns, unknown_count, knowns,
                                            known_count, seed, sensitivity);
}

#define DERIVATIVE(kind, adjoint)                                                            \
    CALL(Get##kind##Derivative, const fmi3ValueReference unknowns[], size_t unknown_count,   \
         const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[],    \
         size_t seed_count, fmi3Float64 sensitivity[], size_t sensitivity_count) {           \
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

SAVED_STATES(FMUState, Deserialize)

/* ---- modes and clocks that no model has ---------------------------------------------------- */

CALL_ALONE(EnterConfigurationMode) { return not_offered(c, __func__); }
CALL_ALONE(ExitConfigurationMode) { return not_offered(c, __func__); }
CALL_ALONE(EnterStepMode) { return not_offered(c, __func__); }
NOT_OFFERED(ActivateModelPartition, fmi3ValueReference clock, fmi3Float64 time)
OF_NONE(GetClock, REFERENCES, fmi3Clock values[])
OF_NONE(SetClock, REFERENCES, const fmi3Clock values[])
OF_NONE(GetIntervalDecimal, REFERENCES, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
OF_NONE(GetIntervalFraction, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
        fmi3IntervalQualifier qualifiers[])
OF_NONE(GetShiftDecimal, REFERENCES, fmi3Float64 shifts[])
OF_NONE(GetShiftFraction, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
OF_NONE(SetIntervalDecimal, REFERENCES, const fmi3Float64 intervals[])
OF_NONE(SetIntervalFraction, REFERENCES, const fmi3UInt64 counters[],
        const fmi3UInt64 resolutions[])
OF_NONE(SetShiftDecimal, REFERENCES, const fmi3Float64 shifts[])
OF_NONE(SetShiftFraction, REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])

/* ---- model exchange ------------------------------------------------------------------------ */

ARRAY(GetContinuousStateDerivatives, get_derivatives, ANY_STAGE, fmi3Float64)

CALL_ALONE(EvaluateDiscreteStates) {
    CORE(c, IN(INITIALIZING) | IN(EVENTS));
    return STATUS(component_update_flags(core));
}

CALL(UpdateDiscreteStates, fmi3Boolean *need_update, fmi3Boolean *terminate,
     fmi3Boolean *nominals_changed, fmi3Boolean *states_changed, fmi3Boolean *has_next_time,
     fmi3Float64 *next_time) {
    CORE(c, IN(EVENTS));
    NEEDS(1, need_update);
    NEEDS(1, terminate);
    NEEDS(1, nominals_changed);
    NEEDS(1, states_changed);
    NEEDS(1, has_next_time);
    NEEDS(1, next_time);
    *need_update = *terminate = *nominals_changed = *states_changed = *has_next_time = fmi3False;
    *next_time = 0.0;
    return STATUS(component_update_flags(core));
}

/* Numbers of arrays' elements. */
#define NUMBER(name, number) \
    CALL(name, size_t *n) {  \
        CORE(c, ANY_STAGE);  \
        NEEDS(1, n);         \
        *n = number;         \
        return fmi3OK;       \
    }

NUMBER(GetNumberOfEventIndicators, component_indicators(core))
NUMBER(GetNumberOfContinuousStates, component_states(core))

/* ---- co-simulation ------------------------------------------------------------------------- */

CALL(DoStep, fmi3Float64 point, fmi3Float64 step, fmi3Boolean no_set_state_before,
     fmi3Boolean *event_handling_needed, fmi3Boolean *terminate, fmi3Boolean *early_return,
     fmi3Float64 *last_successful_time) {
    CORE(c, IN(STEPPING));
    NEEDS(1, event_handling_needed);
    NEEDS(1, terminate);
    NEEDS(1, early_return);
    NEEDS(1, last_successful_time);
    *event_handling_needed = *terminate = *early_return = fmi3False;
    result status = component_step(core, point, step);
    *last_successful_time = core->now->values->time;
    return STATUS(status);
}

OF_NONE(GetOutputDerivatives, REFERENCES, const fmi3Int32 orders[], fmi3Float64 values[] COUNTED)

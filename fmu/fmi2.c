/* FMI 2.0: translates calls of the standard to those of component.h. */
#include <stdlib.h>
#include <string.h>

#include "component.h"
#include "export.h"
#include "fmi2_types.h"

typedef struct {
    component core;
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
    char name[];
} instance;

/* The logger takes a printf format. The text is complete, as not every tool formats it, and percent
 * signs are doubled for the tools that do. */
static void log_message(void *shell, result status, const char *category, const char *text) {
    const instance *self = shell;
    char escaped[2 * 8192];
    size_t n = 0;
    for (const char *c = text; *c != '\0' && n + 3 < sizeof escaped; c++) {
        if (*c == '%') escaped[n++] = '%';
        escaped[n++] = *c;
    }
    escaped[n] = '\0';
    self->logger(self->environment, self->name, (fmi2Status)status, category, escaped);
}

/* Called for capabilities that modelDescription.xml denies and for types that no variable has. */
static fmi2Status not_offered(void *pointer, const char *function) {
    instance *self = pointer;
    if (self != NULL)
        component_log(&self->core, RESULT_ERROR, "%s: this FMU does not offer it", function);
    return fmi2Error;
}

/* Every function of an instance starts with this: it finds the instance and checks that the call is
 * allowed now. */
#define CORE(c, allowed)                                             \
    component *core = (c) != NULL ? &((instance *)(c))->core : NULL; \
    if (core == NULL || component_called(core, __func__, (allowed)) != RESULT_OK) return fmi2Error

/* Refuse a null pointer to n values. */
#define NEEDS(n, pointer) \
    if ((n) > 0 && (pointer) == NULL) return (fmi2Status)component_null(core, __func__, #pointer)

/* FMI 2 allows fmi2Discard in few functions; elsewhere the same failure is an error. */
static fmi2Status undiscarded(result status) {
    return status == RESULT_DISCARD ? fmi2Error : (fmi2Status)status;
}

#define BEFORE_RUN (IN(INSTANTIATED) | IN(INITIALIZING))

/* ---- life ---------------------------------------------------------------------------------- */

CONTACTLIB_API const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

CONTACTLIB_API const char *fmi2GetVersion(void) { return fmi2Version; }

CONTACTLIB_API void fmi2FreeInstance(fmi2Component c) {
    instance *self = c;
    if (self == NULL) return;
    component_close(&self->core);
    free(self);
}

CONTACTLIB_API fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid,
                                             fmi2String resource_location,
                                             const fmi2CallbackFunctions *functions,
                                             fmi2Boolean visible, fmi2Boolean logging) {
    (void)visible;
    const char *given = name != NULL ? name : "";
    fmi2CallbackLogger logger = functions != NULL ? functions->logger : NULL;
    instance *self = calloc(1, sizeof *self + strlen(given) + 1);
    if (self == NULL) {
        if (logger != NULL)
            logger(functions->componentEnvironment, given, fmi2Error,
                   CATEGORIES[RESULT_ERROR - RESULT_WARNING], "out of memory");
        return NULL;
    }
    strcpy(self->name, given);
    self->core.shell = self;
    if (logger != NULL) {
        self->logger = logger;
        self->environment = functions->componentEnvironment;
        self->core.logger = log_message;
    }
    component_set_logging(&self->core, logging != fmi2False, 0, NULL);
    if (component_open(&self->core, type == fmi2ModelExchange, guid, resource_location) ==
        RESULT_OK)
        return self;
    fmi2FreeInstance(self);
    return NULL;
}

CONTACTLIB_API fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n,
                                              const fmi2String categories[]) {
    CORE(c, ANY_STAGE);
    NEEDS(n, categories);
    return (fmi2Status)component_set_logging(core, on != fmi2False, n, categories);
}

CONTACTLIB_API fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance,
                                              fmi2Real tolerance, fmi2Real start,
                                              fmi2Boolean has_stop, fmi2Real stop) {
    CORE(c, IN(INSTANTIATED));
    return (fmi2Status)component_set_up(core, start, has_stop, stop, has_tolerance, tolerance);
}

CONTACTLIB_API fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    CORE(c, IN(INSTANTIATED));
    core->now.stage = INITIALIZING;
    return fmi2OK;
}

CONTACTLIB_API fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    CORE(c, IN(INITIALIZING));
    return undiscarded(component_start(core));
}

CONTACTLIB_API fmi2Status fmi2Terminate(fmi2Component c) {
    CORE(c, RUNNING);
    core->now.stage = TERMINATED;
    return fmi2OK;
}

CONTACTLIB_API fmi2Status fmi2Reset(fmi2Component c) {
    CORE(c, ANY_STAGE);
    component_reset(core);
    return fmi2OK;
}

/* ---- values -------------------------------------------------------------------------------- */

/* Getter and setter of real numbers and of truth values. A setter checks all values, then puts
 * them.
 */
#define VALUES_OF(type, boolean, may_discard, from_double, to_double)                            \
    CONTACTLIB_API fmi2Status fmi2Get##type(                                                     \
        fmi2Component c, const fmi2ValueReference references[], size_t n, fmi2##type values[]) { \
        CORE(c, ANY_STAGE);                                                                      \
        NEEDS(n, references);                                                                    \
        NEEDS(n, values);                                                                        \
        result status = RESULT_OK;                                                               \
        for (size_t i = 0; i < n && status == RESULT_OK; i++) {                                  \
            double value = 0.0;                                                                  \
            status = component_get(core, references[i], boolean, &value);                        \
            if (status == RESULT_OK) values[i] = from_double;                                    \
        }                                                                                        \
        return may_discard ? (fmi2Status)status : undiscarded(status);                           \
    }                                                                                            \
    CONTACTLIB_API fmi2Status fmi2Set##type(fmi2Component c,                                     \
                                            const fmi2ValueReference references[], size_t n,     \
                                            const fmi2##type values[]) {                         \
        CORE(c, BEFORE_RUN | RUNNING);                                                           \
        NEEDS(n, references);                                                                    \
        NEEDS(n, values);                                                                        \
        result status = RESULT_OK;                                                               \
        for (size_t i = 0; i < n && status == RESULT_OK; i++)                                    \
            status = component_check(core, references[i], boolean, to_double);                   \
        for (size_t i = 0; i < n && status == RESULT_OK; i++)                                    \
            component_put(core, references[i], to_double);                                       \
        return (fmi2Status)status;                                                               \
    }

VALUES_OF(Real, 0, core->model_exchange, value, values[i])
VALUES_OF(Boolean, 1, 0, value != 0.0 ? fmi2True : fmi2False, values[i] != fmi2False ? 1.0 : 0.0)

/* No model has variables of these types: only a call without values is allowed. */
#define ABSENT_TYPE(type)                                                                        \
    CONTACTLIB_API fmi2Status fmi2Get##type(                                                     \
        fmi2Component c, const fmi2ValueReference references[], size_t n, fmi2##type values[]) { \
        (void)references, (void)values;                                                          \
        return n == 0 && c != NULL ? fmi2OK : not_offered(c, __func__);                          \
    }                                                                                            \
    CONTACTLIB_API fmi2Status fmi2Set##type(fmi2Component c,                                     \
                                            const fmi2ValueReference references[], size_t n,     \
                                            const fmi2##type values[]) {                         \
        (void)references, (void)values;                                                          \
        return n == 0 && c != NULL ? fmi2OK : not_offered(c, __func__);                          \
    }

ABSENT_TYPE(Integer)
ABSENT_TYPE(String)

CONTACTLIB_API fmi2Status fmi2GetDirectionalDerivative(fmi2Component c,
                                                       const fmi2ValueReference unknowns[],
                                                       size_t unknown_count,
                                                       const fmi2ValueReference knowns[],
                                                       size_t known_count, const fmi2Real seed[],
                                                       fmi2Real sensitivity[]) {
    CORE(c, IN(INITIALIZING) | RUNNING);
    NEEDS(unknown_count, unknowns);
    NEEDS(known_count, knowns);
    NEEDS(known_count, seed);
    NEEDS(unknown_count, sensitivity);
    return undiscarded(component_derivative(core, 0, unknowns, unknown_count, knowns, known_count,
                                            seed, sensitivity));
}

/* ---- saved states -------------------------------------------------------------------------- */

CONTACTLIB_API fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *saved) {
    CORE(c, ANY_STAGE);
    return (fmi2Status)component_save(core, saved);
}

CONTACTLIB_API fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate saved) {
    CORE(c, ANY_STAGE);
    return (fmi2Status)component_restore(core, saved);
}

CONTACTLIB_API fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *saved) {
    CORE(c, ANY_STAGE);
    return (fmi2Status)component_forget(core, saved);
}

CONTACTLIB_API fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate saved,
                                                     size_t *size) {
    CORE(c, ANY_STAGE);
    NEEDS(1, size);
    (void)saved;
    *size = component_serialized_size();
    return fmi2OK;
}

CONTACTLIB_API fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate saved,
                                                fmi2Byte bytes[], size_t size) {
    CORE(c, ANY_STAGE);
    NEEDS(1, bytes);
    return (fmi2Status)component_serialize(core, saved, bytes, size);
}

CONTACTLIB_API fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[],
                                                  size_t size, fmi2FMUstate *saved) {
    CORE(c, ANY_STAGE);
    NEEDS(1, bytes);
    return (fmi2Status)component_deserialize(core, bytes, size, saved);
}

/* ---- model exchange ------------------------------------------------------------------------ */

CONTACTLIB_API fmi2Status fmi2EnterEventMode(fmi2Component c) {
    CORE(c, IN(EVENTS) | IN(CONTINUOUS));
    core->now.stage = EVENTS;
    return fmi2OK;
}

CONTACTLIB_API fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    CORE(c, IN(EVENTS));
    NEEDS(1, info);
    memset(info, 0, sizeof *info); /* no further iteration, no termination, no change */
    return undiscarded(component_update_flags(core));
}

CONTACTLIB_API fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
    CORE(c, IN(EVENTS));
    core->now.stage = CONTINUOUS;
    return fmi2OK;
}

CONTACTLIB_API fmi2Status fmi2CompletedIntegratorStep(fmi2Component c,
                                                      fmi2Boolean no_set_state_before,
                                                      fmi2Boolean *enter_event_mode,
                                                      fmi2Boolean *terminate) {
    CORE(c, IN(CONTINUOUS));
    NEEDS(1, enter_event_mode);
    NEEDS(1, terminate);
    (void)no_set_state_before;
    *enter_event_mode = *terminate = fmi2False;
    return fmi2OK;
}

CONTACTLIB_API fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    CORE(c, IN(EVENTS) | IN(CONTINUOUS));
    return (fmi2Status)component_set_time(core, time);
}

/* Arrays with one number for each state or event indicator. */
#define ARRAY(function, call, allowed, kind)                                             \
    CONTACTLIB_API fmi2Status fmi2##function(fmi2Component c, kind values[], size_t n) { \
        CORE(c, allowed);                                                                \
        NEEDS(n, values);                                                                \
        return (fmi2Status)component_##call(core, n, values);                            \
    }

ARRAY(SetContinuousStates, set_states, IN(EVENTS) | IN(CONTINUOUS), const fmi2Real)
ARRAY(GetContinuousStates, get_states, ANY_STAGE, fmi2Real)
ARRAY(GetDerivatives, get_derivatives, ANY_STAGE, fmi2Real)
ARRAY(GetEventIndicators, get_indicators, ANY_STAGE, fmi2Real)
ARRAY(GetNominalsOfContinuousStates, get_nominals, ANY_STAGE, fmi2Real)

/* ---- co-simulation ------------------------------------------------------------------------- */

CONTACTLIB_API fmi2Status fmi2DoStep(fmi2Component c, fmi2Real point, fmi2Real step,
                                     fmi2Boolean no_set_state_before) {
    CORE(c, IN(STEPPING));
    (void)no_set_state_before;
    return (fmi2Status)component_step(core, point, step);
}

CONTACTLIB_API fmi2Status fmi2CancelStep(fmi2Component c) { return not_offered(c, __func__); }

CONTACTLIB_API fmi2Status fmi2SetRealInputDerivatives(fmi2Component c,
                                                      const fmi2ValueReference references[],
                                                      size_t n, const fmi2Integer order[],
                                                      const fmi2Real values[]) {
    (void)references, (void)order, (void)values;
    return n == 0 && c != NULL ? fmi2OK : not_offered(c, __func__);
}

CONTACTLIB_API fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c,
                                                       const fmi2ValueReference references[],
                                                       size_t n, const fmi2Integer order[],
                                                       fmi2Real values[]) {
    (void)references, (void)order, (void)values;
    return n == 0 && c != NULL ? fmi2OK : not_offered(c, __func__);
}

/* A step ends before fmi2DoStep returns, so only the time of the last one can be asked for. */
CONTACTLIB_API fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind,
                                            fmi2Real *value) {
    CORE(c, ANY_STAGE);
    NEEDS(1, value);
    if (kind != fmi2LastSuccessfulTime) return not_offered(c, __func__);
    *value = core->now.values.time;
    return fmi2OK;
}

CONTACTLIB_API fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind,
                                        fmi2Status *value) {
    (void)kind, (void)value;
    return not_offered(c, __func__);
}

CONTACTLIB_API fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind,
                                               fmi2Integer *value) {
    (void)kind, (void)value;
    return not_offered(c, __func__);
}

CONTACTLIB_API fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind,
                                               fmi2Boolean *value) {
    CORE(c, ANY_STAGE);
    NEEDS(1, value);
    if (kind != fmi2Terminated) return not_offered(c, __func__);
    *value = fmi2False; /* this FMU never terminates a simulation */
    return fmi2OK;
}

CONTACTLIB_API fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind,
                                              fmi2String *value) {
    (void)kind, (void)value;
    return not_offered(c, __func__);
}

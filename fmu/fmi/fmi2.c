/* FMI 2.0: translates calls of the standard to those of component.h. */
#include "component.h"
#include "fmi2_types.h"

typedef struct {
    component core;
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
    char name[];
} instance;

#define FMI(name) fmi2##name
#define INSTANCE fmi2Component
#define SAVED fmi2FMUstate
#define STATUS(status) ((fmi2Status)(status))
#define DISCARDED(status) undiscarded(status)

/* FMI 2 allows fmi2Discard in few functions; elsewhere the same failure is an error. */
static fmi2Status undiscarded(result status) {
    return status == RESULT_DISCARD ? fmi2Error : (fmi2Status)status;
}

#include "fmi_calls.inc"

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

/* ---- life ---------------------------------------------------------------------------------- */

CONTACTLIB_API const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

CONTACTLIB_API const char *fmi2GetVersion(void) { return fmi2Version; }

CONTACTLIB_API fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid,
                                             fmi2String resource_location,
                                             const fmi2CallbackFunctions *functions,
                                             fmi2Boolean visible, fmi2Boolean logging) {
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

CALL(SetupExperiment, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
     fmi2Boolean has_stop, fmi2Real stop) {
    CORE(c, IN(INSTANTIATED));
    return STATUS(component_set_up(core, start, has_stop, stop, has_tolerance, tolerance));
}

STAGE(EnterInitializationMode, IN(INSTANTIATED), INITIALIZING)

/* ---- values -------------------------------------------------------------------------------- */

#define IF_EXCHANGED(status) (core->model_exchange ? STATUS(status) : undiscarded(status))
VALUES_OF(Real, 0, IF_EXCHANGED, number[k], *value, , )
VALUES_OF(Boolean, 1, undiscarded, number[k] != 0.0, *value != fmi2False, , )

#define ABSENT_TYPE(type)                               \
    OF_NONE(Get##type, REFERENCES, fmi2##type values[]) \
    OF_NONE(Set##type, REFERENCES, const fmi2##type values[])

ABSENT_TYPE(Integer)
ABSENT_TYPE(String)

CALL(GetDirectionalDerivative, const fmi2ValueReference unknowns[], size_t unknown_count,
     const fmi2ValueReference knowns[], size_t known_count, const fmi2Real seed[],
     fmi2Real sensitivity[]) {
    CORE(c, IN(INITIALIZING) | RUNNING);
    NEEDS(unknown_count, unknowns);
    NEEDS(known_count, knowns);
    NEEDS(known_count, seed);
    NEEDS(unknown_count, sensitivity);
    return undiscarded(component_derivative(core, 0, unknowns, unknown_count, knowns, known_count,
                                            seed, sensitivity));
}

SAVED_STATES(FMUstate, DeSerialize)

/* ---- model exchange ------------------------------------------------------------------------ */

ARRAY(GetDerivatives, get_derivatives, ANY_STAGE, fmi2Real)

CALL(NewDiscreteStates, fmi2EventInfo *info) {
    CORE(c, IN(EVENTS));
    NEEDS(1, info);
    memset(info, 0, sizeof *info); /* no further iteration, no termination, no change */
    return undiscarded(component_update_flags(core));
}

/* ---- co-simulation ------------------------------------------------------------------------- */

CALL(DoStep, fmi2Real point, fmi2Real step, fmi2Boolean no_set_state_before) {
    CORE(c, IN(STEPPING));
    return STATUS(component_step(core, point, step));
}

CALL_ALONE(CancelStep) { return not_offered(c, __func__); }

OF_NONE(SetRealInputDerivatives, REFERENCES, const fmi2Integer order[], const fmi2Real values[])
OF_NONE(GetRealOutputDerivatives, REFERENCES, const fmi2Integer order[], fmi2Real values[])

/* A step ends before fmi2DoStep returns, so only the time of the last one can be requested. */
CALL(GetRealStatus, const fmi2StatusKind kind, fmi2Real *value) {
    CORE(c, ANY_STAGE);
    NEEDS(1, value);
    if (kind != fmi2LastSuccessfulTime) return not_offered(c, __func__);
    *value = core->now->values->time;
    return fmi2OK;
}

CALL(GetBooleanStatus, const fmi2StatusKind kind, fmi2Boolean *value) {
    CORE(c, ANY_STAGE);
    NEEDS(1, value);
    if (kind != fmi2Terminated) return not_offered(c, __func__);
    *value = fmi2False; /* this FMU never terminates a simulation */
    return fmi2OK;
}

NOT_OFFERED(GetStatus, const fmi2StatusKind kind, fmi2Status *value)
NOT_OFFERED(GetIntegerStatus, const fmi2StatusKind kind, fmi2Integer *value)
NOT_OFFERED(GetStringStatus, const fmi2StatusKind kind, fmi2String *value)

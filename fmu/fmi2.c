/* FMI 2.0 co-simulation shell of the force element. It holds no contact mechanics: it moves
 * values in and out of a force_element and evaluates it when an output is asked for. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "checked_file.h"
#include "fmi2Functions.h"
#include "force_element.h"
#include "resource.h"
#include "token.h"

typedef enum { INSTANTIATED, INITIALIZING, STEPPING, TERMINATED } stage;

/* All that fmi2GetFMUstate keeps. */
typedef struct {
    force_element element;
    double time;
    stage stage;
    int stale; /* outputs do not belong to the inputs yet */
} state;

typedef struct {
    state now;
    force_element start;
    creep_table table;
    void *table_bytes;
    char *name;
    int logging;
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
} instance;

enum { MESSAGE_SIZE = 8192, START_VALUES_VERSION = 1 };

/* The logger takes a printf format, but not every tool formats it: the text is made here, with
 * percent signs doubled for those that do. */
static void log_message(const instance *self, fmi2Status status, const char *format, ...) {
    char text[MESSAGE_SIZE], escaped[2 * MESSAGE_SIZE];
    size_t n = 0;
    va_list arguments;
    if (self->logger == NULL || (status < fmi2Discard && !self->logging)) return;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    for (const char *c = text; *c != '\0'; c++) {
        if (*c == '%') escaped[n++] = '%';
        escaped[n++] = *c;
    }
    escaped[n] = '\0';
    self->logger(self->environment, self->name, status,
                 status < fmi2Discard ? "logStatusWarning" : "logStatusError", escaped);
}

/* ---- life of an instance ------------------------------------------------------------------- */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return fmi2Version; }

/* Parameters and inputs, in the order of the list of variables. */
static const char *read_start_values(force_element *element, const void *bytes, size_t size) {
    size_t count, wanted = 0, at = CHECKED_FILE_FRAME;
    const model_variable *variables = force_element_variables(&count);
    const char *error = checked_file_error(bytes, size, "CREEPVAL", START_VALUES_VERSION);
    if (error != NULL) return error;
    for (size_t i = 0; i < count; i++) wanted += variables[i].role != OUTPUT;
    if (size != at + wanted * sizeof(double)) return "the file holds another number of values";
    for (size_t i = 0; i < count; i++) {
        if (variables[i].role == OUTPUT) continue;
        memcpy((char *)element + variables[i].offset, (const char *)bytes + at, sizeof(double));
        at += sizeof(double);
    }
    return NULL;
}

static int load_resources(instance *self, const char *location) {
    char text[MESSAGE_SIZE];
    const char *file = "creep_table.bin", *error;
    void *values = NULL;
    size_t size;
    error = resource_read(location, file, &self->table_bytes, &size, text, sizeof text);
    if (error == NULL) error = creep_table_open(&self->table, self->table_bytes, size);
    if (error == NULL) {
        file = "start_values.bin";
        error = resource_read(location, file, &values, &size, text, sizeof text);
        if (error == NULL) error = read_start_values(&self->start, values, size);
        free(values);
    }
    if (error != NULL) log_message(self, fmi2Error, "resource %s: %s", file, error);
    return error == NULL;
}

static void restart(instance *self) {
    self->now = (state){.element = self->start, .stage = INSTANTIATED, .stale = 1};
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid,
                              fmi2String resource_location, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean logging) {
    (void)visible;
    instance *self = calloc(1, sizeof *self);
    if (self == NULL) return NULL;
    if (functions != NULL) {
        self->logger = functions->logger;
        self->environment = functions->componentEnvironment;
    }
    self->logging = logging;
    const char *given = name != NULL ? name : "";
    self->name = malloc(strlen(given) + 1);
    int usable = 0;
    if (self->name != NULL) {
        strcpy(self->name, given);
        if (type != fmi2CoSimulation)
            log_message(self, fmi2Error, "this FMU offers co-simulation only");
        else if (guid == NULL || strcmp(guid, CONTACTLIB_TOKEN) != 0)
            log_message(self, fmi2Error, "guid %s is not this library's %s",
                        guid != NULL ? guid : "(null)", CONTACTLIB_TOKEN);
        else usable = load_resources(self, resource_location);
    }
    if (!usable) {
        fmi2FreeInstance(self);
        return NULL;
    }
    restart(self);
    return self;
}

void fmi2FreeInstance(fmi2Component component) {
    instance *self = component;
    if (self == NULL) return;
    free(self->table_bytes);
    free(self->name);
    free(self);
}

/* Every other function starts with this: what it may be called in, and who calls. */
static fmi2Status called(instance *self, const char *function, unsigned allowed) {
    if (self == NULL) return fmi2Error;
    if (allowed >> self->now.stage & 1u) return fmi2OK;
    log_message(self, fmi2Error, "%s is not allowed in this state of the FMU", function);
    return fmi2Error;
}

#define IN(a) (1u << (a))
#define ANY_STAGE (IN(INSTANTIATED) | IN(INITIALIZING) | IN(STEPPING) | IN(TERMINATED))
#define CHECK_CALL(self, allowed)                                            \
    do {                                                                     \
        if (called((self), __func__, (allowed)) != fmi2OK) return fmi2Error; \
    } while (0)

fmi2Status fmi2SetDebugLogging(fmi2Component component, fmi2Boolean on, size_t n,
                               const fmi2String categories[]) {
    (void)n, (void)categories;
    instance *self = component;
    CHECK_CALL(self, ANY_STAGE);
    self->logging = on;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean has_tolerance,
                               fmi2Real tolerance, fmi2Real start, fmi2Boolean has_stop,
                               fmi2Real stop) {
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    instance *self = component;
    CHECK_CALL(self, IN(INSTANTIATED));
    if (!isfinite(start)) {
        log_message(self, fmi2Error, "start time = %g must be finite", start);
        return fmi2Error;
    }
    self->now.time = start;
    return fmi2OK;
}

static fmi2Status check_values(const instance *self, variable_role role) {
    const model_variable *v = force_element_invalid(&self->now.element, role);
    if (v == NULL) return fmi2OK;
    double value;
    memcpy(&value, (const char *)&self->now.element + v->offset, sizeof value);
    log_message(self, fmi2Error, "%s = %g is out of range: must be from %g to %g (%s)", v->name,
                value, v->minimum, v->maximum, v->description);
    return fmi2Error;
}

static fmi2Status evaluate(instance *self) {
    state *now = &self->now;
    if (!now->stale) return fmi2OK;
    for (int role = FIXED_PARAMETER; role <= INPUT; role++)
        if (check_values(self, (variable_role)role) != fmi2OK) return fmi2Error;
    double held = self->table.static_to_kinetic;
    double ratio =
        now->element.parameters.static_friction / now->element.parameters.kinetic_friction;
    if (held > 0.0 && !(fabs(ratio - held) <= 1e-9 * held)) {
        log_message(self, fmi2Error,
                    "static_friction / kinetic_friction = %.10g must be %.10g, the one ratio that "
                    "the table's law holds for",
                    ratio, held);
        return fmi2Error;
    }
    force_element_evaluate(&self->table, &now->element.parameters, &now->element.input,
                           &now->element.output);
    now->stale = 0;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component component) {
    instance *self = component;
    CHECK_CALL(self, IN(INSTANTIATED));
    self->now.stage = INITIALIZING;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component component) {
    instance *self = component;
    CHECK_CALL(self, IN(INITIALIZING));
    if (evaluate(self) != fmi2OK) return fmi2Error;
    double zone = self->now.element.output.process_zone_ratio;
    if (zone > 0.5)
        log_message(self, fmi2Warning,
                    "process_zone_ratio = %g is above 0.5: the law's limit of a small weakening "
                    "zone is left",
                    zone);
    self->now.stage = STEPPING;
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component component) {
    instance *self = component;
    CHECK_CALL(self, IN(STEPPING));
    self->now.stage = TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component component) {
    instance *self = component;
    CHECK_CALL(self, ANY_STAGE);
    restart(self);
    return fmi2OK;
}

/* ---- values -------------------------------------------------------------------------------- */

static int is_boolean(const model_variable *v) { return strcmp(v->unit, "Boolean") == 0; }

/* The variable of a value reference, if it is of the wanted type. */
static const model_variable *find(const instance *self, fmi2ValueReference reference, int boolean) {
    size_t count;
    const model_variable *variables = force_element_variables(&count);
    if (reference < count && is_boolean(&variables[reference]) == boolean)
        return &variables[reference];
    log_message(self, fmi2Error, "value reference %u is no %s variable", reference,
                boolean ? "Boolean" : "Real");
    return NULL;
}

static fmi2Status get_value(instance *self, fmi2ValueReference reference, int boolean,
                            double *value) {
    const model_variable *v = find(self, reference, boolean);
    if (v == NULL) return fmi2Error;
    if (v->role == OUTPUT && evaluate(self) != fmi2OK) return fmi2Error;
    memcpy(value, (const char *)&self->now.element + v->offset, sizeof *value);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component component, const fmi2ValueReference references[], size_t n,
                       fmi2Real values[]) {
    instance *self = component;
    CHECK_CALL(self, ANY_STAGE);
    for (size_t i = 0; i < n; i++)
        if (get_value(self, references[i], 0, &values[i]) != fmi2OK) return fmi2Error;
    return fmi2OK;
}

fmi2Status fmi2GetBoolean(fmi2Component component, const fmi2ValueReference references[], size_t n,
                          fmi2Boolean values[]) {
    instance *self = component;
    CHECK_CALL(self, ANY_STAGE);
    for (size_t i = 0; i < n; i++) {
        double value = 0.0;
        if (get_value(self, references[i], 1, &value) != fmi2OK) return fmi2Error;
        values[i] = value != 0.0 ? fmi2True : fmi2False;
    }
    return fmi2OK;
}

static fmi2Status set_value(instance *self, fmi2ValueReference reference, double value) {
    const model_variable *v = find(self, reference, 0);
    if (v == NULL) return fmi2Error;
    int fixed_now = v->role == FIXED_PARAMETER && self->now.stage == STEPPING;
    if (v->role == OUTPUT || fixed_now) {
        log_message(self, fmi2Error, "%s cannot be set%s", v->name,
                    fixed_now ? " after initialization" : ": it is an output");
        return fmi2Error;
    }
    if (!(value >= v->minimum && value <= v->maximum)) {
        log_message(self, fmi2Error, "%s = %g is out of range: must be from %g to %g", v->name,
                    value, v->minimum, v->maximum);
        return fmi2Error;
    }
    memcpy((char *)&self->now.element + v->offset, &value, sizeof value);
    self->now.stale = 1;
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component component, const fmi2ValueReference references[], size_t n,
                       const fmi2Real values[]) {
    instance *self = component;
    CHECK_CALL(self, IN(INSTANTIATED) | IN(INITIALIZING) | IN(STEPPING));
    for (size_t i = 0; i < n; i++)
        if (set_value(self, references[i], values[i]) != fmi2OK) return fmi2Error;
    return fmi2OK;
}

/* This model has no such variables: any access to one is an error of the tool. */
static fmi2Status no_such_variable(instance *self, const char *type, size_t n) {
    if (self == NULL) return fmi2Error;
    if (n == 0) return fmi2OK;
    log_message(self, fmi2Error, "this FMU has no %s variable that can be accessed so", type);
    return fmi2Error;
}

fmi2Status fmi2SetBoolean(fmi2Component component, const fmi2ValueReference references[], size_t n,
                          const fmi2Boolean values[]) {
    (void)references, (void)values;
    return no_such_variable(component, "Boolean", n);
}

fmi2Status fmi2GetInteger(fmi2Component component, const fmi2ValueReference references[], size_t n,
                          fmi2Integer values[]) {
    (void)references, (void)values;
    return no_such_variable(component, "Integer", n);
}

fmi2Status fmi2SetInteger(fmi2Component component, const fmi2ValueReference references[], size_t n,
                          const fmi2Integer values[]) {
    (void)references, (void)values;
    return no_such_variable(component, "Integer", n);
}

fmi2Status fmi2GetString(fmi2Component component, const fmi2ValueReference references[], size_t n,
                         fmi2String values[]) {
    (void)references, (void)values;
    return no_such_variable(component, "String", n);
}

fmi2Status fmi2SetString(fmi2Component component, const fmi2ValueReference references[], size_t n,
                         const fmi2String values[]) {
    (void)references, (void)values;
    return no_such_variable(component, "String", n);
}

/* ---- saved states -------------------------------------------------------------------------- */

fmi2Status fmi2GetFMUstate(fmi2Component component, fmi2FMUstate *saved) {
    instance *self = component;
    CHECK_CALL(self, ANY_STAGE);
    if (*saved == NULL) *saved = malloc(sizeof(state));
    if (*saved == NULL) {
        log_message(self, fmi2Error, "out of memory");
        return fmi2Error;
    }
    memcpy(*saved, &self->now, sizeof(state));
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component component, fmi2FMUstate saved) {
    instance *self = component;
    CHECK_CALL(self, ANY_STAGE);
    if (saved == NULL) {
        log_message(self, fmi2Error, "the state to set is null");
        return fmi2Error;
    }
    memcpy(&self->now, saved, sizeof(state));
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component component, fmi2FMUstate *saved) {
    instance *self = component;
    CHECK_CALL(self, ANY_STAGE);
    if (saved != NULL) {
        free(*saved);
        *saved = NULL;
    }
    return fmi2OK;
}

/* What modelDescription.xml says the FMU cannot do. */
static fmi2Status not_offered(instance *self, const char *function) {
    if (self != NULL)
        log_message(self, fmi2Error, "%s is not offered (see the capability flags)", function);
    return fmi2Error;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component component, fmi2FMUstate saved, size_t *size) {
    (void)saved, (void)size;
    return not_offered(component, __func__);
}

fmi2Status fmi2SerializeFMUstate(fmi2Component component, fmi2FMUstate saved, fmi2Byte bytes[],
                                 size_t size) {
    (void)saved, (void)bytes, (void)size;
    return not_offered(component, __func__);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component component, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *saved) {
    (void)saved, (void)bytes, (void)size;
    return not_offered(component, __func__);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component component, const fmi2ValueReference unknown[],
                                        size_t n_unknown, const fmi2ValueReference known[],
                                        size_t n_known, const fmi2Real seed[],
                                        fmi2Real sensitivity[]) {
    (void)unknown, (void)n_unknown, (void)known, (void)n_known, (void)seed, (void)sensitivity;
    return not_offered(component, __func__);
}

/* ---- steps --------------------------------------------------------------------------------- */

fmi2Status fmi2DoStep(fmi2Component component, fmi2Real point, fmi2Real step,
                      fmi2Boolean no_set_state_before) {
    (void)no_set_state_before;
    instance *self = component;
    CHECK_CALL(self, IN(STEPPING));
    double end = point + step;
    if (!(step > 0.0 && isfinite(end))) {
        log_message(self, fmi2Error, "step size = %g must be > 0 and end at a finite time", step);
        return fmi2Error;
    }
    /* Tools add up step sizes: the last bits of the time may differ from ours. */
    if (!(fabs(point - self->now.time) <= 1e-6 * step + 1e-12 * fabs(point))) {
        log_message(self, fmi2Error, "communication point = %.17g must be the FMU's time %.17g",
                    point, self->now.time);
        return fmi2Error;
    }
    if (evaluate(self) != fmi2OK) return fmi2Error;
    self->now.time = end;
    return fmi2OK;
}

fmi2Status fmi2CancelStep(fmi2Component component) { return not_offered(component, __func__); }

fmi2Status fmi2SetRealInputDerivatives(fmi2Component component,
                                       const fmi2ValueReference references[], size_t n,
                                       const fmi2Integer order[], const fmi2Real values[]) {
    (void)references, (void)n, (void)order, (void)values;
    return not_offered(component, __func__);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component component,
                                        const fmi2ValueReference references[], size_t n,
                                        const fmi2Integer order[], fmi2Real values[]) {
    (void)references, (void)n, (void)order, (void)values;
    return not_offered(component, __func__);
}

/* A step ends before fmi2DoStep returns, so only the time of the last one is ever asked for. */
fmi2Status fmi2GetRealStatus(fmi2Component component, const fmi2StatusKind kind, fmi2Real *value) {
    instance *self = component;
    CHECK_CALL(self, ANY_STAGE);
    if (kind != fmi2LastSuccessfulTime) return not_offered(self, __func__);
    *value = self->now.time;
    return fmi2OK;
}

fmi2Status fmi2GetStatus(fmi2Component component, const fmi2StatusKind kind, fmi2Status *value) {
    (void)kind, (void)value;
    return not_offered(component, __func__);
}

fmi2Status fmi2GetIntegerStatus(fmi2Component component, const fmi2StatusKind kind,
                                fmi2Integer *value) {
    (void)kind, (void)value;
    return not_offered(component, __func__);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component component, const fmi2StatusKind kind,
                                fmi2Boolean *value) {
    (void)kind, (void)value;
    return not_offered(component, __func__);
}

fmi2Status fmi2GetStringStatus(fmi2Component component, const fmi2StatusKind kind,
                               fmi2String *value) {
    (void)kind, (void)value;
    return not_offered(component, __func__);
}

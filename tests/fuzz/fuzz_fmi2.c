/* FMI 2.0: any calls in any order. */
#include "fmi2Functions.h"
#include "fuzz_program.h"

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                        fmi2String category, fmi2String message, ...) {
    (void)environment;
    MUST(strcmp(name, "fuzzed") == 0 && category[0] != '\0' && message[0] != '\0');
    MUST(status >= fmi2Warning && status <= fmi2Error);
}

static void *shell_open(int exchange, const char *token, const char *location, int logging,
                        int has_logger) {
    static const fmi2CallbackFunctions callbacks = {log_message, calloc, free, NULL, NULL};
    return fmi2Instantiate("fuzzed", exchange ? fmi2ModelExchange : fmi2CoSimulation, token,
                           location, has_logger ? &callbacks : NULL, 0, logging);
}

static void shell_free(void *c) { fmi2FreeInstance(c); }

static int shell_set_real(void *c, const unsigned *of, size_t n, const double *values) {
    return (int)fmi2SetReal(c, of, n, values);
}

static int shell_get_real(void *c, const unsigned *of, size_t n, double *values) {
    return (int)fmi2GetReal(c, of, n, values);
}

static int shell_set_boolean(void *c, const unsigned *of, size_t n, const int *values) {
    return (int)fmi2SetBoolean(c, of, n, values);
}

static int shell_get_boolean(void *c, const unsigned *of, size_t n, int *values) {
    return (int)fmi2GetBoolean(c, of, n, values);
}

static int shell_set_up(void *c, const experiment *e) {
    return (int)fmi2SetupExperiment(c, e->has_tolerance, e->tolerance, e->start, e->has_stop,
                                    e->stop);
}

static int shell_enter_initialization(void *c, const experiment *e) {
    (void)e;
    return (int)fmi2EnterInitializationMode(c);
}

static int shell_step(void *c, double point, double step) {
    return (int)fmi2DoStep(c, point, step, fmi2True);
}

static int shell_simple(void *c, enum operation which) {
    fmi2EventInfo info;
    fmi2Boolean enter, terminate;
    switch (which) {
        case EXIT_INITIALIZATION:
            return (int)fmi2ExitInitializationMode(c);
        case TERMINATE:
            return (int)fmi2Terminate(c);
        case RESET:
            return (int)fmi2Reset(c);
        case ENTER_EVENTS:
            return (int)fmi2EnterEventMode(c);
        case ENTER_CONTINUOUS:
            return (int)fmi2EnterContinuousTimeMode(c);
        case UPDATE:
            return (int)fmi2NewDiscreteStates(c, &info);
        default:
            return (int)fmi2CompletedIntegratorStep(c, fmi2True, &enter, &terminate);
    }
}

static int shell_states(void *c, enum operation which, size_t n, double *values) {
    switch (which) {
        case SET_STATES:
            return (int)fmi2SetContinuousStates(c, values, n);
        case GET_STATES:
            return (int)fmi2GetContinuousStates(c, values, n);
        case GET_DERIVATIVES:
            return (int)fmi2GetDerivatives(c, values, n);
        case GET_INDICATORS:
            return (int)fmi2GetEventIndicators(c, values, n);
        default:
            return (int)fmi2GetNominalsOfContinuousStates(c, values, n);
    }
}

static int shell_set_time(void *c, double time) { return (int)fmi2SetTime(c, time); }

static int shell_save(void *c, void **saved) { return (int)fmi2GetFMUstate(c, saved); }

static int shell_restore(void *c, void *saved) { return (int)fmi2SetFMUstate(c, saved); }

static int shell_forget(void *c, void **saved) { return (int)fmi2FreeFMUstate(c, saved); }

static int shell_size(void *c, void *saved, size_t *size) {
    return (int)fmi2SerializedFMUstateSize(c, saved, size);
}

static int shell_serialize(void *c, void *saved, unsigned char *bytes, size_t size) {
    return (int)fmi2SerializeFMUstate(c, saved, (fmi2Byte *)bytes, size);
}

static int shell_deserialize(void *c, const unsigned char *bytes, size_t size, void **saved) {
    return (int)fmi2DeSerializeFMUstate(c, (const fmi2Byte *)bytes, size, saved);
}

static int shell_derivative(void *c, int adjoint, const unsigned *unknowns, size_t n,
                            const unsigned *knowns, size_t m, const double *seed, double *change) {
    if (adjoint) return -1; /* FMI 2.0 has none */
    return (int)fmi2GetDirectionalDerivative(c, unknowns, n, knowns, m, seed, change);
}

static int shell_set_logging(void *c, int on, size_t n, const char *const names[]) {
    return (int)fmi2SetDebugLogging(c, on, n, names);
}

static int shell_other(void *c, unsigned which, size_t n) {
    static const fmi2ValueReference of[2] = {0, 1};
    fmi2Integer integers[2] = {0, 1};
    fmi2String strings[2] = {"", ""};
    fmi2Real reals[2] = {0.0, 1.0};
    fmi2Status status;
    fmi2Boolean flag;
    switch (which % 12) {
        case 0:
            return (int)fmi2GetInteger(c, of, n, integers);
        case 1:
            return (int)fmi2SetInteger(c, of, n, integers);
        case 2:
            return (int)fmi2GetString(c, of, n, strings);
        case 3:
            return (int)fmi2SetString(c, of, n, strings);
        case 4:
            return (int)fmi2SetRealInputDerivatives(c, of, n, integers, reals);
        case 5:
            return (int)fmi2GetRealOutputDerivatives(c, of, n, integers, reals);
        case 6:
            return (int)fmi2CancelStep(c);
        case 7:
            return (int)fmi2GetStatus(c, fmi2DoStepStatus, &status);
        case 8:
            return (int)fmi2GetRealStatus(c, n ? fmi2LastSuccessfulTime : fmi2Terminated, reals);
        case 9:
            return (int)fmi2GetIntegerStatus(c, fmi2PendingStatus, integers);
        case 10:
            return (int)fmi2GetBooleanStatus(c, n ? fmi2Terminated : fmi2PendingStatus, &flag);
        default:
            return (int)fmi2GetStringStatus(c, fmi2PendingStatus, strings);
    }
}

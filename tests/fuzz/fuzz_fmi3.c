/* FMI 3.0: any calls in any order. */
#include "fmi3Functions.h"
#include "fuzz_program.h"

static void log_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                        fmi3String message) {
    (void)environment;
    MUST(category[0] != '\0' && message[0] != '\0');
    MUST(status >= fmi3Warning && status <= fmi3Error);
}

static void *shell_open(int exchange, const char *token, const char *location, int logging,
                        int has_logger) {
    fmi3LogMessageCallback logger = has_logger ? log_message : NULL;
    return exchange
               ? fmi3InstantiateModelExchange("fuzzed", token, location, fmi3False, logging != 0,
                                              NULL, logger)
               : fmi3InstantiateCoSimulation("fuzzed", token, location, fmi3False, logging != 0,
                                             fmi3False, fmi3False, NULL, 0, NULL, logger, NULL);
}

static void shell_free(void *c) { fmi3FreeInstance(c); }

static int shell_set_real(void *c, const unsigned *of, size_t n, const double *values) {
    return (int)fmi3SetFloat64(c, of, n, values, n);
}

static int shell_get_real(void *c, const unsigned *of, size_t n, double *values) {
    return (int)fmi3GetFloat64(c, of, n, values, n);
}

static int shell_set_boolean(void *c, const unsigned *of, size_t n, const int *values) {
    fmi3Boolean flags[4];
    for (size_t i = 0; i < n; i++) flags[i] = values[i] != 0;
    return (int)fmi3SetBoolean(c, of, n, flags, n);
}

static int shell_get_boolean(void *c, const unsigned *of, size_t n, int *values) {
    fmi3Boolean flags[4] = {fmi3False};
    int status = (int)fmi3GetBoolean(c, of, n, flags, n);
    for (size_t i = 0; i < n; i++) values[i] = flags[i];
    return status;
}

static int shell_set_up(void *c, const experiment *e) {
    (void)c, (void)e;
    return -1; /* a part of what enters the initialization */
}

static int shell_enter_initialization(void *c, const experiment *e) {
    return (int)fmi3EnterInitializationMode(c, e->has_tolerance != 0, e->tolerance, e->start,
                                            e->has_stop != 0, e->stop);
}

static int shell_step(void *c, double point, double step) {
    fmi3Boolean event, terminate, early;
    fmi3Float64 reached = 0.0;
    int status = (int)fmi3DoStep(c, point, step, fmi3True, &event, &terminate, &early, &reached);
    MUST(isfinite(reached));
    return status;
}

static int shell_simple(void *c, enum operation which) {
    fmi3Boolean b[5];
    fmi3Float64 next;
    switch (which) {
        case EXIT_INITIALIZATION:
            return (int)fmi3ExitInitializationMode(c);
        case TERMINATE:
            return (int)fmi3Terminate(c);
        case RESET:
            return (int)fmi3Reset(c);
        case ENTER_EVENTS:
            return (int)fmi3EnterEventMode(c);
        case ENTER_CONTINUOUS:
            return (int)fmi3EnterContinuousTimeMode(c);
        case UPDATE:
            return (int)fmi3UpdateDiscreteStates(c, b, b + 1, b + 2, b + 3, b + 4, &next);
        default:
            return (int)fmi3CompletedIntegratorStep(c, fmi3True, b, b + 1);
    }
}

static int shell_states(void *c, enum operation which, size_t n, double *values) {
    switch (which) {
        case SET_STATES:
            return (int)fmi3SetContinuousStates(c, values, n);
        case GET_STATES:
            return (int)fmi3GetContinuousStates(c, values, n);
        case GET_DERIVATIVES:
            return (int)fmi3GetContinuousStateDerivatives(c, values, n);
        case GET_INDICATORS:
            return (int)fmi3GetEventIndicators(c, values, n);
        default:
            return (int)fmi3GetNominalsOfContinuousStates(c, values, n);
    }
}

static int shell_set_time(void *c, double time) { return (int)fmi3SetTime(c, time); }

static int shell_save(void *c, void **saved) { return (int)fmi3GetFMUState(c, saved); }

static int shell_restore(void *c, void *saved) { return (int)fmi3SetFMUState(c, saved); }

static int shell_forget(void *c, void **saved) { return (int)fmi3FreeFMUState(c, saved); }

static int shell_size(void *c, void *saved, size_t *size) {
    return (int)fmi3SerializedFMUStateSize(c, saved, size);
}

static int shell_serialize(void *c, void *saved, unsigned char *bytes, size_t size) {
    return (int)fmi3SerializeFMUState(c, saved, bytes, size);
}

static int shell_deserialize(void *c, const unsigned char *bytes, size_t size, void **saved) {
    return (int)fmi3DeserializeFMUState(c, bytes, size, saved);
}

static int shell_derivative(void *c, int adjoint, const unsigned *unknowns, size_t n,
                            const unsigned *knowns, size_t m, const double *seed, double *change) {
    return adjoint
               ? (int)fmi3GetAdjointDerivative(c, unknowns, n, knowns, m, seed, n, change, m)
               : (int)fmi3GetDirectionalDerivative(c, unknowns, n, knowns, m, seed, m, change, n);
}

static int shell_set_logging(void *c, int on, size_t n, const char *const names[]) {
    return (int)fmi3SetDebugLogging(c, on != 0, n, names);
}

/* Of a type or a mode that no variable here has. */
#define OF_TYPE(number, type)                         \
    case 2 * (number): {                              \
        fmi3##type none[2] = {0};                     \
        return (int)fmi3Get##type(c, of, n, none, n); \
    }                                                 \
    case 2 * (number) + 1: {                          \
        static const fmi3##type none[2] = {0};        \
        return (int)fmi3Set##type(c, of, n, none, n); \
    }

static int shell_other(void *c, unsigned which, size_t n) {
    static const fmi3ValueReference of[2] = {0, 1};
    fmi3Clock clocks[2] = {0};
    fmi3Float64 reals[2] = {0.0};
    fmi3Int32 orders[2] = {1, 1};
    size_t sizes[2] = {0}, number;
    fmi3Binary binaries[2] = {NULL, NULL};
    fmi3UInt64 counters[2] = {0}, resolutions[2] = {1, 1};
    fmi3IntervalQualifier qualifiers[2];
    switch (which % 43) {
        OF_TYPE(0, Float32)
        OF_TYPE(1, Int8)
        OF_TYPE(2, UInt8)
        OF_TYPE(3, Int16)
        OF_TYPE(4, UInt16)
        OF_TYPE(5, Int32)
        OF_TYPE(6, UInt32)
        OF_TYPE(7, Int64)
        OF_TYPE(8, UInt64)
        OF_TYPE(9, String)
        case 20:
            return (int)fmi3GetBinary(c, of, n, sizes, binaries, n);
        case 21:
            return (int)fmi3SetBinary(c, of, n, sizes, binaries, n);
        case 22:
            return (int)fmi3GetClock(c, of, n, clocks);
        case 23:
            return (int)fmi3SetClock(c, of, n, clocks);
        case 24:
            return (int)fmi3GetIntervalDecimal(c, of, n, reals, qualifiers);
        case 25:
            return (int)fmi3GetIntervalFraction(c, of, n, counters, resolutions, qualifiers);
        case 26:
            return (int)fmi3GetShiftDecimal(c, of, n, reals);
        case 27:
            return (int)fmi3GetShiftFraction(c, of, n, counters, resolutions);
        case 28:
            return (int)fmi3SetIntervalDecimal(c, of, n, reals);
        case 29:
            return (int)fmi3SetIntervalFraction(c, of, n, counters, resolutions);
        case 30:
            return (int)fmi3SetShiftDecimal(c, of, n, reals);
        case 31:
            return (int)fmi3SetShiftFraction(c, of, n, counters, resolutions);
        case 32:
            return (int)fmi3GetOutputDerivatives(c, of, n, orders, reals, n);
        case 33:
            return (int)fmi3EnterConfigurationMode(c);
        case 34:
            return (int)fmi3ExitConfigurationMode(c);
        case 35:
            return (int)fmi3EnterStepMode(c);
        case 36:
            return (int)fmi3ActivateModelPartition(c, 0, 0.0);
        case 37:
            return (int)fmi3GetNumberOfVariableDependencies(c, 0, &number);
        case 38:
            return (int)fmi3GetVariableDependencies(c, 0, NULL, NULL, NULL, NULL, 0);
        case 39:
            return (int)fmi3EvaluateDiscreteStates(c);
        case 40:
            return (int)fmi3GetNumberOfEventIndicators(c, &number);
        case 41:
            return (int)fmi3GetNumberOfContinuousStates(c, &number);
        default: /* more values than variables */
            return n == 0 ? -1 : (int)fmi3GetFloat64(c, of, n, reals, n - 1);
    }
}

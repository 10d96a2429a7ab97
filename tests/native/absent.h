/* Functions of types and modes that no model here has, by number, on n of the variables `of`. */
#ifndef ABSENT_H
#define ABSENT_H

#include "fmi.h"

#define WHEN(number, call) \
    case number:           \
        return (int)call;

enum { ABSENT2 = 6, ABSENT3 = 33 };

static inline int absent2(void *c, unsigned which, const unsigned *of, size_t n) {
    fmi2Integer integers[2] = {0, 1};
    fmi2String strings[2] = {"", ""};
    fmi2Real reals[2] = {0.0, 1.0};
    switch (which) {
        WHEN(0, fmi2GetInteger(c, of, n, integers))
        WHEN(1, fmi2SetInteger(c, of, n, integers))
        WHEN(2, fmi2GetString(c, of, n, strings))
        WHEN(3, fmi2SetString(c, of, n, strings))
        WHEN(4, fmi2SetRealInputDerivatives(c, of, n, integers, reals))
        default:
            return (int)fmi2GetRealOutputDerivatives(c, of, n, integers, reals);
    }
}

#define OF_TYPE(number, type)                         \
    case 2 * (number): {                              \
        fmi3##type none[2] = {0};                     \
        return (int)fmi3Get##type(c, of, n, none, n); \
    }                                                 \
    case 2 * (number) + 1: {                          \
        static const fmi3##type none[2] = {0};        \
        return (int)fmi3Set##type(c, of, n, none, n); \
    }

static inline int absent3(void *c, unsigned which, const unsigned *of, size_t n) {
    fmi3Clock clocks[2] = {0};
    fmi3Float64 reals[2] = {0.0};
    fmi3Int32 orders[2] = {1, 1};
    size_t sizes[2] = {0};
    fmi3Binary binaries[2] = {NULL, NULL};
    fmi3UInt64 counters[2] = {0}, resolutions[2] = {1, 1};
    fmi3IntervalQualifier qualifiers[2];
    switch (which) {
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
        WHEN(20, fmi3GetBinary(c, of, n, sizes, binaries, n))
        WHEN(21, fmi3SetBinary(c, of, n, sizes, binaries, n))
        WHEN(22, fmi3GetClock(c, of, n, clocks))
        WHEN(23, fmi3SetClock(c, of, n, clocks))
        WHEN(24, fmi3GetIntervalDecimal(c, of, n, reals, qualifiers))
        WHEN(25, fmi3GetIntervalFraction(c, of, n, counters, resolutions, qualifiers))
        WHEN(26, fmi3GetShiftDecimal(c, of, n, reals))
        WHEN(27, fmi3GetShiftFraction(c, of, n, counters, resolutions))
        WHEN(28, fmi3SetIntervalDecimal(c, of, n, reals))
        WHEN(29, fmi3SetIntervalFraction(c, of, n, counters, resolutions))
        WHEN(30, fmi3SetShiftDecimal(c, of, n, reals))
        WHEN(31, fmi3SetShiftFraction(c, of, n, counters, resolutions))
        default:
            return (int)fmi3GetOutputDerivatives(c, of, n, orders, reals, n);
    }
}

/* What is refused whatever its arguments are; in FMI 2 with one exception, the last. */
enum { REFUSED2 = 6, REFUSED3 = 6 };

static inline int refused2(void *c, unsigned which) {
    fmi2Status status;
    fmi2Integer integer;
    fmi2String text;
    fmi2Real real;
    fmi2Boolean truth;
    switch (which) {
        WHEN(0, fmi2CancelStep(c))
        WHEN(1, fmi2GetStatus(c, fmi2DoStepStatus, &status))
        WHEN(2, fmi2GetIntegerStatus(c, fmi2DoStepStatus, &integer))
        WHEN(3, fmi2GetStringStatus(c, fmi2PendingStatus, &text))
        WHEN(4, fmi2GetRealStatus(c, fmi2PendingStatus, &real))
        default:
            return (int)fmi2GetBooleanStatus(c, fmi2PendingStatus, &truth);
    }
}

static inline int refused3(void *c, unsigned which) {
    size_t number;
    switch (which) {
        WHEN(0, fmi3EnterConfigurationMode(c))
        WHEN(1, fmi3ExitConfigurationMode(c))
        WHEN(2, fmi3EnterStepMode(c))
        WHEN(3, fmi3ActivateModelPartition(c, 0, 0.0))
        WHEN(4, fmi3GetNumberOfVariableDependencies(c, 0, &number))
        default:
            return (int)fmi3GetVariableDependencies(c, 0, NULL, NULL, NULL, NULL, 0);
    }
}

#endif

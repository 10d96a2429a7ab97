/* Functions of types and modes that no model here has, by number, on n of the variables `of`. */
#ifndef ABSENT_H
#define ABSENT_H

#include "fmi.h"

enum { ABSENT2 = 6, ABSENT3 = 33 };

static inline int absent2(void *c, unsigned which, const unsigned *of, size_t n) {
    fmi2Integer integers[2] = {0, 1};
    fmi2String strings[2] = {"", ""};
    fmi2Real reals[2] = {0.0, 1.0};
    switch (which) {
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
        case 0:
            return (int)fmi2CancelStep(c);
        case 1:
            return (int)fmi2GetStatus(c, fmi2DoStepStatus, &status);
        case 2:
            return (int)fmi2GetIntegerStatus(c, fmi2DoStepStatus, &integer);
        case 3:
            return (int)fmi2GetStringStatus(c, fmi2PendingStatus, &text);
        case 4:
            return (int)fmi2GetRealStatus(c, fmi2PendingStatus, &real);
        default:
            return (int)fmi2GetBooleanStatus(c, fmi2PendingStatus, &truth);
    }
}

static inline int refused3(void *c, unsigned which) {
    size_t number;
    switch (which) {
        case 0:
            return (int)fmi3EnterConfigurationMode(c);
        case 1:
            return (int)fmi3ExitConfigurationMode(c);
        case 2:
            return (int)fmi3EnterStepMode(c);
        case 3:
            return (int)fmi3ActivateModelPartition(c, 0, 0.0);
        case 4:
            return (int)fmi3GetNumberOfVariableDependencies(c, 0, &number);
        default:
            return (int)fmi3GetVariableDependencies(c, 0, NULL, NULL, NULL, NULL, 0);
    }
}

#endif

/* Calls that FMI 2 and 3 have in common. The including file defines for its version, before:
 *
 *     FMI(name)          name with the version's prefix
 *     INSTANCE, SAVED    the standard's types of an instance and of a saved state
 *     instance           this library's struct behind an INSTANCE; its core comes first
 *     STATUS(result)     the standard's status
 *     DISCARDED(result)  the same in calls that not every version allows to discard
 */
#ifndef FMI_CALLS_H
#define FMI_CALLS_H

#include <stdlib.h>
#include <string.h>

#include "component.h"
#include "export.h"

/* The standard names parameters that an FMU may not need. */
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

#define CALL(name, ...) CONTACTLIB_API FMI(Status) FMI(name)(INSTANCE c, __VA_ARGS__)
#define CALL_ALONE(name) CONTACTLIB_API FMI(Status) FMI(name)(INSTANCE c)
#define REFERENCES const FMI(ValueReference) references[], size_t n

/* Called for capabilities that modelDescription.xml denies and for types that no variable has. */
static FMI(Status) not_offered(INSTANCE c, const char *function) {
    component *core = (component *)c;
    if (core != NULL) component_log(core, RESULT_ERROR, "%s: this FMU does not offer it", function);
    return STATUS(RESULT_ERROR);
}
#define NOT_OFFERED(name, ...) \
    CALL(name, __VA_ARGS__) { return not_offered(c, __func__); }

/* Functions of n values that no variable has: a call without values is allowed. */
#define OF_NONE(name, ...)                                                         \
    CALL(name, __VA_ARGS__) {                                                      \
        return n == 0 && c != NULL ? STATUS(RESULT_OK) : not_offered(c, __func__); \
    }

/* Every function of an instance starts with this: it finds the instance and checks that the call is
 * allowed now. */
#define CORE(c, allowed)                                                          \
    component *core = (component *)(c);                                           \
    if (core == NULL || component_called(core, __func__, (allowed)) != RESULT_OK) \
    return STATUS(RESULT_ERROR)

/* Refuse a null pointer to n values. */
#define NEEDS(n, pointer) \
    if ((n) > 0 && (pointer) == NULL) return STATUS(component_null(core, __func__, #pointer))

#define BEFORE_RUN (IN(INSTANTIATED) | IN(INITIALIZING))

/* ---- life ---------------------------------------------------------------------------------- */

CONTACTLIB_API void FMI(FreeInstance)(INSTANCE c) {
    if (c == NULL) return;
    component_close((component *)c);
    free(c);
}

CALL(SetDebugLogging, FMI(Boolean) on, size_t n, const FMI(String) categories[]) {
    CORE(c, ANY_STAGE);
    NEEDS(n, categories);
    return STATUS(component_set_logging(core, on != FMI(False), n, categories));
}

CALL_ALONE(ExitInitializationMode) {
    CORE(c, IN(INITIALIZING));
    return DISCARDED(component_start(core));
}

/* Functions that only change the stage of an instance. */
#define STAGE(name, allowed, next) \
    CALL_ALONE(name) {             \
        CORE(c, allowed);          \
        core->now->stage = next;   \
        return STATUS(RESULT_OK);  \
    }

STAGE(Terminate, RUNNING, TERMINATED)
STAGE(EnterEventMode, IN(EVENTS) | IN(CONTINUOUS), EVENTS)
STAGE(EnterContinuousTimeMode, IN(EVENTS), CONTINUOUS)

CALL_ALONE(Reset) {
    CORE(c, ANY_STAGE);
    component_reset(core);
    return STATUS(RESULT_OK);
}

/* ---- values -------------------------------------------------------------------------------- */

/* Getter and setter of real numbers and of truth values; the last parameters are what the version
 * adds to theirs, and checks. A setter checks all values, then sets them. */
#define VALUES_OF(type, boolean, status_of, from_double, to_double, further, check)           \
    CALL(Get##type, REFERENCES, FMI(type) values[] further) {                                 \
        CORE(c, ANY_STAGE);                                                                   \
        NEEDS(n, references);                                                                 \
        check;                                                                                \
        NEEDS(n, values);                                                                     \
        result status = RESULT_OK;                                                            \
        for (size_t i = 0; i < n && status == RESULT_OK; i++) {                               \
            double number[MAX_WHEELS];                                                        \
            size_t size = component_size(core, references[i]);                                \
            status = component_get(core, references[i], boolean, number);                     \
            for (size_t k = 0; k < size && status == RESULT_OK; k++) *values++ = from_double; \
        }                                                                                     \
        return status_of(status);                                                             \
    }                                                                                         \
    CALL(Set##type, REFERENCES, const FMI(type) values[] further) {                           \
        CORE(c, BEFORE_RUN | RUNNING);                                                        \
        NEEDS(n, references);                                                                 \
        check;                                                                                \
        NEEDS(n, values);                                                                     \
        result status = RESULT_OK;                                                            \
        for (int setting = 0; setting < 2; setting++) {                                       \
            const FMI(type) *value = values;                                                  \
            for (size_t i = 0; i < n && status == RESULT_OK; i++) {                           \
                double number[MAX_WHEELS];                                                    \
                size_t size = component_size(core, references[i]);                            \
                for (size_t k = 0; k < size; k++, value++) number[k] = to_double;             \
                if (setting) component_put(core, references[i], number);                      \
                else status = component_check(core, references[i], boolean, number);          \
            }                                                                                 \
        }                                                                                     \
        return STATUS(status);                                                                \
    }

/* ---- saved states -------------------------------------------------------------------------- */

/* Versions write the names of these functions in different ways. */
#define SAVED_STATES(state, deserialize)                                           \
    CALL(Get##state, SAVED *saved) {                                               \
        CORE(c, ANY_STAGE);                                                        \
        return STATUS(component_save(core, saved));                                \
    }                                                                              \
    CALL(Set##state, SAVED saved) {                                                \
        CORE(c, ANY_STAGE);                                                        \
        return STATUS(component_restore(core, saved));                             \
    }                                                                              \
    CALL(Free##state, SAVED *saved) {                                              \
        CORE(c, ANY_STAGE);                                                        \
        return STATUS(component_forget(core, saved));                              \
    }                                                                              \
    CALL(Serialized##state##Size, SAVED saved, size_t *size) {                     \
        CORE(c, ANY_STAGE);                                                        \
        NEEDS(1, size);                                                            \
        *size = component_serialized_size(core);                                   \
        return STATUS(RESULT_OK);                                                  \
    }                                                                              \
    CALL(Serialize##state, SAVED saved, FMI(Byte) bytes[], size_t size) {          \
        CORE(c, ANY_STAGE);                                                        \
        NEEDS(1, bytes);                                                           \
        return STATUS(component_serialize(core, saved, bytes, size));              \
    }                                                                              \
    CALL(deserialize##state, const FMI(Byte) bytes[], size_t size, SAVED *saved) { \
        CORE(c, ANY_STAGE);                                                        \
        NEEDS(1, bytes);                                                           \
        return STATUS(component_deserialize(core, bytes, size, saved));            \
    }

/* ---- model exchange ------------------------------------------------------------------------ */

CALL(CompletedIntegratorStep, FMI(Boolean) no_set_state_before, FMI(Boolean) * enter_event_mode,
     FMI(Boolean) * terminate) {
    CORE(c, IN(CONTINUOUS));
    NEEDS(1, enter_event_mode);
    NEEDS(1, terminate);
    *enter_event_mode = *terminate = FMI(False);
    return STATUS(RESULT_OK);
}

CALL(SetTime, double time) {
    CORE(c, IN(EVENTS) | IN(CONTINUOUS));
    return STATUS(component_set_time(core, time));
}

/* Arrays with one number for each state or event indicator. */
#define ARRAY(function, call, allowed, kind)              \
    CALL(function, kind values[], size_t n) {             \
        CORE(c, allowed);                                 \
        NEEDS(n, values);                                 \
        return STATUS(component_##call(core, n, values)); \
    }

ARRAY(SetContinuousStates, set_states, IN(EVENTS) | IN(CONTINUOUS), const double)
ARRAY(GetContinuousStates, get_states, ANY_STAGE, double)
ARRAY(GetEventIndicators, get_indicators, ANY_STAGE, double)
ARRAY(GetNominalsOfContinuousStates, get_nominals, ANY_STAGE, double)

#endif

/* Every function of both versions of FMI, called as it may be and as it may not: what it says, and
 * what every refusal leaves behind. And the kernel's functions that no FMU calls.
 *
 *     test_calls RESOURCES TOKEN KIND FOLDER
 *
 * RESOURCES is a URI, and FOLDER the path of the folder that it is in. */
#include <stdlib.h>
#include <string.h>

#include "branch_free.h"
#include "checked_file.h"
#include "checks.h"
#include "component.h"
#include "fmi2Functions.h"
#include "fmi3Functions.h"
#include "resource.h"
#include "token.h"

static int said; /* messages */

static void log2_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                         fmi2String category, fmi2String message, ...) {
    (void)environment, (void)category;
    CHECK(strcmp(name, "") == 0 && status != fmi2OK && message[0] != '\0');
    said++;
}

static void log3_message(fmi3InstanceEnvironment environment, fmi3Status status,
                         fmi3String category, fmi3String message) {
    (void)environment, (void)category;
    CHECK(status != fmi3OK && message[0] != '\0');
    said++;
}

static const fmi2CallbackFunctions CALLBACKS = {.logger = log2_message};

/* A call that must be refused with a message. */
#define REFUSED(call)                       \
    do {                                    \
        int before_ = said;                 \
        CHECK((int)(call) == RESULT_ERROR); \
        CHECK(said == before_ + 1);         \
    } while (0)

#define DISCARDED(call)                       \
    do {                                      \
        int before_ = said;                   \
        CHECK((int)(call) == RESULT_DISCARD); \
        CHECK(said == before_ + 1);           \
    } while (0)

#define FINE(call) CHECK((int)(call) == RESULT_OK)

static const model *kind;
static const char *resources, *token;

static unsigned reference_of(const char *name) {
    for (unsigned i = 0; i < kind->count; i++)
        if (strcmp(kind->variables[i].name, name) == 0) return i;
    return (unsigned)kind->count;
}

static int has(const char *name) { return reference_of(name) < kind->count; }

static fmi2Component instance2(fmi2Type type) {
    fmi2Component c = fmi2Instantiate(NULL, type, token, resources, &CALLBACKS, 0, 1);
    CHECK(c != NULL);
    return c;
}

static fmi3Instance instance3(int exchange) {
    fmi3Instance c =
        exchange ? fmi3InstantiateModelExchange("x", token, resources, 0, 1, NULL, log3_message)
                 : fmi3InstantiateCoSimulation("x", token, resources, 0, 1, 0, 0, NULL, 0, NULL,
                                               log3_message, NULL);
    CHECK(c != NULL);
    return c;
}

static void test_names(void) {
    CHECK(strcmp(fmi2GetVersion(), "2.0") == 0);
    CHECK(strcmp(fmi2GetTypesPlatform(), "default") == 0);
    CHECK(strncmp(fmi3GetVersion(), "3.0", 3) == 0);
    CHECK(strncmp(token, contactlib_token(), strlen(contactlib_token())) == 0);
    CHECK(model_of("no model") == NULL);
}

static void test_logging(void) {
    fmi2Component c = instance2(fmi2CoSimulation);
    const char *known[] = {"logStatusError"}, *unknown[] = {"logStatusError", "logAll"};
    const char *null[] = {NULL};
    FINE(fmi2SetDebugLogging(c, 1, 1, known));
    REFUSED(fmi2SetDebugLogging(c, 1, 2, unknown));
    REFUSED(fmi2SetDebugLogging(c, 1, 1, null));
    FINE(fmi2SetDebugLogging(c, 0, 1, known));
    int before = said;
    CHECK(fmi2CancelStep(c) == fmi2Error && said == before); /* that category is off */
    FINE(fmi2SetDebugLogging(c, 0, 0, NULL));                /* errors are on again */
    REFUSED(fmi2CancelStep(c));
    fmi2FreeInstance(c);
    fmi3Instance d = instance3(0);
    FINE(fmi3SetDebugLogging(d, 1, 1, known));
    REFUSED(fmi3SetDebugLogging(d, 1, 2, unknown));
    fmi3FreeInstance(d);
    /* Without a logger nothing is said, and nothing else is different. */
    CHECK(fmi3InstantiateCoSimulation("x", "?", resources, 0, 1, 0, 0, NULL, 0, NULL, NULL, NULL) ==
          NULL);
    CHECK(fmi3InstantiateCoSimulation("x", token, resources, 0, 1, 1, 0, NULL, 0, NULL, NULL,
                                      NULL) == NULL);
    CHECK(fmi3InstantiateScheduledExecution("x", token, resources, 0, 1, NULL, NULL, NULL, NULL,
                                            NULL) == NULL);
    before = said;
    CHECK(fmi3InstantiateScheduledExecution("x", token, resources, 0, 1, NULL, log3_message, NULL,
                                            NULL, NULL) == NULL);
    CHECK(said == before + 1);
    c = fmi2Instantiate("100 %s%n", fmi2CoSimulation, token, resources, NULL, 0, 1);
    CHECK(fmi2CancelStep(c) == fmi2Error);
    fmi2FreeInstance(c);
}

static void test_tokens(void) {
    char longest[TOKEN_SIZE + 64];
    const char *ends[] = {
        "",
        "-",
        "-wheelset",
        "-none-x",
        "-a_kind_whose_name_is_longer_than_any_other-x",
        "-wheelset-digest_that_is_longer_than_the_room_that_a_state_keeps_for_it"};
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++) {
        int before = said;
        strcpy(longest, contactlib_token());
        strcat(longest, ends[i]);
        CHECK(fmi2Instantiate("", fmi2CoSimulation, longest, resources, &CALLBACKS, 0, 1) == NULL);
        CHECK(said == before + 1);
    }
    /* Percent signs are doubled, for tools that take the text for a format. */
    int before = said;
    CHECK(fmi2Instantiate("", fmi2CoSimulation, "%s%n", resources, &CALLBACKS, 0, 1) == NULL);
    CHECK(said == before + 1);
}

static void test_set_up(void) {
    fmi2Component c = instance2(fmi2CoSimulation);
    REFUSED(fmi2SetupExperiment(c, 0, 0.0, NAN, 0, 0.0));
    REFUSED(fmi2SetupExperiment(c, 0, 0.0, 1.0, 1, 0.5));
    REFUSED(fmi2SetupExperiment(c, 0, 0.0, 1.0, 1, NAN));
    REFUSED(fmi2SetupExperiment(c, 1, 0.0, 0.0, 0, 0.0));
    FINE(fmi2SetupExperiment(c, 1, 1e-4, 0.0, 1, 1e-2));
    REFUSED(fmi2ExitInitializationMode(c));
    FINE(fmi2EnterInitializationMode(c));
    FINE(fmi2ExitInitializationMode(c));
    REFUSED(fmi2EnterInitializationMode(c));
    REFUSED(fmi2DoStep(c, 0.0, 0.0, 1));
    REFUSED(fmi2DoStep(c, 0.0, NAN, 1));
    REFUSED(fmi2DoStep(c, 1.0, 1e-3, 1));
    REFUSED(fmi2DoStep(c, 0.0, 2e-2, 1));
    FINE(fmi2DoStep(c, 0.0, 1e-2, 1));
    REFUSED(fmi2DoStep(c, 1e-2, 1e-3, 1));
    fmi2FreeInstance(c);
    fmi3Instance d = instance3(0);
    REFUSED(fmi3EnterInitializationMode(d, 0, 0.0, INFINITY, 0, 0.0));
    FINE(fmi3EnterInitializationMode(d, 0, 0.0, 0.0, 0, 0.0));
    fmi3FreeInstance(d);
}

/* A whole day by steps that a tool has added up, and with its end named: the sum is off by far more
 * than the last bits. */
static void test_sum_of_steps(void) {
    const double day = 86400.0, step = 1e-3, off = 2.62e-5;
    for (int side = -1; side <= 1; side += 2) {
        fmi2Component c = instance2(fmi2CoSimulation);
        FINE(fmi2SetupExperiment(c, 0, 0.0, day + side * off - step, 1, day));
        FINE(fmi2EnterInitializationMode(c));
        FINE(fmi2ExitInitializationMode(c));
        FINE(fmi2DoStep(c, day + side * off - step, step, 1));
        REFUSED(fmi2DoStep(c, day + side * off, step, 1));
        fmi2FreeInstance(c);
    }
}

static void test_values(void) {
    fmi2Component c = instance2(fmi2CoSimulation);
    fmi3Instance d = instance3(0);
    unsigned speed = reference_of(kind->has_pair ? "creepage_x" : "speed");
    unsigned time = reference_of("time");
    double value = 3.0, big = 1e300;
    fmi2Boolean truth = 1;
    fmi3Boolean truths[2];
    FINE(fmi2SetReal(c, &speed, 1, &value));
    FINE(fmi2GetReal(c, &speed, 1, &value));
    CHECK(value == 3.0);
    REFUSED(fmi2SetReal(c, &time, 1, &value));
    REFUSED(fmi2SetBoolean(c, &speed, 1, &truth));
    REFUSED(fmi2GetBoolean(c, &speed, 1, &truth));
    DISCARDED(fmi2SetReal(c, &speed, 1, &big));
    REFUSED(fmi3SetFloat64(d, &speed, 1, &value, 2));
    REFUSED(fmi3GetFloat64(d, &speed, 1, &value, 2));
    REFUSED(fmi3GetBoolean(d, &speed, 1, truths, 2));
    REFUSED(fmi3SetBoolean(d, &speed, 1, truths, 2));
    REFUSED(fmi3GetDirectionalDerivative(d, &speed, 1, &speed, 1, &value, 1, &value, 1));
    FINE(fmi3EnterInitializationMode(d, 0, 0.0, 0.0, 0, 0.0));
    REFUSED(fmi3GetDirectionalDerivative(d, &speed, 1, &speed, 1, &value, 2, &value, 1));
    if (has("implicit")) {
        unsigned implicit = reference_of("implicit"), both[2] = {implicit, implicit};
        truth = 1;
        truths[0] = truths[1] = 1;
        FINE(fmi2SetBoolean(c, &implicit, 1, &truth));
        FINE(fmi2GetBoolean(c, &implicit, 1, &truth));
        CHECK(truth == 1);
        FINE(fmi3SetBoolean(d, both, 2, truths, 2));
        FINE(fmi3GetBoolean(d, both, 2, truths, 2));
        CHECK(truths[0] && truths[1]);
    }
    FINE(fmi2EnterInitializationMode(c));
    FINE(fmi2ExitInitializationMode(c));
    unsigned radius = reference_of("radius");
    REFUSED(fmi2SetReal(c, &radius, 1, &value));
    fmi2FreeInstance(c);
    fmi3FreeInstance(d);
}

/* Friction that no single limit can judge, and a weakening zone that the law's limit does not hold
 * for. */
static void test_friction(void) {
    if (!kind->has_contact) return;
    unsigned at = reference_of("static_friction"), force = reference_of("creep_force");
    unsigned length = reference_of("weakening_length");
    double low = 1e-3, other = 0.5, value, longest = 1.0;
    fmi2Component c = instance2(fmi2CoSimulation);
    FINE(fmi2SetReal(c, &at, 1, &low));
    REFUSED(fmi2GetReal(c, &force, 1, &value));
    FINE(fmi2EnterInitializationMode(c));
    REFUSED(fmi2ExitInitializationMode(c));
    fmi2FreeInstance(c);
    c = instance2(fmi2CoSimulation);
    component *core = c; /* an instance starts with it */
    FINE(fmi2SetReal(c, &at, 1, &other));
    if (core->table.static_to_kinetic > 0.0) REFUSED(fmi2GetReal(c, &force, 1, &value));
    else FINE(fmi2GetReal(c, &force, 1, &value));
    fmi2FreeInstance(c);
    c = instance2(fmi2CoSimulation);
    core = c;
    int limited = core->table.static_to_kinetic == 0.0 && !core->table.one_axis;
    FINE(fmi2SetReal(c, &length, 1, &longest));
    FINE(fmi2EnterInitializationMode(c));
    int before = said;
    FINE(fmi2ExitInitializationMode(c)); /* fine, with a warning */
    CHECK(said == before + limited);
    fmi2FreeInstance(c);
}

static void test_failing_step(void) {
    if (!has("drive_torque")) return;
    unsigned reference = reference_of("inertia");
    double least = 1e-9, torque = 1e12;
    fmi2Component c = instance2(fmi2CoSimulation);
    FINE(fmi2SetReal(c, &reference, 1, &least));
    reference = reference_of("drive_torque");
    FINE(fmi2SetReal(c, &reference, 1, &torque));
    FINE(fmi2SetupExperiment(c, 1, 1e-10, 0.0, 0, 0.0));
    FINE(fmi2EnterInitializationMode(c));
    FINE(fmi2ExitInitializationMode(c));
    DISCARDED(fmi2DoStep(c, 0.0, 1e300, 1));
    DISCARDED(fmi2DoStep(c, 0.0, 1e-6, 1)); /* to a speed out of range */
    FINE(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &least));
    CHECK(least == 0.0);
    fmi2FreeInstance(c);
}

static void test_model_exchange2(void) {
    fmi2Component c = instance2(fmi2ModelExchange);
    size_t states = ((component *)c)->states, indicators = component_indicators(c);
    double values[MOST_VARIABLES];
    fmi2EventInfo info;
    fmi2Boolean event = 1, terminate = 1;
    REFUSED(fmi2EnterEventMode(c));
    REFUSED(fmi2SetTime(c, 0.0));
    FINE(fmi2EnterInitializationMode(c));
    FINE(fmi2ExitInitializationMode(c));
    FINE(fmi2NewDiscreteStates(c, &info));
    CHECK(!info.newDiscreteStatesNeeded && !info.terminateSimulation);
    FINE(fmi2EnterContinuousTimeMode(c));
    FINE(fmi2SetTime(c, 1.0));
    REFUSED(fmi2SetTime(c, NAN));
    FINE(fmi2GetContinuousStates(c, values, states));
    FINE(fmi2SetContinuousStates(c, values, states));
    if (states > 0) {
        values[0] = NAN;
        DISCARDED(fmi2SetContinuousStates(c, values, states));
    }
    FINE(fmi2GetDerivatives(c, values, states));
    for (size_t i = 0; i < states; i++) CHECK(isfinite(values[i]));
    FINE(fmi2GetEventIndicators(c, values, indicators));
    FINE(fmi2GetNominalsOfContinuousStates(c, values, states));
    for (size_t i = 0; i < states; i++) CHECK(values[i] > 0.0);
    REFUSED(fmi2GetContinuousStates(c, values, states + 1));
    REFUSED(fmi2SetContinuousStates(c, values, states + 1));
    REFUSED(fmi2GetDerivatives(c, values, states + 1));
    REFUSED(fmi2GetEventIndicators(c, values, indicators + 1));
    REFUSED(fmi2GetNominalsOfContinuousStates(c, values, states + 1));
    FINE(fmi2CompletedIntegratorStep(c, 1, &event, &terminate));
    CHECK(!event && !terminate);
    if (has("falling_branch")) {
        unsigned falling = reference_of("falling_branch");
        FINE(fmi2GetBoolean(c, &falling, 1, &event));
    }
    REFUSED(fmi2NewDiscreteStates(c, &info));
    FINE(fmi2EnterEventMode(c));
    REFUSED(fmi2CompletedIntegratorStep(c, 1, &event, &terminate));
    REFUSED(fmi2DoStep(c, 1.0, 1e-3, 1));
    FINE(fmi2Terminate(c));
    REFUSED(fmi2EnterContinuousTimeMode(c));
    fmi2FreeInstance(c);
}

static void test_model_exchange3(void) {
    fmi3Instance c = instance3(1);
    size_t states, n;
    double values[MOST_VARIABLES];
    fmi3Boolean event = 1, terminate = 1;
    FINE(fmi3GetNumberOfContinuousStates(c, &states));
    FINE(fmi3GetNumberOfEventIndicators(c, &n));
    CHECK(n == component_indicators(c));
    FINE(fmi3EnterInitializationMode(c, 0, 0.0, 0.0, 0, 0.0));
    FINE(fmi3EvaluateDiscreteStates(c));
    FINE(fmi3ExitInitializationMode(c));
    FINE(fmi3EnterContinuousTimeMode(c));
    FINE(fmi3GetContinuousStates(c, values, states));
    FINE(fmi3SetContinuousStates(c, values, states));
    FINE(fmi3GetContinuousStateDerivatives(c, values, states));
    FINE(fmi3GetNominalsOfContinuousStates(c, values, states));
    FINE(fmi3CompletedIntegratorStep(c, 1, &event, &terminate));
    CHECK(!event && !terminate);
    REFUSED(fmi3EvaluateDiscreteStates(c));
    fmi3FreeInstance(c);
}

static void test_derivatives(void) {
    fmi2Component c = instance2(fmi2ModelExchange);
    unsigned many[MOST_VARIABLES + 1];
    const char *force = kind->has_contact ? "creep_force" : "speed";
    unsigned unknown = reference_of(kind->has_pair ? "force_x" : force);
    unsigned known = reference_of(kind->has_pair ? "shear_modulus" : "radius");
    double seed = 1.0, values[MOST_VARIABLES + 1];
    FINE(fmi2EnterInitializationMode(c));
    FINE(fmi2GetDirectionalDerivative(c, &unknown, 1, &known, 1, &seed, values));
    CHECK(isfinite(values[0]));
    unsigned omega = reference_of(kind->has_pair ? "creepage_x" : "omega");
    double largest = 1e308; /* times the slope of the force: not finite */
    CHECK(fmi2GetDirectionalDerivative(c, &unknown, 1, &omega, 1, &largest, values) != fmi2OK ||
          isfinite(values[0]));
    REFUSED(fmi2GetDirectionalDerivative(c, &known, 1, &known, 1, &seed, values));
    for (size_t i = 0; i <= MOST_VARIABLES; i++) many[i] = unknown;
    REFUSED(fmi2GetDirectionalDerivative(c, many, MOST_VARIABLES + 1, &known, 1, &seed, values));
    known = (unsigned)kind->count;
    REFUSED(fmi2GetDirectionalDerivative(c, &unknown, 1, &known, 1, &seed, values));
    fmi2FreeInstance(c);
}

/* A state is taken only by an instance that it can belong to. */
static void test_saved_states(void) {
    fmi3Instance c = instance3(0), exchange = instance3(1);
    fmi3FMUState saved = NULL, read = NULL;
    fmi3Byte bytes[4096];
    size_t size = 0;
    FINE(fmi3EnterInitializationMode(c, 0, 0.0, 0.0, 0, 0.0));
    FINE(fmi3ExitInitializationMode(c));
    FINE(fmi3GetFMUState(c, &saved));
    REFUSED(fmi3GetFMUState(c, NULL));
    FINE(fmi3FreeFMUState(c, NULL));
    REFUSED(fmi3SetFMUState(exchange, saved));
    FINE(fmi3SerializedFMUStateSize(c, saved, &size));
    CHECK(size <= sizeof bytes);
    REFUSED(fmi3SerializeFMUState(c, NULL, bytes, size));
    REFUSED(fmi3SerializeFMUState(c, saved, bytes, size - 1));
    FINE(fmi3SerializeFMUState(c, saved, bytes, size));
    FINE(fmi3DeserializeFMUState(c, bytes, size, &read));
    FINE(fmi3SetFMUState(c, read));
    /* Of another FMU of the same library, and of a stage that none is ever in. */
    ((component *)c)->token[0] ^= 1;
    REFUSED(fmi3DeserializeFMUState(c, bytes, size, &read));
    ((component *)c)->token[0] ^= 1;
    ((component_state *)read)->stage = TERMINATED + 1;
    FINE(fmi3SerializeFMUState(c, read, bytes, size));
    REFUSED(fmi3DeserializeFMUState(c, bytes, size, &read));
    FINE(fmi3FreeFMUState(c, &saved));
    FINE(fmi3FreeFMUState(c, &read));
    fmi3FreeInstance(c);
    fmi3FreeInstance(exchange);
}

/* Types that no model has: none of them is fine, one is refused, as is any of no instance. */
static void test_absent2(void) {
    fmi2Component c = instance2(fmi2CoSimulation);
    const fmi2ValueReference r = 0;
    fmi2Integer integer = 0;
    fmi2String text = "";
    fmi2Real real = 0.0;
    fmi2Status status;
    fmi2Boolean truth = 1;
#define ABSENT2(name, ...)                                    \
    do {                                                      \
        FINE(name(c, NULL, 0, __VA_ARGS__));                  \
        REFUSED(name(c, &r, 1, __VA_ARGS__));                 \
        CHECK(name(NULL, NULL, 0, __VA_ARGS__) == fmi2Error); \
    } while (0)
    ABSENT2(fmi2GetInteger, &integer);
    ABSENT2(fmi2SetInteger, &integer);
    ABSENT2(fmi2GetString, &text);
    ABSENT2(fmi2SetString, &text);
    ABSENT2(fmi2SetRealInputDerivatives, &integer, &real);
    ABSENT2(fmi2GetRealOutputDerivatives, &integer, &real);
    REFUSED(fmi2CancelStep(c));
    REFUSED(fmi2GetStatus(c, fmi2DoStepStatus, &status));
    REFUSED(fmi2GetIntegerStatus(c, fmi2DoStepStatus, &integer));
    REFUSED(fmi2GetStringStatus(c, fmi2PendingStatus, &text));
    REFUSED(fmi2GetRealStatus(c, fmi2PendingStatus, &real));
    REFUSED(fmi2GetBooleanStatus(c, fmi2PendingStatus, &truth));
    FINE(fmi2GetBooleanStatus(c, fmi2Terminated, &truth));
    CHECK(!truth);
    fmi2FreeInstance(c);
}

static void test_absent3(void) {
    fmi3Instance c = instance3(0);
    const fmi3ValueReference r = 0;
    fmi3Int32 order = 1;
    fmi3Float64 real = 0.0;
    fmi3UInt64 counter = 0;
    fmi3Clock clock = 0;
    fmi3IntervalQualifier qualifier;
    fmi3Binary binary = NULL;
    size_t size = 0;
    fmi3DependencyKind dependency;
#define ABSENT3(name, ...)                                    \
    do {                                                      \
        FINE(name(c, NULL, 0, __VA_ARGS__));                  \
        REFUSED(name(c, &r, 1, __VA_ARGS__));                 \
        CHECK(name(NULL, NULL, 0, __VA_ARGS__) == fmi3Error); \
    } while (0)
#define ABSENT_TYPE(type)                  \
    do {                                   \
        fmi3##type value = 0;              \
        ABSENT3(fmi3Get##type, &value, 0); \
        ABSENT3(fmi3Set##type, &value, 0); \
    } while (0)
    ABSENT_TYPE(Float32);
    ABSENT_TYPE(Int8);
    ABSENT_TYPE(UInt8);
    ABSENT_TYPE(Int16);
    ABSENT_TYPE(UInt16);
    ABSENT_TYPE(Int32);
    ABSENT_TYPE(UInt32);
    ABSENT_TYPE(Int64);
    ABSENT_TYPE(UInt64);
    ABSENT_TYPE(String);
    ABSENT3(fmi3GetBinary, &size, &binary, 0);
    ABSENT3(fmi3SetBinary, &size, &binary, 0);
    ABSENT3(fmi3GetClock, &clock);
    ABSENT3(fmi3SetClock, &clock);
    ABSENT3(fmi3GetIntervalDecimal, &real, &qualifier);
    ABSENT3(fmi3GetIntervalFraction, &counter, &counter, &qualifier);
    ABSENT3(fmi3GetShiftDecimal, &real);
    ABSENT3(fmi3GetShiftFraction, &counter, &counter);
    ABSENT3(fmi3SetIntervalDecimal, &real);
    ABSENT3(fmi3SetIntervalFraction, &counter, &counter);
    ABSENT3(fmi3SetShiftDecimal, &real);
    ABSENT3(fmi3SetShiftFraction, &counter, &counter);
    ABSENT3(fmi3GetOutputDerivatives, &order, &real, 0);
    REFUSED(fmi3EnterConfigurationMode(c));
    REFUSED(fmi3ExitConfigurationMode(c));
    REFUSED(fmi3EnterStepMode(c));
    REFUSED(fmi3ActivateModelPartition(c, 0, 0.0));
    REFUSED(fmi3GetNumberOfVariableDependencies(c, 0, &size));
    REFUSED(fmi3GetVariableDependencies(c, 0, &size, NULL, &size, &dependency, 0));
    fmi3FreeInstance(c);
}

/* ---- the kernel's functions that no FMU calls ------------------------------------------------ */

static void test_model_by_pointer(void) {
    fmi2Component c = instance2(fmi2CoSimulation);
    component *core = c;
    model_values direct = core->now.values, called = direct, direction = {0}, change[2];
    memset(change, 0, sizeof change);
    direction.time = 1.0;
    direction.input.speed = 1.0;
    kind->evaluate(&core->table, &direct);
    model_evaluate(kind, &core->table, &called);
    CHECK(memcmp(&direct, &called, sizeof direct) == 0);
    kind->tangent(&core->table, &direct, &direction, &change[0]);
    model_tangent(kind, &core->table, &direct, &direction, &change[1]);
    CHECK(memcmp(&change[0], &change[1], sizeof change[0]) == 0);
    CHECK(kind->advance(&core->table, &direct, 1e-3, 1e-6) == NULL);
    CHECK(model_advance(kind, &core->table, &called, 1e-3, 1e-6) == NULL);
    CHECK(memcmp(&direct, &called, sizeof direct) == 0);
    fmi2FreeInstance(c);
}

/* A node's creepage is where its u says it is. */
static void test_nodes(void) {
    for (uint32_t one_axis = 0; one_axis < 2; one_axis++)
        for (int i = 1; i < 20; i++) {
            creep_table shape = {.one_axis = one_axis, .twice_decay = 3, .root_k = 1};
            creep_node node;
            double u = 0.05 * i, k = 0.3;
            creep_table_node(&shape, u, k, &node);
            CHECK(node.normalized_creepage > 0.0 && node.weight > 0.0);
            double t = one_axis ? node.normalized_creepage
                                : creep_table_place(node.normalized_creepage, k);
            CHECK(fabs(t / (1.0 + t) - u) < 1e-12);
        }
}

static void test_roots(void) {
    for (int i = -300; i <= 300; i += 7) {
        double v = pow(10.0, i), root = cube_root(v);
        CHECK(fabs(root * root * root / v - 1.0) < 1e-14);
    }
    CHECK(cube_root(INFINITY) == INFINITY && isnan(cube_root(NAN)));
}

/* Headers of tables with a right checksum, and one thing wrong. */
static void test_table_headers(void) {
    enum { HEADER = 192 };
    static const struct {
        size_t at, size;
        double value;
        const char *says;
    } wrong[] = {
        {72, 4, 2.0, "shape"},          {76, 4, 17.0, "shape"},   {80, 4, 17.0, "shape"},
        {84, 4, 2.0, "shape"},          {24, 4, 4097.0, "cells"}, {28, 4, 4097.0, "cells"},
        {24, 4, 0.0, "cells"},          {80, 4, 3.0, "corner"},   {64, 8, -1.0, "static_to"},
        {64, 8, NAN, "static_to"},      {32, 8, 0.0, "k_max"},    {32, 8, INFINITY, "k_max"},
        {HEADER, 8, NAN, "not finite"}, {HEADER, 8, 1.0, NULL},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        double words[HEADER / 8 + 4] = {0.0}; /* one axis, one cell, four coefficients */
        char *bytes = (char *)words;
        uint32_t one = 1, whole = (uint32_t)wrong[i].value;
        creep_table table;
        memcpy(bytes + 24, &one, 4);
        memcpy(bytes + 28, &one, 4);
        words[4] = 2.0;
        memcpy(bytes + 72, &one, 4);
        if (wrong[i].size == 4) memcpy(bytes + wrong[i].at, &whole, 4);
        else memcpy(bytes + wrong[i].at, &wrong[i].value, 8);
        checked_file_frame(bytes, sizeof words, "CREEPTAB", 2);
        const char *error = creep_table_open(&table, bytes, sizeof words);
        CHECK((error == NULL) == (wrong[i].says == NULL));
        CHECK(error == NULL || strstr(error, wrong[i].says) != NULL);
        checked_file_frame(bytes, sizeof words - 8, "CREEPTAB", 2); /* a coefficient is missing */
        CHECK(creep_table_open(&table, bytes, sizeof words - 8) != NULL);
        checked_file_frame(bytes, HEADER - 8, "CREEPTAB", 2);
        CHECK(creep_table_open(&table, bytes, HEADER - 8) != NULL);
    }
}

/* Null pointers where the standard wants values. */
static void test_null_pointers(void) {
    fmi2Component c = instance2(fmi2ModelExchange), s = instance2(fmi2CoSimulation);
    fmi3Instance d = instance3(1), t = instance3(0);
    unsigned r[1] = {0};
    double x[1] = {0.0};
    fmi2Boolean b2;
    fmi3Boolean b[5];
    void *saved2 = NULL, *saved3 = NULL;
    size_t n;
    CHECK(fmi2Instantiate(NULL, fmi2CoSimulation, token, NULL, &CALLBACKS, 0, 1) == NULL);
    REFUSED(fmi2SetDebugLogging(c, 1, 1, NULL));
    REFUSED(fmi3SetDebugLogging(d, 1, 1, NULL));
    REFUSED(fmi2GetReal(c, NULL, 1, x));
    REFUSED(fmi2GetReal(c, r, 1, NULL));
    REFUSED(fmi2SetReal(c, NULL, 1, x));
    REFUSED(fmi2SetReal(c, r, 1, NULL));
    REFUSED(fmi2GetBoolean(c, NULL, 1, &b2));
    REFUSED(fmi2SetBoolean(c, r, 1, NULL));
    REFUSED(fmi3GetFloat64(d, NULL, 1, x, 1));
    REFUSED(fmi3SetFloat64(d, r, 1, NULL, 1));
    REFUSED(fmi3GetBoolean(d, r, 1, NULL, 1));
    REFUSED(fmi3SetBoolean(d, NULL, 1, b, 1));
    FINE(fmi2GetReal(c, NULL, 0, NULL));
    FINE(fmi3SetFloat64(d, NULL, 0, NULL, 0));
    FINE(fmi2GetFMUstate(c, &saved2));
    FINE(fmi3GetFMUState(d, &saved3));
    REFUSED(fmi2SerializedFMUstateSize(c, saved2, NULL));
    REFUSED(fmi3SerializedFMUStateSize(d, saved3, NULL));
    FINE(fmi2SerializedFMUstateSize(c, saved2, &n));
    REFUSED(fmi2SerializeFMUstate(c, saved2, NULL, n));
    REFUSED(fmi3SerializeFMUState(d, saved3, NULL, n));
    REFUSED(fmi2DeSerializeFMUstate(c, NULL, n, &saved2));
    REFUSED(fmi3DeserializeFMUState(d, NULL, n, &saved3));
    fmi2FreeFMUstate(c, &saved2);
    fmi3FreeFMUState(d, &saved3);
    for (int i = 0; i < 2; i++) {
        FINE(fmi2SetupExperiment(i ? s : c, 0, 0.0, 0.0, 0, 0.0));
        FINE(fmi2EnterInitializationMode(i ? s : c));
        FINE(fmi3EnterInitializationMode(i ? t : d, 0, 0.0, 0.0, 0, 0.0));
    }
    REFUSED(fmi2GetDirectionalDerivative(c, NULL, 1, r, 1, x, x));
    REFUSED(fmi2GetDirectionalDerivative(c, r, 1, r, 1, NULL, x));
    REFUSED(fmi3GetDirectionalDerivative(d, r, 1, NULL, 1, x, 1, x, 1));
    REFUSED(fmi3GetAdjointDerivative(d, r, 1, r, 1, x, 1, NULL, 1));
    for (int i = 0; i < 2; i++) {
        FINE(fmi2ExitInitializationMode(i ? s : c));
        FINE(fmi3ExitInitializationMode(i ? t : d));
    }
    REFUSED(fmi2NewDiscreteStates(c, NULL));
    REFUSED(fmi3UpdateDiscreteStates(d, b, b, b, b, b, NULL));
    REFUSED(fmi3GetNumberOfEventIndicators(d, NULL));
    REFUSED(fmi3GetNumberOfContinuousStates(d, NULL));
    REFUSED(fmi2GetContinuousStates(c, NULL, 1));
    REFUSED(fmi2SetContinuousStates(c, NULL, 1));
    REFUSED(fmi2GetDerivatives(c, NULL, 1));
    REFUSED(fmi2GetEventIndicators(c, NULL, 1));
    REFUSED(fmi2GetNominalsOfContinuousStates(c, NULL, 1));
    REFUSED(fmi3GetContinuousStates(d, NULL, 1));
    REFUSED(fmi3SetContinuousStates(d, NULL, 1));
    REFUSED(fmi3GetContinuousStateDerivatives(d, NULL, 1));
    REFUSED(fmi3GetEventIndicators(d, NULL, 1));
    REFUSED(fmi3GetNominalsOfContinuousStates(d, NULL, 1));
    FINE(fmi2EnterContinuousTimeMode(c));
    FINE(fmi3EnterContinuousTimeMode(d));
    REFUSED(fmi2CompletedIntegratorStep(c, 1, &b2, NULL));
    REFUSED(fmi3CompletedIntegratorStep(d, 1, NULL, b));
    REFUSED(fmi2GetRealStatus(s, fmi2LastSuccessfulTime, NULL));
    REFUSED(fmi2GetBooleanStatus(s, fmi2Terminated, NULL));
    REFUSED(fmi3DoStep(t, 0.0, 1e-3, 1, b, b, b, NULL));
    fmi2FreeInstance(c);
    fmi2FreeInstance(s);
    fmi3FreeInstance(d);
    fmi3FreeInstance(t);
}

/* Files of what contacts and pairs of bodies add to a table. */
static void test_plane_files(void) {
    static const struct {
        double stiffness;
        size_t count;
        const char *says;
    } wrong[] = {{0.7, 5, NULL}, {0.0, 5, "shape"}, {NAN, 5, "not finite"}, {0.7, 4, "number of"}};
    double words[8] = {0.0};
    creep_forces pair;
    creep_table table = {.k_max = 1.0};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        plane_contact contact;
        size_t size = CHECKED_FILE_FRAME + wrong[i].count * sizeof(double);
        words[3] = wrong[i].stiffness;
        checked_file_frame(words, size, "PLANECON", 1);
        const char *error = plane_contact_open(&contact, words, size);
        CHECK((error == NULL) == (wrong[i].says == NULL));
        CHECK(error == NULL || strstr(error, wrong[i].says) != NULL);
    }
    checked_file_frame(words, sizeof words, "CREEPAIR", 1);
    CHECK(strstr(creep_forces_open(&pair, &table, words, sizeof words), "number of") != NULL);
}

/* A location as a tool may write it, and a file that opens but cannot be read: a folder. */
static void test_resources(const char *folder) {
    char place[4096], message[4096];
    void *bytes;
    size_t size;
    snprintf(place, sizeof place, "file://localhost%s/%%72esources/", folder);
    CHECK(resource_read(place, "start_values.bin", &bytes, &size, message, sizeof message) == NULL);
    free(bytes);
    const char *error = resource_read(folder, "resources", &bytes, &size, message, sizeof message);
    CHECK(error != NULL && strstr(error, "cannot read") != NULL && bytes == NULL);
    error = resource_read(folder, "nothing", &bytes, &size, message, sizeof message);
    CHECK(error != NULL && strstr(error, "cannot open") != NULL && bytes == NULL);
}

/* The implicit element with a force that acts a step later: the force at rest of slip is the same.
 */
static void test_parallel_exchange(void) {
    if (!has("parallel_exchange")) return;
    unsigned set[2] = {reference_of("implicit"), reference_of("parallel_exchange")};
    unsigned omega = reference_of("omega"), force = reference_of("creep_force");
    for (fmi2Boolean parallel = 0; parallel < 2; parallel++) {
        fmi2Component c = instance2(fmi2CoSimulation);
        fmi2Boolean truths[2] = {1, parallel};
        double turning = 20.05, first = 0.0, last = 0.0;
        FINE(fmi2SetBoolean(c, set, 2, truths));
        FINE(fmi2SetReal(c, &omega, 1, &turning));
        FINE(fmi2EnterInitializationMode(c));
        FINE(fmi2ExitInitializationMode(c));
        FINE(fmi2DoStep(c, 0.0, 1e-3, 1));
        FINE(fmi2GetReal(c, &force, 1, &first));
        for (int i = 1; i < 20; i++) FINE(fmi2DoStep(c, 1e-3 * i, 1e-3, 1));
        FINE(fmi2GetReal(c, &force, 1, &last));
        CHECK(first > 0.0 && isfinite(last));
        int follows = ((component *)c)->states > 0; /* with relaxation it is still to build up */
        CHECK(follows || fabs(last / first - 1.0) < 1e-2);
        fmi2FreeInstance(c);
    }
}

/* A body that takes the force one step later than the element expects: if the force swings, which
 * it does not with every law, that is said once. */
static void test_wrong_exchange(void) {
    if (!has("parallel_exchange")) return;
    unsigned omega = reference_of("omega"), force = reference_of("creep_force");
    unsigned known[2] = {reference_of("effective_inverse_mass"), reference_of("radius")};
    for (int implicit = 0; implicit < 2; implicit++) {
        const unsigned mode = reference_of("implicit");
        fmi2Component c = instance2(fmi2CoSimulation);
        double spin = 20.1, now, last, step = 5e-3, numbers[2];
        FINE(fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0));
        FINE(fmi2EnterInitializationMode(c));
        FINE(fmi2SetBoolean(c, &mode, 1, &implicit));
        FINE(fmi2ExitInitializationMode(c));
        FINE(fmi2GetReal(c, &force, 1, &last));
        FINE(fmi2GetReal(c, known, 2, numbers));
        double inverse_mass = numbers[0], radius = numbers[1], drive = 0.9 * inverse_mass * 23e3;
        int before = said;
        for (int i = 0; i < 300; i++) {
            FINE(fmi2SetReal(c, &omega, 1, &spin));
            FINE(fmi2DoStep(c, step * i, step, 1));
            FINE(fmi2GetReal(c, &force, 1, &now));
            spin += step * (drive - inverse_mass * last) / radius;
            last = now;
        }
        CHECK(said == before || said == before + 1);
        fmi2FreeInstance(c);
    }
}

/* A body that takes the force at once, in steps that are too long for a held force, and whose mass
 * is a third of what an implicit one expects: it swings, which is said once. */
static void test_swinging(void) {
    if (!has("parallel_exchange")) return;
    unsigned omega = reference_of("omega"), force = reference_of("creep_force");
    unsigned known[2] = {reference_of("effective_inverse_mass"), reference_of("radius")};
    for (int implicit = 0; implicit < 2; implicit++) {
        const unsigned mode = reference_of("implicit");
        fmi2Component c = instance2(fmi2CoSimulation);
        double spin = 20.0, now, step = 2e-2, numbers[2];
        FINE(fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0));
        FINE(fmi2EnterInitializationMode(c));
        FINE(fmi2SetBoolean(c, &mode, 1, &implicit));
        FINE(fmi2ExitInitializationMode(c));
        FINE(fmi2GetReal(c, known, 2, numbers));
        double inverse_mass = (implicit ? 3.0 : 1.0) * numbers[0], radius = numbers[1];
        int before = said;
        for (int i = 0; i < 300; i++) {
            FINE(fmi2SetReal(c, &omega, 1, &spin));
            FINE(fmi2DoStep(c, step * i, step, 1));
            FINE(fmi2GetReal(c, &force, 1, &now));
            spin += step * inverse_mass * (3e3 - now) / radius;
        }
        CHECK(said == before + 1);
        fmi2FreeInstance(c);
    }
}

/* A force that is held at static friction changes with static friction alone. */
static void test_held_force(void) {
    creep_table table = {.k_max = 10.0};
    force_element_parameters p = SOME_CONTACT, dp = {.static_friction = 1.0};
    force_element_input no_change = {0};
    p.weakening_length = 1.3e-3;
    p.slope_reduction = 1.0;
    int held = 0;
    for (int i = 0; i < 40; i++) {
        force_element_input in = {.omega = 20.0 + 0.02 * i,
                                  .speed = 10.0,
                                  .normal_load = p.nominal_load,
                                  .friction_scale = 1.0};
        force_element_output out, change;
        force_element_evaluate(&table, &p, &in, &out);
        force_element_tangent(&table, &p, &in, &out, &dp, &no_change, &change);
        if (out.force_limited == 0.0) continue;
        held++;
        CHECK(fabs(out.traction_coefficient / p.static_friction - 1.0) < 1e-12);
        CHECK(fabs(change.traction_coefficient - 1.0) < 1e-12 && out.force_gradient == 0.0);
    }
    CHECK(held > 0);
}

/* Next to no slip at all: derivatives of what is below the smallest normal number are numbers. */
static void test_smallest_slip(void) {
    creep_table table = {.k_max = 2.0};
    force_element_parameters p = SOME_CONTACT, dp = {0};
    force_element_input in = {.omega = 7.5e-319,
                              .speed = 7.5e-319,
                              .normal_load = p.nominal_load,
                              .friction_scale = 1.2e-4};
    force_element_input din = {.normal_load = -1e-5};
    force_element_output out, change;
    p.weakening_length = 1.3e-3;
    force_element_evaluate(&table, &p, &in, &out);
    CHECK(out.k_hat_limited > 0.0 && out.creepage != 0.0);
    force_element_tangent(&table, &p, &in, &out, &dp, &din, &change);
    const double *numbers = (const double *)&change;
    for (size_t i = 0; i < sizeof change / sizeof *numbers; i++) CHECK(isfinite(numbers[i]));
}

int main(int count, char **arguments) {
    if (count != 5) return 2;
    resources = arguments[1];
    token = arguments[2];
    kind = model_of(arguments[3]);
    if (kind == NULL) return 2;
    test_names();
    test_logging();
    test_tokens();
    test_set_up();
    test_sum_of_steps();
    test_values();
    test_friction();
    test_failing_step();
    test_model_exchange2();
    test_model_exchange3();
    test_derivatives();
    test_saved_states();
    test_absent2();
    test_absent3();
    test_model_by_pointer();
    test_nodes();
    test_roots();
    test_table_headers();
    test_plane_files();
    test_null_pointers();
    test_resources(arguments[4]);
    test_parallel_exchange();
    test_swinging();
    test_wrong_exchange();
    test_held_force();
    test_smallest_slip();
    return verdict();
}

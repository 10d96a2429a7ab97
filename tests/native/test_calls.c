/* Every function of both versions of FMI, called as it may be and as it may not: what it returns,
 * and what every refusal leaves behind. And the kernel's functions that no FMU calls.
 *
 *     test_calls RESOURCES TOKEN KIND FOLDER
 *
 * RESOURCES is a URI, and FOLDER the path of the folder that it is in. */
#include "absent.h"
#include "checked_file.h"
#include "checks.h"
#include "component.h"
#include "file_io.h"
#include "model_functions.h"
#include "simd_math.h"
#include "token.h"

static int messages; /* in the log */
static const fmi *v; /* the version that is called */

/* A call that must end with this status, and with a message if it is not fine. */
#define MUST_END(call, status)                       \
    do {                                             \
        int before_ = messages;                      \
        CHECK((int)(call) == (status));              \
        CHECK(messages == before_ + ((status) > 0)); \
    } while (0)
#define REFUSED(call) MUST_END(call, RESULT_ERROR)
#define DISCARDED(call) MUST_END(call, RESULT_DISCARD)
#define FINE(call) CHECK((int)(call) <= RESULT_OK) /* or a version has no such call */

static const model *kind;
static const char *resources, *token;

static unsigned reference_of(const char *name) {
    for (unsigned i = 0; i < kind->count; i++)
        if (strcmp(kind->variables[i].name, name) == 0) return i;
    return (unsigned)kind->count;
}

static int has(const char *name) { return reference_of(name) < kind->count; }

static void *instance(int exchange) {
    void *c = v->open(exchange, token, resources, 1, &messages);
    CHECK(c != NULL);
    return c;
}

static void *initialized(int exchange) {
    void *c = instance(exchange);
    FINE(start(v, c, 0.0));
    return c;
}

/* Set up the experiment, where the version has it. */
static int begin(void *c, const experiment *e) {
    return v->version == 2 ? v->set_up(c, e) : v->enter(c, e);
}

static int refused(void *c, unsigned which) {
    return v->version == 2 ? refused2(c, which) : refused3(c, which);
}

static void log_nameless(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                         fmi2String category, fmi2String message, ...) {
    (void)environment, (void)category;
    CHECK(strcmp(name, "") == 0 && status != fmi2OK && message[0] != '\0');
    messages++;
}

static void test_names(void) {
    static const fmi2CallbackFunctions callbacks = {.logger = log_nameless};
    CHECK(strcmp(fmi2GetVersion(), "2.0") == 0);
    CHECK(strcmp(fmi2GetTypesPlatform(), "default") == 0);
    CHECK(strncmp(fmi3GetVersion(), "3.0", 3) == 0);
    CHECK(strncmp(token, contactlib_token(), strlen(contactlib_token())) == 0);
    CHECK(model_of("no model") == NULL);
    fmi2Component c = fmi2Instantiate(NULL, fmi2CoSimulation, token, resources, &callbacks, 0, 1);
    REFUSED(fmi2CancelStep(c));
    fmi2FreeInstance(c);
    /* Percent signs are doubled, for tools that take the text for a format. */
    REFUSED(fmi2Instantiate(NULL, fmi2CoSimulation, "%s%n", resources, &callbacks, 0, 1) == NULL
                ? RESULT_ERROR
                : RESULT_OK);
    c = fmi2Instantiate("100 %s%n", fmi2CoSimulation, token, resources, NULL, 0, 1);
    CHECK(fmi2CancelStep(c) == fmi2Error);
    fmi2FreeInstance(c);
}

static void test_logging(void) {
    void *c = instance(0);
    const char *known[] = {"logStatusError"}, *unknown[] = {"logStatusError", "logAll"};
    const char *null[] = {NULL};
    FINE(v->set_logging(c, 1, 1, known));
    REFUSED(v->set_logging(c, 1, 2, unknown));
    REFUSED(v->set_logging(c, 1, 1, null));
    FINE(v->set_logging(c, 0, 1, known));
    int before = messages;
    CHECK(refused(c, 0) == RESULT_ERROR && messages == before); /* that category is off */
    FINE(v->set_logging(c, 0, 0, NULL));                        /* errors are on again */
    REFUSED(refused(c, 0));
    v->close(c);
    /* Without a logger there is no message, and nothing else differs. */
    before = messages;
    CHECK(v->open(0, "?", resources, 1, NULL) == NULL);
    CHECK(fmi3InstantiateCoSimulation("x", token, resources, 0, 1, 1, 0, NULL, 0, NULL, NULL,
                                      NULL) == NULL);
    CHECK(fmi3InstantiateScheduledExecution("x", token, resources, 0, 1, NULL, NULL, NULL, NULL,
                                            NULL) == NULL);
    CHECK(messages == before);
    CHECK(fmi3InstantiateCoSimulation("x", token, resources, 0, 1, 1, 0, NULL, 0, &messages, note3,
                                      NULL) == NULL);
    CHECK(fmi3InstantiateScheduledExecution("x", token, resources, 0, 1, &messages, note3, NULL,
                                            NULL, NULL) == NULL);
    CHECK(messages == before + 2);
}

/* Another token or another place: no instance, and a message. */
static void test_tokens_and_places(void) {
    static char longest[TOKEN_SIZE + 64], endless[100001];
    static const char *const ends[] = {
        "",
        "-",
        "-wheelset",
        "-none-x",
        "-a_kind_whose_name_is_longer_than_any_other-x",
        "-wheelset-digest_that_is_longer_than_the_room_that_a_state_keeps_for_it"};
    static const char *const tokens[] = {"another", "", NULL};
    static const char *const places[] = {NULL,
                                         "",
                                         "file:///no/such/folder",
                                         "file://elsewhere/folder",
                                         "file:///broken%2",
                                         "file:///broken%zz",
                                         "file:///null%00",
                                         endless};
    int before = messages, count = 0;
    memset(endless, 'a', sizeof endless - 1);
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++, count++) {
        strcpy(longest, contactlib_token());
        strcat(longest, ends[i]);
        CHECK(v->open(0, longest, resources, 1, &messages) == NULL);
    }
    for (size_t i = 0; i < sizeof tokens / sizeof *tokens; i++, count++)
        CHECK(v->open(1, tokens[i], resources, 1, &messages) == NULL);
    for (size_t i = 0; i < sizeof places / sizeof *places; i++, count++)
        CHECK(v->open(0, token, places[i], 1, &messages) == NULL);
    CHECK(messages == before + count);
    CHECK(v->step(NULL, 0.0, 1.0) == RESULT_ERROR);
    v->close(NULL);
}

static void test_set_up(void) {
    static const experiment wrong[] = {{.start = NAN},
                                       {.start = INFINITY},
                                       {.start = 1.0, .stop = 0.5, .has_stop = 1},
                                       {.start = 1.0, .stop = NAN, .has_stop = 1},
                                       {.has_tolerance = 1}};
    const experiment e = {.tolerance = 1e-4, .stop = 1e-2, .has_tolerance = 1, .has_stop = 1};
    void *c = instance(0);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) REFUSED(begin(c, &wrong[i]));
    REFUSED(v->leave(c));
    FINE(v->set_up(c, &e));
    FINE(v->enter(c, &e));
    FINE(v->leave(c));
    REFUSED(v->enter(c, &e));
    REFUSED(v->step(c, 0.0, 0.0));
    REFUSED(v->step(c, 0.0, NAN));
    REFUSED(v->step(c, 1.0, 1e-3));
    REFUSED(v->step(c, 0.0, 2e-2));
    FINE(v->step(c, 0.0, 1e-2));
    REFUSED(v->step(c, 1e-2, 1e-3));
    v->close(c);
}

/* A whole day by steps that a tool has added up, and with its end named: the sum is off by far more
 * than the last bits. */
static void test_sum_of_steps(void) {
    const double day = 86400.0, step = 1e-3, off = 2.62e-5;
    for (int side = -1; side <= 1; side += 2) {
        void *c = instance(0);
        const experiment e = {.start = day + side * off - step, .stop = day, .has_stop = 1};
        FINE(v->set_up(c, &e));
        FINE(v->enter(c, &e));
        FINE(v->leave(c));
        FINE(v->step(c, e.start, step));
        REFUSED(v->step(c, day + side * off, step));
        v->close(c);
    }
}

/* A tool whose clock has single precision, with its end named. */
static void test_single_clock(void) {
    const double step = 1e-3, off = 2e-5;
    const experiment e = {.start = 1e3, .stop = 1e3 + 2.0 * step, .has_stop = 1};
    void *c = instance(0);
    FINE(v->set_up(c, &e));
    FINE(v->enter(c, &e));
    FINE(v->leave(c));
    int before = messages;
    FINE(v->step(c, e.start - off, step));
    CHECK(messages == before + 1);
    FINE(v->step(c, e.start + step + off, step));
    CHECK(messages == before + 1);
    REFUSED(v->step(c, e.start + 2.0 * step, step));
    REFUSED(v->step(c, e.start + 3.0 * step, 1e-6));
    v->close(c);
}

/* A wheel that lifts off has no ellipse; one that bears a load needs one. */
static void test_lift_off(void) {
    if (!kind->has_bodies) return;
    unsigned ellipse[3] = {reference_of("semi_axis_x"), reference_of("semi_axis_y"),
                           reference_of("normal_load")};
    unsigned slip = reference_of("spin"), force = reference_of("force_y");
    double none[3] = {0.0}, loaded[3] = {5e-3, 0.0, 9e4}, value = 0.1;
    void *c = instance(0);
    FINE(v->set(c, ellipse, 3, none));
    FINE(start(v, c, 0.0));
    int before = messages;
    FINE(v->set(c, &slip, 1, &value));
    FINE(v->step(c, 0.0, 1e-3));
    FINE(v->get(c, &force, 1, &value));
    CHECK(value == 0.0 && messages == before + 1);
    FINE(v->derivative(c, 0, &force, 1, ellipse, 3, none, &value));
    loaded[1] = 4e-3;
    FINE(v->set(c, ellipse, 3, loaded));
    FINE(v->step(c, 1e-3, 1e-3));
    FINE(v->get(c, &force, 1, &value));
    CHECK(value != 0.0);
    for (int axis = 0; axis < 2; axis++) {
        loaded[axis] = 0.0;
        FINE(v->set(c, ellipse, 3, loaded));
        DISCARDED(v->step(c, 2e-3, 1e-3));
        loaded[axis] = 5e-3;
    }
    v->close(c);
}

/* The start value of omega moves with the radius, until it is set. */
static void test_radius(void) {
    if (!has("radius") || !has("omega")) return;
    unsigned radius = reference_of("radius"), omega = reference_of("omega");
    double before, after, r, half;
    void *c = instance(0);
    FINE(v->get(c, &radius, 1, &r));
    FINE(v->get(c, &omega, 1, &before));
    half = 0.5 * r;
    FINE(v->set(c, &radius, 1, &half));
    FINE(v->get(c, &omega, 1, &after));
    CHECK(after == 2.0 * before);
    FINE(v->set(c, &omega, 1, &before));
    FINE(v->set(c, &radius, 1, &r));
    FINE(v->get(c, &omega, 1, &after));
    CHECK(after == before);
    v->close(c);
}

static void test_values(void) {
    void *c = instance(0);
    unsigned speed = reference_of(kind->has_bodies ? "creepage_x" : "speed");
    unsigned time = reference_of("time"), radius = reference_of("radius");
    double value = 3.0, big = 1e300, nan = NAN;
    int truths[2] = {1, 1};
    FINE(v->set(c, &speed, 1, &value));
    FINE(v->get(c, &speed, 1, &value));
    CHECK(value == 3.0);
    REFUSED(v->set(c, &time, 1, &value));
    REFUSED(v->set_boolean(c, &speed, 1, truths));
    REFUSED(v->get_boolean(c, &speed, 1, truths));
    DISCARDED(v->set(c, &speed, 1, &big));
    DISCARDED(v->set(c, &speed, 1, &nan));
    for (unsigned r = (unsigned)kind->count; r < kind->count + 3; r++)
        REFUSED(v->get(c, &r, 1, &value));
    if (has("implicit")) {
        unsigned both[2] = {reference_of("implicit"), reference_of("implicit")};
        FINE(v->set_boolean(c, both, 2, truths));
        FINE(v->get_boolean(c, both, 2, truths));
        CHECK(truths[0] && truths[1]);
    }
    FINE(start(v, c, 0.0));
    REFUSED(v->set(c, &radius, 1, &value));
    v->close(c);
}

/* Friction and shapes that no single limit can judge, and a weakening zone that the law's limit
 * does not hold for. */
static void test_friction(void) {
    if (!kind->has_contact) return;
    unsigned at = reference_of("static_friction"), force = reference_of("creep_force");
    unsigned length = reference_of("weakening_length");
    double low = 1e-3, other = 0.5, value, longest = 1.0;
    void *c = instance(0);
    /* FMI 2 has no status for a value that is only discarded here. */
    int wrong = v->version == 2 ? RESULT_ERROR : RESULT_DISCARD;
    FINE(v->set(c, &at, 1, &low));
    MUST_END(v->get(c, &force, 1, &value), wrong);
    CHECK(start(v, c, 0.0) == wrong);
    v->close(c);
    c = instance(0);
    const component *core = c; /* an instance starts with it */
    FINE(v->set(c, &at, 1, &other));
    if (core->table.static_to_kinetic > 0.0) MUST_END(v->get(c, &force, 1, &value), wrong);
    else FINE(v->get(c, &force, 1, &value));
    v->close(c);
    enum { ANOTHER_SHAPE, TWO_FALLS, SHORT_LINE, CASES };
    for (int i = 0; i < CASES; i++) {
        c = instance(0);
        force_element_parameters *p = &((component *)c)->now->values->contact;
        if (i == ANOTHER_SHAPE) p->softening += 0.1;
        if (i == TWO_FALLS) p->softening_temperature = 500.0, p->slip_rate_decay = 0.1;
        if (i == SHORT_LINE) {
            ((component *)c)->start->contact.elliptic = p->elliptic = 0.0;
            p->transverse_half_length = p->semi_width;
        }
        MUST_END(v->get(c, &force, 1, &value), wrong);
        v->close(c);
    }
    c = instance(0);
    core = c;
    int limited = core->table.static_to_kinetic == 0.0 && !core->table.one_axis;
    FINE(v->set(c, &length, 1, &longest));
    int before = messages;
    FINE(start(v, c, 0.0)); /* fine, with a warning */
    CHECK(messages == before + limited);
    v->close(c);
}

static void test_failing_step(void) {
    const char *drive = kind->is_vehicle ? "motor_torque" : "drive_torque";
    if (!has(drive)) return;
    unsigned references[3] = {reference_of("inertia"), reference_of("damping"),
                              reference_of(drive)};
    double values[3] = {1e-9, 0.0, 1e12}, reached = 1.0;
    void *c = instance(0);
    FINE(v->set(c, references, 3, values));
    FINE(start(v, c, 1e-10));
    DISCARDED(v->step(c, 0.0, 1e300));
    DISCARDED(v->step(c, 0.0, 1e-6)); /* to a speed out of range */
    if (v->version == 2) {
        FINE(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &reached));
        CHECK(reached == 0.0);
    }
    v->close(c);
}

/* A wheel that stands swings on its contact with memory: too often for a long step, and one that
 * spins there needs more than one substep. */
static void test_standing(void) {
    for (int limit = 0; limit < 2; limit++) {
        void *c = instance(0);
        if (has("drive_torque") && !kind->is_vehicle &&
            ((component *)c)->now->values->contact.memory > 0.0) {
            unsigned given[4] = {reference_of("omega"), reference_of("speed"),
                                 reference_of("drive_torque"), reference_of("max_substeps")};
            double values[4] = {-1.5 * limit, 0.0, 1e3, limit}, step = limit > 0 ? 0.1 : 10.0;
            FINE(v->set(c, given, 4, values));
            FINE(start(v, c, 0.0));
            int before = messages;
            FINE(v->step(c, 0.0, step));
            FINE(v->step(c, step, step)); /* once is enough */
            CHECK(messages == before + 1);
        }
        v->close(c);
    }
}

static void test_model_exchange(void) {
    void *c = instance(1);
    size_t states = ((component *)c)->states, indicators = component_indicators(c), n;
    double x[MAX_VARIABLES];
    const experiment e = {0};
    if (v->version == 3) {
        FINE(fmi3GetNumberOfContinuousStates(c, &n));
        CHECK(n == states);
        FINE(fmi3GetNumberOfEventIndicators(c, &n));
        CHECK(n == indicators);
    }
    REFUSED(v->events(c));
    REFUSED(v->set_time(c, 0.0));
    if (has("brake_torque")) { /* the advice on steps knows its pads */
        unsigned brake = reference_of("brake_torque");
        double torque = 1e3;
        FINE(v->set(c, &brake, 1, &torque));
    }
    FINE(v->enter(c, &e));
    if (v->version == 3) FINE(fmi3EvaluateDiscreteStates(c));
    FINE(v->leave(c));
    FINE(v->update(c));
    FINE(v->continuous(c));
    FINE(v->set_time(c, 1.0));
    REFUSED(v->set_time(c, NAN));
    FINE(v->get_states(c, x, states));
    FINE(v->set_states(c, x, states));
    if (states > 0) {
        x[0] = NAN;
        DISCARDED(v->set_states(c, x, states));
    }
    FINE(v->get_rates(c, x, states));
    for (size_t i = 0; i < states; i++) CHECK(isfinite(x[i]));
    FINE(v->get_indicators(c, x, indicators));
    FINE(v->get_nominals(c, x, states));
    for (size_t i = 0; i < states; i++) CHECK(x[i] > 0.0);
    REFUSED(v->get_states(c, x, states + 1));
    REFUSED(v->set_states(c, x, states + 1));
    REFUSED(v->get_rates(c, x, states + 1));
    REFUSED(v->get_indicators(c, x, indicators + 1));
    REFUSED(v->get_nominals(c, x, states + 1));
    FINE(v->completed(c));
    REFUSED(v->update(c));
    if (v->version == 3) REFUSED(fmi3EvaluateDiscreteStates(c));
    FINE(v->events(c));
    REFUSED(v->completed(c));
    REFUSED(v->step(c, 1.0, 1e-3));
    FINE(v->terminate(c));
    REFUSED(v->continuous(c));
    v->close(c);
}

/* A truth value follows the sign of its indicator, but not before the event. */
static void test_event(void) {
    void *c = initialized(1);
    size_t states = ((component *)c)->states;
    int falls = !((component *)c)->table.one_axis; /* Polach's law does not fall */
    unsigned omega = reference_of("omega"), force = reference_of("creep_force");
    unsigned falling = reference_of("falling_branch");
    double z[FLAG_COUNT], turning = 20.5, one = 1.0, slope = -1.0;
    int flag;
    if (has("falling_branch") && states == 0) {
        FINE(v->continuous(c));
        FINE(v->set(c, &omega, 1, &turning));
        FINE(v->get_boolean(c, &falling, 1, &flag));
        CHECK(!flag);
        FINE(v->get_indicators(c, z, FLAG_COUNT));
        CHECK((z[0] > 0.0) == falls && z[1] < 0.0);
        FINE(v->events(c));
        FINE(v->update(c));
        FINE(v->get_boolean(c, &falling, 1, &flag));
        CHECK(flag == falls);
        FINE(v->derivative(c, v->version == 3, &force, 1, &omega, 1, &one, &slope));
        CHECK((slope < 0.0) == falls);
    }
    v->close(c);
}

static void test_derivatives(void) {
    void *c = instance(1);
    unsigned many[MAX_VARIABLES + 1];
    const char *force = kind->has_contact ? "creep_force" : "speed";
    unsigned unknown = reference_of(kind->has_bodies ? "force_x" : force);
    unsigned known = reference_of(kind->has_bodies ? "shear_modulus" : "radius");
    unsigned omega = reference_of(kind->has_bodies ? "creepage_x" : "omega");
    double seed = 1.0, x[MAX_VARIABLES + 1], largest = 1e308;
    const experiment e = {0};
    FINE(v->enter(c, &e));
    FINE(v->derivative(c, 0, &unknown, 1, &known, 1, &seed, x));
    CHECK(isfinite(x[0]));
    /* The largest times the slope of the force is not finite. */
    CHECK(v->derivative(c, 0, &unknown, 1, &omega, 1, &largest, x) != 0 || isfinite(x[0]));
    REFUSED(v->derivative(c, 0, &known, 1, &known, 1, &seed, x));
    if (kind->has_contact || kind->has_bodies)
        REFUSED(v->derivative(c, 0, &unknown, 1, &unknown, 1, &seed, x));
    for (size_t i = 0; i <= MAX_VARIABLES; i++) many[i] = unknown;
    REFUSED(v->derivative(c, 0, many, MAX_VARIABLES + 1, &known, 1, &seed, x));
    known = (unsigned)kind->count;
    REFUSED(v->derivative(c, 0, &unknown, 1, &known, 1, &seed, x));
    v->close(c);
}

/* A state is taken only by an instance that it can belong to. */
static void test_saved_states(void) {
    void *c = initialized(0), *exchange = initialized(1), *saved = NULL, *read = NULL;
    char bytes[4096];
    size_t size = 0;
    FINE(v->save(c, &saved));
    REFUSED(v->save(c, NULL));
    REFUSED(v->restore(c, NULL));
    FINE(v->forget(c, NULL));
    REFUSED(v->restore(exchange, saved)); /* it is in a mode that has no way out there */
    FINE(v->save(exchange, &read));
    REFUSED(v->restore(c, read));
    FINE(v->forget(exchange, &read));
    FINE(v->size(c, saved, &size));
    CHECK(size <= sizeof bytes);
    REFUSED(v->serialize(c, NULL, bytes, size));
    REFUSED(v->serialize(c, saved, bytes, size - 1));
    FINE(v->serialize(c, saved, bytes, size));
    FINE(v->deserialize(c, bytes, size, &read));
    FINE(v->restore(c, read));
    for (int i = 0; i < 40; i++) {
        size_t at = (size_t)(random_unit() * (double)size);
        bytes[at] ^= 1;
        REFUSED(v->deserialize(c, bytes, size, &read));
        bytes[at] ^= 1;
        REFUSED(v->deserialize(c, bytes, at, &read));
    }
    ((component_state *)read)->values->past.length = -1.0;
    FINE(v->serialize(c, read, bytes, size));
    REFUSED(v->deserialize(c, bytes, size, &read));
    ((component_state *)read)->values->past.length = 0.0;
    FINE(v->serialize(c, read, bytes, size));
    FINE(v->deserialize(c, bytes, size, &read));
    /* Of another FMU of the same library, and of a stage that none is ever in. */
    ((component *)c)->token[0] ^= 1;
    REFUSED(v->deserialize(c, bytes, size, &read));
    ((component *)c)->token[0] ^= 1;
    ((component_state *)read)->stage = TERMINATED + 1;
    FINE(v->serialize(c, read, bytes, size));
    REFUSED(v->deserialize(c, bytes, size, &read));
    FINE(v->forget(c, &saved));
    FINE(v->forget(c, &read));
    CHECK(saved == NULL && read == NULL);
    FINE(v->reset(c));
    v->close(c);
    v->close(exchange);
}

/* Types that no model has: none of them is fine, one is refused, as is any of no instance. */
static void test_absent(void) {
    void *c = instance(0);
    const unsigned r = 0;
    fmi2Boolean truth = 1;
    for (unsigned i = 0; i < (unsigned)(v->version == 2 ? ABSENT2 : ABSENT3); i++) {
        int (*call)(void *, unsigned, const unsigned *, size_t) =
            v->version == 2 ? absent2 : absent3;
        FINE(call(c, i, NULL, 0));
        REFUSED(call(c, i, &r, 1));
        CHECK(call(NULL, i, NULL, 0) == RESULT_ERROR);
    }
    for (unsigned i = 0; i < (unsigned)(v->version == 2 ? REFUSED2 : REFUSED3); i++)
        REFUSED(refused(c, i));
    if (v->version == 2) {
        FINE(fmi2GetBooleanStatus(c, fmi2Terminated, &truth));
        CHECK(!truth);
    }
    v->close(c);
}

/* Null pointers where the standard requires values. */
static void test_null_pointers(void) {
    void *c = instance(1), *s = instance(0), *saved = NULL;
    unsigned r[1] = {0};
    double x[1] = {0.0};
    int b[1] = {0};
    size_t n;
    const experiment e = {0};
    REFUSED(v->set_logging(c, 1, 1, NULL));
    REFUSED(v->get(c, NULL, 1, x));
    REFUSED(v->get(c, r, 1, NULL));
    REFUSED(v->set(c, NULL, 1, x));
    REFUSED(v->set(c, r, 1, NULL));
    REFUSED(v->get_boolean(c, NULL, 1, b));
    REFUSED(v->get_boolean(c, r, 1, NULL));
    REFUSED(v->set_boolean(c, NULL, 1, b));
    REFUSED(v->set_boolean(c, r, 1, NULL));
    FINE(v->get(c, NULL, 0, NULL));
    FINE(v->set(c, NULL, 0, NULL));
    FINE(v->save(c, &saved));
    REFUSED(v->size(c, saved, NULL));
    FINE(v->size(c, saved, &n));
    REFUSED(v->serialize(c, saved, NULL, n));
    REFUSED(v->deserialize(c, NULL, n, &saved));
    v->forget(c, &saved);
    FINE(v->enter(c, &e));
    REFUSED(v->derivative(c, 0, NULL, 1, r, 1, x, x));
    REFUSED(v->derivative(c, 0, r, 1, NULL, 1, x, x));
    REFUSED(v->derivative(c, 0, r, 1, r, 1, NULL, x));
    REFUSED(v->derivative(c, v->version == 3, r, 1, r, 1, x, NULL));
    FINE(v->leave(c));
    REFUSED(v->get_states(c, NULL, 1));
    REFUSED(v->set_states(c, NULL, 1));
    REFUSED(v->get_rates(c, NULL, 1));
    REFUSED(v->get_indicators(c, NULL, 1));
    REFUSED(v->get_nominals(c, NULL, 1));
    FINE(start(v, s, 0.0));
    if (v->version == 2) {
        fmi2Boolean t;
        REFUSED(fmi2NewDiscreteStates(c, NULL));
        FINE(v->continuous(c));
        REFUSED(fmi2CompletedIntegratorStep(c, 1, &t, NULL));
        REFUSED(fmi2GetRealStatus(s, fmi2LastSuccessfulTime, NULL));
        REFUSED(fmi2GetBooleanStatus(s, fmi2Terminated, NULL));
    } else {
        fmi3Boolean t[1];
        REFUSED(fmi3UpdateDiscreteStates(c, t, t, t, t, t, NULL));
        REFUSED(fmi3GetNumberOfEventIndicators(c, NULL));
        REFUSED(fmi3GetNumberOfContinuousStates(c, NULL));
        FINE(v->continuous(c));
        REFUSED(fmi3CompletedIntegratorStep(c, 1, NULL, t));
        REFUSED(fmi3DoStep(s, 0.0, 1e-3, 1, t, t, t, NULL));
    }
    v->close(c);
    v->close(s);
}

/* FMI 3 distinguishes numbers of values from those of variables. */
static void test_numbers_of_values(void) {
    v = fmi_of(3);
    void *c = instance(0);
    unsigned speed = reference_of(kind->has_bodies ? "creepage_x" : "speed");
    double x[2] = {0.0, 0.0};
    fmi3Boolean truths[2] = {0, 0};
    const experiment e = {0};
    REFUSED(fmi3SetFloat64(c, &speed, 1, x, 2));
    REFUSED(fmi3GetFloat64(c, &speed, 1, x, 2));
    REFUSED(fmi3GetBoolean(c, &speed, 1, truths, 2));
    REFUSED(fmi3SetBoolean(c, &speed, 1, truths, 2));
    REFUSED(fmi3GetDirectionalDerivative(c, &speed, 1, &speed, 1, x, 1, x, 1)); /* too early */
    FINE(v->enter(c, &e));
    REFUSED(fmi3GetDirectionalDerivative(c, &speed, 1, &speed, 1, x, 2, x, 1));
    v->close(c);
}

/* ---- the kernel's functions that no FMU calls ------------------------------------------------ */

static void test_model_by_pointer(void) {
    component *core = instance(0);
    model_values direct = *core->now->values, called = direct;
    size_t failed;
    kind->evaluate(&core->table, &direct, 1);
    if (kind->search != NULL) kind->search(&core->table, &direct, 1);
    model_evaluate(kind, &core->table, &called, 1);
    CHECK(memcmp(&direct, &called, sizeof direct) == 0);
    CHECK(kind->advance(&core->table, &direct, 1, 1e-3, 1e-6, &failed) == NULL);
    CHECK(model_advance(kind, &core->table, &called, 1, 1e-3, 1e-6, &failed) == NULL);
    CHECK(memcmp(&direct, &called, sizeof direct) == 0);
    v->close(core);
}

/* The creepage of a node follows from its u. */
static void test_nodes(void) {
    for (uint32_t one_axis = 0; one_axis < 2; one_axis++)
        for (int i = 1; i < 20; i++) {
            creep_table shape = {.one_axis = one_axis, .twice_decay = 3, .root_k = 1};
            creep_node node;
            double u = 0.05 * i, k = 0.3;
            creep_table_node(&shape, u, k, 0.0, &node);
            CHECK(node.normalized_creepage > 0.0 && node.weight > 0.0);
            double t = one_axis ? node.normalized_creepage
                                : creep_table_coordinate(node.normalized_creepage, k);
            CHECK(fabs(t / (1.0 + t) - u) < 1e-12);
            double x = node.normalized_creepage, clean = node.line;
            creep_table_node(&shape, u, k, 1e-13, &node);
            CHECK(one_axis || fabs(node.normalized_creepage / x - 1.0) < 1e-6);
            CHECK(one_axis || fabs(node.line - clean) < 1e-6);
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
    enum { HEADER = 216, LAYERS = 88, NUMBERS = 64 };
    static const struct {
        size_t at, size;
        double value;
        const char *message;
    } wrong[] = {
        {72, 4, 2.0, "shape"},          {76, 4, 17.0, "shape"},   {80, 4, 17.0, "shape"},
        {84, 4, 2.0, "shape"},          {24, 4, 4097.0, "cells"}, {28, 4, 4097.0, "cells"},
        {24, 4, 0.0, "cells"},          {80, 4, 3.0, "corner"},   {64, 8, -1.0, "static_to"},
        {64, 8, NAN, "static_to"},      {32, 8, 0.0, "k_max"},    {32, 8, INFINITY, "k_max"},
        {HEADER, 8, NAN, "not finite"}, {HEADER, 8, 1.0, NULL},   {LAYERS, 4, 1.0, "with a layer"},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        double words[HEADER / 8 + 4] = {0.0}; /* one axis, one cell, four coefficients */
        char *bytes = (char *)words;
        uint32_t one = 1, whole = wrong[i].size == 4 ? (uint32_t)wrong[i].value : 0;
        creep_table table;
        memcpy(bytes + 24, &one, 4);
        memcpy(bytes + 28, &one, 4);
        words[4] = 2.0;
        memcpy(bytes + 72, &one, 4);
        if (wrong[i].size == 4) memcpy(bytes + wrong[i].at, &whole, 4);
        else memcpy(bytes + wrong[i].at, &wrong[i].value, 8);
        checked_file_frame(bytes, sizeof words, "CREEPTAB", TABLE_VERSION);
        const char *error = creep_table_open(&table, bytes, sizeof words);
        CHECK((error == NULL) == (wrong[i].message == NULL));
        CHECK(error == NULL || strstr(error, wrong[i].message) != NULL);
        checked_file_frame(bytes, sizeof words - 8, "CREEPTAB",
                           TABLE_VERSION); /* a coefficient is missing */
        CHECK(creep_table_open(&table, bytes, sizeof words - 8) != NULL);
        checked_file_frame(bytes, HEADER - 8, "CREEPTAB", TABLE_VERSION);
        CHECK(creep_table_open(&table, bytes, HEADER - 8) != NULL);
    }
    for (int i = 0; i < 3; i++) { /* one cell in each direction, and no other spline */
        double words[(HEADER + 4 * NUMBERS) / 8] = {0.0};
        char *bytes = (char *)words;
        const uint32_t cells[3] = {1, 1, i == 1 ? 2000 : 1};
        float number = i == 2 ? NAN : 1.0f;
        creep_table table;
        words[4] = 2.0;
        memcpy(bytes + LAYERS, cells, sizeof cells);
        memcpy(bytes + HEADER + 4 * (NUMBERS - 1), &number, 4);
        checked_file_frame(bytes, sizeof words, "CREEPTAB", TABLE_VERSION);
        CHECK((creep_table_open(&table, bytes, sizeof words) == NULL) == (i == 0));
    }
}

/* Files of what contacts and pairs of bodies add to a table. */
static void test_lateral_spin_files(void) {
    static const struct {
        double stiffness;
        size_t count;
        const char *message;
    } wrong[] = {{0.7, 5, NULL}, {0.0, 5, "shape"}, {NAN, 5, "not finite"}, {0.7, 4, "number of"}};
    double words[8] = {0.0};
    creep_forces pair;
    creep_table table = {.k_max = 1.0};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        lateral_spin_contact contact;
        size_t size = CHECKED_FILE_FRAME + wrong[i].count * sizeof(double);
        words[3] = wrong[i].stiffness;
        checked_file_frame(words, size, "PLANECON", 1);
        const char *error = lateral_spin_contact_open(&contact, words, size);
        CHECK((error == NULL) == (wrong[i].message == NULL));
        CHECK(error == NULL || strstr(error, wrong[i].message) != NULL);
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
    CHECK(resource_read(folder, "start_values.bin", &bytes, &size, message, sizeof message) ==
          NULL); /* the FMU's folder in place of its resources */
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
    for (int parallel = 0; parallel < 2; parallel++) {
        void *c = instance(0);
        int truths[2] = {1, parallel};
        double turning = 20.05, first = 0.0, last = 0.0;
        FINE(v->set_boolean(c, set, 2, truths));
        FINE(v->set(c, &omega, 1, &turning));
        FINE(start(v, c, 0.0));
        FINE(v->step(c, 0.0, 1e-3));
        FINE(v->get(c, &force, 1, &first));
        for (int i = 1; i < 20; i++) FINE(v->step(c, 1e-3 * i, 1e-3));
        FINE(v->get(c, &force, 1, &last));
        CHECK(first > 0.0 && isfinite(last));
        int follows = ((component *)c)->states > 0; /* with memory it is still to build up */
        CHECK(follows || fabs(last / first - 1.0) < 1e-2);
        v->close(c);
    }
}

/* A body that answers a held force in steps that are too long, so that it swings, is logged once.
 */
static void test_swing(void) {
    if (!has("parallel_exchange")) return;
    unsigned omega = reference_of("omega"), force = reference_of("creep_force");
    unsigned known[2] = {reference_of("effective_inverse_mass"), reference_of("radius")};
    const int before = messages, held = 0;
    const unsigned mode = reference_of("implicit");
    void *c = instance(0);
    double spin = 20.0, step = 2e-2, now, numbers[2];
    FINE(v->set_boolean(c, &mode, 1, &held));
    FINE(start(v, c, 0.0));
    FINE(v->get(c, known, 2, numbers));
    for (int i = 0; i < 300; i++) {
        FINE(v->set(c, &omega, 1, &spin));
        FINE(v->step(c, step * i, step));
        FINE(v->get(c, &force, 1, &now));
        spin += step * numbers[0] * (3e3 - now) / numbers[1];
    }
    CHECK(messages == before + 1);
    v->close(c);
}

/* Changes of the force element's values, of every output and by any variable. */
static force_element_output change_of(const creep_table *table, const model_values *values,
                                      const model_values *direction) {
    model_values change;
    model_tangent(model_of("force_element"), table, values, direction, 1, 1, &change);
    return change.output;
}

/* A force that is held at static friction changes with static friction alone. */
static void test_held_force(void) {
    creep_table table = {.k_max = 10.0};
    model_values values = {.contact = SOME_CONTACT};
    const model_values direction = {.contact = {.static_friction = 1.0}};
    force_element_parameters p = SOME_CONTACT;
    p.weakening_length = 1.3e-3;
    p.slope_reduction = 1.0;
    int held = 0;
    for (int i = 0; i < 40; i++) {
        force_element_input in = {.omega = 20.0 + 0.02 * i,
                                  .speed = 10.0,
                                  .normal_load = p.nominal_load,
                                  .friction_scale = 1.0};
        force_element_output out;
        values.contact = p;
        values.input = in;
        force_element_evaluate(&table, &p, &in, &out);
        if (out.force_limited == 0.0) continue;
        held++;
        CHECK(fabs(out.traction_coefficient / p.static_friction - 1.0) < 1e-12);
        CHECK(fabs(change_of(&table, &values, &direction).traction_coefficient - 1.0) < 1e-9);
        CHECK(out.force_gradient == 0.0);
    }
    CHECK(held > 0);
}

/* A derivative where a variable has no room to move: next to nothing, and between two limits. */
static void test_no_room(void) {
    creep_table table = {.k_max = 2.0};
    model_values values = {.contact = SOME_CONTACT, .effective_inverse_mass = 1.0};
    const model_values faster = {.input = {.speed = 1.0}};
    const model_values rougher = {.contact = {.static_friction = 1.0}};
    values.input = (force_element_input){
        .omega = 1e9, .speed = 1e9, .normal_load = 1.0, .friction_scale = 1e-6};
    values.contact.contact_modulus = 1e15;
    evaluate_force(&table, &values, 1);
    CHECK(isfinite(change_of(&table, &values, &faster).force_gradient));
    values.contact.static_friction = values.contact.kinetic_friction = 1e3;
    evaluate_force(&table, &values, 1);
    CHECK(change_of(&table, &values, &rougher).k_hat == 0.0);
}

/* Next to no slip at all: derivatives of what is below the smallest normal number are numbers. */
static void test_smallest_slip(void) {
    creep_table table = {.k_max = 2.0};
    force_element_parameters p = SOME_CONTACT;
    force_element_input in = {.omega = 7.5e-319,
                              .speed = 7.5e-319,
                              .normal_load = p.nominal_load,
                              .friction_scale = 1.2e-4};
    const model_values direction = {.input = {.normal_load = -1e-5}};
    force_element_output out, change;
    p.weakening_length = 1.3e-3;
    force_element_evaluate(&table, &p, &in, &out);
    CHECK(out.k_hat_limited > 0.0 && out.creepage != 0.0);
    const model_values values = {.contact = p, .input = in, .output = out};
    change = change_of(&table, &values, &direction);
    const double *numbers = (const double *)&change;
    for (size_t i = 0; i < sizeof change / sizeof *numbers; i++) CHECK(isfinite(numbers[i]));
}

int main(int count, char **arguments) {
    if (count != 5) return 2;
    resources = arguments[1];
    token = arguments[2];
    kind = model_of(arguments[3]);
    if (kind == NULL) return 2;
    test_numbers_of_values();
    for (int version = 3; version >= 2; version--) {
        v = fmi_of(version);
        test_logging();
        test_tokens_and_places();
        test_set_up();
        test_sum_of_steps();
        test_single_clock();
        test_lift_off();
        test_radius();
        test_values();
        test_friction();
        test_failing_step();
        test_standing();
        test_model_exchange();
        test_event();
        test_derivatives();
        test_saved_states();
        test_absent();
        test_null_pointers();
        test_parallel_exchange();
        test_swing();
    }
    test_names();
    test_model_by_pointer();
    test_nodes();
    test_roots();
    test_table_headers();
    test_lateral_spin_files();
    test_resources(arguments[4]);
    test_held_force();
    test_no_room();
    test_smallest_slip();
    return verdict();
}

/* A tool that calls an FMU's functions in any order with any values: the fuzzer's bytes are its
 * program.
 *
 * After each call: the status is one that there is, what was got is finite, a call that was refused
 * changed nothing, and every value is still within its limits. */
#include "absent.h"
#include "checked_file.h"
#include "fuzz_input.h"

enum operation {
    SET_REAL,
    GET_REAL,
    SET_BOOLEAN,
    GET_BOOLEAN,
    STEP,
    SET_UP,
    ENTER_INITIALIZATION,
    EXIT_INITIALIZATION,
    TERMINATE,
    RESET,
    SAVE,
    RESTORE,
    FORGET,
    SERIALIZE,
    DESERIALIZE,
    SENSITIVITY,
    ENTER_EVENTS,
    ENTER_CONTINUOUS,
    UPDATE,
    COMPLETED_STEP,
    SET_TIME,
    SET_STATES,
    GET_STATES,
    GET_DERIVATIVES,
    GET_INDICATORS,
    GET_NOMINALS,
    SET_LOGGING,
    OTHER,
    OPERATIONS
};

enum { MAX_STEPS = 6, SLOTS = 2 };

typedef struct {
    void *instance; /* null where it was refused */
    int stepped;
    void *slots[SLOTS]; /* saved states */
    unsigned char *bytes;
    size_t size; /* of the last one that was serialized */
} program;

static const fmi *v; /* the calls of this version */

/* ---- the calls ----------------------------------------------------------------------------- */

/* Mostly of variables of the first wheel or the second one. */
static unsigned take_reference(fuzz_input *in) {
    unsigned byte = take_byte(in);
    return byte == 255 ? take_word(in) : byte;
}

static unsigned *take_references(fuzz_input *in, size_t n) {
    unsigned *references = room(n, sizeof *references);
    for (size_t i = 0; i < n; i++) references[i] = take_reference(in);
    return references;
}

static double *take_numbers(fuzz_input *in, size_t n) {
    double *numbers = room(n, sizeof *numbers);
    for (size_t i = 0; i < n; i++) numbers[i] = take_number(in);
    return numbers;
}

static void check_finite(int status, size_t n, const double *values) {
    if (status > RESULT_WARNING) return;
    for (size_t i = 0; i < n; i++) MUST(isfinite(values[i]));
}

static int call_real(program *p, fuzz_input *in, int setting) {
    size_t n = take_byte(in) % 5;
    unsigned *of = take_references(in, n);
    double *values = setting ? take_numbers(in, n) : room(n, sizeof *values);
    int status = setting ? v->set(p->instance, of, n, values) : v->get(p->instance, of, n, values);
    if (!setting) check_finite(status, n, values);
    free(of);
    free(values);
    return status;
}

static int call_boolean(program *p, fuzz_input *in, int setting) {
    size_t n = take_byte(in) % 5;
    unsigned *of = take_references(in, n);
    int *values = room(n, sizeof *values);
    for (size_t i = 0; i < n; i++) values[i] = (int)(take_byte(in) & 1u);
    int status = setting ? v->set_boolean(p->instance, of, n, values)
                         : v->get_boolean(p->instance, of, n, values);
    free(of);
    free(values);
    return status;
}

/* From where the FMU is, or from anywhere. */
static int call_step(program *p, fuzz_input *in) {
    const component *core = p->instance;
    double point =
        take_byte(in) % 8 == 0 || core == NULL ? take_number(in) : core->now->values->time;
    double step = take_byte(in) % 8 == 0 ? take_number(in) : pow(10.0, -(take_byte(in) % 50) / 8.0);
    if (p->stepped++ >= MAX_STEPS) return -1; /* each may take long */
    return v->step(p->instance, point, step);
}

static experiment take_experiment(fuzz_input *in) {
    experiment e = {.has_tolerance = (int)(take_byte(in) & 1u)};
    if (e.has_tolerance) e.tolerance = take_number(in);
    e.start = take_number(in);
    e.has_stop = (int)(take_byte(in) & 1u);
    if (e.has_stop) e.stop = take_number(in);
    return e;
}

static int call_states(program *p, fuzz_input *in, enum operation which) {
    const component *core = p->instance;
    size_t n = take_byte(in) % 6;
    if (n == 5 && core != NULL) /* as many as there are */
        n = which == GET_INDICATORS ? component_indicators(core) : component_states(core);
    double *values = which == SET_STATES ? take_numbers(in, n) : room(n, sizeof *values);
    int(*const calls[])
        STATES = {v->set_states, v->get_states, v->get_rates, v->get_indicators, v->get_nominals};
    int status = calls[which - SET_STATES](p->instance, values, n);
    if (which != SET_STATES) check_finite(status, n, values);
    free(values);
    return status;
}

static int call_serialize(program *p, fuzz_input *in) {
    void *saved = p->slots[take_byte(in) % SLOTS];
    size_t size = 0;
    int status = v->size(p->instance, saved, &size);
    if (status != RESULT_OK) return status;
    unsigned given = take_byte(in);
    if (given >= 192) size -= given % size; /* too little room */
    unsigned char *bytes = room(size, 1);
    status = v->serialize(p->instance, saved, bytes, size);
    if (status != RESULT_OK) {
        free(bytes);
        return status;
    }
    free(p->bytes);
    p->bytes = bytes;
    p->size = size;
    return status;
}

/* The last state that was serialized, some bytes of it changed, or a part of it; with or without
 * the checksum that it must have. */
static int call_deserialize(program *p, fuzz_input *in) {
    unsigned how = take_byte(in), changes = take_byte(in) % 4;
    size_t size = how & 2 && p->size > 0 ? take_word(in) % p->size : p->size;
    unsigned char *bytes = room(size, 1);
    if (size > 0) memcpy(bytes, p->bytes, size);
    for (unsigned i = 0; i < changes; i++) {
        size_t at = CHECKED_FILE_FRAME + TOKEN_SIZE + offsetof(component_state, values);
        at += 8 * (size_t)(take_word(in) % 8192);
        double number = take_number(in);
        if (at + sizeof number <= size) memcpy(bytes + at, &number, sizeof number);
    }
    if (how & 1 && size >= CHECKED_FILE_FRAME)
        checked_file_frame(bytes, size, "CREEPSTA", STATE_VERSION);
    int status = v->deserialize(p->instance, bytes, size, &p->slots[take_byte(in) % SLOTS]);
    free(bytes);
    return status;
}

static int call_derivative(program *p, fuzz_input *in) {
    size_t n = take_byte(in) % 4, m = take_byte(in) % 4;
    int adjoint = (int)(take_byte(in) & 1u);
    unsigned *unknowns = take_references(in, n), *knowns = take_references(in, m);
    double *seed = take_numbers(in, adjoint ? n : m), *change = room(adjoint ? m : n, 8);
    int status = v->derivative(p->instance, adjoint, unknowns, n, knowns, m, seed, change);
    check_finite(status, adjoint ? m : n, change);
    free(unknowns);
    free(knowns);
    free(seed);
    free(change);
    return status;
}

static int call_logging(program *p, fuzz_input *in) {
    char text[64];
    const char *names[4] = {CATEGORIES[0], CATEGORIES[1], CATEGORIES[2], text};
    size_t n = take_byte(in) % 5;
    int on = (int)(take_byte(in) & 1u);
    take_text(in, text);
    return v->set_logging(p->instance, on, n, names);
}

/* Of a type or a mode that no variable here has, or more values than variables. */
static int call_other(void *c, unsigned which, size_t n) {
    static const unsigned of[2] = {0, 1};
    double reals[2] = {0.0};
    if (v->version == 2) {
        which %= ABSENT2 + REFUSED2;
        return which < ABSENT2 ? absent2(c, which, of, n) : refused2(c, which - ABSENT2);
    }
    which %= ABSENT3 + REFUSED3 + 2;
    if (which < ABSENT3) return absent3(c, which, of, n);
    if (which < ABSENT3 + REFUSED3) return refused3(c, which - ABSENT3);
    if (which == ABSENT3 + REFUSED3) return (int)fmi3EvaluateDiscreteStates(c);
    return n == 0 ? -1 : (int)fmi3GetFloat64(c, of, n, reals, n - 1);
}

static int call(program *p, fuzz_input *in, enum operation which) {
    void *c = p->instance;
    experiment e;
    switch (which) {
        case SET_REAL:
        case GET_REAL:
            return call_real(p, in, which == SET_REAL);
        case SET_BOOLEAN:
        case GET_BOOLEAN:
            return call_boolean(p, in, which == SET_BOOLEAN);
        case STEP:
            return call_step(p, in);
        case SET_UP:
            e = take_experiment(in);
            return v->set_up(c, &e);
        case ENTER_INITIALIZATION:
            e = take_experiment(in);
            return v->enter(c, &e);
        case SAVE:
            return v->save(c, &p->slots[take_byte(in) % SLOTS]);
        case RESTORE:
            return v->restore(c, p->slots[take_byte(in) % SLOTS]);
        case FORGET:
            return v->forget(c, &p->slots[take_byte(in) % SLOTS]);
        case SERIALIZE:
            return call_serialize(p, in);
        case DESERIALIZE:
            return call_deserialize(p, in);
        case SENSITIVITY:
            return call_derivative(p, in);
        case SET_TIME:
            return v->set_time(c, take_number(in));
        case SET_STATES:
        case GET_STATES:
        case GET_DERIVATIVES:
        case GET_INDICATORS:
        case GET_NOMINALS:
            return call_states(p, in, which);
        case SET_LOGGING:
            return call_logging(p, in);
        case OTHER: {
            unsigned number = take_byte(in);
            return call_other(c, number, take_byte(in) % 3);
        }
        case EXIT_INITIALIZATION:
            return v->leave(c);
        case TERMINATE:
            return v->terminate(c);
        case RESET:
            return v->reset(c);
        case ENTER_EVENTS:
            return v->events(c);
        case ENTER_CONTINUOUS:
            return v->continuous(c);
        case UPDATE:
            return v->update(c);
        default:
            return v->completed(c);
    }
}

/* ---- what must hold ------------------------------------------------------------------------ */

/* All but outputs, which a refused call may have brought up to date. */
static void check_unchanged(const component *core, const component_state *before) {
    const component_state *now = core->now;
    for (size_t i = 0; i < core->model->count; i++) {
        const model_variable *v = &core->model->variables[i];
        if (v->role == OUTPUT || v->role == DERIVATIVE || v->role == INDICATOR) continue;
        for (size_t w = 0; w < core->wheels; w++)
            MUST(model_get(v, &now->values[w]) == model_get(v, &before->values[w]));
    }
    for (size_t w = 0; w < core->wheels; w++)
        MUST(memcmp(&now->values[w].memory, &before->values[w].memory, sizeof(slip_memory)) == 0);
    size_t slip_work = vehicle_rails_numbers(&core->rails) * sizeof(double);
    MUST(memcmp(now->values + core->wheels, before->values + core->wheels, slip_work) == 0);
    MUST(now->stage == before->stage && now->tolerance == before->tolerance);
    MUST(now->stop_time == before->stop_time);
}

static void run_program(fuzz_input *in) {
    program p = {0};
    int messages = 0;
    char location[PATH_LENGTH], token[PATH_LENGTH], text[64];
    unsigned which_fmu = take_byte(in), flags = take_byte(in);
    const char *name = FMU_NAMES[which_fmu % FMUS];
    location_of(name, location);
    token_of(name, token);
    /* Seldom an invalid token or place. */
    if (flags >= 0xF8u) snprintf(token, sizeof token, "%s", take_text(in, text));
    else if (flags >= 0xF0u) snprintf(location, sizeof location, "%s", take_text(in, text));
    else if (flags >= 0xE8u) strcat(token, take_text(in, text));
    v = fmi_of(2 + (int)(which_fmu / FMUS % 2));
    p.instance =
        v->open(flags & 1, token, location, (flags & 2) != 0, flags & 4 ? &messages : NULL);
    const component *core = p.instance; /* the first member of an instance */
    while (in->left > 0) {
        enum operation which = (enum operation)(take_byte(in) % OPERATIONS);
        void *before = NULL;
        if (core != NULL) MUST(component_save(p.instance, &before) == RESULT_OK);
        int status = call(&p, in, which);
        MUST(status <= RESULT_ERROR); /* -1: nothing was called */
        if (core == NULL) {
            MUST(status < 0 || status == RESULT_ERROR);
            continue;
        }
        if (status > RESULT_WARNING) check_unchanged(core, before);
        free(before);
        check_values(core);
    }
    for (int i = 0; i < SLOTS; i++)
        if (core != NULL) MUST(v->forget(p.instance, &p.slots[i]) == RESULT_OK);
    v->close(p.instance);
    free(p.bytes);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_input in = {data, size};
    run_program(&in);
    return 0;
}

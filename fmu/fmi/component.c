#include "component.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "checked_file.h"
#include "file_io.h"
#include "half_space.h"
#include "token.h"

enum { MESSAGE_SIZE = 8192, NUMBER_SIZE = 40 };

const char *const CATEGORIES[CATEGORY_COUNT] = {"logStatusWarning", "logStatusDiscard",
                                                "logStatusError"};

/* Tolerance of the integrator, and the limits that it can keep to. */
static const double DEFAULT_TOLERANCE = 1e-6, MIN_TOLERANCE = 1e-10, MAX_TOLERANCE = 1e-2;

/* ---- log ----------------------------------------------------------------------------------- */

/* Print a number with a decimal point. A tool may have set a locale whose decimal separator is
 * another one, of one or several bytes. */
static const char *with_dot(char *text, int digits, double value) {
    snprintf(text, NUMBER_SIZE, "%.*g", digits, value);
    char *separator = text + strspn(text, "+-0123456789einfa");
    size_t length = strcspn(separator, "0123456789");
    if (length == 0 || !isfinite(value)) return text;
    memmove(separator + 1, separator + length, strlen(separator + length) + 1);
    *separator = '.';
    return text;
}

#define SHOWN_TO(digits, value) with_dot((char[NUMBER_SIZE]){0}, digits, value)
#define SHOWN(value) SHOWN_TO(6, value)

result component_log(component *self, result status, const char *format, ...) {
    char text[MESSAGE_SIZE];
    int category = (int)status - (int)RESULT_WARNING;
    if (self->logger == NULL || !(self->logged >> category & 1u)) return status;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    self->logger(self->shell, status, CATEGORIES[category], text);
    return status;
}

result component_set_logging(component *self, int on, size_t count, const char *const names[]) {
    unsigned mask = count == 0 ? ~0u : 0u;
    for (size_t i = 0; i < count; i++) {
        int known = 0;
        for (int c = 0; c < CATEGORY_COUNT; c++) {
            if (names[i] == NULL || strcmp(names[i], CATEGORIES[c]) != 0) continue;
            mask |= 1u << c;
            known = 1;
        }
        if (!known)
            return component_log(self, RESULT_ERROR, "%s is not a log category of this FMU",
                                 names[i] != NULL ? names[i] : "(null)");
    }
    self->logged = on || count == 0 ? mask : self->logged & ~mask;
    return RESULT_OK;
}

result component_called(component *self, const char *function, unsigned allowed) {
    if (allowed >> self->now->stage & 1u) return RESULT_OK;
    return component_log(self, RESULT_ERROR, "%s is not allowed in this state of the FMU",
                         function);
}

result component_null(component *self, const char *function, const char *pointer) {
    return component_log(self, RESULT_ERROR, "%s: the pointer %s is null", function, pointer);
}

/* ---- life ---------------------------------------------------------------------------------- */

const char *contactlib_token(void) { return CONTACTLIB_TOKEN; }

/* An FMU's token is the library's token, the kind of model and a digest of the FMU's contents,
 * joined by dashes: tools regard FMUs with the same token as the same FMU. */
static const model *model_of_token(const char *token) {
    size_t length = strlen(CONTACTLIB_TOKEN);
    if (token == NULL || strncmp(token, CONTACTLIB_TOKEN "-", length + 1) != 0) return NULL;
    const char *name = token + length + 1, *end = strchr(name, '-');
    char kind[32];
    size_t n = end != NULL ? (size_t)(end - name) : 0;
    if (n == 0 || n >= sizeof kind || strlen(token) >= TOKEN_SIZE) return NULL;
    memcpy(kind, name, n);
    kind[n] = '\0';
    return model_of(kind);
}

static int is_boolean(const model_variable *v) { return v->unit == TRUTH; }

static int is_in_range(const model_variable *v, double value) {
    if (is_boolean(v)) return value == 0.0 || value == 1.0;
    return value >= v->minimum && value <= v->maximum; /* false for NaN */
}

/* The first parameter, input or state whose value a tool could not have set, in an instance with
 * these start values; NULL if all can. */
static const model_variable *out_of_range(const model *m, const model_values *start,
                                          const model_values *values) {
    for (size_t i = 0; i < m->count; i++) {
        const model_variable *v = &m->variables[i];
        double value = model_get(v, values);
        if (!model_is_given(v)) continue;
        if (model_has(v, start) ? !is_in_range(v, value) : value != model_get(v, start)) return v;
    }
    return NULL;
}

static int states_in_range(const component *self) {
    for (size_t i = 0; i < self->states; i++) {
        const continuous_state *s = &self->state[i];
        if (!is_in_range(s->variable, model_get(s->variable, &self->now->values[s->wheel])))
            return 0;
    }
    return 1;
}

/* The file holds the number of wheels; parameters, inputs and states in the order of the list of
 * variables, each after the number of its values; and whether truth values are Booleans. */
static const char *read_start_values(component *self, const void *bytes, size_t size) {
    const model *m = self->model;
    const char *error = checked_file_error(bytes, size, "CREEPVAL", START_VALUES_VERSION);
    if (error != NULL) return error;
    const double *number = (const void *)((const char *)bytes + CHECKED_FILE_FRAME);
    size_t count = (size - CHECKED_FILE_FRAME) / sizeof *number, at = 1;
    if (size % sizeof *number != 0) return "the file ends within a number";
    if (count == 0 || !(number[0] >= 1.0 && number[0] <= MAX_WHEELS))
        return "the number of wheels is out of range";
    size_t wheels = self->wheels = (size_t)number[0];
    self->start = calloc(wheels, sizeof *self->start);
    if (self->start == NULL) return "out of memory";
    for (size_t i = 0; i < m->count; i++) {
        const model_variable *v = &m->variables[i];
        self->is_common[i] = v->part == ONCE;
        if (!model_is_given(v)) continue;
        int common = at < count && number[at] == 1.0,
            several = v->role == INPUT || v->role == STATE;
        size_t given = common ? 1 : wheels;
        if (at >= count || (!common && number[at] != (double)wheels) || count - at - 1 < given ||
            (wheels > 1 && common != (v->part == ONCE) && (several || !common)))
            return "the number of values is not the model's";
        self->is_common[i] = (unsigned char)common;
        for (size_t w = 0; w < wheels; w++)
            model_set(v, &self->start[w], number[at + 1 + (common ? 0 : w)]);
        at += 1 + given;
    }
    if (count != at + 1) return "the number of values is not the model's";
    self->has_booleans = number[at] != 0.0;
    for (size_t w = 0; w < wheels; w++) {
        self->start[w].spins = self->lateral_spin.shape.sets;
        if (out_of_range(m, &self->start[w], &self->start[w]) != NULL)
            return "the file holds a value out of range";
    }
    if (m->is_vehicle && self->start->whole.body.axles != (double)wheels)
        return "the number of axles is not that of wheels";
    for (size_t i = 0; i < m->count; i++)
        self->is_present[i] = (unsigned char)model_has(&m->variables[i], self->start);
    return NULL;
}

static result load_resources(component *self, const char *location) {
    char text[MESSAGE_SIZE];
    const char *file = "creep_table.bin", *error = NULL;
    void *values = NULL;
    size_t size;
    if (self->model->has_contact || self->model->has_bodies) {
        error = resource_read(location, file, &self->table_bytes, &size, text, sizeof text);
        if (error == NULL) error = creep_table_open(&self->table, self->table_bytes, size);
        if (error == NULL) {
            file = self->model->has_bodies ? "creep_forces.bin" : "lateral_spin_contact.bin";
            error = resource_read(location, file, &self->shape_bytes, &size, text, sizeof text);
        }
        if (error == NULL && self->model->has_bodies)
            error = creep_forces_open(&self->bodies, &self->table, self->shape_bytes, size);
        else if (error == NULL)
            error = lateral_spin_contact_open(&self->lateral_spin, self->shape_bytes, size);
        self->table.lateral_spin = &self->lateral_spin;
        self->table.bodies = &self->bodies;
    }
    if (error == NULL && self->model->is_vehicle) {
        file = "rails.bin";
        error = resource_read(location, file, &self->rails_bytes, &size, text, sizeof text);
        if (error == NULL) error = vehicle_rails_open(&self->rails, self->rails_bytes, size);
        self->table.rails = &self->rails;
    }
    if (error == NULL) {
        file = "start_values.bin";
        error = resource_read(location, file, &values, &size, text, sizeof text);
        if (error == NULL) error = read_start_values(self, values, size);
        free(values);
    }
    if (error == NULL) return RESULT_OK;
    return component_log(self, RESULT_ERROR, "resource %s: %s", file, error);
}

static size_t state_size(const component *self) {
    return sizeof(component_state) + self->wheels * sizeof(model_values) +
           vehicle_rails_numbers(&self->rails) * sizeof(double);
}

/* The slip work on the rails in a state. */
static double *slip_work(const component *self, const component_state *state) {
    return (double *)(void *)(state->values + self->wheels);
}

void component_reset(component *self) {
    memset(self->now, 0, state_size(self)); /* padding too: states are compared as bytes */
    memcpy(self->now->values, self->start, self->wheels * sizeof(model_values));
    self->now->stop_time = INFINITY;
    self->now->tolerance = DEFAULT_TOLERANCE;
    self->now->stage = INSTANTIATED;
    self->now->stale = self->now->unsearched = 1;
    vehicle_rails_begin(&self->rails, slip_work(self, self->now));
    self->warned = 0;
}

result component_open(component *self, int model_exchange, const char *token,
                      const char *resources) {
    self->model_exchange = model_exchange;
    self->model = model_of_token(token);
    if (self->model == NULL)
        return component_log(self, RESULT_ERROR,
                             "token %s must be this library's %s and a kind of model",
                             token != NULL ? token : "(null)", CONTACTLIB_TOKEN);
    memset(self->token, 0, sizeof self->token);
    strcpy(self->token, token);
    if (load_resources(self, resources) != RESULT_OK) return RESULT_ERROR;
    self->now = malloc(state_size(self));
    self->before = malloc(state_size(self));
    if (self->now == NULL || self->before == NULL)
        return component_log(self, RESULT_ERROR, "out of memory");
    size_t rates = 0;
    for (size_t i = 0; i < self->model->count; i++) {
        const model_variable *v = &self->model->variables[i];
        if (!self->is_present[i]) continue;
        for (size_t w = 0; w < (self->is_common[i] ? 1 : self->wheels); w++) {
            if (v->role == STATE) self->state[self->states++] = (continuous_state){v, NULL, w};
            if (v->role == DERIVATIVE) self->state[rates++].rate = v;
        }
    }
    component_reset(self);
    return RESULT_OK;
}

void component_close(component *self) {
    free(self->table_bytes);
    free(self->shape_bytes);
    free(self->rails_bytes);
    free(self->start);
    free(self->before);
    free(self->now);
}

result component_set_up(component *self, double start, int has_stop, double stop, int has_tolerance,
                        double tolerance) {
    if (!isfinite(start) || (has_stop && !(stop >= start)))
        return component_log(self, RESULT_ERROR,
                             "start time = %s must be finite, and stop time = %s not before it",
                             SHOWN(start), SHOWN(has_stop ? stop : INFINITY));
    if (has_tolerance && !(tolerance > 0.0 && tolerance < INFINITY))
        return component_log(self, RESULT_ERROR, "tolerance = %s must be finite and > 0",
                             SHOWN(tolerance));
    for (size_t w = 0; w < self->wheels; w++) self->now->values[w].time = start;
    self->now->stop_time = has_stop ? stop : INFINITY;
    if (has_tolerance) self->now->tolerance = fmin(MAX_TOLERANCE, fmax(MIN_TOLERANCE, tolerance));
    return RESULT_OK;
}

/* ---- values -------------------------------------------------------------------------------- */

/* The index of a reference's variable in the model's list. Without arrays the bits above it hold
 * the wheel. */
static size_t index_of(const component *self, unsigned reference) {
    return self->has_arrays ? reference : reference % MAX_VARIABLES;
}

size_t component_size(const component *self, unsigned reference) {
    size_t i = index_of(self, reference);
    return self->has_arrays && i < self->model->count && !self->is_common[i] ? self->wheels : 1;
}

size_t component_total_size(const component *self, const unsigned *references, size_t n) {
    size_t total = 0;
    for (size_t i = 0; i < n; i++) total += component_size(self, references[i]);
    return total;
}

/* The wheel of an element of a variable. */
static size_t wheel_of(const component *self, unsigned reference, size_t element) {
    return self->has_arrays ? element : reference / MAX_VARIABLES;
}

/* The variable of a value reference, if it is part of the model and has the expected type. */
static const model_variable *find(component *self, unsigned reference, int boolean) {
    const model *m = self->model;
    size_t i = index_of(self, reference);
    size_t wheels = i < m->count && !self->is_common[i] ? self->wheels : 1;
    if (i < m->count && wheel_of(self, reference, 0) < wheels) {
        const model_variable *v = &m->variables[i];
        int typed = is_boolean(v) && self->has_booleans;
        if (typed == boolean && self->is_present[i]) return v;
    }
    component_log(self, RESULT_ERROR, "value reference %u is not a %s variable", reference,
                  boolean ? "Boolean" : "real");
    return NULL;
}

/* A variable's name as the tool knows it. */
static const char *name_at(const component *self, const model_variable *v, size_t wheel,
                           char text[TOKEN_SIZE]) {
    if (self->wheels == 1 || self->is_common[v - self->model->variables]) return v->name;
    int derivative = v->role == DERIVATIVE; /* der(omega[3]) */
    snprintf(text, TOKEN_SIZE, "%.*s[%zu]%s", (int)strlen(v->name) - derivative, v->name, wheel + 1,
             derivative ? ")" : "");
    return text;
}

#define NAME_AT(v, wheel) name_at(self, v, wheel, (char[TOKEN_SIZE]){0})

/* Beginning of a message about one of several wheels or axles. */
static const char *wheel_text(const component *self, size_t wheel, char text[NUMBER_SIZE]) {
    const char *part = self->model->is_vehicle ? "axle" : "wheel";
    if (self->wheels > 1) snprintf(text, NUMBER_SIZE, "%s %zu: ", part, wheel + 1);
    return text;
}

#define WHEEL(wheel) wheel_text(self, wheel, (char[NUMBER_SIZE]){0})

/* Limits that involve two variables. */
static result check_friction(component *self, size_t wheel) {
    const model_values *v = &self->now->values[wheel];
    int any = self->model->has_bodies;
    double at_rest = any ? v->bodies.static_friction : v->contact.static_friction;
    double kinetic = any ? v->bodies.kinetic_friction : v->contact.kinetic_friction;
    if (!(at_rest >= kinetic))
        return component_log(
            self, RESULT_DISCARD,
            "%sstatic_friction = %s is out of range: must be at least kinetic_friction = %s",
            WHEEL(wheel), SHOWN(at_rest), SHOWN(kinetic));
    if (v->contact.softening_temperature > 0.0 && v->contact.slip_rate_decay > 0.0)
        return component_log(self, RESULT_DISCARD,
                             "%sslip_rate_decay = %s must be 0: friction already falls with "
                             "temperature; export the model without softening_temperature",
                             WHEEL(wheel), SHOWN(v->contact.slip_rate_decay));
    double held = self->table.static_to_kinetic, expected = held * kinetic;
    if (held > 0.0 && !(fabs(at_rest - expected) <= 1e-9 * expected))
        return component_log(
            self, RESULT_DISCARD,
            "%sstatic_friction / kinetic_friction = %s must be %s, the only ratio for "
            "which the table's law holds",
            WHEEL(wheel), SHOWN_TO(10, at_rest / kinetic), SHOWN_TO(10, held));
    return RESULT_OK;
}

/* a over b; 0 if b is not part of the model. */
static double ratio_of(double a, double b) { return b > 0.0 ? a / b : 0.0; }

/* The resources hold lateral force and spin of one shape and Poisson's ratio, from which some
 * parameters follow, and the variables are those with memory or without it. */
static result check_shape(component *self, size_t wheel) {
    const force_element_parameters *p = &self->now->values[wheel].contact;
    const force_element_parameters *given = &self->start[wheel].contact;
    const struct {
        const char *name;
        double value, expected;
    } held[] = {
        {"elliptic", p->elliptic, given->elliptic},
        {"memory", p->memory, given->memory},
        {"softening", p->softening, given->softening},
        {"poisson_ratio", p->poisson_ratio, given->poisson_ratio},
        {"contact_modulus / body_modulus", ratio_of(p->contact_modulus, p->body_modulus),
         ratio_of(given->contact_modulus, given->body_modulus)},
        {"semi_width / transverse_half_length",
         p->elliptic * ratio_of(p->semi_width, p->transverse_half_length),
         p->elliptic * ratio_of(given->semi_width, given->transverse_half_length)},
    };
    for (size_t i = 0; i < sizeof held / sizeof held[0]; i++)
        if (!(fabs(held[i].value - held[i].expected) <= 1e-9 * fabs(held[i].expected)))
            return component_log(self, RESULT_DISCARD,
                                 "%s%s = %s must be %s: table, lateral force and spin are those "
                                 "of the exported contact; export the model with the other one",
                                 WHEEL(wheel), held[i].name, SHOWN_TO(10, held[i].value),
                                 SHOWN_TO(10, held[i].expected));
    double slender = ratio_of(p->semi_width, p->transverse_half_length);
    if (p->elliptic == 0.0 && !(slender <= MAX_LINE_ASPECT * (1.0 + 1e-9)))
        return component_log(self, RESULT_DISCARD,
                             "%stransverse_half_length = %s is out of range: must be at least %s, "
                             "as semi_width = %s: a shorter line has no memory",
                             WHEEL(wheel), SHOWN(p->transverse_half_length),
                             SHOWN(p->semi_width / MAX_LINE_ASPECT), SHOWN(p->semi_width));
    return RESULT_OK;
}

/* Axles stand one behind another in whole bogies. */
static result check_axles(component *self) {
    const model_values *values = self->now->values;
    const vehicle_parameters *p = &values->whole.body;
    size_t each = (size_t)p->axles_per_bogie, n = self->wheels;
    if (p->axles != (double)n)
        return component_log(self, RESULT_DISCARD,
                             "axles = %s must be %zu, the number of the exported vehicle",
                             SHOWN(p->axles), n);
    if (n > 1 && ((double)each != p->axles_per_bogie || n % each != 0 || n == each))
        return component_log(self, RESULT_DISCARD,
                             "axles_per_bogie = %s must give two or more bogies of %zu axles",
                             SHOWN(p->axles_per_bogie), n);
    for (size_t i = 1; i < n; i++)
        if (!(values[i].axle.position > values[i - 1].axle.position))
            return component_log(
                self, RESULT_DISCARD,
                "position[%zu] = %s is out of range: must be above position[%zu] = "
                "%s",
                i + 1, SHOWN(values[i].axle.position), i, SHOWN(values[i - 1].axle.position));
    return RESULT_OK;
}

/* A contact under load needs an ellipse; a wheel that lifts off has neither. */
static result check_ellipse(component *self, size_t wheel) {
    const creep_forces_input *in = &self->now->values[wheel].ellipse;
    if (!(in->normal_load > MAX_LOAD_OF_NO_CONTACT)) return RESULT_OK;
    int along = in->semi_axis_x < in->semi_axis_y;
    double axis = along ? in->semi_axis_x : in->semi_axis_y;
    if (axis >= MIN_SEMI_AXIS) return RESULT_OK;
    return component_log(self, RESULT_DISCARD,
                         "%ssemi_axis_%s = %s is out of range: must be at least %s where there is "
                         "a normal_load, here %s; only a wheel without load has no contact",
                         WHEEL(wheel), along ? "x" : "y", SHOWN(axis), SHOWN(MIN_SEMI_AXIS),
                         SHOWN(in->normal_load));
}

/* Warnings that an instance gives once. */
typedef enum { ASPECT_LIMITED, SINGLE_CLOCK, TOO_LONG_STEP, TOLERANCE, NO_GRIP } single_warning;

static int is_first(component *self, single_warning warning) {
    int first = !(self->warned >> warning & 1u);
    self->warned |= 1u << warning;
    return first;
}

/* Log once that a wheel slips without a force because the tool has set no load or friction yet: it
 * may set unconnected inputs to zero. A wheel that lifts off had a load before, or is a vehicle's,
 * whose loads are no inputs. */
static void check_grip(component *self, size_t wheel) {
    const model_values *v = &self->now->values[wheel];
    const creep_forces_input *at = &v->ellipse;
    if (!(RUNNING >> self->now->stage & 1u)) return;
    int any = self->model->has_bodies;
    double normal_load = any ? at->normal_load : v->input.normal_load;
    double scale = any ? at->friction_scale : v->input.friction_scale;
    int load = self->model->is_vehicle || normal_load > 0.0, friction = scale > 0.0;
    int slips = any ? at->creepage_x != 0.0 || at->creepage_y != 0.0 || at->spin != 0.0
                    : v->contact.radius * v->input.omega != v->input.speed;
    if (!(slips || (load && friction)) || !is_first(self, NO_GRIP) || (load && friction)) return;
    component_log(
        self, RESULT_WARNING,
        "%sthere is no creep force although the wheel slips, as %s = %s since the start: is "
        "this input connected?",
        WHEEL(wheel), load ? "friction_scale" : "normal_load", SHOWN(load ? scale : normal_load));
}

/* Check what a tool has set since the outputs were last calculated. */
static result check_inputs(component *self) {
    int rubs = self->model->has_contact || self->model->has_bodies;
    if (self->now->stale && self->model->is_vehicle && check_axles(self) != RESULT_OK)
        return RESULT_DISCARD;
    for (size_t w = 0; self->now->stale && w < self->wheels; w++) {
        if (!rubs) continue;
        if (check_friction(self, w) != RESULT_OK) return RESULT_DISCARD;
        if (self->model->has_contact && check_shape(self, w) != RESULT_OK) return RESULT_DISCARD;
        if (self->model->has_bodies && check_ellipse(self, w) != RESULT_OK) return RESULT_DISCARD;
        check_grip(self, w);
    }
    return RESULT_OK;
}

static result evaluate(component *self) {
    if (!self->now->stale) return RESULT_OK;
    if (check_inputs(self) != RESULT_OK) return RESULT_DISCARD;
    self->model->evaluate(&self->table, self->now->values, self->wheels);
    self->now->stale = 0;
    self->now->unsearched = 1;
    for (size_t w = 0; w < self->wheels; w++) {
        const model_values *v = &self->now->values[w];
        if (v->forces.aspect_limited > 0.0 && is_first(self, ASPECT_LIMITED))
            component_log(self, RESULT_WARNING,
                          "%ssemi_axis_x / semi_axis_y = %s is outside 1/8 to 8: the shape of the "
                          "force is that of the nearer end",
                          WHEEL(w), SHOWN(v->ellipse.semi_axis_x / v->ellipse.semi_axis_y));
    }
    return RESULT_OK;
}

/* Truth values and their margins are stored next to each other, in the same order. */
#define DOUBLES_TO(last, first)                                                       \
    ((offsetof(force_element_output, last) - offsetof(force_element_output, first)) / \
     sizeof(double))
ASSERT_LAYOUT(all_flags, DOUBLES_TO(unloaded, falling_branch) + 1 == FLAG_COUNT);
ASSERT_LAYOUT(all_margins, DOUBLES_TO(load_margin, falling_margin) + 1 == FLAG_COUNT);
ASSERT_LAYOUT(second_margin, DOUBLES_TO(speed_regularized, falling_branch) ==
                                 DOUBLES_TO(speed_margin, falling_margin));
ASSERT_LAYOUT(third_margin, DOUBLES_TO(k_hat_limited, falling_branch) ==
                                DOUBLES_TO(k_hat_margin, falling_margin));
ASSERT_LAYOUT(fourth_margin, DOUBLES_TO(force_limited, falling_branch) ==
                                 DOUBLES_TO(force_margin, falling_margin));
ASSERT_LAYOUT(fifth_margin, DOUBLES_TO(length_limited, falling_branch) ==
                                DOUBLES_TO(length_margin, falling_margin));

static double *flags_of(model_values *values) { return &values->output.falling_branch; }

result component_update_flags(component *self) {
    if (evaluate(self) != RESULT_OK) return RESULT_DISCARD;
    for (size_t w = 0; w < self->wheels; w++)
        memcpy(self->now->held_flags[w], flags_of(&self->now->values[w]),
               sizeof self->now->held_flags[w]);
    return RESULT_OK;
}

result component_start(component *self) {
    if (check_inputs(self) != RESULT_OK) return RESULT_DISCARD;
    model_begin(self->model, &self->table, self->now->values, self->wheels);
    self->now->stale |= self->model->is_vehicle;
    if (component_update_flags(self) != RESULT_OK) return RESULT_DISCARD;
    double zone = 0.0;
    size_t wheel = 0;
    for (size_t w = 0; w < self->wheels; w++) {
        double found = self->now->values[w].output.process_zone_ratio;
        wheel = found > zone ? w : wheel;
        zone = fmax(zone, found);
    }
    self->now->stage = self->model_exchange ? EVENTS : STEPPING;
    /* The limit does not apply to a cohesive law, which is for one friction ratio. */
    if (!(zone > process_zone_limit()) || self->table.static_to_kinetic > 0.0 ||
        self->table.one_axis)
        return RESULT_OK;
    component_log(self, RESULT_WARNING,
                  "%sprocess_zone_ratio = %s is above %s: the weakening zone is too long for this "
                  "law, which assumes a short one",
                  WHEEL(wheel), SHOWN(zone), SHOWN(process_zone_limit()));
    return RESULT_OK;
}

result component_get(component *self, unsigned reference, int boolean, double *values) {
    const model_variable *v = find(self, reference, boolean);
    if (v == NULL) return RESULT_ERROR;
    size_t first = wheel_of(self, reference, 0), count = component_size(self, reference);
    if (v->role == OUTPUT || v->role == DERIVATIVE || v->role == INDICATOR) {
        if (boolean && self->now->stage == CONTINUOUS) { /* Booleans change at events only */
            size_t i = (v->offset - offsetof(model_values, output.falling_branch)) / sizeof(double);
            for (size_t k = 0; k < count; k++) values[k] = self->now->held_flags[first + k][i];
            return RESULT_OK;
        }
        if (evaluate(self) != RESULT_OK) return RESULT_DISCARD;
        if (model_is_searched(v) && self->now->unsearched) {
            self->model->search(&self->table, self->now->values, self->wheels);
            self->now->unsearched = 0;
        }
    }
    for (size_t k = 0; k < count; k++) values[k] = model_get(v, &self->now->values[first + k]);
    return RESULT_OK;
}

/* Advice if a solver's steps were too long for the state; else an empty text. */
static const char *advice(const component *self, const model_variable *v, size_t wheel,
                          char *text) {
    const model_values *values = &self->now->values[wheel];
    text[0] = '\0';
    if (v->role == STATE && (RUNNING >> self->now->stage & 1u) && self->model->has_contact)
        snprintf(text, MESSAGE_SIZE,
                 "; an explicit solver diverges if its steps are longer than %s s: take shorter "
                 "steps or an implicit solver",
                 SHOWN(model_explicit_step(self->model, &self->table, values)));
    return text;
}

static result check_range(component *self, const model_variable *v, size_t wheel, double value) {
    char text[MESSAGE_SIZE];
    if (is_in_range(v, value)) return RESULT_OK;
    return component_log(self, RESULT_DISCARD, "%s = %s is out of range: must be from %s to %s%s",
                         NAME_AT(v, wheel), SHOWN(value), SHOWN(v->minimum), SHOWN(v->maximum),
                         advice(self, v, wheel, text));
}

result component_check(component *self, unsigned reference, int boolean, const double *values) {
    const model_variable *v = find(self, reference, boolean);
    if (v == NULL) return RESULT_ERROR;
    size_t first = wheel_of(self, reference, 0), count = component_size(self, reference);
    int running = (RUNNING >> self->now->stage & 1u) != 0;
    int moving = self->now->stage == CONTINUOUS; /* a solver sets the states */
    const char *why = NULL;
    if (!model_is_given(v)) why = ": it is calculated";
    else if (running && (v->role == FIXED_PARAMETER || (v->role == STATE && !moving)))
        why = " after initialization";
    if (why != NULL)
        return component_log(self, RESULT_ERROR, "%s cannot be set%s", NAME_AT(v, first), why);
    result status = RESULT_OK;
    for (size_t k = 0; k < count && status == RESULT_OK; k++)
        status = check_range(self, v, first + k, values[k]);
    return status;
}

/* The start value of omega moves with the radius, so that the wheel rolls on as it did; one that
 * the tool has set stays. */
static void set_radius(model_values *now, const model_values *start, double radius) {
    const double *omega = &start->input.omega, *given = &start->contact.radius;
    int rolls = now->input.omega == *omega * (*given / now->contact.radius);
    if (rolls) now->input.omega = *omega * (*given / radius);
    now->contact.radius = radius;
}

/* Likewise of a vehicle's axle, which rolls at the start whatever its speed and its radius are. */
static void set_rolling(model_values *now, const model_variable *v, double value) {
    int rolls = now->input.omega == now->input.speed / now->contact.radius;
    model_set(v, now, value);
    if (rolls) now->input.omega = now->input.speed / now->contact.radius;
}

void component_put(component *self, unsigned reference, const double *values) {
    size_t i = index_of(self, reference), first = wheel_of(self, reference, 0);
    size_t count = self->is_common[i] ? self->wheels : component_size(self, reference);
    const model_variable *v = &self->model->variables[i];
    for (size_t k = 0; k < count; k++) {
        double value = values[self->is_common[i] ? 0 : k];
        model_values *now = &self->now->values[first + k];
        int is_radius = v->offset == offsetof(model_values, contact.radius);
        int is_speed = v->offset == offsetof(model_values, input.speed);
        if (self->model->is_vehicle && (is_radius || is_speed)) set_rolling(now, v, value);
        else if (is_radius) set_radius(now, &self->start[first + k], value);
        else model_set(v, now, value);
    }
    self->now->stale = 1;
}

/* ---- steps --------------------------------------------------------------------------------- */

/* The FMU's clock follows the tool's, as states hardly depend on time. Tools add up step sizes, so
 * the last bits of the time may differ, of a tool that counts in single precision those of a float.
 */
static result check_clock(component *self, double point, double step) {
    double now = self->now->values->time, off = fabs(point - now);
    if (off <= 1e-6 * step + 1e-12 * fabs(point)) return RESULT_OK;
    if (!(off <= FLT_EPSILON * fmax(fabs(point), fabs(now))))
        return component_log(self, RESULT_ERROR,
                             "communication point = %s must be the FMU's time %s",
                             SHOWN_TO(17, point), SHOWN_TO(17, now));
    if (is_first(self, SINGLE_CLOCK))
        component_log(self, RESULT_WARNING,
                      "communication point = %s is the FMU's time %s only in single precision: the "
                      "FMU follows this clock, whose error grows; keep time in double precision",
                      SHOWN_TO(17, point), SHOWN_TO(17, now));
    return RESULT_OK;
}

/* Whether the tool's time may be this far off its stop time. Over very many steps the error of the
 * sum grows far beyond the last bits. */
static int ends_in_time(const component *self, double end, double step) {
    int single = self->warned >> SINGLE_CLOCK & 1u;
    double slack = (single ? 0.5 : 1e-3) * step + 1e-9 * fabs(end);
    return end <= self->now->stop_time + slack;
}

result component_step(component *self, double point, double step) {
    model_values *values = self->now->values;
    double end = point + step;
    size_t failed = 0;
    if (!(step > 0.0 && isfinite(end)))
        return component_log(self, RESULT_ERROR,
                             "step size = %s must be > 0 and end at a finite time", SHOWN(step));
    if (check_clock(self, point, step) != RESULT_OK) return RESULT_ERROR;
    if (!ends_in_time(self, end, step))
        return component_log(self, RESULT_ERROR, "the step ends at %s, after the stop time %s",
                             SHOWN_TO(17, end), SHOWN_TO(17, self->now->stop_time));
    if ((self->model->moves ? check_inputs(self) : evaluate(self)) != RESULT_OK)
        return RESULT_DISCARD;
    memcpy(self->before, self->now, state_size(self));
    const char *error = self->model->advance(&self->table, values, self->wheels, step,
                                             self->now->tolerance, &failed);
    if (error != NULL) {
        double longest = 0.5 * values[failed].substep; /* so wild a motion needs more or fewer */
        memcpy(self->now, self->before, state_size(self));
        return component_log(
            self, RESULT_DISCARD,
            "%sthe step of %s s from %s s: %s; take steps of at most %s s, or a larger tolerance",
            self->model->is_vehicle ? "" : WHEEL(failed), SHOWN(step), SHOWN(point), error,
            SHOWN(longest));
    }
    if (!states_in_range(self)) {
        memcpy(self->now, self->before, state_size(self));
        return component_log(self, RESULT_DISCARD,
                             "the step of %s s from %s s: a state leaves its range", SHOWN(step),
                             SHOWN(point));
    }
    for (size_t w = 0; w < self->wheels; w++) {
        values[w].time = end;
        if (values[w].memory.too_long > 0.0 && is_first(self, TOO_LONG_STEP))
            component_log(self, RESULT_WARNING,
                          "%sthe force swings from step to step and is wrong: steps of %s s are "
                          "longer than the largest stable one of %s s at %s m/s; take shorter "
                          "steps, or set implicit = true",
                          WHEEL(w), SHOWN(step), SHOWN(values[w].memory.too_long),
                          SHOWN(values[w].input.speed));
        double held = values[w].held_tolerance, limit = values[w].max_substeps;
        if (!(held > self->now->tolerance) || !is_first(self, TOLERANCE)) continue;
        if (limit > 0.0)
            component_log(self, RESULT_WARNING,
                          "%sthe step of %s s from %s s: max_substeps = %s is too small for a "
                          "tolerance of %s, and the estimated error is %s; allow more substeps, or "
                          "take shorter steps",
                          WHEEL(w), SHOWN(step), SHOWN(point), SHOWN(limit),
                          SHOWN(self->now->tolerance), SHOWN(held));
        else
            component_log(self, RESULT_WARNING,
                          "%sthe step of %s s from %s s: the wheel swings too often on its "
                          "contact to follow it with a tolerance of %s; it was %s in a part of the "
                          "step, so only the mean is right; take shorter steps",
                          WHEEL(w), SHOWN(step), SHOWN(point), SHOWN(self->now->tolerance),
                          SHOWN(held));
    }
    if (self->states > 0) self->now->stale = 1; /* without states the outputs stay valid */
    return RESULT_OK;
}

/* ---- model exchange ------------------------------------------------------------------------ */

size_t component_states(const component *self) { return self->states; }

size_t component_indicators(const component *self) {
    size_t count = 0;
    for (size_t i = 0; i < self->model->count; i++)
        count += self->model->variables[i].role == INDICATOR;
    return count * self->wheels;
}

result component_complete(component *self) {
    if (self->model->complete == NULL) return RESULT_OK;
    if (evaluate(self) != RESULT_OK) return RESULT_DISCARD;
    self->model->complete(&self->table, self->now->values, self->wheels);
    self->now->stale = 1;
    return RESULT_OK;
}

static result check_count(component *self, const char *what, size_t count, size_t expected) {
    if (count == expected) return RESULT_OK;
    return component_log(self, RESULT_ERROR, "number of %s = %zu must be %zu", what, count,
                         expected);
}

result component_set_time(component *self, double time) {
    if (!isfinite(time))
        return component_log(self, RESULT_ERROR, "time = %s must be finite", SHOWN(time));
    for (size_t w = 0; w < self->wheels; w++) self->now->values[w].time = time;
    return RESULT_OK;
}

/* Read each state or its rate. */
static result get_each(component *self, int rates, size_t count, double *values) {
    if (check_count(self, "continuous states", count, component_states(self)) != RESULT_OK)
        return RESULT_ERROR;
    if (evaluate(self) != RESULT_OK) return RESULT_DISCARD;
    for (size_t i = 0; i < count; i++) {
        const continuous_state *s = &self->state[i];
        values[i] = model_get(rates ? s->rate : s->variable, &self->now->values[s->wheel]);
    }
    return RESULT_OK;
}

result component_get_states(component *self, size_t count, double *values) {
    return get_each(self, 0, count, values);
}

result component_get_derivatives(component *self, size_t count, double *values) {
    return get_each(self, 1, count, values);
}

result component_set_states(component *self, size_t count, const double *values) {
    if (check_count(self, "continuous states", count, component_states(self)) != RESULT_OK)
        return RESULT_ERROR;
    for (size_t i = 0; i < count; i++)
        if (check_range(self, self->state[i].variable, self->state[i].wheel, values[i]) !=
            RESULT_OK)
            return RESULT_DISCARD;
    for (size_t i = 0; i < count; i++) {
        const continuous_state *s = &self->state[i];
        size_t end = s->variable->part == ONCE ? self->wheels : s->wheel + 1;
        for (size_t w = s->wheel; w < end; w++)
            model_set(s->variable, &self->now->values[w], values[i]);
    }
    self->now->stale = 1;
    return RESULT_OK;
}

result component_get_indicators(component *self, size_t count, double *values) {
    if (check_count(self, "event indicators", count, component_indicators(self)) != RESULT_OK)
        return RESULT_ERROR;
    if (count == 0) return RESULT_OK;
    if (evaluate(self) != RESULT_OK) return RESULT_DISCARD;
    for (size_t i = 0; i < self->model->count; i++)
        for (size_t w = 0; self->model->variables[i].role == INDICATOR && w < self->wheels; w++)
            *values++ = model_get(&self->model->variables[i], &self->now->values[w]);
    return RESULT_OK;
}

result component_get_nominals(component *self, size_t count, double *values) {
    if (check_count(self, "continuous states", count, component_states(self)) != RESULT_OK)
        return RESULT_ERROR;
    for (size_t i = 0; i < count; i++) {
        const model_variable *v = self->state[i].variable;
        double start = model_get(v, &self->start[self->state[i].wheel]);
        const force_element_parameters *p = &self->start[self->state[i].wheel].contact;
        int held = v->part == IF_REMEMBERING && strcmp(v->unit, "N") == 0;
        double arm = held ? 1.0 : strcmp(v->unit, "N.m") == 0 ? p->radius : 0.0;
        values[i] =
            arm > 0.0 ? arm * p->kinetic_friction * p->nominal_load : fmax(fabs(start), 1.0);
    }
    return RESULT_OK;
}

/* ---- directional derivatives --------------------------------------------------------------- */

static int is_unknown(const model_variable *v) {
    return v->role == OUTPUT || v->role == DERIVATIVE || v->role == STATE || v->role == INDICATOR;
}

/* Check that these variables can be unknowns or knowns of a derivative. */
static result check_references(component *self, const unsigned *references, size_t count,
                               int unknown) {
    for (size_t i = 0; i < count; i++) {
        const model_variable *v = find(self, references[i], 0);
        if (v == NULL) return RESULT_ERROR;
        if (unknown ? is_unknown(v) : model_is_given(v) || v->role == INDEPENDENT) continue;
        return component_log(self, RESULT_ERROR, "%s cannot be the %s of a derivative",
                             NAME_AT(v, wheel_of(self, references[i], 0)),
                             unknown ? "unknown" : "known");
    }
    return RESULT_OK;
}

/* Add a change of an element of a known variable to the directions of its wheels. */
static void move(const component *self, unsigned reference, size_t element, double change,
                 model_values *direction) {
    const model_variable *v = &self->model->variables[index_of(self, reference)];
    size_t wheel = wheel_of(self, reference, element);
    size_t end = self->is_common[v - self->model->variables] ? self->wheels : wheel + 1;
    for (size_t w = wheel; w < end; w++)
        model_set(v, &direction[w], model_get(v, &direction[w]) + change);
}

/* Changes of the elements of the unknowns when the known variables change along a direction. */
static void follow(component *self, const model_values *direction, const unsigned *unknowns,
                   size_t count, double *changes) {
    const model *m = self->model;
    static const model_values still;
    int diagnostics = 0;
    for (size_t i = 0; i < count; i++) {
        const model_variable *v = &m->variables[index_of(self, unknowns[i])];
        diagnostics |= model_is_diagnostic(v) || model_is_searched(v);
    }
    size_t together = m->is_vehicle ? self->wheels : 1;
    for (size_t first = 0; first < self->wheels; first += together) {
        model_values change[MAX_AXLES];
        memset(change, 0, together * sizeof *change);
        for (size_t w = first, moved = 0; w < first + together && !moved; w++) {
            moved = memcmp(&direction[w], &still, sizeof still) != 0;
            if (moved)
                model_tangent(m, &self->table, &self->now->values[first], &direction[first],
                              together, diagnostics, change);
        }
        double *to = changes;
        for (size_t i = 0; i < count; i++) {
            const model_variable *v = &m->variables[index_of(self, unknowns[i])];
            for (size_t k = 0; k < component_size(self, unknowns[i]); k++, to++) {
                size_t w = wheel_of(self, unknowns[i], k);
                if (w >= first && w < first + together)
                    *to = model_get(v, v->role == STATE ? &direction[w] : &change[w - first]);
            }
        }
    }
}

/* A tool may give any seed, so the product may overflow. */
static result check_finite(component *self, size_t count, const double *values) {
    for (size_t i = 0; i < count; i++) {
        if (isfinite(values[i])) continue;
        return component_log(self, RESULT_DISCARD, "the derivative along this seed is not finite");
    }
    return RESULT_OK;
}

result component_derivative(component *self, int adjoint, const unsigned *unknowns,
                            size_t unknown_count, const unsigned *knowns, size_t known_count,
                            const double *seed, double *sensitivity) {
    if (check_references(self, unknowns, unknown_count, 1) != RESULT_OK ||
        check_references(self, knowns, known_count, 0) != RESULT_OK)
        return RESULT_ERROR;
    size_t elements = component_total_size(self, unknowns, unknown_count), place = 0;
    if (elements > MAX_VARIABLES * self->wheels) return check_count(self, "unknowns", elements, 0);
    if (evaluate(self) != RESULT_OK) return RESULT_DISCARD;
    model_values direction[MAX_WHEELS];
    memset(direction, 0, self->wheels * sizeof *direction);
    for (size_t i = 0; i < known_count; i++) {
        for (size_t k = 0; k < component_size(self, knowns[i]); k++, place++) {
            double column[MAX_VARIABLES * MAX_WHEELS], sum = 0.0;
            move(self, knowns[i], k, adjoint ? 1.0 : seed[place], direction);
            if (!adjoint) continue;
            follow(self, direction, unknowns, unknown_count, column);
            memset(direction, 0, self->wheels * sizeof *direction);
            for (size_t n = 0; n < elements; n++) sum += seed[n] * column[n];
            sensitivity[place] = sum;
        }
    }
    if (!adjoint) follow(self, direction, unknowns, unknown_count, sensitivity);
    return check_finite(self, adjoint ? place : elements, sensitivity);
}

/* ---- saved states -------------------------------------------------------------------------- */

static result state_error(component *self, const char *why) {
    return component_log(self, RESULT_ERROR, "saved state: %s", why);
}

static result keep(component *self, const component_state *state, void **saved) {
    if (saved == NULL) return state_error(self, "the pointer to it is null");
    if (*saved == NULL) *saved = malloc(state_size(self));
    if (*saved == NULL) return state_error(self, "out of memory");
    memcpy(*saved, state, state_size(self));
    return RESULT_OK;
}

result component_save(component *self, void **saved) { return keep(self, self->now, saved); }

result component_restore(component *self, const void *saved) {
    const unsigned foreign = self->model_exchange ? IN(STEPPING) : IN(EVENTS) | IN(CONTINUOUS);
    const component_state *state = saved;
    if (saved == NULL) return state_error(self, "it is null");
    if (foreign >> state->stage & 1u)
        return state_error(self, "it belongs to an instance with the other interface");
    memcpy(self->now, saved, state_size(self));
    return RESULT_OK;
}

result component_forget(component *self, void **saved) {
    (void)self;
    if (saved == NULL) return RESULT_OK;
    free(*saved);
    *saved = NULL;
    return RESULT_OK;
}

/* A serialized state: frame, token, state. */
enum { STATE_AT = CHECKED_FILE_FRAME + TOKEN_SIZE };

size_t component_serialized_size(const component *self) { return STATE_AT + state_size(self); }

result component_serialize(component *self, const void *saved, void *bytes, size_t size) {
    char *start = bytes;
    if (saved == NULL || size < component_serialized_size(self))
        return state_error(self, "it is null, or the buffer is too small");
    memcpy(start + CHECKED_FILE_FRAME, self->token, TOKEN_SIZE);
    memcpy(start + STATE_AT, saved, state_size(self));
    checked_file_frame(bytes, component_serialized_size(self), "CREEPSTA", STATE_VERSION);
    return RESULT_OK;
}

/* Whether a wheel of this FMU can have these values: a valid checksum does not prove it. */
static int are_possible(const component *self, size_t wheel, const model_values *values) {
    const double *memory = (const double *)&values->memory;
    if (out_of_range(self->model, &self->start[wheel], values) != NULL) return 0;
    for (size_t i = 0; i < self->model->count; i++)
        if (!isfinite(model_get(&self->model->variables[i], values))) return 0;
    for (size_t i = 0; i < sizeof values->memory / sizeof *memory; i++)
        if (!isfinite(memory[i])) return 0;
    const axle_state *past = &values->past;
    for (size_t i = 0; i < sizeof *past / sizeof past->load; i++)
        if (!(fabs((&past->load)[i]) <= 1e15)) return 0;
    if (past->length < 0.0 || floor(past->interval) != past->interval ||
        !(fabs(values->completed) <= 1e15))
        return 0;
    return isfinite(values->substep) && isfinite(values->held_tolerance) &&
           values->spins == self->start[wheel].spins &&
           (values->memory.known == 0.0 || values->memory.step > 0.0);
}

static int is_possible(const component *self, const component_state *state) {
    if (state->stage < INSTANTIATED || state->stage > TERMINATED) return 0;
    for (size_t w = 0; w < self->wheels; w++)
        if (!are_possible(self, w, &state->values[w])) return 0;
    if (!vehicle_rails_possible(&self->rails, slip_work(self, state))) return 0;
    return !isnan(state->stop_time) && state->tolerance >= MIN_TOLERANCE &&
           state->tolerance <= MAX_TOLERANCE;
}

result component_deserialize(component *self, const void *bytes, size_t size, void **saved) {
    const char *start = bytes;
    const char *error = checked_file_error(bytes, size, "CREEPSTA", STATE_VERSION);
    if (error != NULL) return state_error(self, error);
    if (size != component_serialized_size(self) ||
        memcmp(self->token, start + CHECKED_FILE_FRAME, TOKEN_SIZE) != 0)
        return state_error(self, "it belongs to another FMU");
    component_state *state = malloc(state_size(self)); /* the bytes may not be aligned */
    if (state == NULL) return state_error(self, "out of memory");
    memcpy(state, start + STATE_AT, state_size(self));
    result status = is_possible(self, state) ? keep(self, state, saved)
                                             : state_error(self, "a value in it is not possible");
    free(state);
    return status;
}
